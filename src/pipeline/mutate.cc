#include "pipeline/mutate.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "pipeline/mutation_bench.h"
#include "pipeline/mutation_reason.h"
#include "pipeline/structural_faults.h"

namespace mbv {
namespace {

// The check that shows a bend best: largest value over limit among those that the bend moves.
struct Best {
  const CheckResult* check = nullptr;
  double ratio = 0.0;  // value over limit
};

Best BestOf(const MutationBench& bench, const BentRun& run) {
  Best best;
  for (const CheckResult& check : run.comparison.checks) {
    if (!check.limit) continue;
    if (check.value <= MutationBench::Visible(bench.base().ValueOf(check.name))) continue;
    const double ratio = std::isnan(check.value) ? std::numeric_limits<double>::infinity()
                                                 : check.value / *check.limit;
    if (best.check == nullptr || ratio > best.ratio) best = {&check, ratio};
  }
  return best;
}

std::string Percent(double size) { return fmt::format("{:.3g} %", 100.0 * size); }

// A parameter and what an error of 1 adds to it.
struct Target {
  Parameter parameter;
  double relative_to = kNan;

  [[nodiscard]] double At(double size) const { return parameter.value + relative_to * size; }
  [[nodiscard]] Target Reversed() const { return {parameter, -relative_to}; }
  /// "10 % wrong"
  [[nodiscard]] std::string Text(double size) const {
    if (parameter.value == 0.0) {
      return fmt::format("{} of {:g}{}{} instead of 0", Percent(size), relative_to,
                         parameter.unit.empty() ? "" : " ", parameter.unit);
    }
    return Percent(size) + (relative_to / parameter.value > 0.0 ? " wrong" : " less");
  }
};

class Mutator {
 public:
  Mutator(const MutationOptions& options, const MutationBench& bench, MutationReport* report)
      : options_(options), bench_(bench), report_(*report) {}

  void BendParameters() {
    std::vector<Parameter> parameters;
    for (const Parameter& parameter : bench_.mechanism().parameters) {
      if (Wanted(parameter)) parameters.push_back(parameter);
    }
    for (size_t i = 0; i < parameters.size(); ++i) {
      fraction_ = static_cast<double>(i) / static_cast<double>(parameters.size());
      report_.mutations.push_back(Bend({parameters[i], ScaleOf(parameters[i])}));
    }
    std::stable_sort(report_.mutations.begin(), report_.mutations.end(),
                     [](const Mutation& a, const Mutation& b) { return Rank(a) < Rank(b); });
  }

  void PutFaults() {
    std::vector<StructuralFault> faults = StructuralFaults(bench_.mechanism());
    for (size_t i = 0; i < faults.size(); ++i) {
      fraction_ = static_cast<double>(i) / static_cast<double>(faults.size());
      if (options_.progress) options_.progress(faults[i].kind, fraction_);
      report_.faults.push_back(Put(faults[i]));
    }
  }

  [[nodiscard]] bool missed() const { return missed_; }

 private:
  // By smallest error where it is known, else by the force change.
  static double Rank(const Mutation& m) {
    if (!std::isnan(m.smallest)) return m.smallest;
    return m.detected && !std::isnan(m.force_change) ? 1.0 / (1.0 + m.force_change) : 10.0;
  }

  [[nodiscard]] bool Wanted(const Parameter& parameter) const {
    // An instance's parameter ("limb2.azimuth") follows from the model's.
    const bool of_instance = parameter.name.find('.') != std::string::npos;
    if (options_.parameters.empty()) return !of_instance;
    return std::find(options_.parameters.begin(), options_.parameters.end(), parameter.name) !=
           options_.parameters.end();
  }

  // Its value; the largest one of its unit if that is zero.
  [[nodiscard]] double ScaleOf(const Parameter& parameter) const {
    if (parameter.value != 0.0) return parameter.value;
    double largest = 0.0;
    for (const Parameter& other : bench_.mechanism().parameters) {
      if (other.unit == parameter.unit) largest = std::max(largest, std::abs(other.value));
    }
    return largest > 0.0 ? largest : 1.0;
  }

  BentRun RunAt(const Target& target, double size) {
    if (options_.progress) {
      options_.progress(fmt::format("{} by {:.1e}", target.parameter.name, size), fraction_);
    }
    ++report_.runs;
    return bench_.Run(target.parameter.name, target.At(size));
  }

  // As far as the bent model runs; the other way round where it does not, but runs there.
  BentRun RunEitherWay(Target* target, double size) {
    BentRun run = RunAt(*target, size);
    if (run.ran) return run;
    BentRun other = RunAt(target->Reversed(), size);
    if (!other.ran) return run;
    *target = target->Reversed();
    return other;
  }

  Mutation Bend(Target target) {
    Mutation m;
    m.parameter = target.parameter.name;
    m.unit = target.parameter.unit;
    m.value = target.parameter.value;
    const BentRun run = RunEitherWay(&target, options_.size);
    m.relative_to = target.relative_to;
    m.ran = run.ran;
    m.detected = run.detected();
    if (run.ran) m.force_change = run.ValueOf(bench_.ForceCheck());
    m.by_force = FailsByForce(run);
    if (!run.ran) m.reason = run.failure;
    const Best best = BestOf(bench_, run);
    if (m.detected) {
      m.best_check = best.check == nullptr ? "model" : best.check->name;
      if (options_.smallest) {
        FindSmallest(target, 0.0, options_.size, best.ratio, &m);
      } else if (best.check != nullptr) {
        m.smallest = options_.size / best.ratio;
      }
      return m;
    }
    BendFurther(target, run, &m);
    missed_ = missed_ ||
              m.force_change > MutationBench::Visible(bench_.base().ValueOf(bench_.ForceCheck()));
    return m;
  }

  static bool FailsByForce(const BentRun& run) {
    return std::any_of(run.comparison.checks.begin(), run.comparison.checks.end(),
                       [](const CheckResult& check) {
                         return check.limit && !check.pass && IsDriveForce(check.metric);
                       });
  }

  // Undetected at the size asked for: bent by kLargestBend, and if that is seen or refused, by ten
  // times as much as before until it is.
  void BendFurther(Target target, const BentRun& first, Mutation* m) {
    double unseen = options_.size;
    BentRun last = first, largest;
    if (unseen < kLargestBend) {
      largest = RunEitherWay(&target, kLargestBend);
      if (target.relative_to != m->relative_to) unseen = 0.0;  // nothing is known of this way yet
      m->relative_to = target.relative_to;
      if (largest.ran && !largest.detected()) {
        unseen = kLargestBend;
        last = std::move(largest);
      }
    }
    for (double size = 10.0 * options_.size; unseen < kLargestBend; size *= 10.0) {
      size = std::min(size, kLargestBend);
      BentRun run = size < kLargestBend ? RunAt(target, size) : std::move(largest);
      if (!run.ran) break;  // the model itself objects; forces have not seen it up to here
      if (run.detected()) {
        const Best best = BestOf(bench_, run);
        m->best_check = best.check == nullptr ? "" : best.check->name;
        if (options_.smallest) FindSmallest(target, unseen, size, best.ratio, m);
        m->reason = fmt::format("its effect ({:.1e} in the drive forces) is below the limit",
                                m->force_change);
        return;
      }
      unseen = size;
      last = std::move(run);
    }
    m->proved_to = unseen;
    m->sensitivity = ForceSensitivity(bench_, last.trace);
    std::string why;
    const auto bent = bench_.Bend(m->parameter, target.At(unseen), &why);
    m->reason = bent ? WhyUnseen(bench_, *bent, last, target.Text(unseen)) : why;
  }

  // Between `unseen` (0: not known) and `seen`; `ratio` is value over limit at `seen`.
  void FindSmallest(const Target& target, double unseen, double seen, double ratio, Mutation* m) {
    const double fine = 1.0 + options_.resolution;
    double step = fine;
    // Where proportion puts the limit, a little beyond; 0 where nothing is proportional.
    double guess = std::isfinite(ratio) && ratio > 1.0 ? seen / ratio * std::sqrt(fine) : 0.0;
    while ((unseen == 0.0 || seen / unseen > fine) && seen > kSmallestBend) {
      double size = 0.0;
      if (guess > unseen && guess < seen) {
        size = guess;
      } else if (unseen == 0.0) {
        size = seen / step;
        step *= step;
      } else if (unseen * step * fine < seen) {
        size = unseen * step;
        step *= step;
      } else {
        size = std::sqrt(unseen * seen);
      }
      guess = 0.0;
      size = std::max(size, kSmallestBend);
      const BentRun run = RunAt(target, size);
      if (!run.detected()) {
        unseen = size;
        continue;
      }
      seen = size;
      const Best best = BestOf(bench_, run);
      m->best_check = best.check == nullptr ? "model" : best.check->name;
    }
    m->smallest = seen;
  }

  FaultResult Put(const StructuralFault& fault) {
    FaultResult result;
    result.kind = fault.kind;
    result.where = fault.where;
    result.alike = fault.alike;
    result.reason = fault.not_applicable;
    if (fault.wrong.empty()) return result;
    if (bench_.scenario().simulation.extrapolate) {
      result.reason = "the scenario extrapolates over models that are loaded anew";
      return result;
    }
    const std::optional<BentRun> run = RunFault(fault);
    if (!run) {
      result.reason = fmt::format(
          "the simulation brings all of {} random starts to the same "
          "assembly, or to none",
          fault.wrong.size());
      return result;
    }
    result.applicable = true;
    result.ran = run->ran;
    result.detected = run->detected();
    if (!run->ran) {
      result.check = "model";
      result.reason = run->failure;
      return result;
    }
    const Best best = BestOf(bench_, *run);
    if (best.check != nullptr) {
      result.check = best.check->name;
      result.value = best.check->value;
      result.limit = *best.check->limit;
    }
    if (!result.detected) result.reason = WhyFaultUnseen(fault, *run);
    return result;
  }

  // The fault; of several candidates the first that runs and moves differently; empty when none
  // does.
  std::optional<BentRun> RunFault(const StructuralFault& fault) {
    for (const Mechanism& wrong : fault.wrong) {
      ++report_.runs;
      BentRun run = bench_.Run(wrong);
      if (fault.wrong.size() == 1 || (run.ran && run.detected())) return run;
    }
    return {};
  }

  std::string WhyFaultUnseen(const StructuralFault& fault, const BentRun& run) {
    const double change = ForceSensitivity(bench_, run.trace);
    if (change > MutationBench::Visible(0.0)) {
      missed_ = true;
    } else if (!fault.first.empty()) {
      return WhySwapUnseen(bench_, fault.first, fault.second);
    }
    return WhyUnseen(bench_, fault.wrong.front(), run, "it");
  }

  const MutationOptions& options_;
  const MutationBench& bench_;
  MutationReport& report_;
  double fraction_ = 0.0;
  bool missed_ = false;
};

// Named parameters that the model does not have.
void CheckNames(const MutationOptions& options, const Mechanism& mechanism,
                MutationReport* report) {
  std::vector<std::string> names;
  for (const Parameter& parameter : mechanism.parameters) names.push_back(parameter.name);
  for (const std::string& wanted : options.parameters) {
    if (std::find(names.begin(), names.end(), wanted) != names.end()) continue;
    Finding finding;
    finding.message = fmt::format("{} has no parameter '{}'", mechanism.name, wanted);
    const std::string near = ClosestWord(wanted, names);
    if (!near.empty()) finding.hint = fmt::format("did you mean '{}'?", near);
    report->diagnostics.Add(std::move(finding));
    report->exit_code = 2;
  }
}

}  // namespace

MutationReport MutateScenario(const std::string& file, const MutationOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  MutationReport report;
  report.scenario = file;
  report.size = options.size;
  report.resolution = options.resolution;
  const auto bench = MutationBench::Make(file, &report.diagnostics, &report.exit_code);
  if (bench == nullptr) return report;
  CheckNames(options, bench->mechanism(), &report);
  if (report.exit_code != 0) return report;
  Mutator mutator(options, *bench, &report);
  mutator.BendParameters();
  if (options.structural && options.parameters.empty()) mutator.PutFaults();
  report.exit_code = mutator.missed() ? 1 : 0;
  report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

}  // namespace mbv
