#include "features/standin/standin.h"

#include <fmt/format.h>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>

#include "base/json_text.h"
#include "base/text.h"
#include "plot/svg_plot.h"
#include "report/page.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMostNames = 6;
constexpr double kSmall = 0.01;  // of what a drive needs: an error that is not worth a sentence

Eigen::Index Ix(size_t k) { return static_cast<Eigen::Index>(k); }

std::string Short(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : "–";
}
std::string Percent(double share) {
  if (!std::isfinite(share)) return "–";
  return share < 10.0 ? fmt::format("{:.3g} %", 100.0 * share)
                      : fmt::format("{:.0f} %", 100.0 * share);
}

double InShownUnit(double value, const std::string& unit) {
  return unit == "rad" ? value * 180.0 / std::numbers::pi : 1000.0 * value;
}
// Of a position: round-off is not a number.
std::string Position(double value, const std::string& unit) {
  const double shown = InShownUnit(value, unit);
  return Short(std::abs(shown) < 1e-9 ? 0.0 : shown);
}
const char* ShownUnit(const std::string& unit) { return unit == "rad" ? "°" : "mm"; }
std::string ForceUnitOf(const std::string& unit) { return unit == "rad" ? "N m" : "N"; }

// "pitch −20°, roll 10°".
std::string PlaceText(const StandinResult& result, const VecX& q) {
  std::vector<std::string> parts;
  for (size_t k = 0; k < result.joints.size(); ++k) {
    const std::string& unit = result.joint_units[k];
    parts.push_back(fmt::format("{} {}{}{}", result.joints[k], Position(q[Ix(k)], unit),
                                unit == "rad" ? "" : " ", ShownUnit(unit)));
  }
  return Joined(parts);
}

// The usable pose with the largest value.
template <typename Value>
size_t Extreme(const StandinResult& result, const Value& value) {
  size_t at = 0;
  double largest = -std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < result.poses.size(); ++i) {
    if (result.poses[i].status != PoseStatus::kUsable || !(value(result.poses[i]) > largest)) {
      continue;
    }
    largest = value(result.poses[i]);
    at = i;
  }
  return at;
}
size_t NearestType2(const StandinResult& result) {
  return Extreme(result, [](const StandinPose& pose) { return -pose.least; });
}
size_t NearestType1(const StandinResult& result) {
  return Extreme(result, [](const StandinPose& pose) { return pose.largest; });
}

// What ends the usable part, most poses first.
std::vector<std::pair<std::string, size_t>> EndsOf(const StandinResult& result) {
  std::map<std::string, size_t> counts;
  for (const StandinPose& pose : result.poses) {
    if (pose.status == PoseStatus::kUsable) continue;
    const bool open = pose.status == PoseStatus::kOpen;
    ++counts[open                                     ? "not closed: " + pose.where
             : pose.status == PoseStatus::kDriveRange ? "range of drive " + pose.where
                                                      : pose.where];
  }
  std::vector<std::pair<std::string, size_t>> ends(counts.begin(), counts.end());
  std::ranges::stable_sort(ends, std::greater(), &std::pair<std::string, size_t>::second);
  return ends;
}

double ShareOf(const StandinResult& result, size_t poses) {
  return static_cast<double>(poses) / static_cast<double>(result.poses.size());
}

// "-65.85° (type 1, dead centre: low)".
std::string EndText(const StandinResult& result, const StandinEnd& end) {
  const std::string& unit = result.joint_units[end.joint];
  return fmt::format("{:.4g}{} ({}{})", InShownUnit(end.at, unit), ShownUnit(unit),
                     WordOf(end.kind), end.where.empty() ? "" : ": " + end.where);
}

std::string EndsSentence(const StandinResult& result) {
  std::vector<std::string> parts;
  for (size_t k = 0; k + 1 < result.ends.size(); k += 2) {
    parts.push_back(fmt::format("{} from {} to {}", result.joints[result.ends[k].joint],
                                EndText(result, result.ends[k]),
                                EndText(result, result.ends[k + 1])));
  }
  return "Alone, the others at home: " + Joined(parts, kMostNames);
}

// "4 at 1681 poses".
template <typename Value>
std::map<int, size_t> CountsOf(const StandinResult& result, const Value& value) {
  std::map<int, size_t> counts;
  for (const StandinPose& pose : result.poses) {
    if (pose.status == PoseStatus::kUsable && value(pose) >= 0) ++counts[value(pose)];
  }
  return counts;
}
std::string CountsText(const std::map<int, size_t>& counts) {
  std::vector<std::string> parts;
  parts.reserve(counts.size());
  for (const auto& [count, poses] : counts) {
    parts.push_back(fmt::format("{} at {} pose{}", count, poses, poses == 1 ? "" : "s"));
  }
  return parts.empty() ? "not known" : Joined(parts, kMostNames);
}
std::map<int, size_t> WaysOf(const StandinResult& result) {
  return CountsOf(result, [](const StandinPose& pose) { return pose.ways; });
}
std::map<int, size_t> JointPosesOf(const StandinResult& result) {
  return CountsOf(result, [](const StandinPose& pose) { return pose.joint_poses; });
}

std::string ReachSentence(const StandinResult& result) {
  std::string text =
      fmt::format("{} of the range can be used", Percent(ShareOf(result, result.usable())));
  std::vector<std::string> ends;
  for (const auto& [what, count] : EndsOf(result)) {
    ends.push_back(fmt::format("{} ({})", what, Percent(ShareOf(result, count))));
  }
  return ends.empty() ? text : text + "; what ends it: " + Joined(ends, kMostNames);
}

// The drive with the largest error of a cause in a scene, by its 95th percentile.
struct WorstDrive {
  size_t drive = 0;
  double share = 0.0;  ///< of StandinScene::full_p95
};
WorstDrive WorstDriveOf(const StandinScene& scene, size_t cause) {
  WorstDrive worst;
  for (size_t d = 0; d < scene.full_p95.size(); ++d) {
    const double share = scene.errors[d][cause].p95 / scene.full_p95[d];
    if (share > worst.share) worst = {d, share};
  }
  return worst;
}

size_t LargestCause(const StandinScene& scene) {
  size_t cause = 0;
  for (size_t c = 1; c < kCauses; ++c) {
    if (WorstDriveOf(scene, c).share > WorstDriveOf(scene, cause).share) cause = c;
  }
  return cause;
}

const char* RemedyOf(size_t cause) {
  constexpr std::array<const char*, kCauses> kRemedies = {
      "map torques with J(q), as standin.csv has it, instead of constant ratios",
      "give the joints the inertia matrix R(q) of the rotors instead of a constant armature",
      "add the velocity terms of rotors and loop bodies to the torques",
      "give cranks and rods to the model, or their mass to the links that carry them"};
  return kRemedies.at(cause);
}

std::string ErrorSentence(const StandinResult& result, const StandinScene& scene) {
  if (scene.states == 0) return scene.name + ": no state can be used; state a smaller --range";
  const WorstDrive whole = WorstDriveOf(scene, kWhole);
  if (!(whole.share > kSmall)) {
    return fmt::format("{}: the serial model's motor torques are right within {} of what is needed",
                       scene.name, Percent(whole.share));
  }
  const size_t cause = LargestCause(scene);
  const Spread& error = scene.errors[whole.drive][kWhole];
  const double needed = scene.full_p95[whole.drive];
  return fmt::format(
      "{}: the serial model's torque of {} is wrong by {} in the median, by more than {} in 5 % of "
      "the states, of the {} {} that it needs; most of it by {} ({}): {}",
      scene.name, result.drives[whole.drive], Percent(error.median / needed),
      Percent(error.p95 / needed), Short(needed), ForceUnitOf(result.drive_units[whole.drive]),
      kCauseNames.at(cause), Percent(WorstDriveOf(scene, cause).share), RemedyOf(cause));
}

// Tables.

Table ReachTable(const StandinResult& result) {
  Table table{.name = "standin_reach",
              .caption = "The range, pose by pose",
              .columns = {Text("joint"), Digits("from"), Digits("to"), Digits("home"), Text("unit"),
                          Text("range of")}};
  for (size_t k = 0; k < result.joints.size(); ++k) {
    const std::string& unit = result.joint_units[k];
    table.rows.push_back({result.joints[k], Short(InShownUnit(result.ranges[k].low, unit)),
                          Short(InShownUnit(result.ranges[k].high, unit)),
                          Position(result.home[Ix(k)], unit), ShownUnit(unit), result.range_of[k]});
  }
  return table;
}

Table RatioTable(const StandinResult& result) {
  Table table{.name = "standin_ratio",
              .caption = "Neutral ratio J₀ = ∂m/∂q at home, and drives over the usable poses",
              .columns = {Text("drive")}};
  for (size_t k = 0; k < result.joints.size(); ++k) {
    table.columns.push_back(
        Digits("by " + result.joints[k] + " [1/" + result.joint_units[k] + "]"));
  }
  table.columns.insert(table.columns.end(), {Text("unit"), Digits("from"), Digits("to"), Text("")});
  for (size_t d = 0; d < result.drives.size(); ++d) {
    std::vector<Cell> row = {result.drives[d]};
    for (size_t k = 0; k < result.joints.size(); ++k) {
      row.emplace_back(fmt::format("{:.6g}", result.J_home(Ix(d), Ix(k))));
    }
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const StandinPose& pose : result.poses) {
      if (pose.status != PoseStatus::kUsable) continue;
      low = std::min(low, pose.drives[Ix(d)]);
      high = std::max(high, pose.drives[Ix(d)]);
    }
    const std::string& unit = result.drive_units[d];
    row.emplace_back(unit);
    row.emplace_back(Short(InShownUnit(low, unit)));
    row.emplace_back(Short(InShownUnit(high, unit)));
    row.emplace_back(ShownUnit(unit));
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table SpreadTable(const StandinResult& result) {
  Table table{.name = "standin_maps",
              .caption = "Over the usable poses",
              .columns = {Text("what"), Digits("median"), Digits("95 %"), Digits("worst"),
                          Wide("worst at")}};
  const auto add = [&](const char* what, const Spread& spread, const std::string& place) {
    table.rows.push_back(
        {what, Percent(spread.median), Percent(spread.p95), Percent(spread.worst), place});
  };
  add("torque map with the neutral ratio", result.map_error,
      PlaceText(result, result.poses[result.map_error.at].q));
  if (std::isfinite(result.inertia_off.worst)) {
    add("rotor inertia against the best armature", result.inertia_off, "");
  }
  if (std::isfinite(result.coupling.worst)) {
    add("rotor inertia that couples joints", result.coupling, "");
  }
  return table;
}

Table SingularTable(const StandinResult& result) {
  Table table{.name = "standin_singular",
              .caption = "Distance to singularities: singular values of J [" + result.unit + "]",
              .columns = {Text("kind"), Digits("home"), Digits("nearest"), Wide("nearest at")}};
  const StandinPose& type2 = result.poses[NearestType2(result)];
  const StandinPose& type1 = result.poses[NearestType1(result)];
  table.rows.push_back({"type 2: smallest of J (0: drives do not hold)", Short(result.least_home),
                        Short(type2.least), PlaceText(result, type2.q)});
  table.rows.push_back({"type 1: smallest of J⁻¹ (0: dead centre)",
                        Short(1.0 / result.largest_home), Short(1.0 / type1.largest),
                        PlaceText(result, type1.q)});
  return table;
}

Table EndTable(const StandinResult& result) {
  Table table{.name = "standin_ends",
              .caption = "Each joint alone from home, the others at home, limits of joints aside",
              .columns = {Text("joint"), Text("towards"), Digits("ends at"), Text("unit"),
                          Text("by"), Text("of")}};
  for (const StandinEnd& end : result.ends) {
    const std::string& unit = result.joint_units[end.joint];
    table.rows.push_back({result.joints[end.joint], end.up ? "+" : "-",
                          fmt::format("{:.6g}", InShownUnit(end.at, unit)), ShownUnit(unit),
                          WordOf(end.kind), end.where});
  }
  return table;
}

Table LimbTable(const StandinResult& result) {
  Table table{.name = "standin_limbs",
              .caption = "Ways to put each limb together at a pose of the joints",
              .columns = {Text("drive"), Text("limb"), Digits("ways"), Digits("at home"),
                          Digits("the other way"), Digits("least apart"), Text("unit"),
                          Wide("there"), Digits("poses on the other way")}};
  for (size_t d = 0; d < result.limbs.size(); ++d) {
    const StandinLimb& limb = result.limbs[d];
    const std::string& unit = result.drive_units[d];
    const bool two = std::isfinite(limb.apart);
    table.rows.push_back({result.drives[d], limb.kind.empty() ? "of another kind" : limb.kind,
                          limb.kind.empty() ? "–"
                          : two             ? "2"
                                            : "1",
                          Position(result.drives_home[Ix(d)], unit),
                          Position(limb.other_home, unit), Position(limb.apart, unit),
                          ShownUnit(unit),
                          two ? PlaceText(result, result.poses[limb.apart_at].q) : "",
                          limb.kind.empty() ? "–" : std::to_string(limb.other_way)});
  }
  return table;
}

Table LimitTable(const StandinResult& result, bool torque) {
  Table table{
      .name = torque ? "standin_torque" : "standin_speed",
      .caption = torque ? "Peak torque of the joints by the motors' limits"
                        : "Highest rates of the joints by the motors' limits",
      .columns = {Text("joint"), Text("unit"), Digits("least"), Digits("most"), Wide("least at")}};
  for (size_t k = 0; k < result.joints.size(); ++k) {
    const auto value = [&](const StandinPose& pose) {
      return (torque ? pose.torque_alone : pose.speed_alone)[Ix(k)];
    };
    const size_t least = Extreme(result, [&](const StandinPose& pose) { return -value(pose); });
    const size_t most = Extreme(result, value);
    table.rows.push_back(
        {result.joints[k] + " alone",
         torque ? ForceUnitOf(result.joint_units[k]) : result.joint_units[k] + "/s",
         Short(value(result.poses[least])), Short(value(result.poses[most])),
         PlaceText(result, result.poses[least].q)});
  }
  const StandinPose& worst = result.poses[torque ? result.worst_torque : result.worst_speed];
  const double any = torque ? worst.torque_any : worst.speed_any;
  if (result.joints.size() > 1 && std::isfinite(any)) {
    table.rows.push_back(
        {"every direction",
         torque ? ForceUnitOf(result.joint_units[0]) : result.joint_units[0] + "/s", Short(any), "",
         PlaceText(result, worst.q)});
  }
  return table;
}

Table InertiaTable(const StandinResult& result) {
  Table table{
      .name = "standin_inertia",
      .caption = "Inertia in the joints' coordinates, over the usable poses",
      .columns = {Text("joint"), Text("unit"), Digits("all: least"), Digits("all: most"),
                  Digits("rotors: least"), Digits("rotors: most"), Digits("best armature")}};
  for (size_t k = 0; k < result.joints.size(); ++k) {
    const auto of = [&](const MatX& matrix) { return matrix(Ix(k), Ix(k)); };
    const auto all = [&](const StandinPose& pose) { return of(pose.M); };
    const auto rotors = [&](const StandinPose& pose) { return of(pose.R); };
    const auto less_all = [&](const StandinPose& pose) { return -of(pose.M); };
    const auto less_rotors = [&](const StandinPose& pose) { return -of(pose.R); };
    table.rows.push_back({result.joints[k], result.joint_units[k] == "rad" ? "kg m²" : "kg",
                          Short(all(result.poses[Extreme(result, less_all)])),
                          Short(all(result.poses[Extreme(result, all)])),
                          Short(rotors(result.poses[Extreme(result, less_rotors)])),
                          Short(rotors(result.poses[Extreme(result, rotors)])),
                          Short(result.armature[Ix(k)])});
  }
  return table;
}

Table SceneTable(const StandinResult& result, const StandinScene& scene) {
  Table table{
      .name = "standin_" + scene.name,
      .caption = fmt::format(
          "{}: {}; {} states{}", scene.name, scene.text, scene.states,
          scene.left_out > 0 ? fmt::format(", {} that cannot be used are left out", scene.left_out)
                             : ""),
      .columns = {Text("drive"), Text("cause"), Digits("median"), Digits("95 %"), Digits("worst"),
                  Text("unit"), Digits("of needed: median"), Digits("95 %"), Digits("worst")}};
  std::ranges::replace(table.name, ' ', '_');
  for (size_t d = 0; d < result.drives.size(); ++d) {
    const double needed = scene.full_p95[d];
    for (size_t c = 0; c <= kWhole; ++c) {
      const Spread& spread = scene.errors[d][c];
      const auto share = [&](double value) {
        return needed > 0.0 ? Percent(value / needed) : std::string("–");
      };
      table.rows.push_back({result.drives[d], kCauseNames.at(c), Short(spread.median),
                            Short(spread.p95), Short(spread.worst),
                            ForceUnitOf(result.drive_units[d]), share(spread.median),
                            share(spread.p95), share(spread.worst)});
    }
  }
  return table;
}

// Drawings.

template <typename Value>
void AddMap(const StandinResult& result, const std::string& title, const std::string& unit,
            const Value& value, ReportSection* section, bool log = false) {
  const auto shown = [&](const StandinPose& pose) {
    return pose.status == PoseStatus::kUsable ? value(pose) : kNan;
  };
  const auto label = [&](size_t k) {
    return result.joints[k] + " [" + ShownUnit(result.joint_units[k]) + "]";
  };
  if (result.joints.size() == 1) {
    LinePlot plot{.title = title,
                  .x_label = label(0),
                  .y_label = title + " [" + unit + "]",
                  .lines = {PlotLine{}}};
    for (const StandinPose& pose : result.poses) {
      plot.lines[0].points.emplace_back(InShownUnit(pose.q[0], result.joint_units[0]), shown(pose));
    }
    section->Add(Drawing{ToSvg(plot)}, On::kPage);
  }
  if (result.joints.size() != 2 || result.resolution < 2) return;
  // Cells around the poses: the first joint to the right.
  MapPlot plot{.title = title,
               .x_label = label(0),
               .y_label = label(1),
               .value_label = "[" + unit + "]",
               .log_scale = log};
  const auto edges = [&](size_t k, double* low, double* high) {
    const StandinRange& range = result.ranges[k];
    const double half = 0.5 * (range.high - range.low) / (result.resolution - 1);
    *low = InShownUnit(range.low - half, result.joint_units[k]);
    *high = InShownUnit(range.high + half, result.joint_units[k]);
  };
  edges(0, &plot.x_min, &plot.x_max);
  edges(1, &plot.y_min, &plot.y_max);
  plot.columns = plot.rows = result.resolution;
  const auto n = static_cast<size_t>(result.resolution);
  for (size_t row = 0; row < n; ++row) {
    for (size_t column = 0; column < n; ++column) {
      plot.values.push_back(shown(result.poses[column * n + row]));
    }
  }
  plot.contours = 8;
  section->Add(Drawing{ToSvg(plot)}, On::kPage);
}

// Corners of {Jᵀ τ} or {J⁻¹ ṁ} for the limits of two drives, in their order around.
std::vector<std::array<double, 2>> Corners(const MatX& map, const VecX& most) {
  std::vector<std::array<double, 2>> corners;
  for (const auto& [a, b] :
       {std::pair(1.0, 1.0), std::pair(-1.0, 1.0), std::pair(-1.0, -1.0), std::pair(1.0, -1.0)}) {
    const VecX corner = map.col(0) * (a * most[0]) + map.col(1) * (b * most[1]);
    corners.push_back({corner[0], corner[1]});
  }
  return corners;
}

std::vector<std::array<double, 2>> CornersAt(const StandinResult& result, const StandinPose& pose,
                                             bool torque) {
  return torque ? Corners(pose.J.transpose(), result.drive_forces)
                : Corners(pose.J.inverse(), result.drive_speeds);
}

void AddPolygons(const StandinResult& result, bool torque, ReportSection* section) {
  if (result.joints.size() != 2) return;
  const auto label = [&](size_t k) {
    const std::string& of = result.joint_units[k];
    return fmt::format("{} [{}]", result.joints[k], torque ? ForceUnitOf(of) : of + "/s");
  };
  LinePlot plot{.title = torque ? "Joint torques that the motors can give"
                                : "Joint rates that the motors can give",
                .x_label = label(0),
                .y_label = label(1),
                .equal_scale = result.joint_units[0] == result.joint_units[1]};
  StandinPose home;
  home.J = result.J_home;
  const size_t worst = torque ? result.worst_torque : result.worst_speed;
  const size_t type2 = NearestType2(result), type1 = NearestType1(result);
  const auto add = [&](const std::string& name, const StandinPose& pose, bool dashed) {
    PlotLine line{.label = name, .closed = true, .dashed = dashed};
    for (const auto& [x, y] : CornersAt(result, pose, torque)) line.points.emplace_back(x, y);
    plot.lines.push_back(std::move(line));
  };
  add("home", home, true);
  add("worst: " + PlaceText(result, result.poses[worst].q), result.poses[worst], false);
  const size_t best = torque ? type1 : type2;
  if (best != worst) add(PlaceText(result, result.poses[best].q), result.poses[best], false);
  section->Add(Drawing{ToSvg(plot)}, On::kPage);
}

std::vector<ReportSection> SectionsOf(const StandinResult& result) {
  std::vector<ReportSection> sections;
  ReportSection summary{.title = "What it costs", .link = "Summary"};
  summary.Add(Items{AdviceOf(result)});
  summary.Add(SpreadTable(result));
  sections.push_back(std::move(summary));

  ReportSection error{.title = "Error of the serial model", .link = "Error"};
  for (const StandinScene& scene : result.scenes) error.Add(SceneTable(result, scene));
  error.Note(
      "Motor torques of the full loop less those of the serial model, by cause: constant ratio, "
      "the neutral J instead of J(q); rotors, their inertia beyond the best constant armature; "
      "velocity, terms of rotors and loop bodies that are quadratic in the rates; loop bodies, "
      "their mass and what else acts on them. The causes add up to the whole. Each number is of "
      "magnitudes, so that their medians do not. Needed: the 95th percentile of the drive's torque "
      "in the full loop over the same states.");
  for (size_t d = 0; d < result.drives.size(); ++d) {
    AddMap(
        result, "error at rest: " + result.drives[d], ForceUnitOf(result.drive_units[d]),
        [&](const StandinPose& pose) {
          return pose.rest.full.size() == 0 ? kNan : pose.rest.errors[kWhole][Ix(d)];
        },
        &error);
  }
  sections.push_back(std::move(error));

  ReportSection maps{.title = "Joints to motors", .link = "Maps"};
  maps.Add(ReachTable(result));
  maps.Add(RatioTable(result));
  maps.Note(
      "Rates: ṁ = J q̇. Torques: τ_joint = Jᵀ τ_motor. The torque map's error is the largest "
      "singular value of J⁻ᵀ J₀ᵀ − 1: the largest error of motor torques for a joint torque, by "
      "what the neutral ratio gives. Where drives differ in unit, lengths count in a "
      "characteristic one.");
  AddMap(
      result, "torque map error", "1", [](const StandinPose& pose) { return pose.map_error; },
      &maps);
  for (size_t d = 0; d < result.drives.size(); ++d) {
    const std::string& unit = result.drive_units[d];
    AddMap(
        result, result.drives[d], ShownUnit(unit),
        [&](const StandinPose& pose) { return InShownUnit(pose.drives[Ix(d)], unit); }, &maps);
  }
  sections.push_back(std::move(maps));

  if (result.torque_limits || result.speed_limits) {
    ReportSection limits{.title = "Limits of the motors", .link = "Limits"};
    for (const bool torque : {true, false}) {
      if (!(torque ? result.torque_limits : result.speed_limits)) continue;
      limits.Add(LimitTable(result, torque));
      AddPolygons(result, torque, &limits);
    }
    limits.Note(
        "Peak torque at standstill, driving, behind gear and efficiency; highest speed. Alone: the "
        "other joints without torque or rate. Every direction: the circle inside the polygon.");
    sections.push_back(std::move(limits));
  }
  ReportSection inertia{.title = "Reflected inertia", .link = "Inertia"};
  inertia.Add(InertiaTable(result));
  for (size_t k = 0; k < result.joints.size(); ++k) {
    if (!(result.armature[Ix(k)] > 0.0)) continue;
    AddMap(
        result, "rotors about " + result.joints[k], result.joint_units[k] == "rad" ? "kg m²" : "kg",
        [&](const StandinPose& pose) { return pose.R(Ix(k), Ix(k)); }, &inertia, true);
  }
  sections.push_back(std::move(inertia));

  ReportSection branches{.title = "Ends and assemblies", .link = "Assemblies"};
  branches.Add(EndTable(result));
  branches.Add(LimbTable(result));
  Items counts;
  counts.texts = {
      "positions of the drives that put the limbs together: " + CountsText(WaysOf(result)),
      "poses of the joints over a turn with the same drives: " + CountsText(JointPosesOf(result))};
  if (!result.poses_at_home.empty()) {
    std::string poses;
    for (const VecX& q : result.poses_at_home) {
      poses += (poses.empty() ? "" : "; ") + PlaceText(result, q);
    }
    counts.texts.push_back("with the drives as at home: " + poses);
  }
  branches.Add(std::move(counts));
  branches.Note(
      "At a dead centre (type 1) both ways of a limb meet, and beyond it the rod does not reach. A "
      "limb's ways follow from a rod's length in closed form, and hold where they give the drives "
      "that the reference found at every pose.");
  sections.push_back(std::move(branches));

  ReportSection singular{.title = "Singularities", .link = "Singularities"};
  singular.Add(SingularTable(result));
  AddMap(
      result, "smallest singular value of J", result.unit,
      [](const StandinPose& pose) { return pose.least; }, &singular);
  AddMap(
      result, "smallest singular value of J⁻¹", "its inverse",
      [](const StandinPose& pose) { return 1.0 / pose.largest; }, &singular);
  sections.push_back(std::move(singular));

  ReportSection model{.title = "The two models", .link = "Models"};
  const auto listed = [](const std::vector<std::string>& names) {
    return names.empty() ? std::string("none") : Joined(names);
  };
  Items items;
  items.texts = {"loop bodies, which the serial model does not have: " + listed(result.loop_bodies),
                 "degrees of freedom that stay at home: " + listed(result.held)};
  items.texts.insert(items.texts.end(), result.notes.begin(), result.notes.end());
  model.Add(std::move(items));
  model.Note(
      "The serial model is the robot with loop bodies without mass and without what acts on them, "
      "seen along the joints: by virtual work the robot with its loops cut, driven at the joints.");
  sections.push_back(std::move(model));
  return sections;
}

std::string HeadLine(const StandinResult& result) {
  return fmt::format(
      "{} driven by {}{}: a serial model against the full loop, {} poses", Joined(result.joints),
      Joined(result.drives),
      result.loop_bodies.empty() ? "" : " through " + Joined(result.loop_bodies, kMostNames),
      result.poses.size());
}

Json VectorJson(const VecX& values) {
  Json json = Json::array();
  for (const double value : values) json.push_back(Number(value));
  return json;
}
Json SpreadJson(const Spread& spread) {
  return {{"median", Number(spread.median)},
          {"p95", Number(spread.p95)},
          {"worst", Number(spread.worst)}};
}

Json LimitJson(const StandinResult& result, bool torque) {
  if (!(torque ? result.torque_limits : result.speed_limits)) return nullptr;
  const StandinPose& worst = result.poses[torque ? result.worst_torque : result.worst_speed];
  Json corners = Json::array();
  if (result.joints.size() == 2) {
    for (const auto& corner : CornersAt(result, worst, torque)) corners.push_back(corner);
  }
  Json alone = Json::array();
  for (size_t k = 0; k < result.joints.size(); ++k) {
    const auto value = [&](const StandinPose& pose) {
      return (torque ? pose.torque_alone : pose.speed_alone)[Ix(k)];
    };
    const size_t least = Extreme(result, [&](const StandinPose& pose) { return -value(pose); });
    alone.push_back({{"joint", result.joints[k]},
                     {"least", Number(value(result.poses[least]))},
                     {"at", VectorJson(result.poses[least].q)}});
  }
  return {{"alone", std::move(alone)},
          {"any", Number(torque ? worst.torque_any : worst.speed_any)},
          {"at", VectorJson(worst.q)},
          {"corners", std::move(corners)}};
}

Json SceneJson(const StandinResult& result, const StandinScene& scene) {
  Json drives = Json::array();
  for (size_t d = 0; d < result.drives.size(); ++d) {
    Json errors = Json::array();
    for (size_t c = 0; c <= kWhole; ++c) {
      Json error = {{"cause", kCauseNames.at(c)}};
      error.update(SpreadJson(scene.errors[d][c]));
      errors.push_back(std::move(error));
    }
    drives.push_back({{"drive", result.drives[d]},
                      {"unit", ForceUnitOf(result.drive_units[d])},
                      {"full_p95", Number(scene.full_p95[d])},
                      {"worst_at", VectorJson(scene.worst_at[d])},
                      {"errors", std::move(errors)}});
  }
  return {{"name", scene.name},
          {"text", scene.text},
          {"states", scene.states},
          {"left_out", scene.left_out},
          {"sum_off", Number(scene.sum_off)},
          {"drives", std::move(drives)}};
}

std::string MapSentence(const StandinResult& result) {
  const Spread& map = result.map_error;
  if (!(map.worst > kSmall)) {
    return fmt::format(
        "The neutral ratio is right within {} over the whole range: a constant gear does",
        Percent(map.worst));
  }
  return fmt::format(
      "With the neutral ratio motor torques are wrong by {} in the median, by more than {} in 5 % "
      "of the range (worst {}, at {})",
      Percent(map.median), Percent(map.p95), Percent(map.worst),
      PlaceText(result, result.poses[map.at].q));
}

}  // namespace

std::string VerdictOf(const StandinResult& result) {
  // Along the motion that was asked for last; else of all states.
  const StandinScene& scene =
      result.scenes.size() > 3 ? result.scenes[result.scenes.size() - 2] : result.scenes.back();
  std::string text = MapSentence(result);
  const WorstDrive whole = WorstDriveOf(scene, kWhole);
  if (scene.states > 0 && whole.share > kSmall) {
    const size_t cause = LargestCause(scene);
    text += fmt::format(
        "; {}, with masses and rotors, {} is wrong by more than {} of what it needs in 5 % "
        "of the states, mostly by {}: {}",
        scene.name, result.drives[whole.drive], Percent(whole.share), kCauseNames.at(cause),
        RemedyOf(cause));
  }
  return Sentence(std::move(text));
}

std::vector<std::string> AdviceOf(const StandinResult& result) {
  std::vector<std::string> advice;
  advice.push_back(MapSentence(result));
  advice.push_back(ReachSentence(result));
  for (const StandinScene& scene : result.scenes) {
    advice.push_back(ErrorSentence(result, scene));
  }
  if (result.inertia_off.worst > kSmall || result.coupling.worst > kSmall) {
    std::string text = fmt::format(
        "The best constant armature is off by {} of its own size in the median, by more than {} in "
        "5 % of the range",
        Percent(result.inertia_off.median), Percent(result.inertia_off.p95));
    if (result.coupling.worst > kSmall) {
      text += fmt::format("; rotors couple the joints by {} in the median, which no armature does",
                          Percent(result.coupling.median));
    }
    advice.push_back(std::move(text));
  }
  if (!result.ends.empty()) advice.push_back(EndsSentence(result));
  for (std::string& sentence : advice) sentence = Sentence(std::move(sentence));
  return advice;
}

std::string ToText(const StandinResult& result, const TextStyle& style) {
  std::string text = HeadLine(result) + "\n";
  for (const ReportSection& section : SectionsOf(result)) text += ToText(section, style);
  return text + "\n" + VerdictOf(result) + "\n";
}

Json CountsJson(const char* key, const std::map<int, size_t>& counts) {
  Json json = Json::array();
  for (const auto& [count, poses] : counts) json.push_back({{key, count}, {"poses", poses}});
  return json;
}

Json BranchesJson(const StandinResult& result) {
  Json limbs = Json::array(), at_home = Json::array(), ends = Json::array();
  for (size_t d = 0; d < result.limbs.size(); ++d) {
    const StandinLimb& limb = result.limbs[d];
    const bool two = std::isfinite(limb.apart);
    limbs.push_back({{"drive", result.drives[d]},
                     {"kind", limb.kind},
                     {"home", Number(result.drives_home[Ix(d)])},
                     {"other", Number(limb.other_home)},
                     {"apart", Number(limb.apart)},
                     {"apart_at", two ? VectorJson(result.poses[limb.apart_at].q) : Json()},
                     {"other_way", limb.other_way}});
  }
  for (const VecX& q : result.poses_at_home) at_home.push_back(VectorJson(q));
  for (const StandinEnd& end : result.ends) {
    ends.push_back({{"joint", result.joints[end.joint]},
                    {"up", end.up},
                    {"at", Number(end.at)},
                    {"by", WordOf(end.kind)},
                    {"of", end.where}});
  }
  return {{"limbs", std::move(limbs)},
          {"ways", CountsJson("ways", WaysOf(result))},
          {"joint_poses", CountsJson("joint_poses", JointPosesOf(result))},
          {"joint_poses_at_home", std::move(at_home)},
          {"ends", std::move(ends)}};
}

Json ToJson(const StandinResult& result, const std::string& mechanism) {
  Json joints = Json::array(), drives = Json::array(), ends = Json::array(), scenes = Json::array();
  for (size_t k = 0; k < result.joints.size(); ++k) {
    joints.push_back({{"name", result.joints[k]},
                      {"unit", result.joint_units[k]},
                      {"home", Number(result.home[Ix(k)])},
                      {"low", Number(result.ranges[k].low)},
                      {"high", Number(result.ranges[k].high)},
                      {"range_of", result.range_of[k]},
                      {"armature", Number(result.armature[Ix(k)])}});
    drives.push_back({{"name", result.drives[k]},
                      {"unit", result.drive_units[k]},
                      {"ratio", VectorJson(result.J_home.row(Ix(k)).transpose())}});
  }
  for (const auto& [what, count] : EndsOf(result))
    ends.push_back({{"what", what}, {"poses", count}});
  for (const StandinScene& scene : result.scenes) scenes.push_back(SceneJson(result, scene));
  const StandinPose& type2 = result.poses[NearestType2(result)];
  const StandinPose& type1 = result.poses[NearestType1(result)];
  Json map = SpreadJson(result.map_error);
  map["at"] = VectorJson(result.poses[result.map_error.at].q);
  return {{"mechanism", mechanism},
          {"joints", std::move(joints)},
          {"drives", std::move(drives)},
          {"held", result.held},
          {"loop_bodies", result.loop_bodies},
          {"resolution", result.resolution},
          {"reach",
           {{"poses", result.poses.size()},
            {"usable", result.usable()},
            {"open", result.CountOf(PoseStatus::kOpen)},
            {"drive_range", result.CountOf(PoseStatus::kDriveRange)},
            {"beyond_singularity", result.CountOf(PoseStatus::kBeyond)}}},
          {"ends", std::move(ends)},
          {"torque_map", std::move(map)},
          {"torque_limits", LimitJson(result, true)},
          {"speed_limits", LimitJson(result, false)},
          {"rotors",
           {{"off_armature", SpreadJson(result.inertia_off)},
            {"coupling", SpreadJson(result.coupling)}}},
          {"singularities",
           {{"unit", result.unit},
            {"type2", Number(type2.least)},
            {"type2_at", VectorJson(type2.q)},
            {"type1", Number(1.0 / type1.largest)},
            {"type1_at", VectorJson(type1.q)}}},
          {"branches", BranchesJson(result)},
          {"amplitude", Number(result.amplitude)},
          {"frequency_hz", Number(result.frequency_hz)},
          {"scenes", std::move(scenes)},
          {"verdict", VerdictOf(result)},
          {"advice", AdviceOf(result)},
          {"notes", result.notes}};
}

std::string StandinCsv(const StandinResult& result) {
  struct CsvColumn {
    std::string heading;
    std::function<std::string(const StandinPose&)> cell;
  };
  std::vector<CsvColumn> columns;
  const size_t n = result.joints.size();
  const auto add = [&](const std::string& what, const std::string& unit, auto value) {
    columns.push_back(
        {what + (unit.empty() ? "" : " [" + unit + "]"), [value](const StandinPose& pose) {
           const double number = value(pose);
           return std::isfinite(number) ? fmt::format("{:.17g}", number) : "";
         }});
  };
  // Of a vector or matrix that a pose may not have.
  const auto entry = [](const auto& values, size_t i, size_t j = 0) {
    return values.size() > 0 ? values(Ix(i), Ix(j)) : kNan;
  };
  const auto add_vector = [&](const std::vector<std::string>& names, const std::string& what,
                              const auto& unit, auto of) {
    for (size_t k = 0; k < n; ++k) {
      add(names[k] + what, unit(k), [=](const StandinPose& pose) { return entry(of(pose), k); });
    }
  };
  const auto joint_unit = [&](size_t k) { return result.joint_units[k]; };
  const auto drive_unit = [&](size_t k) { return result.drive_units[k]; };
  const auto joint_rate = [&](size_t k) { return result.joint_units[k] + "/s"; };
  const auto joint_force = [&](size_t k) { return ForceUnitOf(result.joint_units[k]); };
  const auto drive_force = [&](size_t k) { return ForceUnitOf(result.drive_units[k]); };
  add_vector(result.joints, "", joint_unit, [](const StandinPose& pose) { return pose.q; });
  columns.push_back({"status", [](const StandinPose& pose) { return WordOf(pose.status); }});
  columns.push_back({"where", [](const StandinPose& pose) { return CsvCell(pose.where); }});
  add_vector(result.drives, "", drive_unit, [](const StandinPose& pose) { return pose.drives; });
  for (size_t d = 0; d < n; ++d) {
    for (size_t k = 0; k < n; ++k) {
      add(fmt::format("d {} / d {}", result.drives[d], result.joints[k]),
          drive_unit(d) + "/" + joint_unit(k),
          [=](const StandinPose& pose) { return entry(pose.J, d, k); });
    }
  }
  add("smallest singular value", result.unit, [](const StandinPose& pose) { return pose.least; });
  add("largest singular value", result.unit, [](const StandinPose& pose) { return pose.largest; });
  add("torque map error", "1", [](const StandinPose& pose) { return pose.map_error; });
  const auto count = [](int value) { return value < 0 ? kNan : value; };
  add("ways to put the limbs together", "",
      [=](const StandinPose& pose) { return count(pose.ways); });
  add("joint poses with these drives", "",
      [=](const StandinPose& pose) { return count(pose.joint_poses); });
  for (const bool all : {true, false}) {
    for (size_t i = 0; i < n; ++i) {
      for (size_t j = 0; j <= i; ++j) {
        const size_t lengths = static_cast<size_t>(std::ranges::count(
            std::array{result.joint_units[i], result.joint_units[j]}, std::string("m")));
        add(fmt::format("{} {} {}", all ? "inertia" : "rotors", result.joints[i], result.joints[j]),
            std::array{"kg m²", "kg m", "kg"}.at(lengths),
            [=](const StandinPose& pose) { return entry(all ? pose.M : pose.R, i, j); });
      }
    }
  }
  add_vector(result.joints, " peak torque alone", joint_force,
             [](const StandinPose& pose) { return pose.torque_alone; });
  add_vector(result.joints, " highest rate alone", joint_rate,
             [](const StandinPose& pose) { return pose.speed_alone; });
  for (const bool torque : {true, false}) {
    if (n != 2 || !(torque ? result.torque_limits : result.speed_limits)) continue;
    for (const size_t corner : {size_t{0}, size_t{1}}) {
      for (size_t k = 0; k < n; ++k) {
        add(fmt::format("{} {} corner {}", result.joints[k], torque ? "torque" : "rate",
                        corner + 1),
            torque ? joint_force(k) : joint_rate(k), [=, &result](const StandinPose& pose) {
              return pose.status == PoseStatus::kUsable ? CornersAt(result, pose, torque)[corner][k]
                                                        : kNan;
            });
      }
    }
  }
  add_vector(result.drives, " at rest", drive_force,
             [](const StandinPose& pose) { return pose.rest.full; });
  for (size_t c = 0; c <= kWhole; ++c) {
    add_vector(result.drives, std::string(" error at rest: ") + kCauseNames.at(c), drive_force,
               [c](const StandinPose& pose) { return pose.rest.errors.at(c); });
  }
  std::string csv;
  for (const CsvColumn& column : columns) csv += CsvCell(column.heading) + ",";
  csv.back() = '\n';
  for (const StandinPose& pose : result.poses) {
    for (const CsvColumn& column : columns) csv += column.cell(pose) + ",";
    csv.back() = '\n';
  }
  return csv;
}

std::string StandinPage(const StandinResult& result, const std::string& mechanism) {
  Page page;
  for (const ReportSection& section : SectionsOf(result)) page.Add(section);
  return page.Write({.kicker = "mbverify standin",
                     .title = mechanism,
                     .lead = VerdictOf(result) + " " + Sentence(HeadLine(result)),
                     .judges = false,
                     .footer = "standin.csv beside this page has every pose, standin.json the "
                               "numbers of this page."});
}

}  // namespace mbv
