// A set of poses by flooding: a lattice of the free coordinates, from corner to neighbouring
// corner.
//
// A corner belongs to the set where the pose closes, from a neighbour that does, with all margins
// positive; two poses of one corner are a contradiction. Cells with corners on both sides are
// halved some times, and so are their neighbours that a finer corner shows to be cut; the last ones
// are divided into simplices whose edges are cut where the first margin vanishes. What lies inside
// is summed up. The error is what the last halving changed, of second order, or half of the one
// before.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "base/run_summary.h"
#include "features/workspace/pose_space.h"
#include "math/resume.h"

namespace mbv {

struct FloodSettings {
  int resolution = 0;      ///< finest cells across the set, about; 0: by its dimension
  int halvings = 2;        ///< of cells at the boundary, 1 … 4
  int threads = 1;         ///< nothing depends on it
  double most_s = 1200.0;  ///< an estimate beyond refuses
  const std::atomic<bool>* in_vain = nullptr;  ///< once true, the result has no use
};

/// A triangle (3-D), line (2-D) or point (1-D) of the boundary.
struct FloodFacet {
  std::array<int, 3> vertices{-1, -1, -1};
};
struct FloodVertex {
  Vec3 at = Vec3::Zero();  ///< free coordinates; others 0
  int bound = -1;          ///< that ends the set there; −1: the loops do not close
};
struct FloodPoint {
  Vec3 at = Vec3::Zero();
  bool inside = false;
  int bound = -1;  ///< of those outside
  SpacePose pose;  ///< of those inside
};

struct FloodedSet {
  RunSummary summary;
  std::array<double, 3> step{};  ///< finest spacing per free coordinate
  double measure = kNan;         ///< length, area or volume
  double error = kNan;           ///< what the last halving changed
  std::vector<double> levels;    ///< measures from the coarsest lattice on
  std::vector<FloodVertex> vertices;
  std::vector<FloodFacet> facets;   ///< of the finest cells; outward
  std::vector<FloodPoint> lattice;  ///< coarsest corners, the first coordinate fastest
  std::array<double, 3> lattice_step{};
  long corners = 0, inside = 0, closings = 0, conflicts = 0;
  Vec3 conflict_at =
      Vec3::Zero();               ///< of the conflict nearest to a constraint singularity, and its
  double conflict_margin = kNan;  ///< margin: what loops hold with by what they do at home
  double wall_s = 0.0;
};

/// The spacing by how far the set reaches along the coordinates from home, how long it takes and
/// how much it keeps; kUnsupported where that is too much, kUnreachable without an end.
struct FloodPlan {
  RunSummary summary;
  std::array<double, 3> step{};
  double estimate_s = kNan;
  double closing_s = kNan;     ///< of one pose, by one thread
  double most_corners = kNan;  ///< that 2 GiB hold
};
[[nodiscard]] FloodPlan PlanFlood(const PoseSpace& space, const PlacedPose& home,
                                  const FloodSettings& settings);

[[nodiscard]] FloodedSet FloodSet(const PoseSpace& space, const PlacedPose& home,
                                  const FloodSettings& settings, const FloodPlan& plan,
                                  const std::function<void(double)>& progress = {},
                                  ResultLog log = {});

}  // namespace mbv
