// Equations (21), (22), the 30 equations of a limb, and the resulting drive forces.

#include <algorithm>
#include <cmath>

#include "analytic/stabilizing_platform/dynamics.h"
#include "features/equation_audit/audit.h"
#include "features/equation_audit/stabilizing_platform_audit.h"

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
  RowMeter wrench(
      {.equation = "(22)",
       .printed = "W^I = −(N A − ad(V)ᵀ N V), W^G = (r × m g; m g)",
       .limit = 10 * kForceLimit,
       .unit = "N, N m",
       .note =
           "−W^I − W^G against the sum of the reference's spherical-joint forces; one V carries "
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
  RowMeter light(
      {.equation = "(21), massless links",
       .printed = "[S1 … S6] f = −W^G − W^I",
       .limit = kForceLimit,
       .unit = "N",
       .note = "f_1 … f_6 against the reference's spherical joints with massless links"});
  RowMeter heavy(
      {.equation = "(21), links with mass",
       .erratum = "E7",
       .printed = "[S1 … S6] f = −W^G − W^I",
       .corrected = "… − Σ f_X,i (B_i × X_i; X_i)",
       .limit = kForceLimit,
       .unit = "N",
       .note = "f_1 … f_6 against the reference's spherical joints; a limb with mass also loads "
               "along X"});
  RowMeter f_X({.equation = "(21), f_X",
                .erratum = "E7",
                .printed = "0 (not in the equation)",
                .corrected = "f_X,i = −Σ M_Y,i/l_i",
                .limit = kForceLimit,
                .unit = "N",
                .note = "force along X at the reference's spherical joints"});
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
  RowMeter rank(
      {.equation = "30 equations, rank",
       .erratum = "E8",
       .printed = "30 unknowns, 30 equations",
       .corrected = "R22' as a spherical joint; platform acts on the cross along and about X",
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
        const VecX x = A.completeOrthogonalDecomposition().solve(VecX(s.right_side));
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

// What the paper states about data, validation, design and figures: errata E9–E12.

namespace {

// E9: a link cannot have more inertia than its whole mass at its far end.
void InertiaRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter link({.equation = "section 4 data, I_1, I_1'",
                 .erratum = "E9",
                 .printed = "I_1 = diag(4.3e4, 1.9e3, 4.28e4), I_1' = diag(4.53e4, 2.6e3, 4.57e4)",
                 .corrected = "a tenth of it (a slipped exponent); the print stays the default",
                 .limit = 0,
                 .unit = "kg m²",
                 .note = "excess over m L1², the whole mass at the far end"});
  for (int k : {sp::kLink1, sp::kLink1p}) {
    const sp::LinkInertia& inertia = c.parameters.links[k];
    const double most = inertia.mass * c.parameters.L1 * c.parameters.L1;
    for (int axis : {0, 2}) {
      const double I = inertia.moments[axis];
      link.Add(most, most + std::max(0.0, I - most), most + std::max(0.0, I / 10 - most));
    }
  }
  rows->push_back(link.Finish());
  rows->push_back({.equation = "section 4 data, I_p",
                   .erratum = "E9",
                   .printed = "I_p = diag(4.76e5, 8.36e5, 4.3e5)",
                   .corrected = "y and z probably exchanged; the print stays the default",
                   .unit = "",
                   .verdict = AuditVerdict::kNotTestable,
                   .note = "a flat plate's largest moment is about its normal z: 4.76e5 + 4.3e5 is "
                           "near 8.36e5"});
}

// E10, E11: what 12 s of the reference say about the claimed agreement and the cylinders.
void TrajectoryRows(const Case& full, const Case& massless, std::vector<AuditRow>* rows) {
  RowMeter claim({.equation = "section 4, Figs. 11 and 13",
                  .erratum = "E10",
                  .printed = "massless program and simulation with link masses agree to 0.1 kN",
                  .corrected = "equal masses in both agree",
                  .limit = 100,
                  .unit = "N",
                  .note = "reference with link masses against massless equations, and against "
                          "equations with link masses"});
  double shortest = INFINITY, longest = 0;
  for (size_t n = 0; n < full.truth.size(); ++n) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 2; ++j) {
        const LimbTruth& limb = full.truth[n].limbs[i];
        claim.Add(limb.drive[j], massless.closed[n].forces[i].drive[j],
                  full.closed[n].forces[i].drive[j]);
        shortest = std::min(shortest, limb.side[j].R.value);
        longest = std::max(longest, limb.side[j].R.value);
      }
    }
  }
  rows->push_back(claim.Finish());
  RowMeter stroke({.equation = "design, drives",
                   .erratum = "E11",
                   .printed = "one-stage cylinder between the drive's balls",
                   .corrected = "two-stage cylinder",
                   .limit = 0,
                   .unit = "m",
                   .note =
                       "stroke beyond what the shortest length can house (one or two times it); "
                       "drive lengths of the reference"});
  const double needed = longest - shortest;
  auto excess = [&](int stages) { return std::max(0.0, needed - stages * shortest); };
  stroke.Add(needed, needed + excess(1), needed + excess(2));
  rows->push_back(stroke.Finish());
}

// E12: which links touch the cross at the tip.
void FigureRow(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter members({.equation = "text to Fig. 7",
                    .erratum = "E12",
                    .printed = "links 1 and 1' load the cross",
                    .corrected = "links 2 and 2' load the cross",
                    .limit = kPositionLimit,
                    .unit = "m",
                    .note = "distance of the link's end from the cross at B in the reference"});
  for (const Truth& t : c.truth) {
    for (const LimbTruth& limb : t.limbs) {
      const Vec3 B = limb.R_oA.transpose() * (limb.p_oB - limb.p_oA);
      for (const SideTruth& side : limb.side) {
        const double s = &side == &limb.side[0] ? 1.0 : -1.0;
        const Vec3 end_2 =
            side.elbow_A + c.parameters.L3 * Vec3(0, s * std::cos(side.q2), std::sin(side.q2));
        members.Add(limb.l, limb.l + (side.elbow_A - B).norm(), limb.l + (end_2 - B).norm());
      }
    }
  }
  rows->push_back(members.Finish());
}

}  // namespace

std::vector<AuditRow> ClaimRows(const Case& full, const Case& massless) {
  std::vector<AuditRow> rows;
  InertiaRows(full, &rows);
  TrajectoryRows(full, massless, &rows);
  FigureRow(full, &rows);
  return rows;
}

}  // namespace mbv::platform_audit
