#include "mechanism/impossible_inertia.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>

namespace mbv {

std::string PrincipalInertiaText(const Vec3& principal) {
  return fmt::format("principal inertias {:.6g}, {:.6g}, {:.6g} kg m²", principal[0], principal[1],
                     principal[2]);
}

std::string TriangleViolation(const Body& body) {
  const Vec3 principal = Eigen::SelfAdjointEigenSolver<Mat3>(body.I_Bcm_B).eigenvalues();
  if (!(principal[0] + principal[1] < principal[2] * (1.0 - 1e-9))) return "";
  return PrincipalInertiaText(principal) + " violate I1 + I2 >= I3";
}

}  // namespace mbv
