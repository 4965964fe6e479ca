// An axis that is tilted by a slip is named as the cause of what it does.
#include "kinematics/constraints.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

// A four-bar whose joints lie in their frames as drawn: closed at home with any axis of D.
std::string TiltedFourBar(const std::string& axis_of_c, const std::string& axis_of_d) {
  return "name: four_bar\n"
         "world: {frames: {A: [0, 0, 0], D: [0.5, 0, 0]}}\n"
         "bodies:\n"
         "  crank: {mass: 1, com: [0, 0.1, 0], inertia: [1, 1, 1], frames: {end: [0, 0.2, 0]}}\n"
         "  coupler: {mass: 1, inertia: [1, 1, 1], frames: {end: [0.5, 0.1, 0]}}\n"
         "  rocker: {mass: 1, inertia: [1, 1, 1], frames: {end: [0, 0.3, 0]}}\n"
         "joints:\n"
         "  A: {kind: revolute, parent: world.A, child: crank, axis: z}\n"
         "  B: {kind: revolute, parent: crank.end, child: coupler, axis: z}\n"
         "  C: {kind: revolute, parent: rocker.end, child: coupler.end, axis: " +
         axis_of_c +
         "}\n"
         "  D: {kind: revolute, parent: world.D, child: rocker, axis: " +
         axis_of_d +
         "}\n"
         "drives: {motor: {kind: joint, joint: A}}\n";
}

TEST(TiltedAxis, ALinkageThatItFreezesSaysSo) {
  for (const auto& [c, d, joint, angle] :
       std::vector<std::tuple<std::string, std::string, std::string, std::string>>{
           {"z", "[0, 0.01, 1]", "'D'", "0.573 deg"},
           {"[0.001, 0, 1]", "z", "'C'", "0.0573 deg"},
           {"[0, 0.05, 1]", "z", "'C'", "2.86 deg"}}) {
    const LoadResult loaded = LoadModelText(TiltedFourBar(c, d), "m.yaml");
    ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    const std::string text = loaded.diagnostics.Text();
    EXPECT_NE(text.find("warning: the axis of joint " + joint + " is tilted by " + angle),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("the mechanism has 1 degrees of freedom instead of 0"), std::string::npos)
        << text;
  }
}

TEST(TiltedAxis, LoopsThatItKeepsOpenSaySo) {
  const std::string text =
      "name: slider_crank\n"
      "bodies:\n"
      "  crank: {mass: 1, inertia: [1, 1, 1], frames: {end: [0, 0.1, 0]}}\n"
      "  rod: {mass: 1, inertia: [1, 1, 1], frames: {end: [0.3, -0.1, 0]}}\n"
      "  slider: {mass: 1, inertia: [1, 1, 1]}\n"
      "joints:\n"
      "  A: {kind: revolute, parent: world, child: crank, axis: z}\n"
      "  B: {kind: revolute, parent: crank.end, child: rod, axis: z}\n"
      "  C: {kind: revolute, parent: rod.end, child: slider, axis: z}\n"
      "  rail: {kind: prismatic, parent: world, child: slider, axis: [1, 0, 0.02], guess: 0.3}\n"
      "drives: {motor: {kind: joint, joint: A}}\n";
  const std::string said = LoadModelText(text, "m.yaml").diagnostics.Text();
  EXPECT_NE(said.find("the axis of joint 'rail' is tilted by 1.15 deg against that of joint 'A' on "
                      "world: with perpendicular axes the loops close"),
            std::string::npos)
      << said;
}

TEST(TiltedAxis, ShippedModelsHaveNone) {
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("/models"))) {
    const auto file = entry.path() / "model.yaml";
    if (!std::filesystem::exists(file)) continue;
    EXPECT_EQ(LoadModel(file.string()).diagnostics.Text().find("tilted"), std::string::npos)
        << file;
  }
}

}  // namespace
}  // namespace mbv
