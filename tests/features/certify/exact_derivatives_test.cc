// Derivatives by two formulations that share the description alone: implicit differentiation in
// maximal coordinates, and dual numbers through the equations of the tree.
#include <gtest/gtest.h>

#include <algorithm>

#include "features/certify/certify.h"
#include "mechanism/reach.h"
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
BothWays Differentiate(const Mechanism& mechanism, VecX* unit) {
  BothWays both;
  Differentiated subject(mechanism);
  if (subject.coordinates.empty()) return both;
  Load following;
  AddAllLoads(&subject, &following);
  subject.Choose();
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
  for (const Mechanism& mechanism : MechanismsWithDerivatives()) {
    VecX unit;
    const BothWays both = Differentiate(mechanism, &unit);
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
    const BothWays truth = Differentiate(mechanism, &unit);
    for (Body& body : mechanism.bodies) body.mass *= 1.0 + 1e-8;
    const BothWays off = Differentiate(mechanism, &unit);
    EXPECT_GT(Apart(off.dual.by_position, truth.implicit.by_position, unit), 1e-11);
    EXPECT_GT(Apart(off.implicit.by_position, truth.dual.by_position, unit), 1e-11);
  }
}

// Of every force of a state both ways: the largest difference, of unique components of reactions
// and of what acts, and the number of such components.
struct ForcesApart {
  double off = kNan;
  size_t unique = 0;
  bool of_drives = false;
};
ForcesApart CompareForces(const Mechanism& described, const Mechanism& known,
                          Differentiated* subject, const std::string& refused = "") {
  ForcesApart apart;
  EveryForce by;
  MatX T;
  (void)subject->Forces(subject->q, subject->v, subject->a);
  EXPECT_TRUE(subject->reduced->Motions(&T).ok()) << described.name;
  const RunSummary summary = subject->reduced->AllDerivatives(T, subject->loads, &by);
  EXPECT_EQ(summary.ok() ? "" : summary.message, refused) << described.name;
  if (!summary.ok()) return apart;
  Motion motion;
  for (const Coordinate& coordinate : subject->coordinates) {
    motion.commands.push_back({.name = "", .terms = {{coordinate, 1.0}}});
  }
  CommandSample command;
  command.position = subject->q, command.velocity = subject->v;
  command.acceleration = subject->a, command.loads = subject->loads;
  ExactDerivatives dual;
  dual.of_drives = by.of_drives;
  const std::string trouble =
      DifferentiateExactly(known, motion, subject->reduced->states(), command, &dual);
  EXPECT_EQ(trouble, "") << described.name;
  if (!trouble.empty()) return apart;
  const double length = CharacteristicLength(described);
  VecX rows(by.reactions.force.size());
  for (Eigen::Index i = 0; i < rows.size(); ++i) {
    rows[i] = !by.unique[static_cast<size_t>(i)] ? 0.0 : i % 6 < 3 ? length : 1.0;
  }
  apart.off = 0.0, apart.of_drives = by.of_drives;
  apart.unique = static_cast<size_t>(std::ranges::count(by.unique, true));
  const auto look = [&](const MatX& x, const MatX& y, const VecX& scale) {
    const MatX size = scale * subject->unit.transpose();
    const double largest = y.cwiseProduct(size).cwiseAbs().maxCoeff();
    const double off = (x - y).cwiseProduct(size).cwiseAbs().maxCoeff();
    if (off > 1e-12) apart.off = std::max(apart.off, off / largest);
  };
  for (const auto of :
       {&ForceSlopes::by_position, &ForceSlopes::by_velocity, &ForceSlopes::by_acceleration}) {
    if (rows.size() > 0) look(by.reactions.*of, dual.reactions.*of, rows);
    look(by.acting.*of, dual.*of, VecX::Ones(by.acting.force.size()));
  }
  return apart;
}

TEST(ExactDerivatives, OfEveryForceAgreeWithThoseOfTheReference) {
  size_t unique = 0, of_drives = 0, all = 0;
  for (const Mechanism& mechanism : MechanismsWithDerivatives()) {
    Differentiated subject(mechanism);
    if (subject.coordinates.empty()) continue;
    Load following;
    AddAllLoads(&subject, &following);
    subject.Choose();
    const ForcesApart apart = CompareForces(mechanism, mechanism, &subject);
    EXPECT_LT(apart.off, 1e-10) << mechanism.name;
    unique += apart.unique, of_drives += apart.of_drives ? 1U : 0U, ++all;
  }
  EXPECT_GT(unique, 800U);
  EXPECT_GT(of_drives, 15U);
  EXPECT_LT(of_drives, all);  // some under forces along the coordinates
}

TEST(ExactDerivatives, OfEveryForceDifferWhereMassesDo) {
  for (const Mechanism& mechanism : MechanismsWithDerivatives()) {
    if (mechanism.name != "stewart" && mechanism.name != "scara_robot") continue;
    Differentiated subject(mechanism);
    subject.Choose();
    Mechanism off = mechanism;
    for (Body& body : off.bodies) body.mass *= 1.0 + 1e-8;
    EXPECT_LT(CompareForces(mechanism, mechanism, &subject).off, 1e-11);
    EXPECT_GT(CompareForces(mechanism, off, &subject).off, 1e-10);
  }
}

// Journals and a guide with friction by what they bear: at rest there is no derivative; in motion
// a coefficient that is off by 1e-7 shows.
TEST(ExactDerivatives, OfFrictionByLoad) {
  const Mechanism mechanism = ModelAt("/models/journal_crank/model.yaml");
  Differentiated subject(mechanism);
  ASSERT_EQ(subject.coordinates.size(), 1U);
  subject.Choose();
  for (const double rate : {1.0, -7.0}) {
    subject.v[0] = rate;
    const ForcesApart apart = CompareForces(mechanism, mechanism, &subject);
    EXPECT_LT(apart.off, 1e-11);
    EXPECT_TRUE(apart.of_drives);
    EXPECT_GT(apart.unique, 15U);
    Mechanism off = mechanism;
    for (ForceElement& element : off.elements) {
      if (auto* friction = std::get_if<FrictionLaw>(&element.law)) {
        friction->coefficient *= 1.0 + 1e-7;
      }
    }
    EXPECT_GT(CompareForces(mechanism, off, &subject).off, 1e-10);
  }
  subject.v[0] = 0.0;
  (void)CompareForces(mechanism, mechanism, &subject,
                      "friction of joint 'A' rests with dry friction: a state alone does not "
                      "determine accelerations");
}

}  // namespace
}  // namespace mbv::fixtures
