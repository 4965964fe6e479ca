// Rigid-body dynamics of the cabin robot in its eight drive coordinates.
//
// q = (d1, X1, X2, X3, th3, th4, d5, th6): rail, the three sliders of the planar linkage, and the
// wrist in modified Denavit–Hartenberg notation (Table 1). World: z along the rail, y up.
//
//   M(q) q̈ + h(q, q̇) + G(q) = τ + Jᵀ W      [Liu 2025, Eqs. 47–53, corrected: all eight drives,
//                                              every body, W acting on the end effector]
//
// evaluated as virtual work: τ = Σ_b J_vᵀ m (a − g) + J_ωᵀ (I ε + ω × I ω) − Jᵀ W over the 13
// bodies; the planar linkage stands for the machine's two parallel linkages (pair sums).
#pragma once

#include <array>
#include <vector>

#include "analytic/cabin_robot/position.h"
#include "base/types.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"

namespace mbv::cabin_robot {

inline constexpr int kDrives = 8;
enum DriveIndex { kRail, kX1, kX2, kX3, kTh3, kTh4, kD5, kTh6 };

using Jac = Eigen::Matrix<double, 3, kDrives>;
using Vec8 = Eigen::Matrix<double, kDrives, 1>;

enum BodyIndex {
  kCarriage,
  kSliderA,
  kSliderD,
  kSliderF,
  kAB,
  kCD,
  kEF,
  kPlatform,
  kSupport,
  kFlip,
  kTable,
  kSlewing,
  kPayload,
  kBodies
};

/// Names in the model, in the order of DriveIndex and BodyIndex.
inline constexpr std::array<const char*, kDrives> kDriveNames = {"d1",  "X1",  "X2", "X3",
                                                                 "th3", "th4", "d5", "th6"};
inline constexpr std::array<const char*, kBodies> kBodyNames = {
    "carriage", "sliderA", "sliderD", "sliderF", "AB",      "CD",     "EF",
    "platform", "support", "flip",    "table",   "slewing", "payload"};

struct BodyData {
  double mass = 0.0;
  Vec3 com = Vec3::Zero();      ///< in the body frame [m]
  Mat3 inertia = Mat3::Zero();  ///< about the COM, body axes [kg m²]
};

/// Modified Denavit–Hartenberg lengths of Table 1 [m].
struct WristGeometry {
  double a2 = 0.0, d3 = 0.0, a3 = 0.0, a4 = 0.0, d6 = 0.0;
};

/// Motion of one body frame: Jacobians multiply q̇; accelerations are the true ones (q̈ included).
struct FrameMotion {
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero();
  Vec3 w = Vec3::Zero(), e = Vec3::Zero();  ///< angular velocity and acceleration
  Vec3 v = Vec3::Zero(), a = Vec3::Zero();  ///< of the origin
  Jac Jv = Jac::Zero(), Jw = Jac::Zero();
};

struct CabinGeometry {
  PlanarGeometry planar;
  WristGeometry wrist;
  std::array<BodyData, kBodies> bodies;
  Vec3 gravity = Vec3(0.0, -9.81, 0.0);
};

/// A drive coordinate's position, velocity and acceleration for the five drives outside the plane.
struct OuterDrives {
  Motion1 d1, th3, th4, d5, th6;
};

/// Frames of all 13 bodies; `planar` must be solved.
void ComputeFrames(const CabinGeometry& geometry, const PlanarState& planar,
                   const OuterDrives& outer, std::array<FrameMotion, kBodies>* frames);

/// External wrench at point Q of a body.
struct BodyWrench {
  int body = 0;
  Vec3 p_BoQ_B = Vec3::Zero();
  Vec3 force_W = Vec3::Zero(), moment_W = Vec3::Zero();
};

/// Drive forces [N, N m] in the order of `DriveIndex`.
[[nodiscard]] Vec8 DriveForces(const CabinGeometry& geometry,
                               const std::array<FrameMotion, kBodies>& frames);
/// The part −JᵀW of one external wrench.
[[nodiscard]] Vec8 DriveForcesOf(const std::array<FrameMotion, kBodies>& frames,
                                 const BodyWrench& wrench);
/// Joint-space mass matrix M (8×8).
[[nodiscard]] Eigen::Matrix<double, kDrives, kDrives> MassMatrix(
    const CabinGeometry& geometry, const std::array<FrameMotion, kBodies>& frames);

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

}  // namespace mbv::cabin_robot
