#include "simulation/engine/session.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/demand.h"
#include "mechanism/motion.h"

namespace mbv::simulation {

namespace {

// Breaks closer than this fraction of a step to a node are taken to lie on it.
constexpr double kSnap = 1e-6;

long StepsPerSample(const Motion& motion, double step_s) {
  return std::max(1L, std::lround(std::ceil(motion.sample_s / step_s - 1e-9)));
}

}  // namespace

double AdjustedStep(const Motion& motion, double step_s) {
  return motion.sample_s / static_cast<double>(StepsPerSample(motion, step_s));
}

std::vector<Step> MakeSteps(const Motion& motion, double step_s) {
  const long per_sample = StepsPerSample(motion, step_s);
  const double h = AdjustedStep(motion, step_s);
  const long samples = static_cast<long>(SampleTimes(motion.duration_s, motion.sample_s).size());
  const std::vector<double> breaks = BreakTimes(motion);
  auto next_break = breaks.begin();
  std::vector<Step> steps;
  int uniform = 1;
  for (long n = 0; n < (samples - 1) * per_sample; ++n) {
    const double from = static_cast<double>(n) * h, to = static_cast<double>(n + 1) * h;
    double at = from;
    // A break on the node before restarts the multistep history there.
    for (; next_break != breaks.end() && *next_break < to - kSnap * h; ++next_break) {
      if (*next_break < from - kSnap * h) continue;
      if (*next_break < at + kSnap * h) {
        if (at == from) uniform = 1;
        continue;
      }
      steps.push_back({.from_s = at, .to_s = *next_break});
      at = *next_break;
      uniform = 0;
    }
    const bool whole = at == from;
    steps.push_back({.from_s = at, .to_s = to, .uniform = whole ? uniform : 0});
    if ((n + 1) % per_sample == 0) steps.back().sample = (n + 1) / per_sample;
    uniform = whole ? std::min(uniform + 1, 4) : 1;
  }
  return steps;
}

namespace {

// Share of the largest generalised force (forces at the characteristic length) that is rounding.
constexpr double kNoMoment = 1e-9;

// World axis of the rotation that a velocity is, and its rate.
Eigen::Map<const Vec3> AxisOf(const mjData& d, int dof) {
  return Eigen::Map<const Vec3>(d.cdof + 6 * dof);
}
Eigen::Map<const Vec3> AxisRate(const mjData& d, int dof) {
  return Eigen::Map<const Vec3>(d.cdof_dot + 6 * dof);
}

}  // namespace

SpinStopper::SpinStopper(ConstraintSystem* system)
    : system_(system), spins_(IdleSpins(*system->engine().mechanism)) {
  const EngineModel& engine = system->engine();
  const Mechanism& mechanism = *engine.mechanism;
  for (const Spin& spin : spins_) {
    Place& place = places_.emplace_back();
    for (size_t k = 0; k < mechanism.tree_joints.size(); ++k) {
      const int j = mechanism.tree_joints[k];
      if (std::ranges::find(spin.balls, j) == spin.balls.end()) continue;
      const Joint& joint = mechanism.joints[static_cast<size_t>(j)];
      const int outboard = mechanism.tree_reversed[k] ? joint.parent : joint.child;
      const std::vector<int>& ids = engine.joint_ids[static_cast<size_t>(j)];
      MBV_DEMAND(ids.size() == 1, joint.name);
      const bool hangs = std::ranges::find(spin.bodies, outboard) != spin.bodies.end();
      (hangs ? place.first_dof : place.second_dof) = engine.m->jnt_dofadr[ids[0]];
    }
    MBV_DEMAND(place.first_dof >= 0, spin.name);
    for (int dof = place.first_dof + 2; dof >= 0; dof = engine.m->dof_parentid[dof]) {
      place.chain.push_back(dof);
    }
  }
}

Mat3 SpinStopper::RotationOf(size_t k) const {
  BodyPoses(system_->engine(), *system_->data(), &X_WB_);
  return X_WB_[static_cast<size_t>(spins_[k].bodies[0])].linear();
}

Vec3 SpinStopper::Direction(size_t k) const { return RotationOf(k) * spins_[k].n_B; }

// (2), all components
Vec3 SpinStopper::AngularVelocity(size_t k) const {
  const mjData& d = *system_->data();
  Vec3 w = Vec3::Zero();
  for (const int dof : places_[k].chain) w += AxisOf(d, dof) * d.qvel[dof];
  return w;
}

Vec3 SpinStopper::AngularAcceleration(size_t k) const {
  const mjData& d = *system_->data();
  Vec3 alpha = Vec3::Zero();
  for (const int dof : places_[k].chain) {
    alpha += AxisOf(d, dof) * d.qacc[dof] + AxisRate(d, dof) * d.qvel[dof];
  }
  return alpha;
}

// (1)
VecX SpinStopper::Motion(size_t k) const {
  const mjData& d = *system_->data();
  const Vec3 n = Direction(k);
  const Place& place = places_[k];
  VecX motion = VecX::Zero(system_->nv());
  for (int i = 0; i < 3; ++i) {
    motion[place.first_dof + i] = n.dot(AxisOf(d, place.first_dof + i));
    if (place.second_dof < 0) continue;
    motion[place.second_dof + i] = -n.dot(AxisOf(d, place.second_dof + i));
  }
  return motion;
}

void SpinStopper::Turn(size_t k, double angle) {
  VecX motion = angle * Motion(k);
  mj_integratePos(system_->engine().m.get(), system_->data()->qpos, motion.data(), 1.0);
}

RunSummary SpinStopper::TakeLeastTurns(ClosureSolver* solver, const DrivenSample& first) {
  if (spins_.empty()) return RunSummary::Done();
  for (size_t k = 0; k < spins_.size(); ++k) {
    Turn(k, -TurnFromHome(*system_->engine().mechanism, spins_[k], RotationOf(k)));
  }
  return solver->Close(first.position);
}

void SpinStopper::StopVelocity() {
  if (spins_.empty()) return;
  mjData* d = system_->data();
  Eigen::Map<VecX> qvel(d->qvel, system_->nv());
  for (size_t k = 0; k < spins_.size(); ++k) {
    qvel -= Direction(k).dot(AngularVelocity(k)) * Motion(k);
  }
  mj_comVel(system_->engine().m.get(), d);
}

void SpinStopper::StopAcceleration() {
  Eigen::Map<VecX> qacc(system_->data()->qacc, system_->nv());
  for (size_t k = 0; k < spins_.size(); ++k) {
    qacc -= Direction(k).dot(AngularAcceleration(k)) * Motion(k);
  }
}

RunSummary SpinStopper::Transport(double t_s, const DrivenSample& at, ClosureSolver* solver,
                                  bool* turned) {
  *turned = !last_lines_.empty();
  std::vector<LastLine> lines;
  for (size_t k = 0; k < spins_.size(); ++k) {
    const MovingDirection line =
        DirectionOf(Direction(k), AngularVelocity(k), AngularAcceleration(k));
    const Mat3 here = RotationOf(k);
    lines.push_back({line, here});
    if (!*turned) continue;
    lines[k].R_WB = Transported(last_lines_[k].R_WB, last_lines_[k].line, line, t_s - last_s_);
    Turn(k, -TurnBeyond(lines[k].R_WB, here, line.n));
  }
  last_lines_ = std::move(lines);
  last_s_ = t_s;
  return *turned ? solver->Close(at.position) : RunSummary::Done();
}

RunSummary SpinStopper::CheckIdle(const VecX& tau) const {
  if (spins_.empty()) return RunSummary::Done();
  const double largest = tau.cwiseProduct(system_->dof_unit()).lpNorm<Eigen::Infinity>();
  for (size_t k = 0; k < spins_.size(); ++k) {
    const double moment = tau.dot(Motion(k));
    if (std::abs(moment) <= kNoMoment * largest) continue;
    return {.stop = Stop::kUnsupported,
            .message = fmt::format("a moment of {:.3g} N m about the line through both balls of {} "
                                   "changes its spin, which counts as idle; hold it by a universal "
                                   "joint",
                                   -moment, spins_[k].name),
            .where = spins_[k].name,
            .amount = -moment,
            .unit = std::string("N m"),
            .names_where = true};
  }
  return RunSummary::Done();
}

}  // namespace mbv::simulation
