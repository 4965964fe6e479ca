// Settings in the text of an MJCF file: of closures, to change them; of servos, to know them.
#pragma once

#include <map>
#include <string>

namespace mbv::mjcf {

/// The text with lines before </mujoco>, where later settings override earlier ones.
[[nodiscard]] std::string WithLines(const std::string& text, const std::string& lines);

/// The text with these attributes on every `connect` and `weld`; an empty one stays as it is. The
/// text itself where it is not XML.
[[nodiscard]] std::string WithClosureSettings(const std::string& text, const std::string& solref,
                                              const std::string& solimp);

/// `kv` of the `position` actuators that state one, by their name, else by their joint: MuJoCo 2.2
/// has no such attribute, later versions push with −kv times the velocity.
[[nodiscard]] std::map<std::string, double> ServoDampings(const std::string& text);

}  // namespace mbv::mjcf
