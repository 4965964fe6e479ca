// Mesh geoms of foreign MJCF files. Internal to mjcf/.
#pragma once

#include <tinyxml2.h>

#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "mjcf/foreign.h"

namespace mbv::mjcf {

struct MeshGeoms {
  std::map<std::string, ForeignMesh> meshes;  ///< by the name of the sphere in the geom's place
  int lost = 0;                               ///< geoms that went without one
};

/// Puts a sphere of no mass where a geom shows a mesh of a file that `is_open` allows, and removes
/// mesh geoms that give no mass to their body. `folder`: that of the mesh files.
[[nodiscard]] MeshGeoms TakeMeshGeoms(
    const std::filesystem::path& folder,
    const std::function<bool(const std::filesystem::path&)>& is_open,
    tinyxml2::XMLDocument* document);

}  // namespace mbv::mjcf
