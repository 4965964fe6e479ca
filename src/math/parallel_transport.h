// A body with a line n(t) that does not turn about that line: n is transported parallel.
//
// Over a step from n0 to n1, of which value, rate and acceleration are known at both ends, n(t) is
// the polynomial of degree five through these, put back to unit length. The least rotation L(t)
// from n0 to n(t) turns about n at the rate −(n0 × n)·ṅ / (1 + n0·n), so that
//   R1 = exp(ψ n1) L1 R0,  ψ = ∫ (n0 × n)·ṅ / (1 + n0·n) dt                                     (1)
// by Gauss's rule with four points; the error of a step h is of the order h⁷.
#pragma once

#include "base/types.h"

namespace mbv {

/// A unit vector with its derivatives.
struct MovingDirection {
  Vec3 n = Vec3::UnitZ(), rate = Vec3::Zero(), acceleration = Vec3::Zero();
};
/// That of a line in a body with angular velocity ω and acceleration ε.
[[nodiscard]] inline MovingDirection DirectionOf(const Vec3& n, const Vec3& w, const Vec3& alpha) {
  return {n, w.cross(n), alpha.cross(n) + w.cross(w.cross(n))};
}

/// (1)
[[nodiscard]] Mat3 Transported(const Mat3& R0, const MovingDirection& from,
                               const MovingDirection& to, double h);

/// The least rotation that brings the direction of n0 to that of n1; of opposite ones, one of them.
[[nodiscard]] Mat3 LeastRotation(const Vec3& n0, const Vec3& n1);

/// Angle [rad] about n by which R is turned beyond R0, where both agree on n.
[[nodiscard]] double TurnBeyond(const Mat3& R0, const Mat3& R, const Vec3& n);

}  // namespace mbv
