// A study for a terminal.

#include "features/study/study_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/json_text.h"
#include "base/text.h"
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

// summary.json of a study.

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kStudySummarySchema = "mbverify.study_summary/1";

Json RangeJson(const Interval& interval) {
  return {Number(interval.lower), Number(interval.upper)};
}

Json NumberList(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(Number(value));
  return list;
}

Json VariedJson(const Study& study, const std::vector<double>& varied) {
  Json json = Json::object();
  for (size_t k = 0; k < varied.size(); ++k) json[study.factors[k].name] = Number(varied[k]);
  return json;
}

Json SobolJson(const Study& study, const SobolResult& sobol) {
  Json list = Json::array();
  for (size_t k = 0; k < sobol.indices.size(); ++k) {
    const SobolIndex& index = sobol.indices[k];
    list.push_back({{"varied", study.factors[k].name},
                    {"first", Number(index.first)},
                    {"first_interval", RangeJson(index.first_interval)},
                    {"total", Number(index.total)},
                    {"total_interval", RangeJson(index.total_interval)}});
  }
  return {{"blocks", sobol.blocks},
          {"left_out", sobol.left_out},
          {"variance", Number(sobol.variance)},
          {"indices", std::move(list)}};
}

Json QuantityJson(const StudyReport& report, size_t k) {
  const Study& study = report.study;
  const QuantitySummary& q = report.summary.quantities[k];
  Json json = {{"name", q.name},
               {"nominal", Number(q.nominal)},
               {"points", q.count},
               {"missing", q.missing},
               {"mean", Number(q.mean)},
               {"standard_deviation", Number(q.deviation)},
               {"least", Number(q.least)},
               {"p5", Number(q.p5)},
               {"p50", Number(q.p50)},
               {"p95", Number(q.p95)},
               {"most", Number(q.most)},
               {"histogram",
                {{"from", Number(q.histogram.from)},
                 {"to", Number(q.histogram.to)},
                 {"counts", q.histogram.counts}}}};
  if (q.sobol) json["sobol"] = SobolJson(study, *q.sobol);
  for (const Swing& swing : q.swings) {
    json["one_at_a_time"].push_back({{"varied", study.factors[swing.factor].name},
                                     {"least", Number(swing.lowest)},
                                     {"most", Number(swing.highest)}});
  }
  json["worst"] = Json::array();
  for (size_t i = 0; i < q.worst.size(); ++i) {
    json["worst"].push_back({{"point", q.worst[i].point},
                             {"value", Number(q.worst[i].value)},
                             {"varied", VariedJson(study, q.worst[i].varied)},
                             {"command", report.worst_commands[k][i]}});
  }
  return json;
}

Json LimitJson(const Study& study, const LimitResult& result) {
  const StudyLimit& limit = result.limit;
  Json json = {{"quantity", study.quantities[limit.quantity].name}};
  if (limit.below) json["below"] = *limit.below;
  if (limit.above) json["above"] = *limit.above;
  json["allowed_share"] = limit.share;
  json["violations"] = result.violations;
  json["points"] = result.count;
  json["share"] = Number(result.share());
  json["interval"] = RangeJson(result.interval);
  json["pass"] = result.pass();
  return json;
}

Json BandJson(const StudyBand& band) {
  return {{"drive", band.drive},
          {"unit", band.unit},
          {"points", band.points},
          {"left_out", band.left_out},
          {"time_s", NumberList(band.time_s)},
          {"nominal", NumberList(band.nominal)},
          {"p5", NumberList(band.p5)},
          {"p50", NumberList(band.p50)},
          {"p95", NumberList(band.p95)}};
}

Json ValidationJson(const StudyReport& report) {
  const StudyValidationResult& validation = *report.validation;
  Json json = {{"table", validation.table},
               {"pass", validation.pass()},
               {"trouble", validation.trouble},
               {"coverage", report.study.validation->coverage},
               {"allowed_share", report.study.validation->share},
               {"u_num_from", validation.numerical},
               {"drives", Json::array()}};
  for (const DriveValidation& v : validation.drives) {
    json["drives"].push_back({{"drive", v.forces.drive},
                              {"unit", v.forces.unit},
                              {"pass", v.pass()},
                              {"samples", v.samples()},
                              {"outside", v.outside},
                              {"error_mean", Number(v.error_mean)},
                              {"error_rms", Number(v.error_rms)},
                              {"measured_rms", Number(v.measured_rms)},
                              {"u_num", Number(v.u_num)},
                              {"u_input", Number(v.u_input)},
                              {"u_data", Number(v.u_data)},
                              {"u_val", Number(v.level)},
                              {"largest", v.largest},
                              {"time_s", NumberList(v.forces.time_s)},
                              {"computed", NumberList(v.forces.computed)},
                              {"measured", NumberList(v.forces.measured)},
                              {"u_val_samples", NumberList(v.u_val)}});
  }
  return json;
}

Json FailureJson(const StudyReport& report) {
  Json json = {{"points", report.summary.failed}, {"reasons", Json::array()}};
  for (const auto& [reason, count] : report.summary.reasons) {
    json["reasons"].push_back({{"reason", reason}, {"points", count}});
  }
  json["first"] = Json::array();
  for (size_t k = 0; k < report.summary.first_failed.size(); ++k) {
    const PointRow& row = report.summary.first_failed[k];
    json["first"].push_back({{"point", row.point},
                             {"exit", row.exit_code},
                             {"reason", row.reason},
                             {"command", report.failed_commands[k]}});
  }
  return json;
}

// As of scenarios, for whoever reads summaries of both.
const char* VerdictWord(const StudyReport& report) {
  const int code = report.exit_code();
  return code == 0 ? "agree" : code == 1 ? "disagree" : "not_run";
}

std::string ReasonText(const StudyReport& report) {
  std::string text = internal::PointsText(report);
  for (const LimitResult& result : report.summary.limits) {
    if (result.pass()) continue;
    text += "; " + internal::LimitText(report, result) + ": " + internal::ShareText(result);
  }
  if (report.summary.disagreed > 0) text += "; " + internal::DisagreedText(report);
  if (!report.summary.few_missing()) text += "; " + internal::MissingText(report);
  if (report.validation && !report.validation->pass()) {
    text += "; not validated by " + report.validation->table;
  }
  return text;
}

// What decides the verdict, one row each: shares of points, or of samples, with what is allowed.
Json ChecksJson(const StudyReport& report) {
  Json checks = Json::array();
  const auto add = [&](const std::string& name, double share, double allowed, bool pass) {
    checks.push_back(
        {{"name", name}, {"value", Number(share)}, {"limit", Number(allowed)}, {"pass", pass}});
  };
  for (const LimitResult& result : report.summary.limits) {
    add(internal::LimitText(report, result), result.share(), result.limit.share, result.pass());
  }
  if (report.study.witnesses.size() > 1) {
    add("witnesses agree",
        static_cast<double>(report.summary.disagreed) / static_cast<double>(report.summary.points),
        0.0, report.summary.disagreed == 0);
  }
  if (report.study.missing) {
    add("points without a result",
        static_cast<double>(report.summary.failed) / static_cast<double>(report.summary.points),
        *report.study.missing, report.summary.few_missing());
  }
  if (!report.validation) return checks;
  for (const DriveValidation& v : report.validation->drives) {
    add("validation." + v.forces.drive,
        static_cast<double>(v.outside) / static_cast<double>(v.samples()), v.share, v.pass());
  }
  return checks;
}

Json DisagreedJson(const StudyReport& report) {
  Json json = {{"points", report.summary.disagreed}, {"first", Json::array()}};
  for (size_t k = 0; k < report.summary.first_disagreed.size(); ++k) {
    json["first"].push_back({{"point", report.summary.first_disagreed[k].point},
                             {"command", report.disagreed_commands[k]}});
  }
  return json;
}

}  // namespace

std::string ToJson(const StudyReport& report) {
  const Study& study = report.study;
  Json varied = Json::array(), quantities = Json::array(), limits = Json::array(),
       bands = Json::array(), witnesses = Json::array(), versions = Json::object();
  for (const Factor& factor : study.factors) {
    varied.push_back({{"name", factor.name},
                      {"sets", factor.key},
                      {"nominal", Number(factor.axis.nominal)},
                      {"moves", !Contains(report.idle, factor.name)}});
  }
  for (size_t k = 0; k < study.quantities.size(); ++k) {
    quantities.push_back(QuantityJson(report, k));
  }
  for (const LimitResult& result : report.summary.limits)
    limits.push_back(LimitJson(study, result));
  for (const StudyBand& band : report.bands) bands.push_back(BandJson(band));
  size_t pairs = 0;  // quantities that compare witnesses, and did
  for (size_t k = 0; k < study.quantities.size(); ++k) {
    pairs += study.quantities[k].of_pair && report.summary.quantities[k].count > 0 ? 1 : 0;
  }
  for (const std::string& name : study.witnesses) {
    witnesses.push_back({{"name", name}, {"ran", report.summary.any_value()}});
  }
  for (const auto& [name, version] : report.versions) versions[name] = version;
  Json json = {{"schema", kStudySummarySchema},
               {"study", study.name},
               {"scenario", study.scenario},
               {"description", study.description},
               {"verdict", VerdictWord(report)},
               {"judged", report.judged()},
               {"reason", ReasonText(report)},
               {"exit_code", report.exit_code()},
               {"design", internal::DesignWord(study.design.kind)},
               {"seed", study.design.seed},
               {"points", report.summary.points},
               {"witnesses", std::move(witnesses)},
               {"varied", std::move(varied)},
               {"limits", std::move(limits)},
               {"checks", ChecksJson(report)},
               {"quantities", std::move(quantities)},
               {"counts", {{"pairs_compared", pairs}}},
               {"disagreements", DisagreedJson(report)},
               {"failures", FailureJson(report)},
               {"force_bands", std::move(bands)},
               {"versions", std::move(versions)}};
  if (report.validation) json["validation"] = ValidationJson(report);
  return Dump(json);
}

}  // namespace mbv
