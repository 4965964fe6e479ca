#include "analytic/scara_robot/stiffness_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace mbv::scara {
namespace {

constexpr std::array<const char*, 4> kPoseNames = {"platform.x", "platform.y", "platform.z",
                                                   "platform.yaw"};
constexpr std::array<const char*, 12> kParameterNames = {
    "R", "r", "l1", "l2", "l3", "e", "d", "branch", "E", "nu", "section_diameter", "K_act"};

struct NamedModel {
  const char* name;
  PrintedForms printed;
};

const std::array<NamedModel, 10>& Models() {
  static const std::array<NamedModel, 10> models = {{
      {"corrected", {}},
      {"as_printed", AllAsPrinted()},
      {"printed_rss_rod_frame", {.rss_rod_frame = true}},
      {"printed_rss_passive", {.rss_passive = true}},
      {"printed_motor_axis", {.motor_axis = true}},
      {"printed_arm_frame", {.arm_frame = true}},
      {"printed_short_rod_frame", {.short_rod_frame = true}},
      {"printed_parallelogram", {.parallelogram = true}},
      {"printed_passive_columns", {.passive_columns = true}},
      {"printed_passive_axes", {.passive_axes = true}},
  }};
  return models;
}

void AddError(Diagnostics* diagnostics, std::string message, std::string hint = {}) {
  diagnostics->Add({.file = {}, .message = std::move(message), .hint = std::move(hint)});
}

void AddShare(const std::string& element, const Mat6& share, StiffnessResult* result) {
  result->shares.push_back({element, 0.5 * (share + share.transpose())});
}

class ScaraStiffness final : public StiffnessForm {
 public:
  ScaraStiffness(const StiffnessParameters& parameters, const PrintedForms& printed)
      : parameters_(parameters), printed_(printed) {
    for (int i = 0; i < kLimbs; ++i) {
      const std::string limb = LimbName(i);
      names_[i] =
          i < 2 ? std::vector<std::string>{limb + ".drive (servo)", limb + ".arm", limb + ".rod_a",
                                           limb + ".rod_b", limb + ".bar"}
                : std::vector<std::string>{limb + ".drive (servo)", limb + ".arm", limb + ".rod"};
    }
  }

  StiffnessResult Evaluate(const PoseCoordinates& pose) const override {
    Vec4 X;
    for (int c = 0; c < 4; ++c) X[c] = pose.at(kPoseNames[c]);
    StiffnessResult result;
    PlatformStiffness at;
    result.summary = SolveStiffness(parameters_, printed_, X, &at);
    result.K = at.K;
    result.C = at.C;
    result.rank = at.rank;
    if (!result.summary.ok()) return result;
    result.shares.reserve(16);
    for (int i = 0; i < kLimbs; ++i) AddLimbShares(at, i, &result);
    return result;
  }

  std::vector<StiffnessIndex> indices() const override {
    return {{"kappa_m", "1", "largest moment per unit displacement, (21); mixes N m/rad and N"},
            {"kappa_f", "1", "largest force per unit displacement, (21); mixes N/rad and N/m"},
            {"k_mr", "N m/rad", "largest moment per rotation, norm of K_mr in (16)"},
            {"k_mt", "N", "largest moment per displacement, norm of K_mt in (16)"},
            {"k_fr", "N/rad", "largest force per rotation, norm of K_fr in (16)"},
            {"k_ft", "N/m", "largest force per displacement, norm of K_ft in (16)"},
            {"c_rotation", "rad/(N m)", "largest rotation per moment"},
            {"c_translation", "m/N", "largest displacement per force"}};
  }

  std::vector<double> IndexValues(const StiffnessResult& result) const override {
    const StiffnessIndices k = IndicesOf(result.K, result.C);
    return {k.kappa_m, k.kappa_f, k.K_mr, k.K_mt, k.K_fr, k.K_ft, k.C_rotation, k.C_translation};
  }

 private:
  void AddLimbShares(const PlatformStiffness& at, int limb, StiffnessResult* result) const {
    // What the limb carries of the six unit wrenches on the platform.
    const Mat6 B = at.limbs[limb].K * at.C;
    size_t name = 0;
    for (int k = 0; k < at.springs[limb].count; ++k) {
      const MemberSpring& spring = at.springs[limb].springs[k];
      const Eigen::Matrix<double, Eigen::Dynamic, 6, 0, 6, 6> force = spring.J.transpose() * B;
      if (limb < 2 && spring.member == Member::kRods) {
        for (const int side : {1, -1}) {
          AddShare(names_[limb][name++], RodShare(at.position, limb, side, spring, force), result);
        }
        continue;
      }
      AddShare(names_[limb][name++], force.transpose() * spring.flexibility * force, result);
    }
  }

  /// One rod of a parallelogram, at `side` · d/2 along the bar, under the forces at D.
  template <typename Forces>
  Mat6 RodShare(const Position& at, int limb, int side, const MemberSpring& spring,
                const Forces& force) const {
    const Eigen::Matrix<double, 5, 6> bent = spring.flexibility * force;
    if (printed_.parallelogram) return 0.5 * force.transpose() * bent;
    // Deformation at D → the rod's tip; the rod turns freely about the normal h.
    const Vec3 &a = MotorAxis(limb), &w = at.eta[limb];
    const double cos_q = a.dot(w), sin_q = a.dot(w.cross(a.cross(w).normalized()));
    const double half = 0.5 * side * parameters_.d;
    Eigen::Matrix<double, 4, 5> tip;
    tip << 1, 0, 0, 0, 0,                      // rotation about w
        0, 0, 1, 0, 0,                         // rotation about q
        0, half * sin_q, 0, 1, 0,              // displacement along w
        -half * sin_q, 0, half * cos_q, 0, 1;  // displacement along h
    const Mat6 k = TipStiffness(parameters_, parameters_.geometry.l2);
    Eigen::Matrix4d own = Eigen::Matrix4d::Zero();
    own.diagonal() << k(0, 0), k(2, 2), k(3, 3), k(4, 4);
    own(1, 3) = own(3, 1) = k(2, 4);
    const Eigen::Matrix<double, 4, 6> deformation = tip * bent;
    return deformation.transpose() * own * deformation;
  }

  StiffnessParameters parameters_;
  PrintedForms printed_;
  std::array<std::vector<std::string>, kLimbs> names_;
};

void CheckPose(const PoseCoordinates& pose, Diagnostics* diagnostics) {
  const std::string hint = "the pose is platform.x, platform.y, platform.z and platform.yaw";
  for (const auto& [name, value] : pose) {
    if (std::find(kPoseNames.begin(), kPoseNames.end(), name) != kPoseNames.end()) continue;
    AddError(diagnostics,
             fmt::format("the stiffness of scara_robot cannot take the coordinate \"{}\"", name),
             hint);
  }
  for (const char* name : kPoseNames) {
    if (!pose.contains(name)) AddError(diagnostics, fmt::format("{} is not given", name), hint);
  }
}

void CheckParameters(const Mechanism& mechanism, Diagnostics* diagnostics) {
  for (const char* name : kParameterNames) {
    if (!mechanism.HasParameter(name)) {
      AddError(diagnostics, fmt::format("the model has no parameter \"{}\"", name),
               "the stiffness of scara_robot needs models/scara_robot/elastic.yaml");
    }
  }
  for (const char* name : {"l1", "l2", "l3", "e", "d", "E", "section_diameter", "K_act"}) {
    if (!mechanism.HasParameter(name)) continue;
    const double value = mechanism.ParameterValue(name);
    if (!(value > 0.0)) {
      AddError(diagnostics, fmt::format("{} = {:g} violates {} > 0", name, value, name));
    }
  }
}

}  // namespace

std::vector<std::string> StiffnessModels() {
  std::vector<std::string> names;
  for (const NamedModel& model : Models()) names.emplace_back(model.name);
  return names;
}

StiffnessParameters StiffnessParametersOf(const Mechanism& mechanism) {
  const auto value = [&](const char* name) { return mechanism.ParameterValue(name); };
  StiffnessParameters p;
  p.geometry.R = value("R");
  p.geometry.r = value("r");
  p.geometry.l1 = value("l1");
  p.geometry.l2 = value("l2");
  p.geometry.l3 = value("l3");
  p.geometry.e = value("e");
  p.geometry.branch = value("branch") < 0.0 ? -1.0 : 1.0;
  p.d = value("d");
  p.E = value("E");
  p.G = p.E / (2.0 * (1.0 + value("nu")));
  p.diameter = value("section_diameter");
  p.K_act = value("K_act");
  return p;
}

std::unique_ptr<StiffnessForm> MakeStiffnessForm(const Mechanism& mechanism,
                                                 const PoseCoordinates& pose,
                                                 const std::string& model,
                                                 Diagnostics* diagnostics) {
  Diagnostics findings;
  CheckPose(pose, &findings);
  CheckParameters(mechanism, &findings);
  const auto found = std::find_if(Models().begin(), Models().end(), [&](const NamedModel& m) {
    return model.empty() || model == m.name;  // the first is the default
  });
  if (found == Models().end()) {
    AddError(&findings, fmt::format("unknown model \"{}\"", model),
             fmt::format("models: {}", fmt::join(StiffnessModels(), ", ")));
  }
  diagnostics->Append(findings);
  if (findings.has_errors()) return nullptr;
  return std::make_unique<ScaraStiffness>(StiffnessParametersOf(mechanism), found->printed);
}

}  // namespace mbv::scara
