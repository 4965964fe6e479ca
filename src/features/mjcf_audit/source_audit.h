// The audit of the source model (the user's MJCF): run as it is, what makes it wrong, recommended
// settings.
//
// Every number is a run of MuJoCo on the user's file in a process of its own.
#pragma once

#include <string>
#include <vector>

#include "features/mjcf_audit/source_options.h"
#include "math/bytes.h"
#include "math/trace.h"
#include "report/source_model_report.h"
#include "verify/prepare.h"
#include "verify/run_witnesses.h"

namespace mbv {

struct SourceModelRequest {
  std::string file;                    ///< the user's MJCF
  std::string text = {};               ///< its text; "": read from the file
  std::string base = {};               ///< LoadOptions::base with which the scenario was made
  const Prepared* prepared = nullptr;  ///< the scenario that was made of it
  /// Channels of reactions that statics leaves open.
  std::vector<std::string> reactions_not_unique = {};
  ProgressFunction progress = {};
  double search_s = 15.0;  ///< processor time for the search of settings
};

[[nodiscard]] SourceModelAudit AuditSourceModel(const SourceModelRequest& request);

// Runs of a user's file on their way out of a child process (math/bytes.h).

template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<Channel>& c) {
  visit(c.name), visit(c.unit), visit(c.frame), visit(c.quantity), visit(c.subject);
  visit(c.component);
}
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<SourceModelRun::Gap>& g) {
  visit(g.position_m), visit(g.position_at_s), visit(g.rotation_rad), visit(g.rotation_at_s);
}
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<SourceModelRun>& run) {
  visit(run.summary);
  auto& f = run.facts;
  visit(f.step_s), visit(f.integrator), visit(f.solver), visit(f.tolerance), visit(f.iterations);
  visit(f.rough_solver), visit(f.has_friction), visit(f.closures), visit(f.solref), visit(f.solimp),
      visit(f.held_by);
  visit(f.motors), visit(f.left_out), visit(f.held), visit(f.couplings), visit(f.unused_actuators);
  visit(f.damped);
  visit(run.trace.time_s), visit(run.trace.channels), visit(run.trace.values);
  visit(run.gaps), visit(run.tracking), visit(run.notes), visit(run.step_s), visit(run.cost_ms);
}

}  // namespace mbv
