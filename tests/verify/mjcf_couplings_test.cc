// Couplings of MJCF files as mechanisms.
#include <gtest/gtest.h>

#include "features/robots/survey.h"
#include "kinematics/mobility.h"
#include "tests/support/test_folder.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

// Three heavy arms on the world, each on a hinge of its own; the second counts from 0.2 rad.
std::string Arms(const std::string& equality, const std::string& tendon = "") {
  const auto arm = [](const std::string& name, const std::string& more) {
    return "<body name='" + name + "'><joint name='" + name + "_hinge' axis='0 1 0' " + more +
           "/><inertial pos='0.2 0 0' mass='1' diaginertia='0.001 0.01 0.01'/></body>";
  };
  return "<mujoco model='arms'><compiler angle='radian'/><worldbody>" + arm("a", "") +
         arm("b", "ref='0.2'") + arm("c", "") + "</worldbody>" + tendon + "<equality>" + equality +
         "</equality><actuator><motor name='m' joint='a_hinge'/><motor name='n' joint='c_hinge'/>"
         "</actuator></mujoco>";
}

LoadResult LoadArms(const test::TestFolder& folder, const std::string& text) {
  return LoadRobot(folder.Write("arms.xml", text));
}

TEST(MjcfCouplings, AJointEqualityIsAPolynomialFromTheReferencePose) {
  const test::TestFolder folder("mjcf_coupling");
  const LoadResult loaded = LoadArms(
      folder,
      Arms("<joint name='e' joint1='b_hinge' joint2='a_hinge' polycoef='0.1 -2 0.3 0 0'/>"));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  ASSERT_EQ(m.couplings.size(), 1u);
  EXPECT_EQ(m.couplings[0].name, "e");
  EXPECT_EQ(m.couplings[0].terms[1].polynomial, (std::vector<double>{-2, 0.3}));
  EXPECT_EQ(m.couplings[0].constant, 0.1);
  EXPECT_NEAR(m.joints[m.FindJoint("b_hinge")].home[0], 0.1, 1e-12);
  EXPECT_EQ(AnalyseMobility(m).dofs, 2);
  EXPECT_EQ(loaded.diagnostics.Text().find("left out"), std::string::npos)
      << loaded.diagnostics.Text();
}

TEST(MjcfCouplings, TendonsThatAddJointsAreASum) {
  const test::TestFolder folder("mjcf_tendon_coupling");
  const std::string tendons =
      "<tendon><fixed name='t'><joint joint='a_hinge' coef='1'/><joint joint='b_hinge' coef='3'/>"
      "</fixed><fixed name='u'><joint joint='c_hinge' coef='2'/></fixed></tendon>";
  const LoadResult loaded = LoadArms(
      folder, Arms("<tendon name='e' tendon1='t' tendon2='u' polycoef='0 0.5 0 0 0'/>", tendons));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const std::vector<Coupling>& couplings = loaded.mechanism->couplings;
  ASSERT_EQ(couplings.size(), 1u);  // −a − 3 b + c = 0
  ASSERT_EQ(couplings[0].terms.size(), 3u);
  EXPECT_EQ(couplings[0].terms[0].polynomial, std::vector<double>{-1});
  EXPECT_EQ(couplings[0].terms[1].polynomial, std::vector<double>{-3});
  EXPECT_EQ(couplings[0].terms[2].polynomial, std::vector<double>{1});
  EXPECT_EQ(loaded.diagnostics.Text().find("tendons are left out"), std::string::npos);
  // A polynomial of a sum is not known.
  const LoadResult curved = LoadArms(
      folder, Arms("<tendon name='e' tendon1='t' tendon2='u' polycoef='0 0.5 1 0 0'/>", tendons));
  EXPECT_TRUE(!curved.mechanism || curved.mechanism->couplings.empty());
  EXPECT_NE(
      curved.diagnostics.Text().find("equality 'e' (couplings are known of hinges and slides, by a "
                                     "polynomial or by linear fixed tendons) is left out"),
      std::string::npos)
      << curved.diagnostics.Text();
}

// What holds one joint alone couples nothing: the drive there takes its place.
TEST(MjcfCouplings, AnEqualityOfOneJointIsLeftOut) {
  const test::TestFolder folder("mjcf_held_joint");
  const LoadResult loaded =
      LoadArms(folder, Arms("<joint name='e' joint1='b_hinge' polycoef='0.1 0 0 0 0'/>"));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_TRUE(loaded.mechanism->couplings.empty());
  EXPECT_NE(loaded.diagnostics.Text().find(
                "equality 'e', which holds joint 'b_hinge' alone, is left out"),
            std::string::npos)
      << loaded.diagnostics.Text();
}

TEST(MjcfCouplings, AgreeInBothModes) {
  const test::TestFolder folder("mjcf_coupled_run");
  const std::string file = folder.Write(
      "arms.xml",
      Arms("<joint name='e' joint1='b_hinge' joint2='a_hinge' polycoef='0.1 -2 0.3 0 0'/>"));
  const SurveyRow row = SurveyFile(file, folder.PathOf("scratch"));
  EXPECT_EQ(row.status, "ok") << row.message;
  EXPECT_LT(row.inverse_nrmse, 1e-10);
  EXPECT_LT(row.forward_nrmse, 1e-6);
  EXPECT_EQ(row.dofs, 2);
}

}  // namespace
}  // namespace mbv
