#include "features/stiffness/stiffness_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "base/json_text.h"
#include "base/text.h"
#include "comparison/verdict.h"
#include "features/stiffness/stiffness_measures.h"
#include "plot/svg_plot.h"
#include "report/page.h"
#include "report/terminal_text.h"

namespace mbv {
namespace {

constexpr const char* kWrenchNames[] = {"mx", "my", "mz", "fx", "fy", "fz"};

std::vector<const StiffnessWitness*> AllOf(const StiffnessReport& report) {
  std::vector<const StiffnessWitness*> all;
  for (const StiffnessWitness& witness : report.witnesses) all.push_back(&witness);
  for (const StiffnessWitness& witness : report.printed) all.push_back(&witness);
  return all;
}

// The compared pairs of witnesses, and the printed model's; each with what differs.
struct ShownPair {
  const PairComparison* pair;
  const StiffnessWitness *measured, *truth;
  StiffnessDifference difference;

  [[nodiscard]] std::string text() const { return pair->measured + " against " + pair->truth; }
};

std::vector<ShownPair> PairsOf(const StiffnessReport& report) {
  std::vector<ShownPair> shown;
  const auto add = [&](const PairComparison& pair, const std::vector<StiffnessWitness>& measured) {
    if (!pair.compared) return;
    const StiffnessWitness* a = FindNamed(measured, pair.measured);
    const StiffnessWitness* b = FindNamed(report.witnesses, pair.truth);
    shown.push_back({&pair, a, b, DifferenceOf(*a, *b)});
  };
  for (const PairComparison& pair : report.comparison.pairs) add(pair, report.witnesses);
  for (const PairComparison& pair : report.printed_pairs) add(pair, report.printed);
  return shown;
}

std::string PoseText(const StiffnessReport& report) {
  std::string text;
  for (const PoseEntry& entry : report.pose) {
    text += (text.empty() ? "" : ", ") +
            fmt::format("{} = {:.6g} {}", entry.name, entry.value, entry.unit);
  }
  return text;
}

}  // namespace

const StiffnessWitness* StiffnessReport::Shown() const {
  const auto found = std::ranges::find_if(witnesses, &StiffnessWitness::ran);
  return found == witnesses.end() ? nullptr : &*found;
}

const StiffnessWitness* StiffnessReport::WithShares() const {
  const auto found = std::ranges::find_if(witnesses, [](const StiffnessWitness& witness) {
    return !witness.result.shares.empty() && witness.result.C.allFinite();
  });
  return found == witnesses.end() ? nullptr : &*found;
}

ResultView ViewOf(const StiffnessReport& report) {
  ResultView view = ViewOfComparison(report, report.comparison, Metric::kStiffnessEntry);
  view.kind = "stiffness";
  view.in_time = false;
  for (const StiffnessWitness& witness : report.witnesses) {
    view.witnesses.emplace_back(witness.name, witness.result.summary);
  }
  return view;
}

// Tables as CSV.

namespace {

template <typename Vector>
void AddDigits(const Vector& values, std::string* csv) {
  for (const double value : values) fmt::format_to(std::back_inserter(*csv), ",{:.17g}", value);
}

}  // namespace

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
  std::vector<const StiffnessWitness*> witnesses = AllOf(report);
  std::erase_if(witnesses, [&](const StiffnessWitness* witness) {
    return report.loads.empty() || witness->displacements.size() != report.loads.size();
  });
  for (const StiffnessWitness* witness : witnesses) {
    for (int i = 0; i < 6; ++i) {
      text +=
          "," + CsvCell(fmt::format("{}_{}.{}", AxisName(i), i < 3 ? "rad" : "m", witness->name));
    }
  }
  for (size_t k = 0; k < report.loads.size(); ++k) {
    text += fmt::format("\n{}", k + 1);
    AddDigits(report.loads[k], &text);
    for (const StiffnessWitness* witness : witnesses) AddDigits(witness->displacements[k], &text);
  }
  return text + "\n";
}

std::string ContributionsCsv(const StiffnessReport& report) {
  std::string text = "witness,element,weakest_translation,weakest_rotation,rx,ry,rz,x,y,z\n";
  for (const StiffnessWitness* witness : AllOf(report)) {
    for (const Contribution& row : Contributions(witness->result)) {
      text += CsvCell(witness->name) + "," + CsvCell(row.element);
      AddDigits(std::array{row.translation, row.rotation}, &text);
      AddDigits(row.axis, &text);
      text += "\n";
    }
  }
  return text;
}

// What page and terminal show.

namespace {

std::string Vector(const Vec3& v) {
  std::string text;
  for (const double value : v) {
    // No "-0.0000".
    text +=
        fmt::format("{}{:.4f}", text.empty() ? "(" : ", ", std::abs(value) < 5e-5 ? 0.0 : value);
  }
  return text + ")";
}

template <typename Values>
void AddCells(const Values& values, const char* format, std::vector<Cell>* row) {
  for (const double value : values) {
    row->emplace_back(fmt::format(fmt::runtime(format), value));
  }
}

Table MatrixTable(const std::string& caption, const Mat6& M, bool stiffness) {
  Table table{.caption = caption, .columns = {Text("")}};
  for (int j = 0; j < 6; ++j) {
    table.columns.push_back(Digits(stiffness ? AxisName(j) : kWrenchNames[j]));
  }
  table.columns.push_back(Text("units"));
  const auto unit = stiffness ? &StiffnessUnit : &ComplianceUnit;
  for (int i = 0; i < 6; ++i) {
    std::vector<Cell> row = {stiffness ? kWrenchNames[i] : AxisName(i)};
    AddCells(M.row(i), "{:.6g}", &row);
    row.emplace_back(fmt::format("{} | {}", unit(i, 0), unit(i, 3)));
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
  Table table{.caption = caption, .columns = {Text("")}};
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

ReportSection MatrixSection(const StiffnessReport& report) {
  ReportSection section{.title = "Stiffness", .link = "Stiffness"};
  const StiffnessWitness* shown = report.Shown();
  if (shown == nullptr) return section;
  section.Note(fmt::format("Wrench [m; f] = K · [rotation; displacement] of {}'s origin ({:.4f}, "
                           "{:.4f}, {:.4f}) m, world axes, drives held by their servos.",
                           report.output, report.p_WO.x(), report.p_WO.y(), report.p_WO.z()),
               On::kAll);
  for (const StiffnessWitness* witness : AllOf(report)) {
    if (!witness->ran()) continue;
    const bool named = witness->name == role::kAnalytic && !report.model.empty();
    const std::string name = witness->name + (named ? ", " + report.model : "");
    std::vector<Block> tables = {{MatrixTable(
        fmt::format("K, {}, rank {}", name, witness->result.rank), witness->result.K, true)}};
    if (witness->result.C.allFinite()) {
      tables.push_back({MatrixTable("C = K⁻¹, " + name, witness->result.C, false)});
    }
    if (witness != shown) {
      section.Add(Fold{"K and C, " + witness->name, std::move(tables)}, On::kPage);
    } else {
      section.blocks.insert(section.blocks.end(), tables.begin(), tables.end());
    }
  }
  Fold differences{"Differences, every entry", {}};
  for (const ShownPair& shown_pair : PairsOf(report)) {
    const std::string pair = shown_pair.pair->measured + " − " + shown_pair.pair->truth;
    const auto add = [&](const char* what, const Mat6& difference) {
      if (difference.allFinite())
        differences.blocks.push_back({DifferenceTable(pair + what, difference)});
    };
    add(": ΔK_ij / √(K_ii K_jj), each entry", shown_pair.difference.K);
    add(": ΔC_ij / √(C_ii C_jj)", shown_pair.difference.C);
  }
  section.Add(std::move(differences), On::kPage);
  return section;
}

// Stated, never judged.
ReportSection PrintedSection(const StiffnessReport& report) {
  ReportSection section{.title = "The paper's own model", .link = "Printed"};
  for (const PairComparison& pair : report.printed_pairs) {
    if (!pair.compared) {
      section.Add(Paragraph{"the paper's own model: " + pair.reason});
      continue;
    }
    const Measured& K = pair.metrics.at(Metric::kStiffnessEntry);
    section.Add(
        Paragraph{fmt::format("The paper's own model differs from {} by {:.3g} % of K "
                              "(worst: {}); this is stated, not judged.",
                              pair.truth, 100 * K.value, K.channel)});
  }
  return section;
}

ReportSection WeaknessSection(const StiffnessReport& report) {
  ReportSection section{.title = "Where it is weak", .link = "Weakness"};
  const StiffnessWitness* shown = report.Shown();
  if (shown != nullptr && shown->result.C.allFinite()) {
    const Mat6& C = shown->result.C;
    const WeakDirection shift = WeakestTranslation(C), turn = WeakestRotation(C);
    const WeakScrew screw = WeakestScrew(C);
    section.Add(Table{
        .caption = "Weakest directions, world axes",
        .columns = {Text("against"), Digits("stiffness"), Text("direction"), Text("note")},
        .rows = {
            {"a force", fmt::format("{:.5g} N/m", shift.stiffness),
             "along " + Vector(shift.direction)},
            {"a moment", fmt::format("{:.5g} N m/rad", turn.stiffness),
             "about " + Vector(turn.direction)},
            {"a screw", fmt::format("{:.5g} N/m", screw.stiffness), "about " + Vector(screw.axis),
             fmt::format("pitch {:.4g} m/rad, through {} m from the origin; rotations "
                         "times L = {:.4g} m",
                         screw.pitch_m, Vector(screw.point), screw.length_m)}}});
  }
  Table table{.caption = "Indices", .columns = {Text("index")}};
  for (const StiffnessWitness& witness : report.witnesses) {
    if (witness.ran()) table.columns.push_back(Digits(witness.name));
  }
  table.columns.push_back(Text("unit"));
  table.columns.push_back(Text("meaning"));
  for (const IndexRow& row : report.indices) {
    std::vector<Cell> cells = {row.name};
    for (size_t w = 0; w < row.values.size(); ++w) {
      if (report.witnesses[w].ran()) cells.emplace_back(fmt::format("{:.6g}", row.values[w]));
    }
    cells.emplace_back(row.unit);
    cells.emplace_back(row.meaning);
    table.rows.push_back(std::move(cells));
  }
  section.Add(std::move(table));
  return section;
}

ReportSection ElementSection(const StiffnessReport& report) {
  ReportSection section{.title = "What causes the compliance", .link = "Elements"};
  const StiffnessWitness* witness = report.WithShares();
  if (witness == nullptr) return section;
  Table table{.caption = "Compliance caused by each element, percent (" + witness->name + ")",
              .columns = {Text("element"), Digits("weakest force"), Digits("weakest moment")}};
  for (int i = 0; i < 6; ++i) table.columns.push_back(Digits(AxisName(i)));
  BarPlot bars{.title = "Compliance caused by each element",
               .columns = {"against the weakest force", "against the weakest moment"}};
  for (const Contribution& row : Contributions(witness->result)) {
    std::vector<Cell> cells = {row.element};
    AddCells(std::array{100 * row.translation, 100 * row.rotation}, "{:.2f}", &cells);
    AddCells(Vec6(100 * row.axis), "{:.2f}", &cells);
    table.rows.push_back(std::move(cells));
    bars.rows.push_back({row.element, {row.translation, row.rotation}});
  }
  section.Add(Drawing{ToSvg(bars)});
  section.Add(std::move(table));
  section.Note(
      "The column of an axis is the share of C_ii: stiffening an element by a factor takes that "
      "part of its share away.");
  return section;
}

// As the paper's Fig. 17: theory and simulation per load, one figure per direction.
LinePlot LoadPlot(const StiffnessReport& report, const ShownPair& pair, int axis) {
  LinePlot plot{.title = fmt::format("Displacement along {}", AxisName(axis)),
                .x_label = "load",
                .y_label = fmt::format("{} [mm]", AxisName(axis))};
  std::vector<const StiffnessWitness*> shown = {pair.measured, pair.truth};
  for (const StiffnessWitness& witness : report.printed) shown.push_back(&witness);
  for (const StiffnessWitness* witness : shown) {
    PlotLine line{.label = witness->name, .markers = witness == pair.measured};
    for (size_t k = 0; k < witness->displacements.size(); ++k) {
      line.points.emplace_back(static_cast<double>(k + 1), 1e3 * witness->displacements[k][axis]);
    }
    plot.lines.push_back(std::move(line));
  }
  return plot;
}

LinePlot ErrorPlot(const ShownPair& pair) {
  LinePlot plot{.title = pair.text() + ": error per load",
                .x_label = "load",
                .y_label = "error, percent",
                .log_y = true};
  const LoadErrors& errors = *pair.difference.loads;
  const auto add = [&](const std::string& label, const auto& error) {
    PlotLine line{.label = label};
    for (size_t k = 0; k < errors.vector.size(); ++k) {
      line.points.emplace_back(static_cast<double>(k + 1), 100 * error(k));
    }
    plot.lines.push_back(std::move(line));
  };
  for (int axis = 3; axis < 6; ++axis) {
    add(fmt::format("{}, of the axis' largest", AxisName(axis)), [&](size_t k) {
      const double error =
          pair.measured->displacements[k][axis] - pair.truth->displacements[k][axis];
      return std::abs(error) / errors.scale[axis];
    });
  }
  add("vector, of its length", [&](size_t k) { return errors.vector[k]; });
  return plot;
}

Table DisplacementTable(const StiffnessReport& report, const ShownPair& pair) {
  Table table{
      .caption = "Every load",
      .columns = {Digits("load"), Digits("F [N]"), Digits("M [N m]"),
                  Digits(pair.truth->name + " x, y, z [mm]"),
                  Digits(pair.measured->name + " x, y, z [mm]"), Digits("error of the vector")},
  };
  const auto triple = [](const Vec3& v, const char* format) {
    return fmt::format(fmt::runtime(format), v.x(), v.y(), v.z());
  };
  constexpr const char* kMillimetres = "{:.5f}, {:.5f}, {:.5f}";
  for (size_t k = 0; k < report.loads.size(); ++k) {
    table.rows.push_back({std::to_string(k + 1),
                          triple(report.loads[k].tail<3>(), "{:.1f}, {:.1f}, {:.1f}"),
                          triple(report.loads[k].head<3>(), "{:.3g}, {:.3g}, {:.3g}"),
                          triple(1e3 * pair.truth->displacements[k].tail<3>(), kMillimetres),
                          triple(1e3 * pair.measured->displacements[k].tail<3>(), kMillimetres),
                          fmt::format("{:.1e}", pair.difference.loads->vector[k])});
  }
  return table;
}

ReportSection LoadSection(const StiffnessReport& report) {
  ReportSection section{.title = "Displacements under loads", .link = "Loads"};
  if (report.loads.empty()) return section;
  Table table{.caption = "Errors over all loads, in parts of the axis' largest displacement",
              .columns = {Text("of"), Text("")}};
  for (const char* name : {"x", "y", "z", "rx", "ry", "rz", "vector"}) {
    table.columns.push_back(Digits(name));
  }
  const std::vector<ShownPair> pairs = PairsOf(report);
  const ShownPair* main = nullptr;
  for (const ShownPair& pair : pairs) {
    if (!pair.difference.loads) continue;
    if (pair.pair == report.comparison.MainPair()) main = &pair;
    const LoadErrors& e = *pair.difference.loads;
    const auto add = [&](const char* what, const Vec6& axes, double vector) {
      std::vector<Cell> row = {pair.text(), what};
      AddCells(std::array{axes[3], axes[4], axes[5], axes[0], axes[1], axes[2], vector}, "{:.2e}",
               &row);
      table.rows.push_back(std::move(row));
    };
    add("mean", e.mean, e.vector_mean);
    add("largest", e.max, e.vector_max);
  }
  section.Note(report.loads_text + "; world axes, about the output's origin.", On::kAll);
  section.Add(std::move(table));
  if (main == nullptr) return section;
  const Vec6& most = main->difference.loads->scale;
  section.Note(
      fmt::format("Largest displacements: {:.4g}, {:.4g}, {:.4g} mm along x, y, z; {:.4g}, "
                  "{:.4g}, {:.4g} rad about them.",
                  1e3 * most[3], 1e3 * most[4], 1e3 * most[5], most[0], most[1], most[2]),
      On::kAll);
  for (int axis = 3; axis < 6; ++axis) section.Add(Drawing{ToSvg(LoadPlot(report, *main, axis))});
  section.Add(Drawing{ToSvg(ErrorPlot(*main))});
  section.Add(Fold{"Every load", {{DisplacementTable(report, *main)}}}, On::kPage);
  return section;
}

std::vector<ReportSection> SectionsOf(const StiffnessReport& report) {
  return {MatrixSection(report), PrintedSection(report), WeaknessSection(report),
          ElementSection(report), LoadSection(report)};
}

constexpr const char* kUnitsOfChecks =
    "Entries are compared in units of √(K<sub>ii</sub> K<sub>jj</sub>), which does not depend on "
    "the units of length and angle; displacements in units of the largest one along the axis, "
    "vectors in units of their length.";

std::string Cards(const StiffnessReport& report) {
  std::string html;
  for (const auto& [measured, truth] : {RolePair{&role::kSimulated, &role::kAnalytic},
                                        RolePair{&role::kReference, &role::kAnalytic}}) {
    const CheckResult* check =
        report.comparison.FindCheck(*measured, *truth, Metric::kStiffnessEntry);
    if (check == nullptr) continue;
    html += Card("Stiffness difference", fmt::format("{:.1e}", check->value),
                 Spaced(check->subject) + ", worst at " + check->channel +
                     (check->limit ? fmt::format(", limit {:.0e}", *check->limit) : ""));
  }
  if (const StiffnessWitness* shown = report.Shown()) {
    html += Card("Rank", std::to_string(shown->result.rank), "of K, 6 if the output is held");
    if (shown->result.C.allFinite()) {
      const WeakDirection weak = WeakestTranslation(shown->result.C);
      html += Card("Weakest against a force", fmt::format("{:.4g} N/m", weak.stiffness),
                   fmt::format("along ({:.2f}, {:.2f}, {:.2f})", weak.direction.x(),
                               weak.direction.y(), weak.direction.z()));
    }
  }
  if (const StiffnessWitness* shared = report.WithShares()) {
    const Contribution first = Contributions(shared->result).front();
    html += Card("Largest contributor", fmt::format("{:.1f} %", 100 * first.translation),
                 first.element + ", in the weakest direction");
  }
  return html;
}

}  // namespace

std::string ToHtml(const StiffnessReport& report) {
  const ResultView view = ViewOf(report);
  std::string about = Escape("Stiffness of " + report.output + " with all drives held, at " +
                             PoseText(report) + ".");
  if (!report.pose_note.empty()) about += " " + Escape(Sentence(report.pose_note));
  Page page;
  page.Add("Verdict", "Verdict", VerdictHtml(view, Cards(report), about));
  for (const ReportSection& section : SectionsOf(report)) page.Add(section);
  page.Add("Checks", "Checks", ChecksHtml(view, kUnitsOfChecks));
  page.Add("What could not be compared", "Gaps", GapsHtml(view));
  page.Add("Parameters", "Parameters", ParametersHtml(report.parameters, false));
  const Timing& timing = report.timing;
  const std::string times =
      timing.stated ? fmt::format("analytic {:.3f} s, reference {:.3f} s, simulation {:.3f} s",
                                  timing.analytic_s, timing.reference_s, timing.simulation_s)
                    : "";
  page.Add("Reproduce this run", "Reproduce",
           ReproduceHtml(view, report.command, times,
                         "Files beside this page: summary.json (every number), stiffness.csv, "
                         "loads.csv and contributions.csv (17 digits), model.xml (the compliant "
                         "MJCF as simulated)."));
  PageHead head = HeadOf(view);
  head.kicker = "mbverify stiffness report";
  head.footer = "Written by mbverify; all digits are in stiffness.csv, loads.csv and summary.json.";
  return page.Write(head);
}

std::string ToTable(const StiffnessReport& report, const TableOptions& options) {
  const ResultView view = ViewOf(report);
  TerminalText out(options);
  out.Head(view, report.scenario.empty() ? report.mechanism + ", stiffness" : report.title(),
           {fmt::format("{} at {}", report.output, PoseText(report)), report.pose_note});
  out.Checks(view);
  for (const ReportSection& section : SectionsOf(report)) out.Add(section);
  if (out.verbose()) out.Gaps(view);
  const Timing& timing = report.timing;
  out.Times({{role::kAnalytic.called, timing.analytic_s},
             {role::kReference.called, timing.reference_s},
             {role::kSimulated.called, timing.simulation_s}},
            timing.total_s);
  return out.text();
}

// summary.json

namespace {

using Json = nlohmann::ordered_json;

template <typename Values>
Json VectorJson(const Values& values) {
  Json json = Json::array();
  for (const double value : values) json.push_back(Number(value));
  return json;
}

Json MatrixJson(const Mat6& M) {
  Json json = Json::array();
  for (int i = 0; i < 6; ++i) json.push_back(VectorJson(M.row(i)));
  return json;
}

Json MetricsJson(const StiffnessReport& report) {
  Json all = Json::object();
  for (const ShownPair& shown : PairsOf(report)) {
    Json& json = all[shown.pair->name()];
    for (const auto& [metric, worst] : shown.pair->metrics) {
      json[RowOf(metric).json] = Number(worst.value);
    }
    json["K_difference"] = MatrixJson(shown.difference.K);
    json["C_difference"] = MatrixJson(shown.difference.C);
    if (!shown.difference.loads) continue;
    const LoadErrors& errors = *shown.difference.loads;
    json["loads"] = {
        {"axes", {"rx", "ry", "rz", "x", "y", "z"}}, {"largest", VectorJson(errors.scale)},
        {"error_mean", VectorJson(errors.mean)},     {"error_max", VectorJson(errors.max)},
        {"vector_mean", Number(errors.vector_mean)}, {"vector_max", Number(errors.vector_max)},
        {"worst_load", errors.worst_load + 1}};
  }
  return all;
}

Json WitnessesJson(const std::vector<StiffnessWitness>& witnesses, const ResultView& view) {
  Json all = Json::array();
  for (const StiffnessWitness& witness : witnesses) {
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
    json["contributions"] = Json::array();
    for (const Contribution& row : Contributions(result)) {
      json["contributions"].push_back({{"element", row.element},
                                       {"weakest_translation", Number(row.translation)},
                                       {"weakest_rotation", Number(row.rotation)},
                                       {"axes", VectorJson(row.axis)}});
    }
    all.push_back(std::move(json));
  }
  return all;
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
  json["pose"] = Json::object();
  for (const PoseEntry& entry : report.pose) json["pose"][entry.name] = Number(entry.value);
  json["analytic_model"] = report.model;
  json["loads"] = report.loads_text;
  json["indices"] = IndicesJson(report);
  if (const StiffnessWitness* shown = report.Shown())
    json["weakest"] = WeakestJson(shown->result.C);
  json["findings"] = FindingsJson(report.findings);
  AddSummaryEnd(view, &json);
  return Dump(json);
}

ResultView ShownStiffness::View() const { return ViewOf(report_); }
std::string ShownStiffness::Table(const TableOptions& options) const {
  return ToTable(report_, options);
}
std::string ShownStiffness::Json() const { return ToJson(report_); }

}  // namespace mbv
