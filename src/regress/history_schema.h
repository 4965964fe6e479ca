// Tables of the history.
#pragma once

#include <string>

#include "regress/database.h"
#include "regress/golden.h"

namespace mbv {

/// PRAGMA user_version; 1 had no uid of runs, 2 not what they cover.
inline constexpr int kHistoryVersion = 3;

/// Makes the tables where they are missing, or what an older file lacks; a newer program's file and
/// a file with other tables are trouble. Call inside a write
/// transaction. "" or what went wrong.
[[nodiscard]] std::string PrepareSchema(const std::string& path, Database* database);

/// Whether PrepareSchema() would take the file; changes nothing.
[[nodiscard]] std::string CheckWritable(const std::string& path, Database* database);

/// The same check for readers, which change nothing.
[[nodiscard]] std::string CheckSchema(const std::string& path, Database* database);

/// Number of a run given as "17", "last" or "last~1"; 0 if there is none.
[[nodiscard]] long FindRun(Database* database, const std::string& text);

/// The golden traces kept with a result.
[[nodiscard]] GoldenTraces LoadGolden(Database* database, long result);

}  // namespace mbv
