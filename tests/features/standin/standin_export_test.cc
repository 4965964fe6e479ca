// What replaces a loop: serial model and code together against the full loop, and files read back.
#include "features/standin/standin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "model_file/load_model.h"
#include "reference/reduced_model.h"
#include "tests/support/source_dir.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

struct Exported {
  Mechanism mechanism;
  StandinResult result;
  StandinExport made;
};

// With ranges of ±`half` [rad].
Exported Export(const std::string& file, const std::vector<std::string>& joints, double half,
                const std::map<std::string, double>& overrides = {}) {
  LoadOptions options;
  options.overrides = overrides;
  LoadResult loaded = LoadRobot(SourcePath(file), options);
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  Exported all{.mechanism = loaded.mechanism.value_or(Mechanism()), .result = {}, .made = {}};
  StandinSettings settings;
  for (const std::string& joint : joints) settings.ranges.push_back({joint, -half, half});
  settings.resolution = 3;
  all.result = ComputeStandin(all.mechanism, joints, settings);
  EXPECT_FALSE(all.result.diagnostics.has_errors()) << all.result.diagnostics.Text();
  all.made = ExportStandin(all.mechanism, all.result, "ankle");
  EXPECT_FALSE(all.made.code.diagnostics.has_errors()) << all.made.code.diagnostics.Text();
  return all;
}

TEST(StandinExport, SerialModelAndCodeAreTheLoop) {
  const Exported all =
      Export("/tests/mechanisms/parallel_ankle.yaml", {"ankle.0", "ankle.1"}, 0.15);
  EXPECT_TRUE(all.made.agrees()) << ToText(all.made);
  ASSERT_EQ(all.made.code.judgements.size(), 3U);
  for (const CodeJudgement& judgement : all.made.code.judgements) {
    EXPECT_EQ(judgement.not_judged, "");
    EXPECT_LE(judgement.force, 1e-10) << ToText(all.made);
    EXPECT_LE(judgement.position, 1e-10);
  }
  EXPECT_EQ(all.made.code.judgements[0].states, 10000U);
  EXPECT_EQ(all.made.code.table_share, 1.0);
  ASSERT_EQ(all.made.serial.size(), 2U);
  for (const SerialFile& file : all.made.serial) {
    EXPECT_EQ(file.not_judged, "") << file.name;
    EXPECT_LE(file.difference, 1e-12) << file.name;
  }
}

// The loop's own bodies count: without its rods the code would be another.
TEST(StandinExport, CodeHoldsTheLoopBodies) {
  const Exported all =
      Export("/tests/mechanisms/parallel_ankle.yaml", {"ankle.0", "ankle.1"}, 0.15);
  const Exported heavier = Export("/tests/mechanisms/parallel_ankle.yaml", {"ankle.0", "ankle.1"},
                                  0.15, {{"m_rod", 0.08 * (1.0 + 1e-3)}});
  const auto header = [](const Exported& of) { return of.made.code.files[0].second; };
  EXPECT_TRUE(heavier.made.agrees()) << ToText(heavier.made);
  EXPECT_NE(header(all), header(heavier));
  EXPECT_EQ(all.result.armature, heavier.result.armature);
}

// The serial robot has the chosen joints, their drives and armatures, and no rods.
TEST(StandinExport, SerialRobotLosesTheLoopAlone) {
  Exported all = Export("/tests/mechanisms/parallel_ankle.yaml", {"ankle.0", "ankle.1"}, 0.15);
  Diagnostics found;
  const auto transmission = FindTransmission(all.mechanism, {"ankle.0", "ankle.1"}, &found);
  ASSERT_TRUE(transmission.has_value()) << found.Text();
  const VecX armature = Eigen::Vector2d(0.002, 0.003);
  const Mechanism serial = SerialRobot(*transmission, armature);
  EXPECT_EQ(serial.bodies.size(), 2U);
  EXPECT_EQ(serial.joints.size(), 1U);
  ASSERT_EQ(serial.drives.size(), 2U);
  // Gravity at home of the foot alone, and the armature on the mass matrix' diagonal.
  const std::vector<Coordinate> at = {{Coordinate::Kind::kDrive, 0, 0},
                                      {Coordinate::Kind::kDrive, 1, 0}};
  const auto mass = [&](const VecX& with) {
    const Mechanism robot = SerialRobot(*transmission, with);
    ReducedModel model(robot, at);
    MatX T;
    const VecX still = VecX::Zero(2);
    EXPECT_TRUE(model.Move(model.home(), still, still).ok());
    EXPECT_TRUE(model.Motions(&T).ok());
    return model.MassMatrix(T);
  };
  const MatX added = mass(armature) - mass(VecX::Zero(2));
  EXPECT_NEAR(added(0, 0), 0.002, 1e-12);
  EXPECT_NEAR(added(1, 1), 0.003, 1e-12);
  EXPECT_NEAR(added(0, 1), 0.0, 1e-12);
}

}  // namespace
}  // namespace mbv
