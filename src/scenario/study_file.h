// Study file → Study, checked against its scenario (docs/how-to/studies.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/diagnostics.h"
#include "study/study.h"

namespace mbv {

/// A study with more points is a mistake, unless somebody says that it is none.
inline constexpr std::uint64_t kMostStudyPoints = 10'000'000;

/// How many points are drawn and from which seed, where somebody asks for others than the file.
struct DrawnDesign {
  std::optional<std::uint64_t> count = {}, seed = {};
};

struct StudyOptions {
  bool many = false;  ///< take more than kMostStudyPoints
  DrawnDesign drawn = {};
};

struct StudyResult {
  std::optional<Study> study;  ///< empty when there are errors
  Diagnostics diagnostics;     ///< all findings of the file, its scenario and model
};

/// Loads a study and, for its names and nominal values, the scenario that it varies. Collects all
/// findings; never throws for bad input. Whether a quantity's channel exists is not looked at.
[[nodiscard]] StudyResult LoadStudy(const std::string& file, const StudyOptions& options = {});

/// The same from text, for tests; `file` is used in messages and to find the scenario.
[[nodiscard]] StudyResult LoadStudyText(const std::string& text, const std::string& file,
                                        const StudyOptions& options = {});

}  // namespace mbv
