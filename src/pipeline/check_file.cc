#include "pipeline/check_file.h"

#include "mechanism/load_model.h"
#include "pipeline/prepare.h"

namespace mbv {

Diagnostics CheckFile(const std::string& file) {
  if (!ReadScenarioHead(file).is_scenario) return LoadModel(file).diagnostics;
  Diagnostics diagnostics;
  (void)Prepare(file, {}, &diagnostics);
  return diagnostics;
}

}  // namespace mbv
