// motion.csv and loads.csv: what a scenario commands, sample by sample, for other programs.
#pragma once

#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// What a foreign witness is told of a motion.
struct HandedMotion {
  std::vector<double> time_s;
  std::vector<DrivenSample> driven;            ///< per sample: drives, then prescribed joints
  std::vector<std::vector<LoadSample>> loads;  ///< per sample, in the order of the scenario
};

/// time_s, then NAME.position, NAME.velocity, NAME.acceleration of every drive and prescribed
/// joint; 17 significant digits.
[[nodiscard]] std::string MotionCsv(const Mechanism& mechanism, const HandedMotion& motion);

/// One row per sample and load: time_s, load (from 0), body, px, py, pz (in the body's frame), axes
/// ("world" or "body"), fx … mz: a force at the point and a moment.
[[nodiscard]] std::string LoadsCsv(const Mechanism& mechanism, const HandedMotion& motion);

}  // namespace mbv
