#include "simulation/engine/load_friction.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "simulation/engine/element_forces.h"

namespace mbv::simulation {
namespace {

constexpr int kMostSteps = 50;
constexpr double kLoadSettled = 1e-14;
// A share of a load that redundant constraints move; less is round-off.
constexpr double kShifts = 1e-9;

const ForceElement& ElementOf(const Session& s, size_t e) {
  return s.engine.mechanism->elements[e];
}

double SizeOf(const BearingLoad& load) { return load.colwise().norm().sum(); }

double LargestOf(const std::vector<BearingLoad>& loads) {
  double largest = 0.0;
  for (const BearingLoad& load : loads) largest = std::max(largest, SizeOf(load));
  return largest > 0.0 ? largest : 1.0;
}

}  // namespace

std::vector<size_t> LoadedElements(const Mechanism& mechanism) {
  std::vector<size_t> loaded;
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    const auto* friction = std::get_if<FrictionLaw>(&mechanism.elements[e].law);
    if (friction != nullptr && friction->by_load()) loaded.push_back(e);
  }
  return loaded;
}

VecX LoadFrictionOf(Session* session) {
  VecX sizes = VecX::Zero(static_cast<Eigen::Index>(session->engine.mechanism->elements.size()));
  const std::vector<BearingLoad> loads = session->recorder.LoadsOf(session->loaded, session->loads);
  for (size_t d = 0; d < loads.size(); ++d) {
    sizes[static_cast<Eigen::Index>(session->loaded[d])] = SizeOf(loads[d]);
  }
  return sizes;
}

LoadFriction::LoadFriction(Session* session) : s_(*session) {
  if (s_.loaded.empty()) return;
  found_ = s_.system.force();
  if (s_.released) {
    p_ = s_.recorder.LoadsOf(s_.loaded, s_.loads);
    CheckUnique();
    return;
  }
  FindLoads();
  CheckUnique();
  if (!SolveLoads()) {
    s_.trouble = {.stop = Stop::kSingular,
                  .message =
                      "the loads of joints with friction by load are not found: they and "
                      "the friction raise each other",
                  .where = ElementOf(s_, s_.loaded.front()).name};
  }
  Apply();
}

LoadFriction::~LoadFriction() {
  if (s_.loaded.empty() || s_.released) return;
  s_.system.force() = found_;
  s_.system.SetLoadFriction({});
}

// p, P and the constraint forces that belong to it.
void LoadFriction::FindLoads() {
  const auto count = static_cast<Eigen::Index>(s_.loaded.size());
  p_ = s_.recorder.LoadsOf(s_.loaded, s_.loads);
  P_.assign(s_.loaded.size(), std::vector<BearingLoad>(s_.loaded.size()));
  unit_.resize(found_.size(), count);
  sign_.setZero(count);
  for (size_t d = 0; d < s_.loaded.size(); ++d) {
    const size_t e = s_.loaded[d];
    const ElementMotion at = ElementMotionOf(s_.system, e);
    if (!at.rests) sign_[static_cast<Eigen::Index>(d)] = std::copysign(1.0, at.rate);
    const VecX tau = -ElementGradient(s_.system, e);
    if (s_.shared) {
      s_.solver.SolveLeastDriven(tau);
    } else {
      s_.solver.SolveForcesHere(tau);
    }
    unit_.col(static_cast<Eigen::Index>(d)) = s_.system.force();
    const double size = LargestOf(p_);  // as it will be: differences keep their digits
    const double force = at.rests ? 0.0 : -size * sign_[static_cast<Eigen::Index>(d)];
    s_.system.force() = found_ + force * unit_.col(static_cast<Eigen::Index>(d));
    // The element's own force is in no reaction.
    VecX own = VecX::Zero(static_cast<Eigen::Index>(s_.engine.mechanism->elements.size()));
    own[static_cast<Eigen::Index>(e)] = size;
    s_.system.SetLoadFriction(own);
    const std::vector<BearingLoad> moved = s_.recorder.LoadsOf(s_.loaded, s_.loads);
    for (size_t k = 0; k < moved.size(); ++k) {
      P_[k][d] =
          at.rests ? BearingLoad(BearingLoad::Zero()) : BearingLoad((moved[k] - p_[k]) / force);
    }
  }
  s_.system.force() = found_;
  s_.system.SetLoadFriction({});
}

void LoadFriction::CheckUnique() {
  const MatX self_stress = s_.solver.SelfStress();
  const double size = found_.size() == 0 ? 1.0 : std::max(1.0, found_.cwiseAbs().maxCoeff());
  for (Eigen::Index k = 0; k < self_stress.cols(); ++k) {
    s_.system.force() = found_ + size * self_stress.col(k);
    const std::vector<BearingLoad> moved = s_.recorder.LoadsOf(s_.loaded, s_.loads);
    const double shifts = kShifts * size * self_stress.col(k).cwiseAbs().maxCoeff();
    for (size_t e = 0; e < moved.size(); ++e) {
      const ForceElement& element = ElementOf(s_, s_.loaded[e]);
      const double per_load = std::get<FrictionLaw>(element.law).per_load();
      if (SizeOf(moved[e] - p_[e]) <= shifts * per_load) continue;
      s_.trouble = {.stop = Stop::kUnsupported,
                    .message = "redundant constraints share the load of the " +
                               Described(*s_.engine.mechanism, element) + " ('" + element.name +
                               "'): statics does not determine it",
                    .where = element.name,
                    .names_where = true};
    }
  }
  s_.system.force() = found_;
}

// S_e − |p_e − Σ_d P_ed s_d S_d| = 0.
bool LoadFriction::SolveLoads() {
  const auto count = static_cast<Eigen::Index>(p_.size());
  S_.resize(count);
  for (Eigen::Index e = 0; e < count; ++e) S_[e] = SizeOf(p_[static_cast<size_t>(e)]);
  VecX rest(count);
  MatX slope(count, count);
  for (int step = 0; step < kMostSteps; ++step) {
    for (Eigen::Index e = 0; e < count; ++e) {
      const auto k = static_cast<size_t>(e);
      BearingLoad v = p_[k];
      for (Eigen::Index d = 0; d < count; ++d)
        v -= P_[k][static_cast<size_t>(d)] * sign_[d] * S_[d];
      BearingLoad along = v;
      for (int c = 0; c < 3; ++c) along.col(c).stableNormalize();  // zero stays zero
      rest[e] = S_[e] - SizeOf(v);
      for (Eigen::Index d = 0; d < count; ++d) {
        slope(e, d) = (e == d ? 1.0 : 0.0) +
                      along.cwiseProduct(P_[k][static_cast<size_t>(d)]).sum() * sign_[d];
      }
    }
    const VecX change = slope.partialPivLu().solve(rest);
    S_ -= change;
    if (change.cwiseAbs().maxCoeff() <= kLoadSettled * S_.cwiseAbs().maxCoeff()) {
      return S_.minCoeff() >= 0.0;
    }
  }
  return false;
}

void LoadFriction::Apply() {
  VecX sizes = VecX::Zero(static_cast<Eigen::Index>(s_.engine.mechanism->elements.size()));
  VecX force = found_;
  for (size_t d = 0; d < s_.loaded.size(); ++d) {
    const auto k = static_cast<Eigen::Index>(d);
    sizes[static_cast<Eigen::Index>(s_.loaded[d])] = S_[k];
    force -= sign_[k] * S_[k] * unit_.col(k);
  }
  s_.system.force() = force;
  s_.system.SetLoadFriction(sizes);
}

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
VecX OnlyDof(const ConstraintSystem& system) {
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
  const VecX direction = OnlyDof(s_.system);
  if (direction.size() == 0) return;
  const auto force = Forces(&s_);
  double load = 0.0;
  int held = 0;
  for (int row = 0; row < rows; ++row) {
    if (s_.system.HeldLoss(row) > 0.0) ++held;
    load += s_.system.FrictionJacobian(row).dot(direction) * force[row];
  }
  if (held < 2) return;
  found_ = s_.system.force();
  held_ = force;
  load_friction_.setZero(static_cast<Eigen::Index>(s_.engine.mechanism->elements.size()));
  for (const size_t e : s_.loaded) {
    load_friction_[static_cast<Eigen::Index>(e)] = s_.system.load_friction(e);
  }
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const double change = Share(direction, load);
    if (change <= kSharesSettled * held_.cwiseAbs().maxCoeff()) return;
    if (!s_.loaded.empty()) s_.system.SetLoadFriction(LoadFrictionOf(&s_));
  }
}

// By the present breakaway forces; how much that changes what friction exerts.
double HeldShares::Share(const VecX& direction, double load) {
  double most = 0.0;
  for (int row = 0; row < held_.size(); ++row) {
    const double rate = s_.system.FrictionJacobian(row).dot(direction);
    most += s_.system.HeldLoss(row) * std::abs(rate);
  }
  if (most == 0.0) return 0.0;
  auto force = Forces(&s_);
  const VecX before = force;
  VecX tau = VecX::Zero(s_.system.nv());  // what the loops take over
  for (int row = 0; row < held_.size(); ++row) {
    const VecX gradient = s_.system.FrictionJacobian(row);
    force[row] = std::copysign(s_.system.HeldLoss(row), gradient.dot(direction)) * load / most;
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
