#include "features/equation_audit/stabilizing_platform_audit.h"

#include <fmt/format.h>
#include <cmath>
#include <numbers>

#include "base/demand.h"
#include "model_file/load_model.h"

namespace mbv {

AuditTable AuditStabilizingPlatform(const std::string& models_dir) {
  using namespace platform_audit;
  const Case full = MakeCase(models_dir, 1.0), massless = MakeCase(models_dir, 0.0);
  AuditTable table;
  table.mechanism = "stabilizing_platform";
  table.source =
      "Li Erwei, Zhao Tieshi, Wang Chang, Bian Hui, Hu Qiangqiang, Ji Wenjie, Dynamics of "
      "large-scale heavy-burden parallel stabilizing cargo-receiving platform, Trans. Chinese "
      "Society for Agricultural Machinery 49(3), 2018. Compared with the generic reference solver "
      "at 61 instants of the example motion (12 s)";
  for (auto rows : {PoseRows(full), TwistRows(full), LimbRows(full), ForceRows(full, massless),
                    ClaimRows(full, massless)}) {
    for (AuditRow& row : rows) table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace mbv

namespace mbv::platform_audit {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kStep_s = 5e-3;  // of the differences
const SineTerm kRoll{6 * kDegree, 1.0 / 6, 0}, kPitch{3 * kDegree, 0.25, 0};
const SineTerm kHeave{1.5, 1.0 / 6, 0};
constexpr double kHeight = 3.5;

Vec6 AboutEarthOrigin(const Vec6& motion, const Vec3& p_eB) {
  Vec6 V = motion;
  V.tail<3>() -= motion.head<3>().cross(p_eB);
  return V;
}

// Reads poses, twists and forces of one reference sample.
class Reader {
 public:
  Reader(const Mechanism& mechanism, const ReferenceSample& sample)
      : m_(mechanism), s_(sample), lower_(Body("lower_platform")), upper_(Body("platform")) {}

  [[nodiscard]] int Body(const std::string& name) const {
    const int body = m_.FindBody(name);
    MBV_DEMAND(body >= 0, name);
    return body;
  }
  [[nodiscard]] const Pose& X(int body) const { return s_.states.X_WB[body]; }

  // Twist of a body relative to {o}, in {o} about its origin.
  [[nodiscard]] Vec6 RelativeTwist(int body) const {
    const Vec6 difference = AboutEarthOrigin(s_.states.V_WB[body], X(body).translation()) -
                            AboutEarthOrigin(s_.states.V_WB[lower_], X(lower_).translation());
    const Mat3 R_oe = X(lower_).linear().transpose();
    const Vec3 p = X(lower_).translation();
    Vec6 V;
    V << R_oe * difference.head<3>(), R_oe * (difference.tail<3>() + difference.head<3>().cross(p));
    return V;
  }

  void ReadPlatforms(Truth* t) const {
    t->X_eo = X(lower_);
    t->X_ep = X(upper_);
    t->motion_o = s_.states.V_WB[lower_];
    t->motion_p = s_.states.V_WB[upper_];
    t->acceleration_o = s_.states.A_WB[lower_];
    t->acceleration_p = s_.states.A_WB[upper_];
    t->V_eo = AboutEarthOrigin(t->motion_o, t->X_eo.translation());
    t->V_ep = AboutEarthOrigin(t->motion_p, t->X_ep.translation());
    t->V_op = RelativeTwist(upper_);
  }

  void ReadLimb(int i, double azimuth, double r_a, double L3, bool forces, LimbTruth* limb) const;

 private:
  const Mechanism& m_;
  const ReferenceSample& s_;
  int lower_, upper_;
};

void Reader::ReadLimb(int i, double azimuth, double r_a, double L3, bool forces,
                      LimbTruth* limb) const {
  const Pose X_oe = X(lower_).inverse();
  std::array<Pose, 4> X_oL;
  std::array<int, 4> bodies;
  for (int k = 0; k < 4; ++k) {
    bodies[k] = Body(fmt::format("limb{}.{}", i + 1, sp::kLinkNames[k]));
    X_oL[k] = X_oe * X(bodies[k]);
  }
  // The links' x axes are normal to the limb plane; Y is the tangent.
  const Vec3 e_r(std::cos(azimuth), std::sin(azimuth), 0), e_t(-e_r.y(), e_r.x(), 0);
  const Vec3 X_axis = X_oL[0].linear().col(0);
  limb->R_oA << X_axis, e_t, X_axis.cross(e_t);
  limb->p_oA = r_a * e_r;
  limb->p_oB = X_oL[sp::kLink2] * Vec3(0, L3, 0);
  const Mat3 R_Ao = limb->R_oA.transpose();
  limb->tilt = std::atan2(-X_axis.z(), X_axis.dot(e_r));
  for (int k = 0; k < 4; ++k) {
    const Vec6 V = RelativeTwist(bodies[k]);
    limb->link_twist_A[k] << R_Ao * V.head<3>(),
        R_Ao * (V.tail<3>() + V.head<3>().cross(limb->p_oA));
  }
  limb->tilt_rate = limb->link_twist_A[0][1];
  // Length and rates from the tip's motion relative to {o}.
  const Vec6 V = RelativeTwist(upper_);
  const Vec3 B_rate = V.tail<3>() + V.head<3>().cross(limb->p_oB);
  limb->l = (limb->p_oB - limb->p_oA).norm();
  limb->l_rate = (limb->p_oB - limb->p_oA).dot(B_rate) / limb->l;
  for (int j = 0; j < 2; ++j) {
    const double s = sp::kSides[j];
    auto angle = [&](int link) {
      const Vec3 d = R_Ao * X_oL[link].linear().col(1);
      const double q = std::atan2(d.z(), s * d.y());
      return q < 0 ? q + 2 * std::numbers::pi : q;
    };
    SideTruth& side = limb->side[j];
    side.q1 = angle(sp::kLink1 + j);
    side.q2 = angle(sp::kLink2 + j);
    side.q1_rate = s * limb->link_twist_A[sp::kLink1 + j].x();
    side.q2_rate = s * limb->link_twist_A[sp::kLink2 + j].x();
    side.elbow_A = R_Ao * (X_oL[sp::kLink2 + j].translation() - limb->p_oA);
    const int drive = m_.FindDrive(fmt::format("limb{}.drive{}", i + 1, j == 0 ? "" : "_p"));
    side.R = {s_.driven.position[drive], s_.driven.velocity[drive], s_.driven.acceleration[drive]};
    if (forces) limb->drive[j] = s_.drive_force[drive];
  }
  if (!forces) return;
  const int ball = m_.FindJoint(fmt::format("limb{}.S", i + 1));
  MBV_DEMAND(ball >= 0 && m_.joints[ball].parent == bodies[sp::kLink2], i);
  const Vec3 f_F = s_.reactions.row(ball).head<3>().transpose();
  limb->force_A = R_Ao * X_oL[sp::kLink2].linear() * m_.joints[ball].X_PF.linear() * f_F;
}

// Derivative from seven samples h apart.
template <typename F>
auto Difference(const std::array<Truth, 7>& s, F f) {
  return ((45 * (f(s[4]) - f(s[2])) - 9 * (f(s[5]) - f(s[1])) + (f(s[6]) - f(s[0]))) /
          (60 * kStep_s))
      .eval();
}

Truth TruthAt(const Case& c, const Motion& motion, double t, ReferenceSolver* solver) {
  std::array<Truth, 7> stencil;
  CommandSample command;
  ReferenceSample sample;
  for (int k = 0; k < 7; ++k) {
    const double t_k = t + (k - 3) * kStep_s;
    EvaluateMotion(motion, t_k, &command);
    const RunSummary summary =
        k == 3 ? solver->Dynamics(command, &sample) : solver->Kinematics(command, &sample);
    MBV_DEMAND(summary.ok(), summary.message);
    const Reader reader(c.mechanism, sample);
    Truth& truth = stencil[k];
    truth.time_s = t_k;
    truth.command = SeaStateAt(t_k);
    reader.ReadPlatforms(&truth);
    for (int i = 0; i < 3; ++i) {
      reader.ReadLimb(i, c.parameters.azimuth(i), c.parameters.r_a, c.parameters.L3, k == 3,
                      &truth.limbs[i]);
    }
  }
  Truth truth = stencil[3];
  truth.A_eo = Difference(stencil, [](const Truth& s) { return s.V_eo; });
  truth.A_ep = Difference(stencil, [](const Truth& s) { return s.V_ep; });
  truth.A_op = Difference(stencil, [](const Truth& s) { return s.V_op; });
  for (int i = 0; i < 3; ++i) {
    truth.limbs[i].l_acceleration = Difference(
        stencil, [i](const Truth& s) { return Eigen::Matrix<double, 1, 1>(s.limbs[i].l_rate); })[0];
  }
  return truth;
}

}  // namespace

Motion SeaState(const Mechanism& mechanism) {
  using Kind = Coordinate::Kind;
  Motion motion;
  motion.duration_s = 12;
  auto add = [&](std::string name, std::vector<Command::Term> terms, ProfileTerm profile) {
    motion.commands.push_back({std::move(name), std::move(terms), {{profile}}});
  };
  for (size_t k = 0; k < mechanism.prescribed.size(); ++k) {
    const std::string& name = mechanism.prescribed[k].name;
    const SineTerm& term = name == "roll" ? kRoll : name == "pitch" ? kPitch : kHeave;
    add(name, {{{Kind::kPrescribed, static_cast<int>(k), 0}, 1.0}}, term);
  }
  const int output = mechanism.FindOutput("platform");
  add("platform.z", {{{Kind::kOutput, output, 2}, 1.0}}, ConstantTerm{kHeight});
  add("platform.roll", {{{Kind::kOutput, output, 3}, 1.0}}, ConstantTerm{0});
  add("platform.pitch", {{{Kind::kOutput, output, 4}, 1.0}}, ConstantTerm{0});
  for (int i = 1; i <= 3; ++i) {
    const int drive = mechanism.FindDrive(fmt::format("limb{}.drive", i));
    const int drive_p = mechanism.FindDrive(fmt::format("limb{}.drive_p", i));
    add(fmt::format("limb{0}.drive - limb{0}.drive_p", i),
        {{{Kind::kDrive, drive, 0}, 1.0}, {{Kind::kDrive, drive_p, 0}, -1.0}}, ConstantTerm{0});
  }
  return motion;
}

sp::PoseCommand SeaStateAt(double t) {
  sp::PoseCommand command;
  command.roll = Evaluate(ProfileTerm(kRoll), t);
  command.pitch = Evaluate(ProfileTerm(kPitch), t);
  command.heave = Evaluate(ProfileTerm(kHeave), t);
  command.platform.fill(Jet{});
  command.platform[2].value = kHeight;
  return command;
}

Case MakeCase(const std::string& models_dir, double link_mass_scale) {
  LoadOptions options;
  options.overrides["link_mass_scale"] = link_mass_scale;
  LoadResult model = LoadModel(models_dir + "/stabilizing_platform/model.yaml", options);
  MBV_DEMAND(model.mechanism.has_value(), model.diagnostics.Text());
  Case c;
  c.mechanism = std::move(*model.mechanism);
  Diagnostics diagnostics;
  c.parameters = sp::ReadParameters(c.mechanism, &diagnostics);
  MBV_DEMAND(diagnostics.empty(), diagnostics.Text());

  const Motion motion = SeaState(c.mechanism);
  ReferenceSolver solver(c.mechanism, motion);
  const sp::PlatformEquations equations(c.parameters, sp::DrivePairs::kSynchronous);
  for (int k = 0; k <= 60; ++k) {
    const double t = 0.2 * k;
    c.truth.push_back(TruthAt(c, motion, t, &solver));
    sp::Evaluation closed;
    RunSummary summary = equations.EvaluateKinematics(SeaStateAt(t), &closed);
    if (summary.ok()) summary = equations.EvaluateDynamics({}, &closed);
    MBV_DEMAND(summary.ok(), summary.message);
    c.closed.push_back(closed);
  }
  return c;
}

}  // namespace mbv::platform_audit
