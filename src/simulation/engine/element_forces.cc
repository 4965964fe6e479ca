#include "simulation/engine/element_forces.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "math/spatial.h"

namespace mbv::simulation {
namespace {

// Frames F and M in the world.
struct Frames {
  Pose X_WF, X_WM;
};

Frames FramesOf(const ConstraintSystem& system, size_t element) {
  const EngineModel& engine = system.engine();
  const ElementPlace& place = engine.elements[element];
  const int bushing = engine.mechanism->elements[element].bushing;
  const Bushing& at = engine.mechanism->bushings[static_cast<size_t>(bushing)];
  const mjData& d = *system.data();
  return {PoseOf(d, place.bushing_parent) * at.X_PF, PoseOf(d, place.bushing_child) * at.X_CM};
}

Eigen::Quaterniond ShortWay(const Mat3& R) {
  Eigen::Quaterniond q(R);
  if (q.w() < 0.0) q.coeffs() *= -1.0;
  return q;
}

// (1 − θ w/(2n))/n²; for small angles its series, whose next term is below 1e-14.
double Curvature(double n, double w, double theta) {
  constexpr double kSmall = 0.03;
  const double n2 = n * n;
  if (n < kSmall) return 1.0 / 3.0 + n2 * (2.0 / 15.0 + n2 * (8.0 / 105.0 + n2 * 16.0 / 315.0));
  return (1.0 - theta * w / (2.0 * n)) / n2;
}

// (1), (2)
void PutRotation(const Frames& at, int component, BushingLine* line) {
  const Mat3 R_WF = at.X_WF.linear();
  const Eigen::Quaterniond q = ShortWay(R_WF.transpose() * at.X_WM.linear());
  const Vec3 v = q.vec();
  const double n = v.norm(), theta = 2.0 * std::atan2(n, q.w());
  const double by_n = n > 0.0 ? theta / n : 2.0;
  const Mat3 T = 0.5 * by_n * (q.w() * Mat3::Identity() - Skew(v)) +
                 Curvature(n, q.w(), theta) * v * v.transpose();
  line->value = by_n * v[component];
  line->turn = R_WF * T.row(component).transpose();
}

}  // namespace

BushingLine BushingLineOf(const ConstraintSystem& system, size_t element) {
  const int component = system.engine().mechanism->elements[element].coordinate;
  const Frames at = FramesOf(system, element);
  BushingLine line;
  line.p_WM = at.X_WM.translation();
  if (component >= 3) {
    PutRotation(at, component - 3, &line);
    return line;
  }
  line.push = at.X_WF.linear().col(component);
  line.value = line.push.dot(line.p_WM - at.X_WF.translation());
  return line;
}

VecX BushingGradient(const ConstraintSystem& system, size_t element) {
  const ElementPlace& place = system.engine().elements[element];
  const BushingLine line = BushingLineOf(system, element);
  const mjModel* m = system.engine().m.get();
  VecX gradient = VecX::Zero(system.nv());
  const auto add = [&](int body, double sign) {
    RowMajor J_v(3, m->nv), J_w(3, m->nv);
    mj_jac(m, system.data(), J_v.data(), J_w.data(), line.p_WM.data(), body);
    gradient += sign * (J_v.transpose() * line.push + J_w.transpose() * line.turn);
  };
  add(place.bushing_child, 1.0);
  add(place.bushing_parent, -1.0);
  return gradient;
}

ElementMotion BushingMotionOf(const ConstraintSystem& system, size_t element) {
  const Eigen::Map<const VecX> qvel(system.data()->qvel, system.nv());
  return {.position = BushingLineOf(system, element).value,
          .rate = BushingGradient(system, element).dot(qvel),
          .acceleration = kNan};
}

namespace {

using ConstVecX = Eigen::Map<const VecX>;

RunSummary GyroUnsupported(const ForceElement& element, const std::string& described) {
  return {.stop = Stop::kUnsupported,
          .message = "element '" + element.name + "', a " + described +
                     ", needs every drive's motion commanded or the corrected engine, and a "
                     "joint's coordinate: MuJoCo 2.2 has no inertia between a joint and a body "
                     "that turns",
          .where = element.name,
          .names_where = true};
}

// Why friction cannot be simulated where the motion of some drive is not prescribed, or "".
std::string FrictionTrouble(const ForceElement& element, DriveMode drives, bool own_events) {
  const auto& law = std::get<FrictionLaw>(element.law);
  if (drives == DriveMode::kForceDriven) {
    return "in open loop the drive forces jump where it turns round on the commanded motion, and "
           "the motion does so a little earlier or later: servos follow (mode: servo)";
  }
  if (own_events) return "";
  if (law.by_load()) return "MuJoCo's frictionloss knows no load of the joint";
  if (law.resists != 0) return "MuJoCo's frictionloss resists both signs of the rate";
  if (law.breakaway == law.coulomb) return "";
  return "MuJoCo's frictionloss knows no breakaway force other than coulomb";
}

RunSummary FrictionUnsupported(const EngineModel& engine, size_t e, const std::string& why) {
  const ForceElement& element = engine.mechanism->elements[e];
  return {.stop = Stop::kUnsupported,
          .message = "element '" + element.name + "', " + Described(*engine.mechanism, element) +
                     ": " + why,
          .where = element.name,
          .names_where = true};
}

// In free motion MuJoCo's rows hold friction at rest; by itself MuJoCo lets them do all of it.
void AddHolding(const ConstraintSystem& system, size_t e, ElementMotion* at) {
  if (system.friction_rows() == 0 || system.engine().elements[e].prescribed) return;
  const ForceElement& element = system.engine().mechanism->elements[e];
  if (!HasFriction(element) && !IsRigidStop(element)) return;
  at->sliding = system.sliding().empty() ? 0 : system.sliding()[e];
  at->rests = at->sliding == 0;
  if (at->rests) at->held = system.HeldForce(e);
}

// The first of the three velocities of a ball's or a free joint's rotation.
int FirstTurn(const mjModel& m, int joint) {
  return m.jnt_dofadr[joint] + (m.jnt_type[joint] == mjJNT_FREE ? 3 : 0);
}

// The coordinate's gradient, of a tendon.
ConstVecX TendonGradient(const ConstraintSystem& system, const ElementPlace& place) {
  return {system.data()->ten_J + place.tendon * system.nv(), system.nv()};
}

RowMajor BodyJacobian(const ConstraintSystem& system, int body) {
  RowMajor J_w(3, system.nv());
  mj_jacBody(system.engine().m.get(), system.data(), nullptr, J_w.data(), body);
  return J_w;
}

void AddCarrier(const ConstraintSystem& system, size_t element, ElementMotion* at) {
  const int body = system.engine().elements[element].carrier;
  const auto& law = std::get<RotorLaw>(system.engine().mechanism->elements[element].law);
  const mjData& d = *system.data();
  RotorTurning& turning = at->turning;
  turning.axis = PoseOf(d, body).linear() * law.carrier->axis_B;
  turning.rate = Eigen::Map<const Vec3>(d.cvel + 6 * body);
  turning.axis_rate = turning.rate.cross(turning.axis);
  turning.along = turning.axis.dot(turning.rate);
  turning.along_rate = turning.axis.dot(system.AngularAcceleration(body));
}

// Of a stop: what it pushes back with, and its elastic part, towards smaller coordinates.
struct StopForce {
  double whole = 0.0, elastic = 0.0, stored = 0.0;
};
StopForce OfStop(const StopLaw& law, const ElementMotion& at) {
  // Depths beyond the upper end count up, beyond the lower one down.
  const double beyond = at.position - std::clamp(at.position, law.lower, law.upper);
  if (beyond == 0.0) return {};
  const double way = std::copysign(1.0, beyond), closing = way * at.rate;
  const double spring = law.stiffness * std::pow(std::abs(beyond), law.exponent);
  double damper = law.damping * closing;
  if (law.dissipation > 0.0) damper = law.dissipation * closing * spring;
  damper = std::max(damper, -spring);
  if (law.dissipation == 0.0) damper = std::min(damper, spring);
  return {.whole = way * (spring + damper),
          .elastic = way * spring,
          .stored = spring * std::abs(beyond) / (1.0 + law.exponent)};
}

// A curve's force by its power series about the knot before.
double OfCurve(const CurveLaw& law, double x) {
  const auto after = std::ranges::upper_bound(law.knots, x, {}, &CurveLaw::Knot::at);
  if (after == law.knots.begin()) return after->force - after->slope_before * (after->at - x);
  const CurveLaw::Knot& from = *std::prev(after);
  const double u = x - from.at;
  if (after == law.knots.end()) return from.force + from.slope_after * u;
  const double h = after->at - from.at, rise = after->force - from.force;
  const double second = (3.0 * rise / h - 2.0 * from.slope_after - after->slope_before) / h;
  const double third = (from.slope_after + after->slope_before - 2.0 * rise / h) / (h * h);
  return from.force + (from.slope_after + (second + third * u) * u) * u;
}

// Gauss's three points, exact for a cubic, on each piece from the first knot.
double CurveIntegral(const CurveLaw& law, double x) {
  const double reach = std::sqrt(0.6);
  const auto piece = [&](double a, double b) {
    const double middle = 0.5 * (a + b), half = 0.5 * (b - a);
    return half / 9.0 *
           (5.0 * OfCurve(law, middle - reach * half) + 8.0 * OfCurve(law, middle) +
            5.0 * OfCurve(law, middle + reach * half));
  };
  double from = law.knots.front().at, sum = 0.0;
  if (x < from) return piece(from, x);
  for (const CurveLaw::Knot& knot : law.knots) {
    const double to = std::min(x, knot.at);
    sum += piece(from, to);
    from = to;
  }
  return sum + piece(from, x);
}

// Weights of the curves at the two rates around v fall linearly with the distance.
double OfCurves(const CurvesLaw& law, double x, double v) {
  const double at = law.held ? std::clamp(v, law.rates.front(), law.rates.back()) : v;
  size_t low = law.rates.size() - 2;
  while (low > 0 && at < law.rates[low]) --low;
  const double below = OfCurve(law.curves[low], x), above = OfCurve(law.curves[low + 1], x);
  return below + (above - below) * (at - law.rates[low]) / (law.rates[low + 1] - law.rates[low]);
}

// Σ_i c_i x^(i+1)
double PowerSum(const std::vector<double>& c, double x) {
  double sum = 0.0, power = x;
  for (const double c_i : c) {
    sum += c_i * power;
    power *= x;
  }
  return sum;
}

}  // namespace

Vec3 TurnedAxis(const mjData& d, const ElementPlace& place) {
  return PoseOf(d, place.turned).linear() * place.axis_C;
}

ElementMotion ElementMotionOf(const ConstraintSystem& system, size_t element) {
  const ElementPlace& place = system.engine().elements[element];
  const mjData& d = *system.data();
  if (place.bushing_child >= 0) return BushingMotionOf(system, element);
  ElementMotion at;
  if (place.turned >= 0) {
    // The axis turns with its body, and what it turns by is at right angles to the rate itself.
    const VecX u = ElementGradient(system, element);
    at = {kNan, u.dot(ConstVecX(d.qvel, system.nv())), u.dot(ConstVecX(d.qacc, system.nv()))};
  } else if (place.tendon < 0) {
    at = {d.qpos[place.qpos], d.qvel[place.dof], d.qacc[place.dof]};
  } else {
    const ConstVecX u = TendonGradient(system, place);
    at = {d.ten_length[place.tendon], u.dot(ConstVecX(d.qvel, system.nv())),
          u.dot(ConstVecX(d.qacc, system.nv())) + system.TendonBias(place.tendon)};
  }
  at.engaged = system.engaged(element);
  at.rests = std::abs(at.rate) <= place.rest_rate;
  at.load_friction = system.load_friction(element);
  at.load_force = system.load_force(element);
  at.branch = system.branch(element);
  AddHolding(system, element, &at);
  if (place.carrier >= 0) AddCarrier(system, element, &at);
  return at;
}

VecX ElementGradient(const ConstraintSystem& system, size_t element) {
  const ElementPlace& place = system.engine().elements[element];
  if (place.bushing_child >= 0) return BushingGradient(system, element);
  if (place.tendon >= 0) return TendonGradient(system, place);
  if (place.turned >= 0) {
    const mjModel& m = *system.engine().m;
    const Mat3 R_WO = PoseOf(*system.data(), m.jnt_bodyid[place.joint]).linear();
    VecX gradient = VecX::Zero(system.nv());
    gradient.segment<3>(FirstTurn(m, place.joint)) =
        R_WO.transpose() * TurnedAxis(*system.data(), place);
    return gradient;
  }
  return VecX::Unit(system.nv(), place.dof);
}

double ForceOf(const ForceElement& element, const ElementMotion& at) {
  if (const auto* damping = std::get_if<DampingLaw>(&element.law)) {
    return -damping->damping * at.rate;
  }
  if (const auto* spring = std::get_if<SpringLaw>(&element.law)) {
    return -spring->preload - PowerSum(spring->polynomial, at.position - spring->free);
  }
  if (const auto* friction = std::get_if<FrictionLaw>(&element.law)) {
    if (at.rests) {
      return at.held + at.load_force - at.engaged * friction->sense(0) * friction->breakaway;
    }
    const double ratio = at.rate / friction->stribeck_rate;
    const double curve = friction->stribeck_rate > 0.0 ? std::exp(-(ratio * ratio)) : 0.0;
    const double most =
        at.engaged * (friction->breakaway * curve + friction->coulomb * (1.0 - curve));
    const int sign = at.sliding != 0 ? at.sliding : at.rate > 0.0 ? 1 : -1;
    return at.load_force - friction->sense(sign) * most - sign * at.load_friction;
  }
  if (IsRigidStop(element)) return at.held;
  if (const auto* stop = std::get_if<StopLaw>(&element.law)) return -OfStop(*stop, at).whole;
  if (const auto* curve = std::get_if<CurveLaw>(&element.law)) {
    return at.engaged * OfCurve(*curve, curve->of_rate ? at.rate : at.position);
  }
  if (const auto* curves = std::get_if<CurvesLaw>(&element.law)) {
    return at.engaged * OfCurves(*curves, at.position, at.rate);
  }
  if (const auto* expression = std::get_if<ExpressionLaw>(&element.law)) {
    return at.engaged * expression->At(at.position, at.rate, at.branch);
  }
  const auto& rotor = std::get<RotorLaw>(element.law);
  return -rotor.reflected() * at.acceleration - rotor.inertia * rotor.ratio * at.turning.along_rate;
}

Vec3 CarrierMoment(const ForceElement& element, const ElementMotion& at) {
  const auto& rotor = std::get<RotorLaw>(element.law);
  // The momentum grows along the axis, and the axis turns.
  return -rotor.inertia * (rotor.ratio * at.acceleration * at.turning.axis +
                           rotor.ratio * at.rate * at.turning.axis_rate);
}

double PowerOf(const ForceElement& element, const ElementMotion& at) {
  const double power = ForceOf(element, at) * at.rate;
  return IsGyroscopic(element) ? power + CarrierMoment(element, at).dot(at.turning.rate) : power;
}

double SpringPowerOf(const ForceElement& element, const ElementMotion& at) {
  if (const auto* stop = std::get_if<StopLaw>(&element.law)) {
    return -OfStop(*stop, at).elastic * at.rate;
  }
  const auto* curve = std::get_if<CurveLaw>(&element.law);
  const bool stores =
      std::holds_alternative<SpringLaw>(element.law) || (curve != nullptr && !curve->of_rate);
  return stores ? PowerOf(element, at) : 0.0;
}

bool Dissipates(const ForceElement& element) {
  const auto* curve = std::get_if<CurveLaw>(&element.law);
  return std::holds_alternative<DampingLaw>(element.law) ||
         std::holds_alternative<FrictionLaw>(element.law) ||
         std::holds_alternative<StopLaw>(element.law) || (curve != nullptr && curve->of_rate) ||
         std::holds_alternative<CurvesLaw>(element.law) ||
         std::holds_alternative<ExpressionLaw>(element.law);
}

double BreakawayAt(const ForceElement& element, const ElementMotion& at) {
  if (!at.rests || !HasFriction(element)) return 0.0;
  return at.engaged * std::get<FrictionLaw>(element.law).half_band() + at.load_friction;
}

ElementEnergy EnergyOf(const ForceElement& element, const ElementMotion& at) {
  if (const auto* rotor = std::get_if<RotorLaw>(&element.law)) {
    return {.kinetic = 0.5 * rotor->reflected() * at.rate * at.rate +
                       rotor->inertia * rotor->ratio * at.rate * at.turning.along};
  }
  if (const auto* stop = std::get_if<StopLaw>(&element.law)) {
    return {.stored = OfStop(*stop, at).stored};
  }
  if (const auto* curve = std::get_if<CurveLaw>(&element.law)) {
    return {.stored = curve->of_rate ? 0.0 : -CurveIntegral(*curve, at.position)};
  }
  const auto* spring = std::get_if<SpringLaw>(&element.law);
  if (spring == nullptr) return {};
  std::vector<double> work = {spring->preload};
  for (const double k : spring->polynomial) {
    work.push_back(k / static_cast<double>(work.size() + 1));
  }
  return {.stored = PowerSum(work, at.position - spring->free)};
}

ElementSlope SlopeOf(const ForceElement& element, double position, double unit) {
  if (const auto* damping = std::get_if<DampingLaw>(&element.law)) return {0.0, damping->damping};
  if (const auto* stop = std::get_if<StopLaw>(&element.law)) {
    if (stop->rigid()) return {};
    if (stop->exponent == 1.0) return {stop->stiffness, stop->damping};  // before it is met, too
    const double depth = std::abs(position - std::clamp(position, stop->lower, stop->upper));
    if (depth == 0.0) return {};
    const double e = stop->stiffness * std::pow(depth, stop->exponent);
    return {stop->exponent * e / depth, stop->damping + stop->dissipation * e};
  }
  if (const auto* curve = std::get_if<CurveLaw>(&element.law)) {
    double steepest = 0.0;
    for (const CurveLaw::Knot& knot : curve->knots) {
      steepest = std::max({steepest, -knot.slope_before, -knot.slope_after});
    }
    return curve->of_rate ? ElementSlope{0.0, steepest} : ElementSlope{steepest, 0.0};
  }
  if (const auto* curves = std::get_if<CurvesLaw>(&element.law)) {
    ElementSlope most;
    for (size_t i = 0; i < curves->curves.size(); ++i) {
      const std::vector<CurveLaw::Knot>& knots = curves->curves[i].knots;
      for (size_t k = 0; k < knots.size(); ++k) {
        most.stiffness = std::max({most.stiffness, -knots[k].slope_before, -knots[k].slope_after});
        if (i == 0) continue;
        const double fall = curves->curves[i - 1].knots[k].force - knots[k].force;
        most.damping = std::max(most.damping, fall / (curves->rates[i] - curves->rates[i - 1]));
      }
    }
    return most;
  }
  if (const auto* expression = std::get_if<ExpressionLaw>(&element.law)) {
    const double reach = 1e-4 * unit;  // central differences, for an estimate
    const int branch = expression->BranchAt(position, 0.0);
    const auto F = [&](double x, double v) { return expression->At(x, v, branch); };
    return {std::max(0.0, (F(position - reach, 0.0) - F(position + reach, 0.0)) / (2.0 * reach)),
            std::max(0.0, (F(position, -reach) - F(position, reach)) / (2.0 * reach))};
  }
  const auto* spring = std::get_if<SpringLaw>(&element.law);
  if (spring == nullptr) return {};
  double slope = 0.0, power = 1.0;
  for (size_t i = 0; i < spring->polynomial.size(); ++i) {
    slope += static_cast<double>(i + 1) * spring->polynomial[i] * power;
    power *= position - spring->free;
  }
  return {slope, 0.0};
}

RunSummary CheckElements(const EngineModel& engine, const Motion& motion, DriveMode drives,
                         bool own_events) {
  const bool released = motion.free() || IsReleased(engine);
  for (size_t e = 0; e < engine.mechanism->elements.size(); ++e) {
    const ForceElement& element = engine.mechanism->elements[e];
    if (released && IsRigidStop(element) && (!motion.free() || !own_events)) {
      return FrictionUnsupported(engine, e,
                                 own_events ? "what hits it leaves the commanded motion"
                                            : "MuJoCo's own stops yield; the corrected engine "
                                              "exerts impulses");
    }
    if (released && IsGyroscopic(element) &&
        std::ranges::any_of(engine.mechanism->elements, IsRigidStop)) {
      return FrictionUnsupported(engine, e, "with rigid stops it is not simulated");
    }
    if (released && HasFriction(element)) {
      const std::string why = engine.elements[e].turned >= 0 && !own_events
                                  ? "MuJoCo's ball has other axes than the joint's frame on its "
                                    "child, and its frictionloss is limited about each by itself; "
                                    "with all drives commanded it is simulated"
                                  : FrictionTrouble(element, drives, own_events);
      if (!why.empty()) return FrictionUnsupported(engine, e, why);
    }
    if (released && IsGyroscopic(element) && (!own_events || element.drive >= 0)) {
      return GyroUnsupported(element, Described(*engine.mechanism, element));
    }
    const bool on_tendon = element.drive >= 0 && std::holds_alternative<RotorLaw>(element.law);
    if (!on_tendon || !engine.driven[static_cast<size_t>(element.drive)].forced) continue;
    return {.stop = Stop::kUnsupported,
            .message = "element '" + element.name + "', a " +
                       Described(*engine.mechanism, element) +
                       ", needs that drive's motion commanded: MuJoCo 2.2 has no inertia along a "
                       "tendon",
            .where = element.name,
            .names_where = true};
  }
  return RunSummary::Done();
}

void FindPrescribedElements(EngineModel* engine) {
  // A share of a coordinate that loops and commands leave open; less is round-off.
  constexpr double kPrescribed = 1e-9;
  const DataHandle data = MakeData(*engine->m);
  ConstraintSystem system(*engine, data.get());
  system.SetTargets(VecX::Zero(static_cast<Eigen::Index>(engine->driven.size())));
  system.EvaluatePosition();
  Eigen::CompleteOrthogonalDecomposition<MatX> rows;
  rows.setThreshold(kPrescribed);
  if (system.rows() > 0) rows.compute(system.ScaledJ().transpose());
  for (size_t e = 0; e < engine->elements.size(); ++e) {
    if (!HasFriction(engine->mechanism->elements[e])) continue;
    const VecX u = ElementGradient(system, e).cwiseProduct(system.dof_unit());
    VecX left = u;
    if (system.rows() > 0) left -= system.ScaledJ().transpose() * rows.solve(u);
    engine->elements[e].prescribed = left.norm() < kPrescribed * u.norm();
  }
}

bool HasLacking(const Mechanism& mechanism) {
  return !std::ranges::all_of(mechanism.elements, mjcf::IsPlanned);
}

void AddLackingForces(const ConstraintSystem& system, const VecX& driven_acceleration,
                      double* qfrc) {
  const EngineModel& engine = system.engine();
  const std::vector<ForceElement>& elements = engine.mechanism->elements;
  for (size_t e = 0; e < elements.size(); ++e) {
    if (mjcf::IsPlanned(elements[e])) continue;
    const ElementPlace& place = engine.elements[e];
    ElementMotion at = ElementMotionOf(system, e);
    at.held = 0.0;  // unknown, or MuJoCo's own
    if (elements[e].drive >= 0 && elements[e].drive < driven_acceleration.size()) {
      at.acceleration = driven_acceleration[elements[e].drive];
    }
    double force = ForceOf(elements[e], at);
    if (place.armature) force += std::get<RotorLaw>(elements[e].law).reflected() * at.acceleration;
    if (place.dof >= 0 && place.turned < 0) {
      qfrc[place.dof] += force;
    } else {
      Eigen::Map<VecX>(qfrc, system.nv()) += force * ElementGradient(system, e);
    }
    if (place.carrier < 0) continue;
    Eigen::Map<VecX>(qfrc, system.nv()) +=
        BodyJacobian(system, place.carrier).transpose() * CarrierMoment(elements[e], at);
  }
}

bool HasGyroscopic(const Mechanism& mechanism) {
  return std::ranges::any_of(mechanism.elements, IsGyroscopic);
}

void SetCommandedAcceleration(const VecX& driven_acceleration, ConstraintSystem* system) {
  VecX rates;
  system->Bias(&rates);
  rates = -rates;
  system->AddPrescribed(1.0, driven_acceleration, &rates);
  const Eigen::CompleteOrthogonalDecomposition<MatX> J(system->ScaledJ());
  const VecX scaled = J.solve(VecX(rates.cwiseQuotient(system->row_unit())));
  Eigen::Map<VecX>(system->data()->qacc, system->nv()) = scaled.cwiseProduct(system->dof_unit());
}

}  // namespace mbv::simulation
