// Mechanism → MJCF text: a pure, deterministic function.
#pragma once

#include <string>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

/// Strongest impedance that MuJoCo accepts, and the usual time constant of the guiding constraints
/// in steps.
inline constexpr double kMjcfImpedance = 0.9999;
inline constexpr double kMjcfTimeConstantSteps = 2.0;

/// A keyframe: a pose at rest that a person can load.
struct MjcfKey {
  std::string name = {};
  double time_s = 0.0;
  std::vector<double> qpos = {};            ///< as the compiled model numbers them
  std::vector<double> drive_position = {};  ///< per drive: servos' targets
};

struct MjcfOptions {
  double step_s = 1e-3;                                 ///< <option timestep>
  bool pictures = true;                                 ///< geoms, lights and scene assets
  double time_constant_steps = kMjcfTimeConstantSteps;  ///< of every equality (solref), in steps
  bool default_softness = false;  ///< equalities as soft as MuJoCo makes them unasked
  bool runge_kutta = false;       ///< <option integrator>: RK4 instead of Euler
  bool prescribed = true;  ///< false: the equalities that prescribe drive motion are switched off
  std::vector<double> kp = {}, kv = {};  ///< servos: per drive, a position and a velocity actuator
  std::vector<double> motor_home = {};   ///< per drive: the motors' forces in the key "home"
  bool friction = false;  ///< frictionloss, for other programs; our engine has friction of its own
  bool statics = false;   ///< masses mean nothing: not for stepping in time, says the comment
};

/// The MJCF of a mechanism in its home pose: bodies along the spanning tree
/// (simulation/mjcf/plan.h), `connect`/`weld` equalities "close:JOINT" for the closures,
/// `joint`/`tendon` equalities "couple:COUPLING" for the couplings (those that MuJoCo knows:
/// simulation/mjcf/plan.h) and "drive:DRIVE" and "base:PRESCRIBED" that guide drives and prescribed
/// joints (at home until the first polynomial coefficient is changed), motors and sensors for stock
/// tools, with gains also servos "DRIVE.position_servo" and "DRIVE.velocity_servo", sites "JOINT.F"
/// (on the parent) and "JOINT.M" (on the child) at closures and sites named like the outputs.
/// A comment says how to use the file; the key "home" is the home pose with what holds it. Every
/// number reads back as the same double. Loads in MuJoCo 2.2.2 and later.
[[nodiscard]] std::string WriteMjcf(const Mechanism& mechanism, const MjcfOptions& options = {});

/// What acts on forces and is not in that text, a line each: the comment has them, too.
[[nodiscard]] std::vector<std::string> MissingInMjcf(const Mechanism& mechanism,
                                                     const MjcfOptions& options);

/// The text that WriteMjcf() wrote with more keyframes behind "home".
[[nodiscard]] std::string WithKeys(const std::string& mjcf, const std::vector<MjcfKey>& keys);

/// Principal moments (descending) and axes of an inertia matrix: I = R diag(moments) Rᵀ. Diagonal
/// matrices keep their axes. Moments are raised where rounding or a slender body breaks MuJoCo's
/// rules (positive; none larger than the sum of the others).
struct PrincipalInertia {
  Vec3 moments = Vec3::Zero();
  Vec3 admissible = Vec3::Zero();  ///< that MuJoCo compiles; others only where it refuses
  Mat3 R = Mat3::Identity();
};
[[nodiscard]] PrincipalInertia PrincipalInertiaOf(const Mat3& I, double mass);

}  // namespace mbv

// What a person who opens a generated file has to know.

namespace mbv::mjcf {

/// The comment at the head of the MJCF: what it is, and the two ways to use it.
[[nodiscard]] std::string HeadComment(const Mechanism& mechanism, const MjcfOptions& options);

}  // namespace mbv::mjcf
