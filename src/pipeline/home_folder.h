// Whether a text tells whose machine it was written on.
#pragma once

#include <string>

namespace mbv {

/// The line (1-based) of the first mention of `path` as a path in `text`; 0 without one.
[[nodiscard]] int LineNaming(const std::string& text, const std::string& path);
/// $HOME where it is a folder that tells who its owner is; "" else.
[[nodiscard]] std::string HomeFolder();

}  // namespace mbv
