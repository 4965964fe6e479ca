// Numbers that are none, files that can be read once only, names that terminals and parsers obey.
#include <gtest/gtest.h>

#include <regex>

#include "base/text.h"
#include "tests/support/run_program.h"
#include "tests/support/sanitized.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

class HostileInputTest : public testing::Test {
 protected:
  Program mbverify{std::string("hostile_") +
                   testing::UnitTest::GetInstance()->current_test_info()->name()};

  std::string Write(const std::string& name, const std::string& content) const {
    const fs::path path = mbverify.folder() / name;
    std::ofstream(path, std::ios::binary) << content;
    return path.string();
  }
  // What a terminal would obey; line ends and tabs may be.
  static void ExpectPlain(const ProgramResult& result, const std::string& call) {
    EXPECT_EQ(FindNonText(result.out), std::string::npos) << call << "\n" << Printable(result.out);
    EXPECT_EQ(FindNonText(result.err), std::string::npos) << call << "\n" << Printable(result.err);
  }
};

std::vector<std::string> Matches(const std::string& text, const std::string& pattern) {
  std::vector<std::string> found;
  const std::regex regex(pattern);
  for (std::sregex_iterator it(text.begin(), text.end(), regex), end; it != end; ++it) {
    found.push_back((*it)[1]);
  }
  return found;
}

// As the help lists them, so that none is forgotten.
TEST_F(HostileInputTest, EveryOptionThatTakesANumberRefusesWhatIsNotFinite) {
  const std::string help = mbverify("--help").out;
  size_t options = 0;
  for (const std::string& command : Matches(help.substr(help.find("Start:")), "\n  ([a-z]+) ")) {
    for (const std::string& option :
         Matches(mbverify(command + " --help").out, "(--[a-z-]+) FLOAT")) {
      ++options;
      for (const char* value : {"nan", "inf", "-inf", "1e999"}) {
        const std::string call = command + " " + option + "=" + value + " x";
        const ProgramResult result = mbverify(call);
        EXPECT_EQ(result.exit_code, 2) << call;
        EXPECT_TRUE(std::regex_search(result.err,
                                      std::regex("finite|range|positive|POSITIVE|violates > 0")))
            << call << "\n"
            << result.err;
      }
    }
  }
  EXPECT_GE(options, 5u);
}

TEST_F(HostileInputTest, NumbersInsideOtherOptionsAreFiniteToo) {
  for (const char* value : {"nan", "inf", ".nan", ".inf", "1e999"}) {
    const std::string v = value;
    for (const std::string& call :
         {"render scenarios/slider_crank/turn.yaml --size 64x64 --out '" + mbverify.Out() +
              "' --at " + v,
          "render scenarios/slider_crank/turn.yaml --out '" + mbverify.Out() + "' --size " + v +
              "x64",
          "model slider_crank --set crank=" + v,
          "sensitivity scenarios/slider_crank/turn.yaml --size " + v + "%",
          "stiffness cabin_robot --at d5=" + v, "stiffness cabin_robot --set L1=" + v,
          "stiffness cabin_robot --map d1=" + v + ":1:3,d5=-0.3:-0.2:3"}) {
      const ProgramResult result = mbverify(call);
      EXPECT_EQ(result.exit_code, 2) << call << "\n" << result.err;
    }
  }
  EXPECT_FALSE(fs::exists(mbverify.Out()));
}

TEST_F(HostileInputTest, WhatComesOutOfAPipeIsReadOnce) {
  const std::string out = " --out '" + mbverify.Out() + "' /dev/stdin";
  for (const std::string& call :
       {std::string("run -q --no-pictures --mode inverse") + out, std::string("check /dev/stdin"),
        std::string("render --at 0 --size 64x64") + out}) {
    const ProgramResult result =
        mbverify.Script("cat scenarios/slider_crank/turn.yaml | \"$mbverify\" " + call);
    EXPECT_EQ(result.exit_code, 0) << call << "\n" << result.err << result.out;
  }
  const ProgramResult stiffness = mbverify.Script(
      "cat scenarios/scara_robot/stiffness.yaml | \"$mbverify\" run -q --no-pictures" + out);
  EXPECT_EQ(stiffness.exit_code, 0) << stiffness.err;
  const ProgramResult model =
      mbverify.Script("cat models/four_bar/model.yaml | \"$mbverify\" model /dev/stdin");
  EXPECT_EQ(model.exit_code, 0) << model.err;
}

TEST_F(HostileInputTest, NamesThatATerminalWouldObeyAreRefusedAndShownHarmless) {
  const std::string model =
      "bodies: {bar: {mass: 1, inertia: [1, 1, 1]}}\n"
      "joints: {pivot: {kind: revolute, parent: world, child: bar, axis: y}}\n"
      "drives: {motor: {kind: joint, joint: pivot}}\n";
  const std::string escape = "\"a\\e[31m\\a\"";
  const std::vector<std::string> files = {
      Write("name.yaml", "name: " + escape + "\n" + model),
      Write("description.yaml", "name: a\ndescription: " + escape + "\n" + model),
      Write("key.yaml", "name: a\n" + escape + ": 1\n" + model),
      Write("body.yaml", "name: a\nbodies: {" + escape + ": {mass: 1}}\n"),
      Write("value.yaml", "name: a\nbodies: {bar: {mass: " + escape + "}}\n"),
      Write("c1.yaml", "name: \"a\\x9b31m\"\n" + model),
      Write("raw.yaml", "name: a\x1b[31m\n" + model),
      Write("surrogate.yaml", "name: a\xed\xa0\x80\n" + model),
      Write("\x1b[31m.yaml", "name: a\n" + model),
      Write("line\nend.yaml", "name: a\n" + model)};
  for (const std::string& file : files) {
    for (const char* command : {"check", "model --format mjcf", "run --no-pictures"}) {
      const std::string call = std::string(command) + " '" + file + "'";
      const ProgramResult result = mbverify(call);
      EXPECT_EQ(result.exit_code, 2) << call << "\n" << result.out << result.err;
      ExpectPlain(result, Printable(call));
    }
  }
  // By an option, too.
  const ProgramResult set = mbverify(
      "run --no-pictures scenarios/slider_crank/turn.yaml --set \"$(printf 'a\\033[31m=\\033')\"");
  EXPECT_EQ(set.exit_code, 2);
  ExpectPlain(set, "--set");
}

TEST_F(HostileInputTest, NamesOfAUrdfAreTextOrItIsRefused) {
  const auto urdf = [](const std::string& robot, const std::string& link,
                       const std::string& joint) {
    return "<robot name=\"" + robot + "\"><link name=\"base\"/><link name=\"" + link +
           "\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" "
           "ixz=\"0\" iyz=\"0\"/></inertial></link><joint name=\"" +
           joint + "\" type=\"continuous\"><parent link=\"base\"/><child link=\"" + link +
           "\"/></joint></robot>";
  };
  const std::string model = Write("model.yaml", "name: a\nurdf: robot.urdf\n");
  Write("robot.urdf", urdf("r", "arm \xc3\xa4", "turn"));
  for (const char* format : {"mjcf", "urdf"}) {
    const ProgramResult good = mbverify("model '" + model + "' --format " + format);
    EXPECT_EQ(good.exit_code, 0) << good.err;
    EXPECT_EQ(FindNonText(good.out), std::string::npos);
  }
  for (const char* bad : {"a&#27;[31m", "a&#10;b", "a&#7;", "a&#x9b;"}) {
    for (const std::string& text :
         {urdf(bad, "arm", "turn"), urdf("r", bad, "turn"), urdf("r", "arm", bad)}) {
      Write("robot.urdf", text);
      for (const char* format : {"mjcf", "urdf", "text", "json"}) {
        const ProgramResult result = mbverify("model '" + model + "' --format " + format);
        EXPECT_EQ(result.exit_code, 2) << text << result.out;
        ExpectPlain(result, text);
      }
    }
  }
}

TEST_F(HostileInputTest, ARunThatDoesNotFitIntoMemoryCouldNotRunAndSaysWhatIsLarge) {
  if (test::kSanitized) GTEST_SKIP() << "needs address space without end";
  // Between what the program needs itself and what the samples need.
  const std::string run =
      "\"$mbverify\" run -q --no-pictures --set motion.sample_s=0.00002 --set "
      "simulation.mode=inverse --out '" +
      mbverify.Out() + "' scenarios/slider_crank/turn.yaml";
  const ProgramResult result = mbverify.Script("ulimit -v 250000; " + run);
  EXPECT_EQ(result.exit_code, 3) << result.out << result.err;
  EXPECT_NE(result.err.find("out of memory: 100000 samples of"), std::string::npos) << result.err;
}

TEST_F(HostileInputTest, SamplesTimesSignalsAreBounded) {
  const ProgramResult result = mbverify("check scenarios/slider_crank/turn.yaml");
  EXPECT_EQ(result.exit_code, 0);
  const ProgramResult large =
      mbverify("run --no-pictures --set motion.sample_s=4e-6 scenarios/slider_crank/turn.yaml");
  EXPECT_EQ(large.exit_code, 2);
  EXPECT_NE(large.err.find("violate samples · signals <= 1e+07"), std::string::npos) << large.err;
  EXPECT_NE(large.err.find("choose motion.sample_s >="), std::string::npos) << large.err;
}

}  // namespace
}  // namespace mbv
