// Numbers in JSON, and JSON as the text of a file. Writing and parsing are compiled once
// (json_text.cc): the library's templates cost each file that uses them seconds. What others may
// have written is read by json_document.h.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace mbv {

/// NaN and infinity have no JSON number and become null.
inline nlohmann::ordered_json Number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

/// `blanks` per level, and a line feed at the end; bytes that are no text become U+FFFD.
[[nodiscard]] std::string Dump(const nlohmann::ordered_json& json, int blanks = 2);

// The rest is there of nlohmann::json and of ordered_json.

/// In one line, without a line feed.
template <typename Json>
[[nodiscard]] std::string DumpLine(const Json& json);
/// Throws the library's parse_error.
template <typename Json>
[[nodiscard]] Json ParseJson(std::string_view text);
/// is_discarded() where the text is not JSON, or nested more than 100 levels deep.
template <typename Json>
[[nodiscard]] Json ParseIfJson(std::string_view text);

}  // namespace mbv
