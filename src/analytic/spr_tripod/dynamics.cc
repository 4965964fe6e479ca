#include "analytic/spr_tripod/dynamics.h"

#include <fmt/format.h>

#include <cmath>

#include "math/spatial.h"

namespace mbv::spr_tripod {
namespace {

// Far below any pose that can be computed with meaning; the workspace has det J > 0.9.
constexpr double kSingular = 1e-9;

RunSummary Singular(const Posture& p, const char* what, double det) {
  return {.stop = Stop::kSingular,
          .message = fmt::format("at O_A = ({:.6g}, {:.6g}, {:.6g}) m {} (determinant {:.1e})",
                                 p.r.x(), p.r.y(), p.r.z(), what, det),
          .where = "platform",
          .amount = det};
}

// Force and moment (about the body's origin) that a body's motion asks for, loads deducted.
struct Demand {
  Vec3 F, M;
};

// (D7) for a body whose origin accelerates with a_Bo.
Demand DemandOf(const Inertia& body, const Mat3& R, const Vec3& omega, const Vec3& alpha,
                const Vec3& a_Bo, const Vec3& gravity, const Vec3& force, const Vec3& moment) {
  const Vec3 rho = R * body.com;
  const Vec3 a_G = a_Bo + alpha.cross(rho) + omega.cross(omega.cross(rho));
  const Vec3 F = body.mass * (a_G - gravity);
  // I α + ω × I ω, in body axes and back.
  const Vec3 omega_B = R.transpose() * omega;
  const Vec3 N = R * (body.I * (R.transpose() * alpha) + omega_B.cross(body.I * omega_B));
  return {F - force, N + rho.cross(F) - moment};
}

// What the motion of all bodies asks for, loads deducted.
struct Balance {
  Vec3 Q_v = Vec3::Zero(), Q_omega = Vec3::Zero();  // (D8) as Q = Q_v + J_cᵀ Q_ω
  Vec3 F = Vec3::Zero(), M = Vec3::Zero();          // sum of forces; of moments about O_A
  PerLeg<Vec3> F_cylinder;
  PerLeg<double> hinge_moment{};  // of leg i about its hinge axis
};

void AddPlatform(const Posture& p, const Velocities& s, const Accelerations& acc,
                 const Masses& masses, const ExternalLoads& loads, Balance* balance) {
  const Demand d = DemandOf(masses.platform, p.R, s.omega, acc.omega_dot, acc.v_dot, masses.gravity,
                            loads.force[kPlatform], loads.moment[kPlatform]);
  balance->Q_v += d.F;
  balance->Q_omega += d.M;
  balance->F += d.F;
  balance->M += d.M;
}

// Cylinder and rod; their demands' moments are about B_i and A_i.
void AddLeg(const Posture& p, const Velocities& s, const Accelerations& acc, const Masses& masses,
            const ExternalLoads& loads, int i, Balance* balance) {
  const Mat3 R = LegRotation(p, i);
  const Vec3 &w = p.w[i], &a = p.a[i], &g = masses.gravity;
  const double q = p.q[i];
  const int cyl = CylinderBody(i), rod = RodBody(i);
  const Demand c = DemandOf(masses.cylinder, R, s.omega_leg[i], acc.omega_leg_dot[i], Vec3::Zero(),
                            g, loads.force[cyl], loads.moment[cyl]);
  const Demand r = DemandOf(masses.rod, R, s.omega_leg[i], acc.omega_leg_dot[i], acc.a_A[i], g,
                            loads.force[rod], loads.moment[rod]);
  // (D8), V and W multiplied out: the rod moves with A_i (V = 1 − [a_i×] J_c), and both parts turn
  // by J_di of (20c).
  const Vec3 M = c.M + r.M;
  balance->Q_v += r.F + M.cross(w) / q;
  balance->Q_omega += a.cross(r.F) + (w.dot(a) * M - w * a.dot(M)) / q + w * w.dot(M);
  balance->F += c.F + r.F;
  balance->M += c.M + p.d[i].cross(c.F) + r.M + a.cross(r.F);
  balance->F_cylinder[i] = c.F;
  balance->hinge_moment[i] = p.c[i].dot(M - q * w.cross(c.F));
}

// (D11), (D12). S_i = S_c c_i + S_y y_i + S_w w_i: the hinge balance gives S_y; what is left of
// force and moment is carried by S_c and S_w, and J_c, J eliminate them one after the other.
void FillReactions(const Posture& p, const Jacobians& jacobians, const Balance& balance,
                   Forces* forces) {
  Vec3 F = balance.F, M = balance.M;
  PerLeg<Vec3> S_y;
  for (int i = 0; i < 3; ++i) {
    S_y[i] = (balance.hinge_moment[i] / p.q[i]) * p.w[i].cross(p.c[i]);
    F -= S_y[i];
    M -= p.d[i].cross(S_y[i]);
  }
  const Vec3 S_w = jacobians.J_inv.transpose() * (F + jacobians.J_c.transpose() * M);
  for (int i = 0; i < 3; ++i) M -= S_w[i] * p.a[i].cross(p.w[i]);
  const Vec3 S_c = jacobians.D_inv.transpose() * M;
  for (int i = 0; i < 3; ++i) {
    forces->S[i] = S_c[i] * p.c[i] + S_y[i] + S_w[i] * p.w[i];
    forces->f_check[i] = S_w[i] - balance.F_cylinder[i].dot(p.w[i]);  // (D12)
  }
}

}  // namespace

RunSummary FillJacobians(const Geometry& geometry, const Posture& p, Jacobians* jacobians) {
  Mat3 D, C, W, AW;
  for (int i = 0; i < 3; ++i) {
    D.row(i) = p.d[i].cross(p.c[i]);
    C.row(i) = p.c[i];
    W.row(i) = p.w[i];
    AW.row(i) = p.a[i].cross(p.w[i]);
  }
  jacobians->det_c = D.determinant();
  if (!(std::abs(jacobians->det_c) > kSingular * geometry.b * geometry.b * geometry.b)) {
    return Singular(p, "the orientation does not follow from the position", jacobians->det_c);
  }
  jacobians->D_inv = D.inverse();
  jacobians->J_c = -jacobians->D_inv * C;  // (12)
  jacobians->J = W + AW * jacobians->J_c;  // (14)
  jacobians->det = jacobians->J.determinant();
  if (!(std::abs(jacobians->det) > kSingular)) {
    return Singular(p, "the position does not follow from the leg lengths", jacobians->det);
  }
  jacobians->J_inv = jacobians->J.inverse();
  return RunSummary::Done();
}

Mat3 LegJacobian(const Posture& p, const Jacobians& jacobians, int leg) {
  const Vec3 &w = p.w[leg], &a = p.a[leg];
  // (20c)
  const Mat3 bracket =
      w.dot(a) * Mat3::Identity() - a * w.transpose() + p.q[leg] * w * w.transpose();
  return (Skew(w) + bracket * jacobians.J_c) / p.q[leg];
}

void FillVelocities(const Posture& p, const Jacobians& jacobians, const Vec3& v,
                    Velocities* velocities) {
  Velocities& s = *velocities;
  s.v = v;
  s.omega = jacobians.J_c * v;  // (12)
  for (int i = 0; i < 3; ++i) {
    s.v_A[i] = v + s.omega.cross(p.a[i]);                                   // (13)
    s.q_dot[i] = s.v_A[i].dot(p.w[i]);                                      // (14)
    s.spin[i] = p.w[i].dot(s.omega);                                        // (19)
    s.omega_leg[i] = p.w[i].cross(s.v_A[i]) / p.q[i] + s.spin[i] * p.w[i];  // (16), (20)
  }
}

void FillAccelerations(const Posture& p, const Jacobians& jacobians, const Velocities& s,
                       const Vec3& v_dot, Accelerations* accelerations) {
  Accelerations& acc = *accelerations;
  acc.v_dot = v_dot;
  Vec3 rhs;
  for (int i = 0; i < 3; ++i) {
    rhs[i] = p.c[i].dot(2.0 * s.omega.cross(s.v) - v_dot) -
             s.omega.cross(p.d[i]).dot(s.omega.cross(p.c[i]));
  }
  acc.omega_dot = jacobians.D_inv * rhs;  // (D1)
  for (int i = 0; i < 3; ++i) {
    const Vec3& w = p.w[i];
    const double q = p.q[i];
    acc.a_A[i] =
        v_dot + acc.omega_dot.cross(p.a[i]) + s.omega.cross(s.omega.cross(p.a[i]));  // (D2)
    const Vec3 across = s.v_A[i] - s.q_dot[i] * w;
    acc.q_ddot[i] = acc.a_A[i].dot(w) + across.squaredNorm() / q;  // (D3)
    const Vec3 w_dot = across / q;                                 // (D4)
    const Vec3 omega_xy = w.cross(s.v_A[i]) / q;
    acc.omega_leg_dot[i] = (w.cross(acc.a_A[i]) - 2.0 * s.q_dot[i] * omega_xy) / q +
                           (acc.omega_dot.dot(w) + s.omega.dot(w_dot)) * w +
                           s.spin[i] * w_dot;  // (D6)
  }
}

const Inertia& InertiaOf(const Masses& masses, int body) {
  if (body == kPlatform) return masses.platform;
  return body < RodBody(0) ? masses.cylinder : masses.rod;
}

Mat3 LegRotation(const Posture& posture, int leg) {
  Mat3 R;
  R << posture.c[leg], posture.w[leg].cross(posture.c[leg]), posture.w[leg];
  return R;
}

Pose BodyPose(const Posture& p, int body) {
  const int leg = LegOf(body);
  Pose X_WB;
  X_WB.linear() = leg < 0 ? p.R : LegRotation(p, leg);
  X_WB.translation() = leg < 0 ? p.r : body == CylinderBody(leg) ? p.b[leg] : p.r + p.a[leg];
  X_WB.makeAffine();
  return X_WB;
}

void FillForces(const Posture& p, const Jacobians& jacobians, const Velocities& s,
                const Accelerations& acc, const Masses& masses, const ExternalLoads& loads,
                Forces* forces) {
  Balance balance;
  AddPlatform(p, s, acc, masses, loads, &balance);
  for (int leg = 0; leg < 3; ++leg) AddLeg(p, s, acc, masses, loads, leg, &balance);
  // (D9)
  const Vec3 Q = balance.Q_v + jacobians.J_c.transpose() * balance.Q_omega;
  const Vec3 f = jacobians.J_inv.transpose() * Q;
  for (int i = 0; i < 3; ++i) forces->f[i] = f[i];
  FillReactions(p, jacobians, balance, forces);
}

Mat3 TaskSpaceMass(const Posture& p, const Jacobians& jacobians, const Masses& masses) {
  Mat3 M = Mat3::Zero();
  for (int body = 0; body < kBodies; ++body) {
    const int leg = LegOf(body);
    const Inertia& inertia = InertiaOf(masses, body);
    const Mat3 R = BodyPose(p, body).linear();
    const Mat3 W = leg < 0 ? jacobians.J_c : LegJacobian(p, jacobians, leg);
    Mat3 V = -Skew(R * inertia.com) * W;
    if (leg < 0) V += Mat3::Identity();
    if (body >= RodBody(0)) V += Mat3::Identity() - Skew(p.a[leg]) * jacobians.J_c;
    M += inertia.mass * V.transpose() * V + W.transpose() * R * inertia.I * R.transpose() * W;
  }
  return M;
}

double Energy(const Posture& p, const Velocities& s, const Masses& masses) {
  double energy = 0.0;
  for (int body = 0; body < kBodies; ++body) {
    const int leg = LegOf(body);
    const Inertia& inertia = InertiaOf(masses, body);
    const Pose X_WB = BodyPose(p, body);
    const Mat3 R = X_WB.linear();
    const Vec3 omega = leg < 0 ? s.omega : s.omega_leg[leg];
    const Vec3 v_Bo = leg < 0 ? s.v : body == CylinderBody(leg) ? Vec3(Vec3::Zero()) : s.v_A[leg];
    const Vec3 v_G = v_Bo + omega.cross(R * inertia.com);
    const Vec3 omega_B = R.transpose() * omega;
    energy += 0.5 * inertia.mass * v_G.squaredNorm() + 0.5 * omega_B.dot(inertia.I * omega_B) -
              inertia.mass * masses.gravity.dot(X_WB * inertia.com);
  }
  return energy;
}

}  // namespace mbv::spr_tripod
