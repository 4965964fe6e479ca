// A table's rows on the grid of a scenario.

#include "scenario/tables/table.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "base/roles.h"

namespace mbv {
namespace {

constexpr double kMedianOfNormal = 0.6744897501960817;  // median |x| of a normal distribution
constexpr size_t kMostLooked = 4000;                    // rows; enough for a median
constexpr int kMostNeighbours = 10;

double Median(std::vector<double>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

// Lagrange weights that predict row i from `count` neighbours, half of them on each side.
void Weights(std::span<const double> time_s, size_t i, int count,
             std::array<double, kMostNeighbours>* weights) {
  const auto row = [&](int k) {
    const int half = count / 2;
    return i + static_cast<size_t>(k < half ? k : k + 1) - static_cast<size_t>(half);
  };
  for (int a = 0; a < count; ++a) {
    double weight = 1.0;
    for (int b = 0; b < count; ++b) {
      if (a == b) continue;
      weight *= (time_s[i] - time_s[row(b)]) / (time_s[row(a)] - time_s[row(b)]);
    }
    (*weights)[static_cast<size_t>(a)] = weight;
  }
}

}  // namespace

std::vector<double> EstimateNoise(std::span<const double> time_s, const MatX& values) {
  const size_t rows = time_s.size();
  const auto columns = static_cast<size_t>(values.cols());
  if (rows < kFewestForNoise) return std::vector<double>(columns, 0.0);
  std::vector<double> noise(columns, std::numeric_limits<double>::infinity());
  std::array<double, kMostNeighbours> weights{};
  for (int count = 2; count <= kMostNeighbours; count += 2) {
    const auto half = static_cast<size_t>(count / 2);
    const size_t stride = rows / kMostLooked + 1;
    std::vector<std::vector<double>> errors(columns);
    for (size_t i = half; i + half < rows; i += stride) {
      Weights(time_s, i, count, &weights);
      double sum2 = 1.0;
      for (int k = 0; k < count; ++k) sum2 += weights[k] * weights[k];
      for (size_t c = 0; c < columns; ++c) {
        const auto column = static_cast<Eigen::Index>(c);
        double error = values(static_cast<Eigen::Index>(i), column);
        for (size_t k = 0; k < static_cast<size_t>(count); ++k) {
          const size_t row = i - half + k + (k < half ? 0 : 1);
          error -= weights[k] * values(static_cast<Eigen::Index>(row), column);
        }
        errors[c].push_back(std::abs(error) / std::sqrt(sum2));
      }
    }
    for (size_t c = 0; c < columns; ++c) {
      noise[c] = std::min(noise[c], Median(&errors[c]) / kMedianOfNormal);
    }
  }
  return noise;
}

namespace {

constexpr double kSameTime_s = 1e-9;  // as in the comparison
constexpr int kMostDecimals = 9;
constexpr double kNoiseReach = 2.5;  // deviations that a single sample may be off

// Whole multiples of 10^-decimals, if all times are.
struct Stamps {
  int decimals = -1;
  std::vector<int64_t> counts;
};

Stamps FindStamps(const std::vector<double>& time_s) {
  Stamps stamps;
  double unit = 1.0;
  for (int decimals = 0; decimals <= kMostDecimals; ++decimals, unit *= 10.0) {
    const bool whole = std::all_of(time_s.begin(), time_s.end(), [unit](double t) {
      const double count = t * unit;
      return std::abs(count) < 1e15 && std::abs(count - std::round(count)) <= 1e-6;
    });
    if (!whole) continue;
    stamps.decimals = decimals;
    for (const double t : time_s) {
      stamps.counts.push_back(static_cast<int64_t>(std::llround(t * unit)));
    }
    return stamps;
  }
  return stamps;
}

double MedianStep(const std::vector<double>& time_s) {
  std::vector<double> steps;
  for (size_t i = 1; i < time_s.size(); ++i) steps.push_back(time_s[i] - time_s[i - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

// Largest distance of the times from equal steps between the first and the last.
double Unevenness(const std::vector<double>& time_s, double spacing_s) {
  double worst = 0.0;
  for (size_t i = 0; i < time_s.size(); ++i) {
    worst = std::max(worst, std::abs(time_s[i] - time_s[0] - static_cast<double>(i) * spacing_s));
  }
  return worst;
}

// 1, 2 or 5 times a power of ten, at or below x.
double RoundDown125(double x) {
  const double power = std::pow(10.0, std::floor(std::log10(x) + 1e-9));
  for (const double digit : {5.0, 2.0}) {
    if (digit * power <= x * (1.0 + 1e-9)) return digit * power;
  }
  return power;
}

// Polynomial through `points` rows around `t` (in time order), evaluated at t, for all columns.
void Interpolate(const std::vector<double>& times, const MatX& values, double t, size_t points,
                 VecX* result) {
  const auto above =
      static_cast<size_t>(std::lower_bound(times.begin(), times.end(), t) - times.begin());
  const size_t wanted = above > points / 2 ? above - points / 2 : 0;
  const size_t first = std::min(wanted, times.size() - points);
  result->setZero(values.cols());
  for (size_t a = first; a < first + points; ++a) {
    double weight = 1.0;
    for (size_t b = first; b < first + points; ++b) {
      if (a != b) weight *= (t - times[b]) / (times[a] - times[b]);
    }
    *result += weight * values.row(static_cast<Eigen::Index>(a)).transpose();
  }
}

class Aligner {
 public:
  Aligner(const ReferenceTable& table, const Motion& motion)
      : table_(table), motion_(motion), times_(TrueTimes(table)) {}

  AlignedTable Align() {
    out_.name = table_.name;
    out_.coverage = table_.coverage;
    out_.coarsest = table_.coarsest;
    out_.columns = table_.columns;
    out_.notes = table_.notes;
    out_.trace.witness = role::kReference.name;
    if (!TakeRows()) InterpolateRows();
    AddUncertainty();
    AddRangeNotes();
    if (out_.trace.time_s.empty()) {
      out_.grid = fmt::format(
          "no row of {} lies inside the motion, 0 … {:g} s: it runs from {:g} to {:g} s{}",
          table_.name, motion_.duration_s, times_.front(), times_.back(), OffsetHint());
    }
    return std::move(out_);
  }

 private:
  [[nodiscard]] std::vector<Channel> Channels() const {
    std::vector<Channel> channels;
    for (const TableColumn& column : table_.columns) channels.push_back(column.channel);
    return channels;
  }

  // Rows that lie on the grid; false if one does not.
  bool TakeRows() {
    const double tolerance = std::max(kSameTime_s, 1.05 * table_.stamp_error_s);
    std::vector<double> grid;
    std::vector<size_t> rows;
    double last = -1.0;
    for (size_t i = 0; i < times_.size(); ++i) {
      const double sample = std::round(times_[i] / motion_.sample_s);
      const double on_grid = sample * motion_.sample_s;
      if (times_[i] < -tolerance || times_[i] > motion_.duration_s + tolerance) continue;
      if (std::abs(times_[i] - on_grid) > tolerance || sample <= last) return false;
      last = sample;
      grid.push_back(on_grid);
      rows.push_back(i);
    }
    out_.trace.Reset(std::move(grid), Channels());
    steps_.resizeLike(out_.trace.values);
    interpolation_.setZero(out_.trace.values.rows(), out_.trace.values.cols());
    for (size_t k = 0; k < rows.size(); ++k) {
      const auto to = static_cast<Eigen::Index>(k), from = static_cast<Eigen::Index>(rows[k]);
      out_.trace.values.row(to) = table_.values.row(from);
      steps_.row(to) = table_.steps.row(from);
    }
    left_out_ = times_.size() - rows.size();
    out_.grid = fmt::format(
        "{} of {} rows lie on the samples of the scenario (every {:g} ms); nothing is interpolated",
        rows.size(), times_.size(), 1e3 * motion_.sample_s);
    return true;
  }

  void InterpolateRows() {
    out_.interpolated = true;
    std::vector<double> grid;
    for (const double t : SampleTimes(motion_.duration_s, motion_.sample_s)) {
      if (t >= times_.front() - kSameTime_s && t <= times_.back() + kSameTime_s) grid.push_back(t);
    }
    out_.trace.Reset(std::move(grid), Channels());
    steps_.resizeLike(out_.trace.values);
    interpolation_.resizeLike(out_.trace.values);
    const size_t cubic = std::min<size_t>(4, times_.size());
    const size_t quintic = std::min<size_t>(6, times_.size());
    const size_t low = cubic == quintic ? cubic - 1 : cubic;
    VecX value, other;
    for (size_t k = 0; k < out_.trace.time_s.size(); ++k) {
      const double t = out_.trace.time_s[k];
      const auto row = static_cast<Eigen::Index>(k);
      Interpolate(times_, table_.values, t, cubic, &value);
      Interpolate(times_, table_.values, t, cubic == quintic ? low : quintic, &other);
      out_.trace.values.row(row) = value.transpose();
      interpolation_.row(row) = (value - other).cwiseAbs().transpose();
      steps_.row(row) = table_.steps.row(NearestRow(t));
    }
    out_.grid = fmt::format(
        "the {} rows do not lie on the samples of the scenario (every {:g} ms); they are "
        "interpolated by cubic polynomials, and the difference to quintic ones is part of the "
        "uncertainty",
        times_.size(), 1e3 * motion_.sample_s);
  }

  [[nodiscard]] Eigen::Index NearestRow(double t) const {
    const auto above = std::lower_bound(times_.begin(), times_.end(), t);
    if (above == times_.end()) return static_cast<Eigen::Index>(times_.size()) - 1;
    const auto i = above - times_.begin();
    return i > 0 && t - times_[static_cast<size_t>(i - 1)] < *above - t ? i - 1 : i;
  }

  void AddUncertainty() {
    const Trace& trace = out_.trace;
    out_.standard.setZero(trace.values.rows(), trace.values.cols());
    out_.bound = out_.standard;
    for (Eigen::Index c = 0; c < trace.values.cols(); ++c) {
      const TableColumn& column = table_.columns[static_cast<size_t>(c)];
      if (column.tolerance) {
        // Stated: what a sample may be off by. The coverage is taken off, because limits put it on.
        const double largest = table_.values.col(c).cwiseAbs().maxCoeff();
        const double stated = column.tolerance->absolute + column.tolerance->relative * largest;
        out_.standard.col(c).setConstant(stated / table_.coverage);
        out_.bound.col(c).setConstant(stated / table_.coverage);
        out_.uncertainty.push_back({.stated = true});
      } else {
        EstimateColumn(c, column.noise);
      }
    }
  }

  void EstimateColumn(Eigen::Index c, double noise) {
    const Trace& trace = out_.trace;
    TableUncertainty parts;
    const auto rows = trace.values.rows();
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double digits = steps_(i, c) / std::sqrt(12.0);
      // The residual that shows the noise holds the rounding, too.
      const double own_noise = std::sqrt(std::max(0.0, noise * noise - digits * digits));
      const double stamp = std::abs(Slope(i, c)) * table_.stamp_error_s;
      const double between = interpolation_(i, c);
      out_.standard(i, c) = std::sqrt(digits * digits + own_noise * own_noise +
                                      stamp * stamp / 3.0 + between * between);
      out_.bound(i, c) = 0.5 * steps_(i, c) + kNoiseReach * own_noise + stamp + between;
      parts.digits += digits * digits;
      parts.noise += own_noise * own_noise;
      parts.stamps += stamp * stamp / 3.0;
      parts.interpolation += between * between;
    }
    for (double* part : {&parts.digits, &parts.noise, &parts.stamps, &parts.interpolation}) {
      *part = rows == 0 ? kNan : std::sqrt(*part / static_cast<double>(rows));
    }
    out_.uncertainty.push_back(parts);
  }

  // Central difference over the trace's own samples.
  [[nodiscard]] double Slope(Eigen::Index i, Eigen::Index c) const {
    const Trace& trace = out_.trace;
    const auto last = trace.values.rows() - 1;
    const Eigen::Index a = std::max<Eigen::Index>(i - 1, 0), b = std::min(i + 1, last);
    if (a == b) return 0.0;
    return (trace.values(b, c) - trace.values(a, c)) /
           (trace.time_s[static_cast<size_t>(b)] - trace.time_s[static_cast<size_t>(a)]);
  }

  void AddRangeNotes() {
    if (left_out_ > 0) {
      out_.notes.push_back(fmt::format("{} of {} rows lie outside the motion (0 … {:g} s)",
                                       left_out_, times_.size(), motion_.duration_s));
    }
    const double gap = 1.5 * std::max(motion_.sample_s, table_.spacing_s);
    if (times_.front() > gap || times_.back() < motion_.duration_s - gap) {
      out_.notes.push_back(
          fmt::format("it covers {:g} … {:g} s of the motion's 0 … {:g} s{}",
                      std::max(times_.front(), 0.0), std::min(times_.back(), motion_.duration_s),
                      motion_.duration_s, times_.front() > gap ? OffsetHint() : ""));
    }
    if (table_.stamp_error_s > 0.0) {
      out_.notes.push_back(
          fmt::format("its time stamps are rounded to {:.2g} s", 2.0 * table_.stamp_error_s));
    }
  }

  // Clocks of other programs often run before the motion starts.
  [[nodiscard]] std::string OffsetHint() const {
    return fmt::format(
        "; if the motion starts with its first row, add time_offset_s: {:g} to what is stated",
        -times_.front());
  }

  const ReferenceTable& table_;
  const Motion& motion_;
  const std::vector<double> times_;
  AlignedTable out_;
  MatX steps_, interpolation_;  // as out_.trace.values
  size_t left_out_ = 0;
};

// Equal steps but for a few that leave rows out.
bool HasHoles(const std::vector<int64_t>& counts) {
  constexpr size_t kStepsPerHole = 20;
  std::vector<int64_t> steps;
  for (size_t i = 1; i < counts.size(); ++i) steps.push_back(counts[i] - counts[i - 1]);
  std::vector<int64_t> sorted = steps;
  std::sort(sorted.begin(), sorted.end());
  const int64_t usual = sorted[sorted.size() / 2];
  const auto others = static_cast<size_t>(
      std::count_if(steps.begin(), steps.end(), [&](int64_t step) { return step != usual; }));
  return usual > 0 && others > 0 && others * kStepsPerHole <= steps.size() &&
         std::all_of(steps.begin(), steps.end(), [&](int64_t step) { return step % usual == 0; });
}

}  // namespace

void DescribeTimes(ReferenceTable* table) {
  const std::vector<double>& time_s = table->time_s;
  const auto intervals = static_cast<double>(time_s.size() - 1);
  const Stamps stamps = FindStamps(time_s);
  table->spacing_s = (time_s.back() - time_s.front()) / intervals;
  const double unevenness = Unevenness(time_s, table->spacing_s);
  if (stamps.decimals < 0) {
    // Printed with many digits: equal steps up to round-off, or not.
    table->uniform = unevenness <= std::max(kSameTime_s, 1e-6 * table->spacing_s);
    if (!table->uniform) table->spacing_s = MedianStep(time_s);
    return;
  }
  const double unit = std::pow(10.0, stamps.decimals);
  int64_t common = 0;
  bool equal = true;
  for (size_t i = 1; i < stamps.counts.size(); ++i) {
    const int64_t step = stamps.counts[i] - stamps.counts[i - 1];
    common = std::gcd(common, step);
    equal = equal && step == stamps.counts[1] - stamps.counts[0];
  }
  if (HasHoles(stamps.counts)) {
    table->spacing_s = MedianStep(time_s);
    return;
  }
  // Stamps rounded to `unit` around equal steps are off by one unit at most, endpoints included.
  table->uniform = equal || unevenness <= 1.01 / unit;
  if (equal) {
    table->spacing_s = static_cast<double>(stamps.counts[1] - stamps.counts[0]) / unit;
  } else if (table->uniform) {
    table->stamp_error_s = std::max(0.5 / unit, unevenness);
  } else {
    table->spacing_s = MedianStep(time_s);
    if (common == 1) table->stamp_error_s = 0.5 / unit;
  }
}

std::vector<double> TrueTimes(const ReferenceTable& table) {
  std::vector<double> times = table.time_s;
  if (!table.uniform) return times;
  for (size_t i = 0; i < times.size(); ++i) {
    times[i] = table.time_s[0] + static_cast<double>(i) * table.spacing_s;
  }
  return times;
}

double SuggestSample(const ReferenceTable& table) {
  const double tolerance = std::max(kSameTime_s, table.stamp_error_s);
  if (table.uniform) {
    // The start may lie between samples: then a part of the step.
    for (int parts = 1; parts <= 20; ++parts) {
      const double sample_s = table.spacing_s / parts;
      const double start = table.time_s[0] / sample_s;
      if (std::abs(start - std::round(start)) * sample_s <= tolerance) return sample_s;
    }
  } else if (const Stamps stamps = FindStamps(table.time_s); stamps.decimals >= 0) {
    int64_t common = 0;
    for (const int64_t count : stamps.counts) common = std::gcd(common, count);
    const auto rows = static_cast<double>(stamps.counts.size());
    const double samples = static_cast<double>(stamps.counts.back()) / static_cast<double>(common);
    if (samples <= std::max(20.0 * rows, 2000.0)) {
      return static_cast<double>(common) / std::pow(10.0, stamps.decimals);
    }
  }
  return RoundDown125(table.spacing_s);
}

AlignedTable AlignTable(const ReferenceTable& table, const Motion& motion) {
  return Aligner(table, motion).Align();
}

}  // namespace mbv
