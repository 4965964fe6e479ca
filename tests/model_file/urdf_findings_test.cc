// What is wrong with a URDF file, with the closures beside it, and with a model file's `urdf` key.
#include <gtest/gtest.h>

#include <ostream>

#include "model_file/load_model.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

struct Wrong {
  const char* name;
  const char* text;
  const char* said;  // in full
};
std::ostream& operator<<(std::ostream& out, const Wrong& wrong) { return out << wrong.name; }

// A four-bar linkage, open at C; `more` comes in line 6.
std::string OpenLinkage(const std::string& more = "") {
  return R"(<robot name="four_bar">
<link name="world"/><link name="crank"/><link name="coupler"/><link name="rocker"/>
<joint name="A" type="continuous"><parent link="world"/><child link="crank"/><axis xyz="0 0 1"/></joint>
<joint name="B" type="continuous"><parent link="crank"/><child link="coupler"/><origin xyz="0.2 0 0"/><axis xyz="0 0 1"/></joint>
<joint name="D" type="continuous"><parent link="world"/><child link="rocker"/><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/></joint>
)" + more +
         "</robot>\n";
}

// Findings of m.yaml, which takes r.urdf, without the folder's name.
std::string Reported(const std::string& model, const std::string& urdf,
                     const std::string& closures) {
  const test::TestFolder folder(
      std::string("urdf_findings_") +
      std::to_string(testing::UnitTest::GetInstance()->current_test_info()->line()) + "_" +
      testing::UnitTest::GetInstance()->current_test_info()->name());
  (void)folder.Write("r.urdf", urdf);
  (void)folder.Write("loops.yaml", closures);
  std::string text = LoadModel(folder.Write("m.yaml", "name: m\n" + model)).diagnostics.Text();
  const std::string start = folder.PathOf("");
  for (size_t at = text.find(start); at != std::string::npos; at = text.find(start)) {
    text.erase(at, start.size());
  }
  return text;
}

class WrongClosures : public testing::TestWithParam<Wrong> {};

TEST_P(WrongClosures, AreReportedInFull) {
  EXPECT_EQ(
      Reported("urdf: {file: r.urdf, closures: loops.yaml}\n", OpenLinkage(), GetParam().text),
      GetParam().said);
}

const Wrong kWrongClosures[] = {
    {"Lengths",
     "closed_loop: [[crank, rocker], [coupler]]\ntype: [6d]\njoint_name: A\n"
     "joint_type: [FIXED, FIXED]\n",
     "loops.yaml:3:13: error: joint_name is 'A', a list is needed\n"
     "loops.yaml:1:1: error: joint_name has 0 entries, joint_type 2\n"
     "loops.yaml:1:1: error: closed_loop has 2 entries, type 1\n"},
    {"Pairs",
     "closed_loop: [[crank, crank], [crank], [B, couplr], rocker]\n"
     "type: [6D, 3d, 3d, 5d]\nname_mot: [A, Q, [B]]\n",
     "loops.yaml:1:15: error: closed_loop[0] connects a link with itself\n"
     "loops.yaml:1:31: error: closed_loop[1] is a list of 1, a list of 2 is needed\n"
     "loops.yaml:1:44: error: closed_loop[2]: there is no link or joint 'couplr' in the URDF "
     "file\n"
     "  hint: did you mean 'coupler'?\n"
     "loops.yaml:1:53: error: closed_loop[3] is 'rocker', a list of 2 is needed\n"
     "loops.yaml:3:15: error: name_mot: there is no joint 'Q' in the URDF file\n"
     "  hint: did you mean 'A'?\n"
     "loops.yaml:3:18: error: name_mot is a list of 1, a word is needed\n"},
    {"Kinds",
     "joint_name: [A, B, D]\njoint_type: [UJOINT_XX, UJOINT_XYZ, HINGE]\nname_mot: [A, world]\n",
     "loops.yaml:2:14: error: joint_type[0] = 'UJOINT_XX' is not known\n"
     "  hint: SPHERICAL, FIXED, or UJOINT_ with two of X, Y, Z, e.g. UJOINT_XY\n"
     "loops.yaml:2:25: error: joint_type[1] = 'UJOINT_XYZ' is not known\n"
     "  hint: SPHERICAL, FIXED, or UJOINT_ with two of X, Y, Z, e.g. UJOINT_XY\n"
     "loops.yaml:2:37: error: joint_type[2] = 'HINGE' is not known\n"
     "  hint: SPHERICAL, FIXED, or UJOINT_ with two of X, Y, Z, e.g. UJOINT_XY\n"
     "loops.yaml:3:15: error: name_mot: there is no joint 'world' in the URDF file\n"},
    {"Cuts",
     "closures:\n- {link_a: rocker, link_b: rocker, point: [0, 0, 0]}\n"
     "- {link_a: rocker, point: [0, 0], axis: [0, 0, 0]}\n"
     "- {link_b: coupler, link_a: rokcer}\n"
     "- {link_a: coupler, link_b: crank, point: [0, 0, z]}\nindependent: [A, Z]\n",
     "loops.yaml:2:3: error: closures[0] connects a link with itself\n"
     "loops.yaml:3:3: error: closures[1].link_b is missing\n"
     "  hint: link_a, link_b, point, and axis for a hinge\n"
     "loops.yaml:3:27: error: closures[1].point is a list of 2, a list of 3 is needed\n"
     "loops.yaml:3:41: error: closures[1].axis has no direction\n"
     "loops.yaml:4:29: error: closures[2].link_a: there is no link or joint 'rokcer' in the URDF "
     "file\n"
     "  hint: did you mean 'rocker'?\n"
     "loops.yaml:4:3: error: closures[2].point is missing\n"
     "loops.yaml:5:50: error: closures[3].point[2] is 'z', a number is needed\n"
     "loops.yaml:6:18: error: independent: there is no joint 'Z' in the URDF file\n"
     "  hint: did you mean 'A'?\n"},
    {"NoMap", "- a\n", "loops.yaml:1:1: error: the file is a list of 1, a map is needed\n"},
};
INSTANTIATE_TEST_SUITE_P(UrdfFindings, WrongClosures, testing::ValuesIn(kWrongClosures),
                         [](const auto& info) { return std::string(info.param.name); });

class WrongUrdfKey : public testing::TestWithParam<Wrong> {};

TEST_P(WrongUrdfKey, IsReportedInFull) {
  EXPECT_EQ(Reported(GetParam().text, OpenLinkage(), ""), GetParam().said);
}

const Wrong kWrongKeys[] = {
    {"NoFile", "urdf: {closures: loops.yaml}\n", "m.yaml:2:7: error: urdf: 'file' is missing\n"},
    {"NotThere", "urdf: nowhere.urdf\n",
     "m.yaml:2:7: error: urdf = 'nowhere.urdf' cannot be read\n"
     "  hint: the path is relative to this file\n"},
    {"AList", "urdf: [r.urdf]\n", "m.yaml:2:7: error: urdf is a list of 1, a map is needed\n"},
    {"NoFlag", "urdf: {file: r.urdf, constraints: maybe}\n",
     "m.yaml:2:35: error: urdf.constraints = 'maybe' is neither true nor false\n"},
    {"NoClosures", "urdf: {file: r.urdf, closures: none_such.yaml}\n",
     "m.yaml:2:32: error: urdf.closures = 'none_such.yaml' cannot be read\n"
     "  hint: the path is relative to this file\n"},
    {"Guesses", "urdf: {file: r.urdf, guess: {AA: 1, B: half, D: [1, 2], A: 7}}\n",
     "m.yaml:2:30: error: urdf.guess.AA: there is no such joint in the URDF file\n"
     "  hint: did you mean 'A'?\n"
     "m.yaml:2:40: error: urdf.guess.B = 'half' has the unknown symbol 'half'\n"
     "m.yaml:2:49: error: urdf.guess.D is a list of 2, a list of 1 is needed\n"
     "m.yaml:2:60: warning: urdf.guess.A = 7 rad is more than a turn\n"
     "  hint: angles are in radians; write guess_deg for degrees\n"},
    {"GuessesInTwoUnits", "urdf: {file: r.urdf, guess: {A: 1}, guess_deg: {A: 1}}\n",
     "m.yaml:2:48: error: urdf.guess and guess_deg are both given\n  hint: keep one of them\n"},
    {"NamesOfTheFile",
     "urdf: r.urdf\nbodies: {crank: {}, free: {}}\n"
     "joints: {A: {kind: fixed, parent: world, child: free}}\n"
     "attach: {rokcer: {C: [0, 0, 0]}}\ndrives: {a: {kind: joint, joint: AB}}\n",
     "m.yaml:3:10: error: bodies.crank: a body 'crank' is there already\n"
     "m.yaml:4:10: error: joints.A: a joint 'A' is there already\n"
     "m.yaml:5:10: error: attach.rokcer = 'rokcer': there is no such body\n"
     "  hint: did you mean 'rocker'?\n"
     "m.yaml:6:34: error: drives.a.joint = 'AB': there is no such joint\n"
     "  hint: did you mean 'A'?\n"},
};
INSTANTIATE_TEST_SUITE_P(UrdfFindings, WrongUrdfKey, testing::ValuesIn(kWrongKeys),
                         [](const auto& info) { return std::string(info.param.name); });

class WrongUrdf : public testing::TestWithParam<Wrong> {};

TEST_P(WrongUrdf, IsReportedInFull) {
  EXPECT_EQ(Reported("urdf: r.urdf\n", OpenLinkage(GetParam().text), ""), GetParam().said);
}

const Wrong kWrongUrdfs[] = {
    {"NoName",
     R"(<constraint type="ball"><parent link="rocker"/><child link="coupler"/></constraint>)",
     "r.urdf:6:1: error: <constraint> has no name\n"},
    {"NoType",
     R"(<constraint name="C"><parent link="rocker"/><child link="coupler"/></constraint>)",
     "r.urdf:6:1: error: <constraint 'C'>: type = '' is not a kind of closure\n"
     "  hint: fixed, revolute, continuous, prismatic, cylindrical, universal, spherical, ball or "
     "planar\n"},
    {"NoDirection",
     R"(<constraint name="C" type="revolute"><parent link="rocker"/><parent_axis xyz="0 0 0"/>)"
     R"(<child link="coupler"/></constraint>)",
     "r.urdf:6:1: error: <constraint 'C'>: parent_axis = '0 0 0' has no direction\n"},
    {"ParallelAxes",
     R"(<constraint name="C" type="universal"><parent link="rocker"/><parent_axis xyz="0 0 2"/>)"
     R"(<child link="coupler"/><child_axis xyz="0 0 -1"/></constraint>)",
     "r.urdf:6:1: error: <constraint 'C'>: the two axes are parallel\n"},
    {"WithItself",
     R"(<constraint name="C" type="ball"><parent link="rocker"/><child link="rocker"/>)"
     "</constraint>",
     "r.urdf:6:1: error: closure 'C' connects link 'rocker' with itself\n"},
    {"NoNumber",
     R"(<constraint name="C" type="ball"><parent link="rocker"/><parent_origin xyz="1 nan 0"/>)"
     R"(<child link="coupler"/></constraint>)",
     "r.urdf:6:1: error: <constraint 'C'>: xyz = '1 nan 0' is not three numbers\n"},
    {"FourNumbers",
     R"(<loop_joint name="C" type="ball"><link1 link="rocker" xyz="1 2 3 4"/>)"
     R"(<link2 link="coupler"/></loop_joint>)",
     "r.urdf:6:1: error: <loop_joint 'C'>: xyz = '1 2 3 4' is not three numbers\n"},
    {"ControlCharacters",
     R"(<link name="a&#27;b"/><joint name="j" type="fixed"><parent link="crank"/>)"
     R"(<child link="a&#27;b"/></joint>)",
     "r.urdf:6:1: error: link 'a\\x1bb': the name holds control characters\n"},
    {"NegativeMass",
     R"(<link name="l"><inertial><mass value="-1"/>)"
     R"(<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>)"
     R"(<joint name="j" type="fixed"><parent link="crank"/><child link="l"/></joint>)",
     "r.urdf:6:1: error: link 'l': its inertial values violate mass >= 0 and finite\n"},
};
INSTANTIATE_TEST_SUITE_P(UrdfFindings, WrongUrdf, testing::ValuesIn(kWrongUrdfs),
                         [](const auto& info) { return std::string(info.param.name); });

// The linkage with marks where it was cut, alone with its closure file: no model file.
LoadResult LoadAlone(const std::string& hinge, const std::string& mark, const std::string& type) {
  const test::TestFolder folder("urdf_findings_alone_" + hinge.substr(0, 1) + type);
  std::string urdf = OpenLinkage(
      R"(<link name="C_A"/><link name="C_B"/>
<joint name="to_A" type="fixed"><parent link="coupler"/><child link="C_A"/><origin xyz="0.5 0 0"/></joint>
<joint name="to_B" type="fixed"><parent link="rocker"/><child link="C_B"/><origin )" +
      mark + "/></joint>\n");
  const std::string plain = R"("B" type="continuous")", axis = R"(<axis xyz="0 0 1"/>)";
  const size_t at = urdf.find(plain), axis_at = urdf.find(axis, at);
  urdf.replace(axis_at, axis.size(), hinge == "B" ? axis : R"(<axis xyz="1 0 0"/>)");
  urdf.replace(at + 1, 1, hinge);
  (void)folder.Write("r.yaml", "closed_loop: [[C_A, C_B]]\ntype: [" + type + "]\nname_mot: [A]\n");
  return LoadModel(folder.Write("r.urdf", urdf));
}

TEST(UrdfFindings, AHingeThatIsNamedABallIsOneWhereThatClosesTheLoops) {
  // The coupler, held straight by a hinge along it, is too long for the rocker of 0.1 m.
  const LoadResult ball = LoadAlone("Rotule_B", R"(xyz="0.1 0 0")", "3d");
  ASSERT_TRUE(ball.mechanism) << ball.diagnostics.Text();
  const Mechanism& m = *ball.mechanism;
  EXPECT_EQ(m.joints[m.FindJoint("Rotule_B")].kind, JointKind::kSpherical);
  EXPECT_EQ(m.joints[m.FindJoint("A")].kind, JointKind::kRevolute);
  EXPECT_NE(
      ball.diagnostics.Text().find(
          "r.urdf: warning: the loops do not close as they are stated; they do with 1 joint "
          "as ball whose name says so, and which the URDF states as hinges: Rotule_B\n"
          "  hint: list them in the closure file: joint_name: […], joint_type: [SPHERICAL, …]"),
      std::string::npos)
      << ball.diagnostics.Text();
  EXPECT_LT((m.X_WB_home[m.FindBody("coupler")] * Vec3(0.5, 0, 0) -
             m.X_WB_home[m.FindBody("rocker")] * Vec3(0.1, 0, 0))
                .norm(),
            1e-12);
  // Without such a name it stays what it is stated as.
  const LoadResult hinge = LoadAlone("Hinge_B", R"(xyz="0.1 0 0")", "3d");
  EXPECT_FALSE(hinge.mechanism);
  EXPECT_NE(hinge.diagnostics.Text().find("the loop at joint 'C_A_C_B' does not close"),
            std::string::npos)
      << hinge.diagnostics.Text();
  EXPECT_EQ(hinge.diagnostics.Text().find("whose name"), std::string::npos);
}

TEST(UrdfFindings, FramesThatMeetInPointsOnlyDoSoWithACaveat) {
  const char* turned = R"(xyz="0.4 0 0" rpy="1.5707963267948966 0 0")";
  const LoadResult welded = LoadAlone("B", turned, "6d");
  ASSERT_TRUE(welded.mechanism) << welded.diagnostics.Text();
  const Mechanism& m = *welded.mechanism;
  EXPECT_EQ(m.joints[m.FindJoint("C_A_C_B")].kind, JointKind::kSpherical);
  ASSERT_EQ(welded.caveats.size(), 1u);
  EXPECT_NE(welded.caveats[0].text.find("close where these meet in points (3d): of C_A_C_B their "
                                        "turn against each other is left out"),
            std::string::npos)
      << welded.caveats[0].text;
  const LoadResult stated = LoadAlone("B", turned, "3d");
  EXPECT_TRUE(stated.mechanism);
  EXPECT_TRUE(stated.caveats.empty());
}

// Its joints stand in the URDF file, so its closures are cut in the links' frames at zero.
TEST(UrdfFindings, ACutWithAnAxisIsAHingeAndOneWithoutIsABall) {
  const test::TestFolder folder("urdf_findings_cuts");
  (void)folder.Write("r.urdf", OpenLinkage());
  for (const char* axis : {", axis: [0, 0, 3]", ""}) {
    (void)folder.Write("loops.yaml",
                       std::string("closures: [{link_a: rocker, link_b: coupler, point: [0.7, 0, "
                                   "0]") +
                           axis + "}]\nindependent: [A]\n");
    const LoadResult loaded = LoadModel(folder.Write(
        "m.yaml", "name: m\nurdf: {file: r.urdf, closures: loops.yaml, guess: {A: 1, D: 1}}\n"));
    ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    const Mechanism& m = *loaded.mechanism;
    const Joint& cut = m.joints.back();
    EXPECT_EQ(cut.kind, *axis == '\0' ? JointKind::kSpherical : JointKind::kRevolute);
    // At zero the rocker's frame is at 0.5 m, the coupler's at 0.2 m.
    EXPECT_LT((cut.X_PF.translation() - Vec3(0.2, 0, 0)).norm(), 4 * kEps);
    EXPECT_LT((cut.X_CM.translation() - Vec3(0.5, 0, 0)).norm(), 4 * kEps);
    EXPECT_EQ(cut.axis, Vec3::UnitZ());
    ASSERT_EQ(m.drives.size(), 1u);
    EXPECT_EQ(m.drives[0].name, "A");
  }
}

}  // namespace
}  // namespace mbv
