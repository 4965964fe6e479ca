#include "mechanism/same_geometry.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <ranges>
#include <span>

#include "mechanism/idle_spins.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

bool Same(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
bool Same(std::span<const double> a, std::span<const double> b) {
  return std::ranges::equal(a, b, [](double x, double y) { return Same(x, y); });
}
bool Same(const Vec3& a, const Vec3& b) {
  return Same(std::span(a.data(), 3), std::span(b.data(), 3));
}
bool Same(const Pose& a, const Pose& b) {
  return Same(std::span(a.data(), 16), std::span(b.data(), 16));
}
bool Same(const CoordinateRange& a, const CoordinateRange& b) {
  return Same(a.lower, b.lower) && Same(a.upper, b.upper);
}
bool Same(const Joint& a, const Joint& b) {
  return a.kind == b.kind && a.parent == b.parent && a.child == b.child && a.closure == b.closure &&
         a.transmits_force_only == b.transmits_force_only && Same(a.X_PF, b.X_PF) &&
         Same(a.X_CM, b.X_CM) && Same(a.axis, b.axis) && Same(a.axis2, b.axis2) &&
         Same(a.guess, b.guess) && Same(a.home, b.home) && Same(a.max_rotation, b.max_rotation) &&
         std::ranges::equal(a.range, b.range,
                            [](const auto& x, const auto& y) { return Same(x, y); });
}
bool Same(const JointDrive& a, const JointDrive& b) {
  return a.joint == b.joint && a.coordinate == b.coordinate;
}
bool Same(const DistanceDrive& a, const DistanceDrive& b) {
  return a.body_from == b.body_from && a.body_to == b.body_to && Same(a.p_from, b.p_from) &&
         Same(a.p_to, b.p_to);
}
bool Same(const Drive& a, const Drive& b) {
  if (a.kind.index() != b.kind.index() || !Same(a.range, b.range) ||
      a.compensates_gravity != b.compensates_gravity) {
    return false;
  }
  return std::visit(
      [&](const auto& kind) { return Same(kind, std::get<std::decay_t<decltype(kind)>>(b.kind)); },
      a.kind);
}
bool Same(const Prescribed& a, const Prescribed& b) { return a.joint == b.joint; }
bool Same(const Output& a, const Output& b) {
  return a.body == b.body && a.reference_body == b.reference_body && Same(a.X_BO, b.X_BO) &&
         Same(a.X_RbR, b.X_RbR);
}
bool Same(const Coupling::Term& a, const Coupling::Term& b) {
  return a.joint == b.joint && a.coordinate == b.coordinate && Same(a.polynomial, b.polynomial);
}

bool Same(const Coupling& a, const Coupling& b);
bool Same(const Spin& a, const Spin& b);

template <typename T>
bool Same(const std::vector<T>& a, const std::vector<T>& b) {
  return std::ranges::equal(a, b, [](const T& x, const T& y) { return Same(x, y); });
}
bool Same(const Coupling& a, const Coupling& b) {
  return Same(a.constant, b.constant) && Same(a.terms, b.terms);
}
bool Same(const Spin& a, const Spin& b) {
  return a.bodies == b.bodies && a.balls == b.balls && a.why_not == b.why_not &&
         Same(a.p_BP, b.p_BP) && Same(a.n_B, b.n_B);
}

}  // namespace

bool HaveSameGeometry(const Mechanism& a, const Mechanism& b) {
  const auto massless = [](const Body& x, const Body& y) {
    return (x.mass == 0.0) == (y.mass == 0.0);
  };
  return std::ranges::equal(a.bodies, b.bodies, massless) && Same(a.joints, b.joints) &&
         Same(a.drives, b.drives) && Same(a.prescribed, b.prescribed) &&
         Same(a.outputs, b.outputs) && Same(a.couplings, b.couplings) &&
         a.tree_joints == b.tree_joints && a.tree_reversed == b.tree_reversed &&
         Same(a.X_WB_home, b.X_WB_home) && Same(CharacteristicLength(a), CharacteristicLength(b));
}

bool HaveSameSpins(const Mechanism& a, const Mechanism& b) {
  return Same(FindSpins(a), FindSpins(b));
}

}  // namespace mbv
