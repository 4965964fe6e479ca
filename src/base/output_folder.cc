#include "base/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "base/demand.h"
#include "base/files.h"

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

namespace {

// The steps of OutputFolder::Commit(), and how they are taken up again after a kill.
//
// A stage holds
//   new/     the new result; after the exchange what was there before
//   old/     what was there before, on file systems that cannot exchange
//   place    from here on the exchange may have happened: where to, and which old files are ours

struct Exchange {
  std::filesystem::path stage;
  std::filesystem::path target;  ///< absolute, no link itself
  std::set<std::string> files;   ///< of the new result, its list included
};

namespace fs = std::filesystem;

constexpr const char* kPlaceSchema = "mbverify.stage/1";

std::string Trouble(const char* what, const fs::path& path, const std::string& reason) {
  return fmt::format("cannot {} {}: {}", what, path.string(), reason);
}

std::optional<struct stat> StatusOf(const fs::path& path) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) return std::nullopt;
  return status;
}

bool IsFolder(const std::optional<struct stat>& status) {
  return status && S_ISDIR(status->st_mode);
}

bool SameInode(const std::optional<struct stat>& a, const std::optional<struct stat>& b) {
  return a && b && a->st_ino == b->st_ino && a->st_dev == b->st_dev;
}

bool MoveToNothing(const fs::path& from, const fs::path& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno != EINVAL && errno != ENOSYS) return false;
  return !StatusOf(to) && rename(from.c_str(), to.c_str()) == 0;
}

// Names in a folder, sorted; empty with an error where it cannot be read.
std::vector<std::string> NamesIn(const fs::path& folder, std::error_code* error) {
  std::vector<std::string> names;
  for (fs::directory_iterator entry(folder, *error), end; !*error && entry != end;
       entry.increment(*error)) {
    names.push_back(entry->path().filename());
  }
  std::sort(names.begin(), names.end());
  return names;
}

void SyncTree(const fs::path& folder) {
  std::error_code error;
  for (const std::string& name : NamesIn(folder, &error)) {
    if (IsFolder(StatusOf(folder / name))) SyncTree(folder / name);
  }
  SyncFolder(folder);
}

// Results of versions that wrote no list: the files that a new result of this kind has.
std::set<std::string> OursIn(const fs::path& folder, const std::set<std::string>& files) {
  std::set<std::string> ours = ReadFileList(folder);
  if (!ours.empty()) return ours;
  const bool result = std::any_of(files.begin(), files.end(), [&](const std::string& file) {
    if (!file.ends_with(".json")) return false;
    const std::string head = ReadWholeFile(folder / file).value_or("").substr(0, 100);
    return head.find("\"schema\": \"mbverify.") != std::string::npos;
  });
  return result ? files : ours;
}

// What a folder holds that is not ours goes into the new one as a second name of the same file, so
// that it is there before and after the exchange.
class Carrier {
 public:
  Carrier(const Exchange& exchange, std::set<std::string> ours)
      : exchange_(exchange), ours_(std::move(ours)), new_(exchange.stage / "new") {}

  [[nodiscard]] const std::set<std::string>& ours() const { return ours_; }

  // Finds what is to be carried; "" or why it cannot be.
  [[nodiscard]] std::string Find() {
    device_ = StatusOf(exchange_.target)->st_dev;
    return Walk("");
  }

  [[nodiscard]] std::string Link() {
    for (const std::string& folder : folders_) {
      const auto status = StatusOf(exchange_.target / folder);
      if (!status) continue;  // gone meanwhile
      if (mkdir((new_ / folder).c_str(), 0700) != 0 && errno != EEXIST) {
        return Trouble("keep", exchange_.target / folder, std::strerror(errno));
      }
      (void)chmod((new_ / folder).c_str(), status->st_mode & 07777);
    }
    for (const std::string& file : files_) {
      const fs::path from = exchange_.target / file, to = new_ / file;
      std::error_code error;
      fs::create_directories(to.parent_path(), error);
      if (linkat(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), 0) != 0 && errno != ENOENT) {
        moves_.push_back(file);  // this file system has no second names
      }
    }
    // Times last: filling a folder changes them.
    for (auto folder = folders_.rbegin(); folder != folders_.rend(); ++folder) {
      if (const auto status = StatusOf(exchange_.target / *folder)) {
        const timespec times[2] = {status->st_atim, status->st_mtim};
        (void)utimensat(AT_FDCWD, (new_ / *folder).c_str(), times, AT_SYMLINK_NOFOLLOW);
      }
    }
    return "";
  }

  // After the exchange: what could not be linked.
  void Move(const fs::path& from) const {
    for (const std::string& name : moves_) {
      (void)MoveToNothing(from / name, exchange_.target / name);
    }
  }

 private:
  [[nodiscard]] std::string Refuse(const std::string& name, const std::string& why) const {
    return Trouble("replace", exchange_.target, fmt::format("it holds {}, {}", name, why));
  }

  // The new result needs this name, or a file where this one has a folder.
  [[nodiscard]] bool Clashes(const std::string& name, bool folder) const {
    for (size_t at = name.find('/'); at != std::string::npos; at = name.find('/', at + 1)) {
      if (exchange_.files.contains(name.substr(0, at))) return true;
    }
    const auto there = StatusOf(new_ / name);
    return there && !(folder && IsFolder(there));
  }

  // A folder that only our files are in.
  [[nodiscard]] bool IsOurFolder(const std::string& name) const {
    const auto below = ours_.lower_bound(name + "/");
    return below != ours_.end() && below->starts_with(name + "/");
  }

  [[nodiscard]] std::string Walk(const std::string& folder) {
    std::error_code error;
    const std::vector<std::string> names = NamesIn(exchange_.target / folder, &error);
    if (error) {
      if (folder.empty() || IsOurFolder(folder)) {
        return Trouble("read", exchange_.target / folder, error.message());
      }
      moves_.push_back(folder);  // a folder that may not be read may still be moved
      std::erase(folders_, folder);
      return "";
    }
    for (const std::string& name : names) {
      const std::string path = folder.empty() ? name : folder + "/" + name;
      if (std::string trouble = Visit(path, name); !trouble.empty()) return trouble;
    }
    return "";
  }

  [[nodiscard]] std::string Visit(const std::string& path, const std::string& name) {
    const auto status = StatusOf(exchange_.target / path);
    if (!status) return "";
    if (status->st_dev != device_) return Refuse(path, "which is a file system of its own");
    const bool folder = IsFolder(status);
    if (!folder && ours_.contains(path)) return "";
    if (folder && IsOurFolder(path)) return Walk(path);
    if (Clashes(path, folder)) return Refuse(path, "which mbverify did not write: move it away");
    if (folder && name == kStateFolder) {
      moves_.push_back(path);  // it is known by its inode
      return "";
    }
    if (!folder) {
      files_.push_back(path);
      return "";
    }
    folders_.push_back(path);
    return Walk(path);
  }

  const Exchange& exchange_;
  std::set<std::string> ours_;
  fs::path new_;
  dev_t device_ = 0;
  std::vector<std::string> folders_, files_;  // not ours, relative, parents first
  std::vector<std::string> moves_;
};

struct Place {
  ino_t inode = 0;  // of the new result
  fs::path target;
  std::set<std::string> ours;  // files of the old one
};

std::string WritePlace(const fs::path& stage, const Place& place) {
  std::string text;
  const auto add = [&](const std::string& line) { text += line + '\0'; };
  add(kPlaceSchema);
  add(std::to_string(place.inode));
  add(place.target.string());
  for (const std::string& file : place.ours) add(file);
  return WriteFile(stage / "place", text, false);
}

std::optional<Place> ReadPlace(const fs::path& stage) {
  std::istringstream lines(ReadWholeFile(stage / "place").value_or(""));
  std::string schema, inode, line;
  const auto next = [&](std::string* text) { return bool(std::getline(lines, *text, '\0')); };
  if (!next(&schema) || schema != kPlaceSchema || !next(&inode) || !next(&line)) {
    return std::nullopt;
  }
  Place place;
  place.inode = static_cast<ino_t>(std::strtoull(inode.c_str(), nullptr, 10));
  place.target = line;
  while (next(&line)) place.ours.insert(line);
  return place;
}

// Empties and removes what was the old result: our files go, others are where they were already or
// go there. False if something had to stay.
bool GiveBack(const fs::path& old, const Place& place, const std::string& folder = "") {
  bool all = true;
  std::error_code error;
  for (const std::string& name : NamesIn(old / folder, &error)) {
    const std::string path = folder.empty() ? name : folder + "/" + name;
    const auto status = StatusOf(old / path);
    const auto there = StatusOf(place.target / path);
    if (IsFolder(status)) {
      all = GiveBack(old, place, path) && all;
    } else if (place.ours.contains(path) || SameInode(status, there)) {
      all = unlink((old / path).c_str()) == 0 && all;
    } else {
      fs::create_directories((place.target / path).parent_path(), error);
      all = MoveToNothing(old / path, place.target / path) && all;
    }
  }
  return rmdir((old / folder).c_str()) == 0 && all;
}

// For file systems that cannot exchange: the old one aside, the new one in.
std::string MoveAside(const Exchange& exchange) {
  const fs::path old = exchange.stage / "old", target = exchange.target;
  const auto trouble = [&] {
    return Trouble("replace", target,
                   fmt::format("{} (what was there is as it was)", std::strerror(errno)));
  };
  if (rename(target.c_str(), old.c_str()) != 0) return trouble();
  if (rename((exchange.stage / "new").c_str(), target.c_str()) == 0) return "";
  const std::string text = trouble();
  (void)rename(old.c_str(), target.c_str());
  return text;
}

// Puts stage/new in place of the target; "" or what went wrong, and then the target is as before.
// Call under the StateLock of the stage's folder.
std::string ExchangeFolders(const Exchange& exchange) {
  const fs::path content = exchange.stage / "new", target = exchange.target;
  const auto old = StatusOf(target);
  if (!old) {
    SyncTree(content);
    if (!MoveToNothing(content, target)) return Trouble("make", target, std::strerror(errno));
    SyncFolder(target.parent_path());
    return "";
  }
  if (!IsFolder(old)) return Trouble("replace", target, "it is not a folder");
  Carrier carrier(exchange, OursIn(target, exchange.files));
  std::string trouble = carrier.Find();
  if (trouble.empty()) trouble = carrier.Link();
  if (!trouble.empty()) return trouble;
  (void)chmod(content.c_str(), old->st_mode & 07777);
  SyncTree(content);
  trouble = WritePlace(exchange.stage, {StatusOf(content)->st_ino, target, carrier.ours()});
  if (!trouble.empty()) return trouble;
  const bool exchanged =
      renameat2(AT_FDCWD, content.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE) == 0;
  if (!exchanged) trouble = MoveAside(exchange);
  if (!trouble.empty()) return trouble;
  SyncFolder(target.parent_path());
  carrier.Move(exchanged ? content : exchange.stage / "old");
  return "";
}

// Removes a stage. Files of the user that a kill left in it go back to where they were; what
// cannot go back stays. Call under the StateLock.
void ClearStage(const fs::path& stage) {
  std::error_code error;
  if (const auto place = ReadPlace(stage)) {
    const fs::path old = stage / "old", content = stage / "new";
    if (StatusOf(old)) {
      // Between its two steps the exchange is undone.
      const bool half = !StatusOf(place->target);
      if (half ? !MoveToNothing(old, place->target) : !GiveBack(old, *place)) return;
    }
    const auto status = StatusOf(content);
    if (status && status->st_ino != place->inode && !GiveBack(content, *place)) return;
    // What is left is ours, or a second name of a file that is in its place.
    unlink((stage / "place").c_str());
  }
  fs::remove_all(stage, error);
}

}  // namespace
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
  if (!IsPlainPath(name_)) return TroubleWith("make", target_, "this is not a name of a result");
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
  if (!fs::is_directory(place_, error))
    return TroubleWith("replace", target_, "it is not a folder");
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
      return TroubleWith("publish", target_ / name, "it is not a plain file");
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
