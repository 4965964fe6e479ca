#include "external/mechanism_json.h"

#include <fmt/format.h>
#include <Eigen/Dense>
#include <algorithm>
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
  [[nodiscard]] Json LawJson(const FrictionLaw& law) const {
    return {{"coulomb", law.coulomb},
            {"breakaway", law.breakaway},
            {"stribeck_rate", law.stribeck_rate},
            {"coefficient", law.coefficient},
            {"radius", law.radius}};
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

bool IsBelow(const Path& path, const Path& above) {
  return path.size() > above.size() && std::equal(above.begin(), above.end(), path.begin());
}

// The schema's errors without those that only say that something below them is wrong.
std::vector<JsonFinding> SchemaFindings(const Value& json) {
  valijson::Schema schema;
  const Value schema_json = ParseJson<Value>(MechanismSchemaText());
  valijson::SchemaParser(valijson::SchemaParser::kDraft7)
      .populateSchema(valijson::adapters::NlohmannJsonAdapter(schema_json), schema);
  valijson::ValidationResults results;
  valijson::Validator(valijson::Validator::kStrongTypes)
      .validate(schema, valijson::adapters::NlohmannJsonAdapter(json), &results);
  std::vector<JsonFinding> all, deepest;
  valijson::ValidationResults::Error error;
  while (results.popError(error)) {
    all.push_back({.path = PathOf(error.context), .message = error.description, .hint = {}});
  }
  for (const JsonFinding& finding : all) {
    const bool covered = std::any_of(all.begin(), all.end(), [&](const JsonFinding& other) {
      return IsBelow(other.path, finding.path);
    });
    const bool reported =
        std::any_of(deepest.begin(), deepest.end(),
                    [&](const JsonFinding& other) { return other.path == finding.path; });
    if (!covered && !reported) deepest.push_back(finding);
  }
  return deepest;
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
          fmt::format("is no rotation: R Rᵀ − 1 is up to {:.2g}, the determinant {:.3g}", off,
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
