#include "features/mutation/mutation_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <tuple>

#include "kinematics/home.h"
#include "mechanism/spanning_tree.h"

namespace mbv {
namespace {

constexpr double kStandardGravity = 9.80665;
constexpr double kSameGravity = 0.02;  // relative: what is taken for the Earth's gravity
constexpr size_t kMostAssemblies = 12;
constexpr int kAssemblyTries = 60;   // random starts for another assembly
constexpr double kOtherPose = 1e-3;  // entries of a pose matrix [m, 1]
constexpr std::uint64_t kSeed = 20221;

// "limb2.U1" → "U1": equal parts differ by the instance's name only.
std::string KindOf(const std::string& name) { return name.substr(name.rfind('.') + 1); }

class Collector {
 public:
  explicit Collector(const Mechanism& mechanism) : m_(mechanism) {}

  std::vector<StructuralFault> Collect() {
    SwappedDrives();
    FlippedAxes();
    UniversalAxes();
    ProductsOfInertia();
    OtherAssembly();
    MissingClosures();
    ReversedCouplings();
    WrongElements();
    TurnedRotors();
    ExchangedBushings();
    StandardGravity();
    return std::move(faults_);
  }

 private:
  void Add(const std::string& kind, const std::string& where, Mechanism wrong) {
    faults_.push_back({.kind = kind, .where = where});
    faults_.back().wrong.push_back(std::move(wrong));
  }
  void NotApplicable(const std::string& kind, const std::string& why) {
    faults_.push_back({.kind = kind, .not_applicable = why});
  }
  // The first of its kind, or counted as one more like it.
  bool IsFirst(std::map<std::string, size_t>* seen, const std::string& name) {
    const auto [found, first] = seen->emplace(KindOf(name), faults_.size());
    if (!first) ++faults_[found->second].alike;
    return first;
  }

  // Every drive with the next one of its unit.
  void SwappedDrives() {
    const std::string kind = "swapped drives";
    const size_t before = faults_.size();
    for (size_t i = 0; i < m_.drives.size(); ++i) {
      for (size_t j = i + 1; j < m_.drives.size(); ++j) {
        if (PositionUnit(m_, m_.drives[i]) != PositionUnit(m_, m_.drives[j])) continue;
        Mechanism wrong = m_;
        std::swap(wrong.drives[i].kind, wrong.drives[j].kind);
        for (ForceElement& element : wrong.elements) {
          if (element.drive == static_cast<int>(i)) {
            element.drive = static_cast<int>(j);
          } else if (element.drive == static_cast<int>(j)) {
            element.drive = static_cast<int>(i);
          }
        }
        Add(kind, m_.drives[i].name + " and " + m_.drives[j].name, std::move(wrong));
        faults_.back().first = m_.drives[i].name;
        faults_.back().second = m_.drives[j].name;
        break;
      }
    }
    if (faults_.size() == before) NotApplicable(kind, "there are no two drives of one unit");
  }

  // The axis of a driven or prescribed joint points the other way; the home pose stays.
  void FlippedAxes() {
    const std::string kind = "flipped axis";
    const size_t before = faults_.size();
    std::map<std::string, size_t> seen;
    const auto flip = [&](int index) {
      const Joint& joint = m_.joints[static_cast<size_t>(index)];
      if (DofsOf(joint.kind) != 1 || !IsFirst(&seen, joint.name)) return;
      Mechanism wrong = m_;
      Joint& flipped = wrong.joints[static_cast<size_t>(index)];
      flipped.axis = -flipped.axis;
      flipped.guess[0] = -flipped.guess[0];
      flipped.home[0] = -flipped.home[0];
      flipped.range[0] = {-joint.range[0].upper, -joint.range[0].lower};
      for (Coupling& coupling : wrong.couplings) CountBackwards(index, &coupling);
      for (ForceElement& element : wrong.elements) CountBackwards(index, &element);
      Add(kind, joint.name, std::move(wrong));
    };
    for (const Drive& drive : m_.drives) {
      if (const auto* of_joint = std::get_if<JointDrive>(&drive.kind)) flip(of_joint->joint);
    }
    for (const Prescribed& prescribed : m_.prescribed) flip(prescribed.joint);
    if (faults_.size() == before) {
      NotApplicable(kind, "its drives act along distances, which have no axis");
    }
  }

  // What is coupled to a joint's coordinate stays so when that counts the other way.
  static void CountBackwards(int joint, Coupling* coupling) {
    for (Coupling::Term& term : coupling->terms) {
      if (term.joint != joint) continue;
      for (size_t i = 0; i < term.polynomial.size(); i += 2) term.polynomial[i] *= -1.0;
    }
  }

  // A spring pulls the same way when its coordinate counts the other way.
  static void CountBackwards(int joint, ForceElement* element) {
    auto* spring = std::get_if<SpringLaw>(&element->law);
    if (element->joint != joint) return;
    if (auto* stop = std::get_if<StopLaw>(&element->law)) {
      std::tie(stop->lower, stop->upper) = std::pair(-stop->upper, -stop->lower);
    }
    const auto reverse = [](CurveLaw* curve) {
      for (CurveLaw::Knot& knot : curve->knots) {
        knot = {-knot.at, -knot.force, knot.slope_after, knot.slope_before};
      }
      std::ranges::reverse(curve->knots);
    };
    if (auto* curve = std::get_if<CurveLaw>(&element->law)) reverse(curve);
    if (auto* curves = std::get_if<CurvesLaw>(&element->law)) {
      for (CurveLaw& curve : curves->curves) reverse(&curve);
      for (double& rate : curves->rates) rate = -rate;
      std::ranges::reverse(curves->rates);
      std::ranges::reverse(curves->curves);
    }
    if (auto* expression = std::get_if<ExpressionLaw>(&element->law)) {
      const ExpressionLaw of = *expression;
      expression->text = "the other way round: " + of.text;
      expression->force = [of](double x, double v) { return -of.force(-x, -v); };
      if (of.branch) {
        expression->branch = [of](double x, double v) { return of.branch(-x, -v); };
        expression->on_branch = [of](int branch, double x, double v) {
          return -of.on_branch(branch, -x, -v);
        };
      }
    }
    if (IsGyroscopic(*element)) std::get<RotorLaw>(element->law).ratio *= -1.0;
    if (spring == nullptr) return;
    spring->free *= -1.0;
    spring->preload *= -1.0;
    for (size_t i = 1; i < spring->polynomial.size(); i += 2) spring->polynomial[i] *= -1.0;
  }

  static void TurnRound(CurveLaw* curve) {
    for (CurveLaw::Knot& knot : curve->knots) {
      knot = {knot.at, -knot.force, -knot.slope_before, -knot.slope_after};
    }
  }

  // The force of a preload, a curve or an expression acts the other way, that of a stop grows with
  // the depth alone; a gear turns a rotor as if its inertia grew with the ratio and not with its
  // square.
  void WrongElements() {
    std::map<std::string, size_t> preloaded, geared, curved, stopped;
    for (size_t e = 0; e < m_.elements.size(); ++e) {
      const ForceElement& element = m_.elements[e];
      Mechanism wrong = m_;
      if (const auto* spring = std::get_if<SpringLaw>(&element.law)) {
        if (spring->preload == 0.0 || !IsFirst(&preloaded, element.name)) continue;
        std::get<SpringLaw>(wrong.elements[e].law).preload *= -1.0;
        Add("preload the other way", element.name, std::move(wrong));
      } else if (std::holds_alternative<CurveLaw>(element.law)) {
        if (!IsFirst(&curved, element.name)) continue;
        TurnRound(&std::get<CurveLaw>(wrong.elements[e].law));
        Add("curve the other way", element.name, std::move(wrong));
      } else if (std::holds_alternative<CurvesLaw>(element.law)) {
        if (!IsFirst(&curved, element.name)) continue;
        for (CurveLaw& curve : std::get<CurvesLaw>(wrong.elements[e].law).curves) TurnRound(&curve);
        Add("curve the other way", element.name, std::move(wrong));
      } else if (const auto* expression = std::get_if<ExpressionLaw>(&element.law)) {
        if (!IsFirst(&curved, element.name)) continue;
        const ExpressionLaw of = *expression;
        ExpressionLaw turned = of;
        turned.text = "-(" + of.text + ")";
        turned.force = [of](double x, double v) { return -of.force(x, v); };
        if (of.branch) {
          turned.on_branch = [of](int branch, double x, double v) {
            return -of.on_branch(branch, x, v);
          };
        }
        wrong.elements[e].law = std::move(turned);
        Add("expression the other way", element.name, std::move(wrong));
      } else if (const auto* stop = std::get_if<StopLaw>(&element.law)) {
        if (stop->exponent == 1.0 || !IsFirst(&stopped, element.name)) continue;
        std::get<StopLaw>(wrong.elements[e].law).exponent = 1.0;
        Add("stop without its exponent", element.name, std::move(wrong));
      } else if (const auto* rotor = std::get_if<RotorLaw>(&element.law)) {
        if (std::abs(rotor->ratio) == 1.0 || !IsFirst(&geared, element.name)) continue;
        std::get<RotorLaw>(wrong.elements[e].law).ratio = std::sqrt(std::abs(rotor->ratio));
        Add("ratio of a rotor not squared", element.name, std::move(wrong));
      }
    }
  }

  // A rotor turns the other way in its carrier: the same reflected inertia, the opposite gyroscopic
  // moment.
  void TurnedRotors() {
    std::map<std::string, size_t> seen;
    for (size_t e = 0; e < m_.elements.size(); ++e) {
      if (!IsGyroscopic(m_.elements[e]) || !IsFirst(&seen, m_.elements[e].name)) continue;
      Mechanism wrong = m_;
      std::get<RotorLaw>(wrong.elements[e].law).ratio *= -1.0;
      Add("rotor the other way", m_.elements[e].name, std::move(wrong));
    }
  }

  // Stiffnesses along the axes of the child's frame instead of the parent's; for rotations that is
  // the same.
  void ExchangedBushings() {
    std::map<std::string, size_t> seen;
    for (size_t b = 0; b < m_.bushings.size(); ++b) {
      const bool pushes = std::ranges::any_of(m_.elements, [&](const ForceElement& element) {
        return element.bushing == static_cast<int>(b) && element.coordinate < 3;
      });
      if (!pushes || !IsFirst(&seen, m_.bushings[b].name)) continue;
      Mechanism wrong = m_;
      Bushing& bushing = wrong.bushings[b];
      std::swap(bushing.parent, bushing.child);
      std::swap(bushing.X_PF, bushing.X_CM);
      Add("bushing axes of its child", bushing.name, std::move(wrong));
    }
  }

  // The last coordinate counts the other way in it: an outer gear for an inner one. Home stays.
  void ReversedCouplings() {
    std::map<std::string, size_t> seen;
    for (size_t c = 0; c < m_.couplings.size(); ++c) {
      if (!IsFirst(&seen, m_.couplings[c].name)) continue;
      Mechanism wrong = m_;
      Coupling& coupling = wrong.couplings[c];
      Coupling::Term& last = coupling.terms.back();
      const double q = m_.joints[static_cast<size_t>(last.joint)].home[last.coordinate];
      double power = q;
      for (double& coefficient : last.polynomial) {
        coupling.constant += 2.0 * coefficient * power;
        coefficient *= -1.0;
        power *= q;
      }
      Add("reversed coupling", m_.couplings[c].name, std::move(wrong));
    }
  }

  // The outer axis first and the inner one last: another order of the same two turns.
  void UniversalAxes() {
    const std::string kind = "exchanged universal-joint axes";
    const size_t before = faults_.size();
    std::map<std::string, size_t> seen;
    for (size_t j = 0; j < m_.joints.size(); ++j) {
      if (m_.joints[j].kind != JointKind::kUniversal || !IsFirst(&seen, m_.joints[j].name))
        continue;
      Mechanism wrong = m_;
      Joint& joint = wrong.joints[j];
      std::swap(joint.axis, joint.axis2);
      std::swap(joint.home[0], joint.home[1]);
      std::swap(joint.range[0], joint.range[1]);
      if (!ResolveHome(&wrong)) {
        faults_.push_back(
            {.kind = kind,
             .where = m_.joints[j].name,
             .not_applicable = "with its axes exchanged the loops do not close at home"});
        continue;
      }
      Add(kind, m_.joints[j].name, std::move(wrong));
    }
    if (faults_.size() == before) NotApplicable(kind, "it has no universal joint");
  }

  void ProductsOfInertia() {
    const std::string kind = "sign of products of inertia";
    const size_t before = faults_.size();
    std::map<std::string, size_t> seen;
    for (size_t b = 1; b < m_.bodies.size(); ++b) {
      const Mat3& I = m_.bodies[b].I_Bcm_B;
      const Mat3 diagonal = I.diagonal().asDiagonal();
      if (I == diagonal || !IsFirst(&seen, m_.bodies[b].name)) continue;
      Mechanism wrong = m_;
      wrong.bodies[b].I_Bcm_B = 2.0 * diagonal - I;
      Add(kind, m_.bodies[b].name, std::move(wrong));
    }
    if (faults_.size() == before) {
      NotApplicable(kind, "every body's inertia is given in its principal axes");
    }
  }

  // Another pose of the whole mechanism with the same driven joints: an elbow the other way round.
  // Drives along distances cannot be held at home; the simulation brings them to their lengths.
  void OtherAssembly() {
    StructuralFault fault{.kind = "wrong elbow branch"};
    std::mt19937_64 random(kSeed);
    for (int k = 0; k < kAssemblyTries && fault.wrong.size() < kMostAssemblies; ++k) {
      Mechanism wrong = Disturbed(&random);
      const HomeResult home = SolveHome(&wrong);
      if (!home.closed || home.drives_moved || FirstMoved(m_, wrong).empty()) continue;
      const bool known =
          std::any_of(fault.wrong.begin(), fault.wrong.end(),
                      [&](const Mechanism& other) { return FirstMoved(other, wrong).empty(); });
      if (!known) fault.wrong.push_back(std::move(wrong));
    }
    if (fault.wrong.empty()) {
      NotApplicable(fault.kind,
                    fmt::format("none of {} random starts closed in another assembly with the "
                                "drives where they are",
                                kAssemblyTries));
      return;
    }
    fault.where = FirstMoved(m_, fault.wrong.front()) + " in another place at home";
    faults_.push_back(std::move(fault));
  }

  // Without ranges, which might refuse what forces should notice. Guesses anywhere, but of driven
  // and prescribed joints as they are.
  Mechanism Disturbed(std::mt19937_64* random) const {
    std::uniform_real_distribution<double> angle(-3.1, 3.1), share(-1.0, 1.0);
    const double size = Size();
    Mechanism wrong = m_;
    for (size_t j = 0; j < wrong.joints.size(); ++j) {
      Joint& joint = wrong.joints[j];
      joint.range = {};
      joint.guess = joint.home;
      if (joint.closure || HasDrivenCoordinate(m_, static_cast<int>(j))) continue;
      for (int c = 0; c < DofsOf(joint.kind); ++c) {
        joint.guess[static_cast<size_t>(c)] +=
            IsLength(joint.kind, c) ? size * share(*random) : angle(*random);
      }
    }
    return wrong;
  }

  void MissingClosures() {
    const std::string kind = "missing closure";
    const size_t before = faults_.size();
    std::map<std::string, size_t> seen;
    for (size_t j = 0; j < m_.joints.size(); ++j) {
      if (!m_.joints[j].closure || HasUsedCoordinate(m_, static_cast<int>(j)) || CarriesOutput(j) ||
          !IsFirst(&seen, m_.joints[j].name)) {
        continue;
      }
      Add(kind, m_.joints[j].name, Without(j));
    }
    if (faults_.size() > before) return;
    const bool any = std::ranges::any_of(m_.joints, &Joint::closure);
    NotApplicable(kind, any ? "coordinates or outputs of the joints that close its loops are used"
                            : "it has no loop");
  }

  void StandardGravity() {
    const std::string kind = "9.80665 for 9.81";
    const double g = m_.gravity_W.norm();
    if (g == 0.0) {
      NotApplicable(kind, "it has no gravity");
    } else if (std::abs(g / kStandardGravity - 1.0) > kSameGravity || g == kStandardGravity) {
      NotApplicable(kind, fmt::format("its gravity is {:g} m/s²", g));
    } else {
      Mechanism wrong = m_;
      wrong.gravity_W *= kStandardGravity / g;
      Add(kind, fmt::format("gravity, instead of {:g} m/s²", g), std::move(wrong));
    }
  }

  // From where the mechanism stood.
  static bool ResolveHome(Mechanism* wrong) {
    for (Joint& joint : wrong->joints) joint.guess = joint.home;
    return SolveHome(wrong).closed;
  }

  [[nodiscard]] double Size() const {
    double size = 0.0;
    for (const Pose& X : m_.X_WB_home) size = std::max(size, X.translation().norm());
    return size > 0.0 ? 0.3 * size : 0.1;
  }

  // The first body that is elsewhere at home; empty where all are in the same place.
  static std::string FirstMoved(const Mechanism& a, const Mechanism& b) {
    for (size_t k = 1; k < a.bodies.size(); ++k) {
      const double difference =
          (a.X_WB_home[k].matrix() - b.X_WB_home[k].matrix()).lpNorm<Eigen::Infinity>();
      if (difference > kOtherPose) return a.bodies[k].name;
    }
    return "";
  }

  // A free joint with `closure: true` only carries the pose of a body.
  [[nodiscard]] bool CarriesOutput(size_t joint) const {
    return m_.joints[joint].kind == JointKind::kFree;
  }

  [[nodiscard]] Mechanism Without(size_t joint) const {
    Mechanism wrong = m_;
    wrong.joints.erase(wrong.joints.begin() + static_cast<std::ptrdiff_t>(joint));
    const auto shift = [joint](int* index) {
      if (*index > static_cast<int>(joint)) --*index;
    };
    for (int& index : wrong.tree_joints) shift(&index);
    for (Drive& drive : wrong.drives) {
      if (auto* of_joint = std::get_if<JointDrive>(&drive.kind)) shift(&of_joint->joint);
    }
    for (Prescribed& prescribed : wrong.prescribed) shift(&prescribed.joint);
    for (Coupling& coupling : wrong.couplings) {
      for (Coupling::Term& term : coupling.terms) shift(&term.joint);
    }
    for (ForceElement& element : wrong.elements) shift(&element.joint);
    return wrong;
  }

  const Mechanism& m_;
  std::vector<StructuralFault> faults_;
};

}  // namespace

std::vector<StructuralFault> StructuralFaults(const Mechanism& mechanism) {
  return Collector(mechanism).Collect();
}

}  // namespace mbv
