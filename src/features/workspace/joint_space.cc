#include "features/workspace/joint_space.h"

#include <fmt/format.h>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <set>

#include "base/text.h"
#include "kinematics/constraints.h"
#include "plot/svg_plot.h"
#include "report/page.h"

namespace mbv {
namespace {

constexpr int kLeastWalks = 8, kMostWalks = 64;  // from every way
constexpr int kHits = 5;                         // of each curve by walks, on the average
constexpr int kMostNewton = 12;                  // steps to a fold that a walk passes by
constexpr int kWalkSteps = 400;
constexpr double kWalkStep = 0.08;  // [rad, characteristic lengths]
constexpr double kFoldStep = 0.02, kLongestFoldStep = 0.03, kLeastFoldStep = 1e-7;
constexpr int kMostFoldSteps = 8000;
constexpr double kOnFold = 1e-12;   // of f, which is 1 at home
constexpr double kAtEnd = 1e-3;     // of a curve that leaves the ranges
constexpr double kAtCusp = 1e-6;    // of h by the slope of f
constexpr double kSameFold = 5e-3;  // chords of a curve stay within it

class FoldTracer {
 public:
  FoldTracer(const Mechanism& mechanism, const std::vector<NamedCoordinate>& drives,
             const VecX& values)
      : space_(mechanism, Settings(drives, values)) {
    for (size_t b = 0; b < space_.bounds().size(); ++b) {
      if (space_.bounds()[b].kind == SetBound::Kind::kType1) fold_ = static_cast<int>(b);
    }
  }
  [[nodiscard]] bool Ready() {
    if (!space_.Home(&home_) || std::abs(home_.type1) < 1e-10) return false;
    space_.CountFrom(&home_);
    return true;
  }
  [[nodiscard]] const PoseSpace& space() const { return space_; }

  [[nodiscard]] bool Place(const SpacePose& from, PlacedPose* to) const {
    SpacePose pose = home_.pose;
    pose.X_FM = from.X_FM;
    pose.coupled = from.coupled;
    pose.watched.resize(0);
    return space_.Place(pose, to);
  }

  // Straight on until f changes its sign, and on; the poses where it does. Where |f| is least on
  // the way, the fold may be near: small closed ones lie between two steps.
  void Walk(const PlacedPose& start, unsigned seed, std::vector<PlacedPose>* folds) const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    VecX way = start.N_free * Eigen::Vector2d(normal(random), normal(random));
    PlacedPose at = start;
    double before = 0.0;  // |f| a step ago
    for (int i = 0; i < kWalkSteps; ++i) {
      Eigen::Vector2d along = at.N_free.transpose() * way;
      if (!(along.norm() > 1e-6)) return;
      along.normalize();
      PlacedPose next;
      double h = kWalkStep;
      while (!space_.Step(at, h * along, &next)) {
        h *= 0.5;
        if (h < kLeastFoldStep) return;
      }
      if (!Within(next)) {  // on in another direction
        way = at.N_free * Eigen::Vector2d(normal(random), normal(random));
        continue;
      }
      way = at.N_free * along;
      if ((at.type1 < 0.0) != (next.type1 < 0.0)) {
        PlacedPose fold;
        if (Across(at, h * along, next.type1, &fold)) folds->push_back(std::move(fold));
      } else if (const double f = std::abs(at.type1); f < before && f < std::abs(next.type1)) {
        PlacedPose fold;
        if (Descend(at, &fold) && Within(fold)) folds->push_back(std::move(fold));
      }
      before = std::abs(at.type1);
      at = std::move(next);
    }
  }

  // The ranges of drives and joints, and cones.
  [[nodiscard]] bool Within(const PlacedPose& at) const {
    for (size_t b = 0; b < space_.bounds().size(); ++b) {
      if (IsSingularity(space_.bounds()[b].kind)) continue;
      if (at.pose.margin[static_cast<Eigen::Index>(b)] < 0.0) return false;
    }
    return true;
  }

  struct Node {
    PlacedPose at;
    Eigen::Vector2d tangent, slope;
    double h = kNan;
    VecX kernel;  // N v
  };
  // What (1) needs, oriented as the node before.
  [[nodiscard]] bool Look(const Node* before, Node* node) const {
    const VecX slope = space_.Slope(node->at, fold_);
    if (!(slope.norm() > 1e-12)) return false;
    node->slope = slope;
    node->tangent = Eigen::Vector2d(slope[1], -slope[0]).normalized();
    const Eigen::JacobiSVD<MatX> svd(node->at.C_free, Eigen::ComputeFullV);
    Eigen::Vector2d v = svd.matrixV().col(1);
    if (before != nullptr) {
      if ((before->at.N_free * before->tangent).dot(node->at.N_free * node->tangent) < 0.0) {
        node->tangent = -node->tangent;
      }
      if (before->kernel.dot(node->at.N_free * v) < 0.0) v = -v;
    }
    node->kernel = node->at.N_free * v;
    node->h = slope.dot(v);
    return true;
  }
  // Along the curve by about s: back onto f = 0 across the tangent.
  [[nodiscard]] bool Along(const Node& from, double s, Node* to) const {
    const Eigen::Vector2d n = from.slope.normalized();
    double a = 0.0, b = 0.0, f_a = 0.0;
    for (int i = 0; i < 12; ++i) {
      if (!space_.Step(from.at, s * from.tangent + b * n, &to->at)) return false;
      const double f_b = to->at.type1;
      if (std::abs(f_b) < kOnFold) return Look(&from, to);
      double step = -f_b / from.slope.norm();
      if (i > 0 && f_b != f_a) step = -f_b * (b - a) / (f_b - f_a);
      if (!std::isfinite(step) || std::abs(b + step) > std::abs(s)) return false;
      if (std::abs(step) < 1e-15) return Look(&from, to);
      a = b;
      f_a = f_b;
      b += step;
    }
    return false;
  }

  // Poses as points of one space [rad, characteristic lengths].
  [[nodiscard]] VecX Point(const PlacedPose& at) const {
    const std::vector<Pose>& X = at.pose.X_FM;
    VecX point(12 * static_cast<Eigen::Index>(X.size()));
    for (size_t j = 0; j < X.size(); ++j) {
      const auto k = 12 * static_cast<Eigen::Index>(j);
      point.segment<3>(k) = X[j].translation() / space_.length();
      point.segment<9>(k + 3) = X[j].linear().reshaped();
    }
    return point;
  }

 private:
  static SpaceSettings Settings(const std::vector<NamedCoordinate>& drives, const VecX& values) {
    SpaceSettings settings;
    settings.coordinates = drives;
    settings.over = 2;
    settings.held = values.tail(values.size() - 2);
    return settings;
  }
  // Between at and at + step (f₁ there) to f = 0 (Illinois).
  [[nodiscard]] bool Across(const PlacedPose& at, const Eigen::Vector2d& step, double f1,
                            PlacedPose* to) const {
    const auto value = [&](double c, double* f) {
      if (!space_.Step(at, c * step, to)) return false;
      *f = to->type1;
      return true;
    };
    return FindCrossing(0.0, at.type1, 1.0, f1, value,
                        [](double f, double /*width*/) { return std::abs(f) < kOnFold; });
  }

  // From a pose near a fold straight to it (Newton).
  [[nodiscard]] bool Descend(const PlacedPose& start, PlacedPose* to) const {
    *to = start;
    for (int i = 0; i < kMostNewton; ++i) {
      if (std::abs(to->type1) < kOnFold) return true;
      const VecX slope = space_.Slope(*to, fold_);
      const VecX step = -to->type1 / slope.squaredNorm() * slope;
      PlacedPose next;
      if (!(step.norm() < 2 * kWalkStep) || !space_.Step(*to, step, &next)) return false;
      *to = std::move(next);
    }
    return false;
  }

  PoseSpace space_;
  PlacedPose home_;
  int fold_ = -1;
};

double OffSegment(const VecX& a, const VecX& b, const VecX& p) {
  const VecX along = b - a;
  const double share = std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (a + share * along - p).norm();
}

// The curve through a fold in both directions, or until it closes, with its cusps.
bool TraceFold(const Mechanism& mechanism, const FoldTracer& tracer, const PlacedPose& fold,
               std::vector<VecX>* points, std::vector<VecX>* cusp_points,
               JointSpaceCurves* result) {
  FoldTracer::Node start;
  start.at = fold;
  if (!tracer.Look(nullptr, &start)) return false;
  const VecX start_point = tracer.Point(start.at);
  const size_t index = result->curves.size();
  JointCurve& curve = result->curves.emplace_back();
  bool whole = true;
  for (const double sense : {1.0, -1.0}) {
    FoldTracer::Node at = start;
    at.tangent *= sense;
    points->push_back(start_point);
    curve.points.push_back(at.at.pose.at.head<2>());
    double s = kFoldStep;
    for (int i = 0; i < kMostFoldSteps && !curve.closed; ++i) {
      FoldTracer::Node next;
      while (!tracer.Along(at, s, &next)) {
        s *= 0.5;
        if (s < kLeastFoldStep) break;
      }
      if (s < kLeastFoldStep) {
        whole = false;
        break;
      }
      if (!tracer.Within(next.at)) {  // up to the range's end
        if (s < kAtEnd) break;
        s *= 0.5;
        continue;
      }
      const VecX point = tracer.Point(next.at);
      curve.closed =
          i > 4 && OffSegment(points->back(), point, start_point) < kSameFold &&
          (start.at.N_free * start.tangent * sense).dot(next.at.N_free * next.tangent) > 0.0;
      // Where h vanishes all along, the mechanism moves while the drives rest.
      const double most_h = std::max(std::abs(at.h), std::abs(next.h));
      const bool rests = most_h < kAtCusp * next.slope.norm();
      curve.rests = curve.rests || rests;
      if (!rests && (at.h < 0.0) != (next.h < 0.0)) {
        // The cusp between both (Illinois).
        double a = 0.0, h_a = at.h, b = s, h_b = next.h;
        FoldTracer::Node cusp = next;
        for (int k = 0; k < 60 && std::abs(b - a) > 1e-14 && cusp.h != 0.0; ++k) {
          const double c = k % 16 == 15 ? 0.5 * (a + b) : b - h_b * (b - a) / (h_b - h_a);
          if (!tracer.Along(at, c, &cusp)) break;
          if ((cusp.h < 0.0) != (h_b < 0.0)) {
            a = b;
            h_a = h_b;
          } else {
            h_a *= 0.5;
          }
          b = c;
          h_b = cusp.h;
        }
        // Where curves cross, h jumps.
        if (!(std::abs(cusp.h) < kAtCusp * cusp.slope.norm())) {
          whole = false;
          break;
        }
        const BodyStates states = tracer.space().States(cusp.at.pose);
        const VecX here = tracer.Point(cusp.at);
        const bool is_known = std::ranges::any_of(
            *cusp_points, [&](const VecX& known) { return (known - here).norm() < kSameFold; });
        if (!is_known) {
          cusp_points->push_back(here);
          result->cusps.push_back({DriveValues(mechanism, states), OutputValues(mechanism, states),
                                   states.X_WB, index});
        }
        curve.points.push_back(cusp.at.pose.at.head<2>());
      }
      points->push_back(point);
      curve.points.push_back(next.at.pose.at.head<2>());
      at = std::move(next);
      s = std::min(1.3 * s, kLongestFoldStep);
    }
    if (curve.closed) return true;
    // From the other end on to the start.
    std::ranges::reverse(*points);
    std::ranges::reverse(curve.points);
    points->pop_back();
    curve.points.pop_back();
  }
  return whole;
}

}  // namespace

JointSpaceCurves TraceJointSpace(const Mechanism& mechanism,
                                 const std::vector<NamedCoordinate>& drives, const VecX& values,
                                 int threads, const std::function<void(double)>& progress) {
  JointSpaceCurves result;
  for (size_t k = 0; k < 2; ++k) {
    result.over.push_back(drives[k].name);
    result.units.push_back(CoordinateUnit(mechanism, drives[k].coordinate));
  }
  FoldTracer tracer(mechanism, drives, values);
  if (!tracer.Ready()) {
    result.summary.stop = Stop::kSingular;
    result.summary.message = "the drives do not hold the mechanism at home";
    return result;
  }
  const AssemblyModes modes = FindModes(mechanism, drives, values, {.threads = threads});
  result.summary = modes.summary;
  if (!modes.summary.ok()) return result;
  result.ways = modes.modes.size();
  std::vector<PlacedPose> starts;
  for (const AssemblyMode& mode : modes.modes) {
    PlacedPose start;
    if (tracer.Place(mode.pose, &start)) starts.push_back(std::move(start));
  }
  std::vector<std::vector<VecX>> known;  // points of the curves
  std::vector<int> hits;                 // walks that met them
  std::vector<VecX> cusp_points;
  // The rule of modes.h: until each curve was met more than once, and all often.
  const auto settled = [&] {
    return std::ranges::find(hits, 1) == hits.end() &&
           std::accumulate(hits.begin(), hits.end(), 0) >= kHits * static_cast<int>(hits.size());
  };
  for (int w = 0; w < kMostWalks && (w < kLeastWalks || !settled()); ++w) {
    for (size_t k = 0; k < starts.size(); ++k) {
      std::vector<PlacedPose> folds;
      tracer.Walk(starts[k], static_cast<unsigned>(1000 * k) + static_cast<unsigned>(w), &folds);
      std::set<size_t> met;
      for (const PlacedPose& fold : folds) {
        const VecX point = tracer.Point(fold);
        const auto curve = std::ranges::find_if(known, [&](const std::vector<VecX>& points) {
          for (size_t i = 1; i < points.size(); ++i) {
            if (OffSegment(points[i - 1], points[i], point) < kSameFold) return true;
          }
          return false;
        });
        met.insert(static_cast<size_t>(curve - known.begin()));
        if (curve != known.end()) continue;
        known.emplace_back();
        hits.push_back(0);
        if (!TraceFold(mechanism, tracer, fold, &known.back(), &cusp_points, &result)) {
          result.summary.stop = Stop::kNoConvergence;
          result.summary.message = "a type-2 curve cannot be followed where it crosses another one";
        }
      }
      for (const size_t curve : met) ++hits[curve];
    }
    if (progress) progress(std::min(1.0, (w + 1.0) / kLeastWalks));
  }
  return result;
}

JointSpaceCurves JointSpaceOf(const SetQuestion& question, int threads,
                              const std::function<void(double)>& progress,
                              Diagnostics* diagnostics) {
  const Mechanism& m = question.mechanism;
  const std::vector<NamedCoordinate>& coordinates = question.settings.coordinates;
  const bool of_drives = std::ranges::all_of(coordinates, [](const NamedCoordinate& named) {
    return named.coordinate.kind == Coordinate::Kind::kDrive ||
           named.coordinate.kind == Coordinate::Kind::kPrescribed;
  });
  if (question.settings.over != 2 || !of_drives || coordinates.size() != m.drives.size()) {
    diagnostics->AddError("--joint-space", "two drives are needed, and the others held",
                          "--over DRIVE,DRIVE --at DRIVE=VALUE");
    return {};
  }
  return TraceJointSpace(m, coordinates, question.start, threads, progress);
}

namespace {

ReportSection CurvesSection(const Mechanism& mechanism, const JointSpaceCurves& curves) {
  ReportSection section{.title = "Type-2 curves over " + Joined(curves.over), .link = "Curves"};
  const auto open =
      std::ranges::count_if(curves.curves, [](const JointCurve& c) { return !c.closed; });
  section.Add(Paragraph{fmt::format(
      "{} type-2 curves over {}{} with {} cusps, from {} ways to close.", curves.curves.size(),
      Joined(curves.over), open > 0 ? fmt::format(" ({} not closed)", open) : "",
      curves.cusps.size(), curves.ways)});
  if (std::ranges::any_of(curves.curves, [](const JointCurve& c) { return c.rests; })) {
    section.Add(Paragraph{"The mechanism moves there while all drives rest (self-motion)."});
  }
  Table table{.name = "cusps", .columns = {Digits("cusp"), Digits("curve")}};
  for (const Drive& drive : mechanism.drives) table.columns.push_back(Digits(drive.name));
  for (size_t k = 0; k < curves.cusps.size(); ++k) {
    const Cusp& cusp = curves.cusps[k];
    std::vector<Cell> row = {fmt::format("{}", k + 1), fmt::format("{}", cusp.curve + 1)};
    for (size_t d = 0; d < mechanism.drives.size(); ++d) {
      row.emplace_back(fmt::format("{:.8g} {}", cusp.drives[static_cast<Eigen::Index>(d)],
                                   PositionUnit(mechanism, mechanism.drives[d])));
    }
    table.rows.push_back(std::move(row));
  }
  section.Add(std::move(table));
  section.Note(
      "On a curve two ways to close for the same drives fall together, at a cusp three: a path "
      "around it leads from one way to another without a singular pose. Curves are those of the "
      "surface of poses that hangs together with the ways that were found.",
      On::kAll);
  LinePlot plot{.title = section.title,
                .x_label = fmt::format("{} [{}]", curves.over[0], curves.units[0]),
                .y_label = fmt::format("{} [{}]", curves.over[1], curves.units[1]),
                .lines = {}};
  for (size_t k = 0; k < curves.curves.size(); ++k) {
    PlotLine line{.label = fmt::format("curve {}", k + 1), .points = {}};
    for (const Eigen::Vector2d& p : curves.curves[k].points) line.points.emplace_back(p[0], p[1]);
    plot.lines.push_back(std::move(line));
  }
  section.Add(Drawing{ToSvg(plot)}, On::kPage);
  return section;
}

}  // namespace

std::string ToText(const Mechanism& mechanism, const JointSpaceCurves& curves,
                   const TextStyle& style) {
  return ToText(CurvesSection(mechanism, curves), style);
}

nlohmann::ordered_json ToJson(const Mechanism& mechanism, const JointSpaceCurves& curves) {
  auto cusps = nlohmann::ordered_json::array(), list = nlohmann::ordered_json::array();
  for (const Cusp& cusp : curves.cusps) {
    auto drives = nlohmann::ordered_json::object();
    for (size_t d = 0; d < mechanism.drives.size(); ++d) {
      drives[mechanism.drives[d].name] = Number(cusp.drives[static_cast<Eigen::Index>(d)]);
    }
    cusps.push_back({{"curve", cusp.curve}, {"drives", std::move(drives)}});
  }
  for (const JointCurve& curve : curves.curves) {
    list.push_back(
        {{"closed", curve.closed}, {"rests", curve.rests}, {"nodes", curve.points.size()}});
  }
  return {{"over", curves.over},
          {"units", curves.units},
          {"ways", curves.ways},
          {"curves", std::move(list)},
          {"cusps", std::move(cusps)}};
}

std::vector<std::pair<std::string, std::string>> JointSpaceFiles(const Mechanism& mechanism,
                                                                 const JointSpaceCurves& curves) {
  Page page;
  page.Add(CurvesSection(mechanism, curves));
  std::string csv = fmt::format("curve,{}_{},{}_{}\n", curves.over[0], curves.units[0],
                                curves.over[1], curves.units[1]);
  for (size_t k = 0; k < curves.curves.size(); ++k) {
    for (const Eigen::Vector2d& p : curves.curves[k].points) {
      csv += fmt::format("{},{:.17g},{:.17g}\n", k + 1, p[0], p[1]);
    }
  }
  return {{"joint_space.html",
           page.Write({.kicker = "mbverify workspace",
                       .title = mechanism.name,
                       .lead = fmt::format("{} type-2 curves, {} cusps", curves.curves.size(),
                                           curves.cusps.size()),
                       .judges = false})},
          {"joint_space.csv", csv}};
}

}  // namespace mbv
