// traces.csv in pieces.
#pragma once

#include <functional>
#include <string_view>

#include "report/report.h"

namespace mbv {

/// ToCsv() piece by piece, in their order: the whole text may be larger than all that it is made
/// of.
void WriteCsv(const Report& report, const std::function<void(std::string_view)>& write);

}  // namespace mbv
