#include "pipeline/workspace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "analytic/closed_form.h"
#include "analytic/scara_robot/workspace.h"
#include "analytic/spr_tripod/workspace.h"
#include "pipeline/ranges.h"
#include "render/render.h"
#include "report/svg_plot.h"

namespace mbv {
namespace {

constexpr double kDeg = std::numbers::pi / 180.0;

// The mechanism at home inside a translucent mesh, seen from two sides.
RunSummary DrawInside(const Mechanism& mechanism, const TriangleMesh& mesh, const char* title,
                      WorkspaceOutcome* outcome) {
  PictureFrame frame = HomeFrame(mechanism);
  frame.caption.title = title;
  Overlay overlay;
  overlay.meshes.push_back({mesh.vertices, mesh.triangles, "#2f7ed880"});
  for (const auto& [name, azimuth, elevation] : {std::tuple{"workspace_front.png", 25.0, 15.0},
                                                 std::tuple{"workspace_below.png", 140.0, -20.0}}) {
    PictureOptions options;
    options.camera.azimuth_deg = azimuth;
    options.camera.elevation_deg = elevation;
    const RunSummary summary =
        RenderPictures(mechanism, {frame}, overlay, options, [&](int, Picture picture) {
          outcome->files.emplace_back(name, EncodePng(picture));
          return true;
        });
    if (!summary.ok()) return summary;
  }
  return RunSummary::Done();
}

std::string AxialSectionPlot(const spr_tripod::Geometry& geometry) {
  LinePlot plot{.title = "Sections through the z axis",
                .x_label = "distance from the axis [m]",
                .y_label = "z [m]",
                .equal_scale = true,
                .lines = {}};
  const auto [low, high] = spr_tripod::AxisRange(geometry);
  constexpr int kSteps = 280;
  std::vector<double> heights;
  for (int k = 0; k <= kSteps; ++k) heights.push_back(low + (high - low) * k / kSteps);
  for (double azimuth : {0.0, 30.0, 90.0}) {
    PlotLine line{.label = fmt::format("azimuth {:g} deg", azimuth), .points = {}, .closed = true};
    std::vector<std::pair<double, double>> back;
    for (const auto& limits : spr_tripod::AxialSection(geometry, azimuth * kDeg, heights)) {
      if (std::isnan(limits.rho_max)) continue;
      line.points.emplace_back(limits.rho_max, limits.z);
      back.emplace_back(limits.rho_min, limits.z);
    }
    line.points.insert(line.points.end(), back.rbegin(), back.rend());
    plot.lines.push_back(std::move(line));
  }
  return ToSvg(plot);
}

std::string HorizontalSectionPlot(const spr_tripod::Geometry& geometry,
                                  const std::vector<double>& heights) {
  LinePlot plot{.title = "Horizontal sections",
                .x_label = "x [m]",
                .y_label = "y [m]",
                .equal_scale = true,
                .lines = {}};
  for (double z : heights) {
    PlotLine line{.label = fmt::format("z = {:g} m", z), .points = {}, .closed = true};
    for (const Vec3& p : spr_tripod::HorizontalSection(geometry, z, 360)) {
      line.points.emplace_back(p.x(), p.y());
    }
    plot.lines.push_back(std::move(line));
  }
  return ToSvg(plot);
}

// Ranges of the joints besides the strokes; empty where none has one.
spr_tripod::PoseFilter JointFilter(const Mechanism& mechanism) {
  std::vector<int> body(mechanism.bodies.size(), -1);  // of the closed form's seven
  for (int k = 0; k < spr_tripod::kBodies; ++k) {
    const int leg = spr_tripod::LegOf(k);
    const std::string name =
        leg < 0
            ? "platform"
            : fmt::format("leg{}.{}", leg + 1, k == spr_tripod::CylinderBody(leg) ? "cyl" : "rod");
    const int found = mechanism.FindBody(name);
    if (found < 0) return {};
    body[static_cast<size_t>(found)] = k;
  }
  if (!HasRanges(mechanism)) return {};
  return [&mechanism, body](const spr_tripod::Posture& posture) {
    std::vector<Pose> X_WB(body.size(), Pose::Identity());
    for (size_t b = 0; b < body.size(); ++b) {
      if (body[b] >= 0) X_WB[b] = spr_tripod::BodyPose(posture, body[b]);
    }
    return IsWithinRanges(mechanism, X_WB);
  };
}

WorkspaceOutcome TripodWorkspace(const Mechanism& mechanism, bool pictures) {
  WorkspaceOutcome outcome;
  const spr_tripod::Geometry geometry = spr_tripod::ReadGeometry(mechanism, &outcome.diagnostics);
  if (outcome.diagnostics.has_errors()) return outcome;
  const spr_tripod::WorkspaceReport report =
      spr_tripod::ReportWorkspace(geometry, {.within_ranges = JointFilter(mechanism)});
  outcome.summary = report.summary;
  outcome.agree = report.contradictions.empty();
  outcome.text = report.text;
  if (!report.summary.ok()) return outcome;
  outcome.files.emplace_back("workspace.stl", ToStl(report.faces.mesh, "spr_tripod workspace [m]"));
  outcome.files.emplace_back("workspace.ply", ToPly(report.faces.mesh, "spr_tripod workspace [m]"));
  outcome.files.emplace_back("sections.csv", report.sections_csv);
  outcome.files.emplace_back("sections_axial.svg", AxialSectionPlot(geometry));
  outcome.files.emplace_back("sections_horizontal.svg",
                             HorizontalSectionPlot(geometry, report.heights));
  if (pictures) {
    outcome.summary = DrawInside(mechanism, report.faces.mesh,
                                 "spr_tripod / workspace of the platform centre", &outcome);
  }
  return outcome;
}

// The side and the two ends of a vertical cylinder about the z axis.
TriangleMesh CylinderMesh(const scara::CylinderSpace& space, int sides) {
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

void AddSlice(const scara::Parameters& parameters, const scara::Limits& limits, double z,
              WorkspaceOutcome* outcome) {
  constexpr double kHalfWidth = 0.15;
  constexpr int kCells = 61;
  const auto slice = scara::MapSlice(parameters, limits, z, 0.0, kHalfWidth, kCells);
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
  for (const scara::PoseCheck& pose : slice) {
    const bool reached = pose.reach == scara::Reach::kReachable;
    // Below 1e-4 the map shows one colour: on the singular lines the value is zero.
    plot.values.push_back(reached ? std::max(1e-4, pose.singularity.s_min) : kNan);
    csv += fmt::format("{:.17g},{:.17g},{:.17g},{:.17g},{},{},{:.17g},{:.17g},{:.17g}\n", pose.X[0],
                       pose.X[1], pose.X[2], pose.X[3], reached ? 1 : 0, pose.limb + 1, pose.excess,
                       pose.singularity.s_min, pose.singularity.det);
  }
  const std::string name = fmt::format("singularity_z{:.0f}mm", 1e3 * z);
  outcome->files.emplace_back(name + ".svg", ToSvg(plot));
  outcome->files.emplace_back(name + ".csv", csv);
}

// In a box that is large enough for a robot of any size.
scara::Volume WholeVolume(const scara::Parameters& parameters, const scara::Limits& limits,
                          double yaw) {
  constexpr int kCells = 60, kMostTries = 12;
  constexpr std::uint64_t kSeed = 2019;
  scara::Box3 box;
  scara::Volume volume = scara::EstimateVolume(parameters, limits, yaw, box, kCells, kSeed);
  for (int k = 0; k < kMostTries && volume.touches_box; ++k) {
    const Vec3 middle = 0.5 * (box.low + box.high), half = 0.75 * (box.high - box.low);
    box = {middle - half, middle + half};
    volume = scara::EstimateVolume(parameters, limits, yaw, box, kCells, kSeed);
  }
  return volume;
}

WorkspaceOutcome ScaraWorkspace(const Mechanism& mechanism, bool pictures) {
  WorkspaceOutcome outcome;
  outcome.summary = RunSummary::Done();
  const scara::Parameters parameters = scara::ParametersOf(mechanism);
  const scara::Limits limits = scara::LimitsOf(mechanism);
  const scara::CylinderSpace space;
  outcome.text = fmt::format("The paper's cylinder, radius {:g} mm, z from {:g} to {:g} mm\n",
                             1e3 * space.radius, 1e3 * space.z_top, 1e3 * space.z_bottom);
  for (double yaw : {0.0, 45.0, -45.0}) {
    const scara::CylinderCheck check =
        scara::CheckCylinder(parameters, limits, space, yaw * kDeg, 14, 20, 72);
    const auto reached = std::count_if(
        check.poses.begin(), check.poses.end(),
        [](const scara::PoseCheck& pose) { return pose.reach == scara::Reach::kReachable; });
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
    const scara::Volume v = WholeVolume(parameters, limits, yaw * kDeg);
    outcome.text += fmt::format(
        "reachable volume at yaw {:g} deg: {:.4e} +- {:.1e} m^3 (two standard "
        "errors, {} samples); {:.1f} % of it away from singular poses\n",
        yaw, v.volume_m3, v.uncertainty_m3, v.samples, 100 * v.fraction_usable);
  }
  for (double z : {-0.100, -0.165, -0.230}) AddSlice(parameters, limits, z, &outcome);
  if (pictures) {
    const RunSummary drawn = DrawInside(mechanism, CylinderMesh(space, 72),
                                        "scara_robot / the paper's workspace cylinder", &outcome);
    if (!drawn.ok()) outcome.summary = drawn;
  }
  return outcome;
}

// The workspace has no other witness: outside what the equations cover it is an error.
void RefuseUncovered(const Mechanism& mechanism, Diagnostics* diagnostics) {
  const ClosedFormRow* row = FindClosedForm(mechanism.name);
  if (row == nullptr || row->coverage == nullptr) return;
  for (Finding& finding :
       FindUncovered(row->coverage(mechanism), mechanism, Concern::kKinematics)) {
    finding.severity = Severity::kError;
    finding.file = mechanism.file;
    diagnostics->Add(std::move(finding));
  }
}

}  // namespace

std::vector<std::string> WorkspaceMechanisms() { return {"scara_robot", "spr_tripod"}; }

WorkspaceOutcome ComputeWorkspace(const Mechanism& mechanism, bool pictures) {
  WorkspaceOutcome refused;
  RefuseUncovered(mechanism, &refused.diagnostics);
  if (refused.diagnostics.has_errors()) return refused;
  if (mechanism.name == "spr_tripod") return TripodWorkspace(mechanism, pictures);
  if (mechanism.name == "scara_robot") return ScaraWorkspace(mechanism, pictures);
  WorkspaceOutcome outcome;
  outcome.summary.stop = Stop::kUnsupported;
  outcome.summary.message =
      fmt::format("no workspace is computed for '{}'; there is one for scara_robot and spr_tripod",
                  mechanism.name);
  return outcome;
}

}  // namespace mbv
