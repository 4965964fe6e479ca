// What the audits hold equations against: beams by the textbook, motions by their own derivatives,
// linkages by the lengths of their rods.
#include <gtest/gtest.h>

#include <cmath>

#include "features/equation_audit/cabin_robot_audit.h"
#include "features/equation_audit/scara_robot_audit.h"
#include "features/equation_audit/stabilizing_platform_audit.h"
#include "features/equation_audit/stiffness_truth.h"
#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

const std::string kTruthModels = SourcePath("/models");

// Another number for each, so that none can stand for another.
Beam TextbookBeam() {
  Beam beam;
  beam.name = "beam";
  beam.section = {.area = 3e-4, .I_y = 5e-9, .I_z = 7e-9, .torsion = 11e-9};
  beam.youngs_modulus = 2e11;
  beam.shear_modulus = 8e10;
  return beam;
}

TEST(StiffnessTruth, AClampedBeamIsThatOfTheTextbook) {
  const Beam beam = TextbookBeam();
  const double L = 0.75, E = beam.youngs_modulus;
  const double EI_y = E * beam.section.I_y, EI_z = E * beam.section.I_z;
  Mat6 C = Mat6::Zero();
  C(0, 0) = L / (beam.shear_modulus * beam.section.torsion);
  C(1, 1) = L / EI_y;
  C(2, 2) = L / EI_z;
  C(3, 3) = L / (E * beam.section.area);
  C(4, 4) = L * L * L / (3 * EI_z);
  C(5, 5) = L * L * L / (3 * EI_y);
  C(2, 4) = C(4, 2) = L * L / (2 * EI_z);
  C(1, 5) = C(5, 1) = -L * L / (2 * EI_y);
  const Mat6 found = stiffness_audit::CantileverCompliance(beam, L);
  const Mat6 K = stiffness_audit::CantileverStiffness(beam, L);
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) {
      const double scale = std::sqrt(C(r, r) * C(c, c));
      EXPECT_NEAR(found(r, c), C(r, c), 1e-12 * scale) << r << c;
      EXPECT_NEAR((K * C)(r, c), r == c ? 1.0 : 0.0, 1e-11 * std::sqrt(C(c, c) / C(r, r)))
          << r << c;
    }
  }
  EXPECT_NEAR(K(4, 4), 12 * EI_z / (L * L * L), 1e-9 * K(4, 4));
  EXPECT_NEAR(K(2, 4), -6 * EI_z / (L * L), 1e-9 * K(4, 4));
}

TEST(StiffnessTruth, APerturbedBeamIsAnotherOne) {
  const Mat6 right = stiffness_audit::CantileverStiffness(TextbookBeam(), 0.75);
  using S = Section;
  for (double S::*member : {&S::area, &S::I_y, &S::I_z, &S::torsion}) {
    Beam perturbed = TextbookBeam();
    perturbed.section.*member *= 1.01;
    const Mat6 change = stiffness_audit::CantileverStiffness(perturbed, 0.75) - right;
    EXPECT_NEAR((change.diagonal().array() / right.diagonal().array()).abs().maxCoeff(), 0.01,
                1e-9);
  }
}

TEST(StiffnessTruth, TurnedAxesPermuteAMatrix) {
  Mat6 M = Mat6::Zero();
  M.diagonal() << 1, 2, 3, 4, 5, 6;
  M(0, 4) = M(4, 0) = 7;
  Mat3 R;  // E's x along W's y, y along z, z along x
  R << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  const Mat6 turned = stiffness_audit::InAxes(M, R);
  Vec6 diagonal;
  diagonal << 2, 3, 1, 5, 6, 4;
  EXPECT_EQ(turned.diagonal(), diagonal);
  EXPECT_EQ(turned(2, 3), 7);  // rotation about W's x is E's z; displacement along W's y is E's x
}

TEST(StiffnessTruth, RotationsCountAsDisplacementsAtTheLength) {
  const auto residual = [](stiffness_audit::MatrixKind kind, int r, int c) {
    RowMeter meter(TextRow("", "", "b", "", 1.0, ""));
    Mat6 perturbed = Mat6::Zero();
    perturbed(r, c) = 1.0;
    stiffness_audit::AddMatrix(&meter, kind, 4.0, Mat6::Zero(), perturbed, Mat6::Zero());
    return meter.Finish().residual_printed;
  };
  using enum stiffness_audit::MatrixKind;
  EXPECT_EQ(residual(kStiffness, 4, 5), 1.0);
  EXPECT_EQ(residual(kStiffness, 1, 5), 0.25);
  EXPECT_EQ(residual(kStiffness, 1, 2), 0.0625);
  EXPECT_EQ(residual(kCompliance, 1, 5), 4.0);
  EXPECT_EQ(residual(kCompliance, 1, 2), 16.0);
}

TEST(StiffnessTruth, WhatIsOpenedHangsLooseAndWhatIsClampedHolds) {
  const Mechanism robot = stiffness_audit::LoadElastic(kTruthModels, "scara_robot");
  const Joint& joint = robot.joints.back();
  EXPECT_EQ(stiffness_audit::Opened(robot, {joint.name}).joints.back().kind, JointKind::kFree);
  std::vector<Pose> X_WB(robot.bodies.size(), Pose::Identity());
  X_WB[static_cast<size_t>(joint.child)].translation() = Vec3(1, 2, 3);
  const Mechanism clamped = stiffness_audit::Clamped(robot, joint.name, X_WB);
  EXPECT_EQ(clamped.joints.back().kind, JointKind::kFixed);
  EXPECT_EQ(clamped.joints.back().parent, 0);
  EXPECT_TRUE(clamped.joints.back().X_PF.translation().isApprox(
      Vec3(1, 2, 3) + joint.X_CM.translation(), 1e-15));
}

// Sixth-order differences at step h leave h^6 of the seventh derivative and round-off over h.
TEST(MotionTruth, TheScarasPathHasItsDerivatives) {
  constexpr double h = 1e-3;
  for (const double t : {0.0, 0.137, 0.42}) {
    const auto at = scara_audit::PathAt(t);
    const auto X = [t](double d) { return scara_audit::PathAt(t + d).X; };
    const auto dX = [t](double d) { return scara_audit::PathAt(t + d).dX; };
    const double speed = at.dX.norm() + 1.0, acceleration = at.ddX.norm() + 1.0;
    EXPECT_LT((cabin_audit::FirstDifference(X, h) - at.dX).norm(), 1e-9 * speed) << t;
    EXPECT_LT((cabin_audit::FirstDifference(dX, h) - at.ddX).norm(), 1e-8 * acceleration) << t;
    EXPECT_LT((cabin_audit::SecondDifference(X, h) - at.ddX).norm(), 1e-7 * acceleration) << t;
  }
}

TEST(MotionTruth, DifferencesAreExactForPowersUpToSix) {
  const auto power = [](int n) {
    return [n](double t) { return Eigen::Vector2d(std::pow(1.0 + t, n), -std::pow(1.0 + t, n)); };
  };
  for (int n = 1; n <= 6; ++n) {
    EXPECT_NEAR(cabin_audit::FirstDifference(power(n), 0.125)[0], n, 1e-12) << n;
    EXPECT_NEAR(cabin_audit::SecondDifference(power(n), 0.125)[1], -n * (n - 1), 1e-11) << n;
  }
}

TEST(MotionTruth, ThePlatformsRatesAreThoseOfItsPositions) {
  const platform_audit::Case full = platform_audit::MakeCase(kTruthModels, 1.0);
  ASSERT_EQ(full.truth.size(), 61U);
  const double step_s = full.truth[1].time_s - full.truth[0].time_s;
  EXPECT_NEAR(full.truth.back().time_s, 12.0, 1e-12);
  // Cubics through samples 0.2 s apart leave a thousandth of motions of a period of 4 s.
  for (size_t n = 2; n + 2 < full.truth.size(); ++n) {
    const auto rate = [&](const auto& value) {
      return (8.0 * (value(n + 1) - value(n - 1)) - (value(n + 2) - value(n - 2))) /
             (12.0 * step_s);
    };
    const auto& limb = full.truth[n].limbs[1];
    const auto l = [&](size_t k) { return full.truth[k].limbs[1].l; };
    const auto l_rate = [&](size_t k) { return full.truth[k].limbs[1].l_rate; };
    const auto R = [&](size_t k) { return full.truth[k].limbs[1].side[0].R.value; };
    const auto z = [&](size_t k) { return full.truth[k].X_eo.translation().z(); };
    EXPECT_NEAR(rate(l), limb.l_rate, 2e-3) << n;
    EXPECT_NEAR(rate(l_rate), limb.l_acceleration, 4e-3) << n;
    EXPECT_NEAR(rate(R), limb.side[0].R.rate, 2e-3) << n;
    EXPECT_NEAR(rate(z), full.truth[n].motion_o[5], 2e-3) << n;
  }
}

TEST(PlanarTruth, ClosedPinsKeepTheLengthsOfTheirRods) {
  const LoadResult model = LoadModel(kTruthModels + "/cabin_robot/model.yaml");
  const cabin_audit::Lengths lengths = cabin_audit::LengthsOf(*model.mechanism);
  const auto motions = cabin_audit::RandomMotions(lengths, 5);
  ASSERT_EQ(motions.size(), 5U);
  for (const cabin_audit::SliderMotion& motion : motions) {
    for (const double t : {0.0, 0.01}) {
      const cabin_audit::Pins pins = cabin_audit::Close(lengths, motion, t);
      const Vec3 x = motion.x + t * motion.v + 0.5 * t * t * motion.a;
      EXPECT_NEAR((pins.B - pins.A).norm(), lengths.L1, 1e-13);
      EXPECT_NEAR((pins.C - pins.B).norm(), lengths.L2, 1e-13);
      EXPECT_NEAR((pins.D - pins.C).norm(), lengths.L3, 1e-13);
      EXPECT_NEAR((pins.F - pins.E).norm(), lengths.L4, 1e-13);
      EXPECT_NEAR(pins.A.x(), x[0], 1e-15);
      EXPECT_NEAR(pins.D.x(), x[1], 1e-15);
      EXPECT_NEAR(pins.F.x(), x[2], 1e-15);
      EXPECT_NEAR((pins.K() - pins.B).norm(), 0.5 * lengths.L2, 1e-13);
    }
  }
}

}  // namespace
}  // namespace mbv
