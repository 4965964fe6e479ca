// Equations (11)–(21) of the SCARA robot against frame elements.
#include <algorithm>
#include <cmath>

#include "analytic/scara_robot/stiffness.h"
#include "analytic/scara_robot/stiffness_form.h"
#include "audit/scara_audit.h"
#include "audit/stiffness_truth.h"

namespace mbv::scara_audit {
namespace {

using scara::PlatformStiffness;
using scara::PrintedForms;
using scara::StiffnessParameters;
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
    const std::string limb = scara::LimbName(i);
    const Vec3 w = at.position.eta[i], h = scara::MotorAxis(i).cross(w).normalized();
    Mat3 axes;
    axes << w, h, w.cross(h);
    const Mechanism rods = stiffness_audit::Clamped(stiffness_audit::Opened(m, {limb + ".hinge_D"}),
                                                    limb + ".hinge_C", X_WB);
    truth.rods[i] =
        stiffness_audit::InAxes(stiffness_audit::StiffnessAt(rods, X_WB, limb + ".hub_D"), axes);
    truth.cos_q[i] = scara::MotorAxis(i).dot(w);
    truth.sin_q[i] = scara::MotorAxis(i).dot(axes.col(2));
  }
  return truth;
}

// A defect of (11): the limbs' stiffness with it, all else mended.
struct Defect {
  const char *equation, *erratum, *printed, *corrected, *note;
  PrintedForms forms;
  int first, last;  // limbs
};

std::vector<Defect> Defects() {
  const char* const limb = "K_i of the limb alone, rotations times R; all else mended";
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
                           "sixth freedom, along q, is free");
  texts.erratum = "E27";
  RowMeter meter(texts);
  for (const Truth& truth : truths) {
    for (int i = 0; i < 2; ++i) {
      const Mat6 k = TipStiffness(p, p.geometry.l2);
      const auto whole = [&](bool printed) {
        Mat6 K = Mat6::Zero();
        K.topLeftCorner<5, 5>() =
            scara::ParallelogramStiffness(k, p.d, truth.sin_q[i], truth.cos_q[i], printed);
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
    return scara::IndicesOf(at.K, at.C).kappa_m;
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
