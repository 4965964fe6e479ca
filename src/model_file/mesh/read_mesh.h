// Files of triangle meshes.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "math/triangle_mesh.h"

// Where the mesh files of a robot lie.

namespace mbv {

/// Where a package lies, as the user of the program states.
struct MeshPackage {
  std::string name;
  std::filesystem::path folder;
};
/// For all that this process reads from now on.
void UseMeshPackages(std::vector<MeshPackage> packages);
[[nodiscard]] const std::vector<MeshPackage>& MeshPackages();

/// True if a robot's file in `folder` may name `file`: it lies below `folder`, one of
/// MeshPackages(), or a folder that one of the variables of FindMesh() lists. Links are followed.
[[nodiscard]] bool MayBeNamed(const std::filesystem::path& file,
                              const std::filesystem::path& folder);

/// A mesh file, or why there is none.
struct FoundMesh {
  std::filesystem::path path;  ///< empty: `trouble`
  std::string trouble;
  bool outside = false;  ///< there is one, but that folder is not allowed
};
/// Finds what a robot's file in `folder` calls `name`: a path relative to the folder, an absolute
/// one, file://…, package://NAME/… or model://NAME/…. Packages are those of UseMeshPackages(), then
/// folders NAME of ROS_PACKAGE_PATH, GZ_SIM_RESOURCE_PATH and GAZEBO_MODEL_PATH (or entries of that
/// name), share/NAME of AMENT_PREFIX_PATH, NAME below `folder`, and NAME beside `folder` and the
/// folders above it, as far as these may be named; without a name (package:///…), `folder` itself.
/// Nothing is found that MayBeNamed() forbids.
[[nodiscard]] FoundMesh FindMesh(const std::string& name, const std::filesystem::path& folder);

/// `file` relative to `folder` if it lies below it, else absolute.
[[nodiscard]] std::string PathSeenFrom(const std::filesystem::path& folder,
                                       const std::filesystem::path& file);

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

/// A surface of a file that is named in several places is there once.
struct MeshFile {
  std::shared_ptr<const TriangleMesh> surface;  ///< in the file's numbers; null: `trouble`
  std::string trouble;
};
/// The surfaces of files, which are read in a process of its own and known afterwards by their
/// content. Each file is passed to NoteInput().
[[nodiscard]] std::vector<MeshFile> ReadMeshFiles(const std::vector<std::filesystem::path>& files);

/// Vertices times `scale`, component by component; where that mirrors, triangles turn so that
/// outside stays outside.
[[nodiscard]] TriangleMesh Scaled(const TriangleMesh& surface, const Vec3& scale);

}  // namespace mbv
