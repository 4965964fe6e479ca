// Mobility counts that can be checked by hand.
#include "kinematics/mobility.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <filesystem>
#include <random>

#include "kinematics/command_rank.h"
#include "kinematics/row_stack.h"
#include "math/sparse.h"
#include "mechanism/reach.h"
#include "model_file/load_model.h"
#include "tests/mechanisms/simulated.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using ::mbv::fixtures::MakeFourBar;

TEST(Mobility, APlanarFourBarMovesAlthoughKutzbachSaysMinusTwo) {
  const Mobility mobility = AnalyseMobility(MakeFourBar());
  EXPECT_EQ(mobility.body_coordinates, 18);
  EXPECT_EQ(mobility.constraint_rows, 20);
  EXPECT_EQ(mobility.constraint_rank, 17);
  EXPECT_EQ(mobility.kutzbach, -2);
  EXPECT_EQ(mobility.dofs, 1);
  EXPECT_EQ(CountDofs(MakeFourBar()), 1);
  EXPECT_EQ(mobility.redundant, 3);
  EXPECT_EQ(mobility.undriven, 0);
  EXPECT_EQ(mobility.undriven, 0);
}

TEST(Mobility, TheFourBarsMotorIsUniqueAlthoughNoHingeReactionIs) {
  const Mobility mobility = AnalyseMobility(MakeFourBar());
  EXPECT_TRUE(mobility.drives_not_unique.empty());
  EXPECT_EQ(mobility.joints_not_unique, (std::vector<std::string>{"A", "B", "D", "C"}));
  // In its plane statics is enough.
  ASSERT_EQ(mobility.reactions_not_unique.size(), 4u);
  for (const UndeterminedReaction& reaction : mobility.reactions_not_unique) {
    EXPECT_EQ(reaction.components, (std::vector<std::string>{"fz", "mx", "my"})) << reaction.joint;
  }
}

TEST(Mobility, AComponentThatIsUniqueAtHomeOnlyIsFoundOutByOtherPoses) {
  // A bar between two hinges about z is held twice along itself: at home along x only.
  Mechanism m;
  m.bodies = {{.name = "world", .frames = {}, .shapes = {}},
              {.name = "table", .mass = 1.0, .frames = {}, .shapes = {}},
              {.name = "bar", .mass = 1.0, .frames = {}, .shapes = {}}};
  const auto add = [&](const char* name, JointKind kind, int parent, int child, double x) {
    Joint joint;
    joint.name = name;
    joint.kind = kind;
    joint.parent = parent;
    joint.child = child;
    joint.X_PF = joint.X_CM = Pose(Eigen::Translation3d(x, 0.0, 0.0));
    m.joints.push_back(joint);
  };
  add("turn", JointKind::kRevolute, 0, 1, 0.0);
  add("near", JointKind::kSpherical, 0, 2, 0.0);
  add("far", JointKind::kSpherical, 1, 2, 1.0);
  m.X_WB_home.assign(3, Pose::Identity());
  // The reaction of `near` is given in the world's axes, that of `far` in those of the table.
  EXPECT_EQ(ReactionsNotUnique(m, {}),
            (std::vector<std::string>{"far.reaction.fx", "near.reaction.fx", "turn.reaction.fx"}));
  std::vector<Pose> turned(3, Pose::Identity());
  turned[1].linear() = turned[2].linear() =
      Eigen::AngleAxisd(0.5, Vec3::UnitZ()).toRotationMatrix();
  EXPECT_EQ(ReactionsNotUnique(m, {turned}),
            (std::vector<std::string>{"far.reaction.fx", "near.reaction.fx", "near.reaction.fy",
                                      "turn.reaction.fx", "turn.reaction.fy"}));
  turned[2].linear().setConstant(kNan);
  EXPECT_EQ(ReactionsNotUnique(m, {turned}).size(), 3u);
}

// The same bar, which lies across x by `off`: the forces along it reach y by as much.
TEST(Mobility, AReactionThatASelfStressReachesByTheEighthDigitIsOpen) {
  const auto open = [](double off) {
    Mechanism m;
    m.bodies = {{.name = "world", .frames = {}, .shapes = {}},
                {.name = "table", .mass = 1.0, .frames = {}, .shapes = {}},
                {.name = "bar", .mass = 1.0, .frames = {}, .shapes = {}}};
    const auto add = [&](const char* name, JointKind kind, int parent, int child, const Vec3& at) {
      Joint joint;
      joint.name = name;
      joint.kind = kind;
      joint.parent = parent;
      joint.child = child;
      joint.X_PF = joint.X_CM = Pose(Eigen::Translation3d(at));
      m.joints.push_back(joint);
    };
    add("turn", JointKind::kRevolute, 0, 1, Vec3::Zero());
    add("near", JointKind::kSpherical, 0, 2, Vec3::Zero());
    add("far", JointKind::kSpherical, 1, 2, Vec3(1.0, off, 0.0));
    m.X_WB_home.assign(3, Pose::Identity());
    return ReactionsNotUnique(m, {});
  };
  const std::vector<std::string> along_x = {"far.reaction.fx", "near.reaction.fx",
                                            "turn.reaction.fx"};
  EXPECT_EQ(open(0.0), along_x);
  EXPECT_EQ(open(2e-11), along_x);
  EXPECT_EQ(open(4e-10).size(), 6u);
  EXPECT_EQ(open(5e-9).size(), 6u);
}

// A plate in a plane, pushed by legs: two are parallel but for 1e-3, a third is across them.
TEST(CommandRank, WhatHardlyDiffersFromOthersIsTakenWhereNothingBetterIsPreferred) {
  Mechanism m;
  m.bodies = {{.name = "world", .frames = {}, .shapes = {}},
              {.name = "plate", .mass = 1.0, .frames = {}, .shapes = {}}};
  Joint slide;
  slide.kind = JointKind::kPlanar;
  slide.child = 1;
  m.joints = {slide};
  m.X_WB_home.assign(2, Pose::Identity());
  m.tree_joints = {0};
  m.tree_reversed = {false};
  const auto leg = [&](const Vec3& from, const Vec3& to) {
    m.drives.push_back({.name = "leg", .kind = DistanceDrive{0, from, 1, to}, .range = {}});
  };
  leg({-1, 0.2, 0}, {0, 0.2, 0});
  leg({-1, 0.2 + 1e-3, 0}, {0, 0.2, 0});
  leg({0, -1, 0}, {0, 0, 0});
  leg({-1, -0.2, 0}, {0, -0.2, 0});
  const auto chosen = [&](const std::vector<int>& drives) {
    std::vector<Coordinate> candidates;
    candidates.reserve(drives.size());
    for (const int d : drives) candidates.push_back({Coordinate::Kind::kDrive, d, 0});
    return ChooseCoordinates(m, candidates, candidates.size());
  };
  EXPECT_EQ(chosen({0, 1, 2, 3}).chosen, (std::vector<size_t>{0, 2, 3}));
  EXPECT_EQ(chosen({0, 1, 2, 3}).dependent, (std::vector<size_t>{1}));
  EXPECT_EQ(chosen({0, 1, 3}).chosen, (std::vector<size_t>{0, 1, 2}));
  EXPECT_EQ(chosen({0, 0, 3}).chosen, (std::vector<size_t>{0, 2}));
}

TEST(CommandRank, AMakeshiftIsChosenWhereItMovesTenTimesMore) {
  for (const auto& [ratio, chosen] : {std::pair(8.0, 0u), {12.0, 1u}}) {
    Mechanism m;
    m.bodies = {{.name = "world", .frames = {}, .shapes = {}},
                {.name = "slow", .mass = 1.0, .frames = {}, .shapes = {}},
                {.name = "fast", .mass = 1.0, .frames = {}, .shapes = {}}};
    for (const int child : {1, 2}) {
      Joint joint;
      joint.kind = JointKind::kRevolute;
      joint.child = child;
      m.joints.push_back(joint);
    }
    m.X_WB_home.assign(3, Pose::Identity());
    m.tree_joints = {0, 1};
    m.tree_reversed = {false, false};
    m.couplings = {{.name = "gear",
                    .terms = {{.joint = 0, .coordinate = 0, .polynomial = {ratio}},
                              {.joint = 1, .coordinate = 0, .polynomial = {-1.0}}}}};
    const std::vector<Coordinate> both = {{Coordinate::Kind::kJoint, 0, 0},
                                          {Coordinate::Kind::kJoint, 1, 0}};
    EXPECT_EQ(ChooseCoordinates(m, both, 0, 1).chosen, std::vector<size_t>{chosen}) << ratio;
    EXPECT_EQ(ChooseCoordinates(m, both, 0).chosen, std::vector<size_t>{1}) << ratio;
  }
}

TEST(Mobility, TwoMotorsOnOneDofFightEachOther) {
  Mechanism m = MakeFourBar();
  m.drives.push_back({.name = "second", .kind = JointDrive{2, 0}, .range = {}});
  const Mobility mobility = AnalyseMobility(m);
  EXPECT_EQ(mobility.undriven, 0);
  EXPECT_FALSE(mobility.drives_not_unique.empty());
  EXPECT_EQ(mobility.drives_not_unique, (std::vector<std::string>{"motor", "second"}));
}

TEST(Mobility, WithoutItsMotorTheFourBarIsFree) {
  Mechanism m = MakeFourBar();
  m.drives.clear();
  const Mobility mobility = AnalyseMobility(m);
  EXPECT_EQ(mobility.undriven, 1);
  EXPECT_NE(mobility.undriven, 0);
}

TEST(Mobility, ABallRemovesTwoOfTheThreeRedundancies) {
  const Mobility mobility = AnalyseMobility(MakeFourBar(JointKind::kSpherical));
  EXPECT_EQ(mobility.kutzbach, 0);
  EXPECT_EQ(mobility.dofs, 1);
  EXPECT_EQ(mobility.redundant, 1);
}

TEST(Mobility, AnIsostaticRuleThatFreesALinkIsFoundOut) {
  Mechanism m = MakeFourBar(JointKind::kRevolute, true);
  EXPECT_TRUE(AnalyseMobility(m).isostatic_rule_sound);
  m.joints[1].transmits_force_only = true;  // a coupler between two balls can spin
  EXPECT_FALSE(AnalyseMobility(m).isostatic_rule_sound);
}

TEST(Mobility, TheStabilizingPlatformHasTwoRedundantConstraintsPerLimb) {
  LoadResult loaded = LoadModel(SourcePath("/models/stabilizing_platform/model.yaml"));
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mobility mobility = AnalyseMobility(*loaded.mechanism);
  EXPECT_EQ(mobility.redundant, 6);
  EXPECT_EQ(mobility.dofs, 3 + 6);  // the ship's and the platform's
  EXPECT_EQ(mobility.undriven, 0);
  EXPECT_TRUE(mobility.isostatic_rule_sound);
  EXPECT_TRUE(mobility.drives_not_unique.empty());
  EXPECT_TRUE(mobility.joints_not_unique.empty());  // by the isostatic rule
  EXPECT_GT(mobility.smallest_kept, 1e6 * mobility.largest_dropped);

  // Without the rule the five joints of each limb's planar loop share two self-stresses.
  for (Joint& joint : loaded.mechanism->joints) joint.transmits_force_only = false;
  const Mobility without = AnalyseMobility(*loaded.mechanism);
  EXPECT_EQ(without.joints_not_unique.size(), 15u);
  EXPECT_TRUE(without.drives_not_unique.empty());
}

TEST(Mobility, TheTripodHasThreeDegreesOfFreedomAndNoRedundancy) {
  const LoadResult loaded = LoadModel(SourcePath("/models/spr_tripod/model.yaml"));
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mobility mobility = AnalyseMobility(*loaded.mechanism);
  EXPECT_EQ(mobility.dofs, 3);
  EXPECT_EQ(mobility.redundant, 0);
  EXPECT_EQ(mobility.undriven, 0);
}

// Rows of all joints and drives of a model at home, as ranks are taken of.
MatX RowsAtHome(const Mechanism& mechanism, bool driven) {
  BodyStates states;
  states.Resize(mechanism.bodies.size());
  states.X_WB = mechanism.X_WB_home;
  internal::RowStack stack(mechanism.bodies.size(), CharacteristicLength(mechanism));
  stack.AddJoints(mechanism, states, false);
  if (driven) stack.AddDriven(mechanism, states);
  return MatX(stack.Matrix());
}

TEST(Ranks, PivotsAndSingularValuesGiveTheSameOnEveryShippedModel) {
  int clear = 0, models = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("/models"))) {
    const LoadResult loaded = LoadModel((entry.path() / "model.yaml").string());
    if (!loaded.mechanism) continue;
    ++models;
    for (const bool driven : {false, true}) {
      const MatX J = RowsAtHome(*loaded.mechanism, driven);
      const int rank = internal::FindRank(J, internal::NullSpaces::kNone).rank;
      // Of the whole, and of the rows above any place.
      for (const Eigen::Index first : {Eigen::Index{0}, J.rows() / 3, J.rows() - 5, J.rows()}) {
        const MatX top = J.topRows(first);
        const auto pivots = internal::ClearRanks(J.sparseView(), first);
        const internal::NestedRanks ranks = internal::RanksOf(J.sparseView(), first);
        EXPECT_EQ(ranks.first, internal::FindRank(top, internal::NullSpaces::kNone).rank);
        EXPECT_EQ(ranks.all, rank) << entry.path();
        if (pivots) {
          EXPECT_EQ(pivots->first, ranks.first) << entry.path();
          EXPECT_EQ(pivots->all, rank) << entry.path();
        }
        clear += pivots ? 1 : 0;
      }
      EXPECT_EQ(internal::RankOf(J), rank) << entry.path();
    }
  }
  EXPECT_GE(models, 20);
  EXPECT_GE(clear, 8 * models - 16);
}

// The same rank, and null spaces that span the same, whichever way they are found.
TEST(Ranks, SparseEliminationAndSingularValuesGiveTheSameOnEveryShippedModel) {
  using internal::NullSpaces;
  const auto projector = [](const MatX& basis) -> MatX {
    const MatX Q = internal::Orthonormal(basis);
    return Q * Q.transpose();
  };
  int models = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("/models"))) {
    const LoadResult loaded = LoadModel((entry.path() / "model.yaml").string());
    if (!loaded.mechanism) continue;
    ++models;
    for (const bool driven : {false, true}) {
      const internal::SparseRows J = RowsAtHome(*loaded.mechanism, driven).sparseView();
      for (const NullSpaces wanted : {NullSpaces::kSelfStress, NullSpaces::kMotion}) {
        const bool stress = wanted == NullSpaces::kSelfStress;
        const auto dense = internal::FindRank(J, wanted, 1e-9, 100000);
        const auto sparse = internal::FindRank(J, wanted, 1e-9, 0);
        EXPECT_EQ(sparse.rank, dense.rank) << entry.path();
        const MatX& a = stress ? dense.self_stress : dense.motion;
        const MatX& b = stress ? sparse.self_stress : sparse.motion;
        ASSERT_EQ(a.cols(), b.cols()) << entry.path();
        EXPECT_LT((projector(a) - projector(b)).norm(), 1e-8) << entry.path();
      }
    }
  }
  EXPECT_GE(models, 20);
}

// A floating body with 110 hinged ones: coordinates are chosen by lengths in this basis.
TEST(Ranks, MotionsOfManyDegreesOfFreedomAreOrthonormal) {
  constexpr int kBodies = 110, kDof = 6 + kBodies;
  std::vector<Eigen::Triplet<double>> entries;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto put = [&](int row, int column) { entries.emplace_back(row, column, uniform(random)); };
  for (int row = 0; row < 5 * kBodies; ++row) {
    for (int c = 0; c < 6; ++c) {
      put(row, c);
      put(row, 6 + 6 * (row / 5) + c);
    }
  }
  internal::SparseRows J(5 * kBodies, 6 + 6 * kBodies);
  J.setFromTriplets(entries.begin(), entries.end());
  ASSERT_TRUE(SparseRank(J, internal::kRankTolerance).clear());
  const auto found = internal::FindRank(J, internal::NullSpaces::kMotion);
  EXPECT_EQ(found.rank, 5 * kBodies);
  ASSERT_EQ(found.motion.cols(), kDof);
  EXPECT_LT((J * found.motion).norm(), 1e-11);
  const MatX product = found.motion.transpose() * found.motion;
  EXPECT_LT((product - MatX::Identity(kDof, kDof)).norm(), 1e-12);
}

TEST(Ranks, WithoutAClearGapSingularValuesDecide) {
  MatX J = MatX::Random(12, 12);
  const Eigen::BDCSVD<MatX> svd(J, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const auto with_smallest = [&](double smallest) -> MatX {
    VecX values = VecX::Ones(12);
    values[11] = smallest;
    return svd.matrixU() * values.asDiagonal() * svd.matrixV().transpose();
  };
  for (const Eigen::Index first : {0, 5, 12}) {
    const auto clear = [&](double smallest) {
      return internal::ClearRanks(with_smallest(smallest).sparseView(), first);
    };
    ASSERT_TRUE(clear(1e-3) && clear(1e-15)) << first;
    EXPECT_EQ(clear(1e-3)->all, 12);
    EXPECT_EQ(clear(1e-15)->all, 11);
    for (const double smallest : {3e-6, 2e-9, 0.5e-9, 3e-12}) {
      EXPECT_FALSE(clear(smallest)) << smallest << ' ' << first;
    }
  }
  EXPECT_EQ(internal::RankOf(with_smallest(2e-9)), 12);
  EXPECT_EQ(internal::RankOf(with_smallest(0.5e-9)), 11);
  EXPECT_EQ(internal::RankOf(MatX::Zero(3, 5)), 0);
  EXPECT_EQ(internal::RankOf(MatX(0, 5)), 0);
}

// Eigen's divide and conquer makes NaN of matrices with entries that are all but zero, and the rank
// of NaN is any number.
TEST(FindRank, HoldsWhereDivideAndConquerFails) {
  constexpr int kSize = 24;
  for (const unsigned seed : {12173U, 7654U, 93017U, 126168U, 235801U}) {
    std::mt19937_64 random(seed);
    const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
    MatX J = MatX::Zero(kSize, kSize);
    for (int i = 0; i < kSize / 2; ++i) {
      for (int k = 0; k < kSize; ++k) {
        if (!(uniform() < 0.12)) continue;
        const double entry = std::floor(5 * uniform()) - 2;
        J(i, k) = uniform() < 0.25 ? std::pow(10, -16 - 30 * uniform()) : entry;
      }
    }
    J.bottomRows(kSize / 2) = J.topRows(kSize / 2);
    Eigen::FullPivLU<MatX> lu(J);
    lu.setThreshold(1e-9);
    const internal::RankFinding found = internal::FindRank(J, internal::NullSpaces::kMotion);
    EXPECT_EQ(found.rank, lu.rank()) << seed;
    ASSERT_EQ(found.motion.cols(), kSize - found.rank) << seed;
    EXPECT_LT((J * found.motion).cwiseAbs().maxCoeff(), 1e-12) << seed;
    EXPECT_LT((found.motion.transpose() * found.motion -
               MatX::Identity(found.motion.cols(), found.motion.cols()))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-12)
        << seed;
  }
}

// In the coordinates of the spanning tree as by all rows, of all shipped models: with their drives
// locked one after the other, and with one row that nothing else holds or that is there twice.
TEST(Ranks, InTheTreeAreThoseOfAllRows) {
  int large = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(kSourceDir) + "/models")) {
    const std::string file = (entry.path() / "model.yaml").string();
    if (!std::filesystem::exists(file)) continue;
    const LoadResult loaded = LoadModel(file);
    ASSERT_TRUE(loaded.mechanism) << file;
    const Mechanism& m = *loaded.mechanism;
    BodyStates home;
    home.Resize(m.bodies.size());
    home.X_WB = m.X_WB_home;
    for (const bool reactions : {false, true}) {
      internal::RowStack rows(m.bodies.size(), CharacteristicLength(m));
      rows.AddJoints(m, home, reactions);
      const int held = rows.size();
      rows.AddDriven(m, home);
      for (const Joint& joint : m.joints) {
        if (!joint.closure) continue;
        const ConstraintRows twice = RowsOf(joint, home, false);
        rows.Add(twice);
        break;
      }
      const internal::NestedRanks all = internal::RanksOf(rows.Matrix(), held);
      const internal::NestedRanks tree = internal::RanksInTree(rows, m, home, held);
      EXPECT_EQ(tree.first, all.first) << file;
      EXPECT_EQ(tree.all, all.all) << file;
      large += rows.Matrix().cols() > 48 ? 1 : 0;
    }
  }
  EXPECT_GT(large, 10);
}

// At poses that the tree's joints do not fit, all rows count.
TEST(Ranks, OfPosesThatDoNotFitAreThoseOfAllRows) {
  const LoadResult loaded =
      LoadModel(std::string(kSourceDir) + "/models/stabilizing_platform/model.yaml");
  ASSERT_TRUE(loaded.mechanism);
  const Mechanism& m = *loaded.mechanism;
  BodyStates moved;
  moved.Resize(m.bodies.size());
  moved.X_WB = m.X_WB_home;
  std::mt19937_64 random(4);  // NOLINT(cert-msc51-cpp): the same each time
  std::uniform_real_distribution<double> one(-0.01, 0.01);
  for (size_t b = 1; b < moved.X_WB.size(); ++b) {
    moved.X_WB[b].rotate(Eigen::AngleAxisd(one(random), Vec3::UnitX()));
  }
  internal::RowStack rows(m.bodies.size(), CharacteristicLength(m));
  rows.AddJoints(m, moved, false);
  const internal::NestedRanks all = internal::RanksOf(rows.Matrix(), rows.size());
  EXPECT_EQ(internal::RanksInTree(rows, m, moved, rows.size()).all, all.all);
  rows = internal::RowStack(m.bodies.size(), CharacteristicLength(m));
  BodyStates home = moved;
  home.X_WB = m.X_WB_home;
  rows.AddJoints(m, home, false);
  EXPECT_NE(internal::RanksInTree(rows, m, home, rows.size()).all, all.all);
}

}  // namespace
}  // namespace mbv
