// mbverify sheet: rows follow what was run, and only while the files are the same.
#include "features/sheet/sheet.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "report/document.h"
#include "tests/support/json_schemas.h"
#include "tests/support/run_program.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

constexpr const char* kRunRows[] = {"code_agreement",    "code_order",     "solution_grid",
                                    "solution_proof",    "robustness",     "validation",
                                    "input_uncertainty", "reproducibility"};

class SheetTest : public testing::Test {
 protected:
  void SetUp() override {
    Copy("/models/four_bar/model.yaml", "model.yaml");
    Copy("/scenarios/four_bar/tables/noisy.csv", "tables/noisy.csv");
    Copy("/scenarios/four_bar/table_noisy.yaml", "measured.yaml");
    Copy("/scenarios/four_bar/study_validation.yaml", "study.yaml", "table_noisy.yaml",
         "measured.yaml");
  }

  void Copy(const std::string& from, const std::string& to, const std::string& old = "four_bar\n",
            const std::string& now = "./model.yaml\n") const {
    std::string text = ReadAll(SourcePath(from));
    if (const size_t at = text.find(old); at != std::string::npos && to != "model.yaml") {
      text.replace(at, old.size(), now);
    }
    Write(to, text);
  }
  void Write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder() / name).parent_path());
    std::ofstream(folder() / name) << text;
  }
  [[nodiscard]] fs::path folder() const { return mbverify.folder() / "case"; }
  [[nodiscard]] fs::path out() const { return mbverify.folder() / "out"; }
  [[nodiscard]] std::string scenario() const { return (folder() / "measured.yaml").string(); }

  [[nodiscard]] Sheet Now() const {
    Diagnostics diagnostics;
    std::optional<Sheet> sheet = MakeSheet(scenario(), out(), &diagnostics);
    EXPECT_TRUE(sheet.has_value()) << diagnostics.Text();
    return sheet.value_or(Sheet());
  }
  int Call(const SheetCommand& command) const {
    const ProgramResult result = mbverify(ToText(command).substr(std::string("mbverify ").size()));
    EXPECT_LE(result.exit_code, 1) << ToText(command) << "\n" << result.err;
    return result.exit_code;
  }
  void RunAll() const {
    for (const SheetCommand& command : Missing(Now())) Call(command);
  }
  // A value of a JSON file, replaced.
  void Change(const fs::path& file, const std::string& pointer, const json& value) const {
    json document = json::parse(ReadAll(file));
    document.at(json::json_pointer(pointer)) = value;
    std::ofstream(file) << document.dump();
  }

  Program mbverify{testing::UnitTest::GetInstance()->current_test_info()->name()};
};

std::set<std::string> Having(const Sheet& sheet, SheetStatus status) {
  std::set<std::string> keys;
  for (const SheetRow& row : sheet.rows) {
    if (row.status == status) keys.insert(row.key);
  }
  return keys;
}
int LevelOf(const Sheet& sheet, const std::string& factor) {
  for (const SheetFactor& of : FactorsOf(sheet)) {
    if (of.name == factor) return of.level;
  }
  ADD_FAILURE() << factor;
  return -2;
}

TEST_F(SheetTest, EachRowTurnsFromNotDoneToItsValue) {
  const std::set<std::string> all(std::begin(kRunRows), std::end(kRunRows));
  Sheet before = Now();
  EXPECT_EQ(Having(before, SheetStatus::kNotDone), all);
  for (const char* factor :
       {"Verification", "Validation", "Results uncertainty", "Results robustness"}) {
    EXPECT_EQ(LevelOf(before, factor), 0) << factor;
  }
  // What each command brings, and no other row.
  struct Step {
    std::string first;
    std::set<std::string> rows;
  };
  const std::vector<Step> steps = {{"run", {"code_agreement", "solution_proof", "validation"}},
                                   {"converge", {"code_order", "solution_grid"}},
                                   {"study", {"input_uncertainty"}},
                                   {"sensitivity", {"robustness"}},
                                   {"package", {}},
                                   {"package", {"reproducibility"}}};
  const std::vector<SheetCommand> commands = Missing(before);
  ASSERT_EQ(commands.size(), steps.size());
  std::set<std::string> done;
  for (size_t k = 0; k < steps.size(); ++k) {
    EXPECT_EQ(commands[k].front(), steps[k].first);
    EXPECT_EQ(Call(commands[k]), 0);
    const Sheet sheet = Now();
    done.insert(steps[k].rows.begin(), steps[k].rows.end());
    EXPECT_EQ(Having(sheet, SheetStatus::kDone), done) << ToText(commands[k]);
    for (const std::string& key : steps[k].rows) {
      EXPECT_NE(sheet.Row(key).result, before.Row(key).result) << key;
      EXPECT_TRUE(fs::exists(sheet.Row(key).evidence)) << key << sheet.Row(key).evidence;
    }
    before = sheet;
  }
  EXPECT_EQ(done, all);
  EXPECT_TRUE(Missing(before).empty());
  EXPECT_EQ(before.exit_code(), 0);
  EXPECT_EQ(LevelOf(before, "Verification"), 3);
  EXPECT_EQ(LevelOf(before, "Validation"), 2);
  EXPECT_EQ(LevelOf(before, "Results uncertainty"), 3);
  EXPECT_EQ(LevelOf(before, "Results robustness"), 4);

  // The numbers are those of the files.
  const json summary = json::parse(ReadAll(before.Row("code_agreement").evidence)),
             converge = json::parse(ReadAll(before.Row("solution_grid").evidence));
  EXPECT_EQ(before.Row("code_agreement").values.at("verified").get<int>(),
            summary.at("counts").at("checks_verified").get<int>());
  EXPECT_EQ(before.Row("solution_grid").values.at("u_num").at("motor").get<double>(),
            converge.at("extrapolation").at("drives").at(0).at("uncertainty").get<double>());
  EXPECT_THAT(before.Row("solution_grid").result, HasSubstr("U_num: motor "));
  EXPECT_THAT(before.Row("validation").result, HasSubstr("noisy.csv"));
  EXPECT_THAT(before.Row("validation").result, HasSubstr("0 of 201 samples outside"));

  // All samples proved: the last level.
  Call({"run", scenario(), "--certify=all", "--out", out().string()});
  EXPECT_EQ(LevelOf(Now(), "Verification"), 4);

  // Another state of any file that was read.
  for (const char* name : {"measured.yaml", "model.yaml", "tables/noisy.csv"}) {
    const std::string text = ReadAll(folder() / name);
    Write(name, text + "# changed\n");
    const Sheet stale = Now();
    EXPECT_EQ(Having(stale, SheetStatus::kStale), all) << name;
    for (const char* key : kRunRows) {
      if (std::string(key) == "validation") continue;
      EXPECT_THAT(stale.Row(key).result,
                  HasSubstr("made from another state of " + (folder() / name).string()))
          << key;
    }
    for (const SheetFactor& factor : stale.factors) {
      if (factor.name == "Input pedigree") continue;
      EXPECT_LE(factor.level, 0) << factor.name << name;
    }
    EXPECT_EQ(Missing(stale).size(), steps.size()) << name;
    Write(name, text);
    EXPECT_EQ(Having(Now(), SheetStatus::kDone), all) << name;
  }

  // The program does it at once, and writes page, PDF and numbers.
  Write("measured.yaml", ReadAll(folder() / "measured.yaml") + "# changed\n");
  const ProgramResult result =
      mbverify(fmt::format("sheet '{}' --run --out '{}' --json -", scenario(), out().string()));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const json document = json::parse(result.out);
  EXPECT_EQ(test::JsonSchemas().Misfit(document), "");
  const fs::path made = out() / "four_bar/sheet/measured";
  EXPECT_EQ(ReadAll(made / "sheet.json"), result.out);
  const std::string page = ReadAll(made / "sheet.html"), pdf = ReadAll(made / "sheet.pdf");
  for (const json& row : document.at("rows")) {
    EXPECT_THAT(page, HasSubstr(row.at("title").get<std::string>()));
    EXPECT_NE(row.at("status"), "other state");
    EXPECT_NE(row.at("status"), "not done");
  }
  EXPECT_TRUE(pdf.starts_with("%PDF")) << pdf.substr(0, 20);
}

TEST_F(SheetTest, FailuresAreShownAndRaiseNothing) {
  RunAll();
  const Sheet good = Now();
  ASSERT_EQ(good.Count(SheetStatus::kDone), std::size(kRunRows));
  const fs::path home = out() / "four_bar", run = home / "measured/summary.json",
                 converge = home / "convergence/measured/converge.json",
                 sensitivity = home / "sensitivity/measured/sensitivity.json",
                 study = out() / "four_bar_validation/summary.json",
                 check = home / "package/measured.json";
  const struct {
    fs::path file;
    const char *pointer, *value, *row, *factor;
  } kChanges[] = {
      {run, "/verdict", "\"disagree\"", "code_agreement", "Verification"},
      {run, "/counts/checks_verified", "0", "code_agreement", "Verification"},
      {run, "/certificate/witnesses/0/wrong", "true", "solution_proof", "Verification"},
      {run, "/certificate/proved_samples", "9", "solution_proof", "Verification"},
      {run, "/reference_table/columns/0/judged/simulated_vs_reference/inside", "false",
       "validation", "Validation"},
      {run, "/checks/0/pass", "false", "validation", "Validation"},
      {converge, "/verdict", "\"finding\"", "code_order", "Verification"},
      {converge, "/extrapolation/pass", "false", "solution_grid", "Verification"},
      {converge, "/extrapolation/pass", "false", "solution_grid", "Results uncertainty"},
      {study, "/exit_code", "1", "input_uncertainty", "Results uncertainty"},
      {study, "/validation/pass", "false", "validation", "Validation"},
      {sensitivity, "/exit_code", "1", "robustness", "Results robustness"},
      {check, "/scenarios/0/exit_code", "1", "reproducibility", nullptr},
      {check, "/scenarios/0/failure", "\"cannot run\"", "reproducibility", nullptr},
      {check, "/scenarios/0/files/0/outcome", "\"differs\"", "reproducibility", nullptr}};
  for (const auto& change : kChanges) {
    const std::string text = ReadAll(change.file);
    Change(change.file, change.pointer, json::parse(change.value));
    const Sheet sheet = Now();
    const std::string what = change.file.string() + change.pointer;
    EXPECT_EQ(sheet.Row(change.row).status, SheetStatus::kFailed) << what;
    EXPECT_EQ(sheet.exit_code(), 1) << what;
    if (change.factor != nullptr) {
      EXPECT_LT(LevelOf(sheet, change.factor), LevelOf(good, change.factor)) << what;
    }
    EXPECT_THAT(ToText(sheet, TextStyle()), HasSubstr("  failed  ")) << what;
    EXPECT_THAT(SheetPage(sheet), HasSubstr("1 failed")) << what;
    std::ofstream(change.file) << text;
  }
  // Not about this state: another program, values set, an unreadable file, no list of inputs.
  const fs::path inputs = home / "measured/inputs.json";
  const std::string kept = ReadAll(inputs);
  for (const auto& [pointer, value, says] :
       {std::tuple("/program", "\"mbverify 0.0.9\"", "made by mbverify 0.0.9"),
        std::tuple("/set", R"({"parameters.rho": "3"})", "made with --set parameters.rho=3"),
        std::tuple("/inputs", "[]", "another state")}) {
    Change(inputs, pointer, json::parse(value));
    EXPECT_EQ(Now().Row("code_agreement").status, SheetStatus::kStale) << pointer;
    EXPECT_THAT(Now().Row("code_agreement").result, HasSubstr(says));
    std::ofstream(inputs) << kept;
  }
  fs::remove(inputs);
  EXPECT_EQ(Now().Row("code_agreement").status, SheetStatus::kStale);
  std::ofstream(inputs) << kept;
  std::ofstream(converge) << "{\"verdict\": 3}";
  EXPECT_EQ(Now().Row("code_order").status, SheetStatus::kStale);
  EXPECT_THAT(Now().Row("code_order").result, HasSubstr("cannot be read"));
}

// A run with other values in the same place is not this scenario's.
TEST_F(SheetTest, RunsWithOtherValuesAreRefused) {
  Call({"run", scenario(), "--certify", "--set", "parameters.rho=2.1", "--out", out().string()});
  const Sheet sheet = Now();
  EXPECT_EQ(sheet.Row("code_agreement").status, SheetStatus::kStale);
  EXPECT_THAT(sheet.Row("code_agreement").result, HasSubstr("--set parameters.rho=2.1"));
}

TEST_F(SheetTest, SaysWhatDoesNotApply) {
  Write("measured.yaml", ReadAll(SourcePath("/scenarios/spring_cart/swing.yaml")));
  fs::remove(folder() / "study.yaml");
  EXPECT_EQ(Missing(Now()).size(), 3u);  // the run, the archive and its check
  RunAll();
  EXPECT_EQ(Having(Now(), SheetStatus::kNotApplicable),
            std::set<std::string>({"code_order", "solution_grid", "solution_proof", "robustness"}));
  EXPECT_EQ(LevelOf(Now(), "Verification"), 1);
  const ProgramResult refused =
      mbverify("sheet scara_robot/stiffness --out '" + mbverify.Out() + "'");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("a sheet is about a scenario with a motion"));
}

// Levels of all combinations in which one row is worse than done.
TEST(SheetLevels, NeverRiseByWhatIsNotDone) {
  Sheet best;
  for (const char* key : kRunRows) {
    best.rows.push_back({.key = key, .title = key, .standard = "", .status = SheetStatus::kDone});
  }
  for (SheetRow& row : best.rows) {
    if (row.key == "solution_proof") {
      row.values = {{"proved_samples", 11}, {"samples_of_motion", 11}};
    }
    if (row.key == "validation") row.values["columns"] = {{{"u_data", 0.1}}};
  }
  best.rows.push_back({.key = "input_pedigree", .title = "", .standard = ""});
  best.rows.back().values = {
      {"parameters", 3}, {"assumed", 0}, {"unstated", 0}, {"set_by_scenario", 0}};
  const std::vector<SheetFactor> most = FactorsOf(best);
  EXPECT_EQ(LevelOf(best, "Verification"), 4);
  EXPECT_EQ(LevelOf(best, "Input pedigree"), 2);
  for (size_t r = 0; r + 1 < best.rows.size(); ++r) {
    size_t lower = 0;
    for (const SheetStatus status : {SheetStatus::kFailed, SheetStatus::kStale,
                                     SheetStatus::kNotDone, SheetStatus::kNotApplicable}) {
      Sheet sheet = best;
      sheet.rows[r].status = status;
      const std::vector<SheetFactor> factors = FactorsOf(sheet);
      for (size_t f = 0; f < factors.size(); ++f) {
        EXPECT_LE(factors[f].level, most[f].level);
        lower += factors[f].level < most[f].level ? 1 : 0;
      }
    }
    // Reproducibility is no factor of the scale; either of two ways gives the numerical error.
    const std::string& key = best.rows[r].key;
    EXPECT_EQ(lower == 0, key == "reproducibility") << key;
  }
  for (const char* none : {"unstated", "set_by_scenario", "assumed"}) {
    Sheet sheet = best;
    sheet.rows.back().values[none] = 1;
    EXPECT_LT(LevelOf(sheet, "Input pedigree"), 2) << none;
  }
}

}  // namespace
}  // namespace mbv
