// Weak directions, screws and contributions of compliances that can be read off by hand.
#include "features/stiffness/stiffness_measures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "math/spatial.h"

namespace mbv {
namespace {

constexpr double kAlgebra = 1e-12;

Mat6 Diagonal(double rx, double ry, double rz, double x, double y, double z) {
  return Vec6((Vec6() << rx, ry, rz, x, y, z).finished()).asDiagonal();
}

TEST(StiffnessMeasures, TheWeakestDirectionIsThatOfTheLargestCompliance) {
  const Mat6 C = Diagonal(1e-3, 5e-3, 2e-3, 1e-6, 2e-6, 4e-6);
  const WeakDirection shift = WeakestTranslation(C), turn = WeakestRotation(C);
  EXPECT_NEAR(std::abs(shift.direction.z()), 1.0, kAlgebra);
  EXPECT_NEAR(shift.stiffness * 4e-6, 1.0, kAlgebra);
  EXPECT_NEAR(std::abs(turn.direction.y()), 1.0, kAlgebra);
  EXPECT_NEAR(turn.stiffness * 5e-3, 1.0, kAlgebra);
}

TEST(StiffnessMeasures, WeakDirectionsTurnWithTheAxes) {
  const Mat3 R = RotRpy({0.3, -0.5, 0.9});
  Mat6 RR = Mat6::Zero();
  RR.topLeftCorner<3, 3>() = RR.bottomRightCorner<3, 3>() = R;
  const Mat6 C = RR * Diagonal(1e-3, 5e-3, 2e-3, 1e-6, 2e-6, 4e-6) * RR.transpose();
  EXPECT_NEAR(std::abs(WeakestTranslation(C).direction.dot(R.col(2))), 1.0, kAlgebra);
}

TEST(StiffnessMeasures, AHingeIsTheWeakestScrewAboutItsAxis) {
  // A soft hinge about z through (0.3, 0.1, 0) from the output, everything else stiff.
  const Vec3 p(0.3, 0.1, 0);
  Vec6 twist;
  twist << Vec3::UnitZ(), p.cross(Vec3::UnitZ());
  const Mat6 C = 1e-2 * twist * twist.transpose() + Diagonal(1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9);
  const WeakScrew screw = WeakestScrew(C);
  EXPECT_NEAR(std::abs(screw.axis.z()), 1.0, 1e-6);
  EXPECT_LT((screw.point - p).norm(), 1e-5);
  EXPECT_NEAR(screw.pitch_m, 0.0, 1e-5);
  EXPECT_NEAR(screw.length_m, p.norm(), 1e-5);
}

TEST(StiffnessMeasures, TheWeakestScrewDoesNotDependOnTheUnitOfLength) {
  Mat6 C = Diagonal(1e-3, 5e-3, 2e-3, 1e-6, 2e-6, 4e-6);
  C(1, 5) = C(5, 1) = 1e-4;
  Vec6 units;  // metres → millimetres: rotations per N mm, millimetres per N
  units << Vec3::Constant(1e-3), Vec3::Ones();
  const Mat6 C_mm = 1e3 * units.asDiagonal() * C * units.asDiagonal();
  const WeakScrew in_m = WeakestScrew(C), in_mm = WeakestScrew(C_mm);
  EXPECT_NEAR(in_mm.length_m / in_m.length_m, 1e3, 1e-9);
  EXPECT_NEAR(in_mm.stiffness / in_m.stiffness, 1e-3, 1e-12);
  EXPECT_NEAR(std::abs(in_mm.axis.dot(in_m.axis)), 1.0, kAlgebra);
}

TEST(StiffnessMeasures, ContributionsAddUpAndTheLargestComesFirst) {
  StiffnessResult result;
  const Mat6 rod = Diagonal(1e-4, 1e-4, 1e-4, 1e-7, 1e-7, 1e-7);
  const Mat6 arm = Diagonal(1e-4, 3e-4, 1e-4, 1e-7, 1e-7, 9e-7);
  result.C = rod + arm;
  result.K = result.C.inverse();
  result.shares = {{"rod", rod}, {"arm", arm}};
  const std::vector<Contribution> parts = Contributions(result);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].element, "arm");
  EXPECT_NEAR(parts[0].translation, 0.9, kAlgebra);
  EXPECT_NEAR(parts[0].rotation, 0.75, kAlgebra);
  EXPECT_NEAR(parts[0].axis[0], 0.5, kAlgebra);
  EXPECT_NEAR(parts[0].translation + parts[1].translation, 1.0, kAlgebra);
  result.shares.clear();
  EXPECT_TRUE(Contributions(result).empty());
}

TEST(StiffnessMeasures, GeneralIndicesNameTheExtremes) {
  StiffnessResult result;
  result.C = Diagonal(1e-3, 5e-3, 2e-3, 1e-6, 2e-6, 4e-6);
  result.K = result.C.inverse();
  const auto value = [&](const std::string& name) {
    for (const NamedIndex& index : GeneralIndices(result)) {
      if (index.name == name) return index.value;
    }
    return kNan;
  };
  EXPECT_NEAR(value("k_translation_min"), 2.5e5, 1e-6);
  EXPECT_NEAR(value("k_translation_max"), 1e6, 1e-5);
  EXPECT_NEAR(value("k_rotation_min"), 200, 1e-9);
  EXPECT_NEAR(value("k_rotation_max"), 1000, 1e-9);
}

}  // namespace
}  // namespace mbv
