#include "core/in_children.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>

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
[[noreturn]] void Serve(int pipe, pid_t parent, size_t first, size_t count, const Work& work) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (int stream = 0; stream < 3; ++stream) dup2(nothing, stream);
  try {
    for (size_t i = first; i < count; ++i) {
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

}  // namespace

std::vector<std::optional<std::string>> InChildren(size_t count, double timeout_s,
                                                   const Work& work) {
  std::vector<std::optional<std::string>> texts;
  while (texts.size() < count) {
    int ends[2];
    const pid_t parent = getpid();
    const pid_t pid = pipe2(ends, O_CLOEXEC) == 0 ? fork() : -1;
    if (pid < 0) {  // no processes left: nothing is known about the rest
      texts.resize(count);
      break;
    }
    if (pid == 0) Serve(ends[1], parent, texts.size(), count, work);
    close(ends[1]);
    bool alive = true;
    while (alive && texts.size() < count) {
      texts.push_back(ReadText(ends[0], timeout_s));
      alive = texts.back().has_value();
    }
    close(ends[0]);
    kill(pid, SIGKILL);
    waitpid(pid, nullptr, 0);
  }
  return texts;
}

}  // namespace mbv
