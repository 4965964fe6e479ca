// What a trace records of one sample. Internal to reference/.
#pragma once

#include <vector>

#include "core/trace.h"
#include "reference/reference.h"

namespace mbv::internal {

/// Reads drives, prescribed joints and outputs from body states. Drives and prescribed joints count
/// the turns that the states tell; of an output's angles the last sample says which turn they are
/// in.
class SampleRecorder {
 public:
  explicit SampleRecorder(const Mechanism& mechanism) : mechanism_(mechanism) {}

  /// Fills `driven` and `outputs` of a sample from its states.
  void Record(ReferenceSample* sample);

 private:
  void RecordDriven(ReferenceSample* sample);
  void RecordOutputs(ReferenceSample* sample);

  const Mechanism& mechanism_;
  MatX last_outputs_;
};

/// Channels of the reference's traces.
[[nodiscard]] std::vector<Channel> ReferenceChannels(const Mechanism& mechanism, bool reactions);
/// Writes a sample into `row`: every channel of ReferenceChannels() that `columns` has, and the
/// work if there is any.
void WriteSample(const ReferenceSample& sample, const ChannelColumns& columns,
                 Eigen::Ref<Eigen::RowVectorXd> row);

}  // namespace mbv::internal
