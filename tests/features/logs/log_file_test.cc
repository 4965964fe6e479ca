// Logs of robots as they are written, and as they are written wrongly: columns, clocks, rows.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "base/text.h"
#include "features/logs/log_report.h"
#include "features/logs/log_rows.h"
#include "model_file/load_model.h"
#include "scenario/tables/table_spline.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

constexpr const char* kRobot =
    "name: walker\n"
    "bodies:\n"
    "  a: {mass: 1, com: [0.1, 0, 0], inertia: [0.1, 0.1, 0.1]}\n"
    "  b: {mass: 1, com: [0.1, 0, 0], inertia: [0.1, 0.1, 0.1]}\n"
    "  c: {mass: 1, com: [0.1, 0, 0], inertia: [0.1, 0.1, 0.1]}\n"
    "joints:\n"
    "  left_knee: {kind: revolute, parent: world, child: a, axis: y, range: [-1, 1]}\n"
    "  right_knee: {kind: revolute, parent: world, child: b, axis: y}\n"
    "  lift_joint: {kind: prismatic, parent: world, child: c, axis: z}\n"
    "drives:\n"
    "  left_knee: {kind: joint, joint: left_knee}\n"
    "  right_knee: {kind: joint, joint: right_knee}\n"
    "  lift_motor: {kind: joint, joint: lift_joint}\n";

class LogFileTest : public testing::Test {
 protected:
  LogFileTest() : folder_("log_file") {
    const LoadResult loaded = LoadModelText(kRobot, "walker.yaml");
    EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    axes_ = LogAxes(*loaded.mechanism);
  }

  // A heading over rows of numbers that all differ.
  static std::string Table(const std::string& heading, int rows = 20) {
    const auto columns = std::count(heading.begin(), heading.end(), ',');
    std::string text = heading + "\n";
    for (int i = 0; i < rows; ++i) {
      text += fmt::format("{:.3f}", 0.01 * i);
      for (int c = 1; c <= columns; ++c)
        text += fmt::format(",{:.6f}", 0.01 * std::sin(0.3 * i + c));
      text += "\n";
    }
    return text;
  }
  std::optional<RobotLog> Read(const std::string& text, const LogSettings& settings = {}) {
    folder_.Write("log.csv", text);
    messages_ = Diagnostics();
    auto log = ReadLog(folder_.PathOf("log.csv"), settings, axes_, &messages_);
    if (log && !CheckLogRanges(*log, axes_, &messages_)) return {};
    return log;
  }
  [[nodiscard]] std::string Messages() const {
    std::string text = messages_.Text();
    const std::string path = folder_.PathOf("");
    for (size_t at = 0; (at = text.find(path)) != std::string::npos;) text.erase(at, path.size());
    return text;
  }
  // "left_knee.position right_knee.effort …", in the order of the file.
  [[nodiscard]] std::string Signals(const RobotLog& log) const {
    std::string signals;
    for (const LogSeries& series : log.series) {
      signals += (signals.empty() ? "" : " ") + axes_[series.column.axis].name() + "." +
                 kLogQuantities[static_cast<size_t>(series.column.quantity)];
    }
    return signals;
  }

  test::TestFolder folder_;
  std::vector<LogAxis> axes_;
  Diagnostics messages_;
};

// Every way to write a joint and a quantity that is documented.
TEST_F(LogFileTest, HeadingsAreUnderstood) {
  const std::pair<const char*, const char*> headings[] = {
      {"left_knee_pos", "left_knee.position"},
      {"left_knee", "left_knee.position"},
      {"left_knee_vel", "left_knee.velocity"},
      {"left_knee_effort", "left_knee.effort"},
      {"left_knee.torque", "left_knee.effort"},
      {"LeftKneeTorque", "left_knee.effort"},
      {"tau_left_knee", "left_knee.effort"},
      {"dq_left_knee", "left_knee.velocity"},
      {"qdd left knee", "left_knee.acceleration"},
      {"/joint_states/left_knee/position", "left_knee.position"},
      {"/robot1/joint_states/left_knee/velocity", "left_knee.velocity"},
      {"left_knee_joint_measured_torque_nm", "left_knee.effort"},
      {"left_knee_pos_rad", "left_knee.position"},
      {"left_knee_vel_rad_s", "left_knee.velocity"},
      {"left_knee_pos (deg)", "left_knee.position"},
      {"left_knee/tau [N*mm]", "left_knee.effort"},
      {"lift_pos", "lift_motor.position"},
      {"lift_joint_pos_mm", "lift_motor.position"},
      {"lift_motor_force", "lift_motor.effort"},
      {"left_knee.position.reference", "left_knee.position"},
  };
  for (const auto& [heading, signal] : headings) {
    const auto log = Read(Table(fmt::format("time,{}", heading)));
    ASSERT_TRUE(log) << heading << "\n" << Messages();
    EXPECT_EQ(Signals(*log), signal) << heading;
  }
}

TEST_F(LogFileTest, UnitsComeFromHeadingsOptionsAndMaps) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const auto factor = [&](const std::string& heading, const LogSettings& settings = {}) {
    const auto log = Read(Table("t," + heading), settings);
    EXPECT_TRUE(log) << Messages();
    return log ? log->series.at(0).column.factor : kNan;
  };
  EXPECT_EQ(factor("left_knee_pos"), 1.0);
  EXPECT_DOUBLE_EQ(factor("left_knee_pos (deg)"), kDegree);
  EXPECT_DOUBLE_EQ(factor("left_knee_pos_deg"), kDegree);
  EXPECT_DOUBLE_EQ(factor("left_knee_vel_deg_s"), kDegree);
  EXPECT_DOUBLE_EQ(factor("left_knee_vel_rpm"), std::numbers::pi / 30.0);
  EXPECT_DOUBLE_EQ(factor("lift_pos_mm"), 1e-3);
  LogSettings degrees;
  degrees.degrees = true;
  EXPECT_DOUBLE_EQ(factor("left_knee_pos", degrees), kDegree);
  EXPECT_EQ(factor("left_knee_pos_rad", degrees), 1.0);
  EXPECT_EQ(factor("left_knee_effort", degrees), 1.0);
  EXPECT_EQ(factor("lift_pos", degrees), 1.0);
  folder_.Write("map.yaml",
                "columns: {left_knee.effort: {column: i_knee, unit: N*mm, sign: -1, scale: 2.5, "
                "offset: 4}}\nangles: deg\n");
  LogSettings mapped;
  Diagnostics findings;
  ReadLogMap(folder_.PathOf("map.yaml"), &mapped, &findings);
  ASSERT_TRUE(findings.empty()) << findings.Text();
  const auto log = Read(Table("t,left_knee_pos,i_knee"), mapped);
  ASSERT_TRUE(log) << Messages();
  EXPECT_EQ(Signals(*log), "left_knee.position left_knee.effort");
  EXPECT_DOUBLE_EQ(log->series[1].column.factor, -2.5e-3);
  EXPECT_DOUBLE_EQ(log->series[1].column.shift, 4e-3);
}

TEST_F(LogFileTest, ArraysTakeTheirNamesFromTheLogOrAnOption) {
  const std::string row = ",right_knee,left_knee,0.1,0.2,0,0\n";
  std::string ros =
      "%time,field.name0,field.name1,field.position0,field.position1,field.effort0,field.effort1\n";
  for (int i = 0; i < 20; ++i) {
    ros += fmt::format("{}{}", 1700000000000000000LL + 2000000LL * i, row);
  }
  const auto log = Read(ros);
  ASSERT_TRUE(log) << Messages();
  EXPECT_EQ(Signals(*log), "right_knee.position left_knee.position");  // efforts are zero
  EXPECT_DOUBLE_EQ(log->step_s, 0.002);
  EXPECT_EQ(log->stamps.back(), "0.038000000");
  LogSettings named;
  named.joints = {"left_knee", "right_knee"};
  const std::string arrays = "__time,/joint_states/position[0],/joint_states/position[1]";
  const auto listed = Read(Table(arrays), named);
  ASSERT_TRUE(listed) << Messages();
  EXPECT_EQ(Signals(*listed), "left_knee.position right_knee.position");
  EXPECT_FALSE(Read(Table(arrays)));
  EXPECT_EQ(Messages(),
            "log.csv:1:8: error: 2 columns of arrays without the name of a joint: "
            "/joint_states/position[0], /joint_states/position[1]\n"
            "  hint: --joints A,B,C lists the joints in the order of the array\n");
}

TEST_F(LogFileTest, ClocksAreUnderstood) {
  const auto step = [&](const std::string& heading, const std::string& format_of, double scale) {
    std::string text = heading + ",left_knee_pos\n";
    for (int i = 0; i < 20; ++i) {
      text += fmt::format(fmt::runtime(format_of), 0.005 * scale * i) +
              fmt::format(",{:.4f}\n", 0.01 * i);
    }
    const auto log = Read(text);
    EXPECT_TRUE(log) << heading << Messages();
    return log ? log->step_s : kNan;
  };
  EXPECT_NEAR(step("time", "{:.3f}", 1.0), 0.005, 1e-12);
  EXPECT_NEAR(step("t (ms)", "{:.0f}", 1e3), 0.005, 1e-12);
  EXPECT_NEAR(step("timestamp_us", "{:.0f}", 1e6), 0.005, 1e-12);
  EXPECT_NEAR(step("stamp_ns", "{:.0f}", 1e9), 0.005, 1e-12);
  // Seconds and nanoseconds of a message.
  std::string text = "time,header.stamp.secs,header.stamp.nsecs,left_knee_pos\n";
  for (int i = 0; i < 20; ++i) {
    const int nano = 900000000 + 8000000 * i;
    text += fmt::format("{},{},{},0.1\n", i, 1700000000 + nano / 1000000000, nano % 1000000000);
  }
  const auto log = Read(text);
  ASSERT_TRUE(log) << Messages();
  EXPECT_NEAR(log->step_s, 0.008, 1e-12);
  EXPECT_TRUE(log->even);
}

// Each fault with its line, what is wrong and what to do.
TEST_F(LogFileTest, HostileFilesAreFindings) {
  const std::string good = Table("time,left_knee_pos");
  const auto replaced = [&](std::string text, const std::string& from, const std::string& to) {
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  struct Case {
    std::string text;
    const char* message;  // its beginning
  };
  const Case cases[] = {
      {"", "log.csv: error: holds no numbers"},
      {"\n\n\n", "log.csv: error: holds no numbers"},
      {"time,left_knee_pos\n", "log.csv: error: "},
      {std::string("time,left_knee_pos\n0,\0\n", 23), "log.csv: error: holds zero bytes"},
      {"\xFF\xFEt", "log.csv: error: is UTF-16 text"},
      {Table("0,1"), "log.csv: error: has no heading"},
      {Table("left_knee_pos,right_knee_pos"), "log.csv: error: has no column of time"},
      {Table("time,left_knee_pos", 5), "log.csv: error: has 5 rows, at least 12 are needed"},
      {Table("time,left_knee_pos,left_knee_torqe"),
       "log.csv:1:20: error: 'left_knee_torqe' names 'left_knee', but 'torqe' is not known as "
       "something measured\n  hint: did you mean 'torque'?"},
      {Table("time,left_knee_pos,left_knee_angle"),
       "log.csv:1:20: error: 'left_knee_pos' and 'left_knee_angle' are both left_knee.position\n"
       "  hint: --column left_knee.position='left_knee_pos' takes one, --ignore 'left_knee_angle' "
       "passes one over"},
      {Table("time,left_knee_pos (N)"),
       "log.csv:1:6: error: 'left_knee_pos (N)': the unit N is not one of left_knee.position, "
       "which is in rad"},
      {replaced(good, "\n0.050,", "\n0.050,x"), "log.csv:7:7: error: 'x"},
      {replaced(good, "\n0.050,", "\nlater,"), "log.csv:7:1: error: 'later' is no time"},
      {replaced(good, "\n0.050,", "\n0.050;"), "log.csv:7:1: error: has 1 of 2 cells"},
      {replaced(good, "\n0.050,", "\n0.015,"), "log.csv:7:1: error: the time goes back by 0.025 s"},
      {replaced(good, "\n0.150,", "\n5.150,"), "log.csv:"},
      {Table("time,left_knee_pos_deg") + "0.900,0.1\n0.910,0.1\n0.920,0.1\n",
       "log.csv:22:1: error: no row for 0.71 s after 0.19 s, where rows are 0.01 s apart\n"
       "  hint: nothing says how the robot moved there; the longest part without a gap: --from 0 "
       "--to 0.19"},
  };
  for (const Case& one : cases) {
    EXPECT_FALSE(Read(one.text)) << one.message;
    EXPECT_TRUE(messages_.has_errors()) << one.message;
    EXPECT_TRUE(Messages().starts_with(one.message)) << one.message << "\n---\n" << Messages();
  }
}

TEST_F(LogFileTest, StampsInAnUnknownUnitAreDoubted) {
  std::string text = "time,left_knee_pos\n";
  for (int i = 0; i < 20; ++i) text += fmt::format("{},{:.3f}\n", 2 * i, 0.01 * i);
  EXPECT_FALSE(Read(text));
  EXPECT_EQ(Messages(),
            "log.csv:2:1: error: rows are 2 s apart, if the time 'time' is in seconds\n"
            "  hint: --time-unit ms, us or ns\n");
  LogSettings settings;
  settings.time_unit = "ms";
  const auto log = Read(text, settings);
  ASSERT_TRUE(log) << Messages();
  EXPECT_NEAR(log->step_s, 0.002, 1e-12);
}

// What can be put right is, with a warning that says so.
TEST_F(LogFileTest, RowsThatCanBeLeftOutAre) {
  std::string text = Table("time,left_knee_pos,left_knee_effort", 40);
  text += "0.400,nan,0.1\n0.410,0.1,nan\n0.420,0.1,0.2\n0.420,0.1,0.2\n0.430,0.1";
  const auto log = Read(text);
  ASSERT_TRUE(log) << Messages();
  EXPECT_EQ(log->time_s.size(), 42u);
  EXPECT_TRUE(std::isnan(log->series[1].values[40]));
  EXPECT_EQ(Messages(),
            "log.csv:46:1: warning: the last line is cut off and left out\n"
            "log.csv:42:1: warning: 1 of 44 rows lack a position or a velocity (empty or not "
            "finite) and are left out\n"
            "log.csv:45:1: warning: 1 row has the time of the row before and is left out\n"
            "log.csv:43:1: warning: 1 of 41 steps differ by more than half from the usual 0.01 s: "
            "a row is 0.02 s after the one before\n"
            "  hint: the stamps are taken as they are; --rate HZ spaces the rows evenly instead\n");
}

TEST_F(LogFileTest, CoarseStampsAreSpacedEvenlyOnRequest) {
  std::string text = "time,left_knee_pos\n";
  for (int i = 0; i < 60; ++i) text += fmt::format("{:.2f},{:.4f}\n", 0.004 * i, 0.001 * i);
  EXPECT_FALSE(Read(text));
  EXPECT_NE(Messages().find("rows have the time of the row before and other positions\n  hint: the "
                            "stamps are too coarse: --rate HZ"),
            std::string::npos)
      << Messages();
  LogSettings settings;
  settings.rate_hz = 250.0;
  const auto log = Read(text, settings);
  ASSERT_TRUE(log) << Messages();
  EXPECT_EQ(log->time_s.size(), 60u);
  EXPECT_TRUE(log->even);
}

TEST_F(LogFileTest, TurnsOfEncodersAreTakenOut) {
  std::string text = "time,right_knee_pos\n";
  for (int i = 0; i < 60; ++i) {
    text +=
        fmt::format("{:.2f},{:.5f}\n", 0.01 * i, std::remainder(0.2 * i, 2.0 * std::numbers::pi));
  }
  const auto log = Read(text);
  ASSERT_TRUE(log) << Messages();
  EXPECT_NEAR(log->series[0].values.back(), 0.2 * 59, 1e-4);
  EXPECT_NEAR(std::stod(log->series[0].cells.back()), 0.2 * 59, 1e-4);
  EXPECT_NE(Messages().find("'right_knee_pos' jumps by whole turns 2 times"), std::string::npos)
      << Messages();
}

TEST_F(LogFileTest, RangesAreHeldAgainstTheUnit) {
  std::string text = "time,left_knee_pos\n";
  for (int i = 0; i < 20; ++i) text += fmt::format("{:.2f},{}\n", 0.01 * i, 2 * i);
  EXPECT_FALSE(Read(text));
  EXPECT_EQ(Messages(),
            "log.csv:1:6: error: 'left_knee_pos' runs from 0 to 38 rad, the range of left_knee is "
            "-1 … 1 rad\n  hint: as degrees all of it lies in the range: --degrees\n");
}

// The noise that a smoothing spline leaves in accelerations, by its formula and by 20 000 rows,
// whose RMS varies by about 1/√(f₀ T).
TEST_F(LogFileTest, NoiseLeftInAccelerationsIsKnown) {
  std::mt19937_64 random(20261128);
  std::normal_distribution<double> normal(0.0, 1e-3);
  for (const double cutoff_hz : {5.0, 12.0, 25.0}) {
    SplineRows rows{.time_s = {}, .values = {}, .deviation = 1e-3, .cutoff_hz = cutoff_hz};
    for (int i = 0; i < 20000; ++i) {
      rows.time_s.push_back(0.004 * i);
      rows.values.push_back(normal(random));
    }
    MotionTable table;
    table.rows = rows.time_s.size();
    table.to_s = rows.time_s.back();
    table.deviation = 1e-3;
    table.cutoff_hz = cutoff_hz;
    const double noise = AccelerationNoise(table);
    EXPECT_NEAR(SizeOf(Smoothed(rows), rows.time_s).rms.acceleration, noise,
                2.0 * noise / std::sqrt(cutoff_hz * table.to_s))
        << cutoff_hz;
  }
}

TEST_F(LogFileTest, WrongMapsAndOptionsAreFindings) {
  const auto messages = [&](const std::string& map) {
    folder_.Write("map.yaml", map);
    LogSettings settings;
    messages_ = Diagnostics();
    ReadLogMap(folder_.PathOf("map.yaml"), &settings, &messages_);
    if (messages_.has_errors()) return Messages();
    (void)Read(Table("time,left_knee_pos,x1"), settings);
    return Messages();
  };
  EXPECT_NE(messages("colums: {}\njoints: [a]\n").find("unknown key 'colums'"), std::string::npos);
  EXPECT_EQ(messages("columns:\n  left_kne.velocity: x1\n"),
            "map.yaml:2:3: error: 'left_kne.velocity': the model has no drive or joint "
            "'left_kne'\n  hint: did you mean 'left_knee'?\n");
  EXPECT_EQ(messages("columns:\n  left_knee.speed: x1\n").substr(0, 50),
            "map.yaml:2:3: error: 'left_knee.speed' is not NAME");
  EXPECT_EQ(messages("columns:\n  left_knee.velocity: x2\n"),
            "map.yaml:2:3: error: columns.left_knee.velocity: log.csv has no column 'x2'\n"
            "  hint: did you mean 'x1'?\n");
  EXPECT_EQ(messages("ignore: [x7]\n"),
            "log.csv: error: has no column 'x7' to be ignored\n  hint: did you mean 'x1'?\n");
  LogSettings settings;
  EXPECT_FALSE(AddLogColumn("left_knee.position", &settings));
  EXPECT_FALSE(AddLogColumn("=x", &settings));
  EXPECT_TRUE(AddLogColumn("left_knee.position=a=b", &settings));
  EXPECT_EQ(settings.columns[0].column.column, "a=b");
}

}  // namespace
}  // namespace mbv
