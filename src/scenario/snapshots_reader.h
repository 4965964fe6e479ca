// The section `snapshots` of a scenario file: what its pictures show and how they look.
#pragma once

#include "input/value_reader.h"
#include "scenario/scenario.h"

namespace mbv {

/// Without the section: pictures at the start and half way.
[[nodiscard]] SnapshotSettings ReadSnapshots(ValueReader* values, const YamlNode* node,
                                             double duration_s, const Mechanism& mechanism);

}  // namespace mbv
