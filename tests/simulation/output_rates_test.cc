// Rates of outputs against differences of the recorded poses, on a chain with every kind of joint.
#include <gtest/gtest.h>

#include <cmath>

#include "simulation/engine/simulation.h"
#include "tests/mechanisms/simulated.h"

namespace mbv {
namespace {

// The joint zoo with every coordinate driven, and an output of its last body seen from its second,
// both in skew frames: the reference frame turns and accelerates too.
Mechanism DrivenZoo(bool reversed) {
  Mechanism m = fixtures::MakeJointZoo(reversed);
  for (size_t j = 0; j < m.joints.size(); ++j) {
    for (int k = 0; k < DofsOf(m.joints[j].kind); ++k) {
      Drive drive;
      drive.name = m.joints[j].name + "_" + std::to_string(k);
      drive.kind = JointDrive{static_cast<int>(j), k};
      m.drives.push_back(drive);
    }
  }
  Output output;
  output.name = "tip";
  output.body = 6;
  output.X_BO = fixtures::PoseAt({0.1, -0.2, 0.3}, RotRpy({0.4, 0.5, -0.6}));
  output.reference_body = 2;
  output.X_RbR = fixtures::PoseAt({-0.2, 0.1, 0.2}, RotRpy({-0.3, 0.2, 0.9}));
  m.outputs = {output};
  return m;
}

DrivenMotion Waves(const Mechanism& m) {
  std::vector<double> home;
  for (const Drive& drive : m.drives) {
    const auto& d = std::get<JointDrive>(drive.kind);
    home.push_back(m.joints[d.joint].home[d.coordinate]);
  }
  return [home](double t, DrivenSample* driven) {
    const auto n = static_cast<Eigen::Index>(home.size());
    for (VecX* x : {&driven->position, &driven->velocity, &driven->acceleration}) x->resize(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double w = 2.0 + 0.3 * static_cast<double>(k), a = 0.15;
      driven->position[k] = home[static_cast<size_t>(k)] + a * std::sin(w * t);
      driven->velocity[k] = a * w * std::cos(w * t);
      driven->acceleration[k] = -a * w * w * std::sin(w * t);
    }
    return RunSummary::Done();
  };
}

// Largest distance of a channel from the sixth-order differences of another, over its largest
// value.
double DerivativeError(const Trace& trace, const std::string& of, const std::string& rate,
                       double factor = 1.0) {
  const int a = trace.Find(of), b = trace.Find(rate);
  EXPECT_GE(a, 0) << of;
  EXPECT_GE(b, 0) << rate;
  const double h = trace.time_s[1] - trace.time_s[0];
  const auto step = [&](Eigen::Index i, Eigen::Index k) {
    return trace.values(i + k, a) - trace.values(i - k, a);
  };
  double worst = 0.0;
  for (Eigen::Index i = 3; i + 3 < trace.values.rows(); ++i) {
    const double slope = (45 * step(i, 1) - 9 * step(i, 2) + step(i, 3)) / (60 * h);
    worst = std::max(worst, std::abs(slope - factor * trace.values(i, b)));
  }
  return worst / trace.values.col(b).cwiseAbs().maxCoeff();
}

TEST(OutputRates, AreTheDerivativesOfTheRecordedPose) {
  for (const bool reversed : {false, true}) {
    const Mechanism m = DrivenZoo(reversed);
    const Motion motion{.duration_s = 0.2, .sample_s = 2e-3, .commands = {}, .loads = {}};
    const SimulationRun run = Simulate(m, motion, Waves(m), {.mode = DriveMode::kInverse});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    for (const char* c : {"x", "y", "z", "roll", "pitch", "yaw"}) {
      const std::string name = std::string("tip.") + c;
      // Differences: round-off ε/h, truncation h⁶ω⁷/140.
      EXPECT_LT(DerivativeError(run.trace, name, name + ".velocity"), 1e-11) << name;
      EXPECT_LT(DerivativeError(run.trace, name + ".velocity", name + ".acceleration"), 1e-11)
          << name;
      // A rate that is off by 1e-9 would be seen.
      EXPECT_GT(DerivativeError(run.trace, name, name + ".velocity", 1.0 + 1e-9), 5e-10) << name;
    }
  }
}

TEST(OutputRates, AreNoneWhereAnAngleHasNone) {
  Mechanism m = fixtures::MakeFourBar();
  // Pitch of 90°: roll and yaw turn about one axis.
  m.outputs[0].X_BO.linear() = RotY(0.5 * std::numbers::pi);
  const Motion motion{.duration_s = 0.1, .sample_s = 0.01, .commands = {}, .loads = {}};
  const SimulationRun run =
      Simulate(m, motion, fixtures::HoldStill({fixtures::FourBar::kHomeAngle}),
               {.mode = DriveMode::kInverse});
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_TRUE(std::isnan(run.trace.values(0, run.trace.Find("tip.yaw.velocity"))));
  EXPECT_EQ(run.trace.values(0, run.trace.Find("tip.x.velocity")), 0.0);
}

}  // namespace
}  // namespace mbv
