// Stiffness results of made-up witnesses: each check passes at agreement and fails when its
// quantity is perturbed by twice its limit.
#include "comparison/compare_stiffness.h"

#include <gtest/gtest.h>

#include <functional>

#include "tests/support/reports.h"

namespace mbv {
namespace {

// A spring in every direction with some coupling: 2000 N m/rad, 3e5 N/m.
Mat6 MakeStiffness() {
  Mat6 K = Mat6::Zero();
  K.diagonal() << 2000, 1000, 500, 3e5, 2e5, 1e5;
  K(0, 4) = K(4, 0) = 3000;
  K(3, 5) = K(5, 3) = -4e4;
  return K;
}

std::vector<Vec6> MakeLoads() {
  std::vector<Vec6> loads;
  for (int k = 0; k < 10; ++k) {
    Vec6 load;
    for (int c = 0; c < 6; ++c) load[c] = std::sin(1.0 + 3 * k + c) * (c < 3 ? 1.0 : 100.0);
    loads.push_back(load);
  }
  return loads;
}

StiffnessWitness MakeWitness(const std::string& name) {
  StiffnessWitness witness;
  witness.name = name;
  StiffnessResult& result = witness.result;
  result.K = MakeStiffness();
  result.C = result.K.inverse();
  result.rank = 6;
  result.shares = {{"arm", 0.5 * result.C}, {"rod", 0.5 * result.C}};
  result.summary = RunSummary::Done();
  witness.displacements = Displacements(result, MakeLoads());
  if (name == "simulated") witness.residual = witness.extrapolation_error = 0.0;
  return witness;
}

std::vector<StiffnessWitness> MakeWitnesses() {
  return {MakeWitness("analytic"), MakeWitness("reference"), MakeWitness("simulated")};
}

double Scale(const Mat6& M, int i, int j) { return std::sqrt(M(i, i) * M(j, j)); }

double LargestDisplacement(const StiffnessWitness& witness, int axis) {
  double largest = 0.0;
  for (const Vec6& d : witness.displacements) largest = std::max(largest, std::abs(d[axis]));
  return largest;
}

TEST(StiffnessComparison, EqualWitnessesAgree) {
  const Comparison comparison = test::CompareAll(MakeWitnesses());
  EXPECT_EQ(comparison.verdict, Verdict::kAgree) << comparison.reason;
  EXPECT_EQ(comparison.failed(), 0u);
  // Three pairs with six checks, three witnesses with three, and two of the simulation.
  EXPECT_EQ(comparison.checks.size(), 29u);
  EXPECT_TRUE(comparison.not_compared.empty());
}

struct PerturbedEntry {
  const char* check;
  std::function<void(StiffnessWitness*)> apply;  // by twice the limit
};
void PrintTo(const PerturbedEntry& entry, std::ostream* out) { *out << entry.check; }

class PerturbedCompliance : public testing::TestWithParam<PerturbedEntry> {};

TEST_P(PerturbedCompliance, FailsItsCheckOnly) {
  std::vector<StiffnessWitness> input = MakeWitnesses();
  GetParam().apply(&input[2]);
  const Comparison comparison = test::CompareAll(input);
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree) << comparison.reason;
  const CheckResult* check = comparison.FindCheck(GetParam().check);
  ASSERT_NE(check, nullptr);
  EXPECT_FALSE(check->pass) << check->value;
  EXPECT_NEAR(check->value, 2 * *check->limit, 0.05 * *check->limit);
  // Half as much is within the limit of this check.
  const CheckResult* other = comparison.FindCheck("reference_vs_analytic.stiffness_entry");
  ASSERT_NE(other, nullptr);
  EXPECT_TRUE(other->pass);
}

const PerturbedEntry kEntries[] = {
    {"simulated_vs_analytic.stiffness_entry",
     [](StiffnessWitness* w) { w->result.K(3, 3) *= 1 + 2e-4; }},
    {"simulated_vs_reference.stiffness_entry",
     [](StiffnessWitness* w) {
       w->result.K(1, 2) = w->result.K(2, 1) = 2e-4 * Scale(w->result.K, 1, 2);
     }},
    {"simulated_vs_analytic.compliance_entry",
     [](StiffnessWitness* w) {
       const double change = 2e-4 * Scale(w->result.C, 3, 4);
       w->result.C(3, 4) += change;
       w->result.C(4, 3) += change;
     }},
    {"simulated_vs_analytic.share_entry",
     [](StiffnessWitness* w) {
       const double change = 2e-4 * w->result.C(5, 5);
       w->result.shares[0].C(5, 5) += change;
       w->result.shares[1].C(5, 5) -= change;
     }},
    {"simulated_vs_analytic.displacement_axis",
     [](StiffnessWitness* w) { w->displacements[7][4] += 2e-2 * LargestDisplacement(*w, 4); }},
    {"simulated_vs_analytic.displacement_vector",
     [](StiffnessWitness* w) { w->displacements[3].tail<3>() *= 1.02; }},
    {"simulated_vs_analytic.rotation_axis",
     [](StiffnessWitness* w) { w->displacements[5][1] += 2e-2 * LargestDisplacement(*w, 1); }},
    {"simulated.symmetry",
     [](StiffnessWitness* w) { w->result.K(0, 1) += 2e-6 * Scale(w->result.K, 0, 1); }},
    {"simulated.shares_sum", [](StiffnessWitness* w) { w->result.shares[0].C(0, 0) *= 1 + 4e-6; }},
    {"simulated.definite",
     [](StiffnessWitness* w) {
       w->result.K(1, 2) = w->result.K(2, 1) = (1 + 2e-6) * Scale(w->result.K, 1, 2);
     }},
    {"simulated.residual", [](StiffnessWitness* w) { w->residual = 2e-8; }},
    {"simulated.extrapolation", [](StiffnessWitness* w) { w->extrapolation_error = 2e-5; }},
};
INSTANTIATE_TEST_SUITE_P(All, PerturbedCompliance, testing::ValuesIn(kEntries),
                         [](const auto& info) {
                           std::string name = info.param.check;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

TEST(StiffnessComparison, EveryMetricIsPerturbedInATest) {
  for (const MetricRow& row : StiffnessMetricRows()) {
    EXPECT_TRUE(std::any_of(std::begin(kEntries), std::end(kEntries),
                            [&](const PerturbedEntry& entry) {
                              return std::string(entry.check).ends_with(std::string(".") + row.key);
                            }))
        << row.key;
  }
}

TEST(StiffnessComparison, ClosedFormAndFrameAreHeldToTheirOwnLimit) {
  std::vector<StiffnessWitness> input = MakeWitnesses();
  input[0].result.K(3, 3) *= 1 + 2e-9;
  const Comparison comparison = test::CompareAll(input);
  EXPECT_FALSE(comparison.FindCheck("reference_vs_analytic.stiffness_entry")->pass);
  EXPECT_TRUE(comparison.FindCheck("simulated_vs_analytic.stiffness_entry")->pass);
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
}

TEST(StiffnessComparison, TheOddOneOutIsNamed) {
  for (int odd : {0, 1, 2}) {
    std::vector<StiffnessWitness> input = MakeWitnesses();
    input[odd].result.K(3, 3) *= 1.03;
    const Attribution attribution = test::CompareAll(input).attribution;
    EXPECT_EQ(attribution.odd_one_out, input[odd].name) << attribution.text;
    EXPECT_NE(attribution.text.find("K(x, x)"), std::string::npos) << attribution.text;
  }
}

TEST(StiffnessComparison, NotANumberNeverPasses) {
  std::vector<StiffnessWitness> input = MakeWitnesses();
  input[2].residual = kNan;
  input[2].displacements[4][3] = kNan;
  const Comparison comparison = test::CompareAll(input);
  EXPECT_FALSE(comparison.FindCheck("simulated.residual")->pass);
  EXPECT_FALSE(comparison.FindCheck("simulated_vs_analytic.displacement_axis")->pass);
  EXPECT_FALSE(comparison.FindCheck("simulated_vs_analytic.displacement_vector")->pass);
}

TEST(StiffnessComparison, WithoutComparedStiffnessNothingIsVerified) {
  std::vector<StiffnessWitness> alone = MakeWitnesses();
  alone.resize(1);
  EXPECT_EQ(test::CompareAll(alone).verdict, Verdict::kNotRun);
  CheckLimits off;
  for (const Metric metric : {Metric::kStiffnessEntry, Metric::kComplianceEntry}) off[metric] = {};
  const Comparison comparison = test::CompareAll(MakeWitnesses(), off);
  EXPECT_EQ(comparison.verdict, Verdict::kNotRun);
  EXPECT_NE(comparison.reason.find("switched off"), std::string::npos) << comparison.reason;
  std::vector<StiffnessWitness> broken = MakeWitnesses();
  broken[2].result.summary.stop = Stop::kNoConvergence;
  broken[2].result.summary.message = "no static equilibrium";
  EXPECT_EQ(test::CompareAll(broken).verdict, Verdict::kNotRun);
}

TEST(StiffnessComparison, ErrorsOfLoadsByHand) {
  StiffnessWitness truth = MakeWitness("analytic"), measured = MakeWitness("reference");
  Vec6 first, second;
  first << 0, 0, 0, 3e-3, 0, 4e-3;
  second << 1e-3, 0, 0, -1e-3, 2e-3, 2e-3;
  truth.displacements = measured.displacements = {first, second};
  measured.displacements[1] += (Vec6() << 0, 0, 0, 3e-4, 0, 0).finished();
  const auto loads = DifferenceOf(measured, truth).loads;
  ASSERT_TRUE(loads);
  EXPECT_DOUBLE_EQ(loads->scale[3], 3e-3);
  EXPECT_NEAR(loads->max[3], 0.1, 1e-12);
  EXPECT_NEAR(loads->mean[3], 0.05, 1e-12);
  EXPECT_NEAR(loads->vector_max, 0.1, 1e-12);  // 0.3 of 3 mm
  EXPECT_EQ(loads->worst_load, 1);
  const PairComparison pair = CompareStiffnesses(AsWitness(measured), AsWitness(truth));
  EXPECT_EQ(pair.metrics.at(Metric::kDisplacementAxis).channel, "x, load 2");
}

// A limit of more than a tenth lets anything pass.
TEST(StiffnessComparison, WideLimitsVerifyNothing) {
  CheckLimits wide;
  for (const Metric metric : {Metric::kStiffnessEntry, Metric::kComplianceEntry}) {
    wide[metric] = {.forward = 0.5, .inverse = 0.5, .reference = 0.5};
  }
  const Comparison comparison = test::CompareAll(MakeWitnesses(), wide);
  EXPECT_EQ(comparison.verdict, Verdict::kNotRun);
  EXPECT_NE(comparison.reason.find("every stiffness and compliance limit is so wide"),
            std::string::npos)
      << comparison.reason;
}

// What two that agree were given and the third was not leaves open which is wrong.
TEST(StiffnessComparison, ASharedParameterLeavesOpenWhoIsWrong) {
  std::vector<StiffnessWitness> witnesses = MakeWitnesses();
  witnesses[0].result.K(3, 3) *= 1.03;
  const Attribution attribution =
      test::CompareAll(witnesses, {}, {{"reference", {{"E", 2e11}}}, {"simulated", {{"E", 2e11}}}})
          .attribution;
  EXPECT_EQ(attribution.odd_one_out, "");
  EXPECT_NE(attribution.text.find("E = 2e+11"), std::string::npos) << attribution.text;
}

}  // namespace
}  // namespace mbv
