// Structural faults: each is what it says, keeps the model consistent, and is seen or explained.
#include "features/mutation/mutation_report.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "kinematics/home.h"
#include "kinematics/mobility.h"
#include "model_file/load_model.h"
#include "tests/support/shipped.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

Mechanism LoadNamed(const std::string& name) {
  LoadResult loaded = LoadModel(std::string(kSourceDir) + "/models/" + name + "/model.yaml");
  if (!loaded.mechanism.has_value()) throw std::runtime_error(loaded.diagnostics.Text());
  return *std::move(loaded.mechanism);
}

std::vector<StructuralFault> Of(const Mechanism& mechanism, const std::string& kind) {
  std::vector<StructuralFault> found;
  for (StructuralFault& fault : StructuralFaults(mechanism)) {
    if (fault.kind == kind) found.push_back(std::move(fault));
  }
  return found;
}

constexpr const char* kKinds[] = {"swapped drives",
                                  "flipped axis",
                                  "exchanged universal-joint axes",
                                  "sign of products of inertia",
                                  "wrong elbow branch",
                                  "missing closure",
                                  "9.80665 for 9.81"};

TEST(StructuralFaults, EveryKindIsThereOrSaysWhyNot) {
  for (const std::string& model : ShippedModelNames()) {
    const std::vector<StructuralFault> faults = StructuralFaults(LoadNamed(model));
    for (const char* kind : kKinds) {
      bool found = false;
      for (const StructuralFault& fault : faults) {
        if (fault.kind != kind) continue;
        found = true;
        EXPECT_EQ(fault.wrong.empty(), !fault.not_applicable.empty()) << model << kind;
      }
      EXPECT_TRUE(found) << model << ": " << kind;
    }
  }
}

TEST(StructuralFaults, SwappedDrivesActOnEachOthersJoints) {
  const Mechanism stewart = LoadNamed("stewart");
  const std::vector<StructuralFault> faults = Of(stewart, "swapped drives");
  ASSERT_EQ(faults.size(), 5u);  // six legs, each with the next
  const auto joint = [](const Mechanism& m, size_t d) {
    return std::get<JointDrive>(m.drives[d].kind).joint;
  };
  EXPECT_EQ(faults[0].where, "leg1.length and leg2.length");
  EXPECT_EQ(joint(faults[0].wrong[0], 0), joint(stewart, 1));
  EXPECT_EQ(joint(faults[0].wrong[0], 1), joint(stewart, 0));
  EXPECT_EQ(joint(faults[0].wrong[0], 2), joint(stewart, 2));
  EXPECT_NE(Of(LoadNamed("four_bar"), "swapped drives")[0].not_applicable, "");
}

TEST(StructuralFaults, AFlippedAxisKeepsTheHomePoseAndTurnsTheCoordinate) {
  const Mechanism stewart = LoadNamed("stewart");
  const std::vector<StructuralFault> faults = Of(stewart, "flipped axis");
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].alike, 5u);  // the other legs
  const auto j = static_cast<size_t>(stewart.FindJoint("leg1.P"));
  const Joint &as_is = stewart.joints[j], &wrong = faults[0].wrong[0].joints[j];
  EXPECT_EQ(wrong.axis, -as_is.axis);
  EXPECT_EQ(wrong.home[0], -as_is.home[0]);
  EXPECT_EQ(wrong.range[0].lower, -as_is.range[0].upper);
  EXPECT_EQ(faults[0].wrong[0].X_WB_home[3].matrix(), stewart.X_WB_home[3].matrix());
}

TEST(StructuralFaults, ExchangedUniversalAxesCloseAgain) {
  const Mechanism crank = LoadNamed("slider_crank");
  const std::vector<StructuralFault> faults = Of(crank, "exchanged universal-joint axes");
  ASSERT_EQ(faults.size(), 1u);
  const auto j = static_cast<size_t>(crank.FindJoint("C"));
  EXPECT_EQ(faults[0].wrong[0].joints[j].axis, crank.joints[j].axis2);
  EXPECT_EQ(faults[0].wrong[0].joints[j].axis2, crank.joints[j].axis);
  EXPECT_EQ(AnalyseMobility(faults[0].wrong[0]).dofs, 1);
  EXPECT_NE(Of(LoadNamed("four_bar"), "exchanged universal-joint axes")[0].not_applicable, "");
}

TEST(StructuralFaults, ProductsOfInertiaChangeTheirSignAndNothingElse) {
  Mechanism bar = LoadNamed("four_bar");
  EXPECT_EQ(Of(bar, "sign of products of inertia")[0].not_applicable,
            "every body's inertia is given in its principal axes");
  Mat3& I = bar.bodies[2].I_Bcm_B;
  I(0, 1) = I(1, 0) = 1e-4;
  const std::vector<StructuralFault> faults = Of(bar, "sign of products of inertia");
  ASSERT_EQ(faults.size(), 1u);
  const Mat3& wrong = faults[0].wrong[0].bodies[2].I_Bcm_B;
  EXPECT_DOUBLE_EQ(wrong(0, 1), -1e-4);
  EXPECT_DOUBLE_EQ(wrong(1, 0), -1e-4);
  EXPECT_DOUBLE_EQ(wrong(2, 2), I(2, 2));
}

TEST(StructuralFaults, TheOtherAssemblyOfAFourBarIsItsMirrorImage) {
  const Mechanism bar = LoadNamed("four_bar");
  const std::vector<StructuralFault> faults = Of(bar, "wrong elbow branch");
  ASSERT_EQ(faults.size(), 1u);
  ASSERT_EQ(faults[0].wrong.size(), 1u);  // a four-bar has two assemblies
  const Mechanism& wrong = faults[0].wrong[0];
  const int crank = bar.FindBody("crank"), rocker = bar.FindBody("rocker");
  const auto X = [](const Mechanism& m, int body) {
    return m.X_WB_home[static_cast<size_t>(body)];
  };
  // Newton closes loops to 1e-12.
  EXPECT_LT((X(bar, crank).matrix() - X(wrong, crank).matrix()).norm(), 1e-11);
  // The joint between coupler and rocker is reflected in the line from the crank's end B to D.
  const Vec3 B = X(bar, crank) * Vec3(bar.ParameterValue("crank"), 0, 0);
  const Vec3 D(bar.ParameterValue("ground"), 0, 0);
  const Vec3 u = (D - B).normalized();
  const Vec3 end(bar.ParameterValue("rocker"), 0, 0);
  const Vec3 C = X(bar, rocker) * end, C_wrong = X(wrong, rocker) * end;
  EXPECT_LT((C_wrong - (B + 2.0 * u * u.dot(C - B) - (C - B))).norm(), 1e-11);
}

TEST(StructuralFaults, AReversedCouplingHoldsAtHomeAndNowhereElse) {
  const Mechanism press = LoadNamed("geared_press");
  const std::vector<StructuralFault> faults = Of(press, "reversed coupling");
  ASSERT_EQ(faults.size(), 4u);
  for (size_t c = 0; c < faults.size(); ++c) {
    EXPECT_EQ(faults[c].where, press.couplings[c].name);
    Mechanism wrong = faults[c].wrong.at(0);
    for (Joint& joint : wrong.joints) joint.guess = joint.home;
    const HomeResult home = SolveHome(&wrong);
    EXPECT_TRUE(home.closed);
    EXPECT_LT(home.gap_at_guess, 1e-12) << faults[c].where;  // as it was
    EXPECT_NE(wrong.couplings[c].terms.back().polynomial,
              press.couplings[c].terms.back().polynomial);
  }
}

// A flipped axis leaves what is coupled to it where it is.
TEST(StructuralFaults, AFlippedAxisCountsTheOtherWayInItsCouplings) {
  const Mechanism press = LoadNamed("geared_press");
  for (const StructuralFault& fault : Of(press, "flipped axis")) {
    Mechanism wrong = fault.wrong.at(0);
    for (Joint& joint : wrong.joints) joint.guess = joint.home;
    (void)SolveHome(&wrong);
    for (size_t b = 1; b < press.bodies.size(); ++b) {
      EXPECT_LT((wrong.X_WB_home[b].matrix() - press.X_WB_home[b].matrix()).norm(), 1e-11)
          << fault.where << press.bodies[b].name;
    }
  }
}

// A spring pulls as before where its coordinate counts the other way.
TEST(StructuralFaults, AFlippedAxisCountsTheOtherWayInItsElements) {
  Mechanism bars = LoadNamed("friction_five_bar");
  bars.elements = {
      {.name = "s", .joint = bars.FindJoint("shoulder1"), .law = SpringLaw{{3, -2, 1}, 0.4, 0.7}}};
  const auto force = [](const Mechanism& m, double q) {
    const auto& spring = std::get<SpringLaw>(m.elements[0].law);
    const double x = q - spring.free;
    return -(spring.preload + spring.polynomial[0] * x + spring.polynomial[1] * x * x +
             spring.polynomial[2] * x * x * x);
  };
  const Mechanism wrong = Of(bars, "flipped axis").at(0).wrong.at(0);
  for (const double q : {-0.3, 1.1}) EXPECT_NEAR(force(wrong, -q), -force(bars, q), 1e-14);
}

TEST(StructuralFaults, PreloadsAndGearsOfRotorsAreMistaken) {
  const Mechanism bars = LoadNamed("friction_five_bar");
  const std::vector<StructuralFault> pushed = Of(bars, "preload the other way");
  ASSERT_EQ(pushed.size(), 2u);  // torsion and rubber
  EXPECT_EQ(pushed[0].where, "torsion");
  EXPECT_EQ(std::get<SpringLaw>(pushed[0].wrong.at(0).elements.at(6).law).preload, -0.6);
  const std::vector<StructuralFault> geared = Of(bars, "ratio of a rotor not squared");
  ASSERT_EQ(geared.size(), 2u);
  const auto& rotor = std::get<RotorLaw>(geared[1].wrong.at(0).elements.at(1).law);
  EXPECT_NEAR(rotor.reflected(), 2e-5 * 40, 1e-15);
}

TEST(StructuralFaults, CarriedRotorsAndBushingsAreTurnedRound) {
  const Mechanism linkage = LoadNamed("bushed_linkage");
  const std::vector<StructuralFault> turned = Of(linkage, "rotor the other way");
  ASSERT_EQ(turned.size(), 1u);
  EXPECT_EQ(std::get<RotorLaw>(turned[0].wrong.at(0).elements.back().law).ratio, -12.0);
  // The sleeve does not push, so that its frames may be exchanged.
  const std::vector<StructuralFault> exchanged = Of(linkage, "bushing axes of its child");
  ASSERT_EQ(exchanged.size(), 1u);
  EXPECT_EQ(exchanged[0].wrong.at(0).bushings[0].parent, linkage.bushings[0].child);
  // An axis that points the other way turns the rotor about it the same way.
  Mechanism geared = linkage;
  geared.elements.back().joint = geared.FindJoint("A");
  geared.elements.back().coordinate = 0;
  const Mechanism wrong = Of(geared, "flipped axis").at(0).wrong.at(0);
  EXPECT_EQ(std::get<RotorLaw>(wrong.elements.back().law).ratio, -12.0);
}

TEST(StructuralFaults, WithoutAClosureTheIndicesStillFitAndDegreesOfFreedomAppear) {
  for (const std::string& model : ShippedModelNames()) {
    const Mechanism mechanism = LoadNamed(model);
    const Mobility whole = AnalyseMobility(mechanism);
    for (const StructuralFault& fault : Of(mechanism, "missing closure")) {
      if (fault.wrong.empty()) continue;
      const Mechanism& wrong = fault.wrong[0];
      EXPECT_EQ(wrong.joints.size(), mechanism.joints.size() - 1);
      EXPECT_EQ(wrong.FindJoint(fault.where), -1);
      // What is held twice may be held still.
      const int dofs = AnalyseMobility(wrong).dofs;
      EXPECT_GE(dofs, whole.dofs + (whole.redundant == 0 ? 1 : 0)) << model << " " << fault.where;
      for (size_t d = 0; d < wrong.drives.size(); ++d) {
        const auto* drive = std::get_if<JointDrive>(&wrong.drives[d].kind);
        if (drive == nullptr) continue;
        const auto& as_is = std::get<JointDrive>(mechanism.drives[d].kind);
        EXPECT_EQ(wrong.joints[static_cast<size_t>(drive->joint)].name,
                  mechanism.joints[static_cast<size_t>(as_is.joint)].name);
      }
      for (size_t t = 0; t < wrong.tree_joints.size(); ++t) {
        EXPECT_EQ(wrong.joints[static_cast<size_t>(wrong.tree_joints[t])].name,
                  mechanism.joints[static_cast<size_t>(mechanism.tree_joints[t])].name);
      }
    }
  }
}

TEST(StructuralFaults, StandardGravityKeepsItsDirection) {
  const std::vector<StructuralFault> faults = Of(LoadNamed("four_bar"), "9.80665 for 9.81");
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_LT((faults[0].wrong[0].gravity_W - Vec3(0, -9.80665, 0)).norm(), 4 * kEps * 9.81);
  Mechanism weightless = LoadNamed("four_bar");
  weightless.gravity_W.setZero();
  EXPECT_EQ(Of(weightless, "9.80665 for 9.81")[0].not_applicable, "it has no gravity");
  weightless.gravity_W = Vec3(0, 0, -1.62);
  EXPECT_EQ(Of(weightless, "9.80665 for 9.81")[0].not_applicable, "its gravity is 1.62 m/s²");
}

}  // namespace
}  // namespace mbv
