// How a numerical computation ended. Numerical trouble is returned, never thrown.
#pragma once

#include <chrono>
#include <ctime>
#include <string>

#include "base/types.h"

namespace mbv {

enum class Stop {
  kNotRun,         ///< pessimistic start value
  kDone,           ///< ran to the end
  kUnreachable,    ///< the commanded pose cannot be reached
  kSingular,       ///< a matrix that must be regular is not
  kLimit,          ///< a joint or stroke limit is violated
  kNoConvergence,  ///< an iteration did not converge
  kEngineFailure,  ///< MuJoCo reported an error or diverged
  kUnsupported,    ///< this formulation does not cover what the scenario asks for
};

/// The end of a witness' run, or of one evaluation within it.
struct [[nodiscard]] RunSummary {
  Stop stop = Stop::kNotRun;
  std::string message = "was not run";  ///< one sentence to read, with numbers
  double time_s = kNan;                 ///< scenario time of the trouble [s]
  std::string where = {};               ///< limb, drive or joint in trouble
  double amount = kNan;                 ///< by how much (see unit), e.g. the missing reach
  std::string unit = {};                ///< of `amount`
  double wall_s = 0.0;                  ///< time spent computing [s]
  double cpu_s = 0.0;                   ///< processor time of it, one thread's or a program's [s]
  bool names_where = false;             ///< `message` names `where`
  bool states_time = false;             ///< `message` states `time_s`

  [[nodiscard]] bool ok() const { return stop == Stop::kDone; }
  static RunSummary Done() { return {.stop = Stop::kDone, .message = "done"}; }
};

/// See math/bytes.h.
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<RunSummary>& summary) {
  visit(summary.stop), visit(summary.message), visit(summary.time_s), visit(summary.where);
  visit(summary.amount), visit(summary.unit), visit(summary.wall_s), visit(summary.cpu_s);
  visit(summary.names_where), visit(summary.states_time);
}

/// What a computation in this thread takes, from when this is made.
class ComputingTime {
 public:
  void StopInto(RunSummary* summary) const {
    summary->wall_s = std::chrono::duration<double>(Clock::now() - wall_).count();
    summary->cpu_s = ThreadSeconds() - cpu_s_;
  }
  /// Processor time of this thread [s].
  [[nodiscard]] static double ThreadSeconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }

 private:
  using Clock = std::chrono::steady_clock;
  const Clock::time_point wall_ = Clock::now();
  const double cpu_s_ = ThreadSeconds();
};

[[nodiscard]] inline const char* ToText(Stop stop) {
  switch (stop) {
    case Stop::kNotRun:
      return "not run";
    case Stop::kDone:
      return "done";
    case Stop::kUnreachable:
      return "unreachable pose";
    case Stop::kSingular:
      return "singular pose";
    case Stop::kLimit:
      return "limit violated";
    case Stop::kNoConvergence:
      return "no convergence";
    case Stop::kEngineFailure:
      return "engine failure";
    case Stop::kUnsupported:
      return "not supported";
  }
  return "?";
}

}  // namespace mbv
