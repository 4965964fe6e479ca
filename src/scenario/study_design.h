// `design:` of a study file. Internal to scenario/.
#pragma once

#include <string>
#include <vector>

#include "input/value_reader.h"
#include "scenario/study_file.h"
#include "study/study.h"

namespace mbv::internal {

/// Whether the design is a list of points, however wrong the rest is.
[[nodiscard]] bool IsListDesign(const YamlNode* node);

/// What a design is read with, besides its factors.
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
