// `materials`, `sections` and `beams` of a model file: what its elastic bodies are made of.
// Internal to the model loader.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "model_file/model_bodies.h"
#include "model_file/model_names.h"
#include "model_file/model_values.h"

namespace mbv::internal {

/// Young's and shear modulus [Pa].
struct Material {
  double youngs = kNan, shear = kNan;
};

/// By full name; empty: badly described, which has its own finding.
using Materials = std::map<std::string, std::optional<Material>>;
using Sections = std::map<std::string, std::optional<Section>>;

void ReadMaterials(const Block& block, ModelValues* values, Materials* materials);
void ReadSections(const Block& block, ModelValues* values, Sections* sections);

struct ModelBeams {
  std::vector<Beam> beams;
  std::vector<Place> places;  ///< per beam
  bool good = true;           ///< false: their frame is not worth checking
};

/// Reads beams between points of bodies whose frames are known.
class BeamReader {
 public:
  BeamReader(ModelValues* values, const BodyNames& names, const ModelBodies& bodies,
             const Materials& materials, const Sections& sections, ModelBeams* beams)
      : values_(*values),
        names_(names),
        bodies_(bodies),
        materials_(materials),
        sections_(sections),
        beams_(*beams) {}

  void Read(const Block& block);

 private:
  bool ReadBeam(const Block& block, const YamlEntry& entry, const std::string& path, int body,
                const std::string& name);
  template <typename T>
  std::optional<T> Described(const Block& block, const YamlMap& map, const std::string& key,
                             const std::map<std::string, std::optional<T>>& known);
  std::optional<Mat3> Axes(const Block& block, const YamlMap& map, const Vec3& along,
                           const Section& section);

  ModelValues& values_;
  const BodyNames& names_;
  const ModelBodies& bodies_;
  const Materials& materials_;
  const Sections& sections_;
  ModelBeams& beams_;
};

}  // namespace mbv::internal
