#include "reference/element_forces.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "math/ridders.h"

namespace mbv::internal {
namespace {

struct AlongElement {
  double position = 0.0, rate = 0.0, acceleration = 0.0;
  int friction_sign = 0;                                           // sign of the rate, 0 at rest
  double engaged = 1.0;                                            // share that acts
  Vec3 axis_W = Vec3::Zero(), w = Vec3::Zero(), e = Vec3::Zero();  // of a rotor's carrier
  int branch = kAnyBranch;                                         // of an expression
};

AlongElement MotionOf(const ForceElement& element, const ScalarRow& row, const BodyStates& states,
                      int friction_sign, double engaged) {
  AlongElement at{row.value, RateOf(row, states.V_WB), RateOf(row, states.A_WB) + row.bias,
                  friction_sign, engaged};
  if (!IsGyroscopic(element)) return at;
  const RotorAxis& carrier = *std::get<RotorLaw>(element.law).carrier;
  const auto b = static_cast<size_t>(carrier.body);
  at.axis_W = states.X_WB[b].linear() * carrier.axis_B;
  at.w = states.V_WB[b].head<3>();
  at.e = states.A_WB[b].head<3>();
  return at;
}

// Force, energy and what is lost, of each law.
double ForceOf(const DampingLaw& law, const AlongElement& at) { return -law.damping * at.rate; }
double ForceOf(const SpringLaw& law, const AlongElement& at) {
  const double x = at.position - law.free;
  double sum = 0.0;
  for (size_t i = law.polynomial.size(); i-- > 0;) sum = (sum + law.polynomial[i]) * x;
  return -(law.preload + sum);
}
double ForceOf(const RotorLaw& law, const AlongElement& at) {
  return -law.reflected() * at.acceleration - law.inertia * law.ratio * at.axis_W.dot(at.e);
}

double ForceOf(const FrictionLaw& law, const AlongElement& at) {
  const double sense = -law.sense(at.friction_sign) * at.engaged;
  if (at.friction_sign == 0) return sense * law.breakaway;
  if (law.stribeck_rate == 0.0) return sense * law.coulomb;
  const double slowness = at.rate / law.stribeck_rate;
  return sense * (law.coulomb + (law.breakaway - law.coulomb) * std::exp(-slowness * slowness));
}

// How far beyond an end, the rate of that, and towards which side the stop pushes.
struct Depth {
  double depth = 0.0, rate = 0.0, side = 0.0;
};
Depth DepthIn(const StopLaw& law, const AlongElement& at) {
  if (at.position > law.upper) return {at.position - law.upper, at.rate, -1.0};
  if (at.position < law.lower) return {law.lower - at.position, -at.rate, 1.0};
  return {};
}
double Elastic(const StopLaw& law, const Depth& in) {
  return in.depth > 0.0 ? law.stiffness * std::pow(in.depth, law.exponent) : 0.0;
}
// (1) and (2) of StopLaw.
double Push(const StopLaw& law, const Depth& in) {
  const double e = Elastic(law, in);
  if (law.dissipation > 0.0) return std::max(0.0, e * (1.0 + law.dissipation * in.rate));
  return e + std::clamp(law.damping * in.rate, -e, e);
}
double ForceOf(const StopLaw& law, const AlongElement& at) {
  const Depth in = DepthIn(law, at);
  return in.side * Push(law, in);
}

struct OnCurve {
  double force = 0.0, slope = 0.0;
  double integral = 0.0;  // of the force from the knot before, on the first straight piece behind
};
// Hermite's polynomials between two knots [Fritsch, Carlson 1980, eq. 2].
OnCurve Between(const CurveLaw::Knot& a, const CurveLaw::Knot& b, double x) {
  const double h = b.at - a.at, t = (x - a.at) / h, t2 = t * t, t3 = t2 * t;
  const double rise = b.force - a.force, left = h * a.slope_after, right = h * b.slope_before;
  return {.force = a.force + rise * (3.0 * t2 - 2.0 * t3) + left * (t - 2.0 * t2 + t3) +
                   right * (t3 - t2),
          .slope = (6.0 * rise * (t - t2) + left * (1.0 - 4.0 * t + 3.0 * t2) +
                    right * (3.0 * t2 - 2.0 * t)) /
                   h,
          .integral = h * t *
                      (a.force + rise * t2 * (1.0 - 0.5 * t) +
                       left * t * (0.5 - t * (2.0 / 3.0 - 0.25 * t)) +
                       right * t2 * (0.25 * t - 1.0 / 3.0))};
}
OnCurve Straight(const CurveLaw::Knot& from, double slope, double x) {
  const double beyond = x - from.at;
  return {from.force + slope * beyond, slope, beyond * (from.force + 0.5 * slope * beyond)};
}
OnCurve CurveAt(const CurveLaw& law, double x) {
  const std::vector<CurveLaw::Knot>& knots = law.knots;
  const auto next = std::ranges::upper_bound(knots, x, {}, &CurveLaw::Knot::at);
  if (next == knots.begin()) return Straight(knots.front(), knots.front().slope_before, x);
  if (next == knots.end()) return Straight(knots.back(), knots.back().slope_after, x);
  return Between(*(next - 1), *next, x);
}
// ∫ F from the first knot.
double IntegralTo(const CurveLaw& law, double x) {
  double sum = CurveAt(law, x).integral;
  for (size_t i = 1; i < law.knots.size() && law.knots[i].at <= x; ++i) {
    sum += Between(law.knots[i - 1], law.knots[i], law.knots[i].at).integral;
  }
  return sum;
}
double ForceOf(const CurveLaw& law, const AlongElement& at) {
  return at.engaged * CurveAt(law, law.of_rate ? at.rate : at.position).force;
}
// Between the curves of two rates, with its slopes over both.
struct BetweenCurves {
  double force = 0.0, over_position = 0.0, over_rate = 0.0;
};
BetweenCurves AtRate(const CurvesLaw& law, double position, double rate) {
  const auto next = std::upper_bound(law.rates.begin() + 1, law.rates.end() - 1, rate);
  const auto i = static_cast<size_t>(next - law.rates.begin());
  const double h = law.rates[i] - law.rates[i - 1];
  const double share = (rate - law.rates[i - 1]) / h,
               t = law.held ? std::clamp(share, 0.0, 1.0) : share;
  const OnCurve a = CurveAt(law.curves[i - 1], position), b = CurveAt(law.curves[i], position);
  return {.force = (1.0 - t) * a.force + t * b.force,
          .over_position = (1.0 - t) * a.slope + t * b.slope,
          .over_rate = t == share ? (b.force - a.force) / h : 0.0};
}
double ForceOf(const CurvesLaw& law, const AlongElement& at) {
  return at.engaged * AtRate(law, at.position, at.rate).force;
}
double ForceOf(const ExpressionLaw& law, const AlongElement& at) {
  return at.engaged * law.At(at.position, at.rate, at.branch);
}

// (5), on the body that carries a rotor.
Vec3 CarrierMoment(const RotorLaw& law, const AlongElement& at) {
  return -law.inertia * law.ratio * (at.acceleration * at.axis_W + at.rate * at.w.cross(at.axis_W));
}

void AddEnergy(const DampingLaw& /*law*/, const AlongElement& /*at*/, Energies* /*energy*/) {}
void AddEnergy(const SpringLaw& law, const AlongElement& at, Energies* energy) {
  const double x = at.position - law.free;
  double sum = 0.0;
  for (size_t i = law.polynomial.size(); i-- > 0;) {
    sum = (sum + law.polynomial[i] / static_cast<double>(i + 2)) * x;
  }
  energy->springs += (law.preload + sum) * x;
}
void AddEnergy(const RotorLaw& law, const AlongElement& at, Energies* energy) {
  energy->kinetic += 0.5 * law.reflected() * at.rate * at.rate +
                     law.inertia * law.ratio * at.rate * at.axis_W.dot(at.w);
}

void AddEnergy(const FrictionLaw& /*law*/, const AlongElement& /*at*/, Energies* /*energy*/) {}

void AddEnergy(const StopLaw& law, const AlongElement& at, Energies* energy) {
  const Depth in = DepthIn(law, at);
  energy->springs += Elastic(law, in) * in.depth / (law.exponent + 1.0);
}
void AddEnergy(const CurveLaw& law, const AlongElement& at, Energies* energy) {
  if (!law.of_rate) energy->springs -= IntegralTo(law, at.position);
}

void AddEnergy(const CurvesLaw& /*law*/, const AlongElement& /*at*/, Energies* /*energy*/) {}
void AddEnergy(const ExpressionLaw& /*law*/, const AlongElement& /*at*/, Energies* /*energy*/) {}

void AddPower(const DampingLaw& law, const AlongElement& at, Powers* power) {
  power->dampers += ForceOf(law, at) * at.rate;
}
void AddPower(const SpringLaw& law, const AlongElement& at, Powers* power) {
  power->springs += ForceOf(law, at) * at.rate;
}
void AddPower(const RotorLaw& law, const AlongElement& at, Powers* power) {
  power->energy_rate -= ForceOf(law, at) * at.rate + CarrierMoment(law, at).dot(at.w);
}

void AddPower(const FrictionLaw& law, const AlongElement& at, Powers* power) {
  power->dampers += ForceOf(law, at) * at.rate;
}

void AddPower(const StopLaw& law, const AlongElement& at, Powers* power) {
  const Depth in = DepthIn(law, at);
  power->springs -= Elastic(law, in) * in.rate;
  power->dampers -= (Push(law, in) - Elastic(law, in)) * in.rate;
}
void AddPower(const CurveLaw& law, const AlongElement& at, Powers* power) {
  (law.of_rate ? power->dampers : power->springs) += ForceOf(law, at) * at.rate;
}

void AddPower(const CurvesLaw& law, const AlongElement& at, Powers* power) {
  power->dampers += ForceOf(law, at) * at.rate;
}
void AddPower(const ExpressionLaw& law, const AlongElement& at, Powers* power) {
  power->dampers += ForceOf(law, at) * at.rate;
}

ElementSlope Slope(const DampingLaw& law, double /*q*/, double /*unit*/) {
  return {0.0, law.damping};
}
ElementSlope Slope(const SpringLaw& law, double q, double /*unit*/) {
  const double x = q - law.free;
  double slope = 0.0;
  for (size_t i = law.polynomial.size(); i-- > 0;) {
    slope = slope * x + static_cast<double>(i + 1) * law.polynomial[i];
  }
  return {slope, 0.0};
}
ElementSlope Slope(const RotorLaw& /*law*/, double /*q*/, double /*unit*/) { return {}; }
ElementSlope Slope(const FrictionLaw& /*law*/, double /*q*/, double /*unit*/) { return {}; }
ElementSlope Slope(const StopLaw& law, double q, double /*unit*/) {
  const Depth in = DepthIn(law, {.position = q});
  if (in.depth == 0.0) return {};
  return {law.exponent * Elastic(law, in) / in.depth,
          law.damping + law.dissipation * Elastic(law, in)};
}
ElementSlope Slope(const CurveLaw& law, double q, double /*unit*/) {
  return law.of_rate ? ElementSlope{0.0, -CurveAt(law, 0.0).slope}
                     : ElementSlope{-CurveAt(law, q).slope, 0.0};
}

ElementSlope Slope(const CurvesLaw& law, double q, double /*unit*/) {
  const BetweenCurves at = AtRate(law, q, 0.0);
  return {-at.over_position, -at.over_rate};
}
ElementSlope Slope(const ExpressionLaw& law, double q, double unit) {
  const int branch = law.BranchAt(q, 0.0);
  return {-SlopeAt([&](double x) { return law.At(x, 0.0, branch); }, q, 0.1 * unit),
          -SlopeAt([&](double v) { return law.At(q, v, branch); }, 0.0, 0.1 * unit)};
}

// visit(law, motion) of every element.
template <typename Visit>
void ForElements(const Mechanism& mechanism, const BodyStates& states,
                 const std::vector<int>& friction_signs, const Visit& visit) {
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    const ForceElement& element = mechanism.elements[e];
    const ScalarRow row = ElementRow(mechanism, e, states);
    AlongElement at = MotionOf(element, row, states, friction_signs.empty() ? 0 : friction_signs[e],
                               states.Engaged(e));
    at.branch = states.Branch(e);
    std::visit([&](const auto& law) { visit(law, row, at); }, element.law);
  }
}

}  // namespace

void TakeElementForces(const Mechanism& mechanism, const BodyStates& states,
                       const std::vector<int>& friction_signs, std::vector<Vec6>* wrench_W) {
  ForElements(mechanism, states, friction_signs,
              [&](const auto& law, const ScalarRow& row, const AlongElement& at) {
                const double force = ForceOf(law, at);
                (*wrench_W)[static_cast<size_t>(row.parent)] -= force * row.J_parent;
                (*wrench_W)[static_cast<size_t>(row.child)] -= force * row.J_child;
                if constexpr (std::is_same_v<std::decay_t<decltype(law)>, RotorLaw>) {
                  if (!law.carrier) return;
                  auto moment = (*wrench_W)[static_cast<size_t>(law.carrier->body)].head<3>();
                  moment -= CarrierMoment(law, at);
                }
              });
}

void AddElementEnergies(const Mechanism& mechanism, const BodyStates& states, Energies* energy) {
  ForElements(mechanism, states, {},
              [&](const auto& law, const ScalarRow& /*row*/, const AlongElement& at) {
                AddEnergy(law, at, energy);
              });
}

void AddElementPowers(const Mechanism& mechanism, const BodyStates& states,
                      const std::vector<int>& friction_signs, Powers* power) {
  ForElements(mechanism, states, friction_signs,
              [&](const auto& law, const ScalarRow& /*row*/, const AlongElement& at) {
                AddPower(law, at, power);
              });
}

void FrictionDirections(const Mechanism& mechanism, const BodyStates& states, double duration_s,
                        std::vector<int>* signs) {
  signs->clear();
  if (std::ranges::none_of(mechanism.elements, HasFriction)) return;
  signs->resize(mechanism.elements.size(), 0);
  for (size_t e = 0; e < signs->size(); ++e) {
    const ForceElement& element = mechanism.elements[e];
    if (!HasFriction(element)) continue;
    const double rate = RateOf(ElementRow(mechanism, e, states), states.V_WB);
    if (std::abs(rate) <= RestRate(mechanism, element, duration_s)) continue;
    (*signs)[e] = rate > 0.0 ? 1 : -1;
  }
}

VecX GradientOf(const ScalarRow& row, size_t bodies) {
  VecX u = VecX::Zero(6 * (static_cast<Eigen::Index>(bodies) - 1));
  if (row.parent > 0) u.segment<6>(6 * (row.parent - 1)) += row.J_parent;
  if (row.child > 0) u.segment<6>(6 * (row.child - 1)) += row.J_child;
  return u;
}

std::vector<VecX> RestingWrenches(const Mechanism& mechanism, const BodyStates& states,
                                  const std::vector<int>& friction_signs,
                                  const VecX& load_friction) {
  std::vector<VecX> wrenches;
  if (friction_signs.empty()) return wrenches;
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    if (friction_signs[e] != 0 || !HasFriction(mechanism.elements[e])) continue;
    double most = states.Engaged(e) * std::get<FrictionLaw>(mechanism.elements[e].law).half_band();
    if (load_friction.size() > 0) most += load_friction[static_cast<Eigen::Index>(e)];
    wrenches.push_back(most *
                       GradientOf(ElementRow(mechanism, e, states), mechanism.bodies.size()));
  }
  return wrenches;
}

double LoadFrictionLoss(const Mechanism& mechanism, const ReferenceSample& sample) {
  if (sample.load_friction.size() == 0) return 0.0;
  const std::vector<ScalarRow> rows = ElementRows(mechanism, sample.states);
  double loss = 0.0;
  for (size_t e = 0; e < rows.size(); ++e) {
    const double force = sample.load_force[static_cast<Eigen::Index>(e)];
    loss -= force * RateOf(rows[e], sample.states.V_WB);
  }
  return loss;
}

void ForRotorInertias(const Mechanism& mechanism, const BodyStates& states, const AddInertia& add) {
  struct Part {
    size_t body;
    Vec6 u, a;
  };
  std::vector<Part> parts;
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    const auto* rotor = std::get_if<RotorLaw>(&mechanism.elements[e].law);
    if (rotor == nullptr) continue;
    const ScalarRow row = ElementRow(mechanism, e, states);
    parts = {{static_cast<size_t>(row.parent), row.J_parent, Vec6::Zero()},
             {static_cast<size_t>(row.child), row.J_child, Vec6::Zero()}};
    if (rotor->carrier) {
      Part& carrier = parts.emplace_back(
          Part{static_cast<size_t>(rotor->carrier->body), Vec6::Zero(), Vec6::Zero()});
      carrier.a.head<3>() = states.X_WB[carrier.body].linear() * rotor->carrier->axis_B;
    }
    std::erase_if(parts, [](const Part& part) { return part.body == 0; });
    for (const Part& x : parts) {
      for (const Part& y : parts) {
        add(x.body, y.body,
            rotor->reflected() * x.u * y.u.transpose() +
                rotor->inertia * rotor->ratio * (x.u * y.a.transpose() + x.a * y.u.transpose()));
      }
    }
  }
}

ElementSlope SlopeOf(const ForceElement& element, double q, double unit) {
  return std::visit([=](const auto& law) { return Slope(law, q, unit); }, element.law);
}

namespace {

// The contraction shrinks errors by q per pass; where q is close to 1 round-off ends it first.
constexpr int kMostPasses = 2000;
constexpr double kSettled = 4.0 * kEps;

}  // namespace

std::vector<size_t> LoadedElements(const Mechanism& mechanism) {
  std::vector<size_t> loaded;
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    const auto* friction = std::get_if<FrictionLaw>(&mechanism.elements[e].law);
    if (friction != nullptr && friction->by_load()) loaded.push_back(e);
  }
  return loaded;
}

namespace {

// Of a coordinate, in F: of universal joints the second one is on the child.
Vec3 AxisOf(const Joint& joint, int coordinate, const BodyStates& states) {
  if (joint.kind != JointKind::kUniversal || coordinate == 0) return joint.axis;
  const auto p = static_cast<size_t>(joint.parent), c = static_cast<size_t>(joint.child);
  const Mat3 R_WF = states.X_WB[p].linear() * joint.X_PF.linear();
  return R_WF.transpose() * states.X_WB[c].linear() * joint.X_CM.linear() * joint.axis2;
}

// λ dP/dq of the coupling's row.
double CouplingForce(const Mechanism& mechanism, size_t element, const BodyStates& states,
                     int coupling, const MatX& reactions) {
  const ForceElement& at = mechanism.elements[element];
  const auto row = static_cast<Eigen::Index>(mechanism.joints.size()) + coupling;
  double sum = 0.0;
  for (const Coupling::Term& term : mechanism.couplings[static_cast<size_t>(coupling)].terms) {
    if (term.joint != at.joint || term.coordinate != at.coordinate) continue;
    const double q = ElementRow(mechanism, element, states).value;
    for (size_t i = term.polynomial.size(); i-- > 0;) {
      sum = sum * q + static_cast<double>(i + 1) * term.polynomial[i];
    }
  }
  return sum * reactions(row, 0);
}

}  // namespace

BearingLoad LoadOf(const Mechanism& mechanism, size_t element, const BodyStates& states,
                   const MatX& reactions) {
  const ForceElement& at = mechanism.elements[element];
  const auto& law = std::get<FrictionLaw>(at.law);
  const double radial = law.coefficient * law.radius / law.per_load();
  BearingLoad load = BearingLoad::Zero();
  if (law.coupling >= 0) {
    load[6] = CouplingForce(mechanism, element, states, law.coupling, reactions);
    return load;
  }
  const Joint& joint = mechanism.joints[static_cast<size_t>(at.joint)];
  const Vec3 F = reactions.row(at.joint).head<3>().transpose();
  const Vec3 M = reactions.row(at.joint).tail<3>().transpose();
  if (IsOfBall(joint.kind, at.coordinate)) {
    load.head<3>() = radial * F;
    return load;
  }
  const Vec3 a = AxisOf(joint, at.coordinate, states);
  const Vec3 across = F - a * a.dot(F);
  if (std::isinf(law.length)) {
    load.head<3>() = radial * across;
  } else {
    const Vec3 couple = M.cross(a) / law.length;
    load.head<3>() = radial * (0.5 * across + couple);
    load.segment<3>(3) = radial * (0.5 * across - couple);
  }
  load[6] = law.coefficient * law.thrust_radius / law.per_load() * a.dot(F);
  return load;
}

double PerLoad(const Mechanism& mechanism, size_t element, const BodyStates& states) {
  return states.Engaged(element) *
         std::get<FrictionLaw>(mechanism.elements[element].law).per_load();
}

double SizeOf(const BearingLoad& load) {
  return load.head<3>().norm() + load.segment<3>(3).norm() + load.tail<3>().norm();
}

BearingLoad SlopeOf(const BearingLoad& load) {
  BearingLoad slope = BearingLoad::Zero();
  for (const int k : {0, 3, 6}) {
    const double norm = load.segment<3>(k).norm();
    if (norm > 0.0) slope.segment<3>(k) = load.segment<3>(k) / norm;
  }
  return slope;
}

RunSummary LoadShared(const Mechanism& mechanism, size_t element) {
  const ForceElement& at = mechanism.elements[element];
  return {.stop = Stop::kUnsupported,
          .message = fmt::format("the load of the {} ('{}') is not determined by statics: "
                                 "redundant constraints share it",
                                 Described(mechanism, at), at.name),
          .where = at.name,
          .names_where = true};
}

void LoadSystem::Add(const Mechanism& mechanism, size_t element, const BodyStates& states,
                     int friction_sign, const BearingLoad& without) {
  p.push_back(without);
  sign.push_back(friction_sign);
  per_load.push_back(PerLoad(mechanism, element, states));
  skew.push_back(states.Engaged(element) *
                 std::get<FrictionLaw>(mechanism.elements[element].law).skew);
}

double LoadSystem::Raised(size_t e) const {
  double sum = 0.0;
  for (size_t d = 0; d < P[e].size(); ++d) {
    sum += SizeOf(P[e][d]) * (std::abs(sign[d]) * per_load[d] + std::abs(skew[d]));
  }
  return sum;
}

size_t LoadSystem::MostRaised() const {
  size_t most = 0;
  for (size_t e = 0; e < P.size(); ++e) {
    if (Raised(e) > Raised(most)) most = e;
  }
  return most;
}

double LoadSystem::contraction() const { return P.empty() ? 0.0 : Raised(MostRaised()); }

RunSummary LoadSystem::Solve(std::vector<BearingLoad>* v) const {
  v->assign(p.size(), BearingLoad::Zero());
  const double q = contraction();
  for (int pass = 0; q < 1.0 && pass < kMostPasses; ++pass) {
    const std::vector<BearingLoad> last = *v;
    double change = 0.0, largest = 0.0;
    for (size_t e = 0; e < p.size(); ++e) {
      (*v)[e] = p[e];
      for (size_t d = 0; d < p.size(); ++d) (*v)[e] += P[e][d] * Force(d, last[d]);
      change = std::max(change, std::abs(SizeOf((*v)[e]) - SizeOf(last[e])));
      change = std::max(change, skew[e] == 0.0 ? 0.0 : std::abs((*v)[e][6] - last[e][6]));
      largest = std::max(largest, SizeOf((*v)[e]));
    }
    if (change <= kSettled * largest) return RunSummary::Done();
  }
  return {.stop = Stop::kSingular,
          .message = fmt::format(
              "friction by the joints' loads is not determined: a load grows by {:.3g} of what it "
              "causes (less than 1 has one solution): smaller coefficients or radii are needed",
              q),
          .amount = q,
          .unit = std::string("1")};
}

}  // namespace mbv::internal
