#include <array>
#include <cmath>
#include <numbers>

#include "analytic/cabin_robot/closed_form.h"
#include "analytic/cabin_robot/stiffness.h"
#include "base/demand.h"
#include "features/equation_audit/audit.h"
#include "features/equation_audit/cabin_robot_audit.h"
#include "features/equation_audit/stiffness_truth.h"
#include "math/spatial.h"
#include "reference/reference.h"

namespace mbv::cabin_audit {
namespace {

constexpr double kForceLimit =
    1e-8;  // of up to 4 kN; closure 1e-13 m and conditioning of the loops

AuditRow DynamicsTexts(const char* equation, const char* printed, const char* corrected,
                       const char* note) {
  return TextRow(equation, printed, corrected, "N, N m", kForceLimit, note);
}

// Harmonic motion of all eight drives around a regular pose.
Motion HarmonicMotion(const Mechanism& mechanism) {
  const std::array<const char*, 8> names = {"d1", "X1", "X2", "X3", "th3", "th4", "d5", "th6"};
  const std::array<double, 8> centre = {0.5, -0.60, 0.575, -0.18, 0.9, -0.5, -0.2, 0.3};
  const std::array<double, 8> amplitude = {0.2, 0.03, 0.03, 0.02, 0.5, 0.3, 0.1, 0.8};
  Motion motion;
  motion.duration_s = 2.0;
  for (int k = 0; k < 8; ++k) {
    Command command;
    command.name = names[k];
    command.terms.push_back({{Coordinate::Kind::kDrive, mechanism.FindDrive(names[k]), 0}, 1.0});
    command.profile.terms = {ConstantTerm{centre[k]},
                             SineTerm{amplitude[k], 0.5 + 0.1 * k, 0.3 * k}};
    motion.commands.push_back(command);
  }
  return motion;
}

Load ToolLoad(const Mechanism& mechanism) {
  Load load;
  load.name = "tool";
  load.body = mechanism.FindBody("slewing");
  load.force = {Constant(60.0), Constant(-80.0), Constant(100.0)};
  load.moment = {Constant(5.0), Constant(-4.0), Constant(3.0)};
  return load;
}

VecX ClosedFormForces(const Mechanism& mechanism, const Motion& motion, double t) {
  Diagnostics diagnostics;
  const auto form = cabin_robot::MakeClosedForm(mechanism, motion, {}, &diagnostics);
  MBV_DEMAND(form != nullptr, diagnostics.Text());
  CommandSample command;
  EvaluateMotion(motion, t, &command);
  ClosedFormSample sample;
  const RunSummary summary = form->Dynamics(command, &sample);
  return summary.ok() ? sample.force : VecX::Constant(8, kNan);
}

VecX ReferenceForces(ReferenceSolver* solver, const Motion& motion, double t) {
  CommandSample command;
  EvaluateMotion(motion, t, &command);
  ReferenceSample sample;
  const RunSummary summary = solver->Dynamics(command, &sample);
  return summary.ok() ? sample.drive_force : VecX::Constant(8, kNan);
}

// The print's list of bodies: no rail carriage, no payload.
Mechanism WithoutCarriageAndPayload(Mechanism mechanism) {
  for (Parameter& p : mechanism.parameters) {
    for (const char* name :
         {"m_carriage", "m_payload", "I_payload_x", "I_payload_y", "I_payload_z"}) {
      if (p.name == name) p.value = 0.0;
    }
  }
  return mechanism;
}

}  // namespace

std::vector<AuditRow> DynamicsRows(const Mechanism& mechanism, const Mechanism& truth) {
  RowMeter bodies(
      DynamicsTexts("(47)", "T, U over platform, three drive branches and four wrist bodies",
                    "carriage and payload added; branches are slider + link",
                    "drive forces against the generic reference solver; how much the print "
                    "leaves out rests on masses assumed here: the paper prints none of the "
                    "carriage and the payload"));
  RowMeter lagrange(
      DynamicsTexts("(48), (50)–(52)", "Lagrange's equation and virtual work", "",
                    "drive forces with an end-effector wrench against the reference solver"));
  RowMeter wrench(
      DynamicsTexts("(53)", "τ = JᵀQ", "τ = −JᵀW for a wrench W acting on the end effector",
                    "right for Q exerted by the end effector; difference of forces with and "
                    "without the wrench"));
  const Motion bare = HarmonicMotion(mechanism);
  Motion loaded = bare;
  loaded.loads.push_back(ToolLoad(mechanism));
  const Mechanism printed = WithoutCarriageAndPayload(mechanism);
  ReferenceSolver bare_solver(truth, bare), loaded_solver(truth, loaded);
  for (int i = 0; i < 40; ++i) {
    const double t = 0.05 * i;
    const VecX force = ReferenceForces(&bare_solver, bare, t);
    const VecX force_loaded = ReferenceForces(&loaded_solver, loaded, t);
    const VecX form = ClosedFormForces(mechanism, bare, t);
    const VecX form_loaded = ClosedFormForces(mechanism, loaded, t);
    const VecX form_printed = ClosedFormForces(printed, bare, t);
    for (int d = 0; d < 8; ++d) {
      bodies.Add(force[d], form_printed[d], form[d]);
      lagrange.Add(force_loaded[d], form_loaded[d]);
      const double share = form_loaded[d] - form[d];
      wrench.Add(force_loaded[d] - force[d], -share, share);
    }
  }
  AuditRow seven = DynamicsTexts("(49)", "sum to τ7 δq7", "sum to τ8 δq8",
                                 "seven drives printed, the robot has eight");
  seven.verdict = AuditVerdict::kNotTestable;
  return {bodies.Finish(), lagrange.Finish(), seven, wrench.Finish()};
}

// Equations (54)–(75) of the cabin robot against frame elements.

namespace {

using cabin_robot::LimbForm;
using cabin_robot::StiffnessParameters;
using cabin_robot::StiffnessPose;
using cabin_robot::ToolStiffness;
using stiffness_audit::AddMatrix;
using stiffness_audit::MatrixKind;

constexpr double kDeg = std::numbers::pi / 180.0;
// A rotation of 1 rad counts as a displacement of this length, about that of a link.
constexpr double kLength = 0.5;
// Two summations of St Venant's series agree to 6e-12.
constexpr double Limit(double scale) { return 1e-11 * scale; }

// The paper's order, displacement first → rotation first, and back.
Mat6 Swapped(const Mat6& M) {
  Mat6 result;
  result << M.bottomRightCorner<3, 3>(), M.bottomLeftCorner<3, 3>(), M.topRightCorner<3, 3>(),
      M.topLeftCorner<3, 3>();
  return result;
}

const Beam& BeamOf(const Mechanism& m, const std::string& name) {
  for (const Beam& beam : m.beams) {
    if (beam.name == name) return beam;
  }
  MBV_DEMAND(false, name);
  return m.beams.front();
}

struct State {
  StiffnessPose pose;
  Mechanism m;
  std::vector<Pose> X_WB;
  ToolStiffness right, printed;
};

State StateAt(const std::string& models_dir, const StiffnessParameters& p,
              const StiffnessPose& pose) {
  State state{.pose = pose,
              .m = stiffness_audit::LoadElastic(models_dir, "cabin_robot", {{"d5", pose.d5}}),
              .X_WB = {},
              .right = {},
              .printed = {}};
  state.X_WB = stiffness_audit::PosesAt(state.m, {{"d1", 0.5},
                                                  {"platform.x", pose.X},
                                                  {"platform.y", pose.Y},
                                                  {"platform.yaw", pose.gamma},
                                                  {"th3", pose.th3},
                                                  {"th4", pose.th4},
                                                  {"th6", 0.3}});
  const RunSummary summary = SolveStiffness(p, pose, LimbForm::kCorrected, &state.right);
  MBV_DEMAND(summary.ok(), summary.message);
  (void)SolveStiffness(p, pose, LimbForm::kAsPrinted, &state.printed);
  return state;
}

std::vector<State> States(const std::string& models_dir, const StiffnessParameters& p) {
  std::vector<State> states;
  for (const StiffnessPose& pose : {StiffnessPose{0.0, 0.36, 0.0, 90 * kDeg, 0.0, -0.2},
                                    {0.03, 0.33, 6 * kDeg, 40 * kDeg, -35 * kDeg, -0.31},
                                    {-0.04, 0.31, -5 * kDeg, -70 * kDeg, 10 * kDeg, -0.45},
                                    {0.05, 0.39, 3 * kDeg, 15 * kDeg, -75 * kDeg, -0.08}}) {
    states.push_back(StateAt(models_dir, p, pose));
  }
  return states;
}

std::vector<AuditRow> BeamRows(const Mechanism& m, const StiffnessParameters& p) {
  RowMeter beams(TextRow("(54)", "C of a clamped beam", "", "m/N", Limit(4e-6),
                         "tip compliance of the frame's beams, rotations times 0.5 m; I_p apart"));
  AuditRow usual =
      TextRow("(54) I_p", "b h³ (1/3 − 0.21 h/b)", "St Venant's series", "1", Limit(0.3),
              "over b h³; the print is its usual approximation, 12 % low for a square "
              "and exact to 0.01 % from b/h = 3");
  usual.approximation = 0.018;  // of 0.141 for a square
  RowMeter torsion(usual);
  const std::array<const char*, cabin_robot::kStiffBeams> names = {"AB.AE", "CD",   "EF",  "column",
                                                                   "arm",   "rail", "tool"};
  for (int k = 0; k < cabin_robot::kStiffBeams; ++k) {
    const Beam& beam = BeamOf(m, names[static_cast<size_t>(k)]);
    const Mat6 C =
        Swapped(BeamCompliance(p, static_cast<cabin_robot::StiffBeam>(k), beam.length()));
    AddMatrix(&beams, MatrixKind::kCompliance, kLength,
              stiffness_audit::CantileverCompliance(beam, beam.length()), C, C);
    const cabin_robot::RectSection& s = p.sections[static_cast<size_t>(k)];
    const double unit = s.b * s.h * s.h * s.h;
    torsion.Add(beam.section.torsion / unit, cabin_robot::TorsionConstant(s.b, s.h, true) / unit,
                cabin_robot::TorsionConstant(s.b, s.h, false) / unit);
  }
  return {beams.Finish(), torsion.Finish()};
}

// Strut and slider reactions of link AB under a force and a moment at B, from its equilibrium.
AuditRow StrutRow(const StiffnessParameters& p, const std::vector<State>& states) {
  RowMeter meter(TextRow("(55)", "N = 2 F_x2/cos θ − 2 M_z/(L1 cos θ)", "", "N", 1e-9,
                         "equilibrium of AB as a linear system; with x2 square to AB towards the "
                         "strut, θ = α + ε − 90°, compression positive"));
  for (const State& state : states) {
    const double psi = state.right.planar.alpha.p + state.right.planar.epsilon.p;
    for (const auto& [F_x2, M_z] : {std::pair{1000.0, 0.0}, {0.0, 300.0}, {-700.0, 120.0}}) {
      Mat3 balance;  // forces of hinge A along and across AB, strut force
      balance << 1, 0, -std::cos(psi), 0, 1, std::sin(psi), 0, 0, std::sin(psi) * p.planar.L1 / 2;
      const Vec3 reactions = balance.inverse() * Vec3(0, F_x2, F_x2 * p.planar.L1 - M_z);
      meter.Add(reactions[2],
                cabin_robot::StrutForce(p.planar.L1, psi - std::numbers::pi / 2, F_x2, M_z));
    }
  }
  return meter.Finish();
}

// AB + EF at B in AB's axes, hinge B open.
AuditRow StrutLimbRow(const StiffnessParameters& p, const std::vector<State>& states) {
  RowMeter meter(TextRow("(56)–(61)", "C_AB: strut force put into the axial slot, AB clamped at A",
                         "unit loads on AB and EF", "m/N", Limit(1e-6),
                         "limb AB + EF alone at B, rotations times 0.5 m; the print is not "
                         "symmetric either"));
  for (const State& state : states) {
    const Mechanism limb = stiffness_audit::Opened(state.m, {"B"});
    const Mat3 axes = RotZ(state.right.planar.alpha.p);
    const Mat6 truth = stiffness_audit::InAxes(
        stiffness_audit::ComplianceAt(limb, state.X_WB, "AB", Vec3(p.planar.L1, 0, 0)), axes);
    const cabin_robot::StrutLimb strut =
        StrutLimbCompliance(p, state.right.planar.alpha.p, state.right.planar.epsilon.p);
    Mat6 C = Mat6::Zero();  // rotation first: θz, x, y in the plane; θx, θy, z across it
    const std::array<int, 3> in = {3, 4, 2}, out = {5, 0, 1};
    C(in, in) = strut.in_plane;
    C(out, out) = strut.out_of_plane;
    const double theta =
        state.right.planar.alpha.p + state.right.planar.epsilon.p - std::numbers::pi / 2;
    AddMatrix(&meter, MatrixKind::kCompliance, kLength, truth,
              Swapped(PrintedLimbCompliance(p, theta)), C);
  }
  return meter.Finish();
}

// Platform on one limb: the hinges carry no moment about z.
std::vector<AuditRow> LimbRows(const StiffnessParameters& p, const std::vector<State>& states) {
  RowMeter strut(TextRow("(65) K_AB", "C_AB⁻¹ of (61)", "no moment about z at B: rank 5", "N/m",
                         Limit(5e8),
                         "platform on limb AB + EF alone; the inverse welds revolute joint B"));
  RowMeter link(TextRow("(65) K_CD", "C_CD⁻¹ of (54)", "EA/L3 and (z, θx, θy) only: rank 4", "N/m",
                        Limit(1e9),
                        "platform on link CD alone; the inverse welds revolute joints C and D"));
  for (const State& state : states) {
    const cabin_robot::PlanarState& s = state.right.planar;
    const Mat3 R_2 = RotZ(state.pose.gamma);
    const auto on_platform = [](const Mat3& R, const Vec3& r, const Mat6& K) {
      return Swapped(cabin_robot::LimbForceTransform(R, r) * K *
                     cabin_robot::LimbTransform(R, r).inverse());
    };
    const auto truth = [&](const std::vector<std::string>& open) {
      return stiffness_audit::StiffnessAt(stiffness_audit::Opened(state.m, open), state.X_WB,
                                          "platform");
    };
    const Vec3 r_B = R_2 * Vec3(-p.planar.L2 / 2, 0, p.w / 2);
    const Vec3 r_C = R_2 * Vec3(p.planar.L2 / 2, 0, p.w / 2);
    const Mat3 R_AB = RotZ(s.alpha.p), R_CD = RotZ(std::numbers::pi - s.beta.p);
    const double theta = s.alpha.p + s.epsilon.p - std::numbers::pi / 2;
    AddMatrix(
        &strut, MatrixKind::kStiffness, kLength, truth({"C", "B2", "C2"}),
        on_platform(R_AB, r_B, PrintedLimbCompliance(p, theta).inverse()),
        on_platform(R_AB, r_B, StrutLimbStiffness(StrutLimbCompliance(p, s.alpha.p, s.epsilon.p))));
    AddMatrix(
        &link, MatrixKind::kStiffness, kLength, truth({"B", "B2", "C2"}),
        on_platform(R_CD, r_C, BeamCompliance(p, cabin_robot::kBeamCD, p.planar.L3).inverse()),
        on_platform(R_CD, r_C, LinkLimbStiffness(p)));
  }
  return {strut.Finish(), link.Finish()};
}

std::vector<AuditRow> ChainRows(const std::vector<State>& states) {
  RowMeter platform(TextRow("(62)–(64), (66)–(68)", "K = Σ J_Fi K_i J_i⁻¹", "", "N/m", Limit(1e9),
                            "platform on both linkages, with K_i as corrected; r_i in world axes"));
  RowMeter tool(TextRow("(69)–(75)", "C = Σ J_j C_j J_jᵀ", "", "m/N", Limit(5e-7),
                        "end effector of the whole frame; r_j from the beam's end, in beam axes; "
                        "summed over the five parts of the text"));
  RowMeter loads(
      TextRow("Table 2", "limb model (61), said to be within 15 %", "as corrected", "m", 1e-13,
              "displacements of the end effector under single forces of 1000 N, C of the frame"));
  for (const State& state : states) {
    const Mat6 K = stiffness_audit::StiffnessAt(state.m, state.X_WB, "platform");
    const Mat6 K_form = Swapped(state.right.K_platform);
    AddMatrix(&platform, MatrixKind::kStiffness, kLength, K, K_form, K_form);
    const Mat6 C = stiffness_audit::ComplianceAt(state.m, state.X_WB, "slewing");
    const Mat6 C_form = Swapped(state.right.C), C_printed = Swapped(state.printed.C);
    AddMatrix(&tool, MatrixKind::kCompliance, kLength, C, C_form, C_form);
    for (int r = 3; r < 6; ++r) {
      for (int c = 3; c < 6; ++c) {
        loads.Add(1000 * C(r, c), 1000 * C_printed(r, c), 1000 * C_form(r, c));
      }
    }
  }
  AuditRow terms =
      TextRow("(71), (73), (74): sum", "sum to 6", "sum to 5", "", 0.0,
              "the text describes the linkages and four beams; before (73), its references to "
              "(66), (68) mean (69), (71)");
  terms.verdict = AuditVerdict::kNotTestable;
  return {platform.Finish(), tool.Finish(), terms, loads.Finish()};
}

}  // namespace

std::vector<AuditRow> StiffnessRows(const std::string& models_dir, const StiffnessParameters& p) {
  const std::vector<State> states = States(models_dir, p);
  std::vector<AuditRow> rows = BeamRows(states.front().m, p);
  rows.push_back(StrutRow(p, states));
  rows.push_back(StrutLimbRow(p, states));
  for (const auto& more : {LimbRows(p, states), ChainRows(states)}) {
    rows.insert(rows.end(), more.begin(), more.end());
  }
  return rows;
}

}  // namespace mbv::cabin_audit
