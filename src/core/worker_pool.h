// A pool of worker processes: one program call each, with time limit and cost.
//
// Processes, not threads: the engine's XML loading uses process-wide state, and a crash or hang of
// one scenario must not take the others with it.
#pragma once

#include <csignal>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace mbv {

/// What a worker process used.
struct Cost {
  double wall_s = 0.0, cpu_s = 0.0;
  long peak_kib = 0;  ///< largest resident size

  [[nodiscard]] double peak_mib() const { return static_cast<double>(peak_kib) / 1024.0; }
};

struct WorkerJob {
  std::vector<std::string> argv;      ///< program and arguments
  std::filesystem::path log;          ///< stdout and stderr go here
  std::filesystem::path folder = {};  ///< to work in; empty: the present one
  double data_bytes = 0.0;            ///< memory of its own that it may have; 0: no limit
  double file_bytes = 0.0;            ///< length of each file that it writes; 0: no limit
  /// "NAME=value" of each variable that it gets; empty: those of this process.
  std::optional<std::vector<std::string>> environment = {};
};

/// How a worker ended.
struct WorkerEnd {
  int exit_code = -1;      ///< -1 if it did not end by itself
  int signal = 0;          ///< that ended it
  bool timed_out = false;  ///< killed by us
  std::string trouble;     ///< it could not be started
  Cost cost;
};

struct WorkerPool {
  int parallel = 1;          ///< at least 1
  double timeout_s = 300.0;  ///< wall time of one worker
  std::function<void(size_t job)> started;
  std::function<void(size_t job, const WorkerEnd& end)> ended;
  std::function<void()> tick;                        ///< about ten times a second
  const volatile std::sig_atomic_t* stop = nullptr;  ///< not 0: kill the workers and return

  /// Runs all jobs in order; false if stopped. Workers die with this process, however it ends.
  [[nodiscard]] bool Run(const std::vector<WorkerJob>& jobs) const;
};

}  // namespace mbv
