// Motors and their DC link in a model file, and catalogues of motors and gearboxes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/text.h"
#include "model_file/catalogue.h"
#include "model_file/model_drives.h"

namespace mbv::internal {
namespace {

using Units = std::initializer_list<UnitSuffix>;
constexpr Units kAlone = {kPlain}, kSpeeds = {kPlain, kRpm}, kTorques = {kPlain, kNcm, kMnm},
                kInertias = {kPlain, kKgCm2}, kLengths = {kPlain, kMm};

// A key with a number; > 0 unless it may be anything.
template <typename T>
struct NumberKey {
  const char* key;
  double T::*number;
  const Units* units = &kAlone;
  bool required = false, positive = true;
};

constexpr NumberKey<Motor> kMotorNumbers[] = {
    {"continuous", &Motor::continuous, &kTorques},
    {"peak", &Motor::peak, &kTorques},
    {"rated_speed", &Motor::rated_speed, &kSpeeds},
    {"max_speed", &Motor::max_speed, &kSpeeds},
    {"rotor_inertia", &Motor::rotor_inertia, &kInertias},
    {"gear_ratio", &Motor::gear_ratio},
    {"efficiency", &Motor::efficiency},
    {"torque_constant", &Motor::torque_constant, &kTorques},
    {"resistance", &Motor::resistance},
    {"voltage", &Motor::voltage},
    {"continuous_current", &Motor::continuous_current},
    {"peak_current", &Motor::peak_current}};
struct Lead {
  double m = kNan;
};
constexpr NumberKey<Lead> kLeadNumber[] = {{"lead", &Lead::m, &kLengths}};
constexpr NumberKey<MotorThermal> kThermalNumbers[] = {
    {"winding_to_housing", &MotorThermal::winding_to_housing, &kAlone, true},
    {"housing_to_ambient", &MotorThermal::housing_to_ambient, &kAlone, true},
    {"winding_time", &MotorThermal::winding_time, &kAlone, true},
    {"housing_time", &MotorThermal::housing_time, &kAlone, true},
    {"max_winding_C", &MotorThermal::max_winding_C, &kAlone, true, false},
    {"ambient_C", &MotorThermal::ambient_C, &kAlone, false, false},
    {"resistance_at_C", &MotorThermal::resistance_at_C, &kAlone, false, false},
    {"resistance_growth", &MotorThermal::resistance_growth}};
constexpr NumberKey<MotorGearbox> kGearboxNumbers[] = {
    {"mean_torque", &MotorGearbox::mean_torque, &kTorques},
    {"peak_torque", &MotorGearbox::peak_torque, &kTorques},
    {"emergency_torque", &MotorGearbox::emergency_torque, &kTorques},
    {"mean_speed", &MotorGearbox::mean_speed, &kSpeeds},
    {"max_speed", &MotorGearbox::max_speed, &kSpeeds},
    {"exponent", &MotorGearbox::exponent}};
constexpr NumberKey<MotorBrake> kBrakeNumbers[] = {{"torque", &MotorBrake::torque, &kTorques, true},
                                                   {"energy", &MotorBrake::energy}};
constexpr NumberKey<DcLink> kLinkNumbers[] = {
    {"efficiency", &DcLink::efficiency}, {"capacitance", &DcLink::capacitance},
    {"voltage", &DcLink::voltage},       {"brake_voltage", &DcLink::brake_voltage},
    {"resistance", &DcLink::resistance}, {"mean_power", &DcLink::mean_power},
    {"peak_power", &DcLink::peak_power}};
// Of a catalogue alone.
constexpr NumberKey<CatalogueMotor> kOwnNumbers[] = {{"mass", &CatalogueMotor::mass},
                                                     {"cost", &CatalogueMotor::cost}};
constexpr NumberKey<CatalogueGearbox> kStageNumbers[] = {
    {"ratio", &CatalogueGearbox::ratio, &kAlone, true},
    {"efficiency", &CatalogueGearbox::efficiency},
    {"inertia", &CatalogueGearbox::inertia, &kInertias},
    {"mass", &CatalogueGearbox::mass},
    {"cost", &CatalogueGearbox::cost}};

using Keys = std::vector<std::string>;

template <typename T, size_t n>
Keys KeysOf(const NumberKey<T> (&rows)[n], Keys keys = {}) {
  for (const NumberKey<T>& row : rows) {
    for (const UnitSuffix& unit : *row.units) keys.push_back(row.key + std::string(unit.suffix));
  }
  return keys;
}

// What a motor has in addition to numbers; `lead` and `kind` belong to its place in a model.
Keys MotorKeys(Keys more) {
  for (const char* key : {"peak_range", "continuous_curve", "continuous_curve_rpm", "peak_curve",
                          "peak_curve_rpm", "thermal", "brake", "kind"}) {
    more.emplace_back(key);
  }
  return KeysOf(kMotorNumbers, std::move(more));
}

bool Turns(const Drive& drive, const std::vector<Joint>& joints) {
  const auto* joint = std::get_if<JointDrive>(&drive.kind);
  return joint != nullptr &&
         !IsLength(joints[static_cast<size_t>(joint->joint)].kind, joint->coordinate);
}

// Numbers of a map, in the scope of a block.
class NumberReader {
 public:
  NumberReader(const Block& scope, ModelValues* values) : scope_(scope), values_(*values) {}

  [[nodiscard]] bool failed() const { return failed_; }
  YamlReader& yaml() { return values_.yaml(); }

  void Fail(const YamlNode& node, const std::string& message, const std::string& hint = "") {
    yaml().Error(node, message, hint);
    failed_ = true;
  }

  // `turns`: what the numbers are about; a unit of data sheets is one of turning.
  template <typename T, size_t n>
  void Read(const YamlMap& map, const NumberKey<T> (&rows)[n], bool turns, T* into) {
    for (const NumberKey<T>& row : rows) {
      const YamlMap::InUnit found = map.FindInUnit(row.key, *row.units);
      if (found.node == nullptr) {
        if (row.required && map.Required(row.key) == nullptr) failed_ = true;
        continue;
      }
      const std::string path = map.PathOf(found.key);
      if (!turns && !found.unit.suffix.empty()) {
        Fail(*found.node, path + ": the motor slides",
             fmt::format("{} in SI units: N, m/s, kg", row.key));
        continue;
      }
      const auto value = values_.Number(scope_, *found.node, path, found.unit);
      if (!value) {
        failed_ = true;
      } else if (row.positive && !(*value > 0.0)) {
        Fail(*found.node, fmt::format("{0} = {1} violates {0} > 0", path, found.node->text));
      } else {
        into->*row.number = *value;
      }
    }
  }
  // A section of its own with these keys.
  template <typename T, size_t n>
  std::optional<T> Section(const YamlMap& map, const char* key, const NumberKey<T> (&rows)[n],
                           bool turns) {
    const YamlNode* node = map.Find(key);
    if (node == nullptr) return {};
    const YamlMap section(&yaml(), node, map.PathOf(key), KeysOf(rows));
    failed_ = failed_ || !section.valid();
    if (!section.valid()) return {};
    T read;
    Read(section, rows, turns, &read);
    return read;
  }

  void Ordered(const YamlMap& map, const char* low_key, double low, const char* high_key,
               double high) {
    if (std::isinf(low) || !(low > high)) return;
    Fail(*map.node(), fmt::format("{}: {} = {:g} violates {} <= {} = {:g}", map.path(), low_key,
                                  low, low_key, high_key, high));
  }
  void AtMostOne(const YamlMap& map, double efficiency) {
    if (!(efficiency > 1.0)) return;
    Fail(*map.Find("efficiency"),
         fmt::format("{} = {} violates <= 1", map.PathOf("efficiency"), efficiency));
  }
  void Needs(const YamlMap& map, const char* key, bool missing,
             std::initializer_list<const char*> others) {
    for (const char* other : others) {
      if (!missing || !map.Has(other)) continue;
      Fail(*map.Find(other), fmt::format("{} needs {}", map.PathOf(other), key));
    }
  }
  void CheckGearbox(const YamlMap& map, const MotorGearbox& gearbox) {
    Ordered(map, "mean_torque", gearbox.mean_torque, "peak_torque", gearbox.peak_torque);
    Ordered(map, "peak_torque", gearbox.peak_torque, "emergency_torque", gearbox.emergency_torque);
    Ordered(map, "mean_speed", gearbox.mean_speed, "max_speed", gearbox.max_speed);
  }

 protected:
  const Block& scope_;
  ModelValues& values_;
  bool failed_ = false;
};

class MotorReader : public NumberReader {
 public:
  MotorReader(const Block& scope, const YamlMap& map, bool drive_turns, ModelValues* values)
      : NumberReader(scope, values), map_(map), drive_turns_(drive_turns) {}

  // Empty after a finding.
  std::optional<Motor> Read() {
    const bool before = yaml().has_errors();
    const double lead = ReadKind();
    NumberReader::Read(map_, kMotorNumbers, motor_.turns, &motor_);
    if (lead > 0.0) motor_.gear_ratio *= motor_.spindle = 2.0 * std::numbers::pi / lead;
    if (const YamlNode* range = map_.Find("peak_range")) {
      const auto sides = values_.Range(scope_, *range, map_.PathOf("peak_range"), {kPlain});
      failed_ = failed_ || !sides;
      if (sides) motor_.least = sides->lower, motor_.most = sides->upper;
    }
    motor_.continuous_curve = ReadCurve("continuous_curve");
    motor_.peak_curve = ReadCurve("peak_curve");
    motor_.thermal = Section(map_, "thermal", kThermalNumbers, true);
    motor_.gearbox = Section(map_, "gearbox", kGearboxNumbers, motor_.turns);
    motor_.brake = Section(map_, "brake", kBrakeNumbers, motor_.turns);
    CheckTogether();
    if (failed_ || (yaml().has_errors() && !before)) return {};
    return motor_;
  }

 private:
  // A motor that turns moves a slide by a spindle, a belt or a rack: the lead, or NaN.
  double ReadKind() {
    const YamlMap::InUnit given = map_.FindInUnit("lead", kLengths);
    Lead lead;
    NumberReader::Read(map_, kLeadNumber, true, &lead);
    motor_.turns = drive_turns_ || given.node != nullptr;
    if (const YamlNode* kind = map_.Find("kind")) {
      const auto word = yaml().Choice(*kind, map_.PathOf("kind"), {"rotary", "linear"});
      failed_ = failed_ || !word;
      motor_.turns = word.value_or(0) == 0;
    }
    if (given.node != nullptr && drive_turns_) {
      Fail(*given.node, fmt::format("{} is given, but the drive turns", map_.PathOf("lead")),
           "a lead is the way of a slide per turn of the motor; state gear_ratio");
    }
    return lead.m;
  }

  // [speed, torque], …
  std::vector<CurvePoint> ReadCurve(const char* key) {
    const YamlMap::InUnit found = map_.FindInUnit(key, kSpeeds);
    if (found.node == nullptr) return {};
    const std::string path = map_.PathOf(found.key);
    const auto points = values_.Points(scope_, *found.node, path, found.unit);
    failed_ = failed_ || !points;
    std::vector<CurvePoint> curve;
    for (size_t i = 0; points && i < points->size(); ++i) {
      const auto& [speed, torque] = (*points)[i];
      curve.push_back({speed, torque});
      if (speed >= 0.0 && torque >= 0.0) continue;
      const auto& two = found.node->items[i]->items;
      Fail(*found.node->items[i],
           fmt::format("{}[{}] = [{}, {}] violates speed >= 0 and torque >= 0", path, i,
                       two[0]->text, two[1]->text),
           "limits hold for both directions");
    }
    return curve;
  }

  void CheckTogether() {
    Ordered(map_, "continuous", motor_.continuous, "peak", motor_.peak);
    Ordered(map_, "rated_speed", motor_.rated_speed, "max_speed", motor_.max_speed);
    Ordered(map_, "continuous_current", motor_.continuous_current, "peak_current",
            motor_.peak_current);
    AtMostOne(map_, motor_.efficiency);
    Needs(map_, "torque_constant", std::isnan(motor_.torque_constant),
          {"resistance", "voltage", "continuous_current", "peak_current", "thermal"});
    Needs(map_, "resistance", std::isnan(motor_.resistance), {"voltage", "thermal"});
    if (motor_.gearbox) CheckGearbox(map_, *motor_.gearbox);
    if (!motor_.thermal || motor_.thermal->max_winding_C > motor_.thermal->ambient_C) return;
    if (std::isnan(motor_.thermal->max_winding_C)) return;
    Fail(*map_.Find("thermal"),
         fmt::format("{}: max_winding_C = {:g} violates max_winding_C > ambient_C = {:g}",
                     map_.PathOf("thermal"), motor_.thermal->max_winding_C,
                     motor_.thermal->ambient_C));
  }

  const YamlMap& map_;
  const bool drive_turns_;
  Motor motor_;
};

// ", key: number" of those that are stated.
template <typename T, size_t n>
std::string TextOf(const T& from, const NumberKey<T> (&rows)[n]) {
  std::string text;
  for (const NumberKey<T>& row : rows) {
    const double value = from.*row.number;
    if (!std::isfinite(value) || (row.positive && !(value > 0.0))) continue;
    text += fmt::format(", {}: {}", row.key, value);
  }
  return text;
}

std::string Braced(const char* key, const std::string& numbers) {
  return fmt::format(", {}: {{{}}}", key, numbers.empty() ? "" : numbers.substr(2));
}

std::string CurveText(const std::vector<CurvePoint>& curve) {
  std::string text;
  for (const CurvePoint& point : curve) {
    text += fmt::format("{}[{}, {}]", text.empty() ? "" : ", ", point.speed, point.torque);
  }
  return "[" + text + "]";
}

}  // namespace
}  // namespace mbv::internal

namespace mbv {

std::string MotorText(const Motor& motor) {
  using namespace internal;
  Motor written = motor;
  std::string text = motor.turns ? "kind: rotary" : "kind: linear";
  // What a gearbox bears is before the spindle; otherwise the whole ratio is enough.
  if (motor.gearbox && motor.spindle != 1.0) {
    written.gear_ratio /= motor.spindle;
    text += fmt::format(", lead: {}", 2.0 * std::numbers::pi / motor.spindle);
  }
  text += TextOf(written, kMotorNumbers);
  const auto side = [](double x) { return std::isfinite(x) ? fmt::format("{}", x) : "null"; };
  if (HasSides(motor)) {
    text += fmt::format(", peak_range: [{}, {}]", side(motor.least), side(motor.most));
  }
  for (const auto& [key, curve] : {std::pair{"continuous_curve", &motor.continuous_curve},
                                   std::pair{"peak_curve", &motor.peak_curve}}) {
    if (!curve->empty()) text += fmt::format(", {}: {}", key, CurveText(*curve));
  }
  if (motor.thermal) text += Braced("thermal", TextOf(*motor.thermal, kThermalNumbers));
  if (motor.gearbox) text += Braced("gearbox", TextOf(*motor.gearbox, kGearboxNumbers));
  if (motor.brake) text += Braced("brake", TextOf(*motor.brake, kBrakeNumbers));
  return text;
}

}  // namespace mbv

namespace mbv::internal {

std::string DcLinkText(const DcLink& link) { return TextOf(link, kLinkNumbers).substr(2); }

void ReadMotors(const Block& model, const std::vector<Drive>& drives,
                const std::vector<Joint>& joints, ModelValues* values, std::vector<Motor>* motors) {
  YamlReader& yaml = values->yaml();
  const std::vector<std::string> names = NamesOf(drives);
  for (const YamlEntry& entry : model.Entries("motors", &yaml)) {
    const auto found = std::find(names.begin(), names.end(), entry.key);
    if (found == names.end()) {
      yaml.Error(entry, fmt::format("motors: there is no drive '{}'", entry.key),
                 DidYouMean(entry.key, names));
      continue;
    }
    const auto drive = static_cast<size_t>(found - names.begin());
    const YamlMap map(&yaml, entry.value.get(), JoinPath("motors", entry.key),
                      MotorKeys({"lead", "lead_mm", "gearbox"}));
    if (!map.valid()) continue;
    auto motor = MotorReader(model, map, Turns(drives[drive], joints), values).Read();
    if (!motor) continue;
    motor->drive = static_cast<int>(drive);
    motors->push_back(std::move(*motor));
  }
}

std::optional<DcLink> ReadDcLink(const Block& model, ModelValues* values) {
  const YamlNode* node = model.Section("dc_link");
  if (node == nullptr) return {};
  const YamlMap map(&values->yaml(), node, "dc_link", KeysOf(kLinkNumbers));
  if (!map.valid()) return {};
  DcLink link;
  NumberReader reader(model, values);
  reader.Read(map, kLinkNumbers, true, &link);
  reader.AtMostOne(map, link.efficiency);
  reader.Needs(map, "voltage", std::isnan(link.voltage), {"capacitance"});
  reader.Needs(map, "brake_voltage", std::isnan(link.brake_voltage), {"capacitance", "resistance"});
  if (link.brake_voltage <= link.voltage) {
    reader.Fail(*map.Find("brake_voltage"),
                fmt::format("dc_link.brake_voltage = {:g} violates brake_voltage > voltage = {:g}",
                            link.brake_voltage, link.voltage));
  }
  return reader.failed() ? std::nullopt : std::optional(link);
}

}  // namespace mbv::internal

namespace mbv {
namespace {

using internal::KeysOf;

class CatalogueReader {
 public:
  explicit CatalogueReader(const std::string& file) : yaml_(file), literals_(none_) {}

  std::optional<Catalogue> Read(Diagnostics* diagnostics) {
    const auto text = yaml_.ReadFile();
    const YamlNodePtr root = text ? yaml_.Parse(*text) : nullptr;
    if (root != nullptr) ReadAll(root.get());
    diagnostics->Append(yaml_.diagnostics());
    if (root == nullptr || yaml_.has_errors()) return {};
    return std::move(catalogue_);
  }

 private:
  void ReadAll(const YamlNode* root) {
    const YamlMap map(&yaml_, root, "", {"catalogue", "source", "motors", "gearboxes"});
    if (!map.valid()) return;
    for (const char* key : {"catalogue", "source"}) {
      const YamlNode* node = *key == 'c' ? map.Required(key) : map.Find(key);
      const auto text = node == nullptr ? std::nullopt : yaml_.Text(*node, key);
      if (text && *key == 'c') catalogue_.name = *text;
    }
    const internal::ModelBlocks blocks(root);
    internal::ModelValues values(&yaml_, &literals_);
    const internal::Block& scope = blocks.model();
    for (const YamlEntry& entry : scope.Entries("gearboxes", &yaml_)) {
      ReadGearbox(scope, entry, &values);
    }
    for (const YamlEntry& entry : scope.Entries("motors", &yaml_)) {
      ReadMotor(scope, entry, &values);
    }
    if (catalogue_.motors.empty() && !yaml_.has_errors()) {
      yaml_.Error(*root, "motors: the catalogue has none");
    }
  }

  void ReadGearbox(const internal::Block& scope, const YamlEntry& entry,
                   internal::ModelValues* values) {
    const YamlMap map(&yaml_, entry.value.get(), JoinPath("gearboxes", entry.key),
                      KeysOf(internal::kStageNumbers, KeysOf(internal::kGearboxNumbers)));
    if (!map.valid()) return;
    CatalogueGearbox gearbox{.name = entry.key};
    internal::NumberReader reader(scope, values);
    reader.Read(map, internal::kStageNumbers, true, &gearbox);
    reader.Read(map, internal::kGearboxNumbers, true, &gearbox.limits);
    reader.AtMostOne(map, gearbox.efficiency);
    reader.CheckGearbox(map, gearbox.limits);
    if (entry.key == "none") reader.Fail(*entry.value, "gearboxes.none stands for no gearbox");
    catalogue_.gearboxes.push_back(std::move(gearbox));
  }

  // In a catalogue a motor slides only where it says so.
  void ReadMotor(const internal::Block& scope, const YamlEntry& entry,
                 internal::ModelValues* values) {
    const YamlMap map(&yaml_, entry.value.get(), JoinPath("motors", entry.key),
                      internal::MotorKeys(KeysOf(internal::kOwnNumbers, {"gearboxes"})));
    if (!map.valid()) return;
    CatalogueMotor motor{.name = entry.key};
    internal::MotorReader reader(scope, map, true, values);
    if (auto read = reader.Read()) motor.motor = *std::move(read);
    internal::NumberReader(scope, values).Read(map, internal::kOwnNumbers, true, &motor);
    for (const char* key : {"gear_ratio", "efficiency"}) {
      if (const YamlNode* node = map.Find(key)) {
        yaml_.Error(*node, map.PathOf(key) + ": a motor of a catalogue has no gear",
                    "state it under gearboxes");
      }
    }
    ReadFitting(map, &motor);
    catalogue_.motors.push_back(std::move(motor));
  }

  // The gearboxes that fit: all, and none, unless they are listed.
  void ReadFitting(const YamlMap& map, CatalogueMotor* motor) {
    std::vector<std::string> names = {"none"};
    for (const CatalogueGearbox& gearbox : catalogue_.gearboxes) names.push_back(gearbox.name);
    const YamlNode* node = map.Find("gearboxes");
    if (node == nullptr) {
      for (size_t k = 0; k < names.size(); ++k) motor->gearboxes.push_back(static_cast<int>(k) - 1);
      return;
    }
    const auto items = yaml_.Items(*node, map.PathOf("gearboxes"));
    if (!items) return;
    for (const YamlNode* item : *items) {
      const auto at = yaml_.Choice(*item, map.PathOf("gearboxes"), names);
      if (at) motor->gearboxes.push_back(*at - 1);
    }
  }

  YamlReader yaml_;
  const std::map<std::string, double> none_;
  internal::Literals literals_;
  Catalogue catalogue_;
};

}  // namespace

std::optional<Catalogue> LoadCatalogue(const std::string& file, Diagnostics* diagnostics) {
  return CatalogueReader(file).Read(diagnostics);
}

Diagnostics CheckCatalogue(const std::string& file) {
  Diagnostics diagnostics;
  (void)LoadCatalogue(file, &diagnostics);
  return diagnostics;
}

Motor InPlaceOf(const Motor& model, const CatalogueMotor& choice, const CatalogueGearbox* gearbox) {
  Motor motor = choice.motor;
  motor.drive = model.drive;
  motor.spindle = motor.gear_ratio = model.spindle;
  if (motor.thermal && model.thermal) motor.thermal->ambient_C = model.thermal->ambient_C;
  if (gearbox == nullptr) return motor;
  motor.gear_ratio *= gearbox->ratio;
  motor.efficiency = gearbox->efficiency;
  motor.rotor_inertia += gearbox->inertia;
  motor.gearbox = gearbox->limits;
  return motor;
}

}  // namespace mbv
