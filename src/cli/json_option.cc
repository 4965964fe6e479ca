#include "cli/json_option.h"

#include <fmt/format.h>

#include "cli/files.h"
#include "core/json_text.h"

namespace mbv {

void JsonOption::AddTo(CLI::App* command) {
  command->add_option("--json", path_,
                      "write the result to this file, too; -: to standard output, the text then to "
                      "standard error");
}

int JsonOption::Write(const std::string& json, const std::vector<InputFile>& inputs) const {
  if (!wanted()) return 0;
  if (path_ != "-") return WriteWholeFile(path_, json, inputs);
  fmt::print("{}", json);
  return 0;
}

int JsonOption::Write(const nlohmann::ordered_json& json,
                      const std::vector<InputFile>& inputs) const {
  return wanted() ? Write(Dump(json), inputs) : 0;
}

nlohmann::ordered_json FindingObjects(const Diagnostics& diagnostics) {
  auto findings = nlohmann::ordered_json::array();
  for (const Finding& f : diagnostics.findings()) {
    findings.push_back({{"severity", f.severity == Severity::kError ? "error" : "warning"},
                        {"file", f.file},
                        {"line", f.line},
                        {"column", f.column},
                        {"message", f.message},
                        {"hint", f.hint}});
  }
  return findings;
}

}  // namespace mbv
