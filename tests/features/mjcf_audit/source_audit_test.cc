// The audit of the user's own MJCF: what it finds is planted here.
#include "report/source_model_report.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "features/mjcf_audit/source_audit.h"
#include "features/run/default_setup.h"
#include "simulation/mjcf/foreign.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

struct Barwork {
  std::string head = {};   // options and defaults
  std::string base = {};   // joint of the base
  std::string joint = {};  // attributes of the crank's
  std::string closure = R"(<connect name="C" body1="rocker" body2="coupler" anchor="0 0 0.4"/>)";
  std::string actuator = R"(<motor name="m" joint="A"/>)";
  double coupler_kg = 1.0;
};

// A four-bar linkage of sides 0.2, 0.6, 0.4, 0.5 m whose coupler's end runs on another curve than a
// parallelogram's; its loop is closed at zero.
std::string Text(const Barwork& b) {
  return fmt::format(R"(<mujoco model="bars"><compiler angle="radian"/>{}<worldbody>
<body name="base">{}<inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
<body name="crank"><joint name="A" axis="0 1 0" {}/><inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.001"/>
<body name="coupler" pos="0 0 0.2"><joint name="B" axis="0 1 0"/>
<inertial pos="0.25 0 0.1" mass="{}" diaginertia="0.001 0.02 0.02"/></body></body>
<body name="rocker" pos="0.5 0 0"><joint name="D" axis="0 1 0"/>
<inertial pos="0 0 0.2" mass="1" diaginertia="0.01 0.01 0.001"/></body></body></worldbody>
<equality>{}</equality><actuator>{}</actuator></mujoco>
)",
                     b.head, b.base, b.joint, b.coupler_kg, b.closure, b.actuator);
}

const char* const kStiff =
    R"(<default><equality solref="0.004 1" solimp="0.9999 0.9999 0.001 0.5 2"/></default>)";
const char* const kSoft =
    R"(<default><equality solref="0.06 1" solimp="0.5 0.5 0.001 0.5 2"/></default>)";

class SourceModelAudits : public testing::Test {
 protected:
  // `run`: another text that is run in place of the one that the reference computes. `height`: of
  // the drive's bump.
  SourceModelAudit Audit(const std::string& text, const std::string& run = "",
                         const std::string& height = "") {
    const std::string file = folder_.Write("robot.xml", text);
    const DefaultSetupResult made = MakeDefaultSetup(file, "", "./model.yaml");
    EXPECT_TRUE(made.setup) << made.diagnostics.Text();
    if (!made.setup) return {};
    folder_.Write("model.yaml", made.setup->model);
    std::string scenario = made.setup->scenario;
    if (const size_t at = scenario.find("height: "); !height.empty() && at != std::string::npos) {
      scenario.replace(at, scenario.find('}', at) - at, "height: " + height);
    }
    Diagnostics diagnostics;
    const auto prepared = Prepare(folder_.Write("first.yaml", scenario), {}, &diagnostics);
    EXPECT_TRUE(prepared) << diagnostics.Text();
    if (!prepared) return {};
    return AuditSourceModel({.file = file, .text = run, .prepared = &*prepared});
  }
  static const SourceModelCause* Find(const SourceModelAudit& audit, const std::string& key) {
    for (const SourceModelCause& cause : audit.causes) {
      if (cause.key == key) return &cause;
    }
    return nullptr;
  }
  using Keys = std::vector<std::string>;
  static Keys Named(const SourceModelAudit& audit) {
    Keys keys;
    for (const SourceModelCause* cause : audit.Culprits()) keys.push_back(cause->key);
    return keys.empty() ? Keys{""} : keys;
  }
  static bool Reported(const std::vector<std::string>& lines, const std::string& text) {
    for (const std::string& line : lines) {
      if (line.find(text) != std::string::npos) return true;
    }
    return false;
  }

  const test::TestFolder folder_{std::string("source_model_") +
                                 testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(SourceModelAudits, InWhichNothingIsWrongIsReportedSo) {
  const SourceModelAudit audit =
      Audit(Text({.head = std::string("<option timestep='0.0005' integrator='RK4'/>") + kStiff}));
  ASSERT_TRUE(audit.not_run.empty()) << audit.not_run;
  EXPECT_TRUE(audit.Good(audit.as_is)) << audit.as_is.failure << audit.as_is.force;
  EXPECT_LT(audit.as_is.force, 1e-3);
  EXPECT_LT(audit.as_is.joint_force, 1e-3);  // sign and frame of the closures' forces are right
  EXPECT_FALSE(audit.searched);
  EXPECT_NE(SourceModelSentence(audit).find("nothing is wrong"), std::string::npos);
  EXPECT_EQ(audit.integrator, "RK4");
}

TEST_F(SourceModelAudits, SoftLoopsOpenAreNamedAndCorrectedByTheLines) {
  const std::string text = Text({.head = kSoft});
  const SourceModelAudit audit = Audit(text);
  ASSERT_TRUE(audit.as_is.sound()) << audit.as_is.failure;
  EXPECT_GT(audit.as_is.gap_m, 1e-3);
  EXPECT_EQ(audit.as_is.joint, "C");
  EXPECT_GT(audit.as_is.force, 0.01);
  EXPECT_EQ(Named(audit), Keys{"softness"});
  EXPECT_GT(Removed(audit.as_is.force, Find(audit, "softness")->without.force), 0.8);
  EXPECT_LT(audit.corrected.force, 1e-3);
  // The lines in the file give what the table promises: here, and to whom pastes them.
  ASSERT_GT(audit.recommended, 0);
  const SourceModelError& promised = audit.trials[static_cast<size_t>(audit.recommended)].error;
  EXPECT_TRUE(audit.Good(promised)) << promised.force << " " << promised.gap_m;
  EXPECT_TRUE(audit.stubborn.empty());
  EXPECT_NEAR(audit.pasted.force, promised.force, 1e-9 * promised.force);
  const SourceModelAudit pasted = Audit(mjcf::WithLines(text, audit.lines));
  EXPECT_NEAR(pasted.as_is.force, promised.force, 1e-9 * promised.force) << audit.lines;
  EXPECT_NEAR(pasted.as_is.gap_m, promised.gap_m, 1e-9 * promised.gap_m);
  EXPECT_TRUE(pasted.Good(pasted.as_is));
  EXPECT_NEAR(audit.pasted_as_is.force, pasted.as_is.force, 1e-9 * promised.force);
  EXPECT_NEAR(audit.pasted_as_is.gap_m, pasted.as_is.gap_m, 1e-9 * promised.gap_m);
}

// The lines cannot make a servo follow: what a user gets is another number than what they promise.
TEST_F(SourceModelAudits, TheLinesAreRunWithTheFilesOwnServosToo) {
  const std::string text =
      Text({.head = kSoft,
            .actuator = R"(<position name="m" joint="A" kp="400"/><velocity joint="A" kv="20"/>)"});
  const SourceModelAudit audit = Audit(text);
  ASSERT_GT(audit.recommended, 0);
  const SourceModelAudit pasted = Audit(mjcf::WithLines(text, audit.lines));
  EXPECT_NEAR(audit.pasted_as_is.force, pasted.as_is.force, 1e-9 * pasted.as_is.force);
  EXPECT_GT(audit.pasted_as_is.force, 2.0 * audit.pasted.force);
}

TEST_F(SourceModelAudits, ClosuresWithSettingsOfTheirOwnAreNamed) {
  const SourceModelAudit audit = Audit(Text(
      {.closure =
           R"(<connect name="C" body1="rocker" body2="coupler" anchor="0 0 0.4" solref="0.06 1" solimp="0.5 0.5 0.001 0.5 2"/>)"}));
  ASSERT_GT(audit.recommended, 0);
  EXPECT_EQ(audit.stubborn, std::vector<std::string>{"C"});
  const SourceModelError& promised = audit.trials[static_cast<size_t>(audit.recommended)].error;
  EXPECT_NEAR(audit.pasted.force, promised.force, 1e-9 * promised.force);
}

// Fast, with a stiff impedance: what is left out is the pull on the curve.
TEST_F(SourceModelAudits, ThePullOnTheCurveIsNamed) {
  const std::string stiff_but_slow =
      R"(<default><equality solref="0.04 1" solimp="0.9999 0.9999 0.001 0.5 2"/></default>)";
  const SourceModelAudit audit = Audit(Text({.head = stiff_but_slow}), "", "0.8");
  ASSERT_TRUE(audit.as_is.sound()) << audit.as_is.failure;
  const SourceModelCause* pull = Find(audit, "velocity_term");
  ASSERT_NE(pull, nullptr);
  EXPECT_EQ(Named(audit)[0], "velocity_term");
  EXPECT_GT(audit.as_is.force, 0.01);
  EXPECT_GT(Removed(audit.as_is.force, pull->without.force), 0.9);
  EXPECT_GT(Removed(audit.as_is.gap_m, pull->without.gap_m), 0.9);
}

TEST_F(SourceModelAudits, ServosThatLagAreNamedAndNoSettingIsBlamed) {
  const SourceModelAudit audit = Audit(Text(
      {.head = kStiff,
       .actuator = R"(<position name="m" joint="A" kp="400"/><velocity joint="A" kv="20"/>)"}));
  ASSERT_TRUE(audit.as_is.sound()) << audit.as_is.failure;
  EXPECT_TRUE(Reported(audit.done, "m: driven by the file's own position servos"));
  EXPECT_GT(audit.as_is.force, 0.01);
  EXPECT_EQ(Named(audit), Keys{"drives"});
  EXPECT_FALSE(audit.searched);
  EXPECT_TRUE(audit.Good(audit.bare));
}

TEST_F(SourceModelAudits, WhatCutsAServosCommandOrForceIsReported) {
  const auto servo = [](const char* range) {
    return Text({.head = kStiff,
                 .actuator = fmt::format(R"(<position name="m" joint="A" kp="400" {}/>)", range)});
  };
  EXPECT_TRUE(Reported(Audit(servo("ctrllimited='true' ctrlrange='-0.05 0.05'")).notes,
                       "ctrlrange cuts its command, first at 0."));
  EXPECT_TRUE(Reported(Audit(servo("forcelimited='true' forcerange='-0.5 0.5'")).notes,
                       "as its forcerange allows, first at 0"));
  EXPECT_TRUE(Audit(servo("")).notes.empty());
}

// MuJoCo 2.2 drops `kv`; run as it is, the servo has it.
TEST_F(SourceModelAudits, ADampedServoKeepsItsDamping) {
  const auto servo = [](const char* kv) {
    return Text({.head = kStiff,
                 .actuator = fmt::format(R"(<position name="m" joint="A" kp="400" {}/>)", kv)});
  };
  const SourceModelAudit damped = Audit(servo("kv='40'")), plain = Audit(servo(""));
  EXPECT_TRUE(Reported(damped.done, "kv is taken over"));
  EXPECT_FALSE(Reported(plain.done, "kv is taken over"));
  // A servo that brakes lags more.
  EXPECT_GT(damped.as_is.force, 2.0 * plain.as_is.force);
}

TEST_F(SourceModelAudits, AnEqualityThatHoldsTheDriveLeadsIt) {
  const std::string holds = R"(<joint name="hold" joint1="A" polycoef="0 1 0 0 0"/>)";
  Barwork bars{.head = kStiff};
  bars.closure += holds;
  const SourceModelAudit audit = Audit(Text(bars));
  ASSERT_TRUE(audit.as_is.sound()) << audit.as_is.failure;
  EXPECT_TRUE(Reported(audit.done, "m: driven by the file's own equality"));
  EXPECT_NE(Find(audit, "drives"), nullptr);
  EXPECT_LT(audit.corrected.force, 1e-3);
}

TEST_F(SourceModelAudits, WhatTheReferenceDoesNotHaveIsNotAFaultOfTheFile) {
  const SourceModelAudit audit =
      Audit(Text({.head = std::string("<option density='2000'/>") + kStiff}));
  EXPECT_EQ(Named(audit), Keys{"left_out"});
  ASSERT_NE(Find(audit, "left_out"), nullptr);
  EXPECT_NE(Find(audit, "left_out")->title.find("the medium's density"), std::string::npos);
  EXPECT_FALSE(audit.searched);
}

// Dry friction is in the reference, too; MuJoCo's gives way before it slides.
TEST_F(SourceModelAudits, FrictionLossIsJudgedOutsideTheBandThatRestLeaves) {
  const SourceModelAudit audit = Audit(Text({.head = kStiff, .joint = "frictionloss='0.3'"}));
  EXPECT_EQ(Find(audit, "left_out"), nullptr);
  ASSERT_NE(Find(audit, "friction"), nullptr);
  EXPECT_LT(audit.corrected.force, 1e-3);
  EXPECT_GT(audit.as_is.force, 1e-3);
}

// Damping, armature and springs of hinges are in the reference as well.
TEST_F(SourceModelAudits, ForceElementsAreNotLeftOut) {
  const SourceModelAudit audit =
      Audit(Text({.head = kStiff, .joint = "damping='1' armature='0.2' stiffness='3'"}));
  EXPECT_EQ(Find(audit, "left_out"), nullptr);
  EXPECT_LT(audit.corrected.force, 1e-3);
}

TEST_F(SourceModelAudits, AFreeBaseIsHeldAsIfItWereFixed) {
  const SourceModelAudit fixed = Audit(Text({.head = kStiff}));
  const SourceModelAudit free = Audit(Text({.head = kStiff, .base = "<freejoint/>"}));
  ASSERT_TRUE(free.as_is.sound()) << free.as_is.failure;
  EXPECT_TRUE(Reported(free.done, "free bodies are held where they are"));
  EXPECT_NEAR(free.as_is.force, fixed.as_is.force, 1e-2 * fixed.as_is.force);
  EXPECT_LT(free.corrected.force, 1e-3);
}

TEST_F(SourceModelAudits, AWeldThatTwistsIsMeasured) {
  const std::string soft =
      R"(<default><equality solref="0.1 1" solimp="0.3 0.3 0.001 0.5 2"/></default>)";
  const auto text = [](const std::string& head) {
    return R"(<mujoco model="w"><compiler angle="radian"/>)" + head + R"(<worldbody>
<body name="a"><joint name="A" axis="0 1 0"/><inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
<body name="b" pos="0 0 0.5"><joint name="B" axis="0 1 0"/><inertial pos="0.3 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
<body name="c" pos="0.5 0 0"><joint name="C" axis="0 1 0"/><inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.01"/></body></body></body>
<body name="d" pos="0.5 0 0"><joint name="D" axis="0 1 0"/><inertial pos="0.2 0 0.2" mass="1" diaginertia="0.01 0.01 0.01"/></body>
</worldbody><equality><weld name="W" body1="c" body2="d"/></equality>
<actuator><motor name="m" joint="A"/></actuator></mujoco>)";
  };
  const SourceModelAudit loose = Audit(text(soft)), tight = Audit(text(kStiff));
  ASSERT_TRUE(loose.as_is.sound()) << loose.as_is.failure;
  EXPECT_GT(loose.as_is.gap_rad, 1e-3);
  EXPECT_EQ(loose.as_is.twisted, "W");
  EXPECT_EQ(Named(loose), Keys{"softness"});
  EXPECT_LT(tight.as_is.gap_rad, 1e-4);
  EXPECT_TRUE(tight.Good(tight.as_is)) << tight.as_is.force;
  EXPECT_LT(tight.as_is.joint_force, 1e-2);
}

// Another mass is no matter of settings: it stays when all is corrected, and is reported.
TEST_F(SourceModelAudits, AFileOfAnotherMechanismIsNotBlamedOnItsSettings) {
  const std::string right = Text({.head = kStiff});
  const SourceModelAudit audit = Audit(right, Text({.head = kStiff, .coupler_kg = 1.05}));
  const SourceModelAudit same = Audit(right, right);
  EXPECT_LT(same.corrected.force, 1e-3);
  EXPECT_GT(audit.corrected.force, 0.01);
  EXPECT_GT(audit.as_is.force, 0.01);
  EXPECT_EQ(Named(audit), Keys{""});
}

TEST_F(SourceModelAudits, ThatDivergesGivesATimeAndNoNumbers) {
  const SourceModelAudit audit =
      Audit(Text({.head = "<option timestep='0.05'/>",
                  .actuator = R"(<position name="m" joint="A" kp="1e7"/>)"}));
  EXPECT_FALSE(audit.as_is.sound());
  EXPECT_GE(audit.as_is.time_s, 0.0);
  EXPECT_TRUE(std::isnan(audit.as_is.force));
  // The recommended step is another one, and with it the samples of the file with its lines.
  ASSERT_GE(audit.recommended, 0);
  const SourceModelError& promised = audit.trials[static_cast<size_t>(audit.recommended)].error;
  EXPECT_NE(audit.trials[static_cast<size_t>(audit.recommended)].step_s, 0.05);
  EXPECT_GT(promised.joint_force, 0.0);
  EXPECT_NEAR(audit.pasted.joint_force, promised.joint_force, 1e-3 * promised.joint_force);
  EXPECT_NEAR(audit.pasted.force, promised.force, 1e-3 * promised.force);
  EXPECT_NE(SourceModelSentence(audit).find("no forces that could be compared"), std::string::npos)
      << SourceModelSentence(audit);
}

TEST_F(SourceModelAudits, FrictionOfContactsIsNotAMatterHere) {
  const SourceModelAudit audit = Audit(Text({.head = kSoft}));
  bool found = false;
  for (const SourceModelTrial& trial : audit.trials) {
    if (trial.other != "impratio 10") continue;
    found = true;
    EXPECT_EQ(trial.error.force, audit.trials[0].error.force);
  }
  EXPECT_TRUE(found);
}

TEST_F(SourceModelAudits, ADriveWithoutANameForItsJointIsNotAudited) {
  std::string text = Text({.actuator = ""});
  for (const char* name : {R"(name="A" )", R"(name="B" )", R"(name="D" )"}) {
    text.erase(text.find(name), std::string(name).size());
  }
  const SourceModelAudit audit = Audit(text);
  EXPECT_NE(audit.not_run.find("has no name in the file"), std::string::npos) << audit.not_run;
}

}  // namespace
}  // namespace mbv
