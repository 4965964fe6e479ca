// Which drives move chosen joints of a robot through its loops, and the parts that forces are
// counted in: what a serial model of these joints has, and what it leaves out.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

struct Transmission {
  std::vector<NamedCoordinate> joints;  ///< n, as chosen
  std::vector<int> drives;              ///< n that move them, by index into Mechanism::drives
  std::vector<CoordinateRange> ranges;  ///< per drive: its own, and that of its joint
  std::vector<NamedCoordinate> held;    ///< the other degrees of freedom, which stay at home
  std::vector<int> loop_bodies;         ///< that a serial model does not have: cranks and rods
  std::vector<int> toward_world;        ///< per body: joint on its way to the world, -1: none
  std::vector<bool> kept;               ///< per body: a serial model has it, or it is the world
  std::vector<std::string> notes;       ///< what is left out or taken otherwise

  /// The robot, rotors of its motors included as elements (RotorLaw) on their drives.
  Mechanism full;
  Mechanism without_rotors;  ///< the same without rotors of elements and motors
  /// Without what the loops add: loop bodies have no mass, and springs, dampers and friction act
  /// only where no loop body or drive of `drives` in a loop takes part. Along the joints it needs
  /// the forces that the robot needs with the loops cut away [virtual work].
  Mechanism serial;
  Mechanism loop_inertia;  ///< the loop bodies' masses alone: no gravity, no other forces

  [[nodiscard]] std::vector<Coordinate> coordinates() const;  ///< joints, then held
};

/// Coordinates of joints called `names`; nothing after an error: unknown, chosen twice, dependent
/// on each other, or not as many as the drives that move them. Drives too many that also move
/// joints on the way from the world to the chosen ones (a knee above an ankle) are held.
[[nodiscard]] std::optional<Transmission> FindTransmission(const Mechanism& mechanism,
                                                           const std::vector<std::string>& names,
                                                           Diagnostics* diagnostics);

/// The same robot with all that stays still, while the chosen joints move and the other degrees of
/// freedom are held, as part of the world: other legs, and the leg above an ankle. Maps, inertias
/// and forces along the joints are the same. Without outputs, contacts and beams.
[[nodiscard]] Mechanism MovingPart(const Mechanism& mechanism, const Transmission& transmission);

}  // namespace mbv
