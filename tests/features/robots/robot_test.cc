// Robots from files as a user types it: run, init --from, model --format yaml, survey.
#include <gtest/gtest.h>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

// A four-bar linkage cut at its coupler's end.
constexpr const char* kRobot = R"(<robot name="linkage">
<link name="base"/>
<link name="crank"><inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.001" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="coupler"><inertial><origin xyz="0.25 0 0"/><mass value="1"/><inertia ixx="0.001" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="rocker"><inertial><origin xyz="0.2 0 0"/><mass value="1"/><inertia ixx="0.001" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="A"/><link name="B"/>
<joint name="motor" type="continuous"><parent link="base"/><child link="crank"/><axis xyz="0 1 0"/></joint>
<joint name="elbow" type="continuous"><parent link="crank"/><child link="coupler"/><origin xyz="0.2 0 0"/><axis xyz="0 1 0"/></joint>
<joint name="pivot" type="continuous"><parent link="base"/><child link="rocker"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/></joint>
<joint name="fa" type="fixed"><parent link="coupler"/><child link="A"/><origin xyz="0.5 0 0"/></joint>
<joint name="fb" type="fixed"><parent link="rocker"/><child link="B"/><origin xyz="0.4 0 0"/></joint>
</robot>
)";

class RobotCommands : public testing::Test {
 protected:
  RobotCommands() {
    Write("robot.urdf", kRobot);
    Write("robot.yaml", "closed_loop: [[A, B]]\ntype: [3d]\nname_mot: [motor]\n");
  }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(mbverify.folder() / name) << text;
  }
  [[nodiscard]] std::string Path(const std::string& name) const {
    return (mbverify.folder() / name).string();
  }
  Program mbverify{std::string("robot_") +
                   testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(RobotCommands, RunTakesARobotAsItIs) {
  const ProgramResult run =
      mbverify("run " + Path("robot.urdf") + " --no-pictures --quiet --out " + mbverify.Out());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("AGREE"), std::string::npos) << run.out;
  EXPECT_TRUE(std::filesystem::exists(mbverify.folder() / "out/linkage/setup/model.yaml"));
  EXPECT_EQ(mbverify("check " + Path("robot.urdf")).exit_code, 0);
}

// The file's own settings are information: whatever they do, the verdict and its exit code stay.
TEST_F(RobotCommands, RunReportsWhatTheFilesOwnSettingsDo) {
  Write("own.xml", R"(<mujoco model="own"><compiler angle="radian"/>
<default><equality solref="0.06 1" solimp="0.5 0.5 0.001 0.5 2"/></default><worldbody>
<body name="crank"><joint name="A" axis="0 1 0"/><inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.001"/>
<body name="coupler" pos="0 0 0.2"><joint name="B" axis="0 1 0"/><inertial pos="0.25 0 0.1" mass="1" diaginertia="0.001 0.02 0.02"/></body></body>
<body name="rocker" pos="0.5 0 0"><joint name="D" axis="0 1 0"/><inertial pos="0 0 0.2" mass="1" diaginertia="0.01 0.01 0.001"/></body></worldbody>
<equality><connect name="C" body1="rocker" body2="coupler" anchor="0 0 0.4"/></equality>
<actuator><motor name="m" joint="A"/></actuator></mujoco>)");
  const std::string command = "run " + Path("own.xml") + " --no-pictures --out " + mbverify.Out();
  const ProgramResult run = mbverify(command);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("AGREE"), std::string::npos) << run.out;
  for (const char* said : {"your file's drive forces are off by", "what makes it wrong",
                           "pasted before </mujoco>", "<default><equality solref="}) {
    EXPECT_NE(run.out.find(said), std::string::npos) << said << "\n" << run.out;
  }
  const std::filesystem::path folder = mbverify.folder() / "out/own/setup/first";
  EXPECT_NE(ReadAll(folder / "summary.json").find("\"source_model\""), std::string::npos);
  EXPECT_NE(ReadAll(folder / "report.html").find("Your source file, run as it is"),
            std::string::npos);

  const ProgramResult without = mbverify(command + " --no-own-file");
  EXPECT_EQ(without.exit_code, 0) << without.err;
  EXPECT_EQ(without.out.find("your file's"), std::string::npos) << without.out;
  EXPECT_EQ(ReadAll(folder / "summary.json").find("\"source_model\""), std::string::npos);
}

TEST_F(RobotCommands, InitWritesAModelAndAScenarioThatAgree) {
  const ProgramResult init = mbverify("init my_robot --from " + Path("robot.urdf") + " --into " +
                                      mbverify.folder().string());
  ASSERT_EQ(init.exit_code, 0) << init.err;
  const ProgramResult run =
      mbverify("run " + Path("scenarios/my_robot/first.yaml") +
               " --no-pictures --quiet --mode inverse --out " + mbverify.Out());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("my_robot / first: AGREE"), std::string::npos) << run.out;
}

TEST_F(RobotCommands, TheModelAsYamlIsAModelFile) {
  const ProgramResult model =
      mbverify("model " + Path("robot.urdf") + " --format yaml --out " + Path("model.yaml"));
  ASSERT_EQ(model.exit_code, 0) << model.err;
  const ProgramResult check = mbverify("check " + Path("model.yaml"));
  EXPECT_EQ(check.exit_code, 0) << check.out;
}

TEST_F(RobotCommands, ASurveyHasARowForEachAndStopsAtNone) {
  std::filesystem::create_directories(mbverify.folder() / "bad");
  Write("bad/broken.urdf", "<robot name='x'><link");
  const std::string out = Path("survey");
  const ProgramResult survey = mbverify("survey " + mbverify.folder().string() + " --out " + out);
  EXPECT_EQ(survey.exit_code, 0) << survey.out << survey.err;  // the bad one is the file's fault
  EXPECT_NE(survey.out.find("1 of 2 ok"), std::string::npos) << survey.out;
  const std::string csv = ReadAll(std::filesystem::path(out) / "survey.csv");
  EXPECT_NE(csv.find("bad/broken.urdf,refused,"), std::string::npos) << csv;
  EXPECT_NE(csv.find("robot.urdf,ok,"), std::string::npos) << csv;
  EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(out) / "survey.html"));

  // What does not end in time is a failed row, not the end.
  const ProgramResult late = mbverify("survey " + mbverify.folder().string() + " --timeout 0.001");
  EXPECT_EQ(late.exit_code, 3);
  EXPECT_NE(late.out.find("not finished after 0.001 s"), std::string::npos) << late.out;
  EXPECT_EQ(mbverify("survey " + Path("survey")).exit_code, 2);
}

TEST_F(RobotCommands, ABadSdfFileIsBadInput) {
  Write("bad.sdf",
        "<sdf version='1.9'><model name='m'>\n<link name='a'><inertial><mass>x</mass>"
        "</inertial></link></model></sdf>");
  for (const char* command : {"run ", "check ", "model ", "init new_robot --from "}) {
    const ProgramResult bad = mbverify(command + Path("bad.sdf"));
    EXPECT_EQ(bad.exit_code, 2) << command;
    EXPECT_NE((bad.out + bad.err).find("bad.sdf:2:1: error: <mass> 'x' of 'a' is not a finite"),
              std::string::npos)
        << command << bad.out << bad.err;
  }
}

TEST_F(RobotCommands, ASurveySaysWhatItPassesOver) {
  Write("x.urdf.xacro", "<robot/>");
  Write("launch.xml", "<launch/>");
  Write("part.xml", "<mujoco/>");
  Write("light.sdf", "<sdf version='1.9'><light name='sun'/></sdf>");
  const ProgramResult survey = mbverify("survey " + mbverify.folder().string());
  for (const char* words :
       {"x.urdf.xacro is passed over: expand it first: xacro ",
        "launch.xml is passed over: no MJCF", "part.xml is passed over: a part of a model",
        "light.sdf is passed over: it holds no <model>"}) {
    EXPECT_NE(survey.err.find(words), std::string::npos) << words << survey.err;
  }
  EXPECT_NE(survey.out.find("1 of 1 ok"), std::string::npos) << survey.out;
  for (const char* command : {"run ", "check ", "model "}) {
    const ProgramResult xacro = mbverify(command + Path("x.urdf.xacro"));
    EXPECT_EQ(xacro.exit_code, 2) << command;
    EXPECT_NE((xacro.out + xacro.err).find("expand it first: xacro "), std::string::npos)
        << command << xacro.out << xacro.err;
  }
}

}  // namespace
}  // namespace mbv
