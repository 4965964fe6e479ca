#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "analytic/spr_tripod/workspace.h"
#include "analytic/workspace_form.h"
#include "base/demand.h"

namespace mbv::spr_tripod {
namespace {

using std::numbers::pi;
constexpr double kDeg = pi / 180.0;

// Rounding noise about zero would print as -0.000000000 on one machine and +0.000000000 on another.
double Clean(double x) { return std::abs(x) < 5e-10 ? 0.0 : x; }

// The error of a Gauss rule is what so many points fewer change.
constexpr int kFewerPoints = 4;
// Of an order that is measured on steps far from zero.
constexpr double kOrderTolerance = 0.5;
constexpr double kMeasurable = 10.0;  // times the error of the smooth faces

std::string Volume(const VolumeEstimate& v) {
  return fmt::format("{:.{}f} m3 (error {:.0e})", v.value, Decimals(v.error), v.error);
}

// Volumes of the refined meshes; fills the finest mesh, its volume and the order of convergence.
std::string MeshTable(const Geometry& geometry, const WorkspaceOptions& options,
                      WorkspaceReport* report) {
  std::string text = "step_m      mesh_volume_m3       error_m3\n";
  double previous = kNan, previous_step = kNan;
  VolumeEstimate mesh{.way = "mesh"};
  const double faces_error = report->volumes.front().error;
  for (int intervals : options.mesh_intervals) {
    report->faces = TriangulateFaces(geometry, intervals);
    if (!report->faces.summary.ok()) return {};
    const double step = (geometry.q_max - geometry.q_min) / intervals;
    const double volume = PropertiesOf(report->faces.mesh).volume;
    const double error = volume - report->exact.volume;
    text += fmt::format("{:<10.6g}  {:<19.{}f}  {:+.3e}\n", step, volume, Decimals(std::abs(error)),
                        error);
    // Against faces that are known no better than the meshes, an order is an accident.
    if (std::abs(error) > kMeasurable * faces_error && !std::isnan(previous)) {
      report->convergence_order =
          std::log((previous - report->exact.volume) / error) / std::log(previous_step / step);
    }
    mesh.value = volume;
    mesh.error = std::abs(std::isnan(previous) ? error : volume - previous);
    report->mesh_error = error;
    previous = volume;
    previous_step = step;
  }
  report->volumes.push_back(mesh);
  if (std::isnan(report->convergence_order)) {
    text += fmt::format(
        "order of convergence not measurable: the smooth faces are known to {:.0e} m3 only\n",
        faces_error);
  } else {
    text += fmt::format("order of convergence {:.3f} (2 expected)\n", report->convergence_order);
  }
  return text;
}

// Everything but the mesh. The errors of Gauss rules are what fewer points change.
void FillVolumes(const Geometry& geometry, const WorkspaceOptions& options, double coarse_faces,
                 WorkspaceReport* report) {
  const int points = options.gauss_points, fewer = points - kFewerPoints;
  // Sums of as many terms keep no more digits.
  const double roundoff = 64.0 * kEps * std::abs(report->exact.volume);
  const auto estimate = [&](const char* way, double fine, double coarse) {
    report->volumes.push_back({way, fine, std::max(std::abs(fine - coarse), roundoff)});
  };
  estimate("smooth faces", report->exact.volume, coarse_faces);
  estimate("interior", VolumeByInterior(geometry, points), VolumeByInterior(geometry, fewer));
}

// The count, in a box around the ranges, with what the joints' own ranges leave of it.
std::string AddVoxels(const Geometry& geometry, const WorkspaceOptions& options,
                      const WorkspaceRanges& ranges, WorkspaceReport* report) {
  const Vec3 lower(ranges.x.lower, ranges.y.lower, ranges.z.lower);
  const Vec3 upper(ranges.x.upper, ranges.y.upper, ranges.z.upper);
  const Vec3 margin = 0.05 * (upper - lower);
  const VoxelCount count = CountVoxels(geometry, options.voxels, {lower - margin, upper + margin},
                                       options.within_ranges, options.jobs, options.progress);
  report->volumes.push_back({"voxels", count.volume, count.uncertainty});
  std::string text;
  if (options.within_ranges) {
    text = fmt::format(
        "within the ranges of the model's joints, too: {:.2f} % of it (by {}^3 voxels)\n",
        100.0 * count.filtered / count.volume, options.voxels);
  }
  if (count.several > count.uncertainty) {
    report->contradictions.push_back(fmt::format(
        "{:.2g} % of the volume is reached with several leg triples: the faces bound it more than "
        "once",
        100.0 * count.several / count.volume));
  }
  return text;
}

std::string VerdictText(const WorkspaceReport& report) {
  if (report.contradictions.empty()) {
    return fmt::format("AGREE: {} ways to the volume differ by less than their errors\n",
                       report.volumes.size());
  }
  std::string text;
  for (const std::string& contradiction : report.contradictions) {
    text += "DISAGREE: " + contradiction + "\n";
  }
  return text;
}

// What rounding leaves of a sum of so many terms of this size.
double Roundoff(double size) { return 64.0 * kEps * std::abs(size); }

// Errors of the smooth faces: what fewer points change of each face, so that faces do not make up
// for each other.
void FillErrors(const FaceIntegrals& fine, const FaceIntegrals& coarse, WorkspaceReport* report) {
  report->area_error = 0.0;
  for (size_t k = 0; k < fine.face_area.size(); ++k) {
    const double error =
        std::max(std::abs(fine.face_area[k] - coarse.face_area[k]), Roundoff(fine.face_area[k]));
    report->face_errors[k] = error;
    report->area_error += error;
  }
  const Vec3 &c = fine.solid.centroid, &d = coarse.solid.centroid;
  report->centroid_error = std::max((c - d).norm(), Roundoff(c.norm()));
}

// Areas and centroid of the smooth faces.
std::string MeasuresText(const FaceIntegrals& fine, const WorkspaceReport& report) {
  const auto digits = [](double error) { return std::min(9, Decimals(error)); };
  std::string text = fmt::format("area {:.{}f} m2 (error {:.0e}); faces", fine.solid.area,
                                 digits(report.area_error), report.area_error);
  for (size_t k = 0; k < fine.face_area.size(); ++k) {
    text += fmt::format(" {:.{}f}", fine.face_area[k], digits(report.face_errors[k]));
  }
  const Vec3& c = fine.solid.centroid;
  const int places = digits(report.centroid_error);
  return text + fmt::format("\ncentroid ({:.{}f}, {:.{}f}, {:.{}f}) m (error {:.0e})\n\n",
                            Clean(c.x()), places, Clean(c.y()), places, c.z(), places,
                            report.centroid_error);
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

// Extremes over the finest of several grids, which may miss them by three times what other grids
// change; the last digit printed is at least as large as that.
std::string RangeTable(const WorkspaceRanges& r, const std::vector<WorkspaceRanges>& coarser) {
  const auto number = [&](Range WorkspaceRanges::*range, double Range::*end, double unit) {
    constexpr int kMost = 6;
    constexpr double kTimes = 3.0, kDigit = 10.0;
    const double value = (r.*range).*end;
    double error = 0.0;
    for (const WorkspaceRanges& other : coarser) {
      error = std::max(error, std::abs(value - (other.*range).*end));
    }
    const int places = std::min(kMost, Decimals(kDigit * kTimes * error / unit));
    const double shown = value / unit;
    // No sign of what rounds to zero.
    return fmt::format("{:.{}f}", std::abs(shown) < 0.5 * std::pow(10.0, -places) ? 0.0 : shown,
                       places);
  };
  const auto line = [&](const char* name, Range WorkspaceRanges::*range, double unit) {
    return fmt::format("{:<28} {:>12} … {}\n", name, number(range, &Range::lower, unit),
                       number(range, &Range::upper, unit));
  };
  using R = WorkspaceRanges;
  return line("x_m", &R::x, 1) + line("y_m", &R::y, 1) + line("z_m", &R::z, 1) +
         line("tilt_deg", &R::tilt, kDeg) + line("det J", &R::det, 1) +
         line("singular values of J", &R::sigma, 1) + line("condition of J", &R::cond, 1) +
         line("|det| of (12) [m3]", &R::det_c, 1) + line("condition of (12)", &R::cond_c, 1) +
         line("ball swing_deg", &R::ball_swing, kDeg) +
         line("ball twist_deg", &R::ball_twist, kDeg) + line("change of lean_deg", &R::lean, kDeg);
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

std::string SectionsCsv(const Geometry& geometry, const WorkspaceOptions& options,
                        const std::vector<double>& heights) {
  std::string csv = "section,azimuth_rad,x_m,y_m,z_m\n";
  for (double z : heights) {
    const std::vector<Vec3> curve = HorizontalSection(geometry, z, options.section_azimuths);
    for (size_t k = 0; k < curve.size(); ++k) {
      csv += fmt::format("z={:g},{:.17g},{:.17g},{:.17g},{:.17g}\n", z, 2 * pi * k / curve.size(),
                         curve[k].x(), curve[k].y(), curve[k].z());
    }
  }
  return csv;
}

}  // namespace

std::vector<std::string> Contradictions(const WorkspaceReport& report, const Range& det) {
  std::vector<std::string> found;
  const VolumeEstimate& faces = report.volumes.front();
  for (const VolumeEstimate& other : report.volumes) {
    const double difference = std::abs(other.value - faces.value);
    if (difference <= other.error + faces.error) continue;
    if (std::isnan(difference)) {
      found.emplace_back("some leg triples within the stroke have no regular pose");
      continue;
    }
    found.push_back(fmt::format("the volume by {} is {:.2g} % {} than that by {}", other.way,
                                100.0 * difference / std::abs(faces.value),
                                other.value < faces.value ? "smaller" : "larger", faces.way));
  }
  if (!(det.lower > 0.0)) {
    found.push_back(
        fmt::format("det J is not positive all over the stroke ({:.3g} … {:.3g}): the six faces "
                    "need not bound the workspace",
                    det.lower, det.upper));
  }
  if (!std::isnan(report.convergence_order) &&
      !(std::abs(report.convergence_order - 2.0) < kOrderTolerance)) {
    found.push_back(
        fmt::format("the meshes converge with order {:.3f} instead of 2: the faces are not smooth",
                    report.convergence_order));
  }
  return found;
}

WorkspaceReport ReportWorkspace(const Geometry& geometry, const WorkspaceOptions& options) {
  MBV_DEMAND(options.gauss_points > kFewerPoints, options.gauss_points);
  WorkspaceReport report;
  const FaceIntegrals faces = IntegrateFaces(geometry, options.gauss_points);
  const FaceIntegrals coarse = IntegrateFaces(geometry, options.gauss_points - kFewerPoints);
  report.exact = faces.solid;
  FillVolumes(geometry, options, coarse.solid.volume, &report);
  const std::string meshes = MeshTable(geometry, options, &report);
  if (std::isnan(report.exact.volume) || !report.faces.summary.ok()) {
    report.summary = report.faces.summary;
    report.text = "no workspace: " + report.summary.message + "\n";
    return report;
  }
  const WorkspaceRanges ranges = RangesOf(geometry, 20);
  // Grids that share few points with it.
  const std::vector<WorkspaceRanges> coarser = {RangesOf(geometry, 17), RangesOf(geometry, 13)};
  FillErrors(faces, coarse, &report);
  std::string within;
  if (options.voxels > 0) within = AddVoxels(geometry, options, ranges, &report);
  if (options.voxels > 0 && std::isnan(report.volumes.back().value)) {
    report.summary = LostWork().summary;
    report.text = "no workspace: " + report.summary.message + "\n";
    return report;
  }
  for (std::string& text : Contradictions(report, ranges.det)) {
    report.contradictions.push_back(std::move(text));
  }
  report.heights = options.heights.empty() ? RoundHeights(geometry) : options.heights;
  report.text = fmt::format("Reachable workspace of O_A, legs {} … {} m, home branch\n\n",
                            geometry.q_min, geometry.q_max);
  for (const VolumeEstimate& v : report.volumes) {
    report.text += fmt::format("volume by {:<14}  {}\n", v.way, Volume(v));
  }
  report.text += VerdictText(report) + within;
  report.text += MeasuresText(faces, report);
  report.text += meshes + "\n" + CornerTable(geometry) + "\n" + RangeTable(ranges, coarser) + "\n" +
                 SectionTable(geometry, report.heights);
  report.sections_csv = SectionsCsv(geometry, options, report.heights);
  report.summary = RunSummary::Done();
  return report;
}

}  // namespace mbv::spr_tripod
