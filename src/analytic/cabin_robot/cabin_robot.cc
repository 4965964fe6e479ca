#include "analytic/cabin_robot/cabin_robot.h"

#include <fmt/format.h>

#include <array>

#include "analytic/cabin_robot/reactions.h"
#include "analytic/cabin_robot/tool_inverse.h"
#include "core/spatial.h"
#include "mechanism/channels.h"

namespace mbv::cabin {
namespace {

constexpr std::array<const char*, 3> kTaskNames = {"platform.x", "platform.y", "platform.yaw"};
constexpr std::array<const char*, 6> kToolNames = {"tool.x",    "tool.y",     "tool.z",
                                                   "tool.roll", "tool.pitch", "tool.yaw"};

// Which coordinates a motion commands.
enum class Space { kPlatform, kSliders, kToolRail, kToolHeight, kNone };

int Count(const Motion& motion, std::initializer_list<const char*> names) {
  int count = 0;
  for (const char* name : names) count += motion.FindCommand(name) >= 0;
  return count;
}

Space SpaceOf(const Motion& motion) {
  const int commands = static_cast<int>(motion.commands.size());
  if (commands != kDrives) return Space::kNone;
  int tool = 0;
  for (const char* name : kToolNames) tool += motion.FindCommand(name) >= 0;
  if (tool == 6 && Count(motion, {"platform.yaw", "d1"}) == 2) return Space::kToolRail;
  if (tool == 6 && Count(motion, {"platform.yaw", "platform.y"}) == 2) return Space::kToolHeight;
  if (Count(motion, {"d1", "th3", "th4", "d5", "th6"}) != 5) return Space::kNone;
  if (Count(motion, {"platform.x", "platform.y", "platform.yaw"}) == 3) return Space::kPlatform;
  if (Count(motion, {"X1", "X2", "X3"}) == 3) return Space::kSliders;
  return Space::kNone;
}

CabinGeometry ReadGeometry(const Mechanism& m) {
  CabinGeometry g;
  g.planar = {m.ParameterValue("L1"), m.ParameterValue("L2"), m.ParameterValue("L3"),
              m.ParameterValue("L4")};
  g.wrist = {m.ParameterValue("a2"), m.ParameterValue("d3"), m.ParameterValue("a3"),
             m.ParameterValue("a4"), m.ParameterValue("d6")};
  g.gravity = m.gravity_W;
  for (int b = 0; b < kBodies; ++b) {
    const std::string name = kBodyNames[b];
    BodyData& body = g.bodies[b];
    body.mass = m.ParameterValue("m_" + name);
    for (int c = 0; c < 3; ++c) {
      const std::string axis(1, "xyz"[c]);
      body.com[c] = m.ParameterValue("c_" + name + "_" + axis);
      body.inertia(c, c) = m.ParameterValue("I_" + name + "_" + axis);
    }
  }
  return g;
}

class CabinRobot final : public ClosedForm {
 public:
  CabinRobot(const Mechanism& mechanism, const Motion& motion)
      : geometry_(ReadGeometry(mechanism)), reactions_(mechanism) {
    for (int d = 0; d < kDrives; ++d) {
      command_of_drive_[d] = motion.FindCommand(kDriveNames[d]);
      model_order_[d] = mechanism.FindDrive(kDriveNames[d]);
    }
    for (int k = 0; k < 3; ++k) command_of_task_[k] = motion.FindCommand(kTaskNames[k]);
    for (int k = 0; k < 6; ++k) command_of_tool_[k] = motion.FindCommand(kToolNames[k]);
    space_ = SpaceOf(motion);
    for (int b = 0; b < kBodies; ++b) model_body_[b] = mechanism.FindBody(kBodyNames[b]);
  }

  std::vector<Channel> extra_channels() const override {
    std::vector<Channel> channels = PoseChannels("platform", "world");
    for (Channel& channel : PoseChannels("tool", "world")) channels.push_back(std::move(channel));
    for (const char* angle : {"alpha", "beta", "epsilon"}) {
      channels.push_back({std::string("linkage.") + angle, "rad", ""});
    }
    channels.insert(channels.end(), reactions_.channels().begin(), reactions_.channels().end());
    return channels;
  }

  RunSummary Kinematics(const CommandSample& command, DrivenSample* driven) override {
    const RunSummary summary = Solve(command);
    if (summary.ok()) Store(driven);
    return summary;
  }

  RunSummary Dynamics(const CommandSample& command, ClosedFormSample* sample) override {
    const RunSummary summary = Solve(command);
    if (!summary.ok()) return summary;
    Store(&sample->driven);
    ComputeFrames(geometry_, planar_, outer_, &frames_);
    Vec8 tau = DriveForces(geometry_, frames_);
    Demands demands = DemandsOf(geometry_, frames_);
    for (const LoadSample& load : command.loads) {
      const BodyWrench wrench = WrenchOf(load);
      if (wrench.body == kBodies) continue;  // on the world
      tau += DriveForcesOf(frames_, wrench);
      TakeOff(wrench, frames_, &demands);
    }
    sample->force.resize(kDrives);
    for (int d = 0; d < kDrives; ++d) sample->force[model_order_[d]] = tau[d];

    sample->extra.resize(15 + static_cast<Eigen::Index>(reactions_.channels().size()));
    StorePose(frames_[kPlatform], sample->extra.data());
    StorePose(frames_[kPayload], sample->extra.data() + 6);
    sample->extra[12] = planar_.alpha.p;
    sample->extra[13] = planar_.beta.p;
    sample->extra[14] = planar_.epsilon.p;
    reactions_.Write(geometry_, frames_, demands, sample->extra.data() + 15);
    return summary;
  }

 private:
  static Motion1 At(const CommandSample& command, int k) {
    return {command.position[k], command.velocity[k], command.acceleration[k]};
  }

  RunSummary Solve(const CommandSample& command) {
    RunSummary summary;
    if (space_ == Space::kToolRail || space_ == Space::kToolHeight) {
      summary = SolveTool(command);
    } else {
      outer_ = {At(command, command_of_drive_[kRail]), At(command, command_of_drive_[kTh3]),
                At(command, command_of_drive_[kTh4]), At(command, command_of_drive_[kD5]),
                At(command, command_of_drive_[kTh6])};
      summary = SolvePlane(command);
    }
    summary.time_s = command.time_s;
    return summary;
  }

  RunSummary SolvePlane(const CommandSample& command) {
    if (space_ == Space::kPlatform) {
      planar_.X = At(command, command_of_task_[0]);
      planar_.Y = At(command, command_of_task_[1]);
      planar_.gamma = At(command, command_of_task_[2]);
      return SolveInverse(geometry_.planar, &planar_);
    }
    planar_.X1 = At(command, command_of_drive_[kX1]);
    planar_.X2 = At(command, command_of_drive_[kX2]);
    planar_.X3 = At(command, command_of_drive_[kX3]);
    return SolveForward(geometry_.planar, &planar_);
  }

  RunSummary SolveTool(const CommandSample& command) {
    ToolCommand tool;
    for (int k = 0; k < 3; ++k) {
      tool.position[k] = At(command, command_of_tool_[k]);
      tool.rpy[k] = At(command, command_of_tool_[3 + k]);
    }
    tool.gamma = At(command, command_of_task_[2]);
    const bool rail = space_ == Space::kToolRail;
    tool.resolved = At(command, rail ? command_of_drive_[kRail] : command_of_task_[1]);
    return SolveToolPose(geometry_, rail ? Resolution::kRailGiven : Resolution::kHeightGiven, tool,
                         &planar_, &outer_);
  }

  void Store(DrivenSample* driven) const {
    driven->position.resize(kDrives);
    driven->velocity.resize(kDrives);
    driven->acceleration.resize(kDrives);
    const std::array<const Motion1*, kDrives> coordinates = {&outer_.d1,  &planar_.X1, &planar_.X2,
                                                             &planar_.X3, &outer_.th3, &outer_.th4,
                                                             &outer_.d5,  &outer_.th6};
    for (int d = 0; d < kDrives; ++d) {
      driven->position[model_order_[d]] = coordinates[d]->p;
      driven->velocity[model_order_[d]] = coordinates[d]->v;
      driven->acceleration[model_order_[d]] = coordinates[d]->a;
    }
  }

  static void StorePose(const FrameMotion& frame, double* out) {
    Eigen::Map<Vec3>{out} = frame.p;
    Eigen::Map<Vec3>{out + 3} = RpyOf(frame.R);
  }

  // In world axes; the body is kBodies for a wrench on the world.
  BodyWrench WrenchOf(const LoadSample& load) const {
    int body = 0;
    while (body < kBodies && model_body_[body] != load.body) ++body;
    if (body == kBodies || !load.in_body_axes) {
      return {body, load.p_BoQ_B, load.force, load.moment};
    }
    const Mat3& R = frames_[body].R;
    return {body, load.p_BoQ_B, R * load.force, R * load.moment};
  }

  CabinGeometry geometry_;
  JointReactions reactions_;
  Space space_ = Space::kNone;
  std::array<int, kDrives> command_of_drive_{}, model_order_{};
  std::array<int, 3> command_of_task_{};
  std::array<int, 6> command_of_tool_{};
  std::array<int, kBodies> model_body_{};
  PlanarState planar_;
  OuterDrives outer_;
  std::array<FrameMotion, kBodies> frames_;
};

}  // namespace
}  // namespace mbv::cabin

namespace mbv {

std::unique_ptr<ClosedForm> MakeCabinRobot(const Mechanism& mechanism, const Motion& motion,
                                           const ClosedFormOptions&, Diagnostics* diagnostics) {
  using namespace cabin;
  if (SpaceOf(motion) == Space::kNone) {
    std::string commanded;
    for (const Command& command : motion.commands) {
      commanded += (commanded.empty() ? "" : ", ") + command.name;
    }
    diagnostics->Add(
        {.severity = Severity::kError,
         .file = {},
         .message = fmt::format("the cabin robot's equations cannot follow the commands {}",
                                commanded.empty() ? "(none)" : commanded),
         .hint = "command exactly eight: d1, th3, th4, d5, th6 with platform.x, platform.y, "
                 "platform.yaw or with X1, X2, X3; or tool.x ... tool.yaw with platform.yaw and "
                 "either d1 (rail given) or platform.y (height given)"});
  }
  if (diagnostics->has_errors()) return nullptr;
  return std::make_unique<CabinRobot>(mechanism, motion);
}

}  // namespace mbv
