#include "analytic/scara_robot/position.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "analytic/scara_robot/velocity.h"

namespace mbv::scara_robot {
namespace {

// Shifts in arm lengths l1.
constexpr double kMaxNewtonShift = 0.10, kMaxNewtonTurn = 10.0 * std::numbers::pi / 180.0;
constexpr double kMaxStepShift = 0.15, kMaxStepTurn = 15.0 * std::numbers::pi / 180.0;
constexpr int kMaxNewton = 40;
constexpr double kSmallestFraction = 1e-5;  // of a commanded step of the drives

/// A_i → D_i (i = 1, 2: B_i is e below D_i) or A_i → B_i. [Zhu 2019, Eqs. 5, 6]
Vec3 MotorToRodEnd(const Parameters& parameters, const Vec4& X, const Vec3& s, int limb) {
  Vec3 q = X.head<3>() + s - parameters.R * Radial(limb);
  q.z() += parameters.drop(limb);
  return q;
}

/// s_i and k_i. [Zhu 2019, Eq. 1]
void FillPlatform(const Parameters& parameters, double phi, Position* position) {
  const double c = parameters.r * std::cos(phi), s = parameters.r * std::sin(phi);
  for (int i = 0; i < kLimbs; ++i) {
    const Vec3& rho = Radial(i);
    const Vec3& a = MotorAxis(i);
    position->s[i] = c * rho + s * a;
    position->k[i] = c * a - s * rho;
  }
}

/// u_i and n_i. [Zhu 2019, Eq. 4]
void FillArm(double theta, int limb, Position* position) {
  const double c = std::cos(theta), s = std::sin(theta);
  position->theta[limb] = theta;
  position->u[limb] = c * Radial(limb) - s * Vec3::UnitZ();
  position->n[limb] = -s * Radial(limb) - c * Vec3::UnitZ();
}

RunSummary Unreachable(int limb, double missing_m, const Vec4& X) {
  RunSummary summary;
  summary.stop = Stop::kUnreachable;
  summary.where = LimbName(limb);
  summary.amount = missing_m;
  summary.unit = "m";
  summary.message = fmt::format(
      "limb {} misses the pose ({:.3f}, {:.3f}, {:.3f}) mm, {:.3f} deg by {:.3g} mm", limb + 1,
      1e3 * X[0], 1e3 * X[1], 1e3 * X[2], X[3] * 180.0 / std::numbers::pi, 1e3 * missing_m);
  return summary;
}

}  // namespace

const Vec3& Radial(int limb) {
  static const std::array<Vec3, kLimbs> rho = {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(-1, 0, 0),
                                               Vec3(0, -1, 0)};
  return rho[limb];
}

const Vec3& MotorAxis(int limb) { return Radial((limb + 1) % kLimbs); }

const char* LimbName(int limb) {
  static constexpr std::array<const char*, kLimbs> names = {"limb1", "limb2", "limb3", "limb4"};
  return names[limb];
}

Parameters ParametersOf(const Mechanism& mechanism) {
  const auto value = [&](const char* name) { return mechanism.ParameterValue(name); };
  Parameters p;
  p.R = value("R");
  p.r = value("r");
  p.l1 = value("l1");
  p.l2 = value("l2");
  p.l3 = value("l3");
  p.e = value("e");
  p.m_p = value("m_p");
  p.I_pz = value("I_p_z");
  p.m_arm = value("m_arm");
  p.arm_radius = value("arm_radius");
  p.arm_com = value("arm_com");
  p.m_rods = value("m_rods");
  p.rod_radius = value("rod_radius");
  if (mechanism.HasParameter("pivot_mass")) p.pivot_mass = value("pivot_mass");
  p.branch = value("branch") < 0.0 ? -1.0 : 1.0;
  p.gravity_W = mechanism.gravity_W;
  p.home_X << value("home_x"), value("home_y"), value("home_z"), value("home_phi");
  return p;
}

void FillPosition(const Parameters& parameters, const Vec4& X, const Vec4& theta,
                  Position* position) {
  position->X = X;
  FillPlatform(parameters, X[3], position);
  for (int i = 0; i < kLimbs; ++i) {
    FillArm(theta[i], i, position);
    const Vec3 w = MotorToRodEnd(parameters, X, position->s[i], i) - parameters.l1 * position->u[i];
    position->eta[i] = w / w.norm();
    position->V[i] = position->eta[i].dot(position->n[i]);
  }
}

RunSummary InversePosition(const Parameters& parameters, const Vec4& X, Position* position) {
  position->X = X;
  FillPlatform(parameters, X[3], position);
  for (int i = 0; i < kLimbs; ++i) {
    const Vec3 q = MotorToRodEnd(parameters, X, position->s[i], i);
    const double q_r = q.dot(Radial(i)), q_t = q.dot(MotorAxis(i)), q_z = q.z();
    const double l1 = parameters.l1, L = parameters.rod_length(i);

    // In the arm's plane: a triangle of l1, the rod's projection and D.
    if (std::abs(q_t) > L) return Unreachable(i, std::abs(q_t) - L, X);
    const double D = std::hypot(q_r, q_z);
    const double projection = std::sqrt((L - q_t) * (L + q_t));
    if (D > l1 + projection) return Unreachable(i, D - l1 - projection, X);
    if (D < std::abs(l1 - projection)) return Unreachable(i, std::abs(l1 - projection) - D, X);

    // The angle at A_i between D and the arm, by its half-angle (accurate near the dead point).
    const double half_sum = (l1 + D + projection) / 2.0;
    const double far = std::sqrt(std::max(0.0, (half_sum - l1) * (half_sum - D)));
    const double near = std::sqrt(std::max(0.0, half_sum * (half_sum - projection)));
    const double at_motor = 2.0 * std::atan2(far, near);
    double theta = std::atan2(-q_z, q_r) - parameters.branch * at_motor;
    if (theta <= -std::numbers::pi) theta += 2.0 * std::numbers::pi;
    if (theta > std::numbers::pi) theta -= 2.0 * std::numbers::pi;

    FillArm(theta, i, position);
    position->eta[i] = (q - l1 * position->u[i]) / L;
    position->V[i] = position->eta[i].dot(position->n[i]);
  }
  return RunSummary::Done();
}

RunSummary SolveForwardPosition(const Parameters& parameters, const Vec4& theta,
                                const Vec4& X_start, Position* position) {
  Vec4 X = X_start;
  bool last_round = false;
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    FillPosition(parameters, X, theta, position);
    if (last_round) return RunSummary::Done();

    // Rod length errors, to first order η·(δp + k δφ).
    Vec4 residual_m;
    for (int i = 0; i < kLimbs; ++i) {
      const Vec3 w =
          MotorToRodEnd(parameters, X, position->s[i], i) - parameters.l1 * position->u[i];
      residual_m[i] = w.dot(position->eta[i]) - parameters.rod_length(i);
    }
    Vec4 step = -DirectJacobian(*position).partialPivLu().solve(residual_m);
    if (!step.allFinite()) break;
    const double excess = std::max(step.head<3>().norm() / (kMaxNewtonShift * parameters.l1),
                                   std::abs(step[3]) / kMaxNewtonTurn);
    if (excess > 1.0) step /= excess;
    X += step;
    // Newton is quadratic: the round after a step of 1e-9 is at round-off.
    last_round = step.head<3>().norm() < 1e-9 * parameters.l1 && std::abs(step[3]) < 1e-9;
  }
  RunSummary summary;
  summary.stop = Stop::kNoConvergence;
  summary.message = "forward position did not converge";
  return summary;
}

double RodShear(const Position& position, int limb) {
  return std::asin(std::clamp(position.eta[limb].dot(MotorAxis(limb)), -1.0, 1.0));
}

double RodTilt(const Position& position, int limb) {
  return std::atan2(-position.eta[limb].z(), position.eta[limb].dot(Radial(limb)));
}

bool ForwardTracker::TryStep(const Vec4& theta, Position* position) const {
  if (!SolveForwardPosition(parameters_, theta, last_.X, position).ok()) return false;
  const Vec4 moved = position->X - last_.X;
  return moved.head<3>().norm() < kMaxStepShift * parameters_.l1 &&
         std::abs(moved[3]) < kMaxStepTurn && (parameters_.branch * position->V).minCoeff() > 0.0 &&
         DirectJacobian(*position).determinant() * DirectJacobian(last_).determinant() > 0.0;
}

RunSummary ForwardTracker::Stuck(const Vec4& theta, const Position& tried) const {
  const double s_min = Measure(parameters_, last_).s_min;
  int limb = 0;
  const double V_min = (parameters_.branch * last_.V).minCoeff(&limb);
  RunSummary summary;
  summary.stop =
      s_min < kNearlySingular || V_min < kNearlySingular ? Stop::kSingular : Stop::kUnreachable;
  const bool dead_point = V_min < s_min && (parameters_.branch * tried.V).minCoeff() <= 0.0;
  if (!dead_point) (theta - last_.theta).cwiseAbs().maxCoeff(&limb);
  summary.where = LimbName(limb);
  summary.amount = dead_point ? V_min : s_min;
  summary.unit = "1";
  summary.message = fmt::format(
      "the drives cannot be followed beyond the pose ({:.3f}, {:.3f}, {:.3f}) mm, {:.3f} deg: {}",
      1e3 * last_.X[0], 1e3 * last_.X[1], 1e3 * last_.X[2], last_.X[3] * 180.0 / std::numbers::pi,
      dead_point ? fmt::format("limb {} reaches its dead point, V = {:.3g}", limb + 1, V_min)
                 : fmt::format("the direct Jacobian has s_min = {:.3g} there", s_min));
  return summary;
}

RunSummary ForwardTracker::Follow(const Vec4& theta, Position* position) {
  if (!started_) {
    if (RunSummary home = InversePosition(parameters_, parameters_.home_X, &last_); !home.ok()) {
      return home;
    }
    started_ = true;
  }
  const Vec4 theta_start = last_.theta;
  double done = 0.0, fraction = 1.0;
  while (done < 1.0) {
    const double next = std::min(1.0, done + fraction);
    if (TryStep(next >= 1.0 ? theta : Vec4(theta_start + next * (theta - theta_start)), position)) {
      last_ = *position;
      done = next;
      fraction *= 2.0;
    } else {
      fraction /= 2.0;
      if (fraction < kSmallestFraction) return Stuck(theta, *position);
    }
  }
  return RunSummary::Done();
}

DofCount CountDofs() {
  // Each limb gives three translations and rotations in the span of its columns: limbs 1, 2 about
  // a_i and z (five DOFs), limbs 3, 4 about everything (six, the idle spin of the rod dropped).
  const auto rank = [](const MatX& directions) {
    return directions.cols() == 0 ? 0 : static_cast<int>(directions.fullPivLu().rank());
  };
  const auto intersection = [](const MatX& A, const MatX& B) -> MatX {
    // A x = B y; the columns A x span the intersection.
    MatX AB(3, A.cols() + B.cols());
    AB << A, -B;
    const Eigen::FullPivLU<MatX> lu(AB);
    if (lu.dimensionOfKernel() == 0) return MatX(3, 0);
    return (A * lu.kernel().topRows(A.cols())).eval();
  };
  std::array<MatX, kLimbs> rotations;
  DofCount count;
  for (int i = 0; i < kLimbs; ++i) {
    if (i < 2) {
      rotations[i].resize(3, 2);
      rotations[i] << MotorAxis(i), Vec3::UnitZ();
    } else {
      rotations[i] = Mat3::Identity();
    }
    count.limb_dofs[i] = 3 + rank(rotations[i]);
    count.dofs += count.limb_dofs[i];
  }
  MatX platform = rotations[0];
  for (int i = 1; i < kLimbs; ++i) {
    MatX both(3, platform.cols() + rotations[i].cols());
    both << platform, rotations[i];
    count.loop_equations[i - 1] = 3 + rank(both);
    count.dofs -= count.loop_equations[i - 1];
    platform = intersection(platform, rotations[i]);
  }
  count.platform_translations = 3;
  count.platform_rotations = rank(platform);
  if (platform.cols() > 0) count.rotation_axis = platform.col(0).normalized();
  return count;
}

}  // namespace mbv::scara_robot
