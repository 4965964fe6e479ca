// One scenario through all stages: load → witnesses → comparison → files.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "report/report.h"
#include "scenario/load_scenario.h"
#include "simulation/engine/simulation.h"
#include "verify/pictures.h"
#include "verify/run_options.h"

namespace mbv {

/// Runs a scenario file of any kind. Bad input and numerical trouble are in the outcome; only our
/// own bugs throw (InternalError).
[[nodiscard]] RunOutcome RunScenario(const std::string& file, const RunOptions& options);
/// The same of a scenario of motion.
[[nodiscard]] RunOutcome RunMotion(const std::string& file, const RunOptions& options);

// report.html of a run: gathers what the page shows from the stages.

/// Both as in RunOptions.
struct PageOptions {
  std::string script_link = {}, kept_audits = {};
};

/// `simulation` may be null (it did not run); `mechanism` is the one it simulated.
[[nodiscard]] std::string RunPage(const Report& report, const Mechanism& mechanism,
                                  const SimulationRun* simulation,
                                  const std::vector<PictureFile>& pictures,
                                  const ScenarioOptions& options, const PageOptions& page);

// Traces of a run in the binary formats of report/data/data_file.h, and what the columns of
// traces.csv are.

/// "csv", and DataFormat::word of all formats.
[[nodiscard]] std::vector<std::string> DataWords();

/// Names and bytes of the files that these words stand for; "" in `trouble`, or
/// what went wrong.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> DataFilesOf(
    const Report& report, const std::vector<std::string>& words, std::string* trouble);

}  // namespace mbv
