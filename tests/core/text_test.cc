#include "core/text.h"

#include <gtest/gtest.h>

#include "core/diagnostics.h"
#include "core/markup.h"

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

TEST(Text, ControlCharactersAndWhatIsNoUtf8AreFound) {
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

TEST(Text, WhatIsNoTextIsReplacedInMarkup) {
  for (const std::string& bad : kNoText) {
    const std::string escaped = EscapeMarkup("<" + bad + ">");
    EXPECT_EQ(FindNonText(escaped), std::string::npos) << Printable(escaped);
    EXPECT_NE(escaped.find("\uFFFD"), std::string::npos);
  }
}

TEST(Diagnostics, EachFindingIsToldOnce) {
  Diagnostics list, other;
  const Finding finding{Severity::kWarning, "a.yaml", 1, 1, "odd", "mend it"};
  list.Add(finding);
  other.Add(finding);
  other.Add({Severity::kWarning, "a.yaml", 2, 1, "odd", "mend it"});
  list.Append(other);
  EXPECT_EQ(list.findings().size(), 2u);
}

}  // namespace
}  // namespace mbv
