// Free motion of the reference: forward dynamics of any Mechanism.
//
// Poses and twists of all bodies are integrated by RK8(7)13M [Prince, Dormand 1981] with error
// control (Boost.Odeint) from accelerations of FreeDynamics, and with them the work of every drive;
// after every step the poses are put back onto the loops and commands, then the twists. Poses where
// the loops lose a constraint for an instant are passed (free_motion.h). No MuJoCo and no paper
// formula.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/run_summary.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

struct ForwardOptions {
  /// Largest error of one step in every pose and twist component (m, m/s, rad/s, quaternions),
  /// absolute and relative; > 0.
  double tolerance = 1e-12;
  bool reactions = true;  ///< record every joint's reaction channels
  /// Also integrate with 100 times the tolerance and from a slightly moved start, to state how far
  /// the result can be trusted.
  bool measure_trust = true;
  /// Steps (tried ones included) beyond four per sample, after which the integration gives up with
  /// kNoConvergence: something moves much faster than it is sampled. Runs that measure trust have
  /// twice as many.
  long spare_steps = 200000;
  std::function<void(double fraction)> progress = {};  ///< share of the work that is done
};

/// A singular pose that the motion passed or came close to.
struct SingularityCrossing {
  double time_s = kNan;
  double pivot = kNan;     ///< weakest constraint there over its largest value in this run
  std::string joint = {};  ///< moves most in the momentary DOF
  bool passed = false;     ///< the pivot vanishes there to within the search
};

struct ForwardRun {
  Trace trace;         ///< the reference's channels, then WorkChannels()
  RunSummary summary;  ///< kSingular, kNoConvergence, kUnsupported, or what the start failed with
  BodyStates start;    ///< at t = 0
  long steps = 0, evaluations = 0;
  std::vector<SingularityCrossing> singular;
  /// Largest difference over all samples to the run with 100 times the tolerance, in drive
  /// positions and outputs, lengths over the characteristic length [1]: an upper estimate of the
  /// integration error. Where the samples alone set the steps, to a run with half of them. At least
  /// round-off; NaN if not measured.
  double uncertainty = kNan;
  /// Largest ratio of the distance between two motions to that of their starts: how much a
  /// difference of the witnesses grows by itself. NaN if not measured.
  double growth = kNan;
};

/// States at t = 0: the commands and motion.initial met, velocities included.
[[nodiscard]] RunSummary InitialStates(const Mechanism& mechanism, const Motion& motion,
                                       BodyStates* states);

/// Integrates a free motion (motion.free()). Samples up to a failure are filled, the others NaN.
[[nodiscard]] ForwardRun RunForwardReference(const Mechanism& mechanism, const Motion& motion,
                                             const ForwardOptions& options = {});

}  // namespace mbv
