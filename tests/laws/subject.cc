#include "tests/laws/subject.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <set>

#include "base/demand.h"
#include "mechanism/channels.h"
#include "mechanism/reach.h"
#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

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
      std::string(kSourceDir) + "/scenarios/" + model + "/" + scenario + ".yaml";
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
       std::filesystem::directory_iterator(std::string(kSourceDir) + "/models")) {
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

void PrintTo(Regime regime, std::ostream* out) { *out << NameOf(regime); }

std::vector<size_t> Subject::FreeCommands() const {
  std::vector<size_t> free;
  for (size_t k = 0; k < motion.commands.size(); ++k) {
    const bool base =
        motion.commands[k].terms.front().coordinate.kind == Coordinate::Kind::kPrescribed;
    if (!base && !IsHeld(k)) free.push_back(k);
  }
  return free;
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

}  // namespace mbv::laws
