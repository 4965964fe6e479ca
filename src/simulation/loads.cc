#include "simulation/loads.h"

#include <algorithm>

#include "simulation/load_inputs.h"

namespace mbv::simulation {

RunSummary CheckLoads(const EngineModel& engine, const Motion& motion) {
  for (const Load& load : motion.loads) {
    if (engine.PlannedOf(load.body) >= 0) {
      if (RunSummary summary = CheckLoadInputs(engine, load); !summary.ok()) return summary;
      continue;
    }
    return {.stop = Stop::kUnsupported,
            .message = "load '" + load.name + "' acts on the massless body '" +
                       engine.mechanism->bodies[load.body].name + "'",
            .where = load.name,
            .unit = {}};
  }
  return RunSummary::Done();
}

void Loads::Evaluate(double t_s, const mjData& d) {
  world_.resize(motion_.loads.size());
  for (size_t i = 0; i < world_.size(); ++i) {
    const Load& load = motion_.loads[i];
    WorldLoad& out = world_[i];
    out.body_id = engine_.body_id[engine_.PlannedOf(load.body)];
    const Pose X_WB = PoseOf(d, out.body_id);
    out.p_WQ = X_WB * load.p_BoQ_B;
    for (int c = 0; c < 3; ++c) {
      out.force[c] = mbv::Evaluate(load.force[c], t_s).value;
      out.moment[c] = mbv::Evaluate(load.moment[c], t_s).value;
    }
    if (!load.following.empty()) {
      const Vec6 part = FollowingPart(engine_, d, load, t_s);
      out.force += part.head<3>();
      out.moment += part.tail<3>();
    }
    if (!load.in_body_axes) continue;
    out.force = X_WB.linear() * out.force;
    out.moment = X_WB.linear() * out.moment;
  }
}

bool Loads::follow() const {
  return std::ranges::any_of(motion_.loads,
                             [](const Load& load) { return !load.following.empty(); });
}

void Loads::AddGeneralized(mjData* d, double* qfrc) const {
  for (const WorldLoad& load : world_) {
    mj_applyFT(engine_.m.get(), d, load.force.data(), load.moment.data(), load.p_WQ.data(),
               load.body_id, qfrc);
  }
}

}  // namespace mbv::simulation
