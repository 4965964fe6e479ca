#include "scenario/load_scenario.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <span>

#include "base/files.h"
#include "base/inputs.h"
#include "base/roles.h"
#include "base/text.h"
#include "kinematics/command_rank.h"
#include "kinematics/mobility.h"
#include "mechanism/channels.h"
#include "mechanism/idle_spins.h"
#include "mechanism/motion.h"
#include "mechanism/same_geometry.h"
#include "model_file/load_model.h"
#include "model_file/yaml/value_reader.h"
#include "scenario/file_parts.h"
#include "scenario/find_model.h"
#include "scenario/section_readers.h"
#include "scenario/tables/table.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr double kMostValues = 1e7;  // of one witness: 80 MB
// Of a table's accelerations: forces of a right model then stay below their limit.
constexpr double kMissedBySteps = 2e-6;
constexpr double kMostTableSteps = 2e5;  // no smaller step is taken than that gives

const std::vector<std::string> kMotionScenarioKeys = {
    "kind",      "mechanism", "description", "parameters", "gravity",  "motion",    "loads",
    "forces",    "analytic",  "reference",   "simulation", "checks",   "snapshots", "expect",
    "witnesses", "figures",   "contacts",    "phases",     "switches", "variables"};

std::string JoinWords(std::vector<std::string> words) {
  constexpr size_t kMost = 8;
  if (words.size() > kMost) {
    words.resize(kMost);
    words.emplace_back("…");
  }
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

// What steps of the integration miss of the second derivative of a table's spline, of its RMS. The
// formulas go on by the cubic through four nodes, whose errors are the fourth differences δ⁴a;
// 19/720 of them stay in the velocities (Adams–Moulton), and guidance over 50 steps makes
// accelerations of what comes together there: some 1 % of δ⁴a.
double MissedBySteps(const MotionTable& table, double duration_s, double step_s) {
  constexpr double kOfDifferences = 1e-2;
  constexpr double kBinomial[] = {1.0, -4.0, 6.0, -4.0, 1.0};
  if (!table.moves || table.spline == nullptr) return 0.0;
  const auto nodes = static_cast<size_t>(std::min(duration_s / step_s, 2.0 * kMostTableSteps));
  std::array<double, 5> last{};  // by the node's number modulo 5
  double missed2 = 0.0, all2 = 0.0;
  for (size_t i = 0; i < nodes; ++i) {
    last[i % 5] = Evaluate(*table.spline, static_cast<double>(i) * step_s).acceleration;
    all2 += last[i % 5] * last[i % 5];
    if (i < 4) continue;
    double difference = 0.0;
    for (size_t k = 0; k < 5; ++k) difference += kBinomial[k] * last[(i - k) % 5];
    missed2 += difference * difference;
  }
  return all2 > 0.0 ? kOfDifferences * std::sqrt(missed2 / all2) : 0.0;
}

class ScenarioLoader final : public internal::ScenarioFile<Scenario, ScenarioResult> {
 public:
  using ScenarioFile::ScenarioFile;

 private:
  void Read(const YamlNode& root) override {
    if (root.is_map() && root.Find("study") != nullptr && root.Find("mechanism") == nullptr) {
      yaml_.Error(*root.Find("study"), "this is a study, no scenario", "mbverify study runs it");
      return;
    }
    if (const YamlNode* kind = root.Find("kind"); kind != nullptr && !IsMotion(*kind)) return;
    YamlMap map(&yaml_, &root, "", kMotionScenarioKeys);
    scenario_.file = file_;
    ReadDescription(map);
    ReadParameters(map.Find("parameters"));
    if (const YamlNode* gravity = map.Find("gravity")) {
      scenario_.gravity_W = values_.Vector(*gravity, "gravity");
    }
    if (const YamlNode* phases = map.Find("phases")) {
      if (!ReadPhase(*phases, map)) return;
    } else {
      ReadHolding(map.Find("contacts"), "contacts");
    }
    if (const YamlNode* mechanism = map.Required("mechanism")) LoadMechanism(*mechanism);
    // Numbers from here on may be expressions of the model's parameters.
    scenario_.analytic = ReadAnalytic(&values_, map.Find("analytic"));
    FindEquations(map.Find("analytic"));
    scenario_.reference = ReadReference(&values_, map.Find("reference"));
    scenario_.simulation = ReadSimulation(&values_, map.Find("simulation"));
    scenario_.witnesses =
        ReadWitnesses(&values_, map.Find("witnesses"), fs::path(file_).parent_path().string());
    scenario_.checks = ReadChecks(&values_, map.Find("checks"), mechanism_ ? &*mechanism_ : nullptr,
                                  &scenario_.start_window_s);
    scenario_.expect = ReadExpectation(&values_, map.Find("expect"));
    scenario_.figures = ReadFigures(&values_, map.Find("figures"));
    if (!mechanism_) return;
    if (const YamlNode* phases = map.Find("phases")) {
      for (const YamlNodePtr& phase : phases->items) CheckHolding(phase->Find("contacts"));
    } else {
      CheckHolding(map.Find("contacts"));
    }
    UsePlainNames();
    const MotionTimes times = ReadTable(map.Find("reference"));
    const YamlNode* motion = map.Required("motion");
    if (motion == nullptr) return;
    scenario_.motion = ReadMotion(&values_, *mechanism_,
                                  {.motion = motion,
                                   .loads = map.Find("loads"),
                                   .forces = map.Find("forces"),
                                   .switches = map.Find("switches"),
                                   .variables = map.Find("variables")},
                                  times, PhaseMotionOf(), &table_findings_);
    ResolveTables(*motion, map.Find("simulation"));
    FitStep(map.Find("simulation"));
    scenario_.snapshots =
        ReadSnapshots(&values_, map.Find("snapshots"), scenario_.motion.duration_s, *mechanism_);
    CheckParameterNames(map);
    if (!yaml_.has_errors()) CheckTogether(*motion, map.Find("simulation"));
    if (!yaml_.has_errors()) CheckDriveMode(*motion, map.Find("simulation"));
    if (!yaml_.has_errors() && scenario_.phase) TakePhase(*map.Find("phases"));
  }

  // The file of equations lies beside the scenario, or beside the model.
  void FindEquations(const YamlNode* analytic) {
    std::string& name = scenario_.analytic.equations;
    if (name.empty()) return;
    const YamlNode& node = *analytic->Find("equations");
    std::error_code error;
    const fs::path path = name;
    for (const fs::path& folder :
         {fs::path(file_).parent_path(), fs::path(scenario_.model_file).parent_path()}) {
      const fs::path found = folder / path;
      if (!fs::is_regular_file(found, error)) continue;
      name = found.lexically_normal().string();
      NoteInput(name, ReadWholeFile(name).value_or(""));
      return;
    }
    // An option's file may lie in the working directory.
    if (scenario_.analytic.equations_typed && fs::is_regular_file(path, error)) return;
    yaml_.Error(node, fmt::format("analytic.equations = '{}': there is no such file beside the "
                                  "scenario or its model",
                                  QuotedValue(name)));
  }

  // Feet that stand on the ground in this scenario.
  void ReadHolding(const YamlNode* node, const std::string& path) {
    if (node == nullptr) return;
    const auto items = yaml_.Items(*node, path);
    if (!items) return;
    scenario_.holding.emplace();
    for (size_t k = 0; k < items->size(); ++k) {
      const auto name = yaml_.Text(*(*items)[k], fmt::format("{}[{}]", path, k));
      if (name) scenario_.holding->push_back(*name);
    }
  }

  // The phase that is loaded; false where the rest of the file has no meaning without it.
  bool ReadPhase(const YamlNode& node, const YamlMap& map) {
    if (options_.phase == nullptr) {
      yaml_.Error(node, "phases: each is a mechanism of its own, which this command does not join",
                  "`mbverify run` and `mbverify regress` do; one phase alone is a scenario with "
                  "contacts: […]");
      return false;
    }
    const auto items = yaml_.Items(node, "phases");
    if (!items) return false;
    if (items->empty()) {
      yaml_.Error(node, "phases is empty", "phases: [{until_s: 0.5, contacts: [left]}, …]");
      return false;
    }
    for (const char* key : {"contacts", "forces", "switches"}) {
      const YamlNode* other = map.Find(key);
      if (other == nullptr) continue;
      yaml_.Error(*other, fmt::format("{} and phases are not taken together", key),
                  key == std::string("contacts") ? "each phase has contacts of its own" : "");
    }
    ScenarioPhase phase{
        .index = options_.phase->index, .count = items->size(), .start = options_.phase->joints};
    double from_s = 0.0;
    std::vector<std::string> names;
    for (size_t k = 0; k < items->size(); ++k) {
      const std::string path = fmt::format("phases[{}]", k);
      const YamlMap one(&yaml_, (*items)[k], path, {"name", "until_s", "contacts", "commands"});
      if (!one.valid()) continue;
      double to_s = kNan;  // the motion's end
      if (k + 1 < items->size() || one.Has("until_s")) {
        const YamlNode* until = one.Required("until_s");
        to_s = until == nullptr ? kNan
                                : values_.Positive(*until, one.PathOf("until_s")).value_or(kNan);
        if (to_s <= from_s) {
          yaml_.Error(*until, fmt::format("{} = {} violates until_s > {}, where it begins",
                                          one.PathOf("until_s"), to_s, from_s));
        }
      }
      const YamlNode* contacts = one.Required("contacts");
      if (k == phase.index && contacts != nullptr) {
        phase.from_s = from_s;
        phase.to_s = to_s;
        phase_commands_ = one.Find("commands");
        ReadHolding(contacts, one.PathOf("contacts"));
      }
      std::string name = std::to_string(k + 1);
      if (const YamlNode* given = one.Find("name")) {
        name = yaml_.Text(*given, one.PathOf("name")).value_or(name);
      }
      if (Contains(names, name)) {
        yaml_.Error(*(*items)[k], fmt::format("{}: there is a phase '{}' before", path, name));
      }
      names.push_back(name);
      if (k == phase.index) phase.name = name;
      from_s = to_s;
    }
    scenario_.phase = std::move(phase);
    return !yaml_.has_errors();
  }

  [[nodiscard]] PhaseMotion PhaseMotionOf() const {
    if (!scenario_.phase) return {};
    return {.commands = phase_commands_,
            .path = fmt::format("phases[{}].commands", scenario_.phase->index),
            .first = options_.phase->first};
  }

  // Places that the model states for feet moved the pose in which the phase begins: this is found
  // where it is compared with the end of the one before.
  [[nodiscard]] bool IsMoved(const std::map<std::string, std::array<double, 6>>& start) const {
    constexpr double kSame = 1e-6;  // m, rad
    return std::ranges::any_of(mechanism_->joints, [&](const Joint& joint) {
      const auto at = start.find(joint.name);
      for (size_t k = 0; k < joint.home.size() && at != start.end(); ++k) {
        if (std::abs(joint.home[k] - at->second[k]) > kSame) return true;
      }
      return false;
    });
  }

  // The part of the motion in which the phase is, from 0 on.
  void TakePhase(const YamlNode& node) {
    constexpr double kSame = 1e-9;       // of the motion's duration
    constexpr double kSameValue = 1e-6;  // m, rad: what typed digits leave
    ScenarioPhase& phase = *scenario_.phase;
    Motion& motion = scenario_.motion;
    const double end_s = motion.duration_s;
    if (std::isnan(phase.to_s)) phase.to_s = end_s;
    const YamlNode& item = *node.items[phase.index];
    const std::string path = fmt::format("phases[{}]", phase.index);
    if (phase.from_s >= end_s || phase.to_s > end_s * (1.0 + kSame) ||
        (phase.last() && phase.to_s < end_s * (1.0 - kSame))) {
      yaml_.Error(item,
                  fmt::format("{}: from {:g} to {:g} s does not fit motion.duration_s = {:g}", path,
                              phase.from_s, phase.to_s, end_s),
                  "the phases last as long as the motion; until_s of the last one may be left out");
      return;
    }
    for (const double t_s : {phase.from_s, phase.to_s}) {
      const double samples = t_s / motion.sample_s;
      if (std::abs(samples - std::round(samples)) <= 1e-6 * std::max(1.0, samples)) continue;
      yaml_.Error(item,
                  fmt::format("{}: {:g} s violates until_s = n · motion.sample_s = n · {:g}", path,
                              t_s, motion.sample_s),
                  "both phases have a sample at the instant between them");
      return;
    }
    const SimulationSettings& simulation = scenario_.simulation;
    if (scenario_.reference.table != nullptr || !PrescribesMotion(simulation.mode) ||
        simulation.stock_too) {
      yaml_.Error(item,
                  "phases run along the commanded motion, with the reference itself and one "
                  "engine: not with reference.csv, simulation.stock_too, simulation.mode: "
                  "servo or force_driven");
      return;
    }
    if (motion.free()) {
      yaml_.Error(item,
                  "phases: some degrees of freedom move by forces, and feet that land or "
                  "lift by themselves are not computed",
                  "command every degree of freedom, or run a phase alone");
      return;
    }
    phase.end_s = end_s;
    phase.contacts = scenario_.holding.value_or(std::vector<std::string>{});
    motion.duration_s = phase.to_s - phase.from_s;
    phase.in_scenario_time = motion;
    const auto shift = [&](Profile* profile) { profile->from_s = phase.from_s; };
    for (Command& command : motion.commands) shift(&command.profile);
    for (auto& load : motion.loads) {
      for (size_t c = 0; c < 3; ++c) shift(&load.force[c]), shift(&load.moment[c]);
      for (auto& following : load.following) {
        following.function.value = [value = following.function.value, from_s = phase.from_s](
                                       double t_s, std::span<const double> inputs) {
          return value(t_s + from_s, inputs);
        };
      }
    }
    if (phase.index == 0 || IsMoved(phase.start)) return;
    // Where the phase before left everything, the commands must go on.
    for (const Command& command : motion.commands) {
      const double begins = Evaluate(command.profile, 0.0).value;
      double is = 0.0;
      bool length = true;
      for (const Command::Term& term : command.terms) {
        is += term.factor * HomeValue(*mechanism_, term.coordinate);
        length = length && IsLength(*mechanism_, term.coordinate);
      }
      const double jump =
          length ? begins - is : std::remainder(begins - is, 2.0 * std::numbers::pi);
      if (std::abs(is) < 1e-12) is = 0.0;
      if (std::abs(jump) <= kSameValue) continue;
      yaml_.Error(item,
                  fmt::format("{}: {} is commanded to {:.9g} {} at {:g} s, where the phase "
                              "before leaves it at {:.9g}",
                              path, command.name, begins, length ? "m" : "rad", phase.from_s, is),
                  "commands must go on where the phase before ends");
    }
  }

  void CheckHolding(const YamlNode* node) {
    if (node == nullptr || !scenario_.holding) return;
    std::vector<std::string> names;
    for (const Contact& contact : mechanism_->contacts) names.push_back(contact.name);
    for (const YamlNodePtr& item : node->items) {
      if (!item->is_scalar() || Contains(names, item->text)) continue;
      yaml_.Error(*item,
                  fmt::format("contacts: {} has no contact '{}'", mechanism_->name, item->text),
                  names.empty() ? "the model describes its feet under contacts"
                                : DidYouMean(item->text, names));
    }
  }

  // Of another kind, nothing else in the file is of use here.
  bool IsMotion(const YamlNode& kind) {
    if (yaml_.Choice(kind, "kind", {"motion", "stiffness"}) != 1) return true;
    yaml_.Error(kind, "kind = stiffness: this scenario has a pose and no motion",
                "mbverify run, regress, check and list take it; render and mutate need a motion");
    return false;
  }

  // A table in the reference's place, and the times it gives a motion that states none.
  MotionTimes ReadTable(const YamlNode* node) {
    if (node == nullptr || !node->is_map() || node->Find("csv") == nullptr) return {};
    const TableSettings settings = ReadTableSettings(&values_, node);
    if (settings.file.empty()) return {};
    scenario_.reference.table = LoadTable(settings, *mechanism_, &yaml_, &table_findings_);
    if (scenario_.reference.table == nullptr) return {1.0, {}};  // its end is not known
    const ReferenceTable& table = *scenario_.reference.table;
    return {table.time_s.back(), SuggestSample(table)};
  }

  // A table whose spline alternates from row to row needs steps that resolve it: the next of 1 ms
  // halved where the scenario states none, else a warning.
  void ResolveTables(const YamlNode& motion, const YamlNode* simulation) {
    SimulationSettings& settings = scenario_.simulation;
    if (!settings.on || !settings.forward() || settings.stock_engine || yaml_.has_errors()) return;
    const YamlNode* stated = simulation == nullptr ? nullptr : simulation->Find("step_s");
    for (const MotionTable& table : scenario_.motion.tables) {
      const double duration_s = scenario_.motion.duration_s;
      double step_s = settings.step_s, missed = MissedBySteps(table, duration_s, step_s);
      const double at_first = missed;
      while (missed > kMissedBySteps && duration_s / step_s < kMostTableSteps) {
        step_s *= 0.5;
        missed = MissedBySteps(table, duration_s, step_s);
      }
      if (stated == nullptr) settings.step_s = step_s;
      const bool resolved =
          stated == nullptr ? missed <= kMissedBySteps : step_s == settings.step_s;
      if (resolved) continue;
      const double rows_s = (table.to_s - table.from_s) / static_cast<double>(table.rows - 1);
      yaml_.Warn(
          stated != nullptr ? *stated : motion,
          fmt::format("simulation.step_s = {:g} s does not resolve {}, whose rows are {:.3g} s "
                      "apart: the simulation misses about {:.1g} of the accelerations of {}",
                      settings.step_s, table.file, rows_s, stated == nullptr ? missed : at_first,
                      table.name),
          fmt::format(
              "{}smoothing: auto takes out what noise alternates from row to row",
              stated == nullptr ? "" : fmt::format("leave it out, or state {:g}; ", step_s)));
    }
  }

  // Samples must fall on whole steps: the next smaller step that divides them. Reported where the
  // scenario states another one.
  void FitStep(const YamlNode* simulation) {
    const bool stated = simulation != nullptr && simulation->Find("step_s") != nullptr;
    const double sample_s = scenario_.motion.sample_s;
    double& step_s = scenario_.simulation.step_s;
    const double steps = sample_s / step_s;
    if (!(steps <= kMaxSteps) || std::abs(steps - std::round(steps)) <= 1e-6 * steps) return;
    if (stated && steps < 1.0) return;  // reported later
    const double fitting_s = sample_s / std::ceil(steps - 1e-9);
    if (stated && scenario_.simulation.on && scenario_.simulation.forward()) {
      yaml_.Warn(*simulation->Find("step_s"),
                 fmt::format("simulation.step_s = {} does not divide motion.sample_s = {}: the "
                             "step is {:.6g} s",
                             step_s, sample_s, fitting_s),
                 "samples must fall on whole steps");
    }
    step_s = fitting_s;
  }

  void LoadMechanism(const YamlNode& node) {
    const auto name = yaml_.Text(node, "mechanism");
    if (!name) return;
    const fs::path folder = fs::path(file_).parent_path();
    const auto model_file =
        memory_ != nullptr ? memory_->Find(*name, folder) : FindModel(*name, folder);
    if (!model_file) {
      yaml_.Error(node, fmt::format("mechanism = '{}': there is no such model", *name),
                  ModelHint(*name, folder));
      return;
    }
    scenario_.model_file = *model_file;
    LoadModelWith(ModelOptions(scenario_));
    if (mechanism_) NameTheCase();
  }

  // Parameters given in degrees or millimetres: what follows knows SI only.
  void UsePlainNames() {
    UseSiOverrides();
    for (const auto& [name, place] : std::map(scenario_.parameter_places)) {
      scenario_.parameter_places[PlainName(name, *mechanism_).name] = place;
    }
  }

  void CheckParameterNames(const YamlMap& map) {
    CheckWitnessParameters(map);
    if (!scenario_.simulation.extrapolate) return;
    const YamlNode* node = map.Find("simulation")->Find("extrapolate")->Find("parameter");
    if (node != nullptr) {
      CheckParameterName({node->text, node->line, node->column, nullptr},
                         "simulation.extrapolate.parameter", *mechanism_, &yaml_);
    }
  }

  // Rules that need several sections.
  void CheckTogether(const YamlNode& motion, const YamlNode* simulation) {
    CheckCommands(motion);
    CheckSize(motion);
    const SimulationSettings& settings = scenario_.simulation;
    const double steps = scenario_.motion.sample_s / settings.step_s;
    if (settings.on && settings.forward() &&
        !(scenario_.motion.duration_s / settings.step_s <= kMaxSteps)) {
      yaml_.Error(simulation != nullptr ? *simulation : motion,
                  fmt::format("simulation.step_s = {} violates motion.duration_s / step_s <= {:g}",
                              settings.step_s, kMaxSteps));
    } else if (settings.on && settings.forward() &&
               std::abs(steps - std::round(steps)) > 1e-6 * steps) {
      yaml_.Error(simulation != nullptr ? *simulation : motion,
                  fmt::format("simulation.step_s = {} violates motion.sample_s = {} = n · step_s",
                              settings.step_s, scenario_.motion.sample_s),
                  "samples must fall on whole steps");
    }
    if (scenario_.checks[Metric::kMotorUse].reference && mechanism_->motors.empty()) {
      yaml_.Error(motion, fmt::format("checks.motor_margin: {} has no motors", mechanism_->name),
                  "state them in the model: motors: {DRIVE: {continuous: …, peak: …}}");
    }
    if (!scenario_.analytic.on && !scenario_.reference.on && !settings.on) {
      yaml_.Error(motion, "analytic, reference and simulation are all off");
    }
  }

  // What the witnesses record must fit into memory.
  void CheckSize(const YamlNode& motion) {
    const double samples = scenario_.motion.duration_s / scenario_.motion.sample_s;
    const auto signals = static_cast<double>(MostChannels(*mechanism_, scenario_.motion));
    if (samples * signals <= kMostValues) return;
    yaml_.Error(motion,
                fmt::format("{:g} samples of {:g} signals each violate samples · signals <= {:g}",
                            std::floor(samples), signals, kMostValues),
                fmt::format("at most {:g} samples for {}: choose motion.sample_s >= {:.3g}",
                            std::floor(kMostValues / signals), mechanism_->name,
                            scenario_.motion.duration_s * signals / kMostValues));
  }

  // Drives that are force-controlled or servos need forces or commands for all DOFs, and the engine
  // whose constraints hold moving loops.
  void CheckDriveMode(const YamlNode& motion, const YamlNode* simulation) {
    const SimulationSettings& settings = scenario_.simulation;
    if (!settings.on || PrescribesMotion(settings.mode)) return;
    const bool servo = settings.mode == DriveMode::kServo;
    const std::string mode = servo ? "simulation.mode = servo" : "simulation.mode = force_driven";
    if (scenario_.motion.free()) {
      yaml_.Error(*simulation, mode + ": every degree of freedom needs a command",
                  "forces that the scenario gives itself work with mode: forward");
    }
    if (settings.stock_engine) yaml_.Error(*simulation, mode + " runs with engine: corrected only");
    if (settings.extrapolate) yaml_.Error(*simulation, mode + " does not extrapolate");
    if (scenario_.reference.table != nullptr) {
      yaml_.Error(*simulation, mode + ": a table of forces belongs to the commanded motion",
                  "compare the table with mode: forward");
    }
    if (!servo) return;
    CheckGain(*simulation->Find("kp"), "simulation.kp", settings.servo.kp, *mechanism_, &yaml_);
    CheckGain(*simulation->Find("kv"), "simulation.kv", settings.servo.kv, *mechanism_, &yaml_);
    const CommandRank rank = Rank();
    const auto drives = mechanism_->drives.size(), bases = mechanism_->prescribed.size();
    if (!scenario_.motion.free() && static_cast<int>(drives + bases) != rank.dofs) {
      yaml_.Error(
          motion,
          fmt::format("{}: {} drives and {} prescribed joints for {} degrees of freedom; a servo "
                      "needs its own",
                      mode, drives, bases, rank.dofs));
    }
  }

  // Every DOF needs one command, or a start value where it moves by forces.
  void CheckCommands(const YamlNode& motion) {
    if (scenario_.motion.free()) {
      const SimulationSettings& settings = scenario_.simulation;
      if (settings.on && !settings.forward()) {
        yaml_.Error(motion, "simulation.mode = inverse, but some degrees of freedom move by forces",
                    "inverse dynamics needs every motion: use mode: forward");
      }
      return;
    }
    const CommandRank rank = Rank();
    const auto commands = static_cast<int>(scenario_.motion.commands.size());
    int dofs = rank.dofs;
    if (commands != dofs) dofs = ReportMobility(*mechanism_).dofs();
    if (commands != dofs) {
      yaml_.Error(motion,
                  fmt::format("motion gives {} commands, but {} has {} degrees of freedom",
                              commands, mechanism_->name, dofs),
                  CountHint(rank, commands < dofs));
    } else if (rank.redundant > 0 && dofs == rank.dofs) {
      yaml_.Error(motion,
                  fmt::format("motion commands coordinates that depend on each other: {}",
                              JoinWords(DependentNames(rank))),
                  fmt::format("leave out {} of them; not held yet: {}", rank.redundant,
                              JoinWords(rank.free_joints)) +
                      ChoiceHint());
    }
  }

  [[nodiscard]] CommandRank Rank() const {
    return memory_ != nullptr ? memory_->Rank(*mechanism_, scenario_.motion.commands)
                              : RankCommands(*mechanism_, scenario_.motion.commands);
  }

  [[nodiscard]] std::vector<std::string> DependentNames(const CommandRank& rank) const {
    std::vector<std::string> names;
    for (const int k : rank.dependent) {
      names.push_back(scenario_.motion.commands[static_cast<size_t>(k)].name);
    }
    return names;
  }

  // Why what spins between two balls needs a command.
  [[nodiscard]] std::string SpinHint() const {
    std::string hint;
    for (const Spin& spin : FindSpins(*mechanism_)) {
      if (spin.why_not.empty()) continue;
      hint += fmt::format(
          "; the spin of {} about the line through its spherical joints is not idle: {}", spin.name,
          spin.why_not);
    }
    return hint;
  }

  // Why the base of a robot floats.
  [[nodiscard]] std::string FeetHint() const {
    const std::vector<Contact>& contacts = mechanism_->contacts;
    const bool lifted =
        std::ranges::all_of(contacts, [](const Contact& contact) { return contact.joint < 0; });
    return contacts.empty() || !lifted ? "" : "; contacts: all feet are lifted, so the base floats";
  }

  // What would make the commands an independent set; "" where sums of coordinates are commanded.
  [[nodiscard]] std::string ChoiceHint() const {
    std::vector<Coordinate> candidates;
    for (const Command& command : scenario_.motion.commands) {
      if (command.terms.size() != 1) return "";
      candidates.push_back(command.terms.front().coordinate);
    }
    const size_t given = candidates.size();
    for (const NamedCoordinate& named : NamedMotionCoordinates(*mechanism_)) {
      if (std::ranges::find(candidates, named.coordinate) == candidates.end()) {
        candidates.push_back(named.coordinate);
      }
    }
    std::vector<std::string> names;
    for (const size_t k : ChooseCoordinates(*mechanism_, candidates, candidates.size()).chosen) {
      if (k >= given) names.push_back(NameOf(*mechanism_, candidates[k]));
    }
    return names.empty() ? "" : "; for instance command also " + JoinWords(names);
  }

  [[nodiscard]] std::string CountHint(const CommandRank& rank, bool too_few) const {
    if (too_few) {
      return fmt::format(
                 "command drives, joints, outputs (OUTPUT.x …), prescribed joints, or couple "
                 "drives under motion.equal; what moves by forces needs motion.initial; not held "
                 "yet: {}",
                 JoinWords(rank.free_joints)) +
             ChoiceHint() + SpinHint() + FeetHint();
    }
    std::string hint = "leave commands out: each further one contradicts the others";
    if (!rank.dependent.empty()) hint += "; " + JoinWords(DependentNames(rank)) + " are dependent";
    if (static_cast<int>(mechanism_->drives.size()) > rank.dofs) {
      hint += "; drives that are not commanded share the force by least norm";
    }
    return hint;
  }

  const YamlNode* phase_commands_ = nullptr;  // of the phase that is loaded
};

// The value of a first line "# expect: {…}", or nothing.
std::optional<std::string> FirstLineExpectation(const std::string& text) {
  constexpr std::string_view kStart = "# expect:";
  if (!text.starts_with(kStart)) return {};
  return text.substr(kStart.size(), text.find('\n') - kStart.size());
}

}  // namespace

LoadOptions ModelOptions(const Scenario& scenario, const Overrides& more) {
  LoadOptions options;
  options.overrides = Merge(scenario.parameters, more);
  options.override_places = scenario.parameter_places;
  options.gravity_W = scenario.gravity_W;
  options.holding = scenario.holding;
  if (scenario.phase) options.guesses = scenario.phase->start;
  return options;
}

ScenarioResult LoadScenario(const std::string& file, const ScenarioOptions& options) {
  return ScenarioLoader(file, options).LoadFile();
}

ScenarioResult LoadScenario(const std::string& file, const ScenarioOptions& options,
                            ScenarioMemory* memory) {
  return ScenarioLoader(file, options, memory).LoadFile();
}

ScenarioResult LoadScenarioText(const std::string& text, const std::string& file,
                                const ScenarioOptions& options) {
  return ScenarioLoader(file, options).Load(text);
}

bool ScenarioHead::HasKey(const std::string& key) const { return Contains(keys, key); }

ScenarioHead ReadScenarioHead(const std::string& file) {
  ScenarioHead head;
  YamlReader yaml(file);
  Scope scope;
  ValueReader values(&yaml, &scope);
  const auto text = yaml.ReadFile();
  if (!text) return head;
  if (const auto line = FirstLineExpectation(*text)) {
    const YamlNodePtr expect = YamlReader(file).Parse(*line);
    if (expect != nullptr) head.expect = ReadExpectation(&values, expect.get());
    head.is_scenario = true;
  }
  const YamlNodePtr root = yaml.Parse(*text);
  if (root == nullptr || !root->is_map()) return head;
  const auto word = [&](const char* key) {
    const YamlNode* node = root->Find(key);
    return node != nullptr && node->is_scalar() ? node->text : std::string();
  };
  head.kind = word("kind");
  head.mechanism = word("mechanism");
  head.description = word("description");
  head.is_scenario = head.is_scenario || root->Find("mechanism") != nullptr;
  const YamlNode* witnesses = root->Find("witnesses");
  const YamlNode* analytic = root->Find("analytic");
  head.names_programs = (witnesses != nullptr && witnesses->is_map()) ||
                        (analytic != nullptr && analytic->Find("equations") != nullptr);
  for (const YamlEntry& entry : root->entries) head.keys.push_back(entry.key);
  if (const YamlNode* expect = root->Find("expect")) head.expect = ReadExpectation(&values, expect);
  return head;
}

namespace {

// A copy whose every node carries `line`.
std::shared_ptr<YamlNode> Relocate(const YamlNode& node, int line) {
  auto copy = std::make_shared<YamlNode>(node);
  copy->line = line;
  copy->column = 0;
  for (YamlNodePtr& item : copy->items) item = Relocate(*item, line);
  for (YamlEntry& entry : copy->entries) {
    entry.line = line;
    entry.column = 0;
    entry.value = Relocate(*entry.value, line);
  }
  return copy;
}

// Length of the first key of `path` in `map`: the longest key that is there, else up to the first
// dot; names of commands ("platform.z") and of parts' parameters ("leg1.m") contain dots
// themselves.
size_t FirstKey(const YamlNode& map, const std::string& path, const std::string& parent) {
  size_t best = 0;
  for (const YamlEntry& entry : map.entries) {
    const size_t n = entry.key.size();
    if (n > best && path.starts_with(entry.key) && (path.size() == n || path[n] == '.')) best = n;
  }
  if (best > 0) return best;
  const bool dotted = parent == "commands" || parent == "pose" || parent == "parameters";
  return dotted ? path.size() : std::min(path.find('.'), path.size());
}

// The item of a list that a path begins with ("1.sine.amplitude"), and the path behind its number.
struct ListStep {
  size_t index = 0;
  std::string rest;
};
std::optional<ListStep> FirstItem(const YamlNode* list, const std::string& path) {
  if (list == nullptr || !list->is_sequence()) return {};
  ListStep step;
  const char* end = path.data() + path.size();
  const auto [at, error] = std::from_chars(path.data(), end, step.index);
  if (error != std::errc() || step.index >= list->items.size()) return {};
  if (at != end && *at != '.') return {};
  step.rest.assign(at == end ? at : at + 1, end);
  return step;
}

// A parameter of the model that was meant as such.
void HintAtParameters(const SetValue& value, Finding* finding) {
  if (finding->code != FindingCode::kUnknownKey || finding->subject != value.first) return;
  if (value.first.find('.') != std::string::npos) return;
  finding->hint = "a parameter of the model: --set parameters." + value.first + "=" + value.second +
                  "; " + finding->hint;
}

YamlNodePtr SetAt(const YamlNode* node, const std::string& parent, const std::string& path,
                  const YamlNodePtr& value) {
  if (path.empty()) return value;
  if (const auto step = FirstItem(node, path)) {
    auto list = std::make_shared<YamlNode>(*node);
    YamlNodePtr& item = list->items[step->index];
    item = SetAt(item.get(), "", step->rest, value);
    return list;
  }
  auto map = std::make_shared<YamlNode>();
  map->line = value->line;
  if (node != nullptr && node->is_map()) *map = *node;
  map->kind = YamlNode::Kind::kMap;
  const size_t length = FirstKey(*map, path, parent);
  const std::string key = path.substr(0, length);
  const std::string rest = length < path.size() ? path.substr(length + 1) : "";
  for (YamlEntry& entry : map->entries) {
    if (entry.key != key) continue;
    entry.value = SetAt(entry.value.get(), key, rest, value);
    return map;
  }
  map->entries.push_back({key, value->line, 0, SetAt(nullptr, key, rest, value)});
  return map;
}

}  // namespace

Finding AtOption(const SetValue& value) {
  return {.file = "--set " + value.first + "=" + value.second, .set = value};
}

namespace {

// What the k-th option sets; null after a finding.
std::shared_ptr<YamlNode> ValueNode(const SetValue& value, size_t k, YamlReader* reader) {
  const int line = -static_cast<int>(k) - 1;
  const auto& [key, text] = value;
  YamlNodePtr node;
  if (PlainNumber(text)) {
    auto number = std::make_shared<YamlNode>();
    number->kind = YamlNode::Kind::kScalar;
    number->text = text;
    node = number;
  } else {
    node = YamlReader(AtOption(value).file).Parse(text);
  }
  if (node != nullptr && !key.empty()) return Relocate(*node, line);
  reader->AddAt(Severity::kError, line, 0, "the value is not YAML",
                "write --set key=value, e.g. --set simulation.step_s=0.002");
  return nullptr;
}

// SetValues(); `nodes` gets the node of each value, null after a finding.
YamlNodePtr SetNodes(YamlNodePtr root, const std::vector<SetValue>& values, YamlReader* reader,
                     std::vector<std::shared_ptr<YamlNode>>* nodes) {
  for (size_t k = 0; k < values.size(); ++k) {
    nodes->push_back(ValueNode(values[k], k, reader));
    if (nodes->back() != nullptr) root = SetAt(root.get(), "", values[k].first, nodes->back());
  }
  return root;
}

}  // namespace

YamlNodePtr SetValues(YamlNodePtr root, const std::vector<SetValue>& values, YamlReader* reader) {
  std::vector<std::shared_ptr<YamlNode>> nodes;
  return SetNodes(std::move(root), values, reader, &nodes);
}

YamlNodePtr ScenarioMemory::Document(YamlReader* reader) {
  if (document_ != nullptr) return document_;
  const auto text = reader->ReadFile();
  const YamlNodePtr document = text ? reader->Parse(*text) : nullptr;
  if (reader->diagnostics().findings().empty()) document_ = document;
  return document;
}

YamlNodePtr ScenarioMemory::Set(const YamlNodePtr& root, const std::vector<SetValue>& values,
                                YamlReader* reader) {
  // Where a node goes depends on keys alone.
  const auto fits = [](const SetValue& before, const SetValue& now) {
    return before.first == now.first &&
           (before.second == now.second || (PlainNumber(before.second) && PlainNumber(now.second)));
  };
  if (root == document_ && root_ != nullptr && std::ranges::equal(set_, values, fits)) {
    for (size_t k = 0; k < values.size(); ++k) {
      if (PlainNumber(values[k].second)) nodes_[k]->text = values[k].second;
    }
    set_ = values;
    return root_;
  }
  nodes_.clear();
  set_ = values;
  YamlNodePtr with = SetNodes(root, values, reader, &nodes_);
  root_ = reader->diagnostics().findings().empty() ? with : nullptr;
  return with;
}

namespace {

// The unit of a key that is `word` with its unit behind; null where it is another key.
const UnitSuffix* UnitOfKey(const std::string& key, std::string_view word) {
  static constexpr UnitSuffix kUnits[] = {kPlain, kDeg, kMm};
  if (!key.starts_with(word)) return nullptr;
  const auto unit =
      std::ranges::find(kUnits, std::string_view(key).substr(word.size()), &UnitSuffix::suffix);
  return unit == std::end(kUnits) ? nullptr : unit;
}

// The number of a term that `path` names within its node.
std::optional<MotionNumber> NumberOfTerm(const YamlNode& node, const std::string& path,
                                         const ProfileTerm& term) {
  using Field = MotionNumber::Field;
  const bool constant = std::holds_alternative<ConstantTerm>(term);
  if (path.empty()) {
    if (!constant || !node.is_scalar()) return {};
    return MotionNumber{.field = Field::kConstant, .to_si = kPlain.to_si};
  }
  if (!node.is_map() || node.entries.size() != 1) return {};
  if (const UnitSuffix* unit = UnitOfKey(path, "value"); unit != nullptr && constant) {
    return MotionNumber{.field = Field::kConstant, .to_si = unit->to_si};
  }
  constexpr std::string_view kSine = "sine.";
  if (!path.starts_with(kSine) || !std::holds_alternative<SineTerm>(term)) return {};
  const std::string key = path.substr(kSine.size());
  for (const auto& [word, field] :
       {std::pair{"amplitude", Field::kAmplitude}, std::pair{"phase", Field::kPhase},
        std::pair{"frequency_hz", Field::kFrequency}, std::pair{"period_s", Field::kPeriod}}) {
    const UnitSuffix* unit = UnitOfKey(key, word);
    if (unit != nullptr) return MotionNumber{.field = field, .to_si = unit->to_si};
  }
  return {};
}

template <typename AnyMotion>
auto& ProfileAt(AnyMotion* motion, const MotionNumber& number) {
  if (number.section == MotionNumber::Section::kCommands) {
    return motion->commands[number.item].profile;
  }
  auto& load = motion->loads[number.item];
  return number.component < 3 ? load.force[number.component] : load.moment[number.component - 3];
}

// The number that `path` names below the commands or loads of a file.
std::optional<MotionNumber> NumberIn(const YamlNode& all, MotionNumber::Section section,
                                     const std::string& path, const Motion& motion) {
  const bool of_command = section == MotionNumber::Section::kCommands;
  const size_t length = FirstKey(all, path, of_command ? "commands" : "loads");
  const auto entry = std::ranges::find(all.entries, path.substr(0, length), &YamlEntry::key);
  if (entry == all.entries.end()) return {};
  MotionNumber place{.section = section, .item = static_cast<size_t>(entry - all.entries.begin())};
  if (place.item >= (of_command ? motion.commands.size() : motion.loads.size())) return {};
  const YamlNode* node = entry->value.get();
  ListStep step{0, length < path.size() ? path.substr(length + 1) : ""};
  if (!of_command) {
    if (!node->is_map()) return {};
    const std::string vector = step.rest.substr(0, step.rest.find('.'));
    if (vector != "force" && vector != "moment") return {};
    const YamlNode* components = node->Find(vector);
    if (components == nullptr || vector.size() == step.rest.size()) return {};
    const auto component = FirstItem(components, step.rest.substr(vector.size() + 1));
    if (!component) return {};
    place.component = component->index + (vector == "force" ? 0 : 3);
    node = components->items[component->index].get();
    step.rest = component->rest;
  }
  // One term for each item of a list; none where a component follows the mechanism's state.
  const std::vector<ProfileTerm>& terms = ProfileAt(&motion, place).terms;
  if (terms.size() != (node->is_sequence() ? node->items.size() : 1)) return {};
  if (node->is_sequence()) {
    const auto first = FirstItem(node, step.rest);
    if (!first) return {};
    step = *first;
    node = node->items[step.index].get();
  }
  auto number = NumberOfTerm(*node, step.rest, terms[step.index]);
  if (!number) return {};
  place.term = step.index, place.field = number->field, place.to_si = number->to_si;
  return place;
}

}  // namespace

bool MotionNumber::Put(double value, Motion* motion) const {
  if (!std::isfinite(value)) return false;
  const bool positive = field == Field::kFrequency || field == Field::kPeriod;
  if (positive && value <= 0.0) return false;
  ProfileTerm& at = ProfileAt(motion, *this).terms[term];
  const double si = to_si(value);
  switch (field) {
    case Field::kConstant:
      std::get<ConstantTerm>(at).value = si;
      break;
    case Field::kAmplitude:
      std::get<SineTerm>(at).amplitude = si;
      break;
    case Field::kPhase:
      std::get<SineTerm>(at).phase_rad = si;
      break;
    case Field::kFrequency:
      std::get<SineTerm>(at).frequency_hz = si;
      break;
    case Field::kPeriod:
      std::get<SineTerm>(at).frequency_hz = 1.0 / si;
      break;
  }
  return true;
}

// Commands come first in a motion, loads fill theirs; both in the order of the file.
std::optional<MotionNumber> ScenarioMemory::FindMotionNumber(const std::string& key,
                                                             const Motion& motion) const {
  using Section = MotionNumber::Section;
  if (root_ == nullptr) return {};
  for (const auto& [section, path] :
       {std::pair{Section::kCommands, "motion.commands"}, std::pair{Section::kLoads, "loads"}}) {
    const YamlNode* node = FindSetNode(*root_, path);
    if (node == nullptr || !node->is_map() || !key.starts_with(path + std::string("."))) continue;
    return NumberIn(*node, section, key.substr(std::string_view(path).size() + 1), motion);
  }
  return {};
}

std::optional<std::string> ScenarioMemory::Find(const std::string& model, const fs::path& folder) {
  const auto known = models_.find(model);
  if (known != models_.end()) return known->second;
  return models_[model] = FindModel(model, folder);
}

LoadResult ScenarioMemory::Load(const std::string& model_file, const LoadOptions& options) {
  const auto same_override = [](const auto& a, const auto& b) {  // zeros with their signs
    return a.first == b.first &&
           std::bit_cast<std::uint64_t>(a.second) == std::bit_cast<std::uint64_t>(b.second);
  };
  const bool same = model_.mechanism && model_file_ == model_file &&
                    std::ranges::equal(options_.overrides, options.overrides, same_override) &&
                    options_.gravity_W == options.gravity_W &&
                    options_.holding == options.holding && options_.guesses == options.guesses;
  if (same) return model_;
  const auto known = texts_.find(model_file);
  const auto& text = known != texts_.end() ? known->second
                                           : texts_[model_file] = YamlReader(model_file).ReadFile();
  LoadResult model =
      text ? LoadModelText(*text, model_file, options) : LoadModel(model_file, options);
  const bool ranks_stay = rank_ && model.mechanism && model_.mechanism &&
                          model_file_ == model_file &&
                          HaveSameGeometry(*model.mechanism, *model_.mechanism) &&
                          HaveSameSpins(*model.mechanism, *model_.mechanism);
  if (!ranks_stay) rank_.reset();
  model_file_ = model_file;
  options_ = options;
  model_ = std::move(model);
  return model_;
}

const CommandRank& ScenarioMemory::Rank(const Mechanism& mechanism,
                                        const std::vector<Command>& commands) {
  const auto same_term = [](const Command::Term& a, const Command::Term& b) {
    return a.coordinate.kind == b.coordinate.kind && a.coordinate.index == b.coordinate.index &&
           a.coordinate.component == b.coordinate.component && a.factor == b.factor;
  };
  const auto same = [&](const Command& a, const Command& b) {
    return std::ranges::equal(a.terms, b.terms, same_term);
  };
  if (!rank_ || !std::ranges::equal(commands_, commands, same)) {
    rank_ = RankCommands(mechanism, commands);
    commands_ = commands;
  }
  return *rank_;
}

const YamlNode* FindSetNode(const YamlNode& root, const std::string& key) {
  const YamlNode* node = &root;
  std::string parent, path = key;
  while (node != nullptr && !path.empty()) {
    if (const auto step = FirstItem(node, path)) {
      node = node->items[step->index].get();
      parent.clear();
      path = step->rest;
      continue;
    }
    if (!node->is_map()) break;
    const size_t length = FirstKey(*node, path, parent);
    parent = path.substr(0, length);
    path = length < path.size() ? path.substr(length + 1) : "";
    node = node->Find(parent);
  }
  return path.empty() ? node : nullptr;
}

Diagnostics ReadParameterOptions(const std::vector<SetValue>& values, LoadOptions* options) {
  Diagnostics diagnostics;
  for (const SetValue& value : values) {
    const Finding place = AtOption(value);
    YamlReader yaml(place.file);
    Scope scope;
    ValueReader reader(&yaml, &scope);
    const YamlNodePtr node = yaml.Parse(value.second);
    const auto number = node == nullptr ? std::nullopt : reader.Number(*node, value.first);
    if (number) options->overrides[value.first] = *number;
    options->override_places[value.first] = place;
    for (Finding finding : yaml.diagnostics().findings()) {
      finding.line = 0;  // there is only one
      finding.set = value;
      if (finding.hint.empty()) finding.hint = "write --set PARAMETER=NUMBER, e.g. --set m_p=45000";
      diagnostics.Add(std::move(finding));
    }
  }
  return diagnostics;
}

Diagnostics PlaceSetFindings(const Diagnostics& diagnostics, const std::vector<SetValue>& values) {
  std::vector<Finding> findings;
  for (Finding finding : diagnostics.findings()) {
    if (finding.line < 0) {
      const SetValue& value = values[static_cast<size_t>(-finding.line - 1)];
      HintAtParameters(value, &finding);
      finding.file = AtOption(value).file;
      finding.set = value;
      finding.line = 0;
    }
    findings.push_back(std::move(finding));
  }
  std::stable_sort(findings.begin(), findings.end(), [](const Finding& a, const Finding& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  Diagnostics placed;
  for (Finding& finding : findings) placed.Add(std::move(finding));
  return placed;
}

namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kLimitWords = {"exact", "stepped"};

bool IsPlainName(const std::string& name) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !name.empty() && std::all_of(name.begin(), name.end(), plain);
}

class WitnessReader {
 public:
  WitnessReader(ValueReader* values, std::string folder)
      : values_(values), yaml_(values->yaml()), folder_(std::move(folder)) {}

  std::optional<ForeignWitness> Read(const YamlEntry& entry) {
    const std::string path = JoinPath("witnesses", entry.key);
    if (!CheckName(entry, path)) return {};
    const YamlMap map(
        &yaml_, entry.value.get(), path,
        {"command", "limits", "force_nrmse", "required", "timeout_s", "memory_mb", "output_mb"});
    const YamlNode* command = map.valid() ? map.Required("command") : nullptr;
    if (command == nullptr) return {};
    ForeignWitness witness;
    witness.name = entry.key;
    const auto words = yaml_.Items(*command, map.PathOf("command"));
    if (!words) return {};
    if (words->empty()) yaml_.Error(*command, map.PathOf("command") + " is empty");
    for (const YamlNode* word : *words) {
      const auto text = yaml_.Text(*word, map.PathOf("command"));
      if (!text) return {};
      witness.command.push_back(Found(*text));
    }
    witness.typed = std::ranges::all_of(*words, [](const auto* word) { return word->line < 0; });
    witness.line = std::max(0, command->line);
    ReadLimits(map, &witness);
    return witness;
  }

 private:
  bool CheckName(const YamlEntry& entry, const std::string& path) {
    if (FindRole(entry.key) != nullptr) {
      yaml_.Error(entry, path + ": this is the name of one of our own witnesses");
      return false;
    }
    if (IsPlainName(entry.key)) return true;
    yaml_.Error(entry, path + ": letters, digits and _ make a witness' name");
    return false;
  }

  // A file beside the scenario, else the word itself: a program in the path, or an option.
  [[nodiscard]] std::string Found(const std::string& word) const {
    const fs::path beside = fs::path(folder_) / word;
    std::error_code error;
    if (word.empty() || !fs::is_regular_file(beside, error)) return word;
    NoteInput(beside.string(), ReadWholeFile(beside).value_or(""));
    return fs::absolute(beside, error).lexically_normal().string();
  }

  void ReadLimits(const YamlMap& map, ForeignWitness* witness) {
    if (const YamlNode* node = map.Find("limits")) {
      const auto choice = yaml_.Choice(*node, map.PathOf("limits"), kLimitWords);
      if (choice == 1) witness->limits = LimitColumn::kForward;
    }
    if (const YamlNode* node = map.Find("force_nrmse")) {
      witness->force_nrmse = values_->Positive(*node, map.PathOf("force_nrmse"));
    }
    if (const YamlNode* node = map.Find("required")) {
      witness->required = yaml_.Flag(*node, map.PathOf("required")).value_or(false);
    }
    const std::pair<const char*, double*> amounts[] = {{"timeout_s", &witness->timeout_s},
                                                       {"memory_mb", &witness->memory_mb},
                                                       {"output_mb", &witness->output_mb}};
    for (const auto& [key, amount] : amounts) {
      const YamlNode* node = map.Find(key);
      if (node != nullptr) *amount = values_->Positive(*node, map.PathOf(key)).value_or(*amount);
    }
  }

  ValueReader* values_;
  YamlReader& yaml_;
  std::string folder_;
};

}  // namespace

Overrides Merge(const Overrides& base, const Overrides& over) {
  Overrides merged = over;
  merged.insert(base.begin(), base.end());
  return merged;
}

std::vector<ForeignWitness> ReadWitnesses(ValueReader* values, const YamlNode* node,
                                          const std::string& folder) {
  std::vector<ForeignWitness> witnesses;
  if (node == nullptr || node->is_null()) return witnesses;
  WitnessReader reader(values, folder);
  for (const YamlEntry& entry : values->yaml().Entries(*node, "witnesses")) {
    if (auto witness = reader.Read(entry)) witnesses.push_back(std::move(*witness));
  }
  return witnesses;
}

}  // namespace mbv
