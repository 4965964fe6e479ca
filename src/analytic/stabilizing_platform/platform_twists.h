// Motions of the lower platform {o} and the upper platform {p} [Li 2018, Eqs. 8–13].
//
//   {e} earth, z up      {s} ship: origin (0, 0, h), R_es = Rx(α) Ry(β)
//   {o} lower platform: R_eo = R_es, origin at (0, 0, s_r_so) of {s}      {p} upper platform
//
// Used terms: ω, ε angular velocity and acceleration; v_q, a_q velocity and acceleration of the
// point q. A twist V = [ω; v] has in v the velocity of the body point at the origin of the frame
// it is expressed in, and a twist's acceleration A is its plain time derivative (spatial
// acceleration), so that both transform with Ad(g).
//
// (8)  V_ep = [ω; v_p − ω × r_ep]          (9)  A_ep = [ε; a_p − ε × r_ep − ω × v_p]
//      (parasitic motion: ω = γ' e_z, v_p = (x', y', z'), and so on)
// (10) V_eo = [ω; v_o − ω × r_eo]          (11) A_eo = [ε; a_o − ε × r_eo − ω × v_o]
//      ω_eo = α' e_x + β' e_y',  e_y' = Rx(α) e_y,  ε_eo = α'' e_x + β'' e_y' + α' β' e_x × e_y'
//      v_o = h' e_z + ω × r_so,  a_o = h'' e_z + ε × r_so + ω × (ω × r_so)
// (12) V_ep = V_eo + Ad(g_eo) °V_op
// (13) A_ep = A_eo + Ad(g_eo) °A_op + [V_eo, Ad(g_eo) °V_op]
#pragma once

#include <array>

#include "core/profile.h"
#include "core/types.h"

namespace mbv::stabilizing_platform {

/// Pose and motion of a body frame B in the earth frame E; all vectors in E.
struct FrameMotion {
  Mat3 R_EB = Mat3::Identity();
  Vec3 p_EB = Vec3::Zero();
  Vec3 v = Vec3::Zero(), a = Vec3::Zero();            ///< of B's origin [m/s, m/s²]
  Vec3 omega = Vec3::Zero(), epsilon = Vec3::Zero();  ///< [rad/s, rad/s²]
};

/// The lower platform under the ship's roll, pitch [rad] and heave [m] (below (10) and (11)).
[[nodiscard]] FrameMotion LowerPlatformMotion(const Jet& roll, const Jet& pitch, const Jet& heave,
                                              double s_r_so);
/// The upper platform from its position and roll, pitch, yaw (R = Rz Ry Rx) in the earth frame.
[[nodiscard]] FrameMotion UpperPlatformMotion(const std::array<Jet, 6>& xyz_rpy);

/// (8), (10): the twist about the earth's origin.
[[nodiscard]] Vec6 TwistOf(const FrameMotion& motion);
/// (9), (11): the spatial acceleration about the earth's origin.
[[nodiscard]] Vec6 SpatialAccelerationOf(const FrameMotion& motion);

/// What the closed form needs of both platforms, all expressed in {o} about {o}'s origin.
struct RelativeMotion {
  Mat3 R_op = Mat3::Identity();
  Vec3 p_op = Vec3::Zero();
  Vec6 V_op = Vec6::Zero(), A_op = Vec6::Zero();  ///< of {p} relative to {o}, (12), (13)
  Vec6 V_eo = Vec6::Zero(), A_eo = Vec6::Zero();  ///< of {o} relative to the earth
  Vec6 V_ep = Vec6::Zero(), A_ep = Vec6::Zero();  ///< of {p} relative to the earth
  Vec3 gravity = Vec3::Zero();                    ///< R_oe (0, 0, −g) [m/s²]
};

/// (12), (13), solved for the relative twist and acceleration.
[[nodiscard]] RelativeMotion ComputeRelativeMotion(const FrameMotion& lower,
                                                   const FrameMotion& upper, double g);

/// [V1, V2] = ad(V1) V2.
[[nodiscard]] inline Vec6 Bracket(const Vec6& V1, const Vec6& V2) {
  Vec6 out;
  out << V1.head<3>().cross(V2.head<3>()),
      V1.tail<3>().cross(V2.head<3>()) + V1.head<3>().cross(V2.tail<3>());
  return out;
}

}  // namespace mbv::stabilizing_platform
