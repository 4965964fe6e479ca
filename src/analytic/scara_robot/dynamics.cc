#include "analytic/scara_robot/dynamics.h"

#include "math/spatial.h"
#include "mechanism/channels.h"

namespace mbv::scara_robot {
BarInertia SolidBar(double mass, double radius, double length) {
  const double r2 = radius * radius;
  return {mass * (3.0 * r2 + length * length) / 12.0, mass * r2 / 2.0};
}

Vec3 Times(const BarInertia& inertia, const Vec3& eta, const Vec3& omega) {
  return inertia.transverse * omega + (inertia.axial - inertia.transverse) * eta.dot(omega) * eta;
}

BarInertia RodInertia(const Parameters& parameters, RodModel rod_model, int limb) {
  BarInertia inertia =
      SolidBar(parameters.m_rods, parameters.rod_radius, parameters.rod_length(limb));
  if (rod_model == RodModel::kThin) inertia.axial = 0.0;
  return inertia;
}

Mat4 InverseOfJ(const Parameters& parameters, const Position& position) {
  const Mat4 J_x = InverseJacobian(parameters, position).asDiagonal();
  return DirectJacobian(position).partialPivLu().solve(J_x);
}

void FillLinkMotion(const Parameters& parameters, const Position& position, const Rates& rates,
                    const Mat4& J_inverse, RodModel rod_model, int limb, LinkMotion* links) {
  const double l1 = parameters.l1, L = parameters.rod_length(limb), c = parameters.arm_com;
  const double dtheta = rates.dtheta[limb], ddtheta = rates.ddtheta[limb];
  const Vec3& a = MotorAxis(limb);
  const Vec3& n = position.n[limb];
  const Vec3& eta = position.eta[limb];
  const Vec3& k = position.k[limb];

  // Ends of the arm and the rod. (31) – (33), (35)
  Mat34 J_C = Mat34::Zero();
  J_C.col(limb) = l1 * n;
  const Mat34 J_B = J_inverse.topRows<3>() + k * J_inverse.row(3);
  const Vec3 v_C = l1 * dtheta * n;
  const Vec3 dv_C = l1 * (ddtheta * n - dtheta * dtheta * position.u[limb]);
  const double dphi = rates.dX[3];
  const Vec3 v_B = rates.dX.head<3>() + k * dphi;
  const Vec3 dv_B = rates.ddX.head<3>() + k * rates.ddX[3] - position.s[limb] * dphi * dphi;

  // Centres of mass. (31), (34), (36), (41)
  links->J_arm = c * J_C;
  links->v_arm = c * v_C;
  links->dv_arm = c * dv_C;
  links->J_rod = 0.5 * (J_C + J_B);
  links->v_rod = 0.5 * (v_C + v_B);
  links->dv_rod = 0.5 * (dv_C + dv_B);

  // Rotation across the rod. (37) – (40)
  const Vec3 deta = (v_B - v_C) / L, ddeta = (dv_B - dv_C) / L;
  const Mat34 J_deta = (J_B - J_C) / L;
  links->omega = eta.cross(deta);
  links->domega = eta.cross(ddeta);
  for (int j = 0; j < kLimbs; ++j) links->J_omega.col(j) = eta.cross(J_deta.col(j));
  if (rod_model == RodModel::kThin) return;

  // Spin b ψ̇ of a universal joint with first axis a.
  const Vec3 a_eta = a.cross(eta);
  const double b = eta.dot(a), db = deta.dot(a), across = 1.0 - b * b;
  const double dpsi = deta.dot(a_eta) / across;
  const double ddpsi = ddeta.dot(a_eta) / across + 2.0 * b * db * dpsi / across;
  links->omega += b * dpsi * eta;
  links->domega += b * dpsi * deta + (db * dpsi + b * ddpsi) * eta;
  links->J_omega += b / across * eta * (a_eta.transpose() * J_deta);
}

Vec4 DriveTorques(const Parameters& parameters, const Position& position, const Rates& rates,
                  const Vec3& F_P, double M_z, RodModel rod_model) {
  const Mat4 J_inverse = InverseOfJ(parameters, position);
  const Vec3& g = parameters.gravity_W;

  // Platform: inertia and weight less the external load. (42), (46)
  Vec4 platform;
  platform << parameters.m_p * (rates.ddX.head<3>() - g) - F_P,
      parameters.I_pz * rates.ddX[3] - M_z;
  Vec4 M = J_inverse.transpose() * platform;

  // Links. (43) – (45), (47), (48)
  const double arm_inertia =
      SolidBar(parameters.m_arm, parameters.arm_radius, parameters.l1).transverse;
  LinkMotion links;
  for (int i = 0; i < kLimbs; ++i) {
    FillLinkMotion(parameters, position, rates, J_inverse, rod_model, i, &links);
    const BarInertia rod = RodInertia(parameters, rod_model, i);
    M += links.J_arm.transpose() * (parameters.m_arm * (links.dv_arm - g));
    M[i] += arm_inertia * rates.ddtheta[i];
    M += links.J_rod.transpose() * (parameters.m_rods * (links.dv_rod - g));
    M += links.J_omega.transpose() * (Times(rod, position.eta[i], links.domega) +
                                      links.omega.cross(Times(rod, position.eta[i], links.omega)));
  }
  return M;
}

double Energy(const Parameters& parameters, const Position& position, const Rates& rates,
              RodModel rod_model) {
  const Vec3& g = parameters.gravity_W;
  const double dphi = rates.dX[3];
  double energy = 0.5 * parameters.m_p * rates.dX.head<3>().squaredNorm() +
                  0.5 * parameters.I_pz * dphi * dphi -
                  parameters.m_p * g.dot(position.X.head<3>());
  const double arm_inertia =
      SolidBar(parameters.m_arm, parameters.arm_radius, parameters.l1).transverse;
  const Mat4 J_inverse = InverseOfJ(parameters, position);
  LinkMotion links;
  for (int i = 0; i < kLimbs; ++i) {
    FillLinkMotion(parameters, position, rates, J_inverse, rod_model, i, &links);
    const double L = parameters.rod_length(i), dtheta = rates.dtheta[i];
    const Vec3 p_A = parameters.R * Radial(i);
    const Vec3 p_arm = p_A + parameters.arm_com * parameters.l1 * position.u[i];
    const Vec3 p_rod = p_A + parameters.l1 * position.u[i] + 0.5 * L * position.eta[i];
    const BarInertia rod = RodInertia(parameters, rod_model, i);
    energy += 0.5 * parameters.m_arm * links.v_arm.squaredNorm() +
              0.5 * arm_inertia * dtheta * dtheta +
              0.5 * parameters.m_rods * links.v_rod.squaredNorm() +
              0.5 * links.omega.dot(Times(rod, position.eta[i], links.omega)) -
              g.dot(parameters.m_arm * p_arm + parameters.m_rods * p_rod);
  }
  return energy;
}

namespace {

// z of a × b.
double PlanarCross(const Vec3& a, const Vec3& b) { return a.x() * b.y() - a.y() * b.x(); }

// Rods of a limb: x along the rod, z along h.
Mat3 RodAxes(const Position& position, int limb) {
  const Vec3 &eta = position.eta[limb], h = eta.cross(MotorAxis(limb)).normalized();
  Mat3 R;
  R << eta, h.cross(eta), h;
  return R;
}

Mat3 ArmAxes(const Position& position, int limb) {
  const Vec3 &u = position.u[limb], &a = MotorAxis(limb);
  Mat3 R;
  R << u, a, u.cross(a);
  return R;
}

}  // namespace

std::array<LimbForces, kLimbs> JointForces(const Parameters& parameters, const Position& position,
                                           const Rates& rates, const Vec3& F_P, double M_z,
                                           RodModel rod_model) {
  const Vec3& g = parameters.gravity_W;
  const Mat4 J_inverse = InverseOfJ(parameters, position);
  std::array<LimbForces, kLimbs> forces;
  std::array<Vec3, kLimbs> f_rod, f_arm;
  Vec4 missing;  // what the platform needs along the rods
  missing << parameters.m_p * (rates.ddX.head<3>() - g) - F_P, parameters.I_pz * rates.ddX[3] - M_z;
  LinkMotion links;
  for (int i = 0; i < kLimbs; ++i) {
    FillLinkMotion(parameters, position, rates, J_inverse, rod_model, i, &links);
    const BarInertia rod = RodInertia(parameters, rod_model, i);
    const double L = parameters.rod_length(i);
    const Vec3 &eta = position.eta[i], &a = MotorAxis(i);
    // (R1)
    f_arm[i] = parameters.m_arm * (links.dv_arm - g);
    f_rod[i] = parameters.m_rods * (links.dv_rod - g);
    const Vec3 H = Times(rod, eta, links.domega) + links.omega.cross(Times(rod, eta, links.omega)) +
                   0.5 * L * eta.cross(f_rod[i]);
    // (R2): T in the axes q, h across the rod; h is square to a.
    const Mat3 axes = RodAxes(position, i);
    const Vec3 q = axes.col(1), h = axes.col(2);
    const Vec3 T = -H.dot(a) / (L * q.dot(a)) * q - H.dot(h) / L * h;
    forces[i].on_platform = T.cross(eta);
    forces[i].a_B = rates.ddX.head<3>() + position.k[i] * rates.ddX[3] -
                    position.s[i] * rates.dX[3] * rates.dX[3];
    missing.head<3>() -= forces[i].on_platform;
    missing[3] -= PlanarCross(position.s[i], forces[i].on_platform);
  }
  // (R3): the columns are the rows of J_θ.
  const Vec4 N = DirectJacobian(position).transpose().partialPivLu().solve(missing);
  // (R4)
  for (int i = 0; i < kLimbs; ++i) {
    forces[i].on_platform += N[i] * position.eta[i];
    forces[i].on_rods = f_rod[i] + forces[i].on_platform;
    forces[i].on_arm = f_arm[i] + forces[i].on_rods;
  }
  return forces;
}

ReactionChannelsOfLimbs::ReactionChannelsOfLimbs(const Mechanism& mechanism) {
  for (int limb = 0; limb < kLimbs; ++limb) {
    Add(mechanism, Kind::kMotor, limb, ".motor", "world", ".arm");
    if (limb < 2) {
      Add(mechanism, Kind::kPivot, limb, ".pivot", "platform", ".bar");
    } else {
      Add(mechanism, Kind::kWrist, limb, ".wrist", ".arm", ".rod");
      Add(mechanism, Kind::kBall, limb, ".ball_B", ".rod", "platform");
    }
  }
}

void ReactionChannelsOfLimbs::Add(const Mechanism& mechanism, Kind kind, int limb,
                                  const char* joint, const char* parent, const char* child) {
  const auto full = [&](const char* name) {
    return name[0] == '.' ? std::string(LimbName(limb)) + name : std::string(name);
  };
  const int index = mechanism.FindJoint(full(joint));
  if (index < 0) return;
  const Joint& found = mechanism.joints[static_cast<size_t>(index)];
  if (mechanism.FindBody(full(parent)) != found.parent ||
      mechanism.FindBody(full(child)) != found.child) {
    return;
  }
  entries_.push_back({kind, limb, found.X_PF.linear()});
  const std::vector<Channel> all = ReactionChannels(found);
  channels_.insert(channels_.end(), all.begin(), all.begin() + 3);
}

void ReactionChannelsOfLimbs::Write(const Parameters& parameters, const Position& position,
                                    const std::array<LimbForces, kLimbs>& forces,
                                    double* values) const {
  for (const Entry& entry : entries_) {
    const LimbForces& limb = forces[static_cast<size_t>(entry.limb)];
    Vec3 f_W = Vec3::Zero();
    Mat3 R_WP = Mat3::Identity();
    switch (entry.kind) {
      case Kind::kMotor:
        f_W = limb.on_arm;
        break;
      case Kind::kPivot:
        // Of the platform on the bar, which bears the pivot's mass.
        f_W = parameters.pivot_mass * (limb.a_B - parameters.gravity_W) - limb.on_platform;
        R_WP = RotZ(position.X[3]);
        break;
      case Kind::kWrist:
        f_W = limb.on_rods;
        R_WP = ArmAxes(position, entry.limb);
        break;
      case Kind::kBall:
        f_W = limb.on_platform;
        R_WP = RodAxes(position, entry.limb);
        break;
    }
    Eigen::Map<Vec3>{values} = (R_WP * entry.R_PF).transpose() * f_W;
    values += 3;
  }
}

}  // namespace mbv::scara_robot
