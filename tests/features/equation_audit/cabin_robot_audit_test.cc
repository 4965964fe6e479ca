// The cabin robot's equation audit: that a wrong constant in the equations would be seen.
#include <gtest/gtest.h>

#include <set>

#include "features/equation_audit/cabin_robot_audit.h"
#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using cabin_audit::Lengths;

constexpr double kPerturb = 1.0 + 1e-6, kPerturb_m = 1e-6;

const Mechanism& Robot() {
  static const Mechanism mechanism =
      *LoadModel(SourcePath("/models/cabin_robot/model.yaml")).mechanism;
  return mechanism;
}

std::set<std::string> Unconfirmed(const std::vector<AuditRow>& rows) {
  std::set<std::string> equations;
  for (const AuditRow& row : rows) {
    if (row.verdict == AuditVerdict::kWrongAndUnfixed) equations.insert(row.equation);
  }
  return equations;
}

TEST(CabinAudit, EveryCorrectedFormIsConfirmed) {
  const Lengths l = cabin_audit::LengthsOf(Robot());
  for (const auto& rows : {PositionRows(l, l), VelocityRows(l, l), WristRows(l, l),
                           cabin_audit::DynamicsRows(Robot(), Robot())}) {
    EXPECT_TRUE(Unconfirmed(rows).empty()) << *Unconfirmed(rows).begin();
  }
}

TEST(CabinAudit, PerturbedLengthsLeaveEquationsUnconfirmed) {
  const Lengths truth = cabin_audit::LengthsOf(Robot());
  const auto unconfirmed = [&](double Lengths::*length) {
    Lengths perturbed = truth;
    perturbed.*length += kPerturb_m;  // some are zero
    std::set<std::string> equations = Unconfirmed(PositionRows(perturbed, truth));
    equations.merge(Unconfirmed(VelocityRows(perturbed, truth)));
    equations.merge(Unconfirmed(WristRows(perturbed, truth)));
    return equations;
  };
  const auto first = unconfirmed(&Lengths::L1);
  for (const char* row :
       {"(1) α, ε", "(1) AF", "(3), (4)", "(9) α, β1, β2, γ", "(14)", "(35), (36)"}) {
    EXPECT_TRUE(first.contains(row)) << row;
  }
  const auto second = unconfirmed(&Lengths::L2);
  for (const char* row : {"(23) W_γ", "(25) J32", "(25) J33", "(9) β"}) {
    EXPECT_TRUE(second.contains(row)) << row;
  }
  EXPECT_TRUE(unconfirmed(&Lengths::L3).contains("(2) β") ||
              unconfirmed(&Lengths::L3).contains("(3), (4)"));
  EXPECT_TRUE(unconfirmed(&Lengths::L4).contains("(14)"));
  EXPECT_TRUE(unconfirmed(&Lengths::a2).contains("(12), (13) p_x"));
  EXPECT_TRUE(unconfirmed(&Lengths::d3).contains("(12), (13) p_y"));
  for (double Lengths::*length : {&Lengths::a3, &Lengths::a4, &Lengths::d6}) {
    const auto wrist = unconfirmed(length);
    for (const char* row : {"(5), (6)", "(12), (13) p_z", "(28), (29)", "(26), (27), (32)",
                            "(33), (34)", "(41)–(46)"}) {
      EXPECT_TRUE(wrist.contains(row)) << row;
    }
  }
}

TEST(CabinAudit, APerturbedMassLeavesTheDynamicsUnconfirmed) {
  Mechanism perturbed = Robot();
  for (Parameter& p : perturbed.parameters) {
    if (p.name == "m_AB") p.value *= kPerturb;
  }
  const auto equations = Unconfirmed(cabin_audit::DynamicsRows(perturbed, Robot()));
  EXPECT_TRUE(equations.contains("(47)"));
  EXPECT_TRUE(equations.contains("(48), (50)–(52)"));
}

}  // namespace
}  // namespace mbv
