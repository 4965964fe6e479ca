// SCARA parallel robot: stiffness of the platform by virtual springs. Terms as in geometry.h.
//
//   limbs 3, 4:  motor spring ═ arm ═ C ∘∘ ═ rod ═ B ∘∘∘
//   limbs 1, 2:  motor spring ═ arm ═ C ∘ ═ parallelogram ═ D ∘ ═ short rod ═ B ∘ (vertical)
//                ═ elastic member, ∘ passive DOF; base, platform and short bars are rigid
//
// Used terms (world axes; rotation or moment first; twists and wrenches about P):
//   ΔT_i            small displacement of the platform as limb i sees it
//   Δd, K_d         deformations of the virtual springs, each at the far end of its member
//   Δp              passive joint motions
//   k               6 × 6 tip stiffness of a clamped member: rotations x, y, z, displacements x, y,
//   z w, h, q         of a parallelogram: rods, normal of its plane (∥ a × w), q = w × h q̂ angle
//   between rods and bars: a = cos q̂ w + sin q̂ q
//
//   (11)       ΔT = J_d Δd + J_p Δp; columns [axis; p_PQ × axis] or [0; axis]
//   (12)       k11 = G I_x/l, k22 = 4 E I_y/l, k33 = 4 E I_z/l, k44 = E A/l, k55 = 12 E I_z/l³,
//              k66 = 12 E I_y/l³, k35 = −6 E I_z/l², k26 = 6 E I_y/l²
//   (13), (14) [S J_p; J_pᵀ 0] [f; Δp] = [ΔT; 0], S = J_d K_d⁻¹ J_dᵀ; f = K_i ΔT
//   (15)       K = Σ K_i
//   K_D        5 × 5 stiffness of a parallelogram at D (DOFs w, h, q rotations, w, h
//              displacements); the sixth, along q, is the parallelogram's motion
//   (16), (17) [m; f] = [K_mr K_mt; K_fr K_ft] [Δγ; Δε]
//   (18)–(20)  m = G_m λ, G_m = [K_mr Λ_γ, K_mt Λ_ε] with orthogonal Λ; G_f alike
//   (21)       κ_m = ‖G_m‖₂ = ‖[K_mr K_mt]‖₂, κ_f = ‖G_f‖₂ = ‖[K_fr K_ft]‖₂
//
// (13) and (14) are evaluated as K_i = W (Wᵀ S W)⁻¹ Wᵀ, where the columns of W span the wrenches
// that do no work on Δp (J_pᵀ W = 0): the same K_i, without the ill-scaled inverse, and with its
// rank.
//
// Assumptions of the paper: Euler–Bernoulli members, parallelograms as R-Pa-R (rods clamped in
// torsion and out of their plane). Corrected here: see PrintedForms. The indices (21) mix units and
// are largest stiffnesses: they do not see a singular pose and grow without bound at the dead
// points of rigid links. [Zhu 2019 §2]
#pragma once

#include "analytic/scara_robot/position.h"
#include "analytic/stiffness_form.h"

namespace mbv::scara_robot {

using Mat5 = Eigen::Matrix<double, 5, 5>;
/// Up to six columns, stored in place.
using Columns = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6>;
using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;

/// What the stiffness depends on: geometry (masses are not read) and elasticity.
struct StiffnessParameters {
  Parameters geometry;
  double d = kNan;         ///< width of the parallelograms [m]
  double E = kNan;         ///< [Pa]
  double G = kNan;         ///< [Pa]
  double diameter = kNan;  ///< of all members, solid round [m]
  double K_act = kNan;     ///< servo stiffness [N m/rad]
};

/// Defects of the print, each left in place where true. [Zhu 2019 §2.1, Table of (11)]
struct PrintedForms {
  bool rss_rod_frame = false;    ///< y2 ∥ a in limbs 3, 4: not orthogonal to the rod
  bool rss_passive = false;      ///< axes a, u × a of the ball at C: one idle where u ⟂ w
  bool motor_axis = false;       ///< motor axis of limbs 1, 2 printed w (the rods' direction)
  bool arm_frame = false;        ///< arm of limbs 1, 2 in the left-handed order u, u × a, a
  bool short_rod_frame = false;  ///< short rod in the left-handed order e, e × a, a
  bool parallelogram = false;    ///< K_D without the factor 2 and with + sin(2 q̂)/8
  bool passive_columns = false;  ///< J_p of limbs 1, 2: neither parallelogram nor R_i2
  bool passive_axes = false;     ///< J_p of limbs 1, 2: w for the motor axis a
};
/// All of them: the paper's own model.
[[nodiscard]] PrintedForms AllAsPrinted();

/// The elastic members of a limb in the order of J_d.
enum class Member { kServo, kArm, kRods, kShortRod };

/// One member's virtual springs.
struct MemberSpring {
  Member member = Member::kServo;
  Columns J;           ///< its columns of J_d
  Square flexibility;  ///< inverse of its block of K_d
};

struct LimbSprings {
  std::array<MemberSpring, 4> springs;
  int count = 0;  ///< 3 (limbs 3, 4) or 4
  Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 5> J_p;
};

/// Tip stiffness of one member of the given length. [Zhu 2019, Eq. 12]
[[nodiscard]] Mat6 TipStiffness(const StiffnessParameters& parameters, double length);
/// K_D from the tip stiffness of one rod. [Zhu 2019, K_D1 corrected]
[[nodiscard]] Mat5 ParallelogramStiffness(const Mat6& k, double d, double sin_q, double cos_q,
                                          bool as_printed = false);
/// J_d, K_d⁻¹ and J_p of a limb. [Zhu 2019, Eq. 11]
[[nodiscard]] LimbSprings SpringsOf(const StiffnessParameters& parameters,
                                    const PrintedForms& printed, const Position& position,
                                    int limb);

/// S = J_d K_d⁻¹ J_dᵀ. [Zhu 2019, Eq. 13]
[[nodiscard]] Mat6 SpringCompliance(const LimbSprings& springs);

struct LimbStiffness {
  Mat6 K = Mat6::Zero();
  int rank = 0;  ///< number of constraint wrenches: 1 for RSS, 2 for R(SRS)2R
};
/// K_i. `length` scales rotations against displacements. [Zhu 2019, Eqs. 13, 14]
[[nodiscard]] LimbStiffness StiffnessOf(const LimbSprings& springs, double length);

/// Everything at one pose, without names. No heap allocation.
struct PlatformStiffness {
  Position position;
  std::array<LimbSprings, kLimbs> springs;
  std::array<LimbStiffness, kLimbs> limbs;
  Mat6 K = Mat6::Constant(kNan);  ///< (15)
  Mat6 C = Mat6::Constant(kNan);  ///< NaN where K is singular
  int rank = -1;                  ///< of K with lengths divided by R
};
/// kUnreachable names the limb; kSingular where K is singular (K is valid then).
RunSummary SolveStiffness(const StiffnessParameters& parameters, const PrintedForms& printed,
                          const Vec4& X, PlatformStiffness* result);

/// Norms of K and its blocks [Zhu 2019, Eqs. 16–21] and, because (21) does not see a singular
/// pose, the largest compliances.
struct StiffnessIndices {
  double kappa_m = kNan;                                      ///< ‖[K_mr K_mt]‖₂, units mixed
  double kappa_f = kNan;                                      ///< ‖[K_fr K_ft]‖₂, units mixed
  double K_mr = kNan, K_mt = kNan, K_fr = kNan, K_ft = kNan;  ///< [N m/rad], [N], [N], [N/m]
  double C_rotation = kNan;     ///< ‖rotation by moment‖₂ [rad/(N m)]
  double C_translation = kNan;  ///< ‖displacement by force‖₂ [m/N]
};
[[nodiscard]] StiffnessIndices IndicesOf(const Mat6& K, const Mat6& C);

// The SCARA robot's stiffness in closed form, for the stiffness command.

/// Formulations, the default first: "corrected"; "as_printed", the paper's model with every printed
/// defect (position analysis as corrected, or most poses could not be reached); and one model per
/// defect alone, "printed_…".
[[nodiscard]] std::vector<std::string> StiffnessModels();

/// Pose: platform.x, .y, .z, .yaw. Shares: per limb the servo, the arm, the rods and, in limbs 1
/// and 2, the short rod. Indices: κ_m, κ_f of (21), the norms of K's blocks and of C's.
[[nodiscard]] std::unique_ptr<StiffnessForm> MakeStiffnessForm(const Mechanism& mechanism,
                                                               const PoseCoordinates& pose,
                                                               const std::string& model,
                                                               Diagnostics* diagnostics);

/// The constants by their names in models/scara_robot/elastic.yaml; they must exist.
[[nodiscard]] StiffnessParameters StiffnessParametersOf(const Mechanism& mechanism);

/// A pose for scenarios that give none.
[[nodiscard]] PoseCoordinates ExampleStiffnessPose();
/// Maps of Figs 9–11.
[[nodiscard]] std::vector<std::string> UsualStiffnessMaps();

}  // namespace mbv::scara_robot
