// Poses that are not the mechanism's own at the moment: moved apart, or of other instants.
#pragma once

#include <vector>

#include "mechanism/mechanism.h"
#include "render/render.h"
#include "render/scene.h"

namespace mbv::render {

/// The frame with its bodies and those of its ghosts moved away from the mean of their centres of
/// mass by this factor (>= 1); the world stays.
[[nodiscard]] PictureFrame Exploded(const Mechanism& mechanism, const PictureFrame& frame,
                                    double factor);

/// All frames, each followed by its ghosts as frames without forces and captions.
[[nodiscard]] std::vector<PictureFrame> WithGhosts(const std::vector<PictureFrame>& frames);

/// Per ghost of a frame: its solids but for those that stand where one of `now` stands.
[[nodiscard]] std::vector<std::vector<Item>> GhostItems(const Mechanism& mechanism,
                                                        const PictureFrame& frame,
                                                        const std::vector<Item>& now,
                                                        const Scale& scale,
                                                        const PictureOptions& options);

}  // namespace mbv::render
