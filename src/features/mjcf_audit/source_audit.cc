#include "features/mjcf_audit/source_audit.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>

#include "base/files.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "comparison/comparison.h"
#include "comparison/verdict.h"
#include "features/mjcf_audit/source_options.h"
#include "kinematics/command_rank.h"
#include "mechanism/reach.h"
#include "reference/reference.h"
#include "simulation/mjcf/foreign.h"
#include "simulation/mjcf/mjcf.h"
#include "verify/run_witnesses.h"

namespace mbv {
namespace {

// Runs of a user's file, measured against the reference. Internal to pipeline/.

class SourceModelRuns {
 public:
  /// `request` outlives it.
  explicit SourceModelRuns(const SourceModelRequest& request);

  /// Why nothing can be run; "" if it can.
  [[nodiscard]] const std::string& not_run() const { return not_run_; }

  struct Measured {
    SourceModelRun run;
    SourceModelError error;
  };
  /// One run with these settings, of another text than the file's if `text` is one.
  [[nodiscard]] Measured Run(const SourceModelSettings& settings, const std::string& text = "");

  [[nodiscard]] const std::string& text() const { return task_.text; }
  [[nodiscard]] double length_m() const { return length_m_; }

 private:
  void FindCommands();
  [[nodiscard]] SourceModelRun InChild(const SourceModelTask& task) const;
  [[nodiscard]] SourceModelError ErrorOf(const SourceModelRun& run);
  void Solve(const Trace& like);
  void MeasureForces(const SourceModelRun& run, SourceModelError* error) const;
  void MeasureJointForces(const Trace& trace, SourceModelError* error) const;

  const SourceModelRequest& request_;
  const Prepared& prepared_;
  SourceModelTask task_;
  std::vector<size_t> command_of_;  // per drive
  Motion motion_;                   // sampled as the runs are
  DrivenTwists twists_;             // of the drives, for the scale of forces
  std::optional<ReferenceRun> truth_;
  double length_m_ = kNan;
  std::string not_run_;
};

constexpr double kTimeout_s = 30.0;  // of one run

SourceModelRuns::SourceModelRuns(const SourceModelRequest& request)
    : request_(request), prepared_(*request.prepared), motion_(prepared_.scenario.motion) {
  length_m_ = CharacteristicLength(prepared_.base);
  task_.file = request.file;
  task_.text = request.text.empty() ? ReadWholeFile(request.file).value_or("") : request.text;
  task_.base = request.base;
  task_.mechanism = &prepared_.base;
  task_.duration_s = motion_.duration_s;
  task_.sample_s = motion_.sample_s;
  task_.ignore_ranges = prepared_.scenario.simulation.ignore_ranges;
  FindCommands();
  twists_ = TwistsOfDriven(prepared_.base, std::vector<bool>(prepared_.base.drives.size(), true));
}

// The motion of each drive is its command; nothing else is commanded.
void SourceModelRuns::FindCommands() {
  const Motion& motion = prepared_.scenario.motion;
  constexpr size_t kNone = static_cast<size_t>(-1);
  command_of_.assign(prepared_.base.drives.size(), kNone);
  bool plain = !motion.free() && motion.loads.empty() && prepared_.base.prescribed.empty() &&
               motion.commands.size() == command_of_.size();
  for (size_t c = 0; plain && c < motion.commands.size(); ++c) {
    const std::vector<Command::Term>& terms = motion.commands[c].terms;
    plain = terms.size() == 1 && terms[0].factor == 1.0 &&
            terms[0].coordinate.kind == Coordinate::Kind::kDrive;
    if (plain) command_of_[static_cast<size_t>(terms[0].coordinate.index)] = c;
  }
  if (!plain || std::find(command_of_.begin(), command_of_.end(), kNone) != command_of_.end()) {
    not_run_ = "the scenario does more than command each drive by itself";
    return;
  }
  task_.driven = [this, sample = CommandSample()](double t_s, DrivenSample* driven) mutable {
    EvaluateMotion(prepared_.scenario.motion, t_s, &sample);
    const auto drives = static_cast<Eigen::Index>(command_of_.size());
    for (VecX* v : {&driven->position, &driven->velocity, &driven->acceleration}) v->resize(drives);
    for (Eigen::Index k = 0; k < drives; ++k) {
      const auto c = static_cast<Eigen::Index>(command_of_[static_cast<size_t>(k)]);
      driven->position[k] = sample.position[c];
      driven->velocity[k] = sample.velocity[c];
      driven->acceleration[k] = sample.acceleration[c];
    }
    return RunSummary::Done();
  };
}

SourceModelRun SourceModelRuns::InChild(const SourceModelTask& task) const {
  const auto answers =
      InChildren(1, kTimeout_s, [&](size_t) { return ToBytes(RunSourceModel(task)); });
  std::optional<SourceModelRun> run;
  if (answers[0]) run = FromBytes<SourceModelRun>(*answers[0]);
  if (run) return *std::move(run);
  SourceModelRun failed;
  failed.summary = {
      .stop = Stop::kEngineFailure,
      .message = fmt::format("MuJoCo crashed on it, or took longer than {:g} s", kTimeout_s)};
  return failed;
}

SourceModelRuns::Measured SourceModelRuns::Run(const SourceModelSettings& settings,
                                               const std::string& text) {
  SourceModelTask task = task_;
  task.settings = settings;
  if (!text.empty()) task.text = text;
  Measured measured;
  measured.run = InChild(task);
  measured.run.trace.witness = role::kSimulated.name;
  measured.error = ErrorOf(measured.run);
  return measured;
}

// The reference at the samples of the runs, which fall on whole steps of the file.
void SourceModelRuns::Solve(const Trace& like) {
  motion_.sample_s = like.time_s.size() > 1 ? like.time_s[1] : motion_.duration_s;
  motion_.duration_s = like.time_s.back();
  truth_ = RunReference(prepared_.mechanisms.reference, motion_);
  truth_->trace.witness = role::kReference.name;
}

SourceModelError SourceModelRuns::ErrorOf(const SourceModelRun& run) {
  SourceModelError error;
  error.failure = run.summary.ok() ? "" : run.summary.message;
  error.time_s = run.summary.time_s;
  if (!error.sound()) return error;
  if (!truth_) Solve(run.trace);
  if (!truth_->summary.ok()) {
    error.failure = "the reference has no forces here: " + truth_->summary.message;
    return error;
  }
  error.cost_ms = run.cost_ms;
  error.gap_m = error.gap_rad = 0.0;
  for (size_t c = 0; c < run.gaps.size(); ++c) {
    const SourceModelRun::Gap& gap = run.gaps[c];
    if (gap.position_m > error.gap_m) {
      error.gap_m = gap.position_m;
      error.gap_at_s = gap.position_at_s;
      error.joint = run.facts.closures[c];
    }
    if (gap.rotation_rad > error.gap_rad) {
      error.gap_rad = gap.rotation_rad;
      error.gap_rad_at_s = gap.rotation_at_s;
      error.twisted = run.facts.closures[c];
    }
  }
  MeasureForces(run, &error);
  MeasureJointForces(run.trace, &error);
  return error;
}

// Where friction at rest leaves the true force within a band, forces of a run that lie in it are
// right: both become the middle. Others are wrong by their distance from the band.
void CloseBands(Trace* run, Trace* truth) {
  const CommonSamples samples = AlignSamples(*run, *truth);
  for (size_t c = 0; c < truth->channels.size(); ++c) {
    const Channel& band = truth->channels[c];
    if (band.quantity != Quantity::kForceBand) continue;
    const int middle = truth->Find(Quantity::kForce, band.subject);
    const int force = run->Find(Quantity::kForce, band.subject);
    if (middle < 0 || force < 0) continue;
    for (const auto& [i, j] : samples) {
      double& half = truth->values(j, static_cast<Eigen::Index>(c));
      const double off = run->values(i, force) - truth->values(j, middle);
      if (half > 0.0) run->values(i, force) -= std::clamp(off, -half, half);
      half = 0.0;
    }
  }
}

void SourceModelRuns::MeasureForces(const SourceModelRun& audited_run,
                                    SourceModelError* error) const {
  Trace run = audited_run.trace, truth = truth_->trace;
  CloseBands(&run, &truth);
  ComparisonInput input = InputOf(prepared_);
  input.motion = &motion_;
  input.twists = &twists_;
  input.start_window_s = 0.0;
  error->force_all = ValueOf(ComparePair(input, run, truth).metrics, Metric::kForceNrmse);
  input.start_window_s = SourceModelAudit().later_s;
  const PairComparison pair = ComparePair(input, run, truth);
  error->force = ValueOf(pair.metrics, Metric::kForceNrmse);
  const auto most = pair.metrics.find(Metric::kForceMax);
  for (const DriveMetrics& drive : pair.drives) {
    if (most == pair.metrics.end() ||
        most->second.channel != ChannelName(Quantity::kForce, drive.drive)) {
      continue;
    }
    error->drive = drive.drive;
    error->force_most = drive.max_error;
    error->force_unit = drive.unit;
    error->force_at_s = drive.time_s;
  }
}

void SourceModelRuns::MeasureJointForces(const Trace& trace, SourceModelError* error) const {
  double wrong = 0.0, right = 0.0;
  // A file with another step in it is sampled at other times.
  const CommonSamples samples = AlignSamples(trace, truth_->trace);
  for (size_t c = 0; c < trace.channels.size(); ++c) {
    const Channel& channel = trace.channels[c];
    if (channel.quantity != Quantity::kReaction ||
        Contains(request_.reactions_not_unique, channel.name)) {
      continue;
    }
    const int other = truth_->trace.Find(channel.name);
    if (other < 0) continue;
    for (const auto& [i, j] : samples) {
      if (trace.time_s[static_cast<size_t>(i)] < SourceModelAudit().later_s) continue;
      const double truth = truth_->trace.values(j, other);
      const double off = trace.values(i, static_cast<Eigen::Index>(c)) - truth;
      if (!std::isfinite(off)) continue;
      wrong += off * off;
      right += truth * truth;
    }
  }
  if (right > 0.0) error->joint_force = std::sqrt(wrong / right);
}

}  // namespace
namespace {

// Recommended settings for a user's file.

using Clock = std::chrono::steady_clock;

constexpr std::array<double, 3> kStepFactors = {1.0, 0.5, 0.2};
constexpr std::array<double, 3> kTimeConstantSteps = {0.0, 5.0, 2.0};  // 0: the file's own
constexpr std::array<double, 3> kImpedances = {0.0, 0.99, kMjcfImpedance};
constexpr double kImpratio = 10.0;
constexpr double kMostStretched = 10.0;  // wall time on a busy machine, over processor time

struct Candidate {
  SourceModelSettings settings;
  SourceModelTrial trial;
  double work = 0.0;  // force solutions per step of the file, about
};

const char* NameOf(SourceModelIntegrator integrator) {
  switch (integrator) {
    case SourceModelIntegrator::kEuler:
      return "Euler";
    case SourceModelIntegrator::kRk4:
      return "RK4";
    case SourceModelIntegrator::kImplicit:
      return "implicit";
    case SourceModelIntegrator::kOwn:
      break;
  }
  return "";
}

double StagesOf(const std::string& integrator) {
  return integrator == "RK4" ? 4.0 : integrator == "implicit" ? 1.3 : 1.0;
}

// Processor time of the child processes, which a busy machine does not stretch.
double ChildrenSeconds() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

class Search {
 public:
  Search(const SourceModelRequest& request, const SourceModelSettings& base,
         const SourceModelRuns::Measured& own, SourceModelRuns* runs, SourceModelAudit* audit)
      : request_(request), base_(base), own_(own), runs_(*runs), audit_(*audit) {}

  void Run() {
    audit_.searched = true;
    candidates_.push_back(Make(base_));
    candidates_[0].trial.error = own_.error;
    MakeGrid();
    Try();
    MarkFront();
    Recommend();
    if (audit_.recommended > 0) Paste();
  }

 private:
  Candidate Make(const SourceModelSettings& settings) const {
    Candidate candidate{.settings = settings, .trial = {}};
    SourceModelTrial& trial = candidate.trial;
    trial.step_s = own_.run.facts.step_s * settings.step_factor;
    trial.integrator = settings.integrator == SourceModelIntegrator::kOwn
                           ? own_.run.facts.integrator
                           : NameOf(settings.integrator);
    if (settings.time_constant_s > 0.0)
      trial.solref = fmt::format("{:g} 1", settings.time_constant_s);
    if (settings.impedance > 0.0) {
      trial.solimp = fmt::format("{0:g} {0:g} 0.001 0.5 2", settings.impedance);
    }
    if (settings.impratio > 0.0) trial.other = fmt::format("impratio {:g}", settings.impratio);
    candidate.work = StagesOf(trial.integrator) / settings.step_factor;
    return candidate;
  }

  // All combinations, cheap ones first.
  void MakeGrid() {
    for (const double factor : kStepFactors) {
      for (const SourceModelIntegrator integrator :
           {SourceModelIntegrator::kEuler, SourceModelIntegrator::kRk4,
            SourceModelIntegrator::kImplicit}) {
        for (const double steps : kTimeConstantSteps) {
          for (const double impedance : kImpedances) Add(factor, integrator, steps, impedance);
        }
      }
    }
    SourceModelSettings friction = base_;
    friction.impratio = kImpratio;
    candidates_.push_back(Make(friction));
    std::stable_sort(candidates_.begin() + 1, candidates_.end(),
                     [](const Candidate& a, const Candidate& b) { return a.work < b.work; });
    audit_.planned = candidates_.size();
  }

  void Add(double factor, SourceModelIntegrator integrator, double steps, double impedance) {
    SourceModelSettings settings = base_;
    settings.step_factor = factor;
    if (own_.run.facts.integrator != NameOf(integrator)) settings.integrator = integrator;
    if (steps > 0.0) {
      // As it will be pasted.
      settings.time_constant_s =
          std::stod(fmt::format("{:g}", steps * factor * own_.run.facts.step_s));
    }
    if (impedance > 0.0) settings.impedance = impedance;
    if (factor == 1.0 && settings.integrator == SourceModelIntegrator::kOwn && steps == 0.0 &&
        impedance == 0.0) {
      return;  // the file's own
    }
    candidates_.push_back(Make(settings));
  }

  void Try() {
    const auto start = Clock::now();
    const double used_s = ChildrenSeconds();
    for (size_t i = 0; i < candidates_.size(); ++i) {
      Candidate& candidate = candidates_[i];
      if (i > 0) {
        const double wall_s = std::chrono::duration<double>(Clock::now() - start).count();
        if (ChildrenSeconds() - used_s > request_.search_s ||
            wall_s > kMostStretched * request_.search_s) {
          audit_.budget_s = request_.search_s;
          break;
        }
        if (request_.progress) {
          request_.progress("settings of the source model",
                            static_cast<double>(i) / static_cast<double>(candidates_.size()));
        }
        candidate.trial.error = runs_.Run(candidate.settings).error;
      }
      audit_.trials.push_back(candidate.trial);
    }
  }

  void MarkFront() {
    for (SourceModelTrial& trial : audit_.trials) {
      trial.front =
          trial.error.sound() &&
          std::none_of(audit_.trials.begin(), audit_.trials.end(), [&](const SourceModelTrial& o) {
            return o.error.sound() && o.error.cost_ms < trial.error.cost_ms &&
                   o.error.force < trial.error.force;
          });
    }
  }

  // The least work that is good enough; else the least work that is next to the best.
  void Recommend() {
    constexpr double kNearBest = 1.5;
    double force = std::numeric_limits<double>::infinity(), gap = force;
    for (const SourceModelTrial& trial : audit_.trials) {
      if (!trial.error.sound()) continue;
      force = std::min(force, trial.error.force);
      gap = std::min(gap, trial.error.gap_m);
    }
    const double most_force = std::max(SourceModelAudit::kGoodForce, kNearBest * force);
    const double most_gap = std::max(SourceModelAudit::kGoodGap * audit_.length_m, kNearBest * gap);
    for (size_t i = 0; i < audit_.trials.size(); ++i) {
      const SourceModelError& error = audit_.trials[i].error;
      if (!error.sound() || !(error.force <= most_force) || !(error.gap_m <= most_gap)) continue;
      const int best = audit_.recommended;
      const bool better = best < 0 || Work(i) < Work(static_cast<size_t>(best)) ||
                          (Work(i) == Work(static_cast<size_t>(best)) && best != 0 &&
                           Merit(i) < Merit(static_cast<size_t>(best)));
      if (better) audit_.recommended = static_cast<int>(i);
    }
  }

  [[nodiscard]] double Work(size_t trial) const { return candidates_[trial].work; }
  // The force error; what changes less may err a little more.
  [[nodiscard]] double Merit(size_t trial) const {
    constexpr double kPerChange = 1.5;
    const SourceModelTrial& t = audit_.trials[trial];
    return t.error.force * (t.solref.empty() ? 1.0 : kPerChange) *
           (t.solimp.empty() ? 1.0 : kPerChange);
  }

  [[nodiscard]] std::string Lines(const SourceModelTrial& trial) const {
    const SourceModelFacts& facts = own_.run.facts;
    std::string option, closures;
    if (trial.step_s != facts.step_s) option += fmt::format(" timestep=\"{:g}\"", trial.step_s);
    if (trial.integrator != facts.integrator) {
      option += fmt::format(" integrator=\"{}\"", trial.integrator);
    }
    if (!trial.solref.empty()) closures += fmt::format(" solref=\"{}\"", trial.solref);
    if (!trial.solimp.empty()) closures += fmt::format(" solimp=\"{}\"", trial.solimp);
    std::string lines;
    if (!option.empty()) lines += fmt::format("<option{}/>\n", option);
    if (!closures.empty()) lines += fmt::format("<default><equality{}/></default>\n", closures);
    return lines;
  }

  // Runs the file with the lines in it. Closures that state settings of their own take no defaults:
  // they are named, and changed where they stand.
  void Paste() {
    const SourceModelTrial& trial = audit_.trials[static_cast<size_t>(audit_.recommended)];
    audit_.lines = Lines(trial);
    std::string text = mjcf::WithLines(runs_.text(), audit_.lines);
    SourceModelRuns::Measured pasted = runs_.Run(base_, text);
    audit_.stubborn = Stubborn(pasted.run.facts, trial);
    if (!audit_.stubborn.empty() && pasted.run.summary.ok()) {
      text = mjcf::WithClosureSettings(text, trial.solref, trial.solimp);
      pasted = runs_.Run(base_, text);
      if (!Stubborn(pasted.run.facts, trial).empty()) {
        pasted.error.failure = "the closures stand in included files";
      }
    }
    audit_.pasted = pasted.error;
    if (pasted.error.sound()) audit_.pasted_as_is = runs_.Run({}, text).error;
  }

  static std::vector<std::string> Stubborn(const SourceModelFacts& facts,
                                           const SourceModelTrial& trial) {
    std::vector<std::string> names;
    for (size_t c = 0; c < facts.closures.size(); ++c) {
      const bool ref = trial.solref.empty() || facts.solref[c] == trial.solref;
      const bool imp = trial.solimp.empty() || facts.solimp[c] == trial.solimp;
      if (!ref || !imp) names.push_back(facts.closures[c]);
    }
    return names;
  }

  const SourceModelRequest& request_;
  const SourceModelSettings base_;
  const SourceModelRuns::Measured& own_;
  SourceModelRuns& runs_;
  SourceModelAudit& audit_;
  std::vector<Candidate> candidates_;
};

// Tries settings until the time is over, recommends one and runs the file with its lines in it.
// `base`: how every run is driven and what it leaves out; `own`: the file's run with that.
void SearchSettings(const SourceModelRequest& request, const SourceModelSettings& base,
                    const SourceModelRuns::Measured& own, SourceModelRuns* runs,
                    SourceModelAudit* audit) {
  Search(request, base, own, runs, audit).Run();
}

}  // namespace
namespace {

// What can make a file's forces wrong, and the remedy.
struct CauseRow {
  const char *key, *title, *meaning;
  bool (*applies)(const SourceModelFacts&);
  void (*correct)(const SourceModelFacts&, SourceModelSettings*);
};

bool Always(const SourceModelFacts& /*facts*/) { return true; }

constexpr const char* kVelocityMeaning =
    "A joint that closes a loop moves on a curved path, and to stay on a curve a body must be "
    "pulled sideways, as a stone on a string is. MuJoCo before 3.7 leaves this pull (J̇q̇ in its "
    "formulas) out of connect and weld: moving loops drift apart until their springs pull them "
    "back. Current versions have it for connect and weld, but not for tendon equalities and "
    "polynomial joint equalities.";
constexpr const char* kSoftMeaning =
    "To MuJoCo a loop is held together by springs and dampers. solref says how fast they pull it "
    "together (its first number is a time in s), solimp how much they give way under load.";

const std::vector<CauseRow>& Rows() {
  static const std::vector<CauseRow> kRows = {
      {"velocity_term", "the pull that keeps moving loops on their curve", kVelocityMeaning,
       &Always, [](const SourceModelFacts&, SourceModelSettings* s) { s->velocity_term = true; }},
      {"softness", "soft loops (solref, solimp)", kSoftMeaning, &Always,
       [](const SourceModelFacts& facts, SourceModelSettings* s) {
         s->time_constant_s = 2.0 * facts.step_s;
         s->impedance = kMjcfImpedance;
       }},
      {"friction", "soft friction losses (solreffriction, solimpfriction)",
       "In MuJoCo a joint with dry friction is held by a damper that gives way where its force "
       "exceeds the friction loss: near rest it creeps, and the force is less than the loss.",
       [](const SourceModelFacts& facts) { return facts.has_friction; },
       [](const SourceModelFacts&, SourceModelSettings* s) { s->stiff_friction = true; }},
      {"integration", "step and integrator",
       "How time is cut into steps: here against the Runge-Kutta method at a quarter of the step.",
       &Always,
       [](const SourceModelFacts&, SourceModelSettings* s) {
         s->integrator = SourceModelIntegrator::kRk4;
         s->step_factor = 0.25;
       }},
      {"drives", "drives that lag behind their command",
       "The file's own servos or equalities hold the drives; they follow with a delay, and their "
       "forces are those of another motion than the commanded one.",
       [](const SourceModelFacts& facts) {
         return std::any_of(facts.held_by.begin(), facts.held_by.end(),
                            [](DriveHold hold) { return hold != DriveHold::kAdded; });
       },
       [](const SourceModelFacts&, SourceModelSettings* s) { s->exact_drives = true; }},
      {"left_out", "what the reference does not have",
       "The file has it, the reference computes without it: not an error of the file.",
       [](const SourceModelFacts& facts) { return !facts.left_out.empty(); },
       [](const SourceModelFacts&, SourceModelSettings* s) { s->plain = true; }},
      {"solver", "a solver that stops early",
       "solver, iterations and tolerance say how well MuJoCo solves for the forces of one step.",
       [](const SourceModelFacts& facts) { return facts.rough_solver; },
       [](const SourceModelFacts&, SourceModelSettings* s) { s->exact_solver = true; }}};
  return kRows;
}

class Auditor {
 public:
  explicit Auditor(const SourceModelRequest& request) : request_(request), runs_(request) {}

  SourceModelAudit Run() {
    audit_.file = request_.file;
    audit_.duration_s = request_.prepared->scenario.motion.duration_s;
    audit_.length_m = runs_.length_m();
    audit_.not_run = runs_.not_run();
    if (audit_.not_run.empty()) Audit();
    audit_.seconds = Seconds();
    return std::move(audit_);
  }

 private:
  void Audit() {
    Report(0.0);
    const SourceModelRuns::Measured own = runs_.Run({});
    if (own.run.summary.stop == Stop::kUnsupported) {
      audit_.not_run = own.run.summary.message;
      return;
    }
    audit_.as_is = own.error;
    audit_.notes = own.run.notes;
    ReportFile(own.run.facts);
    Attribute(own.run.facts);
    if (audit_.Good(audit_.as_is)) return;
    // Settings are judged where nothing but them is wrong.
    SourceModelSettings base;
    base.exact_drives = true;
    base.plain = !own.run.facts.left_out.empty();
    base.stiff_friction = own.run.facts.has_friction;
    const SourceModelRuns::Measured bare = runs_.Run(base);
    audit_.bare = bare.error;
    const bool comparable = !bare.error.sound() || std::isfinite(bare.error.force);
    if (comparable && !audit_.Good(bare.error))
      SearchSettings(request_, base, bare, &runs_, &audit_);
  }

  void Report(double fraction) const {
    if (request_.progress) request_.progress("source model", fraction);
  }

  void ReportFile(const SourceModelFacts& facts) {
    audit_.step_s = facts.step_s;
    audit_.integrator = facts.integrator;
    audit_.solver = fmt::format("{}, {} iterations, tolerance {:g}", facts.solver, facts.iterations,
                                facts.tolerance);
    audit_.closures = facts.closures;
    audit_.solref = facts.solref;
    audit_.solimp = facts.solimp;
    ReportActuated(facts);
    audit_.done.emplace_back("contacts are off: with them it would be another mechanism");
    const auto say = [&](const std::vector<std::string>& names, const char* what) {
      constexpr size_t kMost = 6;
      if (!names.empty()) audit_.done.push_back(fmt::format("{}: {}", what, Joined(names, kMost)));
    };
    say(facts.held, "free bodies are held where they are, by an inertia 1e12 times the robot's");
    say(facts.couplings, "couplings that the reference does not have are off");
    say(facts.damped, "servos whose kv is taken over by hand, as MuJoCo 2.2 does not know it");
    if (request_.prepared->scenario.simulation.ignore_ranges) {
      audit_.done.emplace_back("limits of joints are off: home is beyond one");
    }
    say(facts.unused_actuators, "actuators that act through tendons or drive nothing here are off");
    say(facts.left_out, "the file has what the reference does not");
  }

  void ReportActuated(const SourceModelFacts& facts) {
    std::vector<std::string> servos, equalities, motors, bare;
    for (size_t k = 0; k < facts.held_by.size(); ++k) {
      const std::string& name = request_.prepared->base.drives[k].name;
      switch (facts.held_by[k]) {
        case DriveHold::kServo:
          servos.push_back(name);
          break;
        case DriveHold::kEquality:
          equalities.push_back(name);
          break;
        case DriveHold::kAdded:
          (facts.motors[k].empty() ? bare : motors).push_back(name);
          break;
      }
    }
    const auto say = [&](const std::vector<std::string>& names, const std::string& how) {
      constexpr size_t kMost = 6;
      if (!names.empty()) audit_.done.push_back(Joined(names, kMost) + ": " + how);
    };
    say(servos, "driven by the file's own position servos, which get the commanded positions");
    say(equalities,
        "driven by the file's own equality on the joint, which gets the commanded position");
    const std::string exactly =
        "an added equality prescribes the joint, as stiff as MuJoCo allows and with the commanded "
        "acceleration, so that it adds no error of its own";
    say(motors, "motors in the file, which do not know where to go: " + exactly);
    say(bare, "no actuator in the file: " + exactly);
  }

  // A run, unless runs have taken too long already.
  SourceModelError Try(const SourceModelSettings& settings) {
    constexpr double kMost_s = 60.0;
    const double s = Seconds();
    if (s < kMost_s) return runs_.Run(settings).error;
    SourceModelError error;
    error.failure = fmt::format("left out: other runs had taken {:.0f} s", s);
    return error;
  }

  [[nodiscard]] double Seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

  void Attribute(const SourceModelFacts& facts) {
    std::vector<const CauseRow*> rows;
    SourceModelSettings all;
    for (const CauseRow& row : Rows()) {
      if (!row.applies(facts)) continue;
      rows.push_back(&row);
      row.correct(facts, &all);
    }
    const double steps = 2.0 * static_cast<double>(rows.size()) + 2.0;
    double step = 0.0;
    audit_.corrected = Try(all);
    if (audit_.corrected.sound() && !audit_.Good(audit_.corrected)) {
      SourceModelSettings softer = all;
      softer.impedance = 1.0 - 10.0 * (1.0 - kMjcfImpedance);
      audit_.softer = Try(softer);
    }
    for (const CauseRow* row : rows) {
      SourceModelSettings without, alone;
      row->correct(facts, &without);
      for (const CauseRow* other : rows) {
        if (other != row) other->correct(facts, &alone);
      }
      Report((step += 1.0) / steps);
      SourceModelCause cause{.key = row->key, .title = row->title, .meaning = row->meaning};
      cause.without = Try(without);
      Report((step += 1.0) / steps);
      cause.alone = Try(alone);
      audit_.causes.push_back(std::move(cause));
    }
    for (SourceModelCause& cause : audit_.causes) {
      if (cause.key == "left_out") cause.title += ": " + Joined(facts.left_out);
    }
  }

  const SourceModelRequest& request_;
  SourceModelRuns runs_;
  SourceModelAudit audit_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

SourceModelAudit AuditSourceModel(const SourceModelRequest& request) {
  return Auditor(request).Run();
}

}  // namespace mbv
