// Bodies with their masses, frames and shapes.
#include <fmt/format.h>

#include "model_file/model_reader.h"

namespace mbv {

void ModelReader::ReadBodies(const Block& block) {
  if (block.prefix.empty()) {
    if (const YamlNode* world = block.Section("world")) {
      const YamlMap map(&yaml_, world, "world", {"frames", "shapes"});
      if (const YamlNode* frames = map.Find("frames")) {
        ReadFrames(block, frames, "world.frames", block.prefix, 0);
      }
    }
    if (const YamlNode* urdf = block.Section("urdf")) ImportUrdf(*urdf);
  }
  const YamlNode* bodies = block.Section("bodies");
  if (bodies == nullptr) return;
  for (const YamlEntry& entry : yaml_.Entries(*bodies, block.PathOf("bodies"))) {
    ReadBody(block, entry);
  }
}

void ModelReader::ReadBody(const Block& block, const YamlEntry& entry) {
  const std::string path = JoinPath(block.PathOf("bodies"), entry.key);
  if (!CheckNewName(entry, block.PathOf("bodies"))) return;
  if (!Room(*entry.value, mechanism_.bodies.size(), kMaxBodies + 1, "bodies")) return;
  Body body;
  body.name = block.prefix + entry.key;
  if (mechanism_.FindBody(body.name) >= 0) {
    yaml_.Error(entry, fmt::format("{}: a body '{}' is there already", path, body.name));
    return;
  }
  const YamlMap map(&yaml_, entry.value.get(), path,
                    {"mass", "com", "com_mm", "inertia", "frames", "shapes", "beams"});
  ReadMass(block, map, &body);
  const int index = static_cast<int>(mechanism_.bodies.size());
  mechanism_.bodies.push_back(std::move(body));
  body_places_.push_back(&entry);
  body_paths_.push_back(path);
  if (const YamlNode* frames = map.Find("frames")) {
    ReadFrames(block, frames, map.PathOf("frames"), block.prefix, index);
  }
}

void ModelReader::ReadMass(const Block& block, const YamlMap& map, Body* body) {
  if (const YamlNode* mass = map.Find("mass")) {
    body->mass = Number(block, *mass, map.PathOf("mass")).value_or(kNan);
    if (body->mass < 0.0) {
      yaml_.Error(*mass, fmt::format("{} = {} violates mass >= 0", map.PathOf("mass"), body->mass),
                  "leave the key out for a massless connecting piece");
      body->mass = kNan;
    }
  }
  body->p_BoBcm_B = Vector(block, map, "com", {kPlain, kMm}).value_or(Vec3::Zero());
  const YamlNode* inertia = map.Find("inertia");
  if (inertia == nullptr) return;
  const std::string path = map.PathOf("inertia");
  if (inertia->is_sequence()) {
    const auto diagonal = Vector(block, *inertia, path);
    body->I_Bcm_B = diagonal.value_or(Vec3::Constant(kNan)).asDiagonal();
    if (!diagonal) body->mass = kNan;
    return;
  }
  const YamlMap entries(&yaml_, inertia, path, {"xx", "yy", "zz", "xy", "xz", "yz"});
  for (int row = 0; row < 3; ++row) {
    for (int col = row; col < 3; ++col) {
      const std::string key = {"xyz"[row], "xyz"[col]};
      const YamlNode* node = row == col ? entries.Required(key) : entries.Find(key);
      const auto value = node == nullptr ? std::optional<double>(row == col ? kNan : 0.0)
                                         : Number(block, *node, entries.PathOf(key));
      body->I_Bcm_B(row, col) = body->I_Bcm_B(col, row) = value.value_or(kNan);
    }
  }
  // Marks the body as already reported for the checks on the whole.
  if (!body->I_Bcm_B.allFinite()) body->mass = kNan;
}

void ModelReader::ReadFrames(const Block& block, const YamlNode* node, const std::string& path,
                             const std::string& prefix, int body) {
  for (const YamlEntry& entry : yaml_.Entries(*node, path)) {
    auto& frames = mechanism_.bodies[body].frames;
    if (!CheckNewName(entry, path)) continue;
    if (!Room(*entry.value, frames.size(), kMaxItems, "frames on one body")) return;
    const std::string name = prefix + entry.key;
    if (mechanism_.FindFrame(body, name) != nullptr) {
      yaml_.Error(entry, fmt::format("{}: a frame '{}' is there already", path, name));
      continue;
    }
    const auto pose = PoseOf(block, *entry.value, JoinPath(path, entry.key));
    // A bad frame keeps its name, so that references to it are not reported as well.
    frames.push_back({name, pose.value_or(Pose::Identity())});
  }
}

void ModelReader::ReadAttachedFrames(const Block& block) {
  const YamlNode* attach = block.Section("attach");
  if (attach == nullptr) return;
  const std::string path = block.PathOf("attach");
  for (const YamlEntry& entry : yaml_.Entries(*attach, path)) {
    YamlNode name;
    name.kind = YamlNode::Kind::kScalar;
    name.line = entry.line;
    name.column = entry.column;
    name.text = entry.key;
    const auto body = BodyRef(block, name, JoinPath(path, entry.key));
    if (!body) continue;
    ReadFrames(block, entry.value.get(), JoinPath(path, entry.key), block.prefix, *body);
  }
}

void ModelReader::ReadShapes(const Block& block) {
  if (block.prefix.empty()) {
    const YamlNode* world = block.Section("world");
    const YamlNode* shapes = world == nullptr ? nullptr : world->Find("shapes");
    if (shapes != nullptr) ReadShapes(block, *shapes, "world.shapes", 0);
  }
  const YamlNode* bodies = block.Section("bodies");
  if (bodies == nullptr) return;
  for (const YamlEntry& entry : bodies->entries) {
    const int body = mechanism_.FindBody(block.prefix + entry.key);
    const YamlNode* shapes = entry.value->Find("shapes");
    if (body < 0 || shapes == nullptr) continue;
    ReadShapes(block, *shapes, block.PathOf("bodies") + "." + entry.key + ".shapes", body);
  }
}

void ModelReader::ReadShapes(const Block& block, const YamlNode& node, const std::string& path,
                             int body) {
  if (node.is_null()) return;
  const auto items = yaml_.Items(node, path);
  if (!items) return;
  for (size_t i = 0; i < items->size(); ++i) {
    const YamlNode& item = *(*items)[i];
    if (!Room(item, mechanism_.bodies[body].shapes.size(), kMaxItems, "shapes on one body")) return;
    const auto shape = ReadShape(block, item, fmt::format("{}[{}]", path, i), body);
    if (shape) mechanism_.bodies[body].shapes.push_back(*shape);
  }
}

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

std::optional<Shape> ModelReader::ReadShape(const Block& block, const YamlNode& node,
                                            const std::string& path, int body) {
  const YamlMap map(&yaml_, &node, path, {"capsule", "cylinder", "box", "ball", "color"});
  if (!map.valid()) return std::nullopt;
  int kinds = 0;
  for (const char* kind : {"capsule", "cylinder", "box", "ball"}) kinds += map.Has(kind) ? 1 : 0;
  if (kinds != 1) {
    yaml_.Error(node, fmt::format("{} has {} kinds, one is needed", path, kinds),
                "one of: capsule, cylinder, box, ball");
    return std::nullopt;
  }
  Shape shape;
  if (const YamlNode* color = map.Find("color")) {
    shape.color = yaml_.Text(*color, map.PathOf("color")).value_or("steel");
    if (!IsColor(shape.color)) {
      yaml_.Error(*color, fmt::format("{} = {} is no color", map.PathOf("color"), Describe(*color)),
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
  return put(ReadBall(block, *map.Find("ball"), map.PathOf("ball"), body));
}

// A frame of the body by name, or [x, y, z] in the body frame.
std::optional<Vec3> ModelReader::ShapePoint(const Block& block, const YamlMap& map,
                                            const std::string& key, int body) {
  const YamlNode* node = map.Find(key);
  if (node == nullptr) return Vec3(Vec3::Zero());
  if (node->is_sequence()) return Vector(block, *node, map.PathOf(key));
  const auto name = yaml_.Text(*node, map.PathOf(key));
  if (!name) return std::nullopt;
  if (const auto pose = FrameOn(block, body, *name)) return Vec3(pose->translation());
  yaml_.Error(*node, fmt::format("{} = {}: body '{}' has no such frame", map.PathOf(key),
                                 Describe(*node), mechanism_.bodies[body].name));
  return std::nullopt;
}

std::optional<double> ModelReader::Radius(const Block& block, const YamlMap& map) {
  if (map.FindInUnit("radius", {kPlain, kMm}).node == nullptr) {
    (void)map.Required("radius");
    return std::nullopt;
  }
  const auto radius = Number(block, map, "radius", {kPlain, kMm});
  if (!radius || *radius > 0.0) return radius;
  yaml_.Error(*map.node(),
              fmt::format("{} = {} violates radius > 0", map.PathOf("radius"), *radius));
  return std::nullopt;
}

template <typename Rod>
std::optional<Rod> ModelReader::ReadRod(const Block& block, const YamlNode& node,
                                        const std::string& path, int body) {
  const YamlMap map(&yaml_, &node, path, {"from", "to", "radius", "radius_mm"});
  if (!map.valid()) return std::nullopt;
  if (!map.Has("from") && !map.Has("to")) (void)map.Required("to");
  const auto from = ShapePoint(block, map, "from", body);
  const auto to = ShapePoint(block, map, "to", body);
  const auto radius = Radius(block, map);
  if (!from || !to || !radius) return std::nullopt;
  if ((*to - *from).norm() < 1e-9) {
    yaml_.Error(node, fmt::format("{}: its ends are the same point", path));
    return std::nullopt;
  }
  return Rod{*from, *to, *radius};
}

std::optional<Box> ModelReader::ReadBox(const Block& block, const YamlNode& node,
                                        const std::string& path, int body) {
  const YamlMap map(&yaml_, &node, path, {"size", "size_mm", "at"});
  if (!map.valid()) return std::nullopt;
  if (!map.Has("size_mm")) (void)map.Required("size");
  const auto size = Vector(block, map, "size", {kPlain, kMm});
  if (!size) return std::nullopt;
  if (size->minCoeff() <= 0.0) {
    yaml_.Error(node, fmt::format("{}: an edge of {} violates size > 0", path, size->minCoeff()));
    return std::nullopt;
  }
  Box box{.X_BG = Pose::Identity(), .size = *size};
  const YamlNode* at = map.Find("at");
  if (at == nullptr) return box;
  std::optional<Pose> pose;
  if (!at->is_scalar()) {
    pose = PoseOf(block, *at, map.PathOf("at"));
  } else if (pose = FrameOn(block, body, at->text); !pose) {
    yaml_.Error(*at, fmt::format("{} = {}: body '{}' has no such frame", map.PathOf("at"),
                                 Describe(*at), mechanism_.bodies[body].name));
  }
  if (!pose) return std::nullopt;
  box.X_BG = *pose;
  return box;
}

std::optional<Ball> ModelReader::ReadBall(const Block& block, const YamlNode& node,
                                          const std::string& path, int body) {
  const YamlMap map(&yaml_, &node, path, {"at", "radius", "radius_mm"});
  if (!map.valid()) return std::nullopt;
  const auto at = ShapePoint(block, map, "at", body);
  const auto radius = Radius(block, map);
  if (!at || !radius) return std::nullopt;
  return Ball{*at, *radius};
}

}  // namespace mbv
