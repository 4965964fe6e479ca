#include "base/worker_pool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <sstream>
#include <thread>
#include <utility>

#include "base/files.h"

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
// `in`, `out`: its standard input and output; −1: nothing, and the log.
[[noreturn]] void BecomeWorker(const WorkerJob& job, char* const* argv, char** variables, int log,
                               pid_t parent, int in, int out) {
  setpgid(0, 0);  // its own group, to be killed as a whole
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kCannotStart);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  Limit(RLIMIT_DATA, job.data_bytes);
  Limit(RLIMIT_FSIZE, job.file_bytes);
  for (const int ours : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ}) signal(ours, SIG_DFL);
  dup2(in < 0 ? open("/dev/null", O_RDONLY) : in, STDIN_FILENO);
  dup2(out < 0 ? log : out, STDOUT_FILENO);
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
pid_t Start(const WorkerJob& job, std::string* trouble, int in = -1, int out = -1) {
  std::error_code error;
  std::filesystem::create_directories(job.log.parent_path(), error);
  const int log = open(job.log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666);
  if (log < 0) {
    *trouble = "cannot write " + job.log.string() + ": " + std::strerror(errno);
    return -1;
  }
  const auto pointers = [](const std::vector<std::string>& words) {
    std::vector<char*> all;
    all.reserve(words.size() + 1);
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
    BecomeWorker(job, argv.data(), job.environment ? variables.data() : environ, log, parent, in,
                 out);
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

namespace {

using Clock = std::chrono::steady_clock;
using Work = std::function<std::string(size_t)>;

bool WriteBytes(int pipe, const void* bytes, size_t count) {
  const char* at = static_cast<const char*>(bytes);
  while (count > 0) {
    const ssize_t n = write(pipe, at, count);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    at += n;
    count -= static_cast<size_t>(n);
  }
  return true;
}

// In the child: each text after its length, until something ends it.
[[noreturn]] void Serve(int pipe, pid_t parent, const Work& work, size_t first, size_t step,
                        size_t count, bool together) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (int stream = 0; stream < 3; ++stream) dup2(nothing, stream);
  constexpr size_t kMostBytes = 1 << 14;
  constexpr std::chrono::milliseconds kLongest{1};
  std::string pending;
  Clock::time_point written = Clock::now();
  try {
    for (size_t i = first; i < count; i += step) {
      const std::string text = work(i);
      const std::uint64_t size = text.size();
      pending.append(reinterpret_cast<const char*>(&size), sizeof size);
      pending += text;
      const auto now = Clock::now();
      const bool waits = together && pending.size() < kMostBytes && now - written < kLongest;
      if (waits && i + step < count) continue;
      if (!WriteBytes(pipe, pending.data(), pending.size())) _exit(1);
      pending.clear();
      written = now;
    }
  } catch (...) {
    _exit(1);
  }
  _exit(0);
}

// Texts from a pipe, each after its length.
class TextReader {
 public:
  void Open(int pipe) {
    pipe_ = pipe;
    received_.clear();
    at_ = 0;
  }
  // Empty at the end of the pipe or of the time.
  std::optional<std::string> Next(double timeout_s) {
    constexpr std::uint64_t kMostBytes = 64'000'000;
    std::uint64_t size = 0;
    Clock::time_point end{};  // not needed for what was received already
    if (received_.size() - at_ < sizeof size) end = EndOf(timeout_s);
    if (!Receive(sizeof size, end)) return std::nullopt;
    std::memcpy(&size, received_.data() + at_, sizeof size);
    if (size > kMostBytes) return std::nullopt;
    if (end == Clock::time_point{}) end = EndOf(timeout_s);
    if (!Receive(sizeof size + size, end)) return std::nullopt;
    std::string text = received_.substr(at_ + sizeof size, size);
    at_ += sizeof size + size;
    return text;
  }

 private:
  static Clock::time_point EndOf(double timeout_s) {
    return Clock::now() + std::chrono::milliseconds(static_cast<long>(1e3 * timeout_s));
  }
  // Until `count` bytes are there that were not taken yet.
  bool Receive(size_t count, Clock::time_point end) {
    constexpr size_t kAtOnce = 1 << 16;
    if (received_.size() - at_ >= count) return true;
    received_.erase(0, std::exchange(at_, 0));
    while (received_.size() < count) {
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
      pollfd waiting{pipe_, POLLIN, 0};
      const int ready = left > 0 ? poll(&waiting, 1, static_cast<int>(left)) : 0;
      if (ready < 0 && errno == EINTR) continue;
      if (ready <= 0) return false;
      const size_t before = received_.size();
      received_.resize(before + kAtOnce);
      const ssize_t n = read(pipe_, received_.data() + before, kAtOnce);
      received_.resize(before + static_cast<size_t>(std::max<ssize_t>(n, 0)));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) return false;
    }
    return true;
  }

  int pipe_ = -1;
  std::string received_;
  size_t at_ = 0;  // of what was not taken yet
};

// A child that gives the texts of work(first), work(first + step), …
class Child {
 public:
  Child() = default;
  ~Child() { End(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  void Start(const Work& work, size_t first, size_t step, size_t count, bool together) {
    int ends[2];
    const pid_t parent = getpid();
    if (pipe2(ends, O_CLOEXEC) != 0) return;
    pid_ = fork();
    if (pid_ == 0) Serve(ends[1], parent, work, first, step, count, together);
    close(ends[1]);
    pipe_ = ends[0];
    texts_.Open(pipe_);
    if (pid_ < 0) End();  // no processes left
  }
  [[nodiscard]] bool runs() const { return pid_ > 0; }
  // The next text; without one the child ends.
  std::optional<std::string> Next(double timeout_s) {
    auto text = runs() ? texts_.Next(timeout_s) : std::nullopt;
    if (!text) End();
    return text;
  }

 private:
  void End() {
    if (pipe_ >= 0) close(pipe_);
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    pid_ = pipe_ = -1;
  }

  pid_t pid_ = -1;
  int pipe_ = -1;
  TextReader texts_;
};

}  // namespace

int AllCores() { return static_cast<int>(std::max(1U, std::thread::hardware_concurrency())); }

void StreamFromChildren(
    size_t count, const ChildStreams& streams, const Work& work,
    const std::function<bool(size_t, const std::optional<std::string>&)>& take) {
  const size_t parallel = std::min(static_cast<size_t>(streams.parallel), count);
  std::vector<Child> children(parallel);
  for (size_t k = 0; k < parallel; ++k) {
    children[k].Start(work, k, parallel, count, streams.together);
  }
  for (size_t i = 0; i < count; ++i) {
    Child& child = children[i % parallel];
    if (!child.runs()) child.Start(work, i, parallel, count, false);
    if (!take(i, child.Next(streams.timeout_s))) return;
  }
}

void ShareOut(size_t count, int jobs, const Work& work,
              const std::function<void(size_t, const std::optional<std::string>&)>& take) {
  constexpr double kNever_s = 1e6;
  if (jobs <= 1) {
    for (size_t i = 0; i < count; ++i) take(i, work(i));
    return;
  }
  StreamFromChildren(count, {.parallel = jobs, .timeout_s = kNever_s}, work,
                     [&](size_t i, const std::optional<std::string>& text) {
                       take(i, text);
                       return true;
                     });
}

std::vector<std::optional<std::string>> InChildren(size_t count, double timeout_s,
                                                   const Work& work) {
  std::vector<std::optional<std::string>> texts;
  StreamFromChildren(count, {.parallel = 1, .timeout_s = timeout_s}, work,
                     [&](size_t, const std::optional<std::string>& text) {
                       texts.push_back(text);
                       return true;
                     });
  return texts;
}

std::string TimeText(double seconds) {
  if (seconds < 100.0) return fmt::format("{:.0f} s", seconds);
  if (seconds < 6000.0) return fmt::format("{:.0f} min", seconds / 60.0);
  return fmt::format("{:.1f} h", seconds / 3600.0);
}

std::string TimeLeft::Text(double fraction, double now_s) {
  constexpr double kTooEarly_s = 2.0, kTooLate_s = 1.0;
  if (first_ < 0.0 || fraction < last_) {
    first_ = fraction;
    start_s_ = now_s;
  }
  last_ = fraction;
  const double elapsed_s = now_s - start_s_;
  if (elapsed_s < kTooEarly_s || fraction <= first_) return "";
  const double left_s = elapsed_s * (1.0 - fraction) / (fraction - first_);
  return left_s < kTooLate_s ? "" : "about " + TimeText(left_s) + " left";
}

std::optional<std::string> FindProgram(const std::string& program) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (program.find('/') != std::string::npos) {
    return fs::is_regular_file(program, error) ? std::optional(program) : std::nullopt;
  }
  std::vector<fs::path> folders = {ProgramFile().parent_path()};
  const char* path = std::getenv("PATH");
  std::istringstream words(path == nullptr ? "" : path);
  for (std::string word; std::getline(words, word, ':');) folders.emplace_back(word);
  for (const fs::path& folder : folders) {
    const fs::path file = folder / program;
    if (!program.empty() && folder.is_absolute() && fs::is_regular_file(file, error) &&
        access(file.c_str(), X_OK) == 0) {
      return file.string();
    }
  }
  return std::nullopt;
}

std::vector<std::string> BareEnvironment() {
  constexpr const char* kHandedOn[] = {"PATH", "HOME", "USER",   "LOGNAME",
                                       "LANG", "TZ",   "TMPDIR", "MBV_MUJOCO_PACKAGE"};
  std::vector<std::string> bare;
  for (const char* name : kHandedOn) {
    if (const char* value = std::getenv(name)) bare.push_back(fmt::format("{}={}", name, value));
  }
  for (char** variable = environ; *variable != nullptr; ++variable) {
    if (std::string_view(*variable).starts_with("LC_")) bare.emplace_back(*variable);
  }
  return bare;
}

namespace {

constexpr size_t kLongestAnswer = 64u << 20;  // bytes

// What `status` of waitpid() says.
std::string EndText(int status) {
  if (WIFSIGNALED(status)) return fmt::format("was ended by signal {}", WTERMSIG(status));
  return fmt::format("ended with exit code {}", WEXITSTATUS(status));
}

// All of it, although the reader may be gone (no signal then) or slow.
bool SendAll(int pipe, const std::string& text, Clock::time_point until) {
  size_t at = 0;
  while (at < text.size()) {
    pollfd ready{pipe, POLLOUT, 0};
    const double left_s = -SecondsSince(until);
    if (left_s <= 0.0 || poll(&ready, 1, static_cast<int>(1e3 * left_s) + 1) <= 0) return false;
    const ssize_t n = write(pipe, text.data() + at, text.size() - at);
    if (n < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (n <= 0) return false;
    at += static_cast<size_t>(n);
  }
  return true;
}

}  // namespace

bool Conversation::running() const { return pid_ > 0 && owner_ == getpid(); }

Conversation::Answer Conversation::Call(const std::string& line, double timeout_s) {
  if (!running()) {
    End();
    std::array<int, 2> in{-1, -1}, out{-1, -1};
    if (pipe2(in.data(), O_CLOEXEC) != 0 || pipe2(out.data(), O_CLOEXEC) != 0) {
      for (const int end : {in[0], in[1], out[0], out[1]}) {
        if (end >= 0) close(end);
      }
      return {.line = {}, .trouble = Trouble::kNotStarted, .how = std::strerror(errno)};
    }
    std::string trouble;
    const pid_t pid = Start(job_, &trouble, in[0], out[1]);
    close(in[0]);
    close(out[1]);
    to_ = in[1];
    from_ = out[0];
    if (pid < 0) {
      End();
      return {.line = {}, .trouble = Trouble::kNotStarted, .how = trouble};
    }
    fcntl(to_, F_SETFL, fcntl(to_, F_GETFL) | O_NONBLOCK);
    pid_ = pid;
    owner_ = getpid();
  }
  const Clock::time_point until = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                                     std::chrono::duration<double>(timeout_s));
  const auto slow = [&] { return fmt::format("took longer than {:g} s", timeout_s); };
  // A program that ends early must not end this one.
  struct sigaction ignore {
  }, before{};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &ignore, &before);
  const bool sent = SendAll(to_, line + '\n', until);
  sigaction(SIGPIPE, &before, nullptr);
  if (!sent && -SecondsSince(until) <= 0.0) return Lost(Trouble::kTimedOut, slow());
  std::array<char, 65536> bytes;
  while (true) {
    if (const size_t end = received_.find('\n'); end != std::string::npos) {
      Answer answer{.line = received_.substr(0, end)};
      received_.erase(0, end + 1);
      return answer;
    }
    if (received_.size() > kLongestAnswer) return Lost(Trouble::kEnded, "answered without end");
    pollfd ready{from_, POLLIN, 0};
    const double left_s = -SecondsSince(until);
    const int any = left_s <= 0.0 ? 0 : poll(&ready, 1, static_cast<int>(1e3 * left_s) + 1);
    if (any < 0 && errno == EINTR) continue;
    if (any <= 0) return Lost(Trouble::kTimedOut, slow());
    const ssize_t n = read(from_, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return Lost(Trouble::kEnded, "");
    received_.append(bytes.data(), static_cast<size_t>(n));
  }
}

Conversation::Answer Conversation::Lost(Trouble trouble, const std::string& how) {
  Answer answer{.line = {}, .trouble = trouble, .how = how};
  int status = 0;
  if (trouble != Trouble::kEnded || !how.empty()) kill(-pid_, SIGKILL);
  // One that closed its pipes may go on.
  for (int k = 0; k < 100 && waitpid(pid_, &status, WNOHANG) == 0; ++k) {
    if (k == 50) kill(-pid_, SIGKILL);
    std::this_thread::sleep_for(kPause);
  }
  kill(-pid_, SIGKILL);
  pid_ = 0;
  if (how.empty()) answer.how = EndText(status);
  if (WIFEXITED(status) && WEXITSTATUS(status) == kCannotStart) {
    answer.trouble = Trouble::kNotStarted;
    answer.how = "could not be started";
  }
  End();
  return answer;
}

void Conversation::End() {
  if (to_ >= 0) close(to_);
  if (from_ >= 0) close(from_);
  to_ = from_ = -1;
  received_.clear();
  if (running()) {
    kill(-pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  pid_ = 0;
}

}  // namespace mbv
