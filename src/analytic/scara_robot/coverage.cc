#include "analytic/scara_robot/coverage.h"

#include <cmath>

#include "analytic/scara_robot/dynamics.h"
#include "core/spatial.h"

namespace mbv::scara {
namespace {

constexpr JointKind kRevolute = JointKind::kRevolute, kSpherical = JointKind::kSpherical;
const Vec3 kX = Vec3::UnitX(), kY = Vec3::UnitY(), kZ = Vec3::UnitZ();

std::string Named(int limb, const char* part) { return std::string(LimbName(limb)) + part; }

void AddPassive(const std::string& name, JointKind kind, const std::string& parent,
                const std::string& child, const Vec3& p_parent, const Vec3& p_child,
                const Vec3& axis_parent, const Vec3& axis_child, Coverage* c) {
  c->joints.push_back({.name = name,
                       .kind = kind,
                       .parent = parent,
                       .child = child,
                       .p_parent = p_parent,
                       .p_child = p_child,
                       .axis_parent = axis_parent,
                       .axis_child = axis_child,
                       .reversible = true});
}

void AddBall(const std::string& name, const std::string& parent, const std::string& child,
             const Vec3& p_parent, const Vec3& p_child, Coverage* c) {
  AddPassive(name, kSpherical, parent, child, p_parent, p_child, kAnyVector, kAnyVector, c);
}

void AddMotor(const ParameterReader& read, int limb, double stiffness, Coverage* c) {
  const double alpha = limb * EIGEN_PI / 2;
  c->joints.push_back({.name = Named(limb, ".motor"),
                       .kind = kRevolute,
                       .parent = "world",
                       .child = Named(limb, ".arm"),
                       .p_parent = read("R") * Radial(limb),
                       .p_child = Vec3::Zero(),
                       .axis_parent = MotorAxis(limb),
                       .axis_child = kY,
                       .R_zero = RotZ(alpha)});
  c->drives.push_back(
      {.name = Named(limb, ".drive"), .joint = Named(limb, ".motor"), .stiffness = stiffness});
}

Mat3 Bar(const BarInertia& inertia) {
  return Vec3(inertia.axial, inertia.transverse, inertia.transverse).asDiagonal();
}

// The platform without the pivots that are booked on the bars at B_1 and B_2.
void StatePlatform(const ParameterReader& read, Coverage* c) {
  const double m_p = read("m_p"), pivot = read("pivot_mass", 0.0), r = read("r");
  const double m = m_p - 2 * pivot, com = -pivot * r / m;
  Mat3 I = kAnyMatrix;
  I(2, 2) = read("I_p_z") - 2 * pivot * r * r - 2 * m * com * com;
  c->bodies.push_back({.name = "platform",
                       .mass = m,
                       .com = Vec3(com, com, kNan),
                       .inertia = I,
                       .why = "with the pivots its centre of mass is at P, over it or under it"});
}

void StateArm(const ParameterReader& read, int limb, Coverage* c) {
  const double l1 = read("l1"), mass = read("m_arm");
  Mat3 I = kAnyMatrix;
  I(1, 1) = SolidBar(mass, read("arm_radius"), l1).transverse;
  c->bodies.push_back({.name = Named(limb, ".arm"),
                       .mass = mass,
                       .com = Vec3(read("arm_com") * l1, kNan, 0),
                       .inertia = I,
                       .why = "a round bar with its centre of mass at arm_com of its length",
                       .takes_loads = false});
}

// Rods of a parallelogram without the balls that are booked on the bar, and the bar, which does
// not turn.
void StateParallelogram(const ParameterReader& read, int limb, Coverage* c) {
  const double l2 = read("l2"), half = read("m_rods") / 2, ball = read("ball_mass", 0.0);
  const double m = half - ball, com = (half / 2 - ball) * l2 / m;
  BarInertia inertia = SolidBar(half, read("rod_radius"), l2);
  inertia.transverse += half * (l2 / 2 - com) * (l2 / 2 - com) - ball * (l2 - com) * (l2 - com);
  for (const char* rod : {".rod_a", ".rod_b"}) {
    c->bodies.push_back({.name = Named(limb, rod),
                         .mass = m,
                         .com = com * kX,
                         .inertia = Bar(inertia),
                         .why = "with its ball a round bar with its centre of mass in the middle",
                         .takes_loads = false});
  }
  c->bodies.push_back({.name = Named(limb, ".bar"),
                       .mass = 2 * ball + read("pivot_mass", 0.0),
                       .why = "two balls and a pivot; the bar does not turn",
                       .takes_loads = false});
}

void StateParallelogramJoints(const ParameterReader& read, int limb, Coverage* c) {
  const std::string arm = Named(limb, ".arm"), bar = Named(limb, ".bar"),
                    rod_a = Named(limb, ".rod_a"), rod_b = Named(limb, ".rod_b");
  const double l1 = read("l1"), l2 = read("l2");
  const Vec3 half = read("d") / 2 * kY, D = read("r") * Radial(limb) + read("e") * kZ;
  AddPassive(Named(limb, ".pivot"), kRevolute, "platform", bar, D, Vec3::Zero(), kZ, kZ, c);
  AddPassive(Named(limb, ".cross_bar"), JointKind::kPlanar, rod_a, rod_b, l2 / 2 * kX, l2 / 2 * kX,
             kZ, kZ, c);
  AddBall(Named(limb, ".ball_C_a"), rod_a, arm, Vec3::Zero(), l1 * kX + half, c);
  AddBall(Named(limb, ".ball_C_b"), rod_b, arm, Vec3::Zero(), l1 * kX - half, c);
  AddBall(Named(limb, ".ball_D_a"), rod_a, bar, l2 * kX, half, c);
  AddBall(Named(limb, ".ball_D_b"), rod_b, bar, l2 * kX, -half, c);
}

void StateRod(const ParameterReader& read, int limb, Coverage* c) {
  const double l3 = read("l3"), mass = read("m_rods");
  c->bodies.push_back({.name = Named(limb, ".rod"),
                       .mass = mass,
                       .com = l3 / 2 * kX,
                       .inertia = Bar(SolidBar(mass, read("rod_radius"), l3)),
                       .why = "a round bar with its centre of mass in the middle",
                       .takes_loads = false});
}

void StateRodJoints(const ParameterReader& read, int limb, Coverage* c) {
  const std::string rod = Named(limb, ".rod");
  AddPassive(Named(limb, ".wrist"), JointKind::kUniversal, Named(limb, ".arm"), rod,
             read("l1") * kX, Vec3::Zero(), kY, kZ, c);
  AddBall(Named(limb, ".ball_B"), rod, "platform", read("l3") * kX, read("r") * Radial(limb), c);
}

void AddCoveredBeam(const ParameterReader& read, const std::string& name, double length,
                    Coverage* c) {
  const double r = read("section_diameter") / 2, E = read("E");
  const double area = EIGEN_PI * r * r, I = area * r * r / 4;
  c->beams.push_back({.name = name,
                      .length = length,
                      .section = {.area = area, .I_y = I, .I_z = I, .torsion = 2 * I},
                      .youngs_modulus = E,
                      .shear_modulus = E / (2 * (1 + read("nu")))});
}

// R-Pa-R of the elastic model: hubs in the plane of the parallelogram, the short rod below.
void StateElasticParallelogram(const ParameterReader& read, int limb, Coverage* c) {
  const std::string arm = Named(limb, ".arm"), hub_C = Named(limb, ".hub_C"),
                    rod_a = Named(limb, ".rod_a"), rod_b = Named(limb, ".rod_b"),
                    hub_D = Named(limb, ".hub_D"), bar = Named(limb, ".bar");
  for (const std::string& body : {arm, hub_C, rod_a, rod_b, hub_D, bar}) {
    c->bodies.push_back({.name = body, .why = {}});
  }
  const Vec3 zero = Vec3::Zero(), half = read("d") / 2 * kY, tip = read("l2") * kX;
  const auto hinge = [&](const char* name, const std::string& parent, const std::string& child,
                         const Vec3& p_parent, const Vec3& p_child, const Vec3& axis) {
    AddPassive(Named(limb, name), kRevolute, parent, child, p_parent, p_child, axis, axis, c);
  };
  hinge(".hinge_C", arm, hub_C, read("l1") * kX, zero, kY);
  hinge(".hinge_C_a", hub_C, rod_a, half, zero, kZ);
  hinge(".hinge_C_b", hub_C, rod_b, -half, zero, kZ);
  hinge(".hinge_D_a", rod_a, hub_D, tip, half, kZ);
  hinge(".hinge_D_b", rod_b, hub_D, tip, -half, kZ);
  hinge(".hinge_D", hub_D, bar, zero, zero, kY);
  hinge(".pivot", bar, "platform", -read("e") * kZ, read("r") * Radial(limb), kZ);
  for (const std::string& rod : {rod_a, rod_b}) AddCoveredBeam(read, rod, read("l2"), c);
  AddCoveredBeam(read, bar, read("e"), c);
}

}  // namespace

Coverage CoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the SCARA robot";
  const ParameterReader read(mechanism, &c);
  for (const char* name : {"home_x", "home_y", "home_z", "home_phi"}) (void)read(name);
  StatePlatform(read, &c);
  const double branch = read("branch") < 0.0 ? -1.0 : 1.0;
  for (int limb = 0; limb < kLimbs; ++limb) {
    AddMotor(read, limb, kNan, &c);
    // V_i: the arm turns towards its z axis reversed.
    const std::string rod = Named(limb, limb < 2 ? ".rod_a" : ".rod");
    StateBranch(
        "body " + rod,
        -branch * HomeAxis(mechanism, rod, 0).dot(HomeAxis(mechanism, Named(limb, ".arm"), 2)),
        "the sign in (10) that the parameter branch chooses", &c);
    StateArm(read, limb, &c);
    if (limb < 2) {
      StateParallelogram(read, limb, &c);
      StateParallelogramJoints(read, limb, &c);
    } else {
      StateRod(read, limb, &c);
      StateRodJoints(read, limb, &c);
    }
  }
  c.outputs = {{.name = "platform", .body = "platform"}};
  return c;
}

Coverage StiffnessCoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the SCARA robot's stiffness";
  const ParameterReader read(mechanism, &c);
  (void)read("branch");
  c.bodies.push_back({.name = "platform", .why = {}});
  for (int limb = 0; limb < kLimbs; ++limb) {
    AddMotor(read, limb, read("K_act"), &c);
    AddCoveredBeam(read, Named(limb, ".arm"), read("l1"), &c);
    if (limb < 2) {
      StateElasticParallelogram(read, limb, &c);
      continue;
    }
    c.bodies.push_back({.name = Named(limb, ".arm"), .why = {}});
    c.bodies.push_back({.name = Named(limb, ".rod"), .why = {}});
    AddCoveredBeam(read, Named(limb, ".rod"), read("l3"), &c);
    StateRodJoints(read, limb, &c);
  }
  c.outputs = {{.name = "platform", .body = "platform"}};
  return c;
}

}  // namespace mbv::scara
