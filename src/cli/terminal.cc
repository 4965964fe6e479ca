#include "cli/terminal.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

namespace mbv {

void FindingPrinter::Print(const Diagnostics& diagnostics) {
  for (const Finding& finding : diagnostics.findings()) {
    const std::string text = ToText(finding);
    if (told_.insert(text).second) fmt::print(to_, "{}\n", text);
  }
}

bool WantsColor() {
  const char* no_color = std::getenv("NO_COLOR");
  return isatty(STDOUT_FILENO) != 0 && (no_color == nullptr || *no_color == '\0');
}

ProgressLine::ProgressLine(bool wanted) : active_(wanted && isatty(STDERR_FILENO) != 0) {}

void ProgressLine::Show(const std::string& what, double fraction) {
  const int percent = static_cast<int>(100.0 * fraction);
  if (!active_ || (percent == last_percent_ && what == last_what_)) return;
  last_percent_ = percent;
  last_what_ = what;
  std::fprintf(stderr, "\r\x1b[K%s %d %%", what.c_str(), percent);
  std::fflush(stderr);
  shown_ = true;
}

void ProgressLine::Clear() {
  if (!shown_) return;
  std::fputs("\r\x1b[K", stderr);
  std::fflush(stderr);
  shown_ = false;
}

}  // namespace mbv
