// Sparse factors of the rows of many bodies against singular values, and what free motions make of
// them against dense ways.
#include "reference/row_factors.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>
#include <numeric>

#include "model_file/load_model.h"
#include "reference/closure_solver.h"
#include "reference/element_forces.h"
#include "reference/force_solver.h"
#include "reference/forward.h"
#include "reference/free_dynamics.h"
#include "tests/mechanisms/four_bar_chain.h"
#include "tests/support/source_dir.h"

namespace mbv::internal {
namespace {

Mechanism ShippedModel(const std::string& name) {
  LoadResult loaded = LoadModel(SourcePath("/models/" + name + "/model.yaml"));
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return *std::move(loaded.mechanism);
}

RowSet RowsAt(const Mechanism& mechanism, const BodyStates& states) {
  RowSet rows;
  for (const Joint& joint : mechanism.joints) {
    const ConstraintRows of = RowsOf(joint, states, false);
    rows.Add(of, of.rows);
  }
  for (const CouplingRow& row : CouplingRows(mechanism, states)) rows.Add(row);
  for (const Spin& spin : IdleSpins(mechanism)) rows.Add(IdleRow(spin, states), true);
  return rows;
}

BodyStates Home(const Mechanism& mechanism) {
  BodyStates states;
  states.Resize(mechanism.bodies.size());
  states.X_WB = mechanism.X_WB_home;
  return states;
}

struct Values {
  MatX J;  ///< scaled
  Eigen::BDCSVD<MatX> svd;
  Eigen::Index rank = 0;
};

Values ValuesOf(const Mechanism& mechanism, const RowSet& rows, double length) {
  const SquareSystem scales(mechanism.bodies.size(), length);
  std::vector<int> all(static_cast<size_t>(rows.size()));
  std::iota(all.begin(), all.end(), 0);
  Values values{.J = MatX(scales.ScaledColumns(rows, all)).transpose(), .svd = {}};
  values.svd.compute(values.J, Eigen::ComputeFullV);
  values.rank = (values.svd.singularValues().array() > 1e-9).count();
  return values;
}

std::vector<Mechanism> Mechanisms() {
  std::vector<Mechanism> all;
  for (const char* name : {"scara_robot", "spr_tripod", "stewart", "slider_crank", "geared_press",
                           "stabilizing_platform"}) {
    all.push_back(ShippedModel(name));
  }
  all.push_back(FourBarChain(8));
  return all;
}

TEST(RowFactors, AreThoseOfSingularValues) {
  for (const Mechanism& mechanism : Mechanisms()) {
    const std::string& name = mechanism.name;
    const BodyStates states = Home(mechanism);
    const RowSet rows = RowsAt(mechanism, states);
    const double length = CharacteristicLength(mechanism);
    const Values truth = ValuesOf(mechanism, rows, length);
    const SquareSystem scales(mechanism.bodies.size(), length);
    const int dofs = scales.size() - static_cast<int>(truth.rank);
    const MatX left = truth.svd.matrixV().rightCols(dofs);
    const VecX rates = VecX::LinSpaced(rows.size(), -1.0, 2.0);
    VecX scaled = rates;
    for (int i = 0; i < rows.size(); ++i) scaled[i] *= scales.RowScale(rows.angular[i]);
    // Rates that the rows can have.
    const VecX possible = truth.J * truth.J.transpose() * scaled;
    VecX asked = possible;
    for (int i = 0; i < rows.size(); ++i) asked[i] /= scales.RowScale(rows.angular[i]);
    for (const int largest_dense : {0, 100000}) {
      RowFactors factors(mechanism.bodies.size(), length, dofs, largest_dense);
      factors.Factor(rows);
      const double smallest = truth.svd.singularValues()[truth.rank - 1];
      EXPECT_LT(factors.extra(), 1e-9) << name;
      if (largest_dense == 0) {
        double longest = 0.0;
        for (Eigen::Index k = 0; k < truth.J.cols(); ++k)
          longest = std::max(longest, truth.J.col(k).norm());
        EXPECT_NEAR(factors.pivot() * longest / smallest, 1.0, 0.2) << name;
      } else {
        EXPECT_GT(factors.pivot(), 0.1 * smallest) << name;
      }
      const MatX R = scales.body_scale().cwiseInverse().asDiagonal() * factors.Motions();
      EXPECT_LT((R.transpose() * R - MatX::Identity(dofs, dofs)).norm(), 1e-12) << name;
      EXPECT_LT((R - left * (left.transpose() * R)).norm(), 1e-10) << name;
      EXPECT_LT((truth.J * R).norm(), 1e-11) << name;
      const VecX V = factors.LeastMotion(asked, false).cwiseQuotient(scales.body_scale());
      EXPECT_LT((truth.J * V - possible).norm(), 1e-11 * possible.norm()) << name;
      EXPECT_LT((left.transpose() * V).norm(), 1e-10 * V.norm()) << name;
      const VecX gradient = VecX::LinSpaced(scales.size(), 1.0, -0.3);
      const VecX turned = scales.body_scale().cwiseProduct(gradient);
      EXPECT_NEAR(factors.ShareLeft(gradient), (left.transpose() * turned).norm() / turned.norm(),
                  1e-10)
          << name;
      const std::vector<int> chosen = factors.IndependentRows(rows);
      ASSERT_EQ(static_cast<Eigen::Index>(chosen.size()), truth.rank) << name;
      EXPECT_GT(Eigen::BDCSVD<MatX>(MatX(truth.J(chosen, Eigen::all))).singularValues().minCoeff(),
                1e-6)
          << name;
    }
  }
}

// A degree of freedom more than is there, and one less: nothing is taken for a motion.
TEST(RowFactors, AnotherRankIsNoticed) {
  for (const Mechanism& mechanism : Mechanisms()) {
    const RowSet rows = RowsAt(mechanism, Home(mechanism));
    const double length = CharacteristicLength(mechanism);
    const Values truth = ValuesOf(mechanism, rows, length);
    const auto unknowns = static_cast<int>(truth.J.cols());
    const int dofs = unknowns - static_cast<int>(truth.rank);
    for (const int largest_dense : {0, 100000}) {
      RowFactors fewer(mechanism.bodies.size(), length, dofs - 1, largest_dense);
      fewer.Factor(rows);
      EXPECT_LT(fewer.pivot(), 1e-9) << mechanism.name;
      RowFactors more(mechanism.bodies.size(), length, dofs + 1, largest_dense);
      more.Factor(rows);
      EXPECT_GT(more.extra(), 1e-4) << mechanism.name;
    }
  }
}

// A four-bar whose sides are parallel, at an angle from its flat pose.
BodyStates Parallelogram(const Mechanism& mechanism, double angle) {
  BodyStates states = Home(mechanism);
  for (size_t b = 1; b < states.X_WB.size(); ++b) {
    const bool coupler = mechanism.bodies[b].name == "coupler1";
    const double a = coupler ? 0.0 : angle;
    const double along = mechanism.bodies[b].name == "rocker1" ? 0.4 : 0.0;
    states.X_WB[b].linear() = Eigen::AngleAxisd(a, Vec3::UnitZ()).toRotationMatrix();
    states.X_WB[b].translation() =
        coupler ? Vec3(0.2 * std::cos(angle), 0.2 * std::sin(angle), 0.0) : Vec3(along, 0, 0);
  }
  return states;
}

// Towards the flat pose of a parallelogram a constraint fades in proportion to the angle, by sparse
// factors as by dense ones; what hardly holds is the same motion.
TEST(RowFactors, AConstraintThatFadesIsSeen) {
  const Mechanism mechanism = FourBarChain(1);
  const double length = CharacteristicLength(mechanism);
  std::vector<double> pivots;
  for (const double angle : {1e-1, 1e-2, 1e-3}) {
    const RowSet rows = RowsAt(mechanism, Parallelogram(mechanism, angle));
    RowFactors sparse(mechanism.bodies.size(), length, 1, 0),
        dense(mechanism.bodies.size(), length, 1);
    sparse.Factor(rows);
    dense.Factor(rows);
    const Values truth = ValuesOf(mechanism, rows, length);
    EXPECT_EQ(truth.rank, truth.J.cols() - 1);
    pivots.push_back(sparse.pivot());
    const VecX a = sparse.WeakestMotion().normalized(), b = dense.WeakestMotion().normalized();
    EXPECT_GT(std::abs(a.dot(b)), 0.98) << angle;
  }
  EXPECT_NEAR(pivots[1] / pivots[0], 0.1, 0.01);
  EXPECT_NEAR(pivots[2] / pivots[1], 0.1, 0.002);
}

// Near it the weak motion, and no other one, is left out where poses are corrected.
TEST(RowFactors, FirmMotionsLackWhatHardlyHolds) {
  const Mechanism mechanism = FourBarChain(1);
  const double length = CharacteristicLength(mechanism);
  const SquareSystem scales(mechanism.bodies.size(), length);
  for (const double angle : {3e-3, 3e-5}) {
    const RowSet rows = RowsAt(mechanism, Parallelogram(mechanism, angle));
    const Values truth = ValuesOf(mechanism, rows, length);
    RowFactors sparse(mechanism.bodies.size(), length, 1, 0);
    sparse.Factor(rows);
    const bool is_weak = angle < 1e-3;
    ASSERT_EQ(sparse.pivot() < 1e-5, is_weak) << sparse.pivot();
    ASSERT_GT(sparse.pivot(), 1e-6);
    const VecX moved = VecX::LinSpaced(scales.size(), 1.0, -0.3);
    VecX rates = truth.J * moved;
    for (int i = 0; i < rows.size(); ++i) rates[i] /= scales.RowScale(rows.angular[i]);
    const auto motion = [&](bool firm) -> VecX {
      return sparse.LeastMotion(rates, firm).cwiseQuotient(scales.body_scale());
    };
    const MatX& V = truth.svd.matrixV();
    const VecX left = V.col(truth.rank), weak = V.col(truth.rank - 1);
    const VecX least = moved - left * left.dot(moved), share = weak * weak.dot(moved);
    ASSERT_GT(share.norm(), 0.01 * moved.norm());
    EXPECT_LT((motion(false) - least).norm(), 1e-6 * moved.norm()) << angle;
    EXPECT_LT((motion(true) - (is_weak ? least - share : least)).norm(), 1e-6 * moved.norm())
        << angle;
  }
}

// Some drives follow commands, the others are pushed: reactions and the forces of the commanded
// ones, against least squares of all rows.
TEST(RowFactors, ForcesOfAFreeMotionAreThoseOfDenseLeastNorm) {
  std::vector<Mechanism> mechanisms = Mechanisms();
  std::erase_if(mechanisms,
                [](const Mechanism& m) { return m.drives.empty() || !m.prescribed.empty(); });
  for (const Mechanism& mechanism : mechanisms) {
    const std::string& name = mechanism.name;
    Motion motion{.duration_s = 1.0, .sample_s = 0.01, .commands = {}, .loads = {}};
    for (int d = 0; d < static_cast<int>(mechanism.drives.size()); ++d) {
      const Coordinate drive{Coordinate::Kind::kDrive, d, 0};
      const std::string& of = mechanism.drives[static_cast<size_t>(d)].name;
      const double home = HomeValue(mechanism, drive);
      if (d % 2 == 1) {
        motion.commands.push_back({.name = of,
                                   .terms = {{drive, 1.0}},
                                   .profile = {{ConstantTerm{home}, RampTerm{0.2}}}});
        continue;
      }
      motion.initial.push_back(
          {.name = of, .coordinate = drive, .position = home, .rate = 0.1 + 0.05 * d});
      motion.forces.push_back({.drive = d, .force = Constant(1.0 + d)});
    }
    ReferenceSample sample;
    ASSERT_TRUE(InitialStates(mechanism, motion, &sample.states).ok()) << name;
    FreeDynamics dynamics(mechanism, motion);
    ASSERT_TRUE(dynamics.Project(0.0, &sample.states).ok()) << name;
    ASSERT_TRUE(dynamics.Accelerate(0.0, &sample.states).ok()) << name;
    sample.driven.velocity.setZero(static_cast<Eigen::Index>(mechanism.drives.size()));
    dynamics.Forces(0.0, &sample);

    RowSet rows;
    AddReactionRows(mechanism, sample.states, &rows);
    for (size_t d = 1; d < mechanism.drives.size(); d += 2) {
      rows.Add(DriveRow(mechanism, mechanism.drives[d], sample.states),
               PositionUnit(mechanism, mechanism.drives[d]) == "rad");
    }
    const SquareSystem scales(mechanism.bodies.size(), CharacteristicLength(mechanism));
    std::vector<int> all(static_cast<size_t>(rows.size()));
    std::iota(all.begin(), all.end(), 0);
    const MatX columns = scales.ScaledColumns(rows, all);
    std::vector<Vec6> required;
    RequiredWrenches(mechanism, sample.states, {}, {}, &required);
    for (const DriveForce& given : motion.forces) {
      const ScalarRow row =
          DriveRow(mechanism, mechanism.drives[static_cast<size_t>(given.drive)], sample.states);
      required[static_cast<size_t>(row.parent)] -= (1.0 + given.drive) * row.J_parent;
      required[static_cast<size_t>(row.child)] -= (1.0 + given.drive) * row.J_child;
    }
    Eigen::CompleteOrthogonalDecomposition<MatX> cod;
    cod.setThreshold(1e-9);
    cod.compute(columns);
    VecX force = cod.solve(VecX(scales.body_scale().cwiseProduct(Stack(required))));
    for (int i = 0; i < rows.size(); ++i) force[i] *= scales.RowScale(rows.angular[i]);
    MatX reactions;
    int next = FillReactions(mechanism, sample.states, rows, force, &reactions);
    const double scale = reactions.cwiseAbs().maxCoeff();
    EXPECT_GT(scale, 1e-3) << name;
    EXPECT_LT((reactions - sample.reactions).cwiseAbs().maxCoeff(), 1e-10 * scale) << name;
    for (size_t d = 0; d < mechanism.drives.size(); ++d) {
      const auto k = static_cast<Eigen::Index>(d);
      const double truth = d % 2 == 0 ? 1.0 + static_cast<double>(d) : force[next++];
      EXPECT_NEAR(sample.drive_force[k], truth, 1e-10 * scale) << name;
    }
    // A mass that is wrong by a millionth shows.
    required.back() *= 1.0 + 1e-6;
    VecX wrong = cod.solve(VecX(scales.body_scale().cwiseProduct(Stack(required))));
    for (int i = 0; i < rows.size(); ++i) wrong[i] *= scales.RowScale(rows.angular[i]);
    EXPECT_GT((wrong - force).cwiseAbs().maxCoeff(), 1e-9 * scale) << name;
  }
}

}  // namespace
}  // namespace mbv::internal
