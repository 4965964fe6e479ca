#include "simulation/held_shares.h"

#include <cmath>

#include "simulation/load_friction.h"

namespace mbv::simulation {
namespace {

// A smaller share of a row that loops leave open is none.
constexpr double kOpenShare = 1e-9;

constexpr double kSharesSettled = 1e-14;
constexpr int kMostPasses = 100;

// What MuJoCo's rows of friction exert.
Eigen::Map<VecX> Forces(Session* session) {
  return {session->data->efc_force + session->system.rows(), session->system.friction_rows()};
}

// The only motion that the loops leave, in units that suit the mechanism; empty where there are
// more.
VecX OnlyFreedom(const ConstraintSystem& system) {
  if (system.rows() == 0) return system.nv() == 1 ? VecX(VecX::Ones(1)) : VecX();
  Eigen::ColPivHouseholderQR<MatX> qr;
  qr.setThreshold(kOpenShare);
  qr.compute(system.ScaledJ().transpose());
  if (qr.rank() != system.nv() - 1) return VecX();
  const VecX last = qr.householderQ() * VecX::Unit(system.nv(), system.nv() - 1);
  return last.cwiseProduct(system.dof_unit());
}

}  // namespace

HeldShares::HeldShares(Session* session) : s_(*session) {
  const int rows = s_.system.friction_rows();
  if (rows < 2 || s_.system.sliding().empty()) return;
  const VecX freedom = OnlyFreedom(s_.system);
  if (freedom.size() == 0) return;
  const auto force = Forces(&s_);
  double load = 0.0;
  int held = 0;
  for (int row = 0; row < rows; ++row) {
    if (s_.system.HeldLoss(row) > 0.0) ++held;
    load += s_.system.FrictionJacobian(row).dot(freedom) * force[row];
  }
  if (held < 2) return;
  found_ = s_.system.force();
  held_ = force;
  load_friction_.setZero(static_cast<Eigen::Index>(s_.engine.mechanism->elements.size()));
  for (const size_t e : s_.loaded) {
    load_friction_[static_cast<Eigen::Index>(e)] = s_.system.load_friction(e);
  }
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const double change = Share(freedom, load);
    if (change <= kSharesSettled * held_.cwiseAbs().maxCoeff()) return;
    if (!s_.loaded.empty()) s_.system.SetLoadFriction(LoadFrictionOf(&s_));
  }
}

// By the present breakaway forces; how much that changes what friction exerts.
double HeldShares::Share(const VecX& freedom, double load) {
  double most = 0.0;
  for (int row = 0; row < held_.size(); ++row) {
    const double rate = s_.system.FrictionJacobian(row).dot(freedom);
    most += s_.system.HeldLoss(row) * std::abs(rate);
  }
  if (most == 0.0) return 0.0;
  auto force = Forces(&s_);
  const VecX before = force;
  VecX tau = VecX::Zero(s_.system.nv());  // what the loops take over
  for (int row = 0; row < held_.size(); ++row) {
    const VecX gradient = s_.system.FrictionJacobian(row);
    force[row] = std::copysign(s_.system.HeldLoss(row), gradient.dot(freedom)) * load / most;
    tau += (held_[row] - force[row]) * gradient;
  }
  s_.solver.SolveForcesHere(tau);
  s_.system.force() += found_;
  return (VecX(force) - before).cwiseAbs().maxCoeff();
}

HeldShares::~HeldShares() {
  if (held_.size() == 0) return;
  s_.system.force() = found_;
  Forces(&s_) = held_;
  if (!s_.loaded.empty()) s_.system.SetLoadFriction(load_friction_);
}

}  // namespace mbv::simulation
