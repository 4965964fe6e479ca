// traces.csv in pieces.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "report/report.h"

namespace mbv {

/// ToCsv() piece by piece, in their order: the whole text may be larger than all that it is made
/// of.
void WriteCsv(const Report& report, const std::function<void(std::string_view)>& write);

/// What the columns of traces.csv are, as CSV on the Web [W3C 2015] has it: name, unit, quantity,
/// subject and frame of each.
[[nodiscard]] std::string CsvMetadata(const Report& report);
inline constexpr const char* kCsvMetadataFile = "traces.csv-metadata.json";

}  // namespace mbv
