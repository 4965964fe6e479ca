#include "report/plot_axis.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mbv {
namespace {

constexpr double kRoundOff = 1e-9;  // a smaller relative range is shown as a constant
constexpr int kMostTicks = 16;

// The nearest of 1, 2, 5 and 10 times a power of ten.
double RoundStep(double raw) {
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  return raw / power < 1.5   ? power
         : raw / power < 3.5 ? 2 * power
         : raw / power < 7.5 ? 5 * power
                             : 10 * power;
}

}  // namespace

Rgb MapColor(double t) {
  constexpr std::array<std::array<double, 3>, 5> stops = {
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  const double at = std::clamp(t, 0.0, 1.0) * 4;
  const int k = std::min(3, static_cast<int>(at));
  Rgb rgb{};
  for (size_t c = 0; c < 3; ++c) {
    const double from = stops[static_cast<size_t>(k)][c], to = stops[static_cast<size_t>(k) + 1][c];
    rgb[c] = static_cast<int>(std::lround(from + (at - k) * (to - from)));
  }
  return rgb;
}

Rgb CellColor(const PlotAxis& value, double v) {
  if (!value.Shows(v)) return {-1, -1, -1};
  return MapColor((value.Inner(v) - value.low) / (value.high - value.low));
}

bool PlotAxis::Shows(double v) const { return std::isfinite(v) && (!log || v > 0); }

double PlotAxis::Inner(double v) const { return log ? std::log10(v) : v; }

void PlotAxis::Add(double v) {
  if (!Shows(v)) return;
  low = std::min(low, Inner(v));
  high = std::max(high, Inner(v));
}

void PlotAxis::Pad() {
  if (!(low <= high)) low = 0, high = 1;
  // Round-off of a constant is no range to show: between its ends no tick could be told apart.
  const double largest = std::max(std::abs(low), std::abs(high));
  const bool constant = log ? high <= low : high - low <= kRoundOff * largest;
  const double pad = !constant ? 0.04 * (high - low) : log ? 0.5 : std::max(1e-12, largest);
  low -= pad;
  high += pad;
}

double PlotAxis::Px(double v) const {
  return from_px + (Inner(v) - low) / (high - low) * (to_px - from_px);
}

std::vector<double> PlotAxis::Decades(int wanted) const {
  std::vector<double> ticks;
  const int step = std::max(1, static_cast<int>(std::ceil((high - low) / (wanted + 2))));
  const bool few = high - low < 2.0;
  for (int d = static_cast<int>(std::floor(low)); d <= high; d += step) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double tick = factor * std::pow(10.0, d), inner = Inner(tick);
      if ((factor == 1.0 || few) && inner >= low && inner <= high) ticks.push_back(tick);
    }
  }
  return ticks;
}

std::vector<double> PlotAxis::Ticks(int wanted) const {
  if (log) return Decades(wanted);
  std::vector<double> ticks;
  const double unit = RoundStep((high - low) / wanted), first = std::ceil(low / unit);
  for (int k = 0; k <= kMostTicks && (first + k) * unit <= high; ++k) {
    ticks.push_back((first + k) * unit);
  }
  return ticks;
}

void EqualScale(PlotAxis* x, PlotAxis* y) {
  const double x_px = std::abs(x->to_px - x->from_px), y_px = std::abs(y->to_px - y->from_px);
  const double scale = std::max((x->high - x->low) / x_px, (y->high - y->low) / y_px);
  for (auto [axis, px] : {std::pair{x, x_px}, std::pair{y, y_px}}) {
    const double middle = 0.5 * (axis->low + axis->high);
    axis->low = middle - 0.5 * scale * px;
    axis->high = middle + 0.5 * scale * px;
  }
}

}  // namespace mbv
