#include "analytic/cabin_robot/stiffness_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace mbv::cabin {
namespace {

constexpr std::array<const char*, 6> kNeeded = {"platform.x", "platform.y", "platform.yaw",
                                                "th3",        "th4",        "d5"};
constexpr std::array<const char*, 2> kAccepted = {"d1", "th6"};
constexpr const char* kPoseHint =
    "the pose is platform.x, platform.y, platform.yaw, th3, th4 and d5; d1 and th6 do not matter";

constexpr std::array<const char*, kStiffBeams> kBeamNames = {"AB",  "CD",   "EF",  "column",
                                                             "arm", "rail", "tool"};
/// Beams of the model file in the order of ToolStiffness::elements.
constexpr std::array<const char*, kStiffElements> kElementNames = {
    "AB.AE", "AB.EB", "EF",     "CD",  "AB2.AE", "AB2.EB",
    "EF2",   "CD2",   "column", "arm", "rail",   "tool"};

void AddError(Diagnostics* diagnostics, std::string message, std::string hint = {}) {
  diagnostics->Add({.file = {}, .message = std::move(message), .hint = std::move(hint)});
}

/// Twists and wrenches in the paper's order → rotation or moment first.
Mat6 RotationFirst(const Mat6& M) {
  Mat6 result;
  result << M.bottomRightCorner<3, 3>(), M.bottomLeftCorner<3, 3>(), M.topRightCorner<3, 3>(),
      M.topLeftCorner<3, 3>();
  return result;
}

Mat6 Symmetric(const Mat6& M) { return 0.5 * (M + M.transpose()); }

class CabinStiffness final : public StiffnessForm {
 public:
  CabinStiffness(const StiffnessParameters& parameters, LimbForm form, double d5)
      : parameters_(parameters), form_(form), d5_(d5) {}

  StiffnessResult Evaluate(const PoseCoordinates& pose) const override {
    const auto d5 = pose.find("d5");
    const StiffnessPose at{.X = pose.at("platform.x"),
                           .Y = pose.at("platform.y"),
                           .gamma = pose.at("platform.yaw"),
                           .th3 = pose.at("th3"),
                           .th4 = pose.at("th4"),
                           .d5 = d5 == pose.end() ? d5_ : d5->second};
    StiffnessResult result;
    ToolStiffness tool;
    result.summary = SolveStiffness(parameters_, at, form_, &tool);
    if (!result.summary.ok()) return result;
    const bool printed = form_ == LimbForm::kAsPrinted;
    result.K = RotationFirst(printed ? tool.K : Symmetric(tool.K));
    result.C = RotationFirst(printed ? tool.C : Symmetric(tool.C));
    result.rank = 6;
    if (printed) return result;
    result.shares.reserve(kStiffElements);
    for (int k = 0; k < kStiffElements; ++k) {
      const StiffElement& element = tool.elements[k];
      const Mat6 share = element.G.transpose() * element.C * element.G;
      result.shares.push_back({kElementNames[k], RotationFirst(Symmetric(share))});
    }
    return result;
  }

  std::vector<StiffnessIndex> indices() const override {
    return {{"c_x", "m/N", "displacement along world x per force along x"},
            {"c_y", "m/N", "displacement along world y per force along y"},
            {"c_z", "m/N", "displacement along world z per force along z"},
            {"c_rx", "rad/(N m)", "rotation about world x per moment about x"},
            {"c_ry", "rad/(N m)", "rotation about world y per moment about y"},
            {"c_rz", "rad/(N m)", "rotation about world z per moment about z"}};
  }

  std::vector<double> IndexValues(const StiffnessResult& result) const override {
    const Vec6 c = result.C.diagonal();
    return {c[3], c[4], c[5], c[0], c[1], c[2]};
  }

 private:
  StiffnessParameters parameters_;
  LimbForm form_;
  double d5_ = kNan;  ///< of the model, where the pose does not give it
};

template <typename Names>
bool Contains(const Names& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

void CheckPose(const Mechanism& mechanism, const PoseCoordinates& pose, Diagnostics* diagnostics) {
  for (const auto& [name, value] : pose) {
    if (Contains(kNeeded, name) || Contains(kAccepted, name)) continue;
    AddError(diagnostics,
             fmt::format("the stiffness of cabin_robot cannot take the coordinate \"{}\"", name),
             kPoseHint);
  }
  for (const std::string name : kNeeded) {
    if (pose.contains(name) || (name == "d5" && mechanism.HasParameter("d5"))) continue;
    AddError(diagnostics, fmt::format("{} is not given", name), kPoseHint);
  }
}

void CheckParameters(const Mechanism& mechanism, Diagnostics* diagnostics) {
  const auto check = [&](const std::string& name, bool positive) {
    if (!mechanism.HasParameter(name)) {
      AddError(diagnostics, fmt::format("the model has no parameter \"{}\"", name),
               "the stiffness of cabin_robot needs models/cabin_robot/elastic.yaml");
    } else if (const double value = mechanism.ParameterValue(name); positive && !(value > 0.0)) {
      AddError(diagnostics, fmt::format("{} = {:g} violates {} > 0", name, value, name));
    }
  };
  for (const char* name : {"L1", "L2", "L3", "L4", "w", "E", "G"}) check(name, true);
  for (const char* name : {"a2", "d3", "a3", "a4", "d6"}) check(name, false);
  for (const std::string beam : kBeamNames) {
    check("b_" + beam, true);
    check("h_" + beam, true);
  }
  for (const Drive& drive : mechanism.drives) {
    if (std::isinf(drive.stiffness)) continue;
    AddError(diagnostics,
             fmt::format("the servo of {} has the stiffness {:g}", drive.name, drive.stiffness),
             "the paper locks all drives: leave their compliance 0 for the closed form");
  }
}

}  // namespace

std::vector<std::string> StiffnessModels() { return {"corrected", "as_printed"}; }

StiffnessParameters StiffnessParametersOf(const Mechanism& mechanism) {
  const auto value = [&](const std::string& name) { return mechanism.ParameterValue(name); };
  StiffnessParameters p;
  p.planar = {value("L1"), value("L2"), value("L3"), value("L4")};
  p.wrist = {value("a2"), value("d3"), value("a3"), value("a4"), value("d6")};
  p.w = value("w");
  p.E = value("E");
  p.G = value("G");
  p.torsion_printed = mechanism.HasParameter("torsion_printed") && value("torsion_printed") != 0.0;
  for (int beam = 0; beam < kStiffBeams; ++beam) {
    const std::string name = kBeamNames[beam];
    p.sections[beam] = {value("b_" + name), value("h_" + name)};
  }
  return p;
}

std::unique_ptr<StiffnessForm> MakeStiffnessForm(const Mechanism& mechanism,
                                                 const PoseCoordinates& pose,
                                                 const std::string& model,
                                                 Diagnostics* diagnostics) {
  Diagnostics findings;
  CheckPose(mechanism, pose, &findings);
  CheckParameters(mechanism, &findings);
  if (!model.empty() && !Contains(StiffnessModels(), model)) {
    AddError(&findings, fmt::format("unknown model \"{}\"", model),
             fmt::format("models: {}", fmt::join(StiffnessModels(), ", ")));
  }
  diagnostics->Append(findings);
  if (findings.has_errors()) return nullptr;
  const double d5 = mechanism.HasParameter("d5") ? mechanism.ParameterValue("d5") : kNan;
  return std::make_unique<CabinStiffness>(
      StiffnessParametersOf(mechanism),
      model == "as_printed" ? LimbForm::kAsPrinted : LimbForm::kCorrected, d5);
}

}  // namespace mbv::cabin
