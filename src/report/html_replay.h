// The 3D replay of report.html: shapes and poses as data.
#pragma once

#include <nlohmann/json.hpp>

#include "report/html_report.h"

namespace mbv {

/// Bodies with shapes and poses (at most 600 frames; fewer when there are many bodies), drives,
/// loop closures, springs and outputs; meshes decimated to 50 000 triangles together. Positions in
/// metres, rotations as quaternions x, y, z, w.
[[nodiscard]] nlohmann::ordered_json ReplayJson(const HtmlInput& input);

}  // namespace mbv
