#include "features/regress/run_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>

#include "base/demand.h"
#include "base/files.h"
#include "base/output_folder.h"
#include "base/types.h"
#include "base/worker_pool.h"
#include "features/regress/accuracy.h"
#include "features/regress/history.h"
#include "features/regress/summaries.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFilesSchema = "mbverify.run_files/1";

bool IsThere(const fs::path& path) {
  std::error_code error;
  return fs::exists(fs::symlink_status(path, error));
}

}  // namespace

fs::path RunFolder::Own() const { return out_ / kStateFolder / "regress"; }

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
  // Runs of versions that kept no list.
  const auto report = ReadWholeFile(out_ / "regress.json");
  const bool ours = report && ReportFromJson(*report).has_value();
  std::string trouble;
  for (const std::string& name : names) {
    MBV_DEMAND(IsPlainPath(name), name);
    if (!claimed_.contains(name) && !ours && IsThere(out_ / name)) {
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
            fmt::format(
                "A regression run that began at {} has not finished. Until it has, result folders "
                "may be of it, while index.html, summary.md, junit.xml and regress.json "
                "are of the run before.\n`mbverify regress --resume` with the same --out "
                "goes on with it; without --resume it starts anew.\n",
                started_utc));
  // The page of the run before is what a reader opens.
  std::string page = ReadWholeFile(out_ / "index.html").value_or("");
  const size_t at = page.find(kIndexMain);
  if (!trouble.empty() || at == std::string::npos || page.find(kUnfinished) != std::string::npos) {
    return trouble;
  }
  page.insert(at, fmt::format("<p class=\"bad\">A later run began at {} and has not finished: "
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
  // A run that cannot keep its id cannot keep its states either, which is reported there.
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

namespace {

namespace fs = std::filesystem;

constexpr double kThumbnailTimeout_s = 20.0;
constexpr int kThumbnailPx = 144;
constexpr size_t kMostThumbnails = 40;
constexpr size_t kHeadBytes = 200;  // of a file, which show what it is

// One of each model. Pictures may be anybody's (merge): children decode them.
std::map<std::string, std::string> Thumbnails(const RunFolder& folder,
                                              const RegressReport& report) {
  std::vector<std::pair<std::string, fs::path>> pictures;  // by model
  for (const CaseResult& result : report.cases) {
    std::string model = result.key.substr(0, result.key.find('/'));
    if (!result.has_folder || pictures.size() == kMostThumbnails) continue;
    if (!pictures.empty() && pictures.back().first == model) continue;  // cases are sorted
    if (auto picture = folder.Snapshot(result.key)) {
      pictures.emplace_back(std::move(model), *std::move(picture));
    }
  }
  const auto texts = InChildren(pictures.size(), kThumbnailTimeout_s, [&](size_t i) {
    return ThumbnailUri(ReadWholeFile(pictures[i].second).value_or(""), kThumbnailPx);
  });
  std::map<std::string, std::string> thumbnails;
  for (size_t i = 0; i < pictures.size(); ++i) {
    thumbnails[pictures[i].first] = texts[i].value_or("");
  }
  return thumbnails;
}

// A file that the user named; not one that a scenario was computed from. "" or what went wrong.
std::string WriteElsewhere(const std::string& path, const std::string& text,
                           const RegressReport& report) {
  std::map<std::string, InputFile> inputs;  // models are read by many
  for (const CaseResult& result : report.cases) {
    for (const InputFile& input : result.input_files) inputs.emplace(input.file, input);
  }
  for (const auto& [file, input] : inputs) {
    if (SameFile(path, {input}).empty()) continue;
    return fmt::format("{} was read for a scenario: choose another output", path);
  }
  return WriteFile(path, text);
}

}  // namespace

void AddTrouble(const std::string& text, RegressOutcome* outcome) {
  if (text.empty()) return;
  outcome->trouble += (outcome->trouble.empty() ? "" : "\n") + text;
}

std::vector<std::string> RegressionFiles(const RegressOptions& options,
                                         const std::vector<std::string>& keys) {
  std::vector<std::string> names = {"index.html", "regress.json", kUnfinished};
  for (size_t page = 1; page * kCasesOnAPage < keys.size(); ++page) {
    names.push_back(IndexPageName(page));
  }
  if (options.junit.empty()) names.emplace_back("junit.xml");
  if (options.markdown.empty()) names.emplace_back("summary.md");
  for (const auto& [name, content] : options.shared_files) names.push_back(name);
  for (const std::string& key : keys) names.push_back(RunFolder::Log(key));
  return names;
}

std::string FindTaken(const RegressOptions& options, const std::vector<std::string>& keys) {
  std::vector<std::string> names = RegressionFiles(options, keys);
  for (const std::string& file : {options.history, options.junit, options.markdown}) {
    if (file.empty()) continue;
    names.push_back(fs::path(file).lexically_relative(options.out).generic_string());
  }
  const std::set<std::string> taken(names.begin(), names.end());
  std::string trouble;
  for (const std::string& key : keys) {
    for (size_t end = key.find('/');; end = key.find('/', end + 1)) {
      if (const std::string part = key.substr(0, end); taken.contains(part)) {
        trouble += fmt::format(
            "{}{}: error: its results would lie at {}, where the regression run writes a file of "
            "its own; rename the scenario or its folder",
            trouble.empty() ? "" : "\n", key, part);
      }
      if (end == std::string::npos) break;
    }
  }
  return trouble;
}

void FinishRegression(const RegressOptions& options, const RunFolder& folder,
                      RegressOutcome* outcome) {
  RegressReport& report = outcome->report;
  std::sort(report.cases.begin(), report.cases.end(),
            [](const CaseResult& a, const CaseResult& b) { return a.key < b.key; });
  std::map<std::string, std::string> thumbnails;
  if (options.pictures) thumbnails = Thumbnails(folder, report);
  if (!options.history.empty()) {
    std::map<std::string, GoldenTraces> goldens;
    for (const CaseResult& result : report.cases) {
      if (result.has_folder) goldens[result.key] = folder.Golden(result.key);
    }
    AddTrouble(AppendRun(options.history, goldens, &report), outcome);
  }
  bool whole = true;  // every file is of this regression run
  const auto keep = [&](const fs::path& path, const std::string& trouble) {
    if (trouble.empty()) outcome->files.push_back(path);
    whole = whole && trouble.empty();
    AddTrouble(trouble, outcome);
  };
  const auto write = [&](const std::string& name, const std::string& content) {
    keep(folder.path() / name, folder.Write(name, content));
  };
  const auto write_at = [&](const std::string& given, const char* name, const std::string& text) {
    given.empty() ? write(name, text) : keep(given, WriteElsewhere(given, text, report));
  };
  for (const auto& [name, content] : options.shared_files) {
    AddTrouble(folder.Write(name, content), outcome);
  }
  write_at(options.junit, "junit.xml", ToJUnit(report));
  write_at(options.markdown, "summary.md", ToMarkdown(report));
  const auto summary = [&](const std::string& scenario) {
    return ReadWholeFile(folder.path() / scenario / "summary.json");
  };
  for (const std::string& document : options.tables) {
    const auto text = ReadWholeFile(document);
    keep(document, text ? WriteFile(document, FillAccuracyTables(*text, summary))
                        : fmt::format("{}: cannot be read", document));
  }
  // What merge reads is about whole results; the page says so as long as the rest is not.
  write("regress.json", ToJson(report));
  size_t page = 0;
  for (const std::string& html : ToIndexPages(report, thumbnails)) {
    write(IndexPageName(page++), html);
  }
  // Of an earlier run with more of them.
  std::error_code error;
  while (fs::remove(folder.path() / IndexPageName(page), error)) ++page;
  if (whole) folder.Finished();
  outcome->exit_code = outcome->trouble.empty() ? ExitCodeOf(report) : 2;
}

namespace {

// A summary that an earlier run left there, or nothing yet.
bool IsOfARegression(const std::string& path) {
  const std::string start = ReadWholeFile(path).value_or("").substr(0, kHeadBytes);
  return start.empty() || start.starts_with(kMarkdownTitle) ||
         start.find("\"mbverify.regress/") != std::string::npos ||
         start.find(fmt::format("<testsuites name=\"{}\"", kJUnitName)) != std::string::npos;
}

}  // namespace

std::string FindClash(const RegressOptions& options, const std::vector<CaseFile>& cases) {
  const auto clash = [](const std::string& output, const std::string& input) {
    std::error_code error;
    return fs::equivalent(output, input, error) && !error;
  };
  for (const std::string& output :
       {options.junit, options.markdown, options.json, options.history}) {
    if (output.empty()) continue;
    for (const CaseFile& file : cases) {
      if (!clash(output, file.file)) continue;
      return fmt::format("{}: error: is a scenario that is to be run; choose another output",
                         output);
    }
  }
  // Models, tables and meshes that are read, and whatever else.
  for (const std::string& output : {options.junit, options.markdown, options.json}) {
    std::error_code error;
    if (!fs::is_regular_file(output, error) || IsOfARegression(output)) continue;
    return fmt::format("{}: error: mbverify did not write it; choose another output", output);
  }
  return "";
}

std::string UtcNow() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
}

double UtcHours(const std::string& utc) {
  std::tm time = {};
  const char* end = strptime(utc.c_str(), "%Y-%m-%dT%H:%M:%SZ", &time);
  return end == nullptr ? kNan : static_cast<double>(timegm(&time)) / 3600.0;
}

}  // namespace mbv
