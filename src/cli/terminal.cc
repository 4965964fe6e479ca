#include "cli/terminal.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "base/text.h"

namespace mbv {
namespace {

constexpr size_t kNarrowest = 20;  // below that, a width is a mistake

// Diagnostics may quote a value of any length.
std::string ShortLines(std::string_view text) {
  std::string shown;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    shown += Shortened(std::string(text.substr(at, end - at)));
    if (end < text.size()) shown += '\n';
    at = end + 1;
  }
  return shown;
}

bool IsTerminal(std::FILE* to) { return isatty(fileno(to)) != 0; }

}  // namespace

size_t TerminalColumns(std::FILE* to) {
  if (!IsTerminal(to)) return 0;
  size_t columns = 0;
  if (const char* text = std::getenv("COLUMNS")) columns = std::strtoul(text, nullptr, 10);
  winsize size = {};
  if (columns < kNarrowest && ioctl(fileno(to), TIOCGWINSZ, &size) == 0) columns = size.ws_col;
  return columns < kNarrowest ? 0 : columns;
}

bool ObeysEscapes(std::FILE* to) {
  const char* kind = std::getenv("TERM");
  return IsTerminal(to) && (kind == nullptr || std::strcmp(kind, "dumb") != 0);
}

bool WantsColor(std::FILE* to) {
  const auto set = [](const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  if (set("NO_COLOR")) return false;
  return set("FORCE_COLOR") || ObeysEscapes(to);
}

void SayText(std::FILE* to, std::string_view text) {
  if (to != stdout) std::fflush(stdout);
  const std::string shown = to == stderr ? ShortLines(text) : std::string(text);
  fmt::print(to, "{}", Wrapped(ForTerminal(shown), TerminalColumns(to)));
}

void FindingPrinter::Print(const Diagnostics& diagnostics) {
  for (const Finding& finding : diagnostics.findings()) {
    if (finding.severity == Severity::kWarning && messages_.contains(finding.message) &&
        made_.contains(std::filesystem::path(finding.file).lexically_normal())) {
      continue;
    }
    messages_.insert({finding.message, "left_out: " + finding.message});
    const std::string text = ToText(finding);
    if (reported_.insert(text).second) SayText(to_, text + "\n");
  }
}

ProgressLine::ProgressLine(bool wanted) : active_(wanted && ObeysEscapes(stderr)) {}

void ProgressLine::Show(const std::string& what, double fraction) {
  const int percent = static_cast<int>(100.0 * fraction);
  if (!active_ || (percent == last_percent_ && what == last_what_)) return;
  last_percent_ = percent;
  last_what_ = what;
  const double now_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  std::string done = fmt::format(" {} %", percent);
  if (const std::string left = left_.Text(fraction, now_s); !left.empty()) done += ", " + left;
  // A line that the terminal breaks cannot be taken back: its beginning is left out.
  const size_t columns = TerminalColumns(stderr), taken = done.size() + 2;
  const size_t room = columns > taken ? columns - taken : std::string::npos;
  std::string shown = OneLine(what);
  while (PrintedWidth(shown) > room) shown.erase(0, 1);
  std::fprintf(stderr, "\r\x1b[K%s%s", shown.c_str(), done.c_str());
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
