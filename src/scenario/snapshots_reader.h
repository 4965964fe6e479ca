// The section `snapshots` of a scenario file: what its pictures show and how they look.
#pragma once

#include <string>
#include <vector>

#include "model_file/yaml/value_reader.h"
#include "plot/figure.h"
#include "scenario/scenario.h"

namespace mbv {

/// Without the section: pictures at the start and half way.
[[nodiscard]] SnapshotSettings ReadSnapshots(ValueReader* values, const YamlNode* node,
                                             double duration_s, const Mechanism& mechanism);

// Reads `figures:` of a scenario. Channels, units and witnesses are checked where their names are
// known (plot/check_figures.h).

[[nodiscard]] std::vector<FigureSpec> ReadFigures(ValueReader* values, const YamlNode* node);
/// The list below `panels:` of a figure; `path` is its key's.
[[nodiscard]] std::vector<PanelSpec> ReadPanels(ValueReader* values, const YamlNode& node,
                                                const std::string& path);

}  // namespace mbv
