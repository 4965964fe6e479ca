// Motors of a model: units, gears and curves, and the way back into a file.
#include <gtest/gtest.h>

#include <numbers>

#include "model_file/load_model.h"
#include "model_file/write_model.h"

namespace mbv {
namespace {

using std::numbers::pi;

const char* const kTwoDrives =
    "name: motors\nparameters: {ratio: 4}\n"
    "bodies: {a: {mass: 1, inertia: [1, 1, 1]}, b: {mass: 1, inertia: [1, 1, 1]}}\n"
    "joints:\n"
    "  slide: {kind: prismatic, parent: world, child: a, axis: x}\n"
    "  turn: {kind: revolute, parent: a, child: b, axis: z}\n"
    "drives: {x: {kind: joint, joint: slide}, z: {kind: joint, joint: turn}}\n";

Mechanism LoadMotors(const std::string& text) {
  LoadResult result = LoadModelText(text, "motors.yaml");
  EXPECT_TRUE(result.mechanism) << result.diagnostics.Text();
  return result.mechanism ? *std::move(result.mechanism) : Mechanism();
}

TEST(Motors, AreReadInTheirUnits) {
  const Mechanism m = LoadMotors(kTwoDrives + std::string(R"(motors:
  x: {continuous: 2, lead_mm: 5, gear_ratio: ratio, max_speed_rpm: 3000, efficiency: 0.8}
  z: {peak_curve_rpm: [[0, 3], [600, 1]], rotor_inertia: 1e-4, torque_constant: 0.5, voltage: 24,
      resistance: 1}
)"));
  ASSERT_EQ(m.motors.size(), 2u);
  const Motor &x = m.motors[0], &z = m.motors[1];
  EXPECT_EQ(x.drive, 0);
  EXPECT_TRUE(x.turns);
  EXPECT_NEAR(x.gear_ratio, 4 * 2 * pi / 0.005, 1e-9);
  EXPECT_NEAR(x.max_speed, 100 * pi, 1e-12);
  EXPECT_EQ(x.efficiency, 0.8);
  EXPECT_EQ(x.peak, Motor::kNoLimit);
  EXPECT_EQ(z.drive, 1);
  EXPECT_TRUE(z.turns);
  ASSERT_EQ(z.peak_curve.size(), 2u);
  EXPECT_NEAR(z.peak_curve[1].speed, 20 * pi, 1e-12);
  EXPECT_EQ(z.voltage, 24.0);
}

TEST(Motors, OfASlideSlidesUnlessItHasALead) {
  EXPECT_FALSE(LoadMotors(kTwoDrives + std::string("motors: {x: {peak: 1}}\n")).motors[0].turns);
  EXPECT_TRUE(LoadMotors(kTwoDrives + std::string("motors: {x: {kind: rotary, peak: 1}}\n"))
                  .motors[0]
                  .turns);
}

TEST(Motors, ReadBackFromTheWrittenModel) {
  const Mechanism a = LoadMotors(kTwoDrives + std::string(R"(motors:
  x: {continuous: 2, peak: 3, peak_range: [null, 2.5], lead_mm: 5, rated_speed: 7, max_speed_rpm: 3000, efficiency: 0.8}
  z: {peak_curve_rpm: [[0, 3], [600, 1]], peak_range: [-1, 2], rotor_inertia: 1e-4, torque_constant: 0.5, voltage: 24,
      resistance: 1, continuous_current: 2, peak_current: 3}
)"));
  const Mechanism b = LoadMotors(WriteModel(a));
  ASSERT_EQ(b.motors.size(), a.motors.size());
  for (size_t k = 0; k < a.motors.size(); ++k) {
    const Motor &x = a.motors[k], &y = b.motors[k];
    EXPECT_EQ(x.drive, y.drive);
    EXPECT_EQ(x.turns, y.turns);
    EXPECT_EQ(x.gear_ratio, y.gear_ratio);
    EXPECT_EQ(x.continuous, y.continuous);
    EXPECT_EQ(x.peak, y.peak);
    EXPECT_EQ(x.least, y.least);
    EXPECT_EQ(x.most, y.most);
    EXPECT_EQ(x.rated_speed, y.rated_speed);
    EXPECT_EQ(x.max_speed, y.max_speed);
    EXPECT_EQ(x.rotor_inertia, y.rotor_inertia);
    EXPECT_EQ(x.efficiency, y.efficiency);
    EXPECT_EQ(x.voltage, y.voltage);
    EXPECT_EQ(x.continuous_current, y.continuous_current);
    EXPECT_EQ(x.peak_current, y.peak_current);
    ASSERT_EQ(x.peak_curve.size(), y.peak_curve.size());
    for (size_t i = 0; i < x.peak_curve.size(); ++i) {
      EXPECT_EQ(x.peak_curve[i].speed, y.peak_curve[i].speed);
      EXPECT_EQ(x.peak_curve[i].torque, y.peak_curve[i].torque);
    }
  }
}

// Bending a motor moves nothing, so mutate need not try it.
TEST(Motors, AreNoLiteralsOfTheMechanism) {
  const auto literals = [](const std::string& more) {
    return LoadModelText(kTwoDrives + more, "motors.yaml").literals.size();
  };
  EXPECT_EQ(literals("motors: {x: {continuous: 2, peak_range: [0, 3]}}\n"), literals(""));
}

}  // namespace
}  // namespace mbv
