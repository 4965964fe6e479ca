// Processes that share work and are killed: what is lost is reported, and the rest is no good end.
#include <gtest/gtest.h>
#include <sys/types.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "features/convergence/converge.h"
#include "features/stiffness/stiffness_map.h"
#include "features/stiffness/stiffness_scenario.h"
#include "features/workspace/workspace.h"
#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

// Kills the processes that share the work, once; they are busy with what comes next.
class Killer {
 public:
  void operator()(const std::string& /*stage*/, double /*fraction*/) {
    if (std::exchange(done_, true)) return;
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
      std::ifstream children(task.path() / "children");
      for (pid_t child = 0; children >> child;) killed_ += kill(child, SIGKILL) == 0;
    }
  }
  [[nodiscard]] int killed() const { return killed_; }

 private:
  bool done_ = false;
  int killed_ = 0;
};

TEST(KilledJobs, AConvergenceStudyCouldNotRun) {
  Killer kill;
  const ConvergeOptions options{.jobs = 2, .progress = std::ref(kill)};
  const ConvergeOutcome outcome =
      Converge(SourcePath("/scenarios/slider_crank/press.yaml"), options);
  ASSERT_GT(kill.killed(), 0);
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.failure.find("killed: the process of corrected engine, step and"),
            std::string::npos)
      << outcome.failure;
}

Mechanism WorkspaceModel(const std::string& name) {
  LoadResult loaded = LoadModel(SourcePath("/models/") + name + "/model.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return *std::move(loaded.mechanism);
}

TEST(KilledJobs, AWorkspaceWhoseProcessIsKilledIsNone) {
  Killer kill;
  const WorkspaceOutcome outcome =
      ComputeWorkspace(WorkspaceModel("spr_tripod"), false, 2, std::ref(kill));
  ASSERT_GT(kill.killed(), 0);
  EXPECT_FALSE(outcome.summary.ok());
  EXPECT_NE(outcome.summary.message.find("was killed"), std::string::npos)
      << outcome.summary.message;
}

struct PreparedMap {
  PreparedStiffness prepared;
  StiffnessMap map;
};

// By frame elements, so that a row takes long enough to be killed in.
PreparedMap MapOfScara() {
  std::filesystem::current_path(kSourceDir);
  StiffnessScenarioResult loaded = LoadStiffnessScenarioText(
      "kind: stiffness\nmechanism: scara_robot\nsimulation: off\nanalytic: none\n",
      "scenarios/s.yaml");
  Diagnostics diagnostics;
  auto prepared =
      PrepareStiffness(*std::move(loaded.scenario), *std::move(loaded.mechanism), &diagnostics);
  auto map = ParseMap("x=-0.06:0.06:3,y=-0.06:0.06:21,z=-0.19,phi_deg=10", *prepared, &diagnostics);
  EXPECT_TRUE(map) << diagnostics.Text();
  return {*std::move(prepared), *std::move(map)};
}

TEST(KilledJobs, RowsOfAStiffnessMapThatWereKilledAreEmptyAndReported) {
  const PreparedMap at = MapOfScara();
  const MapResult whole = ComputeMap(at.prepared, at.map, {}, 2);
  Killer kill;
  const MapResult holed = ComputeMap(at.prepared, at.map, std::ref(kill), 2);
  ASSERT_GT(kill.killed(), 0);
  EXPECT_GT(holed.lost_rows, 0);
  EXPECT_LT(holed.reached, whole.reached);
  EXPECT_NE(MapText(at.map, holed, {}).find("rows are empty: their processes were killed"),
            std::string::npos);
}

}  // namespace
}  // namespace mbv
