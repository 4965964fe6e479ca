// The runs of witnesses: who takes part, and what they hand over.
#include <gtest/gtest.h>

#include "tests/comparison/synthetic.h"
#include "tests/support/source_dir.h"
#include "verify/computed_once.h"
#include "verify/run_witnesses.h"

namespace mbv {
namespace {

TEST(Extrapolate, ForcesLinearInTheParameterAreHitExactly) {
  // F(k) = F(0) + k·G: from k = 1 and 0.5 to 0 this is 2F(0.5) − F(1).
  Trace at_1 = synthetic::ExactTrace("simulated"), at_half = at_1;
  synthetic::Perturb(&at_1, "d1.force", 8.0);
  synthetic::Perturb(&at_half, "d1.force", 4.0);
  const Trace at_0 = Extrapolate(at_1, 1.0, at_half, 0.5, 0.0);
  const Trace exact = synthetic::ExactTrace("simulated");
  EXPECT_LT((at_0.values - exact.values).cwiseAbs().maxCoeff(), 16 * kEps * 108.0);
}

TEST(Extrapolate, MotionIsNotExtrapolatedAndTheWorseClosureCounts) {
  Trace a = synthetic::ExactTrace("simulated"), b = a;
  synthetic::Perturb(&b, "d1.position", 1.0);
  synthetic::Perturb(&b, "closure.position", 3e-9);
  synthetic::Perturb(&a, "closure.position", 1e-9);
  const Trace result = Extrapolate(a, 1.0, b, 0.5, 0.0);
  EXPECT_EQ(result.values.col(result.Find("d1.position")), a.values.col(a.Find("d1.position")));
  EXPECT_EQ(result.values(5, result.Find("closure.position")), 3e-9);
  b.values(5, b.Find("closure.position")) = kNan;
  const Trace broken = Extrapolate(a, 1.0, b, 0.5, 0.0);
  EXPECT_TRUE(std::isnan(broken.values(5, broken.Find("closure.position"))));
}

std::optional<Prepared> PreparedFrom(const std::string& scenario, std::vector<SetValue> set = {}) {
  Diagnostics diagnostics;
  auto prepared = Prepare(SourcePath("/scenarios/" + scenario + ".yaml"), {.set = std::move(set)},
                          &diagnostics);
  EXPECT_TRUE(prepared) << diagnostics.Text();
  return prepared;
}

std::vector<std::string> NamesOf(const WitnessRuns& runs) {
  std::vector<std::string> names;
  for (const WitnessRecord& record : runs.records) names.push_back(record.name);
  return names;
}

const std::vector<SetValue> kShortTurn = {{"motion.duration_s", "0.05"},
                                          {"snapshots.times_s", "[0]"}};

TEST(WitnessRunner, WitnessesRunInTheOrderInWhichTheyAreShown) {
  const auto prepared = PreparedFrom("spr_tripod/default", kShortTurn);
  ASSERT_TRUE(prepared);
  WitnessRunner runner(*prepared);
  runner.RunComputed();
  EXPECT_EQ(NamesOf(runner.runs()), (std::vector<std::string>{"analytic", "reference"}));
  ASSERT_TRUE(runner.CheckStrokes());
  runner.RunFollowing();
  EXPECT_EQ(NamesOf(runner.runs()),
            (std::vector<std::string>{"analytic", "reference", "simulated"}));
  const WitnessRuns runs = runner.Take();
  ComparisonInput input = InputOf(*prepared);
  runs.HandOver(&input);
  ASSERT_EQ(input.witnesses.size(), 3U);
  EXPECT_EQ(Compare(input).verdict, Verdict::kAgree);
}

TEST(WitnessRunner, EveryChannelIsWritten) {
  const auto prepared = PreparedFrom("four_bar/turn", kShortTurn);
  ASSERT_TRUE(prepared);
  WitnessRunner runner(*prepared);
  runner.RunComputed();
  runner.RunFollowing();
  for (const Role* role : {&role::kReference, &role::kSimulated}) {
    const WitnessRecord* record = runner.runs().Find(*role);
    ASSERT_NE(record, nullptr);
    for (size_t c = 0; c < record->trace.channels.size(); ++c) {
      EXPECT_TRUE(record->trace.values.col(static_cast<Eigen::Index>(c)).allFinite())
          << role->name << ": " << record->trace.channels[c].name;
    }
  }
}

TEST(WitnessRunner, WhoHasNoPartIsLeftOutAndWhoIsOffSaysSo) {
  const auto prepared = PreparedFrom(
      "spr_tripod/default",
      {{"analytic", "none"}, {"motion.duration_s", "0.05"}, {"snapshots.times_s", "[0]"}});
  ASSERT_TRUE(prepared);
  WitnessRunner runner(*prepared);
  EXPECT_EQ(&prepared->driver(), &role::kReference);
  EXPECT_TRUE(runner.TakesPart(role::kAnalytic));
  EXPECT_FALSE(runner.TakesPart(role::kSolver));
  EXPECT_FALSE(runner.TakesPart(role::kReached));
  runner.Run(role::kAnalytic);
  EXPECT_EQ(runner.runs().Find(role::kAnalytic)->summary.stop, Stop::kNotRun);
  EXPECT_EQ(runner.runs().Find(role::kSolver), nullptr);
}

TEST(ComputedOnce, EachInstantIsComputedOnceWhateverTheSource) {
  ComputedOnce<double> values(1e12);
  int calls = 0;
  const auto source = [&](double t_s, double* value) {
    ++calls;
    *value = 2.0 * t_s;
    return t_s < 1.0 ? RunSummary::Done() : RunSummary{};
  };
  double value = 0.0;
  EXPECT_TRUE(values.Of(source)(0.5, &value).ok());
  EXPECT_TRUE(values.Of(source)(0.5 + 1e-14, &value).ok());
  EXPECT_EQ(value, 1.0);
  EXPECT_EQ(calls, 1);
  EXPECT_FALSE(values.Of(source)(2.0, &value).ok());
  EXPECT_FALSE(values.Of(source)(2.0, &value).ok());
  EXPECT_EQ(calls, 3) << "a failure is not kept";
}

}  // namespace
}  // namespace mbv
