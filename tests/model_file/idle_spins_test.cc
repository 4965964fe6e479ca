// Which spins between two balls are idle, and why others are not.
#include "mechanism/idle_spins.h"

#include <gtest/gtest.h>

#include "kinematics/mobility.h"
#include "math/spatial.h"
#include "model_file/load_model.h"

namespace mbv {
namespace {

// A rod between two cranks, with balls at both ends.
std::string RodText(const std::string& rod, const std::string& more = "") {
  return "name: linkage\n"
         "world: {frames: {D: [0.5, 0.1, -0.15]}}\n"
         "bodies:\n"
         "  crank: {mass: 1, inertia: [1, 1, 1], frames: {C: [0.1, 0, 0]}}\n"
         "  rod: {" +
         rod +
         ", frames: {side: [0.2, 0.01, 0], end: [0.42, 0, 0]}}\n"
         "  rocker: {mass: 1, inertia: [1, 1, 1], frames: {D: [0, 0, 0.2]}}\n"
         "joints:\n"
         "  A: {kind: revolute, parent: world, child: crank, axis: z}\n"
         "  B: {kind: spherical, parent: crank.C, child: rod}\n"
         "  C: {kind: spherical, parent: rod.end, child: rocker.D, closure: true}\n"
         "  D: {kind: revolute, parent: world.D, child: rocker, axis: x}\n"
         "drives: {A: {kind: joint, joint: A}}\n" +
         more;
}

const char* const kRoundRod = "mass: 2, com: [0.17, 0, 0], inertia: [0.01, 0.3, 0.3]";

Mechanism LoadedLinkage(const std::string& text) {
  LoadResult loaded = LoadModelText(text, "m.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  if (!loaded.mechanism) throw std::runtime_error("no mechanism");
  return *std::move(loaded.mechanism);
}

TEST(IdleSpins, OfASymmetricRodBetweenTwoBalls) {
  const Mechanism m = LoadedLinkage(RodText(kRoundRod));
  const std::vector<Spin> spins = IdleSpins(m);
  ASSERT_EQ(spins.size(), 1u);
  EXPECT_EQ(spins[0].name, "rod");
  EXPECT_LT((spins[0].n_B - Vec3::UnitX()).norm(), 1e-9);
  const Mobility mobility = AnalyseMobility(m);
  EXPECT_EQ(mobility.idle_spins, std::vector<std::string>{"rod"});
  EXPECT_EQ(mobility.dofs, 1);
  EXPECT_EQ(mobility.undriven, 0);
  EXPECT_EQ(mobility.kutzbach, 1);
  EXPECT_EQ(CountAllDofs(m), 2);
}

// Each of these turns the rod, or shows how it is turned.
TEST(IdleSpins, AreNoneWhereSomethingFeelsTheTurn) {
  const auto why = [](const std::string& rod, const std::string& more = "") {
    const std::vector<Spin> spins = FindSpins(LoadedLinkage(RodText(rod, more)));
    return spins.size() == 1 ? spins[0].why_not : "?";
  };
  EXPECT_EQ(why(kRoundRod), "");
  EXPECT_EQ(why("mass: 2, com: [0.17, 0, 1e-6], inertia: [0.01, 0.3, 0.3]"),
            "the centre of mass of rod lies 1e-06 m beside the line through its balls");
  EXPECT_EQ(why("mass: 2, com: [0.17, 0, 0], inertia: [0.01, 0.3, 0.3001]"),
            "the inertia of rod is not symmetric about the line through its spherical joints (by "
            "7.07e-05 "
            "kg m²)");
  EXPECT_EQ(
      why("mass: 2, com: [0.17, 0, 0], inertia: {xx: 0.01, yy: 0.3, zz: 0.3, xy: 0.001}"),
      "the inertia of rod is not symmetric about the line through its spherical joints (by 0.001 "
      "kg m²)");
  EXPECT_EQ(why(kRoundRod, "outputs: {rod: rod}\n"), "output 'rod' shows its turn");
  EXPECT_EQ(why(kRoundRod, "springs: {s: {from: world, to: rod.side, stiffness: 10}}\n"),
            "spring 's' ends beside the line through its balls");
  EXPECT_EQ(why(kRoundRod, "springs: {s: {from: world, to: rod.end, stiffness: 10}}\n"), "");
}

TEST(IdleSpins, TurnsCountFromTheLeastOneFromHome) {
  const Mechanism m = LoadedLinkage(RodText(kRoundRod));
  const Spin spin = IdleSpins(m).at(0);
  const Mat3 home = m.X_WB_home[static_cast<size_t>(spin.bodies[0])].linear();
  EXPECT_NEAR(TurnFromHome(m, spin, home), 0.0, 1e-15);
  // About a line across it: the least turn. About itself: all of it.
  const Vec3 n = home * spin.n_B, across = n.unitOrthogonal();
  const Mat3 tilted = ExpRotation(0.3 * across) * home;
  EXPECT_NEAR(TurnFromHome(m, spin, tilted), 0.0, 1e-14);
  EXPECT_NEAR(TurnFromHome(m, spin, tilted * ExpRotation(0.2 * spin.n_B)), 0.2, 1e-14);
}

}  // namespace
}  // namespace mbv
