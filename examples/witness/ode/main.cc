// The Open Dynamics Engine as a witness of free motions: bodies in absolute coordinates, its own
// joints for those of trees and loops alike, its own stepper.
//
// mbverify calls it in a folder with mechanism.json, motion.csv, start.csv and forces.csv, and it
// leaves witness.json and traces.csv there (docs/how-to/external_solvers.md). Springs, dampers and
// drives are forces that stand still within a step.
//   mbverify-witness-ode [STEPS]   steps between two samples, 20 if left out
#include <ode/ode.h>

#include <Eigen/Geometry>
#include <cmath>
#include <deque>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "../handover.h"

namespace {

using nlohmann::json;
using witness::Refused;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Pose = Eigen::Isometry3d;

Vec3 VectorOf(const json& v) {
  return Vec3(v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>());
}
Pose PoseOf(const json& pose) {
  Pose X = Pose::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) X.linear()(i, k) = pose.at("R").at(i).at(k);
  }
  X.translation() = VectorOf(pose.at("p"));
  return X;
}
Vec3 Of(const dReal* v) { return Vec3(v[0], v[1], v[2]); }

// A body, or the world; ODE's origin of a body is its centre of mass.
struct Body {
  dBodyID id = nullptr;
  Vec3 c = Vec3::Zero();

  [[nodiscard]] Pose X_W() const {
    Pose X = Pose::Identity();
    if (id == nullptr) return X;
    const dReal* R = dBodyGetRotation(id);
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) X.linear()(i, k) = R[4 * i + k];
    }
    X.translation() = Of(dBodyGetPosition(id)) - X.linear() * c;
    return X;
  }
  [[nodiscard]] Vec3 w() const {
    return id == nullptr ? Vec3(0, 0, 0) : Of(dBodyGetAngularVel(id));
  }
  // Of the body's point that is at p_W.
  [[nodiscard]] Vec3 VelocityAt(const Vec3& p_W) const {
    if (id == nullptr) return Vec3::Zero();
    return Of(dBodyGetLinearVel(id)) + w().cross(p_W - Of(dBodyGetPosition(id)));
  }
  void Push(const Vec3& f, const Vec3& p) const {
    if (id != nullptr) dBodyAddForceAtPos(id, f.x(), f.y(), f.z(), p.x(), p.y(), p.z());
  }
  void Turn(const Vec3& m) const {
    if (id != nullptr) dBodyAddTorque(id, m.x(), m.y(), m.z());
  }
};

struct Joint {
  std::string name, kind;
  Body *parent = nullptr, *child = nullptr;
  Pose X_PF, X_CM;
  Vec3 axis, axis2;
  std::vector<double> home;
  bool closure = false;
  dJointID id = nullptr;
  dJointFeedback feedback = {};

  [[nodiscard]] Pose X_WF() const { return parent->X_W() * X_PF; }
  [[nodiscard]] Pose X_WM() const { return child->X_W() * X_CM; }
};

// The angle about `a` from u to v.
double AngleAbout(const Vec3& a, const Vec3& u, const Vec3& v) {
  return std::atan2(a.dot(u.cross(v)), u.dot(v) - a.dot(u) * a.dot(v));
}

// A coordinate of a joint, or the distance of two points; angles are followed from home.
struct Coordinate {
  const Joint* joint = nullptr;
  int index = 0;
  const Body *from = nullptr, *to = nullptr;  // of a distance
  Vec3 p_from = Vec3::Zero(), p_to = Vec3::Zero();
  double last = 0.0;

  [[nodiscard]] bool IsLength() const {
    return joint == nullptr || joint->kind == "prismatic" ||
           (joint->kind == "cylindrical" && index == 0);
  }
  double Position() {
    if (joint == nullptr) return (to->X_W() * p_to - from->X_W() * p_from).norm();
    const Pose X_FM = joint->X_WF().inverse() * joint->X_WM();
    if (IsLength()) return joint->axis.dot(X_FM.translation());
    const Mat3 R = X_FM.linear();
    const Vec3 &a = joint->axis, &b = joint->axis2;
    double q = 0.0;
    if (joint->kind != "universal") {
      const Vec3 e = a.unitOrthogonal();
      q = AngleAbout(a, e, R * e);
    } else {
      q = index == 0 ? AngleAbout(a, b, R * b) : AngleAbout(b, R.transpose() * a, a);
    }
    return last = q + 2 * M_PI * std::round((last - q) / (2 * M_PI));
  }
  // Its unit vector in the world.
  [[nodiscard]] Vec3 Direction() const {
    if (joint == nullptr) return (to->X_W() * p_to - from->X_W() * p_from).normalized();
    const bool second = joint->kind == "universal" && index == 1;
    return second ? joint->X_WM().linear() * joint->axis2 : joint->X_WF().linear() * joint->axis;
  }
  [[nodiscard]] double Rate() const {
    const Vec3 u = Direction();
    if (joint == nullptr) {
      return u.dot(to->VelocityAt(to->X_W() * p_to) - from->VelocityAt(from->X_W() * p_from));
    }
    if (!IsLength()) return u.dot(joint->child->w() - joint->parent->w());
    const Vec3 p = joint->X_WM().translation();
    return u.dot(joint->child->VelocityAt(p) - joint->parent->VelocityAt(p));
  }
  // A force along it, positive towards a larger coordinate.
  void Push(double force) const {
    const Vec3 f = force * Direction();
    if (joint == nullptr) {
      to->Push(f, to->X_W() * p_to);
      from->Push(-f, from->X_W() * p_from);
    } else if (IsLength()) {
      const Vec3 p = joint->X_WM().translation();
      joint->child->Push(f, p);
      joint->parent->Push(-f, p);
    } else {
      joint->child->Turn(f);
      joint->parent->Turn(-f);
    }
  }
};

struct Drive {
  std::string name;
  Coordinate q;
  witness::ForceInTime force;
};

// −Σ k_i (q − free)^i − preload − d q̇.
struct Element {
  Coordinate q;
  std::vector<double> polynomial = {};
  double free = 0.0, preload = 0.0, damping = 0.0;

  void Push() {
    const double x = q.Position() - free;
    double force = -preload - damping * q.Rate(), power = x;
    for (const double k : polynomial) {
      force -= k * power;
      power *= x;
    }
    q.Push(force);
  }
};

class Engine {
 public:
  explicit Engine(const json& m) : m_(m), world_(dWorldCreate()) {
    for (const char* what : {"couplings", "bushings"}) {
      if (!m_.at(what).empty()) throw Refused(std::string("it has ") + what);
    }
    const Vec3 g = VectorOf(m_.at("gravity"));
    dWorldSetGravity(world_, g.x(), g.y(), g.z());
    AddBodies();
    for (const json& joint : m_.at("joints")) AddJoint(joint);
    const witness::Table forces = witness::ReadCsv("forces.csv");
    for (const json& drive : m_.at("drives")) {
      drives_.push_back({drive.at("name"), On(drive), {forces, drive.at("name")}});
    }
    for (const json& element : m_.at("elements")) AddElement(element);
    for (const json& spring : m_.at("springs")) {
      elements_.push_back({.q = Between(spring.at("between")),
                           .polynomial = {spring.at("stiffness")},
                           .free = spring.at("free_length"),
                           .damping = spring.at("damping")});
    }
  }
  ~Engine() { dWorldDestroy(world_); }
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  void Run(long steps, double* compute_s) {
    std::ofstream out("traces.csv");
    out.precision(17);
    WriteNames(&out);
    const auto rows = witness::ReadCsv("motion.csv").rows;
    double t = std::stod(rows.front().at(0)), h = 1e-3;
    for (size_t i = 0; i < rows.size(); ++i) {
      if (i + 1 < rows.size()) {
        h = (std::stod(rows[i + 1].at(0)) - std::stod(rows[i].at(0))) / static_cast<double>(steps);
      }
      out << rows[i].at(0);
      WriteMotion(&out);
      // Reactions are those of the step from here.
      const std::vector<std::pair<Pose, Vec3>> places = Places();
      const witness::Stopwatch watch(compute_s);
      Step(t, h);
      WriteReactions(places, &out);
      for (long k = 1; k < steps && i + 1 < rows.size(); ++k) {
        Step(t + static_cast<double>(k) * h, h);
      }
      t += static_cast<double>(steps) * h;
    }
  }

 private:
  void AddBodies() {
    std::map<std::string, std::vector<double>> start;
    for (const auto& row : witness::ReadCsv("start.csv").rows) {
      for (size_t k = 1; k < row.size(); ++k) start[row[0]].push_back(std::stod(row[k]));
    }
    const std::string ground = m_.at("bodies").at(0).at("name");
    for (const json& given : m_.at("bodies")) {
      const std::string name = given.at("name");
      Body& body = bodies_[name];
      if (name == ground) continue;
      const double mass = given.at("mass");
      const json& I = given.at("inertia");
      Mat3 inertia;
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) inertia(i, k) = I.at(i).at(k);
      }
      if (!(mass > 0.0) || inertia.llt().info() != Eigen::Success) {
        throw Refused("the body " + name + " has no mass or inertia of its own");
      }
      body.id = dBodyCreate(world_);
      body.c = VectorOf(given.at("centre_of_mass"));
      dMass properties;
      dMassSetParameters(&properties, mass, 0, 0, 0, inertia(0, 0), inertia(1, 1), inertia(2, 2),
                         inertia(0, 1), inertia(0, 2), inertia(1, 2));
      dBodySetMass(body.id, &properties);
      const std::vector<double>& s = start.at(name);
      Mat3 R;
      dMatrix3 rows = {};
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k)
          R(i, k) = rows[4 * i + k] = s[static_cast<size_t>(3 + 3 * i + k)];
      }
      dBodySetRotation(body.id, rows);
      const Vec3 r = R * body.c, p = Vec3(s[0], s[1], s[2]) + r, w(s[12], s[13], s[14]);
      const Vec3 v = Vec3(s[15], s[16], s[17]) + w.cross(r);
      dBodySetPosition(body.id, p.x(), p.y(), p.z());
      dBodySetLinearVel(body.id, v.x(), v.y(), v.z());
      dBodySetAngularVel(body.id, w.x(), w.y(), w.z());
      dBodySetFiniteRotationMode(body.id, 1);
    }
  }

  void AddJoint(const json& given) {
    Joint& joint = joints_.emplace_back();
    joint.name = given.at("name");
    joint.kind = given.at("kind");
    joint.parent = &bodies_.at(given.at("parent").at("body"));
    joint.child = &bodies_.at(given.at("child").at("body"));
    joint.X_PF = PoseOf(given.at("parent"));
    joint.X_CM = PoseOf(given.at("child"));
    joint.axis = VectorOf(given.at("axis"));
    joint.axis2 = given.contains("axis2") ? VectorOf(given.at("axis2")) : Vec3::Zero();
    joint.home = given.at("home").get<std::vector<double>>();
    joint.closure = given.at("closure");
    const Vec3 p = joint.X_WM().translation(), a = joint.X_WF().linear() * joint.axis;
    const auto attach = [&](dJointID id) {
      joint.id = id;
      dJointAttach(id, joint.parent->id, joint.child->id);
      dJointSetFeedback(id, &joint.feedback);
    };
    if (joint.kind == "revolute") {
      attach(dJointCreateHinge(world_, nullptr));
      dJointSetHingeAnchor(joint.id, p.x(), p.y(), p.z());
      dJointSetHingeAxis(joint.id, a.x(), a.y(), a.z());
    } else if (joint.kind == "prismatic") {
      attach(dJointCreateSlider(world_, nullptr));
      dJointSetSliderAxis(joint.id, a.x(), a.y(), a.z());
    } else if (joint.kind == "cylindrical") {
      attach(dJointCreatePiston(world_, nullptr));
      dJointSetPistonAnchor(joint.id, p.x(), p.y(), p.z());
      dJointSetPistonAxis(joint.id, a.x(), a.y(), a.z());
    } else if (joint.kind == "universal") {
      const Vec3 b = joint.X_WM().linear() * joint.axis2;
      if (std::abs(a.dot(b)) > 1e-9) throw Refused("axes that are not square");
      attach(dJointCreateUniversal(world_, nullptr));
      dJointSetUniversalAnchor(joint.id, p.x(), p.y(), p.z());
      dJointSetUniversalAxis1(joint.id, a.x(), a.y(), a.z());
      dJointSetUniversalAxis2(joint.id, b.x(), b.y(), b.z());
    } else if (joint.kind == "spherical") {
      attach(dJointCreateBall(world_, nullptr));
      dJointSetBallAnchor(joint.id, p.x(), p.y(), p.z());
    } else if (joint.kind == "fixed") {
      attach(dJointCreateFixed(world_, nullptr));
      dJointSetFixed(joint.id);
    } else if (joint.kind != "free") {
      throw Refused("it has a joint of the kind " + joint.kind);
    }
  }

  Coordinate OnJoint(const std::string& name, int index) const {
    Coordinate q;
    for (const Joint& joint : joints_) {
      if (joint.name == name) q.joint = &joint;
    }
    const std::string& kind = q.joint->kind;
    if (kind != "revolute" && kind != "prismatic" && kind != "cylindrical" && kind != "universal") {
      throw Refused("a force on a coordinate of a joint of the kind " + kind);
    }
    q.index = index;
    q.last = q.joint->home.at(static_cast<size_t>(index));
    return q;
  }
  Coordinate Between(const json& ends) const {
    Coordinate q;
    q.from = &bodies_.at(ends.at(0).at("body"));
    q.to = &bodies_.at(ends.at(1).at("body"));
    q.p_from = VectorOf(ends.at(0).at("p"));
    q.p_to = VectorOf(ends.at(1).at("p"));
    return q;
  }
  Coordinate On(const json& drive) const {
    if (drive.contains("between")) return Between(drive.at("between"));
    return OnJoint(drive.at("on").at("joint"), drive.at("on").at("coordinate"));
  }

  void AddElement(const json& given) {
    const std::string kind = given.at("kind");
    if (kind != "damping" && kind != "spring")
      throw Refused("it has an element of the kind " + kind);
    Element element;
    const json &on = given.at("on"), &law = given.at("law");
    if (on.contains("drive")) {
      for (const Drive& drive : drives_) {
        if (drive.name == on.at("drive")) element.q = drive.q;
      }
    } else {
      element.q = OnJoint(on.at("joint"), on.at("coordinate"));
    }
    if (kind == "damping") {
      element.damping = law.at("damping");
    } else {
      element.polynomial = law.at("polynomial").get<std::vector<double>>();
      element.free = law.at("free");
      element.preload = law.at("preload");
    }
    elements_.push_back(std::move(element));
  }

  void Step(double t, double h) {
    for (Element& element : elements_) element.Push();
    for (const Drive& drive : drives_) drive.q.Push(drive.force.At(t));
    dWorldStep(world_, h);
  }

  void WriteNames(std::ofstream* out) const {
    *out << "time_s,closure.position";
    const auto write = [&](const std::string& name, std::initializer_list<const char*> words) {
      for (const char* word : words) *out << ',' << name << '.' << word;
    };
    for (const Drive& drive : drives_) write(drive.name, {"position", "velocity"});
    for (const json& output : m_.at("outputs")) {
      write(output.at("name"),
            {"x", "y", "z", "roll", "pitch", "yaw", "x.velocity", "y.velocity", "z.velocity"});
    }
    for (const Joint& joint : joints_) {
      if (joint.id == nullptr) continue;
      write(joint.name + ".reaction", {"fx", "fy", "fz", "mx", "my", "mz"});
    }
    *out << '\n';
  }

  // How far the loops are apart where no coordinate of their joint lets them.
  [[nodiscard]] double LargestGap() const {
    double largest = 0.0;
    for (const Joint& joint : joints_) {
      if (!joint.closure) continue;
      Vec3 gap = (joint.X_WF().inverse() * joint.X_WM()).translation();
      if (joint.kind == "prismatic" || joint.kind == "cylindrical") {
        gap -= joint.axis * joint.axis.dot(gap);
      }
      largest = std::max(largest, gap.norm());
    }
    return largest;
  }

  // R = Rz(yaw) Ry(pitch) Rx(roll).
  void WriteMotion(std::ofstream* out) {
    *out << ',' << LargestGap();
    for (Drive& drive : drives_) *out << ',' << drive.q.Position() << ',' << drive.q.Rate();
    for (const json& output : m_.at("outputs")) {
      const json &frame = output.at("frame"), &reference = output.at("reference");
      const Body &body = bodies_.at(frame.at("body")), &in = bodies_.at(reference.at("body"));
      const Pose X_WR = in.X_W() * PoseOf(reference), X_WO = body.X_W() * PoseOf(frame);
      const Pose X = X_WR.inverse() * X_WO;
      const Mat3 R = X.linear();
      const Vec3 p = X_WO.translation();
      const Vec3 v = X_WR.linear().transpose() * (body.VelocityAt(p) - in.VelocityAt(p));
      for (int k = 0; k < 3; ++k) *out << ',' << X.translation()[k];
      *out << ',' << std::atan2(R(2, 1), R(2, 2)) << ','
           << std::asin(std::clamp(-R(2, 0), -1.0, 1.0)) << ',' << std::atan2(R(1, 0), R(0, 0));
      for (int k = 0; k < 3; ++k) *out << ',' << v[k];
    }
  }

  // Of each joint: frame F with M's origin, and the child's (else the parent's) centre of mass.
  [[nodiscard]] std::vector<std::pair<Pose, Vec3>> Places() const {
    std::vector<std::pair<Pose, Vec3>> places;
    for (const Joint& joint : joints_) {
      Pose X = joint.X_WF();
      X.translation() = joint.X_WM().translation();
      const dBodyID body = joint.child->id != nullptr ? joint.child->id : joint.parent->id;
      places.emplace_back(X, body == nullptr ? Vec3(0, 0, 0) : Of(dBodyGetPosition(body)));
    }
    return places;
  }

  // On the child about M's origin, in F's axes.
  void WriteReactions(const std::vector<std::pair<Pose, Vec3>>& places, std::ofstream* out) const {
    for (size_t k = 0; k < joints_.size(); ++k) {
      const Joint& joint = joints_[k];
      if (joint.id == nullptr) continue;
      // A joint on the world has ODE's first body, whichever it was called with.
      const bool first = joint.parent->id == nullptr || joint.child->id == nullptr;
      const double sign = joint.child->id == nullptr ? -1.0 : 1.0;
      const Vec3 f = sign * Of(first ? joint.feedback.f1 : joint.feedback.f2);
      Vec3 m = sign * Of(first ? joint.feedback.t1 : joint.feedback.t2);
      const auto& [X_WF, c] = places[k];
      m -= (X_WF.translation() - c).cross(f);
      for (const Vec3& v : {f, m}) {
        const Vec3 in_F = X_WF.linear().transpose() * v;
        for (int i = 0; i < 3; ++i) *out << ',' << in_F[i];
      }
    }
    *out << '\n';
  }

  const json& m_;
  dWorldID world_;
  std::map<std::string, Body> bodies_;
  std::deque<Joint> joints_;
  std::vector<Drive> drives_;
  std::vector<Element> elements_;
};

void Run(const json& mechanism, long steps, double* compute_s) {
  if (!std::ifstream("start.csv").good()) throw Refused("it steps free motions only");
  if (witness::ReadCsv("motion.csv").names.size() > 1) throw Refused("commands in a free motion");
  if (!witness::ReadCsv("loads.csv").rows.empty()) throw Refused("loads in a free motion");
  Engine(mechanism).Run(steps, compute_s);
}

}  // namespace

int main(int argc, char** argv) {
  const long steps = argc > 1 ? std::stol(argv[1]) : 20;
  json answer = {{"schema", "mbverify/witness/1"},
                 {"program", "ODE"},
                 {"version", "0.16.2"},
                 {"units", "SI"},
                 {"method", "absolute coordinates, dWorldStep with its default ERP and CFM, " +
                                std::to_string(steps) + " steps a sample"}};
  double compute_s = 0.0;
  dInitODE2(0);
  try {
    std::ifstream file("mechanism.json");
    Run(json::parse(file), steps, &compute_s);
    answer["compute_s"] = compute_s;
  } catch (const Refused& why) {
    answer["refused"] = why.what();
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  dCloseODE();
  std::ofstream("witness.json") << answer.dump(1) << '\n';
  return 0;
}
