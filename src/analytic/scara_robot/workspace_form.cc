#include "analytic/scara_robot/workspace_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "analytic/scara_robot/workspace.h"

namespace mbv::scara {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// The side and the two ends of a vertical cylinder about the z axis.
TriangleMesh CylinderMesh(const CylinderSpace& space, int sides) {
  TriangleMesh mesh;
  for (double z : {space.z_bottom, space.z_top}) {
    mesh.vertices.push_back({0, 0, z});
    for (int k = 0; k < sides; ++k) {
      const double a = 2 * std::numbers::pi * k / sides;
      mesh.vertices.push_back({space.radius * std::cos(a), space.radius * std::sin(a), z});
    }
  }
  const int top = sides + 1;
  for (int k = 0; k < sides; ++k) {
    const int a = 1 + k, b = 1 + (k + 1) % sides;
    mesh.triangles.push_back({0, b, a});
    mesh.triangles.push_back({top, top + a, top + b});
    mesh.triangles.push_back({a, b, top + b});
    mesh.triangles.push_back({a, top + b, top + a});
  }
  return mesh;
}

void AddSlice(const Parameters& parameters, const Limits& limits, double z,
              WorkspaceForm* outcome) {
  constexpr double kHalfWidth = 0.15;
  constexpr int kCells = 61;
  const auto slice = MapSlice(parameters, limits, z, 0.0, kHalfWidth, kCells);
  MapPlot plot{.title = fmt::format("Smallest singular value, z = {:.0f} mm, yaw 0", 1e3 * z),
               .x_label = "x [m]",
               .y_label = "y [m]",
               .value_label = "s_min",
               .x_min = -kHalfWidth,
               .x_max = kHalfWidth,
               .y_min = -kHalfWidth,
               .y_max = kHalfWidth,
               .columns = kCells,
               .rows = kCells,
               .values = {},
               .log_scale = true};
  std::string csv = "x_m,y_m,z_m,yaw_rad,reachable,limb,excess,s_min,det\n";
  for (const PoseCheck& pose : slice) {
    const bool reached = pose.reach == Reach::kReachable;
    // Below 1e-4 the map shows one colour: on the singular lines the value is zero.
    plot.values.push_back(reached ? std::max(1e-4, pose.singularity.s_min) : kNan);
    csv += fmt::format("{:.17g},{:.17g},{:.17g},{:.17g},{},{},{:.17g},{:.17g},{:.17g}\n", pose.X[0],
                       pose.X[1], pose.X[2], pose.X[3], reached ? 1 : 0, pose.limb + 1, pose.excess,
                       pose.singularity.s_min, pose.singularity.det);
  }
  const std::string name = fmt::format("singularity_z{:.0f}mm", 1e3 * z);
  outcome->files.push_back({name + ".svg", plot});
  outcome->files.push_back({name + ".csv", csv});
}

// In a box that is large enough for a robot of any size.
Volume WholeVolume(const Parameters& parameters, const Limits& limits, double yaw, int jobs) {
  constexpr int kCells = 60, kMostTries = 12;
  constexpr std::uint64_t kSeed = 2019;
  Box3 box;
  Volume volume = EstimateVolume(parameters, limits, yaw, box, kCells, kSeed, jobs);
  for (int k = 0; k < kMostTries && volume.touches_box; ++k) {
    const Vec3 middle = 0.5 * (box.low + box.high), half = 0.75 * (box.high - box.low);
    box = {middle - half, middle + half};
    volume = EstimateVolume(parameters, limits, yaw, box, kCells, kSeed, jobs);
  }
  return volume;
}

}  // namespace

WorkspaceForm ComputeWorkspaceForm(const Mechanism& mechanism, const WorkspaceRequest& request) {
  WorkspaceForm outcome;
  outcome.summary = RunSummary::Done();
  const Parameters parameters = ParametersOf(mechanism);
  const Limits limits = LimitsOf(mechanism);
  const CylinderSpace space;
  outcome.text = fmt::format("The paper's cylinder, radius {:g} mm, z from {:g} to {:g} mm\n",
                             1e3 * space.radius, 1e3 * space.z_top, 1e3 * space.z_bottom);
  for (double yaw : {0.0, 45.0, -45.0}) {
    const CylinderCheck check = CheckCylinder(parameters, limits, space, yaw * kDegree, 14, 20, 72);
    const auto reached =
        std::count_if(check.poses.begin(), check.poses.end(),
                      [](const PoseCheck& pose) { return pose.reach == Reach::kReachable; });
    outcome.text += fmt::format(
        "  yaw {:g} deg: {} of {} poses reached; smallest V {:.3g} at ({:.1f}, {:.1f}, {:.1f}) "
        "mm\n",
        yaw, reached, check.poses.size(), check.V_min, 1e3 * check.X_at_V_min[0],
        1e3 * check.X_at_V_min[1], 1e3 * check.X_at_V_min[2]);
    for (size_t k = 0; k < check.layer_z.size(); ++k) {
      if (check.layer_reached[k] >= 1.0) continue;
      outcome.text += fmt::format("    z = {:.0f} mm: {:.1f} % reached\n", 1e3 * check.layer_z[k],
                                  100 * check.layer_reached[k]);
    }
  }
  for (double yaw : {0.0, 45.0}) {
    request.Tell(yaw > 0.0 ? 0.6 : 0.2);
    const Volume v = WholeVolume(parameters, limits, yaw * kDegree, request.jobs);
    if (v.lost) return LostWork();
    outcome.text += fmt::format(
        "reachable volume at yaw {:g} deg: {:.4e} +- {:.1e} m^3 (two standard "
        "errors, {} samples); {:.1f} % of it away from singular poses\n",
        yaw, v.volume_m3, v.uncertainty_m3, v.samples, 100 * v.fraction_usable);
  }
  for (double z : {-0.100, -0.165, -0.230}) AddSlice(parameters, limits, z, &outcome);
  outcome.mesh = CylinderMesh(space, 72);
  outcome.mesh_caption = "scara_robot / the paper's workspace cylinder";
  return outcome;
}

}  // namespace mbv::scara
