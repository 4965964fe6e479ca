// mbverify converge as users call it.
#include <gtest/gtest.h>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFast =
    "converge scenarios/slider_crank/press.yaml --steps 0.004,0.002,0.001";

TEST(ConvergeCommand, PrintsTheTableAndWritesTheFiles) {
  const Program program("converge_files");
  const std::string call = std::string(kFast) + " --out '" + program.Out() + "'";
  const ProgramResult result = program(call);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("slider_crank / press: ORDERS AS EXPECTED"), std::string::npos);
  EXPECT_NE(result.out.find("grid convergence index"), std::string::npos);
  const fs::path folder = fs::path(program.Out()) / "slider_crank" / "convergence" / "press";
  for (const char* name : {"converge.json", "converge.csv", "inputs.json", "error_step.svg",
                           "error_time_constant.svg", "error_cpu.svg"}) {
    EXPECT_GT(fs::file_size(folder / name), 100u) << name;
  }
  // A second call replaces the first one's result.
  EXPECT_EQ(program(call).exit_code, 0);
  // Something else is not replaced.
  fs::remove(folder / ".mbverify-files");
  fs::remove(folder / "inputs.json");  // a document of ours marks the folder, too
  std::ofstream(folder / "converge.json") << "mine";
  const ProgramResult refused = program(call);
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.err.find("which mbverify did not write"), std::string::npos) << refused.err;
  EXPECT_EQ(ReadAll(folder / "converge.json"), "mine");
}

TEST(ConvergeCommand, RefusesBadInputWithExitCode2AndWritesNothing) {
  const Program program("converge_bad");
  const std::string out = " --out '" + program.Out() + "'";
  const std::string scenario = "converge scenarios/slider_crank/press.yaml";
  for (const auto& [call, message] : std::vector<std::pair<std::string, std::string>>{
           {scenario + " --steps 0.004,0,-0.001", "-0.001 s violates 0 < step <= 1 s"},
           {scenario + " --steps 0.001,0.002,0.004", "0.002 s after 0.001 s violates"},
           {scenario + " --steps 0.004,0.003,0.002", "whole fraction"},
           {scenario + " --steps 0.004,0.002", "at least 3 steps"},
           {scenario + " --steps fast", "--steps"},
           {scenario + " --set nonsense", "write key=value"},
           {"converge scenarios/no_such.yaml", "no_such.yaml"},
           {"converge scenarios/stabilizing_platform/must_fail/no_yaml.yaml", "no_yaml.yaml:"},
       }) {
    const ProgramResult result = program(call + out);
    EXPECT_EQ(result.exit_code, 2) << call;
    EXPECT_NE(result.err.find(message), std::string::npos) << call << "\n" << result.err;
    EXPECT_EQ(result.out, "") << call;
  }
  EXPECT_FALSE(fs::exists(program.Out()));
}

TEST(ConvergeCommand, AMotionOutOfReachCouldNotRun) {
  const Program program("converge_reach");
  const ProgramResult result = program(
      "converge scenarios/four_bar/must_fail/out_of_reach.yaml --out '" + program.Out() + "'");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.err.find("could not run"), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(program.Out()));
}

}  // namespace
}  // namespace mbv
