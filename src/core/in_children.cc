#include "core/in_children.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <thread>

namespace mbv {
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
                        size_t count) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (int stream = 0; stream < 3; ++stream) dup2(nothing, stream);
  try {
    for (size_t i = first; i < count; i += step) {
      const std::string text = work(i);
      const std::uint64_t size = text.size();
      if (!WriteBytes(pipe, &size, sizeof size) || !WriteBytes(pipe, text.data(), text.size())) {
        _exit(1);
      }
    }
  } catch (...) {
    _exit(1);
  }
  _exit(0);
}

// Reads `count` bytes; false at the end of the pipe or of the time.
bool ReadBytes(int pipe, void* bytes, size_t count, Clock::time_point end) {
  char* at = static_cast<char*>(bytes);
  while (count > 0) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    pollfd waiting{pipe, POLLIN, 0};
    const int ready = left > 0 ? poll(&waiting, 1, static_cast<int>(left)) : 0;
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return false;
    const ssize_t n = read(pipe, at, count);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    at += n;
    count -= static_cast<size_t>(n);
  }
  return true;
}

std::optional<std::string> ReadText(int pipe, double timeout_s) {
  constexpr std::uint64_t kMostBytes = 64'000'000;
  const auto end = Clock::now() + std::chrono::milliseconds(static_cast<long>(1e3 * timeout_s));
  std::uint64_t size = 0;
  if (!ReadBytes(pipe, &size, sizeof size, end) || size > kMostBytes) return std::nullopt;
  std::string text(size, '\0');
  if (!ReadBytes(pipe, text.data(), size, end)) return std::nullopt;
  return text;
}

// A child that gives the texts of work(first), work(first + step), …
class Child {
 public:
  Child() = default;
  ~Child() { End(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  void Start(const Work& work, size_t first, size_t step, size_t count) {
    int ends[2];
    const pid_t parent = getpid();
    if (pipe2(ends, O_CLOEXEC) != 0) return;
    pid_ = fork();
    if (pid_ == 0) Serve(ends[1], parent, work, first, step, count);
    close(ends[1]);
    pipe_ = ends[0];
    if (pid_ < 0) End();  // no processes left
  }
  [[nodiscard]] bool runs() const { return pid_ > 0; }
  // The next text; without one the child ends.
  std::optional<std::string> Next(double timeout_s) {
    auto text = runs() ? ReadText(pipe_, timeout_s) : std::nullopt;
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
};

}  // namespace

int AllCores() { return static_cast<int>(std::max(1U, std::thread::hardware_concurrency())); }

void StreamFromChildren(
    size_t count, const ChildStreams& streams, const Work& work,
    const std::function<bool(size_t, const std::optional<std::string>&)>& take) {
  const size_t parallel = std::min(static_cast<size_t>(streams.parallel), count);
  std::vector<Child> children(parallel);
  for (size_t k = 0; k < parallel; ++k) children[k].Start(work, k, parallel, count);
  for (size_t i = 0; i < count; ++i) {
    Child& child = children[i % parallel];
    if (!child.runs()) child.Start(work, i, parallel, count);
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

}  // namespace mbv
