// The sea as a square tile that joins seamlessly.
#pragma once

#include <cstdint>
#include <vector>

namespace mbv::render {

/// size × size RGB: a sea with small waves.
[[nodiscard]] std::vector<std::uint8_t> WaterTexture(int size);

}  // namespace mbv::render
