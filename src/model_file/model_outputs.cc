#include "model_file/model_outputs.h"

#include <fmt/format.h>

#include <utility>

namespace mbv::internal {

void ReadOutputs(const Block& block, const BodyNames& names, YamlReader* yaml, SignalPlaces* places,
                 std::vector<Output>* outputs) {
  const std::string section = block.PathOf("outputs");
  for (const YamlEntry& entry : block.Entries("outputs", yaml)) {
    if (!IsNewName(entry, section, yaml)) continue;
    const std::string path = JoinPath(section, entry.key);
    const YamlNode* frame_node = entry.value.get();
    const YamlNode* in_node = nullptr;
    if (frame_node->is_map()) {
      const YamlMap map(yaml, frame_node, path, {"frame", "in"});
      in_node = map.Find("in");
      frame_node = map.Required("frame");
      if (frame_node == nullptr) continue;
    }
    const auto frame = names.Frame(block, *frame_node, path);
    const auto in = in_node ? names.Frame(block, *in_node, path + ".in") : FrameRef{};
    if (!frame || !in) continue;
    outputs->push_back({.name = block.prefix + entry.key,
                        .body = frame->body,
                        .X_BO = frame->X_BF,
                        .reference_body = in->body,
                        .X_RbR = in->X_BF});
    places->Add(block.prefix + entry.key, "output", PlaceOf(entry));
  }
}

void ReadSprings(const Block& block, const BodyNames& names, ModelValues* values,
                 std::vector<SpringDamper>* springs) {
  YamlReader& yaml = values->yaml();
  const std::string section = block.PathOf("springs");
  for (const YamlEntry& entry : block.Entries("springs", &yaml)) {
    if (!IsNewName(entry, section, &yaml)) continue;
    if (!HasRoom(*entry.value, springs->size(), kMaxItems, "springs", &yaml)) return;
    const YamlMap map(&yaml, entry.value.get(), JoinPath(section, entry.key),
                      {"from", "to", "stiffness", "damping", "free_length", "free_length_mm"});
    SpringDamper spring;
    spring.name = block.prefix + entry.key;
    const bool good = names.Ends(block, map, &spring);
    spring.stiffness = values->Number(block, map, "stiffness", {kPlain}).value_or(0.0);
    spring.damping = values->Number(block, map, "damping", {kPlain}).value_or(0.0);
    spring.free_length_m = values->Number(block, map, "free_length", {kPlain, kMm}).value_or(0.0);
    for (const auto& [key, value] :
         {std::pair{"stiffness", spring.stiffness}, std::pair{"damping", spring.damping},
          std::pair{"free_length", spring.free_length_m}}) {
      if (value >= 0.0) continue;
      yaml.Error(entry, fmt::format("{} = {} violates {} >= 0", map.PathOf(key), value, key));
    }
    if (good) springs->push_back(spring);
  }
}

}  // namespace mbv::internal
