// The equations in intervals: slopes against rates, forces against exact fractions.
#include "features/certify/exact_model.h"

#include <gtest/gtest.h>
#include <cmath>
#include <random>

#include "features/certify/exact_numbers.h"
#include "model_file/load_model.h"
#include "tests/support/shipped.h"
#include "tests/support/source_dir.h"

namespace mbv::exact {
namespace {

using T = Fine;

double Low(const T& x) { return boost::multiprecision::lower(x).convert_to<double>(); }
double High(const T& x) { return boost::multiprecision::upper(x).convert_to<double>(); }

Mechanism Shipped(const std::string& name) {
  LoadResult loaded = LoadModel(SourcePath("/models/") + name + "/model.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism());
}

// A tree whose joints are of every kind, with the same kinds once more as loops: locks and
// coordinates of each.
const char kAllKinds[] = "/tests/mechanisms/all_joint_kinds.yaml";

// All coordinates and all locks that a joint of any kind can have, between the ends of the tree.
std::vector<Equation<T>> EveryEquation(Model<T>* model) {
  const Mechanism& m = model->mechanism();
  std::vector<Equation<T>> equations = model->Closures({});
  for (size_t j = 0; j < m.joints.size(); ++j) {
    for (int c = 0; c < DofsOf(m.joints[j].kind); ++c) {
      equations.push_back(
          model->CoordinateEquation({Coordinate::Kind::kJoint, static_cast<int>(j), c}, 0.3));
    }
  }
  for (size_t o = 0; o < m.outputs.size(); ++o) {
    for (int c = 0; c < 6; ++c) {
      equations.push_back(
          model->CoordinateEquation({Coordinate::Kind::kOutput, static_cast<int>(o), c}, 0.3));
    }
  }
  return equations;
}

// A slope from wrenches and virtual motions against the rate of the same equation in series: both
// enclose the same number, so they overlap, and neither is wide. Near the start, but not there.
void CompareSlopes(Model<T>* model, const std::vector<Pose>& X_WB, const std::string& name) {
  std::vector<T> q;
  model->StartFrom(X_WB, &q);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> step(-0.1, 0.1);
  for (T& coordinate : q) coordinate += T(step(random));
  const auto bodies = model->PosesAt(q);
  const auto motions = model->VirtualAt(q, bodies, false);
  const std::vector<Equation<T>> equations = EveryEquation(model);
  ASSERT_FALSE(equations.empty()) << name;
  size_t moving = 0;
  for (size_t j = 0; j < motions.size(); ++j) {
    std::vector<Series<T>> along(q.begin(), q.end());
    along[j].r = T(1);
    const auto states = model->MotionsAt(along);
    for (size_t k = 0; k < equations.size(); ++k) {
      const T rate = model->ValueAt(equations[k], states).r;
      const T slope = model->Along(motions[j], model->WrenchesAt(equations[k], bodies));
      EXPECT_LE(Low(slope), High(rate) + 1e-300) << name << " " << k << " " << j;
      EXPECT_LE(Low(rate), High(slope) + 1e-300) << name << " " << k << " " << j;
      EXPECT_LT(High(slope) - Low(slope), 1e-25) << name << " " << k << " " << j;
      moving += std::abs(Low(rate)) > 1e-6 ? 1 : 0;
    }
  }
  EXPECT_GT(moving, motions.size() / 2) << name;
}

TEST(ExactModel, SlopesAreTheRatesOfTheSameEquations) {
  for (const std::string& name : ShippedModelNames()) {
    const Mechanism mechanism = Shipped(name);
    Model<T> model(mechanism);
    CompareSlopes(&model, mechanism.X_WB_home, name);
  }
}

// Of bushings, which may be turned by more than a right angle; values and rates along the angle.
TEST(ExactModel, TurnsOfBushingsBelowHalfATurn) {
  for (const double angle : {0.1, 0.25, 0.26, 1.0, 1.57, 1.58, 2.0, 2.89, 2.9, 3.1}) {
    const double s = std::sin(angle), c = std::cos(angle);
    const Series<T> turn(T(angle), T(1), T(0));
    const Series<T> sine = Chain(turn, sin(turn.v), cos(turn.v), T(-sin(turn.v)));
    const Series<T> cosine = Chain(turn, cos(turn.v), T(-sin(turn.v)), T(-cos(turn.v)));
    const Series<T> f = AngleOverSine(sine * sine, cosine);
    const double rate = (s - angle * c) / (s * s);
    const double second = angle / s + 2.0 * c * (angle * c - s) / (s * s * s);
    EXPECT_NEAR(Low(f.v), angle / s, 1e-14 * angle / s) << angle;
    EXPECT_NEAR(Low(f.r), rate, 1e-12 * std::abs(rate)) << angle;
    EXPECT_NEAR(Low(f.a), second, 1e-10 * std::abs(second)) << angle;
    EXPECT_LT(High(f.a) - Low(f.a), 1e-25 * std::abs(second) + 1e-28) << angle;
  }
}

TEST(ExactModel, SlopesOfAllJointKinds) {
  LoadResult loaded = LoadModel(SourcePath(kAllKinds));
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  Model<T> tree(*loaded.mechanism);
  CompareSlopes(&tree, loaded.mechanism->X_WB_home, "tree");
  // The same joints as loops: each is cut, and a free one beside it carries the body.
  Mechanism cut = *loaded.mechanism;
  const size_t joints = cut.joints.size();
  for (size_t j = 0; j < joints; ++j) {
    Joint carrier = cut.joints[j];
    carrier.kind = JointKind::kFree;
    carrier.name += "_carrier";
    cut.joints[j].closure = true;
    cut.joints.push_back(carrier);
  }
  cut.tree_joints.clear();
  for (size_t j = 0; j < joints; ++j) {
    cut.tree_joints.push_back(static_cast<int>(joints + j));
  }
  cut.tree_reversed.assign(joints, false);
  Model<T> loops(cut);
  ASSERT_EQ(loops.coordinates(), 6 * 9);
  CompareSlopes(&loops, cut.X_WB_home, "loops");
}

// Accelerations in series against those of positions half a step before and behind, in exact
// differences: the rest is of the order of h².
TEST(ExactModel, SeriesAreDerivativesOfPositions) {
  LoadResult loaded = LoadModel(SourcePath(kAllKinds));
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  Model<T> model(*loaded.mechanism);
  std::vector<T> q;
  model.StartFrom(loaded.mechanism->X_WB_home, &q);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> draw(-0.5, 0.5);
  std::vector<Series<T>> motion;
  for (const T& coordinate : q) motion.emplace_back(coordinate, T(draw(random)), T(draw(random)));
  const double h = 1e-9;
  const auto at = [&](double t) {
    std::vector<T> moved;
    for (const Series<T>& x : motion) moved.push_back(x.v + x.r * T(t) + x.a * T(t) * T(t) / 2);
    return model.PosesAt(moved);
  };
  const auto exact = model.MotionsAt(motion);
  const auto before = at(-h), now = at(0), behind = at(h);
  for (size_t b = 1; b < exact.size(); ++b) {
    for (size_t i = 0; i < 3; ++i) {
      for (size_t k = 0; k < 3; ++k) {
        const T rate = (behind[b].R(i, k) - before[b].R(i, k)) / (2 * T(h));
        const T acceleration =
            (behind[b].R(i, k) - 2 * now[b].R(i, k) + before[b].R(i, k)) / (T(h) * T(h));
        EXPECT_NEAR(Low(exact[b].R(i, k).r), Low(rate), 1e-14);
        EXPECT_NEAR(Low(exact[b].R(i, k).a), Low(acceleration), 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace mbv::exact
