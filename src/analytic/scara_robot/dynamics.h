// SCARA parallel robot: motion of the passive links and drive torques by virtual work.
// Terms as in geometry.h; Φ_i is the i-th unit vector of R⁴.
//
//   (31)      v_i1 = c l1 θ̇_i n_i = J_i1 θ̇               COM of the arm (c = ½ in the paper)
//   (32)      v_C  = l1 θ̇_i n_i = J_Ci θ̇
//   (33, 35)  v_B  = v_D = ṗ + k_i φ̇ = [E k_i] J⁻¹ θ̇ = J_Bi θ̇
//   (34, 36)  v_i2 = ½ (v_C + v_B) = J_i2 θ̇              COM of the rods
//   (37, 38)  η̇ = (v_B − v_C)/L_i,  ω = η × η̇ + b ψ̇ η = J_ωi θ̇
//             b = η·a, ψ̇ = η̇·(a × η)/(1 − b²): the rods turn like universal joints at C_i whose
//             first axis is a_i (the paper leaves the spin b ψ̇ out)
//   (39 – 41) the time derivatives of these
//   (48)      M = J⁻ᵀ { [m_p (p̈ − g); I_pz φ̈] − [F; M_z] }
//               + Σ_i { J_i1ᵀ m_i1 (v̇_i1 − g) + I_t1 θ̈_i Φ_i
//                     + J_i2ᵀ m_i2 (v̇_i2 − g) + J_ωiᵀ [I_i2 ω̇_i + ω_i × (I_i2 ω_i)] }
//
// (48) is the corrected form: as printed the platform's inertia and the external force are
// missing, gravity and the arms' inertia have wrong signs and J stands for J⁻¹. The two rods of a
// parallelogram have the same ω and, on average, the COM motion of the line C_i D_i, so that one
// rod of their total mass on this line is exact for any width d. [Zhu 2019 §3.2–3.5]
#pragma once

#include <array>
#include <vector>

#include "analytic/scara_robot/velocity.h"
#include "math/trace.h"

namespace mbv::scara_robot {

/// Which rod rotation enters the dynamics.
enum class RodModel {
  kFull,  ///< with the spin about the rod's own axis
  kThin,  ///< the paper's: no spin, no axial inertia
};

/// Motion of the links of one limb (world axes) and its Jacobians to θ̇ (3 × 4).
struct LinkMotion {
  Vec3 v_arm, dv_arm;  ///< COM of the arm [m/s], [m/s²]
  Vec3 v_rod, dv_rod;  ///< COM of the rods
  Vec3 omega, domega;  ///< rods [rad/s], [rad/s²]
  Mat34 J_arm, J_rod, J_omega;
};

/// Equations (31) – (41) for one limb. `J_inverse` is J⁻¹ (4 × 4).
void FillLinkMotion(const Parameters& parameters, const Position& position, const Rates& rates,
                    const Mat4& J_inverse, RodModel rod_model, int limb, LinkMotion* links);

/// J⁻¹ = J_θ⁻¹ J_x: Ẋ per θ̇.
[[nodiscard]] Mat4 InverseOfJ(const Parameters& parameters, const Position& position);

/// Drive torques [N m], positive along +θ. [Zhu 2019, Eq. 48 corrected]
/// `F_P` external force on the platform at P [N], `M_z` external moment about z at P [N m].
[[nodiscard]] Vec4 DriveTorques(const Parameters& parameters, const Position& position,
                                const Rates& rates, const Vec3& F_P, double M_z,
                                RodModel rod_model = RodModel::kFull);

/// Kinetic plus potential energy [J], for the power balance Σ M θ̇ + F·ṗ + M_z φ̇ = dE/dt.
[[nodiscard]] double Energy(const Parameters& parameters, const Position& position,
                            const Rates& rates, RodModel rod_model = RodModel::kFull);

/// Transverse and axial inertia of a solid round bar about its COM [kg m²].
struct BarInertia {
  double transverse = 0.0, axial = 0.0;
};
[[nodiscard]] BarInertia SolidBar(double mass, double radius, double length);
/// Of the rods of a limb together.
[[nodiscard]] BarInertia RodInertia(const Parameters& parameters, RodModel rod_model, int limb);
/// I ω for a rod of direction η.
[[nodiscard]] Vec3 Times(const BarInertia& inertia, const Vec3& eta, const Vec3& omega);

// SCARA parallel robot: forces in the joints. Terms as in geometry.h and dynamics.h.
//
// The paper gives drive torques only; the forces follow from the balances of rods, platform and
// arms. h_i = η_i × a_i normalised is the normal of a parallelogram, and the second axis of the
// universal joint at C_i of a single rod: neither transmits moments about a_i and h_i at C_i.
//
//   (R1)  f_i2 = m_i2 (v̇_i2 − g),  H_i = I_i2 ω̇_i + ω_i × (I_i2 ω_i) + ½ L_i η_i × f_i2
//   (R2)  T_i = η_i × F_i:  T_i·a_i = −H_i·a_i / L_i,  T_i·h_i = −H_i·h_i / L_i,
//         F_i = N_i η_i + T_i × η_i                    force of the rods on the platform
//   (R3)  Σ N_i [η_i; (s_i × η_i)_z] = [m_p (p̈ − g) − F; I_pz φ̈ − M_z]
//                                      − Σ [T_i × η_i; (s_i × (T_i × η_i))_z]
//   (R4)  force of the arm on the rods f_i2 + F_i; of the motor's bearing on the arm
//         m_i1 (v̇_i1 − g) + f_i2 + F_i
//
// The couples by which limbs 1, 2 keep the platform level, about ρ_i, are not computed.

/// Forces in the joints of a limb, world axes [N].
struct LimbForces {
  Vec3 on_platform;  ///< F_i; limbs 1, 2: the pivot at B_i counts to the platform
  Vec3 on_rods;      ///< by the arm at C_i
  Vec3 on_arm;       ///< by the motor's bearing at A_i
  Vec3 a_B;          ///< acceleration of B_i [m/s²]
};

/// (R1) – (R4). `F_P`, `M_z` as in DriveTorques. J_θ must be regular.
[[nodiscard]] std::array<LimbForces, kLimbs> JointForces(const Parameters& parameters,
                                                         const Position& position,
                                                         const Rates& rates, const Vec3& F_P,
                                                         double M_z,
                                                         RodModel rod_model = RodModel::kFull);

/// Writes the forces as JOINT.reaction.fx … fz: of the joint's parent on its child, in F's axes.
class ReactionChannelsOfLimbs {
 public:
  ReactionChannelsOfLimbs() = default;
  /// Uses those of limbN.motor, limb1.pivot, limb2.pivot, limb3.wrist, limb3.ball_B, limb4.wrist
  /// and limb4.ball_B that the mechanism has, parent and child as in the shipped model.
  explicit ReactionChannelsOfLimbs(const Mechanism& mechanism);

  [[nodiscard]] const std::vector<Channel>& channels() const { return channels_; }
  /// Writes channels().size() values.
  void Write(const Parameters& parameters, const Position& position,
             const std::array<LimbForces, kLimbs>& forces, double* values) const;

 private:
  enum class Kind { kMotor, kPivot, kWrist, kBall };
  struct Entry {
    Kind kind = Kind::kMotor;
    int limb = 0;
    Mat3 R_PF = Mat3::Identity();
  };
  void Add(const Mechanism& mechanism, Kind kind, int limb, const char* joint, const char* parent,
           const char* child);

  std::vector<Entry> entries_;
  std::vector<Channel> channels_;
};

}  // namespace mbv::scara_robot
