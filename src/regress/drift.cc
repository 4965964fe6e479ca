#include "regress/drift.h"

#include <algorithm>
#include <cmath>

namespace mbv {
namespace {

// Standard deviation of a normal distribution per median absolute deviation.
constexpr double kSigmaPerMad = 1.4826;
constexpr double kLevelRounding = 1e-9;  // of logarithms

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

}  // namespace

std::optional<DriftFinding> FindDrift(const std::vector<PastValue>& past, double now,
                                      const DriftRule& rule) {
  if (!std::isfinite(now)) return std::nullopt;
  const auto level = [&](double value) { return std::log10(std::max(value, rule.noise_floor)); };
  std::vector<double> levels;
  for (auto it = past.rbegin(); it != past.rend() && levels.size() < rule.window; ++it) {
    if (it->good && !it->drifted && std::isfinite(it->value)) levels.push_back(level(it->value));
  }
  if (levels.size() < rule.min_runs) return std::nullopt;
  const double median = Median(levels);
  std::vector<double> deviations;
  for (double value : levels) deviations.push_back(std::abs(value - median));
  const double sigma = kSigmaPerMad * Median(deviations);
  const double threshold = median + std::max(std::log10(rule.factor), rule.spread_factor * sigma);
  // A value at the factor counts: 1e-12 from 1e-13 is ten times worse, whatever the last bit says.
  if (level(now) < threshold - kLevelRounding) return std::nullopt;
  DriftFinding finding{std::pow(10.0, median), std::pow(10.0, threshold), levels.size(), 0};
  for (auto it = past.rbegin(); it != past.rend(); ++it) {
    if (!it->good) continue;  // a failed night neither ends nor begins a stretch
    if (!it->drifted) break;
    finding.since_run = it->run;
  }
  return finding;
}

}  // namespace mbv
