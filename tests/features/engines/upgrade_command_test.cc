// mbverify crosscheck --newest as a user types it, with the newest MuJoCo for real.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

const std::string kUpgraded = SourcePath("/scenarios/four_bar/turn_inverse.yaml");

TEST(UpgradeCommand, ExplainsWhatTheNewestVersionChanges) {
  const Program mbverify("upgrade");
  const std::string file = (mbverify.folder() / "u.json").string();
  const ProgramResult result = mbverify("crosscheck --newest " + kUpgraded + " --json " + file);
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_EQ(result.out.find("not explained"), std::string::npos) << result.out;
  const auto json = nlohmann::json::parse(ReadAll(file));
  const auto& four_bar = json["results"].at(0);
  EXPECT_EQ(four_bar["messages"].size(), 0U);
  EXPECT_EQ(four_bar["versions"][0], "2.2.2");
  EXPECT_TRUE(four_bar["versions"][1].get<std::string>().starts_with("3."));
  // The velocity term is there now: at consistent states the forces are nearly right.
  const auto& rows = four_bar["rows"].at(0);
  EXPECT_EQ(rows["kind"], "weld");
  EXPECT_GT(rows["velocity_term"].get<double>(), 1.0);
  EXPECT_LT(rows["left_out"][1].get<double>(), 1e-9);
  const auto& at_states = four_bar["forces"].at(0)["force_nrmse"];
  EXPECT_GT(at_states[0].get<double>(), 0.1);
  EXPECT_LT(at_states[1].get<double>(), 1e-2);
  for (const size_t run : {1U, 2U}) {
    EXPECT_GT(four_bar["forces"].at(run)["force_nrmse"][1].get<double>(), 0.0);
    EXPECT_GT(four_bar["forces"].at(run)["loop_gap_m"][1].get<double>(), 0.0);
  }
}

TEST(UpgradeCommand, SaysThatTheOtherVersionIsNotThere) {
  const Program mbverify("upgrade_absent");
  const ProgramResult absent =
      mbverify.Script("MBV_MUJOCO_PACKAGE=/nowhere \"$mbverify\" upgrade " + kUpgraded);
  EXPECT_EQ(absent.exit_code, 3);
  EXPECT_NE(absent.out.find("is not installed in /nowhere"), std::string::npos) << absent.out;
  const ProgramResult dies = mbverify("crosscheck --newest " + kUpgraded + " --program false");
  EXPECT_EQ(dies.exit_code, 3);
  EXPECT_NE(dies.out.find("ended with exit code 1"), std::string::npos) << dies.out;
}

TEST(UpgradeCommand, RefusesFreeMotionsAndItsOwnInputs) {
  const Program mbverify("upgrade_bad");
  const ProgramResult free =
      mbverify("crosscheck --newest " + SourcePath("/scenarios/floating_loop/tumble.yaml"));
  EXPECT_EQ(free.exit_code, 3);
  EXPECT_NE(free.err.find("follows from forces"), std::string::npos) << free.err;
  EXPECT_EQ(mbverify("crosscheck --newest " + kUpgraded + " --json " + kUpgraded).exit_code, 2);
  EXPECT_EQ(mbverify("crosscheck --newest " + kUpgraded + " --set nonsense").exit_code, 2);
}

}  // namespace
}  // namespace mbv
