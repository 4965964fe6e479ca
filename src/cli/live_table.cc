#include "cli/live_table.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "regress/summaries.h"
#include "regress/trouble_text.h"

namespace mbv {

LiveTable::LiveTable(bool wanted) : wanted_(wanted), terminal_(isatty(STDERR_FILENO) != 0) {
  const char* no_color = std::getenv("NO_COLOR");
  color_ = terminal_ && (no_color == nullptr || *no_color == '\0');
}

void LiveTable::Begin(size_t cases, size_t kept) {
  cases_ = cases;
  if (wanted_ && kept > 0) fmt::print(stderr, "{} finished scenarios are kept\n", kept);
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
  fmt::print(stderr, "[{:>{}}/{}] {}{:<16}{} {:<52} {:>6.1f} s {:>5.0f} MiB  {}\n", done_,
             fmt::formatted_size("{}", cases_), cases_, start, WordOf(result),
             color_ ? "\x1b[0m" : "", result.key, result.cost.wall_s,
             static_cast<double>(result.cost.peak_kib) / 1024.0,
             result.failed() ? FailureLine(result) : KeyText(result));
  Draw();
}

void LiveTable::Draw() {
  if (!wanted_ || !terminal_ || running_.empty()) return;
  Clear();
  for (const Running& running : running_) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - running.start;
    fmt::print(stderr, "  running  {:<52.52} {:>6.1f} s\n", running.key, elapsed.count());
  }
  fmt::print(stderr, "  {} of {} done, {} not as expected\n", done_, cases_, failed_);
  lines_ = running_.size() + 1;
  std::fflush(stderr);
}

void LiveTable::Clear() {
  if (lines_ > 0) fmt::print(stderr, "\x1b[{}A\x1b[J", lines_);
  lines_ = 0;
}

}  // namespace mbv
