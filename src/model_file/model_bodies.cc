#include "model_file/model_bodies.h"

#include <fmt/format.h>
#include <filesystem>
#include <map>

#include "model_file/mesh/read_mesh.h"

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
    const auto pose = values_.Item<Pose>(block, *entry.value, [&] {
      return values_.PoseOf(block, *entry.value, JoinPath(path, entry.key));
    });
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
  const auto index = bodies_.bodies.size();
  bodies_.places.push_back({.place = PlaceOf(entry),
                            .path = path,
                            .note = block.is_model() ? "" : fmt::format(" (body {})", body.name)});
  bodies_.bodies.push_back(std::move(body));
  auto read = values_.Item<Body>(block, *entry.value, [&] {
    const YamlMap map(
        &yaml, entry.value.get(), path,
        {"mass", "com", "com_mm", "inertia", "gravity_compensation", "frames", "shapes", "beams"});
    ReadMass(block, map, &bodies_.bodies[index]);
    if (const YamlNode* frames = map.Find("frames")) {
      frames_.Read(block, *frames, map.PathOf("frames"), static_cast<int>(index));
    }
    return std::optional(bodies_.bodies[index]);
  });
  bodies_.bodies[index] = *std::move(read);
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
  body->gravity_compensation =
      values_.Number(block, map, "gravity_compensation", {kPlain}).value_or(0.0);
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
    auto shape = values_.Item<Shape>(
        block, item, [&] { return ReadShape(block, item, fmt::format("{}[{}]", path, i), body); });
    if (shape) shapes.push_back(*std::move(shape));
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
          *color, fmt::format("{} = {} is not a color", map.PathOf("color"), Describe(*color)),
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
