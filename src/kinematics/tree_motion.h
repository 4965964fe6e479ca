// Poses and Jacobian of the spanning tree. Internal to kinematics/.
//
// The state is X_FM of every tree joint, not its coordinates, so that balls have no gimbal lock.
#pragma once

#include <vector>

#include "base/run_summary.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv::internal {

class TreeMotion {
 public:
  /// Joints with locked[j] get no columns.
  TreeMotion(const Mechanism& mechanism, const std::vector<bool>& locked);

  [[nodiscard]] int dofs() const { return dofs_; }
  /// True per column when it is an angle.
  [[nodiscard]] const std::vector<bool>& angular() const { return angular_; }

  /// Body poses; velocities zero. `X_FM` by joint index.
  [[nodiscard]] BodyStates States(const std::vector<Pose>& X_FM) const;
  /// 6·bodies × DOFs: twist of every body (world axes, body origins) per unit rate.
  [[nodiscard]] MatX Jacobian(const BodyStates& states) const;
  /// Moves every joint by the finite step `dq`.
  void Step(const VecX& dq, std::vector<Pose>* X_FM) const;

 private:
  const Mechanism& mechanism_;
  std::vector<int> first_column_;  ///< by joint, -1 without columns
  std::vector<bool> angular_;
  int dofs_ = 0;
};

}  // namespace mbv::internal

// Loads that follow the mechanism's state, from poses and twists of all bodies.

namespace mbv {

/// Brings what loads follow of `states->turns` to the poses, which lie within half a rotation of
/// those it was last brought to (or of home). It stands behind what elements, drives and prescribed
/// joints count.
void FollowAngles(const Mechanism& mechanism, const std::vector<FollowedAngle>& angles,
                  BodyStates* states);
/// The same at t = 0, where the angles of outputs begin near their start values.
void StartAngles(const Mechanism& mechanism, const std::vector<FollowedAngle>& angles,
                 BodyStates* states);
/// As PredictTurns(), which leaves this part as it is.
void PredictAngles(const Mechanism& mechanism, const std::vector<FollowedAngle>& angles,
                   double dt_s, BodyStates* states);
/// The angle where it was followed to last, else its start.
[[nodiscard]] double FollowedNear(const Mechanism& mechanism, const BodyStates& states,
                                  const FollowedAngle& angle);

/// The inputs of a function of the mechanism's state, angles in the turns that states count.
[[nodiscard]] std::vector<double> InputsOf(const Mechanism& mechanism, const BodyStates& states,
                                           const StateFunction& function);
/// What the function gives at the states, on their branch.
[[nodiscard]] double ValueAtStates(const Mechanism& mechanism, const BodyStates& states,
                                   const StateFunction& function, double t_s);
/// The load at the states: its sample with what follows from coordinates and rates added. `load`
/// and `time_s` of the sample must be set where there is such a part.
[[nodiscard]] LoadSample AtStates(const Mechanism& mechanism, const BodyStates& states,
                                  const LoadSample& sample);

/// What a drive is given at the states [N or N m].
[[nodiscard]] double ForceAtStates(const Mechanism& mechanism, const BodyStates& states,
                                   const DriveForce& force, double t_s);

/// Names the first load, given drive force or element that is not finite at the states.
[[nodiscard]] RunSummary CheckForcesAt(const Mechanism& mechanism, const BodyStates& states,
                                       double t_s, const std::vector<LoadSample>& samples,
                                       const std::vector<DriveForce>& forces = {});

}  // namespace mbv

// Closure rows of a mechanism in the coordinates of its spanning tree. Internal to kinematics/.

namespace mbv::internal {

/// Residuals of all closure rows, lengths relative to `length`; with their Jacobian (lengths of the
/// coordinates not scaled) when J is given.
[[nodiscard]] VecX ClosureResidual(const Mechanism& mechanism, const TreeMotion& tree,
                                   const BodyStates& states, double length, MatX* J);

/// s that makes |r + J s|² + μ |s|² least, by QR of the stacked matrix [J; √μ 1]: that keeps full
/// accuracy as μ → 0 and tolerates redundant rows and free motions alike.
[[nodiscard]] VecX DampedStep(const MatX& J, const VecX& r, double mu);

}  // namespace mbv::internal
