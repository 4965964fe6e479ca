// What closed forms take for granted, against the shipped models and against perturbed copies of
// them: everything that changes a drive force must be outside what the equations cover.
#include "analytic/coverage.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "analytic/closed_form.h"
#include "analytic/stiffness_form.h"
#include "model_file/load_model.h"
#include "reference/reference.h"
#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

struct Case {
  const char *model, *scenario;
};

std::string TextOf(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings) text += ToText(finding) + "\n";
  return text;
}

Mechanism Shipped(const std::string& file) {
  LoadResult loaded = LoadModel(SourcePath("/models/" + file));
  EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  return *std::move(loaded.mechanism);
}

bool Mentions(const std::vector<Finding>& findings, const std::string& what) {
  return TextOf(findings).find(what) != std::string::npos;
}

class CoverageOfModel : public testing::TestWithParam<Case> {
 protected:
  CoverageOfModel()
      : loaded_(LoadScenario(
            SourcePath("/scenarios/" + std::string(GetParam().model) + "/" + GetParam().scenario))),
        mechanism_(*loaded_.mechanism) {}

  // Drive forces of the reference at some instant of the scenario.
  [[nodiscard]] VecX Forces(const Mechanism& mechanism) const {
    const Motion& motion = loaded_.scenario->motion;
    ReferenceSolver solver(mechanism, motion);
    CommandSample command;
    EvaluateMotion(motion, 0.3 * motion.duration_s, &command);
    ReferenceSample sample;
    const RunSummary summary = solver.Dynamics(command, &sample);
    EXPECT_TRUE(summary.ok()) << summary.message;
    return sample.drive_force;
  }

  ScenarioResult loaded_;
  const Mechanism& mechanism_;
};

TEST_P(CoverageOfModel, HoldsTheShippedModel) { EXPECT_EQ(TextOf(FindUncovered(mechanism_)), ""); }

TEST_P(CoverageOfModel, LeavesNoMassOrInertiaOutThatMovesADrive) {
  const VecX forces = Forces(mechanism_);
  const double size = forces.cwiseAbs().maxCoeff();
  int felt = 0;
  for (size_t b = 1; b < mechanism_.bodies.size(); ++b) {
    const Body& body = mechanism_.bodies[b];
    if (body.mass == 0.0) continue;
    // Mass, centre of mass, and the six inertias.
    for (int k = 0; k < 10; ++k) {
      Mechanism perturbed = mechanism_;
      Body& changed = perturbed.bodies[b];
      const double inertia = body.I_Bcm_B.cwiseAbs().maxCoeff();
      if (k == 0) changed.mass *= 1.01;
      if (k >= 1 && k < 4) changed.p_BoBcm_B[k - 1] += 0.01;
      if (k >= 4) {
        const int i = k < 7 ? k - 4 : (k - 7) / 2, j = k < 7 ? k - 4 : 1 + (k - 6) / 2;
        changed.I_Bcm_B(i, j) += 0.01 * inertia;
        if (i != j) changed.I_Bcm_B(j, i) += 0.01 * inertia;
      }
      const double change = (Forces(perturbed) - forces).cwiseAbs().maxCoeff();
      if (!(change > 1e-9 * size)) continue;
      ++felt;
      EXPECT_TRUE(Mentions(FindUncovered(perturbed), "body " + body.name + ": "))
          << "quantity " << k << " of " << body.name << " changes a drive force by " << change;
    }
  }
  EXPECT_GT(felt, 10);
}

TEST_P(CoverageOfModel, NamesAJointThatIsMoved) {
  for (size_t j = 0; j < mechanism_.joints.size(); ++j) {
    const Joint& joint = mechanism_.joints[j];
    if (joint.kind == JointKind::kFree) continue;
    Mechanism perturbed = mechanism_;
    perturbed.joints[j].X_PF.translation() += Vec3(1e-6, 2e-6, 3e-6);
    EXPECT_TRUE(Mentions(FindUncovered(perturbed), "joint " + joint.name + ": centre"))
        << joint.name;
    perturbed = mechanism_;
    perturbed.joints[j].X_CM.translation() += Vec3(1e-6, 2e-6, 3e-6);
    EXPECT_TRUE(Mentions(FindUncovered(perturbed), "joint " + joint.name + ": centre"))
        << joint.name;
    if (joint.kind == JointKind::kSpherical) continue;
    perturbed = mechanism_;
    perturbed.joints[j].X_PF.rotate(Eigen::AngleAxisd(1e-6, Vec3(1, 2, 3).normalized()));
    EXPECT_TRUE(Mentions(FindUncovered(perturbed), "joint " + joint.name + ": ")) << joint.name;
  }
}

TEST_P(CoverageOfModel, NamesWhatTheEquationsDoNotKnow) {
  Mechanism sprung = mechanism_;
  sprung.springs.push_back({.name = "buffer", .body_to = 1, .stiffness = 1e3});
  EXPECT_TRUE(Mentions(FindUncovered(sprung), "spring-damper buffer of 1000 N/m"));
  Mechanism damped = sprung;
  damped.springs.clear();
  damped.elements = {{.name = "oil", .joint = 0, .law = DampingLaw{0.1}}};
  EXPECT_TRUE(Mentions(FindUncovered(damped), "element oil, damping of "));

  Mechanism heavier = mechanism_;
  heavier.bodies.push_back({.name = "ballast", .mass = 3.0, .frames = {}, .shapes = {}});
  EXPECT_TRUE(Mentions(FindUncovered(heavier), "body ballast of 3 kg"));

  Mechanism shorter = mechanism_;
  shorter.drives.pop_back();
  EXPECT_TRUE(
      Mentions(FindUncovered(shorter), "drive " + mechanism_.drives.back().name + " is missing"));
  Mechanism locked = mechanism_;
  locked.joints.back().name = "other";
  EXPECT_TRUE(Mentions(FindUncovered(locked), "joint other between"));
  EXPECT_TRUE(Mentions(FindUncovered(locked), mechanism_.joints.back().name + " is missing"));
}

TEST_P(CoverageOfModel, NamesEveryParameterThatIsReadAndMissing) {
  const CoverageFunction coverage = FindClosedForm(mechanism_.name)->coverage;
  Mechanism bare = mechanism_;
  bare.parameters.clear();
  const Coverage none = coverage(bare);
  EXPECT_GT(none.missing.size(), 15u);
  EXPECT_EQ(FindUncovered(none, bare, Concern::kDynamics).size(), none.missing.size());
  // And one at a time: the factory is only asked when all are there.
  for (const std::string& name : none.missing) {
    Mechanism one = mechanism_;
    std::erase_if(one.parameters, [&](const Parameter& p) { return p.name == name; });
    EXPECT_EQ(coverage(one).missing, std::vector<std::string>{name});
  }
  // What it does not call missing, the factory does not need.
  Mechanism least = mechanism_;
  std::erase_if(least.parameters, [&](const Parameter& p) {
    return std::find(none.missing.begin(), none.missing.end(), p.name) == none.missing.end();
  });
  Diagnostics diagnostics;
  const auto form =
      FindClosedForm(mechanism_.name)->factory(least, loaded_.scenario->motion, {}, &diagnostics);
  EXPECT_NE(form, nullptr) << diagnostics.Text();
}

TEST_P(CoverageOfModel, NamesALoadOnABodyItDoesNotKnow) {
  Mechanism marked = mechanism_;
  marked.bodies.push_back({.name = "marker", .frames = {}, .shapes = {}});
  Motion motion;
  Load load;
  load.name = "wind";
  load.body = static_cast<int>(marked.bodies.size()) - 1;
  motion.loads.push_back(load);
  const Coverage coverage = FindClosedForm(marked.name)->coverage(marked);
  const std::vector<Finding> findings = FindUncoveredLoads(coverage, marked, motion);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].message, "load wind acts on marker");
  EXPECT_NE(findings[0].hint.find("platform"), std::string::npos);
}

constexpr Case kCovered[] = {{"stabilizing_platform", "sea_state.yaml"},
                             {"spr_tripod", "default.yaml"},
                             {"cabin_robot", "default.yaml"},
                             {"scara_robot", "pick_place.yaml"}};

INSTANTIATE_TEST_SUITE_P(ClosedForms, CoverageOfModel, testing::ValuesIn(kCovered),
                         [](const auto& c) { return std::string(c.param.model); });

TEST(Coverage, OfEveryClosedFormIsTestedHere) {
  for (const ClosedFormRow& row : ClosedForms()) {
    if (row.coverage == nullptr) continue;
    EXPECT_TRUE(std::any_of(std::begin(kCovered), std::end(kCovered), [&](const Case& c) {
      return row.mechanism == c.model;
    })) << row.mechanism;
  }
}

TEST(Coverage, LoadsThatFollowTheMotionAreOutside) {
  const Mechanism m = Shipped("stabilizing_platform/model.yaml");
  const Coverage coverage = FindClosedForm(m.name)->coverage(m);
  Motion motion;
  Load load{.name = "buffer", .body = m.FindBody("platform"), .force = {}, .moment = {}};
  motion.loads = {load};
  EXPECT_TRUE(FindUncoveredLoads(coverage, m, motion).empty());
  motion.loads[0].following.push_back(
      {2, {.inputs = {}, .value = [](double t_s, auto) { return t_s; }}});
  const std::vector<Finding> findings = FindUncoveredLoads(coverage, m, motion);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].message, "load buffer follows the mechanism's state");
}

TEST(Coverage, NamesTheBodyTheNumberAndTheAssumption) {
  Mechanism m = Shipped("stabilizing_platform/model.yaml");
  m.bodies[size_t(m.FindBody("limb2.link1"))].p_BoBcm_B.x() = 0.1;
  const std::vector<Finding> findings = FindUncovered(m);
  ASSERT_EQ(findings.size(), 1u) << TextOf(findings);
  EXPECT_EQ(findings[0].severity, Severity::kWarning);
  EXPECT_EQ(findings[0].message, "body limb2.link1: centre of mass x is 0.1 m");
  EXPECT_EQ(findings[0].hint,
            "the closed form of the stabilizing platform takes 0 m: the centre of mass is at "
            "(c_1_x, c_1 of the length, c_1_z), the principal axes are along and across the link");
}

TEST(Coverage, NamesAnotherAssembly) {
  // The elbow of the platform's limb 2 inside instead of outside.
  Mechanism m = Shipped("stabilizing_platform/model.yaml");
  const int link1 = m.FindBody("limb2.link1"), link2 = m.FindBody("limb2.link2");
  m.X_WB_home[size_t(link2)].linear() =
      m.X_WB_home[size_t(link1)].linear() * Eigen::AngleAxisd(-1.0, Vec3::UnitX());
  EXPECT_TRUE(Mentions(FindUncovered(m), "body limb2.link2: branch at home is -1"));
  Mechanism scara = Shipped("scara_robot/model.yaml");
  for (Parameter& p : scara.parameters) p.value = p.name == "branch" ? -1.0 : p.value;
  EXPECT_TRUE(Mentions(FindUncovered(scara), "body limb3.rod: branch at home is -1"));
  Mechanism cabin = Shipped("cabin_robot/model.yaml");
  cabin.X_WB_home[size_t(cabin.FindBody("EF"))].linear() = Mat3::Identity();
  EXPECT_TRUE(Mentions(FindUncovered(cabin), "body EF: branch at home is -1"));
}

TEST(Coverage, KinematicsDoesNotAskForMasses) {
  Mechanism m = Shipped("spr_tripod/model.yaml");
  m.bodies[1].mass *= 2;
  const Coverage coverage = FindClosedForm(m.name)->coverage(m);
  EXPECT_EQ(FindUncovered(coverage, m, Concern::kDynamics).size(), 1u);
  EXPECT_TRUE(FindUncovered(coverage, m, Concern::kKinematics).empty());
}

TEST(Coverage, TakesABodyWithoutMassAtTheEndOfAJoint) {
  Mechanism m = Shipped("scara_robot/model.yaml");
  m.bodies.push_back({.name = "camera", .frames = {}, .shapes = {}});
  Joint mount;
  mount.name = "mount";
  mount.parent = m.FindBody("platform");
  mount.child = static_cast<int>(m.bodies.size()) - 1;
  m.joints.push_back(mount);
  EXPECT_EQ(TextOf(FindUncovered(m)), "");
  m.bodies.back().mass = 0.1;
  EXPECT_TRUE(Mentions(FindUncovered(m), "body camera of 0.1 kg"));
}

TEST(StiffnessCoverage, HoldsTheElasticModelsAndNamesABeamAServoAndAHinge) {
  for (const StiffnessFormRow& row : StiffnessForms()) {
    const Mechanism m = Shipped(row.mechanism + "/elastic.yaml");
    const auto uncovered = [&](const Mechanism& mechanism) {
      return FindUncovered(row.coverage(mechanism), mechanism, Concern::kStiffness);
    };
    EXPECT_EQ(TextOf(uncovered(m)), "");
    for (size_t k = 0; k < m.beams.size(); ++k) {
      Mechanism perturbed = m;
      perturbed.beams[k].section.I_y *= 1 + 1e-6;
      EXPECT_TRUE(Mentions(uncovered(perturbed), "beam " + m.beams[k].name + ": I_y"));
      perturbed = m;
      perturbed.beams[k].section.torsion *= 1 + 1e-6;
      EXPECT_TRUE(Mentions(uncovered(perturbed), "beam " + m.beams[k].name + ": torsion"));
      perturbed = m;
      perturbed.beams[k].p_to *= 1 + 1e-6;
      perturbed.beams[k].p_from *= 1 + 1e-6;
      EXPECT_TRUE(Mentions(uncovered(perturbed), "beam " + m.beams[k].name + ": length"));
    }
    for (size_t k = 0; k < m.drives.size(); ++k) {
      Mechanism perturbed = m;
      perturbed.drives[k].stiffness = 1234.0;
      EXPECT_TRUE(Mentions(uncovered(perturbed), "drive " + m.drives[k].name + ": compliance"));
    }
    for (size_t k = 0; k < m.joints.size(); ++k) {
      Mechanism perturbed = m;
      perturbed.joints[k].X_PF.translation() += Vec3(1e-6, 1e-6, 1e-6);
      EXPECT_TRUE(Mentions(uncovered(perturbed), "joint " + m.joints[k].name + ": centre"));
    }
  }
  const Mechanism balls = Shipped("scara_robot/elastic_crossbar.yaml");
  EXPECT_TRUE(Mentions(
      FindUncovered(FindStiffnessForm(balls.name)->coverage(balls), balls, Concern::kStiffness),
      "limb1.cross_bar"));
}

}  // namespace
}  // namespace mbv
