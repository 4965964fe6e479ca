#include "pipeline/check_file.h"

#include "mechanism/load_model.h"
#include "pipeline/prepare.h"
#include "pipeline/stiffness.h"

namespace mbv {

Diagnostics CheckFile(const std::string& file) {
  const ScenarioHead head = ReadScenarioHead(file);
  if (!head.is_scenario) return LoadModel(file).diagnostics;
  Diagnostics diagnostics;
  if (head.is_stiffness()) {
    (void)PrepareStiffnessFile(file, {}, &diagnostics);
    return diagnostics;
  }
  (void)Prepare(file, {}, &diagnostics);
  return diagnostics;
}

}  // namespace mbv
