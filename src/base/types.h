// Linear-algebra vocabulary: Eigen types under the names used throughout.
//
// Notation (after Drake's multibody quantities): X_AB is the pose of frame B in A, R_AB its
// rotation, p_AQ_E the position of Q from A's origin expressed in E. A twist V = [ω; v] has the
// rotation first; v is the velocity of the body's origin unless a point is named. A wrench
// F = [m; f] has the moment first. W is the world. SI units and radians.
#pragma once

#include "base/eigen_instances.h"

namespace mbv {

using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using VecX = Eigen::VectorXd;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using MatX = Eigen::MatrixXd;
using Pose = Eigen::Isometry3d;

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kEps = std::numeric_limits<double>::epsilon();

/// Root of the mean square; NaN of nothing.
[[nodiscard]] inline double Rms(const VecX& values) {
  return values.size() == 0 ? kNan
                            : std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
}

}  // namespace mbv
