// Whole regressions with a fake worker: what it does is written in the scenario's file name.
#pragma once

#include <sys/wait.h>

#include <algorithm>
#include <string>

#include "base/inputs.h"
#include "features/regress/regress.h"
#include "tests/features/regress/regress_fixture.h"

namespace mbv {

// worker run FILE --out DIR [--no-pictures]
inline constexpr const char* kWorker = R"sh(#!/bin/sh
name=$(basename "$2" .yaml)
echo "$name" >> calls.txt
result() {
  mkdir -p "$dir/m/$name"
  echo "{\"verdict\": \"$1\", \"reason\": \"made up\", \"exit_code\": $2, \"witnesses\":
    [{\"name\": \"analytic\", \"ran\": true}], \"counts\": {\"pairs_compared\": 1}, \"checks\":
    [{\"name\": \"simulated_vs_analytic.force_nrmse\", \"value\": 1e-9, \"limit\": 1e-6,
    \"pass\": true}, {\"name\": \"simulated.closure_m\", \"value\": 1, \"limit\": 0.1,
    \"pass\": false}], \"versions\": {\"mbverify\": \"0.1.0\"}, \"regression\": \"$(cat regression.txt)\"}" > "$dir/m/$name/summary.json"
  printf 'time_s,leg.force.analytic\n0,1\n1,2\n' > "$dir/m/$name/traces.csv"
  echo "{\"inputs\": [{\"file\": \"$file\", \"fingerprint\": \"$(cat "$file.print")\"},
    {\"file\": \"table.csv\", \"fingerprint\": \"$(cat table.print)\"}]}" > "$dir/m/$name/inputs.json"
  cp regression.txt "$dir/m/$name/regression.txt"
}
dir=$4
file=$2
case $name in
  agree*) result agree 0; echo "all is well"; exit 0;;
  disagree*) result disagree 1; echo "mass is wrong"; exit 1;;
  not_run*) result not_run 3; echo "out of reach"; exit 3;;
  bad*) echo "x.yaml:1: error: bad input" >&2; exit 2;;
  crash*) result agree 0; kill -SEGV $$; sleep 5;;
  hang*) sleep 60 & sleep 60;;
  internal*) echo "internal error: demand failed" >&2; exit 4;;
  silent*) exit 0;;
esac
)sh";

class RegressTest : public FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    Write("worker", kWorker);
    std::filesystem::permissions("worker", std::filesystem::perms::owner_all);
    options_.out = "out";
    options_.worker = {(folder_ / "worker").string()};
    options_.jobs = 2;
    options_.timeout_s = 20.0;
    Table("t,f");
    Write("regression.txt", "1");
  }
  // Adds a scenario of the fake model m; the worker says that it read it, and table.csv.
  static void Scenario(const std::string& name, const std::string& expect = "verdict: agree") {
    const std::string file = "scenarios/m/" + name + ".yaml";
    const std::string text = "mechanism: m\ndescription: made up\nexpect: {" + expect + "}\n";
    Write(file, text);
    Write(file + ".print", ContentFingerprint(text));
  }
  static void Table(const std::string& text) {
    Write("table.csv", text);
    Write("table.print", ContentFingerprint(text));
  }
  RegressOutcome RunAll() const { return Regress(options_, {}); }
  static const CaseResult& CaseOf(const RegressOutcome& outcome, const std::string& key) {
    for (const CaseResult& result : outcome.report.cases) {
      if (result.key == key) return result;
    }
    ADD_FAILURE() << "no case " << key;
    return outcome.report.cases.front();
  }
  static int Calls() {
    const std::string calls = Read("calls.txt");
    return static_cast<int>(std::count(calls.begin(), calls.end(), '\n'));
  }
  RegressOptions options_;
};

}  // namespace mbv
