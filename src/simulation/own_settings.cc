// Settings of a user's model: what the file says, and what is changed.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "mjcf/mjcf.h"
#include "simulation/mjcf_import.h"
#include "simulation/own_model_parts.h"

namespace mbv::simulation {
namespace {

class SettingsTaker {
 public:
  SettingsTaker(const OwnTask& task, OwnModel* own) : task_(task), own_(*own), m_(own->m.get()) {}

  void Run() {
    TellLeftOut();
    for (int dof = 0; dof < m_->nv; ++dof) own_.facts.rubs |= Rubs(dof);
    if (task_.settings.plain) LeaveOut();
    HoldFreeBodies();
    Apply();
  }

 private:
  [[nodiscard]] bool IsHeld(int dof) const {
    return m_->jnt_type[m_->dof_jntid[dof]] == mjJNT_FREE;
  }

  [[nodiscard]] bool Rubs(int dof) const {
    return IsScalar(*m_, m_->dof_jntid[dof]) && m_->dof_frictionloss[dof] > 0.0;
  }

  // Calls visit(word, value) on every number that acts on forces and that the mechanism lacks.
  template <typename Visit>
  void ForLeftOut(const Visit& visit) {
    for (int dof = 0; dof < m_->nv; ++dof) {
      if (IsHeld(dof)) continue;
      if (IsScalar(*m_, m_->dof_jntid[dof])) continue;  // force elements
      visit("friction loss", &m_->dof_frictionloss[dof]);
      visit("armature", &m_->dof_armature[dof]);
      visit("damping", &m_->dof_damping[dof]);
    }
    for (int j = 0; j < m_->njnt; ++j) {
      if (!IsScalar(*m_, j)) visit("springs of balls", &m_->jnt_stiffness[j]);
    }
    for (int t = 0; t < m_->ntendon; ++t) {
      visit("tendon springs", &m_->tendon_stiffness[t]);
      visit("tendon damping", &m_->tendon_damping[t]);
      visit("tendon friction", &m_->tendon_frictionloss[t]);
    }
    visit("the medium's density", &m_->opt.density);
    visit("the medium's viscosity", &m_->opt.viscosity);
  }

  void TellLeftOut() {
    ForLeftOut([&](const char* word, const mjtNum* value) {
      std::vector<std::string>& words = own_.facts.left_out;
      if (*value == 0.0 || std::find(words.begin(), words.end(), word) != words.end()) return;
      words.emplace_back(word);
    });
  }

  void LeaveOut() {
    ForLeftOut([](const char*, mjtNum* value) { *value = 0.0; });
  }

  // By an inertia against which nothing in the mechanism moves them; derived constants follow, but
  // not the one that says when the solver is done.
  void HoldFreeBodies() {
    constexpr double kHeavier = 1e12;
    const double scale = m_->stat.meaninertia;
    double most = 0.0;
    for (int b = 0; b < m_->nbody; ++b) most = std::max(most, m_->body_subtreemass[b]);
    for (int j = 0; j < m_->njnt; ++j) {
      if (m_->jnt_type[j] != mjJNT_FREE) continue;
      own_.facts.held.push_back(NameAt(*m_, mjOBJ_BODY, m_->jnt_bodyid[j], "body"));
      const double length = std::max(m_->stat.extent, 1e-3);
      for (int i = 0; i < 6; ++i) {
        m_->dof_armature[m_->jnt_dofadr[j] + i] = kHeavier * most * (i < 3 ? 1.0 : length * length);
      }
    }
    if (own_.facts.held.empty() && !task_.settings.plain) return;
    const DataHandle scratch = MakeData(*m_);
    mj_setConst(m_, scratch.get());
    if (!own_.facts.held.empty()) m_->stat.meaninertia = scale;
  }

  void Apply() {
    const OwnSettings& settings = task_.settings;
    m_->opt.timestep *= settings.step_factor;
    if (settings.integrator != OwnIntegrator::kOwn) {
      m_->opt.integrator = settings.integrator == OwnIntegrator::kEuler ? mjINT_EULER
                           : settings.integrator == OwnIntegrator::kRk4 ? mjINT_RK4
                                                                        : mjINT_IMPLICIT;
    }
    if (settings.impratio > 0.0) m_->opt.impratio = settings.impratio;
    if (settings.exact_solver) {
      m_->opt.solver = mjSOL_NEWTON;
      m_->opt.iterations = 200;
      m_->opt.tolerance = 1e-14;
    }
    const std::array<mjtNum, 5> stiff{kMjcfImpedance, kMjcfImpedance, 0.001, 0.5, 2.0};
    for (int dof = 0; settings.stiff_friction && dof < m_->nv; ++dof) {
      if (!Rubs(dof)) continue;
      m_->dof_solref[mjNREF * dof] = 2.0 * m_->opt.timestep;
      m_->dof_solref[mjNREF * dof + 1] = 1.0;
      std::copy(stiff.begin(), stiff.end(), m_->dof_solimp + mjNIMP * dof);
    }
    for (const OwnClosure& closure : own_.closures) {
      mjtNum* ref = m_->eq_solref + mjNREF * closure.equality;
      mjtNum* imp = m_->eq_solimp + mjNIMP * closure.equality;
      if (settings.time_constant_s > 0.0) {
        ref[0] = settings.time_constant_s;
        ref[1] = 1.0;
      }
      if (settings.impedance > 0.0) {
        const std::array<mjtNum, 5> solimp{settings.impedance, settings.impedance, 0.001, 0.5, 2.0};
        std::copy(solimp.begin(), solimp.end(), imp);
      }
    }
  }

  const OwnTask& task_;
  OwnModel& own_;
  mjModel* const m_;
};

}  // namespace

void TellSettings(OwnModel* own) {
  static constexpr std::array<const char*, 3> kIntegrators = {"Euler", "RK4", "implicit"};
  static constexpr std::array<const char*, 3> kSolvers = {"PGS", "CG", "Newton"};
  OwnFacts& facts = own->facts;
  const mjOption& option = own->m->opt;
  facts.step_s = option.timestep;
  facts.integrator = kIntegrators.at(static_cast<size_t>(option.integrator));
  facts.solver = kSolvers.at(static_cast<size_t>(option.solver));
  facts.tolerance = option.tolerance;
  facts.iterations = option.iterations;
  constexpr double kDefaultTolerance = 1e-8;
  constexpr int kDefaultIterations = 100;
  facts.rough_solver = option.solver != mjSOL_NEWTON || option.tolerance > kDefaultTolerance ||
                       option.iterations < kDefaultIterations;
  for (const OwnClosure& closure : own->closures) {
    const mjtNum* ref = own->m->eq_solref + mjNREF * closure.equality;
    const mjtNum* imp = own->m->eq_solimp + mjNIMP * closure.equality;
    facts.solref.push_back(fmt::format("{:g} {:g}", ref[0], ref[1]));
    facts.solimp.push_back(
        fmt::format("{:g} {:g} {:g} {:g} {:g}", imp[0], imp[1], imp[2], imp[3], imp[4]));
  }
}

void TakeSettings(const OwnTask& task, OwnModel* own) { SettingsTaker(task, own).Run(); }

}  // namespace mbv::simulation
