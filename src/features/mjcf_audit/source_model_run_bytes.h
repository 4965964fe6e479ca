// Runs of a user's file on their way out of a child process (math/bytes.h).
#pragma once

#include "features/mjcf_audit/source_options.h"
#include "math/bytes.h"
#include "math/channel.h"

namespace mbv {

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
      visit(f.leads);
  visit(f.motors), visit(f.left_out), visit(f.held), visit(f.couplings), visit(f.unused_actuators);
  visit(f.damped);
  visit(run.trace.time_s), visit(run.trace.channels), visit(run.trace.values);
  visit(run.gaps), visit(run.tracking), visit(run.notes), visit(run.step_s), visit(run.cost_ms);
}

}  // namespace mbv
