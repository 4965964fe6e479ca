// ClosedForm: the one open interface, a paper's equations for one mechanism.
//
// An implementation reads its constants from Mechanism::parameters and its inputs from the
// commanded Motion; it knows nothing about the other witnesses. A model is added by one row in
// registry.cc.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "analytic/coverage.h"
#include "base/diagnostics.h"
#include "base/run_summary.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// Which formulation of the paper to evaluate.
struct ClosedFormOptions {
  std::string model;  ///< "" is the mechanism's default, e.g. "full"; see ClosedFormRow::models
  std::vector<std::string> as_printed;  ///< errata ("E2") to leave uncorrected, where offered
};

/// Forces of the drives and what else the equations give at one instant.
struct ClosedFormSample {
  DrivenSample driven;  ///< drives in model order (prescribed joints are commanded, not computed,
                        ///< but filled too)
  VecX force;           ///< per drive [N or N m], sign as in the drive's sheet
  VecX extra;           ///< one value per extra channel
};

class ClosedForm {
 public:
  virtual ~ClosedForm() = default;

  /// Signals beyond the drives': outputs (OUTPUT.x … OUTPUT.yaw), joint reactions
  /// (JOINT.reaction.fx … where the equations give them) and the paper's own quantities.
  /// Signals with the same name in another witness are compared.
  [[nodiscard]] virtual std::vector<Channel> extra_channels() const = 0;

  /// False: equations of motion alone. Then `force` of a sample stays empty.
  [[nodiscard]] virtual bool gives_forces() const { return true; }

  /// Positions, velocities and accelerations of everything driven. No allocation once `driven`
  /// has its size.
  [[nodiscard]] virtual RunSummary Kinematics(const CommandSample& command,
                                              DrivenSample* driven) = 0;

  /// Kinematics, drive forces and extra channels. No allocation once `sample` has its sizes.
  [[nodiscard]] virtual RunSummary Dynamics(const CommandSample& command,
                                            ClosedFormSample* sample) = 0;
};

/// Makes the closed form of a mechanism, or explains in `diagnostics` why the motion, the
/// parameters or the options do not suit it (message and hint; the caller adds file and line).
using ClosedFormFactory = std::unique_ptr<ClosedForm> (*)(const Mechanism&, const Motion&,
                                                          const ClosedFormOptions&,
                                                          Diagnostics* diagnostics);

struct ClosedFormRow {
  std::string mechanism;            ///< Mechanism::name
  std::vector<std::string> models;  ///< accepted formulations, the default first
  std::vector<std::string> errata;  ///< accepted entries of `as_printed`
  ClosedFormFactory factory = nullptr;
  /// What the equations take for granted. Checked against the mechanism before the factory is
  /// asked: outside, there is no closed form, and the other witnesses go on. nullptr: nothing is
  /// checked.
  CoverageFunction coverage = nullptr;
  /// The form reads which coordinates a motion commands but no profile when it is made, and no
  /// sample says anything of a later one: it serves every motion of these commands and loads.
  bool serves_any_profiles = false;
};

/// All registered closed forms.
[[nodiscard]] std::span<const ClosedFormRow> ClosedForms();
/// The row for a mechanism name, or nullptr.
[[nodiscard]] const ClosedFormRow* FindClosedForm(const std::string& mechanism);
/// What the closed form of the mechanism's name does not cover of it; empty without one.
[[nodiscard]] std::vector<Finding> FindUncovered(const Mechanism& mechanism);

/// Runs a closed form over the motion's sample times: drive channels (position, velocity,
/// acceleration, force) followed by the extra channels. Stops at the first failing sample.
struct ClosedFormRun {
  Trace trace;
  RunSummary summary;
};
/// `reuse`: the trace of an earlier run of the same mechanism and kind of form, whose channels and
/// memory are taken over.
[[nodiscard]] ClosedFormRun RunClosedForm(const Mechanism& mechanism, const Motion& motion,
                                          ClosedForm* closed_form, Trace reuse = {});

}  // namespace mbv
