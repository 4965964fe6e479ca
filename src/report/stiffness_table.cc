// The result of a stiffness run for a terminal.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/stiffness_measures.h"
#include "report/stiffness_report.h"

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
  explicit StiffnessTableWriter(const TableOptions& options) : options_(options) {}

  std::string VerdictWord(Verdict verdict) const {
    switch (verdict) {
      case Verdict::kAgree:
        return Painted("AGREE", "1;32");
      case Verdict::kDisagree:
        return Painted("DISAGREE", "1;31");
      case Verdict::kNotRun:
        return Painted("NOT RUN", "1;33");
    }
    return "?";
  }

  std::string Write(const StiffnessReport& report) {
    Head(report);
    if (const StiffnessWitness* shown = report.Shown()) Matrix(report, *shown);
    Checks(report.comparison);
    Indices(report);
    if (const StiffnessWitness* shown = report.Shown()) Weakest(shown->result);
    if (const StiffnessWitness* shared = report.WithShares()) Elements(*shared);
    Loads(report);
    Printed(report);
    if (options_.verbose) Gaps(report.comparison);
    Tail(report.timing);
    return text_;
  }

 private:
  std::string Painted(const std::string& text, const char* code) const {
    return options_.color ? fmt::format("\x1b[{}m{}\x1b[0m", code, text) : text;
  }
  std::string Faint(const std::string& text) const { return Painted(text, "2"); }
  void Line(const std::string& text = "") { text_ += text + "\n"; }

  void Head(const StiffnessReport& report) {
    const std::string title =
        report.mechanism + (report.scenario.empty() ? ", stiffness" : " / " + report.scenario);
    Line(fmt::format("{}: {}", Painted(title, "1"), VerdictWord(report.comparison.verdict)));
    if (!report.description.empty()) Line("  " + report.description);
    Line(fmt::format("  {} at {}", report.output, PoseText(report)));
    if (!report.pose_note.empty()) Line("  " + report.pose_note);
    Line("  " + report.comparison.reason);
    const Attribution& attribution = report.comparison.attribution;
    if (!attribution.text.empty()) Line("  " + attribution.text);
    for (const Finding& finding : report.findings.findings()) Line("  " + ToText(finding));
  }

  void Matrix(const StiffnessReport& report, const StiffnessWitness& witness) {
    Line();
    Line(
        fmt::format("  K ({}{}), rank {}: [m; f] = K [rotation; displacement] of {}'s origin, "
                    "world axes, drives held",
                    witness.name,
                    witness.name == "analytic" && !report.model.empty() ? ", " + report.model : "",
                    witness.result.rank, report.output));
    std::string head = fmt::format("  {:<12}", "");
    for (int j = 0; j < 6; ++j) {
      head += fmt::format("{:>14}", std::string(AxisName(j)) + (j < 3 ? " [1/rad]" : " [1/m]"));
    }
    Line(Faint(head));
    for (int i = 0; i < 6; ++i) {
      std::string line =
          fmt::format("  {:<12}", std::string(kWrenchNames[i]) + (i < 3 ? " [N m]" : " [N]"));
      for (int j = 0; j < 6; ++j) line += fmt::format("{:>14.6g}", witness.result.K(i, j));
      Line(line);
    }
  }

  void Checks(const StiffnessComparison& comparison) {
    if (comparison.checks.empty()) return;
    Line();
    Line(Faint(
        fmt::format("  {:<34}{:>12}{:>11}         {}", "check", "value", "limit", "worst at")));
    std::string subject;
    for (const StiffnessCheck& check : comparison.checks) {
      if (check.subject != subject) {
        subject = check.subject;
        std::string title = subject;
        std::replace(title.begin(), title.end(), '_', ' ');
        Line("  " + title);
      }
      const std::string limit = check.limit ? fmt::format("{:.1e}", *check.limit) : "off";
      const std::string word = !check.limit ? Faint("-   ")
                               : check.pass ? Painted("ok  ", "1;32")
                                            : Painted("FAIL", "1;31");
      std::string line =
          fmt::format("    {:<32}{:>12.2e}{:>11}   {}  {}", RowOf(check.metric).title, check.value,
                      limit, word, check.where);
      while (line.back() == ' ') line.pop_back();
      Line(line);
    }
  }

  void Indices(const StiffnessReport& report) {
    if (report.indices.empty()) return;
    Line();
    std::string head = fmt::format("  {:<20}", "index");
    for (const StiffnessWitness& witness : report.witnesses) {
      if (witness.ran()) head += fmt::format("{:>14}", witness.name);
    }
    Line(Faint(head + "  unit"));
    for (const IndexRow& row : report.indices) {
      std::string line = fmt::format("  {:<20}", row.name);
      for (size_t w = 0; w < row.values.size(); ++w) {
        if (report.witnesses[w].ran()) line += fmt::format("{:>14.6g}", row.values[w]);
      }
      Line(line + fmt::format("  {:<8} {}", row.unit, Faint(row.meaning)));
    }
  }

  void Weakest(const StiffnessResult& result) {
    if (!result.C.allFinite()) return;
    const WeakDirection shift = WeakestTranslation(result.C), turn = WeakestRotation(result.C);
    const WeakScrew screw = WeakestScrew(result.C);
    Line();
    Line(fmt::format("  weakest against a force:  {:.5g} N/m along {}", shift.stiffness,
                     Vector(shift.direction)));
    Line(fmt::format("  weakest against a moment: {:.5g} N m/rad about {}", turn.stiffness,
                     Vector(turn.direction)));
    Line(
        fmt::format("  weakest screw: {:.5g} N/m with rotations times L = {:.4g} m: about {} "
                    "through {} m from the origin,",
                    screw.stiffness, screw.length_m, Vector(screw.axis), Vector(screw.point)));
    Line(fmt::format("    pitch {:.4g} m/rad", screw.pitch_m));
  }

  void Elements(const StiffnessWitness& witness) {
    const std::vector<Contribution> rows = Contributions(witness.result);
    size_t width = 10;
    for (const Contribution& row : rows) width = std::max(width, row.element.size() + 2);
    Line();
    Line(fmt::format("  compliance caused by each element, percent ({})", witness.name));
    std::string head = fmt::format("  {:<{}}{:>10}{:>10}", "element", width, "weakest", "weakest");
    for (int i = 0; i < 6; ++i) head += fmt::format("{:>8}", AxisName(i));
    Line(Faint(head));
    Line(Faint(fmt::format("  {:<{}}{:>10}{:>10}", "", width, "force", "moment")));
    for (const Contribution& row : rows) {
      std::string line = fmt::format("  {:<{}}{:>10.2f}{:>10.2f}", row.element, width,
                                     100 * row.translation, 100 * row.rotation);
      for (int i = 0; i < 6; ++i) line += fmt::format("{:>8.2f}", 100 * row.axis[i]);
      Line(line);
    }
  }

  void Loads(const StiffnessReport& report) {
    for (const StiffnessPair& pair : report.comparison.pairs) LoadLines(report, pair);
  }

  void LoadLines(const StiffnessReport& report, const StiffnessPair& pair) {
    if (!pair.loads) return;
    const LoadErrors& e = *pair.loads;
    Line();
    Line(fmt::format("  {} against {} under {}", pair.measured, pair.truth, report.loads_text));
    Line(Faint(fmt::format("  {:<26}{:>12}{:>12}{:>12}{:>12}", "", "x", "y", "z", "vector")));
    Line(fmt::format("  {:<26}{:>12.4g}{:>12.4g}{:>12.4g}", "largest displacement [mm]",
                     1e3 * e.scale[3], 1e3 * e.scale[4], 1e3 * e.scale[5]));
    Line(fmt::format("  {:<26}{:>12.2e}{:>12.2e}{:>12.2e}{:>12.2e}", "error, mean", e.mean[3],
                     e.mean[4], e.mean[5], e.vector_mean));
    Line(fmt::format("  {:<26}{:>12.2e}{:>12.2e}{:>12.2e}{:>12.2e}", "error, largest", e.max[3],
                     e.max[4], e.max[5], e.vector_max));
  }

  // Stated, never judged.
  void Printed(const StiffnessReport& report) {
    for (const StiffnessPair& pair : report.printed_pairs) {
      Line();
      if (!pair.compared) {
        Line("  the paper's own model: " + pair.reason);
        continue;
      }
      const WorstEntry& K = pair.metrics.at(StiffnessMetric::kStiffnessEntry);
      Line(
          fmt::format("  the paper's own model differs from {} by {:.3g} % of K (worst: {}); not "
                      "judged",
                      pair.truth, 100 * K.value, K.where));
      LoadLines(report, pair);
    }
  }

  void Gaps(const StiffnessComparison& comparison) {
    if (comparison.not_compared.empty()) return;
    Line();
    Line("  not compared");
    for (const NotCompared& item : comparison.not_compared) {
      Line(fmt::format("    {}: {}", item.what, item.why));
    }
  }

  void Tail(const Timing& timing) {
    Line();
    Line(
        fmt::format("  time: analytic {:.3f} s, reference {:.3f} s, simulation {:.3f} s, all "
                    "{:.3f} s",
                    timing.analytic_s, timing.reference_s, timing.simulation_s, timing.total_s));
  }

  const TableOptions& options_;
  std::string text_;
};

}  // namespace

std::string VerdictLine(const StiffnessReport& report, const TableOptions& options) {
  const StiffnessComparison& comparison = report.comparison;
  std::string line = fmt::format("{} / {}: {}", report.mechanism, report.scenario,
                                 StiffnessTableWriter(options).VerdictWord(comparison.verdict));
  const StiffnessPair* pair = comparison.MainPair();
  if (pair != nullptr && comparison.verdict != Verdict::kNotRun) {
    const StiffnessCheck* check = comparison.FindCheck(pair->name() + ".stiffness_entry");
    line += fmt::format("  K {} vs {} {:.1e}", pair->measured, pair->truth, check->value);
    if (check->limit) line += fmt::format(" (limit {:.1e})", *check->limit);
  }
  if (comparison.verdict != Verdict::kAgree) line += "  " + comparison.reason;
  return line + "\n";
}

std::string ToTable(const StiffnessReport& report, const TableOptions& options) {
  return StiffnessTableWriter(options).Write(report);
}

}  // namespace mbv
