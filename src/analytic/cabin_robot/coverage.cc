#include "analytic/cabin_robot/coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "analytic/cabin_robot/cabin_dynamics.h"
#include "analytic/cabin_robot/stiffness.h"
#include "core/spatial.h"

namespace mbv::cabin {
namespace {

// A quarter turn about x, α2, α3 and α5 of Table 1, and the slide's constant turn (α4, θ5).
Mat3 Twist() { return RotX(-EIGEN_PI / 2); }
Mat3 SlideTurn() { return Twist() * RotZ(-EIGEN_PI / 2); }

struct Link {
  std::string name, parent, child;
  JointKind kind;
  Vec3 p_parent, p_child;
  Mat3 R_zero;
  Vec3 axis;  ///< in the child's frame
};

void Add(const Link& link, Coverage* c) {
  const bool fixed = link.kind == JointKind::kFixed;
  c->joints.push_back({.name = link.name,
                       .kind = link.kind,
                       .parent = link.parent,
                       .child = link.child,
                       .p_parent = link.p_parent,
                       .p_child = link.p_child,
                       .axis_parent = fixed ? kAnyVector : Vec3(link.R_zero * link.axis),
                       .axis_child = fixed ? kAnyVector : link.axis,
                       .R_zero = link.R_zero});
}

// Rail and sliders.
void StateSliders(Coverage* c) {
  constexpr JointKind kPrismatic = JointKind::kPrismatic;
  const Vec3 zero = Vec3::Zero(), x = Vec3::UnitX(), z = Vec3::UnitZ();
  const Mat3 same = Mat3::Identity();
  for (const Link& link : {Link{"d1", "world", "carriage", kPrismatic, zero, zero, same, z},
                           Link{"X1", "carriage", "sliderA", kPrismatic, zero, zero, same, x},
                           Link{"X2", "carriage", "sliderD", kPrismatic, zero, zero, same, x},
                           Link{"X3", "carriage", "sliderF", kPrismatic, zero, zero, same, x}}) {
    Add(link, c);
  }
}

// The planar linkage; passive hinges turn about z from where x axes are parallel.
void StatePlane(const ParameterReader& read, Coverage* c) {
  constexpr JointKind kRevolute = JointKind::kRevolute;
  const Vec3 zero = Vec3::Zero(), x = Vec3::UnitX(), z = Vec3::UnitZ();
  const Mat3 same = Mat3::Identity();
  const double L1 = read("L1"), L2 = read("L2"), L3 = read("L3"), L4 = read("L4");
  for (const Link& link : {Link{"A", "sliderA", "AB", kRevolute, zero, zero, same, z},
                           Link{"D", "sliderD", "CD", kRevolute, zero, zero, same, z},
                           Link{"F", "sliderF", "EF", kRevolute, zero, zero, same, z},
                           Link{"B", "AB", "platform", kRevolute, L1 * x, -L2 / 2 * x, same, z},
                           Link{"C", "CD", "platform", kRevolute, L3 * x, L2 / 2 * x, same, z},
                           Link{"E", "EF", "AB", kRevolute, L4 * x, L1 / 2 * x, same, z}}) {
    Add(link, c);
  }
}

void StateWrist(const ParameterReader& read, Coverage* c) {
  constexpr JointKind kRevolute = JointKind::kRevolute;
  const Vec3 zero = Vec3::Zero(), x = Vec3::UnitX(), z = Vec3::UnitZ();
  const Vec3 shoulder(read("a2"), read("d3"), 0), bearing(0, read("d6"), 0);
  for (const Link& link :
       {Link{"th3", "platform", "support", kRevolute, shoulder, zero, Twist(), z},
        Link{"th4", "support", "flip", kRevolute, read("a3") * x, zero, Twist(), z},
        Link{"d5", "flip", "table", JointKind::kPrismatic, read("a4") * x, zero, SlideTurn(), z},
        Link{"th6", "table", "slewing", kRevolute, bearing, zero, Twist(), z},
        Link{"payload_mount", "slewing", "payload", JointKind::kFixed, zero, zero, Mat3::Identity(),
             z}}) {
    Add(link, c);
  }
}

// One of the two linkages: `suffix` of its links and hinges, `z` of its plane.
void StateElasticPlane(const ParameterReader& read, const std::string& suffix, double z,
                       Coverage* c) {
  constexpr JointKind kRevolute = JointKind::kRevolute;
  const Vec3 zero = Vec3::Zero(), x = Vec3::UnitX(), up = Vec3::UnitZ(), plane(0, 0, z);
  const Mat3 same = Mat3::Identity();
  const double L1 = read("L1"), L2 = read("L2"), L3 = read("L3"), L4 = read("L4");
  const std::string AB = "AB" + suffix, CD = "CD" + suffix, EF = "EF" + suffix;
  const Vec3 p_B = plane - L2 / 2 * x, p_C = plane + L2 / 2 * x;
  for (const Link& link : {Link{"A" + suffix, "sliderA", AB, kRevolute, plane, zero, same, up},
                           Link{"D" + suffix, "sliderD", CD, kRevolute, plane, zero, same, up},
                           Link{"F" + suffix, "sliderF", EF, kRevolute, plane, zero, same, up},
                           Link{"B" + suffix, AB, "platform", kRevolute, L1 * x, p_B, same, up},
                           Link{"C" + suffix, CD, "platform", kRevolute, L3 * x, p_C, same, up},
                           Link{"E" + suffix, EF, AB, kRevolute, L4 * x, L1 / 2 * x, same, up}}) {
    Add(link, c);
  }
}

void StateElasticWrist(const ParameterReader& read, Coverage* c) {
  constexpr JointKind kRevolute = JointKind::kRevolute, kFixed = JointKind::kFixed;
  const Vec3 zero = Vec3::Zero(), x = Vec3::UnitX(), z = Vec3::UnitZ();
  const Mat3 same = Mat3::Identity();
  Mat3 bearing;  // z6 along x4, x6 along z4
  bearing << 0, 0, 1, 0, -1, 0, 1, 0, 0;
  const Vec3 head(0, 0, read("d3")), end(0, read("d5"), 0);
  const Vec3 tip = (read("a4") + read("d6")) * x;
  for (const Link& link :
       {Link{"th3", "platform", "column", kRevolute, read("a2") * x, zero, Twist(), z},
        Link{"shoulder", "column", "arm", kFixed, head, zero, same, z},
        Link{"th4", "arm", "rail", kRevolute, read("a3") * x, zero, Twist(), z},
        Link{"slide", "rail", "tool", kFixed, end, zero, same, z},
        Link{"th6", "tool", "slewing", kRevolute, tip, zero, bearing, z}}) {
    Add(link, c);
  }
}

// A beam of rectangular section; b along its z axis, h along y.
void AddBeam(const ParameterReader& read, const std::string& name, const std::string& section,
             double length, Coverage* c) {
  const double b = read("b_" + section), h = read("h_" + section);
  const bool printed = read("torsion_printed", 0.0) != 0.0;
  const bool known = std::isfinite(b) && std::isfinite(h);
  c->beams.push_back({.name = name,
                      .length = length,
                      .section = {.area = b * h,
                                  .I_y = b * b * b * h / 12.0,
                                  .I_z = b * h * h * h / 12.0,
                                  .torsion = known ? TorsionConstant(b, h, printed) : kNan},
                      .youngs_modulus = read("E"),
                      .shear_modulus = read("G")});
}

void StateBeams(const ParameterReader& read, Coverage* c) {
  for (const std::string suffix : {"", "2"}) {
    AddBeam(read, "AB" + suffix + ".AE", "AB", read("L1") / 2, c);
    AddBeam(read, "AB" + suffix + ".EB", "AB", read("L1") / 2, c);
    AddBeam(read, "CD" + suffix, "CD", read("L3"), c);
    AddBeam(read, "EF" + suffix, "EF", read("L4"), c);
  }
  AddBeam(read, "column", "column", read("d3"), c);
  AddBeam(read, "arm", "arm", read("a3"), c);
  AddBeam(read, "rail", "rail", std::abs(read("d5")), c);
  AddBeam(read, "tool", "tool", read("a4") + read("d6"), c);
}

// The inverse problem's branch.
void StateAssembly(const Mechanism& mechanism, Coverage* c) {
  for (const char* link : {"AB", "CD", "EF"}) {
    const Vec3 along = HomeAxis(mechanism, link, 0);
    const double lean = link == std::string("AB") ? along.x() : -along.x();
    StateBranch(std::string("body ") + link, std::min(along.y(), lean),
                "AB leans right, CD and EF lean left, all upwards", c);
  }
}

}  // namespace

Coverage CoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the cabin robot";
  const ParameterReader read(mechanism, &c);
  for (const char* name : kBodyNames) {
    const std::string body = name;
    c.bodies.push_back({.name = body,
                        .mass = read("m_" + body),
                        .com = read.Vector("c_" + body),
                        .inertia = read.Vector("I_" + body).asDiagonal(),
                        .why = "the body frame's axes are principal axes"});
  }
  StateSliders(&c);
  StatePlane(read, &c);
  StateWrist(read, &c);
  StateAssembly(mechanism, &c);
  for (const char* drive : kDriveNames) c.drives.push_back({.name = drive, .joint = drive});
  c.outputs = {{.name = "platform", .body = "platform"}, {.name = "tool", .body = "slewing"}};
  return c;
}

Coverage StiffnessCoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the cabin robot's stiffness";
  const ParameterReader read(mechanism, &c);
  for (const char* body : {"carriage", "sliderA", "sliderD", "sliderF", "AB", "AB2", "CD", "CD2",
                           "EF", "EF2", "platform", "column", "arm", "rail", "tool", "slewing"}) {
    c.bodies.push_back({.name = body, .why = {}});
  }
  StateSliders(&c);
  const double w = read("w");
  StateElasticPlane(read, "", w / 2, &c);
  StateElasticPlane(read, "2", -w / 2, &c);
  StateElasticWrist(read, &c);
  StateBeams(read, &c);
  for (const char* drive : kDriveNames) {
    if (drive == std::string("d5")) continue;  // its length is the rail's
    c.drives.push_back(
        {.name = drive, .joint = drive, .stiffness = std::numeric_limits<double>::infinity()});
  }
  c.outputs = {{.name = "tool", .body = "slewing"}};
  return c;
}

}  // namespace mbv::cabin
