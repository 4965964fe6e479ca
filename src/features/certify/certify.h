// Proved digits: forces of a motion with bounds that hold every real solution near the reference's.
//
// At chosen samples the equations of exact_model.h are solved in interval arithmetic:
//   closure   Krawczyk's test: ‖1 − R J(X)‖ ρ + ‖R φ(q̃)‖ < ρ proves that one and only one solution
//             lies within ρ of q̃, and where                                                   (1)
//   rates, accelerations, forces, reactions
//             A x = b with A and b enclosed, R ≈ A⁻¹: |x − x̃| ≤ |R (b − A x̃)| / (1 − ‖1 − R A‖) (2)
//   distance from the nearest singular matrix, in the norm of the largest row sum:
//             (1 − ‖1 − R A‖)/‖R‖ ≤ 1/‖A⁻¹‖ ≤ (1 + ‖1 − R A‖)/‖R‖                              (3)
// [Krawczyk 1969; Neumaier, Interval Methods for Systems of Equations; Rump, Acta Numerica 2010].
// Lengths count by the characteristic length.
//
// What is proved is about the numbers as they stand: the description's and the commands' doubles.
// The reference gives the pose near which is searched, and nothing else. Of loops that are closed
// more than once, as many equations are taken as are independent; how far the others are violated
// at the solution is said.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "math/trace.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "reference/reduced_model.h"
#include "report/report.h"
#include "verify/prepare.h"

namespace mbv {

/// |x − value| <= radius, of the decimal number `text` as it is written.
struct ProvedValue {
  std::string channel;  ///< as traces call it: "leg1.force"
  std::string unit;
  std::string text;     ///< about as many digits as are proved
  double value = kNan;  ///< nearest double
  double radius = kNan;
  bool force = false;  ///< of a drive or a prescribed joint
};

struct SampleProof {
  size_t index = 0;  ///< of the sample
  double time_s = kNan;
  std::string why_not;  ///< not empty: nothing is proved
  int bits = 0;
  double unique_within = kNan;  ///< ρ of (1), per characteristic length or radian
  /// (3) of loops with commands, and of forces.
  double closure_distance_low = kNan, closure_distance_high = kNan;
  double force_distance_low = kNan, force_distance_high = kNan;
  double left_open = 0.0;  ///< the largest value of the equations that are not needed [m or 1]
  /// Drives: position, velocity, acceleration, force; prescribed joints: base force; reactions of
  /// all joints where statics leaves none open.
  std::vector<ProvedValue> values;

  [[nodiscard]] bool proved() const { return why_not.empty(); }
};

/// How far a witness lies from what is proved.
struct WitnessProof {
  std::string witness;
  size_t values = 0;         ///< that were compared
  size_t reactions = 0;      ///< of them
  double force_error = 0.0;  ///< at most, of the largest force of this unit along the motion
  /// At least: it is certainly off by this.
  double force_error_at_least = 0.0;
  double motion_error = 0.0;  ///< as force_error, of positions, velocities, accelerations
  double reaction_error = 0.0;
  double time_s = kNan;  ///< of the largest error of forces
  std::string channel;
  bool engine = false;  ///< integrates: its own limits judge it
  bool wrong = false;   ///< lies outside by more than `limit`
  double limit = kNan;

  /// Of forces that are proved: −log10 of the error.
  [[nodiscard]] double digits() const;
  /// Of one that is wrong.
  [[nodiscard]] std::string Sentence() const;
};

struct Certificate {
  std::string why_not;  ///< not empty: the motion is of a kind that is not served
  std::vector<SampleProof> samples;
  std::vector<WitnessProof> witnesses;
  std::vector<std::string> left_out;  ///< sentences: what the proof does not say

  [[nodiscard]] size_t proved() const;
  [[nodiscard]] const WitnessProof* FirstWrong() const;
  /// "drive forces proved to 13 digits at 11 of 11 samples".
  [[nodiscard]] std::string Sentence() const;
};

struct CertifyOptions {
  size_t samples = 10;  ///< spread over the motion, with the first and the last; 0: all
  /// Errors of forces beyond which a computed witness is wrong.
  double limit = 1e-9;
  /// Rates of equations that are not needed for the pose may contradict the others' by this share.
  double contradiction = 1e-9;
  int least_bits = 113;  ///< more where they do not suffice
  std::function<void(double)> progress = {};
};

/// What a witness recorded.
struct CertifiedTrace {
  std::string witness;
  const Trace* trace = nullptr;
  bool engine = false;  ///< a simulation, a table, a program: its own limits judge it
  double limit = kNan;  ///< of these; NaN: none
};

/// In addition to the spread samples, that is proved where the witnesses' forces differ most.
[[nodiscard]] Certificate Certify(const Mechanism& mechanism, const Motion& motion,
                                  const std::vector<CertifiedTrace>& traces,
                                  const CertifyOptions& options = {});

/// Of the forces along the commands, as coordinates q, that hold a state q, v, a (`command`):
/// values, ∂f/∂q, ∂f/∂v and ∂f/∂a, columns per coordinate.
struct ExactDerivatives : ForceSlopes {
  /// As an input: forces of drives and prescribed joints instead, which have to be unique.
  bool of_drives = false;
  /// Joints · 6, under these forces; of redundant constraints some that balance.
  ForceSlopes reactions;
};
/// By the same evaluator in dual numbers: as far as doubles go, nothing is enclosed. Near the poses
/// `near`. Why there are none, or "". Slopes of loads that are expressions are extrapolated
/// differences.
[[nodiscard]] std::string DifferentiateExactly(const Mechanism& mechanism, const Motion& motion,
                                               const BodyStates& near, const CommandSample& command,
                                               ExactDerivatives* out);

// A certificate as it is shown, and what it does to a verdict.

/// Certifies a judged run, of the mechanism with the scenario's common parameters: adds
/// `certificate` to its parts. A computed witness that is wrong by proof takes an agreement away,
/// and names the culprit of a disagreement.
void AddCertificate(const Prepared& prepared, const CertifyOptions& options, Report* report);

}  // namespace mbv
