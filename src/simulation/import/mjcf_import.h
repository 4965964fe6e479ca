// What an MJCF file becomes, on its way: MuJoCo's compiled model, the mechanism so far, and which
// part of one is which part of the other. Internal to simulation/.
#pragma once

#include <fmt/format.h>
#include <set>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/mechanism.h"
#include "simulation/engine/engine.h"
#include "simulation/mjcf/foreign.h"

namespace mbv::simulation {

[[nodiscard]] inline Vec3 VecAt(const mjtNum* data) { return {data[0], data[1], data[2]}; }
[[nodiscard]] inline Mat3 RotationAt(const mjtNum* quat) {
  return Eigen::Quaterniond(quat[0], quat[1], quat[2], quat[3]).normalized().toRotationMatrix();
}
[[nodiscard]] inline Pose PoseAt(const mjtNum* pos, const mjtNum* quat) {
  Pose X = Pose::Identity();
  X.translation() = VecAt(pos);
  X.linear() = RotationAt(quat);
  return X;
}
[[nodiscard]] inline Pose Shifted(const Vec3& p) { return Pose(Eigen::Translation3d(p)); }

/// Hinges and slides.
[[nodiscard]] inline bool IsScalar(const mjModel& m, int joint) {
  return m.jnt_type[joint] == mjJNT_HINGE || m.jnt_type[joint] == mjJNT_SLIDE;
}

struct MjcfImport {
  const mjModel& m;
  const mjcf::ForeignMjcf& foreign;
  const std::string& file;
  Diagnostics* diagnostics;
  const FloatingBase& base;  ///< by option

  const mjtNum* qpos = nullptr;  ///< pose of the file: the first keyframe's, or the reference
  Mechanism mechanism = {};
  std::vector<int> body_of = {};     ///< per body of MuJoCo: index into mechanism.bodies
  std::vector<int> joint_of = {};    ///< per joint of MuJoCo: index into mechanism.joints
  std::vector<int> closure_of = {};  ///< per equality: index into mechanism.joints, or -1

  std::vector<ModelCaveat> left_out = {};  ///< what acts on forces and is not in the mechanism

  /// Per joint of MuJoCo: a free one whose body is carried by its loops, and not held.
  std::vector<bool> moves = {};
  /// Body of MuJoCo that is held in the place of the free body at the root of its tree, or -1.
  int held_inside = -1;

  // What the findings at the end report.
  std::vector<std::string> held = {}, carried = {}, floating = {}, shifted = {}, moved = {};
  std::vector<std::string> driving = {};       ///< joints whose damping is negative
  std::vector<std::string> without_room = {};  ///< joints whose limit allows no motion
  std::set<int> coupling_tendons = {};         ///< that are nothing but the sum in a coupling
  std::set<int> driven_tendons = {};           ///< between two sites, with a drive
  std::set<int> sprung_tendons = {};           ///< between two sites, as springs
  bool touching = false;                       ///< geoms would touch each other

  void Say(const std::string& text, const std::string& hint = "") const {
    diagnostics->Add({Severity::kWarning, file, 0, 0, text, hint});
  }
  void Refuse(const std::string& text, const std::string& hint) const {
    diagnostics->Add({Severity::kError, file, 0, 0, text, hint});
  }
  /// Leaves out what a row of foreign_rows.h is about; `what` names it. The effect is the row's.
  void LeaveOut(const char* element, const char* attribute, const std::string& what);
  /// What the file's flags switch off, e.g. mjDSBL_PASSIVE.
  [[nodiscard]] bool IsOff(int flag) const { return (m.opt.disableflags & flag) != 0; }
  [[nodiscard]] bool EqualitiesAreOff() const {
    return IsOff(mjDSBL_EQUALITY) || IsOff(mjDSBL_CONSTRAINT);
  }
  [[nodiscard]] bool FrictionIsOff() const {
    return IsOff(mjDSBL_FRICTIONLOSS) || IsOff(mjDSBL_CONSTRAINT);
  }
  [[nodiscard]] bool LimitsAreOff() const {
    return IsOff(mjDSBL_LIMIT) || IsOff(mjDSBL_CONSTRAINT);
  }
  [[nodiscard]] bool ContactsAreOff() const {
    return IsOff(mjDSBL_CONTACT) || IsOff(mjDSBL_CONSTRAINT);
  }
  /// Of a body or joint; 0 without one.
  [[nodiscard]] double BodyNumber(int b, mjcf::UserNumber which) const {
    return m.nuser_body == 0 ? 0.0 : m.body_user[m.nuser_body * b + static_cast<int>(which)];
  }
  [[nodiscard]] double JointNumber(int j, mjcf::UserNumber which) const {
    return m.nuser_jnt == 0 ? 0.0 : m.jnt_user[m.nuser_jnt * j + static_cast<int>(which)];
  }
  [[nodiscard]] std::string NameOf(mjtObj type, int id, const char* kind) const {
    return NameAt(m, type, id, kind);
  }
  [[nodiscard]] std::string JointNameOf(int j) const { return NameOf(mjOBJ_JOINT, j, "joint"); }
  /// The mechanism's body that a body of MuJoCo became.
  [[nodiscard]] Body& BodyOf(int b) {
    return mechanism.bodies[static_cast<size_t>(body_of[static_cast<size_t>(b)])];
  }
};

// In this order, each needs those before.

/// Which bodies on free joints are held: of those that closures tie together one, `base` or the
/// first; none that they tie to the world. An error if there is no such base.
void ChooseHeld(MjcfImport* in);
/// Bodies, and the joints that carry them.
void AddTree(MjcfImport* in);
/// Actuators on hinges, slides and tendons between two sites.
void AddDrives(MjcfImport* in);
/// Motors of the drives, where the file limits what actuators give.
void AddMotors(MjcfImport* in);
/// Closures, and couplings of joints.
void AddEqualities(MjcfImport* in);
/// Armature, damping, dry friction and springs of joints.
void AddElements(MjcfImport* in);
/// Gravity compensation of bodies, and the drives that exert their part of it.
void AddCompensation(MjcfImport* in);
/// Sites as frames, geoms and mesh files as shapes.
void AddSites(MjcfImport* in);
void AddShapes(MjcfImport* in);
/// A finding for each kind of thing that the mechanism cannot express or has otherwise.
void WarnWhatIsLost(MjcfImport* in);

}  // namespace mbv::simulation
