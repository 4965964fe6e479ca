#include "analytic/stabilizing_platform/reaction_channels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mechanism/channels.h"

namespace mbv::stabilizing_platform {
namespace {

int LinkIndex(const std::string& body, int limb) {
  for (int k = 0; k < 4; ++k) {
    if (body == fmt::format("limb{}.{}", limb + 1, kLinkNames[k])) return k;
  }
  return -1;
}

}  // namespace

ReactionChannelsOfLimbs::ReactionChannelsOfLimbs(const Mechanism& mechanism) {
  for (int limb = 0; limb < 3; ++limb) AddLimb(mechanism, limb);
}

void ReactionChannelsOfLimbs::AddLimb(const Mechanism& mechanism, int limb) {
  const std::string limb_name = fmt::format("limb{}.", limb + 1);
  auto add = [&](Kind kind, int side, const char* joint, const std::string& inner,
                 const std::string& outer) {
    Entry entry;
    entry.kind = kind;
    entry.limb = limb;
    entry.side = side;
    AddJoint(mechanism, std::move(entry), limb_name + joint, inner, outer);
  };
  const std::string link1 = limb_name + "link1", link1_p = limb_name + "link1_p";
  const std::string link2 = limb_name + "link2", link2_p = limb_name + "link2_p";
  add(Kind::kFoot, 0, "U1", "lower_platform", link1);
  add(Kind::kFoot, 1, "U1_p", "lower_platform", link1_p);
  add(Kind::kElbow, 0, "R12", link1, link2);
  add(Kind::kElbow, 1, "R12_p", link1_p, link2_p);
  add(Kind::kTip, 1, "R22", link2, link2_p);
  add(Kind::kBall, 0, "S", link2, "platform");
}

void ReactionChannelsOfLimbs::AddJoint(const Mechanism& mechanism, Entry entry,
                                       const std::string& name, const std::string& inner,
                                       const std::string& outer) {
  const int index = mechanism.FindJoint(name);
  if (index < 0) return;
  const Joint& joint = mechanism.joints[index];
  const std::string& parent = mechanism.bodies[joint.parent].name;
  const std::string& child = mechanism.bodies[joint.child].name;
  const bool reversed = parent == outer && child == inner;
  if (!reversed && (parent != inner || child != outer)) return;
  entry.sign = reversed ? -1.0 : 1.0;
  entry.parent_is_base = parent == "lower_platform";
  entry.parent_link = LinkIndex(parent, entry.limb);
  entry.R_PF = joint.X_PF.linear();
  const std::vector<Channel> all = ReactionChannels(joint);
  const bool with_moments = entry.kind == Kind::kFoot || entry.kind == Kind::kElbow;
  for (int c = 0; c < (with_moments ? 6 : 3); ++c) {
    // A joint does not transmit a moment about its (first) axis.
    if (c >= 3 && std::abs(joint.axis[c - 3]) > 1 - 1e-9) continue;
    entry.components.push_back(c);
    channels_.push_back(all[c]);
  }
  entries_.push_back(std::move(entry));
}

void ReactionChannelsOfLimbs::Write(const Evaluation& e, double* values) const {
  std::array<LimbReactions, 3> reactions;
  for (int i = 0; i < 3; ++i) {
    reactions[i] = ReactionsOf(e.geometry[i], e.required[i], e.forces[i]);
  }
  for (const Entry& entry : entries_) {
    const LimbForces& forces = e.forces[entry.limb];
    const Mat3& R_oA = e.limbs[entry.limb].R_oA;
    // Wrench of the inner on the outer body in {A_i}, [m; f].
    Vec3 m_A = Vec3::Zero(), f_A = Vec3::Zero();
    switch (entry.kind) {
      case Kind::kFoot:
        m_A = reactions[entry.limb].foot[entry.side].head<3>();
        f_A = reactions[entry.limb].foot[entry.side].tail<3>();
        break;
      case Kind::kElbow:
        m_A = reactions[entry.limb].elbow[entry.side].head<3>();
        f_A = reactions[entry.limb].elbow[entry.side].tail<3>();
        break;
      case Kind::kTip:
        f_A = forces.P[1];
        break;
      case Kind::kBall:
        f_A = forces.on_platform;
        break;
    }
    Mat3 R_AP;
    if (entry.parent_link >= 0) {
      R_AP = e.geometry[entry.limb].R_AL(entry.parent_link);
    } else if (entry.parent_is_base) {
      R_AP = R_oA.transpose();
    } else {
      R_AP = R_oA.transpose() * e.motion.R_op;
    }
    const Mat3 R_FA = (R_AP * entry.R_PF).transpose();
    const Vec3 f_F = entry.sign * (R_FA * f_A), m_F = entry.sign * (R_FA * m_A);
    for (int c : entry.components) *values++ = c < 3 ? f_F[c] : m_F[c - 3];
  }
}

}  // namespace mbv::stabilizing_platform
