#include "features/convergence/order.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mbv {
namespace {

const std::vector<double> kSteps = {4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4};

template <typename Error>
std::vector<double> Errors(Error error) {
  std::vector<double> errors;
  for (const double h : kSteps) errors.push_back(error(h));
  return errors;
}

OrderFit Fit(const std::vector<double>& errors) {
  return FitOrder(kSteps, errors, std::vector<double>(errors.size(), 0.0));
}

TEST(OrderFit, ReadsTheOrderOfAPureSeries) {
  // 1 at 4 ms, 1/16 at 2 ms, …: a sixteenth per half step is order 4.
  const OrderFit fit = Fit({1.0, 1.0 / 16, 1.0 / 256, 1.0 / 4096, 1.0 / 65536});
  EXPECT_NEAR(fit.order, 4.0, 1e-12);
  EXPECT_NEAR(fit.order_error, 0.0, 1e-12);
  EXPECT_EQ(fit.first_fitted(), 0);
  EXPECT_EQ(fit.last_fitted(), 4);
  EXPECT_TRUE(std::isnan(fit.pairwise[0]));
  EXPECT_NEAR(fit.pairwise[3], 4.0, 1e-12);
  EXPECT_FALSE(JudgeOrder(fit, {4.0, 4.0}).finding);
}

TEST(OrderFit, AWrongOrderIsAFindingHoweverSmallTheErrorIs) {
  for (const double order : {1.0, 2.0, 3.0}) {
    const OrderFit fit = Fit(Errors([&](double h) { return 1e-9 * std::pow(h / 4e-3, order); }));
    EXPECT_NEAR(fit.order, order, 1e-12);
    const OrderVerdict verdict = JudgeOrder(fit, {4.0, 4.0});
    EXPECT_TRUE(verdict.judged && verdict.finding) << order;
    EXPECT_NE(verdict.text.find("too low"), std::string::npos) << verdict.text;
  }
  const OrderFit fast = Fit(Errors([](double h) { return h * h * h; }));
  EXPECT_NE(JudgeOrder(fast, {1.0, 2.0}).text.find("too high"), std::string::npos);
}

TEST(OrderFit, ToleratesHalfAnOrderAndNotMore) {
  const auto verdict = [](double order) {
    return JudgeOrder(Fit(Errors([&](double h) { return std::pow(h, order); })), {2.0, 2.0});
  };
  EXPECT_FALSE(verdict(2.0 - 0.9 * kOrderTolerance).finding);
  EXPECT_FALSE(verdict(2.0 + 0.9 * kOrderTolerance).finding);
  EXPECT_TRUE(verdict(2.0 - 2.0 * kOrderTolerance).finding);
  EXPECT_TRUE(verdict(2.0 + 2.0 * kOrderTolerance).finding);
}

TEST(OrderFit, ARoundoffPlateauIsLeftOutAndIsNotAFinding) {
  // Order 4 from 1e-8 down to a plateau at 2e-11.
  const OrderFit fit = Fit({1e-8, 6.3e-10, 4.5e-11, 2.1e-11, 2.0e-11});
  EXPECT_EQ(fit.floor, (std::vector<bool>{false, false, true, true, true}));
  EXPECT_NEAR(fit.order, 4.0, 0.02);
  EXPECT_FALSE(JudgeOrder(fit, {4.0, 4.0}).finding);
}

TEST(OrderFit, APlateauThatRoundoffCannotExplainIsAFinding) {
  const OrderVerdict verdict = JudgeOrder(Fit({1e-6, 6.3e-8, 4e-9, 2e-9, 2e-9}), {4.0, 4.0});
  EXPECT_TRUE(verdict.finding);
  EXPECT_NE(verdict.text.find("at finer steps"), std::string::npos) << verdict.text;
}

TEST(OrderFit, AnErrorThatFallsSlowlyBelowThePlateauLevelIsStillAFinding) {
  // Order 1 from 8e-11 on: round-off would not fall.
  EXPECT_TRUE(JudgeOrder(Fit({8e-11, 4e-11, 2e-11, 1e-11, 5e-12}), {4.0, 4.0}).finding);
}

TEST(OrderFit, OnlyTheFloorMeansNothingIsJudged) {
  const OrderVerdict verdict =
      JudgeOrder(Fit({2.1e-11, 2.0e-11, 2.2e-11, 1.9e-11, 2e-11}), {4.0, 4.0});
  EXPECT_FALSE(verdict.judged);
  EXPECT_FALSE(verdict.finding);
  EXPECT_NE(verdict.text.find("round-off"), std::string::npos) << verdict.text;
}

TEST(OrderFit, CoarseStepsOutsideTheAsymptoticRangeAreLeftOut) {
  // A higher-order term rules the coarse steps: h² + 1e10 h⁶ (in s).
  const OrderFit fit = Fit(Errors([](double h) { return h * h + 1e10 * std::pow(h, 6); }));
  EXPECT_FALSE(fit.fitted[0]);
  EXPECT_NEAR(fit.order, 2.0, 0.1);  // the other term is 16 % at 2 ms, 1 % at 1 ms
}

TEST(OrderFit, ErrorsWithANamedOtherCauseAreLeftOut) {
  const std::vector<double> errors = {1.6e-4, 1e-5, 6.25e-7, 3e-7, 1.5e-7};
  const std::vector<double> remains = {0, 0, 0, 4e-7, 2e-7};
  EXPECT_TRUE(JudgeOrder(Fit(errors), {4.0, 4.0}).finding);
  const OrderFit fit = FitOrder(kSteps, errors, remains);
  EXPECT_NEAR(fit.order, 4.0, 1e-12);
  EXPECT_FALSE(JudgeOrder(fit, {4.0, 4.0}).finding);
}

TEST(OrderFit, MissingRunsAreSkippedAndTooFewAreNotJudged) {
  const OrderFit gap = Fit({kNan, 1.0, kNan, 1.0 / 16, 1.0 / 64});
  EXPECT_NEAR(gap.order, 2.0, 1e-12);
  EXPECT_TRUE(std::isnan(gap.pairwise[2]));
  EXPECT_NEAR(gap.pairwise[3], 2.0, 1e-12);
  const OrderVerdict verdict = JudgeOrder(Fit({kNan, 1.0, kNan, kNan, kNan}), {2.0, 2.0});
  EXPECT_FALSE(verdict.judged);
  EXPECT_NE(verdict.text.find("too few"), std::string::npos);
}

TEST(Richardson, RemovesTheLeadingErrorAndItsIndexCoversWhatIsLeft) {
  // f(h) = 3 + 5 h² + 40 h³ with the true value 3.
  const auto f = [](double h) { return 3.0 + 5.0 * h * h + 40.0 * h * h * h; };
  std::vector<double> errors;
  for (const double h : kSteps) errors.push_back(std::abs(f(h) - 3.0));
  const OrderFit fit = Fit(errors);
  const Richardson r = MakeRichardson(1e-3, 5e-4, fit, {2.0, 2.0});
  EXPECT_EQ(r.safety, 1.25);
  EXPECT_EQ(r.order, 2.0);  // 2.1 is observed; more than the scheme has is not believed …
  EXPECT_EQ(MakeRichardson(1e-3, 5e-4, fit, {2.0, 6.0}).order, 2.0);  // … near step zero
  EXPECT_NEAR(r.factor, 1.0 / 3.0, 1e-12);
  const double difference = f(5e-4) - f(1e-3);
  const double extrapolated = f(5e-4) + r.factor * difference;
  const double index = r.safety * r.factor * std::abs(difference);
  EXPECT_LT(std::abs(extrapolated - 3.0), 0.05 * std::abs(f(5e-4) - 3.0));
  EXPECT_LT(std::abs(extrapolated - 3.0), index);
  EXPECT_LT(std::abs(f(5e-4) - 3.0), index);
}

TEST(Richardson, AnIndexFromAnOrderThatIsTooHighWouldNotCoverTheTruth) {
  // Order 1, but taken for order 4: the index must fail to cover, or it could not show anything.
  const auto f = [](double h) { return 3.0 + 5.0 * h; };
  OrderFit wrong;
  wrong.order = 4.0;
  wrong.order_error = 0.0;
  const Richardson r = MakeRichardson(1e-3, 5e-4, wrong, {4.0, 4.0});
  const double difference = f(5e-4) - f(1e-3);
  EXPECT_GT(std::abs(f(5e-4) + r.factor * difference - 3.0),
            r.safety * r.factor * std::abs(difference));
}

TEST(Richardson, WithoutAnObservedOrderTheLowestExpectedOneIsTakenWithThreefoldSafety) {
  const Richardson r = MakeRichardson(2e-3, 1e-3, OrderFit{}, {2.0, 4.0});
  EXPECT_EQ(r.order, 2.0);
  EXPECT_EQ(r.safety, 3.0);
  EXPECT_EQ(MakeRichardson(2e-3, 1e-3, OrderFit{}, {-2.0, 2.0}).order, 1.0);
}

}  // namespace
}  // namespace mbv
