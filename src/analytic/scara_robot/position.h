// SCARA parallel robot 2-RSS + 2-R(SRS)2R: constants and position analysis.
//
//            O ─── x        base plane through A_1 … A_4, z up; x along OA_1, y along OA_2
//           /│
//   motor A_i●═══════● C_i            arm  A_i C_i, length l1, angle θ_i below the horizontal
//                     ╲               rod  C_i D_i (i = 1, 2; two rods ± d/2 beside this line)
//                      ╲                   or C_i B_i (i = 3, 4), length L_i = l2 or l3
//                  D_i ● ╲  (i = 1, 2: D_i is e above B_i, on the vertical hinge R_i2)
//                      │  ╲
//         ─────────────●───● B_i ── P  platform, hangs below the base: z_P < 0
//
// Used terms (world axes throughout; the paper's limb frames {A_i} are world turned by α_i):
//   α_i = (i − 1)·90°, ρ_i radial unit vector, a_i = ẑ × ρ_i motor axis
//   X = (x, y, z, φ)   position of P and yaw of the platform about +z
//   θ_i                drive angle, right-handed about a_i: θ > 0 lowers the arm's tip
//   u_i                unit vector of the arm, n_i = a_i × u_i = ∂u_i/∂θ_i
//   s_i, k_i           p_PBi and ∂s_i/∂φ
//   q_i                vector A_i → D_i (i = 1, 2) or A_i → B_i (i = 3, 4)
//   η_i                unit vector of the rod, V_i = η_i·n_i (0 at the limb's dead point)
//
// Assumptions of the paper: rigid links, no friction, the platform stays level (the parallelogram
// with its cross-bar and the vertical hinge of limbs 1 and 2 carry a couple about ρ_i each).
// Corrected here: the short rod D_i → B_i is (0, 0, −e); F_i in (9) has a minus sign.
//
// [Zhu 2019] Zhu Wei et al., "Stiffness and Dynamics Analysis of SCARA Parallel Mechanism",
// Trans. Chinese Society for Agricultural Machinery 50(10), 2019 (in Chinese).
#pragma once

#include <array>

#include "base/run_summary.h"
#include "base/types.h"
#include "mechanism/mechanism.h"

namespace mbv::scara_robot {

using Vec4 = Eigen::Vector4d;
using Mat4 = Eigen::Matrix4d;
using Mat34 = Eigen::Matrix<double, 3, 4>;

inline constexpr int kLimbs = 4;
/// Below this scaled s_min (or |V_i|) a pose counts as rank deficient.
inline constexpr double kRankDeficient = 1e-6;
/// Below this scaled s_min a pose is usable but worth a warning.
inline constexpr double kNearlySingular = 0.03;

/// Constants of the mechanism [m, kg, kg m²].
struct Parameters {
  double R = kNan;                 ///< |OA_i|
  double r = kNan;                 ///< |PB_i|
  double l1 = kNan;                ///< arm
  double l2 = kNan;                ///< rods of limbs 1, 2
  double l3 = kNan;                ///< rods of limbs 3, 4
  double e = kNan;                 ///< D_i above B_i
  double m_p = kNan, I_pz = kNan;  ///< platform, COM at P
  double m_arm = kNan, arm_radius = kNan;
  double arm_com = kNan;  ///< COM of the arm at this fraction of l1 from A_i
  double m_rods = kNan;   ///< both rods of a limb 1, 2, or the one rod of a limb 3, 4
  double rod_radius = kNan;
  double pivot_mass = 0.0;  ///< of m_p, borne by the bars at B_1 and B_2; reactions only
  double branch = 1.0;      ///< +1: arms outward, V_i > 0, minus sign in (10); −1: the other one
  Vec3 gravity_W = Vec3::Zero();
  Vec4 home_X = Vec4::Constant(kNan);  ///< start of the forward position problem

  [[nodiscard]] double rod_length(int limb) const { return limb < 2 ? l2 : l3; }
  [[nodiscard]] double drop(int limb) const { return limb < 2 ? e : 0.0; }
};

/// Reads the constants by their names in models/scara_robot/model.yaml.
[[nodiscard]] Parameters ParametersOf(const Mechanism& mechanism);

[[nodiscard]] const Vec3& Radial(int limb);     ///< ρ_i
[[nodiscard]] const Vec3& MotorAxis(int limb);  ///< a_i
[[nodiscard]] const char* LimbName(int limb);   ///< "limb1" …

/// Everything that depends on the pose only.
struct Position {
  Vec4 X = Vec4::Constant(kNan);
  Vec4 theta = Vec4::Constant(kNan);
  std::array<Vec3, kLimbs> s, k;  ///< p_PBi and its derivative by φ
  std::array<Vec3, kLimbs> u, n;  ///< arm direction and its derivative by θ
  std::array<Vec3, kLimbs> eta;   ///< rod direction
  Vec4 V = Vec4::Constant(kNan);  ///< η·n
};

/// Inverse position [Zhu 2019, Eqs. 1–10 corrected, 22, 23] in the division-free form
/// θ = atan2(−q_z, q_r) ∓ acos((l1² + q_r² + q_z² + q_t² − L²)/(2 l1 √(q_r² + q_z²))).
/// kUnreachable names the limb and the reach that is missing.
RunSummary InversePosition(const Parameters& parameters, const Vec4& X, Position* position);

/// One Newton solution of the forward position problem from a near pose; steps are limited to
/// 10 mm and 10°. kNoConvergence after 40 iterations.
RunSummary SolveForwardPosition(const Parameters& parameters, const Vec4& theta,
                                const Vec4& X_start, Position* position);

/// Fills everything of `position` from X and θ (η is normalised: it is the rod's direction only if
/// the loops close).
void FillPosition(const Parameters& parameters, const Vec4& X, const Vec4& theta,
                  Position* position);

/// Shear of the rod against the plane through ρ_i and z: asin(η·a) [rad].
[[nodiscard]] double RodShear(const Position& position, int limb);
/// Tilt of the rod below the horizontal, about a_i: atan2(−η_z, η·ρ) [rad].
[[nodiscard]] double RodTilt(const Position& position, int limb);

/// Follows the forward position along a path of drive angles on one branch: subdivides a step
/// until the pose moves by less than 15 mm and 15°, V_i > 0 and det J_θ keeps its sign.
class ForwardTracker {
 public:
  explicit ForwardTracker(const Parameters& parameters) : parameters_(parameters) {}

  /// Back to the home pose.
  void Restart() { started_ = false; }
  /// kSingular or kUnreachable with the limb in trouble; the last good pose is kept.
  RunSummary Follow(const Vec4& theta, Position* position);

 private:
  bool TryStep(const Vec4& theta, Position* position) const;
  [[nodiscard]] RunSummary Stuck(const Vec4& theta, const Position& tried) const;

  Parameters parameters_;
  bool started_ = false;
  Position last_;
};

/// What the topology gives without numbers: outputs of the limbs and the DOF count.
struct DofCount {
  std::array<int, 4> limb_dofs{};       ///< 5, 5, 6, 6 (idle rod spin dropped)
  std::array<int, 3> loop_equations{};  ///< ξ of the three independent loops
  int dofs = 0;                         ///< F = Σ f − Σ ξ
  int platform_translations = 0;        ///< dimensions of the platform's output set
  int platform_rotations = 0;
  Vec3 rotation_axis = Vec3::Zero();  ///< of the one rotation left
};
/// Position-and-orientation-characteristic sets of the limbs, intersected and united.
[[nodiscard]] DofCount CountDofs();

}  // namespace mbv::scara_robot
