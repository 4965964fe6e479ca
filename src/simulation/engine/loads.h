// External wrenches and spring-dampers as MuJoCo sees them.
#pragma once

#include <vector>

#include "mechanism/motion.h"
#include "simulation/engine/engine_model.h"

// Coordinates that loads follow, read from MuJoCo's own positions and velocities.

namespace mbv::simulation {

/// kUnsupported where a load follows a coordinate that MuJoCo does not have.
[[nodiscard]] RunSummary CheckLoadInputs(const EngineModel& engine, const Load& load);

/// What a load is in addition to its profiles, at the data's position (tendons) and velocity
/// (mj_comVel): [force; moment], in the load's axes.
[[nodiscard]] Vec6 FollowingPart(const EngineModel& engine, const mjData& d, const Load& load,
                                 double t_s);

/// A load in world axes.
struct WorldLoad {
  int body_id = 0;                                   ///< MuJoCo's body
  Vec3 p_WQ = Vec3::Zero();                          ///< point of action [m]
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();  ///< [N], [N m]
};

/// A load on a body that MuJoCo does not have (merged) is not supported.
[[nodiscard]] RunSummary CheckLoads(const EngineModel& engine, const Motion& motion);

/// Evaluates the motion's loads at t for the data's current poses.
class Loads {
 public:
  Loads(const EngineModel& engine, const Motion& motion) : engine_(engine), motion_(motion) {}

  void Evaluate(double t_s, const mjData& d);
  /// True if some load follows the state: then Evaluate() needs tendons and mj_comVel.
  [[nodiscard]] bool follow() const;
  [[nodiscard]] const std::vector<WorldLoad>& world() const { return world_; }
  /// Adds Jᵀ(load) of the loads last evaluated to `qfrc` (nv).
  void AddGeneralized(mjData* d, double* qfrc) const;

 private:
  const EngineModel& engine_;
  const Motion& motion_;
  std::vector<WorldLoad> world_;
};

}  // namespace mbv::simulation
