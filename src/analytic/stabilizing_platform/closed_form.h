// The stabilizing platform's closed form behind the common interface.
#pragma once

#include <array>
#include <vector>

#include "analytic/closed_form.h"
#include "analytic/coverage.h"
#include "analytic/stabilizing_platform/dynamics.h"
#include "base/diagnostics.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv::stabilizing_platform {

/// Factory for registry.cc. Needs the parameters listed in parameters.h, drives limb1.drive,
/// limb1.drive_p … limb3.drive_p, prescribed roll, pitch, heave, and an output "platform".
///
/// Commands: roll, pitch and heave, and either platform.z, platform.roll = 0, platform.pitch = 0
/// and three equal pairs of drives (synchronous, the paper's case), or all six of platform.x … yaw
/// (six independent drives). Loads may act on the platform and on links; those on the ship's
/// bodies do not change the drives. Anything else becomes a finding.
///
/// Extra channels: platform.* and platform_in_base.* poses; limbN.length, limbN.amplification
/// (synchronous only), limbN.f_X, .f_Y, .f_Z (force of the limb on the platform in {A_N}); and in
/// all models but paper_text the reactions of U1, U1_p, R12, R12_p, R22 and S that the isostatic
/// rule makes definite, where the mechanism has these joints.
[[nodiscard]] std::unique_ptr<ClosedForm> MakeClosedForm(const Mechanism& mechanism,
                                                         const Motion& motion,
                                                         const ClosedFormOptions& options,
                                                         Diagnostics* diagnostics);

// What the equations of the stabilizing platform take for granted.

/// Ship joints about fixed axes through the earth's origin; three equal limbs in planes through
/// their azimuths; links with principal axes along the link; rods without mass.
[[nodiscard]] Coverage CoverageOf(const Mechanism& mechanism);

// Where the closed form finds its inputs among a motion's commands and loads.

/// Indices into Motion::commands; −1 where not commanded.
struct CommandMap {
  DrivePairs pairs = DrivePairs::kSynchronous;
  std::array<int, 3> ship = {-1, -1, -1};  ///< roll, pitch, heave
  std::array<int, 6> platform = {-1, -1, -1, -1, -1, -1};
  std::array<int, 3> pair = {-1, -1, -1};                ///< difference of limb i's drives
  std::array<int, 6> drives = {-1, -1, -1, -1, -1, -1};  ///< into Mechanism::drives: 1, 1', 2, …
  std::array<int, 3> prescribed = {-1, -1, -1};          ///< into Mechanism::prescribed
};

/// Matches the motion to one of the two sets of commands; what does not fit becomes findings.
[[nodiscard]] CommandMap MapCommands(const Mechanism& mechanism, const Motion& motion,
                                     Diagnostics* diagnostics);

/// The commands at one instant. Fails with kUnsupported when a synchronous motion commands a
/// tilted platform or unequal drives.
[[nodiscard]] RunSummary ReadCommand(const CommandMap& map, const CommandSample& sample,
                                     PoseCommand* command);

/// Which body a load acts on, by its index in Motion::loads.
struct LoadPlace {
  bool on_ship = false;  ///< no effect on drives and limbs
  int limb = -1, link = 0;
};
[[nodiscard]] std::vector<LoadPlace> MapLoads(const Mechanism& mechanism, const Motion& motion,
                                              Diagnostics* diagnostics);

// Joint reactions of the limbs under the names and frames that all witnesses use.

/// Converts the limbs' forces to JOINT.reaction.* channels: wrench of the joint's parent on its
/// child about M's origin, in F's axes. Components along a joint's free axis are left out: they
/// are zero by definition. Under the isostatic rule R22 and S transmit forces only.
class ReactionChannelsOfLimbs {
 public:
  ReactionChannelsOfLimbs() = default;
  /// Uses those of the joints limbN.U1, U1_p, R12, R12_p, R22, S that the mechanism has.
  explicit ReactionChannelsOfLimbs(const Mechanism& mechanism);

  [[nodiscard]] const std::vector<Channel>& channels() const { return channels_; }
  /// Writes channels().size() values.
  void Write(const Evaluation& e, double* values) const;

 private:
  enum class Kind { kFoot, kElbow, kTip, kBall };
  struct Entry {
    Kind kind = Kind::kFoot;
    int limb = 0, side = 0;
    double sign = 1.0;            // −1 when the joint's child is the body nearer to the base
    bool parent_is_base = false;  // frame F lies on the lower platform or on the upper one …
    int parent_link = -1;         // … or on this link
    Mat3 R_PF = Mat3::Identity();
    std::vector<int> components;  // 0…5 of [f; m] in F
  };
  void AddLimb(const Mechanism& mechanism, int limb);
  void AddJoint(const Mechanism& mechanism, Entry entry, const std::string& name,
                const std::string& inner, const std::string& outer);

  std::vector<Entry> entries_;
  std::vector<Channel> channels_;
};

}  // namespace mbv::stabilizing_platform
