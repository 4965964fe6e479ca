#include "reference/force_solver.h"

#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include "core/demand.h"
#include "core/spatial.h"
#include "kinematics/idle_rows.h"
#include "mechanism/reach.h"
#include "reference/closure_failure.h"
#include "reference/element_forces.h"
#include "reference/least_forces.h"
#include "reference/load_friction.h"
#include "reference/spin_check.h"

namespace mbv::internal {
namespace {

// Forces must satisfy the equations of motion to this share of the largest wrench.
constexpr double kBalanceTolerance = 1e-9;
// A smaller share of the largest that one resting element opens is round-off.
constexpr double kOpens = 1e-9;
// More self-stresses than this are not looked at one by one.
constexpr size_t kFewSelfStresses = 24;

int ReactionRows(const Joint& joint, const ConstraintRows& rows) {
  return joint.transmits_force_only ? rows.translation_rows : rows.rows;
}

}  // namespace

void AddReactionRows(const Mechanism& mechanism, const BodyStates& states, RowSet* out) {
  for (const Joint& joint : mechanism.joints) {
    const ConstraintRows rows = RowsOf(joint, states, true);
    out->Add(rows, ReactionRows(joint, rows));
  }
  for (const CouplingRow& row : CouplingRows(mechanism, states)) out->Add(row);
}

ForceSolver::ForceSolver(const Mechanism& mechanism, double duration_s)
    : mechanism_(mechanism),
      length_(CharacteristicLength(mechanism)),
      lever_(LongestLever(mechanism)),
      duration_s_(duration_s),
      system_(mechanism.bodies.size(), length_),
      spins_(IdleSpins(mechanism)) {}

void ForceSolver::FillRows(const BodyStates& states) {
  rows_.Clear();
  AddReactionRows(mechanism_, states, &rows_);
  first_driven_ = rows_.size();
  for (const Drive& drive : mechanism_.drives) {
    rows_.Add(DriveRow(mechanism_, drive, states), PositionUnit(mechanism_, drive) == "rad");
  }
  for (const Prescribed& prescribed : mechanism_.prescribed) {
    const Joint& joint = mechanism_.joints[prescribed.joint];
    rows_.Add(JointCoordinateRow(joint, 0, states), !IsLength(joint.kind, 0));
  }
  for (const Spin& spin : spins_) rows_.Add(IdleRow(spin, states), true);
}

RunSummary ForceSolver::SelectBasis() {
  basis_ = system_.IndependentRows(rows_, 0, rows_.size());
  if (static_cast<int>(basis_.size()) < system_.size()) {
    RunSummary summary;
    summary.stop = Stop::kSingular;
    summary.message = fmt::format(
        "drives and reactions cannot hold the mechanism at this pose: {} of {} equations of motion "
        "have no force",
        system_.size() - static_cast<int>(basis_.size()), system_.size());
    return summary;
  }
  rest_.clear();
  for (int i = 0, next = 0; i < rows_.size(); ++i) {
    if (next < system_.size() && basis_[next] == i) {
      ++next;
    } else {
      rest_.push_back(i);
    }
  }
  basis_is_new_ = chosen_ = true;
  orientation_ = 0;
  return RunSummary::Done();
}

bool ForceSolver::Factor() {
  if (!system_.Factor(rows_, basis_, basis_is_new_)) return false;
  sparse_ = rest_.size() > kFewSelfStresses && FactorSparse();
  basis_is_new_ = false;
  if (!sparse_) FindSelfStress();
  return true;
}

bool ForceSolver::FactorSparse() {
  std::vector<int> all(static_cast<size_t>(rows_.size()));
  std::iota(all.begin(), all.end(), 0);
  if (basis_is_new_) {
    system_.MakeColumns(rows_, all, &columns_);
    least_.Reset();
  } else {
    system_.FillColumns(rows_, all, &columns_);
  }
  return least_.Factor(columns_, 0.0) && !SelfStressReaches(least_, columns_, first_driven_);
}

// Each force outside the basis with the basis forces that balance it.
void ForceSolver::FindSelfStress() {
  self_stress_.resize(rows_.size(), static_cast<Eigen::Index>(rest_.size()));
  for (size_t k = 0; k < rest_.size(); ++k) {
    const int i = rest_[k];
    VecX wrench = VecX::Zero(system_.size());
    for (int p = rows_.start[i]; p < rows_.start[i + 1]; ++p) {
      wrench.segment<6>(6 * (rows_.body[p] - 1)) = system_.RowScale(rows_.angular[i]) * rows_.J[p];
    }
    const VecX balance = -system_.Solve(wrench);
    self_stress_.col(k).setZero();
    for (int b = 0; b < system_.size(); ++b) {
      self_stress_(basis_[b], k) = balance[b] / system_.RowScale(rows_.angular[basis_[b]]);
    }
    self_stress_(i, k) = 1.0;
  }
}

RunSummary ForceSolver::CheckControl(const BodyStates& states) {
  const double sigma = system_.SmallestSingularValue(1);
  const int orientation = system_.determinant_sign();
  // With forces left over, another choice of basis would have another sign.
  const bool crossed = rest_.empty() && orientation_ != 0 && orientation != orientation_;
  orientation_ = orientation;
  const double rounding = GapRounding(Reach(lever_, states.X_WB)) / length_;
  if (!crossed && sigma > SingularValueLimit(rounding)) return RunSummary::Done();
  RunSummary summary;
  summary.stop = Stop::kSingular;
  summary.where = MostMovingJoint(mechanism_, states, system_.SoftMotion());
  summary.amount = sigma;
  summary.unit = std::string("1");
  summary.message =
      fmt::format("the drives lose control of {}{} (smallest singular value {:.1e})", summary.where,
                  crossed ? " between the last sample and this one" : "", sigma);
  return summary;
}

double ForceSolver::Missing(const VecX& force, const VecX& wrenches, VecX* residual) const {
  std::vector<Vec6> have(mechanism_.bodies.size(), Vec6::Zero());
  rows_.AddWrenches(force, &have);
  *residual = wrenches - Stack(have);
  return system_.body_scale().cwiseProduct(*residual).cwiseAbs().maxCoeff();
}

VecX ForceSolver::LeastNorm(const VecX& wrenches) {
  VecX scale(rows_.size());
  for (int i = 0; i < rows_.size(); ++i) scale[i] = system_.RowScale(rows_.angular[i]);
  if (sparse_) {
    return scale.cwiseProduct(least_.LeastNorm(system_.body_scale().cwiseProduct(wrenches)));
  }
  VecX force = VecX::Zero(rows_.size());
  VecX missing = wrenches;
  // The second pass is iterative refinement.
  for (int pass = 0; pass < 2; ++pass) {
    const VecX part = system_.Solve(missing);
    for (int b = 0; b < system_.size(); ++b) force[basis_[b]] += part[b];
    (void)Missing(force, wrenches, &missing);
  }
  if (rest_.empty()) return force;
  VecX scaled = force.cwiseQuotient(scale);
  TakeLeastForces(self_stress_, first_driven_, &scaled);
  return scale.cwiseProduct(scaled);
}

RunSummary ForceSolver::Solve(const std::vector<LoadSample>& loads, ReferenceSample* sample) {
  FillRows(sample->states);
  std::vector<Vec6> required;
  sample->rubbing = RubbingOf(mechanism_, sample->states, duration_s_);
  RequiredWrenches(mechanism_, sample->states, loads, sample->rubbing, &required);
  if (RunSummary summary = CheckSpinsIdle(spins_, sample->states, required, length_);
      !summary.ok()) {
    return summary;
  }
  const VecX wrenches = Stack(required);
  const double largest =
      system_.size() == 0 ? 0.0 : system_.body_scale().cwiseProduct(wrenches).cwiseAbs().maxCoeff();

  // A basis chosen earlier may have become bad; choose again once.
  VecX residual;
  RunSummary control = RunSummary::Done();
  for (int attempt = chosen_ ? 0 : 1; attempt < 2; ++attempt) {
    if (attempt == 1) {
      if (RunSummary summary = SelectBasis(); !summary.ok()) {
        return control.ok() ? summary : control;
      }
    }
    if (!Factor()) continue;
    control = CheckControl(sample->states);
    if (!control.ok()) {
      // Of redundant rows the basis may have become dependent, not the mechanism.
      if (attempt == 0 && !rest_.empty()) continue;
      return control;
    }
    VecX force = LeastNorm(wrenches);
    if (!(Missing(force, wrenches, &residual) <= kBalanceTolerance * largest)) continue;
    if (RunSummary summary = AddLoadFriction(sample, &force); !summary.ok()) return summary;
    Report(force, sample);
    FindBands(sample);
    AuditSample(mechanism_, loads, sample);
    return RunSummary::Done();
  }
  RunSummary summary;
  summary.stop = Stop::kSingular;
  summary.message = "the drives do not control the mechanism at this pose";
  return summary;
}

int FillReactions(const Mechanism& mechanism, const BodyStates& states, const VecX& force,
                  MatX* reactions) {
  const auto joints = static_cast<Eigen::Index>(mechanism.joints.size());
  reactions->setZero(joints, 6);
  int row = 0;
  for (Eigen::Index j = 0; j < joints; ++j) {
    const Joint& joint = mechanism.joints[j];
    // Wrench on the child about Co in world axes …
    Vec6 wrench = Vec6::Zero();
    const ConstraintRows rows = RowsOf(joint, states, true);
    for (int i = 0; i < ReactionRows(joint, rows); ++i) {
      wrench += force[row++] * rows.J_child.row(i).transpose();
    }
    // … moved to Mo and turned into F.
    const Pose& X_WC = states.X_WB[joint.child];
    const Vec3 p_CoMo = X_WC.linear() * joint.X_CM.translation();
    const Mat3 R_FW = (states.X_WB[joint.parent].linear() * joint.X_PF.linear()).transpose();
    const Vec3 moment = wrench.head<3>() - p_CoMo.cross(wrench.tail<3>());
    reactions->row(j) << (R_FW * wrench.tail<3>()).transpose(), (R_FW * moment).transpose();
  }
  return row + static_cast<int>(mechanism.couplings.size());
}

void ForceSolver::Report(const VecX& force, ReferenceSample* sample) const {
  int row = FillReactions(mechanism_, sample->states, force, &sample->reactions);
  sample->drive_force = force.segment(row, mechanism_.drives.size());
  row += static_cast<int>(mechanism_.drives.size());
  sample->prescribed_force = force.segment(row, mechanism_.prescribed.size());
}

MatX ForceSolver::ReactionsOf(const VecX& force, const BodyStates& states) const {
  MatX reactions;
  (void)FillReactions(mechanism_, states, force, &reactions);
  return reactions;
}

// A load that a self-stress changes is no load that friction could follow.
RunSummary ForceSolver::CheckLoadsUnique(const ReferenceSample& sample,
                                         const std::vector<size_t>& loaded) {
  if (sparse_) FindSelfStress();
  for (Eigen::Index k = 0; k < self_stress_.cols(); ++k) {
    VecX force = self_stress_.col(k);
    for (int i = 0; i < rows_.size(); ++i) force[i] *= system_.RowScale(rows_.angular[i]);
    const MatX reactions = ReactionsOf(force, sample.states);
    for (const size_t e : loaded) {
      if (AcrossAxis(mechanism_, e, reactions).norm() <= kOpens * force.cwiseAbs().maxCoeff()) {
        continue;
      }
      return LoadShared(mechanism_, e);
    }
  }
  return RunSummary::Done();
}

// Eqs. 1 and 2 of load_friction.h.
RunSummary ForceSolver::AddLoadFriction(ReferenceSample* sample, VecX* force) {
  const std::vector<size_t> loaded = LoadedElements(mechanism_);
  sample->load_friction.resize(0);
  if (loaded.empty()) return RunSummary::Done();
  if (RunSummary summary = CheckLoadsUnique(*sample, loaded); !summary.ok()) return summary;
  const std::vector<ScalarRow> rows = ElementRows(mechanism_, sample->states);
  LoadSystem system;
  MatX unit(force->size(), static_cast<Eigen::Index>(loaded.size()));  // forces per unit of each
  const MatX reactions = ReactionsOf(*force, sample->states);
  for (size_t d = 0; d < loaded.size(); ++d) {
    const size_t e = loaded[d];
    unit.col(static_cast<Eigen::Index>(d)) =
        -LeastNorm(GradientOf(rows[e], mechanism_.bodies.size()));
    system.p.push_back(AcrossAxis(mechanism_, e, reactions));
    system.sign.push_back(sample->rubbing[e]);
    system.per_load.push_back(std::get<FrictionLaw>(mechanism_.elements[e].law).per_load());
  }
  for (const size_t e : loaded) {
    std::vector<Vec3>& row = system.P.emplace_back();
    for (Eigen::Index d = 0; d < unit.cols(); ++d) {
      row.push_back(AcrossAxis(mechanism_, e, ReactionsOf(unit.col(d), sample->states)));
    }
  }
  VecX n;
  if (RunSummary summary = system.Solve(&n); !summary.ok()) return summary;
  sample->load_friction.setZero(static_cast<Eigen::Index>(mechanism_.elements.size()));
  for (size_t d = 0; d < loaded.size(); ++d) {
    const auto k = static_cast<Eigen::Index>(d);
    const double size = system.per_load[d] * n[k];
    sample->load_friction[static_cast<Eigen::Index>(loaded[d])] = size;
    *force -= system.sign[d] * size * unit.col(k);
  }
  return RunSummary::Done();
}

// Of the driven forces that one element opens, moments divided by the characteristic length.
void ForceSolver::TakeRoundoff(VecX* driven) const {
  VecX size = *driven;
  for (Eigen::Index k = 0; k < size.size(); ++k) {
    if (rows_.angular[static_cast<size_t>(first_driven_ + k)]) size[k] /= length_;
  }
  const double least = size.size() == 0 ? 0.0 : kOpens * size.maxCoeff();
  *driven = (size.array() > least).select(*driven, 0.0);
}

void ForceSolver::FindBands(ReferenceSample* sample) {
  const auto drives = static_cast<Eigen::Index>(mechanism_.drives.size());
  const auto bases = static_cast<Eigen::Index>(mechanism_.prescribed.size());
  VecX band = VecX::Zero(drives + bases);
  for (const VecX& wrenches :
       RestingWrenches(mechanism_, sample->states, sample->rubbing, sample->load_friction)) {
    VecX part = LeastNorm(wrenches).segment(first_driven_, drives + bases).cwiseAbs();
    TakeRoundoff(&part);
    band += part;
  }
  sample->drive_band = band.head(drives);
  sample->prescribed_band = band.tail(bases);
}

}  // namespace mbv::internal
