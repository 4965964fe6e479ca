// Laws of positions, velocities and accelerations.
#include <cmath>

#include "kinematics/constraints.h"
#include "kinematics/mobility.h"
#include "tests/laws/fixture.h"

namespace mbv::laws {
namespace {

class Kinematics : public EveryMechanism {};

// Commands divided by their scales.
VecX ScaledCommands(const Subject& s, VecX commands) {
  for (size_t k = 0; k < s.motion.commands.size(); ++k) {
    commands[static_cast<Eigen::Index>(k)] /= s.ScaleOf(k);
  }
  return commands;
}

// Drives from the closed form, given to the generic solver as commands, lead back.
Residual InverseThenForward(const Subject& s, const State& state, double perturbation) {
  Residual r;
  r.budget = {.rounding = Rounding(state.condition), .closure = Closure(s, state.condition)};
  Answer inverse = ByClosedForm(s, state.command);
  r.trouble = TroubleOf("closed form", inverse.summary);
  if (!r.trouble.empty()) return r;
  if (perturbation > 0) {
    // A displacement of the drives that moves the commands by `perturbation`.
    const MatX J = DriveJacobian(s, state.command);
    VecX moved(J.cols());
    for (Eigen::Index k = 0; k < J.cols(); ++k) {
      moved[k] =
          s.IsHeld(static_cast<size_t>(k)) ? 0.0 : perturbation * s.ScaleOf(static_cast<size_t>(k));
    }
    inverse.driven.position += J * moved;
  }
  const Motion drives = s.DriveMotion();
  ReferenceSolver forward(s.mechanism, drives);
  ReferenceSample sample;
  for (const DrivenSample& step : WayTo(s, state.command)) {
    const RunSummary on_way = forward.Kinematics(DriveCommand(step, state.command), &sample);
    r.trouble = TroubleOf("on the way", on_way);
    if (!r.trouble.empty()) return r;
  }
  const RunSummary summary =
      forward.Kinematics(DriveCommand(inverse.driven, state.command), &sample);
  r.trouble = TroubleOf("forward", summary);
  if (!r.trouble.empty()) return r;
  const CommandSample back = CommandsAt(s, sample.states, state.command);
  const CommandSample& there = state.command;
  r.error = ScaledCommands(s, back.position - there.position).lpNorm<Eigen::Infinity>();
  // Rates carry their own size.
  r.error = std::max(r.error, RelativeError(ScaledCommands(s, back.velocity),
                                            ScaledCommands(s, there.velocity), 1));
  r.error = std::max(r.error, RelativeError(ScaledCommands(s, back.acceleration),
                                            ScaledCommands(s, there.acceleration), 1));
  return r;
}

TEST_P(Kinematics, ForwardUndoesInverse) {
  Check([&](const State& state, double perturbation) {
    return InverseThenForward(subject(), state, perturbation);
  });
}

// Motion of everything driven along q(t) = p + v t + a t²/2 of the commands.
DrivenSample Along(ClosedForm* form, const CommandSample& from, double t) {
  CommandSample c = from;
  c.position += t * from.velocity + 0.5 * t * t * from.acceleration;
  c.velocity += t * from.acceleration;
  DrivenSample driven;
  if (!form->Kinematics(c, &driven).ok()) driven.position.resize(0);
  return driven;
}

// Five-point difference, error h⁴/30 of the fifth derivative.
VecX Slope(const VecX& mm, const VecX& m, const VecX& p, const VecX& pp, double h) {
  return ((mm - pp) + 8.0 * (p - m)) / (12.0 * h);
}

// Rates of positions (order 1) or of velocities (order 2) against differences of them.
Residual RatesAreDerivatives(const Subject& s, const State& state, int order, double perturbation) {
  const double kStep = state.difference_step_s;
  const auto form = s.MakeClosedForm();
  const auto part = [&](const DrivenSample& d) { return order == 1 ? d.position : d.velocity; };
  std::vector<VecX> at;  // −4h, −2h, −h, h, 2h, 4h
  const DrivenSample here = Along(form.get(), state.command, 0.0);
  double size = 0.0;
  for (const int i : {-4, -2, -1, 1, 2, 4}) {
    const DrivenSample there = Along(form.get(), state.command, i * kStep);
    if (there.position.size() == 0) return {0.0, {}, "the motion leaves the workspace"};
    at.push_back(part(there));
    size = std::max(size, at.back().lpNorm<Eigen::Infinity>());
  }
  const VecX fine = Slope(at[1], at[2], at[3], at[4], kStep);
  const VecX coarse = Slope(at[0], at[1], at[4], at[5], 2 * kStep);
  const VecX truth = order == 1 ? here.velocity : here.acceleration;
  // At rest the rate is compared with a slow motion.
  const double scale = std::max(truth.lpNorm<Eigen::Infinity>(), 1e-3 * s.length_m);
  const VecX rate = truth + perturbation * scale * VecX::Ones(truth.size());
  Residual r;
  // The coarse difference is off sixteen times as much as the fine one.
  r.budget.truncation = (coarse - fine).lpNorm<Eigen::Infinity>() / scale;
  r.budget.rounding =
      64 * kEps * (1 + state.condition) * std::max(size, s.length_m) / (kStep * scale);
  r.error = (fine - rate).lpNorm<Eigen::Infinity>() / scale;
  return r;
}

TEST_P(Kinematics, VelocitiesAreDerivativesOfPositions) {
  Check([&](const State& state, double perturbation) {
    return RatesAreDerivatives(subject(), state, 1, perturbation);
  });
}

TEST_P(Kinematics, AccelerationsAreDerivativesOfVelocities) {
  Check([&](const State& state, double perturbation) {
    return RatesAreDerivatives(subject(), state, 2, perturbation);
  });
}

// Gap of all joints, closures included, at body poses that a witness reports [m or rad].
double LargestGap(const Mechanism& m, const BodyStates& states) {
  double gap = 0.0;
  for (const Joint& joint : m.joints) {
    const ConstraintRows rows = RowsOf(joint, states, false);
    if (rows.rows > 0) gap = std::max(gap, rows.residual.head(rows.rows).cwiseAbs().maxCoeff());
  }
  return gap;
}

Residual LoopsClose(const Subject& s, const State& state, bool simulated, double perturbation) {
  Residual r;
  // Positions up to the extent of the mechanism, composed along chains of up to ten bodies.
  r.budget = {.rounding = 1e3 * kEps, .closure = 1e-13 / s.length_m};
  Answer answer = ByReference(s, state.command);
  r.trouble = TroubleOf("reference", answer.summary);
  if (r.trouble.empty() && simulated) {
    answer = BySimulation(s, answer.driven, state.command);
    r.trouble = TroubleOf("simulation", answer.summary);
  }
  if (!r.trouble.empty()) return r;
  // Move the first output's body along all axes; whatever joint holds it opens.
  answer.states.X_WB[s.mechanism.outputs.front().body].translation() +=
      perturbation * s.length_m * Vec3(1, 1, 1);
  r.error = LargestGap(s.mechanism, answer.states) / s.length_m;
  return r;
}

TEST_P(Kinematics, LoopsCloseInTheReference) {
  Check([&](const State& state, double perturbation) {
    return LoopsClose(subject(), state, false, perturbation);
  });
}

TEST_P(Kinematics, LoopsCloseInTheSimulation) {
  Check([&](const State& state, double perturbation) {
    return LoopsClose(subject(), state, true, perturbation);
  });
}

INSTANTIATE_TEST_SUITE_P(Laws, Kinematics,
                         ::testing::Combine(::testing::ValuesIn(SubjectNames()),
                                            ::testing::Values(Regime::kFirstSample, Regime::kClose,
                                                              Regime::kRandom,
                                                              Regime::kNearSingular)),
                         RegimeName);

TEST(LawList, EveryClosedFormHasAModel) { EXPECT_EQ(ModelNames().size(), ClosedForms().size()); }

TEST(LawList, DrivesDetermineEveryMechanism) {
  for (const std::string& name : SubjectNames()) {
    const Mobility mobility = AnalyseMobility(SubjectOf(name).mechanism);
    EXPECT_EQ(mobility.undriven, 0) << name;
    EXPECT_TRUE(mobility.drives_not_unique.empty()) << name;
    EXPECT_TRUE(mobility.isostatic_rule_sound) << name;
  }
}

}  // namespace
}  // namespace mbv::laws
