#include "table/pose_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/channel.h"
#include "core/spatial.h"
#include "core/word_hints.h"
#include "table/grid.h"
#include "table/noise.h"
#include "table/settings.h"
#include "table/table_spline.h"

namespace mbv {
namespace {

constexpr size_t kFewestPoses = 6;    // that determine a quintic polynomial
constexpr double kUnitLength = 1e-2;  // how far a quaternion or an axis may be from length 1
const double kSteepest = 89.0 * std::numbers::pi / 180.0;  // pitch; at 90° roll and yaw are one

// How a file gives orientations: its columns and their unit, and the rotation of a row.
struct Convention {
  const char* word;
  std::vector<const char*> columns;
  const char* unit;
  /// Empty where the numbers are no rotation.
  std::optional<Mat3> (*rotation)(const VecX& numbers);
};

bool IsUnit(double length) { return std::abs(length - 1.0) <= kUnitLength; }

std::optional<Mat3> FromRpy(const VecX& n) { return RotRpy(Vec3(n[0], n[1], n[2])); }
std::optional<Mat3> FromQuaternion(const VecX& n) {
  const Eigen::Quaterniond q(n[0], n[1], n[2], n[3]);
  if (!IsUnit(q.norm())) return {};
  return q.normalized().toRotationMatrix();
}
std::optional<Mat3> FromRotationVector(const VecX& n) {
  const Vec3 v(n[0], n[1], n[2]);
  const double angle = v.norm();
  if (angle == 0.0) return Mat3(Mat3::Identity());
  return Eigen::AngleAxisd(angle, v / angle).toRotationMatrix();
}
std::optional<Mat3> FromAxisAngle(const VecX& n) {
  const Vec3 axis(n[0], n[1], n[2]);
  if (!IsUnit(axis.norm())) return {};
  return Eigen::AngleAxisd(n[3], axis.normalized()).toRotationMatrix();
}

const std::array<Convention, 4>& Conventions() {
  static const std::array<Convention, 4> all = {
      Convention{"rpy", {"roll", "pitch", "yaw"}, "rad", FromRpy},
      Convention{"quaternion", {"qw", "qx", "qy", "qz"}, "1", FromQuaternion},
      Convention{"rotation_vector", {"rx", "ry", "rz"}, "rad", FromRotationVector},
      Convention{"axis_angle", {"ax", "ay", "az", "angle"}, "1", FromAxisAngle}};
  return all;
}

// Without jumps of whole turns.
void Unwrap(std::vector<double>* angles) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  for (size_t i = 1; i < angles->size(); ++i) {
    double& angle = (*angles)[i];
    angle -= kTurn * std::round((angle - (*angles)[i - 1]) / kTurn);
  }
}

class PoseLoader {
 public:
  PoseLoader(ValueReader* values, const YamlNode& node, const Mechanism& mechanism)
      : values_(*values), node_(node), mechanism_(mechanism) {}

  PoseTable Load(Diagnostics* files) {
    const size_t found = yaml().diagnostics().findings().size();
    Read();
    if (settings_.file.empty() || yaml().diagnostics().findings().size() > found) return {};
    source_ = LoadTable(settings_, mechanism_, &yaml(), files);
    if (source_ == nullptr || !CheckRows() || !TurnRows() || !Finish()) return {};
    return std::move(pose_);
  }

 private:
  YamlReader& yaml() { return values_.yaml(); }

  void Read() {
    settings_.path = "motion.pose_table";
    std::vector<std::string> keys = {"output", "angles",    "columns", "time",
                                     "use",    "smoothing", "periodic"};
    keys.insert(keys.end(), kTableSourceKeys.begin(), kTableSourceKeys.end());
    const YamlMap map(&yaml(), &node_, settings_.path, keys);
    if (!map.valid()) return;
    ReadTableSource(&values_, map, &settings_);
    if (const YamlNode* output = map.Required("output")) ReadOutput(*output, map.PathOf("output"));
    if (const YamlNode* angles = map.Find("angles")) {
      const auto choice = yaml().Choice(*angles, map.PathOf("angles"),
                                        {"rpy", "quaternion", "rotation_vector", "axis_angle"});
      convention_ = &Conventions()[static_cast<size_t>(choice.value_or(0))];
    }
    ReadColumns(map);
    if (const YamlNode* use = map.Find("use")) ReadUse(*use, map.PathOf("use"));
    if (const YamlNode* smoothing = map.Find("smoothing")) {
      const auto choice = yaml().Choice(*smoothing, map.PathOf("smoothing"), {"none", "auto"});
      if (choice == 1) smoothing_ = "auto";
    }
    if (const YamlNode* periodic = map.Find("periodic")) {
      periodic_ = yaml().Flag(*periodic, map.PathOf("periodic")).value_or(false);
    }
  }

  void ReadOutput(const YamlNode& node, const std::string& path) {
    const std::string name = yaml().Text(node, path).value_or("");
    pose_.output = mechanism_.FindOutput(name);
    if (pose_.output >= 0) return;
    std::vector<std::string> names;
    names.reserve(mechanism_.outputs.size());
    for (const Output& output : mechanism_.outputs) names.push_back(output.name);
    yaml().Error(node, fmt::format("{}: {} has no output '{}'", path, mechanism_.name, name),
                 DidYouMean(name, names));
  }

  // Three lengths, the orientation's columns, and the time where it is stated.
  void ReadColumns(const YamlMap& map) {
    std::vector<std::string> names = {"x", "y", "z"};
    names.insert(names.end(), convention_->columns.begin(), convention_->columns.end());
    const YamlMap columns(&yaml(), map.Find("columns"), map.PathOf("columns"), names);
    for (const std::string& name : names) {
      Channel channel;
      channel.name = name;
      channel.unit = name.size() == 1 ? "m" : name == "angle" ? "rad" : convention_->unit;
      settings_.signals.push_back(std::move(channel));
      AddColumn(name, columns.Find(name), columns.PathOf(name));
    }
    if (const YamlNode* time = map.Find("time")) AddColumn("time", time, map.PathOf("time"));
  }

  void AddColumn(const std::string& name, const YamlNode* given, const std::string& path) {
    TableColumnSettings column;
    const YamlNode& place = given != nullptr ? *given : node_;
    column.place = {name, place.line, place.column, nullptr};
    column.path = path;
    column.signal = name;
    if (given != nullptr) ReadTableColumn(&values_, *given, &column);
    settings_.columns.push_back(std::move(column));
  }

  // Components that are commanded; all where it is left out.
  void ReadUse(const YamlNode& node, const std::string& path) {
    const auto items = yaml().Items(node, path);
    if (!items) return;
    const std::vector<std::string> words(kPoseComponents.begin(), kPoseComponents.end());
    use_.clear();
    for (const YamlNode* item : *items) {
      if (const auto word = yaml().Choice(*item, path, words)) use_.push_back(*word);
    }
  }

  bool CheckRows() {
    if (source_->time_s.size() >= kFewestPoses) return true;
    yaml().Error(settings_.place,
                 fmt::format("{}: {} has {} rows, a motion needs {} at least", settings_.path,
                             settings_.csv, source_->time_s.size(), kFewestPoses));
    return false;
  }

  // Every row's orientation as roll, pitch and yaw.
  bool TurnRows() {
    const auto n = source_->values.rows();
    for (auto& component : rows_) component.resize(static_cast<size_t>(n));
    for (Eigen::Index i = 0; i < n; ++i) {
      const VecX row = source_->values.row(i).transpose();
      const auto R = convention_->rotation(row.tail(row.size() - 3));
      const Vec3 rpy = R ? RpyOf(*R) : Vec3::Zero();
      if (!R || std::abs(rpy.y()) > kSteepest) return RefuseRow(i, R.has_value());
      for (Eigen::Index c = 0; c < 3; ++c) {
        rows_[static_cast<size_t>(c)][static_cast<size_t>(i)] = row[c];
        rows_[static_cast<size_t>(c) + 3][static_cast<size_t>(i)] = rpy[c];
      }
    }
    for (size_t c = 3; c < 6; ++c) Unwrap(&rows_[c]);
    return true;
  }

  bool RefuseRow(Eigen::Index row, bool is_rotation) {
    const std::string where = fmt::format("{}: {} at t = {:g} s", settings_.path, settings_.csv,
                                          source_->time_s[static_cast<size_t>(row)]);
    if (is_rotation) {
      yaml().Error(settings_.place,
                   where + " pitches beyond 89°, where roll and yaw are not told apart",
                   "turn the output's frame");
    } else {
      yaml().Error(settings_.place, where + " is no rotation: its length violates 0.99 … 1.01",
                   "are these the right columns?");
    }
    return false;
  }

  bool Finish() {
    const auto n = static_cast<Eigen::Index>(rows_[0].size());
    for (const int c : use_) {
      SplineRows rows;
      rows.time_s = TrueTimes(*source_);
      rows.values = rows_[static_cast<size_t>(c)];
      const MatX column = Eigen::Map<const VecX>(rows.values.data(), n);
      const double step = c < 3 ? source_->steps.col(c).maxCoeff() : 0.0;
      rows.deviation = std::max(EstimateNoise(rows.time_s, column)[0], step / std::sqrt(12.0));
      pose_.components.push_back({c, Described(c, rows)});
      const RowsPlace place{&yaml(), settings_.place, settings_.path, settings_.csv, step};
      if (!MakeSplines(place, rows, &pose_.components.back().table)) return false;
    }
    return true;
  }

  [[nodiscard]] MotionTable Described(int c, const SplineRows& rows) const {
    MotionTable table;
    const Output& output = mechanism_.outputs[static_cast<size_t>(pose_.output)];
    const auto k = static_cast<size_t>(c);
    table.name = output.name + "." + kPoseComponents[k];
    table.file = source_->name;
    table.column = c < 3 ? source_->columns[k].heading : convention_->word;
    table.unit = c < 3 ? "m" : "rad";
    table.rows = rows.time_s.size();
    table.from_s = rows.time_s.front();
    table.to_s = rows.time_s.back();
    table.stamp_error_s = source_->stamp_error_s;
    table.periodic = periodic_;
    table.moves = true;
    table.smoothing = smoothing_;
    table.deviation = rows.deviation;
    if (pose_.components.empty()) table.notes = source_->notes;
    return table;
  }

  ValueReader& values_;
  const YamlNode& node_;
  const Mechanism& mechanism_;
  TableSettings settings_;
  const Convention* convention_ = Conventions().data();
  std::vector<int> use_ = {0, 1, 2, 3, 4, 5};
  std::string smoothing_ = "none";
  bool periodic_ = false;
  std::shared_ptr<const ReferenceTable> source_;
  std::array<std::vector<double>, 6> rows_;
  PoseTable pose_;
};

}  // namespace

PoseTable LoadPoseTable(ValueReader* values, const YamlNode& node, const Mechanism& mechanism,
                        Diagnostics* files) {
  return PoseLoader(values, node, mechanism).Load(files);
}

}  // namespace mbv
