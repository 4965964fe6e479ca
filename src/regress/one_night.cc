#include "regress/one_night.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "regress/find_cases.h"
#include "regress/utc_time.h"

namespace mbv {
namespace {

// Both parts and what each of them says, where that differs.
void CompareParts(const std::vector<NightPart>& parts, const char* what,
                  const std::function<std::string(const RunInfo&)>& value,
                  std::vector<std::string>* troubles) {
  for (const NightPart& part : parts) {
    const std::string here = value(part.run), there = value(parts.front().run);
    if (here == there) continue;
    troubles->push_back(fmt::format("{} has {} '{}', {} has '{}'", part.folder, what, here,
                                    parts.front().folder, there));
    return;
  }
}

void CheckSameNight(const std::vector<NightPart>& parts, std::vector<std::string>* troubles) {
  const auto earlier = [](const NightPart& a, const NightPart& b) {
    return a.run.started_utc < b.run.started_utc;
  };
  const auto [first, last] = std::minmax_element(parts.begin(), parts.end(), earlier);
  const double hours = UtcHours(last->run.started_utc) - UtcHours(first->run.started_utc);
  if (hours <= kNightSpan_h) return;
  troubles->push_back(fmt::format("{} started {}, {} started {}: two nights", first->folder,
                                  first->run.started_utc, last->folder, last->run.started_utc));
}

// Which of the n shards are there.
void CheckShards(const std::vector<NightPart>& parts, PartTroubles* troubles) {
  std::set<int> seen;
  int count = 0;
  for (const NightPart& part : parts) {
    const auto shard = ParseShard(part.run.shard);
    if (!shard || (count != 0 && shard->count != count)) {
      troubles->foreign.push_back(part.run.shard.empty()
                                      ? fmt::format("{} is a whole run, no shard", part.folder)
                                      : fmt::format("{} is shard {}, others are parts of {}",
                                                    part.folder, part.run.shard, count));
      return;
    }
    count = shard->count;
    if (!seen.insert(shard->index).second) {
      troubles->foreign.push_back(
          fmt::format("{}: shard {} is in another folder, too", part.folder, part.run.shard));
    }
  }
  for (int i = 1; i <= count; ++i) {
    if (!seen.contains(i))
      troubles->missing.push_back(fmt::format("shard {}/{} missing", i, count));
  }
}

// All shards list the same scenarios and take every n-th of them.
void CheckTotal(const std::vector<NightPart>& parts, PartTroubles* troubles) {
  size_t cases = 0;
  for (const NightPart& part : parts) cases += part.cases;
  const size_t found = parts.front().run.found;
  if (found == 0 || cases == found || !troubles->empty()) return;
  troubles->missing.push_back(
      fmt::format("the shards hold {} scenarios, {} were found", cases, found));
}

}  // namespace

PartTroubles FindPartTroubles(const std::vector<NightPart>& parts,
                              const std::vector<std::string>& unfinished) {
  PartTroubles troubles;
  for (const std::string& folder : unfinished) {
    troubles.missing.push_back(folder + ": no regress.json in this folder: its run did not end");
  }
  if (parts.empty()) {
    troubles.foreign.emplace_back("none of the folders holds a run");
    return troubles;
  }
  const bool whole = parts.size() == 1 && parts.front().run.shard.empty();
  if (!whole) {
    CheckShards(parts, &troubles);
    CompareParts(
        parts, "label", [](const RunInfo& run) { return run.label; }, &troubles.foreign);
    CompareParts(
        parts, "program", [](const RunInfo& run) { return run.program; }, &troubles.foreign);
    const auto total = [](const RunInfo& run) { return fmt::format("{}", run.found); };
    CompareParts(parts, "a number of scenarios of", total, &troubles.foreign);
    CheckSameNight(parts, &troubles.foreign);
  }
  CheckTotal(parts, &troubles);
  return troubles;
}

}  // namespace mbv
