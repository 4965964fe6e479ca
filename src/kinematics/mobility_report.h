// What a model's joints, loops and drives determine, by name: freedoms at home and nearby,
// redundant constraints by the loops that share them, which forces statics determine, and why not.
#pragma once

#include <string>
#include <vector>

#include "kinematics/mobility.h"

namespace mbv {

/// Joints and drives that hold each other: the part of the mechanism a self-stress (forces in
/// balance among themselves) acts on. Groups share no joint.
struct StressGroup {
  int count = 0;  ///< independent self-stresses = constraints too many
  std::vector<std::string> joints, drives, prescribed, couplings = {};
};

/// A loop of the spanning tree: the joint that closes it and the tree joints around it.
struct LoopCount {
  std::string closure;
  std::vector<std::string> joints;  ///< in order around the loop, closure last
  int joint_freedoms = 0;
  int screw_rank = 0;  ///< order of the loop: 3 for a planar or spherical one, 6 for a general one
};

struct MobilityReport {
  Mobility home;
  /// At random poses nearby that close the loops. A rank that grows there shows a singular home.
  std::vector<Mobility> nearby;
  double nearby_step = 0.0;  ///< how far the freedoms were moved [rad, or characteristic lengths]

  std::vector<LoopCount> loops;
  std::vector<StressGroup> redundant;  ///< of the true joints alone; counts add up to `redundant`
  std::vector<StressGroup> undetermined;  ///< isostatic rule applied, drives and base motion locked
  /// Bodies that can still move with drives and prescribed joints locked, at home.
  std::vector<std::string> free_bodies;
  /// Spins between two balls that are freedoms, each with the reason.
  std::vector<std::string> spins_not_idle = {};

  /// The fewest freedoms (undriven freedoms, redundant constraints) of all poses: those of a
  /// general pose.
  [[nodiscard]] int freedoms() const;
  [[nodiscard]] int undriven() const;
  [[nodiscard]] int redundant_count() const;
  /// The joints alone lose rank at home.
  [[nodiscard]] bool home_singular() const { return home.freedoms > freedoms(); }
  /// The drives lose their hold on the motion at home, but not nearby.
  [[nodiscard]] bool drives_singular() const {
    return !home_singular() && home.undriven > undriven();
  }
};

/// Ranks at home and at up to `poses` random poses nearby (fixed seed).
[[nodiscard]] MobilityReport ReportMobility(const Mechanism& mechanism, int poses = 5);

}  // namespace mbv
