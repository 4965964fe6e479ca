// URDF files as exporters write them: frames as links, closure files beside them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "kinematics/mobility.h"
#include "model_file/load_model.h"
#include "model_file/write_model.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

std::string Link(const std::string& name, double mass, double inertia, double x = 0.0) {
  return fmt::format(
      R"(<link name="{0}"><inertial><origin xyz="{3} 0 0"/><mass value="{1}"/>)"
      R"(<inertia ixx="{2}" iyy="{2}" izz="{2}" ixy="0" ixz="0" iyz="0"/></inertial></link>)"
      "\n",
      name, mass, inertia, x);
}
std::string Hinge(const std::string& name, const std::string& parent, const std::string& child,
                  double x) {
  return fmt::format(R"(<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/>)"
                     R"(<origin xyz="{} 0 0"/><axis xyz="0 0 1"/></joint>)"
                     "\n",
                     name, parent, child, x);
}
std::string Fixed(const std::string& parent, const std::string& child, double x) {
  return fmt::format(
      R"(<joint name="{1}_frame" type="fixed"><parent link="{0}"/><child link="{1}"/>)"
      R"(<origin xyz="{2} 0 0"/></joint>)"
      "\n",
      parent, child, x);
}

// A four-bar linkage 0.2, 0.5, 0.4, 0.5 in a row, cut at C, whose ends are frames of 1e-9 kg.
std::string CutFourBar(const std::string& more = "") {
  return "<robot name=\"cut four-bar\">\n" + Link("base", 5, 0.1) + Link("crank", 1, 1e-3, 0.1) +
         Link("coupler", 1, 2e-2, 0.25) + Link("rocker", 1, 1e-2, 0.2) + Link("C_A", 1e-9, 0) +
         Link("C_B", 1e-9, 0) + Hinge("A", "base", "crank", 0) +
         Hinge("B", "crank", "coupler", 0.2) + Hinge("D", "base", "rocker", 0.5) +
         Fixed("coupler", "C_A", 0.5) + Fixed("rocker", "C_B", 0.4) + more + "</robot>\n";
}

constexpr const char* kClosures = "closed_loop: [[C_A, C_B]]\ntype: [3d]\nname_mot: [A]\n";

TEST(UrdfDialects, ARobotWithItsClosureFileIsReadFromTheUrdfAlone) {
  const test::TestFolder folder("dialects_bare");
  folder.Write("robot.yaml", kClosures);
  const LoadResult loaded = LoadModel(folder.Write("arm.urdf", CutFourBar()));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  EXPECT_EQ(m.name, "cut_four_bar");
  EXPECT_EQ(m.bodies.size(), 5u);  // the frames are no bodies
  ASSERT_EQ(m.drives.size(), 1u);
  EXPECT_EQ(m.drives[0].name, "A");
  EXPECT_EQ(AnalyseMobility(m).dofs, 1);
  const Vec3 a = m.X_WB_home[m.FindBody("coupler")] * Vec3(0.5, 0, 0);
  const Vec3 b = m.X_WB_home[m.FindBody("rocker")] * Vec3(0.4, 0, 0);
  EXPECT_LT((a - b).norm(), 1e-12);

  // One warning says how many, and where the mass went; another that the base is held.
  const std::string said = loaded.diagnostics.Text();
  EXPECT_NE(said.find("2 links are taken as frames of the bodies that carry them (C_A, C_B), their "
                      "2e-09 kg went to coupler, rocker"),
            std::string::npos)
      << said;
  EXPECT_NE(said.find("the root link 'base' is held"), std::string::npos) << said;
  double mass = 0.0;
  for (const Body& body : m.bodies) mass += body.mass;
  EXPECT_NEAR(mass, 8.0 + 2e-9, 1e-15);
  ASSERT_NE(m.FindFrame(m.FindBody("coupler"), "C_A"), nullptr);
}

TEST(UrdfDialects, CutJointsOfCadExportersCloseLoopsAsHinges) {
  const test::TestFolder folder("dialects_cuts");
  // Where the cut hinge is while all joints are at zero.
  folder.Write(
      "config/loop_closures.yaml",
      "closures:\n  - {link_a: coupler, link_b: rocker, point: [0.6, 0.3, 0], axis: [0, 0, 1]}\n"
      "independent: [A]\n");
  const LoadResult loaded = LoadModel(folder.Write("arm.urdf", CutFourBar()));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  const auto cut = std::find_if(m.joints.begin(), m.joints.end(),
                                [](const Joint& joint) { return joint.closure; });
  ASSERT_NE(cut, m.joints.end());
  EXPECT_EQ(cut->kind, JointKind::kRevolute);
  EXPECT_EQ(AnalyseMobility(m).dofs, 1);
  EXPECT_EQ(AnalyseMobility(m).redundant, 3);
  EXPECT_EQ(m.drives.size(), 1u);
}

TEST(UrdfDialects, AMisspeltNameGetsTheNearestOne) {
  const test::TestFolder folder("dialects_slip");
  folder.Write("robot.yaml", "closed_loop: [[C_A, C_BB]]\nname_mot: [AA]\n");
  const LoadResult loaded = LoadModel(folder.Write("arm.urdf", CutFourBar()));
  EXPECT_FALSE(loaded.mechanism);
  const std::string said = loaded.diagnostics.Text();
  EXPECT_NE(said.find("there is no link or joint 'C_BB'"), std::string::npos) << said;
  EXPECT_NE(said.find("did you mean 'C_B'?"), std::string::npos) << said;
  EXPECT_NE(said.find("robot.yaml:1:"), std::string::npos) << said;

  folder.Write("robot.yaml", "closed_loop: []\n");
  folder.Write("cut.yaml", "closures: [{link_a: coupler, link_b: roker, point: [0, 0, 0]}]\n");
  const LoadResult cut = LoadModel(folder.Write("cut.urdf", CutFourBar()));
  EXPECT_NE(cut.diagnostics.Text().find("did you mean 'rocker'?"), std::string::npos)
      << cut.diagnostics.Text();
}

TEST(UrdfDialects, AChainOfFramesEndsOnItsCarrier) {
  const test::TestFolder folder("dialects_chain");
  const LoadResult loaded = LoadModel(folder.Write(
      "r.urdf", "<robot name=\"r\">" + Link("base", 1, 1) + Link("arm", 1, 1) + Link("f1", 0, 0) +
                    Link("f2", 1e-9, 0) + Hinge("A", "base", "arm", 0) + Fixed("arm", "f1", 1) +
                    Fixed("f1", "f2", 0.5) + "</robot>"));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  const NamedFrame* frame = m.FindFrame(m.FindBody("arm"), "f2");
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->X_BF.translation(), Vec3(1.5, 0, 0));
  EXPECT_EQ(m.bodies.size(), 3u);
}

TEST(UrdfDialects, ALightLinkWithoutInertiaGoesToItsCarrierAndAHeavyOneIsAMassPoint) {
  const test::TestFolder folder("dialects_point");
  const auto robot = [&](double mass) {
    return LoadModel(folder.Write("r.urdf", "<robot name=\"r\">" + Link("base", 1, 1) +
                                                Link("arm", 1, 1) + Link("tool", mass, 0) +
                                                Hinge("A", "base", "arm", 0) +
                                                Fixed("arm", "tool", 2) + "</robot>"));
  };
  const LoadResult light = robot(1e-3);
  ASSERT_TRUE(light.mechanism) << light.diagnostics.Text();
  const Body& arm = light.mechanism->bodies[light.mechanism->FindBody("arm")];
  EXPECT_DOUBLE_EQ(arm.mass, 1.001);
  EXPECT_NEAR(arm.p_BoBcm_B.x(), 2e-3 / 1.001, 1e-15);
  // Steiner: 1 + μ d² with the reduced mass μ.
  EXPECT_NEAR(arm.I_Bcm_B(2, 2), 1.0 + 1e-3 / 1.001 * 4.0, 1e-14);
  EXPECT_NEAR(arm.I_Bcm_B(0, 0), 1.0, 1e-14);
  EXPECT_NE(light.diagnostics.Text().find("mass point: tool (0.001 kg)"), std::string::npos)
      << light.diagnostics.Text();

  const LoadResult heavy = robot(0.1);
  ASSERT_TRUE(heavy.mechanism) << heavy.diagnostics.Text();
  EXPECT_EQ(heavy.mechanism->bodies[heavy.mechanism->FindBody("tool")].mass, 0.1);
  EXPECT_NE(heavy.diagnostics.Text().find(
                "impossible inertia of tool: mass = 0.1 without inertia, taken as it is"),
            std::string::npos)
      << heavy.diagnostics.Text();
}

TEST(UrdfDialects, NextToNothingBetweenTwoJointsIsAConnectingPiece) {
  const test::TestFolder folder("dialects_piece");
  const LoadResult loaded = LoadModel(
      folder.Write("r.urdf", "<robot name=\"r\">" + Link("base", 1, 1) + Link("cross", 1e-9, 0) +
                                 Link("arm", 1, 1) + Link("marker", 1e-9, 0) +
                                 Hinge("A", "base", "cross", 0) + Hinge("B", "cross", "arm", 1) +
                                 Hinge("idle", "arm", "marker", 1) + "</robot>"));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  EXPECT_EQ(m.bodies[m.FindBody("cross")].mass, 0.0);
  EXPECT_EQ(m.FindBody("marker"), -1);  // moves nothing of mass
  EXPECT_EQ(AnalyseMobility(m).dofs, 2);
  const std::string said = loaded.diagnostics.Text();
  EXPECT_NE(said.find("the joints idle move nothing of mass and are held at zero"),
            std::string::npos)
      << said;
  EXPECT_NE(said.find("massless connecting piece (cross)"), std::string::npos) << said;
}

TEST(UrdfDialects, LinksThatAModelFileWritesOnStayBodies) {
  const test::TestFolder folder("dialects_keep");
  folder.Write("r.urdf", "<robot name=\"r\">" + Link("base", 1, 1) + Link("tip", 0, 0) +
                             Fixed("base", "tip", 1) + "</robot>");
  const LoadResult loaded =
      LoadModel(folder.Write("m.yaml", "name: m\nurdf: r.urdf\nattach: {tip: {f: [0, 0, 1]}}\n"));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_GE(loaded.mechanism->FindBody("tip"), 0);
  // Otherwise the frame is found under the link's name.
  const LoadResult output =
      LoadModel(folder.Write("o.yaml", "name: m\nurdf: r.urdf\noutputs: {tool: tip}\n"));
  ASSERT_TRUE(output.mechanism) << output.diagnostics.Text();
  EXPECT_EQ(output.mechanism->outputs[0].X_BO.translation(), Vec3(1, 0, 0));
}

// Of a robot that nothing ties to the world another link than the root can be held, where the file
// has it; also one that is a frame.
TEST(UrdfBase, AnyLinkCanBeHeld) {
  const test::TestFolder folder("urdf_base");
  const auto link = [](const char* name, double mass) {
    return fmt::format(
        "<link name='{}'><inertial><mass value='{}'/><inertia ixx='1' iyy='1' "
        "izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>",
        name, mass);
  };
  const std::string file = folder.Write(
      "robot.urdf", "<robot name='r'>" + link("torso", 5) + link("leg", 2) +
                        "<link name='sole'/>"
                        "<joint name='hip' type='continuous'><parent link='torso'/><child "
                        "link='leg'/><origin xyz='0.1 0 -0.4' rpy='0 0.3 0'/><axis xyz='0 1 0'/>"
                        "</joint><joint name='ankle' type='fixed'><parent link='leg'/><child "
                        "link='sole'/><origin xyz='0 0 -0.5'/></joint></robot>");
  for (const char* base : {"", "torso", "leg", "sole", "so1e"}) {
    LoadOptions options;
    options.base = base;
    const LoadResult loaded = LoadModel(file, options);
    if (std::string(base) == "so1e") {
      EXPECT_FALSE(loaded.mechanism);
      const std::string said = loaded.diagnostics.Text();
      EXPECT_NE(said.find("base so1e: there is no link of this name"), std::string::npos) << said;
      EXPECT_NE(said.find("did you mean 'sole'?"), std::string::npos) << said;
      continue;
    }
    ASSERT_TRUE(loaded.mechanism) << base << loaded.diagnostics.Text();
    const Mechanism& m = *loaded.mechanism;
    const bool is_root = std::string(base).empty() || std::string(base) == "torso";
    EXPECT_GE(m.FindJoint(is_root ? "torso.weld" : "leg.weld"), 0) << base;
    // All stands where the file has it.
    EXPECT_LT(m.X_WB_home[m.FindBody("torso")].translation().norm(), 1e-15) << base;
    EXPECT_LT((m.X_WB_home[m.FindBody("leg")].translation() - Vec3(0.1, 0, -0.4)).norm(), 1e-15);
  }
}

// What exporters leave behind and nothing depends on is no error, and what does is said.
TEST(UrdfDialects, FlawsThatForcesDoNotDependOnAreTaken) {
  const test::TestFolder folder("urdf_flaws");
  const auto joint = [](const char* name, const char* type, const char* child, const char* more) {
    return fmt::format(
        "<joint name='{}' type='{}'><parent link='base'/><child link='{}'/><axis "
        "xyz='0 1 0'/>{}</joint>",
        name, type, child, more);
  };
  const auto link = [](const char* name, const char* inertia) {
    return fmt::format(
        "<link name='{}'><inertial><origin xyz='0.1 0 0'/><mass value='1'/><inertia "
        "{} ixy='0' ixz='0' iyz='0'/></inertial><visual><geometry><box size='0 0 "
        "0'/></geometry></visual></link>",
        name, inertia);
  };
  // No name; shapes without size; impossible inertias and a mass point; a mimic that is fixed, one
  // of a fixed joint; a link without mass at the end.
  const LoadResult loaded = LoadModel(folder.Write(
      "robot.urdf",
      "<robot><link name='base'/>" + link("arm", "ixx='1' iyy='1' izz='3'") +
          link("point", "ixx='0' iyy='0' izz='0'") + link("rod", "ixx='0' iyy='2' izz='2'") +
          link("held", "ixx='1' iyy='1' izz='1'") + link("follower", "ixx='1' iyy='1' izz='1'") +
          "<link name='finger'/>" + joint("a", "continuous", "arm", "") +
          joint("b", "continuous", "point", "") + joint("c", "fixed", "rod", "<mimic joint='a'/>") +
          joint("f", "continuous", "follower", "<mimic joint='d' multiplier='2' offset='0.1'/>") +
          joint("d", "continuous", "held", "<mimic joint='c' offset='0.25'/>") +
          joint("e", "continuous", "finger", "") + "</robot>"));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  // One that another joint leads, or follows, stays.
  const LoadResult coupled = LoadModel(folder.Write(
      "coupled.urdf", "<robot name='r'><link name='base'/><link name='left'/><link name='right'/>" +
                          link("arm", "ixx='1' iyy='1' izz='1'") +
                          joint("a", "continuous", "arm", "") +
                          joint("l", "continuous", "left", "<mimic joint='a'/>") +
                          joint("r", "continuous", "right", "<mimic joint='l'/>") + "</robot>"));
  ASSERT_TRUE(coupled.mechanism) << coupled.diagnostics.Text();
  EXPECT_EQ(coupled.mechanism->couplings.size(), 2u);
  EXPECT_EQ(AnalyseMobility(*coupled.mechanism).dofs, 1);
  const Mechanism& m = *loaded.mechanism;
  EXPECT_EQ(AnalyseMobility(m).dofs, 2);
  EXPECT_EQ(m.FindBody("finger"), -1);
  for (const Body& body : m.bodies) EXPECT_TRUE(body.shapes.empty()) << body.name;
  EXPECT_NEAR(m.X_WB_home[m.FindBody("held")].linear()(0, 2), std::sin(0.25), 1e-12);
  EXPECT_NEAR(m.X_WB_home[m.FindBody("follower")].linear()(0, 2), std::sin(0.6), 1e-12);
  const std::string said = loaded.diagnostics.Text();
  for (const char* what :
       {"impossible inertia of arm: principal inertias 1, 1, 3 kg m² violate I1 + I2 >= I3, taken",
        "impossible inertia of point: mass = 1 without inertia, taken",
        "impossible inertia of rod: principal inertias 0, 2, 2 kg m² violate I > 0, taken",
        "joint 'c' is fixed and does not follow 'a'",
        "joint 'd' follows 'c', which is fixed: it is held at 0.25",
        "the joints e move nothing of mass and are held at zero"}) {
    EXPECT_NE(said.find(what), std::string::npos) << what << "\n" << said;
  }
  // Its model file allows what the robot's file has.
  const std::string text = WriteModel(m);
  EXPECT_NE(text.find("allow: impossible_inertia"), std::string::npos);
  const LoadResult back = LoadModelText(text, "model.yaml");
  EXPECT_TRUE(back.mechanism) << back.diagnostics.Text();
  EXPECT_EQ(TextsOf(back.caveats, ModelCaveat::Kind::kAllowed).size(), 3u);
  // An inertia that is negative is beyond that.
  const LoadResult negative = LoadModel(
      folder.Write("negative.urdf", "<robot name='n'><link name='base'/>" +
                                        link("arm", "ixx='-1' iyy='1' izz='1'") +
                                        joint("a", "continuous", "arm", "") + "</robot>"));
  EXPECT_FALSE(negative.mechanism);
}

}  // namespace
}  // namespace mbv
