// Forces in a modified-scissors limb, in closed form [Li 2018, section 3, corrected].
//
//              f_Z ↑  f_X out of the plane            force of the limb on the platform at B
//                  B ──► f_Y
//          P_− ↙      ↘ P_+                           P_s: force on link 2 of side s at B (from
//             2'      2                               the platform's ball and the other link 2)
//           E_−        E_+
//             1 ╲    ╱ 1'                             drive_s: thrust along n_s at rod ball b_s
//          U_+ ●  A   ● U_−
//
// Used terms: everything in {A_i}, moments about A_i unless a point is named. Required wrench of a
// link [m; f]: what joints and drives must exert on it, inertia minus gravity minus external loads,
// the paper's N A − ad(V)ᵀ N V − W^G. a × b of in-plane vectors is a_Y b_Z − a_Z b_Y. "2" and
// "1+2" mean link 2 and links 1 and 2 of one side together.
// Assumptions: massless drives; no friction; R22' transmits a force only (isostatic rule: the two
// redundant constraints of the closed five-bar loop carry nothing).
//
// (a) ω = ω_A + s q' X,  ε = ε_A + s q'' X + ω_A × s q' X,
//     a_c = a_A + ε_A × c + ω_A × (ω_A × c) + 2 ω_A × c' + c''      (limb plane moving with A)
// (b) f = m (a_c − g),  m = I ε + ω × I ω + c × f                    required wrench
// (c) P_s,X = M_Y,(1+2),s / l,   f_X = −(P_+,X + P_−,X)              (missing in the print)
// (d) (B − E_s) × P_s = m_X,2,s − E_s × f_2,s;   P_+ + P_− = −(f_Y, f_Z)
// (e) drive_s = [m_X,(1+2),s − U_s × f_(1+2),s − (B − U_s) × P_s] / [(b_s − U_s) × n_s],
//     (b_s − U_s) × n_s = s (L4 + L5) L2 sin q12 / R
// (f) elbow: f_2 − P_s, moment about E; foot: f_(1+2) − P_s − drive_s n_s, moment about U
#pragma once

#include <array>
#include <span>

#include "analytic/stabilizing_platform/position.h"
#include "analytic/stabilizing_platform/velocity.h"

namespace mbv::stabilizing_platform {

/// Points and axes of a limb's links in {A_i}.
struct LimbGeometry {
  Vec3 B;                        ///< tip
  std::array<Vec3, 2> U, E;      ///< feet and elbows per side
  std::array<Vec3, 2> d1, d2;    ///< unit vectors along links 1 and 2
  std::array<Vec3, 2> rod_ball;  ///< b_s
  std::array<Vec3, 2> thrust;    ///< n_s, from base ball to rod ball

  [[nodiscard]] const Vec3& origin(int link) const {  ///< origin of a link's frame
    return link < kLink2 ? U[link] : E[link - kLink2];
  }
  [[nodiscard]] Mat3 R_AL(int link) const;  ///< axes of a link's frame in {A_i}
};
[[nodiscard]] LimbGeometry GeometryOf(const PlatformParameters& p, const LimbMotion& limb);

/// Required wrenches of the four links, [m; f] about A_i in {A_i}, by (a) and (b), without loads.
using LinkWrenches = std::array<Vec6, 4>;
void RequiredWrenches(const PlatformParameters& p, const LimbMotion& limb,
                      const LimbGeometry& geometry, const RelativeMotion& motion,
                      LinkWrenches* required);

/// (c): force along X of the limb on the platform [N].
[[nodiscard]] double OutOfPlaneForce(const LinkWrenches& required, double length);

/// Forces of a limb once its force on the platform is known.
struct LimbForces {
  Vec3 on_platform;             ///< (f_X, f_Y, f_Z) at B, in {A_i} [N]
  std::array<Vec3, 2> P;        ///< on link 2 of each side at B [N]
  std::array<double, 2> drive;  ///< thrust [N]
};

/// (d) and (e). `on_platform` must be set. Fails with kSingular at the toggle.
[[nodiscard]] RunSummary SolveLimb(const PlatformParameters& p, const LimbMotion& limb,
                                   const LimbGeometry& geometry, const LinkWrenches& required,
                                   LimbForces* forces);

/// Joint reactions: wrench [m; f] about the joint's centre in {A_i}, base on link 1 and link 1 on
/// link 2, drive forces excluded, by (f).
struct LimbReactions {
  std::array<Vec6, 2> foot;   ///< U1, U1'
  std::array<Vec6, 2> elbow;  ///< R12, R12'
};
[[nodiscard]] LimbReactions ReactionsOf(const LimbGeometry& geometry, const LinkWrenches& required,
                                        const LimbForces& forces);

// The paper's 30 equilibrium equations of a limb, as printed and corrected [Li 2018, section 3].
//
// A second route to the forces that limb_dynamics.h gives in closed form; used by the audit and
// the tests.
//
//   bodies (6 equations each, moments, then forces, in {A_i}; moments about B, E, E', U, U'):
//       cross (at B, massless), link 2, link 2', link 1, link 1'
//   unknowns, each the action on the outer body at the joint's centre:
//       cross → 2  F, M_Y, M_Z      cross → 2' F, M_Y, M_Z      1 → 2  F, M_Y, M_Z
//       1' → 2'    F, M_Y, M_Z      base → 1   F, M_Z           base → 1'  F, M_Z
//       drive, drive'                                           sum 30
//
// As printed the matrix has rank 28: the loop of links carries equal and opposite M_Z, and an X
// force with its moments, without any equation noticing; in exchange nothing holds the limb's tilt
// about Y and the cross' spin about X. Corrected: R22' is a ball on the primed side (its M_Y, M_Z
// are dropped) and the platform acts on the cross along X (f_X) and about X (τ_X, which is 0).

struct LimbSystem {
  Eigen::Matrix<double, 30, 30> matrix;
  Eigen::Matrix<double, 30, 1> right_side;
};

enum class LimbSystemForm { kPrinted, kCorrected };

/// The system for given limb forces f_Y, f_Z on the platform [N].
[[nodiscard]] LimbSystem MakeLimbSystem(LimbSystemForm form, const LimbGeometry& geometry,
                                        const LinkWrenches& required, double f_Y, double f_Z);

/// Solution of the corrected system.
struct LimbSystemSolution {
  LimbForces forces;  ///< P_s and drives; on_platform with f_X as solved
  LimbReactions reactions;
  double tau_X = kNan;  ///< platform on cross about X [N m]
};
[[nodiscard]] LimbSystemSolution SolveLimbSystem(const LimbSystem& corrected, double f_Y,
                                                 double f_Z);

/// Singular values of the matrix with its columns scaled to unit length, largest first.
[[nodiscard]] Eigen::Matrix<double, 30, 1> ColumnScaledSingularValues(const LimbSystem& system);

// Wrench balance of the upper platform [Li 2018, Eqs. 21, 22].
//
// Used terms: everything in {o}, moments about {o}'s origin; B_i tip of limb i, X_i, Y_i, Z_i axes
// of {A_i}; f_i, f_{3+i}, f_X,i forces of limb i on the platform along Z_i, Y_i, X_i; N spatial
// inertia of the platform; r_c its centre of mass (at p in the paper); W^I wrench of inertia, W^G
// of gravity, W^E of external loads.
// Assumptions: balls at the tips (no moments).
//
// (21) [S1 … S6] f = −W^G − W^I − W^E − Σ f_X,i (B_i × X_i ; X_i),
//      S_i = (B_i × Z_i ; Z_i),  S_{3+i} = (B_i × Y_i ; Y_i)       (the print lacks f_X,i)
// (22) W^I = −(N A_ep − ad(V_ep)ᵀ N V_ep),  W^G = (r_c × m g ; m g)

/// W^I of (22).
[[nodiscard]] Vec6 InertiaWrench(const PlatformParameters& p, const RelativeMotion& motion);
/// W^G of (22).
[[nodiscard]] Vec6 GravityWrench(const PlatformParameters& p, const RelativeMotion& motion);

/// Solves (21) for f = (f_1 … f_6) [N]. `load` is W^E; `f_X` the forces along X (zero as printed).
/// Fails with kSingular when the six lines are dependent.
[[nodiscard]] RunSummary SolvePlatform(const PlatformParameters& p, const RelativeMotion& motion,
                                       const std::array<LimbMotion, 3>& limbs, const Vec3& f_X,
                                       const Vec6& load, Vec6* f);

// The pipeline of the stabilizing platform's equations at one instant: (5)–(20), f_X, (21)
// corrected, limb solution. Everything has fixed size; nothing allocates.
//
// Three formulations:
//   full        link masses everywhere (the corrected equations)
//   massless    only the platform has mass (the paper's figures)
//   paper_text  the paper's literal sequence: (21) without the limbs' forces along X, then link
//               masses in the limb plane only; wrong by up to 10 kN on the default motion

enum class Model { kFull, kMassless, kPaperText };

/// What is commanded at one instant. Synchronous pairs: platform z, and roll = pitch = 0; x, y
/// and yaw follow from (5). Independent drives: the whole platform pose.
struct PoseCommand {
  Jet roll, pitch, heave;       ///< of the ship [rad, m]
  std::array<Jet, 6> platform;  ///< x, y, z [m], roll, pitch, yaw [rad] in the earth frame
};

/// An external wrench on the platform (limb −1) or on a link of a limb.
struct BodyLoad {
  int limb = -1;
  int link = 0;
  Vec3 p_BoQ_B = Vec3::Zero();  ///< point of action in the body's frame
  bool in_body_axes = false;    ///< force and moment in body axes instead of the earth's
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
};

/// Every intermediate quantity at one instant.
struct Evaluation {
  FrameMotion lower, upper;
  RelativeMotion motion;
  std::array<LimbMotion, 3> limbs;
  // From here on by EvaluateDynamics.
  std::array<LimbGeometry, 3> geometry;
  std::array<LinkWrenches, 3> required;  ///< about A_i in {A_i}, loads included
  Vec3 f_X;                              ///< zero in paper_text
  Vec6 f;                                ///< f_1 … f_6 of (21) [N]
  std::array<LimbForces, 3> forces;
};

class PlatformEquations {
 public:
  PlatformEquations(const PlatformParameters& parameters, DrivePairs pairs,
                    Model model = Model::kFull, SignInM sign = SignInM::kCorrected);

  /// (5)–(20) with rates and accelerations. Fails where the pose cannot be reached or is
  /// singular (limb and amount in the summary).
  [[nodiscard]] RunSummary EvaluateKinematics(const PoseCommand& command, Evaluation* e) const;

  /// Link wrenches, f_X, (21), limb forces; after EvaluateKinematics of the same instant.
  [[nodiscard]] RunSummary EvaluateDynamics(std::span<const BodyLoad> loads, Evaluation* e) const;

  [[nodiscard]] const PlatformParameters& parameters() const { return p_; }

 private:
  PlatformParameters p_;
  DrivePairs pairs_;
  Model model_;
  SignInM sign_;
  std::array<LimbPlace, 3> places_;
};

}  // namespace mbv::stabilizing_platform
