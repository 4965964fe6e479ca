// Texts that must stay as they were read and found right: files in golden/.
// To renew them after an intended change: MBV_UPDATE_GOLDEN=1 test_report, then read the diff.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "tests/support/source_dir.h"

namespace mbv {

inline std::string Golden(const std::string& name, const std::string& actual) {
  const std::string path = std::string(kSourceDir) + "/tests/golden/report/" + name;
  if (std::getenv("MBV_UPDATE_GOLDEN") != nullptr) std::ofstream(path) << actual;
  std::ifstream stream(path);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

inline void ExpectGolden(const std::string& name, const std::string& actual) {
  EXPECT_EQ(actual, Golden(name, actual)) << name;
}

/// Numbers to ten digits: an eigenvalue's last digits are not reproducible.
inline nlohmann::ordered_json Rounded(nlohmann::ordered_json json) {
  if (json.is_structured()) {
    for (auto& item : json) item = Rounded(item);
  } else if (json.is_number_float()) {
    std::ostringstream text;
    text.precision(10);
    text << json.get<double>();
    json = std::abs(json.get<double>()) < 1e-14 ? 0.0 : std::stod(text.str());
  }
  return json;
}

/// A page without its style and scripts, which come from web/.
inline std::string WithoutAssets(std::string page) {
  for (const std::string tag : {"style", "script"}) {
    size_t at = 0;
    while ((at = page.find("<" + tag, at)) != std::string::npos) {
      const size_t from = page.find('>', at) + 1;
      page.erase(from, page.find("</" + tag + ">", from) - from);
      at = from;
    }
  }
  const size_t policy = page.find("script-src 'sha256-");
  if (policy != std::string::npos) page.erase(policy, page.find('"', policy) - policy);
  return page;
}

}  // namespace mbv
