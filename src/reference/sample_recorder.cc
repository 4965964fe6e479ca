#include "reference/sample_recorder.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/demand.h"
#include "kinematics/constraints.h"
#include "mechanism/channels.h"

namespace mbv::internal {

SampleRecorder::SampleRecorder(const Mechanism& mechanism, std::vector<Coordinate> joints)
    : mechanism_(mechanism), joints_(std::move(joints)) {
  last_joints_.resize(static_cast<Eigen::Index>(joints_.size()));
  for (Eigen::Index k = 0; k < last_joints_.size(); ++k) {
    last_joints_[k] = HomeValue(mechanism_, joints_[static_cast<size_t>(k)]);
  }
}

void SampleRecorder::Record(ReferenceSample* sample) {
  RecordDriven(sample);
  RecordOutputs(sample);
  RecordJoints(sample);
}

void SampleRecorder::RecordJoints(ReferenceSample* sample) {
  DrivenSample& joints = sample->joints;
  for (VecX* x : {&joints.position, &joints.velocity, &joints.acceleration}) {
    x->resize(last_joints_.size());
  }
  for (Eigen::Index k = 0; k < last_joints_.size(); ++k) {
    const ScalarRow row =
        CoordinateRow(mechanism_, joints_[static_cast<size_t>(k)], sample->states, last_joints_[k]);
    joints.position[k] = last_joints_[k] = row.value;
    joints.velocity[k] = RateOf(row, sample->states.V_WB);
    joints.acceleration[k] = RateOf(row, sample->states.A_WB) + row.bias;
  }
}

void SampleRecorder::RecordDriven(ReferenceSample* sample) {
  const auto count =
      static_cast<Eigen::Index>(mechanism_.drives.size() + mechanism_.prescribed.size());
  DrivenSample& driven = sample->driven;
  driven.position.resize(count);
  driven.velocity.resize(count);
  driven.acceleration.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const ScalarRow row = DrivenRow(mechanism_, static_cast<size_t>(i), sample->states);
    driven.position[i] = row.value;
    driven.velocity[i] = RateOf(row, sample->states.V_WB);
    driven.acceleration[i] = RateOf(row, sample->states.A_WB) + row.bias;
  }
}

void SampleRecorder::RecordOutputs(ReferenceSample* sample) {
  const auto count = static_cast<Eigen::Index>(mechanism_.outputs.size());
  if (last_outputs_.rows() != count) last_outputs_.setZero(count, 6);
  sample->output_velocity.resize(count, 6);
  sample->output_acceleration.resize(count, 6);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (int c = 0; c < 6; ++c) {
      const ScalarRow row =
          OutputRow(mechanism_.outputs[i], c, sample->states, last_outputs_(i, c));
      last_outputs_(i, c) = row.value;
      sample->output_velocity(i, c) = RateOf(row, sample->states.V_WB);
      sample->output_acceleration(i, c) = RateOf(row, sample->states.A_WB) + row.bias;
    }
  }
  sample->outputs = last_outputs_;
}

std::vector<Channel> ReferenceChannels(const Mechanism& mechanism, const Motion& motion,
                                       bool reactions) {
  std::vector<Channel> channels = DriveChannels(mechanism);
  const auto append = [&](std::vector<Channel> more) {
    channels.insert(channels.end(), more.begin(), more.end());
  };
  append(OutputChannels(mechanism));
  if (motion.free()) {
    for (const Output& output : mechanism.outputs) append(OutputRateChannels(mechanism, output));
  }
  append(PrescribedChannels(mechanism));
  append(BandChannels(mechanism));
  if (reactions) {
    for (const Joint& joint : mechanism.joints) append(ReactionChannels(joint));
  }
  append(AuditChannels());
  append(EnergyChannels());
  for (const Coordinate& joint : motion.RecordedJoints()) {
    append(JointChannels(mechanism, joint, true));
  }
  return channels;
}

namespace {

// Works of drives, prescribed joints, loads and dampers follow each other (WorkChannels).
void WriteWork(const ReferenceSample& sample, const ChannelColumns& columns,
               Eigen::Ref<Eigen::RowVectorXd> row) {
  const Eigen::Index drives = sample.drive_force.size(), bases = sample.prescribed_force.size();
  MBV_DEMAND(sample.work.size() == drives + bases + 2, sample.work.size());
  for (Eigen::Index d = 0; d < drives; ++d) {
    row[columns(Quantity::kWork, static_cast<size_t>(d))] = sample.work[d];
  }
  for (Eigen::Index p = 0; p < bases; ++p) {
    row[columns(Quantity::kBaseWork, static_cast<size_t>(p))] = sample.work[drives + p];
  }
  row[columns(Quantity::kLoadWork)] = sample.work[drives + bases];
  row[columns(Quantity::kDamperWork)] = sample.work[drives + bases + 1];
}

void WriteBands(const ReferenceSample& sample, const ChannelColumns& columns,
                Eigen::Ref<Eigen::RowVectorXd> row) {
  for (Eigen::Index d = 0; d < sample.drive_band.size(); ++d) {
    row[columns(Quantity::kForceBand, static_cast<size_t>(d))] = sample.drive_band[d];
  }
  for (Eigen::Index p = 0; p < sample.prescribed_band.size(); ++p) {
    row[columns(Quantity::kBaseForceBand, static_cast<size_t>(p))] = sample.prescribed_band[p];
  }
}

}  // namespace

void WriteSample(const Mechanism& mechanism, const ReferenceSample& sample,
                 const ChannelColumns& columns, Eigen::Ref<Eigen::RowVectorXd> row) {
  const auto put = [&](Quantity quantity, Eigen::Index k, double value) {
    row[columns(quantity, static_cast<size_t>(k))] = value;
  };
  // Six components per subject.
  const auto put_rows = [&](Quantity quantity, const MatX& table, Eigen::Index rows) {
    for (Eigen::Index i = 0; i < rows; ++i) {
      for (Eigen::Index c = 0; c < 6; ++c) put(quantity, 6 * i + c, table(i, c));
    }
  };
  for (Eigen::Index d = 0; d < sample.drive_force.size(); ++d) {
    put(Quantity::kPosition, d, sample.driven.position[d]);
    put(Quantity::kVelocity, d, sample.driven.velocity[d]);
    put(Quantity::kAcceleration, d, sample.driven.acceleration[d]);
    put(Quantity::kForce, d, sample.drive_force[d]);
  }
  put_rows(Quantity::kPose, sample.outputs, sample.outputs.rows());
  if (columns.Has(Quantity::kPoseVelocity)) {
    put_rows(Quantity::kPoseVelocity, sample.output_velocity, sample.output_velocity.rows());
    put_rows(Quantity::kPoseAcceleration, sample.output_acceleration,
             sample.output_acceleration.rows());
  }
  for (Eigen::Index k = 0; k < sample.joints.position.size(); ++k) {
    put(Quantity::kJointPosition, k, sample.joints.position[k]);
    put(Quantity::kJointVelocity, k, sample.joints.velocity[k]);
    put(Quantity::kJointAcceleration, k, sample.joints.acceleration[k]);
  }
  for (Eigen::Index p = 0; p < sample.prescribed_force.size(); ++p) {
    put(Quantity::kBaseForce, p, sample.prescribed_force[p]);
  }
  if (columns.Has(Quantity::kForceBand) || columns.Has(Quantity::kBaseForceBand)) {
    WriteBands(sample, columns, row);
  }
  if (columns.Has(Quantity::kReaction)) {
    const auto joints = static_cast<Eigen::Index>(mechanism.joints.size());
    put_rows(Quantity::kReaction, sample.reactions, joints);
  }
  put(Quantity::kLoopGap, 0, sample.closure_position_m);
  put(Quantity::kLoopTwist, 0, sample.closure_rotation_rad);
  put(Quantity::kInputPower, 0, sample.power.input);
  put(Quantity::kEnergyRate, 0, sample.power.energy_rate);
  put(Quantity::kBasePower, 0, sample.power.base);
  put(Quantity::kLoadPower, 0, sample.power.loads);
  put(Quantity::kDamperPower, 0, sample.power.dampers);
  put(Quantity::kGravityPower, 0, sample.power.gravity);
  put(Quantity::kSpringPower, 0, sample.power.springs);
  put(Quantity::kKineticEnergy, 0, sample.energy.kinetic);
  put(Quantity::kGravityEnergy, 0, sample.energy.gravity);
  put(Quantity::kSpringEnergy, 0, sample.energy.springs);
  if (sample.work.size() > 0) WriteWork(sample, columns, row);
}

namespace {

// Share of the largest moment of a body, or force at the characteristic length, that is rounding.
constexpr double kNoMoment = 1e-9;

}  // namespace

double SpinMoment(const Spin& spin, const BodyStates& states, const std::vector<Vec6>& wrench_W) {
  const Pose& X_WB = states.X_WB[static_cast<size_t>(spin.bodies[0])];
  const Vec3 n = X_WB.linear() * spin.n_B, p_WP = X_WB * spin.p_BP;
  double moment = 0.0;
  for (const int b : spin.bodies) {
    const Vec6& wrench = wrench_W[static_cast<size_t>(b)];
    const Vec3 p_PBo = states.X_WB[static_cast<size_t>(b)].translation() - p_WP;
    moment += n.dot(wrench.head<3>()) + n.cross(p_PBo).dot(wrench.tail<3>());
  }
  return moment;
}

RunSummary CheckSpinsIdle(const std::vector<Spin>& spins, const BodyStates& states,
                          const std::vector<Vec6>& required_W, double length) {
  if (spins.empty()) return RunSummary::Done();
  double largest = 0.0;
  for (const Vec6& wrench : required_W) {
    largest = std::max({largest, wrench.head<3>().norm(), length * wrench.tail<3>().norm()});
  }
  for (const Spin& spin : spins) {
    const double moment = SpinMoment(spin, states, required_W);
    if (std::abs(moment) <= kNoMoment * largest) continue;
    RunSummary summary;
    summary.stop = Stop::kUnsupported;
    summary.message = fmt::format(
        "a moment of {:.3g} N m about the line through both balls of {} changes its spin, which "
        "counts as idle; hold it by a universal joint",
        -moment, spin.name);
    summary.where = spin.name;
    summary.names_where = true;
    summary.amount = -moment;
    summary.unit = std::string("N m");
    return summary;
  }
  return RunSummary::Done();
}

}  // namespace mbv::internal
