// Stiffness as the linear statics of a 3D frame of Euler–Bernoulli beams, rigid bodies and ideal
// joints, for any Mechanism with beams or servos. No formula of a paper.
#pragma once

#include <string>
#include <vector>

#include "base/run_summary.h"
#include "kinematics/constraints.h"
#include "math/stiffness.h"
#include "mechanism/mechanism.h"

// A mechanism as members between nodes, for frame_stiffness.cc. Internal to reference/.
//
// Used terms:
//   node     what moves as one rigid piece: a rigid body, or one beam end of an elastic body. Its
//            unknown is a small twist [ω; v] of the body's origin as if fixed to the piece, world
//            axes. The world does not move.
//   row      one scalar deformation δ = J V of a member: of a beam six, of a joint what it forbids,
//            of a drive, prescribed joint or spring its coordinate.
//   member   consecutive rows with their flexibility F, δ = F s; rigid: F = 0.
//
// Inside, lengths are measured in a characteristic length L: twists [ω; v/L], deformations in rad
// or L, forces f L beside moments m.

namespace mbv::internal {

struct FrameMember {
  std::string name;
  int first_row = 0, rows = 0;
  MatX root;  ///< rows × rows, F = rootᵀ root [rad/(N m), scaled]
};

class FrameModel {
 public:
  FrameModel(const Mechanism& mechanism, const std::vector<Pose>& X_WB, int output);

  /// Done, or what does not suit.
  [[nodiscard]] const RunSummary& summary() const { return summary_; }
  [[nodiscard]] double length() const { return length_; }
  /// Deformations of all rows by all nodes' twists, scaled; rows × 6·nodes.
  [[nodiscard]] const MatX& compatibility() const { return B_; }
  /// The elastic members: beams, servos, springs.
  [[nodiscard]] const std::vector<FrameMember>& elastic() const { return elastic_; }
  /// Displacement [rotation; translation/L] of the output by all nodes' twists; 6 × 6·nodes.
  [[nodiscard]] const MatX& output_motion() const { return G_; }
  /// The joint that moves most in a motion of the nodes, given scaled.
  [[nodiscard]] std::string MostMovingJoint(const VecX& twists) const;

 private:
  struct Node {
    int body = 0;
    Vec3 p_B = Vec3::Zero();  ///< elastic bodies: the beam end in the body
  };

  void AddNodes();
  void AddBeam(const Beam& beam);
  void AddJoints();
  void AddDrives();
  void AddSprings();
  void AddOutput(const Output& output);
  /// Node of the piece of `body` that holds the point; -1 the world, and after a finding.
  int NodeAt(int body, const Vec3& p_B, const std::string& what);
  void AddRow(int parent_node, const Vec6& J_parent, int child_node, const Vec6& J_child,
              bool translation);
  void AddSpringLine(const std::string& name, const ScalarRow& row, int parent_node, int child_node,
                     bool translation, double stiffness);

  const Mechanism& mechanism_;
  BodyStates states_;
  double length_;
  RunSummary summary_ = RunSummary::Done();
  std::vector<Node> nodes_;
  std::vector<bool> is_elastic_;  ///< per body
  std::vector<VecX> rows_;
  std::vector<FrameMember> elastic_;
  MatX B_, G_;
};

}  // namespace mbv::internal

namespace mbv {

/// Stiffness of output `output` with all drives held by their servos, in the pose X_WB (one pose
/// per body, loops closed), relative to the output's reference body, in world axes. Bodies with
/// beams move by their beam ends, all others are rigid; distance drives and springs act along their
/// lines; weights and preloads have no influence. Shares are those of the beams, then of the servos
/// ("DRIVE (servo)") and springs ("NAME (spring)") that are not rigid.
///
/// kSingular with K and rank where the output is free to move (`where`: the joint that moves most;
/// C is NaN), and with C alone where nothing elastic lies in the way of some load (K is infinite).
/// kUnsupported for a model without beams and servos, or where the output or a joint sits on an
/// elastic body beside its beam ends.
[[nodiscard]] StiffnessResult FrameStiffness(const Mechanism& mechanism,
                                             const std::vector<Pose>& X_WB, int output);

}  // namespace mbv
