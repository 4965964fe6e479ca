// The scripts of `mbverify completion`, in the shells themselves.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

class Completion : public testing::Test {
 protected:
  Completion() {
    for (const char* shell : {"bash", "zsh", "fish"}) {
      const ProgramResult result = mbverify(std::string("completion ") + shell);
      EXPECT_EQ(result.exit_code, 0) << result.err;
      std::ofstream(Script(shell)) << result.out;
    }
  }
  [[nodiscard]] std::string Script(const std::string& shell) const {
    return mbverify.folder() / ("completion." + shell);
  }
  // What bash offers after these words, the last of which is being typed.
  [[nodiscard]] std::vector<std::string> Bash(const std::string& words) const {
    return Lines(mbverify.Script("PATH=\"$(dirname $mbverify):$PATH\" bash -c '. " +
                                 Script("bash") + "; COMP_WORDS=(mbverify " + words +
                                 "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _mbverify; "
                                 "printf \"%s\\n\" \"${COMPREPLY[@]}\"'"));
  }
  [[nodiscard]] std::vector<std::string> Fish(const std::string& words) const {
    auto lines = Lines(
        mbverify.Script("PATH=\"$(dirname $mbverify):$PATH\" HOME=" + mbverify.folder().string() +
                        " fish --no-config -c 'source " + Script("fish") +
                        "; complete -C \"mbverify " + words + "\"'"));
    for (std::string& line : lines) line = line.substr(0, line.find('\t'));
    return lines;
  }
  [[nodiscard]] static std::vector<std::string> Lines(const ProgramResult& result) {
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    std::vector<std::string> lines;
    std::istringstream stream(result.out);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
  }
  static bool Has(const std::vector<std::string>& lines, const std::string& word) {
    return std::find(lines.begin(), lines.end(), word) != lines.end();
  }
  Program mbverify{std::string("completion_") +
                   testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(Completion, OfBashKnowsCommandsOptionsWordsAndNames) {
  EXPECT_EQ(Bash("conv"), std::vector<std::string>{"converge"});
  EXPECT_EQ(Bash("history comp"), std::vector<std::string>{"compare"});
  EXPECT_TRUE(Has(Bash("run --no"), "--no-pictures"));
  EXPECT_FALSE(Has(Bash("run --"), "--report-script")) << "hidden from help";
  EXPECT_FALSE(Has(Bash("check --no"), "--no-pictures")) << "of another command";
  EXPECT_EQ(Bash("run --mode f"), std::vector<std::string>{"forward"});
  EXPECT_EQ(Bash("model spr_tr"), std::vector<std::string>{"spr_tripod"});
  EXPECT_TRUE(Has(Bash("run four_bar/turn"), "four_bar/turn_inverse"));
  EXPECT_TRUE(Has(Bash("check README"), "README.md")) << "files";
}

TEST_F(Completion, OfFishKnowsCommandsOptionsWordsAndNames) {
  EXPECT_EQ(Fish("conv"), std::vector<std::string>{"converge"});
  EXPECT_TRUE(Has(Fish("history comp"), "compare"));
  EXPECT_TRUE(Has(Fish("run --no"), "--no-pictures"));
  EXPECT_FALSE(Has(Fish("check --no"), "--no-pictures")) << "of another command";
  EXPECT_EQ(Fish("run --mode f"), std::vector<std::string>{"forward"});
  EXPECT_TRUE(Has(Fish("model spr_tr"), "spr_tripod"));
}

TEST_F(Completion, FlagsTakeNoValueAndHiddenCommandsAreNotOffered) {
  const std::string zsh = ReadAll(Script("zsh"));
  EXPECT_NE(zsh.find("'--quiet[one line per scenario]' "), std::string::npos);
  EXPECT_NE(zsh.find("'--out[folder for the figures]:value:_files'"), std::string::npos);
  EXPECT_EQ(zsh.find("man-page"), std::string::npos);
}

// What zsh offers appears on a terminal only; here its own functions say what they were given.
TEST_F(Completion, OfZshKnowsCommandsOptionsWordsAndNames) {
  const auto offered = [&](const std::string& words, int current) {
    return mbverify
        .Script(
            "PATH=\"$(dirname $mbverify):$PATH\" zsh -f -c 'compdef() { :; }; _files() { :; }; "
            "compadd() { print -l -- $@; }; _describe() { print -l -- $commands; }; "
            "_arguments() { print -l -- $@; }; . " +
            Script("zsh") + "; words=(mbverify " + words + "); CURRENT=" + std::to_string(current) +
            "; _mbverify'")
        .out;
  };
  EXPECT_NE(offered("", 2).find("converge:"), std::string::npos);
  EXPECT_NE(offered("history x", 3).find("compare"), std::string::npos);
  const std::string run = offered("run x", 3);
  EXPECT_NE(run.find("--mode["), std::string::npos);
  EXPECT_NE(run.find(":value:(forward inverse)"), std::string::npos);
  EXPECT_NE(run.find("list --names scenarios"), std::string::npos);
  EXPECT_EQ(offered("check x", 3).find("--mode["), std::string::npos);
}

TEST_F(Completion, OtherShellsAreBadInput) {
  const ProgramResult result = mbverify("completion tcsh");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("not one of bash, zsh, fish"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace mbv
