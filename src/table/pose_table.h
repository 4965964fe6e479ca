// `motion.pose_table`: the pose of an output over time, from one file.
//
//   pose_table: {output: platform, csv: path.csv, angles: quaternion, smoothing: auto}
//
// Orientations of every row become roll, pitch and yaw (R = Rz(yaw) Ry(pitch) Rx(roll)), without
// jumps of whole turns; each component is then a table of its own (motion_table.h).
#pragma once

#include <string>
#include <vector>

#include "input/value_reader.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

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
