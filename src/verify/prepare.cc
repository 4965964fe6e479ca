#include "verify/prepare.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <map>

#include "base/text.h"
#include "equations/equations.h"
#include "kinematics/home.h"
#include "math/spatial.h"
#include "mechanism/channels.h"
#include "mechanism/motion.h"
#include "mechanism/reach.h"
#include "model_file/load_model.h"
#include "plot/figure.h"
#include "reference/reference.h"
#include "verify/drive_by.h"

namespace mbv {
namespace {

// What the closed form does not cover of this mechanism and its loads.
std::vector<Finding> UncoveredBy(const ClosedFormRow& row, const Scenario& scenario,
                                 const Mechanism& mechanism) {
  if (row.coverage == nullptr) return {};
  const Coverage coverage = row.coverage(mechanism);
  std::vector<Finding> uncovered = FindUncovered(coverage, mechanism, Concern::kDynamics);
  for (Finding& load : FindUncoveredLoads(coverage, mechanism, scenario.motion)) {
    uncovered.push_back(std::move(load));
  }
  return uncovered;
}

// Every channel that some witness may record.
std::vector<Channel> RecordableChannels(const Prepared& prepared) {
  const Mechanism& mechanism = prepared.base;
  std::vector<Channel> channels;
  const auto add = [&](const std::vector<Channel>& more) {
    channels.insert(channels.end(), more.begin(), more.end());
  };
  add(DriveChannels(mechanism));
  add(OutputChannels(mechanism));
  for (const Output& output : mechanism.outputs) add(OutputRateChannels(mechanism, output));
  add(PrescribedChannels(mechanism));
  add(BandChannels(mechanism));
  for (const Joint& joint : mechanism.joints) add(ReactionChannels(joint));
  add(AuditChannels());
  add(EnergyChannels());
  for (const Coordinate& joint : prepared.scenario.motion.RecordedJoints()) {
    add(JointChannels(mechanism, joint, true));
  }
  add(WorkChannels(mechanism));
  if (prepared.has_closed_form()) add(prepared.closed_form.closed_form->extra_channels());
  return channels;
}

}  // namespace

std::string WarnNotApplicable(const std::string& scenario_file, std::vector<Finding> uncovered,
                              Diagnostics* diagnostics) {
  const std::string reason = ReasonNotApplicable(uncovered);
  for (Finding& finding : uncovered) {
    finding.file = scenario_file;
    finding.message = "analytic is not applicable: " + finding.message;
    diagnostics->Add(std::move(finding));
  }
  return reason;
}

void AddFormFindings(const std::string& scenario_file, const Diagnostics& found,
                     Diagnostics* diagnostics) {
  for (Finding finding : found.findings()) {
    if (finding.file.empty()) finding.file = scenario_file;
    diagnostics->Add(std::move(finding));
  }
}

WitnessMechanisms LoadMechanisms(const Scenario& scenario, const Mechanism& base,
                                 Diagnostics* diagnostics) {
  const auto load = [&](const Overrides& own, const Role& witness) {
    return LoadVariant(scenario, base, own, witness, diagnostics);
  };
  return {load(scenario.analytic.parameters, role::kAnalytic),
          load(scenario.reference.parameters, role::kReference),
          load(scenario.simulation.parameters, role::kSimulated)};
}

std::map<std::string, Overrides> OwnParameters(const Scenario& scenario, const Mechanism& base) {
  std::map<std::string, Overrides> own;
  const auto add = [&](const Role& role, const Overrides& parameters) {
    for (const auto& [name, value] : parameters) {
      if (base.ParameterValue(name) != value) own[role.name][name] = value;
    }
  };
  add(role::kAnalytic, scenario.analytic.parameters);
  for (const Role* role : {&role::kSolver, &role::kReached}) {
    add(*role, scenario.reference.parameters);
  }
  // A table has the reference's place.
  if (scenario.reference.table == nullptr) add(role::kReference, scenario.reference.parameters);
  add(role::kSimulated, scenario.simulation.parameters);
  return own;
}

Mechanism LoadVariant(const Scenario& scenario, const Mechanism& base, const Overrides& own,
                      const Role& witness, Diagnostics* diagnostics) {
  if (own.empty()) return base;
  LoadResult loaded = LoadModel(scenario.model_file, ModelOptions(scenario, own));
  if (loaded.mechanism) return *std::move(loaded.mechanism);
  diagnostics->Append(loaded.diagnostics);
  diagnostics->AddError(
      scenario.file,
      fmt::format("the model cannot be loaded with the parameters of the {} witness", witness.name),
      "");
  return base;
}

namespace {

// The equations of the scenario's file.
ClosedFormChoice MakeFromFile(const Scenario& scenario, const Mechanism& mechanism,
                              const ProgramConsent& consent, Diagnostics* diagnostics) {
  const ProgramList program = EquationProgramOf(scenario, consent.archived);
  if (consent.none && !program.programs.empty()) {
    return {nullptr, "its equations are a program, which is not run here"};
  }
  // Agreed to is a scenario's whole list.
  if (!consent.Allows(program) && !consent.Allows(ProgramsOf(scenario, consent.archived))) {
    Finding refusal = Refusal(program);
    refusal.severity = Severity::kWarning;
    diagnostics->Add(std::move(refusal));
    return {nullptr, "its equations are a program that may not run", WitnessGap::kNotApplicable};
  }
  Diagnostics found;
  FileForm made = MakeFileForm(scenario.analytic.equations, mechanism, scenario.motion, &found);
  diagnostics->Append(found);
  if (!made.uncovered.empty()) {
    ClosedFormChoice choice;
    choice.reason = ReasonNotApplicable(made.uncovered);
    choice.gap = WitnessGap::kNotApplicable;
    for (Finding& finding : made.uncovered) {
      if (finding.file.empty()) finding.file = scenario.analytic.equations;
      finding.message = "analytic is not applicable: " + finding.message;
      diagnostics->Add(std::move(finding));
    }
    return choice;
  }
  if (made.closed_form == nullptr) return {nullptr, "its equations do not work"};
  const SimulationSettings& simulation = scenario.simulation;
  const bool by_forces = simulation.mode == DriveMode::kForceDriven ||
                         (simulation.mode == DriveMode::kServo && simulation.servo.feedforward);
  if (!made.closed_form->gives_forces() && simulation.on && by_forces) {
    return {nullptr, "its equations give no forces, and these would move the simulation",
            WitnessGap::kNotApplicable};
  }
  ClosedFormChoice choice{std::move(made.closed_form), ""};
  choice.unchecked = std::move(made.unchecked);
  return choice;
}

}  // namespace

ClosedFormChoice MakeClosedForm(const Scenario& scenario, const Mechanism& mechanism,
                                const ProgramConsent& consent, Diagnostics* diagnostics) {
  if (!scenario.analytic.on) return {nullptr, "switched off in the scenario"};
  const WitnessGap asked =
      scenario.analytic.stated ? WitnessGap::kNotApplicable : WitnessGap::kNone;
  if (scenario.motion.free()) {
    return {nullptr, "closed forms give forces for a motion, not the motion for forces", asked};
  }
  if (const auto joints = scenario.motion.RecordedJoints(); !joints.empty()) {
    return {nullptr,
            "closed forms are commanded by drives and outputs, and the motion commands " +
                NameOf(mechanism, joints.front()),
            asked};
  }
  if (!scenario.analytic.equations.empty()) {
    return MakeFromFile(scenario, mechanism, consent, diagnostics);
  }
  const ClosedFormRow* row = FindClosedForm(mechanism.name);
  if (row == nullptr) {
    return {nullptr, "there are no closed-form equations for " + mechanism.name, asked};
  }
  const AnalyticSettings& settings = scenario.analytic;
  bool fits = true;
  if (!settings.model.empty() && !Contains(row->models, settings.model)) {
    diagnostics->AddError(
        scenario.file,
        fmt::format("analytic.model = '{}' is not one of: {}", settings.model, Joined(row->models)),
        "");
    fits = false;
  }
  for (const std::string& erratum : settings.as_printed) {
    if (Contains(row->errata, erratum)) continue;
    diagnostics->AddError(
        scenario.file,
        fmt::format("analytic.as_printed: '{}' is not one of: {}", erratum, Joined(row->errata)),
        "");
    fits = false;
  }
  if (!fits) return {nullptr, "the scenario asks for a formulation that does not exist"};
  if (std::string reason =
          WarnNotApplicable(scenario.file, UncoveredBy(*row, scenario, mechanism), diagnostics);
      !reason.empty()) {
    return {nullptr, std::move(reason), WitnessGap::kNotApplicable};
  }
  Diagnostics found;
  auto closed_form =
      row->factory(mechanism, scenario.motion,
                   {.model = settings.model, .as_printed = settings.as_printed}, &found);
  AddFormFindings(scenario.file, found, diagnostics);
  if (closed_form == nullptr) return {nullptr, "the closed form does not suit this scenario"};
  return {std::move(closed_form), ""};
}

std::optional<Prepared> Prepare(const std::string& file, const ScenarioOptions& options,
                                Diagnostics* diagnostics, const ProgramConsent& consent) {
  return Prepare(LoadScenario(file, options), diagnostics, consent);
}

std::optional<Prepared> Prepare(ScenarioResult loaded, Diagnostics* diagnostics,
                                const ProgramConsent& consent) {
  diagnostics->Append(loaded.diagnostics);
  if (!loaded.scenario) return {};
  Prepared prepared{.scenario = *std::move(loaded.scenario),
                    .base = *std::move(loaded.mechanism),
                    .mechanisms = {},
                    .closed_form = {},
                    .consent = consent};
  prepared.mechanisms = LoadMechanisms(prepared.scenario, prepared.base, diagnostics);
  prepared.closed_form =
      MakeClosedForm(prepared.scenario, prepared.mechanisms.analytic, consent, diagnostics);
  if (prepared.scenario.simulation.on && !prepared.has_closed_form() &&
      !prepared.scenario.reference.on && !prepared.scenario.motion.free()) {
    Finding finding;
    finding.file = prepared.scenario.file;
    finding.message =
        "simulation needs the drive motion, but neither a closed form nor the reference gives it";
    finding.hint = "set reference: on";
    diagnostics->Add(std::move(finding));
  }
  std::vector<std::string> foreign;
  for (const ForeignWitness& witness : prepared.scenario.witnesses) foreign.push_back(witness.name);
  CheckFigures(prepared.scenario.figures, RecordableChannels(prepared), foreign,
               prepared.scenario.file, diagnostics);
  if (diagnostics->has_errors()) return {};
  return prepared;
}

bool PrepareAgain(Prepared* prepared, Diagnostics* diagnostics) {
  const Scenario& scenario = prepared->scenario;
  if (scenario.analytic.equations.empty()) {
    if (!prepared->has_closed_form()) return true;  // whatever the profiles
    const ClosedFormRow* row = FindClosedForm(prepared->mechanisms.analytic.name);
    if (row != nullptr && row->serves_any_profiles) return true;
  }
  prepared->closed_form =
      MakeClosedForm(scenario, prepared->mechanisms.analytic, prepared->consent, diagnostics);
  return !diagnostics->has_errors();
}

namespace {

// Where a phase ends: poses, twists, and the coordinates of all joints with their turns.
struct PhaseEnd {
  bool reached = false;
  BodyStates states;
  double fastest =
      0.0;  // of any body in the phase, rotations times the characteristic length [m/s]
  std::map<std::string, std::array<double, 6>> joints;
};

double SpeedOf(const Vec6& V, double length_m) {
  return std::max(length_m * V.head<3>().norm(), V.tail<3>().norm());
}

PhaseEnd EndOf(const Prepared& prepared) {
  const Mechanism& mechanism = prepared.base;
  const Motion& motion = prepared.scenario.motion;
  const double length_m = CharacteristicLength(mechanism);
  PhaseEnd end;
  std::vector<std::array<double, 6>> coordinates;
  for (const Joint& joint : mechanism.joints) coordinates.push_back(joint.home);
  ReferenceSolver solver(mechanism, motion, {.explain_unreached = false});
  CommandSample command;
  ReferenceSample sample;
  for (const double t_s : SampleTimes(motion.duration_s, motion.sample_s)) {
    EvaluateMotion(motion, t_s, &command);
    if (!solver.Kinematics(command, &sample).ok()) return end;
    coordinates = JointCoordinatesAt(mechanism, sample.states.X_WB, coordinates);
    for (const Vec6& V : sample.states.V_WB)
      end.fastest = std::max(end.fastest, SpeedOf(V, length_m));
  }
  end.reached = true;
  end.states = std::move(sample.states);
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    end.joints[mechanism.joints[j].name] = coordinates[j];
  }
  return end;
}

// A foot whose place on the ground is stated must be there.
void CheckPlaces(const Prepared& next, const PhaseEnd& before, Diagnostics* diagnostics) {
  const Mechanism& mechanism = next.base;
  const double same_m = 1e-6 * CharacteristicLength(mechanism);  // and rad
  for (const Contact& contact : mechanism.contacts) {
    if (contact.joint < 0) continue;
    const auto foot =
        static_cast<size_t>(mechanism.joints[static_cast<size_t>(contact.joint)].child);
    const Pose off = before.states.X_WB[foot].inverse() * mechanism.X_WB_home[foot];
    const double away_m = off.translation().norm(), turned = LogRotation(off.linear()).norm();
    if (std::max(away_m, turned) <= same_m) continue;
    diagnostics->AddError(
        next.scenario.file,
        fmt::format("phase '{}': at {:g} s {} is {:.3g} m and {:.3g} rad from its place on the "
                    "ground (contacts.{}.to)",
                    next.scenario.phase->name, next.scenario.phase->from_s,
                    mechanism.bodies[foot].name, away_m, turned, contact.name),
        "move the foot there in the phase before, or leave `to` out: the foot then stands where it "
        "lands");
  }
}

// Velocities that jump where feet land or lift.
void FindImpact(const PhaseEnd& before, Prepared* next) {
  constexpr double kNothing = 1e-6;  // of the fastest body's speed
  const Mechanism& mechanism = next->base;
  const double length_m = CharacteristicLength(mechanism);
  ReferenceSolver solver(mechanism, next->scenario.motion, {.explain_unreached = false});
  CommandSample command;
  ReferenceSample sample;
  EvaluateMotion(next->scenario.motion, 0.0, &command);
  if (!solver.Kinematics(command, &sample).ok()) return;
  double most = kNothing * before.fastest;
  std::string text;
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Vec6 jump = sample.states.V_WB[b] - before.states.V_WB[b];
    if (SpeedOf(jump, length_m) <= most) continue;
    most = SpeedOf(jump, length_m);
    text = fmt::format(
        "at {:.6g} s, where phase '{}' begins, velocities jump, most that of {} by {:.3g} m/s and "
        "{:.3g} rad/s: this impact is not computed",
        next->scenario.phase->from_s, next->scenario.phase->name, mechanism.bodies[b].name,
        jump.tail<3>().norm(), jump.head<3>().norm());
  }
  if (!text.empty()) next->left_out_at_start.push_back(std::move(text));
}

// A sole that lands at another angle than it stood at in an earlier phase.
void FindTilts(const std::vector<Prepared>& before, Prepared* next) {
  constexpr double kFlat = 1e-4;  // rad
  const auto normal = [](const Mechanism& mechanism, const Contact& contact) -> Vec3 {
    return mechanism.joints[static_cast<size_t>(contact.joint)].X_CM.linear().col(2);
  };
  for (size_t c = 0; c < next->base.contacts.size(); ++c) {
    const Contact& contact = next->base.contacts[c];
    if (contact.joint < 0 || contact.kind != Contact::Kind::kSole) continue;
    for (const Prepared& earlier : before) {
      const Contact& stood = earlier.base.contacts[c];
      if (stood.joint < 0) continue;
      const double tilt = normal(earlier.base, stood).cross(normal(next->base, contact)).norm();
      if (tilt <= kFlat) break;
      next->left_out_at_start.push_back(fmt::format(
          "from {:.6g} s on {} stands tilted by {:.2g} rad against how it stood before: it is "
          "judged as if it touched the ground all over",
          next->scenario.phase->from_s, contact.name, tilt));
      break;
    }
  }
}

// What was not found in a phase before.
void AppendNew(const Diagnostics& found, Diagnostics* diagnostics) {
  for (const Finding& finding : found.findings()) {
    const bool known = std::ranges::any_of(diagnostics->findings(), [&](const Finding& other) {
      return ToText(other) == ToText(finding);
    });
    if (!known) diagnostics->Add(finding);
  }
}

}  // namespace

std::vector<Prepared> PreparePhases(const std::string& file, const ScenarioOptions& options,
                                    Diagnostics* diagnostics, const ProgramConsent& consent) {
  std::vector<Prepared> phases;
  const bool one = !ReadScenarioHead(file).HasKey("phases");
  PhaseStart start;
  PhaseEnd end;
  for (size_t k = 0, count = 1; k < count; ++k) {
    ScenarioOptions with = options;
    start.index = k;
    if (!one) with.phase = &start;
    Diagnostics found;
    std::optional<Prepared> prepared = Prepare(file, with, &found, consent);
    AppendNew(found, diagnostics);
    if (!prepared) return {};
    if (k > 0) {
      CheckPlaces(*prepared, end, diagnostics);
      if (diagnostics->has_errors()) return {};
      FindImpact(end, &*prepared);
      FindTilts(phases, &*prepared);
    }
    phases.push_back(*std::move(prepared));
    if (one) break;
    count = phases.back().scenario.phase->count;
    if (k + 1 == count) break;
    end = EndOf(phases.back());
    if (!end.reached) break;
    phases.reserve(count);
    start = {.joints = end.joints, .first = &phases.front().base};
  }
  return phases;
}

const Role& Prepared::driver() const {
  if (has_closed_form()) return role::kAnalytic;
  return has_table() ? role::kSolver : role::kReference;
}

DrivenMotion Prepared::MakeDrivenMotion() const {
  if (scenario.motion.free()) return DriveByCommands(mechanisms.simulated, scenario.motion);
  if (!has_closed_form()) return DriveByReference(mechanisms.reference, scenario.motion);
  // A fresh closed form, because it may follow its solution from the start of the motion.
  Diagnostics known;
  ClosedFormChoice fresh = MakeClosedForm(scenario, mechanisms.analytic, consent, &known);
  return DriveByClosedForm(scenario.motion, std::move(fresh.closed_form));
}

DriveForces Prepared::MakeDriveForces() const {
  const SimulationSettings& settings = scenario.simulation;
  const bool servo = settings.mode == DriveMode::kServo && settings.servo.feedforward;
  if (settings.mode != DriveMode::kForceDriven && !servo) return {};
  if (!has_closed_form()) return ForcesByReference(mechanisms.reference, scenario.motion);
  Diagnostics known;
  ClosedFormChoice fresh = MakeClosedForm(scenario, mechanisms.analytic, consent, &known);
  return ForcesByClosedForm(scenario.motion, std::move(fresh.closed_form));
}

}  // namespace mbv
