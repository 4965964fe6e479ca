// motion.pose_table: the same motion in every convention, and what is said about wrong files.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "math/spatial.h"
#include "model_file/load_model.h"
#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

// A turn about a slanted axis that passes 180° of yaw.
Vec3 RpyAt(double t) { return {0.3 * std::sin(3 * t), -0.2 * std::sin(2 * t), 2.5 + t}; }
Vec3 PositionAt(double t) { return {0.01 * t, -0.02 * t * t, 0.4 + 0.01 * std::sin(t)}; }

class PoseTableTest : public testing::Test {
 protected:
  PoseTableTest() : folder_("pose_table") {}

  // `angles` gives the columns of an orientation, named in `heading`.
  void WritePoses(const std::string& name, const std::string& heading,
                  const std::function<std::vector<double>(const Mat3&)>& angles) const {
    std::string text = "t,x,y,z," + heading + "\n";
    for (int i = 0; i <= 100; ++i) {
      const double t = 0.02 * i;
      const Vec3 p = PositionAt(t);
      text += fmt::format("{:.2f},{:.12f},{:.12f},{:.12f}", t, p.x(), p.y(), p.z());
      for (const double number : angles(RotRpy(RpyAt(t)))) text += fmt::format(",{:.13f}", number);
      text += "\n";
    }
    folder_.Write(name, text);
  }
  [[nodiscard]] ScenarioResult LoadPoses(const std::string& table) const {
    return LoadScenarioText(std::string("mechanism: ") + kSourceDir +
                                "/models/stewart/model.yaml\nmotion:\n  pose_table: " + table +
                                "\nanalytic: none\nsimulation: {mode: inverse}\n",
                            folder_.PathOf("s.yaml"));
  }
  [[nodiscard]] std::string Messages(const std::string& table) const {
    std::string text = LoadPoses(table).diagnostics.Text();
    const std::string path = folder_.PathOf("");
    for (size_t at = 0; (at = text.find(path)) != std::string::npos;) text.erase(at, path.size());
    return text;
  }
  void ExpectThePoses(const std::string& table) const {
    const ScenarioResult result = LoadPoses(table);
    ASSERT_TRUE(result.scenario) << table << result.diagnostics.Text();
    const Motion& motion = result.scenario->motion;
    EXPECT_NEAR(motion.duration_s, 2.0, 1e-12);
    ASSERT_EQ(motion.commands.size(), 6u);
    for (const double t : {0.0, 0.613, 1.37, 2.0}) {
      for (int c = 0; c < 6; ++c) {
        const double wanted = c < 3 ? PositionAt(t)[c] : RpyAt(t)[c - 3];
        // Yaw may differ by whole turns.
        const double value =
            Evaluate(motion.commands[static_cast<size_t>(c)].profile, t).value - wanted;
        EXPECT_NEAR(std::sin(value), 0.0, 1e-8) << table << motion.commands[c].name << t;
        EXPECT_GT(std::cos(value), 0.9);
      }
    }
    // No turn is lost where the printed angle jumps.
    EXPECT_NEAR(Evaluate(motion.commands[5].profile, 0.64).rate, 1.0, 1e-6) << table;
  }

  test::TestFolder folder_;
};

TEST_F(PoseTableTest, EveryConventionGivesTheSameMotion) {
  WritePoses("rpy.csv", "roll (deg),pitch (deg),yaw (deg)", [](const Mat3& R) {
    const Vec3 rpy = RpyOf(R) * (180 / std::numbers::pi);
    return std::vector<double>{rpy.x(), rpy.y(), rpy.z()};
  });
  WritePoses("q.csv", "qw,qx,qy,qz", [](const Mat3& R) {
    const Eigen::Quaterniond q(R);
    return std::vector<double>{q.w(), q.x(), q.y(), q.z()};
  });
  WritePoses("v.csv", "rx,ry,rz", [](const Mat3& R) {
    const Eigen::AngleAxisd turn(R);
    const Vec3 v = turn.angle() * turn.axis();
    return std::vector<double>{v.x(), v.y(), v.z()};
  });
  WritePoses("a.csv", "ax,ay,az,angle (deg)", [](const Mat3& R) {
    const Eigen::AngleAxisd turn(R);
    return std::vector<double>{turn.axis().x(), turn.axis().y(), turn.axis().z(),
                               turn.angle() * 180 / std::numbers::pi};
  });
  ExpectThePoses("{output: platform, csv: rpy.csv}");
  ExpectThePoses("{output: platform, csv: q.csv, angles: quaternion}");
  ExpectThePoses("{output: platform, csv: v.csv, angles: rotation_vector}");
  ExpectThePoses("{output: platform, csv: a.csv, angles: axis_angle}");
}

TEST_F(PoseTableTest, ComponentsMayBeLeftToOthers) {
  WritePoses("v.csv", "rx,ry,rz", [](const Mat3&) { return std::vector<double>{0, 0, 0.1}; });
  const std::string text =
      Messages("{output: platform, csv: v.csv, angles: rotation_vector, use: [x, z, yaw]}");
  EXPECT_NE(text.find("motion gives 3 commands, but stewart has 6 degrees of freedom"),
            std::string::npos)
      << text;
}

TEST_F(PoseTableTest, WrongFilesAreReportedWithPlaceAndHint) {
  WritePoses("q.csv", "qw,qx,qy,qz", [](const Mat3&) { return std::vector<double>{1, 1, 0, 0}; });
  WritePoses("up.csv", "rx,ry,rz", [](const Mat3&) { return std::vector<double>{0, 1.57, 0}; });
  EXPECT_EQ(Messages("{output: platform, csv: q.csv, angles: quaternion}"),
            "s.yaml:3:39: error: motion.pose_table: q.csv at t = 0 s is not a rotation: its length "
            "violates 0.99 … 1.01\n"
            "  hint: are these the right columns?\n");
  EXPECT_EQ(Messages("{output: platform, csv: up.csv, angles: rotation_vector}"),
            "s.yaml:3:39: error: motion.pose_table: up.csv at t = 0 s pitches beyond 89°, where "
            "roll and yaw are not distinguishable\n"
            "  hint: turn the output's frame\n");
  EXPECT_EQ(Messages("{output: plattform, csv: q.csv, angles: quaternions}"),
            "s.yaml:3:24: error: motion.pose_table.output: stewart has no output 'plattform'\n"
            "  hint: did you mean 'platform'?\n"
            "s.yaml:3:55: error: motion.pose_table.angles = 'quaternions' is not one of: rpy, "
            "quaternion, rotation_vector, axis_angle\n"
            "  hint: did you mean 'quaternion'?\n");
  EXPECT_EQ(Messages("{output: platform, csv: q.csv}"),
            "s.yaml:3:15: error: motion.pose_table.columns.roll: q.csv has no column 'roll'\n"
            "  hint: its columns: t, x, y, z, qw, qx, qy, qz\n"
            "s.yaml:3:15: error: motion.pose_table.columns.pitch: q.csv has no column 'pitch'\n"
            "  hint: its columns: t, x, y, z, qw, qx, qy, qz\n"
            "s.yaml:3:15: error: motion.pose_table.columns.yaw: q.csv has no column 'yaw'\n"
            "  hint: did you mean 'y'?\n");
}

// What an inertial measurement unit on the platform would show, with what its biases add; it rests
// for half a second, moves for three, and rests again.
class ImuTest : public PoseTableTest {
 protected:
  static constexpr double kRest = 0.5, kMove = 3.0, kEnd = 4.0;

  // At home, there and back: u = 0 … 0, with two derivatives at rest.
  static Vec6 PoseAt(double t) {
    const double s = std::clamp((t - kRest) / kMove, 0.0, 1.0);
    const double u = std::pow(std::sin(std::numbers::pi * s), 6);
    Vec6 pose;
    pose << 0.05 * u, -0.03 * u * (1 - s), 0.04 * u * s, 0.2 * u * s, -0.15 * u, 0.3 * u * (1 - s);
    return pose;
  }
  void WriteLog(const std::string& name, const Vec6& home, const Vec3& gyro,
                const Vec3& accelerometer, bool quaternions = false) const {
    const Vec3 g(0, 0, -9.81);
    std::string text = quaternions ? "t,qw,qx,qy,qz,ax,ay,az\n" : "t,wx,wy,wz,ax,ay,az\n";
    constexpr double kStep = 1e-4;  // of differences of fourth order
    const auto at = [&](double t) { return Vec6(home + PoseAt(t)); };
    for (int i = 0; i <= 400; ++i) {
      const double t = kEnd * i / 400;
      const Mat3 R = RotRpy(at(t).tail<3>());
      const auto turn = [&](double h) {
        return LogRotation(R.transpose() * RotRpy(at(t + h).tail<3>()));
      };
      const Vec3 w =
          (8 * (turn(kStep) - turn(-kStep)) - turn(2 * kStep) + turn(-2 * kStep)) / (12 * kStep) +
          gyro;
      const auto x = [&](double h) { return Vec3(at(t + h).head<3>()); };
      const Vec3 a =
          (16 * (x(20 * kStep) + x(-20 * kStep)) - x(40 * kStep) - x(-40 * kStep) - 30 * x(0)) /
          (12 * 400 * kStep * kStep);
      const Vec3 f = R.transpose() * (a - g) + accelerometer;
      text += fmt::format("{:.4f}", t);
      if (quaternions) {
        const Eigen::Quaterniond q(R);
        text += fmt::format(",{:.14f},{:.14f},{:.14f},{:.14f}", q.w(), q.x(), q.y(), q.z());
      } else {
        text += fmt::format(",{:.14f},{:.14f},{:.14f}", w.x(), w.y(), w.z());
      }
      text += fmt::format(",{:.14f},{:.14f},{:.14f}\n", f.x(), f.y(), f.z());
    }
    folder_.Write(name, text);
  }
  [[nodiscard]] Vec6 Home() const {
    const LoadResult stewart = LoadModel(std::string(kSourceDir) + "/models/stewart/model.yaml");
    Vec6 home;
    for (int c = 0; c < 6; ++c) {
      home[c] = HomeValue(*stewart.mechanism, {Coordinate::Kind::kOutput, 0, c});
    }
    return home;
  }
  // Largest error of positions and angles, and of accelerations.
  struct Error {
    double pose = kNan, acceleration = kNan;
  };
  [[nodiscard]] Error ErrorOf(const std::string& table, const Vec6& home) const {
    const ScenarioResult result = LoadPoses(table);
    EXPECT_TRUE(result.scenario) << table << result.diagnostics.Text();
    if (!result.scenario) return {};
    Error error{0.0, 0.0};
    for (const double t : {0.2, 0.9, 1.513, 2.0, 3.1, 3.9}) {
      for (int c = 0; c < 6; ++c) {
        const Jet jet =
            Evaluate(result.scenario->motion.commands[static_cast<size_t>(c)].profile, t);
        const auto truth = [&](double h) { return home[c] + PoseAt(t + h)[c]; };
        error.pose = std::max(error.pose, std::abs(jet.value - truth(0)));
        const double h = 2e-3;
        const double a =
            (16 * (truth(h) + truth(-h)) - truth(2 * h) - truth(-2 * h) - 30 * truth(0)) /
            (12 * h * h);
        error.acceleration = std::max(error.acceleration, std::abs(jet.acceleration - a));
      }
    }
    return error;
  }
};

TEST_F(ImuTest, ALogWithoutErrorsGivesTheMotionBack) {
  const Vec6 home = Home();
  WriteLog("imu.csv", home, Vec3::Zero(), Vec3::Zero());
  WriteLog("fused.csv", home, Vec3::Zero(), Vec3::Zero(), true);
  for (const char* table : {"{output: platform, csv: imu.csv, imu: {}}",
                            "{output: platform, csv: imu.csv, imu: {end: rest}}",
                            "{output: platform, csv: imu.csv, imu: {rest_s: 0.4, end: return}}"}) {
    const Error error = ErrorOf(table, home);
    EXPECT_LT(error.pose, 1e-7) << table;
    EXPECT_LT(error.acceleration, 1e-4) << table;
  }
  // Between rows a given orientation is only known by them.
  EXPECT_LT(ErrorOf("{output: platform, csv: fused.csv, angles: quaternion, imu: {}}", home).pose,
            1e-4);
}

// Constant biases are taken off whole: by the rest before, or by where it ends. Left in, they show.
TEST_F(ImuTest, BiasesAreTakenOff) {
  const Vec6 home = Home();
  const Vec3 gyro(0.01, -0.02, 0.005), accelerometer(0.05, 0.02, -0.1);
  WriteLog("imu.csv", home, gyro, Vec3::Zero());
  EXPECT_GT(ErrorOf("{output: platform, csv: imu.csv, imu: {}}", home).pose, 0.01);
  EXPECT_LT(ErrorOf("{output: platform, csv: imu.csv, imu: {rest_s: 0.45}}", home).pose, 1e-6);
  EXPECT_LT(ErrorOf("{output: platform, csv: imu.csv, imu: {end: return}}", home).pose, 1e-6);
  WriteLog("both.csv", home, gyro, accelerometer);
  EXPECT_GT(ErrorOf("{output: platform, csv: both.csv, imu: {end: rest}}", home).pose, 0.01);
  EXPECT_LT(ErrorOf("{output: platform, csv: both.csv, imu: {rest_s: 0.45}}", home).pose, 1e-6);
  // A bias of the sensor's axes is not one of the world's.
  const Error returned = ErrorOf("{output: platform, csv: both.csv, imu: {end: return}}", home);
  EXPECT_LT(returned.pose, 0.05);
  EXPECT_GT(returned.pose, 1e-5);
  const ScenarioResult result = LoadPoses("{output: platform, csv: both.csv, imu: {rest_s: 0.45}}");
  EXPECT_EQ(result.diagnostics.Text().find("noise"), std::string::npos)
      << result.diagnostics.Text();
  ASSERT_TRUE(result.scenario);
  const std::string& note = result.scenario->motion.tables[0].notes.back();
  EXPECT_NE(note.find("bias (0.01, -0.02, 0.005) rad/s"), std::string::npos) << note;
  EXPECT_NE(note.find("bias (0.05, 0.02, -0.1) m/s²"), std::string::npos) << note;
}

TEST_F(ImuTest, WrongSettingsAreFindings) {
  WriteLog("imu.csv", Vec6::Zero(), Vec3::Zero(), Vec3::Zero());
  EXPECT_NE(Messages("{output: platform, csv: imu.csv, imu: {end: home}}")
                .find("motion.pose_table.imu.end = 'home' is not one of: free, rest, return"),
            std::string::npos);
  EXPECT_NE(Messages("{output: platform, csv: imu.csv, imu: {rest_s: -1}}").find("rest_s"),
            std::string::npos);
  EXPECT_NE(Messages("{output: platform, csv: imu.csv, angles: rates}").find("is not one of"),
            std::string::npos);
}

}  // namespace
}  // namespace mbv
