// Velocities (11)–(20), accelerations and inverse dynamics (D1)–(D12) of the 3-SPR mechanism.
//
// With v, v̇ of O_A given and the posture known:
//
//   (12)  ω = J_c v,       J_c = −[(d_i × c_i)ᵀ]⁻¹ [c_iᵀ]            (rows i = 1, 2, 3)
//   (13)  v_Ai = v + ω × a_i
//   (14)  q̇ = J v,         J = [w_iᵀ] + [(a_i × w_i)ᵀ] J_c
//   (16)  ω_i,xy = (w_i × v_Ai)/q_i;   (19)  ω_i,z = (w_i·ω) w_i;   (20)  ω_i = ω_i,xy + ω_i,z
//   (20c) J_di = (1/q_i) {[w_i×] + [(w_i·a_i) E − a_i w_iᵀ + q_i w_i w_iᵀ] J_c},  ω_i = J_di v
//
//   (D1)  (d_i × c_i)·ω̇ = −c_i·v̇ + 2 c_i·(ω × v) − (ω × d_i)·(ω × c_i)
//   (D2)  a_Ai = v̇ + ω̇ × a_i + ω × (ω × a_i)
//   (D3)  q̈_i = a_Ai·w_i + |v_Ai − q̇_i w_i|²/q_i
//   (D4)  ẇ_i = (v_Ai − q̇_i w_i)/q_i
//   (D5)  ω_i by (20)
//   (D6)  ω̇_i = [w_i × a_Ai − 2 q̇_i ω_i,xy]/q_i + (ω̇·w_i + ω·ẇ_i) w_i + (ω·w_i) ẇ_i
//   (D7)  F = m (a_G − g) − external force,  N = I α + ω × I ω − external moment about G
//   (D8)  Q = Σ (VᵀF + WᵀN),  v_G = V v and ω_body = W v
//   (D9)  Jᵀ f = Q
//   (D10) M = Σ (m VᵀV + WᵀIW)
//   (D11) balance of forces, of moments about O_B, and of each leg's moments about its hinge axis
//         gives the forces S_i of the base on the legs
//   (D12) f_i = (S_i − F_cyl,i)·w_i, a second way to f
//
// (D1) is (12) differentiated: c_i stays fixed in the platform, d_i = b_i − r.
#pragma once

#include "analytic/spr_tripod/position.h"

namespace mbv::spr_tripod {

/// Velocity state, in world axes.
struct Velocities {
  Vec3 v = Vec3::Zero();      ///< of O_A [m/s]
  Vec3 omega = Vec3::Zero();  ///< of the platform [rad/s]
  PerLeg<Vec3> v_A;           ///< of A_i
  PerLeg<Vec3> omega_leg;     ///< ω_i of both leg parts
  PerLeg<double> q_dot{};     ///< [m/s]
  PerLeg<double> spin{};      ///< w_i·ω, the leg's turning about its own axis [rad/s]
};

struct Accelerations {
  Vec3 v_dot = Vec3::Zero();      ///< of O_A [m/s²]
  Vec3 omega_dot = Vec3::Zero();  ///< [rad/s²]
  PerLeg<Vec3> a_A;
  PerLeg<Vec3> omega_leg_dot;
  PerLeg<double> q_ddot{};  ///< [m/s²]
};

/// Jacobians of one posture.
struct Jacobians {
  Mat3 D_inv = Mat3::Zero();  ///< [(d_i × c_i)ᵀ]⁻¹
  Mat3 J_c = Mat3::Zero();    ///< (12) ω = J_c v
  Mat3 J = Mat3::Zero();      ///< (14) q̇ = J v
  Mat3 J_inv = Mat3::Zero();  ///< v = J⁻¹ q̇
  double det_c = 0.0;         ///< determinant of [(d_i × c_i)ᵀ] [m³]
  double det = 0.0;           ///< determinant of J
};

/// (12), (14). kSingular when the orientation does not follow from O_A, or O_A not from the legs:
/// |det_c| <= 1e-9 b³ or |det J| <= 1e-9.
[[nodiscard]] RunSummary FillJacobians(const Geometry& geometry, const Posture& posture,
                                       Jacobians* jacobians);

/// (20c): leg angular velocity per velocity of O_A (3×3, world axes) [1/m].
[[nodiscard]] Mat3 LegJacobian(const Posture& posture, const Jacobians& jacobians, int leg);

/// (13), (14), (16)–(20) for the velocity v of O_A.
void FillVelocities(const Posture& posture, const Jacobians& jacobians, const Vec3& v,
                    Velocities* velocities);

/// (D1)–(D6) for the acceleration v_dot of O_A.
void FillAccelerations(const Posture& posture, const Jacobians& jacobians,
                       const Velocities& velocities, const Vec3& v_dot,
                       Accelerations* accelerations);

/// The seven moving bodies: platform, cylinders 1–3, rods 1–3.
inline constexpr int kBodies = 7;
inline constexpr int kPlatform = 0;
inline constexpr int CylinderBody(int leg) { return 1 + leg; }
inline constexpr int RodBody(int leg) { return 4 + leg; }
/// Leg 0…2 that a body belongs to, -1 for the platform.
inline constexpr int LegOf(int body) { return body == kPlatform ? -1 : (body - 1) % 3; }
[[nodiscard]] const Inertia& InertiaOf(const Masses& masses, int body);

/// External force and moment (about the body's origin) per body, world axes.
struct ExternalLoads {
  std::array<Vec3, kBodies> force, moment;
  ExternalLoads() { Clear(); }
  void Clear() {
    force.fill(Vec3::Zero());
    moment.fill(Vec3::Zero());
  }
  /// Adds a force and a moment acting at p_BoQ_W from the origin of `body`.
  void Add(int body, const Vec3& p_BoQ_W, const Vec3& f, const Vec3& m) {
    force[body] += f;
    moment[body] += m + p_BoQ_W.cross(f);
  }
};

/// Orientation of leg i's frame: [c_i, w_i × c_i, w_i].
[[nodiscard]] Mat3 LegRotation(const Posture& posture, int leg);
/// Orientation and origin of one of the seven bodies, in the world.
[[nodiscard]] Pose BodyPose(const Posture& posture, int body);

struct Forces {
  PerLeg<double> f{};        ///< (D9) drive forces [N], positive pushes
  PerLeg<Vec3> S;            ///< (D11) force of the base on leg i at B_i [N]
  PerLeg<double> f_check{};  ///< (D12) from S
};

/// (D7)–(D9), (D11), (D12).
void FillForces(const Posture& posture, const Jacobians& jacobians, const Velocities& velocities,
                const Accelerations& accelerations, const Masses& masses,
                const ExternalLoads& loads, Forces* forces);

/// (D10): 3×3 mass matrix of the motion of O_A [kg].
[[nodiscard]] Mat3 TaskSpaceMass(const Posture& posture, const Jacobians& jacobians,
                                 const Masses& masses);

/// Kinetic plus potential energy [J]; potential −Σ m g·p_G, zero at O_B.
[[nodiscard]] double Energy(const Posture& posture, const Velocities& velocities,
                            const Masses& masses);

}  // namespace mbv::spr_tripod
