#include "mechanism/colors.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <map>
#include <optional>

namespace mbv {
namespace {

using Rgba = std::array<double, 4>;

const std::map<std::string, Rgba>& Table() {
  static const std::map<std::string, Rgba> table = {
      {"accent", {0.93, 0.55, 0.14, 1}},     {"aluminium", {0.78, 0.8, 0.83, 1}},
      {"base", {0.27, 0.3, 0.34, 1}},        {"black", {0.1, 0.1, 0.11, 1}},
      {"blue", {0.2, 0.42, 0.7, 1}},         {"brass", {0.8, 0.65, 0.3, 1}},
      {"copper", {0.74, 0.45, 0.28, 1}},     {"dark", {0.3, 0.32, 0.35, 1}},
      {"dark_steel", {0.34, 0.37, 0.41, 1}}, {"deck", {0.52, 0.57, 0.58, 1}},
      {"glass", {0.7, 0.82, 0.9, 0.3}},      {"glass_frame", {0.56, 0.69, 0.78, 1}},
      {"green", {0.27, 0.57, 0.36, 1}},      {"grey", {0.58, 0.6, 0.62, 1}},
      {"hull", {0.36, 0.14, 0.13, 1}},       {"light_grey", {0.8, 0.81, 0.82, 1}},
      {"platform", {0.93, 0.55, 0.14, 1}},   {"red", {0.75, 0.2, 0.17, 1}},
      {"rubber", {0.16, 0.16, 0.17, 1}},     {"sea", {0.16, 0.37, 0.5, 1}},
      {"steel", {0.6, 0.64, 0.69, 1}},       {"white", {0.93, 0.93, 0.92, 1}},
      {"wood", {0.72, 0.56, 0.38, 1}},       {"yellow", {0.93, 0.77, 0.2, 1}},
  };
  return table;
}

// "#rrggbb" or "#rrggbbaa".
std::optional<Rgba> ParseHex(const std::string& text) {
  const auto is_hex = [](unsigned char c) { return std::isxdigit(c) != 0; };
  if ((text.size() != 7 && text.size() != 9) || text[0] != '#' ||
      !std::all_of(text.begin() + 1, text.end(), is_hex)) {
    return std::nullopt;
  }
  Rgba rgba{0, 0, 0, 1};
  for (std::size_t i = 0; 2 * i + 2 < text.size(); ++i) {
    int value = 0;
    std::from_chars(text.data() + 2 * i + 1, text.data() + 2 * i + 3, value, 16);
    rgba[i] = value / 255.0;
  }
  return rgba;
}

}  // namespace

std::array<double, 4> ShapeColor(const std::string& color) {
  if (const auto it = Table().find(color); it != Table().end()) return it->second;
  return ParseHex(color).value_or(Table().at("grey"));
}

bool IsShapeColor(const std::string& color) {
  return Table().contains(color) || ParseHex(color).has_value();
}

std::vector<std::string> ShapeColorNames() {
  std::vector<std::string> names;
  for (const auto& [name, rgba] : Table()) names.push_back(name);
  return names;
}

}  // namespace mbv
