// Kills a process before each of its system calls that change files, one after the other.
#pragma once

#include <elf.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/user.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <functional>
#include <map>

namespace mbv {

/// What std::filesystem::rename calls.
#ifdef SYS_rename  // not on newer architectures
inline constexpr long kRenameCall = SYS_rename;
#else
inline constexpr long kRenameCall = SYS_renameat;
#endif

class KillAtCalls {
 public:
  /// `work` runs in a child process and may exec.
  explicit KillAtCalls(std::function<void()> work) : work_(std::move(work)) {}

  /// System calls that fail with ENOSYS from their n-th time on, e.g. {SYS_renameat2, 1}: an older
  /// kernel or file system.
  std::map<long, int> missing;
  int exit_code = -1;  ///< of a child that ended by itself

  /// Runs the work and kills it before its `call`-th (1, 2, …) change of a file. True when it ended
  /// by itself: then there are fewer.
  [[nodiscard]] bool EndsBefore(int call) {
    const pid_t pid = fork();
    if (pid == 0) {
      ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
      raise(SIGSTOP);
      setenv("ASAN_OPTIONS", "detect_leaks=0", 1);  // which cannot be under ptrace
      work_();
      _exit(0);
    }
    int status = 0;
    waitpid(pid, &status, 0);
    ptrace(PTRACE_SETOPTIONS, pid, nullptr, PTRACE_O_TRACESYSGOOD | PTRACE_O_EXITKILL);
    int count = 0;
    std::map<long, int> times;
    for (long signal = 0;;) {
      ptrace(PTRACE_SYSCALL, pid, nullptr, signal);
      signal = 0;
      waitpid(pid, &status, 0);
      if (!WIFSTOPPED(status)) {
        exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
        return true;
      }
      if (WSTOPSIG(status) != (SIGTRAP | 0x80)) {
        if (WSTOPSIG(status) != SIGTRAP) signal = WSTOPSIG(status);  // SIGTRAP: after exec
        continue;
      }
      __ptrace_syscall_info info{};
      ptrace(PTRACE_GET_SYSCALL_INFO, pid, sizeof info, &info);
      if (info.op != PTRACE_SYSCALL_INFO_ENTRY) continue;
      const auto number = static_cast<long>(info.entry.nr);
      const auto refused = missing.find(number);
      if (refused != missing.end() && ++times[number] >= refused->second) Refuse(pid);
      if (!Changes(number, info.entry.args) || ++count < call) continue;
      kill(pid, SIGKILL);
      waitpid(pid, &status, 0);
      return false;
    }
  }

 private:
  static bool Changes(long number, const std::uint64_t* arguments) {
    static constexpr std::array<long, 15> kChanges = {
#ifdef SYS_rename  // not on newer architectures
        SYS_rename,    SYS_unlink,   SYS_mkdir,    SYS_rmdir,   SYS_link,   SYS_chmod,
#endif
        SYS_renameat2, SYS_renameat, SYS_unlinkat, SYS_mkdirat, SYS_linkat, SYS_fchmod,
        SYS_fchmodat,  SYS_fsync,    SYS_ftruncate};
    if (number == SYS_openat) return (arguments[2] & O_CREAT) != 0;
    if (number == SYS_write) return arguments[0] > 2;
    return std::find(kChanges.begin(), kChanges.end(), number) != kChanges.end();
  }

  // Makes the call it is about to do one that does not exist.
  static void Refuse(pid_t pid) {
#if defined(__x86_64__)
    user_regs_struct registers{};
    ptrace(PTRACE_GETREGS, pid, nullptr, &registers);
    registers.orig_rax = static_cast<unsigned long long>(-1);
    ptrace(PTRACE_SETREGS, pid, nullptr, &registers);
#elif defined(__aarch64__)
    int none = -1;
    iovec part{&none, sizeof none};
    ptrace(PTRACE_SETREGSET, pid, NT_ARM_SYSTEM_CALL, &part);
#else
    (void)pid;
    ADD_FAILURE() << "how is a system call refused on this processor?";
#endif
  }

  std::function<void()> work_;
};

}  // namespace mbv
