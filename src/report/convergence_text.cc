#include <fmt/format.h>

#include <cmath>

#include "report/convergence_report.h"
#include "report/number_text.h"
#include "report/text_table.h"

namespace mbv {
namespace {

const char* VerdictOf(const ConvergenceSeries& series) {
  if (series.verdict.finding || series.pose_verdict.finding) return "FINDING";
  return series.verdict.judged ? "ok" : "-";
}

std::string SeriesText(const ConvergenceSeries& series) {
  std::string text = fmt::format("\n{}: {}\n  {} (of the {})\n", series.title, VerdictOf(series),
                                 series.verdict.text, series.by_changes ? "changes" : "errors");
  if (!std::isnan(series.expected_pose.lowest)) {
    text += fmt::format("  {} (of the poses)\n", series.pose_verdict.text);
  }
  for (const std::string& note : series.notes) text += "  note: " + note + "\n";
  const TextTable table("  ", {{"step s", 10},
                               {"constant s", 12},
                               {"steps", 9},
                               {"cpu s", 9},
                               {"smooth", 10},
                               {"breaks", 10},
                               {"change", 10},
                               {"order", 7},
                               {"pose m", 10},
                               {"gap m", 10}});
  text += table.Head() + "\n";
  for (size_t i = 0; i < series.points.size(); ++i) {
    const ConvergencePoint& p = series.points[i];
    const std::string step = fmt::format("{:.4g}", p.step_s);
    const std::string constant = fmt::format("{:.4g}", p.time_constant_s);
    if (!p.failure.empty()) {
      text += table.Row({step, constant}) + "  no result\n";
      continue;
    }
    text += table.Row({step, constant, fmt::format("{}", p.steps), fmt::format("{:.3f}", p.cpu_s),
                       NumberCell(p.error.smooth), NumberCell(p.error.breaks),
                       NumberCell(p.change.smooth), NumberCell(series.fit.pairwise[i], "{:.2f}"),
                       NumberCell(p.pose_m), NumberCell(p.closure_m)}) +
            "\n";
  }
  return text;
}

std::string ExtrapolationText(const ForceExtrapolation& e) {
  std::string text = "\nforces at step zero: ";
  if (std::isnan(e.fine_s)) {
    text += "nothing to extrapolate, the finest run is taken\n";
  } else {
    text += fmt::format(
        "from steps {:g} s and {:g} s with order {:.2f} and safety factor {:g}: grid convergence "
        "index {:.1e} of the RMS force\n",
        e.coarse_s, e.fine_s, e.richardson.order, e.richardson.safety, e.index);
    const TextTable table(
        "  ", {{"drive", -24}, {"RMS force", 20}, {"uncertainty", 13}, {"from inverse mode", 19}});
    text += table.Head() + "\n";
    for (const ExtrapolatedDrive& d : e.drives) {
      text += table.Row({d.drive, fmt::format("{:.9g} {}", d.rms, d.unit),
                         fmt::format("{:.1e}", d.uncertainty), fmt::format("{:.1e}", d.error)}) +
              "\n";
    }
  }
  return text + fmt::format("  inverse mode: {:.1e} off (allowed {:.1e}): {}\n", e.error, e.allowed,
                            e.pass ? "ok" : "FINDING");
}

}  // namespace

std::string ToText(const ConvergenceReport& report) {
  std::string text = fmt::format(
      "{} / {}: {}\n"
      "  drive forces against inverse mode, RMS over the RMS force, every {:g} s; {} of {} samples "
      "are smooth,\n  the others follow the start or one of {} breaks within {:g} s\n",
      report.mechanism, report.scenario, report.finding() ? "FINDING" : "ORDERS AS EXPECTED",
      report.sample_s, report.smooth_samples, report.samples, report.breaks, report.window_s);
  for (const ConvergenceSeries& series : report.series) text += SeriesText(series);
  return text + ExtrapolationText(report.extrapolation);
}

}  // namespace mbv
