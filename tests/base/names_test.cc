#include "base/files.h"

#include <gtest/gtest.h>

#include "base/markup.h"
#include "base/sha256.h"

namespace mbv {
namespace {

TEST(Names, AreALetterThenLettersDigitsAndUnderscores) {
  for (const char* good : {"a", "four_bar", "A1_", "m2"}) EXPECT_TRUE(IsName(good)) << good;
  for (const char* bad :
       {"", "1a", "_a", "a-b", "a b", "a/b", "..", ".", "a.b", "ä", "a\n", "/a"}) {
    EXPECT_FALSE(IsName(bad)) << bad;
  }
  EXPECT_TRUE(IsName(std::string(64, 'a')));
  EXPECT_FALSE(IsName(std::string(65, 'a')));
  EXPECT_FALSE(IsName(std::string("a\0b", 3)));
}

TEST(Names, HaveANearestOne) {
  EXPECT_EQ(NearestName("My arm-2"), "My_arm_2");
  EXPECT_EQ(NearestName("../../x"), "x");
  EXPECT_EQ(NearestName("ä"), "");
}

TEST(PlainPaths, StayBelowTheirFolder) {
  for (const char* good : {"a", "a/b", "m/must_fail/x", "2026-01 regression/x", "ä/b"}) {
    EXPECT_TRUE(IsPlainPath(good)) << good;
    EXPECT_EQ(NearestPlainPath(good), good);
  }
  for (const char* bad : {"", "/a", "a/", "a//b", "..", "a/../b", ".", ".hidden/a", "a/.b", "a\nb",
                          "a\x1b[2Jb", "a\\b"}) {
    EXPECT_FALSE(IsPlainPath(bad)) << bad;
    const std::string near = NearestPlainPath(bad);
    EXPECT_TRUE(near.empty() || IsPlainPath(near)) << near;
  }
  EXPECT_FALSE(IsPlainPath(std::string(201, 'a')));
  EXPECT_EQ(NearestPlainPath("a/../b"), "a/_./b");
}

TEST(Links, LeadToTheFileWhateverItIsCalled) {
  EXPECT_EQ(EncodeLink("m/a_b-c.d~e"), "m/a_b-c.d~e");
  EXPECT_EQ(EncodeLink("a#b?c%d"), "a%23b%3Fc%25d");
  EXPECT_EQ(EncodeLink("javascript:alert(1)"), "javascript%3Aalert%281%29");
  EXPECT_EQ(EncodeLink("\"><script>ä"), "%22%3E%3Cscript%3E%C3%A4");
}

TEST(ScriptData, HasNoMarkup) {
  EXPECT_EQ(EscapeScript(R"(["<!--<script>","</script>"])"),
            R"(["\u003c!--\u003cscript>","\u003c/script>"])");
}

// FIPS 180-4's examples, and a length at the edge of a block.
TEST(Sha256, OfPiecesIsThatOfTheWhole) {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += static_cast<char>('a' + i % 23);
  for (const size_t piece : {1U, 7U, 63U, 64U, 65U, 200U, 1000U}) {
    Sha256Sum sum;
    for (size_t at = 0; at < text.size(); at += piece) sum.Add(text.substr(at, piece));
    EXPECT_EQ(sum.Hex(), Sha256Hex(text)) << piece;
  }
  Sha256Sum other;
  other.Add(text.substr(1));
  EXPECT_NE(other.Hex(), Sha256Hex(text));
}

TEST(Sha256, GivesThePublishedDigests) {
  const auto hex = [](const std::string& text) {
    std::string digits;
    for (const auto byte : Sha256(text)) {
      digits += "0123456789abcdef"[byte >> 4U];
      digits += "0123456789abcdef"[byte & 15U];
    }
    return digits;
  };
  EXPECT_EQ(hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(hex(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  EXPECT_EQ(CspHash(""), "'sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU='");
}

}  // namespace
}  // namespace mbv
