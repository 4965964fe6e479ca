#include "pipeline/run_scenario.h"

#include <fmt/format.h>

#include <chrono>

#include "comparison/derivatives.h"
#include "core/inputs.h"
#include "core/output_folder.h"
#include "input/parsed_documents.h"
#include "kinematics/mobility.h"
#include "pipeline/drive_by.h"
#include "pipeline/engine_errors.h"
#include "pipeline/load_inertia.h"
#include "pipeline/own_file_audit.h"
#include "pipeline/pictures.h"
#include "pipeline/run_page.h"
#include "pipeline/run_witnesses.h"
#include "pipeline/shared_forces.h"
#include "pipeline/smoothed_forces.h"
#include "pipeline/stiffness.h"
#include "pipeline/table_gravity.h"
#include "pipeline/trace_data.h"
#include "pipeline/version.h"
#include "report/csv.h"
#include "report/inputs_json.h"

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
    const ProgramList programs = ProgramsOf(scenario(), options_.programs.archived);
    if (!options_.programs.Allows(programs)) {
      outcome_.diagnostics.Add(Refusal(programs));
      return BadInput();
    }
    outcome_.figures = scenario().figures;
    Describe();
    RunWitnesses();
    if (outcome_.diagnostics.has_errors()) return BadInput();
    Judge();
    RunOwnFile();
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
      RunBesides(&runner);
      runner.RunForeign();
    }
    runs_ = runner.Take();
    outcome_.diagnostics.Append(runs_.bad_input);
    report_.findings.Append(runs_.findings);
    if (!runs_.trust.empty()) report_.simulation += "; " + runs_.trust;
    report_.timing = runs_.timing;
    report_.timing.told = options_.timed;
    for (const EngineRun& run : other_engines_) {
      if (run.engine != runner.judged_engine()) report_.timing.stock_s += run.summary.wall_s;
    }
    if (runs_.simulation) report_.simulated_not_unique = runs_.simulation->not_unique;
  }

  // What the simulation's error is measured by, where it ran: other engines, or wrong forces.
  void RunBesides(WitnessRunner* runner) {
    const auto& simulation = runner->runs().simulation;
    if (!simulation || !simulation->summary.ok()) return;
    if (scenario().simulation.drive_by == DriveBy::kMotion) RunOtherEngines(*runner);
    if (scenario().simulation.drive_by == DriveBy::kForces) runner->RunBent();
  }

  // The simulator's own modelling error: the same run by the other engines.
  void RunOtherEngines(const WitnessRunner& runner) {
    const SimulationSettings& settings = scenario().simulation;
    if (scenario().motion.free()) RunStockFriction(runner);
    // Its error is stated in drive forces, which a free motion does not compare.
    if (scenario().motion.free() || !settings.forward || !settings.stock_too) return;
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
    runs_.HandOver(&input);
    input.reactions_not_unique = ReactionsNotUnique(
        base(), runs_.simulation ? runs_.simulation->X_WB : std::vector<std::vector<Pose>>());
    report_.reactions_not_unique = input.reactions_not_unique;
    report_.comparison = Compare(input);
    NameWaivers();
    DoubtGravity();
    report_.tables = scenario().motion.tables;
    report_.smoothed_forces = SmoothedForces(prepared_->mechanisms.reference, scenario().motion);
    report_.sheets = SheetsOf(base(), report_.comparison);
    if (!other_engines_.empty()) CompareEngines(input);
    report_.witnesses = std::move(runs_.records);
    SizeMotors();
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
    std::vector<double> inertias;
    for (const Motor& motor : mechanism.motors) {
      const bool needed = motor.rotor_inertia > 0.0;
      inertias.push_back(needed ? LoadInertia(mechanism, motor.drive) : kNan);
    }
    for (const WitnessRecord& record : report_.witnesses) {
      if (!record.summary.ok() || record.trace.time_s.empty() || mechanism.motors.empty()) continue;
      const std::string unresolved = UnresolvedBySamples(input, record.trace);
      for (size_t k = 0; k < mechanism.motors.size(); ++k) {
        MotorLoad load = MotorLoadOf(mechanism, mechanism.motors[k], record.trace, inertias[k]);
        load.witness = record.name;
        load.unresolved = unresolved;
        if (load.known()) report_.motor_loads.push_back(std::move(load));
      }
    }
  }

  // A table that was made with another value of g agrees within any usual tolerance.
  void DoubtGravity() {
    if (!runs_.table || scenario().motion.free()) return;
    const std::string doubt = GravityDoubt(prepared_->mechanisms.reference, scenario().motion,
                                           *runs_.table, scenario().start_window_s);
    if (!doubt.empty()) AddWarning(doubt);
  }

  void CompareEngines(const ComparisonInput& input) {
    // The computation that drives the simulation; else the other one.
    const WitnessRecord& driver = *runs_.Find(prepared_->driver());
    const WitnessRecord& truth = driver.summary.ok() ? driver : *runs_.Find(role::kReference);
    report_.engine_comparison = mbv::CompareEngines(input, truth.trace, other_engines_);
  }

  // What the user's own settings do. No verdict depends on it.
  void RunOwnFile() {
    if (options_.own_file.empty()) return;
    report_.own_file = std::make_shared<const OwnFileAudit>(
        AuditOwnFile({.file = options_.own_file,
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
    for (const PictureFile& picture : pictures_) {
      write("snapshots/" + picture.name, picture.content);
    }
    write("inputs.json", ToJson(inputs_.files()));
    write("summary.json", ToJson(report_));
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
};

}  // namespace

RunOutcome RunScenario(const std::string& file, const RunOptions& options) {
  const ParsedDocuments documents;
  if (ReadScenarioHead(file).is_stiffness()) return RunStiffnessScenario(file, options);
  return ScenarioRun(file, options).Run();
}

}  // namespace mbv
