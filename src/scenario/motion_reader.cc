#include "scenario/motion_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/channel.h"
#include "core/spatial.h"
#include "core/text.h"
#include "core/word_hints.h"
#include "scenario/blended_path_reader.h"
#include "scenario/coordinate_names.h"
#include "scenario/free_motion_reader.h"
#include "scenario/profile_reader.h"
#include "scenario/state_function_reader.h"
#include "table/motion_table.h"
#include "table/pose_table.h"

namespace mbv {
namespace {

constexpr double kMostSamples = 1e6;

bool SameCoordinate(const Coordinate& a, const Coordinate& b) {
  return a.kind == b.kind && a.index == b.index && a.component == b.component;
}

class MotionReader {
 public:
  MotionReader(ValueReader* values, const Mechanism& mechanism, const MotionTimes& otherwise,
               Diagnostics* files)
      : values_(values),
        mechanism_(mechanism),
        otherwise_(otherwise),
        names_(CoordinateNames(mechanism)),
        tables_{.mechanism = &mechanism, .files = files} {}

  Motion Read(const YamlNode* node, const YamlNode* loads, const YamlNode* forces) {
    YamlMap map(&yaml(), node, "motion",
                {"duration_s", "sample_s", "commands", "equal", "path", "pose_table", "initial",
                 "initial_rates"});
    if (const YamlNode* commands = map.Find("commands")) ReadCommands(*commands);
    if (const YamlNode* equal = map.Find("equal")) ReadEqual(*equal);
    if (const YamlNode* pose = map.Find("pose_table")) ReadPoseTable(*pose);
    double path_end_s = kNan;
    if (const YamlNode* path = map.Find("path")) path_end_s = ReadPath(*path);
    ReadTimes(map, path_end_s);
    if (loads != nullptr) ReadLoads(*loads);
    if (map.valid() && node != nullptr && IsFree(node, forces)) {
      ReadFreeMotion(values_, mechanism_, *node, forces, &tables_, &motion_);
    } else if (map.valid() && motion_.commands.empty() && !yaml().has_errors() && node != nullptr) {
      yaml().Error(*node, "motion commands nothing",
                   "give commands, equal, path or pose_table; or forces and initial values");
    }
    TakeTables();
    return motion_;
  }

 private:
  YamlReader& yaml() { return values_->yaml(); }

  // Every table must last as long as the motion.
  void TakeTables() {
    for (size_t i = 0; i < tables_.loaded.size() && times_known_; ++i) {
      CheckCover(tables_.loaded[i], *tables_.places[i].node, tables_.places[i].path,
                 motion_.duration_s, &yaml());
    }
    motion_.tables = std::move(tables_.loaded);
  }

  // The shortest of the commands' tables, if any ends.
  [[nodiscard]] std::optional<double> TableEnd() const {
    std::optional<double> end_s;
    if (tables_.failed) end_s = 1.0;  // it is not known, and no second finding
    for (const MotionTable& table : tables_.loaded) {
      if (!table.periodic) end_s = std::min(end_s.value_or(table.to_s), table.to_s);
    }
    return end_s;
  }

  void ReadTimes(const YamlMap& map, double path_end_s) {
    if (!map.valid() || map.node() == nullptr) return;
    std::optional<double> duration_s = path_end_s;
    if (std::isnan(path_end_s)) {
      duration_s = otherwise_.duration_s ? otherwise_.duration_s : TableEnd();
    }
    if (!duration_s || map.Has("duration_s")) {
      duration_s = values_->RequiredPositive(map, "duration_s");
    }
    motion_.sample_s = otherwise_.sample_s.value_or(motion_.sample_s);
    if (const YamlNode* sample = map.Find("sample_s")) {
      motion_.sample_s = values_->Positive(*sample, "motion.sample_s").value_or(motion_.sample_s);
    }
    if (!duration_s) return;
    times_known_ = true;
    motion_.duration_s = *duration_s;
    if (motion_.sample_s > motion_.duration_s ||
        motion_.duration_s / motion_.sample_s > kMostSamples) {
      yaml().Error(*map.node(), fmt::format("motion.sample_s = {} and duration_s = {} violate "
                                            "1 <= duration_s/sample_s <= {:g}",
                                            motion_.sample_s, motion_.duration_s, kMostSamples));
    }
  }

  // A coordinate by name; a finding names the closest one.
  std::optional<Coordinate> FindCoordinate(const YamlEntry& entry, const std::string& path) {
    const auto found = std::find(names_.begin(), names_.end(), entry.key);
    if (found != names_.end()) {
      return CoordinateAt(mechanism_, static_cast<size_t>(found - names_.begin()));
    }
    yaml().Error(entry,
                 fmt::format("{}: {} has no coordinate '{}'", path, mechanism_.name, entry.key),
                 DidYouMean(entry.key, names_,
                            "known: prescribed joints, drives, and OUTPUT.x … OUTPUT.yaw: " +
                                Joined(names_, 12)));
    return {};
  }

  void AddCommand(const YamlEntry& entry, Command command) {
    for (const Command& other : motion_.commands) {
      const bool same = other.terms.size() == 1 && command.terms.size() == 1 &&
                        SameCoordinate(other.terms[0].coordinate, command.terms[0].coordinate);
      if (same || other.name == command.name) {
        yaml().Error(entry, fmt::format("motion commands '{}' twice", command.name));
        return;
      }
    }
    motion_.commands.push_back(std::move(command));
  }

  void ReadCommands(const YamlNode& node) {
    for (const YamlEntry& entry : yaml().Entries(node, "motion.commands")) {
      const std::string path = "motion.commands." + entry.key;
      const auto coordinate = FindCoordinate(entry, "motion.commands");
      if (!coordinate) continue;
      const ProfileContext context{.unit = CoordinateUnit(mechanism_, *coordinate),
                                   .home = HomeValue(mechanism_, *coordinate),
                                   .name = entry.key,
                                   .moves = true,
                                   .tables = &tables_};
      AddCommand(entry, {.name = entry.key,
                         .terms = {{*coordinate, 1.0}},
                         .profile = ReadProfile(values_, *entry.value, path, context)});
    }
  }

  void ReadPoseTable(const YamlNode& node) {
    PoseTable pose = LoadPoseTable(values_, node, mechanism_, tables_.files);
    tables_.failed = tables_.failed || pose.components.empty();
    const YamlEntry place{"pose_table", node.line, node.column, nullptr};
    for (PoseComponent& part : pose.components) {
      const Coordinate coordinate{Coordinate::Kind::kOutput, pose.output, part.component};
      AddCommand(place, {.name = part.table.name,
                         .terms = {{coordinate, 1.0}},
                         .profile = {{PiecewiseTerm{part.table.spline}}}});
      tables_.places.push_back({node.Find("csv"), "motion.pose_table"});
      tables_.loaded.push_back(std::move(part.table));
    }
  }

  static YamlEntry AsEntry(const YamlNode& node) {
    return {node.text, node.line, node.column, nullptr};
  }

  void ReadEqual(const YamlNode& node) {
    const auto pairs = yaml().Items(node, "motion.equal");
    if (!pairs) return;
    for (size_t i = 0; i < pairs->size(); ++i) {
      const std::string path = fmt::format("motion.equal[{}]", i);
      const auto items = yaml().Items(*(*pairs)[i], path, 2);
      if (!items || !yaml().Text(*(*items)[0], path) || !yaml().Text(*(*items)[1], path)) continue;
      const YamlEntry a = AsEntry(*(*items)[0]), b = AsEntry(*(*items)[1]);
      const auto ca = FindCoordinate(a, path), cb = FindCoordinate(b, path);
      if (!ca || !cb) continue;
      if (SameCoordinate(*ca, *cb) ||
          CoordinateUnit(mechanism_, *ca) != CoordinateUnit(mechanism_, *cb)) {
        yaml().Error(*(*pairs)[i], fmt::format("{}: {} and {} are not two coordinates of one unit",
                                               path, a.key, b.key));
        continue;
      }
      AddCommand(a, {.name = a.key + " - " + b.key,
                     .terms = {{*ca, 1.0}, {*cb, -1.0}},
                     .profile = Constant(0.0)});
    }
  }

  // Way points with rest at each; returns when the path ends [s].
  double ReadPath(const YamlNode& node) {
    std::vector<std::string> keys = {"outputs", "points",  "points_mm", "v_max",   "a_max",
                                     "law",     "start_s", "blend",     "blend_mm"};
    const bool blends =
        node.is_map() && (node.Find("blend") != nullptr || node.Find("blend_mm") != nullptr);
    if (blends) keys.emplace_back("j_max");
    const YamlMap map(&yaml(), &node, "motion.path", keys);
    if (!map.valid()) return kNan;
    if (blends) return ReadBlended(map, ReadBlendedPlan(values_, map));
    const std::vector<Command> axes = ReadPathOutputs(map);
    const auto v_max = values_->RequiredPositive(map, "v_max");
    const auto a_max = values_->RequiredPositive(map, "a_max");
    const double start_s = values_->InUnit(map, "start_s", {kPlain}).value_or(0.0);
    bool full = false;
    if (const YamlNode* law = map.Find("law")) {
      full = yaml().Choice(*law, "motion.path.law", {"ramp_cruise", "full"}).value_or(0) == 1;
    }
    const std::vector<VecX> points = ReadPoints(map, axes.size());
    if (axes.empty() || points.size() < 2 || !v_max || !a_max) return kNan;
    return BuildPath(node, axes, points, *v_max, *a_max, full, start_s);
  }

  // The corners are rounded; the end of the path, or NaN after a finding.
  double ReadBlended(const YamlMap& map, std::optional<PolylinePlan> plan) {
    std::vector<Command> axes = ReadPathOutputs(map);
    const std::vector<VecX> points = ReadPoints(map, axes.size());
    if (!plan || axes.empty() || points.size() < 2) return kNan;
    plan->points = points;
    const auto paths = PlanPath(&yaml(), *map.node(), *plan);
    if (paths.empty()) return kNan;
    const YamlEntry place{"path", map.node()->line, map.node()->column, nullptr};
    for (size_t k = 0; k < axes.size(); ++k) {
      axes[k].profile.terms.emplace_back(
          PiecewiseTerm{std::make_shared<const Piecewise>(paths[k])});
      AddCommand(place, std::move(axes[k]));
    }
    return paths[0].breaks.back();
  }

  std::vector<Command> ReadPathOutputs(const YamlMap& map) {
    std::vector<Command> axes;
    const YamlNode* node = map.Required("outputs");
    const auto items = node == nullptr ? std::nullopt : yaml().Items(*node, "motion.path.outputs");
    if (!items) return {};
    for (const YamlNode* item : *items) {
      if (!yaml().Text(*item, "motion.path.outputs")) continue;
      const auto coordinate = FindCoordinate(AsEntry(*item), "motion.path.outputs");
      if (!coordinate) continue;
      if (CoordinateUnit(mechanism_, *coordinate) != "m") {
        yaml().Error(*item, fmt::format("motion.path.outputs: {} is no length", item->text),
                     "v_max and a_max are in m/s and m/s²; command angles under motion.commands");
        continue;
      }
      axes.push_back({.name = item->text, .terms = {{*coordinate, 1.0}}, .profile = {}});
    }
    return axes.size() == items->size() ? axes : std::vector<Command>{};
  }

  std::vector<VecX> ReadPoints(const YamlMap& map, size_t axes) {
    const YamlMap::InUnit found = map.FindInUnit("points", {kPlain, kMm});
    if (found.node == nullptr) {
      (void)map.Required("points");  // reports it
      return {};
    }
    const std::string path = map.PathOf(found.key);
    const auto items = yaml().Items(*found.node, path);
    if (!items) return {};
    if (items->size() < 2) yaml().Error(*found.node, path + " has fewer than two points");
    std::vector<VecX> points;
    for (size_t i = 0; i < items->size(); ++i) {
      const auto numbers = values_->Numbers(*(*items)[i], fmt::format("{}[{}]", path, i),
                                            axes == 0 ? -1 : static_cast<int>(axes));
      if (!numbers) return {};
      points.push_back(
          Eigen::Map<const VecX>(numbers->data(), static_cast<Eigen::Index>(numbers->size()))
              .unaryExpr(found.unit.to_si));
    }
    return points;
  }

  // One term per segment and axis, each from rest to rest.
  double BuildPath(const YamlNode& node, std::vector<Command> axes, const std::vector<VecX>& points,
                   double v_max, double a_max, bool full, double start_s) {
    double t = start_s;
    for (size_t k = 0; k < axes.size(); ++k) {
      axes[k].profile.terms.emplace_back(ConstantTerm{points[0][static_cast<Eigen::Index>(k)]});
    }
    for (size_t i = 0; i + 1 < points.size(); ++i) {
      const VecX step = points[i + 1] - points[i];
      const double length = step.norm();
      if (length == 0.0) {
        yaml().Error(node, fmt::format("motion.path.points: points {} and {} are equal", i, i + 1));
        return kNan;
      }
      // Peaks of the 3-4-5 law: 15/8 of the mean speed, 10/√3 · length/T².
      const double full_s =
          std::max(1.875 * length / v_max, std::sqrt(10.0 / std::sqrt(3.0) * length / a_max));
      const RampCruiseTerm ramp{t, length, v_max, a_max, 0.0};
      const double duration_s = full ? full_s : Duration(ramp);
      for (size_t k = 0; k < axes.size(); ++k) {
        const double delta = step[static_cast<Eigen::Index>(k)];
        if (full) {
          axes[k].profile.terms.emplace_back(PolyStepTerm{t, duration_s, delta});
        } else {
          RampCruiseTerm term = ramp;
          term.delta = delta;
          axes[k].profile.terms.emplace_back(term);
        }
      }
      t += duration_s;
    }
    const YamlEntry place{"path", node.line, node.column, nullptr};
    for (Command& axis : axes) AddCommand(place, std::move(axis));
    return t;
  }

  void ReadLoads(const YamlNode& node) {
    for (const YamlEntry& entry : yaml().Entries(node, "loads")) {
      const std::string path = "loads." + entry.key;
      YamlMap map(&yaml(), entry.value.get(), path, {"on", "at", "force", "moment", "in"});
      Load load{.name = entry.key, .force = {}, .moment = {}};
      if (const YamlNode* on = map.Required("on")) ReadPlace(*on, path, &load);
      if (const YamlNode* at = map.Find("at")) {
        const auto offset = values_->Vector(*at, path + ".at");
        if (offset) load.p_BoQ_B += *offset;
      }
      if (const YamlNode* in = map.Find("in")) {
        load.in_body_axes = yaml().Choice(*in, path + ".in", {"world", "body"}).value_or(0) == 1;
      }
      if (map.valid() && !map.Has("force") && !map.Has("moment")) {
        yaml().Error(entry, path + " has neither force nor moment");
      }
      ReadComponents(map.Find("force"), path + ".force", "N", 0, &load);
      ReadComponents(map.Find("moment"), path + ".moment", "N m", 3, &load);
      motion_.loads.push_back(std::move(load));
    }
  }

  // Three components; the first is the load's `first`.
  void ReadComponents(const YamlNode* node, const std::string& path, const char* unit, int first,
                      Load* load) {
    if (node == nullptr) return;
    const auto items = yaml().Items(*node, path, 3);
    if (!items) return;
    for (size_t i = 0; i < 3; ++i) {
      const std::string name = fmt::format("{}[{}]", path, i);
      if (FollowsState(*values_, *(*items)[i])) {
        const auto function = ReadStateFunction(values_, mechanism_, *(*items)[i], name);
        if (function) load->following.push_back({first + static_cast<int>(i), *function});
        continue;
      }
      Profile& profile = first == 0 ? load->force[i] : load->moment[i];
      profile = ReadProfile(values_, *(*items)[i], name,
                            {.unit = unit, .home = {}, .name = name, .tables = &tables_});
    }
  }

  // "body", "body.frame" or an output's name; bodies of instances have dots in their names.
  void ReadPlace(const YamlNode& node, const std::string& path, Load* load) {
    const auto text = yaml().Text(node, path + ".on");
    if (!text) return;
    std::vector<std::string> known;
    for (size_t b = 1; b < mechanism_.bodies.size(); ++b) {
      const Body& body = mechanism_.bodies[b];
      known.push_back(body.name);
      if (*text == body.name) load->body = static_cast<int>(b);
      for (const NamedFrame& frame : body.frames) {
        known.push_back(body.name + "." + frame.name);
        if (*text != known.back()) continue;
        load->body = static_cast<int>(b);
        load->p_BoQ_B = frame.X_BF.translation();
      }
    }
    for (const Output& output : mechanism_.outputs) {
      known.push_back(output.name);
      if (*text != output.name) continue;
      load->body = output.body;
      load->p_BoQ_B = output.X_BO.translation();
    }
    if (load->body > 0) return;
    yaml().Error(
        node,
        fmt::format("{}.on = '{}' is no body, frame or output of {}", path, *text, mechanism_.name),
        DidYouMean(*text, known));
  }

  ValueReader* values_;
  const Mechanism& mechanism_;
  const MotionTimes otherwise_;
  std::vector<std::string> names_;
  ProfileTables tables_;
  Motion motion_;
  bool times_known_ = false;
};

}  // namespace

Motion ReadMotion(ValueReader* values, const Mechanism& mechanism, const YamlNode* motion,
                  const YamlNode* loads, const YamlNode* forces, const MotionTimes& otherwise,
                  Diagnostics* files) {
  return MotionReader(values, mechanism, otherwise, files).Read(motion, loads, forces);
}

}  // namespace mbv
