// A mechanism as the text of a model.yaml.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "base/markup.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// Reads back to the same numbers to the last bit (meshes: where their files stay); guesses are the
/// home pose, so that loops close from there. Names become such as model files take (letters,
/// digits, _ and -). Parameters are written as the numbers they gave; beams are left out. Mesh
/// files are named relative to the folder of Mechanism::file where they lie below it, else by
/// absolute paths, which are read back only from folders that are allowed
/// (model_file/mesh/read_mesh.h). What its source left out is written, too.
[[nodiscard]] std::string WriteModel(const Mechanism& mechanism,
                                     const std::vector<ModelCaveat>& caveats = {});

/// The key that says it; "" where nothing was left out.
[[nodiscard]] std::string LeftOutText(const std::vector<ModelCaveat>& caveats);

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

/// A robot's file of a foreign format as a model, on its way out of a child process.
struct ForeignModel {
  std::vector<Finding> findings;
  std::string model;  ///< text of a model.yaml; "" after errors
  std::vector<ModelCaveat> left_out;
  PrintedRounding printed;
};
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<ForeignModel>& model) {
  visit(model.findings), visit(model.model), visit(model.left_out);
  visit(model.printed.length), visit(model.printed.direction);
}
/// WriteModel() under the nearest name that a model may have, else "robot".
[[nodiscard]] std::string ForeignModelText(Mechanism mechanism);

/// In double quotes, for YAML.
[[nodiscard]] std::string QuotedYaml(const std::string& text);

}  // namespace mbv
