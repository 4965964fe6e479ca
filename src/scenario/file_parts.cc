#include "scenario/file_parts.h"

#include <fmt/format.h>

#include "base/files.h"
#include "base/text.h"
#include "scenario/load_scenario.h"

namespace mbv {

namespace fs = std::filesystem;

std::string CaseName(const fs::path& path, const std::string& mechanism) {
  const fs::path file = path.lexically_normal();
  fs::path name = file.stem();
  for (fs::path folder = file.parent_path(); folder.has_filename(); folder = folder.parent_path()) {
    if (folder.filename() == mechanism) return name;
    name = folder.filename() / name;
  }
  return file.stem();
}

void CheckCaseName(const std::string& name, YamlReader* yaml) {
  std::error_code error;
  if (!fs::is_regular_file(yaml->file(), error)) return;  // a pipe's name is the shell's
  for (const fs::path& part : fs::path(name)) {
    if (IsName(part.string())) continue;
    const std::string near = NearestName(part.string());
    yaml->AddAt(Severity::kError, 0, 0,
                fmt::format("the scenario's name '{}' violates: {}", part.string(), kNameRule),
                near.empty() ? "rename the file" : fmt::format("rename it, e.g. {}", near));
    return;
  }
}

std::map<std::string, Finding> PlacesOf(const YamlNode& map, const std::string& file,
                                        const std::vector<SetValue>& set) {
  std::map<std::string, Finding> places;
  for (const YamlEntry& entry : map.entries) {
    Finding place;
    if (entry.line < 0) {
      place = AtOption(set[static_cast<size_t>(-entry.line - 1)]);
    } else {
      place.file = file;
      place.line = entry.line;
      place.column = entry.column;
    }
    places[entry.key] = place;
  }
  return places;
}

NameInUnit PlainName(const std::string& name, const Mechanism& mechanism) {
  return SplitUnit(name, [&](const std::string& known) { return mechanism.HasParameter(known); });
}

Overrides InPlainUnits(const Overrides& overrides, const Mechanism& mechanism) {
  Overrides plain;
  for (const auto& [given, value] : overrides) {
    const auto [name, unit] = PlainName(given, mechanism);
    plain[name] = unit.to_si(value);
  }
  return plain;
}

void CheckParameterName(const YamlEntry& entry, const std::string& path, const Mechanism& mechanism,
                        YamlReader* yaml) {
  if (mechanism.HasParameter(PlainName(entry.key, mechanism).name)) return;
  std::vector<std::string> known;
  for (const Parameter& p : mechanism.parameters) known.push_back(p.name);
  yaml->Error(entry, fmt::format("{}: {} has no parameter '{}'", path, mechanism.name, entry.key),
              DidYouMean(entry.key, known));
}

std::optional<bool> AsSwitch(const YamlNode& node) {
  if (!node.is_scalar()) return {};
  for (const char* word : {"on", "true", "yes"}) {
    if (node.text == word) return true;
  }
  for (const char* word : {"off", "none", "false", "no"}) {
    if (node.text == word) return false;
  }
  return {};
}

}  // namespace mbv
