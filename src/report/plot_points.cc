#include "report/plot_points.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

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

// Names in the order in which they come, and the pairs' numbers: drive forces, or where none is
// compared (free motion) the outputs' positions.
class PairMatrix {
 public:
  explicit PairMatrix(const Comparison& comparison) : comparison_(comparison) {
    for (const PairComparison& pair : comparison.pairs) {
      if (!pair.compared) continue;
      for (const std::string& name : {pair.measured, pair.truth}) {
        if (std::ranges::find(names_, name) == names_.end()) names_.push_back(name);
      }
      if (pair.metrics.contains(Metric::kForceNrmse)) metric_ = Metric::kForceNrmse;
    }
  }

  [[nodiscard]] bool wanted() const { return names_.size() > kFewWitnesses; }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  [[nodiscard]] std::string Title() const {
    const MetricRow& row = RowOf(metric_);
    return std::string(row.title) + (*row.unit == '\0' ? "" : fmt::format(" [{}]", row.unit)) +
           " (* a check of the pair exceeds its limit)";
  }

  // "1.7e-10", with a star where a check of the pair failed; "" on the diagonal.
  [[nodiscard]] std::string CellText(const std::string& a, const std::string& b) const {
    if (a == b) return "";
    const PairComparison* pair = FindEitherWay(comparison_, a, b);
    if (pair == nullptr || !pair->compared) return "–";
    const std::string number = NumberOrDash(ValueOf(pair->metrics, metric_), "{:.1e}");
    return number + (Fails(pair->name()) ? "*" : "");
  }

 private:
  [[nodiscard]] bool Fails(const std::string& pair) const {
    return std::ranges::any_of(comparison_.checks, [&](const CheckResult& check) {
      return check.subject == pair && check.limit && !check.pass;
    });
  }

  const Comparison& comparison_;
  Metric metric_ = Metric::kPoseM;
  std::vector<std::string> names_;
};

}  // namespace

Table PairMatrixTable(const Comparison& comparison) {
  const PairMatrix matrix(comparison);
  if (!matrix.wanted()) return {};
  Table table{.caption = "Every pair: " + matrix.Title(), .head = {Text("")}, .rows = {}};
  for (const std::string& name : matrix.names()) {
    table.head.push_back(Digits(name));
    std::vector<Cell>& row = table.rows.emplace_back();
    row.push_back(Text(name));
    for (const std::string& other : matrix.names()) {
      row.push_back(Digits(matrix.CellText(name, other)));
    }
  }
  return table;
}

}  // namespace mbv
