// How far a computation is.
#pragma once

#include <functional>
#include <string>

namespace mbv {

/// Stage ("simulation") and how much of it is done (0 … 1).
using ProgressFunction = std::function<void(const std::string& stage, double fraction)>;

/// The same of one stage; empty if nobody asks.
[[nodiscard]] inline std::function<void(double)> StageOf(const ProgressFunction& progress,
                                                         const std::string& stage) {
  if (!progress) return {};
  return [progress, stage](double fraction) { progress(stage, fraction); };
}

}  // namespace mbv
