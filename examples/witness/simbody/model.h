// A mechanism as Simbody has it: mobilizers along the spanning tree, constraints for the closures,
// springs and gravity; drives are left to who moves it.
#pragma once

#include <map>

#include "basics.h"

namespace simbody_witness {

class Model {
 public:
  explicit Model(json mechanism)
      : m_(std::move(mechanism)), matter_(system_), forces_(system_), loads_(forces_, matter_) {
    for (const char* what : {"couplings", "bushings", "elements"}) {
      if (!m_.at(what).empty()) throw Refused(std::string("it has ") + what);
    }
    for (const json& body : m_.at("bodies")) bodies_[body.at("name")] = &body;
    for (const json& joint : m_.at("joints")) joints_[joint.at("name")] = &joint;
    const SimTK::Vec3 g = VectorOf(m_.at("gravity"));
    if (g.norm() > 0.0) SimTK::Force::UniformGravity(forces_, matter_, g);
    PlantTree();
    for (const json& joint : m_.at("joints")) {
      if (joint.at("closure")) Close(joint);
    }
    for (const json& spring : m_.at("springs")) AddSpring(spring);
  }
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;

 protected:
  // A joint's mobilizer, of the tree, with the coordinate that a drive is on.
  [[nodiscard]] SimTK::MobilizedBodyIndex MobilizerUnder(const json& drive) const {
    const json& joint = *joints_.at(drive.at("on").at("joint"));
    if (joint.at("closure")) throw Refused("a drive on a joint that closes a loop");
    return moved_by_.at(joint.at("name"));
  }
  [[nodiscard]] int CoordinateUnder(const json& drive) const {
    const json& joint = *joints_.at(drive.at("on").at("joint"));
    return CoordinateOf(joint.at("kind"), drive.at("on").at("coordinate"));
  }
  [[nodiscard]] double HomeUnder(const json& drive) const {
    const json& joint = *joints_.at(drive.at("on").at("joint"));
    return joint.at("home").at(drive.at("on").at("coordinate").get<size_t>());
  }

  // Every mobilizer at its home pose; angles of drives in home's turn.
  State Home() {
    State state = system_.realizeTopology();
    system_.realizeModel(state);
    for (const auto& [name, index] : moved_by_) {
      const json& joint = *joints_.at(name);
      const MobilizedBody& body = matter_.getMobilizedBody(index);
      const auto pose = [&](const char* side) {
        const json& frame = joint.at(side);
        return PoseOf(bodies_.at(frame.at("body"))->at("home")) * PoseOf(frame) *
               Transform(AxesFor(joint));
      };
      const bool reversed = placed_.at(joint.at("parent").at("body")) == index;
      const Transform X_FM = ~pose("parent") * pose("child");
      body.setQToFitTransform(state, reversed ? ~X_FM : X_FM);
      const std::string kind = joint.at("kind");
      if (kind != "revolute" && kind != "prismatic") continue;
      body.setOneQ(state, 0, joint.at("home").at(0));
    }
    return state;
  }

  void Project(State* state) {
    SimTK::ProjectOptions options(kClosed);
    options.setOption(SimTK::ProjectOptions::ForceProjection);
    options.setProjectionLimit(1e3);
    SimTK::ProjectResults results;
    SimTK::Vector none;
    system_.realize(*state, SimTK::Stage::Position);
    system_.projectQ(*state, none, options, results);
    system_.realize(*state, SimTK::Stage::Velocity);
    system_.projectU(*state, none, options, results);
  }

  void NameOutputs(std::ofstream* out) const {
    for (const json& output : m_.at("outputs")) {
      for (const char* what : {"x", "y", "z", "roll", "pitch", "yaw"})
        *out << ',' << output.at("name").get<std::string>() << '.' << what;
    }
    *out << '\n';
  }

  // R = Rz(yaw) Ry(pitch) Rx(roll).
  void WriteOutputs(const State& state, std::ofstream* out) {
    for (const json& output : m_.at("outputs")) {
      const auto pose = [&](const char* end) {
        const json& frame = output.at(end);
        return At(frame.at("body")).getBodyTransform(state) * PoseOf(frame);
      };
      const Transform X = ~pose("reference") * pose("frame");
      const SimTK::Mat33 R = X.R().asMat33();
      *out << ',' << X.p()[0] << ',' << X.p()[1] << ',' << X.p()[2] << ','
           << std::atan2(R(2, 1), R(2, 2)) << ','
           << std::asin(std::max(-1.0, std::min(1.0, -R(2, 0)))) << ','
           << std::atan2(R(1, 0), R(0, 0));
    }
    *out << '\n';
  }

  void NameOutputRates(std::ofstream* out) const {
    for (const json& output : m_.at("outputs")) {
      for (const char* what : {"x.velocity", "y.velocity", "z.velocity", "x.acceleration",
                               "y.acceleration", "z.acceleration"})
        *out << ',' << output.at("name").get<std::string>() << '.' << what;
    }
  }

  // Of each output's origin, in its reference frame; of a state with accelerations.
  void WriteOutputRates(const State& state, std::ofstream* out) {
    for (const json& output : m_.at("outputs")) {
      const json &reference = output.at("reference"), &frame = output.at("frame");
      const MobilizedBody &in = At(reference.at("body")), &body = At(frame.at("body"));
      const Vec3 p = PoseOf(frame).p();
      const Rotation R = PoseOf(reference).R();
      const Vec3 v = ~R * body.findStationVelocityInAnotherBody(state, p, in);
      const Vec3 a = ~R * body.findStationAccelerationInAnotherBody(state, p, in);
      for (const Vec3& x : {v, a}) *out << ',' << x[0] << ',' << x[1] << ',' << x[2];
    }
  }

  MobilizedBody& At(const std::string& body) {
    return matter_.updMobilizedBody(SimTK::MobilizedBodyIndex(placed_.at(body)));
  }

 private:
  // The spanning tree: outwards from the world along joints that are no closures.
  void PlantTree() {
    placed_[m_.at("bodies").at(0).at("name")] = 0;
    bool more = true;
    while (more) {
      more = false;
      for (const json& joint : m_.at("joints")) {
        if (joint.at("closure")) continue;
        const std::string parent = joint.at("parent").at("body"),
                          child = joint.at("child").at("body");
        if ((placed_.count(parent) > 0) == (placed_.count(child) > 0)) continue;
        Place(joint, (placed_.count(child) > 0));
        more = true;
      }
    }
    if (placed_.size() != bodies_.size()) throw Refused("its bodies make no tree");
  }

  SimTK::Body BodyOf(const std::string& name) const {
    const json& body = *bodies_.at(name);
    const json& I = body.at("inertia");
    const double mass = body.at("mass");
    const Vec3 c = VectorOf(body.at("centre_of_mass"));
    const SimTK::Inertia about_c(I.at(0).at(0), I.at(1).at(1), I.at(2).at(2), I.at(0).at(1),
                                 I.at(0).at(2), I.at(1).at(2));
    if (mass == 0.0) return SimTK::Body::Massless();
    return SimTK::Body::Rigid(SimTK::MassProperties(mass, c, about_c.shiftFromMassCenter(c, mass)));
  }

  // The joint's frames turned so that Simbody's mobilizer has its axes there.
  static Rotation AxesFor(const json& joint) {
    const std::string kind = joint.at("kind");
    const Vec3 axis = VectorOf(joint.at("axis"));
    if (kind == "prismatic") return Along(axis, SimTK::XAxis);
    if (kind == "universal") {
      const Vec3 axis2 = VectorOf(joint.at("axis2"));
      if (std::abs(SimTK::dot(axis, axis2)) > 1e-12) throw Refused("axes that are not square");
      return Rotation(SimTK::UnitVec3(axis), SimTK::XAxis, axis2, SimTK::YAxis);
    }
    return Along(axis, SimTK::ZAxis);
  }

  void Place(const json& joint, bool reversed) {
    const Rotation R = AxesFor(joint);
    const json &inner = joint.at(reversed ? "child" : "parent"),
               &outer = joint.at(reversed ? "parent" : "child");
    MobilizedBody& inboard =
        matter_.updMobilizedBody(SimTK::MobilizedBodyIndex(placed_.at(inner.at("body"))));
    const Transform X_in = PoseOf(inner) * Transform(R), X_out = PoseOf(outer) * Transform(R);
    const SimTK::Body body = BodyOf(outer.at("body"));
    const auto way = reversed ? MobilizedBody::Reverse : MobilizedBody::Forward;
    const std::string kind = joint.at("kind");
    SimTK::MobilizedBodyIndex index;
    if (kind == "revolute") {
      index = MobilizedBody::Pin(inboard, X_in, body, X_out, way).getMobilizedBodyIndex();
    } else if (kind == "prismatic") {
      index = MobilizedBody::Slider(inboard, X_in, body, X_out, way).getMobilizedBodyIndex();
    } else if (kind == "cylindrical") {
      index = MobilizedBody::Cylinder(inboard, X_in, body, X_out, way).getMobilizedBodyIndex();
    } else if (kind == "universal") {
      index = MobilizedBody::Universal(inboard, X_in, body, X_out, way).getMobilizedBodyIndex();
    } else if (kind == "spherical") {
      index = MobilizedBody::Ball(inboard, X_in, body, X_out, way).getMobilizedBodyIndex();
    } else if (kind == "planar") {
      index = MobilizedBody::Planar(inboard, X_in, body, X_out, way).getMobilizedBodyIndex();
    } else if (kind == "free") {
      index = MobilizedBody::Free(inboard, X_in, body, X_out, way).getMobilizedBodyIndex();
    } else if (kind == "fixed") {
      index = MobilizedBody::Weld(inboard, X_in, body, X_out).getMobilizedBodyIndex();
    } else {
      throw Refused("it has a joint of the kind " + kind);
    }
    placed_[outer.at("body")] = index;
    moved_by_[joint.at("name")] = index;
  }

  // A closed joint: the constraints that it is made of.
  void Close(const json& joint) {
    const std::string kind = joint.at("kind");
    MobilizedBody &F = At(joint.at("parent").at("body")), &M = At(joint.at("child").at("body"));
    const Transform X_F = PoseOf(joint.at("parent")), X_M = PoseOf(joint.at("child"));
    const Vec3 axis = VectorOf(joint.at("axis"));
    const SimTK::UnitVec3 a_F(X_F.R() * axis), a_M(X_M.R() * axis);
    const bool point = kind == "spherical" || kind == "revolute" || kind == "universal";
    if (kind == "fixed") {
      Constraint::Weld(F, X_F, M, X_M);
    } else if (point) {
      Constraint::Ball(F, X_F.p(), M, X_M.p());
    } else if (kind == "prismatic" || kind == "cylindrical" || kind == "point_on_line") {
      Constraint::PointOnLine(F, a_F, X_F.p(), M, X_M.p());
    } else if (kind == "planar" || kind == "point_on_plane") {
      Constraint::PointInPlane(F, a_F, SimTK::dot(a_F, X_F.p()), M, X_M.p());
    } else {
      throw Refused("it has a closure of the kind " + kind);
    }
    if (kind == "prismatic") {
      Constraint::ConstantOrientation(F, X_F.R(), M, X_M.R());
    } else if (kind == "universal") {
      Constraint::ConstantAngle(F, a_F, M, SimTK::UnitVec3(X_M.R() * VectorOf(joint.at("axis2"))));
    } else if (kind == "revolute" || kind == "cylindrical" || kind == "planar") {
      Constraint::ConstantAngle(F, SimTK::UnitVec3(a_F.perp()), M, a_M);
      Constraint::ConstantAngle(F, SimTK::UnitVec3(a_F % a_F.perp()), M, a_M);
    }
  }

  void AddSpring(const json& spring) {
    const json &from = spring.at("between").at(0), &to = spring.at("between").at(1);
    MobilizedBody &a = At(from.at("body")), &b = At(to.at("body"));
    const Vec3 p = VectorOf(from.at("p")), q = VectorOf(to.at("p"));
    SimTK::Force::TwoPointLinearSpring(forces_, a, p, b, q, spring.at("stiffness"),
                                       spring.at("free_length"));
    SimTK::Force::TwoPointLinearDamper(forces_, a, p, b, q, spring.at("damping"));
  }

  // Simbody counts the turn of cylinders and planes first, ours last.
  static int CoordinateOf(const std::string& kind, int coordinate) {
    if (kind == "cylindrical") return 1 - coordinate;
    if (kind == "planar") return (coordinate + 1) % 3;
    if (kind == "revolute" || kind == "prismatic" || kind == "universal") return coordinate;
    throw Refused("a drive on a joint of the kind " + kind);
  }

 protected:
  const json m_;
  SimTK::MultibodySystem system_;
  SimTK::SimbodyMatterSubsystem matter_;
  SimTK::GeneralForceSubsystem forces_;
  SimTK::Force::DiscreteForces loads_;
  std::map<std::string, const json*> bodies_, joints_;
  std::map<std::string, int> placed_;                          // by body
  std::map<std::string, SimTK::MobilizedBodyIndex> moved_by_;  // by joint of the tree
};

}  // namespace simbody_witness
