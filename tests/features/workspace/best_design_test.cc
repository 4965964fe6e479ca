// Designs whose set is largest, against optima by hand.
#include "features/workspace/best_design.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model_file/load_model.h"
#include "tests/support/run_program.h"

namespace mbv {
namespace {

using std::numbers::pi;
using testing::HasSubstr;

// Two links of 0.7 m together; the elbow within 30° … 120°. The tip reaches a ring,
// r² = a² + b² + 2ab cos(elbow), of area 2π ab (cos 30° − cos 120°): most where a = b.
constexpr const char* kArm = R"(
name: arm
parameters: {share: {value: 0.3, unit: "1"}, a: 0.7*share, b: 0.7*(1 - share)}
gravity: [0, 0, 0]
bodies:
  upper: {mass: 2, com: [a, 0, 0], inertia: [0.01, 0.01, 0.01], frames: {end: [a, 0, 0]}}
  fore: {mass: 3, com: [b, 0, 0], inertia: [0.02, 0.02, 0.02], frames: {end: [b, 0, 0]}}
joints:
  shoulder: {kind: revolute, parent: world, child: upper, axis: z, guess_deg: 20}
  elbow: {kind: revolute, parent: upper.end, child: fore, axis: z, guess_deg: 70, range_deg: [30, 120]}
drives:
  shoulder: {kind: joint, joint: shoulder}
  elbow: {kind: joint, joint: elbow}
outputs: {tip: fore.end}
)";
const double kArmArea = pi / 2 * 0.49 * (std::cos(pi / 6) - std::cos(2 * pi / 3));

// Two slides; the strokes are functions of u and v, the first one of two hills.
constexpr const char* kSlides = R"yaml(
name: slides
parameters:
  u: {value: 0.2, unit: "1"}
  v: {value: 0.3, unit: "1"}
  x: "0.2 + exp(-40*(u - 0.2)^2) + 1.5*exp(-40*(u - 0.8)^2)"
  y: "1 - 2*(v - 0.6)^2"
gravity: [0, 0, 0]
bodies:
  carriage: {mass: 1, inertia: [0.01, 0.01, 0.01]}
  tool: {mass: 1, inertia: [0.01, 0.01, 0.01]}
joints:
  along: {kind: prismatic, parent: world, child: carriage, axis: x, guess: x/2, range: [0, x]}
  across: {kind: prismatic, parent: carriage, child: tool, axis: y, guess: y/2, range: [0, y]}
drives:
  along: {kind: joint, joint: along}
  across: {kind: joint, joint: across}
outputs: {tool: tool}
)yaml";

ModelOfDesign ModelsOf(const char* text, const std::vector<std::string>& names) {
  return [text, names](const VecX& values) {
    LoadOptions options;
    for (size_t k = 0; k < names.size(); ++k) {
      options.overrides[names[k]] = values[static_cast<Eigen::Index>(k)];
    }
    return LoadModelText(text, "design.yaml", options).mechanism;
  };
}
SetArguments OverPlane(int resolution) {
  SetArguments arguments;
  arguments.over = {"x", "y"};
  arguments.flood.resolution = resolution;
  return arguments;
}
DesignQuestion ShareOf(double low, double high) {
  return {.parameters = {{"share", "1", low, high, 0.3}}, .evaluations = 100};
}

TEST(BestDesign, AnArmReachesMostWithEqualLinks) {
  const DesignQuestion question = ShareOf(0.1, 0.9);
  const ModelOfDesign model = ModelsOf(kArm, {"share"});
  BestDesign best = FindBestDesign(question, model, OverPlane(40));
  ASSERT_TRUE(best.summary.ok()) << best.verdict;
  EXPECT_TRUE(best.agree) << best.verdict;
  EXPECT_NEAR(best.best.at[0], 0.5, 1e-3);
  EXPECT_NEAR(best.set.traced.measure, kArmArea, 1e-5 * kArmArea);
  EXPECT_NEAR(best.tried.front().measure, kArmArea * 4 * 0.3 * 0.7, 1e-9);

  // Another one is not confirmed: beside it the lattice finds larger sets.
  BestDesign other = best;
  other.best.at[0] = 0.4;
  other.best.measure = kArmArea * 4 * 0.4 * 0.6;
  VerifyBestDesign(question, model, OverPlane(40), &other);
  EXPECT_FALSE(other.agree);
  EXPECT_THAT(other.verdict, HasSubstr("is larger"));
  // Nor is another measure, by twice what the lattice resolves.
  other = best;
  other.best.measure += 2 * best.set.flooded.error + best.best.error;
  VerifyBestDesign(question, model, OverPlane(40), &other);
  EXPECT_FALSE(other.agree);
  EXPECT_THAT(other.verdict, HasSubstr("the lattice measures"));
}

TEST(BestDesign, AnOptimumAtAnEndIsFound) {
  const BestDesign best =
      FindBestDesign(ShareOf(0.1, 0.4), ModelsOf(kArm, {"share"}), OverPlane(40));
  EXPECT_TRUE(best.agree) << best.verdict;
  EXPECT_NEAR(best.best.at[0], 0.4, 1e-5);
  const ReportSection section = SectionOf(ShareOf(0.1, 0.4), best, "command");
  EXPECT_THAT(ToText(section, {}), HasSubstr("at its upper end"));
}

TEST(BestDesign, TheWholeBoxIsSearchedUnlessOnlyTheNearestHillIsAsked) {
  DesignQuestion question{.parameters = {{"u", "1", 0.0, 1.0, 0.2}, {"v", "1", 0.0, 1.0, 0.3}},
                          .evaluations = 300};
  const ModelOfDesign model = ModelsOf(kSlides, {"u", "v"});
  const BestDesign whole = FindBestDesign(question, model, OverPlane(24));
  EXPECT_TRUE(whole.agree) << whole.verdict;
  EXPECT_NEAR(whole.best.at[0], 0.8, 5e-3);
  EXPECT_NEAR(whole.best.at[1], 0.6, 5e-3);
  EXPECT_NEAR(whole.best.measure, 1.7, 1e-4);
  EXPECT_EQ(whole.tried.size(), 300u);

  question.global = false;
  question.evaluations = 150;
  const BestDesign near = FindBestDesign(question, model, OverPlane(24));
  EXPECT_NEAR(near.best.at[0], 0.2, 5e-3);
  EXPECT_NEAR(near.best.measure, 1.2, 1e-4);
  EXPECT_TRUE(near.agree) << near.verdict;
  // The hill beside it is what a claim about the whole box is refused with.
  question.global = true;
  BestDesign claimed = near;
  VerifyBestDesign(question, model, OverPlane(24), &claimed);
  EXPECT_FALSE(claimed.agree) << claimed.verdict;
}

TEST(BestDesign, ASeedGivesTheSameDesignsAndAnInterruptedSearchGoesOn) {
  const ModelOfDesign model = ModelsOf(kArm, {"share"});
  DesignQuestion question = ShareOf(0.1, 0.9);
  question.evaluations = 20;
  const auto tried = [&](const ResumeFolder* folder) {
    return ToBytes(FindBestDesign(question, model, OverPlane(24), {}, folder).tried);
  };
  const std::string whole = tried(nullptr);
  question.seed = 2;
  EXPECT_NE(tried(nullptr), whole);
  question.seed = 1;
  const Program scratch("BestDesignResume");
  const std::filesystem::path part = scratch.folder() / "part", left = scratch.folder() / "left";
  {
    const ResumeFolder folder(part, "0123");
    EXPECT_EQ(tried(&folder), whole);
    std::filesystem::copy(part, left);
  }
  const std::filesystem::path log = left / "designs.log";
  std::filesystem::resize_file(log, std::filesystem::file_size(log) / 2);
  const ResumeFolder folder(left, "0123");
  EXPECT_EQ(tried(&folder), whole);
}

TEST(BestDesign, DesignsWithoutASetAreCountedAndSaidWhy) {
  const ModelOfDesign none = [](const VecX&) { return std::optional<Mechanism>(); };
  const BestDesign best = FindBestDesign(ShareOf(0.1, 0.9), none, OverPlane(24));
  EXPECT_EQ(best.summary.stop, Stop::kUnreachable);
  EXPECT_THAT(best.verdict, HasSubstr("the model cannot be built"));
}

TEST(BestDesign, ItsCommandIsReadAndRefused) {
  const Program mbverify("BestDesignCommand");
  const auto call = [&](const std::string& arguments) {
    return mbverify("workspace " + arguments + " --out '" + mbverify.Out() + "'");
  };
  for (const auto& [arguments, message] : std::vector<std::pair<std::string, std::string>>{
           {"--over x,y --maximise volume --over-parameters uper=0.2:0.3",
            "the model has no parameter 'uper'"},
           {"--over x,y --maximise volume --over-parameters upper=0.3:0.2", "the lower one first"},
           {"--over x,y --maximise volume --over-parameters upper_deg=2:3",
            "the parameter is in m"},
           {"--over x,y --maximise volume", "needs --maximise and --over-parameters"},
           {"--over x,qq --maximise volume --over-parameters upper=0.2:0.3",
            "there is no coordinate 'qq'"},
           {"--over x,y --maximise volume --modes all --over-parameters upper=0.2:0.3",
            "another thing than --modes"},
           {"--over x,y --maximise volume --evaluations 1000000 --over-parameters upper=0.2:0.3",
            "1000000 designs take about"}}) {
    const ProgramResult result = call("friction_five_bar " + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments << result.err;
    EXPECT_THAT(result.err, HasSubstr(message)) << arguments;
  }
  EXPECT_FALSE(std::filesystem::exists(mbverify.Out()));
  const ProgramResult result = call(
      "friction_five_bar --over x_mm=0:300 --at y=0.4 --maximise volume --over-parameters "
      "upper_mm=200:260 --evaluations 12 --resolution 24 --json -");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("\"best_design\""));
  const auto folder = std::filesystem::path(mbverify.Out()) / "friction_five_bar/workspace";
  EXPECT_THAT(ReadAll(folder / "designs.csv"), HasSubstr("way,upper,measure,error,why_none"));
  EXPECT_THAT(ReadAll(folder / "best_design.html"), HasSubstr("TriedDesign of the largest length"));
}

}  // namespace
}  // namespace mbv
