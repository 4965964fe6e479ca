// Slips of indentation and punctuation are reported as such, at their place.
#include <gtest/gtest.h>

#include "base/diagnostics.h"
#include "model_file/load_model.h"
#include "tests/mechanisms/four_bar.h"
#include "tests/mechanisms/slip.h"

namespace mbv {
namespace {

std::string SyntaxFindings(const std::string& text) {
  return LoadModelText(text, "m.yaml").diagnostics.Text();
}

class IndentedWrongly : public testing::TestWithParam<Slip> {};

TEST_P(IndentedWrongly, TheCauseIsNamedAtItsPlace) {
  const Slip& slip = GetParam();
  const std::string text = SyntaxFindings(Replaced(kFourBar, slip.from, slip.to));
  EXPECT_NE(text.find(slip.said), std::string::npos) << text;
  EXPECT_EQ(text.find("end of map not found"), std::string::npos) << text;
}

const Slip kSyntaxSlips[] = {
    {"Tab", "    mass: 2\n", "\tmass: 2\n",
     "m.yaml:12:1: error: YAML syntax: the line is indented by a tab\n"
     "  hint: YAML takes spaces only"},
    {"TabAfterSpaces", "    mass: 2\n", "  \tmass: 2\n",
     "m.yaml:12:3: error: YAML syntax: the line is indented by a tab"},
    {"TabAtTopLevel", "gravity:", "\tgravity:", "the line is indented by a tab"},
    {"BetweenTwoLevels", "    com: [crank/2", "   com: [crank/2",
     "m.yaml:13:4: error: YAML syntax: the line is indented by 3 spaces, the lines above it by 0, "
     "2 "
     "or 4"},
    {"DeeperThanAValue", "    com: [crank/2", "      com: [crank/2",
     "m.yaml:13:7: error: YAML syntax: the line is indented deeper than line 12, which has a value "
     "already"},
    {"OneSpaceAtTopLevel", "\njoints:", "\n joints:", "the line is indented by 1 spaces"},
    {"NoSpaceAfterColon", "    mass: 2\n", "    mass:2\n",
     "m.yaml:12:9: error: YAML syntax: there is no space after the colon"},
    {"NoColon", "    mass: 2\n", "    mass 2\n",
     "m.yaml:12:5: error: YAML syntax: the line has no ': '"},
    {"OpenBracket", "gravity: [0, -9.81, 0]", "gravity: [0, -9.81, 0",
     "YAML syntax: the bracket [ is never closed"},
    {"OpenBrace", "D: {kind: revolute", "D: {{kind: revolute", "is never closed"},
    {"WrongBracket", "gravity: [0, -9.81, 0]", "gravity: [0, -9.81, 0}",
     "the bracket } closes [ of line"},
    {"KeyOfABodyBesideIt", "    mass: 2\n", "  mass: 2\n",
     "m.yaml:13:5: error: YAML syntax: the line is indented deeper than line 12, which has a value "
     "already"},
    {"ABodyInsideABody", "  coupler:\n", "    coupler:\n", ""},
};

INSTANTIATE_TEST_SUITE_P(YamlSyntax, IndentedWrongly, testing::ValuesIn(kSyntaxSlips),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(YamlSyntax, WhatTheFileSaysInsideTextIsNotACause) {
  const std::string text = SyntaxFindings(
      "name: a\n"
      "description: |\n"
      "  a [ { \" '\n"
      "    key:value\n"
      "    \ttabs\n"
      "parameters:\n"
      "  a: {value: 1, note: \"it's [\"}  # { comment\n"
      "  b: it's\n"
      "bodies:\n"
      "- x\n"
      "   y: 1\n");
  EXPECT_NE(text.find("m.yaml:11:4: error: YAML syntax: the line is indented"), std::string::npos)
      << text;
}

TEST(YamlSyntax, AnEntryBesideItsSectionIsReportedToBeIndented) {
  const std::string text = SyntaxFindings(
      "name: a\nbodies: {bar: {mass: 1, inertia: [1, 1, 1]}}\n"
      "joints:\npivot: {kind: fixed, parent: world, child: bar}\n");
  EXPECT_NE(text.find("unknown key 'pivot'\n  hint: if it belongs into 'joints', indent it deeper"),
            std::string::npos)
      << text;
}

TEST(YamlSyntax, AKeyOfAnEntryBesideItIsReportedToBeIndented) {
  const std::string text = SyntaxFindings("name: a\nbodies:\n  bar:\n  mass: 1\n");
  EXPECT_NE(text.find("'mass' belongs into an entry of bodies: indent it deeper"),
            std::string::npos)
      << text;
}

TEST(YamlSyntax, AnEntryInsideAnotherIsReportedToBeIndentedLess) {
  const std::string text =
      SyntaxFindings("name: a\nbodies:\n  bar:\n    mass: 1\n    rod:\n      mass: 1\n");
  EXPECT_NE(text.find("bodies.bar: unknown key 'rod'\n  hint: it looks like another entry of the "
                      "level above: indent it less"),
            std::string::npos)
      << text;
}

}  // namespace
}  // namespace mbv
