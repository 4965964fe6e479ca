#include "simulation/own_file.h"

#include "simulation/own_stepper.h"

namespace mbv {

OwnRun RunOwnFile(const OwnTask& task) {
  OwnRun run;
  std::vector<std::string> warnings;
  const simulation::EngineSession session(&warnings);
  try {
    simulation::OwnModel own;
    run.summary = simulation::MakeOwnModel(task, &own);
    run.facts = own.facts;
    if (!run.summary.ok()) return run;
    run.step_s = own.m->opt.timestep;
    simulation::OwnStepper stepper(task, own, &run);
    run.summary = stepper.Run();
  } catch (const simulation::EngineError& error) {
    run.summary = {.stop = Stop::kEngineFailure,
                   .message = std::string("MuJoCo: ") + error.what(),
                   .where = {},
                   .unit = {}};
  }
  return run;
}

}  // namespace mbv
