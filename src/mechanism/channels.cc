#include "mechanism/channels.h"

namespace mbv {
namespace {

std::string PerTime(const std::string& unit, const char* power) { return unit + "/s" + power; }

}  // namespace

std::vector<Channel> DriveChannels(const Mechanism& mechanism) {
  std::vector<Channel> channels;
  for (const Drive& drive : mechanism.drives) {
    const std::string unit = PositionUnit(mechanism, drive);
    channels.push_back({drive.name + ".position", unit, ""});
    channels.push_back({drive.name + ".velocity", PerTime(unit, ""), ""});
    channels.push_back({drive.name + ".acceleration", PerTime(unit, "^2"), ""});
    channels.push_back({drive.name + ".force", ForceUnit(mechanism, drive), ""});
  }
  return channels;
}

std::vector<Channel> OutputChannels(const Mechanism& mechanism) {
  std::vector<Channel> channels;
  for (const Output& output : mechanism.outputs) {
    const std::string frame = mechanism.bodies[output.reference_body].name;
    for (const char* c : {"x", "y", "z"}) channels.push_back({output.name + "." + c, "m", frame});
    for (const char* c : {"roll", "pitch", "yaw"}) {
      channels.push_back({output.name + "." + c, "rad", frame});
    }
  }
  return channels;
}

std::vector<Channel> OutputRateChannels(const Mechanism& mechanism, const Output& output) {
  const std::string frame = mechanism.bodies[output.reference_body].name;
  std::vector<Channel> channels;
  for (const auto& [signal, power] : {std::pair{".velocity", ""}, {".acceleration", "^2"}}) {
    for (const char* c : {"x", "y", "z", "roll", "pitch", "yaw"}) {
      const char* unit = std::string(c).size() == 1 ? "m" : "rad";
      channels.push_back({output.name + "." + c + signal, PerTime(unit, power), frame});
    }
  }
  return channels;
}

std::vector<Channel> PrescribedChannels(const Mechanism& mechanism) {
  std::vector<Channel> channels;
  for (const Prescribed& prescribed : mechanism.prescribed) {
    const Joint& joint = mechanism.joints[prescribed.joint];
    const char* unit = IsLength(joint.kind, 0) ? "N" : "N m";
    channels.push_back({prescribed.name + ".force", unit, ""});
  }
  return channels;
}

std::vector<Channel> ReactionChannels(const Joint& joint) {
  std::vector<Channel> channels;
  for (const char* c : {"fx", "fy", "fz"}) {
    channels.push_back({joint.name + ".reaction." + c, "N", joint.name});
  }
  for (const char* c : {"mx", "my", "mz"}) {
    channels.push_back({joint.name + ".reaction." + c, "N m", joint.name});
  }
  return channels;
}

std::vector<Channel> AuditChannels() {
  return {
      {"closure.position", "m", ""},  {"closure.rotation", "rad", ""}, {"power.input", "W", ""},
      {"power.energy_rate", "W", ""}, {"power.base", "W", ""},         {"power.loads", "W", ""},
      {"power.dampers", "W", ""},     {"power.gravity", "W", ""},      {"power.springs", "W", ""}};
}

std::vector<Channel> EnergyChannels() {
  return {{"energy.kinetic", "J", ""}, {"energy.gravity", "J", ""}, {"energy.springs", "J", ""}};
}

std::vector<Channel> WorkChannels(const Mechanism& mechanism) {
  std::vector<Channel> channels;
  for (const Drive& drive : mechanism.drives) channels.push_back({drive.name + ".work", "J", ""});
  for (const Prescribed& base : mechanism.prescribed) {
    channels.push_back({base.name + ".work", "J", ""});
  }
  channels.push_back({"loads.work", "J", ""});
  channels.push_back({"dampers.work", "J", ""});
  return channels;
}

}  // namespace mbv
