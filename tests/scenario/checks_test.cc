#include "scenario/checks.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "mechanism/reach.h"
#include "scenario/load_scenario.h"
#include "scenario/section_readers.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

TEST(Checks, EveryMetricHasItsOwnKeyAndThreeDefaults) {
  std::set<std::string> keys, names;
  const auto note = [&](const MetricRow& row) {
    keys.insert(row.key);
    names.insert(row.json);
    EXPECT_EQ(&RowOf(row.metric), &row);
  };
  for (const MetricRow& row : StiffnessMetricRows()) {
    note(row);
    EXPECT_TRUE(IsOfStiffness(row.metric));
    EXPECT_EQ(FindMetric(row.key, StiffnessMetricRows()), &row);
  }
  for (const MetricRow& row : MetricRows()) {
    note(row);
    EXPECT_FALSE(IsOfStiffness(row.metric));
    EXPECT_EQ(FindMetric(row.key), &row);
    for (const LimitColumn column :
         {LimitColumn::kForward, LimitColumn::kInverse, LimitColumn::kReference}) {
      // Which margin motors need, the scenario says.
      if (row.metric == Metric::kMotorUse) {
        EXPECT_FALSE(row.limits.Of(column));
        continue;
      }
      ASSERT_TRUE(row.limits.Of(column));
      EXPECT_GT(*row.limits.Of(column), 0.0);
    }
  }
  EXPECT_EQ(keys.size(), static_cast<size_t>(kMetrics));
  EXPECT_EQ(names.size(), static_cast<size_t>(kMetrics));
  EXPECT_EQ(FindMetric("nothing"), nullptr);
}

// A four-bar linkage `scale` times as large, `away` [m] from the origin.
Mechanism FourBar(double scale, double away) {
  const ScenarioResult loaded = LoadScenario(SourcePath("/scenarios/four_bar/turn.yaml"));
  EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  Mechanism m = *loaded.mechanism;
  for (Joint& joint : m.joints) {
    for (Pose* X : {&joint.X_PF, &joint.X_CM}) X->translation() *= scale;
    if (joint.parent == 0) joint.X_PF.translation().x() += away;
  }
  for (size_t b = 1; b < m.X_WB_home.size(); ++b) {
    m.X_WB_home[b].translation() *= scale;
    m.X_WB_home[b].translation().x() += away;
  }
  return m;
}

TEST(Checks, DefaultLimitsOfLengthsAreInProportionToTheMechanism) {
  const CheckLimits own = DefaultLimits(FourBar(1.0, 0.0));
  const double length_m = CharacteristicLength(FourBar(1.0, 0.0));
  for (const double scale : {1e-3, 1.0, 1e3}) {
    const CheckLimits scaled = DefaultLimits(FourBar(scale, 0.0));
    for (const MetricRow& row : MetricRows()) {
      if (!row.limits.forward) continue;
      const double factor = std::string(row.unit) == "m" ? scale : 1.0;
      for (const LimitColumn column :
           {LimitColumn::kForward, LimitColumn::kInverse, LimitColumn::kReference}) {
        EXPECT_DOUBLE_EQ(*scaled[row.metric].Of(column), factor * *own[row.metric].Of(column));
      }
    }
  }
  EXPECT_NEAR(*own[Metric::kClosureM].forward, 1e-8 * length_m, 1e-13);
}

TEST(Checks, NoLimitOfALengthIsBelowTheRoundingOfFarPlaces) {
  const CheckLimits near = DefaultLimits(FourBar(1e-3, 0.0));
  const CheckLimits far = DefaultLimits(FourBar(1e-3, 1e4));
  EXPECT_LT(*near[Metric::kClosureM].inverse, 1e-13);
  EXPECT_GT(*far[Metric::kClosureM].inverse, 1e4 * kEps);
  EXPECT_EQ(*far[Metric::kClosureRad].inverse, *near[Metric::kClosureRad].inverse);
}

}  // namespace
}  // namespace mbv
