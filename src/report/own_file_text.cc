#include "report/own_file_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/json_text.h"
#include "report/html_text.h"
#include "report/own_file_words.h"

namespace mbv {
namespace {

using Cells = std::vector<std::vector<std::string>>;

// Columns as wide as their widest cell; the first to the left.
void WriteTable(const std::vector<std::string>& head, const Cells& rows, TerminalText* out) {
  std::vector<TextColumn> columns;
  for (size_t c = 0; c < head.size(); ++c) {
    size_t width = head[c].size();
    for (const auto& row : rows) width = std::max(width, row[c].size());
    const int wide = static_cast<int>(width);
    columns.push_back({head[c], c == 0 ? -wide : wide + 2});
  }
  const TextTable table("    ", columns);
  out->TableHead(table);
  for (const auto& row : rows) out->Line(table.Row(row));
}

void WriteLines(const std::vector<std::string>& lines, TerminalText* out) {
  for (const std::string& line : lines) out->Line("    " + line);
}

}  // namespace

void WriteOwnFile(const OwnFileAudit& audit, TerminalText* out) {
  out->Line();
  out->Line("  " + Sentence(OwnFileSentence(audit)));
  if (!audit.declined.empty()) return;
  WriteLines({SettingsLine(audit)}, out);
  WriteLines(audit.done, out);
  WriteLines(audit.notes, out);
  WriteLines(MeasuredLines(audit), out);
  WriteTable(CauseHead(), CauseCells(audit), out);
  if (!audit.Good(audit.as_is)) out->Line("    " + CauseSentence(audit));
  if (audit.searched) {
    WriteTable(TrialHead(), TrialCells(audit, out->verbose()), out);
    WriteLines(SearchLines(audit), out);
  }
  if (!audit.lines.empty()) {
    out->Line();
    out->Line("    to mend it, paste this before </mujoco>:");
    std::string lines = audit.lines;
    for (size_t end = lines.find('\n'); end != std::string::npos; end = lines.find('\n')) {
      out->Line("      " + lines.substr(0, end));
      lines.erase(0, end + 1);
    }
    WriteLines(PastedLines(audit), out);
  }
  out->Line(
      fmt::format("    all of this took {:.1f} s (--no-own-file leaves it out)", audit.seconds));
}

namespace {

std::string TableHtml(const std::string& caption, const std::vector<std::string>& head,
                      const Cells& rows) {
  Table table{.caption = caption, .head = {}, .rows = {}};
  for (size_t c = 0; c < head.size(); ++c) table.head.push_back({head[c], c > 0});
  for (const auto& row : rows) {
    std::vector<Cell> cells;
    for (size_t c = 0; c < row.size(); ++c) cells.push_back({row[c], c > 0});
    table.rows.push_back(std::move(cells));
  }
  return ToHtml(table);
}

std::string ListHtml(const std::vector<std::string>& lines) {
  std::string html;
  for (const std::string& line : lines) html += "<li>" + Escape(line) + "</li>\n";
  return html.empty() ? "" : "<ul>\n" + html + "</ul>\n";
}

std::string Paragraph(const std::string& text) {
  return text.empty() ? "" : "<p>" + Escape(text) + "</p>\n";
}

}  // namespace

std::string OwnFileHtml(const OwnFileAudit* audit) {
  if (audit == nullptr) return "";
  std::string html = "<p class=\"reason\">" + Escape(Sentence(OwnFileSentence(*audit))) + "</p>\n";
  if (!audit->declined.empty()) return html;
  html += ListHtml(MeasuredLines(*audit)) + ListHtml(audit->notes);
  html += Folded("How it was run", ListHtml({SettingsLine(*audit)}) + ListHtml(audit->done));
  html += TableHtml("One thing mended at a time", CauseHead(), CauseCells(*audit));
  if (!audit->Good(audit->as_is)) html += Paragraph(CauseSentence(*audit));
  std::string meanings;
  for (const OwnCause& cause : audit->causes) {
    meanings +=
        "<p><b>" + Escape(Sentence(cause.title)) + "</b> " + Escape(cause.meaning) + "</p>\n";
  }
  html += Folded("What these things are", meanings);
  if (audit->searched) {
    html += TableHtml("Settings: error against cost", TrialHead(), TrialCells(*audit, false)) +
            Folded("All settings that were run",
                   TableHtml("All settings", TrialHead(), TrialCells(*audit, true))) +
            ListHtml(SearchLines(*audit));
  }
  if (!audit->lines.empty()) {
    html += "<p>To mend it, paste this before <code>&lt;/mujoco&gt;</code>:</p>\n<pre>" +
            Escape(audit->lines) + "</pre>\n" + ListHtml(PastedLines(*audit));
  }
  return html +
         Note(fmt::format("Every number is a run of MuJoCo on the file itself, in all {:.1f} "
                          "s. The verdict does not depend on it.",
                          audit->seconds));
}

namespace {

using Json = nlohmann::ordered_json;

Json ErrorJson(const OwnError& e) {
  if (!e.sound()) return {{"failure", e.failure}, {"time_s", Number(e.time_s)}};
  return {{"force_nrmse_later", Number(e.force)},
          {"force_nrmse", Number(e.force_all)},
          {"force_max",
           {{"value", Number(e.force_most)},
            {"unit", e.force_unit},
            {"drive", e.drive},
            {"time_s", Number(e.force_at_s)}}},
          {"joint_force_nrmse_later", Number(e.joint_force)},
          {"loop_gap_m", Number(e.gap_m)},
          {"loop_gap_joint", e.joint},
          {"loop_gap_time_s", Number(e.gap_at_s)},
          {"loop_twist_rad", Number(e.gap_rad)},
          {"loop_twist_joint", e.twisted},
          {"loop_twist_time_s", Number(e.gap_rad_at_s)},
          {"ms_per_s", Number(e.cost_ms)}};
}

}  // namespace

nlohmann::ordered_json OwnFileJson(const OwnFileAudit& audit) {
  Json json = {{"file", audit.file}, {"sentence", OwnFileSentence(audit)}};
  if (!audit.declined.empty()) {
    json["declined"] = audit.declined;
    return json;
  }
  json["good"] = audit.Good(audit.as_is);
  json["settings"] = {{"step_s", Number(audit.step_s)}, {"integrator", audit.integrator},
                      {"solver", audit.solver},         {"closures", audit.closures},
                      {"solref", audit.solref},         {"solimp", audit.solimp}};
  json["done"] = audit.done;
  json["notes"] = audit.notes;
  json["later_s"] = audit.later_s;
  json["as_is"] = ErrorJson(audit.as_is);
  json["causes"] = Json::array();
  for (const OwnCause& cause : audit.causes) {
    json["causes"].push_back({{"cause", cause.key},
                              {"title", cause.title},
                              {"removes", Number(Removed(audit.as_is.force, cause.without.force))},
                              {"without", ErrorJson(cause.without)},
                              {"alone", ErrorJson(cause.alone)}});
  }
  json["mended"] = ErrorJson(audit.mended);
  json["trials"] = Json::array();
  for (const OwnTrial& trial : audit.trials) {
    json["trials"].push_back({{"step_s", Number(trial.step_s)},
                              {"integrator", trial.integrator},
                              {"solref", trial.solref},
                              {"solimp", trial.solimp},
                              {"other", trial.other},
                              {"front", trial.front},
                              {"error", ErrorJson(trial.error)}});
  }
  json["recommended"] = audit.recommended;
  json["lines"] = audit.lines;
  json["closures_with_own_settings"] = audit.stubborn;
  if (!audit.lines.empty()) json["pasted"] = ErrorJson(audit.pasted);
  json["seconds"] = Number(audit.seconds);
  return json;
}

}  // namespace mbv
