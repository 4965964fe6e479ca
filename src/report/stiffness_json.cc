#include <cmath>

#include "core/json_text.h"
#include "report/result_json.h"
#include "report/stiffness_report.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

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

Json WitnessJson(const StiffnessWitness& witness, const ResultView& view) {
  const StiffnessResult& result = witness.result;
  Json json = WitnessHead(witness.name, result.summary);
  json["rank"] = result.rank;
  json["K"] = MatrixJson(result.K);
  json["C"] = MatrixJson(result.C);
  AddBreakdown(view, result.summary, &json);
  if (std::isfinite(witness.residual)) json["residual"] = witness.residual;
  if (std::isfinite(witness.extrapolation_error)) {
    json["extrapolation"] = witness.extrapolation_error;
  }
  json["contributions"] = ContributionsJson(result);
  return json;
}

Json WitnessesJson(const std::vector<StiffnessWitness>& witnesses, const ResultView& view) {
  Json json = Json::array();
  for (const StiffnessWitness& witness : witnesses) json.push_back(WitnessJson(witness, view));
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

Json PoseJson(const StiffnessReport& report) {
  Json json = Json::object();
  for (const PoseEntry& entry : report.pose) json[entry.name] = Number(entry.value);
  return json;
}

}  // namespace

std::string ToJson(const StiffnessReport& report) {
  const ResultView view = ViewOf(report);
  Json json = SummaryHead(view);
  json["metrics"] = MetricsJson(report);
  json["witnesses"] = WitnessesJson(report.witnesses, view);
  json["printed"] = WitnessesJson(report.printed, view);
  json["not_compared"] = NotComparedJson(view);
  json["counts"] = CountsJson(view);
  json["output"] = report.output;
  json["pose"] = PoseJson(report);
  json["analytic_model"] = report.model;
  json["loads"] = report.loads_text;
  json["indices"] = IndicesJson(report);
  if (const StiffnessWitness* shown = report.Shown())
    json["weakest"] = WeakestJson(shown->result.C);
  json["findings"] = FindingsJson(report.findings);
  AddSummaryEnd(view, &json);
  return Dump(json);
}

}  // namespace mbv
