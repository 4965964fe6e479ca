// Animated PNG: a video that every browser plays and that needs no codec.
#pragma once

#include <string>
#include <vector>

#include "pipeline/pictures.h"

namespace mbv {

/// Joins PNG pictures of one size and colour type into an endless animation.
/// [APNG Specification 1.0: acTL, fcTL, fdAT]
[[nodiscard]] std::string AnimatedPng(const std::vector<PictureFile>& pictures,
                                      double frames_per_s);

}  // namespace mbv
