#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "analytic/spr_tripod/workspace.h"

namespace mbv::spr_tripod {
namespace {

using std::numbers::pi;
constexpr double kDeg = pi / 180.0;

// Rounding noise about zero would print as -0.000000000 on one machine and +0.000000000 on another.
double Clean(double x) { return std::abs(x) < 5e-10 ? 0.0 : x; }

// Volumes of the refined meshes; fills the finest mesh and the order of convergence.
std::string MeshTable(const Geometry& geometry, const WorkspaceOptions& options,
                      WorkspaceReport* report) {
  std::string text = "step_m      mesh_volume_m3       error_m3\n";
  double previous_error = kNan, previous_step = kNan;
  for (int intervals : options.mesh_intervals) {
    report->faces = TriangulateFaces(geometry, intervals);
    if (!report->faces.summary.ok()) return {};
    const double step = (geometry.q_max - geometry.q_min) / intervals;
    const double volume = PropertiesOf(report->faces.mesh).volume;
    const double error = volume - report->exact.volume;
    text += fmt::format("{:<10.6g}  {:.14f}  {:+.3e}\n", step, volume, error);
    report->convergence_order = std::log(previous_error / error) / std::log(previous_step / step);
    previous_error = error;
    previous_step = step;
  }
  text += fmt::format("order of convergence {:.3f} (2 expected)\n", report->convergence_order);
  return text;
}

std::string CornerTable(const Geometry& geometry) {
  std::string text =
      "q1      q2      q3         x             y             z             tilt_deg\n";
  for (int corner = 0; corner < 8; ++corner) {
    PerLeg<double> q;
    for (int i = 0; i < 3; ++i) q[i] = corner >> i & 1 ? geometry.q_max : geometry.q_min;
    Posture p;
    if (!SolveForward(geometry, q, &p).ok()) continue;
    text += fmt::format("{:.4f}  {:.4f}  {:.4f}  {:+.9f}  {:+.9f}  {:+.9f}  {:.6f}\n", q[0], q[1],
                        q[2], Clean(p.r.x()), Clean(p.r.y()), p.r.z(), p.tilt.Angle() / kDeg);
  }
  return text;
}

std::string RangeTable(const WorkspaceRanges& r) {
  const auto line = [](const char* name, const Range& range, double unit) {
    return fmt::format("{:<28} {:>12.6f} … {:.6f}\n", name, range.lower / unit, range.upper / unit);
  };
  return line("x_m", r.x, 1) + line("y_m", r.y, 1) + line("z_m", r.z, 1) +
         line("tilt_deg", r.tilt, kDeg) + line("det J", r.det, 1) +
         line("singular values of J", r.sigma, 1) + line("condition of J", r.cond, 1) +
         line("|det| of (12) [m3]", r.det_c, 1) + line("condition of (12)", r.cond_c, 1) +
         line("ball swing_deg", r.ball_swing, kDeg) + line("ball twist_deg", r.ball_twist, kDeg) +
         line("change of lean_deg", r.lean, kDeg);
}

std::string SectionTable(const Geometry& geometry, const std::vector<double>& heights) {
  std::string text = "z_m       x_min_m    x_max_m    y_min_m    y_max_m\n";
  const auto along_x = AxialSection(geometry, 0.0, heights);
  const auto along_y = AxialSection(geometry, 0.5 * pi, heights);
  for (size_t i = 0; i < heights.size(); ++i) {
    text +=
        fmt::format("{:.5f}  {:+.6f}  {:+.6f}  {:+.6f}  {:+.6f}\n", heights[i], along_x[i].rho_min,
                    along_x[i].rho_max, along_y[i].rho_min, along_y[i].rho_max);
  }
  return text;
}

std::string SectionsCsv(const Geometry& geometry, const WorkspaceOptions& options) {
  std::string csv = "section,azimuth_rad,x_m,y_m,z_m\n";
  for (double z : options.heights) {
    const std::vector<Vec3> curve = HorizontalSection(geometry, z, options.section_azimuths);
    for (size_t k = 0; k < curve.size(); ++k) {
      csv += fmt::format("z={:g},{:.17g},{:.17g},{:.17g},{:.17g}\n", z, 2 * pi * k / curve.size(),
                         curve[k].x(), curve[k].y(), curve[k].z());
    }
  }
  return csv;
}

}  // namespace

WorkspaceReport ReportWorkspace(const Geometry& geometry, const WorkspaceOptions& options) {
  WorkspaceReport report;
  const FaceIntegrals faces = IntegrateFaces(geometry, options.gauss_points);
  report.exact = faces.solid;
  report.volume_interior = VolumeByInterior(geometry, options.gauss_points);
  const std::string meshes = MeshTable(geometry, options, &report);
  if (std::isnan(report.exact.volume) || !report.faces.summary.ok()) {
    report.summary = report.faces.summary;
    report.text = "no workspace: " + report.summary.message + "\n";
    return report;
  }
  const WorkspaceRanges ranges = RangesOf(geometry, 20);
  report.text = fmt::format(
      "Reachable workspace of O_A, legs {} … {} m, home branch\n\n"
      "volume by smooth faces    {:.14f} m3\n"
      "volume by interior        {:.14f} m3\n",
      geometry.q_min, geometry.q_max, report.exact.volume, report.volume_interior);
  if (options.voxels > 0) {
    // A box around the ranges with a margin of two cells of the coarsest sensible count.
    const Vec3 lower(ranges.x.lower, ranges.y.lower, ranges.z.lower);
    const Vec3 upper(ranges.x.upper, ranges.y.upper, ranges.z.upper);
    const Vec3 margin = 0.05 * (upper - lower);
    report.volume_voxels =
        VolumeByVoxels(geometry, options.voxels, {lower - margin, upper + margin});
    report.text +=
        fmt::format("volume by {}^3 voxels      {:.8f} m3\n", options.voxels, report.volume_voxels);
  }
  report.text += fmt::format("area {:.9f} m2; faces", faces.solid.area);
  for (double area : faces.face_area) report.text += fmt::format(" {:.9f}", area);
  report.text +=
      fmt::format("\ncentroid ({:.9f}, {:.9f}, {:.9f}) m\n\n", Clean(faces.solid.centroid.x()),
                  Clean(faces.solid.centroid.y()), faces.solid.centroid.z());
  report.text += meshes + "\n" + CornerTable(geometry) + "\n" + RangeTable(ranges) + "\n" +
                 SectionTable(geometry, options.heights);
  report.sections_csv = SectionsCsv(geometry, options);
  report.summary = RunSummary::Done();
  return report;
}

}  // namespace mbv::spr_tripod
