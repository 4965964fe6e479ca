// Agreements that verify nothing are not reported as such, and those that verify less say so.
#include "comparison/caveats.h"

#include <gtest/gtest.h>

#include "tests/comparison/carried.h"

namespace mbv {
namespace {

using synthetic::Case;
using synthetic::Perturb;
using synthetic::Stretch;

bool Has(const std::vector<Caveat>& caveats, const std::string& part) {
  for (const Caveat& caveat : caveats) {
    if (caveat.text.find(part) != std::string::npos) return true;
  }
  return false;
}

void Widen(Case* c, Metric metric, double limit) { c->limits[metric] = {limit, limit, limit}; }

TEST(Caveats, LimitsWiderThanATenthVerifyNothing) {
  Case c;
  for (const Metric metric : {Metric::kForceNrmse, Metric::kForceMax, Metric::kForceOwn}) {
    Widen(&c, metric, 1e9);
  }
  Stretch(&c.simulated, "d1.force", 3.0);
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kNotRun);
  EXPECT_NE(comparison.reason.find("every force limit is so wide"), std::string::npos)
      << comparison.reason;
  EXPECT_FALSE(comparison.FindCheck("simulated_vs_analytic.force_nrmse")->insensitive.empty());
}

TEST(Caveats, OneWideLimitIsNamedAndNotCountedAsVerified) {
  Case c;
  const size_t all = c.Run().verified();
  Widen(&c, Metric::kReaction, 0.2);
  Widen(&c, Metric::kPoseM, 0.2);  // metres, in a mechanism of 1 m
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kAgree);
  EXPECT_EQ(comparison.verified(), all - 6);
  EXPECT_EQ(comparison.insensitive(), 6u);
  EXPECT_NE(comparison.reason.find("6 more verify nothing"), std::string::npos);
  EXPECT_TRUE(Has(comparison.caveats, "simulated_vs_analytic.reaction_nrmse (0.2)"));
  EXPECT_TRUE(Has(comparison.caveats, "simulated_vs_analytic.pose_m (0.2 m)"));
  Widen(&c, Metric::kReaction, 0.1);
  Widen(&c, Metric::kPoseM, 0.1);
  EXPECT_TRUE(c.Run().caveats.empty());
}

TEST(Caveats, AWideLimitThatIsExceededStillDisagrees) {
  Case c;
  for (const Metric metric : {Metric::kForceNrmse, Metric::kForceMax, Metric::kForceOwn}) {
    Widen(&c, metric, 0.5);
  }
  Stretch(&c.simulated, "d1.force", 3.0);
  EXPECT_EQ(c.Run().verdict, Verdict::kDisagree);
}

TEST(Caveats, AStartWindowThatLeavesOneSampleVerifiesNothing) {
  Case c;
  c.start_window_s = 0.995;
  EXPECT_EQ(c.Run().verdict, Verdict::kNotRun);
  EXPECT_NE(c.Run().reason.find("leaves 1 sample to judge"), std::string::npos) << c.Run().reason;
  c.start_window_s = 0.5;
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree);
  EXPECT_TRUE(Has(c.Run().caveats, "judged from 0.5 to 1 s only, in a motion of 1 s"));
  c.start_window_s = 0.02;
  EXPECT_TRUE(c.Run().caveats.empty());
}

// The traces shortened to `rows`.
Case Short(Eigen::Index rows) {
  Case c;
  for (Trace* trace : {&c.analytic, &c.reference, &c.simulated}) {
    trace->time_s.resize(static_cast<size_t>(rows));
    trace->values = trace->values.topRows(rows).eval();
  }
  c.motion.duration_s = 0.01 * static_cast<double>(rows - 1);
  return c;
}

TEST(Caveats, FewSamplesAndTheDerivativesTheyDoNotAllowAreReported) {
  const Comparison seven = Short(7).Run();
  EXPECT_TRUE(seven.caveats.empty()) << seven.caveats.front().text;
  const Comparison six = Short(6).Run();
  EXPECT_EQ(six.verdict, Verdict::kAgree);
  EXPECT_TRUE(Has(six.caveats, "rates were not checked against positions: 6 samples"));
  EXPECT_FALSE(Has(six.caveats, "forces were judged at"));
  EXPECT_TRUE(Has(Short(2).Run().caveats, "forces were judged at 2 samples only"));
}

// At rest, without gravity: forces are zero whatever the masses are.
Case Weightless() {
  Case c;
  c.mechanism.gravity_W.setZero();
  for (Command& command : c.motion.commands) command.profile = Constant(0.0);
  for (Trace* trace : {&c.analytic, &c.reference, &c.simulated}) {
    for (const char* drive : {"d1", "d2"}) {
      for (const char* signal : {".position", ".velocity", ".acceleration", ".force"}) {
        Stretch(trace, std::string(drive) + signal, 0.0);
      }
    }
  }
  return c;
}

TEST(Caveats, NothingMovesAndNothingWeighsVerifiesNothing) {
  const Comparison comparison = Weightless().Run();
  EXPECT_EQ(comparison.verdict, Verdict::kNotRun);
  EXPECT_NE(comparison.reason.find("nothing moves, weighs or exerts a force"), std::string::npos)
      << comparison.reason;
  Case round = Weightless();
  Perturb(&round.simulated, "d1.force", 1e-16);  // round-off
  EXPECT_EQ(round.Run().verdict, Verdict::kNotRun);
  Case perturbed = Weightless();
  Perturb(&perturbed.simulated, "d1.force", 0.5);  // a force out of nothing
  EXPECT_EQ(perturbed.Run().verdict, Verdict::kDisagree);
}

TEST(Caveats, ForcesThatCancelOutAgreeWithAReservation) {
  Case c;
  for (Trace* trace : {&c.analytic, &c.reference, &c.simulated}) {
    Stretch(trace, "d1.force", 0.0);
    Stretch(trace, "d2.force", 0.0);
  }
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree);
  EXPECT_TRUE(Has(c.Run().caveats, "verified is only that they cancel out"));
}

}  // namespace
}  // namespace mbv
