#include "analytic/scara_robot/stiffness_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "analytic/scara_robot/workspace.h"
#include "analytic/stiffness_form_checks.h"

namespace mbv::scara {
namespace {

constexpr std::array<const char*, 4> kPoseNames = {"platform.x", "platform.y", "platform.z",
                                                   "platform.yaw"};
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

void AddShare(const std::string& element, const Mat6& share, StiffnessResult* result) {
  result->shares.push_back({element, Symmetric(share)});
}

class ScaraStiffness final : public StiffnessForm {
 public:
  ScaraStiffness(const StiffnessParameters& parameters, const Limits& limits,
                 const PrintedForms& printed)
      : parameters_(parameters), limits_(limits), printed_(printed) {
    for (int i = 0; i < kLimbs; ++i) {
      const std::string limb = LimbName(i);
      names_[i] =
          i < 2 ? std::vector<std::string>{limb + ".drive (servo)", limb + ".arm", limb + ".rod_a",
                                           limb + ".rod_b", limb + ".bar"}
                : std::vector<std::string>{limb + ".drive (servo)", limb + ".arm", limb + ".rod"};
    }
  }

  StiffnessResult Evaluate(const PoseCoordinates& pose) const override {
    PlatformStiffness at;
    StiffnessResult result = Solve(pose, &at);
    if (!result.summary.ok()) return result;
    result.shares.reserve(16);
    for (int i = 0; i < kLimbs; ++i) AddLimbShares(at, i, &result);
    return result;
  }

  StiffnessResult EvaluateMatrices(const PoseCoordinates& pose) const override {
    PlatformStiffness at;
    return Solve(pose, &at);
  }

  bool IsWithinRanges(const PoseCoordinates& pose) const override {
    return CheckPose(parameters_.geometry, limits_, PlatformPose(pose)).reach == Reach::kReachable;
  }

  std::vector<StiffnessIndex> indices() const override {
    return {{"kappa_m", "mixed", "largest moment per unit displacement, (21); mixes N m/rad and N"},
            {"kappa_f", "mixed", "largest force per unit displacement, (21); mixes N/rad and N/m"},
            {"k_mr", "N m/rad", "largest moment per rotation, norm of K_mr in (16)"},
            {"k_mt", "N", "largest moment per displacement, norm of K_mt in (16)"},
            {"k_fr", "N/rad", "largest force per rotation, norm of K_fr in (16)"},
            {"k_ft", "N/m", "largest force per displacement, norm of K_ft in (16)"},
            {"c_rotation", "rad/(N m)", "largest rotation per moment"},
            {"c_translation", "m/N", "largest displacement per force"}};
  }

  void IndexValues(const StiffnessResult& result, std::span<double> values) const override {
    const StiffnessIndices k = IndicesOf(result.K, result.C);
    const std::array<double, 8> all = {k.kappa_m, k.kappa_f, k.K_mr,       k.K_mt,
                                       k.K_fr,    k.K_ft,    k.C_rotation, k.C_translation};
    std::copy(all.begin(), all.end(), values.begin());
  }

 private:
  static Vec4 PlatformPose(const PoseCoordinates& pose) {
    Vec4 X;
    for (int c = 0; c < 4; ++c) X[c] = pose.at(kPoseNames[c]);
    return X;
  }

  StiffnessResult Solve(const PoseCoordinates& pose, PlatformStiffness* at) const {
    StiffnessResult result;
    result.summary = SolveStiffness(parameters_, printed_, PlatformPose(pose), at);
    result.K = at->K;
    result.C = at->C;
    result.rank = at->rank;
    return result;
  }

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
  Limits limits_;
  PrintedForms printed_;
  std::array<std::vector<std::string>, kLimbs> names_;
};

void CheckAll(const Mechanism& mechanism, const PoseCoordinates& pose, Diagnostics* diagnostics) {
  const PoseNames names{.needed = {kPoseNames.begin(), kPoseNames.end()},
                        .accepted = {},
                        .hint = "the pose is platform.x, platform.y, platform.z and platform.yaw"};
  CheckPoseNames(mechanism, names, pose, diagnostics);
  const std::vector<std::string> positive = {"l1",   "l2", "l3", "e", "d", "E", "section_diameter",
                                             "K_act"};
  const std::vector<std::string> others = {"R", "r", "branch", "nu"};
  CheckStiffnessParameters(mechanism, positive, others, diagnostics);
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
  CheckAll(mechanism, pose, &findings);
  const int found = IndexOfModel(StiffnessModels(), model, &findings);
  diagnostics->Append(findings);
  if (findings.has_errors()) return nullptr;
  return std::make_unique<ScaraStiffness>(StiffnessParametersOf(mechanism), LimitsOf(mechanism),
                                          Models()[static_cast<size_t>(found)].printed);
}

PoseCoordinates ExampleStiffnessPose() {
  return {{"platform.x", -0.050},
          {"platform.y", -0.050},
          {"platform.z", -0.150},
          {"platform.yaw", 0.2}};
}

std::vector<std::string> UsualStiffnessMaps() {
  const std::string disc = "x=-0.1:0.1:101,y=-0.1:0.1:101,within=0.1,";
  return {disc + "z=-0.1,yaw_deg=0", disc + "z=-0.23,yaw_deg=0", disc + "z=-0.23,yaw_deg=45",
          disc + "z=-0.23,yaw_deg=-45"};
}

}  // namespace mbv::scara
