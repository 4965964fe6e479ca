// A change of a model's text and what must be said about it.
#pragma once

#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "model_file/load_model.h"
#include "tests/mechanisms/four_bar.h"

namespace mbv {

struct Slip {
  const char* name;
  const char* from;
  const char* to;
  const char* said;
};
inline std::ostream& operator<<(std::ostream& out, const Slip& slip) { return out << slip.name; }

/// What must be said is said of the good model with the slip, which loads if that is a warning.
inline void ExpectReported(const std::string& good, const Slip& slip) {
  const LoadResult result = LoadModelText(Replaced(good, slip.from, slip.to), "m.yaml");
  const std::string text = result.diagnostics.Text();
  EXPECT_NE(text.find(slip.said), std::string::npos) << text;
  const bool warning = std::string(slip.said).find("warning: ") != std::string::npos;
  EXPECT_EQ(result.mechanism.has_value(), warning) << text;
  EXPECT_EQ(result.diagnostics.has_errors(), !warning) << text;
}

}  // namespace mbv
