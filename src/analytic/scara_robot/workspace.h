// SCARA parallel robot: where it can go. Reachable region with the ranges of the motors and the
// parallelograms, singularity map, volume, and the paper's cylinder point by point.
// Results are data; nothing is drawn here. [Zhu 2019 §2.3, Fig. 8]
#pragma once

#include <cstdint>
#include <vector>

#include "analytic/scara_robot/velocity.h"
#include "analytic/workspace_form.h"

namespace mbv::scara_robot {

/// Ranges that bound the workspace [rad]; the default has none.
struct Limits {
  double theta_min = -std::numeric_limits<double>::infinity();
  double theta_max = std::numeric_limits<double>::infinity();
  double shear_max = std::numeric_limits<double>::infinity();  ///< |asin(η·a)| of every rod
};
/// theta_min, theta_max, shear_max of the model, as far as it has them.
[[nodiscard]] Limits LimitsOf(const Mechanism& mechanism);

enum class Reach {
  kReachable,
  kTooFar,      ///< an arm and its rod do not reach the pose (or cannot fold enough)
  kMotorRange,  ///< a drive angle is out of range
  kShear,       ///< a rod leans too far sideways
};

/// One pose judged.
struct PoseCheck {
  Vec4 X = Vec4::Constant(kNan);
  Reach reach = Reach::kTooFar;
  int limb = -1;        ///< first limb in trouble; -1 when reachable
  double excess = 0.0;  ///< by how much: m (kTooFar) or rad; 0 when reachable
  Vec4 theta = Vec4::Constant(kNan);
  double shear = kNan;      ///< largest |asin(η·a)| [rad]
  Singularity singularity;  ///< NaN when the limbs do not reach
};
[[nodiscard]] PoseCheck CheckPose(const Parameters& parameters, const Limits& limits,
                                  const Vec4& X);

/// A horizontal slice of n × n poses, row by row: x, y in ±half_width [m].
[[nodiscard]] std::vector<PoseCheck> MapSlice(const Parameters& parameters, const Limits& limits,
                                              double z, double phi, double half_width, int n);

/// Box in which the reachable volume is sampled [m].
struct Box3 {
  Vec3 low = Vec3(-0.25, -0.25, -0.40);
  Vec3 high = Vec3(0.25, 0.25, 0.20);
};

/// Reachable volume at one yaw by stratified random sampling.
struct Volume {
  double volume_m3 = kNan;
  double uncertainty_m3 = kNan;   ///< two standard errors
  double fraction_usable = kNan;  ///< of it: s_min ≥ kNearlySingular
  std::int64_t samples = 0, reached = 0;
  bool touches_box = false;  ///< reached in the outermost cells: there may be more beyond
  bool lost = false;         ///< a process that shared the work was killed: nothing is known
};
/// `cells` cells along each axis of the box, two samples per cell (their differences give the
/// standard error); > 0. The same seed gives the same numbers, whatever the number of jobs.
[[nodiscard]] Volume EstimateVolume(const Parameters& parameters, const Limits& limits, double phi,
                                    const Box3& box, int cells, std::uint64_t seed, int jobs = 1);

/// The workspace that the paper draws: radius 100 mm from z = −100 to −230 mm (its text says
/// 90 mm high; the faces that it evaluates are 130 mm apart).
struct CylinderSpace {
  double radius = 0.100;
  double z_top = -0.100, z_bottom = -0.230;
};

/// A cylinder checked on a polar grid: layers × (1 + rings × spokes) poses at one yaw.
struct CylinderCheck {
  std::vector<PoseCheck> poses;       ///< layer by layer from the top: centre, then ring by ring
  std::vector<double> layer_z;        ///< [m]
  std::vector<double> layer_reached;  ///< share of reachable poses per layer, 0 … 1
  bool complete = false;              ///< every pose reachable
  double V_min = kNan;                ///< smallest branch·V of the reachable poses
  Vec4 X_at_V_min = Vec4::Constant(kNan);
};
[[nodiscard]] CylinderCheck CheckCylinder(const Parameters& parameters, const Limits& limits,
                                          const CylinderSpace& cylinder, double phi, int layers,
                                          int rings, int spokes);

// The workspace of scara_robot for the workspace command.

/// The paper's cylinder point by point, volumes, singularity maps (CSV, SVG).
[[nodiscard]] WorkspaceForm ComputeWorkspaceForm(const Mechanism& mechanism,
                                                 const WorkspaceRequest& request);

}  // namespace mbv::scara_robot
