// What refining the step and the constraint time constant of the forward simulation shows, and
// whether that is what its schemes promise. The orders are derived in
// docs/explanation/convergence.md.
#pragma once

#include <string>
#include <vector>

#include "base/types.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"

// Orders of convergence from errors at several steps, and Richardson's extrapolation.
//
// An error C h^p is a straight line of slope p in logarithmic axes. Coarse steps that are not yet
// in the asymptotic range curve it at one end, round-off at the other; the fit takes what lies
// between.

namespace mbv {

/// Relative errors below this are round-off whatever they do [1].
inline constexpr double kRoundoffError = 1e-12;
/// Relative errors that stop falling below this are a round-off plateau [1]: constraint forces are
/// differences of large numbers, which costs up to five digits.
inline constexpr double kLargestPlateau = 1e-10;
/// An order is as expected when it is nearer than this; neighbouring whole orders are
/// distinguished.
inline constexpr double kOrderTolerance = 0.5;

struct OrderFit {
  double order = kNan;           ///< least squares over the asymptotic range; NaN: not determined
  double order_error = kNan;     ///< its standard error; NaN with two points
  std::vector<double> pairwise;  ///< entry i: order between points i − 1 and i; NaN at the first
  std::vector<bool> fitted;      ///< in the asymptotic range
  std::vector<bool> floor;       ///< round-off, or another cause that the caller named

  [[nodiscard]] int first_fitted() const;  ///< index or -1
  [[nodiscard]] int last_fitted() const;   ///< index or -1
};

/// Fits error = C step^order.
/// \param step       descending, > 0
/// \param error      relative errors >= 0, one per step; NaN where there is none
/// \param ignorable  levels below which an error has another cause than the step, one per step
/// \param plateau    level below which errors that stop falling are round-off
[[nodiscard]] OrderFit FitOrder(const std::vector<double>& step, const std::vector<double>& error,
                                const std::vector<double>& ignorable,
                                double plateau = kLargestPlateau);

/// Orders that a scheme promises, [lowest, highest].
struct ExpectedOrder {
  double lowest = kNan, highest = kNan;
};
[[nodiscard]] std::string ToText(const ExpectedOrder& expected);

struct OrderVerdict {
  bool judged = false;   ///< false: nothing to judge, `text` says why
  bool finding = false;  ///< the order is not the expected one
  std::string text = "not judged";
};
/// A finding: the fitted order is not as expected, or the error falls more slowly between finer
/// points above the floor.
[[nodiscard]] OrderVerdict JudgeOrder(const OrderFit& fit, const ExpectedOrder& expected);

/// Richardson's extrapolation from two steps: value = fine + factor (fine − coarse), with the grid
/// convergence index safety · factor · |fine − coarse| as uncertainty
/// [Roache 1997, Annu. Rev. Fluid Mech. 29, 123–160, §§ 4.2, 5.2].
struct Richardson {
  double order = kNan;
  double factor = kNan;  ///< 1/(ratio^order − 1)
  double safety = kNan;  ///< 1.25 with an order observed on three steps or more, 3 otherwise
};
/// The order is that of `fit`, at most the lowest one of `expected`, which also serves where `fit`
/// has none (at least 1).
[[nodiscard]] Richardson MakeRichardson(double coarse_step, double fine_step, const OrderFit& fit,
                                        const ExpectedOrder& expected);

/// What a series of runs refines.
enum class Knob {
  kBoth,          ///< the step, and with it the time constant, which is a fixed number of steps
  kStep,          ///< the step at a fixed time constant
  kTimeConstant,  ///< the time constant at a fixed step
};

/// An error apart for smooth samples and for those near a break of the commanded motion.
struct ErrorPair {
  double smooth = kNan, breaks = kNan;
};

/// Which samples are near a break: from the start of the motion, or from a jump of one of its
/// derivatives, on for `window_s`.
struct SampleClasses {
  double window_s = kNan;
  std::vector<bool> near_break;  ///< per sample

  SampleClasses() = default;
  SampleClasses(const std::vector<double>& times_s, const std::vector<double>& breaks_s,
                double window);
  [[nodiscard]] size_t smooth() const;
  /// Largest part of the RMS error near breaks that can be left in the RMS error of the smooth
  /// samples, if constraints are stabilized with this time constant: the stabilization damps what a
  /// break leaves like (1 + t/tc) exp(−t/tc).
  [[nodiscard]] double Remains(double time_constant_s) const;
};

/// Forces of all drives: samples × drives. Every drive must have its channel.
[[nodiscard]] MatX DriveForceTable(const Mechanism& mechanism, const Trace& trace);

/// RMS of a force difference over the RMS of the true forces at all samples, worst unit [1]; NaN
/// for a class without samples.
[[nodiscard]] ErrorPair RelativeError(const Mechanism& mechanism, const MatX& difference,
                                      const MatX& truth, const SampleClasses& classes);

/// One forward run.
struct ConvergencePoint {
  double step_s = kNan, time_constant_s = kNan;
  long steps = 0;
  double cpu_s = kNan;       ///< processor time of the step loop
  double closure_m = kNan;   ///< largest loop gap
  double pose_m = kNan;      ///< largest distance of an output from inverse mode, smooth samples
  ErrorPair error = {};      ///< drive forces against inverse mode
  ErrorPair change = {};     ///< drive forces against the run before; NaN at the first
  std::string failure = {};  ///< not empty: this run gave nothing
};

struct ConvergenceSeries {
  std::string name, title;
  bool stock = false;  ///< of MuJoCo as it is, not of the corrected engine
  Knob knob = Knob::kBoth;
  std::vector<ConvergencePoint> points = {};  ///< coarse to fine
  double extent_m = kNan;                     ///< largest coordinate of an output

  ExpectedOrder expected = {};  ///< set by Judge, with all below
  bool by_changes = false;      ///< orders of `change`: the limit of the series is not the truth
  bool smooth = true;           ///< false: no sample is smooth, those near breaks are judged
  OrderFit fit = {}, breaks_fit = {};
  OrderVerdict verdict = {};
  ExpectedOrder expected_pose = {};  ///< of `pose_m`; NaN unless both knobs are refined
  OrderFit pose_fit = {};
  OrderVerdict pose_verdict = {};
  std::vector<std::string> notes = {};
};
/// Knob value of a point [s].
[[nodiscard]] double KnobOf(const ConvergenceSeries& series, const ConvergencePoint& point);
/// The judged errors of a series, coarse to fine.
[[nodiscard]] std::vector<double> JudgedErrors(const ConvergenceSeries& series);

void Judge(const SampleClasses& classes, ConvergenceSeries* series);

/// A drive's force at step zero, smooth samples.
struct ExtrapolatedDrive {
  std::string drive, unit;
  double rms = kNan;          ///< of the extrapolated force
  double uncertainty = kNan;  ///< grid convergence index, RMS
  double error = kNan;        ///< RMS distance of the extrapolated force from inverse mode
};
struct ForceExtrapolation {
  double coarse_s = kNan, fine_s = kNan;  ///< steps used; NaN: nothing to extrapolate
  Richardson richardson;
  double index = kNan;    ///< grid convergence index over the RMS force, worst unit [1]
  double error = kNan;    ///< distance from inverse mode over the RMS force, worst unit [1]
  double allowed = kNan;  ///< for `error`
  bool pass = false;
  std::vector<ExtrapolatedDrive> drives;
};
/// Extrapolates the forces of a judged series from the two finest runs above the floor.
/// \param forces  per point; empty where the run failed
[[nodiscard]] ForceExtrapolation ExtrapolateForces(const Mechanism& mechanism,
                                                   const ConvergenceSeries& series,
                                                   const std::vector<MatX>& forces,
                                                   const MatX& truth, const SampleClasses& classes);

struct ConvergenceReport {
  std::string scenario, mechanism;
  double sample_s = kNan, duration_s = kNan;
  double window_s = kNan;  ///< what counts as near a break
  size_t breaks = 0, samples = 0, smooth_samples = 0;
  std::vector<ConvergenceSeries> series = {};
  ForceExtrapolation extrapolation = {};

  [[nodiscard]] bool finding()
      const;  ///< an order, or the extrapolated forces, are not as expected
};

}  // namespace mbv
