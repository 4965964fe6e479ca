// Head, and the expansion of instances into blocks.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/names.h"
#include "model_file/model_reader.h"

namespace mbv {
namespace {

// clang-format off
const std::vector<std::string> kModelKeys = {
    "name",   "description", "parameters", "gravity",   "world",    "bodies",         "joints",
    "drives", "prescribed",  "outputs",    "springs",   "parts",    "instances",      "drive_order",
    "urdf",   "attach",      "up",         "materials", "sections", "parameters_from", "allow",
    "closure_tolerance", "closure_tolerance_mm"};
// clang-format on
const std::vector<std::string> kPartKeys = {"parameters", "attach",      "bodies",    "joints",
                                            "drives",     "prescribed",  "outputs",   "springs",
                                            "instances",  "description", "materials", "sections"};

// Names of models become names of folders.
std::string ReadName(const YamlNode& node, YamlReader* yaml) {
  const std::string name = yaml->Text(node, "name").value_or("");
  if (!node.is_scalar() || IsName(name)) return name;
  const std::string near = NearestName(name);
  yaml->Error(node, fmt::format("name = {} violates: {}", Describe(node), kNameRule),
              near.empty() ? "for example my_linkage" : fmt::format("for example {}", near));
  return name;
}

}  // namespace

const YamlNode* Block::Section(std::string_view key) const {
  const YamlNode* found = node == nullptr ? nullptr : node->Find(key);
  return found == nullptr || found->is_null() ? nullptr : found;
}

std::string Block::Note() const {
  return prefix.empty() ? "" : fmt::format(" (in {})", prefix.substr(0, prefix.size() - 1));
}

void ModelReader::ReadHead() {
  const YamlMap map(&yaml_, root_.get(), "", kModelKeys);
  if (!map.valid()) return;
  Block& model = blocks_.front();
  if (const YamlNode* name = map.Required("name")) {
    mechanism_.name = ReadName(*name, &yaml_);
  }
  if (const YamlNode* text = map.Find("description")) {
    mechanism_.description = yaml_.Text(*text, "description").value_or("");
  }
  // Parameters come first: gravity may use them.
  ReadModelParameters(model, map);
  if (const YamlNode* gravity = map.Find("gravity")) {
    mechanism_.gravity_W = Vector(model, *gravity, "gravity").value_or(Vec3::Zero());
  }
  ReadUp(model, map.Find("up"));
  if (options_.gravity_W) mechanism_.gravity_W = *options_.gravity_W;
  ReadAllowances(model, map);
}

void ModelReader::ReadAllowances(const Block& model, const YamlMap& map) {
  static const std::vector<std::string> kAllowances = {"impossible_inertia"};
  if (const YamlNode* allow = map.Find("allow")) {
    std::vector<const YamlNode*> items = {allow};
    if (allow->is_sequence()) {
      items = yaml_.Items(*allow, "allow").value_or(std::vector<const YamlNode*>{});
    }
    for (const YamlNode* item : items) {
      if (yaml_.Choice(*item, "allow", kAllowances)) impossible_inertia_allowed_ = true;
    }
  }
  const std::string key = "closure_tolerance";
  const auto tolerance = Number(model, map, key, {kPlain, kMm});
  if (!tolerance) return;
  if (*tolerance >= 0.0) {
    closure_tolerance_m_ = *tolerance;
  } else {
    yaml_.Error(*map.FindInUnit(key, {kPlain, kMm}).node,
                fmt::format("{} = {} violates {} >= 0", key, *tolerance, key));
  }
}

// Which way is up in pictures; gravity says it unless a scenario switches it off.
void ModelReader::ReadUp(const Block& model, const YamlNode* node) {
  const double g = mechanism_.gravity_W.norm();
  if (g > 0.0) mechanism_.up_W = -mechanism_.gravity_W / g;
  if (node == nullptr) return;
  const auto up = Vector(model, *node, "up");
  if (!up) return;
  if (up->norm() > 0.0) {
    mechanism_.up_W = up->normalized();
  } else {
    yaml_.Error(*node, "up = [0, 0, 0] has no direction", "e.g. up: [0, 0, 1]");
  }
}

const YamlNode* ModelReader::FindPart(const std::string& name) const {
  const YamlNode* parts = root_->Find("parts");
  return parts == nullptr || !parts->is_map() ? nullptr : parts->Find(name);
}

void ModelReader::ExpandInstances(const Block& block) {
  const YamlNode* instances = block.Section("instances");
  if (instances == nullptr) return;
  for (const YamlEntry& entry : yaml_.Entries(*instances, block.PathOf("instances"))) {
    yaml_.SetNote(block.Note());
    AddInstance(block, entry);
  }
}

void ModelReader::AddInstance(const Block& block, const YamlEntry& entry) {
  const std::string path = JoinPath(block.PathOf("instances"), entry.key);
  if (!CheckNewName(entry, block.PathOf("instances"))) return;
  if (!Room(*entry.value, blocks_.size(), kMaxBlocks, "instances")) return;
  if (!entry.value->is_map()) {
    yaml_.Error(*entry.value,
                fmt::format("{} is {}, a map with 'part' is needed", path, Describe(*entry.value)));
    return;
  }
  const YamlNode* named = entry.value->Find("part");
  if (named == nullptr) {
    yaml_.Error(*entry.value, fmt::format("{}: 'part' is missing", path));
    return;
  }
  const auto part_name = yaml_.Text(*named, JoinPath(path, "part"));
  if (!part_name) return;
  const YamlNode* part = FindPart(*part_name);
  if (part == nullptr) {
    std::vector<std::string> names;
    if (const YamlNode* parts = root_->Find("parts")) {
      for (const YamlEntry& known : parts->entries) names.push_back(known.key);
    }
    const std::string near = ClosestWord(*part_name, names);
    yaml_.Error(*named, fmt::format("{}.part = '{}': there is no such part", path, *part_name),
                near.empty() ? "" : fmt::format("did you mean '{}'?", near));
    return;
  }
  if (std::find(block.parts.begin(), block.parts.end(), *part_name) != block.parts.end()) {
    yaml_.Error(*named, fmt::format("{}: part '{}' contains itself", path, *part_name));
    return;
  }
  ReadInstance(block, entry, *part, *part_name);
}

void ModelReader::ReadInstance(const Block& block, const YamlEntry& entry, const YamlNode& part,
                               const std::string& part_name) {
  const std::string path = JoinPath(block.PathOf("instances"), entry.key);
  Block inner;
  inner.node = &part;
  inner.scope = &scopes_.emplace_back(block.scope);
  inner.path = JoinPath("parts", part_name);
  inner.prefix = block.prefix + entry.key + ".";
  inner.levels = block.levels;
  inner.levels.insert(inner.levels.begin(), inner.prefix);
  inner.parts = block.parts;
  inner.parts.push_back(part_name);

  yaml_.SetNote(inner.Note());
  const YamlMap map(&yaml_, &part, inner.path, kPartKeys);
  const YamlNode* parameters = map.Find("parameters");
  ReadParameters(&yaml_, inner, parameters, inner.PathOf("parameters"));

  // The instance's values replace the defaults; they see the parameters where they are written.
  yaml_.SetNote(block.Note());
  for (const YamlEntry& given : entry.value->entries) {
    if (given.key == "part") continue;
    if (!inner.scope->Has(given.key)) {
      const std::string near = ClosestWord(given.key, inner.scope->Names());
      yaml_.Error(given,
                  fmt::format("{}: part '{}' has no parameter '{}'", path, part_name, given.key),
                  near.empty() ? "" : fmt::format("did you mean '{}'?", near));
      continue;
    }
    const auto value = Number(block, *given.value, JoinPath(path, given.key));
    inner.scope->Set(given.key, value.value_or(0.0));
  }
  yaml_.SetNote(inner.Note());
  ApplyOverrides(inner);
  EvaluateParameters(&yaml_, inner, parameters, inner.PathOf("parameters"));
  blocks_.push_back(inner);
  // A copy: blocks_ grows while the nested instances are added.
  ExpandInstances(inner);
}

}  // namespace mbv
