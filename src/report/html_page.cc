// The page of report.html: verdict, tables and pictures as HTML, data and script behind them.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/inputs.h"
#include "core/markup.h"
#include "core/sha256.h"
#include "report/html_assets.h"
#include "report/html_plots.h"
#include "report/html_report.h"
#include "report/html_tables.h"
#include "report/html_text.h"
#include "report/reference_table.h"

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

// With a capital letter and a full stop.
std::string Sentence(std::string text) {
  if (text.empty()) return text;
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  if (text.back() != '.') text += '.';
  return text;
}

class PageWriter {
 public:
  explicit PageWriter(const HtmlInput& input) : input_(input), report_(*input.report) {}

  std::string Write() {
    Head();
    Verdict();
    Interactive();
    Pictures();
    Add("Checks", "Checks", ChecksHtml(report_));
    Add("The table in the reference's place", "Table", ReferenceTableHtml(report_));
    Add("Drives", "Drives", DrivesHtml(report_));
    Add("What drives and joints bear", "Loads", LoadsHtml(report_));
    Add("The simulator's own error", "Engine", EngineHtml(report_));
    Add("Energy", "Energy", EnergyHtml(report_));
    Add("What could not be compared", "Gaps", NotComparedHtml(report_));
    Add("The paper's equations", "Equations", AuditHtml(input_.audit));
    Add("How to read the force signals", "Signals", SignalsHtml(report_));
    Add("Parameters", "Parameters", ParametersHtml(*input_.mechanism));
    Add("Reproduce this run", "Reproduce", ReproduceHtml(input_));
    return Assemble();
  }

 private:
  std::string Title() const { return report_.mechanism + " / " + report_.scenario; }

  // `link` names the section in the navigation; its lower case is the anchor.
  void Add(const std::string& title, const std::string& link, const std::string& content) {
    if (content.empty()) return;
    std::string id = link;
    id[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(id[0])));
    nav_ += fmt::format("<a href=\"#{}\">{}</a>\n", id, link);
    main_ +=
        fmt::format("<section id=\"{}\"><h2>{}</h2>\n{}</section>\n", id, Escape(title), content);
  }

  void Head() {
    const VerdictWords words = WordsOf(report_.comparison.verdict);
    header_ = fmt::format(
        "<header class=\"top\"><div><p class=\"kicker\">mbverify report</p><h1>{}</h1>"
        "<p class=\"lead\">{}</p></div><div class=\"badges\"><span class=\"verdict {}\">"
        "<span aria-hidden=\"true\">{}</span> {}</span></div></header>\n",
        Escape(Title()), Escape(report_.description), ToText(report_.comparison.verdict),
        words.sign, words.word);
  }

  void Verdict() {
    std::string html =
        "<p class=\"reason\">" + Escape(Sentence(report_.comparison.reason)) + "</p>\n";
    for (const std::string& text : report_.comparison.reservations) {
      html += "<p class=\"reason\"><span class=\"pill warn\">reservation</span> " +
              Escape(Sentence(text)) + "</p>\n";
    }
    const Attribution& attribution = report_.comparison.attribution;
    if (!attribution.text.empty()) {
      html += fmt::format("<p class=\"attribution{}\">{}</p>\n",
                          attribution.odd_one_out.empty() ? "" : " odd",
                          Escape(Sentence(attribution.text)));
    }
    html += "<dl class=\"cards\">\n" + Cards() + "</dl>\n";
    html += "<p class=\"faint\">" + Escape(Sentence(report_.simulation));
    if (!report_.comparison.driving.empty()) {
      html += " " + Escape(Sentence(report_.comparison.driving));
    }
    if (report_.start_window_s > 0.0) {
      html += fmt::format(" Start-up window: forces before {:g} s are not judged.",
                          report_.start_window_s);
    }
    html += "</p>\n" + FindingsHtml(report_);
    Add("Verdict", "Verdict", html);
  }

  std::string Cards() const {
    std::string html;
    if (const PairComparison* pair = MainPair(report_.comparison)) {
      html += ForceCards(*pair);
    }
    for (const WitnessMetrics& witness : report_.comparison.witnesses) {
      if (witness.witness != "simulated") continue;
      const auto add = [&](Metric metric, const char* title, const char* unit) {
        const auto found = witness.metrics.find(metric);
        if (found == witness.metrics.end()) return;
        html += Card(title, fmt::format("{:.1e}{}", found->second.value, unit),
                     fmt::format("simulated, worst at {:.4g} s", found->second.time_s));
      };
      add(Metric::kClosureM, "Largest loop gap", " m");
      add(Metric::kPower, "Power balance", "");
    }
    return html + CountCards();
  }

  std::string ForceCards(const PairComparison& pair) const {
    std::string html;
    const auto nrmse = pair.metrics.find(Metric::kForceNrmse);
    const bool is_floored = nrmse != pair.metrics.end() && nrmse->second.floored;
    const std::string floored = is_floored ? ", floored" : "";
    if (nrmse != pair.metrics.end()) {
      const CheckResult* check = report_.comparison.FindCheck(pair.name() + ".force_nrmse");
      html +=
          Card("Drive force error, RMS", fmt::format("{:.1e}", nrmse->second.value),
               pair.measured + " against " + pair.truth +
                   (check != nullptr && check->limit ? fmt::format(", limit {:.0e}", *check->limit)
                                                     : "") +
                   floored);
    }
    if (std::isfinite(pair.digits)) {
      html += Card("Matching digits", fmt::format("{:.1f}", pair.digits),
                   "of all drive forces" + floored);
    }
    const auto worst = pair.metrics.find(Metric::kForceMax);
    if (worst != pair.metrics.end()) {
      html += Card("Worst sample", fmt::format("{:.1e}", worst->second.value),
                   fmt::format("{} at {:.4g} s", worst->second.channel, worst->second.time_s));
    }
    return html;
  }

  std::string CountCards() const {
    size_t ran = 0, compared = 0, limits = 0;
    for (const WitnessRecord& witness : report_.witnesses) ran += witness.summary.ok() ? 1 : 0;
    for (const PairComparison& pair : report_.comparison.pairs) compared += pair.compared ? 1 : 0;
    for (const CheckResult& check : report_.comparison.checks) limits += check.limit ? 1 : 0;
    return Card("Ran · compared · verified",
                fmt::format("{} · {} · {}", ran, compared, report_.comparison.verified()),
                fmt::format("witnesses of 3 · pairs of 3 · checks of {}", limits));
  }

  // Filled by the script; without it, plots that do not move.
  void Interactive() {
    Add("Replay", "Replay",
        "<noscript><p class=\"faint\">The replay needs JavaScript; the pictures below do not.</p>"
        "</noscript>\n<div id=\"replay-view\"></div>\n");
    Add("Signals over time", "Plots",
        "<noscript><p class=\"faint\">Without JavaScript the plots do not zoom.</p>\n" +
            StaticPlotsHtml(report_) + "</noscript>\n<div id=\"plot-view\"></div>\n");
  }

  void Pictures() {
    std::string html;
    for (const HtmlPicture& picture : input_.pictures) {
      const std::string name = Escape(picture.name);
      html += fmt::format(
          "<a href=\"snapshots/{2}\"><img loading=\"lazy\" alt=\"The mechanism in the simulation, "
          "{0}\" src=\"data:image/png;base64,{1}\"></a>\n",
          name, Base64(std::string_view(picture.png)), EncodeLink(picture.name));
    }
    if (html.empty()) return;
    Add("Snapshots", "Snapshots",
        "<div class=\"pictures\">\n" + html +
            "</div>\n<p class=\"faint\">Small copies; the originals are in snapshots/ beside "
            "this page.</p>\n");
  }

  // Only our own script runs: the one in the page by its hash, a shared one by its origin.
  [[nodiscard]] std::string ScriptSource() const {
    static const std::string hash = CspHash(PageScript());
    return input_.script_link.empty() ? hash : "'self'";
  }

  [[nodiscard]] std::string ScriptElement() const {
    if (input_.script_link.empty()) {
      return fmt::format("<script>{}</script>", PageScript());
    }
    return fmt::format("<script src=\"{}\"></script>", EncodeLink(input_.script_link));
  }

  // The policy forbids every other request: what is shown is in this file.
  std::string Assemble() const {
    return "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
           "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src "
           "data:; style-src 'unsafe-inline'; script-src " +
           ScriptSource() +
           "\">\n"
           "<meta name=\"color-scheme\" content=\"light dark\">\n"
           "<link rel=\"icon\" href=\"data:,\">\n<title>" +
           Escape(Title()) + ": " + WordsOf(report_.comparison.verdict).word +
           " – mbverify</title>\n<style>" + std::string(PageStyle()) +
           "</style>\n</head>\n<body>\n<a class=\"skip\" href=\"#main\">Skip to the verdict</a>\n" +
           header_ + "<nav aria-label=\"Sections\">\n" + nav_ + "</nav>\n<main id=\"main\">\n" +
           main_ +
           "</main>\n<footer>Written by mbverify. Forces, errors and poses are embedded; "
           "all digits are in traces.csv and summary.json.</footer>\n"
           "<script type=\"application/json\" id=\"page-data\">" +
           PageData(input_) + "</script>\n" + ScriptElement() + "\n</body>\n</html>\n";
  }

  const HtmlInput& input_;
  const Report& report_;
  std::string header_, nav_, main_;
};

}  // namespace

std::string SharedScriptName() {
  return fmt::format("report-{}.js", ContentFingerprint(std::string(PageScript())));
}

std::string ToHtml(const HtmlInput& input) { return PageWriter(input).Write(); }

}  // namespace mbv
