#include "external/motion_text.h"

#include <fmt/format.h>
#include <Eigen/Dense>
#include <initializer_list>
#include <iterator>

#include "base/json_document.h"
#include "base/json_text.h"
#include "base/text.h"

namespace mbv {
namespace {

std::vector<std::string> DrivenNames(const Mechanism& mechanism) {
  std::vector<std::string> names;
  for (const Drive& drive : mechanism.drives) names.push_back(drive.name);
  for (const Prescribed& base : mechanism.prescribed) names.push_back(base.name);
  return names;
}

void AddHeadings(const std::string& name, std::initializer_list<const char*> quantities,
                 std::string* text) {
  for (const char* quantity : quantities) *text += "," + CsvCell(name + "." + quantity);
}

void AddNumbers(const Vec3& v, std::string* text) {
  for (const double number : v) fmt::format_to(std::back_inserter(*text), ",{:.17g}", number);
}

}  // namespace

std::string MotionCsv(const Mechanism& mechanism, const HandedMotion& motion) {
  const std::vector<std::string> names = DrivenNames(mechanism);
  const auto commanded = [&](size_t k) { return motion.commanded.empty() || motion.commanded[k]; };
  std::string text = "time_s";
  for (size_t k = 0; k < names.size(); ++k) {
    if (commanded(k)) AddHeadings(names[k], {"position", "velocity", "acceleration"}, &text);
  }
  text += '\n';
  for (size_t i = 0; i < motion.time_s.size(); ++i) {
    text += fmt::format("{:.17g}", motion.time_s[i]);
    const DrivenSample& driven = motion.driven[i];
    for (size_t k = 0; k < names.size(); ++k) {
      if (!commanded(k)) continue;
      const auto d = static_cast<Eigen::Index>(k);
      AddNumbers({driven.position[d], driven.velocity[d], driven.acceleration[d]}, &text);
    }
    text += '\n';
  }
  return text;
}

std::string ForcesCsv(const Mechanism& mechanism, const HandedMotion& motion) {
  std::string text = "time_s";
  for (const int drive : motion.forced) {
    AddHeadings(mechanism.drives[static_cast<size_t>(drive)].name,
                {"force", "force_rate", "force_acceleration"}, &text);
  }
  text += '\n';
  for (size_t i = 0; i < motion.forces.size(); ++i) {
    text += fmt::format("{:.17g}", motion.time_s[i]);
    for (const Jet& jet : motion.forces[i]) {
      AddNumbers({jet.value, jet.rate, jet.acceleration}, &text);
    }
    text += '\n';
  }
  return text;
}

std::string StartCsv(const Mechanism& mechanism, const BodyStates& start) {
  std::string text = "body,px,py,pz,R11,R12,R13,R21,R22,R23,R31,R32,R33,wx,wy,wz,vx,vy,vz\n";
  for (size_t b = 0; b < mechanism.bodies.size(); ++b) {
    text += CsvCell(mechanism.bodies[b].name);
    AddNumbers(start.X_WB[b].translation(), &text);
    for (int r = 0; r < 3; ++r) AddNumbers(start.X_WB[b].linear().row(r).transpose(), &text);
    AddNumbers(start.V_WB[b].head<3>(), &text);
    AddNumbers(start.V_WB[b].tail<3>(), &text);
    text += '\n';
  }
  return text;
}

std::string LoadsCsv(const Mechanism& mechanism, const HandedMotion& motion) {
  std::string text = "time_s,load,body,px,py,pz,axes,fx,fy,fz,mx,my,mz\n";
  for (size_t i = 0; i < motion.loads.size(); ++i) {
    for (size_t k = 0; k < motion.loads[i].size(); ++k) {
      const LoadSample& load = motion.loads[i][k];
      text += fmt::format("{:.17g},{},{}", motion.time_s[i], k,
                          CsvCell(mechanism.bodies[static_cast<size_t>(load.body)].name));
      AddNumbers(load.p_BoQ_B, &text);
      text += load.in_body_axes ? ",body" : ",world";
      AddNumbers(load.force, &text);
      AddNumbers(load.moment, &text);
      text += '\n';
    }
  }
  return text;
}

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
                    : "rows.json is not an answer: " + answer.refusal.Text();
  return {};
}

}  // namespace mbv
