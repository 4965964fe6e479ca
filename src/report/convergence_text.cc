#include <fmt/format.h>

#include <cmath>

#include "report/convergence_report.h"
#include "report/number_text.h"

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
  text += fmt::format("  {:>10}{:>12}{:>9}{:>9}{:>10}{:>10}{:>10}{:>7}{:>10}{:>10}\n", "step s",
                      "constant s", "steps", "cpu s", "smooth", "breaks", "change", "order",
                      "pose m", "gap m");
  for (size_t i = 0; i < series.points.size(); ++i) {
    const ConvergencePoint& p = series.points[i];
    text += fmt::format("  {:>10.4g}{:>12.4g}", p.step_s, p.time_constant_s);
    text += p.failure.empty() ? fmt::format("{:>9}{:>9.3f}{:>10}{:>10}{:>10}{:>7}{:>10}{:>10}\n",
                                            p.steps, p.cpu_s, NumberCell(p.error.smooth),
                                            NumberCell(p.error.breaks), NumberCell(p.change.smooth),
                                            NumberCell(series.fit.pairwise[i], "{:.2f}"),
                                            NumberCell(p.pose_m), NumberCell(p.closure_m))
                              : "  no result\n";
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
    text += fmt::format("  {:<24}{:>20}{:>13}{:>19}\n", "drive", "RMS force", "uncertainty",
                        "from inverse mode");
    for (const ExtrapolatedDrive& d : e.drives) {
      text += fmt::format("  {:<24}{:>20}{:>13.1e}{:>19.1e}\n", d.drive,
                          fmt::format("{:.9g} {}", d.rms, d.unit), d.uncertainty, d.error);
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
