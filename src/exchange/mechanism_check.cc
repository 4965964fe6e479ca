#include "exchange/mechanism_check.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <map>
#include <set>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

#include "core/diagnostics.h"
#include "core/json_document.h"
#include "core/json_text.h"
#include "core/types.h"

namespace mbv {
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
    const bool told = std::any_of(deepest.begin(), deepest.end(), [&](const JsonFinding& other) {
      return other.path == finding.path;
    });
    if (!covered && !told) deepest.push_back(finding);
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
  const auto document = ReadJson(text, [](const JsonValue& root) { return root.json(); });
  if (!document) {
    const JsonRefusal& why = document.refusal;
    return {{.path = {},
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
