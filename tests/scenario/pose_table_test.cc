// motion.pose_table: the same motion in every convention, and what is said about wrong files.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "math/spatial.h"
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

}  // namespace
}  // namespace mbv
