// A mechanism linearised about a state: derivatives of its forces, A and B, natural frequencies and
// mode shapes.
//
// With the reduced model M a + h(q, v) = f(q, v, a) = J_dᵀ τ in chosen coordinates q (reference/
// reduced_model.h), about a state q, v under drive forces τ and with x = [δq; δv],
//   ẋ = A x + B δτ,  A = [0 1; ∂a/∂q ∂a/∂v],  B = [0; ∂a/∂τ]                                    (1)
//   ∂a/∂q = −M⁻¹ K,  K = ∂f/∂q − ∂(J_dᵀ τ)/∂q (+ J_dᵀ diag(k) J_d of servos that hold) (2) ∂a/∂v =
//   −M⁻¹ D,  D = ∂f/∂v
// Each eigenvalue σ ± iω of A is a mode: ω/2π is its frequency, −σ/|σ + iω| its damping ratio.
//
// ∂f is computed three times: by implicit differentiation of the reference (reference/
// derivatives.h), by dual numbers through the equations of features/certify, and by extrapolated
// differences of the reference's forces.
#pragma once

#include <complex>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "features/certify/certify.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "reference/reduced_model.h"
#include "report/data/data_file.h"
#include "report/report.h"
#include "verify/prepare.h"

namespace mbv {

struct LinearSettings {
  std::vector<std::string> coordinates;  ///< empty: drives first
  std::map<std::string, double> at;      ///< of coordinates; others are at home [SI]
  std::map<std::string, double> rates;
  /// Of drives; others exert none. Without any, those that hold the state without acceleration, as
  /// far as they can.
  std::map<std::string, double> forces;
  bool no_forces = false;    ///< drives exert none
  bool equilibrium = false;  ///< searches one near `at` first
  bool servos = false;       ///< drives hold their place with their stiffness
  bool mujoco = false;       ///< MuJoCo's own derivative beside ours
  std::string check;         ///< a JSON file with derivatives to be judged; "": none
  double check_limit = 1e-6;
  std::string program;  ///< a command, of whose derivatives the same is asked; "": none
  /// The state of this motion at `time_s`, with its loads, instead of `at` and `rates`; without
  /// forces that are stated, drives hold the motion. It outlives the call.
  const Motion* motion = nullptr;
  double time_s = 0.0;
};

struct VibrationMode {
  std::complex<double> eigenvalue;  ///< [1/s], imaginary part >= 0
  Eigen::VectorXcd shape;           ///< of the coordinates; the largest is 1 in its unit
  double frequency_hz = 0.0, damping_ratio = kNan;
  enum class Kind { kVibrates, kDecays, kGrows, kRigid } kind = Kind::kVibrates;
  /// The mechanism in it, kModeFrames over one period; loops stay closed.
  std::vector<std::vector<Pose>> X_WB;
};
constexpr int kModeFrames = 24;

/// How far a matrix of the user's is off.
struct DerivativeCheck {
  std::string of;         ///< "yours", or the program
  std::string matrix;     ///< "f_q", "f_v", "f_a", "A" or "B"
  double error = kNan;    ///< of its largest entry, in units of lengths and angles
  std::string explained;  ///< the term that it leaves out or has with the wrong sign; "": none
};

/// MuJoCo's mjd_transitionFD against A, of the largest entries of ∂a/∂q and ∂a/∂v; or its corrected
/// inverse dynamics, of ∂τ/∂q and ∂τ/∂v.
struct EngineDerivative {
  std::string engine;    ///< "MuJoCo 2.2.2"
  std::string softness;  ///< of mjd_transitionFD's equalities, or how else
  double position_error = kNan, velocity_error = kNan;
  std::string why_not = {};  ///< not empty: there is none
};

struct Linearisation;

/// Derivatives of drive forces and reactions, as the reference has them, against other ways to
/// them: of the reactions that are unique, and of what acts.
struct JudgedForces {
  EveryForce by;
  /// Of the largest entries; `difference_error`: NaN where there are no differences.
  double dual_error = kNan, difference_error = kNan;
  double dual_limit = kNan, difference_limit = kNan;

  [[nodiscard]] bool agrees() const {
    return dual_error <= dual_limit && difference_error <= difference_limit;
  }
  /// Channels of reactions that redundant constraints leave open.
  [[nodiscard]] std::vector<std::string> NotUnique(const Mechanism& mechanism) const;
};
/// Of everything at the state of `model`, by implicit differentiation and by dual numbers with
/// `motion`'s commands, which are the coordinates (of units `columns`) in the state `command`. Why
/// there is none, or "".
[[nodiscard]] std::string JudgeEveryForce(const Mechanism& mechanism, const Motion& motion,
                                          const VecX& columns, const CommandSample& command,
                                          const MatX& T, ReducedModel* model, JudgedForces* out);
/// Derivatives as `check` has them, of a program that gets the mechanism and this state
/// (docs/how-to/linearise.md); why there are none, or "".
[[nodiscard]] std::string DerivativesOfProgram(const std::string& command,
                                               const Mechanism& mechanism, const Linearisation& at,
                                               const BodyStates& states,
                                               const std::vector<LoadSample>& loads,
                                               std::string* answer);
/// mjd_transitionFD of MuJoCo 2.2.2, and of the newest where it is installed, at the state's poses
/// at rest. `T`, `unit`: of the coordinates.
[[nodiscard]] std::vector<EngineDerivative> AskMujoco(const Mechanism& mechanism,
                                                      const Linearisation& at,
                                                      const BodyStates& resting, const MatX& T,
                                                      const VecX& unit);
/// Extrapolated differences of the drive forces that the corrected engine's inverse dynamics gives
/// about the state. Moves `model`.
[[nodiscard]] EngineDerivative AskCorrectedMujoco(const Mechanism& mechanism,
                                                  const Linearisation& at, const VecX& unit,
                                                  ReducedModel* model);
/// The larger error of both kinds of forces.
[[nodiscard]] double EveryForceError(const Mechanism& mechanism, const VecX& columns,
                                     const EveryForce& by, const ForceSlopes& acting,
                                     const ForceSlopes& reactions);

struct Linearisation {
  Diagnostics diagnostics;
  std::vector<NamedCoordinate> coordinates, held;
  std::vector<std::string> drives;
  VecX q, v, a;            ///< the state; a follows from the forces
  VecX drive_force;        ///< τ
  double imbalance = 0.0;  ///< the largest of M a, of the largest force
  MatX mass, K, D;         ///< of (2)
  MatX A, B;
  ForceDerivatives by_reference;
  ExactDerivatives by_dual_numbers;
  ForceDerivatives by_differences;  ///< the three matrices alone
  /// Of the largest entries of ∂f/∂q, ∂f/∂v, ∂f/∂a, in units of lengths and angles.
  double dual_error = kNan, difference_error = kNan, dual_limit = kNan, difference_limit = kNan;
  double control = kNan;  ///< smallest singular value of loops and coordinates
  /// Of drive forces and reactions; `no_every`: why there are none.
  JudgedForces every;
  std::string no_every;
  std::vector<std::string> not_unique;  ///< channels of reactions that redundant constraints share
  std::vector<VibrationMode> modes;
  std::vector<DerivativeCheck> checks;
  std::vector<EngineDerivative> engines;  ///< judged by nothing
  std::string program_trouble;            ///< why a program that was asked is not judged
  std::vector<std::string> notes;         ///< what is left out
  double check_limit = kNan;

  [[nodiscard]] bool witnesses_agree() const {
    return dual_error <= dual_limit && difference_error <= difference_limit &&
           (!no_every.empty() || every.agrees());
  }
  [[nodiscard]] bool agrees() const;
};

/// What errors of derivatives relate to, lengths in characteristic lengths (`rows`, `columns`:
/// units of forces and coordinates): the largest entry of each matrix. One that vanishes is small
/// beside what the others make of it in the time of their own, √(|f_a|/|f_q|) or |f_a|/|f_v|, and
/// ∂f/∂q also beside the forces themselves and a share of the weights, or of what one unit per s²
/// needs.
class DerivativeScales {
 public:
  DerivativeScales(const Mechanism& mechanism, VecX rows, VecX columns, const ForceSlopes& by);
  /// The largest of ∂f/∂q, ∂f/∂v, ∂f/∂a against `by`; infinite where one is not finite.
  [[nodiscard]] double Error(const ForceSlopes& by, const ForceSlopes& other) const;
  [[nodiscard]] static double Largest(const MatX& x, const VecX& rows, const VecX& columns);
  /// No smaller than these.
  void Raise(const DerivativeScales& other);

 private:
  const VecX rows_, columns_;
  double q_ = 0.0, v_ = 0.0, a_ = 0.0;
};
/// Of dual numbers against implicit differentiation: 1e-10, and what rounding leaves open at this
/// smallest singular value of loops and coordinates.
[[nodiscard]] double DualLimit(double control);

/// The result has findings where there is none.
[[nodiscard]] Linearisation Linearise(const Mechanism& mechanism, const LinearSettings& settings);

/// Along a judged run's motion, of the forces along its commands with the scenario's loads, at
/// `samples` spread ones (0: all): both ways to the derivatives, in the run's parts. Where they
/// differ an agreement is taken away.
void AddDerivatives(const Prepared& prepared, size_t samples,
                    const std::function<void(double)>& progress, Report* report);

// Writers.

[[nodiscard]] std::string LinearisationText(const Linearisation& result, bool color,
                                            size_t columns);
[[nodiscard]] std::string LinearisationPage(const Linearisation& result,
                                            const Mechanism& mechanism);
[[nodiscard]] std::string LinearisationJson(const Linearisation& result,
                                            const Mechanism& mechanism);
/// For MATLAB, Octave, Python …; rows of `force` and its derivatives are `force_channels`,
/// eigenvalues have a real and an imaginary column.
[[nodiscard]] DataMatrices LinearisationMatrices(const Linearisation& result,
                                                 const Mechanism& mechanism);

}  // namespace mbv
