#include "simulation/mjcf/plan.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/demand.h"
#include "mechanism/idle_spins.h"
#include "mechanism/joint_pose.h"
#include "mechanism/reach.h"
#include "mechanism/spanning_tree.h"

namespace mbv::mjcf {
namespace {

using Type = PlannedJoint::Type;

// The motions of a joint in the order in which X_FM composes them: type, axis at home in world
// axes, coordinate.
struct Motion1 {
  Type type;
  Vec3 axis_W;
  int coordinate;
};

std::vector<Motion1> MotionsOf(const Joint& joint, const Mat3& R_WF, const Mat3& R_WM) {
  const Vec3 axis_W = R_WF * joint.axis;
  switch (joint.kind) {
    case JointKind::kFixed:
      return {};
    case JointKind::kRevolute:
      return {{Type::kHinge, axis_W, 0}};
    case JointKind::kPrismatic:
      return {{Type::kSlide, axis_W, 0}};
    case JointKind::kCylindrical:
      return {{Type::kSlide, axis_W, 0}, {Type::kHinge, axis_W, 1}};
    case JointKind::kUniversal:
      return {{Type::kHinge, axis_W, 0}, {Type::kHinge, R_WM * joint.axis2, 1}};
    case JointKind::kPlanar: {
      const Mat3 E = JointBasis(joint);
      return {{Type::kSlide, R_WF * E.col(0), 0},
              {Type::kSlide, R_WF * E.col(1), 1},
              {Type::kHinge, axis_W, 2}};
    }
    case JointKind::kPointOnLine:
      return {{Type::kSlide, axis_W, 0}, {Type::kBall, Vec3::UnitZ(), -1}};
    case JointKind::kPointOnPlane: {
      const Mat3 E = JointBasis(joint);
      return {{Type::kSlide, R_WF * E.col(0), 0},
              {Type::kSlide, R_WF * E.col(1), 1},
              {Type::kBall, Vec3::UnitZ(), -1}};
    }
    case JointKind::kSpherical:
      return {{Type::kBall, Vec3::UnitZ(), -1}};
    case JointKind::kFree:
      return {{Type::kSlide, Vec3::UnitX(), -1},
              {Type::kSlide, Vec3::UnitY(), -2},
              {Type::kSlide, Vec3::UnitZ(), -3},
              {Type::kBall, Vec3::UnitZ(), -4}};
  }
  return {};
}

// A tree that nests at most this many bodies stays whole. A deeper one is cut where more than the
// second number have nested since the last cut: at a joint whose coordinate nothing uses, beyond
// the third number at any. Of scissors, storeys and one long loop, whose costs cross there.
constexpr int kWholeTree = 32, kCutFrom = 6, kCutAnywhere = 12;

class Planner {
 public:
  explicit Planner(const Mechanism& mechanism)
      : mechanism_(mechanism), attached_(CountAttachments()), cuts_(IsDeep()) {
    if (!cuts_) return;
    spins_.assign(mechanism.bodies.size(), false);
    for (const Spin& spin : IdleSpins(mechanism)) {
      for (const int body : spin.bodies) spins_[static_cast<size_t>(body)] = true;
    }
  }

  Plan Make() {
    const size_t n = mechanism_.bodies.size();
    plan_.bodies.push_back({.name = "world", .joints = {}});
    nested_.assign(1, 0);
    plan_.body_of.assign(n, -1);
    plan_.body_of[0] = 0;
    plan_.tiny_mass.assign(n, false);
    inboard_.assign(n, 0);
    pending_.assign(n, {});
    for (size_t k = 0; k < mechanism_.tree_joints.size(); ++k) AddTreeBody(k);
    for (size_t j = 0; j < mechanism_.joints.size(); ++j) {
      if (mechanism_.joints[j].closure) AddClosure(static_cast<int>(j), SplitsParent(j));
    }
    AssignMasses();
    return std::move(plan_);
  }

 private:
  // Things that need the body itself: closures, ends of legs and springs; tree children apart.
  std::vector<int> CountAttachments() const {
    std::vector<int> count(mechanism_.bodies.size(), 0);
    for (const Joint& joint : mechanism_.joints) {
      if (joint.closure) ++count[joint.parent], ++count[joint.child];
    }
    for (const Drive& drive : mechanism_.drives) {
      if (const auto* leg = std::get_if<DistanceDrive>(&drive.kind)) {
        ++count[leg->body_from], ++count[leg->body_to];
      }
    }
    for (const SpringDamper& spring : mechanism_.springs) {
      ++count[spring.body_from], ++count[spring.body_to];
    }
    for (const Bushing& bushing : mechanism_.bushings) {
      ++count[bushing.parent], ++count[bushing.child];
    }
    for (const ForceElement& element : mechanism_.elements) {
      if (IsGyroscopic(element)) ++count[std::get<RotorLaw>(element.law).carrier->body];
    }
    return count;
  }

  // More bodies hang on each other than a whole tree nests.
  bool IsDeep() const {
    std::vector<int> depth(mechanism_.bodies.size(), 0);
    int deepest = 0;
    for (size_t k = 0; k < mechanism_.tree_joints.size(); ++k) {
      int& own = depth[static_cast<size_t>(OutboardBody(mechanism_, k))];
      own = depth[static_cast<size_t>(InboardBody(mechanism_, k))] + 1;
      deepest = std::max(deepest, own);
    }
    return deepest > kWholeTree;
  }

  // Whether a body with mass of its own, whose tree joint would nest it `nested` deep, gets its
  // place from the world instead. Spins about a line through two balls are read from the tree.
  bool IsCutAt(size_t k, int nested) const {
    if (!cuts_ || nested <= kCutFrom) return false;
    const int j = mechanism_.tree_joints[k];
    const int inboard = InboardBody(mechanism_, k), outboard = OutboardBody(mechanism_, k);
    if (mechanism_.joints[j].kind == JointKind::kFree || plan_.body_of[inboard] < 0) return false;
    if (IsMassless(mechanism_.bodies[outboard]) || spins_[inboard] || spins_[outboard])
      return false;
    return nested > kCutAnywhere || !HasUsedCoordinate(mechanism_, j);
  }

  // The MuJoCo joints of a joint when its outboard body hangs on its inboard body.
  std::vector<PlannedJoint> JointsOf(int j, bool reversed, int inboard) const {
    const Joint& joint = mechanism_.joints[j];
    const Pose X_WF = mechanism_.X_WB_home[joint.parent] * joint.X_PF;
    const Pose X_WM = mechanism_.X_WB_home[joint.child] * joint.X_CM;
    const bool ball = joint.kind == JointKind::kSpherical ||
                      (joint.transmits_force_only && !HasUsedCoordinate(mechanism_, j));
    std::vector<Motion1> motions = ball ? std::vector<Motion1>{{Type::kBall, Vec3::UnitZ(), -1}}
                                        : MotionsOf(joint, X_WF.linear(), X_WM.linear());
    if (joint.kind == JointKind::kFree && inboard == 0) {
      motions = {{Type::kFree, Vec3::UnitZ(), -1}};
    } else if (joint.kind == JointKind::kFree) {
      reversed = false;  // its coordinates are not used; slides must come before the ball
    }
    // Seen from the child, the inverse motions are composed in the reverse order.
    if (reversed) std::reverse(motions.begin(), motions.end());
    std::vector<PlannedJoint> planned;
    for (const Motion1& motion : motions) {
      PlannedJoint p{.name = JointName(joint, motion.coordinate), .type = motion.type, .joint = j};
      p.coordinate = std::max(motion.coordinate, -1);
      p.axis_W = reversed ? Vec3(-motion.axis_W) : motion.axis_W;
      p.p_WAnchor = X_WM.translation();
      if (p.coordinate >= 0) p.ref = joint.home[p.coordinate];
      planned.push_back(p);
    }
    return planned;
  }

  bool CanMerge(int body, const std::vector<PlannedJoint>& joints) const {
    if (!IsMassless(mechanism_.bodies[body]) || attached_[body] > 0) return false;
    int children = 0;
    std::vector<PlannedJoint> chain = joints;
    for (size_t k = 0; k < mechanism_.tree_joints.size(); ++k) {
      const Joint& joint = mechanism_.joints[mechanism_.tree_joints[k]];
      const bool reversed = mechanism_.tree_reversed[k];
      if ((reversed ? joint.child : joint.parent) != body) continue;
      ++children;
      const auto next = JointsOf(mechanism_.tree_joints[k], reversed, body);
      chain.insert(chain.end(), next.begin(), next.end());
    }
    if (children != 1 || chain.size() > 6) return false;
    // MuJoCo allows no rotation after a ball, and a free joint only alone.
    const auto round = [](const PlannedJoint& p) {
      return p.type == Type::kBall || p.type == Type::kFree;
    };
    return std::none_of(chain.begin(), chain.end(), round);
  }

  void AddTreeBody(size_t k) {
    const int j = mechanism_.tree_joints[k];
    const Joint& joint = mechanism_.joints[j];
    const bool reversed = mechanism_.tree_reversed[k];
    const int inboard = reversed ? joint.child : joint.parent;
    const int body = reversed ? joint.parent : joint.child;
    const bool inboard_merged = plan_.body_of[inboard] < 0;
    std::vector<PlannedJoint> joints = pending_[inboard];
    const auto own = JointsOf(j, reversed, inboard);
    joints.insert(joints.end(), own.begin(), own.end());
    inboard_[body] = inboard_merged ? inboard_[inboard] : plan_.body_of[inboard];
    if (CanMerge(body, joints)) {
      pending_[body] = std::move(joints);
      return;
    }
    plan_.body_of[body] = static_cast<int>(plan_.bodies.size());
    const std::string& name = mechanism_.bodies[body].name;
    if (const int nested = nested_[inboard_[body]] + 1; IsCutAt(k, nested)) {
      AddBody({.name = name,
               .body = body,
               .joints = {{.name = PlaceName(mechanism_.bodies[body]), .type = Type::kFree}}});
      return AddClosure(j, reversed);
    }
    AddBody({.name = name, .body = body, .parent = inboard_[body], .joints = std::move(joints)});
  }

  void AddBody(PlannedBody body) {
    nested_.push_back(nested_[body.parent] + 1);
    plan_.bodies.push_back(std::move(body));
  }

  bool SplitsParent(size_t j) const {
    const Joint& joint = mechanism_.joints[j];
    const bool child_is_world_or_massless =
        joint.child == 0 || IsMassless(mechanism_.bodies[joint.child]);
    return child_is_world_or_massless && joint.parent != 0;
  }

  // `split_parent`: which of its bodies would be split.
  void AddClosure(int j, bool split_parent) {
    const Joint& joint = mechanism_.joints[j];
    const bool driven = HasUsedCoordinate(mechanism_, j);
    PlannedClosure closure{.name = ClosureName(joint),
                           .joint = j,
                           .body1 = plan_.body_of[joint.child],
                           .body2 = plan_.body_of[joint.parent]};
    const bool point = joint.kind == JointKind::kSpherical || joint.transmits_force_only;
    if (point && !driven) {
      closure.type = PlannedClosure::Type::kConnect;
    } else if (joint.kind == JointKind::kFixed) {
      closure.type = PlannedClosure::Type::kWeld;
    } else {
      closure.split_parent = split_parent;
      SplitBody(joint, &closure);
    }
    plan_.closures.push_back(closure);
  }

  // The half hangs on the other body of the joint.
  void SplitBody(const Joint& joint, PlannedClosure* closure) {
    closure->type = PlannedClosure::Type::kSplit;
    const int body = closure->split_parent ? joint.parent : joint.child;
    const int other = closure->split_parent ? joint.child : joint.parent;
    closure->body1 = plan_.body_of[body];
    closure->body2 = static_cast<int>(plan_.bodies.size());
    AddBody({.name = joint.name + ".half",
             .body = body,
             .half_of = closure->joint,
             .parent = plan_.body_of[other],
             .joints = JointsOf(closure->joint, closure->split_parent, other)});
  }

  void AssignMasses() {
    std::vector<int> parts(mechanism_.bodies.size(), 0);
    for (const PlannedBody& body : plan_.bodies) ++parts[body.body];
    double total = 0.0;
    for (const Body& body : mechanism_.bodies) total += body.mass;
    const double tiny = kTinyMassFraction * (total > 0.0 ? total : 1.0);
    const double gyration_m = 0.1 * Extent(mechanism_);
    constexpr double kSmallest = 2e-15;  // MuJoCo refuses less than 1e-15 kg and kg m²
    for (size_t i = 1; i < plan_.bodies.size(); ++i) {
      PlannedBody& planned = plan_.bodies[i];
      const Body& body = mechanism_.bodies[planned.body];
      planned.share = 1.0 / parts[planned.body];
      planned.mass = planned.share * body.mass;
      planned.I_Bcm_B = planned.share * body.I_Bcm_B;
      if (!IsMassless(body) || planned.joints.empty()) continue;
      plan_.tiny_mass[planned.body] = true;
      planned.mass = std::max(planned.share * tiny, kSmallest);
      planned.I_Bcm_B =
          std::max(planned.mass * gyration_m * gyration_m, kSmallest) * Mat3::Identity();
    }
  }

  const Mechanism& mechanism_;
  const std::vector<int> attached_;
  const bool cuts_;
  std::vector<bool> spins_;  // per body, where the tree is cut: part of an idle spin
  Plan plan_;
  std::vector<int> nested_;                         // per planned body: bodies it hangs on, and it
  std::vector<int> inboard_;                        // plan index that a (merged) body hangs on
  std::vector<std::vector<PlannedJoint>> pending_;  // joints of merged bodies
};

}  // namespace

double Extent(const Mechanism& mechanism) {
  Vec3 low = Vec3::Constant(1e300), high = -low;
  for (const Joint& joint : mechanism.joints) {
    if (joint.kind == JointKind::kFree) continue;
    const Vec3 p = mechanism.X_WB_home[joint.child] * joint.X_CM.translation();
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double least = CharacteristicLength(mechanism);
  return low.x() > high.x() ? least : std::max((high - low).norm(), least);
}

Plan MakePlan(const Mechanism& mechanism) {
  MBV_DEMAND(mechanism.X_WB_home.size() == mechanism.bodies.size(), mechanism.X_WB_home.size());
  return Planner(mechanism).Make();
}

std::string JointName(const Joint& joint, int coordinate) {
  if (joint.kind == JointKind::kFree && coordinate < -1) {
    return joint.name + "." + std::to_string(-1 - coordinate);
  }
  if (DofsOf(joint.kind) == 1 || coordinate < 0) return joint.name;
  return joint.name + "." + std::to_string(coordinate);
}

std::string PlaceName(const Body& body) { return "place:" + body.name; }
std::string ClosureName(const Joint& joint) { return "close:" + joint.name; }
std::string DriveEqualityName(const Drive& drive) { return "drive:" + drive.name; }
std::string BaseEqualityName(const Prescribed& base) { return "base:" + base.name; }
std::string CouplingName(const Coupling& coupling) { return "couple:" + coupling.name; }

namespace {

bool IsLinear(const Coupling::Term& term) { return term.polynomial.size() == 1; }

// The polynomial Σ_i a_i q^i, i ≥ 1, in x = q − ref.
std::array<double, 5> Shifted(const std::vector<double>& coefficients, double ref) {
  std::array<double, 5> b{};
  for (size_t i = coefficients.size(); i-- > 0;) {
    // b ← (b + a_i) (ref + x), Horner's rule with a polynomial.
    b[0] += coefficients[i];
    for (size_t k = 4; k > 0; --k) b[k] = ref * b[k] + b[k - 1];
    b[0] *= ref;
  }
  return b;
}

}  // namespace

PlannedCoupling PlanCoupling(const Mechanism& mechanism, const Coupling& coupling) {
  PlannedCoupling out;
  const auto ref = [&](const Coupling::Term& term) {
    return mechanism.joints[term.joint].home[term.coordinate];
  };
  const std::vector<Coupling::Term>& terms = coupling.terms;
  // Joint 1 is the one that moves more: MuJoCo makes the row as soft as both joints are light,
  // whatever their ratio, and its error counts in joint 1.
  auto linear = std::ranges::find_if(terms, IsLinear);
  for (auto other = linear; other != terms.end(); ++other) {
    const bool moves_more =
        IsLinear(*other) && std::abs(other->polynomial[0]) < std::abs(linear->polynomial[0]);
    if (moves_more) linear = other;
  }
  if (terms.size() <= 2 && linear != terms.end()) {
    out.type = PlannedCoupling::Type::kJoint;
    out.first = static_cast<size_t>(linear - terms.begin());
    out.second = terms.size() - 1 - out.first;
    const Coupling::Term& one = terms[out.first];
    const double c = one.polynomial[0];
    if (terms.size() == 2) {
      out.polycoef = Shifted(terms[out.second].polynomial, ref(terms[out.second]));
    }
    out.polycoef[0] += coupling.constant;
    for (double& a : out.polycoef) a *= -1.0 / c;
    out.polycoef[0] -= ref(one);
  } else if (std::ranges::all_of(terms, IsLinear)) {
    out.type = PlannedCoupling::Type::kTendon;
    out.polycoef[0] = -coupling.constant;
    for (const Coupling::Term& term : terms) out.polycoef[0] -= term.polynomial[0] * ref(term);
  }
  return out;
}

std::string NestingTrouble(const Plan& plan) {
  constexpr int kDeepest = 96;  // of 100 elements: <mujoco>, <worldbody> and what a body holds
  std::vector<int> depth(plan.bodies.size(), 0);
  int deepest = 0;
  for (size_t b = 1; b < plan.bodies.size(); ++b) {
    depth[b] = depth[static_cast<size_t>(plan.bodies[b].parent)] + 1;
    deepest = std::max(deepest, depth[b]);
  }
  if (deepest <= kDeepest) return "";
  return fmt::format(
      "a chain of {} bodies is too deep for MJCF, where bodies nest: MuJoCo's XML reader takes {}",
      deepest, kDeepest);
}

// What MuJoCo has of the force elements.

namespace {

// A tendon's spring length below zero would mean another one to MuJoCo.
bool IsPlannedSpring(const ForceElement& element, const SpringLaw& spring) {
  const double k = spring.polynomial[0];
  if (spring.polynomial.size() != 1 || !(k > 0.0)) return false;
  return element.drive < 0 || spring.free - spring.preload / k >= 0.0;
}

template <typename Acts>
PlannedForces SumOf(const Mechanism& mechanism, const Acts& acts) {
  PlannedForces sum;
  double force_at_zero = 0.0;
  for (const ForceElement& element : mechanism.elements) {
    if (!acts(element)) continue;
    if (IsPlainFriction(mechanism, element)) {
      sum.friction += std::get<FrictionLaw>(element.law).coulomb;
    }
    if (!IsPlanned(element)) continue;
    if (const auto* damping = std::get_if<DampingLaw>(&element.law)) {
      sum.damping += damping->damping;
    } else if (const auto* spring = std::get_if<SpringLaw>(&element.law)) {
      sum.stiffness += spring->polynomial[0];
      force_at_zero += spring->polynomial[0] * spring->free - spring->preload;
    } else if (const auto* rotor = std::get_if<RotorLaw>(&element.law)) {
      sum.armature += rotor->reflected();
    }
  }
  if (sum.stiffness > 0.0) sum.free = force_at_zero / sum.stiffness;
  return sum;
}

}  // namespace

bool IsPlanned(const ForceElement& element) {
  if (element.bushing >= 0 || element.spring >= 0 || IsGyroscopic(element)) return false;
  if (const auto* spring = std::get_if<SpringLaw>(&element.law)) {
    return IsPlannedSpring(element, *spring);
  }
  return std::holds_alternative<DampingLaw>(element.law) ||
         (std::holds_alternative<RotorLaw>(element.law) && element.drive < 0);
}

bool IsPlainFriction(const Mechanism& mechanism, const ForceElement& element) {
  const auto* law = std::get_if<FrictionLaw>(&element.law);
  if (law == nullptr || element.joint < 0 || element.bushing >= 0) return false;
  const JointKind kind = mechanism.joints[static_cast<size_t>(element.joint)].kind;
  const bool scalar = kind != JointKind::kFree && !IsOfBall(kind, element.coordinate);
  return scalar && law->breakaway == law->coulomb && !law->by_load() && law->resists == 0;
}

PlannedForces ForcesOfJoint(const Mechanism& mechanism, int joint, int coordinate) {
  return SumOf(mechanism, [&](const ForceElement& element) {
    return element.joint == joint && element.coordinate == coordinate;
  });
}

bool HasEqualForces(const Mechanism& mechanism, int free_joint) {
  const PlannedForces first = ForcesOfJoint(mechanism, free_joint, 0);
  for (int k = 1; k < 6; ++k) {
    const PlannedForces other = ForcesOfJoint(mechanism, free_joint, k);
    if (other.damping != first.damping || other.armature != first.armature) return false;
  }
  return true;
}

PlannedForces ForcesOfDrive(const Mechanism& mechanism, int drive) {
  return SumOf(mechanism, [&](const ForceElement& element) { return element.drive == drive; });
}

}  // namespace mbv::mjcf
