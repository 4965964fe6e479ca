// What a regression does now: a table that rewrites itself on a terminal, plain lines elsewhere.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "regress/case_result.h"

namespace mbv {

class LiveTable {
 public:
  /// Writes to stderr; nothing at all unless `wanted`.
  explicit LiveTable(bool wanted);

  void Begin(size_t cases, size_t kept);
  void Started(const std::string& key);
  void Ended(const CaseResult& result);
  void Draw();   ///< the running scenarios below the finished ones
  void Clear();  ///< removes the running ones

 private:
  struct Running {
    std::string key;
    std::chrono::steady_clock::time_point start;
  };
  bool wanted_ = false, terminal_ = false, color_ = false;
  size_t cases_ = 0, done_ = 0, failed_ = 0, lines_ = 0;
  std::vector<Running> running_;
};

}  // namespace mbv
