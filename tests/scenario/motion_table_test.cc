// Tables and laws in scenario files: what they give, and what is said about wrong ones.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "base/inputs.h"
#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

using std::numbers::pi;

class MotionTableTest : public testing::Test {
 protected:
  MotionTableTest() : folder_("motion_table") {}

  // `motor` is the command of the crank; `more` stands below `motion:`.
  [[nodiscard]] ScenarioResult Load(const std::string& motor,
                                    const std::string& more = "duration_s: 1") const {
    const std::string text = std::string("mechanism: ") + kSourceDir +
                             "/models/four_bar/model.yaml\nmotion:\n  " + more +
                             "\n  commands:\n    motor: " + motor + "\nanalytic: none\n";
    return LoadScenarioText(text, folder_.PathOf("s.yaml"));
  }
  [[nodiscard]] std::string Messages(const std::string& motor,
                                     const std::string& more = "duration_s: 1") const {
    std::string text = Load(motor, more).diagnostics.Text();
    const std::string path = folder_.PathOf("");
    for (size_t at = 0; (at = text.find(path)) != std::string::npos;) text.erase(at, path.size());
    return text;
  }
  [[nodiscard]] Profile MotorProfile(const std::string& motor,
                                     const std::string& more = "duration_s: 1") const {
    const ScenarioResult result = Load(motor, more);
    EXPECT_TRUE(result.scenario) << result.diagnostics.Text();
    return result.scenario ? result.scenario->motion.commands[0].profile : Profile{};
  }

  // f at 0, h, … with a rate column.
  template <typename F>
  void WriteTable(const std::string& name, int rows, double h, const F& f) const {
    std::string text = "t (s);angle (deg);speed (deg/s)\n";
    for (int i = 0; i < rows; ++i) {
      const Jet jet = f(i * h);
      text += fmt::format("{:.12g};{:.12g};{:.12g}\n", i * h, jet.value * 180 / pi,
                          jet.rate * 180 / pi);
    }
    folder_.Write(name, text);
  }

  test::TestFolder folder_;
};

Jet Swing(double t) {
  return {1.5 + 0.2 * std::sin(3 * t), 0.6 * std::cos(3 * t), -1.8 * std::sin(3 * t)};
}
Jet Round(double t) {
  const double w = 2 * pi;
  return {w * t + 0.1 * std::sin(w * t), w + 0.1 * w * std::cos(w * t),
          -0.1 * w * w * std::sin(w * t)};
}

TEST_F(MotionTableTest, ColumnsUnitsAndTimesAreThoseOfReferenceTables) {
  WriteTable("a.csv", 41, 0.025, Swing);
  const Profile profile = MotorProfile("{table: {csv: a.csv, column: angle}}");
  for (const double t : {0.0, 0.31, 0.77, 1.0}) {
    EXPECT_NEAR(Evaluate(profile, t).value, Swing(t).value, 1e-10) << t;
    EXPECT_NEAR(Evaluate(profile, t).rate, Swing(t).rate, 1e-7) << t;
    EXPECT_NEAR(Evaluate(profile, t).acceleration, Swing(t).acceleration, 2e-5) << t;
  }
  // Sign, scale, offset and a clock that runs before the motion does.
  const Profile turned = MotorProfile(
      "{table: {csv: a.csv, column: 2, sign: -1, scale: 2, offset: 10, time_offset_s: -0.5}}",
      "duration_s: 0.5");
  EXPECT_NEAR(Evaluate(turned, 0.2).value, -2 * Swing(0.7).value + 10 * pi / 180, 1e-10);
}

TEST_F(MotionTableTest, RatesAreHonoured) {
  WriteTable("a.csv", 11, 0.1, Swing);
  const Profile alone = MotorProfile("{table: {csv: a.csv, column: angle}}");
  const Profile both = MotorProfile("{table: {csv: a.csv, column: angle, rate: speed}}");
  const auto worst = [](const Profile& profile) {
    double error = 0.0;
    for (double t = 0.0; t < 1.0; t += 0.013) {
      error = std::max(error, std::abs(Evaluate(profile, t).rate - Swing(t).rate));
    }
    return error;
  };
  EXPECT_LT(worst(both), 0.2 * worst(alone));
}

TEST_F(MotionTableTest, TheMotionEndsWithItsTable) {
  WriteTable("a.csv", 41, 0.025, Swing);
  const ScenarioResult result = Load("{table: {csv: a.csv, column: angle}}", "sample_s: 0.1");
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  EXPECT_DOUBLE_EQ(result.scenario->motion.duration_s, 1.0);
  ASSERT_EQ(result.scenario->motion.tables.size(), 1u);
  EXPECT_EQ(result.scenario->motion.tables[0].rows, 41u);
}

TEST_F(MotionTableTest, ItsFileIsAnInput) {
  WriteTable("a.csv", 41, 0.025, Swing);
  const InputWatch watch;
  EXPECT_TRUE(Load("{table: {csv: a.csv, column: angle}}").scenario);
  bool found = false;
  for (const InputFile& file : watch.files()) found = found || file.file.ends_with("a.csv");
  EXPECT_TRUE(found);
}

TEST_F(MotionTableTest, RoundsAreRepeatedWithTheirTurns) {
  WriteTable("a.csv", 41, 0.025, Round);
  const Profile profile =
      MotorProfile("{table: {csv: a.csv, column: angle, periodic: true}}", "duration_s: 3");
  for (const double t : {0.3, 1.3, 2.9}) {
    EXPECT_NEAR(Evaluate(profile, t).value, Round(t).value, 1e-9) << t;
    EXPECT_NEAR(Evaluate(profile, t).acceleration, Round(t).acceleration, 1e-3) << t;
  }
}

// Noise of 1e-4 rad in rows 2 ms apart makes some 50 rad/s² of noise in the second derivative.
TEST_F(MotionTableTest, NoiseIsReportedAndTakenOut) {
  std::mt19937_64 random(20260722);
  std::normal_distribution<double> noise(0.0, 1e-4);
  WriteTable("a.csv", 501, 0.002, [&](double t) {
    Jet jet = Swing(t);
    jet.value += noise(random);
    return jet;
  });
  const ScenarioResult rough = Load("{table: {csv: a.csv, column: angle}}");
  ASSERT_TRUE(rough.scenario);
  const std::string text = rough.diagnostics.Text();
  EXPECT_NE(text.find("the second derivative of a.csv is mostly noise: 100 %"), std::string::npos)
      << text;
  EXPECT_NE(text.find("smoothing: auto"), std::string::npos) << text;
  const ScenarioResult smooth = Load("{table: {csv: a.csv, column: angle, smoothing: auto}}");
  ASSERT_TRUE(smooth.scenario);
  EXPECT_EQ(smooth.diagnostics.Text(), "");
  const MotionTable& table = smooth.scenario->motion.tables[0];
  EXPECT_NEAR(table.deviation, 1e-4, 2e-5);
  EXPECT_NEAR(table.change_rms, 1e-4, 2e-5);
  EXPECT_GT(table.acceleration_change_rms, 20.0);
  EXPECT_GT(table.noise_share(), 0.99);
  EXPECT_NEAR(Evaluate(*table.spline, 0.5).acceleration, Swing(0.5).acceleration, 0.3);
  EXPECT_GT(std::abs(Evaluate(*table.interpolated, 0.5).acceleration - Swing(0.5).acceleration),
            1.0);
  // Twice the deviation is smoother still; in the column's own unit.
  const ScenarioResult stated =
      Load(fmt::format("{{table: {{csv: a.csv, column: angle, smoothing: {}}}}}", 2e-4 * 180 / pi));
  ASSERT_TRUE(stated.scenario);
  EXPECT_NEAR(stated.scenario->motion.tables[0].change_rms, 2e-4, 2e-5);
}

// Sines of half, once and twice the cut-off: 64/65, 1/2 and 1/65 of them pass.
TEST_F(MotionTableTest, AStatedCutOffIsTheFilterThatIsDocumented) {
  constexpr double kCutoffHz = 5.0;
  for (const double factor : {0.5, 1.0, 2.0}) {
    WriteTable("sine.csv", 801, 0.005, [&](double t) {
      return Jet{1.5 + 0.1 * std::sin(2 * pi * factor * kCutoffHz * t), 0.0, 0.0};
    });
    const ScenarioResult result = Load(
        "{table: {csv: sine.csv, column: angle, smoothing: {cutoff_hz: 5}}}", "sample_s: 0.01");
    ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
    const MotionTable& table = result.scenario->motion.tables[0];
    EXPECT_EQ(table.cutoff_hz, kCutoffHz);
    double amplitude = 0.0;
    for (double t = 1.5; t < 2.5; t += 1e-3) {
      amplitude = std::max(amplitude, std::abs(Evaluate(*table.spline, t).value - 1.5));
    }
    EXPECT_NEAR(amplitude, 0.1 / (1.0 + std::pow(factor, 6)), 2e-4) << factor;
  }
  WriteTable("sine.csv", 801, 0.005, Swing);
  EXPECT_NE(
      Messages("{table: {csv: sine.csv, column: angle, smoothing: {cutoff_hz: 100}}}",
               "sample_s: 0.01")
          .find("smoothing.cutoff_hz = 100 violates < 100, half of the frequency of the rows"),
      std::string::npos);
}

TEST_F(MotionTableTest, ExactTablesAreNotDoubted) {
  WriteTable("a.csv", 41, 0.025, Swing);
  EXPECT_EQ(Messages("{table: {csv: a.csv, column: angle, rate: speed}}"), "");
}

TEST_F(MotionTableTest, WrongTablesAreReportedWithPlaceAndHint) {
  WriteTable("a.csv", 41, 0.025, Swing);
  WriteTable("round.csv", 40, 0.025, Round);
  folder_.Write("few.csv", "t,x\n0,1\n1,2\n2,3\n3,4\n");
  EXPECT_EQ(Messages("{table: {csv: none.csv}}"),
            "s.yaml:5:26: error: motion.commands.motor.table.csv = 'none.csv' cannot be read\n"
            "  hint: the path is taken from the scenario's folder: none.csv\n");
  EXPECT_EQ(Messages("{table: {csv: a.csv, colum: angle}}"),
            "s.yaml:5:33: error: motion.commands.motor.table: unknown key 'colum'\n"
            "  hint: did you mean 'column'?\n");
  EXPECT_EQ(Messages("{table: {csv: a.csv, column: angel}}"),
            "s.yaml:5:20: error: motion.commands.motor.table: a.csv has no column 'angel'\n"
            "  hint: did you mean 'angle'?\n");
  EXPECT_EQ(
      Messages("{table: {csv: a.csv, column: angle, unit: mm}}"),
      "s.yaml:5:54: error: motion.commands.motor.table.unit: 'mm' is not a unit of motor, which is "
      "in rad\n"
      "  hint: did you mean 'm'?\n");
  EXPECT_EQ(
      Messages("{table: {csv: a.csv, column: angle, smoothing: some}}"),
      "s.yaml:5:59: error: motion.commands.motor.table.smoothing = 'some' has the unknown symbol "
      "'some'\n");
  EXPECT_EQ(Messages("{table: {csv: a.csv, column: angle, smoothing: -1}}"),
            "s.yaml:5:59: error: motion.commands.motor.table.smoothing = -1 violates "
            "motion.commands.motor.table.smoothing > 0\n");
  EXPECT_EQ(
      Messages("{table: {csv: few.csv, column: x, unit: rad}}", "duration_s: 3"),
      "s.yaml:5:26: error: motion.commands.motor.table: few.csv has 4 rows, a motion needs 6 at "
      "least\n");
  EXPECT_EQ(Messages("{table: {csv: a.csv, column: angle}}", "duration_s: 1.5"),
            "s.yaml:5:26: error: motion.commands.motor.table: a.csv gives 0 … 1 s, but the motion "
            "lasts 0 … 1.5 s\n"
            "  hint: state a shorter motion.duration_s, or periodic: true if it repeats\n");
  EXPECT_EQ(
      Messages("{table: {csv: a.csv, column: angle, time_offset_s: 0.2}}"),
      "s.yaml:5:26: error: motion.commands.motor.table: a.csv gives 0.2 … 1.2 s, but the motion "
      "lasts 0 … 1 s\n"
      "  hint: if the motion starts with its first row, add time_offset_s: -0.2 to what is "
      "stated; state a shorter motion.duration_s, or periodic: true if it repeats\n");
  EXPECT_EQ(
      Messages("{table: {csv: round.csv, column: angle, periodic: true}}"),
      "s.yaml:5:26: error: motion.commands.motor.table.periodic: the value jumps by 0.1727 rad "
      "where round.csv begins again (from 6.11046 to 0); at most 6.1e-06 is round-off or noise\n"
      "  hint: the last row repeats the first one, a period later\n"
      "s.yaml:5:26: warning: motion.commands.motor.table.periodic: the acceleration jumps by "
      "-1.474 rad/s² where round.csv begins again (from 1.04145 to -0.432486); at most 0.6 "
      "is round-off or noise\n"
      "  hint: the last row repeats the first one, a period later\n");
  EXPECT_EQ(Messages("{table: {csv: a.csv, column: angle, rate: {column: speed, sign: -1}}}"),
            "s.yaml:5:54: warning: motion.commands.motor.table.rate: the column differs from the "
            "derivative of the positions by 200 % (RMS)\n"
            "  hint: is it another column, or does it need sign or unit?\n");
}

TEST_F(MotionTableTest, WrongLawsAreReportedWithPlaceAndHint) {
  EXPECT_EQ(
      Messages("{s_curve: {delta: 1, v_max: 0, a_max_mm: 2, j_max: -1}}"),
      "s.yaml:5:40: error: motion.commands.motor.s_curve.v_max = 0 violates "
      "motion.commands.motor.s_curve.v_max > 0\n"
      "s.yaml:5:53: error: motion.commands.motor.s_curve.a_max_mm is given, but this value is in "
      "rad\n"
      "  hint: write motion.commands.motor.s_curve.a_max\n"
      "s.yaml:5:63: error: motion.commands.motor.s_curve.j_max = -1 violates "
      "motion.commands.motor.s_curve.j_max > 0\n");
  EXPECT_EQ(Messages("{trapezoid: {delta: 1, v_max: 1, j_max: 2}}"),
            "s.yaml:5:24: error: motion.commands.motor.trapezoid: 'a_max' is missing\n"
            "s.yaml:5:45: error: motion.commands.motor.trapezoid: unknown key 'j_max'\n"
            "  hint: did you mean 'v_max'?\n");
  EXPECT_EQ(
      Messages("{fourier: {a: [1, 2], b: [1], period_s: 1}}"),
      "s.yaml:5:22: error: motion.commands.motor.fourier: 2 numbers a and 1 numbers b violate 1 <= "
      "count of a = count of b\n"
      "  hint: write 0 for a harmonic that is left out\n");
  EXPECT_EQ(
      Messages("{fourier: {a: [1], b: [1]}}"),
      "s.yaml:5:22: error: motion.commands.motor.fourier needs one of frequency_hz and period_s\n");
  EXPECT_EQ(Messages("{via: {times_s: [0, 1, 1], values_deg: [0, 10, 20]}}"),
            "s.yaml:5:28: error: motion.commands.motor.via.times_s: 1 after 1 violates increasing "
            "times\n");
  EXPECT_EQ(
      Messages("{via: {times_s: [0, 1], values: [0]}}"),
      "s.yaml:5:28: error: motion.commands.motor.via: 2 times and 1 values violate 2 <= count of "
      "times_s = count of values\n");
  EXPECT_EQ(Messages("{via: {times_s: [0, 1], values: [0, 1], rests_s: [0.5]}}"),
            "s.yaml:5:61: error: motion.commands.motor.via.rests_s = 0.5 is not one of times_s\n"
            "  hint: rests_s: all rests at every point\n");
  EXPECT_EQ(Messages("{modified_sin: {duration_s: 1, delta: 1}}"),
            "s.yaml:5:13: error: motion.commands.motor: unknown key 'modified_sin'\n"
            "  hint: did you mean 'modified_sine'?\n");
}

TEST_F(MotionTableTest, LawsAreReadInTheirUnits) {
  const Profile s_curve = MotorProfile(
      "{s_curve: {start_s: 0.1, delta_deg: 90, v_max_deg: 360, a_max_deg: 3600, j_max_deg: 1e5}}");
  EXPECT_NEAR(Evaluate(s_curve, 1.0).value, pi / 2, 1e-15);
  EXPECT_NEAR(Evaluate(s_curve, 0.26).rate, 2 * pi, 1e-12);
  const Profile fourier =
      MotorProfile("{fourier: {period_s: 2, a_deg: [180], b_deg: [0], offset_deg: 30}}");
  EXPECT_NEAR(Evaluate(fourier, 0.5).value, pi / 6 + 1.0, 1e-14);
  const Profile via =
      MotorProfile("[1, {via: {times_s: [0, 0.4, 1], values_deg: [0, 90, -90], rests_s: [0.4]}}]");
  EXPECT_NEAR(Evaluate(via, 0.4).value, 1 + pi / 2, 1e-14);
  EXPECT_NEAR(Evaluate(via, 0.4).rate, 0.0, 1e-13);
  EXPECT_NEAR(Evaluate(MotorProfile("{modified_sine: {duration_s: 1, delta: 2}}"), 0.5).value, 1.0,
              1e-15);
  EXPECT_NEAR(Evaluate(MotorProfile("{poly4567: {duration_s: 2, delta: 2}}"), 1.0).rate, 2.1875,
              1e-14);
  EXPECT_NEAR(Evaluate(MotorProfile("{trapezoid: {delta: 1, v_max: 2, a_max: 8}}"), 0.25).value,
              0.25, 1e-15);
  // No way, no motion.
  EXPECT_EQ(
      Evaluate(MotorProfile("[0, {s_curve: {delta: 0, v_max: 2, a_max: 8, j_max: 9}}]"), 0.5).value,
      0.0);
}

// A motor's angle without a unit: degrees where round numbers or turns to and fro say so.
TEST_F(MotionTableTest, AnglesThatOnlyMakeSenseInDegreesAreDoubted) {
  const auto messages = [&](double size, double frequency, const std::string& more = "") {
    std::string text = "t (s),angle\n";
    for (int i = 0; i <= 100; ++i) {
      const double t = 0.01 * i;
      text += fmt::format("{:.9g},{:.9g}\n", t,
                          frequency > 0.0 ? size * std::sin(2.0 * pi * frequency * t) : size * t);
    }
    folder_.Write("a.csv", text);
    return Messages("{table: {csv: a.csv, column: angle" + more + "}}");
  };
  const char* warning = "a.csv:1:7: warning: angle has no unit";
  EXPECT_NE(messages(45.0, 1.0).find(warning), std::string::npos) << messages(45.0, 1.0);
  EXPECT_NE(messages(360.0, 0.0).find(warning), std::string::npos);
  EXPECT_NE(messages(37.3, 1.0).find("are they degrees? state unit: deg (or rad)"),
            std::string::npos);
  EXPECT_EQ(messages(45.0, 1.0, ", unit: deg").find("no unit"), std::string::npos);
  // Radians: a swing, a spindle of ten turns, and a steady speed.
  EXPECT_EQ(messages(0.785, 1.0).find("no unit"), std::string::npos);
  EXPECT_EQ(messages(20.0 * pi, 0.0).find("no unit"), std::string::npos);
  EXPECT_EQ(messages(20.0, 0.0).find("no unit"), std::string::npos);
}

TEST_F(MotionTableTest, WhatGoesOnAfterTheMotionIsNamed) {
  WriteTable("swing.csv", 301, 0.01, Swing);
  const std::string table = "{table: {csv: swing.csv, column: \"angle (deg)\", time: \"t (s)\"}}";
  const std::string over = Messages(table);
  EXPECT_NE(
      over.find("s.yaml:5:26: warning: motion.commands.motor.table: swing.csv goes on to 3 s, "
                "but the motion ends at 1 s: 67 % of it is not used"),
      std::string::npos)
      << over;
  EXPECT_EQ(Messages(table, "duration_s: 2.98").find("goes on"), std::string::npos);
  EXPECT_EQ(Messages(table, "duration_s: 3").find("goes on"), std::string::npos);
  EXPECT_NE(Messages(table, "duration_s: 3.5").find("error: "), std::string::npos);
  const std::string brief = Messages(table, "duration_s: 0.005\n  sample_s: 0.001");
  EXPECT_NE(brief.find("time_unit: ms"), std::string::npos) << brief;
}

TEST_F(MotionTableTest, LawsThatTheMotionCutsOffAreNamed) {
  for (const char* law :
       {"poly345: {start_s: 0.5, duration_s: 0.8, delta: 1}", "bump: {duration_s: 1.2, height: 1}",
        "cycloid: {start_s: 0.9, duration_s: 0.2, delta: 1}",
        "via: {times_s: [0, 0.5, 1.5], values: [0, 1, 2]}",
        "trapezoid: {delta: 3, v_max: 1, a_max: 10}",
        "s_curve: {delta: 3, v_max: 1, a_max: 10, j_max: 100}"}) {
    const std::string text = Messages("[home, {" + std::string(law) + "}]");
    const std::string name = std::string(law).substr(0, std::string(law).find(':'));
    EXPECT_NE(text.find("motion.commands.motor[1]." + name + ": ends at "), std::string::npos)
        << text;
    EXPECT_NE(text.find("but the motion at 1 s: it is cut off"), std::string::npos) << text;
    EXPECT_EQ(Messages("[home, {" + std::string(law) + "}]", "duration_s: 4").find("cut off"),
              std::string::npos);
  }
  EXPECT_NE(Messages("[home, {poly345: {start_s: 2, duration_s: 1, delta: 1}}]")
                .find("begins at 2 s, when the motion of 1 s is over"),
            std::string::npos);
  // One that ends with the motion, and one that does not end.
  EXPECT_EQ(Messages("[home, {poly345: {start_s: 0.5, duration_s: 0.5, delta: 1}}]"), "");
  EXPECT_EQ(Messages("[home, {sine: {amplitude: 0.1, period_s: 7}}]"), "");
}

}  // namespace
}  // namespace mbv
