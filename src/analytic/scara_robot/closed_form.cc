#include "analytic/scara_robot/closed_form.h"

#include <fmt/format.h>
#include <algorithm>
#include <numbers>

#include "analytic/scara_robot/dynamics.h"
#include "base/demand.h"
#include "math/spatial.h"
#include "mechanism/channels.h"

namespace mbv::scara_robot {
namespace {

constexpr std::array<int, 4> kTaskComponents = {0, 1, 2, 5};  // x, y, z, yaw of an output
constexpr std::array<const char*, 4> kTaskNames = {"x", "y", "z", "yaw"};
constexpr int kOutputChannels = 6, kSingularityChannels = 3, kLimbChannels = 3;

/// Where the four commanded coordinates are among the motion's commands.
struct CommandMap {
  bool in_joint_space = false;
  std::array<int, 4> command = {-1, -1, -1, -1};
};

/// External force at P and moment about z through P.
struct PlatformLoad {
  Vec3 F_P = Vec3::Zero();
  double M_z = 0.0;
};

class ScaraClosedForm final : public ClosedForm {
 public:
  ScaraClosedForm(const Mechanism& mechanism, const CommandMap& map, RodModel rod_model)
      : parameters_(ParametersOf(mechanism)),
        map_(map),
        rod_model_(rod_model),
        reactions_(mechanism),
        tracker_(parameters_) {}

  std::vector<Channel> extra_channels() const override {
    std::vector<Channel> channels = PoseChannels("platform", "world");
    channels.push_back({"singularity.s_min", "1", ""});
    channels.push_back({"singularity.det", "1", ""});
    channels.push_back({"singularity.near", "1", ""});
    for (int i = 0; i < kLimbs; ++i) {
      const std::string limb = LimbName(i);
      channels.push_back({limb + ".dead_point", "1", ""});
      channels.push_back({limb + ".rod_shear", "rad", ""});
      channels.push_back({limb + ".rod_tilt", "rad", ""});
    }
    channels.insert(channels.end(), reactions_.channels().begin(), reactions_.channels().end());
    return channels;
  }

  RunSummary Kinematics(const CommandSample& command, DrivenSample* driven) override {
    RunSummary summary = map_.in_joint_space ? FromDrives(command) : FromPlatform(command);
    if (!summary.ok()) {
      summary.time_s = command.time_s;
      return summary;
    }
    driven->position = position_.theta;
    driven->velocity = rates_.dtheta;
    driven->acceleration = rates_.ddtheta;
    return summary;
  }

  RunSummary Dynamics(const CommandSample& command, ClosedFormSample* sample) override {
    RunSummary summary = Kinematics(command, &sample->driven);
    if (!summary.ok()) return summary;
    const PlatformLoad load = Loads(command);
    sample->force = DriveTorques(parameters_, position_, rates_, load.F_P, load.M_z, rod_model_);
    FillExtra(load, &sample->extra);
    return summary;
  }

 private:
  Vec4 Pick(const VecX& values) const {
    return {values[map_.command[0]], values[map_.command[1]], values[map_.command[2]],
            values[map_.command[3]]};
  }

  RunSummary FromPlatform(const CommandSample& command) {
    RunSummary summary = InversePosition(parameters_, Pick(command.position), &position_);
    if (!summary.ok()) return summary;
    if (summary = CheckPose(command.time_s); !summary.ok()) return summary;
    rates_.dX = Pick(command.velocity);
    rates_.ddX = Pick(command.acceleration);
    DriveRates(parameters_, position_, &rates_);
    return summary;
  }

  RunSummary FromDrives(const CommandSample& command) {
    if (command.time_s < last_time_s_) tracker_.Restart();
    RunSummary summary = tracker_.Follow(Pick(command.position), &position_);
    if (!summary.ok()) return summary;
    if (summary = CheckPose(command.time_s); !summary.ok()) return summary;
    rates_.dtheta = Pick(command.velocity);
    rates_.ddtheta = Pick(command.acceleration);
    PlatformRates(parameters_, position_, &rates_);
    return summary;
  }

  /// Rank deficient now, or passed a singular pose since the sample before.
  RunSummary CheckPose(double time_s) {
    singularity_ = Measure(parameters_, position_);
    RunSummary summary = CheckRegular(position_, singularity_);
    if (!summary.ok()) return summary;
    if (time_s > last_time_s_ && last_det_ * singularity_.det < 0.0) {
      summary = Crossed();
    }
    last_time_s_ = time_s;
    last_det_ = singularity_.det;
    return summary;
  }

  [[nodiscard]] RunSummary Crossed() const {
    return {.stop = Stop::kSingular,
            .message = fmt::format(
                "the path crosses a singular pose before ({:.3f}, {:.3f}, {:.3f}) mm, {:.3f} deg: "
                "the determinant of the direct Jacobian has changed its sign since {:.6g} s",
                1e3 * position_.X[0], 1e3 * position_.X[1], 1e3 * position_.X[2],
                position_.X[3] * 180.0 / std::numbers::pi, last_time_s_),
            .where = "platform",
            .amount = singularity_.s_min,
            .unit = "1"};
  }

  PlatformLoad Loads(const CommandSample& command) const {
    PlatformLoad sum;
    const Mat3 R_WP = RotZ(position_.X[3]);
    for (const LoadSample& load : command.loads) {
      const Vec3 F_W = load.in_body_axes ? Vec3(R_WP * load.force) : load.force;
      const Vec3 p_PQ_W = R_WP * load.p_BoQ_B;
      sum.F_P += F_W;
      sum.M_z += load.moment.z() + p_PQ_W.x() * F_W.y() - p_PQ_W.y() * F_W.x();
    }
    return sum;
  }

  void FillExtra(const PlatformLoad& load, VecX* extra) const {
    constexpr int kKinematic = kOutputChannels + kSingularityChannels + kLimbs * kLimbChannels;
    extra->resize(kKinematic + static_cast<Eigen::Index>(reactions_.channels().size()));
    extra->head<kOutputChannels>() << position_.X.head<3>(), 0.0, 0.0, position_.X[3];
    (*extra)[kOutputChannels] = singularity_.s_min;
    (*extra)[kOutputChannels + 1] = singularity_.det;
    (*extra)[kOutputChannels + 2] = singularity_.s_min < kNearlySingular ? 1.0 : 0.0;
    for (int i = 0; i < kLimbs; ++i) {
      extra->segment<kLimbChannels>(kOutputChannels + kSingularityChannels + kLimbChannels * i)
          << position_.V[i],
          RodShear(position_, i), RodTilt(position_, i);
    }
    reactions_.Write(parameters_, position_,
                     JointForces(parameters_, position_, rates_, load.F_P, load.M_z, rod_model_),
                     extra->data() + kKinematic);
  }

  Parameters parameters_;
  CommandMap map_;
  RodModel rod_model_;
  ReactionChannelsOfLimbs reactions_;
  ForwardTracker tracker_;
  Position position_;
  Rates rates_;
  Singularity singularity_;
  double last_time_s_ = -std::numeric_limits<double>::infinity();
  double last_det_ = 0.0;
};

/// Finds the four commanded coordinates, or explains what does not suit.
CommandMap MapCommands(const Mechanism& mechanism, const Motion& motion, Diagnostics* diagnostics) {
  const int output = mechanism.FindOutput("platform");
  CommandMap map;
  std::array<int, 4> drives = {-1, -1, -1, -1}, task = {-1, -1, -1, -1};
  for (size_t c = 0; c < motion.commands.size(); ++c) {
    const Command& command = motion.commands[c];
    const Coordinate& coordinate = command.terms.front().coordinate;
    const bool plain = command.terms.size() == 1 && command.terms.front().factor == 1.0;
    if (plain && coordinate.kind == Coordinate::Kind::kDrive && coordinate.index < kLimbs) {
      drives[coordinate.index] = static_cast<int>(c);
      continue;
    }
    const auto at = std::find(kTaskComponents.begin(), kTaskComponents.end(), coordinate.component);
    if (plain && coordinate.kind == Coordinate::Kind::kOutput && coordinate.index == output &&
        at != kTaskComponents.end()) {
      task[at - kTaskComponents.begin()] = static_cast<int>(c);
      continue;
    }
    diagnostics->AddError(
        "",
        fmt::format("the closed form of scara_robot cannot take the command \"{}\"", command.name),
        "command all four drives, or platform.x, platform.y, platform.z and platform.yaw");
  }
  const auto given = [](const std::array<int, 4>& commands) {
    return std::count_if(commands.begin(), commands.end(), [](int c) { return c >= 0; });
  };
  map.in_joint_space = given(drives) > 0;
  map.command = map.in_joint_space ? drives : task;
  if (given(drives) > 0 && given(task) > 0) {
    diagnostics->AddError("", "drives and platform coordinates are both commanded",
                          "use either the four drives or the four platform coordinates");
  }
  for (int i = 0; i < kLimbs; ++i) {
    if (map.command[i] >= 0) continue;
    diagnostics->AddError(
        "", fmt::format("{} is not commanded", map.in_joint_space
                                                   ? mechanism.drives[i].name
                                                   : std::string("platform.") + kTaskNames[i]));
  }
  return map;
}

}  // namespace

std::unique_ptr<ClosedForm> MakeClosedForm(const Mechanism& mechanism, const Motion& motion,
                                           const ClosedFormOptions& options,
                                           Diagnostics* diagnostics) {
  MBV_DEMAND(mechanism.drives.size() == kLimbs, mechanism.drives.size());
  Diagnostics findings;
  const CommandMap map = MapCommands(mechanism, motion, &findings);
  const int platform = mechanism.FindBody("platform");
  for (const Load& load : motion.loads) {
    if (load.body == platform) continue;
    findings.AddError(
        "",
        fmt::format("the closed form of scara_robot cannot take the load \"{}\" on {}", load.name,
                    mechanism.bodies[load.body].name),
        "loads act on the platform only");
  }
  if (!mechanism.springs.empty()) {
    findings.AddError("", "the closed form of scara_robot has no springs");
  }
  const RodModel rod_model = options.model == "thin_rods" ? RodModel::kThin : RodModel::kFull;
  if (!options.model.empty() && options.model != "full" && options.model != "thin_rods") {
    findings.AddError("", fmt::format("unknown model \"{}\"", options.model),
                      "models: full, thin_rods");
  }
  for (const std::string& erratum : options.as_printed) {
    findings.AddError("", fmt::format("no printed form \"{}\" to run", erratum),
                      "the printed equations are measured by the equation audit");
  }
  diagnostics->Append(findings);
  if (findings.has_errors()) return nullptr;
  return std::make_unique<ScaraClosedForm>(mechanism, map, rod_model);
}

namespace {

constexpr JointKind kRevolute = JointKind::kRevolute, kSpherical = JointKind::kSpherical;
const Vec3 kX = Vec3::UnitX(), kY = Vec3::UnitY(), kZ = Vec3::UnitZ();

std::string Named(int limb, const char* part) { return std::string(LimbName(limb)) + part; }

void AddPassive(const std::string& name, JointKind kind, const std::string& parent,
                const std::string& child, const Vec3& p_parent, const Vec3& p_child,
                const Vec3& axis_parent, const Vec3& axis_child, Coverage* c) {
  c->joints.push_back({.name = name,
                       .kind = kind,
                       .parent = parent,
                       .child = child,
                       .p_parent = p_parent,
                       .p_child = p_child,
                       .axis_parent = axis_parent,
                       .axis_child = axis_child,
                       .reversible = true});
}

void AddBall(const std::string& name, const std::string& parent, const std::string& child,
             const Vec3& p_parent, const Vec3& p_child, Coverage* c) {
  AddPassive(name, kSpherical, parent, child, p_parent, p_child, kAnyVector, kAnyVector, c);
}

void AddMotor(const ParameterReader& read, int limb, double stiffness, Coverage* c) {
  const double alpha = limb * EIGEN_PI / 2;
  c->joints.push_back({.name = Named(limb, ".motor"),
                       .kind = kRevolute,
                       .parent = "world",
                       .child = Named(limb, ".arm"),
                       .p_parent = read("R") * Radial(limb),
                       .p_child = Vec3::Zero(),
                       .axis_parent = MotorAxis(limb),
                       .axis_child = kY,
                       .R_zero = RotZ(alpha)});
  c->drives.push_back(
      {.name = Named(limb, ".drive"), .joint = Named(limb, ".motor"), .stiffness = stiffness});
}

Mat3 Bar(const BarInertia& inertia) {
  return Vec3(inertia.axial, inertia.transverse, inertia.transverse).asDiagonal();
}

// The platform without the pivots that are booked on the bars at B_1 and B_2.
void StatePlatform(const ParameterReader& read, Coverage* c) {
  const double m_p = read("m_p"), pivot = read("pivot_mass", 0.0), r = read("r");
  const double m = m_p - 2 * pivot, com = -pivot * r / m;
  Mat3 I = kAnyMatrix;
  I(2, 2) = read("I_p_z") - 2 * pivot * r * r - 2 * m * com * com;
  c->bodies.push_back({.name = "platform",
                       .mass = m,
                       .com = Vec3(com, com, kNan),
                       .inertia = I,
                       .why = "with the pivots its centre of mass is at P, over it or under it"});
}

void StateArm(const ParameterReader& read, int limb, Coverage* c) {
  const double l1 = read("l1"), mass = read("m_arm");
  Mat3 I = kAnyMatrix;
  I(1, 1) = SolidBar(mass, read("arm_radius"), l1).transverse;
  c->bodies.push_back({.name = Named(limb, ".arm"),
                       .mass = mass,
                       .com = Vec3(read("arm_com") * l1, kNan, 0),
                       .inertia = I,
                       .why = "a round bar with its centre of mass at arm_com of its length",
                       .takes_loads = false});
}

// Rods of a parallelogram without the balls that are booked on the bar, and the bar, which does
// not turn.
void StateParallelogram(const ParameterReader& read, int limb, Coverage* c) {
  const double l2 = read("l2"), half = read("m_rods") / 2, ball = read("ball_mass", 0.0);
  const double m = half - ball, com = (half / 2 - ball) * l2 / m;
  BarInertia inertia = SolidBar(half, read("rod_radius"), l2);
  inertia.transverse += half * (l2 / 2 - com) * (l2 / 2 - com) - ball * (l2 - com) * (l2 - com);
  for (const char* rod : {".rod_a", ".rod_b"}) {
    c->bodies.push_back({.name = Named(limb, rod),
                         .mass = m,
                         .com = com * kX,
                         .inertia = Bar(inertia),
                         .why = "with its ball a round bar with its centre of mass in the middle",
                         .takes_loads = false});
  }
  c->bodies.push_back({.name = Named(limb, ".bar"),
                       .mass = 2 * ball + read("pivot_mass", 0.0),
                       .why = "two balls and a pivot; the bar does not turn",
                       .takes_loads = false});
}

void StateParallelogramJoints(const ParameterReader& read, int limb, Coverage* c) {
  const std::string arm = Named(limb, ".arm"), bar = Named(limb, ".bar"),
                    rod_a = Named(limb, ".rod_a"), rod_b = Named(limb, ".rod_b");
  const double l1 = read("l1"), l2 = read("l2");
  const Vec3 half = read("d") / 2 * kY, D = read("r") * Radial(limb) + read("e") * kZ;
  AddPassive(Named(limb, ".pivot"), kRevolute, "platform", bar, D, Vec3::Zero(), kZ, kZ, c);
  AddPassive(Named(limb, ".cross_bar"), JointKind::kPlanar, rod_a, rod_b, l2 / 2 * kX, l2 / 2 * kX,
             kZ, kZ, c);
  AddBall(Named(limb, ".ball_C_a"), rod_a, arm, Vec3::Zero(), l1 * kX + half, c);
  AddBall(Named(limb, ".ball_C_b"), rod_b, arm, Vec3::Zero(), l1 * kX - half, c);
  AddBall(Named(limb, ".ball_D_a"), rod_a, bar, l2 * kX, half, c);
  AddBall(Named(limb, ".ball_D_b"), rod_b, bar, l2 * kX, -half, c);
}

void StateRod(const ParameterReader& read, int limb, Coverage* c) {
  const double l3 = read("l3"), mass = read("m_rods");
  c->bodies.push_back({.name = Named(limb, ".rod"),
                       .mass = mass,
                       .com = l3 / 2 * kX,
                       .inertia = Bar(SolidBar(mass, read("rod_radius"), l3)),
                       .why = "a round bar with its centre of mass in the middle",
                       .takes_loads = false});
}

void StateRodJoints(const ParameterReader& read, int limb, Coverage* c) {
  const std::string rod = Named(limb, ".rod");
  AddPassive(Named(limb, ".wrist"), JointKind::kUniversal, Named(limb, ".arm"), rod,
             read("l1") * kX, Vec3::Zero(), kY, kZ, c);
  AddBall(Named(limb, ".ball_B"), rod, "platform", read("l3") * kX, read("r") * Radial(limb), c);
}

void AddCoveredBeam(const ParameterReader& read, const std::string& name, double length,
                    Coverage* c) {
  const double r = read("section_diameter") / 2, E = read("E");
  const double area = EIGEN_PI * r * r, I = area * r * r / 4;
  c->beams.push_back({.name = name,
                      .length = length,
                      .section = {.area = area, .I_y = I, .I_z = I, .torsion = 2 * I},
                      .youngs_modulus = E,
                      .shear_modulus = E / (2 * (1 + read("nu")))});
}

// R-Pa-R of the elastic model: hubs in the plane of the parallelogram, the short rod below.
void StateElasticParallelogram(const ParameterReader& read, int limb, Coverage* c) {
  const std::string arm = Named(limb, ".arm"), hub_C = Named(limb, ".hub_C"),
                    rod_a = Named(limb, ".rod_a"), rod_b = Named(limb, ".rod_b"),
                    hub_D = Named(limb, ".hub_D"), bar = Named(limb, ".bar");
  for (const std::string& body : {arm, hub_C, rod_a, rod_b, hub_D, bar}) {
    c->bodies.push_back({.name = body});
  }
  const Vec3 zero = Vec3::Zero(), half = read("d") / 2 * kY, tip = read("l2") * kX;
  const auto hinge = [&](const char* name, const std::string& parent, const std::string& child,
                         const Vec3& p_parent, const Vec3& p_child, const Vec3& axis) {
    AddPassive(Named(limb, name), kRevolute, parent, child, p_parent, p_child, axis, axis, c);
  };
  hinge(".hinge_C", arm, hub_C, read("l1") * kX, zero, kY);
  hinge(".hinge_C_a", hub_C, rod_a, half, zero, kZ);
  hinge(".hinge_C_b", hub_C, rod_b, -half, zero, kZ);
  hinge(".hinge_D_a", rod_a, hub_D, tip, half, kZ);
  hinge(".hinge_D_b", rod_b, hub_D, tip, -half, kZ);
  hinge(".hinge_D", hub_D, bar, zero, zero, kY);
  hinge(".pivot", bar, "platform", -read("e") * kZ, read("r") * Radial(limb), kZ);
  for (const std::string& rod : {rod_a, rod_b}) AddCoveredBeam(read, rod, read("l2"), c);
  AddCoveredBeam(read, bar, read("e"), c);
}

}  // namespace

Coverage CoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the SCARA robot";
  const ParameterReader read(mechanism, &c);
  for (const char* name : {"home_x", "home_y", "home_z", "home_phi"}) (void)read(name);
  StatePlatform(read, &c);
  const double branch = read("branch") < 0.0 ? -1.0 : 1.0;
  for (int limb = 0; limb < kLimbs; ++limb) {
    AddMotor(read, limb, kNan, &c);
    // V_i: the arm turns towards its z axis reversed.
    const std::string rod = Named(limb, limb < 2 ? ".rod_a" : ".rod");
    StateBranch(
        "body " + rod,
        -branch * HomeAxis(mechanism, rod, 0).dot(HomeAxis(mechanism, Named(limb, ".arm"), 2)),
        "the sign in (10) that the parameter branch chooses", &c);
    StateArm(read, limb, &c);
    if (limb < 2) {
      StateParallelogram(read, limb, &c);
      StateParallelogramJoints(read, limb, &c);
    } else {
      StateRod(read, limb, &c);
      StateRodJoints(read, limb, &c);
    }
  }
  c.outputs = {{.name = "platform", .body = "platform"}};
  return c;
}

Coverage StiffnessCoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the SCARA robot's stiffness";
  const ParameterReader read(mechanism, &c);
  (void)read("branch");
  c.bodies.push_back({.name = "platform"});
  for (int limb = 0; limb < kLimbs; ++limb) {
    AddMotor(read, limb, read("K_act"), &c);
    AddCoveredBeam(read, Named(limb, ".arm"), read("l1"), &c);
    if (limb < 2) {
      StateElasticParallelogram(read, limb, &c);
      continue;
    }
    c.bodies.push_back({.name = Named(limb, ".arm")});
    c.bodies.push_back({.name = Named(limb, ".rod")});
    AddCoveredBeam(read, Named(limb, ".rod"), read("l3"), &c);
    StateRodJoints(read, limb, &c);
  }
  c.outputs = {{.name = "platform", .body = "platform"}};
  return c;
}

}  // namespace mbv::scara_robot
