#include "math/trace.h"

#include <cmath>

#include "base/demand.h"

namespace mbv {

namespace {

enum class Subject { kNone, kDrive, kBase, kOutput, kCoordinate, kJoint, kMechanism };

struct QuantityRow {
  Quantity quantity;
  Subject subject;
  const char* word;  // in the name
  const char* unit;  // of the mechanism's
};

constexpr QuantityRow kQuantities[] = {
    {Quantity::kOwn, Subject::kNone, "", ""},
    {Quantity::kPosition, Subject::kDrive, "position", ""},
    {Quantity::kVelocity, Subject::kDrive, "velocity", ""},
    {Quantity::kAcceleration, Subject::kDrive, "acceleration", ""},
    {Quantity::kForce, Subject::kDrive, "force", ""},
    {Quantity::kForceBand, Subject::kDrive, "force.band", ""},
    {Quantity::kWork, Subject::kDrive, "work", ""},
    {Quantity::kBaseForce, Subject::kBase, "force", ""},
    {Quantity::kBaseForceBand, Subject::kBase, "force.band", ""},
    {Quantity::kBaseWork, Subject::kBase, "work", ""},
    {Quantity::kPose, Subject::kOutput, "", ""},
    {Quantity::kPoseVelocity, Subject::kOutput, "velocity", ""},
    {Quantity::kPoseAcceleration, Subject::kOutput, "acceleration", ""},
    {Quantity::kJointPosition, Subject::kCoordinate, "position", ""},
    {Quantity::kJointVelocity, Subject::kCoordinate, "velocity", ""},
    {Quantity::kJointAcceleration, Subject::kCoordinate, "acceleration", ""},
    {Quantity::kReaction, Subject::kJoint, "reaction", ""},
    {Quantity::kLoopGap, Subject::kMechanism, "closure.position", "m"},
    {Quantity::kLoopTwist, Subject::kMechanism, "closure.rotation", "rad"},
    {Quantity::kInputPower, Subject::kMechanism, "power.input", "W"},
    {Quantity::kEnergyRate, Subject::kMechanism, "power.energy_rate", "W"},
    {Quantity::kBasePower, Subject::kMechanism, "power.base", "W"},
    {Quantity::kLoadPower, Subject::kMechanism, "power.loads", "W"},
    {Quantity::kDamperPower, Subject::kMechanism, "power.dampers", "W"},
    {Quantity::kGravityPower, Subject::kMechanism, "power.gravity", "W"},
    {Quantity::kSpringPower, Subject::kMechanism, "power.springs", "W"},
    {Quantity::kKineticEnergy, Subject::kMechanism, "energy.kinetic", "J"},
    {Quantity::kGravityEnergy, Subject::kMechanism, "energy.gravity", "J"},
    {Quantity::kSpringEnergy, Subject::kMechanism, "energy.springs", "J"},
    {Quantity::kLoadWork, Subject::kMechanism, "loads.work", "J"},
    {Quantity::kDamperWork, Subject::kMechanism, "dampers.work", "J"},
};
static_assert(std::size(kQuantities) == static_cast<size_t>(Quantity::kCount_));

const QuantityRow& QuantityRowOf(Quantity quantity) {
  const QuantityRow& row = kQuantities[static_cast<size_t>(quantity)];
  MBV_DEMAND(row.quantity == quantity, row.word);
  return row;
}

std::string Point(const std::string& word) { return word.empty() ? "" : "." + word; }

std::string ComponentWord(const std::array<const char*, 6>& words, int component) {
  return component < 0 ? "" : words.at(static_cast<size_t>(component));
}

}  // namespace

std::string ChannelName(Quantity quantity, const std::string& subject, int component) {
  const QuantityRow& row = QuantityRowOf(quantity);
  switch (row.subject) {
    case Subject::kNone:
      break;
    case Subject::kDrive:
    case Subject::kBase:
    case Subject::kCoordinate:
      return subject + Point(row.word);
    case Subject::kOutput:
      return subject + Point(ComponentWord(kPoseComponents, component)) + Point(row.word);
    case Subject::kJoint:
      return subject + Point(row.word) + Point(ComponentWord(kReactionComponents, component));
    case Subject::kMechanism:
      return row.word;
  }
  MBV_DEMAND(false, subject);
  return "";
}

Channel MakeChannel(Quantity quantity, const std::string& unit, const std::string& subject,
                    const std::string& frame, int component) {
  return {ChannelName(quantity, subject, component), unit, frame, quantity, subject, component};
}

Channel MakeChannel(Quantity quantity) {
  return MakeChannel(quantity, QuantityRowOf(quantity).unit);
}

std::string SignalWord(const Channel& channel) {
  const QuantityRow& row = QuantityRowOf(channel.quantity);
  switch (row.subject) {
    case Subject::kNone:
      return channel.name;
    case Subject::kDrive:
    case Subject::kBase:
    case Subject::kCoordinate:
    case Subject::kMechanism:
      return row.word;
    case Subject::kOutput:
      return *row.word == '\0' ? ComponentWord(kPoseComponents, channel.component) : row.word;
    case Subject::kJoint:
      return ComponentWord(kReactionComponents, channel.component);
  }
  return "";
}

ChannelColumns::ChannelColumns(const std::vector<Channel>& channels) {
  for (size_t c = 0; c < channels.size(); ++c) {
    columns_[static_cast<size_t>(channels[c].quantity)].push_back(static_cast<int>(c));
  }
}

const char* ToText(Happening what) {
  constexpr std::array<const char*, 11> kWords = {
      "rests",          "slides up",      "slides down",  "switched off",
      "hits upper end", "hits lower end", "other branch", "free",
      "at upper end",   "at lower end",   "passes knot"};
  return kWords.at(static_cast<size_t>(what));
}

int Trace::Find(const std::string& name) const {
  for (size_t i = 0; i < channels.size(); ++i) {
    if (channels[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

void Trace::Reset(std::vector<double> times_s, std::vector<Channel> new_channels) {
  time_s = std::move(times_s);
  channels = std::move(new_channels);
  values.setConstant(static_cast<Eigen::Index>(time_s.size()),
                     static_cast<Eigen::Index>(channels.size()), kNan);
}

std::vector<double> SampleTimes(double duration_s, double sample_s) {
  const auto intervals = static_cast<size_t>(std::floor(duration_s / sample_s + 1e-9));
  std::vector<double> times(intervals + 1);
  for (size_t i = 0; i < times.size(); ++i) times[i] = static_cast<double>(i) * sample_s;
  return times;
}

}  // namespace mbv
