// summary.json of a study.
#include "core/json_text.h"
#include "core/text.h"
#include "report/study_report.h"
#include "report/study_words.h"

namespace mbv {
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
