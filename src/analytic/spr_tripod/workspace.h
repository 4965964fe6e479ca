// Reachable workspace of O_A under the leg limits [Mei 2012 §3], its measures and its sections.
//
// The paper bounds it by "leg-length approximation": six faces W1…W6, on each of which one leg
// keeps its shortest or longest length while the two others run over the stroke. That is right
// where q → O_A is one-to-one on the cube [q_min, q_max]³, i.e. det J > 0 there (checked). Four
// ways to the volume share nothing but the kinematics:
//   mesh        the faces, triangulated, by the divergence theorem: error ∝ step²
//   faces       the smooth faces, V = ⅓ ∮ r·(∂r/∂q_j × ∂r/∂q_k) dq_j dq_k, Gauss–Legendre
//   interior    V = ∫ dq / det J over the cube, Gauss–Legendre
//   voxels      counting the cells whose centre has an inverse solution within the limits
// Where two of them differ by more than their errors, the report says so (a contradiction).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "analytic/spr_tripod/dynamics.h"
#include "analytic/workspace_form.h"
#include "math/triangle_mesh.h"

namespace mbv::spr_tripod {

/// The six faces in the paper's order: W1 q1 = q_min, W2 q1 = q_max, W3 q2 = q_min, … W6.
inline constexpr int kFaces = 6;

/// The faces with shared edges, `intervals` steps along each leg (> 0): 2·intervals² triangles per
/// face, in the order W1…W6. Empty with a summary when a leg triple has no assembly.
struct WorkspaceMesh {
  TriangleMesh mesh;
  int intervals = 0;
  RunSummary summary;

  [[nodiscard]] double FaceArea(int face) const;  ///< of W1 (0) … W6 (5) [m²]
};
[[nodiscard]] WorkspaceMesh TriangulateFaces(const Geometry& geometry, int intervals);

/// Volume, areas and centroid of the smooth faces, `points`² Gauss points per face.
struct FaceIntegrals {
  SolidProperties solid;
  std::array<double, kFaces> face_area{};  ///< [m²]
};
[[nodiscard]] FaceIntegrals IntegrateFaces(const Geometry& geometry, int points);

/// ∫ dq/det J with `points`³ Gauss points [m³].
[[nodiscard]] double VolumeByInterior(const Geometry& geometry, int points);

/// Whether a pose counts, in addition to the stroke.
using PoseFilter = std::function<bool(const Posture&)>;

/// Cells of an axis-parallel box, `cells` along each side, whose centre is reachable.
struct Box3 {
  Vec3 lower = Vec3(-0.27, -0.27, 0.43), upper = Vec3(0.27, 0.27, 0.715);
};
struct VoxelCount {
  double volume = kNan;       ///< [m³]
  double uncertainty = kNan;  ///< four standard errors of the cells on the boundary [m³]
  double several = 0.0;       ///< of the volume: reached with several leg triples [m³]
  double filtered = 0.0;      ///< of the volume: what the filter lets pass [m³]
};
/// NaN where one of the `jobs` processes was killed; nothing else depends on their number.
[[nodiscard]] VoxelCount CountVoxels(const Geometry& geometry, int cells, const Box3& box = {},
                                     const PoseFilter& filter = {}, int jobs = 1,
                                     const std::function<void(double)>& progress = {});

/// The leg triples within the stroke that put O_A at r on the home branch (the assembly that the
/// forward problem finds): at most one where z > b/2.
[[nodiscard]] std::vector<Posture> PosturesAt(const Geometry& geometry, const Vec3& r);
[[nodiscard]] bool IsReachable(const Geometry& geometry, const Vec3& r);

/// How far O_A can go from the z axis at height z in the direction of `azimuth` [m]; NaN when the
/// axis itself is out of reach there. Accurate to 1e-12 m.
[[nodiscard]] double ReachAt(const Geometry& geometry, double z, double azimuth);

/// Points of the horizontal section at height z, `count` azimuths from 0 to 2π (exclusive).
[[nodiscard]] std::vector<Vec3> HorizontalSection(const Geometry& geometry, double z, int count);

/// One height of the section through the z axis at azimuth γ (the paper's Fig. 2 and 6).
struct AxialLimits {
  double z = 0.0;
  double rho_min = kNan, rho_max = kNan;  ///< signed distance from the axis along γ [m]
};
[[nodiscard]] std::vector<AxialLimits> AxialSection(const Geometry& geometry, double azimuth,
                                                    const std::vector<double>& heights);

/// Ranges over a grid of the cube, `intervals` steps along each leg.
struct Range {
  double lower = std::numeric_limits<double>::infinity();
  double upper = -std::numeric_limits<double>::infinity();
  void Add(double x) {
    lower = std::min(lower, x);
    upper = std::max(upper, x);
  }
};
struct WorkspaceRanges {
  Range x, y, z;           ///< of O_A [m]
  Range det, sigma, cond;  ///< of J: determinant, singular values, condition number
  Range det_c, cond_c;     ///< of the matrix of (12); |determinant| [m³]
  Range tilt;              ///< θ [rad]
  Range ball_swing;        ///< leg against its home direction [rad]
  Range ball_twist;        ///< leg about its own axis against home [rad]
  Range lean;              ///< inward lean of the legs in the platform against home [rad]
};
[[nodiscard]] WorkspaceRanges RangesOf(const Geometry& geometry, int intervals);

struct WorkspaceOptions {
  std::vector<int> mesh_intervals = {5, 10, 25, 50};  ///< refinements; the last one is returned
  int gauss_points = 12;  ///< > 4; the error of a volume is what 4 points fewer change
  int voxels = 80;        ///< cells per side; 0 leaves the count out
  std::vector<double> heights =
      {};  ///< of sections [m]; empty: round ones where the z axis is reached
  int section_azimuths = 180;
  PoseFilter within_ranges = {};  ///< of the joints other than the drives; empty: there are none
  int jobs = 1;                   ///< processes at once for the voxels
  std::function<void(double)> progress = {};  ///< of the voxels, which take nearly all the time
};

/// Heights between which (0, 0, z) is reached without tilt [m].
[[nodiscard]] Range AxisRange(const Geometry& geometry);
/// Round ones among them, about six.
[[nodiscard]] std::vector<double> RoundHeights(const Geometry& geometry);

/// A volume by one way [m³]; `error` is what coarser points change, or the count's uncertainty.
struct VolumeEstimate {
  std::string way;
  double value = kNan, error = kNan;
};

/// Everything a command needs: a text to read, the mesh, and the section curves.
struct WorkspaceReport {
  RunSummary summary;
  std::string text;                             ///< plain text, one finding per line
  WorkspaceMesh faces;                          ///< the finest mesh
  std::string sections_csv;                     ///< section,azimuth_rad,x_m,y_m,z_m
  SolidProperties exact;                        ///< from IntegrateFaces
  double area_error = kNan;                     ///< of `exact`: what fewer points change [m²]
  double centroid_error = kNan;                 ///< [m]
  std::array<double, kFaces> face_errors = {};  ///< [m²]
  std::vector<double> heights;                  ///< of the sections [m]
  std::vector<VolumeEstimate> volumes;          ///< faces, interior, mesh, voxels
  std::vector<std::string> contradictions;      ///< between them; empty: they agree
  double mesh_error = kNan;                     ///< finest mesh against the smooth faces [m³]
  double convergence_order = kNan;              ///< of the mesh volume in the step, 2 expected; NaN
                                                ///< where the faces' own error hides it
};
/// Volumes that differ by more than both errors, and signs that the faces are no boundary: det J
/// (`det`: its range over the stroke) not positive, meshes that do not converge with order 2.
[[nodiscard]] std::vector<std::string> Contradictions(const WorkspaceReport& report,
                                                      const Range& det);
[[nodiscard]] WorkspaceReport ReportWorkspace(const Geometry& geometry,
                                              const WorkspaceOptions& options = {});

// The workspace of spr_tripod for the workspace command.

/// The six faces (STL, PLY) and sections (CSV, SVG).
[[nodiscard]] WorkspaceForm ComputeWorkspaceForm(const Mechanism& mechanism,
                                                 const WorkspaceRequest& request);

}  // namespace mbv::spr_tripod
