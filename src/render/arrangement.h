// What all pictures of one call share: orientation, sizes, camera, ground and legend.
#pragma once

#include <vector>

#include "mechanism/mechanism.h"
#include "render/annotations.h"
#include "render/camera.h"
#include "render/render.h"
#include "render/scene.h"
#include "render/stage.h"

namespace mbv::render {

struct Arrangement {
  Mat3 R_DW = Mat3::Identity();
  Scale scale;
  Camera camera;
  StageOptions stage;
  Vec3 forward_W = Vec3::UnitX();  ///< the camera's direction of view
};

/// Camera, ground and stage that suit all frames together.
[[nodiscard]] Arrangement Arrange(const Mechanism& mechanism,
                                  const std::vector<PictureFrame>& frames, const Overlay& overlay,
                                  const PictureOptions& options);
/// What the marks in the pictures mean.
[[nodiscard]] std::vector<LegendEntry> LegendOf(const Mechanism& mechanism,
                                                const Arrangement& arrangement,
                                                const Overlay& overlay,
                                                const PictureOptions& options);

}  // namespace mbv::render
