#include "analytic/cabin_robot/reactions.h"

#include <cmath>

#include "mechanism/channels.h"

namespace mbv::cabin {
namespace {

double Planar(const Vec3& a, const Vec3& b) { return a.x() * b.y() - a.y() * b.x(); }

// The planar F with a × F = m and b × F = n.
Vec3 ForceOf(const Vec3& a, double m, const Vec3& b, double n) {
  return (m * b - n * a) / Planar(a, b);
}

// Of everything that a body carries, from it outwards along the chain of BodyIndex; about p.
BodyDemand Beyond(int first, const std::array<FrameMotion, kBodies>& frames, const Demands& demands,
                  const Vec3& p) {
  BodyDemand sum;
  for (int b = first; b < kBodies; ++b) {
    sum.force += demands[b].force;
    sum.moment += demands[b].moment + (frames[b].p - p).cross(demands[b].force);
  }
  return sum;
}

}  // namespace

Demands DemandsOf(const CabinGeometry& geometry, const std::array<FrameMotion, kBodies>& frames) {
  Demands demands;
  for (int b = 0; b < kBodies; ++b) {
    const BodyData& body = geometry.bodies[b];
    const FrameMotion& f = frames[b];
    const Vec3 r = f.R * body.com;
    const Mat3 I_W = f.R * body.inertia * f.R.transpose();
    const Vec3 a = f.a + f.e.cross(r) + f.w.cross(f.w.cross(r));
    demands[b].force = body.mass * (a - geometry.gravity);
    demands[b].moment = I_W * f.e + f.w.cross(I_W * f.w) + r.cross(demands[b].force);
  }
  return demands;
}

void TakeOff(const BodyWrench& wrench, const std::array<FrameMotion, kBodies>& frames,
             Demands* demands) {
  BodyDemand& demand = (*demands)[wrench.body];
  demand.force -= wrench.force_W;
  demand.moment -= wrench.moment_W + (frames[wrench.body].R * wrench.p_BoQ_B).cross(wrench.force_W);
}

HingeForces HingeForcesOf(const CabinGeometry& geometry,
                          const std::array<FrameMotion, kBodies>& frames, const Demands& demands) {
  const PlanarGeometry& g = geometry.planar;
  const auto &AB = frames[kAB], &CD = frames[kCD], &EF = frames[kEF], &K = frames[kPlatform];
  const Vec3 u = AB.R.col(0), half = g.L2 / 2.0 * K.R.col(0);
  const Vec3 p_B = AB.p + g.L1 * u;
  const BodyDemand P = Beyond(kPlatform, frames, demands, p_B);
  const Vec3 CB = 2.0 * half, DC = g.L3 * CD.R.col(0), FE = g.L4 * EF.R.col(0);
  HingeForces h;
  h.C = ForceOf(DC, -demands[kCD].moment.z(), CB, P.moment.z());  // (R1)
  h.B = P.force - h.C;                                            // (R2)
  h.E = ForceOf(FE, -demands[kEF].moment.z(), g.L1 / 2.0 * u,     // (R3)
                demands[kAB].moment.z() + Planar(g.L1 * u, h.B));
  h.A = demands[kAB].force + h.B - h.E;  // (R4)
  h.D = demands[kCD].force + h.C;
  h.F = demands[kEF].force + h.E;
  return h;
}

JointReactions::JointReactions(const Mechanism& mechanism) {
  Add(mechanism, "A", kSliderA, kAB, &HingeForces::A);
  Add(mechanism, "B", kAB, kPlatform, &HingeForces::B);
  Add(mechanism, "C", kCD, kPlatform, &HingeForces::C);
  Add(mechanism, "D", kSliderD, kCD, &HingeForces::D);
  Add(mechanism, "E", kEF, kAB, &HingeForces::E);
  Add(mechanism, "F", kSliderF, kEF, &HingeForces::F);
  Add(mechanism, "d1", -1, kCarriage, nullptr);
  Add(mechanism, "th3", kPlatform, kSupport, nullptr);
  Add(mechanism, "th4", kSupport, kFlip, nullptr);
  Add(mechanism, "d5", kFlip, kTable, nullptr);
  Add(mechanism, "th6", kTable, kSlewing, nullptr);
  Add(mechanism, "payload_mount", kSlewing, kPayload, nullptr);
}

void JointReactions::Add(const Mechanism& mechanism, const char* joint, int parent, int child,
                         Vec3 HingeForces::*hinge) {
  const int index = mechanism.FindJoint(joint);
  if (index < 0) return;
  const Joint& found = mechanism.joints[static_cast<size_t>(index)];
  const int parent_body = parent < 0 ? 0 : mechanism.FindBody(kBodyNames[parent]);
  if (found.parent != parent_body || found.child != mechanism.FindBody(kBodyNames[child])) return;
  Entry entry{.hinge = hinge, .child = child, .parent = parent, .R_PF = found.X_PF.linear()};
  const std::vector<Channel> all = ReactionChannels(found);
  for (int c = 0; c < 6; ++c) {
    if (hinge != nullptr) {
      // Along the hinge's axis the loop is redundant.
      entry.component[c] = c < 3 && std::abs(found.axis[c]) < 1e-9;
    } else {
      // The drive's own component is no reaction.
      const bool drive = found.kind == JointKind::kPrismatic  ? c < 3
                         : found.kind == JointKind::kRevolute ? c >= 3
                                                              : false;
      entry.component[c] = !(drive && std::abs(found.axis[c % 3]) > 1e-9);
    }
    if (entry.component[c]) channels_.push_back(all[static_cast<size_t>(c)]);
  }
  entries_.push_back(entry);
}

void JointReactions::Write(const CabinGeometry& geometry,
                           const std::array<FrameMotion, kBodies>& frames, const Demands& demands,
                           double* values) const {
  const HingeForces hinges = HingeForcesOf(geometry, frames, demands);
  for (const Entry& entry : entries_) {
    BodyDemand wrench;
    if (entry.hinge != nullptr) {
      wrench.force = hinges.*entry.hinge;
    } else {
      wrench = Beyond(entry.child, frames, demands, frames[entry.child].p);
    }
    const Mat3 R_WP = entry.parent < 0 ? Mat3(Mat3::Identity()) : frames[entry.parent].R;
    const Mat3 R_FW = (R_WP * entry.R_PF).transpose();
    const Vec3 f = R_FW * wrench.force, m = R_FW * wrench.moment;
    for (int c = 0; c < 6; ++c) {
      if (entry.component[c]) *values++ = c < 3 ? f[c] : m[c - 3];
    }
  }
}

}  // namespace mbv::cabin
