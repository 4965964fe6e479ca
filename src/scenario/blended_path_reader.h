// Keys of `motion.path` with `blend`: polylines with rounded corners.
#pragma once

#include <optional>
#include <vector>

#include "core/blended_path.h"
#include "input/value_reader.h"

namespace mbv {

/// Everything but the points; empty after a finding.
[[nodiscard]] std::optional<PolylinePlan> ReadBlendedPlan(ValueReader* values, const YamlMap& map);

/// The motion of every axis; empty after a finding, at `node`.
[[nodiscard]] std::vector<Piecewise> PlanPath(YamlReader* yaml, const YamlNode& node,
                                              const PolylinePlan& plan);

}  // namespace mbv
