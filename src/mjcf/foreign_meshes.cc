#include "mjcf/foreign_meshes.h"

#include <fmt/format.h>

#include <sstream>
#include <vector>

#include "mjcf/xml_walk.h"

namespace mbv::mjcf {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;

class MeshTaker {
 public:
  MeshTaker(const fs::path& folder, const std::function<bool(const fs::path&)>& is_open,
            tinyxml2::XMLDocument* document)
      : folder_(folder), is_open_(is_open), document_(*document) {}

  MeshGeoms Run() {
    std::vector<XMLElement*> geoms;
    ForEach(root(), [&](XMLElement* e) {
      const auto* body = e->Parent()->ToElement();
      const bool in_body = body != nullptr && (IsTag(body, "body") || IsTag(body, "worldbody"));
      if (in_body && IsTag(e, "geom") && e->Attribute("mesh") != nullptr) geoms.push_back(e);
    });
    const std::map<std::string, ForeignMesh> assets = MeshAssets();
    for (XMLElement* geom : geoms) {
      const char* type = geom->Attribute("type");
      const XMLElement* body = geom->Parent()->ToElement();
      const bool states_inertia =
          IsTag(body, "worldbody") || body->FirstChildElement("inertial") != nullptr;
      const auto asset = assets.find(geom->Attribute("mesh"));
      // Others are primitives that are fitted to a mesh.
      const bool shown = type == nullptr || std::string_view(type) == "mesh";
      if (shown && asset != assets.end()) {
        PutSphere(geom, asset->second);
      } else if (states_inertia) {
        ++result_.lost;
      }
      if (states_inertia) document_.DeleteNode(geom);
    }
    return std::move(result_);
  }

 private:
  XMLElement* root() { return document_.RootElement(); }

  // A sphere where a geom is. Its pose may be written in many ways, and come from its class.
  void PutSphere(XMLElement* geom, const ForeignMesh& mesh) {
    XMLElement* sphere = geom->DeepClone(&document_)->ToElement();
    const std::string name = fmt::format("mesh of geom {}", result_.meshes.size());
    for (const char* attribute : {"mesh", "fitscale", "shellinertia", "density", "fromto"}) {
      sphere->DeleteAttribute(attribute);
    }
    sphere->SetAttribute("name", name.c_str());
    sphere->SetAttribute("type", "sphere");
    sphere->SetAttribute("size", "1");
    sphere->SetAttribute("mass", "0");
    const std::string rgba = MaterialColor(geom->Attribute("material"));
    if (!rgba.empty() && geom->Attribute("rgba") == nullptr) {
      sphere->SetAttribute("rgba", rgba.c_str());
    }
    geom->Parent()->InsertAfterChild(geom, sphere);
    result_.meshes.emplace(name, mesh);
  }

  // "" without one.
  std::string MaterialColor(const char* name) {
    std::string rgba;
    ForEach(root(), [&](XMLElement* e) {
      const bool meant = name != nullptr && IsTag(e, "material") &&
                         e->Attribute("name") != nullptr &&
                         std::string_view(e->Attribute("name")) == name;
      if (meant && e->Attribute("rgba") != nullptr) rgba = e->Attribute("rgba");
    });
    return rgba;
  }

  // What <default> says about an attribute of meshes in a class, "main" being the outermost one.
  const char* MeshDefault(const char* of_class, const char* attribute) {
    const char* found = nullptr;
    // Inner classes inherit from outer ones.
    const auto visit = [&](const auto& self, const XMLElement* e, const char* inherited) -> void {
      const XMLElement* mesh = e->FirstChildElement("mesh");
      const char* own = mesh == nullptr ? nullptr : mesh->Attribute(attribute);
      const char* value = own == nullptr ? inherited : own;
      const char* name = e->Attribute("class");
      const bool is_main = e->Parent() == root();
      const bool meant =
          of_class == nullptr ? is_main : name != nullptr && std::string_view(name) == of_class;
      if (meant && value != nullptr) found = value;
      for (const XMLElement* inner = e->FirstChildElement("default"); inner != nullptr;
           inner = inner->NextSiblingElement("default")) {
        self(self, inner, value);
      }
    };
    for (const XMLElement* e = root()->FirstChildElement("default"); e != nullptr;
         e = e->NextSiblingElement("default")) {
      visit(visit, e, nullptr);
    }
    return found;
  }

  // Numbers of an attribute of a mesh; `fallback` where it is left out or broken.
  std::vector<double> MeshNumbers(const XMLElement* mesh, const char* attribute,
                                  const std::vector<double>& fallback) {
    const char* text = mesh->Attribute(attribute);
    if (text == nullptr) text = MeshDefault(mesh->Attribute("class"), attribute);
    if (text == nullptr) return fallback;
    std::istringstream stream(text);
    std::vector<double> numbers;
    for (double x = 0.0; stream >> x;) numbers.push_back(x);
    return numbers.size() == fallback.size() ? numbers : fallback;
  }

  // Meshes from files of the model's folder, by name.
  std::map<std::string, ForeignMesh> MeshAssets() {
    std::map<std::string, ForeignMesh> assets;
    ForEach(root(), [&](XMLElement* e) {
      const auto* parent = e->Parent()->ToElement();
      const char* file = e->Attribute("file");
      if (!IsTag(e, "mesh") || file == nullptr || parent == nullptr || !IsTag(parent, "asset")) {
        return;
      }
      const fs::path path = folder_ / file;
      if (!is_open_(path)) return;
      ForeignMesh mesh;
      mesh.file = path.string();
      const auto scale = MeshNumbers(e, "scale", {1, 1, 1});
      const auto p = MeshNumbers(e, "refpos", {0, 0, 0});
      const auto q = MeshNumbers(e, "refquat", {1, 0, 0, 0});
      mesh.scale = Vec3(scale[0], scale[1], scale[2]);
      Pose X_FG = Pose::Identity();
      X_FG.translation() = Vec3(p[0], p[1], p[2]);
      X_FG.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
      mesh.X_GF = X_FG.inverse();
      const char* name = e->Attribute("name");
      assets.emplace(name == nullptr ? fs::path(file).stem().string() : name, mesh);
    });
    return assets;
  }

  const fs::path& folder_;
  const std::function<bool(const fs::path&)>& is_open_;
  tinyxml2::XMLDocument& document_;
  MeshGeoms result_;
};

}  // namespace

MeshGeoms TakeMeshGeoms(const fs::path& folder, const std::function<bool(const fs::path&)>& is_open,
                        tinyxml2::XMLDocument* document) {
  return MeshTaker(folder, is_open, document).Run();
}

}  // namespace mbv::mjcf
