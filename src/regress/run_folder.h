// The folder of a regression run: its files, its state for --resume, its lock.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "regress/case_result.h"
#include "regress/golden.h"

namespace mbv {

class RunFolder {
 public:
  explicit RunFolder(std::filesystem::path out) : out_(std::move(out)) {}
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  /// Makes and locks the folder; removes what a killed run left half done. "" or what is wrong.
  [[nodiscard]] std::string Open();

  [[nodiscard]] const std::filesystem::path& path() const { return out_; }
  [[nodiscard]] std::filesystem::path Result(const std::string& key) const { return out_ / key; }
  [[nodiscard]] std::filesystem::path Log(const std::string& key) const;
  /// Where a worker writes, until its result is moved to its place.
  [[nodiscard]] std::filesystem::path Staging(size_t job) const;

  /// The folder with a summary.json below Staging(job); empty if there is none.
  [[nodiscard]] std::optional<std::filesystem::path> FindStaged(size_t job) const;
  /// Puts a staged folder in its place, replacing an older one. "" or what went wrong.
  [[nodiscard]] std::string Publish(const std::filesystem::path& staged,
                                    const std::string& key) const;
  void RemoveStaging(size_t job) const;

  // State of single scenarios, whole or not at all.
  [[nodiscard]] std::string SaveState(const CaseResult& result) const;
  [[nodiscard]] std::optional<CaseResult> LoadState(const std::string& key) const;
  void ForgetStates() const;

  [[nodiscard]] GoldenTraces Golden(const std::string& key) const;
  /// Data URI of the first snapshot; "" if there is none.
  [[nodiscard]] std::string Thumbnail(const std::string& key) const;

 private:
  std::filesystem::path out_;
  int lock_ = -1;
};

}  // namespace mbv
