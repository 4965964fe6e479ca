#include "features/engines/crosscheck.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "base/json_text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/terminal.h"
#include "external/motion_text.h"
#include "external/witness_answer.h"
#include "features/run/engine_errors.h"
#include "mechanism/channels.h"
#include "report/document.h"
#include "simulation/engine/engine.h"
#include "verify/program_call.h"
#include "verify/run_witnesses.h"

namespace mbv {
namespace {

// "1" where nothing but round-off differs, else the range of the ratio.
std::string RatioText(const RowChange& change) {
  const std::string least = fmt::format("{:.4g}", change.softness_least);
  const std::string most = fmt::format("{:.4g}", change.softness_most);
  return least == most ? least : least + " … " + most;
}

std::string LoadingText(const UpgradeReport& report) {
  if (report.messages.empty()) return "  loads without a message\n";
  std::string text = "  says while loading:\n";
  for (const std::string& message : report.messages) text += "    " + message + "\n";
  return text;
}

std::string RowsText(const UpgradeReport& report) {
  Table table{.columns = {Text(fmt::format("rows at {} states", report.states)), Digits("rows"),
                          Digits("softness, new/old"), Digits("|dJ/dt qdot|"),
                          Digits("left out, old"), Digits("new"), Text("why")}};
  for (const RowChange& change : report.rows) {
    table.rows.push_back({change.kind, fmt::format("{}", change.rows), RatioText(change),
                          fmt::format("{:.2g}", change.velocity_term),
                          fmt::format("{:.2g}", change.left_out_old),
                          fmt::format("{:.2g}", change.left_out_new), change.why});
  }
  return ToText(table);
}

std::string NumberOr(double number, const char* unit, const std::string& why) {
  if (!why.empty() || std::isnan(number)) return "–";
  return fmt::format("{:.1e}{}", number, unit);
}

std::string ForcesText(const UpgradeReport& report) {
  Table table{.columns = {Text("RMS error of all drive forces"), Digits(report.version_old),
                          Digits(report.version_new), Digits("loop gap, old"), Digits("new"),
                          Text("why not")}};
  for (const ForceChange& change : report.forces) {
    std::vector<std::string> why;
    for (const std::string& one : {change.why_old, change.why_new}) {
      if (!one.empty()) why.push_back(one);
    }
    table.rows.push_back({change.how, NumberOr(change.nrmse_old, "", change.why_old),
                          NumberOr(change.nrmse_new, "", change.why_new),
                          NumberOr(change.gap_old_m, " m", change.why_old),
                          NumberOr(change.gap_new_m, " m", change.why_new),
                          fmt::format("{}", fmt::join(why, "; "))});
  }
  if (std::ranges::all_of(table.rows, [](const auto& row) { return row.back().text.empty(); })) {
    table.columns.back().on = On::kPage;
  }
  return ToText(table);
}

nlohmann::ordered_json RowJson(const RowChange& change) {
  return {{"kind", change.kind},
          {"rows", change.rows},
          {"softness_ratio", {Number(change.softness_least), Number(change.softness_most)}},
          {"velocity_term", Number(change.velocity_term)},
          {"left_out", {Number(change.left_out_old), Number(change.left_out_new)}},
          {"why", change.why}};
}

nlohmann::ordered_json ForceJson(const ForceChange& change) {
  return {{"how", change.how},
          {"force_nrmse", {Number(change.nrmse_old), Number(change.nrmse_new)}},
          {"loop_gap_m", {Number(change.gap_old_m), Number(change.gap_new_m)}},
          {"why", {change.why_old, change.why_new}}};
}

}  // namespace

std::string ToText(const UpgradeReport& report) {
  std::string text = fmt::format("{}/{}: the generated model in MuJoCo {}", report.mechanism,
                                 report.scenario, report.version_old);
  if (!report.unavailable.empty()) {
    return text + ", and another version that did not answer: " + report.unavailable + "\n";
  }
  text += fmt::format(" and {}\n", report.version_new);
  return text + LoadingText(report) + RowsText(report) + ForcesText(report);
}

std::string ToJson(const std::vector<UpgradeReport>& reports) {
  auto list = nlohmann::ordered_json::array();
  for (const UpgradeReport& report : reports) {
    auto rows = nlohmann::ordered_json::array(), forces = nlohmann::ordered_json::array();
    for (const RowChange& change : report.rows) rows.push_back(RowJson(change));
    for (const ForceChange& change : report.forces) forces.push_back(ForceJson(change));
    list.push_back({{"mechanism", report.mechanism},
                    {"scenario", report.scenario},
                    {"versions", {report.version_old, report.version_new}},
                    {"unavailable", report.unavailable},
                    {"messages", report.messages},
                    {"states", report.states},
                    {"rows", std::move(rows)},
                    {"forces", std::move(forces)}});
  }
  return Dump({{"schema", "mbverify.upgrade/1"}, {"results", std::move(list)}});
}

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
                              .nrmse_new = ErrorAt(samples, times_s, new_forces)});
    return "";
  }

  std::optional<RowAnswer> Ask(const RowSurvey& survey) {
    if (options_.progress) options_.progress("the other version's rows", 0.0);
    std::vector<RowState> states;
    for (const SurveyedState& surveyed : survey.states) states.push_back(surveyed.state);
    const ForeignWitness program = Program("rows", "--rows");
    ProgramCall call(program);
    std::string& trouble = report_.unavailable;
    trouble = call.WriteInput("model.xml", survey.mjcf);
    if (trouble.empty()) {
      trouble = call.WriteInput("states.json", StatesJson(survey.driven, states));
    }
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

namespace {

// Of the softness, and of the largest velocity term: less is round-off. Both versions compute them
// by other sums in double precision, from aref whose largest part is 1e6 times as large.
constexpr double kRoundOff = 1e-6;

// What is known of MuJoCo's history between 2.2.2 and 3.14.
struct KnownChange {
  const char* kind;
  bool of_softness;  // else of the velocity term
  const char* text;
};
constexpr KnownChange kKnownChanges[] = {
    {"weld", true, "3.0: a weld's rotations are softened by their own inertia"},
    {"connect", false, "3.7.0: the velocity term is supplied"},
    {"weld", false, "3.7.0: the velocity term is supplied"},
};

std::string Explained(const std::string& kind, bool of_softness) {
  for (const KnownChange& change : kKnownChanges) {
    if (kind == change.kind && of_softness == change.of_softness) return change.text;
  }
  return of_softness ? "not explained: another softness" : "not explained: another velocity term";
}

std::string ReasonOf(const RowChange& change, double scale) {
  std::vector<std::string> reasons;
  const bool softness = std::max(std::abs(change.softness_least - 1.0),
                                 std::abs(change.softness_most - 1.0)) > kRoundOff;
  if (softness) reasons.push_back(Explained(change.kind, true));
  const bool old = change.left_out_old > kRoundOff * scale,
             now = change.left_out_new > kRoundOff * scale;
  if (old && !now) reasons.push_back(Explained(change.kind, false));
  if (old && now) reasons.emplace_back("the velocity term is left out by both");
  if (!old && now) reasons.emplace_back("not explained: the velocity term was right before");
  return reasons.empty() ? "nothing changed" : fmt::format("{}", fmt::join(reasons, "; "));
}

void Widen(const SurveyedState& state, const RowMeasures& now, Eigen::Index row,
           RowChange* change) {
  const double ratio = now.R[row] / state.present.R[row], term = state.velocity_term[row];
  change->softness_least = std::min(change->softness_least, ratio);
  change->softness_most = std::max(change->softness_most, ratio);
  change->velocity_term = std::max(change->velocity_term, std::abs(term));
  change->left_out_old = std::max(change->left_out_old, std::abs(term - state.present.bias[row]));
  change->left_out_new = std::max(change->left_out_new, std::abs(term - now.bias[row]));
}

RowChange ChangeOf(const std::string& kind, const RowSurvey& survey, const RowAnswer& answer) {
  RowChange change{.kind = kind, .softness_least = HUGE_VAL, .softness_most = 0.0};
  for (size_t row = 0; row < survey.kinds.size(); ++row) {
    if (survey.kinds[row] != kind) continue;
    ++change.rows;
    for (size_t i = 0; i < survey.states.size(); ++i) {
      Widen(survey.states[i], answer.states[i], static_cast<Eigen::Index>(row), &change);
    }
  }
  return change;
}

}  // namespace

std::vector<RowChange> CompareRows(const RowSurvey& survey, const RowAnswer& answer) {
  if (survey.equalities != answer.equalities) return {};
  std::vector<RowChange> changes;
  // Where all rows have none, a thousandth of the rates' square stands for it: what is left of
  // them then is round-off.
  double scale = 0.0;
  for (const SurveyedState& state : survey.states) {
    scale = std::max(scale, state.velocity_term.cwiseAbs().maxCoeff());
    if (state.state.qvel.size() == 0) continue;
    scale = std::max(scale, 1e-3 * std::pow(state.state.qvel.cwiseAbs().maxCoeff(), 2));
  }
  for (const std::string& kind : survey.kinds) {
    const bool known = std::any_of(changes.begin(), changes.end(),
                                   [&](const RowChange& change) { return change.kind == kind; });
    if (!known) changes.push_back(ChangeOf(kind, survey, answer));
  }
  for (RowChange& change : changes) change.why = ReasonOf(change, scale);
  return changes;
}

// mbverify crosscheck --newest

namespace {

// One scenario; its exit code.
int RunUpgrade(const std::string& file, const UpgradeArguments& arguments, UpgradeOptions* options,
               std::vector<UpgradeReport>* reports) {
  ProgressLine progress(true);
  if (progress.active()) {
    options->progress = [&](const std::string& stage, double fraction) {
      progress.Show(file + ": " + stage, fraction);
    };
  }
  const UpgradeOutcome outcome = Upgrade(file, *options);
  progress.Clear();
  SayText(stderr, outcome.diagnostics.Text());
  if (!outcome.failure.empty()) Say(stderr, "error: {}: {}\n", file, outcome.failure);
  if (outcome.report) {
    SayText(arguments.json.text(), ToText(*outcome.report));
    reports->push_back(*outcome.report);
  }
  return outcome.exit_code;
}

}  // namespace

int RunUpgrade(const UpgradeArguments& arguments) {
  UpgradeOptions options;
  if (!arguments.program.empty()) options.command = {arguments.program};
  if (!ReadAssignments(arguments.set, "--set", "simulation.step_s=0.002", &options.scenario.set))
    return 2;
  int exit_code = 0;
  const std::vector<std::string> files =
      FilesToRun(arguments.scenarios, {arguments.json.path()}, &exit_code);
  if (exit_code != 0) return exit_code;
  std::vector<UpgradeReport> reports;
  for (const std::string& file : files) {
    exit_code = WorseExit(exit_code, RunUpgrade(file, arguments, &options, &reports));
  }
  return WorseExit(exit_code, arguments.json.Write(ToJson(reports), {}));
}

}  // namespace mbv
