#include "mechanism/reach.h"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace mbv {
namespace {

// Calls visit(body, point in the body) for everything that constrains the body. A free joint does
// not.
template <typename Visit>
void VisitConstraints(const Mechanism& mechanism, const Visit& visit) {
  for (const Joint& joint : mechanism.joints) {
    if (joint.kind == JointKind::kFree) continue;
    visit(joint.parent, joint.X_PF.translation());
    visit(joint.child, joint.X_CM.translation());
  }
  for (const Drive& drive : mechanism.drives) {
    if (const auto* leg = std::get_if<DistanceDrive>(&drive.kind)) {
      visit(leg->body_from, leg->p_from);
      visit(leg->body_to, leg->p_to);
    }
  }
}

// The same where forces act.
template <typename Visit>
void VisitForces(const Mechanism& mechanism, const Visit& visit) {
  for (const SpringDamper& spring : mechanism.springs) {
    visit(spring.body_from, spring.p_from);
    visit(spring.body_to, spring.p_to);
  }
  for (const Bushing& bushing : mechanism.bushings) {
    visit(bushing.parent, bushing.X_PF.translation());
    visit(bushing.child, bushing.X_CM.translation());
  }
}

// Root mean square distance of two points of one body; 0 if it is not above rounding.
double MeanDistance(const std::vector<std::vector<Vec3>>& points) {
  double sum = 0.0, pairs = 0.0, reach = 0.0;
  for (const std::vector<Vec3>& on_body : points) {
    const auto n = static_cast<double>(on_body.size());
    Vec3 centre = Vec3::Zero();
    for (const Vec3& p : on_body) centre += p / n;
    // Σ |p − q|² over all pairs = n Σ |p − centre|².
    for (const Vec3& p : on_body) {
      sum += n * (p - centre).squaredNorm();
      reach = std::max(reach, p.norm());
    }
    pairs += n * (n - 1) / 2;
  }
  const double distance = pairs == 0.0 ? 0.0 : std::sqrt(sum / pairs);
  return distance > GapRounding(reach) ? distance : 0.0;
}

}  // namespace

double CharacteristicLength(const Mechanism& mechanism) {
  std::vector<std::vector<Vec3>> points(mechanism.bodies.size());
  const auto add = [&](int body, const Vec3& p) { points[body].push_back(p); };
  VisitConstraints(mechanism, add);
  if (const double distance = MeanDistance(points); distance > 0.0) return distance;
  double inertia = 0.0, mass = 0.0;
  for (size_t b = 1; b < points.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    if (body.mass <= 0.0) continue;
    points[b].push_back(body.p_BoBcm_B);
    inertia += body.I_Bcm_B.trace() / 2;
    mass += body.mass;
  }
  if (const double distance = MeanDistance(points); distance > 0.0) return distance;
  if (inertia > 0.0) return std::sqrt(inertia / mass);
  VisitForces(mechanism, add);
  const double distance = MeanDistance(points);
  return distance > 0.0 ? distance : 1.0;
}

double LongestLever(const Mechanism& mechanism) {
  double longest = 0.0;
  VisitConstraints(mechanism, [&](int, const Vec3& p) { longest = std::max(longest, p.norm()); });
  return longest;
}

double Reach(double longest_lever, const std::vector<Pose>& X_WB) {
  double reach = longest_lever;
  for (const Pose& X : X_WB) reach = std::max(reach, X.translation().norm());
  return reach;
}

std::string PrincipalInertiaText(const Vec3& principal) {
  return fmt::format("principal inertias {:.6g}, {:.6g}, {:.6g} kg m²", principal[0], principal[1],
                     principal[2]);
}

std::string TriangleViolation(const Body& body) {
  const Vec3 principal = Eigen::SelfAdjointEigenSolver<Mat3>(body.I_Bcm_B).eigenvalues();
  if (!(principal[0] + principal[1] < principal[2] * (1.0 - 1e-9))) return "";
  return PrincipalInertiaText(principal) + " violate I1 + I2 >= I3";
}

bool IsMassless(const Body& body) { return body.mass == 0.0 && body.I_Bcm_B.isZero(0.0); }

std::string ImpossibleInertia(const Body& body) {
  if (IsMassless(body)) return "";
  if (body.I_Bcm_B.isZero(0.0)) return fmt::format("mass = {} without inertia", body.mass);
  const Vec3 principal = Eigen::SelfAdjointEigenSolver<Mat3>(body.I_Bcm_B).eigenvalues();
  if (!(principal[0] > 0.0)) return PrincipalInertiaText(principal) + " violate I > 0";
  return TriangleViolation(body);
}

}  // namespace mbv
