#include "analytic/stabilizing_platform/position.h"

#include <fmt/format.h>
#include <cmath>
#include <numbers>

#include "math/spatial.h"

namespace mbv::stabilizing_platform {
namespace {

// Sines below this are taken as a singular pose: forces grow with 1/sine, so that 8 of 16 digits
// would be left.
constexpr double kSmallSine = 1e-8;

RunSummary Trouble(Stop stop, std::string message, double amount, const char* unit) {
  return {.stop = stop, .message = std::move(message), .amount = amount, .unit = unit};
}

// Links 1 and 2 must form a triangle with the line foot – tip.
RunSummary CheckTriangle(const PlatformParameters& p, double foot_to_tip) {
  const double longest = p.L1 + p.L3, shortest = std::abs(p.L1 - p.L3);
  if (foot_to_tip > longest) {
    return Trouble(Stop::kUnreachable,
                   fmt::format("foot and tip are {:.6g} m apart, links 1 and 2 reach {:.6g} m: "
                               "{:.6g} m are missing",
                               foot_to_tip, longest, foot_to_tip - longest),
                   foot_to_tip - longest, "m");
  }
  if (!(foot_to_tip >= shortest)) {
    return Trouble(Stop::kUnreachable,
                   fmt::format("foot and tip are {:.6g} m apart, links 1 and 2 folded still "
                               "span {:.6g} m: {:.6g} m too near",
                               foot_to_tip, shortest, shortest - foot_to_tip),
                   shortest - foot_to_tip, "m");
  }
  return RunSummary::Done();
}

// Rates (a)–(c), given the angles.
void ComputeRates(const PlatformParameters& p, const Jet& Y, const Jet& l, double sin_elbow,
                  SideMotion* s) {
  const double by_L1 = 1 / (p.L1 * sin_elbow), by_L3 = 1 / (p.L3 * sin_elbow);
  s->q1.rate = (s->c2 * Y.rate + s->s2 * l.rate) * by_L1;  // (a)
  s->q2.rate = -(s->c1 * Y.rate + s->s1 * l.rate) * by_L3;
  const double n1 = p.L1 * s->q1.rate * s->q1.rate, n2 = p.L3 * s->q2.rate * s->q2.rate;
  const double a_y = Y.acceleration + n1 * s->c1 + n2 * s->c2;  // (b)
  const double a_z = l.acceleration + n1 * s->s1 + n2 * s->s2;
  s->q1.acceleration = (s->c2 * a_y + s->s2 * a_z) * by_L1;
  s->q2.acceleration = -(s->c1 * a_y + s->s1 * a_z) * by_L3;
  const double k = p.L2 * (p.L4 + p.L5);  // (c)
  s->R.rate = k * s->s12 * s->q1.rate / s->R.value;
  s->R.acceleration = (k * (s->c12 * s->q1.rate * s->q1.rate + s->s12 * s->q1.acceleration) -
                       s->R.rate * s->R.rate) /
                      s->R.value;
}

// Both sides together must not be at or beyond the toggle, sin(q2 + q2') = 0 at q2 + q2' = 2π.
RunSummary CheckToggle(const PlatformParameters& p, DrivePairs pairs, const LimbMotion& m) {
  const double beyond = m.side[0].q2.value + m.side[1].q2.value - 2 * std::numbers::pi;
  if (beyond < -kSmallSine) return RunSummary::Done();
  const char* at = beyond > kSmallSine ? "beyond" : "at";
  if (pairs == DrivePairs::kIndependent) {
    return Trouble(Stop::kSingular,
                   fmt::format("links 2 and 2' are {} their toggle (one straight line): q2 + q2' "
                               "exceeds 2π by {:.6g} rad",
                               at, beyond),
                   beyond, "rad");
  }
  const double toggle = std::sqrt(p.L1 * p.L1 - (p.L3 + p.L5) * (p.L3 + p.L5));
  return Trouble(Stop::kSingular,
                 fmt::format("links 2 and 2' are {} their toggle (one straight line): the limb is "
                             "{:.6g} m long, the toggle at {:.6g} m, {:.6g} m are missing",
                             at, m.length.value, toggle, toggle - m.length.value),
                 toggle - m.length.value, "m");
}

// (14), (17), (d), (e): the limb plane and the tip's motion in it.
void ComputePlane(const LimbPlace& place, const RelativeMotion& motion, bool synchronous,
                  LimbMotion* m) {
  // (14)
  m->p_oA = place.p_oA;
  m->p_oB = motion.p_op + motion.R_op * place.p_pB;
  const Vec3 AB = m->p_oB - m->p_oA;
  const double radial = place.e_r.dot(AB), lateral = place.e_t.dot(AB);
  // In the plane; a synchronous limb's y is zero by (5), and l = |AB| as printed.
  const double l = synchronous ? AB.norm() : std::hypot(radial, AB.z());
  m->tilt.value = std::atan2(radial, AB.z());  // (17)
  const double in_plane = std::hypot(radial, AB.z());
  const double c = AB.z() / in_plane, s = radial / in_plane;
  m->R_oA.col(1) = place.e_t;
  m->R_oA.col(0) = c * place.e_r - Vec3(0, 0, s);
  m->R_oA.col(2) = s * place.e_r + Vec3(0, 0, c);

  // (d), (e)
  const auto omega = motion.V_op.head<3>(), epsilon = motion.A_op.head<3>();
  m->v_oB = motion.V_op.tail<3>() + omega.cross(m->p_oB);
  m->a_oB = motion.A_op.tail<3>() + epsilon.cross(m->p_oB) + omega.cross(m->v_oB);
  const auto X = m->R_oA.col(0), Y = m->R_oA.col(1), Z = m->R_oA.col(2);
  m->length = {.value = l, .rate = Z.dot(m->v_oB)};
  m->tilt.rate = X.dot(m->v_oB) / l;
  m->length.acceleration = Z.dot(m->a_oB) + l * m->tilt.rate * m->tilt.rate;
  m->tilt.acceleration = (X.dot(m->a_oB) - 2 * m->length.rate * m->tilt.rate) / l;
  m->lateral = synchronous ? Jet{} : Jet{lateral, Y.dot(m->v_oB), Y.dot(m->a_oB)};
}

}  // namespace

LimbPlace::LimbPlace(double azimuth, double r_a, double r_b)
    : e_r(std::cos(azimuth), std::sin(azimuth), 0),
      e_t(-std::sin(azimuth), std::cos(azimuth), 0),
      p_oA(r_a * e_r),
      p_pB(r_b * e_r) {}

RunSummary ComputeSide(const PlatformParameters& p, const Jet& Y, const Jet& l, SideMotion* s) {
  const double D2 = Y.value * Y.value + l.value * l.value;
  if (RunSummary reach = CheckTriangle(p, std::sqrt(D2)); !reach.ok()) return reach;

  // (20); at the ends of the reach roundoff may leave the root's argument just below zero.
  const double C = -(D2 + p.L1 * p.L1 - p.L3 * p.L3) / (2 * p.L1);
  const double root = std::sqrt(std::max(0.0, D2 - C * C));
  s->q1.value = 2 * std::atan((l.value - root) / (Y.value - C));
  s->c1 = std::cos(s->q1.value);
  s->s1 = std::sin(s->q1.value);
  const double b_y = Y.value - p.L1 * s->c1, b_z = l.value - p.L1 * s->s1;
  s->q2.value = std::atan2(b_z, b_y);  // (18)
  if (s->q2.value < 0) s->q2.value += 2 * std::numbers::pi;
  s->c2 = b_y / p.L3;
  s->s2 = b_z / p.L3;
  const double sin_elbow = s->s2 * s->c1 - s->c2 * s->s1;
  if (!(std::abs(sin_elbow) > kSmallSine)) {
    return Trouble(Stop::kSingular,
                   fmt::format("links 1 and 2 are in one line: sin(q2 − q1) = {:.3g}", sin_elbow),
                   sin_elbow, "1");
  }
  s->c12 = std::cos(s->q1.value + p.theta_3);
  s->s12 = std::sin(s->q1.value + p.theta_3);
  if (!(std::abs(s->s12) > kSmallSine)) {
    return Trouble(Stop::kSingular,
                   fmt::format("the drive's line passes through the foot of link 1: "
                               "sin(q1 + θ3) = {:.3g}",
                               s->s12),
                   s->s12, "1");
  }
  s->R.value = std::hypot(p.L2 * s->c12 - p.L5 - p.L4, p.L2 * s->s12);
  ComputeRates(p, Y, l, sin_elbow, s);
  return RunSummary::Done();
}

RunSummary ComputeLimb(const PlatformParameters& p, int limb, const LimbPlace& place,
                       const RelativeMotion& motion, DrivePairs pairs, LimbMotion* m) {
  const bool synchronous = pairs == DrivePairs::kSynchronous;
  ComputePlane(place, motion, synchronous, m);

  // (18)–(20); a synchronous limb's sides are mirror images.
  RunSummary summary = RunSummary::Done();
  for (int side = 0; side < (synchronous ? 1 : 2) && summary.ok(); ++side) {
    const double sign = kSides[side];
    const Jet Y_s{p.L5 + sign * m->lateral.value, sign * m->lateral.rate,
                  sign * m->lateral.acceleration};
    summary = ComputeSide(p, Y_s, m->length, &m->side[side]);
  }
  if (synchronous) m->side[1] = m->side[0];
  if (summary.ok()) summary = CheckToggle(p, pairs, *m);
  if (!summary.ok()) {
    summary.where = fmt::format("limb{}", limb + 1);
    summary.names_where = true;
    summary.message = summary.where + ": " + summary.message;
  }
  return summary;
}

double LengthPerDrive(const PlatformParameters& p, const SideMotion& s) {
  // R'/l' of (c) and (a) with Y_s' = 0.
  const double dR_dl =
      p.L2 * (p.L4 + p.L5) * s.s12 / s.R.value * s.s2 / (p.L1 * (s.s2 * s.c1 - s.c2 * s.s1));
  return 1 / dR_dl;
}

Amplification::Amplification(const PlatformParameters& p)
    : p_(p), l_0_(std::hypot(p.r_a - p.r_b, p.z_0 - p.s_r_so)) {
  SideMotion side;
  if (!ComputeSide(p, Jet{p.L5}, Jet{l_0_}, &side).ok()) return;
  R_0_ = side.R.value;
  ratio_0_ = LengthPerDrive(p, side);
}

double Amplification::operator()(const LimbMotion& limb) const {
  const double dR = limb.side[0].R.value - R_0_;
  // Near neutral the secant loses its digits: 0/0 becomes the mean of the end slopes, whose error
  // is dR² l'''(R)/12, of the order (dR/R)²/12.
  if (std::abs(dR) < 2.5e-6 * R_0_) return 0.5 * (ratio_0_ + LengthPerDrive(p_, limb.side[0]));
  return (limb.length.value - l_0_) / dR;
}

std::array<Vec6, 9> LimbScrews(double b1, double b2, double c2, double c3) {
  const Vec3 X = Vec3::UnitX(), Y = Vec3::UnitY(), Z = Vec3::UnitZ();
  const Vec3 A = Vec3::Zero(), B(0, 0, c3);
  return {RotationScrew(X, {0, -b1, 0}),
          RotationScrew(Y, A),
          RotationScrew(X, {0, b2, c2}),
          RotationScrew(X, B),
          RotationScrew(Y, B),
          RotationScrew(Z, B),
          RotationScrew(X, {0, -b2, c2}),
          RotationScrew(X, {0, b1, 0}),
          RotationScrew(Y, A)};
}

std::array<Vec6, 5> EquivalentScrews(double c3) {
  const Vec3 X = Vec3::UnitX(), Y = Vec3::UnitY(), Z = Vec3::UnitZ();
  const Vec3 B(0, 0, c3);
  return {RotationScrew(Y, Vec3::Zero()), TranslationScrew(c3 * Z), RotationScrew(X, B),
          RotationScrew(Y, B), RotationScrew(Z, B)};
}

Mat6 VirtualLimbScrews(const LimbPlace& place, const LimbMotion& limb) {
  Mat6 J;
  J.col(0) = RotationScrew(place.e_r, limb.p_oA);
  J.col(1) = RotationScrew(place.e_t, limb.p_oA);
  J.col(2) = TranslationScrew((limb.p_oB - limb.p_oA) / limb.length.value);
  for (int k = 0; k < 3; ++k) J.col(3 + k) = RotationScrew(Vec3::Unit(k), limb.p_oB);
  return J;
}

InfluenceMatrices ComputeInfluence(const std::array<LimbPlace, 3>& places,
                                   const std::array<LimbMotion, 3>& limbs) {
  std::array<Mat6, 3> J, J_inverse;
  InfluenceMatrices out;
  for (int i = 0; i < 3; ++i) {
    J[i] = VirtualLimbScrews(places[i], limbs[i]);
    J_inverse[i] = J[i].inverse();
    out.G.row(i) = J_inverse[i].row(2);
    out.G.row(3 + i) = J_inverse[i].row(0);
  }
  const Mat6 G_inverse = out.G.inverse();
  for (int i = 0; i < 3; ++i) {
    const Mat6 T = J_inverse[i] * G_inverse;
    for (int m : {i, 3 + i}) out.H[m].setZero();
    for (int j = 0; j < 6; ++j) {
      for (int k = j + 1; k < 6; ++k) {
        const Vec6 bracket = J_inverse[i] * Bracket(J[i].col(j), J[i].col(k));
        const Mat6 TT = T.row(j).transpose() * T.row(k);
        out.H[i] += bracket[2] * TT;
        out.H[3 + i] += bracket[0] * TT;
      }
    }
  }
  return out;
}

EquivalentRates RatesOf(const InfluenceMatrices& influence, const Vec6& V_op, const Vec6& A_op) {
  EquivalentRates q;
  q.rate = influence.G * V_op;
  q.acceleration = influence.G * A_op;
  for (int m = 0; m < 6; ++m) q.acceleration[m] -= q.rate.dot(influence.H[m] * q.rate);
  return q;
}

}  // namespace mbv::stabilizing_platform
