// Two body-fixed frames in motion, and the scalars between them that constraints are made of.
//
// Internal to kinematics/. F lies on the parent body P, M on the child body C. All vectors are in
// world axes. Each scalar c comes with its exact derivatives, ċ = J V and c̈ = J A + b.
#pragma once

#include <vector>

#include "base/types.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv::internal {

struct FramePair {
  Mat3 R_WF, R_WM;
  Vec3 r_F, r_M;     ///< from the body origins Po, Co to the frame origins
  Vec3 d, d_rate;    ///< from F's origin to M's, and its time derivative
  Vec3 w_P, w_C;     ///< angular velocities
  Vec3 centripetal;  ///< ω_C×(ω_C×r_M) − ω_P×(ω_P×r_F)
  bool moves;        ///< false: as if at rest, rates and biases are zero
};

[[nodiscard]] FramePair MakePair(const BodyStates& states, int parent, const Pose& X_PF, int child,
                                 const Pose& X_CM, bool moves = true);

/// A scalar without the indices of its bodies.
struct PairScalar {
  double value;
  Vec6 J_parent, J_child;
  double bias;
  double rate = 0.0;  ///< ċ, where the caller needs it
};

/// n·d with n fixed in F (components n_F).
[[nodiscard]] PairScalar Along(const FramePair& pair, const Vec3& n_F);
/// f·m with f fixed in F and m fixed in M (components f_F, m_M).
[[nodiscard]] PairScalar Cosine(const FramePair& pair, const Vec3& f_F, const Vec3& m_M);
/// |d|, which must not vanish.
[[nodiscard]] PairScalar Distance(const FramePair& pair);
/// atan2(s, c).
[[nodiscard]] PairScalar Angle(const PairScalar& s, const PairScalar& c);

/// Roll, pitch or yaw (0, 1, 2) of R_FM = Rz Ry Rx.
[[nodiscard]] PairScalar RollPitchYaw(const FramePair& pair, int component);
/// Component of the rotation vector φ = log R_FM in F's axes, |φ| < π:
///   φ̇ = T(φ) w, w = R_WFᵀ (ω_C − ω_P), T = 1 − ½ [φ]× + c(θ) [φ]×²,
///   c = 1/θ² − cot(θ/2)/(2θ), θ = |φ|                     [Murray, Li, Sastry 1994, ch. 2]
[[nodiscard]] PairScalar RotationVector(const FramePair& pair, int component);

// First variations of all this where the bodies are moved by small twists [θ; x of the origin] in
// world axes and keep their velocities. Along them
//   δ(J V) = δJ V,  δ(J A + b) = δJ A + δb                                                    (1)
// and by other velocities, since b(V) = δJ|_V V: δb = δJ|_V δV + δJ|_δV V.                    (2)

struct VariedPair {
  FramePair at;
  Vec3 t_P, t_C;  ///< θ of parent and child
  Vec3 r_F, r_M, d, d_rate, centripetal;
};
[[nodiscard]] VariedPair MakePair(const BodyStates& states, const std::vector<Vec6>& by, int parent,
                                  const Pose& X_PF, int child, const Pose& X_CM);

struct VariedScalar {
  PairScalar at, by;
};
[[nodiscard]] VariedScalar Along(const VariedPair& pair, const Vec3& n_F);
[[nodiscard]] VariedScalar Cosine(const VariedPair& pair, const Vec3& f_F, const Vec3& m_M);
[[nodiscard]] VariedScalar Distance(const VariedPair& pair);
[[nodiscard]] VariedScalar Angle(const VariedScalar& s, const VariedScalar& c);
[[nodiscard]] VariedScalar RollPitchYaw(const VariedPair& pair, int component);
[[nodiscard]] VariedScalar RotationVector(const VariedPair& pair, int component);

}  // namespace mbv::internal
