#include "scenario/figures_reader.h"

#include <fmt/format.h>

#include <set>

#include "core/names.h"

namespace mbv {
namespace {

const std::vector<std::string> kPanelKeys = {
    "signals", "witnesses", "marks", "difference_to", "x",     "unit",       "x_unit",     "label",
    "x_label", "names",     "log",   "legend",        "share", "from_start", "equal_scale"};
const std::vector<std::string> kFigureKeys = {"name", "caption", "width_mm", "height_mm", "panels"};

constexpr double kLeastFigureMm = 20, kMostFigureMm = 500;

class FiguresReader {
 public:
  explicit FiguresReader(ValueReader* values) : values_(*values), yaml_(values->yaml()) {}

  std::vector<FigureSpec> Read(const YamlNode& node) {
    std::vector<FigureSpec> figures;
    const auto items = yaml_.Items(node, "figures");
    if (!items) return figures;
    for (size_t k = 0; k < items->size(); ++k) {
      figures.push_back(Figure(*(*items)[k], fmt::format("figures[{}]", k)));
      RefuseTwice(figures.back().name, *(*items)[k]);
    }
    return figures;
  }

  std::vector<PanelSpec> Panels(const YamlNode& node, const std::string& path) {
    std::vector<PanelSpec> panels;
    const auto items = yaml_.Items(node, path);
    if (items && items->empty()) yaml_.Error(node, path + " is empty: there is nothing to draw");
    for (size_t k = 0; items && k < items->size(); ++k) {
      const YamlMap map(&yaml_, (*items)[k], fmt::format("{}[{}]", path, k), kPanelKeys);
      if (map.valid()) panels.push_back(Panel(map));
    }
    return panels;
  }

 private:
  void RefuseTwice(const PlacedText& name, const YamlNode& node) {
    if (!name.given() || names_.insert(name.text).second) return;
    yaml_.Error(node, fmt::format("{} = '{}': another figure has this name", name.path, name.text));
  }

  FigureSpec Figure(const YamlNode& node, const std::string& path) {
    // A figure of one panel may say what is in it without the list.
    const bool listed = node.is_map() && node.Find("panels") != nullptr;
    std::vector<std::string> keys = kFigureKeys;
    if (!listed) keys.insert(keys.end(), kPanelKeys.begin(), kPanelKeys.end());
    const YamlMap map(&yaml_, &node, path, keys);
    FigureSpec figure;
    if (!map.valid()) return figure;
    if (const YamlNode* name = map.Required("name")) figure.name = Name(*name, map.PathOf("name"));
    figure.caption = Words(map, "caption");
    figure.width_mm = Size(map, "width_mm");
    figure.height_mm = Size(map, "height_mm");
    if (listed) {
      figure.panels = Panels(*map.Find("panels"), map.PathOf("panels"));
    } else {
      figure.panels = {Panel(map)};
    }
    return figure;
  }

  PlacedText Name(const YamlNode& node, const std::string& path) {
    const PlacedText name = Placed(node, path);
    if (name.given() && !IsName(name.text)) {
      yaml_.Error(node, fmt::format("{} = '{}' is no name of files", path, name.text),
                  fmt::format("write {}", kNameRule));
    }
    return name;
  }

  PanelSpec Panel(const YamlMap& map) {
    PanelSpec panel;
    if (const YamlNode* signals = map.Required("signals")) {
      panel.signals = List(*signals, map.PathOf("signals"));
    }
    for (const auto& [key, to] :
         {std::pair{"witnesses", &panel.witnesses}, {"marks", &panel.marks}}) {
      if (const YamlNode* node = map.Find(key)) *to = List(*node, map.PathOf(key));
    }
    for (const auto& [key, to] : {std::pair{"difference_to", &panel.against},
                                  {"x", &panel.x},
                                  {"unit", &panel.unit},
                                  {"x_unit", &panel.x_unit}}) {
      if (const YamlNode* node = map.Find(key)) *to = Placed(*node, map.PathOf(key));
    }
    panel.label = Words(map, "label");
    panel.x_label = Words(map, "x_label");
    ReadNames(map, &panel);
    ReadFlags(map, &panel);
    return panel;
  }

  void ReadNames(const YamlMap& map, PanelSpec* panel) {
    const YamlNode* names = map.Find("names");
    if (names == nullptr) return;
    for (const YamlEntry& entry : yaml_.Entries(*names, map.PathOf("names"))) {
      const auto text = yaml_.Text(*entry.value, map.PathOf("names") + "." + entry.key);
      if (text) panel->names[entry.key] = *text;
    }
  }

  void ReadFlags(const YamlMap& map, PanelSpec* panel) {
    for (const auto& [key, to] : {std::pair{"log", &panel->log},
                                  {"legend", &panel->legend},
                                  {"from_start", &panel->from_start},
                                  {"equal_scale", &panel->equal_scale}}) {
      if (const YamlNode* node = map.Find(key)) {
        *to = yaml_.Flag(*node, map.PathOf(key)).value_or(*to);
      }
    }
    if (const YamlNode* share = map.Find("share")) {
      panel->share = values_.Positive(*share, map.PathOf("share")).value_or(1.0);
    }
  }

  // One text, or a list of them that is not empty.
  std::vector<PlacedText> List(const YamlNode& node, const std::string& path) {
    if (node.is_scalar()) return {Placed(node, path)};
    std::vector<PlacedText> texts;
    const auto items = yaml_.Items(node, path);
    if (items && items->empty()) yaml_.Error(node, path + " is empty: there is nothing to draw");
    for (size_t k = 0; items && k < items->size(); ++k) {
      texts.push_back(Placed(*(*items)[k], fmt::format("{}[{}]", path, k)));
    }
    return texts;
  }

  PlacedText Placed(const YamlNode& node, const std::string& path) {
    return {yaml_.Text(node, path).value_or(""), path, node.line, node.column};
  }

  std::string Words(const YamlMap& map, const char* key) {
    const YamlNode* node = map.Find(key);
    return node == nullptr ? "" : yaml_.Text(*node, map.PathOf(key)).value_or("");
  }

  double Size(const YamlMap& map, const char* key) {
    const YamlNode* node = map.Find(key);
    if (node == nullptr) return kNan;
    const auto mm = values_.Number(*node, map.PathOf(key));
    if (mm && !(*mm >= kLeastFigureMm && *mm <= kMostFigureMm)) {
      yaml_.Error(*node, fmt::format("{} = {:g} violates {:g} <= {} <= {:g}", map.PathOf(key), *mm,
                                     kLeastFigureMm, key, kMostFigureMm));
    }
    return mm.value_or(kNan);
  }

  ValueReader& values_;
  YamlReader& yaml_;
  std::set<std::string> names_;
};

}  // namespace

std::vector<FigureSpec> ReadFigures(ValueReader* values, const YamlNode* node) {
  if (node == nullptr) return {};
  return FiguresReader(values).Read(*node);
}

std::vector<PanelSpec> ReadPanels(ValueReader* values, const YamlNode& node,
                                  const std::string& path) {
  return FiguresReader(values).Panels(node, path);
}

}  // namespace mbv
