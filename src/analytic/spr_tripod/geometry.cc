#include "analytic/spr_tripod/geometry.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace mbv::spr_tripod {
namespace {

using std::numbers::pi;

constexpr PerLeg<double> kPhi = {2 * pi / 3, -2 * pi / 3, 0.0};
constexpr PerLeg<double> kTheta = {pi / 6, 5 * pi / 6, pi / 2};

// Azimuths are typed as fractions of π; anything beyond rounding is another mechanism.
constexpr double kAngleTolerance = 1e-9;

// Value of a parameter; a missing one is an error, or `fallback` where one is given.
double Read(const Mechanism& mechanism, const std::string& name, Diagnostics* diagnostics,
            double fallback = kNan) {
  if (mechanism.HasParameter(name)) return mechanism.ParameterValue(name);
  if (std::isnan(fallback)) {
    diagnostics->AddError("", mechanism.name + " has no parameter '" + name + "'",
                          "the closed form reads its constants from the model's parameters");
  }
  return fallback;
}

Inertia ReadInertia(const Mechanism& mechanism, const std::string& body, Diagnostics* diagnostics) {
  const auto read = [&](const std::string& name, double fallback = kNan) {
    return Read(mechanism, name, diagnostics, fallback);
  };
  Inertia inertia;
  inertia.mass = read("m_" + body);
  for (int k = 0; k < 3; ++k) inertia.com[k] = read("c_" + body + "_" + "xyz"[k]);
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      const std::string name = fmt::format("I_{}_{}{}", body, "xyz"[i], "xyz"[j]);
      inertia.I(i, j) = inertia.I(j, i) = read(name, i == j ? kNan : 0.0);
    }
  }
  return inertia;
}

Vec3 Direction(double azimuth) { return {std::cos(azimuth), std::sin(azimuth), 0.0}; }

}  // namespace

Geometry PaperGeometry(double a, double b) {
  Geometry g{.a = a, .b = b};
  for (int i = 0; i < 3; ++i) {
    g.f[i] = Direction(kPhi[i]);
    g.c[i] = Direction(kTheta[i]);
  }
  return g;
}

Geometry ReadGeometry(const Mechanism& mechanism, Diagnostics* diagnostics) {
  Geometry g = PaperGeometry(Read(mechanism, "a", diagnostics), Read(mechanism, "b", diagnostics));
  g.q_min = Read(mechanism, "q_min", diagnostics);
  g.q_max = Read(mechanism, "q_max", diagnostics);
  for (const auto& [name, length] : {std::pair{"a", g.a}, std::pair{"b", g.b}}) {
    if (length <= 0.0) {
      diagnostics->AddError("", fmt::format("{} = {} violates {} > 0", name, length, name),
                            "it is the radius of a circle of joint centres");
    }
  }
  for (int i = 0; i < 3; ++i) {
    const double phi = Read(mechanism, fmt::format("phi_{}", i + 1), diagnostics);
    const double theta = Read(mechanism, fmt::format("theta_{}", i + 1), diagnostics);
    if (!(std::abs(std::remainder(phi - kPhi[i], 2 * pi)) < kAngleTolerance)) {
      diagnostics->AddError(
          "", fmt::format("phi_{} = {} rad is not the paper's {}", i + 1, phi, kPhi[i]),
          "the closed form holds for joints at 120, -120 and 0 deg only; use analytic: none");
    }
    if (!(std::abs(std::cos(theta - kPhi[i])) < kAngleTolerance)) {
      diagnostics->AddError(
          "", fmt::format("theta_{} = {} rad is not tangential (phi ± pi/2)", i + 1, theta),
          "the closed form holds for hinges perpendicular to O_A A_i; use analytic: none");
    }
    g.c[i] = Direction(theta);
  }
  return g;
}

Masses ReadMasses(const Mechanism& mechanism, Diagnostics* diagnostics) {
  return {.platform = ReadInertia(mechanism, "platform", diagnostics),
          .cylinder = ReadInertia(mechanism, "cyl", diagnostics),
          .rod = ReadInertia(mechanism, "rod", diagnostics),
          .gravity = mechanism.gravity_W};
}

}  // namespace mbv::spr_tripod
