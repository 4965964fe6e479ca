#include "analytic/stabilizing_platform/limb_dynamics.h"

#include <fmt/format.h>

#include <cmath>

#include "core/spatial.h"

namespace mbv::stabilizing_platform {
namespace {

// a_Y b_Z − a_Z b_Y.
double Planar(const Vec3& a, const Vec3& b) { return a.y() * b.z() - a.z() * b.y(); }

Vec6 ShiftToPoint(const Vec6& F_A, const Vec3& p_AQ) {
  Vec6 F_Q = F_A;
  F_Q.head<3>() -= p_AQ.cross(F_A.tail<3>());
  return F_Q;
}

// Motion of the limb plane {A_i} against the earth, in {A_i}.
struct PlaneMotion {
  Vec3 omega, epsilon;
  Vec3 a_minus_g;  // acceleration of A_i minus gravity
  Mat3 spin;       // [ε×] + [ω×]²

  PlaneMotion(const LimbMotion& limb, const RelativeMotion& m) {
    const Mat3 R_Ao = limb.R_oA.transpose();
    const Vec3 omega_o = m.V_eo.head<3>(), epsilon_o = m.A_eo.head<3>();
    const Vec3 v_A = m.V_eo.tail<3>() + omega_o.cross(limb.p_oA);
    const Vec3 a_A = m.A_eo.tail<3>() + epsilon_o.cross(limb.p_oA) + omega_o.cross(v_A);
    a_minus_g = R_Ao * (a_A - m.gravity);
    // The plane tilts about Y against the lower platform.
    const Vec3 omega_base = R_Ao * omega_o;
    const Vec3 tilt(0, limb.tilt.rate, 0);
    omega = omega_base + tilt;
    epsilon = R_Ao * epsilon_o + Vec3(0, limb.tilt.acceleration, 0) + omega_base.cross(tilt);
    spin = omega * omega.transpose() - omega.squaredNorm() * Mat3::Identity() + Skew(epsilon);
  }
};

// Motion of a point in the limb plane, relative to the plane.
struct PlanePoint {
  Vec3 p = Vec3::Zero(), v = Vec3::Zero(), a = Vec3::Zero();
};

// The point at `length` along a link of angle q (from s·Y toward Z) that starts at `from`.
PlanePoint Along(const PlanePoint& from, double s, const Jet& q, const Vec3& d, double length) {
  const Vec3 normal(0, -d.z(), d.y());  // X × d; d' = s q' (X × d)
  const double rate = s * q.rate;
  PlanePoint to;
  to.p = from.p + length * d;
  to.v = from.v + length * rate * normal;
  to.a = from.a + length * (s * q.acceleration * normal - rate * rate * d);
  return to;
}

// A link's centre of mass: at a fraction of its length, com_x beside the plane, com_z beside the
// line; the normal X × d turns with the link as d does.
PlanePoint CentreOf(const LinkInertia& link, const PlanePoint& from, double s, const Jet& q,
                    const Vec3& d, double length) {
  PlanePoint com = Along(from, s, q, d, link.com_fraction * length);
  const Vec3 normal(0, -d.z(), d.y());  // X × normal = −d
  com = Along(com, s, q, normal, link.com_z);
  com.p.x() += link.com_x;
  return com;
}

// (a), (b) for one link.
Vec6 RequiredWrench(const LinkInertia& link, const PlaneMotion& plane, const PlanePoint& com,
                    double s, const Jet& q, const Vec3& d) {
  const Vec3 spin(s * q.rate, 0, 0);
  const Vec3 omega = plane.omega + spin;
  const Vec3 epsilon = plane.epsilon + Vec3(s * q.acceleration, 0, 0) + plane.omega.cross(spin);
  const Vec3 a_c = plane.a_minus_g + plane.spin * com.p + 2 * plane.omega.cross(com.v) + com.a;
  // Components along the link's axes X, d, X × d.
  const Vec3 normal(0, -d.z(), d.y());
  const Vec3 w(omega.x(), d.dot(omega), normal.dot(omega));
  const Vec3 e(epsilon.x(), d.dot(epsilon), normal.dot(epsilon));
  const Vec3 Iw = link.moments.cwiseProduct(w);
  const Vec3 m = link.moments.cwiseProduct(e) + w.cross(Iw);
  Vec6 wrench;
  wrench.tail<3>() = link.mass * a_c;
  wrench.head<3>() = Vec3(m.x(), 0, 0) + m.y() * d + m.z() * normal + com.p.cross(wrench.tail<3>());
  return wrench;
}

}  // namespace

Mat3 LimbGeometry::R_AL(int link) const {
  const Vec3& d = link < kLink2 ? d1[link] : d2[link - kLink2];
  Mat3 R;
  R << Vec3::UnitX(), d, Vec3(0, -d.z(), d.y());
  return R;
}

LimbGeometry GeometryOf(const PlatformParameters& p, const LimbMotion& limb) {
  LimbGeometry g;
  g.B = {0, limb.lateral.value, limb.length.value};
  for (int j = 0; j < 2; ++j) {
    const double s = kSides[j];
    const SideMotion& side = limb.side[j];
    g.U[j] = {0, -s * p.L5, 0};
    g.d1[j] = {0, s * side.c1, side.s1};
    g.d2[j] = {0, s * side.c2, side.s2};
    g.E[j] = g.U[j] + p.L1 * g.d1[j];
    g.rod_ball[j] = g.U[j] + p.L2 * Vec3(0, s * side.c12, side.s12);
    g.thrust[j] = (g.rod_ball[j] - Vec3(0, s * p.L4, 0)) / side.R.value;
  }
  return g;
}

void RequiredWrenches(const PlatformParameters& p, const LimbMotion& limb,
                      const LimbGeometry& geometry, const RelativeMotion& motion,
                      LinkWrenches* required) {
  const PlaneMotion plane(limb, motion);
  for (int j = 0; j < 2; ++j) {
    const double s = kSides[j];
    const SideMotion& side = limb.side[j];
    const LinkInertia& first = p.links[kLink1 + j];
    const LinkInertia& second = p.links[kLink2 + j];
    const Vec3 &d1 = geometry.d1[j], &d2 = geometry.d2[j];
    const PlanePoint foot{.p = geometry.U[j]};
    const PlanePoint elbow = Along(foot, s, side.q1, d1, p.L1);
    const PlanePoint com1 = CentreOf(first, foot, s, side.q1, d1, p.L1);
    const PlanePoint com2 = CentreOf(second, elbow, s, side.q2, d2, p.L3);
    (*required)[kLink1 + j] = RequiredWrench(first, plane, com1, s, side.q1, d1);
    (*required)[kLink2 + j] = RequiredWrench(second, plane, com2, s, side.q2, d2);
  }
}

double OutOfPlaneForce(const LinkWrenches& required, double length) {
  double M_Y = 0;
  for (const Vec6& wrench : required) M_Y += wrench[1];
  return -M_Y / length;  // (c)
}

RunSummary SolveLimb(const PlatformParameters& p, const LimbMotion& limb, const LimbGeometry& g,
                     const LinkWrenches& required, LimbForces* out) {
  // (d): u_s × P_s = c_s with u_s = B − E_s.
  const Vec3 u_0 = g.B - g.E[0], u_1 = g.B - g.E[1];
  std::array<double, 2> c;
  for (int j = 0; j < 2; ++j) {
    const Vec6& second = required[kLink2 + j];
    c[j] = second[0] - Planar(g.E[j], second.tail<3>());
  }
  const Vec3 in_plane(0, out->on_platform.y(), out->on_platform.z());
  const double det = Planar(u_0, u_1);  // L3² sin(q2 + q2'), up to sign
  if (!(std::abs(det) > 1e-8 * p.L3 * p.L3)) {
    return {
        .stop = Stop::kSingular,
        .message = fmt::format("links 2 and 2' are in one line: sine {:.3g}", det / (p.L3 * p.L3)),
        .where = {},
        .amount = det / (p.L3 * p.L3),
        .unit = "1"};
  }
  out->P[0] = ((c[1] + Planar(u_1, in_plane)) * u_0 + c[0] * u_1) / det;
  out->P[1] = -in_plane - out->P[0];
  for (int j = 0; j < 2; ++j) {
    const Vec6 both = required[kLink1 + j] + required[kLink2 + j];
    out->P[j].x() = both[1] / limb.length.value;  // (c)
    const double moment =
        both[0] - Planar(g.U[j], both.tail<3>()) - Planar(g.B - g.U[j], out->P[j]);
    const double arm = kSides[j] * (p.L4 + p.L5) * p.L2 * limb.side[j].s12 / limb.side[j].R.value;
    out->drive[j] = moment / arm;  // (e)
  }
  return RunSummary::Done();
}

LimbReactions ReactionsOf(const LimbGeometry& g, const LinkWrenches& required,
                          const LimbForces& forces) {
  LimbReactions reactions;
  for (int j = 0; j < 2; ++j) {
    // (f), first about A_i.
    Vec6 elbow = required[kLink2 + j];
    elbow.head<3>() -= g.B.cross(forces.P[j]);
    elbow.tail<3>() -= forces.P[j];
    const Vec3 thrust = forces.drive[j] * g.thrust[j];
    Vec6 foot = required[kLink1 + j] + elbow;
    foot.head<3>() -= g.rod_ball[j].cross(thrust);
    foot.tail<3>() -= thrust;
    reactions.elbow[j] = ShiftToPoint(elbow, g.E[j]);
    reactions.foot[j] = ShiftToPoint(foot, g.U[j]);
  }
  return reactions;
}

}  // namespace mbv::stabilizing_platform
