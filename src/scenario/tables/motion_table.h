// `table: {csv: …}` in a profile: a measured or exported trajectory (or load) over time.
//
//   crank.drive: {table: {csv: run7.csv, time: "t (ms)", column: "Angle (deg)", smoothing: auto}}
//
// Read as tables in the reference's place are (settings.h); what becomes of the rows: row_spline.h.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "model_file/yaml/value_reader.h"

namespace mbv {

/// What a table is wanted for.
struct MotionTableUse {
  std::string name;    ///< of what it gives: "crank.drive"
  std::string unit;    ///< SI, of its values
  bool moves = false;  ///< a command: rates may be given, and its second derivative makes forces
};

/// Reads and loads a table; `path` is its key's. Findings about the settings go to `values`, those
/// about the file to `files`; empty after an error.
[[nodiscard]] std::optional<MotionTable> LoadMotionTable(ValueReader* values, const YamlNode& node,
                                                         const std::string& path,
                                                         const MotionTableUse& use,
                                                         const Mechanism& mechanism,
                                                         Diagnostics* files);

/// A finding where the rows do not cover the motion 0 … duration_s, a warning where they go on for
/// long after it; at the place of `node`.
void CheckCover(const MotionTable& table, const YamlNode& node, const std::string& path,
                double duration_s, YamlReader* yaml);

// `motion.pose_table`: the pose of an output over time, from one file.
//
//   pose_table: {output: platform, csv: path.csv, angles: quaternion, smoothing: auto}
//
// Orientations of every row become roll, pitch and yaw (R = Rz(yaw) Ry(pitch) Rx(roll)), without
// jumps of whole turns; each component is then a table of its own (motion_table.h).
//
//   pose_table: {output: base, csv: imu.csv, imu: {rest_s: 0.5, end: return}}
//
// What an inertial measurement unit at the output's frame shows, angular velocity ω (or an
// orientation) and specific force f in its axes, becomes a pose by
//
//   Ṙ = R [ω − b_ω]×                                                                          (1)
//   v̇ = R (f − b_f) + g − c(t),  ẋ = v                                                        (2)
//
// from the output's home pose at rest. Biases b_ω, b_f: what it shows in its first rest_s, where it
// rests at home. c = α + β t: at the end it is at rest (`end: rest`, β = 0), or at rest where it
// started (`return`, which takes a constant b_ω more); nothing with `end: free`. What is taken off
// is a note of the table. (1) by Magnus' expansion of fourth order, (2) by Simpson's rule.

/// A commanded component of an output's pose.
struct PoseComponent {
  int component = 0;  ///< x, y, z, roll, pitch, yaw
  MotionTable table;
};

/// What a pose table commands.
struct PoseTable {
  int output = -1;  ///< index into Mechanism::outputs
  std::vector<PoseComponent> components;
};

/// Reads and loads it; findings as in LoadMotionTable(). No components after an error.
[[nodiscard]] PoseTable LoadPoseTable(ValueReader* values, const YamlNode& node,
                                      const Mechanism& mechanism, Diagnostics* files);

}  // namespace mbv
