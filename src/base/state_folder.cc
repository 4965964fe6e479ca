#include "base/state_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

namespace mbv {

namespace fs = std::filesystem;

int LockFolder(const fs::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor < 0) return -1;
  while (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    if (errno == EINTR) continue;
    if (errno != EWOULDBLOCK) break;
    close(descriptor);
    errno = EWOULDBLOCK;
    return -1;
  }
  return descriptor;
}

StateLock::StateLock(const fs::path& root, double wait_s) : folder_(root / kStateFolder) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(wait_s);
  while (!TryOnce()) {
    if (Clock::now() > end) {
      trouble_ = fmt::format("cannot write below {}: another run is writing there", root.string());
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

bool StateLock::TryOnce() {
  if (mkdir(folder_.c_str(), 0777) != 0 && errno != EEXIST) {
    trouble_ = fmt::format("cannot make folder {}: {}", folder_.string(), std::strerror(errno));
    return true;
  }
  descriptor_ = LockFolder(folder_);
  if (descriptor_ < 0) {
    if (errno == EWOULDBLOCK || errno == ENOENT) return false;
    trouble_ = fmt::format("cannot use folder {}: {}", folder_.string(), std::strerror(errno));
    return true;
  }
  // Another one may have removed it, empty, while we waited.
  struct stat mine {
  }, there{};
  if (fstat(descriptor_, &mine) == 0 && lstat(folder_.c_str(), &there) == 0 &&
      mine.st_ino == there.st_ino && mine.st_dev == there.st_dev) {
    return true;
  }
  close(descriptor_);
  descriptor_ = -1;
  return false;
}

StateLock::~StateLock() {
  if (descriptor_ < 0) return;
  rmdir(folder_.c_str());  // only if it is empty
  close(descriptor_);
}

}  // namespace mbv
