// Principal axes, made admissible for MuJoCo.
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "mjcf/mjcf.h"

namespace mbv {
namespace {

// A slender or point-like body: moments below this fraction of the largest, or below that of a
// body with this radius of gyration, are raised. MuJoCo refuses zero.
constexpr double kSmallestMomentRatio = 1e-12;
constexpr double kSmallestGyration_m = 1e-7;

}  // namespace

PrincipalInertia PrincipalInertiaOf(const Mat3& I, double mass) {
  PrincipalInertia principal;
  const Mat3 off_diagonal = I - Mat3(I.diagonal().asDiagonal());
  if (off_diagonal.isZero(0.0)) {
    principal.moments = I.diagonal();
  } else {
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(Mat3(0.5 * (I + I.transpose())));
    // Descending order, right-handed.
    principal.moments = solver.eigenvalues().reverse();
    principal.R = solver.eigenvectors().rowwise().reverse();
    if (principal.R.determinant() < 0.0) principal.R.col(2) *= -1.0;
  }
  Vec3& m = principal.moments;
  const double floor = std::max(kSmallestMomentRatio * m.maxCoeff(),
                                mass * kSmallestGyration_m * kSmallestGyration_m);
  m = m.cwiseMax(floor);
  // A lamina's largest moment is the sum of the others, up to rounding.
  int k = 0;
  const double largest = m.maxCoeff(&k);
  const double others = m[(k + 1) % 3] + m[(k + 2) % 3];
  if (largest > others && largest < others * (1.0 + 1e-9)) m[k] = others;
  return principal;
}

}  // namespace mbv
