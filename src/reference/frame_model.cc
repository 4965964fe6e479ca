#include "reference/frame_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/demand.h"
#include "core/spatial.h"
#include "mechanism/reach.h"

namespace mbv::internal {
namespace {

// Points of an elastic body nearer than this are one node [characteristic lengths].
constexpr double kSamePoint = 1e-8;

// F = rootᵀ root of a beam clamped at `from`: deformation [rotation; displacement] of its end in
// beam axes by the moment and force there. Euler–Bernoulli: unit forces integrated over the length.
Mat6 BeamRoot(const Beam& beam, double length) {
  const double L = beam.length();
  const double EA = beam.youngs_modulus * beam.section.area;
  const double EI_y = beam.youngs_modulus * beam.section.I_y;
  const double EI_z = beam.youngs_modulus * beam.section.I_z;
  Mat6 F = Mat6::Zero();
  F(0, 0) = L / (beam.shear_modulus * beam.section.torsion);
  F(1, 1) = L / EI_y;
  F(2, 2) = L / EI_z;
  F(3, 3) = L / EA;
  F(4, 4) = L * L * L / (3.0 * EI_z);
  F(5, 5) = L * L * L / (3.0 * EI_y);
  F(2, 4) = F(4, 2) = L * L / (2.0 * EI_z);
  F(1, 5) = F(5, 1) = -L * L / (2.0 * EI_y);
  Vec6 scale = Vec6::Ones();
  scale.tail<3>() /= length;
  F = scale.asDiagonal() * F * scale.asDiagonal();
  return F.llt().matrixU();
}

}  // namespace

FrameModel::FrameModel(const Mechanism& mechanism, const std::vector<Pose>& X_WB, int output)
    : mechanism_(mechanism), length_(CharacteristicLength(mechanism)) {
  MBV_DEMAND(X_WB.size() == mechanism.bodies.size(), mechanism.name);
  MBV_DEMAND(output >= 0 && output < static_cast<int>(mechanism.outputs.size()), output);
  states_.Resize(X_WB.size());
  states_.X_WB = X_WB;
  AddNodes();
  for (const Beam& beam : mechanism.beams) AddBeam(beam);
  AddJoints();
  AddDrives();
  AddSprings();
  AddOutput(mechanism.outputs[output]);
  B_.resize(static_cast<Eigen::Index>(rows_.size()), 6 * static_cast<Eigen::Index>(nodes_.size()));
  for (size_t i = 0; i < rows_.size(); ++i) B_.row(static_cast<Eigen::Index>(i)) = rows_[i];
}

void FrameModel::AddNodes() {
  is_elastic_.assign(mechanism_.bodies.size(), false);
  for (const Beam& beam : mechanism_.beams) is_elastic_[beam.body] = true;
  for (size_t b = 1; b < mechanism_.bodies.size(); ++b) {
    if (!is_elastic_[b]) nodes_.push_back({.body = static_cast<int>(b)});
  }
  const auto add = [&](int body, const Vec3& p) {
    const bool known = std::any_of(nodes_.begin(), nodes_.end(), [&](const Node& node) {
      return node.body == body && (node.p_B - p).norm() < kSamePoint * length_;
    });
    if (!known) nodes_.push_back({body, p});
  };
  for (const Beam& beam : mechanism_.beams) {
    add(beam.body, beam.p_from);
    add(beam.body, beam.p_to);
  }
}

int FrameModel::NodeAt(int body, const Vec3& p_B, const std::string& what) {
  if (body == 0) return -1;
  for (size_t n = 0; n < nodes_.size(); ++n) {
    if (nodes_[n].body != body) continue;
    if (!is_elastic_[body] || (nodes_[n].p_B - p_B).norm() < kSamePoint * length_) {
      return static_cast<int>(n);
    }
  }
  summary_.stop = Stop::kUnsupported;
  summary_.message = fmt::format("{} sits on the elastic body '{}' where no beam ends", what,
                                 mechanism_.bodies[body].name);
  return -1;
}

void FrameModel::AddRow(int parent_node, const Vec6& J_parent, int child_node, const Vec6& J_child,
                        bool translation) {
  VecX row = VecX::Zero(6 * static_cast<Eigen::Index>(nodes_.size()));
  const double scale = translation ? 1.0 / length_ : 1.0;
  const auto put = [&](int node, const Vec6& J) {
    if (node < 0) return;
    row.segment<3>(6 * node) += scale * J.head<3>();
    row.segment<3>(6 * node + 3) += scale * length_ * J.tail<3>();
  };
  put(parent_node, J_parent);
  put(child_node, J_child);
  rows_.push_back(std::move(row));
}

// How the end moves against where it would be if the beam moved rigidly with its start.
void FrameModel::AddBeam(const Beam& beam) {
  const int from = NodeAt(beam.body, beam.p_from, beam.name);
  const int to = NodeAt(beam.body, beam.p_to, beam.name);
  const Mat3 R_EW = (states_.X_WB[beam.body].linear() * beam.R_BE).transpose();
  // The end, from the body's origin.
  const Vec3 p_W = states_.X_WB[beam.body].linear() * beam.p_to;
  Mat6 J = Mat6::Zero();  // [ω; v of the origin] → [ω; v of the end] in beam axes
  J << R_EW, Mat3::Zero(), -R_EW * Skew(p_W), R_EW;
  elastic_.push_back({.name = beam.name,
                      .first_row = static_cast<int>(rows_.size()),
                      .rows = 6,
                      .root = BeamRoot(beam, length_)});
  for (int i = 0; i < 6; ++i) AddRow(from, -J.row(i), to, J.row(i), i >= 3);
}

void FrameModel::AddJoints() {
  for (const Joint& joint : mechanism_.joints) {
    const std::string what = fmt::format("joint '{}'", joint.name);
    const int parent = NodeAt(joint.parent, joint.X_PF.translation(), what);
    const int child = NodeAt(joint.child, joint.X_CM.translation(), what);
    const ConstraintRows rows = RowsOf(joint, states_, false);
    for (int i = 0; i < rows.rows; ++i) {
      AddRow(parent, rows.J_parent.row(i), child, rows.J_child.row(i), i < rows.translation_rows);
    }
  }
}

void FrameModel::AddSpringLine(const std::string& name, const ScalarRow& row, int parent_node,
                               int child_node, bool translation, double stiffness) {
  if (std::isfinite(stiffness)) {
    const double flexibility = 1.0 / stiffness / (translation ? length_ * length_ : 1.0);
    elastic_.push_back({.name = name,
                        .first_row = static_cast<int>(rows_.size()),
                        .rows = 1,
                        .root = MatX::Constant(1, 1, std::sqrt(flexibility))});
  }
  AddRow(parent_node, row.J_parent, child_node, row.J_child, translation);
}

void FrameModel::AddDrives() {
  for (const Drive& drive : mechanism_.drives) {
    const std::string what = fmt::format("drive '{}'", drive.name);
    int parent = -1, child = -1;
    if (const auto* leg = std::get_if<DistanceDrive>(&drive.kind)) {
      parent = NodeAt(leg->body_from, leg->p_from, what);
      child = NodeAt(leg->body_to, leg->p_to, what);
    } else {
      const Joint& joint = mechanism_.joints[std::get<JointDrive>(drive.kind).joint];
      parent = NodeAt(joint.parent, joint.X_PF.translation(), what);
      child = NodeAt(joint.child, joint.X_CM.translation(), what);
    }
    AddSpringLine(drive.name + " (servo)", DriveRow(mechanism_, drive, states_), parent, child,
                  PositionUnit(mechanism_, drive) == "m", drive.stiffness);
  }
  // Prescribed joints are held.
  for (const Prescribed& prescribed : mechanism_.prescribed) {
    const Joint& joint = mechanism_.joints[prescribed.joint];
    AddRow(NodeAt(joint.parent, joint.X_PF.translation(), joint.name),
           JointCoordinateRow(joint, 0, states_).J_parent,
           NodeAt(joint.child, joint.X_CM.translation(), joint.name),
           JointCoordinateRow(joint, 0, states_).J_child, IsLength(joint.kind, 0));
  }
}

void FrameModel::AddSprings() {
  for (const SpringDamper& spring : mechanism_.springs) {
    if (!(spring.stiffness > 0.0)) continue;
    Drive line;
    line.kind = DistanceDrive{.body_from = spring.body_from,
                              .p_from = spring.p_from,
                              .body_to = spring.body_to,
                              .p_to = spring.p_to};
    const std::string what = fmt::format("spring '{}'", spring.name);
    AddSpringLine(spring.name + " (spring)", DriveRow(mechanism_, line, states_),
                  NodeAt(spring.body_from, spring.p_from, what),
                  NodeAt(spring.body_to, spring.p_to, what), true, spring.stiffness);
  }
}

void FrameModel::AddOutput(const Output& output) {
  const std::string what = fmt::format("output '{}'", output.name);
  const Vec3 p_WO = states_.X_WB[output.body] * output.X_BO.translation();
  G_.setZero(6, 6 * static_cast<Eigen::Index>(nodes_.size()));
  const auto add = [&](int body, const Vec3& p_B, double sign) {
    const int node = NodeAt(body, p_B, what);
    if (node < 0) return;
    G_.block<3, 3>(0, 6 * node) += sign * Mat3::Identity();
    G_.block<3, 3>(3, 6 * node) -= sign / length_ * Skew(p_WO - states_.X_WB[body].translation());
    G_.block<3, 3>(3, 6 * node + 3) += sign * Mat3::Identity();
  };
  add(output.body, output.X_BO.translation(), 1.0);
  add(output.reference_body, output.X_RbR.translation(), -1.0);
}

std::string FrameModel::MostMovingJoint(const VecX& twists) const {
  std::string name;
  double most = 0.0;
  const auto rate = [&](int body, const Vec3& p_B, const Vec6& J) {
    for (size_t n = 0; n < nodes_.size(); ++n) {
      if (nodes_[n].body != body) continue;
      if (is_elastic_[body] && (nodes_[n].p_B - p_B).norm() >= kSamePoint * length_) continue;
      const auto V = twists.segment<6>(6 * static_cast<Eigen::Index>(n));
      return J.head<3>().dot(V.head<3>()) + length_ * J.tail<3>().dot(V.tail<3>());
    }
    return 0.0;
  };
  for (const Joint& joint : mechanism_.joints) {
    for (int c = 0; c < FreedomsOf(joint.kind); ++c) {
      const ScalarRow row = JointCoordinateRow(joint, c, states_);
      const double moved = std::abs(rate(joint.parent, joint.X_PF.translation(), row.J_parent) +
                                    rate(joint.child, joint.X_CM.translation(), row.J_child)) /
                           (IsLength(joint.kind, c) ? length_ : 1.0);
      if (moved <= most) continue;
      most = moved;
      name = joint.name;
    }
  }
  return name;
}

}  // namespace mbv::internal
