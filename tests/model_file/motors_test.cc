// Motors of a model: units, gears and curves, and the way back into a file.
#include <gtest/gtest.h>

#include <fstream>
#include <numbers>

#include "model_file/catalogue.h"
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

const char* const kBorne =
    "thermal: {winding_to_housing: 0.8, housing_to_ambient: 2, winding_time: 20, housing_time: "
    "600, "
    "max_winding_C: 155, ambient_C: -10, resistance_growth: 0.0039}, "
    "gearbox: {mean_torque_N_cm: 400, peak_torque: 9, exponent: 10/3, max_speed_rpm: 6000}, "
    "brake: {torque_mN_m: 700, energy: 30}, torque_constant: 0.5, resistance: 2";

TEST(Motors, ThermalNetworkGearboxBrakeAndLinkReadBackFromTheWrittenModel) {
  const std::string text = kTwoDrives + std::string("motors: {x: {lead_mm: 5, gear_ratio: 3, ") +
                           kBorne +
                           "}}\ndc_link: {efficiency: 0.9, capacitance: 1e-3, voltage: 300, "
                           "brake_voltage: 390, resistance: 50, mean_power: 100}\n";
  const Mechanism a = LoadMotors(text), b = LoadMotors(WriteModel(a));
  ASSERT_EQ(b.motors.size(), 1u) << WriteModel(a);
  for (const Mechanism* m : {&a, &b}) {
    const Motor& motor = m->motors[0];
    ASSERT_TRUE(motor.thermal && motor.gearbox && motor.brake && m->dc_link);
    EXPECT_EQ(motor.thermal->ambient_C, -10.0);
    EXPECT_EQ(motor.thermal->resistance_at_C, 25.0);
    EXPECT_EQ(motor.thermal->resistance_growth, 0.0039);
    EXPECT_DOUBLE_EQ(motor.gearbox->mean_torque, 4.0);
    EXPECT_EQ(motor.gearbox->emergency_torque, Motor::kNoLimit);
    EXPECT_DOUBLE_EQ(motor.gearbox->exponent, 10.0 / 3.0);
    EXPECT_DOUBLE_EQ(motor.gearbox->max_speed, 200 * pi);
    EXPECT_DOUBLE_EQ(motor.brake->torque, 0.7);
    EXPECT_DOUBLE_EQ(motor.spindle, 2 * pi / 0.005);
    EXPECT_DOUBLE_EQ(motor.gear_ratio, 3 * 2 * pi / 0.005);
    EXPECT_EQ(m->dc_link->brake_voltage, 390.0);
    EXPECT_EQ(m->dc_link->peak_power, Motor::kNoLimit);
  }
}

TEST(Motors, WhatContradictsItselfIsNamedAllAtOnce) {
  const std::string text =
      kTwoDrives +
      std::string(
          "motors:\n"
          "  x: {peak_N_cm: 3, thermal: {winding_to_housing: 1}, brake: {energy: 3}}\n"
          "  z: {torque_constant: 1, resistance: 1,\n"
          "      thermal: {winding_to_housing: 0, housing_to_ambient: 2, winding_time: 20,\n"
          "                housing_time: 600, max_winding_C: 20, magnets: 3},\n"
          "      gearbox: {mean_torque: 3, peak_torque: 2, emergency_torque: 1}}\n"
          "dc_link: {capacitance: 1, voltage: 300, brake_voltage: 290, efficiency: 2}\n");
  const std::string found = LoadModelText(text, "motors.yaml").diagnostics.Text();
  for (const char* part :
       {"motors.x.peak_N_cm: the motor slides", "motors.x.thermal: 'housing_to_ambient' is missing",
        "motors.x.brake: 'torque' is missing", "motors.x.thermal needs torque_constant",
        "motors.z.thermal.winding_to_housing = 0 violates",
        "max_winding_C = 20 violates max_winding_C > ambient_C = 25", "'magnets'",
        "mean_torque = 3 violates mean_torque <= peak_torque = 2",
        "peak_torque = 2 violates peak_torque <= emergency_torque = 1",
        "dc_link.brake_voltage = 290 violates brake_voltage > voltage = 300",
        "dc_link.efficiency = 2 violates <= 1"}) {
    EXPECT_NE(found.find(part), std::string::npos) << part << "\nin\n" << found;
  }
}

class Catalogues : public testing::Test {
 protected:
  static std::string Check(const std::string& text, std::optional<Catalogue>* read = nullptr) {
    const std::string file = testing::TempDir() + "catalogue_test.yaml";
    std::ofstream(file, std::ios::binary) << text;
    Diagnostics diagnostics;
    auto catalogue = LoadCatalogue(file, &diagnostics);
    EXPECT_EQ(catalogue.has_value(), !diagnostics.has_errors());
    EXPECT_EQ(CheckCatalogue(file).Text(), diagnostics.Text());
    if (read != nullptr) *read = std::move(catalogue);
    return diagnostics.Text();
  }
};

TEST_F(Catalogues, AreReadInTheUnitsOfDataSheets) {
  std::optional<Catalogue> read;
  EXPECT_EQ(Check("catalogue: c\nmotors:\n"
                  "  A: {continuous_N_cm: 32, peak_mN_m: 960, rotor_inertia_kg_cm2: 0.44, "
                  "max_speed_rpm: 6000, mass: 0.6, cost: 9}\n"
                  "  B: {kind: linear, peak: 5, gearboxes: [none]}\n"
                  "  C: {peak: 5, gearboxes: [G]}\n"
                  "gearboxes: {G: {ratio: 10, efficiency: 0.9, inertia_kg_cm2: 0.1, "
                  "peak_torque: 8, mass: 0.4}}\n",
                  &read),
            "");
  ASSERT_TRUE(read);
  const CatalogueMotor &A = read->motors[0], &B = read->motors[1];
  EXPECT_DOUBLE_EQ(A.motor.continuous, 0.32);
  EXPECT_DOUBLE_EQ(A.motor.peak, 0.96);
  EXPECT_DOUBLE_EQ(A.motor.rotor_inertia, 0.44e-4);
  EXPECT_EQ(A.gearboxes, (std::vector<int>{-1, 0}));
  EXPECT_FALSE(B.motor.turns);
  EXPECT_EQ(B.gearboxes, std::vector<int>{-1});
  EXPECT_EQ(read->motors[2].gearboxes, std::vector<int>{0});
  // In the place of a model's motor behind a spindle.
  Motor model;
  model.drive = 3;
  model.spindle = 20.0;
  const Motor motor = InPlaceOf(model, A, &read->gearboxes[0]);
  EXPECT_EQ(motor.drive, 3);
  EXPECT_DOUBLE_EQ(motor.gear_ratio, 200.0);
  EXPECT_DOUBLE_EQ(motor.rotor_inertia, 0.54e-4);
  EXPECT_EQ(motor.efficiency, 0.9);
  EXPECT_EQ(motor.gearbox->peak_torque, 8.0);
  EXPECT_EQ(InPlaceOf(model, A, nullptr).gear_ratio, 20.0);
}

TEST_F(Catalogues, WhatIsWrongIsNamedWithItsPlace) {
  const std::string found = Check(
      "catalogue: c\nmotors:\n"
      "  A: {peak: -1, gear_ratio: 3, gearboxes: [H], colour: red}\n"
      "  B: {continuous: 3, peak: 2, mass: 0}\n"
      "gearboxes: {G: {efficiency: 1.2, mean_speed: 3, max_speed: 2}}\n");
  for (const char* part :
       {"catalogue_test.yaml:3", "motors.A.peak = -1 violates", "'colour'",
        "motors.B: continuous = 3 violates", "motors.B.mass = 0 violates",
        "gearboxes.G: 'ratio' is missing", "gearboxes.G.efficiency = 1.2 violates <= 1",
        "mean_speed = 3 violates mean_speed <= max_speed = 2"}) {
    EXPECT_NE(found.find(part), std::string::npos) << part << "\nin\n" << found;
  }
  EXPECT_NE(Check("catalogue: c\nmotors: {A: {peak: 1, gear_ratio: 3, gearboxes: [H]}}\n")
                .find("motors.A.gear_ratio: a motor of a catalogue has no gear"),
            std::string::npos);
  EXPECT_NE(Check("catalogue: c\n").find("motors: the catalogue has none"), std::string::npos);
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
