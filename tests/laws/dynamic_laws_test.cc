// Laws of the drive forces.
#include <cmath>

#include "mechanism/motion.h"
#include "tests/laws/fixture.h"

namespace mbv::laws {
namespace {

enum class Witness { kClosedForm, kReference, kSimulation };
constexpr Witness kWitnesses[] = {Witness::kClosedForm, Witness::kReference, Witness::kSimulation};

const char* NameOf(Witness witness) {
  switch (witness) {
    case Witness::kClosedForm:
      return "closed form";
    case Witness::kReference:
      return "reference";
    case Witness::kSimulation:
      return "simulation";
  }
  return "?";
}

// One witness asked repeatedly near one state. The simulation follows the closed form's drives, as
// it does in a scenario.
class Asked {
 public:
  Asked(const Subject& subject, Witness witness)
      : subject_(subject), witness_(witness), solver_(subject.mechanism, subject.motion) {}

  // Drive forces; empty with `trouble` set when there is no answer.
  VecX Force(const CommandSample& command) {
    Answer answer;
    switch (witness_) {
      case Witness::kClosedForm:
        answer = ByClosedForm(subject_, command);
        break;
      case Witness::kReference:
        answer = Ask(&solver_, command);
        break;
      case Witness::kSimulation:
        answer = ByClosedForm(subject_, command);
        if (answer.summary.ok()) answer = BySimulation(subject_, answer.driven, command);
        break;
    }
    if (!answer.summary.ok()) {
      trouble = TroubleOf(NameOf(witness_), answer.summary);
      return VecX::Zero(static_cast<Eigen::Index>(subject_.mechanism.drives.size()));
    }
    return answer.force;
  }

  std::string trouble;

 private:
  const Subject& subject_;
  const Witness witness_;
  ReferenceSolver solver_;
};

Budget ForceBudget(const Subject& s, const State& state) {
  return {.rounding = Rounding(state.condition), .closure = Closure(s, state.condition)};
}

CommandSample Unloaded(CommandSample c) {
  for (LoadSample& load : c.loads) load.force = load.moment = Vec3::Zero();
  return c;
}

CommandSample AtRest(CommandSample c) {
  c.velocity.setZero();
  c.acceleration.setZero();
  return c;
}

class Forces : public EveryMechanism {
 protected:
  // Checks a law on all three witnesses; it gets them asked near the state.
  template <typename Law>
  void CheckWitnesses(const Law& law) const {
    for (const Witness witness : kWitnesses) {
      SCOPED_TRACE(NameOf(witness));
      Check([&](const State& state, double perturbation) {
        return law(witness, state, perturbation);
      });
    }
  }
};

TEST_P(Forces, OfAllWitnessesAgree) {
  for (const Witness witness : {Witness::kReference, Witness::kSimulation}) {
    SCOPED_TRACE(NameOf(witness));
    Check([&](const State& state, double perturbation) {
      // All masses and loads too large: every force is.
      const Subject heavier =
          perturbation > 0 ? subject().With(subject().Heavier(1 + perturbation)) : subject();
      CommandSample loaded = state.command;
      for (LoadSample& load : loaded.loads) {
        load.force *= 1 + perturbation;
        load.moment *= 1 + perturbation;
      }
      const Answer truth = ByClosedForm(subject(), state.command);
      Asked asked(heavier, witness);
      const VecX force = asked.Force(loaded);
      return Residual{.error = RelativeError(force, truth.force),
                      .budget = ForceBudget(subject(), state),
                      .trouble = TroubleOf("closed form", truth.summary) + asked.trouble};
    });
  }
}

TEST_P(Forces, AreTheSameWhenTimeRunsBackwards) {
  CheckWitnesses([&](Witness witness, const State& state, double perturbation) {
    Asked asked(subject(), witness);
    CommandSample back = state.command;
    const VecX ahead = asked.Force(state.command);
    back.velocity *= -1;
    VecX force = asked.Force(back);
    // Perturbed: a dry friction that turns with the velocity.
    force += perturbation * ahead.lpNorm<Eigen::Infinity>() * VecX::Ones(force.size());
    return Residual{.error = RelativeError(force, ahead),
                    .budget = ForceBudget(subject(), state),
                    .trouble = asked.trouble};
  });
}

TEST_P(Forces, AreAffineInTheAcceleration) {
  CheckWitnesses([&](Witness witness, const State& state, double perturbation) {
    Asked asked(subject(), witness);
    // Accelerations large enough to matter beside gravity, different per command.
    CommandSample none = state.command, one = state.command, two = state.command,
                  both = state.command;
    none.acceleration.setZero();
    for (Eigen::Index k = 0; k < one.acceleration.size(); ++k) {
      const bool held = subject().IsHeld(static_cast<size_t>(k));
      const double scale = held ? 0.0 : subject().ScaleOf(static_cast<size_t>(k));
      one.acceleration[k] = scale * std::sin(1.0 + static_cast<double>(k));
      two.acceleration[k] = scale * std::cos(2.0 + static_cast<double>(k));
    }
    both.acceleration = one.acceleration + two.acceleration;
    const VecX at_none = asked.Force(none), at_one = asked.Force(one), at_two = asked.Force(two);
    const VecX sum = at_one + at_two - at_none;
    const double size =
        (at_one - at_none).lpNorm<Eigen::Infinity>() + (at_two - at_none).lpNorm<Eigen::Infinity>();
    // Perturbed: the first acceleration too large in the sum.
    both.acceleration +=
        perturbation * size / (at_one - at_none).lpNorm<Eigen::Infinity>() * one.acceleration;
    const VecX at_both = asked.Force(both);
    Residual r{.error = (at_both - sum).lpNorm<Eigen::Infinity>() / size,
               .budget = ForceBudget(subject(), state),
               .trouble = asked.trouble};
    // Differences of forces that are larger than what is looked at.
    const double largest = std::max(at_none.lpNorm<Eigen::Infinity>(), size);
    r.budget.rounding *= largest / size;
    r.budget.closure *= largest / size;
    return r;
  });
}

TEST_P(Forces, OfMotionGravityAndLoadsAddUp) {
  const Subject floating = subject().With({{"g", 0.0}});
  CheckWitnesses([&](Witness witness, const State& state, double perturbation) {
    Asked asked(subject(), witness), afloat(floating, witness);
    CommandSample load_only = AtRest(state.command);
    const VecX all = asked.Force(state.command);
    const VecX motion = afloat.Force(Unloaded(state.command));
    const VecX gravity = asked.Force(Unloaded(AtRest(state.command)));
    for (LoadSample& load : load_only.loads) {
      load.force *= 1 + perturbation;
      load.moment *= 1 + perturbation;
    }
    const VecX loads = afloat.Force(load_only);
    const double size = motion.lpNorm<Eigen::Infinity>() + gravity.lpNorm<Eigen::Infinity>() +
                        loads.lpNorm<Eigen::Infinity>();
    Residual r{
        .error =
            (motion + (1 + perturbation) * gravity + loads - all).lpNorm<Eigen::Infinity>() / size,
        .budget = ForceBudget(subject(), state),
        .trouble = asked.trouble + afloat.trouble};
    if (perturbation > 0) {  // the share that was perturbed
      r.error *= size / (gravity + loads).lpNorm<Eigen::Infinity>();
    }
    return r;
  });
}

TEST_P(Forces, ScaleWithAllMassesAndLoads) {
  constexpr double kFactor = 1.75;
  const Subject heavier = subject().With(subject().Heavier(kFactor));
  CheckWitnesses([&](Witness witness, const State& state, double perturbation) {
    Asked light(subject(), witness), heavy(heavier, witness);
    CommandSample more = state.command;
    for (LoadSample& load : more.loads) {
      load.force *= kFactor;
      load.moment *= kFactor;
    }
    const VecX expected = kFactor * (1 + perturbation) * light.Force(state.command);
    const VecX force = heavy.Force(more);
    return Residual{.error = RelativeError(force, expected),
                    .budget = ForceBudget(subject(), state),
                    .trouble = light.trouble + heavy.trouble};
  });
}

class Powers : public Forces {};

// d/dt of kinetic energy minus the power of gravity, from the bodies' motion [W].
double PowerOfInertia(const Mechanism& m, const BodyStates& states, double* size) {
  double power = 0.0;
  for (size_t b = 1; b < m.bodies.size(); ++b) {
    const Body& body = m.bodies[b];
    const Mat3 R = states.X_WB[b].linear();
    const Vec3 w = states.V_WB[b].head<3>(), alpha = states.A_WB[b].head<3>();
    const Vec3 c = R * body.p_BoBcm_B;
    const Vec3 v = states.V_WB[b].tail<3>() + w.cross(c);
    const Vec3 a = states.A_WB[b].tail<3>() + alpha.cross(c) + w.cross(w.cross(c));
    const double of_mass = body.mass * (a - m.gravity_W).dot(v);
    const double of_turning = alpha.dot(R * body.I_Bcm_B * R.transpose() * w);
    power += of_mass + of_turning;
    *size += std::abs(of_mass) + std::abs(of_turning);
  }
  return power;
}

double PowerOfLoads(const CommandSample& command, const BodyStates& states, double* size) {
  double power = 0.0;
  for (const LoadSample& load : command.loads) {
    const Vec3 r = states.X_WB[load.body].linear() * load.p_BoQ_B;
    const Vec3 w = states.V_WB[load.body].head<3>();
    const Vec3 v = states.V_WB[load.body].tail<3>() + w.cross(r);
    power += load.force.dot(v) + load.moment.dot(w);
    *size += std::abs(load.force.dot(v)) + std::abs(load.moment.dot(w));
  }
  return power;
}

// Drive, base and load power against the energy's rate, the forces of each witness on the bodies'
// motion of the reference. (The closed form has no base forces; it borrows the reference's.)
TEST_P(Powers, OfTheForcesAreWhatTheEnergyGains) {
  CheckWitnesses([&](Witness witness, const State& state, double perturbation) {
    const Answer body = ByReference(subject(), state.command);
    Residual r{.error = 0.0,
               .budget = ForceBudget(subject(), state),
               .trouble = TroubleOf("reference", body.summary)};
    if (!r.trouble.empty()) return r;
    Answer own = body;
    if (witness == Witness::kSimulation) {
      own = BySimulation(subject(), body.driven, state.command);
    } else if (witness == Witness::kClosedForm) {
      const Answer form = ByClosedForm(subject(), state.command);
      own.summary = form.summary;
      own.force = form.force;
    }
    r.trouble = TroubleOf(NameOf(witness), own.summary);
    if (!r.trouble.empty()) return r;
    const auto drives = own.force.size(), bases = own.prescribed_force.size();
    const VecX drive_power = own.force.cwiseProduct(body.driven.velocity.head(drives));
    const VecX base_power = own.prescribed_force.cwiseProduct(body.driven.velocity.tail(bases));
    double size = drive_power.lpNorm<1>() + base_power.lpNorm<1>();
    const double loads = PowerOfLoads(state.command, body.states, &size);
    const double gained = PowerOfInertia(subject().mechanism, body.states, &size);
    // Perturbed: the drive that works most works too much.
    Eigen::Index most = 0;
    drive_power.cwiseAbs().maxCoeff(&most);
    const double extra = perturbation * std::copysign(size, drive_power[most]);
    r.error = std::abs(drive_power.sum() + base_power.sum() + loads + extra - gained) / size;
    return r;
  });
}

TEST_P(Powers, AsReportedBalance) {
  for (const bool simulated : {false, true}) {
    Check([&](const State& state, double perturbation) {
      Answer answer = ByReference(subject(), state.command);
      const double largest =
          answer.force.lpNorm<Eigen::Infinity>() * answer.driven.velocity.lpNorm<Eigen::Infinity>();
      if (simulated) answer = BySimulation(subject(), answer.driven, state.command);
      const double error =
          std::abs(answer.power_input_W + perturbation * largest - answer.energy_rate_W) / largest;
      return Residual{.error = std::isfinite(error) ? error : 1e300,
                      .budget = ForceBudget(subject(), state),
                      .trouble = TroubleOf("power", answer.summary)};
    });
  }
}

// M through everything driven: forces of unit accelerations at rest, without gravity and loads;
// units taken out by the diagonal.
Residual MassMatrix(const Subject& floating, const State& state, double perturbation,
                    bool* definite) {
  Residual r;
  r.budget = ForceBudget(floating, state);
  Answer here = ByClosedForm(floating, state.command);
  const Motion drives = floating.DriveMotion();
  ReferenceSolver solver(floating.mechanism, drives);
  const auto n = here.driven.position.size();
  CommandSample c = Unloaded(DriveCommand(here.driven, state.command));
  c.velocity.setZero();
  MatX M(n, n);
  for (Eigen::Index j = 0; j < n && r.trouble.empty(); ++j) {
    c.acceleration.setZero();
    c.acceleration[j] = 1.0;
    const Answer answer = Ask(&solver, c);
    r.trouble = TroubleOf("reference", answer.summary);
    if (r.trouble.empty()) M.col(j) << answer.force, answer.prescribed_force;
  }
  if (!r.trouble.empty()) return r;
  const VecX unit = M.diagonal().cwiseSqrt().cwiseInverse();
  MatX C = unit.asDiagonal() * M * unit.asDiagonal();
  C(0, n - 1) += perturbation;
  r.error = (C - C.transpose()).cwiseAbs().maxCoeff();
  *definite = C.allFinite() &&
              Eigen::SelfAdjointEigenSolver<MatX>(0.5 * (C + C.transpose())).eigenvalues()[0] > 0;
  return r;
}

TEST_P(Forces, SeeASymmetricPositiveDefiniteMassMatrix) {
  const Subject floating = subject().With({{"g", 0.0}});
  Check([&](const State& state, double perturbation) {
    bool definite = false;
    const Residual r = MassMatrix(floating, state, perturbation, &definite);
    EXPECT_TRUE(definite) << r;
    return r;
  });
}

// The same through the commands, by the closed form: JᵀF for those that are no base motion.
class MassMatrices : public EveryMechanism {};

TEST_P(MassMatrices, OfTheClosedFormAreSymmetric) {
  const Subject floating = subject().With({{"g", 0.0}});
  std::vector<Eigen::Index> free;
  for (const size_t k : floating.FreeCommands()) free.push_back(static_cast<Eigen::Index>(k));
  Check([&](const State& state, double perturbation) {
    const MatX J = DriveJacobian(floating, state.command);
    CommandSample c = Unloaded(AtRest(state.command));
    const auto n = static_cast<Eigen::Index>(free.size());
    MatX M(n, n);
    Residual r{.error = 0.0, .budget = ForceBudget(floating, state), .trouble = ""};
    for (Eigen::Index j = 0; j < n; ++j) {
      c.acceleration.setZero();
      c.acceleration[free[j]] = 1.0;
      const Answer answer = ByClosedForm(floating, c);
      r.trouble += TroubleOf("closed form", answer.summary);
      if (!r.trouble.empty()) return r;
      for (Eigen::Index i = 0; i < n; ++i) {
        M(i, j) = J.col(free[i]).head(answer.force.size()).dot(answer.force);
      }
    }
    const VecX unit = M.diagonal().cwiseSqrt().cwiseInverse();
    MatX C = unit.asDiagonal() * M * unit.asDiagonal();
    C(0, n - 1) += perturbation;
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatX>(0.5 * (C + C.transpose())).eigenvalues()[0], 0.0);
    r.error = (C - C.transpose()).cwiseAbs().maxCoeff();
    return r;
  });
}

// At the start of most motions nothing moves.
INSTANTIATE_TEST_SUITE_P(Laws, Powers,
                         ::testing::Combine(::testing::ValuesIn(SubjectNames()),
                                            ::testing::Values(Regime::kRandom,
                                                              Regime::kNearSingular)),
                         RegimeName);

// One free command has nothing to be symmetric.
std::vector<std::string> SubjectsWithTwoFreeCommands() {
  std::vector<std::string> names;
  for (const std::string& name : SubjectNames()) {
    if (SubjectOf(name).FreeCommands().size() >= 2) names.push_back(name);
  }
  return names;
}

INSTANTIATE_TEST_SUITE_P(Laws, MassMatrices,
                         ::testing::Combine(::testing::ValuesIn(SubjectsWithTwoFreeCommands()),
                                            ::testing::Values(Regime::kFirstSample, Regime::kClose,
                                                              Regime::kRandom,
                                                              Regime::kNearSingular)),
                         RegimeName);

INSTANTIATE_TEST_SUITE_P(Laws, Forces,
                         ::testing::Combine(::testing::ValuesIn(SubjectNames()),
                                            ::testing::Values(Regime::kFirstSample, Regime::kClose,
                                                              Regime::kRandom,
                                                              Regime::kNearSingular)),
                         RegimeName);

}  // namespace
}  // namespace mbv::laws
