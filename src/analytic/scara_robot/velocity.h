// SCARA parallel robot: velocity, acceleration and singularity of the direct and inverse problem.
// Terms as in geometry.h.
//
//   (26, 27)  η_i·(ṗ + k_i φ̇) = l1 θ̇_i V_i
//   (28)      θ̇ = J Ẋ,  J = J_x⁻¹ J_θ,  Ẋ = J_θ⁻¹ J_x θ̇
//             J_x = l1 diag(V_i) (it multiplies θ̇), row i of J_θ = [η_iᵀ, η_i·k_i]
//   (29)      Ẍ = J⁻¹ (θ̈ − f),  f_i = Ẋᵀ Θ_i Ẋ / l1²
//   (30)      Θ_i = (1/V_i) [ −l1 (η_i·s_i) C + (η_i·u_i)/V_i² R_iᵀ η_i η_iᵀ R_i
//                             + (l1/L_i) R_iᵀ P_iᵀ P_i R_i ]
//             P_i = E − n_i η_iᵀ/V_i, R_i = [E k_i], C = diag(0, 0, 0, 1)
// (30) is the corrected form: the paper prints k_i for −s_i, the rod's angular velocity for the
// motor axis and l2 for every L_i, and l_i² for l1² in (29). [Zhu 2019 §3.1]
#pragma once

#include "analytic/scara_robot/position.h"

namespace mbv::scara_robot {

/// Velocities and accelerations of the platform (X) and the drives (θ).
struct Rates {
  Vec4 dX = Vec4::Zero(), ddX = Vec4::Zero();          ///< [m/s, rad/s], [m/s², rad/s²]
  Vec4 dtheta = Vec4::Zero(), ddtheta = Vec4::Zero();  ///< [rad/s], [rad/s²]
};

/// J_θ: rod extension rates per Ẋ (4 × 4, rows = limbs). [Zhu 2019, Eq. 28]
[[nodiscard]] Mat4 DirectJacobian(const Position& position);
/// Diagonal of J_x: l1 V_i. [Zhu 2019, Eq. 28]
[[nodiscard]] Vec4 InverseJacobian(const Parameters& parameters, const Position& position);

/// Θ_i, a quadratic form of Ẋ. [Zhu 2019, Eq. 30 corrected]
[[nodiscard]] Mat4 AccelerationForm(const Parameters& parameters, const Position& position,
                                    int limb);
/// f(Ẋ) = J̇ Ẋ [rad/s²]. [Zhu 2019, Eq. 29]
[[nodiscard]] Vec4 VelocityProduct(const Parameters& parameters, const Position& position,
                                   const Vec4& dX);

/// θ̇, θ̈ from Ẋ, Ẍ. V_i must not vanish.
void DriveRates(const Parameters& parameters, const Position& position, Rates* rates);
/// Ẋ, Ẍ from θ̇, θ̈. J_θ and V_i must not vanish.
void PlatformRates(const Parameters& parameters, const Position& position, Rates* rates);

/// How far a pose is from the singularities.
struct Singularity {
  double s_min = kNan;  ///< smallest singular value of J_θ with its φ column divided by r
  double det = kNan;    ///< determinant of the same
  double V_min = kNan;  ///< smallest branch·V_i: 0 at the dead point of a limb
  int dead_limb = 0;    ///< the limb of V_min
};
[[nodiscard]] Singularity Measure(const Parameters& parameters, const Position& position);

/// kSingular, with pose and limb, when the pose is rank deficient (see kRankDeficient).
RunSummary CheckRegular(const Position& position, const Singularity& singularity);

}  // namespace mbv::scara_robot
