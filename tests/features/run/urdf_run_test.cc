// Exported to URDF and read back, the papers' mechanisms run again and need the same drive forces.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "analytic/closed_form.h"
#include "features/run/run_scenario.h"
#include "model_file/load_model.h"
#include "model_file/urdf/urdf_import.h"
#include "tests/support/source_dir.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

struct Case {
  const char* model;
  double amplitude;  // of all drives [m or rad]
};

// The export writes dots in names of drives as _.
std::string Flat(std::string name) {
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}

std::string Write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
  return file.string();
}

// All drives swing about home, what is prescribed stays there.
std::string UrdfScenario(const std::string& model, const Mechanism& mechanism, double amplitude) {
  std::string text = fmt::format(
      "mechanism: {}\nmotion:\n  duration_s: 1\n  sample_s: 0.05\n"
      "  commands:\n",
      model);
  for (const Drive& drive : mechanism.drives) {
    text += fmt::format("    {}: [home, {{sine: {{amplitude: {}, period_s: 1}}}}]\n", drive.name,
                        amplitude);
  }
  for (const Prescribed& p : mechanism.prescribed) text += fmt::format("    {}: home\n", p.name);
  return text + "analytic: none\nsimulation: {mode: inverse}\nsnapshots: {times_s: []}\n";
}

Trace TraceOf(const RunOutcome& outcome, const std::string& witness) {
  EXPECT_TRUE(outcome.report) << outcome.diagnostics.Text();
  if (!outcome.report) return {};
  for (const WitnessRecord& record : outcome.report->witnesses) {
    if (record.name != witness) continue;
    EXPECT_TRUE(record.summary.ok()) << witness << ": " << record.summary.message;
    return record.trace;
  }
  return {};
}

class ExportedModel : public testing::TestWithParam<Case> {};

TEST_P(ExportedModel, RunsAgainWithTheSameDriveForces) {
  const std::string shipped = SourcePath(fmt::format("/models/{}/model.yaml", GetParam().model));
  const LoadResult loaded = LoadModel(shipped);
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const fs::path folder = fs::path(testing::TempDir()) / "mbv_urdf_run" / GetParam().model;
  // What completes the URDF is found beside it.
  const std::string model = Write(folder / "robot.urdf", WriteUrdf(*loaded.mechanism));
  Write(UrdfCompanionPath(model), WriteUrdfCompanion(*loaded.mechanism, "robot.urdf"));
  const LoadResult back = LoadRobot(model);
  ASSERT_TRUE(back.mechanism) << back.diagnostics.Text();

  RunOptions options;
  options.pictures = false;
  const RunOutcome before = RunScenario(
      Write(folder / "before.yaml", UrdfScenario(shipped, *loaded.mechanism, GetParam().amplitude)),
      options);
  const RunOutcome after = RunScenario(
      Write(folder / "after.yaml", UrdfScenario(model, *back.mechanism, GetParam().amplitude)),
      options);
  for (const char* witness : {"reference", "simulated"}) {
    const Trace a = TraceOf(before, witness), b = TraceOf(after, witness);
    ASSERT_EQ(a.time_s.size(), 21u) << witness;
    ASSERT_EQ(b.time_s.size(), 21u) << witness;
    double scale = 0.0, worst = 0.0;
    for (const Drive& drive : loaded.mechanism->drives) {
      const int i = a.Find(drive.name + ".force"), k = b.Find(Flat(drive.name) + ".force");
      ASSERT_TRUE(i >= 0 && k >= 0) << drive.name;
      scale = std::max(scale, a.values.col(i).cwiseAbs().maxCoeff());
      const double difference = (a.values.col(i) - b.values.col(k)).cwiseAbs().maxCoeff();
      worst = std::isnan(difference) ? kNan : std::max(worst, difference);
    }
    // Both close their loops to round-off: 1e-9 is far above it, and far below another mechanism.
    EXPECT_LT(worst, 1e-9 * scale) << witness;
  }
}

constexpr Case kExported[] = {{"stabilizing_platform", 0.1},
                              {"spr_tripod", 0.02},
                              {"cabin_robot", 0.02},
                              {"scara_robot", 0.1}};

INSTANTIATE_TEST_SUITE_P(Urdf, ExportedModel, testing::ValuesIn(kExported),
                         [](const auto& c) { return std::string(c.param.model); });

TEST(ExportedModels, AreAllThatHaveClosedForms) {
  for (const ClosedFormRow& row : ClosedForms()) {
    EXPECT_TRUE(std::any_of(std::begin(kExported), std::end(kExported), [&](const Case& c) {
      return row.mechanism == c.model;
    })) << row.mechanism;
  }
}

}  // namespace
}  // namespace mbv
