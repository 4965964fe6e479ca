#include "comparison/table_tube.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include "comparison/comparison.h"
#include "comparison/force_band.h"
#include "comparison/force_scale.h"

namespace mbv {

namespace {

// Signals without a limit on their largest difference get this multiple of the RMS one.
constexpr double kPeakOverRms = 10.0;

constexpr Metric kRmsMetrics[] = {Metric::kForceNrmse,   Metric::kForceOwn, Metric::kVelocity,
                                  Metric::kAcceleration, Metric::kReaction, Metric::kReactionOwn,
                                  Metric::kBaseForce};
constexpr Metric kMaxMetrics[] = {Metric::kForceMax, Metric::kPositionM, Metric::kPositionRad,
                                  Metric::kPoseM, Metric::kPoseRad};

// The rows and channels that a table and another witness share.
struct Shared {
  Trace table, other;           // same rows and channels
  MatX standard, bound;         // as both
  MatX half;                    // half-widths of the other's forces
  std::vector<size_t> columns;  // of the table's trace
};

Shared Share(const AlignedTable& table, const Trace& other) {
  Shared shared;
  std::vector<ForceSignal> from_other;
  std::vector<Channel> channels;
  for (size_t c = 0; c < table.trace.channels.size(); ++c) {
    const int column = other.Find(table.trace.channels[c].name);
    if (column < 0) continue;
    shared.columns.push_back(c);
    from_other.emplace_back(other, column);
    channels.push_back(table.trace.channels[c]);
  }
  const CommonSamples samples = AlignSamples(table.trace, other);
  std::vector<double> times;
  for (const auto& [i, j] : samples) times.push_back(table.trace.time_s[static_cast<size_t>(i)]);
  shared.table.witness = "table";
  shared.table.Reset(times, channels);
  shared.other = shared.table;
  shared.standard = shared.bound = shared.half = shared.table.values;
  shared.half.setZero();
  for (size_t k = 0; k < samples.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const auto [i, j] = samples[k];
    for (size_t c = 0; c < channels.size(); ++c) {
      const auto to = static_cast<Eigen::Index>(c);
      const auto from = static_cast<Eigen::Index>(shared.columns[c]);
      shared.table.values(row, to) = table.trace.values(i, from);
      const ForceBand force = from_other[c].At(j);
      shared.other.values(row, to) = force.middle;
      shared.half(row, to) = force.half;
      shared.standard(row, to) = table.standard(i, from);
      shared.bound(row, to) = table.bound(i, from);
    }
  }
  return shared;
}

// The trace that differs from `truth` by the uncertainty.
Trace Perturbed(const Trace& truth, const MatX& uncertainty) {
  Trace perturbed = truth;
  perturbed.values += uncertainty;
  return perturbed;
}

// Limits of a scenario in a column's own unit; empty where they are switched off.
class StatedLimits {
 public:
  StatedLimits(const ComparisonInput& input, const Shared& shared, LimitColumn column)
      : input_(input), shared_(shared), column_(column) {}

  struct Limits {
    double rms = 0.0, max = 0.0;
  };
  [[nodiscard]] std::optional<Limits> Of(Eigen::Index c) const {
    const Channel& channel = shared_.table.channels[static_cast<size_t>(c)];
    const bool angle = channel.unit == "rad";
    const Pooled pooled = Pool(channel.quantity, channel.unit);
    const RestFloor rest =
        RestFloorOf(input_, channel.unit.starts_with("rad") ? "rad" : "m", shared_.table);
    switch (channel.quantity) {
      case Quantity::kForce: {
        const auto rms = Limit(Metric::kForceNrmse), max = Limit(Metric::kForceMax);
        if (!rms && !max) return {};
        return Limits{rms ? *rms * pooled.rms : kOff, max ? *max * pooled.max : kOff};
      }
      case Quantity::kPosition:
        return Absolute(angle ? Metric::kPositionRad : Metric::kPositionM);
      case Quantity::kPose:
        return Absolute(angle ? Metric::kPoseRad : Metric::kPoseM);
      case Quantity::kVelocity:
        return Relative(Metric::kVelocity, std::max(pooled.rms, rest.velocity));
      case Quantity::kAcceleration:
        return Relative(Metric::kAcceleration, std::max(pooled.rms, rest.acceleration));
      case Quantity::kReaction:
        return Relative(Metric::kReaction, pooled.rms);
      case Quantity::kBaseForce:
        return Relative(Metric::kBaseForce, pooled.rms);
      case Quantity::kLoopGap:
        return Absolute(Metric::kClosureM);
      case Quantity::kLoopTwist:
        return Absolute(Metric::kClosureRad);
      default:  // what no metric is about
        return Relative(Metric::kForceNrmse, pooled.rms);
    }
  }

 private:
  static constexpr double kOff = std::numeric_limits<double>::infinity();
  struct Pooled {
    double rms = 0.0, max = 0.0;
  };

  [[nodiscard]] std::optional<double> Limit(Metric metric) const {
    return input_.limits[metric].Of(column_);
  }
  [[nodiscard]] std::optional<Limits> Absolute(Metric metric) const {
    const auto limit = Limit(metric);
    if (!limit) return {};
    return Limits{*limit, *limit};
  }
  [[nodiscard]] std::optional<Limits> Relative(Metric metric, double scale) const {
    const auto limit = Limit(metric);
    if (!limit) return {};
    return Limits{*limit * scale, kPeakOverRms * *limit * scale};
  }

  // All columns of one quantity and unit.
  [[nodiscard]] Pooled Pool(Quantity quantity, const std::string& unit) const {
    double sum2 = 0.0, count = 0.0;
    Pooled pooled;
    for (Eigen::Index c = 0; c < shared_.table.values.cols(); ++c) {
      const Channel& channel = shared_.table.channels[static_cast<size_t>(c)];
      if (channel.unit != unit || channel.quantity != quantity) continue;
      const auto column = shared_.table.values.col(c);
      sum2 += column.squaredNorm();
      count += static_cast<double>(column.size());
      if (column.size() > 0) pooled.max = std::max(pooled.max, column.cwiseAbs().maxCoeff());
    }
    pooled.rms = count > 0.0 ? std::sqrt(sum2 / count) : 0.0;
    return pooled;
  }

  const ComparisonInput& input_;
  const Shared& shared_;
  LimitColumn column_;
};

bool IsForceLike(Quantity quantity) {
  return quantity == Quantity::kForce || quantity == Quantity::kBaseForce ||
         quantity == Quantity::kReaction || quantity == Quantity::kOwn;
}

// Differences of one column; the start-up window is left out of forces.
TableColumnResult Measure(const ComparisonInput& input, const Shared& shared, Eigen::Index c) {
  const auto k = static_cast<size_t>(c);
  const Channel& channel = shared.table.channels[k];
  const bool windowed = IsForceLike(channel.quantity);
  TableColumnResult result{.channel = channel.name, .column = shared.columns[k]};
  ErrorSum difference, standard;
  double bound = 0.0;
  for (size_t i = 0; i < shared.table.time_s.size(); ++i) {
    const double time_s = shared.table.time_s[i];
    if (windowed && time_s < input.start_window_s) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const double a = shared.table.values(row, c), b = shared.other.values(row, c);
    const double error =
        channel.unit == "rad"
            ? AngleDifference(a, b)
            : Difference({.middle = a}, {.middle = b, .half = shared.half(row, c)});
    difference.Add(error, a, time_s, channel.name);
    standard.Add(shared.standard(row, c), 0.0, time_s, channel.name);
    bound = std::max(bound, shared.bound(row, c));
  }
  result.samples = difference.count();
  if (result.samples == 0) return result;
  result.rms = difference.rms_truth();
  result.standard = standard.rms_error();
  result.bound = bound;
  result.error_rms = difference.rms_error();
  result.error_max = difference.max_error();
  result.time_s = difference.worst_time_s();
  return result;
}

bool IsNotUnique(const ComparisonInput& input, const std::string& channel) {
  const auto& open = input.reactions_not_unique;
  return std::find(open.begin(), open.end(), channel) != open.end();
}

}  // namespace

double TableColumnResult::ratio() const {
  // 0/0: both vanish, as a column of zeros that is exactly met.
  const auto part = [](double error, double tube) {
    return error == 0.0 && tube == 0.0 ? 0.0 : error / tube;
  };
  const double rms = part(error_rms, tube_rms), max = part(error_max, tube_max);
  return std::isnan(rms) || std::isnan(max) ? kNan : std::max(rms, max);
}

bool IsTable(const ComparisonInput& input, const std::string& witness) {
  return input.table != nullptr && witness == role::kReference;
}

std::map<Metric, double> TubeLimits(const ComparisonInput& input, const Trace& other,
                                    bool table_is_truth) {
  const Shared shared = Share(*input.table, other);
  const Trace& truth = table_is_truth ? shared.table : shared.other;
  ComparisonInput plain = input;
  plain.table = nullptr;
  const PairComparison rms = ComparePair(plain, Perturbed(truth, shared.standard), truth);
  const PairComparison max = ComparePair(plain, Perturbed(truth, shared.bound), truth);
  std::map<Metric, double> tubes;
  const auto take = [&](const PairComparison& pair, Metric metric) {
    const auto found = pair.metrics.find(metric);
    if (found != pair.metrics.end()) tubes[metric] = input.table->coverage * found->second.value;
  };
  for (const Metric metric : kRmsMetrics) take(rms, metric);
  for (const Metric metric : kMaxMetrics) take(max, metric);
  return tubes;
}

std::map<Metric, double> CommandTubes(const ComparisonInput& input) {
  const AlignedTable& table = *input.table;
  std::map<Metric, double> tubes;
  for (size_t c = 0; c < table.trace.channels.size(); ++c) {
    if (table.bound.rows() == 0) break;
    const double bound = table.bound.col(static_cast<Eigen::Index>(c)).maxCoeff();
    const std::string& unit = table.trace.channels[c].unit;
    if (unit != "m" && unit != "rad") continue;
    // A command may be the difference of two coordinates.
    double& tube = tubes[unit == "m" ? Metric::kCommandM : Metric::kCommandRad];
    tube = std::max(tube, 2.0 * table.coverage * bound);
  }
  return tubes;
}

std::vector<TableColumnResult> JudgeColumns(const ComparisonInput& input, const Trace& other,
                                            LimitColumn column) {
  const Shared shared = Share(*input.table, other);
  const StatedLimits stated(input, shared, column);
  std::vector<TableColumnResult> results;
  for (Eigen::Index c = 0; c < shared.table.values.cols(); ++c) {
    if (IsNotUnique(input, shared.table.channels[static_cast<size_t>(c)].name)) continue;
    const auto limits = stated.Of(c);
    if (!limits) continue;
    TableColumnResult result = Measure(input, shared, c);
    if (result.samples == 0) continue;
    result.tube_rms = std::max(input.table->coverage * result.standard, limits->rms);
    result.tube_max = std::max(input.table->coverage * result.bound, limits->max);
    results.push_back(std::move(result));
  }
  return results;
}

Measured WorstOf(const std::vector<TableColumnResult>& columns) {
  Measured worst;
  for (const TableColumnResult& column : columns) {
    KeepWorst(&worst, column.ratio(), column.time_s, column.channel);
  }
  return worst;
}

std::string TooCoarse(const ComparisonInput& input, const std::map<Metric, double>& tubes,
                      const std::vector<TableColumnResult>& columns) {
  const AlignedTable& table = *input.table;
  bool any_force = false, all_coarse = true;
  for (const TableColumnResult& column : columns) {
    const Quantity quantity = table.trace.channels[column.column].quantity;
    any_force = any_force || quantity == Quantity::kForce;
    all_coarse = all_coarse && table.coverage * column.standard > table.coarsest * column.rms;
  }
  if (columns.empty()) return "";
  const auto force = tubes.find(Metric::kForceNrmse);
  const bool coarse_force = any_force && force != tubes.end() && !(force->second <= table.coarsest);
  if (coarse_force) {
    return fmt::format(
        "the table {} is too coarse to verify anything: {:g} times its own or stated "
        "uncertainty is {:.2g} % of the RMS force (at most {:g} %)",
        table.name, table.coverage, 100.0 * force->second, 100.0 * table.coarsest);
  }
  if (all_coarse && !any_force) {
    return fmt::format(
        "the table {} is too coarse to verify anything: {:g} times its own or stated "
        "uncertainty exceeds {:g} % of every column",
        table.name, table.coverage, 100.0 * table.coarsest);
  }
  return "";
}

namespace {

// An explanation must leave less than this share of the difference …
constexpr double kExplains = 0.1;
// … and no more than this multiple of the column's tube, or this share of the signal.
constexpr double kTubes = 3.0;
constexpr double kShare = 0.02;
constexpr size_t kOneOutlierIn = 100;  // rows; more of them are no outliers
constexpr size_t kMostShifted = 800;   // rows used to find a time shift
constexpr int kShiftSteps = 400;       // to either side

// One column of the table and the other witness' signal of the same name, at common samples.
struct Series {
  const TableColumnResult* result;
  std::string heading, unit;
  VecX table, other;
};

double RmsDeviation(const VecX& values) { return Rms((values.array() - values.mean()).matrix()); }

// An explanation of one column.
struct Explanation {
  enum class Kind {
    kSign,
    kFactor,
    kExchange,
    kOffset,
    kUnknownFactor,
    kEither,
    kOutliers,
    kDrift
  };
  Kind kind = Kind::kSign;
  double factor = 1.0, offset = 0.0;
  size_t partner = 0;                // index of the series that it looks like
  double left = kNan;                // RMS of the difference that stays
  std::vector<double> times_s = {};  // of outliers
  std::string text = {};             // of a drift
};

class Diagnosis {
 public:
  Diagnosis(const ComparisonInput& input, const Trace& other,
            const std::vector<TableColumnResult>& columns)
      : table_(*input.table), other_(other) {
    samples_ = AlignSamples(table_.trace, other);
    std::erase_if(samples_, [&](const auto& sample) {
      return table_.trace.time_s[static_cast<size_t>(sample.first)] < input.start_window_s;
    });
    for (const TableColumnResult& column : columns) series_.push_back(Read(column));
  }

  std::vector<std::string> Find() {
    if (samples_.size() < 4) return {};
    if (auto shifted = TimeShift()) return {*shifted};
    found_.resize(series_.size());
    for (size_t k = 0; k < series_.size(); ++k) {
      if (!series_[k].result->inside()) found_[k] = Explain(k);
    }
    return Texts();
  }

 private:
  [[nodiscard]] Series Read(const TableColumnResult& column) const {
    const TableColumn& source = table_.columns[column.column];
    Series series{.result = &column,
                  .heading = source.heading,
                  .unit = source.channel.unit,
                  .table = {},
                  .other = {}};
    const int from = other_.Find(column.channel);
    series.table.resize(static_cast<Eigen::Index>(samples_.size()));
    series.other = series.table;
    for (size_t i = 0; i < samples_.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      series.table(row) =
          table_.trace.values(samples_[i].first, static_cast<Eigen::Index>(column.column));
      series.other(row) = other_.values(samples_[i].second, from);
    }
    return series;
  }

  // What is left must be little of the difference, and near the tube or small.
  [[nodiscard]] bool IsGood(const Series& series, double left) const {
    const double difference = Rms(series.table - series.other);
    const double allowed =
        std::max(kTubes * series.result->tube_rms, kShare * RmsDeviation(series.table));
    return left <= kExplains * difference && left <= allowed;
  }

  [[nodiscard]] std::optional<Explanation> Explain(size_t k) const {
    const Series& series = series_[k];
    const auto good = [&](const Explanation& finding) { return IsGood(series, finding.left); };
    if (const Explanation sign = Scaled(series, -1.0); good(sign)) return sign;
    const double square = series.other.squaredNorm();
    const double factor = square > 0.0 ? series.table.dot(series.other) / square : kNan;
    Explanation scaled = Scaled(series, factor);
    scaled.kind = Explanation::Kind::kFactor;
    if (good(scaled) && FindFactor(std::abs(factor)) != nullptr) return scaled;
    if (const auto exchange = Exchanged(k)) return exchange;
    Explanation offset{.kind = Explanation::Kind::kOffset};
    offset.offset = (series.table - series.other).mean();
    offset.left = RmsDeviation(series.table - series.other);
    scaled.kind = Explanation::Kind::kUnknownFactor;
    if (good(offset) && good(scaled)) return Clearer(scaled, offset);
    if (good(offset)) return offset;
    if (good(scaled)) return scaled;
    if (auto outliers = Outliers(series)) return outliers;
    return Drifting(series);
  }

  // Of a signal that hardly varies, a factor and an added constant are the same.
  static Explanation Clearer(const Explanation& scaled, const Explanation& offset) {
    constexpr double kClearly = 0.5;
    if (scaled.left < kClearly * offset.left) return scaled;
    if (offset.left < kClearly * scaled.left) return offset;
    Explanation either = scaled;
    either.kind = Explanation::Kind::kEither;
    either.offset = offset.offset;
    return either;
  }

  [[nodiscard]] std::optional<Explanation> Drifting(const Series& series) const {
    VecX time_s(series.table.size());
    for (size_t i = 0; i < samples_.size(); ++i) {
      const auto row = static_cast<size_t>(samples_[i].first);
      time_s(static_cast<Eigen::Index>(i)) = table_.trace.time_s[row];
    }
    const auto drift = FindDrift(time_s, series.table - series.other, series.unit);
    if (!drift) return {};
    Explanation finding{.kind = Explanation::Kind::kDrift};
    finding.left = drift->left;
    finding.text = drift->text;
    return finding;
  }

  // A few rows that leave the tube of a single sample, while all others lie in the tubes.
  [[nodiscard]] std::optional<Explanation> Outliers(const Series& series) const {
    Explanation finding{.kind = Explanation::Kind::kOutliers};
    double sum2 = 0.0;
    for (size_t i = 0; i < samples_.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double error = series.table(row) - series.other(row);
      if (std::abs(error) <= series.result->tube_max) {
        sum2 += error * error;
      } else {
        finding.times_s.push_back(table_.trace.time_s[static_cast<size_t>(samples_[i].first)]);
      }
    }
    const size_t most = std::max<size_t>(1, samples_.size() / kOneOutlierIn);
    if (finding.times_s.empty() || finding.times_s.size() > most) return {};
    const auto rest = static_cast<double>(samples_.size() - finding.times_s.size());
    finding.left = std::sqrt(sum2 / rest);
    if (!(finding.left <= series.result->tube_rms)) return {};
    return finding;
  }

  static Explanation Scaled(const Series& series, double factor) {
    Explanation finding{.kind = Explanation::Kind::kSign, .factor = factor};
    finding.left = Rms(series.table - factor * series.other);
    return finding;
  }

  [[nodiscard]] std::string WordOf(const Series& series) const {
    return SignalWord(table_.trace.channels[series.result->column]);
  }

  // Another signal of the same kind that the column fits, with either sign.
  [[nodiscard]] std::optional<Explanation> Exchanged(size_t k) const {
    const Series& series = series_[k];
    std::optional<Explanation> best;
    for (size_t other = 0; other < series_.size(); ++other) {
      const Series& candidate = series_[other];
      // Only like signals are exchanged.
      if (other == k || candidate.unit != series.unit || WordOf(candidate) != WordOf(series)) {
        continue;
      }
      for (const double sign : {1.0, -1.0}) {
        Explanation finding{.kind = Explanation::Kind::kExchange, .factor = sign, .partner = other};
        finding.left = Rms(series.table - sign * candidate.other);
        if (IsGood(series, finding.left) && (!best || finding.left < best->left)) best = finding;
      }
    }
    return best;
  }

  [[nodiscard]] std::vector<std::string> Texts() const {
    std::vector<std::string> texts;
    std::vector<bool> said(series_.size(), false);
    for (size_t k = 0; k < series_.size(); ++k) {
      if (!found_[k] || said[k]) continue;
      const std::vector<size_t> same = Alike(k);
      for (const size_t other : same) said[other] = true;
      texts.push_back(TextOf(k, same, &said));
    }
    return texts;
  }

  // Columns with the same explanation, so that it is given once.
  [[nodiscard]] std::vector<size_t> Alike(size_t k) const {
    std::vector<size_t> same;
    for (size_t other = k; other < series_.size(); ++other) {
      if (!found_[other] || found_[other]->kind != found_[k]->kind) continue;
      const bool scale = found_[k]->kind == Explanation::Kind::kSign ||
                         found_[k]->kind == Explanation::Kind::kFactor;
      const bool equal = std::abs(found_[other]->factor / found_[k]->factor - 1.0) < kSameFactor;
      if (other == k || (scale && equal)) same.push_back(other);
    }
    return same;
  }

  [[nodiscard]] std::string Names(const std::vector<size_t>& same, bool headings) const {
    std::string text;
    for (size_t i = 0; i < std::min<size_t>(same.size(), 4); ++i) {
      const Series& series = series_[same[i]];
      text += i == 0 ? "" : ", ";
      text += headings ? "'" + series.heading + "'" : series.result->channel;
    }
    if (same.size() > 4) text += fmt::format(" and {} more", same.size() - 4);
    return text;
  }

  [[nodiscard]] std::string Left(size_t k) const {
    return fmt::format("what is left is {:.2g} {} RMS", found_[k]->left, series_[k].unit);
  }

  [[nodiscard]] std::string TextOf(size_t k, const std::vector<size_t>& same,
                                   std::vector<bool>* said) const {
    const Explanation& finding = *found_[k];
    const std::string& channel = series_[k].result->channel;
    const bool many = same.size() > 1;
    const std::string columns = fmt::format("column{} {}", many ? "s" : "", Names(same, true));
    switch (finding.kind) {
      case Explanation::Kind::kSign:
        return fmt::format("{} {} the negative of {}: sign? ({}: {{sign: -1}}; {})", columns,
                           many ? "are" : "is", Names(same, false), channel, Left(k));
      case Explanation::Kind::kFactor:
        return fmt::format("{} {} {} times a factor of {}{} ({})", columns, many ? "are" : "is",
                           Names(same, false), finding.factor < 0.0 ? "-" : "",
                           FindFactor(std::abs(finding.factor))->text, Left(k));
      case Explanation::Kind::kExchange:
        return ExchangeText(k, said);
      case Explanation::Kind::kOffset:
        return fmt::format(
            "{} is {} with {:.6g} {} added: a preload, a weight or a zero point? ({})", columns,
            channel, finding.offset, series_[k].unit, Left(k));
      case Explanation::Kind::kEither:
        return fmt::format(
            "{} is {:.6g} times {}, or {} with {:.6g} {} added: {} varies too little to "
            "distinguish them ({})",
            columns, finding.factor, channel, channel, finding.offset, series_[k].unit, channel,
            Left(k));
      case Explanation::Kind::kOutliers:
        return OutlierText(k);
      case Explanation::Kind::kDrift:
        return fmt::format("{} drifts away from {}: {}", columns, channel, finding.text);
      case Explanation::Kind::kUnknownFactor:
        return fmt::format("{} is {:.6g} times {}: a mass, a length or a gear ratio? ({})", columns,
                           finding.factor, channel, Left(k));
    }
    return "";
  }

  [[nodiscard]] std::string OutlierText(size_t k) const {
    const std::vector<double>& times_s = found_[k]->times_s;
    std::string at;
    for (size_t i = 0; i < std::min<size_t>(times_s.size(), 4); ++i) {
      at += fmt::format("{}{:.6g} s", i == 0 ? "" : ", ", times_s[i]);
    }
    if (times_s.size() > 4) at += ", …";
    return fmt::format(
        "column '{}' leaves the tube of {} in {} of {} rows only, at t = {}: are they "
        "outliers? ({})",
        series_[k].heading, series_[k].result->channel, times_s.size(), samples_.size(), at,
        Left(k));
  }

  [[nodiscard]] std::string ExchangeText(size_t k, std::vector<bool>* said) const {
    const Explanation& finding = *found_[k];
    const Series &series = series_[k], &partner = series_[finding.partner];
    const auto& back = found_[finding.partner];
    const char* negative = finding.factor < 0.0 ? " (and one sign is changed)" : "";
    if (back && back->kind == Explanation::Kind::kExchange && back->partner == k) {
      (*said)[finding.partner] = true;
      return fmt::format("{} and {} look exchanged{}: columns '{}' and '{}' ({})",
                         series.result->channel, partner.result->channel, negative, series.heading,
                         partner.heading, Left(k));
    }
    return fmt::format("column '{}', mapped to {}, looks like {}{} ({})", series.heading,
                       series.result->channel, partner.result->channel, negative, Left(k));
  }

  // All columns that leave their tubes, explained by one shift of the time.
  std::optional<std::string> TimeShift() {
    std::vector<size_t> moving;
    for (size_t k = 0; k < series_.size(); ++k) {
      if (!series_[k].result->inside() && RmsDeviation(series_[k].other) > 0.0) moving.push_back(k);
    }
    if (moving.empty() || other_.time_s.size() < 8) return {};
    const double span_s = other_.time_s.back() - other_.time_s.front();
    const double step_s = std::max(span_s / (4 * kShiftSteps), Step());
    const auto misfit = [&](double shift_s) { return Misfit(moving, shift_s); };
    double best_s = 0.0, best = misfit(0.0);
    const double unshifted = best;
    for (int k = -kShiftSteps; k <= kShiftSteps; ++k) {
      if (std::abs(k * step_s) > 0.25 * span_s) continue;
      const double value = misfit(k * step_s);
      if (value < best) {
        best = value;
        best_s = k * step_s;
      }
    }
    std::tie(best_s, best) = boost::math::tools::brent_find_minima(
        misfit, best_s - step_s, best_s + step_s, std::numeric_limits<double>::digits / 2);
    if (!(best <= kExplains * unshifted) || !AllFit(moving, best_s)) return {};
    if (LeavesOthers(best_s)) return {};
    return fmt::format(
        "the table is shifted by {:.4g} s: it is {} (time_offset_s: {:.4g} on top "
        "of what is stated)",
        std::abs(best_s), best_s > 0.0 ? "late" : "early", -best_s);
  }

  [[nodiscard]] double Step() const {
    return (other_.time_s.back() - other_.time_s.front()) /
           static_cast<double>(other_.time_s.size() - 1);
  }

  // The other witness' signal at time t by a cubic through four samples; NaN outside.
  [[nodiscard]] double OtherAt(int column, double t) const {
    const double position = (t - other_.time_s.front()) / Step();
    const auto last = static_cast<double>(other_.time_s.size() - 1);
    if (!(position >= 0.0 && position <= last)) return kNan;
    const double first = std::clamp(std::floor(position) - 1.0, 0.0, last - 3.0);
    double value = 0.0;
    for (int a = 0; a < 4; ++a) {
      double weight = 1.0;
      for (int b = 0; b < 4; ++b) {
        if (a != b) weight *= (position - first - b) / (a - b);
      }
      value += weight * other_.values(static_cast<Eigen::Index>(first) + a, column);
    }
    return value;
  }

  // RMS difference of one column when the other signal comes `shift_s` later.
  [[nodiscard]] double ShiftedRms(size_t k, double shift_s) const {
    const Series& series = series_[k];
    const int column = other_.Find(series.result->channel);
    double sum2 = 0.0, count = 0.0;
    const size_t stride = samples_.size() / kMostShifted + 1;
    for (size_t i = 0; i < samples_.size(); i += stride) {
      const double t = table_.trace.time_s[static_cast<size_t>(samples_[i].first)];
      const double value = OtherAt(column, t - shift_s);
      if (std::isnan(value)) continue;
      const double error = series.table(static_cast<Eigen::Index>(i)) - value;
      sum2 += error * error;
      count += 1.0;
    }
    return count > 0.0 ? std::sqrt(sum2 / count) : kNan;
  }

  // The columns together, each by its own scale.
  [[nodiscard]] double Misfit(const std::vector<size_t>& moving, double shift_s) const {
    double sum2 = 0.0;
    for (const size_t k : moving) {
      const double rms = ShiftedRms(k, shift_s) / RmsDeviation(series_[k].other);
      sum2 += rms * rms;
    }
    return std::sqrt(sum2 / static_cast<double>(moving.size()));
  }

  [[nodiscard]] bool AllFit(const std::vector<size_t>& moving, double shift_s) const {
    return std::all_of(moving.begin(), moving.end(),
                       [&](size_t k) { return IsGood(series_[k], ShiftedRms(k, shift_s)); });
  }

  // A shift of the time moves every column: one that is right as it is contradicts it.
  [[nodiscard]] bool LeavesOthers(double shift_s) const {
    for (size_t k = 0; k < series_.size(); ++k) {
      const Series& series = series_[k];
      if (!series.result->inside()) continue;
      const double as_is = Rms(series.table - series.other);
      const double most = std::max(kTubes * series.result->tube_rms, kTubes * as_is);
      if (ShiftedRms(k, shift_s) > most) return true;
    }
    return false;
  }

  const AlignedTable& table_;
  const Trace& other_;
  CommonSamples samples_;
  std::vector<Series> series_;
  std::vector<std::optional<Explanation>> found_;
};

}  // namespace

std::vector<std::string> DiagnoseTable(const ComparisonInput& input, const Trace& other,
                                       const std::vector<TableColumnResult>& columns) {
  const bool any = std::any_of(columns.begin(), columns.end(),
                               [](const TableColumnResult& column) { return !column.inside(); });
  if (!any) return {};
  return Diagnosis(input, other, columns).Find();
}

namespace {

constexpr Eigen::Index kFewest = 16;  // samples
constexpr double kLine = 0.1;         // of the difference, left beside a line
constexpr double kGrowth = 1.5;       // from each quarter of the samples to the next

}  // namespace

std::optional<GrowingDifference> FindDrift(const VecX& time_s, const VecX& difference,
                                           const std::string& unit) {
  const Eigen::Index n = difference.size();
  if (n < kFewest) return {};
  const VecX t = time_s.array() - time_s.mean();
  const double rate = t.dot(difference) / t.squaredNorm();
  const VecX line = (difference.mean() + rate * t.array()).matrix();
  const double left = Rms(difference - line), all = Rms(difference);
  if (left <= kLine * all) {
    return GrowingDifference{
        left, fmt::format("the difference grows by {:.4g} {}/s, from {:.2g} to {:.2g} {}: a "
                          "sensor's zero, or an integration? (what is left is {:.2g} {} RMS)",
                          rate, unit, line(0), line(n - 1), unit, left, unit)};
  }
  std::array<double, 4> quarters;
  for (Eigen::Index k = 0; k < 4; ++k) {
    const Eigen::Index from = k * n / 4;
    quarters[static_cast<size_t>(k)] = Rms(difference.segment(from, (k + 1) * n / 4 - from));
  }
  for (size_t k = 1; k < 4; ++k) {
    if (!(quarters[k] >= kGrowth * quarters[k - 1])) return {};
  }
  return GrowingDifference{
      all, fmt::format("the difference grows from {:.2g} {} RMS in the first quarter of "
                       "the samples to {:.2g} {} in the last: errors of an integration "
                       "that add up, or a clock of another rate?",
                       quarters[0], unit, quarters[3], unit)};
}

}  // namespace mbv
