#include "simulation/integrator.h"

#include <algorithm>
#include <utility>

#include "mjcf/mjcf.h"
#include "simulation/load_friction.h"

namespace mbv::simulation {
namespace {

// Bodies lighter than this part of the mechanism do not soften it: MuJoCo takes R from the lighter
// of two bodies, and next to a massless one (plan.h) nothing would be held.
constexpr double kLightest = 1e-4;
// Repeated solutions where no force is expected yet: each reduces the error by R's share.
constexpr int kStartRepeats = 4;
// Shares of the largest pivot of J, see the head of integrator.h.
constexpr double kWeak = 0.01, kNear = 0.2;

}  // namespace

Integrator::Integrator(Session* session, double h)
    : s_(*session), m_(session->engine.m.get()), d_(session->data.get()) {
  const double tc = session->options.guidance_steps * h;
  b_ = 2.0 / tc;
  k_ = 1.0 / (tc * tc);
  const int rows = s_.system.rows();
  for (VecX* x : {&bias_, &rate_, &guidance_, &aref_, &expected_}) x->setZero(rows);
  f_.fill(VecX::Zero(rows));
  // Rotation rows: of that mass at a characteristic length.
  largest_R_ = s_.system.row_unit() / s_.system.length();
  largest_R_ = (1.0 - kMjcfImpedance) / (kLightest * mj_getTotalmass(m_)) * largest_R_.cwiseAbs2();
  largest_friction_R_.resize(s_.system.friction_rows());
  friction_R_ = friction_aref_ = largest_friction_R_;
  for (int row = 0; row < s_.system.friction_rows(); ++row) {
    const double unit = s_.system.FrictionUnit(row) / s_.system.length();
    largest_friction_R_[row] =
        (1.0 - kMjcfImpedance) / (kLightest * mj_getTotalmass(m_)) * unit * unit;
  }
  q_ = Eigen::Map<const VecX>(d_->qpos, m_->nq);
  v_ = Eigen::Map<const VecX>(d_->qvel, m_->nv);
  a_.fill(VecX::Zero(m_->nv));
  // The problem is quadratic and the start good: one Newton iteration solves it to round-off. The
  // tolerance only ends its line search, which without one would hunt round-off fifty times.
  session->engine.m->opt.iterations = 1;
  session->engine.m->opt.tolerance = 1e-12;
}

void Integrator::Restore(const Node& node) {
  q_ = node.q;
  v_ = node.v;
  guidance_ = node.guidance;
  a_ = node.a;
  f_ = node.f;
  nodes_ = node.nodes;
  std::copy(a_[0].begin(), a_[0].end(), d_->qacc);
  s_.system.force() = f_[0];
}

void Integrator::EvaluateAgain(const Commanded& at, double t_s) {
  expected_ = f_[0];
  warm_ = a_[0];
  Evaluate(q_, v_, at, t_s);
  for (int i = 0; i < kStartRepeats; ++i) SolveAgain();
  a_[0] = qacc();
  f_[0] = s_.system.force();
}

void Integrator::Start(const Commanded& first) {
  warm_ = qacc();
  Evaluate(q_, v_, first, 0.0);
  for (int i = 0; i < kStartRepeats; ++i) SolveAgain();
  RememberNode();
}

void Integrator::MultiStep(double h, const Commanded& end, double end_s) {
  const double c = h / 24.0, e = h / 360.0;
  // (2), (3)
  v_p_ = v_ + c * (55.0 * a_[0] - 59.0 * a_[1] + 37.0 * a_[2] - 9.0 * a_[3]);
  mean_ = v_ + e * (323.0 * a_[0] - 264.0 * a_[1] + 159.0 * a_[2] - 38.0 * a_[3]);
  q_p_ = q_;
  AdvancePositions(s_.engine, h, mean_, v_, v_p_, &work_, q_p_.data());
  expected_ = 4.0 * (f_[0] + f_[2]) - 6.0 * f_[1] - f_[3];
  warm_ = 4.0 * (a_[0] + a_[2]) - 6.0 * a_[1] - a_[3];
  Evaluate(q_p_, v_p_, end, end_s);
  nodes_ = std::min(nodes_ + 1, static_cast<int>(a_.size()));
  if (s_.motion.free() && PassesSingularPose()) Coast();
  RememberNode();
  // (4), (5)
  mean_ = v_ + e * (38.0 * a_[0] + 171.0 * a_[1] - 36.0 * a_[2] + 7.0 * a_[3]);
  v_p_ = v_ + c * (9.0 * a_[0] + 19.0 * a_[1] - 5.0 * a_[2] + a_[3]);
  AdvancePositions(s_.engine, h, mean_, v_, v_p_, &work_, q_.data());
  v_.swap(v_p_);
}

void Integrator::RungeKutta(double h, const Commanded& middle, const Commanded& end,
                            double from_s) {
  nodes_ = 3;  // what the first multistep finds, but one
  const double half = 0.5 * h;
  const VecX v1 = v_, k1 = a_[0];
  const VecX v2 = v_ + half * k1, u2 = half * v1;
  const VecX k2 = Stage(u2, v2, middle, from_s + half), r2 = Rate(u2, v2);
  const VecX v3 = v_ + half * k2, u3 = half * r2;
  const VecX k3 = Stage(u3, v3, middle, from_s + half), r3 = Rate(u3, v3);
  const VecX v4 = v_ + h * k3, u4 = h * r3;
  const VecX k4 = Stage(u4, v4, end, from_s + h), r4 = Rate(u4, v4);
  const VecX mean = (v1 + 2.0 * r2 + 2.0 * r3 + r4) / 6.0;
  v_ += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  MeasureMiddle(h, v1, k1, k4, middle, from_s + half);
  mj_integratePos(m_, q_.data(), mean.data(), h);
  expected_ = s_.system.force();
  warm_ = k4;
  Evaluate(q_, v_, end, from_s + h);
  SolveAgain();
  RememberNode();
}

// The power half way, at the state that the cubic through the velocities and accelerations of both
// ends has there: that of a stage is only of second order.
void Integrator::MeasureMiddle(double h, const VecX& v_0, const VecX& a_0, const VecX& a_1,
                               const Commanded& middle, double t_s) {
  const VecX force = s_.system.force();
  v_p_ = 0.5 * (v_0 + v_) + h / 8.0 * (a_0 - a_1);
  mean_ = (13.0 * v_0 + 3.0 * v_) / 16.0 + h / 96.0 * (11.0 * a_0 - 5.0 * a_1);
  q_p_ = q_;
  AdvancePositions(s_.engine, 0.5 * h, mean_, v_0, v_p_, &work_, q_p_.data());
  expected_ = force;
  warm_ = 0.5 * (a_0 + a_1);
  Evaluate(q_p_, v_p_, middle, t_s);
  SolveAgain();
  s_.work.Middle(s_.WorkRates());
  s_.system.force() = force;
}

// Acceleration at q ⊕ u.
VecX Integrator::Stage(const VecX& u, const VecX& v, const Commanded& at, double t_s) {
  q_p_ = q_;
  mj_integratePos(m_, q_p_.data(), u.data(), 1.0);
  expected_ = s_.system.force();
  warm_ = qacc();
  Evaluate(q_p_, v, at, t_s, Guidance::kOfTheNode);
  SolveAgain();
  return qacc();
}

// u̇ of q = q_n ⊕ u.
VecX Integrator::Rate(const VecX& u, const VecX& v) const {
  VecX rate = v;
  for (int i = 0; i < m_->nv; ++i) {
    if (!s_.engine.dof_is_rotation3[i]) continue;
    const Vec3 u3 = u.segment<3>(i), w = v.segment<3>(i), c = u3.cross(w);
    rate.segment<3>(i) = w + 0.5 * c + u3.cross(c) / 12.0;
  }
  return rate;
}

// Near it, the softness of the constraints is felt more: solutions are repeated.
bool Integrator::PassesSingularPose() {
  const double pivot = s_.solver.WeakestPivot();
  largest_pivot_ = std::max(largest_pivot_, pivot);
  if (pivot < kWeak * largest_pivot_) return true;
  if (pivot < kNear * largest_pivot_) {
    for (int i = 0; i < kStartRepeats; ++i) SolveAgain();
  }
  return false;
}

// (6)
void Integrator::Coast() {
  work_.setZero(m_->nv);
  double binomial = 1.0;
  for (int i = 1; i <= nodes_; ++i) {
    binomial *= static_cast<double>(nodes_ - i + 1) / i;
    work_ += (i % 2 == 1 ? binomial : -binomial) * a_[static_cast<size_t>(i - 1)];
  }
  std::copy(work_.begin(), work_.end(), d_->qacc);
  if (s_.follows()) s_.ApplyForces(time_s_, at_);
  VecX tau(m_->nv);
  mj_mulM(m_, d_, tau.data(), d_->qacc);
  tau += Eigen::Map<const VecX>(d_->qfrc_bias, m_->nv) -
         Eigen::Map<const VecX>(d_->qfrc_passive, m_->nv) -
         Eigen::Map<const VecX>(d_->qfrc_applied, m_->nv);
  s_.solver.SolveForcesHere(tau);
}

void Integrator::RememberNode() {
  for (size_t i = a_.size() - 1; i > 0; --i) a_[i].swap(a_[i - 1]);
  a_[0] = qacc();
  for (size_t i = f_.size() - 1; i > 0; --i) f_[i].swap(f_[i - 1]);
  f_[0] = s_.system.force();
}

// MuJoCo's stages at one state.
void Integrator::Evaluate(const VecX& q, const VecX& v, const Commanded& at, double t_s,
                          Guidance guidance) {
  std::copy(q.begin(), q.end(), d_->qpos);
  std::copy(v.begin(), v.end(), d_->qvel);
  d_->time = t_s;
  s_.system.SetTargets(at.motion.position);
  s_.system.EvaluatePosition();
  mj_crb(m_, d_);
  mj_factorM(m_, d_);
  mj_comVel(m_, d_);
  s_.system.EvaluatePassive();
  mj_rne(m_, d_, 0, d_->qfrc_bias);
  if (s_.follows()) {
    at_ = at;
    time_s_ = t_s;
    std::copy(warm_.begin(), warm_.end(), d_->qacc);
    s_.system.Bias(&bias_);
  }
  s_.ApplyForces(t_s, at);
  SetReference(v, at.motion, guidance);
  std::copy(warm_.begin(), warm_.end(), d_->qacc_warmstart);
  SolveSmooth();
  SolveConstraints();
  Settle();
}

}  // namespace mbv::simulation
