#include "reference/force_solver.h"

#include <fmt/format.h>
#include <cmath>
#include <numeric>
#include <utility>

#include "kinematics/constraints.h"
#include "kinematics/tree_motion.h"
#include "math/spatial.h"
#include "mechanism/reach.h"
#include "mechanism/spanning_tree.h"
#include "reference/closure_solver.h"
#include "reference/element_forces.h"
#include "reference/sample_recorder.h"

namespace mbv::internal {
namespace {

// A self-stress with a smaller share than this in the driven forces does not act there.
constexpr double kShare = 1e-7;

}  // namespace

void LeastForces::Take(const MatX& self_stress, Eigen::Index first_driven, VecX* force) {
  const Eigen::Index k = self_stress.cols(), driven = force->size() - first_driven;
  if (k == 0) return;
  qr_.compute(self_stress);
  Q_.setIdentity(self_stress.rows(), k);
  householder_.resize(k);
  qr_.householderQ().applyThisOnTheLeft(Q_, householder_);
  if (driven > 0) {
    driven_rows_ = Q_.bottomRows(driven);
    svd_.compute(driven_rows_, Eigen::ComputeThinU | Eigen::ComputeFullV);
    const VecX& share = svd_.singularValues();
    Eigen::Index acting = 0;
    while (acting < share.size() && share[acting] > kShare) ++acting;
    along_.noalias() = svd_.matrixU().leftCols(acting).transpose() * force->tail(driven);
    along_.array() /= share.head(acting).array();
    share_.noalias() = svd_.matrixV().leftCols(acting) * along_;
    force->noalias() -= Q_ * share_;
    rest_.noalias() = Q_ * svd_.matrixV().rightCols(k - acting);
  } else {
    rest_ = Q_;
  }
  rest_share_.noalias() = rest_.transpose() * *force;
  force->noalias() -= rest_ * rest_share_;
}

VecX RandomSelfStress(const SparseLeastNorm& forces, const SparseLu::Matrix& A) {
  VecX random(A.cols());
  for (Eigen::Index i = 0; i < random.size(); ++i) {
    random[i] = std::sin(1.0 + 1.7 * static_cast<double>(i) + std::cos(static_cast<double>(i)));
  }
  return random - forces.LeastNorm(A * random);
}

bool SelfStressReaches(const VecX& random_stress, Eigen::Index first) {
  return random_stress.tail(random_stress.size() - first).norm() > kShare * random_stress.norm();
}

namespace {

// Forces must satisfy the equations of motion to this share of the largest wrench.
constexpr double kBalanceTolerance = 1e-9;
// A smaller share of the largest that one resting element opens is round-off.
constexpr double kOpens = 1e-9;
// Forces are refined while that makes what they leave open smaller by this, and not for ever.
constexpr double kPassHelps = 0.1;
constexpr int kMostRefinements = 8;
// More self-stresses than this are not looked at one by one.
constexpr size_t kFewSelfStresses = 24;

}  // namespace

int ReactionRows(const Joint& joint) {
  return joint.transmits_force_only ? 3 : 6 - DofsOf(joint.kind);
}

void AddReactionRows(const Mechanism& mechanism, const BodyStates& states, RowSet* out) {
  for (const Joint& joint : mechanism.joints) {
    const ConstraintRows rows = RowsOf(joint, states, true, false);
    out->Add(rows, ReactionRows(joint));
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

void ForceSolver::FillRows(const BodyStates& states, const ClosureSolver* closure) {
  if (closure != nullptr) {
    rows_.Take(closure->rows(), closure->transmitting());
  } else {
    rows_.Clear();
    AddReactionRows(mechanism_, states, &rows_);
  }
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

// The moments of drives and the motions that they command have the same rows.
bool ForceSolver::Share(ClosureSolver* closure) {
  used_ = &system_;
  if (closure == nullptr || !closure->selection_is_of_forces()) return false;
  rows_.Take(closure->rows(), closure->selection());
  first_driven_ = static_cast<int>(closure->transmitting().size());
  basis_.resize(closure->selection().size());
  std::iota(basis_.begin(), basis_.end(), 0);
  rest_.clear();
  self_stress_.resize(rows_.size(), 0);
  sparse_ = chosen_ = false;
  used_ = &closure->system();
  return true;
}

RunSummary ForceSolver::SelectBasis() {
  used_ = &system_;
  std::vector<int> all(static_cast<size_t>(rows_.size()));
  std::iota(all.begin(), all.end(), 0);
  basis_ = system_.IndependentRows(rows_, all);
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

// All motions of a mechanism begin with the same basis; where it is none, the pose chooses.
void ForceSolver::SelectAtHome() {
  BodyStates home;
  home.Resize(mechanism_.bodies.size());
  home.X_WB = mechanism_.X_WB_home;
  FillRows(home, nullptr);
  (void)SelectBasis();
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
  return least_.Factor(columns_, 0.0) &&
         !SelfStressReaches(RandomSelfStress(least_, columns_), first_driven_);
}

// Each force outside the basis with the basis forces that balance it.
void ForceSolver::FindSelfStress() {
  self_stress_.resize(rows_.size(), static_cast<Eigen::Index>(rest_.size()));
  for (size_t k = 0; k < rest_.size(); ++k) {
    const int i = rest_[k];
    missing_.setZero(system_.size());
    for (int p = rows_.start[i]; p < rows_.start[i + 1]; ++p) {
      missing_.segment<6>(6 * (rows_.body[p] - 1)) =
          system_.RowScale(rows_.angular[i]) * rows_.J[p];
    }
    system_.Solve(missing_, &part_);
    self_stress_.col(k).setZero();
    for (int b = 0; b < system_.size(); ++b) {
      self_stress_(basis_[b], k) = -part_[b] / system_.RowScale(rows_.angular[basis_[b]]);
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
  summary.names_where = true;
  summary.amount = sigma;
  summary.unit = std::string("1");
  summary.message =
      fmt::format("the drives lose control of {}{} (smallest singular value {:.1e})", summary.where,
                  crossed ? " between the last sample and this one" : "", sigma);
  return summary;
}

double ForceSolver::Largest(const VecX& wrenches) const {
  if (system_.size() == 0) return 0.0;
  return system_.body_scale().cwiseProduct(wrenches).cwiseAbs().maxCoeff();
}

double ForceSolver::Missing(const VecX& wrenches) {
  have_.assign(mechanism_.bodies.size(), Vec6::Zero());
  rows_.AddWrenches(force_, &have_);
  Stack(have_, &missing_);
  missing_ = wrenches - missing_;
  return Largest(missing_);
}

double ForceSolver::LeastNorm(const VecX& wrenches) {
  scale_.resize(rows_.size());
  for (int i = 0; i < rows_.size(); ++i) scale_[i] = system_.RowScale(rows_.angular[i]);
  if (sparse_) {
    force_ = scale_.cwiseProduct(least_.LeastNorm(system_.body_scale().cwiseProduct(wrenches)));
    return Missing(wrenches);
  }
  double left = kNan;
  force_.setZero(rows_.size());
  missing_ = wrenches;
  // Iterative refinement, which also brings factors of a pose nearby to this one.
  const double round_off = 2 * kEps * Largest(wrenches);
  for (int pass = 0; pass < kMostRefinements; ++pass) {
    used_->Solve(missing_, &part_);
    for (int b = 0; b < system_.size(); ++b) force_[basis_[b]] += part_[b];
    const double now = Missing(wrenches);
    const double before = std::exchange(left, now);
    if (pass > 0 && !(now > round_off && now < kPassHelps * before)) break;
  }
  if (rest_.empty()) return left;
  scaled_ = force_.cwiseQuotient(scale_);
  least_forces_.Take(self_stress_, first_driven_, &scaled_);
  force_ = scale_.cwiseProduct(scaled_);
  return Missing(wrenches);
}

RunSummary ForceSolver::Solve(const std::vector<LoadSample>& loads, ReferenceSample* sample,
                              ClosureSolver* closure) {
  const bool shared = Share(closure);
  if (!shared) {
    if (!chosen_) SelectAtHome();
    FillRows(sample->states, closure);
  }
  FrictionDirections(mechanism_, sample->states, duration_s_, &sample->friction_signs);
  RequiredWrenches(mechanism_, sample->states, loads, sample->friction_signs, &required_);
  Stack(required_, &wrenches_);
  if (!wrenches_.allFinite()) {
    RunSummary summary = CheckForcesAt(mechanism_, sample->states, kNan, loads);
    if (!summary.ok()) return summary;
  }
  if (RunSummary summary = CheckSpinsIdle(spins_, sample->states, required_, length_);
      !summary.ok()) {
    return summary;
  }
  const double largest = Largest(wrenches_);

  // A basis chosen earlier may have become bad; choose again once.
  RunSummary control = RunSummary::Done();
  for (int attempt = shared || chosen_ ? 0 : 1; attempt < 2; ++attempt) {
    const bool factored = shared && attempt == 0;  // and looked at: by the loop closure
    if (attempt == 1) {
      if (RunSummary summary = SelectBasis(); !summary.ok()) {
        return control.ok() ? summary : control;
      }
    }
    if (!factored && !Factor()) continue;
    if (!factored) control = CheckControl(sample->states);
    if (!control.ok()) {
      // Of redundant rows the basis may have become dependent, not the mechanism.
      if (attempt == 0 && !rest_.empty()) continue;
      return control;
    }
    if (!(LeastNorm(wrenches_) <= kBalanceTolerance * largest)) continue;
    if (RunSummary summary = AddLoadFriction(sample); !summary.ok()) return summary;
    Report(force_, sample);
    FindBands(sample);
    return RunSummary::Done();
  }
  RunSummary summary;
  summary.stop = Stop::kSingular;
  summary.message = "the drives do not control the mechanism at this pose";
  return summary;
}

int FillReactions(const Mechanism& mechanism, const BodyStates& states, const RowSet& rows,
                  const VecX& force, MatX* reactions) {
  const auto joints = static_cast<Eigen::Index>(mechanism.joints.size());
  const auto couplings = static_cast<Eigen::Index>(mechanism.couplings.size());
  reactions->setZero(joints + couplings, 6);
  int row = 0;
  for (Eigen::Index j = 0; j < joints; ++j) {
    const Joint& joint = mechanism.joints[j];
    // Wrench on the moving one of the two bodies about its origin in world axes …
    const bool on_child = joint.child != 0;
    const int body = on_child ? joint.child : joint.parent;
    Vec6 wrench = Vec6::Zero();
    for (const int end = row + ReactionRows(joint); row < end; ++row) {
      for (int p = rows.start[row]; p < rows.start[row + 1]; ++p) {
        if (rows.body[p] == body) wrench += force[row] * rows.J[p];
      }
    }
    if (!on_child) wrench = -wrench;
    // … moved to Mo and turned into F.
    Vec3 p_BoMo = states.X_WB[joint.child].linear() * joint.X_CM.translation();
    if (!on_child) p_BoMo -= states.X_WB[body].translation();
    const Mat3 R_FW = (states.X_WB[joint.parent].linear() * joint.X_PF.linear()).transpose();
    const Vec3 moment = wrench.head<3>() - p_BoMo.cross(wrench.tail<3>());
    reactions->row(j) << (R_FW * wrench.tail<3>()).transpose(), (R_FW * moment).transpose();
  }
  for (Eigen::Index c = 0; c < couplings; ++c) (*reactions)(joints + c, 0) = force[row++];
  return row;
}

void ForceSolver::Report(const VecX& force, ReferenceSample* sample) const {
  int row = FillReactions(mechanism_, sample->states, rows_, force, &sample->reactions);
  sample->drive_force = force.segment(row, mechanism_.drives.size());
  row += static_cast<int>(mechanism_.drives.size());
  sample->prescribed_force = force.segment(row, mechanism_.prescribed.size());
}

MatX ForceSolver::ReactionsOf(const VecX& force, const BodyStates& states) const {
  MatX reactions;
  (void)FillReactions(mechanism_, states, rows_, force, &reactions);
  return reactions;
}

// A load that a self-stress changes is not a load that friction could follow.
RunSummary ForceSolver::CheckLoadsUnique(const ReferenceSample& sample,
                                         const std::vector<size_t>& loaded) {
  if (sparse_) FindSelfStress();
  for (Eigen::Index k = 0; k < self_stress_.cols(); ++k) {
    VecX force = self_stress_.col(k);
    for (int i = 0; i < rows_.size(); ++i) force[i] *= system_.RowScale(rows_.angular[i]);
    const MatX reactions = ReactionsOf(force, sample.states);
    for (const size_t e : loaded) {
      const BearingLoad load = LoadOf(mechanism_, e, sample.states, reactions);
      if (SizeOf(load) > kOpens * force.cwiseAbs().maxCoeff()) return LoadShared(mechanism_, e);
    }
  }
  return RunSummary::Done();
}

// Eqs. 1 and 2 of friction by loads, element_forces.h.
RunSummary ForceSolver::AddLoadFriction(ReferenceSample* sample) {
  const std::vector<size_t> loaded = LoadedElements(mechanism_);
  sample->load_friction.resize(0);
  if (loaded.empty()) return RunSummary::Done();
  if (RunSummary summary = CheckLoadsUnique(*sample, loaded); !summary.ok()) return summary;
  const std::vector<ScalarRow> rows = ElementRows(mechanism_, sample->states);
  LoadSystem system;
  VecX force = force_;                                                // without friction by load
  MatX unit(force.size(), static_cast<Eigen::Index>(loaded.size()));  // forces per unit of each
  const MatX reactions = ReactionsOf(force, sample->states);
  for (size_t d = 0; d < loaded.size(); ++d) {
    const size_t e = loaded[d];
    LeastNorm(GradientOf(rows[e], mechanism_.bodies.size()));
    unit.col(static_cast<Eigen::Index>(d)) = -force_;
    system.Add(mechanism_, e, sample->states, sample->friction_signs[e],
               LoadOf(mechanism_, e, sample->states, reactions));
  }
  for (const size_t e : loaded) {
    std::vector<BearingLoad>& row = system.P.emplace_back();
    for (Eigen::Index d = 0; d < unit.cols(); ++d) {
      row.push_back(
          LoadOf(mechanism_, e, sample->states, ReactionsOf(unit.col(d), sample->states)));
    }
  }
  std::vector<BearingLoad> v;
  if (RunSummary summary = system.Solve(&v); !summary.ok()) return summary;
  sample->load_friction.setZero(static_cast<Eigen::Index>(mechanism_.elements.size()));
  sample->load_force = sample->load_friction;
  for (size_t d = 0; d < loaded.size(); ++d) {
    const auto e = static_cast<Eigen::Index>(loaded[d]);
    sample->load_friction[e] = system.Size(d, v[d]);
    sample->load_force[e] = system.Force(d, v[d]);
    force += sample->load_force[e] * unit.col(static_cast<Eigen::Index>(d));
  }
  force_ = force;
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
  sample->drive_band.setZero(drives);
  sample->prescribed_band.setZero(bases);
  for (const VecX& wrenches :
       RestingWrenches(mechanism_, sample->states, sample->friction_signs, sample->load_friction)) {
    LeastNorm(wrenches);
    VecX part = force_.segment(first_driven_, drives + bases).cwiseAbs();
    TakeRoundoff(&part);
    sample->drive_band += part.head(drives);
    sample->prescribed_band += part.tail(bases);
  }
}

// Newton–Euler at the body origins in world axes, and the energy balance from the same states.

namespace {

// A body's inertial quantities in world axes.
struct Inertial {
  Vec3 c;  ///< from Bo to the centre of mass
  Mat3 I;  ///< about the centre of mass
  Vec3 v_cm, a_cm;
  Vec3 w, e;  ///< angular velocity and acceleration
};

Inertial InertialOf(const Body& body, const Pose& X_WB, const Vec6& V, const Vec6& A) {
  Inertial x;
  const Mat3 R = X_WB.linear();
  x.c = R * body.p_BoBcm_B;
  x.I = R * body.I_Bcm_B * R.transpose();
  x.w = V.head<3>();
  x.e = A.head<3>();
  x.v_cm = V.tail<3>() + x.w.cross(x.c);
  x.a_cm = A.tail<3>() + x.e.cross(x.c) + x.w.cross(x.w.cross(x.c));
  return x;
}

// A load's force and moment about Q in world axes, and Q from Bo.
struct LoadInWorld {
  Vec3 force, moment, p_BoQ;
};

LoadInWorld InWorld(const Mechanism& mechanism, const BodyStates& states,
                    const LoadSample& sample) {
  const LoadSample load = AtStates(mechanism, states, sample);
  const Mat3 R = states.X_WB[static_cast<size_t>(load.body)].linear();
  if (!load.in_body_axes) return {load.force, load.moment, R * load.p_BoQ_B};
  return {R * load.force, R * load.moment, R * load.p_BoQ_B};
}

// Of gravity compensation: add(body, [moment about Bo; force] in world axes). A drive that exerts
// its joint's part takes it away there, so that the drive's own force has to supply it:
//   f_b = −s_b m_b g at the centre of mass, s_b the share                                       (1)
//   Q = a · Σ_b (c_b − p) × f_b about the axis a through p, a · Σ_b f_b along it                (2)
// over the bodies b beyond the joint; −Q acts on the child along the coordinate, Q on the parent.
template <typename Add>
void Compensate(const Mechanism& mechanism, const BodyStates& states, const Add& add) {
  if (!HasGravityCompensation(mechanism)) return;
  const auto force = [&](const Body& body) {
    return Vec3(-body.gravity_compensation * body.mass * mechanism.gravity_W);  // (1)
  };
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Vec3 c = states.X_WB[b].linear() * mechanism.bodies[b].p_BoBcm_B;
    const Vec3 f = force(mechanism.bodies[b]);
    add(b, (Vec6() << c.cross(f), f).finished());
  }
  for (const Drive& drive : mechanism.drives) {
    if (!drive.compensates_gravity) continue;
    const int on = std::get<JointDrive>(drive.kind).joint;
    const Joint& joint = mechanism.joints[static_cast<size_t>(on)];
    const Pose X_WF = states.X_WB[static_cast<size_t>(joint.parent)] * joint.X_PF;
    const Vec3 a = X_WF.linear() * joint.axis, p = X_WF.translation();
    const bool turns = joint.kind == JointKind::kRevolute;
    double Q = 0.0;
    VisitBeyond(mechanism, on, joint.child, [&](int b) {
      const Body& body = mechanism.bodies[static_cast<size_t>(b)];
      const Vec3 c = states.X_WB[static_cast<size_t>(b)] * body.p_BoBcm_B, f = force(body);
      Q += a.dot(turns ? Vec3((c - p).cross(f)) : f);  // (2)
    });
    const ScalarRow row = JointCoordinateRow(joint, 0, states);
    add(static_cast<size_t>(row.parent), Vec6(-Q * row.J_parent));
    add(static_cast<size_t>(row.child), Vec6(-Q * row.J_child));
  }
}

}  // namespace

ScalarRow LengthRow(const SpringDamper& spring, const Mechanism& mechanism,
                    const BodyStates& states) {
  Drive leg;
  leg.kind = DistanceDrive{spring.body_from, spring.p_from, spring.body_to, spring.p_to};
  return DriveRow(mechanism, leg, states);
}

void RequiredWrenches(const Mechanism& mechanism, const BodyStates& states,
                      const std::vector<LoadSample>& loads, const std::vector<int>& friction_signs,
                      std::vector<Vec6>* wrench_W) {
  wrench_W->assign(mechanism.bodies.size(), Vec6::Zero());
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const Inertial x = InertialOf(body, states.X_WB[b], states.V_WB[b], states.A_WB[b]);
    const Vec3 force = body.mass * (x.a_cm - mechanism.gravity_W);
    const Vec3 moment_cm = x.I * x.e + x.w.cross(x.I * x.w);
    (*wrench_W)[b] << moment_cm + x.c.cross(force), force;
    (*wrench_W)[b] *= states.Carried(b);
  }
  for (const LoadSample& load : loads) {
    const LoadInWorld f = InWorld(mechanism, states, load);
    (*wrench_W)[load.body].head<3>() -= f.moment + f.p_BoQ.cross(f.force);
    (*wrench_W)[load.body].tail<3>() -= f.force;
  }
  Compensate(mechanism, states, [&](size_t b, const Vec6& wrench) { (*wrench_W)[b] -= wrench; });
  for (const SpringDamper& spring : mechanism.springs) {
    const ScalarRow row = LengthRow(spring, mechanism, states);
    const double thrust = -spring.stiffness * (row.value - spring.free_length_m) -
                          spring.damping * RateOf(row, states.V_WB);
    (*wrench_W)[row.parent] -= thrust * row.J_parent;
    (*wrench_W)[row.child] -= thrust * row.J_child;
  }
  TakeElementForces(mechanism, states, friction_signs, wrench_W);
}

MatX Momenta(const Mechanism& mechanism, const BodyStates& states, const MatX& R) {
  MatX MR(R.rows(), R.cols());
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const Mat3 R_WB = states.X_WB[b].linear();
    const Mat6 M =
        SpatialInertia(body.mass, R_WB * body.p_BoBcm_B, R_WB * body.I_Bcm_B * R_WB.transpose());
    const auto at = 6 * (static_cast<Eigen::Index>(b) - 1);
    MR.middleRows<6>(at) = states.Carried(b) * M * R.middleRows<6>(at);
  }
  ForRotorInertias(mechanism, states, [&](size_t b, size_t c, const Mat6& block) {
    const auto row = 6 * (static_cast<Eigen::Index>(b) - 1);
    const auto column = 6 * (static_cast<Eigen::Index>(c) - 1);
    MR.middleRows<6>(row) += block * R.middleRows<6>(column);
  });
  return MR;
}

Energies EnergyOf(const Mechanism& mechanism, const BodyStates& states) {
  Energies energy;
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const Inertial x = InertialOf(body, states.X_WB[b], states.V_WB[b], states.A_WB[b]);
    const Vec3 p_Wcm = states.X_WB[b].translation() + x.c;
    const double share = states.Carried(b);
    energy.kinetic += 0.5 * share * (body.mass * x.v_cm.squaredNorm() + x.w.dot(x.I * x.w));
    energy.gravity -= share * body.mass * mechanism.gravity_W.dot(p_Wcm);
  }
  for (const SpringDamper& spring : mechanism.springs) {
    const double stretch = LengthRow(spring, mechanism, states).value - spring.free_length_m;
    energy.springs += 0.5 * spring.stiffness * stretch * stretch;
  }
  AddElementEnergies(mechanism, states, &energy);
  return energy;
}

Powers PowersOf(const Mechanism& mechanism, const BodyStates& states,
                const std::vector<LoadSample>& loads, const std::vector<int>& friction_signs) {
  Powers power;
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const Inertial x = InertialOf(body, states.X_WB[b], states.V_WB[b], states.A_WB[b]);
    // d/dt ½ ω·Iω = ω·Iε, since ω·(ω × Iω) = 0.
    const double share = states.Carried(b);
    power.energy_rate +=
        share * (body.mass * x.v_cm.dot(x.a_cm - mechanism.gravity_W) + x.w.dot(x.I * x.e));
    power.gravity += share * body.mass * x.v_cm.dot(mechanism.gravity_W);
  }
  for (const LoadSample& load : loads) {
    const LoadInWorld f = InWorld(mechanism, states, load);
    const Vec3 w = states.V_WB[load.body].head<3>();
    power.loads +=
        f.force.dot(states.V_WB[load.body].tail<3>() + w.cross(f.p_BoQ)) + f.moment.dot(w);
  }
  Compensate(mechanism, states,
             [&](size_t b, const Vec6& wrench) { power.loads += wrench.dot(states.V_WB[b]); });
  for (const SpringDamper& spring : mechanism.springs) {
    const ScalarRow row = LengthRow(spring, mechanism, states);
    const double rate = RateOf(row, states.V_WB);
    power.dampers -= spring.damping * rate * rate;
    power.springs -= spring.stiffness * (row.value - spring.free_length_m) * rate;
  }
  AddElementPowers(mechanism, states, friction_signs, &power);
  power.energy_rate -= power.springs;
  return power;
}

void AuditSample(const Mechanism& mechanism, const std::vector<LoadSample>& loads,
                 ReferenceSample* sample) {
  sample->energy = EnergyOf(mechanism, sample->states);
  sample->power = PowersOf(mechanism, sample->states, loads, sample->friction_signs);
  const auto drives = static_cast<Eigen::Index>(mechanism.drives.size());
  const VecX& velocity = sample->driven.velocity;
  Powers& power = sample->power;
  power.dampers -= LoadFrictionLoss(mechanism, *sample);
  power.base = sample->prescribed_force.dot(velocity.tail(velocity.size() - drives));
  power.input =
      sample->drive_force.dot(velocity.head(drives)) + power.base + power.loads + power.dampers;
}

}  // namespace mbv::internal
