// Files of the user around what the program writes: names, folders, links, devices, kills.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/support/kill_at_calls.h"
#include "tests/support/run_program.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScenario = "scenarios/slider_crank/turn.yaml";

class UserFilesTest : public testing::Test {
 protected:
  Program mbverify{testing::UnitTest::GetInstance()->current_test_info()->name()};

  [[nodiscard]] fs::path In(const std::string& name) const { return mbverify.folder() / name; }
  void Put(const std::string& name, const std::string& content) const {
    fs::create_directories(In(name).parent_path());
    std::ofstream(In(name), std::ios::binary) << content;
  }
  [[nodiscard]] std::string Run(const std::string& arguments) const {
    return "run --no-pictures -q --out '" + mbverify.Out() + "' " + arguments;
  }
  // The shipped slider crank under another name, with a scenario of its own.
  void PutModel(const std::string& folder, const std::string& name) const {
    std::string text = ReadAll(SourcePath("/models/slider_crank/model.yaml"));
    const std::string head = "name: slider_crank";
    text.replace(text.find(head), head.size(), "name: " + name);
    Put(folder + "/model.yaml", text);
    std::string scenario = ReadAll(SourcePath("/") + kScenario);
    const std::string line = "mechanism: slider_crank";
    scenario.replace(scenario.find(line), line.size(), "mechanism: ./model.yaml");
    Put(folder + "/turn.yaml", scenario);
  }
};

TEST_F(UserFilesTest, NamesOfModelsDoNotLeadOutOfTheResultFolder) {
  Put("victim/turn/summary.json", "mine");
  for (const std::string& name :
       {std::string("../victim"), In("victim").string(), std::string("'..'"), std::string("a/b"),
        std::string("'a b'"), std::string("\"a\\nb\""), std::string("''"), std::string("-x"),
        std::string("aux.c"), std::string(65, 'a')}) {
    PutModel("own", name);
    const ProgramResult result = mbverify(Run("'" + In("own/turn.yaml").string() + "'"));
    EXPECT_EQ(result.exit_code, 2) << name << result.err;
    EXPECT_NE(result.err.find("violates: a letter, then letters, digits and '_'"),
              std::string::npos)
        << name << result.err;
  }
  EXPECT_EQ(ReadAll(In("victim/turn/summary.json")), "mine");
  EXPECT_FALSE(fs::exists(mbverify.Out()));
}

TEST_F(UserFilesTest, NamesOfScenariosFollowTheSameRule) {
  PutModel("own", "own");
  const std::string scenario = ReadAll(In("own/turn.yaml"));
  for (const std::string name : {"a b", "2 turns", "turn-1", ".turn"}) {
    Put("own/" + name + ".yaml", scenario);
    const ProgramResult result = mbverify(Run("'" + In("own/" + name + ".yaml").string() + "'"));
    EXPECT_EQ(result.exit_code, 2) << name;
    EXPECT_NE(result.err.find("the scenario's name '" + name + "' violates"), std::string::npos)
        << result.err;
  }
  // A way there that leads back is not a part of the name.
  const std::string there = In("own/../own/turn.yaml").string();
  EXPECT_EQ(mbverify(Run("'" + there + "'")).exit_code, 0);
  EXPECT_TRUE(fs::exists(In("out/own/turn/summary.json")));
}

TEST_F(UserFilesTest, TheResultNamesEveryFileThatWasRead) {
  const auto inputs = [&](const std::string& scenario) {
    EXPECT_EQ(mbverify(Run(scenario)).exit_code, 0) << scenario;
    std::vector<std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(mbverify.Out())) {
      if (entry.path().filename() != "inputs.json") continue;
      const auto json = nlohmann::json::parse(ReadAll(entry.path()));
      for (const auto& input : json["inputs"]) {
        files.push_back(fs::path(input["file"].get<std::string>()).filename());
        EXPECT_EQ(input["fingerprint"].get<std::string>().size(), 16u);
      }
    }
    fs::remove_all(mbverify.Out());
    return files;
  };
  const auto has = [](const std::vector<std::string>& files, const std::string& name) {
    return std::find(files.begin(), files.end(), name) != files.end();
  };
  const auto plain = inputs(kScenario);
  EXPECT_TRUE(has(plain, "turn.yaml") && has(plain, "model.yaml"));
  EXPECT_TRUE(has(inputs("scenarios/four_bar/table_adams.yaml"), "adams.tab"));
  // An elastic model takes its parameters from the rigid one.
  const auto elastic = inputs("scenarios/scara_robot/stiffness.yaml");
  EXPECT_TRUE(has(elastic, "elastic.yaml") && has(elastic, "model.yaml"));
}

TEST_F(UserFilesTest, OutputsThatAreNoFilesAreWrittenInto) {
  const std::string model = "model slider_crank --format mjcf --out ";
  const std::string text = mbverify("model slider_crank --format mjcf").out;
  EXPECT_EQ(mbverify(model + "/dev/null").exit_code, 0);
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_EQ(mbverify(model + "/dev/stdout").out, text);
  EXPECT_EQ(mbverify(model + "/dev/full").exit_code, 3);
  ASSERT_EQ(mkfifo(In("pipe").c_str(), 0600), 0);
  ASSERT_EQ(
      std::system(("cat '" + In("pipe").string() + "' > '" + In("copy").string() + "' &").c_str()),
      0);
  EXPECT_EQ(mbverify(model + "'" + In("pipe").string() + "'").exit_code, 0);
  EXPECT_TRUE(fs::is_fifo(In("pipe")));
  Put("target.xml", "<mujoco>old</mujoco>");
  fs::create_symlink("target.xml", In("link.xml"));
  EXPECT_EQ(mbverify(model + "'" + In("link.xml").string() + "'").exit_code, 0);
  EXPECT_TRUE(fs::is_symlink(In("link.xml")));
  EXPECT_EQ(ReadAll(In("target.xml")), text);
  EXPECT_EQ(ReadAll(In("copy")), text);
}

TEST_F(UserFilesTest, AnOutputThatIsAnInputIsRefused) {
  PutModel("own", "own");
  fs::create_hard_link(In("own/model.yaml"), In("own/other.yaml"));
  fs::create_symlink("turn.yaml", In("own/link.json"));
  const std::string model = In("own/model.yaml").string(), scenario = In("own/turn.yaml").string();
  const std::string model_text = ReadAll(model), text = ReadAll(scenario);
  for (const std::string& call :
       {"model '" + model + "' --format mjcf --out '" + model + "'",
        "model '" + model + "' --format mjcf --out '" + In("own/other.yaml").string() + "'",
        "sensitivity '" + scenario + "' --parameter crank --no-search --json '" + scenario + "'",
        "sensitivity '" + scenario + "' --parameter crank --no-search --json '" +
            In("own/link.json").string() + "'"}) {
    const ProgramResult result = mbverify(call);
    EXPECT_EQ(result.exit_code, 2) << call << result.err;
    EXPECT_NE(result.err.find("which was read for it"), std::string::npos) << result.err;
  }
  EXPECT_EQ(ReadAll(model), model_text);
  EXPECT_EQ(ReadAll(scenario), text);
}

// The scenario cannot run: the output is refused before anything is computed, or not at all.
TEST_F(UserFilesTest, AnOutputThatIsAnInputIsRefusedBeforeAnythingIsComputed) {
  PutModel("own", "own");
  const auto replace = [&](const std::string& file, const std::string& from,
                           const std::string& to) {
    std::string text = ReadAll(In(file));
    ASSERT_NE(text.find(from), std::string::npos) << from;
    Put(file, text.replace(text.find(from), from.size(), to));
  };
  // The rod is too short for the far side of the turn.
  replace("own/model.yaml", "rod: {value: 0.65", "rod: {value: 0.30");
  replace("own/model.yaml", "guess_deg: 90", "guess_deg: 0");
  replace("own/turn.yaml", "analytic: none",
          "analytic: none\nreference: {csv: table.csv, columns: {time: t, motor.force: f}}");
  Put("own/table.csv", "t,f\n0,0\n0.5,0\n1,0\n1.5,0\n2,0\n");
  const std::string scenario = "'" + In("own/turn.yaml").string() + "'";
  const ProgramResult stuck = mbverify(Run(scenario));
  ASSERT_EQ(stuck.exit_code, 3) << stuck.out << stuck.err;
  fs::remove_all(mbverify.Out());
  for (const char* name : {"model.yaml", "turn.yaml", "table.csv"}) {
    const fs::path input = In("own") / name;
    const std::string text = ReadAll(input);
    // A video's name reports its format: a link.
    fs::remove(In("own/link.png"));
    fs::create_symlink(name, In("own/link.png"));
    for (const std::string& call :
         {"sensitivity " + scenario + " --jobs 1 --json '" + input.string() + "'",
          "sensitivity " + scenario + " --jobs 2 --json '" + input.string() + "'",
          "render " + scenario + " --video '" + In("own/link.png").string() + "'"}) {
      const ProgramResult result = mbverify(call);
      EXPECT_EQ(result.exit_code, 2) << call << result.err;
      EXPECT_NE(result.err.find("which was read for it"), std::string::npos) << result.err;
      EXPECT_EQ(result.out, "");
    }
    for (const char* option : {"--junit", "--markdown"}) {
      const ProgramResult result = mbverify("regress --no-history --out '" + mbverify.Out() + "' " +
                                            scenario + " " + option + " '" + input.string() + "'");
      EXPECT_EQ(result.exit_code, 2) << option << result.err;
      EXPECT_NE(result.err.find("choose another output"), std::string::npos) << result.err;
      EXPECT_FALSE(fs::exists(In("out/turn"))) << option;
      EXPECT_FALSE(fs::exists(In("out/own"))) << option;
    }
    EXPECT_EQ(ReadAll(input), text);
  }
  // What merge and history read.
  ASSERT_EQ(mbverify("regress --quiet --no-pictures --out '" + mbverify.Out() + "' " + kScenario)
                .exit_code,
            0);
  const std::string report = In("out/regress.json").string(), text = ReadAll(report);
  for (const char* option : {"--junit", "--markdown"}) {
    const ProgramResult result =
        mbverify("merge '" + mbverify.Out() + "' --no-history --out '" + In("joined").string() +
                 "' " + option + " '" + report + "'");
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_NE(result.err.find("choose another output"), std::string::npos) << result.err;
  }
  EXPECT_EQ(ReadAll(report), text);
  const std::string history = In("out/history.sqlite").string(), bytes = ReadAll(history);
  EXPECT_EQ(
      mbverify("history export --history '" + history + "' --csv '" + history + "'").exit_code, 2);
  EXPECT_EQ(ReadAll(history), bytes);
}

TEST_F(UserFilesTest, ReportsOfARegressionShareOneScript) {
  const std::string regression =
      "regress --quiet --no-history --no-pictures --out '" + mbverify.Out() + "' " + kScenario;
  const fs::path report = In("out/slider_crank/turn/report.html");
  ASSERT_EQ(mbverify(regression).exit_code, 0);
  const std::string shared = ReadAll(report);
  const std::string before = "<script src=\"../../report-";
  const size_t at = shared.find(before);
  ASSERT_NE(at, std::string::npos);
  const size_t begin = shared.find("report-", at);
  const std::string script = shared.substr(begin, shared.find('"', begin) - begin);
  EXPECT_GT(fs::file_size(In("out") / script), 100'000u);
  EXPECT_LT(fs::file_size(report), 400'000u);
  ASSERT_EQ(mbverify(regression + " --embed").exit_code, 0);
  EXPECT_EQ(ReadAll(report).find("<script src="), std::string::npos);
  EXPECT_GT(fs::file_size(report), fs::file_size(In("out") / script));
  ASSERT_EQ(mbverify(regression + " --no-reports").exit_code, 0);
  EXPECT_FALSE(fs::exists(report));
  EXPECT_TRUE(fs::exists(report.parent_path() / "summary.json"));
  // The page's row knows of numbers (2) and of no report (1).
  EXPECT_NE(ReadAll(In("out/index.html")).find(",2]]}"), std::string::npos);
  // Joined folders take the script with them.
  ASSERT_EQ(mbverify(regression).exit_code, 0);
  ASSERT_EQ(
      mbverify("merge '" + mbverify.Out() + "' --no-history --out '" + In("joined").string() + "'")
          .exit_code,
      0);
  EXPECT_TRUE(fs::exists(In("joined") / script));
  EXPECT_EQ(ReadAll(In("joined/slider_crank/turn/report.html")), ReadAll(report));
}

// Before every third change of a file, so that it takes seconds; tests/core kills before each.
TEST_F(UserFilesTest, ARunKilledAtAnyCallLeavesTheOldOrTheNewResult) {
  const std::string scenario = SourcePath("/") + kScenario;
  const std::string binary = std::string(kBinaryDir) + "/mbverify";
  const auto run = [&](const char* duration) {
    return mbverify(Run("'" + scenario + "' --set motion.duration_s=" + duration)).exit_code;
  };
  ASSERT_EQ(run("1"), 0);
  const fs::path folder = In("out/slider_crank/turn");
  std::ofstream(folder / "notes.txt") << "mine";
  const auto program = [&] {
    const int nothing = open("/dev/null", O_RDWR);
    for (int stream : {0, 1, 2}) dup2(nothing, stream);
    execl(binary.c_str(), "mbverify", "run", scenario.c_str(), "--no-pictures", "-q", "--out",
          mbverify.Out().c_str(), "--set", "motion.duration_s=1.5", nullptr);
    _exit(9);
  };
  for (int call = 1;; call += 3) {
    KillAtCalls killer(program);
    const bool ended = killer.EndsBefore(call);
    const auto json = nlohmann::json::parse(ReadAll(folder / "summary.json"), nullptr, false);
    ASSERT_TRUE(json.is_object()) << call;
    const std::string csv = ReadAll(folder / "traces.csv");
    const double last = std::stod(csv.substr(csv.rfind('\n', csv.size() - 2) + 1));
    EXPECT_NEAR(json["duration_s"].get<double>(), last, 1e-9) << call;
    EXPECT_EQ(ReadAll(folder / "notes.txt"), "mine") << call;
    if (ended) {
      EXPECT_EQ(killer.exit_code, 0);
      EXPECT_GT(call, 20);
      break;
    }
  }
  EXPECT_EQ(run("1"), 0);
  EXPECT_FALSE(fs::exists(In("out/.mbverify")));
}

}  // namespace
}  // namespace mbv
