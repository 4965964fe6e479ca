#include "pipeline/paper_page.h"

#include <fmt/format.h>

namespace mbv {
namespace {

constexpr const char* kHead =
    R"(# The papers' figures, computed anew

Written by `scripts/results paper_figures`; do not edit. `mbverify figures --paper MODEL` draws them
(`docs/how-to/figures.md`); `models/MODEL/paper.yaml` states what they show.

“…” quotes, shortened and in English, what a paper states about a figure. Its place, the printed
number and the computed value follow. The project has the text of the papers, but not their
pictures: a curve that is only drawn there is not compared. Where no "printed" number follows, the
paper gives none.
)";

std::string AuditText(const PaperResult& result) {
  if (result.audit.empty()) return "";
  std::string text;
  for (const std::string& row : result.audit) text += (text.empty() ? "`" : ", `") + row + "`";
  return " Equation audit (`docs/results/equation_audit.md`): " + text + ".";
}

std::string EntryText(const PaperOutcome& paper, const PaperResult& result) {
  std::string text = fmt::format("### {}: {}\n\n", result.name, result.title);
  if (result.table.empty()) {
    text += fmt::format("![{}](../pictures/paper_{}_{}.png)\n\n", result.title, paper.model,
                        result.name);
  } else {
    text += result.table + "\n";
  }
  text += fmt::format("Computed from {}.{}{}\n", result.from, result.note.empty() ? "" : " ",
                      result.note);
  for (const SaidResult& said : result.said) text += "\n* " + SayResult(said);
  if (!result.said.empty()) text += "\n";
  if (!result.differs.empty()) {
    text += "\nThe printed one differs: " + result.differs + AuditText(result) + "\n";
  } else if (!result.audit.empty()) {
    text += "\n" + AuditText(result).substr(1) + "\n";
  }
  return text;
}

}  // namespace

std::string PaperPage(const std::vector<PaperOutcome>& papers) {
  std::string text = kHead;
  for (const PaperOutcome& paper : papers) {
    text += fmt::format("\n## {}\n\n{}\n", paper.model, paper.source);
    for (const PaperResult& result : paper.results) text += "\n" + EntryText(paper, result);
    if (paper.left_out.empty()) continue;
    text += "\n### Not computed\n\n";
    for (const auto& [name, why] : paper.left_out) text += fmt::format("* {}: {}\n", name, why);
  }
  return text;
}

}  // namespace mbv
