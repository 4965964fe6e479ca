#include "analytic/scara_robot/closed_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "analytic/scara_robot/reactions.h"
#include "core/demand.h"
#include "core/spatial.h"
#include "mechanism/channels.h"

namespace mbv::scara {
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

}  // namespace mbv::scara
