// The start of a mechanism whose drives are pushed or servos: on its commanded motion, which guides
// find that are then let go.
#include "simulation/session.h"

namespace mbv::simulation {

RunSummary FindCommandedStart(EngineModel* engine, const DrivenSample& first, EngineState* start) {
  GuideDrives(true, engine);
  const DataHandle data = MakeData(*engine->m);
  ConstraintSystem system(*engine, data.get());
  ClosureSolver solver(&system);
  if (RunSummary summary = solver.Follow(HomePositions(*engine), first.position); !summary.ok()) {
    summary.time_s = 0.0;
    return summary;
  }
  SpinStopper spins(&system);
  if (RunSummary summary = spins.TakeLeastTurns(&solver, first); !summary.ok()) {
    summary.time_s = 0.0;
    return summary;
  }
  solver.SolveVelocity(first.velocity);
  spins.StopVelocity();
  start->qpos = Eigen::Map<const VecX>(data->qpos, engine->m->nq);
  start->qvel = Eigen::Map<const VecX>(data->qvel, engine->m->nv);
  return RunSummary::Done();
}

RunSummary PutAtCommandedStart(Session* s, const DrivenSample& first) {
  std::copy(s->start.qpos.begin(), s->start.qpos.end(), s->data->qpos);
  std::copy(s->start.qvel.begin(), s->start.qvel.end(), s->data->qvel);
  if (RunSummary summary = s->solver.Close(first.position); !summary.ok()) {
    summary.time_s = 0.0;
    return summary;
  }
  s->solver.CorrectVelocity(first.velocity);
  s->spins.StopVelocity();
  s->solver.SolveAcceleration(first.acceleration);
  return RunSummary::Done();
}

}  // namespace mbv::simulation
