#include "report/page.h"

#include <fmt/format.h>
#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>

#include "base/demand.h"
#include "base/markup.h"

namespace mbv {
std::string Escape(std::string_view text) { return EscapeMarkup(text); }

std::string Base64(std::string_view bytes) { return EncodeBase64(bytes); }

std::string Base64(std::span<const float> values) {
  std::string bytes;
  bytes.reserve(4 * values.size());
  for (const float value : values) {
    const auto word = std::bit_cast<std::uint32_t>(value);
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(word >> shift & 255U);
  }
  return Base64(bytes);
}

std::string NumberOrDash(double value, const char* format) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "–";
}

std::string Sentence(std::string text) {
  if (text.empty()) return text;
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  if (text.back() != '.') text += '.';
  return text;
}

std::string Folded(const std::string& title, const std::string& content) {
  return "<details><summary>" + Escape(title) + "</summary>" + content + "</details>\n";
}

std::string FigureHtml(const std::string& svg) { return "<figure>" + svg + "</figure>\n"; }

std::string Note(const std::string& text) { return "<p class=\"faint\">" + text + "</p>\n"; }

std::string Pill(const char* kind, const std::string& text) {
  return fmt::format("<span class=\"pill {}\">{}</span>", kind, Escape(text));
}

std::string Card(const std::string& title, const std::string& value, const std::string& detail) {
  return fmt::format("<div class=\"card\"><dt>{}</dt><dd><b>{}</b>{}</dd></div>\n", Escape(title),
                     Escape(value), detail.empty() ? "" : "<span>" + Escape(detail) + "</span>");
}

std::string Spaced(std::string text) {
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

namespace {

struct VerdictWords {
  const char *word, *sign;
};
VerdictWords WordsOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kAgree:
      return {"Agree", "✓"};
    case Verdict::kDisagree:
      return {"Disagree", "✗"};
    case Verdict::kNotRun:
      return {"Not run", "?"};
  }
  return {"?", "?"};
}

std::string WordOf(const PageHead& head) {
  return head.word.empty() ? WordsOf(head.verdict).word : Escape(head.word);
}

// The verdict's word beside the title, on its coloured ground.
std::string BadgeHtml(const PageHead& head) {
  if (!head.judges) return "";
  return fmt::format(
      "<div class=\"badges\"><span class=\"verdict {}\"><span aria-hidden=\"true\">{}</span> "
      "{}</span></div>",
      ToText(head.verdict), WordsOf(head.verdict).sign, WordOf(head));
}

}  // namespace

void Page::Add(const std::string& title, const std::string& link, const std::string& content) {
  if (content.empty()) return;
  std::string id = link;
  if (!id.empty()) id[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(id[0])));
  navigation_ += fmt::format("<a href=\"#{}\">{}</a>\n", Escape(id), Escape(link));
  sections_ += fmt::format("<section id=\"{}\"><h2>{}</h2>\n{}</section>\n", Escape(id),
                           Escape(title), content);
}

std::string Page::Write(const PageHead& head) const {
  const std::string policy = head.script_source.empty() ? "" : "; script-src " + head.script_source;
  const std::string title = Escape(head.title), kicker = Escape(head.kicker);
  const std::string lead = Escape(head.lead), footer = Escape(head.footer);
  const std::string verdict = head.judges ? ": " + WordOf(head) : "", badge = BadgeHtml(head);
  return FillPage(PageSkeleton(), {{"script_policy", policy},
                                   {"title", title},
                                   {"verdict", verdict},
                                   {"style", PageStyle()},
                                   {"main", head.judges ? "verdict" : "numbers"},
                                   {"kicker", kicker},
                                   {"lead", lead},
                                   {"badge", badge},
                                   {"navigation", navigation_},
                                   {"sections", sections_},
                                   {"footer", footer},
                                   {"scripts", head.scripts}});
}

std::string FillPage(std::string_view skeleton,
                     const std::map<std::string_view, std::string_view>& values) {
  std::string page;
  for (size_t at = 0; at < skeleton.size();) {
    const size_t begin = std::min(skeleton.find("{{", at), skeleton.size());
    page += skeleton.substr(at, begin - at);
    if (begin == skeleton.size()) break;
    const size_t end = skeleton.find("}}", begin);
    MBV_DEMAND(end != std::string_view::npos, begin);
    page += values.at(skeleton.substr(begin + 2, end - begin - 2));
    at = end + 2;
  }
  return page;
}

}  // namespace mbv
