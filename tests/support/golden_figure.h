// Texts that must stay as they were read and found right: files in tests/golden/figure.
// To renew them after an intended change: MBV_UPDATE_GOLDEN=1 test_figure, then read the diff.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/support/source_dir.h"

namespace mbv::test {

inline void ExpectFigureGolden(const std::string& name, const std::string& actual) {
  const std::string path = std::string(kSourceDir) + "/tests/golden/figure/" + name;
  if (std::getenv("MBV_UPDATE_GOLDEN") != nullptr) std::ofstream(path) << actual;
  std::ifstream stream(path);
  std::stringstream text;
  text << stream.rdbuf();
  EXPECT_EQ(actual, text.str()) << name;
}

}  // namespace mbv::test
