// docs/results/paper_figures.md: all figures of all papers on one page.
#pragma once

#include <string>
#include <vector>

#include "pipeline/paper_figures.h"

namespace mbv {

/// Markdown. Pictures are named "pictures/paper_MODEL_NAME.png" beside the page.
[[nodiscard]] std::string PaperPage(const std::vector<PaperOutcome>& papers);

}  // namespace mbv
