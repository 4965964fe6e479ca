// A mechanism as the text of a model.yaml.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

/// Reads back to the same numbers to the last bit (meshes: where their files stay); guesses are the
/// home pose, so that loops close from there. Names become such as model files take (letters,
/// digits, _ and -). Parameters are written as the numbers they gave; beams are left out. Mesh
/// files are named relative to the folder of Mechanism::file where they lie below it, else by
/// absolute paths, which are read back only from folders that are allowed (mesh/find_mesh.h).
[[nodiscard]] std::string WriteModel(const Mechanism& mechanism);

/// A file that a model names.
struct ModelMeshFile {
  std::string path;  ///< relative to the model's folder: "meshes/arm.stl"
  std::string content;
};
/// Gives each mesh a file in a model of its own, wherever that will lie: binary STL in metres.
[[nodiscard]] std::vector<ModelMeshFile> TakeMeshesAlong(Mechanism* mechanism);

/// The names that WriteModel() gives, by index; the world's body keeps its name.
struct WrittenNames {
  std::vector<std::string> bodies, joints, drives, outputs;
};
[[nodiscard]] WrittenNames NamesInModel(const Mechanism& mechanism);

/// Name and coordinate by which a file calls the joint of a term.
using TermNames = std::function<std::pair<std::string, int>(const Coupling::Term&)>;
/// ", coordinate: 1" behind a joint's name, empty for the first coordinate.
[[nodiscard]] std::string CoordinateText(int coordinate);
/// The lines of a force element as a model file's map, without braces: "kind: damping, …". `place`:
/// "joint: …, coordinate: …" or "drive: …". `slides`: its coordinate is a length.
[[nodiscard]] std::string ElementText(const ForceElement& element, const std::string& place,
                                      bool slides);
/// ", axis_on: BODY, axis: …" behind the place of a rotor that its carrier turns.
[[nodiscard]] std::string CarrierText(const RotorAxis& axis, const std::string& body);
/// The lines of a bushing with its elements as a model file's map, without braces, between frames
/// that are called `parent` and `child`.
[[nodiscard]] std::string BushingText(const Mechanism& mechanism, int bushing,
                                      const std::string& parent, const std::string& child);
/// The lines of a coupling as a model file's map, without braces: "joint: …, follows: …, ratio: …",
/// or a sum of linear terms.
[[nodiscard]] std::string CouplingText(const Coupling& coupling, const TermNames& name_of);

/// In double quotes, for YAML.
[[nodiscard]] std::string QuotedYaml(const std::string& text);

}  // namespace mbv
