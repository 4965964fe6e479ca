// Terms: O the output's frame, R its reference frame, both fixed in bodies; all vectors in world
// axes unless a name says otherwise.
//
//   r  = p_RO,  v = v_O − v_R − ω_R × r                        seen from R, world axes          (1)
//   a  = a_O − a_R − α_R × r − ω_R × (ω_R × r) − 2 ω_R × v                                      (2)
//   ω  = ω_O − ω_R,  α = α_O − α_R − ω_R × ω                                                    (3)
// With R_RO = Rz(ψ) Ry(θ) Rx(φ) and, in R's axes, e1 = Rz Ry x, e2 = Rz y, e3 = z:
//   ω  = φ̇ e1 + θ̇ e2 + ψ̇ e3                                                                     (4)
//   α  = φ̈ e1 + θ̈ e2 + ψ̈ e3 + φ̇ (ψ̇ e3 + θ̇ e2) × e1 + θ̇ ψ̇ e3 × e2                               (5)
// e1 is the first column of R_RO; e2 is square to both others, and e = Rz x to e2 and e3:
//   θ̇ = e2·ω,  φ̇ = e·ω / cos θ,  ψ̇ = e3·ω + φ̇ sin θ                                             (6)
#include "simulation/output_rates.h"

#include <cmath>

#include "core/spatial.h"

namespace mbv::simulation {
namespace {

// Below this cosine of the pitch, roll and yaw turn about the same axis.
constexpr double kLocked = 1e-8;

// A point of a body with all that moves there.
struct Place {
  Vec3 p, v, a, w, alpha;
};

// The origin of a frame fixed in a body, at p_BQ. MuJoCo's accelerations contain −gravity.
Place PlaceOf(const EngineModel& engine, const mjData& d, int body, const Vec3& p_BQ) {
  const mjModel& m = *engine.m;
  const Vec3 rest = Vec3::Zero();
  if (body == 0) return {.p = p_BQ, .v = rest, .a = rest, .w = rest, .alpha = rest};
  const int id = engine.body_id[engine.PlannedOf(body)];
  Vec6 V, A;
  mj_objectVelocity(&m, &d, mjOBJ_XBODY, id, V.data(), 0);
  mj_objectAcceleration(&m, &d, mjOBJ_XBODY, id, A.data(), 0);
  const Pose X_WB = PoseOf(d, id);
  const Vec3 w = V.head<3>(), alpha = A.head<3>(), r = X_WB.linear() * p_BQ;
  const Eigen::Map<const Vec3> g(m.opt.gravity);
  return {.p = X_WB.translation() + r,
          .v = V.tail<3>() + w.cross(r),
          .a = A.tail<3>() + g + alpha.cross(r) + w.cross(w.cross(r)),
          .w = w,
          .alpha = alpha};
}

// Roll, pitch, yaw rates and accelerations, (4) to (6), from ω and α in R's axes.
void PutAngles(const Mat3& R_RO, const Vec3& w, const Vec3& alpha, OutputRates* rates) {
  const Vec3 e1 = R_RO.col(0), e3 = Vec3::UnitZ();
  const double cosine = std::hypot(e1.x(), e1.y()), sine = -e1.z();
  if (cosine < kLocked) return;
  const Vec3 e(e1.x() / cosine, e1.y() / cosine, 0.0), e2 = e3.cross(e);
  const auto angles = [&](const Vec3& turn) {
    const double roll = e.dot(turn) / cosine;
    return Vec3(roll, e2.dot(turn), turn.z() + roll * sine);
  };
  const Vec3 rate = angles(w);
  const Vec3 bias =
      rate[0] * (rate[2] * e3 + rate[1] * e2).cross(e1) + rate[1] * rate[2] * e3.cross(e2);
  rates->velocity.tail<3>() = rate;
  rates->acceleration.tail<3>() = angles(alpha - bias);
}

}  // namespace

bool HasOutputRates(const EngineModel& engine, const Output& output) {
  return engine.PlannedOf(output.body) >= 0 && engine.PlannedOf(output.reference_body) >= 0;
}

OutputRates OutputRatesOf(const EngineModel& engine, const mjData& d, const Output& output) {
  const Place o = PlaceOf(engine, d, output.body, output.X_BO.translation());
  const Place f = PlaceOf(engine, d, output.reference_body, output.X_RbR.translation());
  const auto rotation = [&](int body) {
    return Mat3(PoseOf(d, engine.body_id[engine.PlannedOf(body)]).linear());
  };
  const Mat3 R_WR = rotation(output.reference_body) * output.X_RbR.linear();
  const Mat3 R_RO = R_WR.transpose() * rotation(output.body) * output.X_BO.linear();
  const Vec3 r = o.p - f.p, w = o.w - f.w;
  const Vec3 v = o.v - f.v - f.w.cross(r);
  const Vec3 a = o.a - f.a - f.alpha.cross(r) - f.w.cross(f.w.cross(r)) - 2.0 * f.w.cross(v);
  const Vec3 alpha = o.alpha - f.alpha - f.w.cross(w);
  OutputRates rates;
  rates.velocity.head<3>() = R_WR.transpose() * v;
  rates.acceleration.head<3>() = R_WR.transpose() * a;
  PutAngles(R_RO, R_WR.transpose() * w, R_WR.transpose() * alpha, &rates);
  return rates;
}

}  // namespace mbv::simulation
