#include <cmath>

#include "audit/scara_audit.h"

namespace mbv::scara_audit {
namespace {

using scara::MotorAxis;

/// (30) with each of its errors optional; the transposes of R_i are always mended (as printed the
/// shapes do not fit).
struct PrintedErrors {
  bool k_for_s = false;            ///< η·k_i for −η·s_i
  bool rod_rate_for_axis = false;  ///< σ_i = angular velocity of the rod, for the motor axis
  bool l2_for_all = false;
};
Mat4 PrintedForm(const scara::Parameters& p, const State& state, int i,
                 const PrintedErrors& errors) {
  const scara::Position& at = state.position;
  const Vec3& eta = at.eta[i];
  const Vec3 sigma = errors.rod_rate_for_axis ? state.limbs[i].omega_rod : MotorAxis(i);
  const Vec3 sigma_u = sigma.cross(at.u[i]);
  Mat34 R;
  R << Mat3::Identity(), at.k[i];
  const Mat34 PR = (Mat3::Identity() - sigma_u * eta.transpose() / at.V[i]) * R;
  const double L = errors.l2_for_all ? p.l2 : p.rod_length(i);
  const Vec4 R_eta = R.transpose() * eta;
  Mat4 form = sigma_u.dot(sigma.cross(eta)) / (at.V[i] * at.V[i]) * R_eta * R_eta.transpose() +
              p.l1 / L * PR.transpose() * PR;
  form(3, 3) += p.l1 * (errors.k_for_s ? eta.dot(at.k[i]) : -eta.dot(at.s[i]));
  return form / at.V[i];
}

Vec4 ProductWith(const scara::Parameters& p, const State& state, const PrintedErrors& errors) {
  Vec4 f;
  for (int i = 0; i < kLimbs; ++i) {
    f[i] = state.rates.dX.dot(PrintedForm(p, state, i, errors) * state.rates.dX) / (p.l1 * p.l1);
  }
  return f;
}

std::vector<AuditRow> JacobianRows(const scara::Parameters& p, const std::vector<State>& states) {
  RowMeter loops({.equation = "(24), (25)",
                  .erratum = {},
                  .printed = "ṗ + ṡ_i = l1 θ̇_i (ν_i u_i) + l2 ε_i v_i; l3 ω_i w_i",
                  .corrected = {},
                  .limit = Limit(3.0),
                  .unit = "m/s",
                  .note = "the cross signs are lost in print; against the model's velocities"});
  RowMeter projected({.equation = "(26), (27)",
                      .erratum = "E4",
                      .printed = "η_i·(ṗ + ṡ_i) = l1 θ_i η_i·(ν_i × u_i)",
                      .corrected = "θ̇_i for θ_i",
                      .limit = Limit(3.0),
                      .unit = "m/s",
                      .note = "a lost dot; the next equation has it"});
  RowMeter inverse({.equation = "(28) J",
                    .erratum = {},
                    .printed = "θ̇ = J Ẋ, J = J_x⁻¹ J_θ",
                    .corrected = {},
                    .limit = Limit(30.0),
                    .unit = "rad/s",
                    .note = "J_x multiplies θ̇, unusual names; against the model's motor rates"});
  RowMeter forward({.equation = "(28) Ẋ",
                    .erratum = "E5",
                    .printed = "Ẋ = J⁻¹ θ̇ = J⁻¹ J_x⁻¹ J_θ",
                    .corrected = "Ẋ = J⁻¹ θ̇ = J_θ⁻¹ J_x θ̇",
                    .limit = Limit(30.0),
                    .unit = "m/s, rad/s",
                    .note = "a matrix cannot equal a vector; read as J⁻¹ J_x⁻¹ J_θ θ̇"});
  for (const State& state : states) {
    const scara::Position& at = state.position;
    const Vec4& dtheta = state.rates.dtheta;
    for (int i = 0; i < kLimbs; ++i) {
      const LimbTruth& limb = state.limbs[i];
      const Vec3 across =
          p.l1 * dtheta[i] * at.n[i] + p.rod_length(i) * limb.omega_rod.cross(at.eta[i]);
      AddAll(&loops, state.P.v + at.k[i] * state.rates.dX[3], across, across);
      const double side = at.eta[i].dot(limb.B.v), V = p.l1 * at.V[i];
      projected.Add(side, V * state.theta[i], V * dtheta[i]);
    }
    AddAll(&inverse, dtheta, state.J * state.rates.dX, state.J * state.rates.dX);
    const Vec4 J_x = InverseJacobian(p, at);
    AddAll(&forward, state.rates.dX,
           state.J_inverse * (DirectJacobian(at) * dtheta).cwiseQuotient(J_x),
           state.J_inverse * dtheta);
  }
  return {loops.Finish(), projected.Finish(), inverse.Finish(), forward.Finish()};
}

std::vector<AuditRow> AccelerationRows(const scara::Parameters& p,
                                       const std::vector<State>& states) {
  const double limit = Limit(1000.0);
  const std::string unit = "rad/s²";
  RowMeter length({.equation = "(29)",
                   .erratum = "E6",
                   .printed = "f_i = Ẋᵀ Θ_i Ẋᵀ / l_i²",
                   .corrected = "f_i = Ẋᵀ Θ_i Ẋ / l1² for every limb",
                   .limit = limit,
                   .unit = unit,
                   .note = "θ̈ = J Ẍ + f with the corrected (30); l_i read as L_i"});
  RowMeter whole({.equation = "(30)",
                  .erratum = "E7",
                  .printed = "with all three errors below and misplaced transposes of R_i",
                  .corrected = "Θ_i = (1/V)[−l1 (η·s) C + (η·u)/V² Rᵀηηᵀ R + (l1/L) RᵀPᵀP R], "
                               "P = E − n ηᵀ/V",
                  .limit = limit,
                  .unit = unit,
                  .note = "effect on θ̈; the transposes of R_i are mended, else shapes do not fit"});
  RowMeter first({.equation = "(30) first term",
                  .erratum = "E7a",
                  .printed = "+l1 (η·k_i) C",
                  .corrected = "−l1 (η·s_i) C",
                  .limit = limit,
                  .unit = unit,
                  .note = "∂k_i/∂φ = −s_i; the other terms corrected"});
  RowMeter sigma({.equation = "(30) σ_i",
                  .erratum = "E7b",
                  .printed = "σ_i = angular velocity of the rod",
                  .corrected = "σ_i = ν_i, the motor axis: (σ × u)·(σ × η) = u·η",
                  .limit = limit,
                  .unit = unit,
                  .note = "the other terms corrected"});
  RowMeter ratio({.equation = "(30) l1/l2",
                  .erratum = "E7c",
                  .printed = "l1/l2 for every limb",
                  .corrected = "l1/l3 for limbs 3, 4",
                  .limit = limit,
                  .unit = unit,
                  .note = "the other terms corrected"});
  RowMeter forward({.equation = "(29) Ẍ",
                    .erratum = {},
                    .printed = "Ẍ = J⁻¹ θ̈ − J⁻¹ f(Ẋ)",
                    .corrected = {},
                    .limit = limit,
                    .unit = "m/s², rad/s²",
                    .note = "with the corrected f"});
  for (const State& state : states) {
    const Vec4 linear = state.J * state.rates.ddX;
    const Vec4 f = VelocityProduct(p, state.position, state.rates.dX);
    const Vec4& truth = state.rates.ddtheta;
    Vec4 by_length = f;
    for (int i = 0; i < kLimbs; ++i) {
      by_length[i] *= p.l1 * p.l1 / (p.rod_length(i) * p.rod_length(i));
    }
    AddAll(&length, truth, linear + by_length, linear + f);
    const auto with = [&](PrintedErrors errors) -> VecX {
      return linear + ProductWith(p, state, errors);
    };
    AddAll(&whole, truth, with({true, true, true}), linear + f);
    AddAll(&first, truth, with({.k_for_s = true}), linear + f);
    AddAll(&sigma, truth, with({.rod_rate_for_axis = true}), linear + f);
    AddAll(&ratio, truth, with({.l2_for_all = true}), linear + f);
    AddAll(&forward, state.rates.ddX, state.J_inverse * (truth - f), state.J_inverse * (truth - f));
  }
  return {length.Finish(), forward.Finish(), whole.Finish(),
          first.Finish(),  sigma.Finish(),   ratio.Finish()};
}

}  // namespace

std::vector<AuditRow> VelocityRows(const scara::Parameters& parameters,
                                   const std::vector<State>& states) {
  std::vector<AuditRow> rows = JacobianRows(parameters, states);
  for (AuditRow& row : AccelerationRows(parameters, states)) rows.push_back(std::move(row));
  return rows;
}

}  // namespace mbv::scara_audit
