// A compiled mechanism: MuJoCo's model with the places of everything the mechanism names.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/run_summary.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "simulation/engine/engine.h"
#include "simulation/mjcf/plan.h"

namespace mbv::simulation {

/// A driven coordinate (drives in model order, then prescribed joints).
struct DrivenPlace {
  std::string name;
  int equality = -1;  ///< of its guiding constraint
  bool is_tendon = false;
  int object = -1;      ///< tendon or joint
  int dof = -1;         ///< joints only
  double home = 0.0;    ///< the constraint's residual is position − home − eq_data[0]
  bool forced = false;  ///< moves by a given force: its guiding constraint is switched off
  int position_servo = -1, velocity_servo = -1, motor = -1;  ///< actuators of a servo
};

/// The coordinate of a force element: a joint's, a tendon's length, or one of a bushing between two
/// of MuJoCo's bodies.
struct ElementPlace {
  int joint = -1, dof = -1, qpos = -1;
  int tendon = -1;
  double rest_rate = 0.0;  ///< up to which dry friction rests (RestRate())
  int bushing_parent = -1, bushing_child = -1;
  int carrier = -1;       ///< MuJoCo's body whose turning a rotor feels
  bool armature = false;  ///< MuJoCo has such a rotor's inertia along its coordinate
  int turned = -1;        ///< MuJoCo's body that carries M, of a ball's friction about axes of M
                          ///< that are not MuJoCo's
  Vec3 axis_C = Vec3::Zero();  ///< there: M's axis on it, reversed where that body is inboard
  bool prescribed = false;  ///< commands move the coordinate, loops included, where others are free
};

struct EngineModel;
/// Whether an element acts on a ball or a free joint of MuJoCo.
[[nodiscard]] bool IsOfRoundJoint(const EngineModel& engine, size_t element);

/// A row of MuJoCo's frictionloss, and the elements with dry friction and rigid stops there.
struct FrictionPlace {
  int dof = -1, tendon = -1;  ///< one of both
  std::vector<size_t> elements;
};

struct EngineModel {
  const Mechanism* mechanism = nullptr;
  mjcf::Plan plan;
  ModelHandle m;             ///< set to dense Jacobians
  bool sparse = false;       ///< it asked for sparse ones, and can have them
  std::vector<int> body_id;  ///< per planned body
  std::vector<DrivenPlace> driven;
  std::vector<int> closure_equality;        ///< per planned closure
  std::vector<int> coupling_equality;       ///< per coupling
  std::vector<int> spring_tendon;           ///< per spring
  std::vector<ElementPlace> elements;       ///< per force element
  std::vector<FrictionPlace> frictions;     ///< in the order of MuJoCo's rows; AddFrictionRows()
  std::vector<std::vector<int>> joint_ids;  ///< per mechanism joint: MuJoCo joints, inner to outer
  std::vector<bool> dof_is_rotation3;       ///< first of three dofs of a ball (or of a free joint's
                                            ///< rotation): quaternion coordinates

  /// The planned body that carries a mechanism body, or -1 if it was merged.
  [[nodiscard]] int PlannedOf(int body) const { return plan.body_of[body]; }
};

/// Compiles the MJCF of a mechanism and makes the closures' anchors exact. Throws EngineError when
/// MuJoCo refuses it; returns kUnsupported for drives and force elements that have no scalar
/// coordinate in MuJoCo.
[[nodiscard]] RunSummary MakeEngineModel(const Mechanism& mechanism, const std::string& mjcf,
                                         EngineModel* engine);

/// MuJoCo's Jacobians for a while as the model asks for them: for its constraint stages, whose
/// sparse results no one else reads.
class OwnJacobians {
 public:
  explicit OwnJacobians(const EngineModel& engine)
      : m_(engine.m.get()),
        before_(std::exchange(m_->opt.jacobian, engine.sparse ? mjJAC_SPARSE : mjJAC_DENSE)) {}
  ~OwnJacobians() { m_->opt.jacobian = before_; }
  OwnJacobians(const OwnJacobians&) = delete;
  OwnJacobians& operator=(const OwnJacobians&) = delete;

 private:
  mjModel* m_;
  int before_;
};

/// The frames that a closure makes coincide, on its first and on its second body.
struct AnchorFrames {
  Pose X_1, X_2;
};
/// States both anchors of a `connect` or `weld` in MuJoCo's eq_data, for a weld the rotation of
/// body 2 in body 1 too: the compiler takes them from the reference pose.
void SetAnchors(bool weld, const AnchorFrames& frames, mjtNum* eq_data);

/// Takes out of a compiled model what only pictures need and MuJoCo would place at every step:
/// geoms, which collide with nothing, are gone, and sites that no tendon passes lie in their
/// bodies' frames. To be called before the data is made.
void LeaveOutShapes(EngineModel* engine);

/// What counts as rest in a motion of this length, for every force element.
void SetRestRates(double duration_s, EngineModel* engine);

/// Gives MuJoCo rows of frictionloss where elements have dry friction, or are rigid stops, on a
/// coordinate that is not prescribed, with the breakaway forces as losses. To be called before the
/// data is made.
void AddFrictionRows(EngineModel* engine);

/// True if the motion of some drive is not prescribed.
[[nodiscard]] bool IsReleased(const EngineModel& engine);
/// Gives MuJoCo the inertia of rotors with a carrier along their coordinates, as armature: what is
/// left of them is smaller than the inertia that it meets (element_forces.h).
void AddArmatures(EngineModel* engine);

/// Switches off the guiding constraints of the drives whose force the motion gives.
void ReleaseForcedDrives(const Motion& motion, EngineModel* engine);
/// Switches the guiding constraints of all drives on or off.
void PrescribeDrives(bool on, EngineModel* engine);
/// Finds the actuators of every drive, of a model written with servos. Throws EngineError if there
/// are none.
void FindServos(EngineModel* engine);

/// Poses of all mechanism bodies in the world from the data's current kinematics; merged bodies
/// from the joint coordinates of their chain.
void BodyPoses(const EngineModel& engine, const mjData& d, std::vector<Pose>* X_WB);

/// Pose of one MuJoCo body.
[[nodiscard]] Pose PoseOf(const mjData& d, int body_id);

}  // namespace mbv::simulation
