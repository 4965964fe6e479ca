#include "model_file/urdf/urdf_import.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "kinematics/mobility.h"
#include "math/spatial.h"
#include "model_file/element_text.h"
#include "model_file/load_model.h"
#include "model_file/urdf/urdf_closures.h"
#include "model_file/write_model.h"
#include "tests/mechanisms/four_bar.h"
#include "tests/support/shipped.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

using std::numbers::pi;

constexpr double kUrdfRoundoff = 64 * kEps;

UrdfTree MustRead(const std::string& text) {
  Diagnostics diagnostics;
  UrdfTree tree = ReadUrdf(text, "r.urdf", &diagnostics);
  EXPECT_EQ(diagnostics.Text(), "");
  return tree;
}

std::string Findings(const std::string& text) {
  Diagnostics diagnostics;
  (void)ReadUrdf(text, "r.urdf", &diagnostics);
  return diagnostics.Text();
}

std::string Robot(const std::string& content) {
  return "<robot name=\"r\"><link name=\"world\"/>" + content + "</robot>";
}

TEST(UrdfConventions, RpyIsYawAfterPitchAfterRollAndTheAxisIsInTheJointFrame) {
  const UrdfTree tree = MustRead(
      Robot("<link name=\"a\"/><joint name=\"j\" type=\"continuous\"><parent link=\"world\"/>"
            "<child link=\"a\"/><origin xyz=\"1 2 3\" rpy=\"0.1 0.2 0.3\"/><axis xyz=\"0 2 "
            "0\"/></joint>"));
  ASSERT_EQ(tree.joints.size(), 1u);
  const Joint& joint = tree.joints[0];
  EXPECT_EQ(joint.kind, JointKind::kRevolute);
  EXPECT_EQ(joint.parent, -1);
  EXPECT_EQ(joint.X_PF.translation(), Vec3(1, 2, 3));
  EXPECT_LT((joint.X_PF.linear() - RotRpy({0.1, 0.2, 0.3})).norm(), kUrdfRoundoff);
  EXPECT_EQ(joint.axis, Vec3::UnitY());                // made a unit vector, not turned by rpy
  EXPECT_TRUE(joint.X_CM.isApprox(Pose::Identity()));  // the link frame is the joint frame
  EXPECT_FALSE(std::isfinite(joint.range[0].upper));
}

TEST(UrdfConventions, AnUndefinedParentWorldIsTheWorld) {
  const auto robot = [](const std::string& parent) {
    return "<robot name=\"r\"><link name=\"a\"/><joint name=\"weld\" type=\"fixed\"><parent "
           "link=\"" +
           parent + "\"/><child link=\"a\"/><origin xyz=\"1 2 3\"/></joint></robot>";
  };
  Diagnostics diagnostics;
  const UrdfTree tree = ReadUrdf(robot("world"), "r.urdf", &diagnostics);
  EXPECT_EQ(diagnostics.Text(),
            "r.urdf: warning: the parent link 'world' of joint 'weld' is not in the file: taken as "
            "the world\n");
  ASSERT_EQ(tree.joints.size(), 1u);
  EXPECT_EQ(tree.joints[0].parent, -1);
  EXPECT_EQ(tree.joints[0].X_PF.translation(), Vec3(1, 2, 3));
  EXPECT_NE(Findings(robot("floor")).find("error"), std::string::npos);
}

TEST(UrdfConventions, TheDefaultAxisIsX) {
  const UrdfTree tree = MustRead(
      Robot("<link name=\"a\"/><joint name=\"j\" type=\"continuous\"><parent link=\"world\"/>"
            "<child link=\"a\"/></joint>"));
  EXPECT_EQ(tree.joints.at(0).axis, Vec3::UnitX());
}

TEST(UrdfConventions, InertiaIsAboutTheCentreOfMassInTheAxesOfItsOrigin) {
  const UrdfTree tree = MustRead(Robot(
      "<link name=\"a\"><inertial><origin xyz=\"1 0 0\" rpy=\"0 0 1.5707963267948966\"/>"
      "<mass value=\"2\"/><inertia ixx=\"1\" ixy=\"0.1\" ixz=\"0.2\" iyy=\"3\" iyz=\"0.3\" "
      "izz=\"3.5\"/></inertial></link><joint name=\"j\" type=\"fixed\"><parent link=\"world\"/>"
      "<child link=\"a\"/></joint>"));
  const Body& body = tree.bodies.at(0);
  EXPECT_EQ(body.mass, 2.0);
  EXPECT_EQ(body.p_BoBcm_B, Vec3(1, 0, 0));
  // Turned by 90° about z: x of the inertia frame is y of the link, y is -x.
  Mat3 expected;
  expected << 3, -0.1, -0.3, -0.1, 1, 0.2, -0.3, 0.2, 3.5;
  EXPECT_LT((body.I_Bcm_B - expected).norm(), kUrdfRoundoff) << body.I_Bcm_B;
}

TEST(UrdfConventions, LimitsAndMimicAreRead) {
  const std::string text = Robot(
      "<link name=\"a\"/><link name=\"b\"/>"
      "<joint name=\"j\" type=\"prismatic\"><parent link=\"world\"/><child link=\"a\"/>"
      "<axis xyz=\"0 0 1\"/><limit lower=\"-0.1\" upper=\"0.4\" effort=\"1\" "
      "velocity=\"1\"/></joint>"
      "<joint name=\"k\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/>"
      "<limit effort=\"1\" velocity=\"1\"/><mimic joint=\"j\" multiplier=\"-2\" "
      "offset=\"0.25\"/></joint>");
  const UrdfTree tree = MustRead(text);
  ASSERT_EQ(tree.mimics.size(), 1u);
  EXPECT_EQ(tree.mimics[0].joint, "k");
  EXPECT_EQ(tree.mimics[0].of, "j");
  EXPECT_EQ(tree.mimics[0].multiplier, -2.0);
  EXPECT_EQ(tree.mimics[0].offset, 0.25);
  EXPECT_EQ(tree.joints.at(0).range[0].lower, -0.1);
  EXPECT_EQ(tree.joints.at(0).range[0].upper, 0.4);
  // lower = upper = 0 is urdfdom's word for "not given".
  EXPECT_FALSE(std::isfinite(tree.joints.at(1).range[0].upper));
}

TEST(UrdfConventions, AMimicThatMeansNothingIsAFinding) {
  const auto robot = [](const std::string& mimic) {
    return Robot(
        "<link name=\"a\"/><link name=\"b\"/>\n"
        "<joint name=\"hip\" type=\"continuous\"><parent link=\"world\"/><child "
        "link=\"a\"/></joint>\n"
        "<joint name=\"knee\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/>" +
        mimic + "</joint>");
  };
  EXPECT_EQ(Findings(robot("<mimic joint=\"hipp\"/>")),
            "r.urdf:3:1: error: joint 'knee': mimic of 'hipp', which is not a joint with one "
            "coordinate\n  hint: did you mean 'hip'?\n");
  EXPECT_EQ(Findings(robot("<mimic joint=\"knee\"/>")),
            "r.urdf:3:1: error: joint 'knee': mimic of 'knee', itself\n");
  EXPECT_EQ(Findings(robot("<mimic joint=\"hip\" multiplier=\"0\"/>")),
            "r.urdf:3:1: error: joint 'knee': mimic of 'hip': multiplier 0 and offset 0 couple "
            "nothing\n");
}

TEST(UrdfImport, WhatIsDroppedAndChangesForcesIsAFindingEach) {
  const auto joint = [](const std::string& name, const std::string& inner) {
    return "<link name=\"" + name + "_link\"/>\n<joint name=\"" + name +
           "\" type=\"continuous\"><parent link=\"world\"/><child link=\"" + name + "_link\"/>" +
           inner + "</joint>\n";
  };
  const std::string text = Robot(
      "\n" + joint("a", "<dynamics damping=\"0.5\"/>") +
      joint("b", "<dynamics friction=\"-0.1\"/>") +
      joint("c", "<dynamics damping=\"2\" friction=\"-0.2\"/>") +
      joint("d", "<dynamics damping=\"0\" friction=\"0\"/>") +
      "<transmission name=\"t1\"><joint name=\"a\"/><actuator name=\"m\">"
      "<mechanicalReduction>50</mechanicalReduction></actuator></transmission>\n"
      "<transmission name=\"t2\"><joint name=\"b\"><mechanicalReduction>-1"
      "</mechanicalReduction></joint></transmission>\n"
      "<transmission name=\"t3\"><mechanicalReduction>1.0</mechanicalReduction></transmission>\n");
  Diagnostics diagnostics;
  (void)ReadUrdf(text, "r.urdf", &diagnostics);
  const std::string said = diagnostics.Text();
  for (const char* part :
       {"r.urdf:5:1: warning: friction in 2 joints is left out: b (-0.1), c (-0.2)\n"
        "  hint: drive forces are computed without it\n",
        "r.urdf:10:1: warning: transmission 't1': the reduction 50 is left out\n"
        "  hint: positions and forces are those of the joint, not of the motor\n",
        "r.urdf:11:1: warning: transmission 't2': the reduction -1 is left out\n"}) {
    EXPECT_NE(said.find(part), std::string::npos) << part << said;
  }
  EXPECT_EQ(diagnostics.findings().size(), 3u) << said;
}

// A link on a hinge with more in it, below it and below <robot>.
std::string Extended(const std::string& in_joint, const std::string& more) {
  return "<robot name=\"r\"><link name=\"base\"/><link name=\"arm\"><inertial><mass value=\"1\"/>"
         "<inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
         "<joint name=\"j\" type=\"continuous\"><parent link=\"base\"/><child link=\"arm\"/>"
         "<axis xyz=\"0 1 0\"/>" +
         in_joint + "</joint>" + more + "</robot>";
}

// What is not positive or very large says nothing.
TEST(UrdfImport, LimitsOfEffortAndVelocityAreMotors) {
  const double none = Motor::kNoLimit;
  struct Case {
    std::string limit;
    double peak, speed;
  };
  for (const Case& c : {Case{"effort=\"12\" velocity=\"3.5\"", 12, 3.5},
                        Case{"effort=\"0\" velocity=\"3.5\"", none, 3.5},
                        Case{"effort=\"12\" velocity=\"1e30\"", 12, none},
                        Case{"effort=\"0\" velocity=\"0\"", none, none}}) {
    for (const bool driven : {false, true}) {
      const test::TestFolder folder("urdf_limits");
      const LoadResult loaded = LoadModel(folder.Write(
          "r.urdf",
          Extended("<limit " + c.limit + "/>",
                   driven ? "<transmission name=\"t\"><joint name=\"j\"/></transmission>" : "")));
      ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
      const bool any = std::isfinite(c.peak) || std::isfinite(c.speed);
      ASSERT_EQ(loaded.motors_of_joints.size(), any ? 1u : 0u) << c.limit;
      ASSERT_EQ(loaded.mechanism->motors.size(), any && driven ? 1u : 0u) << c.limit;
      if (!any) continue;
      const Motor& motor = loaded.motors_of_joints.at("j");
      EXPECT_EQ(motor.peak, c.peak);
      EXPECT_EQ(motor.max_speed, c.speed);
      EXPECT_TRUE(motor.turns);
      if (!driven) continue;
      EXPECT_EQ(loaded.mechanism->motors[0].drive, 0);
    }
  }
}

// Each row in a file in which it acts, and in one with a value that does nothing.
TEST(UrdfImport, WhatSimulatorsAddAndIsLeftOutIsACaveatUnlessItDoesNothing) {
  for (const internal::UrdfForceRow& row : internal::UrdfForceRows()) {
    const std::string_view section = row.section, value = row.value, neutral = row.neutral;
    const auto element = [&](const std::string& v) {
      if (value.empty()) return fmt::format("<{}/>", row.element);
      if (value == "text") return fmt::format("<{0}>{1}</{0}>", row.element, v);
      // urdfdom wants one of its own words in <dynamics>.
      return fmt::format("<{}{} {}=\"{}\"/>", row.element,
                         section == "joint" ? " damping=\"1\"" : "", row.value, v);
    };
    const auto file = [&](const std::string& inner) {
      if (section == "joint") return Extended(inner, "");
      if (section == row.element || section.empty()) return Extended("", inner);
      const bool in_option = std::string_view(row.element) == "flag";
      return Extended(
          "", fmt::format("<{0} reference=\"arm\">{1}{2}{3}</{0}>", row.section,
                          in_option ? "<option>" : "", inner, in_option ? "</option>" : ""));
    };
    const std::string what = fmt::format("{}/{} {}", row.section, row.element, row.value);
    Diagnostics findings;
    const std::string acts = neutral == "true|1"            ? "false"
                             : neutral == "enable"          ? "disable"
                             : neutral.starts_with("false") ? "true"
                                                            : "3";
    const UrdfTree tree = ReadUrdf(file(element(acts)), "r.urdf", &findings);
    ASSERT_FALSE(findings.has_errors()) << what << findings.Text();
    ASSERT_EQ(tree.left_out.size(), 1u) << what << findings.Text();
    EXPECT_NE(tree.left_out[0].text.find(row.effect), std::string::npos) << what;
    EXPECT_NE(findings.Text().find(tree.left_out[0].text), std::string::npos) << what;
    if (neutral.empty()) continue;
    Diagnostics none;
    const std::string nothing(neutral.substr(0, neutral.find('|')));
    EXPECT_TRUE(ReadUrdf(file(element(nothing)), "r.urdf", &none).left_out.empty())
        << what << none.Text();
  }
}

UrdfTree WithPlugin(const std::string& plugin, Diagnostics* findings) {
  return ReadUrdf(Extended("", "<gazebo reference=\"arm\">" + plugin + "</gazebo>"), "r.urdf",
                  findings);
}

TEST(UrdfImport, PluginsOfGazeboAreCaveatsUnlessTheyOnlyMeasureOrDrive) {
  for (const internal::UrdfPluginRow& row : internal::UrdfPluginRows()) {
    for (const char* form : {"<plugin filename=\"libgazebo_{}.so\" name=\"n\"/>",
                             "<plugin name=\"my_{}\"><camera/></plugin>"}) {
      Diagnostics findings;
      const UrdfTree tree = WithPlugin(fmt::format(fmt::runtime(form), row.part), &findings);
      ASSERT_FALSE(findings.has_errors()) << row.part << findings.Text();
      ASSERT_EQ(tree.left_out.size(), row.effect == nullptr ? 0u : 1u)
          << row.part << findings.Text();
      if (row.effect == nullptr) continue;
      EXPECT_NE(tree.left_out[0].text.find(row.effect), std::string::npos)
          << row.part << tree.left_out[0].text;
      EXPECT_EQ(tree.left_out[0].source, "gazebo/plugin");
    }
  }
  // What is not known may do anything; hyphens and capitals do not matter.
  Diagnostics findings;
  const UrdfTree unknown = WithPlugin("<plugin filename=\"libmine.so\" name=\"m\"/>", &findings);
  ASSERT_EQ(unknown.left_out.size(), 1u);
  EXPECT_EQ(unknown.left_out[0].text,
            "<plugin> libmine.so ('arm') is left out: what it does to forces is not known");
  EXPECT_NE(findings.Text().find("r.urdf:1:"), std::string::npos) << findings.Text();
  EXPECT_EQ(WithPlugin("<plugin/>", &findings).left_out.size(), 1u);
  EXPECT_NE(WithPlugin("<plugin filename=\"GZ-Sim-Hydrodynamics-System\"/>", &findings)
                .left_out.at(0)
                .text.find("a fluid"),
            std::string::npos);
  // A sensor's plugins hand on what it measures.
  EXPECT_TRUE(
      WithPlugin("<sensor name=\"s\" type=\"ray\"><plugin filename=\"libmine.so\"/></sensor>",
                 &findings)
          .left_out.empty());
}

// Rotors of Drake, springs of Gazebo and gravity of MuJoCo are the mechanism's.
TEST(UrdfImport, RotorsSpringsAndGravityOfSimulatorsAreTaken) {
  const test::TestFolder folder("urdf_extras");
  const std::string rotor =
      "<transmission name=\"t\"><joint name=\"j\"/><actuator name=\"a\"><drake:rotor_inertia "
      "value=\"0.01\"/><drake:gear_ratio value=\"100\"/></actuator></transmission>";
  const std::string spring =
      "<gazebo reference=\"j\"><springStiffness>7</springStiffness><springReference>0.2"
      "</springReference></gazebo>";
  const std::string gravity = "<mujoco><option gravity=\"0 0 -1.62\"/></mujoco>";
  const LoadResult loaded =
      LoadModel(folder.Write("r.urdf", Extended("", rotor + spring + gravity)));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_TRUE(loaded.caveats.empty()) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  ASSERT_EQ(m.elements.size(), 2u);
  const auto& law = std::get<SpringLaw>(m.elements[0].law);
  EXPECT_EQ(law.polynomial, std::vector<double>{7});
  EXPECT_EQ(law.free, 0.2);
  EXPECT_DOUBLE_EQ(std::get<RotorLaw>(m.elements[1].law).reflected(), 100.0);
  EXPECT_EQ(m.gravity_W, Vec3(0, 0, -1.62));
  const LoadResult weightless = LoadModel(folder.Write(
      "w.urdf", Extended("", "<mujoco><option><flag gravity=\"disable\"/></option></mujoco>")));
  ASSERT_TRUE(weightless.mechanism) << weightless.diagnostics.Text();
  EXPECT_EQ(weightless.mechanism->gravity_W, Vec3(0, 0, 0));
  // On a joint that there is not, they are a caveat.
  const LoadResult lost = LoadModel(folder.Write(
      "l.urdf",
      Extended("", "<gazebo reference=\"arm\"><springStiffness>7</springStiffness></gazebo>")));
  EXPECT_EQ(lost.caveats.size(), 1u) << lost.diagnostics.Text();
}

TEST(UrdfImport, FindingsReplaceUrdfdomsTalk) {
  testing::internal::CaptureStderr();
  EXPECT_NE(Findings("<robot").find("r.urdf:1:1: error: the file is not well-formed XML"),
            std::string::npos);
  EXPECT_NE(Findings("").find("error"), std::string::npos);
  EXPECT_NE(Findings("<robot name=\"r\"/>").find("error"), std::string::npos);
  EXPECT_NE(Findings(Robot("<joint name=\"j\" type=\"fixed\"><parent link=\"world\"/>"
                           "<child link=\"absent\"/></joint>"))
                .find("absent"),
            std::string::npos);
  EXPECT_NE(Findings(Robot("<link name=\"a\"/><joint name=\"j\" type=\"continuous\">"
                           "<parent link=\"world\"/><child link=\"a\"/><axis xyz=\"0 0 0\"/>"
                           "</joint>"))
                .find("joint 'j': the axis (0, 0, 0) has no direction"),
            std::string::npos);
  EXPECT_NE(Findings(Robot("<link name=\"a\"><inertial><mass value=\"-1\"/><inertia ixx=\"1\" "
                           "ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>"
                           "<joint name=\"j\" type=\"fixed\"><parent link=\"world\"/>"
                           "<child link=\"a\"/></joint>"))
                .find("mass >= 0"),
            std::string::npos);
  std::string deep = "<robot name=\"r\">";
  for (int i = 0; i < 100'000; ++i) deep += "<link>";
  EXPECT_NE(Findings(deep).find("nested deeper"), std::string::npos);
  EXPECT_NE(Findings(std::string("\x00\x01", 2)).find("UTF-8"), std::string::npos);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

// Writes text into the test's folder and gives the path.
std::string WriteFile(const std::string& name, const std::string& text) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "mbv_urdf";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / name) << text;
  return (folder / name).string();
}

// Exports, reads back, and compares masses, centres of mass and inertias at home. A URDF link frame
// is its joint's frame, so that body origins may move; masses may not.
void ExpectRoundTrip(const Mechanism& m) {
  const std::string urdf = m.name + ".urdf";
  WriteFile(urdf, WriteUrdf(m));
  const LoadResult back = LoadModel(WriteFile(m.name + ".yaml", WriteUrdfCompanion(m, urdf)));
  EXPECT_EQ(back.diagnostics.Text(), "");
  ASSERT_TRUE(back.mechanism);
  const Mechanism& n = *back.mechanism;
  double size = 1.0;
  for (const Pose& X : m.X_WB_home) size = std::max(size, X.translation().norm());
  for (size_t a = 0; a < m.bodies.size(); ++a) {
    const int b = n.FindBody(m.bodies[a].name);
    ASSERT_GE(b, 0) << m.bodies[a].name;
    const Body &before = m.bodies[a], &after = n.bodies[b];
    EXPECT_EQ(before.mass, after.mass);
    if (before.mass == 0.0) continue;
    const Pose &X_before = m.X_WB_home[a], &X_after = n.X_WB_home[b];
    EXPECT_LT((X_before * before.p_BoBcm_B - X_after * after.p_BoBcm_B).norm(),
              kUrdfRoundoff * size)
        << before.name;
    const Mat3 I_before = X_before.linear() * before.I_Bcm_B * X_before.linear().transpose();
    const Mat3 I_after = X_after.linear() * after.I_Bcm_B * X_after.linear().transpose();
    EXPECT_LT((I_before - I_after).norm(), kUrdfRoundoff * I_before.norm()) << before.name;
  }
  ASSERT_EQ(m.outputs.size(), n.outputs.size());
  for (size_t i = 0; i < m.outputs.size(); ++i) {
    const Output &before = m.outputs[i], &after = n.outputs[i];
    const Pose X_before = m.X_WB_home[before.body] * before.X_BO;
    const Pose X_after = n.X_WB_home[after.body] * after.X_BO;
    // Each of the two home solutions has its own rounding.
    EXPECT_LT((X_before.matrix() - X_after.matrix()).norm(), 2 * kUrdfRoundoff * size)
        << before.name;
  }
  const Mobility mobility = AnalyseMobility(m), again = AnalyseMobility(n);
  // URDF has no balls: three hinges each, between which no spin is known to be idle.
  const auto lost = static_cast<int>(mobility.idle_spins.size() - again.idle_spins.size());
  EXPECT_EQ(mobility.dofs + lost, again.dofs);
  EXPECT_EQ(mobility.redundant, again.redundant);
  EXPECT_EQ(again.undriven, mobility.undriven + lost);
  EXPECT_EQ(m.drives.size(), n.drives.size());
}

class ShippedModel : public testing::TestWithParam<std::string> {};

TEST_P(ShippedModel, SurvivesTheRoundTripThroughUrdf) {
  const LoadResult loaded =
      LoadModel(std::string(kSourceDir) + "/models/" + GetParam() + "/model.yaml");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  ExpectRoundTrip(*loaded.mechanism);
}

INSTANTIATE_TEST_SUITE_P(Urdf, ShippedModel, testing::ValuesIn(ShippedModelNames()),
                         [](const auto& name) { return name.param; });

TEST(UrdfImport, DampingAndFrictionOfJointsAreForceElements) {
  const std::string text = Robot(
      "<link name=\"arm\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" "
      "iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>\n<joint name=\"hip\" "
      "type=\"continuous\"><parent link=\"world\"/><child link=\"arm\"/>"
      "<dynamics damping=\"0.5\" friction=\"0.2\"/></joint>\n");
  const LoadResult loaded = LoadModel(WriteFile("damped.urdf", text));
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  ASSERT_EQ(m.elements.size(), 2u);
  const auto& friction = std::get<FrictionLaw>(m.elements[1].law);
  EXPECT_EQ(m.elements[1].name, "hip_friction");
  EXPECT_EQ(m.elements[1].joint, m.FindJoint("hip"));
  EXPECT_EQ(friction.coulomb, 0.2);
  EXPECT_EQ(friction.breakaway, 0.2);
  EXPECT_EQ(m.elements[0].name, "hip_damping");
  EXPECT_EQ(m.elements[0].joint, m.FindJoint("hip"));
  EXPECT_EQ(std::get<DampingLaw>(m.elements[0].law).damping, 0.5);
}

// Damping of tree joints stands in the URDF, all else in the companion.
TEST(UrdfExport, ForceElementsComeBack) {
  LoadResult loaded = LoadModel(SourcePath("/models/friction_five_bar/model.yaml"));
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  const std::string urdf = WriteFile("friction.urdf", WriteUrdf(m));
  EXPECT_NE(WriteUrdf(m).find("<dynamics damping=\"0.03\"/>"), std::string::npos);
  const LoadResult back = LoadModel(WriteFile("friction.yaml", WriteUrdfCompanion(m, urdf)));
  ASSERT_TRUE(back.mechanism.has_value()) << back.diagnostics.Text();
  ASSERT_EQ(back.mechanism->elements.size(), m.elements.size());
  const auto sum = [](const Mechanism& of, auto visit) {
    double total = 0.0;
    for (const ForceElement& element : of.elements) total += visit(of, element);
    return total;
  };
  const auto damping = [](const Mechanism& of, const ForceElement& element) {
    const auto* law = std::get_if<DampingLaw>(&element.law);
    return law == nullptr ? 0.0
                          : law->damping * (of.joints[element.joint].name == "wrist" ? 10 : 1);
  };
  EXPECT_DOUBLE_EQ(sum(*back.mechanism, damping), sum(m, damping));
  for (const ForceElement& element : m.elements) {
    if (std::holds_alternative<DampingLaw>(element.law)) continue;
    const auto same = [&](const ForceElement& other) {
      return other.name == element.name &&
             ElementText(other, back.mechanism->joints[other.joint].name, false) ==
                 ElementText(element, m.joints[element.joint].name, false);
    };
    EXPECT_TRUE(std::ranges::any_of(back.mechanism->elements, same)) << element.name;
  }
}

TEST(UrdfExport, ChainsReversedJointsOffsetFramesAndRangesSurviveTheRoundTrip) {
  // `cut` takes the tree through `ball` backwards: from d to c.
  const LoadResult loaded = LoadModelText(R"(name: chain
bodies:
  a: {mass: 1, inertia: [1, 1, 1], frames: {j: {position: [0.1, 0.2, 0.3], rotation: {rpy_deg: [10, 90, 20]}}}}
  b: {mass: 2, com: [0.1, 0, 0], inertia: {xx: 1, yy: 2, zz: 2.5, xy: 0.1, xz: -0.2, yz: 0.05}, frames: {j: [0, 0, 0.2]}}
  c: {mass: 3, inertia: [1, 1, 1], frames: {j: {rotation: {axis: y, angle: 1}}}}
  d: {mass: 4, inertia: [1, 1, 1]}
  e: {mass: 5, inertia: [1, 1, 1]}
joints:
  pipe: {kind: cylindrical, parent: world, child: a.j, axis: [1, 2, 2], guess: [0.5, 0.3], range: [[0, 1], null]}
  cross: {kind: universal, parent: c.j, child: b.j, axis: y, axis2: x, guess: [0.4, -0.7]}
  ball: {kind: spherical, parent: c.j, child: d, guess: [0.1, 0.2, 0.3]}
  table: {kind: planar, parent: a.j, child: b, axis: y, guess: [0.1, -0.2, 0.6]}
  float: {kind: free, parent: e, child: d, guess: [1, 2, 3, 0.3, 0.2, 0.1]}
outputs: {o: e}
)",
                                          "m.yaml");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  bool any_reversed = false;
  for (const bool reversed : m.tree_reversed) any_reversed = any_reversed || reversed;
  EXPECT_TRUE(any_reversed);
  WriteFile("chain.urdf", WriteUrdf(m));
  const LoadResult back = LoadModel(WriteFile("chain.yaml", WriteUrdfCompanion(m, "chain.urdf")));
  ASSERT_TRUE(back.mechanism) << back.diagnostics.Text();
  for (const Body& body : m.bodies) {
    if (body.mass == 0.0) continue;
    const int a = m.FindBody(body.name), b = back.mechanism->FindBody(body.name);
    const Body& after = back.mechanism->bodies[b];
    EXPECT_LT(
        (m.X_WB_home[a] * body.p_BoBcm_B - back.mechanism->X_WB_home[b] * after.p_BoBcm_B).norm(),
        4 * kUrdfRoundoff)
        << body.name;
  }
  const Joint& slide = back.mechanism->joints[back.mechanism->FindJoint("pipe.slide")];
  EXPECT_EQ(slide.range[0].upper, 1.0);
}

TEST(UrdfExport, ShapesStayWhereTheyAreAndACapsuleBecomesThreeOfThem) {
  const LoadResult loaded = LoadModelText(R"(name: shapes
bodies:
  a:
    frames: {j: {position: [0.1, 0.2, 0.3], rotation: {rpy_deg: [10, 80, 20]}}}
    shapes:
      - {box: {size: [0.1, 0.2, 0.3], at: {position: [1, 2, 3], rotation: {rpy: [0.1, 0.2, 0.3]}}}, color: '#4080c0ff'}
      - {cylinder: {from: [0.1, 0, 0], to: [0.4, 0.4, 0], radius: 0.05}}
      - {capsule: {from: j, to: [0, 0, -1], radius_mm: 9}, color: '#ff0000'}
joints: {pipe: {kind: revolute, parent: world, child: a.j, axis: [1, 2, 2], guess: 0.5}}
)",
                                          "m.yaml");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  WriteFile("shapes.urdf", WriteUrdf(m));
  const LoadResult back = LoadModel(WriteFile("shapes.yaml", WriteUrdfCompanion(m, "shapes.urdf")));
  ASSERT_TRUE(back.mechanism) << back.diagnostics.Text();
  const Mechanism& n = *back.mechanism;
  const auto& after = n.bodies[n.FindBody("a")].shapes;
  ASSERT_EQ(after.size(), 5u);
  const Pose &X_before = m.X_WB_home[1], &X_after = n.X_WB_home[n.FindBody("a")];
  const auto same = [&](const Vec3& before_B, const Vec3& after_B) {
    return (X_before * before_B - X_after * after_B).norm() < 8 * kUrdfRoundoff;
  };
  const auto& shapes = m.bodies[1].shapes;
  const Box &box = std::get<Box>(shapes[0].geometry), &box2 = std::get<Box>(after[0].geometry);
  EXPECT_EQ(box.size, box2.size);
  for (const Vec3& corner : {Vec3(1, 1, 1), Vec3(-1, 1, 2), Vec3(0, 3, -1)}) {
    EXPECT_TRUE(same(box.X_BG * corner, box2.X_BG * corner)) << corner.transpose();
  }
  EXPECT_EQ(after[0].color, "#4080c0ff");
  const auto& rod = std::get<Cylinder>(after[1].geometry);
  EXPECT_TRUE(same(Vec3(0.1, 0, 0), rod.p_from));
  EXPECT_TRUE(same(Vec3(0.4, 0.4, 0), rod.p_to));
  EXPECT_EQ(rod.radius, 0.05);
  EXPECT_EQ(after[1].color, "steel");
  // URDF has no capsules.
  const auto& capsule = std::get<Capsule>(shapes[2].geometry);
  EXPECT_TRUE(same(capsule.p_to, std::get<Cylinder>(after[2].geometry).p_to));
  EXPECT_TRUE(same(capsule.p_from, std::get<Ball>(after[3].geometry).p_centre));
  EXPECT_TRUE(same(capsule.p_to, std::get<Ball>(after[4].geometry).p_centre));
  for (size_t k = 2; k < 5; ++k) EXPECT_EQ(after[k].color, "#ff0000ff") << k;
  EXPECT_EQ(std::get<Ball>(after[4].geometry).radius, 0.009);
}

// What acts on the bodies of a URDF file, and the feet that they stand on.
TEST(UrdfExport, GravityCompensationAndFeetAreInTheCompanion) {
  std::ifstream file(SourcePath("/tests/mechanisms/biped.yaml"));
  std::string text((std::istreambuf_iterator<char>(file)), {});
  const auto put = [&](const std::string& before, const std::string& after) {
    const size_t at = text.find(before);
    ASSERT_NE(at, std::string::npos) << before;
    text.replace(at, before.size(), after);
  };
  put("pelvis: {mass", "pelvis: {gravity_compensation: 0.25, mass");
  put("shank: {mass", "shank: {gravity_compensation: 1.5, mass");
  put("joint: knee}", "joint: knee, gravity_compensation: true}");
  const LoadResult loaded = LoadModelText(text, "biped.yaml");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  ExpectRoundTrip(m);
  const LoadResult back =
      LoadModel(WriteFile("biped.yaml", WriteUrdfCompanion(m, m.name + ".urdf")));
  ASSERT_TRUE(back.mechanism) << back.diagnostics.Text();
  const Mechanism& n = *back.mechanism;
  for (const Body& body : m.bodies) {
    const int b = n.FindBody(body.name);
    ASSERT_GE(b, 0) << body.name;
    EXPECT_EQ(n.bodies[b].gravity_compensation, body.gravity_compensation) << body.name;
  }
  ASSERT_EQ(n.drives.size(), m.drives.size());
  for (size_t d = 0; d < m.drives.size(); ++d) {
    EXPECT_EQ(n.drives[d].compensates_gravity, m.drives[d].compensates_gravity) << d;
  }
  ASSERT_EQ(n.contacts.size(), m.contacts.size());
  for (size_t c = 0; c < m.contacts.size(); ++c) {
    const Contact &before = m.contacts[c], &after = n.contacts[c];
    EXPECT_EQ(after.kind, before.kind);
    EXPECT_EQ(after.friction, before.friction);
    EXPECT_EQ(after.outline, before.outline);
    const auto place = [](const Mechanism& of, const Contact& contact) {
      const Joint& joint = of.joints[static_cast<size_t>(contact.joint)];
      return Pose(of.X_WB_home[static_cast<size_t>(joint.child)] * joint.X_CM);
    };
    EXPECT_TRUE(place(n, after).isApprox(place(m, before), kUrdfRoundoff));
  }
  // A link that is not there is named.
  const LoadResult wrong =
      LoadModel(WriteFile("wrong.yaml", "name: w\nurdf: {file: " + m.name +
                                            ".urdf, gravity_compensation: {pelvs: 1}}\n"));
  EXPECT_NE(wrong.diagnostics.Text().find("did you mean 'pelvis'"), std::string::npos)
      << wrong.diagnostics.Text();
}

TEST(UrdfExport, TheCommentHoldsTheCompanion) {
  const LoadResult loaded = LoadModelText(kFourBar, "m.yaml");
  ASSERT_TRUE(loaded.mechanism);
  const std::string text = WriteUrdf(*loaded.mechanism);
  EXPECT_NE(text.find(WriteUrdfCompanion(*loaded.mechanism, "four_bar.urdf")), std::string::npos);
  EXPECT_NE(text.find("C: {kind: revolute"), std::string::npos);
}

TEST(UrdfKey, AUrdfTreeWithAClosureInTheModelFileIsAClosedMechanism) {
  WriteFile(
      "arms.urdf",
      Robot(
          "<link name=\"crank\"/><link name=\"coupler\"/><link name=\"rocker\"/>"
          "<joint name=\"A\" type=\"continuous\"><parent link=\"world\"/><child link=\"crank\"/>"
          "<axis xyz=\"0 0 1\"/></joint>"
          "<joint name=\"B\" type=\"continuous\"><parent link=\"crank\"/><child link=\"coupler\"/>"
          "<origin xyz=\"0.2 0 0\"/><axis xyz=\"0 0 1\"/></joint>"
          "<joint name=\"D\" type=\"continuous\"><parent link=\"world\"/><child link=\"rocker\"/>"
          "<origin xyz=\"0.5 0 0\"/><axis xyz=\"0 0 1\"/></joint>"));
  const LoadResult loaded = LoadModel(WriteFile("arms.yaml", R"(name: arms
urdf: {file: arms.urdf, guess_deg: {A: 60, B: -60, D: 60}}
attach:
  rocker: {end: [0.2, 0, 0]}
  coupler: {end: [0.5, 0, 0]}
joints:
  C: {kind: revolute, parent: rocker.end, child: coupler.end, axis: z}
drives: {motor: {kind: joint, joint: A}}
)"));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_EQ(AnalyseMobility(*loaded.mechanism).dofs, 1);
  const int coupler = loaded.mechanism->FindBody("coupler");
  EXPECT_LT((loaded.mechanism->X_WB_home[coupler].translation() -
             0.2 * Vec3(std::cos(pi / 3), std::sin(pi / 3), 0))
                .norm(),
            kUrdfRoundoff);
}

TEST(UrdfKey, ARootLinkThatIsNotTheWorldIsFixedToItUnlessAJointCarriesIt) {
  WriteFile("base.urdf", "<robot name=\"r\"><link name=\"base\"/></robot>");
  const LoadResult fixed = LoadModel(WriteFile("fixed.yaml", "name: m\nurdf: base.urdf\n"));
  ASSERT_TRUE(fixed.mechanism) << fixed.diagnostics.Text();
  EXPECT_EQ(fixed.mechanism->joints.at(0).kind, JointKind::kFixed);
  const LoadResult moved = LoadModel(WriteFile(
      "moved.yaml",
      "name: m\nurdf: base.urdf\njoints: {j: {kind: free, parent: world, child: base}}\n"));
  ASSERT_TRUE(moved.mechanism) << moved.diagnostics.Text();
  EXPECT_EQ(moved.mechanism->joints.size(), 1u);
}

TEST(UrdfKey, FindingsNameTheUrdfFile) {
  WriteFile(
      "heavy.urdf",
      Robot("<link name=\"a\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" "
            "iyy=\"1\" iyz=\"0\" izz=\"5\"/></inertial></link><joint name=\"j\" type=\"fixed\">"
            "<parent link=\"world\"/><child link=\"a\"/></joint>"));
  const std::string heavy =
      LoadModel(WriteFile("heavy.yaml", "name: m\nurdf: heavy.urdf\n")).diagnostics.Text();
  EXPECT_NE(heavy.find("heavy.urdf:1: error: link 'a': principal inertias 1, 1, 5 kg m² violate"),
            std::string::npos)
      << heavy;
  const std::string missing =
      LoadModel(WriteFile("missing.yaml", "name: m\nurdf: nothing.urdf\n")).diagnostics.Text();
  EXPECT_NE(missing.find("missing.yaml:2:7: error: urdf = 'nothing.urdf' cannot be read"),
            std::string::npos)
      << missing;
  const std::string guess =
      LoadModel(WriteFile("guess.yaml", "name: m\nurdf: {file: base.urdf, guess: {k: 1}}\n"))
          .diagnostics.Text();
  EXPECT_NE(guess.find("urdf.guess.k: there is no such joint"), std::string::npos) << guess;
}

}  // namespace
}  // namespace mbv
