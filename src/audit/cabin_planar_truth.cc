#include "audit/cabin_planar_truth.h"

#include "core/demand.h"

namespace mbv::cabin_audit {

Pins Close(const Lengths& l, const SliderMotion& motion, double t) {
  const Vec3 x = motion.x + motion.v * t + 0.5 * motion.a * t * t;
  Pins p = motion.start;
  p.A = {x[0], 0.0};
  p.D = {x[1], 0.0};
  p.F = {x[2], 0.0};
  // Unknowns B, C; four squared rod lengths.
  for (int iteration = 0; iteration < 20; ++iteration) {
    p.E = 0.5 * (p.A + p.B);
    const Vec2 AB = p.B - p.A, FE = p.E - p.F, BC = p.C - p.B, DC = p.C - p.D;
    const Eigen::Vector4d r(AB.squaredNorm() - l.L1 * l.L1, FE.squaredNorm() - l.L4 * l.L4,
                            BC.squaredNorm() - l.L2 * l.L2, DC.squaredNorm() - l.L3 * l.L3);
    Eigen::Matrix4d J = Eigen::Matrix4d::Zero();
    J.row(0).head<2>() = 2.0 * AB.transpose();
    J.row(1).head<2>() = FE.transpose();
    J.row(2) << -2.0 * BC.transpose(), 2.0 * BC.transpose();
    J.row(3).tail<2>() = 2.0 * DC.transpose();
    const Eigen::Vector4d step = J.partialPivLu().solve(r);
    p.B -= step.head<2>();
    p.C -= step.tail<2>();
    if (step.cwiseAbs().maxCoeff() < 2 * kEps) break;
  }
  p.E = 0.5 * (p.A + p.B);
  return p;
}

std::vector<SliderMotion> RandomMotions(const Lengths& l, int count) {
  std::mt19937_64 random(20250201);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<SliderMotion> motions;
  while (static_cast<int>(motions.size()) < count) {
    // A pose: platform centre and tilt, then the rods by Pythagoras.
    const Vec2 K(0.08 * unit(random), 0.35 + 0.06 * unit(random));
    const double tilt = 0.15 * unit(random);
    const Vec2 half(0.5 * l.L2 * std::cos(tilt), 0.5 * l.L2 * std::sin(tilt));
    SliderMotion m;
    m.start.B = K - half;
    m.start.C = K + half;
    const auto foot = [](const Vec2& from, double length, double side) {
      return from.x() + side * std::sqrt(length * length - from.y() * from.y());
    };
    m.x[0] = foot(m.start.B, l.L1, -1.0);
    m.x[1] = foot(m.start.C, l.L3, 1.0);
    m.start.E = 0.5 * (Vec2(m.x[0], 0.0) + m.start.B);
    m.x[2] = foot(m.start.E, l.L4, 1.0);
    for (int i = 0; i < 3; ++i) {
      m.v[i] = 0.2 * unit(random);
      m.a[i] = 0.5 * unit(random);
    }
    m.start = Close(l, m, 0.0);
    motions.push_back(m);
  }
  return motions;
}

}  // namespace mbv::cabin_audit
