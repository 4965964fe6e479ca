#include <cmath>

#include "audit/scara_audit.h"

namespace mbv::scara_audit {
namespace {

Vec3 Across(const Vec3& v, const Vec3& axis) { return v - axis.dot(v) * axis; }

/// The paper's Jacobians of one limb, corrected, at a commanded time of the sweep.
struct LimbJacobians {
  Mat34 J_i2, J_omega;
};
LimbJacobians JacobiansAt(const scara::Parameters& p, double t_s, int i) {
  scara::Position at;
  const RunSummary reach = InversePosition(p, PathAt(t_s).X, &at);
  LimbJacobians result;
  if (!reach.ok()) {
    result.J_i2.setConstant(kNan);
    result.J_omega.setConstant(kNan);
    return result;
  }
  scara::LinkMotion links;
  FillLinkMotion(p, at, scara::Rates{}, InverseOfJ(p, at), scara::RodModel::kThin, i, &links);
  result.J_i2 = links.J_rod;
  result.J_omega = links.J_omega;
  return result;
}

/// dJ/dt by sixth-order differences; step for 1e-9 of roundoff and truncation at 6 Hz.
LimbJacobians RateOfJacobians(const scara::Parameters& p, double t_s, int i) {
  constexpr double h = 5e-4;
  LimbJacobians rate{Mat34::Zero(), Mat34::Zero()};
  constexpr double weights[] = {45.0, -9.0, 1.0};
  for (int k = 1; k <= 3; ++k) {
    const LimbJacobians after = JacobiansAt(p, t_s + k * h, i);
    const LimbJacobians before = JacobiansAt(p, t_s - k * h, i);
    const double w = weights[k - 1] / (60.0 * h);
    rate.J_i2 += w * (after.J_i2 - before.J_i2);
    rate.J_omega += w * (after.J_omega - before.J_omega);
  }
  return rate;
}

std::vector<AuditRow> CentreRows(const scara::Parameters& p, const std::vector<State>& states) {
  const double limit = Limit(3.0);
  RowMeter v1({.equation = "(31) v_i1",
               .erratum = {},
               .printed = "v_i1 = ½ l1 θ̇_i (ν_i u_i)",
               .corrected = {},
               .limit = limit,
               .unit = "m/s",
               .note = "lost cross; against the middle of the arm"});
  RowMeter J1({.equation = "(31) J_i1",
               .erratum = "E8",
               .printed = "J_i1 = [½ l1 θ̇_i (ν_i × u_i)ᵀ 0]ᵀ Φ_i",
               .corrected = "J_i1 = ½ l1 (ν_i × u_i) Φ_iᵀ",
               .limit = limit,
               .unit = "m/s",
               .note = "contains θ̇_i, so that J_i1 θ̇ is quadratic in the rates; shapes mended"});
  RowMeter vC({.equation = "(32)",
               .erratum = "E9",
               .printed = "v_C = v_i1",
               .corrected = "v_C = 2 v_i1",
               .limit = limit,
               .unit = "m/s",
               .note = "the tip moves twice as fast as the middle"});
  RowMeter vB({.equation = "(33)",
               .erratum = {},
               .printed = "v_B = v_D",
               .corrected = {},
               .limit = limit,
               .unit = "m/s",
               .note = "holds for i = 1, 2; the sentence before it says i = 3, 4"});
  RowMeter JB({.equation = "(35)",
               .erratum = "E10",
               .printed = "J_B = J⁻¹ + [k_1 k_2 k_3 k_4]",
               .corrected = "J_B = [E₃ k_i] J⁻¹",
               .limit = limit,
               .unit = "m/s",
               .note = "J⁻¹ has four rows; read as its top three"});
  RowMeter v2({.equation = "(34), (36) v_i2",
               .erratum = {},
               .printed = "v_i2 = ½ (v_C + v_D)",
               .corrected = {},
               .limit = limit,
               .unit = "m/s",
               .note = "with the corrected v_C; for two rods the mean of their middles"});
  RowMeter J2({.equation = "(34), (36) J_i2",
               .erratum = "E11",
               .printed = "J_i2 = ½ (J_i1 + J_B)",
               .corrected = "J_i2 = ½ (2 J_i1 + J_B)",
               .limit = limit,
               .unit = "m/s",
               .note = "v_C is 2 v_i1"});
  for (const State& state : states) {
    const scara::Position& at = state.position;
    const Vec4& dtheta = state.rates.dtheta;
    const Vec4 dX = state.J_inverse * dtheta;
    for (int i = 0; i < kLimbs; ++i) {
      const LimbTruth& limb = state.limbs[i];
      const Vec3 middle = 0.5 * p.l1 * dtheta[i] * at.n[i];
      const Vec3 v_B = dX.head<3>() + at.k[i] * dX[3];
      AddAll(&v1, limb.arm.v, middle, middle);
      AddAll(&J1, limb.arm.v, middle * dtheta[i], middle);
      AddAll(&vC, limb.C.v, middle, 2 * middle);
      if (i < 2) AddAll(&vB, limb.B.v, limb.D.v, limb.D.v);
      Vec3 printed_B = dX.head<3>();
      for (int k = 0; k < kLimbs; ++k) printed_B += at.k[k] * dtheta[k];
      AddAll(&JB, limb.B.v, printed_B, v_B);
      const Vec3 rods = 0.5 * (2 * middle + v_B);
      AddAll(&v2, limb.rods.v, 0.5 * (limb.C.v + limb.D.v), rods);
      AddAll(&J2, limb.rods.v, 0.5 * (middle + v_B), rods);
    }
  }
  return {v1.Finish(), J1.Finish(), vC.Finish(), vB.Finish(),
          v2.Finish(), J2.Finish(), JB.Finish()};
}

std::vector<AuditRow> RotationRows(const scara::Parameters& p, const std::vector<State>& states) {
  const double limit = Limit(30.0);
  RowMeter across({.equation = "(37)",
                   .erratum = {},
                   .printed = "ε_i = (1/l2) U_i (J_B − 2 J_i1) θ̇, the part across the rod",
                   .corrected = {},
                   .limit = limit,
                   .unit = "rad/s",
                   .note = "with (35) corrected; both rods of a limb turn alike"});
  RowMeter spin({.equation = "(37) whole",
                 .erratum = "E12",
                 .printed = "ε_i without spin",
                 .corrected = "ε_i = η × η̇ + b ψ̇ η, b = η·a, ψ̇ = η̇·(a × η)/(1 − b²)",
                 .limit = limit,
                 .unit = "rad/s",
                 .note = "the rods turn about their own axes too; 1e-5 of the torque, rods thin"});
  RowMeter third({.equation = "(38)",
                  .erratum = "E13",
                  .printed = "ω_i = (1/l2) U_i (…) θ̇",
                  .corrected = "1/l3",
                  .limit = limit,
                  .unit = "rad/s",
                  .note = "limbs 3, 4, the part across the rod"});
  for (const State& state : states) {
    const scara::Position& at = state.position;
    for (int i = 0; i < kLimbs; ++i) {
      const LimbTruth& limb = state.limbs[i];
      scara::LinkMotion thin, full;
      FillLinkMotion(p, at, state.rates, state.J_inverse, scara::RodModel::kThin, i, &thin);
      FillLinkMotion(p, at, state.rates, state.J_inverse, scara::RodModel::kFull, i, &full);
      const Vec3 truth = Across(limb.omega_rod, limb.R_rod.col(0));
      const Vec3 from_J = thin.J_omega * state.rates.dtheta;
      if (i < 2) AddAll(&across, truth, from_J, from_J);
      if (i < 2) across.Add(0.0, limb.rods_apart);
      AddAll(&spin, limb.omega_rod, thin.omega, full.J_omega * state.rates.dtheta);
      if (i >= 2) AddAll(&third, truth, from_J * p.l3 / p.l2, from_J);
    }
  }
  return {across.Finish(), spin.Finish(), third.Finish()};
}

std::vector<AuditRow> LinkAccelerationRows(const scara::Parameters& p,
                                           const std::vector<State>& states) {
  // Differences of the Jacobians: 1e-9 of their rates.
  const double limit = 1e-7;
  RowMeter eps({.equation = "(39)",
                .erratum = {},
                .printed = "ε̇_i = J̇_εi θ̇ + J_εi θ̈",
                .corrected = {},
                .limit = 30 * limit,
                .unit = "rad/s²",
                .note = "two dots on the left are a misprint; J̇ by differences, without spin"});
  RowMeter omega({.equation = "(40)",
                  .erratum = "E14",
                  .printed = "ω̇_i = J̇_εi θ̇ + J_εi θ̈",
                  .corrected = "J_ωi, with 1/l3",
                  .limit = 30 * limit,
                  .unit = "rad/s²",
                  .note = "the Jacobian of limbs 1, 2, with 1/l2; J̇ by differences, without spin"});
  RowMeter rods({.equation = "(41)",
                 .erratum = {},
                 .printed = "v̇_i2 = J̇_i2 θ̇ + J_i2 θ̈",
                 .corrected = {},
                 .limit = limit,
                 .unit = "m/s²",
                 .note = "with J_i2 corrected, J̇ by differences"});
  for (const State& state : states) {
    const Vec4 &dtheta = state.rates.dtheta, &ddtheta = state.rates.ddtheta;
    for (int i = 0; i < kLimbs; ++i) {
      const LimbTruth& limb = state.limbs[i];
      const LimbJacobians J = JacobiansAt(p, state.time_s, i);
      const LimbJacobians dJ = RateOfJacobians(p, state.time_s, i);
      const Vec3 turn = dJ.J_omega * dtheta + J.J_omega * ddtheta;
      // Without spin ω = η × η̇, whose rate η × η̈ is the part across the rod of the truth less
      // the gyroscopic part of the spin.
      const Vec3 eta = limb.R_rod.col(0);
      const Vec3 deta = limb.omega_rod.cross(eta);
      const Vec3 ddeta = limb.domega_rod.cross(eta) + limb.omega_rod.cross(deta);
      const Vec3 truth = eta.cross(ddeta);
      if (i < 2) AddAll(&eps, truth, turn, turn);
      if (i >= 2) AddAll(&omega, truth, turn * p.l3 / p.l2, turn);
      const Vec3 dv = dJ.J_i2 * dtheta + J.J_i2 * ddtheta;
      AddAll(&rods, limb.rods.a, dv, dv);
    }
  }
  return {eps.Finish(), omega.Finish(), rods.Finish()};
}

}  // namespace

std::vector<AuditRow> LinkRows(const scara::Parameters& parameters,
                               const std::vector<State>& states) {
  std::vector<AuditRow> rows = CentreRows(parameters, states);
  for (AuditRow& row : RotationRows(parameters, states)) rows.push_back(std::move(row));
  for (AuditRow& row : LinkAccelerationRows(parameters, states)) rows.push_back(std::move(row));
  return rows;
}

}  // namespace mbv::scara_audit
