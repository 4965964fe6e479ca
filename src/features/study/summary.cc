#include "features/study/summary.h"

#include <fmt/format.h>
#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <charconv>
#include <cmath>
#include <random>

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

constexpr int kReplicates = 400;
constexpr std::uint64_t kBootstrapSeed = 20260101;

// Sums over blocks, from which all estimates follow.
struct BlockSums {
  explicit BlockSums(size_t numbers) : first(numbers, 0.0), total(numbers, 0.0) {}

  // a, b and ab_i of one block.
  void Add(const double* block) {
    const double a = block[0], b = block[1];
    sum += a + b;
    squares += a * a + b * b;
    for (size_t i = 0; i < first.size(); ++i) {
      const double ab = block[2 + i];
      first[i] += b * (ab - a);
      total[i] += 0.5 * (a - ab) * (a - ab);
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

// The values of complete blocks, less their mean.
std::vector<double> CentredBlocks(std::span<const double> values, size_t width, double* mean) {
  std::vector<double> kept;
  double sum = 0.0;
  for (size_t at = 0; at + width <= values.size(); at += width) {
    const std::span<const double> block = values.subspan(at, width);
    if (!std::all_of(block.begin(), block.end(), [](double v) { return std::isfinite(v); })) {
      continue;
    }
    kept.insert(kept.end(), block.begin(), block.end());
    sum += block[0] + block[1];
  }
  *mean = sum * static_cast<double>(width) / (2.0 * static_cast<double>(kept.size()));
  for (double& value : kept) value -= *mean;
  return kept;
}

Interval MiddleOf(std::vector<double> replicates) {
  std::sort(replicates.begin(), replicates.end());
  return {Percentile(replicates, 0.025), Percentile(replicates, 0.975)};
}

// Whole blocks are drawn again and again, with replacement.
void Bootstrap(const std::vector<double>& blocks, size_t width, std::vector<SobolIndex>* indices) {
  const size_t numbers = width - 2, count = blocks.size() / width;
  std::vector<std::vector<double>> first(numbers), total(numbers);
  std::mt19937_64 random(kBootstrapSeed);
  for (int k = 0; k < kReplicates; ++k) {
    BlockSums sums(numbers);
    for (size_t n = 0; n < count; ++n) sums.Add(&blocks[width * (random() % count)]);
    if (!(sums.variance() > 0.0)) continue;
    for (size_t i = 0; i < numbers; ++i) {
      first[i].push_back(sums.Share(sums.first[i]));
      total[i].push_back(sums.Share(sums.total[i]));
    }
  }
  for (size_t i = 0; i < numbers; ++i) {
    (*indices)[i].first_interval = MiddleOf(std::move(first[i]));
    (*indices)[i].total_interval = MiddleOf(std::move(total[i]));
  }
}

}  // namespace

SobolResult SobolIndices(std::span<const double> values, size_t numbers) {
  const size_t width = numbers + 2;
  MBV_DEMAND(numbers > 0 && values.size() % width == 0, values.size());
  SobolResult result;
  result.indices.resize(numbers);
  const std::vector<double> blocks = CentredBlocks(values, width, &result.mean);
  result.blocks = blocks.size() / width;
  result.left_out = values.size() / width - result.blocks;
  if (result.blocks < 2) return result;
  BlockSums sums(numbers);
  for (size_t at = 0; at < blocks.size(); at += width) sums.Add(&blocks[at]);
  result.variance = sums.variance();
  // Round-off of a constant is no variance.
  constexpr double kRoundoff = 1e-14;
  const double scale = kRoundoff * std::abs(result.mean);
  if (!(result.variance > scale * scale)) return result;
  for (size_t i = 0; i < numbers; ++i) {
    result.indices[i].first = sums.Share(sums.first[i]);
    result.indices[i].total = sums.Share(sums.total[i]);
  }
  Bootstrap(blocks, width, &result.indices);
  return result;
}

namespace {

// In quotes where a comma or a quote would be mistaken; lines stay lines.
std::string NumberField(double value) {
  return std::isfinite(value) ? fmt::format("{:.17g}", value) : "";
}

// The next field of `line`, which is cut off; empty at the end and where quotes are not closed.
std::optional<std::string> TakeField(std::string_view* line, bool* more) {
  if (!*more) return {};
  std::string field;
  size_t at = 0;
  if (!line->empty() && line->front() == '"') {
    for (at = 1;; ++at) {
      if (at >= line->size()) return {};
      if ((*line)[at] == '"' && (at + 1 >= line->size() || (*line)[at + 1] != '"')) break;
      if ((*line)[at] == '"') ++at;
      field += (*line)[at];
    }
    ++at;
  } else {
    at = std::min(line->find(','), line->size());
    field = line->substr(0, at);
  }
  *more = at < line->size() && (*line)[at] == ',';
  if (!*more && at < line->size()) return {};
  line->remove_prefix(*more ? at + 1 : at);
  return field;
}

template <typename Number>
std::optional<Number> NumberOf(const std::optional<std::string>& field) {
  Number number{};
  if (!field) return {};
  const char* end = field->data() + field->size();
  const auto [at, error] = std::from_chars(field->data(), end, number);
  if (error != std::errc() || at != end) return {};
  return number;
}

bool TakeNumbers(std::string_view* line, bool* more, size_t count, std::vector<double>* numbers) {
  for (size_t k = 0; k < count; ++k) {
    const auto field = TakeField(line, more);
    if (!field) return false;
    const auto number = field->empty() ? kNan : NumberOf<double>(field);
    if (!number) return false;
    numbers->push_back(*number);
  }
  return true;
}

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
  for (const double value : row.varied) text += "," + NumberField(value);
  for (const double value : row.values) text += "," + NumberField(value);
  return text + "\n";
}

std::optional<PointRow> ReadPointLine(std::string_view line, const Study& study) {
  bool more = true;
  const auto point = NumberOf<std::uint64_t>(TakeField(&line, &more));
  const auto seed = NumberOf<std::uint64_t>(TakeField(&line, &more));
  const auto exit_code = NumberOf<int>(TakeField(&line, &more));
  const auto reason = TakeField(&line, &more);
  if (!point || seed != study.design.seed || !exit_code || !reason) return {};
  PointRow row{.point = *point, .exit_code = *exit_code, .reason = *reason, .varied = {}};
  if (!TakeNumbers(&line, &more, study.factors.size(), &row.varied)) return {};
  if (!TakeNumbers(&line, &more, study.quantities.size(), &row.values)) return {};
  if (more) return {};
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
