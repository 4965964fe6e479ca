// Reads the trace channels of one sample from MuJoCo's data.
#pragma once

#include <vector>

#include "core/trace.h"
#include "simulation/constraint_system.h"
#include "simulation/loads.h"
#include "simulation/powers.h"

namespace mbv::simulation {

/// Expects positions, velocities (mj_comVel), accelerations qacc, body forces
/// (ConstraintSystem::EvaluateBodyForces()) and constraint forces efc_force of one and the same
/// instant in the system's data.
class Recorder {
 public:
  /// `work`: with WorkChannels().
  Recorder(ConstraintSystem* system, bool work);

  [[nodiscard]] std::vector<Channel> channels() const { return channels_; }

  /// Writes one row of the trace and the poses of all bodies. `work`: empty without channels for
  /// it.
  void Record(const Loads& loads, const VecX& work, Eigen::Ref<Eigen::RowVectorXd> row,
              std::vector<Pose>* X_WB);

  /// Force across its joint's axis that the parent exerts on the child, per element, in F's axes,
  /// by the data's accelerations and constraint forces. Evaluates the body forces.
  [[nodiscard]] std::vector<Vec3> ForcesAcross(const std::vector<size_t>& elements,
                                               const Loads& loads);

  /// True if something rubs.
  [[nodiscard]] bool has_bands() const {
    return columns_.Has(Quantity::kForceBand) || columns_.Has(Quantity::kBaseForceBand);
  }
  /// Half-widths of the forces of everything driven.
  void RecordBands(const VecX& bands, Eigen::Ref<Eigen::RowVectorXd> row) const;

 private:
  // Where a joint's reaction is read.
  struct ReactionPlace {
    int closure = -1;   // a connect or weld; otherwise the tree:
    int body_id = -1;   // MuJoCo body whose wrench from its parent is the reaction
    double sign = 1.0;  // −1 if that is the wrench of the child on the parent
  };
  [[nodiscard]] std::vector<Channel> MakeChannels(bool work);
  void FindReactionPlaces();
  void RecordDriven(Eigen::Ref<Eigen::RowVectorXd> row);
  void RecordOutputs(const std::vector<Pose>& X_WB, Eigen::Ref<Eigen::RowVectorXd> row) const;
  void RecordOutputRates(Eigen::Ref<Eigen::RowVectorXd> row) const;
  void RecordReactions(const Loads& loads, const std::vector<Pose>& X_WB,
                       Eigen::Ref<Eigen::RowVectorXd> row);
  void RecordAudit(const Loads& loads, const VecX& work, Eigen::Ref<Eigen::RowVectorXd> row);
  void RecordWork(const VecX& work, Eigen::Ref<Eigen::RowVectorXd> row) const;
  void TreeWrenches(const Loads& loads);
  void AddExternal(int body_id, const Vec3& p_W, const Vec3& force, const Vec3& moment);
  void AddTendon(int tendon, double force);
  void AddElement(size_t e);
  [[nodiscard]] Vec6 ReactionOf(int joint, const std::vector<Pose>& X_WB) const;
  [[nodiscard]] Vec6 ClosureWrench(int closure) const;
  void ExcludeDrives(int joint, double sign, Vec6* F_W) const;
  [[nodiscard]] double ElementForce(size_t e) const;

  ConstraintSystem* const system_;
  const EngineModel& engine_;
  std::vector<const Output*> rated_;  // outputs whose rates MuJoCo's bodies give
  const std::vector<Channel> channels_;
  const ChannelColumns columns_;
  std::vector<ReactionPlace> places_;  // per joint
  std::vector<std::vector<std::pair<int, int>>>
      driven_of_,                                 // per joint: (driven row, MuJoCo joint)
      coupled_of_;                                // per joint: (constraint row, MuJoCo joint)
  std::vector<std::vector<size_t>> elements_of_;  // per joint: force elements
  Eigen::Matrix<double, 6, Eigen::Dynamic> W_;  // per MuJoCo body: wrench from its parent about the
                                                // root's centre of mass, world axes
  VecX work_;
  Powers power_;
};

}  // namespace mbv::simulation
