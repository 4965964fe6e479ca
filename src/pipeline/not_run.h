// Computations that did not take place.
#pragma once

#include <string>

#include "core/run_summary.h"

namespace mbv {

/// The summary of a witness that was not asked, and why.
inline RunSummary NotRun(const std::string& why) {
  RunSummary summary;
  summary.message = why;
  return summary;
}

}  // namespace mbv
