// The verdict table for people.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/reference_table.h"
#include "report/report.h"

namespace mbv {
namespace {

enum class Paint { kPlain, kGood, kBad, kDoubt, kTitle, kFaint };

class VerdictTableWriter {
 public:
  explicit VerdictTableWriter(const TableOptions& options) : options_(options) {}

  std::string VerdictWord(Verdict verdict) const {
    switch (verdict) {
      case Verdict::kAgree:
        return Painted("AGREE", Paint::kGood);
      case Verdict::kDisagree:
        return Painted("DISAGREE", Paint::kBad);
      case Verdict::kNotRun:
        return Painted("NOT RUN", Paint::kDoubt);
    }
    return "?";
  }

  std::string Write(const Report& report) {
    Head(report);
    Checks(report.comparison);
    ReferenceTable(report.comparison);
    if (const PairComparison* pair = MainPair(report.comparison)) Drives(*pair);
    Engine(report);
    Energy(report.comparison);
    Tail(report);
    if (options_.verbose) Details(report);
    return text_;
  }

 private:
  std::string Painted(const std::string& text, Paint paint) const {
    if (!options_.color || paint == Paint::kPlain) return text;
    static constexpr const char* kCodes[] = {"0", "1;32", "1;31", "1;33", "1", "2"};
    return fmt::format("\x1b[{}m{}\x1b[0m", kCodes[static_cast<int>(paint)], text);
  }

  void Line(const std::string& text = "") { text_ += text + "\n"; }

  void Head(const Report& report) {
    Line(fmt::format("{}: {}", Painted(report.mechanism + " / " + report.scenario, Paint::kTitle),
                     VerdictWord(report.comparison.verdict)));
    if (!report.description.empty()) Line("  " + report.description);
    Line("  " + report.simulation);
    if (!report.comparison.driving.empty()) Line("  " + report.comparison.driving);
    if (report.start_window_s > 0.0) {
      Line(fmt::format("  start-up window: forces before {:g} s are not judged",
                       report.start_window_s));
    }
    Line("  " + report.comparison.reason);
    for (const std::string& text : report.comparison.reservations) {
      Line("  " + Painted("reservation", Paint::kDoubt) + ": " + text);
    }
    const Attribution& attribution = report.comparison.attribution;
    if (!attribution.text.empty()) Line("  " + attribution.text);
    for (const Finding& finding : report.findings.findings()) Line("  " + ToText(finding));
  }

  void Checks(const Comparison& comparison) {
    if (comparison.checks.empty()) return;
    Line();
    Line(Painted(
        fmt::format("  {:<28}{:>12}{:>11}         {}", "check", "value", "limit", "worst at"),
        Paint::kFaint));
    for (size_t first = 0; first < comparison.checks.size();) {
      size_t last = first;
      while (last < comparison.checks.size() &&
             comparison.checks[last].subject == comparison.checks[first].subject) {
        ++last;
      }
      Subject({comparison.checks.begin() + static_cast<std::ptrdiff_t>(first),
               comparison.checks.begin() + static_cast<std::ptrdiff_t>(last)});
      first = last;
    }
  }

  // Checks of one pair or witness; without --verbose, those that pass and are of less interest are
  // counted only.
  void Subject(const std::vector<CheckResult>& checks) {
    Line("  " + TitleOf(checks.front().subject));
    size_t folded = 0;
    for (const CheckResult& check : checks) {
      if (!options_.verbose && check.limit && check.pass && check.blind.empty() && !IsKey(check)) {
        ++folded;
      } else {
        Line(CheckLine(check));
      }
    }
    if (folded > 0) {
      Line(Painted(fmt::format("    {} {}within limits", folded,
                               folded == checks.size() ? "checks " : "more "),
                   Paint::kFaint));
    }
  }

  static bool IsKey(const CheckResult& check) {
    const bool simulated = check.subject.starts_with("simulated");
    switch (check.metric) {
      case Metric::kForceNrmse:
      case Metric::kTableTube:
        return true;
      case Metric::kForceMax:
      case Metric::kForceOwn:
      case Metric::kPoseM:
      case Metric::kPoseRad:
        return check.subject == "simulated_vs_analytic";
      case Metric::kCommandM:
      case Metric::kCommandRad:
      case Metric::kCommandVelocity:
      case Metric::kCommandAcceleration:
      case Metric::kClosureM:
      case Metric::kPower:
        return simulated;
      case Metric::kPositionM:
      case Metric::kPositionRad:
      case Metric::kVelocity:
      case Metric::kAcceleration:
      case Metric::kReaction:
      case Metric::kReactionOwn:
      case Metric::kBaseForce:
      case Metric::kClosureRad:
      case Metric::kDerivatives:
        return false;
      case Metric::kEnergy:
        return simulated;
    }
    return true;
  }

  static std::string TitleOf(std::string subject) {
    std::replace(subject.begin(), subject.end(), '_', ' ');
    return subject;
  }

  std::string CheckLine(const CheckResult& check) const {
    const MetricRow& row = RowOf(check.metric);
    const std::string unit = *row.unit == '\0' ? "" : fmt::format(" [{}]", row.unit);
    const std::string limit = check.limit ? fmt::format("{:.1e}", *check.limit) : "off";
    const std::string word = !check.limit           ? Painted("-   ", Paint::kFaint)
                             : !check.pass          ? Painted("FAIL", Paint::kBad)
                             : !check.blind.empty() ? Painted("void", Paint::kDoubt)
                             : check.follows        ? Painted("held", Paint::kFaint)
                                                    : Painted("ok  ", Paint::kGood);
    std::string line =
        fmt::format("    {:<26}{:>12.2e}{:>11}   {}  ", row.title + unit, check.value, limit, word);
    if (!check.channel.empty()) line += fmt::format("{}, {:.4g} s", check.channel, check.time_s);
    if (check.floored) line += " (floored)";
    if (!check.blind.empty()) line += " (" + check.blind + ")";
    if (check.stated_limit) {
      line += fmt::format(" (limit by {}, stated {:.1e})", check.limit_by, *check.stated_limit);
    }
    while (line.back() == ' ') line.pop_back();
    return line;
  }

  void ReferenceTable(const Comparison& comparison) {
    const std::vector<std::string> lines = ReferenceTableLines(comparison, options_.verbose);
    if (!lines.empty()) Line();
    for (const std::string& line : lines) Line("  " + line);
  }

  void Drives(const PairComparison& pair) {
    if (pair.drives.empty()) return;
    bool floored = false;
    size_t width = 12;
    for (const DriveMetrics& drive : pair.drives) width = std::max(width, drive.drive.size());
    Line();
    Line(Painted(
        fmt::format("  {:<{}}{:>16}{:>12}{:>16}{:>10}{:>9}", "drive (" + TitleOf(pair.name()) + ")",
                    std::max(width, size_t{33}), "RMS force", "NRMSE", "max error", "at", "digits"),
        Paint::kFaint));
    for (const DriveMetrics& drive : pair.drives) {
      floored = floored || drive.floored;
      Line(fmt::format("  {:<{}}{:>16}{:>12.2e}{:>16}{:>10}{:>9.1f}", drive.drive,
                       std::max(width, size_t{33}),
                       fmt::format("{:.6g} {}", drive.rms_truth, drive.unit), drive.nrmse,
                       fmt::format("{:.2e} {}", drive.max_error, drive.unit),
                       fmt::format("{:.4g} s", drive.time_s), drive.digits) +
           (drive.floored ? "  floored" : ""));
    }
    if (floored) {
      Line(
          Painted("  floored: relative to 0.1 % of what the drive carries, which is more than its "
                  "own force",
                  Paint::kFaint));
    }
  }

  void Engine(const Report& report) {
    if (!report.engine_comparison) return;
    const EngineComparison& engine = *report.engine_comparison;
    Line();
    const std::string later = fmt::format("from {:g} s", engine.later_s);
    Line(Painted(fmt::format("  {:<44}{:>12}{:>12}{:>12}",
                             "the simulator's own error (against " + engine.truth + ")",
                             "force, RMS", later, "loop gap"),
                 Paint::kFaint));
    for (const EngineError& e : engine.engines) {
      const std::string name = EngineComparison::NameOf(e.engine);
      if (!e.failure.empty()) {
        Line(fmt::format("    {}: no result: {}", name, e.failure));
        continue;
      }
      Line(fmt::format("    {:<42}{:>12.2e}{:>12.2e}{:>12}", name, e.force_nrmse,
                       e.force_nrmse_later, fmt::format("{:.2e} m", e.closure_max_m)));
    }
  }

  // Where the energy came from and went; zeros are left out.
  void Energy(const Comparison& comparison) {
    constexpr size_t kMostParts = 8;
    bool first = true;
    for (const WitnessMetrics& witness : comparison.witnesses) {
      if (!witness.energy) continue;
      const EnergyAudit& audit = *witness.energy;
      if (witness.witness != "simulated" && audit.text.empty()) continue;
      if (first) Line();
      first = false;
      std::string work, stored;
      size_t parts = 0;
      for (const EnergyPart& part : audit.parts) {
        if (part.most_J == 0.0) continue;
        if (!part.stored && ++parts > kMostParts) continue;
        std::string& text = part.stored ? stored : work;
        text += fmt::format("{}{} {:.4g} J", text.empty() ? "" : ", ", part.name, part.end_J);
      }
      if (parts > kMostParts) work += fmt::format(" and {} more", parts - kMostParts);
      Line(fmt::format("  energy of {}: work {}; change {}", witness.witness,
                       work.empty() ? "none" : work, stored.empty() ? "none" : stored));
      if (!audit.text.empty()) Line("    " + Painted(audit.text, Paint::kBad));
    }
  }

  void Tail(const Report& report) {
    const Timing& timing = report.timing;
    Line();
    std::string line = "  time:";
    for (const auto& [what, seconds] :
         {std::pair{"analytic", timing.analytic_s}, std::pair{"reference", timing.reference_s},
          std::pair{"simulation", timing.simulation_s}, std::pair{"other engine", timing.stock_s},
          std::pair{"pictures", timing.render_s}}) {
      if (seconds > 0.0) line += fmt::format(" {} {:.3f} s,", what, seconds);
    }
    line += fmt::format(" all {:.3f} s", timing.total_s);
    if (timing.loop_s > 0.0 && timing.steps > 0) {
      line += fmt::format("; {} {}, {:.0f}/s", timing.steps,
                          report.mode == "inverse" ? "samples" : "steps",
                          static_cast<double>(timing.steps) / timing.loop_s);
    }
    Line(line);
    const size_t skipped = report.comparison.not_compared.size();
    if (skipped > 0 && !options_.verbose) {
      Line(fmt::format("  {} quantit{} could not be compared (--verbose says why)", skipped,
                       skipped == 1 ? "y" : "ies"));
    }
  }

  void Details(const Report& report) {
    if (!report.comparison.not_compared.empty()) {
      Line();
      Line("  not compared");
      for (const NotCompared& item : report.comparison.not_compared) {
        Line(fmt::format("    {}: {}", item.what, item.why));
      }
    }
    Line();
    Line("  how to read the signals");
    for (const SignalSheet& sheet : report.sheets) {
      Line(fmt::format("    {} [{}]", sheet.signal, sheet.unit));
      Line(fmt::format("      acts on {}, exerted by {}", sheet.acts_on, sheet.exerted_by));
      Line(fmt::format("      {}; positive: {}", sheet.frame, sheet.positive));
    }
  }

  const TableOptions& options_;
  std::string text_;
};

}  // namespace

std::string VerdictLine(const Report& report, const TableOptions& options) {
  std::string line =
      fmt::format("{} / {}: {}", report.mechanism, report.scenario,
                  VerdictTableWriter(options).VerdictWord(report.comparison.verdict));
  const PairComparison* pair = MainPair(report.comparison);
  const CheckResult* check =
      pair == nullptr ? nullptr : report.comparison.FindCheck(pair->name() + ".force_nrmse");
  if (check != nullptr && report.comparison.verdict != Verdict::kNotRun) {
    line += fmt::format("  {} vs {} {:.1e}", pair->measured, pair->truth, check->value);
    if (check->limit) line += fmt::format(" (limit {:.1e})", *check->limit);
  }
  if (check != nullptr && check->floored) line += " floored";
  if (report.comparison.verdict != Verdict::kAgree) line += "  " + report.comparison.reason;
  for (const std::string& text : report.comparison.reservations) line += "; reservation: " + text;
  return line + "\n";
}

std::string ToTable(const Report& report, const TableOptions& options) {
  return VerdictTableWriter(options).Write(report);
}

}  // namespace mbv
