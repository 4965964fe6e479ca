// report.html of a run: gathers what the page shows from the stages.
#pragma once

#include <string>
#include <vector>

#include "pipeline/pictures.h"
#include "report/report.h"
#include "scenario/load_scenario.h"
#include "simulation/simulation.h"

namespace mbv {

/// Both as in RunOptions.
struct PageOptions {
  std::string script_link = {}, kept_audits = {};
};

/// `simulation` may be null (it did not run); `mechanism` is the one it simulated.
[[nodiscard]] std::string RunPage(const Report& report, const Mechanism& mechanism,
                                  const SimulationRun* simulation,
                                  const std::vector<PictureFile>& pictures,
                                  const ScenarioOptions& options, const PageOptions& page);

}  // namespace mbv
