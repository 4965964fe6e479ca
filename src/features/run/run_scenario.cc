#include "features/run/run_scenario.h"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "base/demand.h"
#include "base/files.h"
#include "base/inputs.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "comparison/comparison.h"
#include "comparison/force_band.h"
#include "comparison/metrics.h"
#include "features/equation_audit/audit.h"
#include "features/mjcf_audit/source_audit.h"
#include "features/run/engine_errors.h"
#include "features/run/join_phases.h"
#include "kinematics/command_rank.h"
#include "kinematics/mobility.h"
#include "kinematics/singularity.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "mechanism/reach.h"
#include "model_file/yaml/yaml_reader.h"
#include "reference/reference.h"
#include "report/data/data_file.h"
#include "report/html_report.h"
#include "report/report.h"
#include "report/sections.h"
#include "report/sizing.h"
#include "scenario/find_model.h"
#include "scenario/tables/table.h"
#include "verify/check_file.h"
#include "verify/drive_by.h"
#include "verify/pictures.h"
#include "verify/run_witnesses.h"
#include "verify/version.h"

namespace mbv {

namespace {

// Was a table made with another value of g than the model has?

constexpr double kUsual[] = {9.80665, 9.81, 9.8};
constexpr double kNear = 2e-3, kSame = 1e-9;  // relative
// Another g must take away this much of the difference.
constexpr double kClearly = 0.2;

// RMS over the table's force columns of their difference to a run with this gravity, each relative
// to its own RMS; empty where the run or the columns are missing.
std::optional<double> Misfit(Mechanism mechanism, const Motion& motion, const AlignedTable& table,
                             double start_window_s, double g) {
  mechanism.gravity_W *= g / mechanism.gravity_W.norm();
  const ReferenceRun run = RunReference(mechanism, motion);
  if (!run.summary.ok()) return {};
  const CommonSamples samples = AlignSamples(table.trace, run.trace);
  double sum2 = 0.0, columns = 0.0;
  for (size_t c = 0; c < table.trace.channels.size(); ++c) {
    const Channel& channel = table.trace.channels[c];
    const int other = run.trace.Find(channel.name);
    const bool force =
        channel.quantity == Quantity::kForce || channel.quantity == Quantity::kBaseForce;
    if (!force || other < 0) continue;
    ErrorSum sum;
    for (const auto& [i, j] : samples) {
      const double time_s = table.trace.time_s[static_cast<size_t>(i)];
      if (time_s < start_window_s) continue;
      const double value = table.trace.values(i, static_cast<Eigen::Index>(c));
      sum.Add(value - run.trace.values(j, other), value, time_s, channel.name);
    }
    if (sum.count() == 0 || !(sum.rms_truth() > 0.0)) continue;
    sum2 += sum.Nrmse() * sum.Nrmse();
    columns += 1.0;
  }
  if (columns == 0.0) return {};
  return std::sqrt(sum2 / columns);
}

// A sentence if the table's forces fit 9.80665, 9.81 or 9.8 m/s² clearly better than the model's
// own, near value of g; "" otherwise. The reference is computed again with each. Such a table
// differs by 3e-4 of the weight only, which tolerances of tables hide.
std::string GravityWarning(const Mechanism& mechanism, const Motion& motion,
                           const AlignedTable& table, double start_window_s) {
  const double g = mechanism.gravity_W.norm();
  if (!(std::abs(g / kUsual[0] - 1.0) < kNear)) return "";
  const auto own = Misfit(mechanism, motion, table, start_window_s, g);
  if (!own) return "";
  std::string text;
  double best = kClearly * *own;
  for (const double usual : kUsual) {
    if (std::abs(g / usual - 1.0) < kSame) continue;
    const auto other = Misfit(mechanism, motion, table, start_window_s, usual);
    if (!other || !(*other < best)) continue;
    best = *other;
    text = fmt::format(
        "the forces of the table {} fit g = {:g} m/s² better than the model's {:g}: RMS difference "
        "{:.1e} instead of {:.1e} of their own RMS",
        table.name, usual, g, *other, *own);
  }
  return text;
}

}  // namespace
namespace {

// How much of the drive forces smoothing of a motion's tables takes out.

bool IsSmoothed(const MotionTable& table) { return table.moves && table.smoothed(); }

// The same motion through all rows.
Motion ThroughAllRows(Motion motion) {
  for (Command& command : motion.commands) {
    for (ProfileTerm& term : command.profile.terms) {
      auto* pieces = std::get_if<PiecewiseTerm>(&term);
      if (pieces == nullptr) continue;
      for (const MotionTable& table : motion.tables) {
        if (pieces->pieces == table.spline) pieces->pieces = table.interpolated;
      }
    }
  }
  return motion;
}

SmoothedForce Difference(const Trace& smooth, const Trace& rough, const Drive& drive) {
  const int a = smooth.Find(Quantity::kForce, drive.name);
  const int b = rough.Find(Quantity::kForce, drive.name);
  const VecX change = smooth.values.col(a) - rough.values.col(b);
  const double samples = std::sqrt(static_cast<double>(change.size()));
  return {.drive = drive.name,
          .unit = smooth.channels[static_cast<size_t>(a)].unit,
          .rms = smooth.values.col(a).norm() / samples,
          .change_rms = change.norm() / samples,
          .change_max = change.cwiseAbs().maxCoeff()};
}

// The reference along the motion against the reference along the same motion with every smoothed
// table's spline put through all its rows. Empty without a smoothed command, for free motions, and
// where the reference fails.
std::vector<SmoothedForce> SmoothedForces(const Mechanism& mechanism, const Motion& motion) {
  if (motion.free() || std::none_of(motion.tables.begin(), motion.tables.end(), IsSmoothed)) {
    return {};
  }
  const ReferenceRun smooth = RunReference(mechanism, motion);
  const ReferenceRun rough = RunReference(mechanism, ThroughAllRows(motion));
  if (!smooth.summary.ok() || !rough.summary.ok()) return {};
  std::vector<SmoothedForce> forces;
  for (const Drive& drive : mechanism.drives) {
    forces.push_back(Difference(smooth.trace, rough.trace, drive));
  }
  return forces;
}

}  // namespace
namespace {

// Forces that a run reports although many would do: which, and how one was chosen.

std::string DrivesText(const Mechanism& mechanism, const std::vector<std::string>& drives) {
  bool moments = false, forces = false;
  for (const std::string& name : drives) {
    const Drive& drive = mechanism.drives[static_cast<size_t>(mechanism.FindDrive(name))];
    (ForceUnit(mechanism, drive) == "N" ? forces : moments) = true;
  }
  std::string text = "drive forces not unique: minimum norm over " + Joined(drives);
  if (moments && forces) {
    text += fmt::format(", moments divided by the characteristic length {:.4g} m",
                        CharacteristicLength(mechanism));
  }
  return text;
}

// Drives that share a force among them, those of given force left out; none if it is only one.
std::vector<std::string> SharedDrives(const Mechanism& mechanism, const Motion& motion,
                                      const Mobility& mobility) {
  std::vector<std::string> shared;
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    if (motion.FindForce(static_cast<int>(d)) >= 0) continue;
    const std::string& name = mechanism.drives[d].name;
    if (Contains(mobility.drives_not_unique, name)) shared.push_back(name);
  }
  if (shared.size() < 2) shared.clear();
  return shared;
}

// Sentences. `simulated`: drives and prescribed joints that MuJoCo's rows leave open at
// the last sample, where a pose may have taken a constraint away that is there at home.
std::vector<std::string> SharedForceTexts(const Mechanism& mechanism,
                                          const std::vector<std::string>& drives,
                                          const std::vector<std::string>& simulated) {
  std::vector<std::string> texts;
  if (!drives.empty()) texts.push_back(DrivesText(mechanism, drives));
  std::vector<std::string> more;
  for (const std::string& name : simulated) {
    if (!Contains(drives, name)) more.push_back(name);
  }
  if (!more.empty()) {
    texts.push_back(
        fmt::format("simulation: the force{} of {} {} not unique, a self-stress acts "
                    "there; of all that fit, those of least norm are recorded",
                    more.size() == 1 ? "" : "s", Joined(more), more.size() == 1 ? "is" : "are"));
  }
  return texts;
}

}  // namespace
namespace {

// The inertia that a drive moves.

// All drives at home; one of them accelerates by 1 at t = 0: home + 1 − cos t.
Motion FromHome(const Mechanism& mechanism, int moving) {
  Motion motion{.duration_s = 1e-3, .sample_s = 1e-3, .commands = {}, .loads = {}};
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    const Coordinate coordinate{Coordinate::Kind::kDrive, static_cast<int>(d), 0};
    Profile profile = Constant(HomeValue(mechanism, coordinate));
    if (static_cast<int>(d) == moving) {
      profile.terms.emplace_back(ConstantTerm{1.0});
      profile.terms.emplace_back(SineTerm{-1.0, 0.5 / std::numbers::pi, 0.5 * std::numbers::pi});
    }
    motion.commands.push_back({mechanism.drives[d].name, {{coordinate, 1.0}}, profile});
  }
  return motion;
}

// The drive's force at t = 0; NaN where the reference fails.
double ForceAtStart(const Mechanism& mechanism, int drive, int moving) {
  const ReferenceRun run = RunReference(mechanism, FromHome(mechanism, moving));
  const std::string& name = mechanism.drives[static_cast<size_t>(drive)].name;
  const int column = run.trace.Find(Quantity::kForce, name);
  return run.summary.ok() && column >= 0 ? run.trace.values(0, column) : kNan;
}

// Force of a drive per its own acceleration at the home pose, at rest, while all other drives hold
// [kg or kg m²], by the reference. NaN where the drives alone do not determine the motion.
double LoadInertia(const Mechanism& mechanism, int drive) {
  const CommandRank rank = RankCommands(mechanism, FromHome(mechanism, -1).commands);
  const auto drives = static_cast<int>(mechanism.drives.size());
  if (drives != rank.dofs || rank.redundant > 0 || !mechanism.prescribed.empty()) return kNan;
  return ForceAtStart(mechanism, drive, drive) - ForceAtStart(mechanism, drive, -1);
}

// Of all bodies per sample, as far as the reference gets.
std::vector<std::vector<Pose>> ReferencePoses(const Mechanism& mechanism, const Motion& motion) {
  std::vector<std::vector<Pose>> X_WB;
  ReferenceSolver solver(mechanism, motion, {.explain_unreached = false});
  CommandSample command;
  ReferenceSample sample;
  for (const double t_s : SampleTimes(motion.duration_s, motion.sample_s)) {
    EvaluateMotion(motion, t_s, &command);
    if (!solver.Kinematics(command, &sample).ok()) break;
    X_WB.push_back(sample.states.X_WB);
  }
  return X_WB;
}

}  // namespace
namespace {

int ExitCodeOf(Verdict verdict) {
  return verdict == Verdict::kAgree ? 0 : verdict == Verdict::kDisagree ? 1 : 3;
}

// What a quarter of the step brings below this share came from the step: first order would leave a
// quarter.
constexpr double kStepsShare = 0.3;
constexpr double kMostFineSteps = 1e6;  // longer runs are not repeated

class ScenarioRun {
 public:
  ScenarioRun(const std::string& file, const RunOptions& options)
      : file_(file), options_(options) {}

  RunOutcome Run() {
    const auto start = std::chrono::steady_clock::now();
    std::vector<Prepared> phases =
        PreparePhases(file_, options_.scenario, &outcome_.diagnostics, options_.programs);
    if (phases.empty()) return BadInput();
    const bool in_phases = phases.front().scenario.phase.has_value();
    if (in_phases && options_.after_judgement) {
      outcome_.diagnostics.AddError(
          file_,
          "phases: --certify and --derivatives are of one mechanism, and each phase is another",
          "one phase alone: a scenario with contacts: […]");
      return BadInput();
    }
    prepared_ = std::move(phases.front());
    const ProgramList programs = ProgramsOf(scenario(), options_.programs.archived);
    if (!options_.programs.Allows(programs)) {
      outcome_.diagnostics.Add(Refusal(programs));
      return BadInput();
    }
    outcome_.figures = scenario().figures;
    if (in_phases) {
      RunPhases(&phases);
    } else {
      Compute();
    }
    if (outcome_.diagnostics.has_errors()) return BadInput();
    if (options_.after_judgement) options_.after_judgement(*prepared_, &report_);
    RunSourceModel();
    DrawPictures();
    report_.timing.total_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    report_.exit_code = ExitCodeOf(report_.comparison.verdict);
    outcome_.exit_code = report_.exit_code;
    WriteFiles();
    outcome_.report = std::move(report_);
    return std::move(outcome_);
  }

 private:
  [[nodiscard]] const Scenario& scenario() const { return prepared_->scenario; }
  [[nodiscard]] const Mechanism& base() const { return prepared_->base; }

  RunOutcome BadInput() {
    outcome_.exit_code = 2;
    return std::move(outcome_);
  }

  // Runs and judges what is prepared.
  void Compute() {
    Describe();
    RunWitnesses();
    if (!outcome_.diagnostics.has_errors()) Judge();
  }

  // Each phase as a run of its own, then their one result.
  void RunPhases(std::vector<Prepared>* phases) {
    std::vector<PhaseRun> runs;
    for (size_t k = 0; k < phases->size(); ++k) {
      ScenarioRun part(file_, options_);
      part.outcome_.diagnostics = outcome_.diagnostics;
      part.prepared_ = std::move(k == 0 ? *prepared_ : (*phases)[k]);
      part.Compute();
      if (part.outcome_.diagnostics.has_errors()) {
        outcome_.diagnostics = std::move(part.outcome_.diagnostics);
        return;
      }
      if (part.runs_.simulation) phase_mjcf_.push_back(part.runs_.simulation->mjcf);
      runs.push_back(
          {*part.scenario().phase, std::move(part.report_), std::move(part.runs_.simulation)});
      if (k == 0) prepared_ = std::move(part.prepared_);
    }
    report_ = JoinPhases(base(), &runs);
    runs_.simulation = JoinSimulations(&runs);
    // Pictures are of the whole.
    prepared_->scenario.motion.duration_s = report_.duration_s;
  }

  void Describe() {
    const SimulationSettings& simulation = scenario().simulation;
    report_.scenario = scenario().name;
    report_.scenario_file = scenario().file;
    report_.mechanism = base().name;
    report_.model_file = scenario().model_file;
    report_.description = scenario().description;
    for (const Drive& drive : base().drives) {
      report_.drives.push_back(drive.name);
      report_.symbols.push_back(drive.symbol);
    }
    report_.mode = ModeText(simulation);
    report_.engine = simulation.stock_engine ? "stock" : "corrected";
    report_.step_s = simulation.step_s;
    report_.duration_s = scenario().motion.duration_s;
    report_.sample_s = scenario().motion.sample_s;
    report_.start_window_s = scenario().start_window_s;
    report_.driven_by = prepared_->driver().name;
    report_.simulation = SimulationLine(*prepared_);
    report_.findings = outcome_.diagnostics;
    report_.versions = Versions();
  }

  // Those that compute; then, if the drives can go there, those that follow.
  void RunWitnesses() {
    WitnessRunner runner(*prepared_, {}, options_.progress);
    runner.RunComputed();
    if (runner.CheckStrokes()) {
      runner.RunFollowing();
      RunErrorMeasures(&runner);
      runner.RunForeign();
    }
    runs_ = runner.Take();
    outcome_.diagnostics.Append(runs_.bad_input);
    report_.findings.Append(runs_.findings);
    if (!runs_.trust.empty()) report_.simulation += "; " + runs_.trust;
    report_.timing = runs_.timing;
    report_.timing.stated = options_.timed;
    for (const EngineRun& run : other_engines_) {
      if (run.engine != runner.judged_engine()) report_.timing.stock_s += run.summary.wall_s;
    }
    if (runs_.simulation) report_.simulated_not_unique = runs_.simulation->not_unique;
    for (WitnessRecord& record : runs_.records) {
      InScenarioTime(scenario(), &record.summary, &record.trace);
    }
    if (runs_.simulation) {
      InScenarioTime(scenario(), &runs_.simulation->summary, &runs_.simulation->trace);
    }
  }

  // What the simulation's error is measured by, where it ran: other engines, or wrong forces.
  void RunErrorMeasures(WitnessRunner* runner) {
    const auto& simulation = runner->runs().simulation;
    if (!simulation || !simulation->summary.ok()) return;
    if (PrescribesMotion(scenario().simulation.mode)) RunOtherEngines(*runner);
    if (scenario().simulation.mode == DriveMode::kForceDriven) runner->RunPerturbed();
  }

  // The simulator's own modelling error: the same run by the other engines.
  void RunOtherEngines(const WitnessRunner& runner) {
    const SimulationSettings& settings = scenario().simulation;
    if (scenario().motion.free()) RunStockFriction(runner);
    // Its error is stated in drive forces, which a free motion does not compare.
    if (scenario().motion.free() || !settings.forward() || !settings.stock_too) return;
    for (const Engine engine : {Engine::kDefaults, Engine::kStock, Engine::kCorrected}) {
      EngineRun& run = other_engines_.emplace_back();
      run.engine = engine;
      if (engine == runner.judged_engine()) {
        run.trace = runner.runs().simulation->trace;
        run.summary = runner.runs().simulation->summary;
        continue;
      }
      SimulatedWitness witness = runner.Simulate(
          engine, engine == Engine::kCorrected ? "corrected engine" : "stock engine");
      run.trace = std::move(witness.run.trace);
      run.summary = std::move(witness.run.summary);
    }
  }

  // Dry friction as MuJoCo's frictionloss has it.
  void RunStockFriction(const WitnessRunner& runner) {
    const WitnessRecord* truth = runner.runs().Find(role::kReference);
    if (FirstFriction(prepared_->mechanisms.simulated).empty() || truth == nullptr) return;
    if (runner.judged_engine() != Engine::kCorrected || !truth->summary.ok()) return;
    report_.engine_comparison =
        CompareStockFriction(*prepared_, truth->trace, StageOf(options_.progress, "stock friction"),
                             &report_.timing.stock_s);
  }

  void AddWarning(const std::string& text) {
    Finding finding;
    finding.severity = Severity::kWarning;
    finding.message = text;
    report_.findings.Add(std::move(finding));
  }

  void Judge() {
    const Mobility mobility = AnalyseMobility(base());
    report_.drives_not_unique = SharedDrives(base(), scenario().motion, mobility);
    for (const std::string& text :
         SharedForceTexts(base(), report_.drives_not_unique, report_.simulated_not_unique)) {
      AddWarning(text);
    }
    ComparisonInput input = InputOf(*prepared_);
    input.drive_facts = report_.drive_facts = DriveFactsOf(*prepared_);
    runs_.HandOver(&input);
    input.reactions_not_unique = ReactionsNotUnique(
        base(), runs_.simulation ? runs_.simulation->X_WB : std::vector<std::vector<Pose>>());
    report_.reactions_not_unique = input.reactions_not_unique;
    report_.comparison = Compare(input);
    for (const std::string& text : prepared_->left_out_at_start) {
      report_.comparison.caveats.push_back({.kind = CaveatKind::kContact, .of = {}, .text = text});
    }
    TrySmallerStep(input);
    NameWaivers();
    WarnGravity();
    report_.tables = scenario().motion.tables;
    report_.smoothed_forces = SmoothedForces(prepared_->mechanisms.reference, scenario().motion);
    report_.sheets = SheetsOf(base(), report_.comparison);
    if (!other_engines_.empty()) CompareEngines(input);
    report_.witnesses = std::move(runs_.records);
    SizeMotors();
    LoadContacts();
    MeasureSingularity();
  }

  // Along the simulated motion, or, where nothing was simulated, along that of the reference.
  void MeasureSingularity() {
    const Motion& motion = scenario().motion;
    const bool simulated = runs_.simulation && !runs_.simulation->X_WB.empty();
    std::vector<std::vector<Pose>> X_WB;
    if (!simulated && !motion.free())
      X_WB = ReferencePoses(prepared_->mechanisms.reference, motion);
    const Trace* forces = nullptr;
    for (const WitnessRecord& record : report_.witnesses) {
      if (!record.summary.ok() || record.trace.time_s.empty() || base().drives.empty()) continue;
      if (record.trace.Find(Quantity::kForce, base().drives.front().name) < 0) continue;
      if (forces == nullptr || record.name == prepared_->driver()) forces = &record.trace;
    }
    RunSummary unused;
    Trace grid;
    grid.time_s = SampleTimes(motion.duration_s, motion.sample_s);
    InScenarioTime(scenario(), &unused, &grid);
    report_.singular = ApproachesOf(base(), motion, grid.time_s,
                                    simulated ? runs_.simulation->X_WB : X_WB, forces);
    for (const std::string& text : SingularityWarnings(report_.singular)) AddWarning(text);
  }

  // Where an integrated simulation alone disagrees: is it the mechanism or the step? The same run
  // with a quarter of the step shows it. The verdict stays: it is about the step that the scenario
  // has.
  void TrySmallerStep(ComparisonInput input) {
    const SimulationSettings& settings = scenario().simulation;
    if (report_.comparison.verdict != Verdict::kDisagree || settings.stock_engine ||
        settings.mode != DriveMode::kPrescribedMotion) {
      return;
    }
    const CheckResult* worst = nullptr;
    const auto ratio = [](const CheckResult& check) { return check.value / *check.limit; };
    for (const CheckResult& check : report_.comparison.checks) {
      if (!check.limit || check.pass) continue;
      if (!check.Involves(role::kSimulated)) return;
      if (worst == nullptr || ratio(check) > ratio(*worst)) worst = &check;
    }
    if (worst == nullptr) return;
    const WitnessRunner runner(*prepared_, {}, options_.progress);
    SimulationOptions options =
        OptionsOf(scenario(), prepared_->mechanisms.simulated, Engine::kCorrected);
    options.step_s *= 0.25;
    if (scenario().motion.duration_s > kMostFineSteps * options.step_s) return;
    SimulatedWitness finer = runner.Simulate(options, "a quarter of the step");
    report_.timing.simulation_s += finer.run.summary.wall_s;
    if (!finer.run.summary.ok()) return;
    InScenarioTime(scenario(), &finer.run.summary, &finer.run.trace);
    for (Witness& witness : input.witnesses) {
      if (witness.name == role::kSimulated) witness.trace = &finer.run.trace;
    }
    const Comparison compared = Compare(input);
    const CheckResult* same = compared.FindCheck(worst->name);
    Attribution& attribution = report_.comparison.attribution;
    if (compared.verdict == Verdict::kAgree) {
      attribution.odd_one_out = role::kSimulated.name;
      attribution.text = fmt::format(
          "simulation.step_s = {:g} is too coarse for this motion: with {:g} all checks pass",
          settings.step_s, options.step_s);
    } else if (same != nullptr && same->value < kStepsShare * worst->value) {
      attribution.text += fmt::format(
          "{}with simulation.step_s = {:g} the worst check, {}, falls from {:.1e} to {:.1e}",
          attribution.text.empty() ? "" : "; ", options.step_s, worst->name, worst->value,
          same->value);
    }
  }

  // Whatever the verdict is, it is about a mechanism that the model describes with an exception.
  void NameWaivers() {
    std::string& text = report_.comparison.attribution.text;
    for (const std::string& allowed :
         TextsOf(scenario().model_caveats, ModelCaveat::Kind::kAllowed)) {
      text += fmt::format("{}allowed by the model: {}", text.empty() ? "" : "; ", allowed);
    }
  }

  void SizeMotors() {
    const Mechanism& mechanism = base();
    const ComparisonInput input = InputOf(*prepared_);
    report_.motors = mechanism.motors;
    report_.dc_link = mechanism.dc_link;
    for (size_t k = 0; k < mechanism.motors.size(); ++k) {
      const Motor& motor = mechanism.motors[k];
      if (!(motor.rotor_inertia > 0.0)) continue;
      report_.drive_facts[k].load_inertia = LoadInertia(mechanism, motor.drive);
    }
    for (const WitnessRecord& record : report_.witnesses) {
      if (!record.summary.ok() || record.trace.time_s.empty() || mechanism.motors.empty()) continue;
      const std::string unresolved = UnresolvedBySamples(input, record.trace);
      AddMotorLoads(mechanism, record, unresolved, &report_);
    }
  }

  void LoadContacts() {
    for (const WitnessRecord& record : report_.witnesses) {
      if (!record.summary.ok() || record.trace.time_s.empty()) continue;
      for (ContactLoad& load : ContactLoadsOf(base(), record.trace, report_.reactions_not_unique)) {
        load.witness = record.name;
        report_.contact_loads.push_back(std::move(load));
      }
    }
  }

  // A table that was made with another value of g agrees within any usual tolerance.
  void WarnGravity() {
    if (!runs_.table || scenario().motion.free()) return;
    const std::string warning = GravityWarning(prepared_->mechanisms.reference, scenario().motion,
                                               *runs_.table, scenario().start_window_s);
    if (!warning.empty()) AddWarning(warning);
  }

  void CompareEngines(const ComparisonInput& input) {
    // The computation that drives the simulation; else the other one.
    const WitnessRecord& driver = *runs_.Find(prepared_->driver());
    const WitnessRecord& truth = driver.summary.ok() ? driver : *runs_.Find(role::kReference);
    report_.engine_comparison = mbv::CompareEngines(input, truth.trace, other_engines_);
  }

  // What the user's own settings do. No verdict depends on it.
  void RunSourceModel() {
    if (options_.source_model.empty()) return;
    report_.source_model = std::make_shared<const SourceModelAudit>(
        AuditSourceModel({.file = options_.source_model,
                          .base = options_.source_base,
                          .prepared = &*prepared_,
                          .reactions_not_unique = report_.reactions_not_unique,
                          .progress = options_.progress}));
  }

  void DrawPictures() {
    if (!options_.pictures || options_.out_dir.empty() || !runs_.simulation ||
        runs_.simulation->X_WB.empty() || scenario().snapshots.times_s.empty()) {
      return;
    }
    const RunSummary drawn =
        DrawSnapshots(scenario(), prepared_->mechanisms.simulated, *runs_.simulation,
                      CaptionOf(report_), StageOf(options_.progress, "pictures"), &pictures_);
    report_.timing.render_s = drawn.wall_s;
    if (!drawn.ok()) {
      Finding finding;
      finding.severity = Severity::kWarning;
      finding.message = "no pictures: " + drawn.message;
      report_.findings.Add(std::move(finding));
    }
    for (const PictureFile& picture : pictures_) report_.pictures.push_back(picture.name);
  }

  void WriteFiles() {
    if (options_.out_dir.empty()) return;
    OutputFolder folder(options_.out_dir, base().name + "/" + scenario().name);
    std::string trouble = folder.Create();
    const auto write = [&](const std::string& name, const auto& content) {
      if (trouble.empty()) trouble = folder.Write(name, content);
    };
    write("traces.csv", FileContent([&](const auto& piece) { WriteCsv(report_, piece); }));
    std::string no_data;
    for (const auto& [name, bytes] : DataFilesOf(report_, options_.data, &no_data)) {
      write(name, bytes);
    }
    if (trouble.empty()) trouble = no_data;
    const SimulationRun* simulation = runs_.simulation ? &*runs_.simulation : nullptr;
    if (simulation != nullptr && !simulation->mjcf.empty()) {
      write("model.xml",
            WithKeys(simulation->mjcf,
                     SnapshotKeys(scenario(), prepared_->mechanisms.simulated, *simulation)));
    }
    for (size_t k = 1; k < phase_mjcf_.size(); ++k) {
      write(fmt::format("model_phase{}.xml", k + 1), phase_mjcf_[k]);
    }
    for (const PictureFile& picture : pictures_) {
      write("snapshots/" + picture.name, picture.content);
    }
    write("inputs.json", InputsJson(inputs_.files(), options_.scenario.set));
    write("summary.json", ToJson(report_));
    if (options_.more_files) {
      for (const auto& [name, content] : options_.more_files(report_)) write(name, content);
    }
    if (options_.page) {
      write("report.html",
            RunPage(report_, prepared_->mechanisms.simulated, simulation, pictures_,
                    options_.scenario, {options_.script_link, options_.kept_audits}));
    }
    if (trouble.empty()) trouble = folder.Commit();
    if (trouble.empty()) {
      outcome_.folder = folder.target();
      return;
    }
    Finding finding;
    finding.message = trouble;
    finding.hint = "choose another folder with --out";
    outcome_.diagnostics.Add(std::move(finding));
    outcome_.exit_code = 3;
  }

  const std::string file_;
  const RunOptions& options_;
  InputWatch inputs_;
  RunOutcome outcome_;
  std::optional<Prepared> prepared_;
  Report report_;
  WitnessRuns runs_;
  std::vector<EngineRun> other_engines_;  // with the judged one
  std::vector<PictureFile> pictures_;
  std::vector<std::string> phase_mjcf_;  // as simulated, by phase
};

}  // namespace

RunOutcome RunScenario(const std::string& file, const RunOptions& options) {
  const ParsedDocuments documents;
  const DocumentKind& kind = KindOf(file);
  return kind.run != nullptr ? kind.run(file, options) : RunMotion(file, options);
}

RunOutcome RunMotion(const std::string& file, const RunOptions& options) {
  return ScenarioRun(file, options).Run();
}

namespace {

namespace fs = std::filesystem;

constexpr size_t kPictureBytes = 900000;  // all embedded pictures together

std::string ResidualText(const AuditRow& row) {
  if (row.verdict == AuditVerdict::kNotTestable) return "";
  std::string text = fmt::format("{:.1e}", row.residual_corrected);
  if (!row.corrected.empty()) {
    text = fmt::format("printed {:.1e}, corrected {}", row.residual_printed, text);
  }
  return fmt::format("{} {} of {:.3g} (limit {:.1e})", text, row.unit, row.scale, row.limit);
}

bool SameText(const fs::path& a, const fs::path& b) {
  const auto read = [](const fs::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  std::error_code error;
  return fs::is_regular_file(a, error) && fs::is_regular_file(b, error) && read(a) == read(b);
}

HtmlAudit ToHtmlAudit(const AuditTable& table) {
  HtmlAudit audit{.source = table.source};
  for (const AuditRow& row : table.rows) {
    audit.rows.push_back({.equation = row.equation,
                          .erratum = row.erratum,
                          .status = ToText(row.verdict),
                          .printed = row.printed,
                          .corrected = row.corrected,
                          .note = row.note,
                          .residual = ResidualText(row),
                          .right = row.verdict == AuditVerdict::kOk,
                          .corrected_right = row.verdict == AuditVerdict::kWrong});
  }
  return audit;
}

// Computed by the first run that asks, and kept for the others of its regression run: it is the
// same for all. A file that is damaged or cannot be written costs time only.
HtmlAudit RunAudit(const AuditEntry& entry, const fs::path& models, const std::string& kept) {
  const fs::path file = fs::path(kept) / (entry.mechanism + ".json");
  if (!kept.empty()) {
    const auto text = ReadWholeFile(file);
    if (auto audit = text ? AuditFromJson(*text) : std::nullopt) return *std::move(audit);
  }
  HtmlAudit audit = ToHtmlAudit(entry.run(models.string()));
  if (!kept.empty()) (void)WriteFile(file, ToJson(audit), false);
  return audit;
}

// The audit of the mechanism's paper; none for user-defined mechanisms. It is about the models that
// the program came with, so a run of a model that was changed only says where it is. A run that is
// compared does not end because its page lacks a section.
std::optional<HtmlAudit> AuditOf(const Report& report, const std::string& kept) {
  for (const AuditEntry& entry : Audits()) {
    if (entry.mechanism != report.mechanism) continue;
    const auto note = [&](const std::string& why) {
      return HtmlAudit{.source = {},
                       .note = why + fmt::format("; the paper's equations are audited with the "
                                                 "shipped model: mbverify audit {}",
                                                 entry.mechanism)};
    };
    const std::optional<fs::path> shipped = ShippedModels();
    if (!shipped) return note("The shipped models were not found");
    const fs::path model = report.model_file;
    if (!SameText(model, *shipped / entry.mechanism / model.filename())) {
      return note(model.string() + " is not the shipped model");
    }
    try {
      return RunAudit(entry, *shipped, kept);
    } catch (const std::exception& error) {
      return note(std::string("The audit failed: ") + error.what());
    }
  }
  return {};
}

}  // namespace

std::string RunPage(const Report& report, const Mechanism& mechanism,
                    const SimulationRun* simulation, const std::vector<PictureFile>& pictures,
                    const ScenarioOptions& options, const PageOptions& page) {
  HtmlInput input{.report = &report,
                  .mechanism = &mechanism,
                  .X_WB = simulation == nullptr ? nullptr : &simulation->X_WB,
                  .paints = PaintsOf(mechanism),
                  .audit = AuditOf(report, page.kept_audits),
                  .script_link = page.script_link};
  size_t bytes = 0;
  for (const PictureFile& picture : pictures) {
    bytes += picture.preview.size();
    if (bytes > kPictureBytes) break;
    input.pictures.push_back({picture.name, picture.preview});
  }
  for (const auto& [key, value] : options.set) {
    input.arguments.push_back(fmt::format("--set '{}={}'", key, value));
  }
  return ToHtml(input);
}

namespace {

DataAbout AboutOf(const Report& report) {
  DataAbout about = {
      {"mechanism", report.mechanism},      {"scenario", report.scenario},
      {"description", report.description},  {"verdict", ToText(report.comparison.verdict)},
      {"reason", report.comparison.reason}, {"simulation", report.simulation}};
  for (const auto& [program, version] : report.versions) {
    if (program == "mbverify") about.emplace_back(program, version);
  }
  return about;
}

constexpr const char* kCsvWord = "csv";

}  // namespace

std::vector<std::string> DataWords() {
  std::vector<std::string> words = {kCsvWord};
  for (const DataFormat& format : DataFormats()) words.emplace_back(format.word);
  return words;
}

std::vector<std::pair<std::string, std::string>> DataFilesOf(const Report& report,
                                                             const std::vector<std::string>& words,
                                                             std::string* trouble) {
  std::vector<Trace> shown;
  for (const WitnessRecord& witness : report.witnesses) {
    if (!witness.trace.time_s.empty()) shown.push_back(AsShown(witness.trace));
  }
  std::vector<const Trace*> traces;
  traces.reserve(shown.size());
  for (const Trace& trace : shown) traces.push_back(&trace);
  std::vector<std::pair<std::string, std::string>> files;
  for (const std::string& word : words) {
    if (word == kCsvWord) {
      files.emplace_back(kCsvMetadataFile, CsvMetadata(report));
      continue;
    }
    const DataFormat* format = FindDataFormat(word);
    MBV_DEMAND(format != nullptr, word);
    files.emplace_back(format->file, DataBytes(*format, AboutOf(report), traces, trouble));
    if (!trouble->empty()) return {};
  }
  return files;
}

}  // namespace mbv
