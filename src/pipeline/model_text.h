// What is known about a model: mobility report, generated MJCF and URDF.
#pragma once

#include <string>

#include "mechanism/mechanism.h"

namespace mbv {

/// Mobility report for people or as JSON, or the generated MJCF, URDF or model.yaml.
enum class ModelFormat { kMobility, kJson, kMjcf, kUrdf, kYaml };
[[nodiscard]] std::string ModelText(const Mechanism& mechanism, ModelFormat format);

}  // namespace mbv
