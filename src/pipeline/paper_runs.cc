#include "pipeline/paper_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "core/word_hints.h"
#include "figure/units.h"
#include "model_file/load_model.h"
#include "pipeline/run_scenario.h"
#include "report/stiffness_report.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

constexpr const char* kLoadChannel = "load";

Channel LoadNumber() { return {.name = kLoadChannel, .unit = "1", .frame = ""}; }

// The displacements of one witness, a row for each load.
Trace TraceOfLoads(const StiffnessWitness& witness) {
  Trace trace;
  trace.witness = witness.name;
  std::vector<double> numbers;
  for (size_t k = 0; k < witness.displacements.size(); ++k) {
    numbers.push_back(static_cast<double>(k + 1));
  }
  std::vector<Channel> channels = {LoadNumber()};
  for (int i = 0; i < 6; ++i) {
    channels.push_back({.name = fmt::format("{}.{}", i < 3 ? "rotation" : "displacement",
                                            kPoseComponents[static_cast<size_t>(i % 3)]),
                        .unit = i < 3 ? "rad" : "m",
                        .frame = "world"});
  }
  trace.Reset(std::move(numbers), std::move(channels));
  for (size_t k = 0; k < witness.displacements.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    trace.values(row, 0) = static_cast<double>(k + 1);
    trace.values.row(row).tail(6) = witness.displacements[k].transpose();
  }
  return trace;
}

Report ReportOfLoads(const StiffnessReport& stiffness) {
  Report report;
  static_cast<ResultFrame&>(report) = stiffness;
  for (const StiffnessWitness& witness : stiffness.witnesses) {
    if (witness.displacements.empty()) continue;
    report.witnesses.push_back({witness.name, RunSummary::Done(), TraceOfLoads(witness)});
  }
  report.duration_s = static_cast<double>(stiffness.loads.size());
  report.comparison.verdict = stiffness.comparison.verdict;
  return report;
}

const Channel* FindChannel(const Report& report, const std::string& name) {
  for (const WitnessRecord& record : report.witnesses) {
    const int column = record.trace.Find(name);
    if (column >= 0) return &record.trace.channels[static_cast<size_t>(column)];
  }
  return nullptr;
}

std::vector<std::string> ChannelNamesOf(const Report& report) {
  std::vector<std::string> names;
  for (const WitnessRecord& record : report.witnesses) {
    for (const Channel& channel : record.trace.channels) names.push_back(channel.name);
  }
  return names;
}

}  // namespace

void PaperRuns::Error(const PlacedText& at, const std::string& message, const std::string& hint,
                      Diagnostics* diagnostics) const {
  diagnostics->Add({.severity = Severity::kError,
                    .file = paper_.file,
                    .line = at.line,
                    .column = at.column,
                    .message = fmt::format("{} = '{}': {}", at.path, at.text, message),
                    .hint = hint});
}

std::string PaperRuns::FileOf(const PlacedText& scenario) const {
  return FindScenario(model_ + "/" + scenario.text);
}

const Report* PaperRuns::Run(const PlacedText& scenario, Diagnostics* diagnostics) {
  const std::string file = FileOf(scenario);
  if (!std::filesystem::exists(file)) {
    Error(scenario, "there is no scenario " + file, "", diagnostics);
    return nullptr;
  }
  auto [at, added] = runs_.try_emplace(file);
  if (!added) return at->second ? &*at->second : nullptr;
  RunOptions options;
  options.pictures = options.page = false;
  options.programs = programs_;
  options.progress = progress_;
  RunOutcome ran = RunScenario(file, options);
  exit_code_ = std::max(exit_code_, ran.exit_code);
  diagnostics->Append(ran.diagnostics);
  if (ran.report) at->second = std::move(*ran.report);
  if (ran.stiffness) at->second = ReportOfLoads(*ran.stiffness);
  return at->second ? &*at->second : nullptr;
}

void PaperRuns::AddBeside(const BesideRun& beside, Report* report, Diagnostics* diagnostics) {
  const Report* other = Run(beside.scenario, diagnostics);
  if (other == nullptr) return;
  const Trace* trace = TraceOf(*other, beside.witness.text);
  if (trace == nullptr || trace->time_s.empty()) {
    return Error(beside.witness, "no such witness ran in " + beside.scenario.text, "", diagnostics);
  }
  report->witnesses.push_back({beside.name, RunSummary::Done(), *trace, Witness::Foreign{}});
}

void PaperRuns::AddPrinted(const PrintedNumbers& numbers, Report* report,
                           Diagnostics* diagnostics) {
  Trace trace;
  trace.witness = numbers.name;
  std::vector<Channel> channels;
  std::vector<double> factors;
  for (const auto& [signal, values] : numbers.signals) {
    const Channel* known = FindChannel(*report, signal.text);
    if (known == nullptr) {
      return Error(signal, "no witness records such a signal",
                   DidYouMean(signal.text, ChannelNamesOf(*report), ""), diagnostics);
    }
    const ShownUnit* unit = FindUnit(known->unit, numbers.unit.text);
    if (unit == nullptr && numbers.unit.text != known->unit) {
      return Error(numbers.unit, "no unit of what is recorded in " + known->unit, "", diagnostics);
    }
    channels.push_back(*known);
    factors.push_back(unit != nullptr ? unit->factor : 1.0);
  }
  const bool loads = FindChannel(*report, kLoadChannel) != nullptr;
  if (loads) channels.push_back(LoadNumber());
  trace.Reset(numbers.at, channels);
  for (size_t i = 0; i < numbers.at.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    for (size_t k = 0; k < factors.size(); ++k) {
      trace.values(row, static_cast<Eigen::Index>(k)) = numbers.signals[k].second[i] / factors[k];
    }
    if (loads) trace.values(row, static_cast<Eigen::Index>(factors.size())) = numbers.at[i];
  }
  report->witnesses.push_back(
      {numbers.name, RunSummary::Done(), std::move(trace), Witness::Foreign{}});
}

std::optional<Report> PaperRuns::Of(const PaperEntry& entry, Diagnostics* diagnostics) {
  const Report* run = Run(entry.scenario, diagnostics);
  if (run == nullptr) return {};
  Report report = *run;
  for (const BesideRun& beside : entry.beside) AddBeside(beside, &report, diagnostics);
  for (const PrintedNumbers& numbers : entry.printed) AddPrinted(numbers, &report, diagnostics);
  if (diagnostics->has_errors()) return {};
  return report;
}

const WorkspaceOutcome& PaperRuns::Workspace(Diagnostics* diagnostics) {
  if (workspace_) return *workspace_;
  workspace_.emplace();
  const auto model = FindModel(model_, std::filesystem::current_path());
  LoadResult loaded;
  if (model) loaded = LoadModel(*model);
  diagnostics->Append(loaded.diagnostics);
  if (!loaded.mechanism) return *workspace_;
  workspace_ = ComputeWorkspace(*loaded.mechanism, false);
  diagnostics->Append(workspace_->diagnostics);
  if (!workspace_->summary.ok()) exit_code_ = std::max(exit_code_, 3);
  if (!workspace_->agree) exit_code_ = std::max(exit_code_, 1);
  return *workspace_;
}

}  // namespace mbv
