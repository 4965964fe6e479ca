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
#pragma once

#include <array>
#include <vector>

#include "analytic/scara_robot/dynamics.h"
#include "core/trace.h"

namespace mbv::scara {

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

}  // namespace mbv::scara
