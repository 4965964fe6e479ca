#include "model_file/model_legs.h"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "model_file/model_names.h"

namespace mbv::internal {
namespace {

// YAML that nobody wrote, with the place of what it stands for.
class NodeMaker {
 public:
  explicit NodeMaker(const YamlNode& at) : at_(at) {}

  using Entries = std::vector<std::pair<std::string, YamlNodePtr>>;

  [[nodiscard]] YamlNodePtr Scalar(const std::string& text) const {
    YamlNode node = Empty(YamlNode::Kind::kScalar);
    node.text = text;
    return std::make_shared<YamlNode>(std::move(node));
  }
  [[nodiscard]] YamlNodePtr List(std::vector<YamlNodePtr> items) const {
    YamlNode node = Empty(YamlNode::Kind::kSequence);
    node.items = std::move(items);
    return std::make_shared<YamlNode>(std::move(node));
  }
  // Without the entries that are null.
  [[nodiscard]] YamlNodePtr Map(const Entries& entries) const {
    YamlNode node = Empty(YamlNode::Kind::kMap);
    for (const auto& [key, value] : entries) {
      if (value == nullptr) continue;
      node.entries.push_back(
          {.key = key, .line = value->line, .column = value->column, .value = value});
    }
    return std::make_shared<YamlNode>(std::move(node));
  }

 private:
  [[nodiscard]] YamlNode Empty(YamlNode::Kind kind) const {
    YamlNode node;
    node.kind = kind;
    node.line = at_.line;
    node.column = at_.column;
    return node;
  }

  const YamlNode& at_;
};

YamlNodePtr Shared(const YamlMap& map, const std::string& key) {
  for (const YamlEntry& entry : map.node()->entries) {
    if (entry.key == key) return entry.value;
  }
  return nullptr;
}

// One leg on its way to a block.
class Leg {
 public:
  Leg(const YamlMap& map, YamlReader* yaml) : map_(map), yaml_(*yaml), make_(*map.node()) {}

  // Null after a finding.
  YamlNodePtr Part() {
    const bool ends = ReadEnds();
    const bool keys = (map_.Required("from") != nullptr) & (map_.Required("to") != nullptr) &
                      (map_.Required("length") != nullptr);
    const YamlNodePtr lower = Half("lower", false), upper = Half("upper", true);
    if (!ends || !keys || lower == nullptr || upper == nullptr) return nullptr;
    const YamlNodePtr drive =
        make_.Map({{"kind", make_.Scalar("joint")}, {"joint", make_.Scalar("slide")}});
    return make_.Map({{"bodies", make_.Map({{"lower", lower}, {"upper", upper}})},
                      {"joints", Joints()},
                      {"drives", make_.Map({{"length", drive}})}});
  }

 private:
  // Two balls let the halves spin about the line, but nothing turns them: they are symmetric about
  // it (mechanism/idle_spins.h).
  bool ReadEnds() {
    const YamlNode* node = map_.Find("ends");
    if (node == nullptr) return true;
    const auto items = yaml_.Items(*node, map_.PathOf("ends"), 2);
    if (!items) return false;
    const std::vector<std::string> kinds = {"universal", "spherical"};
    const auto first = yaml_.Choice(*(*items)[0], map_.PathOf("ends") + "[0]", kinds);
    const auto second = yaml_.Choice(*(*items)[1], map_.PathOf("ends") + "[1]", kinds);
    if (!first || !second) return false;
    universal_first_ = *first == 0;
    universal_last_ = *second == 0;
    if (!universal_first_ || !universal_last_) return true;
    yaml_.Error(*node,
                fmt::format("{}: two ends of kind universal leave the leg no turn about its line",
                            map_.PathOf("ends")),
                "at least one end spherical");
    return false;
  }

  YamlNodePtr Joints() const {
    const YamlNodePtr from = Shared(map_, "from"), to = Shared(map_, "to");
    const YamlNodePtr lower = make_.Scalar("lower"), upper = make_.Scalar("upper");
    YamlNodePtr range = Shared(map_, "range"), range_mm = Shared(map_, "range_mm");
    const YamlNodePtr slide = make_.Map({{"kind", make_.Scalar("prismatic")},
                                         {"parent", lower},
                                         {"child", upper},
                                         {"axis", make_.Scalar("z")},
                                         {"guess", Shared(map_, "length")},
                                         {"range", range},
                                         {"range_mm", range_mm}});
    return make_.Map({{"from", End(from, lower, universal_first_)},
                      {"slide", slide},
                      {"to", End(upper, to, universal_last_)}});
  }

  [[nodiscard]] YamlNodePtr End(const YamlNodePtr& parent, const YamlNodePtr& child,
                                bool universal) const {
    if (!universal) {
      // The first of two balls starts where a universal joint would.
      const bool guessed = child->text == "lower" && !universal_last_;
      return make_.Map({{"kind", make_.Scalar("spherical")},
                        {"parent", parent},
                        {"child", child},
                        {"guess", guessed ? BallGuess("guess") : nullptr},
                        {"guess_deg", guessed ? BallGuess("guess_deg") : nullptr}});
    }
    return make_.Map({{"kind", make_.Scalar("universal")},
                      {"parent", parent},
                      {"child", child},
                      {"axis", make_.Scalar("y")},
                      {"axis2", make_.Scalar("x")},
                      {"guess", Shared(map_, "guess")},
                      {"guess_deg", Shared(map_, "guess_deg")}});
  }

  // Roll, pitch, yaw of the angles about y and then x.
  [[nodiscard]] YamlNodePtr BallGuess(const std::string& key) const {
    const YamlNodePtr angles = Shared(map_, key);
    if (angles == nullptr || angles->items.size() != 2) return angles;
    return make_.List({angles->items[1], angles->items[0], make_.Scalar("0")});
  }

  // A body with its centre of mass on the line; of the upper half counted downwards.
  YamlNodePtr Half(const std::string& key, bool upper) const {
    const YamlNode* node = map_.Find(key);
    if (node == nullptr) return make_.Map({});
    const YamlMap half(&yaml_, node, map_.PathOf(key), {"mass", "com", "along", "across"});
    if (!half.valid()) return nullptr;
    for (const char* needed : {"mass", "com", "along", "across"}) {
      if (half.Required(needed) == nullptr) return nullptr;
    }
    const NodeMaker make(*node);
    YamlNodePtr com = Shared(half, "com");
    if (!com->is_scalar()) return nullptr;
    if (upper) com = NodeMaker(*com).Scalar("-(" + com->text + ")");
    const YamlNodePtr zero = make.Scalar("0"), across = Shared(half, "across");
    return make.Map({{"mass", Shared(half, "mass")},
                     {"com", make.List({zero, zero, com})},
                     {"inertia", make.List({across, across, Shared(half, "along")})},
                     {"shapes", Shapes(make, upper)}});
  }

  // Pictures only.
  [[nodiscard]] YamlNodePtr Shapes(const NodeMaker& make, bool upper) const {
    const YamlNodePtr radius = Shared(map_, "radius"), length = Shared(map_, "length");
    if (radius == nullptr || length == nullptr || !length->is_scalar()) return nullptr;
    const std::string end = fmt::format("{}0.6*({})", upper ? "-" : "", length->text);
    const YamlNodePtr zero = make.Scalar("0");
    const YamlNodePtr thin =
        upper && radius->is_scalar() ? make.Scalar("0.6*(" + radius->text + ")") : radius;
    const YamlNodePtr cylinder = make.Map({{"from", make.List({zero, zero, zero})},
                                           {"to", make.List({zero, zero, make.Scalar(end)})},
                                           {"radius", thin}});
    return make.List(
        {make.Map({{"cylinder", cylinder}, {"color", make.Scalar(upper ? "grey" : "steel")}})});
  }

  const YamlMap& map_;
  YamlReader& yaml_;
  const NodeMaker make_;
  bool universal_first_ = true, universal_last_ = false;
};

void ExpandLeg(const Block& block, const YamlEntry& entry, ModelValues* values,
               ModelBlocks* blocks) {
  YamlReader& yaml = values->yaml();
  const std::string section = block.PathOf("legs");
  if (!IsNewName(entry, section, &yaml)) return;
  if (!HasRoom(*entry.value, blocks->blocks.size(), kMaxBlocks, "legs", &yaml)) return;
  const YamlNode* instances = block.Section("instances");
  if (instances != nullptr && instances->Find(entry.key) != nullptr) {
    yaml.Error(entry, fmt::format("{}.{}: there is an instance of this name", section, entry.key));
    return;
  }
  const YamlMap map(&yaml, entry.value.get(), JoinPath(section, entry.key),
                    {"from", "to", "ends", "length", "range", "range_mm", "guess", "guess_deg",
                     "radius", "lower", "upper"});
  if (!map.valid()) return;
  const YamlNodePtr part = Leg(map, &yaml).Part();
  if (part == nullptr) return;
  blocks->made.push_back(part);
  Block leg = block;
  leg.node = part.get();
  leg.path = map.path();
  leg.prefix = block.prefix + entry.key + ".";
  leg.levels.insert(leg.levels.begin(), leg.prefix);
  blocks->blocks.push_back(std::move(leg));
}

}  // namespace

void ExpandLegs(ModelValues* values, ModelBlocks* blocks) {
  for (size_t b = 0, written = blocks->blocks.size(); b < written; ++b) {
    const Block& block = blocks->blocks[b];
    values->yaml().SetNote(block.Note());
    for (const YamlEntry& entry : block.Entries("legs", &values->yaml())) {
      ExpandLeg(block, entry, values, blocks);
    }
  }
  values->yaml().SetNote("");
}

}  // namespace mbv::internal
