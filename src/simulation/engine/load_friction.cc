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

double OfCoupling(const BearingLoad& load) { return load(0, 2); }

const FrictionLaw& LawOf(const Session& s, size_t e) {
  return std::get<FrictionLaw>(ElementOf(s, e).law);
}
double SkewOf(const Session& s, size_t e) { return LawOf(s, e).skew / LawOf(s, e).coefficient; }

ConstraintSystem::FrictionByLoad NoFriction(const Session& s) {
  const VecX none = VecX::Zero(static_cast<Eigen::Index>(s.engine.mechanism->elements.size()));
  return {.size = none, .force = none};
}

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

ConstraintSystem::FrictionByLoad LoadFrictionOf(Session* session) {
  ConstraintSystem::FrictionByLoad found = NoFriction(*session);
  const std::vector<BearingLoad> loads = session->recorder.LoadsOf(session->loaded, session->loads);
  for (size_t d = 0; d < loads.size(); ++d) {
    const auto e = static_cast<Eigen::Index>(session->loaded[d]);
    found.size[e] = SizeOf(loads[d]);
    found.force[e] = SkewOf(*session, session->loaded[d]) * OfCoupling(loads[d]);
  }
  return found;
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
  skew_.setZero(count);
  for (size_t d = 0; d < s_.loaded.size(); ++d) {
    const size_t e = s_.loaded[d];
    const auto k = static_cast<Eigen::Index>(d);
    const ElementMotion at = ElementMotionOf(s_.system, e);
    if (!at.rests) sign_[k] = std::copysign(1.0, at.rate);
    skew_[k] = SkewOf(s_, e);
    const bool acts = !at.rests || skew_[k] != 0.0;
    const VecX tau = -ElementGradient(s_.system, e);
    if (s_.shared) {
      s_.solver.SolveLeastDriven(tau);
    } else {
      s_.solver.SolveForcesHere(tau);
    }
    unit_.col(k) = s_.system.force();
    // As large as it will be: differences keep their digits.
    const double force = LargestOf(p_) * (sign_[k] > 0.0 ? -1.0 : 1.0);
    s_.system.force() = found_ + force * unit_.col(k);
    // The element's own force is in no reaction.
    ConstraintSystem::FrictionByLoad own = NoFriction(s_);
    own.force[static_cast<Eigen::Index>(e)] = force;
    s_.system.SetLoadFriction(std::move(own));
    const std::vector<BearingLoad> moved = s_.recorder.LoadsOf(s_.loaded, s_.loads);
    for (size_t i = 0; i < moved.size(); ++i) {
      P_[i][d] = acts ? BearingLoad((moved[i] - p_[i]) / force) : BearingLoad(BearingLoad::Zero());
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

double LoadFriction::Force(Eigen::Index d) const {
  return skew_[d] * v_[d] - sign_[d] * std::abs(v_[d]);
}

// v_e − (p_e + Σ_d P_ed F_d) = 0, or with the size of that.
bool LoadFriction::SolveLoads() {
  const auto count = static_cast<Eigen::Index>(p_.size());
  const auto of_coupling = [&](Eigen::Index e) {
    return LawOf(s_, s_.loaded[static_cast<size_t>(e)]).coupling >= 0;
  };
  v_.resize(count);
  for (Eigen::Index e = 0; e < count; ++e) {
    const BearingLoad& p = p_[static_cast<size_t>(e)];
    v_[e] = of_coupling(e) ? OfCoupling(p) : SizeOf(p);
  }
  VecX rest(count), by_v(count);
  MatX slope(count, count);
  for (int step = 0; step < kMostSteps; ++step) {
    by_v = skew_ - sign_.cwiseProduct(v_.cwiseSign());
    for (Eigen::Index e = 0; e < count; ++e) {
      const auto k = static_cast<size_t>(e);
      BearingLoad v = p_[k];
      for (Eigen::Index d = 0; d < count; ++d) v += P_[k][static_cast<size_t>(d)] * Force(d);
      BearingLoad along = BearingLoad::Zero();
      if (of_coupling(e)) {
        along(0, 2) = 1.0;
      } else {
        along = v;
        for (int c = 0; c < 3; ++c) along.col(c).stableNormalize();  // zero stays zero
      }
      rest[e] = v_[e] - (of_coupling(e) ? OfCoupling(v) : SizeOf(v));
      for (Eigen::Index d = 0; d < count; ++d) {
        slope(e, d) = (e == d ? 1.0 : 0.0) -
                      along.cwiseProduct(P_[k][static_cast<size_t>(d)]).sum() * by_v[d];
      }
    }
    const VecX change = slope.partialPivLu().solve(rest);
    v_ -= change;
    if (change.cwiseAbs().maxCoeff() > kLoadSettled * v_.cwiseAbs().maxCoeff()) continue;
    for (Eigen::Index e = 0; e < count; ++e) {
      if (!of_coupling(e) && v_[e] < 0.0) return false;
    }
    return true;
  }
  return false;
}

void LoadFriction::Apply() {
  ConstraintSystem::FrictionByLoad friction = NoFriction(s_);
  VecX force = found_;
  for (size_t d = 0; d < s_.loaded.size(); ++d) {
    const auto k = static_cast<Eigen::Index>(d), e = static_cast<Eigen::Index>(s_.loaded[d]);
    friction.size[e] = std::abs(v_[k]);
    friction.force[e] = skew_[k] * v_[k];
    force += Force(k) * unit_.col(k);
  }
  s_.system.force() = force;
  s_.system.SetLoadFriction(std::move(friction));
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
  load_friction_ = s_.system.load_friction();
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
