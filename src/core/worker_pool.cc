#include "core/worker_pool.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

namespace mbv {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kCannotStart = 127;               // as in shells
constexpr double kTick_s = 0.1;                 // between two looks at the table of what runs
constexpr std::chrono::milliseconds kPause{5};  // between two looks at the workers

struct Running {
  size_t job = 0;
  pid_t pid = 0;
  Clock::time_point start;
  bool timed_out = false;
};

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void Limit(__rlimit_resource resource, double bytes) {
  const auto most = static_cast<rlim_t>(bytes);
  const rlimit limit{most, most};
  if (bytes > 0.0) setrlimit(resource, &limit);
}

// In the child, between fork and exec: only calls that are safe there.
[[noreturn]] void BecomeWorker(const WorkerJob& job, char* const* argv, char** variables, int log,
                               pid_t parent) {
  setpgid(0, 0);  // its own group, to be killed as a whole
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kCannotStart);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  Limit(RLIMIT_DATA, job.data_bytes);
  Limit(RLIMIT_FSIZE, job.file_bytes);
  for (const int ours : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ}) signal(ours, SIG_DFL);
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, STDIN_FILENO);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  if (!job.folder.empty() && chdir(job.folder.c_str()) != 0) _exit(kCannotStart);
  environ = variables;
  execvp(argv[0], argv);
  const char* reason = std::strerror(errno);
  for (const char* text :
       {"cannot start ", static_cast<const char*>(argv[0]), ": ", reason, "\n"}) {
    if (write(STDERR_FILENO, text, std::strlen(text)) < 0) break;
  }
  _exit(kCannotStart);
}

// The worker's process id, or -1 with the reason.
pid_t Start(const WorkerJob& job, std::string* trouble) {
  std::error_code error;
  std::filesystem::create_directories(job.log.parent_path(), error);
  const int log = open(job.log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666);
  if (log < 0) {
    *trouble = "cannot write " + job.log.string() + ": " + std::strerror(errno);
    return -1;
  }
  const auto pointers = [](const std::vector<std::string>& words) {
    std::vector<char*> all;
    for (const std::string& word : words) all.push_back(const_cast<char*>(word.c_str()));
    all.push_back(nullptr);
    return all;
  };
  const std::vector<char*> argv = pointers(job.argv);
  std::vector<char*> variables;
  if (job.environment) variables = pointers(*job.environment);
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) {
    BecomeWorker(job, argv.data(), job.environment ? variables.data() : environ, log, parent);
  }
  if (pid < 0) *trouble = std::string("cannot start a process: ") + std::strerror(errno);
  if (pid > 0) setpgid(pid, pid);  // both sides set it, so that it is set before a kill
  close(log);
  return pid;
}

WorkerEnd EndOf(const Running& running, int status, const rusage& usage) {
  WorkerEnd end;
  end.timed_out = running.timed_out;
  if (WIFEXITED(status)) end.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) end.signal = WTERMSIG(status);
  if (end.exit_code == kCannotStart) end.trouble = "could not be started";
  end.cost.wall_s = SecondsSince(running.start);
  end.cost.cpu_s = Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
  end.cost.peak_kib = usage.ru_maxrss;
  return end;
}

void Kill(std::vector<Running>* all) {
  for (const Running& running : *all) kill(-running.pid, SIGKILL);
  for (const Running& running : *all) waitpid(running.pid, nullptr, 0);
  all->clear();
}

}  // namespace

bool WorkerPool::Run(const std::vector<WorkerJob>& jobs) const {
  std::vector<Running> all;
  size_t next = 0;
  Clock::time_point last_tick{};
  while (next < jobs.size() || !all.empty()) {
    if (stop != nullptr && *stop != 0) {
      Kill(&all);
      return false;
    }
    // Fill free places.
    while (next < jobs.size() && all.size() < static_cast<size_t>(parallel)) {
      if (started) started(next);
      WorkerEnd failed;
      const pid_t pid = Start(jobs[next], &failed.trouble);
      if (pid > 0) {
        all.push_back({next, pid, Clock::now(), false});
      } else {
        ended(next, failed);
      }
      ++next;
    }
    // Collect what ended, kill what takes too long.
    bool any = false;
    for (size_t i = 0; i < all.size();) {
      int status = 0;
      rusage usage{};
      if (wait4(all[i].pid, &status, WNOHANG, &usage) == all[i].pid) {
        const Running done = all[i];
        all.erase(all.begin() + static_cast<std::ptrdiff_t>(i));
        kill(-done.pid, SIGKILL);  // whatever it left behind
        ended(done.job, EndOf(done, status, usage));
        any = true;
        continue;
      }
      if (!all[i].timed_out && SecondsSince(all[i].start) > timeout_s) {
        all[i].timed_out = true;
        kill(-all[i].pid, SIGKILL);
      }
      ++i;
    }
    if (tick && SecondsSince(last_tick) > kTick_s) {
      tick();
      last_tick = Clock::now();
    }
    if (!any) std::this_thread::sleep_for(kPause);
  }
  return true;
}

}  // namespace mbv
