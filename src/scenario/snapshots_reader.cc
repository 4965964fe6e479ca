#include "scenario/section_readers.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <set>

#include "base/files.h"
#include "base/text.h"
#include "mechanism/named_places.h"

namespace mbv {
namespace {

constexpr double kMostGhosts = 50, kMostExploded = 10.0;

class SnapshotsReader {
 public:
  SnapshotsReader(ValueReader* values, double duration_s, const Mechanism& mechanism)
      : values_(*values), yaml_(values->yaml()), duration_s_(duration_s), mechanism_(mechanism) {}

  SnapshotSettings Read(const YamlNode* node) {
    YamlMap map(&yaml_, node, "snapshots",
                {"times_s", "size_px", "camera", "path", "ghosts", "background", "labels",
                 "scale_bar", "style", "exploded"});
    settings_.times_s = {0.0, 0.5 * duration_s_};
    if (const YamlNode* times = map.Find("times_s")) {
      settings_.times_s = Times(*times, "snapshots.times_s").value_or(settings_.times_s);
    }
    if (const YamlNode* size = map.Find("size_px")) ReadSize(*size);
    if (const YamlNode* path = map.Find("path")) ReadPath(*path);
    if (const YamlNode* ghosts = map.Find("ghosts")) ReadGhosts(*ghosts);
    if (const YamlNode* background = map.Find("background")) ReadBackground(*background);
    if (const YamlNode* labels = map.Find("labels")) ReadLabels(*labels);
    if (const YamlNode* bar = map.Find("scale_bar")) {
      settings_.scale_bar = yaml_.Flag(*bar, "snapshots.scale_bar").value_or(false);
    }
    if (const YamlNode* style = map.Find("style")) {
      settings_.line_art = yaml_.Choice(*style, "snapshots.style", {"shaded", "line_art"}) == 1;
    }
    if (const YamlNode* exploded = map.Find("exploded")) ReadExploded(*exploded);
    ReadCamera(map.Find("camera"));
    return std::move(settings_);
  }

 private:
  std::optional<std::vector<double>> Times(const YamlNode& node, const std::string& path) {
    auto times = values_.Numbers(node, path);
    for (const double t : times.value_or(std::vector<double>{})) {
      if (t >= 0.0 && t <= duration_s_) continue;
      yaml_.Error(node, fmt::format("{} = {} violates 0 <= t <= {}", path, t, duration_s_));
    }
    return times;
  }

  void ReadSize(const YamlNode& node) {
    const auto numbers = values_.Numbers(node, "snapshots.size_px", 2);
    for (int i = 0; numbers && i < 2; ++i) {
      const double number = (*numbers)[i];
      if (number >= 64.0 && number <= 8192.0 && number == std::floor(number)) {
        settings_.size_px[i] = static_cast<int>(number);
      } else {
        yaml_.Error(node, fmt::format("snapshots.size_px: {} is not a whole number from 64 to 8192",
                                      number));
      }
    }
  }

  void ReadPath(const YamlNode& node) {
    std::vector<std::string> outputs;
    for (const Output& output : mechanism_.outputs) outputs.push_back(output.name);
    const auto choice = yaml_.Choice(node, "snapshots.path", outputs);
    if (choice) settings_.path_output = static_cast<int>(*choice);
  }

  // A number of instants or their times.
  void ReadGhosts(const YamlNode& node) {
    if (!node.is_scalar()) {
      settings_.ghost_times_s = Times(node, "snapshots.ghosts").value_or(std::vector<double>{});
      if (settings_.ghost_times_s.size() > kMostGhosts) {
        yaml_.Error(node, fmt::format("snapshots.ghosts: {} instants are more than {}",
                                      settings_.ghost_times_s.size(), kMostGhosts));
      }
      return;
    }
    const auto count = values_.Number(node, "snapshots.ghosts");
    if (!count) return;
    if (*count >= 0.0 && *count <= kMostGhosts && *count == std::floor(*count)) {
      settings_.ghost_count = static_cast<int>(*count);
    } else {
      yaml_.Error(node,
                  fmt::format("snapshots.ghosts = {} is not a whole number from 0 to {}", *count,
                              kMostGhosts),
                  "a list gives times: ghosts: [0.2, 0.4]");
    }
  }

  void ReadBackground(const YamlNode& node) {
    const auto word = yaml_.Text(node, "snapshots.background");
    if (!word) return;
    if (*word == "default") return;
    if (*word == "transparent" || IsShapeColor(*word)) {
      settings_.background = *word;
      return;
    }
    std::vector<std::string> words = ShapeColorNames();
    words.insert(words.begin(), {"default", "transparent"});
    yaml_.Error(node,
                fmt::format("snapshots.background: '{}' is neither default, transparent, a "
                            "colour's name nor \"#rrggbb\"",
                            *word),
                DidYouMean(*word, words, "words: " + Joined(words)));
  }

  void ReadLabel(const YamlNode& node) {
    const auto word = yaml_.Text(node, "snapshots.labels");
    if (!word) return;
    std::vector<std::string> words = PlaceWords();
    for (const NamedPlace& place : NamedPlacesOf(mechanism_)) words.push_back(place.name);
    if (std::ranges::find(words, *word) != words.end()) {
      settings_.labels.push_back(*word);
      return;
    }
    yaml_.Error(node,
                fmt::format("snapshots.labels: the mechanism has no output, drive, joint, frame or "
                            "body '{}'",
                            *word),
                DidYouMean(*word, words, "kinds: " + Joined(PlaceWords())));
  }

  // A word or a list of them.
  void ReadLabels(const YamlNode& node) {
    if (node.is_scalar()) {
      ReadLabel(node);
      return;
    }
    const auto items = yaml_.Items(node, "snapshots.labels");
    for (const YamlNode* item : items.value_or(std::vector<const YamlNode*>{})) ReadLabel(*item);
  }

  void ReadExploded(const YamlNode& node) {
    const auto factor = values_.Number(node, "snapshots.exploded");
    if (!factor) return;
    if (*factor >= 1.0 && *factor <= kMostExploded) {
      settings_.exploded = *factor;
    } else {
      yaml_.Error(node, fmt::format("snapshots.exploded = {} violates 1 <= exploded <= {}", *factor,
                                    kMostExploded));
    }
  }

  void ReadCamera(const YamlNode* node) {
    YamlMap camera(&yaml_, node, "snapshots.camera",
                   {"azimuth_deg", "elevation_deg", "distance", "lookat", "projection"});
    if (camera.node() == nullptr) return;
    CameraSettings& out = settings_.camera;
    out.azimuth_rad = values_.InUnit(camera, "azimuth", {kDeg});
    out.elevation_rad = values_.InUnit(camera, "elevation", {kDeg});
    out.distance_m = values_.InUnit(camera, "distance", {kPlain});
    if (const YamlNode* lookat = camera.Find("lookat")) {
      out.lookat_W = values_.Vector(*lookat, "snapshots.camera.lookat");
    }
    if (const YamlNode* projection = camera.Find("projection")) {
      out.orthographic = yaml_.Choice(*projection, "snapshots.camera.projection",
                                      {"perspective", "orthographic"}) == 1;
    }
  }

  ValueReader& values_;
  YamlReader& yaml_;
  double duration_s_;
  const Mechanism& mechanism_;
  SnapshotSettings settings_;
};

}  // namespace

SnapshotSettings ReadSnapshots(ValueReader* values, const YamlNode* node, double duration_s,
                               const Mechanism& mechanism) {
  return SnapshotsReader(values, duration_s, mechanism).Read(node);
}

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
      yaml_.Error(node, fmt::format("{} = '{}' is not a name of files", path, name.text),
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
