// The joint kinds, one row each. The mathematics of each kind stands in joint_pose.cc (poses,
// twists, steps, what is locked) and joint_coordinate.h (coordinates); its switches have no
// default, so that the compiler names every place that a new kind must fill.
//
// X_FM as a function of the coordinates (`axis` in F, same components in M):
//   fixed        –                    X_FM = 1
//   revolute     θ                    Rot(axis, θ)
//   prismatic    s                    translation s·axis
//   cylindrical  s, θ                 translation s·axis, Rot(axis, θ)
//   universal    θ1, θ2               Rot(axis, θ1) Rot(axis2, θ2); axis fixed in F, axis2 in M
//   spherical    roll, pitch, yaw     Rz(yaw) Ry(pitch) Rx(roll) (coordinates for guesses only)
//   planar       u, v, θ              translation u·e1 + v·e2, Rot(axis, θ); e1, e2, axis
//                                     right-handed (axis z: x, y; axis x: y, z; axis y: z, x;
//                                     else e1 = the axis' unitOrthogonal())
//   point_on_line   s, a ball's       translation s·axis, turned as a ball: M's origin stays
//                                     on the line through F's along axis
//   point_on_plane  u, v, a ball's    translation u·e1 + v·e2 as planar, turned as a ball: M's
//                                     origin stays in the plane through F's across axis
//   free         x, y, z, roll, pitch, yaw
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace mbv {

enum class JointKind {
  kFixed,
  kRevolute,
  kPrismatic,
  kCylindrical,
  kUniversal,
  kSpherical,
  kPlanar,
  kPointOnLine,
  kPointOnPlane,
  kFree
};

struct JointKindRow {
  JointKind kind;
  std::string_view word;  ///< in model files and messages
  /// One letter per coordinate: 's' slides [m], 't' turns about an axis [rad], 'b' is one of a
  /// ball's roll, pitch, yaw [rad], which have no axis to drive or to guide.
  std::string_view coordinates;
  int axes;  ///< that describe it: none, `axis`, or `axis` and `axis2`
  /// May be marked `transmits: force`: its translations are locked, so a ball can stand for it.
  bool may_transmit_force_only;
};

/// By JointKind.
inline constexpr std::array kJointKindRows = {
    JointKindRow{JointKind::kFixed, "fixed", "", 0, false},
    JointKindRow{JointKind::kRevolute, "revolute", "t", 1, true},
    JointKindRow{JointKind::kPrismatic, "prismatic", "s", 1, false},
    JointKindRow{JointKind::kCylindrical, "cylindrical", "st", 1, false},
    JointKindRow{JointKind::kUniversal, "universal", "tt", 2, true},
    JointKindRow{JointKind::kSpherical, "spherical", "bbb", 0, true},
    JointKindRow{JointKind::kPlanar, "planar", "sst", 1, false},
    JointKindRow{JointKind::kPointOnLine, "point_on_line", "sbbb", 1, false},
    JointKindRow{JointKind::kPointOnPlane, "point_on_plane", "ssbbb", 1, false},
    JointKindRow{JointKind::kFree, "free", "sssbbb", 0, false}};

namespace internal {
constexpr bool JointKindRowsAreInOrder() {
  for (std::size_t i = 0; i < kJointKindRows.size(); ++i) {
    if (static_cast<std::size_t>(kJointKindRows[i].kind) != i) return false;
  }
  return true;
}
static_assert(JointKindRowsAreInOrder());
}  // namespace internal

[[nodiscard]] constexpr const JointKindRow& RowOf(JointKind kind) {
  return kJointKindRows.at(static_cast<std::size_t>(kind));
}

/// The word for a kind in model files and messages.
[[nodiscard]] constexpr std::string_view WordOf(JointKind kind) { return RowOf(kind).word; }

/// Number of coordinates = DOFs of a joint kind.
[[nodiscard]] constexpr int DofsOf(JointKind kind) {
  return static_cast<int>(RowOf(kind).coordinates.size());
}

/// True when a coordinate of a joint is a length (else it is an angle).
[[nodiscard]] constexpr bool IsLength(JointKind kind, int coordinate) {
  return coordinate < DofsOf(kind) &&
         RowOf(kind).coordinates[static_cast<std::size_t>(coordinate)] == 's';
}

/// True when one of its coordinates is a length.
[[nodiscard]] constexpr bool MaySlide(JointKind kind) {
  return RowOf(kind).coordinates.find('s') != std::string_view::npos;
}

/// True when it turns as a ball does, so that its rotation has no axis.
[[nodiscard]] constexpr bool HasBall(JointKind kind) {
  return RowOf(kind).coordinates.find('b') != std::string_view::npos;
}

/// True when a coordinate is one of a ball's.
[[nodiscard]] constexpr bool IsOfBall(JointKind kind, int coordinate) {
  return coordinate < DofsOf(kind) &&
         RowOf(kind).coordinates[static_cast<std::size_t>(coordinate)] == 'b';
}

/// The first coordinate of a ball's, or -1.
[[nodiscard]] constexpr int FirstOfBall(JointKind kind) {
  const std::size_t at = RowOf(kind).coordinates.find('b');
  return at == std::string_view::npos ? -1 : static_cast<int>(at);
}

/// Which of M's axes an element on a ball's coordinate is about: 0, 1, 2.
[[nodiscard]] constexpr int BallAxis(JointKind kind, int coordinate) {
  return coordinate - FirstOfBall(kind);
}

/// True where an engine has a coordinate of its own for it: not for those of a ball, nor for a free
/// joint's, which move together.
[[nodiscard]] constexpr bool IsScalar(JointKind kind, int coordinate) {
  return kind != JointKind::kFree && !IsOfBall(kind, coordinate);
}

}  // namespace mbv
