// The generated MJCF: text against committed files, then what MuJoCo makes of it.
#include "simulation/mjcf/mjcf.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "mechanism/joint_pose.h"
#include "model_file/load_model.h"
#include "simulation/engine/engine_model.h"
#include "simulation/mjcf/plan.h"
#include "tests/mechanisms/simulated.h"
#include "tests/support/shipped.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using simulation::EngineModel;
using simulation::EngineSession;

std::string ReadFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

// Empty, or the first difference: words must be equal, numbers equal to 1e-11 (other machines'
// sines may differ in the last digits).
std::string FirstDifference(const std::string& a, const std::string& b) {
  const std::regex word("[^\\s\"<>=/]+");
  auto i = std::sregex_iterator(a.begin(), a.end(), word);
  auto j = std::sregex_iterator(b.begin(), b.end(), word);
  for (const std::sregex_iterator end; i != end || j != end; ++i, ++j) {
    if (i == end || j == end) return "one text ends early";
    const std::string x = i->str(), y = j->str();
    if (x == y) continue;
    char *x_end = nullptr, *y_end = nullptr;
    const double p = std::strtod(x.c_str(), &x_end), q = std::strtod(y.c_str(), &y_end);
    const bool numbers = *x_end == '\0' && *y_end == '\0';
    if (!numbers || std::abs(p - q) > 1e-11 * (1.0 + std::abs(p))) return x + " is not " + y;
  }
  return {};
}

// With MBV_UPDATE_GOLDEN set, writes the file instead.
void ExpectGolden(const std::string& text, const std::string& path) {
  if (std::getenv("MBV_UPDATE_GOLDEN") != nullptr) {
    std::ofstream(path, std::ios::binary) << text;
    return;
  }
  EXPECT_EQ(FirstDifference(ReadFile(path), text), "")
      << path << " is out of step; write it anew with MBV_UPDATE_GOLDEN=1 test_mjcf";
}

const std::string kModels = std::string(kSourceDir) + "/models/";
Mechanism LoadNamed(const std::string& name) {
  LoadResult result = LoadModel(kModels + name + "/model.yaml");
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return result.mechanism.has_value() ? *std::move(result.mechanism) : fixtures::MakeFourBar();
}

// Every mechanism these tests run on.
std::vector<Mechanism> AllMechanisms() {
  std::vector<Mechanism> all;
  for (const std::string& name : ShippedModelNames()) all.push_back(LoadNamed(name));
  all.push_back(fixtures::MakeFourBar());
  all.push_back(fixtures::MakeFourBar(JointKind::kSpherical));
  all.push_back(fixtures::MakeFourBar(JointKind::kRevolute, true));
  all.push_back(fixtures::MakeJointZoo(false));
  all.push_back(fixtures::MakeJointZoo(true));
  return all;
}

struct Compiled {
  std::vector<std::string> warnings;
  std::string mjcf;
  EngineModel engine;
  simulation::DataHandle data;

  explicit Compiled(const Mechanism& mechanism) : mjcf(WriteMjcf(mechanism)) {
    EngineSession session(&warnings);
    EXPECT_TRUE(MakeEngineModel(mechanism, mjcf, &engine).ok());
    data = simulation::MakeData(*engine.m);
    mj_kinematics(engine.m.get(), data.get());
  }
};

TEST(Mjcf, AFourBarIsWrittenAsCommitted) {
  ExpectGolden(WriteMjcf(fixtures::MakeFourBar()),
               std::string(kSourceDir) + "/tests/simulation/four_bar.xml");
}

TEST(Mjcf, TheGoldenComparisonNoticesAChangedNumberAndAChangedWord) {
  const std::string text = WriteMjcf(fixtures::MakeFourBar());
  Mechanism perturbed = fixtures::MakeFourBar();
  perturbed.bodies[1].mass *= 1.0 + 1e-9;
  EXPECT_NE(FirstDifference(text, WriteMjcf(perturbed)), "");
  EXPECT_NE(FirstDifference(text, WriteMjcf(fixtures::MakeFourBar(JointKind::kSpherical))), "");
}

TEST(Mjcf, ShippedModelsAreInStepWithTheirCommittedMjcf) {
  int committed = 0;
  for (const std::string& name : ShippedModelNames()) {
    const std::string mjcf = kModels + name + "/" + name + ".xml";
    if (!std::filesystem::exists(mjcf)) continue;
    ExpectGolden(WriteMjcf(LoadNamed(name)), mjcf);
    ++committed;
  }
  EXPECT_GT(committed, 0);
}

TEST(Mjcf, MillimetresAreTheDecimalsThatWereTyped) {
  const std::string text = WriteMjcf(LoadNamed("four_bar"));  // bar: {value_mm: 9}
  EXPECT_NE(text.find("size=\"0.009\""), std::string::npos) << text;
  EXPECT_EQ(text.find("0.00900"), std::string::npos) << text;
}

TEST(Mjcf, IsDeterministic) {
  const Mechanism m = LoadNamed("stabilizing_platform");
  EXPECT_EQ(WriteMjcf(m), WriteMjcf(m));
}

TEST(Mjcf, LoadsWithoutWarnings) {
  for (const Mechanism& m : AllMechanisms()) {
    const Compiled compiled(m);
    EXPECT_TRUE(compiled.warnings.empty()) << m.name << ": " << compiled.warnings.front();
  }
}

TEST(Mjcf, BodiesStandAtTheHomePose) {
  for (const Mechanism& m : AllMechanisms()) {
    const Compiled compiled(m);
    std::vector<Pose> X_WB;
    BodyPoses(compiled.engine, *compiled.data, &X_WB);
    for (size_t b = 0; b < m.bodies.size(); ++b) {
      // A chain of ten products of poses of size 10 m.
      EXPECT_LT((X_WB[b].matrix() - m.X_WB_home[b].matrix()).lpNorm<Eigen::Infinity>(), 1e-13)
          << m.name << " " << m.bodies[b].name;
    }
  }
}

TEST(Mjcf, MassesAndInertiasAddUpToTheDescription) {
  for (const Mechanism& m : AllMechanisms()) {
    const Compiled compiled(m);
    const mjModel& model = *compiled.engine.m;
    std::vector<double> mass(m.bodies.size(), 0.0);
    std::vector<Mat3> inertia(m.bodies.size(), Mat3::Zero());
    for (size_t p = 1; p < compiled.engine.plan.bodies.size(); ++p) {
      const int id = compiled.engine.body_id[p], b = compiled.engine.plan.bodies[p].body;
      const double* q = model.body_iquat + 4 * id;
      const Mat3 R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
      const Eigen::Map<const Vec3> moments(model.body_inertia + 3 * id);
      mass[b] += model.body_mass[id];
      inertia[b] += R * moments.asDiagonal() * R.transpose();
      if (model.body_mass[id] > 0.0) {
        EXPECT_LT((Eigen::Map<const Vec3>(model.body_ipos + 3 * id) - m.bodies[b].p_BoBcm_B)
                      .lpNorm<Eigen::Infinity>(),
                  1e-15);
      }
    }
    double total = 0.0;
    for (const Body& body : m.bodies) total += body.mass;
    for (size_t b = 1; b < m.bodies.size(); ++b) {
      const double tiny = compiled.engine.plan.tiny_mass[b] ? mjcf::kTinyMassFraction * total : 0.0;
      EXPECT_NEAR(mass[b], m.bodies[b].mass + tiny, 1e-14 * m.bodies[b].mass) << m.bodies[b].name;
      if (tiny > 0.0) continue;
      EXPECT_LE((inertia[b] - m.bodies[b].I_Bcm_B).norm(), 1e-14 * m.bodies[b].I_Bcm_B.norm())
          << m.name << " " << m.bodies[b].name;
    }
  }
}

// Free and ball joints have no coordinates in common with the mechanism; all others must agree.
TEST(Mjcf, JointPositionsAreTheMechanismsCoordinates) {
  for (const bool reversed : {false, true}) {
    const Mechanism m = fixtures::MakeJointZoo(reversed);
    const Compiled compiled(m);
    std::vector<std::array<double, 6>> q(m.joints.size());
    for (size_t j = 0; j < m.joints.size(); ++j) {
      q[j] = m.joints[j].home;
      for (int k = 0; k < DofsOf(m.joints[j].kind); ++k) {
        const int id = mj_name2id(compiled.engine.m.get(), mjOBJ_JOINT,
                                  mjcf::JointName(m.joints[j], k).c_str());
        ASSERT_GE(id, 0) << m.joints[j].name;
        const int adr = compiled.engine.m->jnt_qposadr[id];
        EXPECT_EQ(compiled.data->qpos[adr], m.joints[j].home[k]);
        q[j][k] += 0.3 + 0.1 * k - 0.07 * static_cast<double>(j);
        compiled.data->qpos[adr] = q[j][k];
      }
    }
    mj_kinematics(compiled.engine.m.get(), compiled.data.get());
    std::vector<Pose> X_WB;
    BodyPoses(compiled.engine, *compiled.data, &X_WB);
    const std::vector<Pose> expected = TreePoses(m, q);
    for (size_t b = 0; b < m.bodies.size(); ++b) {
      EXPECT_LT((X_WB[b].matrix() - expected[b].matrix()).lpNorm<Eigen::Infinity>(), 1e-14)
          << m.bodies[b].name << (reversed ? " reversed" : "");
    }
  }
}

TEST(Mjcf, MasslessConnectingPiecesAreMergedIntoOneBody) {
  const Mechanism m = LoadNamed("stabilizing_platform");
  const mjcf::Plan plan = mjcf::MakePlan(m);
  EXPECT_LT(plan.body_of[m.FindBody("ship_heave")], 0);
  EXPECT_LT(plan.body_of[m.FindBody("ship_roll")], 0);
  const int ship = plan.body_of[m.FindBody("ship")];
  ASSERT_GE(ship, 0);
  ASSERT_EQ(plan.bodies[ship].joints.size(), 3u);
  EXPECT_EQ(plan.bodies[ship].joints[0].name, "heave");
  EXPECT_EQ(plan.bodies[ship].joints[2].name, "pitch");
  for (bool tiny : plan.tiny_mass) EXPECT_FALSE(tiny);
}

TEST(Mjcf, AMasslessBodyInALoopGetsATinyMass) {
  Mechanism m = fixtures::MakeFourBar();
  m.bodies[2].mass = 0.0;
  m.bodies[2].I_Bcm_B.setZero();
  const Compiled compiled(m);
  EXPECT_TRUE(compiled.engine.plan.tiny_mass[2]);
  EXPECT_NE(compiled.mjcf.find("massless in the mechanism"), std::string::npos);
}

TEST(Mjcf, AnyClosingJointIsRepresentedWithItsOwnDegreesOfFreedom) {
  // A hinge that closes the loop is kept as a hinge, between two welded halves of the rocker.
  const Compiled compiled(fixtures::MakeFourBar());
  const mjModel& m = *compiled.engine.m;
  EXPECT_EQ(m.nv, 4);
  ASSERT_EQ(compiled.engine.plan.closures.size(), 1u);
  EXPECT_EQ(m.eq_type[compiled.engine.closure_equality[0]], mjEQ_WELD);
  const int half = mj_name2id(&m, mjOBJ_BODY, "C.half");
  EXPECT_DOUBLE_EQ(m.body_mass[half], 0.5 * fixtures::FourBar::m3);
}

TEST(Mjcf, TheHeadSaysHowToUseTheFileInEachForm) {
  const Mechanism m = fixtures::MakeFourBar();
  const auto head = [&](const MjcfOptions& options) {
    const std::string text = WriteMjcf(m, options);
    return text.substr(0, text.find("<compiler"));
  };
  const std::string held = head({}), free = head({.prescribed = false});
  const std::string servo = head({.prescribed = false, .kp = {1.0}, .kv = {1.0}});
  for (const std::string& text : {held, free, servo, head({.statics = true})}) {
    EXPECT_NE(text.find("Two ways to use it:"), std::string::npos) << text;
    EXPECT_NE(text.find("\n1. "), std::string::npos) << text;
    EXPECT_NE(text.find("\n2. "), std::string::npos) << text;
  }
  EXPECT_NE(held.find("hold the drives at home"), std::string::npos);
  EXPECT_NE(free.find("nothing holds the drives"), std::string::npos);
  EXPECT_NE(servo.find("position and a velocity servo"), std::string::npos);
}

TEST(Mjcf, WhatMuJoCoHasNoWordForIsListedAndInTheComment) {
  Mechanism m = fixtures::MakeFourBar();
  MjcfOptions options;
  options.friction = true;
  EXPECT_TRUE(MissingInMjcf(m, options).empty());
  m.bodies[2].gravity_compensation = 0.5;
  m.elements = {
      {.name = "bearing", .joint = 1, .law = FrictionLaw{.coulomb = 1.0, .breakaway = 2.0}}};
  const std::vector<std::string> missing = MissingInMjcf(m, options);
  ASSERT_EQ(missing.size(), 2u);
  EXPECT_TRUE(missing[0].starts_with("bearing: ")) << missing[0];
  EXPECT_TRUE(missing[1].starts_with(m.bodies[2].name + ": ")) << missing[1];
  for (const std::string& line : missing) {
    EXPECT_NE(WriteMjcf(m, options).find(line), std::string::npos) << line;
  }
}

TEST(Mjcf, StaticsModelsSayThatTheyAreNotForStepping) {
  const Mechanism m = fixtures::MakeFourBar();
  const std::string statics = WriteMjcf(m, {.statics = true});
  EXPECT_NE(statics.find("not for stepping in time"), std::string::npos);
  EXPECT_EQ(statics.find("<keyframe>"), std::string::npos);
  EXPECT_EQ(WriteMjcf(m).find("not for stepping"), std::string::npos);
}

TEST(Mjcf, ADescriptionCannotEndTheComment) {
  Mechanism m = fixtures::MakeFourBar();
  m.description = "a --> b --- c\x01";
  const Compiled compiled(m);
  EXPECT_TRUE(compiled.warnings.empty());
  EXPECT_EQ(compiled.mjcf.find("-->"), compiled.mjcf.rfind("-->"));
}

TEST(Mjcf, TheHomeKeyIsTheReferencePoseOfEveryModel) {
  for (const Mechanism& mechanism : AllMechanisms()) {
    const Compiled compiled(mechanism);
    const mjModel& m = *compiled.engine.m;
    ASSERT_EQ(m.nkey, 1) << mechanism.name;
    for (int i = 0; i < m.nq; ++i) {
      EXPECT_NEAR(m.key_qpos[i], m.qpos0[i], 1e-15) << mechanism.name << " " << i;
    }
  }
}

TEST(Mjcf, MoreKeysComeBehindHome) {
  const Mechanism mechanism = fixtures::MakeFourBar();
  const Compiled plain(mechanism);
  std::vector<double> qpos(plain.engine.m->qpos0, plain.engine.m->qpos0 + plain.engine.m->nq);
  qpos[0] += 0.125;
  const std::string servos = WriteMjcf(mechanism, {.prescribed = false, .kp = {2.0}, .kv = {1.0}});
  for (const std::string& text : {plain.mjcf, servos}) {
    std::vector<std::string> warnings;
    const EngineSession session(&warnings);
    const simulation::ModelHandle m = simulation::CompileMjcf(WithKeys(
        text, {{.name = "t_0.500s", .time_s = 0.5, .qpos = qpos, .drive_position = {1.125}}}));
    ASSERT_EQ(m->nkey, 2);
    EXPECT_TRUE(warnings.empty());
    EXPECT_EQ(m->key_time[1], 0.5);
    EXPECT_EQ(m->key_qpos[m->nq], qpos[0]);
    EXPECT_TRUE(m->nu == 1 || m->key_ctrl[m->nu + 1] == 1.125);
  }
}

int SignificantDigits(const std::string& number) {
  std::string digits;
  for (const char c : number.substr(0, number.find('e'))) {
    if (c >= '0' && c <= '9' && (c != '0' || !digits.empty())) digits += c;
  }
  while (!digits.empty() && digits.back() == '0') digits.pop_back();
  return std::max(1, static_cast<int>(digits.size()));
}

// Every number is the shortest text that reads back as the same double.
TEST(Mjcf, NumbersAreShortAndExact) {
  const std::regex number("[ \"](-?[0-9][0-9.e+-]*)");
  size_t count = 0;
  for (const char* name : {"four_bar", "stabilizing_platform"}) {
    const std::string text = WriteMjcf(LoadNamed(name));
    for (std::sregex_iterator it(text.begin(), text.end(), number), end; it != end; ++it, ++count) {
      const std::string shown = it->str(1);
      char* stop = nullptr;
      const double value = std::strtod(shown.c_str(), &stop);
      if (*stop != '\0') continue;  // a name
      for (int digits = 1; digits < 17; ++digits) {
        std::ostringstream shorter;
        shorter.precision(digits);
        shorter << value;
        if (std::strtod(shorter.str().c_str(), nullptr) != value) continue;
        EXPECT_LE(SignificantDigits(shown), digits) << shown;
        break;
      }
    }
  }
  EXPECT_GT(count, 500u);
}

TEST(PrincipalInertia, ReproducesAFullMatrixToRoundOff) {
  const Mat3 R = RotRpy({0.3, -0.7, 1.9});
  const Mat3 I = R * Vec3(3.0, 2.0, 1.5).asDiagonal() * R.transpose();
  const PrincipalInertia p = PrincipalInertiaOf(I, 1.0);
  EXPECT_LT((p.R * p.moments.asDiagonal() * p.R.transpose() - I).norm(), 16 * kEps * I.norm());
  EXPECT_NEAR(p.R.determinant(), 1.0, 8 * kEps);
}

TEST(PrincipalInertia, LeavesADiagonalMatrixAlone) {
  const PrincipalInertia p = PrincipalInertiaOf(Vec3(4.76e5, 8.36e5, 4.3e5).asDiagonal(), 5e4);
  EXPECT_EQ(p.moments, Vec3(4.76e5, 8.36e5, 4.3e5));
  EXPECT_EQ(p.R, Mat3(Mat3::Identity()));
}

TEST(PrincipalInertia, MakesLaminaAndSlenderRodAdmissible) {
  const PrincipalInertia lamina = PrincipalInertiaOf(Vec3(0.1, 0.2, 0.1 + 0.2).asDiagonal(), 1.0);
  EXPECT_GE(lamina.moments[0] + lamina.moments[1], lamina.moments[2]);
  EXPECT_NEAR(lamina.moments[2], 0.3, 4 * kEps);
  const PrincipalInertia rod = PrincipalInertiaOf(Vec3(0.5, 0.0, 0.5).asDiagonal(), 1.0);
  EXPECT_GT(rod.moments[1], 0.0);
  EXPECT_LT(rod.moments[1], 1e-11);
}

TEST(Mjcf, MuJoCosOwnDiagonalisationWouldBeWorse) {
  // Why diaginertia and quat are written and not fullinertia: 2.2.2 stops its iteration early.
  const Mat3 R = RotRpy({0.3, -0.7, 1.9});
  const Mat3 I = R * Vec3(3.0, 2.0, 1.5).asDiagonal() * R.transpose();
  std::ostringstream xml;
  xml.precision(17);
  xml << "<mujoco><worldbody><body><freejoint/><inertial pos='0 0 0' mass='1' fullinertia='"
      << I(0, 0) << ' ' << I(1, 1) << ' ' << I(2, 2) << ' ' << I(0, 1) << ' ' << I(0, 2) << ' '
      << I(1, 2) << "'/></body></worldbody></mujoco>";
  std::vector<std::string> warnings;
  EngineSession session(&warnings);
  const simulation::ModelHandle m = simulation::CompileMjcf(xml.str());
  const double* q = m->body_iquat + 4;
  const Mat3 R_m = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  const Eigen::Map<const Vec3> moments(m->body_inertia + 3);
  const double error = (R_m * moments.asDiagonal() * R_m.transpose() - I).norm() / I.norm();
  EXPECT_GT(error, 1e-12);
  EXPECT_LT(error, 1e-5);
}

}  // namespace
}  // namespace mbv
