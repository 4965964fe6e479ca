#include "features/workspace/flood.h"

#include <fmt/format.h>
#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <thread>
#include <unordered_map>

#include "base/worker_pool.h"
#include "features/workspace/fibre.h"

namespace mbv {
namespace {

using Lattice = std::array<int, 3>;

constexpr double kSame = 1e-6;      // two poses of a corner [rad, characteristic lengths]
constexpr double kCutShare = 1e-4;  // of an edge, to which a cut is found
constexpr int kMostCuts = 30;
constexpr double kStride = 0.02, kRoom = 1.15;  // [rad, characteristic lengths]; of a plan
constexpr int kMostStrides = 10000;
constexpr int kHalvings = 16;                            // of an edge, down to where branches cross
constexpr double kNearlyLost = 1e-3, kNearlyFold = 0.5;  // margins, by those at home
constexpr double kGibibyte = 1073741824.0, kMostCorners = 4e6;
constexpr double kOverhead = 200.0;   // bytes of a corner beside its pose: key, node, allocations
constexpr size_t kKeptAtOnce = 1024;  // of corners or cuts that are kept at once
constexpr std::array<int, 4> kUsualResolution = {0, 400, 240, 64};

struct LatticeHash {
  size_t operator()(const Lattice& k) const {
    size_t h = 0;
    for (const int i : k) h = h * 1000003u + static_cast<size_t>(static_cast<std::uint32_t>(i));
    return h;
  }
};

struct Corner {
  bool inside = false, closes = false;
  bool passes = false;  // the way goes on from here
  bool across = false;  // type 2 lies on the way, which is inside again
  int bound = -1;
  SpacePose pose;  // where it closes
};
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<Corner>& corner) {
  visit(corner.inside), visit(corner.closes), visit(corner.passes), visit(corner.bound);
  visit(corner.across), visit(corner.pose);
}

struct Cut {
  double share = 0.5;
  int bound = -1, vertex = -1;
};
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<Cut>& cut) {
  visit(cut.share), visit(cut.bound), visit(cut.vertex);
}

// Calls work(i, its own space) for all i.
void OnThreads(size_t count, int threads, const PoseSpace& space, std::atomic<long>* closings,
               const std::function<void(size_t, PoseSpace&)>& work) {
  std::atomic<size_t> next = 0;
  const auto run = [&] {
    PoseSpace own = space;
    const long before = own.closings();
    for (size_t i = next++; i < count; i = next++) work(i, own);
    *closings += own.closings() - before;
  };
  std::vector<std::thread> others;
  for (int t = 1; t < threads && static_cast<size_t>(t) < count; ++t) others.emplace_back(run);
  run();
  for (std::thread& other : others) other.join();
}

// Between two poses inside, where branches of type 2 cross, its margin may vanish twice, or touch
// zero: the first share of the way at which it is found not to be positive. Halves, until twice
// what a half's middle is off its chord is less than what is left there. NaN of what does not
// close.
std::optional<double> FirstGap(const std::function<double(double)>& margin, double a, double m_a,
                               double b, double m_b, int halvings) {
  const double middle = 0.5 * (a + b), m = margin(middle);
  if (m < 0.0 || halvings == 0) return middle;
  if (std::min({m_a, m, m_b}) > std::abs(m_a - 2.0 * m + m_b)) return std::nullopt;
  if (!std::isfinite(m)) return std::nullopt;
  const auto first = FirstGap(margin, a, m_a, middle, m, halvings - 1);
  return first ? first : FirstGap(margin, middle, m, b, m_b, halvings - 1);
}
// The same from a pose to what Close() found for the coordinates `target`.
std::optional<double> FirstGap(const PoseSpace& space, const PlacedPose& from, const VecX& target,
                               const PlacedPose& to) {
  const int type2 = space.type2_bound();
  if (type2 < 0) return std::nullopt;
  const auto margin = [&](double share) {
    PlacedPose at;
    const VecX x = from.pose.at + share * (target - from.pose.at);
    return space.Close(from, x, &at) ? at.pose.margin[type2] : kNan;
  };
  return FirstGap(margin, 0.0, from.pose.margin[type2], 1.0, to.pose.margin[type2], kHalvings);
}

// One tetrahedron, triangle or segment: corners with their values' signs and cuts.
struct Simplex {
  std::array<Lattice, 4> corner{};
};

class Flooder {
 public:
  Flooder(const PoseSpace& space, const PlacedPose& home, const FloodSettings& settings,
          const FloodPlan& plan, const std::function<void(double)>& progress, ResultLog log)
      : space_(space),
        home_(home),
        settings_(settings),
        progress_(progress),
        k_(space.over()),
        fibre_(space.settings()),
        log_(std::move(log)) {
    set_.step = plan.step;
    set_.summary = plan.summary;
    most_corners_ = plan.most_corners;
  }

  FloodedSet Flood() {
    if (!set_.summary.ok()) return std::move(set_);
    FloodCoarse();
    if (!set_.summary.ok()) return std::move(set_);
    for (int level = 0; level <= settings_.halvings; ++level) {
      if (level > 0) Refine(level);
      if (!Fits()) return std::move(set_);
      if (level >= settings_.halvings - 2) {
        CutEdges(level);
        set_.levels.push_back(Measure(level, level == settings_.halvings));
      }
    }
    if (InVain()) {
      set_.summary.stop = Stop::kNoConvergence;
      set_.summary.message = "it was given up";
      return std::move(set_);
    }
    if (std::ranges::none_of(corners_, [](const auto& known) { return known.second.inside; })) {
      set_.summary.stop = Stop::kUnreachable;
      set_.summary.message = "none of the poses of the lattice has all of the range";
      return std::move(set_);
    }
    const auto count = set_.levels.size();
    set_.measure = set_.levels.back();
    // Of second order, but for corners: where several bounds cut a cell, a quarter of it is open.
    double change = std::abs(set_.levels[count - 1] - set_.levels[count - 2]);
    if (count > 2) {
      change = std::max(change, 0.5 * std::abs(set_.levels[count - 2] - set_.levels[count - 3]));
    }
    set_.error = change + 0.25 * CornerCells() +
                 kCutShare * SizeOfCells(CutCells(settings_.halvings).size());
    set_.corners = static_cast<long>(corners_.size());
    for (const auto& [key, corner] : corners_) set_.inside += corner.inside;
    set_.closings = closings_;
    KeepLattice();
    return std::move(set_);
  }

 private:
  [[nodiscard]] int SpacingAt(int level) const { return 1 << (settings_.halvings - level); }
  [[nodiscard]] VecX At(const Lattice& key) const {
    VecX x = home_.pose.at.head(k_);
    for (int c = 0; c < k_; ++c)
      x[c] += set_.step.at(static_cast<size_t>(c)) * key.at(static_cast<size_t>(c));
    return x;
  }
  [[nodiscard]] Vec3 PointOf(const VecX& x) const {
    Vec3 p = Vec3::Zero();
    p.head(k_) = x;
    return p;
  }

  void Take(const Lattice& key, Corner corner) {
    Corner& known = corners_[key];
    if (!known.closes || !corner.closes) {
      if (!known.closes) known = std::move(corner);
      return;
    }
    // The best of some poses depends on the way.
    const bool unique = !fibre_.any() || space_.settings().for_all;
    if (unique && known.inside && corner.inside && Differ(known.pose, corner.pose)) {
      ++set_.conflicts;
      const double margin = std::min(ConstraintMargin(known.pose), ConstraintMargin(corner.pose));
      if (!(margin >= set_.conflict_margin)) {
        set_.conflict_margin = margin;
        set_.conflict_at = PointOf(known.pose.at.head(k_));
      }
    }
    if (!known.inside && (corner.inside || (corner.passes && !known.passes))) {
      known = std::move(corner);
    }
  }
  [[nodiscard]] double ConstraintMargin(const SpacePose& pose) const {
    const auto& bounds = space_.bounds();
    const auto at = std::ranges::find(bounds, SetBound::Kind::kConstraint, &SetBound::kind);
    return pose.margin[at - bounds.begin()];
  }
  [[nodiscard]] bool Differ(const SpacePose& a, const SpacePose& b) const {
    for (size_t j = 0; j < a.X_FM.size(); ++j) {
      // Idle spins of rods depend on the way.
      if (space_.has_idle_spins() && HasBall(space_.mechanism().joints[j].kind)) continue;
      const double turn = (a.X_FM[j].linear() - b.X_FM[j].linear()).cwiseAbs().maxCoeff();
      const double slide =
          (a.X_FM[j].translation() - b.X_FM[j].translation()).norm() / space_.length();
      if (turn > kSame || slide > kSame) return true;
    }
    return false;
  }

  // The pose at free coordinates, with margins over the range that is asked.
  [[nodiscard]] Fibre::Reach Close(const PoseSpace& space, const PlacedPose& from, const VecX& x,
                                   PlacedPose* at, double* at_start) const {
    if (fibre_.any()) return fibre_.At(space, from, x, at, at_start);
    return space.Close(from, space.Target(x), at) ? Fibre::Reach::kWhole : Fibre::Reach::kNone;
  }

  [[nodiscard]] Corner Visit(const PoseSpace& space, const PlacedPose& from,
                             const Lattice& key) const {
    Corner corner;
    PlacedPose at;
    double at_start = 0.0;
    const Fibre::Reach reach = Close(space, from, At(key), &at, &at_start);
    if (reach == Fibre::Reach::kNone) return corner;
    corner.closes = true;
    Eigen::Index worst = 0;
    const double least = at.pose.margin.minCoeff(&worst);
    const bool part = reach == Fibre::Reach::kPart;
    corner.inside = !part && least >= 0.0;
    if (corner.inside && !fibre_.any() && from.pose.margin.minCoeff() >= 0.0 &&
        FirstGap(space, from, space.Target(At(key)), at)) {
      corner.inside = false;
      corner.across = true;
      worst = space.type2_bound();
    }
    corner.passes = corner.inside || (space.settings().for_all && at_start >= 0.0);
    if (!corner.inside) {
      corner.bound = part && least >= 0.0 ? FoldBound(at.pose.margin) : static_cast<int>(worst);
    }
    corner.pose = std::move(at.pose);
    return corner;
  }

  void FloodCoarse() {
    const int spacing = SpacingAt(0);
    Corner first;
    first.inside = first.closes = first.passes = true;
    first.pose = home_.pose;
    if (fibre_.any()) first = Visit(space_, home_, {0, 0, 0});
    corners_[{0, 0, 0}] = std::move(first);
    std::vector<Lattice> front = {{0, 0, 0}};
    while (!front.empty()) {
      // Each front at once; what it finds is taken in its order.
      auto found = ForAll<std::vector<std::pair<Lattice, Corner>>>(
          front.size(), [&](size_t i, PoseSpace& own) {
            std::vector<std::pair<Lattice, Corner>> around;
            PlacedPose from;
            if (!own.Place(corners_.find(front[i])->second.pose, &from)) return around;
            for (int c = 0; c < k_; ++c) {
              for (const int sign : {-1, 1}) {
                Lattice key = front[i];
                key.at(static_cast<size_t>(c)) += sign * spacing;
                around.emplace_back(key, Visit(own, from, key));
              }
            }
            return around;
          });
      std::set<Lattice> next;
      for (auto& list : found) {
        for (auto& [key, corner] : list) {
          const auto known = corners_.find(key);
          const bool passed = known != corners_.end() && known->second.passes;
          Take(key, std::move(corner));
          if (!passed && corners_[key].passes) next.insert(key);
        }
      }
      front.assign(next.begin(), next.end());
      if (!Fits()) return;
      Report(0.3 * (1.0 - 1.0 / (1.0 + 0.1 * static_cast<double>(++waves_))));
    }
    for (const auto& known : corners_) {
      if (!known.second.inside) continue;
      ForEachCorner([&](const Lattice& offset) {
        Lattice cell = known.first;
        for (size_t c = 0; c < 3; ++c) cell.at(c) -= spacing * offset.at(c);
        cells_[0].insert(cell);
      });
    }
    Complete(0, {cells_[0].begin(), cells_[0].end()});
    set_.summary = RunSummary::Done();
  }

  [[nodiscard]] bool Fits() {
    if (static_cast<double>(corners_.size()) <= most_corners_) return true;
    set_.summary.stop = Stop::kUnsupported;
    set_.summary.message = "the set is larger than this --resolution can fill within 2 GiB";
    return false;
  }

  void Report(double fraction) const {
    if (progress_) progress_(fraction);
  }
  // work(i, a space of its own) for all i, kept batch by batch.
  template <typename T, typename Work>
  std::vector<T> ForAll(size_t count, const Work& work,
                        const std::function<void(double)>& progress = {}) {
    std::vector<T> all;
    all.reserve(count);
    for (size_t first = 0; first < count && !InVain(); first += kKeptAtOnce) {
      const size_t size = std::min(kKeptAtOnce, count - first);
      auto [results, closings] = log_.Get<std::pair<std::vector<T>, long>>([&] {
        std::vector<T> computed(size);
        std::atomic<long> closed = 0;
        OnThreads(size, settings_.threads, space_, &closed,
                  [&](size_t i, PoseSpace& own) { computed[i] = work(first + i, own); });
        return std::pair(std::move(computed), closed.load());
      });
      results.resize(size);
      std::ranges::move(results, std::back_inserter(all));
      closings_ += closings;
      if (progress) progress(static_cast<double>(first + size) / static_cast<double>(count));
    }
    all.resize(count);
    return all;
  }
  [[nodiscard]] bool InVain() const { return settings_.in_vain != nullptr && *settings_.in_vain; }

  template <typename F>
  void ForEachCorner(const F& f, int most = 1) const {
    Lattice offset{};
    const auto all = [&](auto&& self, int c) -> void {
      if (c == k_) {
        f(offset);
        return;
      }
      for (int i = 0; i <= most; ++i) {
        offset.at(static_cast<size_t>(c)) = i;
        self(self, c + 1);
      }
      offset.at(static_cast<size_t>(c)) = 0;
    };
    all(all, 0);
  }
  [[nodiscard]] static Lattice Sum(Lattice a, const Lattice& b, int factor) {
    for (size_t c = 0; c < 3; ++c) a.at(c) += factor * b.at(c);
    return a;
  }

  // The cell of a spacing in which one of a finer spacing lies.
  [[nodiscard]] static Lattice Covering(Lattice cell, int spacing) {
    for (int& i : cell) i = (i >= 0 ? i / spacing : -((-i + spacing - 1) / spacing)) * spacing;
    return cell;
  }
  // Whether a cell of a level counts, by itself, by its parts, or by one that covers it.
  [[nodiscard]] bool Counts(int level, const Lattice& cell) const {
    for (int l = 0; l < level; ++l) {
      if (cells_[static_cast<size_t>(l)].contains(Covering(cell, SpacingAt(l)))) return true;
    }
    const auto at = static_cast<size_t>(level);
    return cells_[at].contains(cell) || refined_[at].contains(cell);
  }
  // A cell of a level that counts by itself: those that cover it are halved.
  void Open(int level, const Lattice& cell) {
    for (int l = 0; l < level; ++l) {
      const auto at = static_cast<size_t>(l);
      const Lattice wide = Covering(cell, SpacingAt(l));
      if (cells_[at].erase(wide) == 0) continue;
      refined_[at].insert(wide);
      std::vector<Lattice> children;
      ForEachCorner(
          [&](const Lattice& offset) { children.push_back(Sum(wide, offset, SpacingAt(l + 1))); });
      Complete(l + 1, children);
      cells_[at + 1].insert(children.begin(), children.end());
    }
    cells_[static_cast<size_t>(level)].insert(cell);
  }

  // Corners of cells that were not visited, from the nearest one inside of the same cell's parent.
  void Complete(int level, const std::vector<Lattice>& cells) {
    const int spacing = SpacingAt(level);
    std::map<Lattice, std::vector<Lattice>> wanted;  // and from where, the nearest first
    for (const Lattice& cell : cells) {
      ForEachCorner([&](const Lattice& offset) {
        const Lattice key = Sum(cell, offset, spacing);
        if (corners_.contains(key) || wanted.contains(key)) return;
        std::vector<std::pair<long, Lattice>> near;
        const auto offer = [&](const Lattice& other) {
          const auto at = corners_.find(other);
          if (at == corners_.end() || !at->second.passes) return;
          long distance = 0;
          for (size_t c = 0; c < 3; ++c) {
            const long d = other.at(c) - key.at(c);
            distance += d * d;
          }
          near.emplace_back(distance, other);
        };
        // Corners of this cell, and of the one that it is a part of.
        for (int wider = 1; wider <= 2 && near.empty(); ++wider) {
          const int s = spacing * wider;
          const Lattice base = wider == 1 ? cell : Covering(cell, s);
          ForEachCorner([&](const Lattice& o) { offer(Sum(base, o, s)); });
        }
        if (near.empty() && spacing > 1) {  // or those within, beyond a neck
          ForEachCorner([&](const Lattice& o) { offer(Sum(cell, o, spacing / 2)); }, 2);
        }
        if (near.empty()) return;
        std::ranges::stable_sort(near, {}, &std::pair<long, Lattice>::first);
        auto& from = wanted[key];
        for (const auto& [distance, other] : near) from.push_back(other);
      });
    }
    const std::vector<std::pair<Lattice, std::vector<Lattice>>> list(wanted.begin(), wanted.end());
    auto found = ForAll<Corner>(list.size(), [&](size_t i, PoseSpace& own) {
      const auto& [key, nearest] = list[i];
      Corner corner;
      for (const Lattice& other : nearest) {
        PlacedPose from;
        if (own.Place(corners_.find(other)->second.pose, &from)) corner = Visit(own, from, key);
        if (!corner.across) break;
      }
      return corner;
    });
    for (size_t i = 0; i < list.size(); ++i) Take(list[i].first, std::move(found[i]));
  }

  [[nodiscard]] bool IsIn(const Lattice& key) const {
    const auto at = corners_.find(key);
    return at != corners_.end() && at->second.inside;
  }
  // 0: outside, 1: cut, 2: inside, by the corners of spacing `step` in a cell.
  [[nodiscard]] int StateOf(const Lattice& cell, int spacing, int step) const {
    bool in = false, out = false;
    ForEachCorner(
        [&](const Lattice& offset) {
          const Lattice key = Sum(cell, offset, step);
          const auto at = corners_.find(key);
          if (at == corners_.end()) {
            out = out || step == spacing;
            return;
          }
          (at->second.inside ? in : out) = true;
        },
        spacing / step);
    return in && out ? 1 : in ? 2 : 0;
  }

  void Refine(int level) {
    const int wide = SpacingAt(level - 1), spacing = SpacingAt(level);
    std::set<Lattice> refined;
    std::vector<Lattice> todo;
    for (const Lattice& cell : cells_[static_cast<size_t>(level - 1)]) {
      if (StateOf(cell, wide, wide) == 1) todo.push_back(cell);
    }
    while (!todo.empty()) {
      std::vector<Lattice> children;
      for (const Lattice& cell : todo) {
        refined.insert(cell);
        ForEachCorner(
            [&](const Lattice& offset) { children.push_back(Sum(cell, offset, spacing)); });
      }
      Complete(level, children);
      // Neighbours that a finer corner shows to be cut.
      std::set<Lattice> more;
      for (const Lattice& cell : todo) {
        ForEachCorner(
            [&](const Lattice& offset) {
              Lattice other = cell;
              for (size_t c = 0; c < static_cast<size_t>(k_); ++c) {
                other.at(c) += wide * (offset.at(c) - 1);
              }
              if (refined.contains(other) || more.contains(other)) return;
              if (StateOf(other, wide, spacing) == 1) more.insert(other);
            },
            2);
      }
      for (const Lattice& cell : more) Open(level - 1, cell);
      // And what lies beyond a neck of the set, through which only finer corners lead.
      std::vector<Lattice> fresh(more.begin(), more.end());
      while (!fresh.empty() && Fits()) {
        Complete(level - 1, fresh);
        std::set<Lattice> next;
        for (const Lattice& cell : fresh) {
          ForEachCorner([&](const Lattice& offset) {
            const Lattice key = Sum(cell, offset, wide);
            if (!IsIn(key)) return;
            ForEachCorner([&](const Lattice& back) {
              const Lattice other = Sum(key, back, -wide);
              if (!Counts(level - 1, other) && !refined.contains(other)) next.insert(other);
            });
          });
        }
        for (const Lattice& cell : next) cells_[static_cast<size_t>(level - 1)].insert(cell);
        more.insert(next.begin(), next.end());
        fresh.assign(next.begin(), next.end());
      }
      todo.clear();
      for (const Lattice& cell : more) {
        if (StateOf(cell, wide, spacing) == 1) todo.push_back(cell);
      }
    }
    auto& finer = cells_[static_cast<size_t>(level)];
    for (const Lattice& cell : refined) {
      cells_[static_cast<size_t>(level - 1)].erase(cell);
      refined_[static_cast<size_t>(level - 1)].insert(cell);
      ForEachCorner([&](const Lattice& offset) { finer.insert(Sum(cell, offset, spacing)); });
    }
    Report(0.3 + 0.3 * level / settings_.halvings);
  }

  // Kuhn's simplices of a cell: one per order of the coordinates.
  template <typename F>
  void ForEachSimplex(const Lattice& cell, int spacing, const F& f) const {
    std::array<int, 3> order = {0, 1, 2};
    do {
      Simplex simplex;
      simplex.corner[0] = cell;
      for (int i = 0; i < k_; ++i) {
        const auto at = static_cast<size_t>(i);
        simplex.corner.at(at + 1) = simplex.corner.at(at);
        simplex.corner.at(at + 1).at(static_cast<size_t>(order.at(at))) += spacing;
      }
      f(simplex);
    } while (std::next_permutation(order.begin(), order.begin() + k_));
  }

  using Edge = std::pair<Lattice, Lattice>;  // from inside to outside
  struct EdgeHash {
    size_t operator()(const Edge& e) const {
      return LatticeHash()(e.first) * 31u + LatticeHash()(e.second);
    }
  };

  // Cells that count at a level: those of this size, and larger ones.
  [[nodiscard]] std::vector<Lattice> CutCells(int level) const {
    std::vector<Lattice> cells;
    for (const Lattice& cell : cells_[static_cast<size_t>(level)]) {
      if (StateOf(cell, SpacingAt(level), SpacingAt(level)) == 1) cells.push_back(cell);
    }
    std::ranges::sort(cells);
    return cells;
  }

  void CutEdges(int level) {
    const int spacing = SpacingAt(level);
    std::set<Edge> wanted;
    for (const Lattice& cell : CutCells(level)) {
      ForEachSimplex(cell, spacing, [&](const Simplex& simplex) {
        for (int i = 0; i <= k_; ++i) {
          for (int j = 0; j <= k_; ++j) {
            const Lattice &a = simplex.corner.at(static_cast<size_t>(i)),
                          &b = simplex.corner.at(static_cast<size_t>(j));
            if (IsIn(a) && !IsIn(b) && !cuts_.contains({a, b})) wanted.insert({a, b});
          }
        }
      });
    }
    const std::vector<Edge> edges(wanted.begin(), wanted.end());
    const auto cuts = ForAll<Cut>(
        edges.size(), [&](size_t i, PoseSpace& own) { return CutOf(own, edges[i]); },
        [&](double done) {
          if (level == settings_.halvings) Report(0.6 + 0.4 * done);
        });
    for (size_t i = 0; i < edges.size(); ++i) cuts_.emplace(edges[i], cuts[i]);
  }

  [[nodiscard]] Cut CutOf(const PoseSpace& space, const Edge& edge) const {
    const VecX a = At(edge.first), b = At(edge.second);
    PlacedPose from, at;
    Cut cut;
    const SpacePose& inside = corners_.find(edge.first)->second.pose;
    if (!space.Place(inside, &from)) return cut;
    double low = 0.0, high = 1.0, unused = 0.0;
    VecX margin_low = inside.margin, margin_high;
    const auto close = [&](double s) {
      const VecX x = a + s * (b - a);
      return fibre_.any() ? fibre_.At(space, from, x, &at, &unused) == Fibre::Reach::kWhole
                          : space.CloseNear(from, space.Target(x), &at);
    };
    if (Close(space, from, b, &at, &unused) == Fibre::Reach::kWhole) {
      margin_high = at.pose.margin;
      if (margin_high.minCoeff() >= 0.0) {
        const auto gap = fibre_.any() ? std::nullopt : FirstGap(space, from, space.Target(b), at);
        cut.share = gap.value_or(1.0);  // outside by another sheet
        if (gap) cut.bound = space.type2_bound();
        if (!gap || !close(*gap) || at.pose.margin.minCoeff() >= 0.0) return cut;
        high = *gap;
        margin_high = at.pose.margin;
      }
    }
    // A fold is approached in steps that close, towards where the square of its margin would
    // vanish, which is linear there.
    double fold = kNan, step = 0.5;
    for (int i = 0; i < kMostCuts && margin_high.size() == 0 && step > 0.1 * kCutShare; ++i) {
      if (!close(low + step)) {
        step *= 0.5;
        continue;
      }
      if (at.pose.margin.minCoeff() < 0.0) {
        high = low + step;
        margin_high = at.pose.margin;
        break;
      }
      cut.bound = FoldBound(at.pose.margin);
      const double known = fold;
      if (cut.bound >= 0) {
        const double m0 = std::pow(margin_low[cut.bound], 2),
                     m1 = std::pow(at.pose.margin[cut.bound], 2);
        fold = low + step + m1 * step / (m0 - m1);
      }
      low += step;
      margin_low = at.pose.margin;
      from = at;
      if (std::abs(fold - known) < 0.1 * kCutShare) break;
      step = std::min(std::isfinite(fold) ? 0.7 * (fold - low) : step, 0.9 * (1.0 - low));
    }
    for (int i = 0; i < 3 && margin_high.size() > 0 && high - low > kCutShare; ++i) {
      // The first root of the margins' chords; a little to its sides, so that both ends close in.
      const double root = Root(margin_low, margin_high, &cut.bound);
      const double s =
          low + std::clamp(root + (i % 2 == 1 ? 0.02 : -0.02), 0.001, 0.999) * (high - low);
      if (!close(s)) break;
      const bool in = at.pose.margin.minCoeff() >= 0.0;
      (in ? low : high) = s;
      (in ? margin_low : margin_high) = at.pose.margin;
      if (in) from = at;
    }
    cut.share = margin_high.size() > 0
                    ? low + Root(margin_low, margin_high, &cut.bound) * (high - low)
                : std::isfinite(fold) ? std::clamp(fold, low, 1.0)
                                      : low;
    return cut;
  }
  // Of the best of some poses, the least margin alone is continuous.
  [[nodiscard]] double Root(const VecX& low, const VecX& high, int* bound) const {
    if (!fibre_.any() || space_.settings().for_all) return RootOf(low, high, bound);
    Eigen::Index worst = 0;
    const double out = high.minCoeff(&worst), in = low.minCoeff();
    *bound = static_cast<int>(worst);
    return in / (in - out);
  }
  [[nodiscard]] static double RootOf(const VecX& low, const VecX& high, int* bound) {
    double root = 1.0;
    for (Eigen::Index j = 0; j < high.size(); ++j) {
      if (high[j] >= 0.0) continue;
      const double share = low[j] / (low[j] - high[j]);
      if (share >= root) continue;
      root = share;
      *bound = static_cast<int>(j);
    }
    return root;
  }
  // Where poses stop to close: a fold, unless a constraint is about to be lost.
  [[nodiscard]] int FoldBound(const VecX& margin) const {
    int bound = -1;
    for (size_t j = 0; j < space_.bounds().size(); ++j) {
      const SetBound::Kind kind = space_.bounds()[j].kind;
      const double m = margin[static_cast<Eigen::Index>(j)];
      if (kind == SetBound::Kind::kConstraint && m < kNearlyLost) return static_cast<int>(j);
      if (kind == SetBound::Kind::kType1 && m < kNearlyFold) bound = static_cast<int>(j);
    }
    return bound;
  }

  [[nodiscard]] Vec3 CutPoint(const Lattice& in, const Lattice& out, Cut** cut) {
    const auto at = cuts_.find({in, out});
    *cut = &at->second;
    const VecX a = At(in), b = At(out);
    return PointOf(a + at->second.share * (b - a));
  }

  [[nodiscard]] double Size(const std::array<Vec3, 4>& p) const {
    if (k_ == 1) return std::abs(p[1][0] - p[0][0]);
    if (k_ == 2) {
      const Vec3 u = p[1] - p[0], v = p[2] - p[0];
      return 0.5 * std::abs(u[0] * v[1] - u[1] * v[0]);
    }
    return std::abs((p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0])) / 6.0;
  }

  // Inside part of a simplex; with facets of the boundary if wanted.
  double InsideOf(const Simplex& simplex, bool facets) {
    std::vector<Lattice> in, out;
    for (int i = 0; i <= k_; ++i) {
      const Lattice& key = simplex.corner.at(static_cast<size_t>(i));
      (IsIn(key) ? in : out).push_back(key);
    }
    const auto point = [&](const Lattice& key) { return PointOf(At(key)); };
    std::array<Vec3, 4> p;
    if (out.empty() || in.empty()) {
      if (in.empty()) return 0.0;
      for (size_t i = 0; i < in.size(); ++i) p.at(i) = point(in[i]);
      return Size(p);
    }
    // Cuts by inside and outside corner.
    std::vector<std::vector<Vec3>> cut(in.size());
    std::vector<std::vector<Cut*>> of(in.size());
    for (size_t i = 0; i < in.size(); ++i) {
      for (const Lattice& o : out) {
        Cut* at = nullptr;
        cut[i].push_back(CutPoint(in[i], o, &at));
        of[i].push_back(at);
      }
    }
    const auto facet = [&](std::initializer_list<std::pair<size_t, size_t>> corners) {
      if (!facets) return;
      FloodFacet made;
      size_t v = 0;
      for (const auto& [i, o] : corners) {
        Cut* at = of[i][o];
        if (at->vertex < 0) {
          at->vertex = static_cast<int>(set_.vertices.size());
          set_.vertices.push_back({cut[i][o], at->bound});
        }
        made.vertices.at(v++) = at->vertex;
      }
      if (k_ == 3) {
        const Vec3 &a = set_.vertices[static_cast<size_t>(made.vertices[0])].at,
                   &b = set_.vertices[static_cast<size_t>(made.vertices[1])].at,
                   &c = set_.vertices[static_cast<size_t>(made.vertices[2])].at;
        if ((b - a).cross(c - a).dot(point(out[0]) - a) < 0.0) {
          std::swap(made.vertices[1], made.vertices[2]);
        }
      }
      set_.facets.push_back(made);
    };
    if (k_ == 1) {
      facet({{0, 0}});
      return Size({point(in[0]), cut[0][0], {}, {}});
    }
    if (k_ == 2 && in.size() == 1) {
      facet({{0, 0}, {0, 1}});
      return Size({point(in[0]), cut[0][0], cut[0][1], {}});
    }
    if (k_ == 2) {
      facet({{0, 0}, {1, 0}});
      return Size({point(in[0]), point(in[1]), cut[1][0], {}}) +
             Size({point(in[0]), cut[1][0], cut[0][0], {}});
    }
    if (in.size() == 1) {
      facet({{0, 0}, {0, 1}, {0, 2}});
      return Size({point(in[0]), cut[0][0], cut[0][1], cut[0][2]});
    }
    if (in.size() == 3) {
      facet({{0, 0}, {1, 0}, {2, 0}});
      return Size({point(in[0]), point(in[1]), point(in[2]), cut[0][0]}) +
             Size({point(in[1]), point(in[2]), cut[0][0], cut[1][0]}) +
             Size({point(in[2]), cut[0][0], cut[1][0], cut[2][0]});
    }
    facet({{0, 0}, {0, 1}, {1, 1}});
    facet({{0, 0}, {1, 1}, {1, 0}});
    return Size({point(in[0]), point(in[1]), cut[0][0], cut[0][1]}) +
           Size({point(in[1]), cut[0][0], cut[0][1], cut[1][1]}) +
           Size({point(in[1]), cut[0][0], cut[1][1], cut[1][0]});
  }

  double Measure(int level, bool facets) {
    double cell_size = 1.0;
    for (int c = 0; c < k_; ++c) cell_size *= set_.step.at(static_cast<size_t>(c));
    double sum = 0.0;
    long full = 0;
    for (int l = 0; l <= level; ++l) {
      const int spacing = SpacingAt(l);
      for (const Lattice& cell : cells_[static_cast<size_t>(l)]) {
        if (StateOf(cell, spacing, spacing) == 2) {
          full += static_cast<long>(std::pow(spacing, k_));
        }
      }
    }
    sum = static_cast<double>(full) * cell_size;
    for (const Lattice& cell : CutCells(level)) {
      ForEachSimplex(cell, SpacingAt(level),
                     [&](const Simplex& simplex) { sum += InsideOf(simplex, facets); });
    }
    return sum;
  }

  [[nodiscard]] double SizeOfCells(size_t count) const {
    auto size = static_cast<double>(count);
    for (int c = 0; c < k_; ++c) size *= set_.step.at(static_cast<size_t>(c));
    return size;
  }
  // Size of the finest cells that several bounds cut, or branches of one.
  [[nodiscard]] double CornerCells() const {
    if (k_ == 1) return 0.0;
    size_t cells = 0;
    for (const Lattice& cell : CutCells(settings_.halvings)) {
      int bound = -2;
      bool several = false;
      ForEachCorner([&](const Lattice& offset) {
        const auto at = corners_.find(Sum(cell, offset, 1));
        several = several || (at != corners_.end() && at->second.across);
      });
      ForEachSimplex(cell, 1, [&](const Simplex& simplex) {
        for (int i = 0; i <= k_; ++i) {
          for (int j = 0; j <= k_; ++j) {
            const auto cut = cuts_.find({simplex.corner.at(static_cast<size_t>(i)),
                                         simplex.corner.at(static_cast<size_t>(j))});
            if (cut == cuts_.end()) continue;
            several = several || (bound != -2 && bound != cut->second.bound);
            bound = cut->second.bound;
          }
        }
      });
      cells += several;
    }
    return SizeOfCells(cells);
  }

  void KeepLattice() {
    const int spacing = SpacingAt(0);
    for (size_t c = 0; c < 3; ++c) set_.lattice_step.at(c) = spacing * set_.step.at(c);
    std::vector<Lattice> keys;
    for (const auto& [key, corner] : corners_) {
      bool coarse = true;
      for (const int i : key) coarse = coarse && i % spacing == 0;
      if (coarse) keys.push_back(key);
    }
    std::ranges::sort(keys, {}, [](const Lattice& k) { return Lattice{k[2], k[1], k[0]}; });
    for (const Lattice& key : keys) {
      const Corner& corner = corners_[key];
      set_.lattice.push_back({PointOf(At(key)), corner.inside, corner.bound,
                              corner.inside ? corner.pose : SpacePose{}});
    }
  }

  const PoseSpace& space_;
  const PlacedPose& home_;
  const FloodSettings settings_;
  const std::function<void(double)>& progress_;
  const int k_;
  const Fibre fibre_;
  ResultLog log_;
  double most_corners_ = kMostCorners;
  FloodedSet set_;
  std::unordered_map<Lattice, Corner, LatticeHash> corners_;
  std::array<std::set<Lattice>, 6> cells_, refined_;  // by level: not refined; refined
  std::unordered_map<Edge, Cut, EdgeHash> cuts_;
  long closings_ = 0;
  int waves_ = 0;
};

}  // namespace

FloodPlan PlanFlood(const PoseSpace& space, const PlacedPose& home, const FloodSettings& settings) {
  FloodPlan plan;
  const auto start = std::chrono::steady_clock::now();
  const int k = space.over();
  const int resolution =
      settings.resolution > 0 ? settings.resolution : kUsualResolution.at(static_cast<size_t>(k));
  double cells = 1.0;
  long poses = 0;
  const Fibre fibre(space.settings());
  constexpr Fibre::Reach none = Fibre::Reach::kNone;
  for (int c = 0; c < k; ++c) {
    double reach = 0.0;
    for (const double sign : {-1.0, 1.0}) {
      PlacedPose at = home;
      const double step = kStride * space.UnitOf(c);
      int count = 0;
      for (; count < kMostStrides; ++count, ++poses) {
        VecX target = at.pose.at;
        target[c] += sign * step;
        PlacedPose next;
        double at_start = 0.0;
        const bool closes = fibre.any()
                                ? fibre.At(space, at, target.head(k), &next, &at_start) != none
                                : space.Close(at, target, &next);
        if (!closes || (!fibre.any() && FirstGap(space, at, target, next))) break;
        const bool all = fibre.any() && space.settings().for_all;
        if ((all ? at_start : next.pose.margin.minCoeff()) < 0.0) break;
        at = std::move(next);
      }
      if (count == kMostStrides) {
        plan.summary.stop = Stop::kUnreachable;
        plan.summary.message = "the set has no end: no range, box or singularity bounds " +
                               space.settings().coordinates[static_cast<size_t>(c)].name;
        return plan;
      }
      reach += step * (count + 0.5);
    }
    plan.step.at(static_cast<size_t>(c)) = kRoom * reach / resolution;
    cells *= kRoom * resolution;
  }
  const double each =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() /
      static_cast<double>(std::max(poses, 1L));
  // Coarse cells everywhere, fine ones and their cuts on the boundary.
  const double boundary = 12.0 * k * std::pow(static_cast<double>(resolution), k - 1);
  const double corners = cells / std::exp2(settings.halvings * k) + boundary;
  plan.closing_s = each;
  plan.estimate_s = each * (corners + 3.0 * boundary) / settings.threads;
  const double bytes = kOverhead + static_cast<double>(sizeof(Corner) + ToBytes(home.pose).size());
  plan.most_corners = std::min(kMostCorners, 2.0 * kGibibyte / bytes);
  if (plan.estimate_s > settings.most_s || corners > plan.most_corners) {
    plan.summary.stop = Stop::kUnsupported;
    plan.summary.message = fmt::format(
        "--resolution {} takes about {} ({:.2g} poses) and {:.2g} GiB; state a lower one",
        resolution, TimeText(plan.estimate_s), corners + 3.0 * boundary,
        corners * bytes / kGibibyte);
    return plan;
  }
  plan.summary = RunSummary::Done();
  return plan;
}

FloodedSet FloodSet(const PoseSpace& space, const PlacedPose& home, const FloodSettings& settings,
                    const FloodPlan& plan, const std::function<void(double)>& progress,
                    ResultLog log) {
  const auto start = std::chrono::steady_clock::now();
  FloodedSet set = Flooder(space, home, settings, plan, progress, std::move(log)).Flood();
  set.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return set;
}

}  // namespace mbv
