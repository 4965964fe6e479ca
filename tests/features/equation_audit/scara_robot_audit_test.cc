// The SCARA robot's equation audit: which equations are right as printed, and that a wrong
// constant would be seen.
#include "features/equation_audit/scara_robot_audit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

const std::string kModelFolder = SourcePath("/models");

const AuditTable& ScaraTable() {
  static const AuditTable table = AuditScaraRobot(kModelFolder);
  return table;
}

TEST(ScaraAudit, EveryCorrectedFormIsConfirmed) {
  for (const AuditRow& row : ScaraTable().rows) {
    EXPECT_NE(row.verdict, AuditVerdict::kWrongAndUnfixed) << row.equation;
    EXPECT_LE(row.residual_corrected, row.limit) << row.equation;
    EXPECT_GT(row.scale, 0.0) << row.equation;
  }
}

TEST(ScaraAudit, RightEquationsAreTheseAndNoOthers) {
  const std::set<std::string> right = {"F = Σf − Σξ",
                                       "M_pa",
                                       "Table 1, platform",
                                       "(1)",
                                       "(2)",
                                       "(4)",
                                       "(6)",
                                       "(7), (8)",
                                       "(22), (23)",
                                       "(24), (25)",
                                       "(28) J",
                                       "(29) Ẍ",
                                       "(31) v_i1",
                                       "(33)",
                                       "(34), (36) v_i2",
                                       "(37)",
                                       "(39)",
                                       "(41)",
                                       "(43)",
                                       "(44), (45)",
                                       "(12)",
                                       "(15)",
                                       "(16), (17)",
                                       "(18), (21) κ_m",
                                       "(19), (21) κ_f",
                                       "Fig. 9, symmetry"};
  std::set<std::string> found;
  for (const AuditRow& row : ScaraTable().rows) {
    if (row.verdict == AuditVerdict::kOk) found.insert(row.equation);
    EXPECT_EQ(row.verdict == AuditVerdict::kWrong, !row.erratum.empty()) << row.equation;
  }
  EXPECT_EQ(found, right);
}

TEST(ScaraAudit, EveryErratumIsLargeComparedWithItsLimit) {
  for (const AuditRow& row : ScaraTable().rows) {
    if (row.verdict != AuditVerdict::kWrong || row.equation.starts_with("Table")) continue;
    if (std::isnan(row.residual_printed)) continue;  // not computable: its shapes do not fit
    EXPECT_GT(row.residual_printed, 1e-2 * row.scale) << row.equation;
  }
}

TEST(ScaraAudit, PerturbedConstantsLeaveEquationsUnconfirmed) {
  const LoadResult model = LoadModel(std::string(kModelFolder) + "/scara_robot/model.yaml");
  ASSERT_TRUE(model.mechanism) << model.diagnostics.Text();
  const std::vector<scara_audit::State> states = scara_audit::Sweep(*model.mechanism);
  const auto unconfirmed = [&](double scara_robot::Parameters::*member) {
    scara_robot::Parameters perturbed = scara_robot::ParametersOf(*model.mechanism);
    perturbed.*member *= 1.0 + 1e-8;
    std::set<std::string> equations;
    for (const auto& rows : {PositionRows(*model.mechanism, perturbed, states),
                             DynamicsRows(perturbed, states), LinkRows(perturbed, states)}) {
      for (const AuditRow& row : rows) {
        if (row.verdict == AuditVerdict::kWrongAndUnfixed) equations.insert(row.equation);
      }
    }
    return equations;
  };
  EXPECT_TRUE(unconfirmed(&scara_robot::Parameters::l3).contains("(6)"));
  EXPECT_TRUE(unconfirmed(&scara_robot::Parameters::e).contains("(3), (5)"));
  EXPECT_TRUE(unconfirmed(&scara_robot::Parameters::m_p).contains("(48)"));
  EXPECT_TRUE(unconfirmed(&scara_robot::Parameters::m_rods).contains("(48)"));
  EXPECT_TRUE(unconfirmed(&scara_robot::Parameters::I_pz).contains("(48)"));
  EXPECT_TRUE(unconfirmed(&scara_robot::Parameters::l1).contains("(31) v_i1"));
}

}  // namespace
}  // namespace mbv
