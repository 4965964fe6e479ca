#include "analytic/spr_tripod/closed_form.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "analytic/spr_tripod/dynamics.h"
#include "analytic/spr_tripod/position.h"
#include "base/demand.h"
#include "math/spatial.h"
#include "mechanism/channels.h"

namespace mbv::spr_tripod {
namespace {

// Where the closed form's bodies, joints and inputs are in the Mechanism and the Motion.
struct Wiring {
  std::array<int, kBodies> body{};  // Mechanism body index of each of the seven
  PerLeg<Mat3> R_WF;                // axes of the ball joints
  PerLeg<std::string> ball_name;
  int output = -1;         // the platform's output
  bool task_space = true;  // platform.x, y, z commanded; otherwise the legs
  PerLeg<int> command{};   // entries of CommandSample in the order x, y, z or 1, 2, 3
};

// Finds joints, bodies and drives of the three legs by the joints' names.
void WireLegs(const Mechanism& mechanism, Wiring* wiring, Diagnostics* diagnostics) {
  for (int leg = 0; leg < 3; ++leg) {
    const std::string name = fmt::format("leg{}", leg + 1);
    const int ball = mechanism.FindJoint(name + ".S"), slide = mechanism.FindJoint(name + ".P"),
              hinge = mechanism.FindJoint(name + ".R");
    if (ball < 0 || slide < 0 || hinge < 0) {
      diagnostics->AddError(
          "", fmt::format("{} lacks joint {}.S, {}.P or {}.R", mechanism.name, name, name, name),
          "the closed form needs the shipped model's joint names");
      continue;
    }
    wiring->body[CylinderBody(leg)] = mechanism.joints[slide].parent;
    wiring->body[RodBody(leg)] = mechanism.joints[slide].child;
    const Joint& joint = mechanism.joints[hinge];  // written either way round
    wiring->body[kPlatform] =
        joint.child == wiring->body[RodBody(leg)] ? joint.parent : joint.child;
    wiring->R_WF[leg] = mechanism.joints[ball].X_PF.linear();
    wiring->ball_name[leg] = mechanism.joints[ball].name;
    const auto* drive = leg < static_cast<int>(mechanism.drives.size())
                            ? std::get_if<JointDrive>(&mechanism.drives[leg].kind)
                            : nullptr;
    if (drive == nullptr || drive->joint != slide || mechanism.drives.size() != 3) {
      diagnostics->AddError(
          "", fmt::format("drive {} must act on {}.P, and there are three drives", leg + 1, name),
          "");
    }
  }
  // The output that is O_A's pose in the world.
  for (size_t i = 0; i < mechanism.outputs.size(); ++i) {
    const Output& output = mechanism.outputs[i];
    const bool is_pose = output.X_BO.matrix().isApprox(Pose::Identity().matrix(), 4 * kEps) &&
                         output.X_RbR.matrix().isApprox(Pose::Identity().matrix(), 4 * kEps);
    if (output.body == wiring->body[kPlatform] && output.reference_body == 0 && is_pose) {
      wiring->output = static_cast<int>(i);
    }
  }
}

// Input slot of a command: 0…2 for platform.x, y, z, 3…5 for the legs, -1 for anything else.
int SlotOf(const Command& command, const Wiring& wiring) {
  if (command.terms.size() != 1 || command.terms[0].factor != 1.0) return -1;
  const Coordinate& c = command.terms[0].coordinate;
  if (c.kind == Coordinate::Kind::kDrive) return 3 + c.index;
  if (c.kind != Coordinate::Kind::kOutput || c.index != wiring.output) return -1;
  return c.component < 3 ? c.component : -1;
}

void WireCommands(const Motion& motion, Wiring* wiring, Diagnostics* diagnostics) {
  std::array<int, 6> slots;
  slots.fill(-1);
  const char* hint = "command platform.x, platform.y and platform.z, or leg1, leg2 and leg3";
  for (size_t k = 0; k < motion.commands.size(); ++k) {
    const int slot = SlotOf(motion.commands[k], *wiring);
    if (slot < 0) {
      diagnostics->AddError(
          "", "the closed form does not cover command '" + motion.commands[k].name + "'", hint);
      return;
    }
    slots[slot] = static_cast<int>(k);
  }
  const auto complete = [&](int first) {
    return std::all_of(&slots[first], &slots[first] + 3, [](int k) { return k >= 0; });
  };
  wiring->task_space = complete(0);
  if (motion.commands.size() != 3 || (!complete(0) && !complete(3))) {
    diagnostics->AddError(
        "", "the commands do not fix the three degrees of freedom in a way the closed form covers",
        hint);
    return;
  }
  std::copy_n(&slots[wiring->task_space ? 0 : 3], 3, wiring->command.begin());
}

void CheckLoads(const Motion& motion, const Wiring& wiring, Diagnostics* diagnostics) {
  for (const Load& load : motion.loads) {
    if (std::find(wiring.body.begin(), wiring.body.end(), load.body) == wiring.body.end()) {
      diagnostics->AddError("", "load '" + load.name + "' acts on a body that does not move", "");
    }
  }
}

class SprTripod final : public ClosedForm {
 public:
  SprTripod(const Mechanism& mechanism, Geometry geometry, const Masses& masses, Wiring wiring)
      : geometry_(std::move(geometry)), masses_(masses), wiring_(std::move(wiring)) {
    if (wiring_.output >= 0) {
      const auto all = OutputChannels(mechanism);
      channels_.assign(all.begin() + 6 * wiring_.output, all.begin() + 6 * wiring_.output + 6);
    }
    for (const std::string& ball : wiring_.ball_name) {
      for (int c = 0; c < 3; ++c) {
        channels_.push_back(MakeChannel(Quantity::kReaction, "N", ball, ball, c));
      }
    }
    channels_.push_back({"tilt", "rad", ""});
    for (int leg = 1; leg <= 3; ++leg) {
      channels_.push_back({fmt::format("leg{}.spin", leg), "rad/s", ""});
    }
    channels_.push_back({"jacobian.det", "1", ""});
  }

  std::vector<Channel> extra_channels() const override { return channels_; }

  RunSummary Kinematics(const CommandSample& command, DrivenSample* driven) override {
    RunSummary summary = SolveMotion(command);
    if (summary.ok()) FillDriven(driven);
    return summary;
  }

  RunSummary Dynamics(const CommandSample& command, ClosedFormSample* sample) override {
    RunSummary summary = SolveMotion(command);
    if (!summary.ok()) return summary;
    FillDriven(&sample->driven);
    FillLoads(command);
    FillForces(posture_, jacobians_, velocities_, accelerations_, masses_, loads_, &forces_);
    sample->force = Eigen::Map<const Vec3>(forces_.f.data());
    FillExtra(&sample->extra);
    return summary;
  }

 private:
  // Posture, velocities and accelerations for the commanded motion.
  RunSummary SolveMotion(const CommandSample& command) {
    const auto input = [&](const VecX& from) {
      const PerLeg<int>& k = wiring_.command;
      return Vec3(from[k[0]], from[k[1]], from[k[2]]);
    };
    const Vec3 position = input(command.position);
    RunSummary summary =
        wiring_.task_space
            ? SolveInverse(geometry_, position, &posture_)
            : SolveForward(geometry_, {position[0], position[1], position[2]}, &posture_);
    if (summary.ok()) summary = FillJacobians(geometry_, posture_, &jacobians_);
    if (!summary.ok()) {
      summary.time_s = command.time_s;
      return summary;
    }
    Vec3 v = input(command.velocity), v_dot = input(command.acceleration);
    if (!wiring_.task_space) v = jacobians_.J_inv * v;
    FillVelocities(posture_, jacobians_, v, &velocities_);
    if (!wiring_.task_space) {
      // q̈ is affine in v̇ with matrix J: what is missing at v̇ = 0 must come from v̇.
      FillAccelerations(posture_, jacobians_, velocities_, Vec3::Zero(), &accelerations_);
      v_dot = jacobians_.J_inv * (v_dot - Eigen::Map<const Vec3>(accelerations_.q_ddot.data()));
    }
    FillAccelerations(posture_, jacobians_, velocities_, v_dot, &accelerations_);
    return summary;
  }

  void FillDriven(DrivenSample* driven) const {
    driven->position = Eigen::Map<const Vec3>(posture_.q.data());
    driven->velocity = Eigen::Map<const Vec3>(velocities_.q_dot.data());
    driven->acceleration = Eigen::Map<const Vec3>(accelerations_.q_ddot.data());
  }

  void FillLoads(const CommandSample& command) {
    if (command.loads.empty()) return;
    loads_.Clear();
    for (const LoadSample& load : command.loads) {
      const auto at = std::find(wiring_.body.begin(), wiring_.body.end(), load.body);
      const int body = static_cast<int>(at - wiring_.body.begin());
      const Mat3 R_WB = BodyPose(posture_, body).linear();
      const Mat3 R_WE = load.in_body_axes ? R_WB : Mat3(Mat3::Identity());
      loads_.Add(body, R_WB * load.p_BoQ_B, R_WE * load.force, R_WE * load.moment);
    }
  }

  void FillExtra(VecX* extra) const {
    extra->resize(static_cast<Eigen::Index>(channels_.size()));
    Eigen::Index k = 0;
    if (wiring_.output >= 0) {
      extra->segment<3>(k) = posture_.r;
      extra->segment<3>(k + 3) = RpyOf(posture_.R);
      k += 6;
    }
    for (int leg = 0; leg < 3; ++leg, k += 3) {
      extra->segment<3>(k) = wiring_.R_WF[leg].transpose() * forces_.S[leg];
    }
    (*extra)[k++] = posture_.tilt.Angle();
    for (int leg = 0; leg < 3; ++leg) (*extra)[k++] = velocities_.spin[leg];
    (*extra)[k++] = jacobians_.det;
    MBV_DEMAND(k == extra->size(), k);
  }

  Geometry geometry_;
  Masses masses_;
  Wiring wiring_;
  std::vector<Channel> channels_;
  Posture posture_;
  Jacobians jacobians_;
  Velocities velocities_;
  Accelerations accelerations_;
  ExternalLoads loads_;
  Forces forces_;
};

}  // namespace

std::unique_ptr<ClosedForm> MakeClosedForm(const Mechanism& mechanism, const Motion& motion,
                                           const ClosedFormOptions& /*options*/,
                                           Diagnostics* diagnostics) {
  Diagnostics found;
  Geometry geometry = ReadGeometry(mechanism, &found);
  const Masses masses = ReadMasses(mechanism, &found);
  Wiring wiring;
  WireLegs(mechanism, &wiring, &found);
  if (!found.has_errors()) {
    WireCommands(motion, &wiring, &found);
    CheckLoads(motion, wiring, &found);
  }
  diagnostics->Append(found);
  if (found.has_errors()) return nullptr;
  return std::make_unique<SprTripod>(mechanism, std::move(geometry), masses, std::move(wiring));
}

namespace {

AssumedBody BodyOf(const ParameterReader& read, const std::string& name, const std::string& stem) {
  Mat3 I;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      const std::string moment = fmt::format("I_{}_{}{}", stem, "xyz"[i], "xyz"[j]);
      I(i, j) = I(j, i) = i == j ? read(moment) : read(moment, 0.0);
    }
  }
  return {.name = name,
          .mass = read("m_" + stem),
          .com = read.Vector("c_" + stem),
          .inertia = I,
          .why = fmt::format("m_{0}, c_{0}_…, I_{0}_…; the legs are equal", stem)};
}

// The paper's azimuths, on which its position problem rests.
void StateAzimuths(const ParameterReader& read, int leg, Coverage* c) {
  constexpr double kPaper[] = {2 * std::numbers::pi / 3, -2 * std::numbers::pi / 3, 0.0};
  const double phi = read(fmt::format("phi_{}", leg + 1));
  const double theta = read(fmt::format("theta_{}", leg + 1));
  c->numbers.push_back({.subject = fmt::format("parameter phi_{}", leg + 1),
                        .quantity = fmt::format("its distance to {:.6g} rad", kPaper[leg]),
                        .actual = std::remainder(phi - kPaper[leg], 2 * std::numbers::pi),
                        .assumed = 0.0,
                        .unit = "rad",
                        .why = "joints at 120, -120 and 0 deg"});
  c->numbers.push_back({.subject = fmt::format("parameter theta_{}", leg + 1),
                        .quantity = "cos(theta - phi)",
                        .actual = std::cos(theta - kPaper[leg]),
                        .assumed = 0.0,
                        .why = "revolute axes are perpendicular to O_A A_i"});
}

void StateLeg(const ParameterReader& read, int leg, Coverage* c) {
  const std::string name = fmt::format("leg{}", leg + 1);
  const std::string cyl = name + ".cyl", rod = name + ".rod";
  const double phi = read(fmt::format("phi_{}", leg + 1));
  const double theta = read(fmt::format("theta_{}", leg + 1));
  const Vec3 radial(std::cos(phi), std::sin(phi), 0), zero = Vec3::Zero();
  c->bodies.push_back(BodyOf(read, cyl, "cyl"));
  c->bodies.push_back(BodyOf(read, rod, "rod"));
  c->joints.push_back({.name = name + ".S",
                       .kind = JointKind::kSpherical,
                       .parent = "world",
                       .child = cyl,
                       .p_parent = read("b") * radial,
                       .p_child = zero});
  c->joints.push_back({.name = name + ".P",
                       .kind = JointKind::kPrismatic,
                       .parent = cyl,
                       .child = rod,
                       .p_parent = zero,
                       .p_child = zero,
                       .axis_parent = Vec3::UnitZ(),
                       .axis_child = Vec3::UnitZ(),
                       .R_zero = Mat3::Identity()});
  c->joints.push_back({.name = name + ".R",
                       .kind = JointKind::kRevolute,
                       .parent = "platform",
                       .child = rod,
                       .p_parent = read("a") * radial,
                       .p_child = zero,
                       .axis_parent = Vec3(std::cos(theta), std::sin(theta), 0),
                       .axis_child = Vec3::UnitX(),
                       .reversible = true});
  c->drives.push_back({.name = name, .joint = name + ".P"});
}

}  // namespace

Coverage CoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the 3-SPR mechanism";
  const ParameterReader read(mechanism, &c);
  for (const char* name : {"q_min", "q_max"}) (void)read(name);
  c.bodies.push_back(BodyOf(read, "platform", "platform"));
  for (int leg = 0; leg < 3; ++leg) {
    StateAzimuths(read, leg, &c);
    StateLeg(read, leg, &c);
  }
  return c;
}

}  // namespace mbv::spr_tripod
