#include "reference/derivatives.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kinematics/constraints.h"
#include "kinematics/tree_motion.h"
#include "math/ridders.h"
#include "math/spatial.h"
#include "mechanism/reach.h"
#include "mechanism/spanning_tree.h"
#include "reference/closure_solver.h"
#include "reference/force_solver.h"

namespace mbv::internal {
namespace {

constexpr double kSame = 1e-9;  // a drive's row and a coordinate's

// δJ · motion of a varied row.
double Along(const ScalarRow& varied, const std::vector<Vec6>& motion) {
  return RateOf(varied, motion);
}

void Take(const ScalarRow& row, double force, std::vector<Vec6>* wrenches) {
  (*wrenches)[static_cast<size_t>(row.parent)] -= force * row.J_parent;
  (*wrenches)[static_cast<size_t>(row.child)] -= force * row.J_child;
}

// What an element's force follows, and how it varies.
struct Varying {
  double position = 0.0, rate = 0.0, acceleration = 0.0;
  double d_position = 0.0, d_rate = 0.0, d_acceleration = 0.0;
  int sign = 0;       ///< FrictionDirections()
  double unit = 1.0;  ///< a large way: 1 rad, or the characteristic length
  Vec3 axis = Vec3::Zero(), w = Vec3::Zero(), e = Vec3::Zero();
  Vec3 d_axis = Vec3::Zero(), dw = Vec3::Zero(), de = Vec3::Zero();
};

struct ForceAndSlope {
  double force = 0.0, slope = 0.0;
};

ForceAndSlope Vary(const DampingLaw& law, const Varying& at) {
  return {-law.damping * at.rate, -law.damping * at.d_rate};
}
ForceAndSlope Vary(const SpringLaw& law, const Varying& at) {
  const double x = at.position - law.free;
  double sum = 0.0, slope = 0.0;
  for (size_t i = law.polynomial.size(); i-- > 0;) {
    slope = slope * x + (sum + law.polynomial[i]);
    sum = (sum + law.polynomial[i]) * x;
  }
  return {-(law.preload + sum), -slope * at.d_position};
}
ForceAndSlope Vary(const RotorLaw& law, const Varying& at) {
  const double Jn = law.inertia * law.ratio;
  return {-law.reflected() * at.acceleration - Jn * at.axis.dot(at.e),
          -law.reflected() * at.d_acceleration - Jn * (at.d_axis.dot(at.e) + at.axis.dot(at.de))};
}
// One-sided at corners.
ForceAndSlope Vary(const StopLaw& law, const Varying& at) {
  const bool above = at.position > law.upper;
  if (!above && !(at.position < law.lower)) return {};
  const double side = above ? -1.0 : 1.0;  // the depth grows with −side q
  const double depth = above ? at.position - law.upper : law.lower - at.position;
  const double rate = -side * at.rate, d_depth = -side * at.d_position, d_rate = -side * at.d_rate;
  const double e = law.stiffness * std::pow(depth, law.exponent);
  const double de = law.exponent * e / depth * d_depth;
  if (law.dissipation > 0.0) {
    const double factor = 1.0 + law.dissipation * rate;
    if (factor < 0.0) return {};
    return {side * e * factor, side * (de * factor + e * law.dissipation * d_rate)};
  }
  const double damped = law.damping * rate;
  if (damped < -e) return {};
  if (damped > e) return {2.0 * side * e, 2.0 * side * de};
  return {side * (e + damped), side * (de + law.damping * d_rate)};
}
ForceAndSlope Vary(const CurveLaw& law, const Varying& at) {
  const std::vector<CurveLaw::Knot>& knots = law.knots;
  const double x = law.of_rate ? at.rate : at.position;
  const double dx = law.of_rate ? at.d_rate : at.d_position;
  const auto next = std::ranges::find_if(knots, [x](const auto& knot) { return x < knot.at; });
  if (next == knots.begin() || next == knots.end()) {
    const bool before = next == knots.begin();
    const CurveLaw::Knot& end = before ? knots.front() : knots.back();
    const double slope = before ? end.slope_before : end.slope_after;
    return {end.force + slope * (x - end.at), slope * dx};
  }
  // Newton's form with both knots twice.
  const CurveLaw::Knot &a = *(next - 1), &b = *next;
  const double h = b.at - a.at, secant = (b.force - a.force) / h;
  const double c2 = (secant - a.slope_after) / h;
  const double c3 = (a.slope_after + b.slope_before - 2.0 * secant) / (h * h);
  const double u = x - a.at, w = x - b.at;
  return {a.force + u * (a.slope_after + u * (c2 + w * c3)),
          (a.slope_after + 2.0 * u * c2 + u * (2.0 * w + u) * c3) * dx};
}
// As a polynomial in both: c + d t with c and d along the two curves around the rate.
ForceAndSlope Vary(const CurvesLaw& law, const Varying& at) {
  size_t upper = 1;
  while (upper + 1 < law.rates.size() && at.rate >= law.rates[upper]) ++upper;
  const double low = law.rates[upper - 1], high = law.rates[upper];
  const ForceAndSlope c = Vary(law.curves[upper - 1], at), b = Vary(law.curves[upper], at);
  if (law.held && at.rate <= low) return c;
  if (law.held && at.rate >= high) return b;
  const double t = (at.rate - low) / (high - low), dt = at.d_rate / (high - low);
  return {c.force + (b.force - c.force) * t,
          c.slope + (b.slope - c.slope) * t + (b.force - c.force) * dt};
}
ForceAndSlope Vary(const ExpressionLaw& law, const Varying& at) {
  const double reach = 0.1 * at.unit;                     // as in VaryFollowing()
  const int branch = law.BranchAt(at.position, at.rate);  // one-sided at corners
  const auto force = [&](double x, double v) { return law.At(x, v, branch); };
  const double by_x = SlopeAt([&](double x) { return force(x, at.rate); }, at.position, reach);
  const double by_v = SlopeAt([&](double v) { return force(at.position, v); }, at.rate, reach);
  return {force(at.position, at.rate), by_x * at.d_position + by_v * at.d_rate};
}
ForceAndSlope Vary(const FrictionLaw& law, const Varying& at) {
  const double sense = law.sense(at.sign);
  if (at.sign == 0) return {-sense * law.breakaway, 0.0};
  if (law.stribeck_rate == 0.0) return {-sense * law.coulomb, 0.0};
  const double slowness = at.rate / law.stribeck_rate;
  const double drop = (law.breakaway - law.coulomb) * std::exp(-slowness * slowness);
  return {-sense * (law.coulomb + drop),
          sense * drop * 2.0 * slowness / law.stribeck_rate * at.d_rate};
}

}  // namespace

ForceVariations::ForceVariations(const Mechanism& mechanism)
    : mechanism_(mechanism),
      length_(CharacteristicLength(mechanism)),
      system_(mechanism.bodies.size(), length_),
      spins_(IdleSpins(mechanism)),
      forces_(mechanism.bodies.size(), length_) {}

// Once refined.
void ForceVariations::Solve(const VecX& rates, Twists* motion) {
  VecX missing = rates;
  for (Vec6& twist : *motion) twist.setZero();
  Twists more(motion->size(), Vec6::Zero());
  for (int pass = 0; pass < 2; ++pass) {
    system_.SolveTransposed(missing, &step_);
    Unstack(step_, &more);
    for (size_t b = 1; b < more.size(); ++b) (*motion)[b] += more[b];
    if (pass > 0) break;
    for (size_t k = 0; k < selection_.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      missing[at] = rates[at] - rows_->Rate(selection_[k], motion->data());
    }
  }
}

void ForceVariations::AddRates(const RowSet& varied, const Twists& motion, bool bias, double factor,
                               VecX* rates) const {
  for (size_t k = 0; k < selection_.size(); ++k) {
    const int i = selection_[k];
    double rate = varied.Rate(i, motion.data());
    if (bias) rate += varied.bias[static_cast<size_t>(i)];
    (*rates)[static_cast<Eigen::Index>(k)] += factor * rate;
  }
}

Vec6 ForceVariations::VaryFollowing(const BodyStates& states, const LoadSample& sample,
                                    const Twists& U, const Twists& dV) const {
  Vec6 varied = Vec6::Zero();  // [force; moment]
  if (sample.load == nullptr) return varied;
  for (const Load::Following& part : sample.load->following) {
    std::vector<double> inputs = InputsOf(mechanism_, states, part.function);
    const int branch =
        part.function.branch ? part.function.branch(sample.time_s, inputs) : kAnyBranch;
    for (size_t k = 0; k < inputs.size(); ++k) {
      const StateFunction::Input& input = part.function.inputs[k];
      const ScalarRow row = CoordinateRow(mechanism_, input.coordinate, states, input.near);
      const double moved =
          input.rate ? Along(VariedRow(mechanism_, input.coordinate, states, U), states.V_WB) +
                           RateOf(row, dV)
                     : RateOf(row, U);
      if (moved == 0.0) continue;
      const double at = inputs[k], unit = IsLength(mechanism_, input.coordinate) ? length_ : 1.0;
      const double slope = SlopeAt(
          [&](double x) {
            inputs[k] = x;
            return part.function.At(sample.time_s, inputs, branch);
          },
          at, 0.1 * unit);
      inputs[k] = at;
      varied[part.component] += slope * moved;
    }
  }
  return varied;
}

// (1) and (2) of Compensate() in force_solver.cc.
void ForceVariations::VaryCompensation(const BodyStates& states, const Twists& U,
                                       Twists* dw) const {
  if (!HasGravityCompensation(mechanism_)) return;
  const auto force = [&](const Body& body) {
    return Vec3(-body.gravity_compensation * body.mass * mechanism_.gravity_W);
  };
  const auto turned = [&](size_t b, const Vec3& p_B) {
    return Vec3(U[b].head<3>().cross(states.X_WB[b].linear() * p_B));
  };
  for (size_t b = 1; b < mechanism_.bodies.size(); ++b) {
    const Body& body = mechanism_.bodies[b];
    (*dw)[b].head<3>() -= turned(b, body.p_BoBcm_B).cross(force(body));
  }
  for (const Drive& drive : mechanism_.drives) {
    if (!drive.compensates_gravity) continue;
    const int on = std::get<JointDrive>(drive.kind).joint;
    const Joint& joint = mechanism_.joints[static_cast<size_t>(on)];
    const auto parent = static_cast<size_t>(joint.parent);
    const Pose X_WF = states.X_WB[parent] * joint.X_PF;
    const Vec3 a = X_WF.linear() * joint.axis, da = U[parent].head<3>().cross(a);
    const Vec3 dp = U[parent].tail<3>() + turned(parent, joint.X_PF.translation());
    const bool turns = joint.kind == JointKind::kRevolute;
    double Q = 0.0, dQ = 0.0;
    VisitBeyond(mechanism_, on, joint.child, [&](int beyond) {
      const auto b = static_cast<size_t>(beyond);
      const Body& body = mechanism_.bodies[b];
      const Vec3 f = force(body);
      if (!turns) {
        Q += a.dot(f), dQ += da.dot(f);
        return;
      }
      const Vec3 arm = states.X_WB[b] * body.p_BoBcm_B - X_WF.translation();
      const Vec3 darm = U[b].tail<3>() + turned(b, body.p_BoBcm_B) - dp;
      Q += a.dot(arm.cross(f));
      dQ += da.dot(arm.cross(f)) + a.dot(darm.cross(f));
    });
    const Coordinate coordinate{Coordinate::Kind::kJoint, on, 0};
    Take(JointCoordinateRow(joint, 0, states), -dQ, dw);
    Take(VariedRow(mechanism_, coordinate, states, U), -Q, dw);
  }
}

void ForceVariations::VaryElements(const BodyStates& states, const std::vector<int>& friction_signs,
                                   const Twists& U, const Twists& dV, const Twists& dA,
                                   Twists* dw) const {
  for (size_t e = 0; e < mechanism_.elements.size(); ++e) {
    const ForceElement& element = mechanism_.elements[e];
    const ScalarRow row = ElementRow(mechanism_, e, states);
    const ScalarRow varied = VariedElementRow(mechanism_, e, states, U);
    Varying at;
    at.position = row.value;
    at.rate = RateOf(row, states.V_WB);
    at.acceleration = RateOf(row, states.A_WB) + row.bias;
    at.d_position = RateOf(row, U);
    at.d_rate = Along(varied, states.V_WB) + RateOf(row, dV);
    const auto* rotor = std::get_if<RotorLaw>(&element.law);
    if (rotor != nullptr) {  // (3) for this row
      at.d_acceleration = RateOf(row, dA) + Along(varied, states.A_WB) + varied.bias +
                          Along(VariedElementRow(mechanism_, e, states, states.V_WB), dV) +
                          Along(VariedElementRow(mechanism_, e, states, dV), states.V_WB);
    }
    at.sign = friction_signs.empty() ? 0 : friction_signs[e];
    at.unit = ActsOnLength(mechanism_, element) ? length_ : 1.0;
    const bool carried = rotor != nullptr && rotor->carrier.has_value();
    if (carried) {
      const auto b = static_cast<size_t>(rotor->carrier->body);
      at.axis = states.X_WB[b].linear() * rotor->carrier->axis_B;
      at.d_axis = U[b].head<3>().cross(at.axis);
      at.w = states.V_WB[b].head<3>(), at.dw = dV[b].head<3>();
      at.e = states.A_WB[b].head<3>(), at.de = dA[b].head<3>();
    }
    const ForceAndSlope force =
        std::visit([&](const auto& law) { return Vary(law, at); }, element.law);
    Take(row, force.slope, dw);
    Take(varied, force.force, dw);
    if (!carried) continue;
    // (5) of element_forces.h.
    (*dw)[static_cast<size_t>(rotor->carrier->body)].head<3>() +=
        rotor->inertia * rotor->ratio *
        (at.d_acceleration * at.axis + at.acceleration * at.d_axis +
         at.d_rate * at.w.cross(at.axis) +
         at.rate * (at.dw.cross(at.axis) + at.w.cross(at.d_axis)));
  }
}

void ForceVariations::VaryWrenches(const BodyStates& states, const std::vector<LoadSample>& loads,
                                   const std::vector<int>& friction_signs, const Twists& U,
                                   const Twists& dV, const Twists& dA, VecX* dw) const {
  Twists varied(mechanism_.bodies.size(), Vec6::Zero());
  for (size_t b = 1; b < varied.size(); ++b) {
    const Body& body = mechanism_.bodies[b];
    const Mat3 R = states.X_WB[b].linear();
    const Vec3 t = U[b].head<3>();
    const Vec3 w = states.V_WB[b].head<3>(), dw_b = dV[b].head<3>();
    const Vec3 e = states.A_WB[b].head<3>(), de = dA[b].head<3>();
    const Vec3 c = R * body.p_BoBcm_B, dc = t.cross(c);
    const Mat3 I = R * body.I_Bcm_B * R.transpose(), S = Skew(t), dI = S * I - I * S;
    const Vec3 a = states.A_WB[b].tail<3>() + e.cross(c) + w.cross(w.cross(c));
    const Vec3 da = dA[b].tail<3>() + de.cross(c) + e.cross(dc) + dw_b.cross(w.cross(c)) +
                    w.cross(dw_b.cross(c) + w.cross(dc));
    const Vec3 f = body.mass * (a - mechanism_.gravity_W), df = body.mass * da;
    const Vec3 dm = dI * e + I * de + dw_b.cross(I * w) + w.cross(dI * w + I * dw_b);
    varied[b] << dm + dc.cross(f) + c.cross(df), df;
  }
  for (const LoadSample& sample : loads) {
    const auto b = static_cast<size_t>(sample.body);
    const Mat3 R = states.X_WB[b].linear();
    const Vec3 t = U[b].head<3>();
    const LoadSample load = AtStates(mechanism_, states, sample);
    const Vec6 following = VaryFollowing(states, sample, U, dV);
    Vec3 f = load.force, df = following.head<3>(), dm = following.tail<3>();
    if (load.in_body_axes) {
      f = R * f;
      df = R * df + t.cross(f);
      dm = R * dm + t.cross(R * load.moment);
    }
    const Vec3 p = R * load.p_BoQ_B;
    varied[b].head<3>() -= dm + t.cross(p).cross(f) + p.cross(df);
    varied[b].tail<3>() -= df;
  }
  VaryCompensation(states, U, &varied);
  for (const SpringDamper& spring : mechanism_.springs) {
    Drive leg;
    leg.kind = DistanceDrive{spring.body_from, spring.p_from, spring.body_to, spring.p_to};
    const ScalarRow row = DriveRow(mechanism_, leg, states);
    const ScalarRow by = VariedDriveRow(mechanism_, leg, states, U);
    const double thrust = -spring.stiffness * (row.value - spring.free_length_m) -
                          spring.damping * RateOf(row, states.V_WB);
    Take(row,
         -spring.stiffness * RateOf(row, U) -
             spring.damping * (Along(by, states.V_WB) + RateOf(row, dV)),
         &varied);
    Take(by, thrust, &varied);
  }
  VaryElements(states, friction_signs, U, dV, dA, &varied);
  Stack(varied, dw);
}

bool ForceVariations::Begin(ClosureSolver* closure, const MatX& T) {
  const BodyStates& states = closure->states();
  rows_ = &closure->rows();
  const bool other = selection_ != closure->selection();
  selection_ = closure->selection();
  if (!system_.Factor(*rows_, selection_, other)) return false;
  const auto n = static_cast<size_t>(T.cols());
  unit_.assign(n, Twists(mechanism_.bodies.size(), Vec6::Zero()));
  varied_.resize(n);
  for (size_t k = 0; k < n; ++k) {
    Unstack(T.col(static_cast<Eigen::Index>(k)), &unit_[k]);
    closure->VaryRows(unit_[k], &varied_[k]);
  }
  closure->VaryRows(states.V_WB, &along_V_);
  moves_ = std::ranges::any_of(states.V_WB, [](const Vec6& V) { return !V.isZero(0.0); });
  rates_.resize(static_cast<Eigen::Index>(selection_.size()));
  return true;
}

void ForceVariations::MoveCoordinate(ClosureSolver* closure, size_t k, Twists* dV, Twists* dA) {
  const BodyStates& states = closure->states();
  const RowSet& by = varied_[k];
  dV->assign(mechanism_.bodies.size(), Vec6::Zero());
  rates_.setZero();
  if (moves_) {
    AddRates(by, states.V_WB, false, -1.0, &rates_);
    Solve(rates_, dV);
    closure->VaryRows(*dV, &along_dV_);
    rates_.setZero();
    AddRates(along_V_, *dV, false, -1.0, &rates_);
    AddRates(along_dV_, states.V_WB, false, -1.0, &rates_);
  }
  AddRates(by, states.A_WB, true, -1.0, &rates_);
  Solve(rates_, dA);
}

void ForceVariations::MoveRate(const BodyStates& states, size_t k, Twists* dA) {
  rates_.setZero();
  if (moves_) {
    AddRates(along_V_, unit_[k], false, -1.0, &rates_);
    AddRates(varied_[k], states.V_WB, false, -1.0, &rates_);
  }
  Solve(rates_, dA);
}

RunSummary ForceVariations::Differentiate(ClosureSolver* closure, const MatX& T,
                                          const std::vector<LoadSample>& loads,
                                          const std::vector<int>& friction_signs, bool terms,
                                          ForceDerivatives* out) {
  const BodyStates& states = closure->states();
  if (!Begin(closure, T)) {
    return {.stop = Stop::kSingular,
            .message = "the coordinates do not determine the motion at this pose"};
  }
  const Eigen::Index n = T.cols();
  // (4) without δ.
  std::vector<Vec6> required;
  RequiredWrenches(mechanism_, states, loads, friction_signs, &required);
  VecX w, mu, full = VecX::Zero(rows_->size());
  Stack(required, &w);
  out->force = T.transpose() * w;
  system_.Solve(w, &mu);
  for (size_t k = 0; k < selection_.size(); ++k) {
    full[selection_[k]] = mu[static_cast<Eigen::Index>(k)];
  }

  out->by_position.resize(n, n), out->by_velocity.resize(n, n);
  const Twists none(mechanism_.bodies.size(), Vec6::Zero());
  Twists dV = none, dA = none, back = none;
  std::array<MatX, 4> of_position;
  std::array<MatX, 2> of_velocity;
  if (terms) {
    for (MatX& part : of_position) part.resize(n, n);
    for (MatX& part : of_velocity) part.resize(n, n);
  }
  VecX dw;
  const auto along_T = [&](const Twists& U, const Twists& dv, const Twists& da) {
    VaryWrenches(states, loads, friction_signs, U, dv, da, &dw);
    return VecX(T.transpose() * dw);
  };
  for (Eigen::Index k = 0; k < n; ++k) {
    const Twists& U = unit_[static_cast<size_t>(k)];
    MoveCoordinate(closure, static_cast<size_t>(k), &dV, &dA);
    std::fill(back.begin(), back.end(), Vec6::Zero());
    varied_[static_cast<size_t>(k)].AddWrenches(full, &back);
    Stack(back, &dw);
    const VecX second = -T.transpose() * dw;
    out->by_position.col(k) = second + along_T(U, dV, dA);
    if (terms) {
      of_position[0].col(k) = along_T(U, none, none);
      of_position[1].col(k) = along_T(none, dV, none);
      of_position[2].col(k) = along_T(none, none, dA);
      of_position[3].col(k) = second;
    }
    MoveRate(states, static_cast<size_t>(k), &dA);
    out->by_velocity.col(k) = along_T(none, U, dA);
    if (terms) {
      of_velocity[0].col(k) = along_T(none, U, none);
      of_velocity[1].col(k) = along_T(none, none, dA);
    }
  }
  out->by_acceleration = T.transpose() * Momenta(mechanism_, states, T);
  out->terms.clear();
  if (terms) {
    const MatX nothing = MatX::Zero(n, n);
    out->terms = {
        {"what poses change of wrenches", of_position[0], nothing},
        {"what loops change of velocities at other poses (∂J/∂q V)", of_position[1], nothing},
        {"what loops change of accelerations at other poses (∂(J A + b)/∂q)", of_position[2],
         nothing},
        {"second-order term of the constraints ((∂J/∂q)ᵀ λ)", of_position[3], nothing},
        {"what velocities change of wrenches", nothing, of_velocity[0]},
        {"what loops change of accelerations at other velocities (∂b/∂v)", nothing, of_velocity[1]},
    };
  }
  DifferentiateRates(states, T, closure->first_command(), out);
  return RunSummary::Done();
}

// Of the drives: δ(row T) = δrow T − ν δJ T with Jᵀ ν = rowᵀ.
void ForceVariations::DifferentiateRates(const BodyStates& states, const MatX& T,
                                         int first_coordinate, ForceDerivatives* out) {
  const auto drives = static_cast<Eigen::Index>(mechanism_.drives.size());
  const Eigen::Index n = T.cols();
  MatX nu(static_cast<Eigen::Index>(selection_.size()), drives);
  out->drive_rates.resize(drives, n);
  out->drive_rate_slopes.assign(static_cast<size_t>(n), MatX(drives, n));
  for (Eigen::Index d = 0; d < drives; ++d) {
    const Drive& drive = mechanism_.drives[static_cast<size_t>(d)];
    const VecX gradient = GradientOf(DriveRow(mechanism_, drive, states), mechanism_.bodies.size());
    system_.Solve(gradient, &step_);
    nu.col(d) = step_;
    out->drive_rates.row(d) = gradient.transpose() * T;
    // One that is a coordinate itself has a constant rate.
    Eigen::Index own = 0;
    step_.cwiseAbs().maxCoeff(&own);
    step_[own] -= 1.0;
    if (selection_[static_cast<size_t>(own)] >= first_coordinate && step_.norm() < kSame) {
      for (MatX& slopes : out->drive_rate_slopes) slopes.row(d).setZero();
      nu.col(d).setZero();
      continue;
    }
    for (size_t k = 0; k < unit_.size(); ++k) {
      const ScalarRow by = VariedDriveRow(mechanism_, drive, states, unit_[k]);
      for (Eigen::Index j = 0; j < n; ++j) {
        out->drive_rate_slopes[k](d, j) = Along(by, unit_[static_cast<size_t>(j)]);
      }
    }
  }
  if (nu.isZero(0.0)) return;
  VecX rates(nu.rows());
  for (size_t k = 0; k < unit_.size(); ++k) {
    for (Eigen::Index j = 0; j < n; ++j) {
      rates.setZero();
      AddRates(varied_[k], unit_[static_cast<size_t>(j)], false, 1.0, &rates);
      out->drive_rate_slopes[k].col(j) -= nu.transpose() * rates;
    }
  }
}

}  // namespace mbv::internal
