// What an archive says of its date, and what it must not say of its maker.
#include "pipeline/package.h"

#include <gtest/gtest.h>

#include "pipeline/home_folder.h"
#include "pipeline/package_inputs.h"
#include "tests/source_dir.h"
#include "tests/test_folder.h"

namespace mbv {
namespace {

TEST(LineNaming, FindsAFolderButNoPartOfAnotherName) {
  EXPECT_EQ(LineNaming("a: 1\nb: /people/jane/x.csv\n", "/people/jane"), 2);
  EXPECT_EQ(LineNaming("\"/people/jane\"", "/people/jane"), 1);
  EXPECT_EQ(LineNaming("/people/janet/x", "/people/jane"), 0);
  EXPECT_EQ(LineNaming("package/people/jane-x and data/people/jane", "/people/jane"), 0);
  EXPECT_EQ(LineNaming("/people/janet\n\n/people/jane", "/people/jane"), 3);
  EXPECT_EQ(LineNaming("", "/people/jane"), 0);
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
  EXPECT_NE(diagnostics.Text().find("is neither a scenario nor a study"), std::string::npos);
  EXPECT_NE(diagnostics.Text().find("nowhere.yaml"), std::string::npos);
}

}  // namespace
}  // namespace mbv
