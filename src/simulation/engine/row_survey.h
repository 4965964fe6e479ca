// MuJoCo's equality rows along a motion, as MuJoCo takes them without correction: what is softened,
// which velocity term is left out, which drive forces mj_forward gives for it.
#pragma once

#include <string>
#include <vector>

#include "base/engine_rows.h"
#include "base/run_summary.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "simulation/engine/simulation.h"

namespace mbv {

struct SurveyedState {
  double time_s = 0.0;
  RowState state;       ///< closed, with consistent velocities; targets carry rates
  VecX velocity_term;   ///< J̇q̇ per row
  RowMeasures present;  ///< of the library in use
};

struct RowSurvey {
  RunSummary summary;
  std::string mjcf;                     ///< the model whose rows they are
  std::vector<std::string> driven;      ///< names of drives, then of prescribed joints
  std::vector<std::string> equalities;  ///< per row: "close:JOINT", "drive:DRIVE", …
  std::vector<std::string> kinds;       ///< per row: "connect", "weld", "joint" or "tendon"
  std::vector<SurveyedState> states;
};

/// Of commanded motions, at these times in ascending order, with the stiffest equalities for the
/// step. kUnsupported: DOFs that nothing drives; and what Simulate() ends with.
[[nodiscard]] RowSurvey SurveyRows(const Mechanism& mechanism, const Motion& motion,
                                   const DrivenMotion& driven, const std::vector<double>& times_s,
                                   double step_s);

}  // namespace mbv
