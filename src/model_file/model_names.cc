#include "model_file/model_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "base/text.h"
#include "model_file/model_bodies.h"
#include "model_file/model_joints.h"

namespace mbv::internal {
namespace {

// The part of a name that a block at `levels` may leave out: "limb1.link1" is "link1" inside.
std::vector<std::string> ShortNames(const std::vector<std::string>& names,
                                    const std::vector<std::string>& levels) {
  std::vector<std::string> result = names;
  for (const std::string& name : names) {
    if (name.starts_with(levels.front())) result.push_back(name.substr(levels.front().size()));
  }
  return result;
}

}  // namespace

bool HasRoom(const YamlNode& at, size_t size, size_t limit, const char* what, YamlReader* yaml) {
  if (size < limit) return true;
  yaml->Error(at, fmt::format("the model has more than {} {}", limit, what));
  return false;
}

bool IsNewName(const YamlEntry& entry, const std::string& path, YamlReader* yaml) {
  const bool good = std::all_of(entry.key.begin(), entry.key.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
  });
  if (good && entry.key.size() <= 64) return true;
  yaml->Error(entry, fmt::format("{}: '{}' is not a name", path, entry.key.substr(0, 64)),
              "names are made of letters, digits, _ and -; dots come from instances");
  return false;
}

std::optional<int> BodyNames::Body(const Block& block, const YamlNode& node,
                                   const std::string& path) const {
  const auto name = values_.yaml().Text(node, path);
  if (!name) return std::nullopt;
  for (const std::string& level : block.levels) {
    if (const int body = bodies_.Find(level + *name); body >= 0) return body;
  }
  values_.yaml().Error(node, fmt::format("{} = {}: there is no such body", path, Describe(node)),
                       DidYouMean(*name, ShortNames(NamesOf(bodies_.bodies), block.levels)));
  return std::nullopt;
}

std::optional<Pose> BodyNames::FrameOn(const Block& block, int body,
                                       const std::string& name) const {
  for (const std::string& level : block.levels) {
    const NamedFrame* frame = bodies_.FindFrame(body, level + name);
    if (frame == nullptr) continue;
    values_.UseFrame(body, *frame);
    return frame->X_BF;
  }
  return std::nullopt;
}

std::optional<FrameRef> BodyNames::Frame(const Block& block, const YamlNode& node,
                                         const std::string& path) const {
  auto name = values_.yaml().Text(node, path);
  if (!name) return std::nullopt;
  if (name->size() > 256) name->resize(256);  // no name is that long
  int body_without_frame = -1;
  std::string missing_frame;
  for (const std::string& level : block.levels) {
    // Dots may belong to the body's or to the frame's name: try the longest body name first.
    for (size_t dot = name->size();; dot = name->rfind('.', dot - 1)) {
      if (dot == std::string::npos) break;
      const int body = bodies_.Find(level + name->substr(0, dot));
      if (body >= 0 && dot == name->size()) return FrameRef{body, Pose::Identity()};
      if (body >= 0) {
        const std::string frame = name->substr(dot + 1);
        if (const auto pose = FrameOn(block, body, frame)) return FrameRef{body, *pose};
        body_without_frame = body;
        missing_frame = frame;
      }
      if (dot == 0) break;
    }
  }
  if (const auto link = bodies_.links.find(*name); link != bodies_.links.end()) {
    values_.UseUnknown();
    return link->second;
  }
  if (body_without_frame >= 0) {
    const mbv::Body& body = bodies_.bodies[body_without_frame];
    values_.yaml().Error(node,
                         fmt::format("{} = {}: body '{}' has no frame '{}'", path, Describe(node),
                                     body.name, missing_frame),
                         DidYouMean(missing_frame, ShortNames(NamesOf(body.frames), block.levels)));
    return std::nullopt;
  }
  const std::string body = name->substr(0, name->find('.'));
  values_.yaml().Error(node,
                       fmt::format("{} = {}: there is no body '{}'", path, Describe(node), body),
                       DidYouMean(body, ShortNames(NamesOf(bodies_.bodies), block.levels)));
  return std::nullopt;
}

std::optional<Vec3> BodyNames::PointOn(const Block& block, const YamlMap& map,
                                       const std::string& key, int body) const {
  const YamlNode* node = map.Find(key);
  if (node == nullptr) return Vec3(Vec3::Zero());
  if (node->is_sequence()) return values_.Vector(block, *node, map.PathOf(key));
  const auto name = values_.yaml().Text(*node, map.PathOf(key));
  if (!name) return std::nullopt;
  if (const auto pose = FrameOn(block, body, *name)) return Vec3(pose->translation());
  values_.yaml().Error(*node, fmt::format("{} = {}: body '{}' has no such frame", map.PathOf(key),
                                          Describe(*node), bodies_.bodies[body].name));
  return std::nullopt;
}

bool BodyNames::AreOnTwoBodies(const FrameRef& from, const FrameRef& to, const YamlNode& to_node,
                               const YamlMap& map) const {
  if (from.body != to.body) return true;
  values_.yaml().Error(to_node, fmt::format("{}: both ends are on body '{}'", map.path(),
                                            bodies_.bodies[to.body].name));
  return false;
}

std::optional<int> FindJointNamed(const ModelJoints& joints, const Block& block,
                                  const YamlNode& node, const std::string& path, YamlReader* yaml) {
  const auto name = yaml->Text(node, path);
  if (!name) return std::nullopt;
  for (const std::string& level : block.levels) {
    if (const int joint = joints.Find(level + *name); joint >= 0) return joint;
    if (joints.refused.count(level + *name) > 0) return std::nullopt;  // has its own finding
  }
  std::vector<std::string> names = NamesOf(joints.joints);
  names.insert(names.end(), joints.refused.begin(), joints.refused.end());
  yaml->Error(node, fmt::format("{} = {}: there is no such joint", path, Describe(node)),
              DidYouMean(*name, ShortNames(names, block.levels)));
  return std::nullopt;
}

}  // namespace mbv::internal
