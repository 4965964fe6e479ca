#include "analytic/cabin_robot/stiffness_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "analytic/stiffness_form_checks.h"

namespace mbv::cabin {
namespace {

constexpr std::array<const char*, kStiffBeams> kBeamNames = {"AB",  "CD",   "EF",  "column",
                                                             "arm", "rail", "tool"};
/// Beams of the model file in the order of ToolStiffness::elements.
constexpr std::array<const char*, kStiffElements> kElementNames = {
    "AB.AE", "AB.EB", "EF",     "CD",  "AB2.AE", "AB2.EB",
    "EF2",   "CD2",   "column", "arm", "rail",   "tool"};

/// Twists and wrenches in the paper's order → rotation or moment first.
Mat6 RotationFirst(const Mat6& M) {
  Mat6 result;
  result << M.bottomRightCorner<3, 3>(), M.bottomLeftCorner<3, 3>(), M.topRightCorner<3, 3>(),
      M.topLeftCorner<3, 3>();
  return result;
}

class CabinStiffness final : public StiffnessForm {
 public:
  CabinStiffness(const StiffnessParameters& parameters, LimbForm form, double d5,
                 std::vector<Drive> drives)
      : parameters_(parameters), form_(form), d5_(d5), drives_(std::move(drives)) {}

  StiffnessResult Evaluate(const PoseCoordinates& pose) const override {
    ToolStiffness tool;
    StiffnessResult result = Solve(pose, &tool);
    if (!result.summary.ok() || form_ == LimbForm::kAsPrinted) return result;
    result.shares.reserve(kStiffElements);
    for (int k = 0; k < kStiffElements; ++k) {
      const StiffElement& element = tool.elements[k];
      const Mat6 share = element.G.transpose() * element.C * element.G;
      result.shares.push_back({kElementNames[k], RotationFirst(Symmetric(share))});
    }
    return result;
  }

  StiffnessResult EvaluateMatrices(const PoseCoordinates& pose) const override {
    ToolStiffness tool;
    return Solve(pose, &tool);
  }

  bool IsWithinRanges(const PoseCoordinates& pose) const override {
    PlanarState s;
    s.X.p = pose.at("platform.x");
    s.Y.p = pose.at("platform.y");
    s.gamma.p = pose.at("platform.yaw");
    if (!SolveInverse(parameters_.planar, &s).ok()) return false;
    for (const Drive& drive : drives_) {
      const auto given = pose.find(drive.name);
      const double value = drive.name == "X1"    ? s.X1.p
                           : drive.name == "X2"  ? s.X2.p
                           : drive.name == "X3"  ? s.X3.p
                           : given != pose.end() ? given->second
                           : drive.name == "d5"  ? d5_
                                                 : kNan;  // moves nothing here
      if (value < drive.range.lower || value > drive.range.upper) return false;
    }
    return true;
  }

  std::vector<StiffnessIndex> indices() const override {
    return {{"c_x", "m/N", "displacement along world x per force along x"},
            {"c_y", "m/N", "displacement along world y per force along y"},
            {"c_z", "m/N", "displacement along world z per force along z"},
            {"c_rx", "rad/(N m)", "rotation about world x per moment about x"},
            {"c_ry", "rad/(N m)", "rotation about world y per moment about y"},
            {"c_rz", "rad/(N m)", "rotation about world z per moment about z"}};
  }

  void IndexValues(const StiffnessResult& result, std::span<double> values) const override {
    for (int k = 0; k < 6; ++k) values[k] = result.C((k + 3) % 6, (k + 3) % 6);
  }

 private:
  StiffnessResult Solve(const PoseCoordinates& pose, ToolStiffness* tool) const {
    const auto d5 = pose.find("d5");
    const StiffnessPose at{.X = pose.at("platform.x"),
                           .Y = pose.at("platform.y"),
                           .gamma = pose.at("platform.yaw"),
                           .th3 = pose.at("th3"),
                           .th4 = pose.at("th4"),
                           .d5 = d5 == pose.end() ? d5_ : d5->second};
    StiffnessResult result;
    result.summary = SolveStiffness(parameters_, at, form_, tool);
    if (!result.summary.ok()) return result;
    const bool printed = form_ == LimbForm::kAsPrinted;
    result.K = RotationFirst(printed ? tool->K : Symmetric(tool->K));
    result.C = RotationFirst(printed ? tool->C : Symmetric(tool->C));
    result.rank = 6;
    return result;
  }

  StiffnessParameters parameters_;
  LimbForm form_;
  double d5_ = kNan;  ///< of the model, where the pose does not give it
  std::vector<Drive> drives_;
};

PoseNames NamesOfPose(const Mechanism& mechanism) {
  PoseNames names{.needed = {"platform.x", "platform.y", "platform.yaw", "th3", "th4"},
                  .accepted = {"d1", "d5", "th6"},
                  .hint =
                      "the pose is platform.x, platform.y, platform.yaw, th3, th4 and d5; d1 "
                      "and th6 do not matter"};
  if (!mechanism.HasParameter("d5")) names.needed.emplace_back("d5");
  return names;
}

void CheckParameters(const Mechanism& mechanism, Diagnostics* diagnostics) {
  std::vector<std::string> positive = {"L1", "L2", "L3", "L4", "w", "E", "G"};
  for (const std::string beam : kBeamNames) {
    positive.push_back("b_" + beam);
    positive.push_back("h_" + beam);
  }
  const std::vector<std::string> others = {"a2", "d3", "a3", "a4", "d6"};
  CheckStiffnessParameters(mechanism, positive, others, diagnostics);
  for (const Drive& drive : mechanism.drives) {
    if (std::isinf(drive.stiffness)) continue;
    diagnostics->Add(
        {.file = {},
         .message =
             fmt::format("the servo of {} has the stiffness {:g}", drive.name, drive.stiffness),
         .hint = "the paper locks all drives: leave their compliance 0 for the closed form"});
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
  CheckPoseNames(mechanism, NamesOfPose(mechanism), pose, &findings);
  CheckParameters(mechanism, &findings);
  const int form = IndexOfModel(StiffnessModels(), model, &findings);
  diagnostics->Append(findings);
  if (findings.has_errors()) return nullptr;
  const double d5 = mechanism.HasParameter("d5") ? mechanism.ParameterValue("d5") : kNan;
  return std::make_unique<CabinStiffness>(StiffnessParametersOf(mechanism),
                                          form == 1 ? LimbForm::kAsPrinted : LimbForm::kCorrected,
                                          d5, mechanism.drives);
}

PoseCoordinates ExampleStiffnessPose() {
  return {{"d1", 0.5},           {"platform.x", 0.0}, {"platform.y", 0.36}, {"platform.yaw", 0.0},
          {"th3", EIGEN_PI / 2}, {"th4", 0.0},        {"th6", 0.0}};
}

std::vector<std::string> UsualStiffnessMaps() { return {"x=-0.1:0.1:81,y=0.25:0.45:81"}; }

}  // namespace mbv::cabin
