// MJCF files as mechanisms.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <regex>
#include <utility>
#include <vector>

#include "base/files.h"
#include "features/robots/survey.h"
#include "features/run/default_setup.h"
#include "kinematics/mobility.h"
#include "math/spatial.h"
#include "mechanism/reach.h"
#include "model_file/mesh/inertia_diagnosis.h"
#include "model_file/write_model.h"
#include "tests/support/solids.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

// A four-bar linkage of sides 0.3, 0.5, 0.3, 0.5 m, upright at zero; `more` goes into <mujoco>,
// `joint` into the crank's joint.
std::string Linkage(const std::string& more = "", const std::string& joint = "",
                    const std::string& base = "") {
  return R"(<mujoco model="linkage"><compiler angle="radian"/><worldbody>
<body name="base">)" +
         base + R"(<inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
<body name="crank"><joint name="A" axis="0 1 0" )" +
         joint + R"(/><inertial pos="0 0 0.15" mass="1" diaginertia="0.01 0.01 0.001"/>
<site name="mark" pos="0 0 0.1"/>
<body name="coupler" pos="0 0 0.3"><joint name="B" axis="0 1 0"/>
<inertial pos="0.25 0 0" mass="1" diaginertia="0.001 0.02 0.02"/><geom type="box" size="0.25 0.01 0.01" pos="0.25 0 0"/></body></body>
<body name="rocker" pos="0.5 0 0"><joint name="D" axis="0 1 0"/>
<inertial pos="0 0 0.15" mass="1" diaginertia="0.01 0.01 0.001"/></body></body></worldbody>
<equality><connect name="C" body1="rocker" body2="coupler" anchor="0 0 0.3"/></equality>
<actuator><motor name="m" joint="A"/></actuator>)" +
         more + "</mujoco>\n";
}

LoadResult LoadText(const test::TestFolder& folder, const std::string& text) {
  return LoadRobot(folder.Write("robot.xml", text));
}

TEST(MjcfImport, ALinkageClosedByConnectIsAMechanism) {
  const test::TestFolder folder("mjcf_linkage");
  const LoadResult loaded = LoadText(folder, Linkage());
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  EXPECT_EQ(m.name, "linkage");
  ASSERT_EQ(m.bodies.size(), 5u);
  EXPECT_EQ(AnalyseMobility(m).dofs, 1);
  ASSERT_EQ(m.drives.size(), 1u);
  EXPECT_EQ(m.drives[0].name, "m");
  const Body& coupler = m.bodies[m.FindBody("coupler")];
  EXPECT_EQ(coupler.mass, 1.0);
  EXPECT_EQ(coupler.p_BoBcm_B, Vec3(0.25, 0, 0));
  EXPECT_NEAR(coupler.I_Bcm_B(1, 1), 0.02, 1e-15);
  ASSERT_EQ(coupler.shapes.size(), 1u);
  const NamedFrame* mark = m.FindFrame(m.FindBody("crank"), "mark");
  ASSERT_NE(mark, nullptr);
  EXPECT_EQ(mark->X_BF.translation(), Vec3(0, 0, 0.1));
  const Vec3 at_coupler = m.X_WB_home[m.FindBody("coupler")] * Vec3(0.5, 0, 0);
  EXPECT_LT((at_coupler - Vec3(0.5, 0, 0.3)).norm(), 1e-12);
}

TEST(MjcfImport, ItAgreesInBothModes) {
  const test::TestFolder folder("mjcf_agrees");
  const SurveyRow row = SurveyFile(folder.Write("robot.xml", Linkage()), folder.PathOf("scratch"));
  EXPECT_EQ(row.status, "ok") << row.message;
  EXPECT_LT(row.inverse_nrmse, 1e-10);
  EXPECT_LT(row.forward_nrmse, 1e-6);
}

// Two legs with motors at their feet carry a plate by connects; `plate` is the plate's joint and
// `ground` what the legs stand on.
std::string Carried(const std::string& plate, const std::string& ground = "") {
  std::string text = "<mujoco model='carried'><compiler angle='radian'/><worldbody>" + ground;
  if (!ground.empty()) text += "<inertial pos='0 0 0' mass='9' diaginertia='1 1 1'/>";
  for (const auto& [leg, x] : {std::pair("left", 0.0), {"right", 0.6}}) {
    text += fmt::format(
        "<body name='{0}' pos='{1} 0 0'><joint name='{0}_foot' axis='0 1 0'/><inertial pos='0 0 "
        "0.1' mass='1' diaginertia='0.01 0.01 0.001'/><body name='{0}_shank' pos='0 0 0.2'><joint "
        "name='{0}_knee' axis='0 1 0'/><inertial pos='0 0 0.2' mass='0.7' diaginertia='0.02 0.02 "
        "0.001'/></body></body>",
        leg, x);
  }
  if (!ground.empty()) text += "</body>";
  return text + "<body name='plate' pos='0.05 0 0.55'>" + plate +
         "<inertial pos='0.25 0 0.02' mass='2' diaginertia='0.1 0.1 0.2'/></body></worldbody>"
         "<equality>"
         "<weld name='left_hip' body1='left_shank' body2='plate' relpose='0.05 0 0.35 1 0 0 0'/>"
         "<connect name='right_hip' body1='plate' body2='right_shank' anchor='0.5 0 0'/></equality>"
         "<actuator><motor name='a' joint='left_foot'/><motor name='b' joint='right_foot'/>"
         "</actuator></mujoco>";
}

LoadOptions Holding(const std::string& base) {
  LoadOptions options;
  options.base = base;
  return options;
}

std::vector<std::string> LeftOut(const LoadResult& loaded) {
  return TextsOf(loaded.caveats, ModelCaveat::Kind::kLeftOut);
}

// A platform written as a free body moves: as a body of one of its legs it has the same forces.
TEST(MjcfImport, AFreeBodyThatLoopsCarryMoves) {
  const test::TestFolder folder("mjcf_carried");
  const LoadResult loaded = LoadText(folder, Carried("<freejoint name='float'/>"));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_EQ(loaded.mechanism->joints[loaded.mechanism->FindJoint("float")].kind, JointKind::kFree);
  EXPECT_TRUE(LeftOut(loaded).empty());
  EXPECT_NE(loaded.diagnostics.Text().find("plate is free to move"), std::string::npos);
  EXPECT_EQ(AnalyseMobility(*loaded.mechanism).dofs, 2);
  const SurveyRow row = SurveyFile(folder.PathOf("robot.xml"), folder.PathOf("scratch"));
  EXPECT_EQ(row.status, "ok") << row.message;
  std::string nested = Carried("");
  const std::string weld =
      nested.substr(nested.find("<weld"), nested.find("<connect") - nested.find("<weld"));
  const std::string plate =
      nested.substr(nested.find("<body name='plate'"),
                    nested.find("</worldbody>") - nested.find("<body name='plate'"));
  nested.replace(nested.find(weld), weld.size(), "");
  nested.replace(nested.find(plate), plate.size(), "");
  nested.insert(nested.find("</body></body>"),
                "<body name='plate' pos='0.05 0 0.35'>" + plate.substr(plate.find("<inertial")));
  const LoadResult as_leg = LoadText(folder, nested);
  ASSERT_TRUE(as_leg.mechanism) << as_leg.diagnostics.Text();
  const std::vector<double> force = TuneHomeServos(*loaded.mechanism).force;
  ASSERT_EQ(force.size(), 2u);
  for (size_t d = 0; d < 2; ++d) {
    EXPECT_GT(std::abs(force[d]), 0.1);
    EXPECT_NEAR(force[d], TuneHomeServos(*as_leg.mechanism).force[d], 1e-9);
  }
  // What pushes the floating body acts on its six coordinates.
  const LoadResult damped = LoadText(folder, Carried("<joint type='free' damping='3'/>"));
  ASSERT_TRUE(damped.mechanism) << damped.diagnostics.Text();
  EXPECT_TRUE(LeftOut(damped).empty());
  EXPECT_EQ(damped.mechanism->elements.size(), loaded.mechanism->elements.size() + 6);
}

TEST(MjcfImport, OfFloatingBodiesOneIsHeld) {
  const test::TestFolder folder("mjcf_base");
  const std::string text = Carried("<freejoint/>", "<body name='ground' pos='0 0 1'><freejoint/>");
  struct {
    const char* base;
    std::string held, error;
    Pose X;
  } cases[] = {{"", "ground", "", Pose(Eigen::Translation3d(0, 0, 1))},
               {"ground", "ground", "", Pose(Eigen::Translation3d(0, 0, 1))},
               {"plate", "plate", "", Pose(Eigen::Translation3d(0.05, 0, 0.55))},
               {"left_shank", "left_shank", "", Pose(Eigen::Translation3d(0, 0, 1.2))},
               {"shank", "", "base shank: there is no body of this name", {}}};
  for (const auto& at : cases) {
    // In the file's pose the ground is not where its legs would carry the plate.
    const std::string file = folder.Write("robot.xml", text);
    const LoadResult loaded = LoadRobot(file, Holding(at.base));
    ASSERT_EQ(loaded.mechanism.has_value(), at.error.empty()) << loaded.diagnostics.Text();
    if (!loaded.mechanism) {
      EXPECT_NE(loaded.diagnostics.Text().find(at.error), std::string::npos);
      continue;
    }
    const Mechanism& m = *loaded.mechanism;
    ASSERT_EQ(LeftOut(loaded).size(), 1u) << at.base;
    EXPECT_EQ(LeftOut(loaded)[0],
              "the free joint of " + at.held + " is left out: the body is held where it is");
    EXPECT_TRUE(m.X_WB_home[m.FindBody(at.held)].isApprox(at.X, 1e-12)) << at.base;
    EXPECT_EQ(AnalyseMobility(m).dofs, 2) << at.base;
  }
  const LoadResult tied =
      LoadRobot(folder.Write("tied.xml", Carried("<freejoint/>")), Holding("plate"));
  EXPECT_FALSE(tied.mechanism);
  EXPECT_NE(tied.diagnostics.Text().find("base plate: the body does not float"), std::string::npos);
}

// Three rods side by side, parallel to each other, and a coupler on top; each body's axes are
// turned at random, so that all numbers are printed with `digits` decimals.
std::string Rods(int digits, double spoilt = 0.0) {
  const auto text_of = [digits](const auto& numbers) {
    std::string text;
    for (const double x : numbers) text += fmt::format("{:.{}f} ", x, digits);
    return text;
  };
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const auto turn = [&] {
    const Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
    return Mat3(q.normalized().toRotationMatrix());
  };
  const Vec3 rod(0.05, 0, 0.24), feet[] = {{0, 0, 0}, {0.3, 0, 0.05}, {0.14, 0.06, 0.02}};
  const auto body = [&](const std::string& name, const Mat3& R_PB, const Vec3& p_PB,
                        const Mat3& R_WB, const std::string& inner) {
    const Eigen::Quaterniond q(R_PB);
    return fmt::format(
        "<body name='{0}' pos='{1}' quat='{2}'><joint name='j{0}' axis='{3}'/>"
        "<inertial pos='{4}' mass='0.5' diaginertia='0.01 0.01 0.01'/>{5}</body>",
        name, text_of(p_PB), text_of(std::array{q.w(), q.x(), q.y(), q.z()}),
        text_of(Vec3(R_WB.transpose() * Vec3::UnitY())),
        text_of(Vec3(R_WB.transpose() * Vec3(0.05, 0, 0.1))), inner);
  };
  const Mat3 R_coupler = turn();
  std::string bodies, connects;
  for (int i = 0; i < 3; ++i) {
    const Mat3 R = turn();
    const std::string name = fmt::format("rod{}", i);
    const Vec3 end = R.transpose() * (rod + Vec3(0, 0, i == 2 ? spoilt : 0));
    const std::string inner =
        i > 0 ? "" : body("coupler", R.transpose() * R_coupler, end, R_coupler, "");
    bodies += body(name, R, feet[i], R, inner);
    if (i == 0) continue;
    connects += fmt::format("<connect name='c{}' body1='{}' body2='coupler' anchor='{}'/>", i, name,
                            text_of(end));
  }
  return "<mujoco model='rods'><compiler angle='radian'/><worldbody>" + bodies +
         "</worldbody><equality>" + connects +
         "</equality><actuator><motor name='m' joint='jrod0'/></actuator></mujoco>";
}

// A platform on six tendons, a Stewart platform's legs without bodies.
std::string OnTendons(const std::string& tendon, const std::string& actuators) {
  std::string sites, on_platform, legs;
  for (int i = 0; i < 6; ++i) {
    const int pair = i / 2;
    const double base = std::numbers::pi / 180.0 * (120.0 * pair + (i % 2 == 0 ? -10.0 : 10.0));
    const double top = std::numbers::pi / 180.0 * (120.0 * pair + (i % 2 == 0 ? -50.0 : 50.0));
    sites += fmt::format("<site name='b{}' pos='{} {} 0'/>", i, 0.6 * std::cos(base),
                         0.6 * std::sin(base));
    on_platform += fmt::format("<site name='t{}' pos='{} {} 0'/>", i, 0.3 * std::cos(top),
                               0.3 * std::sin(top));
    legs += fmt::format(
        "<spatial name='leg{0}' {1}><site site='b{0}'/><site site='t{0}'/></spatial>", i, tendon);
  }
  return "<mujoco><worldbody>" + sites + "<body name='platform' pos='0 0 0.8'><freejoint/>" +
         on_platform + "<inertial pos='0 0 0.01' mass='10' diaginertia='0.2 0.2 0.4'/></body>" +
         "</worldbody><tendon>" + legs + "</tendon><actuator>" + actuators + "</actuator></mujoco>";
}

TEST(MjcfImport, AFreeBodyOnDrivenOrSpringyTendonsMovesUnlessItIsNamedAsTheBase) {
  const test::TestFolder folder("mjcf_on_tendons");
  std::string motors;
  for (int i = 0; i < 6; ++i) motors += fmt::format("<motor tendon='leg{}'/>", i);
  const auto kind = [&](const std::string& text, const std::string& base) {
    const LoadResult loaded = LoadRobot(folder.Write("robot.xml", text), Holding(base));
    EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    return loaded.mechanism->joints.at(0).kind;
  };
  EXPECT_EQ(kind(OnTendons("", motors), ""), JointKind::kFree);
  EXPECT_EQ(kind(OnTendons("", motors), "platform"), JointKind::kFixed);
  EXPECT_EQ(kind(OnTendons("stiffness='400'", ""), ""), JointKind::kFree);
  EXPECT_EQ(kind(OnTendons("", ""), ""), JointKind::kFixed);
  const SurveyRow row =
      SurveyFile(folder.Write("robot.xml", OnTendons("", motors)), folder.PathOf("scratch"));
  EXPECT_EQ(row.status, "ok") << row.message;
  EXPECT_EQ(row.dofs, 6);
  EXPECT_TRUE(row.caveats.empty());
  // On springs it swings, and its pose is what is compared.
  const SurveyRow swinging =
      SurveyFile(folder.Write("robot.xml", OnTendons("stiffness='400' damping='9'", "")),
                 folder.PathOf("scratch"));
  EXPECT_EQ(swinging.status, "ok") << swinging.message;
}

// Of what floats all coordinates move by forces, and the drives still go all the way.
TEST(MjcfImport, DrivesOfAFloatingRobotGoAsFarAsOfAHeldOne) {
  const test::TestFolder folder("mjcf_floating");
  const std::string file = folder.Write(
      "robot.xml",
      "<mujoco><worldbody><body name='trunk' pos='0 0 1'><freejoint/><inertial pos='0 0 0' "
      "mass='5' "
      "diaginertia='0.1 0.2 0.3'/><body name='leg' pos='0 0.1 0'><joint name='j' axis='0 1 0'/>"
      "<inertial pos='0.2 0 0' mass='1' diaginertia='0.01 0.01 0.01'/></body></body></worldbody>"
      "<actuator><motor joint='j'/></actuator></mujoco>");
  LoadOptions floating;
  floating.free_base = true;
  const auto stroke = [&](const LoadOptions& options, size_t notes) {
    const DefaultSetupResult made = MakeDefaultSetup(file, "", "./model.yaml", options);
    EXPECT_TRUE(made.setup) << made.diagnostics.Text();
    EXPECT_EQ(made.setup->notes.size(), notes);
    return FindFirstMotion(made.setup->mechanism, {}).strokes.at(0).height;
  };
  const double held = stroke({}, 0);
  EXPECT_GT(held, 0.1);
  EXPECT_EQ(stroke(floating, 1), held);
}

// Rounded numbers keep overconstrained loops from moving: what the printed digits explain is taken
// for rounding, and said; no more.
TEST(MjcfImport, LoopsThatOnlyPrintedDigitsKeepFromMovingMove) {
  const test::TestFolder folder("mjcf_rounded");
  for (const int digits : {4, 6, 8}) {
    const std::string file = folder.Write("robot.xml", Rods(digits));
    const LoadResult loaded = LoadRobot(file);
    ASSERT_TRUE(loaded.mechanism) << digits << loaded.diagnostics.Text();
    EXPECT_EQ(AnalyseMobility(*loaded.mechanism).dofs, 1) << digits;
    EXPECT_EQ(AnalyseMobility(*loaded.mechanism).redundant, 3) << digits;
    ASSERT_EQ(LeftOut(loaded).size(), 1u) << digits;
    EXPECT_NE(LeftOut(loaded)[0].find("joint frames moved by"), std::string::npos);
    const SurveyRow row = SurveyFile(file, folder.PathOf("scratch"));
    EXPECT_EQ(row.status, "ok") << digits << row.message;
    EXPECT_EQ(row.caveats.size(), 1u);
    // A rod that is longer by more than drawings differ is another mechanism.
    const double wrong = 2e-2;
    LoadOptions none;
    none.closure_tolerance_m = 0.0;
    const LoadResult strict = LoadRobot(file, none);
    EXPECT_TRUE(!strict.mechanism || AnalyseMobility(*strict.mechanism).dofs == 0) << digits;
    const LoadResult spoilt = LoadRobot(folder.Write("spoilt.xml", Rods(digits, wrong)));
    EXPECT_TRUE(!spoilt.mechanism || AnalyseMobility(*spoilt.mechanism).dofs == 0) << digits;
  }
  EXPECT_TRUE(LeftOut(LoadText(folder, Rods(17))).empty());
  // Less than that is taken for such, because the motor could not move otherwise.
  const LoadResult drawn = LoadText(folder, Rods(8, 3e-5));
  ASSERT_TRUE(drawn.mechanism) << drawn.diagnostics.Text();
  EXPECT_EQ(AnalyseMobility(*drawn.mechanism).dofs, 1);
  ASSERT_EQ(LeftOut(drawn).size(), 1u);
  EXPECT_NE(LeftOut(drawn)[0].find("m could not move otherwise"), std::string::npos);
}

// A model that was written as MJCF and read again has the same drives, and they hold its home with
// the same forces; springs, legs, elements and bodies that float in their loops come back.
TEST(MjcfImport, WhatIsExportedComesBack) {
  const test::TestFolder folder("mjcf_round_trip");
  int compared = 0;
  for (const char* name : {"four_bar", "spr_tripod", "stewart", "cabin_robot", "scara_robot",
                           "andrews_squeezer", "geared_press", "spring_cart"}) {
    const LoadResult shipped = LoadModel(SourcePath(fmt::format("/models/{}/model.yaml", name)));
    ASSERT_TRUE(shipped.mechanism) << name;
    const LoadResult back = LoadText(folder, MjcfFor(*shipped.mechanism, ModelDrives::kHeld).text);
    ASSERT_TRUE(back.mechanism) << name << back.diagnostics.Text();
    EXPECT_TRUE(LeftOut(back).empty()) << name << back.diagnostics.Text();
    const Mechanism &a = *shipped.mechanism, &b = *back.mechanism;
    ASSERT_EQ(a.drives.size(), b.drives.size()) << name;
    EXPECT_EQ(AnalyseMobility(a).dofs, AnalyseMobility(b).dofs) << name;
    const HomeServos expected = TuneHomeServos(a), got = TuneHomeServos(b);
    if (!expected.summary.ok()) continue;
    ASSERT_TRUE(got.summary.ok()) << name << got.summary.message;
    ++compared;
    double scale = 0.0;  // all weights, at arm's length
    for (const Body& body : a.bodies) scale += 9.81 * body.mass * CharacteristicLength(a);
    for (size_t d = 0; d < a.drives.size(); ++d) {
      EXPECT_NEAR(got.force[d], expected.force[d], 1e-9 * scale) << name << " " << a.drives[d].name;
    }
  }
  EXPECT_GE(compared, 6);
}

TEST(MjcfImport, WhatAMechanismCannotExpressIsAFinding) {
  const test::TestFolder folder("mjcf_lost");
  const LoadResult loaded = LoadText(
      folder,
      Linkage("<tendon><fixed name='t'><joint joint='A' coef='1'/></fixed></tendon>",
              "armature='0.1' damping='2' frictionloss='3' stiffness='4'", "<joint type='free'/>"));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const std::string said = loaded.diagnostics.Text();
  for (const char* lost : {"1 tendons are left out: they exert no force",
                           "the free joint of base is left out: the body is held where it is"}) {
    EXPECT_NE(said.find(lost), std::string::npos) << lost << "\n" << said;
  }
  ASSERT_EQ(loaded.caveats.size(), 1u);
  EXPECT_EQ(loaded.caveats[0].source, "body/freejoint");
  const LoadResult plain = LoadText(folder, Linkage());
  EXPECT_TRUE(plain.caveats.empty());
  EXPECT_EQ(plain.diagnostics.Text().find("left out"), std::string::npos)
      << plain.diagnostics.Text();
}

// Armature, damping and springs of hinges are force elements; of balls they are lost.
TEST(MjcfImport, WhatActsOnHingesIsAForceElement) {
  const test::TestFolder folder("mjcf_elements");
  const LoadResult loaded = LoadText(
      folder, Linkage("", "armature='0.1' damping='2' stiffness='4' springref='0.3' ref='0.1'"));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_EQ(loaded.diagnostics.Text().find("left out"), std::string::npos)
      << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  ASSERT_EQ(m.elements.size(), 3u);
  for (const ForceElement& element : m.elements) EXPECT_EQ(element.joint, m.FindJoint("A"));
  EXPECT_EQ(m.elements[0].name, "A_damping");
  EXPECT_EQ(std::get<DampingLaw>(m.elements[0].law).damping, 2.0);
  const auto& spring = std::get<SpringLaw>(m.elements[1].law);
  EXPECT_EQ(spring.polynomial, std::vector<double>{4.0});
  EXPECT_NEAR(spring.free, 0.3 - 0.1, 1e-15);  // from the reference
  EXPECT_EQ(std::get<RotorLaw>(m.elements[2].law).reflected(), 0.1);
}

// What acts on forces and is left out stands in the row, in its table and its JSON: never ok alone.
TEST(MjcfImport, AnAgreementWithoutAllForcesHasACaveat) {
  const test::TestFolder folder("mjcf_caveat");
  for (const bool fluid : {false, true}) {
    const std::string file =
        folder.Write("robot.xml", Linkage(fluid ? "<option density='1.2'/>" : ""));
    const SurveyRow row = SurveyFile(file, folder.PathOf("scratch"));
    EXPECT_EQ(row.status, "ok") << row.message;
    ASSERT_EQ(row.caveats.size(), fluid ? 1u : 0u);
    const std::string text =
        "the fluid's density 1.2 is left out: a fluid drags and lifts every body";
    EXPECT_EQ(SurveyTable({row}).find("caveat: not the whole robot: " + text) != std::string::npos,
              fluid);
    EXPECT_EQ(SurveyTable({row}).find("1 of 1 ok, 1 of them with caveats") != std::string::npos,
              fluid);
    EXPECT_EQ(SurveyJson({row}).find(text) != std::string::npos, fluid);
    EXPECT_EQ(SurveyCsv({row}).find(text) != std::string::npos, fluid);
    EXPECT_EQ(SurveyHtml({row}, "f").find("caveats") != std::string::npos, true);
  }
}

TEST(MjcfImport, FrictionLossIsDryFriction) {
  const test::TestFolder folder("mjcf_friction");
  const LoadResult loaded = LoadText(folder, Linkage("", "frictionloss='0.3'"));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  ASSERT_EQ(loaded.mechanism->elements.size(), 1u);
  const ForceElement& element = loaded.mechanism->elements[0];
  EXPECT_EQ(element.name, "A_friction");
  EXPECT_EQ(std::get<FrictionLaw>(element.law).coulomb, 0.3);
  EXPECT_EQ(std::get<FrictionLaw>(element.law).breakaway, 0.3);
  EXPECT_EQ(loaded.diagnostics.Text().find("left out"), std::string::npos)
      << loaded.diagnostics.Text();
}

TEST(MjcfImport, ARobotWithForceElementsAgreesInBothModes) {
  const test::TestFolder folder("mjcf_elements_agree");
  const SurveyRow row = SurveyFile(
      folder.Write("robot.xml", Linkage("",
                                        "armature='0.1' damping='2' stiffness='4' springref='0.3' "
                                        "frictionloss='0.2'")),
      folder.PathOf("scratch"));
  EXPECT_EQ(row.status, "ok") << row.message;
  EXPECT_LT(row.inverse_nrmse, 1e-10);
  EXPECT_LT(row.forward_nrmse, 1e-6);
}

// What later versions know: attribute, its element, and what the finding says.
TEST(MjcfImport, WhatOnlyNewerMuJoCoKnowsIsDroppedWithAFinding) {
  const test::TestFolder folder("mjcf_newer");
  const std::pair<const char*, const char*> newer[] = {
      {"<option><flag island='disable'/></option>", "attribute 'island' of <flag>"},
      {"<deformable/>", "element <deformable> (1 times)"}};
  for (const auto& [more, says] : newer) {
    const LoadResult loaded = LoadText(folder, Linkage(more, ""));
    ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    EXPECT_NE(loaded.diagnostics.Text().find(says), std::string::npos) << says << "\n"
                                                                       << loaded.diagnostics.Text();
  }
}

TEST(MjcfImport, JointsOfOneBodyBallsWeldsAndKeyframesAreRead) {
  const test::TestFolder folder("mjcf_joints");
  const LoadResult loaded = LoadText(folder, R"(<mujoco model="arm"><compiler angle="radian"/>
<worldbody><body name="a" pos="0 0 1" euler="0.3 0.2 -0.4">
<joint name="slide" type="slide" axis="1 0 0"/><joint name="turn" axis="0 0 1" pos="0 0.1 0"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<body name="b" pos="0 0 0.5"><joint name="ball" type="ball" pos="0 0 -0.1"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></body>
<body name="c" pos="2 0 0"><joint name="lone" axis="0 1 0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<body name="d" pos="0 0 0.2"><joint name="inner" axis="0 1 0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></body>
</worldbody>
<equality><weld name="w" body1="c" body2="d"/></equality>
<keyframe><key name="home" qpos="0.2 0.5 0.9238795325112867 0 0.3826834323650898 0 0 0"/></keyframe></mujoco>)");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  // MuJoCo's kinematics by hand: the slide along the body's x, the turn about the anchor, the ball.
  const Mat3 R0 = RotX(0.3) * RotY(0.2) * RotZ(-0.4);
  const Vec3 anchor(0, 0.1, 0);
  const Vec3 slid = Vec3(0, 0, 1) + R0 * Vec3(0.2, 0, 0);
  const Vec3 p_a = slid + R0 * (anchor - RotZ(0.5) * anchor);
  const Mat3 R_a = R0 * RotZ(0.5);
  const Pose& X_a = m.X_WB_home[m.FindBody("a")];
  EXPECT_LT((X_a.translation() - p_a).norm(), 1e-12);
  EXPECT_LT((X_a.linear() - R_a).norm(), 1e-12);
  const Mat3 R_b = R_a * RotY(std::numbers::pi / 4);
  const Vec3 p_b = p_a + R_a * Vec3(0, 0, 0.4) + R_b * Vec3(0, 0, 0.1);
  const Pose& X_b = m.X_WB_home[m.FindBody("b")];
  EXPECT_LT((X_b.translation() - p_b).norm(), 1e-12);
  EXPECT_LT((X_b.linear() - R_b).norm(), 1e-12);
  // The weld holds the two as they are at the reference.
  EXPECT_EQ(AnalyseMobility(m).dofs, 2 + 3 + 1);
  EXPECT_NE(loaded.diagnostics.Text().find("the keyframe 'home'"), std::string::npos);
}

// As MuJoCo 3.2 writes closures. The sites are a centimetre apart in the pose of the file: where
// they meet is in the sites, not in the pose.
std::string LinkageBySites(const std::string& closure) {
  std::string text = Linkage();
  const auto swap = [&](const std::string& from, const std::string& to) {
    const size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  };
  swap(R"(<connect name="C" body1="rocker" body2="coupler" anchor="0 0 0.3"/>)", closure);
  swap(R"(<body name="rocker" pos="0.5 0 0">)",
       R"(<body pos="0.5 0 0"><site name="top" pos="0 0 0.3"/>)");
  swap(R"(<body name="coupler" pos="0 0 0.3">)",
       R"(<body name="coupler" pos="0 0 0.3"><site name="end" pos="0.49 0 0"/>)");
  return text;
}

TEST(MjcfImport, ClosuresByTwoSitesMeetInTheSites) {
  const test::TestFolder folder("mjcf_sites");
  for (const char* closure : {R"(<connect site1="top" site2="end"/>)",
                              R"(<connect name="top_end" site1="end" site2="top"/>)"}) {
    const LoadResult loaded = LoadText(folder, LinkageBySites(closure));
    ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    const Mechanism& m = *loaded.mechanism;
    EXPECT_EQ(AnalyseMobility(m).dofs, 1);
    ASSERT_GE(m.FindJoint("top_end"), 0);
    const int rocker = m.FindBody("body_of_top"), coupler = m.FindBody("coupler");
    ASSERT_GE(rocker, 0);
    const Vec3 gap =
        m.X_WB_home[rocker] * Vec3(0, 0, 0.3) - m.X_WB_home[coupler] * Vec3(0.49, 0, 0);
    EXPECT_LT(gap.norm(), 1e-12) << closure;
  }
}

TEST(MjcfImport, AWeldBySitesMakesTheirAxesCoincide) {
  const test::TestFolder folder("mjcf_weld_sites");
  const LoadResult loaded = LoadText(folder, R"(<mujoco model="w"><worldbody>
<site name="hold" pos="0 0 1" quat="0.5 0.5 0.5 0.5"/>
<body name="a"><joint type="ball"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<body name="b" pos="0 0 1"><joint type="ball"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<site name="tip" quat="0.6 0 0.8 0"/></body></body></worldbody>
<equality><weld site1="hold" site2="tip"/></equality></mujoco>)");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  const Joint& weld = m.joints[m.FindJoint("hold_tip")];
  const Mat3 hold = (m.X_WB_home[weld.parent] * weld.X_PF).linear();
  const Mat3 tip = (m.X_WB_home[weld.child] * weld.X_CM).linear();
  EXPECT_LT((hold - tip).norm(), 1e-12);
  const Mat3 stated = Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5).toRotationMatrix();
  EXPECT_LT((hold - stated).norm(), 1e-12);
}

TEST(MjcfImport, ASiteThatIsMissingIsNamedWithItsLine) {
  const test::TestFolder folder("mjcf_no_site");
  const LoadResult loaded =
      LoadText(folder, LinkageBySites(R"(<connect site1="top" site2="endd"/>)"));
  EXPECT_FALSE(loaded.mechanism);
  EXPECT_NE(loaded.diagnostics.Text().find("<connect> names the site 'endd', which no body has"),
            std::string::npos)
      << loaded.diagnostics.Text();
}

// Left alone, MuJoCo 2.2 refuses a range that is not called limited.
TEST(MjcfImport, RangesHoldUnlessTheFileSaysOtherwise) {
  const test::TestFolder folder("mjcf_ranges");
  const auto upper = [&](const std::string& text) {
    const LoadResult loaded = LoadText(folder, text);
    EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    if (!loaded.mechanism) return kNan;
    const Joint& crank = loaded.mechanism->joints[loaded.mechanism->FindJoint("A")];
    const bool said = loaded.diagnostics.Text().find("1 range without") != std::string::npos;
    EXPECT_EQ(said, text.find("limited") == std::string::npos) << loaded.diagnostics.Text();
    return crank.range[0].upper;
  };
  EXPECT_EQ(upper(Linkage("", "range='-1 1.5'")), 1.5);
  EXPECT_EQ(upper(Linkage("", "range='-1 1.5' limited='true'")), 1.5);
  EXPECT_GT(upper(Linkage("", "range='-1 1.5' limited='false'")), 1e3);
  // The file's own word stays, and MuJoCo's refusal of it.
  const LoadResult own =
      LoadText(folder, Linkage("<compiler autolimits='false'/>", "range='-1 1.5'"));
  EXPECT_FALSE(own.mechanism);
  EXPECT_NE(own.diagnostics.Text().find("`range` but not `limited`"), std::string::npos);
}

TEST(MjcfImport, MeshesLieWhereTheFileStatesThem) {
  const test::TestFolder folder("mjcf_meshes");
  folder.Write("assets/part.stl", ToStl(test::BracketMesh(200, 120, 30, 60), ""));
  // The class gives type, pose and group; the asset's class the scale. MuJoCo would move the frame.
  const std::string text =
      R"(<mujoco><compiler angle="degree" meshdir="assets" exactmeshinertia="true"/>
<default><default class="mm"><mesh scale="0.001 0.001 0.001"/></default>
<default class="visual"><geom type="mesh" euler="0 0 90" group="1"/></default></default>
<asset><material name="red" rgba="1 0 0 1"/><mesh name="part" class="mm" file="part.stl"/><mesh name="gone" file="gone.stl"/>
<mesh name="outside" file="../../part.stl"/></asset><worldbody>
<body name="arm"><joint name="A" axis="0 1 0"/><inertial pos="0 0 0.15" mass="1" diaginertia="0.01 0.01 0.001"/>
<geom class="visual" mesh="part" pos="1 2 3" material="red"/><geom class="visual" mesh="part" pos="1 2 3"/>
<geom type="mesh" mesh="part" group="3"/><geom class="visual" mesh="gone"/>
<geom type="mesh" mesh="outside"/></body>
<body name="solid" pos="1 0 0"><joint name="B" axis="0 1 0"/><geom type="mesh" mesh="part" density="2700" pos="0 0 1"/></body>
</worldbody><actuator><motor name="a" joint="A"/><motor name="b" joint="B"/></actuator></mujoco>)";
  const LoadResult loaded = LoadText(folder, text);
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const std::string said = loaded.diagnostics.Text();
  EXPECT_NE(said.find("1 meshes are left out of the pictures"), std::string::npos) << said;
  EXPECT_NE(said.find("1 of 3 meshes is left out: 'assets/gone.stl' is not there"),
            std::string::npos)
      << said;
  const Mechanism& m = *loaded.mechanism;
  const Body& arm = m.bodies[m.FindBody("arm")];
  ASSERT_EQ(arm.shapes.size(), 1u);
  EXPECT_EQ(arm.shapes[0].color, "#ff0000ff");
  const Mesh& mesh = std::get<Mesh>(arm.shapes[0].geometry);
  EXPECT_TRUE((mesh.X_BG * Vec3(0.2, 0, 0)).isApprox(Vec3(1, 2.2, 3), 1e-9));
  EXPECT_NEAR(SolidShape(*mesh.surface).amount, 0.03 * 0.29 * 0.06, 1e-9);
  // MuJoCo's mass from the same mesh, where the geom stands.
  const Body& solid = m.bodies[m.FindBody("solid")];
  ASSERT_EQ(solid.shapes.size(), 1u);
  const Mesh& heavy = std::get<Mesh>(solid.shapes[0].geometry);
  EXPECT_NEAR(solid.mass, 2700 * 0.03 * 0.29 * 0.06, 1e-6);
  EXPECT_TRUE(solid.p_BoBcm_B.isApprox(heavy.X_BG * SolidShape(*heavy.surface).p_cm, 1e-6));
  // So the check of inertias finds it sound.
  EXPECT_TRUE(DiagnoseInertia(solid).findings.empty());
  EXPECT_NEAR(DiagnoseInertia(solid).density, 2700, 0.1);
}

TEST(MjcfImport, IncludesStayInTheFolder) {
  const test::TestFolder folder("mjcf_include");
  folder.Write("arm.xml",
               "<mujoco><worldbody><body name='x'><joint name='j' axis='0 0 1'/><inertial pos='0 0 "
               "0' mass='1' diaginertia='1 1 1'/></body></worldbody></mujoco>");
  const LoadResult loaded =
      LoadText(folder, "<mujoco model='i'><include file='arm.xml'/></mujoco>");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_GE(loaded.mechanism->FindBody("x"), 0);
  for (const char* outside : {"../arm.xml", "/etc/hostname", "missing.xml"}) {
    const LoadResult bad =
        LoadText(folder, fmt::format("<mujoco model='i'><include file='{}'/></mujoco>", outside));
    EXPECT_FALSE(bad.mechanism) << outside;
    EXPECT_NE(bad.diagnostics.Text().find("cannot be read"), std::string::npos)
        << bad.diagnostics.Text();
  }
}

TEST(MjcfImport, HostileFilesAreBadInput) {
  const test::TestFolder folder("mjcf_hostile");
  std::string deep = "<mujoco>";
  for (int i = 0; i < 5000; ++i) deep += "<a>";
  const std::pair<std::string, const char*> files[] = {
      {"<mujoco", "the file is not well-formed XML"},
      {"<robot/>", "no MJCF: the root element is not <mujoco>"},
      {deep, "elements are nested deeper than"},
      {"<mujoco><worldbody><body><joint type='hinge' axis='0 0 0'/></body></worldbody></mujoco>",
       "MuJoCo: "},
      {"<mujoco><worldbody><geom type='sphere' size='-1'/></worldbody></mujoco>", "MuJoCo: "},
      {"<mujoco><worldbody><frame euler='0 1'><body/></frame></worldbody></mujoco>",
       "<frame> euler = '0 1' is not 3 numbers"},
      {"<mujoco><worldbody><replicate count='2000000000'><body/></replicate></worldbody></mujoco>",
       "<replicate> makes more than 10000 elements"},
      {"<mujoco><equality><weld body1='q'/></equality></mujoco>", "MuJoCo: "}};
  for (const auto& [text, said] : files) {
    const LoadResult loaded = LoadText(folder, text);
    EXPECT_FALSE(loaded.mechanism) << text.substr(0, 80);
    EXPECT_TRUE(loaded.diagnostics.has_errors()) << text.substr(0, 80);
    EXPECT_NE(loaded.diagnostics.Text().find(said), std::string::npos) << text.substr(0, 80) << "\n"
                                                                       << loaded.diagnostics.Text();
  }
  // Nothing in it is a mechanism of nothing.
  const LoadResult empty = LoadText(folder, "<mujoco model='x'/>");
  ASSERT_TRUE(empty.mechanism) << empty.diagnostics.Text();
  EXPECT_EQ(empty.mechanism->bodies.size(), 1u);
}

TEST(MjcfImport, TheModelThatIsWrittenReadsBackToTheSameNumbers) {
  const test::TestFolder folder("mjcf_bits");
  const LoadResult first = LoadText(folder, Linkage("", "range='-1 1' limited='true'"));
  ASSERT_TRUE(first.mechanism) << first.diagnostics.Text();
  const LoadResult second = LoadModelText(WriteModel(*first.mechanism), "m.yaml");
  ASSERT_TRUE(second.mechanism) << second.diagnostics.Text();
  for (size_t b = 0; b < first.mechanism->bodies.size(); ++b) {
    EXPECT_EQ(first.mechanism->bodies[b].I_Bcm_B, second.mechanism->bodies[b].I_Bcm_B);
    EXPECT_EQ(first.mechanism->bodies[b].p_BoBcm_B, second.mechanism->bodies[b].p_BoBcm_B);
  }
  for (size_t j = 0; j < first.mechanism->joints.size(); ++j) {
    const Joint &a = first.mechanism->joints[j], &b = second.mechanism->joints[j];
    EXPECT_TRUE(a.X_PF.matrix() == b.X_PF.matrix()) << a.name;
    EXPECT_TRUE(a.X_CM.matrix() == b.X_CM.matrix()) << a.name;
    EXPECT_EQ(a.axis, b.axis) << a.name;
    EXPECT_EQ(a.range[0].upper, b.range[0].upper) << a.name;
  }
}

// A four-bar linkage in the x–z plane; angles from x at zero.
std::string FourBar(const std::array<double, 4>& side, const std::array<double, 3>& angle) {
  const auto body = [](const char* name, const std::string& at, double turn, double length) {
    return fmt::format(
        R"(<body name="{0}" {1} euler="0 {2} 0"><joint name="{0}" axis="0 -1 0"/>
<inertial pos="{3} 0 0" mass="0.5" diaginertia="1e-4 2e-3 2e-3"/>)",
        name, at, -turn, 0.5 * length);
  };
  return R"(<mujoco model="bars"><compiler angle="radian"/><worldbody>)" +
         body("crank", "", angle[0], side[0]) +
         body("coupler", fmt::format("pos=\"{} 0 0\"", side[0]), angle[1] - angle[0], side[1]) +
         "</body></body>" +
         body("rocker", fmt::format("pos=\"{} 0 0\"", side[3]), angle[2], side[2]) +
         fmt::format(R"(</body></worldbody>
<equality><connect name="C" body1="coupler" body2="rocker" anchor="{} 0 0"/></equality>
<actuator><motor name="m" joint="crank"/></actuator></mujoco>)",
                     side[1]);
}

// Stretched parallelograms may go on as such or as crossed ones: both agree with their constraints
// where all bars lie in line.
TEST(MjcfImport, SingularHomesAreLeftAsParallelograms) {
  const test::TestFolder folder("mjcf_singular");
  const double pi = std::numbers::pi;
  for (const std::string& text :
       {FourBar({0.3, 0.5, 0.3, 0.5}, {0, 0, 0}), FourBar({0.3, 0.5, 0.3, 0.5}, {pi, 0, pi}),
        FourBar({0.3, 0.3, 0.3, 0.3}, {0, 0, 0}), FourBar({0.5, 0.3, 0.5, 0.3}, {0, 0, 0})}) {
    const LoadResult loaded = LoadText(folder, text);
    ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    const Mechanism& m = *loaded.mechanism;
    EXPECT_NE(loaded.diagnostics.Text().find("the home pose is singular"), std::string::npos);
    EXPECT_EQ(AnalyseMobility(m).dofs, 1);
    EXPECT_NEAR(m.joints[m.FindJoint("crank")].home[0], 0.1, 1e-12);
    // Parallel: the coupler does not turn, the rocker turns as the crank does.
    EXPECT_LT((m.X_WB_home[m.FindBody("coupler")].linear() - Mat3::Identity()).norm(), 1e-9);
    EXPECT_NEAR(m.joints[m.FindJoint("rocker")].home[0], 0.1, 1e-9);
    const SurveyRow row = SurveyFile(folder.PathOf("robot.xml"), folder.PathOf("scratch"));
    EXPECT_EQ(row.status, "ok") << row.message;
    EXPECT_LT(row.inverse_nrmse, 1e-10);
    EXPECT_LT(row.forward_nrmse, 1e-6);
  }
}

// Beside it by a little, or with sides that differ, home is what the file says.
TEST(MjcfImport, RegularHomesStayWhereTheyAre) {
  const test::TestFolder folder("mjcf_regular");
  for (const std::string& text : {FourBar({0.3, 0.5, 0.3, 0.5}, {0.01, 0, 0.01}),
                                  FourBar({0.2, 0.5, 0.2, 0.5}, {1.2, 0, 1.2})}) {
    const LoadResult loaded = LoadText(folder, text);
    ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    EXPECT_EQ(loaded.diagnostics.Text().find("singular"), std::string::npos);
    EXPECT_NEAR(loaded.mechanism->joints[loaded.mechanism->FindJoint("crank")].home[0], 0.0, 1e-12);
  }
}

TEST(MjcfImport, BodiesWhoseMeshIsMissingAreNamedAllAtOnce) {
  const test::TestFolder folder("mjcf_missing_mesh");
  const auto robot = [](const std::string& base, const std::string& finger,
                        const std::string& compiler = "") {
    return R"(<mujoco model="hand"><compiler meshdir="assets" )" + compiler + R"(/>
<default><default class="seen"><geom type="mesh" mass="0"/></default></default>
<asset><mesh name="base" file="base.stl"/><mesh file="finger.stl"/></asset><worldbody>
<body name="base">)" +
           base + R"(<joint name="a" axis="0 1 0"/><body name="finger">
<joint name="b" axis="1 0 0"/>)" +
           finger + "</body></body></worldbody></mujoco>";
  };
  const std::string inertial = R"(<inertial pos="0 0 0.1" mass="1" diaginertia="1 1 1"/>)";
  const std::string mesh = R"(<geom type="mesh" mesh=")";
  const LoadResult both =
      LoadText(folder, robot(mesh + "base\" mass=\"0.3\"/>", mesh + "finger\"/>"));
  EXPECT_FALSE(both.mechanism);
  for (const char* part : {"body 'base' states no inertia", "'base.stl'",
                           "body 'finger' states no inertia", "'finger.stl'", "<inertial"}) {
    EXPECT_NE(both.diagnostics.Text().find(part), std::string::npos) << part;
  }
  // Stated ones, and geoms without mass, need no mesh.
  for (const std::string& of_finger : std::vector<std::string>{
           mesh + "finger\"/>" + inertial, R"(<geom class="seen" mesh="finger"/>)" + inertial,
           R"(<geom class="seen" mesh="finger"/><geom size="0.1" contype="0" conaffinity="0"/>)",
           mesh + "finger\" density=\"0\"/><geom size=\"0.1\" contype=\"0\" conaffinity=\"0\"/>"}) {
    const LoadResult loaded = LoadText(folder, robot(mesh + "base\"/>" + inertial, of_finger));
    EXPECT_TRUE(loaded.mechanism) << of_finger << loaded.diagnostics.Text();
  }
  // Unless the compiler takes the geoms all the same.
  EXPECT_FALSE(LoadText(folder, robot(mesh + "base\"/>" + inertial, mesh + "finger\"/>" + inertial,
                                      R"(inertiafromgeom="true")"))
                   .mechanism);
}

// Of points alone, some of which are no corners: mass and centre of their hull, by hand. Vertices
// are single precision.
TEST(MjcfImport, MeshesHaveTheMassOfTheirVolume) {
  const test::TestFolder folder("mjcf_hull");
  const LoadResult loaded = LoadText(folder, R"(<mujoco model="hull"><asset>
<mesh name="frustum" vertex="-1 -1 0  1 -1 0  1 1 0  -1 1 0  -0.5 -0.5 1  0.5 -0.5 1  0.5 0.5 1  -0.5 0.5 1  0 0 0.5  0 0 0"/>
</asset><worldbody><body name="b"><joint name="a" axis="0 1 0"/>
<geom type="mesh" mesh="frustum" contype="0" conaffinity="0"/></body></worldbody></mujoco>)");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Body& body = loaded.mechanism->bodies[loaded.mechanism->FindBody("b")];
  // Frustum of sides 2 and 1, height 1: V = (4 + 1 + 2)/3, its centre at z = (4 + 2·2 + 3·1)/(4·7).
  EXPECT_NEAR(body.mass, 1000.0 * 7.0 / 3.0, 1e-7 * body.mass);
  EXPECT_NEAR(body.p_BoBcm_B.z(), 11.0 / 28.0, 1e-7);
  EXPECT_LT(body.p_BoBcm_B.head<2>().norm(), 1e-7);
}

// A trough of 3 m³, as MuJoCo 3.14 compiles it by its default (inertia="legacy").
TEST(MjcfImport, MeshesThatAreNotConvexWeighWhatMuJoCo3Computes) {
  const test::TestFolder folder("mjcf_trough");
  const LoadResult loaded = LoadText(folder, R"(<mujoco><asset><mesh name="m"
vertex="0 0 0 3 0 0 3 0 2 2.5 0 2 2.5 0 0.5 0.5 0 0.5 0.5 0 2 0 0 2 0 1 0 3 1 0 3 1 2 2.5 1 2 2.5 1 0.5 0.5 1 0.5 0.5 1 2 0 1 2"
face="0 1 4 8 12 9 0 4 5 8 13 12 1 2 3 9 11 10 1 3 4 9 12 11 0 5 6 8 14 13 0 6 7 8 15 14 0 9 1 0 8 9 1 10 2 1 9 10 2 11 3 2 10 11 3 12 4 3 11 12 4 13 5 4 12 13 5 14 6 5 13 14 6 15 7 6 14 15 7 8 0 7 15 8"/>
</asset><worldbody><body name="b"><joint name="a" axis="0 1 0"/>
<geom type="mesh" mesh="m" density="1" contype="0" conaffinity="0"/></body></worldbody></mujoco>)");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Body& body = loaded.mechanism->bodies[loaded.mechanism->FindBody("b")];
  EXPECT_NEAR(body.mass, 5.507533037138299, 1e-6);
  EXPECT_LT((body.p_BoBcm_B - Vec3(1.5, 0.5, 0.8806497778537252)).norm(), 1e-6);
}

// The class of a geom may state its mesh, its type and its density; a geom may have another mesh.
TEST(MjcfImport, MeshesOfClassesCountAsTheGeomsOwn) {
  const test::TestFolder folder("mjcf_class_mesh");
  const auto box = [](const char* name, double x) {
    return fmt::format(
        "<mesh name='{0}' vertex='0 0 0  {1} 0 0  0 1 0  {1} 1 0  0 0 1  {1} 0 1  0 1 1  {1} 1 "
        "1'/>",
        name, x);
  };
  // Without classes, by a class, and with another one than that of the class, which is nowhere.
  for (const auto& [of_class, own] : {std::pair("", "type='mesh' mesh='tip' density='300'"),
                                      {"type='mesh' mesh='tip' density='300'", ""},
                                      {"type='mesh' mesh='none' density='300'", "mesh='tip'"}}) {
    const LoadResult loaded = LoadText(
        folder, fmt::format("<mujoco><default><default class='seen'><geom contype='0' "
                            "conaffinity='0' {}/></default></default><asset>{}{}</asset>"
                            "<worldbody><body name='b'><joint name='a' axis='0 1 0'/><geom "
                            "class='seen' {}/></body></worldbody></mujoco>",
                            of_class, box("tip", 2.0), box("other", 1.0), own));
    ASSERT_TRUE(loaded.mechanism) << of_class << loaded.diagnostics.Text();
    const Body& body = loaded.mechanism->bodies[loaded.mechanism->FindBody("b")];
    EXPECT_NEAR(body.mass, 600.0, 1e-4) << of_class;
    EXPECT_LT((body.p_BoBcm_B - Vec3(1, 0.5, 0.5)).norm(), 1e-6) << of_class;
  }
}

// A wrist on three rods, whose balls at the cranks have forces. The spins are held by the balls at
// the plate, where nothing acts, and the forces at the cranks stay.
TEST(MjcfImport, SpinsOfRodsAreHeldWhereNoForceActs) {
  const test::TestFolder folder("mjcf_rods");
  const std::string wrist =
      ReadWholeFile(SourcePath("/tests/web/robots/ball_wrist.xml")).value_or("");
  const auto on_rods = [&](const std::string& of_ball) {
    const std::regex hinges(
        R"re(<joint name="u(\d)" axis="1 0 0"/><joint name="v\d" axis="0 1 0"/>)re");
    return std::regex_replace(wrist, hinges, "<joint name=\"b$1\" type=\"ball\" " + of_ball + "/>");
  };
  // Elements that are left on a ball.
  const auto count_forces = [&](const std::string& of_ball) {
    const std::string file = folder.Write("robot.xml", on_rods(of_ball));
    const SurveyRow row = SurveyFile(file, folder.PathOf("scratch"));
    EXPECT_EQ(row.status, "ok") << of_ball << row.message;
    EXPECT_LT(row.inverse_nrmse, 1e-10);
    EXPECT_LT(row.forward_nrmse, 1e-6);
    const DefaultSetupResult made = MakeDefaultSetup(file, "rods", "model.yaml");
    EXPECT_TRUE(made.setup) << made.diagnostics.Text();
    const Mechanism& m = made.setup->mechanism;
    if (!of_ball.empty()) {
      EXPECT_EQ(m.joints[m.FindJoint("b0")].kind, JointKind::kSpherical);
      EXPECT_EQ(m.joints[m.FindJoint("tip0")].kind, JointKind::kUniversal);
    }
    return static_cast<int>(std::ranges::count_if(m.elements, [&](const ForceElement& element) {
      return element.joint == m.FindJoint("b0");
    }));
  };
  EXPECT_EQ(count_forces(""), 0);
  EXPECT_EQ(count_forces(R"(damping="0.03" armature="0.001" frictionloss="0.005")"), 9);
}

}  // namespace
}  // namespace mbv
