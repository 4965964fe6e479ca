#include "analytic/stabilizing_platform/equations.h"

namespace mbv::stabilizing_platform {
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
