#include "analytic/stabilizing_platform/dynamics.h"

#include <fmt/format.h>
#include <Eigen/SVD>
#include <cmath>

#include "math/spatial.h"

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

namespace {

// Columns of the unknowns.
constexpr int kCross2 = 0, kCross2p = 5, kElbow = 10, kFoot = 20, kDrive = 28;
// In the corrected form the two moments of cross → 2' give way to the platform's actions.
constexpr int kPlatformX = 8, kPlatformTau = 9;

// Rows of the bodies.
constexpr int kCrossRow = 0;
constexpr int Link2Row(int side) { return 6 + 6 * side; }
constexpr int Link1Row(int side) { return 18 + 6 * side; }

// Writes ± a unit force along `axis` at p into a column.
void AddForce(LimbSystem* s, int row, int column, double sign, const Vec3& axis, const Vec3& p) {
  s->matrix.block<3, 1>(row, column) += sign * p.cross(axis);
  s->matrix.block<3, 1>(row + 3, column) += sign * axis;
}

void AddMoment(LimbSystem* s, int row, int column, double sign, const Vec3& axis) {
  s->matrix.block<3, 1>(row, column) += sign * axis;
}

// Action at point p with forces and the listed moments, + on the outer body, − on the inner one
// (row −1: the base, no equations).
void AddJoint(LimbSystem* s, int column, const Vec3& p, int outer_row, int inner_row,
              std::initializer_list<int> moments) {
  auto both = [&](auto add) {
    add(outer_row, +1.0);
    if (inner_row >= 0) add(inner_row, -1.0);
  };
  for (int k = 0; k < 3; ++k) {
    both([&](int row, double sign) { AddForce(s, row, column + k, sign, Vec3::Unit(k), p); });
  }
  int next = column + 3;
  for (int axis : moments) {
    both([&](int row, double sign) { AddMoment(s, row, next, sign, Vec3::Unit(axis)); });
    ++next;
  }
}

}  // namespace

LimbSystem MakeLimbSystem(LimbSystemForm form, const LimbGeometry& g, const LinkWrenches& required,
                          double f_Y, double f_Z) {
  LimbSystem s;
  s.matrix.setZero();
  s.right_side.setZero();
  constexpr int Y = 1, Z = 2;
  const bool corrected = form == LimbSystemForm::kCorrected;
  AddJoint(&s, kCross2, g.B, Link2Row(0), kCrossRow, {Y, Z});
  if (corrected) {
    AddJoint(&s, kCross2p, g.B, Link2Row(1), kCrossRow, {});
    AddForce(&s, kCrossRow, kPlatformX, -1.0, Vec3::UnitX(), g.B);  // f_X acts on the platform
    AddMoment(&s, kCrossRow, kPlatformTau, 1.0, Vec3::UnitX());
  } else {
    AddJoint(&s, kCross2p, g.B, Link2Row(1), kCrossRow, {Y, Z});
  }
  for (int j = 0; j < 2; ++j) {
    AddJoint(&s, kElbow + 5 * j, g.E[j], Link2Row(j), Link1Row(j), {Y, Z});
    AddJoint(&s, kFoot + 4 * j, g.U[j], Link1Row(j), -1, {Z});
    AddForce(&s, Link1Row(j), kDrive + j, 1.0, g.thrust[j], g.rod_ball[j]);
    s.right_side.segment<6>(Link2Row(j)) = required[kLink2 + j];
    s.right_side.segment<6>(Link1Row(j)) = required[kLink1 + j];
  }
  // The platform pushes the cross by −(f_Y Y + f_Z Z); a massless body needs nothing.
  const Vec3 f(0, f_Y, f_Z);
  s.right_side.segment<3>(kCrossRow) = g.B.cross(f);
  s.right_side.segment<3>(kCrossRow + 3) = f;
  // Moments from A_i to a point on each body: better conditioned.
  auto shift = [&](int row, const Vec3& p) {
    const Mat3 P = Skew(p);
    s.matrix.middleRows<3>(row) -= P * s.matrix.middleRows<3>(row + 3);
    s.right_side.segment<3>(row) -= P * s.right_side.segment<3>(row + 3);
  };
  shift(kCrossRow, g.B);
  for (int j = 0; j < 2; ++j) {
    shift(Link2Row(j), g.E[j]);
    shift(Link1Row(j), g.U[j]);
  }
  return s;
}

LimbSystemSolution SolveLimbSystem(const LimbSystem& system, double f_Y, double f_Z) {
  const Eigen::Matrix<double, 30, 1> x = system.matrix.partialPivLu().solve(system.right_side);
  LimbSystemSolution out;
  out.forces.on_platform = {x[kPlatformX], f_Y, f_Z};
  out.forces.P = {x.segment<3>(kCross2), x.segment<3>(kCross2p)};
  out.tau_X = x[kPlatformTau];
  for (int j = 0; j < 2; ++j) {
    out.forces.drive[j] = x[kDrive + j];
    const int elbow = kElbow + 5 * j, foot = kFoot + 4 * j;
    out.reactions.elbow[j] << 0, x.segment<2>(elbow + 3), x.segment<3>(elbow);
    out.reactions.foot[j] << 0, 0, x[foot + 3], x.segment<3>(foot);
  }
  return out;
}

Eigen::Matrix<double, 30, 1> ColumnScaledSingularValues(const LimbSystem& system) {
  Eigen::Matrix<double, 30, 30> scaled = system.matrix;
  for (int c = 0; c < 30; ++c) scaled.col(c).normalize();
  return Eigen::JacobiSVD<Eigen::Matrix<double, 30, 30>>(scaled).singularValues();
}

namespace {

// Of the platform with its load, in {o}.
Vec3 CentreOfMass(const PlatformParameters& p, const RelativeMotion& motion) {
  return motion.p_op + motion.R_op * p.c_p;
}

}  // namespace

Vec6 InertiaWrench(const PlatformParameters& p, const RelativeMotion& motion) {
  const Mat3 I_o = motion.R_op * p.I_p.asDiagonal() * motion.R_op.transpose();
  const Mat6 N = SpatialInertia(p.m_p, CentreOfMass(p, motion), I_o);
  const Vec6 momentum = N * motion.V_ep;
  // ad(V)ᵀ h = −(ω × m + v × f ; ω × f) for h = (m ; f).
  const auto omega = motion.V_ep.head<3>(), v = motion.V_ep.tail<3>();
  Vec6 W = -(N * motion.A_ep);
  W.head<3>() -= omega.cross(momentum.head<3>()) + v.cross(momentum.tail<3>());
  W.tail<3>() -= omega.cross(momentum.tail<3>());
  return W;
}

Vec6 GravityWrench(const PlatformParameters& p, const RelativeMotion& motion) {
  Vec6 W;
  const Vec3 weight = p.m_p * motion.gravity;
  W << CentreOfMass(p, motion).cross(weight), weight;
  return W;
}

RunSummary SolvePlatform(const PlatformParameters& p, const RelativeMotion& motion,
                         const std::array<LimbMotion, 3>& limbs, const Vec3& f_X, const Vec6& load,
                         Vec6* f) {
  // (21)
  Mat6 S;
  Vec6 W = -GravityWrench(p, motion) - InertiaWrench(p, motion) - load;
  for (int i = 0; i < 3; ++i) {
    const LimbMotion& limb = limbs[i];
    const auto X = limb.R_oA.col(0), Y = limb.R_oA.col(1), Z = limb.R_oA.col(2);
    S.col(i) << limb.p_oB.cross(Z), Z;
    S.col(3 + i) << limb.p_oB.cross(Y), Y;
    W.head<3>() -= f_X[i] * limb.p_oB.cross(X);
    W.tail<3>() -= f_X[i] * X;
  }
  const Eigen::PartialPivLU<Mat6> lu(S);
  const auto pivots = lu.matrixLU().diagonal().cwiseAbs();
  const double smallest = pivots.minCoeff() / pivots.maxCoeff();
  if (!(smallest > 1e-10)) {
    return {.stop = Stop::kSingular,
            .message = fmt::format("the six limb forces on the platform are dependent: pivot "
                                   "ratio {:.3g}",
                                   smallest),
            .where = "platform",
            .amount = smallest,
            .unit = "1",
            .names_where = true};
  }
  *f = lu.solve(W);
  return RunSummary::Done();
}

namespace {

// The load on the platform as a wrench about {o}'s origin in {o}.
Vec6 OnPlatform(const BodyLoad& load, const Evaluation& e) {
  const Mat3 R = load.in_body_axes ? e.motion.R_op : Mat3(e.lower.R_EB.transpose());
  const Vec3 p_Q = e.motion.p_op + e.motion.R_op * load.p_BoQ_B;
  Vec6 W;
  W.tail<3>() = R * load.force;
  W.head<3>() = R * load.moment + p_Q.cross(W.tail<3>());
  return W;
}

// The load on a link as a wrench about A_i in {A_i}.
Vec6 OnLink(const BodyLoad& load, const Evaluation& e) {
  const LimbGeometry& g = e.geometry[load.limb];
  const Mat3 R_AL = g.R_AL(load.link);
  const Mat3 R = load.in_body_axes
                     ? R_AL
                     : Mat3(e.limbs[load.limb].R_oA.transpose() * e.lower.R_EB.transpose());
  const Vec3 p_Q = g.origin(load.link) + R_AL * load.p_BoQ_B;
  Vec6 W;
  W.tail<3>() = R * load.force;
  W.head<3>() = R * load.moment + p_Q.cross(W.tail<3>());
  return W;
}

}  // namespace

PlatformEquations::PlatformEquations(const PlatformParameters& parameters, DrivePairs pairs,
                                     Model model, SignInM sign)
    : p_(parameters), pairs_(pairs), model_(model), sign_(sign) {
  for (int i = 0; i < 3; ++i) places_[i] = LimbPlace(p_.azimuth(i), p_.r_a, p_.r_b);
}

RunSummary PlatformEquations::EvaluateKinematics(const PoseCommand& command, Evaluation* e) const {
  std::array<Jet, 6> pose = command.platform;
  if (pairs_ == DrivePairs::kSynchronous) {
    const Jet &z = command.platform[2], &h = command.heave;
    const Jet height{z.value - h.value, z.rate - h.rate, z.acceleration - h.acceleration};
    ParasiticMotion parasitic;
    RunSummary summary =
        ComputeParasiticMotion(p_, command.roll, command.pitch, height, sign_, &parasitic);
    if (!summary.ok()) return summary;
    pose = {parasitic.x, parasitic.y, z, Jet{}, Jet{}, parasitic.yaw};
  }
  e->lower = LowerPlatformMotion(command.roll, command.pitch, command.heave, p_.s_r_so);
  e->upper = UpperPlatformMotion(pose);
  e->motion = ComputeRelativeMotion(e->lower, e->upper, p_.g);
  for (int i = 0; i < 3; ++i) {
    RunSummary summary = ComputeLimb(p_, i, places_[i], e->motion, pairs_, &e->limbs[i]);
    if (!summary.ok()) return summary;
  }
  return RunSummary::Done();
}

RunSummary PlatformEquations::EvaluateDynamics(std::span<const BodyLoad> loads,
                                               Evaluation* e) const {
  // What the links need, inertia and gravity first.
  for (int i = 0; i < 3; ++i) {
    e->geometry[i] = GeometryOf(p_, e->limbs[i]);
    if (model_ == Model::kMassless) {
      e->required[i].fill(Vec6::Zero());
    } else {
      RequiredWrenches(p_, e->limbs[i], e->geometry[i], e->motion, &e->required[i]);
    }
  }
  Vec6 on_platform = Vec6::Zero();
  for (const BodyLoad& load : loads) {
    if (load.limb < 0) {
      on_platform += OnPlatform(load, *e);
    } else {
      e->required[load.limb][load.link] -= OnLink(load, *e);
    }
  }
  // The limbs' forces on the platform.
  e->f_X.setZero();
  if (model_ != Model::kPaperText) {
    for (int i = 0; i < 3; ++i) {
      e->f_X[i] = OutOfPlaneForce(e->required[i], e->limbs[i].length.value);
    }
  }
  RunSummary summary = SolvePlatform(p_, e->motion, e->limbs, e->f_X, on_platform, &e->f);
  // The forces in the limbs.
  for (int i = 0; i < 3 && summary.ok(); ++i) {
    e->forces[i].on_platform = {e->f_X[i], e->f[3 + i], e->f[i]};
    summary = SolveLimb(p_, e->limbs[i], e->geometry[i], e->required[i], &e->forces[i]);
  }
  return summary;
}

}  // namespace mbv::stabilizing_platform
