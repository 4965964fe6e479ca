#include "features/equation_audit/scara_robot_audit.h"

#include <cmath>
#include <numbers>

#include "analytic/scara_robot/stiffness.h"
#include "base/demand.h"
#include "features/equation_audit/stiffness_truth.h"
#include "mechanism/motion.h"
#include "model_file/load_model.h"
#include "reference/reference.h"

namespace mbv {

AuditTable AuditScaraRobot(const std::string& models_dir) {
  const LoadResult model = LoadModel(models_dir + "/scara_robot/model.yaml");
  MBV_DEMAND(model.mechanism.has_value(), model.diagnostics.Text());
  const scara_robot::Parameters parameters = scara_robot::ParametersOf(*model.mechanism);
  const std::vector<scara_audit::State> states = scara_audit::Sweep(*model.mechanism);
  const Mechanism elastic = stiffness_audit::LoadElastic(models_dir, "scara_robot");
  AuditTable table;
  table.mechanism = "scara_robot";
  table.source =
      "Zhu Wei, Guo Qian, Ma Zhiyuan, Shen Huiping, Wu Guanglei, Stiffness and dynamics analysis "
      "of SCARA parallel mechanism, Trans. Chinese Society for Agricultural Machinery 50(10), "
      "2019 (position, kinematics, dynamics and stiffness)";
  for (auto rows :
       {scara_audit::PositionRows(*model.mechanism, parameters, states),
        scara_audit::VelocityRows(parameters, states), scara_audit::LinkRows(parameters, states),
        scara_audit::DynamicsRows(parameters, states),
        scara_audit::StiffnessRows(models_dir, scara_robot::StiffnessParametersOf(elastic))}) {
    for (AuditRow& row : rows) table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace mbv

namespace mbv::scara_audit {
namespace {

constexpr int kStates = 60;
constexpr double kSample_s = 0.01;
constexpr std::array<int, 4> kComponents = {0, 1, 2, 5};
constexpr std::array<const char*, 4> kNames = {"platform.x", "platform.y", "platform.z",
                                               "platform.yaw"};
// Centre, amplitude, frequency [Hz] and phase of each coordinate: incommensurate, in the quadrant
// x, y < 0, where det J_θ keeps its sign.
struct Wave {
  double centre, amplitude, frequency_hz, phase;
};
constexpr std::array<Wave, 4> kPath = {{{-0.055, 0.015, 6.2, 0.0},
                                        {-0.050, 0.018, 4.6, 1.0},
                                        {-0.155, 0.020, 5.4, 2.0},
                                        {0.050, 0.250, 3.8, 0.5}}};

Motion SweepMotion(const Mechanism& mechanism) {
  Motion motion;
  motion.duration_s = kStates * kSample_s;
  motion.sample_s = kSample_s;
  const int output = mechanism.FindOutput("platform");
  for (int c = 0; c < 4; ++c) {
    Command command;
    command.name = kNames[c];
    command.terms = {{{Coordinate::Kind::kOutput, output, kComponents[c]}, 1.0}};
    command.profile.terms = {ConstantTerm{kPath[c].centre},
                             SineTerm{kPath[c].amplitude, kPath[c].frequency_hz, kPath[c].phase}};
    motion.commands.push_back(command);
  }
  Load load;
  load.name = "tool";
  load.body = mechanism.FindBody("platform");
  load.force = {Constant(kForce.x()), Constant(kForce.y()), Constant(kForce.z())};
  load.moment = {Constant(0.0), Constant(0.0), Constant(kMomentZ)};
  motion.loads = {load};
  return motion;
}

/// Motion of a point fixed in a body.
PointMotion PointOf(const BodyStates& states, int body, const Vec3& p_BoQ_B) {
  const Pose& X_WB = states.X_WB[body];
  const Vec3 arm = X_WB.linear() * p_BoQ_B;
  const Vec3 omega = states.V_WB[body].head<3>(), alpha = states.A_WB[body].head<3>();
  return {X_WB.translation() + arm, states.V_WB[body].tail<3>() + omega.cross(arm),
          states.A_WB[body].tail<3>() + alpha.cross(arm) + omega.cross(omega.cross(arm))};
}

PointMotion Mean(const PointMotion& a, const PointMotion& b) {
  return {(a.p + b.p) / 2, (a.v + b.v) / 2, (a.a + b.a) / 2};
}

class TruthReader {
 public:
  TruthReader(const Mechanism& mechanism, const BodyStates& states)
      : mechanism_(mechanism), states_(states) {}

  LimbTruth Limb(int i, const scara_robot::Parameters& p) const {
    const std::string limb = scara_robot::LimbName(i);
    const int arm = Body(limb + ".arm");
    const int rod_a = Body(limb + (i < 2 ? ".rod_a" : ".rod"));
    const int rod_b = i < 2 ? Body(limb + ".rod_b") : rod_a;
    const Vec3 half_arm(p.l1 / 2, 0, 0), half_rod(p.rod_length(i) / 2, 0, 0);
    LimbTruth truth;
    truth.A = Frame(arm, limb + ".A");
    truth.C = Frame(arm, limb + ".C");
    truth.B = Frame(Body("platform"), limb + ".B");
    truth.D = i < 2 ? Frame(Body("platform"), limb + ".D") : truth.B;
    truth.arm = PointOf(states_, arm, half_arm);
    truth.rods = Mean(PointOf(states_, rod_a, half_rod), PointOf(states_, rod_b, half_rod));
    truth.omega_arm = states_.V_WB[arm].head<3>();
    truth.domega_arm = states_.A_WB[arm].head<3>();
    truth.omega_rod = states_.V_WB[rod_a].head<3>();
    truth.domega_rod = states_.A_WB[rod_a].head<3>();
    truth.rods_apart = (states_.V_WB[rod_b].head<3>() - truth.omega_rod).norm();
    truth.R_arm = states_.X_WB[arm].linear();
    truth.R_rod = states_.X_WB[rod_a].linear();
    return truth;
  }

  PointMotion Platform() const { return PointOf(states_, Body("platform"), Vec3::Zero()); }
  Vec3 PlatformAcceleration() const { return states_.A_WB[Body("platform")].head<3>(); }
  double Tilt() const {
    return states_.X_WB[Body("platform")].linear().col(2).cross(Vec3::UnitZ()).norm();
  }

 private:
  int Body(const std::string& name) const {
    const int body = mechanism_.FindBody(name);
    MBV_DEMAND(body > 0, name);
    return body;
  }
  PointMotion Frame(int body, const std::string& name) const {
    const NamedFrame* frame = mechanism_.FindFrame(body, name);
    MBV_DEMAND(frame != nullptr, name);
    return PointOf(states_, body, frame->X_BF.translation());
  }

  const Mechanism& mechanism_;
  const BodyStates& states_;
};

}  // namespace

PathPoint PathAt(double t_s) {
  PathPoint at;
  for (int c = 0; c < 4; ++c) {
    const Wave& wave = kPath[c];
    const double w = 2.0 * std::numbers::pi * wave.frequency_hz;
    const double s = wave.amplitude * std::sin(w * t_s + wave.phase);
    at.X[c] = wave.centre + s;
    at.dX[c] = wave.amplitude * w * std::cos(w * t_s + wave.phase);
    at.ddX[c] = -w * w * s;
  }
  return at;
}

std::vector<State> Sweep(const Mechanism& mechanism) {
  const scara_robot::Parameters parameters = scara_robot::ParametersOf(mechanism);
  const Motion motion = SweepMotion(mechanism);
  ReferenceSolver solver(mechanism, motion);
  CommandSample command;
  ReferenceSample sample;
  std::vector<State> states;
  for (int k = 0; k < kStates; ++k) {
    EvaluateMotion(motion, k * kSample_s, &command);
    const RunSummary run = solver.Dynamics(command, &sample);
    MBV_DEMAND(run.ok(), run.message);
    State state;
    state.time_s = command.time_s;
    state.theta = sample.driven.position;
    state.rates.dX = command.velocity;
    state.rates.ddX = command.acceleration;
    state.rates.dtheta = sample.driven.velocity;
    state.rates.ddtheta = sample.driven.acceleration;
    state.M = sample.drive_force;
    const TruthReader truth(mechanism, sample.states);
    state.P = truth.Platform();
    state.tilt = truth.Tilt();
    state.domega_platform = truth.PlatformAcceleration();
    for (int i = 0; i < kLimbs; ++i) state.limbs[i] = truth.Limb(i, parameters);
    const RunSummary reach =
        scara_robot::InversePosition(parameters, command.position, &state.position);
    MBV_DEMAND(reach.ok(), reach.message);
    state.J_inverse = scara_robot::InverseOfJ(parameters, state.position);
    state.J = scara_robot::InverseJacobian(parameters, state.position).cwiseInverse().asDiagonal() *
              scara_robot::DirectJacobian(state.position);
    states.push_back(state);
  }
  return states;
}

}  // namespace mbv::scara_audit
