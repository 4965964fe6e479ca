#include "base/diagnostics.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "base/text.h"

namespace mbv {
namespace {

// Levenshtein distance with two rows.
size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> previous(b.size() + 1), current(b.size() + 1);
  std::iota(previous.begin(), previous.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    current[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t substitution = previous[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      current[j] = std::min({previous[j] + 1, current[j - 1] + 1, substitution});
    }
    std::swap(previous, current);
  }
  return previous[b.size()];
}

}  // namespace

// Files that are read for several purposes give their findings once.
void Diagnostics::AddError(const std::string& file, std::string message, std::string hint) {
  Add({.file = file, .message = std::move(message), .hint = std::move(hint)});
}

void Diagnostics::Append(const Diagnostics& other) {
  const auto parts = [](const Finding& f) {
    return std::tie(f.severity, f.file, f.line, f.column, f.message, f.hint);
  };
  for (const Finding& finding : other.findings_) {
    const bool known = std::any_of(findings_.begin(), findings_.end(),
                                   [&](const Finding& f) { return parts(f) == parts(finding); });
    if (!known) findings_.push_back(finding);
  }
}

bool Diagnostics::has_errors() const {
  return std::any_of(findings_.begin(), findings_.end(),
                     [](const Finding& f) { return f.severity == Severity::kError; });
}

std::string Diagnostics::Text() const {
  std::string text;
  for (const Finding& finding : findings_) text += ToText(finding) + "\n";
  return text;
}

namespace {

// Names and values come from files: none begins a line that looks like another finding.
std::string Indented(const std::string& text) {
  std::string shown;
  for (size_t from = 0; from <= text.size();) {
    const size_t end = std::min(text.find('\n', from), text.size());
    shown += (from == 0 ? "" : "\n    ") + OneLine(text.substr(from, end - from));
    from = end + 1;
  }
  return shown;
}

}  // namespace

std::string ToText(const Finding& finding) {
  std::string text;
  if (!finding.file.empty()) {
    text += OneLine(finding.file) + ":";
    if (finding.line > 0) {
      text += std::to_string(finding.line) + ":" + std::to_string(finding.column) + ":";
    }
    text += " ";
  }
  text += finding.severity == Severity::kError ? "error: " : "warning: ";
  text += Indented(Shortened(finding.message));
  if (!finding.hint.empty()) text += "\n  hint: " + Indented(Shortened(finding.hint));
  return text;
}

std::string ClosestWord(const std::string& word, const std::vector<std::string>& candidates) {
  std::string best;
  size_t best_distance = std::max<size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const size_t lengths =
        std::max(word.size(), candidate.size()) - std::min(word.size(), candidate.size());
    if (lengths >= best_distance) continue;  // the least distance
    const size_t distance = EditDistance(word, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string DidYouMean(const std::string& word, const std::vector<std::string>& candidates) {
  constexpr size_t kLongest = 1000;  // the time grows with the square
  const std::string near = word.size() > kLongest ? "" : ClosestWord(word, candidates);
  return near.empty() ? "" : fmt::format("did you mean '{}'?", near);
}

}  // namespace mbv
