#include <cmath>

#include "audit/scara_audit.h"

namespace mbv::scara_audit {
namespace {

using scara::MotorAxis;

/// −d/dt (I ω) of a body with solid-bar inertia, x along the bar, from its pose and rates.
Vec3 InertiaMoment(const scara::BarInertia& bar, const Mat3& R, const Vec3& omega,
                   const Vec3& domega) {
  const Vec3 diagonal(bar.axial, bar.transverse, bar.transverse);
  const Vec3 w = R.transpose() * omega, dw = R.transpose() * domega;
  return -(R * (diagonal.cwiseProduct(dw) + w.cross(Vec3(diagonal.cwiseProduct(w)))));
}

scara::BarInertia ArmInertia(const scara::Parameters& p) {
  return scara::SolidBar(p.m_arm, p.arm_radius, p.l1);
}
scara::BarInertia RodInertia(const scara::Parameters& p, int i) {
  return scara::SolidBar(p.m_rods, p.rod_radius, p.rod_length(i));
}

std::vector<AuditRow> InertiaRows(const scara::Parameters& p, const std::vector<State>& states) {
  RowMeter Q({.equation = "(42)",
              .erratum = "E15",
              .printed = "Q = m_p g ẑ − m_p p̈",
              .corrected = "Q = −m_p g ẑ − m_p p̈, z up",
              .limit = Limit(30.0),
              .unit = "N",
              .note = "the printed weight lifts the platform"});
  RowMeter T({.equation = "(42) moment",
              .erratum = "E16",
              .printed = "no moment of inertia",
              .corrected = "−I_pz φ̈ about z",
              .limit = Limit(0.1),
              .unit = "N m",
              .note = "I_pz is not printed either; a square plate is assumed"});
  RowMeter arm({.equation = "(43)",
                .erratum = {},
                .printed = "Q_i1 = m_i1 (g − v̇_i1), T_i1 = −θ̈_i I ν_i − θ̇_i² ν_i (I ν_i)",
                .corrected = {},
                .limit = Limit(30.0),
                .unit = "N, N m",
                .note = "read with the lost cross and the dots on θ"});
  RowMeter rods({.equation = "(44), (45)",
                 .erratum = {},
                 .printed = "Q_i2 = m_i2 (g − v̇_i2), T_i2 = −I ε̇_i − ε_i (I ε_i)",
                 .corrected = {},
                 .limit = Limit(30.0),
                 .unit = "N, N m",
                 .note = "read with the lost dot and cross; ε with spin"});
  const Vec3& g = p.gravity_W;
  for (const State& state : states) {
    const Vec3 ddp = state.rates.ddX.head<3>();
    AddAll(&Q, p.m_p * (g - state.P.a), -p.m_p * g - p.m_p * ddp, p.m_p * g - p.m_p * ddp);
    T.Add(-p.I_pz * state.domega_platform.z(), 0.0, -p.I_pz * state.rates.ddX[3]);
    for (int i = 0; i < kLimbs; ++i) {
      const LimbTruth& limb = state.limbs[i];
      scara::LinkMotion links;
      FillLinkMotion(p, state.position, state.rates, state.J_inverse, scara::RodModel::kFull, i,
                     &links);
      const Vec3 Q1 = 2 * p.arm_com * p.m_arm * (g - links.dv_arm);
      AddAll(&arm, 2 * p.arm_com * p.m_arm * (g - limb.arm.a), Q1, Q1);
      // The arm turns about a principal axis: the second term vanishes.
      const Vec3 T1 = -state.rates.ddtheta[i] * ArmInertia(p).transverse * MotorAxis(i);
      AddAll(&arm, InertiaMoment(ArmInertia(p), limb.R_arm, limb.omega_arm, limb.domega_arm), T1,
             T1);
      const Vec3 Q2 = p.m_rods * (g - links.dv_rod);
      AddAll(&rods, p.m_rods * (g - limb.rods.a), Q2, Q2);
      const Mat3 eta = state.position.eta[i] * state.position.eta[i].transpose();
      const scara::BarInertia bar = RodInertia(p, i);
      const Mat3 I = bar.transverse * (Mat3::Identity() - eta) + bar.axial * eta;
      const Vec3 T2 = -I * links.domega - links.omega.cross(Vec3(I * links.omega));
      AddAll(&rods, InertiaMoment(bar, limb.R_rod, limb.omega_rod, limb.domega_rod), T2, T2);
    }
  }
  return {Q.Finish(), T.Finish(), arm.Finish(), rods.Finish()};
}

/// Σ of (46) for the actual motion as virtual motion, with the reference's torques [W].
struct VirtualPower {
  double drives = 0.0;
  double printed = 0.0, corrected = 0.0;
};
VirtualPower PowerOf(const scara::Parameters& p, const State& state) {
  const Vec3& g = p.gravity_W;
  const Vec3 v = state.P.v;
  VirtualPower power;
  power.drives = state.M.dot(state.rates.dtheta);
  double links = 0.0;
  for (int i = 0; i < kLimbs; ++i) {
    const LimbTruth& limb = state.limbs[i];
    links += p.m_arm * (g - limb.arm.a).dot(limb.arm.v) +
             InertiaMoment(ArmInertia(p), limb.R_arm, limb.omega_arm, limb.domega_arm)
                 .dot(limb.omega_arm) +
             p.m_rods * (g - limb.rods.a).dot(limb.rods.v) +
             InertiaMoment(RodInertia(p, i), limb.R_rod, limb.omega_rod, limb.domega_rod)
                 .dot(limb.omega_rod);
  }
  // δX with three components: no moments about z.
  power.printed = power.drives + kForce.dot(v) + (-p.m_p * g - p.m_p * state.P.a).dot(v) + links;
  power.corrected = power.drives + kForce.dot(v) + (p.m_p * g - p.m_p * state.P.a).dot(v) +
                    (kMomentZ - p.I_pz * state.rates.ddX[3]) * state.rates.dX[3] + links;
  return power;
}

AuditRow VirtualPowerRow(const scara::Parameters& p, const std::vector<State>& states) {
  RowMeter meter({.equation = "(46)",
                  .erratum = "E17",
                  .printed = "Mᵀδθ + Fᵀδ(x, y, z) + Qᵀδ(x, y, z) + Σ(Qᵀδx + Tᵀδϑ) = 0",
                  .corrected = "δX = (δx, δy, δz, δφ), with M_z − I_pz φ̈ about z and (42) "
                               "corrected",
                  .limit = Limit(100.0),
                  .unit = "W",
                  .note = "with the model's torques and motion as virtual motion; as printed δX "
                          "has three components, but is multiplied with 4-column matrices"});
  double scale = 0.0;
  for (const State& state : states) {
    const VirtualPower power = PowerOf(p, state);
    meter.Add(0.0, power.printed, power.corrected);
    scale = std::max(scale, std::abs(power.drives));
  }
  AuditRow row = meter.Finish();
  row.scale = scale;
  return row;
}

std::vector<AuditRow> VirtualMotionRows(const scara::Parameters& p,
                                        const std::vector<State>& states) {
  RowMeter platform({.equation = "(47) δX",
                     .erratum = "E19",
                     .printed = "δX = J δθ",
                     .corrected = "δX = J⁻¹ δθ",
                     .limit = Limit(30.0),
                     .unit = "m/s, rad/s",
                     .note = "J maps Ẋ to θ̇; with θ̇ as δθ"});
  RowMeter arm({.equation = "(47) δϑ_i1",
                .erratum = "E20",
                .printed = "δϑ_i1 = J_εi δθ",
                .corrected = "δϑ_i1 = ν_i Φ_iᵀ δθ (arm), δϑ_i2 = J_ωi δθ (rods)",
                .limit = Limit(30.0),
                .unit = "rad/s",
                .note = "the rods' rotation under the arms' name; the arms' is missing"});
  for (const State& state : states) {
    const Vec4& dtheta = state.rates.dtheta;
    AddAll(&platform, state.rates.dX, state.J * dtheta, state.J_inverse * dtheta);
    for (int i = 0; i < kLimbs; ++i) {
      scara::LinkMotion links;
      FillLinkMotion(p, state.position, state.rates, state.J_inverse, scara::RodModel::kThin, i,
                     &links);
      AddAll(&arm, state.limbs[i].omega_arm, links.J_omega * dtheta, dtheta[i] * MotorAxis(i));
    }
  }
  return {platform.Finish(), arm.Finish()};
}

/// The most generous reading of (48): J⁻¹ for J, the factor θ_i dropped, the Jacobians of (31),
/// (34) and (36) corrected.
Vec4 PrintedTorques(const scara::Parameters& p, const State& state) {
  const double g = -p.gravity_W.z();
  Vec4 M = -p.m_p * g * state.J_inverse.row(2).transpose();
  for (int i = 0; i < kLimbs; ++i) {
    scara::LinkMotion links;
    FillLinkMotion(p, state.position, state.rates, state.J_inverse, scara::RodModel::kThin, i,
                   &links);
    M += g * (p.m_arm * links.J_arm + p.m_rods * links.J_rod).row(2).transpose();
    M -= p.m_arm * links.J_arm.transpose() * links.dv_arm;
    M[i] += ArmInertia(p).transverse * state.rates.ddtheta[i];
    M += p.m_rods * links.J_rod.transpose() * links.dv_rod;
    M += RodInertia(p, i).transverse * links.J_omega.transpose() * links.domega;
  }
  return M;
}

AuditRow TorqueRow(const scara::Parameters& p, const std::vector<State>& states) {
  RowMeter meter({.equation = "(48)",
                  .erratum = "E21",
                  .printed = "M = (Σ m_ij J_ijᵀ − m_p Jᵀ ẑ) g + […] Ẋ + […] Ẍ",
                  .corrected = "M = J⁻ᵀ{[m_p (p̈ − g); I_pz φ̈] − [F; M_z]} + Σ{J_i1ᵀ m_i1 (v̇_i1 "
                               "− g) + I θ̈_i Φ_i + J_i2ᵀ m_i2 (v̇_i2 − g) + J_ωiᵀ [I ω̇ + ω × "
                               "I ω]}",
                  .limit = Limit(10.0),
                  .unit = "N m",
                  .note = "against the model's drive torques; printed in its most generous "
                          "reading (J⁻¹ for J, no factor θ_i): no external force, no inertia of "
                          "the platform, weights of links and platform against each other, arms' "
                          "inertia with the wrong sign, no ω × Iω"});
  for (const State& state : states) {
    AddAll(&meter, state.M, PrintedTorques(p, state),
           DriveTorques(p, state.position, state.rates, kForce, kMomentZ));
  }
  return meter.Finish();
}

}  // namespace

std::vector<AuditRow> DynamicsRows(const scara::Parameters& parameters,
                                   const std::vector<State>& states) {
  std::vector<AuditRow> rows = InertiaRows(parameters, states);
  rows.push_back(VirtualPowerRow(parameters, states));
  for (AuditRow& row : VirtualMotionRows(parameters, states)) rows.push_back(std::move(row));
  rows.push_back(TorqueRow(parameters, states));
  return rows;
}

}  // namespace mbv::scara_audit
