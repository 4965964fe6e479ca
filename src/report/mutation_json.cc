// Mutation reports as JSON, and back: workers hand their parts over in this form.
#include <algorithm>
#include <cmath>

#include "core/json_document.h"
#include "core/json_text.h"
#include "report/mutation_report.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kMutationSchema = "mbverify.mutate/2";
constexpr const char* kKinds[] = {"parameter", "instance", "literal"};

// One list of fields per struct serves both directions.
struct ToFields {
  Json json = Json::object();
  void operator()(const char* key, const double& x) { json[key] = Number(x); }
  template <typename T>
  void operator()(const char* key, const T& x) {
    json[key] = x;
  }
};

struct FromFields {
  const JsonValue& json;
  void operator()(const char* key, double& x) const { x = json.at(key).NumberOrNan(); }
  template <typename T>
  void operator()(const char* key, T& x) const {
    x = json.at(key).get<T>();
  }
};

template <typename F, typename S>
void SightingFields(F& field, S& s) {
  field("ran", s.ran);
  field("detected", s.detected);
  field("by_force", s.by_force);
  field("force_nrmse", s.force_change);
  field("smallest", s.smallest);
  field("check", s.best_check);
  field("only", s.only);
  field("reason", s.reason);
}

template <typename F, typename S>
void FaultFields(F& field, S& s) {
  field("ran", s.ran);
  field("detected", s.detected);
  field("check", s.check);
  field("value", s.value);
  field("limit", s.limit);
  field("reason", s.reason);
}

template <typename F, typename M>
void MutationFields(F& field, M& m) {
  field("name", m.name);
  field("unit", m.unit);
  field("value", m.value);
  field("relative_to", m.relative_to);
  field("unseen_up_to", m.proved_to);
  field("force_sensitivity", m.sensitivity);
  field("reason", m.reason);
}

template <typename F, typename R>
void ResultFields(F& field, R& r) {
  field("fault", r.kind);
  field("where", r.where);
  field("applicable", r.applicable);
  field("alike", r.alike);
  field("reason", r.reason);
}

template <typename F, typename R>
void ReportFields(F& field, R& r) {
  field("scenario", r.scenario);
  field("mode", r.mode);
  field("exit_code", r.exit_code);
  field("size", r.size);
  field("resolution", r.resolution);
  field("simulations", r.runs);
  field("wall_s", r.wall_s);
}

Json JsonOf(const Sighting& s) {
  ToFields field;
  SightingFields(field, s);
  return field.json;
}

Json JsonOf(const FaultSighting& s) {
  ToFields field;
  FaultFields(field, s);
  return field.json;
}

template <typename T>
Json Optional(const std::optional<T>& value) {
  return value ? JsonOf(*value) : Json();
}

Json JsonOf(const Mutation& m) {
  ToFields field;
  field("kind", kKinds[static_cast<size_t>(m.kind)]);
  MutationFields(field, m);
  field.json["own"] = JsonOf(m.own);
  field.json["inverse"] = Optional(m.inverse);
  return field.json;
}

Json JsonOf(const FaultResult& r) {
  ToFields field;
  ResultFields(field, r);
  field.json["own"] = JsonOf(r.own);
  field.json["inverse"] = Optional(r.inverse);
  return field.json;
}

Sighting SightingOf(const JsonValue& json) {
  Sighting s;
  const FromFields field{json};
  SightingFields(field, s);
  return s;
}

FaultSighting FaultSightingOf(const JsonValue& json) {
  FaultSighting s;
  const FromFields field{json};
  FaultFields(field, s);
  return s;
}

Mutation MutationOf(const JsonValue& json) {
  Mutation m;
  const FromFields field{json};
  MutationFields(field, m);
  const std::string word = json.at("kind");
  const auto kind = std::find(std::begin(kKinds), std::end(kKinds), word);
  if (kind == std::end(kKinds)) json.at("kind").Refuse("is no kind of a number");
  m.kind = static_cast<NumberKind>(kind - std::begin(kKinds));
  m.own = SightingOf(json.at("own"));
  if (!json.at("inverse").is_null()) m.inverse = SightingOf(json.at("inverse"));
  return m;
}

FaultResult FaultResultOf(const JsonValue& json) {
  FaultResult r;
  const FromFields field{json};
  ResultFields(field, r);
  r.own = FaultSightingOf(json.at("own"));
  if (!json.at("inverse").is_null()) r.inverse = FaultSightingOf(json.at("inverse"));
  return r;
}

// Item k of part i is item k·n + i of all.
template <typename T>
std::vector<T> Interleave(std::vector<MutationReport>* parts,
                          std::vector<T> MutationReport::*items) {
  std::vector<T> all;
  bool any = true;
  for (size_t k = 0; any; ++k) {
    any = false;
    for (MutationReport& part : *parts) {
      if (k >= (part.*items).size()) continue;
      all.push_back(std::move((part.*items)[k]));
      any = true;
    }
  }
  return all;
}

}  // namespace

std::string ToJson(const MutationReport& report) {
  ToFields field;
  field("schema", kMutationSchema);
  ReportFields(field, report);
  Json& json = field.json;
  json["numbers"] = Json::array();
  for (const Mutation& m : report.mutations) json["numbers"].push_back(JsonOf(m));
  json["faults"] = Json::array();
  for (const FaultResult& f : report.faults) json["faults"].push_back(JsonOf(f));
  return Dump(json);
}

std::optional<MutationReport> MutationReportOf(const std::string& text) {
  const auto read = [](const JsonValue& json) {
    MutationReport report;
    const FromFields field{json};
    ReportFields(field, report);
    for (const JsonValue& item : json.at("numbers").list()) {
      report.mutations.push_back(MutationOf(item));
    }
    for (const JsonValue& item : json.at("faults").list()) {
      report.faults.push_back(FaultResultOf(item));
    }
    return report;
  };
  return ReadJson(text, read, kMutationSchema).value;
}

MutationReport MergeParts(std::vector<MutationReport> parts) {
  MutationReport all = parts.front();
  all.mutations = Interleave(&parts, &MutationReport::mutations);
  all.faults = Interleave(&parts, &MutationReport::faults);
  all.runs = 0;
  for (const MutationReport& part : parts) {
    all.runs += part.runs;
    all.wall_s = std::max(all.wall_s, part.wall_s);
    all.exit_code = std::max(all.exit_code, part.exit_code);
  }
  SortBySensitivity(&all);
  return all;
}

}  // namespace mbv
