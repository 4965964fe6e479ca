// mbverify log as a user types it: a log made of a run's own result comes back, and what is done to
// it is named with its number.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <sstream>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

// Two motors that close a loop over two rods.
constexpr const char* kFiveBar = R"(<robot name="five_bar">
  <link name="base"/>
  <link name="left_crank">
    <inertial><origin xyz="0.1 0 0"/><mass value="0.4"/><inertia ixx="1e-4" iyy="1.4e-3" izz="1.4e-3" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="right_crank">
    <inertial><origin xyz="0.1 0 0"/><mass value="0.4"/><inertia ixx="1e-4" iyy="1.4e-3" izz="1.4e-3" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="left_rod">
    <inertial><origin xyz="0.15 0 0"/><mass value="0.5"/><inertia ixx="1e-4" iyy="3.8e-3" izz="3.8e-3" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="right_rod">
    <inertial><origin xyz="0.15 0 0"/><mass value="0.5"/><inertia ixx="1e-4" iyy="3.8e-3" izz="3.8e-3" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="left_tip"/>
  <link name="right_tip"/>
  <joint name="left_motor" type="continuous"><parent link="base"/><child link="left_crank"/><origin rpy="0 -2 0"/><axis xyz="0 -1 0"/></joint>
  <joint name="right_motor" type="continuous"><parent link="base"/><child link="right_crank"/><origin xyz="0.2 0 0" rpy="0 -1.1 0"/><axis xyz="0 -1 0"/></joint>
  <joint name="left_elbow" type="continuous"><parent link="left_crank"/><child link="left_rod"/><origin xyz="0.2 0 0"/><axis xyz="0 -1 0"/></joint>
  <joint name="right_elbow" type="continuous"><parent link="right_crank"/><child link="right_rod"/><origin xyz="0.2 0 0"/><axis xyz="0 -1 0"/></joint>
  <joint name="left_end" type="fixed"><parent link="left_rod"/><child link="left_tip"/><origin xyz="0.3 0 0"/></joint>
  <joint name="right_end" type="fixed"><parent link="right_rod"/><child link="right_tip"/><origin xyz="0.3 0 0"/></joint>
</robot>
)";

constexpr double kRowStep = 0.004;

// Columns of a traces.csv by heading.
using Columns = std::map<std::string, std::vector<double>>;
Columns ReadColumns(const std::string& text) {
  std::stringstream lines(text);
  std::string line, cell;
  std::getline(lines, line);
  std::vector<std::string> names;
  for (std::stringstream cells(line); std::getline(cells, cell, ',');) names.push_back(cell);
  Columns columns;
  while (std::getline(lines, line)) {
    std::stringstream cells(line);
    for (size_t k = 0; std::getline(cells, cell, ','); ++k) {
      columns[names.at(k)].push_back(std::strtod(cell.c_str(), nullptr));
    }
  }
  return columns;
}

class LogCommand : public testing::Test {
 protected:
  LogCommand() {
    Write("five_bar.urdf", kFiveBar);
    Write("five_bar.yaml",
          "closed_loop: [[left_tip, right_tip]]\ntype: [3d]\nname_mot: [left_motor, "
          "right_motor]\n");
  }

  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(mbverify.folder() / name, std::ios::binary) << text;
  }
  [[nodiscard]] std::string File(const std::string& name) const {
    return (mbverify.folder() / name).string();
  }

  // The reference along a motion of sines: what a perfect robot would log.
  void RunMotion() {
    const ProgramResult first = mbverify("run " + File("five_bar.urdf") +
                                         " --no-pictures --no-report --out " + File("out"));
    ASSERT_EQ(first.exit_code, 0) << first.err;
    std::filesystem::create_directories(mbverify.folder() / "truth");
    Write("truth/sines.yaml",
          "mechanism: " + File("out/five_bar/setup/model.yaml") +
              "\nmotion:\n  duration_s: 4\n  sample_s: 0.004\n  commands:\n"
              "    left_motor: [home, {sine: {amplitude: 0.15, frequency_hz: 0.7}}, {sine: "
              "{amplitude: 0.05, frequency_hz: 1.9, phase: 0.4}}]\n"
              "    right_motor: [home, {sine: {amplitude: 0.12, frequency_hz: 1.1, phase: 1}}, "
              "{sine: {amplitude: 0.06, frequency_hz: 0.5}}]\n"
              "analytic: none\nsimulation: {mode: inverse}\n");
    const ProgramResult run = mbverify("run " + File("truth/sines.yaml") +
                                       " --no-pictures --no-report --out " + File("truth/out"));
    ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(mbverify.folder() / "truth/out")) {
      if (entry.path().filename() == "traces.csv") truth_ = ReadColumns(ReadAll(entry.path()));
    }
    ASSERT_EQ(truth_.at("time_s").size(), 1001u);
  }

  // A log of it; `effort` of row i of a motor.
  using Effort = std::function<double(const std::string& motor, size_t row)>;
  void WriteLog(const std::string& name, const Effort& effort, bool velocities = true) const {
    std::string text = "time";
    for (const char* motor : {"left_motor", "right_motor"}) {
      text += std::string(",") + motor + "_pos";
      if (velocities) text += std::string(",") + motor + "_vel";
      text += std::string(",") + motor + "_effort";
    }
    text += "\n";
    char cell[40];
    for (size_t i = 0; i < truth_.at("time_s").size(); ++i) {
      std::snprintf(cell, sizeof cell, "%.3f", kRowStep * static_cast<double>(i));
      text += cell;
      for (const char* motor : {"left_motor", "right_motor"}) {
        const std::string m = motor;
        std::vector<double> values = {At(m, "position", i)};
        if (velocities) values.push_back(At(m, "velocity", i));
        values.push_back(effort(m, i));
        for (const double value : values) {
          std::snprintf(cell, sizeof cell, ",%.12g", value);
          text += cell;
        }
      }
      text += "\n";
    }
    Write(name, text);
  }
  [[nodiscard]] double At(const std::string& motor, const char* what, size_t row) const {
    return truth_.at(motor + "." + what + ".reference").at(row);
  }

  nlohmann::json Log(const std::string& log, const std::string& options = "", int exit_code = 0) {
    result_ = mbverify("log " + File("five_bar.urdf") + " " + File(log) + " --no-pictures --out " +
                       File("out") + " --json " + File("log.json") + " " + options);
    EXPECT_EQ(result_.exit_code, exit_code) << result_.out << result_.err;
    return nlohmann::json::parse(ReadAll(File("log.json")));
  }

  Columns truth_;
  ProgramResult result_;
  Program mbverify{std::string("log_") +
                   testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(LogCommand, ItsOwnForcesComeBackToTheInterpolationError) {
  RunMotion();
  WriteLog("walk.csv", [&](const std::string& m, size_t i) { return At(m, "force", i); });
  const auto exact = Log("walk.csv", "--smoothing none");
  EXPECT_EQ(exact["verdict"], "agree");
  ASSERT_EQ(exact["log"]["drives"].size(), 2u);
  for (const auto& drive : exact["log"]["drives"]) {
    EXPECT_EQ(drive["rows"], 1001);
    EXPECT_LT(drive["share"].get<double>(), 1e-6) << drive;
    for (const auto& term : drive["terms"]) EXPECT_FALSE(term["named"]) << drive["drive"] << term;
  }
  // Smoothing adds what it says it does, at the ends.
  const auto json = Log("walk.csv");
  const auto tables = nlohmann::json::parse(
      ReadAll(mbverify.folder() / "out/five_bar/setup/walk/summary.json"))["motion_tables"];
  for (size_t k = 0; k < 2; ++k) {
    const auto& drive = json["log"]["drives"][k];
    const double change = tables["smoothed_forces"][k]["change_rms"].get<double>();
    EXPECT_LT(drive["rms_difference"].get<double>(), 1.1 * change + 1e-6) << drive;
    for (const auto& term : drive["terms"]) EXPECT_FALSE(term["named"]) << drive["drive"] << term;
  }
  EXPECT_NE(result_.out.find("nothing beyond 3 standard errors"), std::string::npos) << result_.out;
  // Without velocities the spline of the positions has them.
  WriteLog(
      "bare.csv", [&](const std::string& m, size_t i) { return At(m, "force", i); }, false);
  const auto bare = Log("bare.csv", "--smoothing none");
  ASSERT_EQ(bare["log"]["drives"].size(), 2u);
  for (const auto& drive : bare["log"]["drives"]) {
    EXPECT_LT(drive["share"].get<double>(), 1e-4) << drive;
  }
  const std::filesystem::path folder = mbverify.folder() / "out/five_bar/setup/bare";
  for (const char* file : {"log.html", "log.csv", "log.json", "report.html", "summary.json"}) {
    EXPECT_TRUE(std::filesystem::exists(folder / file)) << file;
  }
}

// Gain 1.02, an offset, one row late, and friction: on one motor; the other stays as it is.
TEST_F(LogCommand, WhatALogDiffersByIsNamedWithItsNumber) {
  RunMotion();
  const auto changed = [&](const std::string& m, size_t i) {
    if (m == "right_motor") return At(m, "force", i);
    const size_t late = i == 0 ? 0 : i - 1;
    const double v = At(m, "velocity", late);
    return 1.02 * At(m, "force", late) + 0.05 + 0.1 * (v > 0 ? 1.0 : -1.0) + 0.03 * v;
  };
  WriteLog("worn.csv", changed);
  const auto json = Log("worn.csv");
  EXPECT_EQ(json["verdict"], "agree");
  const auto& left = json["log"]["drives"][0];
  EXPECT_EQ(left["drive"], "left_motor");
  const std::map<std::string, double> truth = {{"gain", 1.02},
                                               {"offset", 0.05},
                                               {"delay", kRowStep},
                                               {"Coulomb friction", 0.1},
                                               {"viscous friction", 0.03}};
  for (const auto& term : left["terms"]) {
    const auto found = truth.find(term["term"].get<std::string>());
    if (found == truth.end()) {
      EXPECT_FALSE(term["named"]) << term;
      continue;
    }
    EXPECT_TRUE(term["named"]) << term;
    EXPECT_NEAR(term["value"].get<double>(), found->second, 1e-3 * found->second + 1e-6) << term;
  }
  for (const auto& term : json["log"]["drives"][1]["terms"]) EXPECT_FALSE(term["named"]) << term;
  EXPECT_NE(result_.out.find("left_motor: gain 1.02"), std::string::npos) << result_.out;
  EXPECT_NE(result_.out.find("(1.00 rows): the log's torque comes late"), std::string::npos)
      << result_.out;
  // Compared, not judged; unless asked for.
  (void)Log("worn.csv", "--limit 0.01", 1);
}

// An array of ROS with an encoder of 8192 counts, a clock that jitters and noise of the torques:
// gain and friction within 4 of their standard errors, which are small.
TEST_F(LogCommand, EncodersAndNoiseLeaveTheNumbersWithinTheirErrors) {
  RunMotion();
  std::mt19937_64 random(20261128);
  std::normal_distribution<double> normal(0.0, 1.0);
  const double count = 2.0 * std::numbers::pi / 8192;
  std::string text =
      "%time,field.name0,field.name1,field.position0,field.position1,field.effort0,"
      "field.effort1\n";
  for (size_t i = 0; i < truth_.at("time_s").size(); ++i) {
    const auto jitter_ns = static_cast<long long>(2e5 * normal(random));
    text +=
        std::to_string(1700000000000000000LL + 4000000LL * static_cast<long long>(i) + jitter_ns);
    text += ",right_motor,left_motor";
    for (const char* motor : {"right_motor", "left_motor"}) {
      text += "," + std::to_string(count * std::round(At(motor, "position", i) / count));
    }
    const double v = At("left_motor", "velocity", i);
    text += "," + std::to_string(At("right_motor", "force", i) + 0.03 * normal(random));
    text += "," +
            std::to_string(1.05 * At("left_motor", "force", i) + 0.08 * (v > 0 ? 1 : -1) +
                           0.03 * normal(random)) +
            "\n";
  }
  Write("bag.csv", text);
  const auto json = Log("bag.csv");
  EXPECT_EQ(json["verdict"], "agree");
  const std::map<std::string, double> truth = {{"gain", 1.05}, {"Coulomb friction", 0.08}};
  for (const auto& drive : json["log"]["drives"]) {
    EXPECT_NEAR(drive["rms_left"].get<double>(), 0.03, 0.004) << drive["drive"];
    for (const auto& term : drive["terms"]) {
      const bool changed = drive["drive"] == "left_motor" && truth.contains(term["term"]);
      const double value = changed ? truth.at(term["term"]) : term["term"] == "gain" ? 1.0 : 0.0;
      EXPECT_EQ(term["named"].get<bool>(), changed) << drive["drive"] << term;
      EXPECT_NEAR(term["value"].get<double>(), value, 4.0 * term["standard_error"].get<double>())
          << drive["drive"] << term;
      if (!changed) continue;
      EXPECT_LT(term["standard_error"].get<double>(), 0.1 * value) << term;
    }
  }
}

// What acted on the robot is no part of its log: --set states it.
TEST_F(LogCommand, LoadsAndParametersAreStated) {
  const ProgramResult run =
      mbverify("run scara_robot/axis --no-pictures --no-report --out " + File("truth"));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto largest = [&](const std::string& options) {
    const ProgramResult logged =
        mbverify("log scara_robot " + File("truth/scara_robot/axis/traces.csv") +
                 " --no-pictures --out " + File("out") + " --json " + File("log.json") + options);
    EXPECT_EQ(logged.exit_code, 0) << logged.err;
    double share = 0.0;
    const auto json = nlohmann::json::parse(ReadAll(File("log.json")));
    EXPECT_EQ(json["log"]["drives"].size(), 4u);
    for (const auto& drive : json["log"]["drives"]) {
      share = std::max(share, drive["share"].get<double>());
    }
    return share;
  };
  EXPECT_GT(largest(""), 0.5);
  EXPECT_LT(largest(" --set parameters.home_x=-0.05 --set parameters.home_y=-0.05 --set "
                    "parameters.home_z=-0.13 --set parameters.home_phi=pi/12 --set 'loads={tool: "
                    "{on: platform.P, force: [0, 0, -5]}}'"),
            1e-5);
}

// Torques that are zero throughout are none. A drive that rests at home is judged like others.
TEST_F(LogCommand, ALimitNeedsTorques) {
  std::string rows = "time,left_motor_pos,left_motor_effort\n";
  for (int i = 0; i < 40; ++i) {
    rows += fmt::format("{:.3f},{:.9f},0\n", 0.01 * i, 0.05 * std::sin(0.1 * i));
  }
  Write("zeros.csv", rows);
  const std::string call = "log " + File("five_bar.urdf") + " " + File("zeros.csv") +
                           " --hold right_motor --no-pictures --out " + File("out");
  const ProgramResult free = mbverify(call);
  EXPECT_EQ(free.exit_code, 0) << free.out << free.err;
  const ProgramResult judged = mbverify(call + " --limit 1000");
  EXPECT_EQ(judged.exit_code, 2) << judged.out << judged.err;
  const std::string scenario = ReadAll(mbverify.folder() / "out/five_bar/setup/zeros.yaml");
  EXPECT_EQ(scenario.find("off"), std::string::npos) << scenario;
}

TEST_F(LogCommand, BadInputWritesNothing) {
  Write("short.csv", "time,left_motor_pos,right_motr_pos\n0,1,2\n");
  std::string rows = "time,left_motor_pos\n";
  for (int i = 0; i < 30; ++i) rows += std::to_string(0.01 * i) + ",0.1\n";
  Write("half.csv", rows);
  const auto run = [&](const std::string& arguments) {
    return mbverify("log " + arguments + " --out " + File("nothing"));
  };
  EXPECT_EQ(run(File("five_bar.urdf") + " " + File("short.csv")).exit_code, 2);
  const ProgramResult half = run(File("five_bar.urdf") + " " + File("half.csv"));
  EXPECT_EQ(half.exit_code, 2);
  EXPECT_NE(half.err.find("has no column for the position of right_motor"), std::string::npos)
      << half.err;
  EXPECT_NE(half.err.find("--hold right_motor keeps it at home"), std::string::npos) << half.err;
  const std::string held = File("five_bar.urdf") + " " + File("half.csv") + " --hold right_motor";
  const ProgramResult limit = run(held + " --limit 0.5");
  EXPECT_EQ(limit.exit_code, 2);
  EXPECT_NE(limit.err.find("has no effort of a drive, which --limit is about"), std::string::npos)
      << limit.err;
  EXPECT_EQ(run(File("five_bar.urdf") + " " + File("none.csv")).exit_code, 2);
  EXPECT_EQ(run("no_such_model " + File("half.csv")).exit_code, 2);
  EXPECT_EQ(run(File("five_bar.urdf") + " " + File("half.csv") + " --hold elbow").exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(mbverify.folder() / "nothing"));
}

}  // namespace
}  // namespace mbv
