// Settings of closures, changed in the text of an MJCF file.
#pragma once

#include <string>

namespace mbv::mjcf {

/// The text with lines before </mujoco>, where later settings override earlier ones.
[[nodiscard]] std::string WithLines(const std::string& text, const std::string& lines);

/// The text with these attributes on every `connect` and `weld`; an empty one stays as it is. The
/// text itself where it is no XML.
[[nodiscard]] std::string WithClosureSettings(const std::string& text, const std::string& solref,
                                              const std::string& solimp);

}  // namespace mbv::mjcf
