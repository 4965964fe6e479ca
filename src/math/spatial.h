// Skew matrices, adjoints and rotations: the basic screw algebra every layer may use.
// [Murray, Li, Sastry 1994, ch. 2], with the rotation first in twists and the moment first in
// wrenches.
#pragma once

#include <cmath>

#include "base/types.h"

namespace mbv {

/// [v]×, so that Skew(v) * x = v × x.
inline Mat3 Skew(const Vec3& v) {
  Mat3 S;
  S << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return S;
}

/// Spatial inertia about the frame origin (6×6, rotation first), for mass m [kg], centre of mass
/// c [m] and rotational inertia I_cm [kg m²] about the centre of mass, all in the frame's axes.
inline Mat6 SpatialInertia(double m, const Vec3& c, const Mat3& I_cm) {
  Mat6 N;
  const Mat3 C = Skew(c);
  N << I_cm - m * C * C, m * C, -m * C, m * Mat3::Identity();
  return N;
}

/// The wrench F about point P, moved to act about point Q: m_Q = m_P + p_QP × f.
inline Vec6 ShiftWrench(const Vec6& F_P, const Vec3& p_QP) {
  Vec6 F_Q = F_P;
  F_Q.head<3>() += p_QP.cross(F_P.tail<3>());
  return F_Q;
}

/// Twist of P for a unit rotation about an axis (unit vector) through Q.
inline Vec6 RotationScrew(const Vec3& axis, const Vec3& p_PQ) {
  Vec6 screw;
  screw << axis, p_PQ.cross(axis);
  return screw;
}

/// Twist for a unit translation along an axis (unit vector).
inline Vec6 TranslationScrew(const Vec3& axis) {
  Vec6 screw;
  screw << Vec3::Zero(), axis;
  return screw;
}

inline Mat3 RotX(double a) { return Eigen::AngleAxisd(a, Vec3::UnitX()).toRotationMatrix(); }
inline Mat3 RotY(double a) { return Eigen::AngleAxisd(a, Vec3::UnitY()).toRotationMatrix(); }
inline Mat3 RotZ(double a) { return Eigen::AngleAxisd(a, Vec3::UnitZ()).toRotationMatrix(); }

/// Rz(yaw) Ry(pitch) Rx(roll), the URDF convention.
inline Mat3 RotRpy(const Vec3& rpy) { return RotZ(rpy.z()) * RotY(rpy.y()) * RotX(rpy.x()); }

/// Roll, pitch, yaw of R = Rz Ry Rx, pitch in [-π/2, π/2]. At pitch = ±π/2 roll and yaw are not
/// unique; they are then one of the pairs that reproduce R.
inline Vec3 RpyOf(const Mat3& R) {
  const double yaw = std::atan2(R(1, 0), R(0, 0));
  const double c = std::cos(yaw), s = std::sin(yaw);
  // Rz(-yaw) R = Ry Rx holds whatever yaw came from rounding.
  return {std::atan2(s * R(0, 2) - c * R(1, 2), c * R(1, 1) - s * R(0, 1)),
          std::atan2(-R(2, 0), c * R(0, 0) + s * R(1, 0)), yaw};
}

/// Rotation vector log(R) [rad], |log| in [0, π].
inline Vec3 LogRotation(const Mat3& R) {
  const Eigen::AngleAxisd aa(R);
  return aa.angle() * aa.axis();
}

/// exp of a rotation vector [rad].
inline Mat3 ExpRotation(const Vec3& r) {
  const double angle = r.norm();
  if (angle < 1e-12) return Mat3::Identity() + Skew(r);
  return Eigen::AngleAxisd(angle, r / angle).toRotationMatrix();
}

// A body with a line n(t) that does not turn about that line: n is transported parallel.
//
// Over a step from n0 to n1, of which value, rate and acceleration are known at both ends, n(t) is
// the polynomial of degree five through these, put back to unit length. The least rotation L(t)
// from n0 to n(t) turns about n at the rate −(n0 × n)·ṅ / (1 + n0·n), so that
//   R1 = exp(ψ n1) L1 R0,  ψ = ∫ (n0 × n)·ṅ / (1 + n0·n) dt                                     (1)
// by Gauss's rule with four points; the error of a step h is of the order h⁷.

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
