#include "model_file/yaml/yaml_reader.h"

#include <gtest/gtest.h>

#include <string>

namespace mbv {
namespace {

YamlNodePtr Parsed(const std::string& text) { return YamlReader("any.yaml").Parse(text); }

TEST(ParsedDocuments, ATextIsParsedOnceForTheWholeCommand) {
  const ParsedDocuments documents;
  const YamlNodePtr first = Parsed("a: 1");
  EXPECT_EQ(Parsed("a: 1"), first);
  EXPECT_NE(Parsed("a: 2"), first);
  {
    const ParsedDocuments part;  // of the same command
    EXPECT_EQ(Parsed("a: 1"), first);
  }
  EXPECT_EQ(Parsed("a: 1"), first);
}

TEST(ParsedDocuments, NothingIsKeptWithoutOne) {
  EXPECT_NE(Parsed("a: 1"), Parsed("a: 1"));
  { const ParsedDocuments documents; }
  EXPECT_NE(Parsed("a: 1"), Parsed("a: 1"));
}

TEST(ParsedDocuments, FindingsAreReportedByEachReader) {
  const ParsedDocuments documents;
  for (const char* file : {"one.yaml", "other.yaml"}) {
    YamlReader reader(file);
    EXPECT_NE(reader.Parse("a: 1\na: 2"), nullptr);
    ASSERT_EQ(reader.diagnostics().findings().size(), 1U) << file;
    EXPECT_EQ(reader.diagnostics().findings()[0].file, file);
  }
}

TEST(ParsedDocuments, OnlyTheLastOnesAreKept) {
  const ParsedDocuments documents;
  const YamlNodePtr first = Parsed("a: first");
  for (size_t k = 0; k < ParsedDocuments::kMostDocuments; ++k) {
    (void)Parsed("a: " + std::to_string(k));
  }
  EXPECT_NE(Parsed("a: first"), first);
}

}  // namespace
}  // namespace mbv
