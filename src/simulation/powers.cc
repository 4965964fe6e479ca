#include "simulation/powers.h"

#include <utility>

#include "simulation/element_forces.h"

namespace mbv::simulation {
namespace {

using ConstVec3 = Eigen::Map<const Vec3>;
using ConstVecX = Eigen::Map<const VecX>;

// Velocity of a point of a body, from MuJoCo's twist about the root's centre of mass.
Vec3 VelocityOf(const mjModel& m, const mjData& d, int body, const Vec3& p_W) {
  const Eigen::Map<const Vec6> V(d.cvel + 6 * body);
  const ConstVec3 c(d.subtree_com + 3 * m.body_rootid[body]);
  return V.tail<3>() + V.head<3>().cross(p_W - c);
}

// Rate of a spring's length [m/s].
double SpringRate(const ConstraintSystem& system, size_t spring) {
  const EngineModel& engine = system.engine();
  const int nv = engine.m->nv;
  const double* const J = system.data()->ten_J + engine.spring_tendon[spring] * nv;
  return ConstVecX(J, nv).dot(ConstVecX(system.data()->qvel, nv));
}

}  // namespace

void WorkRates(const ConstraintSystem& system, const Loads& loads, VecX* rates) {
  const EngineModel& engine = system.engine();
  const mjModel& m = *engine.m;
  const mjData& d = *system.data();
  const ConstVecX qvel(d.qvel, m.nv);
  const auto driven = static_cast<Eigen::Index>(engine.driven.size());
  rates->setZero(driven + 2);
  for (Eigen::Index k = 0; k < driven; ++k) {
    const int coordinate = static_cast<int>(k);
    (*rates)[k] = system.DrivenForce(coordinate) * system.DrivenJacobian(coordinate).dot(qvel);
  }
  for (const WorldLoad& load : loads.world()) {
    const ConstVec3 w(d.cvel + 6 * load.body_id);
    (*rates)[driven] +=
        load.moment.dot(w) + load.force.dot(VelocityOf(m, d, load.body_id, load.p_WQ));
  }
  for (size_t s = 0; s < engine.spring_tendon.size(); ++s) {
    const double rate = SpringRate(system, s);
    (*rates)[driven + 1] -= engine.mechanism->springs[s].damping * rate * rate;
  }
  for (size_t e = 0; e < engine.elements.size(); ++e) {
    const ForceElement& element = engine.mechanism->elements[e];
    if (Dissipates(element)) (*rates)[driven + 1] += PowerOf(element, ElementMotionOf(system, e));
  }
}

void FindPowers(const ConstraintSystem& system, const Loads& loads, Powers* found) {
  const EngineModel& engine = system.engine();
  const mjModel& m = *engine.m;
  const mjData& d = *system.data();
  Powers& power = *found;
  WorkRates(system, loads, &power.rates);
  power.gravity = power.springs = power.rotors = 0.0;
  const ConstVec3 g(m.opt.gravity);
  for (int b = 1; b < m.nbody; ++b) {
    power.gravity += m.body_mass[b] * g.dot(VelocityOf(m, d, b, ConstVec3(d.xipos + 3 * b)));
  }
  for (size_t s = 0; s < engine.spring_tendon.size(); ++s) {
    const SpringDamper& spring = engine.mechanism->springs[s];
    power.springs -= spring.stiffness *
                     (d.ten_length[engine.spring_tendon[s]] - spring.free_length_m) *
                     SpringRate(system, s);
  }
  for (size_t e = 0; e < engine.elements.size(); ++e) {
    const ForceElement& element = engine.mechanism->elements[e];
    const double put_in = PowerOf(element, ElementMotionOf(system, e));
    if (std::holds_alternative<SpringLaw>(element.law)) power.springs += put_in;
    if (std::holds_alternative<RotorLaw>(element.law)) power.rotors -= put_in;
  }
}

Energies EnergiesOf(const ConstraintSystem& system) {
  const EngineModel& engine = system.engine();
  const mjModel& m = *engine.m;
  const mjData& d = *system.data();
  Energies energy;
  const ConstVec3 g(m.opt.gravity);
  for (int b = 1; b < m.nbody; ++b) {
    const ConstVec3 p(d.xipos + 3 * b), w(d.cvel + 6 * b), I(m.body_inertia + 3 * b);
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(d.ximat + 9 * b);
    const Vec3 w_I = R.transpose() * w;
    energy.kinetic += 0.5 * (m.body_mass[b] * VelocityOf(m, d, b, p).squaredNorm() +
                             w_I.dot(I.cwiseProduct(w_I)));
    energy.gravity -= m.body_mass[b] * g.dot(p);
  }
  for (size_t s = 0; s < engine.spring_tendon.size(); ++s) {
    const SpringDamper& spring = engine.mechanism->springs[s];
    const double stretch = d.ten_length[engine.spring_tendon[s]] - spring.free_length_m;
    energy.springs += 0.5 * spring.stiffness * stretch * stretch;
  }
  for (size_t e = 0; e < engine.elements.size(); ++e) {
    const ElementEnergy of = EnergyOf(engine.mechanism->elements[e], ElementMotionOf(system, e));
    energy.springs += of.stored;
    energy.kinetic += of.kinetic;
  }
  return energy;
}

void WorkMeter::Start(const VecX& power) {
  work_.setZero(power.size());
  power_.fill(power);
}

void WorkMeter::Step(double h, bool multistep, const VecX& power) {
  if (multistep) {
    work_ += h / 24.0 * (9.0 * power + 19.0 * power_[0] - 5.0 * power_[1] + power_[2]);  // (1)
  } else {
    work_ += h / 6.0 * (power_[0] + 4.0 * middle_ + power);
  }
  power_[2].swap(power_[1]);
  power_[1].swap(power_[0]);
  power_[0] = power;
}

}  // namespace mbv::simulation
