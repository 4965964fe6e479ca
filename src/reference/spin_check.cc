#include "reference/spin_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mbv::internal {
namespace {

// Share of the largest moment of a body, or force at the characteristic length, that is rounding.
constexpr double kNoMoment = 1e-9;

}  // namespace

double SpinMoment(const Spin& spin, const BodyStates& states, const std::vector<Vec6>& wrench_W) {
  const Pose& X_WB = states.X_WB[static_cast<size_t>(spin.bodies[0])];
  const Vec3 n = X_WB.linear() * spin.n_B, p_WP = X_WB * spin.p_BP;
  double moment = 0.0;
  for (const int b : spin.bodies) {
    const Vec6& wrench = wrench_W[static_cast<size_t>(b)];
    const Vec3 p_PBo = states.X_WB[static_cast<size_t>(b)].translation() - p_WP;
    moment += n.dot(wrench.head<3>()) + n.cross(p_PBo).dot(wrench.tail<3>());
  }
  return moment;
}

RunSummary CheckSpinsIdle(const std::vector<Spin>& spins, const BodyStates& states,
                          const std::vector<Vec6>& required_W, double length) {
  if (spins.empty()) return RunSummary::Done();
  double largest = 0.0;
  for (const Vec6& wrench : required_W) {
    largest = std::max({largest, wrench.head<3>().norm(), length * wrench.tail<3>().norm()});
  }
  for (const Spin& spin : spins) {
    const double moment = SpinMoment(spin, states, required_W);
    if (std::abs(moment) <= kNoMoment * largest) continue;
    RunSummary summary;
    summary.stop = Stop::kUnsupported;
    summary.message = fmt::format(
        "a moment of {:.3g} N m about the line through both balls of {} changes its spin, which "
        "counts as idle; hold it by a universal joint",
        -moment, spin.name);
    summary.where = spin.name;
    summary.amount = -moment;
    summary.unit = std::string("N m");
    return summary;
  }
  return RunSummary::Done();
}

}  // namespace mbv::internal
