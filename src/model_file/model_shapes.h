// `shapes` of a model file: what pictures show of bodies. Internal to the model loader.
#pragma once

#include <optional>
#include <string>

#include "mechanism/mechanism.h"
#include "model_file/model_bodies.h"
#include "model_file/model_names.h"
#include "model_file/model_values.h"

namespace mbv::internal {

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

}  // namespace mbv::internal
