#include "features/study/study.h"

#include <fmt/format.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>

#include "base/files.h"
#include "base/json_document.h"
#include "base/json_text.h"
#include "base/output_folder.h"
#include "base/worker_pool.h"
#include "cli/cli.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/regress/database.h"
#include "features/regress/find_cases.h"
#include "features/study/study_bench.h"
#include "features/study/study_file.h"
#include "features/study/study_report.h"
#include "features/study/summary.h"
#include "model_file/yaml/yaml_reader.h"
#include "report/report.h"
#include "scenario/find_model.h"
#include "verify/version.h"

namespace mbv {

namespace {

namespace fs = std::filesystem;

StudyOutcome NotWritten(StudyOutcome outcome, const std::string& why, const std::string& hint) {
  outcome.exit_code = 3;
  outcome.diagnostics.AddError("", why, hint);
  return outcome;
}

StudyOutcome Refused(StudyOutcome outcome, const std::string& file, const std::string& why,
                     const std::string& hint = "") {
  outcome.exit_code = 2;
  outcome.diagnostics.AddError(file, why, hint);
  return outcome;
}

StudyOutcome Refused(StudyOutcome outcome, Finding finding) {
  outcome.exit_code = 2;
  outcome.diagnostics.Add(std::move(finding));
  return outcome;
}

// Every row of a file that was looked through before.
PointRows RowsOf(const fs::path& file, const Study& study) {
  return [file, &study](const std::function<void(const PointRow&)>& take) {
    std::ifstream stream(file, std::ios::binary);
    std::string line;
    std::getline(stream, line);
    while (std::getline(stream, line)) {
      if (const auto row = ReadPointLine(line, study)) take(*row);
    }
  };
}

// Evenly chosen, those that have values.
std::vector<PointRow> ShownOf(const PointRows& rows, std::uint64_t points) {
  const std::uint64_t every = (points + kMostShown - 1) / kMostShown;
  std::vector<PointRow> shown;
  rows([&](const PointRow& row) {
    if (row.point % every == 0 && row.reason.empty()) shown.push_back(row);
  });
  return shown;
}

StudyReport ReportOf(const StudyBench& bench, const fs::path& folder) {
  StudyReport report;
  report.study = bench.study();
  report.nominal = bench.nominal().row.values;
  report.idle = bench.idle();
  report.summary =
      SummariseStudy(report.study, report.nominal, RowsOf(folder / kPointsFile, report.study));
  report.shown = ShownOf(RowsOf(folder / kPointsFile, report.study), report.summary.points);
  report.bands = StudyBands(bench, folder / kForcesFile);
  if (report.study.validation) report.validation = ValidateStudy(bench, folder / kForcesFile);
  for (const QuantitySummary& quantity : report.summary.quantities) {
    auto& commands = report.worst_commands.emplace_back();
    for (const WorstPoint& worst : quantity.worst) commands.push_back(bench.Command(worst.varied));
  }
  for (const PointRow& row : report.summary.first_failed) {
    report.failed_commands.push_back(bench.Command(row.varied));
  }
  for (const PointRow& row : report.summary.first_disagreed) {
    report.disagreed_commands.push_back(bench.Command(row.varied));
  }
  report.versions = Versions();
  return report;
}

// From complete rows in `folder` to the result.
StudyOutcome Finish(const StudyBench& bench, bool whole, StudyFolder* folder,
                    StudyOutcome outcome) {
  std::vector<std::pair<std::string, std::string>> files;
  outcome.exit_code = 0;
  if (whole) {
    outcome.report = ReportOf(bench, folder->path());
    outcome.exit_code = outcome.report->exit_code();
    files = {{"summary.json", ToJson(*outcome.report)},
             {"report.html", ToHtml(*outcome.report)},
             {"inputs.json", InputsJson(bench.inputs())}};
    for (StudyPlot& plot : StudyPlots(*outcome.report)) {
      files.emplace_back("plots/" + plot.file, std::move(plot.svg));
    }
  }
  const std::string trouble = folder->Publish(files);
  if (!trouble.empty()) {
    outcome.report.reset();
    return NotWritten(std::move(outcome), trouble, "choose another folder with --out");
  }
  outcome.folder = folder->target().string();
  return outcome;
}

// All rows are there, with the bytes that were published.
bool HoldsAll(const StudyBench& bench, const StudyIdentity& identity, const fs::path& folder) {
  const std::uint64_t rows = identity.share.size(bench.points().count());
  return FindDone(bench, identity.share, folder).rows == rows &&
         PointsFingerprint(folder) == identity.points;
}

// What an earlier run finished, where all of it is there and nothing has changed.
std::optional<StudyOutcome> Finished(const StudyBench& bench, const StudyFolder& folder,
                                     const StudyShare& share, const StudyOutcome& outcome) {
  std::error_code error;
  std::optional<Finding> damage;
  const auto identity = ReadIdentity(folder.target(), &damage);
  if (damage) return Refused(outcome, *std::move(damage));
  if (fs::exists(folder.path(), error) || !identity) return {};
  if (identity->fingerprint != bench.fingerprint() || identity->share.count != share.count ||
      identity->share.index != share.index) {
    return {};
  }
  if (!HoldsAll(bench, *identity, folder.target())) return {};
  StudyOutcome finished = outcome;
  finished.exit_code = 0;
  finished.folder = folder.target().string();
  if (share.count > 1) return finished;
  finished.report = ReportOf(bench, folder.target());
  finished.exit_code = finished.report->exit_code();
  return finished;
}

struct LoadedStudy {
  std::unique_ptr<StudyBench> bench;  // null after bad input
  int exit_code = 2;
};

// `timeout_s`: of one point.
LoadedStudy LoadBench(const std::string& file, const StudyOptions& options, double timeout_s,
                      Diagnostics* diagnostics) {
  LoadedStudy loaded;
  StudyResult read = LoadStudy(file, options);
  diagnostics->Append(read.diagnostics);
  if (!read.study) return loaded;
  loaded.bench = StudyBench::Make(*read.study, diagnostics, &loaded.exit_code);
  if (!loaded.bench) return loaded;
  loaded.bench->FindIdle(timeout_s, diagnostics);
  if (!diagnostics->has_errors()) return loaded;
  return {nullptr, 2};
}

// The folders of all shards, by their place.
class ShardMerger {
 public:
  // Why these are not all shards of one study.
  std::optional<Finding> Read(const std::vector<std::string>& folders) {
    const auto refused = [](const std::string& folder, std::string why) {
      return Finding{.file = folder, .message = std::move(why)};
    };
    for (const std::string& folder : folders) {
      std::optional<Finding> damage;
      const auto identity = ReadIdentity(folder, &damage);
      if (damage) return damage;
      if (!identity) return refused(folder, "is not a result of a study");
      if (first_ && identity->fingerprint != first_->fingerprint) {
        return refused(folder,
                       fmt::format("is of another study than {}, or of other files", folders[0]));
      }
      if (first_ && identity->share.count != first_->share.count) {
        return refused(folder, fmt::format("is one of {} shards, {} one of {}",
                                           identity->share.count, folders[0], first_->share.count));
      }
      if (!first_) first_ = identity;
      if (!folders_.emplace(identity->share.index, folder).second) {
        return refused(
            folder, fmt::format("shard {} is in another folder, too", identity->share.index + 1));
      }
    }
    for (std::uint64_t k = 0; k < first_->share.count; ++k) {
      if (folders_.contains(k)) continue;
      return refused("", fmt::format("shard {}/{} is missing", k + 1, first_->share.count));
    }
    return {};
  }
  // Which shard has not all of its rows, or other ones than it was finished with.
  [[nodiscard]] std::optional<Finding> CheckRows(const StudyBench& bench) const {
    for (const auto& [index, folder] : folders_) {
      const auto identity = ReadIdentity(folder);
      if (identity && HoldsAll(bench, *identity, folder)) continue;
      return Finding{.file = folder,
                     .message = "its points are not all there, or not as they were written"};
    }
    return {};
  }
  // Rows and forces in the order of points.
  [[nodiscard]] std::string Join(const StudyBench& bench, const fs::path& into) const {
    GrowingFile csv(into / kPointsFile), forces(into / kForcesFile);
    std::string trouble = csv.Open(0);
    if (trouble.empty()) trouble = forces.Open(0);
    if (trouble.empty()) trouble = csv.Append(PointHeader(bench.study()));
    std::vector<std::ifstream> rows, records;
    std::string line, record(bench.forces().size() * sizeof(float), '\0');
    for (const auto& [index, folder] : folders_) {
      rows.emplace_back(fs::path(folder) / kPointsFile, std::ios::binary);
      records.emplace_back(fs::path(folder) / kForcesFile, std::ios::binary);
      std::getline(rows.back(), line);
    }
    for (std::uint64_t p = 0; p < bench.points().count() && trouble.empty(); ++p) {
      std::getline(rows[p % rows.size()], line);
      trouble = csv.Append(line + "\n");
      if (p >= kBandPoints || !trouble.empty()) continue;
      records[p % rows.size()].read(record.data(), static_cast<std::streamsize>(record.size()));
      trouble = forces.Append(record);
    }
    return trouble;
  }
  [[nodiscard]] const StudyIdentity& first() const { return *first_; }

 private:
  std::optional<StudyIdentity> first_;
  std::map<std::uint64_t, std::string> folders_;
};

}  // namespace

StudyOutcome RunStudy(const std::string& file, const RunStudyOptions& options) {
  const ParsedDocuments documents;
  StudyOutcome outcome;
  const LoadedStudy loaded =
      LoadBench(file, options.reading, options.points.timeout_s, &outcome.diagnostics);
  outcome.exit_code = loaded.exit_code;
  if (!loaded.bench) return outcome;
  const StudyBench& bench = *loaded.bench;
  const StudyShare& share = options.points.share;
  StudyFolder folder(options.out_dir, {bench.study().name,
                                       file,
                                       bench.fingerprint(),
                                       options.reading.drawn,
                                       share,
                                       {},
                                       bench.study().design.count});
  if (options.resume) {
    if (auto finished = Finished(bench, folder, share, outcome)) return *std::move(finished);
  }
  if (auto refused = folder.Open(options.resume, &bench)) {
    return Refused(std::move(outcome), *std::move(refused));
  }
  const std::string trouble =
      ComputePoints(bench, options.points, FindDone(bench, share, folder.path()), folder.path());
  if (!trouble.empty()) return NotWritten(std::move(outcome), trouble, "");
  return Finish(bench, share.count == 1, &folder, std::move(outcome));
}

StudyOutcome RunStudyUntil(const std::string& file, RunStudyOptions options, double width) {
  constexpr std::uint64_t kFirst = 64;
  StudyOutcome outcome;
  const StudyResult read = LoadStudy(file, options.reading);
  if (!read.study || !read.study->design.grows()) {
    outcome.diagnostics.Append(read.diagnostics);
    return read.study ? Refused(std::move(outcome), file, "--width: no design that grows",
                                "design: {sobol: 65536} or {saltelli: 4096}")
                      : Refused(std::move(outcome), file, "is not computed");
  }
  const Study& study = *read.study;
  std::uint64_t count = std::min(kFirst, study.design.count);
  // Where an earlier run ended, rather than at the beginning.
  for (const char* left : {".part", ""}) {
    const auto identity = ReadIdentity(fs::path(options.out_dir) / (study.name + left));
    if (!options.resume || !identity) continue;
    count = std::clamp(identity->size, count, study.design.count);
    break;
  }
  for (;; count = std::min(2 * count, study.design.count), options.resume = true) {
    options.reading.drawn.count = count;
    outcome = RunStudy(file, options);
    if (!outcome.report || count == study.design.count) return outcome;
    const double widest = WidestInterval(outcome.report->summary);
    if (std::isnan(widest)) {
      outcome.exit_code = 2;
      outcome.diagnostics.AddError(file, "--width: the study has no interval",
                                   "limits of a sobol design, and indices of saltelli have one");
      return outcome;
    }
    if (widest <= width) return outcome;
  }
}

std::string WriteSqlite(const fs::path& folder, const Study& study, const std::string& file) {
  std::error_code error;
  if (fs::exists(file, error)) return file + " exists";
  Database database(file, Database::Mode::kCreate);
  std::string columns, places;
  const auto column = [&](const std::string& name, const char* type) {
    std::string quoted;
    for (const char c : name) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    columns += fmt::format("{}\"{}\" {}", columns.empty() ? "" : ", ", quoted, type);
    places += places.empty() ? "?" : ", ?";
  };
  column("point", "INTEGER PRIMARY KEY");
  column("seed", "INTEGER");
  column("exit", "INTEGER");
  column("reason", "TEXT");
  for (const Factor& factor : study.factors) column(factor.name, "REAL");
  for (const StudyQuantity& quantity : study.quantities) column(quantity.name, "REAL");
  database.Run("BEGIN; CREATE TABLE points (" + columns + ")");
  {
    Statement insert(&database, "INSERT INTO points VALUES (" + places + ")");
    RowsOf(folder / kPointsFile, study)([&](const PointRow& row) {
      insert
          .Bind(static_cast<long>(row.point), static_cast<long>(study.design.seed), row.exit_code,
                row.reason, row.varied, row.values)
          .Execute();
    });
  }
  database.Run("COMMIT");
  return database.trouble();
}

StudyOutcome MergeStudies(const std::vector<std::string>& folders, const std::string& out_dir) {
  const ParsedDocuments documents;
  StudyOutcome outcome;
  ShardMerger merger;
  if (auto refused = merger.Read(folders)) {
    return Refused(std::move(outcome), *std::move(refused));
  }
  const StudyIdentity& first = merger.first();
  const LoadedStudy loaded =
      LoadBench(first.file, {true, first.drawn}, PointsOptions{}.timeout_s, &outcome.diagnostics);
  outcome.exit_code = loaded.exit_code;
  if (!loaded.bench) return outcome;
  const StudyBench& bench = *loaded.bench;
  if (bench.fingerprint() != first.fingerprint) {
    return Refused(std::move(outcome), first.file,
                   "has changed since the shards were computed, or its scenario, model or this "
                   "program");
  }
  if (auto refused = merger.CheckRows(bench)) {
    return Refused(std::move(outcome), *std::move(refused));
  }
  // By its own name: the one in the shards' files may be anything.
  StudyFolder folder(out_dir, {bench.study().name,
                               first.file,
                               first.fingerprint,
                               first.drawn,
                               {},
                               {},
                               bench.study().design.count});
  if (auto refused = folder.Open(true)) return Refused(std::move(outcome), *std::move(refused));
  const std::string trouble = merger.Join(bench, folder.path());
  if (!trouble.empty()) return Refused(std::move(outcome), "", trouble);
  return Finish(bench, true, &folder, std::move(outcome));
}

Diagnostics CheckStudy(const std::string& file) {
  const ParsedDocuments documents;
  Diagnostics diagnostics;
  (void)LoadBench(file, {.many = true}, PointsOptions{}.timeout_s, &diagnostics);
  return diagnostics;
}

std::vector<std::vector<float>> DriveRecords(const StudyForces& forces, size_t drive,
                                             const std::filesystem::path& file, size_t* left_out) {
  const size_t times = forces.time_s.size();
  const auto bytes = static_cast<std::streamsize>(times * sizeof(float));
  std::vector<std::vector<float>> records;
  std::ifstream stream(file, std::ios::binary);
  size_t all = 0;
  for (;; ++all) {
    std::vector<float> samples(times);
    stream.clear();
    stream.seekg(
        static_cast<std::streamoff>(sizeof(float) * (all * forces.size() + drive * times)));
    stream.read(reinterpret_cast<char*>(samples.data()), bytes);
    if (stream.gcount() != bytes) break;
    const bool numbers =
        std::all_of(samples.begin(), samples.end(), [](float v) { return std::isfinite(v); });
    if (numbers) records.push_back(std::move(samples));
  }
  if (left_out != nullptr) *left_out = all - records.size();
  return records;
}

std::vector<StudyBand> StudyBands(const StudyBench& bench, const std::filesystem::path& file) {
  std::vector<StudyBand> bands;
  const StudyForces& forces = bench.forces();
  const size_t times = forces.time_s.size();
  for (size_t d = 0; d < forces.drives.size(); ++d) {
    StudyBand band{.drive = forces.drives[d],
                   .unit = forces.units[d],
                   .time_s = forces.time_s,
                   .nominal = {},
                   .lower = {},
                   .median = {},
                   .upper = {}};
    size_t left_out = 0;
    const auto records = DriveRecords(forces, d, file, &left_out);
    band.points = records.size();
    band.left_out = left_out;
    for (size_t t = 0; t < times && !records.empty(); ++t) {
      std::vector<double> values;
      values.reserve(records.size());
      for (const auto& record : records) values.push_back(static_cast<double>(record[t]));
      std::sort(values.begin(), values.end());
      band.nominal.push_back(static_cast<double>(bench.nominal().forces[d * times + t]));
      const double share = band.percentiles() ? 0.05 : 0.0;
      band.lower.push_back(Percentile(values, share));
      band.median.push_back(Percentile(values, 0.50));
      band.upper.push_back(Percentile(values, 1.0 - share));
    }
    if (band.points > 0) bands.push_back(std::move(band));
  }
  return bands;
}

namespace {

namespace fs = std::filesystem;

constexpr const char* kStudySchema = "mbverify.study/1";

// The file's bytes, piece by piece; what cannot be read any more ends it early, which `size` shows.
FileContent ContentOf(const fs::path& path, std::uint64_t* size) {
  return [path, size](const std::function<void(std::string_view)>& write) {
    std::ifstream stream(path, std::ios::binary);
    std::string piece(1 << 20, '\0');
    while (stream) {
      stream.read(piece.data(), static_cast<std::streamsize>(piece.size()));
      write(std::string_view(piece.data(), static_cast<size_t>(stream.gcount())));
      *size += static_cast<std::uint64_t>(stream.gcount());
    }
  };
}

StudyIdentity IdentityOf(const JsonValue& json) {
  StudyIdentity identity{json.at("study"), json.at("file"), json.at("fingerprint"), {}, {}};
  if (json.contains("count")) identity.drawn.count = json.at("count").get<std::uint64_t>();
  if (json.contains("seed")) identity.drawn.seed = json.at("seed").get<std::uint64_t>();
  const JsonValue shard = json.at("shard");
  identity.share.count = shard.at(1).get<std::uint64_t>();
  identity.share.index = shard.at(0).get<std::uint64_t>() - 1;
  if (identity.share.index >= identity.share.count) {
    shard.Refuse(fmt::format("says {} of {}", identity.share.index + 1, identity.share.count));
  }
  identity.points = json.value("points", "");
  if (json.contains("size")) identity.size = json.at("size").get<std::uint64_t>();
  return identity;
}

std::string NameOf(const StudyIdentity& identity) {
  if (identity.share.count == 1) return identity.study;
  return fmt::format("{}.shard-{}-of-{}", identity.study, identity.share.index + 1,
                     identity.share.count);
}

}  // namespace

std::string ToJson(const StudyIdentity& identity) {
  nlohmann::ordered_json json = {{"schema", kStudySchema},
                                 {"study", identity.study},
                                 {"file", identity.file},
                                 {"fingerprint", identity.fingerprint},
                                 {"shard", {identity.share.index + 1, identity.share.count}},
                                 {"points", identity.points},
                                 {"size", identity.size}};
  if (identity.drawn.count) json["count"] = *identity.drawn.count;
  if (identity.drawn.seed) json["seed"] = *identity.drawn.seed;
  return Dump(json);
}

std::optional<StudyIdentity> ReadIdentity(const fs::path& folder, std::optional<Finding>* damage) {
  const fs::path file = folder / kStudyFile;
  const auto text = ReadWholeFile(file);
  if (!text) return {};
  auto identity = ReadJson(*text, IdentityOf, kStudySchema);
  if (!identity && damage != nullptr) *damage = identity.refusal.FindingIn(file.string());
  return std::move(identity.value);
}

std::string PointsFingerprint(const fs::path& folder) {
  Fingerprint fingerprint;
  for (const char* grown : {kPointsFile, kForcesFile}) {
    std::uint64_t size = 0;
    ContentOf(folder / grown,
              &size)([&](std::string_view piece) { fingerprint.Add(std::string(piece)); });
  }
  return fingerprint.Text();
}

StudyFolder::StudyFolder(const fs::path& out, const StudyIdentity& identity)
    : out_(out), identity_(identity), name_(NameOf(identity)) {
  target_ = out_ / name_;
  path_ = out_ / (name_ + ".part");
}

StudyFolder::~StudyFolder() {
  if (lock_ >= 0) close(lock_);
}

// Points of a design that grows are those of fewer ones and more: rows that are there stay.
bool StudyFolder::TakeFewer(const StudyBench& bench) {
  if (!bench.study().design.grows()) return false;
  const auto is_part = [&](const std::optional<StudyIdentity>& of) {
    return of && of->size < identity_.size && of->share.index == identity_.share.index &&
           of->share.count == identity_.share.count &&
           of->fingerprint == bench.FingerprintOf(of->size);
  };
  const auto left = ReadIdentity(path_), finished = ReadIdentity(target_);
  if (!is_part(left)) {
    const bool whole = is_part(finished) && PointsFingerprint(target_) == finished->points;
    std::error_code error;
    if (!whole || !fs::is_empty(path_, error)) return false;
    for (const char* grown : {kPointsFile, kForcesFile}) {
      if (!fs::copy_file(target_ / grown, path_ / grown, error)) return false;
    }
  }
  return WriteFile(path_ / kStudyFile, ToJson(identity_)).empty();
}

std::optional<Finding> StudyFolder::Open(bool resume, const StudyBench* bench) {
  const auto refused = [&](std::string why, std::string hint) {
    return Finding{.file = path_.string(), .message = std::move(why), .hint = std::move(hint)};
  };
  const char* const elsewhere = "choose another folder with --out";
  std::error_code error;
  fs::create_directories(out_, error);
  const bool is_new = !error && fs::create_directory(path_, error);
  if (error) return refused("cannot make the folder: " + error.message(), elsewhere);
  lock_ = LockFolder(path_);
  if (lock_ < 0) {
    const bool held = errno == EWOULDBLOCK;
    return refused(std::string("cannot use the folder: ") +
                       (held ? "another process computes this study there" : std::strerror(errno)),
                   elsewhere);
  }
  if (resume && bench != nullptr && TakeFewer(*bench)) return {};
  std::optional<Finding> damage;
  const auto left = is_new ? std::nullopt : ReadIdentity(path_, &damage);
  if (damage) {
    if (damage->hint.empty()) {
      damage->hint = "remove " + path_.string() + ", or choose another folder with --out";
    }
    return damage;
  }
  if (left && left->fingerprint != identity_.fingerprint) {
    return refused("holds points of another study, or of files that have changed since",
                   "remove that folder, or choose another one with --out");
  }
  if (left && !resume) {
    return refused("holds points of this study that was not finished",
                   "--resume goes on with them; to start anew remove that folder");
  }
  if (!is_new && !left && !fs::is_empty(path_, error)) {
    return refused("is a folder of something else", elsewhere);
  }
  if (left) return {};
  const std::string trouble = WriteFile(path_ / kStudyFile, ToJson(identity_));
  if (trouble.empty()) return {};
  return Finding{.file = "", .message = trouble, .hint = elsewhere};
}

std::string StudyFolder::Publish(const std::vector<std::pair<std::string, std::string>>& files) {
  OutputFolder folder(out_, name_);
  std::string trouble = folder.Create();
  for (const char* grown : {kPointsFile, kForcesFile}) {
    std::uint64_t size = 0;
    std::error_code error;
    if (trouble.empty()) trouble = folder.Write(grown, ContentOf(path_ / grown, &size));
    if (trouble.empty() && size != fs::file_size(path_ / grown, error)) {
      trouble = fmt::format("cannot read {}", (path_ / grown).string());
    }
  }
  for (const auto& [name, content] : files) {
    if (trouble.empty()) trouble = folder.Write(name, content);
  }
  identity_.points = PointsFingerprint(path_);
  if (trouble.empty()) trouble = folder.Write(kStudyFile, ToJson(identity_));
  if (trouble.empty()) trouble = folder.Commit();
  if (!trouble.empty()) return trouble;
  std::error_code error;
  for (const char* ours : {kPointsFile, kForcesFile, kStudyFile}) fs::remove(path_ / ours, error);
  fs::remove(path_, error);  // unless it is another file by now
  return "";
}

// mbverify study

namespace {

using StudyClock = std::chrono::steady_clock;

struct StudyArguments {
  std::vector<std::string> files, folders;
  std::string out = "out", shard, sqlite;
  std::optional<double> width;
  RunStudyOptions options;
  JsonOption json;
};

// How far a study is and how long the rest takes: one line that rewrites itself, or a line now and
// then where there is no such terminal.
class StudyProgress {
 public:
  explicit StudyProgress(std::string name) : name_(std::move(name)) {}

  void Report(std::uint64_t done, std::uint64_t all, double cpu_s) {
    constexpr double kBetween_s = 30.0, kOften_s = 0.1;
    if (first_ == 0) first_ = done;
    const double elapsed = Since(start_);
    if (done < all && elapsed - shown_s_ < (line_.active() ? kOften_s : kBetween_s)) return;
    shown_s_ = elapsed;
    const double left = done > first_ ? elapsed / static_cast<double>(done - first_) *
                                            static_cast<double>(all - done)
                                      : 0.0;
    const std::string text = fmt::format("{}: {} of {} points, {:.3g} ms of processor time each",
                                         name_, done, all, 1e3 * cpu_s);
    if (line_.active()) {
      line_.Show(text, static_cast<double>(done) / static_cast<double>(all));
    } else if (elapsed > kBetween_s) {
      Say(stderr, "{}, {} left\n", text, done > first_ ? TimeText(left) : "?");
    }
  }

 private:
  static double Since(StudyClock::time_point start) {
    return std::chrono::duration<double>(StudyClock::now() - start).count();
  }

  std::string name_;
  ProgressLine line_{true};
  StudyClock::time_point start_ = StudyClock::now();
  double shown_s_ = 0.0;  // after the start
  std::uint64_t first_ = 0;
};

// What a study came to; its exit code.
int PrintStudy(const StudyArguments& arguments, const std::string& file,
               const StudyOutcome& outcome) {
  SayText(stderr, outcome.diagnostics.Text());
  if (outcome.folder.empty()) return outcome.exit_code;
  int exit_code = outcome.exit_code;
  if (outcome.report) {
    SayText(arguments.json.text(), ToText(*outcome.report));
    exit_code = WorseExit(exit_code,
                          arguments.json.Write(ToJson(*outcome.report),
                                               {{file, ""}, {outcome.report->study.scenario, ""}}));
  }
  Say(stderr, "wrote {}\n", outcome.folder);
  return exit_code;
}

// A word that is not a file but nearly a command; "" where there is none.
std::string MisspeltCommand(const std::vector<std::string>& words) {
  std::error_code error;
  const bool file = words.empty() || std::filesystem::exists(FindScenario(words[0]), error);
  return file || ClosestWord(words[0], {"merge"}).empty() ? "" : words[0];
}

int RunStudies(StudyArguments arguments) {
  if (arguments.files.empty()) return Refuse("which study?", "mbverify study FILE.yaml");
  if (const std::string word = MisspeltCommand(arguments.files); !word.empty()) {
    return Refuse(fmt::format("there is no command 'mbverify study {}'", word),
                  DidYouMean(word, {"merge"}));
  }
  if (arguments.files.size() > 1 && arguments.json.wanted()) {
    return Refuse("--json is about one study", "run them one after the other");
  }
  if (!arguments.shard.empty()) {
    const auto shard = ParseShard(arguments.shard);
    if (!shard) return Refuse("--shard " + arguments.shard + ": write i/n with 1 <= i <= n", "");
    arguments.options.points.share = {static_cast<std::uint64_t>(shard->index - 1),
                                      static_cast<std::uint64_t>(shard->count)};
  }
  if (arguments.width && !arguments.shard.empty()) {
    return Refuse("--width looks at all points, --shard computes some", "give one of them");
  }
  arguments.options.out_dir = arguments.out;
  int exit_code = 0;
  for (const std::string& given : arguments.files) {
    const std::string file = FindScenario(given);
    StudyOutcome outcome;
    {
      StudyProgress progress(file);
      arguments.options.points.progress = [&](std::uint64_t done, std::uint64_t all, double cpu_s) {
        progress.Report(done, all, cpu_s);
      };
      outcome = arguments.width ? RunStudyUntil(file, arguments.options, *arguments.width)
                                : RunStudy(file, arguments.options);
    }
    exit_code = WorseExit(exit_code, PrintStudy(arguments, file, outcome));
  }
  return exit_code;
}

void AddStudyOptions(CLI::App* study, StudyArguments* arguments) {
  study->add_option("files", arguments->files, "study files");
  study->add_option("--out", arguments->out, "folder for results")->capture_default_str();
  study->add_option("--jobs", arguments->options.points.jobs, "worker processes at once")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  study->add_flag("--resume", arguments->options.resume,
                  "go on with what a killed study, or one of fewer points, left");
  study->add_option("--shard", arguments->shard, "i/n: every n-th point, to be merged later");
  study
      ->add_option("--timeout", arguments->options.points.timeout_s,
                   "wall time limit of a point [s]")
      ->check(Positive())
      ->capture_default_str();
  study
      ->add_option("--count", arguments->options.reading.drawn.count,
                   "how many points are drawn, instead of the file's number")
      ->check(WholeNumber());
  study
      ->add_option("--seed", arguments->options.reading.drawn.seed,
                   "which points are drawn, instead of the file's seed")
      ->check(WholeNumber());
  study
      ->add_option("--width", arguments->width,
                   "draw twice as many points each time until no interval of 95 % is wider")
      ->check(Positive());
  study->add_flag("--yes", arguments->options.reading.many, "take more than 1e7 points");
  arguments->json.AddTo(study);
}

}  // namespace

void AddStudyCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<StudyArguments>();
  arguments->options.points.jobs = AllCores();
  CLI::App* study = app->add_subcommand(
      "study", "Vary numbers of a scenario: which of them matter, and how often limits are kept");
  AddStudyOptions(study, arguments.get());
  CLI::App* merge = study->add_subcommand("merge", "Join the folders of all shards of a study");
  merge->add_option("folders", arguments->folders, "result folders of the shards")->required();
  merge->add_option("-o,--out", arguments->out, "folder for results")->capture_default_str();
  merge->add_option("--sqlite", arguments->sqlite, "also write all rows to this new SQLite file");
  merge->callback([arguments, exit_code] {
    const StudyOutcome outcome = MergeStudies(arguments->folders, arguments->out);
    *exit_code = PrintStudy(*arguments, "", outcome);
    if (arguments->sqlite.empty() || !outcome.report) return;
    const std::string trouble =
        WriteSqlite(outcome.folder, outcome.report->study, arguments->sqlite);
    if (trouble.empty()) return;
    Say(stderr, "error: {}\n", trouble);
    *exit_code = WorseExit(*exit_code, 3);
  });
  const char* codes = "0 limits are kept, 1 one is not, 2 bad input, 3 no point could run";
  SetFooter(merge, {"study merge out/s.shard-1-of-2 out/s.shard-2-of-2 -o out"}, codes);
  SetFooter(study,
            {"study my_study.yaml", "study my_study.yaml --resume",
             "study my_study.yaml --shard 2/8 --out shards"},
            codes);
  study->callback([arguments, merge, exit_code] {
    if (!merge->parsed()) *exit_code = RunStudies(*arguments);
  });
}

}  // namespace mbv
