#include "simulation/bushings.h"

#include <cmath>

#include "core/spatial.h"
#include "simulation/element_forces.h"

namespace mbv::simulation {
namespace {

// Frames F and M in the world.
struct Frames {
  Pose X_WF, X_WM;
};

Frames FramesOf(const ConstraintSystem& system, size_t element) {
  const EngineModel& engine = system.engine();
  const ElementPlace& place = engine.elements[element];
  const int bushing = engine.mechanism->elements[element].bushing;
  const Bushing& at = engine.mechanism->bushings[static_cast<size_t>(bushing)];
  const mjData& d = *system.data();
  return {PoseOf(d, place.bushing_parent) * at.X_PF, PoseOf(d, place.bushing_child) * at.X_CM};
}

Eigen::Quaterniond ShortWay(const Mat3& R) {
  Eigen::Quaterniond q(R);
  if (q.w() < 0.0) q.coeffs() *= -1.0;
  return q;
}

// (1 − θ w/(2n))/n²; for small angles its series, whose next term is below 1e-14.
double Curvature(double n, double w, double theta) {
  constexpr double kSmall = 0.03;
  const double n2 = n * n;
  if (n < kSmall) return 1.0 / 3.0 + n2 * (2.0 / 15.0 + n2 * (8.0 / 105.0 + n2 * 16.0 / 315.0));
  return (1.0 - theta * w / (2.0 * n)) / n2;
}

// (1), (2)
void PutRotation(const Frames& at, int component, BushingLine* line) {
  const Mat3 R_WF = at.X_WF.linear();
  const Eigen::Quaterniond q = ShortWay(R_WF.transpose() * at.X_WM.linear());
  const Vec3 v = q.vec();
  const double n = v.norm(), theta = 2.0 * std::atan2(n, q.w());
  const double by_n = n > 0.0 ? theta / n : 2.0;
  const Mat3 T = 0.5 * by_n * (q.w() * Mat3::Identity() - Skew(v)) +
                 Curvature(n, q.w(), theta) * v * v.transpose();
  line->value = by_n * v[component];
  line->turn = R_WF * T.row(component).transpose();
}

}  // namespace

BushingLine BushingLineOf(const ConstraintSystem& system, size_t element) {
  const int component = system.engine().mechanism->elements[element].coordinate;
  const Frames at = FramesOf(system, element);
  BushingLine line;
  line.p_WM = at.X_WM.translation();
  if (component >= 3) {
    PutRotation(at, component - 3, &line);
    return line;
  }
  line.push = at.X_WF.linear().col(component);
  line.value = line.push.dot(line.p_WM - at.X_WF.translation());
  return line;
}

VecX BushingGradient(const ConstraintSystem& system, size_t element) {
  const ElementPlace& place = system.engine().elements[element];
  const BushingLine line = BushingLineOf(system, element);
  const mjModel* m = system.engine().m.get();
  VecX gradient = VecX::Zero(system.nv());
  const auto add = [&](int body, double sign) {
    RowMajor J_v(3, m->nv), J_w(3, m->nv);
    mj_jac(m, system.data(), J_v.data(), J_w.data(), line.p_WM.data(), body);
    gradient += sign * (J_v.transpose() * line.push + J_w.transpose() * line.turn);
  };
  add(place.bushing_child, 1.0);
  add(place.bushing_parent, -1.0);
  return gradient;
}

ElementMotion BushingMotionOf(const ConstraintSystem& system, size_t element) {
  const Eigen::Map<const VecX> qvel(system.data()->qvel, system.nv());
  return {.position = BushingLineOf(system, element).value,
          .rate = BushingGradient(system, element).dot(qvel),
          .acceleration = kNan};
}

}  // namespace mbv::simulation
