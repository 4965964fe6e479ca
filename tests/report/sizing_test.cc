// Motors and tables of a motion for terminals, pages and JSON.
#include "report/sizing.h"

#include <gtest/gtest.h>

#include <limits>

#include "report/sections.h"

namespace mbv {
namespace {

MotorLoad LoadWith(double peak, double use, const std::string& witness = "reference") {
  MotorLoad load{.drive = "d1", .witness = witness, .torque_unit = "N m", .speed_unit = "rad/s"};
  load.time_s = {0.0, 1.0};
  load.torque = Eigen::Vector2d(peak, 0.5);
  load.speed = Eigen::Vector2d(3.0, -4.0);
  load.peak_torque = peak;
  load.rms_torque = 1.25;
  load.mean_torque = 0.75;
  load.peak_speed = 4.0;
  load.mean_speed = 3.5;
  load.peak_power = 6.0;
  load.peak_brake_power = -2.0;
  load.energy_J = 2.5;
  load.brake_energy_J = -0.5;
  load.duty = 0.9;
  load.above_continuous = 0.1;
  load.continuous_torque = 2.0;
  load.inertia_ratio = 3.0;
  load.uses = {{"peak", use, 0.0}, {"continuous", 0.625, kNan}};
  return load;
}

Report Sized(const std::string& scenario, double peak, double use) {
  Report report;
  report.scenario = scenario;
  report.drives = {"d1"};
  Motor motor;
  motor.drive = 0;
  motor.continuous = 2.0;
  motor.peak = 4.0;
  report.motors = {motor};
  report.motor_loads = {LoadWith(peak, use), LoadWith(99.0, 9.0, "simulated")};
  return report;
}

std::string Joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

TEST(Sizing, SamplesAtRestAreReported) {
  Report report = Sized("a", 3.2, 0.8);
  report.motor_loads[0].samples_at_rest = 1;
  const std::string reported = "friction rests at 1 of 2 samples: the worse end of the band counts";
  EXPECT_NE(Joined(SizingLines(report, true)).find("  " + reported + "\n"), std::string::npos);
  EXPECT_NE(SizingHtml(report).find("d1: " + reported + "."), std::string::npos);
  EXPECT_EQ(SizingJson(report)[0]["samples_at_rest"], 1);
}

TEST(Sizing, ALinePerMotorAndAllFiguresOnDemand) {
  const Report report = Sized("a", 3.2, 0.8);
  EXPECT_EQ(Joined(SizingLines(report, false)), "motor of d1: margin 1.25 (peak)\n");
  EXPECT_EQ(Joined(SizingLines(report, true)),
            "motor of d1: margin 1.25 (peak)\n"
            "  torque: peak 3.2 N m, RMS 1.25 N m, mean 0.75 N m; continuous limit 2 N m\n"
            "  speed: peak 4 rad/s, mean 3.5 rad/s; in motion 90 % of the time, above the "
            "continuous torque 10 %\n"
            "  power: driving 6 W, braking -2 W; energy per cycle 2.5 J and -0.5 J\n"
            "  load inertia / rotor inertia at home: 3\n"
            "  used: peak 80 %, continuous 62.5 %\n");
  EXPECT_TRUE(SizingLines(Report(), true).empty());
}

// Only what the motor states is reported.
TEST(Sizing, WindingGearboxBrakeAndLinkAreReported) {
  Report report = Sized("a", 3.2, 0.8);
  MotorLoad& load = report.motor_loads[0];
  load.winding_peak_C = 120.5;
  load.housing_peak_C = 80.0;
  load.overheated_s = 900.0;
  load.gear_torque = 20.0;
  load.gear_mean_torque = 12.0;
  load.gear_emergency_torque = 30.0;
  load.holding_torque = 0.4;
  load.stop_energy_J = std::numeric_limits<double>::infinity();
  report.link_loads = {{.witness = "reference",
                        .peak_power = 50.0,
                        .drawn_J = 9.0,
                        .fed_back_J = 3.0,
                        .capacitor_J = 1.0,
                        .resistor_J = 2.0,
                        .resistor_mean = 2.0,
                        .resistor_peak = 8.0,
                        .uses = {{"brake resistor, mean", 0.5, kNan}}}};
  const std::string text = Joined(SizingLines(report, true));
  for (const char* line :
       {"  winding of the repeated motion: at most 120.5 °C, housing 80 °C; repeated from ambient "
        "temperature, it is too hot after 900 s\n",
        "  gearbox, at its output: peak 20 N m, mean 12 N m, emergency 30 N m\n",
        "  brake: holds 0.4 N m, one stop is not possible\n",
        "DC link: margin 2 (brake resistor, mean)\n  drawn 9 J per cycle, at most 50 W; fed back 3 "
        "J: capacitor 1 J, resistor 2 J\n  resistor: mean 2 W, peak 8 W; used: brake resistor, "
        "mean 50 %\n"}) {
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
  }
  EXPECT_NE(SizingHtml(report).find("brake: holds 0.4 N m"), std::string::npos);
  EXPECT_EQ(SizingJson(report)[0]["gearbox"]["mean"], 12.0);
  EXPECT_EQ(LinkJson(report)[0]["resistor_W"]["peak"], 8.0);
  std::optional<LinkEnvelope> link;
  Widen(report.link_loads[0], "a", &link);
  LinkLoad more = report.link_loads[0];
  more.uses[0].use = 0.8;
  Widen(more, "b", &link);
  EXPECT_EQ(ToText(*link),
            "DC link: fed back 3 J (a), resistor mean 2 W (a), peak 8 W (a); margin 1.25 (brake "
            "resistor, mean, b)\n");
}

TEST(Sizing, TheJsonHasEveryWitness) {
  const auto json = SizingJson(Sized("a", 3.2, 0.8));
  ASSERT_EQ(json.size(), 2u);
  EXPECT_EQ(json[0]["margin"], 1.25);
  EXPECT_EQ(json[0]["limited_by"], "peak");
  EXPECT_EQ(json[0]["torque"]["rms"], 1.25);
  EXPECT_EQ(json[0]["power_W"]["braking"], -2.0);
  EXPECT_TRUE(json[0]["current_A"]["rms"].is_null());
  EXPECT_EQ(json[1]["witness"], "simulated");
}

TEST(Sizing, ThePageDrawsTorqueOverSpeed) {
  const std::string html = SizingHtml(Sized("a", 3.2, 0.8));
  EXPECT_NE(html.find("d1: torque over speed, at the motor"), std::string::npos);
  EXPECT_NE(html.find("continuous"), std::string::npos);
  EXPECT_NE(html.find("1.25"), std::string::npos);
  EXPECT_EQ(html.find("simulated"), std::string::npos);
  EXPECT_EQ(SizingHtml(Report()), "");
}

TEST(Sizing, EnvelopesNameTheScenarioThatAsksForMost) {
  std::vector<MotorEnvelope> envelopes;
  Widen(Sized("slow", 3.2, 0.8), &envelopes);
  Widen(Sized("fast", -3.0, 1.25), &envelopes);
  ASSERT_EQ(envelopes.size(), 1u);
  EXPECT_EQ(envelopes[0].peak_torque.value, 3.2);
  EXPECT_EQ(envelopes[0].peak_torque.scenario, "slow");
  EXPECT_EQ(envelopes[0].use.scenario, "fast");
  EXPECT_EQ(envelopes[0].brake_power.value, 2.0);
  EXPECT_DOUBLE_EQ(envelopes[0].margin(), 0.8);
  EXPECT_NE(ToText(envelopes).find("0.8  peak, fast"), std::string::npos) << ToText(envelopes);
  const std::string json = ToJson(envelopes, {}, {"slow", "fast"});
  EXPECT_NE(json.find("\"schema\": \"mbverify.sizing/1\""), std::string::npos);
  EXPECT_NE(json.find("\"margin\": 0.8"), std::string::npos) << json;
}

Report WithTable(const char* smoothing) {
  Report report;
  report.tables.push_back({.name = "crank",
                           .file = "a.csv",
                           .column = "angle (deg)",
                           .unit = "rad",
                           .rows = 41,
                           .to_s = 1.0,
                           .periodic = true,
                           .with_rates = true,
                           .moves = true,
                           .smoothing = smoothing,
                           .deviation = 1e-4,
                           .change_rms = 1e-4,
                           .change_max = 3e-4,
                           .acceleration_change_rms = 3.0,
                           .acceleration_change_max = 9.0,
                           .acceleration_rms = 4.0,
                           .spline = nullptr,
                           .interpolated = nullptr,
                           .notes = {"a note"}});
  return report;
}

TEST(MotionTables, TellWhatSmoothingDoes) {
  Report report = WithTable("auto");
  report.smoothed_forces = {{"crank", "N m", 5.0, 0.25, 1.5}};
  EXPECT_EQ(
      ToText(MotionTableSection(report, true)),
      "\n  crank follows column 'angle (deg)' of a.csv: 41 rows with rates, 0 … 1 s, repeated; "
      "smoothing: auto, deviation 0.0001 rad\n"
      "    smoothing changes it by RMS 1.00e-04, at most 3.00e-04 rad, the second derivative "
      "by RMS 3.00e+00, at most 9.00e+00 rad/s² (RMS of all: 4)\n"
      "    a note\n"
      "\n"
      "  What smoothing takes out of the drive forces\n"
      "  drive  force, RMS    change, RMS  change, largest\n"
      "  crank       5 N m  2.500e-01 N m    1.500e+00 N m\n");
  const auto json = MotionTableJson(report);
  EXPECT_EQ(json["tables"][0]["acceleration_change_rms"], 3.0);
  EXPECT_DOUBLE_EQ(json["tables"][0]["noise_share"], 9.0 / 25.0);
  EXPECT_EQ(json["smoothed_forces"][0]["change_max"], 1.5);
  EXPECT_NE(ToHtml(MotionTableSection(report, true)).find("What smoothing takes out"),
            std::string::npos);
  EXPECT_TRUE(MotionTableSection(Report(), true).blocks.empty());
}

TEST(MotionTables, WithoutSmoothingTheySayWhatItWouldDo) {
  const Report report = WithTable("none");
  EXPECT_NE(ToText(MotionTableSection(report, false)).find("smoothing: auto would change it by"),
            std::string::npos);
  EXPECT_DOUBLE_EQ(report.tables[0].noise_share(), 9.0 / 16.0);
  // What is next to nothing is reported on demand.
  Report exact = WithTable("none");
  exact.tables[0].acceleration_change_rms = 1e-6;
  const auto lines = [&](bool verbose) {
    const std::string text = ToText(MotionTableSection(exact, verbose));
    return std::ranges::count(text, '\n');
  };
  EXPECT_EQ(lines(false), 2);  // the first one is blank
  EXPECT_EQ(lines(true), 4);
}

}  // namespace
}  // namespace mbv
