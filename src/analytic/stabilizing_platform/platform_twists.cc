#include "analytic/stabilizing_platform/platform_twists.h"

#include <cmath>

namespace mbv::stabilizing_platform {
namespace {

// Ad(g) V for g = (R, p), without forming the 6 × 6 matrix.
Vec6 Transform(const Mat3& R, const Vec3& p, const Vec6& V) {
  Vec6 out;
  const Vec3 omega = R * V.head<3>();
  out << omega, R * V.tail<3>() + p.cross(omega);
  return out;
}

}  // namespace

FrameMotion LowerPlatformMotion(const Jet& roll, const Jet& pitch, const Jet& heave,
                                double s_r_so) {
  const double ca = std::cos(roll.value), sa = std::sin(roll.value);
  const double cb = std::cos(pitch.value), sb = std::sin(pitch.value);
  FrameMotion o;
  o.R_EB << cb, 0, sb, sa * sb, ca, -sa * cb, -ca * sb, sa, ca * cb;  // Rx(α) Ry(β)
  const Vec3 e_x = Vec3::UnitX(), e_y(0, ca, sa);                     // e_y' = Rx(α) e_y
  o.omega = roll.rate * e_x + pitch.rate * e_y;
  o.epsilon =
      roll.acceleration * e_x + pitch.acceleration * e_y + roll.rate * pitch.rate * e_x.cross(e_y);
  const Vec3 r_so = s_r_so * o.R_EB.col(2);
  o.p_EB = Vec3(0, 0, heave.value) + r_so;
  const Vec3 omega_r = o.omega.cross(r_so);
  o.v = Vec3(0, 0, heave.rate) + omega_r;
  o.a = Vec3(0, 0, heave.acceleration) + o.epsilon.cross(r_so) + o.omega.cross(omega_r);
  return o;
}

FrameMotion UpperPlatformMotion(const std::array<Jet, 6>& q) {
  const auto& [x, y, z, roll, pitch, yaw] = q;
  const double cr = std::cos(roll.value), sr = std::sin(roll.value);
  const double cp = std::cos(pitch.value), sp = std::sin(pitch.value);
  const double cy = std::cos(yaw.value), sy = std::sin(yaw.value);
  FrameMotion p;
  p.R_EB << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,  //
      sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,        //
      -sp, cp * sr, cp * cr;
  // Axes of the three rates: z of the earth, y after yaw, x after yaw and pitch.
  const Vec3 yaw_rate(0, 0, yaw.rate), e_y(-sy, cy, 0), e_x = p.R_EB.col(0);
  const Vec3 pitch_rate = pitch.rate * e_y, roll_rate = roll.rate * e_x;
  p.omega = yaw_rate + pitch_rate + roll_rate;
  p.epsilon = Vec3(0, 0, yaw.acceleration) + pitch.acceleration * e_y + roll.acceleration * e_x +
              yaw_rate.cross(pitch_rate) + (yaw_rate + pitch_rate).cross(roll_rate);
  p.p_EB = {x.value, y.value, z.value};
  p.v = {x.rate, y.rate, z.rate};
  p.a = {x.acceleration, y.acceleration, z.acceleration};
  return p;
}

Vec6 TwistOf(const FrameMotion& m) {
  Vec6 V;
  V << m.omega, m.v - m.omega.cross(m.p_EB);  // (8), (10)
  return V;
}

Vec6 SpatialAccelerationOf(const FrameMotion& m) {
  Vec6 A;
  A << m.epsilon, m.a - m.epsilon.cross(m.p_EB) - m.omega.cross(m.v);  // (9), (11)
  return A;
}

RelativeMotion ComputeRelativeMotion(const FrameMotion& lower, const FrameMotion& upper, double g) {
  // Everything to {o}: Ad(g_oe) of the earth-frame twists and accelerations.
  const Mat3 R_oe = lower.R_EB.transpose();
  const Vec3 p_oe = -(R_oe * lower.p_EB);
  RelativeMotion m;
  m.R_op = R_oe * upper.R_EB;
  m.p_op = R_oe * (upper.p_EB - lower.p_EB);
  m.V_eo = Transform(R_oe, p_oe, TwistOf(lower));
  m.A_eo = Transform(R_oe, p_oe, SpatialAccelerationOf(lower));
  m.V_ep = Transform(R_oe, p_oe, TwistOf(upper));
  m.A_ep = Transform(R_oe, p_oe, SpatialAccelerationOf(upper));
  m.V_op = m.V_ep - m.V_eo;                            // (12)
  m.A_op = m.A_ep - m.A_eo - Bracket(m.V_eo, m.V_op);  // (13)
  m.gravity = -g * R_oe.col(2);
  return m;
}

}  // namespace mbv::stabilizing_platform
