// "Did you mean …?" about whatever a user may name: one resolver for all of it.
#pragma once

#include <string>
#include <vector>

#include "core/diagnostics.h"

namespace mbv {

/// As DidYouMean(word, candidates) in core/diagnostics.h, or `otherwise` when none is near.
[[nodiscard]] std::string DidYouMean(const std::string& word,
                                     const std::vector<std::string>& candidates,
                                     const std::string& otherwise);

/// The same about a path, folder by folder: what exists and is spelt like it.
[[nodiscard]] std::string DidYouMeanPath(const std::string& path,
                                         const std::string& otherwise = "");

}  // namespace mbv
