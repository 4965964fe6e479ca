// Every row of every audit can fail: the equations' constants and what they are compared with are
// perturbed one at a time, and each row with a residual must notice at least one of them. What
// notices none depends on none of them; those rows are named, and no others may be so.
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <set>

#include "analytic/cabin_robot/stiffness.h"
#include "analytic/scara_robot/stiffness.h"
#include "features/equation_audit/cabin_robot_audit.h"
#include "features/equation_audit/scara_robot_audit.h"
#include "features/equation_audit/spr_tripod_audit.h"
#include "features/equation_audit/stabilizing_platform_audit.h"
#include "features/equation_audit/stiffness_truth.h"
#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using Rows = std::vector<AuditRow>;

const std::string kModelsOfAudits = SourcePath("/models");

// Joined rows of several functions.
Rows All(std::vector<Rows> parts) {
  Rows all;
  for (Rows& rows : parts) {
    for (AuditRow& row : rows) all.push_back(std::move(row));
  }
  return all;
}

// What no perturbed constant is seen by.
class Noticed {
 public:
  explicit Noticed(const Rows& right) {
    for (const AuditRow& row : right) {
      EXPECT_NE(row.verdict, AuditVerdict::kWrongAndUnfixed) << row.equation;
      if (row.verdict != AuditVerdict::kNotTestable) insensitive_.insert(row.equation);
    }
  }
  void Perturbed(const Rows& rows) {
    for (const AuditRow& row : rows) {
      if (row.verdict == AuditVerdict::kWrongAndUnfixed) insensitive_.erase(row.equation);
    }
  }
  [[nodiscard]] const std::set<std::string>& insensitive() const { return insensitive_; }

 private:
  std::set<std::string> insensitive_;
};

constexpr double kPerturbationOfAll = 1 + 1e-6;

TEST(AuditRows, OfTheScaraRobotCanFail) {
  const LoadResult model = LoadModel(kModelsOfAudits + "/scara_robot/model.yaml");
  const Mechanism& robot = *model.mechanism;
  const auto sweep = scara_audit::Sweep(robot);
  const auto rows = [&](const scara_robot::Parameters& p,
                        const std::vector<scara_audit::State>& states) {
    return All({scara_audit::PositionRows(robot, p, states), scara_audit::VelocityRows(p, states),
                scara_audit::LinkRows(p, states), scara_audit::DynamicsRows(p, states)});
  };
  const scara_robot::Parameters right = scara_robot::ParametersOf(robot);
  Noticed noticed(rows(right, sweep));
  using P = scara_robot::Parameters;
  for (double P::*member : {&P::R, &P::r, &P::l1, &P::l2, &P::l3, &P::e, &P::m_p, &P::I_pz,
                            &P::m_arm, &P::arm_radius, &P::arm_com, &P::m_rods, &P::rod_radius}) {
    P perturbed = right;
    perturbed.*member *= kPerturbationOfAll;
    noticed.Perturbed(rows(perturbed, sweep));
  }
  using State = scara_audit::State;
  const std::vector<std::function<void(State*)>> perturbations = {
      [](State* s) { s->theta *= kPerturbationOfAll; },
      [](State* s) { s->rates.dX *= kPerturbationOfAll; },
      [](State* s) { s->rates.ddX *= kPerturbationOfAll; },
      [](State* s) { s->rates.dtheta *= kPerturbationOfAll; },
      [](State* s) { s->rates.ddtheta *= kPerturbationOfAll; },
      [](State* s) { s->M *= kPerturbationOfAll; },
      [](State* s) { s->P.v *= kPerturbationOfAll; },
      [](State* s) { s->P.a *= kPerturbationOfAll; },
      [](State* s) { s->domega_platform *= kPerturbationOfAll; },
      [](State* s) { s->tilt += 1e-6; },
      [](State* s) { s->limbs[1].arm.a *= kPerturbationOfAll; },
      [](State* s) { s->limbs[1].rods.v *= kPerturbationOfAll; },
      [](State* s) { s->limbs[1].rods.a *= kPerturbationOfAll; },
      [](State* s) { s->limbs[1].omega_arm *= kPerturbationOfAll; },
      [](State* s) { s->limbs[1].domega_arm *= kPerturbationOfAll; },
      [](State* s) { s->limbs[1].omega_rod *= kPerturbationOfAll; },
      [](State* s) { s->limbs[1].domega_rod *= kPerturbationOfAll; },
      [](State* s) { s->limbs[1].rods_apart += 1e-6; },
      [](State* s) { s->J *= kPerturbationOfAll; },
      [](State* s) { s->J_inverse *= kPerturbationOfAll; }};
  for (const auto& perturb : perturbations) {
    auto states = sweep;
    perturb(&states[5]);
    noticed.Perturbed(rows(right, states));
  }
  // The topology, printed data and figures; (33) and (49) hold for any constants.
  EXPECT_EQ(noticed.insensitive(),
            (std::set<std::string>{"(1)", "(33)", "(49)", "F = Σf − Σξ", "Fig. 8",
                                   "Table 1, platform", "Table 1, ρ1, ρ2"}));
}

TEST(AuditRows, OfTheScaraRobotsStiffnessCanFail) {
  const auto rows = [](const scara_robot::StiffnessParameters& p) {
    return scara_audit::StiffnessRows(kModelsOfAudits, p);
  };
  const auto right = scara_robot::StiffnessParametersOf(
      stiffness_audit::LoadElastic(kModelsOfAudits, "scara_robot"));
  Noticed noticed(rows(right));
  using P = scara_robot::StiffnessParameters;
  for (double P::*member : {&P::d, &P::E, &P::G, &P::diameter, &P::K_act}) {
    P perturbed = right;
    perturbed.*member *= kPerturbationOfAll;
    noticed.Perturbed(rows(perturbed));
  }
  for (double scara_robot::Parameters::*member :
       {&scara_robot::Parameters::l1, &scara_robot::Parameters::l2, &scara_robot::Parameters::r,
        &scara_robot::Parameters::e}) {
    P perturbed = right;
    perturbed.geometry.*member *= kPerturbationOfAll;
    noticed.Perturbed(rows(perturbed));
  }
  EXPECT_EQ(noticed.insensitive(), std::set<std::string>{});
}

TEST(AuditRows, OfTheCabinRobotCanFail) {
  const LoadResult model = LoadModel(kModelsOfAudits + "/cabin_robot/model.yaml");
  const Mechanism& robot = *model.mechanism;
  using cabin_audit::Lengths;
  const Lengths truth = cabin_audit::LengthsOf(robot);
  const auto rows = [&](const Lengths& l, const Mechanism& m) {
    return All({cabin_audit::PositionRows(l, truth), cabin_audit::VelocityRows(l, truth),
                cabin_audit::WristRows(l, truth), cabin_audit::DynamicsRows(m, robot)});
  };
  Noticed noticed(rows(truth, robot));
  for (double Lengths::*length :
       {&Lengths::L1, &Lengths::L2, &Lengths::L3, &Lengths::L4, &Lengths::a2, &Lengths::d3,
        &Lengths::a3, &Lengths::a4, &Lengths::d6}) {
    Lengths perturbed = truth;
    perturbed.*length += 1e-6;
    noticed.Perturbed(All({cabin_audit::PositionRows(perturbed, truth),
                           cabin_audit::VelocityRows(perturbed, truth),
                           cabin_audit::WristRows(perturbed, truth)}));
  }
  for (const Parameter& parameter : robot.parameters) {
    if (!parameter.name.starts_with("m_") && !parameter.name.starts_with("I_")) continue;
    Mechanism perturbed = robot;
    for (Parameter& p : perturbed.parameters) {
      if (p.name == parameter.name) p.value *= kPerturbationOfAll;
    }
    noticed.Perturbed(cabin_audit::DynamicsRows(perturbed, robot));
  }
  // Orientations and rates by angles alone: they are compared with differences of the linkage that
  // Newton closes, whatever its lengths (PlanarTruth).
  EXPECT_EQ(
      noticed.insensitive(),
      (std::set<std::string>{"(12), (13) a_x", "(12), (13) a_y", "(12), (13) a_z", "(12), (13) n_x",
                             "(12), (13) n_y", "(12), (13) n_z", "(12), (13) o_x", "(12), (13) o_y",
                             "(12), (13) o_z", "(15)",           "(16)",           "(17)",
                             "(18), (19)",     "(21), (22)",     "(23) V_X",       "(23) V_Y",
                             "(24), (25) J11", "(25) J12",       "(25) J13",       "(25) J22",
                             "(25) J23",       "(31)",           "(53)",           "(7) θ1",
                             "(7) θ3",         "below (20): m"}));
}

TEST(AuditRows, OfTheCabinRobotsStiffnessCanFail) {
  const auto rows = [](const cabin_robot::StiffnessParameters& p) {
    return cabin_audit::StiffnessRows(kModelsOfAudits, p);
  };
  const auto right = cabin_robot::StiffnessParametersOf(
      stiffness_audit::LoadElastic(kModelsOfAudits, "cabin_robot"));
  Noticed noticed(rows(right));
  const std::vector<std::function<void(cabin_robot::StiffnessParameters*)>> perturbations = {
      [](auto* p) { p->E *= kPerturbationOfAll; },
      [](auto* p) { p->G *= kPerturbationOfAll; },
      [](auto* p) { p->w *= kPerturbationOfAll; },
      [](auto* p) { p->wrist.a3 *= kPerturbationOfAll; },
      [](auto* p) { p->sections[cabin_robot::kBeamEF].h *= kPerturbationOfAll; },
      [](auto* p) { p->sections[cabin_robot::kBeamCD].b *= kPerturbationOfAll; },
      [](auto* p) { p->sections[cabin_robot::kBeamAB].b *= kPerturbationOfAll; }};
  for (const auto& perturb : perturbations) {
    cabin_robot::StiffnessParameters perturbed = right;
    perturb(&perturbed);
    noticed.Perturbed(rows(perturbed));
  }
  EXPECT_EQ(noticed.insensitive(), std::set<std::string>{"(55)"});  // equilibrium by angles
}

TEST(AuditRows, OfTheTripodCanFail) {
  using namespace spr_tripod_audit;
  const Case right = MakeCase(kModelsOfAudits);
  const auto rows = [](const Case& c) {
    return All({PositionRows(c), VelocityRows(c), PathRows(c), DynamicsRows(c)});
  };
  Noticed noticed(rows(right));
  const std::vector<std::function<void(Case*)>> perturbations = {
      [](Case* c) { c->geometry.a *= kPerturbationOfAll; },
      [](Case* c) { c->geometry.b *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].r.x() *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].v *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].v_dot *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].omega *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].omega_dot *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].psi *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].theta *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].leg[1].q *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].leg[1].q_dot *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].leg[1].q_ddot *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].leg[1].f *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].leg[1].S *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].leg[1].v_A *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].leg[1].omega *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].leg[1].omega_dot *= kPerturbationOfAll; },
      [](Case* c) { c->truth[3].leg[1].w += Vec3(0, 1e-6, 0); },
      [](Case* c) { c->truth[3].leg[1].c += Vec3(0, 1e-6, 0); },
      [](Case* c) { c->truth[3].leg[1].A += Vec3(1e-6, 0, 0); }};
  for (const auto& perturb : perturbations) {
    Case perturbed = right;
    perturb(&perturbed);
    noticed.Perturbed(rows(perturbed));
  }
  // The path law, the example's data, and identities in the angles.
  EXPECT_EQ(noticed.insensitive(),
            (std::set<std::string>{"(21)", "(22)", "(6) δ in (2)", "G(ψ, θ, z0) = 0",
                                   "Table 1, R and h", "section 3, W1 … W6"}));
}

TEST(AuditRows, OfTheStabilizingPlatformCanFail) {
  using namespace platform_audit;
  const Case full = MakeCase(kModelsOfAudits, 1.0), massless = MakeCase(kModelsOfAudits, 0.0);
  const auto rows = [](const Case& a, const Case& b) {
    return All({PoseRows(a), TwistRows(a), LimbRows(a), ForceRows(a, b), ClaimRows(a, b)});
  };
  Noticed noticed(rows(full, massless));
  const auto perturb = [&](const std::function<void(Truth*)>& change) {
    Case bent_full = full, bent_massless = massless;
    change(&bent_full.truth[7]);
    change(&bent_massless.truth[7]);
    noticed.Perturbed(rows(bent_full, bent_massless));
  };
  perturb([](Truth* t) { t->X_eo.translation() *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->X_ep.translation() *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->X_ep.linear() *= Eigen::AngleAxisd(1e-6, Vec3::UnitZ()).matrix(); });
  perturb([](Truth* t) { t->motion_o *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->motion_p *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->acceleration_o *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->acceleration_p *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->V_eo *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->V_ep *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->A_eo *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->A_ep *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->V_op *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->A_op *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].p_oA *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].p_oB *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].l *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].l_rate *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].l_acceleration *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].tilt += 1e-6; });
  perturb([](Truth* t) { t->limbs[1].tilt_rate *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].side[1].q1 *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].side[1].q2 *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].side[1].q1_rate *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].side[1].q2_rate *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].side[1].R.value *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].side[1].R.rate *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].side[1].elbow_A *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].link_twist_A[2] *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].force_A *= kPerturbationOfAll; });
  perturb([](Truth* t) { t->limbs[1].drive[1] *= kPerturbationOfAll; });
  // Counts of equations, claims about the design, and limits at 0/0.
  EXPECT_EQ(noticed.insensitive(),
            (std::set<std::string>{"(16) φ''", "(4)", "30 equations, rank",
                                   "30 equations, solvable", "Fig. 10, ratio at 0/0",
                                   "derivatives of (18), (19): R''", "design, drives",
                                   "section 4 data, I_1, I_1'", "section 4, Figs. 11 and 13"}));
}

}  // namespace
}  // namespace mbv
