#include "analytic/spr_tripod/workspace.h"

#include <fmt/format.h>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <unordered_map>

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

}  // namespace mbv::spr_tripod
