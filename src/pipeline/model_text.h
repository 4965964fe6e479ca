// What is known about a model: mobility report, generated MJCF and URDF.
#pragma once

#include <string>

#include "mechanism/mechanism.h"

namespace mbv {

/// Size, freedoms, redundant constraints, what the drives determine, which forces are unique.
[[nodiscard]] std::string MobilityText(const Mechanism& mechanism);

/// "mjcf" or "urdf" text of a mechanism.
enum class ModelFormat { kMjcf, kUrdf };
[[nodiscard]] std::string ModelText(const Mechanism& mechanism, ModelFormat format);

}  // namespace mbv
