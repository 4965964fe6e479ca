// Rates of a sample do not depend on the samples before it, which only say where to begin; and how
// well they say it.
#include <gtest/gtest.h>

#include <cmath>

#include "math/spatial.h"
#include "reference/closure_solver.h"
#include "reference/reference.h"
#include "reference/square_system.h"
#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

// Largest difference [rad/s, lengths/s or of squares of seconds] of two states' twists.
double Apart(const std::vector<Vec6>& a, const std::vector<Vec6>& b) {
  double apart = 0.0;
  for (size_t i = 0; i < a.size(); ++i) {
    apart = std::max(apart, (a[i] - b[i]).lpNorm<Eigen::Infinity>());
  }
  return apart;
}

struct Errors {
  double V = 0.0, A = 0.0;
};

// Of samples on the way, at a sudden stop at each of them, and at each from there on: against a
// solver that comes from home.
Errors ErrorsOnTheWay(const std::string& scenario, double sample_s) {
  const ScenarioResult loaded = LoadScenario(SourcePath("/scenarios/" + scenario), {});
  EXPECT_TRUE(loaded.scenario && loaded.mechanism) << loaded.diagnostics.Text();
  const Motion& motion = loaded.scenario->motion;
  ReferenceSolver on_the_way(*loaded.mechanism, motion);
  Errors errors;
  CommandSample command;
  ReferenceSample got, alone;
  for (int i = 0; i < 12; ++i) {
    EvaluateMotion(motion, i * sample_s, &command);
    const bool stands = i >= 7;
    if (stands) command.velocity.setZero();
    if (i >= 9) command.acceleration.setZero();
    ReferenceSolver from_home(*loaded.mechanism, motion);
    EXPECT_TRUE(on_the_way.Kinematics(command, &got).ok());
    EXPECT_TRUE(from_home.Kinematics(command, &alone).ok());
    errors.V = std::max(errors.V, Apart(got.states.V_WB, alone.states.V_WB));
    errors.A = std::max(errors.A, Apart(got.states.A_WB, alone.states.A_WB));
    if (stands) {
      for (const Vec6& V : got.states.V_WB) EXPECT_EQ(V, Vec6::Zero()) << i;
    }
    if (i < 9) continue;
    for (const Vec6& A : got.states.A_WB) EXPECT_EQ(A, Vec6::Zero()) << i;
  }
  return errors;
}

TEST(Rates, DoNotDependOnTheSamplesBefore) {
  for (const char* scenario : {"stabilizing_platform/sea_state.yaml", "spr_tripod/default.yaml",
                               "cabin_robot/default.yaml", "journal_crank/press_inverse.yaml"}) {
    for (const double sample_s : {0.01, 0.1}) {
      const Errors errors = ErrorsOnTheWay(scenario, sample_s);
      EXPECT_LT(errors.V, 1e-12) << scenario;
      EXPECT_LT(errors.A, 1e-11) << scenario;
    }
  }
}

// A cone whose axis is moved around while it spins: R = Rz(a t) Ry(b) Rx(c t), in axes fixed in
// space.
struct Cone {
  double a = 1.3, b = 0.7, c = 2.1;

  [[nodiscard]] Mat3 R(double t) const {
    return (Eigen::AngleAxisd(a * t, Vec3::UnitZ()) * Eigen::AngleAxisd(b, Vec3::UnitY()) *
            Eigen::AngleAxisd(c * t, Vec3::UnitX()))
        .toRotationMatrix();
  }
  [[nodiscard]] BodyStates At(double t) const {
    BodyStates states;
    states.Resize(2);
    const Vec3 axis = R(t).col(0), w = a * Vec3::UnitZ() + c * axis;
    states.V_WB[1] << w, std::cos(t), 0.0, -std::sin(2.0 * t);
    states.A_WB[1] << c * a * Vec3::UnitZ().cross(axis), -std::sin(t), 0.0, -2.0 * std::cos(2 * t);
    return states;
  }
  // Of a turn [rad], a translation and rates predicted by samples h apart; one of them `late`.
  [[nodiscard]] Vec3 Error(double h, int samples, double late = 0.0) const {
    internal::PosePredictor predictor(1.0);
    for (int i = 1; i <= samples; ++i) {
      const double t = (i - samples) * h;
      predictor.Remember(t + (i == samples - 1 ? late : 0.0), At(t));
    }
    predictor.Predict(h);
    const Mat3 got = ExpRotation(predictor.step().head<3>()) * R(0.0);
    const Vec3 way(std::sin(h), 0.0, 0.5 * (std::cos(2.0 * h) - 1.0));
    const BodyStates there = At(h);
    return {(got - R(h)).norm(), (predictor.step().tail<3>() - way).norm(),
            (predictor.V() - there.V_WB[1]).norm() + h * (predictor.A() - there.A_WB[1]).norm()};
  }
};

TEST(Rates, ArePredictedToTheOrderOfTheSamples) {
  const Cone cone;
  const double h = 0.04;
  for (const int samples : {1, 2, 3, 4}) {
    const Vec3 gain = (cone.Error(2 * h, samples).array() / cone.Error(h, samples).array()).log2();
    EXPECT_GT(gain[0], std::min(7, 2 * samples + 1) - 0.5) << samples;
    EXPECT_GT(gain[1], 2 * samples + 0.5) << samples;
    EXPECT_GT(gain[2], 2 * samples - 0.5) << samples;
  }
  EXPECT_LT(cone.Error(0.01, 5).maxCoeff(), 1e-12);
}

// Other intervals and wild steps leave only the last sample.
TEST(Rates, OfUnequalSamplesAreNotExtrapolated) {
  const Cone cone;
  EXPECT_EQ(cone.Error(0.01, 5, 1e-4), cone.Error(0.01, 1));
  EXPECT_LT(cone.Error(0.01, 5, 1e-9)[0], 1e-12);
  EXPECT_EQ(cone.Error(1.0, 5), cone.Error(1.0, 1));
}

}  // namespace
}  // namespace mbv
