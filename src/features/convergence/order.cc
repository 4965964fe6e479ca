#include "features/convergence/order.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <map>

#include "base/demand.h"
#include "comparison/metrics.h"

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
    verdict.text = floor ? "not judged: at the round-off floor, coarser steps may show it"
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

namespace {

constexpr double kSameTime_s = 1e-9;

// docs/explanation/convergence.md derives these.
ExpectedOrder Expected(bool stock, Knob knob) {
  switch (knob) {
    case Knob::kBoth:
      return stock ? ExpectedOrder{1.0, 2.0} : ExpectedOrder{4.0, 6.0};
    case Knob::kStep:
      return stock ? ExpectedOrder{1.0, 1.0} : ExpectedOrder{4.0, 4.0};
    case Knob::kTimeConstant:
      return stock ? ExpectedOrder{1.0, 2.0} : ExpectedOrder{-2.0, 2.0};
  }
  return {};
}

ExpectedOrder ExpectedPose(bool stock) {
  return stock ? ExpectedOrder{2.0, 2.0} : ExpectedOrder{4.0, 6.0};
}

// What a break may have left in the error of the smooth samples: the errors near breaks contain
// that of the smooth motion too.
double RemainsOf(const SampleClasses& classes, const ConvergencePoint& point,
                 const ErrorPair& error) {
  const double excess = error.breaks - error.smooth;
  return excess > 0.0 ? classes.Remains(point.time_constant_s) * excess : 0.0;
}

OrderFit Fit(const SampleClasses& classes, const ConvergenceSeries& series, double ErrorPair::*of) {
  std::vector<double> knob, error, ignorable;
  for (const ConvergencePoint& point : series.points) {
    const ErrorPair& pair = series.by_changes ? point.change : point.error;
    knob.push_back(KnobOf(series, point));
    error.push_back(pair.*of);
    ignorable.push_back(of == &ErrorPair::smooth ? RemainsOf(classes, point, pair) : 0.0);
  }
  // Where no order is a legitimate order, errors that stay the same are not a plateau.
  const double plateau = series.expected.lowest > 0.0 ? kLargestPlateau : 0.0;
  return FitOrder(knob, error, ignorable, plateau);
}

OrderFit FitPose(const ConvergenceSeries& series) {
  std::vector<double> knob, error;
  for (const ConvergencePoint& point : series.points) {
    knob.push_back(KnobOf(series, point));
    error.push_back(point.pose_m / series.extent_m);
  }
  return FitOrder(knob, error, std::vector<double>(error.size(), 0.0));
}

void AddNotes(ConvergenceSeries* series) {
  if (!series->smooth) series->notes.push_back("no sample is smooth: those near breaks are judged");
  const auto floor = std::count(series->fit.floor.begin(), series->fit.floor.end(), true);
  if (floor > 0) {
    series->notes.push_back(
        fmt::format("{} of {} errors are round-off or remains of the start and of breaks, and left "
                    "out of the fit",
                    floor, series->points.size()));
  }
  for (const ConvergencePoint& point : series->points) {
    if (point.failure.empty()) continue;
    series->notes.push_back(fmt::format("no result at step {:g} s, time constant {:g} s: {}",
                                        point.step_s, point.time_constant_s, point.failure));
  }
  const ConvergencePoint& last = series->points.back();
  if (series->by_changes && last.error.smooth > 10.0 * last.change.smooth) {
    series->notes.push_back(
        fmt::format("the limit is {:.1e} off: what is not refined leaves that", last.error.smooth));
  }
}

double Rms(const VecX& values, const std::vector<bool>& left_out) {
  double sum = 0.0, n = 0.0;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (left_out[static_cast<size_t>(i)]) continue;
    sum += values[i] * values[i];
    n += 1.0;
  }
  return n > 0.0 ? std::sqrt(sum / n) : kNan;
}

}  // namespace

SampleClasses::SampleClasses(const std::vector<double>& times_s,
                             const std::vector<double>& breaks_s, double window)
    : window_s(window) {
  for (const double t : times_s) {
    const auto near = [&](double from) {
      return t >= from - kSameTime_s && t < from + window_s - kSameTime_s;
    };
    near_break.push_back(near(0.0) || std::any_of(breaks_s.begin(), breaks_s.end(), near));
  }
}

size_t SampleClasses::smooth() const {
  return static_cast<size_t>(std::count(near_break.begin(), near_break.end(), false));
}

double SampleClasses::Remains(double time_constant_s) const {
  const double x = window_s / time_constant_s;
  // ∫ (1 + s)² exp(−2s) ds from x to ∞; 5/4 from 0.
  const double after = std::exp(-2.0 * x) * (0.5 * (1.0 + x) * (2.0 + x) + 0.25);
  const auto n = static_cast<double>(smooth());
  return std::sqrt(after / (1.25 - after) * (static_cast<double>(near_break.size()) - n) / n);
}

MatX DriveForceTable(const Mechanism& mechanism, const Trace& trace) {
  MatX forces(trace.values.rows(), static_cast<Eigen::Index>(mechanism.drives.size()));
  for (size_t k = 0; k < mechanism.drives.size(); ++k) {
    const int column = trace.Find(Quantity::kForce, mechanism.drives[k].name);
    MBV_DEMAND(column >= 0, mechanism.drives[k].name);
    forces.col(static_cast<Eigen::Index>(k)) = trace.values.col(column);
  }
  return forces;
}

ErrorPair RelativeError(const Mechanism& mechanism, const MatX& difference, const MatX& truth,
                        const SampleClasses& classes) {
  struct Sums {
    ErrorSum smooth, breaks, all;
  };
  std::map<std::string, Sums> units;
  for (size_t k = 0; k < mechanism.drives.size(); ++k) {
    Sums& sums = units[ForceUnit(mechanism, mechanism.drives[k])];
    const auto column = static_cast<Eigen::Index>(k);
    for (Eigen::Index i = 0; i < difference.rows(); ++i) {
      const double error = difference(i, column), force = truth(i, column);
      (classes.near_break[static_cast<size_t>(i)] ? sums.breaks : sums.smooth)
          .Add(error, force, kNan, "");
      sums.all.Add(error, force, kNan, "");
    }
  }
  // The worst unit; one without samples says nothing, and NaN is worst and stays.
  const auto worst_of = [&units = units](ErrorSum Sums::*of) {
    double worst = kNan;
    bool any = false;
    for (const auto& [unit, sums] : units) {
      const ErrorSum& sum = sums.*of;
      if (sum.count() == 0) continue;
      const double error = sum.rms_error() == 0.0 ? 0.0 : sum.rms_error() / sums.all.rms_truth();
      if (!any || (!std::isnan(worst) && !(error <= worst))) worst = error;
      any = true;
    }
    return worst;
  };
  return {worst_of(&Sums::smooth), worst_of(&Sums::breaks)};
}

double KnobOf(const ConvergenceSeries& series, const ConvergencePoint& point) {
  return series.knob == Knob::kTimeConstant ? point.time_constant_s : point.step_s;
}

std::vector<double> JudgedErrors(const ConvergenceSeries& series) {
  std::vector<double> errors;
  for (const ConvergencePoint& point : series.points) {
    const ErrorPair& pair = series.by_changes ? point.change : point.error;
    errors.push_back(series.smooth ? pair.smooth : pair.breaks);
  }
  return errors;
}

void Judge(const SampleClasses& classes, ConvergenceSeries* series) {
  MBV_DEMAND(!series->points.empty(), series->name);
  series->expected = Expected(series->stock, series->knob);
  // With one knob of the stock engine fixed, the forces tend to something else than the truth.
  series->by_changes = series->stock && series->knob != Knob::kBoth;
  series->smooth = classes.smooth() > 0;
  series->breaks_fit = Fit(classes, *series, &ErrorPair::breaks);
  series->fit = series->smooth ? Fit(classes, *series, &ErrorPair::smooth) : series->breaks_fit;
  series->verdict = JudgeOrder(series->fit, series->expected);
  if (series->knob == Knob::kBoth) {
    series->expected_pose = ExpectedPose(series->stock);
    series->pose_fit = FitPose(*series);
    series->pose_verdict = JudgeOrder(series->pose_fit, series->expected_pose);
  }
  AddNotes(series);
}

ForceExtrapolation ExtrapolateForces(const Mechanism& mechanism, const ConvergenceSeries& series,
                                     const std::vector<MatX>& forces, const MatX& truth,
                                     const SampleClasses& classes) {
  ForceExtrapolation result;
  SampleClasses used = classes;
  if (!series.smooth) used.near_break.assign(used.near_break.size(), false);
  const auto relative = [&](const MatX& difference) {
    return RelativeError(mechanism, difference, truth, used).smooth;
  };
  // Round-off, and what the start leaves at the finest run that is used.
  const auto remains = [&](size_t i) {
    return kLargestPlateau + RemainsOf(classes, series.points[i], series.points[i].error);
  };
  const int fine = series.fit.last_fitted();
  if (fine < 1) {
    for (size_t i = forces.size(); i-- > 0 && std::isnan(result.error);) {
      if (forces[i].size() == 0) continue;
      result.error = relative(forces[i] - truth);
      result.allowed = remains(i);
    }
    result.pass = result.error <= result.allowed;
    return result;
  }
  const auto b = static_cast<size_t>(fine);
  size_t a = b - 1;
  while (a > 0 && !series.fit.fitted[a]) --a;
  result.coarse_s = series.points[a].step_s;
  result.fine_s = series.points[b].step_s;
  result.richardson = MakeRichardson(result.coarse_s, result.fine_s, series.fit, series.expected);
  const MatX correction = result.richardson.factor * (forces[b] - forces[a]);
  const MatX extrapolated = forces[b] + correction;
  const MatX uncertainty = result.richardson.safety * correction;
  result.index = relative(uncertainty);
  result.error = relative(extrapolated - truth);
  result.allowed = result.index + remains(b);
  result.pass = result.error <= result.allowed;
  for (size_t k = 0; k < mechanism.drives.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    result.drives.push_back({.drive = mechanism.drives[k].name,
                             .unit = ForceUnit(mechanism, mechanism.drives[k]),
                             .rms = Rms(extrapolated.col(column), used.near_break),
                             .uncertainty = Rms(uncertainty.col(column), used.near_break),
                             .error = Rms((extrapolated - truth).col(column), used.near_break)});
  }
  return result;
}

bool ConvergenceReport::finding() const {
  return !extrapolation.pass ||
         std::any_of(series.begin(), series.end(), [](const ConvergenceSeries& s) {
           return s.verdict.finding || s.pose_verdict.finding;
         });
}

}  // namespace mbv
