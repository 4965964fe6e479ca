// mechanism.json as a user prints and checks it.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

TEST(MechanismFile, IsPrintedAndChecked) {
  const Program mbverify("mechanism");
  const std::string file = (mbverify.folder() / "mechanism.json").string();
  ASSERT_EQ(mbverify("model four_bar --format mechanism --out " + file).exit_code, 0);
  const ProgramResult good = mbverify("check " + file);
  EXPECT_EQ(good.exit_code, 0) << good.out << good.err;

  std::string text = ReadAll(file);
  const std::string body = "\"body\": \"rocker\"";
  const size_t at = text.find(body);
  ASSERT_NE(at, std::string::npos);
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<long>(at), '\n');
  text.replace(at, body.size(), "\"body\": \"rockr\"");
  std::ofstream(file) << text;
  const ProgramResult perturbed = mbverify("check " + file);
  EXPECT_EQ(perturbed.exit_code, 2);
  const std::string said = perturbed.out + perturbed.err;
  EXPECT_NE(said.find("there is no body 'rockr'"), std::string::npos) << said;
  EXPECT_NE(said.find("did you mean 'rocker'?"), std::string::npos) << said;
  EXPECT_NE(said.find("mechanism.json:" + std::to_string(line) + ":"), std::string::npos) << said;
}

}  // namespace
}  // namespace mbv
