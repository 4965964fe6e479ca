// External wrenches and gravity compensation as MuJoCo sees them.
#pragma once

#include <vector>

#include "mechanism/motion.h"
#include "simulation/engine/engine_model.h"

// Coordinates that loads follow, read from MuJoCo's own positions and velocities.

namespace mbv::simulation {

/// What loads and given drive forces are in addition to their profiles. MuJoCo's joints count
/// rotations; the angles of outputs are counted here, from what was evaluated last.
class FollowingLoads {
 public:
  /// Both outlive the object.
  FollowingLoads(const EngineModel& engine, const Motion& motion);

  /// [force; moment] of load `l`, in its axes, at the data's position (tendons) and velocity
  /// (mj_comVel).
  [[nodiscard]] Vec6 PartOf(size_t l, const mjData& d, double t_s);
  /// The same of drive force `k` [N or N m].
  [[nodiscard]] double ForceOf(size_t k, const mjData& d, double t_s);
  /// The first part that was not finite.
  [[nodiscard]] const RunSummary& trouble() const { return trouble_; }
  /// On which branch each of BranchingFunctions() was when it was evaluated last.
  [[nodiscard]] std::vector<int> Branches() const;
  /// From here on they are taken by these branches; empty: by the ones that hold.
  void FixBranches(std::vector<int> branches) { fixed_ = std::move(branches); }

 private:
  // An angle when it was evaluated last.
  struct Angle {
    double time_s = kNan, value = 0.0, rate = 0.0;
  };
  [[nodiscard]] double Read(const StateFunction::Input& input, const mjData& d, double t_s,
                            Angle* angle) const;
  [[nodiscard]] double FunctionAt(const StateFunction& function, const std::string& path,
                                  const mjData& d, double t_s, Angle* angle);

  const EngineModel& engine_;
  const Motion& motion_;
  std::vector<std::vector<Angle>> angles_;  ///< per load and drive force: of all inputs
  const std::vector<BranchingFunction> branching_;
  struct Evaluated {
    double time_s = 0.0;
    std::vector<double> inputs = {};
  };
  std::vector<Evaluated> evaluated_;  ///< per branching_
  std::vector<int> fixed_;
  RunSummary trouble_ = RunSummary::Done();
};

/// A load in world axes.
struct WorldLoad {
  int body_id = 0;                                   ///< MuJoCo's body
  Vec3 p_WQ = Vec3::Zero();                          ///< point of action [m]
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();  ///< [N], [N m]
};

/// What acts along a driven joint's coordinate against the gravity compensation that its drive
/// exerts: the drive's own force contains the opposite.
struct JointForce {
  size_t driven = 0;  ///< EngineModel::driven
  int dof = 0;
  double force = 0.0;  ///< [N or N m]
};

/// A load on a body that MuJoCo does not have (merged) is not supported, nor is an expression of a
/// coordinate that it does not have.
[[nodiscard]] RunSummary CheckLoads(const EngineModel& engine, const Motion& motion);

/// Evaluates the motion's loads, and gravity compensation as further ones, at t for the data's
/// current poses.
class Loads {
 public:
  Loads(const EngineModel& engine, const Motion& motion);

  void Evaluate(double t_s, const mjData& d);
  /// Per given drive force at what was evaluated last [N or N m].
  [[nodiscard]] const std::vector<double>& given() const { return given_; }
  /// True if some load or drive force follows the state: then Evaluate() needs the data's position,
  /// tendons and mj_comVel.
  [[nodiscard]] bool follow() const;
  /// The first load that was not finite; then nothing evaluated since is.
  [[nodiscard]] const RunSummary& trouble() const { return following_.trouble(); }
  /// FollowingLoads::Branches() of what was evaluated last.
  [[nodiscard]] std::vector<int> Branches() const { return following_.Branches(); }
  void FixBranches(std::vector<int> branches) { following_.FixBranches(std::move(branches)); }
  [[nodiscard]] const std::vector<WorldLoad>& world() const { return world_; }
  [[nodiscard]] const std::vector<JointForce>& joint_forces() const { return joint_forces_; }
  /// Adds Jᵀ(load) of the loads last evaluated to `qfrc` (nv).
  void AddGeneralized(mjData* d, double* qfrc) const;

 private:
  struct ExertedByDrive {
    int joint_id = 0;         ///< MuJoCo's
    double sign = 1.0;        ///< of the mechanism's axis along MuJoCo's
    std::vector<int> beyond;  ///< BodiesBeyond()
  };
  void AddCompensation(const mjData& d);

  const EngineModel& engine_;
  const Motion& motion_;
  FollowingLoads following_;
  const bool compensates_;
  std::vector<ExertedByDrive> exerted_by_drives_;
  std::vector<WorldLoad> world_;
  std::vector<double> given_;
  std::vector<JointForce> joint_forces_;  ///< per exerted_by_drives_
};

}  // namespace mbv::simulation
