// Where the mesh files of a robot lie.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace mbv {

/// Where a package lies, as somebody says who starts the program.
struct MeshPackage {
  std::string name;
  std::filesystem::path folder;
};
/// For all that this process reads from now on.
void UseMeshPackages(std::vector<MeshPackage> packages);
[[nodiscard]] const std::vector<MeshPackage>& MeshPackages();

/// A mesh file, or why there is none.
struct FoundMesh {
  std::filesystem::path path;  ///< empty: `trouble`
  std::string trouble;
  bool outside = false;  ///< there is one, but nobody allowed that folder
};
/// Finds what a robot's file in `folder` calls `name`: a path relative to the folder, an absolute
/// one, file://…, package://NAME/… or model://NAME/…. Packages are those of UseMeshPackages(), then
/// folders NAME of ROS_PACKAGE_PATH (or entries of that name), share/NAME of AMENT_PREFIX_PATH, and
/// NAME below `folder`; without a name (package:///…), `folder` itself. Nothing outside of `folder`
/// and these is found.
[[nodiscard]] FoundMesh FindMesh(const std::string& name, const std::filesystem::path& folder);

/// `file` relative to `folder` if it lies below it, else absolute.
[[nodiscard]] std::string PathSeenFrom(const std::filesystem::path& folder,
                                       const std::filesystem::path& file);

}  // namespace mbv
