#include "pipeline/check_file.h"

#include "mechanism/load_model.h"
#include "pipeline/witnesses.h"
#include "scenario/load_scenario.h"

namespace mbv {

Diagnostics CheckFile(const std::string& file) {
  if (!ReadScenarioHead(file).is_scenario) return LoadModel(file).diagnostics;
  ScenarioResult loaded = LoadScenario(file);
  Diagnostics diagnostics = loaded.diagnostics;
  if (!loaded.scenario) return diagnostics;
  const WitnessMechanisms mechanisms =
      LoadWitnessMechanisms(*loaded.scenario, *loaded.mechanism, &diagnostics);
  (void)MakeClosedForm(*loaded.scenario, mechanisms.analytic, &diagnostics);
  return diagnostics;
}

}  // namespace mbv
