#include "scenario/tables/motion_table.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "math/spatial.h"
#include "math/trace.h"
#include "scenario/tables/table.h"
#include "scenario/tables/table_spline.h"

namespace mbv {
namespace {

constexpr size_t kFewestSplineRows = 6;  // that determine a quintic polynomial
// A column of rates further from the positions' own, of their RMS, belongs to something else.
constexpr double kRateUncertainty = 0.2;
// A table that lasts more than this many motions may be in milliseconds.
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

constexpr size_t kRates = 4;  // of an inertial measurement unit
const std::array<Convention, 5>& Conventions() {
  static const std::array<Convention, 5> all = {
      Convention{"rpy", {"roll", "pitch", "yaw"}, "rad", FromRpy},
      Convention{"quaternion", {"qw", "qx", "qy", "qz"}, "1", FromQuaternion},
      Convention{"rotation_vector", {"rx", "ry", "rz"}, "rad", FromRotationVector},
      Convention{"axis_angle", {"ax", "ay", "az", "angle"}, "1", FromAxisAngle},
      Convention{"rates", {"wx", "wy", "wz"}, "rad/s", nullptr}};
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

// How the drift of an inertial measurement unit is taken off.
struct DriftSettings {
  enum class End { kFree, kRest, kReturn };
  double rest_s = 0.0;
  End end = End::kFree;
};

// (1), (2) in the header. Three splines each; of `turning` none where `R` gives the orientations.
class DeadReckoning {
 public:
  DeadReckoning(const std::vector<double>& time_s, const Mat3& R_0, const Vec3& x_0,
                const Vec3& gravity, const DriftSettings& drift)
      : time_s_(time_s), R_0_(R_0), x_0_(x_0), g_(gravity), drift_(drift) {}

  // Rows of rates, or orientations; rows of specific force. Rows of x and R.
  void Run(const std::array<Piecewise, 3>* rates, const std::array<Piecewise, 3>& force,
           std::vector<Mat3>* R, std::vector<Vec3>* x) {
    TakeRest(rates, force);
    if (rates != nullptr) {
      Turn(*rates, R);
      for (int pass = 0; pass < kPasses && drift_.end == DriftSettings::End::kReturn; ++pass) {
        const Vec3 turned = LogRotation(R_0_.transpose() * R->back());
        if (turned.norm() < kTurned) break;
        b_w_ += turned / Span();
        Turn(*rates, R);
      }
    }
    Move(rates, force, *R, x);
  }

  [[nodiscard]] std::string Note(bool turned) const {
    const auto three = [](const Vec3& v) {
      return fmt::format("({:.3g}, {:.3g}, {:.3g})", v.x(), v.y(), v.z());
    };
    return fmt::format(
        "from the home pose at rest by dead reckoning; taken off: {}the accelerometer's bias {} "
        "m/s²{}",
        turned ? "" : fmt::format("the gyroscope's bias {} rad/s, ", three(b_w_)), three(b_f_),
        drift_.end == DriftSettings::End::kFree
            ? fmt::format("; it ends with {:.3g} m/s, {:.3g} m away", v_end_.norm(), d_end_.norm())
            : fmt::format(", and at the end {:.3g} m/s{}", v_end_.norm(),
                          drift_.end == DriftSettings::End::kReturn
                              ? fmt::format(" and {:.3g} m", d_end_.norm())
                              : std::string()));
  }

 private:
  static constexpr int kParts = 8;          // of the time between rows, even
  static constexpr int kPasses = 20;        // until the end is turned as the start
  static constexpr double kTurned = 1e-13;  // rad

  [[nodiscard]] double Span() const { return time_s_.back() - time_s_.front(); }
  static Vec3 At(const std::array<Piecewise, 3>& of, double t) {
    return {Evaluate(of[0], t).value, Evaluate(of[1], t).value, Evaluate(of[2], t).value};
  }

  void TakeRest(const std::array<Piecewise, 3>* rates, const std::array<Piecewise, 3>& force) {
    double rows = 0.0;
    for (const double t : time_s_) {
      if (!(drift_.rest_s > 0.0) || t > time_s_.front() + drift_.rest_s) break;
      if (rates != nullptr) b_w_ += At(*rates, t);
      b_f_ += At(force, t) + R_0_.transpose() * g_;
      rows += 1.0;
    }
    if (rows == 0.0) return;
    b_w_ /= rows;
    b_f_ /= rows;
  }

  [[nodiscard]] Mat3 Turned(const std::array<Piecewise, 3>& rates, const Mat3& R, double t,
                            double step) const {
    const double inside = std::sqrt(3.0) / 6.0;
    const Vec3 w_1 = At(rates, t + (0.5 - inside) * step) - b_w_;
    const Vec3 w_2 = At(rates, t + (0.5 + inside) * step) - b_w_;
    return R * ExpRotation(0.5 * step * (w_1 + w_2) + 0.5 * inside * step * step * w_1.cross(w_2));
  }

  void Turn(const std::array<Piecewise, 3>& rates, std::vector<Mat3>* R) const {
    R->assign(1, R_0_);
    for (size_t i = 0; i + 1 < time_s_.size(); ++i) {
      const double step = (time_s_[i + 1] - time_s_[i]) / kParts;
      Mat3 now = R->back();
      for (int k = 0; k < kParts; ++k) now = Turned(rates, now, time_s_[i] + k * step, step);
      R->push_back(now);
    }
  }

  // Between given orientations the way is that of a constant rate.
  void Move(const std::array<Piecewise, 3>* rates, const std::array<Piecewise, 3>& force,
            const std::vector<Mat3>& R, std::vector<Vec3>* x) {
    std::vector<Vec3> v(1, Vec3::Zero());
    x->assign(1, x_0_);
    for (size_t i = 0; i + 1 < time_s_.size(); ++i) {
      const double step = (time_s_[i + 1] - time_s_[i]) / kParts;
      const Vec3 way = LogRotation(R[i].transpose() * R[i + 1]) / kParts;
      std::array<Vec3, kParts + 1> a;
      Mat3 now = R[i];
      for (int k = 0; k <= kParts; ++k) {
        const double t = time_s_[i] + k * step;
        a.at(static_cast<size_t>(k)) = now * (At(force, t) - b_f_) + g_;
        if (k == kParts) break;
        now = rates != nullptr ? Turned(*rates, now, t, step) : Mat3(now * ExpRotation(way));
      }
      Vec3 speed = v.back(), place = x->back();
      for (size_t k = 0; k < kParts; k += 2) {
        place += 2.0 * step * speed + 2.0 * step * step / 3.0 * (a.at(k) + 2.0 * a.at(k + 1));
        speed += step / 3.0 * (a.at(k) + 4.0 * a.at(k + 1) + a.at(k + 2));
      }
      v.push_back(speed);
      x->push_back(place);
    }
    v_end_ = v.back();
    d_end_ = x->back() - x_0_;
    if (drift_.end == DriftSettings::End::kFree) return;
    const double T = Span();
    const Vec3 beta = drift_.end == DriftSettings::End::kRest
                          ? Vec3(Vec3::Zero())
                          : Vec3((0.5 * T * v_end_ - d_end_) * 6.0 / (T * T * T));
    const Vec3 alpha = v_end_ / T - beta * T;
    for (size_t i = 0; i < x->size(); ++i) {
      const double t = time_s_[i] - time_s_.front();
      (*x)[i] -= t * t * (alpha / 2.0 + beta * t / 3.0);
    }
  }

  const std::vector<double>& time_s_;
  const Mat3 R_0_;
  const Vec3 x_0_, g_;
  const DriftSettings drift_;
  Vec3 b_w_ = Vec3::Zero(), b_f_ = Vec3::Zero(), v_end_ = Vec3::Zero(), d_end_ = Vec3::Zero();
};

class PoseLoader {
 public:
  PoseLoader(ValueReader* values, const YamlNode& node, const Mechanism& mechanism)
      : values_(*values), node_(node), mechanism_(mechanism) {}

  PoseTable Load(Diagnostics* files) {
    const size_t found = yaml().diagnostics().findings().size();
    Read();
    if (settings_.file.empty() || yaml().diagnostics().findings().size() > found) return {};
    source_ = LoadTable(settings_, mechanism_, &yaml(), files);
    if (source_ == nullptr || !CheckRows() || !TakeRows() || !Finish()) return {};
    return std::move(pose_);
  }

 private:
  YamlReader& yaml() { return values_.yaml(); }

  void Read() {
    settings_.path = "motion.pose_table";
    std::vector<std::string> keys = {"output", "angles",    "columns",  "time",
                                     "use",    "smoothing", "periodic", "imu"};
    keys.insert(keys.end(), kTableSourceKeys.begin(), kTableSourceKeys.end());
    const YamlMap map(&yaml(), &node_, settings_.path, keys);
    if (!map.valid()) return;
    ReadTableSource(&values_, map, &settings_);
    if (const YamlNode* output = map.Required("output")) ReadOutput(*output, map.PathOf("output"));
    if (const YamlNode* imu = map.Find("imu")) ReadImu(*imu, map.PathOf("imu"));
    if (const YamlNode* angles = map.Find("angles")) {
      std::vector<std::string> words = {"rpy", "quaternion", "rotation_vector", "axis_angle"};
      if (imu_) words[3] = "rates";  // columns ax, ay, az are its specific force
      const auto choice = yaml().Choice(*angles, map.PathOf("angles"), words);
      convention_ = &Conventions()[static_cast<size_t>(choice.value_or(0))];
      if (imu_ && choice == 3) convention_ = &Conventions()[kRates];
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

  void ReadImu(const YamlNode& node, const std::string& path) {
    const YamlMap map(&yaml(), &node, path, {"rest_s", "end"});
    imu_.emplace();
    convention_ = &Conventions()[kRates];
    if (const YamlNode* rest = map.Find("rest_s")) {
      imu_->rest_s = values_.Positive(*rest, map.PathOf("rest_s")).value_or(0.0);
    }
    if (const YamlNode* end = map.Find("end")) {
      const auto choice = yaml().Choice(*end, map.PathOf("end"), {"free", "rest", "return"});
      imu_->end = static_cast<DriftSettings::End>(choice.value_or(0));
    }
    if (pose_.output < 0 ||
        mechanism_.outputs[static_cast<size_t>(pose_.output)].reference_body == 0) {
      return;
    }
    yaml().Error(node, path + ": the output's pose is one in a body that moves, not in the world",
                 "take an output whose pose is one in the world");
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
    if (imu_) names = {"ax", "ay", "az"};
    names.insert(names.end(), convention_->columns.begin(), convention_->columns.end());
    const YamlMap columns(&yaml(), map.Find("columns"), map.PathOf("columns"), names);
    for (const std::string& name : names) {
      Channel channel;
      channel.name = name;
      channel.unit = name == "angle" ? "rad" : convention_->unit;
      if (settings_.signals.size() < 3) channel.unit = imu_ ? "m/s^2" : "m";
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

  bool TakeRows() {
    if (!imu_) return TurnRows(source_->values);
    // Orientations and specific forces of the rows, then poses of the rows.
    const std::vector<double> time_s = TrueTimes(*source_);
    const MatX& values = source_->values;
    const auto splines = [&](Eigen::Index first) {
      std::array<Piecewise, 3> of;
      for (Eigen::Index c = 0; c < 3; ++c) {
        SplineRows rows;
        rows.time_s = time_s;
        const VecX column = values.col(first + c);
        rows.values.assign(column.begin(), column.end());
        of.at(static_cast<size_t>(c)) = Interpolated(rows);
      }
      return of;
    };
    const bool rates = convention_->rotation == nullptr;
    std::vector<Mat3> R;
    for (Eigen::Index i = 0; i < values.rows() && !rates; ++i) {
      const auto turned = convention_->rotation(values.row(i).tail(values.cols() - 3).transpose());
      if (!turned) return RefuseRow(i, false);
      R.push_back(*turned);
    }
    const Output& output = mechanism_.outputs[static_cast<size_t>(pose_.output)];
    Vec6 home;
    for (int c = 0; c < 6; ++c) {
      home[c] = HomeValue(mechanism_, {Coordinate::Kind::kOutput, pose_.output, c});
    }
    const Vec3 gravity = output.X_RbR.linear().transpose() * mechanism_.gravity_W;
    DeadReckoning reckoning(time_s, rates ? RotRpy(home.tail<3>()) : R.front(), home.head<3>(),
                            gravity, *imu_);
    std::vector<Vec3> x;
    const std::array<Piecewise, 3> force = splines(0);
    if (rates) {
      const std::array<Piecewise, 3> turning = splines(3);
      reckoning.Run(&turning, force, &R, &x);
    } else {
      reckoning.Run(nullptr, force, &R, &x);
    }
    note_ = reckoning.Note(!rates);
    MatX poses(values.rows(), 6);
    for (Eigen::Index i = 0; i < poses.rows(); ++i) {
      const auto row = static_cast<size_t>(i);
      poses.row(i) << x[row].transpose(), RpyOf(R[row]).transpose();
    }
    convention_ = Conventions().data();
    return TurnRows(poses);
  }

  // Every row's orientation as roll, pitch and yaw.
  bool TurnRows(const MatX& values) {
    const auto n = values.rows();
    for (auto& component : rows_) component.resize(static_cast<size_t>(n));
    for (Eigen::Index i = 0; i < n; ++i) {
      const VecX row = values.row(i).transpose();
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
      const double step = c < 3 && !imu_ ? source_->steps.col(c).maxCoeff() : 0.0;
      rows.deviation = std::max(EstimateNoise(rows.time_s, column)[0], step / std::sqrt(12.0));
      if (imu_ && rows.deviation < RoundOff(c)) rows.deviation = 0.0;
      pose_.components.push_back({c, Described(c, rows)});
      const RowsPlace place{&yaml(), settings_.place, settings_.path, settings_.csv, step};
      if (!MakeSplines(place, rows, &pose_.components.back().table)) return false;
    }
    return true;
  }

  // Of a dead reckoning: of all lengths, or of a radian.
  [[nodiscard]] double RoundOff(int c) const {
    double size = c < 3 ? 0.0 : 1.0;
    for (size_t k = 0; k < 3 && c < 3; ++k) {
      for (const double x : rows_.at(k)) size = std::max(size, std::abs(x));
    }
    return 8.0 * kEps * size;
  }

  [[nodiscard]] MotionTable Described(int c, const SplineRows& rows) const {
    MotionTable table;
    const Output& output = mechanism_.outputs[static_cast<size_t>(pose_.output)];
    const auto k = static_cast<size_t>(c);
    table.name = output.name + "." + kPoseComponents[k];
    table.file = source_->name;
    table.column = imu_ ? "imu" : c < 3 ? source_->columns[k].heading : convention_->word;
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
    if (pose_.components.empty() && imu_) table.notes.push_back(note_);
    return table;
  }

  ValueReader& values_;
  const YamlNode& node_;
  const Mechanism& mechanism_;
  std::optional<DriftSettings> imu_;
  std::string note_;
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
