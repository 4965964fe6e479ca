// Judging against a table: rounding and noise pass, the smallest perturbation that they do not
// explain fails, and a table that is wrong as a whole is reported what it looks like.
#include "comparison/table_tube.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "scenario/tables/table.h"
#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

constexpr double kOmega = 2.0 * std::numbers::pi;

// The two sliders without a closed form: solver and simulation agree exactly, the table has the
// place of the reference. d1.force = 100 sin, d2.force = 40 cos.
struct TableCase {
  synthetic::Case base;
  Trace solver = synthetic::ExactTrace("solver");
  ReferenceTable table;
  AlignedTable aligned;

  TableCase() {
    table.name = "forces.csv";
    for (int i = 0; i <= 100; ++i) table.time_s.push_back(0.01 * i);
    table.uniform = true;
    table.spacing_s = 0.01;
    AddColumn("d1.force", [](double t) { return 100.0 * std::sin(kOmega * t); });
    AddColumn("d2.force", [](double t) { return 40.0 * std::cos(kOmega * t); });
  }

  void AddColumn(const std::string& signal, const std::function<double(double)>& f) {
    const Eigen::Index c = table.values.cols();
    table.values.conservativeResize(101, c + 1);
    for (int i = 0; i <= 100; ++i) table.values(i, c) = f(0.01 * i);
    TableColumn column;
    column.channel = solver.channels.at(static_cast<size_t>(solver.Find(signal)));
    column.heading = signal;
    column.unit = "N";
    table.columns.push_back(column);
  }

  // Printed with this many decimals.
  void Print(double unit) {
    table.values = (table.values / unit).array().round().matrix() * unit;
    table.steps = MatX::Constant(table.values.rows(), table.values.cols(), unit);
  }

  Comparison Run() {
    const std::vector<double> noise = EstimateNoise(table.time_s, table.values);
    for (size_t c = 0; c < noise.size(); ++c) table.columns[c].noise = noise[c];
    aligned = AlignTable(table, base.motion);
    const ComparisonInput input{.mechanism = &base.mechanism,
                                .motion = &base.motion,
                                .limits = base.limits,
                                .simulation_limits = LimitColumn::kInverse,
                                .start_window_s = base.start_window_s,
                                .witnesses = {{"analytic", nullptr, {}},
                                              {"reference", &aligned.trace, RunSummary::Done()},
                                              {"solver", &solver, RunSummary::Done()},
                                              {"simulated", &base.simulated, RunSummary::Done()}},
                                .driven_by = "solver",
                                .reactions_not_unique = {},
                                .table = &aligned};
    return Compare(input);
  }
};

bool Says(const Comparison& comparison, const std::string& text) {
  for (const std::string& diagnosis : comparison.table->diagnoses) {
    if (diagnosis.find(text) != std::string::npos) return true;
  }
  return false;
}

bool Reserves(const Comparison& comparison, const std::string& text) {
  for (const Caveat& caveat : comparison.caveats) {
    if (caveat.text.find(text) != std::string::npos) return true;
  }
  return false;
}

std::string All(const Comparison& comparison) {
  std::string text = comparison.reason + "\n" + comparison.attribution.text;
  for (const std::string& diagnosis : comparison.table->diagnoses) text += "\n" + diagnosis;
  return text;
}

TEST(TableTube, RoundingToAnyNumberOfDigitsPasses) {
  for (const double unit : {1.0, 0.1, 1e-3, 1e-6, 1e-9}) {
    TableCase c;
    c.Print(unit);
    const Comparison comparison = c.Run();
    EXPECT_EQ(comparison.verdict, Verdict::kAgree) << unit << "\n" << All(comparison);
    const PairComparison* pair = comparison.FindPair("reference_vs_solver");
    ASSERT_NE(pair, nullptr);
    ASSERT_EQ(pair->columns.size(), 2u);
    for (const TableColumnResult& column : pair->columns) {
      EXPECT_TRUE(column.inside()) << unit << " " << column.channel << " " << column.ratio();
      // Uniform rounding is unit / sqrt(12). A sine over its period repeats each rounding four
      // times and so leaves some 25 independent rows to report noise from: the estimate may be 2.5
      // times it.
      const double ratio = column.standard / (unit / std::sqrt(12.0));
      EXPECT_GE(ratio, 1.0 - 1e-9) << unit;
      EXPECT_LE(ratio, 2.5) << unit;
    }
  }
}

TEST(TableTube, AColumnThatIsPerturbedByThreeTimesItsRoundingFails) {
  for (const double unit : {0.1, 1e-3, 1e-6}) {
    TableCase c;
    c.Print(unit);
    // RMS tube: 2 · unit/√12 = 0.58 unit. A sine of amplitude 1.5 unit has an RMS of 1.06 unit.
    for (int i = 0; i <= 100; ++i) c.table.values(i, 1) += 1.5 * unit * std::sin(kOmega * 0.01 * i);
    const Comparison comparison = c.Run();
    EXPECT_EQ(comparison.verdict, Verdict::kDisagree) << unit;
    const CheckResult* check = comparison.FindCheck("reference_vs_solver.table_tube");
    ASSERT_NE(check, nullptr);
    EXPECT_FALSE(check->pass);
    EXPECT_EQ(check->channel, "d2.force");
    EXPECT_EQ(comparison.attribution.odd_one_out, "reference") << All(comparison);
  }
}

TEST(TableTube, OneRowThatIsOffFailsAndIsNamed) {
  TableCase c;
  c.Print(1e-3);
  c.table.values(30, 0) += 3e-3;  // bound: 2 · (unit/2 + 2.5 · what noise is found)
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
  EXPECT_TRUE(Says(comparison, "1 of 101 rows only, at t = 0.3 s")) << All(comparison);
}

TEST(TableTube, TwoRowsOfAHundredAreMoreThanOutliers) {
  TableCase c;
  c.Print(1e-3);
  c.table.values(30, 0) += 1.0;
  c.table.values(40, 0) -= 2.0;
  EXPECT_FALSE(Says(c.Run(), "rows only"));
}

TEST(TableTube, NoisePassesAndASmoothErrorOfTwiceTheNoiseFails) {
  for (const bool perturbed : {false, true}) {
    TableCase c;
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal(0.0, 0.2);
    for (Eigen::Index i = 0; i < c.table.values.size(); ++i) {
      c.table.values.data()[i] += normal(random);
    }
    c.Print(1e-6);
    // Tube 2 · 0.2; a sine of amplitude 0.8 has an RMS of 0.57, with the noise 0.6.
    if (perturbed) {
      for (int i = 0; i <= 100; ++i) c.table.values(i, 0) += 0.8 * std::cos(kOmega * 0.01 * i);
    }
    const Comparison comparison = c.Run();
    EXPECT_EQ(comparison.verdict, perturbed ? Verdict::kDisagree : Verdict::kAgree)
        << All(comparison);
    EXPECT_NEAR(comparison.table->uncertainty[0].noise, 0.2, 0.06);
  }
}

TEST(TableTube, ACoarseColumnDoesNotHideAFineOne) {
  // d1 to 1 N, d2 to 1 mN and perturbed by 10 mN: pooled, the 10 mN drown in d1's rounding.
  TableCase c;
  c.Print(1.0);
  for (int i = 0; i <= 100; ++i) {
    c.table.values(i, 1) = std::round(40.0 * std::cos(kOmega * 0.01 * i) / 1e-3) * 1e-3 +
                           0.01 * std::sin(kOmega * 0.01 * i);
    c.table.steps(i, 1) = 1e-3;
  }
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
  EXPECT_TRUE(comparison.FindCheck("reference_vs_solver.force_nrmse")->pass);
  EXPECT_FALSE(comparison.FindCheck("reference_vs_solver.table_tube")->pass);
}

TEST(TableTube, AStatedLimitThatIsWiderThanTheTubeCounts) {
  TableCase c;
  c.Print(1e-6);
  for (int i = 0; i <= 100; ++i) c.table.values(i, 0) *= 1.0 + 1e-4;
  EXPECT_EQ(c.Run().verdict, Verdict::kDisagree);
  for (const Metric metric : {Metric::kForceNrmse, Metric::kForceMax, Metric::kForceOwn}) {
    c.base.limits[metric].reference = c.base.limits[metric].inverse = 1e-3;
  }
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree);
}

TEST(TableTube, ALimitWidenedByTheTableKeepsTheStatedOneBesideIt) {
  TableCase c;
  c.Print(0.1);
  const Comparison comparison = c.Run();
  const CheckResult* check = comparison.FindCheck("reference_vs_solver.force_nrmse");
  ASSERT_NE(check, nullptr);
  ASSERT_TRUE(check->stated_limit);
  EXPECT_EQ(*check->stated_limit, 1e-10);
  // 2 · 0.1/√12 over the pooled RMS √((100² + 40²)/4) = 53.9 N; the noise estimate adds a little.
  EXPECT_NEAR(*check->limit, 2.0 * 0.1 / std::sqrt(12.0) / 53.9, 0.5e-3);
  EXPECT_FALSE(comparison.FindCheck("simulated_vs_solver.force_nrmse")->stated_limit);
}

TEST(TableTube, ATableTooCoarseVerifiesNothing) {
  TableCase c;
  c.Print(20.0);
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kNotRun);
  EXPECT_NE(comparison.reason.find("too coarse to verify anything"), std::string::npos)
      << comparison.reason;
}

TEST(TableTube, AStatedToleranceWiderThanTheCoarsestVerifiesNothing) {
  TableCase c;
  c.Print(1e-6);
  for (TableColumn& column : c.table.columns) column.tolerance = {.relative = 0.5};
  c.table.values *= 1.3;
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kNotRun) << All(comparison);
  EXPECT_NE(comparison.reason.find("stated uncertainty"), std::string::npos) << comparison.reason;
  for (TableColumn& column : c.table.columns) column.tolerance = {.relative = 0.01};
  EXPECT_EQ(c.Run().verdict, Verdict::kDisagree);
  c.table.values /= 1.3;
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree);
}

TEST(TableTube, OneColumnWithAWideToleranceIsACaveat) {
  TableCase c;
  c.Print(1e-6);
  c.table.columns[1].tolerance = {.relative = 0.12};  // of 40 N, beside 100 N
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kAgree) << All(comparison);
  EXPECT_TRUE(Reserves(comparison, "more than 10 % of the column verifies nothing: d2.force"));
}

TEST(TableTube, ATableOfHalfTheMotionSaysSo) {
  TableCase c;
  c.Print(1e-6);
  EXPECT_TRUE(c.Run().caveats.empty());
  c.table.time_s.resize(51);
  c.table.values = c.table.values.topRows(51).eval();
  c.table.steps = c.table.steps.topRows(51).eval();
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kAgree) << All(comparison);
  EXPECT_TRUE(Reserves(comparison, "it covers 0 to 0.5 s only, of a motion of 1 s"));
}

TEST(TableTube, ATableWithoutForcesSaysSo) {
  TableCase c;
  c.table.columns.clear();
  c.table.values.resize(0, 0);
  for (const char* drive : {"d1", "d2"}) {
    const std::string signal = std::string(drive) + ".position";
    const VecX exact = c.solver.values.col(c.solver.Find(signal));
    c.AddColumn(signal, [&](double t) { return exact[std::lround(t / 0.01)]; });
    c.table.columns.back().channel.unit = c.table.columns.back().unit = "m";
  }
  c.Print(1e-9);
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kAgree) << All(comparison);
  EXPECT_TRUE(Reserves(comparison, "it has no column of forces"));
}

TEST(TableTube, ATableWithoutANumberNeverAgrees) {
  TableCase c;
  c.Print(1e-3);
  c.table.values(50, 0) = kNan;
  EXPECT_NE(c.Run().verdict, Verdict::kAgree);
}

// What a wrong table looks like.

TEST(TableDiagnosis, AGoodTableHasNone) {
  TableCase c;
  c.Print(1e-4);
  EXPECT_TRUE(c.Run().table->diagnoses.empty());
}

TEST(TableDiagnosis, AWrongSignIsNamedWithItsCure) {
  TableCase c;
  c.table.values.col(1) *= -1.0;
  c.Print(1e-4);
  const Comparison comparison = c.Run();
  EXPECT_TRUE(Says(comparison, "d2.force: sign? (d2.force: {sign: -1}")) << All(comparison);
}

TEST(TableDiagnosis, AWrongUnitIsNamedByItsFactor) {
  const std::pair<double, const char*> factors[] = {{1e3, "factor of 1000"},
                                                    {1e-3, "factor of 1/1000"},
                                                    {9.80665, "N taken for kgf"},
                                                    {4.4482216, "N taken for lbf"},
                                                    {180.0 / std::numbers::pi, "degrees"}};
  for (const auto& [factor, text] : factors) {
    TableCase c;
    c.table.values.col(0) *= factor;
    c.Print(1e-6 * std::min(1.0, factor));
    const Comparison comparison = c.Run();
    EXPECT_TRUE(Says(comparison, text)) << factor << "\n" << All(comparison);
  }
}

TEST(TableDiagnosis, AnUnknownConstantFactorIsGivenAsANumber) {
  TableCase c;
  c.table.values.col(0) *= 1.37;
  c.Print(1e-4);
  EXPECT_TRUE(Says(c.Run(), "1.37 times d1.force"));
}

TEST(TableDiagnosis, ExchangedColumnsAreNamedOnce) {
  TableCase c;
  c.table.values.col(0).swap(c.table.values.col(1));
  c.Print(1e-4);
  const Comparison comparison = c.Run();
  EXPECT_TRUE(Says(comparison, "d1.force and d2.force look exchanged")) << All(comparison);
  EXPECT_EQ(comparison.table->diagnoses.size(), 1u);
}

TEST(TableDiagnosis, AnAddedConstantIsNamed) {
  TableCase c;
  c.table.values.col(1).array() += 12.5;
  c.Print(1e-4);
  EXPECT_TRUE(Says(c.Run(), "with 12.5 N added"));
}

TEST(TableDiagnosis, ADriftIsNamedWithItsRate) {
  TableCase c;
  for (int i = 0; i <= 100; ++i) c.table.values(i, 0) += 0.5 * (0.01 * i);
  c.Print(1e-4);
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
  EXPECT_TRUE(Says(comparison, "the difference grows by 0.5 N/s")) << All(comparison);
}

TEST(TableDiagnosis, AnErrorThatGrowsInSwingsIsReportedToGrow) {
  TableCase c;
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.01 * i;
    c.table.values(i, 0) += 0.2 * t * t * std::sin(7 * kOmega * t);
  }
  c.Print(1e-4);
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
  EXPECT_TRUE(Says(comparison, "errors of an integration")) << All(comparison);
}

TEST(TableDiagnosis, AShiftInTimeIsFoundBetweenSamplesWithItsDirection) {
  for (const double shift_s : {0.0234, -0.0166}) {
    TableCase c;
    for (int i = 0; i <= 100; ++i) {
      const double t = 0.01 * i - shift_s;  // the table's curve comes later by the shift
      c.table.values(i, 0) = 100.0 * std::sin(kOmega * t);
      c.table.values(i, 1) = 40.0 * std::cos(kOmega * t);
    }
    c.Print(1e-4);
    const Comparison comparison = c.Run();
    EXPECT_TRUE(Says(comparison, shift_s > 0 ? "shifted by 0.0234 s: it is late"
                                             : "shifted by 0.0166 s: it is early"))
        << All(comparison);
  }
}

// Half a per cent of a force that hardly varies: a factor or an added constant.
TEST(TableDiagnosis, WhatASignalThatHardlyVariesLeavesOpenIsReported) {
  const auto of = [](double swing, double factor) {
    TableCase c;
    for (int i = 0; i <= 100; ++i) {
      const double exact = 100.0 + swing * std::sin(kOmega * 0.01 * i);
      c.table.values(i, 0) = factor * exact;
      for (Trace* trace : {&c.solver, &c.base.simulated}) {
        trace->values(i, trace->Find("d1.force")) = exact;
      }
    }
    c.Print(1e-2);
    return c.Run();
  };
  const Comparison hardly = of(0.1, 1.005);
  EXPECT_TRUE(Says(hardly, "varies too little to distinguish them")) << All(hardly);
  EXPECT_FALSE(Says(hardly, "preload")) << All(hardly);
  const Comparison swings = of(60.0, 1.005);
  EXPECT_TRUE(Says(swings, "is 1.005 times d1.force: a mass")) << All(swings);
}

// A time shift would move the positions, too.
TEST(TableDiagnosis, ForcesThatComeLateBesideAPositionThatDoesNotAreNotShiftedInTime) {
  for (const bool position_too : {false, true}) {
    TableCase c;
    const double shift_s = 0.0234;
    for (int i = 0; i <= 100; ++i) {
      const double t = 0.01 * i - shift_s;
      c.table.values(i, 0) = 100.0 * std::sin(kOmega * t);
      c.table.values(i, 1) = 40.0 * std::cos(kOmega * t);
    }
    c.AddColumn("plate.x", [&](double t) { return 0.3 * (position_too ? t - shift_s : t); });
    c.table.columns.back().channel.unit = c.table.columns.back().unit = "m";
    c.Print(1e-5);
    const Comparison comparison = c.Run();
    EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
    EXPECT_EQ(Says(comparison, "shifted by 0.0234 s"), position_too) << All(comparison);
  }
}

// Where the table is right, what the difference looks like would have it repaired.
TEST(TableDiagnosis, ARightTableIsNotRepairedForAWrongSolver) {
  TableCase c;
  c.Print(1e-6);
  synthetic::Stretch(&c.solver, "d1.force", 1.37);
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
  EXPECT_EQ(comparison.attribution.odd_one_out, "solver") << All(comparison);
  EXPECT_TRUE(comparison.table->diagnoses.empty()) << All(comparison);
  EXPECT_EQ(comparison.attribution.text.find("times d1.force"), std::string::npos);
}

TEST(TableDiagnosis, OnlyATableFarFromTheCommandMayBelongToAnotherMotion) {
  for (const double factor : {1.01, 2.0}) {
    TableCase c;
    const VecX exact = c.solver.values.col(c.solver.Find("d1.position"));
    c.AddColumn("d1.position", [&](double t) { return factor * exact[std::lround(t / 0.01)]; });
    c.table.columns.back().channel.unit = c.table.columns.back().unit = "m";
    c.Print(1e-6);
    const Comparison comparison = c.Run();
    EXPECT_EQ(comparison.attribution.odd_one_out, "reference") << All(comparison);
    EXPECT_EQ(comparison.attribution.text.find("another motion?") != std::string::npos,
              factor == 2.0)
        << All(comparison);
  }
}

TEST(TableDiagnosis, ADifferenceThatNoneOfThemExplainsHasNoDiagnosis) {
  TableCase c;
  for (int i = 0; i <= 100; ++i) c.table.values(i, 0) += 10.0 * std::sin(3 * kOmega * 0.01 * i);
  c.Print(1e-4);
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
  EXPECT_TRUE(comparison.table->diagnoses.empty()) << All(comparison);
}

// A signal that no metric of the pair is about: solver and simulation are measured in it too, in
// its own unit, and stand against the table.
TEST(TableTube, TwoComputationsStandAgainstAColumnInItsOwnUnit) {
  TableCase c;
  c.AddColumn("plate.x", [](double t) { return 0.3 * t + 8e-4 * std::sin(kOmega * t); });
  c.table.columns.back().channel.unit = c.table.columns.back().unit = "m";
  c.Print(1e-9);
  synthetic::Perturb(&c.base.simulated, "plate.x", 1e-9);
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
  const std::string& text = comparison.attribution.text;
  EXPECT_EQ(comparison.attribution.odd_one_out, "reference") << text;
  EXPECT_NE(text.find("simulation and the generic solver agree to 1e-09 m, the table forces.csv "
                      "differs by 0.00056 m in plate.x, RMS"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("times its tolerance"), std::string::npos) << text;
  EXPECT_EQ(text.find('%'), std::string::npos) << text;
}

}  // namespace
}  // namespace mbv
