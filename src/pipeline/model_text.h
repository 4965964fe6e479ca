// What is known about a model: mobility report, generated MJCF and URDF.
#pragma once

#include <string>

#include "mechanism/mechanism.h"

namespace mbv {

/// Mobility report for people or as JSON, or the generated MJCF or URDF.
enum class ModelFormat { kMobility, kJson, kMjcf, kUrdf };
[[nodiscard]] std::string ModelText(const Mechanism& mechanism, ModelFormat format);

}  // namespace mbv
