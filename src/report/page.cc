#include "report/page.h"

#include <fmt/format.h>

#include <cctype>

#include "report/html_assets.h"
#include "report/html_text.h"

namespace mbv {
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
  const std::string sign =
      head.sign ? fmt::format("<span aria-hidden=\"true\">{}</span> ", words.sign) : "";
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
  id[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(id[0])));
  navigation_ += fmt::format("<a href=\"#{}\">{}</a>\n", id, link);
  sections_ +=
      fmt::format("<section id=\"{}\"><h2>{}</h2>\n{}</section>\n", id, Escape(title), content);
}

std::string Page::Write(const PageHead& head) const {
  return HeadHtml(head) + "<body>\n<a class=\"skip\" href=\"#main\">Skip to the " +
         (head.judges ? "verdict" : "numbers") + "</a>\n" + TopHtml(head) +
         "<nav aria-label=\"Sections\">\n" + navigation_ + "</nav>\n<main id=\"main\">\n" +
         sections_ + "</main>\n<footer>" + Escape(head.footer) + "</footer>\n" + head.scripts +
         "</body>\n</html>\n";
}

}  // namespace mbv
