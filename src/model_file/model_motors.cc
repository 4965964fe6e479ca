#include "model_file/model_motors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/word_hints.h"

namespace mbv::internal {
namespace {

double FromRpm(double value) { return value * std::numbers::pi / 30.0; }
constexpr UnitSuffix kRpm{"_rpm", "rad/s", FromRpm};

bool Turns(const Drive& drive, const std::vector<Joint>& joints) {
  const auto* joint = std::get_if<JointDrive>(&drive.kind);
  return joint != nullptr &&
         !IsLength(joints[static_cast<size_t>(joint->joint)].kind, joint->coordinate);
}

class MotorReader {
 public:
  MotorReader(const Block& model, const YamlMap& map, bool drive_turns, ModelValues* values)
      : model_(model), map_(map), drive_turns_(drive_turns), values_(*values) {}

  // Empty after a finding.
  std::optional<Motor> Read(int drive) {
    const bool before = yaml().has_errors();
    motor_.drive = drive;
    ReadGear();
    ReadLimits();
    ReadWinding();
    motor_.continuous_curve = ReadCurve("continuous_curve");
    motor_.peak_curve = ReadCurve("peak_curve");
    CheckTogether();
    if (failed_ || (yaml().has_errors() && !before)) return {};
    return motor_;
  }

 private:
  YamlReader& yaml() { return values_.yaml(); }

  void Fail(const YamlNode& node, const std::string& message, const std::string& hint = "") {
    yaml().Error(node, message, hint);
    failed_ = true;
  }

  // A number > 0 where it is given.
  void Positive(const char* key, std::initializer_list<UnitSuffix> units, double* target) {
    const YamlMap::InUnit found = map_.FindInUnit(key, units);
    if (found.node == nullptr) return;
    const auto value = values_.Number(model_, map_, key, units);
    if (!value) {
      failed_ = true;
    } else if (*value > 0.0) {
      *target = *value;
    } else {
      Fail(*found.node,
           fmt::format("{0} = {1} violates {0} > 0", map_.PathOf(found.key), found.node->text));
    }
  }

  // A motor that turns moves a slide by a spindle, a belt or a rack.
  void ReadGear() {
    double lead = kNan;
    Positive("gear_ratio", {kPlain}, &motor_.gear_ratio);
    Positive("lead", {kPlain, kMm}, &lead);
    Positive("efficiency", {kPlain}, &motor_.efficiency);
    Positive("rotor_inertia", {kPlain}, &motor_.rotor_inertia);
    motor_.turns = drive_turns_ || !std::isnan(lead);
    if (const YamlNode* kind = map_.Find("kind")) {
      const auto word = yaml().Choice(*kind, map_.PathOf("kind"), {"rotary", "linear"});
      failed_ = failed_ || !word;
      motor_.turns = word.value_or(0) == 0;
    }
    if (std::isnan(lead)) return;
    motor_.gear_ratio *= 2.0 * std::numbers::pi / lead;
    if (drive_turns_) {
      Fail(*map_.FindInUnit("lead", {kPlain, kMm}).node,
           fmt::format("{} is given, but the drive turns", map_.PathOf("lead")),
           "a lead is the way of a slide per turn of the motor; state gear_ratio");
    }
  }

  void ReadLimits() {
    Positive("continuous", {kPlain}, &motor_.continuous);
    Positive("peak", {kPlain}, &motor_.peak);
    Positive("rated_speed", {kPlain, kRpm}, &motor_.rated_speed);
    Positive("max_speed", {kPlain, kRpm}, &motor_.max_speed);
  }

  void ReadWinding() {
    Positive("torque_constant", {kPlain}, &motor_.torque_constant);
    Positive("resistance", {kPlain}, &motor_.resistance);
    Positive("voltage", {kPlain}, &motor_.voltage);
    Positive("continuous_current", {kPlain}, &motor_.continuous_current);
    Positive("peak_current", {kPlain}, &motor_.peak_current);
  }

  std::vector<CurvePoint> ReadCurve(const char* key) {
    const YamlMap::InUnit found = map_.FindInUnit(key, {kPlain, kRpm});
    if (found.node == nullptr) return {};
    const std::string path = map_.PathOf(found.key);
    const auto items = yaml().Items(*found.node, path);
    if (!items) return {};
    std::vector<CurvePoint> curve;
    for (size_t i = 0; i < items->size(); ++i) {
      const auto point = ReadPoint(*(*items)[i], fmt::format("{}[{}]", path, i), found.unit);
      if (!point) return {};
      if (!curve.empty() && point->speed <= curve.back().speed) {
        Fail(*(*items)[i], fmt::format("{}[{}]: speeds must increase", path, i));
        return {};
      }
      curve.push_back(*point);
    }
    if (curve.size() < 2) Fail(*found.node, path + " has fewer than two points");
    return curve;
  }

  // [speed, torque]
  std::optional<CurvePoint> ReadPoint(const YamlNode& node, const std::string& path,
                                      const UnitSuffix& unit) {
    const auto items = yaml().Items(node, path, 2);
    if (!items) return {};
    const auto speed = values_.Number(model_, *(*items)[0], path + "[0]", unit);
    const auto torque = values_.Number(model_, *(*items)[1], path + "[1]");
    if (!speed || !torque) return {};
    if (*speed >= 0.0 && *torque >= 0.0) return CurvePoint{*speed, *torque};
    Fail(node,
         fmt::format("{} = [{}, {}] violates speed >= 0 and torque >= 0", path, (*items)[0]->text,
                     (*items)[1]->text),
         "limits hold for both directions");
    return {};
  }

  void CheckTogether() {
    const YamlNode& node = *map_.node();
    const auto ordered = [&](const char* low_key, double low, const char* high_key, double high) {
      if (std::isinf(low) || low <= high) return;
      Fail(node, fmt::format("{}: {} = {:g} violates {} <= {} = {:g}", map_.path(), low_key, low,
                             low_key, high_key, high));
    };
    ordered("continuous", motor_.continuous, "peak", motor_.peak);
    ordered("rated_speed", motor_.rated_speed, "max_speed", motor_.max_speed);
    ordered("continuous_current", motor_.continuous_current, "peak_current", motor_.peak_current);
    if (motor_.efficiency > 1.0) {
      Fail(*map_.Find("efficiency"),
           fmt::format("{} = {} violates <= 1", map_.PathOf("efficiency"), motor_.efficiency));
    }
    Needs("torque_constant", std::isnan(motor_.torque_constant),
          {"resistance", "voltage", "continuous_current", "peak_current"});
    Needs("resistance", std::isnan(motor_.resistance), {"voltage"});
  }

  void Needs(const char* key, bool missing, std::initializer_list<const char*> others) {
    for (const char* other : others) {
      if (!missing || !map_.Has(other)) continue;
      Fail(*map_.Find(other), fmt::format("{} needs {}", map_.PathOf(other), key));
    }
  }

  const Block& model_;
  const YamlMap& map_;
  const bool drive_turns_;
  ModelValues& values_;
  Motor motor_;
  bool failed_ = false;
};

const std::vector<std::string> kMotorKeys = {"kind",
                                             "continuous",
                                             "peak",
                                             "rated_speed",
                                             "rated_speed_rpm",
                                             "max_speed",
                                             "max_speed_rpm",
                                             "rotor_inertia",
                                             "gear_ratio",
                                             "lead",
                                             "lead_mm",
                                             "efficiency",
                                             "continuous_curve",
                                             "peak_curve",
                                             "continuous_curve_rpm",
                                             "peak_curve_rpm",
                                             "torque_constant",
                                             "resistance",
                                             "voltage",
                                             "continuous_current",
                                             "peak_current"};

std::string CurveText(const std::vector<CurvePoint>& curve) {
  std::string text;
  for (const CurvePoint& point : curve) {
    text += fmt::format("{}[{}, {}]", text.empty() ? "" : ", ", point.speed, point.torque);
  }
  return "[" + text + "]";
}

}  // namespace

std::string MotorText(const Motor& motor) {
  std::string text = motor.turns ? "kind: rotary" : "kind: linear";
  const auto add = [&text](const char* key, double value) {
    if (std::isfinite(value) && value > 0.0) text += fmt::format(", {}: {}", key, value);
  };
  add("continuous", motor.continuous);
  add("peak", motor.peak);
  add("rated_speed", motor.rated_speed);
  add("max_speed", motor.max_speed);
  add("rotor_inertia", motor.rotor_inertia);
  add("gear_ratio", motor.gear_ratio);
  add("efficiency", motor.efficiency);
  add("torque_constant", motor.torque_constant);
  add("resistance", motor.resistance);
  add("voltage", motor.voltage);
  add("continuous_current", motor.continuous_current);
  add("peak_current", motor.peak_current);
  for (const auto& [key, curve] : {std::pair{"continuous_curve", &motor.continuous_curve},
                                   std::pair{"peak_curve", &motor.peak_curve}}) {
    if (!curve->empty()) text += fmt::format(", {}: {}", key, CurveText(*curve));
  }
  return text;
}

void ReadMotors(const Block& model, const std::vector<Drive>& drives,
                const std::vector<Joint>& joints, ModelValues* values, std::vector<Motor>* motors) {
  YamlReader& yaml = values->yaml();
  std::vector<std::string> names;
  names.reserve(drives.size());
  for (const Drive& drive : drives) names.push_back(drive.name);
  for (const YamlEntry& entry : model.Entries("motors", &yaml)) {
    const auto found = std::find(names.begin(), names.end(), entry.key);
    if (found == names.end()) {
      yaml.Error(entry, fmt::format("motors: there is no drive '{}'", entry.key),
                 DidYouMean(entry.key, names));
      continue;
    }
    const auto drive = static_cast<size_t>(found - names.begin());
    const YamlMap map(&yaml, entry.value.get(), JoinPath("motors", entry.key), kMotorKeys);
    if (!map.valid()) continue;
    auto motor =
        MotorReader(model, map, Turns(drives[drive], joints), values).Read(static_cast<int>(drive));
    if (motor) motors->push_back(std::move(*motor));
  }
}

}  // namespace mbv::internal
