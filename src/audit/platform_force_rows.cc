// Equations (21), (22), the 30 equations of a limb, and the resulting drive forces.
#include <algorithm>

#include "analytic/stabilizing_platform/limb_system.h"
#include "audit/platform_audit.h"
#include "audit/row_meter.h"

namespace mbv::platform_audit {
namespace {

sp::Evaluation Evaluate(const Case& c, sp::Model model, double t) {
  const sp::PlatformEquations equations(c.parameters, sp::DrivePairs::kSynchronous, model);
  sp::Evaluation e;
  if (!equations.EvaluateKinematics(SeaStateAt(t), &e).ok() ||
      !equations.EvaluateDynamics({}, &e).ok()) {
    e.f.setConstant(kNan);
  }
  return e;
}

void WrenchRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter wrench({.equation = "(22)",
                   .printed = "W^I = −(N A − ad(V)ᵀ N V), W^G = (r × m g; m g)",
                   .limit = 10 * kForceLimit,
                   .unit = "N, N m",
                   .note =
                       "−W^I − W^G against the sum of the reference's ball forces; one V carries "
                       "a stray T in print"});
  for (size_t n = 0; n < c.truth.size(); ++n) {
    const sp::Evaluation& e = c.closed[n];
    Vec6 sum = Vec6::Zero();
    for (const LimbTruth& limb : c.truth[n].limbs) {
      const Vec3 f = limb.R_oA * limb.force_A;
      sum.head<3>() += limb.p_oB.cross(f);
      sum.tail<3>() += f;
    }
    const Vec6 needed =
        -sp::InertiaWrench(c.parameters, e.motion) - sp::GravityWrench(c.parameters, e.motion);
    for (int k = 0; k < 6; ++k) wrench.Add(sum[k], needed[k]);
  }
  rows->push_back(wrench.Finish());
}

void BalanceRows(const Case& full, const Case& massless, std::vector<AuditRow>* rows) {
  RowMeter light({.equation = "(21), massless links",
                  .printed = "[S1 … S6] f = −W^G − W^I",
                  .limit = kForceLimit,
                  .unit = "N",
                  .note = "f_1 … f_6 against the reference's balls with massless links"});
  RowMeter heavy({.equation = "(21), links with mass",
                  .erratum = "E7",
                  .printed = "[S1 … S6] f = −W^G − W^I",
                  .corrected = "… − Σ f_X,i (B_i × X_i; X_i)",
                  .limit = kForceLimit,
                  .unit = "N",
                  .note = "f_1 … f_6 against the reference's balls; a limb with mass also pushes "
                          "along X"});
  RowMeter f_X({.equation = "(21), f_X",
                .erratum = "E7",
                .printed = "0 (not in the equation)",
                .corrected = "f_X,i = −Σ M_Y,i/l_i",
                .limit = kForceLimit,
                .unit = "N",
                .note = "force along X at the reference's balls"});
  for (size_t n = 0; n < full.truth.size(); ++n) {
    const sp::Evaluation text = Evaluate(full, sp::Model::kPaperText, full.truth[n].time_s);
    for (int i = 0; i < 3; ++i) {
      const Vec3& force = full.truth[n].limbs[i].force_A;
      const Vec3& free = massless.truth[n].limbs[i].force_A;
      heavy.Add(force.z(), text.f[i], full.closed[n].f[i]);
      heavy.Add(force.y(), text.f[3 + i], full.closed[n].f[3 + i]);
      f_X.Add(force.x(), 0, full.closed[n].f_X[i]);
      light.Add(free.z(), massless.closed[n].f[i]);
      light.Add(free.y(), massless.closed[n].f[3 + i]);
    }
  }
  for (RowMeter* meter : {&light, &heavy, &f_X}) rows->push_back(meter->Finish());
}

// Number of singular values above `cut`.
int RankOf(const sp::LimbSystem& system) {
  constexpr double kCut = 1e-9;  // the smallest kept is 0.02, the dropped are roundoff
  return static_cast<int>((sp::ColumnScaledSingularValues(system).array() > kCut).count());
}

void LimbSystemRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter rank({.equation = "30 equations, rank",
                 .erratum = "E8",
                 .printed = "30 unknowns, 30 equations",
                 .corrected = "R22' as a ball; platform acts on the cross along and about X",
                 .limit = 0,
                 .unit = "1",
                 .note = "30 − rank; the printed loop can carry M_Z and an X force unnoticed"});
  RowMeter solvable({.equation = "30 equations, solvable",
                     .erratum = "E8",
                     .printed = "30 unknowns, 30 equations",
                     .corrected = "as above",
                     .limit = 10 * kForceLimit,
                     .unit = "N, N m",
                     .note = "residual of the best solution: nothing holds the limb's tilt"});
  RowMeter drives({.equation = "30 equations, drives",
                   .erratum = "E8",
                   .printed = "(21) without f_X, then the links in the limb plane only",
                   .corrected = "corrected (21) and 30 equations",
                   .limit = kForceLimit,
                   .unit = "N",
                   .note = "drive forces of the reference, full masses"});
  for (size_t n = 0; n < c.truth.size(); ++n) {
    const sp::Evaluation& e = c.closed[n];
    const sp::Evaluation text = Evaluate(c, sp::Model::kPaperText, c.truth[n].time_s);
    for (int i = 0; i < 3; ++i) {
      const double f_Y = e.f[3 + i], f_Z = e.f[i];
      const sp::LimbSystem printed =
          sp::MakeLimbSystem(sp::LimbSystemForm::kPrinted, e.geometry[i], e.required[i], f_Y, f_Z);
      const sp::LimbSystem corrected = sp::MakeLimbSystem(sp::LimbSystemForm::kCorrected,
                                                          e.geometry[i], e.required[i], f_Y, f_Z);
      rank.Add(30, RankOf(printed), RankOf(corrected));
      auto misfit = [](const sp::LimbSystem& s) {
        const MatX A = s.matrix;
        const VecX x = A.completeOrthogonalDecomposition().solve(s.right_side);
        return (A * x - s.right_side).cwiseAbs().maxCoeff();
      };
      const double size = corrected.right_side.cwiseAbs().maxCoeff();
      solvable.Add(size, size + misfit(printed), size + misfit(corrected));
      const sp::LimbSystemSolution solved = sp::SolveLimbSystem(corrected, f_Y, f_Z);
      for (int j = 0; j < 2; ++j) {
        drives.Add(c.truth[n].limbs[i].drive[j], text.forces[i].drive[j], solved.forces.drive[j]);
      }
    }
  }
  for (RowMeter* meter : {&rank, &solvable, &drives}) rows->push_back(meter->Finish());
}

}  // namespace

std::vector<AuditRow> ForceRows(const Case& full, const Case& massless) {
  std::vector<AuditRow> rows;
  WrenchRows(full, &rows);
  BalanceRows(full, massless, &rows);
  LimbSystemRows(full, &rows);
  return rows;
}

}  // namespace mbv::platform_audit
