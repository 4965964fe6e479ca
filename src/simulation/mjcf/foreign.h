// MJCF files of others, made such as MuJoCo 2.2.2 compiles them from memory.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "base/types.h"
#include "mechanism/mechanism.h"

namespace mbv::mjcf {

/// What MuJoCo 3 says of bodies and joints and 2.2 has no word for: places among the user numbers
/// of the compiled model (body_user, jnt_user). Without user numbers the file says nothing of it.
enum class UserNumber {
  kGravityCompensation = 0,  ///< of bodies: gravcomp
  kExertedByActuator = 0,    ///< of joints: actuatorgravcomp, 1 or 0
  kForceLimited = 1,         ///< actuatorfrclimited, 1 or 0
  kForceLower = 2,           ///< actuatorfrcrange
  kForceUpper = 3,
};

/// The two sites that a closure makes coincide, the first one on body1.
using SitePair = std::pair<std::string, std::string>;

/// A mesh that a geom shows, from a file in the model's folder or below.
struct ForeignMesh {
  std::string file;              ///< path, or relative to the working folder as the model is
  Vec3 scale = Vec3::Ones();     ///< of the file's numbers
  Pose X_GF = Pose::Identity();  ///< the file's frame in the geom's as the model states it
};

/// An MJCF file on its way to the compiler. Included files are taken in; folders of assets become
/// absolute. What only serves pictures (textures, materials, meshes that nothing needs) is left
/// out; mesh geoms of bodies that state their inertia become small spheres of no mass in the same
/// pose, of others such spheres stand beside them: the compiler moves the frames of meshes, not
/// theirs. Files outside the model's folder are refused. What MuJoCo 3 says differently is
/// translated: closures by two sites, ranges that hold without being called limited, <frame>,
/// <replicate>, <attach>, springs or dampers switched off. Every element and attribute is looked up
/// in foreign_rows.h.
class ForeignMjcf {
 public:
  ForeignMjcf(const std::string& text, const std::filesystem::path& file, Diagnostics* diagnostics);
  ~ForeignMjcf();
  ForeignMjcf(const ForeignMjcf&) = delete;
  ForeignMjcf& operator=(const ForeignMjcf&) = delete;

  /// False after an error.
  [[nodiscard]] bool ok() const;
  [[nodiscard]] std::string Text() const;
  [[nodiscard]] std::string ModelName() const;
  /// Closures by sites, by the equality's name: MuJoCo 2.2 would take their place from the pose of
  /// the file, where the sites may be apart.
  [[nodiscard]] const std::map<std::string, SitePair>& closures_by_sites() const;

  /// Meshes by the name of the sphere that stands where the geom is.
  [[nodiscard]] const std::map<std::string, ForeignMesh>& meshes() const;

  /// What acts on forces and is left out, as the text alone shows; findings name it, too.
  [[nodiscard]] const std::vector<ModelCaveat>& left_out() const;

  /// Writes the masses of mesh geoms that state a density only, or nothing: MuJoCo 2.2 gets their
  /// volumes wrong by some percent unless it computes them exactly (exactmeshinertia). `volumes`:
  /// by mesh [m³]. False if there is nothing to write.
  [[nodiscard]] bool StateMeshMasses(const std::map<std::string, double>& volumes);

  /// Writes the keyframes of attached models: `reference` is the pose of the whole without any,
  /// `address` is where a joint's coordinates begin in it. False if there are none.
  [[nodiscard]] bool PlaceKeyframes(const std::vector<double>& reference,
                                    const std::map<std::string, int>& address);

  /// Removes what this compiler does not know, as its message says; one finding for each kind of
  /// thing. False if the message is about something else.
  [[nodiscard]] bool DropWhatIsUnknown(const std::string& message);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Settings in the text of an MJCF file: of closures, to change them; of servos, to know them.

/// The text with lines before </mujoco>, where later settings override earlier ones.
[[nodiscard]] std::string WithLines(const std::string& text, const std::string& lines);

/// The text with these attributes on every `connect` and `weld`; an empty one stays as it is. The
/// text itself where it is not XML.
[[nodiscard]] std::string WithClosureSettings(const std::string& text, const std::string& solref,
                                              const std::string& solimp);

/// `kv` of the `position` actuators that state one, by their name, else by their joint: MuJoCo 2.2
/// has no such attribute, later versions push with −kv times the velocity.
[[nodiscard]] std::map<std::string, double> ServoDampings(const std::string& text);

}  // namespace mbv::mjcf
