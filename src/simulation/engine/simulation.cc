#include "simulation/engine/simulation.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/demand.h"
#include "base/roles.h"
#include "simulation/engine/element_forces.h"
#include "simulation/engine/load_friction.h"
#include "simulation/engine/session.h"
#include "simulation/mjcf/mjcf.h"

namespace mbv {
namespace simulation {
namespace {

// Puts the least driven forces into the data for as long as it lives.
class LeastForces {
 public:
  explicit LeastForces(Session* session) : session_(*session) {
    if (!session_.shared) return;
    found_ = session_.system.force();
    session_.solver.SolveLeastDriven(session_.system.J().transpose() * found_);
  }
  ~LeastForces() {
    if (session_.shared) session_.system.force() = found_;
  }
  LeastForces(const LeastForces&) = delete;
  LeastForces& operator=(const LeastForces&) = delete;

 private:
  Session& session_;
  VecX found_;
};

// Only the corrected engine's states are of one instant.
bool Integrates(const SimulationOptions& options) {
  return options.mode != DriveMode::kInverse && options.engine == Engine::kCorrected;
}

}  // namespace

Session::Session(EngineModel model, const Motion& motion_, const SimulationOptions& options_,
                 SimulationRun* run_)
    : engine(std::move(model)),
      data(MakeData(*engine.m)),
      motion(motion_),
      options(options_),
      run(run_),
      system(engine, data.get()),
      solver(&system),
      spins(&system),
      loads(engine, motion_),
      recorder(&system, motion_.RecordedJoints(), Integrates(options_)),
      until(motion_),
      released(motion_.free() || IsReleased(engine)),
      loaded(LoadedElements(*engine.mechanism)),
      lacking(HasLacking(*engine.mechanism)),
      gyroscopic(HasGyroscopic(*engine.mechanism)) {
  for (size_t i = 1; i < engine.plan.bodies.size(); ++i) {
    const int body = engine.plan.bodies[i].body, id = engine.body_id[i];
    if (std::ranges::none_of(motion.switches, [&](const Switch& of) { return of.body == body; }))
      continue;
    payloads.push_back({.id = id,
                        .body = static_cast<size_t>(body),
                        .mass = engine.m->body_mass[id],
                        .inertia = Eigen::Map<const Vec3>(engine.m->body_inertia + 3 * id)});
  }
  run->trace.witness = role::kSimulated.name;
  run->trace.Reset(SampleTimes(motion.duration_s, motion.sample_s), recorder.channels());
  run->qpos.setConstant(static_cast<Eigen::Index>(run->trace.time_s.size()), engine.m->nq, kNan);
  run->X_WB.assign(run->trace.time_s.size(), {});
  for (std::vector<Pose>& X_WB : run->X_WB) {
    // Written once: the loop finds the memory there.
    X_WB.assign(engine.mechanism->bodies.size(), Pose::Identity());
    X_WB.clear();
  }
  records.setZero(run->trace.values.cols(), kBlock);
  qpos_records.setZero(engine.m->nq, kBlock);
}

Session::~Session() { PutRecords(); }

void Session::Record(size_t i) {
  MBV_DEMAND(put + kept == static_cast<Eigen::Index>(i), i);
  {
    const LoadFriction load_friction(this);
    const LeastForces least(this);
    const HeldShares shares(this);
    if (options.mode != DriveMode::kInverse) system.EvaluateBodyForces();
    const Eigen::Map<Eigen::RowVectorXd> record(records.col(kept).data(), records.rows());
    recorder.Record(loads, work.work(), record, &run->X_WB[i]);
    if (recorder.has_bands()) recorder.RecordBands(Bands(), record);
  }
  qpos_records.col(kept) = Eigen::Map<const VecX>(data->qpos, engine.m->nq);
  if (++kept == kBlock) PutRecords();
  if (progress && i % 16 == 0) {
    progress(static_cast<double>(i) / static_cast<double>(run->trace.time_s.size()));
  }
}

void Session::PutRecords() {
  run->trace.values.middleRows(put, kept) = records.leftCols(kept).transpose();
  run->qpos.middleRows(put, kept) = qpos_records.leftCols(kept).transpose();
  put += kept;
  kept = 0;
}

const VecX& Session::WorkRates() {
  const LoadFriction load_friction(this);
  const LeastForces least(this);
  simulation::WorkRates(system, loads, &work_rates);
  return work_rates;
}

namespace {

// Magnitudes of all driven forces; those below this share of the largest (forces at the
// characteristic length) are round-off.
constexpr double kOpened = 1e-9;

VecX OpenedForces(const ConstraintSystem& system) {
  VecX force(static_cast<Eigen::Index>(system.engine().driven.size())), size = force;
  for (Eigen::Index k = 0; k < force.size(); ++k) {
    const int row = system.driven_row(static_cast<int>(k));
    force[k] = std::abs(system.DrivenForce(static_cast<int>(k)));
    size[k] = force[k] * (row < 0 ? 0.0 : system.row_unit()[row]);
  }
  const double least = size.size() == 0 ? 0.0 : kOpened * size.maxCoeff();
  return (size.array() > least).select(force, 0.0);
}

}  // namespace

VecX Session::Bands() {
  const auto driven = static_cast<Eigen::Index>(engine.driven.size());
  VecX bands = VecX::Zero(driven);
  const VecX found = system.force();
  for (size_t e = 0; e < engine.elements.size(); ++e) {
    if (released && !engine.elements[e].prescribed) continue;
    const ElementMotion at = ElementMotionOf(system, e);
    const double most = BreakawayAt(engine.mechanism->elements[e], at);
    if (most == 0.0) continue;
    const VecX tau = -most * ElementGradient(system, e);
    if (shared) {
      solver.SolveLeastDriven(tau);
    } else {
      solver.SolveForcesHere(tau);
    }
    bands += OpenedForces(system);
  }
  system.force() = found;
  return bands;
}

void Session::FindShared() { shared = !solver.DrivenRowsNotUnique().empty(); }

VecX HomePositions(const EngineModel& engine) {
  VecX home(engine.driven.size());
  for (size_t k = 0; k < engine.driven.size(); ++k) home[k] = engine.driven[k].home;
  return home;
}

void Session::EvaluateLoads(double t_s) {
  loads.Evaluate(t_s, *data);
  system.SetEngaged(motion, t_s);
}

void Session::SetPayloads(double t_s) {
  if (payloads.empty()) return;
  const std::vector<double> before = carried;
  EvaluatePayloads(motion, until(t_s), &carried);
  if (carried == before) return;
  mjModel* m = engine.m.get();
  for (const Payload& payload : payloads) {
    m->body_mass[payload.id] = carried[payload.body] * payload.mass;
    Eigen::Map<Vec3>{m->body_inertia + 3 * payload.id} = carried[payload.body] * payload.inertia;
  }
  std::copy_n(m->body_mass, m->nbody, m->body_subtreemass);
  for (int b = m->nbody - 1; b > 0; --b) {
    m->body_subtreemass[m->body_parentid[b]] += m->body_subtreemass[b];
  }
}

void Session::ApplyForces(double t_s, const Commanded& at) {
  t_s = until(t_s);
  EvaluateLoads(t_s);
  if (loads.world().empty() && !system.has_given_forces() && !lacking) return;
  mju_zero(data->qfrc_applied, engine.m->nv);
  loads.AddGeneralized(data.get(), data->qfrc_applied);
  if (gyroscopic && !released) SetCommandedAcceleration(at.motion.acceleration, &system);
  if (lacking) AddLackingForces(system, at.motion.acceleration, data->qfrc_applied);
  if (!system.has_given_forces()) return;
  given.setZero(static_cast<Eigen::Index>(engine.driven.size()));
  for (size_t k = 0; k < motion.forces.size(); ++k) {
    given[motion.forces[k].drive] = loads.given()[k];
  }
  if (options.mode == DriveMode::kForceDriven) given.head(at.force.size()) = at.force;
  if (options.mode == DriveMode::kServo) RunServos(engine, at, data.get(), &given);
  system.SetGivenForces(given);
  if (options.mode != DriveMode::kServo) system.AddGivenForces(data->qfrc_applied);
}

// MuJoCo's actuation stage at the data's position (tendons evaluated) and velocity. The motors
// carry the feed-forward.
void RunServos(const EngineModel& engine, const Commanded& at, mjData* d, VecX* force) {
  const mjModel* m = engine.m.get();
  const auto drives = static_cast<Eigen::Index>(engine.mechanism->drives.size());
  for (Eigen::Index k = 0; k < drives; ++k) {
    const DrivenPlace& place = engine.driven[static_cast<size_t>(k)];
    d->ctrl[place.motor] = at.force.size() > 0 ? at.force[k] : 0.0;
    d->ctrl[place.position_servo] = at.motion.position[k];
    d->ctrl[place.velocity_servo] = at.motion.velocity[k];
  }
  mj_transmission(m, d);
  mju_mulMatVec(d->actuator_velocity, d->actuator_moment, d->qvel, m->nu, m->nv);
  mj_fwdActuation(m, d);
  for (Eigen::Index k = 0; k < drives; ++k) {
    const DrivenPlace& place = engine.driven[static_cast<size_t>(k)];
    (*force)[k] = d->actuator_force[place.motor] + d->actuator_force[place.position_servo] +
                  d->actuator_force[place.velocity_servo];
  }
}

bool IsSane(const double* x, int n) {
  // NaN compares false.
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += std::abs(x[i]);
  return sum < mjMAXVAL;
}

void AdvancePositions(const EngineModel& engine, double h, const VecX& mean, const VecX& v_0,
                      const VecX& v_1, VecX* work, double* qpos) {
  *work = mean;
  for (int i = 0; i < engine.m->nv; ++i) {
    if (!engine.dof_is_rotation3[i]) continue;
    const Vec3 w_0 = v_0.segment<3>(i), w_1 = v_1.segment<3>(i);
    work->segment<3>(i) += h / 12.0 * w_0.cross(w_1);
  }
  mj_integratePos(engine.m.get(), qpos, work->data(), h);
}

namespace {

RunSummary RunMode(Session* session, const DrivenMotion& driven) {
  if (session->options.mode == DriveMode::kInverse) return RunInverse(session, driven);
  if (session->options.engine == Engine::kCorrected) return RunCorrected(session, driven);
  return RunStock(session, driven);
}

void ReportUniqueness(const Session& session, SimulationRun* run) {
  const std::vector<int> rows = session.solver.DrivenRowsNotUnique();
  for (size_t k = 0; k < session.engine.driven.size(); ++k) {
    const int row = session.system.driven_row(static_cast<int>(k));
    if (std::find(rows.begin(), rows.end(), row) != rows.end()) {
      run->not_unique.push_back(session.engine.driven[k].name);
    }
  }
}

MjcfOptions MjcfOptionsOf(const Motion& motion, const SimulationOptions& options) {
  MjcfOptions mjcf{.step_s = AdjustedStep(motion, options.step_s),
                   .time_constant_steps = options.stock_time_constant_steps,
                   .default_softness = options.engine == Engine::kDefaults,
                   .runge_kutta = options.runge_kutta,
                   .prescribed = PrescribesMotion(options.mode)};
  if (options.mode == DriveMode::kServo) {
    mjcf.kp.assign(options.servo.kp.begin(), options.servo.kp.end());
    mjcf.kv.assign(options.servo.kv.begin(), options.servo.kv.end());
  }
  return mjcf;
}

RunSummary Run(const Mechanism& mechanism, const Motion& motion, const DrivenMotion& driven,
               const SimulationOptions& options, const std::function<void(double)>& progress,
               SimulationRun* run, bool* diverged) {
  run->mjcf = WriteMjcf(mechanism, MjcfOptionsOf(motion, options));
  EngineModel engine;
  if (RunSummary summary = MakeEngineModel(mechanism, run->mjcf, &engine); !summary.ok()) {
    return summary;
  }
  LeaveOutShapes(&engine);
  if (RunSummary summary = CheckLoads(engine, motion); !summary.ok()) return summary;
  SetRestRates(motion.duration_s, &engine);
  ReleaseForcedDrives(motion, &engine);
  EngineState start;
  if (!PrescribesMotion(options.mode)) {
    DrivenSample first;
    if (RunSummary summary = driven(0.0, &first); !summary.ok()) return summary;
    if (RunSummary summary = FindCommandedStart(motion, first, &engine, &start, &run->notes);
        !summary.ok()) {
      return summary;
    }
    PrescribeDrives(false, &engine);
  }
  if (options.mode == DriveMode::kServo) FindServos(&engine);
  const bool own_events = options.engine == Engine::kCorrected;
  if (RunSummary summary = CheckElements(engine, motion, options.mode, own_events); !summary.ok()) {
    return summary;
  }
  if (motion.free() || IsReleased(engine)) {
    FindPrescribedElements(&engine);
    AddFrictionRows(&engine);
    AddArmatures(&engine);
  }
  Session session(std::move(engine), motion, options, run);
  session.start = std::move(start);
  session.progress = progress;
  RunSummary summary = RunMode(&session, driven);
  if (summary.ok()) ReportUniqueness(session, run);
  *diverged = session.diverged;
  return summary;
}

// Where a corrected run has diverged, what a quarter of its step does shows whether the step or
// the model is to blame.
std::string WithQuarterStep(const Mechanism& mechanism, const Motion& motion,
                            const DrivenMotion& driven, SimulationOptions options,
                            const std::function<void(double)>& progress) {
  options.step_s = 0.25 * AdjustedStep(motion, options.step_s);
  SimulationRun run;
  bool diverged = false;
  const RunSummary summary = Run(mechanism, motion, driven, options, progress, &run, &diverged);
  if (summary.ok()) {
    return fmt::format("; simulation.step_s = {:.3g} follows the motion to its end",
                       options.step_s);
  }
  return fmt::format("; a quarter of the step, {:.3g} s, does not reach the end either: {}",
                     options.step_s, summary.message);
}

}  // namespace
}  // namespace simulation

Diagnostics Check(const SimulationOptions& options) {
  Diagnostics diagnostics;
  const auto require = [&](bool holds, const std::string& rule, double value) {
    if (!holds) {
      diagnostics.Add({.message = fmt::format("{} violates {}", value, rule)});
    }
  };
  require(options.step_s > 0.0, "step_s > 0", options.step_s);
  require(options.guidance_steps >= 20.0, "guidance_steps >= 20", options.guidance_steps);
  require(options.stock_time_constant_steps >= 2.0, "stock_time_constant_steps >= 2",
          options.stock_time_constant_steps);
  return diagnostics;
}

SimulationRun Simulate(const Mechanism& mechanism, const Motion& motion, const DrivenMotion& driven,
                       const SimulationOptions& options,
                       const std::function<void(double)>& progress) {
  SimulationRun run;
  const ComputingTime time;
  {
    simulation::EngineSession session(&run.warnings);
    try {
      bool diverged = false;
      run.summary = simulation::Run(mechanism, motion, driven, options, progress, &run, &diverged);
      if (diverged && options.engine == Engine::kCorrected) {
        run.summary.message +=
            simulation::WithQuarterStep(mechanism, motion, driven, options, progress);
      }
    } catch (const simulation::EngineError& error) {
      run.summary = {.stop = Stop::kEngineFailure,
                     .message = std::string("MuJoCo: ") + error.what()};
    }
  }
  time.StopInto(&run.summary);
  return run;
}

}  // namespace mbv
