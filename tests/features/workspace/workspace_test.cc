#include "features/workspace/workspace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <regex>

#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

Mechanism LoadShipped(const std::string& name) {
  LoadResult result = LoadModel(SourcePath("/models/") + name + "/model.yaml");
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return *result.mechanism;
}

const std::string* FindFile(const WorkspaceOutcome& outcome, const std::string& name) {
  for (const auto& [file, content] : outcome.files) {
    if (file == name) return &content;
  }
  return nullptr;
}

TEST(Workspace, TripodGivesMeshSectionsAndTheKnownVolume) {
  const WorkspaceOutcome outcome = ComputeWorkspace(LoadShipped("spr_tripod"), false);
  ASSERT_TRUE(outcome.summary.ok()) << outcome.summary.message;
  EXPECT_NE(outcome.text.find("0.01243676143457"), std::string::npos) << outcome.text;
  for (const char* file : {"workspace.stl", "workspace.ply", "sections.csv", "sections_axial.svg",
                           "sections_horizontal.svg"}) {
    const std::string* content = FindFile(outcome, file);
    ASSERT_NE(content, nullptr) << file;
    EXPECT_GT(content->size(), 1000u) << file;
  }
  // Binary STL: 84 bytes of header and 50 per triangle; six faces of 2 · 50² triangles.
  EXPECT_EQ(FindFile(outcome, "workspace.stl")->size(), 84u + 50u * 6u * 2u * 50u * 50u);
}

TEST(Workspace, ScaraReachesThePapersCylinderWithoutYawAndNotWithIt) {
  const WorkspaceOutcome outcome = ComputeWorkspace(LoadShipped("scara_robot"), false);
  ASSERT_TRUE(outcome.summary.ok()) << outcome.summary.message;
  EXPECT_NE(outcome.text.find("yaw 0 deg: 20174 of 20174 poses reached"), std::string::npos)
      << outcome.text;
  EXPECT_EQ(outcome.text.find("yaw 45 deg: 20174 of"), std::string::npos) << outcome.text;
  const std::string* map = FindFile(outcome, "singularity_z-165mm.csv");
  ASSERT_NE(map, nullptr);
  EXPECT_EQ(std::count(map->begin(), map->end(), '\n'), 1 + 61 * 61);
}

// No digits beyond the sampling's error, and the numbers are in the JSON, too.
TEST(Workspace, ScarasVolumesShowAsManyDigitsAsTheirErrorLeaves) {
  const WorkspaceOutcome outcome = ComputeWorkspace(LoadShipped("scara_robot"), false);
  EXPECT_TRUE(std::regex_search(outcome.text,
                                std::regex(R"(volume at yaw 0 deg: 0\.0\d{4} \+- \de-05 m\^3 .*; )"
                                           R"(\d\d\.\d \+- [1-9]e-01 % of it)")))
      << outcome.text;
  ASSERT_EQ(outcome.measures.size(), 4u);
  for (const WorkspaceMeasure& measure : outcome.measures) {
    EXPECT_GT(measure.error, 0.0) << measure.name;
    // Shares of some 1e4 samples each: 2 √(p (1 − p)/n) is below 0.01.
    EXPECT_LT(measure.error, measure.unit == "1" ? 0.01 : 0.01 * measure.value) << measure.name;
  }
}

TEST(Workspace, ItsBytesDoNotDependOnTheNumberOfJobs) {
  for (const char* name : {"spr_tripod", "scara_robot"}) {
    const WorkspaceOutcome one = ComputeWorkspace(LoadShipped(name), false);
    const WorkspaceOutcome many = ComputeWorkspace(LoadShipped(name), false, 3);
    EXPECT_EQ(one.text, many.text) << name;
    EXPECT_EQ(one.files, many.files) << name;
  }
}

TEST(Workspace, JointRangesCountAsInStiffnessMaps) {
  Mechanism tripod = LoadShipped("spr_tripod");
  const WorkspaceOutcome whole = ComputeWorkspace(tripod, false);
  EXPECT_TRUE(whole.agree);
  EXPECT_NE(whole.text.find("within the ranges of the model's joints, too: 100.00 %"),
            std::string::npos)
      << whole.text;
  for (Joint& joint : tripod.joints) {
    if (joint.name.ends_with(".R")) joint.range[0] = {-0.05, 0.05};
  }
  const WorkspaceOutcome part = ComputeWorkspace(tripod, false);
  EXPECT_TRUE(part.agree);
  EXPECT_EQ(part.text.find("too: 100.00 %"), std::string::npos) << part.text;
}

TEST(Workspace, AMechanismWithoutOneIsRefusedByName) {
  const WorkspaceOutcome outcome = ComputeWorkspace(LoadShipped("cabin_robot"), false);
  EXPECT_EQ(outcome.summary.stop, Stop::kUnsupported);
  EXPECT_NE(outcome.summary.message.find("cabin_robot"), std::string::npos);
  EXPECT_TRUE(outcome.files.empty());
}

}  // namespace
}  // namespace mbv
