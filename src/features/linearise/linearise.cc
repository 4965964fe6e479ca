#include "features/linearise/linearise.h"

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <tuple>

#include "base/files.h"
#include "base/text.h"
#include "kinematics/command_rank.h"
#include "kinematics/constraints.h"
#include "math/ridders.h"
#include "mechanism/channels.h"
#include "mechanism/idle_spins.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

constexpr double kDualLimit = 1e-10, kDifferenceLimit = 1e-7;
// Derivatives lose as many digits as the squared distance from singular loops has.
constexpr double kRounding = 100.0 * kEps;
// Eigenvalues of matrices are known to this share of the largest.
constexpr double kNoEigenvalue = 1e-9;
constexpr double kExplained = 0.01;   // of an error, is left when a term explains it
constexpr double kShown = 0.05;       // of the characteristic length or of a radian, in pictures
constexpr int kMostSteps = 50;        // towards an equilibrium
constexpr double kBalanced = 1e-12;   // of the largest force
constexpr double kLeastShare = 1e-6;  // of weights: a scale where no force is
constexpr double kOfDistance = 0.2;   // of the smallest singular value
constexpr double kFirstStep = 0.01;   // of differences, in units of lengths and angles
constexpr double kAtHome = 1e-12;     // of prescribed joints, in their units
constexpr double kSamePose = 1e-6;    // of a motion's pose reached by other coordinates

}  // namespace

double DerivativeScales::Largest(const MatX& x, const VecX& rows, const VecX& columns) {
  return x.size() == 0 ? 0.0 : x.cwiseProduct(rows * columns.transpose()).cwiseAbs().maxCoeff();
}

DerivativeScales::DerivativeScales(const Mechanism& mechanism, VecX rows, VecX columns,
                                   const ForceSlopes& by)
    : rows_(std::move(rows)),
      columns_(std::move(columns)),
      a_(Largest(by.by_acceleration, rows_, columns_)) {
  double weight = 0.0;
  for (const Body& body : mechanism.bodies) weight += body.mass * mechanism.gravity_W.norm();
  const double v = Largest(by.by_velocity, rows_, columns_);
  q_ = std::max({Largest(by.by_position, rows_, columns_), a_ > 0.0 ? v * v / a_ : 0.0,
                 Largest(by.force, rows_, VecX::Ones(1)),
                 kLeastShare * std::max(weight * CharacteristicLength(mechanism), a_)});
  v_ = std::max(v, std::sqrt(q_ * a_));
}

double DerivativeScales::Error(const ForceSlopes& by, const ForceSlopes& other) const {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  double most = 0.0;
  for (const auto& [of, scale] :
       {std::pair(&ForceSlopes::by_position, q_), std::pair(&ForceSlopes::by_velocity, v_),
        std::pair(&ForceSlopes::by_acceleration, a_)}) {
    const MatX apart = other.*of - by.*of;
    const double off = apart.allFinite() ? Largest(apart, rows_, columns_) : kNone;
    if (off > 0.0) most = std::max(most, scale > 0.0 ? off / scale : kNone);
  }
  return most;
}

void DerivativeScales::Raise(const DerivativeScales& other) {
  q_ = std::max(q_, other.q_), v_ = std::max(v_, other.v_), a_ = std::max(a_, other.a_);
}

std::vector<std::string> JudgedForces::NotUnique(const Mechanism& mechanism) const {
  std::vector<std::string> names;
  for (size_t i = 0; i < by.unique.size(); ++i) {
    if (by.unique[i]) continue;
    names.push_back(
        ChannelName(Quantity::kReaction, mechanism.joints[i / 6].name, static_cast<int>(i % 6)));
  }
  return names;
}

double EveryForceError(const Mechanism& mechanism, const VecX& columns, const EveryForce& by,
                       const ForceSlopes& acting, const ForceSlopes& reactions) {
  // Forces in lengths, so that they weigh as moments do.
  const double length = CharacteristicLength(mechanism);
  VecX rows = columns;
  if (by.of_drives) {
    rows.setOnes(by.acting.force.size());
    const auto drives = static_cast<Eigen::Index>(mechanism.drives.size());
    for (Eigen::Index i = 0; i < rows.size(); ++i) {
      const auto kind = i < drives ? Coordinate::Kind::kDrive : Coordinate::Kind::kPrescribed;
      const Eigen::Index index = i < drives ? i : i - drives;
      if (IsLength(mechanism, {kind, static_cast<int>(index), 0})) rows[i] = length;
    }
  }
  VecX counted = VecX::Zero(by.reactions.force.size());
  for (Eigen::Index i = 0; i < counted.size(); ++i) {
    if (by.unique[static_cast<size_t>(i)]) counted[i] = i % 6 < 3 ? length : 1.0;
  }
  // Reactions are no smaller than what acts.
  const DerivativeScales of_acting(mechanism, rows, columns, by.acting);
  DerivativeScales of_reactions(mechanism, counted, columns, by.reactions);
  of_reactions.Raise(of_acting);
  return std::max(of_acting.Error(by.acting, acting), of_reactions.Error(by.reactions, reactions));
}

std::string JudgeEveryForce(const Mechanism& mechanism, const Motion& motion, const VecX& columns,
                            const CommandSample& command, const MatX& T, ReducedModel* model,
                            JudgedForces* out) {
  if (RunSummary summary = model->AllDerivatives(T, command.loads, &out->by); !summary.ok()) {
    return summary.message;
  }
  ExactDerivatives dual;
  dual.of_drives = out->by.of_drives;
  const std::string trouble =
      DifferentiateExactly(mechanism, motion, model->states(), command, &dual);
  if (!trouble.empty()) return trouble;
  const Eigen::Index n = columns.size();
  for (ForceSlopes* of : {static_cast<ForceSlopes*>(&dual), &dual.reactions}) {
    for (MatX* by : {&of->by_position, &of->by_velocity, &of->by_acceleration}) {
      *by = by->topLeftCorner(of == &dual.reactions ? by->rows() : out->by.acting.force.size(), n)
                .eval();
    }
  }
  out->dual_error = EveryForceError(mechanism, columns, out->by, dual, dual.reactions);
  out->dual_limit = DualLimit(std::min(model->sample().control, out->by.control));
  return "";
}

double DualLimit(double control) {
  const double open = kRounding / (control * control);
  return kDualLimit + (std::isfinite(open) ? open : 0.0);
}

namespace {

class Lineariser {
 public:
  Lineariser(const Mechanism& mechanism, const LinearSettings& settings)
      : mechanism_(mechanism), settings_(settings) {}

  Linearisation Run() {
    if (Choose() && Place() && Differentiate()) {
      Compare();
      Assemble();
      FindModes();
      Check();
      AskProgram();
      AskEngine();
    }
    return std::move(out_);
  }

 private:
  bool Refuse(const std::string& message, const std::string& hint) {
    out_.diagnostics.AddError(mechanism_.file, message, hint);
    return false;
  }
  bool Refuse(const RunSummary& summary) { return Refuse(summary.message, ""); }

  bool Choose() {
    const auto chosen =
        ChooseNamedCoordinates(mechanism_, settings_.coordinates, {}, &out_.diagnostics);
    if (!chosen) return false;
    out_.coordinates = chosen->coordinates, out_.held = chosen->held;
    out_.check_limit = settings_.check_limit;
    std::vector<Coordinate> coordinates;
    for (const NamedCoordinate& at : out_.coordinates) coordinates.push_back(at.coordinate);
    model_.emplace(mechanism_, coordinates);
    n_ = static_cast<Eigen::Index>(coordinates.size());
    const double length = CharacteristicLength(mechanism_);
    unit_.resize(n_), q_ = model_->home(), v_ = VecX::Zero(n_);
    const std::vector<std::string> names = NamesOf(out_.coordinates);
    for (Eigen::Index k = 0; k < n_; ++k) {
      unit_[k] = IsLength(mechanism_, coordinates[static_cast<size_t>(k)]) ? length : 1.0;
    }
    for (const auto& [values, into] : {std::pair(&settings_.at, &q_), {&settings_.rates, &v_}}) {
      for (const auto& [name, value] : *values) {
        const auto at = std::ranges::find(names, name);
        if (at == names.end()) {
          return Refuse("'" + name + "' is not one of the coordinates: " + Joined(names, 8),
                        "choose it: --coordinates " + name + ",…");
        }
        (*into)[at - names.begin()] = value;
      }
    }
    out_.drives = NamesOf(mechanism_.drives);
    for (const NamedCoordinate& held : out_.held) {
      out_.notes.push_back("held at home: " + held.name);
    }
    return ReadForces();
  }

  bool ReadForces() {
    const auto drives = static_cast<Eigen::Index>(mechanism_.drives.size());
    forces_given_ = settings_.no_forces || !settings_.forces.empty() || drives == 0;
    out_.drive_force = VecX::Zero(drives);
    for (const auto& [name, value] : settings_.forces) {
      const int at = mechanism_.FindDrive(name);
      if (at < 0) {
        return Refuse("there is no drive '" + name + "'",
                      DidYouMean(name, out_.drives, "there are: " + Joined(out_.drives, 8)));
      }
      out_.drive_force[at] = value;
    }
    if (!settings_.servos) return true;
    std::vector<std::string> rigid;
    stiffness_.resize(drives);
    for (Eigen::Index d = 0; d < drives; ++d) {
      const Drive& drive = mechanism_.drives[static_cast<size_t>(d)];
      stiffness_[d] = drive.stiffness;
      if (!std::isfinite(drive.stiffness)) rigid.push_back(drive.name);
    }
    if (rigid.empty() && drives > 0) return true;
    return Refuse(drives == 0 ? "--servos: the model has no drives"
                              : "--servos: no stiffness is stated of " + Joined(rigid, 8),
                  "stiffness: of each drive in the model (N/m or N m/rad)");
  }

  // f = M a + h there, with T; false after a finding.
  bool MoveTo(const VecX& q, const VecX& v, const VecX& a, VecX* f) {
    RunSummary summary = model_->Move(q, v, a);
    if (summary.ok()) summary = model_->Motions(&T_);
    if (!summary.ok()) return Refuse(summary);
    summary = model_->ForcesOf(T_, command_.loads, f);
    return summary.ok() || Refuse(summary);
  }

  [[nodiscard]] VecX Size(const VecX& f) const { return f.cwiseProduct(unit_); }

  bool Place() {
    VecX f;
    const VecX none = VecX::Zero(n_);
    model_->Explain(false);
    VecX asked = none;  // accelerations that the drives hold
    if (settings_.motion != nullptr && !Follow(&asked)) return false;
    if (!MoveTo(q_, v_, asked, &f)) return false;
    if (settings_.equilibrium && !Settle(&f)) return false;
    MatX rates = model_->DriveRates(T_);
    if (!forces_given_) {
      // The forces of least norm that balance f best, in units of their own.
      const MatX scaled = unit_.asDiagonal() * rates.transpose();
      out_.drive_force =
          scaled.completeOrthogonalDecomposition().solve(VecX(unit_.asDiagonal() * f));
    }
    const VecX rest = rates.transpose() * out_.drive_force - f;
    ForceDerivatives slopes;
    if (RunSummary summary = model_->Derivatives(T_, command_.loads, &slopes); !summary.ok()) {
      return Refuse(summary);
    }
    // Where all forces vanish: beside what a radian, or a characteristic length, makes of them.
    const double largest =
        std::max({Size(f).cwiseAbs().maxCoeff(),
                  Size(rates.transpose() * out_.drive_force).cwiseAbs().maxCoeff(),
                  Largest(StiffnessOf(slopes))});
    out_.imbalance = largest > 0.0 ? Size(rest).cwiseAbs().maxCoeff() / largest : 0.0;
    VecX a = asked;
    if (out_.imbalance > kBalanced) {
      if (!Accelerate(rest, slopes, &a)) return false;
      out_.notes.push_back(fmt::format(
          "the state is no equilibrium: what the drives leave of the forces accelerates it ({:.2g} "
          "of the largest); --equilibrium searches one near it",
          out_.imbalance));
    }
    out_.q = q_, out_.v = v_, out_.a = a;
    return MoveTo(q_, v_, a, &f);
  }

  // Newton's method on f(q, v, a) = J_dᵀ τ from there, one step but for friction by load.
  bool Accelerate(VecX rest, ForceDerivatives slopes, VecX* a) {
    double last = std::numeric_limits<double>::infinity();
    for (int k = 0; k < kMostSteps; ++k) {
      MotionDerivatives motion;
      if (!MakeMotionDerivatives(slopes, out_.drive_force, &motion)) {
        return Refuse("a motion of the coordinates moves no mass", "other --coordinates");
      }
      const MatX& M = slopes.by_acceleration;
      *a += M.partialPivLu().solve(rest);
      if (model_->friction_by_load() == nullptr) return true;
      VecX f;
      if (!MoveTo(q_, v_, *a, &f)) return false;
      rest = model_->DriveRates(T_).transpose() * out_.drive_force - f;
      const double now = Size(rest).norm();
      if (now == 0.0 || !(now < 0.5 * last)) return true;
      last = now;
      if (RunSummary summary = model_->Derivatives(T_, command_.loads, &slopes); !summary.ok()) {
        return Refuse(summary);
      }
    }
    return Refuse("accelerations under friction by load are not found", "other forces");
  }

  // To the motion's instant, sample by sample: the loops keep their assembly.
  bool Follow(VecX* a) {
    const Motion& motion = *settings_.motion;
    if (motion.free()) {
      return Refuse("a free motion has no state before it is integrated", "--at and --rate");
    }
    if (!(settings_.time_s >= 0.0 && settings_.time_s <= motion.duration_s)) {
      return Refuse(fmt::format("--time {:g} is outside the motion, 0 … {:g} s", settings_.time_s,
                                motion.duration_s),
                    "");
    }
    if (settings_.equilibrium) return Refuse("--equilibrium: the scenario gives the state", "");
    if (!motion.switches.empty()) return Refuse("derivatives do not know switched elements", "");
    ReducedModel along(mechanism_, motion.commands);
    along.Explain(false);
    std::vector<double> times = SampleTimes(motion.duration_s, motion.sample_s);
    std::erase_if(times, [&](double t) { return t >= settings_.time_s; });
    times.push_back(settings_.time_s);
    VecX near = q_;
    for (const double t : times) {
      EvaluateMotion(motion, t, &command_);
      RunSummary summary = along.Move(command_.position, command_.velocity, command_.acceleration);
      if (!summary.ok()) return Refuse(summary);
      const BodyStates& states = along.states();
      for (const NamedCoordinate& held : out_.held) {
        const ScalarRow row = CoordinateRow(mechanism_, held.coordinate, states, 0.0);
        const double home = HomeValue(mechanism_, held.coordinate);
        if (std::abs(row.value - home) + std::abs(RateOf(row, states.V_WB)) > kAtHome) {
          return Refuse("prescribed joint '" + held.name + "' moves in this scenario",
                        "run SCENARIO --derivatives compares derivatives along such motions");
        }
      }
      for (Eigen::Index k = 0; k < n_; ++k) {
        const Coordinate& of = out_.coordinates[static_cast<size_t>(k)].coordinate;
        const ScalarRow row = CoordinateRow(mechanism_, of, states, near[k]);
        near[k] = q_[k] = row.value, v_[k] = RateOf(row, states.V_WB);
        (*a)[k] = RateOf(row, states.A_WB) + row.bias;
      }
      summary = model_->Move(q_, v_, *a);
      if (!summary.ok()) return Refuse(summary);
    }
    for (size_t b = 0; b < mechanism_.bodies.size(); ++b) {
      const Pose apart = along.states().X_WB[b].inverse() * model_->states().X_WB[b];
      if (!apart.isApprox(Pose::Identity(), kSamePose)) {
        return Refuse("these coordinates lead to another assembly than the motion",
                      "other --coordinates");
      }
    }
    command_.time_s = settings_.time_s;
    return true;
  }

  // Newton's method on J_dᵀ τ = f(q, 0, 0), steps halved until less is out of balance.
  bool Settle(VecX* f) {
    if (!v_.isZero(0.0)) return Refuse("--equilibrium: rates are stated", "an equilibrium rests");
    if (stiffness_.size() > 0) {
      return Refuse("--equilibrium: servos hold the state that is stated", "without --servos");
    }
    if (!forces_given_) return true;  // the drives hold whatever is asked
    // Of what is out of balance.
    const auto open = [&] {
      return VecX(model_->DriveRates(T_).transpose() * out_.drive_force - *f);
    };
    const VecX none = VecX::Zero(n_);
    VecX rest = open();
    double size = Size(rest).norm(), scale = std::max(size, Size(*f).norm());
    for (int k = 0; k < kMostSteps && size > kBalanced * scale; ++k) {
      ForceDerivatives slopes;
      if (RunSummary summary = model_->Derivatives(T_, command_.loads, &slopes); !summary.ok()) {
        return Refuse(summary);
      }
      const MatX scaled = unit_.asDiagonal() * StiffnessOf(slopes) * unit_.asDiagonal();
      const VecX step =
          unit_.asDiagonal() * scaled.colPivHouseholderQr().solve(VecX(unit_.asDiagonal() * rest));
      double share = 1.0;
      bool better = false;
      for (; share > 1e-6 && !better; share *= 0.5) {
        const VecX next = q_ + share * step;
        RunSummary summary = model_->Move(next, none, none);
        if (summary.ok()) summary = model_->Motions(&T_);
        if (!summary.ok()) {
          (void)MoveTo(q_, none, none, f);
          continue;
        }
        if (!model_->ForcesOf(T_, command_.loads, f).ok()) continue;
        const VecX left = open();
        if (!(Size(left).norm() < size)) continue;
        rest = left, size = Size(rest).norm(), q_ = next, better = true;
      }
      if (!better) break;
      scale = std::max(scale, Size(*f).norm());
    }
    if (size <= 1e-9 * scale) return MoveTo(q_, none, none, f);
    return Refuse(fmt::format("no equilibrium is found near this state: {:.2g} of the forces stay "
                              "out of balance",
                              size / scale),
                  "another --at, or forces of drives with --force");
  }

  // ∂f/∂q less what the drives' forces change.
  [[nodiscard]] MatX StiffnessOf(const ForceDerivatives& slopes) const {
    MatX K = mbv::StiffnessOf(slopes, out_.drive_force);
    if (stiffness_.size() > 0) {
      K += slopes.drive_rates.transpose() * stiffness_.asDiagonal() * slopes.drive_rates;
    }
    return K;
  }

  bool Differentiate() {
    out_.control = model_->sample().control;
    RunSummary summary = model_->Derivatives(T_, command_.loads, &out_.by_reference, true);
    if (!summary.ok()) return Refuse(summary);
    // Commands that hold the state, with the joints that are held.
    Motion motion;
    for (const auto* list : {&out_.coordinates, &out_.held}) {
      for (const NamedCoordinate& at : *list) {
        motion.commands.push_back({.name = at.name, .terms = {{at.coordinate, 1.0}}});
      }
    }
    const auto all = static_cast<Eigen::Index>(motion.commands.size());
    CommandSample& command = command_;
    for (const auto& [into, from] : {std::pair(&command.position, &out_.q),
                                     {&command.velocity, &out_.v},
                                     {&command.acceleration, &out_.a}}) {
      *into = VecX::Zero(all);
      into->head(n_) = *from;
    }
    for (Eigen::Index k = n_; k < all; ++k) {
      command.position[k] =
          HomeValue(mechanism_, out_.held[static_cast<size_t>(k - n_)].coordinate);
    }
    out_.no_every = JudgeEveryForce(mechanism_, motion, unit_, command, T_, &*model_, &out_.every);
    out_.not_unique = out_.every.NotUnique(mechanism_);
    if (model_->friction_by_load() == nullptr) {
      ExactDerivatives& dual = out_.by_dual_numbers;
      const std::string trouble =
          DifferentiateExactly(mechanism_, motion, model_->states(), command, &dual);
      if (!trouble.empty()) return Refuse("by dual numbers: " + trouble, "a state farther from it");
      for (MatX* matrix : {&dual.by_position, &dual.by_velocity, &dual.by_acceleration}) {
        *matrix = matrix->topLeftCorner(n_, n_).eval();
      }
    } else if (!out_.no_every.empty()) {
      return Refuse(out_.no_every, "");
    } else {
      out_.notes.emplace_back(
          "friction grows with loads: f = J_dᵀ τ, and dual numbers judge the drive forces τ");
    }
    TakeDifferences();
    return true;
  }

  void TakeDifferences() {
    VecX q = out_.q, v = out_.v, a = out_.a;
    const EveryForce& every = out_.every.by;
    const Eigen::Index acting = every.acting.force.size(), reactions = every.reactions.force.size();
    const double speed = std::max(1.0, v.cwiseQuotient(unit_).cwiseAbs().maxCoeff());
    const bool spins = !IdleSpins(mechanism_).empty();
    // Where loops are nearly singular forces change within that distance.
    const double control = std::fmin(out_.control, every.control);
    const double near = std::min(kFirstStep, kOfDistance * control);
    for (const auto& [of, matrix, step] :
         {std::tuple(&q, &ForceSlopes::by_position, near),
          std::tuple(&v, &ForceSlopes::by_velocity, 0.1 * speed),
          std::tuple(&a, &ForceSlopes::by_acceleration, speed * speed)}) {
      MatX slopes(n_ + acting + reactions, n_);
      for (Eigen::Index k = 0; k < n_; ++k) {
        const double at = (*of)[k];
        double most = step * unit_[k];
        if (of == &v) {
          (void)ForceAt(q, v, a);  // the state itself
          most = SlidingStep(k, most);
        }
        slopes.col(k) = SlopesAt(
            [&, of = of](double x) {
              // Turns of idle spins follow from the way.
              if (spins) (void)ForceAt(out_.q, out_.v, out_.a);
              (*of)[k] = x;
              return ForceAt(q, v, a);
            },
            at, most);
        (*of)[k] = at;
      }
      out_.by_differences.*matrix = slopes.topRows(n_);
      by_differences_[0].*matrix = slopes.middleRows(n_, acting);
      by_differences_[1].*matrix = slopes.bottomRows(reactions);
    }
    (void)ForceAt(q, v, a);
  }
  // At most `step` of a rate: what slides with dry friction keeps its direction.
  [[nodiscard]] double SlidingStep(Eigen::Index k, double step) const {
    constexpr double kShare = 0.3;
    const BodyStates& states = model_->states();
    std::vector<Vec6> along(states.X_WB.size(), Vec6::Zero());
    for (size_t b = 1; b < along.size(); ++b) {
      along[b] = T_.block<6, 1>(6 * (static_cast<Eigen::Index>(b) - 1), k);
    }
    for (size_t e = 0; e < mechanism_.elements.size(); ++e) {
      if (!HasFriction(mechanism_.elements[e])) continue;
      const ScalarRow row = ElementRow(mechanism_, e, states);
      const double share = std::abs(RateOf(row, along));
      if (share > 0.0) step = std::min(step, kShare * std::abs(RateOf(row, states.V_WB)) / share);
    }
    return step;
  }
  // f, then what acts and reactions; of those that are not unique nothing.
  VecX ForceAt(const VecX& q, const VecX& v, const VecX& a) {
    const EveryForce& known = out_.every.by;
    const Eigen::Index acting = known.acting.force.size(), reactions = known.reactions.force.size();
    VecX all = VecX::Constant(n_ + acting + reactions, kNan), f;
    MatX T;
    if (!model_->Move(q, v, a).ok() || !model_->Motions(&T).ok() ||
        !model_->ForcesOf(T, command_.loads, &f).ok()) {
      return all;
    }
    all.head(n_) = f;
    if (!out_.no_every.empty()) return all;
    EveryForce there;
    there.of_drives = known.of_drives;
    if (!model_->EachForce(T, command_.loads, &there).ok()) return all;
    all.segment(n_, acting) = there.acting.force;
    for (Eigen::Index i = 0; i < reactions; ++i) {
      const bool unique = known.unique[static_cast<size_t>(i)];
      all[n_ + acting + i] = unique ? there.reactions.force[i] : 0.0;
    }
    return all;
  }

  [[nodiscard]] double Largest(const MatX& x) const {
    return DerivativeScales::Largest(x, unit_, unit_);
  }

  void Compare() {
    const ForceDerivatives& by = out_.by_reference;
    const DerivativeScales scales(mechanism_, unit_, unit_, by);
    out_.difference_error = scales.Error(by, out_.by_differences);
    out_.dual_limit = DualLimit(out_.control);
    JudgedForces& every = out_.every;
    if (out_.no_every.empty()) {
      every.difference_limit = kDifferenceLimit - kDualLimit + every.dual_limit;
      every.difference_error =
          EveryForceError(mechanism_, unit_, every.by, by_differences_[0], by_differences_[1]);
    }
    if (model_->friction_by_load() == nullptr) {
      out_.dual_error = scales.Error(by, out_.by_dual_numbers);
    } else {
      out_.dual_error = every.dual_error, out_.dual_limit = every.dual_limit;
    }
    out_.difference_limit = kDifferenceLimit - kDualLimit + out_.dual_limit;
  }

  void Assemble() {
    const ForceDerivatives& by = out_.by_reference;
    symmetric_ = model_->friction_by_load() == nullptr;
    out_.mass = by.by_acceleration;
    if (symmetric_) out_.mass = (0.5 * (out_.mass + out_.mass.transpose())).eval();
    out_.K = StiffnessOf(by);
    out_.D = by.by_velocity;
    MotionDerivatives motion;
    regular_ = MakeMotionDerivatives(by, out_.drive_force, &motion);
    if (!regular_) {
      out_.notes.emplace_back("a motion of the coordinates moves no mass: there is no A, no mode");
      return;
    }
    out_.A = MatX::Zero(2 * n_, 2 * n_);
    out_.A.topRightCorner(n_, n_).setIdentity();
    out_.A.bottomLeftCorner(n_, n_) = motion.by_position;
    if (stiffness_.size() > 0) {
      out_.A.bottomLeftCorner(n_, n_) -=
          OverMass(by.drive_rates.transpose() * stiffness_.asDiagonal() * by.drive_rates);
    }
    out_.A.bottomRightCorner(n_, n_) = motion.by_velocity;
    out_.B = MatX::Zero(2 * n_, motion.by_force.cols());
    out_.B.bottomRows(n_) = motion.by_force;
  }

  [[nodiscard]] MatX OverMass(const MatX& of) const { return out_.mass.partialPivLu().solve(of); }

  // Of M that friction by load makes unsymmetric: eigenvalues of A, q in units.
  void FindModesOfA() {
    const Eigen::EigenSolver<MatX> eigen(InUnits("A", out_.A));
    for (Eigen::Index k = 0; k < 2 * n_; ++k) {
      const std::complex<double> root = eigen.eigenvalues()[k];
      if (root.imag() < 0.0) continue;
      AddMode(root, unit_.cast<std::complex<double>>().asDiagonal() *
                        eigen.eigenvectors().col(k).head(n_));
    }
  }

  void FindModes() {
    if (!regular_) return;
    if (symmetric_) {
      FindModesOfMass();
    } else {
      FindModesOfA();
    }
    std::ranges::stable_sort(out_.modes, {}, [](const VibrationMode& m) {
      return std::pair(m.frequency_hz, -m.eigenvalue.real());
    });
    for (VibrationMode& mode : out_.modes) Move(&mode);
  }

  // With M = L Lᵀ and y = Lᵀ δq; without damping −λ² are the eigenvalues of L⁻¹ K L⁻ᵀ.
  void FindModesOfMass() {
    const Eigen::LLT<MatX> mass(out_.mass);
    const auto turned = [&](const MatX& by) {
      const MatX left = mass.matrixL().solve(by);
      return MatX(mass.matrixL().solve(left.transpose()).transpose());
    };
    const MatX K = turned(out_.K), D = turned(out_.D);
    const double fast = std::sqrt(K.norm());
    if (D.norm() <= kNoEigenvalue * fast) {
      const Eigen::EigenSolver<MatX> eigen(K);
      for (Eigen::Index k = 0; k < n_; ++k) {
        const std::complex<double> square = -eigen.eigenvalues()[k];
        std::complex<double> root = std::sqrt(square);
        if (std::abs(square) <= kNoEigenvalue * K.norm()) root = 0.0;
        if (root.imag() < 0.0) root = -root;
        root = {root.real(), std::abs(root.imag())};
        AddMode(root, mass.matrixU().solve(eigen.eigenvectors().col(k).real()).eval() +
                          std::complex<double>(0.0, 1.0) *
                              mass.matrixU().solve(eigen.eigenvectors().col(k).imag()).eval());
      }
    } else {
      MatX A = MatX::Zero(2 * n_, 2 * n_);
      A.topRightCorner(n_, n_).setIdentity();
      A.bottomLeftCorner(n_, n_) = -K, A.bottomRightCorner(n_, n_) = -D;
      const Eigen::EigenSolver<MatX> eigen(A);
      for (Eigen::Index k = 0; k < 2 * n_; ++k) {
        const std::complex<double> root = eigen.eigenvalues()[k];
        if (root.imag() < 0.0) continue;
        const Eigen::VectorXcd y = eigen.eigenvectors().col(k).head(n_);
        AddMode(root, mass.matrixU().solve(y.real()).eval() +
                          std::complex<double>(0.0, 1.0) * mass.matrixU().solve(y.imag()).eval());
      }
    }
  }

  void AddMode(const std::complex<double>& root, const Eigen::VectorXcd& shape) {
    VibrationMode mode;
    mode.eigenvalue = root;
    Eigen::Index largest = 0;
    const Eigen::VectorXcd scaled = shape.cwiseQuotient(unit_.cast<std::complex<double>>());
    scaled.cwiseAbs().maxCoeff(&largest);
    mode.shape = shape / scaled[largest];
    const double fast = out_.modes.empty() ? 0.0 : std::abs(out_.modes.front().eigenvalue);
    const double size = std::abs(root);
    mode.frequency_hz = root.imag() / (2.0 * std::numbers::pi);
    if (size <= kNoEigenvalue * fast || size == 0.0) {
      mode.kind = VibrationMode::Kind::kRigid;
      mode.frequency_hz = 0.0;
    } else if (root.real() > kNoEigenvalue * size) {
      mode.kind = VibrationMode::Kind::kGrows;
    } else if (root.imag() == 0.0) {
      mode.kind = VibrationMode::Kind::kDecays;
    }
    if (root.imag() > 0.0) mode.damping_ratio = -root.real() / size;
    out_.modes.push_back(std::move(mode));
  }

  // So far that it can be seen, as far as the loops let it.
  void Move(VibrationMode* mode) {
    const VecX none = VecX::Zero(n_);
    for (double share = kShown; share > 1e-3 * kShown; share *= 0.5) {
      mode->X_WB.clear();
      for (int i = 0; i < kModeFrames; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / kModeFrames;
        const VecX step = (mode->shape * std::polar(share, angle)).real();
        if (!model_->Move(out_.q + step, none, none).ok()) break;
        mode->X_WB.push_back(model_->states().X_WB);
      }
      (void)model_->Move(out_.q, none, none);
      if (mode->X_WB.size() == static_cast<size_t>(kModeFrames)) return;
    }
    mode->X_WB.clear();
  }

  // mjd_transitionFD at rest, where MuJoCo's coordinates vary as the loops let them.
  void AskEngine() {
    if (!settings_.mujoco || !regular_) return;
    MatX T;
    RunSummary moved = model_->Move(out_.q, VecX::Zero(n_), VecX::Zero(n_));
    if (moved.ok()) moved = model_->Motions(&T);
    std::string why_not = moved.ok() ? "" : moved.message;
    if (!v_.isZero(0.0)) why_not = "the state is in motion";
    if (stiffness_.size() > 0) why_not = "drives hold their place";
    if (!command_.loads.empty()) why_not = "loads act";
    if (out_.A.bottomLeftCorner(n_, n_).isZero(0.0)) why_not = "∂a/∂q vanishes";
    if (why_not.empty()) {
      out_.engines = AskMujoco(mechanism_, out_, model_->states(), T, unit_);
    } else {
      out_.engines.push_back(
          {.engine = "MuJoCo 2.2.2", .softness = "mjd_transitionFD", .why_not = why_not});
    }
    if (command_.loads.empty()) {
      out_.engines.push_back(AskCorrectedMujoco(mechanism_, out_, unit_, &*model_));
    }
  }

  // The user's matrices.
  void Check() {
    if (settings_.check.empty()) return;
    const auto refuse = [&](const std::string& message, const std::string& hint) {
      out_.diagnostics.AddError(settings_.check, message, hint);
    };
    const auto text = ReadWholeFile(settings_.check);
    if (!text) return refuse("cannot be read", "a JSON file");
    JudgeAll("yours", *text, refuse);
  }

  // Those of a program, which is not judged where it does not answer in order.
  void AskProgram() {
    if (settings_.program.empty()) return;
    std::string text;
    std::string& trouble = out_.program_trouble;
    trouble = DerivativesOfProgram(settings_.program, mechanism_, out_, model_->states(),
                                   command_.loads, &text);
    if (!trouble.empty()) return;
    const std::vector<DerivativeCheck> before = out_.checks;
    JudgeAll(settings_.program, text, [&](const std::string& message, const std::string&) {
      trouble += (trouble.empty() ? "" : "; ") + message;
    });
    if (!trouble.empty()) out_.checks = before;
  }

  template <typename Refuse>
  void JudgeAll(const std::string& who, const std::string& text, const Refuse& refuse) {
    const auto json = nlohmann::json::parse(text, nullptr, false, true);
    const char* expected =
        "{\"coordinates\": [names], \"f_q\": [[row], …]} with any of f_q, f_v, f_a (n × n), A (2n "
        "× 2n) and B (2n × drives)";
    if (!json.is_object()) return refuse("is no JSON object", expected);
    if (json.contains("coordinates")) {
      const std::vector<std::string> names = NamesOf(out_.coordinates);
      if (json["coordinates"] != nlohmann::json(names)) {
        return refuse("coordinates are other than these: " + Joined(names, 12),
                      "the same in this order, or --coordinates");
      }
    }
    const ForceDerivatives& by = out_.by_reference;
    const std::vector<std::pair<std::string, const MatX*>> known = {{"f_q", &by.by_position},
                                                                    {"f_v", &by.by_velocity},
                                                                    {"f_a", &by.by_acceleration},
                                                                    {"A", &out_.A},
                                                                    {"B", &out_.B}};
    size_t judged = 0, wrong = 0;
    for (const auto& [key, value] : json.items()) {
      if (key == "coordinates") continue;
      const auto of = std::ranges::find(known, key, &std::pair<std::string, const MatX*>::first);
      if (of == known.end()) {
        refuse("there is no matrix '" + key + "'", expected), ++wrong;
        continue;
      }
      MatX theirs;
      if (!ReadMatrix(value, of->second->rows(), of->second->cols(), &theirs)) {
        refuse(fmt::format("{}: {} rows of {} finite numbers are needed", key, of->second->rows(),
                           of->second->cols()),
               expected);
        ++wrong;
        continue;
      }
      Judge(who, key, theirs, *of->second);
      ++judged;
    }
    if (judged + wrong == 0) refuse("has none of the matrices", expected);
  }

  static bool ReadMatrix(const nlohmann::json& rows, Eigen::Index m, Eigen::Index n, MatX* out) {
    out->resize(m, n);
    if (!rows.is_array() || static_cast<Eigen::Index>(rows.size()) != m) return false;
    for (Eigen::Index i = 0; i < m; ++i) {
      const auto& row = rows[static_cast<size_t>(i)];
      if (!row.is_array() || static_cast<Eigen::Index>(row.size()) != n) return false;
      for (Eigen::Index k = 0; k < n; ++k) {
        const auto& entry = row[static_cast<size_t>(k)];
        if (!entry.is_number() || !std::isfinite(entry.get<double>())) return false;
        (*out)(i, k) = entry.get<double>();
      }
    }
    return true;
  }

  // Rows and columns in units of lengths and angles; of A's and B's rows accelerations.
  [[nodiscard]] MatX InUnits(const std::string& key, const MatX& x) const {
    if (key == "A" || key == "B") {
      VecX twice(2 * n_);
      twice << unit_, unit_;
      const MatX rows = twice.cwiseInverse().asDiagonal() * x;
      return key == "B" ? rows : MatX(rows * twice.asDiagonal());
    }
    return unit_.asDiagonal() * x * unit_.asDiagonal();
  }

  // What A lacks where ∂f lacks a term.
  [[nodiscard]] MatX TermOf(const std::string& key, const ForceDerivatives::Term& term) const {
    if (key == "f_q") return term.by_position;
    if (key == "f_v") return term.by_velocity;
    if (key != "A") return {};
    MatX of = MatX::Zero(2 * n_, 2 * n_);
    of.bottomLeftCorner(n_, n_) = -OverMass(term.by_position);
    of.bottomRightCorner(n_, n_) = -OverMass(term.by_velocity);
    return of;
  }

  void Judge(const std::string& who, const std::string& key, const MatX& theirs, const MatX& ours) {
    const MatX off = InUnits(key, theirs - ours);
    const double largest = InUnits(key, ours).cwiseAbs().maxCoeff();
    DerivativeCheck check{.of = who, .matrix = key, .error = 0.0, .explained = ""};
    const double most = off.size() == 0 ? 0.0 : off.cwiseAbs().maxCoeff();
    if (most > 0.0) check.error = largest > 0.0 ? most / largest : kInfinity;
    if (check.error > out_.check_limit) {
      for (const ForceDerivatives::Term& term : out_.by_reference.terms) {
        const MatX part = TermOf(key, term);
        if (part.size() == 0) continue;
        const MatX scaled = InUnits(key, part);
        for (const auto& [times, how] :
             {std::pair(1.0, "is left out: "), std::pair(2.0, "has the wrong sign: ")}) {
          if ((off + times * scaled).norm() > kExplained * off.norm()) continue;
          check.explained = std::string(how) + term.name;
        }
      }
    }
    out_.checks.push_back(std::move(check));
  }

  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  const Mechanism& mechanism_;
  const LinearSettings& settings_;
  Linearisation out_;
  std::optional<ReducedModel> model_;
  Eigen::Index n_ = 0;
  VecX unit_, q_, v_, stiffness_;
  MatX T_;
  bool forces_given_ = false, regular_ = false, symmetric_ = true;
  CommandSample command_;                      ///< of the state, with its loads
  std::array<ForceSlopes, 2> by_differences_;  ///< of what acts, of reactions
};

}  // namespace

bool Linearisation::agrees() const {
  return witnesses_agree() && std::ranges::all_of(checks, [&](const DerivativeCheck& check) {
           return check.error <= check_limit;
         });
}

Linearisation Linearise(const Mechanism& mechanism, const LinearSettings& settings) {
  return Lineariser(mechanism, settings).Run();
}

}  // namespace mbv
