#include "analytic/scara_robot/stiffness.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "analytic/scara_robot/workspace.h"
#include "analytic/stiffness_form.h"

#include "math/spatial.h"

namespace mbv::scara_robot {
namespace {

/// Columns of J_p (unit axes, lengths over R) below this share of the largest are dependent; the
/// printed J_p is, exactly, at some poses.
constexpr double kPassiveRank = 1e-9;

/// The six columns of a member's tip Q: rotations about and displacements along x, y, z.
Columns TipColumns(const Vec3& x, const Vec3& y, const Vec3& z, const Vec3& p_PQ) {
  Columns J(6, 6);
  J << RotationScrew(x, p_PQ), RotationScrew(y, p_PQ), RotationScrew(z, p_PQ), TranslationScrew(x),
      TranslationScrew(y), TranslationScrew(z);
  return J;
}

void AddServo(const StiffnessParameters& parameters, const Vec3& axis, const Vec3& p_PA,
              LimbSprings* limb) {
  MemberSpring& servo = limb->springs[limb->count++];
  servo.member = Member::kServo;
  servo.J = RotationScrew(axis, p_PA);
  servo.flexibility = Square::Constant(1, 1, 1.0 / parameters.K_act);
}

/// A clamped member with its tip at Q.
void AddBeam(const StiffnessParameters& parameters, Member member, double length, const Columns& J,
             LimbSprings* limb) {
  MemberSpring& beam = limb->springs[limb->count++];
  beam.member = member;
  beam.J = J;
  beam.flexibility = Mat6(TipStiffness(parameters, length).inverse());
}

/// Limbs 1, 2. [Zhu 2019 §2.1.2]
LimbSprings ParallelogramLimb(const StiffnessParameters& parameters, const PrintedForms& printed,
                              const Position& at, int i) {
  const Parameters& g = parameters.geometry;
  const Vec3 &a = MotorAxis(i), &u = at.u[i], &w = at.eta[i];
  const Vec3 p_PA = g.R * Radial(i) - at.X.head<3>();
  const Vec3 p_PC = p_PA + g.l1 * u, p_PB = at.s[i], p_PD = p_PB + g.e * Vec3::UnitZ();
  const Vec3 h = a.cross(w).normalized(), q = w.cross(h);
  const Vec3 e = -Vec3::UnitZ();

  LimbSprings limb;
  AddServo(parameters, printed.motor_axis ? w : a, p_PA, &limb);
  const Vec3 g_u = u.cross(a), g_e = e.cross(a);
  AddBeam(parameters, Member::kArm, g.l1,
          printed.arm_frame ? TipColumns(u, g_u, a, p_PC) : TipColumns(u, a, g_u, p_PC), &limb);

  MemberSpring& rods = limb.springs[limb.count++];
  rods.member = Member::kRods;
  rods.J = TipColumns(w, h, q, p_PD).leftCols<5>();
  rods.flexibility = Mat5(ParallelogramStiffness(TipStiffness(parameters, g.l2), parameters.d,
                                                 a.dot(q), a.dot(w), printed.parallelogram)
                              .inverse());

  AddBeam(parameters, Member::kShortRod, g.e,
          printed.short_rod_frame ? TipColumns(e, g_e, a, p_PB) : TipColumns(e, a, g_e, p_PB),
          &limb);

  const Vec3& axis = printed.passive_axes ? w : a;
  limb.J_p.resize(6, printed.passive_columns ? 2 : 4);
  limb.J_p.leftCols<2>() << RotationScrew(axis, p_PC), RotationScrew(axis, p_PD);
  if (!printed.passive_columns) {
    limb.J_p.rightCols<2>() << TranslationScrew(q), RotationScrew(Vec3::UnitZ(), p_PB);
  }
  return limb;
}

/// Limbs 3, 4. [Zhu 2019 §2.1.1]
LimbSprings BallLimb(const StiffnessParameters& parameters, const PrintedForms& printed,
                     const Position& at, int i) {
  const Parameters& g = parameters.geometry;
  const Vec3 &a = MotorAxis(i), &u = at.u[i], &w = at.eta[i];
  const Vec3 p_PA = g.R * Radial(i) - at.X.head<3>();
  const Vec3 p_PC = p_PA + g.l1 * u, p_PB = at.s[i];
  const Vec3 y = (a - a.dot(w) * w).normalized();

  LimbSprings limb;
  AddServo(parameters, a, p_PA, &limb);
  const Vec3 g_u = u.cross(a);
  AddBeam(parameters, Member::kArm, g.l1, TipColumns(u, a, g_u, p_PC), &limb);
  const Vec3& y_rod = printed.rss_rod_frame ? a : y;
  const Vec3 h = w.cross(y_rod).normalized();
  AddBeam(parameters, Member::kRods, g.l3, TipColumns(w, y_rod, h, p_PB), &limb);

  // The ball at C turns about two axes (its spin about the rod is the one at B).
  limb.J_p.resize(6, 5);
  limb.J_p << RotationScrew(printed.rss_passive ? a : y, p_PC),
      RotationScrew(printed.rss_passive ? g_u : w.cross(y), p_PC), RotationScrew(w, p_PB),
      RotationScrew(y_rod, p_PB), RotationScrew(h, p_PB);
  return limb;
}

/// Factors of a twist that divide its displacements by `length`.
Vec6 Scale(double length) {
  Vec6 s;
  s << Vec3::Ones(), Vec3::Constant(1.0 / length);
  return s;
}

double Norm(const Eigen::Ref<const Eigen::Matrix<double, 3, Eigen::Dynamic>>& block) {
  const Mat3 square = block * block.transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(square, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[2]));
}

RunSummary SingularPlatform(const Vec4& X, int rank) {
  RunSummary summary;
  summary.stop = Stop::kSingular;
  summary.where = "platform";
  summary.names_where = true;
  summary.amount = rank;
  summary.unit = "1";
  summary.message = fmt::format(
      "the stiffness at ({:.3f}, {:.3f}, {:.3f}) mm, {:.3f} deg has rank {}: the platform moves "
      "with its drives held",
      1e3 * X[0], 1e3 * X[1], 1e3 * X[2], X[3] * 180.0 / std::numbers::pi, rank);
  return summary;
}

}  // namespace

PrintedForms AllAsPrinted() { return {true, true, true, true, true, true, true, true}; }

Mat6 TipStiffness(const StiffnessParameters& parameters, double l) {
  const double r = parameters.diameter / 2.0;
  const double A = std::numbers::pi * r * r, I = A * r * r / 4.0, I_x = 2.0 * I;
  const double EI = parameters.E * I;
  Mat6 k = Mat6::Zero();
  k(0, 0) = parameters.G * I_x / l;  // (12)
  k(1, 1) = k(2, 2) = 4.0 * EI / l;
  k(3, 3) = parameters.E * A / l;
  k(4, 4) = k(5, 5) = 12.0 * EI / (l * l * l);
  k(2, 4) = k(4, 2) = -6.0 * EI / (l * l);
  k(1, 5) = k(5, 1) = 6.0 * EI / (l * l);
  return k;
}

Mat5 ParallelogramStiffness(const Mat6& k, double d, double sin_q, double cos_q, bool as_printed) {
  const double s2 = d * d * sin_q * sin_q / 4.0, c2 = d * d * cos_q * cos_q / 4.0;
  const double sc = d * d * sin_q * cos_q / 4.0;  // d² sin(2 q̂)/8
  Mat5 K = Mat5::Zero();
  K(0, 0) = k(0, 0) + k(4, 4) * s2;
  K(0, 2) = K(2, 0) = as_printed ? k(4, 4) * sc : -k(4, 4) * sc;
  K(1, 1) = k(3, 3) * s2;
  K(2, 2) = k(2, 2) + k(4, 4) * c2;
  K(2, 4) = K(4, 2) = k(2, 4);
  K(3, 3) = k(3, 3);
  K(4, 4) = k(4, 4);
  return as_printed ? K : Mat5(2.0 * K);
}

LimbSprings SpringsOf(const StiffnessParameters& parameters, const PrintedForms& printed,
                      const Position& position, int limb) {
  return limb < 2 ? ParallelogramLimb(parameters, printed, position, limb)
                  : BallLimb(parameters, printed, position, limb);
}

Mat6 SpringCompliance(const LimbSprings& limb) {
  Mat6 S = Mat6::Zero();
  for (int k = 0; k < limb.count; ++k) {
    const MemberSpring& spring = limb.springs[k];
    S.noalias() += spring.J * spring.flexibility * spring.J.transpose();  // (13)
  }
  return S;
}

LimbStiffness StiffnessOf(const LimbSprings& limb, double length) {
  // Wrenches without work on the passive motions: the kernel of J_pᵀ, lengths over `length`.
  const Vec6 scale = Scale(length);
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6, 0, 5, 6>;
  Eigen::FullPivLU<Rows> lu(limb.J_p.cols(), 6);
  lu.setThreshold(kPassiveRank);
  lu.compute(limb.J_p.transpose() * scale.asDiagonal());
  const Columns W = scale.asDiagonal() * lu.kernel();

  // (13), (14)
  LimbStiffness result;
  result.rank = static_cast<int>(W.cols());
  const Square flexibility = W.transpose() * SpringCompliance(limb) * W;
  const Mat6 K = W * flexibility.inverse() * W.transpose();
  result.K = 0.5 * (K + K.transpose());  // symmetric to the last digit
  return result;
}

RunSummary SolveStiffness(const StiffnessParameters& parameters, const PrintedForms& printed,
                          const Vec4& X, PlatformStiffness* result) {
  result->K.setConstant(kNan);
  result->C.setConstant(kNan);
  result->rank = -1;
  const RunSummary reach = InversePosition(parameters.geometry, X, &result->position);
  if (!reach.ok()) return reach;

  result->K.setZero();
  for (int i = 0; i < kLimbs; ++i) {
    result->springs[i] = SpringsOf(parameters, printed, result->position, i);
    result->limbs[i] = StiffnessOf(result->springs[i], parameters.geometry.R);
    result->K += result->limbs[i].K;  // (15)
  }

  // Dimensionless but for a common unit: rotations, and displacements over R.
  const Vec6 units = Scale(1.0 / parameters.geometry.R);
  const Mat6 scaled = units.asDiagonal() * result->K * units.asDiagonal();
  Eigen::FullPivLU<Mat6> lu;
  lu.setThreshold(kRankDeficient * kRankDeficient);
  lu.compute(scaled);
  result->rank = static_cast<int>(lu.rank());
  if (result->rank < 6) return SingularPlatform(X, result->rank);
  const Mat6 inverse = lu.inverse();
  result->C = units.asDiagonal() * (0.5 * (inverse + inverse.transpose())) * units.asDiagonal();
  return RunSummary::Done();
}

StiffnessIndices IndicesOf(const Mat6& K, const Mat6& C) {
  StiffnessIndices index;
  index.kappa_m = Norm(K.topRows<3>());  // (21)
  index.kappa_f = Norm(K.bottomRows<3>());
  index.K_mr = Norm(K.topLeftCorner<3, 3>());
  index.K_mt = Norm(K.topRightCorner<3, 3>());
  index.K_fr = Norm(K.bottomLeftCorner<3, 3>());
  index.K_ft = Norm(K.bottomRightCorner<3, 3>());
  if (C.allFinite()) {
    index.C_rotation = Norm(C.topLeftCorner<3, 3>());
    index.C_translation = Norm(C.bottomRightCorner<3, 3>());
  }
  return index;
}

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
    const Eigen::Matrix<double, 5, 6> deflection = spring.flexibility * force;
    if (printed_.parallelogram) return 0.5 * force.transpose() * deflection;
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
    const Eigen::Matrix<double, 4, 6> deformation = tip * deflection;
    return deformation.transpose() * own * deformation;
  }

  StiffnessParameters parameters_;
  Limits limits_;
  PrintedForms printed_;
  std::array<std::vector<std::string>, kLimbs> names_;
};

void CheckAll(const Mechanism& mechanism, const PoseCoordinates& pose, Diagnostics* diagnostics) {
  const PoseNames names{.needed = {kPoseNames.begin(), kPoseNames.end()},
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

}  // namespace mbv::scara_robot
