// What an archive says of its date, and what it must not say of its maker.
#include "features/paper/package.h"

#include <gtest/gtest.h>

#include "features/paper/packed_run.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

TEST(LineNaming, FindsAFolderButNoPartOfAnotherName) {
  EXPECT_EQ(LineNaming("a: 1\nb: /users/jane/x.csv\n", "/users/jane"), 2);
  EXPECT_EQ(LineNaming("\"/users/jane\"", "/users/jane"), 1);
  EXPECT_EQ(LineNaming("/users/janet/x", "/users/jane"), 0);
  EXPECT_EQ(LineNaming("package/users/jane-x and data/users/jane", "/users/jane"), 0);
  EXPECT_EQ(LineNaming("/users/janet\n\n/users/jane", "/users/jane"), 3);
  EXPECT_EQ(LineNaming("", "/users/jane"), 0);
}

// Results of a packed motion against their repetition, as files.
struct Repeated {
  PackedScenario scenario{.file = std::string(kSourceDir) + "/scenarios/four_bar/turn_inverse.yaml",
                          .kind = "motion",
                          .results = "results/t",
                          .figures = "",
                          .verdict = "agree",
                          .description = "",
                          .reason = ""};
  PackedResults packed = {
      {"results/t/traces.csv",
       "time_s,motor.position.reference,motor.force.reference,motor.force.simulated\n"
       "0,0.1,2,2\n0.01,0.2,3,3\n0.02,0.3,4,4\n"},
      {"results/t/inputs.json", "{}"}};
  PackedResults rerun = packed;

  void Replace(PackedResults* side, const std::string& what, const std::string& by) const {
    std::string& text = side->at("results/t/traces.csv");
    ASSERT_NE(text.find(what), std::string::npos) << what;
    text.replace(text.find(what), what.size(), by);
  }
  [[nodiscard]] std::map<std::string, RerunFile> Judge() const {
    std::map<std::string, RerunFile> files;
    for (const RerunFile& file : JudgeReruns(scenario, packed, rerun, true)) {
      files.emplace(file.path, file);
    }
    return files;
  }
  [[nodiscard]] RerunFile Traces() const { return Judge().at("results/t/traces.csv"); }
};

TEST(JudgeReruns, TheSameFilesAreTheSame) {
  for (const auto& [path, file] : Repeated().Judge()) {
    EXPECT_EQ(file.outcome, RerunOutcome::kSame) << path << file.why;
  }
}

TEST(JudgeReruns, AFileThatOnlyOneSideHasDiffers) {
  for (const bool archive : {true, false}) {
    Repeated r;
    (archive ? r.packed : r.rerun)["results/t/more.csv"] = "surplus";
    const RerunFile more = r.Judge().at("results/t/more.csv");
    EXPECT_EQ(more.outcome, RerunOutcome::kDiffers);
    EXPECT_EQ(more.why, archive ? "is in the archive and is not made any more"
                                : "is made, but is not in the archive");
  }
}

TEST(JudgeReruns, AColumnOrARowThatOnlyOneSideHasDiffers) {
  for (const bool archive : {true, false}) {
    Repeated r;
    PackedResults* side = archive ? &r.packed : &r.rerun;
    r.Replace(side, "motor.force.simulated", "motor.force.simulated,motor.extra.simulated");
    for (const char* row : {",2,2\n", ",3,3\n", ",4,4\n"}) {
      r.Replace(side, row, std::string(row).substr(0, 4) + ",7\n");
    }
    EXPECT_EQ(r.Traces().outcome, RerunOutcome::kDiffers);
    EXPECT_EQ(r.Traces().why, "has other columns");
    Repeated rows;
    rows.Replace(archive ? &rows.packed : &rows.rerun, "0.02,0.3,4,4\n", "");
    EXPECT_EQ(rows.Traces().outcome, RerunOutcome::kDiffers);
    EXPECT_EQ(rows.Traces().why,
              archive ? "has 2 rows in the archive, 3 now" : "has 3 rows in the archive, 2 now");
  }
}

TEST(JudgeReruns, TheSignalThatChangedIsTheOneThatIsOutside) {
  Repeated r;
  r.Replace(&r.rerun, "0.01,0.2,3,3", "0.01,0.2,3,3.001");
  const RerunFile file = r.Traces();
  EXPECT_EQ(file.outcome, RerunOutcome::kDiffers);
  for (const RerunSignal& signal : file.signals) {
    EXPECT_EQ(signal.inside(), signal.signal != "motor.force.simulated") << signal.signal;
  }
  ASSERT_NE(WorstSignal(file.signals), nullptr);
  EXPECT_EQ(WorstSignal(file.signals)->signal, "motor.force.simulated");
  EXPECT_NEAR(WorstSignal(file.signals)->relative, 0.001 / 4.0, 1e-12);
  EXPECT_NEAR(WorstSignal(file.signals)->time_s, 0.01, 1e-12);
  Repeated times;
  times.Replace(&times.rerun, "0.02,0.3", "0.03,0.3");
  EXPECT_EQ(times.Traces().outcome, RerunOutcome::kDiffers);
  EXPECT_EQ(times.Traces().why, "has other times");
}

TEST(Package, DatesAreThoseOfTheCalendar) {
  for (const char* date : {"2026-11-23", "2024-02-29", "0001-01-01"}) {
    EXPECT_TRUE(IsDate(date)) << date;
  }
  for (const char* date : {"2026-02-29", "2026-13-01", "2026-1-1", "23.11.2026", "2026-11-2x",
                           "+026-11-23", "2026-11--1", "", "2026-11-23T"}) {
    EXPECT_FALSE(IsDate(date)) << date;
  }
}

// A study takes its scenario along, a scenario its model; each once.
TEST(GatherInputs, TakesAllThatIsReadOnce) {
  const std::string shipped = std::string(kSourceDir) + "/scenarios/four_bar/";
  Diagnostics diagnostics;
  const auto inputs = GatherInputs(
      {shipped + "study_by_hand.yaml", shipped + "static.yaml", shipped + "foreign.yaml"},
      &diagnostics);
  ASSERT_TRUE(inputs) << diagnostics.Text();
  std::vector<std::string> found;
  for (const PackedInput& input : inputs->files) found.push_back(input.role + " " + input.path);
  EXPECT_EQ(found,
            (std::vector<std::string>{"model inputs/models/four_bar/model.yaml",
                                      "scenario inputs/scenarios/four_bar/foreign.yaml",
                                      "input inputs/scenarios/four_bar/planar.py",
                                      "scenario inputs/scenarios/four_bar/static.yaml",
                                      "study inputs/scenarios/four_bar/study_by_hand.yaml"}));
  EXPECT_EQ(inputs->scenarios.size(), 3U);
  EXPECT_EQ(LicensesOf(*inputs), "");
}

TEST(GatherInputs, AllFindingsAreGivenAtOnce) {
  const test::TestFolder folder("gather");
  const std::string model = folder.Write("model.yaml", "name: x\n");
  Diagnostics diagnostics;
  EXPECT_FALSE(GatherInputs({model, folder.PathOf("nowhere.yaml")}, &diagnostics));
  EXPECT_NE(diagnostics.Text().find("is neither a scenario, a study nor"), std::string::npos);
  EXPECT_NE(diagnostics.Text().find("nowhere.yaml"), std::string::npos);
}

}  // namespace
}  // namespace mbv
