#include "render/palette.h"

#include <cctype>
#include <charconv>
#include <map>

namespace mbv::render {
namespace {

Material Metal(float r, float g, float b) {
  return {.rgba = {r, g, b, 1.0F}, .specular = 0.6F, .shininess = 0.6F};
}
Material Paint(float r, float g, float b) {
  return {.rgba = {r, g, b, 1.0F}, .specular = 0.25F, .shininess = 0.35F};
}
Material Matt(float r, float g, float b) {
  return {.rgba = {r, g, b, 1.0F}, .specular = 0.05F, .shininess = 0.1F};
}
// Annotations glow a little, so that shadows do not change their meaning.
Material Mark(float r, float g, float b) {
  return {.rgba = {r, g, b, 1.0F}, .specular = 0.1F, .shininess = 0.3F, .emission = 0.35F};
}

const std::map<std::string, Material>& Table() {
  static const std::map<std::string, Material> table = {
      {"accent", Paint(0.93F, 0.55F, 0.14F)},
      {"aluminium", Metal(0.78F, 0.80F, 0.83F)},
      {"base", Paint(0.27F, 0.30F, 0.34F)},
      {"black", Paint(0.10F, 0.10F, 0.11F)},
      {"blue", Paint(0.20F, 0.42F, 0.70F)},
      {"brass", Metal(0.80F, 0.65F, 0.30F)},
      {"closure", Mark(0.80F, 0.10F, 0.55F)},
      {"copper", Metal(0.74F, 0.45F, 0.28F)},
      {"dark", Metal(0.30F, 0.32F, 0.35F)},
      {"dark_steel", Metal(0.34F, 0.37F, 0.41F)},
      {"deck", Matt(0.52F, 0.57F, 0.58F)},
      {"gap", Mark(1.00F, 0.05F, 0.05F)},
      {"glass", {.rgba = {0.70F, 0.82F, 0.90F, 0.30F}, .specular = 0.8F, .shininess = 0.8F}},
      {"green", Paint(0.27F, 0.57F, 0.36F)},
      {"grey", Paint(0.58F, 0.60F, 0.62F)},
      {"hull", Paint(0.36F, 0.14F, 0.13F)},
      {"light_grey", Paint(0.80F, 0.81F, 0.82F)},
      {"platform", Paint(0.93F, 0.55F, 0.14F)},
      {"pull", Mark(0.10F, 0.35F, 0.85F)},
      {"push", Mark(0.88F, 0.12F, 0.10F)},
      {"red", Paint(0.75F, 0.20F, 0.17F)},
      {"rubber", Matt(0.16F, 0.16F, 0.17F)},
      {"sea", Paint(0.16F, 0.37F, 0.50F)},
      {"steel", Metal(0.60F, 0.64F, 0.69F)},
      {"white", Paint(0.93F, 0.93F, 0.92F)},
      {"wood", Matt(0.72F, 0.56F, 0.38F)},
      {"x_axis", Mark(0.85F, 0.15F, 0.15F)},
      {"y_axis", Mark(0.15F, 0.62F, 0.20F)},
      {"yellow", Paint(0.93F, 0.77F, 0.20F)},
      {"z_axis", Mark(0.15F, 0.30F, 0.85F)},
  };
  return table;
}

// "#rrggbb" or "#rrggbbaa"; false when it is neither.
bool ParseHex(const std::string& text, std::array<float, 4>* rgba) {
  if ((text.size() != 7 && text.size() != 9) || text[0] != '#') return false;
  for (std::size_t i = 1; i < text.size(); i += 2) {
    if (!std::isxdigit(static_cast<unsigned char>(text[i])) ||
        !std::isxdigit(static_cast<unsigned char>(text[i + 1]))) {
      return false;
    }
    int value = 0;
    std::from_chars(text.data() + i, text.data() + i + 2, value, 16);
    (*rgba)[i / 2] = static_cast<float>(value) / 255.0F;
  }
  return true;
}

}  // namespace

Material MaterialOf(const std::string& color) {
  if (const auto it = Table().find(color); it != Table().end()) return it->second;
  Material material = Table().at("grey");
  ParseHex(color, &material.rgba);
  return material;
}

bool IsScenery(const std::string& color) {
  return color == "sea" || color == "hull" || color == "deck";
}

std::vector<std::string> MaterialNames() {
  std::vector<std::string> names;
  for (const auto& [name, material] : Table()) names.push_back(name);
  return names;
}

}  // namespace mbv::render
