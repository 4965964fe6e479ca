// Maps as text.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/word_hints.h"
#include "input/yaml_reader.h"
#include "pipeline/stiffness_map.h"
#include "scenario/motion_reader.h"

namespace mbv {
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
    Error(fmt::format("'{}' is no coordinate of the pose", name),
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
        Error(fmt::format("{} = {} is no number or range", key, value));
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
      Error(fmt::format("{} = {} is no LOW:HIGH:POINTS", key, value));
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
