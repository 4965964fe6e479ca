// Numbers in JSON, and JSON as the text of a file.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

namespace mbv {

/// NaN and infinity have no JSON number and become null.
inline nlohmann::ordered_json Number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

/// Two blanks per level, and a line feed at the end; bytes that are no text become U+FFFD.
inline std::string Dump(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace mbv
