// The history: whole runs only, whoever writes or is killed; drift and movements reported from it.
#include "features/regress/history.h"

#include <signal.h>
#include <sys/wait.h>

#include <cmath>
#include <thread>

#include "features/regress/database.h"
#include "features/regress/summaries.h"
#include "features/regress/trouble_text.h"
#include "tests/features/regress/regress_fixture.h"

namespace mbv {
namespace {

constexpr const char* kFile = "history.sqlite";

class HistoryTest : public FolderTest {
 protected:
  // Appends one run of one scenario; the run as judged.
  static RegressReport Record(double nrmse, const std::string& label = "",
                              const GoldenTraces& golden = {}, const std::string& inputs = "1111") {
    CaseResult result = AgreeingCase("model/case", nrmse);
    result.inputs = inputs;
    RegressReport report = OneRun({result}, label);
    std::map<std::string, GoldenTraces> goldens;
    if (!golden.empty()) goldens["model/case"] = golden;
    EXPECT_EQ(AppendRun(kFile, goldens, &report), "");
    return report;
  }
  static const std::vector<Drift>& DriftsOf(const RegressReport& report) {
    return report.cases.front().drifts;
  }
  static long Count(const std::string& sql) {
    Database database(kFile, Database::Mode::kRead);
    Statement select(&database, sql);
    const long count = select.Step() ? select.Integer(0) : -1;
    EXPECT_EQ(database.trouble(), "");
    return count;
  }
  static GoldenTraces Forces(double analytic, double simulated) {
    const auto trace = [](double factor) {
      ForceTrace t{{"leg"}, MatX(100, 1)};
      for (int i = 0; i < 100; ++i) t.force(i, 0) = factor * (1000.0 + i);
      return t;
    };
    return {{"analytic", trace(analytic)}, {"simulated", trace(simulated)}};
  }
};

TEST_F(HistoryTest, RunsAreNumberedAndTheirCourseComesBack) {
  EXPECT_EQ(Record(1e-9).run.id, 1);
  EXPECT_EQ(Record(2e-9).run.id, 2);
  const RegressReport third = Record(3e-9);
  EXPECT_EQ(third.run.id, 3);
  EXPECT_EQ(third.cases.front().course, (std::vector<double>{1e-9, 2e-9, 3e-9}));
}

TEST_F(HistoryTest, TenTimesWorseInsideItsLimitIsDriftWithTheRunItBegan) {
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(DriftsOf(Record(1e-9)).empty());
  const RegressReport fifth = Record(2e-8, "commit-five");
  ASSERT_EQ(DriftsOf(fifth).size(), 1U);
  EXPECT_TRUE(fifth.cases.front().verified) << "inside its limit of 1e-6";
  EXPECT_EQ(DriftsOf(fifth)[0].metric, "simulated_vs_analytic.force_nrmse");
  EXPECT_EQ(CountCases(fifth).drifted, 1);
  const RegressReport sixth = Record(2e-8, "commit-six");
  ASSERT_EQ(DriftsOf(sixth).size(), 1U);
  EXPECT_EQ(DriftsOf(sixth)[0].since_run, 5);
  EXPECT_NE(DriftsOf(sixth)[0].since.find("commit-five"), std::string::npos);
  EXPECT_NE(DriftsOf(sixth)[0].since.find("build 0123abcd"), std::string::npos);
}

TEST_F(HistoryTest, AFiveTimesWorseRunIsNotADrift) {
  for (int i = 0; i < 4; ++i) Record(1e-9);
  EXPECT_TRUE(DriftsOf(Record(5e-9)).empty());
}

TEST_F(HistoryTest, AcceptingARunStartsANewBaseline) {
  for (int i = 0; i < 4; ++i) Record(1e-9);
  Record(2e-8);
  EXPECT_EQ(AcceptRun(kFile, "last", "", "a coarser step").trouble, "");
  EXPECT_TRUE(DriftsOf(Record(2e-8)).empty());
  EXPECT_EQ(DriftsOf(Record(3e-7)).size(), 1U);
  EXPECT_NE(AcceptRun(kFile, "last", "model/unknown", "").trouble, "");
}

TEST_F(HistoryTest, SaysWhichWitnessTookAStepOnce) {
  EXPECT_TRUE(DriftsOf(Record(1e-9, "", Forces(1, 1))).empty());
  const RegressReport analytic = Record(1e-9, "", Forces(1.001, 1));
  ASSERT_EQ(DriftsOf(analytic).size(), 1U);
  EXPECT_NE(DriftsOf(analytic)[0].text.find("analytic moved"), std::string::npos);
  EXPECT_NE(DriftsOf(analytic)[0].text.find("files are the same"), std::string::npos);
  EXPECT_TRUE(DriftsOf(Record(1e-9, "", Forces(1.001, 1))).empty());
  const RegressReport simulated = Record(1e-9, "", Forces(1.001, 1.001));
  EXPECT_NE(DriftsOf(simulated).at(0).text.find("simulation moved"), std::string::npos);
  const RegressReport both = Record(1e-9, "", Forces(2, 2), "2222");
  EXPECT_NE(DriftsOf(both).at(0).text.find("both moved"), std::string::npos);
  EXPECT_NE(DriftsOf(both).at(0).text.find("model file changed"), std::string::npos);
}

TEST_F(HistoryTest, EqualRunsShareOneCopyOfTheirTraces) {
  for (int i = 0; i < 5; ++i) Record(1e-9, "", Forces(1, 2));
  EXPECT_EQ(Count("SELECT COUNT(*) FROM golden"), 10);
  EXPECT_EQ(Count("SELECT COUNT(*) FROM trace"), 2);
}

TEST_F(HistoryTest, OldTracesAreDroppedNotOldNumbers) {
  HistoryOptions options;
  options.golden_runs = 3;
  for (int i = 0; i < 6; ++i) {
    RegressReport report = OneRun({AgreeingCase("model/case", 1e-9)});
    ASSERT_EQ(AppendRun(kFile, {{"model/case", Forces(1 + i, 1)}}, &report, options), "");
  }
  EXPECT_EQ(Count("SELECT COUNT(DISTINCT result) FROM golden"), 3);
  EXPECT_EQ(Count("SELECT COUNT(*) FROM trace"), 4);
  EXPECT_EQ(Count("SELECT COUNT(*) FROM run"), 6);
}

TEST_F(HistoryTest, TwoWritersAtOnceLoseNothing) {
  constexpr int kWriters = 2, kRuns = 15;
  std::vector<pid_t> children;
  for (int w = 0; w < kWriters; ++w) {
    const pid_t pid = fork();
    if (pid == 0) {
      int bad = 0;
      for (int i = 0; i < kRuns; ++i) {
        RegressReport report = OneRun({AgreeingCase("model/case", 1e-9)}, std::to_string(w));
        bad += AppendRun(kFile, {{"model/case", Forces(w + 1, i + 1)}}, &report).empty() ? 0 : 1;
      }
      _exit(bad);
    }
    children.push_back(pid);
  }
  for (const pid_t pid : children) {
    int status = 0;
    waitpid(pid, &status, 0);
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
  }
  EXPECT_EQ(Count("SELECT COUNT(*) FROM run"), kWriters * kRuns);
  EXPECT_EQ(Count("SELECT COUNT(*) FROM result"), kWriters * kRuns);
  EXPECT_EQ(Count("SELECT COUNT(*) FROM golden"), 2 * kWriters * kRuns);
}

TEST_F(HistoryTest, OnlyAnotherProgramsLockIsWaitedFor) {
  Database writer(kFile, Database::Mode::kCreate, 0.0);
  writer.Run("CREATE TABLE a(b)");
  writer.Run("BEGIN IMMEDIATE");
  Database waiting(kFile, Database::Mode::kWrite, 0.0);
  waiting.Run("BEGIN IMMEDIATE");
  EXPECT_TRUE(waiting.locked()) << waiting.trouble();
  writer.Run("COMMIT");
  EXPECT_FALSE(writer.locked()) << writer.trouble();
  // Its text ends as that of a lock does.
  Database wrong(kFile, Database::Mode::kWrite, 0.0);
  wrong.Run("SELECT * FROM locked");
  EXPECT_TRUE(wrong.trouble().ends_with("locked")) << wrong.trouble();
  EXPECT_FALSE(wrong.locked());
}

// A process is killed at many moments of its writing; what is there afterwards are whole runs.
TEST_F(HistoryTest, KillingAWriterLeavesWholeRunsOnly) {
  constexpr int kCases = 40;
  const auto regression = [] {
    std::vector<CaseResult> cases;
    std::map<std::string, GoldenTraces> goldens;
    for (int i = 0; i < kCases; ++i) {
      cases.push_back(AgreeingCase("model/case" + std::to_string(i), 1e-9));
      goldens[cases.back().key] = Forces(i + 1, i + 2);
    }
    RegressReport report = OneRun(std::move(cases));
    return AppendRun(kFile, goldens, &report);
  };
  ASSERT_EQ(regression(), "");
  for (int moment = 0; moment < 25; ++moment) {
    const pid_t pid = fork();
    if (pid == 0) {
      while (regression().empty()) {
      }
      _exit(1);
    }
    std::this_thread::sleep_for(std::chrono::microseconds(3000 + 1700 * moment));
    kill(pid, SIGKILL);
    int status = 0;
    waitpid(pid, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the writer must die while writing";
    ASSERT_EQ(Count("SELECT COUNT(*) FROM run") * kCases, Count("SELECT COUNT(*) FROM result"));
    ASSERT_EQ(Count("SELECT COUNT(*) FROM run WHERE total = 0"), 0);
    ASSERT_EQ(Count("SELECT COUNT(*) FROM metric"), Count("SELECT COUNT(*) FROM result"));
    ASSERT_EQ(Count("SELECT COUNT(*) FROM pragma_integrity_check WHERE integrity_check <> 'ok'"),
              0);
  }
  const long before = Count("SELECT COUNT(*) FROM run");
  ASSERT_EQ(regression(), "") << "and the next run writes as if nothing had happened";
  EXPECT_EQ(Count("SELECT COUNT(*) FROM run"), before + 1);
}

TEST_F(HistoryTest, ComparesTwoRunsByStatusNumbersAndWitness) {
  Record(1e-9, "", Forces(1, 1));
  Record(4e-9, "", Forces(1, 1.5));
  const HistoryText text = CompareRuns(kFile, "last~1", "last");
  EXPECT_EQ(text.trouble, "");
  EXPECT_NE(text.text.find("1.00e-09 → 4.00e-09"), std::string::npos) << text.text;
  EXPECT_NE(text.text.find("×4"), std::string::npos);
  EXPECT_NE(text.text.find("simulation moved"), std::string::npos);
  EXPECT_NE(CompareRuns(kFile, "7", "last").trouble.find("no run '7'"), std::string::npos);
  EXPECT_NE(CompareRuns(kFile, "last~9", "last").trouble, "");
  EXPECT_NE(CompareRuns(kFile, "lastly", "last").trouble, "");
}

TEST_F(HistoryTest, StiffnessIsComparedWhereThereAreNoForces) {
  for (const double error : {1e-9, 4e-9}) {
    CaseResult result = AgreeingCase("model/stiffness", error);
    result.metrics.erase("simulated_vs_analytic.force_nrmse");
    result.metrics["simulated_vs_analytic.stiffness_entry"] = {error, 1e-4, true};
    RegressReport report = OneRun({result});
    ASSERT_EQ(AppendRun(kFile, {}, &report), "");
    EXPECT_EQ(report.cases[0].course.back(), error);
  }
  const HistoryText text = CompareRuns(kFile, "last~1", "last");
  EXPECT_NE(text.text.find("1.00e-09 → 4.00e-09"), std::string::npos) << text.text;
}

TEST_F(HistoryTest, ExportsOneLinePerMetricAndRun) {
  Record(1e-9, "a, \"b\"");
  const HistoryText csv = HistoryCsv(kFile);
  EXPECT_EQ(csv.trouble, "");
  EXPECT_EQ(csv.text.substr(csv.text.find('\n') + 1),
            "1,2026-01-31T02:00:00Z,\"a, \"\"b\"\"\",mbverify 0.1.0 build 0123abcd,model/case,"
            "as_expected,agree,0,1.5,1.25,51200,simulated_vs_analytic.force_nrmse,"
            "1.0000000000000001e-09,9.9999999999999995e-07,1,0\n");
}

TEST_F(HistoryTest, AForeignOrNewerFileIsRefusedAndLeftAlone) {
  Write(kFile, "this is not a database, but long enough to look at");
  RegressReport report = OneRun({AgreeingCase("model/case", 1e-9)});
  EXPECT_NE(AppendRun(kFile, {}, &report), "");
  EXPECT_EQ(Read(kFile), "this is not a database, but long enough to look at");
  std::filesystem::remove(kFile);
  Record(1e-9);
  {
    Database database(kFile, Database::Mode::kWrite);
    database.Run("PRAGMA user_version = 99");
    ASSERT_TRUE(database.ok());
  }
  EXPECT_NE(AppendRun(kFile, {}, &report).find("schema 99"), std::string::npos);
  EXPECT_NE(ListRuns("missing.sqlite").trouble, "");
}

TEST_F(HistoryTest, ARunOfTheSameIdIsEnteredOnce) {
  RegressReport first = OneRun({AgreeingCase("model/case", 1e-9), AgreeingCase("model/b", 1e-9)});
  first.run.uid = "night1";
  RegressReport again = OneRun({AgreeingCase("model/case", 2e-9)});
  again.run.uid = "night1";
  RegressReport other = OneRun({AgreeingCase("model/case", 3e-9)});
  other.run.uid = "night2";
  ASSERT_EQ(AppendRun(kFile, {{"model/case", Forces(1.0, 1.0)}}, &first), "");
  ASSERT_EQ(AcceptRun(kFile, "1", "", "meant").trouble, "");
  ASSERT_EQ(AppendRun(kFile, {{"model/case", Forces(1.0, 1.0)}}, &again), "");
  ASSERT_EQ(AppendRun(kFile, {}, &other), "");
  EXPECT_EQ(again.run.id, 1);
  EXPECT_EQ(other.run.id, 2);
  EXPECT_EQ(Count("SELECT COUNT(*) FROM run"), 2);
  EXPECT_EQ(Count("SELECT COUNT(*) FROM result"), 2);
  EXPECT_EQ(Count("SELECT COUNT(*) FROM golden"), 2);
  EXPECT_EQ(Count("SELECT COUNT(*) FROM accepted WHERE run = 1"), 2);
  EXPECT_EQ(other.cases.front().course, (std::vector<double>{2e-9, 3e-9}));
}

TEST_F(HistoryTest, FilesOfTheFirstSchemaGoOn) {
  Record(1e-9);
  {
    Database database(kFile, Database::Mode::kWrite);
    database.Run("DROP INDEX run_uid");
    database.Run("ALTER TABLE run DROP COLUMN uid");
    database.Run("ALTER TABLE run DROP COLUMN covers");
    database.Run("PRAGMA user_version = 1");
    ASSERT_EQ(database.trouble(), "");
  }
  EXPECT_EQ(ListRuns(kFile).trouble, "");
  EXPECT_EQ(CheckHistory(kFile), "");
  EXPECT_EQ(Record(2e-9).run.id, 2);
  EXPECT_EQ(Count("PRAGMA user_version"), kHistoryVersion);
}

// A scenario whose limit, file and program are stated.
RegressReport Judged(double nrmse, double limit, const std::string& turn,
                     const std::string& program = "mbverify 0.1.0 build 0123abcd") {
  CaseResult result = AgreeingCase("model/case", nrmse);
  result.metrics["simulated_vs_analytic.force_nrmse"] = {nrmse, limit, nrmse <= limit};
  if (nrmse > limit) result.status = CaseStatus::kUnexpected;
  result.inputs = turn;
  result.input_files = {{"models/model/model.yaml", "m"}, {"scenarios/model/turn.yaml", turn}};
  RegressReport report = OneRun({result, AgreeingCase("model/other", 1e-9)});
  report.run.program = program;
  EXPECT_EQ(AppendRun(kFile, {}, &report), "");
  return report;
}

TEST_F(HistoryTest, WhatFailsReportsWhatChangedSinceTheLastGoodRun) {
  Judged(3e-7, 1e-6, "old");
  EXPECT_EQ(Judged(3e-7, 1e-7, "old").cases.front().changes,
            Changes{"limit of drive force, RMS (simulated vs analytic) was 1e-06, is 1e-07"});
  // Against the good run, not against the last one.
  const RegressReport third = Judged(3e-7, 1e-7, "new", "mbverify 0.1.0 build 4567cdef");
  EXPECT_EQ(third.cases.front().changes,
            (Changes{"limit of drive force, RMS (simulated vs analytic) was 1e-06, is 1e-07",
                     "turn.yaml changed",
                     "program mbverify 0.1.0 build 0123abcd → mbverify 0.1.0 build 4567cdef"}));
  EXPECT_TRUE(third.cases.back().changes.empty()) << "it is as expected";
  const auto texts = FailureTexts(third.cases.front(), 1);
  EXPECT_NE(texts.back().find("changed since: limit of drive force"), std::string::npos);
  EXPECT_NE(ToJUnit(third).find("; turn.yaml changed; program mbverify"), std::string::npos);
  EXPECT_EQ(ReportFromJson(ToJson(third))->cases.front().changes, third.cases.front().changes);
  // It grew, and nothing that is known of it changed.
  EXPECT_EQ(Judged(3e-6, 1e-6, "old").cases.front().changes,
            Changes{"nothing in limits, input files, program or machine"});
}

TEST_F(HistoryTest, DriftReportsWhatChangedInTheRunItBegan) {
  for (int i = 0; i < 4; ++i) Judged(1e-9, 1e-6, "old");
  const RegressReport drifted = Judged(1e-7, 1e-6, "new");
  EXPECT_EQ(drifted.cases.front().changes, Changes{"turn.yaml changed"});
  EXPECT_TRUE(DriftLine(drifted.cases.front()).ends_with("; changed since: turn.yaml changed"));
  EXPECT_TRUE(Judged(1e-7, 1e-6, "new").cases.front().changes.empty()) << "it began before";
}

TEST_F(HistoryTest, CompareNamesWhatChangedBesideTheNumbers) {
  Judged(3e-7, 1e-6, "old");
  Judged(3e-7, 1e-7, "new", "mbverify 0.1.0 build 4567cdef");
  const std::string all = CompareRuns(kFile, "1", "2").text;
  for (const char* part :
       {"\n  program mbverify 0.1.0 build 0123abcd → mbverify 0.1.0 build 4567cdef\n",
        "as_expected → unexpected\n",
        "\n      drive force, RMS (simulated vs analytic): 3.00e-07 → 3.00e-07, limit 1.00e-07: "
        "FAIL\n",
        "\n      limit of drive force, RMS (simulated vs analytic) was 1e-06, is 1e-07\n",
        "\n      turn.yaml changed\n", "model/other", "same\n"}) {
    EXPECT_NE(all.find(part), std::string::npos) << part << "\n" << all;
  }
  const HistoryText changed = CompareRuns(kFile, "1", "2", /*only_changed=*/true);
  EXPECT_EQ(changed.text.find("model/other"), std::string::npos) << changed.text;
  EXPECT_NE(changed.text.find("model/case"), std::string::npos);
  EXPECT_NE(changed.text.find("1 scenario without a change"), std::string::npos) << changed.text;
  EXPECT_EQ(changed.json.find("simulated_vs_analytic"), std::string::npos) << changed.json;
  EXPECT_EQ(CompareRuns(kFile, "1", "1", true).text.find("model/case"), std::string::npos);
}

TEST_F(HistoryTest, RoundoffIsNoChange) {
  EXPECT_FALSE(IsOther(1e-15, 9e-14));
  EXPECT_FALSE(IsOther(1e-9, 1.005e-9));
  EXPECT_TRUE(IsOther(1e-9, 1.02e-9));
  EXPECT_TRUE(IsOther(kNan, 1.0));
  EXPECT_FALSE(IsOther(kNan, kNan));
}

// Version 3 did not keep which files were read: the comparison goes on without writing, and a run
// that is added takes the file over.
TEST_F(HistoryTest, AHistoryWithoutInputFilesIsComparedAndTakenOver) {
  Judged(3e-7, 1e-6, "old");
  Judged(3e-7, 1e-7, "new");
  {
    Database database(kFile, Database::Mode::kWrite);
    database.Run("DROP TABLE input_file");
    database.Run("PRAGMA user_version = 3");
    ASSERT_EQ(database.trouble(), "");
  }
  const HistoryText compared = CompareRuns(kFile, "1", "2");
  EXPECT_EQ(compared.trouble, "");
  EXPECT_NE(compared.text.find("an input file changed (which one is not in the history)"),
            std::string::npos)
      << compared.text;
  EXPECT_NE(compared.text.find("was 1e-06, is 1e-07"), std::string::npos);
  EXPECT_EQ(Count("PRAGMA user_version"), 3) << "reading changes nothing";
  EXPECT_EQ(Judged(3e-7, 1e-7, "newer").cases.front().changes.back(),
            "an input file changed (which one is not in the history)");
  EXPECT_EQ(Count("PRAGMA user_version"), kHistoryVersion);
  EXPECT_NE(CompareRuns(kFile, "2", "3").text.find("an input file changed"), std::string::npos);
  Judged(3e-7, 1e-7, "newest");
  EXPECT_NE(CompareRuns(kFile, "3", "4").text.find("turn.yaml changed"), std::string::npos);
}

// A regression over whole folders, of scenarios that agree.
RegressReport RegressionOf(const std::vector<std::string>& keys,
                           const std::vector<std::string>& covers = {""}) {
  std::vector<CaseResult> cases;
  cases.reserve(keys.size());
  for (const std::string& key : keys) cases.push_back(AgreeingCase(key, 1e-9));
  RegressReport report = OneRun(cases);
  report.run.covers = covers;
  EXPECT_EQ(AppendRun(kFile, {}, &report), "");
  return report;
}

std::vector<std::string> MissingOf(const RegressReport& report) {
  std::vector<std::string> keys;
  for (const MissingCase& missing : report.missing) keys.push_back(missing.key);
  return keys;
}

using Keys = std::vector<std::string>;

TEST_F(HistoryTest, AScenarioThatIsGoneIsMissingUntilItIsBack) {
  EXPECT_EQ(MissingOf(RegressionOf({"a/x", "a/y", "b/z"})), Keys{});
  const RegressReport second = RegressionOf({"a/x", "b/z"});
  ASSERT_EQ(MissingOf(second), Keys{"a/y"});
  EXPECT_EQ(second.missing[0].last_run, 1);
  EXPECT_NE(second.missing[0].when.find("run 1 of 2026-01-31"), std::string::npos);
  EXPECT_EQ(MissingOf(RegressionOf({"a/x", "b/z"})), Keys{"a/y"})
      << "not forgotten after one regression";
  EXPECT_EQ(MissingOf(RegressionOf({"a/x", "a/y", "b/z"})), Keys{});
  EXPECT_EQ(MissingOf(RegressionOf({"a/x", "a/y", "b/z"})), Keys{});
}

TEST_F(HistoryTest, ARunOfAPartMissesNothingElse) {
  RegressionOf({"a/x", "a/y", "b/z"});
  EXPECT_EQ(MissingOf(RegressionOf({"a/x"}, {"a/"})), Keys{"a/y"});
  EXPECT_EQ(MissingOf(RegressionOf({"a/x"}, {})), Keys{}) << "single files";
  RegressReport shard = OneRun({AgreeingCase("a/x", 1e-9)});
  shard.run.covers = {""};
  shard.run.shard = "1/2";
  ASSERT_EQ(AppendRun(kFile, {}, &shard), "");
  EXPECT_EQ(MissingOf(shard), Keys{});
  EXPECT_EQ(MissingOf(RegressionOf({"a/x", "a/y"})), Keys{"b/z"});
}

TEST_F(HistoryTest, WhatIsMissingCanBeAccepted) {
  RegressionOf({"a/x", "a/y", "b/z"});
  RegressionOf({"a/x"});
  EXPECT_NE(AcceptRun(kFile, "last", "a/none", "").trouble, "");
  const HistoryText accepted = AcceptRun(kFile, "last", "a/y", "renamed");
  EXPECT_EQ(accepted.trouble, "");
  EXPECT_NE(accepted.text.find("1 missing in it is meant to be"), std::string::npos);
  EXPECT_EQ(MissingOf(RegressionOf({"a/x"})), Keys{"b/z"});
  ASSERT_EQ(AcceptRun(kFile, "last", "", "").trouble, "");
  EXPECT_EQ(MissingOf(RegressionOf({"a/x"})), Keys{});
  RegressionOf({"a/x", "a/y"});
  EXPECT_EQ(MissingOf(RegressionOf({"a/x"})), Keys{"a/y"}) << "it came back, and went again";
}

TEST_F(HistoryTest, AFailureReportsWhenItWasLastAsExpected) {
  Record(1e-9);
  Record(2e-9, "good-one");
  const auto wrong = [] {
    CaseResult result = AgreeingCase("model/case", 1e-3);
    result.status = CaseStatus::kUnexpected;
    RegressReport report = OneRun({result});
    EXPECT_EQ(AppendRun(kFile, {}, &report), "");
    return report.cases.front().past;
  };
  const PastOfFailure first = wrong(), second = wrong();
  for (const PastOfFailure& past : {first, second}) {
    EXPECT_EQ(past.good_run, 2);
    EXPECT_NE(past.when.find("good-one"), std::string::npos);
    ASSERT_TRUE(past.values.contains("simulated_vs_analytic.force_nrmse"));
    EXPECT_EQ(past.values.at("simulated_vs_analytic.force_nrmse"), 2e-9);
  }
  EXPECT_EQ(first.runs, 2);
  EXPECT_EQ(second.runs, 3);
  EXPECT_EQ(Record(1e-9).cases.front().past.runs, 0) << "nothing to report of what is as expected";
}

TEST_F(HistoryTest, AnotherProgramsDatabaseIsLeftAlone) {
  {
    Database database(kFile, Database::Mode::kCreate);
    database.Run("CREATE TABLE run(a)");
  }
  RegressReport report = OneRun({AgreeingCase("model/case", 1e-9)});
  EXPECT_NE(AppendRun(kFile, {}, &report).find("another program's"), std::string::npos);
  EXPECT_NE(CheckHistory(kFile).find("another program's"), std::string::npos);
  EXPECT_EQ(Count("SELECT COUNT(*) FROM sqlite_master"), 1);
}

// On a medium that cannot be written, as another user.
TEST_F(HistoryTest, CanBeListedWhereItCannotBeWritten) {
  Record(1e-9);
  std::filesystem::create_directories("read only #1");
  std::filesystem::rename(kFile, "read only #1/history?.sqlite");
  const std::string path = (folder_ / "read only #1" / "history?.sqlite").string();
  std::filesystem::permissions("read only #1", std::filesystem::perms(0555));
  std::filesystem::permissions(path, std::filesystem::perms(0444));
  std::filesystem::permissions(folder_, std::filesystem::perms(0755));
  const pid_t pid = fork();
  if (pid == 0) {
    if (geteuid() == 0 && setuid(65534) != 0) _exit(9);
    const HistoryText runs = ListRuns(path);
    RegressReport report = OneRun({AgreeingCase("model/case", 1e-9)});
    const bool refused = !AppendRun(path, {}, &report).empty() && !CheckHistory(path).empty();
    const bool listed = runs.trouble.empty() && runs.text.find("1/1") != std::string::npos;
    _exit((listed ? 0 : 1) + (refused ? 0 : 2));
  }
  int status = 0;
  waitpid(pid, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
  std::filesystem::permissions("read only #1", std::filesystem::perms::owner_all);
}

}  // namespace
}  // namespace mbv
