// Newton–Euler at the body origins in world axes, and the energy balance from the same states.
#include "core/spatial.h"
#include "kinematics/constraints.h"
#include "kinematics/state_loads.h"
#include "reference/element_forces.h"
#include "reference/force_solver.h"

namespace mbv::internal {
namespace {

// A body's inertial quantities in world axes.
struct Inertial {
  Vec3 c;  ///< from Bo to the centre of mass
  Mat3 I;  ///< about the centre of mass
  Vec3 v_cm, a_cm;
  Vec3 w, e;  ///< angular velocity and acceleration
};

Inertial InertialOf(const Body& body, const Pose& X_WB, const Vec6& V, const Vec6& A) {
  Inertial x;
  const Mat3 R = X_WB.linear();
  x.c = R * body.p_BoBcm_B;
  x.I = R * body.I_Bcm_B * R.transpose();
  x.w = V.head<3>();
  x.e = A.head<3>();
  x.v_cm = V.tail<3>() + x.w.cross(x.c);
  x.a_cm = A.tail<3>() + x.e.cross(x.c) + x.w.cross(x.w.cross(x.c));
  return x;
}

// A load's force and moment about Q in world axes, and Q from Bo.
struct LoadInWorld {
  Vec3 force, moment, p_BoQ;
};

LoadInWorld InWorld(const Mechanism& mechanism, const BodyStates& states,
                    const LoadSample& sample) {
  const LoadSample load = AtStates(mechanism, states, sample);
  const Mat3 R = states.X_WB[static_cast<size_t>(load.body)].linear();
  if (!load.in_body_axes) return {load.force, load.moment, R * load.p_BoQ_B};
  return {R * load.force, R * load.moment, R * load.p_BoQ_B};
}

}  // namespace

ScalarRow LengthRow(const SpringDamper& spring, const Mechanism& mechanism,
                    const BodyStates& states) {
  Drive leg;
  leg.kind = DistanceDrive{spring.body_from, spring.p_from, spring.body_to, spring.p_to};
  return DriveRow(mechanism, leg, states);
}

void RequiredWrenches(const Mechanism& mechanism, const BodyStates& states,
                      const std::vector<LoadSample>& loads, const std::vector<int>& rubbing,
                      std::vector<Vec6>* wrench_W) {
  wrench_W->assign(mechanism.bodies.size(), Vec6::Zero());
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const Inertial x = InertialOf(body, states.X_WB[b], states.V_WB[b], states.A_WB[b]);
    const Vec3 force = body.mass * (x.a_cm - mechanism.gravity_W);
    const Vec3 moment_cm = x.I * x.e + x.w.cross(x.I * x.w);
    (*wrench_W)[b] << moment_cm + x.c.cross(force), force;
  }
  for (const LoadSample& load : loads) {
    const LoadInWorld f = InWorld(mechanism, states, load);
    (*wrench_W)[load.body].head<3>() -= f.moment + f.p_BoQ.cross(f.force);
    (*wrench_W)[load.body].tail<3>() -= f.force;
  }
  for (const SpringDamper& spring : mechanism.springs) {
    const ScalarRow row = LengthRow(spring, mechanism, states);
    const double thrust = -spring.stiffness * (row.value - spring.free_length_m) -
                          spring.damping * RateOf(row, states.V_WB);
    (*wrench_W)[row.parent] -= thrust * row.J_parent;
    (*wrench_W)[row.child] -= thrust * row.J_child;
  }
  TakeElementForces(mechanism, states, rubbing, wrench_W);
}

MatX Momenta(const Mechanism& mechanism, const BodyStates& states, const MatX& R) {
  MatX MR(R.rows(), R.cols());
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const Mat3 R_WB = states.X_WB[b].linear();
    const Mat6 M =
        SpatialInertia(body.mass, R_WB * body.p_BoBcm_B, R_WB * body.I_Bcm_B * R_WB.transpose());
    const auto at = 6 * (static_cast<Eigen::Index>(b) - 1);
    MR.middleRows<6>(at) = M * R.middleRows<6>(at);
  }
  AddRotorMomenta(mechanism, states, R, &MR);
  return MR;
}

Energies EnergyOf(const Mechanism& mechanism, const BodyStates& states) {
  Energies energy;
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const Inertial x = InertialOf(body, states.X_WB[b], states.V_WB[b], states.A_WB[b]);
    const Vec3 p_Wcm = states.X_WB[b].translation() + x.c;
    energy.kinetic += 0.5 * (body.mass * x.v_cm.squaredNorm() + x.w.dot(x.I * x.w));
    energy.gravity -= body.mass * mechanism.gravity_W.dot(p_Wcm);
  }
  for (const SpringDamper& spring : mechanism.springs) {
    const double stretch = LengthRow(spring, mechanism, states).value - spring.free_length_m;
    energy.springs += 0.5 * spring.stiffness * stretch * stretch;
  }
  AddElementEnergies(mechanism, states, &energy);
  return energy;
}

Powers PowersOf(const Mechanism& mechanism, const BodyStates& states,
                const std::vector<LoadSample>& loads, const std::vector<int>& rubbing) {
  Powers power;
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const Inertial x = InertialOf(body, states.X_WB[b], states.V_WB[b], states.A_WB[b]);
    // d/dt ½ ω·Iω = ω·Iε, since ω·(ω × Iω) = 0.
    power.energy_rate += body.mass * x.v_cm.dot(x.a_cm - mechanism.gravity_W) + x.w.dot(x.I * x.e);
    power.gravity += body.mass * x.v_cm.dot(mechanism.gravity_W);
  }
  for (const LoadSample& load : loads) {
    const LoadInWorld f = InWorld(mechanism, states, load);
    const Vec3 w = states.V_WB[load.body].head<3>();
    power.loads +=
        f.force.dot(states.V_WB[load.body].tail<3>() + w.cross(f.p_BoQ)) + f.moment.dot(w);
  }
  for (const SpringDamper& spring : mechanism.springs) {
    const ScalarRow row = LengthRow(spring, mechanism, states);
    const double rate = RateOf(row, states.V_WB);
    power.dampers -= spring.damping * rate * rate;
    power.springs -= spring.stiffness * (row.value - spring.free_length_m) * rate;
  }
  AddElementPowers(mechanism, states, rubbing, &power);
  power.energy_rate -= power.springs;
  return power;
}

void AuditSample(const Mechanism& mechanism, const std::vector<LoadSample>& loads,
                 ReferenceSample* sample) {
  sample->energy = EnergyOf(mechanism, sample->states);
  sample->power = PowersOf(mechanism, sample->states, loads, sample->rubbing);
  const auto drives = static_cast<Eigen::Index>(mechanism.drives.size());
  const VecX& velocity = sample->driven.velocity;
  Powers& power = sample->power;
  power.dampers -= LoadFrictionLoss(mechanism, *sample);
  power.base = sample->prescribed_force.dot(velocity.tail(velocity.size() - drives));
  power.input =
      sample->drive_force.dot(velocity.head(drives)) + power.base + power.loads + power.dampers;
}

}  // namespace mbv::internal
