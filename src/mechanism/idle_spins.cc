#include "mechanism/idle_spins.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "math/spatial.h"

namespace mbv {
namespace {

// Shares of the distance between the balls, and of the inertia with respect to one of them, that
// count as nothing: roundings of a model's numbers.
constexpr double kBeside = 1e-9;

bool SlidesOrFixes(const Joint& joint) {
  return joint.kind == JointKind::kPrismatic || joint.kind == JointKind::kFixed;
}

// Per body: the first body of those that do not turn against each other.
std::vector<int> BodiesThatTurnTogether(const Mechanism& mechanism) {
  std::vector<int> group(mechanism.bodies.size());
  std::iota(group.begin(), group.end(), 0);
  for (const Joint& joint : mechanism.joints) {
    if (!SlidesOrFixes(joint)) continue;
    const int from = group[static_cast<size_t>(joint.parent)];
    const int to = group[static_cast<size_t>(joint.child)];
    std::replace(group.begin(), group.end(), std::max(from, to), std::min(from, to));
  }
  return group;
}

// "leg1" of "leg1.lower" and "leg1.upper".
std::string CommonName(const Mechanism& mechanism, const std::vector<int>& bodies) {
  const std::string first = mechanism.bodies[static_cast<size_t>(bodies.front())].name;
  const auto dot = first.rfind('.');
  if (bodies.size() == 1 || dot == std::string::npos) return first;
  const std::string part = first.substr(0, dot + 1);
  const bool all = std::all_of(bodies.begin(), bodies.end(), [&](int b) {
    return mechanism.bodies[static_cast<size_t>(b)].name.starts_with(part);
  });
  return all ? part.substr(0, dot) : first;
}

// One candidate, at home.
class SpinFinder {
 public:
  SpinFinder(const Mechanism& mechanism, const std::vector<int>& group, int which)
      : m_(mechanism), group_(group), which_(which) {}

  // False where other things than two balls connect it, or where it has no line of its own.
  bool Find(Spin* spin) {
    std::vector<int> balls;
    for (size_t j = 0; j < m_.joints.size(); ++j) {
      const Joint& joint = m_.joints[j];
      if (Spins(joint.parent) == Spins(joint.child)) continue;
      if (joint.kind != JointKind::kSpherical || balls.size() == 2) return false;
      balls.push_back(static_cast<int>(j));
    }
    if (balls.size() != 2) return false;
    p_WP_ = CentreOf(balls[0]);
    const Vec3 p_PQ_W = CentreOf(balls[1]) - p_WP_;
    distance_ = p_PQ_W.norm();
    if (!(distance_ > 0.0)) return false;
    n_W_ = p_PQ_W / distance_;
    if (!SlidesAlongLine()) return false;
    spin->balls = {balls[0], balls[1]};
    spin->bodies = BodiesFrom(balls[0]);
    spin->name = CommonName(m_, spin->bodies);
    const Pose X_BW = m_.X_WB_home[static_cast<size_t>(spin->bodies[0])].inverse();
    spin->p_BP = X_BW * p_WP_;
    spin->n_B = X_BW.linear() * n_W_;
    for (const int body : spin->bodies) {
      if (spin->why_not.empty()) spin->why_not = NotSymmetricReason(body);
    }
    if (spin->why_not.empty()) spin->why_not = WhatHolds();
    if (spin->why_not.empty()) spin->why_not = WhatActsOn(balls);
    return true;
  }

 private:
  [[nodiscard]] bool Spins(int body) const { return group_[static_cast<size_t>(body)] == which_; }
  [[nodiscard]] const Pose& Home(int body) const { return m_.X_WB_home[static_cast<size_t>(body)]; }
  [[nodiscard]] const std::string& NameOf(int body) const {
    return m_.bodies[static_cast<size_t>(body)].name;
  }

  // Seen from outside, as the spinning part does not move there.
  [[nodiscard]] Vec3 CentreOf(int ball) const {
    const Joint& joint = m_.joints[static_cast<size_t>(ball)];
    return Spins(joint.child) ? Home(joint.parent) * joint.X_PF.translation()
                              : Home(joint.child) * joint.X_CM.translation();
  }

  [[nodiscard]] bool SlidesAlongLine() const {
    return std::all_of(m_.joints.begin(), m_.joints.end(), [&](const Joint& joint) {
      if (!Spins(joint.parent) || !Spins(joint.child) || joint.kind != JointKind::kPrismatic) {
        return true;
      }
      const Vec3 axis_W = Home(joint.parent).linear() * joint.X_PF.linear() * joint.axis;
      return axis_W.cross(n_W_).norm() <= kBeside;
    });
  }

  [[nodiscard]] std::vector<int> BodiesFrom(int ball) const {
    const Joint& joint = m_.joints[static_cast<size_t>(ball)];
    std::vector<int> bodies = {Spins(joint.child) ? joint.child : joint.parent};
    for (int b = 1; b < static_cast<int>(m_.bodies.size()); ++b) {
      if (Spins(b) && b != bodies[0]) bodies.push_back(b);
    }
    return bodies;
  }

  [[nodiscard]] double BesideLine(const Vec3& p_W) const {
    return (p_W - p_WP_).cross(n_W_).norm();
  }
  [[nodiscard]] bool OnLine(int body, const Vec3& p_B) const {
    return BesideLine(Home(body) * p_B) <= kBeside * distance_;
  }

  // (1)
  [[nodiscard]] std::string NotSymmetricReason(int index) const {
    const Body& body = m_.bodies[static_cast<size_t>(index)];
    const double beside = BesideLine(Home(index) * body.p_BoBcm_B);
    if (body.mass > 0.0 && beside > kBeside * distance_) {
      return fmt::format("the centre of mass of {} lies {:.3g} m beside the line through its balls",
                         body.name, beside);
    }
    const Vec3 n = Home(index).linear().transpose() * n_W_;
    const Mat3 across = Mat3::Identity() - n * n.transpose();
    const Vec3 tilted = across * body.I_Bcm_B * n;
    const Mat3 round = across * body.I_Bcm_B * across;
    const double uneven = (round - 0.5 * round.trace() * across).norm();
    const double size = body.I_Bcm_B.trace() + body.mass * distance_ * distance_;
    if (std::max(uneven, tilted.norm()) <= kBeside * size) return "";
    return fmt::format(
        "the inertia of {} is not symmetric about the line through its spherical joints (by {:.3g} "
        "kg m²)",
        body.name, std::max(uneven, tilted.norm()));
  }

  // Things that have a moment about the line, or show the turn.
  [[nodiscard]] std::string WhatHolds() const {
    for (const Output& output : m_.outputs) {
      if (Spins(output.body) || Spins(output.reference_body)) {
        return fmt::format("output '{}' shows its turn", output.name);
      }
    }
    for (const SpringDamper& spring : m_.springs) {
      if (Pulls(spring.body_from, spring.p_from, spring.body_to, spring.p_to)) {
        return fmt::format("spring '{}' ends beside the line through its balls", spring.name);
      }
    }
    for (const Drive& drive : m_.drives) {
      const auto* leg = std::get_if<DistanceDrive>(&drive.kind);
      if (leg != nullptr && Pulls(leg->body_from, leg->p_from, leg->body_to, leg->p_to)) {
        return fmt::format("drive '{}' ends beside the line through its balls", drive.name);
      }
    }
    for (const Bushing& bushing : m_.bushings) {
      if (Spins(bushing.parent) != Spins(bushing.child)) {
        return fmt::format("bushing '{}' holds it", bushing.name);
      }
    }
    for (const ForceElement& element : m_.elements) {
      if (IsGyroscopic(element) && Spins(std::get<RotorLaw>(element.law).carrier->body)) {
        return fmt::format("rotor '{}' turns in it", element.name);
      }
    }
    for (const Beam& beam : m_.beams) {
      if (Spins(beam.body)) return fmt::format("{} is elastic", NameOf(beam.body));
    }
    return "";
  }

  // Forces and relations of a ball's own coordinates.
  [[nodiscard]] std::string WhatActsOn(const std::vector<int>& balls) const {
    const auto is_ball = [&](int joint) { return std::ranges::find(balls, joint) != balls.end(); };
    for (const ForceElement& element : m_.elements) {
      if (is_ball(element.joint)) return fmt::format("element '{}' acts on a ball", element.name);
    }
    for (const Drive& drive : m_.drives) {
      const auto* on = std::get_if<JointDrive>(&drive.kind);
      if (on != nullptr && is_ball(on->joint)) {
        return fmt::format("drive '{}' acts on a ball", drive.name);
      }
    }
    for (const Coupling& coupling : m_.couplings) {
      if (std::ranges::any_of(coupling.terms, [&](const auto& t) { return is_ball(t.joint); })) {
        return fmt::format("coupling '{}' uses a ball", coupling.name);
      }
    }
    return "";
  }

  [[nodiscard]] bool Pulls(int from, const Vec3& p_from, int to, const Vec3& p_to) const {
    if (Spins(from) == Spins(to)) return false;
    return Spins(from) ? !OnLine(from, p_from) : !OnLine(to, p_to);
  }

  const Mechanism& m_;
  const std::vector<int>& group_;
  const int which_;
  Vec3 p_WP_ = Vec3::Zero(), n_W_ = Vec3::UnitZ();
  double distance_ = 0.0;
};

}  // namespace

std::vector<Spin> FindSpins(const Mechanism& mechanism) {
  std::vector<Spin> spins;
  if (mechanism.X_WB_home.size() != mechanism.bodies.size()) return spins;
  const std::vector<int> group = BodiesThatTurnTogether(mechanism);
  for (int b = 1; b < static_cast<int>(group.size()); ++b) {
    if (group[static_cast<size_t>(b)] != b) continue;
    Spin spin;
    if (SpinFinder(mechanism, group, b).Find(&spin)) spins.push_back(std::move(spin));
  }
  return spins;
}

std::vector<Spin> IdleSpins(const Mechanism& mechanism) {
  std::vector<Spin> spins = FindSpins(mechanism);
  std::erase_if(spins, [](const Spin& spin) { return !spin.why_not.empty(); });
  return spins;
}

double TurnFromHome(const Mechanism& mechanism, const Spin& spin, const Mat3& R_WB) {
  const Mat3 R_WB_home = mechanism.X_WB_home[static_cast<size_t>(spin.bodies[0])].linear();
  const Vec3 n_home = R_WB_home * spin.n_B, n = R_WB * spin.n_B;
  return TurnBeyond(LeastRotation(n_home, n) * R_WB_home, R_WB, n);
}

}  // namespace mbv
