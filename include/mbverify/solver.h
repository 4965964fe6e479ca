// What a program may ask of a closed-loop mechanism: poses, velocities, forces, Jacobians and the
// equations of motion in coordinates that it chooses. This header stands on Eigen alone.
//
//   const mbv::Model model = mbv::Model::Load("stewart");
//   mbv::Solver solver(model);                          // in its drives
//   mbv::Forces forces;
//   const mbv::Status status = solver.InverseDynamics(q, v, a, {}, &forces);
//
// SI units and radians. World axes, unless a comment says otherwise. Twists are [ω; v], wrenches in
// rows of reactions [f; m], as the channels of a run. A Model may be shared by threads, a Solver
// belongs to one thread at a time.
//
// Numerical trouble (a pose out of reach, a singular one) is a Status. Wrong arguments (an unknown
// name, a wrong size, a number that is not finite) throw std::invalid_argument; files that cannot
// be read throw InputError.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace mbv {

struct Mechanism;  // mechanism/mechanism.h

/// Something about a file or an argument, as the program prints it.
struct Note {
  bool is_error = true;
  std::string file;
  int line = 0, column = 0;  ///< from 1; 0: none
  std::string message, hint;
};

/// A model that cannot be loaded: all that was found, warnings included.
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::vector<Note> found);
  [[nodiscard]] const std::vector<Note>& notes() const { return notes_; }

 private:
  std::vector<Note> notes_;
};

/// How a computation ended.
struct [[nodiscard]] Status {
  enum class Kind {
    kDone,
    kUnreachable,    ///< the loops cannot be closed at these coordinates
    kSingular,       ///< the coordinates, or the drives, do not hold the mechanism there
    kNoConvergence,  ///< Newton's method did not converge
    kUnsupported     ///< the model has what this computation does not cover
  };
  Kind kind = Kind::kDone;
  std::string message = {};  ///< a sentence to read; "" when done
  std::string where = {};    ///< joint or drive in trouble; may be ""

  [[nodiscard]] bool ok() const { return kind == Kind::kDone; }
};

/// A mechanism as its file describes it. Copies share it.
class Model {
 public:
  /// `name`: of a model that the program comes with or that lies in models/, or the path of a
  /// model.yaml, URDF (.urdf) or MJCF (.xml). `parameters` of a model.yaml, other than its own.
  /// One thread loads at a time.
  [[nodiscard]] static Model Load(const std::string& name,
                                  const std::map<std::string, double>& parameters = {});

  [[nodiscard]] const std::string& name() const;
  [[nodiscard]] const std::string& file() const;
  /// Warnings, and what of the file is not modelled.
  [[nodiscard]] const std::vector<Note>& notes() const;
  /// At the home pose, prescribed joints included.
  [[nodiscard]] int degrees_of_freedom() const;

  // Names in the order in which arrays have them.
  [[nodiscard]] std::vector<std::string> drives() const;
  [[nodiscard]] std::vector<std::string> prescribed() const;  ///< prescribed joints
  [[nodiscard]] std::vector<std::string> joints() const;
  [[nodiscard]] std::vector<std::string> bodies() const;  ///< the first is the world
  [[nodiscard]] std::vector<std::string> outputs() const;
  /// What Load() takes others of, with their values.
  [[nodiscard]] std::map<std::string, double> parameters() const;
  /// All that may be a coordinate: drives, prescribed joints, OUTPUT.x … OUTPUT.yaw, joints
  /// (JOINT, or JOINT.0, JOINT.1 … where one has several coordinates).
  [[nodiscard]] std::vector<std::string> coordinates() const;

  /// "m" or "rad".
  [[nodiscard]] std::string UnitOf(const std::string& coordinate) const;
  /// Its value at the home pose.
  [[nodiscard]] double HomeOf(const std::string& coordinate) const;
  /// Its limits as the file states them; infinite where it states none.
  [[nodiscard]] std::pair<double, double> RangeOf(const std::string& coordinate) const;

  /// The whole description.
  [[nodiscard]] const Mechanism& mechanism() const;

 private:
  struct Data;
  explicit Model(std::shared_ptr<const Data> data);
  std::shared_ptr<const Data> data_;
};

/// A force and a moment on a body, at a point of it.
struct Wrench {
  std::string body;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< in the body's frame [m]
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< [N]
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< about the point [N m]
};

/// Where everything is, and how it moves.
struct State {
  Eigen::VectorXd drives, drive_rates, drive_accelerations;                ///< per drive
  Eigen::VectorXd prescribed, prescribed_rates, prescribed_accelerations;  ///< per prescribed joint
  /// Per output: x y z roll pitch yaw in its reference frame (roll-pitch-yaw about fixed x, y, z).
  Eigen::MatrixXd outputs;
  std::vector<Eigen::Isometry3d> bodies;  ///< pose of each body, the world first
  Eigen::MatrixXd twists;                 ///< bodies × 6: [ω; v of the body's origin]
  Eigen::MatrixXd accelerations;          ///< bodies × 6: their time derivatives
};

/// What holds and moves it.
struct Forces {
  Eigen::VectorXd drives;       ///< [N or N m], positive towards a larger position
  Eigen::VectorXd prescribed;   ///< of prescribed joints
  Eigen::VectorXd coordinates;  ///< along the chosen coordinates; what the drives do together
  /// Per joint: [fx fy fz mx my mz] of the parent on the child about the joint's frame on the
  /// child, in the axes of that on the parent; drive forces excluded.
  Eigen::MatrixXd reactions;
};

/// Rows of a batch: which of them ended how.
struct BatchStatus {
  std::vector<std::pair<Eigen::Index, Status>> failed;  ///< increasing rows; their results are NaN
  [[nodiscard]] bool ok() const { return failed.empty(); }
};

/// The mechanism as functions of chosen coordinates, as many as it has degrees of freedom that are
/// not prescribed. Prescribed joints that are not chosen stay at home.
///
/// A pose is searched from the one found last (the first time from home), by a way so short that
/// the assembly is kept. Where redundant drives or reactions leave a choice, least forces are
/// given, as in a run.
class Solver {
 public:
  /// `coordinates` of Model::coordinates(); none: its drives. Throws std::invalid_argument where
  /// they depend on each other at home, or are too many or too few, and says which would do.
  explicit Solver(const Model& model, const std::vector<std::string>& coordinates = {});
  ~Solver();
  Solver(Solver&&) noexcept;
  Solver& operator=(Solver&&) noexcept;

  [[nodiscard]] const Model& model() const;
  [[nodiscard]] const std::vector<std::string>& coordinates() const;
  /// Their number n.
  [[nodiscard]] Eigen::Index size() const;
  [[nodiscard]] Eigen::VectorXd home() const;
  /// The next pose is searched from home.
  void Restart();

  // One state. q, v, a: coordinates, their rates and accelerations, n each.

  Status Close(const Eigen::VectorXd& q, State* state);
  Status Move(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& a,
              State* state);
  /// Forces for a motion.
  Status InverseDynamics(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                         const Eigen::VectorXd& a, const std::vector<Wrench>& loads,
                         Forces* forces);
  /// The accelerations that drive forces [N or N m, per drive] give, prescribed joints at rest at
  /// home or as chosen. kUnsupported with dry friction at rest or friction that grows with load:
  /// `mbverify run` integrates those.
  Status ForwardDynamics(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                         const Eigen::VectorXd& drive_forces, const std::vector<Wrench>& loads,
                         Eigen::VectorXd* a);

  /// 6 × n: twist [ω; v] per unit rate of each coordinate. Of an output: of its frame, seen from
  /// its reference frame and in its axes; of a body, of its origin; of "BODY.FRAME", of the frame's
  /// origin; both in world axes. An output is meant where a body has the same name.
  Status Jacobian(const Eigen::VectorXd& q, const std::string& of, Eigen::MatrixXd* J);
  /// drives × n: rates of the drives per unit rate of each coordinate.
  Status DriveJacobian(const Eigen::VectorXd& q, Eigen::MatrixXd* J);

  // M a + bias = J_dᵀ (drive forces), all [n]; M and bias with rotors, springs, dampers, weight,
  // dry friction of what slides.
  Status MassMatrix(const Eigen::VectorXd& q, Eigen::MatrixXd* M);
  /// kUnsupported with friction that grows with its load: it is no function of q and v.
  Status Bias(const Eigen::VectorXd& q, const Eigen::VectorXd& v, Eigen::VectorXd* bias);
  /// The part of the bias at rest: weight and springs.
  Status Gravity(const Eigen::VectorXd& q, Eigen::VectorXd* gravity);

  /// ∂f/∂q, ∂f/∂v and ∂f/∂a of f = M a + bias, the force along each coordinate (n × n, columns per
  /// coordinate), without external forces. With friction that grows with its load, of f = J_dᵀ τ of
  /// the drives' forces. kUnsupported with dry friction that rests.
  struct ForceSlopes {
    Eigen::MatrixXd by_position, by_velocity, by_acceleration;
  };
  Status ForceDerivatives(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                          const Eigen::VectorXd& a, ForceSlopes* slopes);

  /// The map to all bodies: V = T v and A = T a + Σ_ij H_ij v_i v_j. T: 6·(bodies − 1) × n, the
  /// world left out; H: as many rows, n·n columns, H_ij in column i n + j.
  Status Derivatives(const Eigen::VectorXd& q, Eigen::MatrixXd* T, Eigen::MatrixXd* H);

  // Many states, one a row: blocks of kBlock rows on `threads` threads (0: all cores). Each block
  // begins at home and goes on from row to row, so that results do not depend on `threads`.
  // `progress` is called from these threads with the number of rows done; returning false ends the
  // batch, what is left counts as kNoConvergence "interrupted".
  static constexpr Eigen::Index kBlock = 256;
  using Progress = std::function<bool(Eigen::Index done)>;

  /// Drive positions, rows × drives.
  BatchStatus CloseRows(const Eigen::MatrixXd& q, Eigen::MatrixXd* drives, int threads = 0,
                        const Progress& progress = {}) const;
  /// Drive forces, rows × drives.
  BatchStatus InverseDynamicsRows(const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                                  const Eigen::MatrixXd& a, Eigen::MatrixXd* drive_forces,
                                  int threads = 0, const Progress& progress = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A paper's equations, as a scenario drives them: drive forces as functions of its commands, by
/// the closed form that its analytic witness takes. No loop is closed numerically.
class PaperEquations {
 public:
  /// `scenario`: MODEL/NAME or a file. Throws InputError where it cannot be read, where no closed
  /// form applies, and for scenarios with loads, which are functions of time.
  [[nodiscard]] static PaperEquations Load(const std::string& scenario);

  /// Columns of q, v, a: as the scenario names its commands, ties between drives last.
  [[nodiscard]] const std::vector<std::string>& commands() const;
  [[nodiscard]] std::vector<std::string> drives() const;  ///< columns of the forces
  [[nodiscard]] double duration_s() const;

  /// The scenario's own motion at some times [s]: positions, rates and accelerations of its
  /// commands, a row per time.
  void MotionAt(const Eigen::VectorXd& times_s, Eigen::MatrixXd* q, Eigen::MatrixXd* v,
                Eigen::MatrixXd* a) const;
  /// Drive forces, rows × drives; blocks and threads as of Solver::InverseDynamicsRows().
  BatchStatus InverseDynamicsRows(const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                                  const Eigen::MatrixXd& a, Eigen::MatrixXd* drive_forces,
                                  int threads = 0, const Solver::Progress& progress = {}) const;

 private:
  struct Data;
  explicit PaperEquations(std::shared_ptr<const Data> data);
  std::shared_ptr<const Data> data_;
};

}  // namespace mbv
