#include "pipeline/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <stdio.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>

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

}  // namespace

OutputFolder::OutputFolder(fs::path target) : target_(std::move(target)) {
  temporary_ = target_.parent_path() / (TemporaryPrefix(target_) + std::to_string(getpid()));
}

OutputFolder::~OutputFolder() {
  std::error_code error;
  if (created_) fs::remove_all(temporary_, error);
}

std::string OutputFolder::Create() {
  std::error_code error;
  if (fs::exists(target_, error) &&
      (!fs::is_directory(target_, error) ||
       (!fs::is_empty(target_, error) && !fs::exists(target_ / "summary.json", error)))) {
    return Trouble("replace", target_, "it holds something that is no mbverify result");
  }
  fs::create_directories(target_.parent_path(), error);
  if (error) return Trouble("make folder", target_.parent_path(), error.message());
  RemoveLeftovers();
  fs::create_directory(temporary_, error);
  if (error) return Trouble("make folder", temporary_, error.message());
  created_ = true;
  return "";
}

std::string OutputFolder::Write(const std::string& name, const std::string& content) {
  MBV_DEMAND(created_, name);
  const fs::path path = temporary_ / name;
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  errno = 0;
  std::ofstream stream(path, std::ios::binary);
  stream.write(content.data(), static_cast<std::streamsize>(content.size()));
  stream.close();
  if (stream) return "";
  return Trouble("write", target_ / name, std::strerror(errno));
}

std::string OutputFolder::Commit() {
  MBV_DEMAND(created_, target_.string());
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
  created_ = false;
  return "";
}

void OutputFolder::RemoveLeftovers() const {
  std::error_code error;
  const std::string prefix = TemporaryPrefix(target_);
  for (const auto& entry : fs::directory_iterator(target_.parent_path(), error)) {
    const std::string name = entry.path().filename();
    if (!name.starts_with(prefix)) continue;
    int process = 0;
    const char* end = name.data() + name.size();
    const auto parsed = std::from_chars(name.data() + prefix.size(), end, process);
    if (parsed.ec != std::errc() || parsed.ptr != end) continue;
    const bool alive = process != getpid() && (kill(process, 0) == 0 || errno == EPERM);
    std::error_code ignored;
    if (!alive) fs::remove_all(entry.path(), ignored);
  }
}

}  // namespace mbv
