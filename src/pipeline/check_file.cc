#include "pipeline/check_file.h"

#include "analytic/closed_form.h"
#include "model_file/load_model.h"
#include "pipeline/load_robot.h"
#include "pipeline/prepare.h"
#include "pipeline/stiffness.h"

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

}  // namespace

Diagnostics CheckFile(const std::string& file) {
  const ScenarioHead head = ReadScenarioHead(file);
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
