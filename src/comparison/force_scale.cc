#include "comparison/force_scale.h"

#include <algorithm>
#include <cmath>

#include "mechanism/constraints.h"

namespace mbv {
namespace {

double LargestLoad(const Motion& motion, const Trace& trace, double length_m) {
  double largest = 0.0;
  for (const double t_s : trace.time_s) {
    for (const Load& load : motion.loads) {
      Vec3 force, moment;
      for (int c = 0; c < 3; ++c) {
        force[c] = Evaluate(load.force[c], t_s).value;
        moment[c] = Evaluate(load.moment[c], t_s).value;
      }
      largest = std::max({largest, force.norm(), moment.norm() / length_m});
    }
  }
  return largest;
}

// RMS acceleration of the fastest drive, angles at the characteristic length.
double LargestAcceleration(const Mechanism& mechanism, const Trace& trace, double length_m) {
  double largest = 0.0;
  for (const Drive& drive : mechanism.drives) {
    const int column = trace.Find(drive.name + ".acceleration");
    if (column < 0 || trace.values.rows() == 0) continue;
    const double rms = std::sqrt(trace.values.col(column).squaredNorm() /
                                 static_cast<double>(trace.values.rows()));
    const double arm = PositionUnit(mechanism, drive) == "rad" ? length_m : 1.0;
    if (std::isfinite(rms)) largest = std::max(largest, arm * rms);
  }
  return largest;
}

// From the energy: F = √(2 k E), at most.
double LargestSpringForce(const Mechanism& mechanism, const Trace& trace) {
  const int column = trace.Find("energy.springs");
  if (column < 0 || trace.values.rows() == 0) return 0.0;
  double stiffness = 0.0;
  for (const SpringDamper& spring : mechanism.springs) {
    stiffness = std::max(stiffness, spring.stiffness);
  }
  const double energy = trace.values.col(column).maxCoeff();
  return energy > 0.0 ? std::sqrt(2.0 * stiffness * energy) : 0.0;
}

}  // namespace

ForceScale ForceScaleOf(const ComparisonInput& input, const Trace& trace) {
  constexpr double kLeastAcceleration = 1.0;  // [m/s²]
  const Mechanism& mechanism = *input.mechanism;
  double heaviest_kg = 0.0;
  for (const Body& body : mechanism.bodies) heaviest_kg = std::max(heaviest_kg, body.mass);
  ForceScale scale;
  scale.length_m = CharacteristicLength(mechanism);
  const double acceleration = std::max({kLeastAcceleration, mechanism.gravity_W.norm(),
                                        LargestAcceleration(mechanism, trace, scale.length_m)});
  scale.force_N =
      std::max({heaviest_kg * acceleration, LargestLoad(*input.motion, trace, scale.length_m),
                LargestSpringForce(mechanism, trace)});
  return scale;
}

}  // namespace mbv
