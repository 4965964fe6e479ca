#include "tests/laws/subject.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <set>

#include "core/demand.h"
#include "mechanism/channels.h"
#include "mechanism/load_model.h"

namespace mbv::laws {
namespace {

// Shipped motions to disturb: of a model not named here its default.yaml.
std::vector<std::string> ScenariosOf(const std::string& model) {
  if (model == "stabilizing_platform") return {"hold_still", "sea_state"};
  if (model == "scara_robot") return {"default", "pick_place"};  // drives, platform commanded
  return {"default"};
}

std::mt19937_64 Engine(const std::string& subject, Regime regime) {
  std::seed_seq seed(subject.begin(), subject.end());
  std::vector<unsigned> words(2);
  seed.generate(words.begin(), words.end());
  return std::mt19937_64(words[0] + 977u * static_cast<unsigned>(regime));
}

Load LawLoad(const Mechanism& mechanism, double length_m) {
  Load load;
  load.name = "law";
  load.body = mechanism.outputs.front().body;
  load.p_BoQ_B = length_m * Vec3(0.05, -0.03, 0.08);
  return load;
}

double Weight(const Mechanism& mechanism) {
  const Body& body = mechanism.bodies[mechanism.outputs.front().body];
  return 9.81 * std::max(body.mass, 1e-3);
}

// Couplings, and commands whose small displacement the closed form refuses.
std::vector<bool> HeldCommands(const Subject& s) {
  CommandSample first;
  EvaluateMotion(s.motion, 0.0, &first);
  std::vector<bool> held;
  for (size_t k = 0; k < s.motion.commands.size(); ++k) {
    held.push_back(s.motion.commands[k].terms.size() > 1 ||
                   !ByClosedForm(s, Displaced(first, k, 1e-6 * s.ScaleOf(k))).summary.ok());
  }
  return held;
}

Subject MakeSubject(const std::string& model, const std::string& scenario) {
  const std::string file =
      std::string(MBV_SOURCE_DIR) + "/scenarios/" + model + "/" + scenario + ".yaml";
  ScenarioResult loaded = LoadScenario(file);
  MBV_DEMAND(loaded.scenario.has_value() && loaded.mechanism.has_value(),
             loaded.diagnostics.Text());
  Subject s;
  s.name = model + "_" + scenario;
  s.scenario = *loaded.scenario;
  s.mechanism = *loaded.mechanism;
  s.motion = s.scenario.motion;
  s.length_m = CharacteristicLength(s.mechanism);
  s.motion.loads = {LawLoad(s.mechanism, s.length_m)};
  s.held = HeldCommands(s);
  return s;
}

// Largest singular value over the smallest, with metres divided by the mechanism's length.
double ConditionOf(const Subject& subject, const CommandSample& at) {
  MatX J = DriveJacobian(subject, at);
  const Mechanism& m = subject.mechanism;
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    const auto drives = static_cast<Eigen::Index>(m.drives.size());
    const bool length = i < drives ? PositionUnit(m, m.drives[i]) == "m"
                                   : IsLength(m.joints[m.prescribed[i - drives].joint].kind, 0);
    if (length) J.row(i) /= subject.length_m;
  }
  Eigen::Index kept = 0;
  for (size_t k = 0; k < subject.motion.commands.size(); ++k) {
    if (subject.IsHeld(k)) continue;
    J.col(kept++) = J.col(static_cast<Eigen::Index>(k)) * subject.ScaleOf(k);
  }
  if (!J.leftCols(kept).allFinite()) return kNan;
  const VecX sigma = J.leftCols(kept).jacobiSvd().singularValues();
  return sigma[0] / sigma[sigma.size() - 1];
}

// Relative change of the drive forces per relative displacement of a command, at least one.
double ForceSensitivity(const Subject& s, const CommandSample& at) {
  constexpr double kDisplacement = 1e-7;
  const Answer here = ByClosedForm(s, at);
  double largest = 1.0;
  for (size_t k = 0; k < s.motion.commands.size() && here.summary.ok(); ++k) {
    if (s.IsHeld(k)) continue;
    CommandSample moved = at;
    moved.position[static_cast<Eigen::Index>(k)] += kDisplacement * s.ScaleOf(k);
    const Answer there = ByClosedForm(s, moved);
    if (!there.summary.ok()) continue;
    largest = std::max(largest, (there.force - here.force).norm() /
                                    (kDisplacement * std::max(here.force.norm(), 1e-9)));
  }
  return largest;
}

CommandSample Disturbed(const Subject& s, double t_s, double offset, double rate,
                        std::mt19937_64* engine) {
  std::uniform_real_distribution<double> pm(-1.0, 1.0);
  CommandSample c;
  EvaluateMotion(s.motion, t_s, &c);
  for (size_t k = 0; k < s.motion.commands.size(); ++k) {
    if (s.IsHeld(k)) continue;
    const auto i = static_cast<Eigen::Index>(k);
    c.position[i] += offset * s.ScaleOf(k) * pm(*engine);
    c.velocity[i] += rate * s.ScaleOf(k) * pm(*engine);
    c.acceleration[i] += 10 * rate * s.ScaleOf(k) * pm(*engine);
  }
  LoadSample& load = c.loads.front();
  for (int j = 0; j < 3; ++j) {
    load.force[j] = rate * Weight(s.mechanism) * pm(*engine);
    load.moment[j] = 0.1 * rate * Weight(s.mechanism) * s.length_m * pm(*engine);
  }
  return c;
}

CommandSample FirstSample(const Subject& s) {
  CommandSample c;
  EvaluateMotion(s.motion, 0.0, &c);
  return c;
}

// Drives followed from the first sample lead to the pose and not, past a pose where they lose
// control, into another assembly.
bool InSameAssembly(const Subject& s, const CommandSample& c) {
  const Motion drives = s.DriveMotion();
  ReferenceSolver forward(s.mechanism, drives);
  ReferenceSample sample;
  std::vector<DrivenSample> way = WayTo(s, c);
  way.push_back(ByClosedForm(s, c).driven);
  for (const DrivenSample& step : way) {
    if (!forward.Kinematics(DriveCommand(step, c), &sample).ok()) return false;
  }
  return (CommandsAt(s, sample.states, c).position - c.position).norm() < 1e-3 * s.length_m;
}

// A hundredth before each boundary; the worst conditioned of these poses, in slow motion. Poses
// behind another singular pose, which a single sample of the closed form cannot know of, are left
// out by asking the reference.
State NearSingular(const Subject& s, std::mt19937_64* engine) {
  const CommandSample first = FirstSample(s);
  State worst{.name = "near_singular", .command = first, .condition = 0.0};
  for (const Boundary& boundary : BoundariesOf(s.name)) {
    CommandSample c = Disturbed(s, 0.0, 0.0, 1e-2, engine);
    c.position[static_cast<Eigen::Index>(boundary.command)] += 0.99 * boundary.distance;
    const double condition = ConditionOf(s, c) * ForceSensitivity(s, c);
    if (condition > worst.condition && ByReference(s, c).summary.ok() && InSameAssembly(s, c)) {
      worst = {.name = s.motion.commands[boundary.command].name + " near its end",
               .command = c,
               .condition = condition};
    }
  }
  return worst;
}

std::vector<State> MakeStates(const Subject& s, Regime regime) {
  std::mt19937_64 engine = Engine(s.name, regime);
  std::vector<State> states;
  switch (regime) {
    case Regime::kFirstSample:
      states.push_back({"first sample", FirstSample(s)});
      break;
    case Regime::kClose:
      states.push_back({"1e-8 away", Disturbed(s, 0.0, 1e-8, 1e-8, &engine)});
      break;
    case Regime::kRandom:
      for (int i = 0; i < 4; ++i) {
        std::uniform_real_distribution<double> time(0.0, s.motion.duration_s);
        const double t_s = time(engine);
        states.push_back({"seed " + std::to_string(i), Disturbed(s, t_s, 0.02, 0.5, &engine)});
      }
      break;
    case Regime::kNearSingular:
      states.push_back(NearSingular(s, &engine));
      // The distance to the boundary scales the motion's higher derivatives.
      states.back().difference_step_s = 1e-4;
      break;
  }
  for (State& state : states) {
    state.condition = ConditionOf(s, state.command) * ForceSensitivity(s, state.command);
  }
  return states;
}

bool Answers(const Subject& s, const CommandSample& c) { return ByClosedForm(s, c).summary.ok(); }

std::vector<Boundary> MakeBoundaries(const Subject& s) {
  std::vector<Boundary> found;
  const CommandSample first = FirstSample(s);
  for (size_t k = 0; k < s.motion.commands.size(); ++k) {
    if (s.IsHeld(k)) continue;
    for (const double direction : {-1.0, 1.0}) {
      // Steps of a fiftieth up to two lengths or two radians, then halving.
      const double step = direction * 0.02 * s.ScaleOf(k);
      double inside = 0.0, outside = 0.0;
      for (int i = 1; i <= 100 && outside == 0.0; ++i) {
        if (Answers(s, Displaced(first, k, i * step))) {
          inside = i * step;
        } else {
          outside = i * step;
        }
      }
      if (outside == 0.0) continue;
      for (int i = 0; i < 50; ++i) {
        const double middle = 0.5 * (inside + outside);
        (Answers(s, Displaced(first, k, middle)) ? inside : outside) = middle;
      }
      found.push_back({k, inside});
    }
  }
  return found;
}

}  // namespace

Subject Subject::With(const Overrides& overrides) const {
  Subject s = *this;
  LoadOptions options;
  options.overrides = Merge(scenario.parameters, overrides);
  LoadResult loaded = LoadModel(scenario.model_file, options);
  MBV_DEMAND(loaded.mechanism.has_value(), loaded.diagnostics.Text());
  s.mechanism = *std::move(loaded.mechanism);
  return s;
}

Overrides Subject::Heavier(double factor) const {
  // Parameters without a unit follow from these.
  Overrides heavier;
  for (const Parameter& p : mechanism.parameters) {
    if (p.unit == "kg" || p.unit == "kg m^2") heavier[p.name] = factor * p.value;
  }
  return heavier;
}

std::unique_ptr<ClosedForm> Subject::MakeClosedForm() const {
  const ClosedFormRow* row = FindClosedForm(mechanism.name);
  MBV_DEMAND(row != nullptr, mechanism.name);
  Diagnostics diagnostics;
  auto form = row->factory(mechanism, motion, {.model = scenario.analytic.model, .as_printed = {}},
                           &diagnostics);
  MBV_DEMAND(form != nullptr, diagnostics.Text());
  return form;
}

Motion Subject::DriveMotion() const {
  using Kind = Coordinate::Kind;
  Motion all;
  all.loads = motion.loads;
  const auto add = [&](const std::string& command, Kind kind, size_t index) {
    all.commands.push_back({command, {{{kind, static_cast<int>(index), 0}, 1.0}}, Constant(0.0)});
  };
  for (size_t d = 0; d < mechanism.drives.size(); ++d)
    add(mechanism.drives[d].name, Kind::kDrive, d);
  for (size_t p = 0; p < mechanism.prescribed.size(); ++p) {
    add(mechanism.prescribed[p].name, Kind::kPrescribed, p);
  }
  return all;
}

bool Subject::IsLengthCommand(size_t k) const {
  const Coordinate& c = motion.commands[k].terms.front().coordinate;
  switch (c.kind) {
    case Coordinate::Kind::kPrescribed:
      return IsLength(mechanism.joints[mechanism.prescribed[c.index].joint].kind, 0);
    case Coordinate::Kind::kDrive:
      return PositionUnit(mechanism, mechanism.drives[c.index]) == "m";
    case Coordinate::Kind::kOutput:
      return c.component < 3;
    case Coordinate::Kind::kJoint:
      return IsLength(mechanism.joints[c.index].kind, c.component);
  }
  return false;
}

std::vector<std::string> ModelNames() {
  std::set<std::string> names;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(MBV_SOURCE_DIR) + "/models")) {
    const std::string name = entry.path().filename().string();
    if (std::filesystem::exists(entry.path() / "model.yaml") && FindClosedForm(name) != nullptr) {
      names.insert(name);
    }
  }
  return {names.begin(), names.end()};
}

std::vector<std::string> SubjectNames() {
  std::vector<std::string> names;
  for (const std::string& model : ModelNames()) {
    for (const std::string& scenario : ScenariosOf(model)) {
      names.push_back(model + "_" + scenario);
    }
  }
  return names;
}

const Subject& SubjectOf(const std::string& name) {
  static std::map<std::string, Subject> cache;
  const auto found = cache.find(name);
  if (found != cache.end()) return found->second;
  for (const std::string& model : ModelNames()) {
    for (const std::string& scenario : ScenariosOf(model)) {
      if (model + "_" + scenario == name) {
        return cache.emplace(name, MakeSubject(model, scenario)).first->second;
      }
    }
  }
  MBV_DEMAND(false, name);
  return cache.begin()->second;
}

const std::string& NameOf(Regime regime) {
  static const std::string names[] = {"first_sample", "close_by", "random", "near_singular"};
  return names[static_cast<int>(regime)];
}

const std::vector<State>& StatesOf(const std::string& subject, Regime regime) {
  static std::map<std::pair<std::string, Regime>, std::vector<State>> cache;
  const auto found = cache.find({subject, regime});
  if (found != cache.end()) return found->second;
  return cache.emplace(std::pair(subject, regime), MakeStates(SubjectOf(subject), regime))
      .first->second;
}

const std::vector<Boundary>& BoundariesOf(const std::string& subject) {
  static std::map<std::string, std::vector<Boundary>> cache;
  const auto found = cache.find(subject);
  if (found != cache.end()) return found->second;
  return cache.emplace(subject, MakeBoundaries(SubjectOf(subject))).first->second;
}

CommandSample Displaced(const CommandSample& from, size_t command, double distance) {
  CommandSample c = from;
  c.position[static_cast<Eigen::Index>(command)] += distance;
  c.velocity.setZero();
  c.acceleration.setZero();
  return c;
}

Answer ByClosedForm(const Subject& subject, const CommandSample& command) {
  Answer answer;
  ClosedFormSample sample;
  answer.summary = subject.MakeClosedForm()->Dynamics(command, &sample);
  answer.driven = sample.driven;
  answer.force = sample.force;
  answer.extra = sample.extra;
  return answer;
}

Answer Ask(ReferenceSolver* solver, const CommandSample& command) {
  Answer answer;
  ReferenceSample sample;
  answer.summary = solver->Dynamics(command, &sample);
  answer.driven = sample.driven;
  answer.force = sample.drive_force;
  answer.prescribed_force = sample.prescribed_force;
  answer.states = sample.states;
  answer.power_input_W = sample.power_input_W;
  answer.energy_rate_W = sample.energy_rate_W;
  return answer;
}

Answer ByReference(const Subject& subject, const CommandSample& command) {
  ReferenceSolver solver(subject.mechanism, subject.motion);
  return Ask(&solver, command);
}

Answer BySimulation(const Subject& subject, const DrivenSample& driven,
                    const CommandSample& command) {
  Motion motion = subject.motion;
  std::vector<DrivenSample> samples = WayTo(subject, command);
  samples.push_back(driven);
  motion.sample_s = 1e-6;  // too short for the last sample's speed to lead Newton astray
  motion.duration_s = motion.sample_s * static_cast<double>(samples.size() - 1);
  for (size_t k = 0; k < motion.loads.size(); ++k) {
    for (int j = 0; j < 3; ++j) {
      motion.loads[k].force[j] = Constant(command.loads[k].force[j]);
      motion.loads[k].moment[j] = Constant(command.loads[k].moment[j]);
    }
  }
  const SimulationRun run = Simulate(subject.mechanism, motion,
                                     [&](double, DrivenSample* out) {
                                       *out = driven;
                                       return RunSummary::Done();
                                     },
                                     {.mode = SimulationMode::kInverse});
  Answer answer;
  answer.summary = run.summary;
  if (!run.summary.ok()) return answer;
  answer.driven = driven;
  const auto at = [&](const std::string& channel) {
    const int column = run.trace.Find(channel);
    return column < 0 ? kNan : run.trace.values(run.trace.values.rows() - 1, column);
  };
  const Mechanism& m = subject.mechanism;
  answer.force.resize(static_cast<Eigen::Index>(m.drives.size()));
  for (size_t d = 0; d < m.drives.size(); ++d) {
    answer.force[static_cast<Eigen::Index>(d)] = at(m.drives[d].name + ".force");
  }
  answer.prescribed_force.resize(static_cast<Eigen::Index>(m.prescribed.size()));
  for (size_t p = 0; p < m.prescribed.size(); ++p) {
    answer.prescribed_force[static_cast<Eigen::Index>(p)] = at(m.prescribed[p].name + ".force");
  }
  answer.states.Resize(m.bodies.size());
  answer.states.X_WB = run.X_WB.back();
  answer.power_input_W = at("power.input");
  answer.energy_rate_W = at("power.energy_rate");
  return answer;
}

CommandSample CommandsAt(const Subject& subject, const BodyStates& states,
                         const CommandSample& near) {
  CommandSample c = near;
  for (size_t k = 0; k < subject.motion.commands.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    c.position[i] = c.velocity[i] = c.acceleration[i] = 0.0;
    const Command& command = subject.motion.commands[k];
    for (const Command::Term& term : command.terms) {
      const double expected = command.terms.size() == 1 ? near.position[i] : 0.0;
      const ScalarRow row = CoordinateRow(subject.mechanism, term.coordinate, states, expected);
      const auto along = [&](const std::vector<Vec6>& rate) {
        return row.J_parent.dot(rate[row.parent]) + row.J_child.dot(rate[row.child]);
      };
      c.position[i] += term.factor * row.value;
      c.velocity[i] += term.factor * along(states.V_WB);
      c.acceleration[i] += term.factor * (along(states.A_WB) + row.bias);
    }
  }
  return c;
}

std::vector<DrivenSample> WayTo(const Subject& subject, const CommandSample& command) {
  constexpr int kSteps = 16;
  CommandSample first;
  EvaluateMotion(subject.motion, 0.0, &first);
  const auto form = subject.MakeClosedForm();
  std::vector<DrivenSample> way;
  for (int i = 0; i < kSteps; ++i) {
    CommandSample c = Displaced(first, 0, 0.0);
    c.position += (command.position - first.position) * i / kSteps;
    DrivenSample driven;
    if (form->Kinematics(c, &driven).ok()) way.push_back(std::move(driven));
  }
  return way;
}

CommandSample DriveCommand(const DrivenSample& driven, const CommandSample& loads) {
  CommandSample c;
  c.time_s = loads.time_s;
  c.position = driven.position;
  c.velocity = driven.velocity;
  c.acceleration = driven.acceleration;
  c.loads = loads.loads;
  return c;
}

MatX DriveJacobian(const Subject& subject, const CommandSample& at) {
  const auto commands = static_cast<Eigen::Index>(subject.motion.commands.size());
  const auto driven = static_cast<Eigen::Index>(subject.mechanism.drives.size() +
                                                subject.mechanism.prescribed.size());
  MatX J(driven, commands);
  CommandSample c = at;
  c.acceleration.setZero();
  const auto form = subject.MakeClosedForm();
  for (Eigen::Index k = 0; k < commands; ++k) {
    c.velocity.setZero();
    J.col(k).setZero();
    if (subject.IsHeld(static_cast<size_t>(k))) continue;
    c.velocity[k] = 1.0;
    DrivenSample sample;
    J.col(k).setConstant(kNan);
    if (form->Kinematics(c, &sample).ok()) J.col(k) = sample.velocity;
  }
  return J;
}

}  // namespace mbv::laws
