#include "pipeline/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <vector>

#include "core/demand.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::string Trouble(const char* what, const fs::path& path, const std::string& reason) {
  return fmt::format("cannot {} {}: {}", what, path.string(), reason);
}

std::string TemporaryPrefix(const fs::path& target) {
  return "." + target.filename().string() + ".tmp-";
}

// Descriptor of a folder with a lock that ends with this process, or -1.
int LockFolder(const fs::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return -1;
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
  close(descriptor);
  return -1;
}

}  // namespace

OutputFolder::OutputFolder(fs::path target, std::string marker)
    : target_(std::move(target)), marker_(std::move(marker)) {
  temporary_ = target_.parent_path() / (TemporaryPrefix(target_) + std::to_string(getpid()));
}

OutputFolder::~OutputFolder() {
  if (lock_ < 0) return;
  std::error_code error;
  fs::remove_all(temporary_, error);
  close(lock_);
}

std::string OutputFolder::Create() {
  std::error_code error;
  if (fs::exists(target_, error) &&
      (!fs::is_directory(target_, error) ||
       (!fs::is_empty(target_, error) && !fs::exists(target_ / marker_, error)))) {
    return Trouble("replace", target_, "it holds something that is no mbverify result");
  }
  fs::create_directories(target_.parent_path(), error);
  if (error) return Trouble("make folder", target_.parent_path(), error.message());
  RemoveLeftovers();
  fs::create_directory(temporary_, error);
  if (error) return Trouble("make folder", temporary_, error.message());
  lock_ = LockFolder(temporary_);
  return lock_ >= 0 ? "" : Trouble("lock", temporary_, std::strerror(errno));
}

std::string OutputFolder::Write(const std::string& name, const std::string& content) {
  return Write(name, [&](const auto& write) { write(content); });
}

std::string OutputFolder::Write(const std::string& name, const FileContent& content) {
  MBV_DEMAND(lock_ >= 0, name);
  const fs::path path = temporary_ / name;
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  errno = 0;
  std::ofstream stream(path, std::ios::binary);
  content([&](std::string_view piece) {
    stream.write(piece.data(), static_cast<std::streamsize>(piece.size()));
  });
  stream.close();
  if (stream) return "";
  return Trouble("write", target_ / name, std::strerror(errno));
}

std::string OutputFolder::Commit() {
  MBV_DEMAND(lock_ >= 0, target_.string());
  std::error_code error;
  if (fs::exists(target_, error)) {
    if (renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) == 0) {
      return "";  // the destructor removes what is now the old result
    }
    // File systems without exchange: a moment without a result, never half of one.
    fs::remove_all(target_, error);
  }
  fs::rename(temporary_, target_, error);
  if (error) return Trouble("make", target_, error.message());
  return "";
}

void OutputFolder::RemoveLeftovers() const {
  std::error_code error;
  std::vector<fs::path> leftovers;
  for (const auto& entry : fs::directory_iterator(target_.parent_path(), error)) {
    const std::string name = entry.path().filename();
    if (name.starts_with(TemporaryPrefix(target_))) leftovers.push_back(entry.path());
  }
  for (const fs::path& leftover : leftovers) {
    const int lock = LockFolder(leftover);
    if (lock < 0) continue;  // still being filled
    fs::remove_all(leftover, error);
    close(lock);
  }
}

}  // namespace mbv
