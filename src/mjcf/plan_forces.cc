// What MuJoCo has of the force elements.
#include "mjcf/plan.h"

namespace mbv::mjcf {
namespace {

// A tendon's spring length below zero would mean another one to MuJoCo.
bool IsPlannedSpring(const ForceElement& element, const SpringLaw& spring) {
  const double k = spring.polynomial[0];
  if (spring.polynomial.size() != 1 || !(k > 0.0)) return false;
  return element.drive < 0 || spring.free - spring.preload / k >= 0.0;
}

template <typename Acts>
PlannedForces SumOf(const Mechanism& mechanism, const Acts& acts) {
  PlannedForces sum;
  double force_at_zero = 0.0;
  for (const ForceElement& element : mechanism.elements) {
    if (!acts(element) || !IsPlanned(element)) continue;
    if (const auto* damping = std::get_if<DampingLaw>(&element.law)) {
      sum.damping += damping->damping;
    } else if (const auto* spring = std::get_if<SpringLaw>(&element.law)) {
      sum.stiffness += spring->polynomial[0];
      force_at_zero += spring->polynomial[0] * spring->free - spring->preload;
    } else if (const auto* rotor = std::get_if<RotorLaw>(&element.law)) {
      sum.armature += rotor->reflected();
    }
  }
  if (sum.stiffness > 0.0) sum.free = force_at_zero / sum.stiffness;
  return sum;
}

}  // namespace

bool IsPlanned(const ForceElement& element) {
  if (element.bushing >= 0 || IsGyroscopic(element)) return false;
  if (const auto* spring = std::get_if<SpringLaw>(&element.law)) {
    return IsPlannedSpring(element, *spring);
  }
  return std::holds_alternative<DampingLaw>(element.law) ||
         (std::holds_alternative<RotorLaw>(element.law) && element.drive < 0);
}

PlannedForces ForcesOfJoint(const Mechanism& mechanism, int joint, int coordinate) {
  return SumOf(mechanism, [&](const ForceElement& element) {
    return element.joint == joint && element.coordinate == coordinate;
  });
}

PlannedForces ForcesOfDrive(const Mechanism& mechanism, int drive) {
  return SumOf(mechanism, [&](const ForceElement& element) { return element.drive == drive; });
}

}  // namespace mbv::mjcf
