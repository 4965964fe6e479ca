#include "scenario/section_readers.h"

#include <fmt/format.h>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>
#include <vector>

#include "base/text.h"
#include "kinematics/command_rank.h"
#include "kinematics/mobility.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "model_file/yaml/value_reader.h"
#include "scenario/tables/motion_table.h"

namespace mbv {
namespace {

// Forward dynamics in scenario files: `forces:`, `motion.initial` and `motion.initial_rates`.

constexpr size_t kMostNames = 12;  // in one message

// What a state is made of: drives, OUTPUT.x … OUTPUT.yaw, and joints, prescribed ones among them.
std::vector<NamedCoordinate> StateCoordinates(const Mechanism& mechanism) {
  std::vector<NamedCoordinate> named = NamedCommandCoordinates(mechanism);
  std::erase_if(named, [](const NamedCoordinate& one) {
    return one.coordinate.kind == Coordinate::Kind::kPrescribed;
  });
  std::ranges::move(NamedJointCoordinates(mechanism), std::back_inserter(named));
  return named;
}

Command AsCommand(const std::string& name, const Coordinate& coordinate) {
  return {.name = name, .terms = {{coordinate, 1.0}}};
}

class FreeMotionReader {
 public:
  FreeMotionReader(ValueReader* values, const Mechanism& mechanism, StateFunctions* functions,
                   ProfileTables* tables, Motion* motion)
      : values_(values),
        mechanism_(mechanism),
        functions_(*functions),
        tables_(tables),
        motion_(motion) {
    known_ = StateCoordinates(mechanism);
  }

  void Read(const YamlNode& node, const YamlNode* forces) {
    CheckCommands(node);
    if (forces != nullptr) ReadForces(*forces);
    ReadInitial(node.Find("initial"), "motion.initial", false);
    ReadInitial(node.Find("initial_rates"), "motion.initial_rates", true);
    if (yaml().has_errors()) return;
    CheckDrives(forces != nullptr ? *forces : node);
    if (!yaml().has_errors()) Complete(node);
  }

 private:
  YamlReader& yaml() { return values_->yaml(); }

  // Commanded coordinates must be drives or prescribed joints themselves.
  void CheckCommands(const YamlNode& node) {
    for (const Command& command : motion_->commands) {
      const bool plain = command.terms.size() == 1 &&
                         command.terms[0].coordinate.kind != Coordinate::Kind::kOutput &&
                         command.terms[0].coordinate.kind != Coordinate::Kind::kJoint;
      if (plain) continue;
      yaml().Error(
          node,
          fmt::format(
              "motion: '{}' is commanded, but where some degrees of freedom move by forces, "
              "commands name drives and prescribed joints only",
              command.name),
          "command the drives themselves, or give no forces and no initial values");
    }
  }

  void ReadForces(const YamlNode& node) {
    std::vector<std::string> names;
    for (const Drive& drive : mechanism_.drives) names.push_back(drive.name);
    for (const YamlEntry& entry : yaml().Entries(node, "forces")) {
      const int drive = mechanism_.FindDrive(entry.key);
      if (drive < 0) {
        yaml().Error(entry, fmt::format("forces: {} has no drive '{}'", mechanism_.name, entry.key),
                     DidYouMean(entry.key, names, "known: " + Joined(names, kMostNames)));
        continue;
      }
      const ProfileContext context{.unit = ForceUnit(mechanism_, mechanism_.drives[drive]),
                                   .home = {},
                                   .name = "forces." + entry.key,
                                   .may_jump = true,
                                   .tables = tables_};
      DriveForce force{.drive = drive, .force = {}};
      if (functions_.Follows(*entry.value)) {
        force.following = functions_.Read(*entry.value, context.name);
      } else {
        force.force = ReadProfile(values_, *entry.value, context.name, context);
      }
      motion_->forces.push_back(std::move(force));
    }
  }

  const NamedCoordinate* Find(const YamlEntry& entry, const std::string& path) {
    std::vector<std::string> names;
    for (const NamedCoordinate& named : known_) {
      if (named.name == entry.key) return &named;
      names.push_back(named.name);
    }
    yaml().Error(entry,
                 fmt::format("{}: {} has no coordinate '{}'", path, mechanism_.name, entry.key),
                 DidYouMean(entry.key, names,
                            "known: drives, OUTPUT.x … OUTPUT.yaw, joints (JOINT.0, JOINT.1 … "
                            "where they have several coordinates)"));
    return nullptr;
  }

  // Number of a start value: a constant profile, so that units and `home` are read alike.
  std::optional<double> Number(const YamlEntry& entry, const std::string& path,
                               const Coordinate& coordinate, bool rate) {
    ProfileContext context{.unit = CoordinateUnit(mechanism_, coordinate), .home = {}};
    if (!rate) context.home = HomeValue(mechanism_, coordinate);
    const Profile profile = ReadProfile(values_, *entry.value, path, context);
    for (const ProfileTerm& term : profile.terms) {
      if (std::holds_alternative<ConstantTerm>(term)) continue;
      yaml().Error(entry, path + " is a start value and cannot depend on time");
      return {};
    }
    return Evaluate(profile, 0.0).value;
  }

  void ReadInitial(const YamlNode* node, const std::string& path, bool rate) {
    if (node == nullptr) return;
    for (const YamlEntry& entry : yaml().Entries(*node, path)) {
      const NamedCoordinate* named = Find(entry, path);
      if (named == nullptr) continue;
      const auto value = Number(entry, path + "." + entry.key, named->coordinate, rate);
      if (!value) continue;
      auto at = std::find_if(motion_->initial.begin(), motion_->initial.end(),
                             [&](const InitialValue& v) { return v.name == entry.key; });
      if (at == motion_->initial.end()) {
        motion_->initial.push_back({.name = named->name,
                                    .coordinate = named->coordinate,
                                    .position = HomeValue(mechanism_, named->coordinate)});
        at = std::prev(motion_->initial.end());
      }
      (rate ? at->rate : at->position) = *value;
    }
  }

  [[nodiscard]] bool IsCommanded(int drive) const {
    return std::any_of(motion_->commands.begin(), motion_->commands.end(),
                       [&](const Command& command) {
                         const Coordinate& c = command.terms.front().coordinate;
                         return c.kind == Coordinate::Kind::kDrive && c.index == drive;
                       });
  }

  // Each drive has either a command or a force.
  void CheckDrives(const YamlNode& node) {
    for (size_t d = 0; d < mechanism_.drives.size(); ++d) {
      const int drive = static_cast<int>(d);
      const std::string& name = mechanism_.drives[d].name;
      const bool forced = motion_->FindForce(drive) >= 0, commanded = IsCommanded(drive);
      if (forced && commanded) {
        yaml().Error(node, fmt::format("drive '{}' has a command and a force", name),
                     "its motion follows from the force, or its force from the motion");
      } else if (!forced && !commanded) {
        yaml().Error(node, fmt::format("drive '{}' has neither a command nor a force", name),
                     fmt::format("a drive that is switched off has forces: {{{}: 0}}", name));
      }
    }
  }

  // As many start values as DOFs that no command holds.
  void Complete(const YamlNode& node) {
    const int dofs = ReportMobility(mechanism_).dofs();
    const auto commands = static_cast<int>(motion_->commands.size());
    const int free = dofs - commands;
    if (free <= 0) {
      yaml().Error(node,
                   fmt::format("motion commands {} of {} degrees of freedom, so no degree of "
                               "freedom is left to forces",
                               commands, dofs),
                   "leave out forces and initial values, or a command");
      return;
    }
    std::vector<Command> given = motion_->commands;
    for (const InitialValue& value : motion_->initial) {
      given.push_back(AsCommand(value.name, value.coordinate));
    }
    const CommandRank rank = RankCommands(mechanism_, given);
    if (rank.redundant > 0 || static_cast<int>(motion_->initial.size()) > free) {
      std::vector<std::string> names;
      for (const int k : rank.dependent) names.push_back(given[static_cast<size_t>(k)].name);
      yaml().Error(node,
                   fmt::format("start values and commands depend on each other: {}",
                               names.empty() ? "more are given than there are degrees of freedom"
                                             : Joined(names, kMostNames)),
                   fmt::format("{} has {} degrees of freedom, {} of them commanded: leave out {}",
                               mechanism_.name, dofs, commands, rank.redundant));
      return;
    }
    std::vector<Command> candidates;
    const std::vector<NamedCoordinate> joints = NamedJointCoordinates(mechanism_);
    candidates.reserve(joints.size());
    for (const NamedCoordinate& joint : joints) {
      candidates.push_back(AsCommand(joint.name, joint.coordinate));
    }
    const size_t missing = static_cast<size_t>(free) - motion_->initial.size();
    const std::vector<size_t> chosen = IndependentCommands(mechanism_, given, candidates, missing);
    for (const size_t k : chosen) {
      motion_->initial.push_back({.name = joints[k].name,
                                  .coordinate = joints[k].coordinate,
                                  .position = HomeValue(mechanism_, joints[k].coordinate)});
    }
  }

  ValueReader* values_;
  const Mechanism& mechanism_;
  StateFunctions& functions_;
  ProfileTables* tables_;
  Motion* motion_;
  std::vector<NamedCoordinate> known_;
};

// True when the scenario leaves DOFs to forces.
bool IsFree(const YamlNode* motion, const YamlNode* forces) {
  if (forces != nullptr) return true;
  return motion != nullptr && motion->is_map() &&
         (motion->Find("initial") != nullptr || motion->Find("initial_rates") != nullptr);
}

// Reads drive forces and start values into a motion whose commands have been read, and completes
// the start values: DOFs that are not named start at home, at rest, in joint coordinates in
// model order. Findings go to the reader.
void ReadFreeMotion(ValueReader* values, const Mechanism& mechanism, const YamlNode& motion_node,
                    const YamlNode* forces, StateFunctions* functions, ProfileTables* tables,
                    Motion* motion) {
  FreeMotionReader(values, mechanism, functions, tables, motion).Read(motion_node, forces);
}

}  // namespace
std::optional<PolylinePlan> ReadBlendedPlan(ValueReader* values, const YamlMap& map) {
  YamlReader& yaml = values->yaml();
  PolylinePlan plan;
  plan.start_s = values->InUnit(map, "start_s", {kPlain}).value_or(0.0);
  if (const YamlNode* law = map.Find("law")) {
    const auto choice = yaml.Choice(*law, map.PathOf("law"), {"trapezoid", "s_curve"});
    if (!choice) return std::nullopt;
    plan.s_curve = *choice == 1;
  }
  if (!plan.s_curve && map.Has("j_max")) {
    yaml.Error(*map.Find("j_max"), map.PathOf("j_max") + " has a meaning with law: s_curve only");
    return std::nullopt;
  }
  const auto v_max = values->RequiredPositive(map, "v_max");
  const auto a_max = values->RequiredPositive(map, "a_max");
  const auto j_max = plan.s_curve ? values->RequiredPositive(map, "j_max") : 1.0;
  const auto blend = values->InUnit(map, "blend", {kPlain, kMm});
  if (!v_max || !a_max || !j_max || !blend) return std::nullopt;
  plan.blend = *blend;
  plan.limits = {.v_max = *v_max, .a_max = *a_max, .j_max = *j_max};
  if (plan.blend > 0.0) return plan;
  yaml.Error(*map.node(), fmt::format("{} = {} violates blend > 0", map.PathOf("blend"), *blend),
             "without blend the path rests at each point");
  return std::nullopt;
}

std::vector<Piecewise> PlanPath(YamlReader* yaml, const YamlNode& node, const PolylinePlan& plan) {
  for (size_t i = 0; i + 1 < plan.points.size(); ++i) {
    if (plan.points[i] != plan.points[i + 1]) continue;
    yaml->Error(node, fmt::format("motion.path.points: points {} and {} are equal", i, i + 1));
    return {};
  }
  const PolylineTrouble trouble = TroubleOf(plan);
  if (trouble.text.empty()) return BlendedPolyline(plan);
  yaml->Error(node, "motion.path: " + trouble.text, trouble.hint);
  return {};
}

namespace {

constexpr const char* kTime = "t";

bool IsWord(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

// A text in pieces: words with their dots, and what is between them.
struct Piece {
  std::string text;
  bool is_word = false;  // starts with a letter or _

  [[nodiscard]] bool is_dotted() const { return is_word && text.find('.') != std::string::npos; }
};

std::vector<Piece> PiecesOf(const std::string& text) {
  std::vector<Piece> pieces;
  for (size_t i = 0; i < text.size();) {
    size_t end = i;
    while (end < text.size() && (IsWord(text[end]) || text[end] == '.')) ++end;
    if (end == i) ++end;
    const bool letter = IsWord(text[i]) && std::isdigit(static_cast<unsigned char>(text[i])) == 0;
    pieces.push_back({text.substr(i, end - i), letter});
    i = end;
  }
  return pieces;
}

// Rotations of balls are coordinates for start values only.
bool CanFollow(const Mechanism& mechanism, const Coordinate& coordinate) {
  if (coordinate.kind != Coordinate::Kind::kJoint) return true;
  const Joint& joint = mechanism.joints[static_cast<size_t>(coordinate.index)];
  return !HasBall(joint.kind);
}

class FunctionReader {
 public:
  FunctionReader(ValueReader* values, const Mechanism& mechanism,
                 const std::map<std::string, Profile>& signals)
      : values_(*values), mechanism_(mechanism), signals_(signals) {
    for (const NamedCoordinate& named : StateCoordinates(mechanism)) {
      if (!CanFollow(mechanism, named.coordinate)) continue;
      known_.push_back({named.name + ".position", Input(named.coordinate, false)});
      known_.push_back({named.name + ".velocity", Input(named.coordinate, true)});
    }
  }

  std::optional<StateFunction> Read(const YamlNode& node, const std::string& path) {
    std::string expression;
    bool good = true;
    for (const Piece& piece : PiecesOf(node.text)) {
      good = CheckTime(piece, node, path) && good;
      const auto signal = piece.is_word ? signals_.find(piece.text) : signals_.end();
      if (signal != signals_.end()) {
        used_.push_back(signal->second);
        used_names_.push_back(fmt::format("signal_{}", used_.size()));
        expression += used_names_.back();
        continue;
      }
      const auto name = piece.is_dotted() ? VariableOf(piece.text, node, path) : piece.text;
      good = good && name;
      expression += name.value_or("0");
    }
    if (!good) return std::nullopt;
    std::vector<std::string> names = variables_;
    names.insert(names.end(), used_names_.begin(), used_names_.end());
    const auto formula = values_.Compile(node, path, expression, names);
    if (formula == nullptr) return std::nullopt;
    const auto known = [signals = used_](double t_s, std::span<const double> inputs) {
      std::vector<double> all{t_s};
      all.insert(all.end(), inputs.begin(), inputs.end());
      for (const Profile& signal : signals) all.push_back(Evaluate(signal, t_s).value);
      return all;
    };
    StateFunction function{.inputs = inputs_,
                           .value =
                               [formula, known](double t_s, std::span<const double> inputs) {
                                 return formula->At(known(t_s, inputs));
                               },
                           .signals = used_};
    if (!formula->has_branches()) return function;
    function.branch = [formula, known](double t_s, std::span<const double> inputs) {
      return formula->BranchAt(known(t_s, inputs));
    };
    function.on_branch = [formula, known](int branch, double t_s, std::span<const double> inputs) {
      return formula->OnBranch(branch, known(t_s, inputs));
    };
    return function;
  }

 private:
  struct Known {
    std::string name;
    StateFunction::Input input;
  };

  [[nodiscard]] StateFunction::Input Input(const Coordinate& coordinate, bool rate) const {
    return {coordinate, rate, HomeValue(mechanism_, coordinate)};
  }

  bool CheckTime(const Piece& piece, const YamlNode& node, const std::string& path) {
    if (piece.text != kTime || !values_.HasParameter(kTime)) return true;
    values_.yaml().Error(
        node, fmt::format("{}: t is the time here, and a parameter of {}", path, mechanism_.name));
    return false;
  }

  // The variable that stands for a coordinate.
  std::optional<std::string> VariableOf(const std::string& name, const YamlNode& node,
                                        const std::string& path) {
    const auto found =
        std::ranges::find_if(known_, [&](const Known& known) { return known.name == name; });
    if (found == known_.end()) {
      std::vector<std::string> names;
      for (const Known& known : known_) names.push_back(known.name);
      values_.yaml().Error(node, fmt::format("{}: {} has no '{}'", path, mechanism_.name, name),
                           DidYouMean(name, names,
                                      "known: t [s], and .position and .velocity of drives, of "
                                      "OUTPUT.x … OUTPUT.yaw and of joints"));
      return std::nullopt;
    }
    inputs_.push_back(found->input);
    variables_.push_back(fmt::format("state_{}", variables_.size()));
    return variables_.back();
  }

  ValueReader& values_;
  const Mechanism& mechanism_;
  std::vector<Known> known_;
  const std::map<std::string, Profile>& signals_;
  std::vector<StateFunction::Input> inputs_;
  std::vector<std::string> variables_ = {kTime};
  std::vector<Profile> used_;
  std::vector<std::string> used_names_;
};

}  // namespace

StateFunctions::StateFunctions(ValueReader* values, const Mechanism& mechanism,
                               const YamlNode* variables, ProfileTables* tables)
    : values_(*values), mechanism_(mechanism) {
  if (variables == nullptr) return;
  YamlReader& yaml = values->yaml();
  for (const YamlEntry& entry : yaml.Entries(*variables, "variables")) {
    const std::string path = "variables." + entry.key;
    std::string why_not = InvalidNameReason(entry.key);
    if (entry.key == kTime) why_not = "t is the time here";
    if (values->HasParameter(entry.key)) why_not = "it is a parameter of " + mechanism.name;
    if (!why_not.empty()) {
      yaml.Error(entry, fmt::format("{}: {}", path, why_not));
    } else if (!entry.value->is_scalar()) {
      const ProfileContext context{
          .unit = "1", .home = {}, .name = path, .may_jump = true, .tables = tables};
      signals_[entry.key] = ReadProfile(values, *entry.value, path, context);
    } else if (const auto text = yaml.Text(*entry.value, path)) {
      variables_[entry.key] = *text;
    }
  }
  for (const YamlEntry& entry : yaml.Entries(*variables, "variables")) {
    if (entry.value->is_scalar() && !yaml.has_errors())
      (void)Read(*entry.value, "variables." + entry.key);
  }
}

bool StateFunctions::Follows(const YamlNode& node) const {
  if (!node.is_scalar()) return false;
  const std::vector<Piece> pieces = PiecesOf(node.text);
  return std::ranges::any_of(pieces, [&](const Piece& piece) {
    return piece.is_dotted() || (piece.text == kTime && !values_.HasParameter(kTime)) ||
           (piece.is_word && (variables_.contains(piece.text) || signals_.contains(piece.text)));
  });
}

// The text with variables replaced by what they stand for.
std::optional<std::string> StateFunctions::Expanded(const YamlNode& node, const std::string& path,
                                                    const std::string& text, int depth) const {
  constexpr int kDeepest = 20;
  constexpr size_t kLongest = 100000;
  std::string out;
  for (const Piece& piece : PiecesOf(text)) {
    const auto found = piece.is_word ? variables_.find(piece.text) : variables_.end();
    if (found == variables_.end()) {
      out += piece.text;
      continue;
    }
    const auto inner =
        depth < kDeepest ? Expanded(node, path, found->second, depth + 1) : std::nullopt;
    if (!inner || out.size() + inner->size() > kLongest) {
      if (depth == 0) {
        values_.yaml().Error(node, fmt::format("{}: variable '{}' refers to itself, or stands for "
                                               "too much",
                                               path, piece.text));
      }
      return std::nullopt;
    }
    out += "(" + *inner + ")";
  }
  return out;
}

std::optional<StateFunction> StateFunctions::Read(const YamlNode& node, const std::string& path) {
  const auto text = Expanded(node, path, node.text, 0);
  if (!text) return std::nullopt;
  YamlNode expanded = node;
  expanded.text = *text;
  auto function = FunctionReader(&values_, mechanism_, signals_).Read(expanded, path);
  if (function && function->branch) function->number = branching_++;
  return function;
}

namespace {

constexpr double kMostSamples = 1e6;

class MotionReader {
 public:
  MotionReader(ValueReader* values, const Mechanism& mechanism, const MotionTimes& otherwise,
               const PhaseMotion& phase, Diagnostics* files)
      : values_(values),
        mechanism_(mechanism),
        otherwise_(otherwise),
        phase_(phase),
        known_(NamedMotionCoordinates(mechanism)),
        tables_{.mechanism = &mechanism, .files = files} {}

  Motion Read(const MotionSections& sections) {
    const YamlNode *node = sections.motion, *forces = sections.forces;
    functions_.emplace(values_, mechanism_, sections.variables, &tables_);
    YamlMap map(&yaml(), node, "motion",
                {"duration_s", "sample_s", "commands", "equal", "path", "pose_table", "initial",
                 "initial_rates"});
    if (const YamlNode* commands = map.Find("commands")) ReadCommands(*commands, "motion.commands");
    if (phase_.commands != nullptr) ReadCommands(*phase_.commands, phase_.path);
    if (const YamlNode* equal = map.Find("equal")) ReadEqual(*equal);
    if (const YamlNode* pose = map.Find("pose_table")) ReadPoseTable(*pose);
    double path_end_s = kNan;
    if (const YamlNode* path = map.Find("path")) path_end_s = ReadPath(*path);
    ReadTimes(map, path_end_s);
    if (sections.loads != nullptr) ReadLoads(*sections.loads);
    if (sections.switches != nullptr) {
      ReadSwitches(*sections.switches);
      CheckShares(*sections.switches);
    }
    if (map.valid() && node != nullptr && IsFree(node, forces)) {
      ReadFreeMotion(values_, mechanism_, *node, forces, &*functions_, &tables_, &motion_);
      if (HasPayloads(motion_)) {
        yaml().Error(*sections.switches,
                     "switches: the mass of a body changes in commanded motions only",
                     "where forces move what grips it, that is an impact, which is not computed");
      }
    } else if (map.valid() && motion_.commands.empty() && !yaml().has_errors() && node != nullptr) {
      yaml().Error(*node, "motion commands nothing",
                   "give commands, equal, path or pose_table; or forces and initial values");
    }
    if (map.valid() && node != nullptr) CheckRigidStops(*node);
    TakeTables();
    return motion_;
  }

 private:
  YamlReader& yaml() { return values_->yaml(); }

  // They act where forces move what hits them, without dry friction beside, whose share in an
  // impact and in what then rests is not computed.
  void CheckRigidStops(const YamlNode& node) {
    const auto stop = std::ranges::find_if(mechanism_.elements, IsRigidStop);
    if (stop == mechanism_.elements.end()) return;
    if (!motion_.free()) {
      yaml().Warn(node,
                  fmt::format("the rigid {} ('{}') does nothing in commanded motions",
                              Described(mechanism_, *stop), stop->name),
                  "range: of a drive or joint refuses motions that leave it; stiffness: makes the "
                  "stop elastic");
    } else if (const std::string friction = FirstFriction(mechanism_); !friction.empty()) {
      yaml().Error(node,
                   fmt::format("motion: the rigid {} ('{}') and the dry friction of '{}' are "
                               "not computed together",
                               Described(mechanism_, *stop), stop->name, friction),
                   "stiffness: instead of restitution makes the stop elastic");
    }
  }

  // Every table must last as long as the motion.
  void TakeTables() {
    for (size_t i = 0; i < tables_.loaded.size() && times_known_; ++i) {
      CheckCover(tables_.loaded[i], *tables_.places[i].node, tables_.places[i].path,
                 motion_.duration_s, &yaml());
    }
    for (const ProfileTables::Law& law : tables_.laws) {
      if (times_known_) CheckEnd(law);
    }
    motion_.tables = std::move(tables_.loaded);
  }

  // A law that the motion cuts off. One that ends before it holds its last value, which is usual.
  void CheckEnd(const ProfileTables::Law& law) {
    constexpr double kSame = 1e-6;  // of the duration
    const double end_s = motion_.duration_s;
    if (law.end_s <= end_s * (1.0 + kSame)) return;
    const std::string what =
        law.start_s >= end_s
            ? fmt::format("begins at {:g} s, when the motion of {:g} s is over", law.start_s, end_s)
            : fmt::format("ends at {:g} s, but the motion at {:g} s: it is cut off", law.end_s,
                          end_s);
    yaml().Warn(*law.node, law.path + ": " + what,
                "state a longer motion.duration_s, or a shorter law");
  }

  // The shortest of the commands' tables, if any ends.
  [[nodiscard]] std::optional<double> TableEnd() const {
    std::optional<double> end_s;
    if (tables_.failed) end_s = 1.0;  // it is not known, and no second finding
    for (const MotionTable& table : tables_.loaded) {
      if (!table.periodic) end_s = std::min(end_s.value_or(table.to_s), table.to_s);
    }
    return end_s;
  }

  void ReadTimes(const YamlMap& map, double path_end_s) {
    if (!map.valid() || map.node() == nullptr) return;
    std::optional<double> duration_s = path_end_s;
    if (std::isnan(path_end_s)) {
      duration_s = otherwise_.duration_s ? otherwise_.duration_s : TableEnd();
    }
    if (!duration_s || map.Has("duration_s")) {
      duration_s = values_->RequiredPositive(map, "duration_s");
    }
    motion_.sample_s = otherwise_.sample_s.value_or(motion_.sample_s);
    if (const YamlNode* sample = map.Find("sample_s")) {
      motion_.sample_s = values_->Positive(*sample, "motion.sample_s").value_or(motion_.sample_s);
    }
    if (!duration_s) return;
    times_known_ = true;
    motion_.duration_s = *duration_s;
    if (motion_.sample_s > motion_.duration_s ||
        motion_.duration_s / motion_.sample_s > kMostSamples) {
      yaml().Error(*map.node(), fmt::format("motion.sample_s = {} and duration_s = {} violate "
                                            "1 <= duration_s/sample_s <= {:g}",
                                            motion_.sample_s, motion_.duration_s, kMostSamples));
    }
  }

  // A coordinate by name; a finding names the closest one.
  std::optional<Coordinate> FindCoordinate(const YamlEntry& entry, const std::string& path) {
    const auto found = std::ranges::find(known_, entry.key, &NamedCoordinate::name);
    if (found != known_.end()) return found->coordinate;
    const std::vector<std::string> names = NamesOf(known_);
    yaml().Error(entry,
                 fmt::format("{}: {} has no coordinate '{}'", path, mechanism_.name, entry.key),
                 JointHint(entry.key).value_or(DidYouMean(
                     entry.key, names,
                     fmt::format("any {} independent ones can be commanded, of prescribed joints, "
                                 "drives, OUTPUT.x … OUTPUT.yaw and joints (JOINT.0, JOINT.1 … "
                                 "where they have several coordinates): {}",
                                 ReportMobility(mechanism_).dofs(), Joined(names, kMostNames)))));
    return {};
  }

  // What to command where the name is that of a joint, or of a ball's rotation.
  [[nodiscard]] std::optional<std::string> JointHint(const std::string& name) const {
    const int j = mechanism_.FindJoint(name);
    const auto is_named = [&](const NamedCoordinate& named) { return named.name == name; };
    if (std::ranges::any_of(NamedJointCoordinates(mechanism_), is_named) ||
        (j >= 0 && mechanism_.joints[static_cast<size_t>(j)].kind == JointKind::kSpherical)) {
      return "a rotation of a spherical joint has no axis that a command could be about: command "
             "OUTPUT.roll, OUTPUT.pitch or OUTPUT.yaw of an output on its body";
    }
    if (j < 0) return {};
    std::vector<std::string> own;
    for (const NamedCoordinate& named : known_) {
      const Coordinate& at = named.coordinate;
      if (named.name.starts_with(name + ".") && at.kind != Coordinate::Kind::kOutput) {
        own.push_back(named.name);
      }
    }
    if (own.empty()) return "this joint has no coordinate that a command could be about";
    return fmt::format("this joint has several coordinates: {}", Joined(own));
  }

  void AddCommand(const YamlEntry& entry, Command command) {
    for (const Command& other : motion_.commands) {
      const bool same = other.terms.size() == 1 && command.terms.size() == 1 &&
                        other.terms[0].coordinate == command.terms[0].coordinate;
      if (same || other.name == command.name) {
        yaml().Error(entry, fmt::format("motion commands '{}' twice", command.name));
        return;
      }
    }
    motion_.commands.push_back(std::move(command));
  }

  // Of the scenario's first phase, whose joints are the same but for those of contacts.
  [[nodiscard]] double Home(Coordinate coordinate) const {
    if (phase_.first == nullptr) return HomeValue(mechanism_, coordinate);
    if (coordinate.kind == Coordinate::Kind::kJoint) {
      const int own = coordinate.index;
      coordinate.index = phase_.first->FindJoint(mechanism_.joints[static_cast<size_t>(own)].name);
      if (coordinate.index < 0)
        return HomeValue(mechanism_, {coordinate.kind, own, coordinate.component});
    }
    return HomeValue(*phase_.first, coordinate);
  }

  void ReadCommands(const YamlNode& node, const std::string& section) {
    for (const YamlEntry& entry : yaml().Entries(node, section)) {
      const std::string path = section + "." + entry.key;
      const auto coordinate = FindCoordinate(entry, section);
      if (!coordinate) continue;
      const ProfileContext context{.unit = CoordinateUnit(mechanism_, *coordinate),
                                   .home = Home(*coordinate),
                                   .name = entry.key,
                                   .moves = true,
                                   .tables = &tables_};
      AddCommand(entry, {.name = NameOf(mechanism_, *coordinate),
                         .terms = {{*coordinate, 1.0}},
                         .profile = ReadProfile(values_, *entry.value, path, context)});
    }
  }

  void ReadPoseTable(const YamlNode& node) {
    PoseTable pose = LoadPoseTable(values_, node, mechanism_, tables_.files);
    tables_.failed = tables_.failed || pose.components.empty();
    const YamlEntry place{"pose_table", node.line, node.column, nullptr};
    for (PoseComponent& part : pose.components) {
      const Coordinate coordinate{Coordinate::Kind::kOutput, pose.output, part.component};
      AddCommand(place, {.name = part.table.name,
                         .terms = {{coordinate, 1.0}},
                         .profile = {{PiecewiseTerm{part.table.spline}}}});
      tables_.places.push_back({node.Find("csv"), "motion.pose_table"});
      tables_.loaded.push_back(std::move(part.table));
    }
  }

  static YamlEntry AsEntry(const YamlNode& node) {
    return {node.text, node.line, node.column, nullptr};
  }

  void ReadEqual(const YamlNode& node) {
    const auto pairs = yaml().Items(node, "motion.equal");
    if (!pairs) return;
    for (size_t i = 0; i < pairs->size(); ++i) {
      const std::string path = fmt::format("motion.equal[{}]", i);
      const auto items = yaml().Items(*(*pairs)[i], path, 2);
      if (!items || !yaml().Text(*(*items)[0], path) || !yaml().Text(*(*items)[1], path)) continue;
      const YamlEntry a = AsEntry(*(*items)[0]), b = AsEntry(*(*items)[1]);
      const auto ca = FindCoordinate(a, path), cb = FindCoordinate(b, path);
      if (!ca || !cb) continue;
      if (*ca == *cb || CoordinateUnit(mechanism_, *ca) != CoordinateUnit(mechanism_, *cb)) {
        yaml().Error(*(*pairs)[i], fmt::format("{}: {} and {} are not two coordinates of one unit",
                                               path, a.key, b.key));
        continue;
      }
      AddCommand(a, {.name = a.key + " - " + b.key,
                     .terms = {{*ca, 1.0}, {*cb, -1.0}},
                     .profile = Constant(0.0)});
    }
  }

  // Way points with rest at each; returns when the path ends [s].
  double ReadPath(const YamlNode& node) {
    std::vector<std::string> keys = {"outputs", "points",  "points_mm", "v_max",   "a_max",
                                     "law",     "start_s", "blend",     "blend_mm"};
    const bool blends =
        node.is_map() && (node.Find("blend") != nullptr || node.Find("blend_mm") != nullptr);
    if (blends) keys.emplace_back("j_max");
    const YamlMap map(&yaml(), &node, "motion.path", keys);
    if (!map.valid()) return kNan;
    if (blends) return ReadBlended(map, ReadBlendedPlan(values_, map));
    const std::vector<Command> axes = ReadPathOutputs(map);
    const auto v_max = values_->RequiredPositive(map, "v_max");
    const auto a_max = values_->RequiredPositive(map, "a_max");
    const double start_s = values_->InUnit(map, "start_s", {kPlain}).value_or(0.0);
    bool full = false;
    if (const YamlNode* law = map.Find("law")) {
      full = yaml().Choice(*law, "motion.path.law", {"ramp_cruise", "full"}).value_or(0) == 1;
    }
    const std::vector<VecX> points = ReadPoints(map, axes.size());
    if (axes.empty() || points.size() < 2 || !v_max || !a_max) return kNan;
    return BuildPath(node, axes, points, *v_max, *a_max, full, start_s);
  }

  // The corners are rounded; the end of the path, or NaN after a finding.
  double ReadBlended(const YamlMap& map, std::optional<PolylinePlan> plan) {
    std::vector<Command> axes = ReadPathOutputs(map);
    const std::vector<VecX> points = ReadPoints(map, axes.size());
    if (!plan || axes.empty() || points.size() < 2) return kNan;
    plan->points = points;
    const auto paths = PlanPath(&yaml(), *map.node(), *plan);
    if (paths.empty()) return kNan;
    const YamlEntry place{"path", map.node()->line, map.node()->column, nullptr};
    for (size_t k = 0; k < axes.size(); ++k) {
      axes[k].profile.terms.emplace_back(
          PiecewiseTerm{std::make_shared<const Piecewise>(paths[k])});
      AddCommand(place, std::move(axes[k]));
    }
    return paths[0].breaks.back();
  }

  std::vector<Command> ReadPathOutputs(const YamlMap& map) {
    std::vector<Command> axes;
    const YamlNode* node = map.Required("outputs");
    const auto items = node == nullptr ? std::nullopt : yaml().Items(*node, "motion.path.outputs");
    if (!items) return {};
    for (const YamlNode* item : *items) {
      if (!yaml().Text(*item, "motion.path.outputs")) continue;
      const auto coordinate = FindCoordinate(AsEntry(*item), "motion.path.outputs");
      if (!coordinate) continue;
      if (CoordinateUnit(mechanism_, *coordinate) != "m") {
        yaml().Error(*item, fmt::format("motion.path.outputs: {} is not a length", item->text),
                     "v_max and a_max are in m/s and m/s²; command angles under motion.commands");
        continue;
      }
      axes.push_back({.name = item->text, .terms = {{*coordinate, 1.0}}});
    }
    return axes.size() == items->size() ? axes : std::vector<Command>{};
  }

  std::vector<VecX> ReadPoints(const YamlMap& map, size_t axes) {
    const YamlMap::InUnit found = map.FindInUnit("points", {kPlain, kMm});
    if (found.node == nullptr) {
      (void)map.Required("points");  // reports it
      return {};
    }
    const std::string path = map.PathOf(found.key);
    const auto items = yaml().Items(*found.node, path);
    if (!items) return {};
    if (items->size() < 2) yaml().Error(*found.node, path + " has fewer than two points");
    std::vector<VecX> points;
    for (size_t i = 0; i < items->size(); ++i) {
      const auto numbers = values_->Numbers(*(*items)[i], fmt::format("{}[{}]", path, i),
                                            axes == 0 ? -1 : static_cast<int>(axes));
      if (!numbers) return {};
      points.push_back(
          Eigen::Map<const VecX>(numbers->data(), static_cast<Eigen::Index>(numbers->size()))
              .unaryExpr(found.unit.to_si));
    }
    return points;
  }

  // One term per segment and axis, each from rest to rest.
  double BuildPath(const YamlNode& node, std::vector<Command> axes, const std::vector<VecX>& points,
                   double v_max, double a_max, bool full, double start_s) {
    double t = start_s;
    for (size_t k = 0; k < axes.size(); ++k) {
      axes[k].profile.terms.emplace_back(ConstantTerm{points[0][static_cast<Eigen::Index>(k)]});
    }
    for (size_t i = 0; i + 1 < points.size(); ++i) {
      const VecX step = points[i + 1] - points[i];
      const double length = step.norm();
      if (length == 0.0) {
        yaml().Error(node, fmt::format("motion.path.points: points {} and {} are equal", i, i + 1));
        return kNan;
      }
      // Peaks of the 3-4-5 law: 15/8 of the mean speed, 10/√3 · length/T².
      const double full_s =
          std::max(1.875 * length / v_max, std::sqrt(10.0 / std::sqrt(3.0) * length / a_max));
      const RampCruiseTerm ramp{t, length, v_max, a_max, 0.0};
      const double duration_s = full ? full_s : Duration(ramp);
      for (size_t k = 0; k < axes.size(); ++k) {
        const double delta = step[static_cast<Eigen::Index>(k)];
        if (full) {
          axes[k].profile.terms.emplace_back(PolyStepTerm{t, duration_s, delta});
        } else {
          RampCruiseTerm term = ramp;
          term.delta = delta;
          axes[k].profile.terms.emplace_back(term);
        }
      }
      t += duration_s;
    }
    const YamlEntry place{"path", node.line, node.column, nullptr};
    for (Command& axis : axes) AddCommand(place, std::move(axis));
    return t;
  }

  // Brakes and clutches: elements that act with a share of their force.
  void ReadSwitches(const YamlNode& node) {
    std::vector<std::string> names;
    for (const ForceElement& element : mechanism_.elements) names.push_back(element.name);
    for (const YamlEntry& entry : yaml().Entries(node, "switches")) {
      const std::string path = "switches." + entry.key;
      const size_t before = motion_.switches.size();
      const Profile share = ReadProfile(
          values_, *entry.value, path,
          {.unit = "1", .home = {}, .name = path, .may_jump = true, .tables = &tables_});
      for (size_t e = 0; e < names.size(); ++e) {
        const ForceElement& element = mechanism_.elements[e];
        const bool axis = ActsOnBall(mechanism_, element) && names[e].size() > 2 &&
                          names[e].substr(0, names[e].size() - 2) == entry.key;
        if (names[e] != entry.key && !axis) continue;
        const auto* curve = std::get_if<CurveLaw>(&element.law);
        const bool stores = curve == nullptr
                                ? !std::holds_alternative<FrictionLaw>(element.law) &&
                                      !std::holds_alternative<CurvesLaw>(element.law) &&
                                      !std::holds_alternative<ExpressionLaw>(element.law)
                                : !curve->of_rate;
        if (stores) {
          yaml().Error(entry,
                       fmt::format("{}: a {} stores energy or is MuJoCo's own, and is not switched",
                                   path, Described(mechanism_, element)),
                       "dry friction, curves of the rate or of both, and expressions are");
          return;
        }
        motion_.switches.push_back({.name = entry.key, .element = e, .share = share});
      }
      if (motion_.switches.size() > before) continue;
      if (const int body = mechanism_.FindBody(entry.key); body > 0) {
        if (!CheckPayload(entry, path, body)) return;
        motion_.switches.push_back({.name = entry.key, .body = body, .share = share});
        continue;
      }
      yaml().Error(
          entry,
          fmt::format("switches: {} has no element and no body '{}'", mechanism_.name, entry.key),
          DidYouMean(entry.key, names, "known: " + Joined(names, kMostNames)));
    }
  }

  // A body that another one carries may have a share of its mass.
  bool CheckPayload(const YamlEntry& entry, const std::string& path, int body) {
    const bool carried = std::ranges::any_of(mechanism_.joints, [&](const Joint& joint) {
      return joint.kind == JointKind::kFixed && (joint.child == body || joint.parent == body);
    });
    if (!carried) {
      yaml().Error(
          entry,
          fmt::format("{}: the mass of a body changes only where another body carries it", path),
          "a payload is a body of its own, on a fixed joint");
      return false;
    }
    if (mechanism_.bodies[static_cast<size_t>(body)].gravity_compensation != 0.0) {
      yaml().Error(entry, path + ": a body with gravity compensation is no payload");
      return false;
    }
    return true;
  }

  // A share below zero would push: looked at where profiles begin, end and turn, and between.
  void CheckShares(const YamlNode& node) {
    constexpr int kLooks = 1000;
    for (const Switch& one : motion_.switches) {
      for (int k = 0; k <= kLooks; ++k) {
        const double t_s = motion_.duration_s * k / kLooks, share = Evaluate(one.share, t_s).value;
        if (share >= 0.0) continue;
        yaml().Error(node, fmt::format("switches.{} = {:.3g} at t = {:.3g} s violates share >= 0",
                                       one.name, share, t_s));
        break;
      }
    }
  }

  void ReadLoads(const YamlNode& node) {
    for (const YamlEntry& entry : yaml().Entries(node, "loads")) {
      const std::string path = "loads." + entry.key;
      YamlMap map(&yaml(), entry.value.get(), path, {"on", "at", "force", "moment", "in"});
      Load load{.name = entry.key, .force = {}, .moment = {}};
      if (const YamlNode* on = map.Required("on")) ReadPlace(*on, path, &load);
      if (const YamlNode* at = map.Find("at")) {
        const auto offset = values_->Vector(*at, path + ".at");
        if (offset) load.p_BoQ_B += *offset;
      }
      if (const YamlNode* in = map.Find("in")) {
        load.in_body_axes = yaml().Choice(*in, path + ".in", {"world", "body"}).value_or(0) == 1;
      }
      if (map.valid() && !map.Has("force") && !map.Has("moment")) {
        yaml().Error(entry, path + " has neither force nor moment");
      }
      ReadComponents(map.Find("force"), path + ".force", "N", 0, &load);
      ReadComponents(map.Find("moment"), path + ".moment", "N m", 3, &load);
      motion_.loads.push_back(std::move(load));
    }
  }

  // Three components; the first is the load's `first`.
  void ReadComponents(const YamlNode* node, const std::string& path, const char* unit, int first,
                      Load* load) {
    if (node == nullptr) return;
    const auto items = yaml().Items(*node, path, 3);
    if (!items) return;
    for (size_t i = 0; i < 3; ++i) {
      const std::string name = fmt::format("{}[{}]", path, i);
      if (functions_->Follows(*(*items)[i])) {
        const auto function = functions_->Read(*(*items)[i], name);
        if (function) load->following.push_back({first + static_cast<int>(i), *function});
        continue;
      }
      Profile& profile = first == 0 ? load->force[i] : load->moment[i];
      profile = ReadProfile(
          values_, *(*items)[i], name,
          {.unit = unit, .home = {}, .name = name, .may_jump = true, .tables = &tables_});
    }
  }

  // "body", "body.frame" or an output's name; bodies of instances have dots in their names.
  void ReadPlace(const YamlNode& node, const std::string& path, Load* load) {
    const auto text = yaml().Text(node, path + ".on");
    if (!text) return;
    std::vector<std::string> known;
    for (size_t b = 1; b < mechanism_.bodies.size(); ++b) {
      const Body& body = mechanism_.bodies[b];
      known.push_back(body.name);
      if (*text == body.name) load->body = static_cast<int>(b);
      for (const NamedFrame& frame : body.frames) {
        known.push_back(body.name + "." + frame.name);
        if (*text != known.back()) continue;
        load->body = static_cast<int>(b);
        load->p_BoQ_B = frame.X_BF.translation();
      }
    }
    for (const Output& output : mechanism_.outputs) {
      known.push_back(output.name);
      if (*text != output.name) continue;
      load->body = output.body;
      load->p_BoQ_B = output.X_BO.translation();
    }
    if (load->body > 0) return;
    yaml().Error(node,
                 fmt::format("{}.on = '{}' is not a body, frame or output of {}", path, *text,
                             mechanism_.name),
                 DidYouMean(*text, known));
  }

  ValueReader* values_;
  const Mechanism& mechanism_;
  const MotionTimes otherwise_;
  const PhaseMotion phase_;
  std::vector<NamedCoordinate> known_;
  std::optional<StateFunctions> functions_;
  ProfileTables tables_;
  Motion motion_;
  bool times_known_ = false;
};

}  // namespace

Motion ReadMotion(ValueReader* values, const Mechanism& mechanism, const MotionSections& sections,
                  const MotionTimes& otherwise, const PhaseMotion& phase, Diagnostics* files) {
  return MotionReader(values, mechanism, otherwise, phase, files).Read(sections);
}

}  // namespace mbv
