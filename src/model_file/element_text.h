// Force elements, bushings and couplings as text of model files.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "mechanism/mechanism.h"

namespace mbv {

/// Name and coordinate by which a file calls the joint of a term.
using TermNames = std::function<std::pair<std::string, int>(const Coupling::Term&)>;
/// ", coordinate: 1" behind a joint's name, empty for the first coordinate.
[[nodiscard]] std::string CoordinateText(int coordinate);
/// The same of a ball's rotation, whose three elements are one in a file: only its first is
/// written, by the name that they share.
inline constexpr const char* kRotationText = ", coordinate: rotation";
[[nodiscard]] bool IsFurtherOfBall(const Mechanism& mechanism, const ForceElement& element);
[[nodiscard]] std::string FileName(const Mechanism& mechanism, const ForceElement& element);
/// The lines of a force element as a model file's map, without braces: "kind: damping, …". `place`:
/// "joint: …, coordinate: …" or "drive: …". `slides`: its coordinate is a length.
[[nodiscard]] std::string ElementText(const ForceElement& element, const std::string& place,
                                      bool slides);
/// ", axis_on: BODY, axis: …" behind the place of a rotor that its carrier turns.
[[nodiscard]] std::string CarrierText(const RotorAxis& axis, const std::string& body);
/// The lines of a bushing with its elements as a model file's map, without braces, between frames
/// that are called `parent` and `child`.
[[nodiscard]] std::string BushingText(const Mechanism& mechanism, int bushing,
                                      const std::string& parent, const std::string& child);
/// The lines of a coupling as a model file's map, without braces: "joint: …, follows: …, ratio: …",
/// or a sum of linear terms.
[[nodiscard]] std::string CouplingText(const Coupling& coupling, const TermNames& name_of);

}  // namespace mbv
