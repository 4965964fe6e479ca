#include "mechanism/followed_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mbv {
std::string NameOf(const Mechanism& mechanism, const Coordinate& coordinate) {
  const auto index = static_cast<size_t>(coordinate.index);
  switch (coordinate.kind) {
    case Coordinate::Kind::kPrescribed:
      return mechanism.prescribed[index].name;
    case Coordinate::Kind::kDrive:
      return mechanism.drives[index].name;
    case Coordinate::Kind::kOutput:
      return mechanism.outputs[index].name + "." +
             kPoseComponents[static_cast<size_t>(coordinate.component)];
    case Coordinate::Kind::kJoint: {
      const Joint& joint = mechanism.joints[index];
      return DofsOf(joint.kind) == 1 ? joint.name
                                     : fmt::format("{}.{}", joint.name, coordinate.component);
    }
  }
  return "";
}

std::vector<FollowedAngle> FollowedAngles(const Mechanism& mechanism, const Motion& motion) {
  std::vector<FollowedAngle> angles;
  for (const Load& load : motion.loads) {
    for (const Load::Following& part : load.following) {
      for (const StateFunction::Input& input : part.function.inputs) {
        const Coordinate& at = input.coordinate;
        const bool driven =
            at.kind == Coordinate::Kind::kDrive || at.kind == Coordinate::Kind::kPrescribed;
        if (driven || IsLength(mechanism, at)) continue;
        angles.push_back({at, StartAngle(mechanism, motion, at)});
      }
    }
  }
  return angles;
}

double StartAngle(const Mechanism& mechanism, const Motion& motion, const Coordinate& coordinate) {
  for (const InitialValue& value : motion.initial) {
    if (value.coordinate == coordinate) return value.position;
  }
  for (const Command& command : motion.commands) {
    if (command.terms.size() != 1 || !(command.terms[0].coordinate == coordinate)) continue;
    return Evaluate(command.profile, 0.0).value / command.terms[0].factor;
  }
  return HomeValue(mechanism, coordinate);
}

RunSummary LoadHasNoValue(const Mechanism& mechanism, const Load& load, const Load::Following& part,
                          double t_s, std::span<const double> inputs, double value) {
  RunSummary summary;
  summary.stop = Stop::kUnsupported;
  summary.time_s = t_s;
  summary.where = fmt::format("loads.{}.{}[{}]", load.name, part.component < 3 ? "force" : "moment",
                              part.component % 3);
  summary.names_where = summary.states_time = true;
  summary.message = fmt::format("the expression of {} is {} at t = {:.6g} s", summary.where,
                                std::isnan(value) ? "not a number" : "infinite", t_s);
  const auto same = [](const StateFunction::Input& a, const StateFunction::Input& b) {
    return a.rate == b.rate && a.coordinate == b.coordinate;
  };
  for (size_t i = 0; i < inputs.size(); ++i) {
    const StateFunction::Input& input = part.function.inputs[i];
    const auto first =
        std::ranges::find_if(part.function.inputs,
                             [&](const StateFunction::Input& other) { return same(input, other); });
    if (&*first != &input) continue;  // an expression may name a coordinate twice
    summary.message +=
        fmt::format("{}{}.{} = {:.6g} {}{}", i == 0 ? ", where " : ", ",
                    NameOf(mechanism, input.coordinate), input.rate ? "velocity" : "position",
                    inputs[i], CoordinateUnit(mechanism, input.coordinate), input.rate ? "/s" : "");
  }
  return summary;
}

}  // namespace mbv
