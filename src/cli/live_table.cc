#include "cli/live_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "cli/terminal.h"
#include "regress/summaries.h"
#include "regress/trouble_text.h"

namespace mbv {

LiveTable::LiveTable(bool wanted)
    : wanted_(wanted), terminal_(ObeysEscapes(stderr)), color_(WantsColor(stderr)) {}

void LiveTable::Begin(size_t cases, size_t kept) {
  cases_ = cases;
  if (wanted_ && kept > 0) Say(stderr, "{} finished scenarios are kept\n", kept);
}

void LiveTable::Started(const std::string& key) {
  running_.push_back({key, std::chrono::steady_clock::now()});
}

void LiveTable::Ended(const CaseResult& result) {
  ++done_;
  failed_ += result.failed() ? 1 : 0;
  std::erase_if(running_, [&](const Running& running) { return running.key == result.key; });
  if (!wanted_) return;
  Clear();
  const char* start = !color_ ? "" : result.failed() ? "\x1b[1;31m" : "\x1b[32m";
  Say(stderr, "[{:>{}}/{}] {}{:<16}{} {:<52} {:>6.1f} s {:>5.0f} MiB  {}\n", done_,
      fmt::formatted_size("{}", cases_), cases_, start, WordOf(result), color_ ? "\x1b[0m" : "",
      result.key, result.cost.wall_s, static_cast<double>(result.cost.peak_kib) / 1024.0,
      result.failed() ? FailureLine(result) : KeyText(result));
  Draw();
}

void LiveTable::Draw() {
  if (!wanted_ || !terminal_ || running_.empty()) return;
  Clear();
  // What the terminal would break could not be taken back.
  const size_t columns = TerminalColumns(stderr), most = 52;
  const size_t room = columns == 0 ? most : std::min(most, std::max<size_t>(columns, 28) - 27);
  for (const Running& running : running_) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - running.start;
    Say(stderr, "  running  {:<{}.{}} {:>6.1f} s\n", running.key, room, room, elapsed.count());
  }
  Say(stderr, "  {} of {} done, {} not as expected\n", done_, cases_, failed_);
  lines_ = running_.size() + 1;
  std::fflush(stderr);
}

void LiveTable::Clear() {
  if (lines_ > 0) fmt::print(stderr, "\x1b[{}A\x1b[J", lines_);
  lines_ = 0;
}

}  // namespace mbv
