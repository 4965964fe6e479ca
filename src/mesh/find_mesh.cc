#include "mesh/find_mesh.h"

#include <cstdlib>
#include <optional>
#include <sstream>

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::vector<MeshPackage>& Packages() {
  static std::vector<MeshPackage> packages;
  return packages;
}

// The folders that an environment variable lists.
std::vector<fs::path> Listed(const char* variable) {
  std::vector<fs::path> folders;
  const char* text = std::getenv(variable);
  std::istringstream stream(text == nullptr ? "" : text);
  for (std::string folder; std::getline(stream, folder, ':');) {
    if (!folder.empty()) folders.emplace_back(folder);
  }
  return folders;
}

std::vector<fs::path> AmentShares() {
  std::vector<fs::path> shares;
  for (const fs::path& prefix : Listed("AMENT_PREFIX_PATH")) shares.push_back(prefix / "share");
  return shares;
}

bool LiesBelow(const fs::path& folder, const fs::path& file) {
  std::error_code error;
  const fs::path base = fs::weakly_canonical(folder.empty() ? "." : folder, error);
  if (error) return false;
  const fs::path inside = fs::weakly_canonical(file, error).lexically_relative(base);
  return !error && !inside.empty() && *inside.begin() != ".." && inside != ".";
}

// Where PACKAGE/REST may be.
std::vector<fs::path> InPackage(const std::string& package, const fs::path& rest,
                                const fs::path& folder) {
  if (package.empty()) return {folder / rest};
  std::vector<fs::path> paths;
  for (const MeshPackage& given : Packages()) {
    if (given.name == package) paths.push_back(given.folder / rest);
  }
  for (const fs::path& listed : Listed("ROS_PACKAGE_PATH")) {
    if (listed.filename() == package) paths.push_back(listed / rest);
    paths.push_back(listed / package / rest);
  }
  for (const fs::path& share : AmentShares()) paths.push_back(share / package / rest);
  paths.push_back(folder / package / rest);
  return paths;
}

// What people name as FOLDER/… or SCHEME://NAME/….
std::vector<fs::path> Candidates(const std::string& name, const fs::path& folder) {
  for (const char* scheme : {"package://", "model://"}) {
    if (!name.starts_with(scheme)) continue;
    const std::string path = name.substr(std::string(scheme).size());
    const size_t slash = path.find('/');
    if (slash == std::string::npos) return {};
    return InPackage(path.substr(0, slash), fs::path(path.substr(slash + 1)).relative_path(),
                     folder);
  }
  const std::string file = "file://";
  return {folder / (name.starts_with(file) ? name.substr(file.size()) : name)};
}

}  // namespace

void UseMeshPackages(std::vector<MeshPackage> packages) { Packages() = std::move(packages); }

const std::vector<MeshPackage>& MeshPackages() { return Packages(); }

FoundMesh FindMesh(const std::string& name, const fs::path& folder) {
  std::vector<fs::path> open = {folder};
  for (const MeshPackage& package : Packages()) open.push_back(package.folder);
  for (const fs::path& listed : Listed("ROS_PACKAGE_PATH")) open.push_back(listed);
  for (const fs::path& share : AmentShares()) open.push_back(share);
  bool outside = false;
  for (const fs::path& path : Candidates(name, folder)) {
    std::error_code error;
    if (!fs::is_regular_file(path, error)) continue;
    for (const fs::path& allowed : open) {
      if (LiesBelow(allowed, path)) return {path.lexically_normal(), "", false};
    }
    outside = true;
  }
  return {{}, outside ? "lies outside the folder of the file" : "is not there", outside};
}

std::string PathSeenFrom(const fs::path& folder, const fs::path& file) {
  std::error_code error;
  const fs::path base = fs::absolute(folder.empty() ? "." : folder, error).lexically_normal();
  const fs::path path = fs::absolute(file, error).lexically_normal();
  const fs::path inside = path.lexically_relative(base);
  return inside.empty() || *inside.begin() == ".." ? path.string() : inside.string();
}

}  // namespace mbv
