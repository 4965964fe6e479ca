#include "model_file/model_meshes.h"

#include <fmt/format.h>

#include <map>

#include "mesh/find_mesh.h"
#include "mesh/read_mesh.h"

namespace mbv::internal {
namespace {

namespace fs = std::filesystem;

// Meshes that wait for their surface.
std::vector<Mesh*> Waiting(std::vector<Body>* bodies) {
  std::vector<Mesh*> waiting;
  for (Body& body : *bodies) {
    for (Shape& shape : body.shapes) {
      auto* mesh = std::get_if<Mesh>(&shape.geometry);
      if (mesh != nullptr && mesh->surface == nullptr) waiting.push_back(mesh);
    }
  }
  return waiting;
}

// A scaled surface is there once for all who show it.
class ScaledOnce {
 public:
  std::shared_ptr<const TriangleMesh> Of(const std::shared_ptr<const TriangleMesh>& surface,
                                         const Vec3& scale) {
    if (scale == Vec3::Ones()) return surface;
    auto& known = known_[{surface.get(), {scale.x(), scale.y(), scale.z()}}];
    if (known == nullptr) known = std::make_shared<const TriangleMesh>(Scaled(*surface, scale));
    return known;
  }

 private:
  std::map<std::pair<const TriangleMesh*, std::array<double, 3>>,
           std::shared_ptr<const TriangleMesh>>
      known_;
};

std::string HintFor(const std::string& name) {
  const std::string scheme = "package://";
  const std::string drawn = "default shapes stand for what has no other";
  if (!name.starts_with(scheme) || name.starts_with(scheme + "/")) return drawn;
  const std::string package =
      name.substr(scheme.size(), name.find('/', scheme.size()) - scheme.size());
  return fmt::format(
      "--package {}=DIR says where the package lies, as ROS_PACKAGE_PATH and AMENT_PREFIX_PATH do; "
      "{}",
      package, drawn);
}

}  // namespace

void LoadMeshes(const fs::path& folder, const Finding& place, std::vector<Body>* bodies,
                Diagnostics* diagnostics) {
  const std::vector<Mesh*> waiting = Waiting(bodies);
  if (waiting.empty()) return;
  std::vector<std::string> troubles(waiting.size());
  std::vector<fs::path> paths;
  std::vector<size_t> of;  // per path: the mesh
  for (size_t i = 0; i < waiting.size(); ++i) {
    const FoundMesh found = FindMesh(waiting[i]->file, folder);
    troubles[i] = found.trouble;
    if (found.path.empty()) continue;
    if (!IsMeshFile(found.path)) {
      troubles[i] = "is neither STL, OBJ, DAE nor PLY";
      continue;
    }
    paths.push_back(found.path);
    of.push_back(i);
  }
  const std::vector<MeshFile> files = ReadMeshFiles(paths);
  ScaledOnce scaled;
  for (size_t k = 0; k < files.size(); ++k) {
    Mesh& mesh = *waiting[of[k]];
    if (files[k].surface == nullptr) {
      troubles[of[k]] = "cannot be used: " + files[k].trouble;
      continue;
    }
    mesh.surface = scaled.Of(files[k].surface, mesh.scale);
  }
  size_t missing = 0;
  Finding finding = place;
  for (size_t i = 0; i < waiting.size(); ++i) {
    if (waiting[i]->surface != nullptr) {
      continue;
    }
    if (missing++ > 0) continue;
    finding.message = fmt::format("'{}' {}", waiting[i]->file, troubles[i]);
    finding.hint = HintFor(waiting[i]->file);
  }
  for (size_t k = 0; k < paths.size(); ++k) {
    if (waiting[of[k]]->surface != nullptr) waiting[of[k]]->file = paths[k].string();
  }
  if (missing == 0) return;
  finding.severity = Severity::kWarning;
  finding.message =
      fmt::format("{} of {} meshes {} left out: {}{}", missing, waiting.size(),
                  missing == 1 ? "is" : "are", finding.message, missing == 1 ? "" : ", for one");
  diagnostics->Add(finding);
  for (Body& body : *bodies) {
    std::erase_if(body.shapes, [](const Shape& shape) {
      const auto* mesh = std::get_if<Mesh>(&shape.geometry);
      return mesh != nullptr && mesh->surface == nullptr;
    });
  }
}

}  // namespace mbv::internal
