#include "features/stiffness/stiffness_measures.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mbv {
namespace {

// Signed so that the largest component is positive: a direction has no sense of its own.
template <typename Vector>
Vector WithPositiveMain(const Vector& v) {
  Eigen::Index k = 0;
  v.cwiseAbs().maxCoeff(&k);
  return v[k] < 0 ? Vector(-v) : v;
}

// Principal compliances, ascending.
struct Principal {
  Vec3 values = Vec3::Constant(kNan);
  Mat3 directions = Mat3::Constant(kNan);
};
Principal PrincipalOf(const Mat3& block) {
  Principal principal;
  if (!block.allFinite()) return principal;
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(Mat3(0.5 * (block + block.transpose())));
  principal.values = solver.eigenvalues();
  principal.directions = solver.eigenvectors();
  return principal;
}

WeakDirection WeakestOf(const Mat3& block) {
  const Principal principal = PrincipalOf(block);
  if (!principal.values.allFinite()) return {};
  return {WithPositiveMain(Vec3(principal.directions.col(2))), 1.0 / principal.values[2]};
}

double NaturalLength(const Mat6& C) {
  return std::sqrt(C.bottomRightCorner<3, 3>().trace() / C.topLeftCorner<3, 3>().trace());
}

// Condition number of C with rotations times L.
double Condition(const Mat6& C) {
  const double L = NaturalLength(C);
  if (!C.allFinite() || !(L > 0.0)) return kNan;
  Vec6 s = Vec6::Ones();
  s.head<3>().setConstant(L);
  const Mat6 scaled = s.asDiagonal() * C * s.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(Mat6(0.5 * (scaled + scaled.transpose())));
  return solver.eigenvalues()[5] / solver.eigenvalues()[0];
}

}  // namespace

WeakDirection WeakestTranslation(const Mat6& C) { return WeakestOf(C.bottomRightCorner<3, 3>()); }
WeakDirection WeakestRotation(const Mat6& C) { return WeakestOf(C.topLeftCorner<3, 3>()); }

WeakScrew WeakestScrew(const Mat6& C, double length_m) {
  WeakScrew screw;
  if (!C.allFinite()) return screw;
  screw.length_m = std::isnan(length_m) ? NaturalLength(C) : length_m;
  if (!(screw.length_m > 0.0)) return screw;
  Vec6 s = Vec6::Ones();
  s.head<3>().setConstant(screw.length_m);
  const Mat6 scaled = s.asDiagonal() * C * s.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(Mat6(0.5 * (scaled + scaled.transpose())));
  screw.stiffness = 1.0 / solver.eigenvalues()[5];
  screw.twist = WithPositiveMain(Vec6(solver.eigenvectors().col(5)));
  screw.twist.head<3>() /= screw.length_m;
  const Vec3 rotation = screw.twist.head<3>(), shift = screw.twist.tail<3>();
  const double turn = rotation.norm();
  if (turn * screw.length_m < 1e-9) {
    screw.axis = shift.normalized();
    screw.point = Vec3::Zero();
    screw.pitch_m = std::numeric_limits<double>::infinity();
    return screw;
  }
  screw.axis = rotation / turn;
  screw.point = rotation.cross(shift) / (turn * turn);
  screw.pitch_m = rotation.dot(shift) / (turn * turn);
  return screw;
}

std::vector<Contribution> Contributions(const StiffnessResult& result) {
  std::vector<Contribution> rows;
  if (!result.C.allFinite()) return rows;
  const Vec3 weak_shift = WeakestTranslation(result.C).direction;
  const Vec3 weak_turn = WeakestRotation(result.C).direction;
  const auto along = [](const Mat3& block, const Vec3& d) { return d.dot(block * d); };
  const double shift = along(result.C.bottomRightCorner<3, 3>(), weak_shift);
  const double turn = along(result.C.topLeftCorner<3, 3>(), weak_turn);
  for (const ComplianceShare& share : result.shares) {
    Contribution row;
    row.element = share.element;
    row.translation = along(share.C.bottomRightCorner<3, 3>(), weak_shift) / shift;
    row.rotation = along(share.C.topLeftCorner<3, 3>(), weak_turn) / turn;
    row.axis = share.C.diagonal().cwiseQuotient(result.C.diagonal());
    rows.push_back(std::move(row));
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Contribution& a, const Contribution& b) {
    return a.translation > b.translation;
  });
  return rows;
}

std::vector<NamedIndex> GeneralIndices(const StiffnessResult& result) {
  const Principal shift = PrincipalOf(result.C.bottomRightCorner<3, 3>());
  const Principal turn = PrincipalOf(result.C.topLeftCorner<3, 3>());
  return {{"k_translation_min", "N/m", "against a force in the weakest direction",
           1.0 / shift.values[2]},
          {"k_translation_max", "N/m", "against a force in the stiffest direction",
           1.0 / shift.values[0]},
          {"k_rotation_min", "N m/rad", "against a moment about the weakest axis",
           1.0 / turn.values[2]},
          {"k_rotation_max", "N m/rad", "against a moment about the stiffest axis",
           1.0 / turn.values[0]},
          {"k_screw_min", "N/m", "against the weakest screw, rotations times L",
           WeakestScrew(result.C).stiffness},
          {"condition", "1", "largest over smallest compliance, rotations times L",
           Condition(result.C)}};
}

const char* StiffnessUnit(int row, int column) {
  if (row < 3) return column < 3 ? "N m/rad" : "N m/m";
  return column < 3 ? "N/rad" : "N/m";
}

const char* ComplianceUnit(int row, int column) {
  if (row < 3) return column < 3 ? "rad/(N m)" : "rad/N";
  return column < 3 ? "m/(N m)" : "m/N";
}

}  // namespace mbv
