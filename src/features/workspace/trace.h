// A set of poses by its boundary: traced bound by bound, and integrated by quadrature.
//
// Two dimensions: from a pose inside, straight rays end at bounds; each bound's curve
// {margin_i = 0} is followed on the manifold of poses (so that folds, type 1, are regular curves)
// to the corner where another margin vanishes, and on along that, until the loop closes. Each step
// is a polynomial of degree 8 in its Chebyshev nodes, every node and corner a solution of the
// closure to 1e-12; the area is ½ ∮ x dy − y dx [Green]. Chords from the boundary inwards look for
// further loops: other rims, holes. Three dimensions: areas of sections, integrated by adaptive
// Gauss–Kronrod rules between the lowest and the highest pose. One: the two ends of a path.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/run_summary.h"
#include "features/workspace/pose_space.h"
#include "math/resume.h"

namespace mbv {

/// A piece of the boundary on one bound.
struct TracedArc {
  int bound = -1;                       ///< of PoseSpace::bounds()
  std::vector<Eigen::Vector2d> points;  ///< of the free coordinates [m or rad]
};
struct TracedLoop {
  std::vector<TracedArc> arcs;
  bool closed = false;
  double area = 0.0;   ///< signed: negative around a hole
  double error = 0.0;  ///< by the last Chebyshev coefficients
};
struct TracedSection {
  double height = kNan;  ///< the third coordinate; NaN of a set in two dimensions
  double area = 0.0, error = 0.0;
  std::vector<TracedLoop> loops;
};

struct TracedSet {
  RunSummary summary;
  double measure = kNan, error = kNan;       ///< length, area or volume
  std::vector<TracedSection> sections;       ///< by height; of one dimension none
  std::vector<std::pair<double, int>> ends;  ///< of one dimension: coordinate, bound
  std::vector<std::string> gone;             ///< sections without a boundary, and why; the slabs
                                             ///< about them count as error
  std::vector<SpacePose> inside;             ///< some poses that belong to it
  double low = kNan, high = kNan;            ///< of three dimensions: the third coordinate
  long closings = 0;
  double wall_s = 0.0;
};

/// See math/bytes.h.
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<TracedArc>& arc) {
  visit(arc.bound), visit(arc.points);
}
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<TracedLoop>& loop) {
  visit(loop.arcs), visit(loop.closed), visit(loop.area), visit(loop.error);
}
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<TracedSection>& section) {
  visit(section.height), visit(section.area), visit(section.error), visit(section.loops);
}
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<TracedSet>& set) {
  visit(set.summary), visit(set.measure), visit(set.error), visit(set.sections), visit(set.ends);
  visit(set.inside), visit(set.low), visit(set.high), visit(set.closings), visit(set.wall_s);
  visit(set.gone);
}

/// Poses that a volume's boundary closes, about, before it has the error that it has.
inline constexpr long kEnoughClosings = 1000000;

/// From a home pose inside all bounds; volumes until their error is this share of them, or a
/// million poses are closed (six, while it is above a thousandth). Nothing depends on the number of
/// threads.
[[nodiscard]] TracedSet TraceSet(const PoseSpace& space, const PlacedPose& home,
                                 const std::function<void(double)>& progress = {},
                                 double share = 1e-8, int threads = 1, ResultLog log = {});

/// work(i) for all i below `count`, on as many threads.
void OnThreads(size_t count, int threads, const std::function<void(size_t)>& work);
/// Of one or two dimensions, from several poses inside; with a height a solid's section.
[[nodiscard]] TracedSet TraceFrom(const PoseSpace& space, const std::vector<PlacedPose>& inside,
                                  double height = kNan);
/// Where a straight way of the free coordinates leaves the set; nothing where it is lost or has no
/// end.
[[nodiscard]] std::optional<SpacePose> EndOfWay(const PoseSpace& space, const PlacedPose& from,
                                                const VecX& ray);
/// The curve with `finer` points for each of its own, by its polynomials.
[[nodiscard]] TracedArc Resampled(const TracedArc& arc, int finer);

/// Curves of two dimensions on which the margin of a bound vanishes, within all the others: from
/// pairs of poses on both sides of it, the first one where it is positive.
[[nodiscard]] std::vector<TracedArc> TraceInside(
    const PoseSpace& space, int bound, const std::vector<std::pair<SpacePose, SpacePose>>& across);

}  // namespace mbv
