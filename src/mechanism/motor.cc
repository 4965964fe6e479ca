#include "mechanism/motor.h"

#include <algorithm>
#include <cmath>

namespace mbv {
namespace {

// Straight lines between the points; the first torque below them, nothing beyond them.
double OnCurve(const std::vector<CurvePoint>& curve, double speed) {
  if (speed <= curve.front().speed) return curve.front().torque;
  if (speed > curve.back().speed) return 0.0;
  const auto above =
      std::lower_bound(curve.begin(), curve.end(), speed,
                       [](const CurvePoint& point, double x) { return point.speed < x; });
  const CurvePoint &a = *(above - 1), &b = *above;
  return a.torque + (b.torque - a.torque) * (speed - a.speed) / (b.speed - a.speed);
}

double TorqueAt(const std::vector<CurvePoint>& curve, double constant, double highest,
                double speed) {
  if (speed > highest) return 0.0;
  return curve.empty() ? constant : OnCurve(curve, speed);
}

}  // namespace

double ContinuousTorque(const Motor& motor, double speed) {
  return TorqueAt(motor.continuous_curve, motor.continuous, motor.max_speed, std::abs(speed));
}

double PeakTorque(const Motor& motor, double speed) {
  return TorqueAt(motor.peak_curve, motor.peak, motor.max_speed, std::abs(speed));
}

}  // namespace mbv
