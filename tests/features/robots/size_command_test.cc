// mbverify size, run --sizing and checks: {motor_margin} as a user types them, with forces by hand:
// 2 kg on a sine of 0.1 m ask for 0.2 (2π/T)² N.
#include <gtest/gtest.h>

#include <cmath>
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

}  // namespace
}  // namespace mbv
