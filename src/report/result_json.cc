#include "report/result_json.h"

#include "core/json_text.h"

namespace mbv {
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
    if (!check.blind.empty()) json["verifies_nothing"] = check.blind;
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

// As texts, as ever, and as values.
void AddCaveats(const std::vector<Caveat>& caveats, Json* json) {
  Json texts = Json::array(), values = Json::array();
  for (const Caveat& caveat : caveats) {
    texts.push_back(caveat.text);
    Json value = {{"kind", ToText(caveat.kind)}, {"of", caveat.of}};
    if (caveat.gap != WitnessGap::kNone) value["cause"] = ToText(caveat.gap);
    value["text"] = caveat.text;
    values.push_back(std::move(value));
  }
  (*json)["reservations"] = std::move(texts);
  (*json)["caveats"] = std::move(values);
}

Json TimingJson(const ResultView& view) {
  const Timing& timing = view.frame->timing;
  Json times = {{"analytic_s", timing.analytic_s},
                {"reference_s", timing.reference_s},
                {"simulation_s", timing.simulation_s},
                {"render_s", timing.render_s}};
  if (view.look.steps) times["stock_s"] = timing.stock_s;
  if (timing.foreign_s > 0.0) times["foreign_s"] = timing.foreign_s;
  times["total_s"] = timing.total_s;
  if (view.look.steps) {
    times["loop_s"] = timing.loop_s;
    times["steps"] = timing.steps;
  }
  if (view.look.steps && timing.loop_s > 0.0) {
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
  if (view.caveats) AddCaveats(*view.caveats, &json);
  json["attribution"] = AttributionJson(view.attribution);
  json["checks"] = ChecksJson(view);
  json["checks_off"] = ChecksOffJson(view);
  return json;
}

void AddSummaryEnd(const ResultView& view, Json* json) {
  if (view.frame->timing.told) (*json)["timing"] = TimingJson(view);
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
  if (view.look.steps) (*json)["time_s"] = Number(summary.time_s);
  (*json)["where"] = summary.where;
  (*json)["amount"] = Number(summary.amount);
  (*json)["unit"] = summary.unit;
}

}  // namespace mbv
