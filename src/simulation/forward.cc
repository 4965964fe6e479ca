// Forward mode, corrected engine: MuJoCo's accelerations, integrated with fourth order.
//
// At every node MuJoCo computes the acceleration and the constraint forces from position,
// velocity and commanded motion at that very time; what 2.2.2 leaves out of its constraint rows is
// supplied between its stages:
//   aref = ẍ_ref − J̇q̇ − b (J q̇ − ẋ_ref) − k r + R f̂,  b = 2/tc, k = 1/tc²                    (1)
// (closures: ẍ_ref = ẋ_ref = 0). f̂ is the force expected from the last nodes, which cancels the
// softness R of MuJoCo's constraints; R itself is lowered below the bound that the impedance
// limit sets. Between nodes:
//   predictor  v ← v_n + h/24 (55 a_n − 59 a_{n−1} + 37 a_{n−2} − 9 a_{n−3}) (2)
//              q ← q_n ⊕ (h v_n + h²/360 (323 a_n − 264 a_{n−1} + 159 a_{n−2} − 38 a_{n−3})) (3)
//   evaluate   a_{n+1}, f_{n+1} at the predicted state: this is the state that is recorded
//   corrector  v_{n+1} = v_n + h/24 (9 a_{n+1} + 19 a_n − 5 a_{n−1} + a_{n−2}) (4)
//              q_{n+1} = q_n ⊕ (h v_n + h²/360 (38 a_{n+1} + 171 a_n − 36 a_{n−1} + 7 a_{n−2})) (5)
// one evaluation per step. At the start and after every break of the commanded profiles the
// classical Runge–Kutta method builds up the history, stepping onto the break.
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>

#include "simulation/session.h"
#include "simulation/steps.h"

namespace mbv::simulation {
namespace {

// R of a row relative to MuJoCo's own at its strongest impedance.
double kSoftness = getenv("SOFT") ? atof(getenv("SOFT")) : 1e-2;
// Force iterations at the start, where no expectation exists.
constexpr int kStartIterations = 12;

class Integrator {
 public:
  Integrator(Session* session, double h)
      : s_(*session), m_(session->engine.m.get()), d_(session->data.get()), h_(h) {
    const double tc_loop = session->options.loop_tc_steps * h;
    const double tc_drive = session->options.drive_tc_steps * h;
    const int rows = s_.system.rows(), closed = s_.system.closure_rows();
    b_.setConstant(rows, 2.0 / tc_drive);
    k_.setConstant(rows, 1.0 / (tc_drive * tc_drive));
    b_.head(closed).setConstant(2.0 / tc_loop);
    k_.head(closed).setConstant(1.0 / (tc_loop * tc_loop));
    expected_.setZero(rows);
    last_force_.setZero(rows);
    aref_.setZero(rows);
    q_ = Eigen::Map<const VecX>(d_->qpos, m_->nq);
    v_ = Eigen::Map<const VecX>(d_->qvel, m_->nv);
    for (VecX& a : a_) a.setZero(m_->nv);
  }

  void Start(const DrivenSample& at) {
    a_[0] = Eigen::Map<const VecX>(d_->qacc, m_->nv);
    Evaluate(q_, v_, at, 0.0);
    for (int i = 0; i < kStartIterations; ++i) Resolve();
    Push(false);
  }

  /// One evaluation; the state recorded is the predicted one.
  void MultiStep(double h, const DrivenSample& at, double t_s) {
    const auto& [a0, a1, a2, a3] = a_;
    v_p_ = v_ + h / 24.0 * (55.0 * a0 - 59.0 * a1 + 37.0 * a2 - 9.0 * a3);
    mean_ = v_ + h / 360.0 * (323.0 * a0 - 264.0 * a1 + 159.0 * a2 - 38.0 * a3);
    q_p_ = q_;
    AdvancePositions(s_.engine, h, mean_, v_, v_p_, &work_, q_p_.data());
    expected_ = 2.0 * force() - last_force_;
    warm_ = 2.0 * a0 - a1;
    Evaluate(q_p_, v_p_, at, t_s);
    Push(true);
    mean_ = v_ + h / 360.0 * (38.0 * a_[0] + 171.0 * a_[1] - 36.0 * a_[2] + 7.0 * a_[3]);
    v_p_ = v_ + h / 24.0 * (9.0 * a_[0] + 19.0 * a_[1] - 5.0 * a_[2] + a_[3]);
    AdvancePositions(s_.engine, h, mean_, v_, v_p_, &work_, q_.data());
    v_.swap(v_p_);
  }

  /// Four evaluations; `middle` and `end` are the driven motion there.
  void RungeKutta(double h, const DrivenSample& middle, const DrivenSample& end, double t_s) {
    const VecX k1 = a_[0];
    const VecX v1 = v_ + 0.5 * h * k1;
    const VecX u2 = 0.5 * h * v_;
    const VecX k2 = Stage(u2, v1, middle, t_s + 0.5 * h);
    const VecX v2 = v_ + 0.5 * h * k2;
    const VecX r2 = Rate(u2, v1);
    const VecX u3 = 0.5 * h * r2;
    const VecX k3 = Stage(u3, v2, middle, t_s + 0.5 * h);
    const VecX v3 = v_ + h * k3;
    const VecX r3 = Rate(u3, v2);
    const VecX u4 = h * r3;
    const VecX k4 = Stage(u4, v3, end, t_s + h);
    const VecX r4 = Rate(u4, v3);
    const VecX mean = (v_ + 2.0 * r2 + 2.0 * r3 + r4) / 6.0;
    mj_integratePos(m_, q_.data(), mean.data(), h);
    v_ += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    expected_ = force();
    warm_ = k4;
    last_force_ = force();
    Evaluate(q_, v_, end, t_s + h);
    Resolve();
    Push(false);
  }

  [[nodiscard]] bool healthy() const { return AllFinite(d_->qacc, m_->nv); }

 private:
  Eigen::Map<VecX> force() { return s_.system.force(); }

  // Acceleration at q ⊕ u.
  VecX Stage(const VecX& u, const VecX& v, const DrivenSample& at, double t_s) {
    q_p_ = q_;
    mj_integratePos(m_, q_p_.data(), u.data(), 1.0);
    expected_ = force();
    warm_ = Eigen::Map<const VecX>(d_->qacc, m_->nv);
    Evaluate(q_p_, v, at, t_s);
    return Eigen::Map<const VecX>(d_->qacc, m_->nv);
  }

  // u̇ of q = q_n ⊕ u: v, for rotation vectors v + ½ u × v + 1/12 u × (u × v).
  VecX Rate(const VecX& u, const VecX& v) const {
    VecX rate = v;
    for (int i = 0; i < m_->nv; ++i) {
      if (!s_.engine.dof_is_rotation3[i]) continue;
      const Vec3 u3 = u.segment<3>(i), w = v.segment<3>(i), c = u3.cross(w);
      rate.segment<3>(i) = w + 0.5 * c + u3.cross(c) / 12.0;
    }
    return rate;
  }

  void Push(bool keep) {
    // Oldest first, by swapping: no copies.
    if (keep) last_pushed_ = true;
    for (int i = 3; i > 0; --i) a_[i].swap(a_[i - 1]);
    a_[0] = Eigen::Map<const VecX>(d_->qacc, m_->nv);
  }

  // MuJoCo's stages at one state, with (1) between velocity and constraint stage.
  void Evaluate(const VecX& q, const VecX& v, const DrivenSample& at, double t_s) {
    last_force_ = force();
    std::copy(q.begin(), q.end(), d_->qpos);
    std::copy(v.begin(), v.end(), d_->qvel);
    d_->time = t_s;
    s_.system.SetTargets(at.position);
    s_.system.EvaluatePosition();
    mj_crb(m_, d_);
    mj_factorM(m_, d_);
    mj_comVel(m_, d_);
    if (!s_.engine.spring_tendon.empty()) {
      Eigen::Map<VecX>(d_->ten_velocity, m_->ntendon) =
          Eigen::Map<const RowMajor>(d_->ten_J, m_->ntendon, m_->nv) * v;
      mj_passive(m_, d_);
    }
    mj_rne(m_, d_, 0, d_->qfrc_bias);
    s_.loads.Evaluate(t_s, *d_);
    if (!s_.loads.world().empty()) {
      mju_zero(d_->qfrc_applied, m_->nv);
      s_.loads.AddGeneralized(d_, d_->qfrc_applied);
    }
    SetReference(v, at);
    if (warm_.size() > 0) std::copy(warm_.begin(), warm_.end(), d_->qacc_warmstart);
    mj_fwdAcceleration(m_, d_);
    mj_fwdConstraint(m_, d_);
  }

  // Solves the constraints again with the force just found as expectation.
  void Resolve() {
    expected_ = force();
    ApplyReference();
    mj_fwdConstraint(m_, d_);
  }

  void SetReference(const VecX& v, const DrivenSample& at) {
    const int rows = s_.system.rows(), driven = s_.system.driven_rows();
    s_.system.Bias(&bias_);
    rate_.noalias() = s_.system.J() * v;
    aref_ = -bias_;
    rate_.tail(driven) -= at.velocity;
    aref_.tail(driven) += at.acceleration;
    aref_.array() -= b_.array() * rate_.array() + k_.array() * s_.system.residual().array();
    for (int i = 0; i < rows; ++i) {
      d_->efc_R[i] *= kSoftness;
      d_->efc_D[i] /= kSoftness;
    }
    ApplyReference();
  }

  void ApplyReference() {
    const int rows = s_.system.rows();
    Eigen::Map<VecX>(d_->efc_aref, rows) =
        aref_ + Eigen::Map<const VecX>(d_->efc_R, rows).cwiseProduct(expected_);
  }

  Session& s_;
  const mjModel* const m_;
  mjData* const d_;
  const double h_;
  VecX b_, k_, q_, v_, q_p_, v_p_, mean_, work_, warm_;
  VecX bias_, rate_, aref_, expected_, last_force_;
  std::array<VecX, 4> a_;  // accelerations at the last nodes, newest first
  bool last_pushed_ = false;
};

}  // namespace

RunSummary RunCorrected(Session* s, const DrivenMotion& driven) {
  const std::vector<Step> steps = MakeSteps(s->motion, s->options.step_s);
  std::vector<DrivenSample> ends(steps.size()), middles(steps.size());
  DrivenSample first;
  if (RunSummary summary = driven(0.0, &first); !summary.ok()) return summary;
  for (size_t i = 0; i < steps.size(); ++i) {
    if (steps[i].uniform < 4) {
      const double middle = 0.5 * (steps[i].from_s + steps[i].to_s);
      if (RunSummary summary = driven(middle, &middles[i]); !summary.ok()) return summary;
    }
    if (RunSummary summary = driven(steps[i].to_s, &ends[i]); !summary.ok()) return summary;
  }
  VecX home(s->engine.driven.size());
  for (size_t k = 0; k < s->engine.driven.size(); ++k) home[k] = s->engine.driven[k].home;
  if (RunSummary summary = s->solver.Follow(home, first.position); !summary.ok()) return summary;
  s->solver.SolveVelocity(first.velocity);
  s->solver.SolveAcceleration(first.acceleration);
  s->engine.m->opt.iterations = 3;
  s->engine.m->opt.tolerance = 0;
  Integrator integrator(s, AdjustedStep(s->motion, s->options.step_s));
  const auto start = std::chrono::steady_clock::now();
  integrator.Start(first);
  s->Record(0);
  for (size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    const double h = step.to_s - step.from_s;
    if (step.uniform == 4) {
      integrator.MultiStep(h, ends[i], step.to_s);
    } else {
      integrator.RungeKutta(h, middles[i], ends[i], step.from_s);
    }
    if (!integrator.healthy()) {
      return {.stop = Stop::kEngineFailure,
              .message = "the simulated accelerations are no longer finite",
              .time_s = step.to_s,
              .where = {},
              .unit = {}};
    }
    if (step.sample >= 0) s->Record(static_cast<size_t>(step.sample));
  }
  s->run->loop_wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  s->run->steps = static_cast<long>(steps.size());
  return RunSummary::Done();
}

RunSummary RunStock(Session*, const DrivenMotion&) { return {}; }

}  // namespace mbv::simulation
