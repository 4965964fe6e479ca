// Robots from files: drives for every DOF, a first motion, and what a survey makes of them.
#include "features/robots/survey.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "features/run/default_setup.h"
#include "kinematics/mobility.h"
#include "math/bytes.h"
#include "model_file/load_model.h"
#include "tests/mechanisms/four_bar.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

std::string UrdfLink(const std::string& name, double length) {
  return fmt::format(
      R"(<link name="{}"><inertial><origin xyz="{} 0 0"/><mass value="1"/>)"
      R"(<inertia ixx="0.001" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>)"
      "\n",
      name, 0.5 * length);
}
std::string UrdfJoint(const std::string& type, const std::string& parent, const std::string& child,
                      double x) {
  return fmt::format(R"(<joint name="{1}_{2}" type="{0}"><parent link="{1}"/><child link="{2}"/>)"
                     R"(<origin xyz="{3} 0 0"/><axis xyz="0 1 0"/></joint>)"
                     "\n",
                     type, parent, child, x);
}
// A cut four-bar; with a crank of 0.2 m it closes, with one of 2 m it cannot.
std::string CutLinkage(double crank) {
  return "<robot name=\"linkage\">" + UrdfLink("base", 0.5) + UrdfLink("crank", crank) +
         UrdfLink("coupler", 0.5) + UrdfLink("rocker", 0.4) +
         UrdfJoint("continuous", "base", "crank", 0) +
         UrdfJoint("continuous", "crank", "coupler", crank) +
         UrdfJoint("continuous", "base", "rocker", 0.5) + "<link name=\"A\"/><link name=\"B\"/>" +
         UrdfJoint("fixed", "coupler", "A", 0.5) + UrdfJoint("fixed", "rocker", "B", 0.4) +
         "</robot>";
}
constexpr const char* kLoop = "closed_loop: [[A, B]]\ntype: [3d]\nname_mot: [base_crank]\n";

TEST(Survey, ARobotThatClosesAgreesInBothModes) {
  const test::TestFolder folder("survey_ok");
  folder.Write("robot.yaml", kLoop);
  const SurveyRow row =
      SurveyFile(folder.Write("r.urdf", CutLinkage(0.2)), folder.PathOf("scratch"));
  EXPECT_EQ(row.status, "ok") << row.message;
  EXPECT_EQ(row.bodies, 4);
  EXPECT_EQ(row.loops, 1);
  EXPECT_EQ(row.dofs, 1);
  EXPECT_EQ(row.redundant, 0 + 1);  // a ball in a planar loop holds what the hinges hold, too
  EXPECT_LT(row.gap_m, 1e-10);
  EXPECT_LT(row.gap_rad, 1e-10);
  EXPECT_LT(row.inverse_nrmse, 1e-10);
  EXPECT_LT(row.forward_nrmse, 1e-6);
  EXPECT_GT(row.seconds, 0.0);
}

TEST(Survey, EachFaultHasItsStatus) {
  const test::TestFolder folder("survey_faults");
  folder.Write("robot.yaml", kLoop);
  const SurveyRow open =
      SurveyFile(folder.Write("r.urdf", CutLinkage(2.0)), folder.PathOf("scratch"));
  EXPECT_EQ(open.status, "not_closed") << open.message;
  EXPECT_NE(open.message.find("would have to move by"), std::string::npos) << open.message;

  folder.Write("robot.yaml", "closed_loop: [[A, BB]]\n");
  const SurveyRow slip =
      SurveyFile(folder.Write("r.urdf", CutLinkage(0.2)), folder.PathOf("scratch"));
  EXPECT_EQ(slip.status, "refused");
  EXPECT_NE(slip.message.find("did you mean 'B'?"), std::string::npos) << slip.message;

  const SurveyRow broken = SurveyFile(folder.Write("x.urdf", "<robot"), folder.PathOf("scratch"));
  EXPECT_EQ(broken.status, "refused");
}

// The status is the finding's code, whatever names its message holds.
// A shin and a leaf beside it turn about two points of a thigh, 35 mm apart, and slide on each
// other across the line between these: rigid but for one instant.
std::string LeafSpring(double off) {
  const auto link = [](const std::string& name, double x, double z) {
    return fmt::format(
        "<link name='{}'><pose>{} 0 {} 0 0 0</pose><inertial><pose>.1 0 0 0 0 0</pose><mass>1"
        "</mass><inertia><ixx>.01</ixx><iyy>.01</iyy><izz>.01</izz></inertia></inertial></link>",
        name, x, z);
  };
  const auto joint = [](const std::string& name, const std::string& parent,
                        const std::string& child, const std::string& rest) {
    return fmt::format("<joint name='{}' {}<parent>{}</parent><child>{}</child></joint>", name,
                       rest, parent, child);
  };
  const std::string hinge = "type='revolute'><axis><xyz>0 1 0</xyz></axis>";
  return "<sdf version='1.7'><model name='leg'>" + link("thigh", 0, 1) + link("shin", 0.3, 1) +
         link("leaf", 0.3 + off, 1.035) + joint("hip", "world", "thigh", hinge) +
         joint("knee", "thigh", "shin", hinge) + joint("root", "thigh", "leaf", hinge) +
         joint("slide", "shin", "leaf", "type='prismatic'><axis><xyz>1 0 0</xyz></axis>") +
         "</model></sdf>";
}

TEST(Survey, LoopsThatRoundingAloneHoldsAreAFaultOfTheFile) {
  const test::TestFolder folder("survey_dead_point");
  const SurveyRow row =
      SurveyFile(folder.Write("r.sdf", LeafSpring(-1.5e-6)), folder.PathOf("scratch"));
  EXPECT_EQ(row.status, "refused");
  EXPECT_NE(row.message.find("'slide' stand at a dead point"), std::string::npos) << row.message;
  for (const char* joint : {"knee", "root"}) {
    EXPECT_NE(row.message.find(joint), std::string::npos) << row.message;
  }
}

// Few digits are no licence to make another mechanism of it.
TEST(Survey, FramesMoveNoFartherThanDigitsExplain) {
  const test::TestFolder folder("survey_reach");
  const SurveyRow row =
      SurveyFile(folder.Write("r.sdf", LeafSpring(-0.01)), folder.PathOf("scratch"));
  EXPECT_EQ(row.status, "ok") << row.message;
  EXPECT_EQ(row.dofs, 1);
  EXPECT_TRUE(row.caveats.empty()) << row.caveats.front();
}

TEST(Survey, ALinkNamedAsAFaultIsNotThatFault) {
  const test::TestFolder folder("survey_names");
  std::string robot = "<robot name=\"r\">" + UrdfLink("base", 0.5) +
                      UrdfLink("does not close", 0.5) +
                      UrdfJoint("continuous", "base", "does not close", 0) + "</robot>";
  const std::string mass = "<mass value=\"1\"/>";
  robot.replace(robot.rfind(mass), mass.size(), "<mass value=\"-1\"/>");
  const SurveyRow row = SurveyFile(folder.Write("r.urdf", robot), folder.PathOf("scratch"));
  EXPECT_NE(row.message.find("does not close"), std::string::npos) << row.message;
  EXPECT_EQ(row.status, "refused") << row.message;
}

TEST(Survey, TheExitCodeReportsFaultsOfTheFileFromOthers) {
  const auto exit_of = [](std::vector<std::string> states) {
    std::vector<SurveyRow> rows;
    for (const std::string& status : states) {
      rows.emplace_back();
      rows.back().status = status;
    }
    return SurveyExit(rows);
  };
  EXPECT_EQ(exit_of({"ok", "refused", "ok"}), 0);
  EXPECT_EQ(exit_of({"ok", "disagree"}), 1);
  EXPECT_EQ(exit_of({"not_closed", "ok"}), 1);
  EXPECT_EQ(exit_of({"disagree", "failed"}), 3);
  EXPECT_EQ(SurveyRow{}.status, "failed");  // until something is known
}

TEST(Survey, ARowGoesThroughBytesUnchanged) {
  SurveyRow row{.file = "a.urdf", .status = "ok", .bodies = 3, .loops = 1, .dofs = 2};
  row.gap_m = 1.0 / 3.0;
  row.message = "a, \"b\"\nc";
  row.caveats = {"not the whole robot", "=cmd"};
  const auto back = FromBytes<SurveyRow>(ToBytes(row));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->file, "a.urdf");
  EXPECT_EQ(back->status, "ok");
  EXPECT_EQ(back->bodies, 3);
  EXPECT_EQ(back->redundant, -1);
  EXPECT_EQ(back->gap_m, row.gap_m);
  EXPECT_TRUE(std::isnan(back->inverse_nrmse));
  EXPECT_EQ(back->message, row.message);
  EXPECT_EQ(back->caveats, row.caveats);
  EXPECT_FALSE(FromBytes<SurveyRow>("nonsense"));

  const std::string csv = SurveyCsv({row});
  EXPECT_EQ(csv.substr(0, csv.find('\n')),
            "file,status,bodies,loops,dof,redundant,gap_m,gap_rad,inverse_nrmse,forward_nrmse,"
            "seconds,caveats,message");
  EXPECT_NE(csv.find("a.urdf,ok,3,1,2,,0.33,,,,,not the whole robot; =cmd,\"a, \"\"b\"\" c\"\n"),
            std::string::npos)
      << csv;
  row.message = "<script>";
  EXPECT_EQ(SurveyHtml({row}, "x").find("<script>"), std::string::npos);
}

// A rod between two balls, whose spin nothing holds and which its inertia feels, and a drive too
// many.
constexpr const char* kRod = R"(name: rod
world: {frames: {A: [0, 0, 0], D: [0.5, 0, 0]}}
bodies:
  crank: {mass: 1, inertia: [0.01, 0.01, 0.01], frames: {end: [0.2, 0, 0]}}
  rod: {mass: 1, com: [0.25, 0, 0], inertia: [0.001, 0.01, 0.009], frames: {end: [0.5, 0, 0]}}
  rocker: {mass: 1, inertia: [0.01, 0.01, 0.01], frames: {end: [0.4, 0, 0]}}
joints:
  A: {kind: revolute, parent: world.A, child: crank, axis: z, guess: 1.1}
  B: {kind: spherical, parent: crank.end, child: rod}
  C: {kind: spherical, parent: rocker.end, child: rod.end}
  D: {kind: revolute, parent: world.D, child: rocker, axis: z, guess: 1.2}
drives: {m: {kind: joint, joint: A}, n: {kind: joint, joint: D}}
)";

TEST(DefaultSetup, EveryDegreeOfFreedomGetsOneDrive) {
  const LoadResult loaded = LoadModelText(kRod, "rod.yaml");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  std::vector<std::string> notes;
  std::vector<Coordinate> by_forces;
  const Mechanism m = WithDriveForEachDof(*loaded.mechanism, &notes, &by_forces);
  const Mobility mobility = AnalyseMobility(m);
  EXPECT_EQ(mobility.undriven, 1);  // the spin, which moves by forces
  EXPECT_EQ(mobility.dofs, 2);
  ASSERT_EQ(by_forces.size(), 1u);
  EXPECT_TRUE(m.joints[static_cast<size_t>(by_forces[0].index)].kind == JointKind::kSpherical);
  ASSERT_EQ(m.drives.size(), 1u);
  EXPECT_EQ(m.drives[0].name, "m");
  ASSERT_EQ(notes.size(), 2u);
  EXPECT_NE(notes[0].find("moves by forces"), std::string::npos) << notes[0];
  EXPECT_NE(notes[0].find("the inertia of rod is not symmetric"), std::string::npos) << notes[0];
  EXPECT_NE(notes[1].find("left out: n"), std::string::npos) << notes[1];

  Mechanism without = *loaded.mechanism;
  without.drives.clear();
  notes.clear();
  const Mechanism chosen = WithDriveForEachDof(without, &notes, &by_forces);
  ASSERT_EQ(chosen.drives.size(), 1u);
  EXPECT_EQ(AnalyseMobility(chosen).undriven, 1);
  EXPECT_EQ(by_forces.size(), 1u);
  EXPECT_NE(notes.back().find("chosen by rank"), std::string::npos) << notes.back();
}

// Alone such spins are held by a ball of the rod, and every verdict says so.
TEST(DefaultSetup, WhereOnlySpinsOfRodsAreLeftOneBallHoldsEach) {
  const test::TestFolder folder("uneven_rod");
  const std::string file = folder.Write("rod.yaml", kRod);
  const DefaultSetupResult made = MakeDefaultSetup(file, "", "./model.yaml");
  ASSERT_TRUE(made.setup) << made.diagnostics.Text();
  EXPECT_EQ(made.setup->by_forces, 0);
  const Mechanism& m = made.setup->mechanism;
  EXPECT_EQ(AnalyseMobility(m).undriven, 0);
  EXPECT_EQ(m.joints[static_cast<size_t>(m.FindJoint("B"))].kind, JointKind::kUniversal);
  EXPECT_NE(made.setup->model.find(
                "the free spin of rod about the line between its spherical joints is left "
                "out"),
            std::string::npos)
      << made.setup->model;
  const SurveyRow row = SurveyFile(file, folder.PathOf("scratch"));
  EXPECT_EQ(row.status, "ok") << row.message;
  ASSERT_EQ(row.caveats.size(), 1u);
  EXPECT_NE(row.caveats[0].find("the free spin of rod"), std::string::npos);
}

// Beside a body that swings on a ball, too; this one moves by forces.
TEST(DefaultSetup, SpinsOfRodsAreHeldBesideOtherRotationsThatForcesMove) {
  const test::TestFolder folder("uneven_rod_and_bob");
  std::string both = kRod;
  both.insert(both.find("joints:"),
              "  bob: {mass: 1, com: [0.05, 0, -0.3], inertia: [0.01, 0.012, 0.003]}\n");
  both.insert(both.find("joints:") + 8, "  swing: {kind: spherical, parent: world, child: bob}\n");
  const std::string file = folder.Write("rod.yaml", both);
  const DefaultSetupResult made = MakeDefaultSetup(file, "", "./model.yaml");
  ASSERT_TRUE(made.setup) << made.diagnostics.Text();
  EXPECT_EQ(made.setup->by_forces, 3);
  const Mechanism& m = made.setup->mechanism;
  EXPECT_EQ(m.joints[static_cast<size_t>(m.FindJoint("B"))].kind, JointKind::kUniversal);
  EXPECT_EQ(m.joints[static_cast<size_t>(m.FindJoint("swing"))].kind, JointKind::kSpherical);
}

// A bob on a ball that falls sideways, beyond its range: no stop holds it there, and it runs.
TEST(DefaultSetup, WhatFallsBeyondItsRangeRunsAndSaysSo) {
  const test::TestFolder folder("falling_bob");
  const auto bob = [](const char* range) {
    return fmt::format(
        "name: bob\nbodies:\n  arm: {{mass: 1, com: [0.1, 0, 0], inertia: [0.01, 0.02, 0.02]}}\n"
        "  bob: {{mass: 1, com: [0.3, 0, 0.01], inertia: [0.003, 0.012, 0.01]}}\njoints:\n"
        "  turn: {{kind: revolute, parent: world, child: arm, axis: z}}\n"
        "  swing: {{kind: spherical, parent: arm, child: bob{}}}\n"
        "drives: {{turn: {{kind: joint, joint: turn}}}}\n",
        range);
  };
  const std::string note = "swing may leave the range by forces";
  const std::string limited = folder.Write("limited.yaml", bob(", range: [0, 0.5]"));
  const SurveyRow row = SurveyFile(limited, folder.PathOf("scratch"));
  EXPECT_EQ(row.status, "ok") << row.message;
  const DefaultSetupResult made = MakeDefaultSetup(limited, "", "./model.yaml");
  EXPECT_NE(made.diagnostics.Text().find(note), std::string::npos) << made.diagnostics.Text();
  const DefaultSetupResult free =
      MakeDefaultSetup(folder.Write("free.yaml", bob("")), "", "./model.yaml");
  EXPECT_EQ(free.diagnostics.Text().find(note), std::string::npos);
}

// One that is symmetric about its line spins idly.
TEST(DefaultSetup, ARoundRodKeepsItsBalls) {
  std::string round = kRod;
  round.replace(round.find("0.009"), 5, "0.01");
  const LoadResult loaded = LoadModelText(round, "rod.yaml");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  std::vector<std::string> notes;
  std::vector<Coordinate> by_forces;
  const Mechanism m = WithDriveForEachDof(*loaded.mechanism, &notes, &by_forces);
  EXPECT_TRUE(by_forces.empty());
  EXPECT_EQ(m.joints[static_cast<size_t>(m.FindJoint("B"))].kind, JointKind::kSpherical);
  EXPECT_EQ(m.joints[static_cast<size_t>(m.FindJoint("C"))].kind, JointKind::kSpherical);
  const Mobility mobility = AnalyseMobility(m);
  EXPECT_EQ(mobility.idle_spins, std::vector<std::string>{"rod"});
  EXPECT_EQ(mobility.undriven, 0);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("left out: n"), std::string::npos) << notes[0];
}

// A gripper whose fingers mimic each other, beside an arm; the first finger is between 0 and 0.06.
TEST(DefaultSetup, DrivesTurnToWhereTheRangesOfWhatFollowsLeaveRoomOrRest) {
  const test::TestFolder folder("gripper");
  for (const auto& [lower, upper, height] :
       {std::tuple(-0.06, 0.06, 1), {-0.06, 0.0, 1}, {0.0, 0.06, 0}}) {
    const std::string inertial =
        "<inertial><origin xyz='0.1 0 0'/><mass value='1'/><inertia ixx='0.01' iyy='0.01' "
        "izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial></link>";
    const std::string file = folder.Write(
        "gripper.urdf",
        "<robot name='gripper'><link name='base'/><link name='arm'>" + inertial +
            "<link name='left'>" + inertial + "<link name='right'>" + inertial +
            "<joint name='turn' type='continuous'><parent link='base'/><child link='arm'/><axis "
            "xyz='0 1 0'/></joint><joint name='l' type='prismatic'><parent link='arm'/><child "
            "link='left'/><axis xyz='0 1 0'/><limit lower='0' upper='0.06' effort='1' "
            "velocity='1'/></joint><joint name='r' type='prismatic'><parent link='arm'/><child "
            "link='right'/><axis xyz='0 1 0'/>" +
            fmt::format("<limit lower='{}' upper='{}' effort='1' velocity='1'/>", lower, upper) +
            "<mimic joint='l' multiplier='-1'/></joint></robot>");
    const DefaultSetupResult made = MakeDefaultSetup(file, "", "./model.yaml");
    ASSERT_TRUE(made.setup) << made.diagnostics.Text();
    const FirstMotion motion = FindFirstMotion(made.setup->mechanism, {});
    EXPECT_TRUE(motion.found);
    EXPECT_EQ(motion.without_room.size(), height == 0 ? 1u : 0u) << lower;
    EXPECT_EQ(std::ranges::count(motion.strokes, 0.0, &DriveStroke::height), height == 0 ? 1 : 0);
    EXPECT_EQ(SurveyFile(file, folder.PathOf("scratch")).status, "ok") << lower;
  }
}

// Whatever balls connect keeps its DOFs; those that no drive can hold move by forces.
TEST(DefaultSetup, BallsStayBalls) {
  const auto rod = [](const char* com, const char* inertia, const char* more) {
    return std::string(
               "name: rod\nworld: {frames: {A: [0, 0, 0], D: [0.5, 0, 0]}}\nbodies:\n"
               "  crank: {mass: 1, inertia: [0.01, 0.01, 0.01], frames: {end: [0.2, 0, 0]}}\n"
               "  rod: {mass: 1, com: ") +
           com + ", inertia: " + inertia +
           ", frames: {side: [0.2, 0.02, 0], end: [0.5, 0, 0]}}\n"
           "  rocker: {mass: 1, inertia: [0.01, 0.01, 0.01], frames: {end: [0.4, 0, 0]}}\n"
           "joints:\n"
           "  A: {kind: revolute, parent: world.A, child: crank, axis: z, guess: 1.1}\n"
           "  B: {kind: spherical, parent: crank.end, child: rod}\n"
           "  C: {kind: spherical, parent: rocker.end, child: rod.end}\n"
           "  D: {kind: revolute, parent: world.D, child: rocker, axis: z, guess: 1.2}\n"
           "drives: {m: {kind: joint, joint: A}}\n" +
           more;
  };
  std::string platform =
      "name: platform\n"
      "world: {frames: {P1: [0.3, 0, 0], P2: [-0.15, 0.26, 0], P3: [-0.15, -0.26, 0]}}\nbodies:\n"
      "  plate: {mass: 2, inertia: [0.02, 0.02, 0.04], frames: {C1: [0.2, 0, 0], C2: [-0.1, 0.17, "
      "0], C3: [-0.1, -0.17, 0]}}\n";
  std::string joints = "joints:\n";
  for (int i = 1; i <= 3; ++i) {
    platform += fmt::format(
        "  rod{}: {{mass: 0.3, com: [0, 0, -0.15], inertia: [0.003, 0.003, 0.0001], frames: {{end: "
        "[0, 0, -0.3]}}}}\n",
        i);
    joints += fmt::format(
        "  B{0}: {{kind: spherical, parent: world.P{0}, child: rod{0}}}\n"
        "  C{0}: {{kind: spherical, parent: rod{0}.end, child: plate.C{0}}}\n",
        i);
  }
  const std::string chain =
      "name: chain\nworld: {frames: {A: [0, 0, 0], D: [0.5, 0, 0]}}\nbodies:\n"
      "  crank: {mass: 1, inertia: [0.01, 0.01, 0.01], frames: {end: [0.2, 0, 0]}}\n"
      "  one: {mass: 1, com: [0.2, 0, 0], inertia: [0.001, 0.01, 0.01], frames: {end: [0.4, 0, "
      "0]}}\n"
      "  two: {mass: 1, com: [0.2, 0, 0], inertia: [0.001, 0.01, 0.01], frames: {end: [0.4, 0, "
      "0]}}\n"
      "  rocker: {mass: 1, inertia: [0.01, 0.01, 0.01], frames: {end: [0.4, 0, 0]}}\n"
      "joints:\n"
      "  A: {kind: revolute, parent: world.A, child: crank, axis: z, guess: 1.1}\n"
      "  B: {kind: spherical, parent: crank.end, child: one}\n"
      "  M: {kind: spherical, parent: one.end, child: two, guess: [0, 0.5, -0.9]}\n"
      "  C: {kind: spherical, parent: rocker.end, child: two.end}\n"
      "  D: {kind: revolute, parent: world.D, child: rocker, axis: z, guess: 1.2}\n";
  const char* kRound = "[0.001, 0.01, 0.01]";
  const char* kMiddle = "[0.25, 0, 0]";
  struct Case {
    const char* what;
    std::string model;
    int dofs, by_forces;
  };
  const std::vector<Case> cases = {
      {"a round rod", rod(kMiddle, kRound, ""), 1, 0},
      {"an uneven rod", rod(kMiddle, "[0.001, 0.01, 0.009]", ""), 2, 1},
      {"an eccentric rod", rod("[0.25, 0.01, 0]", kRound, ""), 2, 1},
      {"a rod with a spring beside its line",
       rod(kMiddle, kRound, "springs: {s: {from: world, to: rod.side, stiffness: 10}}\n"), 2, 1},
      {"a rod with an output", rod(kMiddle, kRound, "outputs: {rod: rod}\n"), 2, 1},
      {"a chain of two rods", chain, 3, 1},
      {"a platform on three rods", platform + joints, 3, 3},
      {"a body on one ball",
       "name: pendulum\nbodies: {bob: {mass: 1, com: [0.05, 0, -0.3], inertia: [0.01, 0.012, "
       "0.003]}}\njoints: {B: {kind: spherical, parent: world, child: bob}}\n",
       3, 3},
  };
  for (const Case& c : cases) {
    const LoadResult loaded = LoadModelText(c.model, "m.yaml");
    ASSERT_TRUE(loaded.mechanism) << c.what << loaded.diagnostics.Text();
    std::vector<std::string> notes;
    std::vector<Coordinate> by_forces;
    const Mechanism m = WithDriveForEachDof(*loaded.mechanism, &notes, &by_forces);
    EXPECT_EQ(AnalyseMobility(*loaded.mechanism).dofs, c.dofs) << c.what;
    EXPECT_EQ(AnalyseMobility(m).dofs, c.dofs) << c.what;
    EXPECT_EQ(static_cast<int>(by_forces.size()), c.by_forces) << c.what;
    EXPECT_EQ(static_cast<int>(m.drives.size()), c.dofs - c.by_forces) << c.what;
    for (size_t j = 0; j < m.joints.size(); ++j) {
      EXPECT_EQ(m.joints[j].kind, loaded.mechanism->joints[j].kind) << c.what;
    }
  }
}

// A ball pendulum from MJCF is surveyed with all its DOFs.
TEST(Survey, ABallPendulumSwingsFreely) {
  const test::TestFolder folder("survey_ball");
  const SurveyRow row = SurveyFile(
      folder.Write("bob.xml",
                   "<mujoco model=\"bob\"><worldbody><body name=\"bob\"><joint name=\"B\" "
                   "type=\"ball\"/><inertial pos=\"0.05 0 -0.3\" mass=\"1\" "
                   "diaginertia=\"0.01 0.012 0.003\"/></body></worldbody></mujoco>"),
      folder.PathOf("scratch"));
  EXPECT_EQ(row.status, "ok") << row.message;
  EXPECT_EQ(row.dofs, 3);
  EXPECT_TRUE(std::isnan(row.inverse_nrmse));
  EXPECT_NE(row.message.find("3 degrees of freedom"), std::string::npos) << row.message;
}

// A parallelogram 1° before its bars are in line, exact and but for rounding: there it may go on as
// a crossed one. The rods of the second meet so closely that the loop can be followed through.
TEST(DefaultSetup, TheFirstMotionKeepsAwayFromWhereAssembliesMeet) {
  for (const char* length : {"ground", "ground - 3e-7"}) {
    std::string text = Replaced(kFourBar, ", range_deg: [0, 170]", "");
    text =
        Replaced(text, "start: {}, end: [ground,", fmt::format("start: {{}}, end: [{},", length));
    for (const char* link : {"crank", "rocker"}) {
      const std::string foot = fmt::format("{}.foot, axis: z, guess_deg: ", link);
      text = Replaced(text, foot + "60", foot + "-1");
    }
    for (const char* end : {"start", "end"}) {
      const std::string joint = fmt::format("coupler.{}, axis: z, guess_deg: ", end);
      text = Replaced(text, joint + "-60", joint + "1");
    }
    const LoadResult loaded = LoadModelText(text, "four_bar.yaml");
    ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    const FirstMotion motion = FindFirstMotion(*loaded.mechanism, {});
    ASSERT_TRUE(motion.found);
    constexpr double kInLine = std::numbers::pi / 180.0;
    EXPECT_NEAR(motion.strokes[0].home, -kInLine, 1e-4);
    EXPECT_GT(motion.strokes[0].height, 1e-3) << length;
    EXPECT_LT(motion.strokes[0].height, kInLine) << length;
  }
}

TEST(DefaultSetup, TheFirstMotionKeepsToTheRanges) {
  LoadResult loaded = LoadModelText(kRod, "rod.yaml");
  ASSERT_TRUE(loaded.mechanism);
  std::vector<std::string> notes;
  std::vector<Coordinate> by_forces;
  Mechanism m = WithDriveForEachDof(*loaded.mechanism, &notes, &by_forces);
  const FirstMotion wide = FindFirstMotion(m, {});
  EXPECT_TRUE(wide.found);
  EXPECT_FALSE(wide.beyond_ranges);
  EXPECT_NEAR(wide.strokes[0].height, 0.2, 1e-12);
  // The rocker may hardly move.
  Joint& rocker = m.joints[m.FindJoint("D")];
  rocker.range[0] = {rocker.home[0] - 0.01, rocker.home[0] + 0.01};
  const FirstMotion narrow = FindFirstMotion(m, {});
  EXPECT_TRUE(narrow.found);
  EXPECT_LT(narrow.strokes[0].height, 0.06);
  rocker.range[0] = {rocker.home[0] + 0.01, rocker.home[0] + 0.02};
  EXPECT_TRUE(FindFirstMotion(m, {}).beyond_ranges);
  EXPECT_EQ(FindFirstMotion(m, {"m"}).strokes[0].height, 0.0);
}

}  // namespace
}  // namespace mbv
