// Shipped models that a user copied, changed or looks for from elsewhere.
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>

#include "features/equation_audit/audit.h"
#include "tests/support/run_program.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

const fs::path kModels = SourcePath("/models");
const fs::path kScenarios = SourcePath("/scenarios");

// Of a paper: its page has an audit of the equations. With a scenario, and a length to edit.
struct Paper {
  const char* model;
  const char* scenario;
  const char* length;
};
constexpr Paper kPapers[] = {{"stabilizing_platform", "static", "L1"},
                             {"spr_tripod", "default", "b"},
                             {"cabin_robot", "static", "L1"},
                             {"scara_robot", "default", "l1"}};

class ChangedModelTest : public testing::TestWithParam<Paper> {
 protected:
  Program mbverify{std::string("changed_") + GetParam().model};

  // Beside a folder "models" with the one file.
  [[nodiscard]] std::string Copy(const std::string& model) const {
    const fs::path folder = mbverify.folder() / "models" / GetParam().model;
    fs::create_directories(folder);
    std::ofstream(folder / "model.yaml") << model;
    const fs::path scenario = mbverify.folder() / (std::string(GetParam().scenario) + ".yaml");
    fs::copy_file(kScenarios / GetParam().model / scenario.filename(), scenario,
                  fs::copy_options::overwrite_existing);
    return scenario.string();
  }
  [[nodiscard]] ProgramResult Run(const std::string& scenario) const {
    return mbverify("run --no-pictures --set simulation=off --out '" + mbverify.Out() + "' '" +
                    scenario + "'");
  }
  [[nodiscard]] std::string Page() const {
    for (const auto& entry : fs::recursive_directory_iterator(mbverify.Out())) {
      if (entry.path().filename() == "report.html") return ReadAll(entry.path());
    }
    return "";
  }
};

TEST_P(ChangedModelTest, ACopyWithoutItsElasticModelIsCompared) {
  const std::string model = ReadAll(kModels / GetParam().model / "model.yaml");
  const ProgramResult result = Run(Copy(model));
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_NE(Page().find("are right as printed"), std::string::npos);
}

TEST_P(ChangedModelTest, AnEditedLengthIsComparedAndTheAuditStaysWithTheShippedModel) {
  const std::string model = ReadAll(kModels / GetParam().model / "model.yaml");
  const std::regex length("(\n  " + std::string(GetParam().length) +
                          ": \\{value(?:_mm)?: )([0-9.]+)");
  std::smatch found;
  ASSERT_TRUE(std::regex_search(model, found, length));
  const std::string edited = found.prefix().str() + found[1].str() +
                             std::to_string(1.02 * std::stod(found[2])) + found.suffix().str();
  const ProgramResult result = Run(Copy(edited));
  EXPECT_LE(result.exit_code, 3) << result.out << result.err;
  EXPECT_NE(result.exit_code, 2) << result.out << result.err;
  const std::string page = Page();
  EXPECT_EQ(page.find("are right as printed"), std::string::npos);
  EXPECT_NE(page.find(std::string("mbverify audit ") + GetParam().model), std::string::npos);
}

TEST_P(ChangedModelTest, GravityOfTheScenarioIsThatOfAllWitnesses) {
  const std::string gravity = std::string(GetParam().model) == "cabin_robot"  ? "[0, -1.62, 0]"
                              : std::string(GetParam().model) == "spr_tripod" ? "[0, 0, 1.62]"
                                                                              : "[0, 0, -1.62]";
  const bool platform = std::string(GetParam().model) == "stabilizing_platform";
  const std::string name = platform ? "sea_state" : GetParam().scenario;
  const std::string scenario = (kScenarios / GetParam().model / (name + ".yaml")).string();
  const ProgramResult result = mbverify(
      "run -q --no-pictures --mode inverse --set motion.sample_s=0.05 --set 'gravity=" + gravity +
      "' --out '" + mbverify.Out() + "' '" + scenario + "'");
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
}

INSTANTIATE_TEST_SUITE_P(Papers, ChangedModelTest, testing::ValuesIn(kPapers),
                         [](const auto& info) { return std::string(info.param.model); });

TEST(Papers, AreAllThatAreAudited) {
  for (const AuditEntry& entry : Audits()) {
    EXPECT_TRUE(std::any_of(std::begin(kPapers), std::end(kPapers), [&](const Paper& paper) {
      return entry.mechanism == paper.model;
    })) << entry.mechanism;
  }
}

TEST(AnyFolder, ShippedModelsAndScenariosAreFound) {
  const Program mbverify("any_folder");
  fs::create_directories(mbverify.folder() / "models" / "spr_tripod");
  std::ofstream(mbverify.folder() / "models" / "spr_tripod" / "model.yaml") << "name: other\n";
  for (const fs::path& folder : {fs::path("/"), fs::temp_directory_path(), mbverify.folder()}) {
    EXPECT_EQ(mbverify.From(folder, "model four_bar").exit_code, 0) << folder;
    const ProgramResult list = mbverify.From(folder, "list");
    EXPECT_NE(list.out.find("four_bar"), std::string::npos) << folder << list.out;
    EXPECT_NE(list.out.find("scenarios/four_bar/turn.yaml"), std::string::npos) << folder;
  }
  // A model of the same name does not change the audit of the paper.
  EXPECT_EQ(mbverify.From(mbverify.folder(), "audit spr_tripod").exit_code, 0);
}

// As after `mbverify init`: names are looked up in the user's folder first, then among the shipped
// ones.
TEST(AnyFolder, OwnScenariosDoNotHideTheShippedOnes) {
  const Program mbverify("own_scenarios");
  const fs::path own = mbverify.folder() / "scenarios" / "four_bar";
  fs::create_directories(own);
  std::ofstream(own / "turn.yaml")
      << "mechanism: four_bar\ndescription: Mine\nanalytic: none\nsimulation: {mode: inverse}\n"
         "motion: {duration_s: 0.1, commands: {motor: home}}\n";
  const std::string run = " -q --no-pictures --no-report --out '" + mbverify.Out() + "'";
  for (const char* name : {"four_bar/turn", "four_bar/static", "slider_crank/static"}) {
    const ProgramResult result = mbverify.From(mbverify.folder(), "run " + std::string(name) + run);
    EXPECT_EQ(result.exit_code, 0) << name << result.err;
  }
  const std::string list = mbverify.From(mbverify.folder(), "list").out;
  EXPECT_NE(list.find("Mine"), std::string::npos);
  EXPECT_EQ(list.find("One turn of the crank, from rest to rest"), std::string::npos);
  EXPECT_NE(list.find("four_bar/static.yaml"), std::string::npos);
}

TEST(ModelParameters, AreSetByTheSameWordsInEveryCommand) {
  const Program mbverify("model_set");
  const std::string plain = mbverify("model four_bar --format mjcf --set crank=0.125").out;
  for (const char* set :
       {"crank=1/8", "crank=0.1+0.025", "crank_mm=125", "crank=\"1/8\"", "crank=sqrt(1/64)"}) {
    const ProgramResult result =
        mbverify("model four_bar --format mjcf --set '" + std::string(set) + "'");
    EXPECT_EQ(result.exit_code, 0) << set << result.err;
    EXPECT_EQ(result.out, plain) << set;
    EXPECT_EQ(mbverify("run -q --no-pictures --mode inverse --out '" + mbverify.Out() +
                       "' scenarios/four_bar/turn.yaml --set 'parameters." + set + "'")
                  .exit_code,
              0)
        << set;
  }
  for (const char* set : {"crank", "crank=", "crank=[1]", "crank=x", "cranc=1", "crank=1/0",
                          "crank=0.1 --set crank_mm=100"}) {
    const ProgramResult result = mbverify("model four_bar --format mjcf --set " + std::string(set));
    EXPECT_EQ(result.exit_code, 2) << set;
    EXPECT_NE(result.err.find("--set cran"), std::string::npos) << set << result.err;
  }
}

TEST(Findings, AreReportedOncePerCall) {
  const Program mbverify("told_once");
  std::string model = ReadAll(kModels / "four_bar" / "model.yaml");
  const std::string motor = "motor: {";
  ASSERT_NE(model.find(motor), std::string::npos);
  model.insert(model.find(motor) + motor.size(), "range: [5, 6], ");
  std::ofstream(mbverify.folder() / "four_bar.yaml") << model;
  std::string files;
  for (const char* name : {"a.yaml", "b.yaml"}) {
    std::ofstream(mbverify.folder() / name)
        << "mechanism: ./four_bar.yaml\nmotion: {duration_s: 1, commands: {motor: home}}\n"
           "simulation: {mode: inverse, ignore_ranges: true}\nsnapshots: {times_s: []}\n";
    files += " '" + (mbverify.folder() / name).string() + "'";
  }
  for (const std::string& call :
       {"run -q --no-pictures --out '" + mbverify.Out() + "'" + files, "check" + files}) {
    const ProgramResult result = mbverify(call);
    const std::string text = result.out + result.err;
    const size_t first = text.find("is at");
    EXPECT_NE(first, std::string::npos) << text;
    EXPECT_EQ(text.find("is at", first + 1), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace mbv
