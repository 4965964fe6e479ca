// The result of a stiffness run for a terminal.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/stiffness_measures.h"
#include "report/stiffness_report.h"
#include "report/terminal_text.h"

namespace mbv {
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
    std::vector<TextColumn> columns = {{"", -12}};
    for (int j = 0; j < 6; ++j) {
      columns.push_back({std::string(AxisName(j)) + (j < 3 ? " [1/rad]" : " [1/m]"), 14});
    }
    const TextTable table("  ", columns);
    out_.Line(Faint(table.Head()));
    for (int i = 0; i < 6; ++i) {
      std::vector<std::string> row = {std::string(kWrenchNames[i]) + (i < 3 ? " [N m]" : " [N]")};
      for (int j = 0; j < 6; ++j) row.push_back(fmt::format("{:.6g}", witness.result.K(i, j)));
      out_.Line(table.Row(row));
    }
  }

  void Indices(const StiffnessReport& report) {
    if (report.indices.empty()) return;
    std::vector<TextColumn> columns = {{"index", -20}};
    for (const StiffnessWitness& witness : report.witnesses) {
      if (witness.ran()) columns.push_back({witness.name, 14});
    }
    columns.push_back({"  unit", 0});
    const TextTable table("  ", columns);
    out_.TableHead(table);
    for (const IndexRow& row : report.indices) {
      std::vector<std::string> cells = {row.name};
      for (size_t w = 0; w < row.values.size(); ++w) {
        if (report.witnesses[w].ran()) cells.push_back(fmt::format("{:.6g}", row.values[w]));
      }
      cells.push_back(fmt::format("  {:<8} {}", row.unit, Faint(row.meaning)));
      out_.Line(table.Row(cells));
    }
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
    size_t width = 10;
    for (const Contribution& row : rows) width = std::max(width, row.element.size() + 2);
    out_.Line();
    out_.Line(fmt::format("  compliance caused by each element, percent ({})", witness.name));
    std::vector<TextColumn> columns = {
        {"element", -static_cast<int>(width)}, {"weakest", 10}, {"weakest", 10}};
    for (int i = 0; i < 6; ++i) columns.push_back({AxisName(i), 8});
    const TextTable table("  ", columns);
    out_.Line(Faint(table.Head()));
    out_.Line(Faint(table.Row({"", "force", "moment"})));
    const auto percent = [](double share) { return fmt::format("{:.2f}", 100 * share); };
    for (const Contribution& row : rows) {
      std::vector<std::string> cells = {row.element, percent(row.translation),
                                        percent(row.rotation)};
      for (int i = 0; i < 6; ++i) cells.push_back(percent(row.axis[i]));
      out_.Line(table.Row(cells));
    }
  }

  void Loads(const StiffnessReport& report, const StiffnessPair& pair) {
    if (!pair.loads) return;
    const LoadErrors& e = *pair.loads;
    out_.Line();
    out_.Line(
        fmt::format("  {} against {} under {}", pair.measured, pair.truth, report.loads_text));
    const TextTable table("  ", {{"", -26}, {"x", 12}, {"y", 12}, {"z", 12}, {"vector", 12}});
    out_.Line(Faint(table.Head()));
    const auto row = [&](const char* title, const Vec6& axes, double vector) {
      std::vector<std::string> cells = {title};
      for (const double value : {axes[3], axes[4], axes[5], vector}) {
        cells.push_back(fmt::format("{:.2e}", value));
      }
      out_.Line(table.Row(cells));
    };
    std::vector<std::string> largest = {"largest displacement [mm]"};
    for (int i = 3; i < 6; ++i) largest.push_back(fmt::format("{:.4g}", 1e3 * e.scale[i]));
    out_.Line(table.Row(largest));
    row("error, mean", e.mean, e.vector_mean);
    row("error, largest", e.max, e.vector_max);
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

  [[nodiscard]] std::string Faint(const std::string& text) const {
    return out_.Painted(text, Paint::kFaint);
  }

  TerminalText out_;
};

}  // namespace

std::string ToTable(const StiffnessReport& report, const TableOptions& options) {
  return StiffnessTableWriter(options).Write(report);
}

}  // namespace mbv
