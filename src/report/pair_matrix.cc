#include "report/pair_matrix.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "comparison/metric_value.h"
#include "report/html_text.h"
#include "report/text_table.h"

namespace mbv {
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

std::vector<std::string> PairMatrixLines(const Comparison& comparison) {
  const PairMatrix matrix(comparison);
  if (!matrix.wanted()) return {};
  size_t width = 0;
  for (const std::string& name : matrix.names()) width = std::max(width, name.size());
  std::vector<TextColumn> columns = {{"", -static_cast<int>(width)}};
  for (const std::string& name : matrix.names()) {
    columns.push_back({name, static_cast<int>(std::max<size_t>(name.size(), 8) + 2)});
  }
  const TextTable table("", columns);
  std::vector<std::string> lines = {"every pair: " + matrix.Title(), table.Head()};
  for (const std::string& row : matrix.names()) {
    std::vector<std::string> cells = {row};
    for (const std::string& name : matrix.names()) cells.push_back(matrix.CellText(row, name));
    lines.push_back(table.Row(cells));
    lines.back().erase(lines.back().find_last_not_of(' ') + 1);
  }
  return lines;
}

std::string PairMatrixHtml(const Comparison& comparison) {
  const PairMatrix matrix(comparison);
  if (!matrix.wanted()) return "";
  Table table{.caption = "Every pair: " + matrix.Title(), .head = {Text("")}, .rows = {}};
  for (const std::string& name : matrix.names()) {
    table.head.push_back(Digits(name));
    std::vector<Cell>& row = table.rows.emplace_back();
    row.push_back(Text(name));
    for (const std::string& other : matrix.names()) {
      row.push_back(Digits(matrix.CellText(name, other)));
    }
  }
  return ToHtml(table);
}

}  // namespace mbv
