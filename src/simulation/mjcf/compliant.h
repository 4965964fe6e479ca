// The compliant model of a mechanism with beams: a Mechanism of rigid pieces, springs on some of
// its joints, and its MJCF.
//
// * An elastic body becomes one rigid piece per node (a point where its beams end or meet), with
//   the body's own frame at the given pose; joints, drive ends and outputs act on the node at
//   their place. A rigid body is one piece.
// * The two halves of a beam belong to the pieces at its ends. At mid-span three slides and three
//   hinges in beam axes join them, with stiffness EA/L, 12 E I_z/L³, 12 E I_y/L³, GJ/L, E I_y/L,
//   E I_z/L: at mid-span force and moment of an Euler–Bernoulli beam act on deformations of their
//   own, and carried to an end they give its cantilever compliance exactly.
// * Pieces that cannot move against each other (fixed joints, single-DOF joints of locked drives,
//   prescribed joints) are one body. Servos are springs at the drive's coordinate; locked drives of
//   several DOFs and locked legs stay held by an equality.
// * Every joint carries all its reactions: the isostatic rule is for rigid bodies.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv::mjcf {

/// A spring on a MuJoCo joint or tendon of the compliant model.
struct ElasticSpring {
  std::string element;  ///< Beam::name, or "DRIVE (servo)"
  std::string object;   ///< MuJoCo's joint or tendon
  bool is_tendon = false;
  double stiffness = kNan;  ///< [N/m or N m/rad]
  double reference = 0.0;   ///< of tendons: length without force [m]; joints are at 0 without force
};

struct CompliantModel {
  Mechanism mechanism;  ///< pieces and joints, home pose = the given pose, no gravity
  std::vector<ElasticSpring> springs;
  std::string mjcf;  ///< with the springs' stiffness
};

/// The compliant model of `mechanism` in the pose X_WB (one pose per body, loops closed), with
/// output `output` as its only output. Empty, with the reason in `error`, where a joint, drive end
/// or output is on no node of its elastic body, pieces hang on nothing, or the mechanism has
/// spring-dampers.
[[nodiscard]] std::optional<CompliantModel> MakeCompliantModel(const Mechanism& mechanism,
                                                               const std::vector<Pose>& X_WB,
                                                               int output, std::string* error);

// The springs of a compliant model in its MJCF text.

/// The writer's text with the stiffness of the joint springs (those of tendons are there). Their
/// coordinates count from the given pose, so that they are deformations: the rounding of an angle
/// of 1 rad, times the servo's stiffness, would unbalance small loads.
[[nodiscard]] std::string TextWithSprings(const CompliantModel& model);

}  // namespace mbv::mjcf
