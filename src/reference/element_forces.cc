#include "reference/element_forces.h"

#include <fmt/format.h>

#include <cmath>

namespace mbv::internal {
namespace {

struct AlongElement {
  double position = 0.0, rate = 0.0, acceleration = 0.0;
};

AlongElement MotionOf(const ScalarRow& row, const BodyStates& states) {
  return {row.value, RateOf(row, states.V_WB), RateOf(row, states.A_WB) + row.bias};
}

// Force, energy and what is lost, of each law.
double ForceOf(const DampingLaw& law, const AlongElement& at) { return -law.damping * at.rate; }
double ForceOf(const SpringLaw& law, const AlongElement& at) {
  const double x = at.position - law.free;
  double sum = 0.0;
  for (size_t i = law.polynomial.size(); i-- > 0;) sum = (sum + law.polynomial[i]) * x;
  return -(law.preload + sum);
}
double ForceOf(const RotorLaw& law, const AlongElement& at) {
  return -law.reflected() * at.acceleration;
}

// At rest without force: such samples are refused (CheckRubbing()).
double ForceOf(const FrictionLaw& law, const AlongElement& at) {
  if (at.rate == 0.0) return 0.0;
  const double slowness = at.rate / law.stribeck_rate;
  const double size = law.coulomb + (law.breakaway - law.coulomb) * std::exp(-slowness * slowness);
  return at.rate > 0.0 ? -size : size;
}

void AddEnergy(const DampingLaw& /*law*/, const AlongElement& /*at*/, Energies* /*energy*/) {}
void AddEnergy(const SpringLaw& law, const AlongElement& at, Energies* energy) {
  const double x = at.position - law.free;
  double sum = 0.0;
  for (size_t i = law.polynomial.size(); i-- > 0;) {
    sum = (sum + law.polynomial[i] / static_cast<double>(i + 2)) * x;
  }
  energy->springs += (law.preload + sum) * x;
}
void AddEnergy(const RotorLaw& law, const AlongElement& at, Energies* energy) {
  energy->kinetic += 0.5 * law.reflected() * at.rate * at.rate;
}

void AddEnergy(const FrictionLaw& /*law*/, const AlongElement& /*at*/, Energies* /*energy*/) {}

void AddPower(const DampingLaw& law, const AlongElement& at, Powers* power) {
  power->dampers += ForceOf(law, at) * at.rate;
}
void AddPower(const SpringLaw& law, const AlongElement& at, Powers* power) {
  power->springs += ForceOf(law, at) * at.rate;
}
void AddPower(const RotorLaw& law, const AlongElement& at, Powers* power) {
  power->energy_rate -= ForceOf(law, at) * at.rate;
}

void AddPower(const FrictionLaw& law, const AlongElement& at, Powers* power) {
  power->dampers += ForceOf(law, at) * at.rate;
}

ElementSlope Slope(const DampingLaw& law, double /*q*/) { return {0.0, law.damping}; }
ElementSlope Slope(const SpringLaw& law, double q) {
  const double x = q - law.free;
  double slope = 0.0;
  for (size_t i = law.polynomial.size(); i-- > 0;) {
    slope = slope * x + static_cast<double>(i + 1) * law.polynomial[i];
  }
  return {slope, 0.0};
}
ElementSlope Slope(const RotorLaw& /*law*/, double /*q*/) { return {}; }
ElementSlope Slope(const FrictionLaw& /*law*/, double /*q*/) { return {}; }

// visit(law, motion) of every element.
template <typename Visit>
void ForElements(const Mechanism& mechanism, const BodyStates& states, const Visit& visit) {
  if (mechanism.elements.empty()) return;
  const std::vector<ScalarRow> rows = ElementRows(mechanism, states);
  for (size_t e = 0; e < rows.size(); ++e) {
    std::visit([&](const auto& law) { visit(law, rows[e], MotionOf(rows[e], states)); },
               mechanism.elements[e].law);
  }
}

}  // namespace

void TakeElementForces(const Mechanism& mechanism, const BodyStates& states,
                       std::vector<Vec6>* wrench_W) {
  ForElements(mechanism, states,
              [&](const auto& law, const ScalarRow& row, const AlongElement& at) {
                const double force = ForceOf(law, at);
                (*wrench_W)[static_cast<size_t>(row.parent)] -= force * row.J_parent;
                (*wrench_W)[static_cast<size_t>(row.child)] -= force * row.J_child;
              });
}

void AddElementEnergies(const Mechanism& mechanism, const BodyStates& states, Energies* energy) {
  ForElements(mechanism, states,
              [&](const auto& law, const ScalarRow& /*row*/, const AlongElement& at) {
                AddEnergy(law, at, energy);
              });
}

void AddElementPowers(const Mechanism& mechanism, const BodyStates& states, Powers* power) {
  ForElements(mechanism, states,
              [&](const auto& law, const ScalarRow& /*row*/, const AlongElement& at) {
                AddPower(law, at, power);
              });
}

RunSummary CheckRubbing(const Mechanism& mechanism, const BodyStates& states, double duration_s) {
  if (FirstFriction(mechanism).empty()) return RunSummary::Done();
  const std::vector<ScalarRow> rows = ElementRows(mechanism, states);
  for (size_t e = 0; e < rows.size(); ++e) {
    const ForceElement& element = mechanism.elements[e];
    const auto* friction = std::get_if<FrictionLaw>(&element.law);
    const double rate = RateOf(rows[e], states.V_WB);
    if (!Rubs(element)) continue;
    if (!(std::abs(rate) <= RestRate(mechanism, element, duration_s))) continue;
    const bool length = ActsOnLength(mechanism, element);
    return {
        .stop = Stop::kUnsupported,
        .message = fmt::format(
            "the {} ('{}') is at rest: its force is anywhere within ±{:g} {}, so that the "
            "drive forces are not determined",
            Described(mechanism, element), element.name, friction->breakaway, length ? "N" : "N m"),
        .where = element.name,
        .amount = rate,
        .unit = length ? "m/s" : "rad/s"};
  }
  return RunSummary::Done();
}

void AddRotorMomenta(const Mechanism& mechanism, const BodyStates& states, const MatX& R,
                     MatX* MR) {
  if (mechanism.elements.empty()) return;
  const std::vector<ScalarRow> rows = ElementRows(mechanism, states);
  for (size_t e = 0; e < rows.size(); ++e) {
    const auto* rotor = std::get_if<RotorLaw>(&mechanism.elements[e].law);
    if (rotor == nullptr) continue;
    VecX u = VecX::Zero(R.rows());
    if (rows[e].parent > 0) u.segment<6>(6 * (rows[e].parent - 1)) += rows[e].J_parent;
    if (rows[e].child > 0) u.segment<6>(6 * (rows[e].child - 1)) += rows[e].J_child;
    *MR += rotor->reflected() * u * (u.transpose() * R);
  }
}

ElementSlope SlopeOf(const ForceElement& element, double q) {
  return std::visit([q](const auto& law) { return Slope(law, q); }, element.law);
}

}  // namespace mbv::internal
