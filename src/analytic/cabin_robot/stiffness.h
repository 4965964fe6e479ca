// Cabin robot: stiffness of the end effector {6} with all drives locked. Terms and frames as in
// planar_linkage.h and cabin_dynamics.h.
//
//        B●══════════●C     two equal linkages at z = ±w/2, each a limb AB + EF and a limb CD;
//       ⫽  platform   ⑊     beams AE, EB, EF, CD; hinges A … F free about z only; the platform,
//      E                ⑊   the sliders and all locked joints are rigid
//    ⫽   ⑊               ⑊
//   A      F              D    then in series: column {2}–{3}, arm {3}–{4}, rail {4} along y4 by
//                              d5, tool along x4 to {6}
//
// Used terms (this file keeps the paper's order: displacements or forces first, then rotations or
// moments; x, y, z of a beam: x along it, z along the edge b, y along the edge h):
//   C_pl(L)   compliance of a clamped beam at its tip
//   ψ         α + ε, angle between strut and link AB; θ = ψ − 90°
//   r_i       end of limb i from the platform's origin K, world axes
//   r_j       end effector from the end of beam j, in beam axes
//
//   (54)       C_pl = [L/EA; L³/3EI_z, L²/2EI_z; L³/3EI_y, −L²/2EI_y; L/GI_p; L/EI_y; L/EI_z],
//              A = bh, I_y = b³h/12, I_z = bh³/12
//   (55)       N = 2 F_x2/cos θ − 2 M_z/(L1 cos θ), strut force (compression) for a transverse
//   force
//              F_x2 towards the strut's side at B
//   limb AB    in its own axes at B, A_1, I_z1 of AB, A_4 of EF (replaces (56)–(61)):
//              C_xx = L1/EA_1, C_xy = C_xx cot ψ, C_xθ = cot ψ/EA_1,
//              C_yy = L1³/12EI_z1 + 2 L1 cot²ψ/EA_1 + 4 L4/(EA_4 sin²ψ),
//              C_yθ = 5 L1²/24EI_z1 + 2 cot²ψ/EA_1 + 4 L4/(L1 EA_4 sin²ψ),
//              C_θθ = 2 L1/3EI_z1 + 2 cot²ψ/(L1 EA_1) + 4 L4/(L1² EA_4 sin²ψ);
//              across the plane C = C_h + Gᵀ(C_h⁻¹ + T C_f⁻¹ Tᵀ)⁻¹G, C_h and C_f the (z, θx, θy)
//              blocks of C_pl of half of AB and of EF, T: axes of EF → AB, G: load at B → at E
//   (62)–(68)  K = Σ J_Fi K_i J_i⁻¹, J_i = [R S(r_i)R; 0 R], J_Fi = J_i⁻ᵀ; K_i of rank 5 (AB) and 4
//              (CD): a hinge to the platform carries no M_z, CD no F_y either
//   (69)–(75)  C = Σ J_j C_j J_jᵀ, J_j = [R −R S(r_j); 0 R], five terms: the linkages, then 4 beams
//
// Assumptions: Euler–Bernoulli beams, small displacements, ideal hinges. The printed (56)–(61) put
// the strut's force into the wrong axes, clamp AB at its hinge and are not symmetric; they are kept
// for comparison only. [Liu 2025 §4]
#pragma once

#include <array>

#include "analytic/cabin_robot/dynamics.h"
#include "analytic/stiffness_form.h"

namespace mbv::cabin_robot {

/// A rectangular section: b along beam z, h along beam y [m].
struct RectSection {
  double b = kNan, h = kNan;
};

enum StiffBeam {
  kBeamAB,
  kBeamCD,
  kBeamEF,
  kBeamColumn,
  kBeamArm,
  kBeamRail,
  kBeamTool,
  kStiffBeams
};

struct StiffnessParameters {
  PlanarGeometry planar;
  WristGeometry wrist;
  double w = kNan;               ///< distance of the two linkages [m]
  double E = kNan, G = kNan;     ///< [Pa]
  bool torsion_printed = false;  ///< I_p = b h³(1/3 − 0.21 h/b) instead of St Venant's series
  std::array<RectSection, kStiffBeams> sections;
};

/// Where the stiffness is asked for. The rail d1 and the bearing th6 do not matter: the end
/// effector's origin lies on the axis of th6 and all axes are the world's.
struct StiffnessPose {
  double X = kNan, Y = kNan, gamma = kNan, th3 = kNan, th4 = kNan, d5 = kNan;
};

enum class LimbForm {
  kCorrected,
  kAsPrinted,  ///< (61) for AB + EF and (54) for CD, inverted (which welds their hinges)
};

/// St Venant's torsion constant of a rectangle [m⁴]: exact, or the paper's I_p (longer edge first).
[[nodiscard]] double TorsionConstant(double b, double h, bool printed);

/// Compliance of a clamped beam at its tip. [Liu 2025, Eq. 54]
[[nodiscard]] Mat6 BeamCompliance(const StiffnessParameters& parameters, StiffBeam beam,
                                  double length);

/// Strut force for a transverse force towards the strut and a moment at B. [Liu 2025, Eq. 55]
[[nodiscard]] double StrutForce(double L1, double theta, double F_x2, double M_z);

/// Limb AB + EF with sliders locked, at B in AB's axes.
struct StrutLimb {
  Mat3 in_plane;      ///< (x, y, θz), symmetric
  Mat3 out_of_plane;  ///< (z, θx, θy)
  Mat3 at_E;          ///< (z, θx, θy) compliance of the pin E, without EB
  Mat3 C_h, C_f, T, G;
};
[[nodiscard]] StrutLimb StrutLimbCompliance(const StiffnessParameters& parameters, double alpha,
                                            double epsilon);
/// K_i of the limb: no moment about z at B; rank 5.
[[nodiscard]] Mat6 StrutLimbStiffness(const StrutLimb& limb);
/// K_i of CD at C in its own axes: hinged at both ends; rank 4.
[[nodiscard]] Mat6 LinkLimbStiffness(const StiffnessParameters& parameters);
/// The printed compliance of AB + EF; not symmetric. [Liu 2025, Eq. 61]
[[nodiscard]] Mat6 PrintedLimbCompliance(const StiffnessParameters& parameters, double theta);

/// J_i of a limb's end: its displacement in own axes → the platform's in world axes. [Eq. 63]
[[nodiscard]] Mat6 LimbTransform(const Mat3& R, const Vec3& r_W);
/// J_Fi: the limb's force in own axes → on the platform. [Eq. 66]
[[nodiscard]] Mat6 LimbForceTransform(const Mat3& R, const Vec3& r_W);
/// J_j of a beam: its tip's displacement in beam axes → the end effector's. [Eq. 70]
[[nodiscard]] Mat6 BeamTransform(const Mat3& R, const Vec3& r_beam);

/// One beam: compliance of its own and the force at its tip, in its axes, under a wrench on {6}.
struct StiffElement {
  StiffBeam beam = kBeamAB;
  Mat6 C = Mat6::Zero();
  Mat6 G = Mat6::Zero();
};

/// Elements in the order: per plane (z = +w/2, −w/2) AE, EB, EF, CD; column, arm, rail, tool.
inline constexpr int kStiffElements = 12;

struct ToolStiffness {
  Mat6 K_platform = Mat6::Constant(kNan);             ///< (68), about K
  Mat6 K = Mat6::Constant(kNan);                      ///< (75), about {6}'s origin
  Mat6 C = Mat6::Constant(kNan);                      ///< (74)
  std::array<StiffElement, kStiffElements> elements;  ///< corrected form only
  PlanarState planar;
};
/// kUnreachable / kSingular as SolveInverse(). No heap allocation.
RunSummary SolveStiffness(const StiffnessParameters& parameters, const StiffnessPose& pose,
                          LimbForm form, ToolStiffness* result);

// The cabin robot's stiffness in closed form, for the stiffness command.

/// "corrected" (the default) and "as_printed": (61) for AB + EF and (54) for CD, both inverted; its
/// K is not symmetric and it has no shares.
[[nodiscard]] std::vector<std::string> StiffnessModels();

/// Pose: platform.x, platform.y, platform.yaw (γ), th3, th4, d5 (or the parameter d5 of the model);
/// d1 and th6 are accepted and do not matter. Shares: every beam; locked drives have none.
/// Indices: the diagonal of C.
[[nodiscard]] std::unique_ptr<StiffnessForm> MakeStiffnessForm(const Mechanism& mechanism,
                                                               const PoseCoordinates& pose,
                                                               const std::string& model,
                                                               Diagnostics* diagnostics);

/// The constants by their names in models/cabin_robot/elastic.yaml; they must exist.
[[nodiscard]] StiffnessParameters StiffnessParametersOf(const Mechanism& mechanism);

/// A pose for scenarios that give none; d5 stays the model's.
[[nodiscard]] PoseCoordinates ExampleStiffnessPose();
/// One map over the plane.
[[nodiscard]] std::vector<std::string> UsualStiffnessMaps();

}  // namespace mbv::cabin_robot
