// Files named on the command line.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/inputs.h"
#include "scenario/load_scenario.h"

namespace mbv {

struct LoadOptions;

/// Scenario files: files as given; a folder stands for all scenarios below it, sorted, except those
/// in folders named must_fail further down. "" in `trouble` or what was wrong.
[[nodiscard]] std::vector<std::string> ExpandScenarios(const std::vector<std::string>& arguments,
                                                       std::string* trouble);

/// All .yaml files below a folder, sorted; a file stands for itself. Folders that cannot be read
/// are reported, one line each.
[[nodiscard]] std::vector<std::string> ExpandYaml(const std::string& argument,
                                                  std::vector<std::string>* unread);

/// "key=value" → pair; empty if there is no '=' or no key.
[[nodiscard]] std::optional<std::pair<std::string, std::string>> SplitSet(const std::string& text);

/// Words KEY=VALUE of an option ("--set") → values whose keys begin with `section`, appended; false
/// after saying what is wrong with one.
[[nodiscard]] bool ReadAssignments(const std::vector<std::string>& texts, const char* option,
                                   const char* example, std::vector<SetValue>* values,
                                   const std::string& section = "");

/// The scenario files to run, none of which needs a file in `written`; empty after saying what is
/// wrong, with 2 in `exit_code`.
[[nodiscard]] std::vector<std::string> FilesToRun(const std::vector<std::string>& arguments,
                                                  const std::vector<std::string>& written,
                                                  int* exit_code);

/// "m_p=1000" of --set → overrides; false after saying what is wrong with one.
[[nodiscard]] bool ReadParameters(const std::vector<std::string>& texts, LoadOptions* options);

/// Every file that a scenario is computed from, which is loaded for it.
[[nodiscard]] std::vector<InputFile> InputsOf(const std::string& scenario);

/// Before anything is computed: exit code 0, or 2 after saying that `path` (if not "") is one of
/// the files that `scenario` is computed from.
[[nodiscard]] int RefuseInput(const std::string& path, const std::string& scenario);

/// Why `content` may not replace the regular file `path`: what is there is of another format, or a
/// text that begins otherwise, so that mbverify did not write it. "" if it may.
[[nodiscard]] std::string ForeignFileReason(const std::string& path, const std::string& content);

/// The file of a model's name; empty after the message that there is none.
[[nodiscard]] std::optional<std::string> FindModelOrRefuse(const std::string& model);

/// Of a coordinate [rad or m].
struct NamedRange {
  std::string name;
  double low = 0.0, high = 0.0;
};
/// "pitch_deg=-50:30" of the options --range, where `names` are known and `unit_of` says "m" or
/// "rad" ("": any); empty after a message. A name that is not known is taken as it is.
[[nodiscard]] std::optional<std::vector<NamedRange>> ReadNamedRanges(
    const std::vector<std::string>& texts, const std::vector<std::string>& names,
    const std::function<std::string(const std::string&)>& unit_of);

/// NAME=VALUE of `option`, each name one of `names`; empty after a message.
[[nodiscard]] std::optional<std::map<std::string, double>> ReadNamedValues(
    const std::string& option, const std::vector<std::string>& texts,
    const std::vector<std::string>& names,
    const std::function<std::string(const std::string&)>& unit_of);

/// Writes a file whole or not at all (see WriteFile in base/files.h), but not over one of `inputs`
/// or over what mbverify did not write. Exit code: 0; after an error message 2 where `path` is
/// refused, 3 where it cannot be written.
[[nodiscard]] int WriteWholeFile(const std::string& path, const std::string& content,
                                 const std::vector<InputFile>& inputs);

}  // namespace mbv
