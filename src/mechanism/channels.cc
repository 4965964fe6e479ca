#include "mechanism/channels.h"

#include "mechanism/motion.h"

namespace mbv {
namespace {

std::string PerTime(const std::string& unit, const char* power) { return unit + "/s" + power; }

std::string ForceUnit(const Mechanism& mechanism, const Prescribed& prescribed) {
  return IsLength(mechanism.joints[static_cast<size_t>(prescribed.joint)].kind, 0) ? "N" : "N m";
}

const char* PoseUnit(int component) { return component < 3 ? "m" : "rad"; }

}  // namespace

std::vector<Channel> DriveChannels(const Mechanism& mechanism) {
  std::vector<Channel> channels;
  for (const Drive& drive : mechanism.drives) {
    const std::string unit = PositionUnit(mechanism, drive);
    channels.push_back(MakeChannel(Quantity::kPosition, unit, drive.name));
    channels.push_back(MakeChannel(Quantity::kVelocity, PerTime(unit, ""), drive.name));
    channels.push_back(MakeChannel(Quantity::kAcceleration, PerTime(unit, "^2"), drive.name));
    channels.push_back(MakeChannel(Quantity::kForce, ForceUnit(mechanism, drive), drive.name));
  }
  return channels;
}

std::vector<Channel> PoseChannels(const std::string& output, const std::string& frame) {
  std::vector<Channel> channels;
  channels.reserve(6);
  for (int c = 0; c < 6; ++c) {
    channels.push_back(MakeChannel(Quantity::kPose, PoseUnit(c), output, frame, c));
  }
  return channels;
}

std::vector<Channel> OutputChannels(const Mechanism& mechanism) {
  std::vector<Channel> channels;
  for (const Output& output : mechanism.outputs) {
    const std::string& frame = mechanism.bodies[output.reference_body].name;
    for (Channel& channel : PoseChannels(output.name, frame)) {
      channels.push_back(std::move(channel));
    }
  }
  return channels;
}

std::vector<Channel> OutputRateChannels(const Mechanism& mechanism, const Output& output) {
  const std::string& frame = mechanism.bodies[output.reference_body].name;
  std::vector<Channel> channels;
  for (const auto& [quantity, power] :
       {std::pair{Quantity::kPoseVelocity, ""}, std::pair{Quantity::kPoseAcceleration, "^2"}}) {
    for (int c = 0; c < 6; ++c) {
      channels.push_back(MakeChannel(quantity, PerTime(PoseUnit(c), power), output.name, frame, c));
    }
  }
  return channels;
}

std::vector<Channel> JointChannels(const Mechanism& mechanism, const Coordinate& coordinate,
                                   bool rates) {
  const std::string name = NameOf(mechanism, coordinate);
  const std::string unit = CoordinateUnit(mechanism, coordinate);
  std::vector<Channel> channels = {MakeChannel(Quantity::kJointPosition, unit, name)};
  if (!rates) return channels;
  channels.push_back(MakeChannel(Quantity::kJointVelocity, PerTime(unit, ""), name));
  channels.push_back(MakeChannel(Quantity::kJointAcceleration, PerTime(unit, "^2"), name));
  return channels;
}

std::vector<Channel> PrescribedChannels(const Mechanism& mechanism) {
  std::vector<Channel> channels;
  for (const Prescribed& prescribed : mechanism.prescribed) {
    channels.push_back(
        MakeChannel(Quantity::kBaseForce, ForceUnit(mechanism, prescribed), prescribed.name));
  }
  return channels;
}

std::vector<Channel> BandChannels(const Mechanism& mechanism) {
  std::vector<Channel> channels;
  if (FirstFriction(mechanism).empty()) return channels;
  for (const Drive& drive : mechanism.drives) {
    channels.push_back(MakeChannel(Quantity::kForceBand, ForceUnit(mechanism, drive), drive.name));
  }
  for (const Prescribed& prescribed : mechanism.prescribed) {
    channels.push_back(
        MakeChannel(Quantity::kBaseForceBand, ForceUnit(mechanism, prescribed), prescribed.name));
  }
  return channels;
}

std::vector<Channel> ReactionChannels(const Joint& joint) {
  std::vector<Channel> channels;
  for (int c = 0; c < 6; ++c) {
    const char* unit = c < 3 ? "N" : "N m";
    channels.push_back(MakeChannel(Quantity::kReaction, unit, joint.name, joint.name, c));
  }
  return channels;
}

std::vector<Channel> AuditChannels() {
  std::vector<Channel> channels;
  for (const Quantity quantity :
       {Quantity::kLoopGap, Quantity::kLoopTwist, Quantity::kInputPower, Quantity::kEnergyRate,
        Quantity::kBasePower, Quantity::kLoadPower, Quantity::kDamperPower, Quantity::kGravityPower,
        Quantity::kSpringPower}) {
    channels.push_back(MakeChannel(quantity));
  }
  return channels;
}

std::vector<Channel> EnergyChannels() {
  return {MakeChannel(Quantity::kKineticEnergy), MakeChannel(Quantity::kGravityEnergy),
          MakeChannel(Quantity::kSpringEnergy)};
}

std::vector<Channel> WorkChannels(const Mechanism& mechanism) {
  std::vector<Channel> channels;
  for (const Drive& drive : mechanism.drives) {
    channels.push_back(MakeChannel(Quantity::kWork, "J", drive.name));
  }
  for (const Prescribed& base : mechanism.prescribed) {
    channels.push_back(MakeChannel(Quantity::kBaseWork, "J", base.name));
  }
  channels.push_back(MakeChannel(Quantity::kLoadWork));
  channels.push_back(MakeChannel(Quantity::kDamperWork));
  return channels;
}

size_t MostChannels(const Mechanism& mechanism, const Motion& motion) {
  constexpr size_t kPerReaction = 6, kPerCoordinate = 3;
  return DriveChannels(mechanism).size() + OutputChannels(mechanism).size() +
         PrescribedChannels(mechanism).size() + BandChannels(mechanism).size() +
         kPerReaction * mechanism.joints.size() + AuditChannels().size() + EnergyChannels().size() +
         WorkChannels(mechanism).size() + kPerCoordinate * motion.RecordedJoints().size();
}

}  // namespace mbv
