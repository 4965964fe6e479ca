#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <set>

#include "core/names.h"
#include "model_file/write_model.h"

namespace mbv {
namespace {

// "meshes/NAME.stl" with a name near that of the file, each once.
std::string MeshPath(const std::string& file, std::set<std::string>* taken) {
  std::string name = NearestName(std::filesystem::path(file).stem().string());
  if (name.empty()) name = "mesh";
  std::string fresh = name;
  for (int i = 2; !taken->insert(fresh).second; ++i) fresh = fmt::format("{}_{}", name, i);
  return "meshes/" + fresh + ".stl";
}

}  // namespace

std::vector<ModelMeshFile> TakeMeshesAlong(Mechanism* mechanism) {
  std::vector<ModelMeshFile> files;
  std::map<const TriangleMesh*, std::string> known;
  std::set<std::string> taken;
  for (Body& body : mechanism->bodies) {
    for (Shape& shape : body.shapes) {
      auto* mesh = std::get_if<Mesh>(&shape.geometry);
      if (mesh == nullptr) continue;
      std::string& path = known[mesh->surface.get()];
      if (path.empty()) {
        path = MeshPath(mesh->file, &taken);
        files.push_back({path, ToStl(*mesh->surface, mechanism->name + ", metres")});
      }
      mesh->file = path;
      mesh->scale = Vec3::Ones();
    }
  }
  mechanism->file.clear();
  return files;
}

}  // namespace mbv
