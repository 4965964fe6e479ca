// Results of a long computation, kept as they come, so that an interrupted one goes on.
//
// A computation asks for its results one after the other, in an order on which nothing depends but
// the question. A log gives those that a run before has kept, then computes and keeps the others:
// so all bytes are those of a run without interruption. What a kill cut off is computed again.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/files.h"
#include "math/bytes.h"

namespace mbv {

/// One thread at a time asks.
class ResultLog {
 public:
  /// Keeps nothing.
  ResultLog() = default;
  /// Goes on with what the file has of the same identity; else the file begins anew.
  ResultLog(std::filesystem::path file, std::string identity);

  template <typename T, typename Compute>
  [[nodiscard]] T Get(const Compute& compute) {
    if (auto kept = Kept<T>()) return *std::move(kept);
    T value = compute();
    Keep(value);
    return value;
  }
  /// The next result of those that an earlier run has kept; empty behind the last one.
  template <typename T>
  [[nodiscard]] std::optional<T> Kept() {
    std::string bytes;
    while (Next(&bytes)) {
      if (auto kept = FromBytes<T>(bytes)) return kept;
      Forget();
    }
    return {};
  }
  /// Behind those that Kept() gave, all of them.
  template <typename T>
  void Keep(const T& value) {
    if (!file_.empty()) Append(ToBytes(value));
  }
  /// Results that an earlier run left, so far.
  [[nodiscard]] size_t kept() const { return kept_; }

 private:
  [[nodiscard]] bool Next(std::string* bytes);
  void Forget();  // from the result on that was read last
  void Append(const std::string& bytes);

  std::filesystem::path file_;
  std::ifstream from_;
  std::unique_ptr<GrowingFile> to_;
  std::uint64_t end_ = 0, last_ = 0;  // of what is good, and before the result read last
  size_t kept_ = 0;
};

/// FOLDER, locked and with the logs of one computation while this lives; only a kill leaves it.
class ResumeFolder {
 public:
  /// `identity`: of all that the results depend on.
  ResumeFolder(std::filesystem::path folder, std::string identity);
  ~ResumeFolder();
  ResumeFolder(const ResumeFolder&) = delete;
  ResumeFolder& operator=(const ResumeFolder&) = delete;

  /// Another process uses it: nothing is kept then.
  [[nodiscard]] bool taken() const { return taken_; }
  /// Beginning with what an interrupted run left.
  [[nodiscard]] ResultLog Log(const std::string& name) const;
  /// What an interrupted run left is there.
  [[nodiscard]] bool resumes() const { return resumes_; }
  /// Removes it.
  void Forget();

 private:
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> made_;  ///< folders that were not there, the deepest first
  std::string identity_;
  int lock_ = -1;
  bool taken_ = false, resumes_ = false;
};

}  // namespace mbv
