#include <cmath>

#include "report/json_number.h"
#include "report/stiffness_report.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "mbverify.summary/1";

template <typename Matrix>
Json VectorJson(const Matrix& values) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < values.size(); ++i) json.push_back(Number(values[i]));
  return json;
}

Json MatrixJson(const Mat6& M) {
  Json json = Json::array();
  for (int i = 0; i < 6; ++i) json.push_back(VectorJson(Vec6(M.row(i))));
  return json;
}

Json ChecksJson(const StiffnessComparison& comparison, bool on) {
  Json checks = Json::array();
  for (const StiffnessCheck& check : comparison.checks) {
    if (check.limit.has_value() != on) continue;
    Json json = {{"name", check.name}, {"value", Number(check.value)}};
    if (on) {
      json["limit"] = *check.limit;
      json["pass"] = check.pass;
      json["time_s"] = nullptr;
      json["channel"] = check.where;
    }
    checks.push_back(std::move(json));
  }
  return checks;
}

Json LoadErrorsJson(const LoadErrors& errors) {
  return {{"axes", {"rx", "ry", "rz", "x", "y", "z"}}, {"largest", VectorJson(errors.scale)},
          {"error_mean", VectorJson(errors.mean)},     {"error_max", VectorJson(errors.max)},
          {"vector_mean", Number(errors.vector_mean)}, {"vector_max", Number(errors.vector_max)},
          {"worst_load", errors.worst_load + 1}};
}

Json PairJson(const StiffnessPair& pair) {
  Json json = Json::object();
  for (const auto& [metric, worst] : pair.metrics) json[RowOf(metric).key] = Number(worst.value);
  json["K_difference"] = MatrixJson(pair.K_difference);
  json["C_difference"] = MatrixJson(pair.C_difference);
  if (pair.loads) json["loads"] = LoadErrorsJson(*pair.loads);
  return json;
}

Json MetricsJson(const StiffnessReport& report) {
  Json all = Json::object();
  for (const StiffnessPair& pair : report.comparison.pairs) {
    if (pair.compared) all[pair.name()] = PairJson(pair);
  }
  for (const StiffnessPair& pair : report.printed_pairs) {
    if (pair.compared) all[pair.name()] = PairJson(pair);
  }
  return all;
}

Json ContributionsJson(const StiffnessResult& result) {
  Json json = Json::array();
  for (const Contribution& row : Contributions(result)) {
    json.push_back({{"element", row.element},
                    {"weakest_translation", Number(row.translation)},
                    {"weakest_rotation", Number(row.rotation)},
                    {"axes", VectorJson(row.axis)}});
  }
  return json;
}

Json WitnessJson(const StiffnessWitness& witness) {
  const StiffnessResult& result = witness.result;
  Json json = {{"name", witness.name},
               {"ran", result.summary.ok()},
               {"stop", ToText(result.summary.stop)},
               {"message", result.summary.message},
               {"rank", result.rank},
               {"K", MatrixJson(result.K)},
               {"C", MatrixJson(result.C)}};
  if (!result.summary.ok() && result.summary.stop != Stop::kNotRun) {
    json["where"] = result.summary.where;
    json["amount"] = Number(result.summary.amount);
    json["unit"] = result.summary.unit;
  }
  if (std::isfinite(witness.residual)) json["residual"] = witness.residual;
  if (std::isfinite(witness.extrapolation_error)) {
    json["extrapolation"] = witness.extrapolation_error;
  }
  json["contributions"] = ContributionsJson(result);
  return json;
}

Json WitnessesJson(const std::vector<StiffnessWitness>& witnesses) {
  Json json = Json::array();
  for (const StiffnessWitness& witness : witnesses) json.push_back(WitnessJson(witness));
  return json;
}

Json IndicesJson(const StiffnessReport& report) {
  Json json = Json::array();
  for (const IndexRow& row : report.indices) {
    Json index = {{"name", row.name}, {"unit", row.unit}, {"meaning", row.meaning}};
    for (size_t w = 0; w < row.values.size(); ++w) {
      index[report.witnesses[w].name] = Number(row.values[w]);
    }
    json.push_back(std::move(index));
  }
  return json;
}

Json WeakestJson(const Mat6& C) {
  const WeakDirection shift = WeakestTranslation(C), turn = WeakestRotation(C);
  const WeakScrew screw = WeakestScrew(C);
  return {{"translation",
           {{"direction", VectorJson(shift.direction)}, {"stiffness", Number(shift.stiffness)}}},
          {"rotation",
           {{"direction", VectorJson(turn.direction)}, {"stiffness", Number(turn.stiffness)}}},
          {"screw",
           {{"length_m", Number(screw.length_m)},
            {"stiffness", Number(screw.stiffness)},
            {"axis", VectorJson(screw.axis)},
            {"point", VectorJson(screw.point)},
            {"pitch_m", Number(screw.pitch_m)}}}};
}

Json CountsJson(const StiffnessReport& report) {
  size_t ran = 0, compared = 0, limits = 0;
  for (const StiffnessWitness& witness : report.witnesses) ran += witness.result.summary.ok();
  for (const StiffnessPair& pair : report.comparison.pairs) compared += pair.compared ? 1 : 0;
  for (const StiffnessCheck& check : report.comparison.checks) limits += check.limit ? 1 : 0;
  return {{"witnesses_ran", ran},
          {"pairs_compared", compared},
          {"checks", limits},
          {"checks_verified", report.comparison.verified()},
          {"checks_off", report.comparison.checks.size() - limits}};
}

Json PoseJson(const StiffnessReport& report) {
  Json json = Json::object();
  for (const PoseEntry& entry : report.pose) json[entry.name] = Number(entry.value);
  return json;
}

}  // namespace

std::string ToJson(const StiffnessReport& report) {
  const StiffnessComparison& comparison = report.comparison;
  Json json = {{"schema", kSchema},
               {"kind", "stiffness"},
               {"scenario", report.scenario},
               {"scenario_file", report.scenario_file},
               {"mechanism", report.mechanism},
               {"model_file", report.model_file},
               {"description", report.description},
               {"verdict", ToText(comparison.verdict)},
               {"reason", comparison.reason},
               {"exit_code", report.exit_code},
               {"attribution",
                {{"odd_one_out", comparison.attribution.odd_one_out},
                 {"text", comparison.attribution.text}}},
               {"checks", ChecksJson(comparison, true)},
               {"checks_off", ChecksJson(comparison, false)},
               {"metrics", MetricsJson(report)},
               {"witnesses", WitnessesJson(report.witnesses)},
               {"printed", WitnessesJson(report.printed)}};
  json["not_compared"] = Json::array();
  for (const NotCompared& item : comparison.not_compared) {
    json["not_compared"].push_back({{"what", item.what}, {"why", item.why}});
  }
  json["counts"] = CountsJson(report);
  json["output"] = report.output;
  json["pose"] = PoseJson(report);
  json["analytic_model"] = report.model;
  json["loads"] = report.loads_text;
  json["indices"] = IndicesJson(report);
  if (const StiffnessWitness* shown = report.Shown())
    json["weakest"] = WeakestJson(shown->result.C);
  json["findings"] = Json::array();
  for (const Finding& finding : report.findings.findings()) {
    json["findings"].push_back(ToText(finding));
  }
  json["timing"] = {{"analytic_s", report.timing.analytic_s},
                    {"reference_s", report.timing.reference_s},
                    {"simulation_s", report.timing.simulation_s},
                    {"render_s", report.timing.render_s},
                    {"total_s", report.timing.total_s}};
  json["versions"] = Json::object();
  for (const auto& [name, version] : report.versions) json["versions"][name] = version;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace mbv
