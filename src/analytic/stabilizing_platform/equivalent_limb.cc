#include "analytic/stabilizing_platform/equivalent_limb.h"

namespace mbv::stabilizing_platform {
namespace {

Vec6 Rotation(const Vec3& s, const Vec3& r) {
  Vec6 screw;
  screw << s, r.cross(s);
  return screw;
}

Vec6 Translation(const Vec3& s) {
  Vec6 screw;
  screw << Vec3::Zero(), s;
  return screw;
}

}  // namespace

std::array<Vec6, 9> LimbScrews(double b1, double b2, double c2, double c3) {
  const Vec3 X = Vec3::UnitX(), Y = Vec3::UnitY(), Z = Vec3::UnitZ();
  const Vec3 A = Vec3::Zero(), B(0, 0, c3);
  return {Rotation(X, {0, -b1, 0}),
          Rotation(Y, A),
          Rotation(X, {0, b2, c2}),
          Rotation(X, B),
          Rotation(Y, B),
          Rotation(Z, B),
          Rotation(X, {0, -b2, c2}),
          Rotation(X, {0, b1, 0}),
          Rotation(Y, A)};
}

std::array<Vec6, 5> EquivalentScrews(double c3) {
  const Vec3 X = Vec3::UnitX(), Y = Vec3::UnitY(), Z = Vec3::UnitZ();
  const Vec3 B(0, 0, c3);
  return {Rotation(Y, Vec3::Zero()), Translation(c3 * Z), Rotation(X, B), Rotation(Y, B),
          Rotation(Z, B)};
}

Mat6 VirtualLimbScrews(const LimbPlace& place, const LimbMotion& limb) {
  Mat6 J;
  J.col(0) = Rotation(place.e_r, limb.p_oA);
  J.col(1) = Rotation(place.e_t, limb.p_oA);
  J.col(2) = Translation((limb.p_oB - limb.p_oA) / limb.length.value);
  for (int k = 0; k < 3; ++k) J.col(3 + k) = Rotation(Vec3::Unit(k), limb.p_oB);
  return J;
}

InfluenceMatrices ComputeInfluence(const std::array<LimbPlace, 3>& places,
                                   const std::array<LimbMotion, 3>& limbs) {
  std::array<Mat6, 3> J, J_inverse;
  InfluenceMatrices out;
  for (int i = 0; i < 3; ++i) {
    J[i] = VirtualLimbScrews(places[i], limbs[i]);
    J_inverse[i] = J[i].inverse();
    out.G.row(i) = J_inverse[i].row(2);
    out.G.row(3 + i) = J_inverse[i].row(0);
  }
  const Mat6 G_inverse = out.G.inverse();
  for (int i = 0; i < 3; ++i) {
    const Mat6 T = J_inverse[i] * G_inverse;
    for (int m : {i, 3 + i}) out.H[m].setZero();
    for (int j = 0; j < 6; ++j) {
      for (int k = j + 1; k < 6; ++k) {
        const Vec6 bracket = J_inverse[i] * Bracket(J[i].col(j), J[i].col(k));
        const Mat6 TT = T.row(j).transpose() * T.row(k);
        out.H[i] += bracket[2] * TT;
        out.H[3 + i] += bracket[0] * TT;
      }
    }
  }
  return out;
}

EquivalentRates RatesOf(const InfluenceMatrices& influence, const Vec6& V_op, const Vec6& A_op) {
  EquivalentRates q;
  q.rate = influence.G * V_op;
  q.acceleration = influence.G * A_op;
  for (int m = 0; m < 6; ++m) q.acceleration[m] -= q.rate.dot(influence.H[m] * q.rate);
  return q;
}

}  // namespace mbv::stabilizing_platform
