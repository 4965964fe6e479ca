// mbverify size, run --sizing and checks: {motor_margin} as a user types them, with forces by hand:
// 2 kg on a sine of 0.1 m ask for 0.2 (2π/T)² N.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

class SizeCommand : public testing::Test {
 protected:
  SizeCommand() {
    Write("model.yaml", kModel + std::string("motors: {x: {continuous: 6, peak: 10}}\n"));
    Write("bare.yaml", kModel);
    Write("fast.yaml", Scenario("model.yaml", 1.0));
    Write("slow.yaml", Scenario("model.yaml", 2.0));
    Write("none.yaml", Scenario("bare.yaml", 1.0));
    Write("geared.yaml", kModel + std::string("motors: {x: {gear_ratio: 1}}\n"));
    Write("unlimited.yaml", Scenario("geared.yaml", 1.0));
    Write("shaken.yaml", Scenario("geared.yaml", 1.0) +
                             "loads: {shaker: {on: cart, force: [{sine: {amplitude: 5, "
                             "frequency_hz: 30}}, 0, 0], in: world}}\n");
  }
  static constexpr const char* kModel =
      "name: cart\nbodies: {cart: {mass: 2, inertia: [1, 1, 1]}}\n"
      "joints: {slide: {kind: prismatic, parent: world, child: cart, axis: x}}\n"
      "drives: {x: {kind: joint, joint: slide}}\n";
  static std::string Scenario(const std::string& model, double period_s) {
    return "mechanism: " + model +
           "\nmotion: {duration_s: 2, sample_s: 0.01, commands: {x: {sine: " +
           "{amplitude: 0.1, period_s: " + std::to_string(period_s) +
           "}}}}\nanalytic: none\nsimulation: {mode: inverse}\n";
  }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(mbverify.folder() / name, std::ios::binary) << text;
  }
  [[nodiscard]] std::string File(const std::string& name) const {
    return (mbverify.folder() / name).string();
  }
  [[nodiscard]] std::string Out() const { return " --out " + File("out"); }
  Program mbverify{std::string("size_") +
                   testing::UnitTest::GetInstance()->current_test_info()->name()};
};

const double kForce = 0.2 * std::pow(2 * std::numbers::pi, 2);  // of the fast motion
const double kMargin = 6.0 / (kForce / std::sqrt(2.0));

// A cart of 2 kg in MJCF, up and down: a motor with 4 N per unit of control.
TEST_F(SizeCommand, TakesARobotsFileAsItIs) {
  const auto robot = [](double most) {
    return fmt::format(
        R"(<mujoco model="lift"><worldbody><body name="cart"><joint name="up" type="slide" axis="0 0 1"/>)"
        R"(<inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody><actuator>)"
        R"(<motor name="m" joint="up" gear="4" ctrlrange="-{0} {0}"/></actuator></mujoco>)",
        most);
  };
  Write("lift.xml", robot(10));
  const ProgramResult fits = mbverify("size " + File("lift.xml") + Out());
  EXPECT_EQ(fits.exit_code, 0) << fits.out << fits.err;
  EXPECT_NE(fits.out.find("peak, setup/first"), std::string::npos) << fits.out;
  EXPECT_NE(fits.err.find("is sized by"), std::string::npos) << fits.err;
  EXPECT_TRUE(std::filesystem::exists(File("out/lift/setup/first.yaml")));
  // It bears 2 · 9.81 N at rest; the motor has 4 · 4.9 N.
  Write("lift.xml", robot(4.9));
  EXPECT_EQ(mbverify("size " + File("lift.xml") + Out()).exit_code, 1);
  Write("lift.xml", "<mujoco");
  EXPECT_EQ(mbverify("size " + File("lift.xml") + Out()).exit_code, 2);
}

TEST_F(SizeCommand, EnvelopesScenarios) {
  const ProgramResult result = mbverify("size " + File("slow.yaml") + " " + File("fast.yaml") +
                                        " --json " + File("size.json"));
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_NE(result.out.find("1.07  continuous, fast"), std::string::npos) << result.out;
  const auto json = nlohmann::json::parse(ReadAll(File("size.json")));
  EXPECT_EQ(json["scenarios"].size(), 2u);
  EXPECT_NEAR(json["motors"][0]["peak_torque"]["value"].get<double>(), kForce, 1e-6);
  EXPECT_NEAR(json["motors"][0]["margin"].get<double>(), kMargin, 1e-6);
  EXPECT_EQ(json["motors"][0]["rms_torque"]["scenario"], "fast");
}

TEST_F(SizeCommand, EndsWithOneWhereAMarginIsTooSmall) {
  EXPECT_EQ(mbverify("size " + File("fast.yaml") + " --margin 1.07").exit_code, 0);
  EXPECT_EQ(mbverify("size " + File("fast.yaml") + " --margin 1.08").exit_code, 1);
}

// Samples twice per period see no force at all: the margin of 1.07 would look like any number.
TEST_F(SizeCommand, AMarginOverSamplesThatResolveNothingIsNotKnown) {
  const std::string coarse = " --set motion.sample_s=0.4";
  const ProgramResult sized = mbverify("size " + File("fast.yaml") + coarse);
  EXPECT_EQ(sized.exit_code, 3) << sized.out << sized.err;
  EXPECT_NE(sized.out.find(
                "x: torque, power and margin not known between the samples: fast: the samples are "
                "too far apart"),
            std::string::npos)
      << sized.out;
  const ProgramResult run = mbverify("run " + File("fast.yaml") + coarse + Out());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("motor of x: margin not known: the samples"), std::string::npos)
      << run.out;
  const ProgramResult required =
      mbverify("run " + File("fast.yaml") + coarse + " --set checks.motor_margin=1" + Out());
  EXPECT_EQ(required.exit_code, 3) << required.out;
  EXPECT_NE(required.out.find("what motors need between the samples is not known"),
            std::string::npos)
      << required.out;
  const ProgramResult fine =
      mbverify("run " + File("fast.yaml") + " --set checks.motor_margin=1.05" + Out());
  EXPECT_EQ(fine.exit_code, 0) << fine.out;
  // What fails at the samples fails between them, too.
  const ProgramResult fails =
      mbverify("run " + File("fast.yaml") + coarse + " --set checks.motor_margin=100" + Out());
  EXPECT_EQ(fails.exit_code, 1) << fails.out;
}

// Eight samples per oscillation show the motion and the torque, four per oscillation not the power:
// its peak is 0.2 (2π)³ 0.1 / 2 = 2.48 W, the samples' any value down to 70 % of that.
TEST_F(SizeCommand, APowerThatTheSamplesDoNotResolveIsNotKnown) {
  for (const char* file : {"fast.yaml", "unlimited.yaml"}) {
    const ProgramResult coarse = mbverify("size " + File(file) + " --set motion.sample_s=0.125" +
                                          " --json " + File("size.json"));
    EXPECT_EQ(coarse.exit_code, 3) << file << coarse.out << coarse.err;
    EXPECT_NE(coarse.out.find("the samples do not resolve the power of x"), std::string::npos)
        << coarse.out;
    EXPECT_FALSE(nlohmann::json::parse(ReadAll(File("size.json")))["motors"][0]["unresolved"]
                     .get<std::string>()
                     .empty());
    const ProgramResult run =
        mbverify("run " + File(file) + " --sizing" + " --set motion.sample_s=0.125" + Out());
    EXPECT_EQ(run.exit_code, 0) << run.out;
    EXPECT_NE(run.out.find("not known between the samples; at the samples alone:"),
              std::string::npos)
        << run.out;
    EXPECT_EQ(mbverify("size " + File(file) + " --set motion.sample_s=0.05").exit_code, 0) << file;
  }
}

// A load may oscillate while the motion hardly does.
TEST_F(SizeCommand, ATorqueThatTheSamplesDoNotResolveIsNotKnown) {
  const ProgramResult coarse = mbverify("size " + File("shaken.yaml"));
  EXPECT_EQ(coarse.exit_code, 3) << coarse.out << coarse.err;
  EXPECT_NE(coarse.out.find("the samples do not resolve the force of x"), std::string::npos)
      << coarse.out;
  EXPECT_EQ(mbverify("size " + File("shaken.yaml") + " --set motion.sample_s=0.001").exit_code, 0);
}

TEST_F(SizeCommand, NeedsMotors) {
  const ProgramResult result = mbverify("size " + File("none.yaml"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("cart has no motors"), std::string::npos) << result.err;
}

TEST_F(SizeCommand, RunReportsAllFiguresOnDemand) {
  const ProgramResult brief = mbverify("run " + File("fast.yaml") + Out());
  EXPECT_EQ(brief.exit_code, 0) << brief.out;
  EXPECT_NE(brief.out.find("motor of x: margin 1.07 (continuous)"), std::string::npos) << brief.out;
  EXPECT_EQ(brief.out.find("energy per cycle"), std::string::npos);
  const ProgramResult full = mbverify("run --sizing " + File("fast.yaml") + Out());
  EXPECT_NE(full.out.find("energy per cycle"), std::string::npos) << full.out;
  const auto summary = nlohmann::json::parse(ReadAll(File("out") + "/cart/fast/summary.json"));
  EXPECT_NEAR(summary["motors"][0]["margin"].get<double>(), kMargin, 1e-6);
  EXPECT_NE(ReadAll(File("out") + "/cart/fast/report.html").find("torque over speed"),
            std::string::npos);
}

TEST_F(SizeCommand, ARequiredMarginIsACheck) {
  const std::string run = "run " + File("fast.yaml") + Out() + " --set checks.motor_margin=";
  const ProgramResult kept = mbverify(run + "1.074");
  EXPECT_EQ(kept.exit_code, 0) << kept.out;
  const ProgramResult missed = mbverify(run + "1.075");
  EXPECT_EQ(missed.exit_code, 1) << missed.out;
  EXPECT_NE(missed.out.find("the witnesses do not disagree about that"), std::string::npos)
      << missed.out;
  const ProgramResult none =
      mbverify("run " + File("none.yaml") + Out() + " --set checks.motor_margin=1.2");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("checks.motor_margin: cart has no motors"), std::string::npos)
      << none.err;
}

// What the drive moves is 2 kg, and the spindle turns it into 2 (h/2π)² kg m².
TEST_F(SizeCommand, TheInertiaRatioIsThatOfTheLoadAtHome) {
  Write("model.yaml", kModel + std::string("motors: {x: {peak: 1, lead_mm: 10, "
                                           "rotor_inertia: 1e-6}}\n"));
  (void)mbverify("run " + File("fast.yaml") + Out() + " --no-report --no-pictures");
  const auto summary = nlohmann::json::parse(ReadAll(File("out") + "/cart/fast/summary.json"));
  const double lever = 0.01 / (2 * std::numbers::pi);
  EXPECT_NEAR(summary["motors"][0]["inertia_ratio"].get<double>(), 2 * lever * lever / 1e-6, 1e-6);
}

// 3 kg hang on a vertical slide behind a spindle of 10 mm per turn: 29.43 N · 0.01/2π.
class SizeBrake : public SizeCommand {
 protected:
  void Hang(const std::string& motor, const std::string& more = "") const {
    Write("model.yaml",
          "name: lift\nbodies: {cart: {mass: 3, inertia: [1, 1, 1]}}\n"
          "joints: {slide: {kind: prismatic, parent: world, child: cart, axis: z}}\n"
          "drives: {x: {kind: joint, joint: slide}}\nmotors: {x: {lead_mm: 10, " +
              motor + "}}\n" + more);
  }
  static constexpr double kHold = 3 * 9.81 * 0.01 / (2 * std::numbers::pi);
};

TEST_F(SizeBrake, TheReferenceFindsWhatTheBrakeHoldsAndStops) {
  Hang("brake: {torque: 0.1, energy: 1}, rotor_inertia: 1e-6");
  const std::string run = "run " + File("fast.yaml") + Out() + " --no-report --no-pictures";
  EXPECT_EQ(mbverify(run).exit_code, 0);
  const auto motor =
      nlohmann::json::parse(ReadAll(File("out") + "/lift/fast/summary.json"))["motors"][0];
  EXPECT_NEAR(motor["brake"]["holding"].get<double>(), kHold, 1e-12);
  // At the largest speed 0.2π m/s: 1.5 v² of the cart, rotor, and what is left of the torque.
  const double v = 0.1 * 2 * std::numbers::pi, turns = v * 2 * std::numbers::pi / 0.01;
  const double energy = (1.5 * v * v + 0.5e-6 * turns * turns) * 0.1 / (0.1 - kHold);
  EXPECT_NEAR(motor["brake"]["stop_J"].get<double>(), energy, 1e-9);
  // The check counts it, and fails just below.
  Hang(fmt::format("brake: {{torque: {:.17g}}}", 1.2 * kHold * (1 + 1e-9)));
  EXPECT_EQ(mbverify(run + " --set checks.motor_margin=1.2").exit_code, 0);
  Hang(fmt::format("brake: {{torque: {:.17g}}}", 1.2 * kHold * (1 - 1e-9)));
  const ProgramResult small = mbverify(run + " --set checks.motor_margin=1.2");
  EXPECT_EQ(small.exit_code, 1) << small.out;
}

TEST_F(SizeBrake, WhatTheLinkBurnsIsReportedAndJudged) {
  Hang("peak: 9", "dc_link: {mean_power: 1e-3, brake_voltage: 60, resistance: 9}\n");
  const ProgramResult sized =
      mbverify("size " + File("fast.yaml") + " --json " + File("size.json"));
  EXPECT_EQ(sized.exit_code, 1) << sized.out << sized.err;
  EXPECT_NE(sized.out.find("DC link: fed back"), std::string::npos) << sized.out;
  const auto link = nlohmann::json::parse(ReadAll(File("size.json")))["dc_link"];
  EXPECT_EQ(link["limited_by"], "brake resistor, mean");
  // Lowered twice by 0.2 m, from rest to rest; the trapezoidal rule over 50 samples loses 3e-4.
  EXPECT_NEAR(link["fed_back_J"]["value"].get<double>(), 2 * 3 * 9.81 * 0.2, 5e-3);
  const std::string run = "run " + File("fast.yaml") + Out() + " --set checks.motor_margin=";
  const double margin = link["margin"].get<double>();
  EXPECT_EQ(mbverify(run + fmt::format("{:.17g}", margin * (1 - 1e-6))).exit_code, 0);
  EXPECT_EQ(mbverify(run + fmt::format("{:.17g}", margin * (1 + 1e-6))).exit_code, 1);
}

class SizeChoose : public SizeCommand {
 protected:
  // The slide needs kForce: with a spindle of 2π mm per turn, n = 1000.
  SizeChoose() { Write("model.yaml", kModel + std::string("motors: {x: {lead: 0.002*pi}}\n")); }
  ProgramResult Choose(const std::string& catalogue, const std::string& more = "") const {
    Write("catalogue.yaml", catalogue);
    return mbverify("size " + File("slow.yaml") + " " + File("fast.yaml") + " --choose " +
                    File("catalogue.yaml") + " --json " + File("size.json") + more);
  }
  [[nodiscard]] nlohmann::json Chosen() const {
    return nlohmann::json::parse(ReadAll(File("size.json")))["choice"];
  }
};

// Light enough alone, but its rotor needs more than the cart: 1e-3 kg m² at n v̇ = 1000 · 3.9 rad/s²
// asks for 3.9 N m where the cart asks for 7.9e-3 N m.
TEST_F(SizeChoose, TheChosenRotorLoadsItself) {
  const std::string catalogue =
      "catalogue: two\nmotors:\n"
      "  light: {peak: 1, rotor_inertia: 1e-3, mass: 1, cost: 9}\n"
      "  heavy: {peak: 1, rotor_inertia_kg_cm2: 0.01, mass: 2, cost: 1}\n";
  const ProgramResult result = Choose(catalogue, " --out " + File("out"));
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_NE(result.out.find("x: heavy with gearbox none, mass 2"), std::string::npos) << result.out;
  const auto drive = Chosen()["drives"][0];
  EXPECT_EQ(drive["motor"], "heavy");
  const double acceleration = 0.1 * std::pow(2 * std::numbers::pi, 2);
  const auto light = drive["candidates"][0];
  EXPECT_EQ(light["limited_by"], "peak");
  EXPECT_EQ(light["scenario"], "fast");
  EXPECT_NEAR(1.0 / light["margin"].get<double>(), kForce / 1000 + 1e-3 * 1000 * acceleration,
              1e-9);
  EXPECT_FALSE(light["keeps"]);
  const std::string csv = ReadAll(File("out") + "/cart/size/size.csv");
  EXPECT_NE(csv.find("x,light,none,1,9,"), std::string::npos) << csv;
  EXPECT_NE(ReadAll(File("out") + "/cart/size/size.html").find("Choice from the catalogue"),
            std::string::npos);
  // Cheapest instead of lightest: the first one keeps the margin.
  EXPECT_EQ(Choose(catalogue, " --by cost").exit_code, 0);
  EXPECT_EQ(Chosen()["drives"][0]["candidates"][0]["chosen"], true);
}

// What is printed is a model's section: with it the model has the margin that was promised.
TEST_F(SizeChoose, TheTextOfTheChoiceIsAModel) {
  ASSERT_EQ(
      Choose("catalogue: one\nmotors: {A: {continuous: 0.1, peak: 1, rotor_inertia: 1e-6, "
             "torque_constant: 0.1, resistance: 2, mass: 1, gearboxes: [G], thermal: "
             "{winding_to_housing: 1, "
             "housing_to_ambient: 2, winding_time: 9, housing_time: 99, max_winding_C: 99}}}\n"
             "gearboxes: {G: {ratio: 2, efficiency: 0.9, inertia: 1e-7, mass: 1, "
             "peak_torque: 3, exponent: 10/3, mean_torque: 0.01}}\n")
          .exit_code,
      0);
  const auto choice = Chosen();
  for (const auto& candidate : choice["drives"][0]["candidates"]) {
    if (!candidate["chosen"]) continue;
    Write("model.yaml", kModel + choice["model_text"].get<std::string>());
    (void)mbverify("size " + File("slow.yaml") + " " + File("fast.yaml") + " --json " +
                   File("again.json"));
    const auto again = nlohmann::json::parse(ReadAll(File("again.json")))["motors"][0];
    EXPECT_NEAR(again["margin"].get<double>(), candidate["margin"].get<double>(), 1e-9);
    EXPECT_EQ(again["limited_by"], candidate["limited_by"]);
    return;
  }
  FAIL() << choice.dump(2);
}

// Just above and just below the margin.
TEST_F(SizeChoose, TheMarginDecides) {
  const auto catalogue = [](double peak) {
    return fmt::format("catalogue: one\nmotors: {{A: {{peak: {:.17g}, mass: 1}}}}\n", peak);
  };
  const double needed = kForce / 1000;
  EXPECT_EQ(Choose(catalogue(1.5 * needed * (1 + 1e-9)), " --margin 1.5").exit_code, 0);
  const ProgramResult small = Choose(catalogue(1.5 * needed * (1 - 1e-9)), " --margin 1.5");
  EXPECT_EQ(small.exit_code, 1);
  EXPECT_NE(small.out.find("x: nothing in 'one' has the margin 1.5"), std::string::npos)
      << small.out;
  EXPECT_EQ(Chosen()["drives"][0]["motor"], "");
}

TEST_F(SizeChoose, BadCataloguesAndModelsWithoutMotorsAreRefused) {
  const ProgramResult none = Choose("catalogue: one\nmotors: {A: {peak: 1, cost: 3}}\n");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("motors.A has no mass"), std::string::npos) << none.err;
  EXPECT_EQ(Choose("catalogue: one\nmotors: {A: {peak: x}}\n").exit_code, 2);
  EXPECT_EQ(Choose("catalogue: one\nmotors: {A: {mass: 1, gearboxes: [none], kind: linear, "
                   "peak: 1}}\n")
                .exit_code,
            1);
  EXPECT_EQ(Chosen()["drives"][0]["candidates"][0]["limited_by"], "it slides, the model's turns");
  Write("catalogue.yaml", "catalogue: one\nmotors: {A: {mass: 1, peak: 1}}\n");
  EXPECT_EQ(mbverify("check " + File("catalogue.yaml")).exit_code, 0);
  const ProgramResult bare =
      mbverify("size " + File("none.yaml") + " --choose " + File("catalogue.yaml"));
  EXPECT_EQ(bare.exit_code, 2);
  EXPECT_NE(bare.err.find("motors: {DRIVE: {}}"), std::string::npos) << bare.err;
}

}  // namespace
}  // namespace mbv
