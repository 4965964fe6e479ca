// The simulation follows another computation's drive motion: a fault in that motion must be found,
// and be put down to the computation that made it.
#include <gtest/gtest.h>

#include "pipeline/prepare.h"
#include "pipeline/simulate_scenario.h"
#include "reference/reference.h"
#include "tests/source_dir.h"

namespace mbv {
namespace {

// The tripod's scenario run by hand, with a drive acceleration of the closed form that is 5 % wrong
// where the simulation takes it and where it is recorded. The closed form's forces do not use it.
struct Tripod {
  std::optional<Prepared> prepared;
  ClosedFormRun analytic;
  ReferenceRun reference;
  SimulatedWitness simulated;

  Tripod(const std::string& mode, double factor) {
    Diagnostics findings;
    ScenarioOptions options;
    options.set = {{"simulation.mode", mode}, {"motion.sample_s", "0.05"}};
    prepared = Prepare(SourcePath("/scenarios/spr_tripod/default.yaml"), options, &findings);
    if (!prepared) return;
    const Scenario& scenario = prepared->scenario;
    analytic = RunClosedForm(prepared->mechanisms.analytic, scenario.motion,
                             prepared->closed_form.closed_form.get());
    analytic.trace.witness = "analytic";
    for (const Drive& drive : prepared->base.drives) {
      analytic.trace.values.col(analytic.trace.Find(drive.name + ".acceleration")) *= factor;
    }
    reference = RunReference(prepared->mechanisms.reference, scenario.motion);
    reference.trace.witness = "reference";
    const DrivenMotion right = prepared->MakeDrivenMotion();
    const DrivenMotion wrong = [&](double t_s, DrivenSample* driven) {
      RunSummary summary = right(t_s, driven);
      driven->acceleration *= factor;
      return summary;
    };
    simulated =
        RunSimulation(scenario, prepared->mechanisms.simulated, wrong, Engine::kCorrected, {});
  }

  [[nodiscard]] Comparison Judge() const {
    const bool forward = prepared->scenario.simulation.forward;
    return Compare({.mechanism = &prepared->base,
                    .motion = &prepared->scenario.motion,
                    .limits = prepared->scenario.checks,
                    .simulation_limits = forward ? LimitColumn::kForward : LimitColumn::kInverse,
                    .witnesses = {{"analytic", &analytic.trace, analytic.summary},
                                  {"reference", &reference.trace, reference.summary},
                                  {"simulated", &simulated.run.trace, simulated.run.summary}},
                    .driven_by = prepared->driver().name,
                    .reactions_not_unique = {}});
  }
};

TEST(Driver, AWrongAccelerationInTheClosedFormNamesItAndNotTheSimulation) {
  for (const char* mode : {"inverse", "forward"}) {
    const Tripod wrong(mode, 1.05);
    ASSERT_TRUE(wrong.prepared);
    const Comparison comparison = wrong.Judge();
    EXPECT_EQ(comparison.verdict, Verdict::kDisagree) << mode;
    // The forces alone speak against the simulation.
    EXPECT_GT(comparison.FindCheck("simulated_vs_analytic.force_nrmse")->value, 1e-3) << mode;
    EXPECT_LT(comparison.FindCheck("reference_vs_analytic.force_nrmse")->value, 1e-12) << mode;
    EXPECT_EQ(comparison.attribution.odd_one_out, "analytic")
        << mode << ": " << comparison.attribution.text;
  }
}

TEST(Driver, ARightOneIsNobodysFault) {
  for (const char* mode : {"inverse", "forward"}) {
    const Tripod right(mode, 1.0);
    ASSERT_TRUE(right.prepared);
    const Comparison comparison = right.Judge();
    EXPECT_EQ(comparison.verdict, Verdict::kAgree) << mode << ": " << comparison.reason;
    for (const char* check : {"simulated.command_velocity", "simulated.command_acceleration"}) {
      const CheckResult* found = comparison.FindCheck(check);
      ASSERT_NE(found, nullptr) << check;
      EXPECT_LT(found->value, *found->limit) << mode << " " << check;
      EXPECT_FALSE(found->follows);
    }
  }
}

}  // namespace
}  // namespace mbv
