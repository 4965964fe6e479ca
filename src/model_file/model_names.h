// Names of a model file: which are taken, which are refused, and what the others mean. Internal to
// the model loader.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model_file/model_values.h"

namespace mbv::internal {

struct ModelBodies;
struct ModelJoints;

/// Bounds on what a file may ask for; beyond them the file is refused, not computed. The largest
/// models take a gigabyte for their rank.
inline constexpr size_t kMaxBodies = 2000;
inline constexpr size_t kMaxBlocks = 4000;
inline constexpr size_t kMaxJoints = 4000;
inline constexpr size_t kMaxItems = 10000;  ///< of frames, shapes, drives, …

/// False (after a finding, once) when a list has grown to `limit`.
bool HasRoom(const YamlNode& at, size_t size, size_t limit, const char* what, YamlReader* yaml);
/// False (after a finding) when a key is not a name; `path` is that of the map it stands in.
bool IsNewName(const YamlEntry& entry, const std::string& path, YamlReader* yaml);

/// Index of the item of this name, or -1.
template <typename T>
int IndexOf(const std::vector<T>& items, const std::string& name) {
  for (size_t i = 0; i < items.size(); ++i) {
    if (items[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

/// A frame on a body, as a joint or an output refers to it.
struct FrameRef {
  int body = 0;
  Pose X_BF = Pose::Identity();
};

/// What the names of bodies and frames mean in a block: looked up there, then outwards. Empty after
/// a finding.
class BodyNames {
 public:
  BodyNames(const ModelBodies& bodies, ModelValues* values) : bodies_(bodies), values_(*values) {}

  std::optional<int> Body(const Block& block, const YamlNode& node, const std::string& path) const;
  /// "BODY", "BODY.FRAME", or a link of a URDF file that became a frame.
  std::optional<FrameRef> Frame(const Block& block, const YamlNode& node,
                                const std::string& path) const;
  /// A frame of `body` by name; empty without a finding.
  [[nodiscard]] std::optional<Pose> FrameOn(const Block& block, int body,
                                            const std::string& name) const;
  /// A point of `body` [m] under a key, the origin if it is left out: a frame's name or [x, y, z].
  std::optional<Vec3> PointOn(const Block& block, const YamlMap& map, const std::string& key,
                              int body) const;
  /// The keys `from` and `to` of a distance drive or a spring: frames on two bodies.
  template <typename Line>
  bool Ends(const Block& block, const YamlMap& map, Line* line) const {
    const YamlNode* from_node = map.Required("from");
    const YamlNode* to_node = map.Required("to");
    const auto from = from_node ? Frame(block, *from_node, map.PathOf("from")) : std::nullopt;
    const auto to = to_node ? Frame(block, *to_node, map.PathOf("to")) : std::nullopt;
    if (!from || !to || !AreOnTwoBodies(*from, *to, *to_node, map)) return false;
    line->body_from = from->body;
    line->p_from = from->X_BF.translation();
    line->body_to = to->body;
    line->p_to = to->X_BF.translation();
    return true;
  }

 private:
  [[nodiscard]] bool AreOnTwoBodies(const FrameRef& from, const FrameRef& to,
                                    const YamlNode& to_node, const YamlMap& map) const;

  const ModelBodies& bodies_;
  ModelValues& values_;
};

/// The item that a name means in a block, of a kind for messages ("drive"): its index, or -1 after
/// a finding.
template <typename T>
int FindNamed(const std::vector<T>& items, const char* kind, const Block& block,
              const YamlNode& node, const std::string& path, YamlReader* yaml) {
  const auto name = yaml->Text(node, path);
  if (!name) return -1;
  for (const std::string& level : block.levels) {
    if (const int index = IndexOf(items, level + *name); index >= 0) return index;
  }
  std::vector<std::string> names;
  names.reserve(items.size());
  for (const T& item : items) names.push_back(item.name);
  yaml->Error(node, path + " = " + Describe(node) + ": there is no such " + kind,
              DidYouMean(*name, names));
  return -1;
}

/// The joint that a name means in a block: its index. Empty after a finding, and without one for
/// joints that were refused.
std::optional<int> FindJointNamed(const ModelJoints& joints, const Block& block,
                                  const YamlNode& node, const std::string& path, YamlReader* yaml);

}  // namespace mbv::internal
