#include "kinematics/frame_pair.h"

#include <cmath>

#include "math/spatial.h"
#include "mechanism/joint_pose.h"

namespace mbv::internal {
namespace {

// c(θ) of RotationVector() and c'(θ)/θ.
struct LogMap {
  double c = 1.0 / 12.0, slope = 1.0 / 360.0;
};

LogMap LogMapAt(double theta) {
  const double theta2 = theta * theta;
  constexpr double kSeries = 0.2;  // below, by power series: the next terms are under 1e-15
  if (theta < kSeries) {
    return {1.0 / 12.0 + theta2 * (1.0 / 720.0 + theta2 * (1.0 / 30240.0 + theta2 / 1209600.0)) +
                theta2 * theta2 * theta2 * theta2 / 47900160.0,
            1.0 / 360.0 + theta2 * (1.0 / 7560.0 + theta2 * (1.0 / 201600.0 + theta2 / 5987520.0))};
  }
  const double half = 0.5 * theta, cot = std::cos(half) / std::sin(half);
  const double s = std::sin(half);
  const double slope = -2.0 / (theta2 * theta) + cot / (2.0 * theta2) + 1.0 / (4.0 * theta * s * s);
  return {1.0 / theta2 - cot / (2.0 * theta), slope / theta};
}

// Written and read in halves: a pair of numbers that two stores left is not there at once.
void Stack(const Vec3& a, const Vec3& b, Vec6* out) {
  double* to = out->data();
  to[0] = a.x(), to[1] = a.y(), to[2] = a.z();
  to[3] = b.x(), to[4] = b.y(), to[5] = b.z();
}

}  // namespace

FramePair MakePair(const BodyStates& states, int parent, const Pose& X_PF, int child,
                   const Pose& X_CM, bool moves) {
  const Pose& X_WP = states.X_WB[parent];
  const Pose& X_WC = states.X_WB[child];
  FramePair pair;
  pair.moves = moves;
  // No temporaries: read at once, they would wait for their stores.
  pair.R_WF.noalias() = X_WP.linear() * X_PF.linear();
  pair.R_WM.noalias() = X_WC.linear() * X_CM.linear();
  pair.r_F.noalias() = X_WP.linear() * X_PF.translation();
  pair.r_M.noalias() = X_WC.linear() * X_CM.translation();
  // Differences of origins first: with parent and child far from the world's origin this keeps
  // the digits of the small distance.
  pair.d = (X_WC.translation() - X_WP.translation()) + (pair.r_M - pair.r_F);
  if (!moves) {
    for (Vec3* rate : {&pair.w_P, &pair.w_C, &pair.d_rate, &pair.centripetal}) rate->setZero();
    return pair;
  }
  const Vec6& V_WP = states.V_WB[parent];
  const Vec6& V_WC = states.V_WB[child];
  pair.w_P = V_WP.head<3>();
  pair.w_C = V_WC.head<3>();
  const Vec3 v_F = pair.w_P.cross(pair.r_F);
  const Vec3 v_M = pair.w_C.cross(pair.r_M);
  pair.d_rate = (V_WC.tail<3>() - V_WP.tail<3>()) + (v_M - v_F);
  pair.centripetal = pair.w_C.cross(v_M) - pair.w_P.cross(v_F);
  return pair;
}

PairScalar Along(const FramePair& pair, const Vec3& n_F) {
  const Vec3 n = pair.R_WF * n_F;
  PairScalar out;
  out.value = n.dot(pair.d);
  Stack(pair.r_M.cross(n), n, &out.J_child);
  Stack(n.cross(pair.r_F + pair.d), -n, &out.J_parent);
  out.bias = 0.0;
  if (!pair.moves) return out;
  const Vec3 n_rate = pair.w_P.cross(n);
  out.bias =
      n.dot(pair.centripetal) + 2 * n_rate.dot(pair.d_rate) + pair.w_P.cross(n_rate).dot(pair.d);
  out.rate = n.dot(pair.d_rate) + n_rate.dot(pair.d);
  return out;
}

PairScalar Cosine(const FramePair& pair, const Vec3& f_F, const Vec3& m_M) {
  const Vec3 f = pair.R_WF * f_F;
  const Vec3 m = pair.R_WM * m_M;
  const Vec3 turn = m.cross(f);  // ċ = (ω_C − ω_P)·(m × f)
  PairScalar out;
  out.value = f.dot(m);
  Stack(turn, Vec3::Zero(), &out.J_child);
  Stack(-turn, Vec3::Zero(), &out.J_parent);
  out.bias = 0.0;
  if (!pair.moves) return out;
  const Vec3 f_rate = pair.w_P.cross(f);
  const Vec3 m_rate = pair.w_C.cross(m);
  out.bias = pair.w_P.cross(f_rate).dot(m) + 2 * f_rate.dot(m_rate) + f.dot(pair.w_C.cross(m_rate));
  out.rate = f_rate.dot(m) + f.dot(m_rate);
  return out;
}

PairScalar Distance(const FramePair& pair) {
  PairScalar out;
  out.value = pair.d.norm();
  const Vec3 u = pair.d / out.value;
  out.J_child << pair.r_M.cross(u), u;
  out.J_parent << u.cross(pair.r_F), -u;
  out.rate = u.dot(pair.d_rate);
  out.bias = u.dot(pair.centripetal) + (pair.d_rate - out.rate * u).squaredNorm() / out.value;
  return out;
}

PairScalar Angle(const PairScalar& s, const PairScalar& c) {
  const double rho2 = s.value * s.value + c.value * c.value;
  const double ks = c.value / rho2, kc = -s.value / rho2;
  PairScalar out;
  out.value = std::atan2(s.value, c.value);
  out.J_child = ks * s.J_child + kc * c.J_child;
  out.J_parent = ks * s.J_parent + kc * c.J_parent;
  out.rate = ks * s.rate + kc * c.rate;
  // ρ² φ̈ = c s̈ − s c̈ − 2 (s ṡ + c ċ) φ̇
  out.bias =
      ks * s.bias + kc * c.bias - 2 * (s.value * s.rate + c.value * c.rate) / rho2 * out.rate;
  return out;
}

PairScalar RollPitchYaw(const FramePair& pair, int component) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  if (component == 0) return Angle(Cosine(pair, z, y), Cosine(pair, z, z));
  if (component == 2) return Angle(Cosine(pair, y, x), Cosine(pair, x, x));
  // R20 = −sin p, hence cos p ṗ = −Ṙ20 and cos p p̈ = sin p ṗ² − R̈20.
  const PairScalar R20 = Cosine(pair, z, x);
  const double cos_p = std::hypot((pair.R_WF.col(2)).dot(pair.R_WM.col(1)),
                                  (pair.R_WF.col(2)).dot(pair.R_WM.col(2)));
  PairScalar out;
  out.value = std::atan2(-R20.value, cos_p);
  out.J_child = -R20.J_child / cos_p;
  out.J_parent = -R20.J_parent / cos_p;
  out.rate = -R20.rate / cos_p;
  out.bias = (-R20.value * out.rate * out.rate - R20.bias) / cos_p;
  return out;
}

PairScalar RotationVector(const FramePair& pair, int component) {
  const Mat3 R_FW = pair.R_WF.transpose();
  const Vec3 phi = LogRotation(R_FW * pair.R_WM);
  const LogMap map = LogMapAt(phi.norm());
  const Mat3 P = Skew(phi);
  const Mat3 T = Mat3::Identity() - 0.5 * P + map.c * P * P;
  const Vec3 w = R_FW * (pair.w_C - pair.w_P);
  const Vec3 phi_rate = T * w;
  const Mat3 P_rate = Skew(phi_rate);
  // φ̈ = T R_WFᵀ (ε_C − ε_P) − T (ω_P × w) + Ṫ w
  const Mat3 T_rate =
      -0.5 * P_rate + map.slope * phi.dot(phi_rate) * P * P + map.c * (P_rate * P + P * P_rate);
  const Vec3 bias = T_rate * w - T * (R_FW * pair.w_P).cross(w);
  const Vec3 n = pair.R_WF * T.row(component).transpose();
  PairScalar out;
  out.value = phi[component];
  out.J_child << n, Vec3::Zero();
  out.J_parent << -n, Vec3::Zero();
  out.rate = phi_rate[component];
  out.bias = bias[component];
  return out;
}

PairScalar JointCoordinate(const Joint& joint, int coordinate, const FramePair& pair) {
  return CoordinateBetween(joint, coordinate, pair);
}

}  // namespace mbv::internal
