// External wrenches and spring-dampers as MuJoCo sees them.
#pragma once

#include <vector>

#include "mechanism/motion.h"
#include "simulation/engine/engine_model.h"

// Coordinates that loads follow, read from MuJoCo's own positions and velocities.

namespace mbv::simulation {

/// kUnsupported where a load follows a coordinate that MuJoCo does not have.
[[nodiscard]] RunSummary CheckLoadInputs(const EngineModel& engine, const Load& load);

/// What loads are in addition to their profiles. MuJoCo's joints count rotations; the angles of
/// outputs are counted here, from what was evaluated last.
class FollowingLoads {
 public:
  /// Both outlive the object.
  FollowingLoads(const EngineModel& engine, const Motion& motion);

  /// [force; moment] of load `l`, in its axes, at the data's position (tendons) and velocity
  /// (mj_comVel).
  [[nodiscard]] Vec6 PartOf(size_t l, const mjData& d, double t_s);
  /// The first part that was not finite.
  [[nodiscard]] const RunSummary& trouble() const { return trouble_; }

 private:
  // An angle when it was evaluated last.
  struct Angle {
    double time_s = kNan, value = 0.0, rate = 0.0;
  };
  [[nodiscard]] double Read(const StateFunction::Input& input, const mjData& d, double t_s,
                            Angle* angle) const;

  const EngineModel& engine_;
  const Motion& motion_;
  std::vector<std::vector<Angle>> angles_;  ///< per load: of all inputs of its parts
  RunSummary trouble_ = RunSummary::Done();
};

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
  Loads(const EngineModel& engine, const Motion& motion)
      : engine_(engine), motion_(motion), following_(engine, motion) {}

  void Evaluate(double t_s, const mjData& d);
  /// True if some load follows the state: then Evaluate() needs tendons and mj_comVel.
  [[nodiscard]] bool follow() const;
  /// The first load that was not finite; then nothing evaluated since is.
  [[nodiscard]] const RunSummary& trouble() const { return following_.trouble(); }
  [[nodiscard]] const std::vector<WorldLoad>& world() const { return world_; }
  /// Adds Jᵀ(load) of the loads last evaluated to `qfrc` (nv).
  void AddGeneralized(mjData* d, double* qfrc) const;

 private:
  const EngineModel& engine_;
  const Motion& motion_;
  FollowingLoads following_;
  std::vector<WorldLoad> world_;
};

}  // namespace mbv::simulation
