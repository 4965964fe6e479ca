#include "pipeline/stiffness_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <iterator>

#include "mechanism/yaml_reader.h"
#include "reference/frame_stiffness.h"
#include "report/svg_plot.h"

namespace mbv {
namespace {

constexpr int kMostPoints = 1001;  // per axis

std::vector<std::string> SplitAt(const std::string& text, char mark) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == mark) {
      parts.emplace_back();
    } else if (c != ' ') {
      parts.back() += c;
    }
  }
  return parts;
}

class Parser {
 public:
  Parser(const std::string& text, const PoseValues& pose, Diagnostics* diagnostics)
      : text_(text), pose_(pose), diagnostics_(diagnostics) {}

  std::optional<StiffnessMap> Parse() {
    for (const std::string& part : SplitAt(text_, ',')) {
      const size_t at = part.find('=');
      if (at == std::string::npos || at == 0) {
        Error(fmt::format("'{}' is not NAME=VALUE or NAME=LOW:HIGH:POINTS", part));
        continue;
      }
      Add(part.substr(0, at), part.substr(at + 1));
    }
    if (!failed_ && axes_ != 2) Error(fmt::format("{} ranges are given, two are needed", axes_));
    if (failed_) return {};
    return map_;
  }

 private:
  void Error(const std::string& message, const std::string& hint = "") {
    failed_ = true;
    Finding finding;
    finding.file = "--map " + text_;
    finding.message = message;
    finding.hint = hint.empty()
                       ? "e.g. --map platform.x=-0.1:0.1:61,platform.y=-0.1:0.1:61,platform.z=-0.1"
                       : hint;
    diagnostics_->Add(std::move(finding));
  }

  void Add(std::string name, const std::string& value) {
    double factor = 1.0;
    for (const UnitSuffix& unit : {kDeg, kMm}) {
      if (!name.ends_with(unit.suffix)) continue;
      name.resize(name.size() - unit.suffix.size());
      factor = unit.factor;
    }
    if (name != "within" && !pose_.contains(name)) {
      std::vector<std::string> known;
      std::string all;
      for (const auto& [coordinate, unused] : pose_) {
        known.push_back(coordinate);
        all += (all.empty() ? "" : ", ") + coordinate;
      }
      const std::string near = ClosestWord(name, known);
      Error(fmt::format("'{}' is no coordinate of the pose", name),
            near.empty() ? "coordinates: " + all : fmt::format("did you mean '{}'?", near));
      return;
    }
    std::vector<double> numbers;
    for (const std::string& word : SplitAt(value, ':')) {
      const auto number = PlainNumber(word);
      if (!number || !std::isfinite(*number)) {
        Error(fmt::format("{} = {} is no number or range", name, value));
        return;
      }
      numbers.push_back(*number);
    }
    if (numbers.size() == 1) {
      (name == "within" ? map_.within : map_.fixed[name]) = factor * numbers[0];
      return;
    }
    AddRange(name, value, numbers, factor);
  }

  void AddRange(const std::string& name, const std::string& value,
                const std::vector<double>& numbers, double factor) {
    if (numbers.size() != 3 || name == "within") {
      Error(fmt::format("{} = {} is no LOW:HIGH:POINTS", name, value));
      return;
    }
    if (!(numbers[0] < numbers[1]) || numbers[2] < 2 || numbers[2] > kMostPoints ||
        numbers[2] != std::round(numbers[2])) {
      Error(fmt::format("{} = {} violates LOW < HIGH and 2 <= POINTS <= {}", name, value,
                        kMostPoints));
      return;
    }
    if (axes_ < 2) {
      map_.axes[static_cast<size_t>(axes_)] = {name, factor * numbers[0], factor * numbers[1],
                                               static_cast<int>(numbers[2])};
    }
    ++axes_;
  }

  const std::string& text_;
  const PoseValues& pose_;
  Diagnostics* diagnostics_;
  StiffnessMap map_;
  int axes_ = 0;
  bool failed_ = false;
};

double PointOf(const MapAxis& axis, int k) {
  return axis.low + (axis.high - axis.low) * k / (axis.count - 1);
}

StiffnessResult StiffnessAt(const PreparedStiffness& prepared, const PoseValues& pose) {
  if (prepared.form != nullptr) return prepared.form->Evaluate(pose);
  std::vector<Pose> X_WB;
  StiffnessResult result;
  result.summary = CloseLoops(prepared.base, pose, &X_WB);
  if (!result.summary.ok()) return result;
  return FrameStiffness(prepared.base, X_WB, prepared.output);
}

// Those drawn when none are named.
std::vector<std::string> Chosen(const MapResult& result, const std::vector<std::string>& names) {
  if (!names.empty()) return names;
  std::vector<std::string> chosen;
  for (const NamedIndex& index : result.indices) {
    const bool weakest = index.name == "k_translation_min" || index.name == "k_rotation_min";
    if (weakest || (result.closed_form && chosen.size() < 2)) chosen.push_back(index.name);
  }
  return chosen;
}

MapPlot PlotOf(const StiffnessMap& map, const MapResult& result, size_t index,
               const std::string& title) {
  const auto half = [](const MapAxis& axis) {
    return 0.5 * (axis.high - axis.low) / (axis.count - 1);
  };
  const MapAxis &x = map.axes[0], &y = map.axes[1];
  double low = std::numeric_limits<double>::infinity(), high = 0.0;
  for (const double v : result.values[index]) {
    if (!std::isfinite(v)) continue;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  const auto unit = [](const std::string& name) {
    return name.ends_with("yaw") || name.ends_with("roll") || name.ends_with("pitch") ? "rad" : "m";
  };
  return {
      .title = title,
      .x_label = fmt::format("{} [{}]", x.name, unit(x.name)),
      .y_label = fmt::format("{} [{}]", y.name, unit(y.name)),
      .value_label = fmt::format("{} [{}]", result.indices[index].name, result.indices[index].unit),
      .x_min = x.low - half(x),
      .x_max = x.high + half(x),
      .y_min = y.low - half(y),
      .y_max = y.high + half(y),
      .columns = x.count,
      .rows = y.count,
      .values = result.values[index],
      .log_scale = low > 0.0 && high > 10.0 * low,
      .contours = 12};
}

std::string CsvOf(const StiffnessMap& map, const MapResult& result) {
  std::string csv = map.axes[0].name + "," + map.axes[1].name + ",rank";
  auto out = std::back_inserter(csv);
  for (const NamedIndex& index : result.indices) csv += "," + index.name;
  csv += "\n";
  for (int r = 0; r < map.axes[1].count; ++r) {
    for (int c = 0; c < map.axes[0].count; ++c) {
      const size_t k =
          static_cast<size_t>(r) * static_cast<size_t>(map.axes[0].count) + static_cast<size_t>(c);
      fmt::format_to(out, "{:.17g},{:.17g},{}", PointOf(map.axes[0], c), PointOf(map.axes[1], r),
                     result.rank[k]);
      for (const std::vector<double>& values : result.values) {
        fmt::format_to(out, ",{:.17g}", values[k]);
      }
      csv += "\n";
    }
  }
  return csv;
}

std::string FixedText(const StiffnessMap& map) {
  std::string text;
  for (const auto& [name, value] : map.fixed) {
    text += fmt::format("{}{} = {:g}", text.empty() ? "" : ", ", name, value);
  }
  return text;
}

}  // namespace

std::optional<StiffnessMap> ParseMap(const std::string& text, const PoseValues& pose,
                                     Diagnostics* diagnostics) {
  return Parser(text, pose, diagnostics).Parse();
}

std::vector<std::string> UsualMaps(const std::string& mechanism) {
  if (mechanism == "scara_robot") {
    const std::string disc = "platform.x=-0.1:0.1:81,platform.y=-0.1:0.1:81,within=0.1,platform.z=";
    return {disc + "-0.1,platform.yaw_deg=0", disc + "-0.23,platform.yaw_deg=0",
            disc + "-0.23,platform.yaw_deg=45", disc + "-0.23,platform.yaw_deg=-45"};
  }
  if (mechanism == "cabin_robot") {
    return {"platform.x=-0.1:0.1:81,platform.y=0.25:0.45:81"};
  }
  return {};
}

MapResult ComputeMap(const PreparedStiffness& prepared, const StiffnessMap& map,
                     const ProgressFunction& progress) {
  const auto start = std::chrono::steady_clock::now();
  MapResult result;
  result.closed_form = prepared.form != nullptr;
  if (prepared.form != nullptr) {
    for (const StiffnessIndex& index : prepared.form->indices()) {
      result.indices.push_back({index.name, index.unit, index.meaning, kNan});
    }
  }
  const size_t own = result.indices.size();
  for (const NamedIndex& index : GeneralIndices({})) result.indices.push_back(index);
  const auto cells =
      static_cast<size_t>(map.axes[0].count) * static_cast<size_t>(map.axes[1].count);
  result.values.assign(result.indices.size(), std::vector<double>(cells, kNan));
  result.rank.assign(cells, -1);
  PoseValues pose = prepared.scenario.pose;
  for (const auto& [name, value] : map.fixed) pose[name] = value;
  size_t k = 0;
  for (int r = 0; r < map.axes[1].count; ++r) {
    if (progress) progress("map", static_cast<double>(r) / map.axes[1].count);
    for (int c = 0; c < map.axes[0].count; ++c, ++k) {
      const double u = PointOf(map.axes[0], c), v = PointOf(map.axes[1], r);
      if (std::hypot(u, v) > map.within * (1 + 1e-9)) continue;
      ++result.points;
      pose[map.axes[0].name] = u;
      pose[map.axes[1].name] = v;
      const StiffnessResult at = StiffnessAt(prepared, pose);
      if (!at.K.allFinite()) continue;
      ++result.reached;
      result.rank[k] = at.rank;
      if (prepared.form != nullptr) {
        const std::vector<double> values = prepared.form->IndexValues(at);
        for (size_t i = 0; i < own; ++i) result.values[i][k] = values[i];
      }
      const std::vector<NamedIndex> general = GeneralIndices(at);
      for (size_t i = 0; i < general.size(); ++i) result.values[own + i][k] = general[i].value;
    }
  }
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

std::string MapName(const StiffnessMap& map) {
  std::string name = map.axes[0].name + "_" + map.axes[1].name;
  for (const auto& [coordinate, value] : map.fixed) {
    name += fmt::format("_{}{:g}", coordinate, value);
  }
  return name;
}

std::vector<std::pair<std::string, std::string>> MapFiles(const StiffnessMap& map,
                                                          const MapResult& result,
                                                          const std::string& mechanism,
                                                          const std::vector<std::string>& names,
                                                          Diagnostics* diagnostics) {
  std::vector<std::pair<std::string, std::string>> files = {
      {MapName(map) + ".csv", CsvOf(map, result)}};
  std::vector<std::string> known;
  for (const NamedIndex& index : result.indices) known.push_back(index.name);
  for (const std::string& name : Chosen(result, names)) {
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end()) {
      Finding finding;
      finding.file = "--index " + name;
      finding.message = "there is no such index";
      const std::string near = ClosestWord(name, known);
      for (const std::string& word : known) {
        finding.hint += (finding.hint.empty() ? "known: " : ", ") + word;
      }
      if (!near.empty()) finding.hint = fmt::format("did you mean '{}'?", near);
      diagnostics->Add(std::move(finding));
      continue;
    }
    const std::string title =
        fmt::format("{}: {}{}{}", mechanism, name, map.fixed.empty() ? "" : ", ", FixedText(map));
    files.emplace_back(
        fmt::format("{}_{}.svg", MapName(map), name),
        ToSvg(PlotOf(map, result, static_cast<size_t>(found - known.begin()), title)));
  }
  return files;
}

std::string MapText(const StiffnessMap& map, const MapResult& result,
                    const std::vector<std::string>& names) {
  std::string text = fmt::format(
      "map over {} and {}{}: {} of {} poses reached, by {}, {:.2f} s\n", map.axes[0].name,
      map.axes[1].name, map.fixed.empty() ? "" : " at " + FixedText(map), result.reached,
      result.points, result.closed_form ? "the closed form" : "frame elements", result.wall_s);
  for (const std::string& name : Chosen(result, names)) {
    for (size_t i = 0; i < result.indices.size(); ++i) {
      if (result.indices[i].name != name) continue;
      std::vector<std::pair<double, size_t>> sorted;
      for (size_t k = 0; k < result.values[i].size(); ++k) {
        if (std::isfinite(result.values[i][k])) sorted.emplace_back(result.values[i][k], k);
      }
      if (sorted.empty()) continue;
      std::sort(sorted.begin(), sorted.end());
      const auto place = [&](size_t k) {
        const auto columns = static_cast<size_t>(map.axes[0].count);
        return fmt::format("({:.4g}, {:.4g})", PointOf(map.axes[0], static_cast<int>(k % columns)),
                           PointOf(map.axes[1], static_cast<int>(k / columns)));
      };
      text += fmt::format(
          "  {:<20} median {:.5g}, smallest {:.5g} at {}, largest {:.5g} at {} {}\n", name,
          sorted[sorted.size() / 2].first, sorted.front().first, place(sorted.front().second),
          sorted.back().first, place(sorted.back().second), result.indices[i].unit);
    }
  }
  return text;
}

}  // namespace mbv
