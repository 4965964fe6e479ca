#include "features/workspace/interference.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

namespace mbv {
namespace {

constexpr int kMostSupports = 64;
constexpr double kNoNearer = 1e-15;  // of a squared distance

ConvexShape ShapeOf(const Shape& shape, int body) {
  ConvexShape result{.body = body, .points = {}};
  const auto line = [&](const auto& rod) {
    result.points = {rod.p_from, rod.p_to};
    result.radius = rod.radius;
  };
  struct Visitor {
    const decltype(line)& of_line;
    ConvexShape& result;
    void operator()(const Capsule& rod) const { of_line(rod); }
    void operator()(const Cylinder& rod) const { of_line(rod); }
    void operator()(const Ball& ball) const {
      result.points = {ball.p_centre};
      result.radius = ball.radius;
    }
    void operator()(const Box& box) const {
      for (int k = 0; k < 8; ++k) {
        const Vec3 sign((k & 1) != 0 ? 0.5 : -0.5, (k & 2) != 0 ? 0.5 : -0.5,
                        (k & 4) != 0 ? 0.5 : -0.5);
        result.points.emplace_back(box.X_BG * sign.cwiseProduct(box.size));
      }
    }
    void operator()(const Mesh& mesh) const {
      for (const Vec3& p : mesh.surface->vertices) result.points.emplace_back(mesh.X_BG * p);
    }
  };
  std::visit(Visitor{line, result}, shape.geometry);
  return result;
}

// Of two segments, either of which may be a point.
double SegmentGap(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  const Vec3 u = a.back() - a.front(), v = b.back() - b.front(), r = a.front() - b.front();
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), ur = u.dot(r),
               vr = v.dot(r), det = uu * vv - uv * uv;
  double s = det > 1e-14 * uu * vv ? std::clamp((uv * vr - ur * vv) / det, 0.0, 1.0) : 0.0;
  double t = vv > 0.0 ? (uv * s + vr) / vv : 0.0;
  if (vv == 0.0 || t < 0.0 || t > 1.0) {
    t = std::clamp(t, 0.0, 1.0);
    s = uu > 0.0 ? std::clamp((uv * t - ur) / uu, 0.0, 1.0) : 0.0;
  }
  return (r + s * u - t * v).norm();
}

// The origin's nearest point in the hull of up to four points; keeps the points that span it.
Vec3 Nearest(std::array<Vec3, 4>* points, int* count) {
  using Edges = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3>;
  double least = std::numeric_limits<double>::infinity();
  Vec3 nearest = (*points)[0];
  unsigned best = 1;
  // The point that came last is one of them.
  const unsigned last = 1U << static_cast<unsigned>(*count - 1);
  for (unsigned set = last; set < 2 * last; ++set) {
    std::array<const Vec3*, 4> of{};
    int n = 0;
    for (size_t k = 0; k < 4; ++k) {
      if ((set >> k & 1U) != 0) of.at(static_cast<size_t>(n++)) = &points->at(k);
    }
    Vec3 at = *of[0];
    if (n > 1) {
      Edges E(3, n - 1);
      for (int k = 1; k < n; ++k) E.col(k - 1) = *of.at(static_cast<size_t>(k)) - *of[0];
      const Eigen::ColPivHouseholderQR<Edges> qr(E);
      if (qr.rank() < n - 1) continue;
      const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> share = qr.solve(-*of[0]);
      if (share.minCoeff() < 0.0 || share.sum() > 1.0) continue;
      at += E * share;
    }
    if (at.squaredNorm() >= least) continue;
    least = at.squaredNorm();
    nearest = at;
    best = set;
  }
  int kept = 0;
  for (int k = 0; k < *count; ++k) {
    if ((best >> static_cast<unsigned>(k) & 1U) == 0) continue;
    const Vec3 p = points->at(static_cast<size_t>(k));
    points->at(static_cast<size_t>(kept++)) = p;
  }
  *count = kept;
  return nearest;
}

}  // namespace

double GapOf(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB) {
  const Pose X_AB = X_WA.inverse(Eigen::Isometry) * X_WB;
  std::vector<Vec3> other;
  other.reserve(b.points.size());
  for (const Vec3& p : b.points) other.emplace_back(X_AB * p);
  const double radii = a.radius + b.radius;
  if (a.points.size() <= 2 && other.size() <= 2) return SegmentGap(a.points, other) - radii;
  const auto farthest = [](const std::vector<Vec3>& points, const Vec3& way) {
    const Vec3* best = points.data();
    double most = best->dot(way);
    for (const Vec3& p : points) {
      if (const double along = p.dot(way); along > most) {
        most = along;
        best = &p;
      }
    }
    return *best;
  };
  Vec3 v = a.points[0] - other[0];
  const double size = v.squaredNorm();
  std::array<Vec3, 4> simplex;
  simplex[0] = v;
  int count = 1;
  for (int i = 0; i < kMostSupports; ++i) {
    const Vec3 w = farthest(a.points, -v) - farthest(other, v);
    if (v.squaredNorm() - v.dot(w) <= kNoNearer * size) break;
    if (std::find(simplex.begin(), simplex.begin() + count, w) != simplex.begin() + count) break;
    simplex.at(static_cast<size_t>(count++)) = w;
    v = Nearest(&simplex, &count);
    if (count == 4) return -radii;  // the origin is inside
  }
  return v.norm() - radii;
}

ShapePairs PairsOfShapes(const Mechanism& mechanism, double clearance) {
  ShapePairs result;
  for (size_t body = 0; body < mechanism.bodies.size(); ++body) {
    for (const Shape& shape : mechanism.bodies[body].shapes) {
      result.shapes.push_back(ShapeOf(shape, static_cast<int>(body)));
    }
  }
  std::set<std::pair<int, int>> joined;
  for (const Joint& joint : mechanism.joints) {
    joined.insert(std::minmax(joint.parent, joint.child));
  }
  const auto gap = [&](const ConvexShape& a, const ConvexShape& b) {
    return GapOf(a, mechanism.X_WB_home[static_cast<size_t>(a.body)], b,
                 mechanism.X_WB_home[static_cast<size_t>(b.body)]);
  };
  const auto for_each_pair = [&](const auto& f) {
    for (size_t i = 0; i < result.shapes.size(); ++i) {
      for (size_t j = i + 1; j < result.shapes.size(); ++j) {
        const int a = result.shapes[i].body, b = result.shapes[j].body;
        if (a != b && !joined.contains(std::minmax(a, b))) f(i, j, std::pair(a, b));
      }
    }
  };
  const auto name = [&](const std::pair<int, int>& bodies) {
    return mechanism.bodies[static_cast<size_t>(bodies.first)].name + " to " +
           mechanism.bodies[static_cast<size_t>(bodies.second)].name;
  };
  std::set<std::pair<int, int>> touching;
  for_each_pair([&](size_t i, size_t j, const std::pair<int, int>& bodies) {
    if (gap(result.shapes[i], result.shapes[j]) <= clearance) touching.insert(bodies);
  });
  for (const std::pair<int, int>& bodies : touching) result.touching.push_back(name(bodies));
  for_each_pair([&](size_t i, size_t j, const std::pair<int, int>& bodies) {
    if (touching.contains(bodies)) return;
    result.pairs.emplace_back(i, j);
    result.names.push_back(name(bodies));
  });
  return result;
}

}  // namespace mbv
