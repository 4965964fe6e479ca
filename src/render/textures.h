// Painted ground: square tiles that join seamlessly.
#pragma once

#include <cstdint>
#include <vector>

namespace mbv::render {

/// size × size RGB: a light floor with 5 × 5 fields of thin grid lines.
[[nodiscard]] std::vector<std::uint8_t> GridTexture(int size);
/// size × size RGB: a sea with small waves.
[[nodiscard]] std::vector<std::uint8_t> WaterTexture(int size);

}  // namespace mbv::render
