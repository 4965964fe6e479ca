// The cabin robot's elastic constants written by hand, and beams and limbs by integration of unit
// loads.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "analytic/cabin_robot/stiffness.h"
#include "math/spatial.h"

namespace mbv::cabin_robot {

inline constexpr double kDeg = std::numbers::pi / 180;
inline constexpr double kAlgebra = 1e-11;

/// Constants of models/cabin_robot/elastic.yaml, with the paper's torsion constant.
inline StiffnessParameters Paper() {
  StiffnessParameters p;
  p.planar = {0.52, 0.42, 0.5, 0.28};
  p.wrist = {0.0, 0.261, 0.485, 0.05, 0.01};
  p.w = 0.24;
  p.E = 71e9;
  p.G = 26.7e9;
  p.torsion_printed = true;
  p.sections = {{{0.08, 0.07},
                 {0.06, 0.05},
                 {0.06, 0.05},
                 {0.32, 0.12},
                 {0.32, 0.07},
                 {0.3, 0.08},
                 {0.24, 0.2}}};
  return p;
}

inline StiffnessPose FirstPose() { return {0.0, 0.36, 0.0, 90 * kDeg, 0.0, -0.2}; }
inline StiffnessPose SecondPose() { return {0.03, 0.33, 6 * kDeg, 40 * kDeg, -35 * kDeg, -0.31}; }

inline std::vector<StiffnessPose> RandomPoses(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<StiffnessPose> poses;
  poses.reserve(static_cast<size_t>(count));
  for (int k = 0; k < count; ++k) {
    poses.push_back({uniform(-0.06, 0.06), uniform(0.30, 0.40), uniform(-8, 8) * kDeg,
                     uniform(-100, 100) * kDeg, uniform(-80, 15) * kDeg, uniform(-0.5, -0.05)});
  }
  return poses;
}

inline ToolStiffness At(const StiffnessPose& pose, LimbForm form = LimbForm::kCorrected,
                        const StiffnessParameters& p = Paper()) {
  ToolStiffness tool;
  const RunSummary summary = SolveStiffness(p, pose, form, &tool);
  EXPECT_TRUE(summary.ok()) << summary.message;
  return tool;
}

inline double RelativeDifference(const MatX& A, const MatX& B) { return (A - B).norm() / B.norm(); }

/// The part of A − B in entry (r, c), relative to the diagonal of B: blind to the entries' units.
inline double ScaledDifference(const MatX& A, const MatX& B) {
  double largest = 0.0;
  for (Eigen::Index r = 0; r < B.rows(); ++r) {
    for (Eigen::Index c = 0; c < B.cols(); ++c) {
      largest = std::max(largest, std::abs(A(r, c) - B(r, c)) / std::sqrt(B(r, r) * B(c, c)));
    }
  }
  return largest;
}

/// Three Gauss points on 0 … 1: exact for the squares of linear moments.
template <typename F>
auto Integrate(const F& f) -> decltype(f(0.0)) {
  const double node = std::sqrt(0.15);
  return (5 * f(0.5 - node) + 8 * f(0.5) + 5 * f(0.5 + node)) / 18;
}

/// Flexibility at the tip by unit loads; forces first, x along the beam, b along z.
inline Mat6 IntegratedFlexibility(const StiffnessParameters& p, StiffBeam beam, double length) {
  const RectSection& s = p.sections[beam];
  const double I_y = s.h * std::pow(s.b, 3) / 12, I_z = s.b * std::pow(s.h, 3) / 12;
  const double I_p = s.b * std::pow(s.h, 3) * (1.0 / 3 - 0.21 * s.h / s.b);
  const Eigen::Vector4d soft(1 / (p.E * s.b * s.h), 1 / (p.G * I_p), 1 / (p.E * I_y),
                             1 / (p.E * I_z));
  return length * Integrate([&](double x) {
           Eigen::Matrix<double, 4, 6> N = Eigen::Matrix<double, 4, 6>::Zero();
           N(0, 0) = 1;
           N.block<3, 3>(1, 0) = Skew(Vec3((1 - x) * length, 0, 0));
           N.block<3, 3>(1, 3).setIdentity();
           return Mat6(N.transpose() * soft.asDiagonal() * N);
         });
}

/// The strut limb by unit loads: in the plane from statics, across it from what meets at E.
struct LimbTruth {
  Mat3 in_plane, out_of_plane;
};
inline LimbTruth IntegratedLimb(const StiffnessParameters& p, double alpha, double epsilon) {
  const double L1 = p.planar.L1, L4 = p.planar.L4, psi = alpha + epsilon;
  const RectSection &s1 = p.sections[kBeamAB], &s4 = p.sections[kBeamEF];
  const double EA1 = p.E * s1.b * s1.h, EI1 = p.E * s1.b * std::pow(s1.h, 3) / 12;
  // Reactions at A (x, y) and strut force for loads (F_x, F_y, M_z) at B.
  Mat3 balance, loads;
  balance << 1, 0, -std::cos(psi), 0, 1, std::sin(psi), 0, 0, std::sin(psi) * L1 / 2;
  loads << 1, 0, 0, 0, 1, 0, 0, L1, 1;
  const Mat3 reaction = -balance.inverse() * loads;
  const auto energy = [&](double x) {
    // Axial force and moment at x·L1 from A, from the side of A.
    Eigen::RowVector3d N = -reaction.row(0), M = reaction.row(1) * x * L1;
    if (x > 0.5) {
      N += std::cos(psi) * reaction.row(2);
      M += std::sin(psi) * reaction.row(2) * (x - 0.5) * L1;
    }
    return Mat3(N.transpose() * N / EA1 + M.transpose() * M / EI1);
  };
  LimbTruth truth;
  truth.in_plane = L1 / 2 *
                       (Integrate([&](double x) { return energy(x / 2); }) +
                        Integrate([&](double x) { return energy(0.5 + x / 2); })) +
                   reaction.row(2).transpose() * reaction.row(2) * L4 / (p.E * s4.b * s4.h);

  // Across: stiffnesses of AE and EF at E add up; then EB.
  const std::array<int, 3> across = {2, 3, 4};
  const auto block = [&](const Mat6& C) { return Mat3(C(across, across)); };
  Mat3 turn = Mat3::Identity();  // (z, x, y) of EF → of AB
  turn.bottomRightCorner<2, 2>() =
      Eigen::Rotation2Dd(std::numbers::pi - epsilon - alpha).toRotationMatrix();
  const Mat3 C_half = block(IntegratedFlexibility(p, kBeamAB, L1 / 2));
  const Mat3 at_E =
      (C_half.inverse() +
       turn * block(IntegratedFlexibility(p, kBeamEF, L4)).inverse() * turn.transpose())
          .inverse();
  Mat3 lever = Mat3::Identity();  // load at B → at E: M_y = −F_z L1/2
  lever(2, 0) = -L1 / 2;
  truth.out_of_plane = C_half + lever.transpose() * at_E * lever;
  return truth;
}

}  // namespace mbv::cabin_robot
