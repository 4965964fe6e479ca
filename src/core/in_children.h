// Work on what strangers wrote, in processes of its own: whatever it does ends a child, not the
// night.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace mbv {

/// As many processes as this machine runs at once; at least 1.
[[nodiscard]] int AllCores();

/// How StreamFromChildren() shares work out.
struct ChildStreams {
  int parallel = 1;          ///< children at once, at least 1
  double timeout_s = 300.0;  ///< for each text, from when it is the next one
};

/// Calls work(0) … work(count − 1) in child processes, and take(i, text) here, in that order; empty
/// where the child died or took longer. take() returns false to end all. A child that is ahead
/// waits, so that no more than a pipe's content of texts is kept.
void StreamFromChildren(size_t count, const ChildStreams& streams,
                        const std::function<std::string(size_t)>& work,
                        const std::function<bool(size_t, const std::optional<std::string>&)>& take);

/// As StreamFromChildren(), however long a text takes; where one job at once is wanted, work() is
/// called here. What work() gives must not depend on earlier calls: then nothing depends on `jobs`.
void ShareOut(size_t count, int jobs, const std::function<std::string(size_t)>& work,
              const std::function<void(size_t, const std::optional<std::string>&)>& take);

/// Calls work(0) … work(count − 1) in a child process and gives their texts back; empty where the
/// child died or took longer than `timeout_s`: another child goes on with the next.
[[nodiscard]] std::vector<std::optional<std::string>> InChildren(
    size_t count, double timeout_s, const std::function<std::string(size_t)>& work);

}  // namespace mbv
