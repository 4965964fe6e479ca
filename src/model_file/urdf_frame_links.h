// Links that are frames: exporters write a frame as a link of next to no mass, held by a fixed
// joint. Internal to the URDF reader.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "model_file/urdf.h"

namespace mbv::internal {

/// A link below this share of the robot's mass is a frame, or a massless connecting piece.
inline constexpr double kNegligibleShare = 1e-6;
/// A link without inertia, fixed to another one, counts as a mass point below this share.
inline constexpr double kPointMassShare = 1e-3;

/// Makes links that are frames frames of the body that carries them, mass and inertia included:
///
///   * on a fixed joint, with negligible mass, or without inertia and light: joined to their
///     carrier, which gets a frame of the link's name; so are chains of them. Joints and closures
///     on them go over to the carrier; the fixed joint is gone;
///   * on a moving joint, with negligible mass and without inertia: massless connecting pieces; at
///     the end of a chain, with nothing that holds or drives them, frames as well.
///
/// Links named in `keep` stay bodies. What was done is one warning; what really matters and lacks
/// inertia is left for the checks to name. `UrdfTree::frames` lists where each link went.
void FoldFrameLinks(const std::set<std::string>& keep, const std::vector<std::string>& motors,
                    const std::string& file, UrdfTree* tree, Diagnostics* diagnostics);

}  // namespace mbv::internal
