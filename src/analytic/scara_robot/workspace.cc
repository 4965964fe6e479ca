#include "analytic/scara_robot/workspace.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <optional>
#include <random>
#include <string>

#include "core/demand.h"
#include "core/in_children.h"

namespace mbv::scara {

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

}  // namespace mbv::scara
