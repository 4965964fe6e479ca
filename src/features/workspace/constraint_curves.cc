// Constraint singularities inside a set of two dimensions: curves where the joints alone lose rank
// [Zlatanov, Bonev, Gosselin 2002], which the set passes unnoticed.
//
//   e = det [A_s; Nᵀ] / (its value at the set's start)                                         (1)
//
// A_s: rows of the loops (pose_space.h, 1) that are independent at home, N: the motions. N goes on
// smoothly through such a pose, A_s loses rank there, and e changes its sign. Between neighbours of
// the flooded lattice with different signs the pose where e vanishes is found along the straight
// line; nodes of one cell are joined. Poses where only the choice A_s is dependent are none.
#include "features/workspace/reachable_set.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "kinematics/constraints.h"

namespace mbv {
namespace {

constexpr double kIndependent = 1e-9;  // pivots below this share of the first are none
constexpr double kLessNear = 0.7;      // of the last pivot three times as near; by its slope 0.3

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

}  // namespace

std::vector<TracedArc> ConstraintCurves(const SetQuestion& question, const ReachableSet& set) {
  PoseSpace space(question.mechanism, question.settings);
  const auto bound =
      std::ranges::find(space.bounds(), SetBound::Kind::kConstraint, &SetBound::kind);
  PlacedPose start;
  if (question.settings.over != 2 || bound == space.bounds().end() || !space.Home(&start) ||
      !space.Place(set.start_pose, &start)) {
    return {};
  }
  space.CountFrom(&start);
  LoopDeterminant determinant(space);
  if (!determinant.Begin(start)) return {};
  struct Corner {
    PlacedPose at;
    double e = kNan;
  };
  using Key = std::pair<long, long>;
  std::map<Key, Corner> corners;
  const auto& step = set.flooded.lattice_step;
  for (const FloodPoint& point : set.flooded.lattice) {
    Corner corner;
    if (!point.inside || !space.Place(point.pose, &corner.at)) continue;
    corner.e = determinant.At(corner.at);
    corners[{std::lround((point.at[0] - set.start[0]) / step[0]),
             std::lround((point.at[1] - set.start[1]) / step[1])}] = std::move(corner);
  }
  // The node between two corners; each line is asked twice.
  std::map<std::pair<Key, Key>, std::optional<Eigen::Vector2d>> nodes;
  const auto between = [&](const Key& k1, const Key& k2) {
    const auto known = nodes.find({k1, k2});
    if (known != nodes.end()) return known->second;
    std::optional<Eigen::Vector2d>& node = nodes[{k1, k2}];
    const auto a = corners.find(k1), b = corners.find(k2);
    if (a == corners.end() || b == corners.end() || (a->second.e < 0.0) == (b->second.e < 0.0)) {
      return node;
    }
    const VecX from = a->second.at.pose.at, way = b->second.at.pose.at - from;
    // On this line, from the corner on the same side; very near the curve poses do not close.
    const auto look = [&](double s, bool first, double* e, double* pivot) {
      PlacedPose there;
      const PlacedPose& near = first ? a->second.at : b->second.at;
      if (!space.Close(near, from + s * way, &there)) return false;
      *e = determinant.At(there);
      *pivot = determinant.LastPivot(there);
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
        if (!look(s, k < 3, &e, &pivot)) return node;
        f.at(k) = e;
        if (std::abs(share) == 0.3) near += pivot;
        if (std::abs(share) == 1.0) far += pivot;
      }
      if (f[2] == f[3]) return node;
      const double step = RootOf(x, f);
      if (!(std::abs(step) < reach)) return node;
      root += step;
      // All rows together lose rank there, not the chosen ones alone.
      if (reach < 0.2 && std::abs(step) < 1e-3 && near > kLessNear * far) return node;
    }
    node = Eigen::Vector2d((from + root * way).head<2>());
    return node;
  };
  std::vector<TracedArc> arcs;
  for (const auto& [key, corner] : corners) {
    const auto [i, j] = key;
    const std::array<std::optional<Eigen::Vector2d>, 4> sides = {
        between({i, j}, {i + 1, j}), between({i, j}, {i, j + 1}),
        between({i + 1, j}, {i + 1, j + 1}), between({i, j + 1}, {i + 1, j + 1})};
    TracedArc arc{static_cast<int>(bound - space.bounds().begin()), {}};
    for (const auto& node : sides) {
      if (node) arc.points.push_back(*node);
    }
    if (arc.points.size() == 2) arcs.push_back(std::move(arc));
  }
  return arcs;
}

}  // namespace mbv
