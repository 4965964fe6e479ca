#include "model_file/mesh/mass_properties.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <numeric>
#include <unordered_map>

namespace mbv {
namespace {

// Sums over pieces: amount, first and second moments about a point near the mesh.
struct Moments {
  double amount = 0.0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();
};

Vec3 MiddleOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : mesh.vertices) box.extend(p);
  return box.isEmpty() ? Vec3(Vec3::Zero()) : Vec3(box.center());
}

MassShape ShapeOf(const Moments& m, const Vec3& origin) {
  const Vec3 c = m.first / m.amount;
  const Mat3 C = m.second / m.amount - c * c.transpose();
  return {std::abs(m.amount), origin + c, C.trace() * Mat3::Identity() - C};
}

}  // namespace

MassShape SolidShape(const TriangleMesh& mesh) {
  const Vec3 origin = MiddleOf(mesh);  // far from the origin, the moments would cancel
  Moments sum;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin,
               c = mesh.vertices[t[2]] - origin, s = a + b + c;
    const double V = a.dot(b.cross(c)) / 6.0;
    sum.amount += V;
    sum.first += V / 4.0 * s;
    sum.second +=
        V / 20.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
  return ShapeOf(sum, origin);
}

MassShape ShellShape(const TriangleMesh& mesh) {
  const Vec3 origin = MiddleOf(mesh);
  Moments sum;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin,
               c = mesh.vertices[t[2]] - origin, s = a + b + c;
    const double A = 0.5 * (b - a).cross(c - a).norm();
    sum.amount += A;
    sum.first += A / 3.0 * s;
    sum.second +=
        A / 12.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
  return ShapeOf(sum, origin);
}

Mat3 PointInertia(const Vec3& p) { return p.squaredNorm() * Mat3::Identity() - p * p.transpose(); }

namespace {

using Cell = std::array<std::int64_t, 3>;

struct CellHash {
  size_t operator()(const Cell& cell) const {
    std::uint64_t hash = 14695981039346656037ULL;
    for (const std::int64_t k : cell)
      hash = (hash ^ static_cast<std::uint64_t>(k)) * 1099511628211ULL;
    return hash ^ (hash >> 29U);
  }
};

// Gives each point the number of the first one within a tolerance.
class PointSet {
 public:
  PointSet(double tolerance, const Vec3& origin) : tolerance_(tolerance), origin_(origin) {}

  int Add(const Vec3& p) {
    const int known = Find(p);
    if (known >= 0) return known;
    points_.push_back(p);
    const int index = static_cast<int>(points_.size()) - 1;
    cells_[CellOf(p, {0, 0, 0})].push_back(index);
    return index;
  }
  [[nodiscard]] const std::vector<Vec3>& points() const { return points_; }

 private:
  // Equal numbers share the bits of their sum with zero, which makes -0 into 0.
  [[nodiscard]] Cell CellOf(const Vec3& p, const Cell& shift) const {
    Cell cell{};
    for (int k = 0; k < 3; ++k) {
      if (tolerance_ > 0.0) {
        cell[k] = std::llround(std::floor((p[k] - origin_[k]) / (2.0 * tolerance_))) + shift[k];
      } else {
        const double value = p[k] + 0.0;
        std::memcpy(&cell[k], &value, sizeof value);
      }
    }
    return cell;
  }

  [[nodiscard]] int Find(const Vec3& p) const {
    const std::int64_t reach = tolerance_ > 0.0 ? 1 : 0;
    for (std::int64_t x = -reach; x <= reach; ++x) {
      for (std::int64_t y = -reach; y <= reach; ++y) {
        for (std::int64_t z = -reach; z <= reach; ++z) {
          const auto cell = cells_.find(CellOf(p, {x, y, z}));
          if (cell == cells_.end()) continue;
          for (const int index : cell->second) {
            if ((points_[index] - p).norm() <= tolerance_) return index;
          }
        }
      }
    }
    return -1;
  }

  double tolerance_;
  Vec3 origin_;
  std::vector<Vec3> points_;
  std::unordered_map<Cell, std::vector<int>, CellHash> cells_;
};

// The triangles of a mesh with those vertices only that they use; `numbers` has -1 for each of
// these, and afterwards their new numbers.
TriangleMesh WithUsedVertices(const std::vector<Vec3>& vertices,
                              const std::vector<std::array<int, 3>>& triangles,
                              std::vector<int>* numbers) {
  TriangleMesh used;
  std::vector<int>& index = *numbers;
  for (std::array<int, 3> triangle : triangles) {
    for (int& corner : triangle) {
      if (index[corner] < 0) {
        index[corner] = static_cast<int>(used.vertices.size());
        used.vertices.push_back(vertices[corner]);
      }
      corner = index[corner];
    }
    used.triangles.push_back(triangle);
  }
  return used;
}

}  // namespace

TriangleMesh Welded(const TriangleMesh& mesh, double tolerance) {
  PointSet set(tolerance, mesh.vertices.empty() ? Vec3(Vec3::Zero()) : mesh.vertices[0]);
  std::vector<int> index;
  index.reserve(mesh.vertices.size());
  for (const Vec3& p : mesh.vertices) index.push_back(set.Add(p));
  std::vector<std::array<int, 3>> triangles;
  for (const auto& t : mesh.triangles) {
    const std::array<int, 3> moved{index[t[0]], index[t[1]], index[t[2]]};
    if (moved[0] != moved[1] && moved[1] != moved[2] && moved[2] != moved[0]) {
      triangles.push_back(moved);
    }
  }
  std::vector<int> numbers(set.points().size(), -1);
  return WithUsedVertices(set.points(), triangles, &numbers);
}

double DiagonalOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : mesh.vertices) box.extend(p);
  return box.isEmpty() ? 0.0 : box.diagonal().norm();
}

size_t OpenEdges(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> balance;  // of edges from the lower to the higher vertex
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  size_t open = 0;
  for (const auto& [edge, count] : balance) open += static_cast<size_t>(std::abs(count));
  return open;
}

std::vector<TriangleMesh> PartsOf(const TriangleMesh& mesh) {
  // Union-find over vertices.
  std::vector<int> root(mesh.vertices.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&root](int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const auto& t : mesh.triangles) {
    root[find(t[1])] = find(t[0]);
    root[find(t[2])] = find(t[0]);
  }
  std::map<int, std::vector<std::array<int, 3>>> triangles;
  for (const auto& t : mesh.triangles) triangles[find(t[0])].push_back(t);
  std::vector<TriangleMesh> parts;
  parts.reserve(triangles.size());
  std::vector<int> numbers(mesh.vertices.size(), -1);  // parts share no vertex: one list for all
  for (const auto& [vertex, of_part] : triangles) {
    parts.push_back(WithUsedVertices(mesh.vertices, of_part, &numbers));
  }
  return parts;
}

}  // namespace mbv
