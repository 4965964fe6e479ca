#include "model_file/model_elastic.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace mbv::internal {
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

// By word, or by a number so that a parameter may choose: 0 series, 1 printed.
std::optional<bool> PrintedTorsion(const Block& block, const YamlMap& map, ModelValues* values) {
  const YamlNode* node = map.Find("torsion");
  if (node == nullptr || node->text == "series") return false;
  if (node->text == "printed") return true;
  const auto number = values->Number(block, *node, map.PathOf("torsion"));
  if (!number) return std::nullopt;
  if (*number == 0.0 || *number == 1.0) return *number == 1.0;
  values->yaml().Error(*node, fmt::format("{} = {} is neither series (0) nor printed (1)",
                                          map.PathOf("torsion"), *number));
  return std::nullopt;
}

std::optional<Section> ReadRectangle(const Block& block, const YamlNode& node,
                                     const std::string& path, ModelValues* values) {
  const YamlMap map(&values->yaml(), &node, path, {"y", "y_mm", "z", "z_mm", "torsion"});
  const auto y = values->Positive(block, map, "y", {kPlain, kMm});
  const auto z = values->Positive(block, map, "z", {kPlain, kMm});
  const auto printed = PrintedTorsion(block, map, values);
  if (!y || !z || !printed) return std::nullopt;
  const double a = std::max(*y, *z), b = std::min(*y, *z);
  return Section{.area = *y * *z,
                 .I_y = *y * *z * *z * *z / 12.0,
                 .I_z = *z * *y * *y * *y / 12.0,
                 .torsion = *printed ? PrintedTorsionOfRectangle(a, b) : TorsionOfRectangle(a, b)};
}

std::optional<Section> ReadSection(const Block& block, const YamlNode& node,
                                   const std::string& path, ModelValues* values) {
  const std::vector<std::string> kinds = {"round", "tube", "rectangular", "general"};
  const YamlMap map(&values->yaml(), &node, path, kinds);
  if (!map.valid()) return std::nullopt;
  if (node.entries.size() != 1) {
    values->yaml().Error(node,
                         fmt::format("{} has {} kinds, one is needed", path, node.entries.size()),
                         "one of: round, tube, rectangular, general");
    return std::nullopt;
  }
  const std::string& kind = node.entries.front().key;
  const YamlNode& data = *node.entries.front().value;
  const std::string where = map.PathOf(kind);
  if (kind == "round") {
    const YamlMap keys(&values->yaml(), &data, where, {"diameter", "diameter_mm"});
    const auto diameter = values->Positive(block, keys, "diameter", {kPlain, kMm});
    return diameter ? std::optional<Section>(Ring(*diameter, 0.0)) : std::nullopt;
  }
  if (kind == "tube") {
    const YamlMap keys(
        &values->yaml(), &data, where,
        {"outer_diameter", "outer_diameter_mm", "inner_diameter", "inner_diameter_mm"});
    const auto outer = values->Positive(block, keys, "outer_diameter", {kPlain, kMm});
    const auto inner = values->Positive(block, keys, "inner_diameter", {kPlain, kMm});
    if (!outer || !inner) return std::nullopt;
    if (*inner < *outer) return Ring(*outer, *inner);
    values->yaml().Error(data, fmt::format("{}: {} and {} violate inner_diameter < outer_diameter",
                                           where, *inner, *outer));
    return std::nullopt;
  }
  if (kind == "rectangular") return ReadRectangle(block, data, where, values);
  if (kind != "general") return std::nullopt;  // an unknown key has its finding
  const YamlMap keys(&values->yaml(), &data, where, {"area", "I_y", "I_z", "torsion"});
  const auto area = values->Positive(block, keys, "area", {kPlain});
  const auto I_y = values->Positive(block, keys, "I_y", {kPlain});
  const auto I_z = values->Positive(block, keys, "I_z", {kPlain});
  const auto torsion = values->Positive(block, keys, "torsion", {kPlain});
  if (!area || !I_y || !I_z || !torsion) return std::nullopt;
  return Section{.area = *area, .I_y = *I_y, .I_z = *I_z, .torsion = *torsion};
}

std::optional<Material> ReadMaterial(const Block& block, const YamlEntry& entry,
                                     ModelValues* values) {
  YamlReader& yaml = values->yaml();
  const YamlMap map(&yaml, entry.value.get(), JoinPath(block.PathOf("materials"), entry.key),
                    {"youngs_modulus", "shear_modulus", "poisson"});
  if (!map.valid()) return std::nullopt;
  const auto youngs = values->Positive(block, map, "youngs_modulus", {kPlain});
  const YamlNode* poisson = map.Find("poisson");
  if (poisson != nullptr && map.Has("shear_modulus")) {
    yaml.Error(entry, fmt::format("{} has both poisson and shear_modulus", map.path()),
               "G = E/(2(1 + poisson)); give one of them");
    return std::nullopt;
  }
  if (poisson == nullptr) {
    const auto shear = values->Positive(block, map, "shear_modulus", {kPlain});
    if (!youngs || !shear) return std::nullopt;
    const double nu = *youngs / (2.0 * *shear) - 1.0;
    if (!(nu > -1.0 && nu <= 0.5)) {
      yaml.Warn(*map.node(),
                fmt::format("{}: these moduli make Poisson's ratio {:.4g}", map.path(), nu),
                "an isotropic material has -1 < poisson <= 0.5");
    }
    return Material{.youngs = *youngs, .shear = *shear};
  }
  const auto nu = values->Number(block, *poisson, map.PathOf("poisson"));
  if (nu && !(*nu > -1.0 && *nu <= 0.5)) {
    yaml.Error(*poisson,
               fmt::format("{} = {} violates -1 < poisson <= 0.5", map.PathOf("poisson"), *nu));
    return std::nullopt;
  }
  if (!youngs || !nu) return std::nullopt;
  return Material{.youngs = *youngs, .shear = *youngs / (2.0 * (1.0 + *nu))};
}

}  // namespace

void ReadMaterials(const Block& block, ModelValues* values, Materials* materials) {
  YamlReader& yaml = values->yaml();
  for (const YamlEntry& entry : block.Entries("materials", &yaml)) {
    if (!IsNewName(entry, block.PathOf("materials"), &yaml)) continue;
    (*materials)[block.prefix + entry.key] = ReadMaterial(block, entry, values);
  }
}

void ReadSections(const Block& block, ModelValues* values, Sections* sections) {
  YamlReader& yaml = values->yaml();
  for (const YamlEntry& entry : block.Entries("sections", &yaml)) {
    if (!IsNewName(entry, block.PathOf("sections"), &yaml)) continue;
    (*sections)[block.prefix + entry.key] =
        ReadSection(block, *entry.value, JoinPath(block.PathOf("sections"), entry.key), values);
  }
}

}  // namespace mbv::internal
