// The manual page, as man shows it.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

TEST(ManPage, ReportsEveryCommandThatHelpShowsAndItsOptions) {
  const Program mbverify("man_page");
  const ProgramResult page = mbverify("man-page");
  ASSERT_EQ(page.exit_code, 0) << page.err;
  for (const char* text : {".TH MBVERIFY 1", ".SS mbverify run\n", ".SS mbverify history list\n",
                           "\\fB\\-\\-formats\\fR \\fIVALUE\\fR\n", "\\fB\\-\\-no\\-pictures\\fR\n",
                           "Exit codes: 0 agree, 1 disagree"}) {
    EXPECT_NE(page.out.find(text), std::string::npos) << text;
  }
  EXPECT_EQ(page.out.find("man\\-page"), std::string::npos);
  EXPECT_EQ(mbverify("--help").out.find("man-page"), std::string::npos);
}

TEST(ManPage, HasNothingThatGroffComplainsAbout) {
  const Program mbverify("man_page_groff");
  const std::string file = mbverify.folder() / "mbverify.1";
  std::ofstream(file) << mbverify("man-page").out;
  const ProgramResult shown = mbverify.Script("groff -k -Tutf8 -man -ww " + file);
  EXPECT_EQ(shown.exit_code, 0);
  EXPECT_EQ(shown.err, "");
  EXPECT_NE(shown.out.find("mbverify figures --paper stabilizing_platform"), std::string::npos);
  // A text that begins like a request is none.
  EXPECT_NE(shown.out.find("mbverify init my_linkage"), std::string::npos);
}

}  // namespace
}  // namespace mbv
