#include "table/motion_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "table/grid.h"
#include "table/noise.h"
#include "table/settings.h"
#include "table/table_spline.h"

namespace mbv {
namespace {

constexpr size_t kFewestSplineRows = 6;  // that determine a quintic polynomial
// A column of rates further from the positions' own, of their RMS, belongs to something else.
constexpr double kRateDoubt = 0.2;

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
    if (table_.with_rates) DoubtRates();
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

  // A column; a time is no signal.
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
    if (node.is_scalar() && (node.text == "none" || node.text == "auto")) {
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
    for (size_t c = 0; c < source_->columns.size(); ++c) {
      const bool rate = source_->columns[c].channel.name == RateName();
      const VecX column = source_->values.col(static_cast<Eigen::Index>(c));
      (rate ? rows_.rates : rows_.values).assign(column.begin(), column.end());
      (rate ? rows_.rate_deviation : rows_.deviation) = DeviationOf(c);
    }
    return true;
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
  void DoubtRates() {
    SplineRows alone = rows_;
    alone.rates.clear();
    const Piecewise spline = Smoothed(alone);
    double error = 0.0, size = 0.0;
    for (size_t i = 0; i < rows_.time_s.size(); ++i) {
      const double rate = Evaluate(spline, rows_.time_s[i]).rate;
      error += (rows_.rates[i] - rate) * (rows_.rates[i] - rate);
      size += rate * rate;
    }
    if (error <= kRateDoubt * kRateDoubt * size) return;
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
  if (table.periodic || (table.from_s <= same_s && table.to_s >= duration_s - same_s)) return;
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

}  // namespace mbv
