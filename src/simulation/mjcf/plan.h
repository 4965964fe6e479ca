// How a Mechanism is laid out as MuJoCo bodies: which bodies and joints exist, under which names.
//
// The text (mjcf.cc) and the simulation read the same plan, so that every coordinate, body and
// closure of the mechanism is found again in the compiled model by name.
//
// * Bodies follow the spanning tree at the home pose. A massless body to which nothing but two
//   tree joints is attached is merged into its outboard body: the joints become several joints of
//   one MuJoCo body, which is exact.
// * Joints with several DOFs become several hinges and slides; a ball in the tree stays a
//   ball. A revolute or universal tree joint that transmits a force only is a ball as well.
//   `ref` makes the position of every hinge and slide equal to the joint coordinate.
// * Closures: ball and force-only joints are `connect`, fixed ones `weld`. Any other kind is
//   represented exactly by splitting the closing body into equal halves: the new half hangs on
//   the closing joint like a tree body, and the halves are welded together.
// * A deep tree is cut: MuJoCo's inertia matrix of bodies that nest is dense, and its XML reader
//   takes no deep nesting. At a cut a body with all that hangs on it has its place from the world,
//   on a free joint that the mechanism does not have, and its tree joint is closed as a closure is.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/types.h"
#include "mechanism/mechanism.h"

namespace mbv::mjcf {

/// A joint of MuJoCo. `ref` equals the mechanism's coordinate at home.
struct PlannedJoint {
  enum class Type { kHinge, kSlide, kBall, kFree };
  std::string name;  ///< JOINT, or JOINT.k for coordinate k of a joint with several DOFs
  Type type = Type::kHinge;
  int joint = -1;       ///< Mechanism::joints; -1: a free joint where the tree is cut
  int coordinate = -1;  ///< of that joint; -1 for ball, free, and the slides and ball of a free
                        ///< joint inside the tree
  Vec3 axis_W = Vec3::UnitZ();    ///< hinge and slide: at home, positive as the coordinate
  Vec3 p_WAnchor = Vec3::Zero();  ///< at home [m]
  double ref = 0.0;
};

struct PlannedBody {
  std::string name;                  ///< of the mechanism's body; JOINT.half for a half
  int body = 0;                      ///< Mechanism::bodies
  int half_of = -1;                  ///< closure joint for which this half was made
  int parent = 0;                    ///< index into Plan::bodies, smaller than the own
  std::vector<PlannedJoint> joints;  ///< inner to outer
  double share = 1.0;                ///< part of the body's mass and inertia
  double mass = 0.0;                 ///< [kg], share applied, tiny mass of massless bodies included
  Mat3 I_Bcm_B = Mat3::Zero();       ///< [kg m²], as `mass`
};

/// True where the tree is cut: the body has its place from the world.
[[nodiscard]] inline bool HasPlace(const PlannedBody& body) {
  return body.joints.size() == 1 && body.joints[0].joint < 0;
}

struct PlannedClosure {
  enum class Type { kConnect, kWeld, kSplit };
  Type type = Type::kConnect;
  std::string name;  ///< of the equality constraint: "close:JOINT"
  int joint = -1;    ///< Mechanism::joints; a tree joint where the tree is cut
  int body1 = 0;     ///< Plan::bodies: the joint's child; for a split, the whole body's rest
  int body2 = 0;     ///< Plan::bodies: the joint's parent; for a split, the half
  bool split_parent = false;  ///< the parent body was split, not the child
};

struct Plan {
  std::vector<PlannedBody> bodies;  ///< [0] is the world; parents before children
  std::vector<PlannedClosure> closures;
  std::vector<int> body_of;     ///< per mechanism body: index into `bodies`, -1 if merged
  std::vector<bool> tiny_mass;  ///< per mechanism body: massless, given a tiny mass
};

/// Mass given to a massless body that cannot be merged, as a fraction of the mechanism's mass. Its
/// radius of gyration is a tenth of the mechanism's extent at home.
inline constexpr double kTinyMassFraction = 1e-11;

[[nodiscard]] Plan MakePlan(const Mechanism& mechanism);

/// Diagonal of the box around all joints at home, at least the characteristic length [m].
[[nodiscard]] double Extent(const Mechanism& mechanism);

/// Why MuJoCo's XML reader does not take the nested bodies of a plan; "" if it does.
[[nodiscard]] std::string NestingTrouble(const Plan& plan);

/// How MuJoCo holds a coupling.
struct PlannedCoupling {
  enum class Type {
    kJoint,    ///< equality of two joints (or of one): q_1 − ref_1 = Σ_i a_i (q_2 − ref_2)^i
    kTendon,   ///< fixed tendon of constant length Σ c_k q_k
    kUnknown,  ///< neither of them
  };
  Type type = Type::kUnknown;
  size_t first = 0, second = 0;      ///< kJoint: terms of joints 1 and 2; equal: joint 1 alone
  std::array<double, 5> polycoef{};  ///< kJoint: a; kTendon: the first is the length's difference
                                     ///< from that at the reference pose
};
[[nodiscard]] PlannedCoupling PlanCoupling(const Mechanism& mechanism, const Coupling& coupling);

/// What MuJoCo 2.2 has of the force elements along one coordinate: force
/// −stiffness (q − free) − damping q̇ − armature q̈.
struct PlannedForces {
  double damping = 0.0, stiffness = 0.0, armature = 0.0;  ///< SI
  double friction = 0.0;                                  ///< of those that IsPlainFriction()
  double free = 0.0;                                      ///< position of no spring force

  [[nodiscard]] bool any() const { return damping != 0.0 || stiffness != 0.0 || armature != 0.0; }
};
/// Sums over the elements of a joint's coordinate; a preload moves the free position.
[[nodiscard]] PlannedForces ForcesOfJoint(const Mechanism& mechanism, int joint, int coordinate);
/// True where the sums of all six coordinates of a free joint are the same number, which is all
/// that MuJoCo's text can say of one.
[[nodiscard]] bool HasEqualForces(const Mechanism& mechanism, int free_joint);
/// … of a distance drive, whose tendon has no armature.
[[nodiscard]] PlannedForces ForcesOfDrive(const Mechanism& mechanism, int drive);
/// True for what these contain: damping, linear springs, rotors of joints; nothing of a bushing and
/// no rotor that its carrier turns.
[[nodiscard]] bool IsPlanned(const ForceElement& element);

/// Dry friction that MuJoCo's frictionloss means as well: of one amount, whatever moves and
/// whatever the joint bears, along a hinge or slide. The engine computes friction itself; an export
/// states it.
[[nodiscard]] bool IsPlainFriction(const Mechanism& mechanism, const ForceElement& element);

/// Name of the MuJoCo joint of a joint's coordinate.
[[nodiscard]] std::string JointName(const Joint& joint, int coordinate);

/// Name of the free joint on which a body has its place where the tree is cut: "place:BODY".
[[nodiscard]] std::string PlaceName(const Body& body);

/// Names of the equality constraints.
[[nodiscard]] std::string ClosureName(const Joint& joint);           // "close:JOINT"
[[nodiscard]] std::string DriveEqualityName(const Drive& drive);     // "drive:DRIVE"
[[nodiscard]] std::string BaseEqualityName(const Prescribed& base);  // "base:PRESCRIBED"
[[nodiscard]] std::string CouplingName(const Coupling& coupling);    // "couple:COUPLING"

/// Endings of the names of a drive's servo actuators.
inline constexpr const char* kPositionServo = ".position_servo";
inline constexpr const char* kVelocityServo = ".velocity_servo";

}  // namespace mbv::mjcf
