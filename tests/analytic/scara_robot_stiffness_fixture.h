// The SCARA robot's elastic constants written by hand, and an independent model of a limb: a chain
// of frames whose end is differentiated numerically, and beams by integration of unit loads.
#pragma once

#include <gtest/gtest.h>

#include <numbers>

#include "analytic/scara_robot/stiffness.h"
#include "math/spatial.h"
#include "tests/analytic/scara_robot_fixture.h"

namespace mbv::scara_robot {

/// Steel members of 8 mm and servos of 5000 N m/rad.
inline StiffnessParameters PaperStiffness() {
  StiffnessParameters p;
  p.geometry = PaperParameters();
  p.d = 0.05;
  p.E = 210e9;
  p.G = p.E / 2.6;
  p.diameter = 0.008;
  p.K_act = 5000.0;
  return p;
}

/// (−50, −50, −150) mm, 0.2 rad.
inline Vec4 ExamplePose() { return {-0.05, -0.05, -0.15, 0.2}; }

inline double RelativeDifference(const MatX& A, const MatX& B) { return (A - B).norm() / B.norm(); }

/// 6 × 6 algebra with condition numbers up to 1e5.
inline constexpr double kAlgebra = 1e-11;

inline PlatformStiffness At(const Vec4& X, const PrintedForms& printed = {},
                            const StiffnessParameters& p = PaperStiffness()) {
  PlatformStiffness at;
  const RunSummary summary = SolveStiffness(p, printed, X, &at);
  EXPECT_TRUE(summary.ok() || summary.stop == Stop::kSingular) << summary.message;
  return at;
}

inline StiffnessIndices Indices(const Vec4& X, const StiffnessParameters& p = PaperStiffness()) {
  const PlatformStiffness at = At(X, {}, p);
  return IndicesOf(at.K, at.C);
}

/// Flexibility of a clamped round member at its tip (rotations, then displacements; x along it):
/// ∫ Nᵀ diag(1/GI_x, 1/EI, 1/EI, 1/EA) N ds with N = (M_x, M_y, M_z, F_x) of a section under unit
/// loads at the tip. Three Gauss points integrate the squares of linear moments exactly.
inline Mat6 IntegratedFlexibility(const StiffnessParameters& p, double length) {
  const double A = std::numbers::pi * p.diameter * p.diameter / 4;
  const double I = std::numbers::pi * std::pow(p.diameter, 4) / 64;
  const Eigen::Vector4d soft(1 / (2 * p.G * I), 1 / (p.E * I), 1 / (p.E * I), 1 / (p.E * A));
  const double node = std::sqrt(0.6);
  const std::array<std::pair<double, double>, 3> points = {
      {{-node, 5.0 / 18}, {0.0, 8.0 / 18}, {node, 5.0 / 18}}};
  Mat6 flexibility = Mat6::Zero();
  for (const auto& [x, weight] : points) {
    const Vec3 arm((1 - x) * length / 2, 0, 0);  // section → tip
    Eigen::Matrix<double, 4, 6> N = Eigen::Matrix<double, 4, 6>::Zero();
    N.topLeftCorner<3, 3>().setIdentity();
    N.topRightCorner<3, 3>() = Skew(arm);
    N(3, 3) = 1;
    flexibility += weight * length * N.transpose() * soft.asDiagonal() * N;
  }
  return flexibility;
}

/// A small motion as a pose: rotation vector first, then displacement.
inline Pose SmallMotion(const Vec6& v) {
  Pose X = Pose::Identity();
  X.linear() = ExpRotation(v.head<3>());
  X.translation() = v.tail<3>();
  return X;
}

/// A frame with the given axes and origin.
inline Pose FrameAt(const Vec3& x, const Vec3& y, const Vec3& p) {
  Pose X = Pose::Identity();
  X.linear() << x, y, x.cross(y);
  X.translation() = p;
  return X;
}

/// The limb as a chain: at each station, given in the world at rest, a motion in the station's axes
/// carries everything after it. Coordinates: station k moves by SmallMotion(B_k c).
struct Station {
  Pose X_W;
  Eigen::Matrix<double, 6, Eigen::Dynamic> dofs;  ///< columns of unit motions in its axes
};

/// Twist of P (world axes) per coordinate of one station, by central differences.
inline MatX DifferentiatedColumns(const Station& station, const Vec3& p_WP) {
  constexpr double h = 1e-5;  // truncation 1e-10, round-off 1e-11
  MatX J(6, station.dofs.cols());
  Pose X_WP = Pose::Identity();
  X_WP.translation() = p_WP;
  for (Eigen::Index c = 0; c < J.cols(); ++c) {
    const auto moved = [&](double t) {
      return Pose(station.X_W * SmallMotion(t * station.dofs.col(c)) * station.X_W.inverse() *
                  X_WP);
    };
    const Pose plus = moved(h), minus = moved(-h);
    J.col(c) << LogRotation(plus.linear() * minus.linear().transpose()) / (2 * h),
        (plus.translation() - minus.translation()) / (2 * h);
  }
  return J;
}

}  // namespace mbv::scara_robot
