// Trace: a time grid with named channels, the one currency between the stages.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/types.h"

namespace mbv {

// Channels: what a recorded signal measures, of whom, and the name that files call it by.
//
// The rows in trace.cc are the only place where names are composed; no other code splits one.

/// What a channel measures.
enum class Quantity {
  kOwn,  ///< something of a closed form's own
  // Of a drive.
  kPosition,
  kVelocity,
  kAcceleration,
  kForce,
  kForceBand,  ///< half-width of the band that resting friction leaves the force
  kWork,       ///< since the start
  // Of a prescribed joint.
  kBaseForce,
  kBaseForceBand,
  kBaseWork,
  // Of an output, in its reference frame, one of kPoseComponents.
  kPose,
  kPoseVelocity,
  kPoseAcceleration,
  // Of a joint's coordinate without a drive.
  kJointPosition,
  kJointVelocity,
  kJointAcceleration,
  // Of a joint, in its frame F, one of kReactionComponents.
  kReaction,
  // Of the mechanism.
  kLoopGap,
  kLoopTwist,   ///< the gap of rotations
  kInputPower,  ///< drives, base, loads and dampers
  kEnergyRate,  ///< d/dt (kinetic + gravity + springs)
  kBasePower,   ///< the rest: parts of both
  kLoadPower,
  kDamperPower,
  kGravityPower,
  kSpringPower,
  kKineticEnergy,
  kGravityEnergy,  ///< from the world's origin
  kSpringEnergy,
  kLoadWork,
  kDamperWork,
  kCount_,  ///< how many there are
};

inline constexpr std::array<const char*, 6> kPoseComponents = {"x",    "y",     "z",
                                                               "roll", "pitch", "yaw"};
inline constexpr std::array<const char*, 6> kReactionComponents = {"fx", "fy", "fz",
                                                                   "mx", "my", "mz"};

/// One recorded signal.
struct Channel {
  std::string name;   ///< e.g. "limb1.drive.force"; what witnesses and files match channels by
  std::string unit;   ///< SI: "m", "rad", "m/s", "N", "N m", "W", …; "1" when dimensionless
  std::string frame;  ///< the frame its components are expressed in; empty for scalars
  Quantity quantity = Quantity::kOwn;
  /// Drive, prescribed joint, output, joint or its coordinate; "" of the mechanism.
  std::string subject = {};
  int component = -1;  ///< of a pose or a reaction
};

/// "limb1.drive.force", "platform.yaw.velocity", "hinge.reaction.fz", "power.base": never kOwn. A
/// component left out names all of them: "hinge.reaction".
[[nodiscard]] std::string ChannelName(Quantity quantity, const std::string& subject = "",
                                      int component = -1);
/// The channel with its name.
[[nodiscard]] Channel MakeChannel(Quantity quantity, const std::string& unit,
                                  const std::string& subject = "", const std::string& frame = "",
                                  int component = -1);
/// Of the mechanism: the unit follows from the quantity.
[[nodiscard]] Channel MakeChannel(Quantity quantity);

/// "fx", "yaw"; "force" of what has no components: the last word of the name.
[[nodiscard]] std::string SignalWord(const Channel& channel);

/// Where channels stand: columns by quantity, without searching. Recorders write by it.
class ChannelColumns {
 public:
  explicit ChannelColumns(const std::vector<Channel>& channels);

  /// The column of the k-th channel of this quantity, counted in the order in which they are
  /// recorded; components of one subject are neighbours: the reaction of joint j starts at 6 j.
  [[nodiscard]] int operator()(Quantity quantity, size_t k = 0) const {
    return columns_[static_cast<size_t>(quantity)][k];
  }
  [[nodiscard]] bool Has(Quantity quantity) const {
    return !columns_[static_cast<size_t>(quantity)].empty();
  }

 private:
  std::array<std::vector<int>, static_cast<size_t>(Quantity::kCount_)> columns_;
};

/// What a force element, or a force by an expression, does from an instant on, in a motion by
/// forces.
enum class Happening {
  kRests,        ///< dry friction: accelerations jump
  kSlidesUp,     ///< towards larger values of its coordinate
  kSlidesDown,   ///< towards smaller ones
  kSwitchedOff,  ///< a brake, a clutch
  kHitsUpper,    ///< a rigid stop: rates jump
  kHitsLower,
  kBranch,  ///< an expression, on another branch: it may jump
  kFree,    ///< a stop
  kUpperEnd,
  kLowerEnd,
  kKnot  ///< a curve, beyond one of its corners
};
struct MotionEvent {
  double time_s = kNan;
  std::string element = {};
  Happening what = Happening::kRests;

  /// True where accelerations may jump.
  [[nodiscard]] bool jumps() const { return what <= Happening::kBranch; }
};

[[nodiscard]] const char* ToText(Happening what);

/// Samples of channels on a common time grid. Witnesses sample at the same times, so traces are
/// compared without interpolation.
struct Trace {
  std::string witness;            ///< name of its role (base/roles.h)
  std::vector<double> time_s;     ///< n sample times [s], increasing
  std::vector<Channel> channels;  ///< m channels
  MatX values;                    ///< n × m
  /// Between the samples, in the order of their times.
  std::vector<MotionEvent> events = {};

  /// Column of the channel with this name, or -1.
  [[nodiscard]] int Find(const std::string& name) const;
  [[nodiscard]] int Find(Quantity quantity, const std::string& subject = "",
                         int component = -1) const {
    return Find(ChannelName(quantity, subject, component));
  }
  /// Sets channels and times and fills the values with NaN.
  void Reset(std::vector<double> times_s, std::vector<Channel> new_channels);
};

/// 0, dt, 2dt, … up to and including `duration_s` (n = round(duration/sample) + 1 samples; the
/// grid is i·sample_s, computed without accumulating).
[[nodiscard]] std::vector<double> SampleTimes(double duration_s, double sample_s);

}  // namespace mbv
