// Statics without weight: every force is zero, and no witness may make something of it.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "features/run/run_scenario.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

RunOutcome RunWeightless(const std::string& scenario, std::vector<SetValue> set) {
  RunOptions options;
  options.pictures = false;
  options.scenario.set = std::move(set);
  return RunScenario(SourcePath("/scenarios/" + scenario + ".yaml"), options);
}

std::string ReadText(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

// At rest without weight MuJoCo has the solution from the start, and must be made to refine it.
TEST(Weightless, NoStaticScenarioDisagrees) {
  const fs::path source = kSourceDir;
  const fs::path folder = fs::path(testing::TempDir()) / "weightless";
  size_t ran = 0;
  for (const auto& entry : fs::directory_iterator(source / "scenarios")) {
    const std::string name = entry.path().filename();
    if (!fs::exists(entry.path() / "static.yaml")) continue;
    // The same model with its gravity taken away.
    fs::create_directories(folder / name);
    const std::string text = ReadText(source / "models" / name / "model.yaml");
    const std::regex gravity(R"(\ngravity: *\[[^\]]*\])");
    const fs::path model = folder / name / "model.yaml";
    std::ofstream(model) << std::regex_replace(text, gravity, "\n") << "\ngravity: [0, 0, 0]\n";
    const RunOutcome outcome = RunWeightless(name + "/static", {{"mechanism", model.string()}});
    ASSERT_TRUE(outcome.report) << name << ": " << outcome.diagnostics.Text();
    // Where nothing pushes either, nothing is verified; nothing may be found wrong.
    const Comparison& comparison = outcome.report->comparison;
    EXPECT_EQ(comparison.failed(), 0U) << name << ": " << comparison.reason << "\n"
                                       << comparison.attribution.text;
    EXPECT_NE(outcome.exit_code, 1) << name;
    ++ran;
  }
  EXPECT_GE(ran, 7U);
  EXPECT_NE(RunWeightless("cabin_robot/static", {{"parameters", "{g: 0}"}}).exit_code, 1);
}

// A disc on a hinge through its centre of mass: prescribed, or driven; askew; below a cart.
constexpr const char* kHinge =
    "joints:\n  hinge: {kind: revolute, parent: world, child: disc, axis: ";
const std::string kRotors[] = {
    "z}\nprescribed: {hinge: {joint: hinge}}\n",
    "[1, 2, 3]}\nprescribed: {hinge: {joint: hinge}}\n",
    "z}\ndrives: {hinge: {kind: joint, joint: hinge}}\n",
    "z}\n  slide: {kind: prismatic, parent: disc, child: cart, axis: z}\n"
    "prescribed: {hinge: {joint: hinge}}\ndrives: {motor: {kind: joint, joint: slide}}\n"};

RunOutcome RunRotor(const std::string& rotor, const std::string& gravity,
                    const std::string& profile, const std::string& mode, double eccentric) {
  const fs::path folder = fs::path(testing::TempDir()) / "balanced_rotor";
  fs::create_directories(folder);
  const bool cart = rotor.find("cart") != std::string::npos;
  std::ofstream(folder / "model.yaml")
      << "name: rotor\nparameters: {e: 0}\ngravity: [0, 0, " << gravity
      << "]\nup: [0, 0, 1]\nbodies:\n"
         "  disc: {mass: 2, com: [e, 0, 0], inertia: [0.1, 0.2, 0.3]}\n"
      << (cart ? "  cart: {mass: 1, inertia: [0.1, 0.1, 0.1]}\n" : "") << kHinge << rotor;
  const fs::path file = folder / "turn.yaml";
  std::ofstream scenario(file);
  scenario << "mechanism: ./model.yaml\nmotion:\n  duration_s: 1\n  sample_s: 0.02\n  commands:\n";
  scenario << "    hinge: " << profile << "\n" << (cart ? "    motor: " + profile + "\n" : "");
  scenario << "analytic: none\nsimulation: {mode: " << mode << ", parameters: {e: " << eccentric
           << "}}\nsnapshots: {times_s: []}\n";
  scenario.close();
  RunOptions options;
  options.pictures = false;
  return RunScenario(file.string(), options);
}

// Exactly zero in one computation, rounding in the other: no relative error is made of it.
TEST(Weightless, ABalancedRotorDisagreesNowhere) {
  for (const std::string& rotor : kRotors) {
    for (const char* gravity : {"0", "-9.81"}) {
      for (const char* profile :
           {"0.3", "{sine: {amplitude: 0.5, period_s: 1}}", "{ramp: {rate: 3}}"}) {
        for (const char* mode : {"forward", "inverse"}) {
          const RunOutcome outcome = RunRotor(rotor, gravity, profile, mode, 0.0);
          const std::string which = rotor + " " + gravity + " " + profile + " " + mode;
          ASSERT_TRUE(outcome.report) << which << outcome.diagnostics.Text();
          const Comparison& comparison = outcome.report->comparison;
          EXPECT_EQ(comparison.failed(), 0U) << which << ": " << comparison.reason << "\n"
                                             << comparison.attribution.text;
        }
      }
    }
    // A tenth of a millimetre off balance on one side is seen where the disc turns.
    const RunOutcome off =
        RunRotor(rotor, "0", "{sine: {amplitude: 0.5, period_s: 1}}", "inverse", 1e-4);
    ASSERT_TRUE(off.report);
    EXPECT_GT(off.report->comparison.failed(), 0U) << rotor;
  }
}

}  // namespace
}  // namespace mbv
