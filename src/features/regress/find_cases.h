// Which scenarios a regression runs, under which names, and what they depend on.
#pragma once

#include <string>
#include <vector>

#include "scenario/load_scenario.h"

namespace mbv {

/// A scenario file to run.
struct CaseFile {
  std::string key;     ///< see CaseKey()
  std::string file;    ///< as found
  std::string inputs;  ///< fingerprint of the file
  std::string models;  ///< the files that its mechanism's name stands for
  ScenarioHead head;
  std::string command = "run";  ///< of the program that runs it
};

struct FoundCases {
  std::vector<CaseFile> cases;        ///< sorted by key, each once
  std::vector<std::string> troubles;  ///< one line each; not empty: bad input
  std::vector<std::string> unread;    ///< folders that cannot be read: they may hold scenarios
};

/// The path below the last folder named "scenarios", without ending; for a file elsewhere its path
/// below the current folder. The same on every machine, and a plain path (base/files.h).
[[nodiscard]] std::string CaseKey(const std::string& file);

/// Files as given; a folder stands for every scenario below it, must_fail ones included. A file
/// that names a mechanism counts even if it is not YAML any more, and so does one whose reading
/// ends the program: it must not silently drop out. Files are read in child processes.
[[nodiscard]] FoundCases FindCases(const std::vector<std::string>& paths);

/// Part `index` (1 … count) of the sorted cases: every count-th, so that neighbours, which cost
/// alike, are spread.
struct Shard {
  int index = 1, count = 1;
};
/// "2/3"; empty when it is not a shard.
[[nodiscard]] std::optional<Shard> ParseShard(const std::string& text);
void KeepShard(const Shard& shard, std::vector<CaseFile>* cases);

}  // namespace mbv
