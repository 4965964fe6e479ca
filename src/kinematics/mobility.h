// Mobility by rank: DOFs, redundant constraints, and what the drives determine.
#pragma once

#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// A reaction with components that statics does not determine (isostatic rule applied).
struct UndeterminedReaction {
  std::string joint;
  std::vector<std::string> components;  ///< of "fx" … "mz", in the joint frame F, about M's origin
};

struct Mobility {
  int body_coordinates = 0;  ///< 6 × moving bodies
  int constraint_rows = 0;   ///< scalar constraints of joints (true kinds) and couplings
  int constraint_rank = 0;
  std::vector<std::string> idle_spins = {};  ///< names (mechanism/idle_spins.h)
  int dofs = 0;       ///< body_coordinates − constraint_rank − idle spins
  int redundant = 0;  ///< constraint_rows − constraint_rank
  int kutzbach = 0;   ///< body_coordinates − constraint_rows − idle spins
  int drives = 0, prescribed = 0;
  int undriven = 0;  ///< DOFs left with all drives and prescribed joints locked
  std::vector<std::string> drives_not_unique;  ///< drives on which a self-stress of the locked
                                               ///< mechanism acts
  std::vector<std::string> joints_not_unique;  ///< joints with a reaction component that is not
                                               ///< unique (isostatic rule applied)
  std::vector<UndeterminedReaction> reactions_not_unique;  ///< which components
  /// The isostatic rule releases reactions only, not motions: the reaction rows have the rank of
  /// the true rows. False means a joint that transmits a force only was wrongly declared so.
  bool isostatic_rule_sound = false;
  double smallest_kept = 0.0;    ///< smallest singular value counted (column-scaled)
  double largest_dropped = 0.0;  ///< largest singular value counted as zero
};

/// Only the home pose's `dofs`, for a quarter of the time and less.
[[nodiscard]] int CountDofs(const Mechanism& mechanism);
/// The same with the idle spins.
[[nodiscard]] int CountAllDofs(const Mechanism& mechanism);
/// CountAllDofs(), and what it would be with the rows that transmit reactions only.
struct IsostaticDofs {
  int dofs = 0, as_balls = 0;
};
[[nodiscard]] IsostaticDofs CountIsostaticDofs(const Mechanism& mechanism);
/// Mobility at the given body poses (the home pose by default).
[[nodiscard]] Mobility AnalyseMobility(const Mechanism& mechanism);
[[nodiscard]] Mobility AnalyseMobility(const Mechanism& mechanism, const BodyStates& states);

/// Channels ("hinge.reaction.fz") of the reaction components that are not unique at home or at some
/// of the given poses (per sample, per body), a few of which are looked at. A component may be
/// unique at one pose only.
[[nodiscard]] std::vector<std::string> ReactionsNotUnique(
    const Mechanism& mechanism, const std::vector<std::vector<Pose>>& X_WB);

// What a model's joints, loops and drives determine, by name: DOFs at home and nearby,
// redundant constraints by the loops that share them, which forces statics determine, and why not.

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
  int joint_dofs = 0;
  int screw_rank = 0;  ///< order of the loop: 3 for a planar or spherical one, 6 for a general one
};

struct MobilityReport {
  Mobility home;
  /// At random poses nearby that close the loops. A rank that grows there shows a singular home.
  std::vector<Mobility> nearby;
  double nearby_step = 0.0;  ///< how far the DOFs were moved [rad, or characteristic lengths]

  std::vector<LoopCount> loops;
  std::vector<StressGroup> redundant;  ///< of the true joints alone; counts add up to `redundant`
  std::vector<StressGroup> undetermined;  ///< isostatic rule applied, drives and base motion locked
  /// Bodies that can still move with drives and prescribed joints locked, at home.
  std::vector<std::string> free_bodies;
  /// Spins between two balls that are DOFs, each with the reason.
  std::vector<std::string> spins_not_idle = {};

  /// The fewest DOFs (undriven DOFs, redundant constraints) of all poses: those of a
  /// general pose.
  [[nodiscard]] int dofs() const;
  [[nodiscard]] int undriven() const;
  [[nodiscard]] int redundant_count() const;
  /// The joints alone lose rank at home.
  [[nodiscard]] bool home_singular() const { return home.dofs > dofs(); }
  /// The drives lose their hold on the motion at home, but not nearby.
  [[nodiscard]] bool drives_singular() const {
    return !home_singular() && home.undriven > undriven();
  }
};

/// Ranks at home and at up to `poses` random poses nearby (fixed seed).
[[nodiscard]] MobilityReport ReportMobility(const Mechanism& mechanism, int poses = 5);

// The loops of the spanning tree, one per closure.

/// Joints around each loop, their DOFs, and the rank of their screws at home.
[[nodiscard]] std::vector<LoopCount> CountLoops(const Mechanism& mechanism);

// Which loops hang together.

/// Loops that share joints of the spanning tree, directly or by others.
struct LoopGroup {
  std::vector<int> closures;  ///< joints that close them
  std::vector<int> joints;    ///< tree joints around them, inboard first
};

/// The groups of the spanning tree (BuildSpanningTree first), in the order of their first closure.
[[nodiscard]] std::vector<LoopGroup> LoopGroups(const Mechanism& mechanism);

}  // namespace mbv
