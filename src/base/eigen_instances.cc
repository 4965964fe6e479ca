#include "base/eigen_instances.h"

MBV_EIGEN_INSTANCES(template)

namespace mbv {

Eigen::MatrixXd OrthogonalFactor(const Eigen::ColPivHouseholderQR<Eigen::MatrixXd>& qr) {
  return qr.householderQ();
}

}  // namespace mbv

MBV_FORMAT_INSTANCES(template)
