#include "mechanism/motion.h"

#include <algorithm>

namespace mbv {

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
}

}  // namespace mbv
