// Sets of poses that hold for all, or for some, values of further coordinates: total orientation
// and inclusion orientation workspaces [Merlet, Parallel Robots, 2006, §7.1].
//
//   all:  {x : margin_i(x, φ) ≥ 0 for every bound i and every φ of the range}                 (1)
//   some: {x : margin_i(x, φ) ≥ 0 for every bound i at a φ of the range}                      (2)
//
// of the branch that is followed from home. Two ways: Fibre goes through the range at one place x
// and finds where margins are least (1), or where the least one is largest (2), by parabolas; the
// flood asks it at every corner. TraceRange() traces the boundary at values of the range and
// intersects (1), or unites (2), what is inside; the values are doubled until the measure rests. Of
// three free coordinates it does so in sections, whose areas are integrated over the third one.
#pragma once

#include <functional>

#include "features/workspace/flood.h"
#include "features/workspace/pose_space.h"
#include "features/workspace/trace.h"

namespace mbv {

class Fibre {
 public:
  /// Of the space's settings, which outlive it.
  explicit Fibre(const SpaceSettings& settings) : settings_(settings) {}
  [[nodiscard]] bool any() const { return !settings_.ranged.empty(); }

  enum class Reach {
    kNone,   ///< no pose closes
    kPart,   ///< of `all`: poses stop to close within the range
    kWhole,  ///< `all` of the range closes, or `some` of it
  };
  /// From a pose nearby to the free coordinates `x`: the pose at the range's start (all) or where
  /// it is best (some), with the margins (1) of each bound, or those at the best pose. `at_start`:
  /// the least margin where the range begins, −1 where that does not close.
  [[nodiscard]] Reach At(const PoseSpace& space, const PlacedPose& from, const VecX& x,
                         PlacedPose* at, double* at_start) const;

 private:
  struct Node;
  [[nodiscard]] Reach Scan(const PoseSpace& space, const PlacedPose& from, size_t level,
                           PlacedPose* at) const;
  [[nodiscard]] Reach Go(const PoseSpace& space, const PlacedPose& from, size_t level, double value,
                         PlacedPose* at) const;

  const SpaceSettings& settings_;
};

/// Nothing depends on the number of threads.
[[nodiscard]] TracedSet TraceRange(const PoseSpace& space, const PlacedPose& start, int threads,
                                   const std::function<void(double)>& progress = {},
                                   ResultLog log = {});

}  // namespace mbv
