#include "scenario/checks.h"

#include <gtest/gtest.h>

#include <set>

namespace mbv {
namespace {

TEST(Checks, EveryMetricHasItsOwnKeyAndThreeDefaults) {
  std::set<std::string> keys, names;
  for (const MetricRow& row : MetricRows()) {
    keys.insert(row.key);
    names.insert(row.json);
    EXPECT_EQ(FindMetric(row.key), &row);
    EXPECT_EQ(&RowOf(row.metric), &row);
    for (const LimitColumn column :
         {LimitColumn::kForward, LimitColumn::kInverse, LimitColumn::kReference}) {
      ASSERT_TRUE(row.limits.Of(column));
      EXPECT_GT(*row.limits.Of(column), 0.0);
    }
  }
  EXPECT_EQ(keys.size(), static_cast<size_t>(kMetrics));
  EXPECT_EQ(names.size(), static_cast<size_t>(kMetrics));
  EXPECT_EQ(FindMetric("nothing"), nullptr);
}

}  // namespace
}  // namespace mbv
