// `design:` of a study file. Internal to scenario/.
#pragma once

#include <string>
#include <vector>

#include "input/value_reader.h"
#include "study/study.h"

namespace mbv::internal {

/// Whether the design is a list of points, however wrong the rest is.
[[nodiscard]] bool IsListDesign(const YamlNode* node);

/// The design of these factors; a list is read from its file (beside `folder`), one column per
/// factor. More than `most` points are a finding.
[[nodiscard]] Design ReadDesign(ValueReader* values, const YamlNode& node,
                                const std::string& folder, const std::vector<Factor>& factors,
                                std::uint64_t most, Diagnostics* list_findings);

}  // namespace mbv::internal
