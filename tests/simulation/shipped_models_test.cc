// The simulation of the shipped models against the other witnesses, on shortened scenarios.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "analytic/closed_form.h"
#include "base/demand.h"
#include "kinematics/mobility.h"
#include "reference/reference.h"
#include "scenario/load_scenario.h"
#include "simulation/engine/simulation.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

struct Case {
  Mechanism mechanism;
  Motion motion;
  std::unique_ptr<ClosedForm> closed_form;
  Trace truth;  // of the closed form

  explicit Case(const std::string& scenario, double duration_s) {
    ScenarioResult result =
        LoadScenario(std::string(kSourceDir) + "/scenarios/" + scenario + ".yaml");
    MBV_DEMAND(result.scenario.has_value() && result.mechanism.has_value(),
               result.diagnostics.Text());
    mechanism = *std::move(result.mechanism);
    motion = result.scenario->motion;
    motion.duration_s = std::min(motion.duration_s, duration_s);
    Diagnostics diagnostics;
    closed_form =
        FindClosedForm(mechanism.name)
            ->factory(mechanism, motion,
                      {.model = result.scenario->analytic.model, .as_printed = {}}, &diagnostics);
    MBV_DEMAND(closed_form != nullptr, diagnostics.Text());
    truth = RunClosedForm(mechanism, motion, closed_form.get()).trace;
  }

  DrivenMotion Driven() {
    return [this](double t, DrivenSample* driven) {
      EvaluateMotion(motion, t, &command);
      return closed_form->Kinematics(command, driven);
    };
  }

  // RMS of the difference of one drive's forces over the RMS of the truth, the worst drive.
  [[nodiscard]] double WorstDriveError(const SimulationRun& run) const {
    double worst = 0.0;
    for (const Drive& drive : mechanism.drives) {
      const std::string name = drive.name + ".force";
      const VecX x = run.trace.values.col(run.trace.Find(name));
      const VecX y = truth.values.col(truth.Find(name));
      const double error = (x - y).norm() / y.norm();
      worst = std::isnan(error) ? kNan : std::max(worst, error);
    }
    return worst;
  }

  CommandSample command;
};

struct Limit {
  const char* scenario;
  double duration_s;
  double inverse, forward;  // of the worst drive
  double step_s;
};
// Limits are about ten times what was measured (inverse, forward): 3.1e-14 and 2.3e-13, 6.5e-15 and
// 2.4e-10, 5.1e-14 and 3.7e-14, 9.5e-15 and 5.0e-10, 1.7e-14 and 1.5e-13.
const Limit kLimits[] = {
    {"stabilizing_platform/sea_state", 3.0, 3e-13, 3e-12, 1e-3},
    {"spr_tripod/tool_load", 1.0, 1e-13, 3e-9, 1e-3},
    {"scara_robot/axis", 2.0, 5e-13, 5e-13, 1e-3},
    {"scara_robot/pick_place", 0.4, 1e-13, 5e-9, 2e-4},
    {"cabin_robot/wrench", 2.0, 2e-13, 2e-12, 1e-3},
};

TEST(ShippedModels, OfEveryClosedFormAreHere) {
  for (const ClosedFormRow& row : ClosedForms()) {
    EXPECT_TRUE(std::any_of(std::begin(kLimits), std::end(kLimits), [&](const Limit& limit) {
      return std::string(limit.scenario).starts_with(row.mechanism + "/");
    })) << row.mechanism;
  }
}

TEST(ShippedModels, InverseModeAgreesWithTheClosedFormsToRoundOff) {
  for (const Limit& limit : kLimits) {
    Case c(limit.scenario, limit.duration_s);
    const SimulationRun run =
        Simulate(c.mechanism, c.motion, c.Driven(), {.mode = DriveMode::kInverse});
    ASSERT_TRUE(run.summary.ok()) << limit.scenario << ": " << run.summary.message;
    EXPECT_TRUE(run.warnings.empty());
    EXPECT_TRUE(run.not_unique.empty());
    EXPECT_LT(c.WorstDriveError(run), limit.inverse) << limit.scenario;
  }
}

TEST(ShippedModels, ForwardModeAgreesWithTheClosedForms) {
  for (const Limit& limit : kLimits) {
    Case c(limit.scenario, limit.duration_s);
    const SimulationRun run = Simulate(c.mechanism, c.motion, c.Driven(), {.step_s = limit.step_s});
    ASSERT_TRUE(run.summary.ok()) << limit.scenario << ": " << run.summary.message;
    EXPECT_LT(c.WorstDriveError(run), limit.forward) << limit.scenario;
    EXPECT_LT(run.trace.values.col(run.trace.Find("closure.position")).maxCoeff(), 1e-8);
  }
}

TEST(ShippedModels, AMassWrongByOnePartInAMillionShowsInEveryMode) {
  Case c("spr_tripod/default", 0.3);
  Mechanism perturbed = c.mechanism;
  perturbed.bodies[perturbed.FindBody("platform")].mass *= 1.0 + 1e-6;
  for (const DriveMode mode : {DriveMode::kPrescribedMotion, DriveMode::kInverse}) {
    const SimulationRun run = Simulate(perturbed, c.motion, c.Driven(), {.mode = mode});
    EXPECT_GT(c.WorstDriveError(run), 1e-7);
  }
}

TEST(ShippedModels, MasslessLinksCanBeSimulated) {
  Case c("stabilizing_platform/paper_figures", 1.0);
  for (const DriveMode mode : {DriveMode::kPrescribedMotion, DriveMode::kInverse}) {
    const SimulationRun run = Simulate(c.mechanism, c.motion, c.Driven(), {.mode = mode});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    // Twelve links with 1e-11 of the whole mass (165 t) each, against forces of 50 t.
    EXPECT_LT(c.WorstDriveError(run), 2e-9);
  }
}

// Between two positions of three drives for two DOFs no straight way closes: it starts 60 deg
// of both shoulders from home, and turns by as much from sample to sample.
TEST(ShippedModels, DependentDrivesMayStartFarFromHomeAndMoveFarFromSampleToSample) {
  const ScenarioOptions far{
      .set = {{"motion.commands.tool.x",
               "[base/2, {sine: {amplitude: 0.2, period_s: 2, phase_deg: 90}}]"},
              {"motion.commands.tool.y",
               "[0.36, {sine: {amplitude: 0.1, period_s: 1, phase_deg: 90}}]"},
              {"motion.sample_s", "0.25"}}};
  const ScenarioResult loaded = LoadScenario(
      std::string(kSourceDir) + "/scenarios/redundant_five_bar/circle_inverse.yaml", far);
  ASSERT_TRUE(loaded.scenario.has_value()) << loaded.diagnostics.Text();
  const Mechanism& mechanism = *loaded.mechanism;
  const Motion& motion = loaded.scenario->motion;
  ReferenceSolver solver(mechanism, motion);
  ReferenceSample sample;
  CommandSample command;
  const DrivenMotion driven = [&](double t, DrivenSample* at) {
    EvaluateMotion(motion, t, &command);
    RunSummary summary = solver.Kinematics(command, &sample);
    *at = sample.driven;
    return summary;
  };
  const SimulationRun run = Simulate(mechanism, motion, driven, {.mode = DriveMode::kInverse});
  ASSERT_TRUE(run.summary.ok()) << run.summary.message << " at " << run.summary.time_s;
  const ReferenceRun reference = RunReference(mechanism, motion);
  for (const char* name : {"motor1.force", "motor2.force", "motor3.force"}) {
    const VecX x = run.trace.values.col(run.trace.Find(name));
    const VecX y = reference.trace.values.col(reference.trace.Find(name));
    EXPECT_LT((x - y).norm(), 1e-13 * y.norm()) << name;
  }
}

// Every channel of the generic reference, reactions of unique joints included.
TEST(ShippedModels, AllUniqueReactionsAgreeWithTheReference) {
  for (const char* scenario :
       {"stabilizing_platform/sea_state", "spr_tripod/tool_load", "scara_robot/axis"}) {
    Case c(scenario, 0.3);
    const Mobility mobility = AnalyseMobility(c.mechanism);
    const ReferenceRun reference = RunReference(c.mechanism, c.motion);
    ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
    const SimulationRun run =
        Simulate(c.mechanism, c.motion, c.Driven(), {.mode = DriveMode::kInverse});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    int compared = 0;
    for (const Joint& joint : c.mechanism.joints) {
      if (DofsOf(joint.kind) == 6) continue;  // transmits nothing
      const auto& not_unique = mobility.joints_not_unique;
      if (std::find(not_unique.begin(), not_unique.end(), joint.name) != not_unique.end()) continue;
      // Scale: the largest of the joint's forces (lever arms are of the order of a metre).
      double size = 1.0, error = 0.0;
      for (const char* f : {"fx", "fy", "fz", "mx", "my", "mz"}) {
        const std::string name = joint.name + ".reaction." + f;
        const VecX x = run.trace.values.col(run.trace.Find(name));
        const VecX y = reference.trace.values.col(reference.trace.Find(name));
        size = std::max(size, y.lpNorm<Eigen::Infinity>());
        error = std::max(error, (x - y).lpNorm<Eigen::Infinity>());
      }
      EXPECT_LT(error, 1e-9 * size) << joint.name;
      ++compared;
    }
    EXPECT_GE(compared, 5) << scenario;
  }
}

TEST(ShippedModels, PlatformsTakeTheirCommandedPose) {
  Case c("spr_tripod/default", 0.5);
  const SimulationRun run = Simulate(c.mechanism, c.motion, c.Driven(), {});
  const int x = run.trace.Find("platform.x"), z = run.trace.Find("platform.z");
  CommandSample command;
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    EvaluateMotion(c.motion, run.trace.time_s[i], &command);
    const auto row = static_cast<Eigen::Index>(i);
    EXPECT_NEAR(run.trace.values(row, x), command.position[c.motion.FindCommand("platform.x")],
                1e-9);
    EXPECT_NEAR(run.trace.values(row, z), command.position[c.motion.FindCommand("platform.z")],
                1e-9);
  }
}

}  // namespace
}  // namespace mbv
