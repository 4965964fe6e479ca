// Force elements on MuJoCo's own coordinates.
//
// Damping, linear springs and rotors of joints are MuJoCo's (damping, stiffness, springref,
// armature; mjcf/plan.h). What 2.2 has no word for is pushed along the coordinate's gradient u:
// springs with other terms than the linear one or without it, rotors on tendons, and dry friction
// (frictionloss is a soft constraint without Stribeck's curve):
//   F(q, q̇, q̈),  qfrc = F u                                                                   (1)
// A rotor on a tendon needs q̈ before it is known: the commanded one, so that its drive must be
// guided.
#pragma once

#include "simulation/constraint_system.h"

namespace mbv::simulation {

/// Motion of an element's coordinate.
struct ElementMotion {
  double position = 0.0, rate = 0.0, acceleration = 0.0;
  bool rests = false;          ///< where it may rub: at most at the rest rate
  double load_friction = 0.0;  ///< by the joint's load (load_friction.h)
};

/// At the data's qpos, qvel and qacc; `acceleration` needs ConstraintSystem::Bias() there.
[[nodiscard]] ElementMotion ElementMotionOf(const ConstraintSystem& system, size_t element);

/// dq/dq̇ of MuJoCo's velocities (nv).
[[nodiscard]] VecX ElementGradient(const ConstraintSystem& system, size_t element);

/// Force of an element along its coordinate [N or N m]; of friction at rest 0, the middle of what
/// statics allows.
[[nodiscard]] double ForceOf(const ForceElement& element, const ElementMotion& at);

/// Friction may be anywhere within ± this: the breakaway force at rest, otherwise 0.
[[nodiscard]] double BreakawayAt(const ForceElement& element, const ElementMotion& at);

/// Force times rate [W].
[[nodiscard]] inline double PowerOf(const ForceElement& element, const ElementMotion& at) {
  return ForceOf(element, at) * at.rate;
}
/// True if the element takes power out of the mechanism for good.
[[nodiscard]] inline bool Dissipates(const ForceElement& element) {
  return std::holds_alternative<DampingLaw>(element.law) ||
         std::holds_alternative<FrictionLaw>(element.law);
}

/// What elements exchange with the motion.
struct ElementEnergy {
  double stored = 0.0, kinetic = 0.0;  ///< in springs, in rotors [J]
};
[[nodiscard]] ElementEnergy EnergyOf(const ForceElement& element, const ElementMotion& at);

/// Slope of a spring's force over position, and of a damper's over rate.
struct ElementSlope {
  double stiffness = 0.0, damping = 0.0;
};
[[nodiscard]] ElementSlope SlopeOf(const ForceElement& element, double position);

/// kUnsupported for a rotor on a distance drive that is not guided, and for friction where some
/// drive is not.
[[nodiscard]] RunSummary CheckElements(const EngineModel& engine, const Motion& motion);

/// True if there is something that MuJoCo lacks.
[[nodiscard]] bool HasLacking(const Mechanism& mechanism);
/// (1) of that, added to `qfrc` (nv); `driven_acceleration` is commanded, per driven coordinate.
void AddLackingForces(const ConstraintSystem& system, const VecX& driven_acceleration,
                      double* qfrc);

}  // namespace mbv::simulation
