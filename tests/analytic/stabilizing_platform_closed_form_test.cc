// Stabilizing platform behind the common interface: findings about bad input, summaries of poses
// that cannot be computed, extra channels, and no allocation per sample.
#include <gtest/gtest.h>

#include "model_file/load_model.h"
#include "tests/analytic/stabilizing_platform_fixture.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/source_dir.h"

namespace mbv::stabilizing_platform {
namespace {

Mechanism Names() { return MechanismOfNames(DefaultParameters()); }

std::unique_ptr<ClosedForm> Make(const Mechanism& mechanism, const Motion& motion,
                                 const ClosedFormOptions& options = {}) {
  Diagnostics diagnostics;
  auto closed_form = MakeClosedForm(mechanism, motion, options, &diagnostics);
  EXPECT_TRUE(diagnostics.empty()) << diagnostics.Text();
  return closed_form;
}

// The findings that an input must lead to.
std::string FindingsOf(const Mechanism& mechanism, const Motion& motion,
                       const ClosedFormOptions& options = {}) {
  Diagnostics diagnostics;
  EXPECT_EQ(MakeClosedForm(mechanism, motion, options, &diagnostics), nullptr);
  EXPECT_TRUE(diagnostics.has_errors());
  for (const Finding& finding : diagnostics.findings()) EXPECT_FALSE(finding.hint.empty());
  return diagnostics.Text();
}

#define EXPECT_MENTIONS(text, words) \
  EXPECT_NE((text).find(words), std::string::npos) << "the text was:\n" << (text)

double Extra(const ClosedForm& closed_form, const ClosedFormSample& sample,
             const std::string& name) {
  const std::vector<Channel> channels = closed_form.extra_channels();
  for (size_t k = 0; k < channels.size(); ++k) {
    if (channels[k].name == name) return sample.extra[static_cast<Eigen::Index>(k)];
  }
  ADD_FAILURE() << "no channel " << name;
  return kNan;
}

ClosedFormSample SampleAt(const Motion& motion, double t, ClosedForm* closed_form) {
  CommandSample command;
  EvaluateMotion(motion, t, &command);
  ClosedFormSample sample;
  const RunSummary summary = closed_form->Dynamics(command, &sample);
  EXPECT_TRUE(summary.ok()) << summary.message;
  return sample;
}

TEST(StabilizingPlatformClosedForm, IsRegisteredWithItsModels) {
  const ClosedFormRow* row = FindClosedForm("stabilizing_platform");
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->models, (std::vector<std::string>{"full", "massless", "paper_text"}));
  EXPECT_EQ(row->errata, std::vector<std::string>{"E2"});
}

TEST(StabilizingPlatformClosedForm, FillsDrivesAndPlatformAt1500ms) {
  const Motion motion = SeaStateMotion();
  const auto closed_form = Make(Names(), motion);
  const ClosedFormSample sample = SampleAt(motion, 1.5, closed_form.get());
  EXPECT_NEAR(sample.force[2], 443530.049, 0.5001e-3);
  EXPECT_NEAR(sample.driven.position[2], 2.014160412, 0.5001e-9);
  EXPECT_NEAR(sample.driven.acceleration[3], 0.571156250, 0.5001e-9);
  EXPECT_NEAR(sample.driven.position[6], 6 * kDegree, 4 * kEps);  // roll
  EXPECT_NEAR(sample.driven.position[8], 1.5, 4 * kEps);          // heave
  EXPECT_NEAR(Extra(*closed_form, sample, "platform.z"), 3.5, 0);
  EXPECT_NEAR(Extra(*closed_form, sample, "platform.roll"), 0, 0);
  EXPECT_NEAR(Extra(*closed_form, sample, "limb2.f_X"), -12548.384, 0.5001e-3);
  EXPECT_GT(Extra(*closed_form, sample, "limb2.amplification"), 2.7);
}

TEST(StabilizingPlatformClosedForm, HoldsThePlatformStillWithSixDrives) {
  const Motion motion = SeaStateMotion(true);
  const auto closed_form = Make(Names(), motion);
  const ClosedFormSample sample = SampleAt(motion, 1.5, closed_form.get());
  EXPECT_NEAR(sample.force[3], 600117, 0.5001);
  for (const Channel& channel : closed_form->extra_channels()) {
    EXPECT_EQ(channel.name.find("amplification"), std::string::npos) << channel.name;
  }
}

TEST(StabilizingPlatformClosedForm, RunsAWholePeriodInEveryModel) {
  for (const char* model : {"full", "massless", "paper_text"}) {
    for (bool still : {false, true}) {
      const Motion motion = SeaStateMotion(still);
      const auto closed_form = Make(Names(), motion, {.model = model, .as_printed = {}});
      const ClosedFormRun run = RunClosedForm(Names(), motion, closed_form.get());
      EXPECT_TRUE(run.summary.ok()) << run.summary.message;
      EXPECT_TRUE(run.trace.values.allFinite()) << model;
      EXPECT_EQ(run.trace.values.rows(), 601);
    }
  }
}

TEST(StabilizingPlatformClosedForm, AllocatesNothingPerSample) {
  Motion motion = SeaStateMotion();
  Load load;
  load.name = "crate";
  load.body = 2;
  load.force[2] = Constant(-1e4);
  motion.loads.push_back(load);
  const auto closed_form = Make(Names(), motion);
  CommandSample command;
  ClosedFormSample sample;
  EvaluateMotion(motion, 0, &command);
  ASSERT_TRUE(closed_form->Dynamics(command, &sample).ok());
  const std::size_t before = AllocationCount();
  bool ok = true;
  for (int k = 0; k < 100; ++k) {
    EvaluateMotion(motion, 0.1 * k, &command);
    ok = closed_form->Dynamics(command, &sample).ok() && ok;
  }
  EXPECT_EQ(AllocationCount(), before);
  EXPECT_TRUE(ok);
}

TEST(StabilizingPlatformClosedForm, RejectsTheAzimuthsOfThePrint) {
  std::map<std::string, double> values = DefaultParameters();
  values["theta_2"] = values["theta_1"];
  const std::string text = FindingsOf(MechanismOfNames(values), SeaStateMotion());
  EXPECT_MENTIONS(text, "same azimuth");
  EXPECT_MENTIONS(text, "theta_2 = 240 degrees is meant");
}

TEST(StabilizingPlatformClosedForm, CollectsEveryUnusableParameter) {
  std::map<std::string, double> values = DefaultParameters();
  values["theta_2"] = 180 * kDegree;
  values["L3"] = -1;
  values["r_b"] = 0;
  const std::string text = FindingsOf(MechanismOfNames(values), SeaStateMotion());
  EXPECT_MENTIONS(text, "L3 = -1 violates L3 > 0");
  EXPECT_MENTIONS(text, "r_b = 0 violates r_b > 0");
  EXPECT_MENTIONS(text, "multiple of 90 degrees");
  values = DefaultParameters();
  values.erase("m_2p");
  values.erase("L4");
  const std::string missing = FindingsOf(MechanismOfNames(values), SeaStateMotion());
  EXPECT_MENTIONS(missing, "\"m_2p\" is missing");
  EXPECT_MENTIONS(missing, "\"L4\" is missing");
}

TEST(StabilizingPlatformClosedForm, RejectsLinksThatDoNotReachTheNeutralPose) {
  std::map<std::string, double> values = DefaultParameters();
  values["z_0"] = 7;
  EXPECT_MENTIONS(FindingsOf(MechanismOfNames(values), SeaStateMotion()), "L1 + L3 = 7.05 m");
  values["z_0"] = 0.8;
  EXPECT_MENTIONS(FindingsOf(MechanismOfNames(values), SeaStateMotion()), "toggle");
}

TEST(StabilizingPlatformClosedForm, RejectsCommandsItHasNoUseFor) {
  Motion motion = SeaStateMotion();
  motion.commands[2].terms[0].factor = 2;  // 2 × heave
  const std::string text = FindingsOf(Names(), motion);
  EXPECT_MENTIONS(text, "no use for the command \"heave\"");
  EXPECT_MENTIONS(text, "\"heave\" is not commanded");
}

TEST(StabilizingPlatformClosedForm, RejectsPairsBesidesTheWholePose) {
  Motion motion = SeaStateMotion(true);
  motion.commands.push_back(SeaStateMotion().commands.back());
  EXPECT_MENTIONS(FindingsOf(Names(), motion), "is commanded in addition to the pose");
}

TEST(StabilizingPlatformClosedForm, RejectsUnknownModelsErrataAndLoadedBodies) {
  Motion motion = SeaStateMotion();
  motion.loads.push_back({});  // on the world
  motion.loads[0].name = "crate";
  const std::string text = FindingsOf(Names(), motion, {.model = "fast", .as_printed = {"E5"}});
  EXPECT_MENTIONS(text, "model \"fast\" is unknown");
  EXPECT_MENTIONS(text, "\"E5\" is not offered");
  EXPECT_MENTIONS(text, "crate: the closed form knows no body \"world\"");
}

TEST(StabilizingPlatformClosedForm, RefusesToTiltASynchronousPlatform) {
  Motion motion = SeaStateMotion();
  motion.commands[motion.FindCommand("platform.pitch")].profile = Constant(0.01);
  const auto closed_form = Make(Names(), motion);
  const ClosedFormRun run = RunClosedForm(Names(), motion, closed_form.get());
  EXPECT_EQ(run.summary.stop, Stop::kUnsupported);
  EXPECT_EQ(run.summary.where, "platform.pitch");
}

TEST(StabilizingPlatformClosedForm, ReportsTimeLimbAndAmountOfAPoseOutOfReach) {
  Motion motion = SeaStateMotion();
  motion.commands[motion.FindCommand("heave")].profile = {{SineTerm{4, 1.0 / 6, 0}}};
  const auto closed_form = Make(Names(), motion);
  const ClosedFormRun run = RunClosedForm(Names(), motion, closed_form.get());
  EXPECT_EQ(run.summary.stop, Stop::kSingular);
  EXPECT_EQ(run.summary.where.substr(0, 4), "limb");
  EXPECT_GT(run.summary.time_s, 0);
  EXPECT_LT(run.summary.time_s, 1.5);
  EXPECT_GT(run.summary.amount, 0);
  EXPECT_EQ(run.summary.unit, "m");
}

TEST(StabilizingPlatformClosedForm, PrintedSignInMChangesTheForces) {
  const Motion motion = SeaStateMotion();
  const auto right = Make(Names(), motion);
  const auto printed = Make(Names(), motion, {.model = "", .as_printed = {"E2"}});
  double difference = 0;
  for (double t : {0.5, 1.7, 3.9, 5.1}) {
    const ClosedFormSample a = SampleAt(motion, t, right.get());
    const ClosedFormSample b = SampleAt(motion, t, printed.get());
    difference = std::max(difference, (a.force - b.force).cwiseAbs().maxCoeff());
  }
  EXPECT_GT(difference, 100);  // N: no agreement check may miss it
}

class ShippedModel : public testing::Test {
 protected:
  void SetUp() override {
    LoadResult loaded = LoadModel(SourcePath("/models/stabilizing_platform/model.yaml"));
    ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
    mechanism_ = std::move(*loaded.mechanism);
  }

  Mechanism mechanism_;
};

TEST_F(ShippedModel, HasTheParametersOfTheFixture) {
  for (const auto& [name, value] : DefaultParameters()) {
    EXPECT_NEAR(mechanism_.ParameterValue(name), value, 4 * kEps * std::abs(value)) << name;
  }
}

TEST_F(ShippedModel, HasReactionChannelsOfEveryLimbJoint) {
  const Motion motion = SeaStateMotion(mechanism_);
  const auto closed_form = Make(mechanism_, motion);
  ASSERT_NE(closed_form, nullptr);
  std::map<std::string, int> per_joint;
  for (const Channel& channel : closed_form->extra_channels()) {
    const auto at = channel.name.find(".reaction.");
    if (at != std::string::npos) ++per_joint[channel.name.substr(0, at)];
  }
  EXPECT_EQ(per_joint.size(), 18u);
  for (const auto& [joint, components] : per_joint) {
    const bool moments =
        joint.find("U1") != std::string::npos || joint.find("R12") != std::string::npos;
    EXPECT_EQ(components, moments ? 5 : 3) << joint;
  }
}

TEST_F(ShippedModel, GivesTheReactionsAtRestInTheJointsFrames) {
  Motion motion = SeaStateMotion(mechanism_);
  const auto closed_form = Make(mechanism_, motion);
  ASSERT_NE(closed_form, nullptr);
  for (int k = 0; k < 3; ++k) motion.commands[k].profile = Constant(0);
  const ClosedFormSample sample = SampleAt(motion, 0, closed_form.get());
  // Frame F of U1 is upright, {A_1} leans by λ about Y: f = Ry(λ) f_A. F of R12 has y along link 1.
  const double tilt = -2.098448566 * kDegree, q1 = 0.432001041535;
  const Vec3 foot(476.552, -173326.127, -100116.457), elbow(-135.276, -125229.313, 89074.109);
  auto value = [&](const char* name) { return Extra(*closed_form, sample, name); };
  const double limit = 1e-3 * 1.5;  // three decimals, rotated
  EXPECT_NEAR(value("limb1.U1.reaction.fx"), std::cos(tilt) * foot.x() + std::sin(tilt) * foot.z(),
              limit);
  EXPECT_NEAR(value("limb1.U1.reaction.fy"), foot.y(), limit);
  EXPECT_NEAR(value("limb1.U1.reaction.fz"), -std::sin(tilt) * foot.x() + std::cos(tilt) * foot.z(),
              limit);
  EXPECT_NEAR(value("limb1.U1.reaction.mx"), std::sin(tilt) * -1246.791, limit);
  EXPECT_NEAR(value("limb1.U1.reaction.mz"), std::cos(tilt) * -1246.791, limit);
  EXPECT_NEAR(value("limb1.R12.reaction.fx"), elbow.x(), limit);
  EXPECT_NEAR(value("limb1.R12.reaction.fy"), std::cos(q1) * elbow.y() + std::sin(q1) * elbow.z(),
              limit);
  EXPECT_NEAR(value("limb1.R12.reaction.fz"), -std::sin(q1) * elbow.y() + std::cos(q1) * elbow.z(),
              limit);
  EXPECT_NEAR(value("limb1.R12.reaction.my"), std::cos(q1) * -342.932 + std::sin(q1) * -502.977,
              limit);
  // The ball carries the limb's force on the platform: frame F on link 2.
  const double q2 = 2.543182675966;
  EXPECT_NEAR(value("limb1.S.reaction.fx"), -814.000, limit);
  EXPECT_NEAR(value("limb1.S.reaction.fy"), std::sin(q2) * 163472.766, limit);
  EXPECT_NEAR(value("limb1.S.reaction.fz"), std::cos(q2) * 163472.766, limit);
}

}  // namespace
}  // namespace mbv::stabilizing_platform
