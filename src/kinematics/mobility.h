// Mobility by rank: degrees of freedom, redundant constraints, and what the drives determine.
#pragma once

#include <string>
#include <vector>

#include "mechanism/body_states.h"
#include "mechanism/mechanism.h"

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
  int freedoms = 0;   ///< body_coordinates − constraint_rank − idle spins
  int redundant = 0;  ///< constraint_rows − constraint_rank
  int kutzbach = 0;   ///< body_coordinates − constraint_rows − idle spins
  int drives = 0, prescribed = 0;
  int undriven = 0;  ///< freedoms left with all drives and prescribed joints locked
  bool drives_determine_motion = false;  ///< undriven == 0
  bool drive_forces_unique = false;      ///< no self-stress of the locked mechanism acts on a drive
  std::vector<std::string> drives_not_unique;
  std::vector<std::string> joints_not_unique;  ///< joints with a reaction component that is not
                                               ///< unique (isostatic rule applied)
  std::vector<UndeterminedReaction> reactions_not_unique;  ///< which components
  /// The isostatic rule releases reactions only, not motions: the reaction rows have the rank of
  /// the true rows. False means a joint that transmits a force only was wrongly declared so.
  bool isostatic_rule_sound = false;
  double smallest_kept = 0.0;    ///< smallest singular value counted (column-scaled)
  double largest_dropped = 0.0;  ///< largest singular value counted as zero
};

/// Mobility at the given body poses (the home pose by default).
/// Only `freedoms` of it, for a quarter of the time and less.
[[nodiscard]] int CountFreedoms(const Mechanism& mechanism);
/// The same with the idle spins.
[[nodiscard]] int CountAllFreedoms(const Mechanism& mechanism);
[[nodiscard]] Mobility AnalyseMobility(const Mechanism& mechanism);
[[nodiscard]] Mobility AnalyseMobility(const Mechanism& mechanism, const BodyStates& states);

/// Channels ("hinge.reaction.fz") of the reaction components that are not unique at home or at some
/// of the given poses (per sample, per body), a few of which are looked at. A component may be
/// unique at one pose only.
[[nodiscard]] std::vector<std::string> ReactionsNotUnique(
    const Mechanism& mechanism, const std::vector<std::vector<Pose>>& X_WB);

}  // namespace mbv
