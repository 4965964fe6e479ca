// Joint reactions of the cabin robot, from the balances of its bodies. Terms as in
// planar_linkage.h and cabin_dynamics.h; a × b of planar vectors is a_x b_y − a_y b_x.
//
// Demand of a body [f; m]: what its joints must exert on it, inertia minus gravity minus loads, m
// about a named point. P stands for the platform with everything it carries.
//
//   (R1)  (C − D) × F_C = −m_CD,D,   (C − B) × F_C = m_P,B        F_C: CD on the platform
//   (R2)  F_B = f_P − F_C                                          AB on the platform
//   (R3)  (E − F) × F_E = −m_EF,F,   (E − A) × F_E = m_AB,A + (B − A) × F_B    F_E: EF on AB
//   (R4)  F_A = f_AB + F_B − F_E,  F_D = f_CD + F_C,  F_F = f_EF + F_E         sliders on links
//
// Each planar loop is redundant across its plane, so that only these components are definite. The
// joints of the wrist and of the rail carry the demands of everything beyond them.
#pragma once

#include <array>
#include <vector>

#include "analytic/cabin_robot/cabin_dynamics.h"
#include "core/trace.h"
#include "mechanism/mechanism.h"

namespace mbv::cabin {

/// Force, and moment about the origin of the body's frame, in world axes [N, N m].
struct BodyDemand {
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
};
using Demands = std::array<BodyDemand, kBodies>;

/// Inertia minus gravity of every body.
[[nodiscard]] Demands DemandsOf(const CabinGeometry& geometry,
                                const std::array<FrameMotion, kBodies>& frames);
/// Takes an external wrench off the demands.
void TakeOff(const BodyWrench& wrench, const std::array<FrameMotion, kBodies>& frames,
             Demands* demands);

/// Forces in the hinges of the planar linkage, in the plane; world axes [N].
struct HingeForces {
  Vec3 A, B, C, D, E, F;
};
/// (R1)–(R4). β + γ and α + ε must not vanish.
[[nodiscard]] HingeForces HingeForcesOf(const CabinGeometry& geometry,
                                        const std::array<FrameMotion, kBodies>& frames,
                                        const Demands& demands);

/// Writes reactions as JOINT.reaction.*: of the joint's parent on its child, about M's origin, in
/// F's axes, drive forces excluded.
class JointReactions {
 public:
  JointReactions() = default;
  /// Uses those of the joints A … F (fx, fy) and d1, th3, th4, d5, th6, payload_mount (all but the
  /// drive's component) that the mechanism has, parent and child as in the shipped model.
  explicit JointReactions(const Mechanism& mechanism);

  [[nodiscard]] const std::vector<Channel>& channels() const { return channels_; }
  /// Writes channels().size() values.
  void Write(const CabinGeometry& geometry, const std::array<FrameMotion, kBodies>& frames,
             const Demands& demands, double* values) const;

 private:
  struct Entry {
    Vec3 HingeForces::*hinge = nullptr;  // or everything beyond:
    int child = 0;                       // body index
    int parent = -1;                     // −1: the world
    Mat3 R_PF = Mat3::Identity();
    std::array<bool, 6> component{};  // of [f; m]
  };
  void Add(const Mechanism& mechanism, const char* joint, int parent, int child,
           Vec3 HingeForces::*hinge);

  std::vector<Entry> entries_;
  std::vector<Channel> channels_;
};

}  // namespace mbv::cabin
