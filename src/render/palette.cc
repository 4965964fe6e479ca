#include "render/palette.h"

#include <map>

#include "mechanism/colors.h"

namespace mbv::render {
namespace {

// Annotations: they glow a little, so that shadows do not change their meaning.
const std::map<std::string, std::array<float, 4>>& Marks() {
  static const std::map<std::string, std::array<float, 4>> marks = {
      {"closure", {0.80F, 0.10F, 0.55F, 1.0F}}, {"gap", {1.00F, 0.05F, 0.05F, 1.0F}},
      {"pull", {0.10F, 0.35F, 0.85F, 1.0F}},    {"push", {0.88F, 0.12F, 0.10F, 1.0F}},
      {"x_axis", {0.95F, 0.68F, 0.00F, 1.0F}},  {"y_axis", {0.16F, 0.60F, 0.20F, 1.0F}},
      {"z_axis", {0.00F, 0.68F, 0.64F, 1.0F}},  {"path", {0.42F, 0.18F, 0.70F, 1.0F}},
  };
  return marks;
}

struct Finish {
  float specular = 0.25F, shininess = 0.35F;
};

Finish FinishOf(const std::string& color) {
  static const std::map<std::string, Finish> finishes = {
      {"aluminium", {0.6F, 0.6F}}, {"brass", {0.6F, 0.6F}},      {"copper", {0.6F, 0.6F}},
      {"dark", {0.6F, 0.6F}},      {"dark_steel", {0.6F, 0.6F}}, {"deck", {0.05F, 0.1F}},
      {"glass", {0.8F, 0.8F}},     {"rubber", {0.05F, 0.1F}},    {"steel", {0.6F, 0.6F}},
      {"wood", {0.05F, 0.1F}},
  };
  const auto it = finishes.find(color);
  return it == finishes.end() ? Finish{} : it->second;  // paint
}

}  // namespace

Material MaterialOf(const std::string& color) {
  if (const auto mark = Marks().find(color); mark != Marks().end()) {
    return {.rgba = mark->second, .specular = 0.1F, .shininess = 0.3F, .emission = 0.05F};
  }
  const Finish finish = FinishOf(color);
  Material material{.specular = finish.specular, .shininess = finish.shininess};
  const std::array<double, 4> rgba = ShapeColor(color);
  for (std::size_t i = 0; i < 4; ++i) material.rgba[i] = static_cast<float>(rgba[i]);
  return material;
}

bool IsScenery(const std::string& color) {
  return color == "sea" || color == "hull" || color == "deck";
}

}  // namespace mbv::render
