// SDF files through the whole program: closed loops, as MJCF closes them.
#include <gtest/gtest.h>

#include <filesystem>

#include "features/robots/survey.h"
#include "kinematics/mobility.h"
#include "tests/support/test_folder.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

constexpr const char* kMjcf = R"(<mujoco model="linkage"><compiler angle="radian"/>
<option gravity="0 0 -9.81"/><worldbody>
<body name="base"><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
<body name="crank"><joint name="A" axis="0 1 0"/><inertial pos="0 0 0.15" mass="1" diaginertia="0.01 0.01 0.001"/>
<body name="coupler" pos="0 0 0.3"><joint name="B" axis="0 1 0"/>
<inertial pos="0.25 0 0" mass="1" diaginertia="0.001 0.02 0.02"/></body></body>
<body name="rocker" pos="0.5 0 0"><joint name="D" axis="0 1 0"/>
<inertial pos="0 0 0.15" mass="1" diaginertia="0.01 0.01 0.001"/></body></body></worldbody>
<equality><connect name="C" body1="rocker" body2="coupler" anchor="0 0 0.3"/></equality>
<actuator><motor name="A" joint="A"/></actuator></mujoco>
)";

// `mass`: of the coupler.
std::string FourBarSdf(const std::string& mass = "1") {
  return R"(<sdf version="1.9"><model name="linkage">
<link name="base"><inertial><mass>2</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>
<joint name="base_fixed" type="fixed"><parent>world</parent><child>base</child></joint>
<link name="crank"><inertial><pose>0 0 0.15 0 0 0</pose><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.001</izz></inertia></inertial></link>
<link name="coupler"><pose>0 0 0.3 0 0 0</pose><inertial><pose>0.25 0 0 0 0 0</pose><mass>)" +
         mass +
         R"(</mass><inertia><ixx>0.001</ixx><iyy>0.02</iyy><izz>0.02</izz></inertia></inertial></link>
<link name="rocker"><pose>0.5 0 0 0 0 0</pose><inertial><pose>0 0 0.15 0 0 0</pose><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.001</izz></inertia></inertial></link>
<joint name="A" type="continuous"><parent>base</parent><child>crank</child><axis><xyz>0 1 0</xyz></axis></joint>
<joint name="B" type="continuous"><parent>crank</parent><child>coupler</child><axis><xyz>0 1 0</xyz><limit><effort>0</effort></limit></axis></joint>
<joint name="D" type="continuous"><parent>base</parent><child>rocker</child><axis><xyz>0 1 0</xyz><limit><effort>0</effort></limit></axis></joint>
<joint name="C" type="ball"><pose>0 0 0.3 0 0 0</pose><parent>coupler</parent><child>rocker</child></joint>
</model></sdf>
)";
}

// The drive's inertia at home, and what holds it there.
HomeServos AtHome(const Mechanism& m) { return TuneHomeServos(m); }

TEST(SdfLoop, AFourBarIsThatOfMjcf) {
  const test::TestFolder folder("sdf_loop");
  const LoadResult mjcf = LoadRobot(folder.Write("robot.xml", kMjcf));
  const LoadResult sdf = LoadRobot(folder.Write("robot.sdf", FourBarSdf()));
  ASSERT_TRUE(mjcf.mechanism) << mjcf.diagnostics.Text();
  ASSERT_TRUE(sdf.mechanism) << sdf.diagnostics.Text();
  EXPECT_TRUE(sdf.diagnostics.empty()) << sdf.diagnostics.Text();
  EXPECT_EQ(AnalyseMobility(*sdf.mechanism).dofs, AnalyseMobility(*mjcf.mechanism).dofs);
  ASSERT_EQ(sdf.mechanism->drives.size(), 1u);
  EXPECT_EQ(sdf.mechanism->drives[0].name, "A");
  const HomeServos ours = AtHome(*sdf.mechanism), theirs = AtHome(*mjcf.mechanism);
  ASSERT_TRUE(ours.summary.ok()) << ours.summary.message;
  ASSERT_EQ(ours.kp.size(), 1u);
  EXPECT_NEAR(ours.kp[0], theirs.kp[0], 1e-9 * theirs.kp[0]);
  EXPECT_NEAR(ours.force[0], theirs.force[0], 1e-12);
  // Another mass is another robot.
  const LoadResult other = LoadRobot(folder.Write("robot.sdf", FourBarSdf("1.001")));
  EXPECT_GT(std::abs(AtHome(*other.mechanism).kp[0] - theirs.kp[0]), 1e-4 * theirs.kp[0]);
}

TEST(SdfLoop, ItAgreesInBothModes) {
  const test::TestFolder folder("sdf_agrees");
  const SurveyRow row =
      SurveyFile(folder.Write("robot.sdf", FourBarSdf()), folder.PathOf("scratch"));
  EXPECT_EQ(row.status, "ok") << row.message;
  EXPECT_EQ(row.loops, 1);
  EXPECT_TRUE(row.caveats.empty()) << row.caveats.front();
  EXPECT_LT(row.inverse_nrmse, 1e-10);
  EXPECT_LT(row.forward_nrmse, 1e-6);
}

TEST(SdfLoop, AXacroFileIsNamedWithTheCommandThatExpandsIt) {
  const LoadResult loaded = LoadRobot("my robot.urdf.xacro");
  EXPECT_FALSE(loaded.mechanism);
  EXPECT_NE(loaded.diagnostics.Text().find("xacro 'my robot.urdf.xacro' > 'my robot.urdf'"),
            std::string::npos)
      << loaded.diagnostics.Text();
}

}  // namespace
}  // namespace mbv
