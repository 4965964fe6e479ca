// URDF: the spanning tree of a mechanism as URDF text, and a URDF file as bodies and joints.
//
// Conventions of URDF (as urdfdom reads it, pinned by tests/model_file/urdf_test.cc): a link's
// frame is the frame of the joint that carries it; `rpy` is Rz(yaw) Ry(pitch) Rx(roll); a joint's
// axis is given in the joint frame; an inertia is about the centre of mass, in the axes of its own
// `origin`.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// The spanning tree as URDF text. Joints with several coordinates become chains of single ones
/// with massless links between ("JOINT.yaw", "JOINT.pitch", …), a ball's all zero at home. Closures
/// follow as <constraint> elements, which readers of plain URDF pass over. What is left (drives,
/// guesses of the home pose) stands in a comment as a model.yaml that reads this file back: cut the
/// comment out, name the URDF file in its `urdf:` key, and the same mechanism results (dots in the
/// names of drives and closures become _). It states the closures itself, exactly, and skips those
/// of the URDF. Meshes are named relative to the folder of Mechanism::file where they lie below it.
[[nodiscard]] std::string WriteUrdf(const Mechanism& mechanism);

/// The model.yaml in that comment, and what the model's source left out.
[[nodiscard]] std::string WriteUrdfCompanion(const Mechanism& mechanism,
                                             const std::string& urdf_file,
                                             const std::vector<ModelCaveat>& caveats = {});
/// Where it is found by who reads the URDF: robot.mbverify.yaml beside robot.urdf.
[[nodiscard]] std::string UrdfCompanionPath(const std::string& urdf_file);

/// What a URDF file holds.
struct UrdfTree {
  std::string name;
  std::vector<Body> bodies;   ///< without a root link named "world"
  std::vector<Joint> joints;  ///< body indices count `bodies`; -1 is the world; closures last
  std::vector<int> body_lines, joint_lines;  ///< in the file; 0: unknown
  int root = -1;                             ///< index of the root link; -1 if it is the world
  /// A link that became a frame of another one (urdf_frame_links.h).
  struct Frame {
    int body = -1;
    Pose X_BF = Pose::Identity();
  };
  std::map<std::string, Frame> frames;           ///< by the link's name
  std::vector<std::string> transmission_joints;  ///< joints that a <transmission> drives
  /// position = multiplier · (position of the joint `of`) + offset
  struct Mimic {
    std::string joint, of;
    double multiplier = 1.0, offset = 0.0;
  };
  std::vector<Mimic> mimics;
  /// <dynamics>: viscous damping [N s/m or N m s/rad] and Coulomb friction [N or N m] of joints
  /// with one coordinate
  struct Dynamics {
    std::string joint;
    double damping = 0.0, friction = 0.0;
  };
  std::vector<Dynamics> dynamics;
  std::map<std::string, Motor> motors;  ///< <limit>'s effort and velocity, by joint; positive ones
  /// Of joints with one coordinate, as simulators add it: a rotor's inertia [kg m²] and ratio, a
  /// spring's stiffness [N/m or N m/rad] and free position.
  struct Extra {
    std::string joint;
    double rotor_inertia = 0.0, gear_ratio = 1.0, stiffness = 0.0, free = 0.0;
  };
  std::vector<Extra> extras;
  std::optional<Vec3> gravity_W;      ///< where the file states it
  std::vector<ModelCaveat> left_out;  ///< acts on forces in the file and is not in the tree

  /// Index of a link (-1: the world), or -2.
  [[nodiscard]] int FindLink(const std::string& link) const;
};

/// Reads URDF text; everything urdfdom says is a finding, with the line where it is known. Closures
/// are read in the forms listed in urdf_closures.h. Gears and meshes that cannot be read
/// (model_meshes.h) are left out with a warning, what acts on forces with a caveat. The tree is
/// empty after an error.
[[nodiscard]] UrdfTree ReadUrdf(const std::string& text, const std::string& file,
                                Diagnostics* diagnostics);

// Inside of the URDF export: how joints map to URDF joints and bodies to links.

/// Limits beyond this are no limits: URDF wants numbers for every prismatic joint.
inline constexpr double kUrdfNoLimit = 1e9;

/// One URDF joint of the chain that stands for a joint.
struct UrdfStep {
  std::string name;
  std::string type;  ///< URDF's word
  Vec3 axis;         ///< in the joint frame
  CoordinateRange range;
  int coordinate = 0;  ///< of the joint; -1 for fixed and floating
};

/// The mechanism with the frames of its balls turned so that their coordinates are zero at home. A
/// ball of the tree becomes three hinges, which lose a DOF where the middle one is at 90
/// degrees: from home, they are the farthest from there. Balls with limits stay as they are; those
/// with forces of their own, or a largest rotation, become closures beside a free joint.
[[nodiscard]] Mechanism WithBallsAtZero(const Mechanism& mechanism);

/// The chain, inboard first. `reversed`: the tree runs from the child to the parent.
[[nodiscard]] std::vector<UrdfStep> UrdfSteps(const Joint& joint, bool reversed);

/// True for an element that <dynamics> of a URDF joint says: damping of a joint in the tree.
[[nodiscard]] bool IsUrdfDynamics(const Mechanism& mechanism, const ForceElement& element);

/// X_BL per body: the pose of its URDF link frame.
[[nodiscard]] std::vector<Pose> UrdfLinkFrames(const Mechanism& mechanism);

/// "#rrggbb[aa]" as 0…1; empty for other text.
[[nodiscard]] std::optional<std::array<double, 4>> HexColor(const std::string& text);

}  // namespace mbv

// A URDF file given where a model file is expected. Internal to the model loader.

namespace mbv::internal {

/// Whether a file is taken as URDF by its name.
[[nodiscard]] bool IsUrdfFile(const std::string& file);

/// The model.yaml that a URDF file stands for: itself, and the closure file beside it, if there is
/// one: STEM.yaml, robot.yaml, loop_closures.yaml or config/loop_closures.yaml in its folder, or
/// ../config/loop_closures.yaml.
[[nodiscard]] std::string UrdfModelText(const std::string& file, const std::string& urdf);

}  // namespace mbv::internal
