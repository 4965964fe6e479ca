#include "analytic/cabin_robot/closed_form.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "analytic/cabin_robot/dynamics.h"
#include "analytic/cabin_robot/stiffness.h"
#include "math/spatial.h"
#include "mechanism/channels.h"

namespace mbv::cabin_robot {
namespace {

// The complete inverse problem of the cabin robot: drives from the pose of the end effector.
//
// Eight drives, six task DOFs: the rail and the sliders share a direction, and the platform's
// tilt γ can be exchanged against the wrist. The redundancy is resolved by two more commands, kept
// exactly: γ and either the rail position d1 or the platform height Y.
//
// Positions in closed form (not in the paper): with R26 = Rz(γ)ᵀ R = [n o a],
//   th4 = asin(−a_y), th3 = atan2(−a_z, a_x), th6 = atan2(n_y, o_y),
//   p = K + b + d5 y4 with b = Rz(γ)(a2, d3, 0) + a3 x3 + (a4 + d6) R e_z,
// whose rows give d5, X and the free one of Y, d1; then the planar inverse (4). Rates from the
// corrected 6×8 Jacobian (33), (34) with the two resolution rows added.

enum class Resolution {
  kRailGiven,    ///< γ and d1 commanded
  kHeightGiven,  ///< γ and Y commanded
};

/// Commanded pose of {6} in the world: position and roll, pitch, yaw of R = Rz Ry Rx, each with two
/// derivatives, and the two resolution coordinates.
struct ToolCommand {
  std::array<Motion1, 3> position;
  std::array<Motion1, 3> rpy;
  Motion1 gamma;
  Motion1 resolved;  ///< d1 or Y
};

using Mat8 = Eigen::Matrix<double, kDrives, kDrives>;

// Below these a division would lose more than half of the digits.
constexpr double kSmallDirection = 1e-6;
constexpr double kSmallPivot = 1e-8;

RunSummary Singular(const char* where, const char* message, double amount) {
  RunSummary summary;
  summary.stop = Stop::kSingular;
  summary.message = message;
  summary.where = where;
  summary.amount = amount;
  summary.unit = "1";
  return summary;
}

// ω = E(rpy) · rates for R = Rz(yaw) Ry(pitch) Rx(roll), and E's derivative.
Mat3 RateMatrix(const Vec3& rpy) {
  const double cp = std::cos(rpy.y()), sp = std::sin(rpy.y());
  const double cy = std::cos(rpy.z()), sy = std::sin(rpy.z());
  Mat3 E;
  E << cy * cp, -sy, 0, sy * cp, cy, 0, -sp, 0, 1;
  return E;
}
Mat3 RateMatrixDot(const Vec3& rpy, const Vec3& rates) {
  const double cp = std::cos(rpy.y()), sp = std::sin(rpy.y()), p = rates.y(), y = rates.z();
  const double cy = std::cos(rpy.z()), sy = std::sin(rpy.z());
  Mat3 E;
  E << -sy * cp * y - cy * sp * p, -cy * y, 0, cy * cp * y - sy * sp * p, -sy * y, 0, -cp * p, 0, 0;
  return E;
}

// Positions of everything; rates are left alone.
RunSummary SolvePositions(const CabinGeometry& geometry, Resolution resolution,
                          const ToolCommand& c, PlanarState* planar, OuterDrives* outer) {
  const WristGeometry& g = geometry.wrist;
  const Vec3 p(c.position[0].p, c.position[1].p, c.position[2].p);
  const Mat3 R = RotRpy({c.rpy[0].p, c.rpy[1].p, c.rpy[2].p});
  const Mat3 Rz = RotZ(c.gamma.p);
  const Mat3 R26 = Rz.transpose() * R;
  outer->th4.p = std::asin(-R26(1, 2));
  outer->th3.p = std::atan2(-R26(2, 2), R26(0, 2));
  outer->th6.p = std::atan2(R26(1, 0), R26(1, 1));
  const double c3 = std::cos(outer->th3.p), s3 = std::sin(outer->th3.p);
  const double c4 = std::cos(outer->th4.p), s4 = std::sin(outer->th4.p);
  const Vec3 x3 = Rz * Vec3(c3, 0.0, -s3), y4 = Rz * Vec3(-c3 * s4, -c4, s3 * s4);
  const Vec3 b = Rz * Vec3(g.a2, g.d3, 0.0) + g.a3 * x3 + (g.a4 + g.d6) * R.col(2);

  const int row = resolution == Resolution::kRailGiven ? 2 : 1;
  if (std::abs(y4[row]) < kSmallDirection) {
    return Singular(
        "d5", "the wrist's prismatic axis is across the direction that resolves the redundancy",
        y4[row]);
  }
  outer->d5.p = (p[row] - b[row] - c.resolved.p) / y4[row];
  const Vec3 K = p - b - outer->d5.p * y4;
  planar->X.p = K.x();
  planar->Y.p = K.y();
  planar->gamma.p = c.gamma.p;
  outer->d1.p = K.z();
  return SolveInverse(geometry.planar, planar);
}

void ClearRates(PlanarState* s, OuterDrives* o) {
  for (Motion1* m : {&s->X1, &s->X2, &s->X3, &o->d1, &o->th3, &o->th4, &o->d5, &o->th6}) {
    m->v = m->a = 0.0;
  }
}

void AddTo(double Motion1::*member, const Vec8& q, PlanarState* s, OuterDrives* o) {
  Motion1* const order[kDrives] = {&o->d1,  &s->X1,  &s->X2, &s->X3,
                                   &o->th3, &o->th4, &o->d5, &o->th6};
  for (int d = 0; d < kDrives; ++d) order[d]->*member = q[d];
}

// Tool twist, γ and the resolution coordinate as functions of the drives' rates (8×8).
Mat8 TaskJacobian(Resolution resolution, const std::array<FrameMotion, kBodies>& frames) {
  Mat8 J;
  J.topRows<3>() = frames[kPayload].Jv;
  J.middleRows<3>(3) = frames[kPayload].Jw;
  J.row(6) = frames[kPlatform].Jw.row(2);
  J.row(7) = frames[kPlatform].Jv.row(resolution == Resolution::kRailGiven ? 2 : 1);
  return J;
}

// The same quantities' accelerations as the frames have them.
Vec8 TaskAcceleration(Resolution resolution, const std::array<FrameMotion, kBodies>& frames) {
  Vec8 a;
  a << frames[kPayload].a, frames[kPayload].e, frames[kPlatform].e.z(),
      frames[kPlatform].a[resolution == Resolution::kRailGiven ? 2 : 1];
  return a;
}

// Fills `planar` and `outer` with positions and both derivatives. kUnreachable as SolveInverse();
// kSingular where the resolution does not determine the pose (y4 across the resolving direction,
// the 8×8 Jacobian rank-deficient, or pitch at ±90°).
RunSummary SolveToolPose(const CabinGeometry& geometry, Resolution resolution, const ToolCommand& c,
                         PlanarState* planar, OuterDrives* outer) {
  ClearRates(planar, outer);
  planar->X = planar->Y = planar->gamma = Motion1{};
  if (RunSummary s = SolvePositions(geometry, resolution, c, planar, outer); !s.ok()) return s;

  // Rates: the task's rates through the 8×8 Jacobian.
  std::array<FrameMotion, kBodies> frames;
  ComputeFrames(geometry, *planar, *outer, &frames);
  const Eigen::PartialPivLU<Mat8> J(TaskJacobian(resolution, frames));
  const double pivot = J.matrixLU().diagonal().cwiseAbs().minCoeff();
  if (!(pivot > kSmallPivot)) {
    return Singular("end effector", "the resolved 8x8 Jacobian is singular (smallest pivot)",
                    pivot);
  }
  const Vec3 rpy(c.rpy[0].p, c.rpy[1].p, c.rpy[2].p), rates(c.rpy[0].v, c.rpy[1].v, c.rpy[2].v);
  const Mat3 E = RateMatrix(rpy);
  Vec8 task;
  task << c.position[0].v, c.position[1].v, c.position[2].v, E * rates, c.gamma.v, c.resolved.v;
  AddTo(&Motion1::v, J.solve(task), planar, outer);

  // Accelerations: what is left after the velocity-dependent part.
  if (RunSummary s = SolveForward(geometry.planar, planar); !s.ok()) return s;
  ComputeFrames(geometry, *planar, *outer, &frames);
  const Vec3 accelerations(c.rpy[0].a, c.rpy[1].a, c.rpy[2].a);
  task << c.position[0].a, c.position[1].a, c.position[2].a,
      E * accelerations + RateMatrixDot(rpy, rates) * rates, c.gamma.a, c.resolved.a;
  AddTo(&Motion1::a, J.solve(task - TaskAcceleration(resolution, frames)), planar, outer);
  return SolveForward(geometry.planar, planar);
}

}  // namespace
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

std::unique_ptr<ClosedForm> MakeClosedForm(const Mechanism& mechanism, const Motion& motion,
                                           const ClosedFormOptions&, Diagnostics* diagnostics) {
  if (SpaceOf(motion) == Space::kNone) {
    std::string commanded;
    for (const Command& command : motion.commands) {
      commanded += (commanded.empty() ? "" : ", ") + command.name;
    }
    diagnostics->Add(
        {.severity = Severity::kError,
         .message = fmt::format("the cabin robot's equations cannot follow the commands {}",
                                commanded.empty() ? "(none)" : commanded),
         .hint = "command exactly eight: d1, th3, th4, d5, th6 with platform.x, platform.y, "
                 "platform.yaw or with X1, X2, X3; or tool.x ... tool.yaw with platform.yaw and "
                 "either d1 (rail given) or platform.y (height given)"});
  }
  if (diagnostics->has_errors()) return nullptr;
  return std::make_unique<CabinRobot>(mechanism, motion);
}

namespace {

// A quarter turn about x, α2, α3 and α5 of Table 1, and the slide's constant turn (α4, θ5).
Mat3 Twist() { return RotX(-EIGEN_PI / 2); }
Mat3 SlideTurn() { return Twist() * RotZ(-EIGEN_PI / 2); }

struct Link {
  std::string name, parent, child;
  JointKind kind;
  Vec3 p_parent, p_child;
  Mat3 R_zero;
  Vec3 axis;  ///< in the child's frame
};

void Add(const Link& link, Coverage* c) {
  const bool fixed = link.kind == JointKind::kFixed;
  c->joints.push_back({.name = link.name,
                       .kind = link.kind,
                       .parent = link.parent,
                       .child = link.child,
                       .p_parent = link.p_parent,
                       .p_child = link.p_child,
                       .axis_parent = fixed ? kAnyVector : Vec3(link.R_zero * link.axis),
                       .axis_child = fixed ? kAnyVector : link.axis,
                       .R_zero = link.R_zero});
}

// Rail and sliders.
void StateSliders(Coverage* c) {
  constexpr JointKind kPrismatic = JointKind::kPrismatic;
  const Vec3 zero = Vec3::Zero(), x = Vec3::UnitX(), z = Vec3::UnitZ();
  const Mat3 same = Mat3::Identity();
  for (const Link& link : {Link{"d1", "world", "carriage", kPrismatic, zero, zero, same, z},
                           Link{"X1", "carriage", "sliderA", kPrismatic, zero, zero, same, x},
                           Link{"X2", "carriage", "sliderD", kPrismatic, zero, zero, same, x},
                           Link{"X3", "carriage", "sliderF", kPrismatic, zero, zero, same, x}}) {
    Add(link, c);
  }
}

// The planar linkage; passive hinges turn about z from where x axes are parallel.
void StatePlane(const ParameterReader& read, Coverage* c) {
  constexpr JointKind kRevolute = JointKind::kRevolute;
  const Vec3 zero = Vec3::Zero(), x = Vec3::UnitX(), z = Vec3::UnitZ();
  const Mat3 same = Mat3::Identity();
  const double L1 = read("L1"), L2 = read("L2"), L3 = read("L3"), L4 = read("L4");
  for (const Link& link : {Link{"A", "sliderA", "AB", kRevolute, zero, zero, same, z},
                           Link{"D", "sliderD", "CD", kRevolute, zero, zero, same, z},
                           Link{"F", "sliderF", "EF", kRevolute, zero, zero, same, z},
                           Link{"B", "AB", "platform", kRevolute, L1 * x, -L2 / 2 * x, same, z},
                           Link{"C", "CD", "platform", kRevolute, L3 * x, L2 / 2 * x, same, z},
                           Link{"E", "EF", "AB", kRevolute, L4 * x, L1 / 2 * x, same, z}}) {
    Add(link, c);
  }
}

void StateWrist(const ParameterReader& read, Coverage* c) {
  constexpr JointKind kRevolute = JointKind::kRevolute;
  const Vec3 zero = Vec3::Zero(), x = Vec3::UnitX(), z = Vec3::UnitZ();
  const Vec3 shoulder(read("a2"), read("d3"), 0), bearing(0, read("d6"), 0);
  for (const Link& link :
       {Link{"th3", "platform", "support", kRevolute, shoulder, zero, Twist(), z},
        Link{"th4", "support", "flip", kRevolute, read("a3") * x, zero, Twist(), z},
        Link{"d5", "flip", "table", JointKind::kPrismatic, read("a4") * x, zero, SlideTurn(), z},
        Link{"th6", "table", "slewing", kRevolute, bearing, zero, Twist(), z},
        Link{"payload_mount", "slewing", "payload", JointKind::kFixed, zero, zero, Mat3::Identity(),
             z}}) {
    Add(link, c);
  }
}

// One of the two linkages: `suffix` of its links and hinges, `z` of its plane.
void StateElasticPlane(const ParameterReader& read, const std::string& suffix, double z,
                       Coverage* c) {
  constexpr JointKind kRevolute = JointKind::kRevolute;
  const Vec3 zero = Vec3::Zero(), x = Vec3::UnitX(), up = Vec3::UnitZ(), plane(0, 0, z);
  const Mat3 same = Mat3::Identity();
  const double L1 = read("L1"), L2 = read("L2"), L3 = read("L3"), L4 = read("L4");
  const std::string AB = "AB" + suffix, CD = "CD" + suffix, EF = "EF" + suffix;
  const Vec3 p_B = plane - L2 / 2 * x, p_C = plane + L2 / 2 * x;
  for (const Link& link : {Link{"A" + suffix, "sliderA", AB, kRevolute, plane, zero, same, up},
                           Link{"D" + suffix, "sliderD", CD, kRevolute, plane, zero, same, up},
                           Link{"F" + suffix, "sliderF", EF, kRevolute, plane, zero, same, up},
                           Link{"B" + suffix, AB, "platform", kRevolute, L1 * x, p_B, same, up},
                           Link{"C" + suffix, CD, "platform", kRevolute, L3 * x, p_C, same, up},
                           Link{"E" + suffix, EF, AB, kRevolute, L4 * x, L1 / 2 * x, same, up}}) {
    Add(link, c);
  }
}

void StateElasticWrist(const ParameterReader& read, Coverage* c) {
  constexpr JointKind kRevolute = JointKind::kRevolute, kFixed = JointKind::kFixed;
  const Vec3 zero = Vec3::Zero(), x = Vec3::UnitX(), z = Vec3::UnitZ();
  const Mat3 same = Mat3::Identity();
  Mat3 bearing;  // z6 along x4, x6 along z4
  bearing << 0, 0, 1, 0, -1, 0, 1, 0, 0;
  const Vec3 head(0, 0, read("d3")), end(0, read("d5"), 0);
  const Vec3 tip = (read("a4") + read("d6")) * x;
  for (const Link& link :
       {Link{"th3", "platform", "column", kRevolute, read("a2") * x, zero, Twist(), z},
        Link{"shoulder", "column", "arm", kFixed, head, zero, same, z},
        Link{"th4", "arm", "rail", kRevolute, read("a3") * x, zero, Twist(), z},
        Link{"slide", "rail", "tool", kFixed, end, zero, same, z},
        Link{"th6", "tool", "slewing", kRevolute, tip, zero, bearing, z}}) {
    Add(link, c);
  }
}

// A beam of rectangular section; b along its z axis, h along y.
void AddBeam(const ParameterReader& read, const std::string& name, const std::string& section,
             double length, Coverage* c) {
  const double b = read("b_" + section), h = read("h_" + section);
  const bool printed = read("torsion_printed", 0.0) != 0.0;
  const bool known = std::isfinite(b) && std::isfinite(h);
  c->beams.push_back({.name = name,
                      .length = length,
                      .section = {.area = b * h,
                                  .I_y = b * b * b * h / 12.0,
                                  .I_z = b * h * h * h / 12.0,
                                  .torsion = known ? TorsionConstant(b, h, printed) : kNan},
                      .youngs_modulus = read("E"),
                      .shear_modulus = read("G")});
}

void StateBeams(const ParameterReader& read, Coverage* c) {
  for (const std::string suffix : {"", "2"}) {
    AddBeam(read, "AB" + suffix + ".AE", "AB", read("L1") / 2, c);
    AddBeam(read, "AB" + suffix + ".EB", "AB", read("L1") / 2, c);
    AddBeam(read, "CD" + suffix, "CD", read("L3"), c);
    AddBeam(read, "EF" + suffix, "EF", read("L4"), c);
  }
  AddBeam(read, "column", "column", read("d3"), c);
  AddBeam(read, "arm", "arm", read("a3"), c);
  AddBeam(read, "rail", "rail", std::abs(read("d5")), c);
  AddBeam(read, "tool", "tool", read("a4") + read("d6"), c);
}

// The inverse problem's branch.
void StateAssembly(const Mechanism& mechanism, Coverage* c) {
  for (const char* link : {"AB", "CD", "EF"}) {
    const Vec3 along = HomeAxis(mechanism, link, 0);
    const double lean = link == std::string("AB") ? along.x() : -along.x();
    StateBranch(std::string("body ") + link, std::min(along.y(), lean),
                "AB leans right, CD and EF lean left, all upwards", c);
  }
}

}  // namespace

Coverage CoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the cabin robot";
  const ParameterReader read(mechanism, &c);
  for (const char* name : kBodyNames) {
    const std::string body = name;
    c.bodies.push_back({.name = body,
                        .mass = read("m_" + body),
                        .com = read.Vector("c_" + body),
                        .inertia = read.Vector("I_" + body).asDiagonal(),
                        .why = "the body frame's axes are principal axes"});
  }
  StateSliders(&c);
  StatePlane(read, &c);
  StateWrist(read, &c);
  StateAssembly(mechanism, &c);
  for (const char* drive : kDriveNames) c.drives.push_back({.name = drive, .joint = drive});
  c.outputs = {{.name = "platform", .body = "platform"}, {.name = "tool", .body = "slewing"}};
  return c;
}

Coverage StiffnessCoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the cabin robot's stiffness";
  const ParameterReader read(mechanism, &c);
  for (const char* body : {"carriage", "sliderA", "sliderD", "sliderF", "AB", "AB2", "CD", "CD2",
                           "EF", "EF2", "platform", "column", "arm", "rail", "tool", "slewing"}) {
    c.bodies.push_back({.name = body});
  }
  StateSliders(&c);
  const double w = read("w");
  StateElasticPlane(read, "", w / 2, &c);
  StateElasticPlane(read, "2", -w / 2, &c);
  StateElasticWrist(read, &c);
  StateBeams(read, &c);
  for (const char* drive : kDriveNames) {
    if (drive == std::string("d5")) continue;  // its length is the rail's
    c.drives.push_back(
        {.name = drive, .joint = drive, .stiffness = std::numeric_limits<double>::infinity()});
  }
  c.outputs = {{.name = "tool", .body = "slewing"}};
  return c;
}

}  // namespace mbv::cabin_robot
