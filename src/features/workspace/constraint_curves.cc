// Singularities inside a set, which goes on beyond: of two or three dimensions curves or surfaces
// where the joints alone lose rank [Zlatanov, Bonev, Gosselin 2002], which it passes unnoticed, and
// of three those where the drives lose their hold (type 2), where it may cross them.
//
//   e = det [A_s; Nᵀ] / (its value at the set's start)                                         (1)
//   e = det D, of type 2 (pose_space.h, 3)                                                      (2)
//
// A_s: rows of the loops (pose_space.h, 1) that are independent at home, N: the motions. N goes on
// smoothly through such a pose, A_s loses rank there, and e changes its sign. Between neighbours of
// the flooded lattice with different signs the pose where e vanishes is found along the straight
// line; nodes of one cell, or of its simplices, are joined. Poses where only the choice A_s is
// dependent are none.
#include "features/workspace/reachable_set.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "kinematics/constraints.h"

namespace mbv {
namespace {

constexpr double kIndependent = 1e-9;  // pivots below this share of the first are none
constexpr double kLessNear = 0.7;      // of the last pivot three times as near; by its slope 0.3
constexpr double kFound = 1e-10;       // of its values at two corners, where (2) vanishes

class LoopDeterminant {
 public:
  explicit LoopDeterminant(const PoseSpace& space)
      : space_(space),
        tree_(space.mechanism(), std::vector<bool>(space.mechanism().joints.size(), false)),
        spins_(IdleSpins(space.mechanism())) {
    unit_ = VecX::Ones(tree_.dofs());
    for (int k = 0; k < tree_.dofs(); ++k) {
      if (!tree_.angular()[static_cast<size_t>(k)]) unit_[k] = space.length();
    }
  }
  // The rows, and from where e counts.
  bool Begin(const PlacedPose& start) {
    const MatX A = Loops(start);
    if (A.rows() == 0) return false;
    Eigen::ColPivHouseholderQR<MatX> qr(A.transpose());
    qr.setThreshold(kIndependent);
    for (Eigen::Index k = 0; k < qr.rank(); ++k) {
      rows_.push_back(qr.colsPermutation().indices()[k]);
    }
    if (static_cast<Eigen::Index>(rows_.size()) + start.N.cols() != A.cols()) return false;
    first_ = 1.0;
    first_ = At(start);
    return std::isfinite(first_) && first_ != 0.0;
  }
  // (1)
  [[nodiscard]] double At(const PlacedPose& at) const {
    const MatX A = Loops(at);
    MatX M(A.cols(), A.cols());
    for (size_t k = 0; k < rows_.size(); ++k) M.row(static_cast<Eigen::Index>(k)) = A.row(rows_[k]);
    M.bottomRows(at.N.cols()) = at.N.transpose();
    return at.pose.side * M.partialPivLu().determinant() / first_;
  }
  // Of all rows: vanishes where they lose rank.
  [[nodiscard]] double LastPivot(const PlacedPose& at) const {
    const Eigen::ColPivHouseholderQR<MatX> qr(Loops(at).transpose());
    const auto k = static_cast<Eigen::Index>(rows_.size()) - 1;
    return std::abs(qr.matrixQR()(k, k));
  }

 private:
  [[nodiscard]] MatX Loops(const PlacedPose& at) const {
    const BodyStates states = space_.States(at.pose);
    const MatX J = tree_.Jacobian(states) * unit_.asDiagonal();
    return internal::LoopRows(space_.mechanism(), spins_, states, J, space_.length()) /
           space_.length();
  }

  const PoseSpace& space_;
  internal::TreeMotion tree_;
  std::vector<Spin> spins_;
  VecX unit_;
  std::vector<Eigen::Index> rows_;
  double first_ = 1.0;
};

// Where the polynomial through these vanishes, from 0 on.
double RootOf(const std::array<double, 6>& x, std::array<double, 6> f) {
  for (size_t order = 1; order < 6; ++order) {
    for (size_t k = 5; k >= order; --k) {
      f.at(k) = (f.at(k) - f.at(k - 1)) / (x.at(k) - x.at(k - order));
    }
  }
  double root = 0.0;
  for (int i = 0; i < 20; ++i) {
    double value = f[5], slope = 0.0;
    for (size_t k = 5; k-- > 0;) {
      slope = slope * (root - x.at(k)) + value;
      value = value * (root - x.at(k)) + f.at(k);
    }
    const double step = -value / slope;
    if (!std::isfinite(step)) return kNan;
    root += step;
    if (std::abs(step) < 1e-15) break;
  }
  return root;
}

// Corners of the flooded lattice inside a set, and where e vanishes between two of them.
class LatticeZeros {
 public:
  using Key = std::array<long, 3>;

  LatticeZeros(const SetQuestion& question, SetBound::Kind kind)
      : space_(question.mechanism, question.settings), kind_(kind), determinant_(space_) {}

  bool Begin(const ReachableSet& set) {
    PlacedPose start;
    if (!space_.Home(&start) || !space_.Place(set.start_pose, &start)) return false;
    space_.CountFrom(&start);
    if (kind_ == SetBound::Kind::kConstraint ? !determinant_.Begin(start)
                                             : !std::isfinite(start.type2)) {
      return false;
    }
    for (const FloodPoint& point : set.flooded.lattice) {
      Corner corner;
      if (!point.inside || !space_.Place(point.pose, &corner.at)) continue;
      corner.e = At(corner.at);
      Key key{};
      for (int c = 0; c < space_.over(); ++c) {
        key.at(static_cast<size_t>(c)) = std::lround(
            (point.at[c] - set.start[c]) / set.flooded.lattice_step.at(static_cast<size_t>(c)));
      }
      corners_[key] = std::move(corner);
    }
    return true;
  }
  /// The constraint singularity's own bound.
  [[nodiscard]] int bound() const {
    const auto at =
        std::ranges::find(space_.bounds(), SetBound::Kind::kConstraint, &SetBound::kind);
    return static_cast<int>(at - space_.bounds().begin());
  }
  [[nodiscard]] std::vector<Key> keys() const {
    std::vector<Key> keys;
    for (const auto& [key, corner] : corners_) keys.push_back(key);
    return keys;
  }
  /// 0 of a corner that is not inside.
  [[nodiscard]] int SignAt(const Key& key) const {
    const auto at = corners_.find(key);
    return at == corners_.end() ? 0 : at->second.e < 0.0 ? -1 : 1;
  }
  /// Each line is asked several times. Nothing where both have the same sign, or the chosen rows
  /// alone lose rank.
  const std::optional<Vec3>& Between(const Key& one, const Key& other) {
    const auto line = std::minmax(one, other);
    const auto [known, is_new] = nodes_.try_emplace({line.first, line.second});
    if (is_new) known->second = Find(line.first, line.second);
    return known->second;
  }

 private:
  struct Corner {
    PlacedPose at;
    double e = kNan;
  };

  // (1) or (2).
  [[nodiscard]] double At(const PlacedPose& at) const {
    return kind_ == SetBound::Kind::kConstraint ? determinant_.At(at) : at.type2;
  }

  [[nodiscard]] std::optional<Vec3> Find(const Key& k1, const Key& k2) const {
    const auto a = corners_.find(k1), b = corners_.find(k2);
    if (a == corners_.end() || b == corners_.end() || (a->second.e < 0.0) == (b->second.e < 0.0)) {
      return std::nullopt;
    }
    const VecX from = a->second.at.pose.at, way = b->second.at.pose.at - from;
    Vec3 node = Vec3::Zero();
    if (kind_ == SetBound::Kind::kType2) {
      double s = kNan;
      const auto e_at = [&](double share, double* e) {
        PlacedPose there;
        if (!space_.Close(a->second.at, from + share * way, &there)) return false;
        s = share;
        *e = there.type2;
        return true;
      };
      const double size = std::max(std::abs(a->second.e), std::abs(b->second.e));
      const auto enough = [&](double e, double) { return std::abs(e) <= kFound * size; };
      if (!FindCrossing(0.0, a->second.e, 1.0, b->second.e, e_at, enough)) return std::nullopt;
      node.head(space_.over()) = (from + s * way).head(space_.over());
      return node;
    }
    // On this line, from the corner on the same side; very near the curve poses do not close.
    const auto look = [&](double s, bool first, double* e, double* pivot) {
      PlacedPose there;
      const PlacedPose& near = first ? a->second.at : b->second.at;
      if (!space_.Close(near, from + s * way, &there)) return false;
      *e = determinant_.At(there);
      *pivot = determinant_.LastPivot(there);
      return std::isfinite(*e);
    };
    double e = kNan, pivot = kNan, root = a->second.e / (a->second.e - b->second.e);
    // A polynomial through three poses on each side of where it is expected, again and again.
    for (const double reach : {0.3, 0.1, 0.1}) {
      std::array<double, 6> x{}, f{};
      double near = 0.0, far = 0.0;
      for (size_t k = 0; k < 6; ++k) {
        const double share = std::array{-1.0, -0.65, -0.3, 0.3, 0.65, 1.0}.at(k);
        const double s = root + share * reach;
        x.at(k) = share * reach;
        if (!look(s, k < 3, &e, &pivot)) return std::nullopt;
        f.at(k) = e;
        if (std::abs(share) == 0.3) near += pivot;
        if (std::abs(share) == 1.0) far += pivot;
      }
      if (f[2] == f[3]) return std::nullopt;
      const double step = RootOf(x, f);
      if (!(std::abs(step) < reach)) return std::nullopt;
      root += step;
      // All rows together lose rank there, not the chosen ones alone.
      if (reach < 0.2 && std::abs(step) < 1e-3 && near > kLessNear * far) return std::nullopt;
    }
    node.head(space_.over()) = (from + root * way).head(space_.over());
    return node;
  }

  PoseSpace space_;
  const SetBound::Kind kind_;
  LoopDeterminant determinant_;
  std::map<Key, Corner> corners_;
  std::map<std::pair<Key, Key>, std::optional<Vec3>> nodes_;
};

}  // namespace

std::vector<TracedArc> ConstraintCurves(const SetQuestion& question, const ReachableSet& set) {
  LatticeZeros zeros(question, SetBound::Kind::kConstraint);
  std::vector<TracedArc> arcs;
  if (question.settings.over != 2 || !zeros.Begin(set)) return arcs;
  for (const auto& [i, j, unused] : zeros.keys()) {
    const std::array<std::optional<Vec3>, 4> sides = {
        zeros.Between({i, j, 0}, {i + 1, j, 0}), zeros.Between({i, j, 0}, {i, j + 1, 0}),
        zeros.Between({i + 1, j, 0}, {i + 1, j + 1, 0}),
        zeros.Between({i, j + 1, 0}, {i + 1, j + 1, 0})};
    TracedArc arc{zeros.bound(), {}};
    for (const auto& node : sides) {
      if (node) arc.points.emplace_back(node->head<2>());
    }
    if (arc.points.size() == 2) arcs.push_back(std::move(arc));
  }
  return arcs;
}

TriangleMesh SingularSurface(const SetQuestion& question, const ReachableSet& set,
                             SetBound::Kind kind) {
  using Key = LatticeZeros::Key;
  LatticeZeros zeros(question, kind);
  TriangleMesh mesh;
  // A set that ends at type 2 has none inside.
  const bool ends = kind == SetBound::Kind::kType2 &&
                    std::ranges::find(set.bounds, kind, &SetBound::kind) != set.bounds.end();
  if (question.settings.over != 3 || ends || !zeros.Begin(set)) return mesh;
  std::map<std::pair<Key, Key>, int> vertices;
  // The vertex between two corners, −1 without.
  const auto vertex = [&](const Key& one, const Key& other) {
    const std::optional<Vec3>& node = zeros.Between(one, other);
    if (!node) return -1;
    const auto line = std::minmax(one, other);
    const auto [known, is_new] = vertices.try_emplace({line.first, line.second}, 0);
    if (is_new) {
      known->second = static_cast<int>(mesh.vertices.size());
      mesh.vertices.push_back(*node);
    }
    return known->second;
  };
  const auto add = [&](const std::array<int, 3>& triangle) {
    if (std::ranges::min(triangle) >= 0) mesh.triangles.push_back(triangle);
  };
  for (const Key& cell : zeros.keys()) {
    // Kuhn's simplices: one per order of the coordinates.
    std::array<size_t, 3> order = {0, 1, 2};
    do {
      std::array<Key, 4> corner{cell};
      for (size_t i = 0; i < 3; ++i) {
        corner.at(i + 1) = corner.at(i);
        ++corner.at(i + 1).at(order.at(i));
      }
      std::vector<Key> below, above;
      for (const Key& key : corner) {
        const int sign = zeros.SignAt(key);
        if (sign < 0) below.push_back(key);
        if (sign > 0) above.push_back(key);
      }
      if (below.size() + above.size() < 4) continue;
      if (below.size() > above.size()) std::swap(below, above);
      if (below.size() == 1) {
        add({vertex(below[0], above[0]), vertex(below[0], above[1]), vertex(below[0], above[2])});
      } else if (below.size() == 2) {
        const int a = vertex(below[0], above[0]), b = vertex(below[0], above[1]),
                  c = vertex(below[1], above[1]), d = vertex(below[1], above[0]);
        add({a, b, c});
        add({a, c, d});
      }
    } while (std::next_permutation(order.begin(), order.end()));
  }
  return mesh;
}

}  // namespace mbv
