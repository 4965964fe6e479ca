#include "features/paper/paper_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/metrics.h"
#include "plot/figure.h"
#include "plot/style.h"

namespace mbv {
namespace {

constexpr double kPercent = 100.0;

void AddAt(const PlacedText& at, const std::string& message, const std::string& file,
           Diagnostics* diagnostics) {
  diagnostics->Add({.severity = Severity::kError,
                    .file = file,
                    .line = at.line,
                    .column = at.column,
                    .message = fmt::format("{} = '{}': {}", at.path, at.text, message),
                    .hint = ""});
}

// Between two samples by a straight line; NaN outside.
double ValueAt(const Trace& trace, int column, double time_s) {
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    if (trace.time_s[i] < time_s) continue;
    const double v = trace.values(static_cast<Eigen::Index>(i), column);
    if (trace.time_s[i] == time_s) return v;
    if (i == 0) return kNan;
    const double u = trace.values(static_cast<Eigen::Index>(i) - 1, column);
    const double share = (time_s - trace.time_s[i - 1]) / (trace.time_s[i] - trace.time_s[i - 1]);
    return u + share * (v - u);
  }
  return kNan;
}

class SignalMeter {
 public:
  SignalMeter(const PaperStatement& statement, const Report& report, const std::string& file,
              Diagnostics* diagnostics)
      : statement_(statement), report_(report), file_(file), diagnostics_(diagnostics) {}

  // What it is measured of; false after a finding.
  bool Find() {
    of_ = WitnessOf(statement_.of);
    const bool two = statement_.measure >= PaperMeasure::kDifference;
    to_ = two ? WitnessOf(statement_.to) : of_;
    if (of_ == nullptr || to_ == nullptr) return false;
    for (const PlacedText& signal : statement_.signals) FindChannels(signal);
    if (pairs_.empty()) return false;
    const std::string& si = of_->channels[static_cast<size_t>(pairs_[0].first)].unit;
    const ShownUnit* unit = FindUnit(si, statement_.unit.given() ? statement_.unit.text : si);
    if (unit != nullptr) unit_ = *unit;
    if (unit == nullptr && statement_.unit.given() && statement_.unit.text != si) {
      AddAt(statement_.unit, "no unit of what is recorded in " + si, file_, diagnostics_);
      return false;
    }
    if (unit == nullptr) unit_ = {si, si == "1" ? "" : si, si, 1.0};
    return true;
  }

  void Measure(StatedResult* result) {
    result->unit = unit_.name;
    switch (statement_.measure) {
      case PaperMeasure::kRange:
        return Range(result);
      case PaperMeasure::kLargest:
        result->measured = unit_.factor * Largest();
        return;
      case PaperMeasure::kDifference:
        result->measured = unit_.factor * LargestDifference();
        return;
      case PaperMeasure::kShare:
        result->unit = "%";
        result->measured = kPercent * LargestDifference() / LargestTruth();
        return;
      default:
        result->unit = "%";
        result->measured = kPercent * ShareBeyond();
    }
  }

 private:
  const Trace* WitnessOf(const PlacedText& name) {
    const Trace* trace = TraceOf(report_, name.text);
    if (trace == nullptr || trace->time_s.empty()) {
      AddAt(name, "no such witness ran", file_, diagnostics_);
      return nullptr;
    }
    return trace;
  }

  void FindChannels(const PlacedText& signal) {
    const size_t before = pairs_.size();
    for (size_t k = 0; k < of_->channels.size(); ++k) {
      const int other = to_->Find(of_->channels[k].name);
      if (FitsPattern(of_->channels[k].name, signal.text) && other >= 0) {
        pairs_.emplace_back(static_cast<int>(k), other);
      }
    }
    if (pairs_.size() == before) {
      AddAt(signal, "not recorded by " + statement_.of.text, file_, diagnostics_);
    }
  }

  void Range(StatedResult* result) {
    for (const auto& [column, other] : pairs_) {
      const auto values = of_->values.col(column).array() * unit_.factor;
      for (const double v : values) {
        if (!std::isfinite(v)) continue;
        if (!(result->low <= v)) result->low = v;
        if (!(result->measured >= v)) result->measured = v;
      }
    }
  }

  // A NaN stays: what was not computed is not small.
  static void Keep(double value, double* largest) {
    if (!(std::abs(value) <= *largest)) *largest = std::abs(value);
  }

  [[nodiscard]] double Largest() const {
    double largest = 0;
    for (const auto& [column, other] : pairs_) {
      for (const double t : statement_.at_s) Keep(ValueAt(*of_, column, t), &largest);
      if (!statement_.at_s.empty()) continue;
      for (const double v : of_->values.col(column)) Keep(v, &largest);
    }
    return largest;
  }

  [[nodiscard]] double LargestDifference() const {
    double largest = kNan;
    const CommonSamples common = AlignSamples(*of_, *to_);
    if (!common.empty()) largest = 0;
    for (const auto& [column, other] : pairs_) {
      for (const auto& [i, j] : common) {
        Keep(of_->values(i, column) - to_->values(j, other), &largest);
      }
    }
    return largest;
  }

  [[nodiscard]] double LargestTruth() const {
    double largest = 0;
    for (const auto& [column, other] : pairs_) {
      for (const double v : to_->values.col(other)) Keep(v, &largest);
    }
    return largest;
  }

  [[nodiscard]] double ShareBeyond() const {
    const CommonSamples common = AlignSamples(*of_, *to_);
    size_t beyond = 0;
    for (const auto& [column, other] : pairs_) {
      for (const auto& [i, j] : common) {
        const double truth = to_->values(j, other);
        const bool within = std::abs(of_->values(i, column) - truth) <=
                            statement_.beyond / kPercent * std::abs(truth);
        beyond += within ? 0 : 1;
      }
    }
    return static_cast<double>(beyond) / static_cast<double>(common.size() * pairs_.size());
  }

  const PaperStatement& statement_;
  const Report& report_;
  const std::string& file_;
  Diagnostics* diagnostics_;
  const Trace* of_ = nullptr;
  const Trace* to_ = nullptr;
  std::vector<std::pair<int, int>> pairs_;  // columns of both
  ShownUnit unit_;
};

double LargestOfMap(const MapPlot& map) {
  double largest = 0;
  for (const double v : map.values) {
    if (std::isfinite(v)) largest = std::max(largest, std::abs(v));
  }
  return largest;
}

// |a(x, y) − b(y, x)| where both are reached, over the largest of both.
double MirrorShare(const MapPlot& a, const MapPlot& b) {
  if (a.columns != b.rows || a.rows != b.columns) return kNan;
  double largest = 0;
  size_t seen = 0;
  const auto rows = static_cast<size_t>(a.rows), columns = static_cast<size_t>(a.columns);
  for (size_t r = 0; r < rows; ++r) {
    for (size_t c = 0; c < columns; ++c) {
      const double d = a.values[r * columns + c] - b.values[c * rows + r];
      if (!std::isfinite(d)) continue;
      largest = std::max(largest, std::abs(d));
      ++seen;
    }
  }
  const double scale = std::max(LargestOfMap(a), LargestOfMap(b));
  return seen == 0 || scale == 0 ? kNan : kPercent * largest / scale;
}

double MedianOf(const MapPlot& map) {
  std::vector<double> values;
  for (const double v : map.values) {
    if (std::isfinite(v)) values.push_back(v);
  }
  if (values.empty()) return kNan;
  std::ranges::sort(values);
  const size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

StatedResult ResultOf(const PaperStatement& statement) {
  return {.says = statement.says,
          .where = statement.where,
          .printed = statement.printed,
          .unit = statement.unit.text};
}

std::string WithUnit(double value, const std::string& unit, const char* sign = "") {
  const std::string number =
      fmt::format(fmt::runtime(fmt::format("{{:{}.3g}}", sign)), value + 0.0);
  return unit.empty() ? number : number + " " + unit;
}

}  // namespace

StatedResult MeasureSignals(const PaperStatement& statement, const Report& report,
                            const std::string& file, Diagnostics* diagnostics) {
  StatedResult result = ResultOf(statement);
  SignalMeter meter(statement, report, file, diagnostics);
  if (meter.Find()) meter.Measure(&result);
  return result;
}

StatedResult MeasureMaps(const PaperStatement& statement, const std::vector<MapPlot>& maps,
                         const std::string& file, Diagnostics* diagnostics) {
  StatedResult result = ResultOf(statement);
  const bool alone = statement.measure == PaperMeasure::kMirror;
  const size_t other = alone ? statement.map : statement.other;
  if (std::max(statement.map, other) >= maps.size()) {
    diagnostics->AddError(
        file, fmt::format("'{}': there are {} maps, counted from 0", statement.says, maps.size()));
    return result;
  }
  const MapPlot& a = maps[statement.map];
  const MapPlot& b = maps[other];
  if (statement.measure == PaperMeasure::kMedianRatio) {
    result.measured = MedianOf(a) / MedianOf(b);
    return result;
  }
  result.unit = "%";
  result.measured = MirrorShare(a, b);
  return result;
}

std::string ResultText(const StatedResult& result) {
  std::string text = fmt::format("“{}” ({}): ", result.says, result.where);
  if (std::isfinite(result.printed)) {
    text += "printed " + WithUnit(result.printed, result.unit) + ", ";
  }
  text += "computed ";
  if (std::isfinite(result.low)) text += WithUnit(result.low, "") + " … ";
  text += WithUnit(result.measured, result.unit);
  if (std::isfinite(result.printed)) {
    text += ", deviation " + WithUnit(result.deviation(), result.unit, "+");
  }
  return text;
}

}  // namespace mbv
