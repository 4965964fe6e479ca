// Frequencies and derivatives against formulas by hand, and every term that a user's matrix may
// lack.
#include "features/linearise/linearise.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "model_file/load_model.h"
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
  ASSERT_EQ(open.engines.size(), 2U) << open.diagnostics.Text();
  for (const EngineDerivative& engine : open.engines) {
    EXPECT_EQ(engine.why_not, "");
    EXPECT_LT(engine.position_error, 1e-6);
    EXPECT_LT(engine.velocity_error, 1e-5);
  }
  const Linearisation loop = Linearise(Model("four_bar"), settings);
  ASSERT_EQ(loop.engines.size(), 2U) << loop.diagnostics.Text();
  EXPECT_GT(loop.engines[0].position_error, 1e-3);
  EXPECT_LT(loop.engines[1].position_error, 1e-3);
  EXPECT_GT(loop.engines[1].position_error, 1e-7);
}

// Friction that slides slowly keeps its direction in differences, too.
TEST(Linearise, DifferentiatesSlidingFriction) {
  LinearSettings settings;
  settings.rates = {{"motor1", 0.05}, {"motor2", -0.03}};
  const Linearisation result = Linearise(Model("friction_five_bar"), settings);
  ASSERT_FALSE(result.diagnostics.has_errors()) << result.diagnostics.Text();
  EXPECT_TRUE(result.agrees()) << result.difference_error;
}

TEST(Linearise, RefusesWhatHasNoDerivative) {
  const Linearisation result = Linearise(Model("journal_crank"), LinearSettings());
  ASSERT_TRUE(result.diagnostics.has_errors());
  EXPECT_NE(result.diagnostics.Text().find("friction"), std::string::npos);
}

}  // namespace
}  // namespace mbv
