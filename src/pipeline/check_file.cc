#include "pipeline/check_file.h"

#include <cstdlib>

#include "analytic/closed_form.h"
#include "exchange/mechanism_check.h"
#include "input/yaml_reader.h"
#include "model_file/load_model.h"
#include "pipeline/load_robot.h"
#include "pipeline/prepare.h"
#include "pipeline/stiffness.h"
#include "pipeline/study.h"

namespace mbv {
namespace {

// The model, and whether the closed form of its name covers it.
Diagnostics CheckModel(const std::string& file) {
  LoadResult loaded = LoadRobot(file);
  if (!loaded.mechanism) return std::move(loaded.diagnostics);
  for (Finding& finding : FindUncovered(*loaded.mechanism)) {
    finding.file = file;
    finding.message = "the closed form will decline: " + finding.message;
    loaded.diagnostics.Add(std::move(finding));
  }
  return std::move(loaded.diagnostics);
}

// The node of a path, or the last one that there is on the way.
const YamlNode& NodeAt(const YamlNode& root, const std::vector<std::string>& path) {
  const YamlNode* at = &root;
  for (const std::string& step : path) {
    const YamlNode* next = at->Find(step);
    if (at->is_sequence()) {
      const size_t index = std::strtoul(step.c_str(), nullptr, 10);
      next = index < at->items.size() ? at->items[index].get() : nullptr;
    }
    if (next == nullptr) break;
    at = next;
  }
  return *at;
}

// mechanism.json as foreign witnesses get it. JSON is YAML: its tree knows the lines.
Diagnostics CheckMechanismFile(const std::string& file) {
  YamlReader reader(file), places(file);
  const auto text = reader.ReadFile();
  if (!text) return reader.diagnostics();
  const std::vector<JsonFinding> findings = CheckMechanismJson(*text);
  const YamlNodePtr root = findings.empty() ? nullptr : places.Parse(*text);
  for (const JsonFinding& finding : findings) {
    const std::string path = PathText(finding.path);
    const std::string message = (path.empty() ? "" : path + ": ") + finding.message;
    if (finding.line > 0 || !root) {
      reader.AddAt(Severity::kError, finding.line, finding.column, message, finding.hint);
    } else {
      reader.Error(NodeAt(*root, finding.path), message, finding.hint);
    }
  }
  return reader.diagnostics();
}

}  // namespace

Diagnostics CheckFile(const std::string& file) {
  if (file.ends_with(".json")) return CheckMechanismFile(file);
  const ScenarioHead head = ReadScenarioHead(file);
  if (head.is_study) return CheckStudy(file);
  if (!head.is_scenario) return CheckModel(file);
  Diagnostics diagnostics;
  if (head.is_stiffness()) {
    (void)PrepareStiffnessFile(file, {}, &diagnostics);
    return diagnostics;
  }
  (void)Prepare(file, {}, &diagnostics);
  return diagnostics;
}

}  // namespace mbv
