// Study file → Study, checked against its scenario (docs/how-to/studies.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "features/study/design.h"
#include "model_file/yaml/value_reader.h"

namespace mbv {

/// A study with more points is a mistake, unless the option for it is given.
inline constexpr std::uint64_t kMostStudyPoints = 10'000'000;

/// How many points are drawn and from which seed, where options differ from the file.
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

// `design:` of a study file. Internal to scenario/.

namespace mbv::internal {

/// Whether the design is a list of points, however wrong the rest is.
[[nodiscard]] bool IsListDesign(const YamlNode* node);

/// What a design is read with, in addition to its factors.
struct DesignContext {
  std::string folder;          ///< of the study; a list is read from a file beside it
  std::uint64_t most = 0;      ///< more points are a finding
  DrawnDesign drawn = {};      ///< instead of what the file says
  Diagnostics* list_findings;  ///< about a list's file
};

/// The design of these factors; a list has one column per factor.
[[nodiscard]] Design ReadDesign(ValueReader* values, const YamlNode& node,
                                const std::vector<Factor>& factors, const DesignContext& context);

/// `correlations:` of a study file: [{of: [m_p, m_1], coefficient: 0.8}], for a design that was
/// read without findings.
void ReadCorrelations(ValueReader* values, const YamlNode& node, const std::vector<Factor>& factors,
                      Design* design);

}  // namespace mbv::internal
