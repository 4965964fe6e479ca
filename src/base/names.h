// Names that become files and folders: of models, scenarios and results.
#pragma once

#include <string>
#include <string_view>

namespace mbv {

inline constexpr size_t kLongestName = 64;
inline constexpr const char* kNameRule =
    "a letter, then letters, digits and '_', at most 64 characters";

/// Whether a name follows kNameRule (ASCII letters and digits).
[[nodiscard]] bool IsName(std::string_view name);

/// "My arm-2" → "My_arm_2"; "" when nothing is left.
[[nodiscard]] std::string NearestName(const std::string& name);

/// A path that stays below the folder it is appended to, whatever it says: parts between single
/// '/', none empty, none beginning with '.' (so no "..", nothing hidden), without control
/// characters and '\', at most 200 bytes each.
[[nodiscard]] bool IsPlainPath(std::string_view path);

/// The nearest such path: what is not allowed becomes '_'. "" stays "".
[[nodiscard]] std::string NearestPlainPath(std::string_view path);

}  // namespace mbv
