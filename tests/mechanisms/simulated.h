// Small mechanisms with known answers, built by hand.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "base/run_summary.h"
#include "math/spatial.h"
#include "mechanism/joint_pose.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv::fixtures {

inline Pose PoseAt(const Vec3& p, const Mat3& R = Mat3::Identity()) {
  Pose X = Pose::Identity();
  X.linear() = R;
  X.translation() = p;
  return X;
}

inline Body MakeBody(const std::string& name, double mass, const Vec3& com, const Vec3& inertia) {
  Body body;
  body.name = name;
  body.mass = mass;
  body.p_BoBcm_B = com;
  body.I_Bcm_B = inertia.asDiagonal();
  return body;
}

/// A planar four-bar in the xy-plane, gravity along −y, hinges about z: crank 0.2 m at the origin,
/// coupler 0.5 m, rocker 0.4 m at (0.5, 0, 0). The closure is the coupler–rocker hinge.
struct FourBar {
  static constexpr double a = 0.2, b = 0.5, c = 0.4, d = 0.5, g = 9.81;
  static constexpr double m1 = 0.8, m2 = 1.5, m3 = 1.1;
  static constexpr double I1 = 0.004, I2 = 0.04, I3 = 0.02;
  static constexpr double kHomeAngle = 1.0;

  double t1, t2, t3;  ///< angles of crank, coupler, rocker from x

  explicit FourBar(double crank_angle) : t1(crank_angle) {
    const double bx = a * std::cos(t1), by = a * std::sin(t1);
    const double r = std::hypot(d - bx, -by), phi = std::atan2(-by, d - bx);
    t2 = phi + std::acos((r * r + b * b - c * c) / (2 * b * r));
    t3 = std::atan2(by + b * std::sin(t2), bx + b * std::cos(t2) - d);
  }
  // Rates of coupler and rocker per crank rate, from the loop's velocity equation.
  [[nodiscard]] double k2() const { return a * std::sin(t3 - t1) / (b * std::sin(t2 - t3)); }
  [[nodiscard]] double k3() const { return a * std::sin(t2 - t1) / (c * std::sin(t2 - t3)); }
  // Kinetic energy ½ J(θ) θ̇² and potential energy; the centres of mass are at mid-link.
  [[nodiscard]] double J() const {
    const double vx = -a * std::sin(t1) - 0.5 * b * k2() * std::sin(t2);
    const double vy = a * std::cos(t1) + 0.5 * b * k2() * std::cos(t2);
    return I1 + m1 * a * a / 4 + I2 * k2() * k2() + m2 * (vx * vx + vy * vy) +
           (I3 + m3 * c * c / 4) * k3() * k3();
  }
  [[nodiscard]] double V() const {
    return g * (m1 * a / 2 * std::sin(t1) + m2 * (a * std::sin(t1) + b / 2 * std::sin(t2)) +
                m3 * c / 2 * std::sin(t3));
  }
  /// Crank torque for a given motion: J θ̈ + ½ J' θ̇² + V', derivatives by eighth-order
  /// differences.
  [[nodiscard]] static double Torque(double angle, double rate, double acceleration) {
    const auto derivative = [angle](auto f) {
      constexpr double h = 4e-3;
      const auto difference = [&](int k) {
        return f(FourBar(angle + k * h)) - f(FourBar(angle - k * h));
      };
      return (672 * difference(1) - 168 * difference(2) + 32 * difference(3) - 3 * difference(4)) /
             (840 * h);
    };
    const double dJ = derivative([](const FourBar& x) { return x.J(); });
    const double dV = derivative([](const FourBar& x) { return x.V(); });
    return FourBar(angle).J() * acceleration + 0.5 * dJ * rate * rate + dV;
  }
};

inline Joint MakeJoint(const std::string& name, JointKind kind, int parent, const Vec3& p_parent,
                       int child, const Vec3& p_child, double home = 0.0, bool closure = false) {
  Joint joint;
  joint.name = name;
  joint.kind = kind;
  joint.parent = parent;
  joint.X_PF = PoseAt(p_parent);
  joint.child = child;
  joint.X_CM = PoseAt(p_child);
  joint.home[0] = joint.guess[0] = home;
  joint.closure = closure;
  return joint;
}

inline void AddTree(Mechanism* m) {
  for (size_t j = 0; j < m->joints.size(); ++j) {
    if (m->joints[j].closure) continue;
    m->tree_joints.push_back(static_cast<int>(j));
    m->tree_reversed.push_back(false);
  }
}

/// The four-bar with its closing hinge of a given kind: revolute (exact), spherical, …
inline Mechanism MakeFourBar(JointKind closing = JointKind::kRevolute, bool force_only = false) {
  using F = FourBar;
  const F home(F::kHomeAngle);
  Mechanism m;
  m.name = "four_bar";
  m.gravity_W = Vec3(0, -F::g, 0);
  m.up_W = Vec3::UnitY();
  Body world;
  world.name = "world";
  m.bodies = {world, MakeBody("crank", F::m1, {F::a / 2, 0, 0}, {0.001, 0.0035, F::I1}),
              MakeBody("coupler", F::m2, {F::b / 2, 0, 0}, {0.01, 0.035, F::I2}),
              MakeBody("rocker", F::m3, {F::c / 2, 0, 0}, {0.01, 0.015, F::I3})};
  m.bodies[1].shapes.push_back({Capsule{{0, 0, 0}, {F::a, 0, 0}, 0.01}, "accent"});
  m.bodies[2].shapes.push_back({Capsule{{0, 0, 0}, {F::b, 0, 0}, 0.01}, "steel"});
  m.bodies[3].shapes.push_back({Capsule{{0, 0, 0}, {F::c, 0, 0}, 0.01}, "#336699"});
  m.joints = {
      MakeJoint("A", JointKind::kRevolute, 0, {0, 0, 0}, 1, {0, 0, 0}, home.t1),
      MakeJoint("B", JointKind::kRevolute, 1, {F::a, 0, 0}, 2, {0, 0, 0}, home.t2 - home.t1),
      MakeJoint("D", JointKind::kRevolute, 0, {F::d, 0, 0}, 3, {0, 0, 0}, home.t3),
      MakeJoint("C", closing, 2, {F::b, 0, 0}, 3, {F::c, 0, 0}, home.t3 - home.t2, true)};
  m.joints[3].transmits_force_only = force_only;
  AddTree(&m);
  const Vec3 elbow(F::a * std::cos(home.t1), F::a * std::sin(home.t1), 0);
  m.X_WB_home = {Pose::Identity(), PoseAt({0, 0, 0}, RotZ(home.t1)), PoseAt(elbow, RotZ(home.t2)),
                 PoseAt({F::d, 0, 0}, RotZ(home.t3))};
  m.drives.push_back({.name = "motor", .kind = JointDrive{0, 0}, .range = {}});
  Output tip;
  tip.name = "tip";
  tip.body = 2;
  tip.X_BO = PoseAt({F::b, 0, 0});
  m.outputs.push_back(tip);
  return m;
}

/// A parallelogram in the xy-plane without gravity: crank and rocker of 0.2 m on feet 0.5 m apart,
/// at `angle`. Its energy depends on the crank's rate alone, so it turns at a constant rate, and
/// twice per turn all bars lie in one line, where the rocker could go backwards.
inline Mechanism MakeParallelogram(double angle) {
  Mechanism m;
  m.name = "parallelogram";
  m.gravity_W.setZero();
  Body world;
  world.name = "world";
  m.bodies = {world, MakeBody("crank", 1, {0.1, 0, 0}, {0.01, 0.01, 0.01}),
              MakeBody("coupler", 1, {0.25, 0, 0}, {0.01, 0.01, 0.01}),
              MakeBody("rocker", 1, {0.1, 0, 0}, {0.01, 0.01, 0.01})};
  m.joints = {MakeJoint("A", JointKind::kRevolute, 0, {0, 0, 0}, 1, {0, 0, 0}, angle),
              MakeJoint("B", JointKind::kRevolute, 1, {0.2, 0, 0}, 2, {0, 0, 0}, -angle),
              MakeJoint("D", JointKind::kRevolute, 0, {0.5, 0, 0}, 3, {0, 0, 0}, angle),
              MakeJoint("C", JointKind::kRevolute, 2, {0.5, 0, 0}, 3, {0.2, 0, 0}, angle, true)};
  m.drives.push_back({.name = "motor", .kind = JointDrive{0, 0}, .range = {}});
  AddTree(&m);
  std::vector<std::array<double, 6>> q;
  for (const Joint& joint : m.joints) q.push_back(joint.home);
  m.X_WB_home = TreePoses(m, q);
  return m;
}

/// An arm of 2 kg m² about z at the origin, turned by a motor and by a massless leg that pulls at a
/// right angle with a lever of 0.5 m while the arm lies along x: one DOF, two drives. Torque T
/// is shared with least (τ/L)² + f² by f = 0.5 T / (L² + 0.25), τ = T − 0.5 f.
inline Mechanism MakeSharedArm() {
  Mechanism m;
  m.name = "shared_arm";
  m.gravity_W.setZero();
  Body world;
  world.name = "world";
  m.bodies = {world, MakeBody("arm", 1.0, {0, 0, 0}, {2, 2, 2})};
  m.joints = {MakeJoint("hinge", JointKind::kRevolute, 0, {0, 0, 0}, 1, {0, 0, 0})};
  AddTree(&m);
  m.X_WB_home.assign(2, Pose::Identity());
  m.drives.push_back({.name = "motor", .kind = JointDrive{0, 0}, .range = {}});
  m.drives.push_back(
      {.name = "leg", .kind = DistanceDrive{0, {0.5, -0.8, 0}, 1, {0.5, 0, 0}}, .range = {}});
  return m;
}

/// Starts the first joint's DOF at a position and rate; all drives push with nothing.
inline Motion FreeMotion(const Mechanism& m, double position, double rate, double duration_s) {
  Motion motion;
  motion.duration_s = duration_s;
  motion.sample_s = 0.01;
  motion.initial = {{m.joints[0].name, {Coordinate::Kind::kJoint, 0, 0}, position, rate}};
  for (size_t d = 0; d < m.drives.size(); ++d) {
    motion.forces.push_back({static_cast<int>(d), Constant(0.0)});
  }
  return motion;
}

/// One body that floats: no joint and no command makes a constraint row.
inline Mechanism MakeFloater() {
  Mechanism m;
  m.name = "floater";
  m.gravity_W = Vec3(0, 0, -9.81);
  Body world;
  world.name = "world";
  m.bodies = {world, MakeBody("body", 2.0, Vec3::Zero(), Vec3(0.03, 0.05, 0.07))};
  m.joints = {MakeJoint("float", JointKind::kFree, 0, Vec3::Zero(), 1, Vec3::Zero())};
  AddTree(&m);
  m.X_WB_home.assign(2, Pose::Identity());
  Output output;
  output.name = "body";
  output.body = 1;
  m.outputs = {output};
  return m;
}

/// Starts a floater at the origin with the rates of x, y, z, roll, pitch, yaw.
inline Motion FloatFree(const Vec6& rates, double duration_s) {
  Motion motion;
  motion.duration_s = duration_s;
  motion.sample_s = 0.01;
  for (int c = 0; c < 6; ++c) {
    motion.initial.push_back({"float", {Coordinate::Kind::kJoint, 0, c}, 0.0, rates[c]});
  }
  return motion;
}

/// A bar of 1.3 kg on a pivot about z with a motor, 0.3 rad from x; its inertia about the pivot is
/// 0.072 kg m². Its yaw is an output.
inline Mechanism MakePivotedBar(double gravity = 9.81) {
  Mechanism m;
  m.name = "bar";
  m.gravity_W = Vec3(0, -gravity, 0);
  Body world;
  world.name = "world";
  m.bodies = {world, MakeBody("bar", 1.3, {0.2, 0, 0}, {0.01, 0.02, 0.02})};
  m.joints = {MakeJoint("pivot", JointKind::kRevolute, 0, {0, 0, 0}, 1, {0, 0, 0}, 0.3)};
  m.drives.push_back({.name = "motor", .kind = JointDrive{0, 0}, .range = {}});
  AddTree(&m);
  m.X_WB_home = TreePoses(m, {m.joints[0].guess});
  Output output;
  output.name = "bar";
  output.body = 1;
  m.outputs = {output};
  return m;
}

/// The bar's angle as the pivot's, the motor's and the output's.
inline constexpr Coordinate kAnglesOfBar[] = {{Coordinate::Kind::kJoint, 0, 0},
                                              {Coordinate::Kind::kDrive, 0, 0},
                                              {Coordinate::Kind::kOutput, 0, 5}};

/// A moment about z on the bar that follows one of its angles.
inline Load MomentOnBar(const Coordinate& angle, std::function<double(double)> moment) {
  Load load{.name = "follower", .body = 1, .force = {}, .moment = {}};
  load.following.push_back(
      {5, {.inputs = {{angle, false, 0.3}}, .value = [=](double, std::span<const double> x) {
             return moment(x[0]);
           }}});
  return load;
}
/// −k (angle − 0.4).
inline Load SpringOn(const Coordinate& angle, double k) {
  return MomentOnBar(angle, [k](double q) { return -k * (q - 0.4); });
}
/// Has no finite value beyond an angle.
inline Load NotFiniteBeyond(double angle, bool infinite) {
  return MomentOnBar(kAnglesOfBar[0], [=](double q) {
    return infinite ? (q > angle ? HUGE_VAL : 0.0) : std::sqrt(angle - q);
  });
}
/// Component, time and coordinate of such a load.
inline bool NamesTheLoad(const RunSummary& summary, bool infinite) {
  const auto contains = [&](const std::string& text) {
    return summary.message.find(text) != std::string::npos;
  };
  return summary.stop == Stop::kUnsupported && summary.where == "loads.follower.moment[2]" &&
         contains(infinite ? "is infinite at t = " : "is not a number at t = ") &&
         contains("pivot.position = ");
}

/// Everything driven stays at these positions.
inline auto HoldStill(std::vector<double> positions) {
  return [positions](double, DrivenSample* driven) {
    const auto n = static_cast<Eigen::Index>(positions.size());
    driven->position = Eigen::Map<const VecX>(positions.data(), n);
    driven->velocity.setZero(n);
    driven->acceleration.setZero(n);
    return RunSummary::Done();
  };
}

/// A serial chain with one joint of every kind that has coordinates in MuJoCo, with skew frames and
/// axes, at a pose away from zero. `reversed`: every joint is described from tip to base.
inline Mechanism MakeJointZoo(bool reversed) {
  Mechanism m;
  m.name = reversed ? "joint_zoo_reversed" : "joint_zoo";
  Body world;
  world.name = "world";
  m.bodies.push_back(world);
  const JointKind kinds[] = {JointKind::kRevolute, JointKind::kPrismatic,   JointKind::kUniversal,
                             JointKind::kPlanar,   JointKind::kCylindrical, JointKind::kFixed};
  int last = 0;
  for (const JointKind kind : kinds) {
    const int n = static_cast<int>(m.bodies.size());
    Body body = MakeBody("body" + std::to_string(n), 1.0 + 0.1 * n, {0.01, -0.02, 0.03 * n},
                         {0.02, 0.03, 0.04});
    body.I_Bcm_B(0, 1) = body.I_Bcm_B(1, 0) = 0.003;
    m.bodies.push_back(body);
    Joint joint = MakeJoint("joint" + std::to_string(n), kind, last, {0.1, 0.2, -0.1}, n,
                            {-0.05, 0.1, 0.02 * n});
    joint.X_PF.linear() = RotRpy({0.2 * n, -0.3, 0.5});
    joint.X_CM.linear() = RotRpy({-0.4, 0.1 * n, 0.2});
    joint.axis = Vec3(0.6, 0.0, 0.8);
    joint.axis2 = Vec3(0.8, 0.0, -0.6);
    joint.home = {0.3, -0.2, 0.4, 0, 0, 0};
    for (int k = DofsOf(kind); k < 6; ++k) joint.home[k] = 0.0;
    if (reversed) {
      std::swap(joint.parent, joint.child);
      std::swap(joint.X_PF, joint.X_CM);
    }
    m.joints.push_back(joint);
    m.tree_joints.push_back(n - 1);
    m.tree_reversed.push_back(reversed);
    last = n;
  }
  std::vector<std::array<double, 6>> q;
  for (const Joint& joint : m.joints) q.push_back(joint.home);
  m.X_WB_home = TreePoses(m, q);
  return m;
}

}  // namespace mbv::fixtures
