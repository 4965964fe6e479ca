#include "reference/closure_solver.h"
#include "reference/force_solver.h"
#include "reference/reference.h"
#include "reference/sample_recorder.h"

namespace mbv {

struct ReferenceSolver::Impl {
  Impl(const Mechanism& m, const Motion& motion, const ReferenceOptions& options)
      : closure(m, motion, options), forces(m, motion.duration_s), recorder(m) {}

  internal::ClosureSolver closure;
  internal::ForceSolver forces;
  internal::SampleRecorder recorder;
};

ReferenceSolver::ReferenceSolver(const Mechanism& mechanism, const Motion& motion,
                                 const ReferenceOptions& options)
    : impl_(std::make_unique<Impl>(mechanism, motion, options)) {}
ReferenceSolver::~ReferenceSolver() = default;
ReferenceSolver::ReferenceSolver(ReferenceSolver&&) noexcept = default;

RunSummary ReferenceSolver::Kinematics(const CommandSample& command, ReferenceSample* sample) {
  if (RunSummary summary = impl_->closure.Solve(command); !summary.ok()) return summary;
  sample->states = impl_->closure.states();
  sample->closure_position_m = impl_->closure.gap_position_m();
  sample->closure_rotation_rad = impl_->closure.gap_rotation_rad();
  impl_->recorder.Record(sample);
  return RunSummary::Done();
}

RunSummary ReferenceSolver::Dynamics(const CommandSample& command, ReferenceSample* sample) {
  if (RunSummary summary = Kinematics(command, sample); !summary.ok()) return summary;
  RunSummary summary = impl_->forces.Solve(command.loads, sample);
  if (!summary.ok()) summary.time_s = command.time_s;
  return summary;
}

}  // namespace mbv
