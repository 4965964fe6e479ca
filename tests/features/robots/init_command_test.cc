// mbverify init as a user types it.
#include <gtest/gtest.h>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

TEST(InitCommand, NamesWhatItWroteAndTheNextCommandWhichAgrees) {
  const Program mbverify("init");
  const std::string into = mbverify.folder().string();
  const ProgramResult init = mbverify("init my_linkage --into " + into);
  EXPECT_EQ(init.exit_code, 0) << init.err;
  EXPECT_EQ(init.out, "wrote " + into + "/models/my_linkage/model.yaml\nwrote " + into +
                          "/scenarios/my_linkage/first.yaml\nnext: mbverify run " + into +
                          "/scenarios/my_linkage/first.yaml\n");
  const std::string next = init.out.substr(init.out.find("mbverify run ") + 9);
  const ProgramResult run =
      mbverify(next.substr(0, next.size() - 1) + " --no-pictures --quiet --out " + mbverify.Out());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("my_linkage / first: AGREE"), std::string::npos) << run.out;
  const ProgramResult again = mbverify("init my_linkage --into " + into);
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_EQ(again.out, "");
}

TEST(InitCommand, ABadNameIsBadInput) {
  const Program mbverify("init_bad");
  const ProgramResult result = mbverify("init '../x' --into " + mbverify.folder().string());
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("for example x"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace mbv
