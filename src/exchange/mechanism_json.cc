#include "exchange/mechanism_json.h"

#include <Eigen/Dense>
#include <nlohmann/json.hpp>

#include "core/json_text.h"

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
    for (int c = 0; c < FreedomsOf(joint.kind); ++c) {
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

}  // namespace mbv
