// A model without a scenario is run by a first motion: every shipped one.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/run_program.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

TEST(RunModel, EveryShippedModelAgrees) {
  const Program mbverify("run_model");
  size_t ran = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("/models"))) {
    const std::string file = entry.path().string() + "/model.yaml";
    if (!std::filesystem::exists(file)) continue;
    const ProgramResult run =
        mbverify("run " + file + " --out " + mbverify.Out() + " --quiet --no-pictures --no-report");
    EXPECT_EQ(run.exit_code, 0) << file << run.out << run.err;
    ++ran;
  }
  EXPECT_GE(ran, 20u);
}

// A file that is no model is not taken for one.
TEST(RunModel, OtherFilesAreRefused) {
  const Program mbverify("run_no_model");
  EXPECT_EQ(mbverify("run " + SourcePath("/models/stewart/README.md")).exit_code, 2);
  EXPECT_EQ(mbverify("run " + SourcePath("/CITATION.cff")).exit_code, 2);
}

}  // namespace
}  // namespace mbv
