#include "pipeline/run_scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "core/demand.h"
#include "core/inputs.h"
#include "core/output_folder.h"
#include "kinematics/mobility.h"
#include "mechanism/concession.h"
#include "pipeline/drive_by.h"
#include "pipeline/engine_errors.h"
#include "pipeline/free_motion_text.h"
#include "pipeline/not_run.h"
#include "pipeline/pictures.h"
#include "pipeline/prepare.h"
#include "pipeline/ranges.h"
#include "pipeline/run_page.h"
#include "pipeline/shared_forces.h"
#include "pipeline/stiffness.h"
#include "pipeline/table_gravity.h"
#include "pipeline/version.h"
#include "reference/reference.h"
#include "report/csv.h"
#include "report/inputs_json.h"
#include "table/table.h"

namespace mbv {
namespace {

int ExitCodeOf(Verdict verdict) {
  return verdict == Verdict::kAgree ? 0 : verdict == Verdict::kDisagree ? 1 : 3;
}

class ScenarioRun {
 public:
  ScenarioRun(const std::string& file, const RunOptions& options)
      : file_(file), options_(options) {}

  RunOutcome Run() {
    const auto start = std::chrono::steady_clock::now();
    prepared_ = Prepare(file_, options_.scenario, &outcome_.diagnostics);
    if (!prepared_) return BadInput();
    Describe();
    RunAnalytic();
    RunReferenceWitness();
    if (CheckStrokes()) RunSimulated();
    if (outcome_.diagnostics.has_errors()) return BadInput();
    Judge();
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

  std::function<void(double)> ProgressOf(const std::string& stage) const {
    if (!options_.progress) return {};
    return [this, stage](double fraction) { options_.progress(stage, fraction); };
  }

  void Describe() {
    const SimulationSettings& simulation = scenario().simulation;
    report_.scenario = scenario().name;
    report_.scenario_file = scenario().file;
    report_.mechanism = base().name;
    report_.model_file = scenario().model_file;
    report_.description = scenario().description;
    for (const Drive& drive : base().drives) report_.drives.push_back(drive.name);
    report_.mode = ModeText(simulation);
    report_.engine = simulation.stock_engine ? "stock" : "corrected";
    report_.step_s = simulation.step_s;
    report_.duration_s = scenario().motion.duration_s;
    report_.sample_s = scenario().motion.sample_s;
    report_.start_window_s = scenario().start_window_s;
    report_.driven_by = prepared_->driven_by;
    report_.simulation = SimulationLine(*prepared_);
    report_.findings = outcome_.diagnostics;
    report_.versions = Versions();
  }

  void AddWitness(const std::string& name, RunSummary summary, Trace trace) {
    trace.witness = name;
    report_.witnesses.push_back({name, std::move(summary), std::move(trace)});
  }

  void RunAnalytic() {
    if (prepared_->closed_form.closed_form == nullptr) {
      AddWitness("analytic", NotRun(prepared_->closed_form.reason), {});
      return;
    }
    ClosedFormRun run = RunClosedForm(prepared_->mechanisms.analytic, scenario().motion,
                                      prepared_->closed_form.closed_form.get());
    report_.timing.analytic_s = run.summary.wall_s;
    AddWitness("analytic", std::move(run.summary), std::move(run.trace));
  }

  // The generic solver, or a table in its place. Without a closed form the solver takes part beside
  // the table, by its own name: it gives the drive motion, and a third opinion.
  void RunReferenceWitness() {
    if (!scenario().reference.on) {
      AddWitness("reference", NotRun("switched off in the scenario"), {});
      return;
    }
    if (scenario().reference.table == nullptr) {
      RunSolver("reference");
      return;
    }
    table_ = AlignTable(*scenario().reference.table, scenario().motion);
    const bool any = !table_->trace.time_s.empty();
    AddWitness("reference", any ? RunSummary::Done() : NotRun(table_->grid), table_->trace);
    if (report_.driven_by != "analytic") RunSolver("solver");
  }

  void RunSolver(const std::string& name) {
    if (scenario().motion.free()) {
      RunFreeSolver(name);
      return;
    }
    ReferenceRun run = RunReference(prepared_->mechanisms.reference, scenario().motion);
    report_.timing.reference_s = run.summary.wall_s;
    AddWitness(name, std::move(run.summary), std::move(run.trace));
  }

  void RunFreeSolver(const std::string& name) {
    ForwardRun run = RunForwardReference(prepared_->mechanisms.reference, scenario().motion,
                                         {.progress = ProgressOf("reference")});
    report_.timing.reference_s = run.summary.wall_s;
    report_.simulation += "; " + TrustLine(run);
    for (const std::string& text : PassageTexts(run, scenario().motion.duration_s)) {
      AddWarning(text);
    }
    AddWitness(name, std::move(run.summary), std::move(run.trace));
  }

  const WitnessRecord& Driver() const {
    const auto found =
        std::find_if(report_.witnesses.begin(), report_.witnesses.end(),
                     [&](const WitnessRecord& w) { return w.name == report_.driven_by; });
    MBV_DEMAND(found != report_.witnesses.end(), report_.driven_by);
    return *found;
  }

  Severity RangeSeverity() const {
    return scenario().simulation.ignore_ranges ? Severity::kWarning : Severity::kError;
  }

  // Strokes along the commanded motion; false if the simulation must not run.
  bool CheckStrokes() {
    const auto violations = DriveViolations(base(), Driver().trace);
    if (violations.empty()) return true;
    AddFindings(violations, file_, RangeSeverity(), &report_.findings);
    if (scenario().simulation.ignore_ranges) return true;
    AddWitness("simulated", LimitSummary(violations), {});
    return false;
  }

  void RunSimulated() {
    if (!scenario().simulation.on) {
      AddWitness("simulated", NotRun("switched off in the scenario"), {});
      return;
    }
    const bool needs_driver = !scenario().motion.free() || scenario().reference.on;
    if (needs_driver && !Driver().summary.ok()) {
      AddWitness(
          "simulated",
          NotRun(fmt::format("there is no drive motion, because {} failed", report_.driven_by)),
          {});
      return;
    }
    const Engine engine = scenario().simulation.stock_engine ? Engine::kStock : Engine::kCorrected;
    SimulationOptions options = OptionsOf(scenario(), base(), engine);
    options.forces = prepared_->MakeDriveForces();
    SimulatedWitness witness = Simulated(options, "simulation");
    outcome_.diagnostics.Append(witness.diagnostics);
    report_.timing.simulation_s = witness.run.summary.wall_s;
    report_.timing.loop_s = witness.run.loop_wall_s;
    report_.timing.steps = witness.run.steps;
    AddWarnings(witness.run.warnings);
    report_.simulated_not_unique = witness.run.not_unique;
    for (const std::string& note : witness.run.notes) AddWarning(note);
    CheckJoints(&witness.run);
    AddWitness("simulated", witness.run.summary, witness.run.trace);
    simulation_ = std::move(witness.run);
    if (!simulation_->summary.ok()) return;
    switch (scenario().simulation.drive_by) {
      case DriveBy::kMotion:
        return RunOtherEngines(engine);
      case DriveBy::kForces:
        return RunBent(options);
      case DriveBy::kServos:
        return RunReachedWitness();
    }
  }

  SimulatedWitness Simulated(const SimulationOptions& options, const std::string& stage) {
    return RunSimulation(scenario(), prepared_->mechanisms.simulated, prepared_->MakeDrivenMotion(),
                         options, ProgressOf(stage));
  }

  // Open loop: the same run with wrong forces shows how errors grow.
  void RunBent(SimulationOptions options) {
    const std::optional<double>& limit = scenario().checks[Metric::kForceNrmse].forward;
    bend_ = limit.value_or(*RowOf(Metric::kForceNrmse).limits.forward);
    options.forces = Bent(prepared_->MakeDriveForces(), base(), Driver().trace, bend_);
    SimulatedWitness bent = Simulated(options, "bent forces");
    if (!bent.run.summary.ok()) return AddWarning("bent forces: " + bent.run.summary.message);
    bent_ = std::move(bent.run.trace);
    bent_->witness = "bent";
  }

  // The reference where the servos went.
  void RunReachedWitness() {
    ReferenceRun run =
        RunReached(prepared_->mechanisms.reference, scenario().motion, simulation_->trace);
    AddWitness("reached", std::move(run.summary), std::move(run.trace));
  }

  void AddWarning(const std::string& text) {
    Finding finding;
    finding.severity = Severity::kWarning;
    finding.message = text;
    report_.findings.Add(std::move(finding));
  }

  void AddWarnings(const std::vector<std::string>& warnings) {
    for (const std::string& warning : warnings) AddWarning("MuJoCo: " + warning);
  }

  // Joint ranges along the simulated motion.
  void CheckJoints(SimulationRun* run) {
    if (!run->summary.ok()) return;
    const auto violations = JointViolations(base(), run->trace.time_s, run->X_WB);
    AddFindings(violations, file_, RangeSeverity(), &report_.findings);
    if (violations.empty() || scenario().simulation.ignore_ranges) return;
    run->summary = LimitSummary(violations);
  }

  // The simulator's own modelling error: the same run by the other engines.
  void RunOtherEngines(Engine judged) {
    const SimulationSettings& settings = scenario().simulation;
    // Its error is stated in drive forces, which a free motion does not compare.
    if (scenario().motion.free() || !settings.forward || !settings.stock_too) return;
    for (const Engine engine : {Engine::kDefaults, Engine::kStock, Engine::kCorrected}) {
      EngineRun& run = other_engines_.emplace_back();
      run.engine = engine;
      if (engine == judged) {
        run.trace = simulation_->trace;
        run.summary = simulation_->summary;
        continue;
      }
      SimulatedWitness witness =
          Simulated(OptionsOf(scenario(), base(), engine),
                    engine == Engine::kCorrected ? "corrected engine" : "stock engine");
      report_.timing.stock_s += witness.run.summary.wall_s;
      run.trace = std::move(witness.run.trace);
      run.summary = std::move(witness.run.summary);
    }
  }

  ComparisonInput MakeComparisonInput() const {
    ComparisonInput input{
        .mechanism = &base(),
        .motion = &scenario().motion,
        .limits = scenario().checks,
        .simulation_limits =
            scenario().simulation.forward ? LimitColumn::kForward : LimitColumn::kInverse,
        .start_window_s = scenario().start_window_s,
        .witnesses = {},
        .driven_by = report_.driven_by,
        .reactions_not_unique = ReactionsNotUnique(
            base(), simulation_ ? simulation_->X_WB : std::vector<std::vector<Pose>>()),
        .table = table_ ? &*table_ : nullptr,
        .drive_by =
            scenario().simulation.forward ? scenario().simulation.drive_by : DriveBy::kMotion,
        .bent = bent_ ? &*bent_ : nullptr,
        .bend = bend_};
    for (const WitnessRecord& record : report_.witnesses) {
      input.witnesses.push_back(
          {record.name, record.trace.time_s.empty() ? nullptr : &record.trace, record.summary});
    }
    return input;
  }

  void Judge() {
    const Mobility mobility = AnalyseMobility(base());
    report_.drives_not_unique = SharedDrives(base(), scenario().motion, mobility);
    for (const std::string& text :
         SharedForceTexts(base(), report_.drives_not_unique, report_.simulated_not_unique)) {
      AddWarning(text);
    }
    const ComparisonInput input = MakeComparisonInput();
    report_.reactions_not_unique = input.reactions_not_unique;
    report_.comparison = Compare(input);
    NameConcessions();
    DoubtGravity();
    report_.sheets = SheetsOf(base(), report_.comparison);
    if (!other_engines_.empty()) CompareEngines(input);
  }

  // Whatever the verdict is, it is about a mechanism that the model describes with an exception.
  void NameConcessions() {
    std::string& text = report_.comparison.attribution.text;
    for (const std::string& concession : ConcessionsIn(outcome_.diagnostics)) {
      text += fmt::format("{}allowed by the model: {}", text.empty() ? "" : "; ", concession);
    }
  }

  // A table that was made with another value of g agrees within any usual tolerance.
  void DoubtGravity() {
    if (!table_ || scenario().motion.free()) return;
    const std::string doubt = GravityDoubt(prepared_->mechanisms.reference, scenario().motion,
                                           *table_, scenario().start_window_s);
    if (!doubt.empty()) AddWarning(doubt);
  }

  void CompareEngines(const ComparisonInput& input) {
    // The computation that drives the simulation; else the other one.
    const bool driver = Driver().summary.ok();
    const WitnessRecord& truth = driver ? Driver() : report_.witnesses[1];
    report_.engine_comparison = mbv::CompareEngines(input, truth.trace, other_engines_);
  }

  void DrawPictures() {
    if (!options_.pictures || options_.out_dir.empty() || !simulation_ ||
        simulation_->X_WB.empty() || scenario().snapshots.times_s.empty()) {
      return;
    }
    const RunSummary drawn =
        DrawSnapshots(scenario(), prepared_->mechanisms.simulated, *simulation_, CaptionOf(report_),
                      ProgressOf("pictures"), &pictures_);
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
    if (simulation_ && !simulation_->mjcf.empty()) {
      write("model.xml",
            WithKeys(simulation_->mjcf,
                     SnapshotKeys(scenario(), prepared_->mechanisms.simulated, *simulation_)));
    }
    for (const PictureFile& picture : pictures_) {
      write("snapshots/" + picture.name, picture.content);
    }
    write("inputs.json", ToJson(inputs_.files()));
    write("summary.json", ToJson(report_));
    if (options_.page) {
      write("report.html",
            RunPage(report_, prepared_->mechanisms.simulated, simulation_ ? &*simulation_ : nullptr,
                    pictures_, options_.scenario, {options_.script_link, options_.kept_audits}));
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
    outcome_.exit_code = 2;
  }

  const std::string file_;
  const RunOptions& options_;
  InputWatch inputs_;
  RunOutcome outcome_;
  std::optional<Prepared> prepared_;
  Report report_;
  std::optional<SimulationRun> simulation_;
  std::vector<EngineRun> other_engines_;  // with the judged one
  std::optional<AlignedTable> table_;     // in the reference's place
  std::optional<Trace> bent_;             // pushed with wrong forces
  double bend_ = kNan;
  std::vector<PictureFile> pictures_;
};

}  // namespace

RunOutcome RunScenario(const std::string& file, const RunOptions& options) {
  if (ReadScenarioHead(file).is_stiffness()) return RunStiffnessScenario(file, options);
  return ScenarioRun(file, options).Run();
}

}  // namespace mbv
