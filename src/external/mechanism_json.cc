#include "external/mechanism_json.h"

#include <fmt/format.h>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

#include "base/diagnostics.h"
#include "base/json_document.h"
#include "base/json_text.h"
#include "base/text.h"
#include "base/types.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

Json VectorJson(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }

Json MatrixJson(const Mat3& R) {
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back(VectorJson(R.row(i).transpose()));
  return rows;
}

Json PoseJson(const Pose& X) {
  return {{"p", VectorJson(X.translation())}, {"R", MatrixJson(X.linear())}};
}

// Infinite ends are null.
Json RangeJson(const CoordinateRange& range) {
  return Json::array({Number(range.lower), Number(range.upper)});
}

class Writer {
 public:
  explicit Writer(const Mechanism& mechanism) : m_(mechanism) {}

  [[nodiscard]] Json Write() const {
    return {{"schema", kMechanismSchema},
            {"name", m_.name},
            {"description", m_.description},
            {"gravity", VectorJson(m_.gravity_W)},
            {"bodies", All(m_.bodies, &Writer::BodyJson)},
            {"joints", All(m_.joints, &Writer::JointJson)},
            {"drives", All(m_.drives, &Writer::DriveJson)},
            {"prescribed", All(m_.prescribed, &Writer::PrescribedJson)},
            {"outputs", All(m_.outputs, &Writer::OutputJson)},
            {"springs", All(m_.springs, &Writer::SpringJson)},
            {"couplings", All(m_.couplings, &Writer::CouplingJson)},
            {"bushings", All(m_.bushings, &Writer::BushingJson)},
            {"elements", All(m_.elements, &Writer::ElementJson)}};
  }

 private:
  template <typename Row>
  [[nodiscard]] Json All(const std::vector<Row>& rows,
                         Json (Writer::*write)(const Row&) const) const {
    Json list = Json::array();
    for (const Row& row : rows) list.push_back((this->*write)(row));
    return list;
  }

  [[nodiscard]] const std::string& BodyName(int body) const {
    return m_.bodies[static_cast<size_t>(body)].name;
  }
  [[nodiscard]] const Joint& JointAt(int joint) const {
    return m_.joints[static_cast<size_t>(joint)];
  }
  [[nodiscard]] Json PointJson(int body, const Vec3& p_B) const {
    return {{"body", BodyName(body)}, {"p", VectorJson(p_B)}};
  }
  [[nodiscard]] Json FrameJson(int body, const Pose& X_BF) const {
    Json frame = PoseJson(X_BF);
    frame["body"] = BodyName(body);
    return frame;
  }

  [[nodiscard]] Json BodyJson(const Body& body) const {
    const auto k = static_cast<size_t>(&body - m_.bodies.data());
    return {{"name", body.name},
            {"mass", body.mass},
            {"centre_of_mass", VectorJson(body.p_BoBcm_B)},
            {"inertia", MatrixJson(body.I_Bcm_B)},
            {"home", PoseJson(m_.X_WB_home[k])}};
  }

  [[nodiscard]] Json JointJson(const Joint& joint) const {
    Json home = Json::array(), range = Json::array();
    for (int c = 0; c < DofsOf(joint.kind); ++c) {
      home.push_back(joint.home[static_cast<size_t>(c)]);
      range.push_back(RangeJson(joint.range[static_cast<size_t>(c)]));
    }
    Json json = {{"name", joint.name},
                 {"kind", RowOf(joint.kind).word},
                 {"parent", FrameJson(joint.parent, joint.X_PF)},
                 {"child", FrameJson(joint.child, joint.X_CM)},
                 {"axis", VectorJson(joint.axis)}};
    if (joint.kind == JointKind::kUniversal) json["axis2"] = VectorJson(joint.axis2);
    json["home"] = std::move(home);
    json["range"] = std::move(range);
    if (std::isfinite(joint.max_rotation)) json["max_rotation"] = joint.max_rotation;
    json["closure"] = joint.closure;
    json["transmits"] = joint.transmits_force_only ? "force" : "all";
    return json;
  }

  [[nodiscard]] Json CoordinateJson(int joint, int coordinate) const {
    return {{"joint", JointAt(joint).name}, {"coordinate", coordinate}};
  }

  [[nodiscard]] Json DriveJson(const Drive& drive) const {
    Json json = {{"name", drive.name},
                 {"position_unit", PositionUnit(m_, drive)},
                 {"force_unit", ForceUnit(m_, drive)},
                 {"range", RangeJson(drive.range)}};
    if (const auto* on = std::get_if<JointDrive>(&drive.kind)) {
      json["on"] = CoordinateJson(on->joint, on->coordinate);
    } else {
      const auto& leg = std::get<DistanceDrive>(drive.kind);
      json["between"] =
          Json::array({PointJson(leg.body_from, leg.p_from), PointJson(leg.body_to, leg.p_to)});
    }
    return json;
  }

  [[nodiscard]] Json PrescribedJson(const Prescribed& base) const {
    return {{"name", base.name}, {"on", CoordinateJson(base.joint, 0)}};
  }

  [[nodiscard]] Json OutputJson(const Output& output) const {
    return {{"name", output.name},
            {"frame", FrameJson(output.body, output.X_BO)},
            {"reference", FrameJson(output.reference_body, output.X_RbR)}};
  }

  [[nodiscard]] Json SpringJson(const SpringDamper& spring) const {
    return {{"name", spring.name},
            {"between", Json::array({PointJson(spring.body_from, spring.p_from),
                                     PointJson(spring.body_to, spring.p_to)})},
            {"stiffness", spring.stiffness},
            {"damping", spring.damping},
            {"free_length", spring.free_length_m}};
  }

  [[nodiscard]] Json CouplingJson(const Coupling& coupling) const {
    Json terms = Json::array();
    for (const Coupling::Term& term : coupling.terms) {
      Json json = CoordinateJson(term.joint, term.coordinate);
      json["polynomial"] = term.polynomial;
      terms.push_back(std::move(json));
    }
    return {{"name", coupling.name}, {"terms", std::move(terms)}, {"constant", coupling.constant}};
  }

  [[nodiscard]] Json BushingJson(const Bushing& bushing) const {
    return {{"name", bushing.name},
            {"parent", FrameJson(bushing.parent, bushing.X_PF)},
            {"child", FrameJson(bushing.child, bushing.X_CM)}};
  }

  [[nodiscard]] Json ElementJson(const ForceElement& element) const {
    Json json = {{"name", element.name}, {"kind", WordOf(element)}};
    if (element.joint >= 0) json["on"] = CoordinateJson(element.joint, element.coordinate);
    if (element.drive >= 0) {
      json["on"] = {{"drive", m_.drives[static_cast<size_t>(element.drive)].name}};
    }
    if (element.bushing >= 0) {
      json["on"] = {{"bushing", m_.bushings[static_cast<size_t>(element.bushing)].name},
                    {"coordinate", element.coordinate}};
    }
    if (element.spring >= 0) {
      json["on"] = {{"spring", m_.springs[static_cast<size_t>(element.spring)].name}};
    }
    json["law"] = std::visit([this](const auto& law) { return LawJson(law); }, element.law);
    return json;
  }

  [[nodiscard]] Json LawJson(const DampingLaw& law) const { return {{"damping", law.damping}}; }
  [[nodiscard]] Json LawJson(const SpringLaw& law) const {
    return {{"polynomial", law.polynomial}, {"free", law.free}, {"preload", law.preload}};
  }
  [[nodiscard]] Json LawJson(const RotorLaw& law) const {
    Json json = {{"inertia", law.inertia}, {"ratio", law.ratio}};
    if (law.carrier) {
      json["carrier"] = {{"body", BodyName(law.carrier->body)},
                         {"axis", VectorJson(law.carrier->axis_B)}};
    }
    return json;
  }
  [[nodiscard]] Json LawJson(const StopLaw& law) const {
    Json json = {{"stiffness", law.stiffness},
                 {"exponent", law.exponent},
                 {"damping", law.damping},
                 {"dissipation", law.dissipation}};
    if (law.rigid()) json = {{"restitution", law.restitution}};
    if (std::isfinite(law.lower)) json["lower"] = law.lower;
    if (std::isfinite(law.upper)) json["upper"] = law.upper;
    return json;
  }
  [[nodiscard]] Json LawJson(const CurveLaw& law) const {
    Json knots = Json::array();
    for (const CurveLaw::Knot& knot : law.knots) {
      knots.push_back({{"at", knot.at},
                       {"force", knot.force},
                       {"slope_before", knot.slope_before},
                       {"slope_after", knot.slope_after}});
    }
    return {{"of", law.of_rate ? "rate" : "position"}, {"knots", std::move(knots)}};
  }
  [[nodiscard]] Json LawJson(const CurvesLaw& law) const {
    Json curves = Json::array();
    for (size_t i = 0; i < law.curves.size(); ++i) {
      curves.push_back({{"rate", law.rates[i]}, {"knots", LawJson(law.curves[i])["knots"]}});
    }
    return {{"of", "both"}, {"held", law.held}, {"curves", std::move(curves)}};
  }
  [[nodiscard]] Json LawJson(const ExpressionLaw& law) const { return {{"force", law.text}}; }
  [[nodiscard]] Json LawJson(const FrictionLaw& law) const {
    Json json = {{"coulomb", law.coulomb},
                 {"breakaway", law.breakaway},
                 {"stribeck_rate", law.stribeck_rate},
                 {"coefficient", law.coefficient},
                 {"radius", law.radius}};
    if (std::isfinite(law.length)) json["length"] = law.length;
    if (law.thrust_radius > 0.0) json["thrust_radius"] = law.thrust_radius;
    if (law.skew != 0.0) json["skew"] = law.skew;
    if (law.resists != 0) json["resists"] = law.resists > 0 ? "positive" : "negative";
    if (law.coupling >= 0) json["coupling"] = m_.couplings[static_cast<size_t>(law.coupling)].name;
    return json;
  }

  const Mechanism& m_;
};

}  // namespace

std::string MechanismJson(const Mechanism& mechanism) { return Dump(Writer(mechanism).Write()); }

namespace {

using Value = nlohmann::json;
using Path = std::vector<std::string>;

// Of rotations and unit vectors in 17 digits, and of inertias relative to their largest moment.
constexpr double kExact = 1e-9;

// "<root>", "[bodies]", "[0]" → bodies, 0.
Path PathOf(const std::vector<std::string>& context) {
  Path path;
  for (const std::string& step : context) {
    if (step.size() > 2 && step.front() == '[') path.push_back(step.substr(1, step.size() - 2));
  }
  return path;
}

// What of a document a schema's keywords refuse, in words of ours: those of mechanism.schema.json.
class SchemaExplainer {
 public:
  explicit SchemaExplainer(const Value& schema) : schema_(schema) {}

  std::vector<JsonFinding> Explain(const Value& json) const {
    std::vector<JsonFinding> findings;
    Judge(schema_, json, {}, &findings);
    return findings;
  }

 private:
  static void Add(const Path& path, std::string message, std::vector<JsonFinding>* findings,
                  std::string hint = "") {
    findings->push_back({.path = path, .message = std::move(message), .hint = std::move(hint)});
  }

  static Path Below(Path path, const std::string& step) {
    path.push_back(step);
    return path;
  }

  static bool IsOf(const std::string& type, const Value& json) {
    return type == "object"    ? json.is_object()
           : type == "array"   ? json.is_array()
           : type == "string"  ? json.is_string()
           : type == "boolean" ? json.is_boolean()
           : type == "integer" ? json.is_number_integer()
           : type == "number"  ? json.is_number()
                               : json.is_null();
  }

  // A keyword holds one type or a list of them.
  static std::vector<std::string> TypesOf(const Value& type) {
    return type.is_array() ? type.get<std::vector<std::string>>()
                           : std::vector<std::string>{type.get<std::string>()};
  }

  static std::string NameOf(const std::string& type) {
    return type == "object"    ? "an object"
           : type == "array"   ? "a list"
           : type == "string"  ? "a text"
           : type == "boolean" ? "true or false"
           : type == "integer" ? "a whole number"
           : type == "number"  ? "a number"
                               : "null";
  }

  static std::string KindOf(const Value& json) {
    for (const char* type : {"object", "array", "string", "boolean", "number"}) {
      if (IsOf(type, json)) return NameOf(type);
    }
    return "null";
  }

  void Judge(const Value& node, const Value& json, const Path& path,
             std::vector<JsonFinding>* findings) const {
    if (const auto reference = node.find("$ref"); reference != node.end()) {
      const std::string pointer = reference->get<std::string>().substr(1);
      return Judge(schema_.at(Value::json_pointer(pointer)), json, path, findings);
    }
    for (const Value& part : node.value("allOf", Value::array())) Judge(part, json, path, findings);
    if (const auto type = node.find("type"); type != node.end()) {
      const std::vector<std::string> types = TypesOf(*type);
      if (std::ranges::none_of(types, [&](const auto& each) { return IsOf(each, json); })) {
        std::string needed;
        for (const std::string& each : types)
          needed += (needed.empty() ? "" : " or ") + NameOf(each);
        return Add(path, fmt::format("is {} where {} is needed", KindOf(json), needed), findings);
      }
    }
    if (json.is_object()) JudgeObject(node, json, path, findings);
    if (json.is_array()) JudgeList(node, json, path, findings);
    JudgeValue(node, json, path, findings);
    if (const auto choice = node.find("oneOf"); choice != node.end()) {
      JudgeChoice(*choice, json, path, findings);
    }
  }

  void JudgeObject(const Value& node, const Value& json, const Path& path,
                   std::vector<JsonFinding>* findings) const {
    for (const std::string key : node.value("required", Value::array())) {
      if (!json.contains(key)) Add(path, fmt::format("has no '{}'", key), findings);
    }
    const Value properties = node.value("properties", Value::object());
    std::vector<std::string> known;
    for (const auto& [key, part] : properties.items()) known.push_back(key);
    const auto others = node.find("additionalProperties");
    for (const auto& [key, value] : json.items()) {
      if (properties.contains(key)) {
        Judge(properties.at(key), value, Below(path, key), findings);
      } else if (others != node.end() && others->is_object()) {
        Judge(*others, value, Below(path, key), findings);
      } else if (others != node.end() && *others == false) {
        Add(path, fmt::format("has the unknown key '{}'", QuotedValue(key)), findings,
            DidYouMean(key, known, "known keys: " + Joined(known)));
      }
    }
  }

  void JudgeList(const Value& node, const Value& json, const Path& path,
                 std::vector<JsonFinding>* findings) const {
    const size_t least = node.value("minItems", size_t{0}),
                 most = node.value("maxItems", json.size());
    if (json.size() < least || json.size() > most) {
      const std::string needed = least == most               ? fmt::format("{}", least)
                                 : node.contains("maxItems") ? fmt::format("{} … {}", least, most)
                                                             : fmt::format("at least {}", least);
      Add(path, fmt::format("has {} entries, needed: {}", json.size(), needed), findings);
    }
    const auto items = node.find("items");
    for (size_t i = 0; items != node.end() && i < json.size(); ++i) {
      Judge(*items, json.at(i), Below(path, std::to_string(i)), findings);
    }
  }

  static void JudgeValue(const Value& node, const Value& json, const Path& path,
                         std::vector<JsonFinding>* findings) {
    if (const auto word = node.find("const"); word != node.end() && *word != json) {
      Add(path, fmt::format("is not {}", DumpLine(*word)), findings);
    }
    if (const auto words = node.find("enum"); words != node.end()) {
      if (std::ranges::find(*words, json) == words->end()) {
        std::vector<std::string> known;
        for (const Value& each : *words)
          known.push_back(each.is_string() ? each : Value(DumpLine(each)));
        Add(path,
            fmt::format("is {}, not one of: {}", QuotedValue(DumpLine(json), 60), Joined(known)),
            findings, json.is_string() ? DidYouMean(json, known) : "");
      }
    }
    if (json.is_number()) {
      const double number = json.get<double>();
      if (number < node.value("minimum", -HUGE_VAL)) {
        Add(path,
            fmt::format("is {:g}, at least {:g} is needed", number,
                        node.at("minimum").get<double>()),
            findings);
      }
      if (number > node.value("maximum", HUGE_VAL)) {
        Add(path,
            fmt::format("is {:g}, at most {:g} is needed", number,
                        node.at("maximum").get<double>()),
            findings);
      }
    }
    if (json.is_string() &&
        json.get_ref<const std::string&>().size() < node.value("minLength", size_t{0})) {
      Add(path, "is empty", findings);
    }
  }

  // Of the alternatives, what is wrong with the one that fits best.
  void JudgeChoice(const Value& choice, const Value& json, const Path& path,
                   std::vector<JsonFinding>* findings) const {
    size_t fitting = 0;
    std::vector<JsonFinding> best;
    for (const Value& alternative : choice) {
      std::vector<JsonFinding> found;
      Judge(alternative, json, path, &found);
      fitting += found.empty() ? 1 : 0;
      if (best.empty() || found.size() < best.size()) best = std::move(found);
    }
    if (fitting > 1) Add(path, "fits more than one of its alternatives: state one", findings);
    if (fitting == 0) findings->insert(findings->end(), best.begin(), best.end());
  }

  const Value& schema_;
};

// The schema's findings: whether there are any is the library's to say, whose words are not ours.
std::vector<JsonFinding> SchemaFindings(const Value& json) {
  valijson::Schema schema;
  const Value schema_json = ParseJson<Value>(MechanismSchemaText());
  valijson::SchemaParser(valijson::SchemaParser::kDraft7)
      .populateSchema(valijson::adapters::NlohmannJsonAdapter(schema_json), schema);
  valijson::ValidationResults results;
  const bool valid = valijson::Validator(valijson::Validator::kStrongTypes)
                         .validate(schema, valijson::adapters::NlohmannJsonAdapter(json), &results);
  if (valid) return {};
  std::vector<JsonFinding> findings = SchemaExplainer(schema_json).Explain(json);
  if (!findings.empty()) return findings;
  Path deepest;
  valijson::ValidationResults::Error error;
  while (results.popError(error)) {
    if (Path path = PathOf(error.context); path.size() >= deepest.size()) deepest = std::move(path);
  }
  return {{.path = deepest, .message = "does not fit the schema"}};
}

Vec3 VectorAt(const Value& v) {
  return {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()};
}

Mat3 MatrixAt(const Value& m) {
  Mat3 matrix;
  for (int r = 0; r < 3; ++r) matrix.row(r) = VectorAt(m.at(static_cast<size_t>(r))).transpose();
  return matrix;
}

class MechanismChecker {
 public:
  explicit MechanismChecker(const Value& json) : json_(json) {}

  std::vector<JsonFinding> Check() {
    for (const char* list : {"bodies", "joints", "drives", "prescribed", "outputs", "springs",
                             "couplings", "bushings", "elements"}) {
      CollectNames(list);
    }
    CheckReferences(json_, {});
    CheckBodies();
    CheckJoints();
    CheckTree();
    return std::move(findings_);
  }

 private:
  void Add(Path path, std::string message, std::string hint = "") {
    findings_.push_back(
        {.path = std::move(path), .message = std::move(message), .hint = std::move(hint)});
  }

  void CollectNames(const std::string& list) {
    const Value& rows = json_.at(list);
    for (size_t i = 0; i < rows.size(); ++i) {
      const std::string name = rows.at(i).at("name");
      std::vector<std::string>& names = names_[list];
      if (std::find(names.begin(), names.end(), name) != names.end()) {
        Add({list, std::to_string(i), "name"}, fmt::format("'{}' is there twice", name),
            "names are ids: each is unique in its list");
      }
      names.push_back(name);
    }
  }

  // Every key that refers to a part, wherever it stands.
  void CheckReferences(const Value& at, const Path& path) {
    static const std::map<std::string, std::string> kLists = {
        {"body", "bodies"}, {"joint", "joints"}, {"drive", "drives"}, {"bushing", "bushings"}};
    if (at.is_array()) {
      for (size_t i = 0; i < at.size(); ++i) {
        CheckReferences(at.at(i), Below(path, std::to_string(i)));
      }
      return;
    }
    if (!at.is_object()) return;
    for (const auto& [key, value] : at.items()) {
      const Path here = Below(path, key);
      const auto list = kLists.find(key);
      if (list == kLists.end() || !value.is_string()) {
        CheckReferences(value, here);
        continue;
      }
      const std::vector<std::string>& names = names_[list->second];
      const std::string name = value;
      if (std::find(names.begin(), names.end(), name) != names.end()) continue;
      Add(here, fmt::format("there is no {} '{}'", key, name), DidYouMean(name, names));
    }
    if (at.contains("R")) CheckRotation(at.at("R"), Below(path, "R"));
  }

  void CheckRotation(const Value& R, const Path& path) {
    const Mat3 matrix = MatrixAt(R);
    const double off = (matrix * matrix.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff();
    if (off > kExact || matrix.determinant() < 0.0) {
      Add(path,
          fmt::format("is not a rotation: R Rᵀ − 1 is up to {:.2g}, the determinant {:.3g}", off,
                      matrix.determinant()),
          "the frame's axes are the columns of R");
    }
  }

  // Moments that a body can have: none negative, none larger than the sum of the others.
  void CheckBodies() {
    const Value& bodies = json_.at("bodies");
    for (size_t i = 0; i < bodies.size(); ++i) {
      const Mat3 I = MatrixAt(bodies.at(i).at("inertia"));
      const Path path = {"bodies", std::to_string(i), "inertia"};
      const double size = I.cwiseAbs().maxCoeff();
      if ((I - I.transpose()).cwiseAbs().maxCoeff() > kExact * size) {
        Add(path, "is not symmetric");
        continue;
      }
      const Vec3 moments = Eigen::SelfAdjointEigenSolver<Mat3>(I).eigenvalues();
      const double missing = moments[2] - moments[0] - moments[1];
      if (moments[0] < -kExact * size || missing > kExact * size) {
        Add(path,
            fmt::format("has the moments {:.6g}, {:.6g}, {:.6g} kg m2, which no body has",
                        moments[0], moments[1], moments[2]),
            "none is negative, and the largest is not above the sum of the others");
      }
    }
  }

  void CheckJoints() {
    const Value& joints = json_.at("joints");
    for (size_t i = 0; i < joints.size(); ++i) {
      const Value& joint = joints.at(i);
      const Path path = {"joints", std::to_string(i)};
      for (const char* axis : {"axis", "axis2"}) {
        if (!joint.contains(axis)) continue;
        const double length = VectorAt(joint.at(axis)).norm();
        if (std::abs(length - 1.0) <= kExact) continue;
        Add(Below(path, axis), fmt::format("has the length {:.9g} instead of 1", length));
      }
      if (joint.at("kind") == "universal" && !joint.contains("axis2")) {
        Add(path, "is universal and has no axis2");
      }
      if (joint.at("home").size() != joint.at("range").size()) {
        Add(Below(path, "range"), fmt::format("has {} ranges for {} coordinates",
                                              joint.at("range").size(), joint.at("home").size()));
      }
    }
  }

  // From the first body along the joints that close no loop every body is reached in one way.
  void CheckTree() {
    std::set<std::string> reached = {json_.at("bodies").at(0).at("name")};
    size_t joints = 0;
    for (bool more = true; more;) {
      more = false;
      for (const Value& joint : json_.at("joints")) {
        if (joint.at("closure")) continue;
        const std::string parent = joint.at("parent").at("body"),
                          child = joint.at("child").at("body");
        if (reached.contains(parent) == reached.contains(child)) continue;
        reached.insert({parent, child});
        more = true;
      }
    }
    for (const Value& joint : json_.at("joints")) joints += joint.at("closure") ? 0U : 1U;
    const Value& bodies = json_.at("bodies");
    for (size_t i = 0; i < bodies.size(); ++i) {
      const std::string name = bodies.at(i).at("name");
      if (reached.contains(name)) continue;
      Add({"bodies", std::to_string(i)},
          fmt::format("'{}' is not joined to the world by joints that close no loop", name));
    }
    if (reached.size() == bodies.size() && joints != bodies.size() - 1) {
      Add({"joints"},
          fmt::format("{} of them close no loop, where {} make a tree", joints, bodies.size() - 1),
          "mark the others as closures");
    }
  }

  static Path Below(Path path, const std::string& step) {
    path.push_back(step);
    return path;
  }

  const Value& json_;
  std::map<std::string, std::vector<std::string>> names_;
  std::vector<JsonFinding> findings_;
};

}  // namespace

std::string PathText(const std::vector<std::string>& path) {
  std::string text;
  for (const std::string& step : path) {
    const bool index = !step.empty() && step.find_first_not_of("0123456789") == std::string::npos;
    if (index) {
      text += "[" + step + "]";
    } else {
      text += (text.empty() ? "" : ".") + step;
    }
  }
  return text;
}

std::vector<JsonFinding> CheckMechanismJson(const std::string& text) {
  // Of another schema, nothing is named: it may hold what must not be shown.
  const auto document = ReadJson(text, [](const JsonValue& root) {
    const auto schema = root.json().find("schema");
    if (schema == root.json().end() || *schema != kMechanismSchema) {
      throw JsonRefusal{.key = "schema",
                        .message = fmt::format("the file is of another kind: its schema is not {}",
                                               kMechanismSchema)};
    }
    return root.json();
  });
  if (!document) {
    const JsonRefusal& why = document.refusal;
    return {{.path = why.key.empty() ? Path{} : Path{why.key},
             .message = why.message,
             .hint = why.hint,
             .line = why.line,
             .column = why.column}};
  }
  const Value& json = *document.value;
  std::vector<JsonFinding> findings = SchemaFindings(json);
  return findings.empty() ? MechanismChecker(json).Check() : findings;
}

}  // namespace mbv
