// Work on what strangers wrote, in processes of its own: whatever it does ends a child, not the
// night.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace mbv {

/// Calls work(0) … work(count − 1) in a child process and gives their texts back; empty where the
/// child died or took longer than `timeout_s`: another child goes on with the next.
[[nodiscard]] std::vector<std::optional<std::string>> InChildren(
    size_t count, double timeout_s, const std::function<std::string(size_t)>& work);

}  // namespace mbv
