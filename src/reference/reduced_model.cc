#include "reference/reduced_model.h"

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <limits>
#include <optional>

#include "base/demand.h"
#include "kinematics/constraints.h"
#include "reference/closure_solver.h"
#include "reference/derivatives.h"
#include "reference/element_forces.h"
#include "reference/force_solver.h"
#include "reference/sample_recorder.h"
#include "reference/square_system.h"

namespace mbv {
namespace {

// Mass matrices of worse condition, scaled to a diagonal of 1, are singular within round-off.
constexpr double kLeastMass = 1e-14;

double HomeOf(const Mechanism& mechanism, const Command& command) {
  double home = 0.0;
  for (const Command::Term& term : command.terms) {
    home += term.factor * HomeValue(mechanism, term.coordinate);
  }
  return home;
}

std::vector<Command> CommandsOf(const std::vector<Coordinate>& coordinates) {
  std::vector<Command> commands;
  commands.reserve(coordinates.size());
  for (const Coordinate& coordinate : coordinates) {
    commands.push_back({.name = "", .terms = {{coordinate, 1.0}}});
  }
  return commands;
}

// All of them stay at home. A duration says what is at rest (RestRate()).
Motion MotionOf(const Mechanism& mechanism, std::vector<Command> commands) {
  Motion motion;
  for (Command& command : commands) command.profile = Constant(HomeOf(mechanism, command));
  motion.commands = std::move(commands);
  return motion;
}

}  // namespace

struct ReducedModel::Impl {
  Impl(const Mechanism& m, std::vector<Command> coordinates)
      : mechanism(m), motion(MotionOf(m, std::move(coordinates))) {
    Begin();
  }

  void Begin() {
    closure.emplace(mechanism, motion, options);
    forces.emplace(mechanism, motion.duration_s);
    recorder.emplace(mechanism);
  }

  const Mechanism& mechanism;
  const Motion motion;
  ReferenceOptions options;
  std::optional<internal::ClosureSolver> closure;
  std::optional<internal::ForceSolver> forces;
  std::optional<internal::SampleRecorder> recorder;
  CommandSample command;
  ReferenceSample sample;
  bool driven_known = true;  ///< in `sample`: not all callers ask
  std::optional<internal::ForceVariations> variations;
};

ReducedModel::ReducedModel(const Mechanism& mechanism, const std::vector<Coordinate>& coordinates)
    : ReducedModel(mechanism, CommandsOf(coordinates)) {}
ReducedModel::ReducedModel(const Mechanism& mechanism, std::vector<Command> coordinates)
    : impl_(std::make_unique<Impl>(mechanism, std::move(coordinates))) {}
ReducedModel::~ReducedModel() = default;
ReducedModel::ReducedModel(ReducedModel&&) noexcept = default;

Eigen::Index ReducedModel::size() const {
  return static_cast<Eigen::Index>(impl_->motion.commands.size());
}

VecX ReducedModel::home() const {
  VecX q(size());
  for (Eigen::Index k = 0; k < q.size(); ++k) {
    q[k] = HomeOf(impl_->mechanism, impl_->motion.commands[static_cast<size_t>(k)]);
  }
  return q;
}

void ReducedModel::Restart() { impl_->Begin(); }
void ReducedModel::Explain(bool on) { impl_->options.explain_unreached = on; }

RunSummary ReducedModel::Move(const VecX& q, const VecX& v, const VecX& a) {
  MBV_DEMAND(q.size() == size() && v.size() == size() && a.size() == size(), q.size());
  CommandSample& command = impl_->command;
  command.position = q;
  command.velocity = v;
  command.acceleration = a;
  RunSummary summary = impl_->closure->Solve(command);
  if (!summary.ok()) {
    Restart();
    summary.time_s = kNan;
    return summary;
  }
  impl_->sample.states = impl_->closure->states();
  impl_->sample.control = impl_->closure->control();
  impl_->recorder->RecordOutputs(&impl_->sample);
  impl_->driven_known = false;
  return summary;
}

const BodyStates& ReducedModel::states() const { return impl_->sample.states; }
const ReferenceSample& ReducedModel::sample() const {
  if (!impl_->driven_known) impl_->recorder->RecordDriven(&impl_->sample);
  impl_->driven_known = true;
  return impl_->sample;
}
const VecX& ReducedModel::drive_force() const { return impl_->sample.drive_force; }

RunSummary ReducedModel::Motions(MatX* T) {
  return impl_->closure->UnitMotions(static_cast<int>(size()), T);
}

// (2) with a = 0 gives Σ H_ij v_i v_j for unit rates, alone and in pairs.
RunSummary ReducedModel::Curvatures(MatX* H) {
  internal::ClosureSolver& closure = *impl_->closure;
  CommandSample command = impl_->command;
  const Eigen::Index n = size();
  command.acceleration.setZero();
  RunSummary summary = RunSummary::Done();
  const auto along = [&](Eigen::Index i, Eigen::Index j) {
    command.velocity = VecX::Unit(n, i);
    if (j != i) command.velocity[j] = 1.0;
    if (summary.ok()) summary = closure.SolveRates(command);
    return internal::Stack(closure.states().A_WB);
  };
  H->resize(6 * (static_cast<Eigen::Index>(impl_->mechanism.bodies.size()) - 1), n * n);
  for (Eigen::Index i = 0; i < n; ++i) H->col(i * n + i) = along(i, i);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      H->col(i * n + j) = 0.5 * (along(i, j) - H->col(i * n + i) - H->col(j * n + j));
      H->col(j * n + i) = H->col(i * n + j);
    }
  }
  const RunSummary back = closure.SolveRates(impl_->command);
  return summary.ok() ? back : summary;
}

MatX ReducedModel::MassMatrix(const MatX& T) const {
  const MatX M = T.transpose() * internal::Momenta(impl_->mechanism, states(), T);
  return 0.5 * (M + M.transpose());
}

const ForceElement* ReducedModel::friction_by_load() const {
  for (const ForceElement& element : impl_->mechanism.elements) {
    if (HasFriction(element) && std::get<FrictionLaw>(element.law).by_load()) {
      return &element;
    }
  }
  return nullptr;
}

VecX ReducedModel::Forces(const MatX& T, const std::vector<LoadSample>& loads) {
  std::vector<Vec6> required;
  std::vector<int> signs;
  internal::FrictionDirections(impl_->mechanism, states(), impl_->motion.duration_s, &signs);
  internal::RequiredWrenches(impl_->mechanism, states(), loads, signs, &required);
  return T.transpose() * internal::Stack(required);
}

RunSummary ReducedModel::CheckFriction(const std::vector<int>& signs, bool by_load) const {
  const Mechanism& mechanism = impl_->mechanism;
  const ForceElement* undetermined = by_load ? friction_by_load() : nullptr;
  const char* why = "has friction that grows with its load";
  for (size_t e = 0; e < mechanism.elements.size() && undetermined == nullptr; ++e) {
    if (!HasFriction(mechanism.elements[e]) || signs[e] != 0) continue;
    undetermined = &mechanism.elements[e];
    why = "rests with dry friction";
  }
  if (undetermined == nullptr) return RunSummary::Done();
  return {.stop = Stop::kUnsupported,
          .message = fmt::format("{} {}: a state alone does not determine accelerations",
                                 Described(mechanism, *undetermined), why),
          .where = mechanism.joints[static_cast<size_t>(undetermined->joint)].name};
}

RunSummary ReducedModel::Accelerations(const MatX& T, const std::vector<LoadSample>& loads,
                                       const VecX& drive_forces, VecX* a) {
  std::vector<int> signs;
  internal::FrictionDirections(impl_->mechanism, states(), impl_->motion.duration_s, &signs);
  RunSummary summary = CheckFriction(signs);
  if (!summary.ok()) return summary;
  // Coordinates in units of their own: lengths, angles, large and small masses.
  const MatX M = MassMatrix(T);
  const VecX scale =
      M.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
  const Eigen::LLT<MatX> mass(scale.asDiagonal() * M * scale.asDiagonal());
  if (mass.info() != Eigen::Success || !(mass.rcond() > kLeastMass)) {
    summary.stop = Stop::kSingular;
    summary.message = "a motion of the coordinates moves no mass";
    return summary;
  }
  const VecX rest = DriveRates(T).transpose() * drive_forces - Forces(T, loads);
  *a = scale.cwiseProduct(mass.solve(scale.cwiseProduct(rest)));
  return RunSummary::Done();
}

RunSummary ReducedModel::ForcesOf(const MatX& T, const std::vector<LoadSample>& loads, VecX* f) {
  if (friction_by_load() == nullptr) {
    *f = Forces(T, loads);
    return RunSummary::Done();
  }
  EveryForce every;
  every.of_drives = true;
  const RunSummary summary = EachForce(T, loads, &every);
  if (summary.ok()) *f = ActingRates(T).transpose() * every.acting.force;
  return summary;
}

RunSummary ReducedModel::Derivatives(const MatX& T, const std::vector<LoadSample>& loads,
                                     ForceDerivatives* out, bool terms) {
  std::vector<int> signs;
  internal::FrictionDirections(impl_->mechanism, states(), impl_->motion.duration_s, &signs);
  RunSummary summary = CheckFriction(signs, false);
  if (!summary.ok()) return summary;
  if (!impl_->variations) impl_->variations.emplace(impl_->mechanism);
  internal::ForceVariations& variations = *impl_->variations;
  summary = variations.Differentiate(&*impl_->closure, T, loads, signs, terms, out);
  if (!summary.ok() || friction_by_load() == nullptr) return summary;
  // f = J_dᵀ τ; rates of prescribed joints are constant.
  EveryForce every;
  every.of_drives = true;
  summary = EveryForceOf(T, loads, true, &every);
  if (!summary.ok()) return summary;
  const MatX rates = ActingRates(T);
  const MatX without_q = out->by_position, without_v = out->by_velocity;
  out->force = rates.transpose() * every.acting.force;
  out->by_position = rates.transpose() * every.acting.by_position;
  const Eigen::Index drives = out->drive_rates.rows();
  for (Eigen::Index k = 0; k < T.cols(); ++k) {
    out->by_position.col(k) += out->drive_rate_slopes[static_cast<size_t>(k)].transpose() *
                               every.acting.force.head(drives);
  }
  out->by_velocity = rates.transpose() * every.acting.by_velocity;
  out->by_acceleration = rates.transpose() * every.acting.by_acceleration;
  if (terms) {
    out->terms.push_back({"friction by the loads of joints", out->by_position - without_q,
                          out->by_velocity - without_v});
  }
  return summary;
}

MatX ReducedModel::ActingRates(const MatX& T) const {
  const Mechanism& mechanism = impl_->mechanism;
  const MatX of_drives = DriveRates(T);
  MatX rates(of_drives.rows() + static_cast<Eigen::Index>(mechanism.prescribed.size()), T.cols());
  rates.topRows(of_drives.rows()) = of_drives;
  for (size_t p = 0; p < mechanism.prescribed.size(); ++p) {
    const Joint& joint = mechanism.joints[static_cast<size_t>(mechanism.prescribed[p].joint)];
    const VecX gradient =
        internal::GradientOf(JointCoordinateRow(joint, 0, states()), mechanism.bodies.size());
    rates.row(of_drives.rows() + static_cast<Eigen::Index>(p)) = gradient.transpose() * T;
  }
  return rates;
}

RunSummary ReducedModel::EveryForceOf(const MatX& T, const std::vector<LoadSample>& loads,
                                      bool slopes, EveryForce* out) {
  std::vector<int> signs;
  internal::FrictionDirections(impl_->mechanism, states(), impl_->motion.duration_s, &signs);
  // By load it is what it is where drives exert the forces.
  const bool by_load = friction_by_load() != nullptr;
  RunSummary summary = CheckFriction(signs, by_load && !out->of_drives);
  if (summary.ok() && by_load) summary = AllForces(loads);
  if (!summary.ok()) return summary;
  if (!impl_->variations) impl_->variations.emplace(impl_->mechanism);
  const VecX load_friction = by_load ? sample().load_friction : VecX();
  return impl_->variations->DifferentiateAll(&*impl_->closure, T, loads, signs, load_friction,
                                             slopes, out);
}

RunSummary ReducedModel::AllDerivatives(const MatX& T, const std::vector<LoadSample>& loads,
                                        EveryForce* out) {
  out->of_drives = true;
  RunSummary summary = EveryForceOf(T, loads, true, out);
  if (summary.ok() || friction_by_load() != nullptr) return summary;
  if (summary.stop != Stop::kSingular && summary.stop != Stop::kUnsupported) return summary;
  out->of_drives = false;
  return EveryForceOf(T, loads, true, out);
}

RunSummary ReducedModel::EachForce(const MatX& T, const std::vector<LoadSample>& loads,
                                   EveryForce* out) {
  return EveryForceOf(T, loads, false, out);
}

MatX StiffnessOf(const ForceDerivatives& of, const VecX& drive_forces) {
  MatX K = of.by_position;
  for (Eigen::Index k = 0; k < K.cols(); ++k) {
    K.col(k) -= of.drive_rate_slopes[static_cast<size_t>(k)].transpose() * drive_forces;
  }
  return K;
}

bool MakeMotionDerivatives(const ForceDerivatives& of, const VecX& drive_forces,
                           MotionDerivatives* out) {
  // Friction by load makes it unsymmetric.
  const MatX& M = of.by_acceleration;
  const VecX scale =
      M.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
  const Eigen::PartialPivLU<MatX> mass(scale.asDiagonal() * M * scale.asDiagonal());
  if (!(mass.rcond() > kLeastMass)) return false;
  const auto divided = [&](const MatX& by) {
    return MatX(scale.asDiagonal() * mass.solve(scale.asDiagonal() * by));
  };
  out->by_position = divided(-StiffnessOf(of, drive_forces));
  out->by_velocity = divided(-of.by_velocity);
  out->by_force = divided(of.drive_rates.transpose());
  return true;
}

MatX ReducedModel::DriveRates(const MatX& T) const {
  const Mechanism& mechanism = impl_->mechanism;
  MatX rates(static_cast<Eigen::Index>(mechanism.drives.size()), T.cols());
  for (Eigen::Index d = 0; d < rates.rows(); ++d) {
    const ScalarRow row = DriveRow(mechanism, mechanism.drives[static_cast<size_t>(d)], states());
    rates.row(d) = internal::GradientOf(row, mechanism.bodies.size()).transpose() * T;
  }
  return rates;
}

RunSummary ReducedModel::AllForces(const std::vector<LoadSample>& loads) {
  return impl_->forces->Solve(loads, &impl_->sample, &*impl_->closure);
}

}  // namespace mbv
