// Force elements of an MJCF file.
#include "simulation/mjcf_import.h"

namespace mbv::simulation {
namespace {

void AddElementsOf(int j, MjcfImport* in) {
  const mjModel& m = in->m;
  const int dof = m.jnt_dofadr[j], at = m.jnt_qposadr[j];
  const auto add = [&](const char* what, const auto& law) {
    in->mechanism.elements.push_back({.name = in->JointNameOf(j) + what,
                                      .joint = in->joint_of[static_cast<size_t>(j)],
                                      .law = law});
  };
  const bool passive = !in->IsOff(mjDSBL_PASSIVE);
  if (passive && m.dof_damping[dof] > 0.0) add("_damping", DampingLaw{m.dof_damping[dof]});
  if (passive && m.dof_damping[dof] < 0.0) in->driving.push_back(in->JointNameOf(j));
  if (passive && m.jnt_stiffness[j] != 0.0) {
    add("_spring",
        SpringLaw{.polynomial = {m.jnt_stiffness[j]}, .free = m.qpos_spring[at] - m.qpos0[at]});
  }
  if (const double loss = m.dof_frictionloss[dof]; loss > 0.0 && !in->FrictionIsOff()) {
    add("_friction", FrictionLaw{.coulomb = loss, .breakaway = loss});
  }
  if (m.dof_armature[dof] > 0.0) add("_rotor", RotorLaw{.inertia = m.dof_armature[dof]});
}

}  // namespace

void AddElements(MjcfImport* in) {
  for (int j = 0; j < in->m.njnt; ++j) {
    if (IsScalar(in->m, j)) AddElementsOf(j, in);
  }
}

}  // namespace mbv::simulation
