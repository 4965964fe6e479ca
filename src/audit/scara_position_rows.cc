#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "analytic/scara_robot/workspace.h"
#include "audit/scara_audit.h"
#include "kinematics/mobility.h"

namespace mbv::scara_audit {
namespace {

using scara::MotorAxis;
using scara::Radial;

AuditRow TopologyRow(const Mechanism& mechanism) {
  RowMeter meter({.equation = "F = Σf − Σξ",
                  .erratum = {},
                  .printed = "(5 + 5 + 6 + 6) − (6 + 6 + 6) = 4",
                  .corrected = {},
                  .limit = 0.0,
                  .unit = "freedoms",
                  .note = "against the constraint rank of the model; f_i counts the freedoms of a "
                          "limb, not of a joint; the cross-bars are essential (6 without them)"});
  meter.Add(AnalyseMobility(mechanism).freedoms, scara::CountFreedoms().freedoms);
  return meter.Finish();
}

AuditRow OutputRow(const std::vector<State>& states) {
  RowMeter meter({.equation = "M_pa",
                  .erratum = {},
                  .printed = "platform: three translations, one rotation about its normal",
                  .corrected = {},
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
                  .erratum = {},
                  .printed = "0.4677 kg",
                  .corrected = {},
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

std::vector<AuditRow> VectorRows(const scara::Parameters& p, const std::vector<State>& states) {
  const double limit = Limit(p.l1);
  RowMeter s({.equation = "(1)",
              .erratum = {},
              .printed = "s_i = r [c(φ+α_i), s(φ+α_i), 0]",
              .corrected = {},
              .limit = limit,
              .unit = "m",
              .note = "against p_PB of the model"});
  RowMeter r({.equation = "(2)",
              .erratum = {},
              .printed = "r_i = R [cα_i, sα_i, 0]",
              .corrected = {},
              .limit = limit,
              .unit = "m",
              .note = "against p_OA of the model"});
  RowMeter u({.equation = "(4)",
              .erratum = {},
              .printed = "u_i = [cθ_i cα_i, cθ_i sα_i, −sθ_i]",
              .corrected = {},
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
                .erratum = {},
                .printed = "p + s_i = r_i + l1 u_i + l3 w_i",
                .corrected = {},
                .limit = limit,
                .unit = "m",
                .note = "loop vector of limbs 3, 4"});
  RowMeter seven({.equation = "(7), (8)",
                  .erratum = {},
                  .printed = "(p + s_i − r_i − l1 u_i − e_i)² = l2², l3² without e_i",
                  .corrected = {},
                  .limit = limit * p.l1,
                  .unit = "m²",
                  .note = "right once e_i is, see (3)"});
  RowMeter eta({.equation = "(22), (23)",
                .erratum = {},
                .printed = "v_i = (p + s_i − r_i − l1 u_i − e_i)/l2; w_i without e_i, /l3",
                .corrected = {},
                .limit = Limit(1.0),
                .unit = "1",
                .note = "right once e_i is, see (3); against the rods' axes"});
  for (const State& state : states) {
    const scara::Position& at = state.position;
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
Quadratic QuadraticOf(const scara::Parameters& p, const State& state, int i, double sign_F,
                      double sign_e) {
  const Vec3 e(0, 0, sign_e * p.drop(i));
  const Vec3 q = state.P.p + state.position.s[i] - p.R * Radial(i) - e;
  const double L = p.rod_length(i);
  return {2 * p.l1 * q.z(), sign_F * 2 * p.l1 * q.dot(Radial(i)),
          q.squaredNorm() + p.l1 * p.l1 - L * L};
}

std::vector<AuditRow> InverseRows(const scara::Parameters& p, const std::vector<State>& states) {
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
                .unit = "rad",
                .note = {}});
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

AuditRow CylinderRow(const scara::Parameters& p) {
  RowMeter meter({.equation = "Fig. 8",
                  .erratum = "E2",
                  .printed = "cylinder of radius 100 mm, z −100 … −230 mm, with e_i = (0, 0, +e)",
                  .corrected = "the same with e_i = (0, 0, −e)",
                  .limit = 0.0,
                  .unit = "share",
                  .note = "share of the cylinder reached at φ = 0 on a polar grid; the text's "
                          "height of 90 mm contradicts its 130 mm between top and bottom"});
  scara::Parameters printed = p;
  printed.e = -printed.e;
  const auto share = [](const scara::Parameters& parameters) {
    const scara::CylinderCheck check =
        CheckCylinder(parameters, scara::Limits{}, scara::CylinderSpace{}, 0.0, 14, 5, 24);
    double sum = 0;
    for (const double layer : check.layer_reached) sum += layer;
    return sum / static_cast<double>(check.layer_reached.size());
  };
  meter.Add(1.0, share(printed), share(p));
  return meter.Finish();
}

AuditRow ExampleRow(const scara::Parameters& p) {
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
  scara::Position printed;
  const RunSummary closed = SolveForwardPosition(
      p, Vec4(amplitude, -amplitude, amplitude, -amplitude), Vec4(0, 0, -p.e / 2, 0.7), &printed);
  const double z_printed = closed.ok() ? printed.X[2] : kNan;
  // The corrected reading over one period.
  scara::Parameters home = p;
  home.home_X = Vec4(-0.05, -0.05, -0.13, std::numbers::pi / 12);
  scara::Position start, at;
  double z_highest = -1.0;
  if (InversePosition(home, home.home_X, &start).ok()) {
    scara::ForwardTracker tracker(home);
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

std::vector<AuditRow> PositionRows(const Mechanism& mechanism, const scara::Parameters& parameters,
                                   const std::vector<State>& states) {
  std::vector<AuditRow> rows = {TopologyRow(mechanism), OutputRow(states), DensityRow(),
                                PlateRow()};
  for (AuditRow& row : VectorRows(parameters, states)) rows.push_back(std::move(row));
  for (AuditRow& row : InverseRows(parameters, states)) rows.push_back(std::move(row));
  rows.push_back(CylinderRow(parameters));
  rows.push_back(ExampleRow(parameters));
  return rows;
}

}  // namespace mbv::scara_audit
