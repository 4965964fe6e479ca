#include "report/result.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/json_text.h"
#include "comparison/verdict.h"

namespace mbv {
namespace {

// Whether a reader wants to see it even if it passes.
bool IsKey(const CheckResult& check) {
  const bool simulated = IsEngine(check.measured);
  switch (check.metric) {
    case Metric::kForceNrmse:
    case Metric::kTableTube:
    case Metric::kMotorUse:
      return true;
    case Metric::kForceMax:
    case Metric::kForceOwn:
    case Metric::kPoseM:
    case Metric::kPoseRad:
      return simulated && check.truth == role::kAnalytic;
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
    default:
      return true;  // of stiffnesses
  }
}

}  // namespace

ResultView ViewOfComparison(const ResultFrame& frame, const Comparison& comparison,
                            Metric main_metric) {
  ResultView view{.frame = &frame,
                  .verdict = comparison.verdict,
                  .reason = comparison.reason,
                  .caveats = comparison.caveats,
                  .attribution = comparison.attribution,
                  .not_compared = comparison.not_compared,
                  .pairs = comparison.pairs.size(),
                  .verified = comparison.verified(),
                  .empty_counts = {{"checks_of_a_motion_with_itself", comparison.followed()},
                                   {"checks_insensitive", comparison.insensitive()}}};
  for (const PairComparison& pair : comparison.pairs) view.pairs_compared += pair.compared ? 1 : 0;
  for (const CheckResult& check : comparison.checks) {
    const MetricRow& row = RowOf(check.metric);
    view.checks.push_back(
        {.name = check.name,
         .subject = check.subject,
         .title = *row.unit == '\0' ? row.title : fmt::format("{} [{}]", row.title, row.unit),
         .value = check.value,
         .limit = check.limit,
         .pass = check.pass,
         .where = check.channel,
         .time_s = check.time_s,
         .key = IsKey(check),
         .verifies = !check.follows,
         .insensitive = check.insensitive,
         .floored = check.floored,
         .stated_limit = check.stated_limit,
         .limit_by = check.limit_by});
  }
  if (const PairComparison* pair = comparison.MainPair()) {
    view.main_pair = pair->measured + " vs " + pair->truth;
    view.main_check = pair->name() + "." + RowOf(main_metric).key;
  }
  return view;
}

CheckEnd EndOf(const ShownCheck& check) {
  if (!check.limit) return CheckEnd::kOff;
  if (!check.pass) return CheckEnd::kFail;
  if (!check.insensitive.empty()) return CheckEnd::kInsensitive;
  return check.verifies.value_or(true) ? CheckEnd::kOk : CheckEnd::kByConstruction;
}

std::string WhereOf(const ShownCheck& check) {
  if (check.where.empty() || !std::isfinite(check.time_s)) return check.where;
  return fmt::format("{}, {:.4g} s", check.where, check.time_s);
}

const ShownCheck* ResultView::FindCheck(const std::string& name) const {
  return FindNamed(checks, name);
}

size_t ResultView::ran() const {
  return static_cast<size_t>(std::count_if(witnesses.begin(), witnesses.end(),
                                           [](const auto& one) { return one.second.ok(); }));
}

size_t ResultView::limits() const {
  return static_cast<size_t>(
      std::count_if(checks.begin(), checks.end(),
                    [](const ShownCheck& check) { return check.limit.has_value(); }));
}

RunCounts& RunCounts::operator+=(const RunCounts& other) {
  scenarios += other.scenarios;
  ran += other.ran;
  compared += other.compared;
  verified += other.verified;
  bad_input += other.bad_input;
  return *this;
}

RunCounts CountOf(const ResultView& view) {
  return {.scenarios = 1,
          .ran = view.ran() > 0 ? size_t{1} : 0,
          .compared = view.main_pair.empty() ? size_t{0} : 1,
          .verified = view.verdict == Verdict::kAgree ? size_t{1} : 0};
}

std::string CountLine(const RunCounts& counts) {
  std::string text =
      fmt::format("{} scenario{}: {} ran, {} compared, {} verified", counts.scenarios,
                  counts.scenarios == 1 ? "" : "s", counts.ran, counts.compared, counts.verified);
  if (counts.bad_input > 0) text += fmt::format(", {} with bad input", counts.bad_input);
  return text + "\n";
}

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSummarySchema = "mbverify.summary/1";

Json ChecksJson(const ResultView& view) {
  Json checks = Json::array();
  for (const ShownCheck& check : view.checks) {
    if (!check.limit) continue;
    Json json = {{"name", check.name},
                 {"value", Number(check.value)},
                 {"limit", *check.limit},
                 {"pass", check.pass}};
    if (check.verifies) json["verifies"] = *check.verifies;
    json["time_s"] = Number(check.time_s);
    json["channel"] = check.where;
    if (check.stated_limit) {
      json["stated_limit"] = *check.stated_limit;
      json["limit_by"] = check.limit_by;
    }
    if (check.floored) json["floored"] = true;
    if (!check.insensitive.empty()) json["verifies_nothing"] = check.insensitive;
    checks.push_back(std::move(json));
  }
  return checks;
}

Json ChecksOffJson(const ResultView& view) {
  Json checks = Json::array();
  for (const ShownCheck& check : view.checks) {
    if (!check.limit) checks.push_back({{"name", check.name}, {"value", Number(check.value)}});
  }
  return checks;
}

void AddCaveats(const std::vector<Caveat>& caveats, Json* json) {
  Json values = Json::array();
  for (const Caveat& caveat : caveats) {
    Json value = {{"kind", ToText(caveat.kind)}, {"of", caveat.of}};
    if (caveat.gap != WitnessGap::kNone) value["cause"] = ToText(caveat.gap);
    value["text"] = caveat.text;
    values.push_back(std::move(value));
  }
  (*json)["caveats"] = std::move(values);
}

Json TimingJson(const ResultView& view) {
  const Timing& timing = view.frame->timing;
  Json times = {{"analytic_s", timing.analytic_s},
                {"reference_s", timing.reference_s},
                {"simulation_s", timing.simulation_s},
                {"render_s", timing.render_s}};
  if (view.in_time) times["stock_s"] = timing.stock_s;
  if (timing.foreign_s > 0.0) times["foreign_s"] = timing.foreign_s;
  times["total_s"] = timing.total_s;
  if (view.in_time) {
    times["loop_s"] = timing.loop_s;
    times["steps"] = timing.steps;
  }
  if (view.in_time && timing.loop_s > 0.0) {
    times["steps_per_s"] = static_cast<double>(timing.steps) / timing.loop_s;
  }
  return times;
}

// What was found, beside what follows from it.
Json AttributionJson(const Attribution& attribution) {
  Json json = {{"odd_one_out", attribution.odd_one_out}, {"text", attribution.text}};
  if (!attribution.split) return json;
  const Attribution::Split& split = *attribution.split;
  json["agree"] = split.agree;
  json["agree_to"] = Number(split.agree_to);
  json["differs"] = split.differs;
  json["differs_by"] = Number(split.differs_by);
  json["measure"] = split.measure;
  json["unit"] = split.unit;
  json["shared"] = split.shared;
  return json;
}

}  // namespace

Json SummaryHead(const ResultView& view) {
  const ResultFrame& frame = *view.frame;
  Json json = {{"schema", kSummarySchema}};
  if (*view.kind != '\0') json["kind"] = view.kind;
  json["scenario"] = frame.scenario;
  json["scenario_file"] = frame.scenario_file;
  json["mechanism"] = frame.mechanism;
  json["model_file"] = frame.model_file;
  json["description"] = frame.description;
  json["verdict"] = ToText(view.verdict);
  json["reason"] = view.reason;
  json["exit_code"] = frame.exit_code;
  AddCaveats(view.caveats, &json);
  json["attribution"] = AttributionJson(view.attribution);
  json["checks"] = ChecksJson(view);
  json["checks_off"] = ChecksOffJson(view);
  return json;
}

void AddSummaryEnd(const ResultView& view, Json* json) {
  if (view.frame->timing.stated) (*json)["timing"] = TimingJson(view);
  (*json)["versions"] = Json::object();
  for (const auto& [name, version] : view.frame->versions) (*json)["versions"][name] = version;
}

Json NotComparedJson(const ResultView& view) {
  Json json = Json::array();
  for (const NotCompared& item : view.not_compared) {
    json.push_back({{"what", item.what}, {"why", item.why}});
  }
  return json;
}

Json CountsJson(const ResultView& view) {
  Json json = {{"witnesses_ran", view.ran()},
               {"pairs_compared", view.pairs_compared},
               {"checks", view.limits()},
               {"checks_verified", view.verified}};
  for (const auto& [key, count] : view.empty_counts) json[key] = count;
  json["checks_off"] = view.checks.size() - view.limits();
  return json;
}

Json FindingsJson(const Diagnostics& findings) {
  Json json = Json::array();
  for (const Finding& finding : findings.findings()) json.push_back(ToText(finding));
  return json;
}

Json WitnessHead(const std::string& name, const RunSummary& summary) {
  return {{"name", name},
          {"ran", summary.ok()},
          {"stop", ToText(summary.stop)},
          {"message", summary.message}};
}

void AddBreakdown(const ResultView& view, const RunSummary& summary, Json* json) {
  if (summary.ok() || summary.stop == Stop::kNotRun) return;
  if (view.in_time) (*json)["time_s"] = Number(summary.time_s);
  (*json)["where"] = summary.where;
  (*json)["amount"] = Number(summary.amount);
  (*json)["unit"] = summary.unit;
}

namespace {

// Limit over value as a factor, with a bar of its decimal digits (ten fill it).
std::string Margin(const ShownCheck& check) {
  if (!check.limit || !std::isfinite(check.value)) return "";
  if (check.value <= 0.0) return "exact";
  const double digits = std::log10(*check.limit / check.value);
  const double filled = std::clamp(10.0 * std::abs(digits), 2.0, 100.0);
  const std::string factor = digits >= 0.0
                                 ? fmt::format("{:.3g}×", *check.limit / check.value)
                                 : fmt::format("{:.3g}× over", check.value / *check.limit);
  return fmt::format("<span class=\"margin{}\"><i style=\"width:{:.0f}%\"></i></span> {}",
                     check.pass ? "" : " over", filled, factor);
}

std::vector<Cell> CheckRow(const ShownCheck& check) {
  std::vector<Cell> row = {Spaced(check.subject),
                           check.title,
                           NumberOrDash(check.value),
                           check.limit ? fmt::format("{:.1e}", *check.limit) : "off",
                           EndCell(check),
                           "",
                           WhereOf(check)};
  if (check.floored) row[4].remark = "floored";
  if (check.insensitive.empty()) row[5].html = Margin(check);
  return row;
}

}  // namespace

Cell EndCell(const ShownCheck& check) {
  switch (EndOf(check)) {
    case CheckEnd::kOff:
      return {"off", Mark::kOff};
    case CheckEnd::kFail:
      return {"FAIL", Mark::kFail};
    case CheckEnd::kInsensitive:
      return {"verifies nothing", Mark::kWarn};
    case CheckEnd::kByConstruction:
      return {"held", Mark::kOff};
    case CheckEnd::kOk:
      break;
  }
  return {"ok", Mark::kOk};
}

const char* SourceWord(Source source) {
  switch (source) {
    case Source::kPrinted:
      return "printed";
    case Source::kAssumed:
      return "assumed";
    case Source::kCorrected:
      return "corrected";
    case Source::kUnstated:
      break;
  }
  return "";
}

PageHead HeadOf(const ResultView& view) {
  return {.title = view.frame->title(), .lead = view.frame->description, .verdict = view.verdict};
}

std::string VerdictHtml(const ResultView& view, const std::string& cards,
                        const std::string& about) {
  const auto sentence = [](const std::string& text) { return Escape(Sentence(text)); };
  // Who agrees with whom is the verdict in plain words; how many checks say so comes after it.
  const std::string& who = view.attribution.text;
  std::string html = fmt::format("<p class=\"reason{}\">{}</p>\n",
                                 view.attribution.odd_one_out.empty() ? "" : " odd",
                                 sentence(who.empty() ? view.reason : who));
  if (!who.empty()) html += "<p class=\"attribution\">" + sentence(view.reason) + "</p>\n";
  for (const Caveat& caveat : view.caveats) {
    html +=
        "<p class=\"caveat\">" + Pill("warn", "caveat") + " " + sentence(caveat.text) + "</p>\n";
  }
  html += "<dl class=\"cards\">\n" + cards + "</dl>\n" + Note(about);
  if (view.frame->findings.empty()) return html;
  html += "<ul class=\"findings\">\n";
  for (const Finding& finding : view.frame->findings.findings()) {
    html += "<li>" + Escape(ToText(finding)) + "</li>\n";
  }
  return html + "</ul>\n";
}

std::string ChecksHtml(const ResultView& view, const std::string& note) {
  if (view.checks.empty()) return "";
  Table table{.caption = "Checks, failed ones first",
              .columns = {Text("of"), Text("quantity"), Digits("value"), Digits("limit"),
                          Text("result"), Text("margin"), Text("worst at")}};
  for (const bool failed : {true, false}) {
    for (const ShownCheck& check : view.checks) {
      if ((EndOf(check) == CheckEnd::kFail) == failed) table.rows.push_back(CheckRow(check));
    }
  }
  return ToHtml(table) + Note(note);
}

std::string GapsHtml(const ResultView& view, bool reason_tells_failure) {
  std::string html;
  bool said = !reason_tells_failure || view.verdict != Verdict::kNotRun;
  for (const auto& [name, summary] : view.witnesses) {
    if (summary.ok()) continue;
    if (summary.stop != Stop::kNotRun && !std::exchange(said, true)) continue;
    html += "<li><b>" + Escape(name) + "</b>: " + Escape(ToText(summary.stop)) + ". " +
            Escape(summary.message) + "</li>\n";
  }
  for (const NotCompared& item : view.not_compared) {
    html += "<li><b>" + Escape(item.what) + "</b>: " + Escape(item.why) + "</li>\n";
  }
  return html.empty() ? "" : "<ul>\n" + html + "</ul>\n";
}

std::string ParametersHtml(const std::vector<Parameter>& parameters, bool sources) {
  if (parameters.empty()) return "";
  Table table{
      .caption = "Parameters with the scenario's overrides",
      .columns = {Text("name"), Digits("value"), Text("unit")},
  };
  if (sources) table.columns.push_back(Text("source"));
  table.columns.push_back(Text("note"));
  for (const Parameter& parameter : parameters) {
    std::vector<Cell> row = {parameter.name, fmt::format("{:.10g}", parameter.value),
                             parameter.unit};
    if (sources) row.push_back(SourceWord(parameter.source));
    row.push_back(parameter.note);
    table.rows.push_back(std::move(row));
  }
  return Folded(fmt::format("{} parameters", parameters.size()), ToHtml(table));
}

std::string ReproduceHtml(const ResultView& view, const std::string& command,
                          const std::string& times, const std::string& files) {
  Table table{
      .caption = "Inputs and versions",
      .columns = {Text("what"), Text("is")},
  };
  if (!view.frame->scenario_file.empty()) {
    table.rows.push_back({"scenario", view.frame->scenario_file});
  }
  table.rows.push_back({"model", view.frame->model_file});
  for (const auto& [name, version] : view.frame->versions) {
    table.rows.push_back({name, version});
  }
  if (!times.empty()) table.rows.push_back({"time taken", times});
  return "<pre tabindex=\"0\"><code>" + Escape(command) + "</code></pre>\n" + ToHtml(table) +
         Note(files);
}

}  // namespace mbv
