#include "features/study/summary.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <charconv>
#include <cmath>

#include "base/demand.h"
#include "base/text.h"
#include "base/types.h"

namespace mbv {

double Percentile(std::span<const double> sorted, double share) {
  if (sorted.empty()) return kNan;
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<size_t>(at);
  if (below + 1 >= sorted.size()) return sorted.back();
  const double part = at - static_cast<double>(below);
  return sorted[below] + part * (sorted[below + 1] - sorted[below]);
}

Interval ClopperPearson(std::uint64_t hits, std::uint64_t count, double confidence) {
  using Binomial = boost::math::binomial_distribution<double>;
  if (count == 0) return {};
  const double beyond = (1.0 - confidence) / 2.0;
  const auto n = static_cast<double>(count), k = static_cast<double>(hits);
  return {hits == 0 ? 0.0 : Binomial::find_lower_bound_on_p(n, k, beyond),
          hits == count ? 1.0 : Binomial::find_upper_bound_on_p(n, k, beyond)};
}

Histogram HistogramOf(std::span<const double> sorted) {
  constexpr double kFewest = 5, kMost = 60;
  if (sorted.empty()) return {};
  Histogram histogram{sorted.front(), sorted.back(), {}};
  const double range = histogram.to - histogram.from;
  const double middle = Percentile(sorted, 0.75) - Percentile(sorted, 0.25);
  const double width = 2.0 * middle / std::cbrt(static_cast<double>(sorted.size()));
  const double bins = width > 0.0 ? std::clamp(std::ceil(range / width), kFewest, kMost) : kFewest;
  histogram.counts.assign(range > 0.0 ? static_cast<size_t>(bins) : 1, 0);
  for (const double value : sorted) {
    const double at = range > 0.0 ? (value - histogram.from) / range * bins : 0.0;
    ++histogram.counts[std::min(static_cast<size_t>(at), histogram.counts.size() - 1)];
  }
  return histogram;
}

namespace {

// What a block a, b, ab_0, ab_1 … adds to the parts of number i.
double FirstOf(const double* block, size_t i) { return block[1] * (block[2 + i] - block[0]); }
double TotalOf(const double* block, size_t i) {
  return 0.5 * (block[0] - block[2 + i]) * (block[0] - block[2 + i]);
}

// Sums over blocks, from which all estimates follow.
struct BlockSums {
  explicit BlockSums(size_t numbers) : first(numbers, 0.0), total(numbers, 0.0) {}

  // a, b and ab_i of one block.
  void Add(const double* block) {
    const double a = block[0], b = block[1];
    sum += a + b;
    squares += a * a + b * b;
    for (size_t i = 0; i < first.size(); ++i) {
      first[i] += FirstOf(block, i);
      total[i] += TotalOf(block, i);
    }
    ++count;
  }
  [[nodiscard]] double mean() const { return sum / (2.0 * static_cast<double>(count)); }
  [[nodiscard]] double variance() const {
    return squares / (2.0 * static_cast<double>(count)) - mean() * mean();
  }
  [[nodiscard]] double Share(double of) const {
    return of / static_cast<double>(count) / variance();
  }

  double sum = 0.0, squares = 0.0;
  std::vector<double> first, total;
  size_t count = 0;
};

// Complete blocks, their values less the mean.
struct CentredBlocks {
  CentredBlocks(std::span<const double> all, size_t block_width) : width(block_width) {
    double sum = 0.0;
    for (size_t n = 0; (n + 1) * width <= all.size(); ++n) {
      const std::span<const double> block = all.subspan(n * width, width);
      if (!std::ranges::all_of(block, [](double v) { return std::isfinite(v); })) continue;
      values.insert(values.end(), block.begin(), block.end());
      replicate.push_back(n % kReplicates);
      sum += block[0] + block[1];
    }
    mean = sum / (2.0 * static_cast<double>(count()));
    for (double& value : values) value -= mean;
  }

  [[nodiscard]] size_t count() const { return replicate.size(); }
  [[nodiscard]] const double* At(size_t n) const { return &values[n * width]; }

  size_t width;
  double mean = kNan;
  std::vector<double> values;
  std::vector<size_t> replicate;  // per block
};

// 95 %, of a ratio of means S = Σ f/Σ v: each replicate's share of Σ (f − S v)/Σ v, whose sum is 0,
// is an independent error of S to the first order, and Student's t says how often so few of them
// stray how far.
template <typename Numerator>
Interval IntervalOf(double ratio, const CentredBlocks& blocks, const Numerator& f) {
  std::array<double, kReplicates> error{};
  std::array<bool, kReplicates> has{};
  double all = 0.0;
  for (size_t n = 0; n < blocks.count(); ++n) {
    const double* block = blocks.At(n);
    const double v = 0.5 * (block[0] * block[0] + block[1] * block[1]);
    error[blocks.replicate[n]] += f(block) - ratio * v;
    has[blocks.replicate[n]] = true;
    all += v;
  }
  const auto replicates = static_cast<double>(std::ranges::count(has, true));
  if (replicates < 2.0) return {};
  double squares = 0.0;
  for (const double e : error) squares += e / all * (e / all);
  const double deviation = std::sqrt(squares * replicates / (replicates - 1.0));
  const double t = boost::math::quantile(boost::math::students_t(replicates - 1.0), 0.975);
  return {ratio - t * deviation, ratio + t * deviation};
}

}  // namespace

SobolResult SobolIndices(std::span<const double> values, size_t numbers) {
  const size_t width = numbers + 2;
  MBV_DEMAND(numbers > 0 && values.size() % width == 0, values.size());
  SobolResult result;
  result.indices.resize(numbers);
  const CentredBlocks blocks(values, width);
  result.mean = blocks.mean;
  result.blocks = blocks.count();
  result.left_out = values.size() / width - result.blocks;
  if (result.blocks < 2) return result;
  BlockSums sums(numbers);
  for (size_t n = 0; n < result.blocks; ++n) sums.Add(blocks.At(n));
  result.variance = sums.variance();
  // Round-off of a constant is no variance.
  constexpr double kRoundoff = 1e-14;
  const double scale = kRoundoff * std::abs(result.mean);
  if (!(result.variance > scale * scale)) return result;
  for (size_t i = 0; i < numbers; ++i) {
    SobolIndex& index = result.indices[i];
    index.first = sums.Share(sums.first[i]);
    index.total = sums.Share(sums.total[i]);
    index.first_interval =
        IntervalOf(index.first, blocks, [i](const double* block) { return FirstOf(block, i); });
    index.total_interval =
        IntervalOf(index.total, blocks, [i](const double* block) { return TotalOf(block, i); });
  }
  return result;
}

namespace {

// In 17 digits, as "{:.17g}"; nothing for what is not a number.
void AppendNumber(double value, std::string* text) {
  if (!std::isfinite(value)) return;
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                 std::chars_format::general, 17);
  MBV_DEMAND(end.ec == std::errc(), value);
  text->append(digits.data(), end.ptr);
}

// The fields of a row, one after the other.
class RowFields {
 public:
  explicit RowFields(std::string_view line) : line_(line) {}

  // False where fields remain.
  [[nodiscard]] bool done() const { return !more_; }
  // Empty at the end and where quotes are not closed. Until the next call.
  std::optional<std::string_view> Next() {
    if (!more_) return {};
    if (!line_.empty() && line_.front() == '"') return Quoted();
    const size_t end = std::min(line_.find(','), line_.size());
    const std::string_view field = line_.substr(0, end);
    return Advance(end) ? std::optional(field) : std::nullopt;
  }
  template <typename Number>
  std::optional<Number> NextNumber() {
    const auto field = Next();
    Number number{};
    if (!field) return {};
    const char* end = field->data() + field->size();
    const auto [at, error] = std::from_chars(field->data(), end, number);
    if (error != std::errc() || at != end) return {};
    return number;
  }
  // Empty fields are NaN.
  bool NextNumbers(size_t count, std::vector<double>* numbers) {
    numbers->reserve(count);
    for (size_t k = 0; k < count; ++k) {
      const bool empty = line_.empty() || line_.front() == ',';
      const auto number = empty && Next() ? std::optional(kNan) : NextNumber<double>();
      if (!number) return false;
      numbers->push_back(*number);
    }
    return true;
  }

 private:
  std::optional<std::string_view> Quoted() {
    unquoted_.clear();
    size_t at = 1;
    for (;; ++at) {
      if (at >= line_.size()) return {};
      if (line_[at] == '"' && (at + 1 >= line_.size() || line_[at + 1] != '"')) break;
      if (line_[at] == '"') ++at;
      unquoted_ += line_[at];
    }
    return Advance(at + 1) ? std::optional<std::string_view>(unquoted_) : std::nullopt;
  }
  // Over the comma at `at`; false where there is something else.
  bool Advance(size_t at) {
    more_ = at < line_.size() && line_[at] == ',';
    if (!more_ && at < line_.size()) return false;
    line_.remove_prefix(more_ ? at + 1 : at);
    return true;
  }

  std::string_view line_;
  bool more_ = true;
  std::string unquoted_;
};

}  // namespace

std::string PointHeader(const Study& study) {
  std::string text = "point,seed,exit,reason";
  for (const Factor& factor : study.factors) text += "," + CsvCell(factor.name);
  for (const StudyQuantity& quantity : study.quantities) text += "," + CsvCell(quantity.name);
  return text + "\n";
}

std::string PointLine(const PointRow& row, const Study& study) {
  std::string text =
      fmt::format("{},{},{},{}", row.point, study.design.seed, row.exit_code, CsvCell(row.reason));
  for (const std::vector<double>* numbers : {&row.varied, &row.values}) {
    for (const double value : *numbers) {
      text += ',';
      AppendNumber(value, &text);
    }
  }
  text += '\n';
  return text;
}

std::optional<PointRow> ReadPointLine(std::string_view line, const Study& study) {
  RowFields fields(line);
  const auto point = fields.NextNumber<std::uint64_t>();
  const auto seed = fields.NextNumber<std::uint64_t>();
  const auto exit_code = fields.NextNumber<int>();
  const auto reason = fields.Next();
  if (!point || seed != study.design.seed || !exit_code || !reason) return {};
  PointRow row{
      .point = *point, .exit_code = *exit_code, .reason = std::string(*reason), .varied = {}};
  if (!fields.NextNumbers(study.factors.size(), &row.varied)) return {};
  if (!fields.NextNumbers(study.quantities.size(), &row.values)) return {};
  if (!fields.done()) return {};
  return row;
}

namespace {

// How bad a value is: beyond its limit, or else far from nominal.
double Badness(const StudyLimit* limit, double nominal, double value) {
  if (limit == nullptr) return std::abs(value - nominal);
  const double above = limit->below ? value - *limit->below : -HUGE_VAL;
  const double below = limit->above ? *limit->above - value : -HUGE_VAL;
  return std::max(above, below);
}

class WorstList {
 public:
  WorstList(const StudyLimit* limit, double nominal) : limit_(limit), nominal_(nominal) {}

  void Add(const PointRow& row, double value) {
    if (!std::isfinite(value)) return;
    const double bad = Badness(limit_, nominal_, value);
    const auto at = std::find_if(list_.begin(), list_.end(), [&](const WorstPoint& w) {
      return bad > Badness(limit_, nominal_, w.value);
    });
    if (at == list_.end() && list_.size() == kWorstPoints) return;
    list_.insert(at, {row.point, value, row.varied});
    if (list_.size() > kWorstPoints) list_.pop_back();
  }
  [[nodiscard]] std::vector<WorstPoint> Take() { return std::move(list_); }

 private:
  const StudyLimit* limit_;
  double nominal_;
  std::vector<WorstPoint> list_;
};

void AddMoments(const std::vector<double>& sorted, QuantitySummary* summary) {
  if (sorted.empty()) return;
  const auto count = static_cast<double>(sorted.size());
  double sum = 0.0, squares = 0.0;
  for (const double value : sorted) sum += value;
  summary->mean = sum / count;
  for (const double value : sorted) squares += std::pow(value - summary->mean, 2);
  if (sorted.size() > 1) summary->deviation = std::sqrt(squares / (count - 1.0));
  summary->least = sorted.front();
  summary->most = sorted.back();
  summary->p50 = Percentile(sorted, 0.50);
  if (sorted.size() >= kFewestForPercentiles) {
    summary->p5 = Percentile(sorted, 0.05);
    summary->p95 = Percentile(sorted, 0.95);
  }
  summary->histogram = HistogramOf(sorted);
}

// Point 0 is nominal, then come each number's excursions.
std::vector<Swing> SwingsOf(const Study& study, const std::vector<double>& values) {
  std::vector<Swing> swings;
  size_t at = 1;
  for (size_t k = 0; k < study.factors.size(); ++k) {
    const size_t count = Excursions(study.factors[k].axis.distribution).size();
    Swing swing{k, values.front(), values.front()};
    for (size_t i = at; i < std::min(at + count, values.size()); ++i) {
      swing.lowest = std::fmin(swing.lowest, values[i]);
      swing.highest = std::fmax(swing.highest, values[i]);
    }
    swings.push_back(swing);
    at += count;
  }
  const auto width = [](const Swing& s) {
    return std::isnan(s.highest) ? -1.0 : s.highest - s.lowest;
  };
  std::stable_sort(swings.begin(), swings.end(),
                   [&](const Swing& a, const Swing& b) { return width(a) > width(b); });
  return swings;
}

QuantitySummary SummariseQuantity(const Study& study, size_t k, double nominal,
                                  const PointRows& rows) {
  QuantitySummary summary;
  summary.name = study.quantities[k].name;
  summary.nominal = nominal;
  const auto limit = std::find_if(study.limits.begin(), study.limits.end(),
                                  [&](const StudyLimit& l) { return l.quantity == k; });
  WorstList worst(limit == study.limits.end() ? nullptr : &*limit, nominal);
  std::vector<double> values;
  rows([&](const PointRow& row) {
    values.push_back(row.values[k]);
    worst.Add(row, row.values[k]);
  });
  summary.worst = worst.Take();
  if (study.design.kind == DesignKind::kSaltelli) {
    summary.sobol = SobolIndices(values, study.factors.size());
  }
  if (study.design.kind == DesignKind::kOneAtATime && !values.empty()) {
    summary.swings = SwingsOf(study, values);
  }
  const size_t all = values.size();
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  summary.count = values.size();
  summary.missing = all - values.size();
  std::sort(values.begin(), values.end());
  AddMoments(values, &summary);
  return summary;
}

}  // namespace

bool StudySummary::within_limits() const {
  return disagreed == 0 && few_missing() &&
         std::all_of(limits.begin(), limits.end(), [](const LimitResult& l) { return l.pass(); });
}

double WidestInterval(const StudySummary& summary) {
  double widest = kNan;
  const auto take = [&](const Interval& interval) {
    widest = std::fmax(widest, interval.upper - interval.lower);
  };
  for (const LimitResult& limit : summary.limits) take(limit.interval);
  for (const QuantitySummary& quantity : summary.quantities) {
    if (!quantity.sobol) continue;
    for (const SobolIndex& index : quantity.sobol->indices) {
      take(index.first_interval);
      take(index.total_interval);
    }
  }
  return widest;
}

StudySummary SummariseStudy(const Study& study, const std::vector<double>& nominal,
                            const PointRows& rows) {
  StudySummary summary;
  summary.missing = study.missing;
  for (const StudyLimit& limit : study.limits)
    summary.limits.push_back({.limit = limit, .interval = {}});
  rows([&](const PointRow& row) {
    ++summary.points;
    const bool asked = row.reason.empty() || !study.missing;
    for (LimitResult& result : summary.limits) {
      if (!asked) break;
      ++result.count;
      if (!result.limit.Keeps(row.values[result.limit.quantity])) ++result.violations;
    }
    if (row.reason.empty() && row.exit_code == 1) {
      ++summary.disagreed;
      if (summary.first_disagreed.size() < kWorstPoints) summary.first_disagreed.push_back(row);
    }
    if (row.reason.empty()) return;
    ++summary.failed;
    const bool known = summary.reasons.contains(row.reason) || summary.reasons.size() < kReasons;
    ++summary.reasons[known ? row.reason : "…"];
    if (summary.first_failed.size() < kWorstPoints) summary.first_failed.push_back(row);
  });
  const bool independent = study.design.draws() && study.design.kind != DesignKind::kSaltelli;
  for (LimitResult& result : summary.limits) {
    if (independent) result.interval = ClopperPearson(result.violations, result.count);
  }
  for (size_t k = 0; k < study.quantities.size(); ++k) {
    summary.quantities.push_back(SummariseQuantity(study, k, nominal[k], rows));
  }
  return summary;
}

}  // namespace mbv
