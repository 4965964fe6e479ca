// The planar linkage closed by Newton's method on its five pin positions: the audit's independent
// computation. No angle and no formula of the paper enters; only the rod lengths.
#pragma once

#include <random>
#include <vector>

#include "audit/cabin_audit.h"

namespace mbv::cabin_audit {

using Vec2 = Eigen::Vector2d;

/// Pins of the linkage in the carriage frame.
struct Pins {
  Vec2 A, B, C, D, E, F;
  [[nodiscard]] double alpha() const { return std::atan2(B.y() - A.y(), B.x() - A.x()); }
  [[nodiscard]] double gamma() const { return std::atan2(C.y() - B.y(), C.x() - B.x()); }
  [[nodiscard]] double beta() const { return std::atan2(C.y(), D.x() - C.x()); }
  [[nodiscard]] double epsilon() const { return std::atan2(E.y(), F.x() - E.x()); }
  [[nodiscard]] Vec2 K() const { return 0.5 * (B + C); }
};

/// A pose of the sliders with constant accelerations: X(t) = x + v t + a t²/2.
struct SliderMotion {
  Vec3 x, v, a;  ///< sliders A, D, F
  Pins start;
};

/// Pins at time t of the motion, by Newton from the start pose.
[[nodiscard]] Pins Close(const Lengths& lengths, const SliderMotion& motion, double t);

/// Seeded random motions around regular poses of the workspace.
[[nodiscard]] std::vector<SliderMotion> RandomMotions(const Lengths& lengths, int count);

}  // namespace mbv::cabin_audit
