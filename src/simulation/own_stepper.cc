#include "simulation/own_stepper.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mechanism/channels.h"
#include "simulation/session.h"

namespace mbv::simulation {
namespace {

thread_local OwnStepper* stepping = nullptr;

RunSummary Unsound(const std::string& what, double t_s) {
  return {.stop = Stop::kEngineFailure,
          .message = fmt::format("{} at {:.4g} s", what, t_s),
          .time_s = t_s,
          .where = {},
          .unit = {}};
}

}  // namespace

OwnStepper::OwnStepper(const OwnTask& task, const OwnModel& own, OwnRun* run)
    : task_(task),
      own_(own),
      run_(run),
      m_(own.m.get()),
      d_(MakeData(*own.m)),
      shifted_(MakeData(*own.m)),
      h_(own.m->opt.timestep),
      staged_(own.m->opt.integrator == mjINT_RK4),
      row_(static_cast<size_t>(own.m->neq), -1) {
  stepping = this;
  mjcb_control = &OwnStepper::OnControl;
}

OwnStepper::~OwnStepper() {
  mjcb_control = nullptr;
  stepping = nullptr;
}

// Between the velocity stage and the constraint solver, in every stage of the step.
void OwnStepper::OnControl(const mjModel* /*m*/, mjData* d) {
  if (stepping != nullptr && d == stepping->d_.get()) stepping->Correct();
}

void OwnStepper::FindRows() {
  std::fill(row_.begin(), row_.end(), -1);
  for (int i = d_->nefc - 1; i >= 0; --i) {
    if (d_->efc_type[i] == mjCNSTR_EQUALITY) row_[static_cast<size_t>(d_->efc_id[i])] = i;
  }
}

void OwnStepper::Correct() {
  FindRows();
  if (task_.settings.velocity_term) SupplyVelocityTerm();
  LeadExactly();
}

// J̇q̇ = d/dε J(q ⊕ ε q̇) q̇, a central difference: wrong by ε² of the rates squared.
void OwnStepper::SupplyVelocityTerm() {
  constexpr double kStep_s = 1e-5;
  const auto rates = [&](double step_s, std::vector<mjtNum>* out) {
    mjData* s = shifted_.get();
    mju_copy(s->qpos, d_->qpos, m_->nq);
    mj_integratePos(m_, s->qpos, d_->qvel, step_s);
    mj_kinematics(m_, s);
    mj_comPos(m_, s);
    mj_tendon(m_, s);
    mj_makeConstraint(m_, s);
    if (s->ne != d_->ne) throw EngineError("an equality constrains nothing in this pose");
    out->resize(static_cast<size_t>(s->nefc));
    mj_mulJacVec(m_, s, out->data(), d_->qvel);
  };
  rates(kStep_s, &forth_);
  rates(-kStep_s, &back_);
  for (int i = 0; i < d_->ne; ++i) {
    const auto k = static_cast<size_t>(i);
    d_->efc_aref[i] -= (forth_[k] - back_[k]) / (2.0 * kStep_s);
  }
}

// Semi-implicit steps change the position by the new velocity: what they can follow exactly are
// the differences of the commanded positions.
double OwnStepper::TargetRate(size_t k) const {
  const auto i = static_cast<Eigen::Index>(k);
  if (staged_) return at_.now.velocity[i];
  return (at_.now.position[i] - at_.before.position[i]) / h_;
}

double OwnStepper::TargetAcceleration(size_t k) const {
  const auto i = static_cast<Eigen::Index>(k);
  if (staged_) return at_.now.acceleration[i];
  return (at_.after.position[i] - 2.0 * at_.now.position[i] + at_.before.position[i]) / (h_ * h_);
}

// Reference acceleration of the added equalities: the commanded one, guided softly.
void OwnStepper::LeadExactly() {
  constexpr double kGuidance_s = 0.02, kGuidanceSteps = 20.0;
  const double tc = std::max(kGuidance_s, kGuidanceSteps * h_);
  if (staged_ && !task_.driven(d_->time, &at_.now).ok()) return;
  for (size_t k = 0; k < own_.drives.size(); ++k) {
    const OwnDrive& drive = own_.drives[k];
    if (drive.lead != DriveLead::kAdded) continue;
    const double q = d_->qpos[drive.qpos] - drive.zero, v = d_->qvel[drive.dof];
    const int row = row_[static_cast<size_t>(drive.added)];
    if (row < 0) continue;
    d_->efc_aref[row] = TargetAcceleration(k) + 2.0 / tc * (TargetRate(k) - v) +
                        (at_.now.position[static_cast<Eigen::Index>(k)] - q) / (tc * tc);
  }
}

RunSummary OwnStepper::Command(long n) {
  const double t = static_cast<double>(n) * h_;
  if (RunSummary s = task_.driven(t, &at_.now); !s.ok()) return s;
  if (RunSummary s = task_.driven(std::max(0.0, t - h_), &at_.before); !s.ok()) return s;
  if (RunSummary s = task_.driven(t + h_, &at_.after); !s.ok()) return s;
  for (size_t k = 0; k < own_.drives.size(); ++k) {
    const OwnDrive& drive = own_.drives[k];
    const double position = at_.now.position[static_cast<Eigen::Index>(k)];
    if (drive.lead == DriveLead::kServo) {
      LeadByActuators(drive, drive.zero + position, at_.now.velocity[static_cast<Eigen::Index>(k)]);
    } else if (drive.lead == DriveLead::kEquality) {
      own_.m->eq_data[mjNEQDATA * drive.equality] = position;
    }
  }
  return RunSummary::Done();
}

// The control at which an actuator pushes with nothing where the joint is as commanded.
void OwnStepper::LeadByActuators(const OwnDrive& drive, double position, double velocity) {
  for (const int u : drive.actuators) {
    const mjtNum* bias = m_->actuator_biasprm + mjNBIAS * u;
    const double gear = m_->actuator_gear[6 * u], gain = m_->actuator_gainprm[mjNGAIN * u];
    const double control =
        -(bias[0] + (bias[1] != 0.0 ? bias[1] * gear * position : bias[2] * gear * velocity)) /
        gain;
    d_->ctrl[u] = control;
    const mjtNum* range = m_->actuator_ctrlrange + 2 * u;
    if (m_->actuator_ctrllimited[u] != 0 && (control < range[0] || control > range[1])) {
      Note("a servo's ctrlrange cuts its command", d_->time);
    }
  }
}

RunSummary OwnStepper::Start() {
  DrivenSample first;
  if (RunSummary summary = task_.driven(0.0, &first); !summary.ok()) return summary;
  constexpr double kNear = 1e-6;  // [m, rad, per second]
  double off = first.velocity.cwiseAbs().maxCoeff();
  for (size_t k = 0; k < own_.drives.size(); ++k) {
    const OwnDrive& drive = own_.drives[k];
    off = std::max(off, std::abs(own_.home[drive.qpos] - drive.zero -
                                 first.position[static_cast<Eigen::Index>(k)]));
  }
  if (off > kNear) {
    return {.stop = Stop::kUnsupported,
            .message = "the motion does not start at home and at rest",
            .where = {},
            .unit = {}};
  }
  mj_resetData(m_, d_.get());
  Eigen::Map<VecX>(d_->qpos, m_->nq) = own_.home;
  std::fill_n(d_->qvel, m_->nv, 0.0);
  return RunSummary::Done();
}

void OwnStepper::Note(const std::string& what, double t_s) {
  if (std::find(noted_.begin(), noted_.end(), what) != noted_.end()) return;
  noted_.push_back(what);
  run_->notes.push_back(fmt::format("{}, first at {:.4g} s", what, t_s));
}

RunSummary OwnStepper::Trouble(double t_s) const {
  static constexpr std::array<std::pair<int, const char*>, 5> kWarnings = {
      {{mjWARN_BADQPOS, "MuJoCo reset the simulation, which had diverged (positions),"},
       {mjWARN_BADQVEL, "MuJoCo reset the simulation, which had diverged (velocities),"},
       {mjWARN_BADQACC, "MuJoCo reset the simulation, which had diverged (accelerations),"},
       {mjWARN_INERTIA, "MuJoCo found the inertia matrix singular"},
       {mjWARN_CNSTRFULL, "MuJoCo had no room for all constraint rows (<size njmax>)"}}};
  for (const auto& [warning, text] : kWarnings) {
    if (d_->warning[warning].number > 0) return Unsound(text, t_s);
  }
  if (!IsSane(d_->qpos, m_->nq) || !IsSane(d_->qvel, m_->nv) || !IsSane(d_->qacc, m_->nv)) {
    return Unsound("the motion is not finite", t_s);
  }
  return RunSummary::Done();
}

RunSummary OwnStepper::Run() {
  if (RunSummary summary = Start(); !summary.ok()) return summary;
  // The file's own steps carry the samples, whatever the step is now.
  const double own_step = own_.facts.step_s;
  const long per_sample =
      std::max(1L, std::lround(task_.sample_s / own_step)) * std::lround(own_step / h_);
  const double spacing = static_cast<double>(per_sample) * h_;
  const long samples = std::lround(std::floor(task_.duration_s / spacing * (1.0 + 4 * kEps)));
  std::vector<Channel> channels;
  for (const Drive& drive : task_.mechanism->drives) {
    channels.push_back(
        MakeChannel(Quantity::kForce, ForceUnit(*task_.mechanism, drive), drive.name));
  }
  for (const OwnClosure& closure : own_.closures) {
    const auto all = ReactionChannels(task_.mechanism->joints[static_cast<size_t>(closure.joint)]);
    channels.insert(channels.end(), all.begin(), all.begin() + 3);
  }
  run_->trace.Reset(SampleTimes(static_cast<double>(samples) * spacing, spacing),
                    std::move(channels));
  run_->gaps.resize(own_.closures.size());
  run_->tracking.assign(own_.drives.size(), 0.0);
  double cpu_s = 0.0;
  for (long n = 0; n <= samples * per_sample; ++n) {
    const double t = static_cast<double>(n) * h_;
    if (RunSummary summary = Command(n); !summary.ok()) return summary;
    if (n % per_sample == 0) Record(n / per_sample, t);
    const double from = ThreadSeconds();
    mj_step(m_, d_.get());
    cpu_s += ThreadSeconds() - from;
    if (RunSummary trouble = Trouble(t); !trouble.ok()) return trouble;
  }
  run_->cost_ms = 1e3 * cpu_s / (static_cast<double>(samples * per_sample + 1) * h_);
  return RunSummary::Done();
}

}  // namespace mbv::simulation
