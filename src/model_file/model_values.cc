#include "model_file/model_values.h"

#include <fmt/format.h>
#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>

#include "math/spatial.h"

namespace mbv::internal {
namespace {

bool SameBits(double a, double b) {  // zeros with their signs
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace

void ItemMemory::Begin(const std::vector<Parameter>& parameters, const std::vector<Body>& bodies) {
  bodies_ = &bodies;
  next_ = 0;
  reading_ = false;
  bool same = parameters.size() == values_.size();
  changed_.assign(parameters.size(), false);
  for (size_t k = 0; k < parameters.size() && same; ++k) {
    const auto at = places_.find(parameters[k].name);
    same = at != places_.end() && at->second == k;
    changed_[k] = same && !SameBits(parameters[k].value, values_[k]);
  }
  if (!same) items_.clear(), places_.clear();
  values_.clear();
  for (const Parameter& parameter : parameters) {
    if (!same) places_.emplace(parameter.name, values_.size());
    values_.push_back(parameter.value);
  }
}

bool ItemMemory::Next(const Block& block, const YamlNode& node) {
  if (reading_ || !block.written) return false;
  if (next_ == items_.size()) items_.emplace_back();
  Item& item = items_[next_++];
  if (item.node == &node && item.prefix == block.prefix) return true;
  item = {.node = &node, .prefix = block.prefix};
  return true;
}

const std::any* ItemMemory::Known(Literals* literals) const {
  const Item& item = items_[next_ - 1];
  if (!item.made.has_value()) return nullptr;
  for (const size_t parameter : item.parameters) {
    if (changed_[parameter]) return nullptr;
  }
  for (const FrameUse& use : item.frames) {
    const auto& frames = (*bodies_)[static_cast<size_t>(use.body)].frames;
    if (use.frame >= frames.size()) return nullptr;
    const Pose& now = frames[use.frame].X_BF;
    if (!std::equal(now.data(), now.data() + 16, use.X_BF.data(), SameBits)) return nullptr;
  }
  for (const Literal& literal : item.literals) (void)literals->At(literal.place, literal.value);
  return &item.made;
}

void ItemMemory::Record() {
  Item& item = items_[next_ - 1];
  item = {.node = item.node, .prefix = item.prefix};
  reading_ = keeps_ = true;
}

// Whatever looks like a name: those that are none name no parameter.
void ItemMemory::AddParametersOf(const std::string& expression,
                                 const std::vector<std::string>& levels) {
  if (!reading_) return;
  const auto is_part = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
  };
  std::vector<size_t>& uses = items_[next_ - 1].parameters;
  for (auto from = expression.begin(); from != expression.end();) {
    const auto end = std::find_if_not(from, expression.end(), is_part);
    for (const std::string& level : levels) {
      if (from == end) break;
      const auto at = places_.find(level + std::string(from, end));
      if (at == places_.end()) continue;
      if (std::ranges::find(uses, at->second) == uses.end()) uses.push_back(at->second);
      break;
    }
    from = std::find_if(end, expression.end(), is_part);
  }
}

void ItemMemory::AddFrame(int body, const NamedFrame& frame) {
  if (!reading_) return;
  const auto& frames = (*bodies_)[static_cast<size_t>(body)].frames;
  items_[next_ - 1].frames.push_back(
      {body, static_cast<size_t>(&frame - frames.data()), frame.X_BF});
}

void ItemMemory::AddLiteral(Literal literal) {
  if (reading_) items_[next_ - 1].literals.push_back(std::move(literal));
}

void ItemMemory::Keep(std::any made) {
  reading_ = false;
  if (keeps_) items_[next_ - 1].made = std::move(made);
}

double Literals::At(const std::string& place, double value) {
  // An instance's literal is read once, its part's as often as there are instances.
  if (places_.insert(place).second) literals_.push_back({place, value});
  const auto other = replaced_.find(place);
  return other == replaced_.end() ? value : other->second;
}

template <typename PathOf>
std::optional<double> ModelValues::NumberAt(const Block& block, const YamlNode& node,
                                            const PathOf& path, const UnitSuffix& unit) {
  if (!node.is_scalar()) {
    yaml_.Error(
        node, fmt::format("{} is {}, a number or an expression is needed", path(), Describe(node)));
    return std::nullopt;
  }
  const ExpressionResult result = block.scope->Evaluate(node.text);
  if (result.value) {
    const double value = unit.to_si(*result.value);
    if (!IsWrittenOut(node.text)) {
      if (memory_ != nullptr) memory_->AddParametersOf(node.text, block.levels);
      return value;
    }
    const std::string place = path();
    if (memory_ != nullptr) memory_->AddLiteral({place, value});
    return literals_.At(place, value);
  }
  // An empty text: a parameter failed whose own place already carries the finding.
  if (!result.error.empty()) {
    yaml_.Error(node, fmt::format("{} = {} {}", path(), Describe(node), result.error), result.hint);
  }
  return std::nullopt;
}

std::optional<double> ModelValues::Number(const Block& block, const YamlNode& node,
                                          const std::string& path, const UnitSuffix& unit) {
  return NumberAt(
      block, node, [&] { return path; }, unit);
}

std::optional<Vec3> ModelValues::Vector(const Block& block, const YamlNode& node,
                                        const std::string& path, const UnitSuffix& unit) {
  const auto items = yaml_.Items(node, path, 3);
  if (!items) return std::nullopt;
  Vec3 vector;
  bool good = true;
  for (int k = 0; k < 3; ++k) {
    const auto value = NumberAt(
        block, *(*items)[k], [&] { return fmt::format("{}[{}]", path, k); }, unit);
    good = good && value.has_value();
    vector[k] = value.value_or(kNan);
  }
  return good ? std::optional<Vec3>(vector) : std::nullopt;
}

std::optional<double> ModelValues::Number(const Block& block, const YamlMap& map,
                                          const std::string& key,
                                          std::initializer_list<UnitSuffix> units) {
  const YamlMap::InUnit found = map.FindInUnit(key, units);
  if (found.node == nullptr) return std::nullopt;
  return NumberAt(
      block, *found.node, [&] { return map.PathOf(found.key); }, found.unit);
}

std::optional<Vec3> ModelValues::Vector(const Block& block, const YamlMap& map,
                                        const std::string& key,
                                        std::initializer_list<UnitSuffix> units) {
  const YamlMap::InUnit found = map.FindInUnit(key, units);
  if (found.node == nullptr) return std::nullopt;
  return Vector(block, *found.node, map.PathOf(found.key), found.unit);
}

std::optional<double> ModelValues::Positive(const Block& block, const YamlMap& map,
                                            const std::string& key,
                                            std::initializer_list<UnitSuffix> units) {
  const YamlMap::InUnit found = map.FindInUnit(key, units);
  if (found.node == nullptr) {
    (void)map.Required(key);
    return std::nullopt;
  }
  const auto value = NumberAt(
      block, *found.node, [&] { return map.PathOf(found.key); }, found.unit);
  if (!value || *value > 0.0) return value;
  yaml_.Error(*found.node,
              fmt::format("{} = {} violates {} > 0", map.PathOf(found.key), *value, key));
  return std::nullopt;
}

std::optional<double> ModelValues::Radius(const Block& block, const YamlMap& map) {
  if (map.FindInUnit("radius", {kPlain, kMm}).node == nullptr) {
    (void)map.Required("radius");
    return std::nullopt;
  }
  const auto radius = Number(block, map, "radius", {kPlain, kMm});
  if (!radius || *radius > 0.0) return radius;
  yaml_.Error(*map.node(),
              fmt::format("{} = {} violates radius > 0", map.PathOf("radius"), *radius));
  return std::nullopt;
}

std::optional<Vec3> ModelValues::Axis(const Block& block, const YamlNode& node,
                                      const std::string& path) {
  if (node.is_sequence()) {
    const auto vector = Vector(block, node, path);
    if (!vector) return std::nullopt;
    const double length = vector->stableNorm();
    // A unit vector stays as it is written, to the last bit.
    if (std::abs(length - 1.0) < 4 * kEps) return *vector;
    if (length > 1e-9 && std::isfinite(length)) return *vector / length;
    yaml_.Error(node, fmt::format("{} has the length {}, an axis needs a direction", path, length));
    return std::nullopt;
  }
  static const std::vector<std::string> names = {"x", "y", "z", "-x", "-y", "-z"};
  const auto name = yaml_.Choice(node, path, names);
  if (!name) return std::nullopt;
  Vec3 axis = Vec3::Zero();
  axis[*name % 3] = *name < 3 ? 1.0 : -1.0;
  return axis;
}

std::optional<Mat3> ModelValues::RotationFromAxes(const Block& block, const YamlNode& node,
                                                  const std::string& path) {
  const YamlMap map(&yaml_, &node, path, {"x", "y", "z"});
  if (!map.valid()) return std::nullopt;
  if (node.entries.size() != 2) {
    yaml_.Error(node, fmt::format("{} gives {} axes, two are needed", path, node.entries.size()),
                "the first is kept, the second made perpendicular, the third follows");
    return std::nullopt;
  }
  int index[2];
  Vec3 axis[2];
  for (int k = 0; k < 2; ++k) {
    const YamlEntry& entry = node.entries[k];
    index[k] = entry.key.empty() ? 3 : entry.key[0] - 'x';
    const auto value = Axis(block, *entry.value, map.PathOf(entry.key));
    if (!value || index[k] < 0 || index[k] > 2) return std::nullopt;
    axis[k] = *value;
  }
  const Vec3 second = axis[1] - axis[0] * axis[0].dot(axis[1]);
  if (second.norm() < 1e-9) {
    yaml_.Error(node, fmt::format("{}: its two axes are parallel", path));
    return std::nullopt;
  }
  Mat3 R;
  R.col(index[0]) = axis[0];
  R.col(index[1]) = second.normalized();
  const int third = 3 - index[0] - index[1];
  R.col(third) = R.col((third + 1) % 3).cross(R.col((third + 2) % 3));
  return R;
}

// Rows of a rotation matrix, taken as they are.
std::optional<Mat3> ModelValues::RotationMatrix(const Block& block, const YamlNode& node,
                                                const std::string& path) {
  constexpr double kTolerance = 1e-9;
  const auto rows = yaml_.Items(node, path, 3);
  if (!rows) return std::nullopt;
  Mat3 R;
  for (int i = 0; i < 3; ++i) {
    const auto row = Vector(block, *(*rows)[i], fmt::format("{}[{}]", path, i));
    if (!row) return std::nullopt;
    R.row(i) = row->transpose();
  }
  if ((R * R.transpose()).isIdentity(kTolerance) && R.determinant() > 0.0) return R;
  yaml_.Error(node,
              fmt::format("{} is not a rotation: its rows are not a right-handed set of "
                          "perpendicular unit vectors",
                          path),
              "give its numbers with ten digits, or use rpy, axes or axis with angle");
  return std::nullopt;
}

std::optional<Mat3> ModelValues::Rotation(const Block& block, const YamlNode& node,
                                          const std::string& path) {
  const YamlMap map(&yaml_, &node, path,
                    {"rpy", "rpy_deg", "axes", "axis", "angle", "angle_deg", "matrix"});
  if (!map.valid()) return std::nullopt;
  const bool by_rpy = map.Has("rpy") || map.Has("rpy_deg");
  const bool by_axis = map.Has("axis") || map.Has("angle") || map.Has("angle_deg");
  if (int{by_rpy} + int{by_axis} + int{map.Has("axes")} + int{map.Has("matrix")} != 1) {
    yaml_.Error(
        node, fmt::format("{} is given in {} ways", path, node.entries.empty() ? "no" : "several"),
        "give one of: rpy, axes, axis with angle, matrix");
    return std::nullopt;
  }
  if (const YamlNode* matrix = map.Find("matrix")) {
    return RotationMatrix(block, *matrix, map.PathOf("matrix"));
  }
  if (by_rpy) {
    const auto rpy = Vector(block, map, "rpy", {kPlain, kDeg});
    return rpy ? std::optional<Mat3>(RotRpy(*rpy)) : std::nullopt;
  }
  if (!by_axis) return RotationFromAxes(block, *map.Find("axes"), map.PathOf("axes"));
  const YamlNode* axis_node = map.Required("axis");
  const auto axis =
      axis_node == nullptr ? std::nullopt : Axis(block, *axis_node, map.PathOf("axis"));
  if (map.FindInUnit("angle", {kPlain, kDeg}).node == nullptr) (void)map.Required("angle");
  const auto angle = Number(block, map, "angle", {kPlain, kDeg});
  if (!axis || !angle) return std::nullopt;
  return Eigen::AngleAxisd(*angle, *axis).toRotationMatrix();
}

std::optional<Pose> ModelValues::PoseOf(const Block& block, const YamlNode& node,
                                        const std::string& path) {
  Pose pose = Pose::Identity();
  if (node.is_null()) return pose;
  if (node.is_sequence()) {  // short form: the position alone
    const auto position = Vector(block, node, path);
    if (!position) return std::nullopt;
    pose.translation() = *position;
    return pose;
  }
  const YamlMap map(&yaml_, &node, path, {"position", "position_mm", "rotation"});
  if (!map.valid()) return std::nullopt;
  bool good = true;
  if (map.Has("position") || map.Has("position_mm")) {
    const auto position = Vector(block, map, "position", {kPlain, kMm});
    good = position.has_value();
    if (position) pose.translation() = *position;
  }
  if (const YamlNode* rotation = map.Find("rotation")) {
    const auto R = Rotation(block, *rotation, map.PathOf("rotation"));
    good = good && R.has_value();
    if (R) pose.linear() = *R;
  }
  return good ? std::optional<Pose>(pose) : std::nullopt;
}

std::optional<std::vector<std::pair<double, double>>> ModelValues::Pairs(const Block& block,
                                                                         const YamlNode& node,
                                                                         const std::string& path,
                                                                         const UnitSuffix& unit) {
  const auto items = yaml_.Items(node, path);
  if (!items) return std::nullopt;
  std::vector<std::pair<double, double>> pairs;
  for (size_t i = 0; i < items->size(); ++i) {
    const std::string at = fmt::format("{}[{}]", path, i);
    const auto two = yaml_.Items(*(*items)[i], at, 2);
    if (!two) return std::nullopt;
    const auto a = Number(block, *(*two)[0], at + "[0]", unit);
    const auto b = Number(block, *(*two)[1], at + "[1]");
    if (!a || !b) return std::nullopt;
    pairs.emplace_back(*a, *b);
  }
  return pairs;
}

std::optional<std::vector<std::pair<double, double>>> ModelValues::Points(const Block& block,
                                                                          const YamlNode& node,
                                                                          const std::string& path,
                                                                          const UnitSuffix& unit) {
  auto points = Pairs(block, node, path, unit);
  if (!points) return std::nullopt;
  for (size_t i = 1; i < points->size(); ++i) {
    if ((*points)[i].first > (*points)[i - 1].first) continue;
    yaml_.Error(*node.items[i], fmt::format("{}[{}]: the first numbers must increase", path, i));
    return std::nullopt;
  }
  if (points->size() >= 2) return points;
  yaml_.Error(node, path + " has fewer than two points");
  return std::nullopt;
}

std::optional<CoordinateRange> ModelValues::Range(const Block& block, const YamlNode& node,
                                                  const std::string& path, const UnitSuffix& unit) {
  CoordinateRange range;
  if (node.is_null()) return range;
  const auto items = yaml_.Items(node, path, 2);
  if (!items) return std::nullopt;
  bool good = true;
  for (int k = 0; k < 2; ++k) {
    const YamlNode& item = *(*items)[k];
    if (item.is_null()) continue;  // no limit on this side
    const auto value = NumberAt(
        block, item, [&] { return fmt::format("{}[{}]", path, k); }, unit);
    good = good && value.has_value();
    if (value) (k == 0 ? range.lower : range.upper) = *value;
  }
  if (!good) return std::nullopt;
  if (range.lower < range.upper) return range;
  yaml_.Error(node, fmt::format("{} = [{}, {}] violates lower < upper", path, (*items)[0]->text,
                                (*items)[1]->text));
  return std::nullopt;
}

void SignalPlaces::Check(YamlReader* yaml) const {
  for (const auto& [name, uses] : places_) {
    for (size_t i = 1; i < uses.size(); ++i) {
      yaml->AddAt(Severity::kError, uses[i].place.line, uses[i].place.column,
                  fmt::format("the {} '{}' has the name of the {} in line {}", uses[i].what, name,
                              uses[0].what, uses[0].place.line));
    }
  }
}

void CheckDrivenOnce(const std::vector<Drive>& drives, const std::vector<Prescribed>& prescribed,
                     const std::vector<Joint>& joints, const SignalPlaces& places,
                     YamlReader* yaml) {
  std::map<int, std::string> driven;
  const auto check = [&](int joint, int coordinate, const std::string& name) {
    const auto [it, fresh] = driven.emplace(joint * 6 + coordinate, name);
    if (fresh) return;
    const Place at = places.Of(name);
    yaml->AddAt(Severity::kError, at.line, at.column,
                fmt::format("'{}' moves the same coordinate of joint '{}' as '{}'", name,
                            joints[joint].name, it->second));
  };
  for (const Drive& drive : drives) {
    const auto* on_joint = std::get_if<JointDrive>(&drive.kind);
    if (on_joint != nullptr) check(on_joint->joint, on_joint->coordinate, drive.name);
  }
  for (const Prescribed& one : prescribed) check(one.joint, 0, one.name);
}

}  // namespace mbv::internal
