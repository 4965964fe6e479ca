#include "simulation/engine/integrator.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "simulation/engine/element_forces.h"
#include "simulation/engine/load_friction.h"
#include "simulation/mjcf/mjcf.h"

namespace mbv::simulation {

namespace {

// Bodies lighter than this part of the mechanism do not soften it: MuJoCo takes R from the lighter
// of two bodies, and next to a massless one (plan.h) nothing would be held.
constexpr double kLightest = 1e-4;
// Repeated solutions where no force is expected yet: each reduces the error by R's share.
constexpr int kStartRepeats = 4;
// Shares of the largest pivot of J, see the head of integrator.h.
constexpr double kWeak = 0.01, kNear = 0.2;
// Softness R of a constraint row relative to MuJoCo's own at its strongest impedance, 0.9999. The
// force error that it leaves falls with R, the rounding error of the force rises with 1/R; in
// between lie four decades where neither is seen.
constexpr double kSoftness = 1e-5, kLeastSoftness = 1e-9;
// Fewer rows are never so soft as to be looked at.
constexpr int kManyRows = 200;
// The share of an expected force that may come back, and iterations and size of the forces, beside
// the largest one, that find it.
constexpr double kMostReturned = 0.02, kProbe = 1e-3;
constexpr int kProbes = 10;

}  // namespace

Integrator::Integrator(Session* session, double h)
    : s_(*session), m_(session->engine.m.get()), d_(session->data.get()), softness_(kSoftness) {
  const double tc = session->options.guidance_steps * h;
  b_ = 2.0 / tc;
  k_ = 1.0 / (tc * tc);
  const int rows = s_.system.rows();
  for (VecX* x : {&bias_, &rate_, &guidance_, &aref_, &expected_}) x->setZero(rows);
  f_.fill(VecX::Zero(rows));
  // Rotation rows: of that mass at a characteristic length.
  largest_R_ = s_.system.row_unit() / s_.system.length();
  largest_R_ = (1.0 - kMjcfImpedance) / (kLightest * mj_getTotalmass(m_)) * largest_R_.cwiseAbs2();
  // MuJoCo 2.2 softens a weld's rotation rows as its translation rows, in 1/kg: the smaller the
  // bodies, the harder they would be held beside what their inertia is.
  R_unit_.setOnes(rows);
  for (size_t c = 0; c < s_.engine.plan.closures.size(); ++c) {
    if (s_.engine.plan.closures[c].type == mjcf::PlannedClosure::Type::kConnect) continue;
    R_unit_.segment<3>(s_.system.closure_row(static_cast<int>(c)) + 3)
        .setConstant(1.0 / (s_.system.length() * s_.system.length()));
  }
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
  if (s_.system.rows() >= kManyRows) Harden(first);
  RememberNode();
}

// The largest eigenvalue of (A + R)⁻¹R beside self-stress, by power iteration. The data's forces
// and accelerations stay.
double Integrator::ShareReturned() {
  const VecX force = s_.system.force(), acceleration = qacc(), unit = s_.system.row_unit();
  const auto found = [&](const VecX& more) -> VecX {
    expected_ = force + more;
    ApplyReference();
    SolveConstraints();
    return s_.system.force();
  };
  const auto size = [&](const VecX& x) { return x.cwiseProduct(unit).norm(); };
  const double largest = force.cwiseProduct(unit).lpNorm<Eigen::Infinity>();
  const double probe = kProbe * (largest > 0.0 ? largest : 1.0);
  VecX more(force.size());
  for (Eigen::Index i = 0; i < more.size(); ++i) {
    more[i] = (1.0 + 0.5 * std::sin(1.7 * static_cast<double>(i))) / unit[i];
  }
  const VecX none = found(VecX::Zero(force.size()));
  double share = 0.0;
  for (int i = 0; i < kProbes; ++i) {
    more *= probe / size(more);
    const VecX back = found(more) - none;
    share = size(back) / probe;
    if (!(share > 0.0)) break;
    more = back;
  }
  std::copy(acceleration.begin(), acceleration.end(), d_->qacc);
  s_.system.force() = force;
  return share;
}

void Integrator::Harden(const Commanded& first) {
  const double share = ShareReturned();
  if (!(share > kMostReturned)) return;
  // ρ/(1 − ρ) is in proportion to R.
  const double ratio =
      share < 1.0 ? share / (1.0 - share) : std::numeric_limits<double>::infinity();
  softness_ = std::max(kLeastSoftness, kSoftness * kMostReturned / ratio);
  warm_ = qacc();
  Evaluate(q_, v_, first, 0.0);
  for (int i = 0; i < kStartRepeats; ++i) SolveAgain();
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
  s_.SetPayloads(t_s);
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

// The integrator's constraint stage: forces of the closed loops, of dry friction and of what
// follows accelerations, at a given state.

namespace {

// How far off the acceleration is that the solver starts from [m/s², rad/s²].
constexpr double kNudge = 1e-9;
// What MuJoCo's solver takes to decide which rows of friction give way.
constexpr int kFrictionIterations = 100;
// A row that gives way anyway is put this many times as far off as its force could accelerate it.
constexpr double kBeyond = 10.0;
constexpr double kUnbounded = 1e20;
// A smaller share of what its force could do to a row is no acceleration.
constexpr double kMoves = 1e-6;
// Forces that follow accelerations have settled when a pass changes them by less than this share of
// the largest; where round-off keeps that away, when passes no longer help below the second.
constexpr double kSettledForces = 4e-16, kStalledForces = 1e-11;
constexpr int kMostSettling = 400;
}  // namespace

void Integrator::SolveSmooth() {
  mj_fwdAcceleration(m_, d_);
  // MuJoCo starts from here where that is cheaper than the warm start: as far off as that one.
  if (d_->nefc > 0) Eigen::Map<VecX>(d_->qacc_smooth, m_->nv).array() += kNudge;
}

// Forces by the accelerations and loads just found, until they are those that MuJoCo finds.
void Integrator::Settle() {
  if (!s_.follows()) return;
  const VecX units = s_.system.dof_unit();
  double last = kUnbounded;
  for (int pass = 0; pass < kMostSettling; ++pass) {
    const VecX before = Eigen::Map<const VecX>(d_->qfrc_applied, m_->nv);
    const ConstraintSystem::FrictionByLoad found = LoadFrictionOf(&s_);
    double change = 0.0, largest = 0.0;
    for (const size_t e : s_.loaded) {
      const auto k = static_cast<Eigen::Index>(e);
      const double unit = units[s_.engine.elements[e].dof];
      change = std::max({change, unit * std::abs(found.size[k] - s_.system.load_friction(e)),
                         unit * std::abs(found.force[k] - s_.system.load_force(e))});
      largest = std::max(largest, unit * found.size[k]);
    }
    s_.system.SetLoadFriction(found);
    s_.ApplyForces(time_s_, at_);
    const Eigen::Map<const VecX> now(d_->qfrc_applied, m_->nv);
    change = std::max(change, (now - before).cwiseProduct(units).cwiseAbs().maxCoeff());
    largest = std::max(largest, now.cwiseProduct(units).cwiseAbs().maxCoeff());
    if (change <= kSettledForces * largest) return;
    if (change >= last && change <= kStalledForces * largest) return;
    last = change;
    SolveSmooth();
    expected_ = s_.system.force();
    ApplyReference();
    SolveConstraints();
  }
  if (s_.trouble.ok()) {
    s_.trouble = {.stop = Stop::kSingular,
                  .message =
                      "friction by loads and the loads, or rotors and the bodies that carry "
                      "them, raise each other",
                  .time_s = time_s_};
  }
}

// MuJoCo's constraint stage, from a start that is a little off: it takes no Newton step shorter
// than 1e-15, and what that leaves undone in the acceleration is divided by R in the force.
void Integrator::SolveConstraints() {
  if (friction_aref_.size() == 0) return SolveOnce();
  HoldFriction(VecX::Zero(friction_aref_.size()));
  SolveOnce();
  if (!FrictionExceeds()) return;
  // MuJoCo decides with soft rows; what that leaves open is decided with hard ones.
  VecX gives = DecideFriction();
  for (Eigen::Index i = 0; i <= 2 * gives.size(); ++i) {
    HoldFriction(gives);
    SolveOnce();
    if (!RefineFriction(&gives)) return;
  }
}

// Rows that hold more than their loss give way, rows that move with their force hold. False where
// there are none.
bool Integrator::RefineFriction(VecX* gives) const {
  bool changed = false;
  for (int row = 0; row < s_.system.friction_rows(); ++row) {
    const int i = s_.system.rows() + row;
    const double loss = s_.system.HeldLoss(row), force = d_->efc_force[i];
    const double moves = s_.system.FrictionJacobian(row).dot(qacc()) - friction_aref_[row];
    double& sign = (*gives)[row];
    if (loss > 0.0 && sign == 0.0 && std::abs(force) > loss) {
      sign = force > 0.0 ? 1.0 : -1.0;
      changed = true;
    } else if (sign * moves > kMoves * loss * d_->efc_diagApprox[i]) {
      sign = 0.0;
      changed = true;
    }
  }
  return changed;
}

void Integrator::SolveOnce() {
  Eigen::Map<VecX>(d_->qacc_warmstart, m_->nv).array() += kNudge;
  const OwnJacobians jacobians(s_.engine);
  mj_fwdConstraint(m_, d_);
}

// Rows hold without bound, but for those that exert ± their loss (`gives`).
void Integrator::HoldFriction(const VecX& gives) {
  for (Eigen::Index row = 0; row < gives.size(); ++row) {
    const int i = s_.system.rows() + static_cast<int>(row);
    const double loss = s_.system.HeldLoss(static_cast<int>(row));
    d_->efc_R[i] = softness_ * friction_R_[row];
    d_->efc_D[i] = 1.0 / d_->efc_R[i];
    d_->efc_frictionloss[i] = loss > 0.0 && gives[row] == 0.0 ? kUnbounded : loss;
    d_->efc_aref[i] = friction_aref_[row] + kBeyond * gives[row] * loss * d_->efc_diagApprox[i];
  }
}

bool Integrator::FrictionExceeds() const {
  for (int row = 0; row < s_.system.friction_rows(); ++row) {
    const double loss = s_.system.HeldLoss(row);
    if (loss > 0.0 && std::abs(d_->efc_force[s_.system.rows() + row]) > loss) return true;
  }
  return false;
}

// The sign of the force of each row that MuJoCo finds at its bound, else 0.
VecX Integrator::DecideFriction() {
  for (int row = 0; row < s_.system.friction_rows(); ++row) {
    const int i = s_.system.rows() + row;
    d_->efc_R[i] = friction_R_[row];
    d_->efc_D[i] = 1.0 / d_->efc_R[i];
    d_->efc_frictionloss[i] = s_.system.HeldLoss(row);
    d_->efc_aref[i] = friction_aref_[row];
  }
  mjOption& option = s_.engine.m->opt;
  const int iterations = std::exchange(option.iterations, kFrictionIterations);
  const double tolerance = std::exchange(option.tolerance, 0.0);
  SolveOnce();
  option.iterations = iterations;
  option.tolerance = tolerance;
  VecX gives = VecX::Zero(s_.system.friction_rows());
  for (int row = 0; row < s_.system.friction_rows(); ++row) {
    const int state = d_->efc_state[s_.system.rows() + row];
    if (state == mjCNSTRSTATE_LINEARNEG) gives[row] = 1.0;
    if (state == mjCNSTRSTATE_LINEARPOS) gives[row] = -1.0;
  }
  return gives;
}

// (1) without the expected force; R and its inverse D.
void Integrator::SetReference(const VecX& v, const DrivenSample& at, Guidance guidance) {
  const int rows = s_.system.rows();
  s_.system.Bias(&bias_);
  rate_ = s_.system.J() * v;
  aref_ = -bias_;
  s_.system.AddPrescribed(-1.0, at.velocity, &rate_);
  s_.system.AddPrescribed(1.0, at.acceleration, &aref_);
  if (guidance == Guidance::kNew) guidance_ = b_ * rate_ + k_ * s_.system.residual();
  aref_ -= guidance_;
  Eigen::Map<VecX> R(d_->efc_R, rows);
  R = softness_ * R.cwiseProduct(R_unit_).cwiseMin(largest_R_);
  Eigen::Map<VecX>(d_->efc_D, rows) = R.cwiseInverse();
  SetFrictionRows(v);
  ApplyReference();
}

// Rows that hold what rests: no acceleration, as in (1).
void Integrator::SetFrictionRows(const VecX& v) {
  const int rows = s_.system.rows();
  for (int row = 0; row < s_.system.friction_rows(); ++row) {
    const FrictionPlace& place = s_.engine.frictions[static_cast<size_t>(row)];
    const double bias = place.tendon >= 0 ? s_.system.TendonBias(place.tendon) : 0.0;
    friction_R_[row] =
        std::min((1.0 - kMjcfImpedance) * d_->efc_diagApprox[rows + row], largest_friction_R_[row]);
    friction_aref_[row] = -bias - b_ * s_.system.FrictionJacobian(row).dot(v);
    for (const size_t e : place.elements) {  // a rigid stop in touch, back to its end
      const ForceElement& element = s_.engine.mechanism->elements[e];
      if (!IsRigidStop(element) || s_.system.sliding().empty() || s_.system.sliding()[e] != 0) {
        continue;
      }
      const auto& stop = std::get<StopLaw>(element.law);
      const double q = ElementMotionOf(s_.system, e).position;
      const double up = stop.upper - q, down = stop.lower - q;
      friction_aref_[row] += k_ * (std::abs(up) < std::abs(down) ? up : down);
    }
  }
}

// With redundant constraints the self-stress is determined through R alone, and a force that relies
// on its own past would drift: no self-stress is expected, so none is found.
void Integrator::ApplyReference() {
  const int rows = s_.system.rows();
  s_.solver.RemoveSelfStress(&expected_);
  Eigen::Map<VecX>(d_->efc_aref, rows) =
      aref_ + Eigen::Map<const VecX>(d_->efc_R, rows).cwiseProduct(expected_);
}

// The constraint stage once more, expecting the force just found.
void Integrator::SolveAgain() {
  expected_ = s_.system.force();
  ApplyReference();
  SolveConstraints();
  Settle();
}

namespace {

// Along u: stiffness k, damping c.
struct Elastic {
  std::string name;
  VecX u;
  double k = 0.0, c = 0.0;
};

std::vector<Elastic> ElasticParts(const ConstraintSystem& system, const ServoGains& servo) {
  const EngineModel& engine = system.engine();
  std::vector<Elastic> parts;
  for (size_t s = 0; s < engine.spring_tendon.size(); ++s) {
    const SpringDamper& spring = engine.mechanism->springs[s];
    const double* J = system.data()->ten_J + engine.spring_tendon[s] * system.nv();
    parts.push_back({"spring '" + spring.name + "'", Eigen::Map<const VecX>(J, system.nv()),
                     spring.stiffness, spring.damping});
  }
  for (size_t e = 0; e < engine.elements.size(); ++e) {
    const ForceElement& element = engine.mechanism->elements[e];
    const double unit = ActsOnLength(*engine.mechanism, element) ? system.length() : 1.0;
    const ElementSlope slope = SlopeOf(element, ElementMotionOf(system, e).position, unit);
    if (slope.stiffness == 0.0 && slope.damping == 0.0) continue;
    parts.push_back({"element '" + element.name + "'", ElementGradient(system, e), slope.stiffness,
                     slope.damping});
  }
  for (Eigen::Index k = 0; k < servo.kp.size(); ++k) {
    const auto drive = static_cast<int>(k);
    parts.push_back({"the servo of '" + engine.driven[static_cast<size_t>(k)].name + "'",
                     system.DrivenJacobian(drive), servo.kp[k], servo.kv[k]});
  }
  return parts;
}

// Columns: a basis of the motions that the constraints leave.
MatX FreeMotions(const ConstraintSystem& system) {
  const int nv = system.nv();
  if (system.rows() == 0) return MatX::Identity(nv, nv);
  constexpr double kRankTolerance = 1e-9;
  Eigen::ColPivHouseholderQR<MatX> qr;
  qr.setThreshold(kRankTolerance);
  qr.compute(MatX(system.J()).transpose());
  const MatX Q = OrthogonalFactor(qr);
  return Q.rightCols(nv - qr.rank());
}

// The part with most of the energy of a mode of velocities x.
std::string PartOf(const std::vector<Elastic>& parts, const Eigen::VectorXcd& x, double rate) {
  std::string name;
  double most = -1.0;
  for (const Elastic& part : parts) {
    const std::complex<double> along = (part.u.cast<std::complex<double>>().transpose() * x)(0);
    const double share = (std::abs(part.k) + part.c * rate) * std::norm(along);
    if (share <= most) continue;
    most = share;
    name = part.name;
  }
  return name;
}

}  // namespace

FastestRate FastestRateOf(const ConstraintSystem& system, const ServoGains& servo,
                          double duration_s) {
  FastestRate fastest;
  const std::vector<Elastic> parts = ElasticParts(system, servo);
  if (parts.empty()) return fastest;
  const MatX N = FreeMotions(system);
  const Eigen::Index n = N.cols();
  if (n == 0) return fastest;
  const mjModel* m = system.engine().m.get();
  mj_crb(m, system.data());
  RowMajor M(m->nv, m->nv);
  mj_fullM(m, M.data(), system.data()->qM);
  // (1)
  MatX K = MatX::Zero(n, n), C = MatX::Zero(n, n);
  for (const Elastic& part : parts) {
    const VecX u = N.transpose() * part.u;
    K += part.k * u * u.transpose();
    C += part.c * u * u.transpose();
  }
  const Eigen::LDLT<MatX> M_N(MatX(N.transpose() * M * N));
  MatX A = MatX::Zero(2 * n, 2 * n);
  A.topRightCorner(n, n).setIdentity();
  A.bottomLeftCorner(n, n) = -M_N.solve(K);
  A.bottomRightCorner(n, n) = -M_N.solve(C);
  // (2), (3)
  const Eigen::EigenSolver<MatX> modes(A);
  Eigen::Index fast = 0, worst = 0;
  fastest.per_s = modes.eigenvalues().cwiseAbs().maxCoeff(&fast);
  for (Eigen::Index k = 0; k < modes.eigenvalues().size(); ++k) {
    const double rate = std::abs(modes.eigenvalues()[k]);
    const double damping = std::abs(modes.eigenvalues()[k].real());
    const double lasts = damping * duration_s > 1.0 ? 1.0 / damping : duration_s;
    const double drift = 1e-3 * std::pow(rate, 5) * lasts;
    if (drift <= fastest.drift) continue;
    fastest.drift = drift;
    fastest.drift_per_s = rate;
    worst = k;
  }
  const auto part_of = [&](Eigen::Index k) {
    const Eigen::VectorXcd x = N * modes.eigenvectors().col(k).head(n);
    return PartOf(parts, x, std::abs(modes.eigenvalues()[k]));
  };
  fastest.part = part_of(fast);
  fastest.drift_part = part_of(worst);
  return fastest;
}

}  // namespace mbv::simulation
