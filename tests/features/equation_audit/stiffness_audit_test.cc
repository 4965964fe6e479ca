// Audit of the stiffness equations of both robots: what is right, and that a wrong constant is
// seen.
#include <gtest/gtest.h>

#include <set>

#include "analytic/cabin_robot/stiffness.h"
#include "analytic/scara_robot/stiffness.h"
#include "features/equation_audit/cabin_robot_audit.h"
#include "features/equation_audit/scara_robot_audit.h"
#include "features/equation_audit/stiffness_truth.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

const std::string kModels = SourcePath("/models");

std::set<std::string> With(const std::vector<AuditRow>& rows, AuditVerdict verdict) {
  std::set<std::string> equations;
  for (const AuditRow& row : rows) {
    if (row.verdict == verdict) equations.insert(row.equation);
  }
  return equations;
}

cabin_robot::StiffnessParameters Cabin() {
  return cabin_robot::StiffnessParametersOf(stiffness_audit::LoadElastic(kModels, "cabin_robot"));
}
scara_robot::StiffnessParameters Scara() {
  return scara_robot::StiffnessParametersOf(stiffness_audit::LoadElastic(kModels, "scara_robot"));
}

TEST(StiffnessAudit, CabinsEquationsAreRightOrCorrected) {
  const auto rows = cabin_audit::StiffnessRows(kModels, Cabin());
  EXPECT_EQ(With(rows, AuditVerdict::kOk),
            (std::set<std::string>{"(54)", "(55)", "(62)–(64), (66)–(68)", "(69)–(75)"}));
  EXPECT_EQ(With(rows, AuditVerdict::kWrong),
            (std::set<std::string>{"(56)–(61)", "(65) K_AB", "(65) K_CD", "Table 2"}));
  EXPECT_EQ(With(rows, AuditVerdict::kApproximation), std::set<std::string>{"(54) I_p"});
  // (72), X = C F, has no sum.
  EXPECT_TRUE(With(rows, AuditVerdict::kNotTestable).contains("(71), (73), (74): sum"));
  EXPECT_TRUE(With(rows, AuditVerdict::kWrongAndUnfixed).empty());
}

TEST(StiffnessAudit, CabinsPerturbedConstantsLeaveEquationsUnconfirmed) {
  const auto unconfirmed = [](const auto& perturb) {
    cabin_robot::StiffnessParameters p = Cabin();
    perturb(&p);
    return With(cabin_audit::StiffnessRows(kModels, p), AuditVerdict::kWrongAndUnfixed);
  };
  constexpr double kPerturb = 1 + 1e-8;
  const auto strut = unconfirmed([](auto* p) { p->sections[cabin_robot::kBeamEF].h *= kPerturb; });
  EXPECT_TRUE(strut.contains("(56)–(61)"));
  EXPECT_TRUE(strut.contains("(65) K_AB"));
  EXPECT_FALSE(strut.contains("(65) K_CD"));
  const auto link = unconfirmed([](auto* p) { p->sections[cabin_robot::kBeamCD].b *= kPerturb; });
  EXPECT_TRUE(link.contains("(65) K_CD"));
  EXPECT_TRUE(link.contains("(62)–(64), (66)–(68)"));
  EXPECT_TRUE(unconfirmed([](auto* p) { p->w *= kPerturb; }).contains("(62)–(64), (66)–(68)"));
  EXPECT_TRUE(unconfirmed([](auto* p) { p->wrist.a3 *= kPerturb; }).contains("(69)–(75)"));
  EXPECT_TRUE(unconfirmed([](auto* p) { p->E *= kPerturb; }).contains("(54)"));
}

TEST(StiffnessAudit, ScarasPerturbedConstantsLeaveEquationsUnconfirmed) {
  const auto unconfirmed = [](double scara_robot::StiffnessParameters::*member) {
    scara_robot::StiffnessParameters p = Scara();
    p.*member *= 1 + 1e-8;
    return With(scara_audit::StiffnessRows(kModels, p), AuditVerdict::kWrongAndUnfixed);
  };
  const auto servo = unconfirmed(&scara_robot::StiffnessParameters::K_act);
  EXPECT_TRUE(servo.contains("(15)"));
  EXPECT_TRUE(servo.contains("(18), (21) κ_m"));
  EXPECT_FALSE(servo.contains("(12)"));
  EXPECT_FALSE(servo.contains("K_D1"));
  EXPECT_TRUE(unconfirmed(&scara_robot::StiffnessParameters::E).contains("(12)"));
  EXPECT_TRUE(unconfirmed(&scara_robot::StiffnessParameters::d).contains("K_D1"));
}

}  // namespace
}  // namespace mbv
