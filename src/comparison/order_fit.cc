#include "comparison/order_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/demand.h"

namespace mbv {
namespace {

// Orders of successive pairs that differ by less belong to one asymptotic range.
constexpr double kSameOrder = 0.75;
// Round-off does not fall with the step.
constexpr double kPlateauOrder = 0.5;
// Errors up to this many times the plateau are mixed with it.
constexpr double kNearPlateau = 4.0;

// Order between two points.
double Slope(const std::vector<double>& step, const std::vector<double>& error, size_t a,
             size_t b) {
  return std::log(error[a] / error[b]) / std::log(step[a] / step[b]);
}

// Marks what is not caused by the step: small by itself, or on or near a plateau at the fine end.
void MarkFloor(const std::vector<double>& step, const std::vector<double>& error,
               const std::vector<double>& ignorable, double plateau, std::vector<bool>* floor) {
  std::vector<size_t> points;
  for (size_t i = 0; i < error.size(); ++i) {
    if (error[i] <= std::max(kRoundoffError, ignorable[i])) (*floor)[i] = true;
    if (std::isfinite(error[i]) && error[i] > 0.0) points.push_back(i);
  }
  if (points.size() < 2) return;
  const size_t a = points[points.size() - 2], b = points.back();
  const double level = std::max(error[a], error[b]);
  if (level > plateau || Slope(step, error, a, b) > kPlateauOrder) return;
  for (const size_t i : points) {
    if (error[i] <= std::min(kNearPlateau * level, plateau)) (*floor)[i] = true;
  }
}

// The finest three points or more whose successive orders are alike; else all points.
std::vector<size_t> AsymptoticRange(const std::vector<size_t>& points, const OrderFit& fit) {
  for (size_t last = points.size() - 1; last >= 2; --last) {
    double low = fit.pairwise[points[last]], high = low;
    size_t first = last - 1;
    for (; first > 0; --first) {
      const double order = fit.pairwise[points[first]];
      if (std::max(high, order) - std::min(low, order) > kSameOrder) break;
      low = std::min(low, order);
      high = std::max(high, order);
    }
    if (last - first >= 2) {
      return {points.begin() + static_cast<std::ptrdiff_t>(first),
              points.begin() + static_cast<std::ptrdiff_t>(last) + 1};
    }
  }
  return points;
}

// Least squares through the logarithms of the points.
void FitLine(const std::vector<double>& step, const std::vector<double>& error,
             const std::vector<size_t>& points, OrderFit* fit) {
  const auto n = static_cast<double>(points.size());
  double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, residual2 = 0.0;
  for (const size_t i : points) {
    x += std::log(step[i]) / n;
    y += std::log(error[i]) / n;
  }
  for (const size_t i : points) {
    const double dx = std::log(step[i]) - x;
    xx += dx * dx;
    xy += dx * (std::log(error[i]) - y);
  }
  fit->order = xy / xx;
  for (const size_t i : points) {
    const double r = std::log(error[i]) - y - fit->order * (std::log(step[i]) - x);
    residual2 += r * r;
    fit->fitted[i] = true;
  }
  if (points.size() > 2) fit->order_error = std::sqrt(residual2 / (n - 2.0) / xx);
}

}  // namespace

int OrderFit::first_fitted() const {
  const auto found = std::find(fitted.begin(), fitted.end(), true);
  return found == fitted.end() ? -1 : static_cast<int>(found - fitted.begin());
}

int OrderFit::last_fitted() const {
  const auto found = std::find(fitted.rbegin(), fitted.rend(), true);
  return static_cast<int>(fitted.rend() - found) - 1;
}

OrderFit FitOrder(const std::vector<double>& step, const std::vector<double>& error,
                  const std::vector<double>& ignorable, double plateau) {
  MBV_DEMAND(step.size() == error.size() && step.size() == ignorable.size(), step.size());
  OrderFit fit;
  fit.pairwise.assign(step.size(), kNan);
  fit.fitted.assign(step.size(), false);
  fit.floor.assign(step.size(), false);
  MarkFloor(step, error, ignorable, plateau, &fit.floor);
  std::vector<size_t> points;
  for (size_t i = 0; i < step.size(); ++i) {
    if (!std::isfinite(error[i]) || fit.floor[i]) continue;
    if (!points.empty()) fit.pairwise[i] = Slope(step, error, points.back(), i);
    points.push_back(i);
  }
  if (points.size() >= 2) FitLine(step, error, AsymptoticRange(points, fit), &fit);
  return fit;
}

std::string ToText(const ExpectedOrder& expected) {
  return expected.lowest == expected.highest
             ? fmt::format("{:g}", expected.lowest)
             : fmt::format("{:g} to {:g}", expected.lowest, expected.highest);
}

OrderVerdict JudgeOrder(const OrderFit& fit, const ExpectedOrder& expected) {
  OrderVerdict verdict;
  if (std::isnan(fit.order)) {
    const bool floor = std::find(fit.floor.begin(), fit.floor.end(), true) != fit.floor.end();
    verdict.text = floor ? "not judged: at the round-off floor, coarser steps may tell"
                         : "not judged: too few runs";
    return verdict;
  }
  verdict.judged = true;
  verdict.text = fmt::format("order {:.2f}", fit.order);
  if (!std::isnan(fit.order_error)) verdict.text += fmt::format(" ± {:.2f}", fit.order_error);
  verdict.text += ", expected " + ToText(expected);
  const bool low = fit.order < expected.lowest - kOrderTolerance;
  if (low || fit.order > expected.highest + kOrderTolerance) {
    verdict.finding = true;
    verdict.text += low ? ": too low" : ": too high";
    return verdict;
  }
  // Finer points above the floor must not fall more slowly.
  for (auto i = static_cast<size_t>(fit.last_fitted()) + 1; i < fit.pairwise.size(); ++i) {
    if (!(fit.pairwise[i] < expected.lowest - kSameOrder)) continue;
    verdict.finding = true;
    verdict.text += fmt::format(", but {:.2f} at finer steps", fit.pairwise[i]);
    return verdict;
  }
  return verdict;
}

Richardson MakeRichardson(double coarse_step, double fine_step, const OrderFit& fit,
                          const ExpectedOrder& expected) {
  MBV_DEMAND(coarse_step > fine_step && fine_step > 0.0, fine_step);
  Richardson result;
  const bool observed = fit.order >= 0.5 && !std::isnan(fit.order_error);
  // As the step falls, the term of the lowest order is what remains.
  const double formal = std::max(1.0, expected.lowest);
  result.order = observed ? std::min(fit.order, formal) : formal;
  result.factor = 1.0 / (std::pow(coarse_step / fine_step, result.order) - 1.0);
  result.safety = observed ? 1.25 : 3.0;
  return result;
}

}  // namespace mbv
