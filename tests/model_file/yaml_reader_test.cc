#include "model_file/yaml/yaml_reader.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>
#include <random>
#include <thread>

#include "base/inputs.h"
#include "tests/support/test_folder.h"

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

// A file that is not a map at all is of another kind, and may hold a secret.
TEST(YamlReader, WhatIsNotAMapIsNotQuoted) {
  YamlReader reader("token");
  const YamlNodePtr root = reader.Parse("hunter2\n");
  ASSERT_TRUE(root);
  EXPECT_FALSE(YamlMap(&reader, root.get(), "", {"name"}).valid());
  EXPECT_EQ(reader.diagnostics().Text(), "token:1:1: error: the file is a text, a map is needed\n");
}

// Neither is a map that has no key in common with what is read, like shadow files and tokens.
TEST(YamlReader, AMapOfAnotherKindIsNotQuoted) {
  for (const char* text : {"root:$6$SECRET$SECRET:19000:0:99999:7:::\n", "SECRET: AKIASECRET\n",
                           "{\"SECRET\": \"SECRET\", \"other\": {\"SECRET\": 1}}\n"}) {
    YamlReader reader("token");
    const YamlNodePtr root = reader.Parse(text);
    if (root) {
      const YamlMap map(&reader, root.get(), "", {"name", "bodies"});
      EXPECT_EQ(reader.diagnostics().findings().size(), 1U) << text;
      EXPECT_NE(reader.diagnostics().Text().find("the file is of another kind"), std::string::npos);
    }
    EXPECT_TRUE(reader.diagnostics().has_errors()) << text;
    EXPECT_EQ(reader.diagnostics().Text().find("SECRET"), std::string::npos)
        << reader.diagnostics().Text();
  }
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

// What is said about a map that may have these keys and lacks the required one.
std::string ReportedOfMap(const std::string& text, const std::string& path,
                          const std::vector<std::string>& keys, const char* required = nullptr) {
  YamlReader reader("a.yaml");
  const YamlNodePtr root = reader.Parse(text);
  const YamlMap map(&reader, root.get(), path, keys);
  if (required != nullptr) {
    EXPECT_EQ(map.Required(required), nullptr);
  }
  return reader.diagnostics().Text();
}

TEST(YamlReader, UnknownKeysAreFindingsWithTheNearestKnownOne) {
  EXPECT_EQ(ReportedOfMap("motoin: 1\nzzz: 2\n", "", {"name", "motion"}, "name"),
            "a.yaml:1:1: error: the file: unknown key 'motoin'\n"
            "  hint: did you mean 'motion'?\n"
            "a.yaml:2:1: error: the file: unknown key 'zzz'\n"
            "  hint: known keys: name, motion\n"
            "a.yaml:1:1: error: the file: 'name' is missing\n");
}

TEST(YamlReader, ATextWithACommaInBracesIsExplained) {
  EXPECT_EQ(ReportedOfMap("{value: 1, note: a plate, 12 mm thick}", "p", {"value", "note"}),
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
  EXPECT_NE(OnlyFinding("a: *absent\n").find("anchor"), std::string::npos);
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

TEST(YamlReader, PlainNumbersAreDecimal) {
  for (const auto& [text, value] :
       {std::pair{"1", 1.0}, {"+1.5", 1.5}, {"-.5", -0.5}, {"2.", 2.0}, {"1E3", 1000.0}}) {
    EXPECT_EQ(PlainNumber(text), value) << text;
  }
  for (const char* text : {"", "+", "1 ", " 1", "0x10", "1_000", "1,5", "1e", "one", "--1"}) {
    EXPECT_FALSE(PlainNumber(text)) << text;
  }
  EXPECT_EQ(PlainNumber("-.INF"), -HUGE_VAL);
  EXPECT_TRUE(std::isnan(*PlainNumber(".NaN")));
  EXPECT_EQ(PlainNumber("1e999"), HUGE_VAL);
}

TEST(YamlReader, WholeNumbersAreSmallOnes) {
  YamlReader reader("a.yaml");
  const YamlNodePtr root = reader.Parse("[3.0, -2, 1e9, 1e-9]\n");
  ASSERT_TRUE(root);
  EXPECT_EQ(reader.Integer(*root->items[0], "a"), 3);
  EXPECT_EQ(reader.Integer(*root->items[1], "b"), -2);
  EXPECT_FALSE(reader.Integer(*root->items[2], "c"));
  EXPECT_FALSE(reader.Integer(*root->items[3], "d"));
  EXPECT_EQ(reader.diagnostics().Text(),
            "a.yaml:1:11: error: c = 1e9 is not a whole number\n"
            "a.yaml:1:16: error: d = 1e-9 is not a whole number\n");
}

TEST(YamlReader, LongValuesAreCutBetweenCharacters) {
  std::string key;
  for (int i = 0; i < 50; ++i) key += "ä";
  std::string shown = "x";
  for (int i = 0; i < 28; ++i) shown += "ä";
  EXPECT_EQ(ReportedOfMap("x" + key + "\n", "bodies", {"name"}),
            "a.yaml:1:1: error: bodies is '" + shown + "...', a map is needed\n");
  // Keys are shown up to 200 bytes.
  EXPECT_EQ(ReportedOfMap("x" + key + ": 1\n", "bodies", {"name"}),
            "a.yaml:1:1: error: bodies: unknown key 'x" + key + "'\n  hint: known keys: name\n");
  const std::string longest(300, 'k');
  EXPECT_EQ(ReportedOfMap(longest + ": 1\n", "bodies", {"name"}),
            "a.yaml:1:1: error: bodies: unknown key '" + longest.substr(0, 200) +
                "… (300 bytes)'\n  hint: known keys: name\n");
  EXPECT_EQ(ReportedOfMap("\"two\\nlines\"\n", "bodies", {"name"}),
            "a.yaml:1:1: error: bodies is 'two...', a map is needed\n");
  EXPECT_EQ(ReportedOfMap("Fuß\n", "bodies", {"name"}),
            "a.yaml:1:1: error: bodies is 'Fuß', a map is needed\n");
}

TEST(YamlReader, AKeyAtTheWrongLevelIsReportedWhereItBelongs) {
  // Too far out, too far in, and an entry that its section lost.
  EXPECT_EQ(ReportedOfMap("1", "bodies.mass", {"mass", "com"}),
            "a.yaml:1:1: error: bodies.mass is '1', a map is needed\n"
            "  hint: 'mass' belongs into an entry of bodies: indent it deeper\n");
  EXPECT_EQ(ReportedOfMap("mass: 1\nrod: {mass: 2}\n", "bodies.bar", {"mass", "com"}),
            "a.yaml:2:1: error: bodies.bar: unknown key 'rod'\n"
            "  hint: it looks like another entry of the level above: indent it less\n");
  EXPECT_EQ(ReportedOfMap("joints:\npivot: {kind: fixed}\n", "", {"name", "joints"}),
            "a.yaml:2:1: error: the file: unknown key 'pivot'\n"
            "  hint: if it belongs into 'joints', indent it deeper\n");
}

TEST(YamlReader, TheSameMessageIsGivenOnceWhateverItsNote) {
  YamlReader reader("a.yaml");
  const YamlNodePtr root = reader.Parse("a: 1\n");
  ASSERT_TRUE(root);
  for (const char* note : {" (in limb1)", " (in limb2)", ""}) {
    reader.SetNote(note);
    reader.Warn(*root, "slack");
  }
  EXPECT_EQ(reader.diagnostics().Text(), "a.yaml:1:1: warning: slack (in limb1)\n");
  EXPECT_FALSE(reader.has_errors());
}

TEST(YamlReader, OddTextsAreReportedApart) {
  const auto said = [](const std::string& text) {
    YamlReader reader("a.yaml");
    (void)reader.Parse(text);
    return reader.diagnostics().Text();
  };
  EXPECT_EQ(said("a: \"\\e[31m\"\n"),
            "a.yaml:1:4: error: the value holds the control character 0x1b\n");
  EXPECT_EQ(said("a: 1\n---\nb: 2\n"), "a.yaml: warning: only the first YAML document is read\n");
  EXPECT_EQ(said("# nothing but this\n"), "a.yaml:1:1: error: the file is empty\n");
  EXPECT_EQ(said("\"\": 1\n"), "a.yaml:1:1: error: a key is \'\', a word is needed\n");
  EXPECT_EQ(said("a: Fuß\nb: 'ß'\n"), "");
  EXPECT_EQ(said("a: [1, 2\nb: 3\n"),
            "a.yaml:1:4: error: YAML syntax: the bracket [ is never closed\n");
  EXPECT_EQ(said(std::string(YamlReader::kMaxBytes + 1, '#')),
            "a.yaml: error: the file is larger than 16000000 bytes\n");
}

// It would take the rest of the file as its text.
TEST(YamlReader, AQuoteThatIsNeverClosedIsFoundAtItsPlace) {
  for (const char quote : {'\'', '"'}) {
    const std::string said =
        fmt::format("a.yaml:2:4: error: YAML syntax: the quote {} is never closed\n", quote);
    for (const char* rest : {"it is open\nc: 1\n", "\n", "", "it", "x\n\n", "c: [1]\n# d\n"}) {
      EXPECT_EQ(OnlyFinding(fmt::format("a: 1\nb: {}{}", quote, rest)), said) << rest;
    }
  }
  EXPECT_EQ(OnlyFinding("a: 'it''s\nb: 1\n"),
            "a.yaml:1:4: error: YAML syntax: the quote ' is never closed\n");
  EXPECT_EQ(OnlyFinding("a: \"x\\\"\nb: 1\n"),
            "a.yaml:1:4: error: YAML syntax: the quote \" is never closed\n");
  for (const char* good :
       {"a: 'it''s'\n", "a: \"x\\\"y\"\n", "a: ''\n", "a: ''''", "'a': 1\n", "a: x'\n",
        "a: \"two\n  lines\"\nb: it's\n", "\xef\xbb\xbf'a': 'b'\n", "a: 'b'  # it's\n"}) {
    YamlReader reader("a.yaml");
    EXPECT_TRUE(reader.Parse(good)) << good;
    EXPECT_EQ(reader.diagnostics().Text(), "") << good;
  }
}

TEST(YamlReader, FilesAreNotedWithWhatWasRead) {
  const test::TestFolder folder("yaml_reader");
  const std::string file = folder.Write("a.yaml", "a: 1\n");
  const InputWatch watch;
  EXPECT_EQ(YamlReader(file).ReadFile(), "a: 1\n");
  ASSERT_EQ(watch.files().size(), 1u);
  EXPECT_EQ(watch.files()[0].file, file);
  EXPECT_EQ(watch.files()[0].fingerprint, ContentFingerprint("a: 1\n"));
  // A name that a terminal would obey is not opened.
  YamlReader hostile(folder.Write("b\x1b[2J.yaml", "a: 1\n"));
  EXPECT_FALSE(hostile.ReadFile());
  EXPECT_NE(hostile.diagnostics().Text().find("the name of the file holds control characters"),
            std::string::npos)
      << hostile.diagnostics().Text();
  EXPECT_EQ(watch.files().size(), 1u);
}

// A pipe gives its text once; a scenario is read for its kind, its values and its witnesses.
TEST(YamlReader, APipeIsReadAsOftenAsItIsAskedFor) {
  const test::TestFolder folder("yaml_pipe");
  const std::string pipe = folder.PathOf("pipe.yaml");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::thread writer([&] { std::ofstream(pipe) << "a: 1\n"; });
  const auto first = YamlReader(pipe).ReadFile();
  writer.join();
  EXPECT_EQ(first, "a: 1\n");
  EXPECT_EQ(YamlReader(pipe).ReadFile(), "a: 1\n") << "the writer has closed it";
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
