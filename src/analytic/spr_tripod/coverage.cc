#include "analytic/spr_tripod/coverage.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "analytic/spr_tripod/geometry.h"

namespace mbv::spr_tripod {
namespace {

AssumedBody BodyOf(const ParameterReader& read, const std::string& name, const std::string& stem) {
  Mat3 I;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      const std::string moment = fmt::format("I_{}_{}{}", stem, "xyz"[i], "xyz"[j]);
      I(i, j) = I(j, i) = i == j ? read(moment) : read(moment, 0.0);
    }
  }
  return {.name = name,
          .mass = read("m_" + stem),
          .com = read.Vector("c_" + stem),
          .inertia = I,
          .why = fmt::format("m_{0}, c_{0}_…, I_{0}_…; the legs are equal", stem)};
}

// The paper's azimuths, on which its position problem rests.
void StateAzimuths(const ParameterReader& read, int leg, Coverage* c) {
  constexpr double kPaper[] = {2 * std::numbers::pi / 3, -2 * std::numbers::pi / 3, 0.0};
  const double phi = read(fmt::format("phi_{}", leg + 1));
  const double theta = read(fmt::format("theta_{}", leg + 1));
  c->numbers.push_back({.subject = fmt::format("parameter phi_{}", leg + 1),
                        .quantity = fmt::format("its distance to {:.6g} rad", kPaper[leg]),
                        .actual = std::remainder(phi - kPaper[leg], 2 * std::numbers::pi),
                        .assumed = 0.0,
                        .unit = "rad",
                        .why = "joints at 120, -120 and 0 deg"});
  c->numbers.push_back({.subject = fmt::format("parameter theta_{}", leg + 1),
                        .quantity = "cos(theta - phi)",
                        .actual = std::cos(theta - kPaper[leg]),
                        .assumed = 0.0,
                        .unit = {},
                        .why = "hinges are perpendicular to O_A A_i"});
}

void StateLeg(const ParameterReader& read, int leg, Coverage* c) {
  const std::string name = fmt::format("leg{}", leg + 1);
  const std::string cyl = name + ".cyl", rod = name + ".rod";
  const double phi = read(fmt::format("phi_{}", leg + 1));
  const double theta = read(fmt::format("theta_{}", leg + 1));
  const Vec3 radial(std::cos(phi), std::sin(phi), 0), zero = Vec3::Zero();
  c->bodies.push_back(BodyOf(read, cyl, "cyl"));
  c->bodies.push_back(BodyOf(read, rod, "rod"));
  c->joints.push_back({.name = name + ".S",
                       .kind = JointKind::kSpherical,
                       .parent = "world",
                       .child = cyl,
                       .p_parent = read("b") * radial,
                       .p_child = zero});
  c->joints.push_back({.name = name + ".P",
                       .kind = JointKind::kPrismatic,
                       .parent = cyl,
                       .child = rod,
                       .p_parent = zero,
                       .p_child = zero,
                       .axis_parent = Vec3::UnitZ(),
                       .axis_child = Vec3::UnitZ(),
                       .R_zero = Mat3::Identity()});
  c->joints.push_back({.name = name + ".R",
                       .kind = JointKind::kRevolute,
                       .parent = "platform",
                       .child = rod,
                       .p_parent = read("a") * radial,
                       .p_child = zero,
                       .axis_parent = Vec3(std::cos(theta), std::sin(theta), 0),
                       .axis_child = Vec3::UnitX(),
                       .reversible = true});
  c->drives.push_back({.name = name, .joint = name + ".P"});
}

}  // namespace

Coverage CoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the 3-SPR mechanism";
  const ParameterReader read(mechanism, &c);
  for (const char* name : {"q_min", "q_max"}) (void)read(name);
  c.bodies.push_back(BodyOf(read, "platform", "platform"));
  for (int leg = 0; leg < 3; ++leg) {
    StateAzimuths(read, leg, &c);
    StateLeg(read, leg, &c);
  }
  return c;
}

}  // namespace mbv::spr_tripod
