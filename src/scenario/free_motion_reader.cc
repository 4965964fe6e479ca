#include "scenario/free_motion_reader.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/channel.h"
#include "core/text.h"
#include "core/word_hints.h"
#include "kinematics/command_rank.h"
#include "kinematics/mobility_report.h"
#include "scenario/motion_reader.h"
#include "scenario/profile_reader.h"

namespace mbv {
namespace {

constexpr size_t kMostNames = 12;  // in one message

// Joint coordinates by name: JOINT, or JOINT.0, JOINT.1 … where a joint has several.
std::vector<NamedCoordinate> JointCoordinates(const Mechanism& mechanism) {
  std::vector<NamedCoordinate> named;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    const int freedoms = FreedomsOf(joint.kind);
    for (int c = 0; c < freedoms; ++c) {
      named.push_back({freedoms == 1 ? joint.name : fmt::format("{}.{}", joint.name, c),
                       {Coordinate::Kind::kJoint, static_cast<int>(j), c}});
    }
  }
  return named;
}

Command AsCommand(const std::string& name, const Coordinate& coordinate) {
  return {.name = name, .terms = {{coordinate, 1.0}}, .profile = {}};
}

class FreeMotionReader {
 public:
  FreeMotionReader(ValueReader* values, const Mechanism& mechanism, ProfileTables* tables,
                   Motion* motion)
      : values_(values), mechanism_(mechanism), tables_(tables), motion_(motion) {
    for (NamedCoordinate& named : StateCoordinates(mechanism)) known_.push_back(std::move(named));
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

  // Guided coordinates must be drives or prescribed joints themselves.
  void CheckCommands(const YamlNode& node) {
    for (const Command& command : motion_->commands) {
      const bool plain = command.terms.size() == 1 &&
                         command.terms[0].coordinate.kind != Coordinate::Kind::kOutput;
      if (plain) continue;
      yaml().Error(node,
                   fmt::format("motion: '{}' is commanded, but where some freedoms move by forces, "
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
                                   .tables = tables_};
      motion_->forces.push_back(
          {drive, ReadProfile(values_, *entry.value, "forces." + entry.key, context)});
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

  // As many start values as freedoms that no command holds.
  void Complete(const YamlNode& node) {
    const int freedoms = ReportMobility(mechanism_).freedoms();
    const auto commands = static_cast<int>(motion_->commands.size());
    const int free = freedoms - commands;
    if (free <= 0) {
      yaml().Error(node,
                   fmt::format("motion commands {} of {} freedoms, so no freedom is left to forces",
                               commands, freedoms),
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
                               names.empty() ? "more are given than there are freedoms"
                                             : Joined(names, kMostNames)),
                   fmt::format("{} has {} freedoms, {} of them commanded: leave out {}",
                               mechanism_.name, freedoms, commands, rank.redundant));
      return;
    }
    std::vector<Command> candidates;
    const std::vector<NamedCoordinate> joints = JointCoordinates(mechanism_);
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
  ProfileTables* tables_;
  Motion* motion_;
  std::vector<NamedCoordinate> known_;
};

}  // namespace

std::vector<NamedCoordinate> StateCoordinates(const Mechanism& mechanism) {
  std::vector<NamedCoordinate> named;
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    named.push_back({mechanism.drives[d].name, {Coordinate::Kind::kDrive, static_cast<int>(d), 0}});
  }
  for (size_t o = 0; o < mechanism.outputs.size(); ++o) {
    int component = 0;
    for (const char* c : kPoseComponents) {
      named.push_back({mechanism.outputs[o].name + "." + c,
                       {Coordinate::Kind::kOutput, static_cast<int>(o), component++}});
    }
  }
  for (NamedCoordinate& joint : JointCoordinates(mechanism)) named.push_back(std::move(joint));
  return named;
}

bool IsFree(const YamlNode* motion, const YamlNode* forces) {
  if (forces != nullptr) return true;
  return motion != nullptr && motion->is_map() &&
         (motion->Find("initial") != nullptr || motion->Find("initial_rates") != nullptr);
}

void ReadFreeMotion(ValueReader* values, const Mechanism& mechanism, const YamlNode& motion_node,
                    const YamlNode* forces, ProfileTables* tables, Motion* motion) {
  FreeMotionReader(values, mechanism, tables, motion).Read(motion_node, forces);
}

}  // namespace mbv
