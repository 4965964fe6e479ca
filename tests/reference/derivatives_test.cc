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

void CheckSlopes(const Mechanism& mechanism, SlopeErrors* worst) {
  Differentiated subject(mechanism);
  const auto n = static_cast<Eigen::Index>(subject.coordinates.size());
  if (n == 0) return;
  Load following;
  AddAllLoads(&subject, &following);
  subject.Choose();
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
    acceleration.col(k) = slopes(&a, 10.0 * unit[k]);    // forces are straight but for friction
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
  for (const Mechanism& mechanism : MechanismsWithDerivatives()) {
    SlopeErrors worst;
    CheckSlopes(mechanism, &worst);
    EXPECT_LT(worst.position, 1e-9) << mechanism.name;
    EXPECT_LT(worst.velocity, 1e-9) << mechanism.name;
    EXPECT_LT(worst.acceleration, 1e-10) << mechanism.name;
  }
}

// Rows in units of work, of what is unique.
VecX Counted(const Mechanism& mechanism, const EveryForce& of, const ForceSlopes& forces) {
  const double length = CharacteristicLength(mechanism);
  VecX unit(forces.force.size());
  for (Eigen::Index i = 0; i < unit.size(); ++i) {
    unit[i] = (i % 6 < 3 ? length : 1.0) * (of.unique[static_cast<size_t>(i)] ? 1.0 : 0.0);
  }
  return unit;
}

// Of every force of a state, against differences; how many of their components are unique.
size_t CheckEveryForce(const Mechanism& mechanism) {
  Differentiated subject(mechanism);
  if (subject.coordinates.empty()) return 0;
  Load following;
  AddAllLoads(&subject, &following);
  subject.Choose();
  VecX q = subject.q, v = subject.v, a = subject.a;
  const VecX& unit = subject.unit;
  const auto n = static_cast<Eigen::Index>(subject.coordinates.size());
  EveryForce got;
  MatX T;
  (void)subject.Forces(q, v, a);
  EXPECT_TRUE(subject.reduced->Motions(&T).ok());
  const RunSummary summary = subject.reduced->AllDerivatives(T, subject.loads, &got);
  EXPECT_TRUE(summary.ok()) << mechanism.name << ": " << summary.message;
  if (!summary.ok()) return 0;
  const VecX rows = Counted(mechanism, got, got.reactions);
  // They are those of the forces' own solver.
  if (got.of_drives && subject.reduced->AllForces(subject.loads).ok()) {
    const ReferenceSample& sample = subject.reduced->sample();
    const VecX reactions = MatX(sample.reactions.transpose()).reshaped();
    EXPECT_LT((reactions - got.reactions.force).cwiseProduct(rows).norm(),
              1e-10 * (got.reactions.force.cwiseProduct(rows).norm() + got.acting.force.norm()))
        << mechanism.name;
    EXPECT_LT((sample.drive_force - got.acting.force.head(sample.drive_force.size())).norm(),
              1e-10 * sample.drive_force.norm() + 1e-16)
        << mechanism.name;
  }
  EveryForce there;
  there.of_drives = got.of_drives;
  const auto check = [&](const char* of, VecX* varied, const VecX& steps, const MatX& reactions,
                         const MatX& acting) {
    MatX slopes(rows.size() + acting.rows(), n), known(slopes.rows(), n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double at = (*varied)[k];
      slopes.col(k) = SlopesAt(
          [&](double x) {
            (*varied)[k] = x;
            VecX all = VecX::Constant(slopes.rows(), kNan);
            if (!subject.Forces(q, v, a).allFinite()) return all;
            MatX T_there;
            if (!subject.reduced->Motions(&T_there).ok() ||
                !subject.reduced->EachForce(T_there, subject.loads, &there).ok()) {
              return all;
            }
            all << there.reactions.force.cwiseProduct(rows), there.acting.force;
            return all;
          },
          at, steps[k]);
      (*varied)[k] = at;
    }
    known << rows.asDiagonal() * reactions, acting;
    // Reactions of some are all 0: those of what acts are their scale.
    EXPECT_LT(OffBy(known * unit.asDiagonal(), slopes * unit.asDiagonal()), 1e-8)
        << mechanism.name << " " << of;
  };
  check("∂q", &q, 0.5 * subject.share * unit, got.reactions.by_position, got.acting.by_position);
  check("∂v", &v, 0.1 * v.cwiseAbs(), got.reactions.by_velocity, got.acting.by_velocity);
  check("∂a", &a, unit, got.reactions.by_acceleration, got.acting.by_acceleration);
  return static_cast<size_t>(std::ranges::count(got.unique, true));
}

TEST(Derivatives, OfEveryForceAreItsSlopes) {
  size_t unique = 0;
  for (const Mechanism& mechanism : MechanismsWithDerivatives()) {
    unique += CheckEveryForce(mechanism);
  }
  EXPECT_GT(unique, 800U);
}

}  // namespace
}  // namespace mbv::fixtures
