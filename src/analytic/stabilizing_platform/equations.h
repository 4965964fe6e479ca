// The pipeline of the stabilizing platform's equations at one instant: (5)–(20), f_X, (21)
// corrected, limb solution. Everything has fixed size; nothing allocates.
//
// Three formulations:
//   full        link masses everywhere (the corrected equations)
//   massless    only the platform has mass (the paper's figures)
//   paper_text  the paper's literal sequence: (21) without the limbs' forces along X, then link
//               masses in the limb plane only; wrong by up to 10 kN on the default motion
#pragma once

#include <array>
#include <span>

#include "analytic/stabilizing_platform/limb_dynamics.h"
#include "analytic/stabilizing_platform/parasitic_motion.h"
#include "analytic/stabilizing_platform/platform_wrench.h"

namespace mbv::stabilizing_platform {

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
