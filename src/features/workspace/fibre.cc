#include "features/workspace/fibre.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>

namespace mbv {
namespace {

using Vec2 = Eigen::Vector2d;

constexpr double kFibreStride = 0.1;  // [rad, characteristic lengths]
constexpr int kFewestNodes = 8;
constexpr int kBestSteps = 3, kSamples = 64;  // towards where the least margin is largest
constexpr int kFewestValues = 4;              // intervals of a range at first
constexpr size_t kMostValues = 700;           // sections at most
constexpr double kRests = 1e-5;               // a change by this share of the measure is enough
constexpr int kLines = 4095,
              kFiner = 16;  // scan lines, of three each the middle one; points for each node
// Of a solid: its sections rest by this share of the largest one, its volume by this of it, or with
// this number of sections.
constexpr double kSectionRests = 1e-4, kRuleRests = 3e-4;
constexpr size_t kMostRangeSections = 200;
constexpr double kSliverOfPart = 1e-3;                    // of a part that is divided
constexpr size_t kPosesBeside = 12, kSectionsBeside = 1;  // that begin another section
constexpr int kMostClimbs = 12, kClimbRows = 5;           // to its end
constexpr double kBelow = 1e-3;                           // an end, by the last gain

// Of the parabola through three points.
struct Parabola {
  double x1, y1, slope, square;  // about the middle point: y1 + slope s + square s²
  Parabola(const std::array<double, 3>& x, const std::array<double, 3>& y)
      : x1(x[1]), y1(y[1]), slope(0.0), square(0.0) {
    const double a = x[0] - x[1], b = x[2] - x[1];
    const double da = (y[0] - y[1]) / a, db = (y[2] - y[1]) / b;
    square = (db - da) / (b - a);
    slope = da - square * a;
  }
  [[nodiscard]] double at(double x) const {
    const double s = x - x1;
    return y1 + s * (slope + square * s);
  }
};

}  // namespace

struct Fibre::Node {
  double value = 0.0;
  PlacedPose at;
};

// The pose with another value of one of the ranged coordinates, and what lies behind it.
Fibre::Reach Fibre::Go(const PoseSpace& space, const PlacedPose& from, size_t level, double value,
                       PlacedPose* at) const {
  PlacedPose next;
  VecX target = from.pose.at;
  target[settings_.ranged[level].coordinate] = value;
  if (!space.Close(from, target, &next)) return Reach::kNone;
  return Scan(space, next, level + 1, at);
}

Fibre::Reach Fibre::Scan(const PoseSpace& space, const PlacedPose& from, size_t level,
                         PlacedPose* at) const {
  if (level == settings_.ranged.size()) {
    *at = from;
    return Reach::kWhole;
  }
  const RangedCoordinate& ranged = settings_.ranged[level];
  const double low = ranged.range.lower, high = ranged.range.upper;
  const double start = std::clamp(from.pose.at[ranged.coordinate], low, high);
  const double stride =
      std::min(kFibreStride * space.UnitOf(ranged.coordinate), (high - low) / kFewestNodes);
  std::vector<Node> nodes(1);
  nodes[0].value = start;
  Reach reach = Scan(space, from, level + 1, &nodes[0].at);
  if (reach == Reach::kNone) return reach;
  const PlacedPose first = nodes[0].at;
  for (const double end : {low, high}) {
    const int count = static_cast<int>(std::ceil(std::abs(end - start) / stride - 1e-9));
    PlacedPose last = first;
    for (int k = 1; k <= count; ++k) {
      Node node{.value = start + (end - start) * k / count, .at = {}};
      const Reach there = Go(space, last, level, node.value, &node.at);
      if (there != Reach::kWhole) reach = Reach::kPart;
      if (there == Reach::kNone) break;
      last = node.at;
      nodes.push_back(std::move(node));
    }
  }
  std::ranges::sort(nodes, {}, &Node::value);
  if (settings_.for_all) {
    *at = first;
    VecX least = at->pose.margin;
    for (const Node& node : nodes) least = least.cwiseMin(node.at.pose.margin);
    // Between nodes where a parabola falls below 0 or nearly so.
    for (size_t k = 1; k + 1 < nodes.size() && reach == Reach::kWhole; ++k) {
      const std::array<double, 3> x = {nodes[k - 1].value, nodes[k].value, nodes[k + 1].value};
      for (Eigen::Index j = 0; j < least.size(); ++j) {
        const std::array<double, 3> y = {nodes[k - 1].at.pose.margin[j], nodes[k].at.pose.margin[j],
                                         nodes[k + 1].at.pose.margin[j]};
        if (y[1] > y[0] || y[1] > y[2] || y[0] + y[2] == 2 * y[1]) continue;
        const Parabola p(x, y);
        const double bottom = x[1] - 0.5 * p.slope / p.square, drop = y[1] - p.at(bottom);
        if (!(p.square > 0.0) || p.at(bottom) - 4 * drop > 0.0) continue;
        PlacedPose there;
        if (Go(space, nodes[k].at, level, bottom, &there) != Reach::kWhole) {
          reach = Reach::kPart;
          break;
        }
        least = least.cwiseMin(there.pose.margin);
      }
    }
    at->pose.margin = least;
    return reach;
  }
  // Towards the largest least margin.
  const auto best = [&] {
    return std::ranges::max_element(
               nodes, {}, [](const Node& node) { return node.at.pose.margin.minCoeff(); }) -
           nodes.begin();
  };
  for (int i = 0; i < kBestSteps && nodes.size() > 2; ++i) {
    const auto middle = static_cast<size_t>(
        std::clamp<std::ptrdiff_t>(best(), 1, static_cast<std::ptrdiff_t>(nodes.size()) - 2));
    const std::array<double, 3> x = {nodes[middle - 1].value, nodes[middle].value,
                                     nodes[middle + 1].value};
    std::vector<Parabola> margins;
    for (Eigen::Index j = 0; j < nodes[middle].at.pose.margin.size(); ++j) {
      margins.emplace_back(x, std::array<double, 3>{nodes[middle - 1].at.pose.margin[j],
                                                    nodes[middle].at.pose.margin[j],
                                                    nodes[middle + 1].at.pose.margin[j]});
    }
    const auto least = [&](double s) {
      double sum = std::numeric_limits<double>::infinity();
      for (const Parabola& margin : margins) sum = std::min(sum, margin.at(s));
      return sum;
    };
    double a = x[0], b = x[2], top = x[1];
    for (int turn = 0; turn < 3; ++turn) {
      for (int s = 1; s < kSamples; ++s) {
        const double there = a + (b - a) * s / kSamples;
        if (least(there) > least(top)) top = there;
      }
      const double width = (b - a) / kSamples;
      a = std::max(x[0], top - width);
      b = std::min(x[2], top + width);
    }
    if (std::abs(top - nodes[static_cast<size_t>(best())].value) < 1e-9 * (high - low)) break;
    Node node{.value = top, .at = {}};
    if (Go(space, nodes[middle].at, level, top, &node.at) == Reach::kNone) break;
    nodes.insert(nodes.begin() + static_cast<std::ptrdiff_t>(middle + (top > x[1] ? 1 : 0)),
                 std::move(node));
  }
  *at = nodes[static_cast<size_t>(best())].at;
  return Reach::kWhole;
}

Fibre::Reach Fibre::At(const PoseSpace& space, const PlacedPose& from, const VecX& x,
                       PlacedPose* at, double* at_start) const {
  VecX target = from.pose.at;
  target.head(x.size()) = x;
  PlacedPose there;
  *at_start = -1.0;
  if (space.Close(from, target, &there)) {
    *at_start = there.pose.margin.minCoeff();
    return Scan(space, there, 0, at);
  }
  if (settings_.for_all) return Reach::kNone;
  // At another value of the range it may be open.
  const RangedCoordinate& ranged = settings_.ranged[0];
  for (int k = 0; k <= kFewestNodes; ++k) {
    VecX aside = from.pose.at;
    aside[ranged.coordinate] =
        ranged.range.lower + (ranged.range.upper - ranged.range.lower) * k / kFewestNodes;
    PlacedPose other;
    if (!space.Close(from, aside, &other)) continue;
    target[ranged.coordinate] = aside[ranged.coordinate];
    if (space.Close(other, target, &there)) return Scan(space, there, 0, at);
  }
  return Reach::kNone;
}

namespace {

using ValueKey = std::array<int, 3>;  // of the finest grid of the range
using Spans = std::vector<std::pair<double, double>>;
using PosesOfValues = std::map<ValueKey, std::vector<SpacePose>>;

Spans Combined(const Spans& a, const Spans& b, bool intersect) {
  Spans result;
  if (intersect) {
    for (const auto& [al, ah] : a) {
      for (const auto& [bl, bh] : b) {
        if (std::max(al, bl) < std::min(ah, bh)) {
          result.emplace_back(std::max(al, bl), std::min(ah, bh));
        }
      }
    }
    return result;
  }
  Spans all = a;
  all.insert(all.end(), b.begin(), b.end());
  std::ranges::sort(all);
  for (const auto& [low, high] : all) {
    if (result.empty() || low > result.back().second) {
      result.emplace_back(low, high);
    } else {
      result.back().second = std::max(result.back().second, high);
    }
  }
  return result;
}

bool Contains(const Spans& spans, double x) {
  return std::ranges::any_of(spans,
                             [&](const auto& span) { return x >= span.first && x <= span.second; });
}

// The boundary at values of the range, and what they have in common, or together: of one or two
// free coordinates, or of a solid's section, which rests at a change of its area by `rests`.
class RangeTracer {
 public:
  RangeTracer(const PoseSpace& space, const PlacedPose& start, int threads,
              const std::function<void(double)>& progress, ResultLog* log, double height = kNan,
              PosesOfValues beside = {}, double rests = 0.0)
      : space_(space),
        settings_(space.settings()),
        start_(start),
        threads_(threads),
        progress_(progress),
        count_(settings_.ranged.size()),
        log_(log),
        height_(height),
        rests_(rests),
        beside_(std::move(beside)) {}

  TracedSet Trace() {
    double before = kNan, change_before = kNan;
    for (int intervals = kFewestValues;; intervals *= 2) {
      spacing_ = kFinest / intervals;
      if (!TraceValues()) return std::move(set_);
      if (empty_) {
        set_.measure = set_.error = 0.0;
        break;
      }
      const double line_error = Measure();
      const double change = std::abs(set_.measure - before);
      // What is left, where changes go on to fall as they do: by 4, by 2 where a corner moves.
      const double rest = change_before > 1.2 * change ? change / (change_before / change - 1.0)
                          : std::isfinite(change)      ? 5.0 * change
                                                       : set_.measure;
      set_.error = line_error + largest_error_ + std::max(change, 1.2 * rest);
      before = set_.measure;
      change_before = change;
      const double next = std::pow(2 * intervals + 1, static_cast<double>(count_));
      if (change <= std::max(kRests * set_.measure, rests_) || next > kMostValues ||
          2 * intervals > kFinest) {
        break;
      }
    }
    Collect();
    set_.summary = RunSummary::Done();
    return std::move(set_);
  }
  /// Behind Trace(): poses of each value, of which other sections begin.
  [[nodiscard]] PosesOfValues Poses() const {
    PosesOfValues poses;
    for (const auto& [key, value] : values_) {
      for (size_t i = 0; i < value.traced.inside.size(); i += StrideOf(value)) {
        poses[key].push_back(value.traced.inside[i]);
      }
    }
    return poses;
  }
  /// Some places all over what was found.
  [[nodiscard]] std::vector<Vec2> Places() const {
    std::vector<size_t> rows;
    for (size_t row = 0; row < region_.size(); ++row) {
      if (!region_[row].empty()) rows.push_back(row);
    }
    std::vector<Vec2> places;
    for (int i = 0; i < kClimbRows && !rows.empty(); ++i) {
      const size_t row = rows[rows.size() * static_cast<size_t>(2 * i + 1) / (2 * kClimbRows)];
      for (const auto& [a, b] : region_[row]) {
        for (const double share : {0.2, 0.5, 0.8}) {
          places.emplace_back(a + share * (b - a), low_ + (static_cast<double>(row) + 0.5) * line_);
        }
      }
    }
    return places;
  }
  static constexpr int kFinest = 64;

 private:
  struct AtValue {
    TracedSet traced;
    std::vector<Spans> rows = {};
  };

  // Of its poses, those from which others begin.
  [[nodiscard]] static size_t StrideOf(const AtValue& value) {
    return value.traced.inside.size() / kPosesBeside + 1;
  }
  [[nodiscard]] double ValueOf(const ValueKey& key, size_t r) const {
    const CoordinateRange& range = settings_.ranged[r].range;
    return range.lower + (range.upper - range.lower) * key.at(r) / kFinest;
  }

  // All values of the present spacing, from neighbour to neighbour.
  bool TraceValues() {
    std::vector<ValueKey> open;
    ValueKey key{};
    const auto all = [&](auto&& self, size_t r) -> void {
      if (r == count_) {
        if (!values_.contains(key)) open.push_back(key);
        return;
      }
      for (int i = 0; i <= kFinest; i += spacing_) {
        key.at(r) = i;
        self(self, r + 1);
      }
    };
    all(all, 0);
    while (!open.empty()) {
      std::vector<ValueKey> wave, rest;
      for (const ValueKey& k : open) {
        (Neighbours(k).empty() && !beside_.contains(k) ? rest : wave).push_back(k);
      }
      if (wave.empty()) {  // the first one: nearest to the start
        const auto far = [&](const ValueKey& k) {
          double sum = 0.0;
          for (size_t r = 0; r < count_; ++r) {
            const RangedCoordinate& ranged = settings_.ranged[r];
            sum += std::abs(ValueOf(k, r) - start_.pose.at[ranged.coordinate]) /
                   (ranged.range.upper - ranged.range.lower);
          }
          return sum;
        };
        const auto first = std::ranges::min_element(rest, {}, far);
        wave.push_back(*first);
        rest.erase(first);
      }
      auto found = log_->Get<std::vector<TracedSet>>([&] {
        std::vector<TracedSet> traced(wave.size());
        OnThreads(wave.size(), threads_, [&](size_t i) { traced[i] = TraceAt(wave[i]); });
        return traced;
      });
      for (size_t i = 0; i < wave.size(); ++i) {
        TracedSet& traced = found[i];
        set_.closings += traced.closings;
        if (!traced.summary.ok()) {
          set_.summary = traced.summary;
          return false;
        }
        largest_error_ = std::max(largest_error_, traced.error);
        empty_ = empty_ || (settings_.for_all && traced.measure == 0.0);
        values_[wave[i]] = {std::move(traced)};
      }
      if (empty_) return true;
      open = std::move(rest);
      if (progress_) {
        const double most = std::pow(kFinest + 1.0, static_cast<double>(count_));
        progress_(static_cast<double>(values_.size()) /
                  std::min(most, static_cast<double>(kMostValues)));
      }
    }
    return true;
  }

  [[nodiscard]] std::vector<const AtValue*> Neighbours(const ValueKey& key) const {
    std::vector<const AtValue*> neighbours;
    for (size_t r = 0; r < count_; ++r) {
      for (const int sign : {-1, 1}) {
        ValueKey other = key;
        other.at(r) += sign * spacing_;
        const auto at = values_.find(other);
        if (at != values_.end()) neighbours.push_back(&at->second);
      }
    }
    return neighbours;
  }

  [[nodiscard]] TracedSet TraceAt(const ValueKey& key) const {
    PoseSpace own = space_;
    std::vector<PlacedPose> seeds;
    const long before = own.closings();
    for (size_t r = 0; r < count_; ++r) own.Hold(settings_.ranged[r].coordinate, ValueOf(key, r));
    const auto offer = [&](const SpacePose& pose) {
      PlacedPose from, to;
      const VecX target = own.Target(pose.at.head(own.over()));
      if (own.Place(pose, &from) && own.Close(from, target, &to) &&
          to.pose.margin.minCoeff() > 0.0) {
        seeds.push_back(std::move(to));
      }
    };
    if (const auto near = beside_.find(key); near != beside_.end()) {
      for (const SpacePose& pose : near->second) offer(pose);
    }
    offer(start_.pose);
    for (const AtValue* neighbour : Neighbours(key)) {
      const auto& poses = neighbour->traced.inside;
      const size_t stride = std::isfinite(height_) ? StrideOf(*neighbour) : 1;
      for (size_t i = 0; i < poses.size(); i += stride) offer(poses[i]);
    }
    TracedSet traced;
    if (seeds.empty()) {
      traced.summary = RunSummary::Done();
      traced.measure = traced.error = 0.0;
    } else {
      traced = TraceFrom(own, seeds, height_);
    }
    // The tracer went on from what `own` had counted.
    traced.closings = (seeds.empty() ? own.closings() : traced.closings) - before;
    return traced;
  }

  // The measure of all sections together; returns the scan lines' share of its error.
  double Measure() {
    const bool flat = space_.over() == 2;
    line_ = 1.0;
    if (flat) {
      // Lines where all values, or some, have places.
      constexpr double kFar = std::numeric_limits<double>::infinity();
      std::vector<double> lows, highs;
      for (const auto& [key, value] : values_) {
        double low = kFar, high = -kFar;
        ForEachArc(value, [&](const TracedArc& arc) {
          for (const Vec2& p : arc.points) {
            low = std::min(low, p[1]);
            high = std::max(high, p[1]);
          }
        });
        lows.push_back(low);
        highs.push_back(high);
      }
      low_ = settings_.for_all ? std::ranges::max(lows) : std::ranges::min(lows);
      const double high = settings_.for_all ? std::ranges::min(highs) : std::ranges::max(highs);
      line_ = high > low_ ? (high - low_) / kLines : 0.0;
    }
    region_.clear();
    bool first = true;
    for (auto& [key, value] : values_) {
      FillRows(flat, key, &value);
      if (first) region_ = value.rows;
      for (size_t row = 0; row < region_.size() && !first; ++row) {
        region_[row] = Combined(region_[row], value.rows[row], settings_.for_all);
      }
      first = false;
    }
    double sum = 0.0, every_third = 0.0;
    for (size_t row = 0; row < region_.size(); ++row) {
      double length = 0.0;
      for (const auto& [a, b] : region_[row]) length += b - a;
      sum += length;
      if (row % 3 == 1) every_third += 3 * length;
    }
    set_.measure = sum * line_;
    return flat ? std::abs(sum - every_third) * line_ : 0.0;
  }

  template <typename F>
  static void ForEachArc(const AtValue& value, const F& f) {
    for (const TracedSection& section : value.traced.sections) {
      for (const TracedLoop& loop : section.loops) {
        for (const TracedArc& arc : loop.arcs) f(Resampled(arc, kFiner));
      }
    }
  }

  // An end where it is the first (or last) one along the range: between values by parabolas.
  [[nodiscard]] double EndAt(const ValueKey& key, size_t end) const {
    const double middle = values_.at(key).traced.ends[end].first;
    double sum = middle;
    for (size_t r = 0; r < count_; ++r) {
      std::array<double, 3> x = {-1.0, 0.0, 1.0}, y = {kNan, middle, kNan};
      for (const int sign : {-1, 1}) {
        ValueKey other = key;
        other.at(r) += sign * spacing_;
        const auto at = values_.find(other);
        if (at != values_.end() && at->second.traced.ends.size() == 2) {
          y.at(sign < 0 ? 0 : 2) = at->second.traced.ends[end].first;
        }
      }
      const double sign = (end == 1) == settings_.for_all ? 1.0 : -1.0;  // a least or a largest end
      if (!(sign * middle <= sign * y[0] && sign * middle <= sign * y[2])) continue;
      const Parabola p(x, y);
      if (p.square == 0.0) continue;
      sum += p.at(-0.5 * p.slope / p.square) - middle;
    }
    return sum;
  }

  void FillRows(bool flat, const ValueKey& key, AtValue* value) const {
    value->rows.assign(flat ? kLines : 1, {});
    if (!flat) {
      const auto& ends = value->traced.ends;
      if (ends.size() == 2) value->rows[0].emplace_back(EndAt(key, 0), EndAt(key, 1));
      return;
    }
    if (line_ == 0.0) return;
    std::vector<std::vector<double>> crossings(kLines);
    ForEachArc(*value, [&](const TracedArc& arc) {
      for (size_t k = 1; k < arc.points.size(); ++k) {
        const Vec2 &a = arc.points[k - 1], &b = arc.points[k];
        const auto [low, high] = std::minmax(a[1], b[1]);
        const auto first = static_cast<long>(std::ceil((low - low_) / line_ - 0.5));
        for (long row = std::max(first, 0L); row < kLines; ++row) {
          const double y = low_ + (static_cast<double>(row) + 0.5) * line_;
          if (y >= high) break;
          if (y < low) continue;
          crossings[static_cast<size_t>(row)].push_back(a[0] +
                                                        (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
        }
      }
    });
    for (size_t row = 0; row < kLines; ++row) {
      std::ranges::sort(crossings[row]);
      for (size_t k = 0; k + 1 < crossings[row].size(); k += 2) {
        value->rows[row].emplace_back(crossings[row][k], crossings[row][k + 1]);
      }
    }
  }

  [[nodiscard]] bool Holds(const std::vector<Spans>& rows, const VecX& p) const {
    if (space_.over() < 2) return Contains(rows[0], p[0]);
    const double row = (p[1] - low_) / line_;
    return row > -0.5 && row < kLines + 0.5 &&
           Contains(rows[static_cast<size_t>(std::clamp(row, 0.0, kLines - 1.0))], p[0]);
  }

  // Pieces of the boundaries that are the boundary of all together, and poses inside.
  void Collect() {
    TracedSection section;
    section.height = height_;
    section.area = set_.measure;
    section.error = set_.error;
    if (empty_ || line_ == 0.0) {
      set_.sections.push_back(std::move(section));
      return;
    }
    TracedLoop loop;
    std::array<std::pair<double, int>, 2> ends;
    bool first = true;
    for (const auto& [key, value] : values_) {
      for (const SpacePose& pose : value.traced.inside) {
        if (Holds(region_, pose.at)) set_.inside.push_back(pose);
      }
      for (size_t e = 0; e < value.traced.ends.size(); ++e) {
        const std::pair<double, int> end = {EndAt(key, e), value.traced.ends[e].second};
        const bool farther = (end.first > ends.at(e).first) == (e == 1);
        if (first || farther != settings_.for_all) ends.at(e) = end;
      }
      first = first && value.traced.ends.empty();
      if (space_.over() != 2) continue;
      const ValueKey& own = key;
      const auto add = [&](const TracedArc& arc) {
        TracedArc piece{arc.bound, {}};
        const auto end_piece = [&] {
          if (piece.points.size() > 1) loop.arcs.push_back(piece);
          piece.points.clear();
        };
        for (const Vec2& p : arc.points) {
          const bool keep = std::ranges::all_of(values_, [&](const auto& other) {
            return other.first == own || Holds(other.second.rows, p) == settings_.for_all;
          });
          if (keep) {
            piece.points.push_back(p);
          } else {
            end_piece();
          }
        }
        end_piece();
      };
      ForEachArc(value, add);
    }
    if (space_.over() == 2) {
      section.loops.push_back(std::move(loop));
      set_.sections.push_back(std::move(section));
    } else if (!first) {
      set_.ends.assign(ends.begin(), ends.end());
    }
  }

  const PoseSpace& space_;
  const SpaceSettings& settings_;
  const PlacedPose& start_;
  const int threads_;
  const std::function<void(double)>& progress_;
  const size_t count_;
  ResultLog* log_;
  const double height_, rests_;
  const PosesOfValues beside_;  // of the nearest sections
  int spacing_ = kFinest;
  std::map<ValueKey, AtValue> values_;
  std::vector<Spans> region_;
  double low_ = 0.0, line_ = 1.0, largest_error_ = 0.0;
  bool empty_ = false;  // all of the range is asked, and one value has no place
  TracedSet set_;
};

// Sections of a solid, and their integral over the heights by Gauss–Kronrod rules.
class RangeSolid {
 public:
  RangeSolid(const PoseSpace& space, const PlacedPose& start, int threads,
             const std::function<void(double)>& progress, ResultLog* log)
      : space_(space), start_(start), threads_(threads), progress_(progress), log_(log) {}

  TracedSet Trace() {
    TracedSet set;
    set.low = Climb(-1.0);
    set.high = Climb(1.0);
    const double length = set.high - set.low;
    double rule = 0.0;
    if (lost_.ok() && length > 0.0) {
      low_ = set.low;
      length_ = length;
      std::vector<Part> parts = {Rule(0.0, 1.0)};
      const auto sum = [&](double Part::*member) {
        double total = 0.0;
        for (const Part& part : parts) total += part.*member;
        return total;
      };
      const auto rests = [&] {
        return std::max(kRuleRests * sum(&Part::value), ErrorOfAreas(set.low, set.high));
      };
      while (lost_.ok() && sum(&Part::error) > rests() && sections_.size() < kMostRangeSections) {
        const auto worst = std::ranges::max_element(parts, {}, &Part::error);
        const double at = GapOf(*worst).value_or(0.5 * (worst->a + worst->b));
        const Part lower = Rule(worst->a, at);
        *worst = Rule(at, worst->b);
        parts.push_back(lower);
      }
      set.measure = sum(&Part::value);
      rule = sum(&Part::error);
    } else if (lost_.ok()) {
      lost_.stop = Stop::kUnreachable;
      lost_.message = "no place near the start has the range";
    }
    set.error = rule + beyond_ + ErrorOfAreas(set.low, set.high);
    for (auto& [height, section] : sections_) {
      set.closings += section.traced.closings;
      std::ranges::move(section.traced.inside, std::back_inserter(set.inside));
      std::ranges::move(section.traced.sections, std::back_inserter(set.sections));
    }
    set.closings += closings_;
    set.summary = lost_;
    return set;
  }

 private:
  struct Section {
    TracedSet traced;
    PosesOfValues poses;
    std::vector<Vec2> places;
    std::set<int> bounds = {};
  };
  // Of the variable u, 0 … 1, of heights low + length (3 u² − 2 u³): areas may have a root at both
  // ends.
  struct Part {
    double a, b, value = 0.0, error = 0.0;
  };

  // Gauss–Kronrod 7, 15, its error as QUADPACK has it [Piessens et al. 1983].
  Part Rule(double a, double b) {
    using Kronrod = boost::math::quadrature::gauss_kronrod<double, 15>;
    using Gauss = boost::math::quadrature::gauss<double, 7>;
    Part part{a, b};
    double gauss = 0.0, spread = 0.0;
    std::vector<std::pair<double, double>> values;
    for (size_t k = 0; k < Kronrod::abscissa().size(); ++k) {
      const double weight = 0.5 * (b - a) * Kronrod::weights()[k];
      for (const double sign : {-1.0, 1.0}) {
        if (k == 0 && sign > 0.0) continue;
        const double u = 0.5 * (a + b + sign * (b - a) * Kronrod::abscissa()[k]);
        const double height = heights_[u] = low_ + length_ * u * u * (3.0 - 2.0 * u);
        Report();
        const double y = AreaAt(height) * 6.0 * length_ * u * (1.0 - u);
        values.emplace_back(weight, y);
        part.value += weight * y;
        if (k % 2 == 0) gauss += 0.5 * (b - a) * Gauss::weights()[k / 2] * y;
      }
    }
    for (const auto& [weight, y] : values) {
      spread += weight * std::abs(y - part.value / (b - a));
    }
    part.error = std::abs(part.value - gauss);
    if (spread > 0.0 && !GapOf(part)) {
      part.error = spread * std::min(1.0, std::pow(200.0 * part.error / spread, 1.5));
    }
    return part;
  }
  // From section to section, and to both ends.
  [[nodiscard]] double ErrorOfAreas(double low, double high) const {
    double last = low, error = 0.0, sum = 0.0;
    for (const auto& [height, section] : sections_) {
      sum += 0.5 * (error + section.traced.error) * std::max(height - last, 0.0);
      last = std::max(height, low);
      error = section.traced.error;
    }
    return sum + 0.5 * error * std::max(high - last, 0.0);
  }
  // The middle of the widest gap of a part's sections that other bounds end from there on.
  [[nodiscard]] std::optional<double> GapOf(const Part& part) const {
    double widest = 0.0;
    std::optional<double> middle;
    for (auto below = heights_.upper_bound(part.a); below != heights_.end(); ++below) {
      const auto above = std::next(below);
      if (above == heights_.end() || above->first >= part.b) break;
      const double at = 0.5 * (below->first + above->first);
      const auto one = sections_.find(below->second), other = sections_.find(above->second);
      if (above->first - below->first <= widest || one == sections_.end() ||
          other == sections_.end() || one->second.bounds == other->second.bounds ||
          std::min(at - part.a, part.b - at) < kSliverOfPart * (part.b - part.a)) {
        continue;
      }
      widest = above->first - below->first;
      middle = at;
    }
    return middle;
  }

  void Report() const {
    if (progress_) progress_(1.0 - 1.0 / (1.0 + 0.05 * static_cast<double>(sections_.size())));
  }

  double AreaAt(double height) {
    if (!lost_.ok()) return 0.0;
    const auto known = sections_.find(height);
    if (known != sections_.end()) return known->second.traced.measure;
    PosesOfValues beside;
    const auto offer = [&](const Section& section) {
      for (const auto& [key, poses] : section.poses) {
        beside[key].insert(beside[key].end(), poses.begin(), poses.end());
      }
    };
    auto above = sections_.lower_bound(height), below = above;
    for (size_t k = 0; k < kSectionsBeside && above != sections_.end(); ++k)
      offer((above++)->second);
    for (size_t k = 0; k < kSectionsBeside && below != sections_.begin(); ++k) {
      offer((--below)->second);
    }
    PoseSpace flat = space_.Section(2);
    flat.Hold(2, height);
    RangeTracer tracer(flat, start_, threads_, {}, log_, height, std::move(beside),
                       kSectionRests * largest_);
    TracedSet traced = tracer.Trace();
    if (!traced.summary.ok()) {
      lost_ = traced.summary;
      lost_.message = fmt::format("section at {:.6g}: {}", height, lost_.message);
      return 0.0;
    }
    const double area = traced.measure;
    largest_ = std::max(largest_, area);
    Section& section = sections_[height];
    section = {std::move(traced), tracer.Poses(), tracer.Places()};
    for (const TracedLoop& loop : section.traced.sections[0].loops) {
      for (const TracedArc& arc : loop.arcs) section.bounds.insert(arc.bound);
    }
    return area;
  }

  // Where the ways up (or down) from a section's places end: first (all) or last (some).
  [[nodiscard]] double TopOf(const Section& section, double sign) {
    const SpaceSettings& settings = space_.settings();
    // Places of each value, by its nearest pose.
    std::vector<std::pair<const ValueKey*, const std::vector<SpacePose>*>> values;
    for (const auto& [key, poses] : section.poses) {
      bool coarse = true;
      for (const int i : key) coarse = coarse && i % (RangeTracer::kFinest / kFewestValues) == 0;
      if (coarse) values.emplace_back(&key, &poses);
    }
    std::vector<double> ends(section.places.size() * values.size(), kNan);
    std::atomic<long> closings = 0;
    const auto walk = [&](size_t i) {
      const auto& [key, poses] = values[i % values.size()];
      const Vec2& place = section.places[i / values.size()];
      PoseSpace own = space_;
      const long before = own.closings();
      for (size_t r = 0; r < settings.ranged.size(); ++r) {
        own.Hold(settings.ranged[r].coordinate, poses->front().at[settings.ranged[r].coordinate]);
      }
      const auto nearest = std::ranges::min_element(*poses, {}, [&](const SpacePose& pose) {
        return (pose.at.head<2>() - place).squaredNorm();
      });
      PlacedPose from, at;
      VecX target = nearest->at;
      target.head<2>() = place;
      if (own.Place(*nearest, &from) && own.Close(from, target, &at) &&
          at.pose.margin.minCoeff() >= 0.0) {
        const auto end = EndOfWay(own, at, sign * own.UnitOf(2) * VecX::Unit(3, 2));
        if (end) ends[i] = end->at[2];
      }
      closings += own.closings() - before;
    };
    OnThreads(ends.size(), threads_, walk);
    closings_ += closings;
    double top = kNan;
    for (size_t p = 0; p < section.places.size(); ++p) {
      double end = kNan;
      for (size_t v = 0; v < values.size(); ++v) {
        const double of = ends[p * values.size() + v];
        // A value that does not reach the place ends nothing of some.
        if (settings.for_all && !std::isfinite(of)) {
          end = kNan;
          break;
        }
        const bool farther = sign * (of - end) > 0.0;
        if (!std::isfinite(end) || farther != settings.for_all) end = of;
      }
      if (!(sign * (top - end) >= 0.0) && std::isfinite(end)) top = end;
    }
    return top;
  }

  // Up (or down) to the last section that there is.
  double Climb(double sign) {
    double height = start_.pose.at[2], best = height;
    for (int i = 0; i < kMostClimbs && AreaAt(height) > 0.0; ++i) {
      Report();
      const double top = TopOf(sections_.at(height), sign), gain = sign * (top - best);
      if (!(gain > 0.0)) break;
      best = top;
      const double last = AreaAt(height);
      height = best - sign * kBelow * gain;
      if (gain < kBelow * std::abs(best - start_.pose.at[2]) || i + 1 == kMostClimbs) {
        beyond_ += last * gain;
        break;
      }
    }
    return best;
  }

  const PoseSpace& space_;
  const PlacedPose& start_;
  const int threads_;
  const std::function<void(double)>& progress_;
  ResultLog* log_;
  std::map<double, Section> sections_;
  std::map<double, double> heights_;  // of u
  double low_ = 0.0, length_ = 0.0;
  RunSummary lost_ = RunSummary::Done();
  double largest_ = 0.0, beyond_ = 0.0;  // area; volume behind the last sections
  long closings_ = 0;
};

}  // namespace

TracedSet TraceRange(const PoseSpace& space, const PlacedPose& start, int threads,
                     const std::function<void(double)>& progress, ResultLog log) {
  const auto began = std::chrono::steady_clock::now();
  TracedSet set = space.over() > 2 ? RangeSolid(space, start, threads, progress, &log).Trace()
                                   : RangeTracer(space, start, threads, progress, &log).Trace();
  set.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return set;
}

}  // namespace mbv
