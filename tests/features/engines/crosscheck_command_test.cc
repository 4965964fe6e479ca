// mbverify crosscheck as a user types it.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

const std::string kTurn = SourcePath("/scenarios/four_bar/turn_inverse.yaml");

TEST(CrosscheckCommand, PutsAnEngineBesideOurs) {
  const Program mbverify("crosscheck");
  const std::string folder = mbverify.folder().string();
  const ProgramResult result = mbverify("crosscheck " + kTurn + " --engine 'planar=python3 " +
                                        SourcePath("/scenarios/four_bar/planar.py") + "' --json " +
                                        folder + "/c.json --markdown " + folder + "/c.md --csv " +
                                        folder + "/c.csv --html " + folder + "/c.html");
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  const auto json = nlohmann::json::parse(ReadAll(folder + "/c.json"));
  bool found = false;
  for (const auto& row : json["rows"]) {
    if (row["program"] != "planar.py 1") continue;
    found = true;
    EXPECT_LT(row["force_nrmse"].get<double>(), 1e-12);
    EXPECT_GT(row["sample_us"].get<double>(), 0.0);
  }
  EXPECT_TRUE(found) << json;
  EXPECT_NE(ReadAll(folder + "/c.md").find("| `four_bar/turn_inverse` |"), std::string::npos);
  EXPECT_NE(ReadAll(folder + "/c.csv").find("four_bar,turn_inverse,planar,planar.py 1,"),
            std::string::npos);
  const std::string page = ReadAll(folder + "/c.html");
  EXPECT_NE(page.find("planar (planar.py 1)"), std::string::npos);
  EXPECT_EQ(page.find("class=\"verdict"), std::string::npos);
}

TEST(CrosscheckCommand, FindsFilesWhereItIsCalled) {
  const Program mbverify("crosscheck_from");
  const ProgramResult result = mbverify.From(
      SourcePath("/scenarios"),
      "crosscheck four_bar/turn_inverse.yaml --engine 'planar=python3 four_bar/planar.py'");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_NE(result.out.find("planar (planar.py 1)"), std::string::npos) << result.out;
}

TEST(CrosscheckCommand, RefusesWhatIsNotAnEngineAndItsOwnInputs) {
  const Program mbverify("crosscheck_bad");
  EXPECT_EQ(mbverify("crosscheck " + kTurn + " --engine planar").exit_code, 2);
  EXPECT_EQ(mbverify("crosscheck " + kTurn + " --engine 'reference=x'").exit_code, 2);
  EXPECT_EQ(mbverify("crosscheck " + kTurn + " --csv " + kTurn).exit_code, 2);
}

}  // namespace
}  // namespace mbv
