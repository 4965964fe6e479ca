#include "model_file/urdf_model.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <filesystem>

#include "core/names.h"
#include "input/yaml_reader.h"
#include "model_file/write_model.h"

namespace mbv::internal {
namespace {

namespace fs = std::filesystem;

std::string RobotName(const std::string& file, const std::string& urdf) {
  tinyxml2::XMLDocument document;
  std::string name;
  if (document.Parse(urdf.c_str(), urdf.size()) == tinyxml2::XML_SUCCESS) {
    const tinyxml2::XMLElement* robot = document.FirstChildElement("robot");
    if (robot != nullptr && robot->Attribute("name") != nullptr) name = robot->Attribute("name");
  }
  name = NearestName(name);
  if (name.empty()) name = NearestName(fs::path(file).stem().string());
  return name.empty() ? "robot" : name;
}

bool IsClosureFile(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return false;
  YamlReader reader(path.string());
  const auto text = reader.ReadFile();
  const YamlNodePtr root = text ? reader.Parse(*text) : nullptr;
  // One that cannot be read is named by whoever reads it for good.
  if (root == nullptr) return text.has_value();
  return root->Find("closed_loop") != nullptr || root->Find("closures") != nullptr;
}

std::string FindClosureFile(const fs::path& file) {
  const fs::path folder = file.parent_path();
  for (const fs::path& name :
       {fs::path(file.stem().string() + ".yaml"), fs::path("robot.yaml"),
        fs::path("loop_closures.yaml"), fs::path("config") / "loop_closures.yaml",
        fs::path("..") / "config" / "loop_closures.yaml"}) {
    if (IsClosureFile(folder / name)) return name.string();
  }
  return "";
}

}  // namespace

bool IsUrdfFile(const std::string& file) { return file.ends_with(".urdf"); }

std::string UrdfModelText(const std::string& file, const std::string& urdf) {
  const std::string closures = FindClosureFile(file);
  return fmt::format("name: {}\nurdf: {{file: {}{}}}\n", RobotName(file, urdf),
                     QuotedYaml(fs::path(file).filename().string()),
                     closures.empty() ? "" : ", closures: " + QuotedYaml(closures));
}

}  // namespace mbv::internal
