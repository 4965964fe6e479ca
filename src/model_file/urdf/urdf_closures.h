// Loop closures written into URDF files, by the conventions in use. Internal to model_file/.
//
// URDF proper has none; urdfdom passes over these elements. Read are, below <robot>:
//
//   <constraint name type> <parent link/> <parent_origin xyz rpy/> <parent_axis xyz/>
//                          <child link/> <child_origin/> <child_axis/>    the proposal for urdfdom
//   <loop name type> <predecessor link> <origin/> </predecessor>
//                    <successor link> <origin/> </successor> <axis/>      URDF+
//   <loop_joint name type> <link1 link xyz rpy/> <link2 …/> [<axis/>]     Drake's old form, Isaac
//   Sim <drake:ball_constraint> body_A, body_B, p_AP, p_BQ                    Drake
//
// Each origin is a frame on its link, each axis is given in that frame; where only one axis is
// given it has the same components in both frames. Types: fixed, revolute (continuous), prismatic,
// cylindrical, universal (parent_axis on the parent, child_axis on the child), spherical (ball),
// planar.
//
// What simulators add to URDF and acts on forces is read, too: rotors of Drake, springs of Gazebo,
// gravity of MuJoCo. What of it is not read is a caveat (UrdfForceRows()).
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/mechanism.h"

namespace mbv::internal {

struct UrdfClosure {
  Joint joint;                ///< closure; parent and child are not filled
  std::string parent, child;  ///< names of the links
  int line = 0;
};

/// What urdfdom does not read.
struct UrdfDetails {
  std::vector<UrdfClosure> closures;
  std::map<std::string, int> link_lines, joint_lines;  ///< by name
  std::vector<std::string> transmission_joints;        ///< in file order, each once
  /// Of joints: a rotor's inertia and its ratio, a spring's stiffness and where it is free.
  struct Extra {
    double rotor_inertia = 0.0, gear_ratio = 1.0, stiffness = 0.0, free = 0.0;
    int line = 0;
  };
  std::map<std::string, Extra> extras;  ///< by joint
  std::optional<Vec3> gravity_W;
  std::vector<ModelCaveat> left_out;
};

/// Something in a URDF file that acts on forces and is not read.
struct UrdfForceRow {
  const char* section;  ///< element below <robot>, "" for any
  const char* element;  ///< itself or below it
  const char* value;    ///< attribute; "text": the element's text; "": its presence
  const char* neutral;  ///< values that do nothing, separated by |
  const char* effect;
};
[[nodiscard]] std::span<const UrdfForceRow> UrdfForceRows();

/// A kind of <plugin> below <gazebo>, by a part of its file or name in lower case, '-' as '_'. The
/// first row that fits counts; what fits none may do anything. Plugins of sensors only measure.
struct UrdfPluginRow {
  const char* part;
  const char* effect;  ///< nullptr: none on forces, or only those of drives, which are commanded
};
[[nodiscard]] std::span<const UrdfPluginRow> UrdfPluginRows();
/// The row of a plugin's file or name; null without one.
[[nodiscard]] const UrdfPluginRow* FindUrdfPlugin(std::string name);

/// True for a value that `neutral` lists, separated by |; numbers are compared as such.
[[nodiscard]] bool IsNeutralValue(const std::string& neutral, const std::string& value);

/// Reads them; findings carry the line. Empty if the text is not XML (urdfdom says so).
[[nodiscard]] UrdfDetails ReadUrdfDetails(const std::string& text, const std::string& file,
                                          Diagnostics* diagnostics);

/// The closures of a mechanism as <constraint> elements, for its exported URDF.
[[nodiscard]] std::string ConstraintText(const Mechanism& mechanism,
                                         const std::vector<Pose>& link_frames);

}  // namespace mbv::internal
