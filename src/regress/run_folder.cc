#include "regress/run_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "regress/files.h"
#include "regress/summaries.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr int kThumbnailPx = 144;

}  // namespace

RunFolder::~RunFolder() {
  if (lock_ < 0) return;
  std::error_code error;
  fs::remove_all(out_ / ".work", error);
  close(lock_);  // and with it the lock
}

std::string RunFolder::Open() {
  std::error_code error;
  fs::create_directories(out_, error);
  if (error) return fmt::format("cannot make folder {}: {}", out_.string(), error.message());
  const fs::path file = out_ / ".lock";
  lock_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock_ < 0) return fmt::format("cannot write to {}: {}", out_.string(), std::strerror(errno));
  if (flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    close(lock_);
    lock_ = -1;
    return fmt::format("{} is in use by another regression; choose another --out", out_.string());
  }
  fs::remove_all(out_ / ".work", error);
  return "";
}

fs::path RunFolder::Log(const std::string& key) const { return out_ / "logs" / (key + ".txt"); }

fs::path RunFolder::Staging(size_t job) const { return out_ / ".work" / std::to_string(job); }

std::optional<fs::path> RunFolder::FindStaged(size_t job) const {
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(Staging(job), error)) {
    if (entry.path().filename() == "summary.json") return entry.path().parent_path();
  }
  return std::nullopt;
}

std::string RunFolder::Publish(const fs::path& staged, const std::string& key) const {
  const fs::path target = Result(key);
  std::error_code error;
  const bool ours = !fs::exists(target, error) || fs::exists(target / "summary.json", error);
  fs::create_directories(target, error);
  // Folders may hold other scenarios' results ("a" and "a/b"); old files go.
  for (const auto& entry : fs::directory_iterator(target, error)) {
    if (entry.is_directory(error)) continue;
    if (!ours) return fmt::format("{}: holds something that is no result", target.string());
    fs::remove(entry.path(), error);
  }
  for (const auto& entry : fs::directory_iterator(staged, error)) {
    const fs::path to = target / entry.path().filename();
    fs::remove_all(to, error);
    fs::rename(entry.path(), to, error);
    if (error) return fmt::format("cannot write {}: {}", to.string(), error.message());
  }
  return "";
}

void RunFolder::RemoveStaging(size_t job) const {
  std::error_code error;
  fs::remove_all(Staging(job), error);
}

std::string RunFolder::SaveState(const CaseResult& result) const {
  return WriteDurably(out_ / ".state" / (result.key + ".json"), ToJson(result));
}

std::optional<CaseResult> RunFolder::LoadState(const std::string& key) const {
  const auto text = ReadWholeFile(out_ / ".state" / (key + ".json"));
  return text ? CaseFromJson(*text) : std::nullopt;
}

void RunFolder::ForgetStates() const {
  std::error_code error;
  fs::remove_all(out_ / ".state", error);
}

GoldenTraces RunFolder::Golden(const std::string& key) const {
  const auto csv = ReadWholeFile(Result(key) / "traces.csv");
  return csv ? ReadForces(*csv) : GoldenTraces{};
}

std::string RunFolder::Thumbnail(const std::string& key) const {
  std::error_code error;
  std::vector<fs::path> pictures;
  for (const auto& entry : fs::directory_iterator(Result(key) / "snapshots", error)) {
    if (entry.path().extension() == ".png") pictures.push_back(entry.path());
  }
  if (pictures.empty()) return "";
  const auto png = ReadWholeFile(*std::min_element(pictures.begin(), pictures.end()));
  return png ? ThumbnailUri(*png, kThumbnailPx) : "";
}

}  // namespace mbv
