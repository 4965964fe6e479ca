#include "base/diagnostics.h"

#include <gtest/gtest.h>

#include "base/json_document.h"
#include "base/json_text.h"
#include "math/bytes.h"

namespace mbv {
namespace {

TEST(Diagnostics, AFindingIsPrintedWithPlaceAndHint) {
  const Finding finding{Severity::kError,
                        "a.yaml",
                        3,
                        7,
                        "mass = -1 violates mass >= 0",
                        "leave the key out for a massless body"};
  EXPECT_EQ(ToText(finding),
            "a.yaml:3:7: error: mass = -1 violates mass >= 0\n"
            "  hint: leave the key out for a massless body");
}

// What callers decide by crosses the boundary of processes.
TEST(Diagnostics, AFindingGoesThroughBytesUnchanged) {
  const Finding finding{.severity = Severity::kWarning,
                        .file = "--set a.b=1",
                        .line = 3,
                        .column = 7,
                        .message = "unknown",
                        .hint = "none",
                        .code = FindingCode::kUnknownKey,
                        .subject = "a.b",
                        .set = {"a.b", "1"}};
  const auto back = FromBytes<Finding>(ToBytes(finding));
  ASSERT_TRUE(back);
  EXPECT_EQ(ToText(*back), ToText(finding));
  EXPECT_EQ(back->code, FindingCode::kUnknownKey);
  EXPECT_EQ(back->subject, "a.b");
  EXPECT_EQ(back->set, finding.set);
}

TEST(Diagnostics, WarningsAreNotErrors) {
  Diagnostics list;
  list.Add({.severity = Severity::kWarning, .file = "a", .message = "odd", .hint = ""});
  EXPECT_FALSE(list.has_errors());
  list.Add({.severity = Severity::kError, .file = "a", .message = "bad", .hint = ""});
  EXPECT_TRUE(list.has_errors());
}

TEST(Diagnostics, ClosestWordFindsTheTypingSlipAndNothingElse) {
  EXPECT_EQ(ClosestWord("massa", {"mass", "com", "inertia"}), "mass");
  EXPECT_EQ(ClosestWord("velocity", {"mass", "com"}), "");
}

struct JsonPart {
  std::string name;
  size_t count = 0;
  std::vector<double> numbers;
};

JsonRead<JsonPart> ReadPart(const std::string& text) {
  const auto read = [](const JsonValue& root) {
    const JsonValue part = root.at("parts").at(0);
    return JsonPart{part.at("name"), part.value("count", size_t{7}), part.at("numbers")};
  };
  return ReadJson(text, read, "mbv.part/1");
}

const std::string kPart =
    R"({"schema": "mbv.part/1", "parts": [{"name": "a", "count": 3, "numbers": [1, 2.5]}]})";

TEST(JsonDocument, IsReadAndWhatIsNotAsNeededIsRefusedWithItsKey) {
  const auto good = ReadPart(kPart);
  ASSERT_TRUE(good) << good.refusal.Text();
  EXPECT_EQ(good.value->name, "a");
  EXPECT_EQ(good.value->count, 3U);
  EXPECT_EQ(good.value->numbers, (std::vector<double>{1.0, 2.5}));
  const auto with = [](const std::string& what, const std::string& by) {
    std::string text = kPart;
    text.replace(text.find(what), what.size(), by);
    const auto read = ReadPart(text);
    EXPECT_FALSE(read) << text;
    return read.refusal.Text();
  };
  EXPECT_EQ(with("\"mbv.part/1\"", "[]"), "schema is a list where a text is needed");
  EXPECT_EQ(with("part/1", "part/2"), "schema is 'mbv.part/2', needed is mbv.part/1");
  EXPECT_EQ(with("schema", "scheme"), "schema is missing");
  EXPECT_EQ(with("\"a\"", "1"), "parts[0].name is a number where a text is needed");
  EXPECT_EQ(with("3", "-3"), "parts[0].count is -3, needed is 0 … 18446744073709551615");
  EXPECT_EQ(with("3", "3.5"), "parts[0].count is a number where a whole number is needed");
  EXPECT_EQ(with("2.5", "null"), "parts[0].numbers[1] is null where a number is needed");
  EXPECT_EQ(with("[{", "{}, \"x\": [{"), "parts is an object where a list is needed");
  EXPECT_EQ(with("[1, 2.5]", "{}"), "parts[0].numbers is an object where a list is needed");
  EXPECT_EQ(with("2.5", "1e999"), "a number of it is too large");
  EXPECT_EQ(with("\"a\"", "\"a\n\""),
            "line 1, character 47: this is not JSON: what stands here cannot continue it");
}

TEST(JsonDocument, EveryTruncationAndEveryDepthIsRefused) {
  for (size_t length = 0; length < kPart.size(); ++length) {
    const auto read = ReadPart(kPart.substr(0, length));
    ASSERT_FALSE(read) << length;
    EXPECT_EQ(read.refusal.line, 1) << length;
    EXPECT_EQ(read.refusal.column, static_cast<int>(length) + 1);
    EXPECT_EQ(read.refusal.FindingIn("x.json").file, "x.json");
  }
  for (const char* brackets : {"[]", "{}"}) {
    std::string deep;
    const std::string open = brackets[0] == '[' ? "[" : "{\"a\":";
    for (int k = 0; k < 100000; ++k) deep += open;
    const auto read = ReadPart(deep);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.refusal.Text(), "the JSON is nested more than 100 levels deep");
    EXPECT_TRUE(ParseIfJson<nlohmann::ordered_json>(deep).is_discarded());
  }
}

TEST(JsonDocument, RefusalsObeyNoTerminalAndStayShort) {
  const auto read = ReadPart(R"({"schema": "\u001b[31m)" + std::string(5000, 'x') + "\"}");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.refusal.Text().find('\x1b'), std::string::npos);
  EXPECT_LT(read.refusal.Text().size(), 400U);
}

}  // namespace
}  // namespace mbv
