#include "features/study/statistics.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <random>

#include "base/demand.h"

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

}  // namespace mbv
