#include "analytic/stabilizing_platform/coverage.h"

#include <fmt/format.h>

#include <cmath>

#include "analytic/stabilizing_platform/parameters.h"

namespace mbv::stabilizing_platform {
namespace {

constexpr JointKind kRevolute = JointKind::kRevolute, kPrismatic = JointKind::kPrismatic;
const Mat3 kParallel = Mat3::Identity();

// Heave, roll and pitch, in this order, and the deck.
void StateShip(const ParameterReader& read, Coverage* c) {
  const Vec3 zero = Vec3::Zero();
  for (const char* body : {"ship_heave", "ship_roll", "ship", "lower_platform"}) {
    c->bodies.push_back({.name = body, .why = {}});
  }
  const auto add = [&](const char* name, JointKind kind, const char* parent, const char* child,
                       const Vec3& axis) {
    c->joints.push_back({.name = name,
                         .kind = kind,
                         .parent = parent,
                         .child = child,
                         .p_parent = zero,
                         .p_child = zero,
                         .axis_parent = axis,
                         .axis_child = axis,
                         .R_zero = kParallel});
    c->prescribed.push_back({.name = name, .joint = name});
  };
  add("heave", kPrismatic, "world", "ship_heave", Vec3::UnitZ());
  add("roll", kRevolute, "ship_heave", "ship_roll", Vec3::UnitX());
  add("pitch", kRevolute, "ship_roll", "ship", Vec3::UnitY());
  c->joints.push_back({.name = "deck",
                       .kind = JointKind::kFixed,
                       .parent = "ship",
                       .child = "lower_platform",
                       .p_parent = zero,
                       .p_child = Vec3(0, 0, -read("s_r_so")),
                       .R_zero = kParallel});
}

void StatePlatform(const ParameterReader& read, Coverage* c) {
  c->bodies.push_back({.name = "platform",
                       .mass = read("m_p"),
                       .com = read.Vector("c_p", 0.0),
                       .inertia = read.Vector("I_p").asDiagonal(),
                       .why = "the platform's principal axes are those of {p}"});
  c->outputs.push_back({.name = "platform", .body = "platform"});
}

void StateLinks(const ParameterReader& read, const std::string& limb, Coverage* c) {
  const double scale = read("link_mass_scale", 1.0);
  const double inertia_scale = read("link1_inertia_scale", 1.0);
  for (int k = 0; k < 4; ++k) {
    const std::string stem = kLinkStems[k];
    const bool first = k == kLink1 || k == kLink1p;
    const double length = read(first ? "L1" : "L3"), fraction = read(first ? "c_1" : "c_2");
    const double factor = scale * (first ? inertia_scale : 1.0);
    c->bodies.push_back(
        {.name = limb + kLinkNames[k],
         .mass = scale * read("m_" + stem),
         .com =
             Vec3(read("c_" + stem + "_x", 0.0), fraction * length, read("c_" + stem + "_z", 0.0)),
         .inertia = (factor * read.Vector("I_" + stem)).asDiagonal(),
         .why = fmt::format("the centre of mass is at (c_{0}_x, {1} of the length, c_{0}_z), the "
                            "principal axes are along and across the link",
                            stem, first ? "c_1" : "c_2")});
  }
}

// Joints and drives of one limb; `e_r`, `e_t`: radial and tangential unit vectors.
void StateLimb(const ParameterReader& read, int index, double azimuth, Coverage* c) {
  const std::string limb = fmt::format("limb{}.", index + 1);
  const Vec3 e_r(std::cos(azimuth), std::sin(azimuth), 0), e_t(-e_r.y(), e_r.x(), 0);
  const Vec3 X = Vec3::UnitX(), Y = Vec3::UnitY(), zero = Vec3::Zero();
  const double r_a = read("r_a"), theta = read("theta_3"), L2 = read("L2");
  const Vec3 elbow = read("L1") * Y, tip = read("L3") * Y;
  const auto add = [&](const char* name, JointKind kind, const std::string& parent,
                       const std::string& child, const Vec3& p_parent, const Vec3& p_child,
                       const Vec3& axis_parent, const Vec3& axis_child) {
    c->joints.push_back({.name = limb + name,
                         .kind = kind,
                         .parent = parent,
                         .child = child,
                         .p_parent = p_parent,
                         .p_child = p_child,
                         .axis_parent = axis_parent,
                         .axis_child = axis_child,
                         .reversible = true});
  };
  for (int j = 0; j < 2; ++j) {
    const double s = kSides[j];
    const std::string suffix = j == 0 ? "" : "_p";
    const std::string link1 = limb + "link1" + suffix, link2 = limb + "link2" + suffix;
    add(j == 0 ? "U1" : "U1_p", JointKind::kUniversal, "lower_platform", link1,
        r_a * e_r - s * read("L5") * e_t, zero, e_t, X);
    add(j == 0 ? "R12" : "R12_p", kRevolute, link1, link2, elbow, zero, X, X);
    c->drives.push_back({.name = limb + "drive" + suffix,
                         .joint = {},
                         .body_from = "lower_platform",
                         .body_to = link1,
                         .p_from = r_a * e_r + s * read("L4") * e_t,
                         .p_to = Vec3(0, L2 * std::cos(theta), s * L2 * std::sin(theta))});
  }
  add("R22", kRevolute, limb + "link2", limb + "link2_p", tip, tip, X, X);
  add("S", JointKind::kSpherical, limb + "link2", "platform", tip, read("r_b") * e_r, kAnyVector,
      kAnyVector);
}

// Links 1 and 2 of a side at home: the elbow lies outside, links 1 and 1' cross.
void StateAssembly(const Mechanism& mechanism, int index, Coverage* c) {
  for (int j = 0; j < 2; ++j) {
    const std::string limb = fmt::format("limb{}.", index + 1);
    const std::string link1 = limb + kLinkNames[size_t(kLink1 + j)];
    const std::string link2 = limb + kLinkNames[size_t(kLink2 + j)];
    const Vec3 d1 = HomeAxis(mechanism, link1, 1), d2 = HomeAxis(mechanism, link2, 1);
    StateBranch("body " + link2,
                kSides[size_t(j)] * d1.cross(d2).dot(HomeAxis(mechanism, link1, 0)),
                "the minus root of (20), links 1 and 1' cross", c);
  }
}

}  // namespace

Coverage CoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the stabilizing platform";
  const ParameterReader read(mechanism, &c);
  (void)read("z_0");
  const double g = read("g");
  const char* axes[] = {"x", "y"};
  for (int k = 0; k < 2; ++k) {
    c.numbers.push_back({.subject = "gravity",
                         .quantity = std::string("component ") + axes[k],
                         .actual = mechanism.gravity_W[k],
                         .assumed = 0.0,
                         .scale = std::abs(g),
                         .unit = "m/s^2",
                         .why = "gravity is along z",
                         .inertial = true});
  }
  StateShip(read, &c);
  StatePlatform(read, &c);
  for (int i = 0; i < 3; ++i) {
    const double azimuth = i == 0 ? 0.0 : read(i == 1 ? "theta_1" : "theta_2");
    StateLinks(read, fmt::format("limb{}.", i + 1), &c);
    StateLimb(read, i, azimuth, &c);
    StateAssembly(mechanism, i, &c);
  }
  return c;
}

}  // namespace mbv::stabilizing_platform
