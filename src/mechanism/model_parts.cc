// Head, parameters, and the expansion of instances into blocks.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mechanism/model_reader.h"

namespace mbv {
namespace {

const std::vector<std::string> kModelKeys = {
    "name",      "description", "parameters", "gravity", "world",   "bodies",
    "joints",    "drives",      "prescribed", "outputs", "springs", "parts",
    "instances", "drive_order", "urdf",       "attach",  "up"};
const std::vector<std::string> kPartKeys = {"parameters", "attach",     "bodies",  "joints",
                                            "drives",     "prescribed", "outputs", "springs",
                                            "instances",  "description"};

Source SourceOf(int choice) {
  return std::vector<Source>{Source::kPrinted, Source::kAssumed, Source::kCorrected}[choice];
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
    mechanism_.name = yaml_.Text(*name, "name").value_or("");
  }
  if (const YamlNode* text = map.Find("description")) {
    mechanism_.description = yaml_.Text(*text, "description").value_or("");
  }
  // Parameters come first: gravity may use them.
  const YamlNode* parameters = map.Find("parameters");
  ReadParameters(model, parameters, "parameters");
  ApplyOverrides(model);
  EvaluateParameters(model, parameters, "parameters");
  if (const YamlNode* gravity = map.Find("gravity")) {
    mechanism_.gravity_W = Vector(model, *gravity, "gravity").value_or(Vec3::Zero());
  }
  ReadUp(model, map.Find("up"));
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

void ModelReader::ReadParameters(const Block& block, const YamlNode* node,
                                 const std::string& path) {
  if (node == nullptr) return;
  for (const YamlEntry& entry : yaml_.Entries(*node, path)) {
    const std::string where = JoinPath(path, entry.key);
    if (const std::string why = WhyNoParameterName(entry.key); !why.empty()) {
      yaml_.Error(entry, fmt::format("{}: bad parameter name '{}'", path, entry.key), why);
      continue;
    }
    const YamlNode* value = entry.value.get();
    double factor = 1.0;
    if (value->is_map()) {
      const YamlMap map(&yaml_, value, where,
                        {"value", "value_deg", "value_mm", "unit", "source", "note"});
      const auto found = map.FindInUnit("value", {kPlain, kDeg, kMm});
      if (found.node == nullptr) (void)map.Required("value");
      value = found.node;
      factor = found.unit.factor;
    }
    if (value == nullptr) continue;
    if (!value->is_scalar()) {
      yaml_.Error(*value, fmt::format("{} is {}, a number or an expression is needed", where,
                                      Describe(*value)));
      continue;
    }
    block.scope->Define(entry.key, value->text, factor);
  }
}

// Reports what fails, and lists the parameters in the mechanism.
void ModelReader::EvaluateParameters(const Block& block, const YamlNode* node,
                                     const std::string& path) {
  if (node == nullptr || !node->is_map()) return;
  for (const YamlEntry& entry : node->entries) {
    if (!block.scope->Has(entry.key)) continue;
    const std::string where = JoinPath(path, entry.key);
    Parameter parameter{.name = block.prefix + entry.key, .unit = "", .note = ""};
    const ExpressionResult result = block.scope->Lookup(entry.key);
    if (result.value) parameter.value = *result.value;
    const YamlNode* at = entry.value.get();
    if (at->is_map()) {
      const YamlMap map(&yaml_, at, where,
                        {"value", "value_deg", "value_mm", "unit", "source", "note"});
      if (const auto found = map.FindInUnit("value", {kPlain, kDeg, kMm}); found.node != nullptr) {
        at = found.node;
      }
      if (const YamlNode* unit = map.Find("unit")) {
        parameter.unit = yaml_.Text(*unit, map.PathOf("unit")).value_or("");
      }
      if (const YamlNode* note = map.Find("note")) {
        parameter.note = yaml_.Text(*note, map.PathOf("note")).value_or("");
      }
      if (const YamlNode* source = map.Find("source")) {
        const auto choice =
            yaml_.Choice(*source, map.PathOf("source"), {"printed", "assumed", "corrected"});
        if (choice) parameter.source = SourceOf(*choice);
      }
    }
    if (!result.value && !result.error.empty()) {
      yaml_.Error(*at, fmt::format("{} = {} {}", where, Describe(*at), result.error), result.hint);
    }
    mechanism_.parameters.push_back(std::move(parameter));
  }
}

void ModelReader::ApplyOverrides(const Block& block) {
  for (const auto& [name, value] : options_.overrides) {
    if (!name.starts_with(block.prefix)) continue;
    const std::string inner = name.substr(block.prefix.size());
    if (!block.scope->Has(inner)) continue;
    block.scope->Set(inner, value);
    override_used_[name] = true;
  }
  for (const std::string& name : block.scope->Names()) {
    if (block.scope->Has(name)) known_parameters_.push_back(block.prefix + name);
  }
}

void ModelReader::CheckOverrides() {
  for (const auto& [name, value] : options_.overrides) {
    if (override_used_[name] && std::isfinite(value)) continue;
    Finding finding;
    if (const auto place = options_.override_places.find(name);
        place != options_.override_places.end()) {
      finding = place->second;
    }
    finding.severity = Severity::kError;
    if (override_used_[name]) {
      finding.message = fmt::format("parameter {} = {} is not a finite number", name, value);
    } else {
      finding.message = fmt::format("{} has no parameter '{}'", yaml_.file(), name);
      const std::string near = ClosestWord(name, known_parameters_);
      if (!near.empty()) finding.hint = fmt::format("did you mean '{}'?", near);
    }
    other_findings_.Add(finding);
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
  ReadParameters(inner, parameters, inner.PathOf("parameters"));

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
  EvaluateParameters(inner, parameters, inner.PathOf("parameters"));
  blocks_.push_back(inner);
  // A copy: blocks_ grows while the nested instances are added.
  ExpandInstances(inner);
}

}  // namespace mbv
