// `bodies` of a model file, and the frames on them: `world.frames`, `frames`, `attach`. Internal to
// the model loader.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "model_file/model_block.h"
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

}  // namespace mbv::internal
