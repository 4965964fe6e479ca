// What a study found as sections for terminal and page; summary.json.

#include "features/study/study_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/files.h"
#include "base/json_text.h"
#include "base/text.h"
#include "plot/style.h"
#include "plot/svg.h"
#include "plot/svg_plot.h"
#include "report/page.h"

namespace mbv {

namespace {

// The key of the design in study files.
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

Cell Kept(bool kept) { return kept ? Cell("kept", Mark::kOk) : Cell("VIOLATED", Mark::kFail); }

std::string Six(double value) { return NumberOrDash(value, "{:.6g}"); }
std::string Count(std::uint64_t count) { return fmt::format("{}", count); }

void AddPlots(const std::vector<StudyPlot>& plots, StudySection of, ReportSection* section) {
  for (const StudyPlot& plot : plots) {
    if (plot.section == of) section->Add(Drawing{plot.svg});
  }
}

ReportSection Limits(const StudyReport& report) {
  ReportSection section{.title = "Limits", .link = "Limits"};
  Table table{.caption = "Limits", .columns = {Text("limit"), Text("verdict"), Text("points")}};
  for (const LimitResult& result : report.summary.limits) {
    table.rows.push_back({LimitText(report, result), Kept(result.pass()), ShareText(result)});
  }
  if (report.study.witnesses.size() > 1) {
    table.rows.push_back({"verdicts by the scenario's checks", Kept(report.summary.disagreed == 0),
                          DisagreedText(report)});
  }
  if (report.study.missing) {
    table.rows.push_back(
        {"points without a result", Kept(report.summary.few_missing()), MissingText(report)});
  }
  if (table.rows.empty()) return section;
  section.Add(std::move(table));
  section.Note(
      std::string(report.study.missing ? "" : "Points without a result violate every limit. ") +
      "The interval is Clopper and Pearson's, as of independent points.");
  return section;
}

// "normal" and "σ = 0.5 %", with the nominal value as the measure of what differs from it.
std::pair<std::string, std::string> DistributionTexts(const Axis& axis) {
  const double nominal = std::abs(axis.nominal);
  const auto percent = [&](double spread) {
    return nominal > 0.0 ? fmt::format(" ({:.3g} %)", 100.0 * spread / nominal) : "";
  };
  if (const auto* normal = std::get_if<Normal>(&axis.distribution)) {
    std::string text = fmt::format("σ = {:.4g}{}", normal->sigma, percent(normal->sigma));
    if (normal->mean != axis.nominal) text = fmt::format("mean {:.6g}, ", normal->mean) + text;
    return {"normal", text};
  }
  if (const auto* uniform = std::get_if<Uniform>(&axis.distribution)) {
    const double half = 0.5 * (uniform->upper - uniform->lower);
    return {"uniform", fmt::format("{:.6g} … {:.6g}{}", uniform->lower, uniform->upper,
                                   nominal > 0.0 ? " (±" + percent(half).substr(2) : "")};
  }
  constexpr size_t kMost = 6;
  std::vector<std::string> levels;
  for (const double value : std::get<Levels>(axis.distribution).values) {
    if (levels.size() == kMost) {
      levels.emplace_back("…");
      break;
    }
    levels.push_back(fmt::format("{:.6g}", value));
  }
  return {"levels", Joined(levels)};
}

// What was varied, and how much: the rest of the page is about that.
ReportSection Varied(const StudyReport& report) {
  const Study& study = report.study;
  ReportSection section{.title = "What is varied", .link = "Varied"};
  Table table{.caption = fmt::format("{} numbers of {}", study.factors.size(), study.scenario),
              .columns = {Text("number"), Digits("nominal"), Text("distribution"), Text("spread"),
                          Text("effect")}};
  for (const Factor& factor : study.factors) {
    const auto [kind, spread] = study.design.kind == DesignKind::kList
                                    ? std::pair<std::string, std::string>{"as listed", ""}
                                    : DistributionTexts(factor.axis);
    table.rows.push_back({factor.name, Six(factor.axis.nominal), kind, spread});
    if (report.idle.empty()) continue;
    table.rows.back().push_back(
        Contains(report.idle, factor.name) ? Cell("moves no quantity", Mark::kWarn) : Cell(""));
  }
  if (report.idle.empty()) table.columns.pop_back();
  section.Add(std::move(table), On::kPage);
  for (const Correlation& c : study.design.correlations) {
    section.Add(Paragraph{fmt::format("{} and {} go together: correlation {:g}",
                                      study.factors[c.first].name, study.factors[c.second].name,
                                      c.coefficient)},
                On::kPage);
  }
  return section;
}

ReportSection Quantities(const StudyReport& report) {
  ReportSection section{.title = "Quantities", .link = "Quantities"};
  Table table{
      .caption = "Quantities over all points",
      .columns = {Text("quantity"), Digits("nominal"), Digits("least"), Digits("5 %"),
                  Digits("median"), Digits("95 %"), Digits("most"), Digits("mean", On::kPage),
                  Digits("standard deviation", On::kPage), Digits("missing", On::kPage)}};
  for (const QuantitySummary& q : report.summary.quantities) {
    table.rows.push_back({q.name, Six(q.nominal), Six(q.least), Six(q.p5), Six(q.p50), Six(q.p95),
                          Six(q.most), Six(q.mean), Six(q.deviation), Count(q.missing)});
  }
  section.Add(std::move(table));
  return section;
}

// What the estimates leave open: intervals that are wide, and a part that is larger than the
// whole.
std::string ResolutionText(const StudyReport& report, const QuantitySummary& q) {
  constexpr double kCoarse = 0.2;  // of the variance: a main effect and none look alike
  constexpr double kShown = 5e-4;  // the table's last decimal
  double widest = 0.0;
  std::vector<std::string> larger;
  for (size_t k = 0; k < q.sobol->indices.size(); ++k) {
    const SobolIndex& index = q.sobol->indices[k];
    for (const Interval& i : {index.first_interval, index.total_interval}) {
      if (std::isfinite(i.upper)) widest = std::max(widest, i.upper - i.lower);
    }
    if (index.first > index.total + kShown) larger.push_back(report.study.factors[k].name);
  }
  std::string text;
  if (widest > kCoarse) {
    text = fmt::format(
        "{} blocks do not resolve the indices of {}: an interval is {:.2f} wide. Four times as "
        "many blocks make it half as wide.",
        q.sobol->blocks, q.name, widest);
  }
  if (!larger.empty()) {
    text += fmt::format(
        "{}First order above total ({}) is an error of the estimates: alone a number makes at most "
        "what it makes in all.",
        text.empty() ? "" : " ", Joined(larger));
  }
  return text;
}

ReportSection Indices(const StudyReport& report, const std::vector<StudyPlot>& plots) {
  ReportSection section{.title = "Sobol' indices", .link = "Indices"};
  AddPlots(plots, StudySection::kIndices, &section);
  const auto interval = [](const Interval& i) {
    return std::isnan(i.lower) ? "–" : fmt::format("{:.3f} … {:.3f}", i.lower, i.upper);
  };
  for (const QuantitySummary& q : report.summary.quantities) {
    if (!q.sobol) continue;
    Table table{.caption = fmt::format("Sobol' indices of {}: {} blocks, {} left out", q.name,
                                       q.sobol->blocks, q.sobol->left_out),
                .columns = {Text("varied"), Digits("first order"), Digits("95 %"), Digits("total"),
                            Digits("95 %")}};
    for (size_t k = 0; k < q.sobol->indices.size(); ++k) {
      const SobolIndex& index = q.sobol->indices[k];
      table.rows.push_back({report.study.factors[k].name, NumberOrDash(index.first, "{:.3f}"),
                            interval(index.first_interval), NumberOrDash(index.total, "{:.3f}"),
                            interval(index.total_interval)});
    }
    section.Add(std::move(table));
    const std::string resolution = ResolutionText(report, q);
    if (!resolution.empty()) section.Add(Paragraph{resolution});
  }
  if (section.blocks.empty()) return section;
  section.Note(
      "Shares of the variance: first order of the number alone, total with all that it does "
      "together with others. Saltelli's and Jansen's estimators; intervals by how far independent "
      "replicates of the design lie apart.");
  return section;
}

ReportSection OneAtATime(const StudyReport& report, const std::vector<StudyPlot>& plots) {
  ReportSection section{.title = "One number at a time", .link = "Tornado"};
  AddPlots(plots, StudySection::kTornado, &section);
  for (const QuantitySummary& q : report.summary.quantities) {
    Table table{.caption = fmt::format("{} with one number varied at a time, nominal {:.6g}",
                                       q.name, q.nominal),
                .columns = {Text("varied alone"), Digits("least"), Digits("most")}};
    for (const Swing& swing : q.swings) {
      table.rows.push_back(
          {report.study.factors[swing.factor].name, Six(swing.lowest), Six(swing.highest)});
    }
    section.Add(std::move(table));
  }
  return section;
}

ReportSection Validation(const StudyReport& report, const std::vector<StudyPlot>& plots) {
  ReportSection section{.title = "Validation", .link = "Validation"};
  if (!report.validation) return section;
  const StudyValidationResult& validation = *report.validation;
  if (!validation.trouble.empty()) {
    section.Add(Paragraph{"not validated: " + validation.trouble});
    return section;
  }
  Table table{
      .caption = "Drive forces against " + validation.table + ", V&V 20: E = computed − measured",
      .columns = {Text("drive"), Text("verdict"), Digits("mean of E", On::kPage),
                  Digits("RMS of E"), Digits("u_num"), Digits("u_input"), Digits("u_D"),
                  Digits("u_val"), Digits("of RMS measured"), Digits("outside"),
                  Text("largest part")}};
  const auto four = [](double value) { return NumberOrDash(value, "{:.4g}"); };
  for (const DriveValidation& v : validation.drives) {
    table.rows.push_back({fmt::format("{} [{}]", v.forces.drive, v.forces.unit),
                          v.pass() ? Cell("within", Mark::kOk) : Cell("BEYOND", Mark::kFail),
                          four(v.error_mean), four(v.error_rms), four(v.u_num), four(v.u_input),
                          four(v.u_data), four(v.level),
                          fmt::format("{:.2g} %", 100.0 * v.level / v.measured_rms),
                          fmt::format("{} of {}", v.outside, v.samples()), v.largest});
  }
  section.Add(std::move(table));
  section.Note(fmt::format(
      "E = computed − measured; standard uncertainties, RMS over the samples: u_num of the "
      "scheme ({}), u_input of the varied numbers, u_D of the table; u_val is their root sum of "
      "squares, the validation level: a smaller error of the model cannot be seen here. A sample "
      "is outside where |E| > {:g} u_val; {:g} % of them may be [ASME V&V 20-2009].",
      validation.numerical, report.study.validation->coverage,
      100.0 * report.study.validation->share));
  AddPlots(plots, StudySection::kValidation, &section);
  return section;
}

ReportSection Bands(const StudyReport& report, const std::vector<StudyPlot>& plots) {
  ReportSection section{.title = "Drive forces over time", .link = "Bands"};
  AddPlots(plots, StudySection::kBands, &section);
  if (section.blocks.empty()) return section;
  section.Note(
      fmt::format("{} at each time of {} points ({} left out){}.",
                  report.bands[0].percentiles() ? "Percentiles" : "Least and most",
                  report.bands[0].points, report.bands[0].left_out,
                  report.bands[0].percentiles()
                      ? ""
                      : fmt::format("; percentiles from {} points on", kFewestForPercentiles)));
  return section;
}

ReportSection Histograms(const std::vector<StudyPlot>& plots) {
  ReportSection section{.title = "Distributions", .link = "Histograms"};
  AddPlots(plots, StudySection::kHistograms, &section);
  return section;
}

ReportSection Scatter(const StudyReport& report, const std::vector<StudyPlot>& plots) {
  ReportSection section{.title = "Point by point", .link = "Scatter"};
  AddPlots(plots, StudySection::kScatter, &section);
  if (section.blocks.empty()) return section;
  section.Note(fmt::format("{} of {} points; the first 8 varied numbers and 6 quantities.",
                           report.shown.size(), report.summary.points));
  return section;
}

// What the user will want to look at: a terminal shows the first point of each violated limit.
ReportSection Worst(const StudyReport& report) {
  ReportSection section{.title = "Worst points, and how to run them", .link = "Worst"};
  Table table{.caption = "Worst points",
              .columns = {Text("quantity"), Digits("point"), Digits("value"), Text("command")}};
  for (size_t k = 0; k < report.summary.quantities.size(); ++k) {
    const QuantitySummary& q = report.summary.quantities[k];
    for (size_t i = 0; i < q.worst.size(); ++i) {
      table.rows.push_back({q.name, Count(q.worst[i].point), Six(q.worst[i].value),
                            Code(report.worst_commands[k][i])});
    }
  }
  section.Add(std::move(table), On::kPage);
  for (const LimitResult& result : report.summary.limits) {
    const QuantitySummary& q = report.summary.quantities[result.limit.quantity];
    if (result.violations == 0 || q.worst.empty()) continue;
    section.Add(Paragraph{fmt::format("worst {}: {:.6g} at point {}", q.name, q.worst[0].value,
                                      q.worst[0].point)},
                On::kTerminal);
    section.Add(Verbatim{report.worst_commands[result.limit.quantity][0]}, On::kTerminal);
  }
  return section;
}

ReportSection Disagreements(const StudyReport& report) {
  ReportSection section{.title = "Points where witnesses disagree", .link = "Disagreements"};
  if (report.summary.disagreed == 0) return section;
  section.Add(Paragraph{DisagreedText(report)}, On::kPage);
  for (size_t k = 0; k < report.summary.first_disagreed.size(); ++k) {
    section.Add(Paragraph{fmt::format("witnesses disagree at point {}",
                                      report.summary.first_disagreed[k].point)},
                On::kTerminal);
    section.Add(Verbatim{report.disagreed_commands[k]});
  }
  return section;
}

ReportSection Failures(const StudyReport& report) {
  ReportSection section{.title = "Points without a result", .link = "Failures"};
  if (report.summary.failed == 0) return section;
  Table table{.caption = "Why points have no result",
              .columns = {Text("reason"), Digits("points")}};
  for (const auto& [reason, count] : report.summary.reasons) {
    table.rows.push_back({reason, Count(count)});
  }
  section.Add(std::move(table));
  for (size_t k = 0; k < report.summary.first_failed.size(); ++k) {
    const PointRow& row = report.summary.first_failed[k];
    section.Add(Paragraph{fmt::format("point {} has no result: {}", row.point, row.reason)},
                On::kTerminal);
    section.Add(Verbatim{report.failed_commands[k]});
  }
  return section;
}

}  // namespace

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

std::vector<ReportSection> SectionsOf(const StudyReport& report,
                                      const std::vector<StudyPlot>& plots) {
  return {Varied(report),
          Limits(report),
          Quantities(report),
          Indices(report, plots),
          OneAtATime(report, plots),
          Validation(report, plots),
          Bands(report, plots),
          Histograms(plots),
          Scatter(report, plots),
          Worst(report),
          Disagreements(report),
          Failures(report)};
}

std::string ToText(const StudyReport& report) {
  std::string text = fmt::format("study {}: {}\n", report.study.name, PointsText(report));
  for (const ReportSection& section : SectionsOf(report, {})) text += ToText(section);
  return text;
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
          {band.percentiles() ? "p5" : "least", NumberList(band.lower)},
          {"p50", NumberList(band.median)},
          {band.percentiles() ? "p95" : "most", NumberList(band.upper)}};
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
  std::string text = PointsText(report);
  for (const LimitResult& result : report.summary.limits) {
    if (result.pass()) continue;
    text += "; " + LimitText(report, result) + ": " + ShareText(result);
  }
  if (report.summary.disagreed > 0) text += "; " + DisagreedText(report);
  if (!report.summary.few_missing()) text += "; " + MissingText(report);
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
    add(LimitText(report, result), result.share(), result.limit.share, result.pass());
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
               {"design", DesignWord(study.design.kind)},
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

// report.html of a study.

namespace {

class PlotList {
 public:
  explicit PlotList(const StudyReport& report) : report_(report) {}

  std::vector<StudyPlot> All() {
    for (const QuantitySummary& q : report_.summary.quantities) {
      if (q.sobol) AddIndices(q);
      if (!q.swings.empty()) AddTornado(q);
      if (q.histogram.counts.size() > 1) AddHistogram(q);
    }
    for (const StudyBand& band : report_.bands) {
      if (band.time_s.size() > 1) AddBand(band);
    }
    if (report_.validation) {
      for (const DriveValidation& drive : report_.validation->drives) AddValidation(drive);
    }
    if (!report_.shown.empty()) AddScatter();
    return std::move(plots_);
  }

 private:
  void Add(StudySection section, const std::string& name, std::string svg) {
    std::string file = NearestPlainPath(name);
    std::replace(file.begin(), file.end(), '/', '_');
    const auto taken = [&](const StudyPlot& plot) { return plot.file == file + ".svg"; };
    while (std::any_of(plots_.begin(), plots_.end(), taken)) file += "_";
    plots_.push_back({section, file + ".svg", std::move(svg)});
  }
  void Add(StudySection section, const std::string& name, LinePlot plot) {
    Add(section, name, ToSvg(plot));
    plots_.back().lines = std::move(plot);
  }

  // Its outline, and the nominal value as an upright line.
  void AddHistogram(const QuantitySummary& q) {
    LinePlot plot{.title = q.name, .x_label = q.name, .y_label = "points"};
    PlotLine outline{.label = "points"};
    const auto bins = static_cast<double>(q.histogram.counts.size());
    double most = 0.0;
    outline.points.emplace_back(q.histogram.from, 0.0);
    for (size_t k = 0; k < q.histogram.counts.size(); ++k) {
      const double width = (q.histogram.to - q.histogram.from) / bins;
      const double left = q.histogram.from + width * static_cast<double>(k);
      const auto count = static_cast<double>(q.histogram.counts[k]);
      outline.points.emplace_back(left, count);
      outline.points.emplace_back(left + width, count);
      most = std::max(most, count);
    }
    outline.points.emplace_back(q.histogram.to, 0.0);
    plot.lines.push_back(std::move(outline));
    plot.lines.push_back({.label = "nominal", .points = {{q.nominal, 0.0}, {q.nominal, most}}});
    Add(StudySection::kHistograms, "histogram_" + q.name, std::move(plot));
  }

  void AddTornado(const QuantitySummary& q) {
    BarPlot bars{.title = q.name, .columns = {q.name + ", down, of nominal", "up, of nominal"}};
    const double scale = std::abs(q.nominal);
    for (const Swing& swing : q.swings) {
      if (!(scale > 0.0) || !std::isfinite(swing.lowest)) continue;
      bars.rows.push_back(
          {report_.study.factors[swing.factor].name,
           {(swing.lowest - q.nominal) / scale, (swing.highest - q.nominal) / scale}});
    }
    if (!bars.rows.empty()) Add(StudySection::kTornado, "tornado_" + q.name, ToSvg(bars));
  }

  void AddIndices(const QuantitySummary& q) {
    BarPlot bars{.title = q.name, .columns = {q.name + ", first order", "total"}};
    for (size_t k = 0; k < q.sobol->indices.size(); ++k) {
      const SobolIndex& index = q.sobol->indices[k];
      if (!std::isfinite(index.total)) continue;
      const auto interval = [](const Interval& i) { return std::array{i.lower, i.upper}; };
      bars.rows.push_back({report_.study.factors[k].name,
                           {std::max(0.0, index.first), index.total},
                           {interval(index.first_interval), interval(index.total_interval)}});
    }
    if (!bars.rows.empty()) Add(StudySection::kIndices, "indices_" + q.name, ToSvg(bars));
  }

  void AddBand(const StudyBand& band) {
    double largest = 0.0;
    for (const double v : band.upper) largest = std::max(largest, std::abs(v));
    for (const double v : band.lower) largest = std::max(largest, std::abs(v));
    const ShownUnit unit = UsualUnit(band.unit, largest);
    const auto shown = [&](std::vector<double> values) {
      for (double& v : values) v *= unit.factor;
      return values;
    };
    LinePlot plot = ForcePlot(band.drive, unit.name);
    plot.areas.push_back({band.percentiles() ? "5 % … 95 %" : "least … most", band.time_s,
                          shown(band.lower), shown(band.upper)});
    AddLine("nominal", band.time_s, shown(band.nominal), &plot);
    AddLine("median", band.time_s, shown(band.median), &plot);
    plot.lines.back().dashed = true;
    Add(StudySection::kBands, "band_" + band.drive, std::move(plot));
  }

  // E with the band that it should lie in.
  void AddValidation(const DriveValidation& drive) {
    const ForceComparison& f = drive.forces;
    LinePlot plot = ForcePlot(f.drive + ": computed − measured", f.unit);
    PlotArea band{.label = fmt::format("± {:g} u_val", report_.study.validation->coverage),
                  .x = f.time_s,
                  .lower = {},
                  .upper = {}};
    std::vector<double> error;
    for (size_t t = 0; t < f.time_s.size(); ++t) {
      error.push_back(f.computed[t] - f.measured[t]);
      band.upper.push_back(report_.study.validation->coverage * drive.u_val[t]);
      band.lower.push_back(-band.upper.back());
    }
    plot.areas.push_back(std::move(band));
    AddLine("E", f.time_s, error, &plot);
    Add(StudySection::kValidation, "validation_" + f.drive, std::move(plot));
  }

  void AddScatter() {
    constexpr size_t kMostColumns = 8, kMostRows = 6;
    ScatterMatrix matrix;
    matrix.title = "quantities over varied numbers";
    for (const Factor& f : report_.study.factors) {
      if (matrix.columns.size() < kMostColumns) matrix.columns.push_back(f.name);
    }
    for (const StudyQuantity& q : report_.study.quantities) {
      if (matrix.rows.size() < kMostRows) matrix.rows.push_back(q.name);
    }
    for (const PointRow& row : report_.shown) {
      matrix.across.push_back(row.varied);
      matrix.upward.push_back(row.values);
    }
    Add(StudySection::kScatter, "scatter_matrix", ToSvg(matrix));
  }

  static LinePlot ForcePlot(const std::string& title, const std::string& unit) {
    return {.title = title, .x_label = "t [s]", .y_label = fmt::format("drive force [{}]", unit)};
  }

  static void AddLine(const std::string& label, const std::vector<double>& time_s,
                      const std::vector<double>& values, LinePlot* plot) {
    PlotLine line{.label = label};
    for (size_t t = 0; t < values.size(); ++t) line.points.emplace_back(time_s[t], values[t]);
    plot->lines.push_back(std::move(line));
  }

  const StudyReport& report_;
  std::vector<StudyPlot> plots_;
};

}  // namespace

std::vector<StudyPlot> StudyPlots(const StudyReport& report) { return PlotList(report).All(); }

namespace {

const char* FailureWord(const StudyReport& report) {
  return report.summary.within_limits() ? "Not validated" : "Limit violated";
}

}  // namespace

std::string ToHtml(const StudyReport& report) {
  Page page;
  for (const ReportSection& section : SectionsOf(report, StudyPlots(report))) page.Add(section);
  PageHead head{.kicker = "mbverify study", .title = report.study.name};
  head.lead = report.study.description.empty()
                  ? PointsText(report)
                  : report.study.description + "; " + PointsText(report);
  const int code = report.exit_code();
  head.verdict = code == 0 ? Verdict::kAgree : code == 1 ? Verdict::kDisagree : Verdict::kNotRun;
  head.word = code == 3 ? "No result" : code == 1 ? FailureWord(report) : "Limits kept";
  head.judges = code == 3 || report.judged();
  for (const auto& [name, version] : report.versions) {
    head.footer += (head.footer.empty() ? "" : " · ") + name + " " + version;
  }
  return page.Write(head);
}

// A matrix of small plots with a dot per point.

namespace {

constexpr double kCell = 118, kGap = 10, kNames = 150, kTopNames = 26;

PlotAxis AxisOf(const std::vector<std::vector<double>>& points, size_t k, double from, double to) {
  PlotAxis axis{.from_px = from, .to_px = to};
  for (const auto& point : points) axis.Add(point[k]);
  axis.Pad();
  return axis;
}

std::string Panel(const ScatterMatrix& matrix, size_t column, size_t row) {
  const double left = kNames + (kCell + kGap) * static_cast<double>(column);
  const double top = kTopNames + (kCell + kGap) * static_cast<double>(row);
  const PlotAxis x = AxisOf(matrix.across, column, left, left + kCell);
  const PlotAxis y = AxisOf(matrix.upward, row, top + kCell, top);
  std::string dots;  // one path: round line ends without a length
  for (size_t p = 0; p < matrix.across.size(); ++p) {
    const double u = matrix.across[p][column], v = matrix.upward[p][row];
    if (!x.Shows(u) || !y.Shows(v)) continue;
    dots += fmt::format("M{:.1f} {:.1f}h0", x.Px(u), y.Px(v));
  }
  return SvgShape("rect", {{"x", left},
                           {"y", top},
                           {"width", kCell},
                           {"height", kCell},
                           {"fill", "none"},
                           {"stroke", "#888888"}}) +
         SvgShape("path", {{"d", dots},
                           {"fill", "none"},
                           {"stroke", kLineColors[0]},
                           {"stroke-width", "2.4"},
                           {"stroke-linecap", "round"},
                           {"stroke-opacity", "0.6"}}) +
         "\n";
}

}  // namespace

std::string ToSvg(const ScatterMatrix& matrix) {
  std::string svg = "\n" + SvgElement("title", {}, EscapeMarkup(matrix.title)) + "\n";
  for (size_t c = 0; c < matrix.columns.size(); ++c) {
    const double middle = kNames + (kCell + kGap) * static_cast<double>(c) + kCell / 2.0;
    svg += SvgText({{"x", middle}, {"y", "16"}, {"text-anchor", "middle"}},
                   ShortenedName(matrix.columns[c], 18)) +
           "\n";
  }
  for (size_t r = 0; r < matrix.rows.size(); ++r) {
    const double middle = kTopNames + (kCell + kGap) * static_cast<double>(r) + kCell / 2.0;
    svg += SvgText({{"x", kNames - 8}, {"y", middle}, {"text-anchor", "end"}},
                   ShortenedName(matrix.rows[r], 22)) +
           "\n";
    for (size_t c = 0; c < matrix.columns.size(); ++c) svg += Panel(matrix, c, r);
  }
  const double width = kNames + (kCell + kGap) * static_cast<double>(matrix.columns.size());
  const double height = kTopNames + (kCell + kGap) * static_cast<double>(matrix.rows.size());
  return SvgFigure(width, height, matrix.title, svg);
}

}  // namespace mbv
