#include "analytic/stabilizing_platform/command_map.h"

#include <fmt/format.h>

#include <cmath>

namespace mbv::stabilizing_platform {
namespace {

constexpr std::array kShip = {"roll", "pitch", "heave"};
constexpr std::array kPose = {"x", "y", "z", "roll", "pitch", "yaw"};

constexpr const char* kHint =
    "command roll, pitch and heave, and either platform.z, platform.roll, platform.pitch with "
    "three "
    "equal pairs of drives, or all of platform.x, y, z, roll, pitch, yaw";

// Fills the entry of `map` that a command belongs to; false when there is none.
bool Place(const Mechanism& mechanism, const Command& command, int index, CommandMap* map) {
  using Kind = Coordinate::Kind;
  if (command.terms.size() == 1 && command.terms[0].factor == 1.0) {
    const Coordinate& c = command.terms[0].coordinate;
    if (c.kind == Kind::kPrescribed) {
      for (int k = 0; k < 3; ++k) {
        if (map->prescribed[k] != c.index) continue;
        map->ship[k] = index;
        return true;
      }
    }
    if (c.kind == Kind::kOutput && c.index == mechanism.FindOutput("platform")) {
      map->platform[c.component] = index;
      return true;
    }
  }
  if (command.terms.size() == 2 && command.terms[0].factor == -command.terms[1].factor) {
    const Coordinate &a = command.terms[0].coordinate, &b = command.terms[1].coordinate;
    if (a.kind != Kind::kDrive || b.kind != Kind::kDrive) return false;
    for (int i = 0; i < 3; ++i) {
      const int d = map->drives[2 * i], d_p = map->drives[2 * i + 1];
      if ((a.index != d || b.index != d_p) && (a.index != d_p || b.index != d)) continue;
      map->pair[i] = index;
      return true;
    }
  }
  return false;
}

Jet At(const CommandSample& sample, int index) {
  return {sample.position[index], sample.velocity[index], sample.acceleration[index]};
}

bool IsZero(const Jet& jet) {
  constexpr double kRoundoff = 1e-12;  // m, rad and their rates
  return std::abs(jet.value) <= kRoundoff && std::abs(jet.rate) <= kRoundoff &&
         std::abs(jet.acceleration) <= kRoundoff;
}

RunSummary Unsupported(const CommandSample& sample, std::string where, double amount,
                       const char* unit, const char* why) {
  return {.stop = Stop::kUnsupported,
          .message = fmt::format("{} = {:.6g} {}: {}", where, amount, unit, why),
          .time_s = sample.time_s,
          .where = where,
          .amount = amount,
          .unit = unit};
}

// Drives and prescribed joints by their names.
void FindDriven(const Mechanism& mechanism, CommandMap* map, Diagnostics* diagnostics) {
  for (int i = 0; i < 6; ++i) {
    const std::string name = fmt::format("limb{}.drive{}", i / 2 + 1, i % 2 == 0 ? "" : "_p");
    map->drives[i] = mechanism.FindDrive(name);
    if (map->drives[i] < 0) {
      diagnostics->AddError("", fmt::format("drives: \"{}\" is missing", name),
                            "the closed form finds the drives by name");
    }
  }
  if (mechanism.drives.size() != 6) {
    diagnostics->AddError(
        "", fmt::format("drives: {} drives violate the closed form's 6", mechanism.drives.size()),
        "the limbs have two drives each");
  }
  for (int k = 0; k < 3; ++k) {
    for (size_t j = 0; j < mechanism.prescribed.size(); ++j) {
      if (mechanism.prescribed[j].name == kShip[k]) map->prescribed[k] = static_cast<int>(j);
    }
    if (map->prescribed[k] < 0) {
      diagnostics->AddError("", fmt::format("prescribed: \"{}\" is missing", kShip[k]),
                            "the closed form finds the ship's motions by name");
    }
  }
}

}  // namespace

CommandMap MapCommands(const Mechanism& mechanism, const Motion& motion, Diagnostics* diagnostics) {
  CommandMap map;
  Diagnostics names;
  FindDriven(mechanism, &map, &names);
  if (mechanism.FindOutput("platform") < 0) {
    names.AddError("", "outputs: \"platform\" is missing", "it is the frame {p}");
  }
  diagnostics->Append(names);
  if (!names.empty()) return map;

  for (size_t k = 0; k < motion.commands.size(); ++k) {
    const Command& command = motion.commands[k];
    if (Place(mechanism, command, static_cast<int>(k), &map)) continue;
    diagnostics->AddError(
        "", fmt::format("motion: the closed form has no use for the command \"{}\"", command.name),
        kHint);
  }
  const bool whole_pose = map.platform[0] >= 0 || map.platform[1] >= 0 || map.platform[5] >= 0;
  map.pairs = whole_pose ? DrivePairs::kIndependent : DrivePairs::kSynchronous;
  auto require = [&](int index, const std::string& name) {
    if (index >= 0) return;
    diagnostics->AddError("", fmt::format("motion: \"{}\" is not commanded", name), kHint);
  };
  for (int k = 0; k < 3; ++k) require(map.ship[k], kShip[k]);
  for (int c = 0; c < 6; ++c) {
    const bool follows = !whole_pose && (c == 0 || c == 1 || c == 5);
    if (!follows) require(map.platform[c], std::string("platform.") + kPose[c]);
  }
  for (int i = 0; i < 3; ++i) {
    const std::string pair = fmt::format("limb{0}.drive - limb{0}.drive_p", i + 1);
    if (!whole_pose) require(map.pair[i], pair);
    if (whole_pose && map.pair[i] >= 0) {
      diagnostics->AddError("", fmt::format("motion: \"{}\" is commanded besides the pose", pair),
                            kHint);
    }
  }
  return map;
}

RunSummary ReadCommand(const CommandMap& map, const CommandSample& sample, PoseCommand* command) {
  command->roll = At(sample, map.ship[0]);
  command->pitch = At(sample, map.ship[1]);
  command->heave = At(sample, map.ship[2]);
  for (int c = 0; c < 6; ++c) {
    command->platform[c] = map.platform[c] >= 0 ? At(sample, map.platform[c]) : Jet{};
  }
  if (map.pairs == DrivePairs::kIndependent) return RunSummary::Done();
  for (int c : {3, 4}) {
    if (IsZero(command->platform[c])) continue;
    return Unsupported(sample, std::string("platform.") + kPose[c], command->platform[c].value,
                       "rad", "the parasitic motion is derived for a level platform");
  }
  for (int i = 0; i < 3; ++i) {
    const Jet difference = At(sample, map.pair[i]);
    if (IsZero(difference)) continue;
    return Unsupported(sample, fmt::format("limb{0}.drive - limb{0}.drive_p", i + 1),
                       difference.value, "m", "synchronous drives are equally long");
  }
  return RunSummary::Done();
}

std::vector<LoadPlace> MapLoads(const Mechanism& mechanism, const Motion& motion,
                                Diagnostics* diagnostics) {
  std::vector<LoadPlace> places;
  for (const Load& load : motion.loads) {
    const std::string& body = mechanism.bodies[load.body].name;
    LoadPlace place;
    bool known = body == "platform";
    for (const char* ship : {"ship", "ship_heave", "ship_roll", "lower_platform"}) {
      if (body == ship) known = place.on_ship = true;
    }
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 4; ++k) {
        if (body != fmt::format("limb{}.{}", i + 1, kLinkNames[k])) continue;
        place = {.limb = i, .link = k};
        known = true;
      }
    }
    if (!known) {
      diagnostics->AddError(
          "", fmt::format("loads: {}: the closed form knows no body \"{}\"", load.name, body),
          "loads may act on the platform, on links of the limbs and on the ship");
    }
    places.push_back(place);
  }
  return places;
}

}  // namespace mbv::stabilizing_platform
