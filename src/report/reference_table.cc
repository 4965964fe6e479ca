#include "report/reference_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plot/svg_plot.h"
#include "report/page.h"
#include "report/plot_points.h"

namespace mbv {
namespace {

constexpr size_t kMostPlots = 8;  // columns, the worst first

std::string NumberOrOff(double value, const char* format = "{:.2e}") {
  if (std::isinf(value)) return "off";
  return std::isnan(value) ? "–" : fmt::format(fmt::runtime(format), value);
}

const TableColumn& SourceOf(const TableVerdict& table, const TableColumnResult& column) {
  return table.columns[column.column];
}

// Worst first; columns without a number count as worst.
std::vector<const TableColumnResult*> ByRatio(const PairComparison& pair) {
  std::vector<const TableColumnResult*> columns;
  for (const TableColumnResult& column : pair.columns) columns.push_back(&column);
  const auto key = [](const TableColumnResult* column) {
    const double ratio = column->ratio();
    return std::isnan(ratio) ? std::numeric_limits<double>::infinity() : ratio;
  };
  std::stable_sort(columns.begin(), columns.end(),
                   [&](const auto* a, const auto* b) { return key(a) > key(b); });
  return columns;
}

Table ColumnTable(const TableVerdict& table, const PairComparison& pair, bool verbose) {
  Table columns{.caption = fmt::format("Columns of {} against {}, worst first", table.name,
                                       table.judged_against),
                .columns = {Text("signal"), Text("column", On::kPage), Digits("RMS"),
                            Digits("uncertainty"), Text("of it", verbose ? On::kAll : On::kPage),
                            Digits("RMS difference"), Digits("tube"), Digits("largest difference"),
                            Digits("tube"), Digits("at", On::kPage), Text("")}};
  for (const TableColumnResult* column : ByRatio(pair)) {
    const TableColumn& source = SourceOf(table, *column);
    columns.rows.push_back(
        {column->channel, source.heading, NumberOrOff(column->rms, "{:.6g} ") + source.channel.unit,
         NumberOrOff(column->standard), UncertaintyText(table.uncertainty[column->column]),
         NumberOrOff(column->error_rms), NumberOrOff(column->tube_rms),
         NumberOrOff(column->error_max), NumberOrOff(column->tube_max),
         NumberOrOff(column->time_s, "{:.4g} s"),
         column->inside() ? Cell("inside", Mark::kOk)
         : table.judged   ? Cell("OUTSIDE", Mark::kFail)
                          : Cell("not judged", Mark::kOff)});
  }
  return columns;
}

// The table's values with their tube on the other witness' curve, and the difference in the tube.
void AddPlots(const Report& report, const PairComparison& pair, ReportSection* section) {
  const TableVerdict& table = *report.comparison.table;
  const Trace* values = TraceOf(report, role::kReference.name);
  const Trace* other = TraceOf(report, table.judged_against);
  if (values == nullptr || other == nullptr) return;
  const std::vector<const TableColumnResult*> columns = ByRatio(pair);
  for (size_t k = 0; k < std::min(kMostPlots, columns.size()); ++k) {
    const TableColumnResult& column = *columns[k];
    const int a = values->Find(column.channel), b = other->Find(column.channel);
    if (a < 0 || b < 0) continue;
    const std::string& unit = SourceOf(table, column).channel.unit;
    PlotPoints points, curve, upper, lower, difference;
    for (const auto& [i, j] : AlignSamples(*values, *other)) {
      const double t = values->time_s[static_cast<size_t>(i)];
      const double value = values->values(i, a);
      const double error = value - other->values(j, b);
      points.emplace_back(t, value);
      upper.emplace_back(t, value + column.tube_max);
      lower.emplace_back(t, value - column.tube_max);
      difference.emplace_back(t,
                              unit == "rad" ? AngleDifference(value, other->values(j, b)) : error);
    }
    for (size_t i = 0; i < other->time_s.size(); ++i) {
      curve.emplace_back(other->time_s[i], other->values(static_cast<Eigen::Index>(i), b));
    }
    if (difference.empty()) continue;
    const double from = difference.front().first, to = difference.back().first;
    LinePlot signal{
        .title = column.channel, .x_label = "time [s]", .y_label = "[" + unit + "]", .lines = {}};
    signal.lines = {{.label = table.judged_against, .points = Thinned(curve)},
                    {.label = table.name, .points = Thinned(points), .markers = true},
                    {.label = "tube", .points = Thinned(upper)},
                    {.label = "", .points = Thinned(lower)}};
    LinePlot error{
        .title = fmt::format("{}: {} − {}", column.channel, table.name, table.judged_against),
        .x_label = "time [s]",
        .y_label = "[" + unit + "]",
        .lines = {}};
    error.lines = {{.label = "difference", .points = Thinned(difference), .markers = true},
                   {.label = fmt::format("tube ±{:.2g}", column.tube_max),
                    .points = {{from, column.tube_max}, {to, column.tube_max}}},
                   {.label = "", .points = {{from, -column.tube_max}, {to, -column.tube_max}}}};
    section->Add(Drawing{ToSvg(signal)});
    section->Add(Drawing{ToSvg(error)});
  }
  if (columns.size() > kMostPlots) {
    section->Note(fmt::format("The {} worst of {} columns.", kMostPlots, columns.size()));
  }
}

}  // namespace

const PairComparison* TablePair(const Comparison& comparison) {
  if (!comparison.table || comparison.table->judged_against.empty()) return nullptr;
  for (const PairComparison& pair : comparison.pairs) {
    const std::string& other = pair.measured == role::kReference ? pair.truth : pair.measured;
    const bool of_table = pair.Involves(role::kReference);
    if (of_table && other == comparison.table->judged_against && !pair.columns.empty()) {
      return &pair;
    }
  }
  return nullptr;
}

std::string UncertaintyText(const TableUncertainty& uncertainty) {
  if (uncertainty.stated) return "stated in the scenario";
  std::string text;
  for (const auto& [name, value] :
       {std::pair{"digits", uncertainty.digits}, std::pair{"noise", uncertainty.noise},
        std::pair{"time stamps", uncertainty.stamps},
        std::pair{"interpolation", uncertainty.interpolation}}) {
    if (value > 0.0) text += fmt::format("{}{} {:.1e}", text.empty() ? "" : ", ", name, value);
  }
  return text;
}

ReportSection ReferenceTableSection(const Report& report, bool verbose) {
  ReportSection section{.title = "The table in the reference's place", .link = "Table"};
  if (!report.comparison.table) return section;
  const TableVerdict& table = *report.comparison.table;
  section.Add(Paragraph{fmt::format("the reference is the table {}: {}", table.name, table.grid)});
  section.Add(Paragraph{table.too_coarse, Paragraph::Look::kOdd}, On::kPage);
  for (const std::string& diagnosis : table.diagnoses) {
    section.Add(Paragraph{diagnosis, Paragraph::Look::kOdd}, On::kPage);
  }
  if (const PairComparison* pair = TablePair(report.comparison)) {
    section.Add(ColumnTable(table, *pair, verbose));
    section.Note(fmt::format("The tube is {:g} times the column's uncertainty or the scenario's "
                             "limit, whichever is wider.",
                             table.coverage),
                 On::kAll);
    AddPlots(report, *pair, &section);
  }
  Fold notes{"How the file was read", {}};
  if (!table.notes.empty()) notes.blocks.push_back({Items{table.notes}});
  section.Add(std::move(notes), verbose ? On::kAll : On::kPage);
  return section;
}

}  // namespace mbv
