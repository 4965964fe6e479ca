// Traces of a run in the binary formats of report/data/data_file.h, and what the columns of
// traces.csv are.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "report/report.h"

namespace mbv {

/// "csv", and DataFormat::word of all formats.
[[nodiscard]] std::vector<std::string> DataWords();

/// Names and bytes of the files that these words stand for; "" in `trouble`, or
/// what went wrong.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> DataFilesOf(
    const Report& report, const std::vector<std::string>& words, std::string* trouble);

}  // namespace mbv
