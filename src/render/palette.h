// Materials by name.
#pragma once

#include <array>
#include <string>

namespace mbv::render {

/// A surface. Colours are display values 0 … 1.
struct Material {
  std::array<float, 4> rgba{0.6F, 0.6F, 0.6F, 1.0F};
  float specular = 0.3F;   ///< strength of the highlight, 0 … 1
  float shininess = 0.4F;  ///< narrowness of the highlight, 0 … 1
  float emission = 0.0F;   ///< light of its own, 0 … 1
};

/// The material of a shape's colour (mechanism/colors.h) or of a mark: closure, gap, pull, push,
/// x_axis, y_axis, z_axis, path.
[[nodiscard]] Material MaterialOf(const std::string& color);

/// Shapes of these materials ("sea", "hull", "deck") are surroundings: drawn, but the automatic
/// camera does not have to fit them.
[[nodiscard]] bool IsScenery(const std::string& color);

}  // namespace mbv::render
