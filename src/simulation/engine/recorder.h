// Reads the trace channels of one sample from MuJoCo's data.
#pragma once

#include <array>
#include <vector>

#include "base/types.h"
#include "math/trace.h"
#include "simulation/engine/constraint_system.h"
#include "simulation/engine/engine_model.h"
#include "simulation/engine/loads.h"

// Powers and energies of MuJoCo's state, and the work that the powers do over a run.

namespace mbv::simulation {

/// What is put in by what [W].
struct Powers {
  VecX rates;  ///< WorkRates()
  double gravity = 0.0, springs = 0.0;
  double rotors = 0.0;  ///< what goes into the rotors of force elements

  /// Per driven coordinate: drives, then prescribed joints.
  [[nodiscard]] auto driven() const { return rates.head(rates.size() - 2); }
  [[nodiscard]] double loads() const { return rates[rates.size() - 2]; }
  [[nodiscard]] double dampers() const { return rates[rates.size() - 1]; }
};
/// What WorkChannels() integrates, of velocities, forces and loads last evaluated: the driven
/// coordinates, then loads and dampers [W].
void WorkRates(const ConstraintSystem& system, const Loads& loads, VecX* rates);
/// The same and what is stored.
void FindPowers(const ConstraintSystem& system, const Loads& loads, Powers* power);

/// Energies [J]; gravity's counts from the world's origin.
struct Energies {
  double kinetic = 0.0, gravity = 0.0, springs = 0.0;
};
[[nodiscard]] Energies EnergiesOf(const ConstraintSystem& system);

/// Integrates powers along the nodes of Integrator, with fourth order like the motion:
///   W_{n+1} = W_n + h/24 (9 P_{n+1} + 19 P_n − 5 P_{n−1} + P_{n−2})                           (1)
/// where it takes a multistep, else by Simpson's rule.
class WorkMeter {
 public:
  void Start(const VecX& power);
  /// The same node with another power, after a jump of the forces.
  void Jump(const VecX& power) { power_[0] = power; }
  void Middle(const VecX& power) { middle_ = power; }
  /// Adds what an impact does at this node to the work of the dampers, the last one [J].
  void Add(double energy) { work_.tail<1>().array() += energy; }
  /// The step of length `h` to a node with this power.
  void Step(double h, bool multistep, const VecX& power);
  [[nodiscard]] const VecX& work() const { return work_; }

 private:
  VecX work_, middle_;
  std::array<VecX, 3> power_;  ///< at the last nodes, newest first
};

// How fast an output moves, from MuJoCo's own body velocities and accelerations.
//
// Neither the drives' rates nor the commanded ones enter: what comes out judges both.

/// Time derivatives of an output's components x, y, z [m], roll, pitch, yaw [rad] in its reference
/// frame. NaN in roll and yaw where the pitch is ±90°.
struct OutputRates {
  Vec6 velocity = Vec6::Constant(kNan);
  Vec6 acceleration = Vec6::Constant(kNan);
};

/// False if one of the output's two bodies was merged into another one.
[[nodiscard]] bool HasOutputRates(const EngineModel& engine, const Output& output);
/// The same of a joint's bodies.
[[nodiscard]] bool HasJointRates(const EngineModel& engine, const Joint& joint);

/// Expects positions, mj_comVel and mj_rnePostConstraint (cacc) of one instant in `d`.
[[nodiscard]] OutputRates OutputRatesOf(const EngineModel& engine, const mjData& d,
                                        const Output& output);

/// Rate and acceleration of a joint's coordinate, not of a spherical joint.
struct CoordinateRates {
  double velocity = kNan, acceleration = kNan;
};
/// From how the joint's two bodies move, as OutputRatesOf().
[[nodiscard]] CoordinateRates JointRatesOf(const EngineModel& engine, const mjData& d,
                                           const Joint& joint, int coordinate);

/// What friction by load grows with, times its coefficient: the columns are loads of one and the
/// other bearing times their radius, in F's axes, and the thrust times its or a coupling's force.
using BearingLoad = Mat3;

/// Expects positions, velocities (mj_comVel), accelerations qacc, body forces
/// (ConstraintSystem::EvaluateBodyForces()) and constraint forces efc_force of one and the same
/// instant in the system's data.
class Recorder {
 public:
  /// `joints`: Motion::RecordedJoints(). `work`: with WorkChannels().
  Recorder(ConstraintSystem* system, std::vector<Coordinate> joints, bool work);

  [[nodiscard]] std::vector<Channel> channels() const { return channels_; }

  /// Writes one row of the trace and the poses of all bodies. `work`: empty without channels for
  /// it.
  void Record(const Loads& loads, const VecX& work, Eigen::Ref<Eigen::RowVectorXd> row,
              std::vector<Pose>* X_WB);

  /// Per element with friction by load, by the data's accelerations and constraint forces.
  /// Evaluates the body forces.
  [[nodiscard]] std::vector<BearingLoad> LoadsOf(const std::vector<size_t>& elements,
                                                 const Loads& loads);

  /// True if there is dry friction.
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
  void RecordJoints(const std::vector<Pose>& X_WB, Eigen::Ref<Eigen::RowVectorXd> row) const;
  void RecordReactions(const Loads& loads, const std::vector<Pose>& X_WB,
                       Eigen::Ref<Eigen::RowVectorXd> row);
  void RecordAudit(const Loads& loads, const VecX& work, Eigen::Ref<Eigen::RowVectorXd> row);
  void RecordWork(const VecX& work, Eigen::Ref<Eigen::RowVectorXd> row) const;
  void TreeWrenches(const Loads& loads);
  void AddExternal(int body_id, const Vec3& p_W, const Vec3& force, const Vec3& moment);
  void AddTendon(int tendon, double force);
  void AddElement(size_t e);
  [[nodiscard]] Vec6 ReactionOf(int joint, const std::vector<Pose>& X_WB) const;
  [[nodiscard]] static BearingLoad InBearings(const Mechanism& mechanism,
                                              const ForceElement& element, const Vec6& reaction,
                                              const std::vector<Pose>& X_WB);
  [[nodiscard]] Vec6 ClosureWrench(int closure) const;
  [[nodiscard]] Vec6 AxisOfRound(const ElementPlace& place) const;
  void ExcludeDrives(int joint, double sign, Vec6* F_W) const;
  [[nodiscard]] double ElementForce(size_t e) const;

  ConstraintSystem* const system_;
  const EngineModel& engine_;
  std::vector<const Output*> rated_;  // outputs whose rates MuJoCo's bodies give
  const std::vector<Coordinate> joints_;
  const std::vector<Channel> channels_;
  const ChannelColumns columns_;
  std::vector<ReactionPlace> places_;  // per joint
  std::vector<std::vector<std::pair<int, int>>>
      driven_of_,                                 // per joint: (driven row, MuJoCo joint)
      coupled_of_;                                // per joint: (constraint row, MuJoCo joint)
  std::vector<std::vector<size_t>> elements_of_;  // per joint: force elements
  std::vector<std::array<int, 2>> universal_;     // per joint: MuJoCo's hinges of a universal one
  Eigen::Matrix<double, 6, Eigen::Dynamic> W_;  // per MuJoCo body: wrench from its parent about the
                                                // root's centre of mass, world axes
  VecX beside_drives_;                          // per driven coordinate: Loads::joint_forces()
  VecX work_;
  Powers power_;
};

}  // namespace mbv::simulation
