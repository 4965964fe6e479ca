#include "plot/style.h"

#include <fmt/format.h>
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <numbers>

#include "model_file/yaml/yaml_reader.h"
#include "plot/text_mask.h"

namespace mbv {
const std::vector<FigureStyle>& FigureStyles() {
  static const std::vector<FigureStyle> styles = {
      {.name = "ieee", .font = kSerif, .font_pt = 8.0, .width_mm = 88.9},
      {.name = "springer", .font = kSans, .font_pt = 8.0, .width_mm = 84.0},
      {.name = "plain", .font = kSans, .font_pt = 9.0, .width_mm = 120.0}};
  return styles;
}

const FigureStyle* FindFigureStyle(const std::string& name) {
  for (const FigureStyle& style : FigureStyles()) {
    if (style.name == name) return &style;
  }
  return nullptr;
}

const std::string& ColorOf(const FigureStyle& style, int look) {
  static const std::string black = "#000000";
  if (look < 0) return black;
  return style.colors[static_cast<size_t>(look) % style.colors.size()];
}

const std::vector<double>& DashesOf(const FigureStyle& style, int look) {
  static const std::vector<double> solid;
  if (look < 0) return solid;
  return style.dashes[static_cast<size_t>(look) % style.dashes.size()];
}

std::array<double, 3> RgbOf(const std::string& color) {
  std::array<double, 3> rgb{};
  for (size_t k = 0; k < 3; ++k) {
    rgb[k] =
        static_cast<double>(std::strtol(color.substr(1 + 2 * k, 2).c_str(), nullptr, 16)) / 255.0;
  }
  return rgb;
}

namespace {

class StyleReader {
 public:
  explicit StyleReader(YamlReader* yaml) : yaml_(*yaml) {}

  FigureStyle Read(const YamlNode& root) {
    std::vector<std::string> keys = {"based_on", "font", "colors", "dashes"};
    for (const StyleRange& range : StyleRanges()) keys.emplace_back(range.key);
    const YamlMap map(&yaml_, &root, "", keys);
    FigureStyle style = Base(map.Find("based_on"));
    style.name = yaml_.file();
    if (const YamlNode* font = map.Find("font")) {
      style.font = yaml_.Text(*font, "font").value_or(style.font);
    }
    for (const StyleRange& range : StyleRanges()) ReadNumber(map.Find(range.key), range, &style);
    if (const YamlNode* colors = map.Find("colors")) ReadColors(*colors, &style);
    if (const YamlNode* dashes = map.Find("dashes")) ReadDashes(*dashes, &style);
    return style;
  }

 private:
  FigureStyle Base(const YamlNode* node) {
    if (node == nullptr) return FigureStyles().front();
    std::vector<std::string> names;
    for (const FigureStyle& style : FigureStyles()) names.push_back(style.name);
    const auto index = yaml_.Choice(*node, "based_on", names);
    return FigureStyles()[static_cast<size_t>(index.value_or(0))];
  }

  void ReadNumber(const YamlNode* node, const StyleRange& range, FigureStyle* style) {
    if (node == nullptr) return;
    const auto value = yaml_.Number(*node, range.key);
    if (!value) return;
    if (*value < range.least || *value > range.most) {
      yaml_.Error(*node, fmt::format("{} = {:g} violates {:g} <= {} <= {:g}", range.key, *value,
                                     range.least, range.key, range.most));
      return;
    }
    style->*range.value = *value;
  }

  static bool IsColor(const std::string& text) {
    return text.size() == 7 && text[0] == '#' &&
           std::all_of(text.begin() + 1, text.end(),
                       [](unsigned char c) { return std::isxdigit(c) != 0; });
  }

  void ReadColors(const YamlNode& node, FigureStyle* style) {
    const auto items = yaml_.Items(node, "colors");
    if (!items) return;
    if (items->empty()) yaml_.Error(node, "colors is empty", "name one at least, or leave it out");
    std::vector<std::string> colors;
    for (size_t k = 0; k < items->size(); ++k) {
      const std::string path = fmt::format("colors[{}]", k);
      const auto text = yaml_.Text(*(*items)[k], path);
      if (text && IsColor(*text)) {
        colors.push_back(*text);
      } else if (text) {
        yaml_.Error(*(*items)[k], fmt::format("{} = '{}' is not a colour", path, *text),
                    "write \"#rrggbb\" with quotes, e.g. \"#0072b2\"");
      }
    }
    if (!colors.empty()) style->colors = colors;
  }

  void ReadDashes(const YamlNode& node, FigureStyle* style) {
    const auto items = yaml_.Items(node, "dashes");
    if (!items) return;
    if (items->empty()) yaml_.Error(node, "dashes is empty", "[[]] makes all lines solid");
    std::vector<std::vector<double>> patterns;
    for (size_t k = 0; k < items->size(); ++k) {
      patterns.push_back(Pattern(*(*items)[k], fmt::format("dashes[{}]", k)));
      if (std::count(patterns.begin(), patterns.end(), patterns.back()) == 2) {
        yaml_.Warn(*(*items)[k], fmt::format("dashes[{}] is like another one", k),
                   "such curves differ by colour alone");
      }
    }
    if (!patterns.empty()) style->dashes = patterns;
  }

  std::vector<double> Pattern(const YamlNode& node, const std::string& path) {
    const auto items = yaml_.Items(node, path);
    std::vector<double> lengths;
    if (!items) return lengths;
    for (const YamlNode* item : *items) {
      const auto length = yaml_.Number(*item, path);
      if (length && !(*length > 0 && *length <= 100)) {
        yaml_.Error(*item,
                    fmt::format("{} has {:g}, which violates 0 < length <= 100", path, *length));
      }
      lengths.push_back(length.value_or(1));
    }
    if (lengths.size() % 2 != 0) {
      yaml_.Error(node, fmt::format("{} has {} lengths, an odd number", path, lengths.size()),
                  "strokes and gaps in turns; [] is a solid line");
    }
    return lengths;
  }

  YamlReader& yaml_;
};

}  // namespace

const std::vector<StyleRange>& StyleRanges() {
  static const std::vector<StyleRange> ranges = {{"font_pt", &FigureStyle::font_pt, 4, 40},
                                                 {"width_mm", &FigureStyle::width_mm, 30, 500},
                                                 {"line_pt", &FigureStyle::line_pt, 0.1, 5},
                                                 {"axis_pt", &FigureStyle::axis_pt, 0.1, 5},
                                                 {"marker_pt", &FigureStyle::marker_pt, 0.5, 20},
                                                 {"dpi", &FigureStyle::dpi, 50, 1200}};
  return ranges;
}

std::optional<FigureStyle> LoadFigureStyle(const std::string& file, Diagnostics* diagnostics) {
  YamlReader yaml(file);
  std::optional<FigureStyle> style;
  if (const auto text = yaml.ReadFile()) {
    if (const YamlNodePtr root = yaml.Parse(*text)) style = StyleReader(&yaml).Read(*root);
  }
  diagnostics->Append(yaml.diagnostics());
  if (yaml.has_errors()) return {};
  return style;
}

namespace {

constexpr double kToDegrees = 180.0 / std::numbers::pi;
constexpr double kFewest = 1e-2, kMost = 1e4;  // largest values that are short as they are

// The first of each is SI; the last column says whether it is chosen by itself.
struct UnitRow {
  ShownUnit unit;
  bool usual = true;
};
const std::vector<UnitRow>& UnitRows() {
  static const std::vector<UnitRow> rows = {
      {{"s", "s", "s", 1}},
      {{"s", "ms", "ms", 1e3}},
      {{"m", "m", "m", 1}},
      {{"m", "mm", "mm", 1e3}},
      {{"m", "um", "µm", 1e6}, false},
      {{"rad", "rad", "rad", 1}, false},
      {{"rad", "deg", "°", kToDegrees}},
      {{"rad", "mrad", "mrad", 1e3}, false},
      {{"m/s", "m/s", "m/s", 1}},
      {{"m/s", "mm/s", "mm/s", 1e3}},
      {{"rad/s", "rad/s", "rad/s", 1}},
      {{"rad/s", "deg/s", "°/s", kToDegrees}, false},
      {{"rad/s", "rpm", "1/min", 30 / std::numbers::pi}, false},
      {{"m/s^2", "m/s^2", "m/s^{2}", 1}},
      {{"rad/s^2", "rad/s^2", "rad/s^{2}", 1}},
      {{"rad/s^2", "deg/s^2", "°/s^{2}", kToDegrees}, false},
      {{"N", "N", "N", 1}},
      {{"N", "kN", "kN", 1e-3}},
      {{"N", "mN", "mN", 1e3}},
      {{"N m", "N m", "N·m", 1}},
      {{"N m", "kN m", "kN·m", 1e-3}},
      {{"N m", "mN m", "mN·m", 1e3}},
      {{"N m", "N mm", "N·mm", 1e3}, false},
      {{"W", "W", "W", 1}},
      {{"W", "kW", "kW", 1e-3}},
      {{"W", "mW", "mW", 1e3}},
      {{"J", "J", "J", 1}},
      {{"J", "kJ", "kJ", 1e-3}},
      {{"J", "mJ", "mJ", 1e3}},
  };
  return rows;
}

}  // namespace

const ShownUnit* FindUnit(const std::string& si, const std::string& name) {
  for (const UnitRow& row : UnitRows()) {
    if (row.unit.si == si && row.unit.name == name) return &row.unit;
  }
  return nullptr;
}

std::vector<std::string> UnitsOf(const std::string& si) {
  std::vector<std::string> names;
  for (const UnitRow& row : UnitRows()) {
    if (row.unit.si == si) names.push_back(row.unit.name);
  }
  if (names.empty()) names.push_back(si);
  return names;
}

ShownUnit UsualUnit(const std::string& si, double largest) {
  const ShownUnit* usual = nullptr;
  for (const UnitRow& row : UnitRows()) {
    if (row.unit.si != si || !row.usual) continue;
    const double shown = largest * row.unit.factor;
    if (usual == nullptr ||
        (shown >= kFewest && shown < kMost &&
         !(largest * usual->factor >= kFewest && largest * usual->factor < kMost))) {
      usual = &row.unit;
    }
  }
  return usual != nullptr ? *usual : ShownUnit{si, si, si == "1" ? "" : si, 1.0};
}

}  // namespace mbv
