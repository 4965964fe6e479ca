#include "analytic/stabilizing_platform/stabilizing_platform.h"

#include <fmt/format.h>

#include "analytic/stabilizing_platform/command_map.h"
#include "analytic/stabilizing_platform/equations.h"
#include "analytic/stabilizing_platform/reaction_channels.h"
#include "core/spatial.h"
#include "mechanism/channels.h"

namespace mbv::stabilizing_platform {
namespace {

class StabilizingPlatform final : public ClosedForm {
 public:
  StabilizingPlatform(const Mechanism& mechanism, const PlatformParameters& parameters,
                      const CommandMap& map, std::vector<LoadPlace> loads, Model model,
                      SignInM sign)
      : map_(map),
        load_places_(std::move(loads)),
        equations_(parameters, map.pairs, model, sign),
        amplification_(parameters),
        prescribed_(static_cast<int>(mechanism.prescribed.size())),
        has_base_output_(mechanism.FindOutput("platform_in_base") >= 0) {
    loads_.reserve(load_places_.size());
    if (model != Model::kPaperText) reactions_ = ReactionChannelsOfLimbs(mechanism);
    MakeChannels();
  }

  [[nodiscard]] std::vector<Channel> extra_channels() const override { return channels_; }

  [[nodiscard]] RunSummary Kinematics(const CommandSample& command, DrivenSample* driven) override {
    PoseCommand pose;
    RunSummary summary = ReadCommand(map_, command, &pose);
    if (summary.ok()) summary = equations_.EvaluateKinematics(pose, &state_);
    if (!summary.ok()) {
      summary.time_s = command.time_s;
      return summary;
    }
    Fill(pose, driven);
    return summary;
  }

  [[nodiscard]] RunSummary Dynamics(const CommandSample& command,
                                    ClosedFormSample* sample) override {
    RunSummary summary = Kinematics(command, &sample->driven);
    if (!summary.ok()) return summary;
    CollectLoads(command);
    summary = equations_.EvaluateDynamics(loads_, &state_);
    if (!summary.ok()) {
      summary.time_s = command.time_s;
      return summary;
    }
    sample->force.resize(6);
    for (int i = 0; i < 6; ++i) {
      sample->force[map_.drives[i]] = state_.forces[i / 2].drive[i % 2];
    }
    sample->extra.resize(static_cast<Eigen::Index>(channels_.size()));
    FillExtra(sample->extra.data());
    return summary;
  }

 private:
  void MakeChannels() {
    channels_ = PoseChannels("platform", "world");
    if (has_base_output_) {
      for (Channel& channel : PoseChannels("platform_in_base", "lower_platform")) {
        channels_.push_back(std::move(channel));
      }
    }
    for (int i = 1; i <= 3; ++i) {
      const std::string limb = fmt::format("limb{}", i);
      channels_.push_back({limb + ".length", "m", ""});
      if (map_.pairs == DrivePairs::kSynchronous) {
        channels_.push_back({limb + ".amplification", "1", ""});
      }
      for (const char* c : {"X", "Y", "Z"}) {
        channels_.push_back({limb + ".f_" + c, "N", fmt::format("A_{}", i)});
      }
    }
    channels_.insert(channels_.end(), reactions_.channels().begin(), reactions_.channels().end());
  }

  void CollectLoads(const CommandSample& command) {
    loads_.clear();
    for (size_t k = 0; k < load_places_.size(); ++k) {
      if (load_places_[k].on_ship) continue;
      const LoadSample& load = command.loads[k];
      loads_.push_back({.limb = load_places_[k].limb,
                        .link = load_places_[k].link,
                        .p_BoQ_B = load.p_BoQ_B,
                        .in_body_axes = load.in_body_axes,
                        .force = load.force,
                        .moment = load.moment});
    }
  }

  void Fill(const PoseCommand& pose, DrivenSample* driven) const {
    const Eigen::Index n = 6 + prescribed_;
    for (VecX* v : {&driven->position, &driven->velocity, &driven->acceleration}) v->resize(n);
    auto set = [&](Eigen::Index row, const Jet& jet) {
      driven->position[row] = jet.value;
      driven->velocity[row] = jet.rate;
      driven->acceleration[row] = jet.acceleration;
    };
    for (int i = 0; i < 6; ++i) set(map_.drives[i], state_.limbs[i / 2].side[i % 2].R);
    set(6 + map_.prescribed[0], pose.roll);
    set(6 + map_.prescribed[1], pose.pitch);
    set(6 + map_.prescribed[2], pose.heave);
  }

  void FillExtra(double* values) const {
    auto write = [&](double value) { *values++ = value; };
    auto write_pose = [&](const Vec3& p, const Mat3& R) {
      const Vec3 rpy = RpyOf(R);
      for (int c = 0; c < 3; ++c) write(p[c]);
      for (int c = 0; c < 3; ++c) write(rpy[c]);
    };
    write_pose(state_.upper.p_EB, state_.upper.R_EB);
    if (has_base_output_) write_pose(state_.motion.p_op, state_.motion.R_op);
    for (int i = 0; i < 3; ++i) {
      write(state_.limbs[i].length.value);
      if (map_.pairs == DrivePairs::kSynchronous) write(amplification_(state_.limbs[i]));
      for (int c = 0; c < 3; ++c) write(state_.forces[i].on_platform[c]);
    }
    reactions_.Write(state_, values);
  }

  CommandMap map_;
  std::vector<LoadPlace> load_places_;
  PlatformEquations equations_;
  Amplification amplification_;
  int prescribed_ = 0;
  bool has_base_output_ = false;
  ReactionChannelsOfLimbs reactions_;
  std::vector<Channel> channels_;
  std::vector<BodyLoad> loads_;
  Evaluation state_;
};

}  // namespace

std::unique_ptr<ClosedForm> MakeClosedForm(const Mechanism& mechanism, const Motion& motion,
                                           const ClosedFormOptions& options,
                                           Diagnostics* diagnostics) {
  Diagnostics findings;
  const PlatformParameters parameters = ReadParameters(mechanism, &findings);
  const CommandMap map = MapCommands(mechanism, motion, &findings);
  std::vector<LoadPlace> loads = MapLoads(mechanism, motion, &findings);

  Model model = Model::kFull;
  if (options.model == "massless") {
    model = Model::kMassless;
  } else if (options.model == "paper_text") {
    model = Model::kPaperText;
  } else if (!options.model.empty() && options.model != "full") {
    findings.AddError("", fmt::format("analytic: model \"{}\" is unknown", options.model),
                      "full, massless or paper_text");
  }
  SignInM sign = SignInM::kCorrected;
  for (const std::string& erratum : options.as_printed) {
    if (erratum == "E2") {
      sign = SignInM::kPrinted;
      continue;
    }
    findings.AddError("", fmt::format("analytic: as_printed: \"{}\" is not offered", erratum),
                      "E2, the sign in M of equation (6)");
  }
  diagnostics->Append(findings);
  if (findings.has_errors()) return nullptr;
  return std::make_unique<StabilizingPlatform>(mechanism, parameters, map, std::move(loads), model,
                                               sign);
}

}  // namespace mbv::stabilizing_platform
