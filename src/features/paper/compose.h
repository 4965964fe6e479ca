// The figures that a scenario composes, of what its run gave.
#pragma once

#include <vector>

#include "features/paper/default_figures.h"
#include "plot/figure.h"

namespace mbv {

/// `specs` passed CheckFigures(). Over time a panel of several signals has a colour and dashes for
/// each, one witness as lines and the others as markers; a panel of one signal, or of differences,
/// or over another signal has a line for each witness. What no witness recorded is left out, and
/// reported.
[[nodiscard]] FigureSet ComposeFigures(const std::vector<FigureSpec>& specs, const Report& report,
                                       Language language);

}  // namespace mbv
