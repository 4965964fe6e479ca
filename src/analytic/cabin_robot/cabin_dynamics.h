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

#include "analytic/cabin_robot/planar_linkage.h"
#include "core/types.h"

namespace mbv::cabin {

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

}  // namespace mbv::cabin
