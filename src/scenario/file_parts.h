// Parts of scenario files that all kinds of scenarios share.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "input/yaml_reader.h"
#include "mechanism/mechanism.h"
#include "model_file/load_model.h"
#include "scenario/load_scenario.h"

namespace mbv {

/// "sea_state", or "must_fail/wrong_mass" for a file in a folder below one named as the mechanism.
[[nodiscard]] std::string CaseName(const std::filesystem::path& file, const std::string& mechanism);

/// A finding if a part of a scenario's name breaks the rule of names (core/names.h): it becomes a
/// folder.
void CheckCaseName(const std::string& name, YamlReader* yaml);

/// Where each entry of a map was written: in `file`, or on the command line by --set.
[[nodiscard]] std::map<std::string, Finding> PlacesOf(const YamlNode& map, const std::string& file,
                                                      const std::vector<SetValue>& set);

/// The parameter of the mechanism that a name in a file means, with its unit.
[[nodiscard]] NameInUnit PlainName(const std::string& name, const Mechanism& mechanism);
/// Overrides whose names may end in a unit, by the parameters' own names in SI.
[[nodiscard]] Overrides InPlainUnits(const Overrides& overrides, const Mechanism& mechanism);

/// A finding if the mechanism has no parameter of this name; `path` names the section.
void CheckParameterName(const YamlEntry& entry, const std::string& path, const Mechanism& mechanism,
                        YamlReader* yaml);

/// `on`, `off`, `none` (and what YAML 1.1 users write for them); empty for anything else.
[[nodiscard]] std::optional<bool> AsSwitch(const YamlNode& node);

}  // namespace mbv
