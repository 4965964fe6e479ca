// What a regression and a merge write into a folder that holds other things, too, and what they do
// not.
#include <sys/resource.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "base/worker_pool.h"
#include "features/regress/history.h"
#include "tests/features/regress/fake_worker.h"
#include "tests/support/kill_at_calls.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

class PublishingTest : public RegressTest {};

TEST_F(PublishingTest, AFolderFullOfTheUsersFilesKeepsThem) {
  Scenario("agree");
  Scenario("agree/agree_fast");  // its result lies in the folder of the other one
  const std::vector<std::string> mine = {".work/a",
                                         ".state/b",
                                         ".lock",
                                         "logs/mine.txt",
                                         "notes.md",
                                         "m/notes.txt",
                                         "m/agree/notes.txt",
                                         "m/agree/snapshots/photo.jpg"};
  for (const std::string& file : mine) Write(file, "mine");
  options_.out = ".";
  for (int regression = 0; regression < 3; ++regression) {
    const RegressOutcome outcome = RunAll();
    EXPECT_EQ(outcome.exit_code, 0) << outcome.trouble;
    for (const std::string& file : mine) EXPECT_EQ(Read(file), "mine") << file;
  }
  for (const char* file : {"index.html", "regress.json", "m/agree/summary.json",
                           "m/agree/agree_fast/summary.json", "logs/m/agree/agree_fast.txt"}) {
    EXPECT_TRUE(fs::exists(file)) << file;
  }
}

TEST_F(PublishingTest, FilesInTheWayAreNamedBeforeAnythingRuns) {
  Scenario("agree");
  const std::vector<std::string> mine = {"index.html", "junit.xml", "summary.md", "regress.json",
                                         "logs/m/agree.txt"};
  for (const std::string& file : mine) Write("out/" + file, "mine");
  const RegressOutcome outcome = RunAll();
  EXPECT_EQ(outcome.exit_code, 2);
  for (const std::string& file : mine) {
    EXPECT_NE(outcome.trouble.find("out/" + file + ": error: is there already"), std::string::npos)
        << outcome.trouble;
    EXPECT_EQ(Read("out/" + file), "mine");
  }
  EXPECT_EQ(Calls(), 0);
}

TEST_F(PublishingTest, AResultThatCannotTakeItsPlaceIsExitCode2) {
  Scenario("agree");
  Write("out/m/agree/traces.csv", "measured on the rig");
  const RegressOutcome outcome = RunAll();
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.trouble.find("it holds traces.csv"), std::string::npos) << outcome.trouble;
  EXPECT_EQ(Read("out/m/agree/traces.csv"), "measured on the rig");
}

TEST_F(PublishingTest, ScenariosNamedLikeFilesOfTheRunAreRefused) {
  options_.history = "out/history.sqlite";
  options_.shared_files["report-0123456789abcdef.js"] = "script";
  for (const std::string name :
       {"index.html", "regress.json", "junit.xml", "summary.md", "unfinished.txt", "history.sqlite",
        "report-0123456789abcdef.js", "logs/m/agree.txt"}) {
    Scenario("agree");
    Write("scenarios/" + name + "/agree.yaml", "mechanism: m\nexpect: {verdict: agree}\n");
    for (const std::string file : {"/agree", ""}) {
      const RegressOutcome outcome = RunAll();
      EXPECT_EQ(outcome.exit_code, 2) << name;
      EXPECT_NE(outcome.trouble.find(name + file + ": error: its results would lie at " + name),
                std::string::npos)
          << name << outcome.trouble;
      EXPECT_FALSE(fs::exists("out/m")) << name;
      // The same with a scenario of that name.
      fs::remove_all("scenarios/" + name);
      Write("scenarios/" + name + ".yaml", "mechanism: m\nexpect: {verdict: agree}\n");
    }
    fs::remove_all("scenarios");
  }
  EXPECT_EQ(Calls(), 0);
}

// A folder called "logs" is the regression's and a model's at once, and no file is lost.
TEST_F(PublishingTest, ScenariosInAFolderCalledLogsHaveLogsOfTheirOwn) {
  Scenario("agree");
  for (const std::string file : {"scenarios/logs/agree.yaml", "scenarios/logs/m/agree.yaml"}) {
    Write(file, "mechanism: m\nexpect: {verdict: agree}\n");
    Write(file + ".print", ContentFingerprint(Read(file)));
  }
  for (int regression = 0; regression < 2; ++regression) {
    const RegressOutcome outcome = RunAll();
    EXPECT_EQ(outcome.exit_code, 0) << outcome.trouble;
    for (const std::string key : {"m/agree", "logs/agree", "logs/m/agree"}) {
      EXPECT_TRUE(nlohmann::json::accept(Read("out/" + key + "/summary.json"))) << key;
      EXPECT_EQ(Read("out/logs/" + key + ".txt"), "all is well\n") << key;
    }
  }
}

TEST_F(PublishingTest, OutputsThatAreScenariosAreRefused) {
  Scenario("agree");
  const std::string file = "scenarios/m/agree.yaml", text = Read(file);
  for (std::string RegressOptions::*output :
       {&RegressOptions::junit, &RegressOptions::markdown, &RegressOptions::history}) {
    options_.*output = file;
    EXPECT_EQ(RunAll().exit_code, 2);
    EXPECT_EQ(Read(file), text);
    (options_.*output).clear();
  }
  EXPECT_EQ(Calls(), 0);
  // What a scenario reads is known when it has run.
  options_.junit = "table.csv";
  EXPECT_EQ(RunAll().exit_code, 2);
  EXPECT_EQ(Read("table.csv"), "t,f");
}

// Each result whole: of the regression before or of this one. Where both are in the folder, or
// results are newer than the summaries, it says so and is not joined with others.
TEST_F(PublishingTest, KilledAtAnyCallLeavesWholeResultsAndTheNextRunIsFine) {
  Scenario("agree1");
  Scenario("agree2");
  options_.jobs = 1;
  options_.label = "1";
  ASSERT_EQ(RunAll().exit_code, 0);
  EXPECT_FALSE(fs::exists("out/unfinished.txt"));
  Write("out/m/agree1/notes.txt", "mine");
  int mixed = 0, regression = 1;
  const auto check = [&](int call) {
    for (const std::string name : {"agree1", "agree2"}) {
      const std::string folder = "out/m/" + name + "/";
      const auto json = nlohmann::json::parse(Read(folder + "summary.json"), nullptr, false);
      ASSERT_TRUE(json.is_object()) << call;
      EXPECT_EQ(json["regression"], Read(folder + "regression.txt")) << call;
      EXPECT_TRUE(fs::exists(folder + "traces.csv")) << call;
    }
    EXPECT_EQ(Read("out/m/agree1/notes.txt"), "mine") << call;
    for (const char* file : {"out/regress.json", "out/index.html", "out/junit.xml"}) {
      EXPECT_GT(Read(file).size(), 100U) << call << file;
    }
    const auto report = nlohmann::json::parse(Read("out/regress.json"), nullptr, false);
    ASSERT_TRUE(report.is_object()) << call;
    std::set<std::string> regressions = {report["run"]["label"]};
    for (const char* file : {"out/m/agree1/regression.txt", "out/m/agree2/regression.txt"}) {
      regressions.insert(Read(file));
    }
    if (regressions.size() == 1) return;
    ++mixed;
    EXPECT_TRUE(fs::exists("out/unfinished.txt")) << call;
    EXPECT_NE(Read("out/index.html").find("has not finished"), std::string::npos) << call;
    RegressOptions join = options_;
    join.out = "joined";
    EXPECT_NE(MergeRuns({"out"}, join).trouble.find("may be of two runs"), std::string::npos);
  };
  for (int call = 1; !HasFailure(); call += 3) {
    options_.label = std::to_string(++regression);
    Write("regression.txt", options_.label);
    KillAtCalls killer([&] { _exit(RunAll().exit_code); });
    const bool ended = killer.EndsBefore(call);
    check(call);
    if (ended) {
      EXPECT_EQ(killer.exit_code, 0);
      EXPECT_GT(call, 60);
      break;
    }
    options_.resume = call % 2 == 0;
    const RegressOutcome next = RunAll();
    EXPECT_EQ(next.exit_code, 0) << call << next.trouble;
    options_.resume = false;
    check(call);
    EXPECT_FALSE(fs::exists("out/.mbverify/regress")) << call;
    EXPECT_FALSE(fs::exists("out/unfinished.txt")) << call;
    EXPECT_EQ(Read("out/index.html").find("has not finished"), std::string::npos) << call;
  }
  EXPECT_GT(mixed, 3);
}

TEST_F(PublishingTest, AKeyOfAStrangersShardStaysInItsFolder) {
  Scenario("agree");
  options_.out = "shard";
  ASSERT_EQ(RunAll().exit_code, 0);
  Write("victim/summary.json", "mine");
  const std::string text = Read("shard/regress.json");
  for (const std::string key :
       {"../victim", "/absolute", "a/../../victim", "", "m//agree", ".mbverify"}) {
    auto json = nlohmann::ordered_json::parse(text);
    json["cases"][0]["key"] = key;
    Write("shard/regress.json", json.dump());
    options_.out = "joined";
    const RegressOutcome outcome = MergeRuns({"shard"}, options_);
    EXPECT_EQ(outcome.exit_code, 2) << key;
    EXPECT_NE(outcome.trouble.find("is not a name of a scenario"), std::string::npos)
        << outcome.trouble;
  }
  EXPECT_EQ(Read("victim/summary.json"), "mine");
}

TEST_F(PublishingTest, LinksInAStrangersShardAreNotFollowed) {
  Scenario("agree");
  options_.out = "shard";
  ASSERT_EQ(RunAll().exit_code, 0);
  Write("secret/key", "secret");
  fs::remove("shard/m/agree/traces.csv");
  fs::create_symlink(folder_ / "secret" / "key", "shard/m/agree/traces.csv");
  fs::create_directory_symlink(folder_ / "secret", "shard/m/agree/snapshots");
  fs::remove("shard/logs/m/agree.txt");
  fs::create_symlink(folder_ / "secret" / "key", "shard/logs/m/agree.txt");
  options_.out = "joined";
  (void)MergeRuns({"shard"}, options_);
  std::vector<std::string> unread;
  for (const fs::path file : FilesBelow("joined", ".txt", &unread)) EXPECT_NE(Read(file), "secret");
  EXPECT_FALSE(fs::exists("joined/m/agree/traces.csv"));
  EXPECT_FALSE(fs::exists("joined/m/agree/snapshots"));
}

TEST_F(PublishingTest, AHistoryThatCannotBeUsedIsExitCode2AndNothingRuns) {
  Scenario("agree");
  Write("foreign.sqlite",
        "this is not a database, but long enough to look at " + std::string(900, 'x'));
  {
    RegressReport report = OneRun({AgreeingCase("m/agree", 1e-9)});
    ASSERT_EQ(AppendRun("damaged.sqlite", {}, &report), "");
    std::string bytes = Read("damaged.sqlite");
    for (size_t i = 4096; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 7);
    Write("damaged.sqlite", bytes);
  }
  fs::create_directories("folder.sqlite");
  for (const char* file : {"foreign.sqlite", "damaged.sqlite", "folder.sqlite", "/dev/full",
                           "foreign.sqlite/x", "/proc/history.sqlite"}) {
    options_.history = file;
    const RegressOutcome outcome = RunAll();
    EXPECT_EQ(outcome.exit_code, 2) << file;
    EXPECT_NE(outcome.trouble.find("history "), std::string::npos) << file << outcome.trouble;
  }
  EXPECT_EQ(Calls(), 0);
}

TEST_F(PublishingTest, AHistoryThatFillsTheDiskIsExitCode2ButTheSummariesAreThere) {
  Scenario("agree");
  options_.history = "history.sqlite";
  const pid_t pid = fork();
  if (pid == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit small{16384, 16384};
    setrlimit(RLIMIT_FSIZE, &small);
    const RegressOutcome outcome = RunAll();
    _exit(outcome.exit_code == 2 && outcome.trouble.find("history ") != std::string::npos ? 0 : 1);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(fs::exists("out/regress.json"));
}

TEST_F(PublishingTest, FoldersThatCannotBeReadAreReportedAndTheRunGoesOn) {
  Scenario("agree");
  fs::create_directories("scenarios/locked");
  fs::permissions("scenarios/locked", fs::perms::none);
  fs::permissions(folder_, fs::perms::all);
  const pid_t pid = fork();
  if (pid == 0) {
    if (geteuid() == 0 && setuid(65534) != 0) _exit(9);
    options_.out = (fs::temp_directory_path() / ("mbv_night_" + std::to_string(getpid()))).string();
    const RegressOutcome outcome = RunAll();
    fs::remove_all(options_.out);
    _exit(outcome.exit_code == 2 && outcome.report.cases.size() == 1 &&
                  outcome.trouble.find("scenarios/locked: error: cannot be read") !=
                      std::string::npos
              ? 0
              : 1);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  fs::permissions("scenarios/locked", fs::perms::owner_all);
  EXPECT_EQ(status, 0);
}

TEST_F(PublishingTest, AScenarioWhoseMechanismIsADeviceIsOneCase) {
  Scenario("agree");
  for (const std::string mechanism :
       {"/dev/zero", "/dev/stdin", "../../../../dev/null", "/proc/self/mem", "/", "scenarios"}) {
    Write("scenarios/m/bad.yaml", "mechanism: " + mechanism + "\nexpect: {exit_code: 2}\n");
    const RegressOutcome outcome = RunAll();
    EXPECT_EQ(outcome.report.cases.size(), 2U) << outcome.trouble;
    EXPECT_EQ(CaseOf(outcome, "m/agree").status, CaseStatus::kAsExpected);
  }
}

// Whatever the work does, the caller goes on with the next.
TEST(InChildren, GiveTheirTextsOrNothing) {
  const auto texts = InChildren(8, 2.0, [](size_t i) -> std::string {
    if (i == 1) raise(SIGSEGV);
    if (i == 2) throw std::runtime_error("x");
    if (i == 3) abort();
    if (i == 4) sleep(60);
    if (i == 5) _exit(0);
    if (i == 6) return std::string(1'000'000, 'x');
    return std::to_string(i);
  });
  ASSERT_EQ(texts.size(), 8U);
  EXPECT_EQ(texts[0], "0");
  for (const size_t i : {1, 2, 3, 4, 5}) EXPECT_FALSE(texts[i]) << i;
  ASSERT_TRUE(texts[6]);
  EXPECT_EQ(texts[6]->size(), 1'000'000U);
  EXPECT_EQ(texts[7], "7");
  EXPECT_TRUE(InChildren(0, 1.0, [](size_t) { return ""; }).empty());
}

}  // namespace
}  // namespace mbv
