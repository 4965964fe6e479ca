#include "regress/run_folder.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sstream>

#include "core/demand.h"
#include "core/files.h"
#include "core/names.h"
#include "core/output_folder.h"
#include "core/state_folder.h"
#include "regress/summaries.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFilesSchema = "mbverify.night/1";

bool IsThere(const fs::path& path) {
  std::error_code error;
  return fs::exists(fs::symlink_status(path, error));
}

}  // namespace

fs::path RunFolder::Own() const { return out_ / kStateFolder / "night"; }

RunFolder::~RunFolder() {
  if (lock_ < 0) return;
  std::error_code error;
  fs::remove_all(Own() / "work", error);
  const StateLock state(out_);
  close(lock_);  // and with it the lock
  rmdir(Own().c_str());
}

std::string RunFolder::Open() {
  if (out_.empty()) out_ = ".";
  std::error_code error;
  fs::create_directories(out_, error);
  if (error) return fmt::format("cannot make folder {}: {}", out_.string(), error.message());
  const StateLock state(out_);
  if (!state.trouble().empty()) return state.trouble();
  (void)mkdir(Own().c_str(), 0777);
  lock_ = LockFolder(Own());
  if (lock_ < 0 && errno == EWOULDBLOCK) {
    return fmt::format("{} is in use by another regression; choose another --out", out_.string());
  }
  if (lock_ < 0) return fmt::format("cannot write to {}: {}", out_.string(), std::strerror(errno));
  fs::remove_all(Own() / "work", error);
  return "";
}

fs::path RunFolder::Staging(size_t job) const { return Own() / "work" / std::to_string(job); }

fs::path RunFolder::StagedLog(size_t job) const {
  return Own() / "work" / fmt::format("{}.log", job);
}

fs::path RunFolder::Shared() const { return Own() / "work" / "shared"; }

std::optional<fs::path> RunFolder::FindStaged(size_t job) const {
  std::error_code error;
  for (fs::recursive_directory_iterator entry(Staging(job), error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().filename() == kStateFolder) entry.disable_recursion_pending();
    if (entry->path().filename() == "summary.json") return entry->path().parent_path();
  }
  return std::nullopt;
}

std::string RunFolder::Publish(const fs::path& staged, const std::string& key) const {
  OutputFolder folder(out_, key);
  std::string trouble = folder.Create();
  if (trouble.empty()) trouble = folder.Adopt(staged);
  if (trouble.empty()) trouble = folder.Commit();
  return trouble;
}

void RunFolder::RemoveStaging(size_t job) const {
  std::error_code error;
  fs::remove_all(Staging(job), error);
  fs::remove(StagedLog(job), error);
}

std::string RunFolder::Claim(const std::vector<std::string>& names) {
  const fs::path list = out_ / kStateFolder / "files";
  std::istringstream lines(ReadWholeFile(list).value_or(""));
  std::string line;
  if (std::getline(lines, line) && line == kFilesSchema) {
    while (std::getline(lines, line)) claimed_.insert(line);
  }
  // Nights of versions that kept no list.
  const auto report = ReadWholeFile(out_ / "regress.json");
  const bool night = report && ReportFromJson(*report).has_value();
  std::string trouble;
  for (const std::string& name : names) {
    MBV_DEMAND(IsPlainPath(name), name);
    if (!claimed_.contains(name) && !night && IsThere(out_ / name)) {
      trouble += fmt::format(
          "{}{}: error: is there already and mbverify did not write it; move it away, or choose "
          "another --out",
          trouble.empty() ? "" : "\n", (out_ / name).string());
    }
    claimed_.insert(name);
  }
  if (!trouble.empty()) return trouble;
  std::set<fs::path> folders;
  for (const std::string& name : names) folders.insert((out_ / name).parent_path());
  for (const fs::path& folder : folders) SweepTemporaries(folder);
  std::string text = fmt::format("{}\n", kFilesSchema);
  for (const std::string& name : claimed_) {
    if (IsPlainPath(name)) text += fmt::format("{}\n", name);
  }
  return WriteFile(list, text);
}

std::string RunFolder::Write(const std::string& name, const std::string& content) const {
  MBV_DEMAND(claimed_.contains(name), name);
  return WriteFile(out_ / name, content, false);
}

std::string RunFolder::Begin(const std::string& started_utc) const {
  const std::string trouble =
      Write(kUnfinished,
            fmt::format("A night that began at {} has not finished. Until it has, result folders "
                        "may be of it, while index.html, summary.md, junit.xml and regress.json "
                        "are of the night before.\n`mbverify regress --resume` with the same --out "
                        "goes on with it; without --resume it starts anew.\n",
                        started_utc));
  // The page of the night before is what people open.
  std::string page = ReadWholeFile(out_ / "index.html").value_or("");
  const size_t at = page.find(kIndexMain);
  if (!trouble.empty() || at == std::string::npos || page.find(kUnfinished) != std::string::npos) {
    return trouble;
  }
  page.insert(at, fmt::format("<p class=\"bad\">A later night began at {} and has not finished: "
                              "results that this page links to may be of it ({}).</p>\n",
                              started_utc, kUnfinished));
  return Write("index.html", page);
}

void RunFolder::Finished() const {
  std::error_code error;
  fs::remove(out_ / kUnfinished, error);
  SyncFolder(out_);
}

std::string RunFolder::RunId() {
  const fs::path file = Own() / "run";
  std::string id = ReadWholeFile(file).value_or("");
  if (!id.empty()) return id;
  id = RandomLetters() + RandomLetters() + RandomLetters() + RandomLetters();
  // A run that cannot keep its id cannot keep its states either, which is told there.
  (void)WriteFile(file, id, false);
  return id;
}

fs::path RunFolder::StateFile(const std::string& key) const {
  return Own() / "state" / (key + ".json");
}

std::string RunFolder::SaveState(const CaseResult& result) const {
  return WriteFile(StateFile(result.key), ToJson(result), false);
}

std::optional<CaseResult> RunFolder::LoadState(const std::string& key) const {
  const auto text = ReadWholeFile(StateFile(key));
  return text ? CaseFromJson(*text) : std::nullopt;
}

void RunFolder::ForgetStates() const {
  std::error_code error;
  fs::remove_all(Own() / "state", error);
  fs::remove(Own() / "run", error);
  SweepTemporaries(Own());
}

GoldenTraces RunFolder::Golden(const std::string& key) const {
  const auto csv = ReadWholeFile(Result(key) / "traces.csv");
  return csv ? ReadForces(*csv) : GoldenTraces{};
}

std::optional<fs::path> RunFolder::Snapshot(const std::string& key) const {
  std::error_code error;
  std::vector<fs::path> pictures;
  for (fs::directory_iterator entry(Result(key) / "snapshots", error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() == ".png") pictures.push_back(entry->path());
  }
  if (pictures.empty()) return std::nullopt;
  return *std::min_element(pictures.begin(), pictures.end());
}

}  // namespace mbv
