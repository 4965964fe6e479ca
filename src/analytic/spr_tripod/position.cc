#include "analytic/spr_tripod/position.h"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>
#include <numbers>

namespace mbv::spr_tripod {
namespace {

using std::numbers::pi;

constexpr PerLeg<double> kPhi = {2 * pi / 3, -2 * pi / 3, 0.0};
constexpr PerLeg<double> kTheta = {pi / 6, 5 * pi / 6, pi / 2};

// Azimuths are typed as fractions of π; anything beyond rounding is another mechanism.
constexpr double kAngleTolerance = 1e-9;

// Value of a parameter; a missing one is an error, or `fallback` where one is given.
double Read(const Mechanism& mechanism, const std::string& name, Diagnostics* diagnostics,
            double fallback = kNan) {
  if (mechanism.HasParameter(name)) return mechanism.ParameterValue(name);
  if (std::isnan(fallback)) {
    diagnostics->AddError("", mechanism.name + " has no parameter '" + name + "'",
                          "the closed form reads its constants from the model's parameters");
  }
  return fallback;
}

Inertia ReadInertia(const Mechanism& mechanism, const std::string& body, Diagnostics* diagnostics) {
  const auto read = [&](const std::string& name, double fallback = kNan) {
    return Read(mechanism, name, diagnostics, fallback);
  };
  Inertia inertia;
  inertia.mass = read("m_" + body);
  for (int k = 0; k < 3; ++k) inertia.com[k] = read("c_" + body + "_" + "xyz"[k]);
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      const std::string name = fmt::format("I_{}_{}{}", body, "xyz"[i], "xyz"[j]);
      inertia.I(i, j) = inertia.I(j, i) = read(name, i == j ? kNan : 0.0);
    }
  }
  return inertia;
}

Vec3 Direction(double azimuth) { return {std::cos(azimuth), std::sin(azimuth), 0.0}; }

}  // namespace

Geometry PaperGeometry(double a, double b) {
  Geometry g{.a = a, .b = b};
  for (int i = 0; i < 3; ++i) {
    g.f[i] = Direction(kPhi[i]);
    g.c[i] = Direction(kTheta[i]);
  }
  return g;
}

Geometry ReadGeometry(const Mechanism& mechanism, Diagnostics* diagnostics) {
  Geometry g = PaperGeometry(Read(mechanism, "a", diagnostics), Read(mechanism, "b", diagnostics));
  g.q_min = Read(mechanism, "q_min", diagnostics);
  g.q_max = Read(mechanism, "q_max", diagnostics);
  for (const auto& [name, length] : {std::pair{"a", g.a}, std::pair{"b", g.b}}) {
    if (length <= 0.0) {
      diagnostics->AddError("", fmt::format("{} = {} violates {} > 0", name, length, name),
                            "it is the radius of a circle of joint centres");
    }
  }
  for (int i = 0; i < 3; ++i) {
    const double phi = Read(mechanism, fmt::format("phi_{}", i + 1), diagnostics);
    const double theta = Read(mechanism, fmt::format("theta_{}", i + 1), diagnostics);
    if (!(std::abs(std::remainder(phi - kPhi[i], 2 * pi)) < kAngleTolerance)) {
      diagnostics->AddError(
          "", fmt::format("phi_{} = {} rad is not the paper's {}", i + 1, phi, kPhi[i]),
          "the closed form holds for joints at 120, -120 and 0 deg only; use analytic: none");
    }
    if (!(std::abs(std::cos(theta - kPhi[i])) < kAngleTolerance)) {
      diagnostics->AddError(
          "", fmt::format("theta_{} = {} rad is not tangential (phi ± pi/2)", i + 1, theta),
          "the closed form holds for revolute axes perpendicular to O_A A_i; use analytic: none");
    }
    g.c[i] = Direction(theta);
  }
  return g;
}

Masses ReadMasses(const Mechanism& mechanism, Diagnostics* diagnostics) {
  return {.platform = ReadInertia(mechanism, "platform", diagnostics),
          .cylinder = ReadInertia(mechanism, "cyl", diagnostics),
          .rod = ReadInertia(mechanism, "rod", diagnostics),
          .gravity = mechanism.gravity_W};
}

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr int kMaxIterations = 25;
// Newton converges quadratically: after a step this small the next would be below rounding.
constexpr double kLastStep = 1e-9;

// (6c') E1, E2 [m] at (X, Y) and their Jacobian with respect to X and Y.
struct Conics {
  Vector2d E;
  Matrix2d J;
};

Conics Evaluate(double b, const Vec3& r, const Tilt& t) {
  const double X = t.X, Y = t.Y, x = r.x(), y = r.y(), z = r.z();
  const double diff = X * X - Y * Y, prod = 2 * X * Y;
  Conics k;
  k.E << (x + b) * diff + x + prod * y - 2 * Y * z, prod * (x - b) + (1 - diff) * y + 2 * X * z;
  k.J << 2 * (X * (x + b) + Y * y), 2 * (X * y - Y * (x + b) - z),  //
      2 * (Y * (x - b) - X * y + z), 2 * (X * (x - b) + Y * y);
  return k;
}

// `missing`: by how much r.z is too small, where that is the reason [m].
RunSummary Unreachable(const Vec3& r, const std::string& why, double missing = kNan) {
  return {.stop = Stop::kUnreachable,
          .message = fmt::format("O_A = ({:.6g}, {:.6g}, {:.6g}) m {}", r.x(), r.y(), r.z(), why),
          .where = "platform",
          .amount = missing,
          .unit = "m"};
}

// Newton on (6c') from `tilt`; false if it does not settle.
bool SettleTilt(double b, const Vec3& r, Tilt* tilt) {
  for (int i = 0; i < kMaxIterations; ++i) {
    const Conics k = Evaluate(b, r, *tilt);
    const double det = k.J(0, 0) * k.J(1, 1) - k.J(0, 1) * k.J(1, 0);
    const double dX = (k.J(1, 1) * k.E[0] - k.J(0, 1) * k.E[1]) / det;
    const double dY = (k.J(0, 0) * k.E[1] - k.J(1, 0) * k.E[0]) / det;
    if (!std::isfinite(dX) || !std::isfinite(dY)) return false;
    tilt->X -= dX;
    tilt->Y -= dY;
    if (std::abs(dX) + std::abs(dY) < kLastStep) return true;
  }
  return false;
}

// Complex roots of Σ coefficients[k] ζ^k, leading zeros dropped (companion matrix).
Eigen::VectorXcd Roots(std::vector<std::complex<double>> coefficients) {
  double scale = 0.0;
  for (const auto& c : coefficients) scale = std::max(scale, std::abs(c));
  while (coefficients.size() > 1 && std::abs(coefficients.back()) < 1e-13 * scale) {
    coefficients.pop_back();
  }
  const auto n = static_cast<Eigen::Index>(coefficients.size()) - 1;
  if (n < 1) return {};
  Eigen::MatrixXcd companion = Eigen::MatrixXcd::Zero(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    companion(k, n - 1) = -coefficients[k] / coefficients[n];
    if (k > 0) companion(k, k - 1) = 1.0;
  }
  return Eigen::ComplexEigenSolver<Eigen::MatrixXcd>(companion, false).eigenvalues();
}

// Newton step in (X, Y, z0) for the forward problem: residuals (|B_iA_i|² − q_i²)/2.
Vec3 ForwardStep(const Geometry& geometry, const PerLeg<double>& q, const Posture& p) {
  // dr/d(X, Y, z0) by differentiating (6c').
  const double X = p.tilt.X, Y = p.tilt.Y, diff = X * X - Y * Y, prod = 2 * X * Y;
  Matrix2d E_xy;
  E_xy << 1 + diff, prod, prod, 1 - diff;
  Eigen::Matrix<double, 2, 3> E_t;
  E_t << Evaluate(geometry.b, p.r, p.tilt).J, Vector2d(-2 * Y, 2 * X);
  Mat3 dr;
  dr << -E_xy.inverse() * E_t, 0, 0, 1;
  // ω of the torsion-free rotation: (2/D) (Ẋ, Ẏ, XẎ − YẊ).
  const double s = 2.0 / (1 + X * X + Y * Y);
  Mat3 omega;
  omega << s, 0, 0, 0, s, 0, s * -Y, s * X, 0;
  // Half the rate of |B_iA_i|² is q_i w_i·(ṙ + ω × a_i).
  Mat3 J;
  Vec3 residual;
  for (int i = 0; i < 3; ++i) {
    const Vec3 leg = p.q[i] * p.w[i];
    J.row(i) = leg.transpose() * dr + p.a[i].cross(leg).transpose() * omega;
    residual[i] = 0.5 * (p.q[i] * p.q[i] - q[i] * q[i]);
  }
  return J.inverse() * residual;
}

}  // namespace

Mat3 Tilt::Rotation() const {
  const double XX = X * X, YY = Y * Y;
  const double s = 1.0 / (1.0 + XX + YY);
  const double k = 2.0 * s;
  Mat3 R;
  R << s * (1 + XX - YY), k * X * Y, k * Y,  //
      k * X * Y, s * (1 - XX + YY), -k * X,  //
      -k * Y, k * X, s * (1 - XX - YY);
  return R;
}

double Tilt::Angle() const { return 2.0 * std::atan(std::hypot(X, Y)); }
double Tilt::Azimuth() const { return std::atan2(Y, X); }

Tilt Tilt::FromEuler(double psi, double theta) {
  const double t = std::tan(0.5 * theta);
  return {t * std::cos(psi), t * std::sin(psi)};
}

Vec3 CentreOf(const Geometry& geometry, const Tilt& tilt, double z0) {
  const Mat3 R = tilt.Rotation();
  const double u_x = R(0, 0), u_y = R(1, 0), v_x = R(0, 1), v_y = R(1, 1);
  const double b = geometry.b;
  // (6c)
  return {(b * (v_y * (v_y - u_x) - 2 * u_y * v_x) + 2 * z0 * R(0, 2)) / (2 * R(2, 2)),
          (b * v_x * (3 * u_x - v_y) + 2 * z0 * R(1, 2)) / (2 * R(2, 2)), z0};
}

PerLeg<double> SquaredLengths(const Geometry& geometry, const Vec3& r, const Mat3& R) {
  const double a = geometry.a, b = geometry.b;
  const double s = a * a + b * b + r.squaredNorm();
  const double u_x = R(0, 0), v_x = R(0, 1), v_y = R(1, 1);
  const double root3 = std::sqrt(3.0);
  // (7c)
  return {s + b * r.x() - root3 * b * r.y() - 2 * a * b * v_y + 2 * root3 * a * b * v_x,
          s + b * r.x() + root3 * b * r.y() - 2 * a * b * v_y - 2 * root3 * a * b * v_x,
          s - 2 * b * r.x() - 3 * a * b * u_x + a * b * v_y};
}

void FillPosture(const Geometry& geometry, const Vec3& r, const Tilt& tilt, Posture* posture) {
  Posture& p = *posture;
  p.r = r;
  p.tilt = tilt;
  p.R = tilt.Rotation();
  for (int i = 0; i < 3; ++i) {
    p.a[i] = geometry.a * (p.R * geometry.f[i]);
    p.b[i] = geometry.b * geometry.f[i];
    p.c[i] = p.R * geometry.c[i];
    p.d[i] = p.b[i] - r;
    const Vec3 leg = p.a[i] - p.d[i];  // (5)
    p.q[i] = leg.norm();               // (4), (9)
    p.w[i] = leg / p.q[i];             // (8)
  }
}

RunSummary SolveInverse(const Geometry& geometry, const Vec3& r, Posture* posture) {
  const double missing = 0.5 * geometry.b - r.z();
  if (!(missing < 0.0)) {
    return Unreachable(r,
                       fmt::format("lies nearer to the base than z = b/2 = {:.6g} m, where several "
                                   "upright assemblies share a position",
                                   0.5 * geometry.b),
                       missing);
  }
  // Start: the tilt that turns w into the direction of r.
  const double rho = std::hypot(r.x(), r.y());
  const double k = rho > 0.0 ? std::tan(0.5 * std::atan2(rho, r.z())) / rho : 0.5 / r.z();
  Tilt tilt{-r.y() * k, r.x() * k};
  if (!SettleTilt(geometry.b, r, &tilt)) {
    return Unreachable(r, "is reached by no assembly near the untilted one");
  }
  if (!(tilt.X * tilt.X + tilt.Y * tilt.Y < 1.0)) {
    return Unreachable(r, "is reached by overturned platforms only");
  }
  FillPosture(geometry, r, tilt, posture);
  return RunSummary::Done();
}

RunSummary SolveForward(const Geometry& geometry, const PerLeg<double>& q, Posture* posture,
                        int* iterations) {
  // Start: the untilted pose with the mean leg length.
  const double mean = (q[0] + q[1] + q[2]) / 3.0, offset = geometry.b - geometry.a;
  Vec3 unknown(0, 0, std::sqrt(std::max(mean * mean - offset * offset, 0.0)));
  for (int i = 0; i < kMaxIterations; ++i) {
    const Tilt tilt{unknown[0], unknown[1]};
    FillPosture(geometry, CentreOf(geometry, tilt, unknown[2]), tilt, posture);
    const Vec3 step = ForwardStep(geometry, q, *posture);
    if (!step.allFinite()) break;
    unknown -= step;
    if (iterations != nullptr) *iterations = i + 1;
    if (step.head<2>().lpNorm<1>() + std::abs(step[2]) / geometry.b > kLastStep) continue;
    const Tilt settled{unknown[0], unknown[1]};
    FillPosture(geometry, CentreOf(geometry, settled, unknown[2]), settled, posture);
    if (settled.X * settled.X + settled.Y * settled.Y < 1.0 && unknown[2] > 0.0) {
      return RunSummary::Done();
    }
    break;
  }
  return {.stop = Stop::kUnreachable,
          .message = fmt::format("leg lengths ({:.6g}, {:.6g}, {:.6g}) m have no upright assembly",
                                 q[0], q[1], q[2]),
          .where = "platform"};
}

std::vector<Assembly> AllAssemblies(const Geometry& geometry, const Vec3& r) {
  using C = std::complex<double>;
  // With ζ = X + iY the conics are one complex equation Δ ζ² = A + B ζ + G ζ̄; eliminating ζ̄ by its
  // conjugate leaves a quartic in ζ.
  const double b = geometry.b, x = r.x(), y = r.y(), z = r.z();
  const double delta = x * x + y * y - b * b;
  const C A(-x * (x - b) + y * y, -(x + b) * y - x * y);
  const C B(2 * z * y, -2 * z * x);
  const C G(0.0, -2 * b * z);
  // Δ (Δζ² − Bζ − A)² − G Ā G − G B̄ (Δζ² − Bζ − A) − G |G|² ζ = 0
  const C gb = G * std::conj(B);
  const std::vector<C> quartic = {delta * A * A - G * G * std::conj(A) + gb * A,
                                  2.0 * delta * A * B + gb * B - G * std::norm(G),
                                  delta * (B * B - 2.0 * delta * A) - gb * delta,
                                  -2.0 * delta * delta * B, C(delta * delta * delta)};
  std::vector<Assembly> assemblies;
  const Eigen::VectorXcd roots = Roots(quartic);
  for (const C& zeta : roots) {
    // A root is real geometry when ζ̄ from the equation is the conjugate of ζ.
    const C conjugate = (delta * zeta * zeta - A - B * zeta) / G;
    if (std::abs(conjugate - std::conj(zeta)) > 1e-6 * (1.0 + std::abs(zeta))) continue;
    Tilt tilt{zeta.real(), zeta.imag()};
    SettleTilt(b, r, &tilt);
    const Mat3 R = tilt.Rotation();
    for (const bool turned : {false, true}) {
      Mat3 R_turned = R;
      if (turned) R_turned.leftCols<2>() *= -1.0;
      assemblies.push_back({R_turned, tilt, turned, R(2, 2) > 0.0});
    }
  }
  return assemblies;
}

}  // namespace mbv::spr_tripod
