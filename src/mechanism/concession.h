// What a model makes the loader accept against its rules (`allow:`, `closure_tolerance:`). The
// loader warns; verdicts on such a model name it, too.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "core/diagnostics.h"

namespace mbv {

/// The loader's warnings about it say this, and then what.
inline constexpr const char* kConcession = "ALLOWED BY THE MODEL: ";

/// What the findings of loading a model say after kConcession, each once.
[[nodiscard]] inline std::vector<std::string> ConcessionsIn(const Diagnostics& findings) {
  std::vector<std::string> concessions;
  for (const Finding& finding : findings.findings()) {
    const size_t at = finding.message.find(kConcession);
    if (at == std::string::npos) continue;
    const std::string text = finding.message.substr(at + std::string(kConcession).size());
    if (std::find(concessions.begin(), concessions.end(), text) == concessions.end()) {
      concessions.push_back(text);
    }
  }
  return concessions;
}

}  // namespace mbv
