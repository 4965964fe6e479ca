// Force elements on MuJoCo's own coordinates.
//
// Damping, linear springs and rotors of joints are MuJoCo's (damping, stiffness, springref,
// armature; simulation/mjcf/plan.h). What 2.2 has no word for is applied along the coordinate's
// gradient u: springs with other terms than the linear one or without it, rotors on tendons, and
// dry friction that slides (frictionloss is a soft constraint without Stribeck's curve; it serves
// at rest in free motion, stick_slip.h):
//   F(q, q̇, q̈),  qfrc = F u                                                                   (1)
// A rotor on a tendon needs q̈ before it is known: the commanded one, so that its drive must be
// prescribed. So does one that feels its carrier turn. Where DOFs move by forces, MuJoCo has its
// J n² as armature, and the rest follows the accelerations that MuJoCo finds (Integrator::Settle):
// with M MuJoCo's inertia and C what J n q̇ a·ω adds to it, M q̈_{k+1} = f − C q̈_k, which
// converges, as ½ J (n q̇ ± a·ω)² ≥ 0 makes M + C and M − C positive.
#pragma once

#include "simulation/engine/constraint_system.h"
#include "simulation/engine/simulation.h"

// Bushings on MuJoCo's own bodies: one of the six coordinates between frames F and M (Bushing).
//
// With q = (w, v) the unit quaternion of R_FM, w >= 0, and n = |v|:
//   φ = θ v/n, θ = 2 atan2(n, w)                                                               (1)
//   φ̇ = T ω_FM,  T = ½ (θ/n) (w − [v]×) + v vᵀ (1 − θ w/(2n))/n²                               (2)
// from q̇ = ½ ω_FM q, the angular velocity in F's axes.

namespace mbv::simulation {

struct ElementMotion;

/// What a unit force along the coordinate does to the child at M's origin, world axes; the opposite
/// to the parent at the same place.
struct BushingLine {
  double value = 0.0;                             ///< of the coordinate [m or rad]
  Vec3 p_WM = Vec3::Zero();                       ///< [m]
  Vec3 push = Vec3::Zero(), turn = Vec3::Zero();  ///< force, moment
};
/// Of an element of a bushing at the data's position.
[[nodiscard]] BushingLine BushingLineOf(const ConstraintSystem& system, size_t element);
/// In the world: ElementPlace::axis_C.
[[nodiscard]] Vec3 TurnedAxis(const mjData& d, const ElementPlace& place);

/// dq/dq̇ of MuJoCo's velocities (nv).
[[nodiscard]] VecX BushingGradient(const ConstraintSystem& system, size_t element);
/// Position and rate at the data's qpos and qvel; the acceleration is NaN.
[[nodiscard]] ElementMotion BushingMotionOf(const ConstraintSystem& system, size_t element);

/// A rotor's axis a in a body that turns with ω, world axes; zero without a carrier.
struct RotorTurning {
  Vec3 axis = Vec3::Zero(), axis_rate = Vec3::Zero();  ///< a, ȧ
  Vec3 rate = Vec3::Zero();                            ///< ω
  double along = 0.0, along_rate = 0.0;                ///< a·ω and its derivative a·ω̇
};

/// Motion of an element's coordinate.
struct ElementMotion {
  double position = 0.0, rate = 0.0, acceleration = 0.0;
  bool rests = false;  ///< where it may have dry friction: at most at the rest rate, or held
  double load_friction = 0.0;  ///< by the joint's load (load_friction.h)
  double load_force = 0.0;     ///< ε Q of a coupling's losses
  int sliding = 0;             ///< where it is known: sign of the rate
  double engaged = 1.0;        ///< share of its force that acts (Switch)
  double held = 0.0;           ///< force of MuJoCo's row that holds it
  int branch = kAnyBranch;     ///< by which an expression is taken
  RotorTurning turning = {};
};

/// At the data's qpos, qvel and qacc; `acceleration` needs ConstraintSystem::Bias() there, and is
/// NaN for bushings.
[[nodiscard]] ElementMotion ElementMotionOf(const ConstraintSystem& system, size_t element);

/// dq/dq̇ of MuJoCo's velocities (nv).
[[nodiscard]] VecX ElementGradient(const ConstraintSystem& system, size_t element);

/// Force of an element along its coordinate [N or N m]; of friction at rest what MuJoCo holds it
/// with, or 0, the middle of what statics allows.
[[nodiscard]] double ForceOf(const ForceElement& element, const ElementMotion& at);

/// Friction may be anywhere within ± this about ForceOf(): the breakaway force at rest, of a
/// freewheel half of it, otherwise 0.
[[nodiscard]] double BreakawayAt(const ForceElement& element, const ElementMotion& at);

/// Of a rotor on the body that carries it, world axes [N m]:
///   M = −d/dt (J n q̇ a), where the force along q is −J n (n q̈ + d/dt (a·ω))                    (2)
[[nodiscard]] Vec3 CarrierMoment(const ForceElement& element, const ElementMotion& at);

/// What an element puts in [W].
[[nodiscard]] double PowerOf(const ForceElement& element, const ElementMotion& at);
/// Of that, what comes from springs.
[[nodiscard]] double SpringPowerOf(const ForceElement& element, const ElementMotion& at);
/// True if the rest of it is taken out of the mechanism for good.
[[nodiscard]] bool Dissipates(const ForceElement& element);

/// What elements exchange with the motion.
struct ElementEnergy {
  double stored = 0.0, kinetic = 0.0;  ///< in springs, in rotors [J]
};
[[nodiscard]] ElementEnergy EnergyOf(const ForceElement& element, const ElementMotion& at);

/// Slope of a spring's force over position, and of a damper's over rate; a curve's steepest one.
/// `unit`: 1 rad, or the characteristic length.
struct ElementSlope {
  double stiffness = 0.0, damping = 0.0;
};
[[nodiscard]] ElementSlope SlopeOf(const ForceElement& element, double position, double unit);

/// kUnsupported for a rotor on a distance drive whose motion is not prescribed, and where some
/// drive is not and MuJoCo steps by itself for rotors with a carrier and for friction other than
/// Coulomb's; for all friction where drives are force-controlled in open loop.
[[nodiscard]] RunSummary CheckElements(const EngineModel& engine, const Motion& motion,
                                       DriveMode drives, bool own_events);
/// Finds the elements that are prescribed, at the model's reference pose.
void FindPrescribedElements(EngineModel* engine);

/// True if there is something that MuJoCo lacks.
[[nodiscard]] bool HasLacking(const Mechanism& mechanism);
/// True if a rotor feels its carrier turn: then AddLackingForces() needs the data's qacc.
[[nodiscard]] bool HasGyroscopic(const Mechanism& mechanism);
/// Writes the accelerations to the data's qacc that the commanded ones, per driven coordinate, call
/// for, at the data's position and velocity (mj_comVel).
void SetCommandedAcceleration(const VecX& driven_acceleration, ConstraintSystem* system);
/// (1) and (2) of that, added to `qfrc` (nv); `driven_acceleration` is commanded, per driven
/// coordinate.
void AddLackingForces(const ConstraintSystem& system, const VecX& driven_acceleration,
                      double* qfrc);

}  // namespace mbv::simulation
