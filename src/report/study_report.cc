// A study for a terminal.
#include "report/study_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/text.h"
#include "report/number_text.h"
#include "report/study_words.h"
#include "report/text_table.h"

namespace mbv {
namespace internal {

const char* DesignWord(DesignKind kind) {
  switch (kind) {
    case DesignKind::kSobol:
      return "sobol";
    case DesignKind::kSaltelli:
      return "saltelli";
    case DesignKind::kLatinHypercube:
      return "latin_hypercube";
    case DesignKind::kGrid:
      return "grid";
    case DesignKind::kOneAtATime:
      return "one_at_a_time";
    case DesignKind::kList:
      return "list";
  }
  return "?";
}

std::string PointsText(const StudyReport& report) {
  const StudySummary& summary = report.summary;
  std::string text =
      fmt::format("{} points by {}", summary.points, DesignWord(report.study.design.kind));
  if (summary.failed > 0) text += fmt::format(", {} of them without a result", summary.failed);
  if (!report.idle.empty()) {
    text += fmt::format("; {} {} no quantity", Joined(report.idle),
                        report.idle.size() == 1 ? "moves" : "move");
  }
  return text;
}

std::string LimitText(const StudyReport& report, const LimitResult& result) {
  const std::string& name = report.study.quantities[result.limit.quantity].name;
  std::string text;
  if (result.limit.above) text += fmt::format("{:g} < ", *result.limit.above);
  text += name;
  if (result.limit.below) text += fmt::format(" < {:g}", *result.limit.below);
  return text;
}

std::string ShareText(const LimitResult& result) {
  std::string text = fmt::format("{} of {} points violate it ({:.3g} %", result.violations,
                                 result.count, 100.0 * result.share());
  if (!std::isnan(result.interval.upper)) {
    text += fmt::format("; 95 % interval {:.3g} … {:.3g} %", 100.0 * result.interval.lower,
                        100.0 * result.interval.upper);
  }
  return text + fmt::format("), {:g} % may", 100.0 * result.limit.share);
}

std::string MissingText(const StudyReport& report) {
  const StudySummary& summary = report.summary;
  return fmt::format(
      "{} of {} points have no result ({:.3g} %), {:g} % may", summary.failed, summary.points,
      100.0 * static_cast<double>(summary.failed) / static_cast<double>(summary.points),
      100.0 * *summary.missing);
}

std::string DisagreedText(const StudyReport& report) {
  return fmt::format("witnesses disagree at {} of {} points", report.summary.disagreed,
                     report.summary.points - report.summary.failed);
}

}  // namespace internal

namespace {

int WidthOf(const StudyReport& report) {
  size_t width = 8;
  for (const StudyQuantity& q : report.study.quantities) width = std::max(width, q.name.size());
  for (const Factor& factor : report.study.factors) width = std::max(width, factor.name.size());
  return -static_cast<int>(width);
}

std::string ValueTable(const StudyReport& report) {
  const TextTable table("  ", {{"quantity", WidthOf(report)},
                               {"nominal", 12},
                               {"least", 12},
                               {"5 %", 12},
                               {"median", 12},
                               {"95 %", 12},
                               {"most", 12}});
  std::string text = table.Head() + "\n";
  for (const QuantitySummary& q : report.summary.quantities) {
    std::vector<std::string> cells = {q.name};
    for (const double value : {q.nominal, q.least, q.p5, q.p50, q.p95, q.most}) {
      cells.push_back(NumberCell(value, "{:.6g}"));
    }
    text += table.Row(cells) + "\n";
  }
  return text;
}

std::string IndexTable(const StudyReport& report, const QuantitySummary& q) {
  const TextTable table("  ", {{"varied", WidthOf(report)},
                               {"first order", 12},
                               {"95 % interval", 20},
                               {"total", 12},
                               {"95 % interval", 20}});
  std::string text = fmt::format("\n  Sobol' indices of {}\n{}\n", q.name, table.Head());
  const auto interval = [](const Interval& i) {
    return std::isnan(i.lower) ? "-" : fmt::format("{:.3f} … {:.3f}", i.lower, i.upper);
  };
  for (size_t k = 0; k < q.sobol->indices.size(); ++k) {
    const SobolIndex& index = q.sobol->indices[k];
    text += table.Row({report.study.factors[k].name, NumberCell(index.first, "{:.3f}"),
                       interval(index.first_interval), NumberCell(index.total, "{:.3f}"),
                       interval(index.total_interval)}) +
            "\n";
  }
  return text;
}

std::string SwingTable(const StudyReport& report, const QuantitySummary& q) {
  const TextTable table("  ", {{"varied", WidthOf(report)}, {"least", 12}, {"most", 12}});
  std::string text = fmt::format("\n  {} with one number varied at a time, nominal {:.6g}\n{}\n",
                                 q.name, q.nominal, table.Head());
  for (const Swing& swing : q.swings) {
    text += table.Row({report.study.factors[swing.factor].name, NumberCell(swing.lowest, "{:.6g}"),
                       NumberCell(swing.highest, "{:.6g}")}) +
            "\n";
  }
  return text;
}

std::string ValidationLines(const StudyReport& report) {
  const StudyValidationResult& validation = *report.validation;
  if (!validation.trouble.empty()) return "\n  not validated: " + validation.trouble + "\n";
  const TextTable table("  ", {{"drive", WidthOf(report)},
                               {"RMS of E", 12},
                               {"u_num", 12},
                               {"u_input", 12},
                               {"u_D", 12},
                               {"u_val", 12},
                               {"outside", 14}});
  std::string text = fmt::format("\n  computed - measured (E) against {}, V&V 20\n{}\n",
                                 validation.table, table.Head());
  for (const DriveValidation& v : validation.drives) {
    std::vector<std::string> cells = {v.forces.drive};
    for (const double x : {v.error_rms, v.u_num, v.u_input, v.u_data, v.level}) {
      cells.push_back(NumberCell(x, "{:.4g}"));
    }
    cells.push_back(fmt::format("{} of {}", v.outside, v.samples()));
    text += table.Row(cells) + "\n";
  }
  for (const DriveValidation& v : validation.drives) {
    text += fmt::format(
        "  {} {}: validation level u_val = {:.3g} {} ({:.2g} % of the RMS force), mostly {}\n",
        v.pass() ? "within  " : "BEYOND  ", v.forces.drive, v.level, v.forces.unit,
        100.0 * v.level / v.measured_rms, v.largest);
  }
  return text;
}

// What the user will want to look at: what violates a limit, and what did not run.
std::string WorstLines(const StudyReport& report) {
  std::string text;
  for (const LimitResult& result : report.summary.limits) {
    if (result.violations == 0) continue;
    const QuantitySummary& q = report.summary.quantities[result.limit.quantity];
    if (q.worst.empty()) continue;
    text += fmt::format("\n  worst {}: {:.6g} at point {}\n    {}\n", q.name, q.worst[0].value,
                        q.worst[0].point, report.worst_commands[result.limit.quantity][0]);
  }
  for (size_t k = 0; k < report.summary.first_disagreed.size(); ++k) {
    text += fmt::format("\n  witnesses disagree at point {}\n    {}\n",
                        report.summary.first_disagreed[k].point, report.disagreed_commands[k]);
  }
  for (size_t k = 0; k < report.summary.first_failed.size(); ++k) {
    const PointRow& row = report.summary.first_failed[k];
    text += fmt::format("\n  point {} has no result: {}\n    {}\n", row.point, row.reason,
                        report.failed_commands[k]);
  }
  return text;
}

}  // namespace

std::string ToText(const StudyReport& report) {
  std::string text =
      fmt::format("study {}: {}\n\n", report.study.name, internal::PointsText(report));
  text += ValueTable(report);
  for (const QuantitySummary& q : report.summary.quantities) {
    if (q.sobol) text += IndexTable(report, q);
    if (!q.swings.empty()) text += SwingTable(report, q);
  }
  if (report.validation) text += ValidationLines(report);
  if (report.judged()) text += "\n";
  for (const LimitResult& result : report.summary.limits) {
    text += fmt::format("  {} {}: {}\n", result.pass() ? "kept    " : "VIOLATED",
                        internal::LimitText(report, result), internal::ShareText(result));
  }
  if (report.study.witnesses.size() > 1) {
    text += fmt::format("  {} {}\n", report.summary.disagreed == 0 ? "kept    " : "VIOLATED",
                        internal::DisagreedText(report));
  }
  if (report.study.missing) {
    text += fmt::format("  {} {}\n", report.summary.few_missing() ? "kept    " : "VIOLATED",
                        internal::MissingText(report));
  }
  return text + WorstLines(report);
}

}  // namespace mbv
