// Tables given as text, with what is said about them.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "model_file/yaml/value_reader.h"
#include "scenario/tables/table.h"
#include "tests/mechanisms/two_sliders.h"

namespace mbv {

// Numbers of these tests are written with few digits; conversion to double and one factor.
inline constexpr double kTiny = 4 * kEps;

struct Loaded {
  std::shared_ptr<const ReferenceTable> table;
  std::string text;  // all findings
};

// `yaml` is what stands below `reference:`.
inline Loaded LoadTable(const std::string& csv, const std::string& yaml = "{csv: t.csv}") {
  YamlReader reader("s.yaml");
  const YamlNodePtr root = reader.Parse(yaml);
  EXPECT_NE(root, nullptr) << yaml;
  if (root == nullptr) return {};
  Scope scope;
  ValueReader values(&reader, &scope);
  TableSettings settings = ReadTableSettings(&values, root.get());
  settings.file = "t.csv";
  Diagnostics findings;
  Loaded loaded;
  loaded.table = LoadTableText(csv, settings, test::DrivenSliders(), &reader, &findings);
  Diagnostics all = reader.diagnostics();
  all.Append(findings);
  loaded.text = all.Text();
  return loaded;
}

inline bool Has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace mbv
