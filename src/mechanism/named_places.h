// Where the named parts of a mechanism are, for labels.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

/// What a label's word may ask for.
enum class PlaceKind { kOutput, kDrive, kJoint, kFrame, kBody };

/// A name and its place: halfway between a point of one body and a point of another.
struct NamedPlace {
  PlaceKind kind = PlaceKind::kBody;
  std::string name;  ///< of a frame "BODY.FRAME"
  int body_a = 0, body_b = 0;
  Vec3 p_a = Vec3::Zero(), p_b = Vec3::Zero();  ///< in the bodies' frames [m]
};

/// Outputs, drives, joints that hold something, frames, bodies but the world, in this order.
[[nodiscard]] std::vector<NamedPlace> NamedPlacesOf(const Mechanism& mechanism);

/// The words that ask for a kind: "joints", "frames", "bodies", "usual".
[[nodiscard]] const std::vector<std::string>& PlaceWords();

/// Those that one of the words asks for, by its kind or by its name; "usual" asks for outputs,
/// drives and joints. A name that several have stands for the first.
[[nodiscard]] std::vector<NamedPlace> PlacesFor(const Mechanism& mechanism,
                                                const std::vector<std::string>& words);

// Colours that a shape may have, for pictures and for the MJCF alike.

/// Red, green, blue, opacity, each 0 … 1, of a name ("steel", "accent", …) or of "#rrggbb[aa]";
/// any other text gives grey.
[[nodiscard]] std::array<double, 4> ShapeColor(const std::string& color);

/// True for the names and the "#…" form that ShapeColor knows.
[[nodiscard]] bool IsShapeColor(const std::string& color);

/// The names, sorted.
[[nodiscard]] std::vector<std::string> ShapeColorNames();

}  // namespace mbv
