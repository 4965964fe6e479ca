#include "features/paper/figures.h"

#include <gmock/gmock.h>

#include "tests/support/read_back.h"

namespace mbv {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> NamesOf(const FigureSet& set) {
  std::vector<std::string> names;
  for (const Figure& figure : set.figures) names.push_back(figure.name);
  return names;
}

const Figure& Named(const FigureSet& set, const std::string& name) {
  for (const Figure& figure : set.figures) {
    if (figure.name == name) return figure;
  }
  ADD_FAILURE() << name;
  return set.figures.front();
}

TEST(DefaultFigures, AreTheUsualOnesOfAMotion) {
  const FigureSet set = DefaultFigures(test::SampledReport(), Language::kEnglish);
  EXPECT_THAT(NamesOf(set), ElementsAre("drive_forces", "drive_strokes", "reactions",
                                        "power_energy", "force_speed"));
  EXPECT_EQ(Named(set, "drive_forces").panels[0].y.label, "Drive force *F* (N)");
  EXPECT_EQ(Named(set, "drive_strokes").panels[0].x.label, "Time *t* (s)");
}

TEST(DefaultFigures, LinesHaveEverySampleOfTheTrace) {
  const synthetic::Case c;
  const FigureSet set = DefaultFigures(test::SampledReport(c), Language::kEnglish);
  const FigureCurve& d1 = Named(set, "drive_forces").panels[0].curves[0];
  EXPECT_EQ(d1.label, "d1");
  ASSERT_EQ(d1.points.size(), c.analytic.time_s.size());
  const int column = c.analytic.Find("d1.force");
  for (size_t i = 0; i < d1.points.size(); ++i) {
    EXPECT_EQ(d1.points[i].first, c.analytic.time_s[i]);
    EXPECT_EQ(d1.points[i].second, c.analytic.values(static_cast<Eigen::Index>(i), column));
  }
}

TEST(DefaultFigures, DrivesWithASymbolAreCalledByIt) {
  Report report = test::SampledReport();
  report.symbols = {"_{1}′", ""};
  const FigureSet set = DefaultFigures(report, Language::kEnglish);
  const auto label = [&](const char* figure) {
    return Named(set, figure).panels[0].curves[0].label;
  };
  EXPECT_EQ(label("drive_forces"), "*F*_{1}′");
  EXPECT_EQ(label("drive_strokes"), "*q*_{1}′");
  EXPECT_EQ(label("power_energy"), "*P*_{1}′");
  EXPECT_EQ(label("force_speed"), "*F*_{1}′");
  EXPECT_EQ(Named(set, "force_speed").panels[0].curves[1].label, "d2");
}

TEST(DefaultFigures, OnePerturbedSampleShowsInTheDifferences) {
  synthetic::Case c;
  c.simulated.values(40, c.simulated.Find("d2.force")) += 0.25;
  const FigureSet set = DefaultFigures(test::SampledReport(c), Language::kEnglish);
  const Figure& forces = Named(set, "drive_forces");
  ASSERT_EQ(forces.panels.size(), 2u);
  std::vector<std::string> pairs;
  for (const FigureCurve& curve : forces.panels[1].curves) {
    pairs.push_back(curve.label);
    if (curve.label == "limit") continue;
    double largest = 0;
    for (const auto& [t, difference] : curve.points) {
      if (difference > largest) {
        largest = difference;
        EXPECT_DOUBLE_EQ(t, 0.4);
      }
    }
    EXPECT_NEAR(largest, 0.25, 1e-13);
  }
  EXPECT_THAT(pairs, ElementsAre("simulation − analytic", "simulation − reference", "limit"));
}

// Both differ from the simulation by the same: the third curve does not hide the first.
TEST(DefaultFigures, TheThirdDifferenceIsMarkers) {
  synthetic::Case c;
  c.simulated.values.col(c.simulated.Find("d2.force")).array() += 1e-3;
  c.reference.values.col(c.reference.Find("d2.force")).array() += 1e-12;
  const FigureSet set = DefaultFigures(test::SampledReport(c), Language::kEnglish);
  const std::vector<FigureCurve>& curves = Named(set, "drive_forces").panels[1].curves;
  ASSERT_GE(curves.size(), 3U);
  EXPECT_TRUE(curves[0].line && curves[1].line && !curves[2].line);
  EXPECT_GE(curves[2].marker, 0);
  EXPECT_GT(curves[2].points.size(), 5U);
  EXPECT_LT(4 * curves[2].points.size(), curves[0].points.size());
  for (const auto& [t, difference] : curves[2].points) EXPECT_NEAR(difference, 1e-3, 1e-8);
}

// 0.25 N of the largest force, and a limit of a thousandth of that.
TEST(DefaultFigures, TheLimitIsALineAmongTheDifferences) {
  synthetic::Case c;
  c.simulated.values(40, c.simulated.Find("d2.force")) += 0.25;
  Report report = test::SampledReport(c);
  double share = 0.0, limit = 0.0;
  for (PairComparison& pair : report.comparison.pairs) {
    if (pair.measured == "simulated" && pair.truth == "analytic") {
      share = pair.metrics.at(Metric::kForceMax).value;
    }
  }
  for (const CheckResult& check : report.comparison.checks) {
    if (check.name == "simulated_vs_analytic.force_max") limit = *check.limit;
  }
  ASSERT_GT(share, 0.0);
  ASSERT_GT(limit, 0.0);
  const FigureSet set = DefaultFigures(report, Language::kGerman);
  const FigureCurve& line = Named(set, "drive_forces").panels[1].curves.back();
  EXPECT_EQ(line.label, "Grenze");
  ASSERT_EQ(line.points.size(), 2U);
  EXPECT_NEAR(line.points[0].second, limit / share * 0.25, 1e-12);
  EXPECT_EQ(line.points[0].second, line.points[1].second);
}

TEST(DefaultFigures, WithoutDifferencesTheyAreLeftOutAndThisIsReported) {
  const FigureSet set = DefaultFigures(test::SampledReport(), Language::kEnglish);
  EXPECT_EQ(Named(set, "drive_forces").panels.size(), 1u);
  EXPECT_THAT(set.left_out, testing::Contains(HasSubstr("no difference to show")));
}

TEST(DefaultFigures, PowerIsForceTimesSpeed) {
  const synthetic::Case c;
  const FigureSet set = DefaultFigures(test::SampledReport(c), Language::kEnglish);
  const FigurePanel& power = Named(set, "power_energy").panels[0];
  const Trace& trace = c.analytic;
  double sum = 0;
  for (size_t d = 0; d < 2; ++d) {
    const std::string drive = d == 0 ? "d1" : "d2";
    const double watt = trace.values(7, trace.Find(drive + ".force")) *
                        trace.values(7, trace.Find(drive + ".velocity"));
    EXPECT_DOUBLE_EQ(power.curves[d].points[7].second, watt);
    sum += watt;
  }
  EXPECT_DOUBLE_EQ(power.curves[2].points[7].second, sum);
}

TEST(DefaultFigures, ReactionsThatStaticsLeavesOpenAreLeftOut) {
  Report report = test::SampledReport();
  report.reactions_not_unique = {"slide1.reaction.fx"};
  const FigureSet set = DefaultFigures(report, Language::kEnglish);
  EXPECT_THAT(NamesOf(set), testing::Not(testing::Contains("reactions")));
  EXPECT_THAT(set.left_out, testing::Contains("reactions: 1 joints that statics leaves open"));
}

TEST(DefaultFigures, SpeakChineseAndGerman) {
  const Report report = test::SampledReport();
  EXPECT_EQ(Named(DefaultFigures(report, Language::kChinese), "drive_forces").panels[0].y.label,
            "驱动力 *F* (N)");
  EXPECT_EQ(Named(DefaultFigures(report, Language::kGerman), "drive_forces").panels[0].x.label,
            "Zeit *t* (s)");
}

TEST(DefaultFigures, OfARunWithoutWitnessesAreNone) {
  Report report = test::SampledReport();
  report.witnesses.clear();
  const FigureSet set = DefaultFigures(report, Language::kEnglish);
  EXPECT_TRUE(set.figures.empty());
  EXPECT_EQ(set.left_out.size(), 1u);
}

TEST(FromPlot, LabelsTakeTheUnitsOfPapers) {
  EXPECT_EQ(FigureLabel("x [mm]"), "*x* (mm)");
  EXPECT_EQ(FigureLabel("yaw [deg]"), "yaw (°)");
  EXPECT_EQ(FigureLabel("k_rotation_min [N m/rad]"), "*k*_{rotation,min} (N·m/rad)");
  EXPECT_EQ(FigureLabel("kappa_f [mixed]"), "*κ*_{f}");
}

}  // namespace
}  // namespace mbv
