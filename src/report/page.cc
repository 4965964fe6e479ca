#include "report/page.h"

#include <fmt/format.h>
#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>

#include "base/markup.h"
#include "report/html_assets.h"

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

std::string HeadHtml(const PageHead& head) {
  const std::string scripts =
      head.script_source.empty() ? "" : "; script-src " + head.script_source;
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src 'unsafe-inline'{}\">\n<meta name=\"color-scheme\" content=\"light dark\">\n"
      "<link rel=\"icon\" href=\"data:,\">\n<title>{}{} – mbverify</title>\n"
      "<style>{}</style>\n</head>\n",
      scripts, Escape(head.title), head.judges ? ": " + WordOf(head) : "", PageStyle());
}

std::string TopHtml(const PageHead& head) {
  const VerdictWords words = WordsOf(head.verdict);
  const std::string sign = fmt::format("<span aria-hidden=\"true\">{}</span> ", words.sign);
  const std::string badge =
      head.judges
          ? fmt::format("<div class=\"badges\"><span class=\"verdict {}\">{}{}</span></div>",
                        ToText(head.verdict), sign, WordOf(head))
          : "";
  return fmt::format(
      "<header class=\"top\"><div><p class=\"kicker\">{}</p><h1>{}</h1><p class=\"lead\">{}</p>"
      "</div>{}</header>\n",
      Escape(head.kicker), Escape(head.title), Escape(head.lead), badge);
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
  return HeadHtml(head) + "<body>\n<a class=\"skip\" href=\"#main\">Skip to the " +
         (head.judges ? "verdict" : "numbers") + "</a>\n" + TopHtml(head) +
         "<nav aria-label=\"Sections\">\n" + navigation_ + "</nav>\n<main id=\"main\">\n" +
         sections_ + "</main>\n<footer>" + Escape(head.footer) + "</footer>\n" + head.scripts +
         "</body>\n</html>\n";
}

}  // namespace mbv
