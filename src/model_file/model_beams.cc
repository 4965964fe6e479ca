// Beams of elastic bodies: their ends, axes, sections and materials.
#include <fmt/format.h>

#include <cmath>

#include "model_file/model_elastic.h"

namespace mbv::internal {

void BeamReader::Read(const Block& block) {
  YamlReader& yaml = values_.yaml();
  const YamlNode* bodies = block.Section("bodies");
  if (bodies == nullptr) return;
  for (const YamlEntry& body_entry : bodies->entries) {
    const int body = bodies_.Find(block.prefix + body_entry.key);
    const YamlNode* beams = body_entry.value->Find("beams");
    if (body < 0 || beams == nullptr || beams->is_null()) continue;
    const std::string path = block.PathOf("bodies") + "." + body_entry.key + ".beams";
    const auto& entries = yaml.Entries(*beams, path);
    for (const YamlEntry& entry : entries) {
      const std::string& body_name = bodies_.bodies[body].name;
      const bool good_before = beams_.good;
      beams_.good = false;  // until the end of a good beam
      if (!IsNewName(entry, path, &yaml)) continue;
      if (!HasRoom(*entry.value, beams_.beams.size(), kMaxBodies, "beams", &yaml)) return;
      const bool good = ReadBeam(block, entry, JoinPath(path, entry.key), body,
                                 entries.size() == 1 ? body_name : body_name + "." + entry.key);
      beams_.good = good_before && good;
    }
  }
}

// The material or section that `key` names, looked up in the block, then outwards.
template <typename T>
std::optional<T> BeamReader::Described(const Block& block, const YamlMap& map,
                                       const std::string& key,
                                       const std::map<std::string, std::optional<T>>& known) {
  const YamlNode* node = map.Required(key);
  const auto name = node == nullptr ? std::nullopt : values_.yaml().Text(*node, map.PathOf(key));
  if (!name) return std::nullopt;
  for (const std::string& level : block.levels) {
    if (const auto found = known.find(level + *name); found != known.end()) return found->second;
  }
  std::vector<std::string> names;
  for (const auto& [full, value] : known) names.push_back(full.substr(full.rfind('.') + 1));
  values_.yaml().Error(
      *node, fmt::format("{} = {}: there is no such {}", map.PathOf(key), Describe(*node), key),
      DidYouMean(*name, names));
  return std::nullopt;
}

bool BeamReader::ReadBeam(const Block& block, const YamlEntry& entry, const std::string& path,
                          int body, const std::string& name) {
  YamlReader& yaml = values_.yaml();
  const YamlMap map(&yaml, entry.value.get(), path, {"from", "to", "section", "material", "z"});
  if (!map.valid()) return false;
  if (!map.Has("from") && !map.Has("to")) (void)map.Required("to");
  const auto from = names_.PointOn(block, map, "from", body);
  const auto to = names_.PointOn(block, map, "to", body);
  const auto section = Described(block, map, "section", sections_);
  const auto material = Described(block, map, "material", materials_);
  if (!from || !to) return false;
  const double length = (*to - *from).norm();
  if (length < 1e-9) {
    yaml.Error(entry, fmt::format("{}: its ends are the same point", path),
               "a beam needs a length; leave it out where a pose makes it vanish");
    return false;
  }
  if (!section || !material) return false;
  const auto R = Axes(block, map, (*to - *from) / length, *section);
  if (!R) return false;
  beams_.beams.push_back({.name = name,
                          .body = body,
                          .p_from = *from,
                          .p_to = *to,
                          .R_BE = *R,
                          .section = *section,
                          .youngs_modulus = material->youngs,
                          .shear_modulus = material->shear});
  beams_.places.push_back(PlaceOf(entry));
  return true;
}

// Beam axes in the body: x along the beam, z as given, made perpendicular.
std::optional<Mat3> BeamReader::Axes(const Block& block, const YamlMap& map, const Vec3& along,
                                     const Section& section) {
  constexpr double kParallel = 1e-6;  // rad
  Vec3 z = along.unitOrthogonal();
  const YamlNode* node = map.Find("z");
  if (node != nullptr) {
    const auto given = values_.Axis(block, *node, map.PathOf("z"));
    if (!given) return std::nullopt;
    z = *given - along * along.dot(*given);
    if (z.norm() < kParallel) {
      values_.yaml().Error(*node, fmt::format("{} is parallel to the beam", map.PathOf("z")),
                           "z is across the beam: the direction of the section's z axis in the "
                           "body");
      return std::nullopt;
    }
    z.normalize();
  } else if (std::abs(section.I_y - section.I_z) > 1e-12 * (section.I_y + section.I_z)) {
    values_.yaml().Error(
        *map.node(), fmt::format("{}: 'z' is missing", map.path()),
        "a section with I_y other than I_z needs the direction of its z axis in the body");
    return std::nullopt;
  }
  Mat3 R;
  R << along, z.cross(along), z;
  return R;
}

}  // namespace mbv::internal
