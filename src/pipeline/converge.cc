#include "pipeline/converge.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "input/parsed_documents.h"
#include "mechanism/break_times.h"
#include "pipeline/computed_once.h"
#include "pipeline/drive_by.h"
#include "pipeline/run_witnesses.h"
#include "scenario/settings_reader.h"

namespace mbv {
namespace {

// Samples this many of the coarsest steps after a break count as near it: three times the history
// that the multistep formulas rebuild there.
constexpr double kWindowSteps = 12.0;
// Time constants in steps, halved.
constexpr std::array<double, 5> kCorrectedConstants = {400, 200, 100, 50, 25};
constexpr std::array<double, 5> kStockConstants = {32, 16, 8, 4, 2};

struct SteppedRun {
  ConvergencePoint point;
  MatX forces;  // empty if it failed
};

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
      : file_(file), options_(options) {}

  ConvergeOutcome Run() {
    if (!Load()) {
      outcome_.exit_code = 2;
      return std::move(outcome_);
    }
    ChooseSamples();
    if (!RunTruth()) return std::move(outcome_);
    RunCorrected();
    if (outcome_.failure.empty()) {
      RunStock();
      outcome_.exit_code = report().finding() ? 1 : 0;
    }
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
      TellThatDrivesAreHeld();
      return true;
    }
    outcome_.diagnostics.Add(std::move(finding));
    return false;
  }

  void TellThatDrivesAreHeld() {
    const SimulationSettings& settings = prepared_->scenario.simulation;
    if (!settings.forward || settings.drive_by == DriveBy::kMotion) return;
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
    SimulatedWitness inverse = Simulate({.mode = SimulationMode::kInverse}, "inverse mode");
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

  // The driven motion is computed once for all runs, at each instant that one of them asks for.
  SimulatedWitness Simulate(const SimulationOptions& options, const std::string& what) {
    const WitnessRunner runner(*prepared_, {.driven = driven_.Of(prepared_->MakeDrivenMotion())},
                               options_.progress);
    return runner.Simulate(options, what);
  }

  SteppedRun RunForward(const ConvergenceSeries& series, double step_s, double constant_steps) {
    SimulationOptions options{.engine = series.stock ? Engine::kStock : Engine::kCorrected,
                              .step_s = step_s};
    (series.stock ? options.stock_time_constant_steps : options.guidance_steps) = constant_steps;
    const SimulatedWitness witness =
        Simulate(options, fmt::format("{}, step {:g} s", series.title, step_s));
    SteppedRun run;
    run.point.step_s = step_s;
    run.point.time_constant_s = constant_steps * step_s;
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

  // Runs (step, time constant in steps) from coarse to fine; the forces of each run.
  std::vector<MatX> AddSeries(ConvergenceSeries series,
                              const std::vector<std::pair<double, double>>& grid) {
    std::vector<MatX> forces;
    for (const auto& [step_s, constant_steps] : grid) {
      SteppedRun run = RunForward(series, step_s, constant_steps);
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

  void RunCorrected() {
    const std::vector<double>& steps = options_.steps_s;
    const double kUsual = SimulationOptions{}.guidance_steps;
    const std::vector<MatX> forces = AddSeries(
        {.name = "corrected_both",
         .title = fmt::format("corrected engine, step and time constant = {:g} steps", kUsual)},
        Both(kUsual));
    const ConvergenceSeries& series = report().series.back();
    const auto ran = std::count_if(series.points.begin(), series.points.end(),
                                   [](const ConvergencePoint& p) { return p.failure.empty(); });
    if (ran < 3) {
      Fail("the corrected engine gave forces at fewer than three steps; " + series.notes.back());
      return;
    }
    report().extrapolation =
        ExtrapolateForces(mechanism(), series, forces, truth_forces_, classes_);
    AddSeries({.name = "corrected_step",
               .title = fmt::format("corrected engine, step at time constant {:g} s",
                                    kUsual * steps.front()),
               .knob = Knob::kStep},
              StepAlone(kUsual));
    AddConstants("corrected", false, steps[steps.size() / 2], kCorrectedConstants);
  }

  void RunStock() {
    const std::vector<double>& steps = options_.steps_s;
    const double kUsual = SimulationOptions{}.stock_time_constant_steps;
    AddSeries({.name = "stock_both",
               .title = fmt::format("stock engine, step and time constant = {:g} steps", kUsual),
               .stock = true},
              Both(kUsual));
    AddSeries(
        {.name = "stock_step",
         .title = fmt::format("stock engine, step at time constant {:g} s", kUsual * steps.front()),
         .stock = true,
         .knob = Knob::kStep},
        StepAlone(kUsual));
    AddConstants("stock", true, steps.back(), kStockConstants);
  }

  void AddConstants(const std::string& engine, bool stock, double step_s,
                    const std::array<double, 5>& constants) {
    std::vector<std::pair<double, double>> grid;
    for (const double constant : constants) grid.emplace_back(step_s, constant);
    AddSeries({.name = engine + "_time_constant",
               .title = fmt::format("{} engine, time constant at step {:g} s", engine, step_s),
               .stock = stock,
               .knob = Knob::kTimeConstant},
              grid);
  }

  [[nodiscard]] std::vector<std::pair<double, double>> Both(double constant_steps) const {
    std::vector<std::pair<double, double>> grid;
    for (const double h : options_.steps_s) grid.emplace_back(h, constant_steps);
    return grid;
  }
  [[nodiscard]] std::vector<std::pair<double, double>> StepAlone(double constant_steps) const {
    std::vector<std::pair<double, double>> grid;
    for (const double h : options_.steps_s) {
      grid.emplace_back(h, constant_steps * options_.steps_s.front() / h);
    }
    return grid;
  }

  const std::string file_;
  const ConvergeOptions& options_;
  ConvergeOutcome outcome_;
  std::optional<Prepared> prepared_;
  ComputedOnce<DrivenSample> driven_{1e12};  // by time in ps
  SampleClasses classes_;
  Trace truth_;
  MatX truth_forces_;
  double extent_m_ = 0.0;  // largest coordinate of an output
};

}  // namespace

Diagnostics Check(const ConvergeOptions& options) {
  Diagnostics diagnostics;
  const auto require = [&](bool holds, const std::string& rule) {
    if (!holds) diagnostics.Add({.file = "--steps", .message = rule, .hint = {}});
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

}  // namespace mbv
