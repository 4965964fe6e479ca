#include "features/convergence/converge.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <memory>
#include <numeric>
#include <optional>

#include "base/output_folder.h"
#include "base/worker_pool.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "math/bytes.h"
#include "mechanism/motion.h"
#include "model_file/yaml/yaml_reader.h"
#include "scenario/find_model.h"
#include "scenario/section_readers.h"
#include "simulation/engine/simulation.h"
#include "verify/computed_once.h"
#include "verify/drive_by.h"
#include "verify/run_witnesses.h"
#include "verify/version.h"

namespace mbv {

namespace {

// Samples this many of the coarsest steps after a break count as near it: three times the history
// that the multistep formulas rebuild there.
constexpr double kWindowSteps = 12.0;
struct SteppedRun {
  ConvergencePoint point;
  MatX forces;  // empty if it failed
};
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<SteppedRun>& run) {
  auto& point = run.point;
  visit(point.step_s), visit(point.time_constant_s), visit(point.steps), visit(point.cpu_s);
  visit(point.closure_m), visit(point.pose_m), visit(point.error.smooth);
  visit(point.error.breaks), visit(point.failure), visit(run.forces);
}

SteppedRun Lost(const PlannedRun& planned, std::string why) {
  SteppedRun run;
  run.point.step_s = planned.step_s;
  run.point.time_constant_s = planned.constant_steps * planned.step_s;
  run.point.failure = std::move(why);
  return run;
}

MatX OutputPositions(const Output& output, const Trace& trace) {
  MatX positions(trace.values.rows(), 3);
  for (int c = 0; c < 3; ++c) {
    positions.col(c) = trace.values.col(trace.Find(Quantity::kPose, output.name, c));
  }
  return positions;
}

// Largest distance of an output between two traces, smooth samples only [m].
double PoseError(const Mechanism& mechanism, const Trace& a, const Trace& b,
                 const SampleClasses& classes) {
  double largest = kNan;
  for (const Output& output : mechanism.outputs) {
    const MatX difference = OutputPositions(output, a) - OutputPositions(output, b);
    for (Eigen::Index i = 0; i < difference.rows(); ++i) {
      if (classes.near_break[static_cast<size_t>(i)]) continue;
      largest = std::fmax(largest, difference.row(i).norm());
    }
  }
  return largest;
}

class StepStudy {
 public:
  StepStudy(const std::string& file, const ConvergeOptions& options)
      : file_(file), options_(options), planned_(options.steps_s) {}

  ConvergeOutcome Run() {
    if (!Load()) {
      outcome_.exit_code = 2;
      return std::move(outcome_);
    }
    ChooseSamples();
    if (!RunTruth()) return std::move(outcome_);
    ComputeDrivenMotion();
    cost_ = CostOf(planned_.UsualRefinement()) + CostOf(planned_.Others());
    RunCorrected();
    if (outcome_.failure.empty()) {
      AddSeries(planned_.Others());
      outcome_.exit_code = report().finding() ? 1 : 0;
    }
    // What a killed run would have shown is not known: that is no good end.
    if (!lost_.empty()) Fail(fmt::format("killed: the process of {}", fmt::join(lost_, "; ")));
    return std::move(outcome_);
  }

 private:
  ConvergenceReport& report() { return outcome_.report; }
  [[nodiscard]] const Motion& motion() const { return prepared_->scenario.motion; }
  [[nodiscard]] const Mechanism& mechanism() const { return prepared_->base; }

  bool Load() {
    outcome_.diagnostics = Check(options_);
    if (outcome_.diagnostics.has_errors()) return false;
    prepared_ = Prepare(file_, options_.scenario, &outcome_.diagnostics);
    if (!prepared_) return false;
    Finding finding;
    finding.file = file_;
    if (motion().free()) {
      finding.message = "a free motion has no drive forces that could converge";
    } else if (mechanism().drives.empty()) {
      finding.message = "the mechanism has no drive whose force could converge";
    } else if (!(motion().duration_s / options_.steps_s.back() <= kMaxSteps)) {
      finding.message = fmt::format("--steps: {:g} s violates motion.duration_s / step <= {:g}",
                                    options_.steps_s.back(), kMaxSteps);
    } else {
      ReportHeldDrives();
      return true;
    }
    outcome_.diagnostics.Add(std::move(finding));
    return false;
  }

  void ReportHeldDrives() {
    const SimulationSettings& settings = prepared_->scenario.simulation;
    if (PrescribesMotion(settings.mode)) return;
    Finding finding;
    finding.severity = Severity::kWarning;
    finding.file = file_;
    finding.message = fmt::format(
        "mode {}: what is refined is the simulation with its drives held on their motion",
        ModeText(settings));
    outcome_.diagnostics.Add(std::move(finding));
  }

  // All runs are sampled at the same times, which lie on steps of every run.
  void ChooseSamples() {
    Motion& m = prepared_->scenario.motion;
    const double coarsest = options_.steps_s.front();
    m.sample_s = coarsest * std::ceil(m.sample_s / coarsest - 1e-9);
    m.duration_s = m.sample_s * std::max(1.0, std::floor(m.duration_s / m.sample_s + 1e-9));
    std::vector<double> breaks = BreakTimes(m);
    std::erase_if(breaks, [&](double t) { return t <= 0.0 || t >= m.duration_s; });
    breaks.erase(std::unique(breaks.begin(), breaks.end()), breaks.end());
    report().scenario = prepared_->scenario.name;
    report().mechanism = mechanism().name;
    report().sample_s = m.sample_s;
    report().duration_s = m.duration_s;
    report().breaks = breaks.size();
    const std::vector<double> times = SampleTimes(m.duration_s, m.sample_s);
    classes_ = SampleClasses(times, breaks, kWindowSteps * coarsest);
    report().samples = times.size();
    report().smooth_samples = classes_.smooth();
    report().window_s = classes_.window_s;
  }

  // Inverse mode, which has neither step nor time constant.
  bool RunTruth() {
    SimulatedWitness inverse =
        Simulate({.mode = DriveMode::kInverse}, "inverse mode", &driven_, {});
    if (!inverse.run.summary.ok()) return Fail("inverse mode: " + inverse.run.summary.message);
    truth_ = std::move(inverse.run.trace);
    truth_forces_ = DriveForceTable(mechanism(), truth_);
    for (const Output& output : mechanism().outputs) {
      const MatX positions = OutputPositions(output, truth_);
      extent_m_ = std::max(extent_m_, positions.cwiseAbs().maxCoeff());
    }
    return true;
  }

  bool Fail(const std::string& why) {
    outcome_.failure = why;
    outcome_.exit_code = 3;
    return false;
  }

  SimulatedWitness Simulate(const SimulationOptions& options, const std::string& what,
                            ComputedOnce<DrivenSample>* driven, const ProgressFunction& progress) {
    const WitnessRunner runner(*prepared_, {.driven = driven->Of(prepared_->MakeDrivenMotion())},
                               progress);
    return runner.Simulate(options, what);
  }

  // The driven motion at the steps of the finest runs, which all runs share: once, and in order, as
  // what a solver finds depends in its last digits on where it comes from.
  void ComputeDrivenMotion() {
    const double h = options_.steps_s.back();
    const auto driven = driven_.Of(prepared_->MakeDrivenMotion());
    DrivenSample sample;
    for (long n = 0; static_cast<double>(n) * h <= motion().duration_s * (1.0 + kEps); ++n) {
      if (!driven(static_cast<double>(n) * h, &sample).ok()) return;  // the runs report it
    }
  }

  SteppedRun RunForward(const PlannedRun& planned, const ProgressFunction& progress) {
    SimulationOptions options{.engine = planned.stock ? Engine::kStock : Engine::kCorrected,
                              .step_s = planned.step_s};
    (planned.stock ? options.stock_time_constant_steps : options.guidance_steps) =
        planned.constant_steps;
    // What one run asks for in addition is its own: no run depends on those before it.
    ComputedOnce<DrivenSample> driven = driven_;
    const SimulatedWitness witness = Simulate(options, planned.title, &driven, progress);
    SteppedRun run = Lost(planned, "");
    if (witness.diagnostics.has_errors()) {
      run.point.failure = witness.diagnostics.findings().front().message;
    } else if (!witness.run.summary.ok()) {
      run.point.failure = witness.run.summary.message;
    }
    if (!run.point.failure.empty()) return run;
    const Trace& trace = witness.run.trace;
    run.forces = DriveForceTable(mechanism(), trace);
    run.point.steps = witness.run.steps;
    run.point.cpu_s = witness.run.loop_cpu_s;
    run.point.error = Error(run.forces - truth_forces_);
    run.point.pose_m = PoseError(mechanism(), trace, truth_, classes_);
    if (const int gap = trace.Find(Quantity::kLoopGap); gap >= 0) {
      run.point.closure_m = trace.values.col(gap).maxCoeff();
    }
    return run;
  }

  ErrorPair Error(const MatX& difference) const {
    return RelativeError(mechanism(), difference, truth_forces_, classes_);
  }

  // All runs of these series, the longest ones first: shared out to processes, they end at about
  // the same time.
  std::vector<SteppedRun> RunAll(const std::vector<PlannedSeries>& all) {
    const std::vector<PlannedRun> runs = RunsOf(all);
    std::vector<size_t> order(runs.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return runs[a].cost() > runs[b].cost(); });
    std::vector<SteppedRun> done(runs.size());
    const auto work = [&](size_t k) {
      const PlannedRun& run = runs[order[k]];
      const double before = done_;
      const std::string bytes = ToBytes(RunForward(run, [&](const std::string&, double fraction) {
        done_ = before;
        ReportProgress(run, fraction);
      }));
      done_ = before;
      return bytes;
    };
    ShareOut(order.size(), options_.jobs, work,
             [&](size_t k, const std::optional<std::string>& bytes) {
               const PlannedRun& run = runs[order[k]];
               auto ended = bytes ? FromBytes<SteppedRun>(*bytes) : std::nullopt;
               if (!ended) lost_.push_back(run.title);
               done[order[k]] = std::move(ended).value_or(Lost(run, "its process was killed"));
               ReportProgress(run, 1.0);
             });
    return done;
  }

  // A part of a run is done.
  void ReportProgress(const PlannedRun& run, double fraction) {
    done_ += fraction * run.cost();
    if (options_.progress) options_.progress(run.title, std::min(1.0, done_ / cost_));
  }

  std::vector<MatX> AddSeries(const std::vector<PlannedSeries>& all) {
    std::vector<SteppedRun> runs = RunAll(all);
    std::vector<MatX> forces;
    size_t next = 0;
    for (const PlannedSeries& planned : all) {
      const auto first = runs.begin() + static_cast<std::ptrdiff_t>(next);
      next += planned.grid.size();
      forces = AddRuns(
          planned.series,
          {std::make_move_iterator(first),
           std::make_move_iterator(first + static_cast<std::ptrdiff_t>(planned.grid.size()))});
    }
    return forces;
  }

  // Runs from coarse to fine; the forces of each.
  std::vector<MatX> AddRuns(ConvergenceSeries series, std::vector<SteppedRun> runs) {
    std::vector<MatX> forces;
    for (SteppedRun& run : runs) {
      if (!forces.empty() && forces.back().size() > 0 && run.forces.size() > 0) {
        run.point.change = Error(run.forces - forces.back());
      }
      series.points.push_back(std::move(run.point));
      forces.push_back(std::move(run.forces));
    }
    series.extent_m = extent_m_;
    Judge(classes_, &series);
    report().series.push_back(std::move(series));
    return forces;
  }

  // The corrected engine's usual refinement, without which the rest says nothing.
  void RunCorrected() {
    const std::vector<MatX> forces = AddSeries(planned_.UsualRefinement());
    const ConvergenceSeries& series = report().series.back();
    const auto ran = std::count_if(series.points.begin(), series.points.end(),
                                   [](const ConvergencePoint& p) { return p.failure.empty(); });
    if (ran < 3) {
      Fail("the corrected engine gave forces at fewer than three steps; " + series.notes.back());
      return;
    }
    report().extrapolation =
        ExtrapolateForces(mechanism(), series, forces, truth_forces_, classes_);
  }

  const std::string file_;
  const ConvergeOptions& options_;
  const ConvergencePlan planned_;
  ConvergeOutcome outcome_;
  std::optional<Prepared> prepared_;
  ComputedOnce<DrivenSample> driven_{1e12};  // by time in ps
  SampleClasses classes_;
  Trace truth_;
  MatX truth_forces_;
  double extent_m_ = 0.0;           // largest coordinate of an output
  double done_ = 0.0, cost_ = 1.0;  // of all runs
  std::vector<std::string> lost_;   // titles of the runs whose process was killed
};

}  // namespace

Diagnostics Check(const ConvergeOptions& options) {
  Diagnostics diagnostics;
  const auto require = [&](bool holds, const std::string& rule) {
    if (!holds) diagnostics.Add({.file = "--steps", .message = rule});
  };
  const std::vector<double>& steps = options.steps_s;
  require(steps.size() >= 3, fmt::format("{} steps violate at least 3 steps", steps.size()));
  for (const double h : steps) {
    require(h > 0.0 && h <= 1.0, fmt::format("{:g} s violates 0 < step <= 1 s", h));
  }
  if (diagnostics.has_errors()) return diagnostics;
  const double factor = std::round(steps[0] / steps[1]);
  for (size_t i = 1; i < steps.size(); ++i) {
    const double ratio = steps[i - 1] / steps[i];
    require(factor >= 2.0 && std::abs(ratio - factor) < 1e-9 * factor,
            fmt::format("{:g} s after {:g} s violates: each step is a whole fraction of the one "
                        "before, always the same",
                        steps[i], steps[i - 1]));
  }
  return diagnostics;
}

ConvergeOutcome Converge(const std::string& file, const ConvergeOptions& options) {
  const ParsedDocuments documents;
  return StepStudy(file, options).Run();
}

namespace {

// Time constants in steps, halved.
constexpr std::array<double, 5> kCorrectedConstants = {400, 200, 100, 50, 25};
constexpr std::array<double, 5> kStockConstants = {32, 16, 8, 4, 2};

PlannedSeries OverConstants(const std::string& engine, bool stock, double step_s,
                            const std::array<double, 5>& constants) {
  PlannedSeries planned;
  planned.series = {.name = engine + "_time_constant",
                    .title = fmt::format("{} engine, time constant at step {:g} s", engine, step_s),
                    .stock = stock,
                    .knob = Knob::kTimeConstant};
  for (const double constant : constants) planned.grid.emplace_back(step_s, constant);
  return planned;
}

}  // namespace

std::vector<PlannedRun> RunsOf(const std::vector<PlannedSeries>& all) {
  std::vector<PlannedRun> runs;
  for (const PlannedSeries& planned : all) {
    for (const auto& [step_s, constant_steps] : planned.grid) {
      runs.push_back({fmt::format("{}, step {:g} s", planned.series.title, step_s),
                      planned.series.stock, step_s, constant_steps});
    }
  }
  return runs;
}

double CostOf(const std::vector<PlannedSeries>& all) {
  double cost = 0.0;
  for (const PlannedRun& run : RunsOf(all)) cost += run.cost();
  return cost;
}

std::vector<PlannedSeries> ConvergencePlan::UsualRefinement() const {
  const double usual = SimulationOptions{}.guidance_steps;
  return {{{.name = "corrected_both",
            .title = fmt::format("corrected engine, step and time constant = {:g} steps", usual)},
           Both(usual)}};
}

std::vector<PlannedSeries> ConvergencePlan::Others() const {
  const double guidance = SimulationOptions{}.guidance_steps;
  const double stock = SimulationOptions{}.stock_time_constant_steps;
  return {{{.name = "corrected_step",
            .title = fmt::format("corrected engine, step at time constant {:g} s",
                                 guidance * steps_s_.front()),
            .knob = Knob::kStep},
           StepAlone(guidance)},
          OverConstants("corrected", false, steps_s_[steps_s_.size() / 2], kCorrectedConstants),
          {{.name = "stock_both",
            .title = fmt::format("stock engine, step and time constant = {:g} steps", stock),
            .stock = true},
           Both(stock)},
          {{.name = "stock_step",
            .title =
                fmt::format("stock engine, step at time constant {:g} s", stock * steps_s_.front()),
            .stock = true,
            .knob = Knob::kStep},
           StepAlone(stock)},
          OverConstants("stock", true, steps_s_.back(), kStockConstants)};
}

ConvergencePlan::Grid ConvergencePlan::Both(double constant_steps) const {
  Grid grid;
  for (const double h : steps_s_) grid.emplace_back(h, constant_steps);
  return grid;
}

ConvergencePlan::Grid ConvergencePlan::StepAlone(double constant_steps) const {
  Grid grid;
  for (const double h : steps_s_) grid.emplace_back(h, constant_steps * steps_s_.front() / h);
  return grid;
}

// mbverify converge

namespace {

struct ConvergeArguments {
  std::string scenario, out = "out";
  std::vector<double> steps_s = ConvergeOptions{}.steps_s;
  std::vector<std::string> set;
  int jobs = 1;
  JsonOption json;
};

// "" or what went wrong.
std::string WriteFolder(const std::string& out, const ConvergenceReport& report,
                        const std::string& inputs) {
  OutputFolder folder(out, report.mechanism + "/convergence/" + report.scenario);
  std::vector<std::pair<std::string, std::string>> files = {
      {"converge.json", ToJson(report)}, {"converge.csv", ToCsv(report)}, {"inputs.json", inputs}};
  for (auto& plot : ConvergencePlots(report)) files.push_back(std::move(plot));
  std::string trouble = folder.WriteAll(files);
  if (trouble.empty()) Say(stderr, "results in {}\n", folder.target().string());
  return trouble;
}

int RunConverge(const ConvergeArguments& arguments) {
  ConvergeOptions options;
  options.steps_s = arguments.steps_s;
  options.jobs = arguments.jobs;
  if (!ReadAssignments(arguments.set, "--set", "parameters.link_mass=0.5", &options.scenario.set))
    return 2;
  ProgressLine progress(true);
  if (progress.active()) {
    options.progress = [&](const std::string& what, double fraction) {
      progress.Show(what, fraction);
    };
  }
  if (const int code = RefuseInput(arguments.json.path(), arguments.scenario); code != 0)
    return code;
  const InputWatch inputs;
  const ConvergeOutcome outcome = Converge(FindScenario(arguments.scenario), options);
  progress.Clear();
  SayText(stderr, outcome.diagnostics.Text());
  if (outcome.exit_code == 3) Say(stderr, "error: could not run: {}\n", outcome.failure);
  if (outcome.exit_code > 1) return outcome.exit_code;
  SayText(arguments.json.text(), ToText(outcome.report));
  std::fflush(stdout);
  if (const std::string trouble = WriteFolder(arguments.out, outcome.report,
                                              InputsJson(inputs.files(), options.scenario.set));
      !trouble.empty()) {
    return NotWritten(trouble, "choose another folder with --out");
  }
  return WorseExit(outcome.exit_code, arguments.json.Write(ToJson(outcome.report), {}));
}

}  // namespace

void AddConvergeCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<ConvergeArguments>();
  arguments->jobs = AllCores();
  CLI::App* converge = app->add_subcommand(
      "converge", "Refine step and constraint time constant: is the order that of the scheme?");
  converge->add_option("scenario", arguments->scenario, "scenario file with a motion")->required();
  converge
      ->add_option("--steps", arguments->steps_s,
                   "steps in s, each the same whole fraction of the one before")
      ->delimiter(',')
      ->capture_default_str();
  converge->add_option("--set", arguments->set, "replace a value of the scenario: KEY=VALUE");
  converge->add_option("--jobs", arguments->jobs, "processes at once")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  converge->add_option("--out", arguments->out, "folder for results")->capture_default_str();
  arguments->json.AddTo(converge);
  SetFooter(converge,
            {"converge scenarios/slider_crank/turn.yaml --steps 0.004,0.002,0.001,0.0005"},
            "0 orders as expected, 1 a finding, 2 bad input, 3 could not run");
  converge->callback([arguments, exit_code] { *exit_code = RunConverge(*arguments); });
}

}  // namespace mbv
