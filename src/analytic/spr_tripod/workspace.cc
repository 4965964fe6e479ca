#include "analytic/spr_tripod/workspace.h"

#include <fmt/format.h>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <unordered_map>

#include "analytic/workspace_form.h"
#include "base/demand.h"
#include "base/worker_pool.h"
#include "math/spatial.h"

namespace mbv::spr_tripod {

namespace {

using std::numbers::pi;

struct GaussRule {
  std::vector<double> node, weight;  // on [-1, 1]
};

// Gauss–Legendre nodes by Newton on the Legendre polynomial.
GaussRule GaussLegendre(int n) {
  GaussRule rule;
  for (int i = 1; i <= n; ++i) {
    double x = std::cos(pi * (i - 0.25) / (n + 0.5)), slope = 0.0;
    for (int k = 0; k < 20; ++k) {
      double p = 1.0, previous = 0.0;
      for (int j = 1; j <= n; ++j) {
        const double next = ((2 * j - 1) * x * p - (j - 1) * previous) / j;
        previous = p;
        p = next;
      }
      slope = n * (x * p - previous) / (x * x - 1);
      const double step = p / slope;
      x -= step;
      if (std::abs(step) < kEps) break;
    }
    rule.node.push_back(x);
    rule.weight.push_back(2 / ((1 - x * x) * slope * slope));
  }
  return rule;
}

// A node in the stroke and its weight.
double LengthAt(const Geometry& g, double node) {
  return 0.5 * (g.q_min + g.q_max) + 0.5 * (g.q_max - g.q_min) * node;
}

// Forward position and Jacobian; false when the legs do not meet the platform.
bool PoseAt(const Geometry& g, const PerLeg<double>& q, Posture* p, Jacobians* j) {
  return SolveForward(g, q, p).ok() && FillJacobians(g, *p, j).ok();
}

}  // namespace

double WorkspaceMesh::FaceArea(int face) const {
  const size_t count = 2u * intervals * intervals;
  return AreaOf(mesh, face * count, count);
}

WorkspaceMesh TriangulateFaces(const Geometry& geometry, int intervals) {
  MBV_DEMAND(intervals > 0, intervals);
  WorkspaceMesh result;
  result.intervals = intervals;
  result.summary = RunSummary::Done();
  const int n = intervals;
  // Vertices by their place on the lattice of the cube, so that faces share their edges.
  std::unordered_map<long, int> index;
  const auto vertex = [&](const std::array<int, 3>& k) {
    const auto [at, is_new] = index.try_emplace((long{k[0]} * (n + 1) + k[1]) * (n + 1) + k[2],
                                                static_cast<int>(result.mesh.vertices.size()));
    if (is_new) {
      PerLeg<double> q;
      for (int i = 0; i < 3; ++i) {
        q[i] = geometry.q_min + (geometry.q_max - geometry.q_min) * k[i] / n;
      }
      Posture p;
      RunSummary summary = SolveForward(geometry, q, &p);
      if (!summary.ok()) result.summary = summary;
      result.mesh.vertices.push_back(p.r);
    }
    return at->second;
  };
  for (int leg = 0; leg < 3; ++leg) {
    for (const bool longest : {false, true}) {
      // q → r keeps orientation (det J > 0): outward is +q_leg on the longest face.
      const int first = (leg + (longest ? 1 : 2)) % 3, second = (leg + (longest ? 2 : 1)) % 3;
      const auto corner = [&](int i, int j) {
        std::array<int, 3> k{};
        k[leg] = longest ? n : 0;
        k[first] = i;
        k[second] = j;
        return vertex(k);
      };
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          const int p00 = corner(i, j), p10 = corner(i + 1, j), p11 = corner(i + 1, j + 1),
                    p01 = corner(i, j + 1);
          result.mesh.triangles.push_back({p00, p10, p11});
          result.mesh.triangles.push_back({p00, p11, p01});
        }
      }
    }
  }
  if (!result.summary.ok()) result.mesh = {};
  return result;
}

FaceIntegrals IntegrateFaces(const Geometry& geometry, int points) {
  const GaussRule rule = GaussLegendre(points);
  const double half = 0.5 * (geometry.q_max - geometry.q_min);
  FaceIntegrals result;
  double volume = 0.0;
  Vec3 moment = Vec3::Zero();
  for (int face = 0; face < kFaces; ++face) {
    const int leg = face / 2;
    const bool longest = face % 2 == 1;
    const int first = (leg + 1) % 3, second = (leg + 2) % 3;
    for (int i = 0; i < points; ++i) {
      for (int j = 0; j < points; ++j) {
        PerLeg<double> q;
        q[leg] = longest ? geometry.q_max : geometry.q_min;
        q[first] = LengthAt(geometry, rule.node[i]);
        q[second] = LengthAt(geometry, rule.node[j]);
        Posture p;
        Jacobians jacobians;
        if (!PoseAt(geometry, q, &p, &jacobians)) return {};
        // Outward area vector; ∫ x dV = ½ ∮ x² n_x dA.
        const double weight = rule.weight[i] * rule.weight[j] * half * half;
        const Vec3 dA = (longest ? weight : -weight) *
                        jacobians.J_inv.col(first).cross(jacobians.J_inv.col(second));
        volume += p.r.dot(dA) / 3.0;
        moment += 0.5 * p.r.cwiseProduct(p.r).cwiseProduct(dA);
        result.face_area[face] += dA.norm();
      }
    }
  }
  result.solid = {volume, 0.0, moment / volume};
  for (double area : result.face_area) result.solid.area += area;
  return result;
}

double VolumeByInterior(const Geometry& geometry, int points) {
  const GaussRule rule = GaussLegendre(points);
  const double half = 0.5 * (geometry.q_max - geometry.q_min);
  double volume = 0.0;
  for (int i = 0; i < points; ++i) {
    for (int j = 0; j < points; ++j) {
      for (int k = 0; k < points; ++k) {
        const PerLeg<double> q = {LengthAt(geometry, rule.node[i]),
                                  LengthAt(geometry, rule.node[j]),
                                  LengthAt(geometry, rule.node[k])};
        Posture p;
        Jacobians jacobians;
        if (!PoseAt(geometry, q, &p, &jacobians)) return kNan;
        volume += rule.weight[i] * rule.weight[j] * rule.weight[k] / jacobians.det;
      }
    }
  }
  return volume * half * half * half;
}

namespace {

bool IsWithinStroke(const Geometry& geometry, const Posture& p) {
  return std::all_of(p.q.begin(), p.q.end(),
                     [&](double q) { return q >= geometry.q_min && q <= geometry.q_max; });
}

// A forward solution is the posture it started from, to this [m].
constexpr double kSamePlace = 1e-7;

}  // namespace

std::vector<Posture> PosturesAt(const Geometry& geometry, const Vec3& r) {
  std::vector<Posture> found;
  Posture p;
  if (r.z() > 0.5 * geometry.b) {
    if (SolveInverse(geometry, r, &p).ok() && IsWithinStroke(geometry, p)) found.push_back(p);
    return found;
  }
  // Nearer to the base several upright assemblies share a position.
  for (const Assembly& assembly : AllAssemblies(geometry, r)) {
    if (assembly.turned || !assembly.upright) continue;
    FillPosture(geometry, r, assembly.tilt, &p);
    Posture home;
    if (IsWithinStroke(geometry, p) && SolveForward(geometry, p.q, &home).ok() &&
        (home.r - r).norm() < kSamePlace * geometry.b) {
      found.push_back(p);
    }
  }
  return found;
}

bool IsReachable(const Geometry& geometry, const Vec3& r) {
  return !PosturesAt(geometry, r).empty();
}

namespace {

// Per cell of a layer across x: how many postures (up to 3), and 4 if the filter lets one pass.
std::string LayerOfVoxels(const Geometry& geometry, size_t layer, size_t n, const Box3& box,
                          const PoseFilter& filter) {
  const Vec3 cell = (box.upper - box.lower) / static_cast<double>(n);
  std::string voxels(n * n, '\0');
  for (size_t j = 0; j < n; ++j) {
    for (size_t k = 0; k < n; ++k) {
      const Vec3 steps(static_cast<double>(layer), static_cast<double>(j), static_cast<double>(k));
      const auto found =
          PosturesAt(geometry, box.lower + cell.cwiseProduct(steps + Vec3::Constant(0.5)));
      const bool passes = filter && std::any_of(found.begin(), found.end(), filter);
      voxels[j * n + k] = static_cast<char>(std::min<size_t>(found.size(), 3) + (passes ? 4 : 0));
    }
  }
  return voxels;
}

}  // namespace

VoxelCount CountVoxels(const Geometry& geometry, int cells, const Box3& box,
                       const PoseFilter& filter, int jobs,
                       const std::function<void(double)>& progress) {
  MBV_DEMAND(cells > 0, cells);
  const auto n = static_cast<size_t>(cells);
  std::string voxels;
  ShareOut(
      n, jobs, [&](size_t layer) { return LayerOfVoxels(geometry, layer, n, box, filter); },
      [&](size_t i, const std::optional<std::string>& layer) {
        voxels += layer.value_or("");
        if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(n));
      });
  if (voxels.size() != n * n * n) return {.uncertainty = kNan, .several = kNan, .filtered = kNan};
  const auto at = [&](size_t i, size_t j, size_t k) { return voxels[(i * n + j) * n + k]; };
  const auto inside = [&](size_t i, size_t j, size_t k) { return (at(i, j, k) & 3) != 0; };
  long count = 0, several = 0, filtered = 0, boundary = 0;
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < n; ++j) {
      for (size_t k = 0; k < n; ++k) {
        const bool in = inside(i, j, k);
        count += in;
        several += (at(i, j, k) & 3) > 1;
        filtered += (at(i, j, k) & 4) != 0;
        // Pairs of neighbours of which one is inside: a face of the boundary between them.
        boundary += (i > 0 && in != inside(i - 1, j, k)) + (j > 0 && in != inside(i, j - 1, k)) +
                    (k > 0 && in != inside(i, j, k - 1));
      }
    }
  }
  // A cell cut by the boundary counts whole or not at all: a variance of 1/12.
  const double size = ((box.upper - box.lower) / cells).prod();
  return {static_cast<double>(count) * size,
          4.0 * std::sqrt(static_cast<double>(boundary) / 12.0) * size,
          static_cast<double>(several) * size, static_cast<double>(filtered) * size};
}

double ReachAt(const Geometry& geometry, double z, double azimuth) {
  const Vec3 d(std::cos(azimuth), std::sin(azimuth), 0.0);
  const auto inside = [&](double rho) {
    return IsReachable(geometry, rho * d + z * Vec3::UnitZ());
  };
  if (!inside(0.0)) return kNan;
  // First step that leaves, then bisection.
  const double step = 0.01 * geometry.q_max;
  double low = 0.0;
  while (inside(low + step)) low += step;
  double high = low + step;
  while (high - low > 1e-13) {
    const double middle = 0.5 * (low + high);
    (inside(middle) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Range AxisRange(const Geometry& geometry) {
  const double offset = geometry.b - geometry.a;
  const auto height = [&](double q) { return std::sqrt(std::max(0.0, q * q - offset * offset)); };
  return {height(geometry.q_min), height(geometry.q_max)};
}

std::vector<double> RoundHeights(const Geometry& geometry) {
  const auto [low, high] = AxisRange(geometry);
  // 1, 2, 5 or 10 times a power of ten.
  const double rough = (high - low) / 6.0;
  double step = std::pow(10.0, std::floor(std::log10(rough)));
  step *= rough < 1.5 * step ? 1.0 : rough < 3.5 * step ? 2.0 : rough < 7.5 * step ? 5.0 : 10.0;
  std::vector<double> heights;
  for (double k = std::ceil(low / step); k * step < high; ++k) {
    if (k * step > low) heights.push_back(k * step);
  }
  return heights;
}

std::vector<Vec3> HorizontalSection(const Geometry& geometry, double z, int count) {
  std::vector<Vec3> points;
  for (int k = 0; k < count; ++k) {
    const double azimuth = 2 * pi * k / count;
    const double rho = ReachAt(geometry, z, azimuth);
    points.push_back({rho * std::cos(azimuth), rho * std::sin(azimuth), z});
  }
  return points;
}

std::vector<AxialLimits> AxialSection(const Geometry& geometry, double azimuth,
                                      const std::vector<double>& heights) {
  std::vector<AxialLimits> limits;
  limits.reserve(heights.size());
  for (double z : heights) {
    limits.push_back({z, -ReachAt(geometry, z, azimuth + pi), ReachAt(geometry, z, azimuth)});
  }
  return limits;
}

namespace {

// Inward lean of leg i in the platform.
double LeanOf(const Geometry& g, const Posture& p, int leg) {
  const Vec3 w_P = p.R.transpose() * p.w[leg];
  return std::atan2(-w_P.dot(g.f[leg]), w_P.z());
}

// Rotation of the leg from its home, split into a swing of its axis and a twist about it.
void AddBallAngles(const Mat3& R_home, const Mat3& R, WorkspaceRanges* ranges) {
  const Vec3 w_home = R_home.col(2), w = R.col(2);
  const double swing = std::atan2(w_home.cross(w).norm(), w_home.dot(w));
  ranges->ball_swing.Add(swing);
  const Mat3 swing_R = swing > 0.0 ? Mat3(Eigen::AngleAxisd(swing, w_home.cross(w).normalized()))
                                   : Mat3(Mat3::Identity());
  const Mat3 twist = (swing_R * R_home).transpose() * R;  // about z of the leg frame
  ranges->ball_twist.Add(std::atan2(twist(1, 0), twist(0, 0)));
}

}  // namespace

WorkspaceRanges RangesOf(const Geometry& geometry, int intervals) {
  WorkspaceRanges ranges;
  Posture home;
  const double middle = 0.5 * (geometry.q_min + geometry.q_max);
  if (!SolveForward(geometry, {middle, middle, middle}, &home).ok()) return ranges;
  const auto length = [&](int k) {
    return geometry.q_min + (geometry.q_max - geometry.q_min) * k / intervals;
  };
  const auto add_matrix = [](const Mat3& A, Range* sigma, Range* cond) {
    const Vec3 s = Eigen::JacobiSVD<Mat3>(A).singularValues();
    if (sigma != nullptr) {
      sigma->Add(s[0]);
      sigma->Add(s[2]);
    }
    cond->Add(s[0] / s[2]);
  };
  for (int i = 0; i <= intervals; ++i) {
    for (int j = 0; j <= intervals; ++j) {
      for (int k = 0; k <= intervals; ++k) {
        Posture p;
        Jacobians jacobians;
        if (!PoseAt(geometry, {length(i), length(j), length(k)}, &p, &jacobians)) continue;
        ranges.x.Add(p.r.x());
        ranges.y.Add(p.r.y());
        ranges.z.Add(p.r.z());
        ranges.tilt.Add(p.tilt.Angle());
        ranges.det.Add(jacobians.det);
        ranges.det_c.Add(std::abs(jacobians.det_c));
        add_matrix(jacobians.J, &ranges.sigma, &ranges.cond);
        add_matrix(jacobians.D_inv, nullptr, &ranges.cond_c);
        for (int leg = 0; leg < 3; ++leg) {
          AddBallAngles(LegRotation(home, leg), LegRotation(p, leg), &ranges);
          ranges.lean.Add(LeanOf(geometry, p, leg) - LeanOf(geometry, home, leg));
        }
      }
    }
  }
  return ranges;
}

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

LinePlot AxialSectionPlot(const Geometry& geometry) {
  LinePlot plot{.title = "Sections through the z axis",
                .x_label = "distance from the axis [m]",
                .y_label = "z [m]",
                .equal_scale = true};
  const auto [low, high] = AxisRange(geometry);
  constexpr int kSteps = 280;
  std::vector<double> heights;
  for (int k = 0; k <= kSteps; ++k) heights.push_back(low + (high - low) * k / kSteps);
  for (double azimuth : {0.0, 30.0, 90.0}) {
    PlotLine line{.label = fmt::format("azimuth {:g} deg", azimuth), .closed = true};
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
  LinePlot plot{
      .title = "Horizontal sections", .x_label = "x [m]", .y_label = "y [m]", .equal_scale = true};
  for (double z : heights) {
    PlotLine line{.label = fmt::format("z = {:g} m", z), .closed = true};
    for (const Vec3& p : HorizontalSection(geometry, z, 360)) {
      line.points.emplace_back(p.x(), p.y());
    }
    plot.lines.push_back(std::move(line));
  }
  return plot;
}

// Ranges of the joints other than the strokes; empty where none has one.
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
    outcome.measures.push_back(
        {"volume by " + std::string(v.way), v.value, v.error, "m3", {"x", "y", "z"}});
  }
  outcome.measures.push_back({"area", report.exact.area, report.area_error, "m2"});
  for (const int k : {0, 1, 2}) {
    const std::string axis(1, "xyz"[k]);
    outcome.measures.push_back(
        {"centroid " + axis, report.exact.centroid[k], report.centroid_error, "m"});
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

namespace {

using std::numbers::pi;
constexpr double kDeg = pi / 180.0;

// Rounding noise about zero would print as -0.000000000 on one machine and +0.000000000 on another.
double Clean(double x) { return std::abs(x) < 5e-10 ? 0.0 : x; }

// The error of a Gauss rule is what this many points fewer change.
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

// What rounding leaves of a sum of this many terms of this size.
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
