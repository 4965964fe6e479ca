// Colours that a shape may have, for pictures and for the MJCF alike.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace mbv {

/// Red, green, blue, opacity, each 0 … 1, of a name ("steel", "accent", …) or of "#rrggbb[aa]";
/// any other text gives grey.
[[nodiscard]] std::array<double, 4> ShapeColor(const std::string& color);

/// True for the names and the "#…" form that ShapeColor knows.
[[nodiscard]] bool IsShapeColor(const std::string& color);

/// The names, sorted.
[[nodiscard]] std::vector<std::string> ShapeColorNames();

}  // namespace mbv
