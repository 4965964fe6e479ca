#include "analytic/scara_robot/workspace.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <optional>
#include <random>
#include <string>

#include "base/demand.h"
#include "base/worker_pool.h"

namespace mbv::scara_robot {

Limits LimitsOf(const Mechanism& mechanism) {
  Limits limits;
  for (const auto& [name, limit] :
       {std::pair{"theta_min", &limits.theta_min}, std::pair{"theta_max", &limits.theta_max},
        std::pair{"shear_max", &limits.shear_max}}) {
    if (mechanism.HasParameter(name)) *limit = mechanism.ParameterValue(name);
  }
  return limits;
}

PoseCheck CheckPose(const Parameters& parameters, const Limits& limits, const Vec4& X) {
  PoseCheck check;
  check.X = X;
  Position position;
  if (const RunSummary reach = InversePosition(parameters, X, &position); !reach.ok()) {
    check.limb = 0;
    while (reach.where != LimbName(check.limb)) ++check.limb;
    check.excess = reach.amount;
    return check;
  }
  check.theta = position.theta;
  check.singularity = Measure(parameters, position);
  check.reach = Reach::kReachable;
  check.shear = 0.0;
  const auto judge = [&check](Reach reach, int limb, double excess) {
    if (excess <= 0.0 || check.limb >= 0) return;
    check.reach = reach;
    check.limb = limb;
    check.excess = excess;
  };
  for (int i = 0; i < kLimbs; ++i) {
    const double shear = std::abs(RodShear(position, i));
    check.shear = std::max(check.shear, shear);
    judge(Reach::kMotorRange, i,
          std::max(limits.theta_min - position.theta[i], position.theta[i] - limits.theta_max));
    judge(Reach::kShear, i, shear - limits.shear_max);
  }
  return check;
}

std::vector<PoseCheck> MapSlice(const Parameters& parameters, const Limits& limits, double z,
                                double phi, double half_width, int n) {
  MBV_DEMAND(n > 1, n);
  std::vector<PoseCheck> map;
  map.reserve(static_cast<size_t>(n) * n);
  const auto at = [&](int i) { return half_width * (2.0 * i / (n - 1) - 1.0); };
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      map.push_back(CheckPose(parameters, limits, Vec4(at(column), at(row), z, phi)));
    }
  }
  return map;
}

namespace {

// What the cells of a layer across x gave.
struct LayerCount {
  std::int64_t reached = 0, usable = 0, at_edge = 0, differences = 0;
};

LayerCount CountLayer(const Parameters& parameters, const Limits& limits, double phi,
                      const Box3& box, int cells, std::uint64_t seed, int layer) {
  // Each of the layers before has taken its numbers: two samples per cell, three each.
  std::mt19937_64 random(seed);
  random.discard(6ULL * static_cast<std::uint64_t>(cells) * static_cast<std::uint64_t>(cells) *
                 static_cast<std::uint64_t>(layer));
  // 53 random bits, the same on every standard library.
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1.0p-53; };
  const Vec3 cell = (box.high - box.low) / cells;
  LayerCount count;
  const auto sample = [&](const Vec3& corner) {
    const Vec3 p(corner.x() + cell.x() * uniform(), corner.y() + cell.y() * uniform(),
                 corner.z() + cell.z() * uniform());
    const PoseCheck check = CheckPose(parameters, limits, Vec4(p.x(), p.y(), p.z(), phi));
    const bool in = check.reach == Reach::kReachable;
    count.reached += in;
    count.usable += in && check.singularity.s_min >= kNearlySingular;
    return in;
  };
  for (int j = 0; j < cells; ++j) {
    for (int k = 0; k < cells; ++k) {
      const Vec3 corner = box.low + cell.cwiseProduct(Vec3(layer, j, k));
      const bool first = sample(corner), second = sample(corner);
      count.differences += first != second;
      const auto [least, most] = std::minmax({layer, j, k});
      count.at_edge += (first || second) && (least == 0 || most == cells - 1);
    }
  }
  return count;
}

}  // namespace

Volume EstimateVolume(const Parameters& parameters, const Limits& limits, double phi,
                      const Box3& box, int cells, std::uint64_t seed, int jobs) {
  MBV_DEMAND(cells > 0, cells);
  LayerCount all;
  Volume volume;
  const auto work = [&](size_t layer) {
    const LayerCount count =
        CountLayer(parameters, limits, phi, box, cells, seed, static_cast<int>(layer));
    return std::string(reinterpret_cast<const char*>(&count), sizeof count);
  };
  ShareOut(static_cast<size_t>(cells), jobs, work,
           [&](size_t, const std::optional<std::string>& bytes) {
             volume.lost = volume.lost || !bytes;
             if (!bytes) return;
             LayerCount count;
             std::memcpy(&count, bytes->data(), sizeof count);
             all.reached += count.reached;
             all.usable += count.usable;
             all.at_edge += count.at_edge;
             all.differences += count.differences;
           });
  if (volume.lost) return volume;
  // Per cell the mean of two samples; half their squared difference estimates the variance of one.
  const double cell_volume = ((box.high - box.low) / cells).prod();
  const auto reached = static_cast<double>(all.reached);
  volume.touches_box = all.at_edge > 0;
  volume.samples = 2LL * cells * cells * cells;
  volume.reached = all.reached;
  volume.volume_m3 = cell_volume * reached / 2.0;
  volume.uncertainty_m3 = 2.0 * cell_volume * std::sqrt(static_cast<double>(all.differences)) / 2.0;
  volume.fraction_usable = reached > 0 ? static_cast<double>(all.usable) / reached : 0.0;
  return volume;
}

CylinderCheck CheckCylinder(const Parameters& parameters, const Limits& limits,
                            const CylinderSpace& cylinder, double phi, int layers, int rings,
                            int spokes) {
  MBV_DEMAND(layers > 1 && rings > 0 && spokes > 0, layers);
  CylinderCheck result;
  result.complete = true;
  result.V_min = std::numeric_limits<double>::infinity();
  for (int layer = 0; layer < layers; ++layer) {
    const double z = cylinder.z_top + (cylinder.z_bottom - cylinder.z_top) * layer / (layers - 1.0);
    int reached = 0;
    const auto add = [&](double x, double y) {
      PoseCheck check = CheckPose(parameters, limits, Vec4(x, y, z, phi));
      const bool in = check.reach == Reach::kReachable;
      reached += in;
      if (in && check.singularity.V_min < result.V_min) {
        result.V_min = check.singularity.V_min;
        result.X_at_V_min = check.X;
      }
      result.poses.push_back(std::move(check));
    };
    add(0.0, 0.0);
    for (int ring = 1; ring <= rings; ++ring) {
      for (int spoke = 0; spoke < spokes; ++spoke) {
        const double radius = cylinder.radius * ring / rings;
        const double angle = 2.0 * std::numbers::pi * spoke / spokes;
        add(radius * std::cos(angle), radius * std::sin(angle));
      }
    }
    result.layer_z.push_back(z);
    result.layer_reached.push_back(static_cast<double>(reached) / (1.0 + rings * spokes));
    result.complete = result.complete && reached == 1 + rings * spokes;
  }
  return result;
}

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

// "0.00827 +- 2e-05".
std::string WithError(double value, double error) {
  return fmt::format("{:.{}f} +- {:.0e}", value, Decimals(error), error);
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
    request.Report(yaw > 0.0 ? 0.6 : 0.2);
    const Volume v = WholeVolume(parameters, limits, yaw * kDegree, request.jobs);
    if (v.lost) return LostWork();
    const double share = v.fraction_usable;
    const double share_error =
        2.0 * std::sqrt(share * (1.0 - share) / std::max(1.0, static_cast<double>(v.reached)));
    outcome.text += fmt::format(
        "reachable volume at yaw {:g} deg: {} m^3 (two standard errors, {} samples); {} % of it "
        "away from singular poses\n",
        yaw, WithError(v.volume_m3, v.uncertainty_m3), v.samples,
        WithError(100.0 * share, 100.0 * share_error));
    outcome.measures.push_back({fmt::format("volume at yaw {:g} deg", yaw),
                                v.volume_m3,
                                v.uncertainty_m3,
                                "m3",
                                {"x", "y", "z"},
                                {{"yaw", yaw * kDegree}}});
    outcome.measures.push_back({fmt::format("share away from singular poses at yaw {:g} deg", yaw),
                                share, share_error, "1"});
  }
  for (double z : {-0.100, -0.165, -0.230}) AddSlice(parameters, limits, z, &outcome);
  outcome.mesh = CylinderMesh(space, 72);
  outcome.mesh_caption = "scara_robot / the paper's workspace cylinder";
  return outcome;
}

}  // namespace mbv::scara_robot
