#include <array>
#include <cmath>

#include "analytic/cabin_robot/cabin_robot.h"
#include "audit/cabin_audit.h"
#include "audit/row_meter.h"
#include "core/demand.h"
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
  const auto form = MakeCabinRobot(mechanism, motion, {}, &diagnostics);
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

}  // namespace mbv::cabin_audit
