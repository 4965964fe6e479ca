#include "base/text.h"

#include <gtest/gtest.h>

#include "base/diagnostics.h"
#include "base/markup.h"

namespace mbv {
namespace {

const std::vector<std::string> kNoText = {"\x1b",
                                          std::string(1, '\0'),
                                          "\x7f",
                                          "\x80",
                                          "\xc2\x9b",
                                          "\xc0\xaf",
                                          "\xe0\x80\x80",
                                          "\xed\xa0\x80",
                                          "\xf0\x80\x80\x80",
                                          "\xf4\x90\x80\x80",
                                          "\xef\xbf\xbf",
                                          "\xe2\x82"};

TEST(Text, ControlCharactersAndWhatIsNotAnUtf8AreFound) {
  for (const std::string& bad : kNoText) {
    EXPECT_EQ(FindNonText("ab" + bad + "c"), 2u) << Printable(bad);
  }
  for (const std::string good : {"a\tb\r\n", "m²", "→", "😀", "", "\xc2\xa0"}) {
    EXPECT_EQ(FindNonText(good), std::string::npos) << good;
  }
  EXPECT_EQ(FindNonName("a\nb"), 1u);
  EXPECT_EQ(FindNonName("Gelenk_ä"), std::string::npos);
}

TEST(Text, NothingThatATerminalObeysIsPrinted) {
  EXPECT_EQ(Printable("a\x1b[31mb\x9b"
                      "c\n"),
            "a\\x1b[31mb\\x9bc\n");
  const Finding finding{Severity::kError, "\x1b]0;x\x07.yaml", 0, 0, "key '\r'\b", ""};
  EXPECT_EQ(ToText(finding).find_first_of("\x1b\x07\b"), std::string::npos);
}

TEST(Text, ColoursOfOursStayOnATerminalAndNothingElse) {
  EXPECT_EQ(ForTerminal("\x1b[1;31mDISAGREE\x1b[0m\n\ta"), "\x1b[1;31mDISAGREE\x1b[0m\n\ta");
  EXPECT_EQ(ForTerminal("a\rb\x1b[2J\x1b[8m\xc2\x9b"), "a\\x0db\\x1b[2J\\x1b[8m\\xc2\\x9b");
  EXPECT_EQ(ForTerminal("a\u202eb\u200bc\ufeff\u2066→é"), "a\\u202eb\\u200bc\\ufeff\\u2066→é");
  EXPECT_EQ(OneLine("\x1b[0ma\tb\nc"), "\\x1b[0ma\\x09b\\x0ac");
}

TEST(Text, QuotedValuesAndMessagesEnd) {
  EXPECT_EQ(QuotedValue("short"), "short");
  EXPECT_EQ(QuotedValue("ééé", 3), "é… (6 bytes)");
  EXPECT_EQ(Shortened("0123456789", 4), "01 … (6 bytes left out) … 89");
  EXPECT_EQ(Shortened("0123", 4), "0123");
  const Finding finding{Severity::kError, "a", 0, 0, "b" + std::string(20000, 'x') + "e", "h"};
  EXPECT_LT(ToText(finding).size(), 2200U);
  EXPECT_TRUE(ToText(finding).ends_with("xe\n  hint: h"));
}

// Spreadsheets compute what begins so; numbers are numbers.
TEST(Text, CellsOfCsvAreNotComputed) {
  for (const char* text : {"=cmd|' /C calc'!A0", "+1+1", "-1+1", "@SUM(A1)", "-x", "=1"}) {
    EXPECT_EQ(CsvCell(text), "'" + std::string(text)) << text;
  }
  for (const char* text : {"-1.5e-3", "+7", "-inf", "a=b", "", "2026-11-24", "x-1"}) {
    EXPECT_EQ(CsvCell(text), text) << text;
  }
  EXPECT_EQ(CsvCell("\t=1"), "' =1");
  EXPECT_EQ(CsvCell("=\"a\",\nb"), "\"'=\"\"a\"\", b\"");
}

TEST(Text, WhatIsNotATextIsReplacedInMarkup) {
  for (const std::string& bad : kNoText) {
    const std::string escaped = EscapeMarkup("<" + bad + ">");
    EXPECT_EQ(FindNonText(escaped), std::string::npos) << Printable(escaped);
    EXPECT_NE(escaped.find("\uFFFD"), std::string::npos);
  }
}

TEST(Diagnostics, EachFindingIsReportedOnce) {
  Diagnostics list, other;
  const Finding finding{Severity::kWarning, "a.yaml", 1, 1, "odd", "correct it"};
  list.Add(finding);
  other.Add(finding);
  other.Add({Severity::kWarning, "a.yaml", 2, 1, "odd", "correct it"});
  list.Append(other);
  EXPECT_EQ(list.findings().size(), 2u);
}

}  // namespace
}  // namespace mbv
