#include "render/instants.h"

#include <algorithm>

namespace mbv::render {
namespace {

void MoveApart(const Mechanism& mechanism, double factor, std::vector<Pose>* X_WB) {
  const std::size_t count = mechanism.bodies.size();
  if (count < 2) return;
  Vec3 middle = Vec3::Zero();
  const auto centre = [&](std::size_t b) {
    return Vec3((*X_WB)[b] * mechanism.bodies[b].p_BoBcm_B);
  };
  for (std::size_t b = 1; b < count; ++b) middle += centre(b) / static_cast<double>(count - 1);
  for (std::size_t b = 1; b < count; ++b) {
    const Vec3 away = (factor - 1.0) * (centre(b) - middle);
    (*X_WB)[b].translation() += away;
  }
}

bool SamePlace(const Item& a, const Item& b) {
  return a.solid == b.solid && a.size.isApprox(b.size, 1e-9) && a.mesh == b.mesh &&
         (a.X_WG.matrix() - b.X_WG.matrix()).norm() <= 1e-9 * (1.0 + a.size.norm());
}

}  // namespace

PictureFrame Exploded(const Mechanism& mechanism, const PictureFrame& frame, double factor) {
  PictureFrame apart = frame;
  MoveApart(mechanism, factor, &apart.X_WB);
  for (std::vector<Pose>& ghost : apart.X_WB_ghosts) MoveApart(mechanism, factor, &ghost);
  return apart;
}

std::vector<PictureFrame> WithGhosts(const std::vector<PictureFrame>& frames) {
  std::vector<PictureFrame> all;
  for (const PictureFrame& frame : frames) {
    all.push_back(frame);
    for (const std::vector<Pose>& X_WB : frame.X_WB_ghosts) all.push_back({.X_WB = X_WB});
  }
  return all;
}

std::vector<std::vector<Item>> GhostItems(const Mechanism& mechanism, const PictureFrame& frame,
                                          const std::vector<Item>& now, const Scale& scale,
                                          const PictureOptions& options) {
  PictureOptions plain = options;
  plain.output_frames = false;
  std::vector<std::vector<Item>> ghosts;
  for (const std::vector<Pose>& X_WB : frame.X_WB_ghosts) {
    std::vector<Item> items = MechanismItems(mechanism, {.X_WB = X_WB}, scale, plain);
    std::erase_if(items, [&](const Item& item) {
      return std::ranges::any_of(now, [&](const Item& other) { return SamePlace(item, other); });
    });
    ghosts.push_back(std::move(items));
  }
  return ghosts;
}

}  // namespace mbv::render
