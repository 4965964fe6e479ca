#include <cmath>

#include "core/demand.h"
#include "reference/closure_solver.h"
#include "reference/force_solver.h"
#include "reference/reference.h"

namespace mbv {

struct ReferenceSolver::Impl {
  Impl(const Mechanism& m, const Motion& motion, const ReferenceOptions& options)
      : mechanism(m), closure(m, motion, options), forces(m) {}

  void RecordDriven(ReferenceSample* sample);
  void RecordOutputs(ReferenceSample* sample);

  const Mechanism& mechanism;
  internal::ClosureSolver closure;
  internal::ForceSolver forces;
  VecX last_driven;  ///< says which turn an angle is in
  MatX last_outputs;
};

void ReferenceSolver::Impl::RecordDriven(ReferenceSample* sample) {
  const auto drives = static_cast<Eigen::Index>(mechanism.drives.size());
  const auto all = drives + static_cast<Eigen::Index>(mechanism.prescribed.size());
  const bool first = last_driven.size() != all;
  if (first) last_driven.setZero(all);
  DrivenSample& driven = sample->driven;
  driven.position.resize(all);
  driven.velocity.resize(all);
  driven.acceleration.resize(all);
  for (Eigen::Index i = 0; i < all; ++i) {
    const bool is_drive = i < drives;
    const auto index = static_cast<int>(is_drive ? i : i - drives);
    if (first) {
      // Count angles from the home coordinate.
      const auto* on_joint =
          is_drive ? std::get_if<JointDrive>(&mechanism.drives[index].kind) : nullptr;
      if (on_joint != nullptr) {
        last_driven[i] = mechanism.joints[on_joint->joint].home[on_joint->coordinate];
      } else if (!is_drive) {
        last_driven[i] = mechanism.joints[mechanism.prescribed[index].joint].home[0];
      }
    }
    const Coordinate coordinate{is_drive ? Coordinate::Kind::kDrive : Coordinate::Kind::kPrescribed,
                                index, 0};
    const ScalarRow row = CoordinateRow(mechanism, coordinate, sample->states, last_driven[i]);
    const auto rate = [&](const std::vector<Vec6>& motion) {
      return row.J_parent.dot(motion[row.parent]) + row.J_child.dot(motion[row.child]);
    };
    driven.position[i] = last_driven[i] = row.value;
    driven.velocity[i] = rate(sample->states.V_WB);
    driven.acceleration[i] = rate(sample->states.A_WB) + row.bias;
  }
}

void ReferenceSolver::Impl::RecordOutputs(ReferenceSample* sample) {
  const auto count = static_cast<Eigen::Index>(mechanism.outputs.size());
  if (last_outputs.rows() != count) last_outputs.setZero(count, 6);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (int c = 0; c < 6; ++c) {
      last_outputs(i, c) =
          OutputRow(mechanism.outputs[i], c, sample->states, last_outputs(i, c)).value;
    }
  }
  sample->outputs = last_outputs;
}

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
  impl_->RecordDriven(sample);
  impl_->RecordOutputs(sample);
  return RunSummary::Done();
}

RunSummary ReferenceSolver::Dynamics(const CommandSample& command, ReferenceSample* sample) {
  if (RunSummary summary = Kinematics(command, sample); !summary.ok()) return summary;
  RunSummary summary = impl_->forces.Solve(command.loads, sample);
  if (!summary.ok()) summary.time_s = command.time_s;
  return summary;
}

}  // namespace mbv
