// Derivatives of forces by implicit differentiation against extrapolated differences of the forces
// themselves, of every shipped model, every joint kind, every force element.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "math/ridders.h"
#include "tests/mechanisms/one_of_each.h"

namespace mbv::fixtures {
namespace {

// Relative to the largest of a matrix, rows in their units.
double OffBy(const MatX& a, const MatX& b) {
  double off = 0.0;
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    const double size = b.cwiseAbs().maxCoeff();
    off = std::max(off, (a.row(i) - b.row(i)).cwiseAbs().maxCoeff() / size);
  }
  return off;
}

struct SlopeErrors {
  double position = 0.0, velocity = 0.0, acceleration = 0.0;
};

void CheckSlopes(const Mechanism& mechanism, unsigned seed, SlopeErrors* worst) {
  Differentiated subject(mechanism);
  const auto n = static_cast<Eigen::Index>(subject.coordinates.size());
  if (n == 0) return;
  Load following;
  AddAllLoads(&subject, &following);
  subject.Choose(seed);
  VecX q = subject.q, v = subject.v, a = subject.a;
  const VecX& unit = subject.unit;
  (void)subject.Forces(q, v, a);
  MatX T;
  ASSERT_TRUE(subject.reduced->Motions(&T).ok());
  ForceDerivatives got;
  const RunSummary summary = subject.reduced->Derivatives(T, subject.loads, &got);
  ASSERT_TRUE(summary.ok()) << mechanism.name << ": " << summary.message;
  MatX position(n, n), velocity(n, n), acceleration(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto slopes = [&](VecX* of, double step) {
      const double at = (*of)[k];
      const VecX found = SlopesAt(
          [&](double x) {
            (*of)[k] = x;
            return subject.Forces(q, v, a);
          },
          at, step);
      (*of)[k] = at;
      return found;
    };
    position.col(k) = slopes(&q, 0.5 * subject.share * unit[k]);
    velocity.col(k) = slopes(&v, 0.1 * std::abs(v[k]));  // friction keeps its direction
    acceleration.col(k) = slopes(&a, unit[k]);
  }
  const MatX scale = MatX(unit.asDiagonal());  // forces and coordinates in units of their own
  const auto off = [&](const MatX& x, const MatX& y) {
    return OffBy(scale * x * scale, scale * y * scale);
  };
  worst->position = std::max(worst->position, off(got.by_position, position));
  worst->velocity = std::max(worst->velocity, off(got.by_velocity, velocity));
  worst->acceleration = std::max(worst->acceleration, off(got.by_acceleration, acceleration));
}

TEST(Derivatives, AreTheSlopesOfForces) {
  unsigned seed = 1;
  for (const Mechanism& mechanism : MechanismsWithDerivatives()) {
    SlopeErrors worst;
    CheckSlopes(mechanism, seed++, &worst);
    EXPECT_LT(worst.position, 1e-9) << mechanism.name;
    EXPECT_LT(worst.velocity, 1e-9) << mechanism.name;
    EXPECT_LT(worst.acceleration, 1e-10) << mechanism.name;
  }
}

}  // namespace
}  // namespace mbv::fixtures
