#include "model_file/element_text.h"

#include <fmt/ranges.h>

#include <cmath>
#include <string_view>
#include <variant>
#include <vector>

namespace mbv {
namespace {

std::string TextOf(const DampingLaw& law) { return fmt::format("damping: {}", law.damping); }
std::string TextOf(const SpringLaw& law) {
  const std::vector<double>& p = law.polynomial;
  std::string text = p.size() == 1 && p[0] >= 0.0
                         ? fmt::format("stiffness: {}", p[0])
                         : fmt::format("polynomial: [{}]", fmt::join(p, ", "));
  if (law.free != 0.0) text += fmt::format(", free: {}", law.free);
  if (law.preload != 0.0) text += fmt::format(", preload: {}", law.preload);
  return text;
}
std::string TextOf(const StopLaw& law) {
  std::string text = law.rigid() ? fmt::format("restitution: {}", law.restitution)
                                 : fmt::format("stiffness: {}", law.stiffness);
  if (std::isfinite(law.lower)) text += fmt::format(", lower: {}", law.lower);
  if (std::isfinite(law.upper)) text += fmt::format(", upper: {}", law.upper);
  if (law.exponent != 1.0) text += fmt::format(", exponent: {}", law.exponent);
  if (law.damping != 0.0) text += fmt::format(", damping: {}", law.damping);
  if (law.dissipation != 0.0) text += fmt::format(", dissipation: {}", law.dissipation);
  return text;
}
std::string TextOf(const CurveLaw& law) {
  std::vector<std::string> points, slopes;
  for (const CurveLaw::Knot& knot : law.knots) {
    points.push_back(fmt::format("[{}, {}]", knot.at, knot.force));
    slopes.push_back(fmt::format("[{}, {}]", knot.slope_before, knot.slope_after));
  }
  return fmt::format("{}points: [{}], slopes: [{}]", law.of_rate ? "of: rate, " : "",
                     fmt::join(points, ", "), fmt::join(slopes, ", "));
}
std::string TextOf(const CurvesLaw& law) {
  std::vector<std::string> points, slopes;
  for (size_t k = 0; k < law.curves.front().knots.size(); ++k) {
    std::string row = fmt::format("[{}", law.curves.front().knots[k].at);
    for (const CurveLaw& curve : law.curves) row += fmt::format(", {}", curve.knots[k].force);
    points.push_back(row + "]");
  }
  for (const CurveLaw& curve : law.curves) {
    std::vector<std::string> pairs;
    for (const CurveLaw::Knot& knot : curve.knots) {
      pairs.push_back(fmt::format("[{}, {}]", knot.slope_before, knot.slope_after));
    }
    slopes.push_back(fmt::format("[{}]", fmt::join(pairs, ", ")));
  }
  return fmt::format("of: both, rates: [{}], points: [{}], slopes: [{}], beyond_rates: {}",
                     fmt::join(law.rates, ", "), fmt::join(points, ", "), fmt::join(slopes, ", "),
                     law.held ? "held" : "linear");
}
std::string TextOf(const ExpressionLaw& law) { return fmt::format("force: \"{}\"", law.text); }
std::string TextOf(const RotorLaw& law) {
  return fmt::format("inertia: {}, ratio: {}", law.inertia, law.ratio);
}
std::string TextOf(const FrictionLaw& law) {
  std::string text = fmt::format("coulomb: {}", law.coulomb);
  if (law.breakaway != law.coulomb) {
    text += fmt::format(", breakaway: {}", law.breakaway);
    if (law.stribeck_rate != 0.0) text += fmt::format(", stribeck_rate: {}", law.stribeck_rate);
  }
  if (law.resists != 0) text += law.resists > 0 ? ", resists: positive" : ", resists: negative";
  if (law.coefficient == 0.0) return text;
  text += fmt::format(", coefficient: {}", law.coefficient + law.skew);
  if (law.skew == 0.0) return text;
  return text + fmt::format(", coefficient_back: {}", law.coefficient - law.skew);
}

}  // namespace

std::string CoordinateText(int coordinate) {
  return coordinate == 0 ? "" : fmt::format(", coordinate: {}", coordinate);
}

bool IsFurtherOfBall(const Mechanism& mechanism, const ForceElement& element) {
  if (!ActsOnBall(mechanism, element)) return false;
  const Joint& joint = mechanism.joints[static_cast<size_t>(element.joint)];
  return BallAxis(joint.kind, element.coordinate) > 0;
}

std::string FileName(const Mechanism& mechanism, const ForceElement& element) {
  return element.name.substr(
      0, ActsOnBall(mechanism, element) ? element.name.rfind('.') : std::string::npos);
}

std::string ElementText(const ForceElement& element, const std::string& place, bool slides) {
  const auto* friction = std::get_if<FrictionLaw>(&element.law);
  std::string bearings;
  if (friction != nullptr && friction->by_load() && friction->coupling < 0) {
    if (!slides && friction->radius > 0.0)
      bearings += fmt::format(", radius: {}", friction->radius);
    if (std::isfinite(friction->length)) bearings += fmt::format(", length: {}", friction->length);
    if (friction->thrust_radius > 0.0) {
      bearings += fmt::format(", thrust_radius: {}", friction->thrust_radius);
    }
  }
  return fmt::format("kind: {}, {}, {}{}", WordOf(element), place,
                     std::visit([](const auto& law) { return TextOf(law); }, element.law),
                     bearings);
}

std::string CarrierText(const RotorAxis& axis, const std::string& body) {
  const Vec3& n = axis.axis_B;
  return fmt::format(", axis_on: {}, axis: [{}, {}, {}]", body, n.x(), n.y(), n.z());
}

std::string BushingText(const Mechanism& mechanism, int bushing, const std::string& parent,
                        const std::string& child) {
  Vec6 stiffness = Vec6::Zero(), damping = Vec6::Zero();
  for (const ForceElement& element : mechanism.elements) {
    if (element.bushing != bushing) continue;
    const auto* spring = std::get_if<SpringLaw>(&element.law);
    const auto* damper = std::get_if<DampingLaw>(&element.law);
    if (spring != nullptr) stiffness[element.coordinate] += spring->polynomial[0];
    if (damper != nullptr) damping[element.coordinate] += damper->damping;
  }
  return fmt::format("kind: bushing, parent: {}, child: {}, stiffness: [{}], damping: [{}]", parent,
                     child, fmt::join(stiffness.begin(), stiffness.end(), ", "),
                     fmt::join(damping.begin(), damping.end(), ", "));
}

std::string CouplingText(const Coupling& coupling, const TermNames& name_of) {
  const std::vector<Coupling::Term>& terms = coupling.terms;
  const auto coordinate = [&](const char* key, const Coupling::Term& term) {
    const auto [joint, k] = name_of(term);
    const bool follows = std::string_view(key) == "follows";
    return fmt::format(
        "{}: {}{}", key, joint,
        k == 0 ? "" : fmt::format(", {}: {}", follows ? "follows_coordinate" : "coordinate", k));
  };
  std::string text;
  if (terms.size() == 2 && terms[0].polynomial == std::vector<double>{-1.0}) {
    const std::vector<double>& p = terms[1].polynomial;
    text = coordinate("joint", terms[0]) + ", " + coordinate("follows", terms[1]);
    text += p.size() == 1 ? fmt::format(", ratio: {}", p[0])
                          : fmt::format(", polynomial: [{}]", fmt::join(p, ", "));
    if (coupling.constant != 0.0) text += fmt::format(", offset: {}", coupling.constant);
    return text;
  }
  for (const Coupling::Term& term : terms) {
    text += fmt::format("{}{{{}, factor: {}}}", text.empty() ? "" : ", ", coordinate("joint", term),
                        term.polynomial[0]);
  }
  text = "sum: [" + text + "]";
  if (coupling.constant != 0.0) text += fmt::format(", offset: {}", -coupling.constant);
  return text;
}

}  // namespace mbv
