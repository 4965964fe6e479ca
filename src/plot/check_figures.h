// Whether the figures that a scenario composes can be drawn.
#pragma once

#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "math/channel.h"
#include "plot/figure.h"

namespace mbv {

/// Whether a channel's name fits a pattern, in which '*' stands for any characters.
[[nodiscard]] bool FitsPattern(const std::string& name, const std::string& pattern);

/// Signals, witnesses and units that do not exist or do not go together are errors at their places
/// in `file`. `known`: all channels that some witness may record; `foreign`: names of the
/// scenario's foreign witnesses.
void CheckFigures(const std::vector<FigureSpec>& figures, const std::vector<Channel>& known,
                  const std::vector<std::string>& foreign, const std::string& file,
                  Diagnostics* diagnostics);

}  // namespace mbv
