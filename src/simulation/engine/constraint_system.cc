#include "simulation/engine/constraint_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "math/spatial.h"
#include "mechanism/reach.h"
#include "simulation/engine/element_forces.h"

namespace mbv::simulation {
namespace {

using mjcf::PlannedClosure;
using ConstVec3 = Eigen::Map<const Vec3>;
using ConstVec6 = Eigen::Map<const Vec6>;

Eigen::Quaterniond QuatAt(const double* wxyz) {
  return Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
}
Eigen::Quaterniond Pure(const Vec3& v) { return Eigen::Quaterniond(0, v.x(), v.y(), v.z()); }

}  // namespace

ConstraintSystem::ConstraintSystem(const EngineModel& engine, mjData* d)
    : engine_(engine),
      d_(d),
      length_(CharacteristicLength(*engine.mechanism)),
      lever_(LongestLever(*engine.mechanism)) {
  for (const PlannedClosure& closure : engine.plan.closures) {
    closure_row_.push_back(closure_rows_);
    closure_rows_ += closure.type == PlannedClosure::Type::kConnect ? 3 : 6;
  }
  first_coupling_ = closure_rows_;
  closure_rows_ += static_cast<int>(engine.coupling_equality.size());
  rows_ = closure_rows_;
  given_.setZero(static_cast<Eigen::Index>(engine.driven.size()));
  for (const DrivenPlace& place : engine.driven) {
    driven_row_.push_back(place.forced ? -1 : rows_++);
  }
  A0_.setZero(6, engine.m->nbody);
  FindUnits();
}

void ConstraintSystem::FindUnits() {
  const mjModel& m = *engine_.m;
  dof_unit_.setOnes(m.nv);
  for (int j = 0; j < m.njnt; ++j) {
    if (m.jnt_type[j] == mjJNT_SLIDE) dof_unit_[m.jnt_dofadr[j]] = length_;
    if (m.jnt_type[j] == mjJNT_FREE) dof_unit_.segment<3>(m.jnt_dofadr[j]).setConstant(length_);
  }
  row_unit_.setOnes(rows_);
  for (const int row : closure_row_) row_unit_.segment<3>(row).setConstant(length_);
  for (size_t c = 0; c < engine_.coupling_equality.size(); ++c) {
    coupling_is_length_.push_back(IsLengthCoupling(c));
    if (coupling_is_length_[c]) row_unit_[coupling_row(static_cast<int>(c))] = length_;
  }
  for (size_t k = 0; k < engine_.driven.size(); ++k) {
    const DrivenPlace& place = engine_.driven[k];
    if (driven_row_[k] < 0) continue;
    row_unit_[driven_row_[k]] = place.is_tendon ? length_ : dof_unit_[place.dof];
  }
}

bool ConstraintSystem::IsLengthCoupling(size_t coupling) const {
  const Mechanism& mechanism = *engine_.mechanism;
  const Coupling& c = mechanism.couplings[coupling];
  const mjcf::PlannedCoupling plan = mjcf::PlanCoupling(mechanism, c);
  const auto is_length = [&](const Coupling::Term& term) {
    return IsLength(mechanism.joints[term.joint].kind, term.coordinate);
  };
  return plan.type == mjcf::PlannedCoupling::Type::kJoint ? is_length(c.terms[plan.first])
                                                          : std::ranges::any_of(c.terms, is_length);
}

double ConstraintSystem::CouplingBias(int coupling) const {
  const mjModel& m = *engine_.m;
  const int equality = engine_.coupling_equality[coupling];
  const int second = m.eq_obj2id[equality];
  if (m.eq_type[equality] != mjEQ_JOINT || second < 0) return 0.0;
  const double* a = m.eq_data + mjNEQDATA * equality;
  const int place = m.jnt_qposadr[second];
  const double x = d_->qpos[place] - m.qpos0[place];
  const double rate = d_->qvel[m.jnt_dofadr[second]];
  return -(2.0 * a[2] + x * (6.0 * a[3] + x * 12.0 * a[4])) * rate * rate;
}

double ConstraintSystem::Rounding() const {
  const mjModel& m = *engine_.m;
  double reach_m = lever_, angle = 0.0;
  for (int b = 1; b < m.nbody; ++b) {
    reach_m = std::max(reach_m, ConstVec3(d_->xpos + 3 * b).norm());
  }
  for (int j = 0; j < m.njnt; ++j) {
    if (m.jnt_type[j] != mjJNT_HINGE) continue;
    angle = std::max(angle, std::abs(d_->qpos[m.jnt_qposadr[j]]));
  }
  return std::max(GapRounding(reach_m) / length_, 32 * kEps * angle);
}

void ConstraintSystem::SetTargets(const VecX& position) {
  for (size_t k = 0; k < engine_.driven.size(); ++k) {
    const DrivenPlace& place = engine_.driven[k];
    engine_.m->eq_data[mjNEQDATA * place.equality] = position[k] - place.home;
  }
}

double ConstraintSystem::DrivenForce(int k) const {
  return driven_row_[k] >= 0 ? d_->efc_force[driven_row_[k]] : given_[k];
}

VecX ConstraintSystem::DrivenJacobian(int k) const {
  const DrivenPlace& place = engine_.driven[static_cast<size_t>(k)];
  const int nv = engine_.m->nv;
  if (!place.is_tendon) return VecX::Unit(nv, place.dof);
  return Eigen::Map<const VecX>(d_->ten_J + place.object * nv, nv);
}

double ConstraintSystem::AlongDriven(int k, const double* x) const {
  const DrivenPlace& place = engine_.driven[static_cast<size_t>(k)];
  if (!place.is_tendon) return x[place.dof] + 0.0;  // never −0, as sums are not
  const int nv = engine_.m->nv;
  return Eigen::Map<const VecX>(d_->ten_J + place.object * nv, nv)
      .dot(Eigen::Map<const VecX>(x, nv));
}

void ConstraintSystem::AddGivenForces(double* qfrc) const {
  const int nv = engine_.m->nv;
  for (int k = 0; k < static_cast<int>(engine_.driven.size()); ++k) {
    if (driven_row_[k] >= 0) continue;
    const DrivenPlace& place = engine_.driven[static_cast<size_t>(k)];
    if (place.is_tendon) {
      Eigen::Map<VecX>(qfrc, nv) +=
          given_[k] * Eigen::Map<const VecX>(d_->ten_J + place.object * nv, nv);
    } else {
      qfrc[place.dof] += given_[k];
    }
  }
}

// MuJoCo drops a constraint whose Jacobian is zero; no sensible mechanism has one.
void ConstraintSystem::CheckRows() const {
  if (d_->ne != rows_) throw EngineError("a closure or drive constrains nothing");
  if (d_->nf != friction_rows()) throw EngineError("friction acts on nothing");
}

// MuJoCo's sparse rows have an entry for every dof above one of their bodies.
void ConstraintSystem::FindPattern() {
  mjModel* m = engine_.m.get();
  m->opt.jacobian = mjJAC_SPARSE;
  mj_tendon(m, d_);
  mj_makeConstraint(m, d_);
  m->opt.jacobian = mjJAC_DENSE;
  CheckRows();
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < rows_; ++i) {
    const int* columns = d_->efc_J_colind + d_->efc_J_rowadr[i];
    for (int k = 0; k < d_->efc_J_rownnz[i]; ++k) entries.emplace_back(i, columns[k], 1.0);
  }
  J_.resize(rows_, m->nv);
  J_.setFromTriplets(entries.begin(), entries.end());
  J_.makeCompressed();
  J_unit_.resize(J_.nonZeros());
  for (int i = 0; i < rows_; ++i) {
    for (int k = J_.outerIndexPtr()[i]; k < J_.outerIndexPtr()[i + 1]; ++k) {
      J_unit_[k] = dof_unit_[J_.innerIndexPtr()[k]] / row_unit_[i];
    }
  }
}

void ConstraintSystem::EvaluatePosition() {
  mjModel* m = engine_.m.get();
  mj_kinematics(m, d_);
  mj_comPos(m, d_);
  if (J_.rows() != rows_ || J_.cols() != m->nv) FindPattern();  // also where there are no rows
  {
    const OwnJacobians jacobians(engine_);
    mj_tendon(m, d_);
    mj_makeConstraint(m, d_);
  }
  CheckRows();
  if (!engine_.sparse) {
    TurnFrictionRows();
    TakeJacobian();
    return;
  }
  // Rows and entries stand as in the pattern.
  for (int i = 0; i < rows_; ++i) {
    std::copy_n(d_->efc_J + d_->efc_J_rowadr[i], d_->efc_J_rownnz[i],
                J_.valuePtr() + J_.outerIndexPtr()[i]);
  }
  friction_J_.setZero(friction_rows(), m->nv);
  for (int i = 0; i < friction_rows(); ++i) {
    const int address = d_->efc_J_rowadr[rows_ + i];
    for (int k = 0; k < d_->efc_J_rownnz[rows_ + i]; ++k) {
      friction_J_(i, d_->efc_J_colind[address + k]) = d_->efc_J[address + k];
    }
  }
  if (m->ntendon > 0) mj_tendon(m, d_);  // dense
}

// MuJoCo's rows of a ball are about its own axes. Those of friction about axes that are fixed in
// another frame or body are written anew; their J̇q̇ is 0, too, as an axis turns at right angles to
// the rate about it.
void ConstraintSystem::TurnFrictionRows() {
  const int nv = engine_.m->nv;
  for (int row = 0; row < friction_rows(); ++row) {
    const size_t e = engine_.frictions[static_cast<size_t>(row)].elements.front();
    if (engine_.elements[e].turned < 0) continue;
    Eigen::Map<VecX>(d_->efc_J + static_cast<Eigen::Index>(rows_ + row) * nv, nv) =
        ElementGradient(*this, e);
  }
}

void ConstraintSystem::TakeJacobian() {
  const int nv = engine_.m->nv;
  double* out = J_.valuePtr();
  for (int i = 0; i < rows_; ++i) {
    const double* row = d_->efc_J + static_cast<Eigen::Index>(i) * nv;
    for (int k = J_.outerIndexPtr()[i]; k < J_.outerIndexPtr()[i + 1]; ++k) {
      *out++ = row[J_.innerIndexPtr()[k]];
    }
  }
}

void ConstraintSystem::FillScaledTranspose(SparseLu::Matrix* columns) const {
  if (columns->nonZeros() != J_.nonZeros()) *columns = J_.transpose().eval();
  Eigen::Map<VecX>(columns->valuePtr(), J_.nonZeros()) =
      J_unit_.cwiseProduct(Eigen::Map<const VecX>(J_.valuePtr(), J_.nonZeros()));
}

void ConstraintSystem::EvaluatePassive() {
  if (engine_.spring_tendon.empty() && engine_.elements.empty()) return;
  const mjModel* m = engine_.m.get();
  Eigen::Map<VecX>(d_->ten_velocity, m->ntendon) =
      Eigen::Map<const RowMajor>(d_->ten_J, m->ntendon, m->nv) *
      Eigen::Map<const VecX>(d_->qvel, m->nv);
  mj_passive(m, d_);
}

void ConstraintSystem::EvaluateBodyForces() {
  // MuJoCo adds the constraints' forces otherwise: it knows nothing of tendons, and takes a weld's
  // rotation rows for a torque in world axes, which they are not.
  const int ne = std::exchange(d_->ne, 0);
  mj_rnePostConstraint(engine_.m.get(), d_);
  d_->ne = ne;
}

void ConstraintSystem::BodyForces(VecX* tau) const {
  const mjModel& m = *engine_.m;
  tau->resize(m.nv);
  for (int i = 0; i < m.nv; ++i) {
    (*tau)[i] = ConstVec6(d_->cdof + 6 * i).dot(ConstVec6(d_->cfrc_int + 6 * m.dof_bodyid[i]));
  }
}

void ConstraintSystem::BodyBiasAccelerations() {
  const mjModel& m = *engine_.m;
  for (int b = 1; b < m.nbody; ++b) {
    Vec6 A0 = A0_.col(m.body_parentid[b]);
    for (int j = m.body_dofadr[b], end = j + m.body_dofnum[b]; j < end; ++j) {
      A0 += ConstVec6(d_->cdof_dot + 6 * j) * d_->qvel[j];
    }
    A0_.col(b) = A0;
  }
}

ConstraintSystem::Point ConstraintSystem::PointOn(int body, const Vec3& p_W) const {
  const Vec3 r = p_W - ConstVec3(d_->subtree_com + 3 * engine_.m->body_rootid[body]);
  const ConstVec6 V(d_->cvel + 6 * body);
  const Vec3 w = V.head<3>();
  const Vec3 v = V.tail<3>() + w.cross(r);
  const auto A = A0_.col(body);
  return {p_W, v, Vec3(A.tail<3>()) + Vec3(A.head<3>()).cross(r) + w.cross(v)};
}

double ConstraintSystem::TendonBias(int tendon) const {
  const mjModel& m = *engine_.m;
  const int* sites = m.wrap_objid + m.tendon_adr[tendon];
  const auto point = [&](int site) {
    return PointOn(m.site_bodyid[site], ConstVec3(d_->site_xpos + 3 * site));
  };
  const Point from = point(sites[0]), to = point(sites[1]);
  const double L = d_->ten_length[tendon];
  const Vec3 u = (to.p - from.p) / L, w = to.v - from.v;
  const double rate = u.dot(w);
  return u.dot(to.a0 - from.a0) + (w.squaredNorm() - rate * rate) / L;
}

Vec3 ConstraintSystem::AngularAcceleration(int body) const {
  RowMajor J_w(3, nv());
  mj_jacBody(engine_.m.get(), d_, nullptr, J_w.data(), body);
  return J_w * Eigen::Map<const VecX>(d_->qacc, nv()) + A0_.col(body).head<3>();
}

void ConstraintSystem::ClosureBias(int closure, VecX* bias) const {
  const PlannedClosure& planned = engine_.plan.closures[closure];
  const bool connect = planned.type == PlannedClosure::Type::kConnect;
  const double* data = engine_.m->eq_data + mjNEQDATA * engine_.closure_equality[closure];
  const int b1 = engine_.body_id[planned.body1], b2 = engine_.body_id[planned.body2];
  const ConstVec3 p1_B(data + (connect ? 0 : 3)), p2_B(data + (connect ? 3 : 0));
  const Point p1 = PointOn(b1, PoseOf(*d_, b1) * p1_B);
  const Point p2 = PointOn(b2, PoseOf(*d_, b2) * p2_B);
  const int row = closure_row_[closure];
  bias->segment<3>(row) = p1.a0 - p2.a0;
  if (connect) return;
  const Eigen::Quaterniond q1_rel = QuatAt(d_->xquat + 4 * b1) * QuatAt(data + 6);
  const Eigen::Quaterniond q2_inverse = QuatAt(d_->xquat + 4 * b2).conjugate();
  const Vec3 w1 = ConstVec3(d_->cvel + 6 * b1), w2 = ConstVec3(d_->cvel + 6 * b2);
  const Vec3 w = w1 - w2;
  const Vec3 alpha = A0_.col(b1).head<3>() - A0_.col(b2).head<3>();
  Eigen::Quaterniond inner = Pure(alpha);
  inner.coeffs() += 0.5 * ((Pure(w) * Pure(w1)).coeffs() - (Pure(w2) * Pure(w)).coeffs());
  bias->segment<3>(row + 3) = 0.5 * (q2_inverse * inner * q1_rel).vec();
}

void ConstraintSystem::Bias(VecX* bias) {
  bias->setZero(rows_);
  BodyBiasAccelerations();
  for (size_t c = 0; c < engine_.plan.closures.size(); ++c) {
    ClosureBias(static_cast<int>(c), bias);
  }
  for (size_t c = 0; c < engine_.coupling_equality.size(); ++c) {
    (*bias)[coupling_row(static_cast<int>(c))] = CouplingBias(static_cast<int>(c));
  }
  for (size_t k = 0; k < engine_.driven.size(); ++k) {
    const DrivenPlace& place = engine_.driven[k];
    if (place.is_tendon && driven_row_[k] >= 0) (*bias)[driven_row_[k]] = TendonBias(place.object);
  }
}

double ConstraintSystem::FrictionUnit(int row) const {
  const FrictionPlace& place = engine_.frictions[static_cast<size_t>(row)];
  return place.tendon >= 0 ? length_ : dof_unit_[place.dof];
}

namespace {

// What a rigid stop may exert where it holds [N or N m].
constexpr double kUnyielding = 1e20;

}  // namespace

double ConstraintSystem::Breakaway(size_t element) const {
  const ForceElement& at = engine_.mechanism->elements[element];
  if (IsRigidStop(at)) return kUnyielding;
  const auto& law = std::get<FrictionLaw>(at.law);
  return engaged(element) * law.half_band() + load_friction(element);
}

double ConstraintSystem::HeldLoss(int row) const {
  double loss = 0.0;
  for (const size_t e : engine_.frictions[static_cast<size_t>(row)].elements) {
    if (!sliding_.empty() && sliding_[e] != 0) continue;
    loss += Breakaway(e);
  }
  return loss;
}

double ConstraintSystem::HeldForce(size_t element) const {
  for (int row = 0; row < friction_rows(); ++row) {
    const std::vector<size_t>& of = engine_.frictions[static_cast<size_t>(row)].elements;
    if (std::ranges::find(of, element) == of.end()) continue;
    const double loss = HeldLoss(row);
    return loss > 0.0 ? d_->efc_force[rows_ + row] * Breakaway(element) / loss : 0.0;
  }
  return 0.0;
}

ConstraintSystem::Gap ConstraintSystem::LargestGap() const {
  Gap gap;
  const auto r = residual();
  for (size_t c = 0; c < engine_.plan.closures.size(); ++c) {
    const int row = closure_row_[c];
    gap.position_m = std::max(gap.position_m, r.segment<3>(row).norm());
    if (engine_.plan.closures[c].type == PlannedClosure::Type::kConnect) continue;
    const double half_sine = std::min(1.0, r.segment<3>(row + 3).norm());
    gap.rotation_rad = std::max(gap.rotation_rad, 2.0 * std::asin(half_sine));
  }
  for (size_t c = 0; c < engine_.coupling_equality.size(); ++c) {
    double& part = coupling_is_length_[c] ? gap.position_m : gap.rotation_rad;
    part = std::max(part, std::abs(r[coupling_row(static_cast<int>(c))]));
  }
  return gap;
}

}  // namespace mbv::simulation
