// Simbody 3.7 as a witness: a mechanism's drive forces by another engine with its own mathematics.
//
// mbverify calls it in a folder with mechanism.json, motion.csv and loads.csv, and it leaves
// witness.json and traces.csv there (docs/witnesses.md). Joints of the spanning tree are Simbody's
// mobilizers, closures its constraints, drives constraints on a mobilizer's coordinate or on the
// distance of two points. Per sample positions and velocities are projected onto all of them; the
// multipliers of the accelerations' equations are the forces:
//   M u̇ + Gᵀλ = f,   G u̇ = b:   a drive's force is −λ of its constraint.
#include <Simbody.h>

#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using nlohmann::json;
using SimTK::Constraint;
using SimTK::MobilizedBody;
using SimTK::Rotation;
using SimTK::SpatialVec;
using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;

constexpr double kClosed = 1e-13;  // to which loops are projected closed [m, rad]
constexpr int kWalk = 40;          // steps from home to the first sample

// What this program cannot compute: no fault of anyone.
struct Refused : std::runtime_error {
  using runtime_error::runtime_error;
};

Vec3 VectorOf(const json& v) { return {v.at(0), v.at(1), v.at(2)}; }

Transform PoseOf(const json& pose) {
  const json& R = pose.at("R");
  SimTK::Mat33 m;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) m(i, k) = R.at(i).at(k);
  }
  return {Rotation(m, true), VectorOf(pose.at("p"))};
}

// Axes with the first along `a` (SimTK::XAxis, …), and if given another one along b.
Rotation Along(const Vec3& a, SimTK::CoordinateAxis axis) {
  return Rotation(SimTK::UnitVec3(a), axis);
}

struct Sample {
  double position = 0.0, velocity = 0.0, acceleration = 0.0;
};

// The present motion of one drive, as a function of time that Simbody asks for.
class Driven : public SimTK::Function {
 public:
  explicit Driven(std::shared_ptr<const Sample> now) : now_(std::move(now)) {}
  SimTK::Real calcValue(const SimTK::Vector&) const override { return now_->position; }
  SimTK::Real calcDerivative(const SimTK::Array_<int>& order, const SimTK::Vector&) const override {
    return order.size() == 1 ? now_->velocity : now_->acceleration;
  }
  int getArgumentSize() const override { return 1; }
  int getMaxDerivativeOrder() const override { return 2; }
  Driven* clone() const override { return new Driven(now_); }

 private:
  std::shared_ptr<const Sample> now_;
};

// |b − a| − L = 0 between two points.
class Distance : public Constraint::Custom::Implementation {
 public:
  Distance(SimTK::SimbodyMatterSubsystem& matter, const MobilizedBody& from, const Vec3& a,
           const MobilizedBody& to, const Vec3& b, std::shared_ptr<const Sample> now)
      : Implementation(matter, 1, 0, 0), a_(a), b_(b), now_(std::move(now)) {
    from_ = addConstrainedBody(from);
    to_ = addConstrainedBody(to);
  }
  Implementation* clone() const override { return new Distance(*this); }

  void calcPositionErrors(const State&,
                          const SimTK::Array_<Transform, SimTK::ConstrainedBodyIndex>& X,
                          const SimTK::Array_<SimTK::Real, SimTK::ConstrainedQIndex>&,
                          SimTK::Array_<SimTK::Real>& error) const override {
    error[0] = (X[to_] * b_ - X[from_] * a_).norm() - now_->position;
  }
  void calcPositionDotErrors(const State& state,
                             const SimTK::Array_<SpatialVec, SimTK::ConstrainedBodyIndex>& V,
                             const SimTK::Array_<SimTK::Real, SimTK::ConstrainedQIndex>&,
                             SimTK::Array_<SimTK::Real>& error) const override {
    const Ends e = EndsOf(state);
    error[0] = SimTK::dot(e.u, Rate(V[to_], e.b) - Rate(V[from_], e.a)) - now_->velocity;
  }
  void calcPositionDotDotErrors(const State& state,
                                const SimTK::Array_<SpatialVec, SimTK::ConstrainedBodyIndex>& A,
                                const SimTK::Array_<SimTK::Real, SimTK::ConstrainedQIndex>&,
                                SimTK::Array_<SimTK::Real>& error) const override {
    const Ends e = EndsOf(state);
    const SpatialVec V_a = getBodyVelocityFromState(state, from_);
    const SpatialVec V_b = getBodyVelocityFromState(state, to_);
    const Vec3 v = Rate(V_b, e.b) - Rate(V_a, e.a);
    const Vec3 a_a = Rate(A[from_], e.a) + V_a[0] % (V_a[0] % e.a);
    const Vec3 a_b = Rate(A[to_], e.b) + V_b[0] % (V_b[0] % e.b);
    const double along = SimTK::dot(e.u, v);
    error[0] =
        SimTK::dot(e.u, a_b - a_a) + (v.normSqr() - along * along) / e.length - now_->acceleration;
  }
  void addInPositionConstraintForces(
      const State& state, const SimTK::Array_<SimTK::Real>& multipliers,
      SimTK::Array_<SpatialVec, SimTK::ConstrainedBodyIndex>& forces,
      SimTK::Array_<SimTK::Real, SimTK::ConstrainedQIndex>&) const override {
    const Ends e = EndsOf(state);
    const Vec3 f = multipliers[0] * e.u;
    forces[to_] += SpatialVec(e.b % f, f);
    forces[from_] -= SpatialVec(e.a % f, f);
  }

 private:
  struct Ends {
    Vec3 a, b;  // from the bodies' origins
    Vec3 u;
    double length;
  };
  [[nodiscard]] Ends EndsOf(const State& state) const {
    const Transform& X_a = getBodyTransformFromState(state, from_);
    const Transform& X_b = getBodyTransformFromState(state, to_);
    Ends e{X_a.R() * a_, X_b.R() * b_, Vec3(0), 0.0};
    const Vec3 d = X_b.p() + e.b - X_a.p() - e.a;
    e.length = d.norm();
    e.u = d / e.length;
    return e;
  }
  static Vec3 Rate(const SpatialVec& V, const Vec3& arm) { return V[1] + V[0] % arm; }

  Vec3 a_, b_;
  std::shared_ptr<const Sample> now_;
  SimTK::ConstrainedBodyIndex from_, to_;
};

struct Table {
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> rows;
};

Table ReadCsv(const std::string& file) {
  std::ifstream in(file);
  Table table;
  for (std::string line; std::getline(in, line);) {
    std::vector<std::string> cells;
    std::istringstream text(line);
    for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
    if (table.names.empty()) {
      table.names = std::move(cells);
    } else {
      table.rows.push_back(std::move(cells));
    }
  }
  return table;
}

class Witness {
 public:
  explicit Witness(json mechanism)
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
    for (const json& drive : m_.at("drives")) AddDriven(drive);
    for (const json& base : m_.at("prescribed")) AddDriven(base);
  }

  void Run() {
    State state = Home();
    const Table motion = ReadCsv("motion.csv"), loads = ReadCsv("loads.csv");
    std::ofstream out("traces.csv");
    out.precision(17);
    out << "time_s,closure.position";
    for (const Drive& drive : drives_) {
      out << ',' << drive.name << ".force";
      if (!drive.base) {
        out << ',' << drive.name << ".position," << drive.name << ".velocity," << drive.name
            << ".acceleration";
      }
    }
    out << '\n';
    size_t load = 0;
    for (size_t i = 0; i < motion.rows.size(); ++i) {
      const std::vector<std::string>& row = motion.rows[i];
      if (i == 0) Walk(row, &state);
      SetDriven(row, 1.0);
      Reach(&state);
      loads_.clearAllForces(state);
      for (; load < loads.rows.size() && std::stod(loads.rows[load][0]) <= std::stod(row[0]);
           ++load) {
        AddLoad(loads.rows[load], &state);
      }
      system_.realize(state, SimTK::Stage::Acceleration);
      Write(row[0], state, &out);
    }
  }

 private:
  struct Drive {
    std::string name;
    bool base = false;  // a prescribed joint
    std::shared_ptr<Sample> now = std::make_shared<Sample>();
    double home = 0.0;
    SimTK::ConstraintIndex constraint;
  };

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

  MobilizedBody& At(const std::string& body) {
    return matter_.updMobilizedBody(SimTK::MobilizedBodyIndex(placed_.at(body)));
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

  void AddDriven(const json& row) {
    Drive drive;
    drive.name = row.at("name");
    drive.base = !row.contains("position_unit");
    if (row.contains("between")) {
      const json &from = row.at("between").at(0), &to = row.at("between").at(1);
      drive.home = ((PoseOf(bodies_.at(to.at("body"))->at("home")) * VectorOf(to.at("p"))) -
                    (PoseOf(bodies_.at(from.at("body"))->at("home")) * VectorOf(from.at("p"))))
                       .norm();
      drive.constraint =
          Constraint::Custom(new Distance(matter_, At(from.at("body")), VectorOf(from.at("p")),
                                          At(to.at("body")), VectorOf(to.at("p")), drive.now))
              .getConstraintIndex();
    } else {
      const json& joint = *joints_.at(row.at("on").at("joint"));
      if (joint.at("closure")) throw Refused("a drive on a joint that closes a loop");
      const int c = row.at("on").at("coordinate");
      drive.home = joint.at("home").at(c);
      drive.constraint = Constraint::PrescribedMotion(
                             matter_, new Driven(drive.now), moved_by_.at(joint.at("name")),
                             SimTK::MobilizerQIndex(CoordinateOf(joint.at("kind"), c)))
                             .getConstraintIndex();
    }
    drives_.push_back(std::move(drive));
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

  void SetDriven(const std::vector<std::string>& row, double share) {
    for (size_t k = 0; k < drives_.size(); ++k) {
      Sample& now = *drives_[k].now;
      now.position = drives_[k].home + share * (std::stod(row.at(1 + 3 * k)) - drives_[k].home);
      now.velocity = std::stod(row.at(2 + 3 * k));
      now.acceleration = std::stod(row.at(3 + 3 * k));
    }
  }

  void Walk(const std::vector<std::string>& row, State* state) {
    for (int i = 0; i <= kWalk; ++i) {
      SetDriven(row, static_cast<double>(i) / kWalk);
      Reach(state);
    }
  }

  // Positions and velocities onto the loops and drives. The motion is no function of time that
  // Simbody knows: another time makes it ask again.
  void Reach(State* state) {
    state->setTime(state->getTime() + 1.0);
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

  void AddLoad(const std::vector<std::string>& row, State* state) {
    const MobilizedBody& body = At(row.at(2));
    const auto vector = [&](size_t at) {
      return Vec3(std::stod(row.at(at)), std::stod(row.at(at + 1)), std::stod(row.at(at + 2)));
    };
    Vec3 f = vector(7), m = vector(10);
    system_.realize(*state, SimTK::Stage::Position);
    if (row.at(6) == "body") {
      f = body.getBodyRotation(*state) * f;
      m = body.getBodyRotation(*state) * m;
    }
    loads_.addForceToBodyPoint(*state, body, vector(3), f);
    const SpatialVec sum = loads_.getOneBodyForce(*state, body);
    loads_.setOneBodyForce(*state, body, sum + SpatialVec(m, Vec3(0)));
  }

  void Write(const std::string& time, const State& state, std::ofstream* out) {
    *out << time << ',' << state.getQErr().normInf();
    for (const Drive& drive : drives_) {
      const double force =
          -matter_.getConstraint(drive.constraint).getMultipliersAsVector(state)[0];
      if (!std::isfinite(force)) throw Refused("its equations are singular at t = " + time + " s");
      *out << ',' << force;
      if (drive.base) continue;
      *out << ',' << drive.now->position << ',' << drive.now->velocity << ','
           << drive.now->acceleration;
    }
    *out << '\n';
  }

  const json m_;
  SimTK::MultibodySystem system_;
  SimTK::SimbodyMatterSubsystem matter_;
  SimTK::GeneralForceSubsystem forces_;
  SimTK::Force::DiscreteForces loads_;
  std::map<std::string, const json*> bodies_, joints_;
  std::map<std::string, int> placed_;                          // by body
  std::map<std::string, SimTK::MobilizedBodyIndex> moved_by_;  // by joint of the tree
  std::vector<Drive> drives_;
};

}  // namespace

int main() {
  json answer = {{"schema", "mbverify/witness/1"},
                 {"program", "Simbody"},
                 {"version", "3.7"},
                 {"units", "SI"},
                 {"method", "mobilizers of a spanning tree, constraints with multipliers"},
                 {"declined", {{{"what", "joint reactions"}, {"why", "not read out"}}}}};
  try {
    std::ifstream file("mechanism.json");
    Witness(json::parse(file)).Run();
  } catch (const Refused& why) {
    answer["refused"] = why.what();
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  std::ofstream("witness.json") << answer.dump(1) << '\n';
  return 0;
}
