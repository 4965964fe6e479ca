// A 3-SPR Mechanism made by hand, with the shipped model's names and numbers, so that the closed
// form is tested without the loader.
#pragma once

#include <fmt/format.h>

#include <numbers>

#include "analytic/spr_tripod/dynamics.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv::spr_tripod {

inline Masses DefaultMasses() {
  const auto inertia = [](double m, double z, double xx, double zz) {
    return Inertia{m, Vec3(0, 0, z), Vec3(xx, xx, zz).asDiagonal()};
  };
  return {.platform = inertia(30, 0.05, 0.40, 0.52),
          .cylinder = inertia(6, 0.15, 0.082, 0.005),
          .rod = inertia(4, -0.18, 0.055, 0.0015)};
}

inline Mechanism TripodByHand() {
  using std::numbers::pi;
  Mechanism m;
  m.name = "spr_tripod";
  m.gravity_W = {0, 0, 9.81};
  const auto parameter = [&](const std::string& name, double value) {
    Parameter p;
    p.name = name;
    p.value = value;
    m.parameters.push_back(p);
  };
  for (const auto& [name, value] : {std::pair{"a", 0.210},
                                    {"b", 0.455},
                                    {"q_min", 0.5},
                                    {"q_max", 0.75},
                                    {"phi_1", 2 * pi / 3},
                                    {"phi_2", -2 * pi / 3},
                                    {"phi_3", 0.0},
                                    {"theta_1", pi / 6},
                                    {"theta_2", 5 * pi / 6},
                                    {"theta_3", pi / 2}}) {
    parameter(name, value);
  }
  const auto body = [&](const std::string& name, const Inertia& inertia) {
    parameter("m_" + name, inertia.mass);
    for (int k = 0; k < 3; ++k) {
      parameter(fmt::format("c_{}_{}", name, "xyz"[k]), inertia.com[k]);
      parameter(fmt::format("I_{}_{}{}", name, "xyz"[k], "xyz"[k]), inertia.I(k, k));
    }
  };
  body("platform", DefaultMasses().platform);
  body("cyl", DefaultMasses().cylinder);
  body("rod", DefaultMasses().rod);
  for (const char* name : {"world", "platform", "cyl1", "cyl2", "cyl3", "rod1", "rod2", "rod3"}) {
    m.bodies.emplace_back().name = name;
  }
  for (int leg = 1; leg <= 3; ++leg) {
    const auto joint = [&](const char* name, JointKind kind, int parent, int child) {
      Joint j;
      j.name = fmt::format("leg{}.{}", leg, name);
      j.kind = kind;
      j.parent = parent;
      j.child = child;
      m.joints.push_back(j);
    };
    joint("S", JointKind::kSpherical, 0, 1 + leg);
    joint("P", JointKind::kPrismatic, 1 + leg, 4 + leg);
    joint("R", JointKind::kRevolute, 4 + leg, 1);
    Drive drive;
    drive.name = fmt::format("leg{}", leg);
    drive.kind = JointDrive{3 * leg - 2, 0};
    drive.range = {0.5, 0.75};
    m.drives.push_back(drive);
  }
  Output output;
  output.name = "platform";
  output.body = 1;
  m.outputs.push_back(output);
  return m;
}

/// Commands platform.x, y, z.
inline Motion TaskMotion(std::array<Profile, 3> xyz, double duration_s, double sample_s) {
  Motion motion;
  motion.duration_s = duration_s;
  motion.sample_s = sample_s;
  for (int k = 0; k < 3; ++k) {
    const Coordinate c{Coordinate::Kind::kOutput, 0, k};
    motion.commands.push_back({fmt::format("platform.{}", "xyz"[k]), {{c, 1.0}}, xyz[k]});
  }
  return motion;
}

/// The default path P1 P2 P3 P4 in the plane of azimuth gamma [rad], scaled to R, h, at height z_c.
inline Motion PathMotion(double gamma, double R = 0.12, double h = 0.06, double z_c = 0.57,
                         double sample_s = 1e-3) {
  const RampCruiseTerm up{0.0, h, 0.75, 10.0, h};
  RampCruiseTerm across{Duration(up), 2 * R, 0.75, 10.0, 2 * R};
  RampCruiseTerm down{Duration(up) + Duration(across), h, 0.75, 10.0, -h};
  const double end = down.start_s + Duration(down);
  const auto along = [&](double factor) {
    RampCruiseTerm term = across;
    term.delta *= factor;
    return Profile{{ConstantTerm{-R * factor}, term}};
  };
  return TaskMotion({along(std::cos(gamma)), along(std::sin(gamma)),
                     Profile{{ConstantTerm{z_c - 0.5 * h}, up, down}}},
                    end, sample_s);
}

}  // namespace mbv::spr_tripod
