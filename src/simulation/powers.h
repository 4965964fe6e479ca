// Powers and energies of MuJoCo's state, and the work that the powers do over a run.
#pragma once

#include <array>

#include "simulation/constraint_system.h"
#include "simulation/loads.h"

namespace mbv::simulation {

/// What is put in by what [W].
struct Powers {
  VecX rates;  ///< WorkRates()
  double gravity = 0.0, springs = 0.0;
  double rotors = 0.0;  ///< what goes into the rotors of force elements

  /// Per driven coordinate: drives, then prescribed joints.
  [[nodiscard]] auto driven() const { return rates.head(rates.size() - 2); }
  [[nodiscard]] double loads() const { return rates[rates.size() - 2]; }
  [[nodiscard]] double dampers() const { return rates[rates.size() - 1]; }
};
/// What WorkChannels() integrates, of velocities, forces and loads last evaluated: the driven
/// coordinates, then loads and dampers [W].
void WorkRates(const ConstraintSystem& system, const Loads& loads, VecX* rates);
/// The same and what is stored.
void FindPowers(const ConstraintSystem& system, const Loads& loads, Powers* power);

/// Energies [J]; gravity's counts from the world's origin.
struct Energies {
  double kinetic = 0.0, gravity = 0.0, springs = 0.0;
};
[[nodiscard]] Energies EnergiesOf(const ConstraintSystem& system);

/// Integrates powers along the nodes of Integrator, with fourth order like the motion:
///   W_{n+1} = W_n + h/24 (9 P_{n+1} + 19 P_n − 5 P_{n−1} + P_{n−2})                           (1)
/// where it takes a multistep, else by Simpson's rule.
class WorkMeter {
 public:
  void Start(const VecX& power);
  /// The same node with another power, after a jump of the forces.
  void Jump(const VecX& power) { power_[0] = power; }
  void Middle(const VecX& power) { middle_ = power; }
  /// The step of length `h` to a node with this power.
  void Step(double h, bool multistep, const VecX& power);
  [[nodiscard]] const VecX& work() const { return work_; }

 private:
  VecX work_, middle_;
  std::array<VecX, 3> power_;  ///< at the last nodes, newest first
};

}  // namespace mbv::simulation
