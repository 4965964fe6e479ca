#include "verify/version.h"
#include "tests/support/source_dir.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace mbv {
namespace {

TEST(Version, IsTheOneOfTheBuildFile) {
  std::ifstream stream(std::string(kSourceDir) + "/CMakeLists.txt");
  std::stringstream text;
  text << stream.rdbuf();
  EXPECT_NE(text.str().find(std::string("project(mbverify VERSION ") + kVersion),
            std::string::npos);
}

}  // namespace
}  // namespace mbv
