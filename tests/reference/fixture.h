// Shorthand for motions of small mechanisms.
#pragma once

#include <string>
#include <vector>

#include "mechanism/joint_pose.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "reference/reference.h"
#include "tests/mechanisms/simulated.h"

namespace mbv::fixtures {

inline Command Commanded(const std::string& name, Coordinate::Kind kind, int index, int component,
                         Profile profile) {
  return {.name = name,
          .terms = {{{.kind = kind, .index = index, .component = component}, 1.0}},
          .profile = std::move(profile)};
}
inline Command DriveCommand(const Mechanism& m, int drive, Profile profile) {
  return Commanded(m.drives[drive].name, Coordinate::Kind::kDrive, drive, 0, std::move(profile));
}

/// Every drive on its profile.
inline Motion DriveMotion(const Mechanism& m, std::vector<Profile> profiles, double duration_s,
                          double sample_s) {
  Motion motion;
  motion.duration_s = duration_s;
  motion.sample_s = sample_s;
  for (size_t d = 0; d < profiles.size(); ++d) {
    motion.commands.push_back(DriveCommand(m, static_cast<int>(d), std::move(profiles[d])));
  }
  return motion;
}

inline Body MakeWorld() {
  Body world;
  world.name = "world";
  return world;
}

/// A mechanism of open chains: home at the joint guesses.
inline void FinishTree(Mechanism* m) {
  AddTree(m);
  std::vector<std::array<double, 6>> q;
  for (Joint& joint : m->joints) {
    joint.home = joint.guess;
    q.push_back(joint.guess);
  }
  m->X_WB_home = TreePoses(*m, q);
}

inline double At(const Trace& trace, Eigen::Index sample, const std::string& channel) {
  const int column = trace.Find(channel);
  return column < 0 ? kNan : trace.values(sample, column);
}
inline Eigen::VectorXd ColumnOf(const Trace& trace, const std::string& channel) {
  const int column = trace.Find(channel);
  if (column < 0) return Eigen::VectorXd::Constant(trace.values.rows(), kNan);
  return trace.values.col(column);
}

/// Largest error of the torque of drive "motor" over the largest torque; `truth` knows the equation
/// of motion: Torque(position, velocity, acceleration).
template <typename Truth>
double TorqueError(const Trace& trace, const Truth& truth) {
  double error = 0.0, size = 0.0;
  for (Eigen::Index i = 0; i < trace.values.rows(); ++i) {
    const double torque =
        truth.Torque(At(trace, i, "motor.position"), At(trace, i, "motor.velocity"),
                     At(trace, i, "motor.acceleration"));
    error = std::max(error, std::abs(At(trace, i, "motor.force") - torque));
    size = std::max(size, std::abs(torque));
  }
  return error / size;
}

}  // namespace mbv::fixtures
