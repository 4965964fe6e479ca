// The folder of a study while it is computed, and what tells one study's folder from another's.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/diagnostics.h"
#include "pipeline/study_points.h"
#include "scenario/study_file.h"

namespace mbv {

/// study.json of a folder: whose rows it holds.
struct StudyIdentity {
  std::string study, file, fingerprint;
  DrawnDesign drawn;
  StudyShare share;
  std::string points;  ///< fingerprint of the finished points and forces; "" while they grow
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
  /// or why not.
  [[nodiscard]] std::optional<Finding> Open(bool resume);
  /// Publishes points and forces with these files in OUT/NAME; then the folder goes. "" or why not.
  [[nodiscard]] std::string Publish(const std::vector<std::pair<std::string, std::string>>& files);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] const std::filesystem::path& target() const { return target_; }

 private:
  std::filesystem::path out_, target_, path_;
  StudyIdentity identity_;
  std::string name_;
  int lock_ = -1;
};

}  // namespace mbv
