#include "pipeline/upgrade.h"

#include <fmt/format.h>

#include "exchange/row_states.h"
#include "exchange/witness_answer.h"
#include "mechanism/channels.h"
#include "pipeline/engine_errors.h"
#include "pipeline/program_call.h"
#include "pipeline/run_witnesses.h"
#include "pipeline/upgrade_rows.h"
#include "simulation/engine_version.h"

namespace mbv {
namespace {

constexpr size_t kStates = 25;

// Ways to step the model as it is: our engine, and the option of the other version's program.
struct Way {
  Engine engine;
  const char* key;   // of EngineComparison::NameOf
  const char* name;  // of the foreign witness
  const char* option;
};
constexpr Way kWays[] = {{Engine::kStock, "stock", "newest", ""},
                         {Engine::kDefaults, "defaults", "newest_default", "--defaults"}};

class UpgradeRun {
 public:
  UpgradeRun(const std::string& file, const UpgradeOptions& options)
      : file_(file), options_(options) {}

  UpgradeOutcome Run() {
    prepared_ = Prepare(file_, options_.scenario, &outcome_.diagnostics);
    if (!prepared_) return End(2, "");
    if (prepared_->scenario.motion.free()) {
      return End(3, "its motion follows from forces: no drive forces to compare");
    }
    auto& witnesses = prepared_->scenario.witnesses;  // in place of the scenario's own
    witnesses.clear();
    for (const Way& way : kWays) witnesses.push_back(Program(way.name, way.option));
    WitnessRunner runner(*prepared_, {}, options_.progress);
    runner.Run(role::kReference);
    const WitnessRecord* truth = runner.runs().Find(role::kReference);
    if (truth == nullptr || !truth->summary.ok()) {
      return End(3, "there is no reference: " +
                        (truth == nullptr ? "the scenario has none" : truth->summary.message));
    }
    truth_ = truth->trace;
    report_.mechanism = prepared_->base.name;
    report_.scenario = prepared_->scenario.name;
    report_.version_old = EngineVersion();
    if (std::string trouble = CompareStates(); !trouble.empty()) return End(3, trouble);
    if (report_.unavailable.empty()) CompareRuns(&runner);
    const bool answered = report_.unavailable.empty();
    outcome_.report = std::move(report_);
    return End(answered ? 0 : 3, "");
  }

 private:
  UpgradeOutcome End(int exit_code, const std::string& failure) {
    outcome_.exit_code = exit_code;
    outcome_.failure = failure;
    return std::move(outcome_);
  }

  [[nodiscard]] ForeignWitness Program(const std::string& name, const std::string& option) const {
    ForeignWitness program;
    program.name = name;
    program.command = options_.command;
    if (!option.empty()) program.command.push_back(option);
    program.timeout_s = 600.0;
    program.typed = true;
    return program;
  }

  // Samples of the motion, as evenly as they come.
  [[nodiscard]] std::vector<Eigen::Index> ChosenSamples() const {
    std::vector<Eigen::Index> chosen;
    const size_t last = truth_.time_s.size() - 1, states = std::min(kStates, last + 1);
    for (size_t i = 0; i < states; ++i) {
      chosen.push_back(static_cast<Eigen::Index>(states < 2 ? 0 : i * last / (states - 1)));
    }
    return chosen;
  }

  // "" or why the states could not be made; the program's own trouble goes to the report.
  std::string CompareStates() {
    const std::vector<Eigen::Index> samples = ChosenSamples();
    std::vector<double> times_s;
    times_s.reserve(samples.size());
    for (const Eigen::Index i : samples) times_s.push_back(truth_.time_s[static_cast<size_t>(i)]);
    const RowSurvey survey =
        SurveyRows(prepared_->mechanisms.simulated, prepared_->scenario.motion,
                   prepared_->MakeDrivenMotion(), times_s, prepared_->scenario.simulation.step_s);
    if (!survey.summary.ok()) return survey.summary.message;
    report_.states = survey.states.size();
    const auto answer = Ask(survey);
    if (!answer) return "";
    report_.messages = answer->messages;
    report_.rows = CompareRows(survey, *answer);
    if (report_.rows.empty()) report_.unavailable = "its rows are not the ones of this version";
    std::vector<VecX> old_forces, new_forces;
    for (size_t i = 0; i < survey.states.size(); ++i) {
      old_forces.push_back(survey.states[i].present.force);
      new_forces.push_back(answer->states[i].force);
    }
    report_.forces.push_back({.how = "mj_forward at these states",
                              .nrmse_old = ErrorAt(samples, times_s, old_forces),
                              .nrmse_new = ErrorAt(samples, times_s, new_forces),
                              .why_old = {},
                              .why_new = {}});
    return "";
  }

  std::optional<RowAnswer> Ask(const RowSurvey& survey) {
    if (options_.progress) options_.progress("the other version's rows", 0.0);
    std::vector<RowState> states;
    for (const SurveyedState& surveyed : survey.states) states.push_back(surveyed.state);
    const ForeignWitness program = Program("rows", "--rows");
    ProgramCall call(program);
    std::string& trouble = report_.unavailable;
    trouble = call.Give("model.xml", survey.mjcf);
    if (trouble.empty()) trouble = call.Give("states.json", StatesJson(survey.driven, states));
    if (trouble.empty()) {
      if (const auto failure = call.Run()) trouble = failure->text;
    }
    if (!trouble.empty()) return {};
    const auto witness = ReadAnswer(call.Text("witness.json").value_or(""), &trouble);
    if (witness) trouble = witness->refused;
    if (!trouble.empty()) return {};
    report_.version_new = witness->version;
    return ReadRowAnswer(call.Text("rows.json").value_or(""), states.size(), survey.driven.size(),
                         &trouble);
  }

  // Of the drives' forces at chosen samples, against the reference's.
  [[nodiscard]] double ErrorAt(const std::vector<Eigen::Index>& samples,
                               const std::vector<double>& times_s,
                               const std::vector<VecX>& forces) const {
    const Mechanism& mechanism = prepared_->base;
    Trace truth, measured;
    truth.witness = truth_.witness;
    measured.witness = role::kSimulated.name;
    truth.Reset(times_s, truth_.channels);
    truth.values = truth_.values(samples, Eigen::all);
    std::vector<Channel> channels = DriveChannels(mechanism);
    std::erase_if(channels,
                  [](const Channel& channel) { return channel.quantity != Quantity::kForce; });
    measured.Reset(times_s, std::move(channels));
    for (size_t i = 0; i < forces.size(); ++i) {
      measured.values.row(static_cast<Eigen::Index>(i)) =
          forces[i].head(measured.values.cols()).transpose();
    }
    return EngineErrorOf(InputOf(*prepared_), measured, truth).force_nrmse;
  }

  // Stepping the model as it is, by both versions.
  void CompareRuns(WitnessRunner* runner) {
    runner->RunForeign();
    const ComparisonInput input = InputOf(*prepared_);
    for (const Way& way : kWays) {
      const char* how = EngineComparison::NameOf(way.key);
      const SimulatedWitness old = runner->Simulate(
          SimulationOptions{.engine = way.engine, .step_s = prepared_->scenario.simulation.step_s},
          how);
      ForceChange& change = report_.forces.emplace_back();
      change.how = how;
      Measure(input, old.run.summary, old.run.trace, &change.nrmse_old, &change.gap_old_m,
              &change.why_old);
      for (const WitnessRecord& record : runner->runs().records) {
        if (record.name != way.name) continue;
        Measure(input, record.summary, record.trace, &change.nrmse_new, &change.gap_new_m,
                &change.why_new);
      }
    }
  }

  void Measure(const ComparisonInput& input, const RunSummary& summary, const Trace& trace,
               double* nrmse, double* gap_m, std::string* why) const {
    if (!summary.ok()) {
      *why = summary.message;
      return;
    }
    const EngineError error = EngineErrorOf(input, trace, truth_);
    *nrmse = error.force_nrmse;
    *gap_m = error.closure_max_m;
  }

  const std::string& file_;
  const UpgradeOptions& options_;
  std::optional<Prepared> prepared_;
  Trace truth_;
  UpgradeReport report_;
  UpgradeOutcome outcome_;
};

}  // namespace

UpgradeOutcome Upgrade(const std::string& file, const UpgradeOptions& options) {
  return UpgradeRun(file, options).Run();
}

}  // namespace mbv
