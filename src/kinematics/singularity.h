// How far poses are from singular ones, and how near a motion comes to one.
//
//   V² = mean over the moving bodies of |v_c|² + (L ω)²      c: middle of the body's joints     (1)
//   A q̇ = 0    loops, couplings and idle spins hold; q̇: rates of the spanning tree's joints    (2)
//   inverse (type 1)     min |ẋ| / V  of motions (2)          x: commanded coordinates          (3)
//   forward (type 2)     min |ṁ| / V  of motions (2)          m: drives and prescribed joints   (4)
//   constraint           min |A q̇| / V  of q̇ that are V-orthogonal to all motions (2)           (5)
//
// Rates of angles and of rotations count by the characteristic length L. So all are ratios of
// speeds, which depend neither on the unit of length nor on frames of bodies and world; 0 is a
// singular pose of that type [Gosselin, Angeles 1990; Zlatanov, Bonev, Gosselin 2002]. By virtual
// work the drives answer a force at some body with up to 1/(4) times its size.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "math/trace.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

enum class SingularityKind { kInverse, kForward, kConstraint };
/// "inverse", "forward", "constraint".
[[nodiscard]] const char* ToText(SingularityKind kind);

/// A pose is close to a singular one below this distance: the drives answer a force with 50 times
/// its size, and bodies answer an error or a clearance of the drives as strongly.
inline constexpr double kCloseToSingular = 0.02;

/// Rates of the spanning tree up to which matrices are dense. Of more they are sparse, over the
/// rates of all bodies, and give the same distances.
inline constexpr int kMostDenseRates = 300;

class SingularityMeter {
 public:
  /// `x` are the coordinates of (3). The rank of (2) and (4) is the largest at home and at
  /// `poses`, a few of which are looked at. The mechanism outlives it.
  SingularityMeter(const Mechanism& mechanism, const std::vector<Command>& x,
                   const std::vector<std::vector<Pose>>& poses, int most_dense = kMostDenseRates);
  ~SingularityMeter();

  struct Distance {
    double value = kNan;  ///< NaN where it has no meaning
    int body = -1;        ///< moves most in that motion
  };
  /// By SingularityKind.
  [[nodiscard]] std::vector<Distance> At(const BodyStates& states) const;
  /// The characteristic length [m].
  [[nodiscard]] double length() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The least distance of a kind along a motion.
struct SingularApproach {
  SingularityKind kind = SingularityKind::kForward;
  double distance = kNan, time_s = kNan;
  double median = kNan;  ///< over the motion
  std::string body;      ///< moves most there
  /// The motion asks for what grows there: speeds of an inverse one where other coordinates than
  /// drives are commanded, forces of the others. Not of free motions, which pass.
  bool asked = true;
  /// The drive whose force grows most there; "" without forces: its largest force near, and the
  /// median of its forces over the motion [N or N m].
  std::string drive;
  std::string unit;
  double force_near = kNan, force_median = kNan;

  [[nodiscard]] bool close() const { return distance < kCloseToSingular; }
};

struct SingularApproaches {
  std::vector<SingularApproach> of;  ///< one for each kind that has a meaning
  double length_m = kNan;
  std::vector<std::string> inverse_of;  ///< names of the coordinates of (3)
  size_t poses = 0;                     ///< that were looked at
};

/// Along poses per sample. Evenly spaced ones are measured first, then all near the least. `forces`
/// of the drives at the same times; null: none.
[[nodiscard]] SingularApproaches ApproachesOf(const Mechanism& mechanism, const Motion& motion,
                                              const std::vector<double>& time_s,
                                              const std::vector<std::vector<Pose>>& X_WB,
                                              const Trace* forces);

}  // namespace mbv
