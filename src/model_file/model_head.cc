#include "model_file/model_head.h"

#include <fmt/format.h>

#include "core/names.h"

namespace mbv::internal {
namespace {

// Names of models become names of folders.
std::string ReadName(const YamlNode& node, YamlReader* yaml) {
  const std::string name = yaml->Text(node, "name").value_or("");
  if (!node.is_scalar() || IsName(name)) return name;
  const std::string near = NearestName(name);
  yaml->Error(node, fmt::format("name = {} violates: {}", Describe(node), kNameRule),
              near.empty() ? "for example my_linkage" : fmt::format("for example {}", near));
  return name;
}

// Which way is up in pictures; gravity says it unless a scenario switches it off.
void ReadUp(const Block& model, const YamlNode* node, ModelValues* values, ModelHead* head) {
  const double g = head->gravity_W.norm();
  if (g > 0.0) head->up_W = -head->gravity_W / g;
  if (node == nullptr) return;
  const auto up = values->Vector(model, *node, "up");
  if (!up) return;
  if (up->norm() > 0.0) {
    head->up_W = up->normalized();
  } else {
    values->yaml().Error(*node, "up = [0, 0, 0] has no direction", "e.g. up: [0, 0, 1]");
  }
}

void ReadAllowances(const Block& model, const YamlMap& file, ModelValues* values, ModelHead* head) {
  static const std::vector<std::string> kAllowances = {"impossible_inertia"};
  YamlReader& yaml = values->yaml();
  if (const YamlNode* allow = file.Find("allow")) {
    std::vector<const YamlNode*> items = {allow};
    if (allow->is_sequence()) {
      items = yaml.Items(*allow, "allow").value_or(std::vector<const YamlNode*>{});
    }
    for (const YamlNode* item : items) {
      if (yaml.Choice(*item, "allow", kAllowances)) head->impossible_inertia_allowed = true;
    }
  }
  const std::string key = "closure_tolerance";
  const auto tolerance = values->Number(model, file, key, {kPlain, kMm});
  if (!tolerance) return;
  if (*tolerance >= 0.0) {
    head->closure_tolerance_m = *tolerance;
  } else {
    yaml.Error(*file.FindInUnit(key, {kPlain, kMm}).node,
               fmt::format("{} = {} violates {} >= 0", key, *tolerance, key));
  }
}

// What the file that the model was made from has and the model has not.
void ReadLeftOut(const YamlNode* node, YamlReader* yaml, ModelHead* head) {
  if (node == nullptr) return;
  const auto items = yaml->Items(*node, "left_out");
  for (const YamlNode* item : items.value_or(std::vector<const YamlNode*>{})) {
    const auto text = yaml->Text(*item, "left_out");
    if (!text) continue;
    head->left_out.push_back({.kind = ModelCaveat::Kind::kLeftOut, .text = *text});
    yaml->AddAt(Severity::kWarning, item->line, item->column, "left_out: " + *text,
                "verdicts on the model name it; when the model has it, delete this line");
  }
}

}  // namespace

// clang-format off
const std::vector<std::string> kModelKeys = {
    "name",   "description", "parameters", "gravity",   "world",    "bodies",         "joints",
    "drives", "prescribed",  "outputs",    "springs",   "parts",    "instances",      "drive_order",
    "urdf",   "attach",      "up",         "materials", "sections", "parameters_from", "allow",
    "closure_tolerance", "closure_tolerance_mm", "couplings", "motors", "elements",
    "legs",   "license",     "left_out"};
// clang-format on

ModelHead ReadTitle(const YamlMap& file, YamlReader* yaml) {
  ModelHead head;
  if (const YamlNode* name = file.Required("name")) head.name = ReadName(*name, yaml);
  if (const YamlNode* text = file.Find("description")) {
    head.description = yaml->Text(*text, "description").value_or("");
  }
  // For people and archives (pipeline/package.h); nothing is computed from it.
  if (const YamlNode* text = file.Find("license")) (void)yaml->Text(*text, "license");
  ReadLeftOut(file.Find("left_out"), yaml, &head);
  return head;
}

void ReadSurroundings(const Block& model, const YamlMap& file, const std::optional<Vec3>& gravity_W,
                      ModelValues* values, ModelHead* head) {
  if (const YamlNode* gravity = file.Find("gravity")) {
    head->gravity_W = values->Vector(model, *gravity, "gravity").value_or(Vec3::Zero());
  }
  ReadUp(model, file.Find("up"), values, head);
  if (gravity_W) head->gravity_W = *gravity_W;
  ReadAllowances(model, file, values, head);
}

}  // namespace mbv::internal
