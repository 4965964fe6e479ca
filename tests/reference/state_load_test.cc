// Loads that follow the mechanism's state against force elements, which are computed otherwise.
#include <gtest/gtest.h>

#include "reference/forward.h"
#include "tests/reference/fixture.h"

namespace mbv::fixtures {
namespace {

// A bar on a hinge about z.
Mechanism Bar() {
  Mechanism m;
  m.name = "bar";
  m.gravity_W = Vec3(0, -9.81, 0);
  m.bodies = {MakeBody("world", 0.0, Vec3::Zero(), Vec3::Zero()),
              MakeBody("bar", 1.3, Vec3(0.2, 0, 0), Vec3(0.01, 0.02, 0.02))};
  m.joints = {MakeJoint("pivot", JointKind::kRevolute, 0, Vec3::Zero(), 1, Vec3::Zero(), 0.3)};
  m.joints[0].axis = Vec3::UnitZ();
  m.drives = {{.name = "motor", .kind = JointDrive{0, 0}, .range = {}}};
  AddTree(&m);
  m.X_WB_home = TreePoses(m, {m.joints[0].guess});
  return m;
}

// −k (q − 0.4) − c q̇ + a t about z.
Load Follower(double k, double c, double a) {
  const Coordinate q{Coordinate::Kind::kJoint, 0, 0};
  Load load{.name = "follower", .body = 1, .force = {}, .moment = {}};
  load.following.push_back({5,
                            {.inputs = {{q, false, 0.3}, {q, true, 0.3}},
                             .value = [=](double t_s, std::span<const double> x) {
                               return -k * (x[0] - 0.4) - c * x[1] + a * t_s;
                             }}});
  return load;
}

Motion Swing(const Mechanism& m) {
  return DriveMotion(m, {{{ConstantTerm{0.3}, SineTerm{1.2, 0.8, 0.4}}}}, 2.0, 0.05);
}

TEST(StateLoads, AreTheSpringAndTheDamperThatTheyDescribe) {
  const Mechanism plain = Bar();
  Mechanism sprung = plain;
  sprung.elements = {{.name = "k", .joint = 0, .law = SpringLaw{{3.0}, 0.4}},
                     {.name = "c", .joint = 0, .law = DampingLaw{0.2}}};
  Motion loaded = Swing(plain);
  loaded.loads = {Follower(3.0, 0.2, 0.7)};
  const ReferenceRun load = RunReference(plain, loaded),
                     spring = RunReference(sprung, Swing(plain));
  ASSERT_TRUE(load.summary.ok()) << load.summary.message;
  for (Eigen::Index i = 0; i < load.trace.values.rows(); ++i) {
    const double t = load.trace.time_s[static_cast<size_t>(i)];
    EXPECT_NEAR(At(load.trace, i, "motor.force"), At(spring.trace, i, "motor.force") - 0.7 * t,
                1e-13);
    const double rate = At(load.trace, i, "motor.velocity");
    const double q = At(load.trace, i, "motor.position");
    EXPECT_NEAR(At(load.trace, i, "power.loads"), (-3 * (q - 0.4) - 0.2 * rate + 0.7 * t) * rate,
                1e-12);
  }
  loaded.loads = {Follower(3.0, 0.2 * 1.001, 0.7)};
  const ReferenceRun perturbed = RunReference(plain, loaded);
  EXPECT_GT((ColumnOf(perturbed.trace, "motor.force") - ColumnOf(load.trace, "motor.force"))
                .cwiseAbs()
                .maxCoeff(),
            1e-4);
}

TEST(StateLoads, MoveAFreeBarAsTheSpringDoes) {
  const Mechanism plain = Bar();
  Mechanism sprung = plain;
  sprung.elements = {{.name = "k", .joint = 0, .law = SpringLaw{{3.0}, 0.4}},
                     {.name = "c", .joint = 0, .law = DampingLaw{0.2}}};
  Motion motion = FreeMotion(plain, 0.1, 1.0, 1.0);
  const ForwardRun spring = RunForwardReference(sprung, motion);
  motion.loads = {Follower(3.0, 0.2, 0.0)};
  const ForwardRun load = RunForwardReference(plain, motion);
  ASSERT_TRUE(load.summary.ok()) << load.summary.message;
  EXPECT_LT((ColumnOf(load.trace, "motor.position") - ColumnOf(spring.trace, "motor.position"))
                .cwiseAbs()
                .maxCoeff(),
            1e-9);
}

// A wheel that has turned many times: angles are told within half a turn of home.
TEST(StateLoads, TakeAnglesWithinHalfATurnOfHome) {
  const Mechanism m = Bar();
  Motion motion = DriveMotion(m, {{{ConstantTerm{0.3 + 20 * std::numbers::pi + 1.0}}}}, 0.1, 0.1);
  motion.loads = {Follower(3.0, 0.0, 0.0)};
  const ReferenceRun run = RunReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double weight = 1.3 * 9.81 * 0.2 * std::cos(1.3);
  EXPECT_NEAR(At(run.trace, 0, "motor.force"), weight + 3.0 * (1.3 - 0.4), 1e-12);
}

}  // namespace
}  // namespace mbv::fixtures
