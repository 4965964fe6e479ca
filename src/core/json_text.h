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

/// So many blanks per level, and a line feed at the end; bytes that are no text become U+FFFD.
inline std::string Dump(const nlohmann::ordered_json& json, int blanks = 2) {
  return json.dump(blanks, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace mbv
