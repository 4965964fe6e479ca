#include "analytic/stabilizing_platform/limb_system.h"

#include <Eigen/SVD>

#include "core/spatial.h"

namespace mbv::stabilizing_platform {
namespace {

// Columns of the unknowns.
constexpr int kCross2 = 0, kCross2p = 5, kElbow = 10, kFoot = 20, kDrive = 28;
// In the corrected form the two moments of cross → 2' give way to the platform's actions.
constexpr int kPlatformX = 8, kPlatformTau = 9;

// Rows of the bodies.
constexpr int kCrossRow = 0;
constexpr int Link2Row(int side) { return 6 + 6 * side; }
constexpr int Link1Row(int side) { return 18 + 6 * side; }

// Writes ± a unit force along `axis` at p into a column.
void AddForce(LimbSystem* s, int row, int column, double sign, const Vec3& axis, const Vec3& p) {
  s->matrix.block<3, 1>(row, column) += sign * p.cross(axis);
  s->matrix.block<3, 1>(row + 3, column) += sign * axis;
}

void AddMoment(LimbSystem* s, int row, int column, double sign, const Vec3& axis) {
  s->matrix.block<3, 1>(row, column) += sign * axis;
}

// Action at point p with forces and the listed moments, + on the outer body, − on the inner one
// (row −1: the base, no equations).
void AddJoint(LimbSystem* s, int column, const Vec3& p, int outer_row, int inner_row,
              std::initializer_list<int> moments) {
  auto both = [&](auto add) {
    add(outer_row, +1.0);
    if (inner_row >= 0) add(inner_row, -1.0);
  };
  for (int k = 0; k < 3; ++k) {
    both([&](int row, double sign) { AddForce(s, row, column + k, sign, Vec3::Unit(k), p); });
  }
  int next = column + 3;
  for (int axis : moments) {
    both([&](int row, double sign) { AddMoment(s, row, next, sign, Vec3::Unit(axis)); });
    ++next;
  }
}

}  // namespace

LimbSystem MakeLimbSystem(LimbSystemForm form, const LimbGeometry& g, const LinkWrenches& required,
                          double f_Y, double f_Z) {
  LimbSystem s;
  s.matrix.setZero();
  s.right_side.setZero();
  constexpr int Y = 1, Z = 2;
  const bool corrected = form == LimbSystemForm::kCorrected;
  AddJoint(&s, kCross2, g.B, Link2Row(0), kCrossRow, {Y, Z});
  if (corrected) {
    AddJoint(&s, kCross2p, g.B, Link2Row(1), kCrossRow, {});
    AddForce(&s, kCrossRow, kPlatformX, -1.0, Vec3::UnitX(), g.B);  // f_X acts on the platform
    AddMoment(&s, kCrossRow, kPlatformTau, 1.0, Vec3::UnitX());
  } else {
    AddJoint(&s, kCross2p, g.B, Link2Row(1), kCrossRow, {Y, Z});
  }
  for (int j = 0; j < 2; ++j) {
    AddJoint(&s, kElbow + 5 * j, g.E[j], Link2Row(j), Link1Row(j), {Y, Z});
    AddJoint(&s, kFoot + 4 * j, g.U[j], Link1Row(j), -1, {Z});
    AddForce(&s, Link1Row(j), kDrive + j, 1.0, g.thrust[j], g.rod_ball[j]);
    s.right_side.segment<6>(Link2Row(j)) = required[kLink2 + j];
    s.right_side.segment<6>(Link1Row(j)) = required[kLink1 + j];
  }
  // The platform pushes the cross by −(f_Y Y + f_Z Z); a massless body needs nothing.
  const Vec3 f(0, f_Y, f_Z);
  s.right_side.segment<3>(kCrossRow) = g.B.cross(f);
  s.right_side.segment<3>(kCrossRow + 3) = f;
  // Moments from A_i to a point on each body: better conditioned.
  auto shift = [&](int row, const Vec3& p) {
    const Mat3 P = Skew(p);
    s.matrix.middleRows<3>(row) -= P * s.matrix.middleRows<3>(row + 3);
    s.right_side.segment<3>(row) -= P * s.right_side.segment<3>(row + 3);
  };
  shift(kCrossRow, g.B);
  for (int j = 0; j < 2; ++j) {
    shift(Link2Row(j), g.E[j]);
    shift(Link1Row(j), g.U[j]);
  }
  return s;
}

LimbSystemSolution SolveLimbSystem(const LimbSystem& system, double f_Y, double f_Z) {
  const Eigen::Matrix<double, 30, 1> x = system.matrix.partialPivLu().solve(system.right_side);
  LimbSystemSolution out;
  out.forces.on_platform = {x[kPlatformX], f_Y, f_Z};
  out.forces.P = {x.segment<3>(kCross2), x.segment<3>(kCross2p)};
  out.tau_X = x[kPlatformTau];
  for (int j = 0; j < 2; ++j) {
    out.forces.drive[j] = x[kDrive + j];
    const int elbow = kElbow + 5 * j, foot = kFoot + 4 * j;
    out.reactions.elbow[j] << 0, x.segment<2>(elbow + 3), x.segment<3>(elbow);
    out.reactions.foot[j] << 0, 0, x[foot + 3], x.segment<3>(foot);
  }
  return out;
}

Eigen::Matrix<double, 30, 1> ColumnScaledSingularValues(const LimbSystem& system) {
  Eigen::Matrix<double, 30, 30> scaled = system.matrix;
  for (int c = 0; c < 30; ++c) scaled.col(c).normalize();
  return Eigen::JacobiSVD<Eigen::Matrix<double, 30, 30>>(scaled).singularValues();
}

}  // namespace mbv::stabilizing_platform
