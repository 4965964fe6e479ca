#include <algorithm>
#include <cmath>

#include "analytic/scara_robot/stiffness.h"
#include "features/equation_audit/scara_robot_audit.h"
#include "features/equation_audit/stiffness_truth.h"

namespace mbv::scara_audit {
namespace {

using scara_robot::MotorAxis;

/// −d/dt (I ω) of a body with solid-bar inertia, x along the bar, from its pose and rates.
Vec3 InertiaMoment(const scara_robot::BarInertia& bar, const Mat3& R, const Vec3& omega,
                   const Vec3& domega) {
  const Vec3 diagonal(bar.axial, bar.transverse, bar.transverse);
  const Vec3 w = R.transpose() * omega, dw = R.transpose() * domega;
  return -(R * (diagonal.cwiseProduct(dw) + w.cross(Vec3(diagonal.cwiseProduct(w)))));
}

scara_robot::BarInertia ArmInertia(const scara_robot::Parameters& p) {
  return scara_robot::SolidBar(p.m_arm, p.arm_radius, p.l1);
}
scara_robot::BarInertia RodInertia(const scara_robot::Parameters& p, int i) {
  return scara_robot::SolidBar(p.m_rods, p.rod_radius, p.rod_length(i));
}

std::vector<AuditRow> InertiaRows(const scara_robot::Parameters& p,
                                  const std::vector<State>& states) {
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
                .printed = "Q_i1 = m_i1 (g − v̇_i1), T_i1 = −θ̈_i I ν_i − θ̇_i² ν_i (I ν_i)",
                .limit = Limit(30.0),
                .unit = "N, N m",
                .note = "read with the lost cross and the dots on θ"});
  RowMeter rods({.equation = "(44), (45)",
                 .printed = "Q_i2 = m_i2 (g − v̇_i2), T_i2 = −I ε̇_i − ε_i (I ε_i)",
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
      scara_robot::LinkMotion links;
      FillLinkMotion(p, state.position, state.rates, state.J_inverse, scara_robot::RodModel::kFull,
                     i, &links);
      const Vec3 Q1 = 2 * p.arm_com * p.m_arm * (g - links.dv_arm);
      AddAll(&arm, 2 * p.arm_com * p.m_arm * (g - limb.arm.a), Q1, Q1);
      // The arm turns about a principal axis: the second term vanishes.
      const Vec3 T1 = -state.rates.ddtheta[i] * ArmInertia(p).transverse * MotorAxis(i);
      AddAll(&arm, InertiaMoment(ArmInertia(p), limb.R_arm, limb.omega_arm, limb.domega_arm), T1,
             T1);
      const Vec3 Q2 = p.m_rods * (g - links.dv_rod);
      AddAll(&rods, p.m_rods * (g - limb.rods.a), Q2, Q2);
      const Mat3 eta = state.position.eta[i] * state.position.eta[i].transpose();
      const scara_robot::BarInertia bar = RodInertia(p, i);
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
VirtualPower PowerOf(const scara_robot::Parameters& p, const State& state) {
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

AuditRow VirtualPowerRow(const scara_robot::Parameters& p, const std::vector<State>& states) {
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

std::vector<AuditRow> VirtualMotionRows(const scara_robot::Parameters& p,
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
      scara_robot::LinkMotion links;
      FillLinkMotion(p, state.position, state.rates, state.J_inverse, scara_robot::RodModel::kThin,
                     i, &links);
      AddAll(&arm, state.limbs[i].omega_arm, links.J_omega * dtheta, dtheta[i] * MotorAxis(i));
    }
  }
  return {platform.Finish(), arm.Finish()};
}

/// The most generous reading of (48): J⁻¹ for J, the factor θ_i dropped, the Jacobians of (31),
/// (34) and (36) corrected.
Vec4 PrintedTorques(const scara_robot::Parameters& p, const State& state) {
  const double g = -p.gravity_W.z();
  Vec4 M = -p.m_p * g * state.J_inverse.row(2).transpose();
  for (int i = 0; i < kLimbs; ++i) {
    scara_robot::LinkMotion links;
    FillLinkMotion(p, state.position, state.rates, state.J_inverse, scara_robot::RodModel::kThin, i,
                   &links);
    M += g * (p.m_arm * links.J_arm + p.m_rods * links.J_rod).row(2).transpose();
    M -= p.m_arm * links.J_arm.transpose() * links.dv_arm;
    M[i] += ArmInertia(p).transverse * state.rates.ddtheta[i];
    M += p.m_rods * links.J_rod.transpose() * links.dv_rod;
    M += RodInertia(p, i).transverse * links.J_omega.transpose() * links.domega;
  }
  return M;
}

AuditRow TorqueRow(const scara_robot::Parameters& p, const std::vector<State>& states) {
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

std::vector<AuditRow> DynamicsRows(const scara_robot::Parameters& parameters,
                                   const std::vector<State>& states) {
  std::vector<AuditRow> rows = InertiaRows(parameters, states);
  rows.push_back(VirtualPowerRow(parameters, states));
  for (AuditRow& row : VirtualMotionRows(parameters, states)) rows.push_back(std::move(row));
  rows.push_back(TorqueRow(parameters, states));
  return rows;
}

// Equations (11)–(21) of the SCARA robot against frame elements.

namespace {

using scara_robot::PlatformStiffness;
using scara_robot::PrintedForms;
using scara_robot::StiffnessParameters;
using stiffness_audit::AddMatrix;
using stiffness_audit::MatrixKind;

// Limit() of up to 3e5 N/m: frame and closed form differ by the poses' closure, 1e-13 m of lever
// arms of 0.05 m.
const double kStiffnessLimit = Limit(3e5);
constexpr int kPoses = 12;

// Poses in the quadrant x, y < 0, incommensurate in all coordinates.
Vec4 PoseOf(int k) {
  return {-0.055 + 0.025 * std::sin(1.7 * k), -0.050 + 0.025 * std::sin(2.3 * k + 1),
          -0.155 + 0.040 * std::sin(3.1 * k + 2), 0.05 + 0.25 * std::sin(0.9 * k)};
}

// x = y = −50 mm, φ = 0.2: the height at which arm 3 stands square to its rod.
Vec4 SquarePose(const StiffnessParameters& p) {
  const auto along = [&](double z) {
    PlatformStiffness at;
    (void)SolveStiffness(p, {}, Vec4(-0.05, -0.05, z, 0.2), &at);
    return at.position.u[2].dot(at.position.eta[2]);
  };
  double low = -0.203, high = -0.200;
  for (int k = 0; k < 60; ++k) {
    const double z = (low + high) / 2;
    (along(z) * along(low) > 0.0 ? low : high) = z;
  }
  return {-0.05, -0.05, low, 0.2};
}

struct Truth {
  Vec4 X;
  Mat6 K;                          // platform
  std::array<Mat6, kLimbs> limbs;  // platform on this limb only
  std::array<Mat6, 2> rods;        // of a parallelogram's bar at D, axes w, h, q
  std::array<double, 2> cos_q, sin_q;
};

// The elastic model with its loops closed at X, from a home pose there.
struct ModelAt {
  Mechanism m;
  std::vector<Pose> X_WB;
};
ModelAt LoadAt(const std::string& models_dir, const Vec4& X) {
  ModelAt at{stiffness_audit::LoadElastic(
                 models_dir, "scara_robot",
                 {{"home_x", X[0]}, {"home_y", X[1]}, {"home_z", X[2]}, {"home_phi", X[3]}}),
             {}};
  at.X_WB = stiffness_audit::PosesAt(
      at.m,
      {{"platform.x", X[0]}, {"platform.y", X[1]}, {"platform.z", X[2]}, {"platform.yaw", X[3]}});
  return at;
}

Truth TruthAt(const std::string& models_dir, const StiffnessParameters& p, const Vec4& X) {
  const auto [m, X_WB] = LoadAt(models_dir, X);
  const std::array<const char*, kLimbs> last = {"limb1.pivot", "limb2.pivot", "limb3.ball_B",
                                                "limb4.ball_B"};
  Truth truth;
  truth.X = X;
  truth.K = stiffness_audit::StiffnessAt(m, X_WB, "platform");
  PlatformStiffness at;
  (void)SolveStiffness(p, {}, X, &at);
  for (int i = 0; i < kLimbs; ++i) {
    std::vector<std::string> others;
    for (int k = 0; k < kLimbs; ++k) {
      if (k != i) others.emplace_back(last[k]);
    }
    truth.limbs[i] =
        stiffness_audit::StiffnessAt(stiffness_audit::Opened(m, others), X_WB, "platform");
    if (i >= 2) continue;
    const std::string limb = scara_robot::LimbName(i);
    const Vec3 w = at.position.eta[i], h = scara_robot::MotorAxis(i).cross(w).normalized();
    Mat3 axes;
    axes << w, h, w.cross(h);
    const Mechanism rods = stiffness_audit::Clamped(stiffness_audit::Opened(m, {limb + ".hinge_D"}),
                                                    limb + ".hinge_C", X_WB);
    truth.rods[i] =
        stiffness_audit::InAxes(stiffness_audit::StiffnessAt(rods, X_WB, limb + ".hub_D"), axes);
    truth.cos_q[i] = scara_robot::MotorAxis(i).dot(w);
    truth.sin_q[i] = scara_robot::MotorAxis(i).dot(axes.col(2));
  }
  return truth;
}

// A defect of (11): the limbs' stiffness with it, all else corrected.
struct Defect {
  const char *equation, *erratum, *printed, *corrected, *note;
  PrintedForms forms;
  int first, last;  // limbs
};

std::vector<Defect> Defects() {
  const char* const limb = "K_i of the limb alone, rotations times R; all else corrected";
  return {
      {"(11) rod axes, limbs 3, 4",
       "E22",
       "y2 ∥ a",
       "y2 = a − (a·w) w, normalised",
       "K_i of the limb alone, rotations times R; a is not square to the rod, so that bending "
       "leaks into its axial direction",
       {.rss_rod_frame = true},
       2,
       3},
      {"(11) J_p, limbs 3, 4",
       "E23",
       "ball at C: axes a, u × a",
       "two axes square to the rod",
       "right wherever u·w ≠ 0; one of the poses has arm 3 square to its rod, where J_p loses a "
       "rank and K_3 gains a second wrench",
       {.rss_passive = true},
       2,
       3},
      {"(11) motor axis, limbs 1, 2",
       "E24",
       "J_dac with w_i, the rods' direction",
       "a_i",
       limb,
       {.motor_axis = true},
       0,
       1},
      {"(11) arm axes, limbs 1, 2",
       "E25",
       "u, u × a, a: left-handed",
       "u, a, u × a",
       limb,
       {.arm_frame = true},
       0,
       1},
      {"(11) short rod axes, limbs 1, 2",
       "E26",
       "e, e × a, a: left-handed",
       "e, a, e × a",
       limb,
       {.short_rod_frame = true},
       0,
       1},
      {"(11) J_p columns, limbs 1, 2",
       "E28",
       "two columns: turns at C and D",
       "also the parallelogram's motion [0; q] and R_i2",
       "K_i of the limb alone; as printed the parallelogram is rigid in its plane and the limb "
       "resists φ: rank 4 instead of 2",
       {.passive_columns = true},
       0,
       1},
      {"(11) J_p axes, limbs 1, 2", "E29", "w_i", "a_i", limb, {.passive_axes = true}, 0, 1},
  };
}

AuditRow LimbRow(const StiffnessParameters& p, const std::vector<Truth>& truths,
                 const Defect& defect) {
  AuditRow texts = TextRow(defect.equation, defect.printed, defect.corrected, "N/m",
                           kStiffnessLimit, defect.note);
  texts.erratum = defect.erratum;
  RowMeter meter(texts);
  for (const Truth& truth : truths) {
    PlatformStiffness right, printed;
    (void)SolveStiffness(p, {}, truth.X, &right);
    (void)SolveStiffness(p, defect.forms, truth.X, &printed);
    for (int i = defect.first; i <= defect.last; ++i) {
      AddMatrix(&meter, MatrixKind::kStiffness, p.geometry.R, truth.limbs[i], printed.limbs[i].K,
                right.limbs[i].K);
    }
  }
  return meter.Finish();
}

AuditRow TipRow(const Mechanism& m, const StiffnessParameters& p) {
  RowMeter meter(
      TextRow("(12)", "k_ij of a clamped member", "", "N/m", 1e-4,
              "tip stiffness of the frame's beams of 50 … 185 mm, rotations times 0.1 m; "
              "in right-handed axes"));
  for (const double length : {p.geometry.e, p.geometry.l1, p.geometry.l2, p.geometry.l3}) {
    const Mat6 truth = stiffness_audit::CantileverStiffness(m.beams.front(), length);
    const Mat6 k = TipStiffness(p, length);
    AddMatrix(&meter, MatrixKind::kStiffness, p.geometry.R, truth, k, k);
  }
  return meter.Finish();
}

AuditRow ParallelogramRow(const StiffnessParameters& p, const std::vector<Truth>& truths) {
  AuditRow texts = TextRow("K_D1", "one rod's share, + k55 d² sin(2 q̂)/8",
                           "2 × […], − k55 d² sin(2 q̂)/8", "N/m", 1e-4,
                           "bar at D on its two rods alone, axes w, h, q, rotations times R; the "
                           "sixth degree of freedom, along q, is free");
  texts.erratum = "E27";
  RowMeter meter(texts);
  for (const Truth& truth : truths) {
    for (int i = 0; i < 2; ++i) {
      const Mat6 k = TipStiffness(p, p.geometry.l2);
      const auto whole = [&](bool printed) {
        Mat6 K = Mat6::Zero();
        K.topLeftCorner<5, 5>() =
            scara_robot::ParallelogramStiffness(k, p.d, truth.sin_q[i], truth.cos_q[i], printed);
        return K;
      };
      AddMatrix(&meter, MatrixKind::kStiffness, p.geometry.R, truth.rods[i], whole(true),
                whole(false));
    }
  }
  return meter.Finish();
}

// (13)–(21) on the platform.
std::vector<AuditRow> PlatformRows(const StiffnessParameters& p, const std::vector<Truth>& truths) {
  AuditRow saddle =
      TextRow("(13), (14)", "zero blocks 3 × 3", "5 × 5 (limbs 3, 4), 4 × 4 (1, 2)", "N/m",
              kStiffnessLimit, "the printed blocks do not fit J_p; K_i of each limb alone");
  saddle.erratum = "E30";
  AuditRow coordinates = TextRow("(20)", "m = G_m λᵀ", "m = G_m λ", "N m", 1e-7,
                                 "λ is a column; moment on the frame's platform under a small "
                                 "displacement, with the bases (18), (19)");
  coordinates.erratum = "E31";
  RowMeter limbs(saddle), lambda(coordinates);
  RowMeter sum(TextRow("(15)", "K = Σ K_i", "", "N/m", kStiffnessLimit,
                       "the whole frame, rotations times R"));
  RowMeter blocks(TextRow("(16), (17)", "[m; f] = K [Δγ; Δε], K_mt = K_frᵀ", "", "N", Limit(1e4),
                          "K_frᵀ of the closed form against K_mt of the frame"));
  RowMeter kappa_m(TextRow("(18), (21) κ_m", "‖G_m‖₂ in eigenvector bases", "", "1", Limit(2e4),
                           "equals ‖[K_mr K_mt]‖₂ of the frame: the bases change nothing; the "
                           "number mixes N m/rad and N"));
  RowMeter kappa_f(TextRow("(19), (21) κ_f", "‖G_f‖₂ in eigenvector bases", "", "1", Limit(5e5),
                           "equals ‖[K_fr K_ft]‖₂ of the frame; mixes N/rad and N/m"));
  for (const Truth& truth : truths) {
    PlatformStiffness at;
    (void)SolveStiffness(p, {}, truth.X, &at);
    const Mat6 none = Mat6::Constant(kNan);
    for (int i = 0; i < kLimbs; ++i) {
      AddMatrix(&limbs, MatrixKind::kStiffness, p.geometry.R, truth.limbs[i], none, at.limbs[i].K);
    }
    AddMatrix(&sum, MatrixKind::kStiffness, p.geometry.R, truth.K, at.K, at.K);
    const Mat3 K_mr = at.K.topLeftCorner<3, 3>(), K_mt = at.K.topRightCorner<3, 3>();
    const Mat3 K_fr = at.K.bottomLeftCorner<3, 3>(), K_ft = at.K.bottomRightCorner<3, 3>();
    for (int k = 0; k < 9; ++k) blocks.Add(truth.K(k / 3, 3 + k % 3), K_fr(k % 3, k / 3));
    const auto basis = [](const Mat3& K) {
      return Mat3(Eigen::SelfAdjointEigenSolver<Mat3>(Mat3(K.transpose() * K)).eigenvectors());
    };
    Eigen::Matrix<double, 3, 6> G_m, G_f;
    G_m << K_mr * basis(K_mr), K_mt * basis(K_mt);
    G_f << K_fr * basis(K_fr), K_ft * basis(K_ft);
    Vec6 displacement, coordinate;
    displacement << 1e-3, -2e-3, 3e-3, 4e-4, 5e-4, -6e-4;
    coordinate << basis(K_mr).transpose() * displacement.head<3>(),
        basis(K_mt).transpose() * displacement.tail<3>();
    const Vec3 moment = (truth.K * displacement).head<3>();
    AddAll(&lambda, moment, Vec3::Constant(kNan), G_m * coordinate);
    kappa_m.Add(truth.K.topRows<3>().operatorNorm(), G_m.operatorNorm());
    kappa_f.Add(truth.K.bottomRows<3>().operatorNorm(), G_f.operatorNorm());
  }
  return {limbs.Finish(),  sum.Finish(),     blocks.Finish(),
          lambda.Finish(), kappa_m.Finish(), kappa_f.Finish()};
}

// What the paper says of Figs 9–11.
std::vector<AuditRow> MapRows(const std::string& models_dir, const StiffnessParameters& p) {
  RowMeter straight(TextRow("Fig. 9, symmetry", "φ = 0: κ_m symmetric about y = x", "", "1",
                            Limit(3e4), "the closed form at (x, y) against the frame at (y, x)"));
  AuditRow texts = TextRow("Figs 10, 11, symmetry", "φ = ±45°: κ_m symmetric about y = x",
                           "κ_m(x, y, φ) = κ_m(y, x, −φ)", "1", Limit(3e4),
                           "the mechanism's mirror turns φ round: the maps for 45° and −45° mirror "
                           "each other");
  texts.erratum = "E32";
  RowMeter turned(texts);
  const auto kappa = [&](const Vec4& X) {
    PlatformStiffness at;
    (void)SolveStiffness(p, {}, X, &at);
    return scara_robot::IndicesOf(at.K, at.C).kappa_m;
  };
  for (const auto& [x, y, z] :
       {std::array{-0.06, -0.02, -0.1}, {-0.05, -0.045, -0.19}, {0.02, -0.05, -0.19}}) {
    for (const double phi : {0.0, M_PI / 4, -M_PI / 4}) {
      const auto [m, X_WB] = LoadAt(models_dir, {y, x, z, phi});
      const double truth =
          stiffness_audit::StiffnessAt(m, X_WB, "platform").topRows<3>().operatorNorm();
      if (phi == 0.0) {
        straight.Add(truth, kappa({x, y, z, 0.0}));
      } else {
        turned.Add(truth, kappa({x, y, z, phi}), kappa({x, y, z, -phi}));
      }
    }
  }
  return {straight.Finish(), turned.Finish()};
}

}  // namespace

std::vector<AuditRow> StiffnessRows(const std::string& models_dir, const StiffnessParameters& p) {
  std::vector<Truth> truths = {TruthAt(models_dir, p, SquarePose(p))};
  for (int k = 0; k < kPoses; ++k) truths.push_back(TruthAt(models_dir, p, PoseOf(k)));
  std::vector<AuditRow> rows;
  for (const Defect& defect : Defects()) rows.push_back(LimbRow(p, truths, defect));
  rows.push_back(TipRow(LoadAt(models_dir, PoseOf(0)).m, p));
  rows.push_back(ParallelogramRow(p, truths));
  for (AuditRow& row : PlatformRows(p, truths)) rows.push_back(std::move(row));
  for (AuditRow& row : MapRows(models_dir, p)) rows.push_back(std::move(row));
  return rows;
}

}  // namespace mbv::scara_audit
