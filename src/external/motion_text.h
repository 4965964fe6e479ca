// motion.csv, loads.csv, and of a free motion forces.csv and start.csv: what a scenario commands,
// sample by sample, for other programs.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/engine_rows.h"
#include "math/profile.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// What an external solver gets of a motion.
struct HandedMotion {
  std::vector<double> time_s;
  std::vector<DrivenSample> driven;            ///< per sample: drives, then prescribed joints
  std::vector<std::vector<LoadSample>> loads;  ///< per sample, in the order of the scenario
  std::vector<bool> commanded = {};            ///< per entry of `driven`; empty: all are commanded
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
/// derivative) of every drive that exerts a given force.
[[nodiscard]] std::string ForcesCsv(const Mechanism& mechanism, const HandedMotion& motion);

/// One row per body at t = 0: body, px, py, pz (of its origin), R11, R12 … R33 (row by row), wx,
/// wy, wz (angular velocity), vx, vy, vz (of the origin), all in the world.
[[nodiscard]] std::string StartCsv(const Mechanism& mechanism, const BodyStates& start);

// states.json and rows.json: states at which another version of MuJoCo is asked for a model's
// equality rows, and its answer (examples/witness/mujoco/rows.mjs).

/// {"drives": [names of what is driven], "states": [{qpos, qvel, targets, applied}]}, 17 digits.
[[nodiscard]] std::string StatesJson(const std::vector<std::string>& driven,
                                     const std::vector<RowState>& states);

struct RowAnswer {
  std::vector<std::string> messages;    ///< what the engine says of the file that it accepted
  std::vector<std::string> equalities;  ///< per row: the name of its equality
  std::vector<RowMeasures> states;      ///< as many as were asked for
};
/// Empty, with one sentence of trouble, where the answer is none for `states` states, or its sizes
/// do not fit: rows of every state to `equalities`, forces to `driven`.
[[nodiscard]] std::optional<RowAnswer> ReadRowAnswer(std::string_view json, size_t states,
                                                     size_t driven, std::string* trouble);

}  // namespace mbv
