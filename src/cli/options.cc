#include "cli/options.h"

#include <fmt/format.h>
#include <charconv>

#include "base/demand.h"
#include "base/json_text.h"
#include "cli/files.h"
#include "cli/terminal.h"
#include "verify/version.h"

namespace mbv {

void AddAssemblyOption(CLI::App* command, std::vector<std::string>* texts) {
  command
      ->add_option("--assembly", *texts,
                   "CLOSURE=N: takes the N-th of the ways to close the loops of this closure that "
                   "are reported (repeatable)")
      ->allow_extra_args(false);
}

bool ReadAssembly(const std::vector<std::string>& texts, std::map<std::string, int>* assembly) {
  bool good = true;
  for (const std::string& text : texts) {
    const size_t at = text.rfind('=');
    const std::string number = at == std::string::npos ? "" : text.substr(at + 1);
    int n = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), n);
    if (at == 0 || error != std::errc() || end != number.data() + number.size() || n < 1) {
      Say(stderr, "--assembly {}: error: write CLOSURE=N with N from 1, e.g. knee_loop=2\n", text);
      good = false;
      continue;
    }
    (*assembly)[text.substr(0, at)] = n;
  }
  return good;
}

void JsonOption::AddTo(CLI::App* command) {
  const CLI::App* above = command->get_parent();
  const bool nested = above != nullptr && above->get_parent() != nullptr;
  command_ = (nested ? above->get_name() + "_" : "") + command->get_name();
  command->add_option("--json", path_,
                      "write the result to this file, too; -: to standard output, the text then to "
                      "standard error");
}

int JsonOption::Write(const std::string& json, const std::vector<InputFile>& inputs) const {
  if (!wanted()) return 0;
  return Write(ParseJson<nlohmann::ordered_json>(json), inputs);
}

int JsonOption::Write(const nlohmann::ordered_json& json,
                      const std::vector<InputFile>& inputs) const {
  if (!wanted()) return 0;
  const std::string text = Text(json);
  if (path_ != "-") return WriteWholeFile(path_, text, inputs);
  fmt::print("{}", text);
  return 0;
}

std::string JsonOption::Text(const nlohmann::ordered_json& json) const {
  MBV_DEMAND(json.is_object(), command_);
  nlohmann::ordered_json whole = {
      {"schema", json.value("schema", fmt::format("mbverify.{}/1", command_))},
      {"program", fmt::format("mbverify {}", kVersion)}};
  whole.update(json);
  return Dump(whole);
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
