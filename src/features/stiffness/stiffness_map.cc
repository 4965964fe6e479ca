#include "features/stiffness/stiffness_map.h"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <span>

#include "base/text.h"
#include "base/worker_pool.h"
#include "math/bytes.h"
#include "model_file/yaml/yaml_reader.h"
#include "plot/svg_plot.h"
#include "reference/frame_stiffness.h"
#include "verify/ranges.h"

namespace mbv {
namespace {

double PointOf(const MapAxis& axis, int k) {
  return axis.low + (axis.high - axis.low) * k / (axis.count - 1);
}

// Sets `out_of_range` instead of a result where a joint or drive would have to leave its range.
StiffnessResult StiffnessAt(const PreparedStiffness& prepared, const PoseValues& pose,
                            bool* out_of_range) {
  StiffnessResult result;
  if (prepared.form != nullptr) {
    result = prepared.form->EvaluateMatrices(pose);
    *out_of_range = result.K.allFinite() && !prepared.form->IsWithinRanges(pose);
    return result;
  }
  std::vector<Pose> X_WB;
  result.summary = CloseLoops(prepared.base, pose, &X_WB);
  if (!result.summary.ok()) return result;
  *out_of_range = !IsWithinRanges(prepared.base, X_WB);
  return *out_of_range ? result : FrameStiffness(prepared.base, X_WB, prepared.output);
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

// Pages show millimetres and degrees.
double FactorOf(const std::string& unit) {
  return unit == "m" ? 1e3 : unit == "rad" ? 180.0 / std::numbers::pi : 1.0;
}
const char* UnitOnPaper(const std::string& unit) {
  return unit == "m" ? "mm" : unit == "rad" ? "deg" : unit.c_str();
}

// "yaw" for "platform.yaw".
std::string ShortName(const std::string& name) {
  for (const char* component : {".x", ".y", ".z", ".roll", ".pitch", ".yaw"}) {
    if (name.ends_with(component)) return component + 1;
  }
  return name;
}

MapPlot PlotOf(const StiffnessMap& map, const MapResult& result, size_t index,
               const std::string& title) {
  const auto half = [](const MapAxis& axis) {
    return 0.5 * (axis.high - axis.low) / (axis.count - 1);
  };
  const MapAxis &x = map.axes[0], &y = map.axes[1];
  const double of_x = FactorOf(x.unit), of_y = FactorOf(y.unit);
  double low = std::numeric_limits<double>::infinity(), high = 0.0;
  for (const double v : result.values[index]) {
    if (!std::isfinite(v)) continue;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  return {
      .title = title,
      .x_label = fmt::format("{} [{}]", ShortName(x.name), UnitOnPaper(x.unit)),
      .y_label = fmt::format("{} [{}]", ShortName(y.name), UnitOnPaper(y.unit)),
      .value_label = fmt::format("{} [{}]", result.indices[index].name, result.indices[index].unit),
      .x_min = of_x * (x.low - half(x)),
      .x_max = of_x * (x.high + half(x)),
      .y_min = of_y * (y.low - half(y)),
      .y_max = of_y * (y.high + half(y)),
      .columns = x.count,
      .rows = y.count,
      .values = result.values[index],
      .log_scale = low > 0.0 && high > 10.0 * low,
      .contours = 12};
}

std::string CsvOf(const StiffnessMap& map, const MapResult& result) {
  std::string csv;
  for (const auto& axis : map.axes) csv += CsvCell(axis.name + "_" + axis.unit) + ",";
  csv += "rank";
  auto out = std::back_inserter(csv);
  for (const NamedIndex& index : result.indices) csv += "," + CsvCell(index.name);
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
  for (const MapValue& fixed : map.fixed) {
    text += fmt::format("{}{} = {:g} {}", text.empty() ? "" : ", ", ShortName(fixed.name),
                        FactorOf(fixed.unit) * fixed.value, UnitOnPaper(fixed.unit));
  }
  return text;
}

// Of one pose: whether it counts, is out of range, is reached; rank; indices, the form's own first.
constexpr size_t kHead = 4;
using MapCell = std::vector<double>;

MapCell CellOf(const PreparedStiffness& prepared, const StiffnessMap& map, size_t all, double u,
               double v) {
  MapCell cell(kHead + all, kNan);
  cell[0] = cell[1] = cell[2] = 0.0;
  cell[3] = -1.0;
  if (std::hypot(u, v) > map.within * (1 + 1e-9)) return cell;
  cell[0] = 1.0;
  PoseValues pose = prepared.scenario.pose;
  for (const MapValue& fixed : map.fixed) pose[fixed.name] = fixed.value;
  pose[map.axes[0].name] = u;
  pose[map.axes[1].name] = v;
  bool out_of_range = false;
  const StiffnessResult at = StiffnessAt(prepared, pose, &out_of_range);
  cell[1] = out_of_range ? 1.0 : 0.0;
  if (out_of_range || !at.K.allFinite()) return cell;
  cell[2] = 1.0;
  cell[3] = at.rank;
  const std::vector<NamedIndex> general = GeneralIndices(at);
  const size_t own = all - general.size();
  if (own > 0) prepared.form->IndexValues(at, std::span(cell).subspan(kHead, own));
  for (size_t i = 0; i < general.size(); ++i) cell[kHead + own + i] = general[i].value;
  return cell;
}

}  // namespace

MapResult ComputeMap(const PreparedStiffness& prepared, const StiffnessMap& map,
                     const ProgressFunction& progress, int jobs) {
  const auto start = std::chrono::steady_clock::now();
  MapResult result;
  result.closed_form = prepared.form != nullptr;
  result.indices = IndicesOf(prepared.form.get(), {});
  const size_t all = result.indices.size();
  const auto columns = static_cast<size_t>(map.axes[0].count);
  const auto rows = static_cast<size_t>(map.axes[1].count);
  result.values.assign(all, std::vector<double>(columns * rows, kNan));
  result.rank.assign(columns * rows, -1);
  using Row = std::vector<MapCell>;
  const auto compute = [&](size_t r) {
    Row row;
    for (int c = 0; c < map.axes[0].count; ++c) {
      row.push_back(CellOf(prepared, map, all, PointOf(map.axes[0], c),
                           PointOf(map.axes[1], static_cast<int>(r))));
    }
    return ToBytes(row);
  };
  const auto take = [&](size_t r, const std::optional<std::string>& bytes) {
    const auto row = bytes ? FromBytes<Row>(*bytes) : std::nullopt;
    if (!row) ++result.lost_rows;
    for (size_t c = 0; row && c < columns; ++c) {
      const MapCell& cell = (*row)[c];
      const size_t k = r * columns + c;
      result.points += cell[0] > 0.0;
      result.out_of_range += cell[1] > 0.0;
      result.reached += cell[2] > 0.0;
      result.rank[k] = static_cast<int>(cell[3]);
      for (size_t i = 0; i < all; ++i) result.values[i][k] = cell[kHead + i];
    }
    if (progress) progress("map", static_cast<double>(r + 1) / map.axes[1].count);
  };
  ShareOut(rows, jobs, compute, take);
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

std::string MapName(const StiffnessMap& map) {
  std::string name = ShortName(map.axes[0].name) + "_" + ShortName(map.axes[1].name);
  for (const MapValue& fixed : map.fixed) {
    name += fmt::format("_{}{:g}{}", ShortName(fixed.name), FactorOf(fixed.unit) * fixed.value,
                        UnitOnPaper(fixed.unit));
  }
  return name;
}

std::vector<std::pair<std::string, MapPlot>> MapPlots(const StiffnessMap& map,
                                                      const MapResult& result,
                                                      const std::string& mechanism,
                                                      const std::vector<std::string>& names,
                                                      Diagnostics* diagnostics) {
  std::vector<std::pair<std::string, MapPlot>> plots;
  std::vector<std::string> known;
  for (const NamedIndex& index : result.indices) known.push_back(index.name);
  for (const std::string& name : Chosen(result, names)) {
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end()) {
      Finding finding;
      finding.file = "--index " + name;
      finding.message = "there is no such index";
      finding.hint = DidYouMean(name, known, known.empty() ? "" : "known: " + Joined(known));
      diagnostics->Add(std::move(finding));
      continue;
    }
    const std::string title =
        fmt::format("{}: {}{}{}", mechanism, name, map.fixed.empty() ? "" : ", ", FixedText(map));
    plots.emplace_back(fmt::format("{}_{}", MapName(map), name),
                       PlotOf(map, result, static_cast<size_t>(found - known.begin()), title));
  }
  return plots;
}

std::vector<std::pair<std::string, std::string>> MapFiles(const StiffnessMap& map,
                                                          const MapResult& result,
                                                          const std::string& mechanism,
                                                          const std::vector<std::string>& names,
                                                          Diagnostics* diagnostics) {
  std::vector<std::pair<std::string, std::string>> files = {
      {MapName(map) + ".csv", CsvOf(map, result)}};
  for (const auto& [name, plot] : MapPlots(map, result, mechanism, names, diagnostics)) {
    files.emplace_back(name + ".svg", ToSvg(plot));
  }
  return files;
}

std::string MapText(const StiffnessMap& map, const MapResult& result,
                    const std::vector<std::string>& names) {
  std::string text = fmt::format(
      "map over {} and {}{}: {} of {} poses reached{}, by {}, {:.2f} s\n",
      ShortName(map.axes[0].name), ShortName(map.axes[1].name),
      map.fixed.empty() ? "" : " at " + FixedText(map), result.reached, result.points,
      result.out_of_range == 0
          ? ""
          : fmt::format(" ({} more only beyond ranges of joints or drives)", result.out_of_range),
      result.closed_form ? "the closed form" : "frame elements", result.wall_s);
  if (result.lost_rows > 0) {
    text += fmt::format("  {} of {} rows are empty: their processes were killed\n",
                        result.lost_rows, map.axes[1].count);
  }
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
        const MapAxis &x = map.axes[0], &y = map.axes[1];
        return fmt::format(
            "({:.4g} {}, {:.4g} {})", FactorOf(x.unit) * PointOf(x, static_cast<int>(k % columns)),
            UnitOnPaper(x.unit), FactorOf(y.unit) * PointOf(y, static_cast<int>(k / columns)),
            UnitOnPaper(y.unit));
      };
      text += fmt::format(
          "  {:<20} median {:.5g}, smallest {:.5g} at {}, largest {:.5g} at {} {}\n", name,
          sorted[sorted.size() / 2].first, sorted.front().first, place(sorted.front().second),
          sorted.back().first, place(sorted.back().second), result.indices[i].unit);
    }
  }
  return text;
}

// Maps as text.

namespace {

constexpr int kMostPoints = 1001;  // per axis

std::vector<std::string> SplitAt(const std::string& text, const char* marks) {
  std::vector<std::string> parts;
  for (size_t at = 0; at <= text.size();) {
    const size_t end = std::min(text.find_first_of(marks, at), text.size());
    if (end > at) parts.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return parts;
}

class Parser {
 public:
  Parser(const std::string& text, const PreparedStiffness& prepared, Diagnostics* diagnostics)
      : text_(text), prepared_(prepared), diagnostics_(diagnostics) {
    const Motion motion = PoseMotion(prepared.base, prepared.scenario.pose);
    for (const Command& command : motion.commands) {
      units_[command.name] = CoordinateUnit(prepared.base, command.terms[0].coordinate);
    }
  }

  std::optional<StiffnessMap> Parse() {
    for (const std::string& part : SplitAt(text_, ", \t")) {
      const size_t at = part.find('=');
      if (at == std::string::npos || at == 0) {
        Error(fmt::format("'{}' is not NAME=VALUE or NAME=LOW:HIGH:POINTS", part));
        continue;
      }
      Add(part.substr(0, at), part.substr(at + 1));
    }
    if (!failed_ && axes_ == 0) TakeUsualRanges();
    if (!failed_ && axes_ != 2) Error(fmt::format("{} ranges are given, two are needed", axes_));
    if (!failed_) CheckOnce();
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

  // The coordinate of the pose that is meant; "" after a finding.
  std::string Resolve(const std::string& name) {
    if (units_.contains(name)) return name;
    std::vector<std::string> known, ends;
    const std::string component = "." + (name == "phi" ? "yaw" : name);
    for (const auto& [coordinate, unit] : units_) {
      known.push_back(coordinate);
      if (coordinate.ends_with(component)) ends.push_back(coordinate);
    }
    if (ends.size() == 1) return ends[0];
    Error(fmt::format("'{}' is not a coordinate of the pose", name),
          DidYouMean(name, known, fmt::format("coordinates: {}", fmt::join(known, ", "))));
    return "";
  }

  void Add(const std::string& given, const std::string& value) {
    const auto [key, unit] = SplitUnit(given);
    const bool within = key == "within";
    const std::string name = within ? key : Resolve(key);
    if (name.empty()) return;
    std::vector<double> numbers;
    for (const std::string& word : SplitAt(value, ":")) {
      const auto number = PlainNumber(word);
      if (!number || !std::isfinite(*number)) {
        Error(fmt::format("{} = {} is not a number or range", key, value));
        return;
      }
      numbers.push_back(*number);
    }
    if (numbers.size() == 1 && within) {
      map_.within = unit.to_si(numbers[0]);
    } else if (numbers.size() == 1) {
      map_.fixed.push_back({name, units_[name], unit.to_si(numbers[0])});
    } else if (numbers.size() == 3 && !within) {
      AddRange(name, value, numbers, unit);
    } else {
      Error(fmt::format("{} = {} is not LOW:HIGH:POINTS", key, value));
    }
  }

  void AddRange(const std::string& name, const std::string& value,
                const std::vector<double>& numbers, const UnitSuffix& unit) {
    if (!(numbers[0] < numbers[1]) || numbers[2] < 2 || numbers[2] > kMostPoints ||
        numbers[2] != std::round(numbers[2])) {
      Error(fmt::format("{} = {} violates LOW < HIGH and 2 <= POINTS <= {}", name, value,
                        kMostPoints));
      return;
    }
    if (axes_ < 2) {
      map_.axes[static_cast<size_t>(axes_)] = {name, units_[name], unit.to_si(numbers[0]),
                                               unit.to_si(numbers[1]),
                                               static_cast<int>(numbers[2])};
    }
    ++axes_;
  }

  void TakeUsualRanges() {
    const std::vector<std::string> usual = UsualMaps(prepared_.base.name);
    if (usual.empty()) return;
    const auto map = Parser(usual[0], prepared_, diagnostics_).Parse();
    if (!map) return;
    axes_ = 2;
    map_.axes = map->axes;
    if (std::isnan(map_.within)) map_.within = map->within;
  }

  void CheckOnce() {
    std::vector<std::string> names = {map_.axes[0].name, map_.axes[1].name};
    for (const MapValue& fixed : map_.fixed) names.push_back(fixed.name);
    std::sort(names.begin(), names.end());
    const auto twice = std::adjacent_find(names.begin(), names.end());
    if (twice != names.end()) {
      Error(fmt::format("{} is given twice, or has a value and a range", *twice));
    }
  }

  const std::string& text_;
  const PreparedStiffness& prepared_;
  Diagnostics* diagnostics_;
  std::map<std::string, std::string> units_;  // of the pose's coordinates
  StiffnessMap map_;
  int axes_ = 0;
  bool failed_ = false;
};

}  // namespace

std::optional<StiffnessMap> ParseMap(const std::string& text, const PreparedStiffness& prepared,
                                     Diagnostics* diagnostics) {
  return Parser(text, prepared, diagnostics).Parse();
}

std::vector<std::string> UsualMaps(const std::string& mechanism) {
  const StiffnessFormRow* row = FindStiffnessForm(mechanism);
  return row == nullptr ? std::vector<std::string>{} : row->usual_maps;
}

}  // namespace mbv
