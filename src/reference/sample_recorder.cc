#include "reference/sample_recorder.h"

#include "core/demand.h"
#include "kinematics/constraints.h"
#include "mechanism/channels.h"

namespace mbv::internal {

void SampleRecorder::Record(ReferenceSample* sample) {
  RecordDriven(sample);
  RecordOutputs(sample);
}

void SampleRecorder::RecordDriven(ReferenceSample* sample) {
  const auto drives = static_cast<Eigen::Index>(mechanism_.drives.size());
  const auto all = drives + static_cast<Eigen::Index>(mechanism_.prescribed.size());
  const bool first = last_driven_.size() != all;
  if (first) last_driven_.setZero(all);
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
          is_drive ? std::get_if<JointDrive>(&mechanism_.drives[index].kind) : nullptr;
      if (on_joint != nullptr) {
        last_driven_[i] = mechanism_.joints[on_joint->joint].home[on_joint->coordinate];
      } else if (!is_drive) {
        last_driven_[i] = mechanism_.joints[mechanism_.prescribed[index].joint].home[0];
      }
    }
    const Coordinate coordinate{is_drive ? Coordinate::Kind::kDrive : Coordinate::Kind::kPrescribed,
                                index, 0};
    const ScalarRow row = CoordinateRow(mechanism_, coordinate, sample->states, last_driven_[i]);
    const auto rate = [&](const std::vector<Vec6>& motion) {
      return row.J_parent.dot(motion[row.parent]) + row.J_child.dot(motion[row.child]);
    };
    driven.position[i] = last_driven_[i] = row.value;
    driven.velocity[i] = rate(sample->states.V_WB);
    driven.acceleration[i] = rate(sample->states.A_WB) + row.bias;
  }
}

void SampleRecorder::RecordOutputs(ReferenceSample* sample) {
  const auto count = static_cast<Eigen::Index>(mechanism_.outputs.size());
  if (last_outputs_.rows() != count) last_outputs_.setZero(count, 6);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (int c = 0; c < 6; ++c) {
      last_outputs_(i, c) =
          OutputRow(mechanism_.outputs[i], c, sample->states, last_outputs_(i, c)).value;
    }
  }
  sample->outputs = last_outputs_;
}

std::vector<Channel> ReferenceChannels(const Mechanism& mechanism, bool reactions) {
  std::vector<Channel> channels = DriveChannels(mechanism);
  const auto append = [&](std::vector<Channel> more) {
    channels.insert(channels.end(), more.begin(), more.end());
  };
  append(OutputChannels(mechanism));
  append(PrescribedChannels(mechanism));
  if (reactions) {
    for (const Joint& joint : mechanism.joints) append(ReactionChannels(joint));
  }
  append(AuditChannels());
  append(EnergyChannels());
  return channels;
}

void WriteSample(const ReferenceSample& sample, bool reactions,
                 Eigen::Ref<Eigen::RowVectorXd> row) {
  Eigen::Index at = 0;
  const auto put = [&](double value) { row[at++] = value; };
  for (Eigen::Index d = 0; d < sample.drive_force.size(); ++d) {
    put(sample.driven.position[d]);
    put(sample.driven.velocity[d]);
    put(sample.driven.acceleration[d]);
    put(sample.drive_force[d]);
  }
  const auto put_rows = [&](const MatX& table) {
    for (Eigen::Index i = 0; i < table.rows(); ++i) {
      for (Eigen::Index c = 0; c < table.cols(); ++c) put(table(i, c));
    }
  };
  put_rows(sample.outputs);
  for (Eigen::Index p = 0; p < sample.prescribed_force.size(); ++p) {
    put(sample.prescribed_force[p]);
  }
  if (reactions) put_rows(sample.reactions);
  put(sample.closure_position_m);
  put(sample.closure_rotation_rad);
  const Powers& power = sample.power;
  for (const double watts : {power.input, power.energy_rate, power.base, power.loads, power.dampers,
                             power.gravity, power.springs}) {
    put(watts);
  }
  put(sample.energy.kinetic);
  put(sample.energy.gravity);
  put(sample.energy.springs);
  for (const double work : sample.work) put(work);
  MBV_DEMAND(at == row.size(), at);
}

}  // namespace mbv::internal
