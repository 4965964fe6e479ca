#include "input/yaml_reader.h"

#include <gtest/gtest.h>

#include <random>

namespace mbv {
namespace {

TEST(YamlReader, ValuesKnowTheirPlace) {
  YamlReader reader("a.yaml");
  const YamlNodePtr root = reader.Parse("name: x\nlist:\n  - 1\n  - {deep: 2}\n");
  ASSERT_TRUE(root);
  EXPECT_TRUE(reader.diagnostics().empty()) << reader.diagnostics().Text();
  const YamlNode& deep = *root->Find("list")->items[1]->Find("deep");
  EXPECT_EQ(deep.text, "2");
  EXPECT_EQ(deep.line, 4);
  EXPECT_EQ(deep.column, 12);
}

TEST(YamlReader, ReadersReportTheWrongTypeAndGoOn) {
  YamlReader reader("a.yaml");
  const YamlNodePtr root = reader.Parse(
      "number: two\nflag: yes\nwhole: 1.5\nlist: 3\nword: [1]\nkind: revolut\nbig: .inf\n");
  ASSERT_TRUE(root);
  EXPECT_FALSE(reader.Number(*root->Find("number"), "number"));
  EXPECT_FALSE(reader.Flag(*root->Find("flag"), "flag"));
  EXPECT_FALSE(reader.Integer(*root->Find("whole"), "whole"));
  EXPECT_FALSE(reader.Items(*root->Find("list"), "list", 2));
  EXPECT_FALSE(reader.Text(*root->Find("word"), "word"));
  EXPECT_FALSE(reader.Choice(*root->Find("kind"), "kind", {"revolute", "fixed"}));
  EXPECT_FALSE(reader.Number(*root->Find("big"), "big"));
  EXPECT_EQ(reader.diagnostics().Text(),
            "a.yaml:1:9: error: number is 'two', a number is needed\n"
            "a.yaml:2:7: error: flag = 'yes' is neither true nor false\n"
            "a.yaml:3:8: error: whole = 1.5 is not a whole number\n"
            "a.yaml:4:7: error: list is '3', a list of 2 is needed\n"
            "a.yaml:5:7: error: word is a list of 1, a word is needed\n"
            "a.yaml:6:7: error: kind = 'revolut' is not one of: revolute, fixed\n"
            "  hint: did you mean 'revolute'?\n"
            "a.yaml:7:6: error: big = '.inf' is not a finite number\n");
}

TEST(YamlReader, UnknownKeysAreFindingsWithTheNearestKnownOne) {
  YamlReader reader("a.yaml");
  const YamlNodePtr root = reader.Parse("motoin: 1\nzzz: 2\n");
  const YamlMap map(&reader, root.get(), "", {"name", "motion"});
  EXPECT_EQ(map.Required("name"), nullptr);
  EXPECT_EQ(reader.diagnostics().Text(),
            "a.yaml:1:1: error: the file: unknown key 'motoin'\n"
            "  hint: did you mean 'motion'?\n"
            "a.yaml:2:1: error: the file: unknown key 'zzz'\n"
            "  hint: known keys: name, motion\n"
            "a.yaml:1:1: error: the file: 'name' is missing\n");
}

TEST(YamlReader, ATextWithACommaInBracesIsExplained) {
  YamlReader reader("a.yaml");
  const YamlNodePtr root = reader.Parse("{value: 1, note: a plate, 12 mm thick}");
  const YamlMap map(&reader, root.get(), "p", {"value", "note"});
  EXPECT_EQ(reader.diagnostics().Text(),
            "a.yaml:1:27: error: p: unknown key '12 mm thick'\n"
            "  hint: inside { } a text with a comma needs quotes\n");
}

TEST(YamlReader, OneValueInTwoUnitsIsAFinding) {
  YamlReader reader("a.yaml");
  const YamlNodePtr root = reader.Parse("angle: 1\nangle_deg: 2\n");
  const YamlMap map(&reader, root.get(), "", {"angle", "angle_deg"});
  (void)map.FindInUnit("angle", {kPlain, kDeg});
  EXPECT_EQ(reader.diagnostics().Text(),
            "a.yaml:2:12: error: angle and angle_deg are both given\n  hint: keep one of them\n");
}

TEST(YamlReader, DuplicateMergeAndOddKeysAndTagsAreFindings) {
  YamlReader reader("a.yaml");
  const YamlNodePtr root =
      reader.Parse("a: &base {x: 1}\na: 2\nb:\n  <<: *base\n? [1, 2]\n: 3\nc: !!float 1\n");
  ASSERT_TRUE(root);
  EXPECT_EQ(reader.diagnostics().Text(),
            "a.yaml:2:1: error: the key 'a' is already given in line 1\n"
            "a.yaml:4:3: error: merge keys (<<) are not part of this format\n"
            "  hint: write equal groups once under 'parts' and place them by 'instances'\n"
            "a.yaml:5:3: error: a key is a list of 2, a word is needed\n"
            "a.yaml:7:4: error: the tag tag:yaml.org,2002:float is not part of this format\n"
            "  hint: leave the tag out\n");
}

// What is dropped leaves its memory to what follows; that must not be taken for one another.
TEST(YamlReader, KeysOfDroppedValuesAreForgotten) {
  const std::string block = "{k0: {x: {kind: a, y: 1}}, k1: {x: {kind: b, y: 2}}}\n";
  for (const std::string& dropped :
       {"<<: " + block, "a: 0\na: " + block, "? [1]\n: " + block, "? " + block + ": 1\n",
        "\"\": " + block, "a: " + block + "a: " + block}) {
    for (int copies = 1; copies <= 8; ++copies) {
      std::string text;
      for (int i = 0; i < copies; ++i) text += dropped;
      text += "b: " + block;
      YamlReader reader("a.yaml");
      const YamlNodePtr root = reader.Parse(text);
      ASSERT_TRUE(root) << text;
      EXPECT_TRUE(reader.has_errors()) << text;
      for (const char* key : {"k0", "k1"}) {
        const YamlNode* kept = root->Find("b")->Find(key);
        ASSERT_NE(kept, nullptr) << text;
        ASSERT_NE(kept->Find("x"), nullptr) << text;
        EXPECT_EQ(kept->Find("x")->entries.size(), 2u) << text;
      }
    }
  }
}

TEST(YamlReader, AliasesAreReplaced) {
  YamlReader reader("a.yaml");
  const YamlNodePtr root = reader.Parse("a: &v [1, 2]\nb: *v\n");
  ASSERT_TRUE(root);
  EXPECT_EQ(root->Find("b")->items[1]->text, "2");
  EXPECT_TRUE(reader.diagnostics().empty());
}

// Text that no reader should follow to its end.
std::string Laughs() {
  std::string text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 30; ++i) {
    const std::string b = "*a" + std::to_string(i - 1);
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 10; ++k) text += (k == 0 ? "" : ", ") + b;
    text += "]\n";
  }
  return text;
}

std::string OnlyFinding(const std::string& text) {
  YamlReader reader("a.yaml");
  EXPECT_EQ(reader.Parse(text), nullptr);
  return reader.diagnostics().Text();
}

TEST(YamlReader, HostileTextIsRefusedWithAPlace) {
  EXPECT_EQ(OnlyFinding(Laughs()),
            "a.yaml: error: the file has too many values (aliases expanded)\n");
  EXPECT_EQ(OnlyFinding("a: &a [1, *a]\n"),
            "a.yaml:1:11: error: an alias refers to the value it stands in\n");
  EXPECT_EQ(OnlyFinding(std::string(100, '[') + std::string(100, ']')),
            "a.yaml:1:65: error: nested deeper than 64 levels\n");
  EXPECT_NE(OnlyFinding(std::string(100'000, '[')), "");
  EXPECT_NE(OnlyFinding(std::string(100'000, '{')), "");
  EXPECT_EQ(
      OnlyFinding(std::string("a: 1\nb: \0\n", 10)),
      "a.yaml:2:4: error: byte 0x00 is not UTF-8 text\n  hint: save the file as UTF-8 text\n");
  EXPECT_EQ(
      OnlyFinding("a: \xff\n"),
      "a.yaml:1:4: error: byte 0xff is not UTF-8 text\n  hint: save the file as UTF-8 text\n");
  EXPECT_EQ(OnlyFinding(""), "a.yaml:1:1: error: the file is empty\n");
  EXPECT_NE(OnlyFinding("a: [1, 2\nb: 3\n").find("a.yaml:"), std::string::npos);
  EXPECT_NE(OnlyFinding("a: *nobody\n").find("anchor"), std::string::npos);
}

TEST(YamlReader, EveryFindingIsGivenOnceAndTheirNumberIsBounded) {
  YamlReader reader("a.yaml");
  const YamlNodePtr root = reader.Parse("a: 1\n");
  for (int i = 0; i < 3; ++i) reader.Error(*root, "same");
  EXPECT_EQ(reader.diagnostics().findings().size(), 1u);
  for (int i = 0; i < 10 * YamlReader::kMaxFindings; ++i) reader.Error(*root, std::to_string(i));
  EXPECT_EQ(reader.diagnostics().findings().size(), YamlReader::kMaxFindings + 1u);
  EXPECT_EQ(reader.diagnostics().findings().back().message, "more findings are left out");
}

TEST(YamlReader, RandomBytesNeverThrow) {
  std::mt19937_64 random(4711);
  const std::string alphabet = "ab:{}[],-&*!|>'\"#%@`? \n\t0123.";
  for (int i = 0; i < 2000; ++i) {
    std::string text;
    for (int k = 0; k < 60; ++k) text += alphabet[random() % alphabet.size()];
    YamlReader reader("a.yaml");
    EXPECT_TRUE(reader.Parse(text) != nullptr || reader.has_errors()) << text;
  }
}

TEST(YamlReader, AMissingFileAndAFolderAreFindings) {
  for (const std::string file : {"/nowhere/model.yaml", "/tmp"}) {
    YamlReader reader(file);
    EXPECT_FALSE(reader.ReadFile());
    EXPECT_EQ(reader.diagnostics().Text(),
              file +
                  ": error: the file cannot be read\n"
                  "  hint: check the name; paths are relative to the current folder\n");
  }
}

}  // namespace
}  // namespace mbv
