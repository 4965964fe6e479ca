// Equations (1)–(10): position.
#include <cmath>
#include <numbers>
#include <random>

#include "audit/row_meter.h"
#include "audit/spr_tripod_audit.h"
#include "core/spatial.h"

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
  RowMeter length = row("(4)", "q_i² = |A_i − B_i|²", "lengths q_i against the reference's slides");
  RowMeter vector = row("(5)", "q_i w_i = A_i − B_i", "against the reference's slide axes");
  RowMeter direction({.equation = "(8)",
                      .printed = "w_i = (r + a_i − b_i)/q_i",
                      .limit = kPositionLimit,
                      .unit = "1",
                      .note = "against the reference's slide axes"});
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

}  // namespace mbv::spr_tripod_audit
