// Help, hints and terminals, for every subcommand that the program has.
#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "base/text.h"
#include "tests/support/commands.h"
#include "tests/support/run_program.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();  // a terminal's
    line = line.substr(line.rfind('\r') + 1);  // what stays of a line that rewrites itself
    lines.push_back(line);
  }
  return lines;
}

class HelpTest : public testing::Test {
 protected:
  std::vector<std::string> Below(const std::string& command) const {
    return test::CommandsBelow(mbverify, command);
  }
  std::vector<std::string> Commands() const { return test::AllCommands(mbverify); }
  ProgramResult WithColumns(int columns, const std::string& arguments) const {
    return mbverify.Forked(arguments, std::to_string(columns).c_str());
  }
  // On a terminal of this width; `variables` are set for the program.
  std::string OnTerminal(int columns, const std::string& variables,
                         const std::string& arguments) const {
    return mbverify
        .Script("script --quiet --return --command \"stty cols " + std::to_string(columns) +
                "; env -u COLUMNS " + variables + " '$mbverify' " + arguments +
                "\" /dev/null </dev/null")
        .out;
  }

  Program mbverify{testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(HelpTest, FindsTheCommands) {
  const std::vector<std::string> commands = Commands();
  EXPECT_GE(commands.size(), 18u);
  for (const char* known : {"run", "merge", "history accept"}) {
    EXPECT_NE(std::find(commands.begin(), commands.end(), known), commands.end()) << known;
  }
}

TEST_F(HelpTest, EveryCommandShowsItsOwnExamplesAndExitCodes) {
  for (const std::string& command : Commands()) {
    const std::string help = mbverify(command + " --help").out;
    EXPECT_NE(help.find("\n  mbverify " + command), std::string::npos) << command << "\n" << help;
    EXPECT_NE(help.find("Exit codes: 0 "), std::string::npos) << command;
  }
}

TEST_F(HelpTest, ExamplesNameFilesThatAreThere) {
  const std::regex path("scenarios/[a-z_/]+(\\.yaml)?");
  std::set<std::string> seen;
  for (const std::string& command : Commands()) {
    const std::string help = WithColumns(400, command + " --help").out;
    for (std::sregex_iterator it(help.begin(), help.end(), path), end; it != end; ++it) {
      if (it->str().find("my_") != std::string::npos) continue;  // the reader's own
      seen.insert(it->str());
      EXPECT_TRUE(fs::exists(SourcePath("/" + it->str()))) << command << ": " << it->str();
    }
  }
  EXPECT_GE(seen.size(), 5u);
}

TEST_F(HelpTest, NoLineOfAnyHelpIsLongerThanTheTerminal) {
  std::vector<std::string> commands = Commands();
  commands.emplace_back("");
  for (const std::string& command : commands) {
    for (const int columns : {60, 72, 132}) {
      const ProgramResult help = WithColumns(columns, command + " --help");
      EXPECT_EQ(help.exit_code, 0);
      for (const std::string& line : LinesOf(help.out)) {
        EXPECT_LE(PrintedWidth(line), static_cast<size_t>(columns)) << command << ": " << line;
      }
    }
    // Without a terminal and without COLUMNS: 80.
    for (const std::string& line :
         LinesOf(mbverify.Script("env -u COLUMNS \"$mbverify\" " + command + " --help").out)) {
      EXPECT_LE(PrintedWidth(line), 80u) << command << ": " << line;
    }
  }
}

TEST_F(HelpTest, BrokenExamplesAreStillCommands) {
  const std::string help = WithColumns(50, "stiffness --help").out;
  EXPECT_NE(help.find(" \\\n      "), std::string::npos) << help;
}

TEST_F(HelpTest, EveryCommandIsFoundFromAMisspelling) {
  for (const std::string& command : Commands()) {
    std::string misspelt = command;
    misspelt.insert(misspelt.size() - 1, "x");
    const ProgramResult result = mbverify.Forked(misspelt);
    const std::string name = command.substr(command.rfind(' ') + 1);
    EXPECT_EQ(result.exit_code, 2) << misspelt;
    EXPECT_TRUE(result.out.empty()) << result.out;
    EXPECT_NE(result.err.find("error: there is no command 'mbverify " + misspelt + "'"),
              std::string::npos)
        << result.err;
    EXPECT_NE(result.err.find("did you mean '" + name + "'?"), std::string::npos) << result.err;
  }
  EXPECT_NE(mbverify.Forked("quite_another").err.find("commands: init, list, check"),
            std::string::npos);
}

TEST_F(HelpTest, EveryLongOptionIsFoundFromAMisspelling) {
  // What several commands have is tried with the first of them, and one option with each.
  const std::regex option("\n +(-[a-z],)?(--[a-z-]+)");
  std::set<std::string> tried;
  for (const std::string& command : Commands()) {
    const std::string help = "\n" + mbverify.Forked(command + " --help").out;
    bool any = false;
    for (std::sregex_iterator it(help.begin(), help.end(), option), end; it != end; ++it) {
      const std::string name = it->str(2), misspelt = name + "q";
      if (!tried.insert(name).second && any) continue;
      any = true;
      const ProgramResult result = mbverify.Forked(command + " " + misspelt);
      EXPECT_EQ(result.exit_code, 2) << command << " " << misspelt;
      EXPECT_NE(result.err.find("has no option '" + misspelt + "'"), std::string::npos)
          << command << ": " << result.err;
      EXPECT_NE(result.err.find("did you mean '--"), std::string::npos) << result.err;
    }
  }
}

// Each command that takes a model or a scenario, by its help; nothing is computed.
TEST_F(HelpTest, ModelsAndScenariosAreFoundFromAMisspellingInEveryCommandThatTakesOne) {
  int models = 0, scenarios = 0;
  for (const std::string& command : Commands()) {
    const std::string help = mbverify.Forked(command + " --help").out;
    const std::string usage = LinesOf(help)[1];
    if (help.find("\n  model TEXT") != std::string::npos) {
      ++models;
      const ProgramResult result = mbverify.Forked(command + " scara_robt");
      EXPECT_EQ(result.exit_code, 2) << command;
      EXPECT_NE(result.err.find("did you mean 'scara_robot'?"), std::string::npos)
          << command << ": " << result.err;
    }
    if (help.find("\n  scenario TEXT") != std::string::npos ||
        help.find("\n  path TEXT") != std::string::npos ||
        help.find("\n  file TEXT") != std::string::npos) {
      ++scenarios;
      for (const char* misspelt :
           {"scenarios/four_bar/tun.yaml", "four_baar/turn", "four_bar/tun"}) {
        const ProgramResult result =
            mbverify(command + " " + misspelt +
                     (command == "regress" ? " --no-history --out " + mbverify.Out() : ""));
        EXPECT_EQ(result.exit_code, 2) << command;
        EXPECT_NE((result.err + result.out).find("did you mean 'scenarios/four_bar/turn.yaml'?"),
                  std::string::npos)
            << command << ": " << result.err << result.out;
      }
    }
  }
  EXPECT_GE(models, 4);     // model, audit, workspace, stiffness
  EXPECT_GE(scenarios, 6);  // run, render, check, mutate, converge, regress
}

TEST_F(HelpTest, ParametersAndOutputsAreFoundFromAMisspelling) {
  for (const auto& [arguments, hint] : std::vector<std::pair<std::string, std::string>>{
           {"model four_bar --set cranc=0.1", "crank"},
           {"workspace spr_tripod --set q_mim=0.4", "q_min"},
           {"stiffness scara_robot --set K_acd=1", "K_act"},
           {"stiffness scara_robot --output platfrom", "platform"},
           {"stiffness scara_robot --at platfrm.x=0", "platform.x"},
           {"sensitivity four_bar/turn_inverse --parameter roh", "rho"},
           {"run four_bar/turn --set parameters.cranc=0.1", "crank"},
           {"run four_bar/turn --set motion.commands.moter=0", "motor"},
           {"render four_bar/turn --set parameters.cranc=0.1", "crank"},
           {"render four_bar/turn --camera tob", "top"},
           {"converge four_bar/turn --set parameters.cranc=0.1", "crank"},
           {"run four_bar/turn --mode inverze", "inverse"},
           {"init mine --from four_baar", "four_bar"}}) {
    const ProgramResult result = mbverify(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_NE(result.err.find("did you mean '" + hint + "'?"), std::string::npos)
        << arguments << ": " << result.err;
  }
}

TEST_F(HelpTest, CommandsStandUnderHeadingsAndAreListedWithoutAny) {
  const ProgramResult alone = mbverify.Forked("");
  EXPECT_EQ(alone.exit_code, 2) << "nothing was verified";
  EXPECT_EQ(alone.out, mbverify.Forked("--help").out);
  EXPECT_EQ(mbverify.Forked("help").out, alone.out);
  EXPECT_LT(alone.out.find("\nVerify:\n  run "), alone.out.find("\nUnderstand:\n"));
  EXPECT_EQ(Below("").size(), 31u) << "a new command has a heading";
  EXPECT_EQ(mbverify.Forked("-V").out, mbverify.Forked("--version").out);
}

TEST_F(HelpTest, HelpOfACommandIsItsHelp) {
  for (const char* command : {"run", "history compare"}) {
    const ProgramResult help = mbverify.Forked(std::string("help ") + command);
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_EQ(help.out, mbverify.Forked(command + std::string(" --help")).out);
  }
  const ProgramResult none = mbverify.Forked("help history comqare");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_EQ(none.err,
            "error: there is no command 'mbverify history comqare'\n"
            "  hint: did you mean 'compare'?\n");
}

TEST_F(HelpTest, WrongOptionsAreErrorsWithTheUsage) {
  EXPECT_EQ(mbverify.Forked("sensitivity").err,
            "error: scenario is required\nusage: mbverify sensitivity [OPTIONS] scenario\n"
            "  hint: see mbverify sensitivity --help\n");
  EXPECT_EQ(mbverify.Forked("package --check a.zip b.yaml").err,
            "error: package --check takes one archive\n");
  EXPECT_TRUE(mbverify.Forked("package").err.starts_with("error: scenario is required\n"));
  EXPECT_TRUE(mbverify.Forked("package --check a.zip --force")
                  .err.starts_with("error: --check excludes --force"));
  EXPECT_TRUE(
      mbverify.Forked("crosscheck x --program y").err.starts_with("error: --program requires"));
}

TEST_F(HelpTest, FormerNamesOfCommandsStillWorkButAreNotShown) {
  for (const char* name : {"mutate", "upgrade", "verify"}) {
    EXPECT_EQ(mbverify("--help").out.find(std::string("\n  ") + name), std::string::npos) << name;
    EXPECT_EQ(mbverify(std::string(name) + " nowhere.yaml").exit_code, 2);
  }
  const std::string call = " four_bar/turn_inverse --parameter rho --no-search";
  const ProgramResult former = mbverify("mutate" + call), now = mbverify("sensitivity" + call);
  EXPECT_EQ(former.exit_code, now.exit_code);
  EXPECT_NE(now.out.find("rho"), std::string::npos);
  const ProgramResult scenario = mbverify("verify scenarios/four_bar/turn.yaml");
  EXPECT_EQ(scenario.exit_code, 2);
  EXPECT_NE(scenario.err.find("hint: mbverify run scenarios/four_bar/turn.yaml"), std::string::npos)
      << scenario.err;
}

TEST_F(HelpTest, ColourIsForcedAndRefusedByVariables) {
  const std::string call =
      "run four_bar/turn_inverse --no-pictures --no-report --out " + mbverify.Out();
  const auto with = [&](const std::string& variables) {
    return mbverify.Script("env " + variables + " \"$mbverify\" " + call).out;
  };
  EXPECT_EQ(with("A=b").find('\x1b'), std::string::npos);
  EXPECT_NE(with("FORCE_COLOR=1").find("\x1b[1;32mAGREE"), std::string::npos);
  EXPECT_EQ(with("FORCE_COLOR=1 NO_COLOR=1").find('\x1b'), std::string::npos);
}

TEST_F(HelpTest, ScenariosAreFoundByTheirNames) {
  EXPECT_EQ(mbverify.Forked("check four_bar/turn_inverse").out,
            "scenarios/four_bar/turn_inverse.yaml: ok\n");
}

// Lines of one word, such as a path, cannot be broken.
TEST_F(HelpTest, TablesFitTheTerminal) {
  for (const std::string arguments :
       {"list", "model stabilizing_platform", "audit spr_tripod",
        "run four_bar/turn_inverse -v --no-pictures --no-report --out "}) {
    const std::string call = arguments.ends_with(" ") ? arguments + mbverify.Out() : arguments;
    for (const int columns : {60, 100}) {
      for (const std::string& line : LinesOf(OnTerminal(columns, "", call))) {
        const std::string words = line.substr(std::min(line.find_first_not_of(' '), line.size()));
        if (words.find(' ') == std::string::npos) continue;
        EXPECT_LE(PrintedWidth(line), static_cast<size_t>(columns)) << arguments << ": " << line;
      }
    }
  }
}

// A row of 80 columns is whole, without what can be spared.
TEST_F(HelpTest, VerdictRowsFitEightyColumns) {
  const std::string call =
      "run stabilizing_platform/must_fail/analytic_mass --no-pictures --no-report --out " +
      mbverify.Out();
  size_t failed = 0, drives = 0;
  for (const std::string& line : LinesOf(OnTerminal(80, "NO_COLOR=1", call))) {
    if (line.find("/out/") != std::string::npos) continue;  // a path cannot be broken
    EXPECT_LE(PrintedWidth(line), 80u) << line;
    if (line.find("  FAIL  ") != std::string::npos) {
      ++failed;
      EXPECT_TRUE(line.ends_with(" s")) << "the row is broken: " << line;
    }
    drives += line.find("limb2.drive_p  ") != std::string::npos ? 1 : 0;
  }
  EXPECT_GE(failed, 6u);
  EXPECT_EQ(drives, 1u);
  EXPECT_NE(OnTerminal(100, "NO_COLOR=1", call).find("1.0e-10  FAIL"), std::string::npos);
}

TEST_F(HelpTest, ColumnsOverridesTheTerminal) {
  for (const std::string& line : LinesOf(OnTerminal(200, "COLUMNS=64", "model four_bar"))) {
    EXPECT_LE(PrintedWidth(line), 64u) << line;
  }
}

TEST_F(HelpTest, DumbTerminalsAndNoColorGetNoEscapes) {
  const std::string run =
      "run four_bar/turn_inverse --no-pictures --no-report --out " + mbverify.Out();
  const std::string dumb = OnTerminal(80, "-u NO_COLOR TERM=dumb", run);
  EXPECT_EQ(dumb.find('\x1b'), std::string::npos) << dumb;
  EXPECT_NE(dumb.find("AGREE"), std::string::npos) << dumb;
  const std::string colored = OnTerminal(80, "-u NO_COLOR TERM=xterm", run);
  EXPECT_NE(colored.find("32m"), std::string::npos) << colored;
  const std::string plain = OnTerminal(80, "NO_COLOR=1 TERM=xterm", run);
  EXPECT_EQ(plain.find("\x1b[3"), std::string::npos) << plain;
  const std::string regress = OnTerminal(
      80, "-u NO_COLOR TERM=dumb",
      "regress four_bar/static --no-pictures --no-reports --out " + mbverify.Out() + "r");
  EXPECT_EQ(regress.find('\x1b'), std::string::npos) << regress;
  EXPECT_NE(regress.find("four_bar/static"), std::string::npos) << regress;
  fs::remove_all(mbverify.Out() + "r");
}

}  // namespace
}  // namespace mbv
