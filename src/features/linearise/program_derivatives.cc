// A program of the user's is asked for derivatives.
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "external/mechanism_json.h"
#include "features/linearise/linearise.h"
#include "simulation/mjcf/mjcf.h"
#include "verify/program_call.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kStateSchema = "mbverify/state/1";
constexpr const char* kAnswer = "derivatives.json";

Json ListOf(const Eigen::Ref<const VecX>& x) {
  return std::vector<double>(x.data(), x.data() + x.size());
}
Json PoseOf(const Pose& X) {
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({X(i, 0), X(i, 1), X(i, 2)});
  return {{"p", ListOf(X.translation())}, {"R", rows}};
}

Json CoordinateOf(const Mechanism& mechanism, const NamedCoordinate& of) {
  const auto i = static_cast<size_t>(of.coordinate.index);
  Json json = {{"name", of.name}};
  switch (of.coordinate.kind) {
    case Coordinate::Kind::kDrive:
      json["drive"] = mechanism.drives[i].name;
      break;
    case Coordinate::Kind::kPrescribed:
      json["prescribed"] = mechanism.prescribed[i].name;
      break;
    case Coordinate::Kind::kJoint:
      json["joint"] = mechanism.joints[i].name;
      json["coordinate"] = of.coordinate.component;
      break;
    case Coordinate::Kind::kOutput:
      json["output"] = mechanism.outputs[i].name;
      json["coordinate"] = of.coordinate.component;
  }
  return json;
}

// Poses and loads with everything resolved, so that a program closes no loop.
std::string StateJson(const Mechanism& mechanism, const Linearisation& at, const BodyStates& states,
                      const std::vector<LoadSample>& loads) {
  Json json = {{"schema", kStateSchema}};
  for (const NamedCoordinate& of : at.coordinates) {
    json["coordinates"].push_back(CoordinateOf(mechanism, of));
  }
  json["q"] = ListOf(at.q), json["v"] = ListOf(at.v), json["a"] = ListOf(at.a);
  json["drives"] = at.drives, json["drive_force"] = ListOf(at.drive_force);
  json["bodies"] = Json::array();
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    json["bodies"].push_back({{"name", mechanism.bodies[b].name},
                              {"pose", PoseOf(states.X_WB[b])},
                              {"w", ListOf(states.V_WB[b].head<3>())},
                              {"v", ListOf(states.V_WB[b].tail<3>())}});
  }
  json["loads"] = Json::array();
  for (const LoadSample& load : loads) {
    json["loads"].push_back({{"body", mechanism.bodies[static_cast<size_t>(load.body)].name},
                             {"p", ListOf(load.p_BoQ_B)},
                             {"axes", load.in_body_axes ? "body" : "world"},
                             {"force", ListOf(load.force)},
                             {"moment", ListOf(load.moment)}});
  }
  return Dump(json);
}

std::string AskProgram(const Mechanism& mechanism, const std::string& state, ProgramCall* call,
                       std::string* answer) {
  for (const auto& [name, text] :
       {std::pair("mechanism.json", MechanismJson(mechanism)), std::pair("state.json", state),
        std::pair("model.xml", WriteMjcf(mechanism, {}))}) {
    if (std::string trouble = call->WriteInput(name, text); !trouble.empty()) return trouble;
  }
  if (const auto failure = call->Run()) return failure->text;
  const auto text = call->Text(kAnswer);
  if (!text) return std::string("left no ") + kAnswer + call->OutputTail();
  *answer = *text;
  return "";
}

}  // namespace

std::string DerivativesOfProgram(const std::string& command, const Mechanism& mechanism,
                                 const Linearisation& at, const BodyStates& states,
                                 const std::vector<LoadSample>& loads, std::string* answer) {
  for (const LoadSample& load : loads) {
    if (load.load != nullptr && !load.load->following.empty()) {
      return "loads that are expressions of the state are not handed to programs";
    }
  }
  ForeignWitness witness;
  witness.name = "program", witness.command = CommandWords(command), witness.typed = true;
  ProgramCall call(witness);
  return AskProgram(mechanism, StateJson(mechanism, at, states, loads), &call, answer);
}

}  // namespace mbv
