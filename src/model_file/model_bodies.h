// `bodies` of a model file, and the frames on them: `world.frames`, `frames`, `attach`. Internal to
// the model loader.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/mechanism.h"
#include "model_file/model_names.h"
#include "model_file/model_values.h"

namespace mbv::internal {

struct BodyPlace {
  Place place;       ///< the world and links of a URDF file have none
  std::string path;  ///< YAML path, or FILE:LINE of a URDF link
  std::string note;  ///< which of the bodies of a part: " (body limb1.rod)"
};

/// What the model's bodies are, the world first.
struct ModelBodies {
  std::vector<Body> bodies;
  std::vector<BodyPlace> places;          ///< per body
  std::map<std::string, FrameRef> links;  ///< links of a URDF file that became frames

  ModelBodies();
  [[nodiscard]] int Find(const std::string& name) const;  ///< index or -1
  [[nodiscard]] const NamedFrame* FindFrame(int body, const std::string& name) const;
};

/// Reads frames onto bodies.
class FrameReader {
 public:
  FrameReader(ModelValues* values, ModelBodies* bodies) : values_(*values), bodies_(*bodies) {}

  void ReadWorld(const Block& model);
  /// The map of frames at `path`, which belong to `body`.
  void Read(const Block& block, const YamlNode& frames, const std::string& path, int body);
  /// `attach`: frames on bodies that are described elsewhere.
  void ReadAttached(const Block& block, const BodyNames& names);

 private:
  ModelValues& values_;
  ModelBodies& bodies_;
};

/// Reads bodies with mass and frames; their shapes and beams are read when all frames are known.
class BodyReader {
 public:
  BodyReader(ModelValues* values, FrameReader* frames, ModelBodies* bodies)
      : values_(*values), frames_(*frames), bodies_(*bodies) {}

  void Read(const Block& block);

 private:
  void ReadBody(const Block& block, const YamlEntry& entry);
  void ReadMass(const Block& block, const YamlMap& map, Body* body);
  void ReadInertia(const Block& block, const YamlNode& node, const std::string& path, Body* body);

  ModelValues& values_;
  FrameReader& frames_;
  ModelBodies& bodies_;
};

// `shapes` of a model file: what pictures show of bodies. Internal to the model loader.

/// Reads shapes onto bodies whose frames are known. Meshes name their files: LoadMeshes() reads
/// them.
class ShapeReader {
 public:
  ShapeReader(ModelValues* values, const BodyNames& names, ModelBodies* bodies)
      : values_(*values), names_(names), bodies_(*bodies) {}

  /// Of the bodies of a block; of the model: of the world, too.
  void Read(const Block& block);

 private:
  void ReadList(const Block& block, const YamlNode& node, const std::string& path, int body);
  std::optional<Shape> ReadShape(const Block& block, const YamlNode& node, const std::string& path,
                                 int body);
  template <typename Rod>
  std::optional<Rod> ReadRod(const Block& block, const YamlNode& node, const std::string& path,
                             int body);
  std::optional<Box> ReadBox(const Block& block, const YamlNode& node, const std::string& path,
                             int body);
  std::optional<Pose> ReadAt(const Block& block, const YamlMap& map, int body);
  std::optional<Mesh> ReadMesh(const Block& block, const YamlNode& node, const std::string& path,
                               int body);
  std::optional<Ball> ReadBall(const Block& block, const YamlNode& node, const std::string& path,
                               int body);

  ModelValues& values_;
  const BodyNames& names_;
  ModelBodies& bodies_;
};

// Mesh files of a robot's shapes. Internal to the readers of models and URDF.

/// Reads the surfaces of all meshes that have none yet, which their shapes name as the robot's file
/// does. Those that cannot be read are taken out of the bodies: one warning names the first, at
/// `place`. Files are looked for as FindMesh() says, `folder` being that of the robot's file.
void LoadMeshes(const std::filesystem::path& folder, const Finding& place,
                std::vector<Body>* bodies, Diagnostics* diagnostics);

}  // namespace mbv::internal
