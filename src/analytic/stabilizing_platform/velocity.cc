#include "analytic/stabilizing_platform/velocity.h"

#include <fmt/format.h>
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

namespace {

constexpr double kSmall = 1e-6;  // of denominators of order 1; below, six digits are lost

// A value and its time derivative.
struct Rated {
  double value = 0, rate = 0;
};

// The constants u1…u3 of (5) and w1…w4 of (6).
struct AzimuthTerms {
  double u1, u2, u3, w1, w2, w3, w4, inverse_t2;

  explicit AzimuthTerms(const PlatformParameters& p) {
    const double s1 = std::sin(p.theta_1), c1 = std::cos(p.theta_1), t1 = s1 / c1;
    const double s2 = std::sin(p.theta_2), c2 = std::cos(p.theta_2), t2 = s2 / c2;
    u1 = s1 * t2 - s2 * t1;
    u2 = t1 * t2 * (s1 - s2);
    u3 = t1 * (1 - c2) - t2 * (1 - c1);
    w1 = u1 * (u2 + u3);
    w2 = u1 * u1 + u2 * u2;
    w3 = u2 * u3 - u1 * u1;
    w4 = u1 * u1 + u3 * u3;
    inverse_t2 = 1 / t2;
  }
};

struct Angle {
  double c, s, t, rate;
  explicit Angle(const Jet& jet)
      : c(std::cos(jet.value)), s(std::sin(jet.value)), t(s / c), rate(jet.rate) {}
};

// W1, W2, U of (6) with rates, for the yaw.
struct YawTerms {
  Rated W1, W2, U;

  YawTerms(const AzimuthTerms& k, const Angle& a, const Angle& b) {
    W1.value = k.w1 * a.s * b.c + k.w2 * a.c * b.s * b.c + k.w3 * b.s;
    W2.value = -k.w1 * a.c * b.s + k.w2 * a.s + k.w3 * a.s * a.c * b.c;
    U.value = k.w2 * (1 - a.c * a.c * b.s * b.s) + k.w4 * a.c * a.c + 2 * k.w3 * a.c * b.c -
              2 * k.w1 * a.s * a.c * b.s;
    const double cos_2a = a.c * a.c - a.s * a.s, cos_2b = b.c * b.c - b.s * b.s;
    W1.rate = k.w1 * (a.c * b.c * a.rate - a.s * b.s * b.rate) +
              k.w2 * (-a.s * b.s * b.c * a.rate + a.c * cos_2b * b.rate) + k.w3 * b.c * b.rate;
    W2.rate = -k.w1 * (-a.s * b.s * a.rate + a.c * b.c * b.rate) + k.w2 * a.c * a.rate +
              k.w3 * (cos_2a * b.c * a.rate - a.s * a.c * b.s * b.rate);
    U.rate = 2 * k.w2 * a.c * b.s * (a.s * b.s * a.rate - a.c * b.c * b.rate) -
             2 * k.w4 * a.c * a.s * a.rate - 2 * k.w3 * (a.s * b.c * a.rate + a.c * b.s * b.rate) -
             2 * k.w1 * (cos_2a * b.s * a.rate + a.s * a.c * b.c * b.rate);
  }
};

// L, M, N of (6) with rates, for the sway along x.
struct SwayTerms {
  Rated L, M, N;

  SwayTerms(double r_b, double k /* 1/tθ2 */, double sign, const Angle& a, const Angle& b,
            const Angle& yaw, const Angle& delta, const Jet& height) {
    const double sec2_a = 1 + a.t * a.t, sec2_b = 1 + b.t * b.t;
    const double kb = k / b.c, kb_rate = kb * b.t * b.rate;
    const Rated zeta{height.value, height.rate};
    const Rated d{delta.s - yaw.s, (delta.c - yaw.c) * yaw.rate};
    const Rated e{delta.c - yaw.c, -(delta.s - yaw.s) * yaw.rate};
    // The brackets behind r_b (…) of L, M, N.
    const Rated in_L{-a.s * kb - a.c * b.t, -a.c * a.rate * kb - a.s * kb_rate +
                                                a.s * b.t * a.rate - a.c * sec2_b * b.rate};
    const Rated in_M{
        sign * a.c * b.t * kb - sec2_b * a.s,
        sign * (-a.s * a.rate * b.t * kb + a.c * sec2_b * b.rate * kb + a.c * b.t * kb_rate) -
            2 * b.t * sec2_b * b.rate * a.s - sec2_b * a.c * a.rate};
    const Rated in_N{a.c * kb - b.t * a.s, -a.s * a.rate * kb + a.c * kb_rate -
                                               sec2_b * b.rate * a.s - b.t * a.c * a.rate};
    L.value = a.t * b.t * zeta.value / a.c + r_b * d.value * in_L.value;
    L.rate = ((sec2_a + a.t * a.t) * b.t * a.rate + a.t * sec2_b * b.rate) * zeta.value / a.c +
             a.t * b.t * zeta.rate / a.c + r_b * (d.rate * in_L.value + d.value * in_L.rate);
    M.value = sec2_b * zeta.value / a.c + r_b * d.value * in_M.value;
    M.rate = sec2_b / a.c * ((2 * b.t * b.rate + a.t * a.rate) * zeta.value + zeta.rate) +
             r_b * (d.rate * in_M.value + d.value * in_M.rate);
    N.value = r_b * delta.s + r_b * e.value * in_N.value;
    N.rate = r_b * delta.c * yaw.rate + r_b * (e.rate * in_N.value + e.value * in_N.rate);
  }
};

RunSummary Singular(const char* where, double amount) {
  return {.stop = Stop::kSingular,
          .message = fmt::format("the parasitic motion is not defined: {} = {:.3g}", where, amount),
          .where = where,
          .amount = amount,
          .unit = "1",
          .names_where = true};
}

// γ with its derivatives.
RunSummary ComputeYaw(const AzimuthTerms& k, const Jet& roll, const Jet& pitch, const Angle& a,
                      const Angle& b, Jet* gamma) {
  // (5)
  const double yaw_y = k.u1 * (b.c - a.c) + k.u2 * a.s * b.s;
  const double yaw_x = k.u3 * a.c + k.u2 * b.c - k.u1 * a.s * b.s;
  const double size = std::abs(k.u1) + std::abs(k.u2) + std::abs(k.u3);
  if (!(std::abs(yaw_x) > kSmall * size)) return Singular("u3 cα + u2 cβ − u1 sα sβ", yaw_x);
  const YawTerms yaw_terms(k, a, b);
  const auto& [W1, W2, U] = yaw_terms;
  if (!(std::abs(U.value) > kSmall * size * size)) return Singular("U", U.value);
  gamma->value = std::atan(yaw_y / yaw_x);
  gamma->rate = (roll.rate * W1.value + pitch.rate * W2.value) / U.value;  // (6)
  gamma->acceleration =
      (roll.acceleration * W1.value + roll.rate * W1.rate + pitch.acceleration * W2.value +
       pitch.rate * W2.rate - gamma->rate * U.rate) /
      U.value;  // (7)
  return RunSummary::Done();
}

}  // namespace

RunSummary ComputeParasiticMotion(const PlatformParameters& p, const Jet& roll, const Jet& pitch,
                                  const Jet& height, SignInM sign, ParasiticMotion* motion) {
  const AzimuthTerms k(p);
  const Angle a(roll), b(pitch);
  if (!(a.c > kSmall)) return Singular("cos(roll)", a.c);
  if (!(b.c > kSmall)) return Singular("cos(pitch)", b.c);

  RunSummary yaw_summary = ComputeYaw(k, roll, pitch, a, b, &motion->yaw);
  if (!yaw_summary.ok()) return yaw_summary;
  const Jet& gamma = motion->yaw;
  const Angle yaw(gamma);
  const Angle delta(Jet{gamma.value + p.theta_2, gamma.rate, gamma.acceleration});
  const double sec2_a = 1 + a.t * a.t, sec2_b = 1 + b.t * b.t;
  motion->y.value = -a.t * height.value - p.r_b * yaw.s;  // (5)
  motion->y.rate =
      -sec2_a * height.value * roll.rate - a.t * height.rate - p.r_b * yaw.c * gamma.rate;  // (6)
  motion->y.acceleration =
      -sec2_a * height.value * roll.acceleration - a.t * height.acceleration -
      p.r_b * yaw.c * gamma.acceleration - 2 * a.t * sec2_a * height.value * roll.rate * roll.rate +
      p.r_b * yaw.s * gamma.rate * gamma.rate - 2 * sec2_a * height.rate * roll.rate;  // (7)

  const SwayTerms sway(p.r_b, k.inverse_t2, sign == SignInM::kPrinted ? -1.0 : 1.0, a, b, yaw,
                       delta, height);
  const auto& [L, M, N] = sway;
  motion->x.value = b.t / a.c * height.value - p.r_b * delta.c +
                    p.r_b * (a.c * k.inverse_t2 - a.s * b.s) * (delta.s - yaw.s) / b.c;  // (5)
  motion->x.rate = L.value * roll.rate + M.value * pitch.rate + N.value * gamma.rate +
                   b.t / a.c * height.rate;  // (6)
  motion->x.acceleration =
      L.value * roll.acceleration + L.rate * roll.rate + M.value * pitch.acceleration +
      M.rate * pitch.rate + N.value * gamma.acceleration + N.rate * gamma.rate +
      b.t / a.c * height.acceleration +
      height.rate * (sec2_b * pitch.rate + a.t * b.t * roll.rate) / a.c;  // (7)
  return RunSummary::Done();
}

}  // namespace mbv::stabilizing_platform
