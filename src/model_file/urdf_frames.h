// Inside of the URDF export: how joints map to URDF joints and bodies to links.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

/// Limits beyond this are no limits: URDF wants numbers for every prismatic joint.
inline constexpr double kUrdfNoLimit = 1e9;

/// One URDF joint of the chain that stands for a joint.
struct UrdfStep {
  std::string name;
  std::string type;  ///< URDF's word
  Vec3 axis;         ///< in the joint frame
  CoordinateRange range;
  int coordinate = 0;  ///< of the joint; -1 for fixed and floating
};

/// The mechanism with the frames of its balls turned so that their coordinates are zero at home. A
/// ball of the tree becomes three hinges, which lose a freedom where the middle one is at 90
/// degrees: from home, they are the farthest from there. Balls with limits stay as they are.
[[nodiscard]] Mechanism WithBallsAtZero(const Mechanism& mechanism);

/// The chain, inboard first. `reversed`: the tree runs from the child to the parent.
[[nodiscard]] std::vector<UrdfStep> UrdfSteps(const Joint& joint, bool reversed);

/// True for an element that <dynamics> of a URDF joint says: damping of a joint in the tree.
[[nodiscard]] bool IsUrdfDynamics(const Mechanism& mechanism, const ForceElement& element);

/// X_BL per body: the pose of its URDF link frame.
[[nodiscard]] std::vector<Pose> UrdfLinkFrames(const Mechanism& mechanism);

/// "#rrggbb[aa]" as 0…1; empty for other text.
[[nodiscard]] std::optional<std::array<double, 4>> HexColor(const std::string& text);

}  // namespace mbv
