#include "kinematics/frame_pair.h"

#include <cmath>

#include "math/spatial.h"

namespace mbv::internal {
namespace {

// c(θ) of RotationVector(), c'(θ)/θ, and once more: (c'/θ)'/θ.
struct LogMap {
  double c = 1.0 / 12.0, slope = 1.0 / 360.0, curve = 1.0 / 3780.0;
};

LogMap LogMapAt(double theta) {
  const double theta2 = theta * theta;
  constexpr double kSeries = 0.2;  // below, by power series: the next terms are under 1e-15
  if (theta < kSeries) {
    return {1.0 / 12.0 + theta2 * (1.0 / 720.0 + theta2 * (1.0 / 30240.0 + theta2 / 1209600.0)) +
                theta2 * theta2 * theta2 * theta2 / 47900160.0,
            1.0 / 360.0 + theta2 * (1.0 / 7560.0 + theta2 * (1.0 / 201600.0 + theta2 / 5987520.0)),
            1.0 / 3780.0 + theta2 * (1.0 / 50400.0 +
                                     theta2 * (1.0 / 997920.0 +
                                               theta2 * (4.2273533e-8 + theta2 * 1.6059044e-9)))};
  }
  const double half = 0.5 * theta, cot = std::cos(half) / std::sin(half);
  const double s = std::sin(half);
  const double slope = -2.0 / (theta2 * theta) + cot / (2.0 * theta2) + 1.0 / (4.0 * theta * s * s);
  const double second = 6.0 / (theta2 * theta2) - cot / (theta2 * theta) -
                        1.0 / (2.0 * theta2 * s * s) - cot / (4.0 * theta * s * s);
  return {1.0 / theta2 - cot / (2.0 * theta), slope / theta, (second - slope / theta) / theta2};
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

VariedPair MakePair(const BodyStates& states, const std::vector<Vec6>& by, int parent,
                    const Pose& X_PF, int child, const Pose& X_CM) {
  VariedPair pair;
  pair.at = MakePair(states, parent, X_PF, child, X_CM);
  const FramePair& at = pair.at;
  const Vec6 &parent_by = by[static_cast<size_t>(parent)],
             &child_by = by[static_cast<size_t>(child)];
  pair.t_P = parent_by.head<3>(), pair.t_C = child_by.head<3>();
  pair.r_F = pair.t_P.cross(at.r_F), pair.r_M = pair.t_C.cross(at.r_M);
  pair.d = (child_by.tail<3>() - parent_by.tail<3>()) + (pair.r_M - pair.r_F);
  const Vec3 v_F = at.w_P.cross(pair.r_F), v_M = at.w_C.cross(pair.r_M);
  pair.d_rate = v_M - v_F;
  pair.centripetal = at.w_C.cross(v_M) - at.w_P.cross(v_F);
  return pair;
}

VariedScalar Along(const VariedPair& pair, const Vec3& n_F) {
  const FramePair& at = pair.at;
  VariedScalar out{.at = Along(at, n_F), .by = {}};
  const Vec3 n = at.R_WF * n_F, dn = pair.t_P.cross(n);
  const Vec3 n_rate = at.w_P.cross(n), dn_rate = at.w_P.cross(dn);
  PairScalar& by = out.by;
  by.value = dn.dot(at.d) + n.dot(pair.d);
  by.J_child << pair.r_M.cross(n) + at.r_M.cross(dn), dn;
  by.J_parent << dn.cross(at.r_F + at.d) + n.cross(pair.r_F + pair.d), -dn;
  by.rate = dn.dot(at.d_rate) + n.dot(pair.d_rate) + dn_rate.dot(at.d) + n_rate.dot(pair.d);
  by.bias = dn.dot(at.centripetal) + n.dot(pair.centripetal) +
            2 * (dn_rate.dot(at.d_rate) + n_rate.dot(pair.d_rate)) +
            at.w_P.cross(dn_rate).dot(at.d) + at.w_P.cross(n_rate).dot(pair.d);
  return out;
}

VariedScalar Cosine(const VariedPair& pair, const Vec3& f_F, const Vec3& m_M) {
  const FramePair& at = pair.at;
  VariedScalar out{.at = Cosine(at, f_F, m_M), .by = {}};
  const Vec3 f = at.R_WF * f_F, m = at.R_WM * m_M;
  const Vec3 df = pair.t_P.cross(f), dm = pair.t_C.cross(m);
  const Vec3 f_rate = at.w_P.cross(f), df_rate = at.w_P.cross(df);
  const Vec3 m_rate = at.w_C.cross(m), dm_rate = at.w_C.cross(dm);
  const Vec3 turn = dm.cross(f) + m.cross(df);
  PairScalar& by = out.by;
  by.value = df.dot(m) + f.dot(dm);
  by.J_child << turn, Vec3::Zero();
  by.J_parent << -turn, Vec3::Zero();
  by.rate = df_rate.dot(m) + f_rate.dot(dm) + df.dot(m_rate) + f.dot(dm_rate);
  by.bias = at.w_P.cross(df_rate).dot(m) + at.w_P.cross(f_rate).dot(dm) +
            2 * (df_rate.dot(m_rate) + f_rate.dot(dm_rate)) + df.dot(at.w_C.cross(m_rate)) +
            f.dot(at.w_C.cross(dm_rate));
  return out;
}

VariedScalar Distance(const VariedPair& pair) {
  const FramePair& at = pair.at;
  VariedScalar out{.at = Distance(at), .by = {}};
  const double length = out.at.value;
  const Vec3 u = at.d / length;
  PairScalar& by = out.by;
  by.value = u.dot(pair.d);
  const Vec3 du = (pair.d - by.value * u) / length;
  by.J_child << pair.r_M.cross(u) + at.r_M.cross(du), du;
  by.J_parent << du.cross(at.r_F) + u.cross(pair.r_F), -du;
  by.rate = du.dot(at.d_rate) + u.dot(pair.d_rate);
  const Vec3 across = at.d_rate - out.at.rate * u;
  const Vec3 dacross = pair.d_rate - by.rate * u - out.at.rate * du;
  by.bias = du.dot(at.centripetal) + u.dot(pair.centripetal) +
            (2 * across.dot(dacross) - across.squaredNorm() * by.value / length) / length;
  return out;
}

VariedScalar Angle(const VariedScalar& s, const VariedScalar& c) {
  VariedScalar out{.at = Angle(s.at, c.at), .by = {}};
  const double rho2 = s.at.value * s.at.value + c.at.value * c.at.value;
  const double drho2 = 2 * (s.at.value * s.by.value + c.at.value * c.by.value);
  const double ks = c.at.value / rho2, kc = -s.at.value / rho2;
  const double dks = (c.by.value - ks * drho2) / rho2, dkc = -(s.by.value + kc * drho2) / rho2;
  PairScalar& by = out.by;
  by.value = ks * s.by.value + kc * c.by.value;
  by.J_child = dks * s.at.J_child + ks * s.by.J_child + dkc * c.at.J_child + kc * c.by.J_child;
  by.J_parent = dks * s.at.J_parent + ks * s.by.J_parent + dkc * c.at.J_parent + kc * c.by.J_parent;
  by.rate = dks * s.at.rate + ks * s.by.rate + dkc * c.at.rate + kc * c.by.rate;
  const double slide = 2 * (s.at.value * s.at.rate + c.at.value * c.at.rate) / rho2;
  const double dslide = (2 * (s.by.value * s.at.rate + s.at.value * s.by.rate +
                              c.by.value * c.at.rate + c.at.value * c.by.rate) -
                         slide * drho2) /
                        rho2;
  by.bias = dks * s.at.bias + ks * s.by.bias + dkc * c.at.bias + kc * c.by.bias -
            dslide * out.at.rate - slide * by.rate;
  return out;
}

VariedScalar RollPitchYaw(const VariedPair& pair, int component) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  if (component == 0) return Angle(Cosine(pair, z, y), Cosine(pair, z, z));
  if (component == 2) return Angle(Cosine(pair, y, x), Cosine(pair, x, x));
  const VariedScalar R20 = Cosine(pair, z, x);
  VariedScalar out{.at = RollPitchYaw(pair.at, 1), .by = {}};
  const double cos_p = std::cos(out.at.value);
  PairScalar& by = out.by;
  by.value = -R20.by.value / cos_p;
  const double share = -R20.at.value * R20.by.value / (cos_p * cos_p);  // δcos_p/cos_p
  by.J_child = -R20.by.J_child / cos_p - share * out.at.J_child;
  by.J_parent = -R20.by.J_parent / cos_p - share * out.at.J_parent;
  by.rate = -R20.by.rate / cos_p - share * out.at.rate;
  by.bias = (-R20.by.value * out.at.rate * out.at.rate - 2 * R20.at.value * out.at.rate * by.rate -
             R20.by.bias) /
                cos_p -
            share * out.at.bias;
  return out;
}

VariedScalar RotationVector(const VariedPair& pair, int component) {
  const FramePair& at = pair.at;
  VariedScalar out{.at = RotationVector(at, component), .by = {}};
  const Mat3 R_FW = at.R_WF.transpose();
  const Vec3 phi = LogRotation(R_FW * at.R_WM);
  const LogMap map = LogMapAt(phi.norm());
  const Mat3 P = Skew(phi), P2 = P * P;
  const Mat3 T = Mat3::Identity() - 0.5 * P + map.c * P2;
  const Vec3 dphi = T * (R_FW * (pair.t_C - pair.t_P));
  const Mat3 dP = Skew(dphi);
  const Mat3 dP2 = dP * P + P * dP;
  const double dc = map.slope * phi.dot(dphi), dslope = map.curve * phi.dot(dphi);
  const Mat3 dT = -0.5 * dP + dc * P2 + map.c * dP2;
  const auto turned = [&](const Vec3& v) { return Vec3(-R_FW * pair.t_P.cross(v)); };
  const Vec3 between = at.w_C - at.w_P;
  const Vec3 w = R_FW * between, dw = turned(between);
  const Vec3 w_P = R_FW * at.w_P, dw_P = turned(at.w_P);
  const Vec3 phi_rate = T * w, dphi_rate = dT * w + T * dw;
  const Mat3 P_rate = Skew(phi_rate), dP_rate = Skew(dphi_rate);
  const double along = phi.dot(phi_rate), dalong = dphi.dot(phi_rate) + phi.dot(dphi_rate);
  const Mat3 twice = P_rate * P + P * P_rate;
  const Mat3 dtwice = dP_rate * P + P_rate * dP + dP * P_rate + P * dP_rate;
  const Mat3 T_rate = -0.5 * P_rate + map.slope * along * P2 + map.c * twice;
  const Mat3 dT_rate = -0.5 * dP_rate + (dslope * along + map.slope * dalong) * P2 +
                       map.slope * along * dP2 + dc * twice + map.c * dtwice;
  const Vec3 dbias =
      dT_rate * w + T_rate * dw - dT * w_P.cross(w) - T * (dw_P.cross(w) + w_P.cross(dw));
  const Vec3 n = at.R_WF * T.row(component).transpose();
  const Vec3 dn = pair.t_P.cross(n) + at.R_WF * dT.row(component).transpose();
  PairScalar& by = out.by;
  by.value = dphi[component];
  by.J_child << dn, Vec3::Zero();
  by.J_parent << -dn, Vec3::Zero();
  by.rate = dphi_rate[component];
  by.bias = dbias[component];
  return out;
}

}  // namespace mbv::internal
