// A closed form outside mbverify's source tree: the motor torque of a planar slider-crank.
//
//         rod, l
//      .--------__            θ  crank angle, commanded
//   r /            ‾‾[slider] φ  rod angle: sin φ = −(r/l) sin θ, |φ| < 90°
//   (θ)------------------→ x  x  slider: r cos θ + l cos φ
//
// With one DOF, every coordinate c_j (position of a centre of mass, angle of a body) is a
// function of θ with c_j' = dc_j/dθ and c_j'' = d²c_j/dθ², and virtual work gives
//
//   τ = Σ_j w_j c_j' (c_j' θ̈ + c_j'' θ̇²) + g Σ_bodies m y'                                     (1)
//
// with w_j the mass or the moment of inertia that belongs to c_j.
#include <array>
#include <cmath>

#include "analytic/register_closed_form.h"

namespace {

using namespace mbv;

class PlanarSliderCrank final : public ClosedForm {
 public:
  explicit PlanarSliderCrank(const Mechanism& mechanism)
      : r_(mechanism.ParameterValue("r")),
        l_(mechanism.ParameterValue("l")),
        m_crank_(mechanism.ParameterValue("m_crank")),
        m_rod_(mechanism.ParameterValue("m_rod")),
        m_slider_(mechanism.ParameterValue("m_slider")),
        I_crank_(mechanism.ParameterValue("I_crank")),
        I_rod_(mechanism.ParameterValue("I_rod")),
        g_(mechanism.ParameterValue("g")) {}

  /// The slider's place is compared too.
  std::vector<Channel> extra_channels() const override { return {{"slider.x", "m", "world"}}; }

  RunSummary Kinematics(const CommandSample& command, DrivenSample* driven) override {
    // The one command is the motor's angle.
    driven->position = command.position;
    driven->velocity = command.velocity;
    driven->acceleration = command.acceleration;
    if (r_ * std::abs(std::sin(command.position[0])) < l_) return RunSummary::Done();
    return {.stop = Stop::kUnreachable,
            .message = "the rod is shorter than the crank is high",
            .time_s = command.time_s,
            .where = "rod",
            .amount = r_ * std::abs(std::sin(command.position[0])) - l_,
            .unit = "m"};
  }

  RunSummary Dynamics(const CommandSample& command, ClosedFormSample* sample) override {
    RunSummary summary = Kinematics(command, &sample->driven);
    if (!summary.ok()) return summary;
    const double theta = command.position[0], rate = command.velocity[0],
                 acceleration = command.acceleration[0];
    const double c = std::cos(theta), s = std::sin(theta);

    // Rod angle and its derivatives by θ.
    const double sin_phi = -r_ / l_ * s, cos_phi = std::sqrt(1.0 - sin_phi * sin_phi);
    const double phi1 = -r_ / l_ * c / cos_phi;
    const double phi2 = (r_ / l_ * s + sin_phi * phi1 * phi1) / cos_phi;

    struct Coordinate {
      double weight, first, second;  // w, c', c''
    };
    // d²(l cos φ)/dθ² and the like.
    const double rod_x1 = -l_ * sin_phi * phi1;
    const double rod_x2 = -l_ * (cos_phi * phi1 * phi1 + sin_phi * phi2);
    const std::array<Coordinate, 7> coordinates = {{
        {m_crank_, -0.5 * r_ * s, -0.5 * r_ * c},
        {m_crank_, 0.5 * r_ * c, -0.5 * r_ * s},
        {I_crank_, 1.0, 0.0},
        {m_rod_, -r_ * s + 0.5 * rod_x1, -r_ * c + 0.5 * rod_x2},
        {m_rod_, 0.5 * r_ * c, -0.5 * r_ * s},  // y: half the pin's, as the other end stays on x
        {I_rod_, phi1, phi2},
        {m_slider_, -r_ * s + rod_x1, -r_ * c + rod_x2},
    }};
    double torque = g_ * (m_crank_ + m_rod_) * 0.5 * r_ * c;  // (1), weight
    for (const auto& [weight, first, second] : coordinates) {
      torque += weight * first * (first * acceleration + second * rate * rate);  // (1), inertia
    }
    sample->force.resize(1);  // allocates the first time only
    sample->extra.resize(1);
    sample->force[0] = torque;
    sample->extra[0] = r_ * c + l_ * cos_phi;
    return RunSummary::Done();
  }

 private:
  const double r_, l_, m_crank_, m_rod_, m_slider_, I_crank_, I_rod_, g_;
};

std::unique_ptr<ClosedForm> Make(const Mechanism& mechanism, const Motion& motion,
                                 const ClosedFormOptions&, Diagnostics* diagnostics) {
  if (motion.commands.size() != 1 || motion.commands[0].name != "motor") {
    Finding finding;
    finding.message = "the closed form takes the command \"motor\" only";
    finding.hint = "command the motor's angle only";
    diagnostics->Add(std::move(finding));
    return nullptr;
  }
  return std::make_unique<PlanarSliderCrank>(mechanism);
}

// What (1) takes for granted; NaN: of no influence. Bodies move in the plane, so that only turning
// about z counts, and nothing but the motor and gravity acts on them.
Coverage CoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the slider-crank";
  const ParameterReader read(mechanism, &c);
  const double r = read("r"), l = read("l"), g = read("g");
  const Vec3 zero = Vec3::Zero(), x = Vec3::UnitX(), z = Vec3::UnitZ();
  const auto add_body = [&](const char* name, double mass, const Vec3& com, double I_z) {
    Mat3 inertia = kAnyMatrix;
    inertia(2, 2) = I_z;
    c.bodies.push_back({.name = name,
                        .mass = mass,
                        .com = com,
                        .inertia = inertia,
                        .why = "centres of mass are in the middle of crank and rod",
                        .takes_loads = false});
  };
  add_body("crank", read("m_crank"), Vec3(r / 2, 0, kNan), read("I_crank"));
  add_body("rod", read("m_rod"), Vec3(l / 2, 0, kNan), read("I_rod"));
  add_body("slider", read("m_slider"), kAnyVector, kNan);
  const auto add_joint = [&](const char* name, JointKind kind, const char* parent,
                             const char* child, const Vec3& p_parent, const Vec3& axis) {
    c.joints.push_back({.name = name,
                        .kind = kind,
                        .parent = parent,
                        .child = child,
                        .p_parent = p_parent,
                        .p_child = zero,
                        .axis_parent = axis,
                        .axis_child = axis,
                        .R_zero = Mat3::Identity()});
  };
  add_joint("motor", JointKind::kRevolute, "world", "crank", zero, z);
  add_joint("pin", JointKind::kRevolute, "crank", "rod", r * x, z);
  add_joint("wrist", JointKind::kRevolute, "rod", "slider", l * x, z);
  add_joint("guide", JointKind::kPrismatic, "world", "slider", zero, x);
  c.drives = {{.name = "motor", .joint = "motor"}};
  c.outputs = {{.name = "slider", .body = "slider"}};
  for (int k = 0; k < 3; ++k) {
    c.numbers.push_back({.subject = "gravity",
                         .quantity = k == 0   ? "component x"
                                     : k == 1 ? "component y"
                                              : "component z",
                         .actual = mechanism.gravity_W[k],
                         .assumed = k == 0   ? 0.0
                                    : k == 1 ? -g
                                             : kNan,
                         .scale = std::abs(g),
                         .unit = "m/s^2",
                         .why = "gravity is g along -y",
                         .inertial = true});
  }
  return c;
}

const ClosedFormRegistration kRegistration({.mechanism = "planar_slider_crank",
                                            .models = {"full"},
                                            .errata = {},
                                            .factory = &Make,
                                            .coverage = &CoverageOf});

}  // namespace
