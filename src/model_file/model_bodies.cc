#include "model_file/model_bodies.h"

#include <fmt/format.h>

namespace mbv::internal {

ModelBodies::ModelBodies() : bodies(1), places(1) {
  bodies[0].name = "world";
  places[0].path = "world";
}

int ModelBodies::Find(const std::string& name) const { return IndexOf(bodies, name); }

const NamedFrame* ModelBodies::FindFrame(int body, const std::string& name) const {
  const auto& frames = bodies[body].frames;
  const int i = IndexOf(frames, name);
  return i < 0 ? nullptr : &frames[i];
}

void FrameReader::ReadWorld(const Block& model) {
  const YamlNode* world = model.Section("world");
  if (world == nullptr) return;
  const YamlMap map(&values_.yaml(), world, "world", {"frames", "shapes"});
  if (const YamlNode* frames = map.Find("frames")) Read(model, *frames, "world.frames", 0);
}

void FrameReader::Read(const Block& block, const YamlNode& node, const std::string& path,
                       int body) {
  YamlReader& yaml = values_.yaml();
  for (const YamlEntry& entry : yaml.Entries(node, path)) {
    auto& frames = bodies_.bodies[body].frames;
    if (!IsNewName(entry, path, &yaml)) continue;
    if (!HasRoom(*entry.value, frames.size(), kMaxItems, "frames on one body", &yaml)) return;
    const std::string name = block.prefix + entry.key;
    if (bodies_.FindFrame(body, name) != nullptr) {
      yaml.Error(entry, fmt::format("{}: a frame '{}' is there already", path, name));
      continue;
    }
    const auto pose = values_.PoseOf(block, *entry.value, JoinPath(path, entry.key));
    // A bad frame keeps its name, so that references to it are not reported as well.
    frames.push_back({name, pose.value_or(Pose::Identity())});
  }
}

void FrameReader::ReadAttached(const Block& block, const BodyNames& names) {
  for (const YamlEntry& entry : block.Entries("attach", &values_.yaml())) {
    YamlNode name;
    name.kind = YamlNode::Kind::kScalar;
    name.line = entry.line;
    name.column = entry.column;
    name.text = entry.key;
    const std::string path = JoinPath(block.PathOf("attach"), entry.key);
    const auto body = names.Body(block, name, path);
    if (body) Read(block, *entry.value, path, *body);
  }
}

void BodyReader::Read(const Block& block) {
  for (const YamlEntry& entry : block.Entries("bodies", &values_.yaml())) ReadBody(block, entry);
}

void BodyReader::ReadBody(const Block& block, const YamlEntry& entry) {
  YamlReader& yaml = values_.yaml();
  const std::string path = JoinPath(block.PathOf("bodies"), entry.key);
  if (!IsNewName(entry, block.PathOf("bodies"), &yaml)) return;
  if (!HasRoom(*entry.value, bodies_.bodies.size(), kMaxBodies + 1, "bodies", &yaml)) return;
  Body body;
  body.name = block.prefix + entry.key;
  if (bodies_.Find(body.name) >= 0) {
    yaml.Error(entry, fmt::format("{}: a body '{}' is there already", path, body.name));
    return;
  }
  const YamlMap map(&yaml, entry.value.get(), path,
                    {"mass", "com", "com_mm", "inertia", "frames", "shapes", "beams"});
  ReadMass(block, map, &body);
  const int index = static_cast<int>(bodies_.bodies.size());
  bodies_.places.push_back({.place = PlaceOf(entry),
                            .path = path,
                            .note = block.is_model() ? "" : fmt::format(" (body {})", body.name)});
  bodies_.bodies.push_back(std::move(body));
  if (const YamlNode* frames = map.Find("frames")) {
    frames_.Read(block, *frames, map.PathOf("frames"), index);
  }
}

void BodyReader::ReadMass(const Block& block, const YamlMap& map, Body* body) {
  if (const YamlNode* mass = map.Find("mass")) {
    body->mass = values_.Number(block, *mass, map.PathOf("mass")).value_or(kNan);
    if (body->mass < 0.0) {
      values_.yaml().Error(
          *mass, fmt::format("{} = {} violates mass >= 0", map.PathOf("mass"), body->mass),
          "leave the key out for a massless connecting piece");
      body->mass = kNan;
    }
  }
  body->p_BoBcm_B = values_.Vector(block, map, "com", {kPlain, kMm}).value_or(Vec3::Zero());
  const YamlNode* inertia = map.Find("inertia");
  if (inertia == nullptr) return;
  ReadInertia(block, *inertia, map.PathOf("inertia"), body);
  // Marks the body as already reported for the checks on the whole.
  if (!body->I_Bcm_B.allFinite()) body->mass = kNan;
}

void BodyReader::ReadInertia(const Block& block, const YamlNode& node, const std::string& path,
                             Body* body) {
  if (node.is_sequence()) {
    const auto diagonal = values_.Vector(block, node, path);
    body->I_Bcm_B = diagonal.value_or(Vec3::Constant(kNan)).asDiagonal();
    return;
  }
  const YamlMap entries(&values_.yaml(), &node, path, {"xx", "yy", "zz", "xy", "xz", "yz"});
  for (int row = 0; row < 3; ++row) {
    for (int col = row; col < 3; ++col) {
      const std::string key = {"xyz"[row], "xyz"[col]};
      const YamlNode* entry = row == col ? entries.Required(key) : entries.Find(key);
      const auto value = entry == nullptr ? std::optional<double>(row == col ? kNan : 0.0)
                                          : values_.Number(block, *entry, entries.PathOf(key));
      body->I_Bcm_B(row, col) = body->I_Bcm_B(col, row) = value.value_or(kNan);
    }
  }
}

}  // namespace mbv::internal
