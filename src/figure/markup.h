// The small markup of figures' texts for each way to write them.
#pragma once

#include <string>
#include <string_view>

namespace mbv {

/// For Pango in a font of this size [pt]: <i>F</i>, smaller and raised spans; escaped.
[[nodiscard]] std::string ToPango(std::string_view markup, double font_pt);
/// For TeX: \textit{F}, \textsubscript{max}, with its special characters escaped.
[[nodiscard]] std::string ToTex(std::string_view markup);
/// A text that is shown as it is: its '*', "_{" and "^{" are no markup.
[[nodiscard]] std::string Verbatim(std::string_view text);

}  // namespace mbv
