// What a trace records of one sample. Internal to reference/.
#pragma once

#include <vector>

#include "base/run_summary.h"
#include "math/trace.h"
#include "mechanism/idle_spins.h"
#include "mechanism/motion.h"
#include "reference/reference.h"

namespace mbv::internal {

/// Reads drives, prescribed joints, outputs and recorded joints from body states. Drives and
/// prescribed joints count the rotations that the states count; of other angles the last sample
/// says which turn they are in.
class SampleRecorder {
 public:
  /// `joints`: Motion::RecordedJoints().
  explicit SampleRecorder(const Mechanism& mechanism, std::vector<Coordinate> joints = {});

  /// Fills `driven`, `outputs` and `joints` of a sample from its states.
  void Record(ReferenceSample* sample);
  void RecordDriven(ReferenceSample* sample);
  /// Their angles are followed from one call to the next.
  void RecordOutputs(ReferenceSample* sample);

 private:
  void RecordJoints(ReferenceSample* sample);

  const Mechanism& mechanism_;
  const std::vector<Coordinate> joints_;
  MatX last_outputs_;
  VecX last_joints_;
};

/// Channels of the reference's traces.
[[nodiscard]] std::vector<Channel> ReferenceChannels(const Mechanism& mechanism,
                                                     const Motion& motion, bool reactions);
/// Writes a sample into `row`: every channel of ReferenceChannels() that `columns` has, and the
/// work if there is any.
void WriteSample(const Mechanism& mechanism, const ReferenceSample& sample,
                 const ChannelColumns& columns, Eigen::Ref<Eigen::RowVectorXd> row);

// Whether idle spins are idle (mechanism/idle_spins.h). Internal to reference/.

/// Moment about the line through a spin's balls of the wrenches [m about Bo; f] of all bodies, in
/// world axes:  Σ_b n·m_b + (n × p_PBo)·f_b                                                   (1)
[[nodiscard]] double SpinMoment(const Spin& spin, const BodyStates& states,
                                const std::vector<Vec6>& wrench_W);

/// kUnsupported where what the bodies need beyond loads, springs and weight has such a moment: no
/// reaction of a ball gives it, so it would change the spin.
[[nodiscard]] RunSummary CheckSpinsIdle(const std::vector<Spin>& spins, const BodyStates& states,
                                        const std::vector<Vec6>& required_W, double length);

}  // namespace mbv::internal
