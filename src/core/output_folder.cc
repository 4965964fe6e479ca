#include "core/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <sstream>
#include <vector>

#include "core/demand.h"
#include "core/files.h"
#include "core/folder_exchange.h"
#include "core/names.h"
#include "core/state_folder.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kListSchema = "mbverify.files/1";

std::string TroubleWith(const char* what, const fs::path& path, const std::string& reason) {
  return fmt::format("cannot {} {}: {}", what, path.string(), reason);
}

bool OnOtherDevice(const fs::path& a, const fs::path& b) {
  struct stat status_a {
  }, status_b{};
  return stat(a.c_str(), &status_a) == 0 && stat(b.c_str(), &status_b) == 0 &&
         status_a.st_dev != status_b.st_dev;
}

void SweepStages(const fs::path& state) {
  std::vector<fs::path> stages;
  std::error_code error;
  for (fs::directory_iterator entry(state, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().filename().string().starts_with("stage-")) stages.push_back(entry->path());
  }
  for (const fs::path& stage : stages) {
    const int lock = LockFolder(stage);
    if (lock < 0) continue;  // still being filled
    ClearStage(stage);
    close(lock);
  }
}

}  // namespace

std::set<std::string> ReadFileList(const fs::path& folder) {
  std::set<std::string> files;
  std::istringstream lines(ReadWholeFile(folder / kFileList).value_or(""));
  std::string line;
  if (!std::getline(lines, line) || line != kListSchema) return files;
  while (std::getline(lines, line)) {
    if (IsPlainPath(line)) files.insert(line);
  }
  files.insert(kFileList);
  return files;
}

OutputFolder::OutputFolder(fs::path root, std::string name)
    : root_(std::move(root)), target_(root_ / name), name_(std::move(name)) {
  if (root_.empty()) root_ = ".";
}

OutputFolder::~OutputFolder() {
  if (lock_ < 0) return;
  const StateLock state(stage_.parent_path().parent_path());
  ClearStage(stage_);
  close(lock_);
}

// Where the result goes really, and which folder the stage is made in.
std::string OutputFolder::Locate() {
  if (!IsPlainPath(name_)) return TroubleWith("make", target_, "this is no name of a result");
  std::error_code error;
  fs::create_directories(target_.parent_path(), error);
  if (error) return TroubleWith("make folder", target_.parent_path(), error.message());
  place_ = fs::absolute(target_, error);
  struct stat status {};
  if (lstat(place_.c_str(), &status) != 0) return "";
  if (S_ISLNK(status.st_mode)) {
    place_ = fs::canonical(place_, error);
    if (error) return TroubleWith("follow the link", target_, error.message());
  }
  if (!fs::is_directory(place_, error)) return TroubleWith("replace", target_, "it is no folder");
  return "";
}

std::string OutputFolder::Create() {
  if (std::string trouble = Locate(); !trouble.empty()) return trouble;
  // The exchange works within one file system only.
  const fs::path root = OnOtherDevice(root_, place_.parent_path()) ? place_.parent_path() : root_;
  const StateLock state(root);
  if (!state.trouble().empty()) return state.trouble();
  SweepStages(state.folder());
  stage_ = MakePrivateFolder(state.folder() / "stage-");
  if (stage_.empty())
    return TroubleWith("make folder", state.folder() / "stage", std::strerror(errno));
  if (mkdir((stage_ / "new").c_str(), 0777) != 0) {
    const std::string reason = std::strerror(errno);
    rmdir(stage_.c_str());
    return TroubleWith("make folder", stage_ / "new", reason);
  }
  lock_ = LockFolder(stage_);
  return lock_ >= 0 ? "" : TroubleWith("lock", stage_, std::strerror(errno));
}

std::string OutputFolder::Write(const std::string& name, const std::string& content) {
  return Write(name, [&](const auto& write) { write(content); });
}

std::string OutputFolder::Write(const std::string& name, const FileContent& content) {
  MBV_DEMAND(lock_ >= 0 && (IsPlainPath(name) || name == kFileList), name);
  const fs::path path = stage_ / "new" / name;
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
  std::string reason = file >= 0 ? "" : std::strerror(errno);
  const auto check = [&](bool good) {
    if (!good && reason.empty()) reason = std::strerror(errno);
  };
  if (file >= 0) {
    content([&](std::string_view piece) {
      if (reason.empty()) check(WriteBytes(file, piece));
    });
    check(Sync(file));
  }
  if (file >= 0) close(file);
  if (!reason.empty()) return TroubleWith("write", target_ / name, reason);
  files_.insert(name);
  return "";
}

std::string OutputFolder::Adopt(const fs::path& folder) {
  MBV_DEMAND(lock_ >= 0 && files_.empty(), folder.string());
  const fs::path content = stage_ / "new";
  if (rmdir(content.c_str()) != 0 || rename(folder.c_str(), content.c_str()) != 0) {
    return TroubleWith("move", folder, std::strerror(errno));
  }
  std::error_code error;
  for (fs::recursive_directory_iterator entry(content, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().lexically_relative(content).generic_string();
    const bool link = entry->is_symlink(error);
    if (name == kFileList || (!link && entry->is_directory(error))) continue;
    if (link || !entry->is_regular_file(error) || !IsPlainPath(name)) {
      return TroubleWith("publish", target_ / name, "it is no plain file");
    }
    const int file = open(entry->path().c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
    if (file < 0) return TroubleWith("read", entry->path(), std::strerror(errno));
    (void)fsync(file);
    close(file);
    files_.insert(name);
  }
  return error ? TroubleWith("read", content, error.message()) : "";
}

std::string OutputFolder::WriteList() {
  std::string list = fmt::format("{}\n", kListSchema);
  for (const std::string& file : files_) list += fmt::format("{}\n", file);
  return Write(kFileList, list);
}

std::string OutputFolder::Commit() {
  MBV_DEMAND(lock_ >= 0 && !committed_, target_.string());
  committed_ = true;
  if (std::string trouble = WriteList(); !trouble.empty()) return trouble;
  const StateLock state(stage_.parent_path().parent_path());
  if (!state.trouble().empty()) return state.trouble();
  return ExchangeFolders({stage_, place_, files_});
}

std::string OutputFolder::WriteAll(const std::vector<std::pair<std::string, std::string>>& files) {
  std::string trouble = Create();
  for (const auto& [name, content] : files) {
    if (trouble.empty()) trouble = Write(name, content);
  }
  return trouble.empty() ? Commit() : trouble;
}

}  // namespace mbv
