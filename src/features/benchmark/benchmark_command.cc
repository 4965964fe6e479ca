// `mbverify benchmark` as a user types it.
#include <fmt/format.h>
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "base/inputs.h"
#include "base/json_text.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/benchmark/benchmark.h"
#include "features/engines/crosscheck.h"
#include "math/bytes.h"
#include "math/resume.h"
#include "scenario/find_model.h"
#include "scenario/load_scenario.h"
#include "verify/version.h"

namespace mbv {
namespace {

struct BenchmarkArguments {
  std::vector<std::string> paths, engines, suites;
  std::vector<double> steps;
  std::string out = "out", markdown;
  int jobs = AllCores();
  bool resume = false;
  JsonOption json;
};

// Those given, by path or as scenarios are named; else the shipped ones.
std::vector<std::string> PathsOf(const std::vector<std::string>& given) {
  std::vector<std::string> paths;
  std::ranges::transform(given, std::back_inserter(paths), FindScenario);
  if (paths.empty()) paths.push_back(FindScenario("benchmark"));
  return paths;
}

// By name, or NAME=COMMAND of a program of the user's; the judging ones always run. Empty after a
// message.
std::vector<BenchmarkEngine> EnginesOf(const std::vector<std::string>& words) {
  if (words.empty()) return BenchmarkEngines();
  std::vector<BenchmarkEngine> engines;
  std::vector<std::string> names;
  for (const BenchmarkEngine& engine : BenchmarkEngines()) {
    names.push_back(engine.name);
    if (engine.judges || Contains(words, engine.name)) engines.push_back(engine);
  }
  for (const std::string& word : words) {
    if (Contains(names, word)) continue;
    const auto named = SplitSet(word);
    if (!named) {
      (void)Refuse(fmt::format("--engine: there is no engine '{}'", word),
                   DidYouMean(word, names, "write NAME=COMMAND, or one of " + Joined(names)));
      return {};
    }
    engines.push_back({.name = named->first, .about = named->second, .command = named->second});
  }
  return engines;
}

// Of all that results depend on: versions, engines, cases and what they read.
std::string IdentityOf(const Benchmark& benchmark, const std::vector<InputFile>& inputs) {
  Fingerprint sum;
  for (const auto& [name, version] : Versions()) sum.Add(name + " " + version);
  for (const BenchmarkEngine& engine : benchmark.engines) {
    sum.Add(engine.name + "=" + engine.command);
  }
  for (const BenchmarkCase& one : benchmark.cases) sum.Add(one.name);
  for (const InputFile& input : inputs) sum.Add(input.fingerprint);
  return sum.Text();
}

// Each case in a process of its own: what one of them does harms no other. What `log` has of a run
// before is not computed again; behind a case that did not end by itself nothing is kept.
std::vector<BenchmarkResult> RunAll(const Benchmark& benchmark, double step_factor,
                                    const std::string& what, int jobs, ResultLog log) {
  constexpr double kLongestCase_s = 300.0;
  const std::vector<BenchmarkCase>& cases = benchmark.cases;
  std::vector<BenchmarkResult> results;
  while (results.size() < cases.size()) {
    auto kept = log.Kept<BenchmarkResult>();
    if (!kept) break;
    results.push_back(*std::move(kept));
  }
  const size_t first = results.size();
  bool keeps = true;
  ProgressLine progress(true);
  StreamFromChildren(
      cases.size() - first, {.parallel = jobs, .timeout_s = kLongestCase_s},
      [&](size_t k) {
        return ToBytes(RunBenchmarkCase(cases[first + k], benchmark.engines, step_factor));
      },
      [&](size_t k, const std::optional<std::string>& bytes) {
        const BenchmarkCase& one = cases[first + k];
        auto result = bytes ? FromBytes<BenchmarkResult>(*bytes) : std::nullopt;
        keeps = keeps && result;
        if (keeps) log.Keep(*result);
        if (!result) {
          result = BenchmarkResult{
              .name = one.name,
              .suite = one.suite,
              .title = one.title,
              .reason = fmt::format("ended by a crash, or not within {:g} s", kLongestCase_s)};
        }
        results.push_back(std::move(*result));
        progress.Show(what,
                      static_cast<double>(results.size()) / static_cast<double>(cases.size()));
        return true;
      });
  return results;
}

int RunBenchmark(const BenchmarkArguments& arguments) {
  Benchmark benchmark;
  Diagnostics diagnostics;
  const InputWatch watch;
  benchmark.cases = ReadBenchmarkCases(PathsOf(arguments.paths), &diagnostics);
  FindingPrinter(stderr).Print(diagnostics);
  if (diagnostics.has_errors()) return 2;
  std::vector<std::string> suites;
  for (const BenchmarkCase& one : benchmark.cases) {
    if (!Contains(suites, one.suite)) suites.push_back(one.suite);
  }
  for (const std::string& suite : arguments.suites) {
    if (Contains(suites, suite)) continue;
    return Refuse(fmt::format("--suite: there is no suite '{}'", suite),
                  DidYouMean(suite, suites, "suites: " + Joined(suites)));
  }
  if (!arguments.suites.empty()) {
    std::erase_if(benchmark.cases,
                  [&](const BenchmarkCase& one) { return !Contains(arguments.suites, one.suite); });
  }
  benchmark.engines = EnginesOf(arguments.engines);
  if (benchmark.engines.empty()) return 2;
  for (const BenchmarkCase& one : benchmark.cases) {
    if (!one.scenario.empty()) (void)LoadScenario(one.scenario);
  }
  ResumeFolder folder(std::filesystem::path(arguments.out) / "benchmark.part",
                      IdentityOf(benchmark, watch.files()));
  if (folder.taken()) {
    return Refuse("another process computes a benchmark there", "choose another folder with --out");
  }
  if (!arguments.resume) folder.Forget();
  if (folder.resumes()) Say(stderr, "goes on with what an interrupted run left\n");
  benchmark.results = RunAll(benchmark, 1.0, "cases", arguments.jobs, folder.Log("cases"));
  for (const double step : arguments.steps) {
    const std::string name = fmt::format("{:g} steps", step);
    benchmark.at_steps.emplace_back(
        step, RunAll(benchmark, step, name, arguments.jobs, folder.Log(name)));
  }
  const std::string json = arguments.json.Text(ToJson(benchmark));
  std::vector<std::pair<std::string, std::string>> files = {{"benchmark.html", ToHtml(benchmark)},
                                                            {"errors.csv", ErrorsCsv(benchmark)},
                                                            {"cost.csv", CostCsv(benchmark)},
                                                            {"tables.tex", ToLatex(benchmark)},
                                                            {"benchmark.json", json}};
  for (size_t k = 0; k < benchmark.cases.size(); ++k) {
    const std::string name = "cases/" + benchmark.cases[k].name;
    files.emplace_back(name + ".html", CasePage(benchmark, k));
    files.emplace_back(name + ".csv", CaseCsv(benchmark, k));
  }
  std::FILE* to = arguments.json.text();
  SayText(to, ToText(benchmark, WantsColor(to), TerminalColumns(to)));
  OutputFolder target(arguments.out, "benchmark");
  if (const std::string trouble = target.WriteAll(files); !trouble.empty()) {
    return NotWritten(trouble, "choose another folder with --out");
  }
  Say(stderr, "results in {}\n", target.target().string());
  int exit_code = WorseExit(benchmark.exit_code(), arguments.json.Write(json, {}));
  if (!arguments.markdown.empty()) {
    exit_code = WorseExit(exit_code, WriteWholeFile(arguments.markdown, ToMarkdown(benchmark), {}));
  }
  return exit_code;
}

}  // namespace

void AddBenchmarkCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<BenchmarkArguments>();
  CLI::App* benchmark = app->add_subcommand(
      "benchmark",
      "Engines on published cases of closed loops: who meets the numbers, at what cost");
  benchmark->add_option("cases", arguments->paths,
                        "case.yaml files or folders of them; the shipped ones if left out");
  benchmark
      ->add_option("--engine", arguments->engines,
                   "an engine by name, or NAME=COMMAND (repeatable), see "
                   "docs/how-to/external_solvers.md; all if left out. Those that judge always run")
      ->allow_extra_args(false);
  benchmark->add_option("--suite", arguments->suites, "only the cases of this suite (repeatable)")
      ->allow_extra_args(false);
  benchmark
      ->add_option("--steps", arguments->steps,
                   "work and precision: again at these multiples of each scenario's step")
      ->delimiter(',')
      ->check(Positive());
  benchmark->add_option("--out", arguments->out, "folder for results")->capture_default_str();
  benchmark->add_flag("--resume", arguments->resume, "go on with what an interrupted run left");
  benchmark->add_option("--jobs", arguments->jobs, "cases at once")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  benchmark->add_option("--markdown", arguments->markdown, "writes all tables to this file");
  arguments->json.AddTo(benchmark);
  SetFooter(benchmark,
            {"benchmark", "benchmark --suite modelica --engine simbody",
             "benchmark my_cases --engine 'mine=python3 my_engine.py' --steps 4,2,0.5"},
            "0 every case ends as it states, 1 one does not, 2 bad input, 3 none could run");
  benchmark->callback([arguments, exit_code] { *exit_code = RunBenchmark(*arguments); });
}

}  // namespace mbv
