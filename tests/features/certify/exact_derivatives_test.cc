// Derivatives by two formulations that share the description alone: implicit differentiation in
// maximal coordinates, and dual numbers through the equations of the tree.
#include <gtest/gtest.h>

#include <algorithm>

#include "features/certify/certify.h"
#include "tests/mechanisms/one_of_each.h"

namespace mbv::fixtures {
namespace {

// Of the largest, forces and coordinates in units of their own.
double Apart(const MatX& x, const MatX& y, const VecX& unit) {
  const MatX size = unit * unit.transpose();
  return (x - y).cwiseProduct(size).cwiseAbs().maxCoeff() /
         y.cwiseProduct(size).cwiseAbs().maxCoeff();
}

struct BothWays {
  ForceDerivatives implicit;
  ExactDerivatives dual;
  VecX force;
};

// At a state of the mechanism; `planted` changes what the second one knows.
BothWays Differentiate(const Mechanism& mechanism, unsigned seed, VecX* unit) {
  BothWays both;
  Differentiated subject(mechanism);
  if (subject.coordinates.empty()) return both;
  Load following;
  AddAllLoads(&subject, &following);
  subject.Choose(seed);
  both.force = subject.Forces(subject.q, subject.v, subject.a);
  MatX T;
  EXPECT_TRUE(subject.reduced->Motions(&T).ok()) << mechanism.name;
  const RunSummary summary = subject.reduced->Derivatives(T, subject.loads, &both.implicit);
  EXPECT_TRUE(summary.ok()) << mechanism.name << ": " << summary.message;

  Motion motion;
  for (const Coordinate& coordinate : subject.coordinates) {
    motion.commands.push_back({.name = "", .terms = {{coordinate, 1.0}}});
  }
  CommandSample command;
  command.position = subject.q, command.velocity = subject.v, command.acceleration = subject.a;
  command.loads = subject.loads;
  const std::string trouble =
      DifferentiateExactly(mechanism, motion, subject.reduced->states(), command, &both.dual);
  EXPECT_EQ(trouble, "") << mechanism.name;
  *unit = subject.unit;
  return both;
}

TEST(ExactDerivatives, AgreeWithThoseOfTheReference) {
  unsigned seed = 1;
  for (const Mechanism& mechanism : MechanismsWithDerivatives()) {
    VecX unit;
    const BothWays both = Differentiate(mechanism, seed++, &unit);
    if (unit.size() == 0) continue;
    const double q = Apart(both.implicit.by_position, both.dual.by_position, unit);
    const double v = Apart(both.implicit.by_velocity, both.dual.by_velocity, unit);
    const double a = Apart(both.implicit.by_acceleration, both.dual.by_acceleration, unit);
    EXPECT_LT((both.dual.force - both.force).cwiseProduct(unit).norm(),
              1e-12 * both.force.cwiseProduct(unit).norm())
        << mechanism.name;
    EXPECT_LT(q, 1e-11) << mechanism.name;
    EXPECT_LT(v, 1e-11) << mechanism.name;
    EXPECT_LT(a, 1e-11) << mechanism.name;
  }
}

// A mass that is off by 1e-8 shows in what the two agree on to 1e-11.
TEST(ExactDerivatives, DifferWhereMassesDo) {
  for (Mechanism mechanism : MechanismsWithDerivatives()) {
    if (mechanism.name != "stewart" && mechanism.name != "scara_robot") continue;
    VecX unit;
    const BothWays truth = Differentiate(mechanism, 3, &unit);
    for (Body& body : mechanism.bodies) body.mass *= 1.0 + 1e-8;
    const BothWays off = Differentiate(mechanism, 3, &unit);
    EXPECT_GT(Apart(off.dual.by_position, truth.implicit.by_position, unit), 1e-11);
    EXPECT_GT(Apart(off.implicit.by_position, truth.dual.by_position, unit), 1e-11);
  }
}

}  // namespace
}  // namespace mbv::fixtures
