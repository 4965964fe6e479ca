// Constants of the stabilizing platform, read from the mechanism's parameters.
#pragma once

#include <array>
#include <string>

#include "base/diagnostics.h"
#include "base/types.h"
#include "mechanism/mechanism.h"

namespace mbv::stabilizing_platform {

/// Sides of a limb: +1 is the unprimed one (foot at y = −L5 of {A_i}), −1 the primed one.
inline constexpr std::array<double, 2> kSides = {+1.0, -1.0};

/// The four links of a limb: 1, 1', 2, 2'. Link k on side index j (0, 1) is 2(k − 1) + j.
enum Link { kLink1 = 0, kLink1p = 1, kLink2 = 2, kLink2p = 3 };
inline constexpr std::array<const char*, 4> kLinkNames = {"link1", "link1_p", "link2", "link2_p"};
/// In the names of their parameters: m_1p.
inline constexpr std::array<const char*, 4> kLinkStems = {"1", "1p", "2", "2p"};

/// A link; its frame has y along the link, x normal to the limb plane and its origin at U1 (links
/// 1, 1') or at the elbow (links 2, 2').
struct LinkInertia {
  double mass = 0.0;            ///< [kg], scaled by link_mass_scale
  Vec3 moments = Vec3::Zero();  ///< principal moments about the centre of mass [kg m²], scaled
  double com_fraction = 0.5;    ///< centre of mass = fraction · length along y …
  double com_x = 0.0;           ///< … beside the limb plane [m]
  double com_z = 0.0;           ///< … and beside the link's line in it [m]
};

/// [Li 2018, sections 2 and 4]; lengths in m, angles in rad.
struct PlatformParameters {
  double r_a = 0, r_b = 0;          ///< radii of the A_i and B_i circles
  double z_0 = 0;                   ///< neutral height of the upper platform over the earth
  double theta_1 = 0, theta_2 = 0;  ///< azimuths of limbs 2 and 3 (limb 1 at 0)
  double theta_3 = 0;               ///< angle elbow – U1 – rod ball on links 1, 1'
  double L1 = 0, L2 = 0, L3 = 0, L4 = 0, L5 = 0;
  double s_r_so = 0;        ///< height of the lower platform's origin in the ship frame
  double m_p = 0;           ///< platform and load [kg]
  Vec3 c_p = Vec3::Zero();  ///< their centre of mass in {p} [m]; the paper has it at p
  Vec3 I_p = Vec3::Zero();  ///< about the centre of mass, axes of {p} [kg m²]
  std::array<LinkInertia, 4> links;
  double g = 0;  ///< [m/s²]

  [[nodiscard]] double azimuth(int limb) const {
    return limb == 0 ? 0.0 : limb == 1 ? theta_1 : theta_2;
  }
};

/// Reads the parameters by name; missing names and unusable values (θ1 = θ2, a length that is not
/// positive, links that cannot reach the neutral pose, …) become findings.
[[nodiscard]] PlatformParameters ReadParameters(const Mechanism& mechanism,
                                                Diagnostics* diagnostics);

}  // namespace mbv::stabilizing_platform
