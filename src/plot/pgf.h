// Figures as source for TeX (pgfplots): the same places, ranges, colours and dashes as drawn, and
// all numbers in files beside it, so that an author may change what they like.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "plot/figure.h"
#include "plot/style.h"

namespace mbv {

/// Names and contents: NAME.tex; NAME.dat with two columns x0 y0, x1 y1, … for each curve, "nan"
/// where it has a gap or no more points; NAME_map.dat with x, y and c (its logarithm to base 10 on
/// a logarithmic scale) for each cell of a map.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> PgfFiles(const Figure& figure,
                                                                        const FigureStyle& style);

}  // namespace mbv
