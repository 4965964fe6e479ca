#include "verify/run_witnesses.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/demand.h"
#include "base/roles.h"
#include "base/text.h"
#include "external/mechanism_json.h"
#include "external/motion_text.h"
#include "external/witness_answer.h"
#include "reference/forward.h"
#include "reference/reference.h"
#include "simulation/mjcf/mjcf.h"
#include "verify/drive_by.h"
#include "verify/model_text.h"
#include "verify/prepare.h"
#include "verify/program_call.h"

namespace mbv {

namespace {

constexpr size_t kMostVersion = 60, kMostReason = 500;  // bytes of what a program says of itself

class ForeignRunner {
 public:
  ForeignRunner(const ForeignWitness& witness, const Prepared& prepared, const Mechanism& mechanism)
      : witness_(witness),
        motion_(prepared.scenario.motion),
        mechanism_(mechanism),
        step_s_(prepared.scenario.simulation.step_s),
        call_(witness) {
    record_.required = witness.required;
    record_.foreign = Witness::Foreign{
        .program = "", .limits = witness.limits, .force_nrmse = witness.force_nrmse};
  }

  WitnessRecord Run(const DrivenMotion& driven) {
    std::optional<ProgramFailure> failure;
    std::string trouble = NotAskedReason();
    if (trouble.empty()) trouble = HandOver(driven);
    if (!trouble.empty()) failure = ProgramFailure{WitnessGap::kNotHandedOver, trouble};
    if (!failure) failure = call_.Run();
    if (!failure) failure = ReadBack();
    record_.name = record_.trace.witness = witness_.name;
    record_.summary =
        failure ? NotRun(Shortened(OneLine(failure->text), 1000)) : RunSummary::Done();
    record_.summary.wall_s = call_.wall_s();
    record_.summary.cpu_s = call_.cpu_s();
    if (failure) record_.trace = {};
    if (failure) record_.gap = failure->gap;
    return std::move(record_);
  }

 private:
  [[nodiscard]] std::string NotAskedReason() const {
    if (!motion_.switches.empty() || !JumpTimes(motion_).empty()) {
      return "switched elements and forces that jump are not handed to foreign witnesses";
    }
    for (const Load& load : motion_.loads) {
      if (!load.following.empty()) {
        return "loads that are expressions of the state are not handed to foreign witnesses";
      }
    }
    for (const DriveForce& force : motion_.forces) {
      if (force.following) {
        return "drive forces that are expressions of the state are not handed to foreign witnesses";
      }
    }
    for (const ForceElement& element : mechanism_.elements) {
      const auto* stop = std::get_if<StopLaw>(&element.law);
      if (std::holds_alternative<ExpressionLaw>(element.law) || (stop && stop->rigid())) {
        return fmt::format("the {} '{}' is not handed to foreign witnesses",
                           Described(mechanism_, element), element.name);
      }
    }
    for (const Drive& drive : mechanism_.drives) {
      if (!drive.compensates_gravity) continue;
      return fmt::format(
          "drive '{}' exerts gravity compensation, which is not handed to foreign witnesses",
          drive.name);
    }
    return "";
  }

  std::string HandOver(const DrivenMotion& driven) {
    HandedMotion handed;
    handed.time_s = times_s_ = SampleTimes(motion_.duration_s, motion_.sample_s);
    std::string trouble = Sample(driven, &handed);
    if (trouble.empty() && motion_.free()) trouble = HandOverFree(&handed);
    const std::pair<const char*, std::string> files[] = {
        {"mechanism.json", MechanismJson(mechanism_)},
        {"motion.csv", MotionCsv(mechanism_, handed)},
        {"loads.csv", LoadsCsv(mechanism_, handed)},
        {"model.xml", WriteMjcf(mechanism_, {.step_s = step_s_})},
        {"model.urdf", ModelText(mechanism_, ModelFormat::kUrdf)}};
    for (const auto& [name, text] : files) {
      if (trouble.empty()) trouble = call_.WriteInput(name, text);
    }
    return trouble;
  }

  std::string Sample(const DrivenMotion& driven, HandedMotion* handed) const {
    CommandSample sample;
    for (const double t_s : handed->time_s) {
      const RunSummary there = driven(t_s, &handed->driven.emplace_back());
      if (!there.ok()) return "there is no drive motion: " + there.message;
      EvaluateMotion(motion_, t_s, &sample);
      handed->loads.push_back(sample.loads);
      AddCompensation(&handed->loads.back());
    }
    return "";
  }

  // To them it is a load at the centre of mass, like others.
  void AddCompensation(std::vector<LoadSample>* loads) const {
    for (size_t b = 1; b < mechanism_.bodies.size(); ++b) {
      const Body& body = mechanism_.bodies[b];
      const double carried = body.gravity_compensation * body.mass;
      if (carried == 0.0) continue;
      loads->push_back({.body = static_cast<int>(b),
                        .p_BoQ_B = body.p_BoBcm_B,
                        .force = -carried * mechanism_.gravity_W});
    }
  }

  // What moves by forces: where it starts, and which forces drives push with.
  std::string HandOverFree(HandedMotion* handed) {
    for (const Drive& drive : mechanism_.drives) AddCommanded(drive.name, handed);
    for (const Prescribed& base : mechanism_.prescribed) AddCommanded(base.name, handed);
    for (const DriveForce& force : motion_.forces) handed->forced.push_back(force.drive);
    for (const double t_s : handed->time_s) {
      std::vector<Jet>& jets = handed->forces.emplace_back();
      for (const DriveForce& force : motion_.forces) jets.push_back(Evaluate(force.force, t_s));
    }
    BodyStates start;
    const RunSummary there = InitialStates(mechanism_, motion_, &start);
    if (!there.ok()) return "there is no start: " + there.message;
    const std::string trouble = call_.WriteInput("forces.csv", ForcesCsv(mechanism_, *handed));
    return trouble.empty() ? call_.WriteInput("start.csv", StartCsv(mechanism_, start)) : trouble;
  }

  void AddCommanded(const std::string& name, HandedMotion* handed) const {
    handed->commanded.push_back(motion_.FindCommand(name) >= 0);
  }

  std::optional<ProgramFailure> ReadBack() {
    const auto json = call_.Text("witness.json");
    if (!json) {
      return ProgramFailure{WitnessGap::kNoAnswer, "left no witness.json" + call_.OutputTail()};
    }
    std::string trouble;
    const auto answer = ReadAnswer(*json, &trouble);
    if (!answer) return ProgramFailure{WitnessGap::kBadAnswer, trouble};
    record_.foreign->program =
        QuotedValue(answer->program) +
        (answer->version.empty() ? "" : " " + QuotedValue(answer->version, kMostVersion));
    for (const auto& [what, why] : answer->left_out) {
      record_.foreign->left_out.emplace_back(QuotedValue(what), QuotedValue(why, kMostReason));
    }
    record_.foreign->compute_s = answer->compute_s;
    if (!answer->refused.empty()) {
      return ProgramFailure{WitnessGap::kOutOfScope,
                            "not applicable: " + QuotedValue(answer->refused, kMostReason)};
    }
    const auto csv = call_.Text("traces.csv");
    if (!csv) {
      return ProgramFailure{WitnessGap::kNoAnswer, "left no traces.csv" + call_.OutputTail()};
    }
    auto trace = ReadWitnessTrace(*csv, mechanism_, times_s_, &trouble);
    if (!trace) return ProgramFailure{WitnessGap::kBadAnswer, trouble};
    record_.trace = std::move(*trace);
    return {};
  }

  const ForeignWitness& witness_;
  const Motion& motion_;
  const Mechanism& mechanism_;
  const double step_s_;
  ProgramCall call_;
  std::vector<double> times_s_;
  WitnessRecord record_;
};

}  // namespace

WitnessRecord RunForeign(const ForeignWitness& witness, const Prepared& prepared,
                         const Mechanism& mechanism, const DrivenMotion& driven) {
  return ForeignRunner(witness, prepared, mechanism).Run(driven);
}

namespace {

constexpr const char* kSwitchedOff = "switched off in the scenario";

bool Always(const Prepared&) { return true; }

// The generic solver takes part beside a table where no closed form does: it gives the drive
// motion, and a third opinion.
bool SolvesBesideTable(const Prepared& prepared) {
  return prepared.has_table() && prepared.scenario.reference.on && !prepared.has_closed_form();
}

bool HasServos(const Prepared& prepared) {
  return prepared.scenario.simulation.mode == DriveMode::kServo;
}

}  // namespace

// A witness' row: when it takes part and what it computes.
struct WitnessRunner::Computation {
  const Role& role;
  bool (*takes_part)(const Prepared&);
  void (WitnessRunner::*run)();

  // Needs the motion that another one computes.
  [[nodiscard]] bool follows() const {
    return role.is_engine() || role.kind == RoleKind::kAfterwards;
  }
};

const std::vector<WitnessRunner::Computation>& WitnessRunner::Computations() {
  static const std::vector<Computation> kComputations = {
      {role::kAnalytic, &Always, &WitnessRunner::RunAnalytic},
      {role::kReference, &Always, &WitnessRunner::RunReferenceOrTable},
      {role::kSolver, &SolvesBesideTable, &WitnessRunner::RunSolver},
      {role::kSimulated, &Always, &WitnessRunner::RunSimulated},
      {role::kReached, &HasServos, &WitnessRunner::RunReached}};
  return kComputations;
}

const WitnessRecord* WitnessRuns::Find(const Role& role) const {
  const auto found = std::find_if(records.begin(), records.end(),
                                  [&](const WitnessRecord& w) { return w.name == role; });
  return found == records.end() ? nullptr : &*found;
}

void WitnessRuns::HandOver(ComparisonInput* input) const {
  for (const WitnessRecord& record : records) {
    input->witnesses.push_back({record.name, record.trace.time_s.empty() ? nullptr : &record.trace,
                                record.summary, record.foreign, record.gap, record.required});
  }
  if (table) input->table = &*table;
  if (perturbed) input->perturbed = &*perturbed;
  if (!std::isnan(perturbation)) input->perturbation = perturbation;
  input->integration_error = integration_error;
}

WitnessRunner::WitnessRunner(const Prepared& prepared, SimulatedSide side,
                             ProgressFunction progress)
    : prepared_(prepared), side_(std::move(side)), progress_(std::move(progress)) {}

const Scenario& WitnessRunner::scenario() const {
  return side_.scenario == nullptr ? prepared_.scenario : *side_.scenario;
}

const Mechanism& WitnessRunner::simulated() const {
  return side_.mechanism == nullptr ? prepared_.mechanisms.simulated : *side_.mechanism;
}

DrivenMotion WitnessRunner::Driven() const {
  return side_.driven ? side_.driven : prepared_.MakeDrivenMotion();
}

DriveForces WitnessRunner::Forces() const {
  return side_.forces ? side_.forces : prepared_.MakeDriveForces();
}

Engine WitnessRunner::judged_engine() const {
  return prepared_.scenario.simulation.stock_engine ? Engine::kStock : Engine::kCorrected;
}

bool WitnessRunner::TakesPart(const Role& role) const {
  const auto& rows = Computations();
  const auto row = std::find_if(rows.begin(), rows.end(),
                                [&](const Computation& c) { return &c.role == &role; });
  return row != rows.end() && row->takes_part(prepared_);
}

void WitnessRunner::Run(const Role& role) {
  for (const Computation& computation : Computations()) {
    if (&computation.role == &role) (this->*computation.run)();
  }
}

void WitnessRunner::RunThose(bool following) {
  for (const Computation& computation : Computations()) {
    if (computation.follows() != following || !computation.takes_part(prepared_)) continue;
    (this->*computation.run)();
  }
}

void WitnessRunner::RunComputed() { RunThose(false); }

void WitnessRunner::RunFollowing() { RunThose(true); }

const WitnessRecord& WitnessRunner::driver() const {
  const WitnessRecord* record = runs_.Find(prepared_.driver());
  MBV_DEMAND(record != nullptr, prepared_.driver().name);
  return *record;
}

bool WitnessRunner::CheckStrokes() {
  const auto violations = DriveViolations(prepared_.base, driver().trace);
  if (violations.empty()) return true;
  const bool ignore = scenario().simulation.ignore_ranges;
  AddFindings(violations, scenario().file, ignore ? Severity::kWarning : Severity::kError,
              &runs_.findings);
  if (ignore) return true;
  LeaveOut(role::kSimulated, LimitSummary(violations));
  return false;
}

void WitnessRunner::Add(const Role& role, RunSummary summary, Trace trace) {
  trace.witness = role.name;
  runs_.records.push_back({role.name, std::move(summary), std::move(trace)});
}

Trace WitnessRunner::Earlier(const Role& role) {
  for (WitnessRecord& record : reuse_.records) {
    if (record.name == role) return std::move(record.trace);
  }
  return {};
}

void WitnessRunner::LeaveOut(const Role& role, RunSummary why) { Add(role, std::move(why), {}); }

void WitnessRunner::Warn(const std::string& text) {
  Finding finding;
  finding.severity = Severity::kWarning;
  finding.message = text;
  runs_.findings.Add(std::move(finding));
}

void WitnessRunner::RunAnalytic() {
  if (!prepared_.has_closed_form()) {
    LeaveOut(role::kAnalytic, NotRun(prepared_.closed_form.reason));
    runs_.records.back().gap = prepared_.closed_form.gap;
    runs_.records.back().required = scenario().analytic.required;
    return;
  }
  ClosedFormRun run =
      RunClosedForm(prepared_.mechanisms.analytic, scenario().motion,
                    prepared_.closed_form.closed_form.get(), Earlier(role::kAnalytic));
  runs_.timing.analytic_s = run.summary.wall_s;
  Add(role::kAnalytic, std::move(run.summary), std::move(run.trace));
  runs_.records.back().required = scenario().analytic.required;
}

// The generic solver, or a table in its place.
void WitnessRunner::RunReferenceOrTable() {
  if (!scenario().reference.on) return LeaveOut(role::kReference, NotRun(kSwitchedOff));
  if (!prepared_.has_table()) return Solve(role::kReference);
  runs_.table = AlignTable(*scenario().reference.table, scenario().motion);
  const bool any = !runs_.table->trace.time_s.empty();
  Add(role::kReference, any ? RunSummary::Done() : NotRun(runs_.table->grid), runs_.table->trace);
}

void WitnessRunner::RunSolver() { Solve(role::kSolver); }

void WitnessRunner::Solve(const Role& role) {
  if (scenario().motion.free()) return SolveFree(role);
  ReferenceRun run =
      RunReference(prepared_.mechanisms.reference, scenario().motion, {}, {}, Earlier(role));
  runs_.timing.reference_s = run.summary.wall_s;
  Add(role, std::move(run.summary), std::move(run.trace));
}

void WitnessRunner::SolveFree(const Role& role) {
  ForwardRun run = RunForwardReference(prepared_.mechanisms.reference, scenario().motion,
                                       {.progress = StageOf(progress_, role::kReference.called)});
  runs_.timing.reference_s = run.summary.wall_s;
  runs_.trust = TrustLine(run);
  runs_.integration_error = run.uncertainty;
  for (const std::string& text : CrossingTexts(run, scenario().motion.duration_s)) Warn(text);
  Add(role, std::move(run.summary), std::move(run.trace));
}

// On the commanded motion, where it is known.
void WitnessRunner::RunForeign() {
  for (const ForeignWitness& witness : scenario().witnesses) {
    if (progress_) progress_(witness.name, 0.0);
    runs_.records.push_back(mbv::RunForeign(witness, prepared_, prepared_.base, Driven()));
    runs_.timing.foreign_s += runs_.records.back().summary.wall_s;
  }
}

void WitnessRunner::RunSimulated() {
  const Role& role = role::kSimulated;
  if (!scenario().simulation.on) return LeaveOut(role, NotRun(kSwitchedOff));
  const bool needs_driver = !side_.driven && (!scenario().motion.free() || scenario().reference.on);
  if (needs_driver && !driver().summary.ok()) {
    return LeaveOut(
        role, NotRun(fmt::format("there is no drive motion, because {} failed", driver().name)));
  }
  SimulatedWitness witness = Simulate(judged_engine(), role.called);
  runs_.bad_input.Append(witness.diagnostics);
  runs_.timing.simulation_s = witness.run.summary.wall_s;
  runs_.timing.loop_s = witness.run.loop_wall_s;
  runs_.timing.steps = witness.run.steps;
  for (const std::string& warning : witness.run.warnings) Warn("MuJoCo: " + warning);
  for (const std::string& note : witness.run.notes) Warn(note);
  CheckRanges(&witness.run);
  Add(role, witness.run.summary, witness.run.trace);
  runs_.simulation = std::move(witness.run);
}

// Joint ranges along the simulated motion.
void WitnessRunner::CheckRanges(SimulationRun* run) {
  if (!run->summary.ok()) return;
  const bool ignore = scenario().simulation.ignore_ranges;
  const Mechanism& mechanism = side_.ranges == nullptr ? prepared_.base : *side_.ranges;
  runs_.violations = JointViolations(mechanism, run->trace.time_s, run->X_WB);
  AddFindings(runs_.violations, scenario().file, ignore ? Severity::kWarning : Severity::kError,
              &runs_.findings);
  if (!runs_.violations.empty() && !ignore) run->summary = LimitSummary(runs_.violations);
}

// The reference where the servos went.
void WitnessRunner::RunReached() {
  if (!runs_.simulation || !runs_.simulation->summary.ok()) return;
  ReferenceRun run =
      mbv::RunReached(prepared_.mechanisms.reference, scenario().motion, runs_.simulation->trace);
  Add(role::kReached, std::move(run.summary), std::move(run.trace));
}

void WitnessRunner::RunPerturbed() {
  const std::optional<double>& limit = scenario().checks[Metric::kForceNrmse].forward;
  runs_.perturbation = limit.value_or(*RowOf(Metric::kForceNrmse).limits.forward);
  SimulationOptions options = OptionsOf(scenario(), simulated(), judged_engine());
  options.forces = PerturbedForces(Forces(), prepared_.base, driver().trace, runs_.perturbation);
  SimulatedWitness perturbed = Simulate(options, "perturbed forces");
  if (!perturbed.run.summary.ok()) {
    return Warn("perturbed forces: " + perturbed.run.summary.message);
  }
  runs_.perturbed = std::move(perturbed.run.trace);
  runs_.perturbed->witness = role::kPerturbed.name;
}

SimulatedWitness WitnessRunner::Simulate(Engine engine, const std::string& stage) const {
  SimulationOptions options = OptionsOf(scenario(), simulated(), engine);
  if (engine == judged_engine()) options.forces = Forces();
  return Simulate(options, stage);
}

SimulatedWitness WitnessRunner::Simulate(const SimulationOptions& options,
                                         const std::string& stage) const {
  return RunSimulation(scenario(), simulated(), Driven(), options, StageOf(progress_, stage));
}

ComparisonInput InputOf(const Prepared& prepared) {
  const Scenario& scenario = prepared.scenario;
  const SimulationSettings& simulation = scenario.simulation;
  return {.mechanism = &prepared.base,
          .motion = scenario.phase ? &scenario.phase->in_scenario_time : &scenario.motion,
          .limits = scenario.checks,
          .simulation_limits = simulation.forward() ? LimitColumn::kForward : LimitColumn::kInverse,
          .start_window_s = scenario.start_window_s,
          .driven_by = prepared.driver().name,
          .mode = simulation.mode,
          .own_parameters = OwnParameters(scenario, prepared.base),
          .left_out = TextsOf(scenario.model_caveats, ModelCaveat::Kind::kLeftOut),
          .unchecked_coverage = prepared.closed_form.unchecked};
}

// At rest an acceleration that equals the velocity takes the momentum p = M v, and the drives
// accelerate by v.
std::vector<DriveFacts> DriveFactsOf(const Prepared& prepared) {
  const std::vector<Motor>& motors = prepared.base.motors;
  const Motion& motion = prepared.scenario.motion;
  std::vector<DriveFacts> facts(motors.size());
  const auto brakes = [](const Motor& motor) { return motor.brake.has_value(); };
  if (motion.free() || std::ranges::none_of(motors, brakes)) return facts;
  ReferenceSolver solver(prepared.mechanisms.reference, motion, {.explain_unreached = false});
  const std::vector<double> times = SampleTimes(motion.duration_s, motion.sample_s);
  for (DriveFacts& fact : facts) {
    fact.at_rest.force.resize(static_cast<Eigen::Index>(times.size()));
    fact.at_rest.energy_J.resize(static_cast<Eigen::Index>(times.size()));
  }
  CommandSample command;
  ReferenceSample rests, moves;
  for (size_t i = 0; i < times.size(); ++i) {
    EvaluateMotion(motion, times[i], &command);
    const VecX rate = command.velocity;
    command.velocity.setZero();
    command.acceleration.setZero();
    if (!solver.Dynamics(command, &rests).ok()) return std::vector<DriveFacts>(motors.size());
    command.acceleration = rate;
    if (!solver.Dynamics(command, &moves).ok()) return std::vector<DriveFacts>(motors.size());
    for (size_t k = 0; k < motors.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(i);
      const int d = motors[k].drive;
      const double momentum = moves.drive_force[d] - rests.drive_force[d];
      facts[k].at_rest.force[row] = rests.drive_force[d];
      facts[k].at_rest.energy_J[row] = 0.5 * momentum * moves.driven.acceleration[d];
    }
  }
  return facts;
}

void InScenarioTime(const Scenario& scenario, RunSummary* summary, Trace* trace) {
  if (!scenario.phase || scenario.phase->from_s == 0.0) return;
  const double from_s = scenario.phase->from_s, sample_s = scenario.motion.sample_s;
  // On the same grid as without phases.
  const auto first = std::llround(from_s / sample_s);
  for (double& time_s : trace->time_s) {
    time_s = static_cast<double>(first + std::llround(time_s / sample_s)) * sample_s;
  }
  for (MotionEvent& event : trace->events) event.time_s += from_s;
  summary->time_s += from_s;
  if (summary->states_time) {
    summary->message += fmt::format(" (its times begin at {:g} s)", from_s);
  }
}

SimulationOptions OptionsOf(const Scenario& scenario, const Mechanism& mechanism, Engine engine) {
  const SimulationSettings& settings = scenario.simulation;
  SimulationOptions options;
  options.engine = engine;
  options.step_s = settings.step_s;
  // Other engines are run on the prescribed motion.
  if (!settings.forward() || engine == Engine::kCorrected) options.mode = settings.mode;
  if (options.mode == DriveMode::kServo) options.servo = GainsOf(settings.servo, mechanism);
  return options;
}

Trace Extrapolate(const Trace& a, double at_a, const Trace& b, double at_b, double target) {
  MBV_DEMAND(a.values.rows() == b.values.rows() && a.values.cols() == b.values.cols(),
             a.values.rows());
  MBV_DEMAND(at_a != at_b, at_a);
  Trace trace = a;
  const double factor = (target - at_a) / (at_b - at_a);
  for (size_t c = 0; c < a.channels.size(); ++c) {
    const auto column = static_cast<Eigen::Index>(c);
    const Channel& channel = a.channels[c];
    if (channel.unit == "N" || channel.unit == "N m" || channel.unit == "W" ||
        channel.unit == "J") {
      trace.values.col(column) += factor * (b.values.col(column) - a.values.col(column));
    } else if (channel.quantity == Quantity::kLoopGap || channel.quantity == Quantity::kLoopTwist) {
      const auto worse = [](double x, double y) { return std::isnan(x) || x > y ? x : y; };
      trace.values.col(column) =
          a.values.col(column).cwiseAbs().binaryExpr(b.values.col(column).cwiseAbs(), worse);
    }
  }
  return trace;
}

namespace {

// From two models that are loaded anew; their forces are linear in the parameter.
void RunExtrapolated(const Scenario& scenario, const Mechanism& mechanism,
                     const DrivenMotion& driven, const SimulationOptions& options,
                     const std::function<void(double)>& progress, SimulatedWitness* witness) {
  MBV_DEMAND(!scenario.motion.free(), scenario.name);  // forces are not linear in it
  const Extrapolation& extrapolation = *scenario.simulation.extrapolate;
  const Overrides base = Merge(scenario.parameters, scenario.simulation.parameters);
  std::array<SimulationRun, 2> runs;
  for (size_t k = 0; k < 2; ++k) {
    const Mechanism variant = LoadVariant(
        scenario, mechanism, Merge(base, {{extrapolation.parameter, extrapolation.from[k]}}),
        role::kSimulated, &witness->diagnostics);
    if (witness->diagnostics.has_errors()) return;
    const auto half = [&](double fraction) {
      if (progress) progress(0.5 * (static_cast<double>(k) + fraction));
    };
    runs[k] = Simulate(variant, scenario.motion, driven, options, half);
    if (!runs[k].summary.ok()) {
      witness->run = std::move(runs[k]);
      return;
    }
  }
  const double target = mechanism.ParameterValue(extrapolation.parameter);
  Trace trace = Extrapolate(runs[0].trace, extrapolation.from[0], runs[1].trace,
                            extrapolation.from[1], target);
  witness->run = std::move(runs[0]);
  witness->run.trace = std::move(trace);
  witness->run.steps += runs[1].steps;
  witness->run.loop_wall_s += runs[1].loop_wall_s;
  witness->run.loop_cpu_s += runs[1].loop_cpu_s;
  witness->run.summary.wall_s += runs[1].summary.wall_s;
  witness->run.summary.cpu_s += runs[1].summary.cpu_s;
}

}  // namespace

SimulatedWitness RunSimulation(const Scenario& scenario, const Mechanism& mechanism,
                               const DrivenMotion& driven, const SimulationOptions& options,
                               const std::function<void(double)>& progress) {
  SimulatedWitness witness;
  const Diagnostics option_findings = Check(options);
  for (const Finding& finding : option_findings.findings()) {
    witness.diagnostics.AddError(scenario.file, "simulation: " + finding.message, finding.hint);
  }
  if (witness.diagnostics.has_errors()) return witness;
  if (scenario.simulation.extrapolate) {
    RunExtrapolated(scenario, mechanism, driven, options, progress, &witness);
    return witness;
  }
  SimulationOptions started = options;
  if (scenario.motion.free()) {
    witness.run.summary = InitialStates(mechanism, scenario.motion, &started.start);
    if (!witness.run.summary.ok()) return witness;
  }
  witness.run = Simulate(mechanism, scenario.motion, driven, started, progress);
  return witness;
}

SimulatedWitness RunSimulation(const Scenario& scenario, const Mechanism& mechanism,
                               const DrivenMotion& driven, Engine engine,
                               const std::function<void(double)>& progress) {
  return RunSimulation(scenario, mechanism, driven, OptionsOf(scenario, mechanism, engine),
                       progress);
}

}  // namespace mbv
