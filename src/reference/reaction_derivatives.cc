// Derivatives of every force: (5) and (6) of derivatives.h.
#include <fmt/format.h>
#include <Eigen/LU>
#include <algorithm>
#include <numeric>

#include "kinematics/constraints.h"
#include "mechanism/reach.h"
#include "reference/closure_solver.h"
#include "reference/derivatives.h"
#include "reference/force_solver.h"

namespace mbv::internal {
namespace {

// A self-stress with a smaller share than this in a reaction does not act there.
constexpr double kStressShare = 1e-7;
// Of the largest force: a load that is none.
constexpr double kNoLoad = 1e-9;
constexpr int kControlSteps = 4;
constexpr double kStillGood = 0.5;  // of the smallest singular value

}  // namespace

RowSet ForceVariations::ForceRows(const ClosureSolver& closure, const RowSet& rows, const Twists* U,
                                  bool of_drives) const {
  std::vector<int> taken = closure.transmitting();
  if (!of_drives) {
    for (int i = closure.first_command(); i < rows.size(); ++i) taken.push_back(i);
  }
  RowSet all;
  all.Take(rows, taken);
  if (!of_drives) return all;
  const BodyStates& states = closure.states();
  for (const Drive& drive : mechanism_.drives) {
    all.Add(U == nullptr ? DriveRow(mechanism_, drive, states)
                         : VariedDriveRow(mechanism_, drive, states, *U),
            PositionUnit(mechanism_, drive) == "rad");
  }
  for (size_t p = 0; p < mechanism_.prescribed.size(); ++p) {
    const Joint& joint = mechanism_.joints[static_cast<size_t>(mechanism_.prescribed[p].joint)];
    const Coordinate at{Coordinate::Kind::kPrescribed, static_cast<int>(p), 0};
    all.Add(
        U == nullptr ? JointCoordinateRow(joint, 0, states) : VariedRow(mechanism_, at, states, *U),
        !IsLength(joint.kind, 0));
  }
  for (const Spin& spin : spins_) {
    all.Add(U == nullptr ? IdleRow(spin, states) : VariedIdleRow(spin, states, *U), true);
  }
  return all;
}

RunSummary ForceVariations::FactorForces(const ClosureSolver& closure, EveryForce* out) {
  force_rows_ = ForceRows(closure, closure.rows(), nullptr, out->of_drives);
  first_acting_ = static_cast<int>(closure.transmitting().size());
  std::vector<int> all(static_cast<size_t>(force_rows_.size()));
  std::iota(all.begin(), all.end(), 0);
  // The basis of the state before serves while it is about as good.
  const bool same =
      basis_of_drives_ == out->of_drives && forces_.Factor(force_rows_, basis_, false);
  out->control = same ? Control() : 0.0;
  if (!(out->control > kStillGood * basis_control_)) {
    basis_of_drives_.reset();
    basis_ = forces_.IndependentRows(force_rows_, all);
    const bool enough = static_cast<int>(basis_.size()) == forces_.size();
    if (!enough || !forces_.Factor(force_rows_, basis_, true)) {
      return {.stop = Stop::kSingular,
              .message = "the drives do not control the mechanism at this pose"};
    }
    out->control = basis_control_ = Control();
    basis_of_drives_ = out->of_drives;
  }
  if (!(out->control > SingularValueLimit(0.0))) {
    return {.stop = Stop::kSingular,
            .message = "the drives lose control of the mechanism at this pose"};
  }
  // Each force outside the basis with those that balance it, moments by the characteristic length.
  std::vector<int> rest;
  std::ranges::set_difference(all, basis_, std::back_inserter(rest));
  self_stress_.setZero(force_rows_.size(), static_cast<Eigen::Index>(rest.size()));
  for (size_t k = 0; k < rest.size(); ++k) {
    VecX one = VecX::Zero(force_rows_.size());
    one[rest[k]] = forces_.RowScale(force_rows_.angular[static_cast<size_t>(rest[k])] != 0);
    Twists wrenches(mechanism_.bodies.size(), Vec6::Zero());
    force_rows_.AddWrenches(one, &wrenches);
    one -= SolveForces(Stack(wrenches));
    const VecX size = InLengths(one).cwiseAbs();
    if (size.tail(size.size() - first_acting_).maxCoeff() > kStressShare * size.maxCoeff()) {
      return {.stop = Stop::kUnsupported,
              .message = "drives share their forces: statics leaves a choice"};
    }
    self_stress_.col(static_cast<Eigen::Index>(k)) = one / size.maxCoeff();
  }
  return RunSummary::Done();
}

double ForceVariations::Control() {
  return forces_.size() == 0 ? 1.0 : forces_.SmallestSingularValue(kControlSteps);
}

VecX ForceVariations::InLengths(const VecX& force) const {
  VecX scaled = force;
  for (Eigen::Index i = 0; i < force.size(); ++i) {
    scaled[i] /= forces_.RowScale(force_rows_.angular[static_cast<size_t>(i)] != 0);
  }
  return scaled;
}

VecX ForceVariations::SolveForces(const VecX& wrenches) {
  VecX force = VecX::Zero(force_rows_.size()), missing = wrenches;
  for (int pass = 0; pass < 2; ++pass) {
    forces_.Solve(missing, &step_);
    for (size_t b = 0; b < basis_.size(); ++b) {
      force[basis_[b]] += step_[static_cast<Eigen::Index>(b)];
    }
    if (pass > 0) break;
    Twists have(mechanism_.bodies.size(), Vec6::Zero());
    force_rows_.AddWrenches(force, &have);
    missing -= Stack(have);
  }
  return force;
}

void ForceVariations::FindUnique(const BodyStates& states, const std::vector<RowSet>& varied,
                                 std::vector<Loaded>* loaded, EveryForce* out) {
  out->unique.assign(6 * mechanism_.joints.size(), true);
  // Reactions of forces that balance, of which the largest is 1 N, or as many N m as there are m in
  // the characteristic length.
  const auto look = [&](const MatX& reactions) {
    for (Eigen::Index j = 0; j < reactions.rows(); ++j) {
      for (Eigen::Index c = 0; c < 6; ++c) {
        const double size = std::abs(reactions(j, c)) / (c < 3 ? 1.0 : length_);
        if (size > kStressShare) out->unique[static_cast<size_t>(6 * j + c)] = false;
      }
    }
    for (Loaded& at : *loaded) {
      const BearingLoad load = LoadOf(mechanism_, at.element, states, reactions);
      at.shared = at.shared || SizeOf(load) > kStressShare;
    }
  };
  for (Eigen::Index s = 0; s < self_stress_.cols(); ++s) {
    const VecX stress = self_stress_.col(s);
    look(ReactionsOf(states, stress));
    for (size_t k = 0; k < varied.size(); ++k) {
      Twists wrenches(mechanism_.bodies.size(), Vec6::Zero());
      varied[k].AddWrenches(stress, &wrenches);
      look(VaryReactions(states, varied[k], stress, unit_[k]) -
           ReactionsOf(states, SolveForces(Stack(wrenches))));
    }
  }
}

MatX ForceVariations::ReactionsOf(const BodyStates& states, const VecX& force) const {
  MatX reactions;
  (void)FillReactions(mechanism_, states, force_rows_, force, &reactions);
  return reactions.topRows(static_cast<Eigen::Index>(mechanism_.joints.size()));
}

// FillReactions() takes the wrench on the body that moves to Mo and into F's axes.
MatX ForceVariations::VaryReactions(const BodyStates& states, const RowSet& varied,
                                    const VecX& force, const Twists& U) const {
  const size_t joints = mechanism_.joints.size();
  MatX reactions = MatX::Zero(static_cast<Eigen::Index>(joints), 6);
  int row = 0;
  for (size_t j = 0; j < joints; ++j) {
    const Joint& joint = mechanism_.joints[j];
    const bool on_child = joint.child != 0;
    const int body = on_child ? joint.child : joint.parent;
    Vec6 wrench = Vec6::Zero(), dwrench = Vec6::Zero();
    for (const int end = row + ReactionRows(joint); row < end; ++row) {
      const auto add = [&](const RowSet& rows, Vec6* sum) {
        for (int p = rows.start[static_cast<size_t>(row)];
             p < rows.start[static_cast<size_t>(row) + 1]; ++p) {
          if (rows.body[static_cast<size_t>(p)] == body) {
            *sum += force[row] * rows.J[static_cast<size_t>(p)];
          }
        }
      };
      add(force_rows_, &wrench), add(varied, &dwrench);
    }
    if (!on_child) wrench = -wrench, dwrench = -dwrench;
    const Vec6 &U_P = U[static_cast<size_t>(joint.parent)],
               &U_C = U[static_cast<size_t>(joint.child)];
    Vec3 p = states.X_WB[static_cast<size_t>(joint.child)].linear() * joint.X_CM.translation();
    Vec3 dp = U_C.head<3>().cross(p);
    if (!on_child) {
      p -= states.X_WB[static_cast<size_t>(body)].translation();
      dp -= U_P.tail<3>();
    }
    const Mat3 R_FW =
        (states.X_WB[static_cast<size_t>(joint.parent)].linear() * joint.X_PF.linear()).transpose();
    const Vec3 f = wrench.tail<3>(), m = wrench.head<3>() - p.cross(f), turn = U_P.head<3>();
    const Vec3 df = dwrench.tail<3>();
    const Vec3 dm = dwrench.head<3>() - p.cross(df) - dp.cross(f);
    reactions.row(static_cast<Eigen::Index>(j)) << (R_FW * (df - turn.cross(f))).transpose(),
        (R_FW * (dm - turn.cross(m))).transpose();
  }
  return reactions;
}

std::vector<ForceVariations::Loaded> ForceVariations::LoadsOf(const BodyStates& states,
                                                              const std::vector<int>& signs,
                                                              const VecX& load_friction) {
  std::vector<Loaded> loaded;
  if (load_friction.size() == 0) return loaded;
  for (const size_t e : LoadedElements(mechanism_)) {
    Loaded& at = loaded.emplace_back();
    at.element = e;
    const double per_load = PerLoad(mechanism_, e, states);
    at.slope = signs[e] * per_load;
    at.load = load_friction[static_cast<Eigen::Index>(e)] / per_load;
    at.unit = SolveForces(GradientOf(ElementRow(mechanism_, e, states), mechanism_.bodies.size()));
  }
  return loaded;
}

RunSummary ForceVariations::DifferentiateAll(ClosureSolver* closure, const MatX& T,
                                             const std::vector<LoadSample>& loads,
                                             const std::vector<int>& friction_signs,
                                             const VecX& load_friction, bool slopes,
                                             EveryForce* out) {
  const BodyStates& states = closure->states();
  if (RunSummary summary = FactorForces(*closure, out); !summary.ok()) return summary;
  // (5)
  std::vector<Vec6> required;
  RequiredWrenches(mechanism_, states, loads, friction_signs, &required);
  std::vector<Loaded> loaded = LoadsOf(states, friction_signs, load_friction);
  for (const Loaded& at : loaded) {
    const ForceElement& element = mechanism_.elements[at.element];
    if (std::get<FrictionLaw>(element.law).skew == 0.0) continue;
    return {.stop = Stop::kUnsupported,
            .message = fmt::format("{} has efficiencies of its own either way: forces beside it "
                                   "are not computed by derivatives",
                                   Described(mechanism_, element))};
  }
  VecX x = SolveForces(Stack(required));
  for (const Loaded& at : loaded) x += at.slope * at.load * at.unit;
  const MatX reactions = ReactionsOf(states, x);
  const auto flat = [](const MatX& of) { return VecX(of.transpose().reshaped()); };
  const Eigen::Index acting =
      out->of_drives
          ? static_cast<Eigen::Index>(mechanism_.drives.size() + mechanism_.prescribed.size())
          : T.cols();
  out->reactions.force = flat(reactions), out->acting.force = x.segment(first_acting_, acting);
  if (!slopes) return RunSummary::Done();
  for (Loaded& at : loaded) {
    const ForceElement& element = mechanism_.elements[at.element];
    if (std::get<FrictionLaw>(element.law).coupling >= 0 ||
        (element.coordinate > 0 &&
         mechanism_.joints[static_cast<size_t>(element.joint)].kind == JointKind::kUniversal)) {
      return {.stop = Stop::kUnsupported,
              .message = fmt::format("{} follows a coupling's force or an axis that turns with the "
                                     "child: its derivatives are not computed",
                                     Described(mechanism_, element))};
    }
    const BearingLoad p = LoadOf(mechanism_, at.element, states, reactions);
    if (!(SizeOf(p) > kNoLoad * x.cwiseAbs().maxCoeff())) {
      return {.stop = Stop::kUnsupported,
              .message = fmt::format("{} bears no load: its friction has a kink there",
                                     Described(mechanism_, mechanism_.elements[at.element]))};
    }
    at.direction = SlopeOf(p);
  }

  // (6): with u_d the forces of a unit along each friction, δx = y + Σ_d s_d μ_d δn_d u_d.
  if (!Begin(closure, T)) {
    return {.stop = Stop::kSingular,
            .message = "the coordinates do not determine the motion at this pose"};
  }
  const auto many = static_cast<Eigen::Index>(loaded.size());
  const auto load_of = [&](size_t d, const MatX& of) {
    return loaded[d].direction.dot(LoadOf(mechanism_, loaded[d].element, states, of));
  };
  MatX N = MatX::Identity(many, many);
  for (size_t d = 0; d < loaded.size(); ++d) {
    const MatX of = loaded[d].slope * ReactionsOf(states, loaded[d].unit);
    for (size_t e = 0; e < loaded.size(); ++e) {
      N(static_cast<Eigen::Index>(e), static_cast<Eigen::Index>(d)) -= load_of(e, of);
    }
  }
  const Eigen::PartialPivLU<MatX> lu(many > 0 ? N : MatX::Identity(1, 1));
  const Eigen::Index n = T.cols();
  for (ForceSlopes* of : {&out->acting, &out->reactions}) {
    for (MatX* by : {&of->by_position, &of->by_velocity, &of->by_acceleration}) {
      by->resize(of->force.size(), n);
    }
  }
  // `moved`: what poses change of reactions; empty: nothing.
  const auto record = [&](VecX y, const MatX& moved, MatX ForceSlopes::*by, Eigen::Index k) {
    MatX of = ReactionsOf(states, y);
    if (moved.size() > 0) of += moved;
    if (many > 0) {
      VecX rates(many);
      for (size_t d = 0; d < loaded.size(); ++d)
        rates[static_cast<Eigen::Index>(d)] = load_of(d, of);
      rates = lu.solve(rates).eval();
      for (size_t d = 0; d < loaded.size(); ++d) {
        y += loaded[d].slope * rates[static_cast<Eigen::Index>(d)] * loaded[d].unit;
      }
      of = ReactionsOf(states, y);
      if (moved.size() > 0) of += moved;
    }
    (out->reactions.*by).col(k) = flat(of);
    (out->acting.*by).col(k) = y.segment(first_acting_, acting);
  };
  const Twists none(mechanism_.bodies.size(), Vec6::Zero());
  Twists dV = none, dA = none, back;
  VecX dw;
  std::vector<RowSet> varied;
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto at = static_cast<size_t>(k);
    const Twists& U = unit_[at];
    varied.push_back(ForceRows(*closure, varied_[at], &U, out->of_drives));
    MoveCoordinate(closure, at, &dV, &dA);
    VaryWrenches(states, loads, friction_signs, U, dV, dA, &dw);
    back = none;
    varied[at].AddWrenches(x, &back);
    dw -= Stack(back);
    for (const Loaded& on : loaded) {
      dw +=
          on.slope * on.load *
          GradientOf(VariedElementRow(mechanism_, on.element, states, U), mechanism_.bodies.size());
    }
    record(SolveForces(dw), VaryReactions(states, varied[at], x, U), &ForceSlopes::by_position, k);
    MoveRate(states, at, &dA);
    VaryWrenches(states, loads, friction_signs, none, U, dA, &dw);
    record(SolveForces(dw), {}, &ForceSlopes::by_velocity, k);
    VaryWrenches(states, loads, friction_signs, none, none, U, &dw);
    record(SolveForces(dw), {}, &ForceSlopes::by_acceleration, k);
  }
  FindUnique(states, varied, &loaded, out);
  for (const Loaded& at : loaded) {
    if (at.shared) return LoadShared(mechanism_, at.element);
  }
  return RunSummary::Done();
}

}  // namespace mbv::internal
