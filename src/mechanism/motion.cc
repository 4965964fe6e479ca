#include "mechanism/motion.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "math/spatial.h"

namespace mbv {
namespace {

Pose HomePose(const Mechanism& mechanism, int body) {
  return mechanism.X_WB_home[static_cast<size_t>(body)];
}

}  // namespace

bool IsLength(const Mechanism& mechanism, const Coordinate& coordinate) {
  const auto index = static_cast<size_t>(coordinate.index);
  switch (coordinate.kind) {
    case Coordinate::Kind::kDrive:
      return PositionUnit(mechanism, mechanism.drives[index]) == "m";
    case Coordinate::Kind::kPrescribed:
      return IsLength(mechanism.joints[static_cast<size_t>(mechanism.prescribed[index].joint)].kind,
                      0);
    case Coordinate::Kind::kOutput:
      return coordinate.component < 3;
    case Coordinate::Kind::kJoint:
      return IsLength(mechanism.joints[index].kind, coordinate.component);
  }
  return false;
}

std::string CoordinateUnit(const Mechanism& mechanism, const Coordinate& coordinate) {
  return IsLength(mechanism, coordinate) ? "m" : "rad";
}

std::vector<NamedCoordinate> NamedCommandCoordinates(const Mechanism& mechanism) {
  using Kind = Coordinate::Kind;
  std::vector<NamedCoordinate> named;
  const auto add = [&](std::string name, Kind kind, size_t index, int component) {
    named.push_back({std::move(name), {kind, static_cast<int>(index), component}});
  };
  for (size_t p = 0; p < mechanism.prescribed.size(); ++p) {
    add(mechanism.prescribed[p].name, Kind::kPrescribed, p, 0);
  }
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    add(mechanism.drives[d].name, Kind::kDrive, d, 0);
  }
  for (size_t o = 0; o < mechanism.outputs.size(); ++o) {
    int component = 0;
    for (const char* c : kPoseComponents) {
      add(mechanism.outputs[o].name + "." + c, Kind::kOutput, o, component++);
    }
  }
  return named;
}

namespace {

// The drive or the prescribed joint that a joint's coordinate belongs to, else itself.
Coordinate OwnerOf(const Mechanism& mechanism, const Coordinate& joint) {
  for (size_t p = 0; p < mechanism.prescribed.size(); ++p) {
    if (mechanism.prescribed[p].joint != joint.index) continue;
    return {Coordinate::Kind::kPrescribed, static_cast<int>(p), 0};
  }
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    const auto* on = std::get_if<JointDrive>(&mechanism.drives[d].kind);
    if (on == nullptr || on->joint != joint.index || on->coordinate != joint.component) continue;
    return {Coordinate::Kind::kDrive, static_cast<int>(d), 0};
  }
  return joint;
}

}  // namespace

std::vector<NamedCoordinate> NamedMotionCoordinates(const Mechanism& mechanism) {
  std::vector<NamedCoordinate> named = NamedCommandCoordinates(mechanism);
  const size_t own = named.size();
  for (NamedCoordinate& joint : NamedJointCoordinates(mechanism)) {
    const JointKind kind = mechanism.joints[static_cast<size_t>(joint.coordinate.index)].kind;
    const bool taken =
        std::any_of(named.begin(), named.begin() + static_cast<std::ptrdiff_t>(own),
                    [&](const NamedCoordinate& other) { return other.name == joint.name; });
    if (taken || IsOfBall(kind, joint.coordinate.component)) continue;
    named.push_back({std::move(joint.name), OwnerOf(mechanism, joint.coordinate)});
  }
  return named;
}

std::vector<NamedCoordinate> NamedJointCoordinates(const Mechanism& mechanism) {
  std::vector<NamedCoordinate> named;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    const int dofs = DofsOf(joint.kind);
    for (int c = 0; c < dofs; ++c) {
      named.push_back({dofs == 1 ? joint.name : joint.name + "." + std::to_string(c),
                       {Coordinate::Kind::kJoint, static_cast<int>(j), c}});
    }
  }
  return named;
}

double HomeValue(const Mechanism& mechanism, const Coordinate& coordinate) {
  const auto index = static_cast<size_t>(coordinate.index);
  const auto home_of = [&](int joint, int c) {
    return mechanism.joints[static_cast<size_t>(joint)].home[static_cast<size_t>(c)];
  };
  switch (coordinate.kind) {
    case Coordinate::Kind::kPrescribed:
      return home_of(mechanism.prescribed[index].joint, 0);
    case Coordinate::Kind::kDrive: {
      const Drive& drive = mechanism.drives[index];
      if (const auto* joint = std::get_if<JointDrive>(&drive.kind)) {
        return home_of(joint->joint, joint->coordinate);
      }
      const auto& leg = std::get<DistanceDrive>(drive.kind);
      return (HomePose(mechanism, leg.body_to) * leg.p_to -
              HomePose(mechanism, leg.body_from) * leg.p_from)
          .norm();
    }
    case Coordinate::Kind::kOutput: {
      const Output& output = mechanism.outputs[index];
      const Pose X_RO = (HomePose(mechanism, output.reference_body) * output.X_RbR).inverse() *
                        HomePose(mechanism, output.body) * output.X_BO;
      return coordinate.component < 3 ? X_RO.translation()[coordinate.component]
                                      : RpyOf(X_RO.linear())[coordinate.component - 3];
    }
    case Coordinate::Kind::kJoint:
      return home_of(coordinate.index, coordinate.component);
  }
  return kNan;
}

double MotionTable::noise_share() const {
  const double change = acceleration_change_rms * acceleration_change_rms;
  const double used = acceleration_rms * acceleration_rms;
  // The smooth part and what is taken away are nearly orthogonal.
  const double all = smoothed() ? used + change : used;
  return all > 0.0 ? std::min(1.0, change / all) : 0.0;
}

int Motion::FindCommand(const std::string& command_name) const {
  for (size_t i = 0; i < commands.size(); ++i) {
    if (commands[i].name == command_name) return static_cast<int>(i);
  }
  return -1;
}

std::vector<Coordinate> Motion::RecordedJoints() const {
  std::vector<Coordinate> joints;
  for (const Command& command : commands) {
    for (const Command::Term& term : command.terms) {
      const bool joint = term.coordinate.kind == Coordinate::Kind::kJoint;
      if (joint && std::ranges::find(joints, term.coordinate) == joints.end()) {
        joints.push_back(term.coordinate);
      }
    }
  }
  return joints;
}

int Motion::FindForce(int drive) const {
  for (size_t i = 0; i < forces.size(); ++i) {
    if (forces[i].drive == drive) return static_cast<int>(i);
  }
  return -1;
}

void EvaluateMotion(const Motion& motion, double t_s, CommandSample* sample) {
  const auto n = static_cast<Eigen::Index>(motion.commands.size());
  sample->time_s = t_s;
  sample->position.resize(n);
  sample->velocity.resize(n);
  sample->acceleration.resize(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Jet jet = Evaluate(motion.commands[k].profile, t_s);
    sample->position[k] = jet.value;
    sample->velocity[k] = jet.rate;
    sample->acceleration[k] = jet.acceleration;
  }
  sample->loads.resize(motion.loads.size());
  for (size_t i = 0; i < motion.loads.size(); ++i) {
    const Load& load = motion.loads[i];
    LoadSample& out = sample->loads[i];
    out.body = load.body;
    out.p_BoQ_B = load.p_BoQ_B;
    out.in_body_axes = load.in_body_axes;
    out.load = &load;
    out.time_s = t_s;
    for (int c = 0; c < 3; ++c) {
      out.force[c] = Evaluate(load.force[c], t_s).value;
      out.moment[c] = Evaluate(load.moment[c], t_s).value;
    }
  }
  EvaluateSwitches(motion, t_s, &sample->engaged);
  EvaluatePayloads(motion, t_s, &sample->carried);
}

void EvaluateSwitches(const Motion& motion, double t_s, std::vector<double>* engaged) {
  for (const Switch& one : motion.switches) {
    if (one.body >= 0) continue;
    if (engaged->size() <= one.element) engaged->resize(one.element + 1, 1.0);
    (*engaged)[one.element] = Evaluate(one.share, t_s).value;
  }
}

void EvaluatePayloads(const Motion& motion, double t_s, std::vector<double>* carried) {
  for (const Switch& one : motion.switches) {
    if (one.body < 0) continue;
    const auto b = static_cast<size_t>(one.body);
    if (carried->size() <= b) carried->resize(b + 1, 1.0);
    (*carried)[b] = Evaluate(one.share, t_s).value;
  }
}

bool HasPayloads(const Motion& motion) {
  return std::ranges::any_of(motion.switches, [](const Switch& one) { return one.body >= 0; });
}

namespace {

template <typename TimesOf>
std::vector<double> AllTimes(const Motion& motion, const TimesOf& times_of) {
  std::vector<double> all;
  const auto add = [&](const Profile& profile) {
    const std::vector<double> times = times_of(profile);
    all.insert(all.end(), times.begin(), times.end());
  };
  for (const Command& command : motion.commands) add(command.profile);
  for (const DriveForce& force : motion.forces) add(force.force);
  for (const Switch& one : motion.switches) add(one.share);
  for (const Load& load : motion.loads) {
    for (int c = 0; c < 3; ++c) {
      add(load.force[c]);
      add(load.moment[c]);
    }
    for (const Load::Following& part : load.following) {
      for (const Profile& signal : part.function.signals) add(signal);
    }
  }
  for (const DriveForce& force : motion.forces) {
    if (!force.following) continue;
    for (const Profile& signal : force.following->signals) add(signal);
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

std::vector<double> BreakTimes(const Motion& motion) {
  return AllTimes(motion, [](const Profile& profile) { return BreakTimes(profile); });
}

std::vector<double> JumpTimes(const Motion& motion) {
  return AllTimes(motion, [](const Profile& profile) { return JumpTimes(profile); });
}

std::vector<BranchingFunction> BranchingFunctions(const Mechanism& mechanism,
                                                  const Motion& motion) {
  std::vector<BranchingFunction> all;
  for (const Load& load : motion.loads) {
    for (const Load::Following& part : load.following) {
      if (part.function.branch) all.push_back({PathOf(load, part), &part.function});
    }
  }
  for (const DriveForce& force : motion.forces) {
    if (!force.following || !force.following->branch) continue;
    all.push_back({PathOf(mechanism, force), &*force.following});
  }
  std::ranges::sort(all, {}, [](const BranchingFunction& one) { return one.function->number; });
  return all;
}

// Between breaks signals are smooth, and do not vanish at all of these times by chance.
std::vector<size_t> SwitchedOff(const Motion& motion, double from_s, double to_s) {
  constexpr int kLooks = 7;
  std::vector<size_t> off;
  for (const Switch& one : motion.switches) {
    bool zero = one.body < 0;
    for (int k = 1; k < kLooks && zero; ++k) {
      zero = Evaluate(one.share, from_s + (to_s - from_s) * k / kLooks).value == 0.0;
    }
    if (zero) off.push_back(one.element);
  }
  std::ranges::sort(off);
  return off;
}

void UntilJump::StartFrom(double from_s) {
  before_s_ = std::numeric_limits<double>::infinity();
  for (const double at_s : jumps_s_) {
    if (BeforeJump(at_s) <= from_s) continue;
    before_s_ = BeforeJump(at_s);
    return;
  }
}

bool UntilJump::IsJump(double t_s) const {
  return std::ranges::any_of(
      jumps_s_, [t_s](double at_s) { return BeforeJump(at_s) < t_s && BeforeJump(t_s) < at_s; });
}

void BodyStates::Resize(size_t bodies) {
  X_WB.assign(bodies, Pose::Identity());
  V_WB.assign(bodies, Vec6::Zero());
  A_WB.assign(bodies, Vec6::Zero());
}

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
  const auto add = [&](const StateFunction& function) {
    for (const StateFunction::Input& input : function.inputs) {
      const Coordinate& at = input.coordinate;
      const bool driven =
          at.kind == Coordinate::Kind::kDrive || at.kind == Coordinate::Kind::kPrescribed;
      if (driven || IsLength(mechanism, at)) continue;
      angles.push_back({at, StartAngle(mechanism, motion, at)});
    }
  };
  for (const Load& load : motion.loads) {
    for (const Load::Following& part : load.following) add(part.function);
  }
  for (const DriveForce& force : motion.forces) {
    if (force.following) add(*force.following);
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

std::string PathOf(const Load& load, const Load::Following& part) {
  return fmt::format("loads.{}.{}[{}]", load.name, part.component < 3 ? "force" : "moment",
                     part.component % 3);
}
std::string PathOf(const Mechanism& mechanism, const DriveForce& force) {
  return "forces." + mechanism.drives[static_cast<size_t>(force.drive)].name;
}

namespace {

// Without the inputs.
RunSummary NoValue(const std::string& path, double t_s, double value) {
  RunSummary summary;
  summary.stop = Stop::kUnsupported;
  summary.time_s = t_s;
  summary.where = path;
  summary.names_where = true;
  summary.states_time = !std::isnan(t_s);
  summary.message = fmt::format("the expression of {} is {}", path,
                                std::isnan(value) ? "not a number" : "infinite");
  if (summary.states_time) summary.message += fmt::format(" at t = {:.6g} s", t_s);
  return summary;
}

}  // namespace

RunSummary HasNoValue(const ForceElement& element, double t_s, double position, double rate,
                      double value) {
  RunSummary summary = NoValue(element.name, t_s, value);
  summary.message += fmt::format(", where x = {:.6g} and v = {:.6g}", position, rate);
  return summary;
}

RunSummary HasNoValue(const Mechanism& mechanism, const std::string& path,
                      const StateFunction& function, double t_s, std::span<const double> inputs,
                      double value) {
  RunSummary summary = NoValue(path, t_s, value);
  const auto same = [](const StateFunction::Input& a, const StateFunction::Input& b) {
    return a.rate == b.rate && a.coordinate == b.coordinate;
  };
  for (size_t i = 0; i < inputs.size(); ++i) {
    const StateFunction::Input& input = function.inputs[i];
    const auto first = std::ranges::find_if(
        function.inputs, [&](const StateFunction::Input& other) { return same(input, other); });
    if (&*first != &input) continue;  // an expression may name a coordinate twice
    summary.message +=
        fmt::format("{}{}.{} = {:.6g} {}{}", i == 0 ? ", where " : ", ",
                    NameOf(mechanism, input.coordinate), input.rate ? "velocity" : "position",
                    inputs[i], CoordinateUnit(mechanism, input.coordinate), input.rate ? "/s" : "");
  }
  return summary;
}

}  // namespace mbv
