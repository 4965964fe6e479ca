#include <fmt/format.h>
#include <cmath>
#include <numbers>

#include "analytic/scara_robot/workspace.h"
#include "features/equation_audit/scara_robot_audit.h"
#include "kinematics/mobility.h"

namespace mbv::scara_audit {
namespace {

using scara_robot::MotorAxis;
using scara_robot::Radial;

AuditRow TopologyRow(const Mechanism& mechanism) {
  RowMeter meter(
      {.equation = "F = Σf − Σξ",
       .printed = "(5 + 5 + 6 + 6) − (6 + 6 + 6) = 4",
       .limit = 0.0,
       .unit = "degrees of freedom",
       .note = "against the constraint rank of the model; f_i counts the degrees of freedom of a "
               "limb, not of a joint; the cross-bars are essential (6 without them)"});
  meter.Add(AnalyseMobility(mechanism).dofs, scara_robot::CountDofs().dofs);
  return meter.Finish();
}

AuditRow OutputRow(const std::vector<State>& states) {
  RowMeter meter({.equation = "M_pa",
                  .printed = "platform: three translations, one rotation about its normal",
                  .limit = Limit(1.0),
                  .unit = "rad",
                  .note = "tilt of the platform under way in the model"});
  for (const State& state : states) meter.Add(0.0, state.tilt);
  AuditRow row = meter.Finish();
  row.scale = 1.0;
  return row;
}

AuditRow PlateRow() {
  RowMeter meter({.equation = "Table 1, platform",
                  .printed = "0.4677 kg",
                  .limit = 1e-3,
                  .unit = "kg",
                  .note = "against a square steel plate of circumradius 50 mm, 12 mm thick"});
  meter.Add(7801.0 * 2 * 0.05 * 0.05 * 0.012, 0.4677);
  return meter.Finish();
}

AuditRow DensityRow() {
  RowMeter meter({.equation = "Table 1, ρ1, ρ2",
                  .erratum = "E1",
                  .printed = "density 210 kg/m³",
                  .corrected = "E = 210 GPa; density 7801 kg/m³ as for the platform",
                  .limit = 100,
                  .unit = "kg/m³",
                  .note =
                      "against steel of 7850 kg/m³, whose modulus is 210 GPa; two solid rods of "
                      "8 mm × 150 mm are then 0.118 kg of the printed 0.2037 kg per limb"});
  meter.Add(7850.0, 210.0, 7801.0);
  return meter.Finish();
}

std::vector<AuditRow> VectorRows(const scara_robot::Parameters& p,
                                 const std::vector<State>& states) {
  const double limit = Limit(p.l1);
  RowMeter s({.equation = "(1)",
              .printed = "s_i = r [c(φ+α_i), s(φ+α_i), 0]",
              .limit = limit,
              .unit = "m",
              .note = "against p_PB of the model"});
  RowMeter r({.equation = "(2)",
              .printed = "r_i = R [cα_i, sα_i, 0]",
              .limit = limit,
              .unit = "m",
              .note = "against p_OA of the model"});
  RowMeter u({.equation = "(4)",
              .printed = "u_i = [cθ_i cα_i, cθ_i sα_i, −sθ_i]",
              .limit = limit / p.l1,
              .unit = "1",
              .note = "against the direction A_i → C_i"});
  RowMeter five({.equation = "(3), (5)",
                 .erratum = "E2",
                 .printed = "p + s_i = r_i + l1 u_i + l2 v_i + e_i, e_i = (0, 0, +e)",
                 .corrected = "e_i = (0, 0, −e): D_i lies above B_i",
                 .limit = limit,
                 .unit = "m",
                 .note = "loop vector of limbs 1, 2 from the bodies' points; that the drawn robot "
                         "needs −e is measured in the row Fig. 8"});
  RowMeter six({.equation = "(6)",
                .printed = "p + s_i = r_i + l1 u_i + l3 w_i",
                .limit = limit,
                .unit = "m",
                .note = "loop vector of limbs 3, 4"});
  RowMeter seven({.equation = "(7), (8)",
                  .printed = "(p + s_i − r_i − l1 u_i − e_i)² = l2², l3² without e_i",
                  .limit = limit * p.l1,
                  .unit = "m²",
                  .note = "right once e_i is, see (3)"});
  RowMeter eta({.equation = "(22), (23)",
                .printed = "v_i = (p + s_i − r_i − l1 u_i − e_i)/l2; w_i without e_i, /l3",
                .limit = Limit(1.0),
                .unit = "1",
                .note = "right once e_i is, see (3); against the rods' axes"});
  for (const State& state : states) {
    const scara_robot::Position& at = state.position;
    for (int i = 0; i < kLimbs; ++i) {
      const LimbTruth& limb = state.limbs[i];
      AddAll(&s, limb.B.p - state.P.p, at.s[i], at.s[i]);
      AddAll(&r, limb.A.p, p.R * Radial(i), p.R * Radial(i));
      AddAll(&u, (limb.C.p - limb.A.p) / p.l1, at.u[i], at.u[i]);
      const Vec3 e(0, 0, -p.drop(i)), rod = p.rod_length(i) * limb.R_rod.col(0);
      const Vec3 chain = p.R * Radial(i) + p.l1 * at.u[i] + rod;
      if (i < 2) AddAll(&five, limb.B.p, chain - e, chain + e);
      if (i >= 2) AddAll(&six, limb.B.p, chain, chain);
      const Vec3 w = state.P.p + at.s[i] - p.R * Radial(i) - p.l1 * at.u[i] - e;
      seven.Add(p.rod_length(i) * p.rod_length(i), w.squaredNorm());
      AddAll(&eta, limb.R_rod.col(0), w / p.rod_length(i), w / p.rod_length(i));
    }
  }
  return {s.Finish(),   r.Finish(),     five.Finish(), u.Finish(),
          six.Finish(), seven.Finish(), eta.Finish()};
}

/// (9) and (10) with a sign of F and of e; θ is NaN when there is no real root.
struct Quadratic {
  double E, F, G;
  [[nodiscard]] double Residual(double theta) const {
    return E * std::sin(theta) + F * std::cos(theta) + G;
  }
  [[nodiscard]] double Theta() const {
    return 2 * std::atan((-E - std::sqrt(E * E + F * F - G * G)) / (G - F));
  }
};
Quadratic QuadraticOf(const scara_robot::Parameters& p, const State& state, int i, double sign_F,
                      double sign_e) {
  const Vec3 e(0, 0, sign_e * p.drop(i));
  const Vec3 q = state.P.p + state.position.s[i] - p.R * Radial(i) - e;
  const double L = p.rod_length(i);
  return {2 * p.l1 * q.z(), sign_F * 2 * p.l1 * q.dot(Radial(i)),
          q.squaredNorm() + p.l1 * p.l1 - L * L};
}

std::vector<AuditRow> InverseRows(const scara_robot::Parameters& p,
                                  const std::vector<State>& states) {
  RowMeter nine({.equation = "(9)",
                 .erratum = "E3",
                 .printed = "E sθ + F cθ + G = 0, F = +2 l1 q·(cα x̂ + sα ŷ)",
                 .corrected = "F = −2 l1 q·(cα x̂ + sα ŷ)",
                 .limit = Limit(p.l1 * p.l1),
                 .unit = "m²",
                 .note = "limbs 3, 4, which have no e; E_1 = E_2 means one expression"});
  RowMeter ten({.equation = "(10)",
                .erratum = "E2, E3",
                .printed = "θ = 2 atan[(−E − √(E² + F² − G²))/(G − F)] with (3) and (9) as printed",
                .corrected = "the same with F and e corrected; minus is the outward branch",
                .limit = Limit(1.0),
                .unit = "rad"});
  double only_e = 0, only_F = 0;
  int no_root = 0;
  for (const State& state : states) {
    for (int i = 0; i < kLimbs; ++i) {
      const double theta = state.theta[i];
      const Quadratic right = QuadraticOf(p, state, i, -1, -1);
      if (i >= 2) {
        nine.Add(0.0, QuadraticOf(p, state, i, 1, -1).Residual(theta), right.Residual(theta));
      }
      const double printed = QuadraticOf(p, state, i, 1, 1).Theta();
      no_root += std::isnan(printed);
      ten.Add(theta, std::isnan(printed) ? theta : printed, right.Theta());
      only_e = std::max(only_e, std::abs(QuadraticOf(p, state, i, 1, -1).Theta() - theta));
      only_F = std::max(only_F, std::abs(QuadraticOf(p, state, i, -1, 1).Theta() - theta));
    }
  }
  AuditRow row_nine = nine.Finish(), row_ten = ten.Finish();
  row_nine.scale = p.l1 * p.l1;
  row_ten.note = fmt::format(
      "against the model's motor angles; only e corrected: {:.2g} rad, only F: {:.2g} rad off; {} "
      "of {} printed roots are not real and not counted",
      only_e, only_F, no_root, 4 * states.size());
  return {row_nine, row_ten};
}

AuditRow CylinderRow(const scara_robot::Parameters& p) {
  RowMeter meter({.equation = "Fig. 8",
                  .erratum = "E2",
                  .printed = "cylinder of radius 100 mm, z −100 … −230 mm, with e_i = (0, 0, +e)",
                  .corrected = "the same with e_i = (0, 0, −e)",
                  .limit = 0.0,
                  .unit = "share",
                  .note = "share of the cylinder reached at φ = 0 on a polar grid; the text's "
                          "height of 90 mm contradicts its 130 mm between top and bottom"});
  scara_robot::Parameters printed = p;
  printed.e = -printed.e;
  const auto share = [](const scara_robot::Parameters& parameters) {
    const scara_robot::CylinderCheck check = CheckCylinder(
        parameters, scara_robot::Limits{}, scara_robot::CylinderSpace{}, 0.0, 14, 5, 24);
    double sum = 0;
    for (const double layer : check.layer_reached) sum += layer;
    return sum / static_cast<double>(check.layer_reached.size());
  };
  meter.Add(1.0, share(printed), share(p));
  return meter.Finish();
}

AuditRow ExampleRow(const scara_robot::Parameters& p) {
  RowMeter meter({.equation = "(49)",
                  .erratum = "E18",
                  .printed = "θ1 = θ3 = (π/15) s(0.2πt), θ2 = θ4 = −θ1, as absolute angles",
                  .corrected = "increments about (−50, −50, −130) mm, 15° with θ1, θ2 = +, θ3, "
                               "θ4 = −: equal turns about parallel axes",
                  .limit = 1e-9,
                  .unit = "m",
                  .note = "height of P above the paper's workspace (z < −100 mm). As printed the "
                          "loops close only at z = −e/2, above the base of the short rods; the "
                          "literal signs as increments from the centre leave within 0.3°"});
  const double amplitude = std::numbers::pi / 15;
  // The best closed pose at full amplitude as printed.
  scara_robot::Position printed;
  const RunSummary closed = SolveForwardPosition(
      p, Vec4(amplitude, -amplitude, amplitude, -amplitude), Vec4(0, 0, -p.e / 2, 0.7), &printed);
  const double z_printed = closed.ok() ? printed.X[2] : kNan;
  // The corrected reading over one period.
  scara_robot::Parameters home = p;
  home.home_X = Vec4(-0.05, -0.05, -0.13, std::numbers::pi / 12);
  scara_robot::Position start, at;
  double z_highest = -1.0;
  if (InversePosition(home, home.home_X, &start).ok()) {
    scara_robot::ForwardTracker tracker(home);
    for (int k = 0; k <= 40; ++k) {
      const double s = amplitude * std::sin(2 * std::numbers::pi * k / 40);
      const RunSummary run = tracker.Follow(start.theta + s * Vec4(1, 1, -1, -1), &at);
      z_highest = run.ok() ? std::max(z_highest, at.X[2]) : kNan;
    }
  }
  meter.Add(0.0, z_printed + 0.1, std::isnan(z_highest) ? kNan : std::max(0.0, z_highest + 0.1));
  AuditRow row = meter.Finish();
  row.scale = 0.13;
  return row;
}

}  // namespace

std::vector<AuditRow> PositionRows(const Mechanism& mechanism,
                                   const scara_robot::Parameters& parameters,
                                   const std::vector<State>& states) {
  std::vector<AuditRow> rows = {TopologyRow(mechanism), OutputRow(states), DensityRow(),
                                PlateRow()};
  for (AuditRow& row : VectorRows(parameters, states)) rows.push_back(std::move(row));
  for (AuditRow& row : InverseRows(parameters, states)) rows.push_back(std::move(row));
  rows.push_back(CylinderRow(parameters));
  rows.push_back(ExampleRow(parameters));
  return rows;
}

namespace {

using scara_robot::MotorAxis;

/// (30) with each of its errors optional; the transposes of R_i are always corrected (as printed
/// the shapes do not fit).
struct PrintedErrors {
  bool k_for_s = false;            ///< η·k_i for −η·s_i
  bool rod_rate_for_axis = false;  ///< σ_i = angular velocity of the rod, for the motor axis
  bool l2_for_all = false;
};
Mat4 PrintedForm(const scara_robot::Parameters& p, const State& state, int i,
                 const PrintedErrors& errors) {
  const scara_robot::Position& at = state.position;
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

Vec4 ProductWith(const scara_robot::Parameters& p, const State& state,
                 const PrintedErrors& errors) {
  Vec4 f;
  for (int i = 0; i < kLimbs; ++i) {
    f[i] = state.rates.dX.dot(PrintedForm(p, state, i, errors) * state.rates.dX) / (p.l1 * p.l1);
  }
  return f;
}

std::vector<AuditRow> JacobianRows(const scara_robot::Parameters& p,
                                   const std::vector<State>& states) {
  RowMeter loops({.equation = "(24), (25)",
                  .printed = "ṗ + ṡ_i = l1 θ̇_i (ν_i u_i) + l2 ε_i v_i; l3 ω_i w_i",
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
                    .printed = "θ̇ = J Ẋ, J = J_x⁻¹ J_θ",
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
    const scara_robot::Position& at = state.position;
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

std::vector<AuditRow> AccelerationRows(const scara_robot::Parameters& p,
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
  RowMeter whole(
      {.equation = "(30)",
       .erratum = "E7",
       .printed = "with all three errors below and misplaced transposes of R_i",
       .corrected = "Θ_i = (1/V)[−l1 (η·s) C + (η·u)/V² Rᵀηηᵀ R + (l1/L) RᵀPᵀP R], P = E − n ηᵀ/V",
       .limit = limit,
       .unit = unit,
       .note = "effect on θ̈; the transposes of R_i are corrected, else shapes do not fit"});
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
                    .printed = "Ẍ = J⁻¹ θ̈ − J⁻¹ f(Ẋ)",
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

std::vector<AuditRow> VelocityRows(const scara_robot::Parameters& parameters,
                                   const std::vector<State>& states) {
  std::vector<AuditRow> rows = JacobianRows(parameters, states);
  for (AuditRow& row : AccelerationRows(parameters, states)) rows.push_back(std::move(row));
  return rows;
}

namespace {

Vec3 Across(const Vec3& v, const Vec3& axis) { return v - axis.dot(v) * axis; }

/// The paper's Jacobians of one limb, corrected, at a commanded time of the sweep.
struct LimbJacobians {
  Mat34 J_i2, J_omega;
};
LimbJacobians JacobiansAt(const scara_robot::Parameters& p, double t_s, int i) {
  scara_robot::Position at;
  const RunSummary reach = InversePosition(p, PathAt(t_s).X, &at);
  LimbJacobians result;
  if (!reach.ok()) {
    result.J_i2.setConstant(kNan);
    result.J_omega.setConstant(kNan);
    return result;
  }
  scara_robot::LinkMotion links;
  FillLinkMotion(p, at, scara_robot::Rates{}, InverseOfJ(p, at), scara_robot::RodModel::kThin, i,
                 &links);
  result.J_i2 = links.J_rod;
  result.J_omega = links.J_omega;
  return result;
}

/// dJ/dt by sixth-order differences; step for 1e-9 of roundoff and truncation at 6 Hz.
LimbJacobians RateOfJacobians(const scara_robot::Parameters& p, double t_s, int i) {
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

std::vector<AuditRow> CentreRows(const scara_robot::Parameters& p,
                                 const std::vector<State>& states) {
  const double limit = Limit(3.0);
  RowMeter v1({.equation = "(31) v_i1",
               .printed = "v_i1 = ½ l1 θ̇_i (ν_i u_i)",
               .limit = limit,
               .unit = "m/s",
               .note = "lost cross; against the middle of the arm"});
  RowMeter J1({.equation = "(31) J_i1",
               .erratum = "E8",
               .printed = "J_i1 = [½ l1 θ̇_i (ν_i × u_i)ᵀ 0]ᵀ Φ_i",
               .corrected = "J_i1 = ½ l1 (ν_i × u_i) Φ_iᵀ",
               .limit = limit,
               .unit = "m/s",
               .note = "contains θ̇_i, so that J_i1 θ̇ is quadratic in the rates; shapes corrected"});
  RowMeter vC({.equation = "(32)",
               .erratum = "E9",
               .printed = "v_C = v_i1",
               .corrected = "v_C = 2 v_i1",
               .limit = limit,
               .unit = "m/s",
               .note = "the tip moves twice as fast as the middle"});
  RowMeter vB({.equation = "(33)",
               .printed = "v_B = v_D",
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
               .printed = "v_i2 = ½ (v_C + v_D)",
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
    const scara_robot::Position& at = state.position;
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

std::vector<AuditRow> RotationRows(const scara_robot::Parameters& p,
                                   const std::vector<State>& states) {
  const double limit = Limit(30.0);
  RowMeter across({.equation = "(37)",
                   .printed = "ε_i = (1/l2) U_i (J_B − 2 J_i1) θ̇, the part across the rod",
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
    const scara_robot::Position& at = state.position;
    for (int i = 0; i < kLimbs; ++i) {
      const LimbTruth& limb = state.limbs[i];
      scara_robot::LinkMotion thin, full;
      FillLinkMotion(p, at, state.rates, state.J_inverse, scara_robot::RodModel::kThin, i, &thin);
      FillLinkMotion(p, at, state.rates, state.J_inverse, scara_robot::RodModel::kFull, i, &full);
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

std::vector<AuditRow> LinkAccelerationRows(const scara_robot::Parameters& p,
                                           const std::vector<State>& states) {
  // Differences of the Jacobians: 1e-9 of their rates.
  const double limit = 1e-7;
  RowMeter eps({.equation = "(39)",
                .printed = "ε̇_i = J̇_εi θ̇ + J_εi θ̈",
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
                 .printed = "v̇_i2 = J̇_i2 θ̇ + J_i2 θ̈",
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

std::vector<AuditRow> LinkRows(const scara_robot::Parameters& parameters,
                               const std::vector<State>& states) {
  std::vector<AuditRow> rows = CentreRows(parameters, states);
  for (AuditRow& row : RotationRows(parameters, states)) rows.push_back(std::move(row));
  for (AuditRow& row : LinkAccelerationRows(parameters, states)) rows.push_back(std::move(row));
  return rows;
}

}  // namespace mbv::scara_audit
