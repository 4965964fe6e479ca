// Tables of a stiffness run as CSV.

#include "features/stiffness/stiffness_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "base/json_text.h"
#include "base/text.h"
#include "features/stiffness/stiffness_comparison.h"
#include "plot/svg_plot.h"
#include "report/page.h"
#include "report/result.h"
#include "report/terminal_text.h"

namespace mbv {
namespace {

std::vector<const StiffnessWitness*> AllOf(const StiffnessReport& report) {
  std::vector<const StiffnessWitness*> all;
  for (const StiffnessWitness& witness : report.witnesses) all.push_back(&witness);
  for (const StiffnessWitness& witness : report.printed) all.push_back(&witness);
  return all;
}

}  // namespace

const StiffnessWitness* StiffnessReport::Shown() const {
  for (const StiffnessWitness& witness : witnesses) {
    if (witness.ran()) return &witness;
  }
  return nullptr;
}

const StiffnessWitness* StiffnessReport::WithShares() const {
  for (const StiffnessWitness& witness : witnesses) {
    if (!witness.result.shares.empty() && witness.result.C.allFinite()) return &witness;
  }
  return nullptr;
}

ResultView ViewOf(const StiffnessReport& report) {
  const StiffnessComparison& comparison = report.comparison;
  ResultView view = ViewOfComparison(report, comparison);
  view.kind = "stiffness";
  view.caveats = comparison.caveats;
  view.look = {
      .signs = false, .capitals = false, .margins = false, .steps = false, .title_width = 32};
  for (const StiffnessCheck& check : comparison.checks) {
    view.checks.push_back({.name = check.name,
                           .subject = check.subject,
                           .title = RowOf(check.metric).title,
                           .value = check.value,
                           .limit = check.limit,
                           .pass = check.pass,
                           .where = check.where});
  }
  for (const StiffnessWitness& witness : report.witnesses) {
    view.witnesses.emplace_back(witness.name, witness.result.summary);
  }
  if (const StiffnessPair* pair = comparison.MainPair()) {
    view.main_pair = fmt::format("K {} vs {}", pair->measured, pair->truth);
    view.main_check = pair->name() + ".stiffness_entry";
  }
  return view;
}

std::string StiffnessCsv(const StiffnessReport& report) {
  std::string text = "witness,matrix,row,column,unit,value\n";
  auto out = std::back_inserter(text);
  for (const StiffnessWitness* witness : AllOf(report)) {
    if (!witness->ran()) continue;
    for (const bool K : {true, false}) {
      const Mat6& M = K ? witness->result.K : witness->result.C;
      for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 6; ++j) {
          fmt::format_to(out, "{},{},{},{},{},{:.17g}\n", CsvCell(witness->name), K ? "K" : "C",
                         AxisName(i), AxisName(j), K ? StiffnessUnit(i, j) : ComplianceUnit(i, j),
                         M(i, j));
        }
      }
    }
  }
  return text;
}

std::string LoadsCsv(const StiffnessReport& report) {
  std::string text = "load,mx_Nm,my_Nm,mz_Nm,fx_N,fy_N,fz_N";
  auto out = std::back_inserter(text);
  std::vector<const StiffnessWitness*> witnesses;
  for (const StiffnessWitness* witness : AllOf(report)) {
    if (witness->displacements.size() != report.loads.size() || report.loads.empty()) continue;
    witnesses.push_back(witness);
    for (int i = 0; i < 6; ++i) {
      text +=
          "," + CsvCell(fmt::format("{}_{}.{}", AxisName(i), i < 3 ? "rad" : "m", witness->name));
    }
  }
  text += "\n";
  for (size_t k = 0; k < report.loads.size(); ++k) {
    fmt::format_to(out, "{}", k + 1);
    for (int i = 0; i < 6; ++i) fmt::format_to(out, ",{:.17g}", report.loads[k][i]);
    for (const StiffnessWitness* witness : witnesses) {
      for (int i = 0; i < 6; ++i) fmt::format_to(out, ",{:.17g}", witness->displacements[k][i]);
    }
    text += "\n";
  }
  return text;
}

std::string ContributionsCsv(const StiffnessReport& report) {
  std::string text = "witness,element,weakest_translation,weakest_rotation,rx,ry,rz,x,y,z\n";
  auto out = std::back_inserter(text);
  for (const StiffnessWitness* witness : AllOf(report)) {
    for (const Contribution& row : Contributions(witness->result)) {
      fmt::format_to(out, "{},{},{:.17g},{:.17g}", CsvCell(witness->name), CsvCell(row.element),
                     row.translation, row.rotation);
      for (int i = 0; i < 6; ++i) fmt::format_to(out, ",{:.17g}", row.axis[i]);
      text += "\n";
    }
  }
  return text;
}

// The page of a stiffness run's report.html.

namespace {

constexpr const char* kUnitsOfChecks =
    "Entries are compared in units of √(K<sub>ii</sub> K<sub>jj</sub>), which does not depend on "
    "the units of length and angle; displacements in units of the largest one along the axis, "
    "vectors in units of their length.";

class StiffnessPageWriter {
 public:
  explicit StiffnessPageWriter(const StiffnessReport& report)
      : report_(report), view_(ViewOf(report)) {}

  std::string Write() {
    page_.Add("Verdict", "Verdict", VerdictHtml(view_, Cards(), PoseText()));
    page_.Add("Stiffness", "Stiffness", StiffnessMatricesHtml(report_));
    page_.Add("Where it is weak", "Weakness", WeaknessHtml(report_));
    page_.Add("What causes the compliance", "Elements", ContributionsHtml(report_));
    page_.Add("Displacements under loads", "Loads", LoadsHtml(report_));
    page_.Add("Checks", "Checks", ChecksHtml(view_, kUnitsOfChecks));
    page_.Add("What could not be compared", "Gaps", GapsHtml(view_));
    page_.Add("Parameters", "Parameters", ParametersHtml(report_.parameters, false));
    page_.Add("Reproduce this run", "Reproduce", Reproduce());
    PageHead head = HeadOf(view_);
    head.kicker = "mbverify stiffness report";
    head.footer =
        "Written by mbverify; all digits are in stiffness.csv, loads.csv and summary.json.";
    return page_.Write(head);
  }

 private:
  std::string PoseText() const {
    std::string text = "Stiffness of " + Escape(report_.output) + " with all drives held, at ";
    for (const PoseEntry& entry : report_.pose) {
      text += fmt::format("{} = {:.6g} {}, ", Escape(entry.name), entry.value, entry.unit);
    }
    text.resize(text.size() - 2);
    text += ".";
    if (!report_.pose_note.empty()) text += " " + Escape(report_.pose_note) + ".";
    return text;
  }

  std::string Cards() const {
    std::string html;
    const auto entry = [&](const std::string& pair, const char* title) {
      const StiffnessCheck* check = report_.comparison.FindCheck(pair + ".stiffness_entry");
      if (check == nullptr) return;
      html += Card(title, fmt::format("{:.1e}", check->value),
                   Spaced(pair) + ", worst at " + check->where +
                       (check->limit ? fmt::format(", limit {:.0e}", *check->limit) : ""));
    };
    entry(PairName(role::kSimulated, role::kAnalytic), "Stiffness difference");
    entry(PairName(role::kReference, role::kAnalytic), "Stiffness difference");
    if (const StiffnessWitness* shown = report_.Shown()) {
      html += Card("Rank", std::to_string(shown->result.rank), "of K, 6 if the output is held");
      if (shown->result.C.allFinite()) {
        const WeakDirection weak = WeakestTranslation(shown->result.C);
        html += Card("Weakest against a force", fmt::format("{:.4g} N/m", weak.stiffness),
                     fmt::format("along ({:.2f}, {:.2f}, {:.2f})", weak.direction.x(),
                                 weak.direction.y(), weak.direction.z()));
      }
    }
    if (const StiffnessWitness* shared = report_.WithShares()) {
      const Contribution first = Contributions(shared->result).front();
      html += Card("Largest contributor", fmt::format("{:.1f} %", 100 * first.translation),
                   first.element + ", in the weakest direction");
    }
    return html;
  }

  std::string Reproduce() const {
    const Timing& timing = report_.timing;
    const std::string times =
        timing.stated ? fmt::format("analytic {:.3f} s, reference {:.3f} s, simulation {:.3f} s",
                                    timing.analytic_s, timing.reference_s, timing.simulation_s)
                      : "";
    return ReproduceHtml(view_, report_.command, times,
                         "Files beside this page: summary.json (every number), stiffness.csv, "
                         "loads.csv and contributions.csv (17 digits), model.xml (the compliant "
                         "MJCF as simulated).");
  }

  const StiffnessReport& report_;
  const ResultView view_;
  Page page_;
};

}  // namespace

std::string ToHtml(const StiffnessReport& report) { return StiffnessPageWriter(report).Write(); }

// Tables and figures of a stiffness page.

namespace {

Table MatrixTable(const std::string& caption, const Mat6& M, bool stiffness) {
  Table table{
      .caption = caption,
      .columns = {Text("")},
  };
  for (int j = 0; j < 6; ++j) {
    table.columns.push_back(Digits(stiffness ? AxisName(j) : kWrenchNames[j]));
  }
  table.columns.push_back(Text("units"));
  for (int i = 0; i < 6; ++i) {
    std::vector<Cell> row = {stiffness ? kWrenchNames[i] : AxisName(i)};
    for (int j = 0; j < 6; ++j) row.push_back(fmt::format("{:.6g}", M(i, j)));
    const auto unit = stiffness ? &StiffnessUnit : &ComplianceUnit;
    row.push_back(fmt::format("{} | {}", unit(i, 0), unit(i, 3)));
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
  Table table{
      .caption = caption,
      .columns = {Text("")},
  };
  for (int j = 0; j < 6; ++j) table.columns.push_back(Digits(AxisName(j)));
  for (int i = 0; i < 6; ++i) {
    std::vector<Cell> row = {AxisName(i)};
    for (int j = 0; j < 6; ++j) {
      row.emplace_back("");
      row.back().html = DifferenceCell(difference(i, j));
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
    std::vector<Cell> row = {pair.measured + " against " + pair.truth, mean ? "mean" : "largest"};
    for (int i : {3, 4, 5, 0, 1, 2}) row.push_back(fmt::format("{:.2e}", axis[i]));
    row.push_back(fmt::format("{:.2e}", mean ? e.vector_mean : e.vector_max));
    table->rows.push_back(std::move(row));
  }
}

Table DisplacementTable(const StiffnessReport& report, const StiffnessPair& pair) {
  Table table{
      .caption = "Every load",
      .columns = {Digits("load"), Digits("F [N]"), Digits("M [N m]")},
  };
  const std::vector<Vec6>* sides[2] = {nullptr, nullptr};
  for (const StiffnessWitness& witness : report.witnesses) {
    if (witness.name == pair.truth) sides[0] = &witness.displacements;
    if (witness.name == pair.measured) sides[1] = &witness.displacements;
  }
  for (const std::string& name : {pair.truth, pair.measured}) {
    table.columns.push_back(Digits(name + " x, y, z [mm]"));
  }
  table.columns.push_back(Digits("error of the vector"));
  const auto triple = [](const Vec3& v, const char* format) {
    return fmt::format(fmt::runtime(format), v.x(), v.y(), v.z());
  };
  for (size_t k = 0; k < report.loads.size(); ++k) {
    const Vec6& load = report.loads[k];
    std::vector<Cell> row = {std::to_string(k + 1),
                             triple(load.tail<3>(), "{:.1f}, {:.1f}, {:.1f}"),
                             triple(load.head<3>(), "{:.3g}, {:.3g}, {:.3g}")};
    for (const std::vector<Vec6>* side : sides) {
      const Vec3 shift = 1e3 * (*side)[k].tail<3>();
      row.push_back(triple(shift, "{:.5f}, {:.5f}, {:.5f}"));
    }
    row.push_back(fmt::format("{:.1e}", pair.loads->vector[k]));
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
        .columns = {Text("against"), Digits("stiffness"), Text("direction"), Text("note")},
        .rows = {
            {"a force", fmt::format("{:.5g} N/m", shift.stiffness),
             "along " + vector(shift.direction)},
            {"a moment", fmt::format("{:.5g} N m/rad", turn.stiffness),
             "about " + vector(turn.direction)},
            {"a screw", fmt::format("{:.5g} N/m", screw.stiffness), "about " + vector(screw.axis),
             fmt::format("pitch {:.4g} m/rad, through {} m from the origin; rotations times "
                         "L = {:.4g} m",
                         screw.pitch_m, vector(screw.point), screw.length_m)}}});
  }
  if (report.indices.empty()) return html;
  Table table{
      .caption = "Indices",
      .columns = {Text("index")},
  };
  for (const StiffnessWitness& witness : report.witnesses) {
    if (witness.ran()) table.columns.push_back(Digits(witness.name));
  }
  table.columns.push_back(Text("unit"));
  table.columns.push_back(Text("meaning"));
  for (const IndexRow& row : report.indices) {
    std::vector<Cell> cells = {row.name};
    for (size_t w = 0; w < row.values.size(); ++w) {
      if (!report.witnesses[w].ran()) continue;
      cells.push_back(fmt::format("{:.6g}", row.values[w]));
    }
    cells.push_back(row.unit);
    cells.push_back(row.meaning);
    table.rows.push_back(std::move(cells));
  }
  return html + ToHtml(table);
}

std::string ContributionsHtml(const StiffnessReport& report) {
  const StiffnessWitness* witness = report.WithShares();
  if (witness == nullptr) return "";
  const std::vector<Contribution> rows = Contributions(witness->result);
  Table table{
      .caption = "Compliance caused by each element, percent (" + witness->name + ")",
      .columns = {Text("element"), Digits("weakest force"), Digits("weakest moment")},
  };
  for (int i = 0; i < 6; ++i) table.columns.push_back(Digits(AxisName(i)));
  for (const Contribution& row : rows) {
    std::vector<Cell> cells = {row.element, fmt::format("{:.2f}", 100 * row.translation),
                               fmt::format("{:.2f}", 100 * row.rotation)};
    for (int i = 0; i < 6; ++i) cells.push_back(fmt::format("{:.2f}", 100 * row.axis[i]));
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
  Table table{
      .caption = "Errors over all loads, in parts of the axis' largest displacement",
      .columns = {Text("of"), Text("")},
  };
  for (const char* name : {"x", "y", "z", "rx", "ry", "rz", "vector"}) {
    table.columns.push_back(Digits(name));
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

namespace {

using Json = nlohmann::ordered_json;

template <typename Matrix>
Json VectorJson(const Matrix& values) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < values.size(); ++i) json.push_back(Number(values[i]));
  return json;
}

Json MatrixJson(const Mat6& M) {
  Json json = Json::array();
  for (int i = 0; i < 6; ++i) json.push_back(VectorJson(Vec6(M.row(i))));
  return json;
}

Json LoadErrorsJson(const LoadErrors& errors) {
  return {{"axes", {"rx", "ry", "rz", "x", "y", "z"}}, {"largest", VectorJson(errors.scale)},
          {"error_mean", VectorJson(errors.mean)},     {"error_max", VectorJson(errors.max)},
          {"vector_mean", Number(errors.vector_mean)}, {"vector_max", Number(errors.vector_max)},
          {"worst_load", errors.worst_load + 1}};
}

Json PairJson(const StiffnessPair& pair) {
  Json json = Json::object();
  for (const auto& [metric, worst] : pair.metrics) json[RowOf(metric).key] = Number(worst.value);
  json["K_difference"] = MatrixJson(pair.K_difference);
  json["C_difference"] = MatrixJson(pair.C_difference);
  if (pair.loads) json["loads"] = LoadErrorsJson(*pair.loads);
  return json;
}

Json MetricsJson(const StiffnessReport& report) {
  Json all = Json::object();
  for (const StiffnessPair& pair : report.comparison.pairs) {
    if (pair.compared) all[pair.name()] = PairJson(pair);
  }
  for (const StiffnessPair& pair : report.printed_pairs) {
    if (pair.compared) all[pair.name()] = PairJson(pair);
  }
  return all;
}

Json ContributionsJson(const StiffnessResult& result) {
  Json json = Json::array();
  for (const Contribution& row : Contributions(result)) {
    json.push_back({{"element", row.element},
                    {"weakest_translation", Number(row.translation)},
                    {"weakest_rotation", Number(row.rotation)},
                    {"axes", VectorJson(row.axis)}});
  }
  return json;
}

Json WitnessJson(const StiffnessWitness& witness, const ResultView& view) {
  const StiffnessResult& result = witness.result;
  Json json = WitnessHead(witness.name, result.summary);
  json["rank"] = result.rank;
  json["K"] = MatrixJson(result.K);
  json["C"] = MatrixJson(result.C);
  AddBreakdown(view, result.summary, &json);
  if (std::isfinite(witness.residual)) json["residual"] = witness.residual;
  if (std::isfinite(witness.extrapolation_error)) {
    json["extrapolation"] = witness.extrapolation_error;
  }
  json["contributions"] = ContributionsJson(result);
  return json;
}

Json WitnessesJson(const std::vector<StiffnessWitness>& witnesses, const ResultView& view) {
  Json json = Json::array();
  for (const StiffnessWitness& witness : witnesses) json.push_back(WitnessJson(witness, view));
  return json;
}

Json IndicesJson(const StiffnessReport& report) {
  Json json = Json::array();
  for (const IndexRow& row : report.indices) {
    Json index = {{"name", row.name}, {"unit", row.unit}, {"meaning", row.meaning}};
    for (size_t w = 0; w < row.values.size(); ++w) {
      index[report.witnesses[w].name] = Number(row.values[w]);
    }
    json.push_back(std::move(index));
  }
  return json;
}

Json WeakestJson(const Mat6& C) {
  const WeakDirection shift = WeakestTranslation(C), turn = WeakestRotation(C);
  const WeakScrew screw = WeakestScrew(C);
  return {{"translation",
           {{"direction", VectorJson(shift.direction)}, {"stiffness", Number(shift.stiffness)}}},
          {"rotation",
           {{"direction", VectorJson(turn.direction)}, {"stiffness", Number(turn.stiffness)}}},
          {"screw",
           {{"length_m", Number(screw.length_m)},
            {"stiffness", Number(screw.stiffness)},
            {"axis", VectorJson(screw.axis)},
            {"point", VectorJson(screw.point)},
            {"pitch_m", Number(screw.pitch_m)}}}};
}

Json PoseJson(const StiffnessReport& report) {
  Json json = Json::object();
  for (const PoseEntry& entry : report.pose) json[entry.name] = Number(entry.value);
  return json;
}

}  // namespace

std::string ToJson(const StiffnessReport& report) {
  const ResultView view = ViewOf(report);
  Json json = SummaryHead(view);
  json["metrics"] = MetricsJson(report);
  json["witnesses"] = WitnessesJson(report.witnesses, view);
  json["printed"] = WitnessesJson(report.printed, view);
  json["not_compared"] = NotComparedJson(view);
  json["counts"] = CountsJson(view);
  json["output"] = report.output;
  json["pose"] = PoseJson(report);
  json["analytic_model"] = report.model;
  json["loads"] = report.loads_text;
  json["indices"] = IndicesJson(report);
  if (const StiffnessWitness* shown = report.Shown())
    json["weakest"] = WeakestJson(shown->result.C);
  json["findings"] = FindingsJson(report.findings);
  AddSummaryEnd(view, &json);
  return Dump(json);
}

// The result of a stiffness run for a terminal.

namespace {

std::string Vector(const Vec3& v, const char* format = "{:.4f}") {
  std::string text;
  for (int i = 0; i < 3; ++i) {
    // No "-0.0000".
    const double value = std::abs(v[i]) < 5e-5 ? 0.0 : v[i];
    text += (i == 0 ? "(" : ", ") + fmt::format(fmt::runtime(format), value);
  }
  return text + ")";
}

std::string PoseText(const StiffnessReport& report) {
  std::string text;
  for (const PoseEntry& entry : report.pose) {
    text += (text.empty() ? "" : ", ") +
            fmt::format("{} = {:.6g} {}", entry.name, entry.value, entry.unit);
  }
  return text;
}

class StiffnessTableWriter {
 public:
  explicit StiffnessTableWriter(const TableOptions& options) : out_(options) {}

  std::string Write(const StiffnessReport& report) {
    const ResultView view = ViewOf(report);
    const std::string title =
        report.scenario.empty() ? report.mechanism + ", stiffness" : report.title();
    out_.Head(view, title,
              {fmt::format("{} at {}", report.output, PoseText(report)), report.pose_note});
    if (const StiffnessWitness* shown = report.Shown()) Matrix(report, *shown);
    out_.Checks(view);
    Indices(report);
    if (const StiffnessWitness* shown = report.Shown()) Weakest(shown->result);
    if (const StiffnessWitness* shared = report.WithShares()) Elements(*shared);
    for (const StiffnessPair& pair : report.comparison.pairs) Loads(report, pair);
    Printed(report);
    if (out_.verbose()) out_.Gaps(view);
    const Timing& timing = report.timing;
    out_.Times({{role::kAnalytic.called, timing.analytic_s},
                {role::kReference.called, timing.reference_s},
                {role::kSimulated.called, timing.simulation_s}},
               timing.total_s);
    return out_.text();
  }

 private:
  void Matrix(const StiffnessReport& report, const StiffnessWitness& witness) {
    out_.Line();
    out_.Line(fmt::format(
        "  K ({}{}), rank {}: [m; f] = K [rotation; displacement] of {}'s origin, "
        "world axes, drives held",
        witness.name,
        witness.name == role::kAnalytic && !report.model.empty() ? ", " + report.model : "",
        witness.result.rank, report.output));
    Table table{.columns = {Text("")}};
    for (int j = 0; j < 6; ++j) {
      table.columns.push_back(Digits(std::string(AxisName(j)) + (j < 3 ? " [1/rad]" : " [1/m]")));
    }
    for (int i = 0; i < 6; ++i) {
      std::vector<Cell>& row = table.rows.emplace_back();
      row.emplace_back(std::string(kWrenchNames[i]) + (i < 3 ? " [N m]" : " [N]"));
      for (int j = 0; j < 6; ++j) row.emplace_back(fmt::format("{:.6g}", witness.result.K(i, j)));
    }
    out_.Add(table);
  }

  void Indices(const StiffnessReport& report) {
    if (report.indices.empty()) return;
    Table table{.columns = {Text("index")}};
    for (const StiffnessWitness& witness : report.witnesses) {
      if (witness.ran()) table.columns.push_back(Digits(witness.name));
    }
    table.columns.push_back(Text("unit"));
    table.columns.push_back(Text(""));
    for (const IndexRow& row : report.indices) {
      std::vector<Cell>& cells = table.rows.emplace_back();
      cells.emplace_back(row.name);
      for (size_t w = 0; w < row.values.size(); ++w) {
        if (report.witnesses[w].ran()) cells.emplace_back(fmt::format("{:.6g}", row.values[w]));
      }
      cells.emplace_back(row.unit);
      cells.emplace_back(row.meaning, Mark::kOff);
    }
    out_.Add(table);
  }

  void Weakest(const StiffnessResult& result) {
    if (!result.C.allFinite()) return;
    const WeakDirection shift = WeakestTranslation(result.C), turn = WeakestRotation(result.C);
    const WeakScrew screw = WeakestScrew(result.C);
    out_.Line();
    out_.Line(fmt::format("  weakest against a force:  {:.5g} N/m along {}", shift.stiffness,
                          Vector(shift.direction)));
    out_.Line(fmt::format("  weakest against a moment: {:.5g} N m/rad about {}", turn.stiffness,
                          Vector(turn.direction)));
    out_.Line(
        fmt::format("  weakest screw: {:.5g} N/m with rotations times L = {:.4g} m: about {} "
                    "through {} m from the origin,",
                    screw.stiffness, screw.length_m, Vector(screw.axis), Vector(screw.point)));
    out_.Line(fmt::format("    pitch {:.4g} m/rad", screw.pitch_m));
  }

  void Elements(const StiffnessWitness& witness) {
    const std::vector<Contribution> rows = Contributions(witness.result);
    out_.Line();
    out_.Line(fmt::format("  compliance caused by each element, percent ({})", witness.name));
    Table table{.columns = {Text("element"), Digits("weakest force"), Digits("weakest moment")}};
    for (int i = 0; i < 6; ++i) table.columns.push_back(Digits(AxisName(i)));
    const auto percent = [](double share) { return fmt::format("{:.2f}", 100 * share); };
    for (const Contribution& row : rows) {
      std::vector<Cell>& cells = table.rows.emplace_back();
      cells = {row.element, percent(row.translation), percent(row.rotation)};
      for (int i = 0; i < 6; ++i) cells.emplace_back(percent(row.axis[i]));
    }
    out_.Add(table);
  }

  void Loads(const StiffnessReport& report, const StiffnessPair& pair) {
    if (!pair.loads) return;
    const LoadErrors& e = *pair.loads;
    out_.Line();
    out_.Line(
        fmt::format("  {} against {} under {}", pair.measured, pair.truth, report.loads_text));
    Table table{.columns = {Text(""), Digits("x"), Digits("y"), Digits("z"), Digits("vector")}};
    std::vector<Cell> largest = {"largest displacement [mm]"};
    for (int i = 3; i < 6; ++i) largest.emplace_back(fmt::format("{:.4g}", 1e3 * e.scale[i]));
    table.rows.push_back(std::move(largest));
    const auto add = [&](const char* title, const Vec6& axes, double vector) {
      std::vector<Cell>& cells = table.rows.emplace_back();
      cells.emplace_back(title);
      for (const double value : {axes[3], axes[4], axes[5], vector}) {
        cells.emplace_back(fmt::format("{:.2e}", value));
      }
    };
    add("error, mean", e.mean, e.vector_mean);
    add("error, largest", e.max, e.vector_max);
    out_.Add(table);
  }

  // Stated, never judged.
  void Printed(const StiffnessReport& report) {
    for (const StiffnessPair& pair : report.printed_pairs) {
      out_.Line();
      if (!pair.compared) {
        out_.Line("  the paper's own model: " + pair.reason);
        continue;
      }
      const WorstEntry& K = pair.metrics.at(StiffnessMetric::kStiffnessEntry);
      out_.Line(
          fmt::format("  the paper's own model differs from {} by {:.3g} % of K (worst: {}); not "
                      "judged",
                      pair.truth, 100 * K.value, K.where));
      Loads(report, pair);
    }
  }

  TerminalText out_;
};

}  // namespace

std::string ToTable(const StiffnessReport& report, const TableOptions& options) {
  return StiffnessTableWriter(options).Write(report);
}

}  // namespace mbv
