#include "simulation/mjcf/compliant.h"

#include <fmt/format.h>
#include <tinyxml2.h>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <string_view>

#include "base/demand.h"
#include "mechanism/joint_pose.h"
#include "mechanism/spanning_tree.h"
#include "simulation/mjcf/mjcf.h"
#include "simulation/mjcf/plan.h"
#include "simulation/mjcf/sections.h"

namespace mbv::mjcf {
namespace {

// Two points of a body are one node below this distance, as a fraction of its longest beam.
constexpr double kSamePoint = 1e-6;
// Any mass will do: nothing moves. It also keeps the planner from merging pieces.
constexpr double kPieceMass = 1.0, kPieceInertia = 0.1;

std::string ServoName(const Drive& drive) { return drive.name + " (servo)"; }

class Expander {
 public:
  Expander(const Mechanism& mechanism, const std::vector<Pose>& X_WB, int output)
      : source_(mechanism), X_WB_(X_WB), output_(output) {}

  std::optional<CompliantModel> Make(std::string* error) {
    MBV_DEMAND(X_WB_.size() == source_.bodies.size(), X_WB_.size());
    MBV_DEMAND(output_ >= 0 && output_ < static_cast<int>(source_.outputs.size()), output_);
    if (!source_.springs.empty()) error_ = "spring-dampers are not part of a stiffness model";
    MakePieces();
    JoinRigidly();
    NameBodies();
    AddJoints();
    AddBeams();
    AddDrives();
    AddOutput();
    if (error_.empty()) GrowTree();
    if (!error_.empty()) {
      *error = error_;
      return std::nullopt;
    }
    model_.mjcf = TextWithSprings(model_);
    return std::move(model_);
  }

 private:
  struct Piece {
    int body = 0;           // of the source
    Vec3 p = Vec3::Zero();  // the node in the body frame; rigid bodies: unused
    int link = 0;           // union-find over rigid connections
    int index = -1;         // expanded body, for the root of a group
  };

  void MakePieces() {
    pieces_of_.resize(source_.bodies.size());
    nodes_.assign(source_.bodies.size(), false);
    longest_.assign(source_.bodies.size(), 0.0);
    for (const Beam& beam : source_.beams) {
      nodes_[beam.body] = true;
      longest_[beam.body] = std::max(longest_[beam.body], beam.length());
    }
    if (nodes_[0]) Fail("the world has no beams: give them to a body that is fixed to it");
    for (size_t b = 0; b < source_.bodies.size(); ++b) {
      if (!nodes_[b]) AddPiece(static_cast<int>(b), Vec3::Zero());
    }
    for (const Beam& beam : source_.beams) {
      if (NodeAt(beam.body, beam.p_from) < 0) AddPiece(beam.body, beam.p_from);
      if (NodeAt(beam.body, beam.p_to) < 0) AddPiece(beam.body, beam.p_to);
    }
  }

  void AddPiece(int body, const Vec3& p) {
    const int k = static_cast<int>(pieces_.size());
    pieces_.push_back({.body = body, .p = p, .link = k});
    pieces_of_[body].push_back(k);
  }

  [[nodiscard]] int NodeAt(int body, const Vec3& p) const {
    for (const int k : pieces_of_[body]) {
      if ((pieces_[k].p - p).norm() <= kSamePoint * longest_[body]) return k;
    }
    return -1;
  }

  // The piece that carries the point `p` of a body.
  int PieceAt(int body, const Vec3& p, const std::string& what) {
    if (!nodes_[body]) return pieces_of_[body][0];
    const int k = NodeAt(body, p);
    if (k >= 0) return k;
    Fail(fmt::format("{} is at no end of a beam of the elastic body '{}'", what,
                     source_.bodies[body].name));
    return pieces_of_[body][0];
  }

  int ParentPiece(const Joint& joint) {
    return PieceAt(joint.parent, joint.X_PF.translation(), "joint '" + joint.name + "'");
  }
  int ChildPiece(const Joint& joint) {
    return PieceAt(joint.child, joint.X_CM.translation(), "joint '" + joint.name + "'");
  }

  int Root(int k) const {
    while (pieces_[k].link != k) k = pieces_[k].link;
    return k;
  }
  void Unite(int a, int b) {
    a = Root(a), b = Root(b);
    pieces_[std::max(a, b)].link = std::min(a, b);  // the world, piece 0, stays a root
  }

  // Joints that a locked drive or a given motion makes rigid.
  [[nodiscard]] std::vector<bool> HeldJoints() const {
    std::vector<bool> held(source_.joints.size(), false);
    for (const Prescribed& base : source_.prescribed) held[base.joint] = true;
    for (const Drive& drive : source_.drives) {
      const auto* driven = std::get_if<JointDrive>(&drive.kind);
      if (driven == nullptr || std::isfinite(drive.stiffness)) continue;
      if (DofsOf(source_.joints[driven->joint].kind) == 1) held[driven->joint] = true;
    }
    return held;
  }

  void JoinRigidly() {
    const std::vector<bool> held = HeldJoints();
    for (size_t j = 0; j < source_.joints.size(); ++j) {
      const Joint& joint = source_.joints[j];
      if (held[j] || joint.kind == JointKind::kFixed) Unite(ParentPiece(joint), ChildPiece(joint));
    }
    joint_index_.assign(source_.joints.size(), -1);
  }

  // One expanded body per group of pieces, with the frame of the first piece's body.
  void NameBodies() {
    Mechanism& m = model_.mechanism;
    m.name = source_.name + "_compliant";
    m.gravity_W = Vec3::Zero();
    m.up_W = source_.up_W;
    for (size_t k = 0; k < pieces_.size(); ++k) {
      if (Root(static_cast<int>(k)) != static_cast<int>(k)) continue;
      const bool world = k == 0;
      pieces_[k].index = AddBody(world ? "world" : PieceName(pieces_[k]), X_WB_[pieces_[k].body],
                                 world ? 0.0 : kPieceMass);
    }
  }

  [[nodiscard]] std::string PieceName(const Piece& piece) const {
    const Body& body = source_.bodies[piece.body];
    if (!nodes_[piece.body]) return body.name;
    for (const NamedFrame& frame : body.frames) {
      const Vec3 gap = frame.X_BF.translation() - piece.p;
      if (gap.norm() <= kSamePoint * longest_[piece.body]) return body.name + "@" + frame.name;
    }
    for (size_t i = 0; i < pieces_of_[piece.body].size(); ++i) {
      if (&pieces_[pieces_of_[piece.body][i]] == &piece) return fmt::format("{}@{}", body.name, i);
    }
    return body.name;
  }

  int AddBody(const std::string& name, const Pose& X_WB, double mass) {
    Mechanism& m = model_.mechanism;
    Body body;
    body.name = name;
    body.mass = mass;
    if (mass > 0.0) body.I_Bcm_B = kPieceInertia * Mat3::Identity();
    m.bodies.push_back(body);
    m.X_WB_home.push_back(X_WB);
    return static_cast<int>(m.bodies.size()) - 1;
  }

  [[nodiscard]] int BodyOf(int piece) const { return pieces_[Root(piece)].index; }

  // A frame of a source body in the expanded body that carries the piece.
  [[nodiscard]] Pose FrameOn(int piece, int source_body, const Pose& X_BF) const {
    const int root = Root(piece);
    if (pieces_[root].body == source_body) return X_BF;
    return X_WB_[pieces_[root].body].inverse() * X_WB_[source_body] * X_BF;
  }
  [[nodiscard]] Vec3 PointOn(int piece, int source_body, const Vec3& p) const {
    Pose X = Pose::Identity();
    X.translation() = p;
    return FrameOn(piece, source_body, X).translation();
  }

  void AddJoints() {
    for (size_t j = 0; j < source_.joints.size(); ++j) {
      const Joint& joint = source_.joints[j];
      const int parent = ParentPiece(joint), child = ChildPiece(joint);
      if (Root(parent) == Root(child)) continue;  // rigid, or between parts held otherwise
      Joint copy = joint;
      copy.parent = BodyOf(parent);
      copy.X_PF = FrameOn(parent, joint.parent, joint.X_PF);
      copy.child = BodyOf(child);
      copy.X_CM = FrameOn(child, joint.child, joint.X_CM);
      copy.closure = false;
      copy.transmits_force_only = false;
      const Pose X_FM =
          (X_WB_[joint.parent] * joint.X_PF).inverse() * X_WB_[joint.child] * joint.X_CM;
      copy.home = copy.guess = CoordinatesOf(joint, X_FM);
      joint_index_[j] = AddJoint(copy, std::nullopt);
    }
  }

  int AddJoint(const Joint& joint, std::optional<bool> hint) {
    model_.mechanism.joints.push_back(joint);
    hints_.push_back(hint);
    return static_cast<int>(hints_.size()) - 1;
  }

  void AddBeams() {
    // Groups that beams alone connect: a beam that closes a ring of beams is welded at its end.
    std::vector<int> link(model_.mechanism.bodies.size());
    std::iota(link.begin(), link.end(), 0);
    const auto root = [&link](int b) {
      while (link[b] != b) b = link[b];
      return b;
    };
    for (const Beam& beam : source_.beams) {
      if (beam.length() <= kSamePoint * longest_[beam.body]) continue;  // of no length
      const int from = NodeAt(beam.body, beam.p_from), to = NodeAt(beam.body, beam.p_to);
      const int body_from = BodyOf(from), body_to = BodyOf(to);
      if (body_from == body_to) continue;  // its ends are held against each other
      int end = body_to;
      if (root(body_from) == root(body_to)) {
        end = AddBody(beam.name + "@end", model_.mechanism.X_WB_home[body_to], kPieceMass);
        Joint weld;
        weld.name = beam.name + ".end";
        weld.parent = body_to;
        weld.child = end;
        weld.X_PF = weld.X_CM = FrameOn(to, beam.body, MidSpan(beam));
        AddJoint(weld, true);
      } else {
        link[root(body_from)] = root(body_to);
      }
      AddMidSpan(beam, body_from, FrameOn(from, beam.body, MidSpan(beam)), end,
                 FrameOn(to, beam.body, MidSpan(beam)));
    }
  }

  [[nodiscard]] static Pose MidSpan(const Beam& beam) {
    Pose X = Pose::Identity();
    X.linear() = beam.R_BE;
    X.translation() = 0.5 * (beam.p_from + beam.p_to);
    return X;
  }

  // Slides, then hinges, along x, y, z of the beam: massless bodies in between, which the planner
  // merges into the far piece.
  void AddMidSpan(const Beam& beam, int from, const Pose& X_from, int to, const Pose& X_to) {
    const Section& s = beam.section;
    const double L = beam.length(), E = beam.youngs_modulus;
    const std::array<double, 6> stiffness{E * s.area / L,
                                          12.0 * E * s.I_z / (L * L * L),
                                          12.0 * E * s.I_y / (L * L * L),
                                          beam.shear_modulus * s.torsion / L,
                                          E * s.I_y / L,
                                          E * s.I_z / L};
    const std::array<const char*, 6> suffix{"x", "y", "z", "rx", "ry", "rz"};
    int parent = from;
    Pose X_PF = X_from;
    for (int i = 0; i < 6; ++i) {
      Joint joint;
      joint.name = beam.name + "." + suffix[i];
      joint.kind = i < 3 ? JointKind::kPrismatic : JointKind::kRevolute;
      joint.axis = Vec3::Unit(i % 3);
      joint.parent = parent;
      joint.X_PF = X_PF;
      const Pose X_WF = model_.mechanism.X_WB_home[parent] * X_PF;
      joint.child = i < 5 ? AddBody(joint.name, X_WF, 0.0) : to;
      if (i == 5) joint.X_CM = X_to;
      AddJoint(joint, false);
      AddSpring({.element = beam.name, .object = joint.name, .stiffness = stiffness[i]});
      parent = joint.child;
      X_PF = Pose::Identity();
    }
  }

  void AddSpring(const ElasticSpring& spring) {
    if (!(spring.stiffness > 0.0) || !std::isfinite(spring.stiffness)) {
      Fail(fmt::format("the stiffness of '{}' is {}, not a positive number", spring.element,
                       spring.stiffness));
    }
    model_.springs.push_back(spring);
  }

  void AddDrives() {
    for (const Drive& drive : source_.drives) {
      if (const auto* driven = std::get_if<JointDrive>(&drive.kind)) {
        AddJointDrive(drive, *driven);
      } else {
        AddLeg(drive, std::get<DistanceDrive>(drive.kind));
      }
    }
  }

  void AddJointDrive(const Drive& drive, const JointDrive& driven) {
    const int index = joint_index_[driven.joint];
    if (index < 0) return;  // rigid
    const Joint& joint = model_.mechanism.joints[index];
    if (!IsScalar(joint.kind, driven.coordinate)) {
      Fail("drive '" + drive.name + "' holds a coordinate of the ball or free joint '" +
           joint.name + "', which MuJoCo does not have");
    } else if (std::isfinite(drive.stiffness)) {
      AddSpring({.element = ServoName(drive),
                 .object = JointName(joint, driven.coordinate),
                 .stiffness = drive.stiffness});
    } else {
      model_.mechanism.drives.push_back(
          {.name = drive.name, .kind = JointDrive{index, driven.coordinate}, .range = {}});
    }
  }

  void AddLeg(const Drive& drive, const DistanceDrive& leg) {
    const std::string what = "an end of drive '" + drive.name + "'";
    const int from = PieceAt(leg.body_from, leg.p_from, what);
    const int to = PieceAt(leg.body_to, leg.p_to, what);
    if (Root(from) == Root(to)) return;
    const Vec3 p_from = PointOn(from, leg.body_from, leg.p_from);
    const Vec3 p_to = PointOn(to, leg.body_to, leg.p_to);
    if (!std::isfinite(drive.stiffness)) {
      model_.mechanism.drives.push_back(
          {.name = drive.name,
           .kind = DistanceDrive{BodyOf(from), p_from, BodyOf(to), p_to},
           .range = {}});
      return;
    }
    const double length =
        (X_WB_[leg.body_to] * leg.p_to - X_WB_[leg.body_from] * leg.p_from).norm();
    model_.mechanism.springs.push_back({.name = drive.name,
                                        .body_from = BodyOf(from),
                                        .p_from = p_from,
                                        .body_to = BodyOf(to),
                                        .p_to = p_to,
                                        .stiffness = drive.stiffness,
                                        .free_length_m = length});
    AddSpring({.element = ServoName(drive),
               .object = drive.name,
               .is_tendon = true,
               .stiffness = drive.stiffness,
               .reference = length});
  }

  void AddOutput() {
    const Output& source = source_.outputs[output_];
    const int piece =
        PieceAt(source.body, source.X_BO.translation(), "output '" + source.name + "'");
    Output output;
    output.name = source.name;
    output.body = BodyOf(piece);
    output.X_BO = FrameOn(piece, source.body, source.X_BO);
    model_.mechanism.outputs.push_back(output);
  }

  void GrowTree() {
    const SpanningTreeResult tree = BuildSpanningTree(&model_.mechanism, hints_);
    if (!tree.unconnected_bodies.empty()) {
      Fail("no joint or beam connects '" +
           model_.mechanism.bodies[tree.unconnected_bodies[0]].name + "' to the world");
    }
    MBV_DEMAND(tree.hints_broken.empty(), tree.hints_broken.size());
  }

  void Fail(const std::string& message) {
    if (error_.empty()) error_ = message;
  }

  const Mechanism& source_;
  const std::vector<Pose>& X_WB_;
  const int output_;
  CompliantModel model_;
  std::string error_;
  std::vector<Piece> pieces_;
  std::vector<std::vector<int>> pieces_of_;  // per source body
  std::vector<bool> nodes_;                  // per source body: elastic
  std::vector<double> longest_;              // beam per source body [m]
  std::vector<int> joint_index_;             // expanded joint per source joint, -1 if rigid
  ClosureHints hints_;                       // per expanded joint
};

}  // namespace

std::optional<CompliantModel> MakeCompliantModel(const Mechanism& mechanism,
                                                 const std::vector<Pose>& X_WB, int output,
                                                 std::string* error) {
  return Expander(mechanism, X_WB, output).Make(error);
}

namespace {

using SpringsByJoint = std::map<std::string, const ElasticSpring*>;

void SetSprings(tinyxml2::XMLElement* element, const SpringsByJoint& on_joint) {
  for (auto* child = element->FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    const char* name = child->Attribute("name");
    const bool is_joint = std::string_view(child->Name()) == "joint";
    const auto spring = is_joint && name != nullptr ? on_joint.find(name) : on_joint.end();
    if (spring != on_joint.end() && child->Attribute("type") != nullptr) {
      child->SetAttribute("stiffness", NumberText(spring->second->stiffness).c_str());
      child->SetAttribute("springref", "0");
      for (const char* of_own_zero : {"ref", "range", "limited"}) {
        child->DeleteAttribute(of_own_zero);
      }
    }
    SetSprings(child, on_joint);
  }
}

}  // namespace

std::string TextWithSprings(const CompliantModel& model) {
  SpringsByJoint on_joint;
  for (const ElasticSpring& spring : model.springs) {
    if (!spring.is_tendon) on_joint[spring.object] = &spring;
  }
  tinyxml2::XMLDocument document;
  const std::string text = WriteMjcf(model.mechanism, {.pictures = false, .statics = true});
  MBV_DEMAND(document.Parse(text.c_str(), text.size()) == tinyxml2::XML_SUCCESS, text);
  SetSprings(document.RootElement(), on_joint);
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace mbv::mjcf
