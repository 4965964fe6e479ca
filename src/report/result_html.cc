#include "report/result_html.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mbv {
namespace {

// Limit over value as a factor, with a bar of its decimal digits (ten fill it).
std::string Margin(const ShownCheck& check) {
  if (!check.limit || !std::isfinite(check.value)) return "";
  if (check.value <= 0.0) return "exact";
  const double digits = std::log10(*check.limit / check.value);
  const double filled = std::clamp(10.0 * std::abs(digits), 2.0, 100.0);
  const std::string factor = digits >= 0.0
                                 ? fmt::format("{:.3g}×", *check.limit / check.value)
                                 : fmt::format("{:.3g}× over", check.value / *check.limit);
  return fmt::format("<span class=\"margin{}\"><i style=\"width:{:.0f}%\"></i></span> {}",
                     check.pass ? "" : " over", filled, factor);
}

std::string EndPill(const ShownCheck& check) {
  switch (EndOf(check)) {
    case CheckEnd::kOff:
      return Pill("off", "off");
    case CheckEnd::kFail:
      return Pill("fail", "fail");
    case CheckEnd::kVoid:
      return Pill("warn", "verifies nothing");
    case CheckEnd::kHeld:
      return Pill("off", "held");
    case CheckEnd::kOk:
      return Pill("ok", "ok");
  }
  return "";
}

std::vector<Cell> CheckRow(const ShownCheck& check, bool margins) {
  std::vector<Cell> row = {
      Text(Spaced(check.subject)), Text(check.title), Digits(NumberOrDash(check.value)),
      Digits(check.limit ? fmt::format("{:.1e}", *check.limit) : "off"),
      Markup(EndPill(check) + (check.floored ? " " + Pill("warn", "floored") : ""))};
  if (margins) row.push_back(Markup(check.blind.empty() ? Margin(check) : ""));
  row.push_back(Text(WhereOf(check)));
  return row;
}

}  // namespace

const char* SourceWord(Source source) {
  switch (source) {
    case Source::kPrinted:
      return "printed";
    case Source::kAssumed:
      return "assumed";
    case Source::kCorrected:
      return "corrected";
    case Source::kUnstated:
      break;
  }
  return "";
}

PageHead HeadOf(const ResultView& view) {
  return {.title = view.frame->title(),
          .lead = view.frame->description,
          .verdict = view.verdict,
          .sign = view.look.signs};
}

std::string VerdictHtml(const ResultView& view, const std::string& cards,
                        const std::string& about) {
  const auto sentence = [&](const std::string& text) {
    return Escape(view.look.capitals ? Sentence(text) : text + ".");
  };
  std::string html = "<p class=\"reason\">" + sentence(view.reason) + "</p>\n";
  for (const Caveat& caveat : view.caveats.value_or(std::vector<Caveat>{})) {
    html +=
        "<p class=\"reason\">" + Pill("warn", "caveat") + " " + sentence(caveat.text) + "</p>\n";
  }
  if (!view.attribution.text.empty()) {
    html += fmt::format("<p class=\"attribution{}\">{}</p>\n",
                        view.attribution.odd_one_out.empty() ? "" : " odd",
                        sentence(view.attribution.text));
  }
  html += "<dl class=\"cards\">\n" + cards + "</dl>\n" + Note(about);
  if (view.frame->findings.empty()) return html;
  html += "<ul class=\"findings\">\n";
  for (const Finding& finding : view.frame->findings.findings()) {
    html += "<li>" + Escape(ToText(finding)) + "</li>\n";
  }
  return html + "</ul>\n";
}

std::string ChecksHtml(const ResultView& view, const std::string& note) {
  if (view.checks.empty()) return "";
  const bool margins = view.look.margins;
  Table table{.caption = "Checks, failed ones first",
              .head = {Text("of"), Text("quantity"), Digits("value"), Digits("limit"),
                       Text(margins ? "result" : "")},
              .rows = {}};
  if (margins) table.head.push_back(Text("margin"));
  table.head.push_back(Text("worst at"));
  for (const bool failed : {true, false}) {
    for (const ShownCheck& check : view.checks) {
      if ((EndOf(check) == CheckEnd::kFail) == failed)
        table.rows.push_back(CheckRow(check, margins));
    }
  }
  return ToHtml(table) + Note(note);
}

std::string GapsHtml(const ResultView& view) {
  std::string html;
  for (const auto& [name, summary] : view.witnesses) {
    if (summary.ok()) continue;
    html += "<li><b>" + Escape(name) + "</b>: " + Escape(ToText(summary.stop)) + ". " +
            Escape(summary.message) + "</li>\n";
  }
  for (const NotCompared& item : view.not_compared) {
    html += "<li><b>" + Escape(item.what) + "</b>: " + Escape(item.why) + "</li>\n";
  }
  return html.empty() ? "" : "<ul>\n" + html + "</ul>\n";
}

std::string ParametersHtml(const std::vector<Parameter>& parameters, bool sources) {
  if (parameters.empty()) return "";
  Table table{.caption = "Parameters with the scenario's overrides",
              .head = {Text("name"), Digits("value"), Text("unit")},
              .rows = {}};
  if (sources) table.head.push_back(Text("source"));
  table.head.push_back(Text("note"));
  for (const Parameter& parameter : parameters) {
    std::vector<Cell> row = {Text(parameter.name), Digits(fmt::format("{:.10g}", parameter.value)),
                             Text(parameter.unit)};
    if (sources) row.push_back(Text(SourceWord(parameter.source)));
    row.push_back(Text(parameter.note));
    table.rows.push_back(std::move(row));
  }
  return Folded(fmt::format("{} parameters", parameters.size()), ToHtml(table));
}

std::string ReproduceHtml(const ResultView& view, const std::string& command,
                          const std::string& times, const std::string& files) {
  Table table{.caption = "Inputs and versions", .head = {Text("what"), Text("is")}, .rows = {}};
  if (!view.frame->scenario_file.empty()) {
    table.rows.push_back({Text("scenario"), Text(view.frame->scenario_file)});
  }
  table.rows.push_back({Text("model"), Text(view.frame->model_file)});
  for (const auto& [name, version] : view.frame->versions) {
    table.rows.push_back({Text(name), Text(version)});
  }
  if (!times.empty()) table.rows.push_back({Text("time taken"), Text(times)});
  return "<pre tabindex=\"0\"><code>" + Escape(command) + "</code></pre>\n" + ToHtml(table) +
         Note(files);
}

}  // namespace mbv
