#include "kinematics/tilted_axis.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel_transport.h"
#include "kinematics/home.h"
#include "kinematics/mobility.h"

namespace mbv {
namespace {

// Angles between these are suspected: round-off is smaller, a drawing has larger ones.
constexpr double kSmallest_rad = 1e-9, kLargest_rad = 0.1;

bool IsHinge(const Joint& joint) {
  return joint.kind == JointKind::kRevolute || joint.kind == JointKind::kCylindrical;
}
bool HasOneAxis(const Joint& joint) {
  return IsHinge(joint) || joint.kind == JointKind::kPrismatic;
}

// The axis of a joint in a body that it connects.
Vec3 AxisOn(const Joint& joint, int body) {
  return (joint.parent == body ? joint.X_PF : joint.X_CM).linear() * joint.axis;
}

// Where the axis of `joint` would be beside that of `other`: parallel, or perpendicular if one
// slides and one turns.
Vec3 AlignedAxis(const Joint& joint, const Joint& other, int body) {
  const Vec3 own = AxisOn(joint, body), near = AxisOn(other, body);
  const Vec3 along = near * near.dot(own);
  return (IsHinge(joint) == IsHinge(other) ? along : Vec3(own - along)).normalized();
}

struct Suspicion {
  int joint, other, body;
  double angle_rad;
};

std::vector<Suspicion> Suspicions(const Mechanism& mechanism) {
  std::vector<Suspicion> found;
  const auto count = static_cast<int>(mechanism.joints.size());
  for (int j = 0; j < count; ++j) {
    for (int k = 0; k < count; ++k) {
      const Joint &a = mechanism.joints[j], &b = mechanism.joints[k];
      if (j == k || !HasOneAxis(a) || !HasOneAxis(b)) continue;
      for (const int body : {a.parent, a.child}) {
        if (body != b.parent && body != b.child) continue;
        const Vec3 own = AxisOn(a, body);
        const double angle = std::asin(std::min(1.0, own.cross(AlignedAxis(a, b, body)).norm()));
        if (angle > kSmallest_rad && angle < kLargest_rad) found.push_back({j, k, body, angle});
      }
    }
  }
  // The culprit misses its neighbours on both of its bodies.
  const auto misses = [&](int joint) {
    return std::count_if(found.begin(), found.end(),
                         [&](const Suspicion& s) { return s.joint == joint; });
  };
  std::stable_sort(found.begin(), found.end(), [&](const Suspicion& a, const Suspicion& b) {
    return misses(a.joint) > misses(b.joint);
  });
  return found;
}

// The joint with its axis turned to its neighbours' on every body where it misses one.
Mechanism WithAligned(const Mechanism& mechanism, int joint, const std::vector<Suspicion>& all) {
  Mechanism aligned = mechanism;
  Joint& own = aligned.joints[joint];
  for (const int body : {own.parent, own.child}) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const Suspicion& s) {
      return s.joint == joint && s.body == body;
    });
    if (found == all.end()) continue;
    const Vec3 to = AlignedAxis(own, aligned.joints[found->other], body);
    Pose& frame = own.parent == body ? own.X_PF : own.X_CM;
    frame.linear() = LeastRotation(AxisOn(own, body), to) * frame.linear();
  }
  return aligned;
}

int PassiveFreedoms(Mechanism mechanism) {
  mechanism.drives.clear();
  mechanism.prescribed.clear();
  return CountFreedoms(mechanism);
}

}  // namespace

std::optional<TiltedAxis> FindTiltedAxis(const Mechanism& mechanism, bool closed_at_home) {
  const std::vector<Suspicion> suspicions = Suspicions(mechanism);
  if (suspicions.empty()) return {};
  const int freedoms = closed_at_home ? PassiveFreedoms(mechanism) : 0;
  const auto driven = static_cast<int>(mechanism.drives.size() + mechanism.prescribed.size());
  if (closed_at_home && freedoms >= std::max(1, driven)) return {};
  int tried = -1;
  for (const Suspicion& s : suspicions) {
    if (s.joint == tried) continue;
    tried = s.joint;
    Mechanism aligned = WithAligned(mechanism, s.joint, suspicions);
    if (!SolveHome(&aligned).closed) continue;
    const int more = PassiveFreedoms(aligned);
    if (closed_at_home && more <= freedoms) continue;
    return TiltedAxis{s.joint, s.other, s.body, s.angle_rad, freedoms, more};
  }
  return {};
}

}  // namespace mbv
