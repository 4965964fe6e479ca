// Gaps between bodies by their shapes, for poses that end where two bodies touch.
//
// Shapes are convex hulls of points with a radius: balls and capsules as they are, a cylinder as
// the capsule around it, boxes, and of a mesh its convex hull. The distance of two hulls is that of
// the origin from the hull of all differences [Gilbert, Johnson, Keerthi 1988]; of two segments it
// is known in closed form [Ericson 2005, §5.1.9]. Hulls that overlap have the distance 0.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

struct ConvexShape {
  int body = 0;
  std::vector<Vec3> points;  ///< in the body frame [m]
  double radius = 0.0;       ///< [m]
};

/// Distance of two shapes [m]; where their cores overlap, less by at most both radii than 0.
[[nodiscard]] double GapOf(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b,
                           const Pose& X_WB);

/// All pairs of shapes of bodies that no joint connects.
struct ShapePairs {
  std::vector<ConvexShape> shapes;
  std::vector<std::pair<size_t, size_t>> pairs;
  std::vector<std::string> names;     ///< of the pairs: "arm to post"
  std::vector<std::string> touching;  ///< pairs of bodies nearer than the clearance at home:
                                      ///< none of their shapes is a pair
};
/// `clearance` [m], > 0.
[[nodiscard]] ShapePairs PairsOfShapes(const Mechanism& mechanism, double clearance);

}  // namespace mbv
