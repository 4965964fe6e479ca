#include "report/plot_points.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <map>

#include "comparison/metrics.h"
#include "comparison/verdict.h"
#include "report/page.h"

namespace mbv {

PlotPoints Thinned(const PlotPoints& points, size_t bins) {
  if (points.size() <= 2 * bins) return points;
  PlotPoints kept;
  const size_t bin = (points.size() + bins - 1) / bins;
  for (size_t from = 0; from < points.size(); from += bin) {
    const auto first = points.begin() + static_cast<std::ptrdiff_t>(from);
    const auto last =
        points.begin() + static_cast<std::ptrdiff_t>(std::min(from + bin, points.size()));
    const auto lower = [](const auto& a, const auto& b) { return a.second < b.second; };
    auto [low, high] = std::minmax_element(first, last, lower);
    if (high < low) std::swap(low, high);
    kept.push_back(*low);
    if (high != low) kept.push_back(*high);
  }
  return kept;
}

PlotPoints ValuesOf(const Trace& trace, const ForceSignal& signal) {
  PlotPoints points;
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    points.emplace_back(trace.time_s[i], signal.At(static_cast<Eigen::Index>(i)).middle);
  }
  return points;
}

PlotPoints StrokesOf(const Trace& trace, const ForceSignal& force) {
  PlotPoints points;
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    const ForceBand at = force.At(static_cast<Eigen::Index>(i));
    if (!at.open()) continue;
    for (const double end : {at.lower(), at.upper(), kNan}) {
      points.emplace_back(trace.time_s[i], end);
    }
  }
  return points;
}

PlotPoints DifferencesOf(const Trace& measured, int column, const Trace& truth, int truth_column) {
  PlotPoints points;
  for (const auto& [i, j] : AlignSamples(measured, truth)) {
    points.emplace_back(measured.time_s[static_cast<size_t>(i)],
                        std::abs(measured.values(i, column) - truth.values(j, truth_column)));
  }
  return points;
}

std::vector<SharedAxis> ByUnit(const Trace& trace, Quantity quantity,
                               const std::vector<std::string>& subjects) {
  std::map<std::string, SharedAxis> axes;
  for (const std::string& subject : subjects) {
    const int column = trace.Find(quantity, subject);
    if (column < 0) continue;
    const std::string& unit = trace.channels[static_cast<size_t>(column)].unit;
    axes[unit].unit = unit;
    axes[unit].subjects.push_back(subject);
  }
  std::vector<SharedAxis> sorted;
  sorted.reserve(axes.size());
  for (auto& [unit, axis] : axes) sorted.push_back(std::move(axis));
  return sorted;
}

namespace {

constexpr size_t kFewWitnesses = 3;

// "1.7e-10", with a star where a check of the pair failed.
std::string PairCell(const Comparison& comparison, Metric metric, const std::string& a,
                     const std::string& b) {
  if (a == b) return "";
  const PairComparison* pair = FindEitherWay(comparison, a, b);
  if (pair == nullptr || !pair->compared) return "–";
  const bool fails = std::ranges::any_of(comparison.checks, [&](const CheckResult& check) {
    return check.subject == pair->name() && check.limit && !check.pass;
  });
  return NumberOrDash(ValueOf(pair->metrics, metric), "{:.1e}") + (fails ? "*" : "");
}

}  // namespace

Table PairMatrix(const Comparison& comparison) {
  std::vector<std::string> names;  // in the order in which they come
  Metric metric = Metric::kPoseM;
  for (const PairComparison& pair : comparison.pairs) {
    if (!pair.compared) continue;
    for (const std::string& name : {pair.measured, pair.truth}) {
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
    }
    if (pair.metrics.contains(Metric::kForceNrmse)) metric = Metric::kForceNrmse;
  }
  if (names.size() <= kFewWitnesses) return {};
  const MetricRow& row = RowOf(metric);
  Table table{
      .caption = fmt::format("every pair: {}{} (* a check of the pair exceeds its limit)",
                             row.title, *row.unit == '\0' ? "" : fmt::format(" [{}]", row.unit)),
      .columns = {Text("")}};
  for (const std::string& name : names) {
    table.columns.push_back(Digits(name));
    std::vector<Cell>& cells = table.rows.emplace_back();
    cells.emplace_back(name);
    for (const std::string& other : names) {
      cells.emplace_back(PairCell(comparison, metric, name, other));
    }
  }
  return table;
}

}  // namespace mbv
