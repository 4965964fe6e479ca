// What is drawn: primitive solids placed in the world, made from a mechanism and its poses.
// No OpenGL here.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "base/types.h"
#include "math/triangle_mesh.h"
#include "mechanism/mechanism.h"
#include "render/render.h"

// Materials by name.

namespace mbv::render {

/// A surface. Colours are display values 0 … 1.
struct Material {
  std::array<float, 4> rgba{0.6F, 0.6F, 0.6F, 1.0F};
  float specular = 0.3F;   ///< strength of the highlight, 0 … 1
  float shininess = 0.4F;  ///< narrowness of the highlight, 0 … 1
  float emission = 0.0F;   ///< light of its own, 0 … 1
};

/// The material of a shape's colour (mechanism/named_places.h) or of a mark: closure, gap, pull,
/// push, x_axis, y_axis, z_axis, path.
[[nodiscard]] Material MaterialOf(const std::string& color);

/// Shapes of these materials ("sea", "hull", "deck") are surroundings: drawn, but the automatic
/// camera does not have to fit them.
[[nodiscard]] bool IsScenery(const std::string& color);

enum class Solid {
  kBall,      ///< size = (radius, –, –)
  kCapsule,   ///< along z of G, size = (radius, –, half length without caps)
  kCylinder,  ///< along z of G, size = (radius, –, half length)
  kBox,       ///< size = half edges
  kArrow,     ///< from G's origin along z, size = (radius, –, length)
  kMesh,      ///< Item::mesh in G, size = half edges of the box around it
};

/// Whether the automatic camera has to show an item.
enum class Framing {
  kAlways,
  kIfNear,  ///< parts of the world: only if they lie around what is always shown
  kNever,
};

struct Item {
  Solid solid = Solid::kBall;
  Pose X_WG = Pose::Identity();  ///< pose of the solid in the world [m]
  Vec3 size = Vec3::Ones();      ///< [m]
  Material material;
  Framing framing = Framing::kAlways;
  bool casts_shadow = true;  ///< marks do not
  std::shared_ptr<const TriangleMesh> mesh = {};
  Vec3 p_GBox = Vec3::Zero();  ///< middle of the box around a mesh [m]
};

/// The two unit vectors that complete `axis` to a right-handed frame (axis last).
[[nodiscard]] Mat3 FrameAlong(const Vec3& axis);
/// A solid with an axis from p to q: capsule, cylinder or arrow [m].
[[nodiscard]] Item Between(Solid solid, const Vec3& p, const Vec3& q, double radius,
                           const Material& material);
[[nodiscard]] Item BallAt(const Vec3& p, double radius, const Material& material);
/// Corners of the box around an item, in the world [m].
[[nodiscard]] std::vector<Vec3> Corners(const Item& item);

/// Sizes that follow from the mechanism, so that a 10 m crane and a 0.2 m gripper look alike.
struct Scale {
  double extent_m = 1.0;  ///< diagonal of the box around all joint points at home
  double joint_m = 0.01;  ///< smallest radius of a joint's ball
  double leg_m = 0.01;    ///< radius of a distance drive without its own
  double arrow_m = 0.2;   ///< length of the longest force arrow
  double longest_force_N = 0.0, longest_torque_Nm = 0.0;  ///< over all frames
  std::vector<double> barrel_m;  ///< per drive: length of the distance drive's barrel
  /// Per body: the plate that stands for it where it has no shapes; null for others.
  std::vector<std::shared_ptr<const TriangleMesh>> plates;
};
[[nodiscard]] Scale ScaleOf(const Mechanism& mechanism, const std::vector<PictureFrame>& frames);

/// Bodies, legs, joints and triads of one frame.
[[nodiscard]] std::vector<Item> MechanismItems(const Mechanism& mechanism,
                                               const PictureFrame& frame, const Scale& scale,
                                               const PictureOptions& options);
/// Radius that shows at the end of the rods that a joint connects [m].
[[nodiscard]] double JointRadius(const Mechanism& mechanism, const Joint& joint,
                                 const Scale& scale);

/// Up against gravity and a level x axis: the rotation into the frame D in which is drawn (z up).
[[nodiscard]] Mat3 UprightRotation(const Vec3& gravity_W);  // R_DW

/// Height (along up) of the water: the top of the world's first shape of material "sea".
[[nodiscard]] std::optional<double> SeaLevel(const Mechanism& mechanism, const Mat3& R_DW);

// Solids as triangles with normals, in their own frame G.

struct Facets {
  std::vector<Vec3> points_G = {}, normals_G = {};  ///< [m]; unit vectors
  std::vector<int> faces = {};                      ///< per point: which face, each smooth
  std::vector<std::array<int, 3>> triangles = {};   ///< counter-clockwise from outside
};
constexpr int kMostFaces = 8;  ///< of a primitive solid

/// A primitive solid, round ones with this many sides; empty for a mesh.
[[nodiscard]] Facets FacetsOf(const Item& item, int sides);
/// A mesh with at most `most` triangles, smooth but for its sharp edges.
[[nodiscard]] Facets FacetsOf(const TriangleMesh& mesh, std::size_t most);
/// Sides of a circle of this radius that looks round.
[[nodiscard]] int SidesFor(double radius_px);

}  // namespace mbv::render
