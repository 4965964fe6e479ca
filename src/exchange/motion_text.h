// motion.csv, loads.csv, and of a free motion forces.csv and start.csv: what a scenario commands,
// sample by sample, for other programs.
#pragma once

#include <string>
#include <vector>

#include "core/piecewise.h"
#include "mechanism/body_states.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// What a foreign witness is told of a motion.
struct HandedMotion {
  std::vector<double> time_s;
  std::vector<DrivenSample> driven;            ///< per sample: drives, then prescribed joints
  std::vector<std::vector<LoadSample>> loads;  ///< per sample, in the order of the scenario
  std::vector<bool> told = {};                 ///< per entry of `driven`; empty: all are commanded
  std::vector<int> forced = {};                ///< drives whose force is given (free motion)
  std::vector<std::vector<Jet>> forces = {};   ///< per sample and entry of `forced`
};

/// time_s, then NAME.position, NAME.velocity, NAME.acceleration of every drive and prescribed
/// joint that is commanded; 17 significant digits.
[[nodiscard]] std::string MotionCsv(const Mechanism& mechanism, const HandedMotion& motion);

/// One row per sample and load: time_s, load (from 0), body, px, py, pz (in the body's frame), axes
/// ("world" or "body"), fx … mz: a force at the point and a moment.
[[nodiscard]] std::string LoadsCsv(const Mechanism& mechanism, const HandedMotion& motion);

/// time_s, then DRIVE.force, DRIVE.force_rate, DRIVE.force_acceleration (its first and second
/// derivative) of every drive that pushes with a given force.
[[nodiscard]] std::string ForcesCsv(const Mechanism& mechanism, const HandedMotion& motion);

/// One row per body at t = 0: body, px, py, pz (of its origin), R11, R12 … R33 (row by row), wx,
/// wy, wz (angular velocity), vx, vy, vz (of the origin), all in the world.
[[nodiscard]] std::string StartCsv(const Mechanism& mechanism, const BodyStates& start);

}  // namespace mbv
