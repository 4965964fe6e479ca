// Reads `figures:` of a scenario. Channels, units and witnesses are checked where their names are
// known (figure/check_figures.h).
#pragma once

#include <string>
#include <vector>

#include "input/value_reader.h"
#include "scenario/figure_spec.h"

namespace mbv {

[[nodiscard]] std::vector<FigureSpec> ReadFigures(ValueReader* values, const YamlNode* node);
/// The list below `panels:` of a figure; `path` is its key's.
[[nodiscard]] std::vector<PanelSpec> ReadPanels(ValueReader* values, const YamlNode& node,
                                                const std::string& path);

}  // namespace mbv
