#include "model_file/model_contacts.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/text.h"

namespace mbv::internal {
namespace {

const std::vector<std::string> kContactKeys = {
    "on",    "at",       "kind",    "to",         "normal",   "axis",    "length",    "length_mm",
    "width", "width_mm", "outline", "outline_mm", "friction", "torsion", "torsion_mm"};
const std::vector<std::string> kContactWords = {"point", "line", "sole"};  // as Contact::Kind

JointKind JointOf(Contact::Kind kind) {
  switch (kind) {
    case Contact::Kind::kPoint:
      return JointKind::kSpherical;
    case Contact::Kind::kLine:
      return JointKind::kRevolute;
    case Contact::Kind::kSole:
      return JointKind::kFixed;
  }
  return JointKind::kFixed;
}

Joint JointOf(const ContactPlan& plan) {
  Joint joint;
  joint.name = plan.contact.name;
  joint.kind = JointOf(plan.contact.kind);
  joint.axis = Vec3::UnitX();
  joint.child = plan.foot;
  return joint;
}

std::vector<Eigen::Vector2d> Rectangle(double length, double width) {
  const double a = 0.5 * length, b = 0.5 * width;
  return {{-a, -b}, {a, -b}, {a, b}, {-a, b}};
}

// Axes of a frame whose z is n and whose x is as near to `along` as it may be; empty where that
// points into the ground.
std::optional<Mat3> GroundAxes(const Vec3& n, const Vec3& along) {
  constexpr double kSteep = 0.5;  // of the length that lies in the ground
  const Vec3 flat = along - n * n.dot(along);
  if (flat.norm() < kSteep) return std::nullopt;
  Mat3 R;
  R.col(0) = flat.normalized();
  R.col(2) = n;
  R.col(1) = n.cross(R.col(0));
  return R;
}

}  // namespace

void ContactReader::Read(const Block& block) {
  const std::string section = block.PathOf("contacts");
  for (const YamlEntry& entry : block.Entries("contacts", &values_.yaml())) {
    if (!IsNewName(entry, section, &values_.yaml())) continue;
    ReadContact(block, block.prefix + entry.key, JoinPath(section, entry.key), *entry.value,
                PlaceOf(entry));
  }
}

void ContactReader::ReadOption(const Block& model, const std::string& text) {
  // "BODY:KIND@x,y,z" is short for what a file says.
  std::string whole = text;
  if (!text.starts_with("{")) {
    const size_t at = text.rfind('@'), colon = text.rfind(':', at);
    whole = fmt::format("{{on: {}", text.substr(0, std::min(at, colon)));
    if (colon != std::string::npos) {
      whole += ", kind: " + text.substr(colon + 1, at == std::string::npos ? at : at - colon - 1);
    }
    if (at != std::string::npos) whole += fmt::format(", at: [{}]", text.substr(at + 1));
    whole += "}";
  }
  YamlReader& yaml = values_.yaml();
  const YamlNodePtr node = yaml.Parse(whole);
  if (node == nullptr) return;
  const YamlNode* on = node->Find("on");
  std::string name = on != nullptr && on->is_scalar() ? on->text : "contact";
  std::ranges::replace(name, '.', '_');
  ReadContact(model, name + "_contact", "contact", *node, {});
}

void ContactReader::ReadContact(const Block& block, const std::string& name,
                                const std::string& path, const YamlNode& node, Place place) {
  YamlReader& yaml = values_.yaml();
  if (!HasRoom(node, plans_.size(), kMaxItems, "contacts", &yaml)) return;
  const YamlMap map(&yaml, &node, path, kContactKeys);
  if (!map.valid()) return;
  const auto taken = [&](const ContactPlan& plan) { return plan.contact.name == name; };
  if (joints_.Find(name) >= 0 || std::ranges::any_of(plans_, taken)) {
    yaml.Error(node, fmt::format("{}: there is a joint '{}' already", path, name),
               "a contact that holds is a joint of its own name");
    return;
  }
  ContactPlan plan{.contact = {.name = name, .outline = {}}, .ground = {}, .normal_W = {}};
  plan.place = place;
  bool good = true;
  if (const YamlNode* kind = map.Find("kind")) {
    const auto choice = yaml.Choice(*kind, map.PathOf("kind"), kContactWords);
    good = choice.has_value();
    if (choice) plan.contact.kind = static_cast<Contact::Kind>(*choice);
  }
  const YamlNode* on = map.Required("on");
  const auto foot = on ? names_.Frame(block, *on, map.PathOf("on")) : std::nullopt;
  good = foot && good;
  if (foot) {
    plan.foot = foot->body;
    plan.X_BM = foot->X_BF;
    if (foot->body == 0) {
      yaml.Error(*on, fmt::format("{} is the world", map.PathOf("on")),
                 "on: names the foot; to: names its place on the ground");
      good = false;
    }
  }
  if (const YamlNode* at = map.Find("at")) {
    const auto p_M = values_.Vector(block, *at, map.PathOf("at"));
    good = p_M && good;
    if (p_M) plan.X_BM.translation() = plan.X_BM * *p_M;
  }
  good = ReadGround(block, map, &plan) && good;
  good = ReadShape(block, map, &plan.contact) && good;
  good = ReadFriction(block, map, &plan.contact) && good;
  if (!good) {
    joints_.refused.insert(name);
    return;
  }
  plan.holds = !holding_ || Contains(*holding_, name);
  if (plan.holds && plan.ground) {
    Joint joint = JointOf(plan);
    joint.parent = plan.ground->body;
    joint.X_PF = plan.ground->X_BF;
    joint.X_CM = plan.X_BM;
    plan.contact.joint = static_cast<int>(joints_.joints.size());
    joints_.Add(std::move(joint), place, true);
  }
  plans_.push_back(std::move(plan));
}

bool ContactReader::ReadGround(const Block& block, const YamlMap& map, ContactPlan* plan) {
  YamlReader& yaml = values_.yaml();
  bool good = true;
  if (const YamlNode* to = map.Find("to")) {
    plan->ground = names_.Frame(block, *to, map.PathOf("to"));
    if (!plan->ground) return false;
    if (plan->ground->body == plan->foot) {
      yaml.Error(*to, fmt::format("{} is on the foot itself", map.PathOf("to")),
                 "to: a frame of the ground, world.FRAME, whose z axis is the ground's normal");
      good = false;
    }
    for (const char* key : {"normal", "axis"}) {
      if (const YamlNode* node = map.Find(key)) {
        yaml.Error(*node, fmt::format("{}: the frame of 'to' has it: z is the normal, x the axis",
                                      map.PathOf(key)));
        good = false;
      }
    }
    return good;
  }
  if (const YamlNode* normal = map.Find("normal")) {
    plan->normal_W = values_.Axis(block, *normal, map.PathOf("normal"));
    good = plan->normal_W.has_value();
  }
  if (const YamlNode* axis = map.Find("axis")) {
    const auto along = values_.Axis(block, *axis, map.PathOf("axis"));
    good = along && good;
    if (along) plan->along_M = *along;
    plan->along_stated = true;
  }
  return good;
}

// What touches the ground.
bool ContactReader::ReadShape(const Block& block, const YamlMap& map, Contact* contact) {
  YamlReader& yaml = values_.yaml();
  const auto size = [&](const char* key) {
    const YamlMap::InUnit given = map.FindInUnit(key, {kPlain, kMm});
    if (given.node == nullptr) return std::optional<double>();
    const auto value = judged_.Number(block, *given.node, map.PathOf(given.key), given.unit);
    if (!value || *value > 0.0) return value ? value : std::optional(kNan);
    yaml.Error(*given.node,
               fmt::format("{} = {} violates {} > 0", map.PathOf(given.key), *value, key));
    return std::optional(kNan);
  };
  const auto length = size("length"), width = size("width");
  const YamlMap::InUnit outline = map.FindInUnit("outline", {kPlain, kMm});
  const auto refuse = [&](const char* key, const char* why) {
    for (const char* suffix : {"", "_mm"}) {
      if (const YamlNode* node = map.Find(std::string(key) + suffix)) {
        yaml.Error(*node, fmt::format("{}: {}", map.PathOf(key), why));
      }
    }
  };
  if (contact->kind != Contact::Kind::kSole && (width || outline.node != nullptr)) {
    refuse("width", "only a sole has one");
    refuse("outline", "only a sole has one");
    return false;
  }
  if (contact->kind == Contact::Kind::kPoint && length) {
    refuse("length", "a point has none");
    return false;
  }
  if ((length && std::isnan(*length)) || (width && std::isnan(*width))) return false;
  if (contact->kind == Contact::Kind::kLine) {
    if (length) contact->outline = {{-0.5 * *length, 0.0}, {0.5 * *length, 0.0}};
    return true;
  }
  if (length.has_value() != width.has_value() || (length && outline.node != nullptr)) {
    yaml.Error(*map.node(),
               fmt::format("{}: a sole has a length and a width, or an outline", map.path()),
               "length is along x, width along y; outline: [[x, y], …] in the contact's frame");
    return false;
  }
  if (length) contact->outline = Rectangle(*length, *width);
  if (outline.node == nullptr) return true;
  const std::string path = map.PathOf(outline.key);
  const auto items = yaml.Items(*outline.node, path);
  if (!items) return false;
  std::vector<Eigen::Vector2d> points;
  for (size_t k = 0; k < items->size(); ++k) {
    const std::string of_point = fmt::format("{}[{}]", path, k);
    const auto pair = yaml.Items(*(*items)[k], of_point, 2);
    if (!pair) return false;
    const auto x = judged_.Number(block, *(*pair)[0], of_point + "[0]", outline.unit);
    const auto y = judged_.Number(block, *(*pair)[1], of_point + "[1]", outline.unit);
    if (!x || !y) return false;
    points.emplace_back(*x, *y);
  }
  if (points.size() >= 3) contact->outline = ConvexHull(std::move(points));
  if (contact->outline.size() >= 3) return true;
  yaml.Error(*outline.node, fmt::format("{} encloses no area", path),
             "three corners at least: [[x, y], [x, y], [x, y]]");
  return false;
}

bool ContactReader::ReadFriction(const Block& block, const YamlMap& map, Contact* contact) {
  YamlReader& yaml = values_.yaml();
  bool good = true;
  const auto read = [&](const char* key, std::initializer_list<UnitSuffix> units, double* number) {
    const YamlMap::InUnit given = map.FindInUnit(key, units);
    if (given.node == nullptr) return;
    const auto value = judged_.Number(block, *given.node, map.PathOf(given.key), given.unit);
    if (value && *value >= 0.0) {
      *number = *value;
      return;
    }
    good = false;
    if (!value) return;
    yaml.Error(*given.node,
               fmt::format("{} = {} violates {} >= 0", map.PathOf(given.key), *value, key));
  };
  read("friction", {kPlain}, &contact->friction);
  read("torsion", {kPlain, kMm}, &contact->torsion);
  if (contact->kind != Contact::Kind::kPoint || std::isnan(contact->torsion)) return good;
  yaml.Error(*map.FindInUnit("torsion", {kPlain, kMm}).node,
             fmt::format("{}: a point bears no moment", map.PathOf("torsion")));
  return false;
}

std::vector<ContactFinding> PlantContacts(const std::vector<ContactPlan>& plans,
                                          Mechanism* mechanism) {
  std::vector<ContactFinding> findings;
  for (const ContactPlan& plan : plans) {
    Contact contact = plan.contact;
    if (plan.holds && !plan.ground) {
      const Pose X_WM = mechanism->X_WB_home[static_cast<size_t>(plan.foot)] * plan.X_BM;
      const Vec3 n_W = plan.normal_W.value_or(mechanism->up_W);
      auto R_WF = GroundAxes(n_W, X_WM.linear() * plan.along_M);
      if (!R_WF && !plan.along_stated) {
        // A frame that looks up with its x axis: the next one.
        R_WF = GroundAxes(n_W, X_WM.linear() * Vec3::UnitY());
      }
      if (!R_WF) {
        findings.push_back(
            {plan.place,
             fmt::format("contact '{}': its axis points into the ground at home", contact.name),
             "axis: the direction in the foot's frame that lies along the ground"});
        continue;
      }
      Joint joint = JointOf(plan);
      joint.X_PF.linear() = *R_WF;
      joint.X_PF.translation() = X_WM.translation();
      joint.X_CM = mechanism->X_WB_home[static_cast<size_t>(plan.foot)].inverse() * joint.X_PF;
      joint.closure = true;
      contact.joint = static_cast<int>(mechanism->joints.size());
      mechanism->joints.push_back(std::move(joint));
    }
    mechanism->contacts.push_back(std::move(contact));
  }
  return findings;
}

std::string ContactText(const Contact& contact) {
  std::string text = fmt::format("kind: {}", WordOf(contact.kind));
  if (contact.kind == Contact::Kind::kLine && !contact.outline.empty()) {
    text += fmt::format(", length: {}", contact.outline[1].x() - contact.outline[0].x());
  }
  if (contact.kind == Contact::Kind::kSole && !contact.outline.empty()) {
    text += ", outline: [";
    for (size_t k = 0; k < contact.outline.size(); ++k) {
      text += fmt::format("{}[{}, {}]", k == 0 ? "" : ", ", contact.outline[k].x(),
                          contact.outline[k].y());
    }
    text += "]";
  }
  if (std::isfinite(contact.friction)) text += fmt::format(", friction: {}", contact.friction);
  if (std::isfinite(contact.torsion)) text += fmt::format(", torsion: {}", contact.torsion);
  return text;
}

}  // namespace mbv::internal
