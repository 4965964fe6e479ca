// models/scara_robot/model.yaml: mobility, exactness of its bearings, agreement of the generic
// reference solver with the closed form.
#include <fstream>
#include <sstream>

#include "analytic/scara_robot/closed_form.h"
#include "kinematics/mobility.h"
#include "model_file/load_model.h"
#include "reference/reference.h"
#include "tests/analytic/scara_robot_fixture.h"
#include "tests/support/source_dir.h"

namespace mbv::scara_robot {
namespace {

const std::string kModelFile = SourcePath("/models/scara_robot/model.yaml");

std::string ModelText() {
  std::ifstream file(kModelFile);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

/// The line of the model that starts with `start` (indentation included).
std::string LineOf(const std::string& text, const std::string& start) {
  const size_t at = text.find(start);
  EXPECT_NE(at, std::string::npos) << start;
  return text.substr(at, text.find('\n', at) - at);
}

Mechanism Loaded(const std::string& text, const std::map<std::string, double>& overrides = {}) {
  LoadOptions options;
  options.overrides = overrides;
  const LoadResult result = LoadModelText(text, kModelFile, options);
  EXPECT_TRUE(result.mechanism) << result.diagnostics.Text();
  return result.mechanism.value_or(Mechanism{});
}

TEST(ScaraModel, HasFourDegreesOfFreedomAndNoRedundantConstraint) {
  const Mobility mobility = AnalyseMobility(Loaded(ModelText()));
  EXPECT_EQ(mobility.body_coordinates, 78);
  EXPECT_EQ(mobility.constraint_rows, 74);
  EXPECT_EQ(mobility.constraint_rank, 74);
  EXPECT_EQ(mobility.dofs, 4);
  EXPECT_EQ(mobility.undriven, 0);
  EXPECT_TRUE(mobility.drives_not_unique.empty());
  EXPECT_TRUE(mobility.joints_not_unique.empty());
}

TEST(ScaraModel, TiltsWithoutItsCrossBars) {
  std::string text = ModelText();
  text = Replaced(text, LineOf(text, "      cross_bar:"), "");
  const std::string ball = LineOf(text, "      ball_C_b:");
  text = Replaced(text, ball, Replaced(ball, ", closure: true", ""));
  const Mobility mobility = AnalyseMobility(Loaded(text));
  // Four DOFs, two tilts of the platform, idle spins of four rods.
  EXPECT_EQ(mobility.idle_spins.size(), 4u);
  EXPECT_EQ(mobility.dofs, 4 + 2);
  EXPECT_EQ(mobility.undriven, 2);
}

TEST(ScaraModel, RigidCrossBarsAddOneRedundantConstraintEach) {
  std::string text = ModelText();
  text = Replaced(text, LineOf(text, "      cross_bar:"),
                  "      cross_a: {kind: revolute, parent: rod_a.middle, child: cross.a, axis: z, "
                  "guess: -shear}\n"
                  "      cross_b: {kind: revolute, parent: rod_b.middle, child: cross.b, axis: z, "
                  "guess: -shear}");
  text = Replaced(text, "      bar:\n",
                  "      cross:\n        frames: {a: {position: [0, d/2, 0]}, b: {position: [0, "
                  "-d/2, 0]}}\n      bar:\n");
  const Mobility mobility = AnalyseMobility(Loaded(text));
  EXPECT_EQ(mobility.dofs, 4);
  EXPECT_EQ(mobility.redundant, 2);
  EXPECT_EQ(mobility.undriven, 0);
  EXPECT_TRUE(mobility.drives_not_unique.empty());
}

TEST(ScaraModel, HomeIsTheClosedFormsHome) {
  const Mechanism mechanism = Loaded(ModelText());
  const Parameters p = ParametersOf(mechanism);
  Position home;
  ASSERT_TRUE(InversePosition(p, p.home_X, &home).ok());
  const Pose& X_WP = mechanism.X_WB_home[mechanism.FindBody("platform")];
  EXPECT_LT((X_WP.translation() - p.home_X.head<3>()).norm(), 1e-12);
  for (int i = 0; i < kLimbs; ++i) {
    const int joint = mechanism.FindJoint(std::string(LimbName(i)) + ".motor");
    EXPECT_NEAR(mechanism.joints[joint].home[0], home.theta[i], 1e-12);
  }
}

/// Torques of the reference solver and of the closed form, samples × 4, over this share of the
/// pick-and-place stroke.
struct Torques {
  MatX reference, closed_form;
};
Torques PickPlaceTorques(const std::map<std::string, double>& overrides, double share = 1.0) {
  std::map<std::string, double> all = overrides;
  all.insert({{"home_x", -0.09}, {"home_y", -0.025}, {"home_z", -0.165}, {"home_phi", -15 * kDeg}});
  const Mechanism mechanism = Loaded(ModelText(), all);
  Motion motion;
  const struct {
    const char* name;
    int component;
    double start, delta;
  } rows[] = {{"platform.x", 0, -0.09, 0.065},
              {"platform.y", 1, -0.025, -0.065},
              {"platform.z", 2, -0.165, 0.010},
              {"platform.yaw", 5, -15 * kDeg, 30 * kDeg}};
  for (const auto& row : rows) {
    Command command;
    command.name = row.name;
    command.terms = {{{Coordinate::Kind::kOutput, 0, row.component}, 1.0}};
    command.profile = {{ConstantTerm{row.start}, PolyStepTerm{0.0, 0.12, share * row.delta}}};
    motion.commands.push_back(command);
  }
  Load load;
  load.name = "tool";
  load.body = mechanism.FindBody("platform");
  load.p_BoQ_B = Vec3(0.02, 0.01, -0.04);
  load.in_body_axes = true;
  load.force = {Constant(2.0), Constant(-3.0), Constant(-5.0)};
  load.moment = {Constant(0.1), Constant(0.2), Constant(-0.15)};
  motion.loads = {load};

  Diagnostics diagnostics;
  const auto closed_form = MakeClosedForm(mechanism, motion, {}, &diagnostics);
  ReferenceSolver solver(mechanism, motion);
  CommandSample command;
  ClosedFormSample analytic;
  ReferenceSample reference;
  Torques torques;
  torques.reference.resize(13, 4);
  torques.closed_form.resize(13, 4);
  for (int k = 0; k <= 12; ++k) {
    EvaluateMotion(motion, 0.01 * k, &command);
    const RunSummary run = solver.Dynamics(command, &reference);
    EXPECT_TRUE(run.ok()) << run.message;
    EXPECT_TRUE(closed_form->Dynamics(command, &analytic).ok());
    torques.reference.row(k) = reference.drive_force.transpose();
    torques.closed_form.row(k) = analytic.force.transpose();
  }
  return torques;
}

// Loops close to 1e-13 m of 0.1 m, magnified by 1/s_min < 10 of the direct Jacobian.
constexpr double kTorqueTolerance = 1e-11;

double Difference(const MatX& a, const MatX& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

TEST(ScaraModel, ReferenceAgreesWithTheClosedFormInPickAndPlace) {
  const Torques torques = PickPlaceTorques({});
  EXPECT_LT(Difference(torques.reference, torques.closed_form), kTorqueTolerance);
}

TEST(ScaraModel, ReferenceAgreesWithTheClosedFormOnTheOtherBranch) {
  // The whole stroke is singular there, as both report.
  const Torques torques = PickPlaceTorques({{"branch", -1.0}}, 0.2);
  EXPECT_LT(Difference(torques.reference, torques.closed_form), kTorqueTolerance);
  EXPECT_GT(Difference(torques.closed_form, PickPlaceTorques({}).closed_form), 0.1);
}

TEST(ScaraModel, BearingsOnTheBarsAndTheirWidthChangeNoTorque) {
  const MatX standard = PickPlaceTorques({}).closed_form;
  const std::map<std::string, double> variants[] = {
      {{"ball_mass", 0.0}, {"pivot_mass", 0.0}},
      {{"ball_mass", 0.02}, {"pivot_mass", 0.05}},
      {{"d", 0.03}},
  };
  for (const auto& variant : variants) {
    EXPECT_LT(Difference(PickPlaceTorques(variant).reference, standard), kTorqueTolerance);
  }
}

TEST(ScaraModel, PerturbedConstantsOfTheModelAreSeen) {
  const MatX standard = PickPlaceTorques({}).closed_form;
  for (const auto& [name, value] : std::map<std::string, double>{{"m_p", 0.4677},
                                                                 {"m_rods", 0.2037},
                                                                 {"l3", 0.185},
                                                                 {"m_arm", 0.1902},
                                                                 {"I_p_z", 3.8975e-4},
                                                                 {"e", 0.05}}) {
    EXPECT_GT(Difference(PickPlaceTorques({{name, value * (1 + 1e-8)}}).reference, standard),
              2 * kTorqueTolerance)
        << name;
  }
}

TEST(ScaraModel, UnreachableHomeIsRefused) {
  LoadOptions options;
  options.overrides = {{"home_z", -0.4}};
  const LoadResult result = LoadModelText(ModelText(), kModelFile, options);
  EXPECT_FALSE(result.mechanism);
  EXPECT_TRUE(result.diagnostics.has_errors());
}

}  // namespace
}  // namespace mbv::scara_robot
