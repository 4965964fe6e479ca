// A pool of worker processes: one program call each, with time limit and cost.
//
// Processes, not threads: the engine's XML loading uses process-wide state, and a crash or hang of
// one scenario must not take the others with it.
#pragma once

#include <csignal>
#include <cstddef>
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

// Work on untrusted input, in processes of its own: whatever it does ends a child, not the
// program.

/// As many processes as this machine runs at once; at least 1.
[[nodiscard]] int AllCores();

/// How StreamFromChildren() shares work out.
struct ChildStreams {
  int parallel = 1;          ///< children at once, at least 1
  double timeout_s = 300.0;  ///< for each text, from when it is the next one
  /// Texts that come within a millisecond are sent together: the last ones before a child's death
  /// are lost with it. Children that follow a lost one send each by itself.
  bool together = false;
};

/// Calls work(0) … work(count − 1) in child processes, and take(i, text) here, in that order; empty
/// where the child died or took longer. take() returns false to end all. A child that is ahead
/// waits, so that no more than a pipe's content of texts is kept.
void StreamFromChildren(size_t count, const ChildStreams& streams,
                        const std::function<std::string(size_t)>& work,
                        const std::function<bool(size_t, const std::optional<std::string>&)>& take);

/// As StreamFromChildren(), however long a text takes; where one job at once is wanted, work() is
/// called here. What work() gives must not depend on earlier calls: then nothing depends on `jobs`.
void ShareOut(size_t count, int jobs, const std::function<std::string(size_t)>& work,
              const std::function<void(size_t, const std::optional<std::string>&)>& take);

/// Calls work(0) … work(count − 1) in a child process and gives their texts back; empty where the
/// child died or took longer than `timeout_s`: another child goes on with the next.
[[nodiscard]] std::vector<std::optional<std::string>> InChildren(
    size_t count, double timeout_s, const std::function<std::string(size_t)>& work);

// A program that answers line by line, kept running between calls.

/// The file that a command's first word stands for: a path as it is, else what lies beside
/// mbverify, else what the absolute folders of PATH have. Empty if there is none.
[[nodiscard]] std::optional<std::string> FindProgram(const std::string& program);

/// What another person's program gets to know of the environment: where programs and its own
/// settings are, the language of its messages, and where temporary files go. Nothing that opens
/// doors.
[[nodiscard]] std::vector<std::string> BareEnvironment();

/// Started at the first call; dies with this object and with this process. Not for two threads.
class Conversation {
 public:
  /// `job.log` gets what the program writes to standard error.
  explicit Conversation(WorkerJob job) : job_(std::move(job)) {}
  ~Conversation() { End(); }
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  /// Why a call has no answer.
  enum class Trouble { kNone, kNotStarted, kEnded, kTimedOut };
  struct Answer {
    std::string line;  ///< without its end
    Trouble trouble = Trouble::kNone;
    std::string how = {};  ///< of trouble: "was ended by signal 9"
  };
  /// Writes `line` and waits for one; after trouble the program is gone, and the next call starts
  /// it again. A process that forked has its own.
  [[nodiscard]] Answer Call(const std::string& line, double timeout_s);
  /// Whether the next call would find the program running.
  [[nodiscard]] bool running() const;
  void End();

 private:
  [[nodiscard]] Answer Lost(Trouble trouble, const std::string& how);

  WorkerJob job_;
  int pid_ = 0, owner_ = 0;  // of the program, and of the process that started it
  int to_ = -1, from_ = -1;  // pipes
  std::string received_;     // behind the last line
};

// How long something will take, in words.

/// "12 s", "3 min", "2.5 h".
[[nodiscard]] std::string TimeText(double seconds);

/// How long the rest of something takes if it goes on as fast as so far.
class TimeLeft {
 public:
  /// "about 2 min left", of the fraction that is done at the time `now_s`; "" in the first seconds
  /// and in the last one. A fraction that falls is another thing's.
  [[nodiscard]] std::string Text(double fraction, double now_s);

 private:
  double start_s_ = 0.0, first_ = -1.0, last_ = -1.0;
};

}  // namespace mbv
