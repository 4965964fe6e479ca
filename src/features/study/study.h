// `mbverify study`: from a study file to its result folder.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "features/study/study_bench.h"
#include "features/study/study_file.h"
#include "features/study/study_report.h"

namespace mbv {

struct RunStudyOptions {
  std::string out_dir = "out";
  PointsOptions points;
  /// Go on with what a killed study left, or with the result of fewer points of the same study.
  bool resume = false;
  StudyOptions reading;  ///< of the file
};

struct StudyOutcome {
  int exit_code = 4;  ///< 0 limits are kept, 1 one is not, 2 bad input, 3 no point could be run
  Diagnostics diagnostics;
  std::string folder;                 ///< of the result; "" without one
  std::optional<StudyReport> report;  ///< of a whole study; shards have none
};

/// Rows grow in OUT/NAME.part, which goes when the result is in OUT/NAME. A shard's result is in
/// OUT/NAME.shard-2-of-5.
[[nodiscard]] StudyOutcome RunStudy(const std::string& file, const RunStudyOptions& options);

/// Draws 64 points or blocks, then twice as many each time, up to the design's number, until no
/// interval of a share or of a Sobol' index is wider than `width`.
[[nodiscard]] StudyOutcome RunStudyUntil(const std::string& file, RunStudyOptions options,
                                         double width);

/// The rows of a result folder as one SQLite file: the table `points`, a column for each of
/// points.csv. "" or why not.
[[nodiscard]] std::string WriteSqlite(const std::filesystem::path& folder, const Study& study,
                                      const std::string& file);

/// Joins the folders of all shards of one study: the same bytes as those of the study at once.
[[nodiscard]] StudyOutcome MergeStudies(const std::vector<std::string>& folders,
                                        const std::string& out_dir);

/// Findings of a study file, its scenario and model; a point is computed to check names.
[[nodiscard]] Diagnostics CheckStudy(const std::string& file);

// Percentiles of drive forces over time, from what points of a study recorded.

/// One drive's forces in the records of `file` (kForcesFile): points × times, those points whose
/// forces are all numbers. `left_out`: how many are not.
[[nodiscard]] std::vector<std::vector<float>> DriveRecords(const StudyForces& forces, size_t drive,
                                                           const std::filesystem::path& file,
                                                           size_t* left_out = nullptr);

/// One band per drive, of the records in `file` (kForcesFile); none without records.
[[nodiscard]] std::vector<StudyBand> StudyBands(const StudyBench& bench,
                                                const std::filesystem::path& file);

// The folder of a study while it is computed, and what distinguishes one study's folder from
// another's.

/// study.json of a folder: whose rows it holds.
struct StudyIdentity {
  std::string study, file, fingerprint;
  DrawnDesign drawn;
  StudyShare share;
  std::string points = {};  ///< fingerprint of the finished points and forces; "" while they grow
  std::uint64_t size = 0;   ///< Design::count
};
inline constexpr const char* kStudyFile = "study.json";

[[nodiscard]] std::string ToJson(const StudyIdentity& identity);
/// Empty where there is none, and where there is one that cannot be used: `damage` says why.
[[nodiscard]] std::optional<StudyIdentity> ReadIdentity(const std::filesystem::path& folder,
                                                        std::optional<Finding>* damage = nullptr);
/// Of the bytes of points and forces in `folder`.
[[nodiscard]] std::string PointsFingerprint(const std::filesystem::path& folder);

/// OUT/NAME.part, locked while this lives; two processes never grow the same rows.
class StudyFolder {
 public:
  StudyFolder(const std::filesystem::path& out, const StudyIdentity& identity);
  ~StudyFolder();
  StudyFolder(const StudyFolder&) = delete;
  StudyFolder& operator=(const StudyFolder&) = delete;

  /// Makes it, or takes what a killed study left: only with `resume`, and of the same study. Empty,
  /// or why not. `bench`: whose rows with fewer drawn points are taken, too, where its design
  /// grows.
  [[nodiscard]] std::optional<Finding> Open(bool resume, const StudyBench* bench = nullptr);
  /// Publishes points and forces with these files in OUT/NAME; then the folder goes. "" or why not.
  [[nodiscard]] std::string Publish(const std::vector<std::pair<std::string, std::string>>& files);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] const std::filesystem::path& target() const { return target_; }

 private:
  [[nodiscard]] bool TakeFewer(const StudyBench& bench);

  std::filesystem::path out_, target_, path_;
  StudyIdentity identity_;
  std::string name_;
  int lock_ = -1;
};

}  // namespace mbv
