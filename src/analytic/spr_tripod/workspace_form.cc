#include "analytic/spr_tripod/workspace_form.h"

#include <fmt/format.h>

#include <numbers>

#include "analytic/spr_tripod/workspace.h"

namespace mbv::spr_tripod {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

LinePlot AxialSectionPlot(const Geometry& geometry) {
  LinePlot plot{.title = "Sections through the z axis",
                .x_label = "distance from the axis [m]",
                .y_label = "z [m]",
                .equal_scale = true,
                .lines = {}};
  const auto [low, high] = AxisRange(geometry);
  constexpr int kSteps = 280;
  std::vector<double> heights;
  for (int k = 0; k <= kSteps; ++k) heights.push_back(low + (high - low) * k / kSteps);
  for (double azimuth : {0.0, 30.0, 90.0}) {
    PlotLine line{.label = fmt::format("azimuth {:g} deg", azimuth), .points = {}, .closed = true};
    std::vector<std::pair<double, double>> back;
    for (const auto& limits : AxialSection(geometry, azimuth * kDegree, heights)) {
      if (std::isnan(limits.rho_max)) continue;
      line.points.emplace_back(limits.rho_max, limits.z);
      back.emplace_back(limits.rho_min, limits.z);
    }
    line.points.insert(line.points.end(), back.rbegin(), back.rend());
    plot.lines.push_back(std::move(line));
  }
  return plot;
}

LinePlot HorizontalSectionPlot(const Geometry& geometry, const std::vector<double>& heights) {
  LinePlot plot{.title = "Horizontal sections",
                .x_label = "x [m]",
                .y_label = "y [m]",
                .equal_scale = true,
                .lines = {}};
  for (double z : heights) {
    PlotLine line{.label = fmt::format("z = {:g} m", z), .points = {}, .closed = true};
    for (const Vec3& p : HorizontalSection(geometry, z, 360)) {
      line.points.emplace_back(p.x(), p.y());
    }
    plot.lines.push_back(std::move(line));
  }
  return plot;
}

// Ranges of the joints besides the strokes; empty where none has one.
PoseFilter JointFilter(const Mechanism& mechanism, const RangeFilter& within_ranges) {
  std::vector<int> body(mechanism.bodies.size(), -1);  // of the closed form's seven
  for (int k = 0; k < kBodies; ++k) {
    const int leg = LegOf(k);
    const std::string name =
        leg < 0 ? "platform"
                : fmt::format("leg{}.{}", leg + 1, k == CylinderBody(leg) ? "cyl" : "rod");
    const int found = mechanism.FindBody(name);
    if (found < 0) return {};
    body[static_cast<size_t>(found)] = k;
  }
  if (!within_ranges) return {};
  return [within_ranges, body](const Posture& posture) {
    std::vector<Pose> X_WB(body.size(), Pose::Identity());
    for (size_t b = 0; b < body.size(); ++b) {
      if (body[b] >= 0) X_WB[b] = BodyPose(posture, body[b]);
    }
    return within_ranges(X_WB);
  };
}

}  // namespace

WorkspaceForm ComputeWorkspaceForm(const Mechanism& mechanism, const WorkspaceRequest& request) {
  WorkspaceForm outcome;
  const Geometry geometry = ReadGeometry(mechanism, &outcome.diagnostics);
  if (outcome.diagnostics.has_errors()) return outcome;
  const WorkspaceReport report =
      ReportWorkspace(geometry, {.within_ranges = JointFilter(mechanism, request.within_ranges),
                                 .jobs = request.jobs,
                                 .progress = request.progress});
  outcome.summary = report.summary;
  outcome.agree = report.contradictions.empty();
  outcome.text = report.text;
  for (const VolumeEstimate& v : report.volumes) {
    outcome.measures.push_back({"volume by " + std::string(v.way), v.value, v.error, "m3"});
  }
  outcome.measures.push_back({"area", report.exact.area, kNan, "m2"});
  for (const int k : {0, 1, 2}) {
    const std::string axis(1, "xyz"[k]);
    outcome.measures.push_back({"centroid " + axis, report.exact.centroid[k], kNan, "m"});
  }
  if (!report.summary.ok()) return outcome;
  outcome.files.push_back({"workspace.stl", ToStl(report.faces.mesh, "spr_tripod workspace [m]")});
  outcome.files.push_back({"workspace.ply", ToPly(report.faces.mesh, "spr_tripod workspace [m]")});
  outcome.files.push_back({"sections.csv", report.sections_csv});
  outcome.files.push_back({"sections_axial.svg", AxialSectionPlot(geometry)});
  outcome.files.push_back(
      {"sections_horizontal.svg", HorizontalSectionPlot(geometry, report.heights)});
  outcome.mesh = report.faces.mesh;
  outcome.mesh_caption = "spr_tripod / workspace of the platform centre";
  return outcome;
}

}  // namespace mbv::spr_tripod
