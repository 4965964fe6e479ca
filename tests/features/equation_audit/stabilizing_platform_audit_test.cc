// The stabilizing platform's audit: complete, confirmed, as large as known, and able to fail.
#include "features/equation_audit/stabilizing_platform_audit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/support/source_dir.h"

namespace mbv::platform_audit {
namespace {

const std::string kModels = std::string(kSourceDir) + "/models";

const AuditTable& Table() {
  static const AuditTable table = AuditStabilizingPlatform(kModels);
  return table;
}

const AuditRow& RowOf(const std::vector<AuditRow>& rows, const std::string& equation) {
  for (const AuditRow& row : rows) {
    if (row.equation == equation) return row;
  }
  ADD_FAILURE() << "no row " << equation;
  return rows.front();
}

TEST(StabilizingPlatformAudit, HasARowForEveryEquationAndErratum) {
  std::set<std::string> equations, errata;
  std::string all;
  for (const AuditRow& row : Table().rows) {
    all += row.equation + "\n";
    if (!row.erratum.empty()) errata.insert(row.erratum);
  }
  for (int k = 1; k <= 22; ++k) {
    EXPECT_NE(all.find("(" + std::to_string(k) + ")"), std::string::npos) << "equation " << k;
  }
  EXPECT_NE(all.find("30 equations"), std::string::npos);
  for (int k = 1; k <= 12; ++k) {
    EXPECT_TRUE(errata.count("E" + std::to_string(k))) << "erratum " << k;
  }
}

TEST(StabilizingPlatformAudit, ConfirmsEveryCorrectedForm) {
  for (const AuditRow& row : Table().rows) {
    EXPECT_NE(row.verdict, AuditVerdict::kWrongAndUnfixed)
        << row.equation << ": " << row.residual_corrected << " > " << row.limit;
    const bool wrong =
        row.verdict == AuditVerdict::kWrong || row.verdict == AuditVerdict::kApproximation;
    if (row.verdict == AuditVerdict::kNotTestable) continue;
    EXPECT_EQ(wrong, !row.corrected.empty()) << row.equation;
  }
}

TEST(StabilizingPlatformAudit, FindsTheErrorsOfThePrintInTheirKnownSize) {
  struct Known {
    const char* equation;
    double residual, half_digit;
  };
  for (const Known& known :
       {Known{"(6) M in x'", 1.5e-2, 0.05e-2}, Known{"(7) M, M' in x''", 5.0e-2, 0.05e-2},
        Known{"(17)", 0.286, 0.5e-3}, Known{"(20) q1", 0.98, 0.5e-2},
        Known{"(21), links with mass", 8.2e3, 50}, Known{"30 equations, rank", 2, 0},
        Known{"30 equations, drives", 9.7e3, 50},
        Known{"section 4, Figs. 11 and 13", 46.6e3, 50}}) {
    EXPECT_NEAR(RowOf(Table().rows, known.equation).residual_printed, known.residual,
                known.half_digit)
        << known.equation;
  }
}

TEST(StabilizingPlatformAudit, NoticesEquationsPerturbedByTwiceTheirLimit) {
  const Case right = MakeCase(kModels, 1.0);
  auto bent_case = [&](double sp::PlatformParameters::*parameter, double change) {
    Case perturbed = right;
    perturbed.parameters.*parameter += change;
    const sp::PlatformEquations equations(perturbed.parameters, sp::DrivePairs::kSynchronous);
    for (size_t n = 0; n < perturbed.truth.size(); ++n) {
      const RunSummary kinematics =
          equations.EvaluateKinematics(perturbed.truth[n].command, &perturbed.closed[n]);
      EXPECT_TRUE(kinematics.ok()) << kinematics.message;
      const RunSummary dynamics = equations.EvaluateDynamics({}, &perturbed.closed[n]);
      EXPECT_TRUE(dynamics.ok()) << dynamics.message;
    }
    return perturbed;
  };
  constexpr AuditVerdict kFailed = AuditVerdict::kWrongAndUnfixed;
  EXPECT_EQ(RowOf(LimbRows(right), "(20) R").verdict, AuditVerdict::kWrong);
  const Case longer = bent_case(&sp::PlatformParameters::L4, 2 * kPositionLimit);
  EXPECT_EQ(RowOf(LimbRows(longer), "(20) R").verdict, kFailed);
  EXPECT_EQ(RowOf(LimbRows(longer), "(17)").verdict, AuditVerdict::kWrong);
  // Lengths see a wider base through the sine of the tilt, at most 0.18.
  const Case wider = bent_case(&sp::PlatformParameters::r_a, 2 * kPositionLimit / 0.18);
  EXPECT_EQ(RowOf(TwistRows(wider), "(14)").verdict, kFailed);
  const Case turned = bent_case(&sp::PlatformParameters::theta_2, 1e-10);
  EXPECT_EQ(RowOf(PoseRows(turned), "(5) x").verdict, kFailed);
  EXPECT_EQ(RowOf(PoseRows(turned), "(6) M in x'").verdict, kFailed);
  const Case heavier = bent_case(&sp::PlatformParameters::m_p, 1e-6);
  EXPECT_EQ(RowOf(ForceRows(heavier, right), "(21), links with mass").verdict, kFailed);
  EXPECT_EQ(RowOf(ForceRows(heavier, right), "30 equations, drives").verdict, kFailed);
}

}  // namespace
}  // namespace mbv::platform_audit
