// Joint reactions of the limbs under the names and frames that all witnesses use.
#pragma once

#include <vector>

#include "analytic/stabilizing_platform/equations.h"
#include "core/trace.h"
#include "mechanism/mechanism.h"

namespace mbv::stabilizing_platform {

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
