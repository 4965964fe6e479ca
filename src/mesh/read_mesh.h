// Files of triangle meshes.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/triangle_mesh.h"

namespace mbv {

/// Endings of the files that are read: stl, obj, dae, ply.
[[nodiscard]] bool IsMeshFile(const std::filesystem::path& file);

/// A surface in the file's numbers, or why there is none.
struct MeshText {
  TriangleMesh surface;  ///< vertices at one place are one vertex; no triangle without area
  std::string trouble;   ///< "" or why there is no surface
};
/// Reads bytes of a file whose name ends in `extension` (".stl"). Polygons become triangles, parts
/// are put together. Of DAE the unit is applied (metres then), its up axis is not, as ROS does. The
/// library may crash on hostile files: see ReadMeshFiles().
[[nodiscard]] MeshText ReadMeshBytes(const std::string& bytes, const std::string& extension);

/// A surface of a file that is read by several people is there once.
struct MeshFile {
  std::shared_ptr<const TriangleMesh> surface;  ///< in the file's numbers; null: `trouble`
  std::string trouble;
};
/// The surfaces of files, which are read in a process of its own and known afterwards by their
/// content. Each file is told to NoteInput().
[[nodiscard]] std::vector<MeshFile> ReadMeshFiles(const std::vector<std::filesystem::path>& files);

/// Vertices times `scale`, component by component; where that mirrors, triangles turn so that
/// outside stays outside.
[[nodiscard]] TriangleMesh Scaled(const TriangleMesh& surface, const Vec3& scale);

}  // namespace mbv
