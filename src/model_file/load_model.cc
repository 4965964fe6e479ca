#include "model_file/load_model.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/files.h"
#include "base/text.h"
#include "mechanism/mechanism.h"
#include "mechanism/same_geometry.h"
#include "model_file/model_bodies.h"
#include "model_file/model_checks.h"
#include "model_file/model_contacts.h"
#include "model_file/model_drives.h"
#include "model_file/model_elements.h"
#include "model_file/model_instances.h"
#include "model_file/model_joints.h"
#include "model_file/model_names.h"
#include "model_file/model_urdf.h"
#include "model_file/model_values.h"
#include "model_file/urdf/urdf_import.h"

namespace mbv::internal {
namespace {

// `outputs` and `springs` of a model file. Internal to the model loader.

// Reads frames of known bodies that are commanded or watched.
void ReadOutputs(const Block& block, const BodyNames& names, YamlReader* yaml, SignalPlaces* places,
                 std::vector<Output>* outputs) {
  const std::string section = block.PathOf("outputs");
  for (const YamlEntry& entry : block.Entries("outputs", yaml)) {
    if (!IsNewName(entry, section, yaml)) continue;
    const std::string path = JoinPath(section, entry.key);
    const YamlNode* frame_node = entry.value.get();
    const YamlNode* in_node = nullptr;
    if (frame_node->is_map()) {
      const YamlMap map(yaml, frame_node, path, {"frame", "in"});
      in_node = map.Find("in");
      frame_node = map.Required("frame");
      if (frame_node == nullptr) continue;
    }
    const auto frame = names.Frame(block, *frame_node, path);
    const auto in = in_node ? names.Frame(block, *in_node, path + ".in") : FrameRef{};
    if (!frame || !in) continue;
    outputs->push_back({.name = block.prefix + entry.key,
                        .body = frame->body,
                        .X_BO = frame->X_BF,
                        .reference_body = in->body,
                        .X_RbR = in->X_BF});
    places->Add(block.prefix + entry.key, "output", PlaceOf(entry));
  }
}

// Reads springs between frames of known bodies.
void ReadSprings(const Block& block, const BodyNames& names, ModelValues* values,
                 std::vector<SpringDamper>* springs) {
  YamlReader& yaml = values->yaml();
  const std::string section = block.PathOf("springs");
  for (const YamlEntry& entry : block.Entries("springs", &yaml)) {
    if (!IsNewName(entry, section, &yaml)) continue;
    if (!HasRoom(*entry.value, springs->size(), kMaxItems, "springs", &yaml)) return;
    const YamlMap map(&yaml, entry.value.get(), JoinPath(section, entry.key),
                      {"from", "to", "stiffness", "damping", "free_length", "free_length_mm"});
    SpringDamper spring;
    spring.name = block.prefix + entry.key;
    const bool good = names.Ends(block, map, &spring);
    spring.stiffness = values->Number(block, map, "stiffness", {kPlain}).value_or(0.0);
    spring.damping = values->Number(block, map, "damping", {kPlain}).value_or(0.0);
    spring.free_length_m = values->Number(block, map, "free_length", {kPlain, kMm}).value_or(0.0);
    for (const auto& [key, value] :
         {std::pair{"stiffness", spring.stiffness}, std::pair{"damping", spring.damping},
          std::pair{"free_length", spring.free_length_m}}) {
      if (value >= 0.0) continue;
      yaml.Error(entry, fmt::format("{} = {} violates {} >= 0", map.PathOf(key), value, key));
    }
    if (good) springs->push_back(spring);
  }
}

}  // namespace
namespace {

// What a model file says of the whole: name, gravity, up, what it allows. Internal to the model
// loader.

struct ModelHead {
  std::string name, description;
  Vec3 gravity_W = Mechanism().gravity_W;  ///< [m/s²]
  Vec3 up_W = Mechanism().up_W;
  bool impossible_inertia_allowed = false;
  double closure_tolerance_m = 0.0;  ///< up to which rounded data are projected
  std::vector<ModelCaveat> left_out;
};

/// The keys of a model file.
extern const std::vector<std::string> kModelKeys;

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

// clang-format off
const std::vector<std::string> kModelKeys = {
    "name",   "description", "parameters", "gravity",   "world",    "bodies",         "joints",
    "drives", "prescribed",  "outputs",    "springs",   "parts",    "instances",      "drive_order",
    "urdf",   "attach",      "up",         "materials", "sections", "parameters_from", "allow",
    "closure_tolerance", "closure_tolerance_mm", "couplings", "motors", "elements",
    "legs",   "license",     "left_out",   "symbols",   "contacts", "dc_link"};
// clang-format on

// Reads what needs no parameter.
ModelHead ReadTitle(const YamlMap& file, YamlReader* yaml) {
  ModelHead head;
  if (const YamlNode* name = file.Required("name")) head.name = ReadName(*name, yaml);
  if (const YamlNode* text = file.Find("description")) {
    head.description = yaml->Text(*text, "description").value_or("");
  }
  // For pages and archives (features/paper/package.h); nothing is computed from it.
  if (const YamlNode* text = file.Find("license")) (void)yaml->Text(*text, "license");
  ReadLeftOut(file.Find("left_out"), yaml, &head);
  return head;
}

// Reads the rest, which may use the model's parameters; `gravity_W` replaces what the file says.
void ReadSurroundings(const Block& model, const YamlMap& file, const std::optional<Vec3>& gravity_W,
                      ModelValues* values, ModelHead* head) {
  if (const YamlNode* gravity = file.Find("gravity")) {
    head->gravity_W = values->Vector(model, *gravity, "gravity").value_or(Vec3::Zero());
  }
  ReadUp(model, file.Find("up"), values, head);
  if (gravity_W) head->gravity_W = *gravity_W;
  ReadAllowances(model, file, values, head);
}

}  // namespace
/// Young's and shear modulus [Pa].
struct Material {
  double youngs = kNan, shear = kNan;
};

/// By full name; empty: badly described, which has its own finding.
using Materials = std::map<std::string, std::optional<Material>>;
using Sections = std::map<std::string, std::optional<Section>>;

struct ModelBeams {
  std::vector<Beam> beams;
  std::vector<Place> places;  ///< per beam
  bool good = true;           ///< false: their frame is not worth checking
};

/// Reads beams between points of bodies whose frames are known.
class BeamReader {
 public:
  BeamReader(ModelValues* values, const BodyNames& names, const ModelBodies& bodies,
             const Materials& materials, const Sections& sections, ModelBeams* beams)
      : values_(*values),
        names_(names),
        bodies_(bodies),
        materials_(materials),
        sections_(sections),
        beams_(*beams) {}

  void Read(const Block& block);

 private:
  bool ReadBeam(const Block& block, const YamlEntry& entry, const std::string& path, int body,
                const std::string& name);
  template <typename T>
  std::optional<T> Described(const Block& block, const YamlMap& map, const std::string& key,
                             const std::map<std::string, std::optional<T>>& known);
  std::optional<Mat3> Axes(const Block& block, const YamlMap& map, const Vec3& along,
                           const Section& section);

  ModelValues& values_;
  const BodyNames& names_;
  const ModelBodies& bodies_;
  const Materials& materials_;
  const Sections& sections_;
  ModelBeams& beams_;
};

namespace {

Section Ring(double outer, double inner) {
  const double o2 = outer * outer, i2 = inner * inner;
  const double I = std::numbers::pi / 64.0 * (o2 * o2 - i2 * i2);
  return {.area = std::numbers::pi / 4.0 * (o2 - i2), .I_y = I, .I_z = I, .torsion = 2.0 * I};
}

// St Venant's constant of a rectangle a × b, a >= b, by its series
// [Timoshenko, Goodier, Theory of Elasticity, §109]; the terms fall like n⁻⁵.
double TorsionOfRectangle(double a, double b) {
  double sum = 0.0;
  for (int n = 1; n < 400; n += 2) {
    sum += std::tanh(n * std::numbers::pi * a / (2.0 * b)) / std::pow(n, 5);
  }
  return a * b * b * b * (1.0 / 3.0 - 64.0 / std::pow(std::numbers::pi, 5) * b / a * sum);
}

// The paper's approximation [Liu 2025, text at (54)]; up to 12 % low for a square.
double PrintedTorsionOfRectangle(double a, double b) {
  return a * b * b * b * (1.0 / 3.0 - 0.21 * b / a);
}

// By word, or by a number so that a parameter may choose: 0 series, 1 printed.
std::optional<bool> PrintedTorsion(const Block& block, const YamlMap& map, ModelValues* values) {
  const YamlNode* node = map.Find("torsion");
  if (node == nullptr || node->text == "series") return false;
  if (node->text == "printed") return true;
  const auto number = values->Number(block, *node, map.PathOf("torsion"));
  if (!number) return std::nullopt;
  if (*number == 0.0 || *number == 1.0) return *number == 1.0;
  values->yaml().Error(*node, fmt::format("{} = {} is neither series (0) nor printed (1)",
                                          map.PathOf("torsion"), *number));
  return std::nullopt;
}

std::optional<Section> ReadRectangle(const Block& block, const YamlNode& node,
                                     const std::string& path, ModelValues* values) {
  const YamlMap map(&values->yaml(), &node, path, {"y", "y_mm", "z", "z_mm", "torsion"});
  const auto y = values->Positive(block, map, "y", {kPlain, kMm});
  const auto z = values->Positive(block, map, "z", {kPlain, kMm});
  const auto printed = PrintedTorsion(block, map, values);
  if (!y || !z || !printed) return std::nullopt;
  const double a = std::max(*y, *z), b = std::min(*y, *z);
  return Section{.area = *y * *z,
                 .I_y = *y * *z * *z * *z / 12.0,
                 .I_z = *z * *y * *y * *y / 12.0,
                 .torsion = *printed ? PrintedTorsionOfRectangle(a, b) : TorsionOfRectangle(a, b)};
}

std::optional<Section> ReadSection(const Block& block, const YamlNode& node,
                                   const std::string& path, ModelValues* values) {
  const std::vector<std::string> kinds = {"round", "tube", "rectangular", "general"};
  const YamlMap map(&values->yaml(), &node, path, kinds);
  if (!map.valid()) return std::nullopt;
  if (node.entries.size() != 1) {
    values->yaml().Error(node,
                         fmt::format("{} has {} kinds, one is needed", path, node.entries.size()),
                         "one of: round, tube, rectangular, general");
    return std::nullopt;
  }
  const std::string& kind = node.entries.front().key;
  const YamlNode& data = *node.entries.front().value;
  const std::string where = map.PathOf(kind);
  if (kind == "round") {
    const YamlMap keys(&values->yaml(), &data, where, {"diameter", "diameter_mm"});
    const auto diameter = values->Positive(block, keys, "diameter", {kPlain, kMm});
    return diameter ? std::optional<Section>(Ring(*diameter, 0.0)) : std::nullopt;
  }
  if (kind == "tube") {
    const YamlMap keys(
        &values->yaml(), &data, where,
        {"outer_diameter", "outer_diameter_mm", "inner_diameter", "inner_diameter_mm"});
    const auto outer = values->Positive(block, keys, "outer_diameter", {kPlain, kMm});
    const auto inner = values->Positive(block, keys, "inner_diameter", {kPlain, kMm});
    if (!outer || !inner) return std::nullopt;
    if (*inner < *outer) return Ring(*outer, *inner);
    values->yaml().Error(data, fmt::format("{}: {} and {} violate inner_diameter < outer_diameter",
                                           where, *inner, *outer));
    return std::nullopt;
  }
  if (kind == "rectangular") return ReadRectangle(block, data, where, values);
  if (kind != "general") return std::nullopt;  // an unknown key has its finding
  const YamlMap keys(&values->yaml(), &data, where, {"area", "I_y", "I_z", "torsion"});
  const auto area = values->Positive(block, keys, "area", {kPlain});
  const auto I_y = values->Positive(block, keys, "I_y", {kPlain});
  const auto I_z = values->Positive(block, keys, "I_z", {kPlain});
  const auto torsion = values->Positive(block, keys, "torsion", {kPlain});
  if (!area || !I_y || !I_z || !torsion) return std::nullopt;
  return Section{.area = *area, .I_y = *I_y, .I_z = *I_z, .torsion = *torsion};
}

std::optional<Material> ReadMaterial(const Block& block, const YamlEntry& entry,
                                     ModelValues* values) {
  YamlReader& yaml = values->yaml();
  const YamlMap map(&yaml, entry.value.get(), JoinPath(block.PathOf("materials"), entry.key),
                    {"youngs_modulus", "shear_modulus", "poisson"});
  if (!map.valid()) return std::nullopt;
  const auto youngs = values->Positive(block, map, "youngs_modulus", {kPlain});
  const YamlNode* poisson = map.Find("poisson");
  if (poisson != nullptr && map.Has("shear_modulus")) {
    yaml.Error(entry, fmt::format("{} has both poisson and shear_modulus", map.path()),
               "G = E/(2(1 + poisson)); give one of them");
    return std::nullopt;
  }
  if (poisson == nullptr) {
    const auto shear = values->Positive(block, map, "shear_modulus", {kPlain});
    if (!youngs || !shear) return std::nullopt;
    const double nu = *youngs / (2.0 * *shear) - 1.0;
    if (!(nu > -1.0 && nu <= 0.5)) {
      yaml.Warn(*map.node(),
                fmt::format("{}: these moduli make Poisson's ratio {:.4g}", map.path(), nu),
                "an isotropic material has -1 < poisson <= 0.5");
    }
    return Material{.youngs = *youngs, .shear = *shear};
  }
  const auto nu = values->Number(block, *poisson, map.PathOf("poisson"));
  if (nu && !(*nu > -1.0 && *nu <= 0.5)) {
    yaml.Error(*poisson,
               fmt::format("{} = {} violates -1 < poisson <= 0.5", map.PathOf("poisson"), *nu));
    return std::nullopt;
  }
  if (!youngs || !nu) return std::nullopt;
  return Material{.youngs = *youngs, .shear = *youngs / (2.0 * (1.0 + *nu))};
}

}  // namespace

void ReadMaterials(const Block& block, ModelValues* values, Materials* materials) {
  YamlReader& yaml = values->yaml();
  for (const YamlEntry& entry : block.Entries("materials", &yaml)) {
    if (!IsNewName(entry, block.PathOf("materials"), &yaml)) continue;
    (*materials)[block.prefix + entry.key] = ReadMaterial(block, entry, values);
  }
}

void ReadSections(const Block& block, ModelValues* values, Sections* sections) {
  YamlReader& yaml = values->yaml();
  for (const YamlEntry& entry : block.Entries("sections", &yaml)) {
    if (!IsNewName(entry, block.PathOf("sections"), &yaml)) continue;
    (*sections)[block.prefix + entry.key] =
        ReadSection(block, *entry.value, JoinPath(block.PathOf("sections"), entry.key), values);
  }
}

// Beams of elastic bodies: their ends, axes, sections and materials.

void BeamReader::Read(const Block& block) {
  YamlReader& yaml = values_.yaml();
  const YamlNode* bodies = block.Section("bodies");
  if (bodies == nullptr) return;
  for (const YamlEntry& body_entry : bodies->entries) {
    const int body = bodies_.Find(block.prefix + body_entry.key);
    const YamlNode* beams = body_entry.value->Find("beams");
    if (body < 0 || beams == nullptr || beams->is_null()) continue;
    const std::string path = block.PathOf("bodies") + "." + body_entry.key + ".beams";
    const auto& entries = yaml.Entries(*beams, path);
    for (const YamlEntry& entry : entries) {
      const std::string& body_name = bodies_.bodies[body].name;
      const bool good_before = beams_.good;
      beams_.good = false;  // until the end of a good beam
      if (!IsNewName(entry, path, &yaml)) continue;
      if (!HasRoom(*entry.value, beams_.beams.size(), kMaxBodies, "beams", &yaml)) return;
      const bool good = ReadBeam(block, entry, JoinPath(path, entry.key), body,
                                 entries.size() == 1 ? body_name : body_name + "." + entry.key);
      beams_.good = good_before && good;
    }
  }
}

// The material or section that `key` names, looked up in the block, then outwards.
template <typename T>
std::optional<T> BeamReader::Described(const Block& block, const YamlMap& map,
                                       const std::string& key,
                                       const std::map<std::string, std::optional<T>>& known) {
  const YamlNode* node = map.Required(key);
  const auto name = node == nullptr ? std::nullopt : values_.yaml().Text(*node, map.PathOf(key));
  if (!name) return std::nullopt;
  for (const std::string& level : block.levels) {
    if (const auto found = known.find(level + *name); found != known.end()) return found->second;
  }
  std::vector<std::string> names;
  names.reserve(known.size());
  for (const auto& [full, value] : known) names.push_back(full.substr(full.rfind('.') + 1));
  values_.yaml().Error(
      *node, fmt::format("{} = {}: there is no such {}", map.PathOf(key), Describe(*node), key),
      DidYouMean(*name, names));
  return std::nullopt;
}

bool BeamReader::ReadBeam(const Block& block, const YamlEntry& entry, const std::string& path,
                          int body, const std::string& name) {
  YamlReader& yaml = values_.yaml();
  const YamlMap map(&yaml, entry.value.get(), path, {"from", "to", "section", "material", "z"});
  if (!map.valid()) return false;
  if (!map.Has("from") && !map.Has("to")) (void)map.Required("to");
  const auto from = names_.PointOn(block, map, "from", body);
  const auto to = names_.PointOn(block, map, "to", body);
  const auto section = Described(block, map, "section", sections_);
  const auto material = Described(block, map, "material", materials_);
  if (!from || !to) return false;
  const double length = (*to - *from).norm();
  if (length < 1e-9) {
    yaml.Error(entry, fmt::format("{}: its ends are the same point", path),
               "a beam needs a length; leave it out where a pose makes it vanish");
    return false;
  }
  if (!section || !material) return false;
  const auto R = Axes(block, map, (*to - *from) / length, *section);
  if (!R) return false;
  beams_.beams.push_back({.name = name,
                          .body = body,
                          .p_from = *from,
                          .p_to = *to,
                          .R_BE = *R,
                          .section = *section,
                          .youngs_modulus = material->youngs,
                          .shear_modulus = material->shear});
  beams_.places.push_back(PlaceOf(entry));
  return true;
}

// Beam axes in the body: x along the beam, z as given, made perpendicular.
std::optional<Mat3> BeamReader::Axes(const Block& block, const YamlMap& map, const Vec3& along,
                                     const Section& section) {
  constexpr double kParallel = 1e-6;  // rad
  Vec3 z = along.unitOrthogonal();
  const YamlNode* node = map.Find("z");
  if (node != nullptr) {
    const auto given = values_.Axis(block, *node, map.PathOf("z"));
    if (!given) return std::nullopt;
    z = *given - along * along.dot(*given);
    if (z.norm() < kParallel) {
      values_.yaml().Error(*node, fmt::format("{} is parallel to the beam", map.PathOf("z")),
                           "z is across the beam: the direction of the section's z axis in the "
                           "body");
      return std::nullopt;
    }
    z.normalize();
  } else if (std::abs(section.I_y - section.I_z) > 1e-12 * (section.I_y + section.I_z)) {
    values_.yaml().Error(
        *map.node(), fmt::format("{}: 'z' is missing", map.path()),
        "a section with I_y other than I_z needs the direction of its z axis in the body");
    return std::nullopt;
  }
  Mat3 R;
  R << along, z.cross(along), z;
  return R;
}

}  // namespace mbv::internal

namespace mbv {
namespace {

using internal::Block;

// The stages find things in their own order; findings are shown from the top.
Diagnostics InFileOrder(const Diagnostics& diagnostics) {
  std::vector<Finding> findings = diagnostics.findings();
  std::stable_sort(findings.begin(), findings.end(), [](const Finding& a, const Finding& b) {
    const bool a_placed = a.line > 0, b_placed = b.line > 0;
    if (a_placed != b_placed) return a_placed;
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  Diagnostics sorted;
  for (Finding& finding : findings) sorted.Add(std::move(finding));
  return sorted;
}

// Places in a generated model file.
Diagnostics WithoutPlaces(const Diagnostics& diagnostics) {
  Diagnostics result;
  for (Finding finding : diagnostics.findings()) {
    finding.line = finding.column = 0;
    result.Add(std::move(finding));
  }
  return result;
}

// How the loops of a geometry close where closing them found nothing to report.
class ClosedHome {
 public:
  /// Before the loops are closed.
  void Remember(const internal::ClosureRules& rules, const Mechanism& given) {
    rules_ = rules;
    given_ = {};
    for (const Body& body : given.bodies) {
      given_.bodies.push_back({.name = "",
                               .mass = body.mass,
                               .p_BoBcm_B = body.p_BoBcm_B,
                               .I_Bcm_B = body.I_Bcm_B,
                               .frames = {},
                               .shapes = {}});
    }
    given_.joints = given.joints;
    given_.drives = given.drives;
    given_.prescribed = given.prescribed;
    given_.outputs = given.outputs;
    given_.couplings = given.couplings;
    given_.tree_joints = given.tree_joints;
    given_.tree_reversed = given.tree_reversed;
    joints_.clear();
  }
  /// Afterwards.
  void Keep(const Mechanism& closed) {
    joints_ = closed.joints;
    X_WB_home_ = closed.X_WB_home;
  }
  /// True, and the mechanism is closed, where its geometry is that of the last one.
  bool Take(const internal::ClosureRules& rules, Mechanism* mechanism) const {
    const bool same = !joints_.empty() && rules_.tolerance_m == rules.tolerance_m &&
                      rules_.assembly == rules.assembly && rules_.guessed == rules.guessed &&
                      HaveSameGeometry(given_, *mechanism);
    if (!same) return false;
    mechanism->joints = joints_;
    mechanism->X_WB_home = X_WB_home_;
    return true;
  }

 private:
  internal::ClosureRules rules_;
  Mechanism given_;  // without what has no influence
  std::vector<Joint> joints_;
  std::vector<Pose> X_WB_home_;
};

// What later loads of a document with other numbers take over.
struct LoadMemory {
  YamlNodePtr root;
  std::string file;
  internal::ParameterTexts texts;
  internal::ItemMemory items;
  ClosedHome home;
};

// Of the document that this thread loaded last; null where documents are not kept, and of robots,
// whose files are read each time.
LoadMemory* MemoryOf(const std::string& text, const std::string& file, const LoadOptions& options) {
  thread_local LoadMemory memory;
  const YamlNodePtr root = ParsedDocuments::Find(text);
  const bool robot = IsRobotFile(file) || (root != nullptr && root->Find("urdf") != nullptr);
  if (root == nullptr || robot || !options.literals.empty() || !options.plants.empty()) {
    return nullptr;
  }
  if (memory.root != root || memory.file != file) {
    memory = {.root = root, .file = file, .texts = {}, .items = {}, .home = {}};
  }
  return &memory;
}

// One model file on its way to a mechanism: what every stage reads with, nothing that it reads.
struct Reading {
  const LoadOptions& options;
  LoadMemory* memory = nullptr;  // null: nothing is taken over
  bool bare_urdf = false;        // the text stands for a URDF file
  PrintedRounding printed;
  YamlReader yaml;
  Diagnostics others;  // findings of other files: overrides, URDF, parameters
  internal::Literals literals;
  std::vector<ModelCaveat> caveats;
};

// What the sections of a model give.
struct ModelSections {
  internal::ModelHead head;
  std::vector<Parameter> parameters;
  internal::ModelBodies bodies;
  internal::ModelJoints joints;
  internal::SignalPlaces signals;
  std::vector<Drive> drives;
  std::vector<Prescribed> prescribed;
  std::vector<Output> outputs;
  std::vector<SpringDamper> springs;
  std::vector<Coupling> couplings;
  std::vector<Motor> motors;
  std::optional<DcLink> dc_link;
  std::vector<Bushing> bushings;
  std::vector<ForceElement> elements;
  internal::ModelBeams beams;
  std::vector<internal::ContactPlan> contacts;
  internal::UrdfSection urdf;
};

// Bodies with all their frames.
template <typename EachBlock>
void ReadBodies(const EachBlock& each_block, const internal::BodyNames& names,
                internal::ModelValues* values, internal::UrdfReader* urdf, ModelSections* sections,
                Diagnostics* others) {
  internal::FrameReader frames(values, &sections->bodies);
  internal::BodyReader bodies(values, &frames, &sections->bodies);
  each_block([&](const Block& block) {
    if (block.is_model()) {
      frames.ReadWorld(block);
      if (const YamlNode* node = block.Section("urdf")) {
        sections->urdf = urdf->Read(block, *node,
                                    {.bodies = &sections->bodies,
                                     .joints = &sections->joints,
                                     .places = &sections->signals,
                                     .drives = &sections->drives,
                                     .couplings = &sections->couplings,
                                     .elements = &sections->elements});
      }
    }
    bodies.Read(block);
  });
  each_block([&](const Block& block) { frames.ReadAttached(block, names); });
  internal::ShapeReader shapes(values, names, &sections->bodies);
  each_block([&](const Block& block) { shapes.Read(block); });
  const Finding place{
      .severity = Severity::kWarning, .file = values->yaml().file(), .message = {}, .hint = {}};
  internal::LoadMeshes(std::filesystem::path(place.file).parent_path(), place,
                       &sections->bodies.bodies, others);
}

// What is driven and watched, springs and couplings.
template <typename EachBlock>
void ReadSignals(const EachBlock& each_block, const internal::BodyNames& names,
                 internal::ModelValues* values, ModelSections* s) {
  YamlReader* yaml = &values->yaml();
  internal::DriveReader drives(values, names, s->joints, &s->signals, &s->drives);
  each_block([&](const Block& block) { drives.Read(block); });
  each_block([&](const Block& block) {
    internal::ReadPrescribed(block, s->joints, yaml, &s->signals, &s->prescribed);
  });
  each_block([&](const Block& block) {
    internal::ReadOutputs(block, names, yaml, &s->signals, &s->outputs);
  });
  each_block([&](const Block& block) { internal::ReadSprings(block, names, values, &s->springs); });
  internal::CouplingReader couplings(values, s->joints, &s->signals, &s->couplings);
  each_block([&](const Block& block) { couplings.Read(block); });
  couplings.TakeScrews();
}

template <typename EachBlock>
void ReadElastic(const EachBlock& each_block, const internal::BodyNames& names,
                 internal::ModelValues* values, ModelSections* s) {
  internal::Materials materials;
  internal::Sections sections;
  each_block([&](const Block& block) { internal::ReadMaterials(block, values, &materials); });
  each_block([&](const Block& block) { internal::ReadSections(block, values, &sections); });
  internal::BeamReader beams(values, names, s->bodies, materials, sections, &s->beams);
  each_block([&](const Block& block) { beams.Read(block); });
}

// No witness reads a motor's numbers, so mutate does not perturb them.
void ReadMotors(const Block& model, YamlReader* yaml, ModelSections* s) {
  const std::map<std::string, double> none;
  internal::Literals unperturbed(none);
  internal::ModelValues values(yaml, &unperturbed);
  internal::ReadMotors(model, s->drives, s->joints.joints, &values, &s->motors);
  s->dc_link = internal::ReadDcLink(model, &values);
}

// Of the file, then those of --plant, each with findings of its own. What the ground bears is not
// perturbed, as motors are not: no witness reads it.
template <typename EachBlock>
void ReadContacts(const EachBlock& each_block, const Block& model, const internal::BodyNames& names,
                  internal::ModelValues* values, Reading* reading, ModelSections* s) {
  const auto& holding = reading->options.holding;
  const std::map<std::string, double> none;
  internal::Literals unperturbed(none);
  internal::ModelValues judged(&reading->yaml, &unperturbed);
  internal::ContactReader contacts(values, &judged, names, holding, &s->joints, &s->contacts);
  each_block([&](const Block& block) { contacts.Read(block); });
  for (const std::string& plant : reading->options.plants) {
    YamlReader yaml("--plant " + plant);
    internal::ModelValues own(&yaml, &reading->literals);
    const internal::BodyNames own_names(s->bodies, &own);
    internal::ContactReader(&own, &own, own_names, holding, &s->joints, &s->contacts)
        .ReadOption(model, plant);
    reading->others.Append(yaml.diagnostics());
  }
}

// Empty after a finding that leaves nothing to read.
std::optional<ModelSections> ReadModel(const YamlNode& root, Reading* reading) {
  YamlReader& yaml = reading->yaml;
  const YamlMap file(&yaml, &root, "", internal::kModelKeys);
  if (!file.valid()) return {};
  ModelSections s;
  internal::ModelValues values(&yaml, &reading->literals);
  internal::ModelBlocks blocks(&root);
  internal::ParameterReader parameters(
      reading->options, &yaml, &reading->others,
      reading->memory == nullptr ? nullptr : &reading->memory->texts);
  s.head = internal::ReadTitle(file, &yaml);
  parameters.ReadModel(blocks.model(), file);
  internal::ReadSurroundings(blocks.model(), file, reading->options.gravity_W, &values, &s.head);
  if (!root.is_map()) return {};
  internal::InstanceReader(root, &values, &parameters, &blocks).Expand(blocks.model());
  internal::ExpandLegs(&values, &blocks);
  parameters.CheckOverrides();
  s.parameters = parameters.Take();
  if (reading->memory != nullptr) {
    reading->memory->items.Begin(s.parameters, s.bodies.bodies);
    values.Remember(&reading->memory->items);
  }

  // Each stage over all blocks, so that every name it refers to is there.
  const auto each_block = [&](const auto& stage) {
    for (const Block& block : blocks.blocks) {
      yaml.SetNote(block.Note());
      stage(block);
    }
    yaml.SetNote("");
  };
  const internal::BodyNames names(s.bodies, &values);
  internal::UrdfReader urdf(reading->bare_urdf, &values, &reading->literals, &reading->others);
  ReadBodies(each_block, names, &values, &urdf, &s, &reading->others);
  // A URDF file may state gravity; the model file's word and the caller's go before it.
  if (s.urdf.gravity_W && root.Find("gravity") == nullptr && !reading->options.gravity_W) {
    s.head.gravity_W = *s.urdf.gravity_W;
    const double g = s.head.gravity_W.norm();
    if (g > 0.0 && root.Find("up") == nullptr) s.head.up_W = -s.head.gravity_W / g;
  }
  internal::JointReader joints(&values, names, s.bodies, &s.joints);
  each_block([&](const Block& block) { joints.Read(block); });
  ReadSignals(each_block, names, &values, &s);
  ReadElastic(each_block, names, &values, &s);
  urdf.HoldBase(s.urdf.root, {.held = reading->options.base, .free = reading->options.free_base},
                s.bodies, &s.joints);
  ReadContacts(each_block, blocks.model(), names, &values, reading, &s);
  internal::OrderDrives(root, &yaml, &s.drives);
  internal::ReadSymbols(root, &yaml, &s.drives);
  ReadMotors(blocks.model(), &yaml, &s);
  internal::ElementReader elements(&values,
                                   {.names = names,
                                    .joints = s.joints,
                                    .drives = s.drives,
                                    .couplings = s.couplings,
                                    .springs = s.springs},
                                   &s.bushings, &s.elements);
  each_block([&](const Block& block) { elements.Read(block); });
  s.signals.Check(&yaml);
  internal::CheckDrivenOnce(s.drives, s.prescribed, s.joints.joints, s.signals, &yaml);
  return s;
}

// The mechanism that the sections describe; their places stay.
Mechanism Assembled(const std::string& file, ModelSections* s) {
  Mechanism mechanism;
  mechanism.name = std::move(s->head.name);
  mechanism.file = file;
  mechanism.description = std::move(s->head.description);
  mechanism.gravity_W = s->head.gravity_W;
  mechanism.up_W = s->head.up_W;
  mechanism.parameters = std::move(s->parameters);
  mechanism.bodies = std::move(s->bodies.bodies);
  mechanism.joints = std::move(s->joints.joints);
  mechanism.drives = std::move(s->drives);
  mechanism.prescribed = std::move(s->prescribed);
  mechanism.outputs = std::move(s->outputs);
  mechanism.springs = std::move(s->springs);
  mechanism.couplings = std::move(s->couplings);
  mechanism.motors = std::move(s->motors);
  mechanism.dc_link = s->dc_link;
  mechanism.bushings = std::move(s->bushings);
  mechanism.elements = std::move(s->elements);
  mechanism.beams = std::move(s->beams.beams);
  return mechanism;
}

// Checks the whole and solves its home pose.
void Check(const ModelSections& s, Reading* reading, Mechanism* mechanism) {
  const internal::ModelPlaces places{.bodies = s.bodies.places,
                                     .joints = s.joints.places,
                                     .beams = s.beams.places,
                                     .signals = s.signals,
                                     .urdf_joints = s.urdf.joints};
  internal::ModelReport report(places, &reading->yaml, &reading->others, &reading->caveats);
  const bool is_robot = IsRobotFile(reading->yaml.file());
  internal::CheckMasses(*mechanism,
                        s.head.impossible_inertia_allowed ? internal::Impossible::kAllowed
                        : is_robot                        ? internal::Impossible::kOfRobot
                                                          : internal::Impossible::kRefused,
                        &report);
  if (s.beams.good) internal::CheckBeams(*mechanism, &report);
  // With a broken joint, findings about the graph would only be its consequences; with a broken
  // number, those about the loops.
  for (Joint& joint : mechanism->joints) {
    const auto& guesses = reading->options.guesses;
    if (const auto at = guesses.find(joint.name); at != guesses.end()) joint.guess = at->second;
  }
  if (!s.joints.good || !internal::CheckTree(s.joints.hints, mechanism, &report)) return;
  if (report.has_errors()) return;
  const double by_option_m = reading->options.closure_tolerance_m;
  const internal::ClosureRules rules{
      .tolerance_m = std::isfinite(by_option_m) ? by_option_m : s.head.closure_tolerance_m,
      .printed = std::isfinite(by_option_m) ? PrintedRounding{} : reading->printed,
      .bare_urdf = reading->bare_urdf,
      .is_robot = is_robot,
      .assembly = reading->options.assembly,
      .guessed = s.joints.guessed};
  ClosedHome* home = reading->memory == nullptr ? nullptr : &reading->memory->home;
  const bool known = home != nullptr && home->Take(rules, mechanism);
  const size_t findings = report.findings();
  if (!known) {
    if (home != nullptr) home->Remember(rules, *mechanism);
    internal::CloseLoops(rules, mechanism, &report);
    if (report.has_own_errors()) return;
  }
  const bool closed = report.findings() == findings;
  internal::CheckHome(*mechanism, &report);
  if (!known) {
    const size_t before = report.findings();
    internal::CheckIsostaticRule(*mechanism, &report);
    if (home != nullptr && closed && report.findings() == before) home->Keep(*mechanism);
  }
  internal::CheckPlausible(*mechanism, &report);
  for (const internal::ContactFinding& finding : internal::PlantContacts(s.contacts, mechanism)) {
    report.At(finding.place, Severity::kError, finding.message, finding.hint);
  }
}

// What was found, in the order of the file.
Diagnostics FindingsOf(const Reading& reading) {
  const Diagnostics& own = reading.yaml.diagnostics();
  Diagnostics findings;
  findings.Append(InFileOrder(reading.bare_urdf ? WithoutPlaces(own) : own));
  findings.Append(reading.others);
  return findings;
}

Reading ReadingOf(const std::string& file, const LoadOptions& options) {
  return {.options = options,
          .bare_urdf = internal::IsUrdfFile(file),
          .printed = options.printed,
          .yaml = YamlReader(file),
          .others = {},
          .literals = internal::Literals(options.literals),
          .caveats = {}};
}

// The model file that a text is or, of a URDF file, stands for.
std::string ModelFileText(const std::string& text, const std::string& file) {
  return internal::IsUrdfFile(file) ? internal::UrdfModelText(file, text) : text;
}

LoadResult LoadFrom(const YamlNodePtr& root, Reading reading) {
  LoadResult result;
  std::optional<Mechanism> mechanism;
  if (auto sections = root == nullptr ? std::nullopt : ReadModel(*root, &reading)) {
    for (const auto* more : {&sections->head.left_out, &sections->urdf.left_out}) {
      reading.caveats.insert(reading.caveats.end(), more->begin(), more->end());
    }
    mechanism = Assembled(reading.yaml.file(), &*sections);
    Check(*sections, &reading, &*mechanism);
    AddMotorsOfJoints(sections->urdf.motors, &*mechanism);
    result.motors_of_joints = std::move(sections->urdf.motors);
  }
  result.diagnostics = FindingsOf(reading);
  result.literals = reading.literals.Take();
  result.caveats = std::move(reading.caveats);
  if (!result.diagnostics.has_errors()) result.mechanism = std::move(mechanism);
  return result;
}

}  // namespace

void AddMotorsOfJoints(const std::map<std::string, Motor>& motors, Mechanism* mechanism) {
  for (size_t d = 0; d < mechanism->drives.size(); ++d) {
    const auto drive = static_cast<int>(d);
    const auto* on = std::get_if<JointDrive>(&mechanism->drives[d].kind);
    if (on == nullptr || std::ranges::count(mechanism->motors, drive, &Motor::drive) > 0) continue;
    const Joint& joint = mechanism->joints[static_cast<size_t>(on->joint)];
    const auto motor = motors.find(joint.name);
    if (motor == motors.end() || DofsOf(joint.kind) != 1) continue;
    mechanism->motors.push_back(motor->second);
    mechanism->motors.back().drive = drive;
  }
}

bool IsRobotFile(const std::string& file) {
  return std::ranges::any_of(std::array{".urdf", ".xml", ".sdf", ".xacro"},
                             [&](const char* ending) { return file.ends_with(ending); });
}

std::string CompletedModel(const std::string& file) {
  std::string companion = internal::IsUrdfFile(file) ? UrdfCompanionPath(file) : "";
  std::error_code error;
  return std::filesystem::is_regular_file(companion, error) ? companion : file;
}

std::string XacroHint(const std::string& file) {
  const std::string bare = file.substr(0, file.size() - std::string_view(".xacro").size());
  return fmt::format(
      "expand it first: xacro {} > {}", ShellWord(file),
      ShellWord(bare.ends_with(".urdf") || bare.ends_with(".sdf") ? bare : bare + ".urdf"));
}

LoadResult LoadModelText(const std::string& text, const std::string& file,
                         const LoadOptions& options) {
  if (LoadMemory* memory = MemoryOf(text, file, options)) {
    Reading reading = ReadingOf(file, options);
    reading.memory = memory;
    LoadResult loaded = LoadFrom(memory->root, std::move(reading));
    if (loaded.mechanism) return loaded;
    *memory = {};  // what was read belongs to two loads; the findings are those of a new one
  }
  Reading reading = ReadingOf(file, options);
  if (reading.bare_urdf) reading.printed = RoundingOf(text);
  const YamlNodePtr root = reading.yaml.Parse(ModelFileText(text, file));
  return LoadFrom(root, std::move(reading));
}

LoadedBodies LoadBodiesText(const std::string& text, const std::string& file) {
  const LoadOptions options;
  Reading reading = ReadingOf(file, options);
  const YamlNodePtr root = reading.yaml.Parse(ModelFileText(text, file));
  auto sections = root == nullptr ? std::nullopt : ReadModel(*root, &reading);
  LoadedBodies loaded{.bodies = {}, .diagnostics = FindingsOf(reading)};
  if (sections && !loaded.diagnostics.has_errors()) loaded.bodies = sections->bodies.bodies;
  return loaded;
}

LoadedBodies LoadBodies(const std::string& file) {
  YamlReader reader(file);
  const auto text = reader.ReadFile();
  if (!text) return {.bodies = {}, .diagnostics = reader.diagnostics()};
  return LoadBodiesText(*text, file);
}

LoadResult LoadModel(const std::string& file, const LoadOptions& options) {
  YamlReader reader(file);
  const auto text = reader.ReadFile();
  if (!text) {
    return {.mechanism = {}, .diagnostics = reader.diagnostics(), .literals = {}, .caveats = {}};
  }
  return LoadModelText(*text, file, options);
}

}  // namespace mbv
