// Frequencies and derivatives against formulas by hand, and every term that a user's matrix may
// lack.
#include "features/linearise/linearise.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "mechanism/reach.h"
#include "model_file/load_model.h"
#include "scenario/load_scenario.h"
#include "tests/support/shipped.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

Mechanism Text(const std::string& yaml) {
  LoadResult loaded = LoadModelText(yaml, "model.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism());
}
Mechanism Model(const std::string& name) {
  LoadResult loaded = LoadModel(SourcePath("/models/" + name + "/model.yaml"));
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism());
}

// A rod of mass m and length l that hangs by its end: ω² = (m g l/2)/(m l²/3).
std::string Pendulum(double damping) {
  return fmt::format(R"(name: pendulum
gravity: [0, 0, -9.81]
bodies:
  rod: {{mass: 2, com: [0, 0, -0.3], inertia: [0.06, 0.06, 0.001]}}
joints:
  hinge: {{kind: revolute, parent: world, child: rod, axis: x}}
elements:
  oil: {{kind: damping, joint: hinge, damping: {}}}
)",
                     damping);
}

TEST(Linearise, FindsAPendulumsFrequencyAndDamping) {
  const double inertia = 0.06 + 2 * 0.09, torque = 2 * 9.81 * 0.3, damping = 0.5;
  const double free = std::sqrt(torque / inertia);
  const Linearisation swings = Linearise(Text(Pendulum(1e-12)), LinearSettings());
  ASSERT_FALSE(swings.diagnostics.has_errors()) << swings.diagnostics.Text();
  ASSERT_EQ(swings.modes.size(), 1U);
  EXPECT_NEAR(swings.modes[0].frequency_hz, free / kTurn, 1e-12 * free);
  EXPECT_TRUE(swings.agrees());

  const Linearisation damped = Linearise(Text(Pendulum(damping)), LinearSettings());
  ASSERT_EQ(damped.modes.size(), 1U);
  const double decay = 0.5 * damping / inertia;
  EXPECT_NEAR(damped.modes[0].eigenvalue.real(), -decay, 1e-12 * free);
  EXPECT_NEAR(damped.modes[0].eigenvalue.imag(), std::sqrt(free * free - decay * decay),
              1e-12 * free);
  EXPECT_NEAR(damped.modes[0].damping_ratio, decay / free, 1e-12);

  // Upside down it falls, with the rate at which it would swing.
  LinearSettings up;
  up.at = {{"hinge", std::numbers::pi}};
  const Linearisation falls = Linearise(Text(Pendulum(1e-12)), up);
  ASSERT_EQ(falls.modes.size(), 1U) << falls.diagnostics.Text();
  EXPECT_EQ(falls.modes[0].kind, VibrationMode::Kind::kGrows);
  EXPECT_NEAR(falls.modes[0].eigenvalue.real(), free, 1e-9 * free);
}

// Two equal masses, each on a spring to the wall and one between them: k/m and 3 k/m.
TEST(Linearise, FindsBothModesOfTwoMassesOnSprings) {
  const Mechanism mechanism = Text(R"(name: two_masses
gravity: [0, 0, 0]
bodies:
  a: {mass: 2, inertia: [1, 1, 1]}
  b: {mass: 2, inertia: [1, 1, 1], frames: {far: {position: [1, 0, 0]}}}
joints:
  ja: {kind: prismatic, parent: world, child: a, axis: x}
  jb: {kind: prismatic, parent: world, child: b, axis: x}
springs:
  between: {from: a, to: b.far, stiffness: 50, damping: 0, free_length: 1}
elements:
  left: {kind: spring, joint: ja, stiffness: 50}
  right: {kind: spring, joint: jb, stiffness: 50}
)");
  const Linearisation result = Linearise(mechanism, LinearSettings());
  ASSERT_EQ(result.modes.size(), 2U) << result.diagnostics.Text();
  EXPECT_NEAR(result.modes[0].frequency_hz, std::sqrt(25.0) / kTurn, 1e-12);
  EXPECT_NEAR(result.modes[1].frequency_hz, std::sqrt(75.0) / kTurn, 1e-12);
  EXPECT_NEAR((result.modes[0].shape[0] / result.modes[0].shape[1]).real(), 1.0, 1e-9);
  EXPECT_NEAR((result.modes[1].shape[0] / result.modes[1].shape[1]).real(), -1.0, 1e-9);
}

TEST(Linearise, AllWaysAgreeOnEveryShippedModel) {
  for (const std::string& name : ShippedModelNames()) {
    const Mechanism mechanism = Model(name);
    const Linearisation result = Linearise(mechanism, LinearSettings());
    if (result.diagnostics.has_errors()) {
      // Those whose friction has no derivative say so.
      EXPECT_NE(result.diagnostics.Text().find("friction"), std::string::npos)
          << name << ": " << result.diagnostics.Text();
      continue;
    }
    EXPECT_TRUE(result.agrees()) << name << " " << result.dual_error << " of " << result.dual_limit
                                 << ", " << result.difference_error;
    EXPECT_LT(result.dual_error, 1e-10) << name;
  }
}

nlohmann::json Rows(const MatX& matrix) {
  nlohmann::json rows = nlohmann::json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    rows.push_back(nlohmann::json::array());
    for (Eigen::Index k = 0; k < matrix.cols(); ++k) rows.back().push_back(matrix(i, k));
  }
  return rows;
}

// A hexapod in motion, of which every term counts.
LinearSettings Moving() {
  LinearSettings settings;
  settings.at = {{"leg1.length", 0.62}, {"leg3.length", 0.66}, {"leg6.length", 0.64}};
  settings.rates = {{"leg1.length", 0.4}, {"leg2.length", -0.3}, {"leg5.length", 0.5}};
  return settings;
}

TEST(Linearise, NamesTheTermThatAMatrixLacks) {
  const test::TestFolder folder("derivatives");
  const Mechanism mechanism = Model("stewart");
  LinearSettings settings = Moving();
  const Linearisation truth = Linearise(mechanism, settings);
  ASSERT_FALSE(truth.diagnostics.has_errors()) << truth.diagnostics.Text();
  ASSERT_TRUE(truth.agrees());
  settings.check = folder.PathOf("mine.json");
  const auto judged = [&](const nlohmann::json& json) {
    std::ofstream(settings.check) << json;
    Linearisation result = Linearise(mechanism, settings);
    EXPECT_FALSE(result.diagnostics.has_errors()) << result.diagnostics.Text();
    return result;
  };
  const Linearisation same = judged({{"f_q", Rows(truth.by_reference.by_position)},
                                     {"f_v", Rows(truth.by_reference.by_velocity)},
                                     {"f_a", Rows(truth.by_reference.by_acceleration)},
                                     {"A", Rows(truth.A)},
                                     {"B", Rows(truth.B)}});
  EXPECT_TRUE(same.agrees());
  ASSERT_EQ(same.checks.size(), 5U);
  size_t named = 0;
  for (const ForceDerivatives::Term& term : truth.by_reference.terms) {
    for (const auto& [key, whole, part] :
         {std::tuple("f_q", &truth.by_reference.by_position, &term.by_position),
          std::tuple("f_v", &truth.by_reference.by_velocity, &term.by_velocity)}) {
      if (part->isZero(0.0)) continue;
      for (const double times : {1.0, 2.0}) {
        const Linearisation off = judged({{key, Rows(*whole - times * *part)}});
        ASSERT_EQ(off.checks.size(), 1U);
        EXPECT_FALSE(off.agrees()) << term.name;
        EXPECT_NE(off.checks[0].explained.find(term.name), std::string::npos)
            << term.name << ": " << off.checks[0].explained;
        EXPECT_NE(off.checks[0].explained.find(times == 1.0 ? "left out" : "wrong sign"),
                  std::string::npos);
        ++named;
      }
    }
  }
  EXPECT_EQ(named, 12U);
  // One entry a little off is seen, and explained by nothing.
  MatX touched = truth.by_reference.by_position;
  touched(1, 2) += 1e-5 * touched.cwiseAbs().maxCoeff();
  const Linearisation off = judged({{"f_q", Rows(touched)}});
  EXPECT_FALSE(off.agrees());
  EXPECT_EQ(off.checks[0].explained, "");
  // Other coordinates and other sizes are refused.
  std::ofstream(settings.check) << R"({"coordinates": ["a"], "f_q": [[1]]})";
  EXPECT_TRUE(Linearise(mechanism, settings).diagnostics.has_errors());
  std::ofstream(settings.check) << R"({"f_q": [[1]]})";
  EXPECT_TRUE(Linearise(mechanism, settings).diagnostics.has_errors());
  std::ofstream(settings.check) << R"({"f_x": []})";
  EXPECT_TRUE(Linearise(mechanism, settings).diagnostics.has_errors());
}

// A weight on a guide's spring settles where the spring bears it.
TEST(Linearise, FindsAnEquilibrium) {
  const Mechanism mechanism = Text(R"(name: weight
gravity: [0, 0, -10]
bodies:
  a: {mass: 2, inertia: [1, 1, 1]}
joints:
  guide: {kind: prismatic, parent: world, child: a, axis: z}
elements:
  spring: {kind: spring, joint: guide, polynomial: [100, 0, 5000]}
)");
  LinearSettings settings;
  settings.equilibrium = true;
  const Linearisation result = Linearise(mechanism, settings);
  ASSERT_FALSE(result.diagnostics.has_errors()) << result.diagnostics.Text();
  const double z = result.q[0];
  EXPECT_NEAR(100 * z + 5000 * z * z * z, -20.0, 1e-9);
  EXPECT_NEAR(result.K(0, 0), 100 + 15000 * z * z, 1e-8);
  EXPECT_LT(result.imbalance, 1e-9);
}

// Without loops MuJoCo has the same equations; loops are soft there.
TEST(Linearise, ShowsWhatMujocosDerivativeIsOffBy) {
  LinearSettings settings;
  settings.mujoco = true;
  const Linearisation open = Linearise(Text(R"(name: double_pendulum
gravity: [0, 0, -9.81]
bodies:
  a: {mass: 2, com: [0, 0, -0.3], inertia: [0.06, 0.06, 0.001], frames: {end: {position: [0, 0, -0.6]}}}
  b: {mass: 1, com: [0, 0.1, -0.2], inertia: [0.02, 0.02, 0.001]}
joints:
  ja: {kind: revolute, parent: world, child: a, axis: x}
  jb: {kind: revolute, parent: a.end, child: b, axis: x}
drives:
  motor: {kind: joint, joint: ja}
springs:
  line: {from: world, to: b, stiffness: 30, damping: 0.5, free_length: 0.4}
)"),
                                       settings);
  ASSERT_EQ(open.engines.size(), 3U) << open.diagnostics.Text();
  for (size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(open.engines[k].why_not, "");
    EXPECT_LT(open.engines[k].position_error, 1e-6);
    EXPECT_LT(open.engines[k].velocity_error, 1e-5);
  }
  EXPECT_NE(open.engines[2].why_not, "");  // one drive
  const Linearisation loop = Linearise(Model("four_bar"), settings);
  ASSERT_EQ(loop.engines.size(), 3U) << loop.diagnostics.Text();
  EXPECT_GT(loop.engines[0].position_error, 1e-3);
  EXPECT_LT(loop.engines[1].position_error, 1e-3);
  EXPECT_GT(loop.engines[1].position_error, 1e-7);
  // With loops closed exactly it has ours, of any state; of heavier bodies others.
  LinearSettings moving = Moving();
  moving.mujoco = true;
  const Mechanism stewart = Model("stewart");
  const Linearisation same = Linearise(stewart, moving);
  ASSERT_EQ(same.engines.size(), 2U) << same.diagnostics.Text();
  EXPECT_EQ(same.engines[0].why_not, "the state is in motion");
  EXPECT_EQ(same.engines[1].why_not, "");
  EXPECT_LT(same.engines[1].position_error, 1e-7);
  EXPECT_LT(same.engines[1].velocity_error, 1e-7);
  Mechanism heavier = stewart;
  for (Body& body : heavier.bodies) body.mass *= 1.0 + 1e-6;
  std::vector<Coordinate> coordinates;
  for (const NamedCoordinate& at : same.coordinates) coordinates.push_back(at.coordinate);
  ReducedModel model(heavier, coordinates);
  const VecX unit = CharacteristicLength(stewart) * VecX::Ones(6);
  EXPECT_GT(AskCorrectedMujoco(heavier, same, unit, &model).position_error, 1e-7);
}

// Friction that slides slowly keeps its direction in differences, too.
TEST(Linearise, DifferentiatesSlidingFriction) {
  LinearSettings settings;
  settings.rates = {{"motor1", 0.05}, {"motor2", -0.03}};
  const Linearisation result = Linearise(Model("friction_five_bar"), settings);
  ASSERT_FALSE(result.diagnostics.has_errors()) << result.diagnostics.Text();
  EXPECT_TRUE(result.agrees()) << result.difference_error;
}

// A pendulum's pivot bears the weight and what swings: with its angle q from the vertical, and M
// about x,
//   f_z = m (g + l v² cos q + l a sin q),  f_y = …, in F's axes, which are the world's
TEST(Linearise, FindsDerivativesOfReactions) {
  LinearSettings settings;
  const double q = 0.4, v = 1.3, m = 2, l = 0.3, g = 9.81;
  settings.at = {{"hinge", q}}, settings.rates = {{"hinge", v}};
  const Linearisation result = Linearise(Text(Pendulum(0.5)), settings);
  ASSERT_FALSE(result.diagnostics.has_errors()) << result.diagnostics.Text();
  ASSERT_EQ(result.no_every, "");
  EXPECT_TRUE(result.agrees());
  const EveryForce& by = result.every.by;
  EXPECT_FALSE(by.of_drives);  // there is none
  const double a = result.a[0];
  const ForceSlopes& of = by.reactions;
  ASSERT_EQ(of.force.size(), 6);
  // The rod's centre is at l (0, sin q, −cos q).
  EXPECT_NEAR(of.force[1], m * l * (a * std::cos(q) - v * v * std::sin(q)), 1e-12);
  EXPECT_NEAR(of.force[2], m * (g + l * (a * std::sin(q) + v * v * std::cos(q))), 1e-12);
  EXPECT_NEAR(of.by_position(2, 0), m * l * (a * std::cos(q) - v * v * std::sin(q)), 1e-12);
  EXPECT_NEAR(of.by_velocity(2, 0), 2 * m * l * v * std::cos(q), 1e-12);
  EXPECT_NEAR(of.by_acceleration(2, 0), m * l * std::sin(q), 1e-12);
  EXPECT_NEAR(of.by_acceleration(1, 0), m * l * std::cos(q), 1e-12);
}

// Each of the numbers that decide, a little beyond its limit.
TEST(Linearise, DisagreesWhereReactionsDo) {
  LinearSettings settings = Moving();
  Linearisation result = Linearise(Model("stewart"), settings);
  ASSERT_TRUE(result.agrees());
  EXPECT_LT(result.every.dual_error, 1e-10);
  EXPECT_LT(result.every.difference_error, 1e-7);
  const JudgedForces truth = result.every;
  result.every.dual_error = 2.0 * truth.dual_limit;
  EXPECT_FALSE(result.agrees());
  result.every = truth, result.every.difference_error = 2.0 * truth.difference_limit;
  EXPECT_FALSE(result.agrees());
  // One entry of a matrix, by ten times the limit of both ways.
  EveryForce by = truth.by;
  const MatX& reactions = truth.by.reactions.by_position;
  const double largest = reactions.cwiseAbs().maxCoeff();
  for (ForceSlopes* of : {&by.reactions, &by.acting}) {
    ForceSlopes other = *of;
    other.by_position(2, 1) += 1e-9 * std::max(largest, of->by_position.cwiseAbs().maxCoeff());
    const bool reaction = of == &by.reactions;
    EXPECT_GT(EveryForceError(Model("stewart"), VecX::Ones(6), by, reaction ? by.acting : other,
                              reaction ? other : by.reactions),
              1e-10);
  }
}

// Of planar loops redundant constraints share some reactions.
TEST(Linearise, NamesReactionsThatAreNotUnique) {
  const Linearisation result = Linearise(Model("redundant_five_bar"), LinearSettings());
  ASSERT_FALSE(result.diagnostics.has_errors()) << result.diagnostics.Text();
  EXPECT_EQ(result.no_every, "");
  EXPECT_TRUE(result.agrees());
  EXPECT_FALSE(result.every.by.of_drives);  // they share their forces
  const nlohmann::json json =
      nlohmann::json::parse(LinearisationJson(result, Model("redundant_five_bar")));
  EXPECT_EQ(json["forces"]["exerted_by"], "coordinates");
  EXPECT_EQ(json["forces"]["channels"].size(), json["forces"]["by_position"].size());
}

TEST(Linearise, TakesFrictionByLoadInMotion) {
  LinearSettings settings;
  settings.rates = {{"motor", 6.0}};
  const Mechanism mechanism = Model("journal_crank");
  const Linearisation result = Linearise(mechanism, settings);
  ASSERT_FALSE(result.diagnostics.has_errors()) << result.diagnostics.Text();
  EXPECT_TRUE(result.agrees()) << result.dual_error << " " << result.difference_error;
  EXPECT_STREQ(result.by_reference.terms.back().name, "friction by the loads of joints");
  EXPECT_GT(result.by_reference.terms.back().by_position.norm(),
            1e-3 * result.by_reference.by_position.norm());
  // Without it, the differences disagree.
  const ForceSlopes with = result.by_differences;
  ForceDerivatives without = result.by_reference;
  without.by_position -= result.by_reference.terms.back().by_position;
  const DerivativeScales scales(mechanism, VecX::Ones(1), VecX::Ones(1), result.by_reference);
  EXPECT_LT(scales.Error(result.by_reference, with), 1e-7);
  EXPECT_GT(scales.Error(without, with), 1e-4);
  // A drive that exerts more accelerates: M a = what is left.
  settings.forces = {{"motor", result.drive_force[0] + 1.0}};
  const Linearisation faster = Linearise(mechanism, settings);
  ASSERT_FALSE(faster.diagnostics.has_errors()) << faster.diagnostics.Text();
  EXPECT_TRUE(faster.agrees());
  EXPECT_NEAR(faster.a[0], result.B(1, 0), 0.05 * std::abs(result.B(1, 0)));
  // Eigenvalues are those of A.
  const MatX& A = result.A;
  for (const VibrationMode& mode : result.modes) {
    const std::complex<double> x = mode.eigenvalue;
    EXPECT_LT(std::abs(x * x - A(1, 1) * x - A(1, 0)), 1e-9 * (std::abs(A(1, 0)) + std::norm(x)));
  }
}

// A scenario's instant: the state of its motion and its loads, which change ∂f/∂q.
TEST(Linearise, TakesTheStateAndLoadsOfAScenario) {
  ScenarioResult loaded = LoadScenario(SourcePath("/scenarios/spr_tripod/tool_load.yaml"));
  ASSERT_TRUE(loaded.scenario.has_value()) << loaded.diagnostics.Text();
  const Mechanism& mechanism = *loaded.mechanism;
  Motion motion = loaded.scenario->motion;
  ASSERT_FALSE(motion.loads.empty());
  LinearSettings settings;
  settings.motion = &motion, settings.time_s = 0.3 * motion.duration_s;
  const Linearisation result = Linearise(mechanism, settings);
  ASSERT_FALSE(result.diagnostics.has_errors()) << result.diagnostics.Text();
  EXPECT_TRUE(result.agrees()) << result.dual_error << " " << result.difference_error;
  EXPECT_LT(result.imbalance, 1e-12);  // drives hold the motion
  EXPECT_GT(result.v.norm(), 0.0);
  // The reference's own forces there.
  ReducedModel along(mechanism, motion.commands);
  CommandSample command;
  EvaluateMotion(motion, settings.time_s, &command);
  ASSERT_TRUE(along.Move(command.position, command.velocity, command.acceleration).ok());
  ASSERT_TRUE(along.AllForces(command.loads).ok());
  EXPECT_LT((along.drive_force() - result.drive_force).norm(), 1e-9 * result.drive_force.norm());
  // Without loads the forces are others.
  motion.loads.clear();
  const Linearisation bare = Linearise(mechanism, settings);
  ASSERT_FALSE(bare.diagnostics.has_errors()) << bare.diagnostics.Text();
  EXPECT_GT((bare.drive_force - result.drive_force).norm(), 1e-3 * result.drive_force.norm());
  settings.time_s = 2.0 * motion.duration_s;
  EXPECT_TRUE(Linearise(mechanism, settings).diagnostics.has_errors());
}

// A program reads the state and answers with f_a; the same one, a little off, is found.
TEST(Linearise, JudgesAProgram) {
  const test::TestFolder folder("derivative_program");
  const Mechanism mechanism = Model("pendulum");
  LinearSettings settings;
  const auto ask = [&](const std::string& answer) {
    settings.program = "python3 " + folder.Write("mine.py", fmt::format(R"(import json
state = json.load(open('state.json'))
mechanism = json.load(open('mechanism.json'))
names = [c['name'] for c in state['coordinates']]
{}
)",
                                                                        answer));
    return Linearise(mechanism, settings);
  };
  const Linearisation known = Linearise(mechanism, settings);
  ASSERT_FALSE(known.diagnostics.has_errors()) << known.diagnostics.Text();
  const auto answered = [&](double factor) {
    return ask(
        fmt::format("json.dump({{'coordinates': names, 'f_a': [[{:.17g}]]}}, "
                    "open('derivatives.json', 'w'))",
                    factor * known.by_reference.by_acceleration(0, 0)));
  };
  const Linearisation right = answered(1.0);
  EXPECT_EQ(right.program_trouble, "");
  ASSERT_EQ(right.checks.size(), 1U);
  EXPECT_TRUE(right.agrees());
  EXPECT_FALSE(answered(1.0 + 3e-6).agrees());
  for (const std::string& answer :
       {std::string("raise SystemExit('no licence')"), std::string("pass"),
        std::string("open('derivatives.json', 'w').write('no')"),
        std::string("json.dump({'f_a': [[float('nan')]]}, open('derivatives.json', 'w'))")}) {
    const Linearisation none = ask(answer);
    EXPECT_NE(none.program_trouble, "") << answer;
    EXPECT_TRUE(none.checks.empty());
    EXPECT_TRUE(none.agrees());
  }
}

TEST(Linearise, RefusesWhatHasNoDerivative) {
  const Linearisation result = Linearise(Model("journal_crank"), LinearSettings());
  ASSERT_TRUE(result.diagnostics.has_errors());
  EXPECT_NE(result.diagnostics.Text().find("friction"), std::string::npos);
}

}  // namespace
}  // namespace mbv
