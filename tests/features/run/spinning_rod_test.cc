// A rod between two balls spins about its own line against dry friction about axes that are turned
// in it: by hand, in both witnesses.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "features/run/run_scenario.h"
#include "math/spatial.h"
#include "report/report.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

constexpr double kCoulomb = 0.01, kInertia = 0.01, kRate = 3.0;

// `reversed`: the friction's frame lies on what the rod stands on, as the joint's child.
std::string Rod(const Vec3& rpy, bool reversed) {
  const std::string turned = fmt::format("{{position: [0, 0, 0], rotation: {{rpy: [{}, {}, {}]}}}}",
                                         rpy.x(), rpy.y(), rpy.z());
  return fmt::format(
      "name: spin\nworld: {{frames: {{foot: {0}, top: [0, 0, 0.5]}}}}\nbodies:\n"
      "  stub: {{mass: 1, com: [0, 0, 0], inertia: [1, 1, 1], frames: {{foot: {0}}}}}\n"
      "  rod: {{mass: 1, com: [0, 0, 0.25], inertia: [0.02, 0.02, {1}], frames: {{foot: {0}, top: "
      "[0, 0, 0.5]}}}}\njoints:\n  stand: {{kind: fixed, parent: world, child: stub}}\n"
      "  a: {{kind: spherical, parent: {2}, child: {3}}}\n"
      "  b: {{kind: spherical, parent: world.top, child: rod.top, closure: true}}\n"
      "outputs: {{rod: rod}}\nelements: {{f: {{kind: friction, joint: a, coulomb: {4}}}}}\n",
      turned, kInertia, reversed ? "rod.foot" : "stub.foot", reversed ? "stub.foot" : "rod.foot",
      kCoulomb);
}

TEST(SpinningRod, DryFrictionAboutTurnedAxesStopsItByHand) {
  const test::TestFolder folder("spinning_rod");
  for (const bool reversed : {false, true}) {
    for (const Vec3& rpy : {Vec3(0, 0, 0), Vec3(0.3, 0.5, 0.7), Vec3(1.2, -0.4, 2.0)}) {
      (void)folder.Write("model.yaml", Rod(rpy, reversed));
      const std::string file = folder.Write(
          "scenario.yaml", fmt::format("mechanism: ./model.yaml\nmotion: {{duration_s: 2.5, "
                                       "sample_s: 0.02, initial_rates: {{rod.yaw: {}}}}}\n",
                                       kRate));
      RunOptions options;
      options.pictures = false;
      options.out_dir = "";
      const RunOutcome run = RunScenario(file, options);
      ASSERT_TRUE(run.report) << run.diagnostics.Text();
      EXPECT_EQ(run.exit_code, 0) << ToTable(*run.report, {});
      // Each axis of the frame brakes by itself, at the moment that its share of the spin has.
      const Vec3 n = RotRpy(rpy).transpose() * Vec3::UnitZ();
      const double slows = kCoulomb * n.lpNorm<1>() / kInertia, stops_s = kRate / slows;
      for (const char* witness : {"reference", "simulated"}) {
        const Trace& trace = *TraceOf(*run.report, witness);
        const int yaw = trace.Find("rod.yaw");
        ASSERT_GE(yaw, 0);
        for (size_t i = 0; i < trace.time_s.size(); ++i) {
          const double t = std::min(trace.time_s[i], stops_s);
          const double angle = kRate * t - 0.5 * slows * t * t;
          const double got = trace.values(static_cast<Eigen::Index>(i), yaw);
          EXPECT_NEAR(std::remainder(got - angle, 2.0 * std::numbers::pi), 0.0, 1e-8)
              << witness << " " << trace.time_s[i] << " reversed " << reversed;
        }
      }
    }
  }
}

}  // namespace
}  // namespace mbv
