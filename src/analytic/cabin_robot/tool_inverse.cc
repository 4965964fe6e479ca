#include "analytic/cabin_robot/tool_inverse.h"

#include <cmath>

#include "core/spatial.h"

namespace mbv::cabin {
namespace {

using Mat8 = Eigen::Matrix<double, kDrives, kDrives>;

// Below these a division would lose more than half of the digits.
constexpr double kSmallDirection = 1e-6;
constexpr double kSmallPivot = 1e-8;

RunSummary Singular(const char* where, const char* message, double amount) {
  RunSummary summary;
  summary.stop = Stop::kSingular;
  summary.message = message;
  summary.where = where;
  summary.amount = amount;
  summary.unit = "1";
  return summary;
}

// ω = E(rpy) · rates for R = Rz(yaw) Ry(pitch) Rx(roll), and E's derivative.
Mat3 RateMatrix(const Vec3& rpy) {
  const double cp = std::cos(rpy.y()), sp = std::sin(rpy.y());
  const double cy = std::cos(rpy.z()), sy = std::sin(rpy.z());
  Mat3 E;
  E << cy * cp, -sy, 0, sy * cp, cy, 0, -sp, 0, 1;
  return E;
}
Mat3 RateMatrixDot(const Vec3& rpy, const Vec3& rates) {
  const double cp = std::cos(rpy.y()), sp = std::sin(rpy.y()), p = rates.y(), y = rates.z();
  const double cy = std::cos(rpy.z()), sy = std::sin(rpy.z());
  Mat3 E;
  E << -sy * cp * y - cy * sp * p, -cy * y, 0, cy * cp * y - sy * sp * p, -sy * y, 0, -cp * p, 0, 0;
  return E;
}

// Positions of everything; rates are left alone.
RunSummary SolvePositions(const CabinGeometry& geometry, Resolution resolution,
                          const ToolCommand& c, PlanarState* planar, OuterDrives* outer) {
  const WristGeometry& g = geometry.wrist;
  const Vec3 p(c.position[0].p, c.position[1].p, c.position[2].p);
  const Mat3 R = RotRpy({c.rpy[0].p, c.rpy[1].p, c.rpy[2].p});
  const Mat3 Rz = RotZ(c.gamma.p);
  const Mat3 R26 = Rz.transpose() * R;
  outer->th4.p = std::asin(-R26(1, 2));
  outer->th3.p = std::atan2(-R26(2, 2), R26(0, 2));
  outer->th6.p = std::atan2(R26(1, 0), R26(1, 1));
  const double c3 = std::cos(outer->th3.p), s3 = std::sin(outer->th3.p);
  const double c4 = std::cos(outer->th4.p), s4 = std::sin(outer->th4.p);
  const Vec3 x3 = Rz * Vec3(c3, 0.0, -s3), y4 = Rz * Vec3(-c3 * s4, -c4, s3 * s4);
  const Vec3 b = Rz * Vec3(g.a2, g.d3, 0.0) + g.a3 * x3 + (g.a4 + g.d6) * R.col(2);

  const int row = resolution == Resolution::kRailGiven ? 2 : 1;
  if (std::abs(y4[row]) < kSmallDirection) {
    return Singular("d5", "the wrist slide is across the direction that resolves the redundancy",
                    y4[row]);
  }
  outer->d5.p = (p[row] - b[row] - c.resolved.p) / y4[row];
  const Vec3 K = p - b - outer->d5.p * y4;
  planar->X.p = K.x();
  planar->Y.p = K.y();
  planar->gamma.p = c.gamma.p;
  outer->d1.p = K.z();
  return SolveInverse(geometry.planar, planar);
}

void ClearRates(PlanarState* s, OuterDrives* o) {
  for (Motion1* m : {&s->X1, &s->X2, &s->X3, &o->d1, &o->th3, &o->th4, &o->d5, &o->th6}) {
    m->v = m->a = 0.0;
  }
}

void AddTo(double Motion1::*member, const Vec8& q, PlanarState* s, OuterDrives* o) {
  Motion1* const order[kDrives] = {&o->d1,  &s->X1,  &s->X2, &s->X3,
                                   &o->th3, &o->th4, &o->d5, &o->th6};
  for (int d = 0; d < kDrives; ++d) order[d]->*member = q[d];
}

// Tool twist, γ and the resolution coordinate as functions of the drives' rates (8×8).
Mat8 TaskJacobian(Resolution resolution, const std::array<FrameMotion, kBodies>& frames) {
  Mat8 J;
  J.topRows<3>() = frames[kPayload].Jv;
  J.middleRows<3>(3) = frames[kPayload].Jw;
  J.row(6) = frames[kPlatform].Jw.row(2);
  J.row(7) = frames[kPlatform].Jv.row(resolution == Resolution::kRailGiven ? 2 : 1);
  return J;
}

// The same quantities' accelerations as the frames have them.
Vec8 TaskAcceleration(Resolution resolution, const std::array<FrameMotion, kBodies>& frames) {
  Vec8 a;
  a << frames[kPayload].a, frames[kPayload].e, frames[kPlatform].e.z(),
      frames[kPlatform].a[resolution == Resolution::kRailGiven ? 2 : 1];
  return a;
}

}  // namespace

RunSummary SolveToolPose(const CabinGeometry& geometry, Resolution resolution, const ToolCommand& c,
                         PlanarState* planar, OuterDrives* outer) {
  ClearRates(planar, outer);
  planar->X = planar->Y = planar->gamma = Motion1{};
  if (RunSummary s = SolvePositions(geometry, resolution, c, planar, outer); !s.ok()) return s;

  // Rates: the task's rates through the 8×8 Jacobian.
  std::array<FrameMotion, kBodies> frames;
  ComputeFrames(geometry, *planar, *outer, &frames);
  const Eigen::PartialPivLU<Mat8> J(TaskJacobian(resolution, frames));
  const double pivot = J.matrixLU().diagonal().cwiseAbs().minCoeff();
  if (!(pivot > kSmallPivot)) {
    return Singular("end effector", "the resolved 8x8 Jacobian is singular (smallest pivot)",
                    pivot);
  }
  const Vec3 rpy(c.rpy[0].p, c.rpy[1].p, c.rpy[2].p), rates(c.rpy[0].v, c.rpy[1].v, c.rpy[2].v);
  const Mat3 E = RateMatrix(rpy);
  Vec8 task;
  task << c.position[0].v, c.position[1].v, c.position[2].v, E * rates, c.gamma.v, c.resolved.v;
  AddTo(&Motion1::v, J.solve(task), planar, outer);

  // Accelerations: what is left after the velocity-dependent part.
  if (RunSummary s = SolveForward(geometry.planar, planar); !s.ok()) return s;
  ComputeFrames(geometry, *planar, *outer, &frames);
  const Vec3 accelerations(c.rpy[0].a, c.rpy[1].a, c.rpy[2].a);
  task << c.position[0].a, c.position[1].a, c.position[2].a,
      E * accelerations + RateMatrixDot(rpy, rates) * rates, c.gamma.a, c.resolved.a;
  AddTo(&Motion1::a, J.solve(task - TaskAcceleration(resolution, frames)), planar, outer);
  return SolveForward(geometry.planar, planar);
}

}  // namespace mbv::cabin
