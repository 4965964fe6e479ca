// From where most of a mechanism is seen.
#pragma once

#include <vector>

#include "mechanism/mechanism.h"
#include "render/render.h"
#include "render/scene.h"

namespace mbv::render {

/// Share of the mechanism's joints and drive ends (0 … 1, over all frames) that no solid hides from
/// a far camera in the direction `to_camera_W`.
[[nodiscard]] double VisibleShare(const Mechanism& mechanism,
                                  const std::vector<PictureFrame>& frames, const Scale& scale,
                                  const PictureOptions& options, const Vec3& to_camera_W);

/// The options' view with the azimuth and elevation that it leaves open: azimuth -60° and elevation
/// 16° unless clearly more is seen from elsewhere.
[[nodiscard]] CameraView BestView(const Mechanism& mechanism,
                                  const std::vector<PictureFrame>& frames, const Scale& scale,
                                  const PictureOptions& options, const Mat3& R_DW);

}  // namespace mbv::render
