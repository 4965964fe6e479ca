// The set of poses that any model reaches: what is asked, both ways to it, and whether they agree.
#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analytic/workspace_form.h"
#include "base/diagnostics.h"
#include "features/workspace/flood.h"
#include "features/workspace/trace.h"
#include "math/triangle_mesh.h"
#include "verify/run_witnesses.h"

namespace mbv {

/// As a user writes it. Coordinates are the output's x … yaw, or named as in Model::coordinates();
/// names may end in a unit (_mm, _deg).
struct SetArguments {
  std::string output;               ///< "": the first one
  std::vector<std::string> over;    ///< "x", "x_mm=-100:100"
  std::vector<std::string> at;      ///< "z=-0.165": held there; what is left stays at home
  std::vector<std::string> from;    ///< "x=0.1": a pose of the set, where home is none
  std::vector<std::string> ranges;  ///< "leg1=0.5:0.75": instead of the model's
  std::vector<std::string> cones;   ///< "ball_deg=30", "ball.x_deg=30": of the axis z, or x or y
  std::vector<std::string> for_all, for_some;  ///< "yaw_deg=-10:10": fibre.h
  double clearance = kNan;                     ///< that shapes keep [m]; NaN: they may touch
  bool cross_singularities = false;            ///< type 2 ends nothing
  FloodSettings flood;

  [[nodiscard]] bool any() const {
    return !output.empty() || !over.empty() || !at.empty() || !from.empty() || !ranges.empty() ||
           !cones.empty() || any_of_set();
  }
  /// What one pose has no use for.
  [[nodiscard]] bool any_of_set() const {
    return !cones.empty() || !for_all.empty() || !for_some.empty() || cross_singularities ||
           flood.resolution > 0;
  }
};

/// A question that can be answered.
struct SetQuestion {
  Mechanism mechanism;  ///< with the ranges of the question
  SpaceSettings settings;
  VecX start;          ///< the d coordinates of a pose of the set
  std::string output;  ///< "" where the model has none
  bool ranges_changed = false, boxed = false;
  std::vector<std::string> notes;  ///< what was taken otherwise or left out
};
/// Nothing after an error; all findings at once.
[[nodiscard]] std::optional<SetQuestion> ReadQuestion(const Mechanism& mechanism,
                                                      const SetArguments& arguments,
                                                      Diagnostics* diagnostics);

/// What ends the set, by the share of its boundary [lengths and radians as they are].
struct BoundShare {
  int bound = -1;  ///< −1: poses stop to close
  double traced = kNan, flooded = kNan;
};

struct ReachableSet {
  std::vector<std::string> over, over_units, held, held_units;  ///< "m" or "rad"
  VecX held_values, start;
  SpacePose start_pose;
  std::vector<CoordinateRange> box;
  std::vector<RangedCoordinate> ranged;  ///< of over, then held
  bool for_all = false;
  double length = kNan;  ///< characteristic [m]
  int dofs = 0, drives = 0;
  std::vector<SetBound> bounds;
  std::vector<std::string> notes;
  TracedSet traced;
  FloodedSet flooded;
  std::vector<BoundShare> shares;
  bool agree = false;
  std::string verdict;       ///< a sentence
  std::string unit;          ///< of the measure: "m³"
  std::string measure;       ///< "volume"
  size_t checked = 0;        ///< poses that the reference closed anew
  double checked_off = 0.0;  ///< largest difference of drives and outputs there
                             ///< [rad, characteristic lengths]
  size_t unchecked = 0;      ///< that it did not close
  RunSummary summary;
  Diagnostics diagnostics;
};

/// Which ways are gone: one alone is not judged.
struct SetWays {
  bool boundary = true, lattice = true;
  double share = 1e-8;  ///< of a volume, the error of its boundary
  /// How long it will take, before it begins; where that is long.
  std::function<void(const std::string&)> announce = {};
};

/// With a folder, going on with what an interrupted run of the same question left there.
[[nodiscard]] ReachableSet ComputeReachableSet(const SetQuestion& question,
                                               const SetArguments& arguments,
                                               const ProgressFunction& progress = {},
                                               const ResumeFolder* folder = nullptr,
                                               const SetWays& which = {});

/// The verdict of what both ways found.
void JudgeSet(ReachableSet* set);

/// Constraint singularities inside a set of two dimensions (constraint_curves.cc): arcs of two
/// nodes each [m or rad], within a cell of the lattice. Empty of other dimensions.
[[nodiscard]] std::vector<TracedArc> ConstraintCurves(const SetQuestion& question,
                                                      const ReachableSet& set);
/// The same of three dimensions, or where the drives lose their hold (kType2) inside a set that
/// crosses such poses: a surface of free coordinates, nodes on lines between corners of the
/// lattice.
[[nodiscard]] TriangleMesh SingularSurface(const SetQuestion& question, const ReachableSet& set,
                                           SetBound::Kind kind);

}  // namespace mbv
