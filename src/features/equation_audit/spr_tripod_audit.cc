#include "features/equation_audit/spr_tripod_audit.h"

#include <cmath>
#include <numbers>

#include "base/demand.h"
#include "model_file/load_model.h"
#include "reference/reference.h"

namespace mbv {

AuditTable AuditSprTripod(const std::string& models_dir) {
  const spr_tripod_audit::Case c = spr_tripod_audit::MakeCase(models_dir);
  AuditTable table;
  table.mechanism = "spr_tripod";
  table.source =
      "Mei Jiangping, Gao Ben, Tan Yang, Wang Lan: Kinematic Analysis of 3-SPR Parallel Mechanism. "
      "Transactions of the Chinese Society for Agricultural Machinery 43 (8), 2012, 215–220";
  for (auto* rows : {&spr_tripod_audit::PositionRows, &spr_tripod_audit::VelocityRows,
                     &spr_tripod_audit::PathRows, &spr_tripod_audit::DynamicsRows}) {
    for (AuditRow& row : (*rows)(c)) table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace mbv

namespace mbv::spr_tripod_audit {
namespace {

using namespace spr_tripod;

constexpr int kSamples = 97;
constexpr double kPeriod_s = 1.0;
const Vec3 kForce(120, -80, -400), kMoment(3, -5, 8), kPoint(0.01, -0.02, 0.20);

Profile Sines(double mean, std::initializer_list<SineTerm> sines) {
  Profile profile = Constant(mean);
  for (const SineTerm& sine : sines) profile.terms.emplace_back(sine);
  return profile;
}

// A round about the z axis at a distance of 0.10 … 0.16 m.
Motion Round(const Mechanism& mechanism) {
  const int output = mechanism.FindOutput("platform"), body = mechanism.FindBody("platform");
  MBV_DEMAND(output >= 0 && body >= 0, output);
  const double quarter = std::numbers::pi / 2;
  const Profile xyz[] = {
      Sines(0, {{0.13, 1 / kPeriod_s, quarter}, {0.02, 3 / kPeriod_s, 0.3}}),
      Sines(0, {{0.13, 1 / kPeriod_s, 0.0}, {0.02, 4 / kPeriod_s, 1.1}}),
      Sines(0.575, {{0.035, 2 / kPeriod_s, 0.7}}),
  };
  Motion motion;
  motion.duration_s = kPeriod_s;
  motion.sample_s = kPeriod_s / kSamples;
  for (int k = 0; k < 3; ++k) {
    const Coordinate coordinate{Coordinate::Kind::kOutput, output, k};
    motion.commands.push_back({std::string("platform.") + "xyz" [k],
                               {
                                 { coordinate, 1.0 }
                               },
                               xyz[k]});
  }
  Load load;
  load.name = "tool";
  load.body = body;
  load.p_BoQ_B = kPoint;
  for (int k = 0; k < 3; ++k) {
    load.force[k] = Constant(kForce[k]);
    load.moment[k] = Constant(kMoment[k]);
  }
  motion.loads = {load};
  return motion;
}

Mechanism SkewedModel(const std::string& models_dir) {
  LoadOptions options;
  options.overrides = {{"c_platform_x", 0.03}, {"c_platform_y", -0.02}, {"I_platform_xx", 0.33},
                       {"c_cyl_x", 0.01},      {"c_cyl_y", -0.02},      {"I_cyl_yy", 0.075},
                       {"I_cyl_zz", 0.02},     {"c_rod_x", -0.015},     {"c_rod_y", 0.025},
                       {"I_rod_xx", 0.06},     {"I_rod_zz", 0.02}};
  LoadResult loaded = LoadModel(models_dir + "/spr_tripod/model.yaml", options);
  MBV_DEMAND(loaded.mechanism.has_value(), loaded.diagnostics.Text());
  loaded.mechanism->gravity_W = {1.5, -2.0, 9.0};
  return *std::move(loaded.mechanism);
}

Truth TruthOf(const Mechanism& mechanism, const ReferenceSample& s) {
  const int platform = mechanism.FindBody("platform");
  const auto& X = s.states.X_WB;
  const auto& V = s.states.V_WB;
  const auto& A = s.states.A_WB;
  Truth t;
  t.r = X[platform].translation();
  t.R = X[platform].linear();
  t.omega = V[platform].head<3>();
  t.v = V[platform].tail<3>();
  t.omega_dot = A[platform].head<3>();
  t.v_dot = A[platform].tail<3>();
  t.psi = std::atan2(t.R(0, 2), -t.R(1, 2));
  t.theta = std::atan2(std::hypot(t.R(0, 2), t.R(1, 2)), t.R(2, 2));
  t.delta = std::atan2(t.R(2, 0), t.R(2, 1));
  for (int i = 0; i < 3; ++i) {
    const std::string name = "leg" + std::to_string(i + 1);
    const int ball = mechanism.FindJoint(name + ".S"), slide = mechanism.FindJoint(name + ".P");
    const int drive = mechanism.FindDrive(name);
    MBV_DEMAND(ball >= 0 && slide >= 0 && drive >= 0, name);
    const Joint& p = mechanism.joints[slide];
    LegTruth& leg = t.leg[i];
    leg.B = X[p.parent].translation();
    leg.A = X[p.child].translation();
    leg.w = X[p.parent].linear() * p.X_PF.linear() * p.axis;
    leg.c = X[p.child].linear().col(0);  // the leg frame's x axis
    leg.v_A = V[p.child].tail<3>();
    leg.omega = V[p.child].head<3>();
    leg.omega_dot = A[p.child].head<3>();
    leg.q = s.driven.position[drive];
    leg.q_dot = s.driven.velocity[drive];
    leg.q_ddot = s.driven.acceleration[drive];
    leg.f = s.drive_force[drive];
    leg.S = mechanism.joints[ball].X_PF.linear() * s.reactions.row(ball).head<3>().transpose();
  }
  return t;
}

Closed ClosedOf(const Geometry& geometry, const Masses& masses, const Truth& t) {
  Closed c;
  RunSummary summary = SolveInverse(geometry, t.r, &c.p);
  if (summary.ok()) summary = FillJacobians(geometry, c.p, &c.j);
  MBV_DEMAND(summary.ok(), summary.message);
  FillVelocities(c.p, c.j, t.v, &c.v);
  FillAccelerations(c.p, c.j, c.v, t.v_dot, &c.a);
  ExternalLoads loads;
  loads.Add(kPlatform, c.p.R * kPoint, kForce, kMoment);
  FillForces(c.p, c.j, c.v, c.a, masses, loads, &c.f);
  return c;
}

}  // namespace

Case MakeCase(const std::string& models_dir) {
  const Mechanism mechanism = SkewedModel(models_dir);
  const Motion motion = Round(mechanism);
  Diagnostics diagnostics;
  Case result;
  result.geometry = ReadGeometry(mechanism, &diagnostics);
  const Masses masses = ReadMasses(mechanism, &diagnostics);
  MBV_DEMAND(!diagnostics.has_errors(), diagnostics.Text());
  ReferenceSolver solver(mechanism, motion);
  CommandSample command;
  ReferenceSample sample;
  for (double time_s : SampleTimes(motion.duration_s, motion.sample_s)) {
    EvaluateMotion(motion, time_s, &command);
    const RunSummary summary = solver.Dynamics(command, &sample);
    MBV_DEMAND(summary.ok(), summary.message);
    result.truth.push_back(TruthOf(mechanism, sample));
    result.closed.push_back(ClosedOf(result.geometry, masses, result.truth.back()));
  }
  return result;
}

}  // namespace mbv::spr_tripod_audit
