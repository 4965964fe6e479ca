// Closed loops in URDF files and beside them, by the conventions in use.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "kinematics/mobility.h"
#include "math/spatial.h"
#include "model_file/load_model.h"
#include "model_file/urdf/urdf_import.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

// A four-bar linkage of lengths 0.2, 0.5, 0.4, 0.5 cut at C; `closure` closes it.
std::string FourBarUrdf(const std::string& closure) {
  return R"(<robot name="four_bar">
<link name="world"/><link name="crank"/><link name="coupler"/><link name="rocker"/>
<joint name="A" type="continuous"><parent link="world"/><child link="crank"/><axis xyz="0 0 1"/></joint>
<joint name="B" type="continuous"><parent link="crank"/><child link="coupler"/><origin xyz="0.2 0 0"/><axis xyz="0 0 1"/></joint>
<joint name="D" type="continuous"><parent link="world"/><child link="rocker"/><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/></joint>
)" + closure +
         "</robot>\n";
}

constexpr const char* kConstraint = R"(<constraint name="C" type="revolute">
<parent link="rocker"/><parent_origin xyz="0.4 0 0" rpy="0 0 0"/><parent_axis xyz="0 0 1"/>
<child link="coupler"/><child_origin xyz="0.5 0 0" rpy="0 0 0"/><child_axis xyz="0 0 1"/>
</constraint>
)";

std::string WriteClosureFile(const std::string& name, const std::string& text) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "mbv_urdf_closures";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / name) << text;
  return (folder / name).string();
}

LoadResult LoadFourBar(const std::string& name, const std::string& closure) {
  WriteClosureFile(name + ".urdf", FourBarUrdf(closure));
  return LoadModel(
      WriteClosureFile(name + ".yaml", "name: m\nurdf: {file: " + name +
                                           ".urdf, guess_deg: {A: 60, B: -50, D: 70}}\n"
                                           "drives: {motor: {kind: joint, joint: A}}\n"));
}

// Where C is at home, seen from the rocker and from the coupler.
void ExpectClosed(const LoadResult& loaded, JointKind kind) {
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  const Vec3 on_rocker = m.X_WB_home[m.FindBody("rocker")] * Vec3(0.4, 0, 0);
  const Vec3 on_coupler = m.X_WB_home[m.FindBody("coupler")] * Vec3(0.5, 0, 0);
  EXPECT_LT((on_rocker - on_coupler).norm(), 1e-12);
  EXPECT_EQ(AnalyseMobility(m).dofs, 1);
  EXPECT_EQ(m.joints.at(3).kind, kind);
  EXPECT_TRUE(m.joints.at(3).closure);
}

std::string ClosureFindings(const std::string& closure) {
  Diagnostics diagnostics;
  EXPECT_TRUE(ReadUrdf(FourBarUrdf(closure), "r.urdf", &diagnostics).bodies.empty());
  return diagnostics.Text();
}

TEST(UrdfConstraint, TheProposalForUrdfdomClosesAFourBar) {
  const LoadResult loaded = LoadFourBar("proposal", kConstraint);
  EXPECT_EQ(loaded.diagnostics.Text(), "");
  ExpectClosed(loaded, JointKind::kRevolute);
}

TEST(UrdfConstraint, UrdfPlusLoopsCloseAFourBar) {
  ExpectClosed(LoadFourBar("plus", R"(<loop name="C" type="revolute">
<predecessor link="rocker"><origin xyz="0.4 0 0"/></predecessor>
<successor link="coupler"><origin xyz="0.5 0 0"/></successor><axis xyz="0 0 1"/></loop>)"),
               JointKind::kRevolute);
}

TEST(UrdfConstraint, LoopJointsAreReadAsIsaacSimDocumentsAndAsItWritesThem) {
  for (const char* second : {"link1", "link2"}) {
    ExpectClosed(
        LoadFourBar("isaac", std::string(R"(<loop_joint name="C" type="spherical">
<link1 link="rocker" xyz="0.4 0 0" rpy="0 0 0"/><)") +
                                 second +
                                 R"( link="coupler" xyz="0.5 0 0" rpy="0 0 0"/></loop_joint>)"),
        JointKind::kSpherical);
  }
}

TEST(UrdfConstraint, DrakesBallConstraintClosesAFourBar) {
  ExpectClosed(LoadFourBar("drake", R"(<drake:ball_constraint>
<drake:ball_constraint_body_A name="rocker"/><drake:ball_constraint_body_B name="coupler"/>
<drake:ball_constraint_p_AP value="0.4 0 0"/><drake:ball_constraint_p_BQ value="0.5 0 0"/>
</drake:ball_constraint>)"),
               JointKind::kSpherical);
}

TEST(UrdfConstraint, AxesOfDifferentComponentsOnTheTwoSidesAreTheSameLine) {
  // The child's frame is turned so that its x axis is the hinge.
  ExpectClosed(LoadFourBar("turned", R"(<constraint name="C" type="revolute">
<parent link="rocker"/><parent_origin xyz="0.4 0 0"/><parent_axis xyz="0 0 1"/>
<child link="coupler"/><child_origin xyz="0.5 0 0" rpy="0 -1.5707963267948966 0"/>
<child_axis xyz="1 0 0"/></constraint>)"),
               JointKind::kRevolute);
  // Perturbed by a right angle, it cannot close.
  const LoadResult perturbed = LoadFourBar("perturbed", R"(<constraint name="C" type="revolute">
<parent link="rocker"/><parent_origin xyz="0.4 0 0"/><parent_axis xyz="0 0 1"/>
<child link="coupler"/><child_origin xyz="0.5 0 0"/><child_axis xyz="1 0 0"/></constraint>)");
  EXPECT_FALSE(perturbed.mechanism);
}

TEST(UrdfConstraint, AUniversalJointTakesOneAxisFromEachSide) {
  Diagnostics diagnostics;
  const UrdfTree tree = ReadUrdf(FourBarUrdf(R"(<constraint name="U" type="universal">
<parent link="rocker"/><parent_axis xyz="0 0 2"/><child link="coupler"/><child_axis xyz="0 3 0"/>
</constraint>)"),
                                 "r.urdf", &diagnostics);
  ASSERT_EQ(diagnostics.Text(), "");
  EXPECT_EQ(tree.joints.back().axis, Vec3::UnitZ());
  EXPECT_EQ(tree.joints.back().axis2, Vec3::UnitY());
}

TEST(UrdfConstraint, FindingsNameTheLineTheValueAndTheRule) {
  EXPECT_EQ(ClosureFindings("<constraint name=\"C\" type=\"hinge\"><parent link=\"rocker\"/>"
                            "<child link=\"coupler\"/></constraint>\n"),
            "r.urdf:6:1: error: <constraint 'C'>: type = 'hinge' is not a kind of closure\n"
            "  hint: fixed, revolute, continuous, prismatic, cylindrical, universal, spherical, "
            "ball or planar\n");
  EXPECT_EQ(ClosureFindings("<constraint name=\"C\" type=\"ball\"><parent link=\"rokcer\"/>"
                            "<child link=\"coupler\"/></constraint>\n"),
            "r.urdf:6:1: error: closure 'C': there is no link 'rokcer'\n"
            "  hint: did you mean 'rocker'?\n");
  EXPECT_NE(ClosureFindings("\n<loop name=\"C\" type=\"ball\"><successor link=\"coupler\"/></loop>")
                .find("r.urdf:7:1: error: <loop 'C'>: <predecessor link=\"…\"> is missing"),
            std::string::npos);
  EXPECT_NE(
      ClosureFindings("<loop_joint name=\"C\" type=\"ball\"><link1 link=\"rocker\" xyz=\"1 2\"/>"
                      "<link2 link=\"coupler\"/></loop_joint>")
          .find("xyz = '1 2' is not three numbers"),
      std::string::npos);
  EXPECT_NE(ClosureFindings("<constraint name=\"C\" type=\"universal\"><parent link=\"rocker\"/>"
                            "<child link=\"coupler\"/></constraint>")
                .find("a universal joint needs an axis on each side"),
            std::string::npos);
  EXPECT_NE(ClosureFindings("<constraint name=\"A\" type=\"ball\"><parent link=\"rocker\"/>"
                            "<child link=\"coupler\"/></constraint>")
                .find("a joint of this name is there already"),
            std::string::npos);
}

TEST(UrdfConstraint, ALoopThatDoesNotCloseIsFoundAtItsLine) {
  std::string closure = kConstraint;
  closure.replace(closure.find("0.4"), 3, "1.4");
  const std::string text = LoadFourBar("open", closure).diagnostics.Text();
  EXPECT_NE(text.find("open.urdf:6:1: error: the loop at joint 'C' does not close: gap"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("urdf: {guess: …}"), std::string::npos) << text;
}

TEST(UrdfConstraint, WhatIsNotReadIsReported) {
  Diagnostics diagnostics;
  const UrdfTree tree = ReadUrdf(
      FourBarUrdf(
          "<gazebo><joint name=\"C\" type=\"revolute\"/></gazebo>\n<coupling name=\"g\"/>\n"
          "<link name=\"l\"><visual><geometry><mesh filename=\"a.stl\"/></geometry></visual>"
          "<visual><geometry><mesh filename=\"b.stl\"/></geometry></visual></link>\n"
          "<joint name=\"k\" type=\"fixed\"><parent link=\"crank\"/><child link=\"l\"/></joint>"),
      "r.urdf", &diagnostics);
  EXPECT_FALSE(tree.bodies.empty());
  const std::string text = diagnostics.Text();
  EXPECT_NE(text.find("r.urdf:6:1: warning: a joint inside <gazebo> is left out"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("r.urdf:7:1: warning: <coupling> ('g') is left out"), std::string::npos)
      << text;
  EXPECT_NE(text.find("r.urdf: warning: 2 of 2 meshes are left out: 'a.stl' is not there, for one"),
            std::string::npos)
      << text;
}

TEST(UrdfExport, TheConstraintsAloneCloseTheLoopsAgain) {
  for (const char* name : {"four_bar", "slider_crank", "stewart"}) {
    const LoadResult loaded =
        LoadModel(std::string(kSourceDir) + "/models/" + name + "/model.yaml");
    ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    WriteClosureFile("alone.urdf", WriteUrdf(*loaded.mechanism));
    // The companion's guesses; closures from the URDF.
    std::string companion = WriteUrdfCompanion(*loaded.mechanism, "alone.urdf");
    companion.erase(companion.find("  constraints: false\n"), 21);
    companion = companion.substr(0, companion.find("attach:\n"));
    const LoadResult back = LoadModel(WriteClosureFile("alone.yaml", companion));
    ASSERT_TRUE(back.mechanism) << name << ": " << back.diagnostics.Text();
    const Mobility before = AnalyseMobility(*loaded.mechanism);
    const Mobility after = AnalyseMobility(*back.mechanism);
    EXPECT_EQ(before.dofs, after.dofs) << name;
    EXPECT_EQ(before.redundant, after.redundant) << name;
  }
}

// The open tree with links that mark where it was cut, as in example-parallel-robots.
constexpr const char* kMarks = R"(<link name="loop1_A"/><link name="loop1_B"/>
<joint name="to_A" type="fixed"><parent link="rocker"/><child link="loop1_A"/><origin xyz="0.4 0 0"/></joint>
<joint name="to_B" type="continuous"><parent link="coupler"/><child link="loop1_B"/><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/></joint>
)";

LoadResult LoadWithClosures(const std::string& name, const std::string& closures) {
  WriteClosureFile(name + ".urdf", FourBarUrdf(kMarks));
  WriteClosureFile(name + "_robot.yaml", closures);
  return LoadModel(WriteClosureFile(name + ".yaml", "name: m\nurdf: {file: " + name +
                                                        ".urdf, closures: " + name +
                                                        "_robot.yaml,\n  guess_deg: "
                                                        "{A: 60, B: -50, D: 70}}\n"));
}

TEST(ClosureFile, PairsOfFramesCloseTheLoopAndMotorsBecomeDrives) {
  for (const char* type : {"6d", "3D"}) {
    const LoadResult loaded =
        LoadWithClosures("pairs", std::string("closed_loop: [['loop1_B', 'loop1_A']]\ntype: ['") +
                                      type + "']\nname_mot: ['A']\n");
    ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    const Mechanism& m = *loaded.mechanism;
    const int loop = m.FindJoint("loop1");
    ASSERT_GE(loop, 0);
    EXPECT_EQ(m.joints[loop].kind, *type == '6' ? JointKind::kFixed : JointKind::kSpherical);
    ASSERT_EQ(m.drives.size(), 1u);
    EXPECT_EQ(m.drives[0].name, "A");
    const Mobility mobility = AnalyseMobility(m);
    // With the ball, the mark at the end of the hinge to_B turns by itself.
    EXPECT_EQ(mobility.dofs, *type == '6' ? 1 : 2);
    EXPECT_LT((m.X_WB_home[m.FindBody("rocker")] * Vec3(0.4, 0, 0) -
               m.X_WB_home[m.FindBody("coupler")] * Vec3(0.5, 0, 0))
                  .norm(),
              1e-12);
  }
}

TEST(ClosureFile, JointsBecomeSphericalUniversalOrFixed) {
  const LoadResult loaded =
      LoadWithClosures("kinds",
                       "closed_loop: [[loop1_B, loop1_A]]\ntype: [6d]\nname_mot: [A]\n"
                       "joint_name: [B, D, to_B]\njoint_type: [SPHERICAL, UJOINT_ZX, FIXED]\n");
  ASSERT_FALSE(loaded.mechanism);  // guesses of one number do not fit a ball
  EXPECT_NE(loaded.diagnostics.Text().find("urdf.guess_deg.B"), std::string::npos)
      << loaded.diagnostics.Text();
  WriteClosureFile("kinds2.urdf", FourBarUrdf(kMarks));
  WriteClosureFile("kinds2_robot.yaml",
                   "closed_loop: [[loop1_B, loop1_A]]\ntype: [6d]\n"
                   "joint_name: [B, D]\njoint_type: [SPHERICAL, UJOINT_ZX]\n");
  const LoadResult good =
      LoadModel(WriteClosureFile("kinds2.yaml",
                                 "name: m\nurdf: {file: kinds2.urdf, closures: kinds2_robot.yaml,\n"
                                 "  guess_deg: {A: 60, B: [0, 0, -50], D: [70, 0]}}\n"
                                 "drives: {motor: {kind: joint, joint: A}}\n"));
  ASSERT_TRUE(good.mechanism) << good.diagnostics.Text();
  const Mechanism& m = *good.mechanism;
  EXPECT_EQ(m.joints[m.FindJoint("B")].kind, JointKind::kSpherical);
  const Joint& universal = m.joints[m.FindJoint("D")];
  EXPECT_EQ(universal.kind, JointKind::kUniversal);
  EXPECT_EQ(universal.axis, Vec3::UnitZ());
  EXPECT_EQ(universal.axis2, Vec3::UnitX());
  ASSERT_EQ(m.drives.size(), 1u);
  EXPECT_EQ(m.drives[0].name, "motor");  // the model file's own
}

TEST(ClosureFile, FindingsNameItsLines) {
  const auto findings = [](const std::string& closures) {
    return LoadWithClosures("wrong", closures).diagnostics.Text();
  };
  EXPECT_NE(findings("closed_loop: [[loop1_B, loop1_C]]\n")
                .find("wrong_robot.yaml:1:25: error: closed_loop[0]: there is no link or joint "
                      "'loop1_C' in the URDF file\n  hint: did you mean 'loop1_"),
            std::string::npos)
      << findings("closed_loop: [[loop1_B, loop1_C]]\n");
  EXPECT_NE(findings("closed_loop: [[loop1_B, loop1_A]]\ntype: [5d]\n").find("neither 6d nor 3d"),
            std::string::npos);
  EXPECT_NE(findings("name_mot: [E]\n").find("there is no joint 'E'"), std::string::npos);
  EXPECT_NE(findings("name_mot: [to_A]\n").find("a motor drives one"), std::string::npos);
  EXPECT_NE(findings("joint_name: [B]\njoint_type: [CARDAN]\n").find("UJOINT_XY"),
            std::string::npos);
  EXPECT_NE(findings("joint_name: [B]\n").find("joint_name has 1 entries, joint_type 0"),
            std::string::npos);
  EXPECT_NE(findings("motors: [A]\nname_mot: [A]\n").find("unknown key 'motors'"),
            std::string::npos);
  EXPECT_NE(findings("motors: [A]\n").find("the file is of another kind"), std::string::npos);
}

}  // namespace
}  // namespace mbv
