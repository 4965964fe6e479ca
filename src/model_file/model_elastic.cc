// Materials, cross sections and the beams of elastic bodies.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "model_file/model_reader.h"

namespace mbv {
namespace {

Section Ring(double outer, double inner) {
  const double o2 = outer * outer, i2 = inner * inner;
  const double I = std::numbers::pi / 64.0 * (o2 * o2 - i2 * i2);
  return {.area = std::numbers::pi / 4.0 * (o2 - i2), .I_y = I, .I_z = I, .torsion = 2.0 * I};
}

// St Venant's constant of a rectangle a × b, a >= b, by its series
// [Timoshenko, Goodier, Theory of Elasticity, §109]; the terms fall like n⁻⁵.
double TorsionOfRectangle(double a, double b) {
  double sum = 0.0;
  for (int n = 1; n < 400; n += 2) {
    sum += std::tanh(n * std::numbers::pi * a / (2.0 * b)) / std::pow(n, 5);
  }
  return a * b * b * b * (1.0 / 3.0 - 64.0 / std::pow(std::numbers::pi, 5) * b / a * sum);
}

// The paper's approximation [Liu 2025, text at (54)]; up to 12 % low for a square.
double PrintedTorsionOfRectangle(double a, double b) {
  return a * b * b * b * (1.0 / 3.0 - 0.21 * b / a);
}

}  // namespace

std::optional<double> ModelReader::Positive(const Block& block, const YamlMap& map,
                                            const std::string& key,
                                            std::initializer_list<UnitSuffix> units) {
  const YamlMap::InUnit found = map.FindInUnit(key, units);
  if (found.node == nullptr) {
    (void)map.Required(key);
    return std::nullopt;
  }
  const auto value = Number(block, *found.node, map.PathOf(found.key), found.unit);
  if (!value || *value > 0.0) return value;
  yaml_.Error(*found.node,
              fmt::format("{} = {} violates {} > 0", map.PathOf(found.key), *value, key));
  return std::nullopt;
}

void ModelReader::ReadMaterials(const Block& block) {
  const YamlNode* materials = block.Section("materials");
  if (materials == nullptr) return;
  for (const YamlEntry& entry : yaml_.Entries(*materials, block.PathOf("materials"))) {
    if (CheckNewName(entry, block.PathOf("materials"))) ReadMaterial(block, entry);
  }
}

void ModelReader::ReadMaterial(const Block& block, const YamlEntry& entry) {
  const YamlMap map(&yaml_, entry.value.get(), JoinPath(block.PathOf("materials"), entry.key),
                    {"youngs_modulus", "shear_modulus", "poisson"});
  auto& known = materials_[block.prefix + entry.key];
  if (!map.valid()) return;
  const auto youngs = Positive(block, map, "youngs_modulus", {kPlain});
  const YamlNode* poisson = map.Find("poisson");
  if (poisson != nullptr && map.Has("shear_modulus")) {
    yaml_.Error(entry, fmt::format("{} has both poisson and shear_modulus", map.path()),
                "G = E/(2(1 + poisson)); give one of them");
    return;
  }
  if (poisson == nullptr) {
    const auto shear = Positive(block, map, "shear_modulus", {kPlain});
    if (!youngs || !shear) return;
    known = Material{.youngs = *youngs, .shear = *shear};
    const double nu = *youngs / (2.0 * *shear) - 1.0;
    if (nu > -1.0 && nu <= 0.5) return;
    yaml_.Warn(*map.node(),
               fmt::format("{}: these moduli make Poisson's ratio {:.4g}", map.path(), nu),
               "an isotropic material has -1 < poisson <= 0.5");
    return;
  }
  const auto nu = Number(block, *poisson, map.PathOf("poisson"));
  if (nu && !(*nu > -1.0 && *nu <= 0.5)) {
    yaml_.Error(*poisson,
                fmt::format("{} = {} violates -1 < poisson <= 0.5", map.PathOf("poisson"), *nu));
    return;
  }
  if (youngs && nu) known = Material{.youngs = *youngs, .shear = *youngs / (2.0 * (1.0 + *nu))};
}

void ModelReader::ReadSections(const Block& block) {
  const YamlNode* sections = block.Section("sections");
  if (sections == nullptr) return;
  for (const YamlEntry& entry : yaml_.Entries(*sections, block.PathOf("sections"))) {
    if (!CheckNewName(entry, block.PathOf("sections"))) continue;
    sections_[block.prefix + entry.key] =
        ReadSection(block, *entry.value, JoinPath(block.PathOf("sections"), entry.key));
  }
}

std::optional<Section> ModelReader::ReadSection(const Block& block, const YamlNode& node,
                                                const std::string& path) {
  const std::vector<std::string> kinds = {"round", "tube", "rectangular", "general"};
  const YamlMap map(&yaml_, &node, path, kinds);
  if (!map.valid()) return std::nullopt;
  if (node.entries.size() != 1) {
    yaml_.Error(node, fmt::format("{} has {} kinds, one is needed", path, node.entries.size()),
                "one of: round, tube, rectangular, general");
    return std::nullopt;
  }
  const std::string& kind = node.entries.front().key;
  const YamlNode& data = *node.entries.front().value;
  const std::string where = map.PathOf(kind);
  if (kind == "round") {
    const YamlMap keys(&yaml_, &data, where, {"diameter", "diameter_mm"});
    const auto diameter = Positive(block, keys, "diameter", {kPlain, kMm});
    return diameter ? std::optional<Section>(Ring(*diameter, 0.0)) : std::nullopt;
  }
  if (kind == "tube") {
    const YamlMap keys(
        &yaml_, &data, where,
        {"outer_diameter", "outer_diameter_mm", "inner_diameter", "inner_diameter_mm"});
    const auto outer = Positive(block, keys, "outer_diameter", {kPlain, kMm});
    const auto inner = Positive(block, keys, "inner_diameter", {kPlain, kMm});
    if (!outer || !inner) return std::nullopt;
    if (*inner < *outer) return Ring(*outer, *inner);
    yaml_.Error(data, fmt::format("{}: {} and {} violate inner_diameter < outer_diameter", where,
                                  *inner, *outer));
    return std::nullopt;
  }
  if (kind == "rectangular") return ReadRectangle(block, data, where);
  if (kind != "general") return std::nullopt;  // an unknown key has its finding
  const YamlMap keys(&yaml_, &data, where, {"area", "I_y", "I_z", "torsion"});
  const auto area = Positive(block, keys, "area", {kPlain});
  const auto I_y = Positive(block, keys, "I_y", {kPlain});
  const auto I_z = Positive(block, keys, "I_z", {kPlain});
  const auto torsion = Positive(block, keys, "torsion", {kPlain});
  if (!area || !I_y || !I_z || !torsion) return std::nullopt;
  return Section{.area = *area, .I_y = *I_y, .I_z = *I_z, .torsion = *torsion};
}

std::optional<Section> ModelReader::ReadRectangle(const Block& block, const YamlNode& node,
                                                  const std::string& path) {
  const YamlMap map(&yaml_, &node, path, {"y", "y_mm", "z", "z_mm", "torsion"});
  const auto y = Positive(block, map, "y", {kPlain, kMm});
  const auto z = Positive(block, map, "z", {kPlain, kMm});
  const auto printed = PrintedTorsion(block, map);
  if (!y || !z || !printed) return std::nullopt;
  const double a = std::max(*y, *z), b = std::min(*y, *z);
  return Section{.area = *y * *z,
                 .I_y = *y * *z * *z * *z / 12.0,
                 .I_z = *z * *y * *y * *y / 12.0,
                 .torsion = *printed ? PrintedTorsionOfRectangle(a, b) : TorsionOfRectangle(a, b)};
}

// By word, or by a number so that a parameter may choose: 0 series, 1 printed.
std::optional<bool> ModelReader::PrintedTorsion(const Block& block, const YamlMap& map) {
  const YamlNode* node = map.Find("torsion");
  if (node == nullptr || node->text == "series") return false;
  if (node->text == "printed") return true;
  const auto number = Number(block, *node, map.PathOf("torsion"));
  if (!number) return std::nullopt;
  if (*number == 0.0 || *number == 1.0) return *number == 1.0;
  yaml_.Error(*node, fmt::format("{} = {} is neither series (0) nor printed (1)",
                                 map.PathOf("torsion"), *number));
  return std::nullopt;
}

void ModelReader::ReadBeams(const Block& block) {
  const YamlNode* bodies = block.Section("bodies");
  if (bodies == nullptr) return;
  for (const YamlEntry& body_entry : bodies->entries) {
    const int body = mechanism_.FindBody(block.prefix + body_entry.key);
    const YamlNode* beams = body_entry.value->Find("beams");
    if (body < 0 || beams == nullptr || beams->is_null()) continue;
    const std::string path = block.PathOf("bodies") + "." + body_entry.key + ".beams";
    const auto& entries = yaml_.Entries(*beams, path);
    for (const YamlEntry& entry : entries) {
      const std::string& body_name = mechanism_.bodies[body].name;
      const bool good_before = beams_good_;
      beams_good_ = false;  // until the end of a good beam
      if (!CheckNewName(entry, path)) continue;
      if (!Room(*entry.value, mechanism_.beams.size(), kMaxBodies, "beams")) return;
      const size_t before = mechanism_.beams.size();
      ReadBeam(block, entry, JoinPath(path, entry.key), body,
               entries.size() == 1 ? body_name : body_name + "." + entry.key);
      beams_good_ = good_before && mechanism_.beams.size() > before;
    }
  }
}

// The material or section that `key` names, looked up in the block, then outwards.
template <typename T>
std::optional<T> ModelReader::Described(const Block& block, const YamlMap& map,
                                        const std::string& key,
                                        const std::map<std::string, std::optional<T>>& known) {
  const YamlNode* node = map.Required(key);
  const auto name = node == nullptr ? std::nullopt : yaml_.Text(*node, map.PathOf(key));
  if (!name) return std::nullopt;
  for (const std::string& level : block.levels) {
    if (const auto found = known.find(level + *name); found != known.end()) return found->second;
  }
  std::vector<std::string> names;
  for (const auto& [full, value] : known) names.push_back(full.substr(full.rfind('.') + 1));
  const std::string near = ClosestWord(*name, names);
  yaml_.Error(*node,
              fmt::format("{} = {}: there is no such {}", map.PathOf(key), Describe(*node), key),
              near.empty() ? "" : fmt::format("did you mean '{}'?", near));
  return std::nullopt;
}

void ModelReader::ReadBeam(const Block& block, const YamlEntry& entry, const std::string& path,
                           int body, const std::string& name) {
  const YamlMap map(&yaml_, entry.value.get(), path, {"from", "to", "section", "material", "z"});
  if (!map.valid()) return;
  if (!map.Has("from") && !map.Has("to")) (void)map.Required("to");
  const auto from = ShapePoint(block, map, "from", body);
  const auto to = ShapePoint(block, map, "to", body);
  const auto section = Described(block, map, "section", sections_);
  const auto material = Described(block, map, "material", materials_);
  if (!from || !to) return;
  const double length = (*to - *from).norm();
  if (length < 1e-9) {
    yaml_.Error(entry, fmt::format("{}: its ends are the same point", path),
                "a beam needs a length; leave it out where a pose makes it vanish");
    return;
  }
  if (!section || !material) return;
  const auto R = BeamAxes(block, map, (*to - *from) / length, *section);
  if (!R) return;
  mechanism_.beams.push_back({.name = name,
                              .body = body,
                              .p_from = *from,
                              .p_to = *to,
                              .R_BE = *R,
                              .section = *section,
                              .youngs_modulus = material->youngs,
                              .shear_modulus = material->shear});
  beam_places_.push_back(&entry);
}

// Beam axes in the body: x along the beam, z as given, made perpendicular.
std::optional<Mat3> ModelReader::BeamAxes(const Block& block, const YamlMap& map, const Vec3& along,
                                          const Section& section) {
  constexpr double kParallel = 1e-6;  // rad
  Vec3 z = along.unitOrthogonal();
  const YamlNode* node = map.Find("z");
  if (node != nullptr) {
    const auto given = Axis(block, *node, map.PathOf("z"));
    if (!given) return std::nullopt;
    z = *given - along * along.dot(*given);
    if (z.norm() < kParallel) {
      yaml_.Error(*node, fmt::format("{} is parallel to the beam", map.PathOf("z")),
                  "z is across the beam: the direction of the section's z axis in the body");
      return std::nullopt;
    }
    z.normalize();
  } else if (std::abs(section.I_y - section.I_z) > 1e-12 * (section.I_y + section.I_z)) {
    yaml_.Error(*map.node(), fmt::format("{}: 'z' is missing", map.path()),
                "a section with I_y other than I_z needs the direction of its z axis in the body");
    return std::nullopt;
  }
  Mat3 R;
  R << along, z.cross(along), z;
  return R;
}

}  // namespace mbv
