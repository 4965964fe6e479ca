// mechanism.json: what it says is what the mechanism is.
#include "external/mechanism_json.h"

#include <gtest/gtest.h>

#include <algorithm>

#include <Eigen/Dense>
#include <nlohmann/json.hpp>
#include <set>

#include "external/motion_text.h"
#include "model_file/load_model.h"
#include "tests/support/shipped.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using Document = nlohmann::json;

Mechanism Shipped(const std::string& name) {
  LoadResult result = LoadModel(SourcePath("/models/" + name + "/model.yaml"));
  EXPECT_TRUE(result.mechanism) << result.diagnostics.Text();
  return std::move(*result.mechanism);
}

Vec3 VectorOf(const Document& json) {
  const auto v = json.get<std::vector<double>>();
  return Vec3(v.at(0), v.at(1), v.at(2));
}

Pose PoseOf(const Document& json) {
  Pose X = Pose::Identity();
  X.translation() = VectorOf(json.at("p"));
  for (int i = 0; i < 3; ++i)
    X.linear().row(i) = VectorOf(json.at("R").at(static_cast<size_t>(i))).transpose();
  return X;
}

// Joints close at home: what the file says of frames and poses belongs together.
TEST(MechanismJson, JointsOfEveryShippedModelMeetAtHome) {
  for (const std::string& name : ShippedModelNames()) {
    const Document json = Document::parse(MechanismJson(Shipped(name)));
    EXPECT_EQ(json.at("schema"), kMechanismSchema);
    std::map<std::string, Pose> home;
    for (const Document& body : json.at("bodies")) home[body.at("name")] = PoseOf(body.at("home"));
    for (const Document& joint : json.at("joints")) {
      const Document &parent = joint.at("parent"), &child = joint.at("child");
      ASSERT_TRUE(home.contains(parent.at("body")) && home.contains(child.at("body"))) << name;
      const Pose X_WF = home[parent.at("body")] * PoseOf(parent);
      const Pose X_WM = home[child.at("body")] * PoseOf(child);
      const std::string kind = joint.at("kind");
      if (kind != "revolute" && kind != "spherical" && kind != "universal" && kind != "fixed") {
        continue;
      }
      EXPECT_LT((X_WF.translation() - X_WM.translation()).norm(), 1e-8)
          << name << " " << joint.at("name");
      if (kind != "revolute") continue;
      const Vec3 axis = VectorOf(joint.at("axis"));
      EXPECT_LT((X_WF.linear() * axis - X_WM.linear() * axis).norm(), 1e-8)
          << name << " " << joint.at("name");
    }
  }
}

TEST(MechanismJson, GivesEveryNumberOfBodiesAndDrives) {
  const Mechanism m = Shipped("stabilizing_platform");
  const Document json = Document::parse(MechanismJson(m));
  ASSERT_EQ(json.at("bodies").size(), m.bodies.size());
  for (size_t b = 0; b < m.bodies.size(); ++b) {
    const Document& body = json.at("bodies").at(b);
    EXPECT_EQ(body.at("mass").get<double>(), m.bodies[b].mass);
    EXPECT_EQ(VectorOf(body.at("centre_of_mass")), m.bodies[b].p_BoBcm_B);
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(VectorOf(body.at("inertia").at(static_cast<size_t>(i))),
                m.bodies[b].I_Bcm_B.row(i).transpose());
    }
  }
  ASSERT_EQ(json.at("drives").size(), m.drives.size());
  EXPECT_EQ(json.at("drives").at(0).at("name"), m.drives[0].name);
  EXPECT_EQ(json.at("prescribed").size(), m.prescribed.size());
  EXPECT_EQ(VectorOf(json.at("gravity")), m.gravity_W);
}

// A machine with all elements: each has its law, and what it is on.
TEST(MechanismJson, GivesElementsWithTheirLaws) {
  const Mechanism m = Shipped("machine_five_bar");
  const Document json = Document::parse(MechanismJson(m));
  ASSERT_EQ(json.at("elements").size(), m.elements.size());
  ASSERT_EQ(json.at("couplings").size(), m.couplings.size());
  std::set<std::string> kinds;
  for (size_t e = 0; e < m.elements.size(); ++e) {
    const Document& element = json.at("elements").at(e);
    EXPECT_EQ(element.at("kind"), WordOf(m.elements[e]));
    EXPECT_TRUE(element.contains("on"));
    if (const auto* law = std::get_if<FrictionLaw>(&m.elements[e].law)) {
      EXPECT_EQ(element.at("law").at("breakaway").get<double>(), law->breakaway);
      EXPECT_EQ(element.at("law").at("coulomb").get<double>(), law->coulomb);
    }
    if (const auto* law = std::get_if<SpringLaw>(&m.elements[e].law)) {
      EXPECT_EQ(element.at("law").at("polynomial").get<std::vector<double>>(), law->polynomial);
    }
    kinds.insert(element.at("kind"));
  }
  EXPECT_GE(kinds.size(), 4U);
  for (size_t c = 0; c < m.couplings.size(); ++c) {
    const Document& terms = json.at("couplings").at(c).at("terms");
    ASSERT_EQ(terms.size(), m.couplings[c].terms.size());
    EXPECT_EQ(terms.at(0).at("polynomial").get<std::vector<double>>(),
              m.couplings[c].terms[0].polynomial);
    EXPECT_EQ(json.at("couplings").at(c).at("constant").get<double>(), m.couplings[c].constant);
  }
}

TEST(MechanismJson, ACouplingKeepsItsConstant) {
  Mechanism m = Shipped("four_bar");
  m.couplings.push_back(
      {.name = "gear", .terms = {{0, 0, {-1.0}}, {1, 0, {2.0}}}, .constant = 0.7});
  const Document json = Document::parse(MechanismJson(m));
  EXPECT_EQ(json.at("couplings").back().at("constant").get<double>(), 0.7);
}

TEST(MotionText, GivesDrivenCoordinatesAndLoadsInFull) {
  const Mechanism m = Shipped("four_bar");
  HandedMotion motion;
  motion.time_s = {0.0, 0.1};
  const auto one = [](double x) { return VecX::Constant(1, x); };
  motion.driven = {{one(1.0 / 3.0), one(2.0), one(3.0)}, {one(0.5), one(0.25), one(-1e-20)}};
  LoadSample load;
  load.body = 1;
  load.p_BoQ_B = {0.1, 0.0, 0.0};
  load.in_body_axes = true;
  load.force = {1.0, 2.0, 3.0};
  load.moment = {0.0, 0.0, -4.0};
  motion.loads = {{load}, {}};
  const std::string drive = m.drives[0].name;
  EXPECT_EQ(MotionCsv(m, motion), "time_s," + drive + ".position," + drive + ".velocity," + drive +
                                      ".acceleration\n"
                                      "0,0.33333333333333331,2,3\n"
                                      "0.10000000000000001,0.5,0.25,-9.9999999999999995e-21\n");
  EXPECT_EQ(LoadsCsv(m, motion),
            "time_s,load,body,px,py,pz,axes,fx,fy,fz,mx,my,mz\n"
            "0,0," +
                m.bodies[1].name + ",0.10000000000000001,0,0,body,1,2,3,0,0,-4\n");
}

// Of a free motion: commanded coordinates alone, forces with two derivatives, states of all bodies.
TEST(MotionText, GivesForcesAndTheStartOfAFreeMotion) {
  const Mechanism m = Shipped("four_bar");
  const std::string drive = m.drives[0].name;
  HandedMotion motion;
  motion.time_s = {0.0, 0.5};
  const VecX zero = VecX::Zero(1);
  motion.driven = {{zero, zero, zero}, {zero, zero, zero}};
  motion.commanded = {false};
  motion.forced = {0};
  motion.forces = {{Jet{1.0, 2.0, 3.0}}, {Jet{-0.1, 0.0, 4.0}}};
  EXPECT_EQ(MotionCsv(m, motion), "time_s\n0\n0.5\n");
  EXPECT_EQ(ForcesCsv(m, motion), "time_s," + drive + ".force," + drive + ".force_rate," + drive +
                                      ".force_acceleration\n0,1,2,3\n"
                                      "0.5,-0.10000000000000001,0,4\n");
  BodyStates start;
  start.Resize(m.bodies.size());
  start.X_WB[1].translation() = Vec3(1, 2, 3);
  start.X_WB[1].linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  start.V_WB[1] << 4, 5, 6, 7, 8, 9;
  const std::string csv = StartCsv(m, start);
  EXPECT_TRUE(csv.starts_with("body,px,py,pz,R11,R12,R13,R21,")) << csv;
  EXPECT_NE(csv.find("\n" + m.bodies[1].name + ",1,2,3,0,-1,0,1,0,0,0,0,1,4,5,6,7,8,9\n"),
            std::string::npos)
      << csv;
  EXPECT_EQ(static_cast<size_t>(std::count(csv.begin(), csv.end(), '\n')), m.bodies.size() + 1);
}

}  // namespace
}  // namespace mbv
