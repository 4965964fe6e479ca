#include "exchange/row_states.h"

#include <Eigen/Dense>

#include "core/json_document.h"
#include "core/json_text.h"

namespace mbv {
namespace {

std::vector<double> Numbers(const VecX& v) { return {v.begin(), v.end()}; }

VecX VectorAt(const JsonValue& json, const char* key) {
  const auto numbers = json.at(key).get<std::vector<double>>();
  return Eigen::Map<const VecX>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

RowAnswer Answered(const JsonValue& json) {
  RowAnswer answer{.messages = json.at("messages").get<std::vector<std::string>>(),
                   .equalities = json.at("equalities").get<std::vector<std::string>>(),
                   .states = {}};
  for (const JsonValue& state : json.at("states").list()) {
    answer.states.push_back({.R = VectorAt(state, "R"),
                             .bias = VectorAt(state, "bias"),
                             .force = VectorAt(state, "force")});
  }
  return answer;
}

bool Fits(const RowAnswer& answer, size_t states, size_t driven) {
  bool fits = answer.states.size() == states;
  for (const RowMeasures& measures : answer.states) {
    fits = fits && static_cast<size_t>(measures.R.size()) == answer.equalities.size() &&
           measures.bias.size() == measures.R.size() &&
           static_cast<size_t>(measures.force.size()) == driven;
  }
  return fits;
}

}  // namespace

std::string StatesJson(const std::vector<std::string>& driven,
                       const std::vector<RowState>& states) {
  auto list = nlohmann::ordered_json::array();
  for (const RowState& state : states) {
    list.push_back({{"qpos", Numbers(state.qpos)},
                    {"qvel", Numbers(state.qvel)},
                    {"targets", Numbers(state.targets)},
                    {"applied", Numbers(state.applied)}});
  }
  return Dump({{"drives", driven}, {"states", std::move(list)}});
}

std::optional<RowAnswer> ReadRowAnswer(std::string_view json, size_t states, size_t driven,
                                       std::string* trouble) {
  auto answer = ReadJson(json, Answered);
  if (answer && Fits(*answer.value, states, driven)) return std::move(answer.value);
  *trouble = answer ? "rows.json does not fit the states that were asked for"
                    : "rows.json is no answer: " + answer.refusal.Text();
  return {};
}

}  // namespace mbv
