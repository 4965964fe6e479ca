// Numbers in JSON.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

namespace mbv {

/// NaN and infinity have no JSON number and become null.
inline nlohmann::ordered_json Number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

}  // namespace mbv
