#include "base/scratch_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <vector>

#include "base/files.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPrefix = "mbverify-";
constexpr const char* kLock = ".mbverify-scratch";  // what makes a folder one of ours

// Takes the lock of a folder; -1 where another process holds it, or none can be taken.
int TakeLock(const fs::path& folder) {
  const int file = open((folder / kLock).c_str(), O_RDWR | O_NOFOLLOW | O_CLOEXEC);
  if (file < 0) return -1;
  struct stat status {};
  // A folder that was removed before the lock was taken is gone.
  if (fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid() &&
      flock(file, LOCK_EX | LOCK_NB) == 0 && fstat(file, &status) == 0 && status.st_nlink > 0) {
    return file;
  }
  close(file);
  return -1;
}

bool IsOwnFolder(const fs::path& path) {
  struct stat status {};
  return lstat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == geteuid();
}

// Removes scratch folders of processes that are gone; their locks went with them.
void SweepAbandoned(const fs::path& below) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator entry(below, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().filename().string().starts_with(kPrefix)) found.push_back(entry->path());
  }
  for (const fs::path& folder : found) {
    if (!IsOwnFolder(folder)) continue;
    const int lock = TakeLock(folder);
    if (lock < 0) continue;
    fs::remove_all(folder, error);
    close(lock);
  }
}

// --- Removal by a signal's handler, which may call nothing that allocates or locks. ---

struct Registered {
  std::atomic<pid_t> owner = 0;  // 0: free
  std::array<char, PATH_MAX> path{};
};
std::array<Registered, 16> registered;  // those beyond are left to the next sweep

constexpr std::array<int, 3> kEndings = {SIGINT, SIGTERM, SIGHUP};

struct DirectoryEntry {  // of getdents64
  std::uint64_t inode;
  std::int64_t offset;
  unsigned short length;
  unsigned char type;
  char name[1];
};

// What is in the open folder `at`.
void RemoveWithin(int at, int depth) {
  constexpr int kDeepest = 32;
  alignas(DirectoryEntry) std::array<char, 2048> buffer;
  // Removing moves what is left: once more until nothing goes.
  for (bool removed = true; removed && depth < kDeepest;) {
    removed = false;
    if (lseek(at, 0, SEEK_SET) != 0) return;
    long count = 0;
    while ((count = syscall(SYS_getdents64, at, buffer.data(), buffer.size())) > 0) {
      for (long i = 0; i < count;) {
        const auto* entry = reinterpret_cast<const DirectoryEntry*>(buffer.data() + i);
        const char* name = buffer.data() + i + offsetof(DirectoryEntry, name);
        i += entry->length;
        if (std::strcmp(name, ".") == 0 || std::strcmp(name, "..") == 0) continue;
        if (depth == 0 && std::strcmp(name, kLock) == 0) continue;  // it goes last
        if (unlinkat(at, name, 0) == 0) {
          removed = true;
          continue;
        }
        const int below = openat(at, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
        if (below < 0) continue;
        RemoveWithin(below, depth + 1);
        close(below);
        removed = unlinkat(at, name, AT_REMOVEDIR) == 0 || removed;
      }
    }
  }
}

void RemoveAllAndEnd(int signal_number) {
  const int saved = errno;
  for (Registered& one : registered) {
    if (one.owner.load() != getpid()) continue;
    const int at = open(one.path.data(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (at < 0) continue;
    RemoveWithin(at, 0);
    unlinkat(at, kLock, 0);
    // Where a child has just made another file the next sweep takes the rest.
    if (rmdir(one.path.data()) != 0) {
      close(openat(at, kLock, O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600));
    }
    close(at);
  }
  errno = saved;
  std::signal(signal_number, SIG_DFL);
  std::raise(signal_number);
}

// Whoever handles a signal already, or has it ignored (nohup), goes on doing so.
void HandleEndings() {
  for (const int ending : kEndings) {
    struct sigaction now {};
    if (sigaction(ending, nullptr, &now) != 0 || now.sa_handler != SIG_DFL) continue;
    struct sigaction handled {};
    handled.sa_handler = RemoveAllAndEnd;
    sigfillset(&handled.sa_mask);
    sigaction(ending, &handled, nullptr);
  }
}

void Register(const std::string& path) {
  if (path.size() >= PATH_MAX) return;
  for (Registered& one : registered) {
    // What a parent registered is not this process'.
    pid_t owner = one.owner.load();
    if (owner == getpid() || !one.owner.compare_exchange_strong(owner, -1)) continue;
    std::memcpy(one.path.data(), path.c_str(), path.size() + 1);
    one.owner.store(getpid());
    return;
  }
}

void Unregister(const std::string& path) {
  for (Registered& one : registered) {
    if (one.owner.load() == getpid() && path == one.path.data()) one.owner.store(0);
  }
}

}  // namespace

ScratchFolder::ScratchFolder(const std::string& purpose) : owner_(getpid()) {
  std::error_code error;
  const fs::path below = fs::temp_directory_path(error);
  if (error) {
    const char* place = std::getenv("TMPDIR");
    trouble_ = fmt::format("no folder for temporary files (TMPDIR={}): {}",
                           place == nullptr ? "" : place, error.message());
    return;
  }
  SweepAbandoned(below);
  HandleEndings();
  constexpr int kTries = 10;  // a sweep may come between making a folder and locking it
  for (int i = 0; i < kTries; ++i) {
    path_ = MakePrivateFolder(below / fmt::format("{}{}-", kPrefix, purpose));
    if (path_.empty()) break;
    if (Lock()) {
      Register(path_.string());
      return;
    }
    const int reason = errno;
    rmdir(path_.c_str());
    path_.clear();
    errno = reason;
    if (reason != ENOENT && reason != EWOULDBLOCK) break;
  }
  trouble_ = fmt::format("cannot make a folder in {}: {}", below.string(), std::strerror(errno));
}

// False with errno. Where files cannot be locked no sweep takes the folder, either.
bool ScratchFolder::Lock() {
  const std::string name = path_ / kLock;
  lock_ = open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
  if (lock_ < 0) return false;
  struct stat status {};
  const bool taken = flock(lock_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  if (!taken && fstat(lock_, &status) == 0 && status.st_nlink > 0) return true;
  close(lock_);
  lock_ = -1;
  errno = EWOULDBLOCK;
  return false;
}

ScratchFolder::~ScratchFolder() {
  if (path_.empty() || owner_ != getpid()) return;
  std::error_code error;
  fs::remove_all(path_, error);
  Unregister(path_.string());
  if (lock_ >= 0) close(lock_);
}

}  // namespace mbv
