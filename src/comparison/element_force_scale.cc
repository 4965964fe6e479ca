#include "comparison/element_force_scale.h"

#include <algorithm>
#include <cmath>

#include "kinematics/element_rows.h"

namespace mbv::internal {
namespace {

// Along the element's coordinate.
struct Rates {
  double velocity = 0.0, acceleration = 0.0, home = 0.0;
};

double SizeOf(const DampingLaw& law, const Rates& rates, const MotionSize& /*motion*/) {
  return law.damping * rates.velocity;
}
double SizeOf(const SpringLaw& law, const Rates& rates, const MotionSize& motion) {
  double at_home = law.preload, power = 1.0;
  for (const double k : law.polynomial) at_home += k * (power *= rates.home - law.free);
  const double k = std::abs(law.polynomial[0]);
  const double by_energy = std::sqrt(2.0 * k * std::max(0.0, motion.most_energy_J));
  return std::max(std::abs(at_home), std::min(by_energy, k * rates.velocity * motion.duration_s));
}
double SizeOf(const RotorLaw& law, const Rates& rates, const MotionSize& /*motion*/) {
  return law.reflected() * rates.acceleration;
}
double SizeOf(const FrictionLaw& law, const Rates& /*rates*/, const MotionSize& /*motion*/) {
  return law.coulomb;
}

}  // namespace

std::vector<ElementSize> SizesOfElements(const Mechanism& mechanism,
                                         const std::vector<DrivenSize>& driven,
                                         const MotionSize& motion) {
  std::vector<ElementSize> sizes;
  if (mechanism.elements.empty() || mechanism.X_WB_home.empty()) return sizes;
  BodyStates home;
  home.Resize(mechanism.bodies.size());
  home.X_WB = mechanism.X_WB_home;
  const std::vector<ScalarRow> rows = ElementRows(mechanism, home);
  for (size_t e = 0; e < rows.size(); ++e) {
    const ScalarRow& row = rows[e];
    ElementSize size;
    Rates rates{.home = row.value};
    for (const DrivenSize& one : driven) {
      const double rate = std::abs(RateOf(row, *one.V_WB));
      size.rate.push_back(rate);
      rates.velocity = std::max(rates.velocity, rate * one.velocity);
      rates.acceleration = std::max(rates.acceleration, rate * one.acceleration);
    }
    size.force = std::visit([&](const auto& law) { return SizeOf(law, rates, motion); },
                            mechanism.elements[e].law);
    sizes.push_back(size);
  }
  return sizes;
}

}  // namespace mbv::internal
