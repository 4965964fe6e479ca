#include "analytic/stabilizing_platform/parameters.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace mbv::stabilizing_platform {

namespace {

// Reads one parameter, or reports that it is missing.
class Reader {
 public:
  Reader(const Mechanism& mechanism, Diagnostics* diagnostics)
      : mechanism_(mechanism), diagnostics_(diagnostics) {}

  double Get(const std::string& name) const {
    if (mechanism_.HasParameter(name)) return mechanism_.ParameterValue(name);
    diagnostics_->AddError("", fmt::format("parameters: \"{}\" is missing", name),
                           "the closed form of the stabilizing platform reads it by this name");
    return kNan;
  }
  double Get(const std::string& name, double fallback) const {
    return mechanism_.HasParameter(name) ? mechanism_.ParameterValue(name) : fallback;
  }
  Vec3 GetVector(const std::string& stem) const {
    return {Get(stem + "_x"), Get(stem + "_y"), Get(stem + "_z")};
  }
  Vec3 GetVector(const std::string& stem, double fallback) const {
    return {Get(stem + "_x", fallback), Get(stem + "_y", fallback), Get(stem + "_z", fallback)};
  }

 private:
  const Mechanism& mechanism_;
  Diagnostics* diagnostics_;
};

void CheckPositive(const char* name, double value, Diagnostics* diagnostics) {
  if (value > 0) return;
  diagnostics->AddError("", fmt::format("parameters: {} = {} violates {} > 0", name, value, name),
                        "lengths and radii are positive, in metres");
}

// |angle| to the nearest multiple of `period`.
double DistanceToMultiple(double angle, double period) {
  return std::abs(std::remainder(angle, period));
}

void CheckAzimuths(const PlatformParameters& p, Diagnostics* diagnostics) {
  using std::numbers::pi;
  constexpr double kMargin = 1e-3;  // rad; nearer, (5) loses more than six digits
  if (DistanceToMultiple(p.theta_1 - p.theta_2, 2 * pi) < kMargin) {
    diagnostics->AddError(
        "",
        fmt::format("parameters: theta_1 = {} and theta_2 = {} are the same azimuth, and the "
                    "parasitic motion is 0/0",
                    p.theta_1, p.theta_2),
        "the print gives 120 degrees twice; theta_2 = 240 degrees is meant");
  }
  for (const auto& [name, theta] :
       {std::pair{"theta_1", p.theta_1}, std::pair{"theta_2", p.theta_2}}) {
    if (DistanceToMultiple(theta, pi / 2) < kMargin) {
      diagnostics->AddError(
          "",
          fmt::format("parameters: {} = {} is a multiple of 90 degrees, where tan({}) of the "
                      "parasitic motion is 0 or infinite",
                      name, theta, name),
          "renumber the limbs, so that none of limbs 2 and 3 lies on an axis");
    }
  }
}

void CheckReach(const PlatformParameters& p, Diagnostics* diagnostics) {
  const double l_0 = std::hypot(p.r_a - p.r_b, p.z_0 - p.s_r_so);
  const double stretched = p.L1 + p.L3;
  const double reach = std::hypot(p.L5, l_0);
  if (reach >= stretched) {
    diagnostics->AddError(
        "",
        fmt::format("parameters: the limbs need {:.6g} m from foot to tip in the neutral "
                    "pose, and L1 + L3 = {:.6g} m",
                    reach, stretched),
        "lengthen the links or lower z_0");
  }
  // Links 2 and 2' in one straight line: the tip at the height of the elbows.
  const double toggle_squared = p.L1 * p.L1 - (p.L3 + p.L5) * (p.L3 + p.L5);
  if (l_0 * l_0 <= toggle_squared || reach <= std::abs(p.L1 - p.L3)) {
    diagnostics->AddError(
        "",
        fmt::format("parameters: the neutral limb length {:.6g} m lies at or beyond the "
                    "toggle of links 2 and 2'",
                    l_0),
        "shorten the links or raise z_0");
  }
}

}  // namespace

PlatformParameters ReadParameters(const Mechanism& mechanism, Diagnostics* diagnostics) {
  Diagnostics missing;
  const Reader read(mechanism, &missing);
  PlatformParameters p;
  for (auto [name, target] : {std::pair{"r_a", &p.r_a},
                              {"r_b", &p.r_b},
                              {"z_0", &p.z_0},
                              {"theta_1", &p.theta_1},
                              {"theta_2", &p.theta_2},
                              {"theta_3", &p.theta_3},
                              {"L1", &p.L1},
                              {"L2", &p.L2},
                              {"L3", &p.L3},
                              {"L4", &p.L4},
                              {"L5", &p.L5},
                              {"s_r_so", &p.s_r_so},
                              {"m_p", &p.m_p}}) {
    *target = read.Get(name);
  }
  p.g = -mechanism.gravity_W.z();  // the coverage demands that it points down
  p.c_p = read.GetVector("c_p", 0.0);
  p.I_p = read.GetVector("I_p");
  const double scale = read.Get("link_mass_scale", 1.0);
  const double inertia_scale = read.Get("link1_inertia_scale", 1.0);
  for (int k = 0; k < 4; ++k) {
    const std::string stem = kLinkStems[k];
    const bool first = k == kLink1 || k == kLink1p;
    p.links[k] = {.mass = scale * read.Get("m_" + stem),
                  .moments = scale * (first ? inertia_scale : 1.0) * read.GetVector("I_" + stem),
                  .com_fraction = read.Get(first ? "c_1" : "c_2"),
                  .com_x = read.Get("c_" + stem + "_x", 0.0),
                  .com_z = read.Get("c_" + stem + "_z", 0.0)};
  }
  if (!missing.empty()) {
    diagnostics->Append(missing);
    return p;
  }
  Diagnostics lengths;
  for (const auto& [name, value] : {std::pair{"r_a", p.r_a},
                                    {"r_b", p.r_b},
                                    {"L1", p.L1},
                                    {"L2", p.L2},
                                    {"L3", p.L3},
                                    {"L4", p.L4},
                                    {"L5", p.L5}}) {
    CheckPositive(name, value, &lengths);
  }
  diagnostics->Append(lengths);
  CheckAzimuths(p, diagnostics);
  if (lengths.empty()) CheckReach(p, diagnostics);
  return p;
}

}  // namespace mbv::stabilizing_platform
