// How large the forces of force elements are in a motion, for the force scale.
#pragma once

#include <functional>
#include <vector>

#include "core/types.h"
#include "mechanism/mechanism.h"

namespace mbv::internal {

/// A driven coordinate: twists of all bodies per its unit rate at home, and RMS rates.
struct DrivenSize {
  const std::vector<Vec6>* V_WB = nullptr;
  double velocity = 0.0, acceleration = 0.0;
};

/// Of the motion.
struct MotionSize {
  double duration_s = 0.0;
  double most_energy_J = 0.0;  ///< largest energy in springs
};

/// Of one force element.
struct ElementSize {
  std::vector<double> rate;  ///< of its coordinate per unit rate of each driven coordinate
  double force = 0.0;        ///< along its coordinate [N or N m]
};

/// Per element: dampers at the RMS rates, rotors at the RMS accelerations, springs at home and as
/// far away as they can get in the time or by the energy that springs store.
[[nodiscard]] std::vector<ElementSize> SizesOfElements(const Mechanism& mechanism,
                                                       const std::vector<DrivenSize>& driven,
                                                       const MotionSize& motion);

}  // namespace mbv::internal
