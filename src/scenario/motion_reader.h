// The `motion:`, `loads:` and `forces:` sections of a scenario.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "math/quintic_spline.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "model_file/yaml/value_reader.h"

namespace mbv {

// Keys of `motion.path` with `blend`: polylines with rounded corners.

/// Everything but the points; empty after a finding.
[[nodiscard]] std::optional<PolylinePlan> ReadBlendedPlan(ValueReader* values, const YamlMap& map);

/// The motion of every axis; empty after a finding, at `node`.
[[nodiscard]] std::vector<Piecewise> PlanPath(YamlReader* yaml, const YamlNode& node,
                                              const PolylinePlan& plan);

// Numbers of a scenario that follow from time and from the mechanism's state.
//
//   "-k*(slider.position - 0.1) - c*slider.velocity + 5*sin(2*pi*t)"
// Names with dots are coordinates (StateCoordinates()) with .position or .velocity behind, t is the
// time [s]; other names are parameters, which are constants. SI units, radians.

/// True for a text that names the time or a coordinate.
[[nodiscard]] bool FollowsState(const ValueReader& values, const YamlNode& node);

/// Empty after a finding.
[[nodiscard]] std::optional<StateFunction> ReadStateFunction(ValueReader* values,
                                                             const Mechanism& mechanism,
                                                             const YamlNode& node,
                                                             const std::string& path);

/// Times for a motion that states none, from a table that it is compared with.
struct MotionTimes {
  std::optional<double> duration_s, sample_s;
};

/// Reads the sections against a mechanism, with the tables that profiles name. Findings go to the
/// reader, those about tables' files to `files`; the motion is complete only if there was no error.
[[nodiscard]] Motion ReadMotion(ValueReader* values, const Mechanism& mechanism,
                                const YamlNode* motion, const YamlNode* loads,
                                const YamlNode* forces, const MotionTimes& otherwise,
                                Diagnostics* files);

}  // namespace mbv
