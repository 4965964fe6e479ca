#include "tests/laws/similar.h"

#include <cmath>
#include <type_traits>

namespace mbv::laws {
namespace {

void Scale(double scale, Pose* X) { X->translation() *= scale; }

void ScaleCoordinate(const Joint& joint, double scale, std::array<double, 6>* q) {
  for (int c = 0; c < DofsOf(joint.kind); ++c) {
    if (IsLength(joint.kind, c)) (*q)[c] *= scale;
  }
}

Profile Scaled(Profile profile, double scale) {
  for (ProfileTerm& term : profile.terms) {
    std::visit(
        [scale](auto& t) {
          using T = std::decay_t<decltype(t)>;
          if constexpr (std::is_same_v<T, ConstantTerm>) {
            t.value *= scale;
          } else if constexpr (std::is_same_v<T, RampTerm>) {
            t.rate *= scale;
          } else if constexpr (std::is_same_v<T, SineTerm>) {
            t.amplitude *= scale;
          } else if constexpr (std::is_same_v<T, BumpTerm>) {
            t.height *= scale;
          } else if constexpr (std::is_same_v<T, FourierTerm>) {
            t.offset *= scale;
            for (size_t k = 0; k < t.a.size(); ++k) {
              t.a[k] *= scale;
              t.b[k] *= scale;
            }
          } else if constexpr (std::is_same_v<T, PiecewiseTerm>) {
            auto scaled = std::make_shared<Piecewise>(*t.pieces);
            for (Piecewise::Polynomial& c : scaled->coefficients) {
              for (double& coefficient : c) coefficient *= scale;
            }
            scaled->advance *= scale;
            t.pieces = std::move(scaled);
          } else {
            t.delta *= scale;
          }
        },
        term);
  }
  return profile;
}

bool IsLengthCoordinate(const Mechanism& m, const Coordinate& c) {
  switch (c.kind) {
    case Coordinate::Kind::kPrescribed:
      return IsLength(m.joints[m.prescribed[c.index].joint].kind, 0);
    case Coordinate::Kind::kDrive:
      return PositionUnit(m, m.drives[c.index]) == "m";
    case Coordinate::Kind::kOutput:
      return c.component < 3;
    case Coordinate::Kind::kJoint:
      return IsLength(m.joints[c.index].kind, c.component);
  }
  return false;
}

// Points and frames on bodies: those on the world move with it.
class Placer {
 public:
  explicit Placer(const Similarity& similarity) : similarity_(similarity) {}

  void Put(int body, Pose* X) const {
    if (body == 0) *X = similarity_.X_NW * *X;
    Scale(similarity_.scale, X);
  }
  void Put(int body, Vec3* p) const {
    if (body == 0) *p = similarity_.X_NW * *p;
    *p *= similarity_.scale;
  }

 private:
  const Similarity& similarity_;
};

// A coupling keeps its meaning: Σ P_k(q_k) in the unit of its first coordinate.
void Scale(const Mechanism& mechanism, double s, Coupling* coupling) {
  const auto is_length = [&](const Coupling::Term& term) {
    return IsLength(mechanism.joints[static_cast<size_t>(term.joint)].kind, term.coordinate);
  };
  const double unit = is_length(coupling->terms.front()) ? s : 1.0;
  for (Coupling::Term& term : coupling->terms) {
    double power = 1.0;
    for (double& coefficient : term.polynomial) {
      if (is_length(term)) power *= s;
      coefficient *= unit / power;
    }
  }
  coupling->constant *= unit;
}

// Forces grow with s along lengths, with s² about axes, at the same time: masses stay.
void Scale(const Mechanism& mechanism, double s, ForceElement* element) {
  const bool length = ActsOnLength(mechanism, *element);
  const double unit = length ? s : 1.0, force = length ? s : s * s;
  if (auto* damping = std::get_if<DampingLaw>(&element->law)) damping->damping *= force / unit;
  if (auto* friction = std::get_if<FrictionLaw>(&element->law)) {
    friction->coulomb *= force;
    friction->breakaway *= force;
    friction->stribeck_rate *= unit;
    if (!length) friction->radius *= s;  // coefficients have no unit
    friction->length *= s;
    friction->thrust_radius *= s;
  }
  if (auto* stop = std::get_if<StopLaw>(&element->law)) {
    stop->lower *= unit;
    stop->upper *= unit;
    stop->stiffness *= force / std::pow(unit, stop->exponent);
    stop->damping *= force / unit;
    stop->dissipation /= unit;
  }
  const auto scale = [&](CurveLaw* curve) {
    for (CurveLaw::Knot& knot : curve->knots) {
      knot = {knot.at * unit, knot.force * force, knot.slope_before * force / unit,
              knot.slope_after * force / unit};
    }
  };
  if (auto* curve = std::get_if<CurveLaw>(&element->law)) scale(curve);
  if (auto* curves = std::get_if<CurvesLaw>(&element->law)) {
    for (CurveLaw& curve : curves->curves) scale(&curve);
    for (double& rate : curves->rates) rate *= unit;
  }
  if (auto* expression = std::get_if<ExpressionLaw>(&element->law)) {
    const ExpressionLaw of = *expression;
    expression->force = [=](double x, double v) { return force * of.force(x / unit, v / unit); };
    if (of.branch) {
      expression->branch = [=](double x, double v) { return of.branch(x / unit, v / unit); };
      expression->on_branch = [=](int branch, double x, double v) {
        return force * of.on_branch(branch, x / unit, v / unit);
      };
    }
  }
  if (auto* rotor = std::get_if<RotorLaw>(&element->law)) rotor->inertia *= force / unit;
  auto* spring = std::get_if<SpringLaw>(&element->law);
  if (spring == nullptr) return;
  spring->preload *= force;
  spring->free *= unit;
  double power = 1.0;
  for (double& coefficient : spring->polynomial) coefficient *= force / (power *= unit);
}

// Values are scaled back before the function sees them, forces grow with s, moments with s².
StateFunction Scaled(const Mechanism& mechanism, const StateFunction& function, double s,
                     double by) {
  StateFunction out = function;
  std::vector<double> units;
  for (StateFunction::Input& input : out.inputs) {
    units.push_back(IsLength(mechanism, input.coordinate) ? s : 1.0);
    input.near *= units.back();
  }
  const auto original = [units](std::span<const double> inputs) {
    std::vector<double> values(inputs.begin(), inputs.end());
    for (size_t i = 0; i < values.size(); ++i) values[i] /= units[i];
    return values;
  };
  out.value = [=](double t_s, std::span<const double> inputs) {
    return by * function.value(t_s, original(inputs));
  };
  if (function.branch) {
    out.branch = [=](double t_s, std::span<const double> inputs) {
      return function.branch(t_s, original(inputs));
    };
    out.on_branch = [=](int branch, double t_s, std::span<const double> inputs) {
      return by * function.on_branch(branch, t_s, original(inputs));
    };
  }
  return out;
}

std::vector<Load::Following> Scaled(const Mechanism& mechanism, const Load& load,
                                    const Similarity& similarity) {
  std::vector<Load::Following> parts;
  const double s = similarity.scale;
  for (const Load::Following& part : load.following) {
    const int vector = part.component / 3, k = part.component % 3;
    for (int i = 0; i < 3; ++i) {
      const double R_ik = load.in_body_axes ? (i == k ? 1.0 : 0.0) : similarity.X_NW(i, k);
      const double by = R_ik * (vector == 0 ? s : s * s);
      if (R_ik != 0.0) parts.push_back({3 * vector + i, Scaled(mechanism, part.function, s, by)});
    }
  }
  return parts;
}

}  // namespace

Mechanism Similar(const Mechanism& mechanism, const Similarity& similarity) {
  const double s = similarity.scale;
  const Placer placer(similarity);
  Mechanism m = mechanism;
  m.gravity_W = s * (similarity.X_NW.linear() * m.gravity_W);
  m.up_W = similarity.X_NW.linear() * m.up_W;
  m.motors.clear();  // they are made for one size
  for (size_t b = 0; b < m.bodies.size(); ++b) {
    Body& body = m.bodies[b];
    body.shapes.clear();
    body.p_BoBcm_B *= s;
    body.I_Bcm_B *= s * s;
    for (NamedFrame& frame : body.frames) placer.Put(static_cast<int>(b), &frame.X_BF);
    Pose& X_WB = m.X_WB_home[b];
    if (b > 0) placer.Put(0, &X_WB);
  }
  for (Joint& joint : m.joints) {
    placer.Put(joint.parent, &joint.X_PF);
    placer.Put(joint.child, &joint.X_CM);
    ScaleCoordinate(joint, s, &joint.guess);
    ScaleCoordinate(joint, s, &joint.home);
    joint.range = {};
  }
  for (Drive& drive : m.drives) {
    drive.range = {};
    if (auto* leg = std::get_if<DistanceDrive>(&drive.kind)) {
      placer.Put(leg->body_from, &leg->p_from);
      placer.Put(leg->body_to, &leg->p_to);
    }
  }
  for (Output& output : m.outputs) {
    placer.Put(output.body, &output.X_BO);
    placer.Put(output.reference_body, &output.X_RbR);
  }
  for (Coupling& coupling : m.couplings) Scale(mechanism, s, &coupling);
  for (ForceElement& element : m.elements) Scale(mechanism, s, &element);
  for (Bushing& bushing : m.bushings) {
    placer.Put(bushing.parent, &bushing.X_PF);
    placer.Put(bushing.child, &bushing.X_CM);
  }
  for (SpringDamper& spring : m.springs) {
    placer.Put(spring.body_from, &spring.p_from);
    placer.Put(spring.body_to, &spring.p_to);
    spring.free_length_m *= s;
  }
  return m;
}

Motion Similar(const Mechanism& mechanism, const Motion& motion, const Similarity& similarity) {
  const double s = similarity.scale;
  Motion out = motion;
  for (Command& command : out.commands) {
    const bool length = IsLengthCoordinate(mechanism, command.terms.front().coordinate);
    if (length) command.profile = Scaled(command.profile, s);
  }
  for (InitialValue& value : out.initial) {
    if (!IsLengthCoordinate(mechanism, value.coordinate)) continue;
    value.position *= s;
    value.rate *= s;
  }
  for (DriveForce& force : out.forces) {
    const bool torque = ForceUnit(mechanism, mechanism.drives[force.drive]) == "N m";
    force.force = Scaled(force.force, torque ? s * s : s);
    if (force.following) {
      force.following = Scaled(mechanism, *force.following, s, torque ? s * s : s);
    }
  }
  for (Load& load : out.loads) {
    load.p_BoQ_B *= s;
    load.following = Scaled(mechanism, load, similarity);
    const auto old_force = load.force, old_moment = load.moment;
    for (int i = 0; i < 3; ++i) {
      load.force[i].terms.clear();
      load.moment[i].terms.clear();
      for (int k = 0; k < 3; ++k) {
        const double R_ik = load.in_body_axes ? (i == k ? 1.0 : 0.0) : similarity.X_NW(i, k);
        if (R_ik == 0.0) continue;
        for (const auto& term : Scaled(old_force[k], s * R_ik).terms) {
          load.force[i].terms.push_back(term);
        }
        for (const auto& term : Scaled(old_moment[k], s * s * R_ik).terms) {
          load.moment[i].terms.push_back(term);
        }
      }
    }
  }
  return out;
}

}  // namespace mbv::laws
