// What is open at a closure, as rotation vectors that vanish nowhere else.
#include "kinematics/assembly_residual.h"

#include <cmath>

#include "core/spatial.h"
#include "kinematics/constraints.h"
#include "mechanism/body_states.h"

namespace mbv::internal {
namespace {

// d log(R)/dt = L ω for Ṙ = [ω]× R, the inverse left Jacobian of SO(3).
Mat3 LogDerivative(const Vec3& r) {
  const double angle = r.norm();
  const Mat3 S = Skew(r);
  double k = 1.0 / 12.0;
  if (angle > 1e-3) k = (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
  return Mat3::Identity() - 0.5 * S + k * S * S;
}

// Rotation vector that turns the unit vector a onto m by the shortest way, and its derivative by
// the angular velocity of m.
void Alignment(const Vec3& a, const Vec3& m, Vec3* r, Mat3* J) {
  const Vec3 cross = a.cross(m);
  const double sine = cross.norm(), angle = std::atan2(sine, a.dot(m));
  if (sine < 1e-12 && angle < 1.0) {
    r->setZero();
    *J = Mat3::Identity() - a * a.transpose();
    return;
  }
  // Against each other any way is as short: some perpendicular axis.
  const Vec3 n = sine < 1e-12 ? Vec3(a.unitOrthogonal()) : Vec3(cross / sine);
  constexpr double kSteepest = 10.0;  // where the shortest way jumps from one side to the other
  const double k = sine < angle / kSteepest ? kSteepest : angle / sine;
  *r = angle * n;
  *J = n * n.transpose() + k * a.cross(n) * m.cross(n).transpose();
}

// Rows of the rotation, in F, and their derivative by the angular velocity of M against F.
void RotationRows(const Joint& joint, const Mat3& R_FM, VecX* r, MatX* J) {
  switch (joint.kind) {
    case JointKind::kSpherical:
    case JointKind::kPointOnLine:
    case JointKind::kPointOnPlane:
    case JointKind::kFree:
      r->resize(0);
      J->resize(0, 3);
      return;
    case JointKind::kFixed:
    case JointKind::kPrismatic: {
      const Vec3 log = LogRotation(R_FM);
      *r = log;
      *J = LogDerivative(log);
      return;
    }
    case JointKind::kRevolute:
    case JointKind::kCylindrical:
    case JointKind::kPlanar: {
      Vec3 v;
      Mat3 D;
      Alignment(joint.axis, R_FM * joint.axis, &v, &D);
      *r = v;
      *J = D;
      return;
    }
    case JointKind::kUniversal: {
      const Vec3 m = R_FM * joint.axis2;
      const Vec3 cross = joint.axis.cross(m);
      const double sine = cross.norm();
      const Vec3 n = sine < 1e-12 ? Vec3(joint.axis.unitOrthogonal()) : Vec3(cross / sine);
      r->resize(1);
      (*r)[0] = std::atan2(sine, joint.axis.dot(m)) -
                std::atan2(joint.axis.cross(joint.axis2).norm(), joint.axis.dot(joint.axis2));
      *J = n.transpose();
      return;
    }
  }
}

}  // namespace

ClosureGap AssemblyResidual(const Joint& joint, const ClosureFrames& frames, double length) {
  BodyStates states;
  states.Resize(2);
  states.X_WB = {frames.X_WP, frames.X_WC};
  Joint alone = joint;
  alone.parent = 0;
  alone.child = 1;
  const ConstraintRows rows = RowsOf(alone, states, false);
  const int n = rows.translation_rows;

  const Mat3 R_WF = frames.X_WP.linear() * joint.X_PF.linear();
  VecX r;
  MatX D;
  RotationRows(joint, R_WF.transpose() * frames.X_WC.linear() * joint.X_CM.linear(), &r, &D);
  ClosureGap gap;
  gap.residual.resize(n + r.size());
  gap.residual << rows.residual.head(n) / length, r;
  gap.J_parent = gap.J_child = MatX::Zero(n + r.size(), 6);
  gap.J_parent.topRows(n) = rows.J_parent.topRows(n) / length;
  gap.J_child.topRows(n) = rows.J_child.topRows(n) / length;
  if (r.size() == 0) return gap;
  gap.J_child.bottomLeftCorner(r.size(), 3) = D * R_WF.transpose();
  gap.J_parent.bottomLeftCorner(r.size(), 3) = -D * R_WF.transpose();
  return gap;
}

}  // namespace mbv::internal
