#include "reference/least_forces.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

namespace mbv::internal {
namespace {

// A self-stress with a smaller share than this in the driven forces does not act there.
constexpr double kShare = 1e-7;

}  // namespace

void TakeLeastForces(const MatX& self_stress, Eigen::Index first_driven, VecX* force) {
  const Eigen::Index k = self_stress.cols(), driven = force->size() - first_driven;
  if (k == 0) return;
  const Eigen::HouseholderQR<MatX> qr(self_stress);
  const MatX Q = qr.householderQ() * MatX::Identity(self_stress.rows(), k);
  MatX rest = Q;  // self-stresses that leave the driven forces alone
  if (driven > 0) {
    const Eigen::JacobiSVD<MatX> svd(Q.bottomRows(driven),
                                     Eigen::ComputeThinU | Eigen::ComputeFullV);
    const VecX& share = svd.singularValues();
    Eigen::Index acting = 0;
    while (acting < share.size() && share[acting] > kShare) ++acting;
    const VecX along = svd.matrixU().leftCols(acting).transpose() * force->tail(driven);
    *force -= Q * (svd.matrixV().leftCols(acting) * along.cwiseQuotient(share.head(acting)));
    rest = Q * svd.matrixV().rightCols(k - acting);
  }
  *force -= rest * (rest.transpose() * *force);
}

bool SelfStressReaches(const SparseLeastNorm& forces, const SparseLu::Matrix& A,
                       Eigen::Index first) {
  VecX random(A.cols());
  for (Eigen::Index i = 0; i < random.size(); ++i) {
    random[i] = std::sin(1.0 + 1.7 * static_cast<double>(i) + std::cos(static_cast<double>(i)));
  }
  const VecX stress = random - forces.LeastNorm(A * random);
  return stress.tail(random.size() - first).norm() > kShare * stress.norm();
}

}  // namespace mbv::internal
