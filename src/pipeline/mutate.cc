#include "pipeline/mutate.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "core/word_hints.h"
#include "input/parsed_documents.h"
#include "pipeline/bend_search.h"
#include "pipeline/bendable.h"
#include "pipeline/drive_by.h"
#include "pipeline/mutation_bench.h"
#include "pipeline/mutation_reason.h"
#include "pipeline/structural_faults.h"

namespace mbv {
namespace {

class Mutator {
 public:
  /// `exact`: inverse dynamics, which says what an error does; null where `own` is the only one.
  Mutator(const MutationOptions& options, const MutationBench& own, const MutationBench* exact,
          MutationReport* report)
      : options_(options), own_(own), exact_(exact == nullptr ? own : *exact), report_(*report) {}

  void BendNumbers(const std::vector<Bendable>& numbers) {
    for (size_t i = options_.part; i < numbers.size(); i += options_.parts) {
      fraction_ = static_cast<double>(i) / static_cast<double>(numbers.size());
      report_.mutations.push_back(Bend(numbers[i]));
    }
  }

  void PutFaults() {
    const std::vector<StructuralFault> faults = StructuralFaults(own_.mechanism());
    for (size_t i = options_.part; i < faults.size(); i += options_.parts) {
      fraction_ = static_cast<double>(i) / static_cast<double>(faults.size());
      report_.faults.push_back(Put(faults[i]));
    }
  }

  [[nodiscard]] bool missed() const { return missed_; }

 private:
  void Count(const std::string& what) {
    if (options_.progress) options_.progress(what, fraction_);
    ++report_.runs;
  }

  [[nodiscard]] BendSearch SearchOn(const MutationBench& bench) {
    return {options_, bench, [this](const std::string& what) { Count(what); }};
  }

  [[nodiscard]] bool two_benches() const { return &own_ != &exact_; }

  Mutation Bend(const Bendable& number) {
    Mutation m;
    m.name = number.name;
    m.unit = number.unit;
    m.kind = number.kind;
    m.value = number.value;
    m.relative_to = number.relative_to;
    BendSearch exact = SearchOn(exact_);
    const Sighting seen = exact.Look(number, true);
    // What inverse dynamics proves to have no effect needs no search by a coarser method.
    const bool acts = seen.detected || !std::isnan(seen.smallest) || Changes(seen);
    m.own = two_benches() ? SearchOn(own_).Look(number, acts) : seen;
    if (two_benches()) m.inverse = seen;
    if (m.own.detected) return m;
    if (Changes(seen)) missed_ = true;
    if (acts) {
      m.reason = fmt::format("its effect ({:.1e} in the drive forces) is below the limit",
                             seen.force_change);
    } else {
      Prove(number, exact.Weaker(), &m);
    }
    return m;
  }

  [[nodiscard]] bool Changes(const Sighting& seen) const {
    return seen.force_change > MutationBench::Visible(exact_.base().ValueOf(exact_.ForceCheck()));
  }

  void Prove(const Bendable& number, const Direction& way, Mutation* m) const {
    const double error = way.sign * way.unseen;
    m->proved_to = way.unseen;
    m->sensitivity = ForceSensitivity(exact_, way.run.trace);
    std::string why;
    const auto bent = exact_.Bend(number.At(error), &why);
    m->reason = bent ? WhyUnseen(exact_, *bent, way.run, number.Text(error)) : why;
  }

  FaultResult Put(const StructuralFault& fault) {
    FaultResult result;
    result.kind = fault.kind;
    result.where = fault.where;
    result.alike = fault.alike;
    result.reason = fault.not_applicable;
    if (fault.wrong.empty()) return result;
    if (own_.scenario().simulation.extrapolate) {
      result.reason = "the scenario extrapolates over models that are loaded anew";
      return result;
    }
    const std::optional<Tried> exact = FirstThatMoves(fault);
    if (!exact) {
      result.reason = fmt::format(
          "the simulation brings all of {} random starts to the same "
          "assembly, or to none",
          fault.wrong.size());
      return result;
    }
    result.applicable = true;
    result.own = See(exact_, exact->run);
    if (two_benches()) {
      result.inverse = result.own;
      Count(fault.kind);
      result.own = See(own_, own_.Run(fault.wrong[exact->candidate]));
    }
    if (!result.own.detected) result.own.reason = WhyFaultUnseen(fault, exact->run);
    return result;
  }

  struct Tried {
    size_t candidate = 0;
    BentRun run;
  };
  // The fault; of several candidates the first that runs and moves differently; empty when none
  // does.
  std::optional<Tried> FirstThatMoves(const StructuralFault& fault) {
    for (size_t k = 0; k < fault.wrong.size(); ++k) {
      Count(fault.kind);
      BentRun run = exact_.Run(fault.wrong[k]);
      if (fault.wrong.size() == 1 || (run.ran && run.detected())) return Tried{k, std::move(run)};
    }
    return {};
  }

  static FaultSighting See(const MutationBench& bench, const BentRun& run) {
    FaultSighting seen;
    seen.ran = run.ran;
    seen.detected = run.detected();
    if (!run.ran) {
      seen.check = "model";
      seen.reason = run.failure;
      return seen;
    }
    const BestCheck best = BestOf(bench, run);
    if (best.check == nullptr) return seen;
    seen.check = best.check->name;
    seen.value = best.check->value;
    seen.limit = *best.check->limit;
    return seen;
  }

  std::string WhyFaultUnseen(const StructuralFault& fault, const BentRun& run) {
    const double change = ForceSensitivity(exact_, run.trace);
    if (change > MutationBench::Visible(0.0)) {
      missed_ = true;
    } else if (!fault.first.empty()) {
      return WhySwapUnseen(exact_, fault.first, fault.second);
    }
    return WhyUnseen(exact_, fault.wrong.front(), run, "it");
  }

  const MutationOptions& options_;
  const MutationBench &own_, &exact_;
  MutationReport& report_;
  double fraction_ = 0.0;
  bool missed_ = false;
};

// Those that are asked for; unknown names are findings.
std::vector<Bendable> Chosen(const MutationOptions& options, std::vector<Bendable> all,
                             MutationReport* report) {
  if (options.numbers.empty()) return all;
  std::vector<Bendable> chosen;
  std::vector<std::string> names;
  for (const Bendable& number : all) names.push_back(number.name);
  for (const std::string& wanted : options.numbers) {
    const auto found = std::find(names.begin(), names.end(), wanted);
    if (found != names.end()) {
      chosen.push_back(all[static_cast<size_t>(found - names.begin())]);
      continue;
    }
    Finding finding;
    finding.file = report->scenario;
    finding.message = fmt::format("the model has no number '{}' to bend", wanted);
    finding.hint = DidYouMean(wanted, names);
    report->diagnostics.Add(std::move(finding));
    report->exit_code = 2;
  }
  return chosen;
}

std::vector<Bendable> NumbersOf(const MutationBench& bench) {
  std::vector<Bendable> numbers = BendablesOf(bench.mechanism(), bench.literals());
  // Its models are loaded anew, by parameters only.
  if (bench.scenario().simulation.extrapolate) {
    std::erase_if(numbers, [](const Bendable& b) { return b.kind == NumberKind::kLiteral; });
  }
  return numbers;
}

// In inverse mode, if the scenario has another one and allows it; a reason not to is a warning.
// Where drives are pushed or servos, their forces tell nothing of an error by themselves: inverse
// dynamics does, whatever modes are asked for.
std::unique_ptr<MutationBench> InverseBench(const MutationBench& own, const std::string& file,
                                            const MutationOptions& options,
                                            Diagnostics* diagnostics) {
  const SimulationSettings& simulation = own.scenario().simulation;
  const bool held = simulation.drive_by == DriveBy::kMotion;
  if (!simulation.forward || (options.modes != MutationModes::kBoth && held)) return nullptr;
  Diagnostics findings;
  int ignored = 0;
  auto bench = MutationBench::Make(file, BenchMode::kInverse, &findings, &ignored);
  if (bench != nullptr) return bench;
  for (Finding finding : findings.findings()) {
    finding.severity = Severity::kWarning;
    finding.message = "in inverse mode: " + finding.message;
    diagnostics->Add(std::move(finding));
  }
  return nullptr;
}

}  // namespace

MutationReport MutateScenario(const std::string& file, const MutationOptions& options) {
  const ParsedDocuments documents;
  const auto start = std::chrono::steady_clock::now();
  MutationReport report;
  report.scenario = file;
  report.size = options.size;
  report.resolution = options.resolution;
  const BenchMode mode =
      options.modes == MutationModes::kInverse ? BenchMode::kInverse : BenchMode::kAsIs;
  const auto own = MutationBench::Make(file, mode, &report.diagnostics, &report.exit_code);
  if (own == nullptr) return report;
  report.mode = ModeText(own->scenario().simulation);
  const std::vector<Bendable> numbers = Chosen(options, NumbersOf(*own), &report);
  if (report.exit_code != 0) return report;
  const auto exact = InverseBench(*own, file, options, &report.diagnostics);
  Mutator mutator(options, *own, exact.get(), &report);
  mutator.BendNumbers(numbers);
  if (options.structural && options.numbers.empty()) mutator.PutFaults();
  if (options.parts == 1) SortBySensitivity(&report);
  report.exit_code = mutator.missed() ? 1 : 0;
  report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

}  // namespace mbv
