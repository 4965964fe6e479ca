// The verdict table of a motion on the terminal.
#include <fmt/format.h>

#include <algorithm>

#include "report/html_report.h"
#include "report/plot_points.h"
#include "report/report.h"
#include "report/sections.h"
#include "report/sizing.h"
#include "report/source_model_report.h"
#include "report/terminal_text.h"

namespace mbv {
namespace {

class VerdictTableWriter {
 public:
  explicit VerdictTableWriter(const TableOptions& options) : out_(options) {}

  std::string Write(const Report& report) {
    const ResultView view = ViewOf(report);
    out_.Head(view, report.title(), About(report));
    out_.Checks(view);
    if (const Table pairs = PairMatrix(report.comparison); !pairs.rows.empty()) {
      out_.Line();
      out_.Line("  " + pairs.caption);
      out_.Add(pairs);
    }
    out_.Add(ReferenceTableSection(report, out_.verbose()));
    out_.Add(MotionTableSection(report, out_.verbose()));
    AddLines(SizingLines(report, out_.sizing() || out_.verbose()));
    out_.Add(PhaseSection(report));
    out_.Add(ContactSection(report));
    out_.Add(EventSection(report, out_.verbose()));
    out_.Add(SingularitySection(report, out_.verbose()));
    out_.Add(DriveSection(report));
    out_.Add(EngineSection(report));
    if (report.source_model != nullptr) {
      out_.Add(SourceModelSection(*report.source_model, out_.verbose()));
    }
    for (const ReportPart& part : report.parts) out_.Add(part.section);
    Energy(report.comparison);
    Tail(report);
    if (out_.verbose()) {
      out_.Gaps(view);
      Signals(report);
    }
    return out_.text();
  }

 private:
  // How it was simulated, and what drives it.
  static std::vector<std::string> About(const Report& report) {
    std::vector<std::string> about = {report.simulation, report.comparison.driving};
    if (report.start_window_s > 0.0) {
      about.push_back(fmt::format("start-up window: forces before {:g} s are not judged",
                                  report.start_window_s));
    }
    if (std::string rest = AtRestText(report.comparison); !rest.empty()) {
      about.push_back(std::move(rest));
    }
    return about;
  }

  void AddLines(const std::vector<std::string>& lines) {
    if (!lines.empty()) out_.Line();
    for (const std::string& line : lines) out_.Line("  " + line);
  }

  // Where the energy came from and went; zeros are left out.
  void Energy(const Comparison& comparison) {
    constexpr size_t kMostParts = 8;
    bool first = true;
    for (const WitnessMetrics& witness : comparison.witnesses) {
      if (!witness.energy) continue;
      const EnergyAudit& audit = *witness.energy;
      if (!IsEngine(witness.witness) && audit.text.empty()) continue;
      if (first) out_.Line();
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
      out_.Line(fmt::format("  energy of {}: work {}; change {}", witness.witness,
                            work.empty() ? "none" : work, stored.empty() ? "none" : stored));
      if (!audit.text.empty()) out_.Line("    " + out_.Painted(audit.text, Paint::kBad));
    }
  }

  void Tail(const Report& report) {
    const Timing& timing = report.timing;
    std::vector<std::pair<const char*, double>> parts = {
        {role::kAnalytic.called, timing.analytic_s},
        {role::kReference.called, timing.reference_s},
        {role::kSimulated.called, timing.simulation_s},
        {"foreign witnesses", timing.foreign_s},
        {"other engine", timing.stock_s},
        {"pictures", timing.render_s}};
    std::erase_if(parts, [](const auto& part) { return part.second <= 0.0; });
    std::string rate;
    if (timing.loop_s > 0.0 && timing.steps > 0) {
      rate = fmt::format("; {} {}, {:.0f}/s", timing.steps,
                         report.mode == "inverse" ? "samples" : "steps",
                         static_cast<double>(timing.steps) / timing.loop_s);
    }
    out_.Times(parts, timing.total_s, rate);
    const size_t skipped = report.comparison.not_compared.size();
    if (skipped > 0 && !out_.verbose()) {
      out_.Line(fmt::format("  {} quantit{} could not be compared (--verbose says why)", skipped,
                            skipped == 1 ? "y" : "ies"));
    }
  }

  void Signals(const Report& report) {
    out_.Line();
    out_.Line("  how to read the signals");
    for (const SignalSheet& sheet : report.sheets) {
      out_.Line(fmt::format("    {} [{}]", sheet.signal, sheet.unit));
      out_.Line(fmt::format("      acts on {}, exerted by {}", sheet.acts_on, sheet.exerted_by));
      out_.Line(fmt::format("      {}; positive: {}", sheet.frame, sheet.positive));
    }
  }

  TerminalText out_;
};

}  // namespace

std::string ToTable(const Report& report, const TableOptions& options) {
  return VerdictTableWriter(options).Write(report);
}

}  // namespace mbv
