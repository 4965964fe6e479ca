// Equations (1)–(10): position.

#include <cmath>
#include <numbers>
#include <random>

#include "analytic/spr_tripod/workspace.h"
#include "features/equation_audit/audit.h"
#include "features/equation_audit/spr_tripod_audit.h"
#include "math/profile.h"
#include "math/spatial.h"

namespace mbv::spr_tripod_audit {
namespace {

using namespace spr_tripod;
using std::numbers::pi;

const double kRoot3 = std::sqrt(3.0);

// R of the paper, entry by entry as printed.
Mat3 PrintedRotation(double psi, double theta, double delta) {
  const double cp = std::cos(psi), sp = std::sin(psi), ct = std::cos(theta), st = std::sin(theta),
               cd = std::cos(delta), sd = std::sin(delta);
  Mat3 R;
  R << cp * cd - sp * ct * sd, -cp * sd - sp * ct * cd, sp * st,  //
      sp * cd + cp * ct * sd, -sp * sd + cp * ct * cd, -cp * st,  //
      st * sd, st * cd, ct;
  return R;
}

// (6), (10) as printed.
Vec3 PrintedCentre(double b, const Mat3& R, double z0) {
  const double u_x = R(0, 0), u_y = R(1, 0), v_x = R(0, 1), v_y = R(1, 1);
  return {(b * u_y * (3 * v_y - u_x) + 2 * z0 * R(0, 2)) / (2 * R(2, 2)),
          (b * u_x * (u_x - v_y) - 2 * b * v_x * u_y + 2 * z0 * R(1, 2)) / (2 * R(2, 2)), z0};
}

// (7) as printed, squared lengths.
PerLeg<double> PrintedSquares(const Geometry& g, const Vec3& r, const Mat3& R) {
  const double a = g.a, b = g.b, s = b * b + a * a + r.squaredNorm();
  const double u_x = R(0, 0), v_x = R(0, 1), v_y = R(1, 1);
  return {s + b * r.y() - kRoot3 * b * r.x() - 2 * a * b * u_x + 2 * kRoot3 * a * b * v_x,
          s - 3 * a * b * v_y + a * b * u_x - 2 * b * r.y(),
          s + b * r.y() + kRoot3 * b * r.x() - 2 * a * b * u_x - 2 * kRoot3 * a * b * v_x};
}

double Root(double square) { return std::sqrt(std::max(square, 0.0)); }

// R, (1)–(5), (8), (9): right as printed.
void GeometryRows(const Case& c, std::vector<AuditRow>* rows) {
  const auto row = [](const char* equation, const char* printed, const char* note) {
    return RowMeter({.equation = equation,
                     .printed = printed,
                     .limit = kPositionLimit,
                     .unit = "m",
                     .note = note});
  };
  RowMeter rotation({.equation = "R (z-x-z)",
                     .printed = "Rot(z,ψ) Rot(x,θ) Rot(z,δ), written out",
                     .limit = kPositionLimit,
                     .unit = "1",
                     .note = "the printed matrix at the reference's angles, against its rotation"});
  RowMeter loop = row("(1)", "r = b_i + q_i w_i − a_i", "with the reference's q_i, w_i");
  RowMeter hinge = row("(2)", "q_i w_i·c_i = 0, c_i = R (cos θ_i, sin θ_i, 0)",
                       "with the reference's A_i, B_i and platform; size: q_i");
  RowMeter joints = row("(3)", "B_i = b f_i, A_i = a R f_i + r",
                        "against origins of the reference's cylinders and rods");
  RowMeter length =
      row("(4)", "q_i² = |A_i − B_i|²", "lengths q_i against the reference's prismatic joints");
  RowMeter vector = row("(5)", "q_i w_i = A_i − B_i", "against the reference's prismatic axes");
  RowMeter direction({.equation = "(8)",
                      .printed = "w_i = (r + a_i − b_i)/q_i",
                      .limit = kPositionLimit,
                      .unit = "1",
                      .note = "against the reference's prismatic axes"});
  RowMeter forward = row("(9)", "q_i² = (r + a_i − b_i)ᵀ(r + a_i − b_i)", "as (4)");
  for (const Truth& t : c.truth) {
    const Mat3 R = PrintedRotation(t.psi, t.theta, t.delta);
    for (int k = 0; k < 9; ++k) rotation.Add(t.R(k / 3, k % 3), R(k / 3, k % 3));
    for (int i = 0; i < 3; ++i) {
      const LegTruth& leg = t.leg[i];
      const Vec3 a_i = c.geometry.a * (t.R * c.geometry.f[i]), b_i = c.geometry.b * c.geometry.f[i];
      const Vec3 qw = t.r + a_i - b_i;
      for (int k = 0; k < 3; ++k) {
        loop.Add(t.r[k], (b_i + leg.q * leg.w - a_i)[k]);
        joints.Add(leg.A[k], (t.r + a_i)[k]);
        joints.Add(leg.B[k], b_i[k]);
        vector.Add(leg.q * leg.w[k], qw[k]);
        direction.Add(leg.w[k], qw[k] / leg.q);
      }
      hinge.Add(leg.q, leg.q + (leg.A - leg.B).dot(t.R * c.geometry.c[i]));
      length.Add(leg.q, qw.norm());
      forward.Add(leg.q, std::sqrt(qw.dot(qw)));
    }
  }
  for (RowMeter* meter :
       {&rotation, &loop, &hinge, &joints, &length, &vector, &direction, &forward}) {
    rows->push_back(meter->Finish());
  }
}

const char* kPrinted6 =
    "x0 = [b u_y (3v_y − u_x) + 2 z0 w_x]/(2w_z), "
    "y0 = [b u_x (u_x − v_y) − 2b v_x u_y + 2 z0 w_y]/(2w_z)";
const char* kCorrected6 =
    "x0 = {b [v_y (v_y − u_x) − 2u_y v_x] + 2 z0 w_x}/(2w_z), "
    "y0 = {b v_x (3u_x − v_y) + 2 z0 w_y}/(2w_z)";
const char* kPrinted7 =
    "q1² = s + b y0 − √3 b x0 − 2ab u_x + 2√3 ab v_x, q2² = s − 2b y0 − 3ab v_y + ab u_x, "
    "q3² = s + b y0 + √3 b x0 − 2ab u_x − 2√3 ab v_x";
const char* kCorrected7 =
    "q1² = s + b x0 − √3 b y0 − 2ab v_y + 2√3 ab v_x, q2² = s + b x0 + √3 b y0 − 2ab v_y − "
    "2√3 ab v_x, q3² = s − 2b x0 − 3ab u_x + ab v_y";

// (6), (7), (10) in the frame of the text.
void ClosedFormRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter centre({.equation = "(6) x0, y0",
                   .printed = kPrinted6,
                   .corrected = kCorrected6,
                   .limit = kPositionLimit,
                   .unit = "m",
                   .note = "from the reference's rotation; the print mixes two frames, see below"});
  RowMeter torsion({.equation = "(6) δ",
                    .printed = "δ = ψ",
                    .corrected = "δ = −ψ",
                    .limit = kPositionLimit,
                    .unit = "rad",
                    .note = "wrong sign: the torsion δ + ψ of the platform is zero"});
  RowMeter impossible(
      {.equation = "(6) δ in (2)",
       .printed = "constraints (2) at δ = ψ, x0 and y0 fitted best",
       .corrected = "at δ = −ψ",
       .limit = kPositionLimit,
       .unit = "m",
       .note = "with the printed torsion no position meets the constraints; size: b"});
  RowMeter lengths({.equation = "(7)",
                    .printed = kPrinted7,
                    .corrected = kCorrected7,
                    .limit = kPositionLimit,
                    .unit = "m",
                    .note = "lengths q_i at the reference's pose; s = a² + b² + |r|²"});
  RowMeter repeated({.equation = "(10)",
                     .printed = "(6) with indices 1, 2, 3 for x, y, z",
                     .corrected = "as (6)",
                     .limit = kPositionLimit,
                     .unit = "m",
                     .note = "as (6)"});
  for (const Truth& t : c.truth) {
    const Vec3 printed = PrintedCentre(c.geometry.b, t.R, t.r.z());
    const Vec3 corrected = CentreOf(c.geometry, Tilt::FromEuler(t.psi, t.theta), t.r.z());
    for (int k = 0; k < 2; ++k) {
      centre.Add(t.r[k], printed[k], corrected[k]);
      repeated.Add(t.r[k], printed[k], corrected[k]);
    }
    const auto near_delta = [&](double angle) {
      return t.delta + std::remainder(angle - t.delta, 2 * pi);
    };
    torsion.Add(t.delta, near_delta(t.psi), near_delta(-t.psi));
    const auto misfit = [&](double delta) {
      const Mat3 R = PrintedRotation(t.psi, t.theta, delta);
      Eigen::Matrix<double, 3, 2> C;
      Vec3 rhs;
      for (int i = 0; i < 3; ++i) {
        const Vec3 c_i = R * c.geometry.c[i];
        C.row(i) = c_i.head<2>();
        rhs[i] = c_i.dot(c.geometry.b * c.geometry.f[i]) - c_i.z() * t.r.z();
      }
      const Vec3 gap = C * C.colPivHouseholderQr().solve(rhs) - rhs;
      return gap.lpNorm<Eigen::Infinity>();
    };
    const double size = c.geometry.b;
    impossible.Add(size, size + misfit(t.psi), size + misfit(-t.psi));
    const PerLeg<double> q_printed = PrintedSquares(c.geometry, t.r, t.R);
    const PerLeg<double> q_corrected = SquaredLengths(c.geometry, t.r, t.R);
    for (int i = 0; i < 3; ++i) {
      lengths.Add(t.leg[i].q, Root(q_printed[i]), Root(q_corrected[i]));
    }
  }
  for (RowMeter* meter : {&centre, &torsion, &impossible, &lengths, &repeated}) {
    rows->push_back(meter->Finish());
  }
}

// Where the printed (6), (7) come from: the same mechanism described in frames turned by +150 deg.
void TurnedFrameRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter centre({.equation = "(6) in a turned frame",
                   .printed = kPrinted6,
                   .limit = kPositionLimit,
                   .unit = "m",
                   .note = "holds as printed, with δ = −ψ, in base and platform frames turned by "
                           "+150 deg about z: joints at −30, 90, −150 deg"});
  RowMeter lengths({.equation = "(7) in a turned frame",
                    .printed = kPrinted7,
                    .limit = kPositionLimit,
                    .unit = "m",
                    .note = "as above"});
  const Mat3 R_FT = RotZ(-5 * pi / 6);  // turned frame F from the text's T
  for (const Truth& t : c.truth) {
    const Mat3 R = R_FT * t.R * R_FT.transpose();
    const Vec3 r = R_FT * t.r;
    const Vec3 printed = PrintedCentre(c.geometry.b, R, r.z());
    for (int k = 0; k < 2; ++k) centre.Add(r[k], printed[k]);
    const PerLeg<double> squares = PrintedSquares(c.geometry, r, R);
    for (int i = 0; i < 3; ++i) lengths.Add(t.leg[i].q, Root(squares[i]));
  }
  rows->push_back(centre.Finish());
  rows->push_back(lengths.Finish());
}

// Newton on G(ψ, θ, z0) = 0 with central differences; true when the lengths are met in time.
bool SolvesWithEulerAngles(const Geometry& g, const PerLeg<double>& q, double theta, int steps) {
  const double mean = (q[0] + q[1] + q[2]) / 3;
  Vec3 x(0.0, theta, std::sqrt(mean * mean - (g.b - g.a) * (g.b - g.a)));
  const auto residual = [&](const Vec3& at) {
    const Tilt tilt = Tilt::FromEuler(at[0], at[1]);
    const PerLeg<double> squares = SquaredLengths(g, CentreOf(g, tilt, at[2]), tilt.Rotation());
    return Vec3(squares[0] - q[0] * q[0], squares[1] - q[1] * q[1], squares[2] - q[2] * q[2]);
  };
  for (int k = 0; k < steps; ++k) {
    Mat3 J;
    for (int column = 0; column < 3; ++column) {
      const Vec3 h = 1e-6 * Vec3::Unit(column);
      J.col(column) = (residual(x + h) - residual(x - h)) / 2e-6;
    }
    x -= J.fullPivLu().solve(residual(x));
    if (!x.allFinite()) return false;
  }
  return residual(x).lpNorm<Eigen::Infinity>() < 1e-8;
}

// Forward problem: share of seeded leg triples that Newton solves.
void ForwardRows(const Case& c, std::vector<AuditRow>* rows) {
  constexpr int kTriples = 500, kSteps = 5;
  AuditRow row{.equation = "G(ψ, θ, z0) = 0",
               .printed = "Newton in (ψ, θ, z0), here from θ = 0.1",
               .corrected = "Newton in (tan(θ/2) cos ψ, tan(θ/2) sin ψ, z0) from θ = 0",
               .limit = 0.0,
               .unit = "1",
               .note =
                   "share of 500 leg triples of the stroke not solved within 5 steps; at "
                   "θ = 0 the printed unknowns are singular"};
  std::mt19937_64 random(2012);
  int euler = 0, tilt = 0;
  for (int k = 0; k < kTriples; ++k) {
    PerLeg<double> q;
    for (double& length : q) {
      // 53 random bits: the same triples on every machine.
      length = 0.5 + 0.25 * static_cast<double>(random() >> 11) * 0x1p-53;
    }
    euler += !SolvesWithEulerAngles(c.geometry, q, 0.1, kSteps);
    Posture p;
    int iterations = 0;
    tilt += !SolveForward(c.geometry, q, &p, &iterations).ok() || iterations > kSteps;
  }
  row.residual_printed = static_cast<double>(euler) / kTriples;
  row.residual_corrected = static_cast<double>(tilt) / kTriples;
  row.scale = 1.0;
  row.verdict = VerdictOf(row);
  rows->push_back(row);
}

AuditRow Remark(const char* equation, const char* printed, const char* corrected,
                const char* note) {
  return {.equation = equation,
          .printed = printed,
          .corrected = corrected,
          .unit = "",
          .verdict = AuditVerdict::kNotTestable,
          .note = note};
}

}  // namespace

std::vector<AuditRow> PositionRows(const Case& c) {
  std::vector<AuditRow> rows;
  GeometryRows(c, &rows);
  rows.push_back(Remark("(2) θ_i", "θ = 30°, 150°, 90°", "",
                        "θ_3 − φ_3 is +90°, the others are −90°: leg frame 3 is turned by 180° "
                        "about its leg; no constraint changes, only bodies without symmetry"));
  ClosedFormRows(c, &rows);
  TurnedFrameRows(c, &rows);
  rows.push_back(Remark("after (8)", "[φ θ z0]", "[ψ θ z0]", "a misprint"));
  ForwardRows(c, &rows);
  rows.push_back(Remark("after (10)", "O_A from (7)", "O_A from (10)",
                        "a wrong reference: (7) has lengths only"));
  return rows;
}

// Equations (11)–(20): velocities of platform, slides and legs.

namespace {

using namespace spr_tripod;

void AddVector(RowMeter* meter, const Vec3& truth, const Vec3& printed) {
  for (int k = 0; k < 3; ++k) meter->Add(truth[k], printed[k]);
}

RowMeter Rate(const char* equation, const char* printed, const char* unit, const char* note) {
  return RowMeter(
      {.equation = equation, .printed = printed, .limit = kRateLimit, .unit = unit, .note = note});
}

// (11)–(14).
void SlideRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter ball = Rate("(11)", "v_Bi = v_Ai + Ω × r_BiAi + v_rel = 0", "m/s",
                       "solved for v_Ai with the reference's Ω, q̇_i, w_i");
  RowMeter orientation = Rate("(12)", "ω = J_c v, J_c = −{[(r_i − q_i w_i) × c_i]ᵀ}⁻¹ c_iᵀ",
                              "rad/s", "r_i means a_i; against the reference's platform");
  RowMeter hinge = Rate("(13)", "v_Ai = v + ω × r_i", "m/s", "against the reference's rods");
  RowMeter letter({.equation = "(14) first form",
                   .printed = "q̇_i = v_Bi·w_i",
                   .corrected = "q̇_i = v_Ai·w_i",
                   .limit = kRateLimit,
                   .unit = "m/s",
                   .note = "v_Bi is zero; and J v is the vector of all q̇, not one q̇_i"});
  RowMeter matrix = Rate("(14) J", "J = [w_iᵀ] + [(r_i × w_i)ᵀ] J_c", "m/s",
                         "q̇ = J v against the reference's prismatic joints");
  for (size_t n = 0; n < c.truth.size(); ++n) {
    const Truth& t = c.truth[n];
    const Closed& k = c.closed[n];
    AddVector(&orientation, t.omega, k.j.J_c * t.v);
    const Vec3 q_dot = k.j.J * t.v;
    for (int i = 0; i < 3; ++i) {
      const LegTruth& leg = t.leg[i];
      AddVector(&ball, leg.v_A, leg.omega.cross(leg.q * leg.w) + leg.q_dot * leg.w);
      AddVector(&hinge, leg.v_A, t.v + t.omega.cross(k.p.a[i]));
      letter.Add(leg.q_dot, 0.0, leg.v_A.dot(k.p.w[i]));
      matrix.Add(leg.q_dot, q_dot[i]);
    }
  }
  for (RowMeter* meter : {&ball, &orientation, &hinge, &letter, &matrix}) {
    rows->push_back(meter->Finish());
  }
}

// (20) as printed: J_c behind the whole bracket.
Vec3 PrintedLegOmega(const Closed& k, int i, const Vec3& v) {
  const Vec3 &w = k.p.w[i], &a = k.p.a[i];
  const Mat3 bracket =
      Skew(w) + (w.dot(a) * Mat3::Identity() - a * w.transpose()) + k.p.q[i] * w * w.transpose();
  return bracket * k.j.J_c * v / k.p.q[i];
}

// (15)–(20).
void LegRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter across = Rate("(15)", "v_Ai = v_Bi + ω_i × r_AiBi + (v_Ai·w_i) w_i", "m/s",
                         "with the reference's ω_i");
  RowMeter swing = Rate("(16)", "ω_ixy = [w_i × v + (w_iᵀr_i) ω − r_i (w_iᵀω)]/q_i", "rad/s",
                        "against the part of the reference's ω_i across w_i");
  RowMeter tip = Rate("(17)", "v_Ci = v + ω × (r_i + c_i)", "m/s",
                      "against the point C_i of the reference's rods");
  RowMeter tip_leg = Rate("(18) second form", "v_Ci = v + ω × r_i + ω_i × c_i", "m/s",
                          "against the point C_i of the reference's platform");
  RowMeter spin = Rate("(19)", "ω_iz = (w_iᵀω) w_i", "rad/s",
                       "against the part of the reference's ω_i along w_i");
  RowMeter sum({.equation = "(20)",
                .printed = "J_di = (1/q_i)[[w_i×] + ((w_iᵀr_i) E − r_i w_iᵀ) + q_i w_i w_iᵀ] J_c",
                .corrected = "J_di = (1/q_i){[w_i×] + [(w_iᵀr_i) E − r_i w_iᵀ + q_i w_i w_iᵀ] J_c}",
                .limit = kRateLimit,
                .unit = "rad/s",
                .note = "a bracket: [w_i×] acts on v itself, J_c belongs to the terms with ω"});
  for (size_t n = 0; n < c.truth.size(); ++n) {
    const Truth& t = c.truth[n];
    const Closed& k = c.closed[n];
    for (int i = 0; i < 3; ++i) {
      const LegTruth& leg = t.leg[i];
      const Vec3 &w = k.p.w[i], &a = k.p.a[i], &c_i = k.p.c[i];
      const Vec3 along = leg.w.dot(leg.omega) * leg.w;
      AddVector(&across, leg.v_A, leg.omega.cross(leg.q * w) + leg.v_A.dot(w) * w);
      AddVector(&swing, leg.omega - along,
                (w.cross(t.v) + w.dot(a) * t.omega - a * w.dot(t.omega)) / k.p.q[i]);
      AddVector(&tip, leg.v_A + leg.omega.cross(leg.c), t.v + t.omega.cross(a + c_i));
      AddVector(&tip_leg, t.v + t.omega.cross(leg.A - t.r + leg.c),
                t.v + t.omega.cross(a) + k.v.omega_leg[i].cross(c_i));
      AddVector(&spin, along, w.dot(t.omega) * w);
      const Vec3 printed = PrintedLegOmega(k, i, t.v);
      const Vec3 corrected = LegJacobian(k.p, k.j, i) * t.v;
      for (int m = 0; m < 3; ++m) sum.Add(leg.omega[m], printed[m], corrected[m]);
    }
  }
  rows->push_back(across.Finish());
  rows->push_back(swing.Finish());
  rows->push_back(tip.Finish());
  rows->push_back(
      {.equation = "(18) first form",
       .printed = "v_Ci = v_Ai + ω_Ai × r_CiAi",
       .corrected = "v_Ci = v_Ai + ω_i × r_CiAi",
       .unit = "",
       .verdict = AuditVerdict::kNotTestable,
       .note = "a misprint: a point has no angular velocity; its second form is right"});
  rows->push_back(tip_leg.Finish());
  rows->push_back(spin.Finish());
  rows->push_back(sum.Finish());
}

}  // namespace

std::vector<AuditRow> VelocityRows(const Case& c) {
  std::vector<AuditRow> rows;
  SlideRows(c, &rows);
  LegRows(c, &rows);
  return rows;
}

// The extension to accelerations and forces, against the same reference.
std::vector<AuditRow> DynamicsRows(const Case& c) {
  const auto row = [](const char* equation, const char* form, double limit, const char* unit) {
    return RowMeter({.equation = equation,
                     .printed = form,
                     .limit = limit,
                     .unit = unit,
                     .note = "not in the paper; against the reference"});
  };
  RowMeter omega_dot = row("(D1)", "ω̇ by differentiating (12)", kAccelerationLimit, "rad/s²");
  RowMeter q_ddot =
      row("(D3)", "q̈_i = a_Ai·w_i + |v_Ai − q̇_i w_i|²/q_i", kAccelerationLimit, "m/s²");
  RowMeter leg_dot =
      row("(D6)", "ω̇_i = [w_i × a_Ai − 2q̇_i ω_ixy]/q_i + d/dt ω_iz", kAccelerationLimit, "rad/s²");
  RowMeter force = row("(D9)", "f = J⁻ᵀ Σ (VᵀF + WᵀN)", kForceLimit, "N");
  RowMeter reaction =
      row("(D11)", "S_i from the balances of force, moment and each leg's revolute joint",
          kForceLimit, "N");
  RowMeter second = row("(D12)", "f_i = (S_i − F_cyl,i)·w_i", kForceLimit, "N");
  for (size_t n = 0; n < c.truth.size(); ++n) {
    const Truth& t = c.truth[n];
    const Closed& k = c.closed[n];
    AddVector(&omega_dot, t.omega_dot, k.a.omega_dot);
    for (int i = 0; i < 3; ++i) {
      q_ddot.Add(t.leg[i].q_ddot, k.a.q_ddot[i]);
      AddVector(&leg_dot, t.leg[i].omega_dot, k.a.omega_leg_dot[i]);
      force.Add(t.leg[i].f, k.f.f[i]);
      AddVector(&reaction, t.leg[i].S, k.f.S[i]);
      second.Add(t.leg[i].f, k.f.f_check[i]);
    }
  }
  std::vector<AuditRow> rows;
  for (RowMeter* meter : {&omega_dot, &q_ddot, &leg_dot, &force, &reaction, &second}) {
    rows.push_back(meter->Finish());
  }
  return rows;
}

// Equations (21), (22), the data of Table 1 and the workspace of section 3.

namespace {

using namespace spr_tripod;

constexpr double kPrintedConstant = 5.7735;
constexpr double kAMax = 10.0;  // m/s²

// S(t) of (21) and its derivatives at ρ for duration T.
Jet PrintedLaw(double rho, double T) {
  const double k = kAMax * T * T / kPrintedConstant;
  return {k * rho * rho * rho * (10 - 15 * rho + 6 * rho * rho),
          k / T * 30 * rho * rho * (1 - rho) * (1 - rho),
          k / (T * T) * 60 * rho * (1 - rho) * (1 - 2 * rho)};
}

void LawRows(std::vector<AuditRow>* rows) {
  RowMeter law({.equation = "(21)",
                .printed = "S = a_max T²/5.7735 (10ρ³ − 15ρ⁴ + 6ρ⁵)",
                .limit = kAMax * 5e-5 / kPrintedConstant,
                .unit = "m/s²",
                .note = "peak acceleration against a_max = 10; 5.7735 is 10/√3 rounded, the limit "
                        "is half its last digit"});
  // Peak of the second derivative at ρ = (3 − √3)/6.
  law.Add(kAMax, PrintedLaw((3 - std::sqrt(3.0)) / 6, 0.3).acceleration);
  RowMeter speed({.equation = "(22)",
                  .printed = "v_max = a_max T/5.7735 (30ρ² − 60ρ³ + 30ρ⁴), ρ = 1/2",
                  .limit = 1e-9,
                  .unit = "m/s",
                  .note = "against differences of (21) over 1e-5 s; the peak speed, at ρ = 1/2, is "
                          "1.875 S/T"});
  const double T = 0.3, h = 1e-5;
  for (double rho : {0.2, 0.5, 0.8}) {
    const double difference =
        (8 * (PrintedLaw(rho + h / T, T).value - PrintedLaw(rho - h / T, T).value) -
         (PrintedLaw(rho + 2 * h / T, T).value - PrintedLaw(rho - 2 * h / T, T).value)) /
        (12 * h);
    const double r2 = rho * rho;
    speed.Add(difference, kAMax * T / kPrintedConstant * (30 * r2 - 60 * r2 * rho + 30 * r2 * r2));
  }
  rows->push_back(law.Finish());
  rows->push_back(speed.Finish());
}

// By how much the path P1 P2 P3 P4 with half width R and height h leaves the stroke, at its best
// start height.
double StrokeViolation(const Geometry& g, double R, double h) {
  double best = std::numeric_limits<double>::infinity();
  for (double z_c = 0.40; z_c < 0.701; z_c += 0.01) {
    double worst = 0.0;
    for (int k = 0; k <= 40; ++k) {
      for (double z : {z_c - 0.5 * h, z_c + 0.5 * h}) {
        if (z < z_c && k != 0 && k != 40) continue;  // the lower side is not on the path
        Posture p;
        if (!SolveInverse(g, {R * (k - 20) / 20.0, 0, z}, &p).ok()) {
          worst = std::numeric_limits<double>::infinity();
          continue;
        }
        for (double q : p.q) worst = std::max({worst, q - g.q_max, g.q_min - q});
      }
    }
    best = std::min(best, worst);
  }
  return best;
}

void ExampleRows(const Case& c, std::vector<AuditRow>* rows) {
  AuditRow path{.equation = "Table 1, R and h",
                .printed = "R = 0.400, h = 0.200",
                .corrected = "both scaled by 0.3: R = 0.120, h = 0.060",
                .residual_printed = StrokeViolation(c.geometry, 0.4, 0.2),
                .residual_corrected = StrokeViolation(c.geometry, 0.12, 0.06),
                .scale = c.geometry.q_max - c.geometry.q_min,
                .limit = 0.0,
                .unit = "m",
                .note =
                    "by how much the path leaves the stroke 0.5 … 0.75 m at its best height "
                    "(gamma = 0; heights in steps of 10 mm); the workspace is 0.45 m wide"};
  path.verdict = VerdictOf(path);
  rows->push_back(path);
  rows->push_back(
      {.equation = "section 4, v_max",
       .printed = "0.75 m/min",
       .corrected = "0.75 m/s",
       .unit = "",
       .verdict = AuditVerdict::kNotTestable,
       .note = "at 0.0125 m/s the ramp to full speed takes 3.8 ms over 26 µm and the printed path "
               "96.0 s, so that a_max = 10 m/s² means nothing; at 0.75 m/s it takes 1.92 s"});
}

void WorkspaceRow(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter volume({.equation = "section 3, W1 … W6",
                   .printed = "six faces, one leg at q_min or q_max, bound the workspace",
                   .limit = 1e-12,
                   .unit = "m³",
                   .note = "volume inside the faces against ∫ dq/det J over the stroke, which "
                           "shares no boundary with it; det J > 0 throughout"});
  volume.Add(VolumeByInterior(c.geometry, 10), IntegrateFaces(c.geometry, 12).solid.volume);
  rows->push_back(volume.Finish());
}

}  // namespace

std::vector<AuditRow> PathRows(const Case& c) {
  std::vector<AuditRow> rows;
  WorkspaceRow(c, &rows);
  LawRows(&rows);
  ExampleRows(c, &rows);
  return rows;
}

}  // namespace mbv::spr_tripod_audit
