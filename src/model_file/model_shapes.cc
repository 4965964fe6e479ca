#include "model_file/model_shapes.h"

#include <fmt/format.h>

#include <filesystem>

#include "mesh/find_mesh.h"

namespace mbv::internal {
namespace {

bool IsColor(const std::string& text) {
  if (text.empty()) return false;
  if (text[0] != '#')
    return text.find_first_not_of(
               "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
           std::string::npos;
  return (text.size() == 7 || text.size() == 9) &&
         text.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos;
}

}  // namespace

void ShapeReader::Read(const Block& block) {
  if (block.is_model()) {
    const YamlNode* world = block.Section("world");
    const YamlNode* shapes = world == nullptr ? nullptr : world->Find("shapes");
    if (shapes != nullptr) ReadList(block, *shapes, "world.shapes", 0);
  }
  const YamlNode* bodies = block.Section("bodies");
  if (bodies == nullptr) return;
  for (const YamlEntry& entry : bodies->entries) {
    const int body = bodies_.Find(block.prefix + entry.key);
    const YamlNode* shapes = entry.value->Find("shapes");
    if (body < 0 || shapes == nullptr) continue;
    ReadList(block, *shapes, block.PathOf("bodies") + "." + entry.key + ".shapes", body);
  }
}

void ShapeReader::ReadList(const Block& block, const YamlNode& node, const std::string& path,
                           int body) {
  YamlReader& yaml = values_.yaml();
  if (node.is_null()) return;
  const auto items = yaml.Items(node, path);
  if (!items) return;
  auto& shapes = bodies_.bodies[body].shapes;
  for (size_t i = 0; i < items->size(); ++i) {
    const YamlNode& item = *(*items)[i];
    if (!HasRoom(item, shapes.size(), kMaxItems, "shapes on one body", &yaml)) return;
    const auto shape = ReadShape(block, item, fmt::format("{}[{}]", path, i), body);
    if (shape) shapes.push_back(*shape);
  }
}

std::optional<Shape> ShapeReader::ReadShape(const Block& block, const YamlNode& node,
                                            const std::string& path, int body) {
  const YamlMap map(&values_.yaml(), &node, path,
                    {"capsule", "cylinder", "box", "ball", "mesh", "color"});
  if (!map.valid()) return std::nullopt;
  int kinds = 0;
  for (const char* kind : {"capsule", "cylinder", "box", "ball", "mesh"}) {
    kinds += map.Has(kind) ? 1 : 0;
  }
  if (kinds != 1) {
    values_.yaml().Error(node, fmt::format("{} has {} kinds, one is needed", path, kinds),
                         "one of: capsule, cylinder, box, ball, mesh");
    return std::nullopt;
  }
  Shape shape;
  if (const YamlNode* color = map.Find("color")) {
    shape.color = values_.yaml().Text(*color, map.PathOf("color")).value_or("steel");
    if (!IsColor(shape.color)) {
      values_.yaml().Error(
          *color, fmt::format("{} = {} is no color", map.PathOf("color"), Describe(*color)),
          "a material's name, or '#rrggbb' or '#rrggbbaa' in quotes");
    }
  }
  const auto put = [&](const auto& geometry) {
    if (!geometry) return std::optional<Shape>();
    shape.geometry = *geometry;
    return std::optional<Shape>(shape);
  };
  if (const YamlNode* n = map.Find("capsule")) {
    return put(ReadRod<Capsule>(block, *n, map.PathOf("capsule"), body));
  }
  if (const YamlNode* n = map.Find("cylinder")) {
    return put(ReadRod<Cylinder>(block, *n, map.PathOf("cylinder"), body));
  }
  if (const YamlNode* n = map.Find("box")) return put(ReadBox(block, *n, map.PathOf("box"), body));
  if (const YamlNode* n = map.Find("mesh")) {
    return put(ReadMesh(block, *n, map.PathOf("mesh"), body));
  }
  return put(ReadBall(block, *map.Find("ball"), map.PathOf("ball"), body));
}

template <typename Rod>
std::optional<Rod> ShapeReader::ReadRod(const Block& block, const YamlNode& node,
                                        const std::string& path, int body) {
  const YamlMap map(&values_.yaml(), &node, path, {"from", "to", "radius", "radius_mm"});
  if (!map.valid()) return std::nullopt;
  if (!map.Has("from") && !map.Has("to")) (void)map.Required("to");
  const auto from = names_.PointOn(block, map, "from", body);
  const auto to = names_.PointOn(block, map, "to", body);
  const auto radius = values_.Radius(block, map);
  if (!from || !to || !radius) return std::nullopt;
  if ((*to - *from).norm() < 1e-9) {
    values_.yaml().Error(node, fmt::format("{}: its ends are the same point", path));
    return std::nullopt;
  }
  return Rod{*from, *to, *radius};
}

std::optional<Box> ShapeReader::ReadBox(const Block& block, const YamlNode& node,
                                        const std::string& path, int body) {
  const YamlMap map(&values_.yaml(), &node, path, {"size", "size_mm", "at"});
  if (!map.valid()) return std::nullopt;
  if (!map.Has("size_mm")) (void)map.Required("size");
  const auto size = values_.Vector(block, map, "size", {kPlain, kMm});
  if (!size) return std::nullopt;
  if (size->minCoeff() <= 0.0) {
    values_.yaml().Error(
        node, fmt::format("{}: an edge of {} violates size > 0", path, size->minCoeff()));
    return std::nullopt;
  }
  const auto pose = ReadAt(block, map, body);
  if (!pose) return std::nullopt;
  return Box{.X_BG = *pose, .size = *size};
}

// The key `at`: a pose in the body, or the name of one of its frames.
std::optional<Pose> ShapeReader::ReadAt(const Block& block, const YamlMap& map, int body) {
  const YamlNode* at = map.Find("at");
  if (at == nullptr) return Pose::Identity();
  std::optional<Pose> pose;
  if (!at->is_scalar()) {
    pose = values_.PoseOf(block, *at, map.PathOf("at"));
  } else if (pose = names_.FrameOn(block, body, at->text); !pose) {
    values_.yaml().Error(*at, fmt::format("{} = {}: body '{}' has no such frame", map.PathOf("at"),
                                          Describe(*at), bodies_.bodies[body].name));
  }
  return pose;
}

std::optional<Mesh> ShapeReader::ReadMesh(const Block& block, const YamlNode& node,
                                          const std::string& path, int body) {
  YamlReader& yaml = values_.yaml();
  const YamlMap map(&yaml, &node, path, {"file", "scale", "at"});
  if (!map.valid()) return std::nullopt;
  const YamlNode* file = map.Required("file");
  const auto name = file == nullptr ? std::nullopt : yaml.Text(*file, map.PathOf("file"));
  Mesh mesh;
  bool good = name.has_value();
  if (const YamlNode* scale = map.Find("scale")) {
    if (scale->is_scalar()) {
      const auto all = values_.Number(block, *scale, map.PathOf("scale"));
      mesh.scale = Vec3::Constant(all.value_or(kNan));
    } else {
      mesh.scale =
          values_.Vector(block, *scale, map.PathOf("scale")).value_or(Vec3::Constant(kNan));
    }
    if (mesh.scale.allFinite() && (mesh.scale.array() == 0.0).any()) {
      yaml.Error(*scale,
                 fmt::format("{} = {} violates scale != 0", map.PathOf("scale"), Describe(*scale)));
    }
    good = good && mesh.scale.allFinite() && (mesh.scale.array() != 0.0).all();
  }
  const auto pose = ReadAt(block, map, body);
  if (!good || !pose) return std::nullopt;
  if (FindMesh(*name, std::filesystem::path(yaml.file()).parent_path()).outside) {
    yaml.Error(*file,
               fmt::format("{} = {} lies outside the folder of this file", map.PathOf("file"),
                           Describe(*file)),
               "move the mesh below it, or name its folder by --package NAME=DIR");
    return std::nullopt;
  }
  mesh.file = *name;
  mesh.X_BG = *pose;
  return mesh;
}

std::optional<Ball> ShapeReader::ReadBall(const Block& block, const YamlNode& node,
                                          const std::string& path, int body) {
  const YamlMap map(&values_.yaml(), &node, path, {"at", "radius", "radius_mm"});
  if (!map.valid()) return std::nullopt;
  const auto at = names_.PointOn(block, map, "at", body);
  const auto radius = values_.Radius(block, map);
  if (!at || !radius) return std::nullopt;
  return Ball{*at, *radius};
}

}  // namespace mbv::internal
