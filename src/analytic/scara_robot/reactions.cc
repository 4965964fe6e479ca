#include "analytic/scara_robot/reactions.h"

#include "core/spatial.h"
#include "mechanism/channels.h"

namespace mbv::scara {
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

}  // namespace mbv::scara
