// Tables and figures of a stiffness page.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/stiffness_measures.h"
#include "report/html_text.h"
#include "report/stiffness_report.h"
#include "report/svg_plot.h"

namespace mbv {
namespace {

Table MatrixTable(const std::string& caption, const Mat6& M, bool stiffness) {
  Table table{.caption = caption, .head = {Text("")}, .rows = {}};
  for (int j = 0; j < 6; ++j) {
    table.head.push_back(Digits(stiffness ? AxisName(j) : kWrenchNames[j]));
  }
  table.head.push_back(Text("units"));
  for (int i = 0; i < 6; ++i) {
    std::vector<Cell> row = {Text(stiffness ? kWrenchNames[i] : AxisName(i))};
    for (int j = 0; j < 6; ++j) row.push_back(Digits(fmt::format("{:.6g}", M(i, j))));
    const auto unit = stiffness ? &StiffnessUnit : &ComplianceUnit;
    row.push_back(Text(fmt::format("{} | {}", unit(i, 0), unit(i, 3))));
    table.rows.push_back(std::move(row));
  }
  return table;
}

// A cell of a difference: the darker the larger, 1e-12 white to 1 full.
std::string DifferenceCell(double value) {
  if (!std::isfinite(value)) return "–";
  const double shade =
      value == 0.0 ? 0.0 : std::clamp(0.55 * (std::log10(std::abs(value)) + 12) / 12, 0.0, 0.55);
  return fmt::format("<span style=\"display:block;background:rgba(213,94,0,{:.3f})\">{:.1e}</span>",
                     shade, value);
}

Table DifferenceTable(const std::string& caption, const Mat6& difference) {
  Table table{.caption = caption, .head = {Text("")}, .rows = {}};
  for (int j = 0; j < 6; ++j) table.head.push_back(Digits(AxisName(j)));
  for (int i = 0; i < 6; ++i) {
    std::vector<Cell> row = {Text(AxisName(i))};
    for (int j = 0; j < 6; ++j) {
      row.push_back({DifferenceCell(difference(i, j)), true, true});
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string PairHtml(const StiffnessPair& pair) {
  if (!pair.compared) return "";
  const std::string name = pair.measured + " − " + pair.truth;
  std::string html =
      ToHtml(DifferenceTable(name + ": ΔK_ij / √(K_ii K_jj), each entry", pair.K_difference));
  if (pair.C_difference.allFinite()) {
    html += ToHtml(DifferenceTable(name + ": ΔC_ij / √(C_ii C_jj)", pair.C_difference));
  }
  return html;
}

BarPlot BarsOf(const std::vector<Contribution>& rows) {
  BarPlot plot{.title = "Compliance caused by each element",
               .columns = {"against the weakest force", "against the weakest moment"},
               .rows = {}};
  for (const Contribution& row : rows) {
    plot.rows.push_back({row.element, {row.translation, row.rotation}});
  }
  return plot;
}

// As the paper's Fig. 17: theory and simulation per load, one figure per direction.
LinePlot LoadPlot(const StiffnessReport& report, const StiffnessPair& pair, int axis) {
  LinePlot plot{.title = fmt::format("Displacement along {}", AxisName(axis)),
                .x_label = "load",
                .y_label = fmt::format("{} [mm]", AxisName(axis)),
                .lines = {}};
  const auto add = [&](const StiffnessWitness& witness, bool markers) {
    PlotLine line{.label = witness.name, .points = {}, .markers = markers};
    for (size_t k = 0; k < witness.displacements.size(); ++k) {
      line.points.emplace_back(static_cast<double>(k + 1), 1e3 * witness.displacements[k][axis]);
    }
    plot.lines.push_back(std::move(line));
  };
  for (const StiffnessWitness& witness : report.witnesses) {
    if (witness.name == pair.measured) add(witness, true);
  }
  for (const StiffnessWitness& witness : report.witnesses) {
    if (witness.name == pair.truth) add(witness, false);
  }
  for (const StiffnessWitness& witness : report.printed) add(witness, false);
  return plot;
}

LinePlot ErrorPlot(const StiffnessReport& report, const StiffnessPair& pair) {
  LinePlot plot{.title = pair.measured + " against " + pair.truth + ": error per load",
                .x_label = "load",
                .y_label = "error, percent",
                .log_y = true,
                .lines = {}};
  const std::vector<Vec6>* sides[2] = {nullptr, nullptr};
  for (const StiffnessWitness& witness : report.witnesses) {
    if (witness.name == pair.measured) sides[0] = &witness.displacements;
    if (witness.name == pair.truth) sides[1] = &witness.displacements;
  }
  for (int axis = 3; axis < 6 && sides[0] != nullptr && sides[1] != nullptr; ++axis) {
    PlotLine line{.label = fmt::format("{}, of the axis' largest", AxisName(axis)), .points = {}};
    for (size_t k = 0; k < sides[0]->size(); ++k) {
      const double error = std::abs((*sides[0])[k][axis] - (*sides[1])[k][axis]);
      line.points.emplace_back(static_cast<double>(k + 1), 100 * error / pair.loads->scale[axis]);
    }
    plot.lines.push_back(std::move(line));
  }
  PlotLine vector{.label = "vector, of its length", .points = {}};
  for (size_t k = 0; k < pair.loads->vector.size(); ++k) {
    vector.points.emplace_back(static_cast<double>(k + 1), 100 * pair.loads->vector[k]);
  }
  plot.lines.push_back(std::move(vector));
  return plot;
}

void AddStatistics(const StiffnessPair& pair, Table* table) {
  if (!pair.loads) return;
  const LoadErrors& e = *pair.loads;
  for (const bool mean : {true, false}) {
    const Vec6& axis = mean ? e.mean : e.max;
    std::vector<Cell> row = {Text(pair.measured + " against " + pair.truth),
                             Text(mean ? "mean" : "largest")};
    for (int i : {3, 4, 5, 0, 1, 2}) row.push_back(Digits(fmt::format("{:.2e}", axis[i])));
    row.push_back(Digits(fmt::format("{:.2e}", mean ? e.vector_mean : e.vector_max)));
    table->rows.push_back(std::move(row));
  }
}

Table DisplacementTable(const StiffnessReport& report, const StiffnessPair& pair) {
  Table table{.caption = "Every load",
              .head = {Digits("load"), Digits("F [N]"), Digits("M [N m]")},
              .rows = {}};
  const std::vector<Vec6>* sides[2] = {nullptr, nullptr};
  for (const StiffnessWitness& witness : report.witnesses) {
    if (witness.name == pair.truth) sides[0] = &witness.displacements;
    if (witness.name == pair.measured) sides[1] = &witness.displacements;
  }
  for (const std::string& name : {pair.truth, pair.measured}) {
    table.head.push_back(Digits(name + " x, y, z [mm]"));
  }
  table.head.push_back(Digits("error of the vector"));
  const auto triple = [](const Vec3& v, const char* format) {
    return fmt::format(fmt::runtime(format), v.x(), v.y(), v.z());
  };
  for (size_t k = 0; k < report.loads.size(); ++k) {
    const Vec6& load = report.loads[k];
    std::vector<Cell> row = {Digits(std::to_string(k + 1)),
                             Digits(triple(load.tail<3>(), "{:.1f}, {:.1f}, {:.1f}")),
                             Digits(triple(load.head<3>(), "{:.3g}, {:.3g}, {:.3g}"))};
    for (const std::vector<Vec6>* side : sides) {
      const Vec3 shift = 1e3 * (*side)[k].tail<3>();
      row.push_back(Digits(triple(shift, "{:.5f}, {:.5f}, {:.5f}")));
    }
    row.push_back(Digits(fmt::format("{:.1e}", pair.loads->vector[k])));
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace

std::string StiffnessMatricesHtml(const StiffnessReport& report) {
  const StiffnessWitness* shown = report.Shown();
  if (shown == nullptr) return "";
  std::string html = Note(fmt::format(
      "Wrench [m; f] = K · [rotation; displacement] of {}'s origin ({:.4f}, {:.4f}, {:.4f}) m, "
      "world axes, drives held by their servos.",
      Escape(report.output), report.p_WO.x(), report.p_WO.y(), report.p_WO.z()));
  for (const bool printed : {false, true}) {
    for (const StiffnessWitness& witness : printed ? report.printed : report.witnesses) {
      if (!witness.ran()) continue;
      std::string tables = ToHtml(MatrixTable("K, " + witness.name, witness.result.K, true));
      if (witness.result.C.allFinite()) {
        tables += ToHtml(MatrixTable("C = K⁻¹, " + witness.name, witness.result.C, false));
      }
      html += &witness == shown ? tables : Folded("K and C, " + witness.name, tables);
    }
  }
  std::string differences;
  for (const StiffnessPair& pair : report.comparison.pairs) differences += PairHtml(pair);
  if (!differences.empty()) html += Folded("Differences, every entry", differences);
  for (const StiffnessPair& pair : report.printed_pairs) {
    if (!pair.compared) continue;
    const WorstEntry& worst = pair.metrics.at(StiffnessMetric::kStiffnessEntry);
    html += "<p>The paper's own model differs by up to " +
            fmt::format("<b>{:.3g} %</b> of √(K<sub>ii</sub> K<sub>jj</sub>) at {}",
                        100 * worst.value, Escape(worst.where)) +
            "; this is stated, not judged.</p>\n" + Folded("The paper's own model", PairHtml(pair));
  }
  return html;
}

std::string WeaknessHtml(const StiffnessReport& report) {
  std::string html;
  const StiffnessWitness* shown = report.Shown();
  if (shown != nullptr && shown->result.C.allFinite()) {
    const Mat6& C = shown->result.C;
    const WeakDirection shift = WeakestTranslation(C), turn = WeakestRotation(C);
    const WeakScrew screw = WeakestScrew(C);
    const auto vector = [](const Vec3& v) {
      return fmt::format("({:.4f}, {:.4f}, {:.4f})", v.x(), v.y(), v.z());
    };
    html += ToHtml(Table{
        .caption = "Weakest directions, world axes",
        .head = {Text("against"), Digits("stiffness"), Text("direction"), Text("note")},
        .rows = {{Text("a force"), Digits(fmt::format("{:.5g} N/m", shift.stiffness)),
                  Text("along " + vector(shift.direction)), Text("")},
                 {Text("a moment"), Digits(fmt::format("{:.5g} N m/rad", turn.stiffness)),
                  Text("about " + vector(turn.direction)), Text("")},
                 {Text("a screw"), Digits(fmt::format("{:.5g} N/m", screw.stiffness)),
                  Text("about " + vector(screw.axis)),
                  Text(fmt::format("pitch {:.4g} m/rad, through {} m from the origin; rotations "
                                   "times L = {:.4g} m",
                                   screw.pitch_m, vector(screw.point), screw.length_m))}}});
  }
  if (report.indices.empty()) return html;
  Table table{.caption = "Indices", .head = {Text("index")}, .rows = {}};
  for (const StiffnessWitness& witness : report.witnesses) {
    if (witness.ran()) table.head.push_back(Digits(witness.name));
  }
  table.head.push_back(Text("unit"));
  table.head.push_back(Text("meaning"));
  for (const IndexRow& row : report.indices) {
    std::vector<Cell> cells = {Text(row.name)};
    for (size_t w = 0; w < row.values.size(); ++w) {
      if (!report.witnesses[w].ran()) continue;
      cells.push_back(Digits(fmt::format("{:.6g}", row.values[w])));
    }
    cells.push_back(Text(row.unit));
    cells.push_back(Text(row.meaning));
    table.rows.push_back(std::move(cells));
  }
  return html + ToHtml(table);
}

std::string ContributionsHtml(const StiffnessReport& report) {
  const StiffnessWitness* witness = report.WithShares();
  if (witness == nullptr) return "";
  const std::vector<Contribution> rows = Contributions(witness->result);
  Table table{.caption = "Compliance caused by each element, percent (" + witness->name + ")",
              .head = {Text("element"), Digits("weakest force"), Digits("weakest moment")},
              .rows = {}};
  for (int i = 0; i < 6; ++i) table.head.push_back(Digits(AxisName(i)));
  for (const Contribution& row : rows) {
    std::vector<Cell> cells = {Text(row.element),
                               Digits(fmt::format("{:.2f}", 100 * row.translation)),
                               Digits(fmt::format("{:.2f}", 100 * row.rotation))};
    for (int i = 0; i < 6; ++i) cells.push_back(Digits(fmt::format("{:.2f}", 100 * row.axis[i])));
    table.rows.push_back(std::move(cells));
  }
  return ToSvg(BarsOf(rows)) + ToHtml(table) +
         Note(
             "The column of an axis is the share of C<sub>ii</sub>: stiffening an element by a "
             "factor takes that part of its share away.");
}

std::string LoadsHtml(const StiffnessReport& report) {
  if (report.loads.empty()) return "";
  std::string html = Note(Escape(report.loads_text) + "; world axes, about the output's origin.");
  Table table{.caption = "Errors over all loads, in parts of the axis' largest displacement",
              .head = {Text("of"), Text("")},
              .rows = {}};
  for (const char* name : {"x", "y", "z", "rx", "ry", "rz", "vector"}) {
    table.head.push_back(Digits(name));
  }
  for (const StiffnessPair& pair : report.comparison.pairs) AddStatistics(pair, &table);
  for (const StiffnessPair& pair : report.printed_pairs) AddStatistics(pair, &table);
  if (!table.rows.empty()) html += ToHtml(table);
  const StiffnessPair* main = report.comparison.MainPair();
  if (main == nullptr || !main->loads) return html;
  html += "<div class=\"pictures static-plots\">\n";
  for (int axis = 3; axis < 6; ++axis) {
    html += FigureHtml(ToSvg(LoadPlot(report, *main, axis)));
  }
  html += FigureHtml(ToSvg(ErrorPlot(report, *main))) + "</div>\n";
  return html + Folded("Every load", ToHtml(DisplacementTable(report, *main)));
}

}  // namespace mbv
