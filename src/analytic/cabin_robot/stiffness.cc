#include "analytic/cabin_robot/stiffness.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "analytic/stiffness_form.h"
#include "math/spatial.h"

namespace mbv::cabin_robot {
namespace {

constexpr double kPi = std::numbers::pi;
/// (z, θx, θy) among the six components.
constexpr std::array<int, 3> kAcross = {2, 3, 4};
constexpr std::array<int, 3> kInPlane = {0, 1, 5};

Mat3 Pick(const Mat6& C, const std::array<int, 3>& rows) { return C(rows, rows); }

/// Area and second moments of a section. [Liu 2025, after Eq. 54]
double Area(const RectSection& s) { return s.b * s.h; }
double AboutY(const RectSection& s) { return s.b * s.b * s.b * s.h / 12.0; }
double AboutZ(const RectSection& s) { return s.b * s.h * s.h * s.h / 12.0; }

/// A limb's end seen from K.
struct LimbEnd {
  Mat3 R;
  Vec3 r_W;
};

/// A beam of the series: axes, end and length.
struct SerialBeam {
  StiffBeam beam;
  Mat3 R;
  Vec3 p_end;
  double length;
};

/// Frames {3}, {4}, {6} from {2}. [Liu 2025, Table 1]
std::array<SerialBeam, 4> SerialBeams(const StiffnessParameters& parameters,
                                      const StiffnessPose& pose, Vec3* p_6) {
  const WristGeometry& g = parameters.wrist;
  const Mat3 R_2 = RotZ(pose.gamma);
  const Mat3 R_3 = R_2 * RotX(-kPi / 2) * RotZ(pose.th3);
  const Mat3 R_4 = R_3 * RotX(-kPi / 2) * RotZ(pose.th4);
  const Vec3 p_3 = Vec3(pose.X, pose.Y, 0.0) + R_2 * Vec3(g.a2, g.d3, 0.0);
  const Vec3 p_4 = p_3 + g.a3 * R_3.col(0);
  const Vec3 p_5 = p_4 + pose.d5 * R_4.col(1);
  *p_6 = p_5 + (g.a4 + g.d6) * R_4.col(0);

  const auto axes = [](const Vec3& x, const Vec3& z) {
    Mat3 R;
    R << x, z.cross(x), z;
    return R;
  };
  const Vec3 along_rail = (pose.d5 > 0.0 ? 1.0 : -1.0) * R_4.col(1);
  return {{{kBeamColumn, axes(R_3.col(2), R_3.col(1)), p_3, g.d3},
           {kBeamArm, axes(R_3.col(0), R_3.col(1)), p_4, g.a3},
           {kBeamRail, axes(along_rail, R_4.col(2)), p_5, std::abs(pose.d5)},
           {kBeamTool, axes(R_4.col(0), R_4.col(2)), *p_6, g.a4 + g.d6}}};
}

/// Forces in AE, EB and EF, each at its tip in its axes, per load at B in AB's axes.
void FillStrutLimbElements(const StiffnessParameters& parameters, const StrutLimb& limb, double psi,
                           StiffElement* AE, StiffElement* EB, StiffElement* EF) {
  const double L1 = parameters.planar.L1, cot = 1.0 / std::tan(psi), sine = std::sin(psi);
  AE->beam = EB->beam = kBeamAB;
  EF->beam = kBeamEF;
  AE->C = EB->C = BeamCompliance(parameters, kBeamAB, L1 / 2.0);
  EF->C = BeamCompliance(parameters, kBeamEF, parameters.planar.L4);
  EB->G = Mat6::Identity();

  // In the plane. AE: N = F_x + 2 cot ψ (F_y + M_z/L1), moment at E from B, none at the hinge A.
  AE->G.setZero();
  AE->G(0, 0) = 1.0;
  AE->G(0, 1) = 2.0 * cot;
  AE->G(0, 5) = 2.0 * cot / L1;
  AE->G(5, 1) = L1 / 2.0;
  AE->G(5, 5) = 1.0;
  AE->G.row(1) = -AE->G.row(5) / (L1 / 2.0);
  // EF: force along it only, (55).
  EF->G.setZero();
  EF->G(0, 1) = -2.0 / sine;
  EF->G(0, 5) = -2.0 / (L1 * sine);

  // Across it: the pin E moves by at_E · G · load and both AE and EF follow.
  const Mat3 follow = limb.at_E * limb.G;
  AE->G(kAcross, kAcross) = Mat3(limb.C_h.inverse() * follow);
  EF->G(kAcross, kAcross) = Mat3(limb.C_f.inverse() * limb.T.transpose() * follow);
}

/// Limb stiffnesses in own axes.
struct Limbs {
  Mat6 K_AB, K_CD;
};

Limbs LimbStiffnesses(const StiffnessParameters& parameters, const StrutLimb& limb, double psi,
                      LimbForm form) {
  if (form == LimbForm::kCorrected) {
    return {StrutLimbStiffness(limb), LinkLimbStiffness(parameters)};
  }
  return {PrintedLimbCompliance(parameters, psi - kPi / 2).inverse(),
          BeamCompliance(parameters, kBeamCD, parameters.planar.L3).inverse()};
}

/// The wrench on K that a wrench on {6} is: displacement of {6} per displacement of K, transposed.
Mat6 ToolTransform(const Vec3& r_W) {
  Mat6 T = Mat6::Identity();
  T.topRightCorner<3, 3>() = -Skew(r_W);
  return T;
}

}  // namespace

double TorsionConstant(double b, double h, bool printed) {
  if (b < h) std::swap(b, h);
  const double cube = b * h * h * h;
  if (printed) return cube * (1.0 / 3.0 - 0.21 * h / b);
  // I_t = b h³ [1/3 − (64/π⁵)(h/b) Σ tanh(nπb/2h)/n⁵], n odd; Σ 1/n⁵ = (31/32) ζ(5).
  constexpr double kZeta5 = 1.0369277551433699263;
  double sum = 31.0 / 32.0 * kZeta5;
  for (int n = 1; n < 25; n += 2) {
    sum -= 2.0 / (std::exp(n * kPi * b / h) + 1.0) / std::pow(n, 5);
  }
  return cube * (1.0 / 3.0 - 64.0 / std::pow(kPi, 5) * (h / b) * sum);
}

Mat6 BeamCompliance(const StiffnessParameters& parameters, StiffBeam beam, double L) {
  const RectSection& s = parameters.sections[beam];
  const double EA = parameters.E * Area(s), EI_y = parameters.E * AboutY(s);
  const double EI_z = parameters.E * AboutZ(s);
  const double GI_p = parameters.G * TorsionConstant(s.b, s.h, parameters.torsion_printed);
  Mat6 C = Mat6::Zero();
  C(0, 0) = L / EA;  // (54)
  C(1, 1) = L * L * L / (3.0 * EI_z);
  C(2, 2) = L * L * L / (3.0 * EI_y);
  C(3, 3) = L / GI_p;
  C(4, 4) = L / EI_y;
  C(5, 5) = L / EI_z;
  C(1, 5) = C(5, 1) = L * L / (2.0 * EI_z);
  C(2, 4) = C(4, 2) = -L * L / (2.0 * EI_y);
  return C;
}

double StrutForce(double L1, double theta, double F_x2, double M_z) {
  return 2.0 * F_x2 / std::cos(theta) - 2.0 * M_z / (L1 * std::cos(theta));  // (55)
}

StrutLimb StrutLimbCompliance(const StiffnessParameters& parameters, double alpha, double epsilon) {
  const PlanarGeometry& g = parameters.planar;
  const double psi = alpha + epsilon, cot = 1.0 / std::tan(psi), sine = std::sin(psi);
  const double EA_1 = parameters.E * Area(parameters.sections[kBeamAB]);
  const double EI_1 = parameters.E * AboutZ(parameters.sections[kBeamAB]);
  const double EA_4 = parameters.E * Area(parameters.sections[kBeamEF]);
  const double L1 = g.L1, strut = 4.0 * g.L4 / (EA_4 * sine * sine);

  // Limb AB, in the plane.
  StrutLimb limb;
  Mat3& C = limb.in_plane;
  C(0, 0) = L1 / EA_1;
  C(0, 1) = C(1, 0) = L1 * cot / EA_1;
  C(0, 2) = C(2, 0) = cot / EA_1;
  C(1, 1) = L1 * L1 * L1 / (12.0 * EI_1) + 2.0 * L1 * cot * cot / EA_1 + strut;
  C(1, 2) = C(2, 1) = 5.0 * L1 * L1 / (24.0 * EI_1) + 2.0 * cot * cot / EA_1 + strut / L1;
  C(2, 2) = 2.0 * L1 / (3.0 * EI_1) + 2.0 * cot * cot / (L1 * EA_1) + strut / (L1 * L1);

  // Limb AB, across the plane.
  limb.C_h = Pick(BeamCompliance(parameters, kBeamAB, L1 / 2.0), kAcross);
  limb.C_f = Pick(BeamCompliance(parameters, kBeamEF, g.L4), kAcross);
  const double phi = kPi - epsilon - alpha;
  limb.T << 1, 0, 0, 0, std::cos(phi), -std::sin(phi), 0, std::sin(phi), std::cos(phi);
  limb.G << 1, 0, 0, 0, 1, 0, -L1 / 2.0, 0, 1;
  limb.at_E = (limb.C_h.inverse() + limb.T * limb.C_f.inverse() * limb.T.transpose()).inverse();
  limb.out_of_plane = limb.C_h + limb.G.transpose() * limb.at_E * limb.G;
  return limb;
}

Mat6 StrutLimbStiffness(const StrutLimb& limb) {
  Mat6 K = Mat6::Zero();
  K.topLeftCorner<2, 2>() = limb.in_plane.topLeftCorner<2, 2>().inverse();
  K(kAcross, kAcross) = Mat3(limb.out_of_plane.inverse());
  return K;
}

Mat6 LinkLimbStiffness(const StiffnessParameters& parameters) {
  const Mat6 C = BeamCompliance(parameters, kBeamCD, parameters.planar.L3);
  Mat6 K = Mat6::Zero();
  K(0, 0) = 1.0 / C(0, 0);
  K(kAcross, kAcross) = Mat3(Pick(C, kAcross).inverse());
  return K;
}

Mat6 PrintedLimbCompliance(const StiffnessParameters& parameters, double theta) {
  const double L1 = parameters.planar.L1, tangent = std::tan(theta);
  const double EA = parameters.E * Area(parameters.sections[kBeamAB]);
  const double EI_z = parameters.E * AboutZ(parameters.sections[kBeamAB]);
  Mat6 C = BeamCompliance(parameters, kBeamAB, L1);
  C(0, 0) += 2.0 * L1 / EA;  // (60), (61)
  C(0, 5) += -2.0 / EA;
  C(1, 0) += 2.0 * L1 * L1 * L1 * tangent / (3.0 * EI_z);
  C(1, 5) += -L1 * L1 * tangent / EI_z;
  return C;
}

Mat6 LimbTransform(const Mat3& R, const Vec3& r_W) {
  Mat6 J;
  J << R, Skew(r_W) * R, Mat3::Zero(), R;  // (63)
  return J;
}

Mat6 LimbForceTransform(const Mat3& R, const Vec3& r_W) {
  Mat6 J;
  J << R, Mat3::Zero(), Skew(r_W) * R, R;  // (66)
  return J;
}

Mat6 BeamTransform(const Mat3& R, const Vec3& r_beam) {
  Mat6 J;
  J << R, -R * Skew(r_beam), Mat3::Zero(), R;  // (70)
  return J;
}

RunSummary SolveStiffness(const StiffnessParameters& parameters, const StiffnessPose& pose,
                          LimbForm form, ToolStiffness* result) {
  *result = ToolStiffness{};
  PlanarState& s = result->planar;
  s.X.p = pose.X;
  s.Y.p = pose.Y;
  s.gamma.p = pose.gamma;
  const PlanarGeometry& g = parameters.planar;
  if (RunSummary reach = SolveInverse(g, &s); !reach.ok()) return reach;
  const double psi = s.alpha.p + s.epsilon.p;

  // (62)–(68); per plane AB at B and CD at C.
  const StrutLimb limb = StrutLimbCompliance(parameters, s.alpha.p, s.epsilon.p);
  const Limbs limbs = LimbStiffnesses(parameters, limb, psi, form);
  const Vec3 half = g.L2 / 2.0 * RotZ(pose.gamma).col(0), out(0, 0, parameters.w / 2.0);
  const Mat3 R_AB = RotZ(s.alpha.p), R_CD = RotZ(kPi - s.beta.p);
  const std::array<LimbEnd, 4> ends = {
      {{R_AB, -half + out}, {R_CD, half + out}, {R_AB, -half - out}, {R_CD, half - out}}};
  result->K_platform.setZero();
  for (int i = 0; i < 4; ++i) {
    const Mat6& K = i % 2 == 0 ? limbs.K_AB : limbs.K_CD;
    result->K_platform += LimbForceTransform(ends[i].R, ends[i].r_W) * K *
                          LimbTransform(ends[i].R, ends[i].r_W).inverse();
  }

  // (69)–(75)
  Vec3 p_6;
  const std::array<SerialBeam, 4> beams = SerialBeams(parameters, pose, &p_6);
  const Mat6 T = ToolTransform(p_6 - Vec3(pose.X, pose.Y, 0.0));
  const Mat6 C_platform = result->K_platform.inverse();
  result->C = T * C_platform * T.transpose();
  for (int j = 0; j < 4; ++j) {
    StiffElement& element = result->elements[8 + j];
    element.beam = beams[j].beam;
    element.C = BeamCompliance(parameters, beams[j].beam, beams[j].length);
    element.G =
        BeamTransform(beams[j].R, beams[j].R.transpose() * (p_6 - beams[j].p_end)).transpose();
    result->C += element.G.transpose() * element.C * element.G;
  }
  result->K = result->C.inverse();
  if (form == LimbForm::kAsPrinted) return RunSummary::Done();

  // What each beam of the linkages carries.
  for (int i = 0; i < 4; ++i) {
    const Mat6& K = i % 2 == 0 ? limbs.K_AB : limbs.K_CD;
    const Mat6 load =
        K * LimbTransform(ends[i].R, ends[i].r_W).inverse() * C_platform * T.transpose();
    StiffElement* element = &result->elements[4 * (i / 2)];
    if (i % 2 == 0) {
      FillStrutLimbElements(parameters, limb, psi, element, element + 1, element + 2);
      for (int k = 0; k < 3; ++k) element[k].G *= load;
    } else {
      element[3] = {kBeamCD, BeamCompliance(parameters, kBeamCD, g.L3), load};
    }
  }
  return RunSummary::Done();
}

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
        {.message =
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

}  // namespace mbv::cabin_robot
