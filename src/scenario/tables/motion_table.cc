#include "scenario/tables/motion_table.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "math/channel.h"
#include "math/spatial.h"
#include "scenario/tables/grid.h"
#include "scenario/tables/table.h"
#include "scenario/tables/table_spline.h"

namespace mbv {
namespace {

constexpr size_t kFewestSplineRows = 6;  // that determine a quintic polynomial
// A column of rates further from the positions' own, of their RMS, belongs to something else.
constexpr double kRateUncertainty = 0.2;
// A table that lasts more than so many motions may be in milliseconds.
constexpr double kMilli = 300.0;

class Loader {
 public:
  Loader(ValueReader* values, const YamlNode& node, const std::string& path,
         const MotionTableUse& use)
      : values_(*values), node_(node), path_(path), use_(use) {}

  std::optional<MotionTable> Load(const Mechanism& mechanism, Diagnostics* files) {
    const size_t found = yaml().diagnostics().findings().size();
    Read();
    if (settings_.file.empty() || yaml().diagnostics().findings().size() > found) return {};
    source_ = LoadTable(settings_, mechanism, &yaml(), files);
    if (source_ == nullptr || !TakeRows()) return {};
    Describe();
    const RowsPlace place{&yaml(), settings_.place, path_, settings_.csv,
                          source_->steps.col(0).maxCoeff()};
    if (!MakeSplines(place, rows_, &table_)) return {};
    if (table_.with_rates) WarnRates();
    return std::move(table_);
  }

 private:
  YamlReader& yaml() { return values_.yaml(); }

  void Read() {
    std::vector<std::string> keys = {"column", "unit", "sign",      "scale",
                                     "offset", "time", "smoothing", "periodic"};
    if (use_.moves) keys.emplace_back("rate");
    keys.insert(keys.end(), kTableSourceKeys.begin(), kTableSourceKeys.end());
    const YamlMap map(&yaml(), &node_, path_, keys);
    if (!map.valid()) return;
    settings_.path = path_;
    ReadTableSource(&values_, map, &settings_);
    TableColumnSettings& column = AddColumn(path_, use_.name, use_.unit, *map.node());
    ReadTableColumnKeys(&values_, map, &column);
    if (const YamlNode* rate = map.Find("rate")) {
      ReadTableColumn(&values_, *rate,
                      &AddColumn(map.PathOf("rate"), RateName(), use_.unit + "/s", *rate));
      table_.with_rates = true;
    }
    if (const YamlNode* time = map.Find("time")) {
      ReadTableColumn(&values_, *time, &AddColumn(map.PathOf("time"), "time", "", *time));
    }
    if (const YamlNode* smoothing = map.Find("smoothing")) {
      ReadSmoothing(*smoothing, map.PathOf("smoothing"));
    }
    if (const YamlNode* periodic = map.Find("periodic")) {
      table_.periodic = yaml().Flag(*periodic, map.PathOf("periodic")).value_or(false);
    }
  }

  // A column; a time is not a signal.
  TableColumnSettings& AddColumn(const std::string& path, const std::string& signal,
                                 const std::string& unit, const YamlNode& place) {
    if (!unit.empty()) {
      Channel channel;
      channel.name = signal;
      channel.unit = unit;
      settings_.signals.push_back(std::move(channel));
    }
    settings_.columns.reserve(3);  // references stay
    TableColumnSettings& column = settings_.columns.emplace_back();
    column.place = {signal, place.line, place.column, nullptr};
    column.path = path;
    column.signal = signal;
    return column;
  }

  [[nodiscard]] std::string RateName() const { return use_.name + " rate"; }

  void ReadSmoothing(const YamlNode& node, const std::string& path) {
    if (node.is_map()) {
      const YamlMap map(&yaml(), &node, path, {"cutoff_hz"});
      const auto cutoff_hz = values_.RequiredPositive(map, "cutoff_hz");
      if (!cutoff_hz) return;
      table_.smoothing = "cut-off";
      rows_.cutoff_hz = *cutoff_hz;
      cutoff_place_ = &node;
    } else if (node.is_scalar() && (node.text == "none" || node.text == "auto")) {
      table_.smoothing = node.text;
    } else if (const auto deviation = values_.Positive(node, path)) {
      table_.smoothing = "stated";
      stated_ = *deviation;
    }
  }

  bool TakeRows() {
    const size_t rows = source_->time_s.size();
    if (rows < kFewestSplineRows) {
      yaml().Error(settings_.place, fmt::format("{}: {} has {} rows, a motion needs {} at least",
                                                path_, settings_.csv, rows, kFewestSplineRows));
      return false;
    }
    rows_.time_s = TrueTimes(*source_);
    if (!CheckCutoff()) return false;
    for (size_t c = 0; c < source_->columns.size(); ++c) {
      const bool rate = source_->columns[c].channel.name == RateName();
      const VecX column = source_->values.col(static_cast<Eigen::Index>(c));
      (rate ? rows_.rates : rows_.values).assign(column.begin(), column.end());
      (rate ? rows_.rate_deviation : rows_.deviation) = DeviationOf(c);
    }
    return true;
  }

  // Rows show no frequency above half of theirs.
  bool CheckCutoff() {
    const double whole_s = rows_.time_s.back() - rows_.time_s.front();
    const double highest_hz = 0.5 * static_cast<double>(rows_.time_s.size() - 1) / whole_s;
    if (rows_.cutoff_hz < highest_hz) return true;
    yaml().Error(*cutoff_place_,
                 fmt::format("{}.smoothing.cutoff_hz = {:g} violates < {:g}, half of the frequency "
                             "of the rows of {}",
                             path_, rows_.cutoff_hz, highest_hz, settings_.csv),
                 "smoothing: none takes the rows as they are");
    return false;
  }

  // What no smooth curve explains, but not less than what rounding to the printed digits makes.
  [[nodiscard]] double DeviationOf(size_t c) const {
    const auto column = static_cast<Eigen::Index>(c);
    return std::max(source_->columns[c].noise,
                    source_->steps.col(column).maxCoeff() / std::sqrt(12.0));
  }

  void Describe() {
    table_.name = use_.name;
    table_.file = source_->name;
    table_.column = source_->columns.front().heading;
    table_.unit = use_.unit;
    table_.rows = rows_.time_s.size();
    table_.from_s = rows_.time_s.front();
    table_.to_s = rows_.time_s.back();
    table_.stamp_error_s = source_->stamp_error_s;
    table_.moves = use_.moves;
    table_.notes = source_->notes;
    rows_.stated = stated_ > 0.0;
    if (rows_.stated) rows_.deviation = stated_ * std::abs(source_->columns.front().factor);
    table_.deviation = rows_.deviation;
  }

  // Rates of another column, sign or unit.
  void WarnRates() {
    SplineRows alone = rows_;
    alone.rates.clear();
    const Piecewise spline = Smoothed(alone);
    double error = 0.0, size = 0.0;
    for (size_t i = 0; i < rows_.time_s.size(); ++i) {
      const double rate = Evaluate(spline, rows_.time_s[i]).rate;
      error += (rows_.rates[i] - rate) * (rows_.rates[i] - rate);
      size += rate * rate;
    }
    if (error <= kRateUncertainty * kRateUncertainty * size) return;
    yaml().Warn(*node_.Find("rate"),
                fmt::format("{}.rate: the column differs from the derivative of the positions by "
                            "{:.0f} % (RMS)",
                            path_, 100.0 * std::sqrt(error / size)),
                "is it another column, or does it need sign or unit?");
  }

  ValueReader& values_;
  const YamlNode& node_;
  const std::string path_;
  const MotionTableUse& use_;
  TableSettings settings_;
  double stated_ = 0.0;  // deviation, in the column's own numbers
  const YamlNode* cutoff_place_ = nullptr;
  std::shared_ptr<const ReferenceTable> source_;
  SplineRows rows_;
  MotionTable table_;
};

}  // namespace

std::optional<MotionTable> LoadMotionTable(ValueReader* values, const YamlNode& node,
                                           const std::string& path, const MotionTableUse& use,
                                           const Mechanism& mechanism, Diagnostics* files) {
  return Loader(values, node, path, use).Load(mechanism, files);
}

void CheckCover(const MotionTable& table, const YamlNode& node, const std::string& path,
                double duration_s, YamlReader* yaml) {
  const double same_s = 1e-9 + 1.05 * table.stamp_error_s;
  if (table.periodic) return;
  if (table.from_s <= same_s && table.to_s >= duration_s - same_s) {
    // Rows that are left over: more than a few, and more than a log runs on.
    constexpr double kRows = 3.0, kShare = 0.02;
    const double row_s = (table.to_s - table.from_s) / static_cast<double>(table.rows - 1);
    const double over_s = table.to_s - duration_s;
    if (over_s <= std::max(kRows * row_s, kShare * duration_s) + same_s) return;
    yaml->Warn(
        node,
        fmt::format("{}: {} goes on to {:g} s, but the motion ends at {:g} s: {:.0f} % of it "
                    "is not used",
                    path, table.file, table.to_s, duration_s,
                    100.0 * over_s / (table.to_s - table.from_s)),
        table.to_s > kMilli * duration_s
            ? "are its times milliseconds? state time_unit: ms"
            : "state a longer motion.duration_s, or shorten the table");
    return;
  }
  const std::string shift =
      table.from_s > same_s
          ? fmt::format(
                "if the motion starts with its first row, add time_offset_s: {:g} to what "
                "is stated; ",
                -table.from_s)
          : "";
  yaml->Error(node,
              fmt::format("{}: {} gives {:g} … {:g} s, but the motion lasts 0 … {:g} s", path,
                          table.file, table.from_s, table.to_s, duration_s),
              shift + "state a shorter motion.duration_s, or periodic: true if it repeats");
}

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
                   where + " pitches beyond 89°, where roll and yaw are not distinguishable",
                   "turn the output's frame");
    } else {
      yaml().Error(settings_.place, where + " is not a rotation: its length violates 0.99 … 1.01",
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
