// Whole regressions with a fake worker: what it does is written in the scenario's file name.
#include "features/regress/regress.h"

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "features/regress/history.h"
#include "tests/features/regress/fake_worker.h"
#include "tests/support/kill_at_calls.h"

namespace mbv {
namespace {

TEST_F(RegressTest, EverythingAsExpectedIsExitCode0WithAllFiles) {
  Scenario("agree");
  Scenario("must_fail/disagree", "verdict: disagree, mentions: mass is wrong");
  Scenario("must_fail/not_run", "verdict: not_run, mentions: out of reach");
  Scenario("must_fail/bad", "exit_code: 2, mentions: bad input");
  const RegressOutcome outcome = RunAll();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.trouble;
  const Counts counts = CountCases(outcome.report);
  EXPECT_EQ(counts.as_expected, 4);
  EXPECT_EQ(counts.must_fail, 3);
  EXPECT_EQ(counts.ran, 3);
  EXPECT_EQ(counts.verified, 1);
  for (const char* file : {"out/junit.xml", "out/summary.md", "out/index.html", "out/regress.json",
                           "out/m/agree/summary.json", "out/logs/m/must_fail/bad.txt"}) {
    EXPECT_TRUE(std::filesystem::exists(file)) << file;
  }
  EXPECT_FALSE(std::filesystem::exists("out/.mbverify/regress"));
  EXPECT_GT(CaseOf(outcome, "m/agree").cost.peak_kib, 0);
  EXPECT_EQ(CaseOf(outcome, "m/must_fail/bad").not_compared.size(), 1U);
}

TEST_F(RegressTest, OtherVerdictExitCodeOrTextFails) {
  Scenario("agree", "verdict: disagree");
  Scenario("disagree");
  Scenario("disagree_other", "verdict: disagree, mentions: inertia is wrong");
  Scenario("agree_fine");
  const RegressOutcome outcome = RunAll();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(CaseOf(outcome, "m/agree").status, CaseStatus::kUnexpected);
  EXPECT_EQ(CaseOf(outcome, "m/disagree").reason, "exit code 1, expected 0: made up");
  EXPECT_EQ(CaseOf(outcome, "m/disagree_other").reason,
            "the result does not mention 'inertia is wrong': made up");
  EXPECT_EQ(CountCases(outcome.report).as_expected, 1);
}

TEST_F(RegressTest, NamesOfFailedChecksCountAsMentioned) {
  Scenario("disagree", "verdict: disagree, mentions: simulated.closure_m");
  EXPECT_EQ(RunAll().exit_code, 0);
  Scenario("disagree", "verdict: disagree, mentions: simulated_vs_analytic.force_nrmse");
  EXPECT_EQ(RunAll().exit_code, 1) << "that check passed";
}

TEST_F(RegressTest, CrashHangAndWorseAreFailedScenariosWithReasons) {
  Scenario("agree");
  Scenario("crash");
  Scenario("hang");
  Scenario("internal");
  Scenario("silent");
  options_.timeout_s = 1.0;
  const RegressOutcome outcome = RunAll();
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_EQ(CaseOf(outcome, "m/agree").status, CaseStatus::kAsExpected);
  EXPECT_EQ(CaseOf(outcome, "m/crash").status, CaseStatus::kCrashed);
  EXPECT_EQ(CaseOf(outcome, "m/crash").reason, "killed by signal 11 (Segmentation fault)");
  EXPECT_EQ(CaseOf(outcome, "m/hang").status, CaseStatus::kTimedOut);
  EXPECT_EQ(CaseOf(outcome, "m/hang").reason, "no end after 1 s: killed");
  EXPECT_LT(CaseOf(outcome, "m/hang").cost.wall_s, 5.0);
  EXPECT_EQ(CaseOf(outcome, "m/internal").reason, "exit code 4: internal error: demand failed");
  EXPECT_EQ(CaseOf(outcome, "m/silent").reason, "exit code 0 but no summary.json");
}

TEST_F(RegressTest, AWorkerThatCannotStartIsReportedAsSuch) {
  Scenario("agree");
  options_.worker = {"./no_such_program"};
  const RegressOutcome outcome = RunAll();
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(CaseOf(outcome, "m/agree").reason.find("No such file"), std::string::npos);
}

TEST_F(RegressTest, BadInputRunsNothing) {
  EXPECT_EQ(RunAll().exit_code, 2);
  std::filesystem::create_directories("scenarios/empty");
  EXPECT_NE(RunAll().trouble.find("no scenario in this folder"), std::string::npos);
  Scenario("agree");
  Write("copy/scenarios/m/agree.yaml", "mechanism: m\n");
  options_.paths = {"scenarios", "copy"};
  EXPECT_NE(RunAll().trouble.find("same name 'm/agree'"), std::string::npos);
  EXPECT_EQ(Calls(), 0);
}

TEST_F(RegressTest, AScenarioThatIsNotAYamlAnyMoreDoesNotDropOut) {
  Scenario("agree");
  Write("scenarios/m/bad.yaml", "mechanism: m\nmotion: {a: [\n");
  const RegressOutcome outcome = RunAll();
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(CaseOf(outcome, "m/bad").status, CaseStatus::kBadInput);
}

TEST_F(RegressTest, ResumeRunsOnlyWhatIsUnfinishedOrChanged) {
  for (const char* name : {"agree1", "agree2", "agree3", "disagree", "crash"}) Scenario(name);
  // Stopped after three scenarios, as by a signal.
  volatile std::sig_atomic_t stop = 0;
  options_.stop = &stop;
  options_.jobs = 1;
  int ended = 0;
  RegressProgress progress;
  progress.ended = [&](const CaseResult&) { stop = ++ended == 3 ? 1 : 0; };
  const RegressOutcome first = Regress(options_, progress);
  EXPECT_EQ(first.exit_code, 3);
  EXPECT_NE(first.trouble.find("interrupted after 3 of 5"), std::string::npos) << first.trouble;
  EXPECT_EQ(Calls(), 3);
  stop = 0;
  Write("scenarios/m/agree2.yaml", "mechanism: m\nexpect: {verdict: agree}\n# changed\n");
  options_.resume = true;
  const RegressOutcome second = RunAll();
  EXPECT_EQ(second.report.cases.size(), 5U);
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_TRUE(CaseOf(second, "m/agree1").kept);
  EXPECT_FALSE(CaseOf(second, "m/agree2").kept) << "its file changed";
  // crash (again), disagree or what was left, agree2, agree3: agree1 alone is kept with one more.
  const int kept =
      static_cast<int>(std::count_if(second.report.cases.begin(), second.report.cases.end(),
                                     [](const CaseResult& result) { return result.kept; }));
  EXPECT_EQ(Calls(), 3 + 5 - kept);
  EXPECT_FALSE(CaseOf(second, "m/crash").kept) << "what crashed is tried again";
}

TEST_F(RegressTest, ResumeAfterAFinishedRunStartsAnew) {
  Scenario("agree");
  options_.resume = true;
  EXPECT_EQ(RunAll().exit_code, 0);
  EXPECT_FALSE(CaseOf(RunAll(), "m/agree").kept);
  EXPECT_EQ(Calls(), 2);
}

TEST_F(RegressTest, ResumeAfterKill9KeepsWhatWasFinished) {
  for (const char* name : {"agree1", "agree2", "hang"}) Scenario(name);
  options_.jobs = 1;
  const pid_t pid = fork();
  if (pid == 0) {
    (void)RunAll();
    _exit(0);
  }
  for (int i = 0; i < 400 && !std::filesystem::exists("out/.mbverify/regress/state/m/agree2.json");
       ++i) {
    usleep(10000);
  }
  kill(pid, SIGKILL);
  waitpid(pid, nullptr, 0);
  Scenario("hang", "verdict: agree, mentions: nothing");
  std::filesystem::remove("scenarios/m/hang.yaml");
  Scenario("agree3");
  options_.resume = true;
  const RegressOutcome outcome = RunAll();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.trouble;
  EXPECT_TRUE(CaseOf(outcome, "m/agree1").kept);
  EXPECT_TRUE(CaseOf(outcome, "m/agree2").kept);
  EXPECT_FALSE(CaseOf(outcome, "m/agree3").kept);
}

TEST_F(RegressTest, ResumeRunsAgainWhatReadAFileThatHasChanged) {
  for (const char* name : {"agree1", "agree2", "agree3"}) Scenario(name);
  const auto stopped = [&] {
    volatile std::sig_atomic_t stop = 0;
    RegressOptions options = options_;
    options.stop = &stop;
    options.jobs = 1;
    int ended = 0;
    RegressProgress progress;
    progress.ended = [&](const CaseResult&) { stop = ++ended == 2 ? 1 : 0; };
    EXPECT_EQ(Regress(options, progress).exit_code, 3);
  };
  const auto kept = [&] {
    options_.resume = true;
    const RegressOutcome outcome = RunAll();
    options_.resume = false;
    EXPECT_EQ(outcome.exit_code, 0) << outcome.trouble;
    return std::count_if(outcome.report.cases.begin(), outcome.report.cases.end(),
                         [](const CaseResult& result) { return result.kept; });
  };
  stopped();
  EXPECT_EQ(kept(), 2);
  // A table that only the scenarios' text names.
  stopped();
  Table("t,f,g");
  EXPECT_EQ(kept(), 0);
  stopped();
  std::filesystem::remove("table.csv");
  EXPECT_EQ(kept(), 0);
  Table("t,f");
  // A model that is found before the one that was taken.
  stopped();
  Write("scenarios/models/m/model.yaml", "name: m\n");
  EXPECT_EQ(kept(), 0);
  // Results that lie below the scenarios change nothing.
  options_.out = "scenarios/m/out";
  stopped();
  EXPECT_EQ(kept(), 2);
}

TEST_F(RegressTest, ARunThatIsResumedIsOneRunInTheHistory) {
  Scenario("agree");
  Scenario("crash");
  options_.history = "history.sqlite";
  // Killed between its entry in the history and its end, at any call.
  for (int call = 1;; call += 7) {
    std::filesystem::remove_all("out");
    std::filesystem::remove("history.sqlite");
    KillAtCalls killer([&] { _exit(RunAll().exit_code); });
    const bool ended = killer.EndsBefore(call);
    EXPECT_TRUE(!ended || killer.exit_code == 3) << killer.exit_code;
    if (ended) break;
    // Killed when all was done: what is resumed is a new run.
    const bool done = std::filesystem::exists("out/regress.json") &&
                      !std::filesystem::exists("out/.mbverify/regress/run");
    options_.resume = true;
    EXPECT_EQ(RunAll().exit_code, 3);
    options_.resume = false;
    const std::string runs = ListRuns("history.sqlite").text;
    EXPECT_EQ(std::count(runs.begin(), runs.end(), '\n'), done ? 3 : 2) << call << "\n" << runs;
  }
}

// What must not depend on how the work was split: everything but times and the shard's name.
std::string Comparable(RegressReport report) {
  report.run = {};
  for (CaseResult& result : report.cases) result.cost = {};
  return ToJson(report);
}

TEST_F(RegressTest, ShardsMergedEqualOneRun) {
  for (const char* name : {"agree1", "agree2", "agree3", "disagree", "bad", "not_run"}) {
    Scenario(name);
  }
  options_.history = "whole.sqlite";
  const RegressOutcome whole = RunAll();
  options_.history.clear();
  std::vector<std::string> folders;
  size_t cases = 0;
  for (int i = 1; i <= 4; ++i) {
    options_.shard = {i, 4};
    options_.out = "shard" + std::to_string(i);
    folders.push_back(options_.out);
    const RegressOutcome shard = RunAll();
    EXPECT_LE(shard.report.cases.size(), 2U);
    cases += shard.report.cases.size();
  }
  EXPECT_EQ(cases, 6U);
  options_.out = "joined";
  options_.history = "joined.sqlite";
  const RegressOutcome joined = MergeRuns(folders, options_);
  EXPECT_EQ(joined.exit_code, whole.exit_code);
  EXPECT_EQ(Comparable(joined.report), Comparable(whole.report));
  EXPECT_TRUE(std::filesystem::exists("joined/m/agree2/traces.csv"));
  EXPECT_TRUE(std::filesystem::exists("joined/logs/m/bad.txt"));
  EXPECT_NE(ListRuns("joined.sqlite").text.find("3/6"), std::string::npos);
  EXPECT_NE(MergeRuns({"shard1", "shard1"}, options_).trouble.find("too"), std::string::npos);
  EXPECT_EQ(MergeRuns({"nowhere"}, options_).exit_code, 2);
  // The same shards joined again are the same run.
  EXPECT_EQ(MergeRuns(folders, options_).exit_code, whole.exit_code);
  const std::string runs = ListRuns("joined.sqlite").text;
  EXPECT_EQ(std::count(runs.begin(), runs.end(), '\n'), 2) << runs;
}

class MergeTest : public RegressTest {
 protected:
  // Three shards of four scenarios in shard1 … shard3.
  void SetUp() override {
    RegressTest::SetUp();
    for (const char* name : {"agree1", "agree2", "agree3", "agree4"}) Scenario(name);
    for (int i = 1; i <= 3; ++i) {
      options_.shard = {i, 3};
      options_.out = "shard" + std::to_string(i);
      ASSERT_EQ(RunAll().exit_code, 0);
    }
    options_.shard = {};
    options_.out = "joined";
  }
  // Changes a run's description of itself.
  static void Change(const std::string& folder, const std::string& key, const std::string& value) {
    auto json = nlohmann::ordered_json::parse(Read(folder + "/regress.json"));
    json["run"][key] = value;
    Write(folder + "/regress.json", json.dump());
  }
  RegressOutcome Merge(const std::vector<std::string>& folders) const {
    return MergeRuns(folders, options_);
  }
};

TEST_F(MergeTest, AMissingShardIsExitCodeThreeUnlessReportedOtherwise) {
  options_.history = "history.sqlite";
  const RegressOutcome outcome = Merge({"shard1", "shard3"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.trouble.find("shard 2/3 missing"), std::string::npos) << outcome.trouble;
  EXPECT_FALSE(std::filesystem::exists("joined/regress.json"));
  EXPECT_FALSE(std::filesystem::exists("history.sqlite"));
  options_.partial = true;
  const RegressOutcome partial = Merge({"shard1", "shard3"});
  EXPECT_EQ(partial.exit_code, 0) << partial.trouble;
  EXPECT_NE(Read("joined/summary.md").find("shard 2/3 missing"), std::string::npos);
  EXPECT_NE(Read("joined/index.html").find("shard 2/3 missing"), std::string::npos);
  EXPECT_TRUE(partial.report.missing.empty());
  options_.partial = false;
  const RegressOutcome whole = Merge({"shard1", "shard2", "shard3"});
  EXPECT_EQ(whole.exit_code, 0) << whole.trouble;
  EXPECT_EQ(whole.report.cases.size(), 4U);
}

TEST_F(MergeTest, AShardThatDidNotEndIsMissing) {
  std::filesystem::remove("shard2/regress.json");
  const RegressOutcome outcome = Merge({"shard1", "shard2", "shard3"});
  EXPECT_EQ(outcome.exit_code, 3);
  for (const char* part : {"shard2: no regress.json", "shard 2/3 missing"}) {
    EXPECT_NE(outcome.trouble.find(part), std::string::npos) << outcome.trouble;
  }
}

TEST_F(MergeTest, PartsOfDifferentRunsAreRefused) {
  const std::string kept = Read("shard2/regress.json");
  const std::map<std::string, std::pair<std::string, std::string>> changes = {
      {"label", {"another", "has label 'another'"}},
      {"program", {"mbverify 0.0.1", "has program"}},
      {"started_utc", {"2026-01-01T02:00:00Z", "two regression runs"}},
      {"shard", {"2/4", "others are parts of 3"}}};
  for (const auto& [key, change] : changes) {
    Change("shard2", key, change.first);
    options_.partial = false;
    const RegressOutcome outcome = Merge({"shard1", "shard2", "shard3"});
    EXPECT_EQ(outcome.exit_code, 2) << key;
    EXPECT_NE(outcome.trouble.find(change.second), std::string::npos) << outcome.trouble;
    options_.partial = true;
    EXPECT_EQ(Merge({"shard1", "shard2", "shard3"}).exit_code, 0) << key;
    Write("shard2/regress.json", kept);
  }
}

TEST_F(MergeTest, AScenarioThatNoShardHasIsMissing) {
  auto json = nlohmann::ordered_json::parse(Read("shard1/regress.json"));
  json["cases"].erase(json["cases"].begin());
  Write("shard1/regress.json", json.dump());
  const RegressOutcome outcome = Merge({"shard1", "shard2", "shard3"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.trouble.find("the shards hold 3 scenarios, 4 were found"), std::string::npos)
      << outcome.trouble;
}

TEST_F(MergeTest, AVanishedScenarioIsMissingAndFailsIfAsked) {
  options_.history = "history.sqlite";
  ASSERT_EQ(Merge({"shard1", "shard2", "shard3"}).exit_code, 0);
  std::filesystem::remove("scenarios/m/agree3.yaml");
  options_.out = "again";
  const RegressOutcome silent = RunAll();
  EXPECT_EQ(silent.exit_code, 0);
  ASSERT_EQ(silent.report.missing.size(), 1U);
  EXPECT_EQ(silent.report.missing[0].key, "m/agree3");
  options_.fail_on_missing = true;
  EXPECT_EQ(RunAll().exit_code, 1);
  EXPECT_NE(Read("again/junit.xml").find("<failure message=\"was in run 1"), std::string::npos);
}

TEST_F(RegressTest, TwoRunsInOneFolderAreRefused) {
  Scenario("hang");
  Scenario("agree");
  options_.timeout_s = 2.0;
  const pid_t pid = fork();
  if (pid == 0) _exit(RunAll().exit_code);
  for (int i = 0; i < 200 && !std::filesystem::exists("calls.txt"); ++i) usleep(10000);
  const RegressOutcome second = RunAll();
  EXPECT_EQ(second.exit_code, 2);
  EXPECT_NE(second.trouble.find("in use"), std::string::npos);
  int status = 0;
  waitpid(pid, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 3);
}

TEST(Shard, IsIOfN) {
  const auto shard = ParseShard("2/3");
  ASSERT_TRUE(shard);
  EXPECT_EQ(shard->index, 2);
  EXPECT_EQ(shard->count, 3);
  for (const char* bad : {"", "2", "0/3", "4/3", "1/3x", "a/3", "1/", "-1/3"}) {
    EXPECT_FALSE(ParseShard(bad)) << bad;
  }
}

TEST(CaseKey, IsTheSameFromEveryFolder) {
  EXPECT_EQ(CaseKey("/x/scenarios/m/must_fail/a.yaml"), "m/must_fail/a");
  EXPECT_EQ(CaseKey("/x/scenarios/old/scenarios/m/a.yaml"), "m/a");
  EXPECT_EQ(CaseKey("mine/a.yaml"), "mine/a");
}

// What a worker left damaged is named with its key, and nothing of it is taken.
TEST(JudgeCase, ADamagedSummaryIsAnErrorThatNamesItsKey) {
  WorkerEnd end;
  end.exit_code = 0;
  const std::pair<const char*, const char*> damaged[] = {
      {R"({"verdict": "agree", "checks": 3})", "summary.json: checks is a number where a list"},
      {R"({"verdict": "agree", "checks": [{"name": "a", "value": "1"}]})",
       "summary.json: checks[0].value is a text where a number"},
      {R"({"verdict": "agree", "witnesses": [1]})", "summary.json: witnesses[0] is a number"},
      {R"({"verdict": )", "summary.json: line 1, character "},
      {"[]", "summary.json: "}};
  for (const auto& [summary, why] : damaged) {
    const CaseResult result = JudgeCase({}, end, 1.0, "", std::string(summary));
    EXPECT_EQ(result.status, CaseStatus::kInternalError) << summary;
    EXPECT_NE(result.reason.find(why), std::string::npos) << result.reason;
    EXPECT_EQ(result.verdict, "not_run") << summary;
    EXPECT_TRUE(result.metrics.empty()) << summary;
  }
  const CaseResult good = JudgeCase(
      {}, end, 1.0, "", R"({"verdict": "agree", "checks": [{"name": "a", "value": null}]})");
  EXPECT_EQ(good.status, CaseStatus::kAsExpected) << good.reason;
  CaseResult inputs;
  EXPECT_EQ(AddInputs(R"({"inputs": 3})", &inputs), "inputs is a number where a list is needed");
  EXPECT_EQ(AddInputs(R"({"inputs": [{"file": "a", "fingerprint": "b"}]})", &inputs), "");
}

}  // namespace
}  // namespace mbv
